// Some panels of a garment as a garment of their own: assembly goes in stages, as in the workshop.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <vector>

namespace toile::placement {

using mesh::Points3;

struct Subset {
  mesh::GarmentMesh mesh;      ///< uv, faces, welds, hinges and fasteners of the panels kept; all tables, ids unchanged
  std::vector<int> vertex_of;  ///< of the whole garment, for every vertex of the subset
  Points3 restricted(const Points3& whole) const;
  std::vector<double> restricted(const std::vector<double>& whole) const;  ///< empty stays empty
  /// whole with the subset's positions put in.
  Points3 merged(const Points3& subset, const Points3& whole) const;
};

/// The same, but a whole garment: tables hold only what belongs to the panels kept, numbered anew (seams keep their ids).
Subset take_apart(const mesh::GarmentMesh& garment, const std::vector<char>& keep);

/// keep  per panel, |panels|
Subset take(const mesh::GarmentMesh& garment, const std::vector<char>& keep);

}  // namespace toile::placement
