#include "toile/tailor/fasten.h"

#include "line_part.h"
#include "names.h"
#include "pairing.h"

#include "toile/base/text.h"
#include "toile/tailor/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

constexpr double default_stiffness = 500;  ///< [N/m]
constexpr double always_allowed = 5e-4;    ///< length difference of a zip's sides that never matters [m]

double stiffness_of(Treatment treatment, const std::optional<double>& stiffness) { return treatment == Treatment::constraint ? 0 : stiffness.value_or(default_stiffness); }

/// What `open` and `closed` say about the closures. A full name goes before patterns with *.
class Switches {
 public:
  Switches(const FastenParams& params, const std::vector<std::string>& names, Issues& issues) : params_(params), issues_(issues) {
    for (const auto* list : {&params.open, &params.closed}) {
      for (const std::string& pattern : *list) {
        if (pattern == "*" || std::any_of(names.begin(), names.end(), [&](const std::string& name) { return matches(pattern, name); })) continue;
        issues.push_back({"unknown_fastener", {.item = list == &params.open ? "open" : "closed"}, fmt::format("there is no fastener or zip '{}'", pattern), suggestion(pattern, names)});
      }
    }
  }
  std::optional<bool> closed(const std::string& name) const {
    const auto named = [&](const std::vector<std::string>& list) { return std::find(list.begin(), list.end(), name) != list.end(); };
    const auto matched = [&](const std::vector<std::string>& list) { return std::any_of(list.begin(), list.end(), [&](const std::string& pattern) { return matches(pattern, name); }); };
    const bool own_open = named(params_.open), own_closed = named(params_.closed);
    const bool open = own_open || (!own_closed && matched(params_.open)), closed = own_closed || (!own_open && matched(params_.closed));
    if (open && closed) issues_.push_back({"bad_fastener", {.item = "open"}, fmt::format("'{}' would be open and closed", name), "take it out of one of the lists"});
    if (open) return false;
    if (closed) return true;
    return std::nullopt;
  }

 private:
  const FastenParams& params_;
  Issues& issues_;
};

/// A place along one side of a zip.
struct Node {
  double s = 0;  ///< from the bottom [m]
  int vertex = 0;
};
struct Side {
  std::vector<Node> nodes;
  double length = 0;
  int sense = 0;  ///< +1: the cloth lies on its left
};

/// +1 where some face runs a -> b and none b -> a, -1 the other way round, 0 inside the cloth.
int sense_of(const GarmentMesh& garment, int panel, int a, int b) {
  int sense = 0;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    if (garment.face_panel[f] != panel) continue;
    for (int k = 0; k < 3; ++k) {
      const int p = garment.faces(f, k), q = garment.faces(f, (k + 1) % 3);
      if (p == a && q == b) ++sense;
      if (p == b && q == a) --sense;
    }
  }
  return sense;
}

Side side_of(const GarmentMesh& garment, Issues& issues, const std::vector<std::string>& chain, const std::string& item) {
  Side side;
  bool mixed = false;
  for (const std::string& text : chain) {
    const auto parts = find_line(garment, text);
    if (!parts) {
      Issue issue = parts.issues().front();
      issue.place.item = item;
      issues.push_back(issue);
      continue;
    }
    for (const LinePart& line : *parts) {
      if (line.vertices.front() == line.vertices.back()) {
        issues.push_back({"bad_zip", {.item = item}, fmt::format("'{}' closes round: a zip has two ends", text), "name a stretch of it: panel.line(from..to)"});
        continue;
      }
      std::map<int, double> s_of;
      for (const auto& row : garment.run_vertices) {
        if (row.run == line.run) s_of[row.vertex] = row.s;
      }
      const int sense = sense_of(garment, garment.runs[static_cast<std::size_t>(line.run)].panel, line.vertices[0], line.vertices[1]);
      if (sense != 0 && side.sense != 0 && sense != side.sense) mixed = true;
      if (sense != 0) side.sense = sense;
      // Where one edge ends and the next begins there is one place.
      const double start = s_of[line.vertices.front()];
      for (std::size_t k = side.nodes.empty() ? 0 : 1; k < line.vertices.size(); ++k) side.nodes.push_back({side.length + std::abs(s_of[line.vertices[k]] - start), line.vertices[k]});
      side.length = side.nodes.back().s;
    }
  }
  if (mixed) issues.push_back({"bad_zip", {.item = item}, "one of its edges runs against the others of its side", "put '-' before it, or take it away"});
  return side;
}

/// One row a place where teeth of the zip meet on the grid, in order from the bottom.
std::vector<mesh::Fastener> zip_rows(const ZipSpec& spec, const Side& a, const Side& b, const mesh::Ids& particle, double slider, int closure) {
  const std::array<const Side*, 2> sides{&a, &b};
  const std::size_t coarse = a.nodes.size() <= b.nodes.size() ? 0 : 1, fine = 1 - coarse;
  std::array<std::vector<double>, 2> relative;
  for (std::size_t side : {coarse, fine}) {
    for (const Node& node : sides[side]->nodes) relative[side].push_back(node.s / sides[side]->length);
  }
  const std::vector<int> pairs = best_pairs(relative[coarse], relative[fine]);
  struct Row {
    double t;
    std::array<int, 2> vertex;
    int teeth = 0;
  };
  std::vector<Row> rows;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    Row row;
    const auto other = static_cast<std::size_t>(pairs[k]);
    row.vertex[coarse] = sides[coarse]->nodes[k].vertex;
    row.vertex[fine] = sides[fine]->nodes[other].vertex;
    row.t = 0.5 * (relative[coarse][k] + relative[fine][other]);
    // Where the sides are sewn together already there is nothing to close.
    if (particle[row.vertex[0]] != particle[row.vertex[1]]) rows.push_back(row);
  }
  if (rows.empty()) return {};
  const double length = 0.5 * (a.length + b.length);
  const int teeth = std::max(1, static_cast<int>(std::lround(length / spec.pitch)));
  std::size_t nearest = 0;
  for (int k = 0; k < teeth; ++k) {
    const double t = (k + 0.5) / teeth;
    while (nearest + 1 < rows.size() && std::abs(rows[nearest + 1].t - t) < std::abs(rows[nearest].t - t)) ++nearest;
    ++rows[nearest].teeth;
  }
  std::vector<mesh::Fastener> result;
  for (const Row& row : rows) {
    if (row.teeth == 0) continue;
    mesh::Fastener tooth{row.vertex[0], row.vertex[1], mesh::Fastener::Kind::zip};
    tooth.mass = spec.mass * length * row.teeth / teeth;
    tooth.closure = closure;
    tooth.closed = slider > 0 && row.t <= slider + 1e-9;
    tooth.stiffness = row.teeth * stiffness_of(spec.treatment, spec.stiffness);
    tooth.capture = spec.capture;
    result.push_back(tooth);
  }
  return result;
}

}  // namespace

Result<Fastened> fasten(const GarmentMesh& garment, const FastenParams& params) {
  Issues issues;
  Names names(garment, issues);
  Fastened result{garment, 0};
  result.garment.closures.clear();
  result.garment.fasteners.clear();
  std::vector<std::string> own_names;
  const auto add_closure = [&](const std::string& name, const std::string& kind, const std::string& item) {
    if (std::find(own_names.begin(), own_names.end(), name) != own_names.end()) issues.push_back({"duplicate_name", {.item = item}, "two fasteners have this name", "rename one"});
    own_names.push_back(name);
    result.garment.closures.push_back({static_cast<int>(result.garment.closures.size()), name, kind});
    return static_cast<int>(result.garment.closures.size()) - 1;
  };
  std::vector<std::string> all;
  for (const auto& spec : params.fasteners) all.push_back(spec.name);
  for (const auto& spec : params.zips) all.push_back(spec.name);
  const Switches switches(params, all, issues);
  const mesh::Ids particle = mesh::particles(garment);

  for (const FastenerSpec& spec : params.fasteners) {
    const std::string item = "fastener " + spec.name;
    static constexpr std::array kinds{"button", "hook", "snap"};
    const int closure = add_closure(spec.name, kinds[static_cast<std::size_t>(spec.kind)], item);
    const bool closed = switches.closed(spec.name).value_or(spec.closed);
    for (const auto& [a, b] : pairs_of(names, issues, spec.a, spec.b, "bad_fastener", item)) {
      if (particle[a.vertex] == particle[b.vertex]) {
        issues.push_back({"bad_fastener", {.item = item}, fmt::format("its two halves at {} are the same particle", place_text(garment, a.vertex)), "set them farther apart"});
        continue;
      }
      result.farthest_snap = std::max({result.farthest_snap, a.off, b.off});
      result.garment.fasteners.push_back({a.vertex, b.vertex, static_cast<mesh::Fastener::Kind>(static_cast<int>(spec.kind)), spec.mass, spec.length, closure, closed, stiffness_of(spec.treatment, spec.stiffness), spec.capture});
    }
  }
  for (const ZipSpec& spec : params.zips) {
    const std::string item = "zip " + spec.name;
    const int closure = add_closure(spec.name, "zip", item);
    const auto closed = switches.closed(spec.name);
    const double slider = closed ? (*closed ? 1.0 : 0.0) : spec.slider;
    const std::size_t before = issues.size();
    const Side a = side_of(garment, issues, spec.a, item), b = side_of(garment, issues, spec.b, item);
    if (issues.size() > before) continue;
    if (a.nodes.empty() || b.nodes.empty()) {
      issues.push_back({"bad_zip", {.item = item}, fmt::format("side {} names no edge", a.nodes.empty() ? "a" : "b"), "name at least one: panel.edge"});
      continue;
    }
    const double tolerance = std::max({always_allowed, std::min(0.01 * std::max(a.length, b.length), 0.005), spec.ease});
    if (std::abs(a.length - b.length) > tolerance * (1 + 1e-9)) {
      issues.push_back({"bad_zip", {.item = item}, fmt::format("its sides are {:.2f} and {:.2f} mm long: they differ by {:.2f} mm, {:.2f} mm are allowed", a.length * 1e3, b.length * 1e3, std::abs(a.length - b.length) * 1e3, tolerance * 1e3),
                        fmt::format("declare `ease: {:.2f} mm` if it is meant, otherwise correct the edges", std::ceil(std::abs(a.length - b.length) * 1e5) / 100)});
      continue;
    }
    if (a.sense != 0 && a.sense == b.sense) {
      issues.push_back({"bad_zip", {.item = item}, "its two sides run the same way round their panels: the cloth would be twisted by half a turn", "run one side backwards: '-' before each of its edges, in reverse order"});
      continue;
    }
    const auto rows = zip_rows(spec, a, b, particle, slider, closure);
    if (rows.empty()) issues.push_back({"bad_zip", {.item = item}, "its two sides are sewn together already", "take the seam away, or the zip"});
    result.garment.fasteners.insert(result.garment.fasteners.end(), rows.begin(), rows.end());
  }
  if (!issues.empty()) return issues;
  return result;
}

namespace {

bool is_tack(const mesh::Seam& seam) { return seam.kind == "tack" && seam.length_a == 0 && seam.length_b == 0; }

void remove_tacks(GarmentMesh& garment) {
  std::vector<int> number(garment.seams.size(), -1);
  std::vector<mesh::Seam> kept;
  for (mesh::Seam& seam : garment.seams) {
    if (is_tack(seam)) continue;
    number[static_cast<std::size_t>(seam.id)] = static_cast<int>(kept.size());
    seam.id = static_cast<int>(kept.size());
    kept.push_back(std::move(seam));
  }
  garment.seams = std::move(kept);
  std::erase_if(garment.welds, [&](const mesh::Weld& weld) { return number[static_cast<std::size_t>(weld.seam)] < 0; });
  for (auto& weld : garment.welds) weld.seam = number[static_cast<std::size_t>(weld.seam)];
  for (auto& trim : garment.trims) trim.seam = trim.seam < 0 ? -1 : number[static_cast<std::size_t>(trim.seam)];
}

/// Faces that the tacks would close to nothing or lay onto each other.
Issues check_tacks(const GarmentMesh& garment, std::size_t first_weld) {
  Issues issues;
  const mesh::Ids particle = mesh::particles(garment);
  std::map<int, int> seam_of;
  for (std::size_t k = first_weld; k < garment.welds.size(); ++k) seam_of.emplace(particle[garment.welds[k].a], garment.welds[k].seam);
  std::map<std::array<int, 3>, Eigen::Index> seen;
  for (Eigen::Index f = 0; f < garment.face_count() && issues.size() < 20; ++f) {
    std::array<int, 3> corner{particle[garment.faces(f, 0)], particle[garment.faces(f, 1)], particle[garment.faces(f, 2)]};
    const auto tacked = std::find_if(corner.begin(), corner.end(), [&](int p) { return seam_of.count(p) != 0; });
    if (tacked == corner.end()) continue;
    const std::string item = "tack " + garment.seams[static_cast<std::size_t>(seam_of[*tacked])].name, place = place_text(garment, garment.faces(f, 0));
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
      issues.push_back({"degenerate_face", {.item = item}, fmt::format("it closes a triangle of panel {} to nothing", place), "set it farther from the seam, or use smaller cells there", Category::check});
      continue;
    }
    std::sort(corner.begin(), corner.end());
    const auto [twin, fresh] = seen.emplace(corner, f);
    if (!fresh) issues.push_back({"folded_panel", {.item = item}, fmt::format("it lays a triangle of panel {} onto one of panel {}", place, place_text(garment, garment.faces(twin->second, 0))), "set it farther from the seam, or use smaller cells there", Category::check});
  }
  return issues;
}

}  // namespace

Result<Fastened> tack(const GarmentMesh& garment, const std::vector<TackSpec>& tacks) {
  Fastened result{garment, 0};
  remove_tacks(result.garment);
  if (tacks.empty()) return result;
  Issues issues;
  Names names(result.garment, issues);
  std::vector<const TackSpec*> sorted;
  for (const TackSpec& spec : tacks) sorted.push_back(&spec);
  std::sort(sorted.begin(), sorted.end(), [](const TackSpec* a, const TackSpec* b) { return a->name < b->name; });
  std::set<std::string> used;
  for (const auto& seam : result.garment.seams) used.insert(seam.name);
  const std::size_t first_weld = result.garment.welds.size();
  std::vector<mesh::Seam> seams;
  for (const TackSpec* spec : sorted) {
    const std::string item = "tack " + spec->name;
    if (!used.insert(spec->name).second) issues.push_back({"duplicate_name", {.item = item}, "a seam or another tack has this name", "rename it"});
    mesh::Seam seam;
    seam.id = static_cast<int>(result.garment.seams.size() + seams.size());
    seam.name = spec->name;
    seam.kind = "tack";
    if (spec->b.empty()) issues.push_back({"bad_tack", {.item = item}, "it is not said what it is held to", "give as many points under `b` as under `a`"});
    else {
      for (const auto& [a, b] : pairs_of(names, issues, spec->a, spec->b, "bad_tack", item)) {
        const mesh::Ids particle = mesh::particles(result.garment);
        if (particle[a.vertex] == particle[b.vertex]) {
          issues.push_back({"bad_tack", {.item = item}, fmt::format("{} is sewn to it already", place_text(result.garment, a.vertex)), "take this point out"});
          continue;
        }
        result.farthest_snap = std::max({result.farthest_snap, a.off, b.off});
        result.garment.welds.push_back({a.vertex, b.vertex, seam.id});
      }
    }
    seams.push_back(std::move(seam));
  }
  if (!issues.empty()) return issues;
  result.garment.seams.insert(result.garment.seams.end(), seams.begin(), seams.end());
  issues = check_tacks(result.garment, first_weld);
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::tailor
