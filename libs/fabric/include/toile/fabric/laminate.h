// Bonded sheets as one equivalent fabric.
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"

#include <span>
#include <string>

namespace toile::fabric {

/// Equivalent single fabric of sheets bonded face to face with their grains parallel, as additive networks: at equal
/// strain, shear angle and curvature the forces and moments of the sheets add up; so do masses and thicknesses.
/// Exact for force at F_max, work to F_max, shear, bending and their hystereses; between, the tensile curve is of the
/// same family as a single fabric's, or the sum of the curves where a sheet's is measured. Friction and colour are those of the outermost sheet.
/// sheets  face side first, at least one
/// error   Issue "no_sheets", "bad_fabric"
/// Source: docs/tailoring.md, "Layers"
Result<Card> bonded(std::span<const Card> sheets, const std::string& name);

}  // namespace toile::fabric
