// What a garment needs to know about a body, found from plane sections: where torso, arms, legs and neck are.
// Works on any closed, upright body in an A- or T-pose; landmarks of the project's own forms take precedence.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/support_mesh.h"

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace toile::placement {

using mesh::Points2;
using mesh::Points3;

/// Horizontal section of trunk (and legs below the crotch), arms left out.
struct Section {
  double y = 0;          ///< height [m]
  Points2 hull;          ///< (z, x) of its convex hull, counter-clockwise, i.e. from the front to the left side [m], |P| x 2
  double girth = 0;      ///< perimeter of the hull [m]
  bool merged = false;   ///< the arms are part of it (above the armpits)
};

/// A point of a limb's axis, going outwards from the trunk.
struct LimbPoint {
  Eigen::Vector3d centre;  ///< centroid of the perpendicular section [m]
  double girth = 0;        ///< tape girth of that section [m]
  double radius = 0;       ///< largest distance of the section from its centre [m]
  Points2 hull;            ///< of a leg's section, as Section::hull; empty on arms
};

struct Limb {
  Eigen::Vector3d origin;     ///< where the axis enters the trunk, near the joint [m]
  Eigen::Vector3d direction;  ///< unit, outwards, of the straight line that fits the part next to the trunk
  std::vector<LimbPoint> points;  ///< outwards, every 10 mm of axis
};

struct BodyFrame {
  double x_mid = 0;                ///< of the plane of symmetry [m]
  double bottom = 0, top = 0;      ///< heights of the mesh [m]
  double crotch = 0;               ///< lowest height with one section around the plane of symmetry (bottom, if no legs)
  double hips = 0, waist = 0;      ///< of the largest girth below and the smallest girth below the armpits [m]
  double armpit = 0;               ///< highest section where the trunk is free of the arms [m]
  std::optional<double> chest;     ///< of the largest girth between waist and armpit [m]
  double neck = 0;                 ///< of the smallest girth above the shoulders [m]
  std::vector<Section> sections;   ///< upwards, every 10 mm from bottom to neck
  std::optional<Limb> arm_left, arm_right;  ///< left is at +x
  std::optional<Limb> leg_left, leg_right;  ///< both or none; their points are the middles of horizontal sections
  std::map<std::string, Eigen::Vector3d> landmarks;  ///< of the support, and what was found (body_levels names)

  /// Section nearest to a height.
  const Section& section(double y) const;
};

/// error  Issue "no_trunk" where no section goes around the middle; "no_waist"
Result<BodyFrame> body_frame(const mesh::SupportMesh& support);

/// Height of the body's outline seen from the front at distance x [m] from x = 0: the highest point of the mesh with
/// that x below `below` (neck and head left out when `below` is the neck's height).
/// ret  nothing where the mesh does not reach that far
std::optional<double> outline_top(const mesh::SupportMesh& support, double x);

}  // namespace toile::placement
