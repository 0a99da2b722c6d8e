// Panels that stand on their seams (collars, flaps): they continue the panels that they are sewn to, following the
// support.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/folds.h"
#include "toile/placement/layout.h"

#include <vector>

namespace toile::placement {

/// Places all attached panels, in the order in which their longest seams to placed panels become known. A panel is laid as a
/// ruled strip: its sewn edge beside its mates, from there over the support; what folds back lies on the outside, past
/// the seam over the panels it is sewn to.
/// garment  (a coarse one, usually) with panels and welds
/// folded   of the same vertices
/// x        positions of the placed panels [m], |V| x 3
/// offset   from the support [m]
/// ret      x with the attached panels placed; panels without a seam to placed ones stay as they are
Points3 attach(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const Layout& layout, const Points3& x, const mesh::SupportMesh& support, double offset);

}  // namespace toile::placement
