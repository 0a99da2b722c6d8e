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

/// The surface of cloth spread from bow to bow, in their order, as a closed shell.
struct SkinOptions {
  double offset = 0.003;     ///< of the outside from the outer lines of the bows [m]
  double overhang = 0.03;    ///< beyond the first and last bow and beyond the ends of all [m]
  double thickness = 0.03;   ///< of the shell, downwards [m]
  double cell = 0.02;        ///< largest edge of its grid along the rulings, and across [m]
  static void describe(auto& f) {
    f(&SkinOptions::offset, {.key = "offset", .doc = "of its outside from the outer lines of the bows", .unit = "m", .min = 0, .max = 1});
    f(&SkinOptions::overhang, {.key = "overhang", .doc = "beyond the first and last bow and beyond the ends of all", .unit = "m", .min = 1e-4, .max = 1});
    f(&SkinOptions::thickness, {.key = "thickness", .doc = "of the shell, downwards", .unit = "m", .min = 1e-4, .max = 1});
    f(&SkinOptions::cell, {.key = "cell", .doc = "largest edge of its grid along the rulings, and across", .unit = "m", .min = 1e-3, .max = 1});
  }
};
/// Straight rulings between neighbouring bows, their points matched by the part of the half width. Regions `outside` and `inside`, landmarks along
/// the bows as on the frame, on the outside (to within the chords of the grid).
/// poses  of the bodies; empty: the drawn position
/// error  "no_skin" where there are fewer than two bows
Result<mesh::SupportMesh> skin_surface(const Linkage& linkage, const std::vector<Pose>& poses, const SkinOptions& options);

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
