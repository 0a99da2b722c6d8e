// Forces on the bodies of a linkage, and the torque at its driver that they amount to.
#pragma once

#include "toile/mechanism/frame.h"

#include <Eigen/Core>
#include <string_view>

namespace toile::mechanism {

/// On a body, in space: torque about the point where its pose has shifted the drawing's origin to.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< [N m]
};

/// By virtual work: power of the wrenches at unit rate of the driver [N m]. Positive turns the driver on.
/// wrenches  of the bodies, in the linkage's order
double driver_torque(const Configuration& configuration, const std::vector<Wrench>& wrenches);

struct WrenchRecord {
  std::vector<double> times;               ///< [s]
  std::vector<std::vector<Wrench>> rows;   ///< of the bodies, at each time; zero for bodies that the table does not have
};

/// From a table with columns time_s and BODY.force_x_N … BODY.torque_z_Nm.
/// error  "bad_record" where there is none of these, or a number is none
Result<WrenchRecord> read_wrenches(std::string_view csv, const std::string& file, const Linkage& linkage);

}  // namespace toile::mechanism
