// Signed distance to a closed support, and what follows from it: who is inside, pushing out.
#pragma once

#include "toile/contact/surface.h"

#include <array>
#include <memory>
#include <vector>

namespace toile::contact {

/// Closest point of the support's surface.
struct SurfacePoint {
  double distance = 0;               ///< [m], negative inside
  Eigen::Vector3d point;             ///< [m]
  Eigen::Vector3d normal;            ///< outward unit: (x - point)/distance where that is well defined, else the pseudo-normal
  int face = -1;                     ///< face of the closest point; -1: farther than the reach
  std::array<double, 3> weight{};    ///< of the face's corners, sums to 1
};

/// A vertex inside the support.
struct Penetration {
  int vertex = 0;
  double depth = 0;  ///< distance to the surface [m], > 0
};

/// Distance, sign and closest point with respect to a closed, outward triangle mesh. The sign comes from angle-weighted
/// pseudo-normals (exact for a closed mesh that does not cut itself); `winding_number` does not need that.
class SupportField {
 public:
  SupportField(const Surface& support, const Points3& x);
  ~SupportField();
  SupportField(SupportField&&) noexcept;
  SupportField& operator=(SupportField&&) noexcept;

  /// The support has moved; same topology.
  void move(const Points3& x);

  SurfacePoint nearest(const Eigen::Vector3d& x) const;

  /// Closest points of many, in parallel. Points farther outside than `reach` get face = -1 and distance = +reach;
  /// points inside are always resolved. `warm` carries the last face of every point between calls to save time; it
  /// never changes the result.
  /// x  |P| x 3 [m];  out is resized to |P|
  void nearest(const Points3& x, double reach, std::vector<SurfacePoint>& out, std::vector<int>& warm) const;

  /// Generalised winding number: 1 inside, 0 outside (2 where the support overlaps itself), by a tree with the given
  /// accuracy of the far field; safe for classification at 0.5.
  double winding_number(const Eigen::Vector3d& x) const;

  /// Vertices inside (winding number over 0.5), with depths, by increasing id.
  /// vertices  rows of x to look at
  std::vector<Penetration> penetrations(const Points3& x, const std::vector<int>& vertices) const;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

struct PushedOut {
  Points3 x;                  ///< [m]
  int moved = 0;              ///< nodes moved
  double largest_move = 0;    ///< [m]
  int inside_before = 0;
  int nearer_after = 0;       ///< vertices still nearer to the surface than `clearance` (0 on success)
};

/// Moves cloth out of the support to at least `clearance` from its surface, along closest points, in passes that spread
/// the displacement over neighbours so that the mesh stays smooth. Looks at vertices only: edges may still cut a sharp
/// support (ask support_intersections).
PushedOut project_outside(const SupportField& field, const Surface& cloth, const Points3& x, double clearance);

}  // namespace toile::contact
