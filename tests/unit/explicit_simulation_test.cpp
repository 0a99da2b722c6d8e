#include <gtest/gtest.h>

#include <cmath>

#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/simulate.h"

using namespace toile;
using namespace toile::dynamics;

namespace {

SimulationParams particle_params(Integrator integrator) {
  SimulationParams params;
  params.model = Model::particle;
  params.integrator = integrator;
  params.residual = 1e-3;
  params.max_iterations = 3000;
  return params;
}

/// Soft along the yarns, so that steps may be long.
fabric::Card soft(double bending) {
  fabric::Card card = fixtures::shirting();
  card.tensile_force_max = 10;
  card.warp = card.weft = {.strain_max = 0.04, .linearity = 1, .resilience = 1, .bending = bending};
  card.shear = 5;
  return card;
}

/// Hung from two edges that are nearer than it is wide.
mesh::GarmentMesh slack_cloth(int columns, int rows) {
  return fixtures::sheet(columns, rows, 0.3, 0.1, soft(2e-6), [](double u, double v) {
    const double t = u / 0.3;
    return Eigen::Vector3d(0.22 * t, -0.3 * t * (1 - t), v);
  });
}

TEST(explicit_simulation, comes_to_the_same_rest_as_the_implicit_one) {
  const mesh::GarmentMesh g = slack_cloth(15, 3);
  SimulationParams params = particle_params(Integrator::implicit);
  params.fixed = {"sheet.left", "sheet.right"};
  const auto implicit = simulate(g, std::nullopt, params);
  ASSERT_TRUE(implicit);
  EXPECT_TRUE(implicit->report.converged) << implicit->report.residual;
  params.integrator = Integrator::provot;
  const auto explicit_run = simulate(g, std::nullopt, params);
  ASSERT_TRUE(explicit_run);
  EXPECT_TRUE(explicit_run->report.converged) << explicit_run->report.residual;
  EXPECT_LT((implicit->garment.x - explicit_run->garment.x).rowwise().norm().maxCoeff(), 5e-4);
  EXPECT_NEAR(explicit_run->report.potential_energy, implicit->report.potential_energy, 1e-4 * std::abs(implicit->report.potential_energy));
  // Edges stay where they are held.
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.uv(v, 0) < 1e-9 || g.uv(v, 0) > 0.3 - 1e-9) {
      EXPECT_LT((explicit_run->garment.x.row(v) - g.x.row(v)).norm(), 1e-7);
    }
  }
}

/// A flexible cloth between two parallel edges hangs as a catenary: y = a cosh(x/a), sag within 1 %.
TEST(explicit_simulation, hangs_as_a_catenary) {
  const mesh::GarmentMesh g = fixtures::sheet(20, 2, 0.3, 0.03, soft(1e-9), [](double u, double v) {
    const double t = u / 0.3;
    return Eigen::Vector3d(0.22 * t, -0.3 * t * (1 - t), v);
  });
  SimulationParams params = particle_params(Integrator::provot);
  params.fixed = {"sheet.left", "sheet.right"};
  params.explicit_damping = 12;
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  double low = 0.01, high = 10;
  for (int k = 0; k < 100; ++k) {
    const double a = 0.5 * (low + high);
    (2 * a * std::sinh(0.11 / a) > 0.3 ? low : high) = a;
  }
  const double a = 0.5 * (low + high), sag = a * (std::cosh(0.11 / a) - 1);
  EXPECT_NEAR(-result->garment.x.col(1).minCoeff(), sag, 0.01 * sag);
}

TEST(explicit_simulation, drapes_over_a_body_without_touching_it) {
  const mesh::SupportMesh ball = fixtures::ellipsoid({0.08, 0.08, 0.08}, {0, 0, 0}, 20, 32);
  const mesh::GarmentMesh g = fixtures::sheet(12, 12, 0.24, 0.24, soft(4e-6), [](double u, double v) { return Eigen::Vector3d(u - 0.12, 0.085, 0.12 - v); });
  SimulationParams params = particle_params(Integrator::provot);
  params.settling_time = 0.4;
  const auto result = simulate(g, ball, params);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.intersections, 0);
  EXPECT_EQ(result->report.support_intersections, 0);
  EXPECT_EQ(result->report.inside, 0);
  EXPECT_GT(result->report.contacts, 10);
  EXPECT_LT(result->garment.x.col(1).minCoeff(), 0.02) << "the corners hang down";
  for (const Issue& finding : result->findings) EXPECT_EQ(finding.code, "not_converged") << to_string(finding);
}

TEST(explicit_simulation, motion_without_damping_falls_freely) {
  const mesh::GarmentMesh g = fixtures::sheet(4, 4, 0.04, 0.04, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  SimulationParams params = particle_params(Integrator::provot);
  params.mode = Mode::motion;
  params.air_drag = 0;
  params.duration = 0.1;
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.converged);
  EXPECT_NEAR(result->report.simulated_time, 0.1, 1e-4);
  const double t = result->report.simulated_time;
  EXPECT_NEAR(result->garment.x(0, 1) - g.x(0, 1), -9.81 * t * t / 2, 1e-3 * 0.05);
}

TEST(explicit_simulation, says_what_step_is_stable) {
  const mesh::GarmentMesh g = slack_cloth(8, 2);
  SimulationParams params = particle_params(Integrator::provot);
  params.explicit_step = 5e-3;
  params.fixed = {"sheet.left"};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues().front().code, "step_too_long");
  EXPECT_NE(to_string(result.issues().front()).find("certainly stable"), std::string::npos) << to_string(result.issues().front());
}

/// A free corner swings about a held one at a distance shorter than the cloth between them.
TEST(explicit_simulation, holds_two_points_at_a_distance) {
  mesh::GarmentMesh g = slack_cloth(8, 2);
  g.points.push_back({0, "held", 0});
  g.points.push_back({0, "free", 8});
  SimulationParams params = particle_params(Integrator::provot);
  params.fixed = {"sheet.left"};
  params.mode = Mode::motion;
  params.duration = 0.15;
  const double start = (g.x.row(0) - g.x.row(8)).norm();
  for (const double factor : {1.0, 0.9}) {
    params.distances = {{"tie", {"sheet.held", "sheet.free"}, factor == 1.0 ? std::nullopt : std::optional(factor * start)}};
    EXPECT_TRUE(validate(params).empty());
    const auto result = simulate(g, std::nullopt, params);
    ASSERT_TRUE(result);
    EXPECT_NEAR((result->garment.x.row(0) - result->garment.x.row(8)).norm() / (factor * start), 1, 1e-4);
    ASSERT_EQ(result->report.distance_forces.size(), 1U);
    EXPECT_EQ(result->report.distance_forces[0].first, "tie");
    EXPECT_NE(result->report.distance_forces[0].second, 0);
    if (factor == 1.0) {  // a tie that is too long at first throws the corner inwards
      EXPECT_LT(result->garment.x(8, 1), -0.03);
    }
  }
  params.distances[0].between[1] = "sheet.held";
  EXPECT_FALSE(simulate(g, std::nullopt, params));
  params.distances[0].between[1] = "sheet.right";
  EXPECT_FALSE(simulate(g, std::nullopt, params));
  params.integrator = Integrator::implicit;
  EXPECT_EQ(validate(params).size(), 1U);
}

/// One edge is held, the other driven out and back on a path; the reactions carry the weight.
TEST(explicit_simulation, drives_an_edge_and_records_reactions) {
  const mesh::GarmentMesh g = slack_cloth(8, 2);
  SimulationParams params = particle_params(Integrator::provot);
  params.fixed = {"sheet.left"};
  ConstraintSpec jaw;
  jaw.name = "jaw";
  jaw.on = {"sheet.right"};
  jaw.kind = Hold::drive;
  jaw.times = {0, 0.1};
  jaw.move = {{0, 0, 0}, {0.02, 0, 0}};
  params.constraints = {jaw};
  params.record = "record.csv";
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.converged) << result->report.residual;
  EXPECT_GE(result->report.simulated_time, 0.1);
  ASSERT_EQ(result->report.reactions.size(), 2U);
  const double weight = result->report.reactions[0].force.y() + result->report.reactions[1].force.y();
  const double mass = 0.3 * 0.1 * soft(2e-6).areal_density;
  EXPECT_NEAR(weight, 9.81 * mass, 0.02 * 9.81 * mass);
  EXPECT_NEAR(result->report.reactions[0].force.x(), -result->report.reactions[1].force.x(), 0.02 * 9.81 * mass);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const double shift = g.uv(v, 0) > 0.3 - 1e-9 ? 0.02 : 0;
    if (shift == 0 && g.uv(v, 0) > 1e-9) continue;
    EXPECT_LT((result->garment.x.row(v) - g.x.row(v) - Eigen::RowVector3d(shift, 0, 0)).norm(), 1e-7);
  }
}

TEST(explicit_simulation, takes_the_woven_model_too) {
  const mesh::GarmentMesh g = slack_cloth(12, 2);
  SimulationParams params = particle_params(Integrator::provot);
  params.model = Model::woven;
  params.fixed = {"sheet.left", "sheet.right"};
  const auto explicit_run = simulate(g, std::nullopt, params);
  ASSERT_TRUE(explicit_run);
  EXPECT_TRUE(explicit_run->report.converged) << explicit_run->report.residual;
  params.integrator = Integrator::implicit;
  const auto implicit = simulate(g, std::nullopt, params);
  ASSERT_TRUE(implicit);
  EXPECT_LT((implicit->garment.x - explicit_run->garment.x).rowwise().norm().maxCoeff(), 5e-4);
}

TEST(explicit_simulation, same_bytes_at_any_thread_count) {
  const mesh::SupportMesh ball = fixtures::ellipsoid({0.08, 0.08, 0.08}, {0, 0, 0}, 12, 20);
  const mesh::GarmentMesh g = fixtures::sheet(8, 8, 0.2, 0.2, soft(4e-6), [](double u, double v) { return Eigen::Vector3d(u - 0.1, 0.084, 0.1 - v); });
  SimulationParams params = particle_params(Integrator::provot);
  params.settling_time = 0.03;
  mesh::Points3 first;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    const auto result = simulate(g, ball, params);
    ASSERT_TRUE(result);
    if (threads == 1) first = result->garment.x;
    EXPECT_EQ(first, result->garment.x);
  }
  set_thread_count(0);
}

}  // namespace
