// The membrane of a woven: energy in the stretch of both yarns and the angle between them. docs/mechanics.md has the
// formulas.
#pragma once

#include "toile/fabric/constitutive.h"

#include <Eigen/Core>
#include <array>

namespace toile::mechanics {

/// Positions of the yarn directions in space: weft = dx/du, warp = dx/dv [1].
struct YarnGradient {
  Eigen::Vector3d weft, warp;
};

/// Energy per area [J/m2] of a state of deformation, W = f_weft(|weft| - 1) + f_warp(|warp| - 1) + g(sin of the shear angle).
double membrane_energy(const fabric::Constitutive& fabric, const YarnGradient& gradient);

/// Energy and its derivatives with respect to the two yarn vectors.
struct MembraneResponse {
  double energy = 0;                     ///< [J/m2]
  YarnGradient stress;                   ///< dW/dweft, dW/dwarp [N/m]
  Eigen::Matrix3d weft_weft, weft_warp, warp_warp;  ///< blocks of the second derivative [N/m]
};

enum class Curvature {
  exact,       ///< the true second derivative, indefinite where the cloth is compressed
  positive,    ///< its projection on the positive semidefinite matrices
};

MembraneResponse membrane_response(const fabric::Constitutive& fabric, const YarnGradient& gradient, Curvature curvature);

/// What the energy depends on: length of both yarns over their rest length, sine of the shear angle.
struct YarnState {
  double weft = 1, warp = 1, sine = 0;
};
YarnState yarn_state(const YarnGradient& gradient);

/// Response with energies of its own choice: their derivatives by the lengths and the sine. The energy is the sum of the three.
MembraneResponse membrane_response(const fabric::CurvePoint& weft, const fabric::CurvePoint& warp, const fabric::CurvePoint& shear, const YarnGradient& gradient,
                                   Curvature curvature);

/// A triangle's shape functions: weft = sum_k slope_u[k] x_k, warp = sum_k slope_v[k] x_k.
struct TriangleShape {
  std::array<double, 3> slope_u{}, slope_v{};  ///< [1/m]
  double area = 0;                             ///< [m2]
};

/// Precondition: the corners are counter-clockwise in (u, v) and not on one line.
TriangleShape triangle_shape(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

/// Strains of a state: stretch of the yarns minus one, and the shear angle [rad].
struct Strain {
  double weft = 0, warp = 0, shear = 0;
};
Strain strain(const YarnGradient& gradient);

}  // namespace toile::mechanics
