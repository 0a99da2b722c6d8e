// Garments, supports and settings reflected in the plane x = 0.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/layout.h"
#include "toile/placement/params.h"

namespace toile::placement {

/// As if every panel were cut with its piece turned over: x and u change sign, faces are turned, so that the face side stays
/// the image of the face side. Vertex and face numbers stay, names too. Twice gives the same bits.
mesh::GarmentMesh mirrored(const mesh::GarmentMesh& garment);
/// Vertex and face numbers and all names stay.
mesh::SupportMesh mirrored(const mesh::SupportMesh& support);
Part mirrored(Part part);
/// Left and right regions exchanged, shifts and turns reversed.
PlaceParams mirrored(const PlaceParams& params);

/// One of a support and its mirror image is left-handed, the other is not: whether the first vertex off the plane x = 0 has x < 0.
bool left_handed(const mesh::SupportMesh& support);

}  // namespace toile::placement
