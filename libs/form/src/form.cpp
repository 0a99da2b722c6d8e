#include "toile/form/form.h"

#include "gauge.h"
#include "shape.h"
#include "surface_mesher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace toile::form {

using Eigen::Vector3d;

namespace {

struct Target {
  const char* name;
  bool girth;
  double requested;
};

std::vector<Target> targets(const Measurements& m, const FormParams& params) {
  std::vector<Target> t = {
      {"neck", true, m.neck}, {"chest", true, m.chest}, {"waist", true, m.waist}, {"hips", true, m.hips}, {"seat", true, m.seat},
      {"shoulderToShoulder", false, m.shoulderToShoulder}, {"shoulderSlope", false, m.shoulderSlope},
      {"hpsToWaistBack", false, m.hpsToWaistBack}, {"hpsToBust", false, m.hpsToBust}, {"waistToArmpit", false, m.waistToArmpit},
      {"waistToHips", false, m.waistToHips}, {"waistToSeat", false, m.waistToSeat}, {"waistToFloor", false, m.waistToFloor}};
  if (params.arms) {
    t.insert(t.begin() + 5, {{"biceps", true, m.biceps}, {"wrist", true, m.wrist}});
    t.push_back({"shoulderToElbow", false, m.shoulderToElbow});
    t.push_back({"shoulderToWrist", false, m.shoulderToWrist});
  }
  if (params.legs) {
    for (const Target& leg : {Target{"upperLeg", true, *m.upperLeg}, Target{"knee", true, *m.knee}, Target{"ankle", true, *m.ankle}, Target{"inseam", false, *m.inseam}}) t.push_back(leg);
  }
  if (params.sex == Sex::female && m.bustSpan) t.push_back({"bustSpan", false, *m.bustSpan});
  if (params.sex == Sex::female && m.underbust) t.insert(t.begin() + 2, {"underbust", true, *m.underbust});
  return t;
}

/// Fitting: every measure corrects the quantity it depends on most, by a share of what is missing. A share shrinks when
/// the measure has been overshot and grows when it hardly moves, so that quantities that act on each other settle.
class Fitting {
 public:
  Fitting(const Measurements& m, const FormParams& params) : m_(m), params_(params) {}

  Tuning corrected(Tuning t, const Gauge& g) {
    const Measurements& m = m_;
    const double u = 0.5 * (m.chest + m.hpsToWaistBack / 0.46);
    const auto scale = [&](double& factor, const char* name, double requested) {
      const double missing = step(g, name, requested, 1.0);
      factor = std::clamp(factor * std::clamp(1 + missing / requested, 0.85, 1.18), 0.4, 2.5);
    };
    const auto shift = [&](double& length, const char* name, double requested, double share, double most) {
      length += std::clamp(share * step(g, name, requested, 0.9), -most, most);
    };
    scale(t.neck, "neck", m.neck);
    scale(t.chest, "chest", m.chest);
    scale(t.waist, "waist", m.waist);
    scale(t.hips, "hips", m.hips);
    scale(t.seat, "seat", m.seat);
    if (params_.sex == Sex::female && m.underbust) scale(t.underbust, "underbust", *m.underbust);
    shift(t.hps_height, "hpsToWaistBack", m.hpsToWaistBack, 1, 0.03 * u);
    shift(t.slope, "shoulderSlope", m.shoulderSlope, 0.7, 0.06);
    t.slope = std::clamp(t.slope, 0.03, 0.9);
    shift(t.bust_height, "hpsToBust", m.hpsToBust, -1, 0.03 * u);
    if (params_.sex == Sex::female && m.bustSpan) {
      shift(t.bust_out, "bustSpan", *m.bustSpan, 0.6, 0.01 * u);
      t.bust_out = std::clamp(t.bust_out, -0.03 * u, 0.05 * u);
    }
    if (params_.arms) {
      scale(t.biceps, "biceps", m.biceps);
      scale(t.wrist, "wrist", m.wrist);
      shift(t.arm_root, "waistToArmpit", m.waistToArmpit, -0.7, 0.012 * u);
      t.arm_root = std::clamp(t.arm_root, -0.07 * u, 0.15 * u);
      shift(t.elbow, "shoulderToElbow", m.shoulderToElbow, 1, 0.03 * u);
      shift(t.hand, "shoulderToWrist", m.shoulderToWrist, 1, 0.05 * u);
    }
    if (params_.legs) {
      scale(t.thigh, "upperLeg", *m.upperLeg);
      scale(t.knee, "knee", *m.knee);
      scale(t.ankle, "ankle", *m.ankle);
      shift(t.crotch, "inseam", *m.inseam, -1, 0.02 * u);
      t.crotch = std::clamp(t.crotch, -0.1 * u, 0.1 * u);
    }
    return t;
  }

 private:
  struct History {
    double share, missing;
  };
  double step(const Gauge& g, const char* name, double requested, double share) {
    const auto it = g.values.find(name);
    if (it == g.values.end() || it->second <= 0) return 0;
    const double missing = requested - it->second;
    const auto [entry, fresh] = history_.try_emplace(name, History{share, missing});
    History& h = entry->second;
    if (!fresh) {
      if (missing * h.missing < 0 && std::abs(missing) > 0.2 * std::abs(h.missing)) h.share = std::max(0.2, 0.65 * h.share);
      else if (missing * h.missing > 0 && std::abs(missing) > 0.5 * std::abs(h.missing)) h.share = std::min(2.5, 1.25 * h.share);
      h.missing = missing;
    }
    return h.share * missing;
  }
  Measurements m_;
  FormParams params_;
  std::map<std::string, History> history_;
};

double misfit(const Gauge& g, const std::vector<Target>& wanted) {
  double worst = 0;
  for (const Target& t : wanted) {
    const auto it = g.values.find(t.name);
    if (it == g.values.end()) return 1;
    const double scale = std::string(t.name) == "shoulderSlope" ? 0.15 : 1;
    worst = std::max(worst, scale * std::abs(it->second - t.requested) / (t.girth ? 1 : 2.5));
  }
  return worst;
}

enum Region { torso, neck, arm_left, arm_right };

// Names of a form's regions in the order of its face_region.
std::vector<std::string> region_names(const FormParams& params) {
  std::vector<std::string> names = {"torso", "neck"};
  if (params.arms) names.insert(names.end(), {"arm_left", "arm_right"});
  if (params.legs) names.insert(names.end(), {"leg_left", "leg_right"});
  return names;
}

/// Of a point of the surface, by the landmarks: the armhole runs from the shoulder tip to the armpit; under it the side
/// of the torso is nearer to the axis than the armpit and the arm farther.
int region(const Vector3d& p, const Levels& l, const Gauge& gauge, const FormParams& params) {
  const auto at = [&](const char* name) { return Vector3d(gauge.landmarks.at(name).data()); };
  const double side = std::abs(p.x());
  if ((p - l.neck_point).dot(l.neck_normal) > 0 && side < 1.15 * at("hps_left").x()) return neck;
  if (params.legs && p.y() < at("crotch").y()) return (params.arms ? 4 : 2) + (p.x() > 0 ? 0 : 1);
  if (!params.arms) return torso;
  const Vector3d tip = at("shoulder_left"), pit = at("armpit_left");
  const double share = std::max((p.y() - pit.y()) / (tip.y() - pit.y()), 0.0);
  if (side <= pit.x() + share * (tip.x() - pit.x())) return torso;
  return p.x() > 0 ? arm_left : arm_right;
}

/// What legs need of the measurements.
Issues leg_issues(const Measurements& m) {
  Issues issues;
  for (const auto& [name, value] : {std::pair("inseam", m.inseam), std::pair("upperLeg", m.upperLeg), std::pair("knee", m.knee), std::pair("ankle", m.ankle)}) {
    if (!value) issues.push_back({"missing_measurement", {.item = name}, fmt::format("{} is not given, which legs need", name), "add it to the measurements, or leave out `legs`"});
  }
  if (!issues.empty()) return issues;
  const auto mm = [](double metres) { return fmt::format("{:.0f} mm", metres * 1000); };
  const auto between = [&](const char* key, double value, double low, double high, const char* why) {
    if (value >= low && value <= high) return;
    issues.push_back({"implausible_measurement", {.item = key}, fmt::format("{} is {}", key, mm(value)), fmt::format("{}: expected {} to {}; check the value and its unit", why, mm(low), mm(high))});
  };
  between("inseam", *m.inseam, m.waistToFloor - m.waistToSeat - 0.12, m.waistToFloor - m.waistToSeat - 0.02, "the crotch lies under the seat");
  between("upperLeg", *m.upperLeg, 0.48 * m.seat, 0.7 * m.seat, "against the seat");
  between("knee", *m.knee, 0.55 * *m.upperLeg, 0.85 * *m.upperLeg, "against the upper leg");
  between("ankle", *m.ankle, 0.45 * *m.knee, 0.85 * *m.knee, "against the knee");
  if (m.waistToKnee) between("waistToKnee", *m.waistToKnee, m.waistToFloor - 0.68 * *m.inseam, m.waistToFloor - 0.45 * *m.inseam, "against inseam and waistToFloor");
  return issues;
}

double smallest_angle(const mesh::Points3& x, const mesh::Triangles& faces) {
  double least = 4;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d a = x.row(faces(f, k)), b = x.row(faces(f, (k + 1) % 3)), c = x.row(faces(f, (k + 2) % 3));
      least = std::min(least, std::atan2((b - a).cross(c - a).norm(), (b - a).dot(c - a)));
    }
  }
  return least;
}

}  // namespace

Result<Form> make_form(const Measurements& m, const FormParams& params) {
  Issues issues = validate(m);
  append(issues, validate(params));
  if (params.legs) append(issues, leg_issues(m));
  if (!issues.empty()) return issues;

  const std::vector<Target> wanted = targets(m, params);
  Tuning tuning = first_tuning(m, params);
  Fitting fitting(m, params);
  Form form;

  // First on rough meshes, cheap to make anew in every round.
  for (int round = 0; round < 10; ++round) {
    const Shape shape(m, params, tuning);
    const Field field = [&](const Vector3d& p) { return shape(p); };
    const HalfSurface rough = polygonise(field, shape.low(), shape.high(), 0.022 * shape.levels().unit);
    const Whole whole = mirrored(rough);
    Gauge gauge = measure(whole.x, whole.faces, shape.levels(), params);
    ++form.iterations;
    if (misfit(gauge, wanted) < 0.006) break;
    tuning = fitting.corrected(tuning, gauge);
  }

  // Then the mesh itself: wanted size by wanted number of vertices; the same triangles follow the shape while the measures
  // are brought home on the mesh as it will be delivered. Where the shape has moved so far that triangles got thin, anew.
  HalfSurface half;
  Whole whole;
  Gauge gauge;
  Levels levels;
  double edge = 0;
  for (int mesh_round = 0; mesh_round < 3; ++mesh_round) {
    const Shape shape(m, params, tuning);
    const Field field = [&](const Vector3d& p) { return shape(p); };
    const double u = shape.levels().unit;
    if (mesh_round == 0) {
      half = polygonise(field, shape.low(), shape.high(), 0.022 * u);
      edge = 0.0165 * u * std::sqrt(6000.0 / params.vertices);
    }
    for (int attempt = 0; attempt < 5; ++attempt) {
      const Sizing sizing = [&](const Vector3d& p) { return edge * shape.sizing(p); };
      half = remesh(std::move(half), field, sizing, mesh_round == 0 && attempt == 0 ? 8 : 4);
      const double ratio = static_cast<double>(mirrored_vertex_count(half)) / params.vertices;
      if (std::abs(ratio - 1) < 0.02) break;
      edge *= std::sqrt(ratio);
    }
  Fitting fitting_mesh(m, params);
    for (int round = 0; round < 15; ++round) {
      const Shape now(m, params, tuning);
      const Field here = [&](const Vector3d& p) { return now(p); };
      const Sizing sizing = [&](const Vector3d& p) { return edge * now.sizing(p); };
      half = follow(std::move(half), here, sizing, 2);
      whole = mirrored(half);
      levels = now.levels();
      gauge = measure(whole.x, whole.faces, levels, params);
      ++form.iterations;
      if (misfit(gauge, wanted) < 3e-4) break;
      tuning = fitting_mesh.corrected(tuning, gauge);
    }
    form.smallest_angle = smallest_angle(whole.x, whole.faces);
    if (form.smallest_angle > 20 * 3.14159265358979 / 180 && misfit(gauge, wanted) < 1.5e-3) break;
  }

  form.mesh.x = whole.x;
  form.mesh.faces = whole.faces;
  form.mesh.landmarks = gauge.landmarks;
  form.mesh.region_names = region_names(params);
  form.mesh.face_region.resize(whole.faces.rows());
  for (Eigen::Index f = 0; f < whole.faces.rows(); ++f) {
    const Vector3d centre = (whole.x.row(whole.faces(f, 0)) + whole.x.row(whole.faces(f, 1)) + whole.x.row(whole.faces(f, 2))).transpose() / 3;
    form.mesh.face_region[f] = region(centre, levels, gauge, params);
  }
  for (const Target& t : wanted) {
    const auto it = gauge.values.find(t.name);
    const double measured = it == gauge.values.end() ? 0 : it->second;
    GaugeRow row{t.name, t.girth, t.requested, measured, measured - t.requested, t.girth ? params.girth_tolerance : params.length_tolerance};
    if (row.name == "shoulderSlope") {
      const auto& hps = gauge.landmarks.at("hps_left");
      row.difference = (levels.half_shoulder - hps[0]) * (std::tan(measured) - std::tan(t.requested));
    }
    if (t.girth) form.mesh.girths[t.name] = measured;
    form.gauge.push_back(row);
  }
  issues = mesh::validate(form.mesh);
  if (!issues.empty()) return issues;
  return form;
}

}  // namespace toile::form
