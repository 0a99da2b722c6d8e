#include "toile/coupling/drive.h"

#include <algorithm>
#include <cmath>

namespace toile::coupling {
namespace {

using mechanism::Configuration;
using mechanism::DriverState;
using mechanism::Reduced;

constexpr int steps_before_longer = 4;  // good ones in a row, after which variable steps grow
constexpr double growth = 1.5;

class Drive {
 public:
  Drive(const DriveParams& params, const DriveHooks& hooks, mechanism::Dynamics dynamics, mechanism::Walk walk) : params_(params), hooks_(hooks), dynamics_(std::move(dynamics)), walk_(std::move(walk)) {}

  Result<DriveOutcome> go(const mechanism::Linkage& linkage, const std::string& model, Channel channel) {
    state_ = {params_.angles.front(), params_.motor == Motor::torque ? 0 : mechanism::angle_motion(params_.times, params_.angles, params_.profile, params_.times.front()).rate};
    const auto first = walk_.to(state_.angle);
    if (!first) return first.issues();
    Hello hello;
    hello.program = "toile-drive";
    hello.bodies = linkage.bodies;
    for (const mechanism::Inertia& i : dynamics_.inertias()) hello.masses.push_back(i.mass);
    hello.model = model;
    hello.start = params_.times.front();
    hello.end = params_.times.back();
    hello.steps = params_.steps;
    hello.time_step = params_.time_step;
    hello.states = states_of(*first, state_.rate);
    channel.set_interrupted(hooks_.interrupted);
    auto master = Master::greet(std::move(channel), hello);
    if (!master) return master.issues();
    cloth_ = on_driver(*first, master->welcome().wrenches);
    outcome_.record = "time_s,angle_rad,rate_rad_s,motor_Nm,cloth_Nm,weight_Nm,inertia_kgm2,kinetic_J,motor_work_J,cloth_work_J,step_s,rounds\n";
    if (Issues issues = run(*master); !issues.empty()) {
      // What the other side said or did not say it knows; what went wrong here it is told.
      if (own_) master->fail(issues.front());
      append(outcome_.findings, issues);
    }
    outcome_.report.angle = state_.angle;
    outcome_.report.rate = state_.rate;
    return std::move(outcome_);
  }

 private:
  Issues own(Issues issues) {
    own_ = true;
    return issues;
  }

  double motor(double time, const DriverState& s) const {
    if (params_.motor == Motor::torque) return mechanism::angle_at(params_.times, params_.torques, mechanism::Profile::straight, time);
    const mechanism::AngleMotion wanted = mechanism::angle_motion(params_.times, params_.angles, params_.profile, time);
    const double torque = params_.stiffness * (wanted.angle - s.angle) + params_.damping * (wanted.rate - s.rate);
    const double most = params_.largest_torque.value_or(std::abs(torque));
    return std::clamp(torque, -most, most);
  }

  /// Where the driver is at the end of a step through which the cloth's torque is what it is at the end. (A torque that runs straight from the old one to the new one
  /// shakes itself up where the cloth is heavy beside the linkage: its motion asks the old torque more than the new one.)
  Result<DriverState> move(double from, double to, double cloth) {
    if (params_.motor == Motor::prescribed) {
      const mechanism::AngleMotion m = mechanism::angle_motion(params_.times, params_.angles, params_.profile, to);
      return DriverState{m.angle, m.rate};
    }
    const auto inertia = dynamics_.at(state_.angle);
    if (!inertia) return inertia.issues();
    // Far inside of what the integration can bear of a stiff servo.
    const bool servo = params_.motor == Motor::servo;
    const double damping = (params_.bearing + (servo ? params_.damping : 0)) / inertia->inertia, stiffness = servo ? params_.stiffness / inertia->inertia : 0;
    const double piece = std::max({1e-4 * (to - from), 1 / (2000 + 2 * damping + 4 * std::sqrt(stiffness))});
    return dynamics_.advance(state_, from, to, [&](double time, const DriverState& s) { return motor(time, s) - params_.bearing * s.rate + cloth; }, piece);
  }

  Issues run(Master& master) {
    const double start = params_.times.front(), end = params_.times.back();
    const bool fixed = params_.steps == Steps::fixed;
    const double longest = master.welcome().longest_step > 0 ? std::min(params_.time_step, master.welcome().longest_step) : params_.time_step;
    if (fixed && longest < params_.time_step * (1 - 1e-9)) {
      return own({Issue{"step_too_long", {.item = "time_step"}, fmt::format("the cloth takes steps of {:g} s at most, {:g} s are asked for", longest, params_.time_step), "give the same time_step to both, or `steps: variable`"}});
    }
    const auto count = std::max(1LL, static_cast<long long>(std::ceil((end - start) / params_.time_step - 1e-9)));
    double h = longest;
    int good = 0;
    row(start, 0, 0);
    for (long long k = 1; master.time() < end; ++k) {
      if (hooks_.interrupted && hooks_.interrupted()) return own({Issue{"interrupted", {}, fmt::format("stopped at {:g} s", master.time()), "start both programs again", Category::interrupted}});
      // Fixed steps: times as the cloth counts them. What is left at the end is not cut into crumbs.
      double to = fixed ? (k == count ? end : start + static_cast<double>(k) * params_.time_step) : master.time() + h;
      if (!fixed && end - to < 0.1 * h) to = end - master.time() > 1.0000001 * longest ? 0.5 * (master.time() + end) : end;
      const auto done = step(master, to);
      if (!done) return done.issues();
      if (*done > 0) {
        // It has to be shorter.
        if (fixed) {
          return own({Issue{"refused", {.item = "time_step"}, fmt::format("the cloth refused the step at {:g} s: {}", master.time(), why_), "give a shorter time_step, or `steps: variable`", Category::check}});
        }
        h = std::min(*done, 0.5 * (to - master.time()));
        good = 0;
        if (h < params_.least_step) {
          return own({Issue{"step_too_short", {.item = "least_step"}, fmt::format("at {:g} s even {:.3g} s is too long: {}", master.time(), 2 * h, why_), "see what holds the cloth there, or give a smaller least_step", Category::check}});
        }
        continue;
      }
      if (++good >= steps_before_longer && h < longest) {
        h = std::min(growth * h, longest);
        good = 0;
      }
      if (hooks_.progress) hooks_.progress((master.time() - start) / (end - start), fmt::format("t = {:.4f} s, {:.2f} deg", master.time(), state_.angle * 180 / M_PI));
    }
    return master.end();
  }

  /// One step, repeated until motion and reaction agree. 0: it holds; else the length to try next.
  Result<double> step(Master& master, double to) {
    const double from = master.time(), h = to - from;
    double cloth = cloth_, part = 1, last_residual = 0, last_cloth = 0;
    for (int round = 1;; ++round) {
      const auto next = move(from, to, cloth);
      if (!next) return own(next.issues());
      mechanism::Walk trial = walk_;
      const auto configuration = trial.to(next->angle);
      if (!configuration) return own(configuration.issues());
      const auto answer = master.step(to, states_of(*configuration, next->rate));
      if (!answer) return answer.issues();
      ++outcome_.report.rounds;
      if (const auto* refused = std::get_if<Refused>(&*answer)) {
        ++outcome_.report.refused;
        why_ = refused->why;
        return refused->longest > 0 ? refused->longest : 0.5 * h;
      }
      const double found = on_driver(*configuration, std::get<Reached>(*answer).wrenches);
      const auto inertia = dynamics_.at(next->angle);
      if (!inertia) return own(inertia.issues());
      const double residual = found - cloth;
      // Within the step the residual turns the driver by so much.
      const bool agreed = params_.motor == Motor::prescribed || params_.rounds == 1 || std::abs(residual) * h * h / (2 * inertia->inertia) <= params_.tolerance;
      if (!agreed && round < params_.rounds) {
        if (Issues issues = master.reject(); !issues.empty()) return issues;
        ++outcome_.report.rejected;
        // Secants from the second round on.
        if (round > 1 && residual != last_residual) part = std::clamp((cloth - last_cloth) / (last_residual - residual), 0.02, 2.0);
        last_residual = residual;
        last_cloth = cloth;
        cloth += part * residual;
        continue;
      }
      if (!agreed) {
        if (params_.steps == Steps::variable && 0.5 * h >= params_.least_step) {
          if (Issues issues = master.reject(); !issues.empty()) return issues;
          ++outcome_.report.rejected;
          why_ = fmt::format("motion and reaction do not agree within {} rounds", params_.rounds);
          return 0.5 * h;
        }
        ++outcome_.report.unconverged;
      }
      if (Issues issues = master.accept(); !issues.empty()) return issues;
      ++outcome_.report.steps;
      walk_ = std::move(trial);
      const DriverState before = state_;
      const double cloth_before = cloth_;
      state_ = *next;
      cloth_ = found;
      outcome_.report.cloth_work += 0.5 * (cloth_before + cloth_) * (state_.angle - before.angle);
      row(to, h, round);
      return 0.0;
    }
  }

  void row(double time, double h, int rounds) {
    const auto read = dynamics_.at(state_.angle);
    const Reduced r = read ? *read : Reduced{};
    double torque = 0;
    if (params_.motor == Motor::prescribed) {
      const mechanism::AngleMotion m = mechanism::angle_motion(params_.times, params_.angles, params_.profile, time);
      torque = r.inertia * m.acceleration + 0.5 * r.inertia_slope * m.rate * m.rate - r.weight - cloth_ + params_.bearing * m.rate;
    } else {
      torque = motor(time, state_);
    }
    if (h > 0) outcome_.report.motor_work += 0.5 * (last_torque_ + torque) * (state_.angle - last_angle_);
    last_torque_ = torque;
    last_angle_ = state_.angle;
    outcome_.report.motor_largest = std::max(outcome_.report.motor_largest, std::abs(torque));
    outcome_.report.cloth_largest = std::max(outcome_.report.cloth_largest, std::abs(cloth_));
    outcome_.record += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", time, state_.angle, state_.rate, torque, cloth_, r.weight, r.inertia, 0.5 * r.inertia * state_.rate * state_.rate,
                                   outcome_.report.motor_work, outcome_.report.cloth_work, h, rounds);
  }

  const DriveParams& params_;
  const DriveHooks& hooks_;
  mechanism::Dynamics dynamics_;
  mechanism::Walk walk_;   // at state_
  DriverState state_;
  double cloth_ = 0;       // torque of the cloth on the driver at state_
  double last_torque_ = 0, last_angle_ = 0;
  bool own_ = false;       // what went wrong is of this side
  std::string why_;
  DriveOutcome outcome_;
};

}  // namespace

std::vector<BodyState> states_of(const Configuration& configuration, double rate) {
  std::vector<BodyState> states;
  for (std::size_t b = 0; b < configuration.poses.size(); ++b) {
    const mechanism::RigidPose pose = mechanism::in_space(configuration.poses[b]);
    const mechanism::Pose& change = configuration.rates[b];
    // Forward to up is a turn about -x.
    states.push_back({pose.shift, pose.rotation, {0, rate * change.shift.y(), rate * change.shift.x()}, {-rate * change.angle, 0, 0}});
  }
  return states;
}

double on_driver(const Configuration& configuration, const std::vector<Wrench>& wrenches) {
  double torque = 0;
  for (std::size_t b = 0; b < wrenches.size(); ++b) {
    const mechanism::Pose& change = configuration.rates[b];
    torque += wrenches[b].force[1] * change.shift.y() + wrenches[b].force[2] * change.shift.x() - wrenches[b].torque[0] * change.angle;
  }
  return torque;
}

Result<DriveOutcome> drive(const mechanism::Linkage& linkage, const std::string& model, const DriveParams& params, Channel channel, const DriveHooks& hooks) {
  if (Issues issues = toile::validate(params); !issues.empty()) return issues;
  auto dynamics = mechanism::Dynamics::make(linkage, params.gravity);
  if (!dynamics) return dynamics.issues();
  auto walk = mechanism::Walk::begin(linkage);
  if (!walk) return walk.issues();
  return Drive(params, hooks, std::move(*dynamics), std::move(*walk)).go(linkage, model, std::move(channel));
}

}  // namespace toile::coupling
