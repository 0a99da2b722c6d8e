// Where panels go before they are bent: every panel gets a part of the support (trunk, arm or leg) and a rigid motion into
// the unrolled surface of that part, found from its seams.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/placement/body_frame.h"
#include "toile/placement/folds.h"
#include "toile/placement/legs.h"
#include "toile/placement/params.h"

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace toile::placement {

enum class Part { trunk, arm_left, arm_right, leg_left, leg_right, attached };

/// Rigid motion of a panel into the unrolled tube of its part: a [m] runs round it (from the front to the body's left on
/// the trunk), h [m] along it (up on the trunk, inwards to the shoulder on an arm, up on a leg from its top, see LegAxis).
struct PanelLayout {
  Part part = Part::trunk;
  Region region = Region::automatic;  ///< as resolved; never automatic
  bool rise = false;                  ///< of trousers: a leg that is sewn to the other one over the crotch
  double turn = 0;                    ///< [rad]
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  Eigen::Vector2d operator()(const Eigen::Vector2d& uv) const;
};

struct Layout {
  std::vector<PanelLayout> panels;           ///< by panel id
  double girth_trunk = 0;                    ///< what the panels measure round the trunk, seam to seam [m]; 0: open
  double girth_arm_left = 0, girth_arm_right = 0;
  double girth_leg_left = 0, girth_leg_right = 0;
  std::vector<TrouserLeg> trousers;          ///< none or left and right
  std::vector<int> shoulder_welds;           ///< rows of welds between front and back that run over a shoulder
};

/// The settings with the leg (left or right) that names of leg panels say. A garment is mirrored after this, its names are not.
PlaceParams with_named_legs(const mesh::GarmentMesh& garment, PlaceParams params);

/// error  Issues "no_region" (panels whose part of the support is not known), "unknown_panel" (a setting for a panel
///        that is not there), "no_arm", "no_legs", "unknown_anchor", "bad_anchor" (on arms and attached panels; a point for trousers to go to)
Result<Layout> make_layout(const mesh::GarmentMesh& garment, const FoldedFlat& flat, const mesh::SupportMesh& support, const BodyFrame& frame, const PlaceParams& params);

}  // namespace toile::placement
