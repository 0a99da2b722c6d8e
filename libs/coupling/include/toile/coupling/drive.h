// The mechanism's side: a motor turns a linkage that cloth hangs on. docs/coupling.md#a-mechanism-with-a-motor.
#pragma once

#include "toile/coupling/session.h"
#include "toile/dynamics/support_motion.h"
#include "toile/mechanism/inertia.h"

#include <functional>

namespace toile::coupling {

enum class Motor {
  prescribed,  ///< turns the driver as the table of angles says, whatever it takes
  servo,       ///< pulls it towards the table of angles
  torque,      ///< has the torque of a table
};

struct DriveParams {
  Motor motor = Motor::prescribed;
  std::vector<double> times{0, 1};
  std::vector<double> angles{0, 0};
  mechanism::Profile profile = mechanism::Profile::smooth;
  double stiffness = 2000;
  double damping = 200;
  std::optional<double> largest_torque;
  std::vector<double> torques;
  double bearing = 0;
  double gravity = 9.81;
  Steps steps = Steps::fixed;
  double time_step = 0.01;
  double least_step = 1e-5;
  int rounds = 8;
  double tolerance = 1e-7;
  ChannelOptions couple;
  std::string plot;
  static void describe(auto& f) {
    f(&DriveParams::motor, {.key = "motor", .doc = "prescribed: the driver is where `angles` say, and the torque for it is found; servo: the motor pulls towards them; torque: it has the torque of `torques`"});
    f(&DriveParams::times, {.key = "times", .doc = "times of the rows of `angles` and `torques`, increasing; the first is the beginning, the last the end", .unit = "s"});
    f(&DriveParams::angles, {.key = "angles", .doc = "angle of the driver from the drawn position at each of these times; motor torque: the first one is where it begins", .unit = "rad"});
    f(&DriveParams::profile, {.key = "profile", .doc = "angles between rows: straight, or smooth (3u^2 - 2u^3, at rest at each row)"});
    f(&DriveParams::stiffness, {.key = "stiffness", .doc = "servo: torque per angle that it is behind", .unit = "N*m/rad", .min = 0, .max = 1e9});
    f(&DriveParams::damping, {.key = "damping", .doc = "servo: torque per angular velocity that it is behind", .unit = "N*m*s/rad", .min = 0, .max = 1e9});
    f(&DriveParams::largest_torque, {.key = "largest_torque", .doc = "servo: what the motor has at most, either way; not given: no limit", .unit = "N*m", .min = 0, .max = 1e9});
    f(&DriveParams::torques, {.key = "torques", .doc = "motor torque: at each of the times, straight in between", .unit = "N*m"});
    f(&DriveParams::bearing, {.key = "bearing", .doc = "torque per angular velocity that the bearings take", .unit = "N*m*s/rad", .min = 0, .max = 1e6});
    f(&DriveParams::gravity, {.key = "gravity", .doc = "acceleration of gravity, downwards", .unit = "m/s2", .min = 0, .max = 100});
    f(&DriveParams::steps, {.key = "steps", .doc = "fixed: all are `time_step`, and a refused one ends the run; variable: shorter ones where the cloth refuses or the rounds do not agree, up to `time_step` again afterwards"});
    f(&DriveParams::time_step, {.key = "time_step", .doc = "step that is proposed to the cloth", .unit = "s", .min = 1e-6, .max = 10});
    f(&DriveParams::least_step, {.key = "least_step", .doc = "variable steps: where it gives up", .unit = "s", .min = 1e-9, .max = 10});
    f(&DriveParams::rounds, {.key = "rounds", .doc = "motors servo and torque: how often a step is repeated at most, until motion and reaction agree; 1: the reaction of the step before is taken", .min = 1, .max = 100});
    f(&DriveParams::tolerance, {.key = "tolerance", .doc = "they agree when the reaction would turn the driver no farther than this within the step", .unit = "rad", .min = 1e-15, .max = 1});
    f(&DriveParams::couple, {.key = "couple", .doc = "where the cloth is"});
    f(&DriveParams::plot, {.key = "plot", .doc = "PNG of the torques of motor, cloth and weight against the angle; empty: none", .local = true});
    f.check([](const DriveParams& p, Issues& issues) {
      const auto bad = [&](const char* item, std::string what, const char* remedy) { issues.push_back(Issue{"bad_range", {.item = item}, std::move(what), remedy}); };
      if (p.times.size() < 2) bad("times", "the motion needs a beginning and an end", "give two times at least");
      for (std::size_t i = 1; i < p.times.size(); ++i) {
        if (p.times[i] > p.times[i - 1]) continue;
        bad("times", "the times do not increase", "put them in order");
        break;
      }
      if (p.angles.empty() || (p.motor != Motor::torque && p.angles.size() != p.times.size())) bad("angles", fmt::format("there are {} times and {} angles", p.times.size(), p.angles.size()), "give one angle for each time");
      if (p.motor == Motor::torque && p.torques.size() != p.times.size()) bad("torques", fmt::format("there are {} times and {} torques", p.times.size(), p.torques.size()), "give one torque for each time");
    });
  }
};

struct DriveReport {
  int steps = 0, rounds = 0, rejected = 0, refused = 0, unconverged = 0;
  double angle = 0, rate = 0;                     ///< at the end [rad, rad/s]
  double motor_largest = 0, cloth_largest = 0;    ///< torques on the driver, by size [N m]
  double motor_work = 0, cloth_work = 0;          ///< that motor and cloth did on the linkage [J]
};

/// At the end of a step that holds; torques on the driver.
struct DriveRow {
  double time = 0, angle = 0;               ///< [s, rad]
  double motor = 0, cloth = 0, weight = 0;  ///< [N m]
};

struct DriveOutcome {
  std::vector<DriveRow> rows;
  std::string record;  ///< CSV: time_s,angle_rad,rate_rad_s,motor_Nm,cloth_Nm,weight_Nm,inertia_kgm2,kinetic_J,motor_work_J,cloth_work_J,step_s,rounds
  DriveReport report;
  Issues findings;     ///< what ended it before its time
};

struct DriveHooks {
  std::function<void(double fraction, const std::string& text)> progress;
  std::function<bool()> interrupted;
};

/// States of the bodies for the other side, at an angular velocity of the driver.
std::vector<BodyState> states_of(const mechanism::Configuration& configuration, double rate);
/// Torque of wrenches on the driver, by virtual work [N m].
double on_driver(const mechanism::Configuration& configuration, const std::vector<Wrench>& wrenches);

/// Moves the linkage from the first of the times to the last, with the cloth at the other end of the channel.
/// model  content hash of the linkage's file, for the other side to compare; may be empty
/// table  motor prescribed: where the bodies are, instead of the linkage's own solution: to the last bit what a simulation off-line takes from it. The angles still
///        say where the driver is, for torques. Null: none. Precondition: its time 0 is the first of the times
/// error  what Dynamics::make and Master::greet report; "unknown_body" where the table does not have a body of the linkage, or another
Result<DriveOutcome> drive(const mechanism::Linkage& linkage, const std::string& model, const DriveParams& params, Channel channel, const DriveHooks& hooks = {}, dynamics::SupportMotion* table = nullptr);

}  // namespace toile::coupling

template <>
struct toile::Choices<toile::coupling::Motor> {
  using E = toile::coupling::Motor;
  static constexpr std::array names{std::pair{"prescribed", E::prescribed}, std::pair{"servo", E::servo}, std::pair{"torque", E::torque}};
};
template <>
struct toile::Choices<toile::coupling::Steps> {
  using E = toile::coupling::Steps;
  static constexpr std::array names{std::pair{"fixed", E::fixed}, std::pair{"variable", E::variable}};
};
