// What theory says about the tests of the virtual laboratory: integrated or closed solutions, dimensionless where they can be.
// docs/validation.md cites them test by test.
#pragma once

#include <vector>

namespace toile::lab {

/// Free end of a heavy strip that is clamped level at its other end, over its length.
struct Cantilever {
  double drop = 0, reach = 0;
};

/// Inextensible strip of moment B kappa + HB (no curvature where the moment is below HB): loaded once from straight, as long as curvature
/// grows everywhere. Where gamma is large it falls again away from the clamp on the way there; then this is the shape for the whole load
/// put on at once, and loaded_cantilever() that for a load that grows.
/// gamma  w L^3/B, w weight per area
/// eta    HB L/B; 0: without friction
/// Precondition: 0 < gamma <= 5000, eta >= 0
Cantilever cantilever(double gamma, double eta = 0);

/// The same strip, its weight put on in equal steps from none: friction holds curvature while the moment is within HB of B kappa. A
/// chain of 400 links with sliders a thousand times as stiff as B.
/// Precondition: 0 < gamma <= 1000, eta >= 0, steps >= 1
Cantilever loaded_cantilever(double gamma, double eta, int steps);

/// Overhang at which the chord from clamp to free end dips by `angle` [rad], in units of the bending length (B/w)^(1/3).
/// rho  HB (B/w)^(1/3)/B
double overhang(double angle, double rho = 0);

/// Extension of a hanging strip by its own weight [m], for the tensile curve F = A (exp(b e) - 1).
/// weight per area [N/m2], length [m], A [N/m], b [1]; b = 0: F = A e
double hang(double weight, double length, double a, double b);

/// Exponent x = b EMT of the tensile curve with this linearity LT: LT = 2 [1/x - 1/(exp x - 1)]; 0 for LT >= 1.
double tensile_exponent(double linearity);

/// A strip hanging between two points at one height.
struct Catenary {
  double sag = 0;      ///< [m]
  double pull = 0;     ///< horizontal force per width [N/m]
};
/// span [m] < length [m], weight per area [N/m2], stiffness C11 [N/m]
Catenary catenary(double span, double length, double weight, double stiffness);

/// Bias extension of a strip height x width between jaws, yarns at 45 degrees, as a net of inextensible yarns pinned at their
/// crossings: whole shear in the middle, half of it beside.
struct BiasPoint {
  double extension = 0;  ///< [m]
  double force = 0;      ///< [N]
};
/// shear [rad], height > 2 width [m]; moment per area G gamma cos(gamma), shear stiffness G [N/m]
BiasPoint bias_extension(double shear, double height, double width, double stiffness);

/// The same for yarns that stretch, C11 = `ratio` times the shear stiffness: force over shear stiffness and width at extensions [m],
/// increasing. A net of extensible yarns pinned at their crossings on the yarns' own squares, by Newton, extrapolated to fine squares
/// (within 0.2 %). Precondition: height >= 2 width.
std::vector<double> bias_extension_of_yarns(const std::vector<double>& extensions, double height, double width, double ratio);

/// Energy per area of shear, G (g sin g + cos g - 1).
double shear_energy(double shear, double stiffness);

/// Weight per area, times length^3/D11, at which a cantilever strip that stands on edge tips over sideways: Rayleigh-Ritz with
/// plate and plane stress, D12 = 0.
/// aspect  width over length, 0.02 to 1.5
/// twist   D66/D11
double lateral_buckling(double aspect, double twist);

/// A vertical strip, clamped at its top, its lower end on a plane: the clamp comes down by eps times the length.
struct StickPoint {
  double eps = 0;
  double friction = 0;  ///< coefficient that just holds the end
  double push = 0;      ///< normal force on the plane times L^2/B per width
};
/// Increasing eps, until the end of the strip lies flat on the plane. gamma as for cantilever(), 0 without weight.
std::vector<StickPoint> stick_slip(double gamma);

}  // namespace toile::lab
