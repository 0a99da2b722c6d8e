// The support flattened from front to back: z is drawn towards a middle plane, on the trunk fully, on the arms not at all.
#pragma once

#include <Eigen/Core>

namespace toile::placement {

struct Flattening {
  double depth = 1;     ///< of the trunk over its true depth, in (0, 1]
  double z_middle = 0;  ///< the plane that points are drawn to [m]
  double x_mid = 0;     ///< plane of symmetry [m]
  double x_trunk = 1e9; ///< |x - x_mid| up to which the full flattening holds [m]
  double x_arm = 2e9;   ///< and beyond which there is none [m]

  /// Depth factor at a distance to the side, and its derivative by x.
  double factor(double x) const {
    const double t = transition(x);
    return depth + (1 - depth) * t * t * (3 - 2 * t);
  }
  double slope(double x) const {
    const double t = transition(x);
    return (x > x_mid ? 1 : -1) * (1 - depth) * 6 * t * (1 - t) / (x_arm - x_trunk);
  }
  Eigen::Vector3d flattened(const Eigen::Vector3d& p) const { return {p.x(), p.y(), z_middle + factor(p.x()) * (p.z() - z_middle)}; }
  Eigen::Vector3d restored(const Eigen::Vector3d& p) const { return {p.x(), p.y(), z_middle + (p.z() - z_middle) / factor(p.x())}; }
  /// Unit normal, in the flattened world, of a surface with normal n through the point p of the true world.
  Eigen::Vector3d flattened_normal(const Eigen::Vector3d& n, const Eigen::Vector3d& p) const {
    const double f = factor(p.x());
    return Eigen::Vector3d(n.x() - slope(p.x()) * (p.z() - z_middle) / f * n.z(), n.y(), n.z() / f).normalized();
  }

 private:
  double transition(double x) const {
    const double side = x > x_mid ? x - x_mid : x_mid - x;
    return side <= x_trunk ? 0 : side >= x_arm ? 1 : (side - x_trunk) / (x_arm - x_trunk);
  }
};

}  // namespace toile::placement
