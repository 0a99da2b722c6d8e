#include "toile/fabric/laminate.h"

#include <algorithm>
#include <cmath>

namespace toile::fabric {
namespace {

/// Tensile force and work of one sheet: F = force_max (e^(x e / strain_max) - 1) / (e^x - 1), x from the linearity.
struct Curve {
  double force_max, strain_max, x;
  double force(double strain) const {
    const double e = strain / strain_max;
    return std::abs(x) < 1e-9 ? force_max * e : force_max * std::expm1(x * e) / std::expm1(x);
  }
  double work(double strain) const {
    const double e = strain / strain_max;
    if (std::abs(x) < 1e-4) return force_max * strain_max * e * e / 2 * (1 + x * (e / 3 - 0.5));
    return force_max * strain_max * (std::expm1(x * e) / x - e) / std::expm1(x);
  }
};

/// LT = 2 (1/x - 1/(e^x - 1)), falling in x from 1 at 0.
double linearity_of(double x) { return x < 1e-4 ? 1 - x / 6 : 2 * (1 / x - 1 / std::expm1(x)); }

Curve curve_of(const YarnDirection& yarn, double force_max) {
  double low = 0, high = 100;
  for (int step = 0; step < 200; ++step) {
    const double middle = 0.5 * (low + high);
    (linearity_of(middle) > yarn.linearity ? low : high) = middle;
  }
  return {force_max, yarn.strain_max, 0.5 * (low + high)};
}

YarnDirection combined(std::span<const Card> sheets, YarnDirection Card::*direction) {
  const double force_max = sheets.front().tensile_force_max;
  double strain_max = 0;
  for (const Card& sheet : sheets) strain_max = std::max(strain_max, (sheet.*direction).strain_max * std::max(1.0, force_max / sheet.tensile_force_max));
  const auto force = [&](double strain) {
    double sum = 0;
    for (const Card& sheet : sheets) sum += curve_of(sheet.*direction, sheet.tensile_force_max).force(strain);
    return sum;
  };
  double low = 0, high = strain_max;
  for (int step = 0; step < 200; ++step) {
    const double middle = 0.5 * (low + high);
    (force(middle) < force_max ? low : high) = middle;
  }
  YarnDirection result = sheets.front().*direction;
  result.strain_max = 0.5 * (low + high);
  double work = 0, returned = 0;
  result.bending = result.bending_hysteresis = 0;
  for (const Card& sheet : sheets) {
    const YarnDirection& yarn = sheet.*direction;
    const double own = curve_of(yarn, sheet.tensile_force_max).work(result.strain_max);
    work += own;
    returned += own * yarn.resilience;
    result.bending += yarn.bending;
    result.bending_hysteresis += yarn.bending_hysteresis;
  }
  result.linearity = std::clamp(2 * work / (force_max * result.strain_max), 0.3, 1.0);
  result.resilience = returned / work;
  return result;
}

}  // namespace

Result<Card> bonded(std::span<const Card> sheets, const std::string& name) {
  if (sheets.empty()) return Issue{"no_sheets", {.item = name}, "a laminate needs at least one sheet", "name a fabric"};
  Issues issues;
  for (const Card& sheet : sheets) {
    for (Issue issue : validate(sheet)) {
      issue.code = "bad_fabric";
      issue.place.item = "fabric " + sheet.name + ": " + issue.place.item;
      issues.push_back(issue);
    }
  }
  if (!issues.empty()) return issues;
  Card result = sheets.front();
  result.name = name;
  if (sheets.size() == 1) return result;
  result.description = "bonded: ";
  result.origin = "computed from its sheets as parallel networks";
  result.areal_density = result.thickness = result.shear = result.shear_hysteresis = result.shear_hysteresis_5 = 0;
  double twist = 0;
  for (const Card& sheet : sheets) {
    result.description += (&sheet == &sheets.front() ? "" : " + ") + sheet.name;
    result.areal_density += sheet.areal_density;
    result.thickness += sheet.thickness;
    result.shear += sheet.shear;
    result.shear_hysteresis += sheet.shear_hysteresis;
    result.shear_hysteresis_5 += sheet.shear_hysteresis_5;
    twist += sheet.twist_ratio * std::sqrt(sheet.warp.bending * sheet.weft.bending);
  }
  result.warp = combined(sheets, &Card::warp);
  result.weft = combined(sheets, &Card::weft);
  result.twist_ratio = twist / std::sqrt(result.warp.bending * result.weft.bending);
  return result;
}

}  // namespace toile::fabric
