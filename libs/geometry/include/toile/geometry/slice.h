// Plane sections of a triangle mesh and the girths a tape measures on them.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace toile::geometry {

using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY(); ///< need not be of unit length; not zero
};

/// One curve of a section. A closed curve does not repeat its first point.
struct Polyline {
  Points3 points;          ///< [m], |P| x 3
  std::vector<int> faces;  ///< the triangle crossed between point i and i + 1; |P| if closed, else |P| - 1
  bool closed = false;
};

/// Where a plane cuts a mesh: one polyline a connected curve, ordered by its lowest face.
/// x      positions [m], |V| x 3
/// faces  vertex ids, |F| x 3
/// ret    curves that run counter-clockwise around solid material, seen from the normal's tip, if the faces look
///        outward; a closed mesh gives closed curves only. A vertex on the plane counts as above it, so that every
///        crossed triangle has two crossed edges.
std::vector<Polyline> slice(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane);

/// The same, of the faces with keep[f] != 0 only (a region); curves may then be open.
std::vector<Polyline> slice(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane,
                            const std::vector<char>& keep);

/// Length of the curve itself [m], the closing piece included if it is closed.
double length(const Polyline& curve);

/// Area enclosed by a closed curve in its plane [m2], unsigned.
double enclosed_area(const Polyline& curve, const Eigen::Vector3d& normal);

/// Convex hull of points in a plane, counter-clockwise seen from the normal's tip; points on its sides are left out.
/// points  [m], |P| x 3 (need not lie exactly in the plane: they are projected for the decision only)
Points3 convex_hull(const Eigen::Ref<const Points3>& points, const Eigen::Vector3d& normal);

/// What a tape pulled tight around the points reads [m]: the perimeter of their convex hull.
double tape_girth(const Eigen::Ref<const Points3>& points, const Eigen::Vector3d& normal);

/// Tape girth of the one closed curve of the section that goes around `axis_point` (projected into the plane); of
/// several, the smallest in area. 0 if none does.
double tape_girth_around(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane,
                         const Eigen::Vector3d& axis_point);

/// Whether `point`, projected into the curve's plane, lies inside the closed curve.
bool encloses(const Polyline& curve, const Eigen::Vector3d& normal, const Eigen::Vector3d& point);

}  // namespace toile::geometry
