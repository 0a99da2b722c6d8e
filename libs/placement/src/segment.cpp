#include "toile/placement/segment.h"

#include "toile/placement/body_frame.h"

#include <algorithm>
#include <string>
#include <vector>

namespace toile::placement {

namespace {

constexpr double kNeckGrowth = 1.3;
constexpr double kHullMargin = 0.004;  // chords of the body's triangles lie inside the hull of a section beside them, their middles may lie outside [m]

bool inside(const Points2& hull, double z, double x) {
  for (Eigen::Index i = 0; i < hull.rows(); ++i) {
    const Eigen::RowVector2d a = hull.row(i), along = hull.row((i + 1) % hull.rows()) - a;
    const double length = along.norm();
    if (length > 0 && (along[0] * (x - a[1]) - along[1] * (z - a[0])) / length < -kHullMargin) return false;
  }
  return true;
}

}  // namespace

Issues segment(mesh::SupportMesh& support) {
  const auto found = body_frame(support);
  if (!found) return found.issues();
  const BodyFrame& frame = *found;
  const Section& at_armpit = frame.section(frame.armpit);
  const double left = at_armpit.hull.col(1).maxCoeff(), right = at_armpit.hull.col(1).minCoeff();
  const bool has_arms = frame.arm_left.has_value() || frame.arm_right.has_value();
  const bool has_legs = frame.crotch > frame.bottom + 0.05;
  double neck_base = frame.neck;
  const double neck_girth = frame.section(frame.neck).girth;
  for (auto s = frame.sections.rbegin(); s != frame.sections.rend() && s->y > frame.armpit; ++s) {
    if (s->y > frame.neck) continue;
    if (s->girth > kNeckGrowth * neck_girth) break;
    neck_base = s->y;
  }

  const auto middle = [&](Eigen::Index f) -> Eigen::Vector3d { return (support.x.row(support.faces(f, 0)) + support.x.row(support.faces(f, 1)) + support.x.row(support.faces(f, 2))).transpose() / 3; };
  const auto below_arms = [&](const Eigen::Vector3d& p) -> std::string {
    if (has_legs && p.y() < frame.crotch) return p.x() > frame.x_mid ? "leg_left" : "leg_right";
    return "torso";
  };
  const auto name_of = [&](const Eigen::Vector3d& p) -> std::string {
    const bool at_left = p.x() > frame.x_mid;
    if (has_arms && p.y() > frame.armpit && (p.x() > left || p.x() < right)) return at_left ? "arm_left" : "arm_right";
    if (p.y() > neck_base) return "neck";
    if (has_arms && p.y() <= frame.armpit && !inside(frame.section(p.y()).hull, p.z(), p.x())) return at_left ? "arm_left" : "arm_right";
    return below_arms(p);
  };
  std::vector<std::string> wanted(static_cast<std::size_t>(support.faces.rows()));
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    if (support.face_region[f] >= 0) continue;
    wanted[static_cast<std::size_t>(f)] = name_of(middle(f));
  }
  // Toes lie outside of the ankle's section as hands lie outside of the trunk's: an arm hangs together with its part above the armpit.
  std::vector<std::vector<int>> faces_at(static_cast<std::size_t>(support.x.rows()));
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    for (const int v : support.faces.row(f)) faces_at[static_cast<std::size_t>(v)].push_back(static_cast<int>(f));
  }
  const auto arm = [&](std::size_t f) { return wanted[f].rfind("arm", 0) == 0; };
  std::vector<char> is_arm(wanted.size(), 0);
  std::vector<int> open;
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    if (!arm(f) || middle(static_cast<Eigen::Index>(f)).y() <= frame.armpit) continue;
    is_arm[f] = 1;
    open.push_back(static_cast<int>(f));
  }
  while (!open.empty()) {
    const int f = open.back();
    open.pop_back();
    for (const int v : support.faces.row(f)) {
      for (const int g : faces_at[static_cast<std::size_t>(v)]) {
        if (is_arm[static_cast<std::size_t>(g)] || !arm(static_cast<std::size_t>(g))) continue;
        is_arm[static_cast<std::size_t>(g)] = 1;
        open.push_back(g);
      }
    }
  }
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    if (arm(f) && !is_arm[f]) wanted[f] = below_arms(middle(static_cast<Eigen::Index>(f)));
  }
  for (const char* name : {"torso", "neck", "arm_left", "arm_right", "leg_left", "leg_right"}) {
    if (std::find(wanted.begin(), wanted.end(), name) == wanted.end()) continue;
    auto& names = support.region_names;
    const auto known = std::find(names.begin(), names.end(), name);
    const int id = static_cast<int>(known - names.begin());
    if (known == names.end()) names.emplace_back(name);
    for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
      if (wanted[static_cast<std::size_t>(f)] == name) support.face_region[f] = id;
    }
  }
  return {};
}

}  // namespace toile::placement
