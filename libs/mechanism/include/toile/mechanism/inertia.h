// A linkage as one mass on its driver: what turns it, and how it answers.
#pragma once

#include "toile/mechanism/frame.h"

#include <functional>
#include <map>

namespace toile::mechanism {

/// What a body weighs in the drawn position.
struct Inertia {
  double mass = 0;                                    ///< [kg]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();   ///< z, y [m]
  double moment = 0;                                  ///< about the centre, for turning in the drawing's plane [kg m2]
};

/// Of bars and bows as solids of the linkage's density, and of added masses. Where surfaces of a body overlap, that counts twice.
/// error  what frame_surface reports; "no_mass" where the whole linkage has none
Result<std::vector<Inertia>> inertias(const Linkage& linkage);

/// All bodies as seen from the driver's angle q: inertia q'' + inertia_slope/2 q'^2 = weight + torques on the driver.
struct Reduced {
  double inertia = 0;        ///< [kg m2]
  double inertia_slope = 0;  ///< its derivative by q [kg m2/rad]
  double weight = 0;         ///< torque of gravity on the driver [N m]
  double height_energy = 0;  ///< of the weight [J]
};
Reduced reduce(const Configuration& configuration, const std::vector<Inertia>& inertias, double gravity);

struct DriverState {
  double angle = 0;  ///< [rad]
  double rate = 0;   ///< [rad/s]
};

/// The one equation of motion. What it has to know of the linkage is worked out where it comes by, every half degree, and is
/// interpolated between (cubic, by values and slopes of inertia and of the weight's energy, so that energy is kept).
class Dynamics {
 public:
  /// error  what Walk and inertias report
  static Result<Dynamics> make(const Linkage& linkage, double gravity);
  /// error  "dead_point"
  Result<Reduced> at(double angle);
  /// Torque on the driver, besides gravity, at a time, angle and rate [N m].
  using Torque = std::function<double(double time, const DriverState& state)>;
  /// Fourth order Runge-Kutta in pieces of half a millisecond at most, or shorter ones for torques that are stiff.
  /// error  "dead_point"; "not_finite"
  Result<DriverState> advance(DriverState state, double from, double to, const Torque& torque, double longest_piece = 5e-4);
  const std::vector<Inertia>& inertias() const { return inertias_; }

 private:
  explicit Dynamics(Walk walk) : walk_(std::move(walk)) {}
  Result<Reduced> node(long long index);
  Walk walk_;
  std::vector<Inertia> inertias_;
  double gravity_ = 0;
  std::map<long long, Reduced> nodes_;
};

/// angle_at and its derivatives by time (of a smooth profile; straight ones turn their corners at once).
struct AngleMotion {
  double angle = 0, rate = 0, acceleration = 0;
};
AngleMotion angle_motion(const std::vector<double>& times, const std::vector<double>& angles, Profile profile, double time);

}  // namespace toile::mechanism
