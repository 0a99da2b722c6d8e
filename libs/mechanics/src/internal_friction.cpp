#include "toile/mechanics/internal_friction.h"

#include "toile/base/parallel.h"
#include "toile/mechanics/sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace toile::mechanics {
namespace {

constexpr std::size_t grain = 1024;
// A loop is open by this part of the strain at which KES-F begins to read it.
constexpr double open_by = 0.5;

/// Where the force of a tensile curve is a given one >= 0; in closed form for the exponential.
double strain_of(const fabric::TensileCurve& curve, double force) {
  if (!(force > 0)) return 0;
  if (curve.table.empty()) {
    if (curve.rate == 0) return force / curve.slope_zero;
    const double e = std::log1p(force / curve.scale) / curve.rate;
    if (e <= curve.strain_linear) return e;
    const fabric::CurvePoint end = curve.at(curve.strain_linear);
    return curve.strain_linear + (force - end.force) / end.slope;
  }
  return fabric::strain_at(curve, force);
}

double sign_of(double value) { return value < 0 ? -1.0 : 1.0; }

}  // namespace

fabric::CurvePoint MomentSlider::at(double curvature) const {
  const double d = curvature - anchor, reach = stiffness > 0 ? limit / stiffness : 0;
  if (std::abs(d) <= reach) return {0.5 * stiffness * d * d, stiffness * d, stiffness};
  return {limit * (std::abs(d) - 0.5 * reach), sign_of(d) * limit, 0};
}

double MomentSlider::anchor_after(double curvature) const {
  const double d = curvature - anchor, reach = stiffness > 0 ? limit / stiffness : 0;
  return std::abs(d) <= reach ? anchor : curvature - sign_of(d) * reach;
}

double ShearLaw::limit(double angle) const { return level + growth * (std::clamp(std::abs(angle), from, to) - from); }

double ShearLaw::work(double angle) const {
  const double a = std::abs(angle), p = std::min(a, from), q = std::clamp(a, from, to), r = std::max(a, to);
  double sum = level * std::sin(p);
  if (q > from) sum += (level - growth * from) * (std::sin(q) - std::sin(from)) + growth * (q * std::sin(q) + std::cos(q) - from * std::sin(from) - std::cos(from));
  if (r > to) sum += limit(to) * (std::sin(r) - std::sin(to));
  return sign_of(angle) * sum;
}

ShearSlider shear_slider(const ShearLaw& law, double anchor) {
  ShearSlider slider{anchor, anchor, anchor};
  if (!(law.stiffness > 0)) return slider;
  // The spring is stiffer than the limit grows, so there is one crossing on either side. Newton, exact on straight pieces.
  for (const double side : {-1.0, 1.0}) {
    double angle = anchor + side * law.limit(anchor) / law.stiffness;
    for (int i = 0; i < 20; ++i) {
      const double a = std::abs(angle), excess = law.stiffness * side * (angle - anchor) - law.limit(angle);
      const double growth = a > law.from && a < law.to ? law.growth * side * sign_of(angle) : 0;
      const double step = excess / (law.stiffness - growth);
      angle -= side * step;
      if (std::abs(step) < 1e-15) break;
    }
    (side < 0 ? slider.low : slider.high) = angle;
  }
  return slider;
}

fabric::CurvePoint ShearSlider::at(const ShearLaw& law, double sine) const {
  if (!(law.stiffness > 0)) return {};
  const fabric::ShearCurve straight;
  const double s = std::clamp(sine, -straight.sine_linear, straight.sine_linear), angle = std::asin(s), cosine = std::sqrt(1 - s * s);
  const auto spring = [&](double t) { return law.stiffness * ((t - anchor) * std::sin(t) + std::cos(t) - std::cos(anchor)); };
  fabric::CurvePoint p;
  if (angle > high || angle < low) {
    const double side = angle > high ? 1 : -1, end = side > 0 ? high : low, a = std::abs(angle);
    p.force = side * law.limit(angle);
    p.slope = a > law.from && a < law.to ? side * sign_of(angle) * law.growth / cosine : 0;
    p.energy = spring(end) + side * (law.work(angle) - law.work(end));
  } else {
    p.force = law.stiffness * (angle - anchor);
    p.slope = law.stiffness / cosine;
    p.energy = spring(angle);
  }
  if (s != sine) {
    p.energy += (sine - s) * p.force;
    p.slope = 0;
  }
  return p;
}

double ShearSlider::anchor_after(const ShearLaw& law, double sine) const {
  if (!(law.stiffness > 0)) return anchor;
  const fabric::ShearCurve straight;
  const double angle = std::asin(std::clamp(sine, -straight.sine_linear, straight.sine_linear));
  if (angle > high) return angle - law.limit(angle) / law.stiffness;
  if (angle < low) return angle + law.limit(angle) / law.stiffness;
  return anchor;
}

StretchSlider stretch_slider(const fabric::TensileCurve& curve, double loss, double anchor) {
  StretchSlider slider;
  slider.anchor = std::max(anchor, 0.0);
  const double k = tensile_slider_stiffness;
  slider.low = k * slider.anchor / (k + loss);
  slider.high = k * slider.anchor / (k - loss);
  if (!(slider.anchor > 0) || !(loss > 0)) return slider;
  const auto energy = [&](double force) { return curve.at(strain_of(curve, force)).energy; };
  // Stuck: k (E - anchor e) from the anchor on; beyond, loss (E - E_end) more or less than at the end.
  const double e = strain_of(curve, slider.anchor);
  slider.energy_stuck = -k * (curve.at(e).energy - slider.anchor * e);
  const auto stuck = [&](double force) {
    const double strain = strain_of(curve, force);
    return k * (curve.at(strain).energy - slider.anchor * strain) + slider.energy_stuck;
  };
  slider.energy_low = stuck(slider.low) + loss * energy(slider.low);
  slider.energy_high = stuck(slider.high) - loss * energy(slider.high);
  return slider;
}

fabric::CurvePoint StretchSlider::at(const fabric::TensileCurve& curve, double loss, double strain) const {
  const fabric::CurvePoint p = curve.at(strain);
  if (!(loss > 0)) return p;
  const double k = tensile_slider_stiffness;
  if (strain <= 0) return {p.energy + energy_low, p.force, p.slope};
  if (p.force > high) return {p.energy + energy_high, p.force, p.slope};
  if (p.force < low) return {(1 - 2 * loss) * p.energy + energy_low, (1 - 2 * loss) * p.force, (1 - 2 * loss) * p.slope};
  return {(1 - loss + k) * p.energy - k * anchor * strain + energy_stuck, (1 - loss + k) * p.force - k * anchor, (1 - loss + k) * p.slope};
}

double StretchSlider::anchor_after(const fabric::TensileCurve& curve, double loss, double strain) const {
  if (!(loss > 0)) return anchor;
  const double force = std::max(curve.at(strain).force, 0.0), k = tensile_slider_stiffness;
  if (force > high) return force * (1 - loss / k);
  if (force < low) return force * (1 + loss / k);
  return anchor;
}

InternalFriction::Law friction_law(const fabric::Constitutive& fabric) {
  InternalFriction::Law law;
  law.loss_weft = 0.5 * (1 - fabric.hysteresis.resilience_weft);
  law.loss_warp = 0.5 * (1 - fabric.hysteresis.resilience_warp);
  const fabric::ShearFriction& loop = fabric.hysteresis.shear;
  if (!(loop.first > 0 || loop.second > 0)) return law;
  law.shear.from = loop.angle_first;
  law.shear.to = std::max(loop.angle_last, loop.angle_first);
  law.shear.level = loop.first;
  if (loop.angle_second > loop.angle_first) law.shear.growth = (loop.second - loop.first) / (loop.angle_second - loop.angle_first);
  // A loop that narrows does not turn inside out.
  if (law.shear.growth < 0) law.shear.to = std::min(law.shear.to, law.shear.from - law.shear.level / law.shear.growth);
  law.shear.stiffness = std::max({slider_stiffness * fabric.shear.rigidity, law.shear.level / (open_by * fabric.conditions.shear_hysteresis_at), 2 * std::abs(law.shear.growth)});
  return law;
}

MomentSlider moment_slider(const fabric::Constitutive& fabric, double rigidity, double half_height) {
  MomentSlider slider;
  slider.limit = half_height;
  if (half_height > 0) slider.stiffness = std::max(slider_stiffness * rigidity, half_height / (open_by * fabric.conditions.bending_slope_from));
  return slider;
}

fabric::ShearCurve elastic_shear(const fabric::Constitutive& fabric, const fabric::Card& card) {
  if (card.shear_table) return fabric.shear;
  const ShearLaw law = friction_law(fabric).shear;
  const double a = fabric.conditions.shear_slope_from, b = fabric.conditions.shear_slope_to;
  if (!(law.stiffness > 0) || !(b > a)) return fabric.shear;
  const double growth = (law.limit(b) - law.limit(a)) / (b - a), rigidity = fabric.shear.rigidity;
  // On the way back the slope is less by the same; some of it stays.
  return fabric::shear_curve(growth > 0 ? std::max(rigidity - growth, 1.05 * growth) : rigidity - growth, fabric.locking);
}

namespace {

double curvature_of(const Sheet& sheet, const InternalFriction::Bending& b, std::size_t element, const mesh::Points3& x) {
  const auto first = static_cast<std::size_t>(sheet.element_start[element]), last = static_cast<std::size_t>(sheet.element_start[element + 1]) - 4;
  const auto row = [&](int n) -> Eigen::Vector3d { return x.row(n).transpose(); };
  const Eigen::Vector3d base = row(sheet.element_node[first]);
  Eigen::Vector3d k = Eigen::Vector3d::Zero();
  for (std::size_t p = first; p < last; ++p) k += sheet.friction->form_coefficient[static_cast<std::size_t>(b.form_begin) + p - first] * (row(sheet.element_node[p]) - base);
  const Eigen::Vector3d n = (row(b.normal[0]) - row(b.normal[1])).cross(row(b.normal[2]) - row(b.normal[3]));
  return k.dot(n) / std::max(n.norm(), 1e-30);
}

}  // namespace

void advance_friction(Sheet& sheet, const mesh::Points3& x) {
  if (!sheet.friction) return;
  InternalFriction& f = *sheet.friction;
  parallel_for(f.bending.size(), grain, [&](std::size_t i) {
    InternalFriction::Bending& b = f.bending[i];
    b.slider.anchor = b.slider.anchor_after(curvature_of(sheet, b, sheet.hinges.size() + i, x));
  });
  const auto stretch = [](std::array<StretchSlider, 2>& sliders, const fabric::Constitutive& fabric, const InternalFriction::Law& law, const YarnState& s) {
    for (std::size_t yarn = 0; yarn < 2; ++yarn) {
      const fabric::TensileCurve& curve = yarn == 0 ? fabric.weft : fabric.warp;
      const double loss = yarn == 0 ? law.loss_weft : law.loss_warp, anchor = sliders[yarn].anchor_after(curve, loss, (yarn == 0 ? s.weft : s.warp) - 1);
      if (anchor != sliders[yarn].anchor) sliders[yarn] = stretch_slider(curve, loss, anchor);
    }
  };
  parallel_for(sheet.units.size(), grain, [&](std::size_t u) {
    const MembraneUnit& unit = sheet.units[u];
    YarnState mean{0, 0, 0};
    double area = 0;
    for (const int face : {unit.first, unit.second}) {
      if (face < 0) continue;
      const auto i = static_cast<std::size_t>(face);
      const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[i]);
      const YarnState s = yarn_state(yarn_gradient(sheet, x, i));
      const double anchor = f.shear[i].anchor_after(f.laws[fabric].shear, s.sine);
      if (anchor != f.shear[i].anchor) f.shear[i] = shear_slider(f.laws[fabric].shear, anchor);
      stretch(f.stretch[i], sheet.fabrics[fabric], f.laws[fabric], s);
      mean.weft += sheet.shapes[i].area * s.weft;
      mean.warp += sheet.shapes[i].area * s.warp;
      area += sheet.shapes[i].area;
    }
    if (unit.second < 0) return;
    mean.weft /= area;
    mean.warp /= area;
    const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[static_cast<std::size_t>(unit.first)]);
    stretch(f.pair_stretch[u], sheet.fabrics[fabric], f.laws[fabric], mean);
  });
}

namespace {

// In this order: anchors of both sides of a vertex along weft and warp; of faces off the grid; of a face's shear and stretch; of the
// stretch that it has in common with its partner.
constexpr std::array vertex_columns{"slip_weft_plus", "slip_weft_minus", "slip_warp_plus", "slip_warp_minus"};
constexpr std::array face_columns{"slip_weft", "slip_warp", "slip_shear", "slip_stretch_weft", "slip_stretch_warp", "slip_pair_weft", "slip_pair_warp"};

}  // namespace

void store_friction(const Sheet& sheet, mesh::GarmentMesh& garment) {
  for (const char* name : vertex_columns) garment.vertex_columns.erase(name);
  for (const char* name : face_columns) garment.face_columns.erase(name);
  if (!sheet.friction) return;
  const InternalFriction& f = *sheet.friction;
  std::array<mesh::Column, 4> vertex;
  for (mesh::Column& c : vertex) c.reals.assign(static_cast<std::size_t>(garment.vertex_count()), 0);
  std::array<mesh::Column, 7> face;
  for (mesh::Column& c : face) c.reals.assign(static_cast<std::size_t>(garment.face_count()), 0);
  for (const InternalFriction::Bending& b : f.bending) {
    if (b.vertex >= 0) {
      for (int side = 0; side < 2; ++side) {
        if ((b.sides >> side & 1) != 0) vertex[static_cast<std::size_t>(2 * b.warp + side)].reals[static_cast<std::size_t>(b.vertex)] = b.slider.anchor;
      }
    } else {
      face[b.warp ? 1 : 0].reals[static_cast<std::size_t>(b.face)] = b.slider.anchor;
    }
  }
  bool stretches = false, pairs = false;
  for (std::size_t i = 0; i < f.shear.size(); ++i) {
    face[2].reals[i] = f.shear[i].anchor;
    for (std::size_t yarn = 0; yarn < 2; ++yarn) {
      face[3 + yarn].reals[i] = f.stretch[i][yarn].anchor;
      stretches = stretches || f.stretch[i][yarn].anchor != 0;
    }
  }
  for (std::size_t u = 0; u < sheet.units.size(); ++u) {
    if (sheet.units[u].second < 0) continue;
    for (std::size_t yarn = 0; yarn < 2; ++yarn) {
      for (const int i : {sheet.units[u].first, sheet.units[u].second}) face[5 + yarn].reals[static_cast<std::size_t>(i)] = f.pair_stretch[u][yarn].anchor;
      pairs = pairs || f.pair_stretch[u][yarn].anchor != 0;
    }
  }
  for (std::size_t c = 0; c < 4; ++c) garment.vertex_columns[vertex_columns[c]] = std::move(vertex[c]);
  for (std::size_t c = 0; c < 7; ++c) {
    if ((c >= 3 && !stretches) || (c >= 5 && !pairs)) continue;
    garment.face_columns[face_columns[c]] = std::move(face[c]);
  }
}

void read_friction(const mesh::GarmentMesh& garment, Sheet& sheet) {
  if (!sheet.friction) return;
  InternalFriction& f = *sheet.friction;
  const auto find = [](const std::map<std::string, mesh::Column>& columns, const char* name) {
    const auto it = columns.find(name);
    return it == columns.end() || it->second.integer ? nullptr : &it->second.reals;
  };
  std::array<const std::vector<double>*, 4> vertex;
  for (std::size_t c = 0; c < 4; ++c) vertex[c] = find(garment.vertex_columns, vertex_columns[c]);
  std::array<const std::vector<double>*, 7> face;
  for (std::size_t c = 0; c < 7; ++c) face[c] = find(garment.face_columns, face_columns[c]);
  const auto value = [](const std::vector<double>* column, int i) { return column == nullptr ? 0.0 : (*column)[static_cast<std::size_t>(i)]; };
  for (InternalFriction::Bending& b : f.bending) {
    if (b.vertex < 0) {
      b.slider.anchor = value(face[b.warp ? 1 : 0], b.face);
      continue;
    }
    const double plus = value(vertex[b.warp ? 2 : 0], b.vertex), minus = value(vertex[b.warp ? 3 : 1], b.vertex);
    b.slider.anchor = b.sides == 1 || plus == minus ? plus : b.sides == 2 ? minus : 0.5 * (plus + minus);
  }
  for (std::size_t i = 0; i < f.shear.size(); ++i) {
    const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[i]);
    f.shear[i] = shear_slider(f.laws[fabric].shear, value(face[2], static_cast<int>(i)));
    f.stretch[i] = {stretch_slider(sheet.fabrics[fabric].weft, f.laws[fabric].loss_weft, value(face[3], static_cast<int>(i))),
                    stretch_slider(sheet.fabrics[fabric].warp, f.laws[fabric].loss_warp, value(face[4], static_cast<int>(i)))};
  }
  for (std::size_t u = 0; u < sheet.units.size(); ++u) {
    const int i = sheet.units[u].first;
    const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[static_cast<std::size_t>(i)]);
    f.pair_stretch[u] = {stretch_slider(sheet.fabrics[fabric].weft, f.laws[fabric].loss_weft, value(face[5], i)),
                         stretch_slider(sheet.fabrics[fabric].warp, f.laws[fabric].loss_warp, value(face[6], i))};
  }
}

}  // namespace toile::mechanics
