#include "toile/pattern/curve.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toile::pattern {
namespace {

double cross(const Point2& a, const Point2& b) {
  return a.x() * b.y() - a.y() * b.x();
}
Point2 left_of(const Point2& d) {
  return {-d.y(), d.x()};
}
Point2 rotated(const Point2& d, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * d.x() - s * d.y(), s * d.x() + c * d.y()};
}

double turn(const Segment& arc) {
  return 4 * std::atan(arc.bulge);
}
/// sin(fraction * angle) / sin(angle), also where the angle vanishes.
double sine_ratio(double fraction, double angle) {
  return std::abs(angle) < 1e-9 ? fraction : std::sin(fraction * angle) / std::sin(angle);
}
/// angle / sin(angle), also where the angle vanishes.
double angle_over_sine(double angle) {
  return std::abs(angle) < 1e-9 ? 1 : angle / std::sin(angle);
}

constexpr int gauss_points = 12;
struct Gauss {
  std::array<double, gauss_points> x{}, w{};  ///< nodes and weights on [0, 1]
};
/// Gauss-Legendre nodes as roots of the Legendre polynomial, by Newton from the usual cosine start.
Gauss make_gauss() {
  Gauss gauss;
  for (int i = 0; i < gauss_points; ++i) {
    double z = std::cos(std::numbers::pi * (i + 0.75) / (gauss_points + 0.5)), slope = 1;
    for (int pass = 0; pass < 20; ++pass) {
      double p = 1, before = 0;
      for (int k = 1; k <= gauss_points; ++k) {
        const double next = ((2 * k - 1) * z * p - (k - 1) * before) / k;
        before = p;
        p = next;
      }
      slope = gauss_points * (z * p - before) / (z * z - 1);
      const double step = p / slope;
      z -= step;
      if (std::abs(step) < 1e-16) break;
    }
    const auto at = static_cast<std::size_t>(i);
    gauss.x[at] = (1 - z) / 2;
    gauss.w[at] = 1 / ((1 - z * z) * slope * slope);
  }
  return gauss;
}

double speed_integral(const Segment& segment, double t0, double t1) {
  static const Gauss gauss = make_gauss();
  double sum = 0;
  for (std::size_t i = 0; i < gauss_points; ++i)
    sum += gauss.w[i] * derivative(segment, t0 + (t1 - t0) * gauss.x[i]).norm();
  return sum * (t1 - t0);
}

double segment_scale(const Segment& s) {
  switch (s.kind) {
    case Segment::Kind::quadratic:
      return (s.control_1 - s.from).norm() + (s.to - s.control_1).norm();
    case Segment::Kind::cubic:
      return (s.control_1 - s.from).norm() + (s.control_2 - s.control_1).norm() + (s.to - s.control_2).norm();
    default:
      return (s.to - s.from).norm();
  }
}

constexpr int deepest_interval = 40;

}  // namespace

Segment line_segment(const Point2& from, const Point2& to) {
  return {.kind = Segment::Kind::line, .from = from, .to = to};
}
Segment quadratic_segment(const Point2& from, const Point2& control, const Point2& to) {
  return {.kind = Segment::Kind::quadratic, .from = from, .to = to, .control_1 = control};
}
Segment cubic_segment(const Point2& from, const Point2& control_1, const Point2& control_2, const Point2& to) {
  return {.kind = Segment::Kind::cubic, .from = from, .to = to, .control_1 = control_1, .control_2 = control_2};
}
Segment arc_segment(const Point2& from, const Point2& to, double bulge) {
  return {.kind = Segment::Kind::arc, .from = from, .to = to, .bulge = bulge};
}

Result<Segment> arc_through(const Point2& from, const Point2& through, const Point2& to) {
  const Point2 a = from - through, b = to - through;
  const double scale = a.norm() * b.norm();
  // The angle at the point seen from both ends is half the turn of the other part of the circle.
  const double sine = cross(a, b), cosine = a.dot(b);
  if (!(scale > 0) || std::abs(sine) <= 1e-12 * scale || !((to - from).norm() > 0)) {
    return Issue{"bad_arc",
                 {},
                 fmt::format("the arc's ends and the point ({}, {}) on it lie on one line", through.x(), through.y()),
                 "give a point off the chord, or draw a line"};
  }
  const double inscribed = std::atan2(std::abs(sine), cosine);  // in (0, pi); the turn is 2 pi - 2 inscribed
  const double magnitude = std::tan((2 * std::numbers::pi - 2 * inscribed) / 4);
  return arc_segment(from, to, sine < 0 ? magnitude : -magnitude);
}

Segment reversed(const Segment& s) {
  Segment r = s;
  std::swap(r.from, r.to);
  if (s.kind == Segment::Kind::cubic) std::swap(r.control_1, r.control_2);
  r.bulge = s.kind == Segment::Kind::arc ? -s.bulge : 0;
  return r;
}

Point2 position(const Segment& s, double t) {
  if (t <= 0) return s.from;
  if (t >= 1) return s.to;
  const double u = 1 - t;
  switch (s.kind) {
    case Segment::Kind::line:
      return u * s.from + t * s.to;
    case Segment::Kind::quadratic:
      return u * u * s.from + 2 * u * t * s.control_1 + t * t * s.to;
    case Segment::Kind::cubic:
      return u * u * u * s.from + 3 * u * u * t * s.control_1 + 3 * u * t * t * s.control_2 + t * t * t * s.to;
    case Segment::Kind::arc: {
      const double half = turn(s) / 2;
      return s.from + sine_ratio(t, half) * rotated(s.to - s.from, (t - 1) * half);
    }
  }
  return s.from;
}

Point2 derivative(const Segment& s, double t) {
  const double u = 1 - t;
  switch (s.kind) {
    case Segment::Kind::line:
      return s.to - s.from;
    case Segment::Kind::quadratic:
      return 2 * u * (s.control_1 - s.from) + 2 * t * (s.to - s.control_1);
    case Segment::Kind::cubic:
      return 3 * u * u * (s.control_1 - s.from) + 6 * u * t * (s.control_2 - s.control_1) +
             3 * t * t * (s.to - s.control_2);
    case Segment::Kind::arc: {
      const double half = turn(s) / 2;
      return angle_over_sine(half) * rotated(s.to - s.from, (2 * t - 1) * half);
    }
  }
  return s.to - s.from;
}

Point2 second_derivative(const Segment& s, double t) {
  switch (s.kind) {
    case Segment::Kind::line:
      return Point2::Zero();
    case Segment::Kind::quadratic:
      return 2 * (s.to - 2 * s.control_1 + s.from);
    case Segment::Kind::cubic:
      return 6 * (1 - t) * (s.control_2 - 2 * s.control_1 + s.from) + 6 * t * (s.to - 2 * s.control_2 + s.control_1);
    case Segment::Kind::arc:
      return turn(s) * left_of(derivative(s, t));
  }
  return Point2::Zero();
}

Segment part(const Segment& s, double t0, double t1) {
  Segment r = s;
  r.from = position(s, t0);
  r.to = position(s, t1);
  const double dt = t1 - t0;
  switch (s.kind) {
    case Segment::Kind::line:
      break;
    case Segment::Kind::quadratic:
      r.control_1 = r.from + dt / 2 * derivative(s, t0);
      break;
    case Segment::Kind::cubic:
      r.control_1 = t0 <= 0 && t1 >= 1 ? s.control_1 : Point2(r.from + dt / 3 * derivative(s, t0));
      r.control_2 = t0 <= 0 && t1 >= 1 ? s.control_2 : Point2(r.to - dt / 3 * derivative(s, t1));
      break;
    case Segment::Kind::arc:
      r.bulge = std::tan(dt * turn(s) / 4);
      break;
  }
  return r;
}

std::pair<Point2, Point2> bounds(const Segment& s) {
  Point2 low = s.from.cwiseMin(s.to), high = s.from.cwiseMax(s.to);
  const auto include = [&](const Point2& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  };
  if (s.kind == Segment::Kind::quadratic || s.kind == Segment::Kind::cubic) include(s.control_1);
  if (s.kind == Segment::Kind::cubic) include(s.control_2);
  if (s.kind == Segment::Kind::arc && s.bulge != 0) {
    // An extreme lies where the tangent is parallel to an axis.
    const double whole = turn(s);
    const Point2 start = derivative(s, 0);
    const double heading = std::atan2(start.y(), start.x());
    const double quarter = std::numbers::pi / 2;
    const double first = std::min(heading, heading + whole), last = std::max(heading, heading + whole);
    for (double k = std::ceil(first / quarter); k * quarter <= last; ++k)
      include(position(s, (k * quarter - heading) / whole));
  }
  return {low, high};
}

double sector_area(const Segment& s) {
  switch (s.kind) {
    case Segment::Kind::line:
      return cross(s.from, s.to) / 2;
    case Segment::Kind::quadratic:
      return (2 * cross(s.from, s.control_1) + cross(s.from, s.to) + 2 * cross(s.control_1, s.to)) / 6;
    case Segment::Kind::cubic:
      return (6 * cross(s.from, s.control_1) + 3 * cross(s.from, s.control_2) + cross(s.from, s.to) +
              3 * cross(s.control_1, s.control_2) + 3 * cross(s.control_1, s.to) + 6 * cross(s.control_2, s.to)) /
             20;
    case Segment::Kind::arc: {
      const double angle = turn(s);
      if (angle == 0) return cross(s.from, s.to) / 2;
      const double radius = (s.to - s.from).norm() / (2 * std::sin(angle / 2));
      // angle - sin(angle) loses its digits where the angle is small.
      const double excess = std::abs(angle) < 0.05
                                ? angle * angle * angle / 6 * (1 - angle * angle / 20 * (1 - angle * angle / 42))
                                : angle - std::sin(angle);
      return cross(s.from, s.to) / 2 + radius * radius * excess / 2;
    }
  }
  return 0;
}

Segment Similarity::operator()(const Segment& s) const {
  Segment r = s;
  r.from = (*this)(s.from);
  r.to = (*this)(s.to);
  if (s.kind == Segment::Kind::quadratic || s.kind == Segment::Kind::cubic) r.control_1 = (*this)(s.control_1);
  if (s.kind == Segment::Kind::cubic) r.control_2 = (*this)(s.control_2);
  if (s.kind == Segment::Kind::arc && linear.determinant() < 0) r.bulge = -s.bulge;
  return r;
}

Curve::Curve(std::vector<Segment> segments) : segments_(std::move(segments)) {
  TOILE_CHECK(!segments_.empty(), "a curve of {} segments", segments_.size());
  starts_.push_back(0);
  intervals_.resize(segments_.size());
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    double length = 0;
    if (segment.kind == Segment::Kind::line) {
      length = (segment.to - segment.from).norm();
    } else if (segment.kind == Segment::Kind::arc) {
      length = derivative(segment, 0.5).norm();
    } else {
      const double tolerance = 1e-13 * segment_scale(segment);
      // Depth-first from left to right; an interval is taken when its two halves agree with the whole.
      struct Task {
        double t0, t1, whole;
        int depth;
      };
      std::vector<Task> stack{{0, 1, speed_integral(segment, 0, 1), 0}};
      while (!stack.empty()) {
        const Task task = stack.back();
        stack.pop_back();
        const double middle = (task.t0 + task.t1) / 2;
        const double a = speed_integral(segment, task.t0, middle), b = speed_integral(segment, middle, task.t1);
        if (std::abs(a + b - task.whole) <= tolerance || task.depth >= deepest_interval) {
          intervals_[i].push_back({task.t0, middle, length, length + a});
          intervals_[i].push_back({middle, task.t1, length + a, length + a + b});
          length += a + b;
        } else {
          stack.push_back({middle, task.t1, b, task.depth + 1});
          stack.push_back({task.t0, middle, a, task.depth + 1});
        }
      }
    }
    starts_.push_back(starts_.back() + length);
  }
}

double Curve::arc_length(std::size_t segment, double t) const {
  if (t <= 0) return 0;
  const double whole = starts_[segment + 1] - starts_[segment];
  if (t >= 1) return whole;
  if (intervals_[segment].empty()) return t * whole;
  const auto& intervals = intervals_[segment];
  const auto it = std::lower_bound(intervals.begin(), intervals.end(), t,
                                   [](const Interval& interval, double value) { return interval.t1 < value; });
  return it->s0 + speed_integral(segments_[segment], it->t0, t);
}

Curve::Location Curve::locate(double s) const {
  TOILE_CHECK(!segments_.empty(), "a curve of {} segments", segments_.size());
  if (!(s > 0)) return {0, 0};
  if (s >= length()) return {segments_.size() - 1, 1};
  const auto upper = std::lower_bound(starts_.begin() + 1, starts_.end(), s);
  const auto i = static_cast<std::size_t>(upper - starts_.begin() - 1);
  const double local = s - starts_[i], whole = starts_[i + 1] - starts_[i];
  if (local >= whole) return {i, 1};
  if (intervals_[i].empty()) return {i, local / whole};
  const auto& intervals = intervals_[i];
  auto it = std::lower_bound(intervals.begin(), intervals.end(), local,
                             [](const Interval& interval, double value) { return interval.s1 < value; });
  if (it == intervals.end()) --it;
  const double span = it->s1 - it->s0;
  if (!(span > 0)) return {i, it->t1};
  // Newton, kept inside a bracket so that a vanishing speed (a cusp) cannot throw it out.
  double low = it->t0, high = it->t1, t = low + (high - low) * (local - it->s0) / span;
  for (int pass = 0; pass < 60; ++pass) {
    const double error = it->s0 + speed_integral(segments_[i], it->t0, t) - local;
    if (std::abs(error) <= 1e-14 * whole) break;
    (error > 0 ? high : low) = t;
    const double speed = derivative(segments_[i], t).norm();
    double next = speed > 0 ? t - error / speed : low;
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (next == t) break;
    t = next;
  }
  return {i, t};
}

Point2 Curve::point_at(double s) const {
  const Location at = locate(s);
  return position(segments_[at.segment], at.t);
}

Point2 Curve::tangent_at(double s) const {
  const Location at = locate(s);
  const Segment& segment = segments_[at.segment];
  const Point2 d = derivative(segment, at.t);
  const double scale = segment_scale(segment);
  if (d.norm() > 1e-9 * scale) return d.normalized();
  // A control point on the end: the direction is that of the next derivative that does not vanish.
  const double inwards = at.t < 0.5 ? 1 : -1;
  const Point2 d2 = inwards * second_derivative(segment, at.t);
  if (d2.norm() > 1e-9 * scale) return d2.normalized();
  const Point2 chord = inwards * (position(segment, at.t + inwards * 1e-3) - position(segment, at.t));
  return chord.norm() > 0 ? Point2(chord.normalized()) : Point2(1, 0);
}

double Curve::curvature_at(double s) const {
  const Location at = locate(s);
  const Point2 d = derivative(segments_[at.segment], at.t);
  const double speed = d.norm();
  return speed > 0 ? cross(d, second_derivative(segments_[at.segment], at.t)) / (speed * speed * speed) : 0;
}

Curve::Nearest Curve::nearest(const Point2& p) const {
  Nearest best{.s = 0, .distance = (from() - p).norm(), .point = from()};
  const auto take = [&](std::size_t i, double t) {
    const Point2 q = position(segments_[i], t);
    if (const double d = (q - p).norm(); d < best.distance) best = {starts_[i] + arc_length(i, t), d, q};
  };
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    const auto [low, high] = bounds(segment);
    if ((p - p.cwiseMax(low).cwiseMin(high)).norm() > best.distance) continue;
    take(i, 1);
    if (segment.kind == Segment::Kind::line) {
      const Point2 d = segment.to - segment.from;
      if (d.squaredNorm() > 0) take(i, std::clamp((p - segment.from).dot(d) / d.squaredNorm(), 0.0, 1.0));
      continue;
    }
    // The distance of a cubic has at most five minima: a fine scan, then a golden section around each.
    constexpr int cells = 48;
    std::array<double, cells + 1> distance{};
    for (int k = 0; k <= cells; ++k)
      distance[static_cast<std::size_t>(k)] = (position(segment, static_cast<double>(k) / cells) - p).squaredNorm();
    for (int k = 0; k <= cells; ++k) {
      const auto at = static_cast<std::size_t>(k);
      if ((k > 0 && distance[at - 1] < distance[at]) || (k < cells && distance[at + 1] < distance[at])) continue;
      double a = std::max(0, k - 1) / static_cast<double>(cells),
             b = std::min(cells, k + 1) / static_cast<double>(cells);
      constexpr double golden = 0.6180339887498949;
      double c = b - golden * (b - a), d = a + golden * (b - a);
      double fc = (position(segment, c) - p).squaredNorm(), fd = (position(segment, d) - p).squaredNorm();
      for (int pass = 0; pass < 40; ++pass) {
        if (fc < fd) {
          b = d, d = c, fd = fc, c = b - golden * (b - a), fc = (position(segment, c) - p).squaredNorm();
        } else {
          a = c, c = d, fc = fd, d = a + golden * (b - a), fd = (position(segment, d) - p).squaredNorm();
        }
      }
      // The golden section stops at half the digits; Newton on the derivative of the distance finds the others.
      double t = (a + b) / 2;
      for (int pass = 0; pass < 8; ++pass) {
        const Point2 r = position(segment, t) - p, d1 = derivative(segment, t);
        const double slope = d1.squaredNorm() + r.dot(second_derivative(segment, t));
        if (!(slope > 0)) break;
        t = std::clamp(t - r.dot(d1) / slope, 0.0, 1.0);
      }
      take(i, (a + b) / 2);
      take(i, t);
    }
  }
  return best;
}

Curve Curve::reversed() const {
  std::vector<Segment> segments;
  for (auto it = segments_.rbegin(); it != segments_.rend(); ++it) segments.push_back(pattern::reversed(*it));
  return Curve(std::move(segments));
}

Curve Curve::mapped(const Similarity& map) const {
  std::vector<Segment> segments;
  for (const Segment& segment : segments_) segments.push_back(map(segment));
  return Curve(std::move(segments));
}

Curve Curve::part(double s0, double s1) const {
  s0 = std::clamp(s0, 0.0, length());
  s1 = std::clamp(s1, s0, length());
  const Location a = locate(s0), b = locate(s1);
  std::vector<Segment> segments;
  for (std::size_t i = a.segment; i <= b.segment; ++i) {
    const double t0 = i == a.segment ? a.t : 0, t1 = i == b.segment ? b.t : 1;
    // Nothing shorter than rounding is left over where the cut falls on a segment's end.
    if (t1 - t0 > 1e-12) segments.push_back(pattern::part(segments_[i], t0, t1));
  }
  if (segments.empty())
    segments.push_back(line_segment(position(segments_[a.segment], a.t), position(segments_[b.segment], b.t)));
  segments.front().from = position(segments_[a.segment], a.t);
  segments.back().to = position(segments_[b.segment], b.t);
  return Curve(std::move(segments));
}

std::pair<Curve, Curve> Curve::split(double s) const {
  return {part(0, s), part(s, length())};
}

double Curve::sector_area() const {
  double area = 0;
  for (const Segment& segment : segments_) area += pattern::sector_area(segment);
  return area;
}

std::vector<std::vector<double>> Curve::breaks(double tolerance) const {
  std::vector<std::vector<double>> result(segments_.size());
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    if (segment.kind != Segment::Kind::line) {
      const auto strays = [&](double t0, double t1) {
        const Point2 a = position(segment, t0), chord = position(segment, t1) - a;
        for (const double share : {0.25, 0.5, 0.75}) {
          const Point2 r = position(segment, t0 + share * (t1 - t0)) - a;
          const double along = chord.squaredNorm() > 0 ? std::clamp(r.dot(chord) / chord.squaredNorm(), 0.0, 1.0) : 0;
          if ((r - along * chord).norm() > tolerance) return true;
        }
        return false;
      };
      struct Task {
        double t0, t1;
        int depth;
      };
      std::vector<Task> stack{{0.5, 1, 1}, {0, 0.5, 1}};
      while (!stack.empty()) {
        const Task task = stack.back();
        stack.pop_back();
        if (task.depth < 20 && strays(task.t0, task.t1)) {
          const double middle = (task.t0 + task.t1) / 2;
          stack.push_back({middle, task.t1, task.depth + 1});
          stack.push_back({task.t0, middle, task.depth + 1});
        } else if (task.t1 < 1) {
          result[i].push_back(task.t1);
        }
      }
    }
    result[i].push_back(1);
  }
  return result;
}

std::vector<double> Curve::sample(double tolerance) const {
  std::vector<double> result{0};
  const auto parameters = breaks(tolerance);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    for (const double t : parameters[i]) result.push_back(starts_[i] + arc_length(i, t));
  }
  result.back() = length();
  return result;
}

std::vector<Point2> Curve::polyline(double tolerance) const {
  std::vector<Point2> result{from()};
  const auto parameters = breaks(tolerance);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    for (const double t : parameters[i]) result.push_back(position(segments_[i], t));
  }
  return result;
}

}  // namespace toile::pattern
