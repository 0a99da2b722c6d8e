#include "gauge.h"

#include "toile/geometry/slice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace toile::form {

using Eigen::Vector3d;
using geometry::Plane;
using geometry::Polyline;

namespace {

/// The section's curve around `inside`, the smallest if there are several.
std::optional<Polyline> ring(const mesh::Points3& x, const mesh::Triangles& faces, const Plane& plane, const Vector3d& inside) {
  std::optional<Polyline> best;
  double area = 0;
  for (Polyline& curve : geometry::slice(x, faces, plane)) {
    if (!geometry::encloses(curve, plane.normal, inside)) continue;
    const double a = geometry::enclosed_area(curve, plane.normal);
    if (best && a >= area) continue;
    area = a;
    best = std::move(curve);
  }
  return best;
}

/// Where the closed curve is farthest along `direction` among its crossings of the plane with `normal` through `point`.
std::optional<Vector3d> crossing(const Polyline& curve, const Vector3d& point, const Vector3d& normal, const Vector3d& direction) {
  std::optional<Vector3d> best;
  const Eigen::Index n = curve.points.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d a = curve.points.row(i), b = curve.points.row((i + 1) % n);
    const double ha = (a - point).dot(normal), hb = (b - point).dot(normal);
    if ((ha >= 0) == (hb >= 0)) continue;
    const Vector3d q = a + (b - a) * (ha / (ha - hb));
    if (!best || q.dot(direction) > best->dot(direction)) best = q;
  }
  return best;
}

Vector3d farthest(const Polyline& curve, const Vector3d& direction) {
  Eigen::Index row = 0;
  (curve.points * direction).maxCoeff(&row);
  return curve.points.row(row);
}

/// Length of a tape pulled taut over the mesh from a to b, in the plane through both that holds `outside`.
double taut_length(const mesh::Points3& x, const mesh::Triangles& faces, const Vector3d& a, const Vector3d& b, const Vector3d& outside) {
  const Vector3d along = (b - a).normalized();
  const Vector3d up = (outside - outside.dot(along) * along).normalized();
  struct Item {
    double s, h;
  };
  const double total = (b - a).norm();
  std::vector<Item> items{{0, 0}, {total, 0}};
  for (const Polyline& curve : geometry::slice(x, faces, {a, along.cross(up)})) {
    for (Eigen::Index i = 0; i < curve.points.rows(); ++i) {
      const Vector3d q = curve.points.row(i).transpose() - a;
      const double s = q.dot(along), h = q.dot(up);
      if (s > 0 && s < total && h > 0) items.push_back({s, h});
    }
  }
  std::sort(items.begin(), items.end(), [](const Item& p, const Item& q) { return std::tie(p.s, p.h) < std::tie(q.s, q.h); });
  std::vector<Item> chain;
  for (const Item& item : items) {
    while (chain.size() >= 2) {
      const Item &o = chain[chain.size() - 2], &m = chain.back();
      if ((m.s - o.s) * (item.h - o.h) - (m.h - o.h) * (item.s - o.s) < 0) break;
      chain.pop_back();
    }
    chain.push_back(item);
  }
  double length = 0;
  for (std::size_t i = 1; i < chain.size(); ++i) length += std::hypot(chain[i].s - chain[i - 1].s, chain[i].h - chain[i - 1].h);
  return length;
}

}  // namespace

Gauge measure(const mesh::Points3& x, const mesh::Triangles& faces, const Levels& l, const FormParams& params) {
  Gauge g;
  const double u = l.unit;
  const auto mark = [&](const std::string& name, const Vector3d& p) { g.landmarks[name] = {p.x(), p.y(), p.z()}; };
  const auto mark_pair = [&](const std::string& name, const Vector3d& p) {
    mark(name + "_left", p);
    mark(name + "_right", {-p.x(), p.y(), p.z()});
  };
  const auto at = [&](const std::string& name) { return Vector3d(g.landmarks.at(name).data()); };
  const Vector3d up = Vector3d::UnitY(), fore = Vector3d::UnitZ(), left = Vector3d::UnitX();

  const auto level = [&](const std::string& name, double y, const std::string& landmark) -> std::optional<Polyline> {
    const Plane plane{{0, y, 0}, up};
    const auto curve = ring(x, faces, plane, {0, y, 0.02 * u});
    g.values[name] = curve ? geometry::tape_girth(curve->points, up) : 0;
    if (!curve || landmark.empty()) return curve;
    mark(landmark + "_front", crossing(*curve, Vector3d::Zero(), left, fore).value_or(Vector3d::Zero()));
    mark(landmark + "_back", crossing(*curve, Vector3d::Zero(), left, -fore).value_or(Vector3d::Zero()));
    mark_pair(landmark, farthest(*curve, left));
    return curve;
  };
  level("waist", l.waist, "waist");
  level("hips", l.hips, "hip");
  level("seat", l.seat, "seat");
  level("underbust", l.underbust, "");
  if (params.legs) {
    // The crotch: the lowest point of the trunk in the plane of symmetry.
    Vector3d lowest(0, 1e9, 0);
    for (const Polyline& curve : geometry::slice(x, faces, {Vector3d::Zero(), left})) {
      const Vector3d p = farthest(curve, -up);
      if (p.y() < lowest.y()) lowest = p;
    }
    if (lowest.y() > 1e8) lowest.y() = 0;
    mark("crotch", lowest);
    g.values["inseam"] = lowest.y();
    const auto leg = [&](const std::string& name, double y, const std::string& landmark) {
      std::optional<Polyline> best;
      for (Polyline& curve : geometry::slice(x, faces, {{0, y, 0}, up})) {
        if (curve.points.col(0).mean() <= 0 || (best && curve.points.rows() <= best->points.rows())) continue;
        if (curve.points.col(0).minCoeff() > 0) best = std::move(curve);
      }
      g.values[name] = best ? geometry::tape_girth(best->points, up) : 0;
      if (best && !landmark.empty()) mark_pair(landmark, farthest(*best, left));
    };
    leg("upperLeg", l.thigh, "thigh");
    leg("knee", l.knee, "knee");
    leg("ankle", l.ankle, "ankle");
  }
  const auto chest = level("chest", l.chest, "chest");

  // Neck: girth where a collar sits, landmarks in the plane of its base.
  const auto collar = ring(x, faces, {l.collar_point, l.neck_normal}, l.collar_point);
  g.values["neck"] = collar ? geometry::tape_girth(collar->points, l.neck_normal) : 0;
  const auto neck = ring(x, faces, {l.neck_point, l.neck_normal}, l.neck_point);
  if (!neck || !chest) return g;
  mark("neck_front", crossing(*neck, Vector3d::Zero(), left, fore).value_or(Vector3d::Zero()));
  mark("neck_back", crossing(*neck, Vector3d::Zero(), left, -fore).value_or(Vector3d::Zero()));
  // The high point of the shoulder: where the neck's outline, seen from the front, has come down to its base.
  Vector3d high_point = l.neck_point;
  if (const auto outline = ring(x, faces, {l.neck_point, fore}, l.neck_point - 0.05 * u * up)) {
    const Eigen::Index n = outline->points.rows();
    double nearest = 1e9;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vector3d a = outline->points.row(i), b = outline->points.row((i + 1) % n);
      if ((a.y() >= l.hps) == (b.y() >= l.hps)) continue;
      const Vector3d q = a + (b - a) * ((l.hps - a.y()) / (b.y() - a.y()));
      if (q.x() > 0 && q.x() < nearest) nearest = q.x(), high_point = q;
    }
  }
  mark_pair("hps", high_point);
  const Vector3d hps = at("hps_left");

  // Shoulder tip: the top of the section at half the shoulder width.
  const double half = l.half_shoulder;
  Vector3d tip(half, -1e9, 0);
  for (const Polyline& curve : geometry::slice(x, faces, {{half, 0, 0}, left})) {
    const Vector3d top = farthest(curve, up);
    if (top.y() > tip.y()) tip = top;
  }
  mark_pair("shoulder", tip);
  g.values["shoulderToShoulder"] = 2 * tip.x();
  g.values["shoulderSlope"] = std::atan2(hps.y() - tip.y(), tip.x() - hps.x());

  // Bust point: of a form with breasts their tip, else the middle of the chest muscle.
  {
    const auto at_bust = ring(x, faces, {{0, l.bust, 0}, up}, {0, l.bust, 0.02 * u});
    const Polyline& curve = at_bust ? *at_bust : *chest;
    // The middle of the foremost stretch: the very front of a rounded shape would jump from vertex to vertex.
    double foremost = -1e9;
    const auto eligible = [&](const Vector3d& p) { return p.x() > 0.035 * u && p.x() < 0.16 * u; };
    for (Eigen::Index i = 0; i < curve.points.rows(); ++i) {
      if (eligible(curve.points.row(i))) foremost = std::max(foremost, curve.points(i, 2));
    }
    double from = 1e9, to = -1e9;
    for (Eigen::Index i = 0; i < curve.points.rows(); ++i) {
      const Vector3d p = curve.points.row(i), q = curve.points.row((i + 1) % curve.points.rows());
      if (!eligible(p) || !eligible(q)) continue;
      const double level = foremost - 0.003 * u;
      for (const Vector3d& r : {p, q}) {
        if (r.z() >= level) from = std::min(from, r.x()), to = std::max(to, r.x());
      }
      if ((p.z() >= level) != (q.z() >= level)) {
        const double cut = p.x() + (q.x() - p.x()) * (level - p.z()) / (q.z() - p.z());
        from = std::min(from, cut), to = std::max(to, cut);
      }
    }
    Vector3d bust = crossing(curve, {(from + to) / 2, 0, 0}, left, fore).value_or(Vector3d(0.09 * u, l.bust, foremost));
    if (params.sex == Sex::male) bust = crossing(curve, {0.095 * u, 0, 0}, left, fore).value_or(bust);
    mark_pair("bust", bust);
    g.values["bustSpan"] = 2 * bust.x();
    g.values["hpsToBust"] = taut_length(x, faces, hps, bust, fore);
  }
  // Down the back: from the high point of the shoulder straight down to the waist.
  {
    const auto waist = ring(x, faces, {{0, l.waist, 0}, up}, {0, l.waist, 0.02 * u});
    const auto end = waist ? crossing(*waist, {hps.x(), 0, 0}, left, -fore) : std::nullopt;
    if (end) g.values["hpsToWaistBack"] = taut_length(x, faces, hps, *end, -fore);
    const auto front_end = waist ? crossing(*waist, {hps.x(), 0, 0}, left, fore) : std::nullopt;
    if (front_end) g.values["hpsToWaistFront"] = taut_length(x, faces, hps, *front_end, fore);
  }
  g.values["waistToHips"] = at("waist_left").y() - at("hip_left").y();
  g.values["waistToSeat"] = at("waist_left").y() - at("seat_left").y();
  g.values["waistToFloor"] = at("waist_left").y();

  // Armpit: the highest point of the hollow between side and arm, in the plane of the arm's axis.
  if (params.arms) {
    const Vector3d normal = l.arm_direction.cross(l.arm_outer).normalized();
    Vector3d best(0, -1e9, 0);
    for (const Polyline& curve : geometry::slice(x, faces, {l.arm_joint, normal})) {
      const Eigen::Index n = curve.points.rows();
      for (Eigen::Index i = 0; i < n; ++i) {
        const Vector3d p = curve.points.row(i), a = curve.points.row((i + n - 1) % n), b = curve.points.row((i + 1) % n);
        if (p.x() < 0.4 * half || p.y() > tip.y() - 0.03 * u || p.y() < l.waist) continue;
        // A local top that has air under it: the curve runs with the solid on its left.
        if (p.y() < a.y() || p.y() < b.y()) continue;
        const Vector3d run = b - a;
        if (run.cross(normal).dot(up) > 0) continue;  // the air has to be below
        if (p.y() > best.y()) best = p;
      }
    }
    if (best.y() < 0) best = Vector3d(half, tip.y(), 0);
    mark_pair("armpit", best);
  } else {
    const auto side = ring(x, faces, {{0, l.armpit, 0}, up}, {0, l.armpit, 0.02 * u});
    mark_pair("armpit", side ? farthest(*side, left) : Vector3d(half, l.armpit, 0));
  }
  g.values["waistToArmpit"] = at("armpit_left").y() - l.waist;

  if (params.arms) {
    const auto arm = [&](const std::string& girth, double t, const std::string& landmark) {
      const Vector3d centre = l.arm_joint + t * l.arm_direction;
      const auto curve = ring(x, faces, {centre, l.arm_direction}, centre);
      if (!girth.empty()) g.values[girth] = curve ? geometry::tape_girth(curve->points, l.arm_direction) : 0;
      if (!landmark.empty()) mark_pair(landmark, curve ? crossing(*curve, centre, l.arm_direction.cross(l.arm_outer), l.arm_outer).value_or(centre) : centre);
    };
    arm("biceps", l.biceps, "");
    arm("wrist", l.hand, "wrist");
    arm("", l.elbow, "elbow");
    g.values["shoulderToElbow"] = taut_length(x, faces, tip, at("elbow_left"), l.arm_outer);
    g.values["shoulderToWrist"] = taut_length(x, faces, tip, at("wrist_left"), l.arm_outer);
  }
  return g;
}

}  // namespace toile::form
