// Which particles of two sides meet. Private to the library.
#pragma once

#include <vector>

namespace toile::tailor {

/// For each of the n coarse places one of the m >= n fine ones, ascending, ends on ends, with the least sum of squared
/// distances; of equally good ones the first. Source: docs/tailoring.md, "Pairs"
std::vector<int> best_pairs(const std::vector<double>& coarse, const std::vector<double>& fine);

}  // namespace toile::tailor
