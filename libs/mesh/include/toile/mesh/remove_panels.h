// A garment without some of its panels.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <vector>

namespace toile::mesh {

/// Everything that belongs to the panels goes with them: also the welds, fasteners and hinges that join them to others, and free
/// layers of which nothing is left. The rest keeps its order and is numbered anew; seams keep their ids.
/// removed  |panels|
GarmentMesh without_panels(const GarmentMesh& garment, const std::vector<char>& removed);

}  // namespace toile::mesh
