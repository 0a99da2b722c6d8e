#include "toile/fabric/laminate.h"

#include "toile/fabric/constitutive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toile::fabric {
namespace {

enum Direction : std::size_t { warp = 0, weft = 1 };

/// Where the slope of a turned sheet's shear curve is taken: KES-F reads G up to there.
constexpr double shear_angle_read = 2.5 * std::numbers::pi / 180;

/// One sheet seen along the stack's warp and weft. A sheet that is turned by an angle a takes a strain e along the stack's
/// warp as e cos^2 a along its own warp, e sin^2 a along its weft and a shear of 2 e sin a cos a.
struct Part {
  std::array<double, 2> share{1, 0};  ///< cos^2, sin^2
  double cross = 0;                   ///< sin cos
  double cosine_of_double = 1;
  const Card* card = nullptr;
  std::array<TensileCurve, 2> tension;  ///< of its own yarns
  std::array<MomentCurve, 2> moment;
  ShearCurve shear_force;
  std::array<double, 2> resilience, bending, bending_hysteresis;
  double shear = 0, shear_hysteresis = 0, shear_hysteresis_5 = 0, twist = 0, thickness = 0;

  double along(Direction stack, std::size_t own) const { return share[stack == own ? 0 : 1]; }

  struct Pull {
    double work = 0, returned = 0, force = 0;
  };
  Pull pull(Direction direction, double strain) const {
    Pull result;
    for (std::size_t own : {warp, weft}) {
      const double part = along(direction, own);
      const CurvePoint point = tension[own].at(strain * part);
      result.work += point.energy;
      result.returned += point.energy * resilience[own];
      result.force += part * point.force;
    }
    const double angle = 2 * strain * cross;
    result.work += 0.5 * shear * angle * angle;
    result.returned += 0.5 * shear * angle * angle;
    result.force += 2 * cross * shear * angle;
    return result;
  }
  /// Membrane stiffness at no strain.
  double stiffness(Direction direction) const {
    double sum = 4 * cross * cross * shear;
    for (std::size_t own : {warp, weft}) sum += along(direction, own) * along(direction, own) * tension[own].slope_zero;
    return sum;
  }
  /// What the yarns give to the shear force of a turned sheet, the mean of shearing to either side.
  double shear_by_yarns(double angle) const {
    if (cross == 0) return 0;
    double sum = 0;
    for (std::size_t own : {warp, weft}) sum += 0.5 * cross * (tension[own].at(angle * cross).force - tension[own].at(-angle * cross).force);
    return sum;
  }
  double shear_at(double angle) const {
    const double own = angle * cosine_of_double;
    return shear_by_yarns(angle) + cosine_of_double * std::copysign(shear_force.force_at_angle(std::abs(own)), own);
  }
  double shear_stiffness() const { return shear * cosine_of_double * cosine_of_double + shear_by_yarns(shear_angle_read) / shear_angle_read; }
  double moment_at(Direction direction, double curvature) const {
    double sum = 4 * cross * cross * twist * curvature;
    for (std::size_t own : {warp, weft}) {
      const double part = along(direction, own);
      if (part > 0) sum += part * moment[own].at(part * curvature).force;
    }
    return sum;
  }
  double bending_stiffness(Direction direction) const {
    double sum = 4 * cross * cross * twist;
    for (std::size_t own : {warp, weft}) sum += along(direction, own) * along(direction, own) * bending[own];
    return sum;
  }
  double twist_stiffness() const { return twist * cosine_of_double * cosine_of_double + cross * cross * (bending[warp] + bending[weft]); }
  double of_yarns(Direction direction, const std::array<double, 2>& value) const { return along(direction, warp) * value[warp] + along(direction, weft) * value[weft]; }
};

Part part_of(const Sheet& sheet) {
  Part part;
  double cosine = std::cos(sheet.angle), sine = std::sin(sheet.angle);
  // Quarter turns are exact.
  if (std::abs(sine) < 1e-12) sine = 0;
  if (std::abs(cosine) < 1e-12) cosine = 0;
  part.share = {cosine * cosine, sine * sine};
  if (sine == 0 || cosine == 0) part.share = {std::round(part.share[0]), std::round(part.share[1])};
  part.cross = sine * cosine;
  part.cosine_of_double = part.share[0] - part.share[1];
  const Card& card = sheet.card;
  for (std::size_t own : {warp, weft}) {
    const YarnDirection& yarn = own == warp ? card.warp : card.weft;
    part.tension[own] = tensile_curve(card, yarn);
    part.moment[own] = moment_curve(yarn);
    part.resilience[own] = yarn.resilience;
    part.bending[own] = yarn.bending;
    part.bending_hysteresis[own] = yarn.bending_hysteresis;
  }
  part.card = &sheet.card;
  part.shear = card.shear;
  part.shear_force = shear_curve(card);
  part.shear_hysteresis = card.shear_hysteresis * std::abs(part.cosine_of_double);
  part.shear_hysteresis_5 = card.shear_hysteresis_5 * std::abs(part.cosine_of_double);
  part.twist = card.twist_ratio * std::sqrt(card.warp.bending * card.weft.bending);
  part.thickness = card.thickness;
  return part;
}

/// Sum over a plate of own + membrane (z - z_n)^2, and of the lost part of the second term; z_n is the neutral axis of the
/// membrane stiffness.
struct PlateSum {
  double stiffness = 0, lost = 0;
};
template <class Membrane, class Own, class Lost>
PlateSum plate_sum(std::span<const Part> plate, Membrane membrane, Own own, Lost lost) {
  PlateSum sum;
  for (const Part& part : plate) sum.stiffness += own(part);
  if (plate.size() == 1) return sum;
  std::vector<double> z;
  double top = 0, weight = 0, moment = 0;
  for (const Part& part : plate) {
    z.push_back(top + part.thickness / 2);
    top += part.thickness;
    weight += membrane(part);
    moment += membrane(part) * z.back();
  }
  const double neutral = moment / weight;
  for (std::size_t k = 0; k < plate.size(); ++k) {
    const double stretching = membrane(plate[k]) * (z[k] - neutral) * (z[k] - neutral);
    sum.stiffness += stretching;
    sum.lost += lost(plate[k]) * stretching;
  }
  return sum;
}

std::vector<double> sorted_union(std::vector<double> points, double last) {
  std::erase_if(points, [&](double p) { return p > last * (1 + 1e-9); });
  points.push_back(0);
  std::sort(points.begin(), points.end());
  // Points of several sheets that nearly coincide would make a slope of two roundings.
  std::vector<double> result;
  for (double p : points) {
    if (result.empty() || p > result.back() + 1e-6 * last) result.push_back(p);
  }
  return result;
}

/// Sum of the sheets' tensile curves at all their points, up to a strain.
TensionTable summed_tension(std::span<const Part> parts, Direction direction, double strain_max) {
  std::vector<double> points;
  for (const Part& part : parts) {
    for (const YarnDirection* yarn : {&part.card->warp, &part.card->weft}) {
      const double share = part.along(direction, yarn == &part.card->warp ? warp : weft);
      if (share == 0) continue;
      if (yarn->tension) {
        for (double strain : yarn->tension->strain) points.push_back(strain / share);
      } else {
        for (int k = 1; k <= 16; ++k) points.push_back(yarn->strain_max / share * k / 16);
      }
    }
  }
  points.push_back(strain_max);
  TensionTable table;
  table.strain = sorted_union(std::move(points), strain_max);
  table.force.assign(table.strain.size(), 0);
  for (const Part& part : parts) {
    for (std::size_t i = 0; i < table.strain.size(); ++i) table.force[i] += part.pull(direction, table.strain[i]).force;
  }
  return table;
}

/// Sum of the sheets' moments at all their points, and the stretching of glued sheets, proportional to the curvature.
MomentTable summed_moment(std::span<const Part> parts, Direction direction, double stretching) {
  std::vector<double> points;
  for (const Part& part : parts) {
    for (const YarnDirection* yarn : {&part.card->warp, &part.card->weft}) {
      const double share = part.along(direction, yarn == &part.card->warp ? warp : weft);
      if (share == 0 || !yarn->moment) continue;
      for (double curvature : yarn->moment->curvature) points.push_back(curvature / share);
    }
  }
  MomentTable table;
  table.curvature = sorted_union(points, *std::max_element(points.begin(), points.end()));
  for (double curvature : table.curvature) {
    table.moment.push_back(stretching * curvature);
    for (const Part& part : parts) table.moment.back() += part.moment_at(direction, curvature);
  }
  return table;
}

ShearTable summed_shear(std::span<const Part> parts) {
  std::vector<double> points;
  for (const Part& part : parts) {
    if (part.card->shear_table) points.insert(points.end(), part.card->shear_table->angle.begin(), part.card->shear_table->angle.end());
    const Locking locking = used_locking(*part.card);
    for (int k = 0; k <= 4; ++k) points.push_back(locking.angle + (locking.angle_end - locking.angle) * k / 4);
  }
  ShearTable table;
  const double last = *std::max_element(points.begin(), points.end());
  points.push_back(1.2 * last);  // the slope beyond all of them
  table.angle = sorted_union(points, 1.2 * last);
  table.force.assign(table.angle.size(), 0);
  for (const Part& part : parts) {
    for (std::size_t i = 0; i < table.angle.size(); ++i) table.force[i] += part.shear_at(table.angle[i]);
  }
  return table;
}

YarnDirection combined(std::span<const Part> parts, std::span<const std::span<const Part>> plates, Direction direction, double force_max, double curvature_read) {
  const auto pull = [&](double strain) {
    Part::Pull sum;
    for (const Part& part : parts) {
      const Part::Pull own = part.pull(direction, strain);
      sum.work += own.work;
      sum.returned += own.returned;
      sum.force += own.force;
    }
    return sum;
  };
  double low = 0, high = 0.01;
  while (pull(high).force < force_max && high < 100) high *= 2;
  for (int step = 0; step < 200; ++step) {
    const double middle = 0.5 * (low + high);
    (pull(middle).force < force_max ? low : high) = middle;
  }
  YarnDirection result;
  result.strain_max = 0.5 * (low + high);
  const Part::Pull all = pull(result.strain_max);
  result.linearity = std::clamp(2 * all.work / (force_max * result.strain_max), 0.3, 1.0);
  result.resilience = all.returned / all.work;
  result.bending = result.bending_hysteresis = 0;
  for (const Part& part : parts) result.bending_hysteresis += part.of_yarns(direction, part.bending_hysteresis);
  for (const auto& plate : plates) {
    const PlateSum sum = plate_sum(plate, [&](const Part& p) { return p.stiffness(direction); }, [&](const Part& p) { return p.bending_stiffness(direction); },
                                   [&](const Part& p) { return 1 - p.of_yarns(direction, p.resilience); });
    result.bending += sum.stiffness;
    // Sheets stretched by e = K |z - z_n| lose (1 - RT) C e^2 / 2 = 2 f e on the way there and back; the loop of the moment is 2 f |z - z_n| high.
    result.bending_hysteresis += 0.5 * sum.lost * curvature_read;
  }
  const auto sees = [&](const Part& part, std::size_t own) { return part.along(direction, own) > 0; };
  bool tension = false, moment = false;
  double own_bending = 0;
  for (const Part& part : parts) {
    tension |= (part.card->warp.tension && sees(part, warp)) || (part.card->weft.tension && sees(part, weft));
    moment |= (part.card->warp.moment && sees(part, warp)) || (part.card->weft.moment && sees(part, weft));
    own_bending += part.bending_stiffness(direction);
  }
  if (tension) result.tension = summed_tension(parts, direction, 1.5 * result.strain_max);
  if (moment) result.moment = summed_moment(parts, direction, result.bending - own_bending);
  return result;
}

}  // namespace

SlidingFriction sliding_friction(const Card& a, const Card& b, double pressure, double spacing) {
  const double stress = 0.5 * (a.friction + b.friction) * pressure;
  SlidingFriction result;
  result.shear = stress * spacing / 2;
  result.bending = result.shear * 0.5 * (a.thickness + b.thickness);
  return result;
}

Result<Card> stacked(std::span<const Sheet> sheets, std::span<const Bond> bonds, const std::string& name) {
  if (sheets.empty()) return Issue{"no_sheets", {.item = name}, "a laminate needs at least one sheet", "name a fabric"};
  TOILE_CHECK(bonds.size() + 1 == sheets.size(), "{} sheets and {} bonds", sheets.size(), bonds.size());
  Issues issues;
  for (const Sheet& sheet : sheets) {
    for (Issue issue : validate(sheet.card)) {
      issue.code = "bad_fabric";
      issue.place.item = "fabric " + sheet.card.name + ": " + issue.place.item;
      issues.push_back(issue);
    }
  }
  if (!issues.empty()) return issues;
  Card result = sheets.front().card;
  result.name = name;
  if (sheets.size() == 1 && sheets.front().angle == 0) return result;

  std::vector<Part> parts;
  for (const Sheet& sheet : sheets) parts.push_back(part_of(sheet));
  std::vector<std::span<const Part>> plates;
  std::size_t first = 0;
  bool glued = false, slides = false;
  for (std::size_t k = 1; k <= parts.size(); ++k) {
    if (k < parts.size() && bonds[k - 1].joint == Joint::laminate) {
      glued = true;
      continue;
    }
    if (k < parts.size() && bonds[k - 1].joint == Joint::sliding) slides = true;
    plates.emplace_back(parts.data() + first, k - first);
    first = k;
  }

  result.description = "bonded: ";
  result.origin = fmt::format("computed from its sheets as {}", !glued && !slides ? "parallel networks" : glued && slides ? "glued and sliding layers" : glued ? "a laminate" : "sliding layers");
  result.areal_density = result.thickness = result.shear = result.shear_hysteresis = result.shear_hysteresis_5 = 0;
  for (const Sheet& sheet : sheets) {
    result.description += (&sheet == &sheets.front() ? "" : " + ") + sheet.card.name;
    result.areal_density += sheet.card.areal_density;
    result.thickness += sheet.card.thickness;
  }
  for (const Part& part : parts) {
    result.shear += part.shear_stiffness();
    result.shear_hysteresis += part.shear_hysteresis;
    result.shear_hysteresis_5 += part.shear_hysteresis_5;
  }
  double twist = 0;
  for (const auto& plate : plates) {
    twist += plate_sum(plate, [](const Part& p) { return p.shear_stiffness(); }, [](const Part& p) { return p.twist_stiffness(); }, [](const Part&) { return 0.0; }).stiffness;
  }
  const double curvature_read = result.conditions.value_or(Conditions{}).bending_hysteresis_at;
  result.warp = combined(parts, plates, warp, result.tensile_force_max, curvature_read);
  result.weft = combined(parts, plates, weft, result.tensile_force_max, curvature_read);
  result.licence.reset();
  result.shear_table.reset();
  result.locking.reset();
  if (std::any_of(sheets.begin(), sheets.end(), [](const Sheet& sheet) { return sheet.card.shear_table || sheet.card.locking; })) result.shear_table = summed_shear(parts);
  for (const Bond& bond : bonds) {
    if (bond.joint != Joint::sliding) continue;
    result.warp.bending_hysteresis += bond.bending_friction;
    result.weft.bending_hysteresis += bond.bending_friction;
    result.shear_hysteresis += bond.shear_friction;
    result.shear_hysteresis_5 += bond.shear_friction;
  }
  result.twist_ratio = twist / std::sqrt(result.warp.bending * result.weft.bending);
  // What a card may hold: a stack of many sheets can leave its ranges.
  issues = validate(result);
  for (Issue& issue : issues) {
    issue.code = "bad_fabric";
    issue.place.item = "laminate " + name + ": " + issue.place.item;
    issue.remedy = "stack fewer sheets, or check their cards";
  }
  if (!issues.empty()) return issues;
  return result;
}

Result<Card> bonded(std::span<const Card> sheets, const std::string& name) {
  std::vector<Sheet> stack;
  for (const Card& card : sheets) stack.push_back({card, 0});
  return stacked(stack, std::vector<Bond>(sheets.empty() ? 0 : sheets.size() - 1), name);
}

}  // namespace toile::fabric
