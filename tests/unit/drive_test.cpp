// A linkage under a motor, coupled with a cloth that is a single mass on one of its bodies.
#include "results.h"
#include "toile/base/text.h"
#include "toile/coupling/coupled_motion.h"
#include "toile/coupling/drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <thread>

using namespace toile;
using namespace toile::coupling;
using Eigen::Vector3d;
using test::checked;
using test::codes;

namespace {

/// A rod of 400 mm that hangs from a pivot.
mechanism::Linkage pendulum() {
  mechanism::Linkage l;
  l.bodies = {"rod"};
  l.driver = "rod";
  l.pivots = {{{"ground", "rod"}, {0, 0}}};
  l.bars = {{.body = "rod", .points = {{0, 0}, {0, -0.4}}, .half_width = 0.5, .thickness = 0.01, .height = 0.02}};
  return l;
}
const Vector3d tip(0, -0.4, 0);

struct Weight {
  double mass = 1;
  double longest = 1;  ///< steps that it can follow [s]
  double step = 1;     ///< that it asks for [s]
  double duration = 0.5;
};

/// What a simulator does, with one mass at the tip that goes where the rod goes: Euler's velocities and accelerations.
Issues simulate(dynamics::SupportMotion& motion, const Weight& weight) {
  auto state = motion.start(weight.duration);
  if (!state) return state.issues();
  double time = 0, step = weight.step;
  Vector3d x = state->poses[0](tip), v = state->twists[0].linear + state->twists[0].angular.cross(x - state->poses[0].shift);
  while (time < weight.duration - 1e-9) {
    const auto next = motion.advance(time, step);
    if (!next) return next.issues();
    const double h = next->time - time;
    const Vector3d there = next->poses[0](tip), velocity = (there - x) / h, force = weight.mass * (Vector3d(0, -9.81, 0) - (velocity - v) / h);
    const bool can = h <= weight.longest;
    const auto verdict = motion.finish(can, {{force, (there - next->poses[0].shift).cross(force)}});
    if (!verdict) return verdict.issues();
    if (!can) step = 0.5 * h;
    if (!can || *verdict == dynamics::SupportMotion::Verdict::undone) continue;
    x = there;
    v = velocity;
    time = next->time;
    step = weight.step;
  }
  return {};
}

struct Both {
  Result<DriveOutcome> drive{Issue{}};
  Issues cloth;
};

Both run(const mechanism::Linkage& linkage, const DriveParams& params, const Weight& weight, const CoupledOptions& coupled = {"", {"rod"}, 0, {}}, dynamics::SupportMotion* table = nullptr) {
  ChannelOptions options;
  options.endpoint = "tcp://127.0.0.1:*";
  Channel listening = checked(Channel::listen(options));
  options.endpoint = listening.endpoint();
  Both both;
  std::thread thread([&] { both.drive = drive(linkage, "drawing", params, checked(Channel::call(options)), {}, table); });
  {
    auto motion = coupled_motion(std::move(listening), coupled);
    both.cloth = motion ? simulate(**motion, weight) : motion.issues();
  }
  thread.join();
  return both;
}

std::string first(const Issues& issues) { return issues.empty() ? "" : issues.front().code; }

DriveParams free_swing(double step) {
  DriveParams p;
  p.motor = Motor::torque;
  p.times = {0, 0.5};
  p.torques = {0, 0};
  p.angles = {1};
  p.time_step = step;
  return p;
}

}  // namespace

TEST(drive, a_mass_that_is_coupled_swings_like_one_that_is_built_in) {
  mechanism::Linkage built_in = pendulum();
  built_in.masses = {{"rod", 3, {0, -0.4}, 0}};
  mechanism::Dynamics dynamics = checked(mechanism::Dynamics::make(built_in, 9.81));
  const mechanism::DriverState exact = checked(dynamics.advance({1, 0}, 0, 0.5, [](double, const mechanism::DriverState&) { return 0.0; }));
  // The mass is seven times that of the rod: without rounds it would shake itself to pieces.
  std::vector<double> errors;
  for (const double step : {4e-3, 2e-3}) {
    const Both both = run(pendulum(), free_swing(step), {.mass = 3});
    EXPECT_EQ(first(both.cloth), "");
    const DriveOutcome& outcome = checked(Result<DriveOutcome>(both.drive));
    EXPECT_TRUE(outcome.findings.empty());
    EXPECT_EQ(outcome.report.unconverged, 0);
    EXPECT_GT(outcome.report.rejected, 0);
    EXPECT_EQ(outcome.report.steps, static_cast<int>(std::lround(0.5 / step)));
    errors.push_back(std::abs(outcome.report.angle - exact.angle));
  }
  EXPECT_LT(errors[1], 0.02);
  EXPECT_NEAR(errors[0] / errors[1], 2, 0.3);
}

TEST(drive, a_prescribed_motion_needs_the_torque_that_a_lever_says) {
  DriveParams p;
  p.angles = {0.5, 0.5};
  p.times = {2, 2.1};  // begins at any time
  p.profile = mechanism::Profile::straight;
  const Both both = run(pendulum(), p, {.mass = 1.5, .duration = 0.1});
  EXPECT_EQ(first(both.cloth), "");
  const DriveOutcome& outcome = checked(Result<DriveOutcome>(both.drive));
  const double rod = 2 * 2700 * 0.4 * 0.01 * 0.02;
  const std::string last = split(outcome.record.substr(0, outcome.record.size() - 1), '\n').back();
  const auto cells = split(last, ',');
  EXPECT_NEAR(*parse_number(cells[0]), 2.1, 1e-12);
  EXPECT_NEAR(*parse_number(cells[4]), -1.5 * 9.81 * 0.4 * std::sin(0.5), 1e-9);
  EXPECT_NEAR(*parse_number(cells[3]), (1.5 * 0.4 + rod * 0.2) * 9.81 * std::sin(0.5), 1e-6);
  EXPECT_EQ(outcome.report.rejected, 0);
}

TEST(drive, a_servo_gets_there_and_its_work_is_where_it_went) {
  DriveParams p;
  p.motor = Motor::servo;
  p.angles = {0, 1};
  p.times = {0, 0.5};
  p.time_step = 2e-3;
  const Both both = run(pendulum(), p, {.mass = 1});
  const DriveOutcome& outcome = checked(Result<DriveOutcome>(both.drive));
  EXPECT_TRUE(outcome.findings.empty());
  EXPECT_NEAR(outcome.report.angle, 1, 0.01);
  mechanism::Dynamics dynamics = checked(mechanism::Dynamics::make(pendulum(), 9.81));
  const double lift = checked(dynamics.at(outcome.report.angle)).height_energy - checked(dynamics.at(0)).height_energy;
  const double kinetic = 0.5 * checked(dynamics.at(outcome.report.angle)).inertia * outcome.report.rate * outcome.report.rate;
  EXPECT_NEAR(outcome.report.motor_work + outcome.report.cloth_work, lift + kinetic, 0.02 * lift);
  // Weak motors do not get there.
  p.largest_torque = 1;
  EXPECT_LT(checked(run(pendulum(), p, {.mass = 1}).drive).report.angle, 0.5);
}

TEST(drive, steps_that_the_cloth_refuses_become_shorter_or_end_the_run) {
  DriveParams p = free_swing(0.01);
  Both both = run(pendulum(), p, {.mass = 1, .longest = 3e-3});
  EXPECT_EQ(first(checked(Result<DriveOutcome>(both.drive)).findings), "refused");
  EXPECT_EQ(checked(Result<DriveOutcome>(both.drive)).findings.front().category, Category::check);
  EXPECT_EQ(first(both.cloth), "refused");
  p.steps = Steps::variable;
  both = run(pendulum(), p, {.mass = 1, .longest = 3e-3});
  const DriveOutcome& outcome = checked(Result<DriveOutcome>(both.drive));
  EXPECT_TRUE(outcome.findings.empty()) << to_string(outcome.findings.front());
  EXPECT_EQ(first(both.cloth), "");
  EXPECT_GT(outcome.report.refused, 1);
  EXPECT_GE(outcome.report.steps, 167);
  both = run(pendulum(), p, {.mass = 1, .longest = 1e-7});
  EXPECT_EQ(first(checked(Result<DriveOutcome>(both.drive)).findings), "step_too_short");
}

TEST(drive, both_have_to_mean_the_same) {
  const DriveParams p = free_swing(0.01);
  const auto codes_of = [](const Both& both) { return codes(both.drive) + " | " + first(both.cloth); };
  EXPECT_EQ(codes_of(run(pendulum(), p, {.duration = 1})), "other_duration | other_duration");
  EXPECT_EQ(codes_of(run(pendulum(), p, {}, {"another", {"rod"}, 0, {}})), "other_model | other_model");
  EXPECT_EQ(codes_of(run(pendulum(), p, {}, {"drawing", {"road"}, 0, {}})), "unknown_body | unknown_body");
  const Both coarse = run(pendulum(), p, {}, {"drawing", {"rod"}, 0.005, {}});
  EXPECT_EQ(first(checked(Result<DriveOutcome>(coarse.drive)).findings), "step_too_long");
  EXPECT_EQ(first(coarse.cloth), "step_too_long");
}

TEST(drive, a_table_says_where_bodies_are_in_a_prescribed_motion_only) {
  const auto table = [](const char* body) {
    return checked(dynamics::table_motion(fmt::format("time,body,x,y,z,qw,qx,qy,qz\n0,{0},0,0,0,1,0,0,0\n0.5,{0},0,0.1,0,1,0,0,0\n", body), "table.csv", 0));
  };
  DriveParams p;
  p.times = {0, 0.5};
  const auto lifted = table("rod"), other = table("road");
  EXPECT_TRUE(checked(run(pendulum(), p, {.mass = 1}, {"", {"rod"}, 0, {}}, lifted.get()).drive).findings.empty());
  const auto refused = [&](dynamics::SupportMotion& motion) { return codes(drive(pendulum(), "", p, checked(Channel::call({})), {}, &motion)); };
  EXPECT_EQ(refused(*other), "unknown_body");
  p.motor = Motor::servo;
  EXPECT_EQ(refused(*lifted), "bad_combination");
}

TEST(drive, virtual_work_is_the_power_per_rate) {
  const auto c = checked(mechanism::follow(pendulum(), {0.7}))[0];
  const auto s = states_of(c, 1);
  const std::vector<Wrench> w{{{0.3, -2, 1.5}, {0.4, 0.1, 0.2}}};
  double power = 0;
  for (std::size_t k = 0; k < 3; ++k) power += w[0].force[k] * s[0].velocity[k] + w[0].torque[k] * s[0].spin[k];
  EXPECT_NEAR(on_driver(c, w), power, 1e-12);
}
