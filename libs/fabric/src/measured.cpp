#include "toile/fabric/measured.h"

#include "toile/fabric/constitutive.h"

#include <algorithm>
#include <cmath>

namespace toile::fabric {
namespace {

constexpr double standard_gravity = 9.80665;        // [m/s2]
constexpr double standard_force_max = 490.3325;     // 500 gf/cm [N/m]
constexpr double standard_twist = 0.3;
constexpr double twist_most = 2;  // greatest twist_ratio
// Figures of two or three digits that belong together disagree by that much at most.
constexpr double agreement = 0.05;

struct Direction {
  const char* name;
  const MeasuredYarn& kes;
  const FastYarn* fast;
  const EngineeringYarn* constants;
};

std::array<Direction, 2> directions(const Measured& m) {
  return {Direction{"warp", m.warp, m.fast ? &m.fast->warp : nullptr, m.constants ? &m.constants->warp : nullptr},
          Direction{"weft", m.weft, m.fast ? &m.fast->weft : nullptr, m.constants ? &m.constants->weft : nullptr}};
}

bool linear_tension(const Direction& d) { return d.constants && (d.constants->stiffness || d.constants->modulus); }
bool kes_tension(const MeasuredYarn& y) { return y.strain_max || y.linearity || y.work || y.tension; }

struct Source {
  std::string keys;  ///< as in the file
  bool given;
};

/// One and only one of several; the issue lists them.
void require_one(const std::string& item, const std::string& what, const std::vector<Source>& sources, Issues& issues) {
  std::vector<std::string> found, all;
  for (const Source& s : sources) {
    all.push_back(s.keys);
    if (s.given) found.push_back(s.keys);
  }
  const auto list = [](const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return text;
  };
  if (found.empty()) issues.push_back({"missing_data", {.item = item}, what + " is not given", "add " + list(all)});
  if (found.size() > 1) issues.push_back({"doubled_data", {.item = item}, fmt::format("{} is given {} times: {}", what, found.size(), list(found)), "keep one of them"});
}

bool apart(double a, double b) { return std::abs(a - b) > agreement * std::max(std::abs(a), std::abs(b)); }

double from_length(double areal_density, double length) { return areal_density * standard_gravity * length * length * length; }
/// A bias strip at a load F per width: the yarns turn by 2 e, the work F e is G (2 e)^2 / 2, so G = F/(4 e).
double from_bias(const Fast& fast) { return fast.loads[0] / (4 * *fast.bias_extension); }
double wide_strip(const EngineeringYarn& yarn, const Measured& m) {
  return yarn.stiffness ? *yarn.stiffness : *yarn.modulus * m.thickness / (1 - m.constants->poisson * m.constants->poisson);
}

/// Points (strain, force) of FAST. Several loads at zero strain are one point less.
TensionTable fast_table(const FastYarn& yarn, const Fast& fast) {
  TensionTable table{{0}, {0}};
  const std::array<double, 3> strains{yarn.extension_5, yarn.extension_20, yarn.extension_100};
  for (std::size_t i = 0; i < 3; ++i) {
    if (strains[i] <= table.strain.back()) continue;
    table.strain.push_back(strains[i]);
    table.force.push_back(fast.loads[i]);
  }
  return table;
}

std::optional<double> mean(const std::optional<double>& whole, const std::optional<double>& warp, const std::optional<double>& weft) {
  if (whole) return whole;
  if (warp && weft) return 0.5 * (*warp + *weft);
  return warp ? warp : weft;
}

/// Greatest force of the tensile tests that the card's EMT and LT refer to.
double force_max_of(const Measured& m) {
  if (m.tensile_force_max) return *m.tensile_force_max;
  double least = standard_force_max;
  for (const Direction& d : directions(m)) {
    if (d.kes.strain_max && !d.kes.tension) return standard_force_max;
    if (d.kes.tension) least = std::min(least, d.kes.tension->force.back());
    else if (d.fast) least = std::min(least, m.fast->loads[2]);
    // A soft linear sheet: no farther than to twice its length.
    else if (linear_tension(d)) least = std::min(least, wide_strip(*d.constants, m));
  }
  return least;
}

}  // namespace

void Measured::check_sources(const Measured& m, Issues& issues) {
  if (m.fast) {
    const auto& loads = m.fast->loads;
    if (!(loads[0] < loads[1] && loads[1] < loads[2])) issues.push_back({"bad_fast", {.item = "fast.loads"}, "the loads do not increase", "give them from low to high"});
    if (m.fast->bias_extension && m.fast->shear && apart(from_bias(*m.fast), *m.fast->shear)) {
      issues.push_back({"contradiction", {.item = "fast.G"}, fmt::format("G is {:.4g} N/m/rad, but EB5 gives {:.4g}", *m.fast->shear, from_bias(*m.fast)), "correct one of the two or leave one out"});
    }
  }
  const double force_max = m.tensile_force_max.value_or(standard_force_max);
  for (const Direction& d : directions(m)) {
    const std::string name = d.name;
    const MeasuredYarn& y = d.kes;
    if (d.fast) {
      if (!(d.fast->extension_5 <= d.fast->extension_20 && d.fast->extension_20 < d.fast->extension_100)) {
        issues.push_back({"bad_fast", {.item = "fast." + name}, "E5, E20 and E100 do not increase", "give strains at increasing loads"});
      }
      if (d.fast->bending && d.fast->bending_length && apart(*d.fast->bending, from_length(m.areal_density, *d.fast->bending_length))) {
        issues.push_back({"contradiction", {.item = "fast." + name + ".B"}, fmt::format("B is {:.4g} N*m, but W g C^3 is {:.4g}", *d.fast->bending, from_length(m.areal_density, *d.fast->bending_length)), "correct one of the two or leave one out"});
      }
    }
    if (d.constants && d.constants->stiffness && d.constants->modulus) {
      issues.push_back({"doubled_data", {.item = "constants." + name}, "both C and E are given", "keep one of them"});
    }
    require_one(name, "the tensile curve", {{name + ".EMT with LT or WT, or " + name + ".tension", kes_tension(y)}, {"fast." + name, d.fast != nullptr}, {"constants." + name + " with C or E", linear_tension(d)}}, issues);
    if (kes_tension(y) && !y.tension) {
      if (!y.strain_max) issues.push_back({"missing_data", {.item = name + ".EMT"}, "the tensile curve has no EMT", "add EMT"});
      if (!y.linearity && !y.work) issues.push_back({"missing_data", {.item = name + ".LT"}, "the tensile curve has neither LT nor WT", "add LT or WT"});
    }
    if (y.strain_max && y.work && !y.tension) {
      const double linearity = 2 * *y.work / (force_max * *y.strain_max);
      if (y.linearity && apart(linearity, *y.linearity)) {
        issues.push_back({"contradiction", {.item = name + ".WT"}, fmt::format("LT is {:.4g}, but 2 WT/(F_max EMT) is {:.4g}", *y.linearity, linearity), "correct LT, WT, EMT or F_max, or leave LT or WT out"});
      } else if (!y.linearity && !(linearity >= 0.3 && linearity <= 1)) {
        issues.push_back({"out_of_range", {.item = name + ".WT"}, fmt::format("2 WT/(F_max EMT) is {:.4g}, no linearity of a stiffening curve", linearity), "allowed: from 0.3 to 1"});
      }
    }
    if (y.tension && y.strain_max && validate(*y.tension).empty()) {
      TensileCurve curve;
      curve.table = monotone_curve(y.tension->strain, y.tension->force);
      curve.slope_zero = curve.table.slope.front();
      const double strain = strain_at(curve, force_max);
      if (apart(strain, *y.strain_max)) {
        issues.push_back({"contradiction", {.item = name + ".EMT"}, fmt::format("EMT is {:.4g}, but the curve reaches F_max at {:.4g}", *y.strain_max, strain), "correct EMT, F_max or the curve, or leave EMT out"});
      }
    }
    require_one(name, "the bending rigidity",
                {{name + ".B", y.bending.has_value()}, {name + ".moment", y.moment.has_value()}, {name + ".bending_length", y.bending_length.has_value()},
                 {"fast." + name + " with C or B", d.fast && (d.fast->bending || d.fast->bending_length)}, {"constants." + name + " with B", d.constants && d.constants->bending}},
                issues);
  }
  require_one("G", "the shear rigidity",
              {{"G", m.shear || m.warp.shear || m.weft.shear}, {"shear", m.shear_table.has_value()}, {"fast.EB5 or fast.G", m.fast && (m.fast->bias_extension || m.fast->shear)}, {"constants.G", m.constants && m.constants->shear}}, issues);
  const auto whole_or_parts = [&](const char* key, const std::optional<double>& whole, const std::optional<double>& warp, const std::optional<double>& weft) {
    if (whole && (warp || weft)) issues.push_back({"doubled_data", {.item = key}, fmt::format("'{}' is given for the fabric and for a yarn direction", key), "keep one of them"});
  };
  whole_or_parts("G", m.shear, m.warp.shear, m.weft.shear);
  whole_or_parts("2HG", m.shear_hysteresis, m.warp.shear_hysteresis, m.weft.shear_hysteresis);
  whole_or_parts("2HG5", m.shear_hysteresis_5, m.warp.shear_hysteresis_5, m.weft.shear_hysteresis_5);
  whole_or_parts("MIU", m.friction, m.warp.friction, m.weft.friction);
  if (!mean(m.friction, m.warp.friction, m.weft.friction)) issues.push_back({"missing_data", {.item = "MIU"}, "the friction coefficient is not given", "add MIU"});
  if (m.twist_ratio && m.bias_bending) issues.push_back({"doubled_data", {.item = "B45"}, "the twist rigidity is given by twist_ratio and by B45", "keep one of them"});
  if (m.shear_table && m.locking) issues.push_back({"doubled_data", {.item = "locking"}, "the measured shear curve already holds the locking", "leave `locking` out"});
  if (m.shear_force == ShearForce::raw) {
    const double tension = m.conditions.value_or(Conditions{}).shear_tension;
    if (const auto g = mean(m.shear, m.warp.shear, m.weft.shear); g && *g <= tension) {
      issues.push_back({"contradiction", {.item = "shear_force"}, fmt::format("the tension alone gives {:.4g} N/m/rad, G is {:.4g}", tension, *g), "the force was net, or the tension smaller"});
    }
    if (m.shear_table) issues.push_back({"contradiction", {.item = "shear_force"}, "a measured shear curve must be net of the tension", "take tension times tan(angle) off its forces"});
  }
  if (m.bias_bending && issues.empty()) {
    const Result<Resolved> resolved = [&] {
      Measured without = m;
      without.bias_bending.reset();
      return resolve(without);
    }();
    const double warp = resolved->card.warp.bending, weft = resolved->card.weft.bending;
    const double least = 0.25 * (warp + weft), most = least + twist_most * std::sqrt(warp * weft);
    if (*m.bias_bending < least || *m.bias_bending > most) {
      issues.push_back({"contradiction", {.item = "B45"}, fmt::format("B45 is {:.4g} N*m; with these B it must lie between {:.4g} (no twist rigidity) and {:.4g}", *m.bias_bending, least, most), "check B45 and both B"});
    }
  }
}

Result<Resolved> resolve(const Measured& m) {
  if (Issues issues = validate(m); !issues.empty()) return issues;
  Resolved result;
  Card& card = result.card;
  card.name = m.name;
  card.description = m.description;
  card.origin = m.origin;
  card.licence = m.licence;
  card.areal_density = m.areal_density;
  card.thickness = m.thickness;
  card.tensile_force_max = force_max_of(m);
  card.color = m.color;
  card.conditions = m.conditions;
  card.locking = m.locking;
  if (m.locking) result.source["locking"] = "given";

  for (const Direction& d : directions(m)) {
    const std::string name = d.name;
    const MeasuredYarn& y = d.kes;
    YarnDirection& yarn = name == "warp" ? card.warp : card.weft;
    std::string& tension = result.source[name + ".tension"];
    std::string& bending = result.source[name + ".bending"];
    yarn.resilience = y.resilience.value_or(1);
    yarn.bending_hysteresis = y.bending_hysteresis.value_or(0);
    if (y.tension || (d.fast && !kes_tension(y))) {
      yarn.tension = y.tension ? *y.tension : fast_table(*d.fast, *m.fast);
      tension = y.tension ? "measured curve" : "FAST: E5, E20, E100";
    } else if (linear_tension(d)) {
      yarn.strain_max = card.tensile_force_max / wide_strip(*d.constants, m);
      yarn.linearity = 1;
      tension = d.constants->stiffness ? "constants: C" : "constants: E T/(1 - nu^2)";
    } else {
      yarn.strain_max = *y.strain_max;
      yarn.linearity = y.linearity ? *y.linearity : 2 * *y.work / (card.tensile_force_max * yarn.strain_max);
      tension = y.linearity ? "KES-F: EMT, LT" : "KES-F: EMT, WT";
    }
    if (yarn.tension) {
      // What the curve would have been written down as.
      const TensileCurve curve = tensile_curve(card, yarn);
      yarn.strain_max = strain_at(curve, card.tensile_force_max);
      yarn.linearity = std::clamp(2 * curve.at(yarn.strain_max).energy / (card.tensile_force_max * yarn.strain_max), 0.3, 1.0);
    }
    if (y.moment) {
      yarn.moment = y.moment;
      const MomentCurve curve = moment_curve(yarn);
      const Conditions c = m.conditions.value_or(Conditions{});
      yarn.bending = (curve.at(c.bending_slope_to).force - curve.at(c.bending_slope_from).force) / (c.bending_slope_to - c.bending_slope_from);
      bending = "measured curve";
    } else if (y.bending) {
      yarn.bending = *y.bending;
      bending = "KES-F: B";
    } else if (y.bending_length) {
      yarn.bending = from_length(m.areal_density, *y.bending_length);
      bending = "cantilever: W g c^3";
    } else if (d.fast && (d.fast->bending || d.fast->bending_length)) {
      yarn.bending = d.fast->bending ? *d.fast->bending : from_length(m.areal_density, *d.fast->bending_length);
      bending = d.fast->bending ? "FAST: B" : "FAST: W g C^3";
    } else {
      yarn.bending = *d.constants->bending;
      bending = "constants: B";
    }
  }

  const Conditions conditions = m.conditions.value_or(Conditions{});
  std::string& shear = result.source["shear"];
  if (m.shear_table) {
    card.shear_table = m.shear_table;
    const ShearCurve curve = shear_curve(*m.shear_table);
    card.shear = (curve.force_at_angle(conditions.shear_slope_to) - curve.force_at_angle(conditions.shear_slope_from)) / (conditions.shear_slope_to - conditions.shear_slope_from);
    shear = "measured curve";
  } else if (const auto g = mean(m.shear, m.warp.shear, m.weft.shear)) {
    card.shear = *g;
    shear = m.shear ? "KES-F: G" : "KES-F: mean of G of warp and weft";
    if (m.shear_force == ShearForce::raw) {
      card.shear -= conditions.shear_tension;
      shear += " less the tension";
    }
  } else if (m.fast && (m.fast->shear || m.fast->bias_extension)) {
    card.shear = m.fast->shear ? *m.fast->shear : from_bias(*m.fast);
    shear = m.fast->shear ? "FAST: G" : "FAST: load/(4 EB5)";
  } else {
    card.shear = *m.constants->shear;
    shear = "constants: G";
  }
  card.shear_hysteresis = mean(m.shear_hysteresis, m.warp.shear_hysteresis, m.weft.shear_hysteresis).value_or(0);
  card.shear_hysteresis_5 = mean(m.shear_hysteresis_5, m.warp.shear_hysteresis_5, m.weft.shear_hysteresis_5).value_or(0);
  card.friction = *mean(m.friction, m.warp.friction, m.weft.friction);
  const double both = std::sqrt(card.warp.bending * card.weft.bending);
  card.twist_ratio = m.bias_bending ? std::clamp((*m.bias_bending - 0.25 * (card.warp.bending + card.weft.bending)) / both, 0.0, twist_most) : m.twist_ratio.value_or(standard_twist);
  result.source["twist"] = m.bias_bending ? "B45 - (B_warp + B_weft)/4" : m.twist_ratio ? "twist_ratio" : "assumed, 0.3 sqrt(B_warp B_weft)";
  return result;
}

}  // namespace toile::fabric
