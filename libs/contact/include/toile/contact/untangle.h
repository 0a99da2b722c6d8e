// Pulling cloth out of itself: start states are never perfect.
#pragma once

#include "toile/contact/surface.h"

#include <cstdint>
#include <vector>

namespace toile::contact {

struct UntangleOptions {
  double step = 5e-4;      ///< most that a crossing moves its nodes in one pass [m]; about the cloth's thickness
  int passes = 300;
  int rings = 4;           ///< of neighbours that a pushed node takes along
  int relaxations = 4;     ///< sweeps a pass that draw edges near moved nodes back to their length in x
  /// Nodes (|nodes|, non-zero = held) that do not move. Empty: none.
  std::vector<std::uint8_t> held;
};

struct Untangled {
  Points3 x;                ///< [m]
  int before = 0;           ///< intersecting face pairs in x
  int after = 0;            ///< left over; 0 on success. Ask self_intersections(cloth, result.x) for their places.
  int passes = 0;
  int moved = 0;            ///< nodes moved
  double largest_move = 0;  ///< [m]
};

/// Undoes the places where cloth cuts itself, pass by pass, moving only what is near them. Where the cut edges separate a
/// piece from the cloth (a corner, a hem, the crest of a fold that pokes through), the smaller piece goes back through the
/// faces it crossed (global intersection analysis). Where nothing is separated the curve of the cut is shortened in
/// the direction in which its length falls fastest. Needs no layers. A sheet that passes through the middle
/// of another along a whole line has no smaller side: it may stay (then `after` is not 0) or leave on the wrong side.
/// Knows nothing of supports: project outside before and after.
/// Source: docs/bibliography.md#baraff2003, docs/bibliography.md#volino2006
Untangled untangle(const Surface& cloth, const Points3& x, const UntangleOptions& options = {});

}  // namespace toile::contact
