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
  /// whole with the subset's positions put in.
  Points3 merged(const Points3& subset, const Points3& whole) const;
};

/// keep  per panel, |panels|
Subset take(const mesh::GarmentMesh& garment, const std::vector<char>& keep);

}  // namespace toile::placement
