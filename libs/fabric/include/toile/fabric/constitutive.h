// From a fabric card to the constitutive data that the mechanics uses: curves with energy, force and slope, all SI.
// docs/mechanics.md derives the formulas.
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"

#include <span>
#include <vector>

namespace toile::fabric {

/// Value and the first two derivatives of an energy density at one strain.
struct CurvePoint {
  double energy = 0;  ///< [J/m2]
  double force = 0;   ///< [N/m]
  double slope = 0;   ///< [N/m]
};

/// A smooth curve through measured points: monotone cubic pieces, so the force has a continuous slope and the energy a
/// continuous second derivative; no overshoot between points. Beyond the last point its tangent goes on.
/// Source: docs/bibliography.md#fritsch1980
struct MonotoneCurve {
  std::vector<double> x, y, slope;
  std::vector<double> energy;  ///< integral up to each point
  bool empty() const { return x.empty(); }
  /// Precondition: not empty, x >= 0.
  CurvePoint at(double x) const;
};

/// Precondition: as a table's checks say (0 first, both rows increasing, two points at least).
MonotoneCurve monotone_curve(std::span<const double> x, std::span<const double> y);

/// Force per width against strain e along a yarn direction: F = scale (exp(rate e) - 1) in extension, its slope at zero in
/// compression, and its slope at `strain_linear` beyond that, so that no strain overflows. With a table its points instead,
/// and the slope at zero in compression.
/// Source: docs/bibliography.md#kawabata1980
struct TensileCurve {
  double scale = 0;          ///< A [N/m]; unused where rate is 0
  double rate = 0;           ///< b [1]; 0: a straight line
  double slope_zero = 0;     ///< A b [N/m]
  double strain_linear = 1;  ///< where the exponential is continued by its tangent [1]
  MonotoneCurve table = {};  ///< goes before the rest where not empty
  CurvePoint at(double strain) const;
};

/// The curve through (0, 0) and (strain_max, force_max) whose linearity LT = 2 WT / (F_max EMT) is the given one.
/// Precondition: all positive, linearity in [0.3, 1].
TensileCurve tensile_curve(double force_max, double strain_max, double linearity);
/// Of one yarn direction of a card: through its table where it has one.
TensileCurve tensile_curve(const Card& card, const YarnDirection& yarn);
/// Strain at which a curve reaches a force [N/m] >= 0.
double strain_at(const TensileCurve& curve, double force);

/// Shear energy per area as a function of s = sin(shear angle). The KES-F force F(angle) does the work F cos(angle) per
/// angle, so dW/ds = F. Without locking and table F = G angle; with locking the slope rises linearly between two angles to
/// a multiple of G; with a table F goes through its points. Beyond sine_linear the slope dF/ds is continued as it is.
struct ShearCurve {
  double rigidity = 0;                  ///< G, slope at zero [N/m per rad]
  double sine_linear = 0.9396926207859; ///< sin 70 deg
  /// F = c0 + t (c1 + t (c2 + t c3)) with t = angle - start; pieces in order, the first starts at 0. Empty: F = G angle.
  struct Piece {
    double start;
    double c0, c1, c2, c3;
    double energy;  ///< up to its start [J/m2]
  };
  std::vector<Piece> pieces = {};
  CurvePoint at(double sine) const;
  /// The KES-F force at an angle [N/m].
  double force_at_angle(double angle) const;
};

ShearCurve shear_curve(double rigidity, const Locking& locking);
ShearCurve shear_curve(const ShearTable& table);
/// The locking of a card: its own; else from the growth of its friction with the angle (docs/mechanics.md); else ratio 1.
Locking used_locking(const Card& card);
/// Through the card's table where it has one, else from G and the locking.
ShearCurve shear_curve(const Card& card);

/// Moment per width against curvature along a yarn direction, odd: M = rigidity * curvature, or through a table.
struct MomentCurve {
  double rigidity = 0;       ///< slope at zero [N m]
  MonotoneCurve table = {};
  CurvePoint at(double curvature) const;  ///< energy [J/m2], moment [N], slope [N m]
};
MomentCurve moment_curve(const YarnDirection& yarn);

/// Half the height of the shear force's loop against the size of the angle: straight through the two measured values,
/// level below the first and beyond the angle where the test turned round.
struct ShearFriction {
  double angle_first = 0, angle_second = 0, angle_last = 0;  ///< [rad]
  double first = 0, second = 0;                              ///< 2HG / 2, 2HG5 / 2 [N/m]
  double at(double angle) const;
};

/// Internal friction: in bending and shear half heights of the loops that KES-F measures (loading and unloading lie that far
/// above and below the elastic curve), in tension the part of the work that comes back. Zero and one: none measured.
struct Hysteresis {
  double moment_warp = 0;   ///< 2HB / 2 along the warp [N]
  double moment_weft = 0;   ///< along the weft [N]
  ShearFriction shear;
  double resilience_warp = 1;  ///< RT: unloading along RT times the loading curve gives back that part of the work [1]
  double resilience_weft = 1;
};

struct Constitutive {
  std::string name;
  TensileCurve warp, weft;
  ShearCurve shear;
  MomentCurve moment_warp;   ///< along v
  MomentCurve moment_weft;   ///< along u
  double bending_warp = 0;   ///< D22, along v: slope of moment_warp at zero [N m]
  double bending_weft = 0;   ///< D11, along u [N m]
  double bending_twist = 0;  ///< D66 [N m]
  Hysteresis hysteresis;
  Locking locking;           ///< as used: ratio 1 where there is none
  Conditions conditions;
  double areal_density = 0;  ///< [kg/m2]
  double thickness = 0;      ///< [m]
  double friction = 0;       ///< [1]
};

/// error  Issue "bad_fabric" naming the card and the value that is not finite, not positive or out of its range
Result<Constitutive> constitutive(const Card& card);

}  // namespace toile::fabric
