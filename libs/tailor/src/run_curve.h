// The curve of a run, recovered from its vertices.
#pragma once

#include "local_mesh.h"

#include <vector>

namespace toile::tailor {

/// Cubic interpolation of a run's vertices over their arc lengths (Hermite, tangents by central differences), with a
/// corner wherever the row of vertices turns by more than 0.35 rad. Off the true curve by the fourth power of the spacing.
class RunCurve {
 public:
  RunCurve() = default;
  /// s ascending, at least two.
  RunCurve(std::vector<double> s, std::vector<Point> p);
  Point at(double s) const;
  bool corner(std::size_t i) const { return corner_[i] != 0; }

 private:
  std::vector<double> s_;
  std::vector<Point> p_;
  std::vector<Point> tangent_in_, tangent_out_;
  std::vector<char> corner_;
};

}  // namespace toile::tailor
