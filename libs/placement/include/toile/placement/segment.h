// Regions of a body that names none: trunk, neck, arms and legs, from its sections.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/support_mesh.h"

namespace toile::placement {

/// Gives every face that has no region one of torso, neck, arm_left, arm_right, leg_left, leg_right (left is at +x); regions that there are stay.
/// - arms: above the armpits outside of the trunk's width there; below them what lies outside the hull of the trunk's section
/// - neck (and head): above the height at which, going down from the neck's smallest girth, it has grown by 30 %
/// - legs: below the crotch, by side
/// Borders follow triangles.
/// error  those of body_frame ("no_trunk", "no_waist")
Issues segment(mesh::SupportMesh& support);

}  // namespace toile::placement
