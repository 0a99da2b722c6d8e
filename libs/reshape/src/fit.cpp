#include "toile/reshape/flatten.h"

#include <algorithm>
#include <cmath>

namespace toile::reshape {

using Eigen::Vector2d;
using pattern::Segment;

namespace {

using Row = std::vector<Vector2d>;

Vector2d bezier(const std::array<Vector2d, 4>& c, double t) {
  const double s = 1 - t;
  return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
}

/// The cubic with given end tangents nearest to the points at parameters t.
std::array<Vector2d, 4> best_cubic(const Row& p, const std::vector<double>& t, const Vector2d& from, const Vector2d& to) {
  const double span = (p.back() - p.front()).norm();
  double c00 = 0, c01 = 0, c11 = 0, r0 = 0, r1 = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double s = 1 - t[i], b1 = 3 * s * s * t[i], b2 = 3 * s * t[i] * t[i];
    const Vector2d a0 = from * b1, a1 = to * b2;
    const Vector2d rest = p[i] - ((s * s * s + b1) * p.front() + (b2 + t[i] * t[i] * t[i]) * p.back());
    c00 += a0.dot(a0), c01 += a0.dot(a1), c11 += a1.dot(a1), r0 += a0.dot(rest), r1 += a1.dot(rest);
  }
  const double determinant = c00 * c11 - c01 * c01;
  double alpha = 0, beta = 0;
  if (std::abs(determinant) > 1e-12 * c00 * c11) alpha = (r0 * c11 - r1 * c01) / determinant, beta = (r1 * c00 - r0 * c01) / determinant;
  if (alpha < 1e-3 * span || beta < 1e-3 * span || alpha > 3 * span || beta > 3 * span) alpha = beta = span / 3;
  return {p.front(), p.front() + alpha * from, p.back() + beta * to, p.back()};
}

void fit(const Row& p, const Vector2d& from, const Vector2d& to, double tolerance, std::vector<Segment>& out) {
  // Straight?
  const Vector2d chord = p.back() - p.front();
  double off = 0;
  for (const Vector2d& q : p) off = std::max(off, std::abs(chord.x() * (q - p.front()).y() - chord.y() * (q - p.front()).x()) / chord.norm());
  if (p.size() == 2 || off < 0.1 * tolerance) {
    out.push_back(pattern::line_segment(p.front(), p.back()));
    return;
  }
  std::vector<double> t{0};
  for (std::size_t i = 1; i < p.size(); ++i) t.push_back(t.back() + (p[i] - p[i - 1]).norm());
  for (double& value : t) value /= t.back();
  double worst = 0;
  std::size_t at = 0;
  for (int round = 0; round < 8; ++round) {
    const auto c = best_cubic(p, t, from, to);
    worst = 0;
    for (std::size_t i = 1; i + 1 < p.size(); ++i) {
      const double d = (bezier(c, t[i]) - p[i]).norm();
      if (d > worst) worst = d, at = i;
    }
    if (worst <= tolerance) {
      out.push_back(pattern::cubic_segment(c[0], c[1], c[2], c[3]));
      return;
    }
    if (worst > 20 * tolerance) break;
    // Newton steps towards the feet of the perpendiculars.
    for (std::size_t i = 1; i + 1 < p.size(); ++i) {
      const double s = 1 - t[i];
      const Vector2d d = bezier(c, t[i]) - p[i];
      const Vector2d first = 3 * (s * s * (c[1] - c[0]) + 2 * s * t[i] * (c[2] - c[1]) + t[i] * t[i] * (c[3] - c[2]));
      const Vector2d second = 6 * (s * (c[2] - 2 * c[1] + c[0]) + t[i] * (c[3] - 2 * c[2] + c[1]));
      const double slope = first.dot(first) + d.dot(second);
      if (slope > 0) t[i] = std::clamp(t[i] - d.dot(first) / slope, 0.0, 1.0);
    }
    if (!std::is_sorted(t.begin(), t.end())) break;
  }
  if (at == 0 || at + 1 >= p.size()) at = p.size() / 2;
  const Vector2d middle = (p[at + 1] - p[at - 1]).normalized();
  fit(Row(p.begin(), p.begin() + static_cast<std::ptrdiff_t>(at) + 1), from, -middle, tolerance, out);
  fit(Row(p.begin() + static_cast<std::ptrdiff_t>(at), p.end()), middle, to, tolerance, out);
}

}  // namespace

std::vector<Segment> fit_curves(const std::vector<Vector2d>& points, double tolerance) {
  std::vector<Segment> out;
  std::size_t start = 0;
  const auto tangent = [&](std::size_t a, std::size_t b) {
    return Vector2d((points[b] - points[a]).normalized());
  };
  for (std::size_t i = 1; i < points.size(); ++i) {
    bool corner = i + 1 == points.size();
    if (!corner) corner = tangent(i - 1, i).dot(tangent(i, i + 1)) < std::cos(M_PI / 6);
    if (!corner) continue;
    const Row p(points.begin() + static_cast<std::ptrdiff_t>(start), points.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    // End tangents by a parabola through three points.
    const auto end = [&](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
      const double u = (b - a).norm(), v = u + (c - b).norm();
      if (u < 0.2 * v || u > 0.8 * v) return Vector2d((c - a).normalized());  // very uneven points say little of the curvature
      return Vector2d((b - a) * (v / u) - (c - a) * (u / v)).normalized();
    };
    const Vector2d from = p.size() > 2 ? end(p[0], p[1], p[2]) : Vector2d((p[1] - p[0]).normalized());
    const std::size_t n = p.size();
    const Vector2d to = n > 2 ? end(p[n - 1], p[n - 2], p[n - 3]) : Vector2d((p[0] - p[1]).normalized());
    fit(p, from, to, tolerance, out);
    start = i;
  }
  return out;
}

}  // namespace toile::reshape
