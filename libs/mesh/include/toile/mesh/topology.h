#pragma once

#include "toile/mesh/types.h"

#include <array>
#include <vector>

namespace toile::mesh {

/// An undirected edge with its faces.
struct Edge {
  int a = 0, b = 0;           ///< a < b
  std::vector<int> faces;     ///< in increasing order; one at a border, more than two where three panels meet
};

/// All edges of a triangle list, ordered by (a, b). `faces` may hold vertex or particle ids.
std::vector<Edge> edges(const Triangles& faces);

/// Border loops as vertex rows, each closed implicitly; walks with the surface on the left. Loops start at their lowest id
/// and are ordered by it. Precondition: the surface is a manifold with border.
std::vector<std::vector<int>> border_loops(const Triangles& faces);

/// Vertices - edges + faces of what is actually used.
int euler_number(const Triangles& faces);

/// Number of connected pieces.
int component_count(const Triangles& faces);

/// faces with every vertex id replaced by map[id].
Triangles mapped(const Triangles& faces, const Ids& map);

}  // namespace toile::mesh
