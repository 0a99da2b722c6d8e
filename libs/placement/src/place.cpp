#include "toile/placement/place.h"

#include "toile/base/text.h"
#include "toile/contact/exact.h"
#include "toile/contact/support_field.h"
#include "toile/contact/untangle.h"
#include "toile/geometry/slice.h"
#include "toile/mesh/topology.h"
#include "toile/placement/attach.h"
#include "toile/placement/coarse.h"
#include "toile/placement/developable.h"
#include "toile/placement/layers.h"
#include "toile/placement/mirror.h"
#include "toile/placement/relax.h"
#include "toile/placement/subset.h"

#include <Eigen/Geometry>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kShoulderFlatten = 0.25;  // front and back nearly meet at the shoulders
constexpr double kPolish = 0.8;           // polishing goes on until strains are this part of what is allowed
constexpr double kArmTransition = 0.08;   // from the trunk's side to where arms keep their true shape [m]
constexpr double kNarrow = 0.01;          // cloth may lack this part of a girth before it is refused: it can slide to where it fits
constexpr double kSleeveGap = 0.004;       // between a sleeve and the trunk's panels at the start [m]
constexpr double kLevel = 3;              // of edge lengths from one mesh to the next
constexpr double kRound = 0.005;          // sections of a cone leave their circle, and circles their cone, by this part of the radius at most
constexpr double kUpright = 0.001;        // a cone's slope under which it is a cylinder
constexpr double kNearly = 1e-4;           // cloth that is so much too near to a region stays as it is rolled [m]
constexpr double kLayerGap = 1.5;         // of free layers from what they lie on at the start, over the thickness
constexpr double kLayerOffset = 0.5;      // layers come as near to the support as this part of the offset
constexpr int kLayerSettling = 2;         // of the steps of a fine mesh
constexpr int kLayerPolishing = 20;       // steps before the panels under them move too
constexpr double kLayerSeam = 0.1;        // of the pull of other seams: those of linings that hang lower than their hem stay open
constexpr double kLayerClosed = 0.005;    // seams of layers that start closed [m]
constexpr double kShellShare = 0.7;       // of the work
constexpr double kLooseFastening = 0.03;   // part of its gap that a sweep on the fine mesh closes at what is buttoned
constexpr double kLoose = 0.004;           // where it may come so much farther apart than its length, for seams to close better [m]
constexpr double kSheet = 0.004;           // between sheets that lie on one another at the start [m]

double polygon_perimeter(const Points2& p) {
  double sum = 0;
  for (Eigen::Index i = 0; i < p.rows(); ++i) sum += (p.row((i + 1) % p.rows()) - p.row(i)).norm();
  return sum;
}

// Convex hull, (z, x) counter-clockwise, of the free trunk over a range of heights, made symmetric.
Points2 trunk_hull(const BodyFrame& frame, double low, double high) {
  std::vector<Vector3d> points;
  for (const Section& section : frame.sections) {
    if (section.merged || section.y < low - 0.01 || section.y > high + 0.01) continue;
    for (Eigen::Index i = 0; i < section.hull.rows(); ++i) {
      const double z = section.hull(i, 0), x = section.hull(i, 1) - frame.x_mid;
      points.emplace_back(frame.x_mid + x, 0, z);
      points.emplace_back(frame.x_mid - x, 0, z);
    }
  }
  Points3 all(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) all.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  const Points3 hull = geometry::convex_hull(all, Vector3d::UnitY());
  Points2 flat(hull.rows(), 2);
  flat.col(0) = hull.col(2);
  flat.col(1) = hull.col(0);
  return flat;
}

// The hull with its depths scaled about z_middle: still the hull of the scaled points.
Points2 flattened_hull(Points2 hull, double flatten, double z_middle) {
  hull.col(0) = (z_middle + flatten * (hull.col(0).array() - z_middle)).matrix();
  return hull;
}

// How much cloth lies on the level line h in the unrolled part, panels counted together [m].
double width_at(const mesh::GarmentMesh& garment, const Layout& layout, const std::vector<Vector2d>& flat, Part part, double h, std::vector<int>* panels) {
  double sum = 0;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    if (layout.panels[static_cast<std::size_t>(garment.face_panel[f])].part != part) continue;
    double cut[2];
    int count = 0;
    for (int k = 0; k < 3 && count < 2; ++k) {
      const Vector2d &a = flat[static_cast<std::size_t>(garment.faces(f, k))], &b = flat[static_cast<std::size_t>(garment.faces(f, (k + 1) % 3))];
      if ((a.y() < h) != (b.y() < h)) cut[count++] = a.x() + (h - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    }
    if (count < 2) continue;
    sum += std::abs(cut[1] - cut[0]);
    if (panels && (panels->empty() || panels->back() != garment.face_panel[f])) panels->push_back(garment.face_panel[f]);
  }
  if (panels) {
    std::sort(panels->begin(), panels->end());
    panels->erase(std::unique(panels->begin(), panels->end()), panels->end());
  }
  return sum;
}

// Panels that nothing is sewn or fastened to.
bool loose(const mesh::GarmentMesh& garment) { return garment.welds.empty() && garment.fasteners.empty(); }

// An upright round cone or cylinder that a part of the trunk is.
struct RoundCone {
  double x = 0, z = 0;       // of the axis [m]
  double radius = 0, y = 0;  // at a height [m]
  double slope = 0;          // of the radius over the height; 0: a cylinder

  // uv from a middle that lies on the ruling in the direction `out` (horizontal, unit), at height h on the cone.
  Vector3d point(const Vector3d& out, double h, double offset, const Vector2d& uv) const {
    const double stretch = std::sqrt(1 + slope * slope);
    const double r = radius + slope * (h - y) + offset * stretch;
    Frame frame;
    frame.origin = Vector3d(x, h, z) + r * out;
    frame.up = (Vector3d::UnitY() + slope * out) / stretch;
    frame.across = frame.up.cross((out - slope * Vector3d::UnitY()) / stretch);
    return slope == 0 ? on_cylinder(frame, r, uv) : on_cone(frame, r, -r * stretch / slope, uv);
  }
};

// ret  nothing where the sections from low to high are not round about one axis (within kRound)
std::optional<RoundCone> round_cone(const BodyFrame& frame, double low, double high) {
  std::vector<double> y, r;
  std::vector<Vector2d> middles;
  for (const Section& section : frame.sections) {
    if (section.merged || section.y < low - 0.01 || section.y > high + 0.01) continue;
    const Vector2d middle = 0.5 * (section.hull.colwise().minCoeff() + section.hull.colwise().maxCoeff()).transpose();
    double least = 1e9, greatest = 0;
    for (Eigen::Index i = 0; i < section.hull.rows(); ++i) {
      const double d = (section.hull.row(i).transpose() - middle).norm();
      least = std::min(least, d);
      greatest = std::max(greatest, d);
    }
    if (greatest - least > kRound * greatest || (!middles.empty() && (middle - middles.front()).norm() > kRound * greatest)) return std::nullopt;
    y.push_back(section.y);
    r.push_back(greatest);
    middles.push_back(middle);
  }
  if (y.size() < 3) return std::nullopt;
  const auto n = static_cast<double>(y.size());
  double sy = 0, sr = 0, syy = 0, syr = 0;
  for (std::size_t i = 0; i < y.size(); ++i) sy += y[i] / n, sr += r[i] / n;
  for (std::size_t i = 0; i < y.size(); ++i) syy += (y[i] - sy) * (y[i] - sy), syr += (y[i] - sy) * (r[i] - sr);
  RoundCone cone{middles.front().y(), middles.front().x(), sr, sy, syr / syy};
  double above = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double off = r[i] - sr - cone.slope * (y[i] - sy);
    if (std::abs(off) > kRound * sr) return std::nullopt;
    above = std::max(above, off);
  }
  cone.radius += above;
  if (std::abs(cone.slope) < kUpright) {
    cone.slope = 0;
    cone.radius = *std::max_element(r.begin(), r.end());
  }
  return cone;
}

// The axis of a sleeve: the straight line next to the trunk, from there the smoothed middles of the arm, with a frame carried
// along without twist.
class ArmAxis {
 public:
  // top  square to the line [unit], where a sleeve's u is 0
  ArmAxis(const Limb& limb, const Vector3d& top) : origin_(limb.origin), direction_(limb.direction), top_(top) {
    std::vector<Vector3d> middles;
    std::vector<double> at;
    for (const LimbPoint& point : limb.points) {
      at.push_back(middles.empty() ? (point.centre - origin_).dot(direction_) : at.back() + (point.centre - middles.back()).norm());
      middles.push_back(point.centre);
    }
    if (middles.size() <= kStraightPoints) return;
    const auto raw = [&](double s) -> Vector3d {
      if (s <= at[kStraightPoints]) return origin_ + s * direction_;
      if (s >= at.back()) return middles.back() + (s - at.back()) * (middles.back() - middles[middles.size() - 4]).normalized();
      const auto i = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), s) - at.begin());
      return middles[i - 1] + (s - at[i - 1]) / (at[i] - at[i - 1]) * (middles[i] - middles[i - 1]);
    };
    for (double s = kFrom; s < at.back() + 0.3; s += kStep) {
      Vector3d sum = Vector3d::Zero();
      double total = 0;
      for (double d = -kSmooth; d <= kSmooth; d += kStep) {
        const double weight = 1 - std::abs(d) / (kSmooth + kStep);
        sum += weight * raw(s + d);
        total += weight;
      }
      points_.push_back(sum / total);
    }
    // So far from the line that a straight tube would press on the arm.
    for (const Vector3d& p : points_) {
      const Vector3d d = p - origin_;
      bent_ = bent_ || (d - d.dot(direction_) * direction_).norm() > kBent;
    }
    if (!bent_) return;
    length_.push_back(kFrom);
    Vector3d tangent = direction_, across = top_;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (i > 0) length_.push_back(length_.back() + (points_[i] - points_[i - 1]).norm());
      const Vector3d next = (points_[std::min(i + 1, points_.size() - 1)] - points_[i > 0 ? i - 1 : 0]).normalized();
      across = Eigen::Quaterniond::FromTwoVectors(tangent, next) * across;
      across = (across - across.dot(next) * next).normalized();
      tangent = next;
      tops_.push_back(across);
      tangents_.push_back(tangent);
    }
  }
  bool bent() const { return bent_; }
  // Point of a tube round the axis: s outwards along it, the angle from `top`.
  Vector3d tube(double s, double angle, double radius) const {
    Vector3d at = origin_ + s * direction_, top = top_, out = direction_;
    if (bent_ && s > length_.front()) {
      const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(std::upper_bound(length_.begin(), length_.end(), s) - length_.begin()), 1, length_.size() - 1);
      const double t = (s - length_[i - 1]) / (length_[i] - length_[i - 1]);
      at = points_[i - 1] + t * (points_[i] - points_[i - 1]);
      const double part = std::clamp(t, 0.0, 1.0);
      out = ((1 - part) * tangents_[i - 1] + part * tangents_[i]).normalized();
      top = (1 - part) * tops_[i - 1] + part * tops_[i];
      top = (top - top.dot(out) * out).normalized();
    }
    return at + radius * (std::cos(angle) * top + std::sin(angle) * (-out).cross(top));
  }

 private:
  static constexpr std::size_t kStraightPoints = 10;  // middles next to the trunk that count as on the line
  static constexpr double kFrom = -0.4, kStep = 0.01, kSmooth = 0.08, kBent = 0.015;
  Vector3d origin_, direction_, top_;
  bool bent_ = false;
  std::vector<Vector3d> points_, tops_, tangents_;
  std::vector<double> length_;
};

// Whether the cloth goes all the way round at the level h: its cut ends lie at seams, or at edges that fasteners close there.
bool goes_round(const mesh::GarmentMesh& garment, const Layout& layout, const std::vector<Vector2d>& flat, const std::vector<mesh::Edge>& borders, const std::vector<char>& welded, Part part, double h) {
  for (const mesh::Edge& edge : borders) {
    const Vector2d &a = flat[static_cast<std::size_t>(edge.a)], &b = flat[static_cast<std::size_t>(edge.b)];
    const int panel = garment.vertex_panel[edge.a];
    if (layout.panels[static_cast<std::size_t>(panel)].part != part || (a.y() < h) == (b.y() < h)) continue;
    if (welded[static_cast<std::size_t>(edge.a)] && welded[static_cast<std::size_t>(edge.b)]) continue;
    double low = 1e9, high = -1e9;
    for (const mesh::Fastener& fastener : garment.fasteners) {
      if (!fastener.closed) continue;
      for (const int v : {fastener.a, fastener.b}) {
        if (garment.vertex_panel[v] != panel) continue;
        low = std::min(low, flat[static_cast<std::size_t>(v)].y());
        high = std::max(high, flat[static_cast<std::size_t>(v)].y());
      }
    }
    if (h < low || h > high) return false;
  }
  return true;
}

std::string names_of(const mesh::GarmentMesh& garment, const std::vector<int>& panels) {
  std::string text;
  for (int p : panels) text += (text.empty() ? "" : ", ") + garment.panels[static_cast<std::size_t>(p)].name;
  return text;
}

Issue too_narrow(const mesh::GarmentMesh& garment, const std::vector<int>& panels, double width, double needed, const std::string& where) {
  return Issue{.code = "too_narrow", .place = {.item = panels.size() == 1 ? "panel " + names_of(garment, panels) : "panels " + names_of(garment, panels)},
               .what = fmt::format("{} {:.0f} mm round, but {} needs {:.0f} mm with the clearance", panels.size() == 1 ? "it measures" : "sewn together they measure",
                                   1e3 * width, where, 1e3 * needed),
               .remedy = "use a larger size of the pattern or a smaller support", .category = Category::input};
}

// How many sheets lie between each vertex and the innermost of its part: folded parts, and panels whose order is greater.
// Panels that lap over one another without an order: where a fastener joins them, its second half lies over the first (a
// buttonhole over its button).
std::vector<int> orders(const mesh::GarmentMesh& garment) {
  std::vector<int> order;
  for (const mesh::Panel& panel : garment.panels) order.push_back(panel.order);
  for (const mesh::Fastener& fastener : garment.fasteners) {
    const auto a = static_cast<std::size_t>(garment.vertex_panel[fastener.a]), b = static_cast<std::size_t>(garment.vertex_panel[fastener.b]);
    if (fastener.closed && a != b && order[a] == order[b]) ++order[b];
  }
  return order;
}

std::vector<double> sheets(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const Layout& layout) {
  std::vector<double> result(folded.layer.size(), 0);
  const std::vector<int> order = orders(garment);
  for (const Part part : {Part::trunk, Part::arm_left, Part::arm_right, Part::leg_left, Part::leg_right}) {
    std::map<int, std::pair<double, double>> range;  // by order: least and greatest layer
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      const auto p = static_cast<std::size_t>(garment.vertex_panel[v]);
      if (layout.panels[p].part != part) continue;
      auto& [least, greatest] = range.try_emplace(order[p], 0.0, 0.0).first->second;
      least = std::min(least, folded.layer[static_cast<std::size_t>(v)]);
      greatest = std::max(greatest, folded.layer[static_cast<std::size_t>(v)]);
    }
    std::map<int, double> base;
    double next = 0;
    for (const auto& [level, layers] : range) {
      base[level] = next - layers.first;
      next += layers.second - layers.first + 1;
    }
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      const auto p = static_cast<std::size_t>(garment.vertex_panel[v]);
      if (layout.panels[p].part == part) result[static_cast<std::size_t>(v)] = base[order[p]] + folded.layer[static_cast<std::size_t>(v)];
    }
  }
  return result;
}

// One of the meshes of a garment, from fine to coarse.
struct Level {
  const mesh::GarmentMesh* mesh;
  FoldedFlat flat;
  Points3 bent;
  Rooms room;
};

}  // namespace

Result<Start> bend(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const BodyFrame& frame, const Layout& layout, const PlaceParams& params) {
  Issues issues;
  Start start;
  const Eigen::Index n = garment.vertex_count();
  start.x = Points3::Zero(n, 3);
  std::vector<Vector2d> flat(static_cast<std::size_t>(n));
  for (Eigen::Index v = 0; v < n; ++v) {
    flat[static_cast<std::size_t>(v)] = layout.panels[static_cast<std::size_t>(garment.vertex_panel[v])](folded.uv.row(v).transpose());
  }
  const std::vector<double> sheet = sheets(garment, folded, layout);
  const auto part_of = [&](Eigen::Index v) { return layout.panels[static_cast<std::size_t>(garment.vertex_panel[v])].part; };

  // The trunk: a vertical tube around the flattened body, as wide as the panels are together.
  double low = 1e9, high = -1e9, a_low = 1e9, a_high = -1e9;
  for (Eigen::Index v = 0; v < n; ++v) {
    if (part_of(v) != Part::trunk) continue;
    low = std::min(low, flat[static_cast<std::size_t>(v)].y());
    high = std::max(high, flat[static_cast<std::size_t>(v)].y());
    a_low = std::min(a_low, flat[static_cast<std::size_t>(v)].x());
    a_high = std::max(a_high, flat[static_cast<std::size_t>(v)].x());
  }
  start.flattening.depth = params.flatten.value_or(layout.shoulder_welds.empty() ? 1.0 : kShoulderFlatten);
  start.flattening.x_mid = frame.x_mid;
  if (frame.arm_left || frame.arm_right) {
    const Section& section = frame.section(frame.armpit - 0.01);
    start.flattening.x_trunk = section.hull.col(1).maxCoeff() - frame.x_mid;
    start.flattening.x_arm = start.flattening.x_trunk + kArmTransition;
  }
  if (low < high) {
    double z_low = 1e9, z_high = -1e9;
    for (const Section& section : frame.sections) {
      if (section.y < low - 0.01 || section.y > high + 0.01) continue;
      z_low = std::min(z_low, section.hull.col(0).minCoeff());
      z_high = std::max(z_high, section.hull.col(0).maxCoeff());
    }
    if (z_low > z_high) {
      return Issue{.code = "off_support", .place = {.item = "panels of the trunk"},
                   .what = fmt::format("they would hang between {:.3f} m and {:.3f} m, where the support has no trunk", low, high),
                   .remedy = "check the anchors (point, at, shift) and the units of pattern and support", .category = Category::input};
    }
    start.flattening.z_middle = 0.5 * (z_low + z_high);
    const double margin = garment.welds.empty() ? params.offset : std::max(2 * params.offset, 0.008);
    double girth = layout.girth_trunk;
    const Points2 full = trunk_hull(frame, low, high);
    const auto hull_at = [&](double flatten) { return flattened_hull(full, flatten, start.flattening.z_middle); };
    const auto spare = [&](double flatten) {
      return (girth - polygon_perimeter(hull_at(flatten))) / (2 * std::numbers::pi);
    };
    if (girth <= 0) girth = std::max(a_high - a_low, polygon_perimeter(hull_at(start.flattening.depth)) + 2 * std::numbers::pi * margin);
    while (spare(start.flattening.depth) < margin - 1e-9 && start.flattening.depth > 0.06) start.flattening.depth *= 0.95;
    // Level by level, up to the lowest point of an armhole: cloth against body.
    if (layout.girth_trunk > 0) {
      double ceiling = frame.armpit;
      for (const mesh::Weld& weld : garment.welds) {
        const bool a = part_of(weld.a) == Part::trunk, b = part_of(weld.b) == Part::trunk;
        if (a != b) ceiling = std::min(ceiling, flat[static_cast<std::size_t>(a ? weld.a : weld.b)].y());
      }
      std::vector<mesh::Edge> borders = mesh::edges(garment.faces);
      std::erase_if(borders, [](const mesh::Edge& edge) { return edge.faces.size() != 1; });
      std::vector<char> welded(static_cast<std::size_t>(n), 0);
      for (const mesh::Weld& weld : garment.welds) welded[static_cast<std::size_t>(weld.a)] = welded[static_cast<std::size_t>(weld.b)] = 1;
      double worst = 0;
      std::optional<Issue> narrow;
      for (const Section& section_ : frame.sections) {
        if (section_.merged || section_.y > ceiling - 0.01 || section_.y < low + 0.005 || section_.y > high - 0.005) continue;
        if (!goes_round(garment, layout, flat, borders, welded, Part::trunk, section_.y)) continue;
        std::vector<int> panels;
        // The widest within a hand's breadth: edges curve, bands slide.
        double width = 0;
        for (const double off : {0.0, -0.02, 0.02}) width = std::max(width, width_at(garment, layout, flat, Part::trunk, section_.y + off, &panels));
        if (panels.empty()) continue;
        const double needed = section_.girth + 2 * std::numbers::pi * params.clearance;
        if (needed / std::max(width, 1e-6) > std::max(1 + kNarrow, worst)) {
          worst = needed / std::max(width, 1e-6);
          narrow = too_narrow(garment, panels, width, needed, fmt::format("the body at height {:.2f} m", section_.y));
        }
      }
      if (narrow) issues.push_back(*narrow);
    }
    if (spare(start.flattening.depth) < params.clearance && issues.empty()) {
      issues.push_back({.code = "too_narrow", .place = {.item = "panels of the trunk"},
                        .what = fmt::format("sewn together they measure {:.0f} mm round; the body between {:.2f} m and {:.2f} m does not fit in", 1e3 * girth, low, high),
                        .remedy = "use a larger size of the pattern or a smaller support", .category = Category::input});
    }
    if (!issues.empty()) return issues;
    const Points2 hull = hull_at(start.flattening.depth);
    const Vector2d axis(start.flattening.z_middle, frame.x_mid);
    const ConvexSection section(hull, spare(start.flattening.depth), axis, Vector2d(1, 0));
    const std::optional<RoundCone> cone = loose(garment) ? round_cone(frame, low, high) : std::nullopt;
    // Sheets that lie on others: on parallel curves, each panel's middle facing where it would be on the first.
    std::map<double, ConvexSection> outer;
    std::vector<double> middle(garment.panels.size(), 0), middle_height(garment.panels.size(), 0), count(garment.panels.size(), 0);
    for (Eigen::Index v = 0; v < n; ++v) {
      const auto p = static_cast<std::size_t>(garment.vertex_panel[v]);
      middle[p] += flat[static_cast<std::size_t>(v)].x();
      middle_height[p] += flat[static_cast<std::size_t>(v)].y();
      count[p] += 1;
    }
    for (Eigen::Index v = 0; v < n; ++v) {
      if (part_of(v) != Part::trunk) continue;
      const auto p = static_cast<std::size_t>(garment.vertex_panel[v]);
      const double a = flat[static_cast<std::size_t>(v)].x(), level = sheet[static_cast<std::size_t>(v)];
      Vector2d at = section.point(a);
      if (cone) {
        // Each panel's middle on the ruling before it, from there along the cone.
        const Vector2d centre(middle[p] / count[p], middle_height[p] / count[p]);
        const Vector2d out = section.normal(centre.x());
        start.x.row(v) = cone->point(Vector3d(out.y(), 0, out.x()), centre.y(), params.offset + kSheet * level, flat[static_cast<std::size_t>(v)] - centre).transpose();
        continue;
      }
      if (level > 0) {
        const ConvexSection& curve = outer.try_emplace(level, hull, spare(start.flattening.depth) + kSheet * level, axis, Vector2d(1, 0)).first->second;
        const double centre = middle[p] / count[p];
        at = curve.point(section.facing(centre, curve) + a - centre);
      }
      start.x.row(v) << at.y(), flat[static_cast<std::size_t>(v)].y(), at.x();
    }
  }

  // Arms: a round tube about the arm's axis, turned so that its seams look at the panels that they join, and moved
  // outwards until it is clear of them.
  for (const Part part : {Part::arm_left, Part::arm_right}) {
    const double girth = part == Part::arm_left ? layout.girth_arm_left : layout.girth_arm_right;
    const std::optional<Limb>& limb = part == Part::arm_left ? frame.arm_left : frame.arm_right;
    std::vector<Eigen::Index> members;
    double h_low = 1e9, h_high = -1e9;
    for (Eigen::Index v = 0; v < n; ++v) {
      if (part_of(v) != part) continue;
      members.push_back(v);
      h_low = std::min(h_low, flat[static_cast<std::size_t>(v)].y());
      h_high = std::max(h_high, flat[static_cast<std::size_t>(v)].y());
    }
    if (members.empty()) continue;
    TOILE_CHECK(limb.has_value(), "part {}", static_cast<int>(part));
    const Vector3d &origin = limb->origin, &outwards = limb->direction;
    double radius = girth / (2 * std::numbers::pi);
    if (girth <= 0) {
      for (const LimbPoint& point : limb->points) radius = std::max(radius, point.radius + 2 * params.offset);
    }
    // Seen from outside with the shoulder up: u to the right. `up` is inwards along the arm.
    const Vector3d up = -outwards;
    Vector3d top = Vector3d::UnitY() - Vector3d::UnitY().dot(up) * up;
    if (top.norm() < 1e-3) top = Vector3d::UnitX() - Vector3d::UnitX().dot(up) * up;
    top.normalize();
    const Vector3d across = up.cross(top);  // across x up = top (outwards of the tube)
    // Angle and position along the arm from the mates on the trunk.
    double cosine = 0, sine = 0;
    std::vector<std::pair<Eigen::Index, Eigen::Index>> mates;  // arm vertex, trunk vertex
    for (const mesh::Weld& weld : garment.welds) {
      if (part_of(weld.a) == part && part_of(weld.b) == Part::trunk) mates.emplace_back(weld.a, weld.b);
      if (part_of(weld.b) == part && part_of(weld.a) == Part::trunk) mates.emplace_back(weld.b, weld.a);
    }
    double slide = 0;
    for (const auto& [own, other] : mates) {
      const Vector3d d = start.x.row(other).transpose() - origin;
      const double angle = std::atan2(d.dot(across), d.dot(top)) - flat[static_cast<std::size_t>(own)].x() / radius;
      cosine += std::cos(angle);
      sine += std::sin(angle);
      slide += (d.dot(up) - flat[static_cast<std::size_t>(own)].y()) / static_cast<double>(mates.size());
    }
    const double turn = mates.empty() ? 0 : std::atan2(sine, cosine);
    if (mates.empty()) slide = -h_high;
    if (girth > 0) {
      double ceiling = h_high;
      for (const auto& [own, other] : mates) ceiling = std::min(ceiling, flat[static_cast<std::size_t>(own)].y());
      double worst = 0;
      std::optional<Issue> narrow;
      for (double h = h_low + 0.005; h < ceiling - 0.005; h += 0.01) {
        const double along = -(h + slide);
        const LimbPoint* nearest = nullptr;
        for (const LimbPoint& point : limb->points) {
          if (std::abs((point.centre - limb->origin).dot(limb->direction) - along) < 0.01) nearest = &point;
        }
        if (!nearest) continue;
        std::vector<int> panels;
        // The widest within a hand's breadth: hems slant, and the panels of one tube need not end at the same height.
        double width = 0;
        for (const double off : {0.0, -0.02, 0.02}) width = std::max(width, width_at(garment, layout, flat, part, h + off, &panels));
        const double needed = nearest->girth + 2 * std::numbers::pi * params.clearance;
        if (needed / std::max(width, 1e-6) > std::max(1 + kNarrow, worst)) {
          worst = needed / std::max(width, 1e-6);
          narrow = too_narrow(garment, panels, width, needed, "the arm there");
        }
      }
      if (narrow) issues.push_back(*narrow);
    }
    const ArmAxis axis(*limb, top);
    const auto tube = [&](const Vector2d& p, double along, double level) {
      const double angle = turn + p.x() / radius;
      return axis.tube(-(p.y() + along), angle, radius + kSheet * level);
    };
    // Outwards until no vertex of a trunk panel lies in the tube's wall (within a margin).
    const double margin = kSleeveGap + 0.012;
    double needed = slide;
    for (Eigen::Index v = 0; v < n; ++v) {
      if (part_of(v) != Part::trunk) continue;
      const Vector3d d = start.x.row(v).transpose() - origin;
      const double along = d.dot(up);
      const Vector3d radial = d - along * up;
      if (std::abs(radial.norm() - radius) > margin) continue;
      // the sleeve's upper edge at this angle
      const double angle = std::atan2(radial.dot(across), radial.dot(top));
      double edge = -1e9;
      for (const Eigen::Index own : members) {
        const Vector2d& p = flat[static_cast<std::size_t>(own)];
        double difference = turn + p.x() / radius - angle;
        difference -= 2 * std::numbers::pi * std::round(difference / (2 * std::numbers::pi));
        if (std::abs(difference) * radius < margin) edge = std::max(edge, p.y());
      }
      if (edge > -1e8) needed = std::min(needed, along - margin - edge);
    }
    for (const Eigen::Index v : members) start.x.row(v) = tube(flat[static_cast<std::size_t>(v)], needed, sheet[static_cast<std::size_t>(v)]).transpose();
  }
  // Legs: a tube along the leg whose section is the hull of the leg, enlarged away from the other leg to the girth of the panels.
  for (const Part part : {Part::leg_left, Part::leg_right}) {
    const double girth = part == Part::leg_left ? layout.girth_leg_left : layout.girth_leg_right;
    const std::optional<Limb>& limb = part == Part::leg_left ? frame.leg_left : frame.leg_right;
    const double side = part == Part::leg_left ? 1 : -1;
    std::vector<Eigen::Index> members;
    double h_low = 1e9, h_high = -1e9;
    for (Eigen::Index v = 0; v < n; ++v) {
      if (part_of(v) != part || layout.panels[static_cast<std::size_t>(garment.vertex_panel[v])].rise) continue;
      members.push_back(v);
      h_low = std::min(h_low, flat[static_cast<std::size_t>(v)].y());
      h_high = std::max(h_high, flat[static_cast<std::size_t>(v)].y());
    }
    if (members.empty()) continue;
    TOILE_CHECK(limb.has_value(), "part {}", static_cast<int>(part));
    const LegAxis axis(*limb, LegAxis::Shape::tube);
    double worst = 0;
    std::optional<Issue> narrow;
    std::vector<Vector3d> outline;  // of the leg, seen along it
    for (const LimbPoint& point : limb->points) {
      const double h = axis.height(point.centre.y());
      if (h < h_low - 0.01 || h > h_high + 0.01) continue;
      const LegAxis::Place place = axis.at(h);
      for (Eigen::Index i = 0; i < point.hull.rows(); ++i) {
        const Vector3d d = Vector3d(point.hull(i, 1), point.centre.y(), point.hull(i, 0)) - place.middle;
        outline.emplace_back(d.dot(place.left), 0, d.dot(place.front));
      }
      if (girth <= 0 || h < h_low + 0.005 || h > h_high - 0.005) continue;
      std::vector<int> panels;
      double width = 0;
      for (const double off : {0.0, -0.02, 0.02}) width = std::max(width, width_at(garment, layout, flat, part, h + off, &panels));
      const double needed = point.girth + 2 * std::numbers::pi * params.clearance;
      if (needed / std::max(width, 1e-6) > std::max(1 + kNarrow, worst)) {
        worst = needed / std::max(width, 1e-6);
        narrow = too_narrow(garment, panels, width, needed, fmt::format("the leg at height {:.2f} m", point.centre.y()));
      }
    }
    if (narrow) issues.push_back(*narrow);
    if (outline.empty()) {
      issues.push_back({.code = "off_support", .place = {.item = "panels of a leg"}, .what = "they would lie where the support has no leg",
                        .remedy = "check their anchors (point, at, to, shift) and the units of pattern and support"});
    }
    if (!issues.empty()) continue;
    Points3 all(static_cast<Eigen::Index>(outline.size()), 3);
    for (std::size_t i = 0; i < outline.size(); ++i) all.row(static_cast<Eigen::Index>(i)) = outline[i].transpose();
    const Points3 hull = geometry::convex_hull(all, Vector3d::UnitY());
    Points2 section(hull.rows(), 2);
    section.col(0) = hull.col(2);
    section.col(1) = hull.col(0);
    // Enlarged about its point next to the other leg: that stays where it is, so that the two tubes keep apart.
    Eigen::Index inner = 0;
    (side * section.col(1)).minCoeff(&inner);
    const Vector2d hold = section.row(inner).transpose();
    const double margin = params.offset;
    const double size = girth > 0 ? (girth - 2 * std::numbers::pi * margin) / polygon_perimeter(section) : 1;
    for (Eigen::Index i = 0; i < section.rows(); ++i) section.row(i) = (hold + size * (section.row(i).transpose() - hold)).transpose();
    const Vector2d middle = 0.5 * (section.colwise().minCoeff() + section.colwise().maxCoeff()).transpose();
    std::map<double, ConvexSection> curves;
    for (const Eigen::Index v : members) {
      const double level = sheet[static_cast<std::size_t>(v)];
      const ConvexSection& curve = curves.try_emplace(level, section, margin + kSheet * level, middle, Vector2d(1, 0)).first->second;
      const Vector2d at = curve.point(flat[static_cast<std::size_t>(v)].x());
      const LegAxis::Place place = axis.at(flat[static_cast<std::size_t>(v)].y());
      start.x.row(v) = (place.middle + at.y() * place.left + at.x() * place.front).transpose();
    }
  }
  if (issues.empty() && !layout.trousers.empty()) {
    TOILE_TRY(const auto trousers, bend_trousers(garment, flat, sheet, frame, layout, params));
    for (const auto& [v, at] : trousers) start.x.row(v) = at.transpose();
  }
  if (!issues.empty()) return issues;
  return start;
}

namespace {

/// Figures, columns and findings of what the relaxation came to.
void conclude(Placed& placed, const mesh::SupportMesh& support, const PlaceParams& params, const std::vector<std::optional<WantedDirection>>& wanted) {
  placed.report = measure(placed.garment, support, wanted);
  add_columns(placed.garment, placed.report);
  const Report& report = placed.report;
  const mesh::GarmentMesh& sewn = placed.garment;
  const auto finding = [&](const char* code, const std::string& what, const std::string& remedy) {
    placed.findings.push_back({.code = code, .place = {.item = "garment"}, .what = what, .remedy = remedy, .category = Category::check});
  };
  if (report.max_strain > params.max_strain) {
    finding("strain", fmt::format("largest edge strain {:.4f} is over {:.4f}", report.max_strain, params.max_strain), "give more settling_steps, a smaller offset, or a larger size");
  }
  if (report.rms_strain > params.rms_strain) {
    finding("strain", fmt::format("root mean square edge strain {:.5f} is over {:.5f}", report.rms_strain, params.rms_strain), "give more settling_steps, a smaller offset, or a larger size");
  }
  const auto between = [&](const std::vector<contact::FacePair>& pairs, bool with_support) {
    std::map<std::pair<std::string, std::string>, int> count;
    const auto name = [&](int face) { return sewn.panels[static_cast<std::size_t>(sewn.face_panel[face])].name; };
    for (const auto& pair : pairs) {
      const std::string a = name(pair.a), b = with_support ? std::string() : name(pair.b);
      ++count[with_support || a < b ? std::pair(a, b) : std::pair(b, a)];
    }
    std::string text;
    for (const auto& [names, n] : count) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names.second.empty() || names.first == names.second ? names.first : names.first + "/" + names.second, n);
    return text;
  };
  if (report.vertices_inside > 0 || !report.support_intersections.empty()) {
    finding("inside_support", fmt::format("{} vertices are inside the support, {} pairs of triangles cut{}", report.vertices_inside, report.support_intersections.size(),
                                          report.support_intersections.empty() ? "" : " (" + between(report.support_intersections, true) + ")"),
            "give a larger offset or a finer mesh; the simulation pushes the cloth out first");
  }
  if (!report.self_intersections.empty()) {
    finding("self_intersection", fmt::format("{} pairs of cloth triangles cut one another ({})", report.self_intersections.size(), between(report.self_intersections, false)),
            "give more steps, or move panels apart (shift); the simulation takes crossings of a few triangles apart");
  }
}

// Wanted distance by face; empty where it is the same everywhere.
Result<std::vector<double>> face_offsets(const mesh::SupportMesh& support, const PlaceParams& params) {
  std::vector<double> result;
  if (params.offsets.empty()) return result;
  std::vector<double> by_region(support.region_names.size(), params.offset);
  Issues issues;
  for (const auto& [name, offset] : params.offsets) {
    const auto it = std::find(support.region_names.begin(), support.region_names.end(), name);
    if (it != support.region_names.end()) {
      by_region[static_cast<std::size_t>(it - support.region_names.begin())] = offset;
      continue;
    }
    issues.push_back({.code = "unknown_region", .place = {.item = "offsets." + name},
                      .what = support.region_names.empty() ? std::string("the support has no named regions")
                                                           : fmt::format("the support has no region of this name; it has {}", fmt::join(support.region_names, ", ")),
                      .remedy = support.region_names.empty() ? std::string("use `offset` alone, or a support with regions (docs/form.md)") : suggestion(name, support.region_names),
                      .category = Category::input});
  }
  if (!issues.empty()) return issues;
  result.reserve(static_cast<std::size_t>(support.faces.rows()));
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    const int region = support.face_region[f];
    result.push_back(region < 0 ? params.offset : by_region[static_cast<std::size_t>(region)]);
  }
  return result;
}

// Over faces with an offset of their own: the largest that a vertex falls short of, 0 if none does.
double missed_offset(const Points3& x, const mesh::SupportMesh& support, const RelaxOptions& options) {
  if (options.face_offsets.empty()) return 0;
  const contact::Surface body = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  const contact::SupportField field(body, support.x);
  std::vector<contact::SurfacePoint> near;
  std::vector<int> warm;
  field.nearest(x, *std::max_element(options.face_offsets.begin(), options.face_offsets.end()), near, warm);
  double missed = 0;
  for (const contact::SurfacePoint& p : near) {
    if (p.face < 0) continue;
    const double offset = options.face_offsets[static_cast<std::size_t>(p.face)];
    if (offset != options.offset && p.distance < offset - kNearly) missed = std::max(missed, offset);
  }
  return missed;
}

Result<RelaxOptions> relax_options(const mesh::SupportMesh& support, const PlaceParams& params) {
  RelaxOptions options;
  options.offset = params.offset;
  TOILE_TRY(options.face_offsets, face_offsets(support, params));
  options.clearance = params.clearance;
  options.thickness = params.thickness;
  options.closing_steps = params.closing_steps;
  options.swelling_steps = params.swelling_steps;
  options.settling_steps = params.settling_steps;
  options.polishing_steps = params.polishing_steps;
  options.max_strain = kPolish * params.max_strain;
  options.rms_strain = kPolish * params.rms_strain;
  options.seam = params.seam;
  options.bending = params.bending;
  return options;
}

// Between the curves of a frame. The cloth has no large folds to form: no coarse mesh, no flattened support.
Result<Placed> place_on_frame(const mesh::GarmentMesh& garment, const mesh::SupportMesh& frame, const PlaceParams& params, const std::function<void(double)>& progress) {
  Placed placed;
  placed.garment = garment;
  TOILE_TRY(placed.lines, held_lines(garment, frame, params.curves, params.lines));
  TOILE_TRY(const Points3 start, spread(garment, placed.lines, params.thickness));
  TOILE_TRY(RelaxOptions options, relax_options(frame, params));
  options.closing_steps = options.swelling_steps = 0;
  options.progress = progress;
  for (const HeldLine& line : placed.lines) options.targets.insert(options.targets.end(), line.targets.begin(), line.targets.end());
  // What spreading has bent is meant to be.
  options.rolled = start;
  placed.garment.x = relax(garment, start, frame, options);
  conclude(placed, frame, params, {});
  for (const HeldLine& line : placed.lines) {
    placed.line_gaps.push_back(line_gap(line, placed.garment.x));
    if (std::abs(line.length / line.curve_length - 1) > params.line_tolerance) {
      placed.findings.push_back({.code = "line_length", .place = {.item = "line " + line.name},
                                 .what = fmt::format("{:.1f} mm of cloth lie on {:.1f} mm of curve '{}'", 1e3 * line.length, 1e3 * line.curve_length, line.curve),
                                 .remedy = "change the pattern or the curve, or allow more by line_tolerance", .category = Category::check});
    }
    if (placed.line_gaps.back().largest <= params.max_line_gap) continue;
    placed.findings.push_back({.code = "line_gap", .place = {.item = "line " + line.name},
                               .what = fmt::format("it lies up to {:.1f} mm from curve '{}' ({:.1f} mm of cloth on {:.1f} mm)", 1e3 * placed.line_gaps.back().largest, line.curve,
                                                   1e3 * line.length, 1e3 * line.curve_length),
                               .remedy = "check the line's direction and lengths, or allow more by max_line_gap", .category = Category::check});
  }
  return placed;
}

// Cloth that cuts itself, pulled out of itself.
Points3 pulled_apart(const mesh::GarmentMesh& garment, const Points3& x) {
  const contact::Surface cloth = contact::make_surface(static_cast<int>(x.rows()), garment.faces, mesh::particles(garment));
  return contact::self_intersections(cloth, x).empty() ? x : contact::untangle(cloth, x).x;
}

// A garment without free layers, laid on the support.
struct Laid {
  Points3 x;
  std::vector<std::optional<WantedDirection>> wanted;
  std::vector<PartFit> fits;
  Issues warnings;
};

Result<Laid> lay_shell(const mesh::GarmentMesh& sewn, const Rooms& rooms, const mesh::SupportMesh& support, const PlaceParams& params, const std::function<void(double)>& progress) {
  const std::vector<int> stuck = stuck_folds(sewn);
  const mesh::GarmentMesh garment = without_folds(sewn, stuck);
  TOILE_TRY(RelaxOptions options, relax_options(support, params));
  TOILE_TRY(const BodyFrame frame, body_frame(support));
  const FoldedFlat folded_flat = fold_flat(garment);
  TOILE_TRY(const Layout layout, make_layout(garment, folded_flat, support, frame, params));
  TOILE_TRY(Start start, bend(garment, folded_flat, frame, layout, params));
  if (const double missed = loose(garment) ? missed_offset(start.x, support, options) : 0; missed > 0) {
    // What nothing holds stays as it is rolled: at once far enough out for every region that it lies over.
    PlaceParams farther = params;
    farther.offset = std::max(params.offset, missed);
    TOILE_TRY(start, bend(garment, folded_flat, frame, layout, farther));
  }
  options.flattening = start.flattening;
  for (const TrouserLeg& leg : layout.trousers) {
    // Else the two layers between the thighs change places and tangle.
    options.sides.panels.resize(garment.panels.size(), 0);
    for (const TrouserPanel& panel : leg.panels) options.sides.panels[static_cast<std::size_t>(panel.panel)] = leg.side;
    options.sides.x = frame.x_mid;
    options.sides.below = frame.crotch;
  }
  options.room_inside = rooms.inside;
  options.room_outside = rooms.outside;
  Laid laid;
  for (int fold : stuck) {
    laid.warnings.push_back({.code = "fold_not_turned", .place = {.item = "fold " + sewn.folds[static_cast<std::size_t>(fold)].name},
                               .what = "its line curves round the part that turns: without stretching the cloth it cannot be folded back; it is placed flat",
                               .remedy = "the simulation turns it, or straighten the line"});
  }
  // Large folds on a coarse mesh, where they are cheap; then finer ones need to lose the creases between coarse
  // triangles only.
  // A mesh of about the coarse size is its own coarse mesh: thinning it a little only spoils its triangles.
  double cell = 0;
  for (const mesh::Panel& panel : garment.panels) cell = std::max({cell, panel.cell_warp, panel.cell_weft});
  std::vector<char> first(garment.panels.size());
  for (std::size_t p = 0; p < first.size(); ++p) first[p] = layout.panels[p].part != Part::attached;
  // First the tubes while the support swells in them, then what stands on them.
  // Cloth that is rolled or folded already needs no further work to stay so, as a panel that no seam holds; other garments
  // keep to flat.
  const bool shaped = std::any_of(layout.panels.begin(), layout.panels.end(), [](const PanelLayout& p) { return p.part == Part::attached; }) ||
                      !fold_lines(garment).empty() || garment.welds.empty();
  const auto rolled_of = [&](const Points3& x) { return shaped ? x : Points3(); };
  const auto assemble = [&](const mesh::GarmentMesh& mesh, const FoldedFlat& flat, const Points3& bent, const Rooms& room) {
    RelaxOptions stage = options;
    stage.rolled = rolled_of(bent);
    stage.room_inside = room.inside;
    stage.room_outside = room.outside;
    if (std::find(first.begin(), first.end(), 0) == first.end()) return relax(mesh, bent, support, stage);
    const Subset tubes = take(mesh, first);
    stage.rolled = rolled_of(tubes.restricted(bent));
    stage.room_inside = tubes.restricted(room.inside);
    stage.room_outside = tubes.restricted(room.outside);
    stage.settling_steps = stage.polishing_steps = 0;
    Points3 x = tubes.merged(relax(tubes.mesh, tubes.restricted(bent), support, stage), bent);
    // Turned over a curved line, a collar's fall may start in creases that cut one another.
    x = pulled_apart(mesh, attach(mesh, flat, layout, x, support, params.offset));
    stage = options;
    stage.rolled = rolled_of(x);
    stage.room_inside = room.inside;
    stage.room_outside = room.outside;
    stage.flattening.depth = 1;
    stage.swelling_steps = 0;
    return relax(mesh, x, support, stage);
  };
  // Nothing to draw together: where the bent panels lie clear of the support and of one another, they stay as they were rolled.
  const auto rolled_is_clear = [&] {
    if (!loose(garment) || start.flattening.depth < 1) return false;
    mesh::GarmentMesh bent = garment;
    bent.x = start.x;
    const Report report = measure(bent, support);
    return report.smallest_gap >= params.clearance && missed_offset(start.x, support, options) == 0 && report.self_intersections.empty() && report.support_intersections.empty();
  };
  // From the coarsest mesh to the given one, each about a third as fine as the next.
  std::vector<double> sizes;
  for (double size = kLevel * cell; size < params.coarse / kLevel; size *= kLevel) sizes.push_back(size);
  if (params.coarse > 1.25 * cell) sizes.push_back(params.coarse);
  const double levels = static_cast<double>(sizes.size()) + 1;
  std::vector<CoarseGarment> coarse;
  std::vector<Level> meshes{{&garment, folded_flat, start.x, rooms}};
  coarse.reserve(sizes.size());
  for (const double size : sizes) {
    const Level& finer = meshes.back();
    coarse.push_back(coarsen(*finer.mesh, size));
    const CoarseGarment& made = coarse.back();
    Level level{&made.mesh, {}, made.restricted(finer.bent), {made.restricted(finer.room.inside), made.restricted(finer.room.outside)}};
    level.flat.uv.resize(static_cast<Eigen::Index>(made.fine_of.size()), 2);
    for (std::size_t i = 0; i < made.fine_of.size(); ++i) {
      level.flat.uv.row(static_cast<Eigen::Index>(i)) = finer.flat.uv.row(made.fine_of[i]);
      level.flat.layer.push_back(finer.flat.layer[static_cast<std::size_t>(made.fine_of[i])]);
    }
    meshes.push_back(std::move(level));
  }
  double done = 0;
  options.progress = [&](double f) {
    if (progress) progress((done + f) / (levels + 1));
  };
  const bool stays = rolled_is_clear();
  Points3 x = stays ? start.x : assemble(*meshes.back().mesh, meshes.back().flat, meshes.back().bent, meshes.back().room);
  options.flattening.depth = 1;
  options.closing_steps = 0;
  options.swelling_steps = 0;
  options.settling_steps = params.fine_steps;
  // Under layers fronts keep their lap, or the edges of facings meet in it.
  if (rooms.inside.empty()) {
    options.fasten = kLooseFastening;
    options.loose = kLoose;
  }
  for (std::size_t i = stays ? 0 : meshes.size(); i-- > 0;) {
    done += 1;
    if (i + 1 < meshes.size() || meshes.size() == 1) {
      if (shaped) options.rolled = meshes[i].bent;
      options.room_inside = meshes[i].room.inside;
      options.room_outside = meshes[i].room.outside;
      x = relax(*meshes[i].mesh, x, support, options);
    }
    if (i == 0) break;
    x = coarse[i - 1].prolonged(x);
    // A fine triangle that lies across an edge of the coarse mesh cuts its corner: sheets near one another may come through.
    x = pulled_apart(*meshes[i - 1].mesh, x);
  }
  laid.x = x;
  laid.wanted = wanted_directions(garment, folded_flat, layout, start.x);
  laid.fits = fit_of_parts(garment, layout, start.x, support, start.flattening);
  return laid;
}

// Layers find their shape between the panels that they lie on, which stay, and the support.
RelaxOptions layer_options(const RelaxOptions& shell, const std::vector<char>& free, const LaidLayers& layers, const PlaceParams& params) {
  RelaxOptions options = shell;
  const auto nearer = [&](double offset) { return std::max(params.clearance, kLayerOffset * offset); };
  options.offset = nearer(options.offset);
  for (double& offset : options.face_offsets) offset = nearer(offset);
  options.closing_steps = options.swelling_steps = 0;
  options.settling_steps = kLayerSettling * params.fine_steps;
  options.polishing_steps = std::min(params.polishing_steps, kLayerPolishing);
  options.seam *= kLayerSeam;
  options.closed = kLayerClosed;
  options.rolled = layers.smooth;
  options.ironing = true;
  for (const char f : free) options.held.push_back(!f);
  return options;
}

Result<Placed> place_as_given(const mesh::GarmentMesh& sewn, const mesh::SupportMesh& support, const PlaceParams& params, const std::function<void(double)>& progress) {
  Placed placed;
  placed.garment = sewn;
  const std::vector<char> free = free_panels(sewn);
  if (std::find(free.begin(), free.end(), 1) == free.end()) {
    TOILE_TRY(Laid laid, lay_shell(sewn, {}, support, params, progress));
    placed.garment.x = laid.x;
    placed.warnings = laid.warnings;
    conclude(placed, support, params, laid.wanted);
    placed.report.fits = laid.fits;
    return placed;
  }
  Issues issues;
  for (const auto& [name, spec] : params.panels) {
    for (std::size_t p = 0; p < free.size(); ++p) {
      if (!free[p] || sewn.panels[p].name != name) continue;
      issues.push_back({.code = "free_layer", .place = {.item = "panels." + name}, .what = "it is a free layer, which goes where the panels under it are",
                        .remedy = "leave its settings out, or set the panels that it lies on", .category = Category::input});
    }
  }
  if (!issues.empty()) return issues;
  // The shell leaves room for its layers; they are laid on it, and find their shape.
  const double gap = kLayerGap * params.thickness;
  const Rooms rooms = rooms_for_layers(sewn, gap);
  std::vector<char> shell_panels;
  for (const char f : free) shell_panels.push_back(!f);
  const Subset shell = take_apart(sewn, shell_panels);
  TOILE_TRY(Laid laid, lay_shell(shell.mesh, {shell.restricted(rooms.inside), shell.restricted(rooms.outside)}, support, params, [&](double f) {
              if (progress) progress(kShellShare * f);
            }));
  placed.warnings = laid.warnings;
  TOILE_TRY(const LaidLayers layers, lay_layers(sewn, shell.merged(laid.x, sewn.x), gap));
  TOILE_TRY(const RelaxOptions shell_options, relax_options(support, params));
  RelaxOptions options = layer_options(shell_options, free, layers, params);
  options.progress = [&](double f) {
    if (progress) progress(kShellShare + (1 - kShellShare) * f);
  };
  Points3 x = relax(sewn, layers.x, support, options);
  if (const StrainSummary strain = edge_strain(sewn, x); strain.largest > options.max_strain || strain.rms > options.rms_strain) {
    // Where layers find no room the panels under them give way.
    options.held.clear();
    options.settling_steps = 0;
    options.polishing_steps = params.polishing_steps;
    x = relax(sewn, x, support, options);
  }
  placed.garment.x = x;
  std::vector<std::optional<WantedDirection>> wanted(static_cast<std::size_t>(sewn.face_count()));
  std::size_t row = 0;
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    if (!free[static_cast<std::size_t>(sewn.face_panel[static_cast<Eigen::Index>(f)])]) wanted[f] = laid.wanted[row++];
  }
  conclude(placed, support, params, wanted);
  placed.report.fits = laid.fits;
  return placed;
}

}  // namespace

// Work is done on one of the two mirror images, so that a mirrored garment on a mirrored support gives the mirrored result
// to the last bit.
Result<Placed> place(const mesh::GarmentMesh& sewn, const mesh::SupportMesh& support, const PlaceParams& given, const std::function<void(double)>& progress) {
  if (!given.lines.empty()) return place_on_frame(sewn, support, given, progress);
  const PlaceParams params = with_named_legs(sewn, given);
  if (!left_handed(support)) return place_as_given(sewn, support, params, progress);
  TOILE_TRY(Placed placed, place_as_given(mirrored(sewn), mirrored(support), mirrored(params), progress));
  const Points3 x = mirrored(placed.garment).x;
  placed.garment = sewn;
  placed.garment.x = x;
  for (double& angle : placed.report.face_warp_angle) angle = -angle;
  for (PartFit& fit : placed.report.fits) fit.part = mirrored(fit.part);
  std::sort(placed.report.fits.begin(), placed.report.fits.end(), [](const PartFit& a, const PartFit& b) { return a.part < b.part; });
  add_columns(placed.garment, placed.report);
  return placed;
}

namespace {

/// What lies in the support, or nearer to it than `offset`, is lifted off it along the support's smooth normals.
Points3 lifted(const Points3& x, const mesh::SupportMesh& support, const RelaxOptions& options) {
  Points3 normals = Points3::Zero(support.x.rows(), 3);
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    const Vector3d a = support.x.row(support.faces(f, 0)), b = support.x.row(support.faces(f, 1)), c = support.x.row(support.faces(f, 2));
    for (int k = 0; k < 3; ++k) normals.row(support.faces(f, k)) += (b - a).cross(c - a).transpose();
  }
  normals.rowwise().normalize();
  const contact::Surface body = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  const contact::SupportField field(body, support.x);
  std::vector<contact::SurfacePoint> near;
  std::vector<int> warm;
  double farthest = options.offset;
  for (const double offset : options.face_offsets) farthest = std::max(farthest, offset);
  field.nearest(x, 2 * farthest, near, warm);
  Points3 result = x;
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const contact::SurfacePoint& p = near[static_cast<std::size_t>(v)];
    if (p.face < 0) continue;
    const double offset = options.face_offsets.empty() ? options.offset : options.face_offsets[static_cast<std::size_t>(p.face)];
    if (p.distance >= offset) continue;
    Vector3d normal = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) normal += p.weight[static_cast<std::size_t>(k)] * normals.row(support.faces(p.face, k)).transpose();
    result.row(v) = (p.point + offset * normal.normalized()).transpose();
  }
  return result;
}

}  // namespace

Result<Placed> place_from(const mesh::GarmentMesh& sewn, const Points3& start, const mesh::SupportMesh& support, const PlaceParams& params, const std::function<void(double)>& progress) {
  if (!params.lines.empty()) {
    return Issue{.code = "bad_combination", .place = {.item = "lines"}, .what = "given positions and lines on curves both say where the garment begins",
                 .remedy = "leave out one of them", .category = Category::input};
  }
  TOILE_TRY(RelaxOptions options, relax_options(support, params));
  options.closing_steps = options.swelling_steps = 0;
  options.settling_steps = params.fine_steps;
  const Points3 x = lifted(start, support, options);
  options.rolled = x;
  options.progress = progress;
  Placed placed;
  placed.garment = sewn;
  placed.garment.x = relax(sewn, x, support, options);
  conclude(placed, support, params, {});
  return placed;
}

}  // namespace toile::placement
