// A triangle mesh prepared for contact search: its edges, used nodes and who neighbours whom.
#pragma once

#include "toile/mesh/types.h"

#include <array>
#include <vector>

namespace toile::contact {

using mesh::Ids;
using mesh::Points3;
using mesh::Triangles;

/// Topology only; positions come with every call. Primitives are vertices (node ids), edges and faces.
struct Surface {
  int node_count = 0;                          ///< rows of every position array that goes with this surface
  Triangles faces;                             ///< node ids, |F| x 3
  std::vector<std::array<int, 2>> edges;       ///< node ids (lower first), ordered; each edge once, |E|
  std::vector<std::array<int, 3>> face_edges;  ///< edge k of a face joins its corners k and k+1, |F|
  std::vector<std::array<int, 2>> edge_faces;  ///< lowest two faces of an edge, -1 where there is none, |E|
  std::vector<int> vertices;                   ///< nodes used by a face, increasing
  Ids adjacency;                               ///< |nodes|: primitives that share one of these ids never touch one another
};

/// faces      node ids in [0, node_count), |F| x 3
/// adjacency  id per node, |nodes|: nodes with the same id count as one node when neighbours are left out (the two
///            sides of a seam that is not closed yet); empty: every node is its own
Surface make_surface(int node_count, const Triangles& faces, const Ids& adjacency = {});

}  // namespace toile::contact
