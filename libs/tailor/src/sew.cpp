#include "toile/tailor/sew.h"

#include "local_mesh.h"
#include "pairing.h"
#include "run_curve.h"

#include "toile/base/text.h"
#include "toile/mesh/topology.h"
#include "toile/tailor/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

constexpr double always_allowed = 5e-4;  ///< length difference that never matters [m]

struct ChainRun {
  int run = 0;
  bool reversed = false;
};

/// A seam with its names resolved.
struct Seam {
  const SeamSpec* spec = nullptr;
  std::array<std::vector<ChainRun>, 2> sides;
  std::vector<std::array<int, 2>> match;  ///< vertices on a and b
};

/// A place along a chain: one vertex, or two where one run ends and the next begins.
struct Node {
  double s = 0;  ///< from the chain's start [m]
  std::vector<int> vertices;
  int run = -1;          ///< run and its own arc length, where the node is inside one
  double run_s = 0;
  bool held = true;      ///< must stay where it is
  bool new_vertex = false;
};

Issue seam_issue(const SeamSpec& seam, std::string code, std::string what, std::string remedy) {
  return Issue{std::move(code), {.item = "seam " + seam.name}, std::move(what), std::move(remedy), Category::check};
}

/// The garment while it is being sewn. Positions are in cells of each panel.
class Table {
 public:
  explicit Table(const GarmentMesh& garment) : garment_(garment), held_(static_cast<std::size_t>(garment.vertex_count()), 0) {
    mesh_.vertices.resize(static_cast<std::size_t>(garment.vertex_count()));
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      panel_.push_back(garment.vertex_panel[v]);
      mesh_.vertices[static_cast<std::size_t>(v)].p = in_cells(static_cast<int>(v), garment.uv.row(v));
    }
    mesh_.triangles.resize(static_cast<std::size_t>(garment.face_count()));
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) mesh_.triangles[static_cast<std::size_t>(f)] = {garment.faces(f, 0), garment.faces(f, 1), garment.faces(f, 2)};
    build_stars(mesh_);
    rows_.resize(garment.runs.size());
    sewn_by_.resize(garment.runs.size());
    for (const auto& row : garment.run_vertices) rows_[static_cast<std::size_t>(row.run)].emplace_back(row.s, row.vertex);
    std::vector<int> uses(mesh_.vertices.size(), 0);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      auto& row = rows_[r];
      for (std::size_t k = 0; k < row.size(); ++k) {
        const int v = row[k].second;
        mesh_.vertices[v].mobility = Mobility::fixed;
        if (++uses[v] > 1 || k == 0 || k + 1 == row.size()) held_[v] = 1;
        if (garment.runs[r].internal && k > 0) mesh_.constraints.emplace(std::min(v, row[k - 1].second), std::max(v, row[k - 1].second));
      }
      std::vector<double> s;
      std::vector<Point> p;
      for (const auto& [at, v] : row) s.push_back(at), p.push_back(garment.uv.row(v));
      curves_.emplace_back(s, p);
      for (std::size_t k = 0; k < row.size(); ++k) {
        if (curves_.back().corner(k)) held_[row[k].second] = 1;
      }
    }
    // A point that is only named may slide along its edge by part of a cell; a match point may not (see join()).
    for (const auto& point : garment.points) mesh_.vertices[point.vertex].mobility = Mobility::fixed;
    // Border vertices that belong to no run (there should be none) stay too.
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = garment.faces(f, k), b = garment.faces(f, (k + 1) % 3);
        int count = 0;
        if (mesh_.vertices[a].mobility == Mobility::free && mesh_.stars[a].size() < 4) {
          for (int t : mesh_.stars[a]) count += std::count(mesh_.triangles[t].begin(), mesh_.triangles[t].end(), b);
          if (count == 1) mesh_.vertices[a].mobility = Mobility::fixed;
        }
      }
    }
  }

  Point in_cells(int vertex, const Point& uv) const {
    const auto& panel = garment_.panels[static_cast<std::size_t>(panel_[vertex])];
    return {uv.x() / weft(panel), uv.y() / warp(panel)};
  }
  Point in_metres(int vertex) const {
    const auto& panel = garment_.panels[static_cast<std::size_t>(panel_[vertex])];
    const Point& p = mesh_.vertices[vertex].p;
    return {p.x() * weft(panel), p.y() * warp(panel)};
  }
  static double weft(const mesh::Panel& panel) { return panel.cell_weft > 0 ? panel.cell_weft : 0.01; }
  static double warp(const mesh::Panel& panel) { return panel.cell_warp > 0 ? panel.cell_warp : 0.01; }
  double reference(int run) const {
    const auto& panel = garment_.panels[static_cast<std::size_t>(garment_.runs[run].panel)];
    return std::sqrt(weft(panel) * warp(panel));
  }

  std::vector<Node> chain(const std::vector<ChainRun>& runs) const {
    std::vector<Node> nodes;
    double start = 0;
    for (const ChainRun& part : runs) {
      std::vector<std::pair<double, int>> row = rows_[part.run];
      const double length = garment_.runs[part.run].length;
      if (part.reversed) {
        std::reverse(row.begin(), row.end());
        for (auto& [s, v] : row) s = length - s;
      }
      for (std::size_t k = 0; k < row.size(); ++k) {
        const auto [s, v] = row[k];
        if (k == 0 && !nodes.empty()) {
          Node& joint = nodes.back();
          if (joint.vertices.front() != v) joint.vertices.push_back(v);
          joint.held = true;
          continue;
        }
        nodes.push_back({start + s, {v}, part.run, part.reversed ? length - s : s, held_[v] != 0, false});
      }
      start += length;
    }
    return nodes;
  }

  /// Moves a vertex of a run to arc length s of the run; its position follows in apply_slides(). Returns how far.
  double slide(int run, int vertex, double s) {
    for (auto& [at, v] : rows_[run]) {
      if (v != vertex) continue;
      const double from = at;
      ways_.push_back({run, vertex, from, s});
      at = s;
      return std::abs(s - from);
    }
    return 0;
  }
  void hold(int vertex) { held_[vertex] = 1; }
  /// Seam that has sewn a run already, if any.
  const std::string* sewn_by(int run) const { return sewn_by_[run].empty() ? nullptr : &sewn_by_[run]; }
  void set_sewn(int run, const std::string& seam) {
    if (sewn_by_[run].empty()) sewn_by_[run] = seam;
  }

  /// New vertex between two neighbours of a run, for now halfway between them; slide() gives it its place.
  int insert(int run, int a, int b) {
    LocalVertex vertex;
    vertex.p = 0.5 * (mesh_.vertices[a].p + mesh_.vertices[b].p);
    vertex.mobility = Mobility::fixed;
    const int v = split_edge(mesh_, a, b, vertex);
    panel_.push_back(panel_[a]);
    held_.push_back(0);
    auto& row = rows_[run];
    const auto at = [&](int id) { return std::find_if(row.begin(), row.end(), [&](const auto& r) { return r.second == id; }) - row.begin(); };
    // On a closed run its first vertex stands at both ends of the row.
    auto ia = at(a), ib = at(b);
    if (std::abs(ia - ib) != 1) (ia < ib ? ia : ib) = static_cast<std::ptrdiff_t>(row.size()) - 1;
    const auto place = std::max(ia, ib);
    row.insert(row.begin() + place, {0.5 * (row[place].first + row[place - 1].first), v});
    return v;
  }

  /// Carries out the slides in steps of at most a quarter of a cell, setting the triangles right after each.
  void apply_slides() {
    int steps = 1;
    for (const Way& way : ways_) steps = std::max(steps, static_cast<int>(std::ceil(4 * std::abs(way.to - way.from) / reference(way.run))));
    ImproveOptions options;
    options.may_split_border = false;
    for (const Way& way : ways_) options.around.push_back(way.vertex);
    if (options.around.empty()) return;
    for (int step = 1; step <= steps; ++step) {
      for (const Way& way : ways_) {
        const double s = step == steps ? way.to : way.from + (way.to - way.from) * step / steps;
        mesh_.vertices[way.vertex].p = in_cells(way.vertex, curves_[way.run].at(s));
      }
      options.target = step == steps ? 20 : 10;
      options.may_insert = options.may_remove = step == steps;
      improve(mesh_, options);
    }
    ways_.clear();
    // Vertices that improve() put in belong to the panel of those around them.
    std::vector<int> waiting;
    for (std::size_t v = panel_.size(); v < mesh_.vertices.size(); ++v) waiting.push_back(static_cast<int>(v));
    panel_.resize(mesh_.vertices.size(), -1);
    held_.resize(mesh_.vertices.size(), 0);
    while (!waiting.empty()) {
      std::vector<int> later;
      for (int v : waiting) {
        for (int t : mesh_.stars[v]) {
          for (int w : mesh_.triangles[t]) panel_[v] = std::max(panel_[v], panel_[w]);
        }
        if (panel_[v] < 0 && !mesh_.stars[v].empty()) later.push_back(v);
      }
      TOILE_CHECK(later.size() < waiting.size(), "{} vertices belong to no panel", later.size());
      waiting = std::move(later);
    }
  }

  bool has_turned_over(int& vertex) const {
    for (const Triple& t : mesh_.triangles) {
      if (t[0] >= 0 && smallest_angle(mesh_.vertices[t[0]].p, mesh_.vertices[t[1]].p, mesh_.vertices[t[2]].p) <= 0) {
        vertex = t[0];
        return true;
      }
    }
    return false;
  }

  const LocalMesh& mesh() const { return mesh_; }
  const std::vector<std::vector<std::pair<double, int>>>& rows() const { return rows_; }
  const std::vector<int>& panels() const { return panel_; }

 private:
  struct Way {
    int run, vertex;
    double from, to;  ///< arc length
  };
  const GarmentMesh& garment_;
  LocalMesh mesh_;
  std::vector<int> panel_;
  std::vector<char> held_;
  std::vector<std::vector<std::pair<double, int>>> rows_;  ///< arc length and vertex, per run
  std::vector<RunCurve> curves_;
  std::vector<std::string> sewn_by_;
  std::vector<Way> ways_;
};

/// Splits "panel.edge" or "-panel.edge".
struct Reference {
  bool reversed = false;
  std::string panel, item;
};
std::optional<Reference> parse_reference(const std::string& text) {
  Reference reference;
  std::string_view rest = trim(text);
  if (!rest.empty() && rest.front() == '-') reference.reversed = true, rest = trim(rest.substr(1));
  const auto dot = rest.find('.');
  if (dot == std::string_view::npos || dot == 0 || dot + 1 == rest.size()) return std::nullopt;
  reference.panel = rest.substr(0, dot);
  reference.item = rest.substr(dot + 1);
  return reference;
}

Result<int> find_point(const GarmentMesh& garment, const std::string& text) {
  const auto reference = parse_reference(text);
  if (!reference || reference->reversed) return Issue{"bad_reference", {}, fmt::format("'{}' is not panel.point", text), "write the panel's name, a dot, the point's name"};
  TOILE_TRY(const int panel, mesh::find_panel(garment, reference->panel));
  std::vector<std::string> names;
  for (const auto& point : garment.points) {
    if (point.panel != panel) continue;
    if (point.name == reference->item) return point.vertex;
    names.push_back(point.name);
  }
  return Issue{"unknown_point", {}, fmt::format("panel '{}' has no point '{}'", reference->panel, reference->item), suggestion(reference->item, names)};
}

Result<std::vector<Seam>> resolve(const GarmentMesh& garment, const std::vector<const SeamSpec*>& specs) {
  Issues issues;
  std::vector<Seam> seams;
  for (const SeamSpec* spec : specs) {
    Seam seam;
    seam.spec = spec;
    const auto complain = [&](Issue issue) {
      issue.place.item = "seam " + spec->name;
      issues.push_back(std::move(issue));
    };
    if (!seams.empty() && seams.back().spec->name == spec->name) complain({"duplicate_name", {}, "two seams have this name", "rename one"});
    std::set<int> used;
    for (int side = 0; side < 2; ++side) {
      const auto& list = side == 0 ? spec->a : spec->b;
      if (list.empty()) complain({"empty_seam", {}, fmt::format("side {} names no edge", side == 0 ? "a" : "b"), "name at least one: panel.edge"});
      for (const std::string& text : list) {
        const auto reference = parse_reference(text);
        if (!reference) {
          complain({"bad_reference", {}, fmt::format("'{}' is not panel.edge", text), "write the panel's name, a dot, the edge's name; '-' before it runs it backwards"});
          continue;
        }
        const auto panel = mesh::find_panel(garment, reference->panel);
        if (!panel) {
          complain(panel.issues().front());
          continue;
        }
        const auto run = mesh::find_run(garment, *panel, reference->item);
        if (!run) {
          complain(run.issues().front());
          continue;
        }
        if (!used.insert(*run).second) complain({"same_edge", {}, fmt::format("edge '{}' occurs twice", text), "a seam joins different edges; split the edge in the pattern"});
        seam.sides[static_cast<std::size_t>(side)].push_back({*run, reference->reversed});
      }
    }
    for (const MatchPoint& match : spec->match) {
      const auto a = find_point(garment, match.a), b = find_point(garment, match.b);
      if (!a) complain(a.issues().front());
      if (!b) complain(b.issues().front());
      if (a && b) seam.match.push_back({*a, *b});
    }
    seams.push_back(std::move(seam));
  }
  if (!issues.empty()) return issues;
  return seams;
}

double chain_length(const GarmentMesh& garment, const std::vector<ChainRun>& runs) {
  double length = 0;
  for (const ChainRun& part : runs) length += garment.runs[static_cast<std::size_t>(part.run)].length;
  return length;
}

std::string side_text(const std::vector<std::string>& side) { return fmt::format("{}", fmt::join(side, " ")); }

/// +1 where the run goes counter-clockwise round the cloth (the cloth on its left), -1 the other way, 0 for inner lines.
int direction(const LocalMesh& mesh, const std::vector<std::pair<double, int>>& row, bool internal) {
  if (internal) return 0;
  const int a = row[0].second, b = row[1].second;
  for (int t : mesh.stars[a]) {
    const Triple& v = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (v[k] == a && v[(k + 1) % 3] == b) return 1;
      if (v[k] == b && v[(k + 1) % 3] == a) return -1;
    }
  }
  return 0;
}

/// Lengths and directions of all seams, before anything is done.
Issues check_seams(const GarmentMesh& garment, const Table& table, const std::vector<Seam>& seams, const SewParams& params) {
  Issues issues;
  for (const Seam& seam : seams) {
    const SeamSpec& spec = *seam.spec;
    const double a = chain_length(garment, seam.sides[0]), b = chain_length(garment, seam.sides[1]);
    const double tolerance = std::max({always_allowed, std::min(params.tolerance * std::max(a, b), params.tolerance_max), spec.ease.value_or(0)});
    if (std::abs(a - b) > tolerance * (1 + 1e-9)) {
      issues.push_back(seam_issue(spec, "seam_length",
                                  fmt::format("{} is {:.2f} mm, {} is {:.2f} mm: they differ by {:.2f} mm, {:.2f} mm are allowed", side_text(spec.a), a * 1e3, side_text(spec.b), b * 1e3, std::abs(a - b) * 1e3, tolerance * 1e3),
                                  fmt::format("declare `ease: {:.2f} mm` if it is meant, otherwise correct the pattern", std::ceil(std::abs(a - b) * 1e5) / 100)));
    }
    std::array<int, 2> sense{0, 0};
    bool mixed = false;
    for (std::size_t side = 0; side < 2; ++side) {
      for (const ChainRun& part : seam.sides[side]) {
        int own = direction(table.mesh(), table.rows()[static_cast<std::size_t>(part.run)], garment.runs[static_cast<std::size_t>(part.run)].internal);
        if (part.reversed) own = -own;
        if (own == 0) continue;
        if (sense[side] != 0 && sense[side] != own) {
          const auto& run = garment.runs[static_cast<std::size_t>(part.run)];
          issues.push_back(seam_issue(spec, "twisted_seam", fmt::format("edge {}.{} runs against the others of its side", garment.panels[static_cast<std::size_t>(run.panel)].name, run.name), "put '-' before it, or take it away"));
          mixed = true;
        }
        sense[side] = own;
      }
    }
    if (!mixed && sense[0] != 0 && sense[0] == sense[1]) {
      issues.push_back(seam_issue(spec, "twisted_seam", "the two sides run the same way round their panels: the cloth would be twisted by half a turn",
                                  "run one side backwards: '-' before each of its edges, in reverse order"));
    }
  }
  return issues;
}

/// One place of a finished seam: a node of each side, and where it comes to lie.
struct Place {
  int a = -1, b = -1;     ///< nodes; -1: to be put in
  double base = 0;        ///< relative arc length before places that are held have their say
};

/// Inserts what the coarser side lacks, slides to common relative arc lengths, and returns the pairs of vertices.
Result<std::vector<std::array<int, 2>>> join(Table& table, const GarmentMesh& garment, const Seam& seam, const SewParams& params, SeamReport& report) {
  const SeamSpec& spec = *seam.spec;
  std::array<std::vector<Node>, 2> nodes{table.chain(seam.sides[0]), table.chain(seam.sides[1])};
  const std::array<double, 2> length{chain_length(garment, seam.sides[0]), chain_length(garment, seam.sides[1])};
  const auto relative = [&](int side, int node) { return nodes[static_cast<std::size_t>(side)][static_cast<std::size_t>(node)].s / length[static_cast<std::size_t>(side)]; };

  // Match points cut the seam into stretches.
  std::vector<std::array<int, 2>> stations{{0, 0}};
  std::vector<std::array<int, 2>> between;
  for (const auto& match : seam.match) {
    std::array<int, 2> at{-1, -1};
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t k = 0; k < nodes[side].size(); ++k) {
        if (std::count(nodes[side][k].vertices.begin(), nodes[side][k].vertices.end(), match[side])) at[side] = static_cast<int>(k);
      }
    }
    if (at[0] < 0 || at[1] < 0) return seam_issue(spec, "bad_match", "a match point is not on its side of the seam", "name points on the edges that are sewn");
    for (std::size_t side = 0; side < 2; ++side) nodes[side][static_cast<std::size_t>(at[side])].held = true;
    between.push_back(at);
  }
  std::sort(between.begin(), between.end());
  for (const auto& at : between) {
    if (at == stations.back()) continue;
    stations.push_back(at);
  }
  const std::array<int, 2> last{static_cast<int>(nodes[0].size()) - 1, static_cast<int>(nodes[1].size()) - 1};
  if (stations.back() != last) stations.push_back(last);
  for (std::size_t k = 1; k < stations.size(); ++k) {
    if (stations[k][0] <= stations[k - 1][0] || stations[k][1] <= stations[k - 1][1]) return seam_issue(spec, "bad_match", "the match points come in another order on the two sides", "check their names and the sewing direction");
  }

  std::vector<Place> places{{0, 0, 0}};
  for (std::size_t k = 1; k < stations.size(); ++k) {
    std::array<std::vector<double>, 2> t;
    for (int side = 0; side < 2; ++side) {
      const double t0 = relative(side, stations[k - 1][side]), t1 = relative(side, stations[k][side]);
      for (int node = stations[k - 1][side]; node <= stations[k][side]; ++node) t[side].push_back((relative(side, node) - t0) / (t1 - t0));
    }
    const double from = static_cast<double>(k - 1), count = static_cast<double>(stations.size() - 1);
    const int coarse = t[0].size() <= t[1].size() ? 0 : 1, fine = 1 - coarse;
    const std::vector<int> pairs = best_pairs(t[coarse], t[fine]);
    const bool equal = t[0].size() == t[1].size();
    std::size_t next = 1;
    for (int j = 1; j < static_cast<int>(t[fine].size()); ++j) {
      const bool paired = next < pairs.size() && pairs[next] == j;
      std::array<int, 2> node{-1, -1};
      node[fine] = stations[k - 1][fine] + j;
      double base = t[fine][j];
      if (paired) {
        node[coarse] = stations[k - 1][coarse] + static_cast<int>(next);
        if (equal) base = 0.5 * (t[0][j] + t[1][j]);
        ++next;
      }
      places.push_back({node[0], node[1], (from + base) / count});
    }
  }

  // Where each side's places come to lie: held nodes stay, the stretches between them follow in proportion.
  std::array<std::vector<double>, 2> target;
  const auto is_held = [&](int side, const Place& place) {
    const int node = side == 0 ? place.a : place.b;
    return node >= 0 && nodes[static_cast<std::size_t>(side)][static_cast<std::size_t>(node)].held;
  };
  const bool slide = params.matching == Matching::aligned;
  std::vector<std::size_t> anchors;
  for (std::size_t p = 0; p < places.size(); ++p) {
    const bool paired = places[p].a >= 0 && places[p].b >= 0;
    if (p == 0 || p + 1 == places.size() || is_held(0, places[p]) || is_held(1, places[p]) || (!slide && paired)) anchors.push_back(p);
  }
  for (const auto& station : stations) {
    for (std::size_t p = 0; p < places.size(); ++p) {
      if (places[p].a == station[0] && places[p].b == station[1]) anchors.push_back(p);
    }
  }
  std::sort(anchors.begin(), anchors.end());
  anchors.erase(std::unique(anchors.begin(), anchors.end()), anchors.end());
  for (int side = 0; side < 2; ++side) {
    auto& own = target[static_cast<std::size_t>(side)];
    own.assign(places.size(), 0);
    const auto anchor_t = [&](std::size_t p) {
      const int node = side == 0 ? places[p].a : places[p].b, other = side == 0 ? places[p].b : places[p].a;
      if (node >= 0 && (is_held(side, places[p]) || !slide)) return relative(side, node);
      if (other >= 0 && (is_held(1 - side, places[p]) || !slide)) return relative(1 - side, other);
      return places[p].base;
    };
    for (std::size_t k = 0; k < anchors.size(); ++k) own[anchors[k]] = anchor_t(anchors[k]);
    for (std::size_t k = 1; k < anchors.size(); ++k) {
      const std::size_t p0 = anchors[k - 1], p1 = anchors[k];
      if (own[p1] <= own[p0]) return seam_issue(spec, "seam_conflict", fmt::format("places that must stay come in another order on the two sides near {}", place_text(garment, nodes[0][places[p0].a >= 0 ? places[p0].a : 0].vertices.front())), "declare match points, or give the panels cells of similar size");
      for (std::size_t p = p0 + 1; p < p1; ++p) own[p] = own[p0] + (own[p1] - own[p0]) * (places[p].base - places[p0].base) / (places[p1].base - places[p0].base);
    }
  }

  // Put in, slide, pair up.
  std::vector<std::array<std::vector<int>, 2>> joined(places.size());
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<double> starts;
    double start = 0;
    for (const ChainRun& part : seam.sides[side]) starts.push_back(start), start += garment.runs[static_cast<std::size_t>(part.run)].length;
    for (std::size_t p = 0; p < places.size(); ++p) {
      const int node_id = side == 0 ? places[p].a : places[p].b;
      const double s = target[side][p] * length[side];
      if (node_id >= 0) {
        const Node& node = nodes[side][static_cast<std::size_t>(node_id)];
        joined[p][side] = node.vertices;
        if (node.held || !slide) continue;
        const auto part = std::find_if(seam.sides[side].begin(), seam.sides[side].end(), [&](const ChainRun& r) { return r.run == node.run; });
        const double run_start = starts[static_cast<std::size_t>(part - seam.sides[side].begin())], run_length = garment.runs[static_cast<std::size_t>(node.run)].length;
        report.farthest_slide = std::max(report.farthest_slide, table.slide(node.run, node.vertices.front(), part->reversed ? run_length - (s - run_start) : s - run_start));
        continue;
      }
      // The next old node along this side tells the run.
      std::size_t q = p + 1;
      while ((side == 0 ? places[q].a : places[q].b) < 0) ++q;
      const Node& after = nodes[side][static_cast<std::size_t>(side == 0 ? places[q].a : places[q].b)];
      const auto part = std::find_if(seam.sides[side].begin(), seam.sides[side].end(), [&](const ChainRun& r) { return r.run == after.run; });
      const double run_start = starts[static_cast<std::size_t>(part - seam.sides[side].begin())], run_length = garment.runs[static_cast<std::size_t>(after.run)].length;
      // At a joint of two runs the vertex before belongs to this run if it is the second of the node.
      const int before_vertex = joined[p - 1][side].back(), after_vertex = after.vertices.front();
      const auto& rows = table.rows()[static_cast<std::size_t>(after.run)];
      const auto in_run = [&](int v) { return std::any_of(rows.begin(), rows.end(), [&](const auto& row) { return row.second == v; }); };
      TOILE_CHECK(in_run(before_vertex) && in_run(after_vertex), "vertices {} and {} are not both of run {}", before_vertex, after_vertex, after.run);
      if (const std::string* other = table.sewn_by(after.run)) {
        const auto& run = garment.runs[static_cast<std::size_t>(after.run)];
        return seam_issue(spec, "seam_conflict", fmt::format("edge {}.{} is sewn in seam {} already and would need more particles", garment.panels[static_cast<std::size_t>(run.panel)].name, run.name, *other),
                          "give the panels that share this edge cells of the same size");
      }
      const int v = table.insert(after.run, before_vertex, after_vertex);
      table.slide(after.run, v, part->reversed ? run_length - (s - run_start) : s - run_start);
      joined[p][side] = {v};
      ++report.added;
    }
  }
  std::vector<std::array<int, 2>> welds;
  for (auto& place : joined) {
    for (int a : place[0]) {
      for (int b : place[1]) {
        if (a != b) welds.push_back({a, b});
      }
    }
    for (const auto& side : place) {
      for (int v : side) table.hold(v);
    }
  }
  for (const auto& side : seam.sides) {
    for (const ChainRun& part : side) table.set_sewn(part.run, spec.name);
  }
  report.length_a = length[0];
  report.length_b = length[1];
  report.pairs = static_cast<int>(places.size());
  return welds;
}

/// What welding must not do to the surface.
Issues check_surface(const GarmentMesh& garment) {
  Issues issues;
  const mesh::Ids particle = mesh::particles(garment);
  const mesh::Triangles faces = mesh::mapped(garment.faces, particle);
  std::vector<char> welded(static_cast<std::size_t>(particle.size() ? particle.maxCoeff() + 1 : 0), 0);
  std::map<int, std::string> seam_of;
  for (const auto& weld : garment.welds) {
    welded[particle[weld.a]] = 1;
    seam_of.emplace(particle[weld.a], garment.seams[static_cast<std::size_t>(weld.seam)].name);
  }
  const auto item = [&](int id) { return "seam " + seam_of[id]; };
  std::map<std::array<int, 3>, Eigen::Index> seen;
  constexpr std::size_t enough = 20;
  for (Eigen::Index f = 0; f < faces.rows() && issues.size() < enough; ++f) {
    std::array<int, 3> v{faces(f, 0), faces(f, 1), faces(f, 2)};
    if (!welded[v[0]] && !welded[v[1]] && !welded[v[2]]) continue;
    const int place = garment.faces(f, 0);
    bool flat = false;
    for (int k = 0; k < 3; ++k) {
      if (v[k] != v[(k + 1) % 3]) continue;
      flat = true;
      issues.push_back({"degenerate_face", {.item = item(v[k])}, fmt::format("it closes a triangle of panel {} to nothing", place_text(garment, place)), "use smaller cells there, or end the seam before the corner", Category::check});
      break;
    }
    if (flat) continue;
    const int any = welded[v[0]] ? v[0] : welded[v[1]] ? v[1] : v[2];
    std::sort(v.begin(), v.end());
    const auto [twin, fresh] = seen.emplace(v, f);
    if (!fresh) issues.push_back({"folded_panel", {.item = item(any)}, fmt::format("it lays a triangle of panel {} onto one of panel {}", place_text(garment, place), place_text(garment, garment.faces(twin->second, 0))), "check the edges of the seam, or use smaller cells there", Category::check});
  }
  return issues;
}

}  // namespace

Result<Sewn> sew(const GarmentMesh& garment, const SewParams& params) {
  Issues issues;
  if (!garment.vertex_columns.empty() || !garment.face_columns.empty()) issues.push_back({"unsupported_columns", {}, "the garment has columns of later stages", "sew before the stages that add them"});
  if (!garment.laminates.empty()) issues.push_back({"already_layered", {}, "the garment has layers already", "sew before toile-layer"});
  if (!garment.welds.empty()) issues.push_back({"already_sewn", {}, "the garment is sewn already", "list all seams in one spec"});
  std::vector<Eigen::Vector3d> offset(garment.panels.size());
  std::vector<char> known(garment.panels.size(), 0);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    const std::size_t p = static_cast<std::size_t>(garment.vertex_panel[v]);
    const Eigen::Vector3d own = garment.x.row(v).transpose() - Eigen::Vector3d(garment.uv(v, 0), garment.uv(v, 1), 0);
    if (!known[p]) offset[p] = own, known[p] = 1;
    else if ((own - offset[p]).norm() > 1e-6) {
      issues.push_back({"not_flat", {.item = garment.panels[p].name}, "the panel does not lie flat", "sew before the garment is placed"});
      break;
    }
  }
  if (!issues.empty()) return issues;

  std::vector<const SeamSpec*> specs;
  for (const SeamSpec& spec : params.seams) specs.push_back(&spec);
  std::sort(specs.begin(), specs.end(), [](const SeamSpec* a, const SeamSpec* b) { return a->name < b->name; });
  TOILE_TRY(const std::vector<Seam> seams, resolve(garment, specs));
  Table table(garment);
  issues = check_seams(garment, table, seams, params);
  if (!issues.empty()) return issues;

  Sewn result;
  std::vector<mesh::Weld> welds;
  for (std::size_t k = 0; k < seams.size(); ++k) {
    SeamReport report;
    report.name = seams[k].spec->name;
    auto pairs = join(table, garment, seams[k], params, report);
    if (!pairs) {
      append(issues, pairs.issues());
      continue;
    }
    for (const auto& [a, b] : *pairs) welds.push_back({a, b, static_cast<int>(k)});
    result.seams.push_back(report);
  }
  if (!issues.empty()) return issues;
  table.apply_slides();
  int turned = 0;
  if (table.has_turned_over(turned)) {
    return Issue{"seam_conflict", {.item = garment.panels[static_cast<std::size_t>(table.panels()[turned])].name}, "the seams of this panel need its border particles moved farther than its grid allows", "use cells of similar size on both sides of its seams", Category::check};
  }

  // Numbering: panel by panel, old vertices in their order, new ones after them.
  const LocalMesh& local = table.mesh();
  std::vector<int> number(local.vertices.size(), -1);
  int next = 0;
  for (std::size_t p = 0; p < garment.panels.size(); ++p) {
    for (std::size_t v = 0; v < local.vertices.size(); ++v) {
      if (table.panels()[v] == static_cast<int>(p) && !local.stars[v].empty()) number[v] = next++;
    }
  }
  GarmentMesh& sewn = result.garment;
  sewn = garment;
  sewn.x.resize(next, 3);
  sewn.uv.resize(next, 2);
  sewn.vertex_panel.resize(next);
  for (std::size_t v = 0; v < local.vertices.size(); ++v) {
    if (number[v] < 0) continue;
    const int panel = table.panels()[v];
    // Untouched vertices keep their coordinates to the last bit.
    const bool old = v < static_cast<std::size_t>(garment.vertex_count()) && local.vertices[v].p == table.in_cells(static_cast<int>(v), garment.uv.row(static_cast<Eigen::Index>(v)));
    const Point uv = old ? Point(garment.uv.row(static_cast<Eigen::Index>(v))) : table.in_metres(static_cast<int>(v));
    sewn.uv.row(number[v]) = uv;
    sewn.x.row(number[v]) = old ? Eigen::RowVector3d(garment.x.row(static_cast<Eigen::Index>(v))) : (Eigen::Vector3d(uv.x(), uv.y(), 0) + offset[static_cast<std::size_t>(panel)]).transpose().eval();
    sewn.vertex_panel[number[v]] = panel;
  }
  std::vector<std::pair<int, Triple>> faces;
  for (const Triple& t : local.triangles) {
    if (t[0] < 0) continue;
    Triple face{number[t[0]], number[t[1]], number[t[2]]};
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    faces.emplace_back(sewn.vertex_panel[face[0]], face);
  }
  std::sort(faces.begin(), faces.end());
  const auto face_count = static_cast<Eigen::Index>(faces.size());
  sewn.faces.resize(face_count, 3);
  sewn.face_panel.resize(face_count);
  sewn.face_laminate = mesh::Ids::Constant(face_count, -1);
  for (Eigen::Index f = 0; f < face_count; ++f) {
    const auto& [panel, t] = faces[static_cast<std::size_t>(f)];
    sewn.faces.row(f) << t[0], t[1], t[2];
    sewn.face_panel[f] = panel;
  }
  sewn.run_vertices.clear();
  for (std::size_t r = 0; r < table.rows().size(); ++r) {
    for (const auto& [s, v] : table.rows()[r]) sewn.run_vertices.push_back({static_cast<int>(r), number[v], s});
  }
  for (auto& point : sewn.points) point.vertex = number[point.vertex];
  std::set<std::pair<int, int>> distinct;
  for (const auto& weld : welds) {
    const int a = number[weld.a], b = number[weld.b];
    if (distinct.insert({std::min(a, b), std::max(a, b)}).second) sewn.welds.push_back({a, b, weld.seam});
  }
  for (std::size_t k = 0; k < seams.size(); ++k) {
    const SeamSpec& spec = *seams[k].spec;
    sewn.seams.push_back({static_cast<int>(k), spec.name, spec.kind, result.seams[k].length_a, result.seams[k].length_b, spec.bending_factor.value_or(params.bending_factor)});
  }
  issues = check_surface(sewn);
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::tailor
