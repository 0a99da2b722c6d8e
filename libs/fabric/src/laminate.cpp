#include "toile/fabric/laminate.h"

#include "toile/fabric/constitutive.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace toile::fabric {
namespace {

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
TensionTable summed_tension(std::span<const Card> sheets, YarnDirection Card::*direction, double strain_max) {
  std::vector<double> points;
  for (const Card& sheet : sheets) {
    const YarnDirection& yarn = sheet.*direction;
    if (yarn.tension) {
      points.insert(points.end(), yarn.tension->strain.begin(), yarn.tension->strain.end());
    } else {
      for (int k = 1; k <= 16; ++k) points.push_back(yarn.strain_max * k / 16);
    }
  }
  points.push_back(strain_max);
  TensionTable table;
  table.strain = sorted_union(std::move(points), strain_max);
  table.force.assign(table.strain.size(), 0);
  for (const Card& sheet : sheets) {
    const TensileCurve curve = tensile_curve(sheet, sheet.*direction);
    for (std::size_t i = 0; i < table.strain.size(); ++i) table.force[i] += curve.at(table.strain[i]).force;
  }
  return table;
}

MomentTable summed_moment(std::span<const Card> sheets, YarnDirection Card::*direction) {
  std::vector<double> points;
  for (const Card& sheet : sheets) {
    if (const auto& moment = (sheet.*direction).moment) points.insert(points.end(), moment->curvature.begin(), moment->curvature.end());
  }
  MomentTable table;
  table.curvature = sorted_union(points, *std::max_element(points.begin(), points.end()));
  table.moment.assign(table.curvature.size(), 0);
  for (const Card& sheet : sheets) {
    const MomentCurve curve = moment_curve(sheet.*direction);
    for (std::size_t i = 0; i < table.curvature.size(); ++i) table.moment[i] += curve.at(table.curvature[i]).force;
  }
  return table;
}

ShearTable summed_shear(std::span<const Card> sheets) {
  std::vector<double> points;
  for (const Card& sheet : sheets) {
    if (sheet.shear_table) points.insert(points.end(), sheet.shear_table->angle.begin(), sheet.shear_table->angle.end());
    const Locking locking = used_locking(sheet);
    for (int k = 0; k <= 4; ++k) points.push_back(locking.angle + (locking.angle_end - locking.angle) * k / 4);
  }
  ShearTable table;
  const double last = *std::max_element(points.begin(), points.end());
  points.push_back(1.2 * last);  // the slope beyond all of them
  table.angle = sorted_union(points, 1.2 * last);
  table.force.assign(table.angle.size(), 0);
  for (const Card& sheet : sheets) {
    const ShearCurve curve = shear_curve(sheet);
    for (std::size_t i = 0; i < table.angle.size(); ++i) table.force[i] += curve.force_at_angle(table.angle[i]);
  }
  return table;
}

YarnDirection combined(std::span<const Card> sheets, YarnDirection Card::*direction) {
  const double force_max = sheets.front().tensile_force_max;
  std::vector<TensileCurve> curves;
  for (const Card& sheet : sheets) curves.push_back(tensile_curve(sheet, sheet.*direction));
  double strain_max = 0;
  for (const TensileCurve& curve : curves) strain_max = std::max(strain_max, strain_at(curve, force_max));
  double low = 0, high = strain_max;
  for (int step = 0; step < 200; ++step) {
    const double middle = 0.5 * (low + high);
    double force = 0;
    for (const TensileCurve& curve : curves) force += curve.at(middle).force;
    (force < force_max ? low : high) = middle;
  }
  YarnDirection result;
  result.strain_max = 0.5 * (low + high);
  double work = 0, returned = 0;
  result.bending = result.bending_hysteresis = 0;
  bool tension = false, moment = false;
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const YarnDirection& yarn = sheets[i].*direction;
    const double own = curves[i].at(result.strain_max).energy;
    work += own;
    returned += own * yarn.resilience;
    result.bending += yarn.bending;
    result.bending_hysteresis += yarn.bending_hysteresis;
    tension |= yarn.tension.has_value();
    moment |= yarn.moment.has_value();
  }
  result.linearity = std::clamp(2 * work / (force_max * result.strain_max), 0.3, 1.0);
  result.resilience = returned / work;
  if (tension) result.tension = summed_tension(sheets, direction, 1.5 * result.strain_max);
  if (moment) result.moment = summed_moment(sheets, direction);
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
  result.licence.reset();
  result.shear_table.reset();
  result.locking.reset();
  if (std::any_of(sheets.begin(), sheets.end(), [](const Card& sheet) { return sheet.shear_table || sheet.locking; })) result.shear_table = summed_shear(sheets);
  result.twist_ratio = twist / std::sqrt(result.warp.bending * result.weft.bending);
  return result;
}

}  // namespace toile::fabric
