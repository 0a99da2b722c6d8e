// Pleats from the pattern to the sewn garment (docs/tailoring.md, "Pleats").
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/pattern/pleat.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/sew.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// The lines that pleats need as edges of the mesh, for `MeshParams::lines`. Pieces cut on the fold have them on both halves.
std::vector<std::string> pleat_lines(const pattern::Pleated& pleated);

/// Folds of all panels cut from pleated pieces, named PANEL.LINE.
/// garment  cut from pleated.pattern with pleat_lines()
std::vector<FoldSpec> pleat_folds(const mesh::GarmentMesh& garment, const pattern::Pleated& pleated, const std::vector<pattern::PleatSpec>& specs);

/// Replaces each pleated seam by plain ones: from fold to fold of its pleated side one for each stretch of hidden or visible
/// cloth, NAME_1, NAME_2, ..., and NAME_down_1, ... where its pleats are stitched down. Tapes, threads, allowances and angles are
/// left to finish_seams().
/// garment  panels as cut, with the folds of their pleats
/// error    "no_pleats", "pleats_on_both_sides", "half_pleat", "pleat_past_end", "pleats_and_match", "seam_length", and those of
///          references
Result<SewParams> expand_pleats(const mesh::GarmentMesh& garment, const SewParams& params);

}  // namespace toile::tailor
