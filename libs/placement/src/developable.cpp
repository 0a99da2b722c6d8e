#include "toile/placement/developable.h"

#include "toile/base/result.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toile::placement {

Eigen::Vector3d on_plane(const Frame& frame, const Eigen::Vector2d& uv) { return frame.origin + uv.x() * frame.across + uv.y() * frame.up; }

Eigen::Vector3d on_cylinder(const Frame& frame, double radius, const Eigen::Vector2d& uv) {
  const double angle = uv.x() / radius;
  // 1 - cos as 2 sin^2 of the half angle: exact where the radius is large
  const double half = std::sin(0.5 * angle);
  return frame.origin + radius * std::sin(angle) * frame.across - 2 * radius * half * half * frame.out() + uv.y() * frame.up;
}

Eigen::Vector3d on_cone(const Frame& frame, double radius, double slant, const Eigen::Vector2d& uv) {
  TOILE_CHECK(radius > 0 && radius <= std::abs(slant), "radius {} slant {}", radius, slant);
  const double sense = slant > 0 ? 1.0 : -1.0;
  // polar coordinates about the apex (0, slant) in the flat
  const double down = slant - uv.y();
  const double distance = std::hypot(uv.x(), down);
  const double sine = radius / std::abs(slant);  // of the half opening angle
  const double around = std::atan2(uv.x(), sense * down) / sine;
  const double cosine = std::sqrt(std::max(0.0, 1 - sine * sine));
  // The ruling through the origin is `up`; the axis leans by the half opening angle from it, inwards at the apex's far side.
  const Eigen::Vector3d out = frame.out();
  const Eigen::Vector3d axis = sense * (-cosine * frame.up - sine * sense * out);  // from the apex into the cone
  const Eigen::Vector3d apex = frame.origin + slant * frame.up;
  const Eigen::Vector3d radial = (-sense * frame.up - cosine * axis) / sine;  // unit, of the ruling through the origin
  return apex + distance * (cosine * axis + sine * (std::cos(around) * radial + std::sin(around) * frame.across));
}

ConvexSection::ConvexSection(const Points2& polygon, double distance, const Eigen::Vector2d& start, const Eigen::Vector2d& direction)
    : distance_(distance) {
  const Eigen::Index n = polygon.rows();
  TOILE_CHECK(n >= 2 && distance >= 0, "corners {} distance {}", n, distance);
  const auto corner = [&](Eigen::Index i) { return Eigen::Vector2d(polygon.row((i + n) % n).transpose()); };
  const auto normal_angle = [&](Eigen::Index i) {
    const Eigen::Vector2d side = corner(i + 1) - corner(i);
    return std::atan2(-side.x(), side.y());
  };
  double begin = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    // the arc about corner i, then the side from it
    const double before = normal_angle(i - 1), after = normal_angle(i);
    double turn = after - before;
    while (turn < 0) turn += 2 * std::numbers::pi;
    while (turn >= 2 * std::numbers::pi) turn -= 2 * std::numbers::pi;
    if (distance > 0 && turn > 0) {
      pieces_.push_back({begin, distance * turn, corner(i), before, true});
      begin += distance * turn;
    }
    const double length = (corner(i + 1) - corner(i)).norm();
    pieces_.push_back({begin, length, corner(i) + distance * Eigen::Vector2d(std::cos(after), std::sin(after)), after, false});
    begin += length;
  }
  perimeter_ = begin;
  // Where the ray leaves: the curve is convex, so the side of the ray changes once in its half plane.
  const Eigen::Vector2d left(-direction.y(), direction.x());
  const auto side = [&](double s) { return left.dot(point(s) - start); };
  constexpr int samples = 720;
  for (int k = 0; k < samples; ++k) {
    double low = perimeter_ * k / samples, high = perimeter_ * (k + 1) / samples;
    if (!(side(low) <= 0 && side(high) > 0) || direction.dot(point(low) - start) <= 0) continue;
    for (int iteration = 0; iteration < 60; ++iteration) {
      const double middle = 0.5 * (low + high);
      (side(middle) <= 0 ? low : high) = middle;
    }
    shift_ = 0.5 * (low + high);
    break;
  }
}

const ConvexSection::Piece& ConvexSection::piece(double& s) const {
  s = std::fmod(s + shift_, perimeter_);
  if (s < 0) s += perimeter_;
  const auto it = std::upper_bound(pieces_.begin(), pieces_.end(), s, [](double value, const Piece& p) { return value < p.begin; });
  const Piece& found = *std::prev(it);
  s -= found.begin;
  return found;
}

double ConvexSection::facing(double s, const ConvexSection& other) const {
  TOILE_CHECK(pieces_.size() == other.pieces_.size(), "pieces {} and {}", pieces_.size(), other.pieces_.size());
  const double turns = std::floor((s + shift_) / perimeter_);
  double rest = s;
  const Piece& from = piece(rest);
  const Piece& to = other.pieces_[static_cast<std::size_t>(&from - pieces_.data())];
  return turns * other.perimeter_ + to.begin + (from.length > 0 ? rest / from.length : 0) * to.length - other.shift_;
}

Eigen::Vector2d ConvexSection::point(double s) const {
  const Piece& p = piece(s);
  if (p.arc) {
    const double angle = p.angle + s / distance_;
    return p.centre + distance_ * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return p.centre + s * Eigen::Vector2d(-std::sin(p.angle), std::cos(p.angle));
}

Eigen::Vector2d ConvexSection::normal(double s) const {
  const Piece& p = piece(s);
  const double angle = p.arc ? p.angle + s / distance_ : p.angle;
  return Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

}  // namespace toile::placement
