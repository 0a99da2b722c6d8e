// A triangle mesh of a level set that is mirror-symmetric in x: one half is meshed, the other is its mirror image.
#pragma once

#include "toile/mesh/types.h"

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

namespace toile::form {

using Field = std::function<double(const Eigen::Vector3d&)>;  ///< negative inside; about a distance [m] near the surface
using Sizing = std::function<double(const Eigen::Vector3d&)>; ///< wanted edge length [m]

/// The half x >= 0. Border vertices have x == 0 exactly; the border is where the mirror plane cuts the surface.
struct HalfSurface {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;  ///< outward
  std::vector<char> border;               ///< per point
};

/// First, rough triangles by marching tetrahedra on a grid of the box [0, high.x] x [low.y, high.y] x [low.z, high.z].
HalfSurface polygonise(const Field& field, const Eigen::Vector3d& low, const Eigen::Vector3d& high, double cell);

/// Even, well-shaped triangles of the wanted size by splits, collapses, flips and tangential smoothing, the points
/// kept on the level set.
HalfSurface remesh(HalfSurface surface, const Field& field, const Sizing& sizing, int passes);

/// Moves the points onto the level set along its gradient and evens them out along it; faces stay.
HalfSurface follow(HalfSurface surface, const Field& field, const Sizing& sizing, int smoothing);

/// Vertices that the mirrored whole will have.
int mirrored_vertex_count(const HalfSurface& surface);

struct Whole {
  mesh::Points3 x;
  mesh::Triangles faces;
};
/// Both halves: the points of x >= 0 first, then the images of those with x > 0 in the same order.
Whole mirrored(const HalfSurface& surface);

}  // namespace toile::form
