// Meshes that the contact tests and the contact benchmark share.
#pragma once

#include "toile/mesh/types.h"

#include <cmath>
#include <functional>
#include <numbers>

namespace toile::test {

struct Shape {
  mesh::Points3 x;
  mesh::Triangles faces;
};

/// n x m vertices over [0, w] x [0, h], alternating diagonals, lifted into space by `place`.
inline Shape sheet(int n, int m, double w, double h, const std::function<Eigen::Vector3d(double, double)>& place) {
  Shape s;
  s.x.resize(n * m, 3);
  s.faces.resize(2 * (n - 1) * (m - 1), 3);
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < n; ++i) s.x.row(j * n + i) = place(w * i / (n - 1), h * j / (m - 1)).transpose();
  }
  int f = 0;
  for (int j = 0; j + 1 < m; ++j) {
    for (int i = 0; i + 1 < n; ++i) {
      const int a = j * n + i, b = a + 1, c = a + n + 1, d = a + n;
      if ((i + j) & 1) {
        s.faces.row(f++) << a, b, d;
        s.faces.row(f++) << b, c, d;
      } else {
        s.faces.row(f++) << a, b, c;
        s.faces.row(f++) << a, c, d;
      }
    }
  }
  return s;
}

/// UV ellipsoid, poles on z, outward.
inline Shape ellipsoid(const Eigen::Vector3d& axes, const Eigen::Vector3d& centre, int rings, int segments) {
  Shape s;
  s.x.resize(rings * segments + 2, 3);
  s.faces.resize(2 * rings * segments, 3);
  s.x.row(0) = (centre + Eigen::Vector3d(0, 0, axes[2])).transpose();
  for (int r = 1; r <= rings; ++r) {
    const double theta = std::numbers::pi * r / (rings + 1);
    for (int k = 0; k < segments; ++k) {
      const double phi = 2 * std::numbers::pi * k / segments;
      const Eigen::Vector3d unit(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      s.x.row(1 + (r - 1) * segments + k) = (centre + axes.cwiseProduct(unit)).transpose();
    }
  }
  const int last = rings * segments + 1;
  s.x.row(last) = (centre - Eigen::Vector3d(0, 0, axes[2])).transpose();
  int f = 0;
  for (int k = 0; k < segments; ++k) s.faces.row(f++) << 0, 1 + k, 1 + (k + 1) % segments;
  for (int r = 0; r + 1 < rings; ++r) {
    for (int k = 0; k < segments; ++k) {
      const int a = 1 + r * segments + k, b = 1 + r * segments + (k + 1) % segments;
      s.faces.row(f++) << a, a + segments, b + segments;
      s.faces.row(f++) << a, b + segments, b;
    }
  }
  const int base = 1 + (rings - 1) * segments;
  for (int k = 0; k < segments; ++k) s.faces.row(f++) << last, base + (k + 1) % segments, base + k;
  return s;
}

/// Axis-aligned block, outward: sharp edges and corners, large faces.
inline Shape block(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Shape s;
  s.x.resize(8, 3);
  for (int i = 0; i < 8; ++i) s.x.row(i) << (i & 1 ? high[0] : low[0]), (i & 2 ? high[1] : low[1]), (i & 4 ? high[2] : low[2]);
  s.faces.resize(12, 3);
  s.faces << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5;
  return s;
}

/// Both shapes in one list; the second's ids follow the first's.
inline Shape joined(const Shape& a, const Shape& b) {
  Shape s;
  s.x.resize(a.x.rows() + b.x.rows(), 3);
  s.x << a.x, b.x;
  s.faces.resize(a.faces.rows() + b.faces.rows(), 3);
  s.faces << a.faces, (b.faces.array() + static_cast<int>(a.x.rows())).matrix();
  return s;
}

}  // namespace toile::test
