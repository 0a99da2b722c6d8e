#include "cloth_fixtures.h"
#include "tables.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/air.h"
#include "toile/dynamics/simulate.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using mesh::GarmentMesh;
using test::column;

TEST(Air, DragAndLiftOfAPlate) {
  const std::vector<std::array<int, 3>> corners{{0, 1, 2}, {0, 2, 3}};
  AirProperties air{{5, 0, 0}, 1.2, 1.1, 0.8};
  for (double degrees : {-150.0, -90.0, -30.0, 0.0, 20.0, 45.0, 90.0}) {
    // A plate of 0.2 m2 about the z axis; its chord leaves the x axis by the angle.
    const double a = degrees * M_PI / 180, s = std::abs(std::sin(a));
    mesh::Points3 x(4, 3), v = mesh::Points3::Zero(4, 3);
    const Eigen::RowVector3d chord(0.5 * std::cos(a), 0.5 * std::sin(a), 0), span(0, 0, 0.4);
    x << 0, 0, 0, chord, chord + span, span;
    for (const bool moving : {false, true}) {
      AirProperties seen = air;
      if (moving) {  // the same wind, felt by running against still air
        seen.wind.setZero();
        v.rowwise() = Eigen::RowVector3d(-5, 0, 0);
      }
      const AirForces f = air_forces(corners, x, v, seen);
      const double q = 0.5 * 1.2 * 25 * 0.2;
      const Eigen::RowVector3d drag = f.drag.sum() * Eigen::RowVector3d(5, 0, 0), lift = f.lift.colwise().sum();
      EXPECT_NEAR(drag.x(), q * 1.1 * s, 1e-12);
      EXPECT_NEAR(lift.x(), 0, 1e-12);
      EXPECT_NEAR(lift.norm(), q * 0.8 * s * std::abs(std::cos(a)), 1e-12);
      // A chord that rises downstream has its lower side in the wind: it is pushed down; one that falls is lifted.
      if (std::abs(std::sin(2 * a)) > 1e-9) {
        EXPECT_LT(lift.y() * std::sin(2 * a), 0) << degrees;
      }
    }
    v.rowwise() = Eigen::RowVector3d(5, 0, 0);
    const AirForces none = air_forces(corners, x, v, air);
    EXPECT_EQ(none.drag.norm() + none.lift.norm(), 0);
  }
}

fabric::Card soft_card() {
  fabric::Card card = fixtures::shirting();
  card.warp = card.weft = {.strain_max = 0.1, .linearity = 1, .resilience = 1, .bending = 1e-6};
  card.tensile_force_max = 0.4;  // 4 N/m
  card.shear = 0.5;
  card.areal_density = 1;
  return card;
}

SimulationParams motion(Integrator integrator, double duration, double step) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.integrator = integrator;
  params.duration = duration;
  params.time_step = step;
  params.newton_iterations = 40;
  params.newton_accuracy = 1e-12;
  params.air_drag = 0;
  return params;
}

SimulationOutcome run(const GarmentMesh& g, const SimulationParams& params) {
  const Issues issues = validate(params);
  EXPECT_TRUE(issues.empty()) << to_string(issues.front());
  set_thread_count(1);  // a few nodes
  auto result = simulate(g, std::nullopt, params);
  set_thread_count(0);
  EXPECT_TRUE(result) << to_string(result.issues().front());
  return std::move(*result);
}

/// A soft strip that swings and stretches; how much nearer half the step brings it to the limit.
TEST(Motion, OrderOfConvergence) {
  // Held at the top, let go at 45 degrees.
  const GarmentMesh g = fixtures::sheet(1, 3, 0.04, 0.12, soft_card(), [](double u, double v) { return Eigen::Vector3d(u, 0.7 * (v - 0.12), 0.7 * (0.12 - v)); });
  for (const Integrator integrator : {Integrator::implicit, Integrator::bdf2}) {
    std::array<mesh::Points3, 3> x;
    for (std::size_t k = 0; k < 3; ++k) {
      SimulationParams params = motion(integrator, 0.2, 0.004 / std::pow(2.0, k));
      params.fixed = {"sheet.top"};
      params.wind_drag = 1;  // its lagged coefficients must not take an order away
      params.damping_mass = 0.5;
      x[k] = run(g, params).garment.x;
    }
    const double order = std::log2((x[0] - x[1]).norm() / (x[1] - x[2]).norm());
    RecordProperty(integrator == Integrator::bdf2 ? "bdf2" : "euler", std::to_string(order));
    std::printf("order %s: %.3f, last difference %.2e m\n", integrator == Integrator::bdf2 ? "bdf2" : "euler", order, (x[1] - x[2]).norm());
    EXPECT_NEAR(order, integrator == Integrator::bdf2 ? 2 : 1, 0.25);
  }
}

TEST(Motion, SecondOrderKeepsItsEnergy) {
  const GarmentMesh g = fixtures::sheet(1, 3, 0.04, 0.12, soft_card(), [](double u, double v) { return Eigen::Vector3d(u, 0.7 * (v - 0.12), 0.7 * (0.12 - v)); });
  std::array<double, 2> lost{};
  for (const Integrator integrator : {Integrator::implicit, Integrator::bdf2}) {
    SimulationParams params = motion(integrator, 1.0, 0.004);
    params.fixed = {"sheet.top"};
    const std::vector<double> total = column(run(g, params).log, "total_J");
    // From where it was let go, which is higher than rest by the swing's energy.
    double highest = total.front();
    for (double e : total) {
      EXPECT_LT(e, highest + 1e-3 * std::abs(total.front() - total.back()) + 1e-5);
      highest = std::max(highest, e);
    }
    lost[integrator == Integrator::bdf2] = total.front() - total.back();
  }
  std::printf("energy lost in 1 s: euler %.3e J, bdf2 %.3e J\n", lost[0], lost[1]);
  EXPECT_GT(lost[1], -1e-6);
  EXPECT_LT(lost[1], 0.2 * lost[0]);
}

GarmentMesh moving(const GarmentMesh& still, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& velocity) {
  GarmentMesh g = still;
  int c = 0;
  for (const char* name : {"vx", "vy", "vz"}) {
    mesh::Column column;
    for (Eigen::Index i = 0; i < g.x.rows(); ++i) column.reals.push_back(velocity(g.x.row(i).transpose())[c]);
    g.vertex_columns[name] = column;
    ++c;
  }
  return g;
}

TEST(Motion, RayleighDamping) {
  const GarmentMesh still = fixtures::sheet(2, 2, 0.04, 0.04, soft_card(), [](double u, double v) { return Eigen::Vector3d(u - 0.02, v - 0.02, 0); });
  const GarmentMesh thrown = moving(still, [](const Eigen::Vector3d&) { return Eigen::Vector3d(0.3, -0.2, 0.5); });
  SimulationParams params = motion(Integrator::bdf2, 0.5, 0.002);
  params.gravity = 0;
  params.damping_mass = 3;
  const auto slowed = run(thrown, params);
  EXPECT_NEAR(slowed.garment.vertex_columns.at("vz").reals[0] / (0.5 * std::exp(-1.5)), 1, 2e-3);
  // Damping by stiffness leaves flight alone and ends stretching.
  params.damping_mass = 0;
  params.damping_stiffness = 0.02;
  EXPECT_NEAR(run(thrown, params).garment.vertex_columns.at("vz").reals[0], 0.5, 1e-4);
  const GarmentMesh breathing = moving(still, [](const Eigen::Vector3d& x) -> Eigen::Vector3d { return 0.5 * x; });
  params.duration = 0.3;
  const double damped = column(run(breathing, params).log, "total_J").back();
  params.damping_stiffness = 0;
  const double free = column(run(breathing, params).log, "total_J").back();
  EXPECT_LT(damped, 0.05 * free);
}

TEST(Motion, FallsWithItsTerminalVelocity) {
  fabric::Card card = fixtures::shirting();
  const GarmentMesh g = fixtures::sheet(2, 2, 0.1, 0.1, card, [](double u, double v) { return Eigen::Vector3d(u, 0, -v); });
  for (const Integrator integrator : {Integrator::implicit, Integrator::bdf2}) {
    SimulationParams params = motion(integrator, 1.2, 0.01);
    params.newton_accuracy = 1e-9;
    params.wind_drag = 1.2;
    params.wind_lift = 0;
    const auto fallen = run(g, params);
    const double expected = std::sqrt(2 * card.areal_density * 9.81 / (1.2 * 1.2));
    for (double v : fallen.garment.vertex_columns.at("vy").reals) EXPECT_NEAR(-v / expected, 1, 0.01);
    // In a rising wind of that speed it stays where it is.
    params.wind = {0, expected, 0};
    params.duration = 0.5;
    const auto floating = run(g, params);
    for (double v : floating.garment.vertex_columns.at("vy").reals) EXPECT_NEAR(v, 0, 0.01 * expected);
  }
}

/// Held at its upstream edge a sheet turns into the wind; a table turns the wind off.
TEST(Motion, AVaneTurnsIntoTheWind) {
  const fabric::Card card = fixtures::shirting();
  for (const double side : {-1.0, 1.0}) {
    const GarmentMesh g = fixtures::sheet(4, 1, 0.1, 0.025, card, [&](double u, double v) { return Eigen::Vector3d(0.766 * u, v, side * 0.643 * u); });
    SimulationParams params = motion(Integrator::bdf2, 0.6, 0.005);
    params.newton_accuracy = 1e-9;
    params.gravity = 0;
    params.fixed = {"sheet.left"};
    params.wind = {4, 0, 0};
    const auto blown = run(g, params);
    const int tip = mesh::run_vertex_ids(g, *mesh::find_run(g, 0, "right")).front();
    EXPECT_GT(blown.garment.x(tip, 0), 0.09);
    EXPECT_LT(std::abs(blown.garment.x(tip, 2)), 0.02);
    params.wind_times = {0};
    params.wind_factor = {0};
    const auto calm = run(g, params);
    EXPECT_NEAR(calm.garment.x(tip, 2), g.x(tip, 2), 2e-5);
  }
}

/// Cloth strikes a ball and comes to lie on it: nothing passes through, steps converge, and the strike makes no energy.
TEST(Motion, FallsOnABall) {
  const mesh::SupportMesh ball = fixtures::ellipsoid({0.08, 0.08, 0.08}, {0, 0, 0}, 20, 32);
  const GarmentMesh g = fixtures::sheet(24, 24, 0.24, 0.24, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u - 0.12, 0.1, 0.12 - v); });
  for (const Integrator integrator : {Integrator::implicit, Integrator::automatic}) {
    SimulationParams params;
    params.mode = Mode::motion;
    params.integrator = integrator;
    params.duration = 0.4;
    set_thread_count(1);
    const auto result = simulate(g, ball, params);
    set_thread_count(0);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->report.intersections, 0);
    EXPECT_EQ(result->report.support_intersections, 0);
    EXPECT_EQ(result->report.inside, 0);
    EXPECT_LT(result->report.strain_warp_99, 0.02);
    const std::vector<double> total = column(result->log, "total_J"), potential = column(result->log, "potential_J");
    for (double e : total) EXPECT_LT(e, total.front() + 0.02 * std::abs(potential.front() - potential.back()));
    std::printf("%s: %d iterations in %zu steps, %d not converged\n", integrator == Integrator::implicit ? "euler" : "bdf2", result->report.iterations, total.size(), result->report.unconverged_steps);
  }
}

TEST(Motion, CombinationsWithoutMeaningAreRefused) {
  SimulationParams params;
  params.integrator = Integrator::bdf2;
  EXPECT_EQ(validate(params).size(), 1u);
  params.integrator = Integrator::implicit;
  params.wind = {1, 0, 0};
  ASSERT_EQ(validate(params).size(), 1u);
  EXPECT_EQ(validate(params)[0].code, "bad_combination");
  params.mode = Mode::motion;
  EXPECT_TRUE(validate(params).empty());
  params.wind_times = {0, 1};
  EXPECT_EQ(validate(params).size(), 1u);
  params = {};
  params.internal_friction = YarnFriction::yes;
  params.model = Model::particle;
  EXPECT_EQ(validate(params).size(), 1u);
}

}  // namespace
}  // namespace toile::dynamics
