#include "toile/fabric/plausibility.h"

#include "toile/base/text.h"
#include "toile/fabric/constitutive.h"

#include <cmath>

namespace toile::fabric {
namespace {

constexpr double gravity = 9.80665;
constexpr double gf_per_cm = 0.980665;              // [N/m]
constexpr double gf_cm = 9.80665e-5;                // gf cm2/cm [N m]
constexpr double gf = 9.80665e-3;                   // gf cm/cm [N]
constexpr double gf_per_cm_deg = gf_per_cm * 180 / 3.14159265358979323846;

std::string number(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

std::vector<Judged> judged_figures(const Card& card) {
  std::vector<Judged> list{
      {"W", "g/m2", card.areal_density * 1e3, 30, 600, 3, 5000},
      {"T", "mm", card.thickness * 1e3, 0.05, 2.5, 0.01, 20},
      {"W/T", "g/cm3", card.areal_density / card.thickness * 1e-3, 0.1, 1.0, 0.02, 2.6},
      {"F_max", "gf/cm", card.tensile_force_max / gf_per_cm, 50, 500, 1, 1e5},
      {"G", "gf/cm/deg", card.shear / gf_per_cm_deg, 0.15, 8, 0.01, 2000},
      {"2HG", "gf/cm", card.shear_hysteresis / gf_per_cm, 0, 15, 0, 1000},
      {"2HG5", "gf/cm", card.shear_hysteresis_5 / gf_per_cm, 0, 20, 0, 1500},
      // A loop as wide as the test itself (8 deg to either side) cannot be read.
      {"2HG/G", "deg", card.shear_hysteresis / gf_per_cm / (card.shear / gf_per_cm_deg), 0, 5, 0, 16},
      {"MIU", "1", card.friction, 0.08, 0.6, 0.01, 2},
  };
  for (const auto& [name, yarn] : {std::pair<std::string, const YarnDirection&>{"warp", card.warp}, {"weft", card.weft}}) {
    const double secant = card.tensile_force_max / yarn.strain_max;
    list.push_back({name + ".EMT", "%", yarn.strain_max * 100, 0.3, 30, 0.01, 200});
    list.push_back({name + ".LT", "1", yarn.linearity, 0.45, 1, 0.3, 1});
    list.push_back({name + ".RT", "%", yarn.resilience * 100, 30, 100, 5, 100});
    list.push_back({name + ".B", "gf*cm2/cm", yarn.bending / gf_cm, 0.003, 1.5, 1e-4, 1000});
    list.push_back({name + ".2HB", "gf*cm/cm", yarn.bending_hysteresis / gf, 0, 1, 0, 500});
    // A fabric that stays bent to more than the test's 2.5 /cm after release was not measured by it.
    list.push_back({name + ".2HB/2B", "1/cm", yarn.bending_hysteresis / (2 * yarn.bending) * 1e-2, 0, 1.2, 0, 2.5});
    // Fibres that slide bend far more easily than a solid plate of the same stiffness, never less easily.
    list.push_back({name + ".B/(C T2/12)", "1", yarn.bending / (secant * card.thickness * card.thickness / 12), 1e-4, 0.5, 1e-6, 1});
    list.push_back({name + ".C/G", "1", secant / card.shear, 10, 5000, 1, 1e6});
    list.push_back({name + ".bending_length", "mm", std::cbrt(yarn.bending / (card.areal_density * gravity)) * 1e3, 8, 60, 1, 500});
  }
  return list;
}

Plausibility plausibility(const Card& card) {
  Plausibility result;
  const auto range = [](double low, double high) { return fmt::format("{:.4g} to {:.4g}", low, high); };
  for (const Judged& j : judged_figures(card)) {
    const std::string unit = j.unit == "1" ? "" : " " + j.unit;
    if (!j.possible()) {
      result.findings.push_back({"implausible", {.item = j.key}, fmt::format("{} is {}{}, which no fabric has", j.key, number(j.value), unit),
                                 fmt::format("check value and unit; possible: {}{}", range(j.possible_low, j.possible_high), unit), Category::check});
    } else if (!j.usual()) {
      result.warnings.push_back({"unusual", {.item = j.key}, fmt::format("{} is {}{}, unusual for woven apparel", j.key, number(j.value), unit),
                                 fmt::format("usual: {}{}", range(j.usual_low, j.usual_high), unit)});
    }
  }
  if (card.shear_hysteresis_5 > 0 && card.shear_hysteresis_5 < card.shear_hysteresis) {
    result.warnings.push_back({"unusual", {.item = "2HG5"}, "2HG5 is below 2HG: friction between yarns grows with the shear angle", "check that the two are not exchanged"});
  }
  const auto differ = [&](const char* key, double a, double b, double ratio) {
    if (a > ratio * b || b > ratio * a) result.warnings.push_back({"unusual", {.item = key}, fmt::format("{} of warp and weft differ {} times", key, number(std::max(a / b, b / a))), "check that they are in the same unit"});
  };
  differ("EMT", card.warp.strain_max, card.weft.strain_max, 15);
  differ("B", card.warp.bending, card.weft.bending, 15);
  return result;
}

Plausibility plausibility(const Measured& measured, const Resolved& resolved) {
  Plausibility result = plausibility(resolved.card);
  const auto apart = [&](const char* key, const std::optional<double>& warp, const std::optional<double>& weft) {
    if (!warp || !weft || std::abs(*warp - *weft) <= 0.3 * std::max(*warp, *weft)) return;
    result.warnings.push_back({"unusual", {.item = key}, fmt::format("{} of warp and weft differ by more than 30 %; one sheet has one shear rigidity, the mean is used", key), "look at both curves"});
  };
  apart("G", measured.warp.shear, measured.weft.shear);
  for (const auto& [name, yarn] : {std::pair<const char*, const MeasuredYarn&>{"warp", measured.warp}, {"weft", measured.weft}}) {
    const auto source = resolved.source.find(std::string(name) + ".bending");
    const bool cantilever = source != resolved.source.end() && (source->second.find("cantilever") == 0 || source->second.find("FAST") == 0);
    if (cantilever && yarn.bending_hysteresis.value_or(0) > 0) {
      result.warnings.push_back({"mixed_tests", {.item = fmt::format("{}.2HB", name)}, "the rigidity of a cantilever already contains the friction that 2HB is",
                                 "use B and 2HB of one test, or leave 2HB out"});
    }
  }
  if (!measured.twist_ratio && !measured.bias_bending) {
    result.warnings.push_back({"assumed", {.item = "B45"}, "nothing is known of the twist rigidity; 0.3 sqrt(B_warp B_weft) is used", "measure the bending of a strip at 45 deg, or state twist_ratio"});
  }
  return result;
}

}  // namespace toile::fabric
