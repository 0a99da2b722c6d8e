#include "geometry.h"

#include <algorithm>
#include <limits>

namespace toile::pattern {

Similarity metres_from_pattern(const Pattern& pattern) {
  const double scale = in_metres(pattern.units);
  Similarity map;
  map.linear << scale, 0, 0, pattern.y_down ? -scale : scale;
  return map;
}

Polyline flatten(const std::vector<Curve>& curves, double tolerance) {
  Polyline result;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    for (const Point2& p : curves[i].polyline(tolerance)) {
      if (!result.points.empty() && (p - result.points.back()).norm() <= weld_tolerance / 10) continue;
      if (!result.points.empty()) result.curve.push_back(static_cast<int>(i));
      result.points.push_back(p);
    }
  }
  return result;
}

double distance_to_segment(const Point2& p, const Point2& a, const Point2& b) {
  const Point2 d = b - a;
  const double t = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
  return (p - a - t * d).norm();
}

double distance_to(const Polyline& line, const Point2& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line.points.size(); ++i)
    best = std::min(best, distance_to_segment(p, line.points[i], line.points[i + 1]));
  return best;
}

bool winds_around(const Polyline& loop, const Point2& p) {
  int winding = 0;
  for (std::size_t i = 0; i + 1 < loop.points.size(); ++i) {
    const Point2 a = loop.points[i] - p, b = loop.points[i + 1] - p;
    const double side = a.x() * b.y() - a.y() * b.x();
    if (a.y() <= 0 && b.y() > 0 && side > 0) ++winding;
    if (a.y() > 0 && b.y() <= 0 && side < 0) --winding;
  }
  return winding != 0;
}

}  // namespace toile::pattern
