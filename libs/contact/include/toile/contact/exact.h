// The independent check: which triangles really intersect, by exact predicates. Slower than Search, for the start and
// the end of a run and for tests.
#pragma once

#include "toile/contact/surface.h"

#include <array>
#include <vector>

namespace toile::contact {

struct FacePair {
  int a = 0, b = 0;  ///< face ids; a < b for cloth-cloth, (cloth, support) otherwise
  auto operator<=>(const FacePair&) const = default;
};

/// Pairs of faces that share no adjacency id and have a point in common (exact; degenerate faces, which have no area,
/// are tested as the segments or points they are). Ordered.
std::vector<FacePair> self_intersections(const Surface& cloth, const Points3& x);

/// (cloth face, support face) pairs that have a point in common. Ordered.
std::vector<FacePair> support_intersections(const Surface& cloth, const Points3& x, const Surface& support, const Points3& support_x);

}  // namespace toile::contact
