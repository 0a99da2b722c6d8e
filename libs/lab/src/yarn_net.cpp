// Bias extension of a net whose yarns stretch: squares of yarn pinned at their crossings, in the limit of fine squares.
#include "toile/lab/references.h"

#include "toile/base/result.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace toile::lab {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A quarter of the strip: half the length along x, the middle of the strip at 0, half the width along y. Points at (p, q) times half a
/// diagonal of the yarns' squares, p + q even; G and half the width are 1.
struct Net {
  int columns = 0, rows = 0;
  double half_diagonal = 0;
  std::vector<std::array<int, 2>> at;       // p, q of each point
  std::vector<int> index;                   // of p, q or -1
  struct Yarn {
    int a, b;
    double area;  // rest area whose stretch it carries
  };
  struct Crossing {
    int middle, first, second;  // angle between the yarns from `middle` to the others
    double area;
    double sign;  // +1: they open along x
  };
  std::vector<Yarn> yarns;
  std::vector<Crossing> crossings;

  Net(int p, int q) : columns(p), rows(q), half_diagonal(1.0 / q) {
    index.assign(static_cast<std::size_t>((p + 1) * (q + 1)), -1);
    for (int i = 0; i <= p; ++i) {
      for (int j = 0; j <= q; ++j) {
        if ((i + j) % 2 != 0) continue;
        index[static_cast<std::size_t>(i * (q + 1) + j)] = static_cast<int>(at.size());
        at.push_back({i, j});
      }
    }
    const double square = 2 * half_diagonal * half_diagonal;
    for (int i = 0; i <= p; ++i) {
      for (int j = 0; j <= q; ++j) {
        if ((i + j) % 2 == 0) continue;
        // The square around (i, j): left, right, below, above it; half of it at a border.
        const std::array<int, 4> c{point(i - 1, j), point(i + 1, j), point(i, j - 1), point(i, j + 1)};
        for (int side = 0; side < 2; ++side) {
          for (int other = 2; other < 4; ++other) {
            const int a = c[static_cast<std::size_t>(side)], b = c[static_cast<std::size_t>(other)];
            if (a >= 0 && b >= 0) yarns.push_back({a, b, 0.5 * square});
          }
        }
        const bool whole = std::all_of(c.begin(), c.end(), [](int n) { return n >= 0; });
        const double part = whole ? 0.25 * square : 0.5 * square;
        if (c[2] >= 0 && c[3] >= 0) {
          for (int side = 0; side < 2; ++side) {
            if (c[static_cast<std::size_t>(side)] >= 0) crossings.push_back({c[static_cast<std::size_t>(side)], c[2], c[3], part, 1});
          }
        }
        if (c[0] >= 0 && c[1] >= 0) {
          for (int side = 2; side < 4; ++side) {
            if (c[static_cast<std::size_t>(side)] >= 0) crossings.push_back({c[static_cast<std::size_t>(side)], c[0], c[1], part, -1});
          }
        }
      }
    }
  }
  int point(int i, int j) const { return i < 0 || j < 0 || i > columns || j > rows ? -1 : index[static_cast<std::size_t>(i * (rows + 1) + j)]; }
};

struct Response {
  double energy = 0;
  Eigen::VectorXd gradient;
  std::vector<Eigen::Triplet<double>> hessian;
};

Response respond(const Net& net, const Eigen::VectorXd& x, double ratio, bool with_hessian) {
  Response r;
  r.gradient = Eigen::VectorXd::Zero(x.size());
  const double length = net.half_diagonal * std::sqrt(2.0);
  const auto put = [&](int i, int j, const Matrix2d& m, double sign) {
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) r.hessian.emplace_back(2 * i + a, 2 * j + b, sign * m(a, b));
    }
  };
  for (const Net::Yarn& yarn : net.yarns) {
    const Vector2d d = (x.segment<2>(2 * yarn.b) - x.segment<2>(2 * yarn.a)) / length;
    const double stretch = d.norm(), strain = stretch - 1;
    const Vector2d along = d / stretch, force = yarn.area * ratio * strain / length * along;
    r.energy += 0.5 * yarn.area * ratio * strain * strain;
    r.gradient.segment<2>(2 * yarn.b) += force;
    r.gradient.segment<2>(2 * yarn.a) -= force;
    if (!with_hessian) continue;
    const Matrix2d outer = along * along.transpose();
    const Matrix2d h = yarn.area * ratio / (length * length) * (outer + std::max(strain / stretch, 0.0) * (Matrix2d::Identity() - outer));
    put(yarn.a, yarn.a, h, 1);
    put(yarn.b, yarn.b, h, 1);
    put(yarn.a, yarn.b, h, -1);
    put(yarn.b, yarn.a, h, -1);
  }
  for (const Net::Crossing& c : net.crossings) {
    const Vector2d b = x.segment<2>(2 * c.first) - x.segment<2>(2 * c.middle), d = x.segment<2>(2 * c.second) - x.segment<2>(2 * c.middle);
    const double lb = b.norm(), ld = d.norm();
    const Vector2d ub = b / lb, ud = d / ld;
    const double s = ub.dot(ud), angle = std::asin(std::clamp(s, -1.0, 1.0));
    r.energy += c.area * (s * angle + std::sqrt(std::max(0.0, 1 - s * s)) - 1);
    const Vector2d by_b = (ud - s * ub) / lb, by_d = (ub - s * ud) / ld;
    const double force = c.area * angle;
    r.gradient.segment<2>(2 * c.first) += force * by_b;
    r.gradient.segment<2>(2 * c.second) += force * by_d;
    r.gradient.segment<2>(2 * c.middle) -= force * (by_b + by_d);
    if (!with_hessian) continue;
    const double slope = c.area / std::sqrt(std::max(1e-6, 1 - s * s));
    const Matrix2d one = Matrix2d::Identity(), bb = ub * ub.transpose(), dd = ud * ud.transpose(), bd = ub * ud.transpose();
    const Matrix2d h_bb = slope * by_b * by_b.transpose() + force / (lb * lb) * (-bd - bd.transpose() - s * one + 3 * s * bb);
    const Matrix2d h_dd = slope * by_d * by_d.transpose() + force / (ld * ld) * (-bd - bd.transpose() - s * one + 3 * s * dd);
    const Matrix2d h_bd = slope * by_b * by_d.transpose() + force / (lb * ld) * (one - bb) * (one - dd);
    put(c.first, c.first, h_bb, 1);
    put(c.second, c.second, h_dd, 1);
    put(c.first, c.second, h_bd, 1);
    put(c.second, c.first, h_bd.transpose(), 1);
    put(c.first, c.middle, h_bb + h_bd, -1);
    put(c.middle, c.first, (h_bb + h_bd).transpose(), -1);
    put(c.second, c.middle, h_dd + h_bd.transpose(), -1);
    put(c.middle, c.second, (h_dd + h_bd.transpose()).transpose(), -1);
    put(c.middle, c.middle, h_bb + h_dd + h_bd + h_bd.transpose(), 1);
  }
  return r;
}

/// Forces at these extensions, in units of G times the width; `rows` squares of yarn between the middle and the edge of the strip.
std::vector<double> forces(const std::vector<double>& extensions, double aspect, double ratio, int rows) {
  const Net net(static_cast<int>(std::lround(aspect * rows / 2)) * 2, rows);
  const auto count = static_cast<Eigen::Index>(net.at.size());
  Eigen::VectorXd x(2 * count);
  std::vector<Eigen::Index> place(static_cast<std::size_t>(2 * count), -1);
  Eigen::Index unknowns = 0;
  std::vector<int> jaw;
  const double unit_x = aspect / net.columns;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto [p, q] = net.at[static_cast<std::size_t>(i)];
    x.segment<2>(2 * i) = Vector2d(unit_x * p, net.half_diagonal * q);
    if (p == net.columns) jaw.push_back(static_cast<int>(i));
    if (p != 0 && p != net.columns) place[static_cast<std::size_t>(2 * i)] = unknowns++;
    if (q != 0 && p != net.columns) place[static_cast<std::size_t>(2 * i + 1)] = unknowns++;
  }
  std::vector<double> result;
  double before = 0;
  for (const double extension : extensions) {
    // The last shape, stretched along to begin with.
    for (Eigen::Index i = 0; i < count; ++i) x[2 * i] *= (aspect + 0.5 * extension) / (aspect + 0.5 * before);
    before = extension;
    Response r = respond(net, x, ratio, true);
    for (int iteration = 0; iteration < 100; ++iteration) {
      std::vector<Eigen::Triplet<double>> entries;
      Eigen::VectorXd right(unknowns);
      for (const auto& t : r.hessian) {
        const Eigen::Index a = place[static_cast<std::size_t>(t.row())], b = place[static_cast<std::size_t>(t.col())];
        if (a >= 0 && b >= 0) entries.emplace_back(static_cast<int>(a), static_cast<int>(b), t.value());
      }
      for (Eigen::Index k = 0; k < 2 * count; ++k) {
        if (place[static_cast<std::size_t>(k)] >= 0) right[place[static_cast<std::size_t>(k)]] = -r.gradient[k];
      }
      Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
      matrix.setFromTriplets(entries.begin(), entries.end());
      const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
      Eigen::VectorXd step = solver.solve(right);
      if (step.dot(right) < 0) step = right / ratio;  // not downhill: along the force
      double factor = 1;
      Eigen::VectorXd trial = x;
      for (int halving = 0; halving < 30; ++halving, factor *= 0.5) {
        for (Eigen::Index k = 0; k < 2 * count; ++k) {
          if (place[static_cast<std::size_t>(k)] >= 0) trial[k] = x[k] + factor * step[place[static_cast<std::size_t>(k)]];
        }
        if (respond(net, trial, ratio, false).energy <= r.energy - 1e-4 * factor * step.dot(right) + 1e-14 * std::abs(r.energy)) break;
      }
      x = trial;
      r = respond(net, x, ratio, true);
      if (factor * step.cwiseAbs().maxCoeff() < 1e-10) break;
    }
    double pull = 0;
    for (const int i : jaw) pull += r.gradient[2 * i];
    result.push_back(pull);  // of half the width, in units of G times half the width
  }
  return result;
}

}  // namespace

std::vector<double> bias_extension_of_yarns(const std::vector<double>& extensions, double height, double width, double ratio) {
  TOILE_CHECK(height >= 2 * width && ratio > 0, "height {}, width {}, ratio {}", height, width, ratio);
  std::vector<double> scaled;
  for (const double e : extensions) scaled.push_back(2 * e / width);
  // The error is that of layers beside the yarns from the corners, of first order in the squares.
  const std::vector<double> coarse = forces(scaled, height / width, ratio, 16);
  std::vector<double> fine = forces(scaled, height / width, ratio, 32);
  for (std::size_t i = 0; i < fine.size(); ++i) fine[i] = 2 * fine[i] - coarse[i];
  return fine;
}

}  // namespace toile::lab
