// Several sheets of fabric as one equivalent fabric. docs/tailoring.md, "Layers", derives the formulas.
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"

#include <span>
#include <string>
#include <vector>

namespace toile::fabric {

/// How two neighbouring sheets of a stack are held together.
enum class Joint {
  additive,  ///< parallel networks: at equal strain, shear angle and curvature forces and moments add up
  laminate,  ///< glued all over: the same, and bending stretches the sheets about their common neutral axis
  sliding,   ///< joined along lines, free to slide between: as additive, and the friction between them is damping
};

/// A sheet as it lies in a stack.
struct Sheet {
  Card card;
  double angle = 0;  ///< of its warp from the stack's, counter-clockwise seen from the face side [rad]
};

struct Bond {
  Joint joint = Joint::additive;
  double bending_friction = 0;  ///< sliding: added to 2HB, both directions [N]
  double shear_friction = 0;    ///< sliding: added to 2HG and 2HG5 [N/m]
};

/// Friction of two sheets that slide on each other.
struct SlidingFriction {
  double bending = 0;  ///< part of 2HB [N]
  double shear = 0;    ///< part of 2HG [N/m]
};

/// pressure  normal pressure between the sheets [Pa]
/// spacing   distance between the lines along which they are joined [m]
/// ret       shear = MIU p L / 2, bending = h MIU p L / 2, with the mean MIU and the distance h of the middle planes
SlidingFriction sliding_friction(const Card& a, const Card& b, double pressure, double spacing);

/// Equivalent single fabric of a stack. Neighbours glued by `laminate` are one plate; plates and all other sheets add up.
/// Exact for the force and the work at F_max, shear, bending and twist at small strain, and masses; between, the tensile
/// curve is of the same family as a single fabric's, or the sum of the curves where a sheet's is measured. Friction, colour,
/// test conditions and F_max are those of the outermost sheet.
/// sheets  face side first, at least one
/// bonds   |sheets| - 1
/// error   Issue "no_sheets", "bad_fabric"
Result<Card> stacked(std::span<const Sheet> sheets, std::span<const Bond> bonds, const std::string& name);

/// The same of sheets with parallel grains, all joints additive.
Result<Card> bonded(std::span<const Card> sheets, const std::string& name);

}  // namespace toile::fabric
