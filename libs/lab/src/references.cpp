#include "toile/lab/references.h"

#include "toile/base/result.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace toile::lab {
namespace {

using std::numbers::pi;

/// Root of an increasing function by halving.
double root(double low, double high, const std::function<double(double)>& f) {
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (f(middle) < 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// State along the strip from its free end: angle to the vertical, moment L/B, drop, reach.
using State = std::array<double, 4>;

State fall(double gamma, double eta, double start, int steps) {
  State y{start, 0, 0, 0};
  const double h = 1.0 / steps;
  const auto slope = [&](double t, const State& s) {
    return State{std::max(0.0, s[1] - eta), gamma * t * std::sin(s[0]), std::cos(s[0]), std::sin(s[0])};
  };
  const auto along = [](const State& s, const State& k, double f) {
    State r = s;
    for (std::size_t i = 0; i < 4; ++i) r[i] += f * k[i];
    return r;
  };
  for (int i = 0; i < steps && y[0] < pi; ++i) {
    const double t = i * h;
    const State a = slope(t, y), b = slope(t + 0.5 * h, along(y, a, 0.5 * h)), c = slope(t + 0.5 * h, along(y, b, 0.5 * h)), d = slope(t + h, along(y, c, h));
    for (std::size_t k = 0; k < 4; ++k) y[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
  }
  return y;
}

/// Orthonormal-ish basis on [-1, 1]: Legendre polynomials and two derivatives.
struct Legendre {
  std::vector<double> value, first, second;
  Legendre(int count, double x) : value(static_cast<std::size_t>(count)), first(value), second(value) {
    for (int n = 0; n < count; ++n) {
      const auto k = static_cast<std::size_t>(n);
      if (n == 0) {
        value[0] = 1;
      } else if (n == 1) {
        value[1] = x;
        first[1] = 1;
      } else {
        const double a = (2.0 * n - 1) / n, b = (n - 1.0) / n;
        value[k] = a * x * value[k - 1] - b * value[k - 2];
        first[k] = a * (value[k - 1] + x * first[k - 1]) - b * first[k - 2];
        second[k] = a * (2 * first[k - 1] + x * second[k - 1]) - b * second[k - 2];
      }
    }
  }
};

/// Gauss-Legendre points and weights on [-1, 1].
std::vector<std::array<double, 2>> gauss(int count) {
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(count, count);
  for (int i = 1; i < count; ++i) jacobi(i, i - 1) = jacobi(i - 1, i) = i / std::sqrt(4.0 * i * i - 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(jacobi);
  std::vector<std::array<double, 2>> rule;
  for (int i = 0; i < count; ++i) rule.push_back({solver.eigenvalues()[i], 2 * solver.eigenvectors()(0, i) * solver.eigenvectors()(0, i)});
  return rule;
}

}  // namespace

Cantilever cantilever(double gamma, double eta) {
  TOILE_CHECK(gamma > 0 && gamma <= 5000 && eta >= 0, "gamma {}, eta {}", gamma, eta);
  // Half of gamma is the moment at the clamp of a straight strip: below eta nothing bends.
  if (0.5 * gamma <= eta) return {0, 1};
  constexpr int steps = 2000;
  // The angle at the free end, as a logarithm since it becomes exp(-sqrt(gamma)) small.
  const double start = root(std::log(0.5 * pi) - 3 * std::sqrt(gamma) - 1, std::log(0.5 * pi), [&](double x) { return fall(gamma, eta, std::exp(x), steps)[0] - 0.5 * pi; });
  const State end = fall(gamma, eta, std::exp(start), steps);
  return {end[2], end[3]};
}

Cantilever loaded_cantilever(double gamma, double eta, int steps) {
  TOILE_CHECK(gamma > 0 && gamma <= 1000 && eta >= 0 && steps >= 1, "gamma {}, eta {}, steps {}", gamma, eta, steps);
  // Link i makes the angle t[i] with the level; joint i is before it, the first has half a link of strip. What hangs beyond the middle of
  // a link turns it, so the energy of the weight is a sum over links.
  constexpr int links = 400;
  constexpr double h = 1.0 / links, stiffness = 1000;
  const double open = eta / stiffness;
  std::vector<double> angle(links, 0.0), anchor(links, 0.0);
  const auto part = [](int i) { return i == 0 ? 0.5 * h : h; };
  const auto curvature = [&](const std::vector<double>& t, int i) { return (t[static_cast<std::size_t>(i)] - (i == 0 ? 0 : t[static_cast<std::size_t>(i - 1)])) / part(i); };
  for (int k = 1; k <= steps; ++k) {
    const auto weight = [&](int i) { return gamma * k / steps * (1 - (i + 0.5) * h) * h; };
    const auto energy = [&](const std::vector<double>& t) {
      double sum = 0;
      for (int i = 0; i < links; ++i) {
        const double c = curvature(t, i), d = std::abs(c - anchor[static_cast<std::size_t>(i)]);
        sum += part(i) * (0.5 * c * c + (d <= open ? 0.5 * stiffness * d * d : eta * (d - 0.5 * open))) - weight(i) * std::sin(t[static_cast<std::size_t>(i)]);
      }
      return sum;
    };
    for (int iteration = 0; iteration < 500; ++iteration) {
      // Newton, tridiagonal, the weight's part of the second derivative where it is positive.
      std::vector<double> slope(links, 0.0), diagonal(links, 0.0), beside(links, 0.0), move(links), reduced(links, 0.0);
      for (int i = 0; i < links; ++i) {
        const auto j = static_cast<std::size_t>(i);
        const double c = curvature(angle, i), d = c - anchor[j];
        const bool sticks = std::abs(d) <= open;
        const double moment = c + (sticks ? stiffness * d : d > 0 ? eta : -eta), rigidity = (1 + (sticks ? stiffness : 0)) / part(i);
        slope[j] += moment - weight(i) * std::cos(angle[j]);
        diagonal[j] += rigidity + std::max(0.0, weight(i) * std::sin(angle[j]));
        if (i == 0) continue;
        slope[j - 1] -= moment;
        diagonal[j - 1] += rigidity;
        beside[j] = -rigidity;
      }
      double largest = 0;
      for (const double s : slope) largest = std::max(largest, std::abs(s));
      if (largest < 1e-11 * std::max(1.0, gamma)) break;
      double pivot = diagonal[0];
      move[0] = -slope[0] / pivot;
      for (std::size_t j = 1; j < links; ++j) {
        reduced[j - 1] = beside[j] / pivot;
        pivot = diagonal[j] - beside[j] * reduced[j - 1];
        move[j] = (-slope[j] - beside[j] * move[j - 1]) / pivot;
      }
      for (std::size_t j = links - 1; j-- > 0;) move[j] -= reduced[j] * move[j + 1];
      const double before = energy(angle);
      std::vector<double> trial(links);
      for (double length = 1; length > 1e-9; length *= 0.5) {
        for (std::size_t j = 0; j < links; ++j) trial[j] = angle[j] + length * move[j];
        if (energy(trial) <= before + 1e-14 * std::abs(before)) break;
      }
      angle = trial;
    }
    for (int i = 0; i < links; ++i) {
      const double c = curvature(angle, i);
      double& a = anchor[static_cast<std::size_t>(i)];
      if (std::abs(c - a) > open) a = c > a ? c - open : c + open;
    }
  }
  Cantilever end;
  for (const double t : angle) {
    end.reach += h * std::cos(t);
    end.drop += h * std::sin(t);
  }
  return end;
}

double overhang(double angle, double rho) {
  const double tangent = std::tan(angle);
  return root(1e-2, 12, [&](double l) {
    const Cantilever c = cantilever(l * l * l, rho * l);
    return c.drop - tangent * c.reach;
  });
}

double hang(double weight, double length, double a, double b) {
  if (b == 0) return weight * length * length / (2 * a);
  const double x = weight * length / a;
  return a / (b * weight) * ((1 + x) * std::log1p(x) - x);
}

double tensile_exponent(double linearity) {
  if (linearity >= 1) return 0;
  return root(1e-9, 60, [&](double x) { return linearity - 2 * (1 / x - 1 / std::expm1(x)); });
}

Catenary catenary(double span, double length, double weight, double stiffness) {
  const double s = 0.5 * length;
  // Half the span of the elastic catenary grows with the pull.
  const double pull = root(1e-9 * weight * length, 1e6 * weight * length, [&](double h) { return h * s / stiffness + h / weight * std::asinh(weight * s / h) - 0.5 * span; });
  const double a = pull / weight;
  return {weight * s * s / (2 * stiffness) + a * (std::sqrt(1 + s * s / (a * a)) - 1), pull};
}

BiasPoint bias_extension(double shear, double height, double width, double stiffness) {
  const double half = 0.5 * shear, c = std::cos(half), s = std::sin(half);
  const auto moment = [&](double g) { return stiffness * g * std::cos(g); };
  // Middle: whole shear on height width - 3/2 width^2; four triangles with half the shear on width^2 together.
  return {(height - width) * (c + s - 1), 2 * ((height * width - 1.5 * width * width) * moment(shear) + 0.5 * width * width * moment(half)) / ((height - width) * (c - s))};
}

double shear_energy(double shear, double stiffness) { return stiffness * (shear * std::sin(shear) + std::cos(shear) - 1); }

double lateral_buckling(double aspect, double twist) {
  // Lengths in units of L: x in [0, 1], y in [-aspect/2, aspect/2]; both mapped to [-1, 1]. The clamp by factors x and x^2.
  const int plate_x = 16, plate_y = 6, plane_x = 14, plane_y = 8;
  const auto points = gauss(36), across = gauss(14);
  const double jacobian = 0.25 * aspect, along = 2, over = 2 / aspect;
  const double shear = 0.5;  // in-plane G over A11; from 0.02 to 0.5 it moves the result by less than 0.1 %
  // Plane stress under a unit weight per area, membrane stiffness A11 = A22 = 1, A12 = 0.
  const int count = plane_x * plane_y;
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(2 * count, 2 * count);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(2 * count);
  const auto plane_gradients = [&](double px, double py, Eigen::VectorXd& dx, Eigen::VectorXd& dy, Eigen::VectorXd& value) {
    const Legendre lx(plane_x, px), ly(plane_y, py);
    const double x = 0.5 * (px + 1);
    for (int m = 0; m < plane_x; ++m) {
      const auto i = static_cast<std::size_t>(m);
      for (int n = 0; n < plane_y; ++n) {
        const auto j = static_cast<std::size_t>(n);
        const int id = m * plane_y + n;
        value[id] = x * lx.value[i] * ly.value[j];
        dx[id] = (lx.value[i] + x * along * lx.first[i]) * ly.value[j];
        dy[id] = x * lx.value[i] * over * ly.first[j];
      }
    }
  };
  Eigen::VectorXd dx(count), dy(count), value(count);
  for (const auto& [px, wx] : points) {
    for (const auto& [py, wy] : across) {
      plane_gradients(px, py, dx, dy, value);
      const double w = wx * wy * jacobian;
      k.topLeftCorner(count, count) += w * (dx * dx.transpose() + shear * dy * dy.transpose());
      k.bottomRightCorner(count, count) += w * (dy * dy.transpose() + shear * dx * dx.transpose());
      k.topRightCorner(count, count) += w * shear * dy * dx.transpose();
      f.tail(count) -= w * value;
    }
  }
  k.bottomLeftCorner(count, count) = k.topRightCorner(count, count).transpose();
  const Eigen::VectorXd displacement = k.ldlt().solve(f);
  // Plate: bending against what the membrane forces do on its slopes.
  const int size = plate_x * plate_y;
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(size, size), geometric = stiffness;
  Eigen::VectorXd gx(size), gy(size), xx(size), yy(size), xy(size);
  for (const auto& [px, wx] : points) {
    for (const auto& [py, wy] : across) {
      plane_gradients(px, py, dx, dy, value);
      const double nx = dx.dot(displacement.head(count)), ny = dy.dot(displacement.tail(count));
      const double nxy = shear * (dy.dot(displacement.head(count)) + dx.dot(displacement.tail(count)));
      const Legendre lx(plate_x, px), ly(plate_y, py);
      const double x = 0.5 * (px + 1);
      for (int m = 0; m < plate_x; ++m) {
        const auto i = static_cast<std::size_t>(m);
        const double fv = x * x * lx.value[i], f1 = 2 * x * lx.value[i] + x * x * along * lx.first[i];
        const double f2 = 2 * lx.value[i] + 4 * x * along * lx.first[i] + x * x * along * along * lx.second[i];
        for (int n = 0; n < plate_y; ++n) {
          const auto j = static_cast<std::size_t>(n);
          const int id = m * plate_y + n;
          gx[id] = f1 * ly.value[j];
          gy[id] = fv * over * ly.first[j];
          xx[id] = f2 * ly.value[j];
          yy[id] = fv * over * over * ly.second[j];
          xy[id] = f1 * over * ly.first[j];
        }
      }
      const double w = wx * wy * jacobian;
      stiffness += w * (xx * xx.transpose() + yy * yy.transpose() + 4 * twist * xy * xy.transpose());
      geometric -= w * (nx * gx * gx.transpose() + ny * gy * gy.transpose() + nxy * (gx * gy.transpose() + gy * gx.transpose()));
    }
  }
  // geometric a = (1/gamma) stiffness a; the greatest 1/gamma.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(geometric, stiffness, Eigen::EigenvaluesOnly);
  return 1 / solver.eigenvalues().maxCoeff();
}

std::vector<StickPoint> stick_slip(double gamma) {
  // theta'' = -H cos theta - (P - gamma (1 - s)) sin theta from the clamp, theta(0) = 0, theta'(0) = k. Unknown P and H make
  // theta'(1) = 0 and x(1) = 0 for each k.
  constexpr int steps = 2000;
  struct End {
    double slope = 0, x = 0, height = 0, theta = 0;
  };
  const auto shoot = [&](double k, double push, double side) {
    std::array<double, 4> y{0, k, 0, 0};
    const double h = 1.0 / steps;
    const auto slope = [&](double s, const std::array<double, 4>& v) {
      return std::array<double, 4>{v[1], -side * std::cos(v[0]) - (push - gamma * (1 - s)) * std::sin(v[0]), std::sin(v[0]), std::cos(v[0])};
    };
    const auto plus = [](std::array<double, 4> v, const std::array<double, 4>& d, double f) {
      for (std::size_t i = 0; i < 4; ++i) v[i] += f * d[i];
      return v;
    };
    for (int i = 0; i < steps; ++i) {
      const double s = i * h;
      const auto a = slope(s, y), b = slope(s + 0.5 * h, plus(y, a, 0.5 * h)), c = slope(s + 0.5 * h, plus(y, b, 0.5 * h)), d = slope(s + h, plus(y, c, h));
      for (std::size_t n = 0; n < 4; ++n) y[n] += h / 6 * (a[n] + 2 * b[n] + 2 * c[n] + d[n]);
    }
    return End{y[1], y[2], y[3], y[0]};
  };
  std::vector<StickPoint> curve;
  double push = 4.493409457909064 * 4.493409457909064 + 0.5 * gamma, side = 0;
  double before_push = push, before_side = side, step_size = 0.02;
  for (double k = 0.02; k < 12; k += step_size) {
    if (curve.empty()) side = -k;
    for (int i = 0; i < 30; ++i) {
      const End e = shoot(k, push, side);
      const double dp = 1e-6 * push, dh = 1e-6 * std::max(1.0, std::abs(side));
      const End p = shoot(k, push + dp, side), q = shoot(k, push, side + dh);
      Eigen::Matrix2d j;
      j << (p.slope - e.slope) / dp, (q.slope - e.slope) / dh, (p.x - e.x) / dp, (q.x - e.x) / dh;
      const Eigen::Vector2d step = j.fullPivLu().solve(Eigen::Vector2d(-e.slope, -e.x));
      push += step[0];
      side += step[1];
      if (step.norm() < 1e-10 * push) break;
    }
    const End e = shoot(k, push, side);
    if (!std::isfinite(push) || std::abs(e.x) > 1e-6 || std::abs(e.slope) > 1e-5) break;
    if (std::abs(e.theta) >= 0.5 * pi) {
      // Flat on the plane: from there on it touches along a line. Up to that angle in smaller steps.
      if (step_size < 1e-4) break;
      k -= step_size;
      step_size *= 0.25;
      push = before_push;
      side = before_side;
      continue;
    }
    curve.push_back({1 - e.height, std::abs(side) / push, push});
    before_push = push;
    before_side = side;
    if (k > 0.2 && step_size == 0.02) step_size = 0.05;
  }
  return curve;
}

}  // namespace toile::lab
