// Placement of a sewn flat garment on a support: layout, bending around the support's parts, isometric relaxation.
// Method and limits: docs/placement.md.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/flatten.h"
#include "toile/placement/layout.h"
#include "toile/placement/params.h"

#include <functional>
#include <string>
#include <vector>

namespace toile::placement {

struct SeamGap {
  int seam = 0;
  double mean = 0, largest = 0;  ///< distance of welded pairs [m]
};

struct Report {
  double max_strain = 0, rms_strain = 0;  ///< of all edges [1]
  double area_change = 0;                 ///< placed over flat area, minus 1
  double smallest_gap = 0;                ///< of a vertex from the support [m], negative inside
  int vertices_inside = 0;
  int support_intersections = 0;          ///< pairs of cloth and support triangles
  int self_intersections = 0;
  double mean_seam_gap = 0, largest_seam_gap = 0;  ///< of all welded pairs [m]
  std::vector<SeamGap> seams;
};

struct Placed {
  mesh::GarmentMesh garment;
  Report report;
  Issues findings;  ///< checks that failed (Category::check)
  Issues warnings;  ///< what was left to the simulation
};

/// error  what make_layout refuses; "too_narrow" for panels that cannot go round their part of the support
Result<Placed> place(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const PlaceParams& params,
                     const std::function<void(double)>& progress = {});

/// Panels bent around the flattened support, before the relaxation. The flattening is chosen where params leave it open.
struct Start {
  Points3 x;
  Flattening flattening;  ///< of the support that the panels were bent around
};
Result<Start> bend(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const BodyFrame& frame, const Layout& layout, const PlaceParams& params);

Report measure(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support);

}  // namespace toile::placement
