// The form as a level set: smooth sections along the spine and along the arms, joined by blending.
#pragma once

#include "toile/form/form.h"

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

namespace toile::form {

/// A smooth curve through values at heights: sampled evenly, rounded, evaluated as a uniform cubic spline (C2).
class Profile {
 public:
  Profile() = default;
  /// knots (position, value), increasing positions; `round` is the width of the rounding [m]
  Profile(const std::vector<std::pair<double, double>>& knots, double round);
  template <class F>
  static Profile sampled(double low, double high, double step, const F& f) {
    Profile p;
    p.low_ = low;
    p.step_ = step;
    for (int i = 0; low + i * step <= high + step; ++i) p.values_.push_back(f(low + i * step));
    return p;
  }
  struct Value {
    double f, d;  ///< value and derivative
  };
  Value at(double s) const;

 private:
  double low_ = 0, step_ = 1;
  std::vector<double> values_;
};

/// What the fitting turns until the mesh measures as asked: factors near 1 and offsets [m].
struct Tuning {
  double neck = 1, chest = 1, underbust = 1, waist = 1, hips = 1, seat = 1, biceps = 1, wrist = 1;
  double hps_height = 0;      ///< of the high point of the shoulder over the waist [m]
  double slope = 0;           ///< of the shoulder line as built [rad]
  double bust_height = 0;     ///< of the bust points over the waist [m]
  double bust_out = 0;        ///< of the bust points' places from the requested ones [m]
  double arm_root = 0;        ///< how far the underarm is let down [m]
  double elbow = 0, hand = 0; ///< from the shoulder joint along the arm [m]
  double thigh = 1, knee = 1, ankle = 1;
  double crotch = 0;          ///< how far the crotch is built under where it is asked for [m]
};

/// Levels and places that follow from measurements and tuning.
struct Levels {
  double unit = 1;  ///< size of the body against the one the drawing was made for
  double floor = 0, bottom = 0, seat = 0, hips = 0, waist = 0, underbust = 0, chest = 0, bust = 0, armpit = 0, shoulder = 0, hps = 0, top = 0;
  double half_shoulder = 0;
  Eigen::Vector3d neck_point, neck_normal;  ///< plane of the neck's base
  Eigen::Vector3d collar_point;             ///< a little higher, where the neck's girth is taken
  Eigen::Vector3d arm_joint, arm_direction, arm_outer;  ///< of the left arm (+x)
  double elbow = 0, hand = 0, biceps = 0;   ///< along the arm from the joint
  // of legs, heights
  double crotch = 0, thigh = 0, knee = 0, calf = 0, ankle = 0;
};

class Shape {
 public:
  Shape(const Measurements& m, const FormParams& params, const Tuning& tuning);
  /// Negative inside, about a distance [m] near the surface; even in x and smooth.
  double operator()(const Eigen::Vector3d& p) const;
  /// Wanted edge length relative to the torso's.
  double sizing(const Eigen::Vector3d& p) const;
  const Levels& levels() const { return levels_; }
  Eigen::Vector3d low() const, high() const;
  /// Depth centre of the torso at a height [m].
  double centre(double y) const { return centre_.at(y).f; }

 private:
  struct Bump {
    Eigen::Vector3d centre, size;
    double height;
  };
  double torso(const Eigen::Vector3d& p) const;
  double arm(const Eigen::Vector3d& p) const;
  double leg(const Eigen::Vector3d& p) const;
  void bump(double x, double y, double z, double sx, double sy, double sz, double height);

  FormParams params_;
  Levels levels_;
  Profile width_, front_, back_, centre_, front_power_, back_power_;
  double arm_blend_ = 0.1;
  Eigen::Vector3d plate_point_, plate_normal_;
  Profile arm_high_, arm_low_, arm_deep_;
  Profile leg_x_, leg_z_, leg_wide_, leg_front_, leg_back_;
  std::vector<Bump> bumps_;
  struct Breast {
    double x, y, inner, outer, upper, lower, height;
  };
  std::optional<Breast> breast_;
};

Tuning first_tuning(const Measurements& m, const FormParams& params);

}  // namespace toile::form
