// Coulomb friction of cloth on a support against what is known exactly: the slope at which a square begins to slide and how fast it then
// goes.
#include "cloth_fixtures.h"
#include "toile/dynamics/simulate.h"

#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using fixtures::shirting;
using mesh::GarmentMesh;

mesh::SupportMesh floor_plane(double size) {
  mesh::SupportMesh s;
  s.x.resize(8, 3);
  for (int k = 0; k < 8; ++k) s.x.row(k) << (k & 1 ? size : -size), (k & 2 ? 0 : -size), (k & 4 ? size : -size);
  s.faces.resize(12, 3);
  s.faces << 2, 6, 7, 2, 7, 3, 0, 1, 5, 0, 5, 4, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5;
  s.face_region = mesh::Ids::Constant(12, -1);
  return s;
}

/// A square on a slope, for a second: how far it went and how fast it is [m, m/s].
std::pair<double, double> slide_down(double tangent, double mu) {
  const fabric::Card card = shirting();
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 1;
  params.air_drag = 0;
  params.support_friction = mu;
  params.newton_accuracy = 1e-8;
  const double cosine = 1 / std::sqrt(1 + tangent * tangent);
  params.gravity_direction = {tangent * cosine, -cosine, 0};
  // Where the support's push carries the weight.
  const double gap = params.support_reach - card.areal_density * params.gravity * cosine / params.contact_stiffness;
  // Off the floor's diagonal, where both of its faces would carry.
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, card, [&](double u, double v) { return Eigen::Vector3d(u - 0.5, gap, -v - 0.2); });
  const auto result = simulate(g, floor_plane(1), params);
  if (!result) {
    ADD_FAILURE() << to_string(result.issues().front());
    return {};
  }
  EXPECT_EQ(result->report.unconverged_steps, 0);
  const auto& v = result->garment.vertex_columns.at("vx").reals;
  double speed = 0;
  for (double value : v) speed += value / static_cast<double>(v.size());
  return {result->garment.x.col(0).mean() - g.x.col(0).mean(), speed};
}

TEST(FrictionOnASlope, SlipsAtItsCoefficient) {
  for (const double mu : {0.1, 0.3, 0.8}) {
    const auto [stuck, stuck_speed] = slide_down(mu * 0.999, mu);
    EXPECT_LT(stuck, 2e-5) << mu;
    EXPECT_LT(std::abs(stuck_speed), 1e-6) << mu;
    const auto [slid, speed] = slide_down(mu * 1.001, mu);
    const double acceleration = 9.81 * (mu * 0.001) / std::sqrt(1 + 1.002 * mu * mu);
    EXPECT_GT(slid, 0.3 * acceleration) << mu;  // half of the acceleration by t^2
    EXPECT_NEAR(speed / acceleration, 1, 0.1) << mu;
  }
}

TEST(FrictionOnASlope, SlidesAsFastAsItMust) {
  const auto [way, speed] = slide_down(0.5, 0.2);
  const double acceleration = 9.81 * (0.5 - 0.2) / std::sqrt(1.25);
  EXPECT_NEAR(speed / acceleration, 1, 1e-3);
  EXPECT_NEAR(way / (0.5 * acceleration), 1, 0.02);  // implicit Euler in 60 steps: 1 + 1/60
}

/// A square on the floor, an edge of it driven forth by 2 mm and back by `back` [m], equilibria in a row: force of the edge on the cloth, over
/// friction coefficient and weight.
double drag(double back, double time_step) {
  const fabric::Card card = shirting();
  const double mu = 0.3;
  SimulationParams params;
  params.support_friction = mu;
  params.time_step = time_step;
  params.increments = 15;
  params.duration = 15;
  params.max_iterations = 3000;
  ConstraintSpec jaw;
  jaw.name = "jaw";
  jaw.on = {"sheet.right"};
  jaw.kind = Hold::slide;
  jaw.normal = {1, 0, 0};
  jaw.times = {0, 10, 15};
  jaw.move = {{0, 0, 0}, {0.002, 0, 0}, {0.002 - back, 0, 0}};
  params.constraints = {jaw};
  const double gap = params.support_reach - card.areal_density * params.gravity / params.contact_stiffness;
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, card, [&](double u, double v) { return Eigen::Vector3d(u - 0.5, gap, -v - 0.2); });
  const auto result = simulate(g, floor_plane(1), params);
  if (!result) {
    ADD_FAILURE() << to_string(result.issues().front());
    return 0;
  }
  EXPECT_TRUE(result->report.converged);
  return result->report.reactions.front().force.x() / (mu * card.areal_density * 0.06 * 0.06 * params.gravity);
}

TEST(FrictionOfEquilibria, DragsWithItsCoefficientAndTurnsRound) {
  EXPECT_NEAR(drag(0, 1.0 / 60), 1, 2e-3);
  EXPECT_NEAR(drag(0.002, 1.0 / 60), -1, 2e-3);
}

TEST(FrictionOfEquilibria, DoesNotDependOnTheIterations) {
  // About half of the way that turns the force round.
  const double half = drag(7e-7, 1.0 / 60);
  EXPECT_LT(std::abs(half), 0.9);
  for (const double step : {1.0 / 240, 0.2}) EXPECT_NEAR(drag(7e-7, step), half, 5e-3) << step;
}

}  // namespace
}  // namespace toile::dynamics
