// Plane curves of lines, Bezier curves and circular arcs, by arc length.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "toile/base/result.h"

namespace toile::pattern {

using Point2 = Eigen::Vector2d;

/// One smooth piece of a curve. Coordinates are in whatever unit and axes its owner says.
struct Segment {
  enum class Kind { line, quadratic, cubic, arc };
  Kind kind = Kind::line;
  Point2 from = Point2::Zero(), to = Point2::Zero();
  Point2 control_1 = Point2::Zero();  ///< quadratic, cubic
  Point2 control_2 = Point2::Zero();  ///< cubic
  double bulge = 0;  ///< arc: tan(turn / 4), positive where x turns towards y; the turn is below 360 degrees
  bool operator==(const Segment&) const = default;
};

Segment line_segment(const Point2& from, const Point2& to);
Segment quadratic_segment(const Point2& from, const Point2& control, const Point2& to);
Segment cubic_segment(const Point2& from, const Point2& control_1, const Point2& control_2, const Point2& to);
Segment arc_segment(const Point2& from, const Point2& to, double bulge);
/// The arc from `from` to `to` that passes through `through`.
/// error  Issue "bad_arc" where the three points lie on a line or coincide
Result<Segment> arc_through(const Point2& from, const Point2& through, const Point2& to);

Segment reversed(const Segment& segment);
/// Position, first and second derivative at parameter t in [0, 1].
Point2 position(const Segment& segment, double t);
Point2 derivative(const Segment& segment, double t);
Point2 second_derivative(const Segment& segment, double t);
/// The part between parameters t0 < t1; its ends are exact where they are 0 or 1.
Segment part(const Segment& segment, double t0, double t1);
/// Lowest and highest coordinates of a box that holds the segment (control points included; arcs exactly).
std::pair<Point2, Point2> bounds(const Segment& segment);
/// Integral of (x dy - y dx) / 2 along the segment, exact for every kind.
double sector_area(const Segment& segment);

/// Similarity of the plane: p -> scale * R p + offset with R a rotation, or a rotation after a reflection.
struct Similarity {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  Point2 offset = Point2::Zero();
  Point2 operator()(const Point2& p) const { return linear * p + offset; }
  Segment operator()(const Segment& segment) const;
};

/// A chain of segments, each starting where the one before ends, evaluated by arc length s in [0, length()].
/// Arc length is found by Gauss-Legendre quadrature on intervals refined until it is good to 1e-12 of the segment's
/// size, its inverse by bracketed Newton steps (docs/pattern.md, "Arc length").
class Curve {
 public:
  Curve() = default;
  /// Precondition: at least one segment, all finite. Small gaps between segments are not closed.
  explicit Curve(std::vector<Segment> segments);

  const std::vector<Segment>& segments() const { return segments_; }
  double length() const { return starts_.empty() ? 0 : starts_.back(); }
  /// Arc length at the start of each segment, and the whole length as last entry; |segments| + 1.
  const std::vector<double>& segment_starts() const { return starts_; }
  Point2 from() const { return segments_.front().from; }
  Point2 to() const { return segments_.back().to; }

  /// s is clamped to [0, length()]; the ends give from() and to() exactly.
  Point2 point_at(double s) const;
  /// Unit tangent; at a corner that of the segment before it, except at s = 0.
  Point2 tangent_at(double s) const;
  /// Signed curvature [1/unit], positive where x turns towards y.
  double curvature_at(double s) const;

  struct Nearest {
    double s = 0;
    double distance = 0;
    Point2 point = Point2::Zero();
  };
  Nearest nearest(const Point2& p) const;

  Curve reversed() const;
  Curve mapped(const Similarity& map) const;
  /// The part between arc lengths s0 < s1 (clamped).
  Curve part(double s0, double s1) const;
  std::pair<Curve, Curve> split(double s) const;
  /// Integral of (x dy - y dx) / 2: over a closed chain of curves the enclosed area, positive counter-clockwise.
  double sector_area() const;
  /// Arc lengths of points along the curve such that chords between them stay within `tolerance` of it; begins with 0
  /// and ends with length(), and holds every segment's ends.
  std::vector<double> sample(double tolerance) const;
  /// The points at those arc lengths.
  std::vector<Point2> polyline(double tolerance) const;

 private:
  struct Interval {
    double t0 = 0, t1 = 1;
    double s0 = 0, s1 = 0;  ///< arc length from the segment's start
  };
  struct Location {
    std::size_t segment = 0;
    double t = 0;
  };
  Location locate(double s) const;
  double arc_length(std::size_t segment, double t) const;
  /// Per segment, parameters of its sample points after its start; the last is 1.
  std::vector<std::vector<double>> breaks(double tolerance) const;

  std::vector<Segment> segments_;
  std::vector<double> starts_;
  std::vector<std::vector<Interval>> intervals_;  ///< per segment; empty for lines and arcs
};

}  // namespace toile::pattern
