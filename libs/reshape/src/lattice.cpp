// Free-form lattices: trivariate Bernstein polynomials (docs/bibliography.md#sederberg1986) or uniform cubic B-splines.
#include "toile/reshape/deform.h"

#include <Eigen/LU>
#include <cmath>

namespace toile::reshape {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

struct Value {
  double value = 0, slope = 0;  ///< slope by the coordinate [1/m]
};

Value bspline(double t, double h) {
  const double a = std::abs(t);
  if (a >= 2) return {};
  const double sign = t < 0 ? -1 : 1;
  if (a >= 1) return {(2 - a) * (2 - a) * (2 - a) / 6, -sign * (2 - a) * (2 - a) / 2 / h};
  return {2.0 / 3 - a * a + a * a * a / 2, sign * (-2 * a + 1.5 * a * a) / h};
}

/// Bernstein polynomial i of degree n at u in [0, 1].
double bernstein(int n, int i, double u) {
  if (i < 0 || i > n) return 0;
  double value = 1;
  for (int k = 1; k <= i; ++k) value *= static_cast<double>(n - i + k) / k;
  return value * std::pow(u, i) * std::pow(1 - u, n - i);
}

Value weight(const LatticeSpec& lattice, std::size_t axis, int node, double p) {
  const double size = lattice.high[axis] - lattice.low[axis];
  const int n = lattice.cells[axis];
  if (lattice.basis == Basis::bspline) return bspline((p - lattice.low[axis]) / size * n - node, size / n);
  const double u = (p - lattice.low[axis]) / size;
  if (u < 0 || u > 1) return {};
  return {bernstein(n, node, u), n * (bernstein(n - 1, node - 1, u) - bernstein(n - 1, node, u)) / size};
}

Vector3d displacement(const LatticeSpec& lattice, const Vector3d& p) {
  Vector3d d = Vector3d::Zero();
  for (const LatticeOffset& offset : lattice.offsets) {
    double w = 1;
    for (std::size_t k = 0; k < 3 && w != 0; ++k) w *= weight(lattice, k, offset.node[k], p[static_cast<Eigen::Index>(k)]).value;
    if (w != 0) d += w * Vector3d(offset.by[0], offset.by[1], offset.by[2]);
  }
  return d;
}

}  // namespace

Points3 lattice_displacement(const LatticeSpec& lattice, const Points3& points) {
  Points3 d(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) d.row(i) = displacement(lattice, points.row(i)).transpose();
  return d;
}

LatticeFold least_determinant(const LatticeSpec& lattice) {
  LatticeFold least;
  std::array<std::vector<double>, 3> samples;
  for (std::size_t k = 0; k < 3; ++k) {
    const int around = lattice.basis == Basis::bspline ? 2 : 0;  // as far as the outermost nodes reach
    const int per_cell = 8, from = -around * per_cell, to = (lattice.cells[k] + around) * per_cell;
    for (int i = from; i <= to; ++i) samples[k].push_back(lattice.low[k] + (lattice.high[k] - lattice.low[k]) * i / (per_cell * lattice.cells[k]));
  }
  // Values once per axis, node and sample.
  std::array<std::vector<std::vector<Value>>, 3> table;
  for (std::size_t k = 0; k < 3; ++k) {
    for (int node = 0; node <= lattice.cells[k]; ++node) {
      auto& row = table[k].emplace_back();
      for (const double p : samples[k]) row.push_back(weight(lattice, k, node, p));
    }
  }
  for (std::size_t i = 0; i < samples[0].size(); ++i) {
    for (std::size_t j = 0; j < samples[1].size(); ++j) {
      for (std::size_t l = 0; l < samples[2].size(); ++l) {
        Matrix3d gradient = Matrix3d::Identity();
        for (const LatticeOffset& offset : lattice.offsets) {
          const Value a = table[0][static_cast<std::size_t>(offset.node[0])][i], b = table[1][static_cast<std::size_t>(offset.node[1])][j],
                      c = table[2][static_cast<std::size_t>(offset.node[2])][l];
          gradient += Vector3d(offset.by[0], offset.by[1], offset.by[2]) *
                      Eigen::RowVector3d(a.slope * b.value * c.value, a.value * b.slope * c.value, a.value * b.value * c.slope);
        }
        const double determinant = gradient.determinant();
        if (determinant < least.determinant) least = {determinant, Vector3d(samples[0][i], samples[1][j], samples[2][l])};
      }
    }
  }
  return least;
}

}  // namespace toile::reshape
