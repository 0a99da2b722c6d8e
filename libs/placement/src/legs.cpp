#include "toile/placement/legs.h"

#include "toile/placement/layout.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBent = 0.015;    // a leg whose middles leave its straight line by more is bent [m]
constexpr double kStep = 0.01;     // along the axis [m]
constexpr double kSmooth = 0.08;   // middles are averaged over so much to either side [m]
constexpr double kAbove = 1.5;     // the axis goes on so far over the leg and under it [m]
constexpr double kRows = 0.01;     // from one section of trousers to the next [m]
constexpr double kBlend = 0.04;    // sections are averaged over so much to either side [m]
constexpr double kGap = 0.004;     // of a trouser leg from the plane of symmetry [m]
constexpr double kOpen = 0.006;    // seams start so far apart [m]
constexpr double kNarrow = 0.01;   // cloth may lack this part of a girth before it is refused
constexpr double kCrotch = 0.012;  // the rise may end so far over the crotch [m]
constexpr int kTangents = 240;     // of a section
constexpr double kCorner = 50 * std::numbers::pi / 180;  // direction in which a half section's front corner is outermost, from the front inwards

double angle_of(int k) { return 2 * std::numbers::pi * k / kTangents; }

// How far a closed convex section reaches in each of kTangents directions (front, left), from the axis.
using Support = std::array<double, kTangents>;

// Corners between neighbouring tangents, from the front to the left.
std::vector<Vector2d> corners(const Support& support) {
  std::vector<Vector2d> result;
  const double step = 2 * std::numbers::pi / kTangents, sine = std::sin(step), cosine = std::cos(step);
  for (int k = 0; k < kTangents; ++k) {
    const double here = support[static_cast<std::size_t>(k)], next = support[static_cast<std::size_t>((k + 1) % kTangents)];
    const double t = (next - here * cosine) / sine;  // along the tangent at k from its foot
    const double c = std::cos(angle_of(k)), s = std::sin(angle_of(k));
    result.emplace_back(here * c - t * s, here * s + t * c);
  }
  return result;
}

Support support_of(const std::vector<Vector2d>& points) {
  Support support;
  for (int k = 0; k < kTangents; ++k) {
    const Vector2d d(std::cos(angle_of(k)), std::sin(angle_of(k)));
    double most = -1e9;
    for (const Vector2d& p : points) most = std::max(most, d.dot(p));
    support[static_cast<std::size_t>(k)] = most;
  }
  return support;
}

double perimeter(const Support& support) {
  double sum = 0;
  for (double s : support) sum += s;
  return sum * 2 * std::numbers::pi / kTangents;
}

// What of a convex polygon lies at side * left >= border.
std::vector<Vector2d> clipped(const std::vector<Vector2d>& polygon, double side, double border) {
  std::vector<Vector2d> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = side * a.y() - border, db = side * b.y() - border;
    if (da >= 0) result.push_back(a);
    if ((da >= 0) != (db >= 0)) result.push_back(a + da / (da - db) * (b - a));
  }
  return result;
}

// A closed section by arc length from where it is foremost in its middle, towards the left.
class Ring {
 public:
  explicit Ring(const Support& support) : points_(corners(support)) {
    at_.push_back(0);
    double low = 1e9, high = -1e9;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      at_.push_back(at_.back() + (points_[(i + 1) % points_.size()] - points_[i]).norm());
      low = std::min(low, points_[i].y());
      high = std::max(high, points_[i].y());
    }
    const double middle = 0.5 * (low + high);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector2d &a = points_[i], &b = points_[(i + 1) % points_.size()];
      // the front is where the section runs towards the left
      if (a.y() <= middle && b.y() > middle) start_ = at_[i] + (middle - a.y()) / (b.y() - a.y()) * (at_[i + 1] - at_[i]);
    }
  }
  double length() const { return at_.back(); }
  /// Point at s, moved outwards by `out`.
  Vector2d point(double s, double out) const {
    s = std::fmod(s + start_, length());
    if (s < 0) s += length();
    const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(std::upper_bound(at_.begin(), at_.end(), s) - at_.begin() - 1, 0, static_cast<std::ptrdiff_t>(points_.size()) - 1));
    const Vector2d &a = points_[i], &b = points_[(i + 1) % points_.size()];
    const double span = at_[i + 1] - at_[i];
    const double angle = angle_of(static_cast<int>(i) + 1);  // corner i lies between tangents i and i + 1
    return a + (span > 0 ? (s - at_[i]) / span : 0) * (b - a) + out * Vector2d(std::cos(angle), std::sin(angle));
  }
  /// Arc length of the point that lies outermost in a direction, within half a length of the start.
  double outermost(double angle) const {
    const Vector2d d(std::cos(angle), std::sin(angle));
    std::size_t best = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
      if (d.dot(points_[i]) > d.dot(points_[best])) best = i;
    }
    const double s = at_[best] - start_;
    return s - length() * std::round(s / length());
  }

 private:
  std::vector<Vector2d> points_;
  std::vector<double> at_;
  double start_ = 0;
};

double along(const std::vector<std::pair<double, double>>& curve, double h) {
  if (h <= curve.front().first) return curve.front().second;
  if (h >= curve.back().first) return curve.back().second;
  const auto it = std::upper_bound(curve.begin(), curve.end(), h, [](double value, const auto& p) { return value < p.first; });
  const auto& [h1, a1] = *it;
  const auto& [h0, a0] = *std::prev(it);
  return h1 > h0 ? a0 + (h - h0) / (h1 - h0) * (a1 - a0) : a0;
}

// Extent of the panels of a leg on a row, each by itself and added up: darts and notches count as cloth.
double row_width(const mesh::GarmentMesh& garment, const std::vector<Vector2d>& flat, const TrouserLeg& leg, double h) {
  double sum = 0;
  for (const TrouserPanel& panel : leg.panels) {
    if (panel.beside < 0 && &panel != &leg.panels.front()) continue;
    double low = 1e9, high = -1e9;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      if (garment.face_panel[f] != panel.panel) continue;
      for (int k = 0; k < 3; ++k) {
        const Vector2d &a = flat[static_cast<std::size_t>(garment.faces(f, k))], &b = flat[static_cast<std::size_t>(garment.faces(f, (k + 1) % 3))];
        if ((a.y() < h) == (b.y() < h)) continue;
        const double x = a.x() + (h - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        low = std::min(low, x);
        high = std::max(high, x);
      }
    }
    if (low < high) sum += high - low;
  }
  return sum;
}

std::string names_of(const mesh::GarmentMesh& garment, const TrouserLeg& leg) {
  std::string text;
  for (const TrouserPanel& panel : leg.panels) text += (text.empty() ? "" : ", ") + garment.panels[static_cast<std::size_t>(panel.panel)].name;
  return text;
}

double smoothstep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

LegAxis::LegAxis(const Limb& leg, Shape shape) {
  const Vector3d top = leg.points.front().centre, bottom = leg.points.back().centre, chord = (bottom - top).normalized();
  bool bent = shape == Shape::trousers;
  for (const LimbPoint& point : leg.points) {
    const Vector3d d = point.centre - top;
    bent = bent || (d - d.dot(chord) * chord).norm() > kBent;
  }
  if (!bent) {
    for (const double s : {-kAbove, kAbove}) {
      points_.push_back(leg.origin + s * leg.direction);
      h_.push_back(-s);
    }
    return;
  }
  std::vector<Vector3d> raw;
  std::vector<double> at;
  for (const LimbPoint& point : leg.points) {
    at.push_back(raw.empty() ? 0 : at.back() + (point.centre - raw.back()).norm());
    raw.push_back(point.centre);
  }
  const std::size_t thigh = std::min<std::size_t>(raw.size() - 1, 20);
  const Vector3d above = shape == Shape::trousers ? Vector3d::UnitY() : Vector3d((raw.front() - raw[thigh]).normalized());
  const Vector3d below = (raw.back() - raw[raw.size() - 1 - std::min<std::size_t>(raw.size() - 1, 8)]).normalized();
  const auto line = [&](double s) -> Vector3d {
    if (s <= 0) return raw.front() - s * above;
    if (s >= at.back()) return raw.back() + (s - at.back()) * below;
    const auto i = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), s) - at.begin());
    return raw[i - 1] + (s - at[i - 1]) / (at[i] - at[i - 1]) * (raw[i] - raw[i - 1]);
  };
  const int first = -static_cast<int>(kAbove / kStep), last = static_cast<int>((at.back() + kAbove) / kStep), reach = static_cast<int>(kSmooth / kStep);
  std::size_t zero = 0;
  for (int i = first; i <= last; ++i) {
    Vector3d sum = Vector3d::Zero();
    double total = 0;
    for (int d = -reach; d <= reach; ++d) {
      const double weight = reach + 1 - std::abs(d);
      sum += weight * line((i + d) * kStep);
      total += weight;
    }
    if (i == 0) zero = points_.size();
    points_.push_back(sum / total);
  }
  h_.assign(points_.size(), 0);
  for (std::size_t i = zero; i-- > 0;) h_[i] = h_[i + 1] + (points_[i] - points_[i + 1]).norm();
  for (std::size_t i = zero + 1; i < points_.size(); ++i) h_[i] = h_[i - 1] - (points_[i] - points_[i - 1]).norm();
}

LegAxis::Place LegAxis::at(double h) const {
  const auto it = std::lower_bound(h_.begin(), h_.end(), h, [](double a, double value) { return a > value; });
  const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(it - h_.begin()), 1, h_.size() - 1);
  const double t = (h_[i - 1] - h) / (h_[i - 1] - h_[i]);
  const auto tangent = [&](std::size_t k) { return Vector3d((points_[k > 0 ? k - 1 : 0] - points_[std::min(k + 1, points_.size() - 1)]).normalized()); };
  Place place;
  place.middle = points_[i - 1] + t * (points_[i] - points_[i - 1]);
  const double part = std::clamp(t, 0.0, 1.0);
  place.up = ((1 - part) * tangent(i - 1) + part * tangent(i)).normalized();
  place.front = (Vector3d::UnitZ() - place.up.z() * place.up).normalized();
  place.left = place.up.cross(place.front);
  return place;
}

double LegAxis::height(double y) const {
  double low = h_.back(), high = h_.front();
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (at(middle).middle.y() < y ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Result<std::vector<std::pair<int, Vector3d>>> bend_trousers(const mesh::GarmentMesh& garment, const std::vector<Vector2d>& flat, const std::vector<double>& sheet,
                                                           const BodyFrame& frame, const Layout& layout, const PlaceParams& params) {
  Issues issues;
  std::vector<std::pair<int, Vector3d>> result;
  for (const TrouserLeg& leg : layout.trousers) {
    const Limb& limb = leg.side > 0 ? *frame.leg_left : *frame.leg_right;
    const LegAxis axis(limb, LegAxis::Shape::trousers);
    std::vector<std::size_t> index(garment.panels.size(), leg.panels.size());
    for (std::size_t i = 0; i < leg.panels.size(); ++i) index[static_cast<std::size_t>(leg.panels[i].panel)] = i;
    double low = 1e9, high = -1e9, top = 1e9;  // top: of the seams between the leg's panels
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      if (index[static_cast<std::size_t>(garment.vertex_panel[v])] == leg.panels.size()) continue;
      low = std::min(low, flat[static_cast<std::size_t>(v)].y());
      high = std::max(high, flat[static_cast<std::size_t>(v)].y());
    }
    int seams = 0;
    for (const TrouserPanel& panel : leg.panels) {
      if (panel.beside < 0) continue;
      top = std::min(top, panel.own.back().first);
      ++seams;
    }
    top = std::max(std::min(top, high) - 0.01, leg.fork_top);
    const double fork_height = axis.at(leg.fork).middle.y();
    if (fork_height > frame.crotch + kCrotch) {
      issues.push_back({.code = "too_short", .place = {.item = "panels " + names_of(garment, leg)},
                        .what = fmt::format("the rise ends {:.0f} mm above the crotch of the support", 1e3 * (fork_height - frame.crotch)),
                        .remedy = "use a pattern with a deeper rise or a support with a shorter one, or let the trousers down (point, at, shift)"});
      continue;
    }
    // Sections by rows of cloth: the half trunk, and the leg, in the frame of the axis; how much farther out the cloth lies.
    const int rows = static_cast<int>(std::ceil((high - low) / kRows)) + 1;
    std::vector<LegAxis::Place> places;
    std::vector<Support> sections;
    std::vector<char> trunk;
    std::vector<double> out(static_cast<std::size_t>(rows), 0);
    const auto height = [&](int i) { return low + i * kRows; };
    double worst = 0;
    std::optional<Issue> narrow;
    for (int i = 0; i < rows; ++i) {
      const double h = height(i);
      const LegAxis::Place place = axis.at(h);
      places.push_back(place);
      const double y = place.middle.y();
      const bool upper = y >= frame.crotch;
      std::vector<Vector2d> outline;
      const auto add = [&](const Points2& hull, double height_of) {
        for (Eigen::Index k = 0; k < hull.rows(); ++k) {
          const Vector3d d = Vector3d(hull(k, 1), height_of, hull(k, 0)) - place.middle;
          outline.emplace_back(d.dot(place.front), d.dot(place.left));
        }
      };
      double girth = 0;
      if (upper) {
        const Section& section = frame.section(std::min(y, frame.armpit));
        add(section.hull, y);
        girth = 0.5 * section.girth;
      } else {
        const LimbPoint* nearest = &limb.points.front();
        for (const LimbPoint& point : limb.points) {
          if (std::abs(point.centre.y() - y) < std::abs(nearest->centre.y() - y)) nearest = &point;
        }
        // Below the foot's beginning: the last section, carried along the axis.
        const Vector3d shift = place.middle - axis.at(axis.height(nearest->centre.y())).middle;
        for (Eigen::Index k = 0; k < nearest->hull.rows(); ++k) {
          const Vector3d d = Vector3d(nearest->hull(k, 1), nearest->centre.y(), nearest->hull(k, 0)) + shift - place.middle;
          outline.emplace_back(d.dot(place.front), d.dot(place.left));
        }
        girth = nearest->girth;
      }
      sections.push_back(support_of(outline));
      trunk.push_back(upper);
      const double row = std::clamp(h, leg.hem, top);
      const double width = row_width(garment, flat, leg, row);
      const double around = perimeter(sections.back());
      if (h > leg.fork_top) {
        out[static_cast<std::size_t>(i)] = (width + (seams + 1) * kOpen + 2 * kGap - 0.5 * around) / std::numbers::pi;
      } else if (h <= leg.fork) {
        out[static_cast<std::size_t>(i)] = (width + (seams + 1) * kOpen - around) / (2 * std::numbers::pi);
      } else {
        out[static_cast<std::size_t>(i)] = std::nan("");
      }
      const bool compared = h > leg.fork_top ? h < top - 0.01 : h < leg.fork - 0.02 && h > leg.hem && y > limb.points.back().centre.y();
      const double needed = girth + (h > leg.fork_top ? 1 : 2) * std::numbers::pi * params.clearance;
      if (compared && needed / std::max(width, 1e-6) > std::max(1 + kNarrow, worst)) {
        worst = needed / std::max(width, 1e-6);
        narrow = {.code = "too_narrow", .place = {.item = "panels " + names_of(garment, leg)},
                  .what = fmt::format("sewn together they measure {:.0f} mm round, but {} at height {:.2f} m needs {:.0f} mm with the clearance", 1e3 * width,
                                      h > leg.fork_top ? "half the body" : "the leg", y, 1e3 * needed),
                  .remedy = "use a larger size of the pattern or a smaller support"};
      }
    }
    if (narrow) issues.push_back(*narrow);
    if (!issues.empty()) continue;
    // Between the trunk's rows and the leg's, from one to the other.
    int below = -1, above = rows;
    for (int i = 0; i < rows; ++i) {
      if (height(i) <= leg.fork) below = i;
      if (height(i) > leg.fork_top && above == rows) above = i;
    }
    for (int i = below + 1; i < above; ++i) {
      const double a = below >= 0 ? out[static_cast<std::size_t>(below)] : out[static_cast<std::size_t>(above)], b = above < rows ? out[static_cast<std::size_t>(above)] : a;
      out[static_cast<std::size_t>(i)] = a + (b - a) * (i - below) / (above - below);
    }
    std::vector<Support> wide;
    for (int i = 0; i < rows; ++i) {
      const auto r = static_cast<std::size_t>(i);
      Support support = sections[r];
      for (double& s : support) s += std::max(out[r], 0.5 * params.clearance);
      if (trunk[r]) support = support_of(clipped(corners(support), leg.side, leg.side * (frame.x_mid - places[r].middle.x()) + kGap));
      wide.push_back(support);
    }
    std::vector<Ring> rings;
    std::vector<double> start;  // of the first panel's a = 0
    std::vector<std::vector<double>> begin(leg.panels.size());
    double hem_low = 1e9, hem_high = -1e9;  // of the first panel's lowest row
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      if (garment.vertex_panel[v] != leg.panels.front().panel || flat[static_cast<std::size_t>(v)].y() > leg.hem + 0.03) continue;
      hem_low = std::min(hem_low, flat[static_cast<std::size_t>(v)].x());
      hem_high = std::max(hem_high, flat[static_cast<std::size_t>(v)].x());
    }
    // The line of the cloth that runs down the front of the leg: a quarter of the hem's girth from the inner seam.
    const double crease = (leg.side > 0 ? hem_low : hem_high) + leg.side * 0.25 * row_width(garment, flat, leg, leg.hem + 0.005);
    for (int i = 0; i < rows; ++i) {
      Support mean{};
      double total = 0;
      const int reach = static_cast<int>(kBlend / kRows);
      for (int d = -reach; d <= reach; ++d) {
        const double weight = reach + 1 - std::abs(d);
        const Support& other = wide[static_cast<std::size_t>(std::clamp(i + d, 0, rows - 1))];
        for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += weight * other[k];
        total += weight;
      }
      for (double& s : mean) s /= total;
      // Clear of the plane of symmetry.
      const auto r = static_cast<std::size_t>(i);
      const double inner = mean[leg.side > 0 ? 3 * kTangents / 4 : kTangents / 4];
      const double push = std::max(0.0, inner + kGap - leg.side * (places[r].middle.x() - frame.x_mid));
      for (int k = 0; k < kTangents; ++k) mean[static_cast<std::size_t>(k)] += push * leg.side * std::sin(angle_of(k));
      rings.emplace_back(mean);
      const double corner = rings.back().outermost(-leg.side * kCorner);
      const double w = smoothstep((height(i) - leg.fork) / (leg.fork_top - leg.fork));
      start.push_back(w * (corner + leg.side * 0.5 * kOpen + crease - leg.front) - crease);
    }
    for (std::size_t p = 0; p < leg.panels.size(); ++p) {
      const TrouserPanel& panel = leg.panels[p];
      for (int i = 0; i < rows; ++i) {
        const auto r = static_cast<std::size_t>(i);
        if (panel.beside < 0) {
          begin[p].push_back(start[r]);
        } else {
          begin[p].push_back(begin[static_cast<std::size_t>(panel.beside)][r] + along(panel.theirs, height(i)) + panel.way * kOpen - along(panel.own, height(i)));
        }
      }
    }
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      const std::size_t p = index[static_cast<std::size_t>(garment.vertex_panel[v])];
      if (p == leg.panels.size()) continue;
      const Vector2d& at = flat[static_cast<std::size_t>(v)];
      const double place = std::clamp((at.y() - low) / kRows, 0.0, static_cast<double>(rows - 1) - 1e-9);
      const auto r = static_cast<std::size_t>(place);
      const double t = place - static_cast<double>(r), away = 0.004 * sheet[static_cast<std::size_t>(v)];
      const auto point = [&](std::size_t row) -> Vector3d {
        const Vector2d q = rings[row].point(begin[p][row] + at.x(), away);
        return places[row].middle + q.x() * places[row].front + q.y() * places[row].left;
      };
      result.emplace_back(static_cast<int>(v), (1 - t) * point(r) + t * point(std::min(r + 1, rings.size() - 1)));
    }
  }
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::placement
