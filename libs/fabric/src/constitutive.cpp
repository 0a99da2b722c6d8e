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

/// Integral of the cubic of a Hermite piece from its start to t.
double hermite_integral(double h, double y0, double y1, double m0, double m1, double t) {
  const double s = t / h, d = (y1 - y0) / h;
  const double c2 = 3 * d - 2 * m0 - m1, c3 = m0 + m1 - 2 * d;
  return t * (y0 + t * (m0 / 2 + s * (c2 / 3 + s * c3 / 4)));
}

/// Integral of piece.F(angle) cos(angle) from its start to t beyond it, by parts three times. sine and cosine are those of
/// the start; differences are formed first so that small steps keep their digits.
double shear_work(const ShearCurve::Piece& p, double t) {
  const double a = p.start, b = p.start + t;
  const double dsin = 2 * std::cos(0.5 * (a + b)) * std::sin(0.5 * t), dcos = -2 * std::sin(0.5 * (a + b)) * std::sin(0.5 * t);
  const double force = p.c0 + t * (p.c1 + t * (p.c2 + t * p.c3)), slope = p.c1 + t * (2 * p.c2 + 3 * t * p.c3), bend = 2 * p.c2 + 6 * t * p.c3;
  return p.c0 * dsin + (force - p.c0) * std::sin(b) + p.c1 * dcos + (slope - p.c1) * std::cos(b) - 2 * p.c2 * dsin - (bend - 2 * p.c2) * std::sin(b) -
         6 * p.c3 * dcos;
}

const ShearCurve::Piece& piece_at(const std::vector<ShearCurve::Piece>& pieces, double angle) {
  const auto after = std::upper_bound(pieces.begin(), pieces.end(), angle, [](double a, const ShearCurve::Piece& p) { return a < p.start; });
  return after == pieces.begin() ? pieces.front() : *(after - 1);
}

void close(ShearCurve& curve) {
  for (std::size_t i = 1; i < curve.pieces.size(); ++i) {
    const ShearCurve::Piece& before = curve.pieces[i - 1];
    curve.pieces[i].energy = before.energy + shear_work(before, curve.pieces[i].start - before.start);
  }
  curve.rigidity = curve.pieces.front().c1;
}

}  // namespace

MonotoneCurve monotone_curve(std::span<const double> x, std::span<const double> y) {
  const std::size_t n = x.size();
  TOILE_CHECK(n >= 2 && y.size() == n, "{} and {} values", n, y.size());
  MonotoneCurve curve;
  curve.x.assign(x.begin(), x.end());
  curve.y.assign(y.begin(), y.end());
  std::vector<double> h(n - 1), d(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h[i] = x[i + 1] - x[i];
    d[i] = (y[i + 1] - y[i]) / h[i];
  }
  curve.slope.assign(n, d.front());
  if (n > 2) {
    // Inside: the weighted harmonic mean, exact for parabolas to second order and never overshooting.
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double w0 = 2 * h[i] + h[i - 1], w1 = h[i] + 2 * h[i - 1];
      curve.slope[i] = (w0 + w1) / (w0 / d[i - 1] + w1 / d[i]);
    }
    // Ends: the parabola through three points, kept between a tenth and three times the end's own slope: a stiffness of zero
    // would leave the cloth without any, a larger one would overshoot.
    const auto end = [](double h0, double h1, double d0, double d1) {
      return std::clamp(((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1), 0.1 * d0, 3 * d0);
    };
    curve.slope.front() = end(h[0], h[1], d[0], d[1]);
    curve.slope.back() = end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
  }
  curve.energy.assign(n, 0);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    curve.energy[i + 1] = curve.energy[i] + hermite_integral(h[i], y[i], y[i + 1], curve.slope[i], curve.slope[i + 1], h[i]);
  }
  return curve;
}

CurvePoint MonotoneCurve::at(double value) const {
  const auto after = std::upper_bound(x.begin() + 1, x.end(), value);
  const auto i = static_cast<std::size_t>(after - x.begin()) - 1;
  const double t = value - x[i];
  if (after == x.end()) return {energy[i] + t * (y[i] + 0.5 * slope[i] * t), y[i] + slope[i] * t, slope[i]};
  const double h = x[i + 1] - x[i], s = t / h, d = (y[i + 1] - y[i]) / h;
  const double c2 = 3 * d - 2 * slope[i] - slope[i + 1], c3 = slope[i] + slope[i + 1] - 2 * d;
  return {energy[i] + hermite_integral(h, y[i], y[i + 1], slope[i], slope[i + 1], t), y[i] + t * (slope[i] + s * (c2 + s * c3)), slope[i] + s * (2 * c2 + 3 * s * c3)};
}

CurvePoint TensileCurve::at(double strain) const {
  if (strain <= 0 || (rate == 0 && table.empty())) return {0.5 * slope_zero * strain * strain, slope_zero * strain, slope_zero};
  if (!table.empty()) return table.at(strain);
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

TensileCurve tensile_curve(const Card& card, const YarnDirection& yarn) {
  if (!yarn.tension) return tensile_curve(card.tensile_force_max, yarn.strain_max, yarn.linearity);
  TensileCurve curve;
  curve.table = monotone_curve(yarn.tension->strain, yarn.tension->force);
  curve.slope_zero = curve.table.slope.front();
  curve.strain_linear = curve.table.x.back();
  return curve;
}

double strain_at(const TensileCurve& curve, double force) {
  double low = 0, high = 1e-3;
  while (curve.at(high).force < force && high < 1e6) high *= 2;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (curve.at(middle).force < force ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

CurvePoint ShearCurve::at(double sine) const {
  const double s = std::min(std::abs(sine), sine_linear), sign = sine < 0 ? -1.0 : 1.0;
  const double angle = std::asin(s), cosine = std::sqrt(1 - s * s);
  double energy = 0, force = 0, slope = 0;
  if (pieces.empty()) {
    energy = rigidity * (s * angle + cosine - 1);
    force = rigidity * angle;
    slope = rigidity / cosine;
  } else {
    const Piece& p = piece_at(pieces, angle);
    const double t = angle - p.start;
    energy = p.energy + shear_work(p, t);
    force = p.c0 + t * (p.c1 + t * (p.c2 + t * p.c3));
    slope = (p.c1 + t * (2 * p.c2 + 3 * t * p.c3)) / cosine;
  }
  const double rest = std::abs(sine) - s;
  return {energy + rest * (force + 0.5 * slope * rest), sign * (force + slope * rest), slope};
}

double ShearCurve::force_at_angle(double angle) const {
  const double size = std::abs(angle), sign = angle < 0 ? -1.0 : 1.0;
  if (pieces.empty()) return rigidity * angle;
  const Piece& p = piece_at(pieces, size);
  const double t = size - p.start;
  return sign * (p.c0 + t * (p.c1 + t * (p.c2 + t * p.c3)));
}

ShearCurve shear_curve(double rigidity, const Locking& locking) {
  ShearCurve curve;
  curve.rigidity = rigidity;
  if (!(locking.ratio > 1)) return curve;
  const double width = std::max(locking.angle_end - locking.angle, 1e-6), rise = (locking.ratio - 1) * rigidity / width;
  const double end = locking.angle + width, force = rigidity * locking.angle;
  if (locking.angle > 0) curve.pieces.push_back({0, 0, rigidity, 0, 0, 0});
  curve.pieces.push_back({locking.angle, force, rigidity, 0.5 * rise, 0, 0});
  curve.pieces.push_back({end, force + width * (rigidity + 0.5 * rise * width), rigidity + rise * width, 0, 0, 0});
  close(curve);
  return curve;
}

ShearCurve shear_curve(const ShearTable& table) {
  const MonotoneCurve points = monotone_curve(table.angle, table.force);
  ShearCurve curve;
  for (std::size_t i = 0; i + 1 < points.x.size(); ++i) {
    const double h = points.x[i + 1] - points.x[i], d = (points.y[i + 1] - points.y[i]) / h;
    curve.pieces.push_back({points.x[i], points.y[i], points.slope[i], (3 * d - 2 * points.slope[i] - points.slope[i + 1]) / h,
                            (points.slope[i] + points.slope[i + 1] - 2 * d) / (h * h), 0});
  }
  curve.pieces.push_back({points.x.back(), points.y.back(), points.slope.back(), 0, 0, 0});
  close(curve);
  return curve;
}

/// Stiffening is used only where a card states it: an estimate from 2HG5/2HG kept garments from coming to rest.
Locking used_locking(const Card& card) { return card.locking.value_or(Locking{}); }

ShearCurve shear_curve(const Card& card) { return card.shear_table ? shear_curve(*card.shear_table) : shear_curve(card.shear, used_locking(card)); }

MomentCurve moment_curve(const YarnDirection& yarn) {
  MomentCurve curve;
  curve.rigidity = yarn.bending;
  if (yarn.moment) {
    curve.table = monotone_curve(yarn.moment->curvature, yarn.moment->moment);
    curve.rigidity = curve.table.slope.front();
  }
  return curve;
}

CurvePoint MomentCurve::at(double curvature) const {
  if (table.empty()) return {0.5 * rigidity * curvature * curvature, rigidity * curvature, rigidity};
  CurvePoint point = table.at(std::abs(curvature));
  if (curvature < 0) point.force = -point.force;
  return point;
}

double ShearFriction::at(double angle) const {
  const double a = std::clamp(std::abs(angle), angle_first, std::max(angle_last, angle_first));
  if (!(angle_second > angle_first)) return first;
  return std::max(0.0, first + (second - first) * (a - angle_first) / (angle_second - angle_first));
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
    require(fmt::format("{}.RT", name), yarn.resilience, yarn.resilience >= 0 && yarn.resilience <= 1);
    require(fmt::format("{}.B", name), yarn.bending, yarn.bending > 0);
    require(fmt::format("{}.2HB", name), yarn.bending_hysteresis, yarn.bending_hysteresis >= 0);
  }
  require("W", card.areal_density, card.areal_density > 0);
  require("T", card.thickness, card.thickness > 0);
  require("G", card.shear, card.shear > 0);
  require("2HG", card.shear_hysteresis, card.shear_hysteresis >= 0);
  require("2HG5", card.shear_hysteresis_5, card.shear_hysteresis_5 >= 0);
  require("twist_ratio", card.twist_ratio, card.twist_ratio >= 0);
  require("MIU", card.friction, card.friction >= 0);
  // Tables and conditions are checked by their own descriptions.
  const auto check = [&](const std::string& key, Issues found) {
    for (Issue& issue : found) {
      issue.code = "bad_fabric";
      issue.place.item = fmt::format("fabric {}, {}.{}", card.name, key, issue.place.item);
      issues.push_back(std::move(issue));
    }
  };
  for (const auto& [name, yarn] : {std::pair<const char*, const YarnDirection&>{"warp", card.warp}, {"weft", card.weft}}) {
    if (yarn.tension) check(fmt::format("{}.tension", name), validate(*yarn.tension));
    if (yarn.moment) check(fmt::format("{}.moment", name), validate(*yarn.moment));
  }
  if (card.shear_table) check("shear", validate(*card.shear_table));
  if (card.locking) check("locking", validate(*card.locking));
  if (card.conditions) check("conditions", validate(*card.conditions));
  if (!issues.empty()) return issues;

  Constitutive result;
  result.name = card.name;
  result.conditions = card.conditions.value_or(Conditions{});
  result.warp = tensile_curve(card, card.warp);
  result.weft = tensile_curve(card, card.weft);

  result.locking = used_locking(card);
  result.shear = shear_curve(card);
  result.moment_warp = moment_curve(card.warp);
  result.moment_weft = moment_curve(card.weft);
  result.bending_warp = result.moment_warp.rigidity;
  result.bending_weft = result.moment_weft.rigidity;
  result.bending_twist = card.twist_ratio * std::sqrt(card.warp.bending * card.weft.bending);

  Hysteresis& loss = result.hysteresis;
  loss.moment_warp = card.warp.bending_hysteresis / 2;
  loss.moment_weft = card.weft.bending_hysteresis / 2;
  loss.shear.angle_first = result.conditions.shear_hysteresis_at;
  loss.shear.angle_second = result.conditions.shear_hysteresis_5_at;
  loss.shear.angle_last = std::max(result.conditions.shear_angle_max, loss.shear.angle_second);
  loss.shear.first = card.shear_hysteresis / 2;
  // A card without 2HG5 has a level loop.
  loss.shear.second = card.shear_hysteresis_5 > 0 ? card.shear_hysteresis_5 / 2 : loss.shear.first;
  loss.resilience_warp = card.warp.resilience;
  loss.resilience_weft = card.weft.resilience;

  result.areal_density = card.areal_density;
  result.thickness = card.thickness;
  result.friction = card.friction;
  return result;
}

}  // namespace toile::fabric
