// Constraints by forces: the forces that make a particle system obey geometric conditions, from one linear system a step.
// Source: docs/bibliography.md#barzel1988; docs/simulation.md#explicit-integration has the formulas.
#pragma once

#include "toile/mesh/types.h"

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

namespace toile::dynamics {

using mesh::Points3;

/// Position, velocity and acceleration that a node has to follow.
struct PathState {
  Eigen::Vector3d position;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

struct FixedPosition {
  int node = 0;
  Eigen::Vector3d position;  ///< [m]
};

struct Trajectory {
  int node = 0;
  std::function<PathState(double time)> path;
};

struct FixedDistance {
  int a = 0, b = 0;
  double distance = 0;  ///< [m], > 0
};

/// d = sum_k weight_k normal.x_k - offset must not become negative: pushes, never pulls. Entries with node -1 are not used.
struct Unilateral {
  std::array<int, 4> node{-1, -1, -1, -1};
  std::array<double, 4> weight{};
  Eigen::Vector3d normal;  ///< unit
  double offset = 0;       ///< [m]
  double friction = 0;     ///< Coulomb coefficient [1]
  double offset_rate = 0;  ///< of a surface that moves [m/s]
  Eigen::Vector3d surface_velocity = Eigen::Vector3d::Zero();  ///< its part of the sliding: against its own velocity [m/s]
};

struct ConstraintSet {
  std::vector<FixedPosition> positions;
  std::vector<Trajectory> trajectories;
  std::vector<FixedDistance> distances;
  std::vector<Unilateral> contacts;
};

struct ConstraintOptions {
  double time_step = 1e-4;       ///< of the integration that the forces are for [s]
  double time_constant = 4e-4;   ///< tau, in which a violation decays; at least twice the step [s]
  double contact_time_constant = 4e-4;  ///< the same of contacts: a longer one catches softly [s]
  double tolerance = 1e-12;      ///< of the linear system, relative [1]
  int max_iterations = 1000;
  int contact_sweeps = 1000;     ///< over all conditions, where there are contacts
};

struct ConstraintReport {
  double largest_violation = 0;  ///< of positions, trajectories and distances at the step's beginning [m]
  double deepest_contact = 0;    ///< -d of contacts there [m]
  int active_contacts = 0;
  int iterations = 0;            ///< of conjugate gradients
  bool solved = true;
};

/// Keeps scratch memory and multipliers between steps; nothing is allocated once sizes have settled.
class DynamicConstraints {
 public:
  /// Adds to `force` [N] what makes each condition C obey C'' + 2 C'/tau + C/tau^2 = 0; a contact only where it has to push.
  /// x, v [m, m/s] are those of the step's beginning, `force` holds all other forces there.
  ConstraintReport add_forces(const ConstraintSet& set, const Points3& x, const Points3& v, const Eigen::VectorXd& mass, double time, const ConstraintOptions& options,
                              Points3& force);

  /// Force with which the i-th position (trajectories follow positions) was held in the last step [N].
  Eigen::Vector3d holding_force(std::size_t i) const;
  /// Force along the i-th distance, positive: pushes the two apart [N].
  double distance_force(std::size_t i) const;
  /// Normal force of the i-th contact [N].
  double contact_force(std::size_t i) const;
  /// Friction of the i-th contact: its weights times it act on its nodes [N].
  Eigen::Vector3d friction_force(std::size_t i) const { return friction_[i]; }

 private:
  struct Row {
    std::array<int, 4> node{-1, -1, -1, -1};
    std::array<Eigen::Vector3d, 4> gradient;
    double target = 0;  ///< required second derivative of C, less what does not depend on accelerations
    double free = 0;    ///< the same without constraint forces
  };
  void apply(const std::vector<double>& in, std::vector<double>& out);
  bool solve(const ConstraintOptions& options, int& iterations);

  std::vector<Row> rows_;
  std::vector<char> active_;
  std::vector<double> lambda_, contact_lambda_, rhs_, r_, z_, p_, q_, diagonal_;
  std::vector<Eigen::Vector3d> friction_;
  std::vector<int> touched_, contact_count_;  ///< nodes of the rows; active contacts of each node
  std::vector<char> is_touched_;
  Points3 push_;                              ///< J^T lambda, zero outside of touched_
  Eigen::VectorXd inverse_mass_;
  std::size_t held_ = 0, first_distance_ = 0, first_contact_ = 0;
};

}  // namespace toile::dynamics
