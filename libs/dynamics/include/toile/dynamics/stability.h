// Is an equilibrium stable, and how much is missing: the smallest eigenvalue of stiffness against mass.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <Eigen/Core>
#include <functional>

namespace toile::dynamics {

struct StiffnessProblem {
  using Apply = std::function<void(const mesh::Points3& in, mesh::Points3& out)>;
  Apply stiffness;       ///< second derivative of the energy times a motion; symmetric, may be indefinite; nothing where nodes are held
  Apply precondition;    ///< about the inverse of a positive matrix that is like it; nothing where nodes are held
  Eigen::VectorXd mass;  ///< [kg], |nodes|, positive
};

struct LowestStiffness {
  double value = 0;    ///< [1/s2]: the square of the lowest angular frequency; negative: the equilibrium is unstable
  mesh::Points3 mode;  ///< sum of mass |mode|^2 = 1
  int iterations = 0;
  bool converged = false;
};

/// The smallest value with stiffness mode = value mass mode, by locally optimal preconditioned conjugate gradients on one vector
/// (docs/bibliography.md#knyazev2001), until two
/// iterations in a row lower it by less than `tolerance` of itself or of a hundredth of the start's.
LowestStiffness lowest_stiffness(const StiffnessProblem& problem, double tolerance = 1e-6, int max_iterations = 300);

}  // namespace toile::dynamics
