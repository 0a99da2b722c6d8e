// Friction between the yarns, as KES-F's loops show it: in bending, shear and tension a slider in series with a spring, beside the
// elastic curve. Within a step each is a convex potential of the strain; after it the slider follows (advance_friction).
// docs/mechanics.md#internal-friction derives the formulas.
#pragma once

#include "toile/fabric/constitutive.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <vector>

namespace toile::mechanics {

struct Sheet;

/// A slider's spring is so many times as stiff as the elastic curve, or more where the loop would not be open otherwise by the
/// time that KES-F reads it.
inline constexpr double slider_stiffness = 40;
/// In tension, over the slope of the measured curve.
inline constexpr double tensile_slider_stiffness = 40;

/// Bending: moment = clamp(stiffness (curvature - anchor), +-limit).
struct MomentSlider {
  double stiffness = 0;  ///< [N m]
  double limit = 0;      ///< 2HB / 2 [N]
  double anchor = 0;     ///< curvature without friction's moment [1/m]
  /// Energy [J/m2], moment [N], slope [N m].
  fabric::CurvePoint at(double curvature) const;
  /// The anchor once this curvature has been reached and friction has slid.
  double anchor_after(double curvature) const;
};

/// Shear: force = clamp(stiffness (angle - anchor), +-limit(|angle|)).
struct ShearLaw {
  double stiffness = 0;  ///< [N/m per rad]; 0: no friction
  double level = 0;      ///< limit up to `from` [N/m]
  double growth = 0;     ///< its slope from there to `to`; level again beyond [N/m per rad]
  double from = 0, to = 0;  ///< [rad]
  double limit(double angle) const;
  /// Integral of limit(|t|) cos(t) from 0 to an angle.
  double work(double angle) const;
};
struct ShearSlider {
  double anchor = 0;         ///< [rad]
  double low = 0, high = 0;  ///< angles between which it sticks [rad]
  /// As ShearCurve::at: energy [J/m2], force and its slope by the sine of the shear angle [N/m].
  fabric::CurvePoint at(const ShearLaw& law, double sine) const;
  double anchor_after(const ShearLaw& law, double sine) const;
};
ShearSlider shear_slider(const ShearLaw& law, double anchor);

/// Tension: KES-F's curve F(e) while it is loaded, RT F(e) while it is unloaded. The elastic part is their mean; friction is
/// clamp(stiffness (F - anchor), +-loss F) with loss = (1 - RT)/2, in extension only.
struct StretchSlider {
  double anchor = 0;        ///< force of the curve without friction's part [N/m]
  double low = 0, high = 0; ///< forces of the curve between which it sticks [N/m]
  double energy_low = 0, energy_stuck = 0, energy_high = 0;  ///< constants that make the energy continuous [J/m2]
  /// Both parts together. Precondition: made by stretch_slider for the same curve and loss.
  fabric::CurvePoint at(const fabric::TensileCurve& curve, double loss, double strain) const;
  double anchor_after(const fabric::TensileCurve& curve, double loss, double strain) const;
};
StretchSlider stretch_slider(const fabric::TensileCurve& curve, double loss, double anchor);

/// Sliders of a sheet with their laws.
struct InternalFriction {
  struct Law {
    ShearLaw shear;
    double loss_weft = 0, loss_warp = 0;  ///< (1 - RT)/2
  };
  std::vector<Law> laws;  ///< per fabric
  /// On the curvature along one yarn direction, in the direction of the cloth's normal (x_a - x_b) x (x_c - x_d).
  struct Bending {
    MomentSlider slider;
    double weight = 0;               ///< rest area that it stands for [m2]
    std::array<int, 4> normal{};     ///< nodes a, b, c, d
    int form_begin = 0;              ///< into form_coefficient
    bool warp = false;
    int vertex = -1, face = -1;      ///< where its anchor is kept
    int sides = 0;                   ///< of a vertex: 1 the side of increasing coordinate, 2 the other, 3 both
  };
  std::vector<Bending> bending;
  std::vector<double> form_coefficient;                  ///< [1/m2]
  std::vector<ShearSlider> shear;                        ///< |F|
  std::vector<std::array<StretchSlider, 2>> stretch;     ///< weft, warp of each face, |F|
  std::vector<std::array<StretchSlider, 2>> pair_stretch;///< of each membrane unit
};

/// Laws of a fabric. The elastic shear curve beside them is `elastic_shear`.
InternalFriction::Law friction_law(const fabric::Constitutive& fabric);
MomentSlider moment_slider(const fabric::Constitutive& fabric, double rigidity, double half_height);
/// Shear without friction, such that the whole has the card's G where KES-F reads it (on the way out, between two angles). A measured
/// curve is the middle of the loop already and stays.
fabric::ShearCurve elastic_shear(const fabric::Constitutive& fabric, const fabric::Card& card);

/// The step is over at x: sliders that slid follow.
void advance_friction(Sheet& sheet, const mesh::Points3& x);

/// Anchors as columns of the garment (docs/garment-file.md), and back. Columns that are missing mean cloth that was never strained.
void store_friction(const Sheet& sheet, mesh::GarmentMesh& garment);
void read_friction(const mesh::GarmentMesh& garment, Sheet& sheet);

}  // namespace toile::mechanics
