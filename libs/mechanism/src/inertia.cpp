#include "toile/mechanism/inertia.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace toile::mechanism {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double spacing = 0.5 * M_PI / 180;  // of the angles at which the linkage is looked at [rad]

Vector2d turned(double angle, const Vector2d& p) { return {std::cos(angle) * p.x() - std::sin(angle) * p.y(), std::sin(angle) * p.x() + std::cos(angle) * p.y()}; }
Vector2d square_to(const Vector2d& p) { return {-p.y(), p.x()}; }

}  // namespace

Result<std::vector<Inertia>> inertias(const Linkage& linkage) {
  if (Issues issues = validate(linkage); !issues.empty()) return issues;
  mesh::SupportMesh frame;
  if (!linkage.bars.empty() || !linkage.bows.empty()) {
    auto surface = frame_surface(linkage);
    if (!surface) return surface.issues();
    frame = std::move(*surface);
  }
  // Volume, first and second moments of tetrahedra from the origin to the faces; about the origin first.
  std::vector<double> mass(linkage.bodies.size(), 0), second(linkage.bodies.size(), 0);
  std::vector<Vector2d> first(linkage.bodies.size(), Vector2d::Zero());
  for (Eigen::Index f = 0; f < frame.faces.rows(); ++f) {
    const auto b = static_cast<std::size_t>(frame.face_region[f]);
    Vector3d corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = frame.x.row(frame.faces(f, k)).transpose();
    const double m = linkage.density * corner[0].dot(corner[1].cross(corner[2])) / 6;
    const Vector3d sum = corner[0] + corner[1] + corner[2];
    mass[b] += m;
    first[b] += m / 4 * Vector2d(sum.z(), sum.y());
    // The integral of c^2 over a tetrahedron with one corner at the origin: V/20 (sum of squares + square of the sum).
    for (int axis : {1, 2}) {
      double squares = sum[axis] * sum[axis];
      for (const Vector3d& c : corner) squares += c[axis] * c[axis];
      second[b] += m / 20 * squares;
    }
  }
  for (const AddedMass& a : linkage.masses) {
    const auto b = static_cast<std::size_t>(std::find(linkage.bodies.begin(), linkage.bodies.end(), a.body) - linkage.bodies.begin());
    if (b == linkage.bodies.size()) continue;  // on the ground
    const Vector2d at(a.at[0], a.at[1]);
    mass[b] += a.mass;
    first[b] += a.mass * at;
    second[b] += a.moment + a.mass * at.squaredNorm();
  }
  std::vector<Inertia> result(linkage.bodies.size());
  double total = 0;
  for (std::size_t b = 0; b < result.size(); ++b) {
    result[b].mass = mass[b];
    total += mass[b];
    if (mass[b] > 0) result[b].centre = first[b] / mass[b];
    result[b].moment = std::max(0.0, second[b] - mass[b] * result[b].centre.squaredNorm());
    total += result[b].moment;
  }
  if (!(total > 0)) return Issue{"no_mass", {.item = "density"}, "no body of the linkage has a mass", "give a density with bars or bows, or `masses`"};
  return result;
}

Reduced reduce(const Configuration& c, const std::vector<Inertia>& inertias, double gravity) {
  TOILE_CHECK(c.poses.size() == inertias.size() && c.curvatures.size() == inertias.size(), "{} poses, {} inertias", c.poses.size(), inertias.size());
  Reduced r;
  for (std::size_t b = 0; b < inertias.size(); ++b) {
    const Inertia& i = inertias[b];
    const double turn = c.rates[b].angle, bend = c.curvatures[b].angle;
    const Vector2d arm = turned(c.poses[b].angle, i.centre);
    const Vector2d velocity = c.rates[b].shift + turn * square_to(arm);
    const Vector2d acceleration = c.curvatures[b].shift + bend * square_to(arm) - turn * turn * arm;
    r.inertia += i.mass * velocity.squaredNorm() + i.moment * turn * turn;
    r.inertia_slope += 2 * (i.mass * velocity.dot(acceleration) + i.moment * turn * bend);
    r.weight -= i.mass * gravity * velocity.y();
    r.height_energy += i.mass * gravity * (c.poses[b].shift + arm).y();
  }
  return r;
}

Result<Dynamics> Dynamics::make(const Linkage& linkage, double gravity) {
  auto walk = Walk::begin(linkage);
  if (!walk) return walk.issues();
  auto found = mechanism::inertias(linkage);
  if (!found) return found.issues();
  Dynamics dynamics(std::move(*walk));
  dynamics.inertias_ = std::move(*found);
  dynamics.gravity_ = gravity;
  return dynamics;
}

Result<Reduced> Dynamics::node(long long index) {
  const auto it = nodes_.find(index);
  if (it != nodes_.end()) return it->second;
  const auto c = walk_.to(static_cast<double>(index) * spacing);
  if (!c) return c.issues();
  return nodes_[index] = reduce(*c, inertias_, gravity_);
}

Result<Reduced> Dynamics::at(double angle) {
  const auto index = static_cast<long long>(std::floor(angle / spacing));
  const auto a = node(index);
  if (!a) return a.issues();
  const auto b = node(index + 1);
  if (!b) return b.issues();
  const double u = angle / spacing - static_cast<double>(index);
  struct Curve {
    double value, slope;
  };
  // Cubic by values and slopes at both ends.
  const auto cubic = [&](double va, double sa, double vb, double sb) {
    const double d = vb - va, p = spacing * sa, q = spacing * sb;
    const double c2 = 3 * d - 2 * p - q, c3 = p + q - 2 * d;
    return Curve{va + u * (p + u * (c2 + u * c3)), (p + u * (2 * c2 + 3 * u * c3)) / spacing};
  };
  const Curve inertia = cubic(a->inertia, a->inertia_slope, b->inertia, b->inertia_slope);
  const Curve height = cubic(a->height_energy, -a->weight, b->height_energy, -b->weight);
  return Reduced{inertia.value, inertia.slope, -height.slope, height.value};
}

Result<DriverState> Dynamics::advance(DriverState state, double from, double to, const Torque& torque, double longest_piece) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((to - from) / longest_piece - 1e-9)));
  const double h = (to - from) / pieces;
  Issues issues;
  const auto slope = [&](double time, const DriverState& s) -> DriverState {
    if (!issues.empty()) return {};
    if (!std::isfinite(s.angle) || !std::isfinite(s.rate) || std::abs(s.angle) > 1e4) {
      issues.push_back(Issue{"not_finite", {.item = "motor"}, fmt::format("the driver runs away at {:.6g} s", time), "take a softer servo, or shorter steps"});
      return {};
    }
    const auto r = at(s.angle);
    if (!r) {
      issues = r.issues();
      return {};
    }
    return {s.rate, (torque(time, s) + r->weight - 0.5 * r->inertia_slope * s.rate * s.rate) / r->inertia};
  };
  const auto plus = [](const DriverState& s, double h, const DriverState& d) { return DriverState{s.angle + h * d.angle, s.rate + h * d.rate}; };
  for (int i = 0; i < pieces && issues.empty(); ++i) {
    const double t = from + i * h;
    const DriverState a = slope(t, state), b = slope(t + 0.5 * h, plus(state, 0.5 * h, a)), c = slope(t + 0.5 * h, plus(state, 0.5 * h, b)), d = slope(t + h, plus(state, h, c));
    state.angle += h / 6 * (a.angle + 2 * b.angle + 2 * c.angle + d.angle);
    state.rate += h / 6 * (a.rate + 2 * b.rate + 2 * c.rate + d.rate);
  }
  if (!issues.empty()) return issues;
  return state;
}

AngleMotion angle_motion(const std::vector<double>& times, const std::vector<double>& angles, Profile profile, double time) {
  AngleMotion m{angle_at(times, angles, profile, time), 0, 0};
  const auto next = std::upper_bound(times.begin(), times.end(), time);
  if (next == times.begin() || next == times.end()) return m;
  const auto i = static_cast<std::size_t>(next - times.begin());
  const double span = times[i] - times[i - 1], rise = angles[i] - angles[i - 1], u = (time - times[i - 1]) / span;
  if (profile == Profile::smooth) {
    m.rate = rise / span * 6 * u * (1 - u);
    m.acceleration = rise / (span * span) * (6 - 12 * u);
  } else {
    m.rate = rise / span;
  }
  return m;
}

}  // namespace toile::mechanism
