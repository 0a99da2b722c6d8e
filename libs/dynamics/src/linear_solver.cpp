#include "toile/dynamics/linear_solver.h"

#include "toile/base/parallel.h"
#include "toile/base/result.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

namespace toile::dynamics {
namespace {

using mechanics::splat;
constexpr std::size_t grain = 1024;
constexpr int domain_rows = 2048;  // rows of one independent incomplete factor

double dot3(Float4 a, Float4 b) {
  const Float4 p = a * b;
  return static_cast<double>(p[0]) + static_cast<double>(p[1]) + static_cast<double>(p[2]);
}

double dot(const std::vector<Float4>& a, const std::vector<Float4>& b) {
  return parallel_reduce(a.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += dot3(a[i], b[i]);
    return sum;
  }, [](double p, double q) { return p + q; });
}

/// Inverse of a pivot; nothing when elimination has lost too much of the block for single precision (or is indefinite).
std::optional<Block> pivot_inverse(const Eigen::Matrix3d& m, const Eigen::Matrix3d& original) {
  const Eigen::LLT<Eigen::Matrix3d> llt(m);
  if (llt.info() != Eigen::Success) return {};
  for (int k = 0; k < 3; ++k) {
    const double l = llt.matrixL()(k, k);
    if (!(l * l > 1e-3 * original(k, k))) return {};
  }
  const Eigen::Matrix3d inverse = llt.solve(Eigen::Matrix3d::Identity());
  return Block::from(0.5 * (inverse + inverse.transpose()));
}

Block minus_product_transposed(const Block& a, const Block& b, const Block& start) {
  // start - a * b^T
  Block result = start;
  for (int c = 0; c < 3; ++c) {
    // column c of a b^T = sum_k a.column[k] * b(c, k)
    for (int k = 0; k < 3; ++k) result.column[c] -= a.column[k] * splat(b.column[k][c]);
  }
  return result;
}

Block product(const Block& a, const Block& b) {
  Block result;
  for (int c = 0; c < 3; ++c) result.column[c] = a * b.column[c];
  return result;
}

}  // namespace

void LinearSolver::factor(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const mesh::Points3& x, const std::vector<char>& fixed, Coarse coarse) {
  const auto n = static_cast<std::size_t>(matrix.rows());
  // Terms around each node.
  node_term_start_.assign(n + 1, 0);
  for (const ContactTerm& term : terms) {
    for (int node : term.node) {
      if (node >= 0) ++node_term_start_[static_cast<std::size_t>(node) + 1];
    }
  }
  for (std::size_t i = 1; i <= n; ++i) node_term_start_[i] += node_term_start_[i - 1];
  node_term_.resize(static_cast<std::size_t>(node_term_start_[n]));
  std::vector<int> next(node_term_start_.begin(), node_term_start_.end() - 1);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      const int node = terms[t].node[static_cast<std::size_t>(k)];
      if (node >= 0) node_term_[static_cast<std::size_t>(next[static_cast<std::size_t>(node)]++)] = static_cast<int>(t) * 4 + k;
    }
  }
  diagonal_.resize(n);
  inverse_.resize(n);
  parallel_for(n, grain, [&](std::size_t i) {
    Block d = matrix.value[static_cast<std::size_t>(matrix.diagonal[i])];
    for (int k = node_term_start_[i]; k < node_term_start_[i + 1]; ++k) {
      const int item = node_term_[static_cast<std::size_t>(k)];
      const ContactTerm& term = terms[static_cast<std::size_t>(item / 4)];
      const float w = term.weight[static_cast<std::size_t>(item % 4)];
      for (int c = 0; c < 3; ++c) d.column[c] += splat(w * w) * term.block.column[c];
    }
    diagonal_[i] = d;
  });
  // Lower triangle inside each domain: structure once, values each time.
  if (row_start_.size() != n + 1 || domain_start_.empty()) {
    domain_start_.clear();
    const int domains = std::max(1, (static_cast<int>(n) + domain_rows / 2) / domain_rows);
    for (int d = 0; d <= domains; ++d) domain_start_.push_back(static_cast<int>(static_cast<long long>(n) * d / domains));
    row_start_.assign(n + 1, 0);
    column_.clear();
    for (std::size_t d = 0; d + 1 < domain_start_.size(); ++d) {
      for (int i = domain_start_[d]; i < domain_start_[d + 1]; ++i) {
        for (int k = matrix.row_start[static_cast<std::size_t>(i)]; k < matrix.diagonal[static_cast<std::size_t>(i)]; ++k) {
          if (matrix.column[static_cast<std::size_t>(k)] >= domain_start_[d]) column_.push_back(matrix.column[static_cast<std::size_t>(k)]);
        }
        row_start_[static_cast<std::size_t>(i) + 1] = static_cast<int>(column_.size());
      }
    }
    lower_.resize(column_.size());
  }
  // L D L^T without fill, row by row: lower_ holds L, inverse_ the inverted pivots. Dropping fill can make a pivot
  // indefinite; then the domain is factored anew with a heavier diagonal (Manteuffel's shift).
  parallel_for(domain_start_.size(), 1, [&](std::size_t task) {
    if (task == 0) {
      if (coarse == Coarse::anew || !coarse_.fits(matrix)) coarse_.factor(matrix, terms, x, fixed);
      return;
    }
    const std::size_t d = task - 1;
    for (double shift = 0; !factor_domain(matrix, d, shift); shift = shift == 0 ? 0.01 : 3 * shift) {
      TOILE_CHECK(shift < 100, "a diagonal block is not positive definite: shift {}", shift);
    }
  });
  term_force_.resize(terms.size());
  r_.resize(n);
  z_.resize(n);
  p_.resize(n);
  q_.resize(n);
}

bool LinearSolver::factor_domain(const BlockMatrix& matrix, std::size_t d, double shift) {
  for (int row = domain_start_[d]; row < domain_start_[d + 1]; ++row) {
    const auto i = static_cast<std::size_t>(row);
    const int begin = row_start_[i], end = row_start_[i + 1];
    const int offset = matrix.diagonal[i] - end;  // column_[k] is matrix.column[k + offset]
    Block pivot = diagonal_[i];
    for (int c = 0; c < 3; ++c) pivot.column[c][c] *= static_cast<float>(1 + shift);
    for (int k = begin; k < end; ++k) {
      const auto j = static_cast<std::size_t>(column_[static_cast<std::size_t>(k)]);
      Block value = matrix.value[static_cast<std::size_t>(k + offset)];
      // value -= sum_m (L_im D_m) L_jm^T; lower_ of this row still holds L_im D_m.
      int p = begin, q = row_start_[j];
      const int q_end = row_start_[j + 1];
      while (p < k && q < q_end) {
        const int cp = column_[static_cast<std::size_t>(p)], cq = column_[static_cast<std::size_t>(q)];
        if (cp == cq) {
          value = minus_product_transposed(lower_[static_cast<std::size_t>(p)], lower_[static_cast<std::size_t>(q)], value);
          ++p;
          ++q;
        } else if (cp < cq) {
          ++p;
        } else {
          ++q;
        }
      }
      lower_[static_cast<std::size_t>(k)] = value;
    }
    for (int k = begin; k < end; ++k) {
      const Block scaled = lower_[static_cast<std::size_t>(k)];
      const Block l = product(scaled, inverse_[static_cast<std::size_t>(column_[static_cast<std::size_t>(k)])]);
      pivot = minus_product_transposed(scaled, l, pivot);
      lower_[static_cast<std::size_t>(k)] = l;
    }
    const Eigen::Matrix3d m = pivot.matrix();
    const std::optional<Block> inverse = pivot_inverse(0.5 * (m + m.transpose()), diagonal_[i].matrix());
    if (!inverse) return false;
    inverse_[i] = *inverse;
  }
  return true;
}

void LinearSolver::precondition(const std::vector<Float4>& r, std::vector<Float4>& z) {
  // The coarse space is one more domain beside the others.
  parallel_for(domain_start_.size(), 1, [&](std::size_t task) {
    if (task == 0) {
      coarse_.solve(r);
      return;
    }
    const std::size_t d = task - 1;
    for (int row = domain_start_[d]; row < domain_start_[d + 1]; ++row) {
      const auto i = static_cast<std::size_t>(row);
      Float4 sum = r[i];
      for (int k = row_start_[i]; k < row_start_[i + 1]; ++k) sum -= lower_[static_cast<std::size_t>(k)] * z[static_cast<std::size_t>(column_[static_cast<std::size_t>(k)])];
      z[i] = sum;
    }
    for (int row = domain_start_[d]; row < domain_start_[d + 1]; ++row) z[static_cast<std::size_t>(row)] = inverse_[static_cast<std::size_t>(row)] * z[static_cast<std::size_t>(row)];
    for (int row = domain_start_[d + 1] - 1; row >= domain_start_[d]; --row) {
      const auto i = static_cast<std::size_t>(row);
      const Float4 value = z[i];
      for (int k = row_start_[i]; k < row_start_[i + 1]; ++k) {
        z[static_cast<std::size_t>(column_[static_cast<std::size_t>(k)])] -= lower_[static_cast<std::size_t>(k)].transposed_times(value);
      }
    }
  });
  parallel_for(z.size(), grain, [&](std::size_t i) { z[i] += coarse_.correction(i); });
}

void LinearSolver::multiply(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const std::vector<Float4>& x, std::vector<Float4>& y) {
  parallel_for(terms.size(), grain, [&](std::size_t t) {
    const ContactTerm& term = terms[t];
    Float4 sum{};
    for (std::size_t k = 0; k < 4; ++k) {
      if (term.node[k] >= 0) sum += splat(term.weight[k]) * x[static_cast<std::size_t>(term.node[k])];
    }
    term_force_[t] = term.block * sum;
  });
  parallel_for(x.size(), grain, [&](std::size_t i) {
    Float4 sum{};
    for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k) sum += matrix.value[static_cast<std::size_t>(k)] * x[static_cast<std::size_t>(matrix.column[static_cast<std::size_t>(k)])];
    for (int k = node_term_start_[i]; k < node_term_start_[i + 1]; ++k) {
      const int item = node_term_[static_cast<std::size_t>(k)];
      sum += splat(terms[static_cast<std::size_t>(item / 4)].weight[static_cast<std::size_t>(item % 4)]) * term_force_[static_cast<std::size_t>(item / 4)];
    }
    y[i] = sum;
  });
}

SolveReport LinearSolver::solve(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const std::vector<Float4>& b, std::vector<Float4>& x, const SolveOptions& options) {
  const std::size_t n = b.size();
  r_ = b;
  precondition(r_, z_);
  double rho = dot(r_, z_);
  const double start = rho;
  SolveReport report;
  if (!(start > 0)) {
    x.assign(n, Float4{});
    report.converged = start == 0;
    return report;
  }
  bool begun = false;
  if (options.from_x && x.size() == n) {
    multiply(matrix, terms, x, q_);
    const double curvature = dot(x, q_), gain = dot(x, b);
    begun = curvature > 0 && gain != 0;
    if (begun) {
      const Float4 alpha = splat(static_cast<float>(gain / curvature));
      parallel_for(n, grain, [&](std::size_t i) {
        x[i] *= alpha;
        r_[i] -= alpha * q_[i];
      });
      precondition(r_, z_);
      rho = dot(r_, z_);
      report.reduction = std::sqrt(std::max(rho, 0.0) / start);
      if (!(rho > 0) || report.reduction <= options.tolerance) {
        report.converged = true;
        return report;
      }
    }
  }
  if (!begun) x.assign(n, Float4{});
  p_ = z_;
  while (report.iterations < options.max_iterations) {
    multiply(matrix, terms, p_, q_);
    const double curvature = dot(p_, q_);
    if (!(curvature > 0)) {  // rounding has used up the search space, or the matrix bends down this way
      if (report.iterations == 0 && !begun) x = p_;
      break;
    }
    const Float4 alpha = splat(static_cast<float>(rho / curvature));
    parallel_for(n, grain, [&](std::size_t i) {
      x[i] += alpha * p_[i];
      r_[i] -= alpha * q_[i];
    });
    precondition(r_, z_);
    const double next = dot(r_, z_);
    ++report.iterations;
    report.reduction = std::sqrt(std::max(next, 0.0) / start);
    if (report.reduction <= options.tolerance) {
      report.converged = true;
      break;
    }
    if (!(next > 0)) break;
    const Float4 beta = splat(static_cast<float>(next / rho));
    rho = next;
    parallel_for(n, grain, [&](std::size_t i) { p_[i] = z_[i] + beta * p_[i]; });
  }
  return report;
}

}  // namespace toile::dynamics
