// Cloth on a linkage that another thread solves: the same as off-line, steps that are taken back leave no trace, and the motor feels the weight.
#include "cloth_fixtures.h"
#include "results.h"
#include "tables.h"
#include "toile/coupling/coupled_motion.h"
#include "toile/coupling/drive.h"
#include "toile/dynamics/simulate.h"

#include <gtest/gtest.h>

#include <thread>

using namespace toile;
using namespace toile::coupling;
using dynamics::SimulationOutcome;
using dynamics::SimulationParams;
using Eigen::Vector3d;
using mesh::GarmentMesh;
using test::checked;

namespace {

constexpr double lever = 0.3;

/// An arm forward from a pivot at the origin.
mechanism::Linkage arm() {
  mechanism::Linkage l;
  l.bodies = {"arm"};
  l.driver = "arm";
  l.pivots = {{{"ground", "arm"}, {0, 0}}};
  l.bars = {{.body = "arm", .points = {{0, 0}, {lever, 0}}, .half_width = 0.5, .thickness = 0.01, .height = 0.02}};
  return l;
}

/// A strip that hangs from the end of the arm.
GarmentMesh strip() {
  return fixtures::sheet(2, 5, 0.04, 0.1, fixtures::shirting(), [](double u, double v) { return Vector3d(u, v - 0.1, lever); });
}

/// A cloth that lies on a plate which is a part of the arm; its left edge is held.
GarmentMesh sheet_on_plate() {
  return fixtures::sheet(6, 6, 0.06, 0.06, fixtures::shirting(), [](double u, double v) { return Vector3d(u, 0.002, lever - v); });
}
mesh::SupportMesh plate() {
  mesh::SupportMesh s;
  s.x.resize(8, 3);
  for (int k = 0; k < 8; ++k) s.x.row(k) << (k & 1 ? 0.1 : -0.02), (k & 2 ? 0.0 : -0.02), (k & 4 ? lever + 0.02 : lever - 0.04);
  s.faces.resize(12, 3);
  s.faces << 2, 6, 7, 2, 7, 3, 0, 1, 5, 0, 5, 4, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5;
  s.face_region = mesh::Ids::Zero(12);
  s.region_names = {"arm"};
  return s;
}

SimulationParams held(const std::string& edge, double duration, double step) {
  SimulationParams params;
  params.mode = dynamics::Mode::motion;
  params.duration = duration;
  params.time_step = step;
  dynamics::ConstraintSpec c;
  c.name = "hold";
  c.on = {edge};
  c.kind = dynamics::Hold::drive;
  c.body = "arm";
  params.constraints = {c};
  return params;
}

DriveParams swing(double duration, double step, double angle) {
  DriveParams p;
  p.times = {0, duration};
  p.angles = {0, angle};
  p.time_step = step;
  return p;
}

using MasterSide = std::function<void(Channel)>;

Result<SimulationOutcome> coupled(const GarmentMesh& garment, const std::optional<mesh::SupportMesh>& support, const SimulationParams& params, const MasterSide& master) {
  ChannelOptions options;
  options.endpoint = "tcp://127.0.0.1:*";
  Channel listening = checked(Channel::listen(options));
  options.endpoint = listening.endpoint();
  std::thread thread([&] { master(checked(Channel::call(options))); });
  auto result = [&]() -> Result<SimulationOutcome> {
    auto motion = coupled_motion(std::move(listening), {"", {"arm"}, params.time_step, {}});
    if (!motion) return motion.issues();
    dynamics::SimulationHooks hooks;
    hooks.supports = motion->get();
    return dynamics::simulate(garment, support, params, hooks);
  }();
  thread.join();
  return result;
}

/// A master that follows the same motion, and tries each step so many times, another way first.
MasterSide hesitating(const DriveParams& p, int times) {
  return [&p, times](Channel channel) {
    // Each from the drawn position: the same bits on every trial.
    const auto states = [&](double time, double aside) {
      const mechanism::AngleMotion m = mechanism::angle_motion(p.times, p.angles, p.profile, time);
      return states_of(checked(mechanism::follow(arm(), {m.angle + aside}))[0], m.rate);
    };
    Hello hello;
    hello.program = "test";
    hello.bodies = {"arm"};
    hello.start = p.times.front();
    hello.end = p.times.back();
    hello.time_step = p.time_step;
    hello.states = states(0, 0);
    Master master = checked(Master::greet(std::move(channel), hello));
    const int steps = static_cast<int>(std::lround((hello.end - hello.start) / p.time_step));
    for (int i = 1; i <= steps; ++i) {
      const double to = i == steps ? hello.end : i * p.time_step;
      for (int k = 0; k < times; ++k) {
        EXPECT_TRUE(std::holds_alternative<Reached>(checked(master.step(k % 2 ? to : 0.5 * (to + master.time()), states(to, k % 2 ? 0.02 : -0.01)))));
        EXPECT_TRUE(ok(master.reject()));
      }
      EXPECT_TRUE(std::holds_alternative<Reached>(checked(master.step(to, states(to, 0)))));
      EXPECT_TRUE(ok(master.accept()));
    }
    EXPECT_TRUE(ok(master.end()));
  };
}

double largest_difference(const GarmentMesh& a, const GarmentMesh& b) { return (a.x - b.x).cwiseAbs().maxCoeff(); }

}  // namespace

TEST(coupled_simulation, the_same_motion_gives_the_same_cloth_as_off_line) {
  const double duration = 0.2, step = 0.01;
  const SimulationParams params = held("sheet.top", duration, step);
  const DriveParams p = swing(duration, step, 0.8);
  std::string table = "time,body,x,y,z,qw,qx,qy,qz\n";
  for (int i = 0; i <= 20; ++i) {
    const double time = i == 20 ? duration : i * step;
    const auto pose = mechanism::in_space(checked(mechanism::follow(arm(), {mechanism::angle_at(p.times, p.angles, p.profile, time)}))[0].poses[0]);
    table += fmt::format("{},arm,{},{},{},{},{},{},{}\n", time, pose.shift[0], pose.shift[1], pose.shift[2], pose.rotation[0], pose.rotation[1], pose.rotation[2], pose.rotation[3]);
  }
  const auto from_table = checked(dynamics::table_motion(table, "table.csv", 0));
  dynamics::SimulationHooks hooks;
  hooks.supports = from_table.get();
  const SimulationOutcome offline = checked(dynamics::simulate(strip(), std::nullopt, params, hooks));
  Result<DriveOutcome> driven{Issue{}};
  const SimulationOutcome online = checked(coupled(strip(), std::nullopt, params, [&](Channel channel) { driven = drive(arm(), "", p, std::move(channel)); }));
  EXPECT_LT(largest_difference(offline.garment, online.garment), 1e-9);
  EXPECT_GT((online.garment.x - strip().x).cwiseAbs().maxCoeff(), 0.1);
  // What the cloth did to the arm, told to the master and written by the simulation: the torque on the driver is about -x, and the arm turns about the origin.
  const auto told = test::column(checked(std::move(driven)).record, "cloth_Nm"), written = test::column(offline.record, "arm.torque_x_Nm");
  ASSERT_EQ(told.size(), written.size() + 1);
  for (std::size_t i = 0; i < written.size(); ++i) EXPECT_NEAR(told[i + 1], -written[i], 1e-9);
}

TEST(coupled_simulation, a_step_that_is_taken_back_leaves_no_trace) {
  const double duration = 0.08, step = 0.01;
  const DriveParams p = swing(duration, step, 0.3);
  for (const auto integrator : {dynamics::Integrator::bdf2, dynamics::Integrator::implicit}) {
    SimulationParams params = held("sheet.left", duration, step);
    params.integrator = integrator;
    const SimulationOutcome straight = checked(coupled(sheet_on_plate(), plate(), params, hesitating(p, 0)));
    const SimulationOutcome hesitated = checked(coupled(sheet_on_plate(), plate(), params, hesitating(p, 3)));
    EXPECT_EQ(straight.report.rejected_steps, 0);
    EXPECT_EQ(hesitated.report.rejected_steps, 24);
    EXPECT_GT(test::column(straight.record, "contact_J")[4], 0);
    EXPECT_EQ(largest_difference(straight.garment, hesitated.garment), 0);
    EXPECT_EQ(straight.record, hesitated.record);
    for (const char* name : {"vx", "vy", "vz"}) EXPECT_EQ(straight.garment.vertex_columns.at(name).reals, hesitated.garment.vertex_columns.at(name).reals);
  }
}

TEST(coupled_simulation, the_motor_holds_the_weight_at_its_lever) {
  SimulationParams params = held("sheet.top", 4, 0.1);
  params.integrator = dynamics::Integrator::implicit;
  params.newton_accuracy = 1e-10;
  DriveParams p = swing(4, 0.1, 0);
  Result<DriveOutcome> driven{Issue{}};
  (void)checked(coupled(strip(), std::nullopt, params, [&](Channel channel) { driven = drive(arm(), "", p, std::move(channel)); }));
  const DriveOutcome outcome = checked(std::move(driven));
  const double cloth = fixtures::shirting().areal_density * 0.04 * 0.1 * 9.81 * lever, rod = 2 * 2700 * lever * 0.01 * 0.02 * 9.81 * lever / 2;
  EXPECT_NEAR(test::column(outcome.record, "cloth_Nm").back(), -cloth, 1e-4 * cloth);
  EXPECT_NEAR(test::column(outcome.record, "motor_Nm").back(), cloth + rod, 1e-4 * cloth + 1e-6 * rod);
}

TEST(coupled_simulation, a_motor_and_cloth_find_the_same_motion_in_rounds) {
  // The arm falls by its weight and that of the strip; steps that the rounds reject, and shorter ones, end where small fixed steps do.
  DriveParams p = swing(0.1, 0.01, 0);
  p.motor = Motor::torque;
  p.torques = {0, 0};
  const SimulationParams params = held("sheet.top", 0.1, 0.01);
  Result<DriveOutcome> driven{Issue{}};
  (void)checked(coupled(strip(), std::nullopt, params, [&](Channel channel) { driven = drive(arm(), "", p, std::move(channel)); }));
  const DriveOutcome outcome = checked(std::move(driven));
  EXPECT_TRUE(outcome.findings.empty());
  EXPECT_EQ(outcome.report.unconverged, 0);
  EXPECT_EQ(outcome.report.steps, 10);
  // Free fall of a rod about its end: q'' = 3 g / 2 L at the start, the strip's part is small.
  EXPECT_NEAR(outcome.report.angle, -0.75 * 9.81 / lever * 0.01, 0.02);
}

TEST(coupled_simulation, the_master_hears_why_the_simulation_ends) {
  SimulationParams params = held("sheet.top", 0.1, 0.01);
  params.constraints[0].body = "leg";
  const DriveParams p = swing(0.1, 0.01, 0.5);
  Result<DriveOutcome> driven{Issue{}};
  const auto result = coupled(strip(), std::nullopt, params, [&](Channel channel) { driven = drive(arm(), "", p, std::move(channel)); });
  EXPECT_FALSE(result);
  ASSERT_FALSE(driven.has_value() && checked(driven).findings.empty());
}
