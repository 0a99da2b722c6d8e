#include "toile/dynamics/stability.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>
#include <vector>

namespace toile::dynamics {

using mesh::Points3;

LowestStiffness lowest_stiffness(const StiffnessProblem& problem, double tolerance, int max_iterations) {
  const Eigen::Index n = problem.mass.size();
  const auto dot = [&](const Points3& a, const Points3& b) { return a.cwiseProduct(b).sum(); };
  const auto mass_times = [&](const Points3& a) { return Points3(problem.mass.asDiagonal() * a); };
  LowestStiffness result;
  // A start with a part of every motion; the same at every run.
  Points3 start(n, 3);
  std::uint64_t state = 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      start(i, c) = static_cast<double>(state >> 11) / 9007199254740992.0 - 0.5;
    }
  }
  struct Direction {
    Points3 v, stiffness;
  };
  Direction x;
  problem.precondition(mass_times(start), x.v);
  double length = std::sqrt(dot(x.v, mass_times(x.v)));
  result.mode = Points3::Zero(n, 3);
  if (!(length > 0)) return result;  // everything is held
  x.v /= length;
  problem.stiffness(x.v, x.stiffness);
  double value = dot(x.v, x.stiffness);
  const double first = std::abs(value);
  double best = value;
  result.mode = x.v;
  std::vector<Direction> last;  // the way of the last iteration
  constexpr int quiet_limit = 2;
  int quiet = 0;
  for (int k = 0; k < max_iterations && quiet < quiet_limit; ++k) {
    ++result.iterations;
    Direction w;
    problem.precondition(x.stiffness - value * mass_times(x.v), w.v);
    std::vector<Direction> basis{x};
    std::vector<Direction> more;
    if (dot(w.v, w.v) > 0) {
      problem.stiffness(w.v, w.stiffness);
      more.push_back(std::move(w));
    }
    more.insert(more.end(), last.begin(), last.end());
    for (Direction& d : more) {
      const double given = std::sqrt(dot(d.v, mass_times(d.v)));
      for (int pass = 0; pass < 2; ++pass) {
        for (const Direction& b : basis) {
          const double part = dot(b.v, mass_times(d.v));
          d.v -= part * b.v;
          d.stiffness -= part * b.stiffness;
        }
      }
      const double left = std::sqrt(dot(d.v, mass_times(d.v)));
      if (!(left > 1e-8 * given)) continue;
      d.v /= left;
      d.stiffness /= left;
      basis.push_back(d);
    }
    const auto size = static_cast<Eigen::Index>(basis.size());
    Eigen::MatrixXd small(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        small(i, j) = small(j, i) = 0.5 * (dot(basis[a].v, basis[b].stiffness) + dot(basis[b].v, basis[a].stiffness));
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(small);
    const Eigen::VectorXd mix = eigen.eigenvectors().col(0);
    Direction way{Points3::Zero(n, 3), Points3::Zero(n, 3)};
    for (Eigen::Index i = 1; i < size; ++i) {
      way.v += mix[i] * basis[static_cast<std::size_t>(i)].v;
      way.stiffness += mix[i] * basis[static_cast<std::size_t>(i)].stiffness;
    }
    x.v = mix[0] * basis[0].v + way.v;
    length = std::sqrt(dot(x.v, mass_times(x.v)));
    x.v /= length;
    // Afresh, so that differences do not add up.
    problem.stiffness(x.v, x.stiffness);
    const double next = dot(x.v, x.stiffness);
    // Each iteration lowers the value, but for what products are uncertain by; then the way so far is of no more use.
    quiet = value - next <= tolerance * std::max(std::abs(next), 0.01 * first) ? quiet + 1 : 0;
    last.clear();
    if (next <= value) last.push_back(std::move(way));
    value = next;
    if (!(value < best)) continue;
    best = value;
    result.mode = x.v;
  }
  result.value = best;
  result.converged = quiet >= quiet_limit;
  return result;
}

}  // namespace toile::dynamics
