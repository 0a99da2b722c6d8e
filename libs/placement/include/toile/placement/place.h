// Placement of a sewn flat garment on a support: layout, bending around the support's parts, isometric relaxation.
// Method and limits: docs/placement.md.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/fit_up.h"
#include "toile/placement/flatten.h"
#include "toile/placement/layout.h"
#include "toile/placement/params.h"
#include "toile/placement/report.h"

#include <functional>
#include <string>
#include <vector>

namespace toile::placement {

struct Placed {
  mesh::GarmentMesh garment;
  Report report;
  std::vector<HeldLine> lines;      ///< where params name some
  std::vector<LineGap> line_gaps;  ///< of them
  Issues findings;  ///< checks that failed (Category::check)
  Issues warnings;  ///< what was left to the simulation
};

/// With params.lines the garment is spread between curves of a frame (fit_up.h), otherwise laid round a body.
/// error  what make_layout, held_lines and spread refuse; "unknown_region" for an offset over a region that the support does not have; "too_narrow" for panels that cannot go round their part of the support
Result<Placed> place(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const PlaceParams& params,
                     const std::function<void(double)>& progress = {});

/// The relaxation alone, from given positions near the support: seams close and let go (`fine_steps`), stretch is taken out.
/// start  [m], |V| x 3
/// error  "unknown_region"; "bad_combination" if params.lines says where it begins as well
Result<Placed> place_from(const mesh::GarmentMesh& garment, const Points3& start, const mesh::SupportMesh& support, const PlaceParams& params,
                  const std::function<void(double)>& progress = {});

/// Panels bent around the flattened support, before the relaxation. The flattening is chosen where params leave it open.
struct Start {
  Points3 x;
  Flattening flattening;  ///< of the support that the panels were bent around
};
Result<Start> bend(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const BodyFrame& frame, const Layout& layout, const PlaceParams& params);

}  // namespace toile::placement
