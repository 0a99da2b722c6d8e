#include "toile/fabric/constitutive.h"

#include <algorithm>
#include <cmath>

namespace toile::fabric {
namespace {

/// 2 (1/x - 1/(e^x - 1)): linearity of F = A (e^{b e} - 1) with x = b e_max.
double linearity_of(double x) {
  if (x < 1e-3) return 1 - x / 6;  // series; the closed form cancels here
  return 2 * (1 / x - 1 / std::expm1(x));
}

}  // namespace

CurvePoint TensileCurve::at(double strain) const {
  if (strain <= 0 || rate == 0) return {0.5 * slope_zero * strain * strain, slope_zero * strain, slope_zero};
  const double e = std::min(strain, strain_linear);
  const double growth = std::expm1(rate * e);
  const double force = scale * growth, slope = slope_zero * (growth + 1);
  const double energy = scale * (growth / rate - e);
  const double rest = strain - e;
  return {energy + rest * (force + 0.5 * slope * rest), force + slope * rest, slope};
}

TensileCurve tensile_curve(double force_max, double strain_max, double linearity) {
  TensileCurve curve;
  curve.strain_linear = 1.5 * strain_max;
  if (linearity > 1 - 1e-6) {
    curve.slope_zero = force_max / strain_max;
    return curve;
  }
  double low = 0, high = 20;  // linearity_of falls from 1 to 0.1 there
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (linearity_of(middle) > linearity ? low : high) = middle;
  }
  const double x = 0.5 * (low + high);
  curve.rate = x / strain_max;
  curve.scale = force_max / std::expm1(x);
  curve.slope_zero = curve.scale * curve.rate;
  return curve;
}

CurvePoint ShearCurve::at(double sine) const {
  const double s = std::min(std::abs(sine), sine_linear), sign = sine < 0 ? -1.0 : 1.0;
  const double angle = std::asin(s), cosine = std::sqrt(1 - s * s);
  const double energy = rigidity * (s * angle + cosine - 1), force = rigidity * angle, slope = rigidity / cosine;
  const double rest = std::abs(sine) - s;
  return {energy + rest * (force + 0.5 * slope * rest), sign * (force + slope * rest), slope};
}

Result<Constitutive> constitutive(const Card& card) {
  Issues issues;
  const auto require = [&](const std::string& key, double value, bool good) {
    if (std::isfinite(value) && good) return;
    issues.push_back(Issue{"bad_fabric", {.item = fmt::format("fabric {}, {}", card.name, key)}, fmt::format("the value {} cannot be used", value),
                           "correct the fabric card"});
  };
  require("F_max", card.tensile_force_max, card.tensile_force_max > 0);
  for (const auto& [name, yarn] : {std::pair<const char*, const YarnDirection&>{"warp", card.warp}, {"weft", card.weft}}) {
    require(fmt::format("{}.EMT", name), yarn.strain_max, yarn.strain_max > 0);
    require(fmt::format("{}.LT", name), yarn.linearity, yarn.linearity >= 0.3 && yarn.linearity <= 1);
    require(fmt::format("{}.B", name), yarn.bending, yarn.bending > 0);
  }
  require("W", card.areal_density, card.areal_density > 0);
  require("T", card.thickness, card.thickness > 0);
  require("G", card.shear, card.shear > 0);
  require("twist_ratio", card.twist_ratio, card.twist_ratio >= 0);
  require("MIU", card.friction, card.friction >= 0);
  if (!issues.empty()) return issues;

  Constitutive result;
  result.name = card.name;
  result.warp = tensile_curve(card.tensile_force_max, card.warp.strain_max, card.warp.linearity);
  result.weft = tensile_curve(card.tensile_force_max, card.weft.strain_max, card.weft.linearity);
  result.shear.rigidity = card.shear;
  result.bending_warp = card.warp.bending;
  result.bending_weft = card.weft.bending;
  result.bending_twist = card.twist_ratio * std::sqrt(card.warp.bending * card.weft.bending);
  result.areal_density = card.areal_density;
  result.thickness = card.thickness;
  result.friction = card.friction;
  return result;
}

}  // namespace toile::fabric
