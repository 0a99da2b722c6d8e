// A piece in metres, as checks and cutting need it. Private to the library.
#pragma once

#include <vector>

#include "toile/pattern/pattern.h"

namespace toile::pattern {

/// Gap below which ends are the same point [m].
inline constexpr double weld_tolerance = 1e-6;

/// From pattern coordinates to metres with y up.
Similarity metres_from_pattern(const Pattern& pattern);

/// A polyline that follows a chain of curves within `tolerance`; side i runs from point i to i + 1.
struct Polyline {
  std::vector<Point2> points;
  std::vector<int> curve;  ///< of each side; |points| - 1
};
Polyline flatten(const std::vector<Curve>& curves, double tolerance);

/// Distance of p from the segment a b.
double distance_to_segment(const Point2& p, const Point2& a, const Point2& b);
double distance_to(const Polyline& line, const Point2& p);
/// Whether p is inside the closed polyline (its first and last points coincide); points on it may go either way.
bool winds_around(const Polyline& loop, const Point2& p);

}  // namespace toile::pattern
