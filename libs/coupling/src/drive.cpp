#include "toile/coupling/drive.h"

#include <algorithm>
#include <cmath>

namespace toile::coupling {
namespace {

using mechanism::Configuration;
using mechanism::DriverState;
using mechanism::Reduced;

class Drive {
 public:
  Drive(const DriveParams& params, const DriveHooks& hooks, mechanism::Dynamics dynamics, mechanism::Walk walk, dynamics::SupportMotion* table) : params_(params), hooks_(hooks), table_(table), dynamics_(std::move(dynamics)), walk_(std::move(walk)) {}

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
    if (table_) {
      Issues issues;
      for (const std::string& body : linkage.bodies) {
        const auto it = std::find(table_->bodies().begin(), table_->bodies().end(), body);
        if (it == table_->bodies().end()) issues.push_back(Issue{"unknown_body", {.item = "motion"}, fmt::format("the table has no body '{}'", body), "make it of the same linkage"});
        row_of_body_.push_back(static_cast<std::size_t>(it - table_->bodies().begin()));
      }
      if (!issues.empty()) return issues;
      const auto begins = table_->start(hello.end - hello.start);
      if (!begins) return begins.issues();
      hello.states = states_of(*begins);
    }
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
  /// Of the bodies of the linkage, in their order.
  std::vector<BodyState> states_of(const dynamics::SupportState& state) const {
    std::vector<BodyState> states;
    for (const std::size_t b : row_of_body_) {
      const dynamics::BodyPose& p = state.poses[b];
      const dynamics::BodyTwist& t = state.twists[b];
      states.push_back({{p.shift.x(), p.shift.y(), p.shift.z()}, {p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z()},
                        {t.linear.x(), t.linear.y(), t.linear.z()}, {t.angular.x(), t.angular.y(), t.angular.z()}});
    }
    return states;
  }
  std::vector<BodyState> states_of(const mechanism::Configuration& c, double rate) const { return coupling::states_of(c, rate); }

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
    // As the simulation goes on by itself: up to the next multiple of the time step, by half steps where one was refused, longer ones after two that were not.
    const double whole = fixed ? params_.time_step : longest;
    const auto count = std::max(1LL, static_cast<long long>(std::ceil((end - start) / whole - 1e-9)));
    double next = whole;
    int passed = 0;
    row(start, 0, 0);
    for (long long k = 1; master.time() < end;) {
      if (hooks_.interrupted && hooks_.interrupted()) return own({Issue{"interrupted", {}, fmt::format("stopped at {:g} s", master.time()), "start both programs again", Category::interrupted}});
      const double until = k == count ? end : start + static_cast<double>(k) * whole;
      const double rest = until - master.time();
      const bool to_end = fixed || next > 0.99 * rest;
      const double to = to_end ? until : master.time() + next;
      // The length as the simulation reckons it, so that a table is read at the same times to the last bit.
      const double length = to_end && rest < whole * (1 - 1e-9) ? rest : std::min(next, whole);
      const auto done = step(master, to, length);
      if (!done) return done.issues();
      if (*done > 0) {
        if (fixed) {
          return own({Issue{"refused", {.item = "time_step"}, fmt::format("the cloth refused the step at {:g} s: {}", master.time(), why_), "give a shorter time_step, or `steps: variable`", Category::check}});
        }
        const double tried = to - master.time();
        next = std::min(*done, 0.5 * length);
        passed = 0;
        if (next < params_.least_step) {
          return own({Issue{"step_too_short", {.item = "least_step"}, fmt::format("at {:g} s even {:.3g} s is too long: {}", master.time(), tried, why_), "see what holds the cloth there, or give a smaller least_step", Category::check}});
        }
        continue;
      }
      if (++passed >= 2) next = std::min(whole, 2 * next);
      if (to == until) ++k;
      if (hooks_.progress) hooks_.progress((master.time() - start) / (end - start), fmt::format("t = {:.4f} s, {:.2f} deg", master.time(), state_.angle * 180 / M_PI));
    }
    return master.end();
  }

  /// One step, repeated until motion and reaction agree. 0: it holds; else the length to try next.
  Result<double> step(Master& master, double to, double length) {
    const double from = master.time(), h = to - from;
    double cloth = cloth_, part = 1, last_residual = 0, last_cloth = 0;
    for (int round = 1;; ++round) {
      const auto next = move(from, to, cloth);
      if (!next) return own(next.issues());
      mechanism::Walk trial = walk_;
      const auto configuration = trial.to(next->angle);
      if (!configuration) return own(configuration.issues());
      std::vector<BodyState> states = states_of(*configuration, next->rate);
      if (table_) {
        const auto row = table_->advance(from - params_.times.front(), length);
        if (!row) return own(row.issues());
        states = states_of(*row);
      }
      const auto answer = master.step(to, states);
      if (!answer) return answer.issues();
      ++outcome_.report.rounds;
      if (const auto* refused = std::get_if<Refused>(&*answer)) {
        ++outcome_.report.refused;
        why_ = refused->why;
        return refused->longest > 0 ? refused->longest : 0.5 * length;
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
    outcome_.rows.push_back({time, state_.angle, torque, cloth_, r.weight});
    outcome_.record += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", time, state_.angle, state_.rate, torque, cloth_, r.weight, r.inertia, 0.5 * r.inertia * state_.rate * state_.rate,
                                   outcome_.report.motor_work, outcome_.report.cloth_work, h, rounds);
  }

  const DriveParams& params_;
  const DriveHooks& hooks_;
  dynamics::SupportMotion* table_;
  std::vector<std::size_t> row_of_body_;
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

Result<DriveOutcome> drive(const mechanism::Linkage& linkage, const std::string& model, const DriveParams& params, Channel channel, const DriveHooks& hooks, dynamics::SupportMotion* table) {
  if (Issues issues = toile::validate(params); !issues.empty()) return issues;
  auto dynamics = mechanism::Dynamics::make(linkage, params.gravity);
  if (!dynamics) return dynamics.issues();
  auto walk = mechanism::Walk::begin(linkage);
  if (!walk) return walk.issues();
  if (table && params.motor != Motor::prescribed) return Issue{"bad_combination", {.item = "motion"}, "a table prescribes the motion", "write `motor: prescribed`, or leave the input `motion` out", Category::usage};
  return Drive(params, hooks, std::move(*dynamics), std::move(*walk), table).go(linkage, model, std::move(channel));
}

}  // namespace toile::coupling
