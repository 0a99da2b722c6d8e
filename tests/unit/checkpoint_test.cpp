// A run that is stopped and goes on from its checkpoint ends with the same bytes as one that was left alone.
#include "cloth_fixtures.h"
#include "results.h"
#include "toile/dynamics/simulate.h"

#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using Eigen::Vector3d;
using mesh::GarmentMesh;
using test::checked;

GarmentMesh strip() {
  return fixtures::sheet(6, 10, 0.06, 0.1, fixtures::shirting(), [](double u, double v) { return Vector3d(u, 0.8 * (v - 0.1), 0.6 * (v - 0.1)); });
}

/// Runs whole, then interrupted after `steps` and resumed; all that comes out is the same.
void expect_same(const GarmentMesh& g, const SimulationParams& params, int steps, const std::string& motion = {}) {
  ASSERT_TRUE(validate(params).empty()) << to_string(validate(params).front());
  const auto hooks_with = [&](std::unique_ptr<SupportMotion>& source) {
    SimulationHooks hooks;
    if (!motion.empty()) {
      source = checked(table_motion(motion, "", 0));
      hooks.supports = source.get();
    }
    return hooks;
  };
  std::unique_ptr<SupportMotion> a, b, c;
  const SimulationOutcome whole = checked(simulate(g, std::nullopt, params, hooks_with(a)));
  std::optional<Checkpoint> left;
  SimulationHooks hooks = hooks_with(b);
  int asked = 0;
  hooks.progress = [&](double, const std::string&) { ++asked; };
  hooks.interrupted = [&] { return asked >= steps; };
  hooks.checkpoint = [&](const Checkpoint& checkpoint) { left = checkpoint; };
  const SimulationOutcome stopped = checked(simulate(g, std::nullopt, params, hooks));
  ASSERT_TRUE(left);
  EXPECT_LT(stopped.report.iterations, whole.report.iterations);
  EXPECT_EQ(stopped.findings.back().code, "interrupted");
  SimulationHooks again = hooks_with(c);
  again.resume = &left->state;
  const SimulationOutcome resumed = checked(simulate(left->garment, std::nullopt, params, again));
  EXPECT_EQ(resumed.garment.x, whole.garment.x);
  EXPECT_EQ(resumed.log, whole.log);
  EXPECT_EQ(resumed.record, whole.record);
  EXPECT_EQ(resumed.report.iterations, whole.report.iterations);
  EXPECT_EQ(resumed.garment.marks, whole.garment.marks);
  ASSERT_EQ(resumed.garment.vertex_columns.size(), whole.garment.vertex_columns.size());
  for (const auto& [name, column] : whole.garment.vertex_columns) EXPECT_EQ(resumed.garment.vertex_columns.at(name).reals, column.reals) << name;
  // What is damaged is refused.
  const std::string cut = left->state.substr(0, left->state.size() / 2), empty = "x";
  for (const std::string* bytes : {&cut, &empty}) {
    std::unique_ptr<SupportMotion> d;
    SimulationHooks damaged = hooks_with(d);
    damaged.resume = bytes;
    EXPECT_EQ(test::codes(simulate(left->garment, std::nullopt, params, damaged)), "bad_checkpoint");
  }
}

TEST(Checkpoint, Equilibrium) {
  SimulationParams params;
  params.fixed = {"sheet.top"};
  expect_same(strip(), params, 6);
}

TEST(Checkpoint, MotionOfBothOrders) {
  for (const Integrator integrator : {Integrator::automatic, Integrator::implicit}) {
    SimulationParams params;
    params.mode = Mode::motion;
    params.integrator = integrator;
    params.duration = 0.1;
    params.time_step = 0.005;
    params.fixed = {"sheet.top"};
    params.wind = {0, 0, 2};
    params.damping_stiffness = 1e-3;
    expect_same(strip(), params, 9);
  }
}

TEST(Checkpoint, YarnsThatRememberAndBodiesThatMove) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.05;
  params.time_step = 0.005;
  params.internal_friction = YarnFriction::yes;
  ConstraintSpec hold;
  hold.on = {"sheet.top"};
  hold.kind = Hold::clamp;
  hold.body = "bar";
  params.constraints = {hold};
  expect_same(strip(), params, 5, "time,body,x,y,z,qw,qx,qy,qz\n0,bar,0,0,0,1,0,0,0\n0.025,bar,0.001,0.004,0,1,0,0,0\n0.06,bar,0.004,0.004,0.003,1,0,0,0\n");
}

TEST(Checkpoint, EveryOneGivesTheSameEnd) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.06;
  params.time_step = 0.005;
  params.fixed = {"sheet.top"};
  params.checkpoint_interval = 4;
  const GarmentMesh g = strip();
  std::vector<Checkpoint> left;
  SimulationHooks hooks;
  hooks.checkpoint = [&](const Checkpoint& checkpoint) { left.push_back(checkpoint); };
  std::vector<double> times;
  hooks.frame = [&](double time, const Points3& x, const Points3&) {
    times.push_back(time);
    EXPECT_EQ(x.rows(), g.x.rows());
  };
  params.frame_interval = 0.02;
  const SimulationOutcome whole = checked(simulate(g, std::nullopt, params, hooks));
  ASSERT_EQ(left.size(), 2u);
  ASSERT_EQ(times.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(times[k], 0.02 * static_cast<double>(k), 1e-12);
  for (const Checkpoint& checkpoint : left) {
    SimulationHooks again;
    again.resume = &checkpoint.state;
    EXPECT_EQ(checked(simulate(checkpoint.garment, std::nullopt, params, again)).garment.x, whole.garment.x);
  }
}

}  // namespace
}  // namespace toile::dynamics
