// From a fabric card to the constitutive data that the mechanics uses: curves with energy, force and slope, all SI.
// docs/mechanics.md derives the formulas.
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"

namespace toile::fabric {

/// Value and the first two derivatives of an energy density at one strain.
struct CurvePoint {
  double energy = 0;  ///< [J/m2]
  double force = 0;   ///< [N/m]
  double slope = 0;   ///< [N/m]
};

/// Force per width against strain e along a yarn direction: F = scale (exp(rate e) - 1) in extension, its slope at zero in
/// compression, and its slope at `strain_linear` beyond that, so that no strain overflows.
/// Source: docs/bibliography.md#kawabata1980
struct TensileCurve {
  double scale = 0;          ///< A [N/m]; unused where rate is 0
  double rate = 0;           ///< b [1]; 0: a straight line
  double slope_zero = 0;     ///< A b [N/m]
  double strain_linear = 1;  ///< where the exponential is continued by its tangent [1]
  CurvePoint at(double strain) const;
};

/// The curve through (0, 0) and (strain_max, force_max) whose linearity LT = 2 WT / (F_max EMT) is the given one.
/// Precondition: all positive, linearity in [0.3, 1].
TensileCurve tensile_curve(double force_max, double strain_max, double linearity);

/// Shear energy per area as a function of s = sin(shear angle): dW/ds = G angle, which is the moment G angle cos(angle)
/// per angle that the KES-F definition gives. Beyond sine_linear the slope is continued as it is.
struct ShearCurve {
  double rigidity = 0;                  ///< G [N/m per rad]
  double sine_linear = 0.9396926207859; ///< sin 70 deg
  CurvePoint at(double sine) const;
};

struct Constitutive {
  std::string name;
  TensileCurve warp, weft;
  ShearCurve shear;
  double bending_warp = 0;   ///< D22, along v [N m]
  double bending_weft = 0;   ///< D11, along u [N m]
  double bending_twist = 0;  ///< D66 [N m]
  double areal_density = 0;  ///< [kg/m2]
  double thickness = 0;      ///< [m]
  double friction = 0;       ///< [1]
};

/// error  Issue "bad_fabric" naming the card and the value that is not finite, not positive or out of its range
Result<Constitutive> constitutive(const Card& card);

}  // namespace toile::fabric
