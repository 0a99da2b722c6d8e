#include "run_curve.h"

#include "toile/base/result.h"

#include <algorithm>
#include <cmath>

namespace toile::tailor {

RunCurve::RunCurve(std::vector<double> s, std::vector<Point> p) : s_(std::move(s)), p_(std::move(p)) {
  const std::size_t n = s_.size();
  TOILE_CHECK(n >= 2 && p_.size() == n, "a run of {} vertices, {} positions", n, p_.size());
  corner_.assign(n, 0);
  tangent_in_.assign(n, Point::Zero());
  tangent_out_.assign(n, Point::Zero());
  const auto slope = [&](std::size_t i) -> Point { return (p_[i + 1] - p_[i]) / (s_[i + 1] - s_[i]); };
  corner_.front() = corner_.back() = 1;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const Point a = slope(i - 1), b = slope(i);
    corner_[i] = std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b))) > 0.35;
    const double before = s_[i] - s_[i - 1], after = s_[i + 1] - s_[i];
    if (!corner_[i]) tangent_in_[i] = tangent_out_[i] = (a * after + b * before) / (before + after);
  }
  // At corners and ends: the parabola through the end and its two neighbours on that side, if they lie on a smooth piece.
  for (std::size_t i = 0; i + 1 < n; ++i) {
    if (corner_[i]) tangent_out_[i] = corner_[i + 1] ? slope(i) : Point(2 * slope(i) - tangent_in_[i + 1]);
    if (corner_[i + 1]) tangent_in_[i + 1] = corner_[i] ? slope(i) : Point(2 * slope(i) - tangent_out_[i]);
  }
}

Point RunCurve::at(double s) const {
  const auto upper = std::upper_bound(s_.begin() + 1, s_.end() - 1, s);
  const std::size_t i = static_cast<std::size_t>(upper - s_.begin()) - 1;
  const double span = s_[i + 1] - s_[i], t = std::clamp((s - s_[i]) / span, 0.0, 1.0);
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * p_[i] + (t3 - 2 * t2 + t) * span * tangent_out_[i] + (3 * t2 - 2 * t3) * p_[i + 1] + (t3 - t2) * span * tangent_in_[i + 1];
}

}  // namespace toile::tailor
