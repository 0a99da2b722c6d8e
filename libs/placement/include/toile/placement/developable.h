// Isometric maps of flat cloth onto developable surfaces. All maps keep arc length exactly: the only strain of a mesh
// mapped through them is the chord error of its edges.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace toile::placement {

using Points2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

/// A right-handed frame: `across` x `up` = `out`. Panel coordinates (u, v) start out along (across, up), with the face
/// side towards `out`.
struct Frame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d out() const { return across.cross(up); }
};

/// (u, v) -> origin + u across + v up.
Eigen::Vector3d on_plane(const Frame& frame, const Eigen::Vector2d& uv);

/// Round cylinder of the given radius [m] whose ruling through the frame's origin is along `up`; its axis is at
/// origin - radius * out. u runs round it.
Eigen::Vector3d on_cylinder(const Frame& frame, double radius, const Eigen::Vector2d& uv);

/// Cone with its apex on the line `up` through the frame's origin. `slant` is the distance of the apex from the origin
/// along the surface [m], positive: the apex is above (the cone widens downwards), negative: below. `radius` is the
/// radius of the cone's section through the origin [m]. The ruling through the origin is `up`; the direction u = 0 is
/// that ruling, and circles about the apex in the flat pattern become circles about the axis.
/// precondition  radius <= |slant|
Eigen::Vector3d on_cone(const Frame& frame, double radius, double slant, const Eigen::Vector2d& uv);

/// A closed convex plane curve with continuous tangent: the parallel curve of a convex polygon at a distance.
class ConvexSection {
 public:
  /// polygon   corners, counter-clockwise, |P| x 2 [m]
  /// distance  of the parallel curve, >= 0 [m]
  /// start     the curve's arc length starts where the ray from `start` along `direction` leaves it
  ConvexSection(const Points2& polygon, double distance, const Eigen::Vector2d& start, const Eigen::Vector2d& direction);
  double perimeter() const { return perimeter_; }
  /// Point at arc length s [m] (any number; periodic), counter-clockwise from the start.
  Eigen::Vector2d point(double s) const;
  /// Unit normal to the outside at s.
  Eigen::Vector2d normal(double s) const;
  /// Arc length on another parallel curve of the same polygon, both at a distance > 0, of the point that faces the one at s.
  double facing(double s, const ConvexSection& other) const;

 private:
  struct Piece {
    double begin;              // arc length
    double length;
    Eigen::Vector2d centre;    // of an arc; or first point of a line
    double angle = 0;          // of the outward normal at its begin
    bool arc = false;
  };
  const Piece& piece(double& s) const;
  std::vector<Piece> pieces_;
  double perimeter_ = 0, shift_ = 0, distance_ = 0;
};

}  // namespace toile::placement
