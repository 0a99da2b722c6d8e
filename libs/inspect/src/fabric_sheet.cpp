#include "toile/inspect/fabric_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "text_table.h"
#include "toile/base/text.h"

namespace toile::inspect {
namespace {

using fabric::Constitutive;
using fabric::TensileCurve;

constexpr double degree = std::numbers::pi / 180;
constexpr double gravity = 9.80665;
constexpr double gf_per_cm = 0.980665, gf_cm = 9.80665e-5, gf = 9.80665e-3, gf_per_cm_deg = gf_per_cm / degree;

std::string significant(double value) { return fmt::format("{:.4g}", value); }

/// One yarn direction's curve in figures.
struct Tensile {
  double initial, secant, final;     ///< moduli [N/m]
  double strain_max, linearity, work;  ///< at F_max
  double at_garment_load;              ///< tangent at 5 N/m [N/m]
};

constexpr double garment_load = 5;  // a skirt's own weight at its waistband, about [N/m]

Tensile tensile(const TensileCurve& curve, double force_max) {
  Tensile t;
  t.strain_max = fabric::strain_at(curve, force_max);
  const auto end = curve.at(t.strain_max);
  t.initial = curve.slope_zero;
  t.secant = force_max / t.strain_max;
  t.final = end.slope;
  t.work = end.energy;
  t.linearity = 2 * end.energy / (force_max * t.strain_max);
  t.at_garment_load = curve.at(fabric::strain_at(curve, std::min(garment_load, force_max))).slope;
  return t;
}

struct Sample {
  double x, elastic, loading, unloading, slope;
};

/// F(strain), moment(curvature), F(angle) from 0 to the end of the test.
struct Curve {
  const char *kind, *direction;
  std::vector<Sample> points;
};

std::vector<Curve> curves(const FabricSheet& sheet) {
  const Constitutive& c = sheet.data;
  constexpr int steps = 60;
  std::vector<Curve> list;
  for (const bool warp : {true, false}) {
    const TensileCurve& curve = warp ? c.warp : c.weft;
    const double last = fabric::strain_at(curve, sheet.card.tensile_force_max), back = warp ? c.hysteresis.resilience_warp : c.hysteresis.resilience_weft;
    Curve out{"tension", warp ? "warp" : "weft", {}};
    for (int i = 0; i <= steps; ++i) {
      const double e = last * i / steps;
      const auto p = curve.at(e);
      out.points.push_back({e, p.force, p.force, back * p.force, p.slope});
    }
    list.push_back(std::move(out));
  }
  const double angle_max = std::max({c.conditions.shear_angle_max, sheet.card.shear_table ? sheet.card.shear_table->angle.back() : 0.0, c.locking.ratio > 1 ? c.locking.angle_end : 0.0});
  Curve shear{"shear", "", {}};
  for (int i = 0; i <= steps; ++i) {
    const double a = 1.25 * angle_max * i / steps;
    const double h = 1e-5, force = c.shear.force_at_angle(a), half = c.hysteresis.shear.at(a);
    shear.points.push_back({a, force, force + half, force - half, (c.shear.force_at_angle(a + h) - c.shear.force_at_angle(std::max(a - h, 0.0))) / (a + h - std::max(a - h, 0.0))});
  }
  list.push_back(std::move(shear));
  for (const bool warp : {true, false}) {
    const fabric::MomentCurve& curve = warp ? c.moment_warp : c.moment_weft;
    const double last = std::max(c.conditions.bending_curvature_max, curve.table.empty() ? 0.0 : curve.table.x.back());
    Curve out{"bending", warp ? "warp" : "weft", {}};
    for (int i = 0; i <= steps; ++i) {
      const double k = last * i / steps;
      const auto p = curve.at(k);
      const double half = warp ? c.hysteresis.moment_warp : c.hysteresis.moment_weft;
      out.points.push_back({k, p.force, p.force + half, p.force - half, p.slope});
    }
    list.push_back(std::move(out));
  }
  return list;
}

std::string issue_line(const Issue& issue) { return fmt::format("  {}; {}\n", issue.what, issue.remedy); }

}  // namespace

Result<FabricSheet> fabric_sheet(const fabric::Measured& measured) {
  TOILE_TRY(fabric::Resolved resolved, fabric::resolve(measured));
  TOILE_TRY(fabric::Constitutive data, fabric::constitutive(resolved.card));
  FabricSheet sheet;
  sheet.plausibility = fabric::plausibility(measured, resolved);
  sheet.judged = fabric::judged_figures(resolved.card);
  sheet.card = std::move(resolved.card);
  sheet.source = std::move(resolved.source);
  sheet.data = std::move(data);
  return sheet;
}

std::string fabric_text(const FabricSheet& sheet) {
  const fabric::Card& card = sheet.card;
  const Constitutive& c = sheet.data;
  const auto source = [&](const std::string& key) {
    const auto it = sheet.source.find(key);
    return it == sheet.source.end() ? std::string() : it->second;
  };
  std::string out = card.name + (card.description.empty() ? "" : ": " + card.description) + "\n";
  out += fmt::format("origin: {}{}\n", card.origin, card.licence ? ", licence: " + *card.licence : "");
  out += fmt::format("{:.1f} g/m2, {:.3g} mm thick, {:.2f} g/cm3, friction {:.3g}\n", card.areal_density * 1e3, card.thickness * 1e3, card.areal_density / card.thickness * 1e-3, card.friction);

  const Tensile warp = tensile(c.warp, card.tensile_force_max), weft = tensile(c.weft, card.tensile_force_max);
  out += fmt::format("\ntension up to {} N/m ({:.4g} gf/cm)\n", significant(card.tensile_force_max), card.tensile_force_max / gf_per_cm);
  std::vector<std::vector<std::string>> rows{{"", "warp", "weft", "unit"}};
  const auto pair = [&](const std::string& name, double a, double b, const std::string& unit) { rows.push_back({name, significant(a), significant(b), unit}); };
  const auto coefficient = [&](const char* name, double a, double b, const char* unit) {
    if (card.warp.tension || card.weft.tension) return;
    pair(name, a, b, unit);
  };
  rows.push_back({"from", source("warp.tension"), source("weft.tension"), ""});
  pair("EMT", 100 * warp.strain_max, 100 * weft.strain_max, "%");
  pair("LT", warp.linearity, weft.linearity, "1");
  pair("WT", warp.work, weft.work, "J/m2");
  pair("RT", 100 * card.warp.resilience, 100 * card.weft.resilience, "%");
  pair("initial modulus C(0)", warp.initial, weft.initial, "N/m");
  pair(fmt::format("tangent at {} N/m", garment_load), warp.at_garment_load, weft.at_garment_load, "N/m");
  pair("secant F_max/EMT", warp.secant, weft.secant, "N/m");
  pair("tangent at F_max", warp.final, weft.final, "N/m");
  pair("initial over secant", warp.initial / warp.secant, weft.initial / weft.secant, "1");
  coefficient("A of F = A (exp(b e) - 1)", c.warp.scale, c.weft.scale, "N/m");
  coefficient("b", c.warp.rate, c.weft.rate, "1");
  out += text_table(rows);

  out += "\nbending\n";
  rows = {{"", "warp (D22)", "weft (D11)", "unit"}};
  rows.push_back({"from", source("warp.bending"), source("weft.bending"), ""});
  pair("initial rigidity", c.bending_warp * 1e6, c.bending_weft * 1e6, "uN*m");
  pair("B", card.warp.bending / gf_cm, card.weft.bending / gf_cm, "gf*cm2/cm");
  pair("2HB", card.warp.bending_hysteresis / gf, card.weft.bending_hysteresis / gf, "gf*cm/cm");
  pair("half loop HB", c.hysteresis.moment_warp * 1e6, c.hysteresis.moment_weft * 1e6, "uN");
  pair("residual curvature 2HB/2B", 1e-2 * card.warp.bending_hysteresis / (2 * card.warp.bending), 1e-2 * card.weft.bending_hysteresis / (2 * card.weft.bending), "1/cm");
  pair("bending length (B/W g)^(1/3)", 1e3 * std::cbrt(card.warp.bending / (card.areal_density * gravity)), 1e3 * std::cbrt(card.weft.bending / (card.areal_density * gravity)), "mm");
  out += text_table(rows);
  out += fmt::format("  twist rigidity D66: {} uN*m ({}); strip at 45 deg: {} uN*m\n", significant(c.bending_twist * 1e6), source("twist"), significant((0.25 * (c.bending_warp + c.bending_weft) + c.bending_twist) * 1e6));

  out += "\nshear\n";
  rows = {{"", "", "unit"}};
  const auto one = [&](const std::string& name, double value, const std::string& unit) { rows.push_back({name, significant(value), unit}); };
  rows.push_back({"from", source("shear"), ""});
  one("G", card.shear, "N/m/rad");
  one("G", card.shear / gf_per_cm_deg, "gf/cm/deg");
  one(fmt::format("half loop at {} deg", significant(c.hysteresis.shear.angle_first / degree)), c.hysteresis.shear.first, "N/m");
  one(fmt::format("half loop at {} deg", significant(c.hysteresis.shear.angle_second / degree)), c.hysteresis.shear.second, "N/m");
  out += text_table(rows);
  if (card.shear_table) {
    out += "  locking: in the measured curve\n";
  } else if (c.locking.ratio > 1) {
    out += fmt::format("  locking: slope rises from {} to {} deg to {} G ({})\n", significant(c.locking.angle / degree), significant(c.locking.angle_end / degree), significant(c.locking.ratio), card.locking ? "given" : "estimated by 2HG5/2HG");
  } else {
    out += "  locking: none known\n";
  }

  out += "\nranges\n";
  rows = {{"", "value", "unit", "usual", "possible"}};
  const auto range = [](double low, double high) { return fmt::format("{:.4g} .. {:.4g}", low, high); };
  for (const fabric::Judged& j : sheet.judged) {
    rows.push_back({j.key, fmt::format("{:.4g}", j.value), j.unit, range(j.usual_low, j.usual_high), range(j.possible_low, j.possible_high)});
    if (!j.possible()) rows.back().push_back("impossible");
    else if (!j.usual()) rows.back().push_back("unusual");
  }
  out += text_table(rows);
  if (!sheet.plausibility.findings.empty()) {
    out += "\nimpossible or contradictory\n";
    for (const Issue& issue : sheet.plausibility.findings) out += issue_line(issue);
  }
  if (!sheet.plausibility.warnings.empty()) {
    out += "\nworth a second look\n";
    for (const Issue& issue : sheet.plausibility.warnings) out += issue_line(issue);
  }
  return out;
}

Json fabric_json(const FabricSheet& sheet) {
  const fabric::Card& card = sheet.card;
  const Constitutive& c = sheet.data;
  Json out = Json::object();
  out.set("name", card.name).set("origin", card.origin).set("licence", card.licence);
  out.set("areal_density", card.areal_density).set("thickness", card.thickness).set("friction", card.friction).set("force_max", card.tensile_force_max);
  for (const bool is_warp : {true, false}) {
    const fabric::YarnDirection& yarn = is_warp ? card.warp : card.weft;
    const TensileCurve& curve = is_warp ? c.warp : c.weft;
    const Tensile t = tensile(curve, card.tensile_force_max);
    Json j = Json::object();
    j.set("EMT", t.strain_max).set("LT", t.linearity).set("WT", t.work).set("RT", yarn.resilience);
    j.set("modulus_initial", t.initial).set("modulus_at_5_N_per_m", t.at_garment_load).set("modulus_secant", t.secant).set("modulus_final", t.final);
    if (!yarn.tension) j.set("curve_scale", curve.scale).set("curve_rate", curve.rate);
    j.set("bending_initial", is_warp ? c.bending_warp : c.bending_weft).set("B", yarn.bending).set("moment_half_loop", is_warp ? c.hysteresis.moment_warp : c.hysteresis.moment_weft);
    out.set(is_warp ? "warp" : "weft", std::move(j));
  }
  out.set("D11", c.bending_weft).set("D22", c.bending_warp).set("D66", c.bending_twist);
  out.set("shear", Json::object().set("G", card.shear).set("half_loop_first", c.hysteresis.shear.first).set("half_loop_second", c.hysteresis.shear.second)
                       .set("locking_angle", c.locking.angle).set("locking_angle_end", c.locking.angle_end).set("locking_ratio", c.locking.ratio));
  Json source = Json::object();
  for (const auto& [key, text] : sheet.source) source.set(key, text);
  out.set("source", std::move(source));
  Json ranges = Json::array();
  for (const fabric::Judged& j : sheet.judged) {
    ranges.push(Json::object().set("key", j.key).set("unit", j.unit).set("value", j.value).set("usual", Json::array().push(j.usual_low).push(j.usual_high))
                    .set("possible", Json::array().push(j.possible_low).push(j.possible_high)).set("verdict", !j.possible() ? "impossible" : !j.usual() ? "unusual" : "usual"));
  }
  out.set("ranges", std::move(ranges));
  for (const auto& [key, issues] : {std::pair<const char*, const Issues&>{"findings", sheet.plausibility.findings}, {"warnings", sheet.plausibility.warnings}}) {
    Json list = Json::array();
    for (const Issue& issue : issues) list.push(Json::object().set("code", issue.code).set("item", issue.place.item).set("what", issue.what).set("remedy", issue.remedy));
    out.set(key, std::move(list));
  }
  return out;
}

std::string fabric_csv(const FabricSheet& sheet) {
  std::string out = "curve,direction,x,elastic,loading,unloading,slope\n";
  for (const Curve& curve : curves(sheet)) {
    for (const Sample& p : curve.points) {
      out += fmt::format("{},{},{},{},{},{},{}\n", curve.kind, curve.direction, format_number(p.x), format_number(p.elastic), format_number(p.loading), format_number(p.unloading), format_number(p.slope));
    }
  }
  return out;
}

std::vector<Chart> fabric_charts(const FabricSheet& sheet) {
  constexpr Srgb warp_color{0.12, 0.35, 0.62}, weft_color{0.78, 0.33, 0.12}, shear_color{0.25, 0.5, 0.25};
  const Constitutive& c = sheet.data;
  std::vector<Chart> charts(4);
  charts[0] = {sheet.card.name + ": tension", "strain [%]", "force [N/m]", {}, {}, {}};
  charts[1] = {"stiffness in tension", "force [N/m]", "dF/de [kN/m]", {}, {}, {}};
  charts[2] = {"shear", "angle [\xC2\xB0]", "force [N/m]", {}, {}, {}};
  charts[3] = {"bending", "curvature [1/cm]", "moment [mN]", {}, {}, {}};
  const auto series = [](std::string name, const std::vector<Sample>& points, double x_unit, double y_unit, double Sample::*value, const Srgb& color, Stroke stroke) {
    Series s{std::move(name), {}, {}, color, stroke};
    for (const Sample& p : points) {
      s.x.push_back(p.x / x_unit);
      s.y.push_back(p.*value / y_unit);
    }
    return s;
  };
  for (const Curve& curve : curves(sheet)) {
    const std::string kind = curve.kind, direction = curve.direction;
    const Srgb& color = direction == "warp" ? warp_color : direction == "weft" ? weft_color : shear_color;
    if (kind == "tension") {
      charts[0].series.push_back(series(direction, curve.points, 0.01, 1, &Sample::elastic, color, Stroke::full));
      if ((direction == "warp" ? c.hysteresis.resilience_warp : c.hysteresis.resilience_weft) < 1) {
        charts[0].series.push_back(series(direction == "warp" ? "unloading" : "", curve.points, 0.01, 1, &Sample::unloading, color, Stroke::dashed));
      }
      Series stiffness{direction, {}, {}, color, Stroke::full};
      for (const Sample& p : curve.points) {
        stiffness.x.push_back(p.elastic);
        stiffness.y.push_back(p.slope * 1e-3);
      }
      charts[1].series.push_back(std::move(stiffness));
      continue;
    }
    const bool shear = kind == "shear";
    Chart& chart = charts[shear ? 2 : 3];
    const double x_unit = shear ? degree : 100, y_unit = shear ? 1 : 1e-3;
    chart.series.push_back(series(shear ? "elastic" : direction, curve.points, x_unit, y_unit, &Sample::elastic, color, Stroke::full));
    const bool loop = curve.points.front().loading > 0;
    if (loop) {
      chart.series.push_back(series("loop", curve.points, x_unit, y_unit, &Sample::loading, color, Stroke::dashed));
      chart.series.push_back(series("", curve.points, x_unit, y_unit, &Sample::unloading, color, Stroke::dashed));
      if (!shear && direction == "weft") chart.series[chart.series.size() - 2].name.clear();
    }
  }
  const auto dots = [](const std::vector<double>& x, const std::vector<double>& y, double x_unit, double y_unit, const Srgb& color) {
    Series s{"", {}, {}, color, Stroke::dots};
    for (double v : x) s.x.push_back(v / x_unit);
    for (double v : y) s.y.push_back(v / y_unit);
    return s;
  };
  for (const bool is_warp : {true, false}) {
    const fabric::YarnDirection& yarn = is_warp ? sheet.card.warp : sheet.card.weft;
    const Srgb& color = is_warp ? warp_color : weft_color;
    if (yarn.tension) charts[0].series.push_back(dots(yarn.tension->strain, yarn.tension->force, 0.01, 1, color));
    if (yarn.moment) charts[3].series.push_back(dots(yarn.moment->curvature, yarn.moment->moment, 100, 1e-3, color));
  }
  if (sheet.card.shear_table) charts[2].series.push_back(dots(sheet.card.shear_table->angle, sheet.card.shear_table->force, degree, 1, shear_color));
  return charts;
}

}  // namespace toile::inspect
