// Where a moving support is: a source of poses that is asked step by step, and told what the cloth does to the bodies.
// Behind it stands a table, a sequence of shapes, or whatever else can say where bodies go. docs/simulation.md#moving-supports.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/types.h"

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace toile::dynamics {

using mesh::Points3;

/// A point p of the support file (or of the start, for cloth held to a body) is at rotation p + shift.
struct BodyPose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const { return rotation * p + shift; }
};

/// Velocity of a body: a point x of it moves with linear + angular x (x - shift).
struct BodyTwist {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< of the point at `shift` [m/s]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// What the cloth does to a body: contact, friction and held points.
struct BodyWrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< about the point at `shift` of the same time [N m]
};

struct SupportState {
  double time = 0;                ///< [s] since the simulation's beginning
  std::vector<BodyPose> poses;    ///< of bodies(), in their order
  std::vector<BodyTwist> twists;  ///< as many
  Points3 shape;                  ///< positions of all vertices of a support that deforms; no rows: it is rigid [m]
};

/// Calls come in this order: start; then for each step advance and, once it has been computed, finish. After a rejected step
/// advance is called from the same time with a shorter step: the source must then be where it was before.
class SupportMotion {
 public:
  virtual ~SupportMotion() = default;
  /// Names; a region of the support with this name is the body's surface.
  virtual const std::vector<std::string>& bodies() const = 0;
  /// The state at time 0, and whether the source can go on to `duration`.
  /// error  "motion_ends" when it is known not to; others as the source has them
  virtual Result<SupportState> start(double duration) = 0;
  /// The state at time + step, or an earlier one if the source can go no farther in one step (then the step is shortened to it).
  virtual Result<SupportState> advance(double time, double step) = 0;
  enum class Verdict {
    holds,
    undone,  ///< the source takes back a step that the simulator would have kept: the state of the step's beginning is to be restored to
             ///< the last bit, and advance is called again from there, with the step as long as the last one was asked for
  };
  /// The step has been computed: at its end the cloth does this to the bodies. Not accepted: it has to be repeated, whatever the verdict.
  virtual Result<Verdict> finish(bool accepted, const std::vector<BodyWrench>& wrenches) = 0;
};

/// A table of trajectories: rows of time, body, x, y, z, qw, qx, qy, qz. Between rows a body screws evenly.
/// csv     with that header, comment lines begin with #; rows of a body by increasing time
/// begin   time of the table at which the simulation begins [s]
/// error   "bad_table" with line numbers: header, numbers, times that do not increase, quaternions that are not of unit length
Result<std::unique_ptr<SupportMotion>> table_motion(std::string_view csv, const std::string& file, double begin);

/// Shapes of the whole support at times, straight in between.
/// times   increasing, from 0 [s]; shapes  as many, of the same number of rows [m]
/// error   "bad_table"
Result<std::unique_ptr<SupportMotion>> shape_motion(std::vector<double> times, std::vector<Points3> shapes);

/// Pose part of the way from a to b, along a screw.
BodyPose between(const BodyPose& a, const BodyPose& b, double part);

}  // namespace toile::dynamics
