#include "toile/placement/body_frame.h"

#include "toile/geometry/slice.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toile::placement {

namespace {

using geometry::Plane;
using geometry::Polyline;

constexpr double kStep = 0.01;         // between sections [m]
constexpr double kArmJump = 1.12;      // the trunk's width grows by more than this over 5 mm where the arms join
constexpr double kSmallestLeg = 0.15;  // girth below which a curve beside the middle is no leg [m]
constexpr std::size_t kLegSections = 8;  // shorter legs are none
constexpr double kSmallestLimb = 0.08; // girth below which a curve is a finger, an ear or a crumb of the mesh [m]

struct Curve {
  Points3 points;
  double x_low, x_high;
  Eigen::Vector3d centroid;
};

std::vector<Curve> horizontal(const mesh::SupportMesh& support, double y) {
  std::vector<Curve> curves;
  for (Polyline& line : geometry::slice(support.x, support.faces, Plane{{0, y, 0}, Eigen::Vector3d::UnitY()})) {
    if (line.points.rows() < 3) continue;
    Curve curve;
    curve.x_low = line.points.col(0).minCoeff();
    curve.x_high = line.points.col(0).maxCoeff();
    curve.centroid = line.points.colwise().mean().transpose();
    curve.points = std::move(line.points);
    curves.push_back(std::move(curve));
  }
  return curves;
}

Points2 hull_of(const std::vector<const Curve*>& curves) {
  Eigen::Index count = 0;
  for (const Curve* curve : curves) count += curve->points.rows();
  Points3 all(count, 3);
  Eigen::Index at = 0;
  for (const Curve* curve : curves) {
    all.middleRows(at, curve->points.rows()) = curve->points;
    at += curve->points.rows();
  }
  // Counter-clockwise in (z, x), from the front to the left side: the way in which u of a panel's face side goes round.
  const Points3 hull = geometry::convex_hull(all, Eigen::Vector3d::UnitY());
  Points2 flat(hull.rows(), 2);
  flat.col(0) = hull.col(2);
  flat.col(1) = hull.col(0);
  return flat;
}

double perimeter(const Points2& hull) {
  double sum = 0;
  for (Eigen::Index i = 0; i < hull.rows(); ++i) sum += (hull.row((i + 1) % hull.rows()) - hull.row(i)).norm();
  return sum;
}

// Curve around the middle with the largest extent, if any.
const Curve* around_middle(const std::vector<Curve>& curves, double x_mid) {
  const Curve* best = nullptr;
  for (const Curve& curve : curves) {
    if (curve.x_low < x_mid && curve.x_high > x_mid && (!best || curve.x_high - curve.x_low > best->x_high - best->x_low)) best = &curve;
  }
  return best;
}

// Perpendicular section of a limb through `centre`: the curve around it.
std::optional<LimbPoint> limb_section(const mesh::SupportMesh& support, const Eigen::Vector3d& centre, const Eigen::Vector3d& direction) {
  std::optional<LimbPoint> best;
  double best_distance = 0;
  for (const Polyline& line : geometry::slice(support.x, support.faces, Plane{centre, direction})) {
    if (!line.closed || line.points.rows() < 3) continue;
    const double girth = geometry::tape_girth(line.points, direction);
    if (girth < kSmallestLimb) continue;
    // centroid by length, so that dense parts of the mesh do not pull it
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0;
    for (Eigen::Index i = 0; i < line.points.rows(); ++i) {
      const Eigen::Vector3d a = line.points.row(i), b = line.points.row((i + 1) % line.points.rows());
      sum += (b - a).norm() * 0.5 * (a + b);
      total += (b - a).norm();
    }
    LimbPoint point;
    point.centre = sum / total;
    point.girth = girth;
    for (Eigen::Index i = 0; i < line.points.rows(); ++i) {
      point.radius = std::max(point.radius, (line.points.row(i).transpose() - point.centre).norm());
    }
    const double distance = (point.centre - centre).norm();
    if (!best || distance < best_distance) {
      best = point;
      best_distance = distance;
    }
  }
  if (best && best_distance > best->radius) return std::nullopt;  // another limb
  return best;
}

// Follows an arm outwards from just below the armpit. side: +1 left, -1 right.
std::optional<Limb> find_arm(const mesh::SupportMesh& support, const BodyFrame& frame, double side, double half_width) {
  // First idea of the axis: sections by planes x = const, outwards from the trunk's side.
  std::vector<Eigen::Vector3d> centres;
  const double start = half_width + 0.02;
  Eigen::Vector3d previous(frame.x_mid + side * start, frame.armpit + 0.05, 0);
  bool first = true;
  for (double out = start; out < start + 0.16; out += kStep) {
    const Plane plane{{frame.x_mid + side * out, 0, 0}, Eigen::Vector3d::UnitX()};
    std::optional<Eigen::Vector3d> found;
    for (const Polyline& line : geometry::slice(support.x, support.faces, plane)) {
      if (line.points.rows() < 3 || geometry::tape_girth(line.points, plane.normal) < kSmallestLimb) continue;
      const Eigen::Vector3d centre = 0.5 * (line.points.colwise().maxCoeff() + line.points.colwise().minCoeff()).transpose();
      if (centre.y() < frame.waist) continue;  // a leg or a hand
      if (!found || std::abs(centre.y() - previous.y()) < std::abs(found->y() - previous.y())) found = centre;
    }
    if (!found) break;
    if (!first && (*found - previous).norm() > 0.05) break;
    centres.push_back(*found);
    previous = *found;
    first = false;
  }
  if (centres.size() < 4) return std::nullopt;
  Eigen::Vector3d direction = (centres.back() - centres.front()).normalized();
  Eigen::Vector3d at = centres[centres.size() / 2];
  // Perpendicular sections, outwards and inwards, each recentred; the axis follows their centres.
  Limb limb;
  const auto follow = [&](double sense, double reach) {
    std::vector<LimbPoint> points;
    Eigen::Vector3d position = at, along = direction;
    double last_girth = 0;
    for (double s = 0; s < reach; s += kStep) {
      const auto point = limb_section(support, position, along);
      if (!point) break;
      if (last_girth > 0 && point->girth > 1.15 * last_girth) break;  // into the trunk, or into the hand's spread
      if (last_girth > 0 && point->girth < 0.6 * last_girth) break;
      last_girth = point->girth;
      points.push_back(*point);
      if (points.size() >= 5) along = sense * (points.back().centre - points[points.size() - 5].centre).normalized();
      if (along.dot(direction) < 0.3) break;
      position = point->centre + sense * kStep * along;
    }
    return points;
  };
  const std::vector<LimbPoint> inwards = follow(-1, 0.25);
  const std::vector<LimbPoint> outwards = follow(1, 0.9);
  if (outwards.size() < 4) return std::nullopt;
  for (std::size_t i = inwards.size(); i-- > 1;) limb.points.push_back(inwards[i]);
  limb.points.insert(limb.points.end(), outwards.begin(), outwards.end());
  // Straight line through the part next to the trunk (a short sleeve's length).
  const std::size_t count = std::min<std::size_t>(limb.points.size(), 22);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) mean += limb.points[i].centre;
  mean /= static_cast<double>(count);
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  const Eigen::Vector3d reference = limb.points[count - 1].centre - limb.points[0].centre;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d offset = limb.points[i].centre - mean;
    moment += offset * offset.dot(reference);
  }
  limb.direction = moment.normalized();
  limb.origin = mean + (limb.points[0].centre - mean).dot(limb.direction) * limb.direction;
  return limb;
}

// Follows the legs down from the crotch: the curve next to the middle on either side, as long as there are both.
void find_legs(const mesh::SupportMesh& support, BodyFrame& frame) {
  std::array<Limb, 2> legs;  // right, left
  for (double y = frame.crotch - kStep; y > frame.bottom + 0.002; y -= kStep) {
    const auto curves = horizontal(support, y);
    std::array<std::optional<LimbPoint>, 2> found;
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      const double side = i == 0 ? -1 : 1;
      const Curve* nearest = nullptr;
      for (const Curve& curve : curves) {
        if (side * (curve.centroid.x() - frame.x_mid) <= 0 || geometry::tape_girth(curve.points, Eigen::Vector3d::UnitY()) < kSmallestLeg) continue;
        if (!nearest || std::abs(curve.centroid.x() - frame.x_mid) < std::abs(nearest->centroid.x() - frame.x_mid)) nearest = &curve;
      }
      if (!nearest) continue;
      LimbPoint point;
      point.centre = 0.5 * (nearest->points.colwise().maxCoeff() + nearest->points.colwise().minCoeff()).transpose();
      point.girth = geometry::tape_girth(nearest->points, Eigen::Vector3d::UnitY());
      point.hull = hull_of({nearest});
      for (Eigen::Index k = 0; k < nearest->points.rows(); ++k) point.radius = std::max(point.radius, (nearest->points.row(k).transpose() - point.centre).norm());
      // into the foot
      if (!legs[i].points.empty() && (point.girth > 1.15 * legs[i].points.back().girth || (point.centre - legs[i].points.back().centre).norm() > 0.03)) continue;
      found[i] = point;
    }
    if (!found[0] || !found[1]) break;
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) legs[i].points.push_back(*found[i]);
  }
  if (legs[0].points.size() < kLegSections) return;
  for (Limb& leg : legs) {
    leg.origin = leg.points.front().centre;
    leg.direction = (leg.points.back().centre - leg.origin).normalized();
  }
  frame.leg_right = std::move(legs[0]);
  frame.leg_left = std::move(legs[1]);
}

}  // namespace

const Section& BodyFrame::section(double y) const {
  TOILE_CHECK(!sections.empty(), "sections {}", sections.size());
  const auto it = std::min_element(sections.begin(), sections.end(),
                                   [&](const Section& a, const Section& b) { return std::abs(a.y - y) < std::abs(b.y - y); });
  return *it;
}

Result<BodyFrame> body_frame(const mesh::SupportMesh& support) {
  BodyFrame frame;
  frame.bottom = support.x.col(1).minCoeff();
  frame.top = support.x.col(1).maxCoeff();
  for (const auto& [name, at] : support.landmarks) frame.landmarks[name] = Eigen::Vector3d(at[0], at[1], at[2]);
  const double height = frame.top - frame.bottom;
  const Eigen::RowVector3d box_low = support.x.colwise().minCoeff(), box_high = support.x.colwise().maxCoeff();
  frame.x_mid = 0.5 * (box_low.x() + box_high.x());

  // Widths of the trunk upwards; the plane of symmetry is refined from them.
  struct Row {
    double y, low, high;
  };
  std::vector<Row> rows;
  for (double y = frame.bottom + 0.005; y < frame.top - 0.002; y += 0.005) {
    const auto curves = horizontal(support, y);
    const Curve* trunk = around_middle(curves, frame.x_mid);
    if (trunk) rows.push_back({y, trunk->x_low, trunk->x_high});
  }
  if (rows.size() < 20) {
    return Issue{.code = "no_trunk", .place = {.item = "support"}, .what = "no horizontal section goes around the middle of the support",
                 .remedy = "give a closed body, upright (y up) and facing +z", .category = Category::input};
  }
  std::vector<double> middles;
  for (const Row& row : rows) middles.push_back(0.5 * (row.low + row.high));
  std::nth_element(middles.begin(), middles.begin() + static_cast<std::ptrdiff_t>(middles.size() / 2), middles.end());
  frame.x_mid = middles[middles.size() / 2];

  // Crotch: the longest run of rows without a hole upwards from it.
  frame.crotch = rows.front().y;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].y - rows[i - 1].y > 0.0076 && rows[i].y < frame.bottom + 0.75 * height) frame.crotch = rows[i].y;
  }
  // Armpit: the first sudden growth of the width above the crotch (a fifth of the trunk above it at least).
  frame.armpit = frame.top;
  bool found_armpit = false;
  double widest = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].y < frame.crotch + 0.15 * (frame.top - frame.crotch)) continue;
    const double before = rows[i - 1].high - rows[i - 1].low, now = rows[i].high - rows[i].low;
    widest = std::max(widest, before);
    if (now > kArmJump * before) {
      frame.armpit = rows[i - 1].y;
      found_armpit = true;
      break;
    }
  }
  const auto trunk_section = [&](double y) -> std::optional<Section> {
    const auto curves = horizontal(support, y);
    std::vector<const Curve*> kept;
    if (const Curve* trunk = around_middle(curves, frame.x_mid); trunk && y >= frame.crotch) {
      kept.push_back(trunk);
    } else if (y < frame.crotch) {
      // legs: the curve next to the middle on either side
      for (const double side : {-1.0, 1.0}) {
        const Curve* nearest = nullptr;
        for (const Curve& curve : curves) {
          if (side * (curve.centroid.x() - frame.x_mid) <= 0 || geometry::tape_girth(curve.points, Eigen::Vector3d::UnitY()) < 0.15) continue;
          if (!nearest || std::abs(curve.centroid.x() - frame.x_mid) < std::abs(nearest->centroid.x() - frame.x_mid)) nearest = &curve;
        }
        if (nearest) kept.push_back(nearest);
      }
    }
    if (kept.empty()) return std::nullopt;
    Section section;
    section.y = y;
    section.hull = hull_of(kept);
    section.girth = perimeter(section.hull);
    section.merged = found_armpit && y > frame.armpit;
    return section;
  };
  // Neck: going up from the armpit the outline narrows; its first smallest girth that is clearly below the shoulders'.
  frame.neck = frame.top;
  {
    double largest = 0, smallest = 1e9;
    for (double y = found_armpit ? frame.armpit + 0.05 : frame.crotch + 0.6 * (frame.top - frame.crotch); y < frame.top - 0.005; y += 0.005) {
      const auto section = trunk_section(y);
      if (!section) continue;
      largest = std::max(largest, section->girth);
      if (section->girth > 0.6 * largest) continue;
      if (section->girth < smallest) {
        smallest = section->girth;
        frame.neck = y;
      } else if (section->girth > 1.1 * smallest) {
        break;
      }
    }
  }
  if (!found_armpit) frame.armpit = frame.neck;
  for (double y = frame.bottom + 0.005; y <= frame.neck; y += kStep) {
    if (auto section = trunk_section(y)) frame.sections.push_back(std::move(*section));
  }
  if (frame.sections.empty()) {
    return Issue{.code = "no_trunk", .place = {.item = "support"}, .what = "the support has no trunk below the neck",
                 .remedy = "give a closed body, upright (y up) and facing +z", .category = Category::input};
  }
  // Waist, hips, chest from the girths of the free trunk.
  const double trunk_low = frame.crotch, trunk_high = frame.armpit;
  frame.waist = 0.5 * (trunk_low + trunk_high);
  double waist_low = trunk_low + 0.25 * (trunk_high - trunk_low), waist_high = trunk_high - 0.1 * (trunk_high - trunk_low);
  if (const auto it = frame.landmarks.find("waist_front"); it != frame.landmarks.end()) {
    // A form knows where its waist is; cloth hangs from the narrowest place near it. (Without arms there is no armpit to end
    // the trunk, and the neck would be taken for the narrowest place.)
    waist_low = it->second.y() - 0.06;
    waist_high = it->second.y() + 0.06;
    frame.waist = it->second.y();
  }
  double smallest = 1e9;
  for (const Section& section : frame.sections) {
    if (section.y < waist_low || section.y > waist_high) continue;
    if (section.girth < smallest) {
      smallest = section.girth;
      frame.waist = section.y;
    }
  }
  frame.hips = trunk_low;
  double largest = 0;
  for (const Section& section : frame.sections) {
    if (section.y < trunk_low - 0.1 || section.y > frame.waist || section.girth <= largest) continue;
    largest = section.girth;
    frame.hips = section.y;
  }
  largest = 0;
  for (const Section& section : frame.sections) {
    if (section.y < frame.waist || section.y > trunk_high || section.girth <= largest) continue;
    largest = section.girth;
    frame.chest = section.y;
  }
  if (found_armpit) {
    double half = 0;
    for (const Row& row : rows) {
      if (std::abs(row.y - frame.armpit) < 0.004) half = 0.5 * (row.high - row.low);
    }
    frame.arm_left = find_arm(support, frame, 1, half);
    frame.arm_right = find_arm(support, frame, -1, half);
  }
  find_legs(support, frame);
  return frame;
}

std::optional<double> outline_top(const mesh::SupportMesh& support, double x) {
  std::optional<double> top;
  for (const Polyline& line : geometry::slice(support.x, support.faces, Plane{{x, 0, 0}, Eigen::Vector3d::UnitX()})) {
    const double high = line.points.col(1).maxCoeff();
    if (!top || high > *top) top = high;
  }
  return top;
}

}  // namespace toile::placement
