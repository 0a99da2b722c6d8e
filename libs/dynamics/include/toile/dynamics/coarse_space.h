// The second level of the preconditioner: patches of the cloth that move as rigid bodies.
#pragma once

#include "toile/mechanics/block_matrix.h"
#include "toile/mesh/types.h"

#include <array>
#include <memory>
#include <vector>

namespace toile::dynamics {

using mechanics::Block;
using mechanics::BlockMatrix;
using mechanics::Float4;

/// A positive semidefinite contribution w w^T (x) block on a few nodes: a contact between nodes that the sheet does not
/// couple.
struct ContactTerm {
  std::array<int, 4> node{-1, -1, -1, -1};  ///< -1: unused
  std::array<float, 4> weight{};
  Block block;
};

/// Rigid motions of patches of neighbouring nodes with the Galerkin matrix on them, factored: a correction that reaches
/// across the whole garment, where an incomplete factor only reaches a few cells. Soft cloth bends rather than stretches, so that
/// patches which turn and shift are near its slow motions. Source: docs/bibliography.md#vanek1996
class CoarseSpace {
 public:
  CoarseSpace();
  ~CoarseSpace();
  CoarseSpace(CoarseSpace&&) noexcept;
  CoarseSpace& operator=(CoarseSpace&&) noexcept;

  /// Patches are chosen at the first call and kept.
  /// matrix, terms  their sum A is positive definite
  /// x              node positions, |rows| x 3 [m]
  /// fixed          nodes that do not move, |rows|
  void factor(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const mesh::Points3& x, const std::vector<char>& fixed);
  /// Solves P^T A P c = P^T r, P the rigid motions of the patches.
  void solve(const std::vector<Float4>& r);
  /// The part of P c that belongs to a node, after solve().
  Float4 correction(std::size_t node) const;
  int patches() const;
  /// Whether factor() has been called for a matrix of this size.
  bool fits(const BlockMatrix& matrix) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace toile::dynamics
