#include "toile/dynamics/air.h"

#include <Eigen/Geometry>

namespace toile::dynamics {

AirForces air_forces(const std::vector<std::array<int, 3>>& corners, const Points3& x, const Points3& v, const AirProperties& air) {
  AirForces result{Eigen::VectorXd::Zero(x.rows()), Points3::Zero(x.rows(), 3)};
  for (const auto& corner : corners) {
    const Eigen::Vector3d a = x.row(corner[0]).transpose(), b = x.row(corner[1]).transpose(), c = x.row(corner[2]).transpose();
    const Eigen::Vector3d flow = air.wind - (v.row(corner[0]) + v.row(corner[1]) + v.row(corner[2])).transpose() / 3;
    Eigen::Vector3d normal = 0.5 * (b - a).cross(c - a);
    const double area = normal.norm(), speed = flow.norm();
    if (!(area > 0) || !(speed > 0)) continue;
    normal *= (normal.dot(flow) < 0 ? -1 : 1) / area;
    const Eigen::Vector3d along = flow / speed;
    const double attack = normal.dot(along), pressure = 0.5 * air.density * speed;  // times speed: a pressure
    const double drag = air.drag * pressure * area * attack / 3;
    const Eigen::Vector3d lift = air.lift * pressure * speed * area * attack / 3 * (normal - attack * along);
    for (int node : corner) {
      result.drag[node] += drag;
      result.lift.row(node) += lift.transpose();
    }
  }
  return result;
}

}  // namespace toile::dynamics
