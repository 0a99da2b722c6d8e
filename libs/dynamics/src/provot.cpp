#include "toile/dynamics/provot.h"

#include <algorithm>

#include "toile/base/parallel.h"
#include "toile/base/result.h"

namespace toile::dynamics {
namespace {

constexpr std::size_t grain = 4096;

}  // namespace

Provot::Provot(ProvotSystem system, ProvotState state, const ProvotOptions& options) : system_(std::move(system)), state_(std::move(state)), options_(options) {
  set_time_step(options_.time_step);
  TOILE_CHECK(system_.mass.size() == state_.x.rows() && state_.x.rows() == state_.v.rows(), "{} masses, {} positions, {} velocities", system_.mass.size(), state_.x.rows(), state_.v.rows());
  TOILE_CHECK(system_.drag.size() == 0 || system_.drag.size() == system_.mass.size(), "{} drags", system_.drag.size());
  TOILE_CHECK(system_.mass.size() == 0 || system_.mass.minCoeff() > 0, "a node without mass");
  force_.resize(state_.x.rows(), 3);
  end_.resize(state_.x.rows(), 3);
}

ConstraintReport Provot::step() {
  const double dt = options_.time_step;
  system_.gradient(state_.x, force_);
  force_ = -force_;
  const ConstraintReport report = constraints_.add_forces(system_.constraints, state_.x, state_.v, system_.mass, state_.time, options_.constraints, force_);
  parallel_for(static_cast<std::size_t>(state_.x.rows()), grain, [&](std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double mass = system_.mass[row], rate = options_.damping + (system_.drag.size() > 0 ? system_.drag[row] / mass : 0);
    state_.v.row(row) = (state_.v.row(row) + dt / mass * force_.row(row)) / (1 + dt * rate);
    end_.row(row) = state_.x.row(row) + dt * state_.v.row(row);
  });
  if (system_.collisions) system_.collisions(state_.x, end_, state_.v);
  state_.x.swap(end_);
  state_.time += dt;
  return report;
}

void Provot::set_time_step(double step) {
  options_.time_step = options_.constraints.time_step = step;
  options_.constraints.time_constant = std::max(options_.constraints.time_constant, 4 * step);
  options_.constraints.contact_time_constant = std::max(options_.constraints.contact_time_constant, 4 * step);
}

double Provot::kinetic_energy() const {
  return 0.5 * state_.v.cwiseProduct(system_.mass.asDiagonal() * state_.v).sum();
}

}  // namespace toile::dynamics
