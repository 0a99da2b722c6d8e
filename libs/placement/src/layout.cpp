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
constexpr double kForkZone = 0.4;  // the part of the rise, from its lowest point, over which it turns in between the legs
constexpr double kSheetUnder = 0.014;  // a hanging tube begins so far below the trunk's panels [m]
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

bool lower_case(const std::string& text, std::size_t at) { return at < text.size() && text[at] >= 'a' && text[at] <= 'z'; }

// Whether a name has the word leg, legs or legging in it (not elegant, not legacy).
bool says_leg(const std::string& name) {
  for (std::size_t at = name.find("leg"); at != std::string::npos; at = name.find("leg", at + 1)) {
    if (at > 0 && lower_case(name, at - 1) && name.compare(at - std::min<std::size_t>(at, 4), std::min<std::size_t>(at, 4), "pant") != 0) continue;
    const std::size_t end = at + 3;
    if (!lower_case(name, end) || name.compare(end, 4, "ging") == 0 || (name[end] == 's' && !lower_case(name, end + 1))) return true;
  }
  return name.find("Leg") != std::string::npos;
}

// A first idea from the name of the panel or of its piece.
Region region_from_name(const std::string& name) {
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  if (!has("sleeve") && (says_leg(name) || has("trouser") || has("pants") || has("jeans"))) {
    // Trousers have panels that go round no leg.
    if (has("pocket") || has("fly") || has("gusset") || has("loop")) return Region::automatic;
    if (has("band") || has("belt")) return Region::waist;
    if (has("yoke")) return Region::torso;
    if (has("facing")) return Region::automatic;
    return Region::leg;
  }
  if (has("hood")) return Region::automatic;  // heads are no part that panels go on
  if (has("collar") || has("neckband") || has("stand")) return Region::attached;
  if (has("sleeve") || has("cuff")) return Region::arm;
  if (has("waistband") || has("band") || has("belt")) return Region::waist;
  if (has("front")) return Region::torso_front;
  if (has("back")) return Region::torso_back;
  if (has("side") || has("bodice") || has("skirt") || has("yoke")) return Region::torso;
  return Region::automatic;
}

bool says(const mesh::Panel& panel, const char* word) { return panel.name.find(word) != std::string::npos || panel.piece.find(word) != std::string::npos; }

// Legs of trousers: which panels they are, on which side, and how they are joined.
struct Rise {
  std::vector<int> side;               // by panel: +1 left, -1 right, 0: none of trousers
  std::vector<std::array<double, 2>> bounds;  // by panel: u of its outermost vertices as it is turned
  std::vector<double> turn;            // by panel
  std::vector<std::array<std::vector<int>, 2>> edge;  // by panel: its vertices in the rise, towards lower and higher u
  std::array<int, 2> front{-1, -1};    // by leg (left, right): the panel that holds the front seam
  bool of(int panel) const { return side[static_cast<std::size_t>(panel)] != 0; }
  static int leg(int side) { return side > 0 ? 0 : 1; }
  bool has_edge(int panel, std::size_t way) const { return !edge[static_cast<std::size_t>(panel)][way].empty(); }
  double u(const FoldedFlat& flat, int panel, int vertex) const {
    PanelLayout upright;
    upright.turn = turn[static_cast<std::size_t>(panel)];
    return upright(uv_of(flat, vertex)).x();
  }
  // Seams of one leg beside its rise: the inseam.
  std::vector<const Join*> inseams;
  bool inner(const Join& join) const { return std::find(inseams.begin(), inseams.end(), &join) != inseams.end(); }
  // a of front and back seam of a leg, over the upper parts of these.
  std::pair<double, double> top(int k, const std::vector<PanelLayout>& panels, const FoldedFlat& flat) const;
};

std::pair<double, double> Rise::top(int k, const std::vector<PanelLayout>& panels, const FoldedFlat& flat) const {
  std::array<double, 2> mean{0, 0};
  for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {  // front, back
    const std::size_t way = (k == 0) == (end == 0) ? 0 : 1;
    std::vector<Vector2d> points;
    for (std::size_t p = 0; p < side.size(); ++p) {
      if (side[p] == 0 || leg(side[p]) != k) continue;
      for (int v : edge[p][way]) points.push_back(panels[p](uv_of(flat, v)));
    }
    double low = 1e9, high = -1e9, count = 0;
    for (const Vector2d& p : points) low = std::min(low, p.y()), high = std::max(high, p.y());
    for (const Vector2d& p : points) {
      if (p.y() < high - 0.4 * (high - low)) continue;
      mean[end] += p.x();
      count += 1;
    }
    if (count > 0) mean[end] /= count;
  }
  return {mean[0], mean[1]};
}

Rise find_rise(const mesh::GarmentMesh& garment, const FoldedFlat& flat, const std::vector<Join>& joins, const std::vector<const PanelSpec*>& specs, const std::vector<PanelLayout>& panels) {
  const std::size_t count = panels.size();
  Rise rise;
  rise.side.assign(count, 0);
  rise.bounds.assign(count, {1e9, -1e9});
  rise.turn.assign(count, 0);
  rise.edge.resize(count);
  for (std::size_t p = 0; p < count; ++p) {
    if (specs[p]) rise.turn[p] = specs[p]->turn;
  }
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    const int p = garment.vertex_panel[v];
    const double u = rise.u(flat, p, static_cast<int>(v));
    auto& [low, high] = rise.bounds[static_cast<std::size_t>(p)];
    low = std::min(low, u);
    high = std::max(high, u);
  }
  const auto centre = [&](int p) { return 0.5 * (rise.bounds[static_cast<std::size_t>(p)][0] + rise.bounds[static_cast<std::size_t>(p)][1]); };
  const auto mean_u = [&](const Join& join, bool first) {
    double sum = 0;
    for (const auto& [va, vb] : join.pairs) sum += rise.u(flat, first ? join.a : join.b, first ? va : vb);
    return sum / static_cast<double>(join.pairs.size());
  };
  // Sides: as given, or from the rise's place on a front or back; then along the seams of the leg.
  std::vector<int> side(count, 0);
  for (std::size_t p = 0; p < count; ++p) side[p] = panels[p].region == Region::leg_left ? 1 : panels[p].region == Region::leg_right ? -1 : 0;
  const auto legs = [&](const Join& join) {
    return join.sewn() && join.a != join.b && on_leg(panels[static_cast<std::size_t>(join.a)].region) && on_leg(panels[static_cast<std::size_t>(join.b)].region);
  };
  const auto alike = [&](const Join& join) {
    const mesh::Panel &a = garment.panels[static_cast<std::size_t>(join.a)], &b = garment.panels[static_cast<std::size_t>(join.b)];
    return (says(a, "front") && says(b, "front")) || (says(a, "back") && says(b, "back"));
  };
  for (const Join& join : joins) {
    if (!legs(join) || !alike(join)) continue;
    for (const bool first : {true, false}) {
      const int p = first ? join.a : join.b;
      if (side[static_cast<std::size_t>(p)] != 0) continue;
      const bool low = mean_u(join, first) < centre(p);
      side[static_cast<std::size_t>(p)] = low == says(garment.panels[static_cast<std::size_t>(p)], "front") ? 1 : -1;
    }
  }
  const auto over = [&](const Join& join) {
    const int a = side[static_cast<std::size_t>(join.a)], b = side[static_cast<std::size_t>(join.b)];
    return a * b < 0 || (a * b == 0 && alike(join));
  };
  for (std::size_t round = 0; round < count; ++round) {
    for (const Join& join : joins) {
      if (!legs(join) || over(join)) continue;
      int &a = side[static_cast<std::size_t>(join.a)], &b = side[static_cast<std::size_t>(join.b)];
      if (a == 0) a = b;
      if (b == 0) b = a;
    }
  }
  std::vector<char> sewn(count, 0);
  for (const Join& join : joins) {
    if (!legs(join) || !over(join) || side[static_cast<std::size_t>(join.a)] * side[static_cast<std::size_t>(join.b)] >= 0) continue;
    for (const bool first : {true, false}) {
      const int p = first ? join.a : join.b;
      sewn[static_cast<std::size_t>(p)] = 1;
      for (const auto& [va, vb] : join.pairs) {
        const int v = first ? va : vb;
        rise.edge[static_cast<std::size_t>(p)][rise.u(flat, p, v) < centre(p) ? 0 : 1].push_back(v);
      }
    }
  }
  for (std::size_t round = 0; round < count; ++round) {
    for (const Join& join : joins) {
      if (!legs(join) || over(join)) continue;
      char &a = sewn[static_cast<std::size_t>(join.a)], &b = sewn[static_cast<std::size_t>(join.b)];
      a = b = a || b;
    }
  }
  for (std::size_t p = 0; p < count; ++p) {
    if (sewn[p]) rise.side[p] = side[p];
  }
  for (const int k : {0, 1}) {
    std::size_t most = 0;
    for (std::size_t p = 0; p < count; ++p) {
      const std::size_t way = k == 0 ? 0 : 1;
      if (rise.side[p] == 0 || Rise::leg(rise.side[p]) != k || rise.edge[p][way].size() <= most) continue;
      most = rise.edge[p][way].size();
      rise.front[static_cast<std::size_t>(k)] = static_cast<int>(p);
    }
  }
  if (rise.front[0] < 0 || rise.front[1] < 0) rise.side.assign(count, 0);
  for (const Join& join : joins) {
    if (!legs(join) || !rise.of(join.a) || !rise.of(join.b) || over(join)) continue;
    for (const bool first : {true, false}) {
      const int p = first ? join.a : join.b;
      const bool low = mean_u(join, first) < centre(p);
      if (rise.has_edge(p, low ? 0 : 1) && !rise.inner(join)) rise.inseams.push_back(&join);
    }
  }
  return rise;
}

// The strip of a leg with what bending needs of it.
TrouserLeg trouser_strip(const mesh::GarmentMesh& garment, const FoldedFlat& flat, const std::vector<Join>& joins, const std::vector<PanelLayout>& panels, const Rise& rise, int k, const std::set<int>& group) {
  TrouserLeg leg;
  leg.side = k == 0 ? 1 : -1;
  std::tie(leg.front, leg.back) = rise.top(k, panels, flat);
  const auto at = [&](int p, int v) { return panels[static_cast<std::size_t>(p)](uv_of(flat, v)); };
  const int root = rise.front[static_cast<std::size_t>(k)];
  leg.panels.push_back({.panel = root, .beside = -1, .way = 0, .own = {}, .theirs = {}});
  std::set<int> known{root};
  for (bool grew = true; grew;) {
    grew = false;
    for (const Join& join : joins) {
      if (!join.sewn() || join.a == join.b || rise.inner(join) || !group.count(join.a) || !group.count(join.b) || known.count(join.a) == known.count(join.b)) continue;
      const bool a_known = known.count(join.a) > 0;
      const int old = a_known ? join.a : join.b, fresh = a_known ? join.b : join.a;
      TrouserPanel panel{.panel = fresh, .beside = -1, .way = 0, .own = {}, .theirs = {}};
      for (const auto& [va, vb] : join.pairs) {
        const Vector2d own = at(fresh, a_known ? vb : va), theirs = at(old, a_known ? va : vb);
        panel.own.emplace_back(own.y(), own.x());
        panel.theirs.emplace_back(theirs.y(), theirs.x());
      }
      std::sort(panel.own.begin(), panel.own.end());
      std::sort(panel.theirs.begin(), panel.theirs.end());
      double low = 1e9, high = -1e9;
      for (const auto& [h, a] : panel.own) low = std::min(low, a), high = std::max(high, a);
      // Side by side only where the seam runs along the leg.
      if (panel.own.back().first - panel.own.front().first < high - low) continue;
      for (std::size_t i = 0; i < leg.panels.size(); ++i) {
        if (leg.panels[i].panel == old) panel.beside = static_cast<int>(i);
      }
      panel.way = extent_of(garment, flat, fresh, panels[static_cast<std::size_t>(fresh)]).centre().x() > extent_of(garment, flat, old, panels[static_cast<std::size_t>(old)]).centre().x() ? 1 : -1;
      leg.panels.push_back(panel);
      known.insert(fresh);
      grew = true;
    }
  }
  for (const int p : group) {
    if (!known.count(p)) leg.panels.push_back({.panel = p, .beside = -1, .way = 0, .own = {}, .theirs = {}});
  }
  double high = -1e9, forks = 0, hem = -1e9;
  for (const std::size_t way : {std::size_t{0}, std::size_t{1}}) {
    double lowest = 1e9;
    for (const int p : group) {
      for (int v : rise.edge[static_cast<std::size_t>(p)][way]) {
        lowest = std::min(lowest, at(p, v).y());
        high = std::max(high, at(p, v).y());
      }
    }
    forks += 0.5 * lowest;
  }
  for (const TrouserPanel& panel : leg.panels) {
    if (panel.beside < 0 && panel.panel != root) continue;
    hem = std::max(hem, extent_of(garment, flat, panel.panel, panels[static_cast<std::size_t>(panel.panel)]).low.y());
  }
  leg.fork = forks;
  leg.fork_top = forks + kForkZone * (high - forks);
  leg.hem = hem + 0.005;
  return leg;
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
    if (panel.region == Region::automatic && says(garment.panels[static_cast<std::size_t>(p)], "hood")) {
      issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "no support has a region for a hood: heads are not looked for",
                        .remedy = "leave it out (toile-mesh with leave_out), or give panels." + names[static_cast<std::size_t>(p)] + ".region: attached to lay it along its longest seam as a collar is"});
    } else if (panel.region == Region::automatic) {
      issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "its name does not say which part of the body it goes on",
                        .remedy = "give panels." + names[static_cast<std::size_t>(p)] + ".region (torso_front, torso_back, torso, waist, arm, leg, ...)"});
    }
  }
  if (!issues.empty()) return issues;

  const auto shift_group = [&](const std::set<int>& group, const Vector2d& by) {
    for (int p : group) layout.panels[static_cast<std::size_t>(p)].shift += by;
  };
  // Trousers: legs that are sewn to one another over the crotch.
  const Rise rise = find_rise(garment, flat, joins, specs, layout.panels);
  for (int p = 0; p < count; ++p) layout.panels[static_cast<std::size_t>(p)].rise = rise.of(p);

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
        if (rise.inner(join)) continue;  // the strip is open at the inseam
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

  const std::map<std::string, double> levels{{"neck", frame.neck},   {"armpit", frame.armpit}, {"chest", frame.chest.value_or(frame.armpit)},
                                             {"waist", frame.waist}, {"hips", frame.hips},     {"crotch", frame.crotch}};
  const contact::SupportField body(contact::make_surface(static_cast<int>(support.x.rows()), support.faces), support.x);
  // Where a panel's anchor lies in the unrolled part, and where on the support it goes; what is wrong with it becomes an issue.
  struct Anchor {
    Vector2d own;
    double y;                           // [m]
    std::optional<Eigen::Vector3d> to;  // a point on the support [m]
  };
  const auto anchor_of = [&](int p, const char* usual) -> std::optional<Anchor> {
    const PanelSpec* spec = specs[static_cast<std::size_t>(p)];
    if (!spec || !spec->point) return std::nullopt;
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
      return std::nullopt;
    }
    if (!spec->to.empty()) {
      const Eigen::Vector3d to(spec->to[0], spec->to[1], spec->to[2]);
      const double distance = std::abs(body.nearest(to).distance);
      if (distance > kNear) {
        issues.push_back({.code = "off_support", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".to"},
                          .what = fmt::format("the point ({:.3f}, {:.3f}, {:.3f}) m is {:.0f} mm from the support's surface", to.x(), to.y(), to.z(), 1e3 * distance),
                          .remedy = "give a point on it, in metres; toile-info lists the support's size and landmarks"});
        return std::nullopt;
      }
      return Anchor{own, to.y(), to};
    }
    const std::string at = spec->at.value_or(usual);
    std::optional<double> target;
    if (const auto level = levels.find(at); level != levels.end()) target = level->second;
    if (const auto mark = frame.landmarks.find(at); mark != frame.landmarks.end()) target = mark->second.y();
    if (!target) {
      std::vector<std::string> candidates;
      for (const auto& [name, y] : levels) candidates.push_back(name);
      for (const auto& [name, y] : frame.landmarks) candidates.push_back(name);
      issues.push_back({.code = "unknown_anchor", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".at"},
                        .what = "the support has no landmark or level '" + at + "'", .remedy = suggestion(at, candidates)});
      return std::nullopt;
    }
    return Anchor{own, *target, std::nullopt};
  };

  // Strips of trousers, which say how bands and yokes lie round the trunk.
  std::array<std::set<int>, 2> trouser_leg;  // left, right
  for (const int k : {0, 1}) {
    std::vector<int> members;
    for (int p = 0; p < count; ++p) {
      if (rise.of(p) && rise.side[static_cast<std::size_t>(p)] == (k == 0 ? 1 : -1)) members.push_back(p);
    }
    if (members.empty()) continue;
    double girth = 0;
    trouser_leg[static_cast<std::size_t>(k)] = lay_out(members, rise.front[static_cast<std::size_t>(k)], girth);
    for (const int p : members) {
      if (trouser_leg[static_cast<std::size_t>(k)].count(p)) continue;
      issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "its seams do not say how it lies beside the other panels of its trouser leg",
                        .remedy = "sew it upright to one of them, or give panels." + names[static_cast<std::size_t>(p)] + ".turn"});
    }
  }
  // Which part of half the way round (from the front to the back) lies before a vertex of trousers, negative on the right; nothing below the waist's seam.
  const auto half_round = [&](int vertex) -> std::optional<double> {
    const int p = garment.vertex_panel[vertex];
    for (const int k : {0, 1}) {
      if (!trouser_leg[static_cast<std::size_t>(k)].count(p)) continue;
      const auto ends = rise.top(k, layout.panels, flat);
      const double at = (layout.panels[static_cast<std::size_t>(p)](uv_of(flat, vertex)).x() - ends.first) / (ends.second - ends.first);
      return k == 0 ? at : -at;
    }
    return std::nullopt;
  };
  // Turns and moves a group of the trunk's panels that is sewn to trousers so that its seams meet them.
  const auto meet_trousers = [&](const std::set<int>& group, double girth) {
    std::vector<std::pair<Vector2d, double>> mates;  // own place, wanted way round
    for (const Join& join : joins) {
      for (const auto& [self, other, second] : {std::tuple(join.a, join.b, true), std::tuple(join.b, join.a, false)}) {
        if (!join.sewn() || !group.count(self) || !rise.of(other)) continue;
        for (const auto& [va, vb] : join.pairs) {
          if (const auto at = half_round(second ? vb : va)) mates.emplace_back(layout.panels[static_cast<std::size_t>(self)](uv_of(flat, second ? va : vb)), *at * 0.5 * girth);
        }
      }
    }
    if (mates.size() < 2 || girth <= 0) return false;
    double best = -1, shift = 0;
    int quarters = 0;
    const bool free = std::none_of(group.begin(), group.end(), [&](int p) { return specs[static_cast<std::size_t>(p)] && specs[static_cast<std::size_t>(p)]->turn != 0; });
    for (int k = 0; k < (free ? 4 : 1); ++k) {
      const double c = std::cos(k * 0.5 * std::numbers::pi), s = std::sin(k * 0.5 * std::numbers::pi);
      double cosine = 0, sine = 0;
      for (const auto& [own, wanted] : mates) {
        const double angle = 2 * std::numbers::pi * (wanted - (c * own.x() - s * own.y())) / girth;
        cosine += std::cos(angle);
        sine += std::sin(angle);
      }
      const double fit = std::hypot(cosine, sine);
      if (fit <= best * (1 + 1e-9)) continue;
      best = fit;
      quarters = k;
      shift = std::atan2(sine, cosine) * girth / (2 * std::numbers::pi);
    }
    for (const int p : group) {
      PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      PanelLayout turned;
      turned.turn = quarters * 0.5 * std::numbers::pi;
      panel.shift = turned(panel.shift) + Vector2d(shift, 0);
      panel.turn += turned.turn;
    }
    return true;
  };

  // The trunk.
  std::vector<int> trunk;
  for (int p = 0; p < count; ++p) {
    if (on_trunk(layout.panels[static_cast<std::size_t>(p)].region)) trunk.push_back(p);
  }
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
      // Ranked last: its group is of bands alone.
      if (first.region == Region::waist && size.y() > size.x() && !specs[static_cast<std::size_t>(root)]) first.turn = std::numbers::pi / 2;
      auto group = lay_out(rest, root, girth);
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
      if (meet_trousers(group, girth)) continue;
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
    for (const auto& group : groups) {
      std::optional<double> lift;
      for (int p : group) {
        const std::optional<Anchor> anchor = anchor_of(p, "waist");
        if (!anchor) continue;
        lift = anchor->y - anchor->own.y();
        if (!anchor->to) continue;
        double round = place_round(frame, *anchor->to) * girth - anchor->own.x();
        round -= girth * std::round(round / girth);
        shift_group(group, {round, 0});
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
      if (rise.of(p)) side[static_cast<std::size_t>(p)] = rise.side[static_cast<std::size_t>(p)];
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
      const auto crosses = [&](const Join& join) {
        if (!join.sewn() || (join.a != p && join.b != p)) return false;
        const int other = join.a == p ? join.b : join.a;
        return on_leg(layout.panels[static_cast<std::size_t>(other)].region) && side[static_cast<std::size_t>(other)] * side[static_cast<std::size_t>(p)] < 0;
      };
      if (!panel.rise && std::any_of(joins.begin(), joins.end(), crosses)) {
        issues.push_back({.code = "no_region", .place = {.item = panel_name(p)}, .what = "it is sewn to the other leg, but nothing says which of the panels are fronts and which backs",
                          .remedy = "use front and back in the panels' names, or give panels." + names[static_cast<std::size_t>(p)] + ".region: leg_left or leg_right"});
        continue;
      }
      panel.region = side[static_cast<std::size_t>(p)] > 0 ? Region::leg_left : Region::leg_right;
      panel.part = panel.region == Region::leg_left ? Part::leg_left : Part::leg_right;
    }
  }
  for (int p = 0; p < count; ++p) {
    const PanelSpec* spec = specs[static_cast<std::size_t>(p)];
    const PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
    if (spec && spec->point && (on_arm(panel.region) || panel.region == Region::attached)) {
      issues.push_back({.code = "bad_anchor", .place = {.item = "panels." + names[static_cast<std::size_t>(p)] + ".point"},
                        .what = on_arm(panel.region) ? "a panel round an arm has no anchor: its seams say where it goes" : "an attached panel has no anchor: its seams say where it goes",
                        .remedy = on_arm(panel.region) ? "leave out `point`, or move it by `shift`" : "leave out `point`"});
    }
  }
  if (!issues.empty()) return issues;
  // Heights of legs: by an anchor; otherwise trousers at the seams that they hang on, or by their top edge from the waist, and tubes
  // from the crotch, or from below what hangs on the trunk.
  const auto hang = [&](const std::set<int>& group, Part part, double girth) {
    const Limb& limb = part == Part::leg_left ? *frame.leg_left : *frame.leg_right;
    const LegAxis axis(limb, layout.panels[static_cast<std::size_t>(*group.begin())].rise ? LegAxis::Shape::trousers : LegAxis::Shape::tube);
    std::optional<double> lift;
    double high = -1e9;
    for (int p : group) {
      high = std::max(high, extent_of(garment, flat, p, layout.panels[static_cast<std::size_t>(p)]).high.y());
      const std::optional<Anchor> anchor = anchor_of(p, layout.panels[static_cast<std::size_t>(p)].rise ? "waist" : "crotch");
      if (!anchor) continue;
      lift = axis.height(anchor->y) - anchor->own.y();
      if (!anchor->to) continue;
      const std::string item = "panels." + names[static_cast<std::size_t>(p)] + ".to";
      const Eigen::Vector3d middle = axis.at(axis.height(anchor->y)).middle;
      const double side = part == Part::leg_left ? 1 : -1;
      if (layout.panels[static_cast<std::size_t>(p)].rise) {
        issues.push_back({.code = "bad_anchor", .place = {.item = item}, .what = "how trousers lie round the body follows from their seams; a point cannot say it",
                          .remedy = "give the height alone: `at`, a landmark or level"});
      } else if (side * (anchor->to->x() - frame.x_mid) < 0 || anchor->y > frame.crotch + kNear) {
        issues.push_back({.code = "off_support", .place = {.item = item},
                          .what = fmt::format("the point ({:.3f}, {:.3f}, {:.3f}) m is not on the {} leg", anchor->to->x(), anchor->to->y(), anchor->to->z(), side > 0 ? "left" : "right"),
                          .remedy = "give a point on it, in metres"});
      } else if (girth > 0) {
        const double round = std::atan2(anchor->to->x() - middle.x(), anchor->to->z() - middle.z()) / (2 * std::numbers::pi) * girth - anchor->own.x();
        shift_group(group, {round - girth * std::round(round / girth), 0});
      }
    }
    if (lift) {
      shift_group(group, {0, *lift});
      return;
    }
    double sum = 0, mates = 0, trunk_low = 1e9;
    for (int p = 0; p < count; ++p) {
      const PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      if (panel.part == Part::trunk && on_trunk(panel.region)) trunk_low = std::min(trunk_low, extent_of(garment, flat, p, panel).low.y());
    }
    if (layout.panels[static_cast<std::size_t>(*group.begin())].rise) {
      for (const Join& join : joins) {
        for (const auto& [self, other, second] : {std::tuple(join.a, join.b, true), std::tuple(join.b, join.a, false)}) {
          if (!join.sewn() || !group.count(self) || !on_trunk(layout.panels[static_cast<std::size_t>(other)].region)) continue;
          for (const auto& [va, vb] : join.pairs) {
            const double theirs = layout.panels[static_cast<std::size_t>(other)](uv_of(flat, second ? vb : va)).y();
            sum += axis.height(theirs) - layout.panels[static_cast<std::size_t>(self)](uv_of(flat, second ? va : vb)).y();
            mates += 1;
          }
        }
      }
      shift_group(group, {0, mates > 0 ? sum / mates : axis.height(frame.waist) - high});
      return;
    }
    shift_group(group, {0, axis.height(std::min(limb.origin.y(), trunk_low - kSheetUnder)) - high});
  };
  for (const int k : {0, 1}) {
    if (trouser_leg[static_cast<std::size_t>(k)].empty()) continue;
    hang(trouser_leg[static_cast<std::size_t>(k)], k == 0 ? Part::leg_left : Part::leg_right, 0);
    for (int p : trouser_leg[static_cast<std::size_t>(k)]) {
      if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) layout.panels[static_cast<std::size_t>(p)].shift += Vector2d(spec->shift[0], spec->shift[1]);
    }
  }
  for (const Part part : {Part::arm_left, Part::arm_right, Part::leg_left, Part::leg_right}) {
    std::vector<int> members;
    for (int p = 0; p < count; ++p) {
      const PanelLayout& panel = layout.panels[static_cast<std::size_t>(p)];
      if (panel.part == part && !panel.rise) members.push_back(p);
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
      hang(group, part, g);
    }
    for (int p : members) {
      if (const PanelSpec* spec = specs[static_cast<std::size_t>(p)]) layout.panels[static_cast<std::size_t>(p)].shift += Vector2d(spec->shift[0], spec->shift[1]);
    }
  }
  for (const int k : {0, 1}) {
    if (!trouser_leg[static_cast<std::size_t>(k)].empty()) layout.trousers.push_back(trouser_strip(garment, flat, joins, layout.panels, rise, k, trouser_leg[static_cast<std::size_t>(k)]));
  }
  if (!issues.empty()) return issues;
  return layout;
}

}  // namespace toile::placement
