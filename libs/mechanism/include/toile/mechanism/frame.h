// The surface of a linkage, and its way through time.
#pragma once

#include "toile/mechanism/linkage.h"
#include "toile/mesh/support_mesh.h"

namespace toile::mechanism {

/// Closed surfaces of all bars (on both sides) and bows in the drawn position: a region a body, landmarks along the outer lines of the bows
/// (NAME_0 at the right end to NAME_divisions at the left one, on the surface). Pieces may overlap where bodies are joined.
/// Precondition: validate(linkage) finds nothing.
/// error  "bad_bar" for a bar that turns back on itself or whose points coincide
Result<mesh::SupportMesh> frame_surface(const Linkage& linkage);

/// x -> rotation x + shift in space, of a pose in the drawing's plane. The quaternion (w, x, y, z) turns about x.
struct RigidPose {
  std::array<double, 4> rotation{1, 0, 0, 0};
  std::array<double, 3> shift{0, 0, 0};  ///< [m]
};
RigidPose in_space(const Pose& pose);

/// How the driver's angle runs through time.
enum class Profile {
  straight,  ///< straight between rows
  smooth,    ///< 3u^2 - 2u^3 between rows: at rest at each
};

/// Angle at a time; held before the first row and after the last.
/// times   [s], increasing; angles  [rad], as many
double angle_at(const std::vector<double>& times, const std::vector<double>& angles, Profile profile, double time);

/// The frame moved: vertices of each body by its pose.
mesh::SupportMesh moved(const mesh::SupportMesh& frame, const Linkage& linkage, const Configuration& configuration);

}  // namespace toile::mechanism

template <>
struct toile::Choices<toile::mechanism::Profile> {
  using E = toile::mechanism::Profile;
  static constexpr std::array names{std::pair{"straight", E::straight}, std::pair{"smooth", E::smooth}};
};
