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
    const Block p = Block{{column[0] * x, column[1] * x, column[2] * x}}.transposed();
    return p.column[0] + p.column[1] + p.column[2];
  }
  Block transposed() const {
    const Float4 low = __builtin_shufflevector(column[0], column[1], 0, 4, 1, 5), high = __builtin_shufflevector(column[0], column[1], 2, 6, 3, 7);
    return {{__builtin_shufflevector(low, column[2], 0, 1, 4, 7), __builtin_shufflevector(low, column[2], 2, 3, 5, 7), __builtin_shufflevector(high, column[2], 0, 1, 6, 7)}};
  }
  Block& operator+=(const Block& other) {
    for (int c = 0; c < 3; ++c) column[c] += other.column[c];
    return *this;
  }
  static Block identity(float factor) { return {{Float4{factor, 0, 0, 0}, Float4{0, factor, 0, 0}, Float4{0, 0, factor, 0}}}; }
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
