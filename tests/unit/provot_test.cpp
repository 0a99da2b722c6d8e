#include <gtest/gtest.h>

#include <cmath>

#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/provot.h"
#include "toile/mechanics/particle.h"

using namespace toile;
using namespace toile::dynamics;

namespace {

constexpr double g = 9.81;

/// Free particles with weight.
Provot particles(const Points3& x, const Points3& v, ConstraintSet set, double step, double damping = 0) {
  ProvotSystem system;
  system.mass = Eigen::VectorXd::Constant(x.rows(), 0.01);
  system.gradient = [](const Points3& at, Points3& out) {
    out.setZero(at.rows(), 3);
    out.col(1).setConstant(0.01 * g);
  };
  system.constraints = std::move(set);
  ProvotOptions options;
  options.time_step = step;
  options.damping = damping;
  options.constraints.time_constant = 4 * step;
  return Provot(std::move(system), {x, v, 0}, options);
}

TEST(provot, free_fall_is_that_of_the_two_step_scheme) {
  Provot p = particles(Points3::Zero(1, 3), Points3::Zero(1, 3), {}, 1e-3);
  for (int i = 0; i < 100; ++i) p.step();
  EXPECT_NEAR(p.state().v(0, 1), -g * 0.1, 1e-12);
  EXPECT_NEAR(p.state().x(0, 1), -g * 1e-6 * 100 * 101 / 2, 1e-12);  // sum of dt v of the steps' ends
}

TEST(dynamic_constraints, hold_a_node_with_its_weight) {
  ConstraintSet set;
  set.positions.push_back({0, Eigen::Vector3d(1, 2, 3)});
  Points3 x(1, 3);
  x << 1.001, 2, 3;  // one millimetre off
  Provot p = particles(x, Points3::Zero(1, 3), set, 1e-4);
  ConstraintReport report;
  for (int i = 0; i < 200; ++i) report = p.step();
  EXPECT_LT((p.state().x.row(0) - Eigen::RowVector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((p.constraints().holding_force(0) - Eigen::Vector3d(0, 0.01 * g, 0)).norm(), 1e-9);
  EXPECT_TRUE(report.solved);
}

TEST(dynamic_constraints, violation_decays_critically) {
  // C'' + 2 C'/tau + C/tau^2 = 0 from C = 1 mm at rest: C = (1 + t/tau) exp(-t/tau).
  const double step = 1e-5, tau = 1e-2;
  Points3 x(1, 3);
  x << 1e-3, 0, 0;
  DynamicConstraints constraints;
  ConstraintSet set;
  set.positions.push_back({0, Eigen::Vector3d::Zero()});
  ConstraintOptions options;
  options.time_step = step;
  options.time_constant = tau;
  Points3 v = Points3::Zero(1, 3), force(1, 3);
  const Eigen::VectorXd mass = Eigen::VectorXd::Constant(1, 2.0);
  for (int i = 0; i < 2000; ++i) {
    force.setZero();
    constraints.add_forces(set, x, v, mass, 0, options, force);
    v += step / 2.0 * force;
    x += step * v;
  }
  const double t = 2000 * step / tau;
  EXPECT_NEAR(x(0, 0), 1e-3 * (1 + t) * std::exp(-t), 1e-3 * 2e-3);
}

TEST(dynamic_constraints, pendulum_keeps_its_length_and_swings_in_time) {
  const double length = 0.5, angle = 0.05, step = 1e-4;
  Points3 x(2, 3);
  x << 0, 0, 0, length * std::sin(angle), -length * std::cos(angle), 0;
  ConstraintSet set;
  set.positions.push_back({0, Eigen::Vector3d::Zero()});
  set.distances.push_back({0, 1, length});
  Provot p = particles(x, Points3::Zero(2, 3), set, step);
  const double period = 2 * M_PI * std::sqrt(length / g) * (1 + angle * angle / 16);
  double worst = 0, last = p.state().x(1, 0);
  std::vector<double> crossings;
  while (crossings.size() < 5 && p.state().time < 10) {
    worst = std::max(worst, p.step().largest_violation);
    const double now = p.state().x(1, 0);
    if ((now > 0) != (last > 0)) crossings.push_back(p.state().time - step * now / (now - last));
    last = now;
  }
  EXPECT_LT(worst, 1e-7);
  ASSERT_EQ(crossings.size(), 5u);
  EXPECT_NEAR((crossings[4] - crossings[0]) / 2, period, 1e-4 * period);
}

TEST(dynamic_constraints, distance_of_a_spinning_pair) {
  // Two free masses on a rod, turning fast: the rod pulls with m v^2/r.
  const double r = 0.1, speed = 3;
  Points3 x(2, 3), v(2, 3);
  x << r, 0, 0, -r, 0, 0;
  v << 0, speed, 0, 0, -speed, 0;
  ConstraintSet set;
  set.distances.push_back({0, 1, 2 * r});
  Provot p = particles(x, v, set, 1e-5);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) worst = std::max(worst, p.step().largest_violation);
  EXPECT_LT(worst, 1e-6);
  EXPECT_NEAR(p.constraints().distance_force(0), -0.01 * speed * speed / r, 1e-3 * 0.9);
}

TEST(dynamic_constraints, trajectory_is_followed) {
  const auto path = [](double t) {
    return PathState{Eigen::Vector3d(std::cos(5 * t), std::sin(5 * t), t), Eigen::Vector3d(-5 * std::sin(5 * t), 5 * std::cos(5 * t), 1),
                     Eigen::Vector3d(-25 * std::cos(5 * t), -25 * std::sin(5 * t), 0)};
  };
  ConstraintSet set;
  set.trajectories.push_back({0, path});
  Points3 x(1, 3), v(1, 3);
  x.row(0) = path(0).position.transpose();
  v.row(0) = path(0).velocity.transpose();
  Provot p = particles(x, v, set, 1e-4);
  for (int i = 0; i < 10000; ++i) p.step();
  EXPECT_LT((p.state().x.row(0).transpose() - path(p.state().time).position).norm(), 1e-4);
}

/// The chain of distances hangs as the polygon that carries its weights: the catenary of rods.
TEST(dynamic_constraints, chain_of_distances_hangs_as_a_catenary) {
  const int n = 20;
  const double link = 0.05, span = 0.7;
  Points3 x(n + 1, 3);
  ConstraintSet set;
  for (int i = 0; i <= n; ++i) x.row(i) << span * i / n, -0.3 * std::sin(M_PI * i / n), 0;
  set.positions = {{0, x.row(0).transpose()}, {n, x.row(n).transpose()}};
  for (int i = 0; i < n; ++i) set.distances.push_back({i, i + 1, link});
  Provot p = particles(x, Points3::Zero(n + 1, 3), set, 2e-4, 6);
  ConstraintReport report;
  for (int i = 0; i < 40000; ++i) report = p.step();
  EXPECT_LT(report.largest_violation, 1e-9);
  EXPECT_LT(p.kinetic_energy(), 1e-12);
  // Every rod pulls with the same horizontal force, and the ends carry the weight of what hangs between them.
  double lowest = 0;
  for (int i = 0; i < n; ++i) {
    const Eigen::RowVector3d d = p.state().x.row(i + 1) - p.state().x.row(i);
    const double horizontal = -p.constraints().distance_force(static_cast<std::size_t>(i)) * d.x() / d.norm();
    const Eigen::RowVector3d first = p.state().x.row(1) - p.state().x.row(0);
    EXPECT_NEAR(horizontal, -p.constraints().distance_force(0) * first.x() / first.norm(), 1e-6);
    lowest = std::min(lowest, p.state().x(i, 1));
  }
  EXPECT_NEAR(p.constraints().holding_force(0).y() + p.constraints().holding_force(1).y(), 0.01 * g * (n + 1), 1e-6);
  // Sag of the continuous catenary of the same length: L = 2 a sinh(span/2a).
  double low = 0.01, high = 10;
  for (int k = 0; k < 100; ++k) {
    const double a = 0.5 * (low + high);
    (2 * a * std::sinh(span / (2 * a)) > n * link ? low : high) = a;
  }
  const double a = 0.5 * (low + high);
  EXPECT_NEAR(-lowest, a * (std::cosh(span / (2 * a)) - 1), 0.01 * -lowest);
}

TEST(dynamic_constraints, contact_pushes_and_never_pulls) {
  // A particle falls on the ground y = 0, and one above the ground flies up.
  Points3 x(2, 3), v(2, 3);
  x << 0, 0.01, 0, 1, 0.001, 0;
  v << 0, 0, 0, 0, 1, 0;
  ConstraintSet set;
  for (int i = 0; i < 2; ++i) {
    Unilateral c;
    c.node[0] = i;
    c.weight[0] = 1;
    c.normal = Eigen::Vector3d::UnitY();
    set.contacts.push_back(c);
  }
  Provot p = particles(x, v, set, 1e-4);
  double deepest = 0;
  for (int i = 0; i < 1500; ++i) deepest = std::max(deepest, p.step().deepest_contact);
  EXPECT_LT(deepest, 1e-6);
  EXPECT_NEAR(p.state().x(0, 1), 0, 1e-6);
  EXPECT_LT(std::abs(p.state().v(0, 1)), 1e-6);
  EXPECT_NEAR(p.constraints().contact_force(0), 0.01 * g, 1e-6);
  EXPECT_NEAR(p.state().x(1, 1), 0.001 + 0.15 - g * 0.15 * 0.15 / 2, 1e-4);  // as if there were no ground
  EXPECT_EQ(p.constraints().contact_force(1), 0);
}

/// On an incline a particle sticks below the friction angle and slides above it.
TEST(dynamic_constraints, friction_on_an_incline) {
  for (const double mu : {0.29, 0.31}) {
    const double angle = std::atan(0.3);
    ConstraintSet set;
    Unilateral c;
    c.node[0] = 0;
    c.weight[0] = 1;
    c.normal = Eigen::Vector3d(std::sin(angle), std::cos(angle), 0);
    c.friction = mu;
    set.contacts.push_back(c);
    Provot p = particles(Points3::Zero(1, 3), Points3::Zero(1, 3), set, 1e-4);
    for (int i = 0; i < 5000; ++i) p.step();
    const double slid = p.state().x.row(0).norm(), acceleration = g * (std::sin(angle) - mu * std::cos(angle));
    if (mu > 0.3) {
      EXPECT_LT(slid, 1e-6);
    } else {
      EXPECT_NEAR(slid, acceleration * 0.5 * 0.5 / 2, 0.01 * slid);
    }
  }
}

struct Cloth {
  mesh::GarmentMesh garment;
  mechanics::ParticleModel model;
  mechanics::ParticleResponse response;
};

Cloth cloth(const mesh::GarmentMesh& garment) {
  auto model = mechanics::make_particle(garment, mesh::particles(garment), {});
  EXPECT_TRUE(model);
  return {garment, *model, {}};
}

ProvotSystem system_of(Cloth& c, double gravity) {
  ProvotSystem system;
  system.mass = c.model.mass;
  system.gradient = [&c, gravity](const Points3& x, Points3& out) {
    mechanics::gradient(c.model, x, Points3(0, 3), c.response);
    out = c.response.gradient;
    out.col(1) += gravity * c.model.mass;
  };
  return system;
}

/// Positions and velocities of the scheme are half a step apart: the velocity at the positions is the mean of the one before
/// and the one after. Makes a step.
double total_energy(const Cloth& c, Provot& p, double gravity) {
  const ProvotState before = p.state();
  p.step();
  const Points3 v = 0.5 * (before.v + p.state().v);
  return mechanics::energy(c.model, before.x, Points3(0, 3)).total() + gravity * c.model.mass.dot(before.x.col(1)) + 0.5 * v.cwiseProduct(c.model.mass.asDiagonal() * v).sum();
}

/// A hanging strip of linear springs: elongation w L^2/(2 C), the load at the clamp its weight.
TEST(provot, strip_hangs_by_its_own_weight) {
  fabric::Card card = fixtures::shirting();
  card.areal_density = 2;
  card.tensile_force_max = 50;
  card.warp = card.weft = {.strain_max = 0.05, .linearity = 1, .resilience = 1, .bending = 7e-6};
  const int rows = 20;
  const double length = 0.2;
  Cloth c = cloth(fixtures::sheet(2, rows, 0.02, length, card, [](double u, double v) { return Eigen::Vector3d(u, v, 0); }));
  ProvotSystem system = system_of(c, g);
  for (int i = 0; i < 3; ++i) system.constraints.positions.push_back({3 * rows + i, c.garment.x.row(3 * rows + i).transpose()});
  ProvotOptions options;
  options.time_step = 0.4 / mechanics::frequency_bound(c.model, c.garment.x);
  options.damping = 20;
  options.constraints.time_constant = 4 * options.time_step;
  Provot p(std::move(system), {c.garment.x, Points3::Zero(c.garment.x.rows(), 3), 0}, options);
  while (p.state().time < 2) p.step();
  const double elongation = -p.state().x(1, 1), expected = 2 * g * length * length / (2 * 1000);
  EXPECT_NEAR(elongation, expected, 0.005 * expected);
  double held = 0;
  for (std::size_t i = 0; i < 3; ++i) held += p.constraints().holding_force(i).y();
  EXPECT_NEAR(held, 2 * 0.02 * length * g, 1e-6);
}

TEST(provot, energy_is_kept_without_damping_and_decays_with_it) {
  for (const double damping : {0.0, 10.0}) {
    Cloth c = cloth(fixtures::sheet(6, 6, 0.06, 0.06, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.01 * std::sin(30 * u)); }));
    ProvotSystem system = system_of(c, 0);
    ProvotOptions options;
    options.time_step = 0.2 / mechanics::frequency_bound(c.model, c.garment.x);
    options.damping = damping;
    Provot p(std::move(system), {c.garment.x, Points3::Zero(c.garment.x.rows(), 3), 0}, options);
    const double start = total_energy(c, p, 0);
    double before = start, most = start;
    for (int block = 0; block < 20; ++block) {
      for (int i = 0; i < 500; ++i) p.step();
      const double now = total_energy(c, p, 0);
      if (damping > 0) {
        EXPECT_LT(now, before);
      }
      most = std::max(most, now);
      before = now;
    }
    EXPECT_LT(most, 1.002 * start);
    if (damping > 0) {
      EXPECT_LT(before, 0.9 * start);
    } else {
      EXPECT_NEAR(before, start, 0.002 * start);
    }
  }
}

TEST(provot, step_above_the_bound_is_unstable_and_below_it_is_not) {
  const auto grows = [](double factor) {
    Cloth c = cloth(fixtures::sheet(6, 6, 0.06, 0.06, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u * (1 + 1e-4 * std::sin(900 * v)), v, 0); }));
    ProvotSystem system = system_of(c, 0);
    ProvotOptions options;
    options.time_step = factor * 2 / mechanics::frequency_bound(c.model, c.garment.x);
    Provot p(std::move(system), {c.garment.x, Points3::Zero(c.garment.x.rows(), 3), 0}, options);
    const double start = total_energy(c, p, 0);
    for (int i = 0; i < 2000; ++i) p.step();
    const double end = total_energy(c, p, 0);
    return !(end < 10 * start);
  };
  EXPECT_FALSE(grows(0.9));
  EXPECT_TRUE(grows(3));
}

TEST(provot, same_bytes_at_any_thread_count) {
  Points3 first;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    Cloth c = cloth(fixtures::sheet(70, 70, 0.7, 0.7, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.1 * u * v); }));
    ProvotSystem system = system_of(c, g);
    for (int i = 0; i < 71; ++i) system.constraints.positions.push_back({70 * 71 + i, c.garment.x.row(70 * 71 + i).transpose()});
    ProvotOptions options;
    options.time_step = 0.4 / mechanics::frequency_bound(c.model, c.garment.x);
    options.constraints.time_constant = 4 * options.time_step;
    Provot p(std::move(system), {c.garment.x, Points3::Zero(c.garment.x.rows(), 3), 0}, options);
    for (int i = 0; i < 50; ++i) p.step();
    if (threads == 1) first = p.state().x;
    EXPECT_EQ(first, p.state().x);
  }
  set_thread_count(0);
}

}  // namespace
