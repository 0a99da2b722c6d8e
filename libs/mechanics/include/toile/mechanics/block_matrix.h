// Symmetric sparse matrices of 3x3 blocks in single precision, for preconditioned iterations: gradients and energies stay
// double, a search direction does not need more.
#pragma once

#include <Eigen/Core>
#include <cstring>
#include <vector>

namespace toile::mechanics {

/// Four floats that the compiler keeps in one register; the last one is padding.
using Float4 = float __attribute__((vector_size(16)));

inline Float4 splat(float value) { return Float4{value, value, value, value}; }
inline Float4 load3(const double* p) { return Float4{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0.0f}; }

/// A 3x3 block, by columns.
struct Block {
  Float4 column[3];
  Float4 operator*(Float4 x) const { return column[0] * splat(x[0]) + column[1] * splat(x[1]) + column[2] * splat(x[2]); }
  /// Product with the transpose.
  Float4 transposed_times(Float4 x) const {
    const Float4 a = column[0] * x, b = column[1] * x, c = column[2] * x;
    return Float4{a[0] + a[1] + a[2], b[0] + b[1] + b[2], c[0] + c[1] + c[2], 0.0f};
  }
  static Block zero() { return {{Float4{}, Float4{}, Float4{}}}; }
  static Block from(const Eigen::Matrix3d& m) { return {{load3(m.data()), load3(m.data() + 3), load3(m.data() + 6)}}; }
  Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m;
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) m(r, c) = column[c][r];
    }
    return m;
  }
};

/// Rows of blocks; both triangles of the symmetric matrix are stored, columns increase within a row.
struct BlockMatrix {
  std::vector<int> row_start;  ///< |rows| + 1
  std::vector<int> column;
  std::vector<int> diagonal;   ///< index of each row's diagonal block
  std::vector<Block> value;
  int rows() const { return static_cast<int>(row_start.size()) - 1; }
};

}  // namespace toile::mechanics
