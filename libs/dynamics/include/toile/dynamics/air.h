// What air does to cloth: drag and lift of each triangle by its velocity against the air. docs/simulation.md#motion
#pragma once

#include "toile/mesh/types.h"

#include <Eigen/Core>
#include <array>
#include <vector>

namespace toile::dynamics {

using mesh::Points3;

struct AirProperties {
  Eigen::Vector3d wind = Eigen::Vector3d::Zero();  ///< velocity of the air [m/s]
  double density = 1.2;  ///< [kg/m3]
  double drag = 0;       ///< coefficient of a triangle across the flow [1]
  double lift = 0;       ///< coefficient of a triangle at an angle to it [1]
};

/// Force on each node = drag * (wind - velocity) + lift: the first linear, so that a step can take it at its end.
struct AirForces {
  Eigen::VectorXd drag;  ///< [N s/m], >= 0, |nodes|
  Points3 lift;          ///< [N], |nodes| x 3
};

/// With u = wind - velocity of the triangle, n its normal on the side that u leaves by and s = n.u/|u| the sine of the angle of attack:
/// drag = 1/2 density A C_D s |u| u; lift = 1/2 density A C_L |u|^2 s (n - s u/|u|), across the flow. A third to each corner.
/// x, v  [m, m/s], |nodes| x 3, those that the coefficients are taken at
AirForces air_forces(const std::vector<std::array<int, 3>>& corners, const Points3& x, const Points3& v, const AirProperties& air);

}  // namespace toile::dynamics
