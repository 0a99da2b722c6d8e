// Pleats from the pattern to the sewn garment (docs/tailoring.md, "Pleats").
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/pattern/pleat.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/mesh_panels.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// The lines that pleats need as edges of the mesh, for `MeshParams::lines`. Pieces cut on the fold have them on both halves.
std::vector<std::string> pleat_lines(const pattern::Pleated& pleated);

/// Folds of all panels cut from pleated pieces, named PANEL.LINE.
/// garment  cut from pleated.pattern with pleat_lines()
std::vector<FoldSpec> pleat_folds(const mesh::GarmentMesh& garment, const pattern::Pleated& pleated, const std::vector<pattern::PleatSpec>& specs);

}  // namespace toile::tailor
