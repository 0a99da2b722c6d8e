#include "toile/mechanics/membrane.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace toile::mechanics {
namespace {

// A yarn squeezed to nothing has no direction: lengths below this are treated as this [1].
constexpr double least_stretch = 1e-3;

struct Frame {
  double weft_length, warp_length;     // [1]
  Eigen::Vector3d weft, warp;          // unit directions
  double sine;                         // of the shear angle
};

Frame frame_of(const YarnGradient& gradient) {
  Frame frame;
  frame.weft_length = std::max(gradient.weft.norm(), least_stretch);
  frame.warp_length = std::max(gradient.warp.norm(), least_stretch);
  frame.weft = gradient.weft / frame.weft_length;
  frame.warp = gradient.warp / frame.warp_length;
  frame.sine = std::clamp(frame.weft.dot(frame.warp), -1.0, 1.0);
  return frame;
}

/// True when a symmetric 4x4 is positive semidefinite (up to rounding), by its Cholesky pivots.
bool is_positive(const Eigen::Matrix4d& matrix) {
  Eigen::Matrix4d l = matrix;
  const double tiny = 1e-12 * matrix.diagonal().cwiseAbs().maxCoeff();
  for (int k = 0; k < 4; ++k) {
    if (l(k, k) < -tiny) return false;
    if (l(k, k) <= tiny) {
      for (int i = k + 1; i < 4; ++i) {
        if (std::abs(l(i, k)) > tiny) return false;
      }
      continue;
    }
    for (int i = k + 1; i < 4; ++i) {
      const double f = l(i, k) / l(k, k);
      for (int j = k + 1; j <= i; ++j) l(i, j) -= f * l(j, k);
    }
  }
  return true;
}

}  // namespace

double membrane_energy(const fabric::Constitutive& fabric, const YarnGradient& gradient) {
  const Frame f = frame_of(gradient);
  return fabric.weft.at(f.weft_length - 1).energy + fabric.warp.at(f.warp_length - 1).energy + fabric.shear.at(f.sine).energy;
}

YarnState yarn_state(const YarnGradient& gradient) {
  const Frame f = frame_of(gradient);
  return {f.weft_length, f.warp_length, f.sine};
}

MembraneResponse membrane_response(const fabric::Constitutive& fabric, const YarnGradient& gradient, Curvature curvature) {
  const YarnState s = yarn_state(gradient);
  return membrane_response(fabric.weft.at(s.weft - 1), fabric.warp.at(s.warp - 1), fabric.shear.at(s.sine), gradient, curvature);
}

MembraneResponse membrane_response(const fabric::CurvePoint& weft, const fabric::CurvePoint& warp, const fabric::CurvePoint& shear, const YarnGradient& gradient,
                                   Curvature curvature) {
  const Frame f = frame_of(gradient);
  const double l1 = f.weft_length, l2 = f.warp_length, s = f.sine;
  MembraneResponse r;
  r.energy = weft.energy + warp.energy + shear.energy;
  r.stress.weft = weft.force * f.weft + shear.force * (f.warp - s * f.weft) / l1;
  r.stress.warp = warp.force * f.warp + shear.force * (f.weft - s * f.warp) / l2;

  // In the frame (e1 = weft direction, e2 in the plane of the yarns, e3 its normal) the second derivative falls apart into
  // an in-plane 4x4 and a normal 2x2 part.
  const Eigen::Vector3d e1 = f.weft;
  Eigen::Vector3d e2 = f.warp - s * f.weft;
  const double c = e2.norm();
  if (c > 1e-9) {
    e2 /= c;
  } else {
    e2 = e1.unitOrthogonal();
  }
  const Eigen::Vector3d e3 = e1.cross(e2);
  // With the yarns' directions d1 = (1, 0), d2 = (s, c), across them y = (0, 1), q = (-c, s), and the sine's derivatives p1 = (0, c)/l1, p2 = -c q/l2:
  // weft-weft   slope d1 d1 + force/l1 y y + shear.slope p1 p1 - shear.force/l1 (d1 p1 + p1 d1 + s/l1 y y), warp-warp alike,
  // weft-warp   shear.slope p1 p2 + shear.force/(l1 l2) (y q) y q
  const double f1 = shear.force / (l1 * l1), f2 = shear.force / (l2 * l2), f12 = shear.force / (l1 * l2), g12 = shear.slope / (l1 * l2);
  const double c2 = c * c, s2 = s * s, sc = s * c;
  const double across1 = weft.force / l1 - f1 * s, across2 = warp.force / l2 - f2 * s, shear2 = shear.slope / (l2 * l2) * c2;
  Eigen::Matrix4d plane;
  plane(0, 0) = weft.slope;
  plane(0, 1) = plane(1, 0) = -f1 * c;
  plane(1, 1) = across1 + shear.slope / (l1 * l1) * c2;
  plane(2, 2) = warp.slope * s2 + (across2 + shear2) * c2 - 2 * f2 * s * c2;
  plane(2, 3) = plane(3, 2) = warp.slope * sc - (across2 + shear2) * sc - f2 * c * (c2 - s2);
  plane(3, 3) = warp.slope * c2 + (across2 + shear2) * s2 + 2 * f2 * c2 * s;
  plane(0, 2) = plane(2, 0) = plane(0, 3) = plane(3, 0) = 0;
  plane(1, 2) = plane(2, 1) = g12 * c2 * c - f12 * sc;
  plane(1, 3) = plane(3, 1) = -g12 * c2 * s + f12 * s2;
  double n11 = weft.force / l1 - shear.force * s / (l1 * l1), n22 = warp.force / l2 - shear.force * s / (l2 * l2), n12 = shear.force / (l1 * l2);

  if (curvature == Curvature::positive) {
    if (!is_positive(plane)) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(plane);
      const Eigen::Vector4d values = eigen.eigenvalues().cwiseMax(0);
      plane = eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
    }
    if (n11 < 0 || n22 < 0 || n11 * n22 < n12 * n12) {
      const double mean = 0.5 * (n11 + n22), half = 0.5 * (n11 - n22), radius = std::hypot(half, n12);
      const double high = std::max(mean + radius, 0.0), low = std::max(mean - radius, 0.0);
      // The eigenvectors are those of [[half, n12], [n12, -half]].
      const double cos2 = radius > 0 ? half / radius : 1, sin2 = radius > 0 ? n12 / radius : 0;
      n11 = 0.5 * (high + low) + 0.5 * (high - low) * cos2;
      n22 = 0.5 * (high + low) - 0.5 * (high - low) * cos2;
      n12 = 0.5 * (high - low) * sin2;
    }
  }
  const auto turned = [&](int row, int column, double normal) {
    Eigen::Matrix3d m;
    const double a = plane(row, column), b = plane(row, column + 1), d = plane(row + 1, column), h = plane(row + 1, column + 1);
    for (int k = 0; k < 3; ++k) m.col(k) = (a * e1[k] + b * e2[k]) * e1 + (d * e1[k] + h * e2[k]) * e2 + (normal * e3[k]) * e3;
    return m;
  };
  r.weft_weft = turned(0, 0, n11);
  r.warp_warp = turned(2, 2, n22);
  r.weft_warp = turned(0, 2, n12);
  return r;
}

TriangleShape triangle_shape(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  TriangleShape shape;
  const double twice = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
  shape.area = 0.5 * twice;
  shape.slope_u = {(b.y() - c.y()) / twice, (c.y() - a.y()) / twice, (a.y() - b.y()) / twice};
  shape.slope_v = {(c.x() - b.x()) / twice, (a.x() - c.x()) / twice, (b.x() - a.x()) / twice};
  return shape;
}

Strain strain(const YarnGradient& gradient) {
  const Frame f = frame_of(gradient);
  return {gradient.weft.norm() - 1, gradient.warp.norm() - 1, std::asin(f.sine)};
}

}  // namespace toile::mechanics
