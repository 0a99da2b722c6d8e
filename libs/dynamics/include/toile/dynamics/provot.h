// Explicit integration as published: Euler in two steps, velocities first, then positions, with collisions looked at between.
// docs/simulation.md#explicit-integration.
#pragma once

#include "toile/dynamics/dynamic_constraints.h"

#include <functional>
#include <vector>

namespace toile::dynamics {

struct ProvotOptions {
  double time_step = 1e-4;  ///< [s]; must stay below 2 over the highest frequency
  double damping = 0;       ///< force against velocity per mass [1/s]
  ConstraintOptions constraints = {};  ///< time_step is filled in
};

struct ProvotState {
  Points3 x, v;     ///< [m], [m/s], |nodes| x 3
  double time = 0;  ///< [s]
};

/// What a step needs of its surroundings.
struct ProvotSystem {
  Eigen::VectorXd mass;  ///< [kg], > 0
  Eigen::VectorXd drag;  ///< force against velocity [N s/m], >= 0; empty: none
  /// Gradient of all potentials at x [N], into its second argument.
  std::function<void(const Points3& x, Points3& gradient)> gradient;
  /// Between the two steps: may change end positions, and the velocities that lead to them. May be empty.
  std::function<void(const Points3& start, Points3& end, Points3& velocity)> collisions;
  ConstraintSet constraints;
};

/// Nothing is allocated from the second step on, but by the callbacks.
class Provot {
 public:
  Provot(ProvotSystem system, ProvotState state, const ProvotOptions& options);

  /// v += dt a, with dynamic constraints among the forces and damping taken at the end of the step; then collisions; then
  /// x += dt v.
  ConstraintReport step();

  ProvotState& state() { return state_; }
  const ProvotState& state() const { return state_; }
  double time_step() const { return options_.time_step; }
  void set_time_step(double step);
  ProvotSystem& system() { return system_; }
  const DynamicConstraints& constraints() const { return constraints_; }
  /// Sum of all forces but damping, at the beginning of the last step [N].
  const Points3& force() const { return force_; }
  double kinetic_energy() const;  ///< [J]

 private:
  ProvotSystem system_;
  ProvotState state_;
  ProvotOptions options_;
  DynamicConstraints constraints_;
  Points3 force_, end_;
};

}  // namespace toile::dynamics
