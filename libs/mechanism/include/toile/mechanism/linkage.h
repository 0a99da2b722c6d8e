// Planar linkages with one degree of freedom, such as the frame of a soft top: bodies, pivots, and the motion that one driven body
// gives to the others. Drawn from the side: z forward, y up; angles turn from forward to up.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace toile::mechanism {

/// Two bodies turn about a common point. `ground` is a body that there always is.
struct Pivot {
  std::vector<std::string> bodies;
  std::array<double, 2> at{0, 0};  ///< z, y in the drawing [m]
  static void describe(auto& f) {
    f(&Pivot::bodies, {.key = "bodies", .doc = "the two bodies that turn about each other; ground is the car", .required = true});
    f(&Pivot::at, {.key = "at", .doc = "the point in the drawing: forward (z) and up (y)", .unit = "m", .required = true});
    f.check([](const Pivot& p, Issues& issues) {
      if (p.bodies.size() == 2 && p.bodies[0] != p.bodies[1]) return;
      issues.push_back(Issue{"bad_range", {.item = "bodies"}, "a pivot joins two different bodies", "name two"});
    });
  }
};

/// A rod of rectangular section on both sides of the car.
struct Bar {
  std::string body;
  std::vector<std::array<double, 2>> points;  ///< z, y [m]
  double half_width = 0.5;                    ///< |x| of its middle [m]
  double thickness = 0.01, height = 0.025;    ///< along x; in the plane [m]
  static void describe(auto& f) {
    f(&Bar::body, {.key = "body", .doc = "that it is a part of", .required = true});
    f(&Bar::points, {.key = "points", .doc = "its middle line in the drawing: forward (z) and up (y)", .unit = "m", .required = true});
    f(&Bar::half_width, {.key = "half_width", .doc = "distance from the car's middle plane", .unit = "m", .min = 1e-3, .max = 10});
    f(&Bar::thickness, {.key = "thickness", .doc = "across the car", .unit = "m", .min = 1e-4, .max = 1});
    f(&Bar::height, {.key = "height", .doc = "in the drawing, square to the line", .unit = "m", .min = 1e-4, .max = 1});
  }
};

/// A tube of elliptical section from side to side, arched upwards.
struct Bow {
  std::string name, body;
  std::array<double, 2> at{0, 0};  ///< z, y of its middle line over the car's middle plane [m]
  double half_width = 0.5;         ///< |x| of its ends [m]
  double crown = 0.05;             ///< height of the middle over the ends [m]
  double exponent = 2;             ///< the arch is at - crown |x / half_width|^exponent
  double width = 0.04, height = 0.02;  ///< of the section, along the car and across the cloth [m]
  double pitch = 0;                    ///< angle of the section's width from forward to up [rad]
  int divisions = 32, sides = 8;
  static void describe(auto& f) {
    f(&Bow::name, {.key = "name", .doc = "its outer line gets landmarks NAME_0 (right end) to NAME_divisions", .required = true});
    f(&Bow::body, {.key = "body", .doc = "that it is a part of", .required = true});
    f(&Bow::at, {.key = "at", .doc = "middle of the section over the car's middle plane, in the drawing: forward (z) and up (y)", .unit = "m", .required = true});
    f(&Bow::half_width, {.key = "half_width", .doc = "distance of its ends from the car's middle plane", .unit = "m", .min = 1e-3, .max = 10});
    f(&Bow::crown, {.key = "crown", .doc = "height of the middle over the ends", .unit = "m", .min = 0, .max = 5});
    f(&Bow::exponent, {.key = "exponent", .doc = "shape of the arch: the drop goes with this power of the distance from the middle", .min = 1, .max = 20});
    f(&Bow::width, {.key = "width", .doc = "of the section, along the car", .unit = "m", .min = 1e-3, .max = 1});
    f(&Bow::height, {.key = "height", .doc = "of the section, square to its width", .unit = "m", .min = 1e-3, .max = 1});
    f(&Bow::pitch, {.key = "pitch", .doc = "angle of the section's width, from forward to up", .unit = "rad", .min = -3.2, .max = 3.2});
    f(&Bow::divisions, {.key = "divisions", .doc = "pieces from side to side; even", .min = 2, .max = 1000});
    f(&Bow::sides, {.key = "sides", .doc = "of the section; a multiple of four", .min = 4, .max = 200});
    f.check([](const Bow& b, Issues& issues) {
      if (b.divisions % 2) issues.push_back(Issue{"bad_range", {.item = "divisions"}, "is odd, so that no point lies in the middle", "give an even number"});
      if (b.sides % 4) issues.push_back(Issue{"bad_range", {.item = "sides"}, "is not a multiple of four, so that no corner lies outermost", "give 4, 8, 12 …"});
    });
  }
};

/// Mass that a body has besides its bars and bows.
struct AddedMass {
  std::string body;
  double mass = 0;                 ///< [kg]
  std::array<double, 2> at{0, 0};  ///< z, y of its centre in the drawing [m]
  double moment = 0;               ///< of inertia about its centre, for turning in the drawing's plane [kg m2]
  static void describe(auto& f) {
    f(&AddedMass::body, {.key = "body", .doc = "that it is a part of", .required = true});
    f(&AddedMass::mass, {.key = "mass", .doc = "on both sides together", .unit = "kg", .min = 0, .max = 1e4, .required = true});
    f(&AddedMass::at, {.key = "at", .doc = "its centre in the drawing: forward (z) and up (y)", .unit = "m", .required = true});
    f(&AddedMass::moment, {.key = "moment", .doc = "moment of inertia about its centre, for turning in the drawing's plane", .unit = "kg*m2", .min = 0, .max = 1e4});
  }
};

struct Linkage {
  std::vector<std::string> bodies;  ///< without ground
  std::vector<Pivot> pivots;
  std::string driver;  ///< the body whose angle says where the linkage is
  std::vector<Bar> bars;
  std::vector<Bow> bows;
  double density = 2700;           ///< of bars and bows [kg/m3]
  std::vector<AddedMass> masses;
  static void describe(auto& f) {
    f(&Linkage::bodies, {.key = "bodies", .doc = "names of the moving bodies", .required = true});
    f(&Linkage::pivots, {.key = "pivots", .doc = "points about which two bodies turn, in the drawn position", .required = true});
    f(&Linkage::driver, {.key = "driver", .doc = "the body whose angle from the drawn position the motion prescribes", .required = true});
    f(&Linkage::bars, {.key = "bars", .doc = "rods in the plane of the drawing, on both sides"});
    f(&Linkage::bows, {.key = "bows", .doc = "arches from side to side"});
    f(&Linkage::density, {.key = "density", .doc = "of bars and bows, which are solid; 0: they weigh nothing", .unit = "kg/m3", .min = 0, .max = 3e4});
    f(&Linkage::masses, {.key = "masses", .doc = "what the bodies weigh besides"});
  }
};

/// Names of bodies that are not there, pivots without bodies, a driver that is none, what can not move in one way only.
/// The count of freedoms is 3 per body less 2 per pivot (Gruebler); that they are independent is found by `follow`.
Issues validate(const Linkage& linkage);

/// Where a body has gone from the drawn position: p -> shift + R(angle) p, both in (z, y).
struct Pose {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< [m]
  double angle = 0;                                 ///< [rad]
};

/// The linkage at one angle of its driver.
struct Configuration {
  double driver = 0;               ///< [rad]
  std::vector<Pose> poses;         ///< of the bodies, in their order
  std::vector<Pose> rates;         ///< their derivatives by the driver's angle [m/rad, 1]
  std::vector<Pose> curvatures;    ///< their second derivatives [m/rad2, 1/rad]
  double closure = 0;              ///< largest distance of a pivot's point on its two bodies [m]
  double conditioning = 0;         ///< smallest over largest singular value of the closure equations (lengths in units of the drawing's size)
};

/// A linkage that is led along its driver's angle, from the drawn position on. A copy is a state to come back to.
class Walk {
 public:
  /// error  what validate finds; "dead_point" where the drawn position is one
  static Result<Walk> begin(const Linkage& linkage);
  /// Leads it there in steps of one degree at most: prediction along the rates, correction by Newton's method on the loop closures.
  /// error  "dead_point" where the linkage locks or branches before the angle is reached; it then stands before that point
  Result<Configuration> to(double angle);
  Walk(const Walk&);
  Walk& operator=(const Walk&);
  Walk(Walk&&) noexcept;
  Walk& operator=(Walk&&) noexcept;
  ~Walk();

 private:
  struct State;
  explicit Walk(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Follows the linkage along its driver's angles, as Walk does.
/// angles  [rad], in any order; each is reached from the one before it
/// ret     one configuration an angle, closures below 1e-12 of the drawing's size
/// error   what validate finds; "dead_point" where the linkage locks or branches before the angle is reached, with that angle
Result<std::vector<Configuration>> follow(const Linkage& linkage, const std::vector<double>& angles);

/// A point of the drawing (z, y) on a body, in a pose.
Eigen::Vector2d moved(const Pose& pose, const Eigen::Vector2d& point);

}  // namespace toile::mechanism
