#include "pairing.h"

#include <limits>

namespace toile::tailor {

std::vector<int> best_pairs(const std::vector<double>& coarse, const std::vector<double>& fine) {
  const int n = static_cast<int>(coarse.size()), m = static_cast<int>(fine.size()), slack = m - n;
  constexpr double never = std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> cost(static_cast<std::size_t>(n), std::vector<double>(static_cast<std::size_t>(slack) + 1, never));
  std::vector<std::vector<int>> from(static_cast<std::size_t>(n), std::vector<int>(static_cast<std::size_t>(slack) + 1, 0));
  // Column d of row i stands for fine place i + d; d may only grow.
  cost[0][0] = 0;
  for (int i = 1; i < n; ++i) {
    double best = never;
    int best_d = 0;
    for (int d = 0; d <= slack; ++d) {
      if (cost[i - 1][d] < best - 1e-12) best = cost[i - 1][d], best_d = d;
      const double off = coarse[i] - fine[i + d];
      cost[i][d] = best + off * off;
      from[i][d] = best_d;
    }
  }
  std::vector<int> pairs(static_cast<std::size_t>(n));
  int d = slack;
  for (int i = n - 1; i >= 0; --i) {
    pairs[i] = i + d;
    d = from[i][d];
  }
  return pairs;
}

}  // namespace toile::tailor
