// KES-F's bending test, a cantilever and a released bend with friction between the yarns, through the simulation.
#include "cloth_fixtures.h"
#include "tables.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/simulate.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using mesh::GarmentMesh;
using test::column;

constexpr double b_warp = 0.080 * 9.80665e-5, loop = 0.070 * 9.80665e-3;  // 0.080 gf cm2/cm, 0.070 gf cm/cm

fabric::Card stiff_card() {
  fabric::Card card = fixtures::shirting();
  card.warp = card.weft = {.strain_max = 0.01, .linearity = 1, .resilience = 1, .bending = b_warp, .bending_hysteresis = loop};
  card.tensile_force_max = 2000;
  return card;
}

SimulationParams parameters() {
  set_thread_count(1);  // a few nodes
  SimulationParams params;
  params.internal_friction = YarnFriction::yes;
  params.self_reach = 1e-4;
  params.max_iterations = 3000;
  return params;
}

GarmentMesh strip(const fabric::Card& card, int cells, double length) {
  return fixtures::sheet(cells, 2, length, 2 * length / cells, card, [](double u, double v) { return Eigen::Vector3d(u, 0, -v); });
}

/// Both ends held with their tangents; the right one moves so that the strip can have each of these curvatures all along, one a second. (As the
/// polygon that it is: held at the ends of the arc it would be under a chord's force, which is second order in the cells.)
std::vector<ConstraintSpec> bending_machine(const std::vector<double>& curvature, double length, int cells) {
  ConstraintSpec fixed, jaw;
  fixed.name = "fixed";
  fixed.on = {"sheet.left"};
  fixed.kind = jaw.kind = Hold::clamp;
  jaw.name = "jaw";
  jaw.on = {"sheet.right"};
  for (std::size_t i = 0; i < curvature.size(); ++i) {
    const double h = length / cells;
    std::array<double, 3> move{-length, 0, 0};
    for (int c = 0; c < cells; ++c) {
      move[0] += h * std::cos((c + 0.5) * h * curvature[i]);
      move[1] += h * std::sin((c + 0.5) * h * curvature[i]);
    }
    jaw.times.push_back(static_cast<double>(i));
    jaw.turn.push_back(curvature[i] * length);
    jaw.move.push_back(move);
  }
  return {fixed, jaw};
}

/// 1 cm between jaws, to 2.5/cm and back: B, 2HB; then let go from 2/cm: the bend that stays.
TEST(VirtualKes, BendingInTheMachine) {
  const double length = 0.01;
  const int cells = 16;
  const GarmentMesh g = strip(stiff_card(), cells, length);
  SimulationParams params = parameters();
  params.gravity = 0;
  const std::vector<double> path{0, 50, 100, 150, 200, 250, 200, 150, 100, 50, 0, -50, -100, -150, -200, -250};
  params.constraints = bending_machine(path, length, cells);
  params.increments = 15;
  params.duration = 15;
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  EXPECT_TRUE(result->report.converged);
  std::vector<double> moment = column(result->record, "jaw.moment_z_Nm");
  ASSERT_EQ(moment.size(), 15u);
  for (double& m : moment) m /= 2 * length / cells;
  EXPECT_NEAR((moment[2] - moment[0]) / 100 / b_warp, 1, 0.01);
  EXPECT_NEAR((moment[1] - moment[7]) / loop, 1, 0.01);
  EXPECT_NEAR(moment[14], -250 * b_warp - loop / 2, 0.01 * 250 * b_warp);

  params.constraints = bending_machine({0, 50, 100, 150, 200}, length, cells);
  params.increments = 4;
  params.duration = 4;
  auto bent = simulate(g, std::nullopt, params);
  ASSERT_TRUE(bent);
  EXPECT_TRUE(bent->report.converged);
  // Held by two rows of nodes, which bend with the rest.
  ConstraintSpec rows;
  rows.on = {"sheet"};
  rows.region = {{-1e-6, -1}, {length / cells + 1e-6, -1}, {length / cells + 1e-6, 1}, {-1e-6, 1}};
  params.constraints = {rows};
  const auto free = simulate(bent->garment, std::nullopt, params);
  ASSERT_TRUE(free);
  EXPECT_TRUE(free->report.converged);
  const auto& x = free->garment.x;
  const Eigen::Vector3d p = (x.row(8) - x.row(4)).transpose(), q = (x.row(12) - x.row(8)).transpose();
  const double curvature = 2 * p.cross(q).norm() / (p.norm() * q.norm() * (p + q).norm());
  EXPECT_NEAR(curvature / (loop / (2 * b_warp)), 1, 0.02);
}

/// Drop over reach of a strip whose gravity grows from nothing, rigid up to HB: theta'' as of the elastica, curvature = max(|M| - HB, 0)/B.
/// By shooting from the free end.
double friction_elastica(double gamma, double eta) {
  double low = 0, high = 0.5 * M_PI, ratio = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const double middle = 0.5 * (low + high);
    const int steps = 2000;
    const double h = 1.0 / steps;
    double angle = middle, moment = 0, drop = 0, reach = 0;
    for (int i = 0; i < steps; ++i) {
      const double t = (i + 0.5) * h, half_moment = moment + 0.5 * h * gamma * (t - 0.25 * h) * std::cos(angle);
      const double half_angle = angle - 0.5 * h * std::max(half_moment - eta, 0.0);
      moment += h * gamma * t * std::cos(half_angle);
      angle -= h * std::max(half_moment - eta, 0.0);
      drop += h * std::sin(half_angle);
      reach += h * std::cos(half_angle);
    }
    ratio = drop / reach;
    (angle > 0 ? high : low) = middle;
  }
  return ratio;
}

double drop_over_reach(const GarmentMesh& g) {
  double h = 0, w = 0;
  for (int v : mesh::run_vertex_ids(g, *mesh::find_run(g, 0, "right"))) {
    h -= g.x(v, 1);
    w += g.x(v, 0);
  }
  return h / w;
}

TEST(Simulate, CantileverWithInternalFriction) {
  // Published: 1.066802 without friction, 0.656997 with eta = HB L/B = 1, at gamma 10.
  EXPECT_NEAR(friction_elastica(10, 0), 1.066802, 1e-4);
  EXPECT_NEAR(friction_elastica(10, 1), 0.656997, 1e-4);
  const double length = 0.08;
  struct Row {
    double gamma, eta;
  };
  for (const Row& row : {Row{10, 0.5}, Row{10, 1}, Row{50, 1}}) {
    fabric::Card card = stiff_card();
    card.warp.bending_hysteresis = card.weft.bending_hysteresis = 2 * row.eta * b_warp / length;
    card.areal_density = row.gamma * b_warp / (length * length * length) / 9.81;
    SimulationParams params = parameters();
    ConstraintSpec clamp;
    clamp.on = {"sheet.left"};
    clamp.kind = Hold::clamp;
    params.constraints = {clamp};
    const auto result = simulate(strip(card, 32, length), std::nullopt, params);
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->report.converged);
    const double ratio = drop_over_reach(result->garment) / friction_elastica(row.gamma, row.eta);
    RecordProperty("gamma_" + std::to_string(row.gamma) + "_eta_" + std::to_string(row.eta), std::to_string(ratio));
    EXPECT_NEAR(ratio, 1, 0.02) << row.gamma << ' ' << row.eta;
  }
}

/// Loaded and unloaded in one run or, through the file's columns, in two.
TEST(Simulate, ARunThatGoesOnRemembersItsFriction) {
  const double length = 0.08;
  fabric::Card card = stiff_card();
  card.warp.bending_hysteresis = card.weft.bending_hysteresis = 2 * b_warp / length;
  card.areal_density = 10 * b_warp / (length * length * length) / 9.81;
  const GarmentMesh g = strip(card, 16, length);
  SimulationParams params = parameters();
  params.residual = 1e-4;
  ConstraintSpec held;  // two rows of nodes instead of a clamp: its tangent would be taken from the bent strip
  held.on = {"sheet"};
  held.region = {{-1e-6, -1}, {length / 16 + 1e-6, -1}, {length / 16 + 1e-6, 1}, {-1e-6, 1}};
  params.constraints = {held};
  params.gravity_times = {1, 2};
  params.gravity_factor = {1, 0.05};
  params.duration = 2;
  params.increments = 2;
  const auto once = simulate(g, std::nullopt, params);
  ASSERT_TRUE(once);
  EXPECT_TRUE(once->report.converged);
  params.increments = 1;
  params.duration = 1;
  const auto first = simulate(g, std::nullopt, params);
  ASSERT_TRUE(first);
  params.duration = 2;
  const auto second = simulate(first->garment, std::nullopt, params);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->report.converged);
  EXPECT_NEAR(drop_over_reach(second->garment), drop_over_reach(once->garment), 0.002);
  EXPECT_GT(drop_over_reach(once->garment), 0.05);  // much of the bend stays
  EXPECT_LT(drop_over_reach(once->garment), 0.8 * drop_over_reach(first->garment));
  // Without the columns the strip takes its bend for one that it was just given: friction holds it up instead of down.
  GarmentMesh forgotten = first->garment;
  forgotten.vertex_columns.clear();
  forgotten.face_columns.clear();
  const auto third = simulate(forgotten, std::nullopt, params);
  ASSERT_TRUE(third);
  EXPECT_LT(drop_over_reach(third->garment), 0.7 * drop_over_reach(once->garment));
}

}  // namespace
}  // namespace toile::dynamics
