#include "seam_plan.h"

#include "pairing.h"
#include "seam_sides.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

constexpr double near_corner = 0.1;     ///< a given place this near to a corner means the corner [cells]
constexpr double near_mark = 0.4;       ///< marks of two sides this near meet [cells of the finer side]
constexpr double fade = 6;              ///< a vertex that slides takes the ones beside it along, less and less over this stretch [cells]
constexpr double steepest_ratio = 3.05; ///< of the lengths of two sides between places that come together
constexpr double same_place = 1e-9;     ///< [m]

/// Disjoint sets.
class Groups {
 public:
  explicit Groups(std::size_t count = 0) : root_(count) { std::iota(root_.begin(), root_.end(), 0); }
  int find(int a) {
    while (root_[a] != a) a = root_[a] = root_[root_[a]];
    return a;
  }
  void unite(int a, int b) {
    a = find(a), b = find(b);
    root_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> root_;
};

/// A place on a run that has a counterpart on every edge sewn there: an end, a corner, a joint, a match point.
/// Places are counted in the direction in which the first seam that names the run uses it ("c"), so that a mirrored
/// garment is sewn as the mirror image.
struct Mark {
  int run = 0;
  double c = 0;
  int vertex = -1;       ///< -1: none yet
  bool held = false;     ///< must stay at c
  double vertex_c = 0;   ///< where its vertex is now
};

/// A stretch of a run on the way along a side.
struct Leg {
  int run = 0;
  double c0 = 0, c1 = 0;  ///< in sewing direction
  int m0 = 0, m1 = 0;     ///< marks at its ends
  double start = 0;       ///< from the side's start [m]
  double length() const { return std::abs(c1 - c0); }
};

using Path = std::vector<Leg>;
double path_length(const Path& path) { return path.empty() ? 0 : path.back().start + path.back().length(); }

/// A mark on a path, or the two marks of a joint.
struct PathPoint {
  double along = 0;
  int in = -1, out = -1;  ///< marks where the way comes in and goes on
  int leg_in = -1, leg_out = -1;
};

/// Points of the two paths of a bond that come together.
using Knot = std::array<PathPoint, 2>;

struct Bond {
  int seam = 0, side = 0;
  std::array<Path, 2> paths;
  std::vector<std::array<int, 2>> matches;  ///< marks
  std::vector<Knot> knots;
  double allowed = 0;
};

class Planner {
 public:
  Planner(const GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<SeamSides>& seams, const SewParams& params)
      : garment_(garment), runs_(runs), seams_(seams), params_(params), used_(runs.size(), 0), flipped_(runs.size(), 0), on_run_(runs.size()) {}

  Result<SeamPlan> plan() {
    first_marks();
    make_bonds();
    if (!issues_.empty()) return issues_;
    settle();
    if (!issues_.empty()) return issues_;
    check_order();
    if (!issues_.empty()) return issues_;
    adopt();
    number_segments();
    join_segments();
    if (!issues_.empty()) return issues_;
    fill_segments();
    SeamPlan result;
    result.rows = rows();
    if (!issues_.empty()) return issues_;
    result.bonds = planned_bonds(result.rows);
    result.notes = notes_;
    return result;
  }

 private:
  bool aligned() const { return params_.matching == Matching::aligned; }
  const SeamSpec& spec(int seam) const { return *seams_[static_cast<std::size_t>(seam)].spec; }
  double run_length(int run) const { return garment_.runs[static_cast<std::size_t>(run)].length; }
  double to_c(int run, double s) const { return flipped_[static_cast<std::size_t>(run)] ? run_length(run) - s : s; }
  double to_s(int run, double c) const { return to_c(run, c); }
  double cell(int run) const { return runs_[static_cast<std::size_t>(run)].cell; }
  std::string run_name(int run) const {
    const auto& row = garment_.runs[static_cast<std::size_t>(run)];
    return garment_.panels[static_cast<std::size_t>(row.panel)].name + "." + row.name;
  }
  std::string mark_text(int mark) const {
    const Mark& m = marks_[static_cast<std::size_t>(mark)];
    return fmt::format("{} at {:.1f} mm", run_name(m.run), to_s(m.run, m.c) * 1e3);
  }

  int add_mark(int run, double c, int vertex, bool held) {
    const int id = static_cast<int>(marks_.size());
    marks_.push_back({run, c, vertex, held, c});
    auto& list = on_run_[static_cast<std::size_t>(run)];
    // On a closed run the mark of its start stays first, that of its end last.
    const auto place = std::upper_bound(list.begin(), list.end(), c, [&](double at, int m) { return at < marks_[static_cast<std::size_t>(m)].c; });
    list.insert(place, id);
    return id;
  }

  /// The mark at a place that a spec names; a place just beside a corner means the corner.
  int require(int run, double c, int vertex) {
    const auto known_place = required_.find({run, c});
    if (known_place != required_.end()) return known_place->second;
    const int mark = find_or_add(run, c, vertex);
    required_.emplace(std::pair(run, c), mark);
    return mark;
  }

  int find_or_add(int run, double c, int vertex) {
    const auto& row = runs_[static_cast<std::size_t>(run)].row;
    const auto& list = on_run_[static_cast<std::size_t>(run)];
    const auto nearest = [&]() -> int {
      int best = -1;
      for (int m : list) {
        if (best < 0 || std::abs(marks_[static_cast<std::size_t>(m)].c - c) < std::abs(marks_[static_cast<std::size_t>(best)].c - c)) best = m;
      }
      return best;
    };
    const int known = nearest();
    const auto off = [&](int m) { return std::abs(marks_[static_cast<std::size_t>(m)].c - c); };
    if (known >= 0 && off(known) <= same_place) return known;
    for (const auto& v : row) {
      if (v.id == vertex && std::abs(to_c(run, v.s) - c) <= same_place) return add_mark(run, to_c(run, v.s), v.id, true);
    }
    const double snap = std::max(always_allowed, near_corner * cell(run));
    const PlanRun::Vertex* corner = nullptr;
    for (const auto& v : row) {
      if (std::abs(to_c(run, v.s) - c) <= same_place) return add_mark(run, to_c(run, v.s), v.id, true);
      if (v.held && (!corner || std::abs(to_c(run, v.s) - c) < std::abs(to_c(run, corner->s) - c))) corner = &v;
    }
    const double corner_off = corner ? std::abs(to_c(run, corner->s) - c) : std::numeric_limits<double>::infinity();
    if (known >= 0 && off(known) <= snap && off(known) <= corner_off) return known;
    if (corner_off <= snap) return add_mark(run, to_c(run, corner->s), corner->id, true);
    return add_mark(run, c, -1, true);
  }

  void first_marks() {
    for (const SeamSides& seam : seams_) {
      for (const auto& side : seam.sides) {
        for (const RunPart& part : side) {
          const auto r = static_cast<std::size_t>(part.run);
          if (used_[r]) continue;
          used_[r] = 1;
          flipped_[r] = part.reversed;
        }
      }
    }
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!used_[r]) continue;
      const auto& row = runs_[r].row;
      for (std::size_t k = 0; k < row.size(); ++k) {
        const bool end = k == 0 || k + 1 == row.size();
        if (end || (aligned() && row[k].held)) add_mark(static_cast<int>(r), to_c(static_cast<int>(r), row[k].s), row[k].id, true);
      }
    }
    // Places with a name first, then those given by a length.
    for (const bool named : {true, false}) {
      for (const SeamSides& seam : seams_) {
        for (const auto& side : seam.sides) {
          for (const RunPart& part : side) {
            for (const RunPlace* place : {&part.from, &part.to}) {
              if ((place->vertex >= 0) == named) require(part.run, to_c(part.run, place->s), place->vertex);
            }
          }
        }
        for (const SeamMatch& match : seam.matches) {
          if ((match.a.vertex >= 0) == named) mark_of(seam, match.a);
          if ((match.b.vertex >= 0) == named) mark_of(seam, match.b);
        }
        for (const SeamZone& zone : seam.zones) {
          if ((zone.from.vertex >= 0) == named) mark_of(seam, zone.from);
          if ((zone.to.vertex >= 0) == named) mark_of(seam, zone.to);
        }
      }
    }
  }

  int mark_of(const SeamSides& seam, const SidePlace& place) {
    const RunPart& part = seam.sides[static_cast<std::size_t>(place.side)][static_cast<std::size_t>(place.part)];
    return require(part.run, to_c(part.run, place.s), place.vertex);
  }

  Path path_of(int seam, int side) {
    Path path;
    double start = 0;
    for (const RunPart& part : seams_[static_cast<std::size_t>(seam)].sides[static_cast<std::size_t>(side)]) {
      Leg leg;
      leg.run = part.run;
      leg.m0 = require(part.run, to_c(part.run, part.from.s), part.from.vertex);
      leg.m1 = require(part.run, to_c(part.run, part.to.s), part.to.vertex);
      if (part.reversed) std::swap(leg.m0, leg.m1);
      leg.c0 = marks_[static_cast<std::size_t>(leg.m0)].c;
      leg.c1 = marks_[static_cast<std::size_t>(leg.m1)].c;
      leg.start = start;
      start += leg.length();
      if (leg.m0 == leg.m1 || leg.length() < same_place) {
        issues_.push_back(seam_issue(spec(seam), "bad_range", fmt::format("{} is too short to be sewn on this grid", part_text(garment_, part)), "give a longer range, or smaller cells"));
      }
      path.push_back(leg);
    }
    return path;
  }

  /// All marks along a path, joints as one point.
  std::vector<PathPoint> points(const Path& path) const {
    std::vector<PathPoint> result;
    for (std::size_t k = 0; k < path.size(); ++k) {
      const Leg& leg = path[k];
      const int at = static_cast<int>(k);
      if (k == 0) result.push_back({0, leg.m0, leg.m0, at, at});
      else result.back().out = leg.m0, result.back().leg_out = at;
      const auto& list = on_run_[static_cast<std::size_t>(leg.run)];
      auto p = std::find(list.begin(), list.end(), leg.m0), q = std::find(list.begin(), list.end(), leg.m1);
      const int step = p < q ? 1 : -1;
      for (p += step; p != q; p += step) result.push_back({leg.start + std::abs(marks_[static_cast<std::size_t>(*p)].c - leg.c0), *p, *p, at, at});
      result.push_back({leg.start + leg.length(), leg.m1, leg.m1, at, at});
    }
    return result;
  }

  std::optional<PathPoint> point_of(const Path& path, int mark) const {
    for (const PathPoint& point : points(path)) {
      if (point.in == mark || point.out == mark) return point;
    }
    return std::nullopt;
  }

  /// The path begun at one of its points and led back there over its start.
  Path rotated(const Path& path, const PathPoint& start) const {
    Path result;
    const auto split = static_cast<std::size_t>(start.leg_out);
    const Leg& cut = path[split];
    const Mark& mark = marks_[static_cast<std::size_t>(start.out)];
    if (start.out != cut.m1) {
      Leg rest = cut;
      rest.m0 = start.out, rest.c0 = mark.c;
      result.push_back(rest);
    }
    for (std::size_t k = split + 1; k < path.size(); ++k) result.push_back(path[k]);
    for (std::size_t k = 0; k < split; ++k) result.push_back(path[k]);
    if (start.out != cut.m0) {
      Leg rest = cut;
      rest.m1 = start.out, rest.c1 = mark.c;
      result.push_back(rest);
    }
    double along = 0;
    for (Leg& leg : result) leg.start = along, along += leg.length();
    return result;
  }

  void unite_vertices(Groups& groups) const {
    std::map<int, int> mark_of_vertex;
    for (std::size_t m = 0; m < marks_.size(); ++m) {
      if (marks_[m].vertex < 0) continue;
      const auto [it, fresh] = mark_of_vertex.emplace(marks_[m].vertex, static_cast<int>(m));
      if (!fresh) groups.unite(it->second, static_cast<int>(m));
    }
  }

  void make_bonds() {
    std::vector<std::vector<Path>> paths(seams_.size());
    for (std::size_t k = 0; k < seams_.size(); ++k) {
      for (std::size_t side = 0; side < seams_[k].sides.size(); ++side) paths[k].push_back(path_of(static_cast<int>(k), static_cast<int>(side)));
    }
    if (!issues_.empty()) return;
    for (std::size_t k = 0; k < seams_.size(); ++k) {
      for (std::size_t side = 1; side < paths[k].size(); ++side) {
        Bond bond;
        bond.seam = static_cast<int>(k);
        bond.side = static_cast<int>(side);
        bond.paths = {paths[k][0], paths[k][side]};
        bond.allowed = allowed_difference(*seams_[k].spec, seams_[k].lengths[0], seams_[k].lengths[side], params_);
        find_matches(bond);
        bonds_.push_back(std::move(bond));
      }
    }
    if (!issues_.empty()) return;
    // Which chains are closed: their ends are one vertex, or seams that begin or end there join them. Seams whose match points
    // do not let their starts come together must be rings; if they turn out not to be, their starts do come together.
    Groups ends(marks_.size());
    unite_vertices(ends);
    const auto closed = [&](const Bond& bond) {
      return std::all_of(bond.paths.begin(), bond.paths.end(), [&](const Path& path) { return ends.find(path.front().m0) == ends.find(path.back().m1); });
    };
    const auto close = [&](const Bond& bond) {
      ends.unite(bond.paths[0].front().m0, bond.paths[1].front().m0);
      ends.unite(bond.paths[0].back().m1, bond.paths[1].back().m1);
    };
    std::vector<std::size_t> doubtful;
    for (std::size_t b = 0; b < bonds_.size(); ++b) {
      if (starts_meet(bonds_[b])) close(bonds_[b]);
      else doubtful.push_back(b);
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (auto b = doubtful.begin(); b != doubtful.end(); ++b) {
        if (closed(bonds_[*b])) continue;
        close(bonds_[*b]);
        doubtful.erase(b);
        changed = true;
        break;
      }
    }
    for (const Bond& bond : bonds_) {
      if (bond.matches.empty() && closed(bond)) look_for_turn(bond);
    }
    for (std::size_t b = 0; b < bonds_.size(); ++b) tie(bonds_[b], std::count(doubtful.begin(), doubtful.end(), b) > 0);
  }

  /// Where a ring passes from one panel to another, and its start where its ends are two vertices: seams that end there [m]. None
  /// if the ring begins inside an edge: somebody chose the place.
  std::vector<double> joints(const Path& path) const {
    std::vector<double> result;
    for (const auto& [m, run] : {std::pair{path.front().m0, path.front().run}, std::pair{path.back().m1, path.back().run}}) {
      const double c = marks_[static_cast<std::size_t>(m)].c;
      if (c > same_place && c < run_length(run) - same_place) return {};
    }
    if (marks_[static_cast<std::size_t>(path.front().m0)].vertex != marks_[static_cast<std::size_t>(path.back().m1)].vertex) result.push_back(0);
    for (std::size_t k = 1; k < path.size(); ++k) {
      if (marks_[static_cast<std::size_t>(path[k - 1].m1)].vertex != marks_[static_cast<std::size_t>(path[k].m0)].vertex) result.push_back(path[k].start);
    }
    return result;
  }

  /// Notes a ring without match points in which more seams would meet if one of its chains were turned.
  void look_for_turn(const Bond& bond) {
    const std::array<std::vector<double>, 2> own{joints(bond.paths[0]), joints(bond.paths[1])};
    const std::array<double, 2> length{path_length(bond.paths[0]), path_length(bond.paths[1])};
    const double near = std::max({bond.allowed, 0.01 * length[0], always_allowed}) / length[0];
    const auto meeting = [&](double turn) {
      int count = 0;
      for (double a : own[0]) {
        for (double b : own[1]) {
          const double off = a / length[0] + turn - b / length[1];
          if (std::abs(off - std::round(off)) <= near) {
            ++count;
            break;
          }
        }
      }
      return count;
    };
    const int now = meeting(0);
    int best = now;
    double turn = 0;
    for (double a : own[0]) {
      for (double b : own[1]) {
        double other = b / length[1] - a / length[0];
        other -= std::floor(other);
        if (const int count = meeting(other); count > best) best = count, turn = other;
      }
    }
    if (best == now) return;
    notes_.push_back(seam_issue(spec(bond.seam), "turned_ring",
                                fmt::format("{} of the seams that end at this ring meet one of its other side; {} would if {} were begun {:.1f} mm later", now, best, side_text(spec(bond.seam), bond.side), turn * length[1] * 1e3),
                                "begin both chains at the same seam, or confirm the way they lie by a match point"));
  }

  void find_matches(Bond& bond) {
    const SeamSides& seam = seams_[static_cast<std::size_t>(bond.seam)];
    for (const SeamMatch& match : seam.matches) {
      if (match.b.side != bond.side) continue;
      const std::array<int, 2> pair{mark_of(seam, match.a), mark_of(seam, match.b)};
      for (std::size_t side = 0; side < 2; ++side) {
        if (!point_of(bond.paths[side], pair[side])) issues_.push_back(seam_issue(*seam.spec, "bad_match", fmt::format("the match point at {} is too near to the end of a range", mark_text(pair[side])), "give the two places the same value, or leave the match point out"));
      }
      bond.matches.push_back(pair);
    }
  }

  /// The match points of a bond as knots, in the order of side a.
  std::vector<Knot> located(const Bond& bond) const {
    std::vector<Knot> knots;
    for (const auto& [a, b] : bond.matches) knots.push_back({*point_of(bond.paths[0], a), *point_of(bond.paths[1], b)});
    std::sort(knots.begin(), knots.end(), [](const Knot& p, const Knot& q) { return std::tie(p[0].along, p[1].along) < std::tie(q[0].along, q[1].along); });
    return knots;
  }

  /// Match points and ends.
  std::vector<Knot> given_knots(const Bond& bond) const {
    std::vector<Knot> knots = located(bond);
    const auto first = points(bond.paths[0]), second = points(bond.paths[1]);
    const Knot start{first.front(), second.front()}, end{first.back(), second.back()};
    const auto same = [](const Knot& p, const Knot& q) { return p[0].along == q[0].along && p[1].along == q[1].along; };
    knots.erase(std::unique(knots.begin(), knots.end(), same), knots.end());
    if (knots.empty() || !same(knots.front(), start)) knots.insert(knots.begin(), start);
    if (!same(knots.back(), end)) knots.push_back(end);
    return knots;
  }

  static bool in_order(const std::vector<Knot>& knots) {
    for (std::size_t k = 1; k < knots.size(); ++k) {
      if (knots[k][0].along <= knots[k - 1][0].along || knots[k][1].along <= knots[k - 1][1].along) return false;
    }
    return true;
  }

  /// Whether the starts of the two chains can come together. On closed chains the match points may forbid it.
  bool starts_meet(const Bond& bond) const {
    if (bond.matches.empty()) return true;
    if (!in_order(given_knots(bond))) return false;
    const std::vector<Knot> own = located(bond);
    const double l0 = path_length(bond.paths[0]), l1 = path_length(bond.paths[1]);
    const double u0 = l0 - own.back()[0].along, w0 = own.front()[0].along, u1 = l1 - own.back()[1].along, w1 = own.front()[1].along;
    const double slack = std::max({always_allowed, std::min(params_.tolerance * std::max(l0, l1), params_.tolerance_max), spec(bond.seam).ease.value_or(0)});
    return u0 + w0 <= 0 || u1 + w1 <= 0 || std::abs(u0 / (u0 + w0) - u1 / (u1 + w1)) * std::max(u0 + w0, u1 + w1) <= slack;
  }

  /// Sets the knots that the spec asks for: ends, match points, zones of ease.
  void tie(Bond& bond, bool ring) {
    if (ring) {
      const Knot start = located(bond).front();
      // The ring begins there from now on. (The mark of a joint may be the one at its end.)
      std::erase_if(bond.matches, [&](const std::array<int, 2>& match) {
        return point_of(bond.paths[0], match[0])->along == start[0].along && point_of(bond.paths[1], match[1])->along == start[1].along;
      });
      for (std::size_t side = 0; side < 2; ++side) bond.paths[side] = rotated(bond.paths[side], start[side]);
    }
    bond.knots = given_knots(bond);
    if (!in_order(bond.knots)) {
      issues_.push_back(seam_issue(spec(bond.seam), "bad_match", "the match points come in another order on the two sides", "check their names and the sewing direction"));
      return;
    }
    if (lay_ease(bond)) check_steepness(bond);
  }

  /// Puts knots at the ends of zones of ease.
  bool lay_ease(Bond& bond) {
    const SeamSides& seam = seams_[static_cast<std::size_t>(bond.seam)];
    struct Part {
      int side;
      double from, to, share;
      int m_from, m_to;
    };
    const auto fail = [&](std::string what, std::string remedy) {
      issues_.push_back(seam_issue(*seam.spec, "bad_ease", std::move(what), std::move(remedy)));
      return false;
    };
    std::vector<Knot> knots;
    for (std::size_t k = 1; k < bond.knots.size(); ++k) {
      knots.push_back(bond.knots[k - 1]);
      const std::array<double, 2> start{bond.knots[k - 1][0].along, bond.knots[k - 1][1].along};
      const std::array<double, 2> length{bond.knots[k][0].along - start[0], bond.knots[k][1].along - start[1]};
      std::vector<Part> parts;
      for (const SeamZone& zone : seam.zones) {
        const int side = zone.from.side == 0 ? 0 : 1;
        if (side == 1 && zone.from.side != bond.side) continue;
        const int m_from = mark_of(seam, zone.from), m_to = mark_of(seam, zone.to);
        const auto from = point_of(bond.paths[static_cast<std::size_t>(side)], m_from), to = point_of(bond.paths[static_cast<std::size_t>(side)], m_to);
        TOILE_CHECK(from && to, "marks {} and {} are not on their path", m_from, m_to);
        const double own_start = start[static_cast<std::size_t>(side)], own_length = length[static_cast<std::size_t>(side)];
        std::vector<std::array<double, 2>> stretches{{from->along, to->along}};
        if (from->along > to->along) stretches = {{0, to->along}, {from->along, path_length(bond.paths[static_cast<std::size_t>(side)])}};
        // The start of a ring may lie inside a zone; where both parts lie between the same match points they divide its share.
        const std::size_t before = parts.size();
        double width = 0;
        for (const auto& [a, b] : stretches) {
          const double low = std::max(a - own_start, 0.0), high = std::min(b - own_start, own_length);
          if (high - low <= same_place) continue;
          parts.push_back({side, low, high, zone.share, a == from->along && a - own_start >= 0 ? m_from : -1, b == to->along && b - own_start <= own_length ? m_to : -1});
          width += high - low;
        }
        for (std::size_t i = before; i < parts.size(); ++i) parts[i].share *= (parts[i].to - parts[i].from) / width;
      }
      if (parts.empty()) continue;
      std::sort(parts.begin(), parts.end(), [](const Part& p, const Part& q) { return p.from < q.from; });
      const auto own = static_cast<std::size_t>(parts.front().side), other = 1 - own;
      const double difference = length[other] - length[own];  // what the other side has more
      double total = 0, inside = 0;
      for (std::size_t i = 0; i < parts.size(); ++i) {
        total += parts[i].share;
        inside += parts[i].to - parts[i].from;
        if (parts[i].side != parts.front().side) return fail("zones of ease between the same match points are given on different sides", "give them all on one side");
        if (i > 0 && parts[i].from < parts[i - 1].to - same_place) return fail("two zones of ease overlap", "let one begin where the other ends");
      }
      if (total > 1 + 1e-9) return fail(fmt::format("the shares of the zones of ease make {:.0f} %", 100 * total), "they may make 100 % between two match points");
      const double outside = length[own] - inside;
      const bool filled = outside < always_allowed;
      // What is left for the cloth beside the zones, on the other side.
      const double beside = outside + (1 - total) * difference;
      if (!filled && beside <= 0) return fail(fmt::format("{:.2f} mm of ease do not fit beside the zones", (1 - total) * -difference * 1e3), "give the zones a larger share");
      double at = 0, at_other = 0;
      for (std::size_t i = 0; i < parts.size(); ++i) {
        const Part& part = parts[i];
        const double share = filled ? (total > 0 ? part.share / total : 1.0 / static_cast<double>(parts.size())) : part.share;
        const double gap = part.from - at, width = part.to - part.from, width_other = width + share * difference;
        if (width_other <= 0) return fail(fmt::format("{:.2f} mm of ease do not fit into a zone of {:.2f} mm", share * -difference * 1e3, width * 1e3), "give it a smaller share, or make it longer");
        at_other += filled ? gap : gap * beside / outside;
        if (gap > same_place) add_zone_knot(bond, knots, own, start, part.from, at_other, part.m_from);
        at_other += width_other;
        at = part.to;
        if (length[own] - part.to > same_place && length[other] - at_other > same_place) add_zone_knot(bond, knots, own, start, part.to, at_other, part.m_to);
      }
    }
    knots.push_back(bond.knots.back());
    bond.knots = std::move(knots);
    return true;
  }

  void add_zone_knot(const Bond& bond, std::vector<Knot>& knots, std::size_t own, const std::array<double, 2>& start, double along_own, double along_other, int mark) {
    Knot knot;
    const auto mine = point_of(bond.paths[own], mark >= 0 ? mark : mark_at(bond.paths[own], start[own] + along_own));
    if (!mine) return;
    knot[own] = *mine;
    const auto theirs = point_of(bond.paths[1 - own], mark_at(bond.paths[1 - own], start[1 - own] + along_other));
    if (!theirs) return;
    knot[1 - own] = *theirs;
    if (knot[0].along <= knots.back()[0].along || knot[1].along <= knots.back()[1].along) return;
    knots.push_back(knot);
  }

  int mark_at(const Path& path, double along) {
    std::size_t k = 0;
    while (k + 1 < path.size() && path[k].start + path[k].length() < along) ++k;
    const Leg& leg = path[k];
    const double way = std::clamp(along - leg.start, 0.0, leg.length());
    return require(leg.run, leg.c0 + (leg.c1 > leg.c0 ? way : -way), -1);
  }

  void check_steepness(const Bond& bond) {
    for (std::size_t k = 1; k < bond.knots.size(); ++k) {
      const double a = bond.knots[k][0].along - bond.knots[k - 1][0].along, b = bond.knots[k][1].along - bond.knots[k - 1][1].along;
      if (std::max(a, b) <= steepest_ratio * std::min(a, b) || std::abs(a - b) <= always_allowed) continue;
      issues_.push_back(seam_issue(spec(bond.seam), "steep_ease", fmt::format("{:.2f} mm from {} would be sewn to {:.2f} mm from {}: more than three to one", a * 1e3, mark_text(bond.knots[k - 1][0].out), b * 1e3, mark_text(bond.knots[k - 1][1].out)),
                                   "correct the match points or the zones of ease"));
      return;
    }
  }

  /// Gives every mark of either side its counterpart on the other, until nothing is missing on any edge.
  void settle() {
    constexpr int enough = 200;
    std::set<int> restless;
    for (int round = 0; round < enough; ++round) {
      restless.clear();
      for (Bond& bond : bonds_) {
        if (settle(bond)) restless.insert(bond.seam);
        if (!issues_.empty()) return;
      }
      if (restless.empty()) return;
    }
    std::vector<std::string> names;
    for (int seam : restless) names.push_back(spec(seam).name);
    issues_.push_back(seam_issue(spec(*restless.begin()), "seam_conflict", fmt::format("the seams {} contradict each other", fmt::join(names, ", ")), "look for edges that are joined in two ways at different places"));
  }

  bool settle(Bond& bond) {
    const std::array<std::vector<PathPoint>, 2> all{points(bond.paths[0]), points(bond.paths[1])};
    std::vector<Knot> knots{bond.knots.front()};
    std::array<std::size_t, 2> next{0, 0};
    bool changed = false;
    for (std::size_t k = 1; k < bond.knots.size(); ++k) {
      const Knot &before = bond.knots[k - 1], &after = bond.knots[k];
      std::array<std::vector<const PathPoint*>, 2> loose;
      std::array<double, 2> length{};
      for (std::size_t side = 0; side < 2; ++side) {
        length[side] = after[side].along - before[side].along;
        while (all[side][next[side]].in != before[side].in) ++next[side];
        for (std::size_t i = next[side] + 1; all[side][i].in != after[side].in; ++i) loose[side].push_back(&all[side][i]);
      }
      if (loose[0].empty() && loose[1].empty()) {
        knots.push_back(after);
        continue;
      }
      changed = true;
      const auto t = [&](std::size_t side, const PathPoint& point) { return (point.along - before[side].along) / length[side]; };
      const auto grain = [&](std::size_t side, const PathPoint& point) { return cell(bond.paths[side][static_cast<std::size_t>(point.leg_in)].run) / length[side]; };
      const auto nearest = [&](std::size_t side, double at) {
        int best = -1;
        for (std::size_t i = 0; i < loose[side].size(); ++i) {
          if (best < 0 || std::abs(t(side, *loose[side][i]) - at) < std::abs(t(side, *loose[side][static_cast<std::size_t>(best)]) - at) - 1e-12) best = static_cast<int>(i);
        }
        return best;
      };
      std::vector<Knot> fresh;
      std::array<std::vector<char>, 2> met{std::vector<char>(loose[0].size(), 0), std::vector<char>(loose[1].size(), 0)};
      int last = -1;
      for (std::size_t i = 0; i < loose[0].size(); ++i) {
        const PathPoint& p = *loose[0][i];
        const int j = nearest(1, t(0, p));
        if (j <= last) continue;
        const PathPoint& q = *loose[1][static_cast<std::size_t>(j)];
        if (nearest(0, t(1, q)) != static_cast<int>(i) || std::abs(t(0, p) - t(1, q)) > near_mark * std::min(grain(0, p), grain(1, q))) continue;
        last = j;
        met[0][i] = met[1][static_cast<std::size_t>(j)] = 1;
        fresh.push_back({p, q});
      }
      // The others, between those that have met.
      const auto image = [&](std::size_t side, const PathPoint& point) {
        const Knot *low = &before, *high = &after;
        for (const Knot& knot : fresh) {
          if (knot[side].along < point.along) low = &knot;
          else if (high == &after) high = &knot;
        }
        const double share = (point.along - (*low)[side].along) / ((*high)[side].along - (*low)[side].along);
        return (*low)[1 - side].along + share * ((*high)[1 - side].along - (*low)[1 - side].along);
      };
      std::vector<Knot> images;
      for (std::size_t side = 0; side < 2; ++side) {
        for (std::size_t i = 0; i < loose[side].size(); ++i) {
          if (met[side][i]) continue;
          Knot knot;
          knot[side] = *loose[side][i];
          knot[1 - side].along = image(side, *loose[side][i]);
          images.push_back(knot);
        }
      }
      fresh.insert(fresh.end(), images.begin(), images.end());
      std::sort(fresh.begin(), fresh.end(), [](const Knot& p, const Knot& q) { return std::tie(p[0].along, p[1].along) < std::tie(q[0].along, q[1].along); });
      for (Knot& knot : fresh) {
        for (std::size_t side = 0; side < 2; ++side) {
          if (knot[side].in >= 0) continue;
          const auto point = new_point(bond.paths[side], knot[side].along);
          if (!point) {
            issues_.push_back(seam_issue(spec(bond.seam), "seam_conflict", fmt::format("what is sewn to {} would come together with another place there: the seams contradict each other", mark_text(knot[1 - side].in)), "look for edges that are joined in two ways at different places"));
            return true;
          }
          knot[side] = *point;
        }
        knots.push_back(knot);
      }
      knots.push_back(after);
    }
    bond.knots = std::move(knots);
    return changed;
  }

  /// A new mark on a path; none where there is one so near that only seams in contradiction can have asked for both.
  std::optional<PathPoint> new_point(const Path& path, double along) {
    std::size_t k = 0;
    while (k + 1 < path.size() && path[k].start + path[k].length() <= along) ++k;
    const Leg& leg = path[k];
    const double way = along - leg.start, c = leg.c0 + (leg.c1 > leg.c0 ? way : -way);
    for (int m : on_run_[static_cast<std::size_t>(leg.run)]) {
      if (std::abs(marks_[static_cast<std::size_t>(m)].c - c) < 1e-6) return std::nullopt;
    }
    const int mark = add_mark(leg.run, c, -1, false);
    return PathPoint{along, mark, mark, static_cast<int>(k), static_cast<int>(k)};
  }

  static void unite_knots(Groups& groups, const Bond& bond) {
    for (const Knot& knot : bond.knots) {
      for (int m : {knot[0].out, knot[1].in, knot[1].out}) groups.unite(knot[0].in, m);
    }
  }

  /// Chains whose edges do not follow one another, and sides that are folded together by other seams.
  void check_order() {
    Groups same_vertex(marks_.size());
    unite_vertices(same_vertex);
    Groups all = same_vertex;
    for (const Bond& bond : bonds_) unite_knots(all, bond);
    for (std::size_t first = 0; first < bonds_.size();) {
      std::size_t last = first;
      while (last < bonds_.size() && bonds_[last].seam == bonds_[first].seam) ++last;
      Groups others = same_vertex;
      bool chained = false;
      for (std::size_t b = first; b < last; ++b) chained = chained || bonds_[b].paths[0].size() > 1 || bonds_[b].paths[1].size() > 1;
      if (chained) {
        for (std::size_t b = 0; b < bonds_.size(); ++b) {
          if (b < first || b >= last) unite_knots(others, bonds_[b]);
        }
      }
      for (std::size_t b = first; b < last; ++b) {
        for (std::size_t side = b == first ? 0 : 1; side < 2; ++side) check_path(bonds_[b], bonds_[b].paths[side], others, all);
      }
      first = last;
    }
  }

  void check_path(const Bond& bond, const Path& path, Groups& others, Groups& all) {
    for (std::size_t k = 1; k < path.size(); ++k) {
      if (others.find(path[k - 1].m1) == others.find(path[k].m0)) continue;
      issues_.push_back(seam_issue(spec(bond.seam), "chain_order", fmt::format("one edge ends on {}, the next begins on {}: they share no corner, and no other seam joins them", mark_text(path[k - 1].m1), mark_text(path[k].m0)),
                                   "name the edges in their order along the seam, in its direction; edges that only lie side by side are sewn each by a seam of its own"));
      return;
    }
    std::map<int, int> seen;
    const auto list = points(path);
    const bool ring = all.find(list.front().in) == all.find(list.back().in);
    for (std::size_t k = 0; k + (ring ? 1 : 0) < list.size(); ++k) {
      const auto [it, fresh] = seen.emplace(all.find(list[k].in), list[k].in);
      if (fresh) continue;
      issues_.push_back(seam_issue(spec(bond.seam), "seam_conflict", fmt::format("{} and {} of one side would become one place: the seams contradict each other", mark_text(it->second), mark_text(list[k].in)),
                                   "look for edges that are joined in two ways, or for a seam whose direction is wrong"));
      return;
    }
  }

  /// Marks without a vertex take the nearest one that is free; the others will be put in.
  void adopt() {
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!used_[r]) continue;
      std::vector<std::pair<double, int>> free;  // c and vertex
      std::set<int> taken;
      for (int m : on_run_[r]) taken.insert(marks_[static_cast<std::size_t>(m)].vertex);
      std::vector<double> all;
      for (const auto& v : runs_[r].row) {
        const double c = to_c(static_cast<int>(r), v.s);
        all.push_back(c);
        if (!v.held && !taken.count(v.id)) free.emplace_back(c, v.id);
      }
      std::sort(free.begin(), free.end());
      std::sort(all.begin(), all.end());
      struct Offer {
        long long distance;  // rounded, so that ties are ties
        int mark;
        std::size_t vertex;
      };
      std::vector<Offer> offers;
      for (int m : on_run_[r]) {
        const Mark& mark = marks_[static_cast<std::size_t>(m)];
        if (mark.vertex >= 0) continue;
        const auto after = std::upper_bound(all.begin(), all.end(), mark.c);
        TOILE_CHECK(after != all.begin() && after != all.end(), "mark at {} is off its run", mark.c);
        const double low = *std::prev(after), high = *after;
        for (const double c : {low, high}) {
          const auto v = std::lower_bound(free.begin(), free.end(), std::pair(c, std::numeric_limits<int>::min()));
          if (v == free.end() || v->first != c) continue;
          // Where the two are equally near, the first is taken.
          if (std::abs(c - mark.c) <= 0.5 * (high - low) + same_place) offers.push_back({std::llround(std::abs(c - mark.c) / same_place), m, static_cast<std::size_t>(v - free.begin())});
        }
      }
      std::stable_sort(offers.begin(), offers.end(), [](const Offer& p, const Offer& q) { return p.distance < q.distance; });
      std::vector<char> given(free.size(), 0);
      for (const Offer& offer : offers) {
        Mark& mark = marks_[static_cast<std::size_t>(offer.mark)];
        if (mark.vertex >= 0 || given[offer.vertex]) continue;
        given[offer.vertex] = 1;
        mark.vertex = free[offer.vertex].second;
        mark.vertex_c = free[offer.vertex].first;
        if (!aligned() && !mark.held) mark.c = mark.vertex_c;
      }
    }
  }

  /// Stretches between neighbouring marks of a run, over all runs.
  struct Segment {
    int run = 0, left = 0, right = 0;  ///< marks
    std::vector<PlanRun::Vertex> own;  ///< vertices inside; s holds c
    std::vector<std::pair<double, int>> slots;  ///< c and vertex (-1: new) as they will be, ascending
  };

  void number_segments() {
    first_segment_.assign(runs_.size(), -1);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!used_[r]) continue;
      first_segment_[r] = static_cast<int>(segments_.size());
      const auto& list = on_run_[r];
      for (std::size_t k = 1; k < list.size(); ++k) segments_.push_back({static_cast<int>(r), list[k - 1], list[k], {}, {}});
      std::set<int> taken;
      for (int m : list) taken.insert(marks_[static_cast<std::size_t>(m)].vertex);
      std::vector<PlanRun::Vertex> row = runs_[r].row;
      for (auto& v : row) v.s = to_c(static_cast<int>(r), v.s);
      if (flipped_[r]) std::reverse(row.begin(), row.end());
      // A vertex is right of a mark if it comes after the mark's own vertex, or lies beyond a mark that has none.
      std::size_t mark = 0;
      for (std::size_t k = 0; k < row.size(); ++k) {
        while (mark + 1 < list.size()) {
          const Mark& next = marks_[static_cast<std::size_t>(list[mark + 1])];
          const double at = next.vertex >= 0 ? next.vertex_c : next.c;
          if (mark + 2 == list.size() || at > row[k].s) break;
          ++mark;
        }
        if (k == 0 || k + 1 == row.size() || taken.count(row[k].id)) continue;
        segments_[static_cast<std::size_t>(first_segment_[r]) + mark].own.push_back(row[k]);
      }
    }
  }

  int segment_between(int m0, int m1) const {
    const int run = marks_[static_cast<std::size_t>(m0)].run;
    const auto& list = on_run_[static_cast<std::size_t>(run)];
    const auto p = std::find(list.begin(), list.end(), m0) - list.begin(), q = std::find(list.begin(), list.end(), m1) - list.begin();
    TOILE_CHECK(marks_[static_cast<std::size_t>(m1)].run == run && std::abs(p - q) == 1, "marks {} and {} are no neighbours", m0, m1);
    return first_segment_[static_cast<std::size_t>(run)] + static_cast<int>(std::min(p, q));
  }

  /// A segment as a member of the stretches that are sewn together.
  struct Member {
    int segment = 0;
    bool reversed = false;  ///< runs against the first one
  };

  /// Groups segments that seams lay on each other; the order within a group is that in which the seams name them.
  void join_segments() {
    struct Link {
      int a, b;
      bool opposite;
      int bond;
    };
    std::vector<Link> links;
    std::map<std::pair<int, int>, int> joined;
    std::vector<int> order;  // first mention
    std::vector<char> mentioned(segments_.size(), 0), backwards(segments_.size(), 0);
    for (std::size_t b = 0; b < bonds_.size(); ++b) {
      const Bond& bond = bonds_[b];
      for (std::size_t k = 1; k < bond.knots.size(); ++k) {
        std::array<int, 2> segment{};
        std::array<bool, 2> back{};
        for (std::size_t side = 0; side < 2; ++side) {
          const int m0 = bond.knots[k - 1][side].out, m1 = bond.knots[k][side].in;
          segment[side] = segment_between(m0, m1);
          back[side] = segments_[static_cast<std::size_t>(segment[side])].left != m0;
          const auto at = static_cast<std::size_t>(segment[side]);
          if (!mentioned[at]) mentioned[at] = 1, backwards[at] = back[side], order.push_back(segment[side]);
        }
        const auto fail = [&](const std::string& code, const std::string& what) {
          issues_.push_back(seam_issue(spec(bond.seam), code, what, "a stretch of an edge meets another one once: give ranges that do not overlap"));
        };
        if (segment[0] == segment[1]) {
          fail("sewn_twice", fmt::format("{} is sewn to itself", mark_text(bond.knots[k - 1][0].out)));
          return;
        }
        const auto [it, fresh] = joined.emplace(std::minmax(segment[0], segment[1]), static_cast<int>(b));
        if (!fresh) {
          fail("sewn_twice", fmt::format("the stretches beginning on {} and {} are sewn together by seam {} already", mark_text(bond.knots[k - 1][0].out), mark_text(bond.knots[k - 1][1].out), spec(bonds_[static_cast<std::size_t>(it->second)].seam).name));
          return;
        }
        links.push_back({segment[0], segment[1], back[0] != back[1], static_cast<int>(b)});
      }
    }
    std::vector<std::vector<std::pair<int, bool>>> beside(segments_.size());
    for (const Link& link : links) {
      beside[static_cast<std::size_t>(link.a)].emplace_back(link.b, link.opposite);
      beside[static_cast<std::size_t>(link.b)].emplace_back(link.a, link.opposite);
    }
    std::vector<int> rank(segments_.size(), -1), group(segments_.size(), -1);
    for (std::size_t k = 0; k < order.size(); ++k) rank[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
    std::vector<char> reversed(segments_.size(), 0);
    for (int start : order) {
      if (group[static_cast<std::size_t>(start)] >= 0) continue;
      const int id = static_cast<int>(groups_.size());
      auto& members = groups_.emplace_back();
      std::vector<int> waiting{start};
      group[static_cast<std::size_t>(start)] = id;
      reversed[static_cast<std::size_t>(start)] = backwards[static_cast<std::size_t>(start)];
      while (!waiting.empty()) {
        const int s = waiting.back();
        waiting.pop_back();
        members.push_back({s, reversed[static_cast<std::size_t>(s)] != 0});
        for (const auto& [other, opposite] : beside[static_cast<std::size_t>(s)]) {
          const auto at = static_cast<std::size_t>(other);
          const char turned = static_cast<char>(reversed[static_cast<std::size_t>(s)] != static_cast<char>(opposite));
          if (group[at] < 0) {
            group[at] = id;
            reversed[at] = turned;
            waiting.push_back(other);
          } else if (reversed[at] != turned) {
            const Segment& segment = segments_[at];
            issues_.push_back({"seam_conflict", {.item = run_name(segment.run)}, fmt::format("the stretch from {} to {} is sewn to itself backwards by way of other edges", mark_text(segment.left), mark_text(segment.right)), "check the directions of the seams of this edge", Category::check});
            return;
          }
        }
      }
      std::sort(members.begin(), members.end(), [&](const Member& p, const Member& q) { return rank[static_cast<std::size_t>(p.segment)] < rank[static_cast<std::size_t>(q.segment)]; });
    }
  }

  double c_of(int mark) const { return marks_[static_cast<std::size_t>(mark)].c; }

  /// Where a vertex inside a segment lies once the ends have come to their places: near them it follows.
  double followed(const Segment& segment, double c) const {
    if (!aligned()) return c;
    const Mark &left = marks_[static_cast<std::size_t>(segment.left)], &right = marks_[static_cast<std::size_t>(segment.right)];
    const double c0 = left.vertex >= 0 ? left.vertex_c : left.c, c1 = right.vertex >= 0 ? right.vertex_c : right.c;
    const double reach = std::min(fade * cell(segment.run), c1 - c0);
    return c + (left.c - c0) * std::max(0.0, 1 - (c - c0) / reach) + (right.c - c1) * std::max(0.0, 1 - (c1 - c) / reach);
  }

  void fill_segments() {
    std::vector<char> grouped(segments_.size(), 0);
    for (const auto& members : groups_) {
      // Relative places, ends included, of each member in the direction of the first.
      std::vector<std::vector<double>> t(members.size());
      std::size_t most = 0;
      for (std::size_t m = 0; m < members.size(); ++m) {
        const Segment& segment = segments_[static_cast<std::size_t>(members[m].segment)];
        grouped[static_cast<std::size_t>(members[m].segment)] = 1;
        const double c0 = c_of(segment.left), length = c_of(segment.right) - c0;
        t[m].push_back(0);
        for (const auto& v : segment.own) t[m].push_back((followed(segment, v.s) - c0) / length);
        t[m].push_back(1);
        if (members[m].reversed) {
          std::reverse(t[m].begin(), t[m].end());
          for (double& at : t[m]) at = 1 - at;
        }
        most = std::max(most, t[m].size());
      }
      std::vector<double> common(most, 0);
      double finest = 0;
      for (std::size_t m = 0; m < members.size(); ++m) {
        if (t[m].size() != most || (!aligned() && finest > 0)) continue;
        for (std::size_t k = 0; k < most; ++k) common[k] += t[m][k];
        ++finest;
      }
      for (double& at : common) at /= finest;
      common.front() = 0;
      common.back() = 1;
      for (std::size_t m = 0; m < members.size(); ++m) {
        Segment& segment = segments_[static_cast<std::size_t>(members[m].segment)];
        const std::vector<int> pairs = best_pairs(t[m], common);
        std::vector<double> place = common;
        std::vector<int> vertex(most, -1);
        const auto own = [&](std::size_t i) { return segment.own[members[m].reversed ? segment.own.size() - 1 - i : i]; };
        for (std::size_t i = 1; i + 1 < t[m].size(); ++i) {
          vertex[static_cast<std::size_t>(pairs[i])] = own(i - 1).id;
          if (!aligned()) place[static_cast<std::size_t>(pairs[i])] = t[m][i];
        }
        if (!aligned()) {
          // New ones lie between the old ones as their partners do between theirs.
          for (std::size_t i = 1; i < t[m].size(); ++i) {
            const auto p = static_cast<std::size_t>(pairs[i - 1]), q = static_cast<std::size_t>(pairs[i]);
            for (std::size_t k = p + 1; k < q; ++k) place[k] = place[p] + (place[q] - place[p]) * (common[k] - common[p]) / (common[q] - common[p]);
          }
        }
        const double c0 = c_of(segment.left), length = c_of(segment.right) - c0;
        for (std::size_t k = 1; k + 1 < most; ++k) {
          const std::size_t at = members[m].reversed ? most - 1 - k : k;
          segment.slots.emplace_back(c0 + length * (members[m].reversed ? 1 - place[at] : place[at]), vertex[at]);
        }
      }
    }
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      if (grouped[s]) continue;
      for (const auto& v : segments_[s].own) segments_[s].slots.emplace_back(followed(segments_[s], v.s), v.id);
    }
  }

  std::vector<std::vector<PlanSlot>> rows() {
    std::vector<std::vector<PlanSlot>> result(runs_.size());
    mark_slot_.assign(marks_.size(), -1);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!used_[r]) continue;
      auto& row = result[r];
      const int run = static_cast<int>(r);
      const auto& list = on_run_[r];
      std::map<int, double> old;
      for (const auto& v : runs_[r].row) old.emplace(v.id, v.s);
      for (std::size_t k = 0; k < list.size(); ++k) {
        const Mark& mark = marks_[static_cast<std::size_t>(list[k])];
        mark_slot_[static_cast<std::size_t>(list[k])] = static_cast<int>(row.size());
        const bool end = k == 0 || k + 1 == list.size();  // on a closed run one vertex stands at both
        row.push_back({mark.vertex, end || mark.vertex < 0 ? to_s(run, mark.vertex_c) : old.at(mark.vertex), to_s(run, mark.c)});
        if (k + 1 == list.size()) continue;
        for (const auto& [c, vertex] : segments_[static_cast<std::size_t>(first_segment_[r]) + k].slots) row.push_back({vertex, vertex >= 0 ? old.at(vertex) : 0, to_s(run, c)});
      }
      if (flipped_[r]) {
        std::reverse(row.begin(), row.end());
        for (int m : list) mark_slot_[static_cast<std::size_t>(m)] = static_cast<int>(row.size()) - 1 - mark_slot_[static_cast<std::size_t>(m)];
      }
      for (PlanSlot& slot : row) {
        if (slot.vertex >= 0 && std::abs(slot.s - slot.s_before) < 1e-12) slot.s = slot.s_before;
      }
      std::size_t known = 0;
      for (std::size_t k = 1; k < row.size(); ++k) {
        if (row[k].s < row[k - 1].s + 1e-6) {
          issues_.push_back({"seam_conflict", {.item = run_name(run)}, fmt::format("particles would come together at {:.2f} mm: places that must stay come in another order on edges that are sewn together", row[k].s * 1e3), "declare match points, or give the panels cells of similar size", Category::check});
          return result;
        }
        if (row[k].vertex < 0) continue;
        for (std::size_t i = known + 1; i < k; ++i) row[i].s_before = row[known].s_before + (row[k].s_before - row[known].s_before) * (row[i].s - row[known].s) / (row[k].s - row[known].s);
        known = k;
      }
    }
    return result;
  }

  std::vector<PlanBond> planned_bonds(const std::vector<std::vector<PlanSlot>>& rows) const {
    std::vector<PlanBond> result;
    for (const Bond& bond : bonds_) {
      PlanBond planned;
      planned.seam = bond.seam;
      planned.side = bond.side;
      const SeamSides& seam = seams_[static_cast<std::size_t>(bond.seam)];
      SeamReport& report = planned.report;
      report.name = seam_row_name(*seam.spec, bond.side);
      report.length_a = seam.lengths[0];
      report.length_b = seam.lengths[static_cast<std::size_t>(bond.side)];
      report.allowed = bond.allowed;
      for (std::size_t k = 1; k < bond.knots.size(); ++k) {
        const double a = bond.knots[k][0].along - bond.knots[k - 1][0].along, b = bond.knots[k][1].along - bond.knots[k - 1][1].along;
        report.steepest = std::max({report.steepest, a / b, b / a});
      }
      for (std::size_t side = 0; side < 2; ++side) {
        auto& nodes = planned.nodes[side];
        const auto add = [&](std::initializer_list<std::array<int, 2>> places) {
          PlanNode node;
          for (const auto& place : places) {
            const PlanSlot& slot = rows[static_cast<std::size_t>(place[0])][static_cast<std::size_t>(place[1])];
            const bool known = std::any_of(node.at.begin(), node.at.end(), [&](const auto& other) { return slot.vertex >= 0 && rows[static_cast<std::size_t>(other[0])][static_cast<std::size_t>(other[1])].vertex == slot.vertex; });
            if (!known && (node.at.empty() || node.at.front() != place)) node.at.push_back(place);
          }
          nodes.push_back(std::move(node));
        };
        for (std::size_t k = 0; k < bond.knots.size(); ++k) {
          const PathPoint& point = bond.knots[k][side];
          const auto place = [&](int mark) { return std::array<int, 2>{marks_[static_cast<std::size_t>(mark)].run, mark_slot_[static_cast<std::size_t>(mark)]}; };
          add({place(point.in), place(point.out)});
          if (k + 1 == bond.knots.size()) continue;
          const std::array<int, 2> from = place(point.out), to = place(bond.knots[k + 1][side].in);
          const int step = from[1] < to[1] ? 1 : -1;
          for (int slot = from[1] + step; slot != to[1]; slot += step) add({{from[0], slot}});
        }
        for (const PlanNode& node : nodes) {
          for (const auto& [run, slot] : node.at) {
            const PlanSlot& s = rows[static_cast<std::size_t>(run)][static_cast<std::size_t>(slot)];
            if (s.vertex < 0) ++report.added;
            else report.farthest_slide = std::max(report.farthest_slide, std::abs(s.s - s.s_before));
          }
        }
      }
      TOILE_CHECK(planned.nodes[0].size() == planned.nodes[1].size(), "{} places on {}", planned.nodes[0].size(), planned.nodes[1].size());
      report.pairs = static_cast<int>(planned.nodes[0].size());
      result.push_back(std::move(planned));
    }
    return result;
  }

  const GarmentMesh& garment_;
  const std::vector<PlanRun>& runs_;
  const std::vector<SeamSides>& seams_;
  const SewParams& params_;
  std::vector<char> used_, flipped_;
  std::vector<Mark> marks_;
  std::vector<std::vector<int>> on_run_;  ///< marks of each run, by c
  std::map<std::pair<int, double>, int> required_;  ///< what require() said
  std::vector<Bond> bonds_;
  std::vector<Segment> segments_;
  std::vector<int> first_segment_;
  std::vector<std::vector<Member>> groups_;
  std::vector<int> mark_slot_;
  Issues issues_;
  Issues notes_;
};

}  // namespace

Result<SeamPlan> plan_seams(const GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<const SeamSpec*>& specs, const SewParams& params) {
  ResolvedSides resolved = resolve_sides(garment, runs, specs);
  append(resolved.issues, check_sides(garment, runs, resolved.seams, params));
  if (!resolved.issues.empty()) return resolved.issues;
  return Planner(garment, runs, resolved.seams, params).plan();
}

}  // namespace toile::tailor
