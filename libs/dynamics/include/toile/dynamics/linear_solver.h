// Preconditioned conjugate gradients on block matrices with contact terms. Sums run over fixed chunks: the same result at
// any thread count.
#pragma once

#include "toile/dynamics/coarse_space.h"
#include "toile/mechanics/block_matrix.h"

#include <array>
#include <vector>

namespace toile::dynamics {

using mechanics::Block;
using mechanics::BlockMatrix;
using mechanics::Float4;

struct SolveOptions {
  double tolerance = 1e-2;  ///< on the preconditioned residual, relative to its start [1]
  int max_iterations = 400;
  bool from_x = false;      ///< begin with the best multiple of what x holds instead of zero; the tolerance stays relative to zero's residual
};

struct SolveReport {
  int iterations = 0;
  double reduction = 1;  ///< reached [1]
  bool converged = false;
};

/// Whether the coarse space gets a factor of its own or that of an earlier, similar matrix serves.
enum class Coarse { anew, kept };

/// Keeps scratch memory between calls. Precondition of solve: matrix + terms positive definite.
class LinearSolver {
 public:
  /// Prepares the preconditioner. Diagonal blocks of the terms are taken in.
  /// x      where the matrix was taken, |rows| x 3 [m]
  /// fixed  nodes that do not move, |rows|
  void factor(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const mesh::Points3& x, const std::vector<char>& fixed, Coarse coarse = Coarse::anew);
  /// matrix * x = b. matrix and terms as in factor().
  SolveReport solve(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const std::vector<Float4>& b, std::vector<Float4>& x, const SolveOptions& options);

 private:
  bool factor_domain(const BlockMatrix& matrix, std::size_t domain, double shift);
  void precondition(const std::vector<Float4>& r, std::vector<Float4>& z);
  void multiply(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const std::vector<Float4>& x, std::vector<Float4>& y);

  std::vector<Block> diagonal_;  // of matrix and terms together
  std::vector<Block> inverse_;   // pivots, inverted
  std::vector<int> domain_start_;
  std::vector<int> row_start_, column_;
  std::vector<Block> lower_;
  std::vector<int> node_term_start_, node_term_;
  CoarseSpace coarse_;
  std::vector<Float4> term_force_, r_, z_, p_, q_;
};

}  // namespace toile::dynamics
