// Legs: the axis that leg panels follow, and trousers, whose legs are sewn to one another over the crotch.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/placement/body_frame.h"
#include "toile/placement/params.h"

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace toile::placement {

struct Layout;

/// Middles of a leg's sections as a curve, by arc length from its top.
class LegAxis {
 public:
  enum class Shape {
    tube,     ///< a straight line where the leg is straight within 15 mm, otherwise its smoothed middles
    trousers  ///< smoothed middles, from the leg's top on straight up
  };
  LegAxis(const Limb& leg, Shape shape);
  struct Place {
    Eigen::Vector3d middle, up, front, left;  ///< up along the leg; left towards the body's left; unit, left = up x front
  };
  /// h  along the axis, 0 at the top of the leg, up [m]
  Place at(double h) const;
  /// Along the axis, of the place at height y [m].
  double height(double y) const;

 private:
  std::vector<Eigen::Vector3d> points_;  // downwards
  std::vector<double> h_;                // of points_, falling
};

/// A panel of a trouser leg, beside another one or where the layout has it.
struct TrouserPanel {
  int panel = 0;
  int beside = -1;  ///< index of an earlier panel of the leg that its seam joins it to; -1: none
  int way = 0;      ///< +1: round the body from there towards the left from the front, -1: the other way
  std::vector<std::pair<double, double>> own, theirs;  ///< (h, a) of the seam in both panels, by h
};

/// A leg of trousers laid out as a strip from the front to the back seam over the outside.
struct TrouserLeg {
  double side = 1;                   ///< +1 left, -1 right
  std::vector<TrouserPanel> panels;  ///< the first holds the front seam
  double front = 0, back = 0;        ///< a of front and back seam over their upper parts [m]
  double fork = 0, fork_top = 0;     ///< h of the lowest point of these seams, and from where on they count as straight [m]
  double hem = 0;                    ///< h of the lowest row that reaches all round [m]
};

/// Positions of trousers' panels: row by row round the half trunk and round the leg, seams nearly closed. No developable, but
/// nearly one: the relaxation takes out the rest.
/// flat   panels in their unrolled parts [m], |V|
/// sheet  sheets of cloth under each vertex, |V|
/// ret    (vertex, position [m])
/// error  "too_narrow" (round the trunk or a leg), "too_short" (the rise ends above the crotch)
Result<std::vector<std::pair<int, Eigen::Vector3d>>> bend_trousers(const mesh::GarmentMesh& garment, const std::vector<Eigen::Vector2d>& flat, const std::vector<double>& sheet,
                                                                  const BodyFrame& frame, const Layout& layout, const PlaceParams& params);

}  // namespace toile::placement
