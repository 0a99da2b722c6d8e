// Does a card describe a fabric that can exist, and one of the kind that garments are made of?
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"
#include "toile/fabric/measured.h"

#include <string>
#include <vector>

namespace toile::fabric {

/// One figure of a card against what is usual for woven apparel and what is possible at all.
struct Judged {
  std::string key;                          ///< as in the file, or the name of a ratio
  std::string unit;                         ///< customary
  double value = 0;                         ///< in that unit
  double usual_low = 0, usual_high = 0;
  double possible_low = 0, possible_high = 0;
  bool usual() const { return value >= usual_low && value <= usual_high; }
  bool possible() const { return value >= possible_low && value <= possible_high; }
};

/// All figures of a card that have a range. docs/fabric.md has the table and what it rests on.
std::vector<Judged> judged_figures(const Card& card);

struct Plausibility {
  Issues warnings;  ///< outside what is usual, or questionable: "unusual", "assumed", "mixed_tests"
  Issues findings;  ///< impossible or contradictory: "implausible", Category::check
};

/// Precondition: constitutive(card) succeeds.
Plausibility plausibility(const Card& card);
/// Also what only the file tells: warp and weft that differ, a cantilever's B beside a 2HB, nothing known of the twist.
Plausibility plausibility(const Measured& measured, const Resolved& resolved);

}  // namespace toile::fabric
