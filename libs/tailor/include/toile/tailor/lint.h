// Faults of garments that a file may hold although it is well formed.
#pragma once

#include "toile/mesh/garment_mesh.h"

namespace toile::tailor {

struct Lint {
  Issues errors;    ///< category check
  Issues warnings;  ///< category check
};

/// errors    turned_face (no area, or face side down, in panel coordinates), degenerate_face (two corners are one
/// particle),
///           branching_edge (more than two faces of one panel), loose_vertex, run_off_mesh (a step of a run is no edge
///           of the mesh), run_off_border (an edge of the panel lies inside it)
/// warnings  sharp_triangles (below 20 degrees), partly_layered (some faces have a fabric, others none),
///           not_converged, far_welds (welded vertices more than 1 mm apart in a garment that was simulated)
/// Of each kind the first place and the number. Precondition: mesh::validate(garment) is empty.
Lint lint(const mesh::GarmentMesh& garment);

}  // namespace toile::tailor
