// A garment without some of its panels. Private to the library.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <vector>

namespace toile::tailor {

/// Everything that belongs to the panels goes with them; the rest keeps its order and is numbered anew.
/// removed  |panels|. Precondition: nothing is sewn or fastened to them, no free layer names them.
mesh::GarmentMesh without_panels(const mesh::GarmentMesh& garment, const std::vector<char>& removed);

}  // namespace toile::tailor
