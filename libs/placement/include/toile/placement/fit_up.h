// Fit-up of technical textiles: lines of a sewn garment go to curves of a frame (a soft top on its bows, a tarpaulin on its
// poles), the cloth between them is spread as near to isometric as it gets.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/frame_params.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace toile::placement {

using mesh::Points3;

/// A vertex and the place on its curve.
struct Target {
  int vertex = 0;
  Eigen::Vector3d at;  ///< [m]
};

/// A line of the garment on its curve.
struct HeldLine {
  std::string name;               ///< its edges, as the spec names them
  std::string curve;
  double length = 0;              ///< of the cloth's line [m]
  double curve_length = 0;        ///< [m]
  std::vector<Target> targets;    ///< in order along the line, at the same share of either length
};

/// Where the lines go.
/// error  "unknown_panel", "unknown_edge", "unknown_curve", "unknown_landmark", "bad_curve" (fewer than two points, no length)
Result<std::vector<HeldLine>> held_lines(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const std::map<std::string, FrameCurve>& curves,
                                         const std::vector<FrameLine>& lines);

/// The garment spread between its lines: each panel as a rigid piece at first (one that hangs on a straight line hangs down),
/// what is left over spread smoothly, then turned triangle by triangle towards isometry with the lines held and the seams closed
/// (liu2008). At seams the panels end 0.75 `thickness` before one another.
/// ret    positions [m], |V| x 3
/// error  "not_held" for panels that neither hang on a line nor are sewn to one that does
Result<Points3> spread(const mesh::GarmentMesh& garment, const std::vector<HeldLine>& lines, double thickness);

struct LineGap {
  double mean = 0, largest = 0;  ///< distance of the line's vertices from their places on the curve [m]
};
LineGap line_gap(const HeldLine& line, const Points3& x);

}  // namespace toile::placement
