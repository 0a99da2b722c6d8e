#include "toile/placement/layout.h"

#include "toile/base/text.h"
#include "toile/contact/support_field.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace toile::placement {

namespace {

using Eigen::Vector2d;

constexpr double kOpen = 0.006;  // seams of neighbours start so far apart at least [m]
constexpr double kNear = 0.05;  // a point to go to is so far from the support at most [m]
constexpr double kBand = 3;  // a panel longer than this times its width is a band: its seams say how it is turned

// Welds of one seam between two panels; or the fasteners between them (seam -1), which say how far round panels go that no
// seam closes.
struct Join {
  int seam = 0, a = 0, b = 0;          // a <= b: panel ids
  std::vector<std::pair<int, int>> pairs;  // vertices of a and b
  std::vector<int> rows;               // of welds
  bool sewn() const { return seam >= 0; }
};

std::vector<Join> find_joins(const mesh::GarmentMesh& garment) {
  std::map<std::array<int, 3>, Join> joins;
  for (std::size_t w = 0; w < garment.welds.size(); ++w) {
    int va = garment.welds[w].a, vb = garment.welds[w].b;
    int a = garment.vertex_panel[va], b = garment.vertex_panel[vb];
    if (a > b) {
      std::swap(a, b);
      std::swap(va, vb);
    }
    Join& join = joins[{garment.welds[w].seam, a, b}];
    join.seam = garment.welds[w].seam;
    join.a = a;
    join.b = b;
    join.pairs.emplace_back(va, vb);
    join.rows.push_back(static_cast<int>(w));
  }
  for (const mesh::Fastener& fastener : garment.fasteners) {
    int va = fastener.a, vb = fastener.b;
    if (!fastener.closed) continue;
    if (garment.vertex_panel[va] > garment.vertex_panel[vb]) std::swap(va, vb);
    Join& join = joins[{-1, garment.vertex_panel[va], garment.vertex_panel[vb]}];
    join.seam = -1;
    join.a = garment.vertex_panel[va];
    join.b = garment.vertex_panel[vb];
    join.pairs.emplace_back(va, vb);
  }
  std::vector<Join> result;
  for (auto& [key, join] : joins) result.push_back(std::move(join));
  return result;
}

Vector2d uv_of(const FoldedFlat& flat, int vertex) { return flat.uv.row(vertex).transpose(); }

// Rotation that brings the b side of a join onto the laid out a side, in quarter turns, and how well it fits.
double fitting_turn(const FoldedFlat& flat, const Join& join, const PanelLayout& a, bool a_is_first) {
  Vector2d mean_p = Vector2d::Zero(), mean_q = Vector2d::Zero();
  for (const auto& [va, vb] : join.pairs) {
    mean_p += a(uv_of(flat, a_is_first ? va : vb));
    mean_q += uv_of(flat, a_is_first ? vb : va);
  }
  mean_p /= static_cast<double>(join.pairs.size());
  mean_q /= static_cast<double>(join.pairs.size());
  double cross = 0, dot = 0;
  for (const auto& [va, vb] : join.pairs) {
    const Vector2d p = a(uv_of(flat, a_is_first ? va : vb)) - mean_p, q = uv_of(flat, a_is_first ? vb : va) - mean_q;
    cross += q.x() * p.y() - q.y() * p.x();
    dot += q.dot(p);
  }
  return std::atan2(cross, dot);
}

struct Extent {
  Vector2d low, high;
  Vector2d size() const { return high - low; }
  Vector2d centre() const { return 0.5 * (low + high); }
};

Extent extent_of(const mesh::GarmentMesh& garment, const FoldedFlat& flat, int panel, const PanelLayout& layout) {
  Extent e{Vector2d::Constant(1e9), Vector2d::Constant(-1e9)};
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    if (garment.vertex_panel[v] != panel) continue;
    const Vector2d p = layout(uv_of(flat, static_cast<int>(v)));
    e.low = e.low.cwiseMin(p);
    e.high = e.high.cwiseMax(p);
  }
  return e;
}

bool on_arm(Region region) { return region == Region::arm || region == Region::arm_left || region == Region::arm_right; }
bool on_leg(Region region) { return region == Region::leg || region == Region::leg_left || region == Region::leg_right; }
bool on_trunk(Region region) { return !on_arm(region) && !on_leg(region) && region != Region::attached; }

// A first idea from the name of the panel or of its piece.
Region region_from_name(const std::string& name) {
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  if (has("collar") || has("hood") || has("neckband") || has("stand")) return Region::attached;
  if (has("sleeve") || has("cuff")) return Region::arm;
  if (has("leg") || has("trouser")) return Region::leg;
  if (has("waistband") || has("band") || has("belt")) return Region::waist;
  if (has("front")) return Region::torso_front;
  if (has("back")) return Region::torso_back;
  if (has("side") || has("bodice") || has("skirt") || has("yoke")) return Region::torso;
  return Region::automatic;
}

// Which part of the way round the trunk (from the front to the left) lies before a point: by the tape of the section at its height.
double place_round(const BodyFrame& frame, const Eigen::Vector3d& p) {
  const Points2& hull = frame.section(p.y()).hull;
  const Vector2d middle(0.5 * (hull.col(0).minCoeff() + hull.col(0).maxCoeff()), frame.x_mid);
  const auto angle_of = [&](const Vector2d& q) { return std::atan2(q.y() - middle.y(), q.x() - middle.x()); };
  const double wanted = angle_of({p.z(), p.x()});
  // walk round from the front, counter-clockwise
  const Eigen::Index n = hull.rows();
  double total = 0, before = 0, front = 0;
  bool has_before = false, has_front = false;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d a = hull.row(i), b = hull.row((i + 1) % n);
    const double length = (b - a).norm();
    const auto crossing = [&](double angle, bool& has, double& where) {
      const Vector2d out(std::cos(angle), std::sin(angle)), left(-out.y(), out.x());
      const double sa = left.dot(a - middle), sb = left.dot(b - middle);
      if (has || sa > 0 || sb <= 0 || out.dot(b - middle) <= 0) return;
      has = true;
      where = total + length * sa / (sa - sb);
    };
    crossing(0, has_front, front);
    crossing(wanted, has_before, before);
    total += length;
  }
  const double part = (before - front) / total;
  return part - std::floor(part);
}

}  // namespace

Vector2d PanelLayout::operator()(const Vector2d& uv) const {
  const double c = std::cos(turn), s = std::sin(turn);
  return Vector2d(c * uv.x() - s * uv.y(), s * uv.x() + c * uv.y()) + shift;
}

PlaceParams with_named_legs(const mesh::GarmentMesh& garment, PlaceParams params) {
  for (const mesh::Panel& panel : garment.panels) {
    const auto known = params.panels.find(panel.name);
    Region region = known == params.panels.end() ? Region::automatic : known->second.region;
    if (region == Region::automatic) region = region_from_name(panel.name);
    if (region == Region::automatic) region = region_from_name(panel.piece);
    if (region != Region::leg) continue;
    if (panel.name.find("left") != std::string::npos) params.panels[panel.name].region = Region::leg_left;
    else if (panel.name.find("right") != std::string::npos) params.panels[panel.name].region = Region::leg_right;
  }
  return params;
}

Result<Layout> make_layout(const mesh::GarmentMesh& garment, const FoldedFlat& flat, const mesh::SupportMesh& support, const BodyFrame& frame, const PlaceParams& params) {
  Issues issues;
  const int count = static_cast<int>(garment.panels.size());
  const auto panel_name = [&](int p) { return "panel " + garment.panels[static_cast<std::size_t>(p)].name; };
  std::vector<std::string> names;
  for (const auto& panel : garment.panels) names.push_back(panel.name);
  std::vector<const PanelSpec*> specs(static_cast<std::size_t>(count), nullptr);
  for (const auto& [name, spec] : params.panels) {
    const auto it = std::find(names.begin(), names.end(), name);
    if (it == names.end()) {
      issues.push_back({.code = "unknown_panel", .place = {.item = "panels." + name}, .what = "the garment has no panel of this name",
                        .remedy = suggestion(name, names)});
    } else {
      specs[static_cast<std::size_t>(it - names.begin())] = &spec;
    }
  }
  const std::vector<Join> joins = find_joins(garment);

  Layout layout;
  layout.panels.resize(static_cast<std::size_t>(count));
  for (int p = 0; p < count; ++p) {
    PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
    if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) panel.region = spec->region;
    if (panel.region == Region::automatic) panel.region = region_from_name(garment.panels[static_cast<std::size_t>(p)].name);
    if (panel.region == Region::automatic) panel.region = region_from_name(garment.panels[static_cast<std::size_t>(p)].piece);
    if (panel.region == Region::automatic && count == 1) panel.region = Region::torso;
    if (panel.region == Region::automatic) {
      issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "its name does not say which part of the body it goes on",
                        .remedy = "give panels." + names[static_cast<std::size_t>(p)] + ".region (torso_front, torso_back, torso, waist, arm, leg, ...)"});
    }
  }
  if (!issues.empty()) return issues;

  // One strip of panels a part: breadth first over the seams, longest first.
  const auto lay_out = [&](std::vector<int> members, int root, double& girth) {
    std::set<int> laid{root};
    const auto member = [&](int p) { return std::find(members.begin(), members.end(), p) != members.end(); };
    const auto place_spec_turn = [&](int p) {
      if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) layout.panels[static_cast<std::size_t>(p)].turn = spec->turn;
    };
    place_spec_turn(root);
    bool grew = true;
    while (grew) {
      grew = false;
      const Join* best = nullptr;
      bool best_a_first = true;
      double best_turn = 0;
      for (const Join& join : joins) {
        if (!join.sewn() || join.a == join.b || !member(join.a) || !member(join.b) || laid.count(join.a) == laid.count(join.b) || join.pairs.size() < 2) continue;
        const bool a_first = laid.count(join.a) > 0;
        const int fresh = a_first ? join.b : join.a;
        const PanelLayout& known = layout.panels[static_cast<std::size_t>(a_first ? join.a : join.b)];
        const PanelSpec* spec = specs[static_cast<std::size_t>(fresh)];
        PanelLayout upright;
        upright.turn = spec ? spec->turn : 0;
        const Vector2d size = extent_of(garment, flat, fresh, upright).size();
        const bool band = layout.panels[static_cast<std::size_t>(fresh)].region == Region::waist || std::max(size.x(), size.y()) > kBand * std::min(size.x(), size.y());
        const double turn = fitting_turn(flat, join, known, a_first) - upright.turn;
        int quarters = static_cast<int>(std::lround(turn / (std::numbers::pi / 2)));
        quarters = ((quarters % 4) + 4) % 4;
        // A seam that would turn a piece over (a shoulder, a fold) does not say where it lies on the tube.
        if (quarters == 2 && !band) continue;
        if (quarters != 0 && !band) continue;
        if (!best || join.pairs.size() > best->pairs.size()) {
          best = &join;
          best_a_first = a_first;
          best_turn = upright.turn + quarters * (std::numbers::pi / 2);
        }
      }
      if (!best) break;
      const int fresh = best_a_first ? best->b : best->a;
      const PanelLayout& known = layout.panels[static_cast<std::size_t>(best_a_first ? best->a : best->b)];
      PanelLayout& panel = layout.panels[static_cast<std::size_t>(fresh)];
      panel.turn = best_turn;
      panel.shift.setZero();
      Vector2d sum = Vector2d::Zero();
      for (const auto& [va, vb] : best->pairs) {
        sum += known(uv_of(flat, best_a_first ? va : vb)) - panel(uv_of(flat, best_a_first ? vb : va));
      }
      panel.shift = sum / static_cast<double>(best->pairs.size());
      // Side by side (or one above the other) without overlap, whatever the curves of the seam.
      const Vector2d way = extent_of(garment, flat, fresh, panel).centre() - extent_of(garment, flat, best_a_first ? best->a : best->b, known).centre();
      const int axis = std::abs(way.x()) > std::abs(way.y()) ? 0 : 1;
      const double sense = way[axis] > 0 ? 1 : -1;
      double push = 0;
      for (const auto& [va, vb] : best->pairs) {
        push = std::max(push, sense * (known(uv_of(flat, best_a_first ? va : vb)) - panel(uv_of(flat, best_a_first ? vb : va)))[axis]);
      }
      panel.shift[axis] += sense * (push + kOpen);
      laid.insert(fresh);
      grew = true;
    }
    // Seams between laid out panels that do not meet: they close the tube, and say how far round it is.
    double low = 1e9, high = -1e9;
    for (int p : laid) {
      const Extent e = extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]);
      low = std::min(low, e.low.x());
      high = std::max(high, e.high.x());
    }
    girth = 0;
    for (const Join& join : joins) {
      if (!laid.count(join.a) || !laid.count(join.b)) continue;
      double mismatch = 0;
      for (const auto& [va, vb] : join.pairs) {
        mismatch = std::max(mismatch, std::abs((layout.panels[static_cast<std::size_t>(join.a)](uv_of(flat, va)) -
                                                layout.panels[static_cast<std::size_t>(join.b)](uv_of(flat, vb))).x()));
      }
      if (join.a != join.b && join.sewn()) {
        const double turn = fitting_turn(flat, join, layout.panels[static_cast<std::size_t>(join.a)], true) - layout.panels[static_cast<std::size_t>(join.b)].turn;
        if (std::cos(turn) < 0.7) continue;
      }
      if (mismatch > 0.5 * (high - low)) girth = std::max(girth, mismatch + (join.sewn() ? kOpen : 0));
    }
    return laid;
  };

  for (PanelLayout& panel : layout.panels) {
    if (panel.region == Region::attached) panel.part = Part::attached;
  }

  // The trunk.
  std::vector<int> trunk;
  for (int p = 0; p < count; ++p) {
    if (on_trunk(layout.panels[static_cast<std::size_t>(p)].region)) trunk.push_back(p);
  }
  const auto shift_group = [&](const std::set<int>& group, const Vector2d& by) {
    for (int p : group) layout.panels[static_cast<std::size_t>(p)].shift += by;
  };
  if (!trunk.empty()) {
    const auto rank = [&](int p) {
      switch (layout.panels[static_cast<std::size_t>(p)].region) {
        case Region::torso_front: return 0;
        case Region::torso_back: return 1;
        case Region::torso_left: return 2;
        case Region::torso_right: return 3;
        case Region::torso: return 4;
        default: return 5;
      }
    };
    // Long bands stand upright in many patterns; alone, they are turned to lie round the body.
    std::vector<int> rest = trunk;
    std::vector<std::set<int>> groups;
    while (!rest.empty()) {
      const int root = *std::min_element(rest.begin(), rest.end(), [&](int a, int b) { return std::pair(rank(a), a) < std::pair(rank(b), b); });
      double girth = 0;
      PanelLayout& first = layout.panels[static_cast<std::size_t>(root)];
      const Vector2d size = extent_of(garment, flat, root, PanelLayout{}).size();
      auto group = lay_out(rest, root, girth);
      if (first.region == Region::waist && group.size() == 1 && size.y() > size.x() && !specs[static_cast<std::size_t>(root)]) {
        first.turn = std::numbers::pi / 2;
      }
      layout.girth_trunk = std::max(layout.girth_trunk, girth);
      groups.push_back(group);
      std::erase_if(rest, [&](int p) { return group.count(p) > 0; });
    }
    // Round the body: the middle of the front (or of the back) panels of each group goes to the centre front (back).
    double girth = layout.girth_trunk;
    if (girth <= 0) {
      for (const auto& group : groups) {
        for (int p : group) girth = std::max(girth, 2 * extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]).size().x());
      }
    }
    for (const auto& group : groups) {
      double best_rank = 9, low = 1e9, high = -1e9;
      for (int p : group) best_rank = std::min<double>(best_rank, rank(p));
      // The panels of that rank may stand at both ends of the strip (fronts that open): their mean is one on a circle.
      Vector2d sum = Vector2d::Zero();
      for (int p : group) {
        const Extent e = extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]);
        if (rank(p) != best_rank) continue;
        low = std::min(low, e.low.x());
        high = std::max(high, e.high.x());
        const double angle = 2 * std::numbers::pi * e.centre().x() / girth;
        sum += Vector2d(std::cos(angle), std::sin(angle));
      }
      double middle = 0.5 * (low + high);
      if (high - low > 0.75 * girth) middle = std::atan2(sum.y(), sum.x()) * girth / (2 * std::numbers::pi);
      const std::array<double, 6> at{0, 0.5, 0.25, 0.75, 0, 0};
      shift_group(group, {at[static_cast<std::size_t>(best_rank)] * girth - middle, 0});
    }
    // Shoulders: seams between laid out panels of the trunk that turn over.
    for (const Join& join : joins) {
      const PanelLayout &a = layout.panels[static_cast<std::size_t>(join.a)], &b = layout.panels[static_cast<std::size_t>(join.b)];
      if (!join.sewn() || join.a == join.b || !on_trunk(a.region) || !on_trunk(b.region) || join.pairs.size() < 2) continue;
      const double turn = fitting_turn(flat, join, a, true) - b.turn;
      if (std::cos(turn) < -0.2) layout.shoulder_welds.insert(layout.shoulder_welds.end(), join.rows.begin(), join.rows.end());
    }
    // Heights.
    const std::map<std::string, double> levels{{"neck", frame.neck},   {"armpit", frame.armpit}, {"chest", frame.chest.value_or(frame.armpit)},
                                               {"waist", frame.waist}, {"hips", frame.hips},     {"crotch", frame.crotch}};
    const contact::SupportField body(contact::make_surface(static_cast<int>(support.x.rows()), support.faces), support.x);
    for (const auto& group : groups) {
      std::optional<double> lift;
      for (int p : group) {
        const PanelSpec* spec = specs[static_cast<std::size_t>(p)];
        if (!spec || !spec->point) continue;
        const PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
        Vector2d own = Vector2d::Zero();
        bool known = false;
        for (const auto& point : garment.points) {
          if (point.panel == p && point.name == *spec->point) {
            own = panel(uv_of(flat, point.vertex));
            known = true;
          }
        }
        if (!known) {
          for (const auto& run : garment.runs) {
            if (run.panel != p || run.name != *spec->point) continue;
            const auto ids = mesh::run_vertex_ids(garment, run.id);
            for (int v : ids) own += panel(uv_of(flat, v)) / static_cast<double>(ids.size());
            known = !ids.empty();
          }
        }
        if (!known) {
          std::vector<std::string> candidates;
          for (const auto& point : garment.points) if (point.panel == p) candidates.push_back(point.name);
          for (const auto& run : garment.runs) if (run.panel == p) candidates.push_back(run.name);
          issues.push_back({.code = "unknown_anchor", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".point"},
                            .what = "the panel has no point or edge '" + *spec->point + "'", .remedy = suggestion(*spec->point, candidates)});
          continue;
        }
        if (!spec->to.empty()) {
          const Eigen::Vector3d to(spec->to[0], spec->to[1], spec->to[2]);
          const double distance = std::abs(body.nearest(to).distance);
          if (distance > kNear) {
            issues.push_back({.code = "off_support", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".to"},
                              .what = fmt::format("the point ({:.3f}, {:.3f}, {:.3f}) m is {:.0f} mm from the support's surface", to.x(), to.y(), to.z(), 1e3 * distance),
                              .remedy = "give a point on it, in metres; toile-info lists the support's size and landmarks"});
            continue;
          }
          lift = to.y() - own.y();
          double round = place_round(frame, to) * girth - own.x();
          round -= girth * std::round(round / girth);
          shift_group(group, {round, 0});
          continue;
        }
        const std::string at = spec->at.value_or("waist");
        std::optional<double> target;
        if (const auto level = levels.find(at); level != levels.end()) target = level->second;
        if (const auto mark = frame.landmarks.find(at); mark != frame.landmarks.end()) target = mark->second.y();
        if (!target) {
          std::vector<std::string> candidates;
          for (const auto& [name, y] : levels) candidates.push_back(name);
          for (const auto& [name, y] : frame.landmarks) candidates.push_back(name);
          issues.push_back({.code = "unknown_anchor", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".at"},
                            .what = "the support has no landmark or level '" + at + "'", .remedy = suggestion(at, candidates)});
          continue;
        }
        lift = *target - own.y();
      }
      if (!lift) {
        // The shoulder seams rest on the shoulders: on the outline of the body seen from the front.
        double sum = 0;
        int n = 0;
        for (int row : layout.shoulder_welds) {
          for (const int v : {garment.welds[static_cast<std::size_t>(row)].a, garment.welds[static_cast<std::size_t>(row)].b}) {
            const int p = garment.vertex_panel[v];
            if (!group.count(p)) continue;
            Vector2d at = layout.panels[static_cast<std::size_t>(p)](uv_of(flat, v));
            if (layout.panels[static_cast<std::size_t>(p)].region == Region::torso_back) at.x() -= 0.5 * girth;
            at.x() -= girth * std::round(at.x() / girth);
            if (const auto top = outline_top(support, frame.x_mid + at.x())) {
              sum += std::min(*top, frame.neck) + params.offset - at.y();
              ++n;
            }
          }
        }
        if (n > 0) lift = sum / n;
      }
      if (!lift) {
        // Hung from the waist: a waistband's middle, or else the top edge.
        double top = -1e9, band_low = 1e9, band_high = -1e9;
        for (int p : group) {
          const Extent e = extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]);
          top = std::max(top, e.high.y());
          if (layout.panels[static_cast<std::size_t>(p)].region == Region::waist) {
            band_low = std::min(band_low, e.low.y());
            band_high = std::max(band_high, e.high.y());
          }
        }
        lift = frame.waist - (band_low < band_high ? 0.5 * (band_low + band_high) : top);
      }
      shift_group(group, {0, *lift});
    }
    for (int p : trunk) {
      if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) layout.panels[static_cast<std::size_t>(p)].shift += Vector2d(spec->shift[0], spec->shift[1]);
    }
  }

  // Arms: which one, from the side of the trunk that the seams go to (directly or over another arm panel).
  {
    std::vector<double> side(static_cast<std::size_t>(count), 0);
    const double girth = layout.girth_trunk > 0 ? layout.girth_trunk : 1.0;
    for (int round = 0; round < count; ++round) {
      bool changed = false;
      std::vector<double> next = side;
      for (const Join& join : joins) {
        for (const auto& [self, other, second] : {std::tuple(join.a, join.b, true), std::tuple(join.b, join.a, false)}) {
          const PanelLayout &mine = layout.panels[static_cast<std::size_t>(self)], &theirs = layout.panels[static_cast<std::size_t>(other)];
          if (!join.sewn() || self == other || !on_arm(mine.region) || theirs.region == Region::attached || on_leg(theirs.region) || side[static_cast<std::size_t>(self)] != 0) continue;
          if (on_arm(theirs.region)) {
            if (side[static_cast<std::size_t>(other)] == 0) continue;
            next[static_cast<std::size_t>(self)] += (side[static_cast<std::size_t>(other)] > 0 ? 1e-3 : -1e-3);
            changed = true;
            continue;
          }
          for (const auto& [va, vb] : join.pairs) {
            double a = theirs(uv_of(flat, second ? vb : va)).x() / girth;
            a -= std::floor(a);
            next[static_cast<std::size_t>(self)] += a < 0.5 ? 1 : -1;
            changed = true;
          }
        }
      }
      side = next;
      if (!changed) break;
    }
    for (int p = 0; p < count; ++p) {
      PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      if (!on_arm(panel.region)) continue;
      if (panel.region == Region::arm) {
        if (side[static_cast<std::size_t>(p)] == 0) {
          issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "no seam to a panel of the trunk says which arm it goes on",
                            .remedy = "sew it, or give panels." + names[static_cast<std::size_t>(p)] + ".region: arm_left or arm_right"});
          continue;
        }
        panel.region = side[static_cast<std::size_t>(p)] > 0 ? Region::arm_left : Region::arm_right;
      }
      panel.part = panel.region == Region::arm_left ? Part::arm_left : Part::arm_right;
      const bool there = panel.part == Part::arm_left ? frame.arm_left.has_value() : frame.arm_right.has_value();
      if (!there) {
        issues.push_back({.code = "no_arm", .place = {.item = panel_name(p)},
                          .what = std::string("the support has no ") + (panel.part == Part::arm_left ? "left" : "right") + " arm to put it on",
                          .remedy = "give a support with arms held away from the trunk, or leave the panel out"});
      }
    }
  }
  // Legs: which one, from the name, the side of the trunk, or the panels of a leg that it is sewn to.
  {
    std::vector<double> side(static_cast<std::size_t>(count), 0);
    const double girth = layout.girth_trunk > 0 ? layout.girth_trunk : 1.0;
    for (int p = 0; p < count; ++p) {
      const Region region = layout.panels[static_cast<std::size_t>(p)].region;
      if (region == Region::leg_left) side[static_cast<std::size_t>(p)] = 1;
      if (region == Region::leg_right) side[static_cast<std::size_t>(p)] = -1;
    }
    for (int round = 0; round < count; ++round) {
      std::vector<double> next = side;
      for (const Join& join : joins) {
        for (const auto& [self, other, second] : {std::tuple(join.a, join.b, true), std::tuple(join.b, join.a, false)}) {
          const PanelLayout& theirs = layout.panels[static_cast<std::size_t>(other)];
          if (!join.sewn() || self == other || !on_leg(layout.panels[static_cast<std::size_t>(self)].region) || side[static_cast<std::size_t>(self)] != 0) continue;
          if (!on_leg(theirs.region) && !on_trunk(theirs.region)) continue;
          for (const auto& [va, vb] : join.pairs) {
            if (on_leg(theirs.region)) {
              next[static_cast<std::size_t>(self)] += side[static_cast<std::size_t>(other)] == 0 ? 0 : std::copysign(1.0, side[static_cast<std::size_t>(other)]);
            } else {
              double a = theirs(uv_of(flat, second ? vb : va)).x() / girth;
              a -= std::floor(a);
              next[static_cast<std::size_t>(self)] += a < 0.5 ? 1 : -1;
            }
          }
        }
      }
      if (next == side) break;
      side = next;
    }
    for (int p = 0; p < count; ++p) {
      PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      if (!on_leg(panel.region)) continue;
      if (!frame.leg_left) {
        issues.push_back({.code = "no_legs", .place = {.item = panel_name(p)}, .what = "the support has no legs to put it on",
                          .remedy = "give a body with legs apart below the crotch (a dress form ends under the seat), or leave the panel out"});
        continue;
      }
      if (side[static_cast<std::size_t>(p)] == 0) {
        issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "neither its name nor its seams say which leg it goes on",
                          .remedy = "give panels." + names[static_cast<std::size_t>(p)] + ".region: leg_left or leg_right"});
        continue;
      }
      panel.region = side[static_cast<std::size_t>(p)] > 0 ? Region::leg_left : Region::leg_right;
      panel.part = panel.region == Region::leg_left ? Part::leg_left : Part::leg_right;
    }
  }
  if (!issues.empty()) return issues;
  for (const Part part : {Part::arm_left, Part::arm_right, Part::leg_left, Part::leg_right}) {
    std::vector<int> members;
    for (int p = 0; p < count; ++p) {
      const PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      if (panel.part == part) members.push_back(p);
    }
    double& girth = part == Part::arm_left ? layout.girth_arm_left : part == Part::arm_right ? layout.girth_arm_right : part == Part::leg_left ? layout.girth_leg_left : layout.girth_leg_right;
    std::vector<int> rest = members;
    while (!rest.empty()) {
      // the widest panel first
      const int root = *std::max_element(rest.begin(), rest.end(), [&](int a, int b) {
        const double x = extent_of(garment, flat, a, PanelLayout{}).size().x(), y = extent_of(garment, flat, b, PanelLayout{}).size().x();
        return x != y ? x < y : a > b;
      });
      double g = 0;
      const auto group = lay_out(rest, root, g);
      girth = std::max(girth, g);
      std::erase_if(rest, [&](int p) { return group.count(p) > 0; });
      if (part != Part::leg_left && part != Part::leg_right) continue;
      // Round the leg: the panel that is called front (back) to the front (back); without one, the middle of the strip to the outside.
      double low = 1e9, high = -1e9;
      std::optional<double> front;
      const double round = g > 0 ? g : 1.0;
      for (int p : group) {
        const Extent e = extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]);
        low = std::min(low, e.low.x());
        high = std::max(high, e.high.x());
        if (names[static_cast<std::size_t>(p)].find("front") != std::string::npos) front = e.centre().x();
        else if (!front && names[static_cast<std::size_t>(p)].find("back") != std::string::npos) front = e.centre().x() - 0.5 * round;
      }
      const double outside = part == Part::leg_left ? 0.25 : -0.25;
      shift_group(group, {front ? -*front : outside * round - 0.5 * (low + high), 0});
    }
    for (int p : members) {
      if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) layout.panels[static_cast<std::size_t>(p)].shift += Vector2d(spec->shift[0], spec->shift[1]);
    }
  }
  return layout;
}

}  // namespace toile::placement
