#include "draft.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "toile/base/text.h"

namespace toile::io {
namespace {

using pattern::Curve;

constexpr double same_place = 1e-3;  // drafts are rounded to 1e-4 mm or better [mm]

std::vector<std::string> run_points(const std::string& run) {
  std::vector<std::string> names;
  for (const std::string& name : split(run, '>')) names.emplace_back(trim(name));
  return names;
}

/// A closed loop of segments whose ends are nodes; node i is where segment i starts.
struct Loop {
  std::vector<Segment> segments;
  std::size_t size() const { return segments.size(); }
  Point2 node(std::size_t i) const { return segments[i].from; }
  Curve curve() const { return Curve(segments); }
};

class PieceImport {
 public:
  /// What to do where the draft does not say enough: ask for it in the spec, or assume it and note so.
  enum class Gaps { error, assume };
  PieceImport(DraftPart part, const ImportPiece& spec, double tolerance, std::string file, Gaps gaps,
              bool y_down)
      : part_(std::move(part)),
        up_(0, y_down ? -1 : 1),
        spec_(spec),
        tolerance_(tolerance * 1e3),
        file_(std::move(file)),
        gaps_(gaps) {}

  Result<pattern::Piece> run(Issues& notes) {
    piece_.name = spec_.name;
    make_points();
    choose_cut();
    std::vector<std::string> wanted = spec_.points;
    if (auto loop = closed_path(spec_.path.empty() ? seam_path() : spec_.path)) {
      for (const std::string& shortcut : spec_.shortcuts) take_shortcut(*loop, shortcut);
      insert_run_points(*loop, spec_.edges);
      piece_.outline = name_edges(*loop, spec_.edges, true);
    }
    for (const auto& [name, hole] : spec_.holes) {
      if (auto loop = closed_path(hole.path)) {
        insert_run_points(*loop, hole.edges);
        piece_.holes.push_back({name, name_edges(*loop, hole.edges, false)});
      }
    }
    if (!issues_.empty()) return issues_;
    for (const ImportSplit& split : spec_.splits) {
      auto result =
          pattern::split_edge(piece_, pattern::LengthUnit::mm, split.edge,
                              {.point = split.point, .distance = split.distance * 1e3}, split.first, split.second);
      if (result)
        piece_ = std::move(*result);
      else
        append(issues_, result.issues());
    }
    for (const std::string& name : spec_.points) {
      if (const Point2* p = part_.find(name))
        piece_.points.try_emplace(final_name(name), *p);
      else
        unknown_point("points", name);
    }
    import_allowances();
    import_grain();
    import_lines(notes);
    import_notches(notes);
    import_buttons(notes);
    if (!issues_.empty()) return issues_;
    append(notes, assumed_);
    round_coordinates();
    return std::move(piece_);
  }

 private:
  /// Points and controls made by splitting get as many digits as drafted ones: 1e-6 mm.
  void round_coordinates() {
    const auto round = [](Point2& p) {
      for (double& value : p) value = std::round(value * 1e6) / 1e6 + 0.0;
    };
    const auto round_segments = [&](std::vector<Segment>& segments) {
      for (Segment& s : segments) round(s.from), round(s.to), round(s.control_1), round(s.control_2);
    };
    for (auto& [name, p] : piece_.points) round(p);
    for (pattern::Edge& edge : piece_.outline) round_segments(edge.segments);
    for (pattern::Hole& hole : piece_.holes) {
      for (pattern::Edge& edge : hole.edges) round_segments(edge.segments);
    }
    for (pattern::InternalLine& line : piece_.lines) round_segments(line.segments);
    for (pattern::Mark& mark : piece_.marks) round(mark.at);
  }
  /// A gap in the draft: an issue, or a note with what is assumed.
  void gap(const char* code, const std::string& what_part, const std::string& what, const std::string& remedy,
           const std::string& assumption) {
    const Place place{.file = file_, .item = spec_.name + "." + what_part};
    if (gaps_ == Gaps::error)
      issues_.push_back(Issue{code, place, what, remedy});
    else
      assumed_.push_back(Issue{code, place, what + ": " + assumption, remedy});
  }
  void report(const char* code, const std::string& what_part, std::string what, std::string remedy) {
    issues_.push_back(Issue{code,
                            {.file = file_, .item = what_part.empty() ? spec_.name : spec_.name + "." + what_part},
                            std::move(what),
                            std::move(remedy)});
  }
  void unknown_point(const std::string& where, const std::string& name) {
    report("unknown_point", where, fmt::format("part '{}' has no point '{}'", part_.name, name),
           suggestion(name, part_.point_names()));
  }
  std::string final_name(const std::string& drafted) const {
    const auto it = spec_.rename.find(drafted);
    if (it != spec_.rename.end()) return it->second;
    std::string name = drafted;
    for (char& c : name) {
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';
    }
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front()))) name = "p" + name;
    return name;
  }

  /// Adds the points that the spec makes; one may be made of another, in any order.
  void make_points() {
    std::map<std::string, ImportPoint> open = spec_.made;
    for (auto it = open.begin(); it != open.end();) {
      if (part_.find(it->first)) {
        report("duplicate_name", it->first, "the draft has a point of this name", "choose another name");
        it = open.erase(it);
      } else {
        ++it;
      }
    }
    for (bool progress = true; progress;) {
      progress = false;
      for (auto it = open.begin(); it != open.end();) {
        const auto& [name, made] = *it;
        const Point2* from = part_.find(made.from);
        const Point2* to = made.to.empty() ? nullptr : part_.find(made.to);
        if (!from || (!made.to.empty() && !to)) {
          ++it;
          continue;
        }
        Point2 p = *from;
        if (made.by) {
          p += Point2((*made.by)[0], (*made.by)[1] * up_.y()) * 1e3;
        } else if (made.fraction) {
          p += *made.fraction * (*to - *from);
        } else if ((*to - *from).norm() > same_place) {
          p += *made.distance * 1e3 * (*to - *from).normalized();
        } else {
          report("bad_point", name, fmt::format("'{}' and '{}' are the same place", made.from, made.to),
                 "name two different points");
        }
        // As many digits as drafted ones have: names find it again where it is used.
        p = Point2((p.array() * 1e6).round() / 1e6);
        part_.points.emplace_back(name, p);
        it = open.erase(it);
        progress = true;
      }
    }
    for (const auto& [name, made] : open) {
      for (const std::string& point : {made.from, made.to}) {
        if (!point.empty() && !part_.find(point) && !open.count(point)) unknown_point(name, point);
        if (open.count(point))
          report("bad_point", name, fmt::format("it is made of '{}', which is not made yet", point),
                 "make it of points that do not depend on it");
      }
    }
  }

  void choose_cut() {
    const DraftPart::Cut* chosen = nullptr;
    for (const DraftPart::Cut& cut : part_.cuts) {
      if (!chosen && (spec_.material.empty() || cut.material == spec_.material)) chosen = &cut;
    }
    piece_.material = spec_.material;
    if (chosen) {
      piece_.material = chosen->material;
      piece_.copies = chosen->copies;
      piece_.identical = chosen->identical;
      on_fold_ = chosen->on_fold;
    } else if (!spec_.material.empty() && !part_.cuts.empty() && !spec_.cut) {
      std::vector<std::string> materials;
      for (const DraftPart::Cut& cut : part_.cuts) materials.push_back(cut.material);
      report("unknown_material", "material",
             fmt::format("the cut list of '{}' has no material '{}'", part_.name, spec_.material),
             suggestion(spec_.material, materials) + "; or say with `cut` how many are cut from it");
    }
    if (spec_.cut) piece_.copies = *spec_.cut;
    if (spec_.identical) piece_.identical = *spec_.identical;
    if (piece_.copies == 1) piece_.identical = false;
  }

  std::string seam_path() const {
    if (part_.path("seam")) return "seam";
    std::vector<std::string> closed;
    for (const std::string& name : part_.drawn) {
      const DraftPath* path = part_.path(name);
      if (name.rfind("sa", 0) != 0 && path->strokes.size() == 1 &&
          (path->strokes[0].front().from - path->strokes[0].back().to).norm() <= same_place)
        closed.push_back(name);
    }
    return closed.size() == 1 ? closed.front() : "seam";
  }

  /// A path of the draft by its name, or one drawn through points: a>b>(c)>(d)>a.
  std::optional<Loop> closed_path(const std::string& name) {
    if (name.find('>') != std::string::npos) {
      const std::vector<Segment> drawn = line_of_run("path", name);
      if (drawn.empty()) return std::nullopt;
      if ((drawn.front().from - drawn.back().to).norm() > same_place) {
        report("bad_run", "path", fmt::format("'{}' does not end where it begins", name), "let its last point be its first");
        return std::nullopt;
      }
      return Loop{drawn};
    }
    const DraftPath* path = part_.path(name);
    if (!path) {
      report("unknown_path", name, fmt::format("part '{}' has no path '{}'", part_.name, name),
             suggestion(name, part_.path_names()));
      return std::nullopt;
    }
    if (path->strokes.size() != 1 || (path->strokes[0].front().from - path->strokes[0].back().to).norm() > same_place) {
      report("bad_draft", name, fmt::format("path '{}' is not one closed line", name), "name a path that is");
      return std::nullopt;
    }
    Loop loop{path->strokes[0]};
    // Ends within rounding become equal; nodes take the place of a drafted point that they carry.
    for (std::size_t i = 0; i < loop.size(); ++i) {
      Point2 node = loop.segments[i].from;
      for (const auto& [id, p] : part_.points) {
        if ((p - node).norm() <= same_place) {
          node = p;
          break;
        }
      }
      loop.segments[i].from = node;
      loop.segments[(i + loop.size() - 1) % loop.size()].to = node;
    }
    return loop;
  }

  std::optional<std::size_t> node_at(const Loop& loop, const Point2& p) const {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      if ((loop.node(i) - p).norm() <= same_place) return i;
    }
    return std::nullopt;
  }

  /// Makes a node of a drafted point that lies on the loop; false if it does not.
  bool insert_node(Loop& loop, const std::string& name, const std::string& where) {
    const Point2* p = part_.find(name);
    if (!p) {
      unknown_point(where, name);
      return false;
    }
    if (node_at(loop, *p)) return true;
    const Curve curve = loop.curve();
    const Curve::Nearest nearest = curve.nearest(*p);
    if (nearest.distance > tolerance_) {
      report("run_off_outline", where,
             fmt::format("point '{}' is {:.4g} mm away from the line", name, nearest.distance),
             "name a point that lies on it, or raise the tolerance");
      return false;
    }
    const auto& starts = curve.segment_starts();
    std::size_t i = 0;
    while (i + 1 < loop.size() && starts[i + 1] <= nearest.s) ++i;
    const auto [a, b] = Curve({loop.segments[i]}).split(nearest.s - starts[i]);
    Segment first = a.segments().front(), second = b.segments().front();
    moved_[name] = first.to;
    loop.segments[i] = first;
    loop.segments.insert(loop.segments.begin() + static_cast<std::ptrdiff_t>(i) + 1, second);
    return true;
  }
  void insert_run_points(Loop& loop, const std::map<std::string, std::string>& edges) {
    for (const auto& [edge, run] : edges) {
      for (const std::string& name : run_points(run)) insert_node(loop, name, edge);
    }
  }
  /// Node of a point named in a run; insert_node has made it.
  std::optional<std::size_t> node_of(const Loop& loop, const std::string& name) const {
    const auto moved = moved_.find(name);
    const Point2* p = moved != moved_.end() ? &moved->second : part_.find(name);
    return p ? node_at(loop, *p) : std::nullopt;
  }

  /// Lines through the points of a run take the place of the outline from its first to its last point.
  void take_shortcut(Loop& loop, const std::string& text) {
    const std::vector<std::string> names = run_points(text);
    if (names.size() < 2) {
      return report("bad_run", "shortcuts", fmt::format("'{}' is no shortcut", text), "write at least two points: a>b");
    }
    std::vector<Point2> corners;
    for (const std::string& name : names) {
      const Point2* p = part_.find(name);
      if (!p) return unknown_point("shortcuts", name);
      corners.push_back(*p);
    }
    if (!insert_node(loop, names.front(), "shortcuts") || !insert_node(loop, names.back(), "shortcuts")) return;
    const std::size_t a = *node_of(loop, names.front()), b = *node_of(loop, names.back());
    if (a == b) {
      return report("bad_run", "shortcuts", fmt::format("'{}' starts and ends at the same point", text),
                    "write two different points: a>b");
    }
    corners.front() = loop.node(a);
    corners.back() = loop.node(b);
    std::vector<Segment> kept;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      kept.push_back(pattern::line_segment(corners[i], corners[i + 1]));
    }
    for (std::size_t i = b; i != a; i = (i + 1) % loop.size()) kept.push_back(loop.segments[i]);
    loop.segments = std::move(kept);
  }

  /// Nodes i0, i1, … of a run on the loop, walking in its direction; empty with an issue if it does not fit.
  std::optional<std::pair<std::size_t, std::size_t>> locate_run(const Loop& loop, const std::string& edge,
                                                                const std::string& run) {
    const std::vector<std::string> names = run_points(run);
    if (names.size() < 2) {
      report("bad_run", edge, fmt::format("'{}' is no run of points", run), "write at least two points: a>b");
      return std::nullopt;
    }
    std::vector<std::size_t> nodes;
    for (const std::string& name : names) {
      const auto node = node_of(loop, name);
      if (!node) return std::nullopt;  // told when it was to be inserted
      nodes.push_back(*node);
    }
    const std::size_t n = loop.size();
    // Steps from the first node to the last when every node between is met in order; 0: it is not.
    const auto walk = [&](const std::vector<std::size_t>& stops) -> std::size_t {
      std::size_t steps = 0;
      for (std::size_t i = 0; i + 1 < stops.size(); ++i)
        steps += (stops[i + 1] + n - stops[i]) % n == 0 ? n : (stops[i + 1] + n - stops[i]) % n;
      return steps <= n && (steps < n || stops.front() == stops.back()) ? steps : 0;
    };
    const std::vector<std::size_t> back(nodes.rbegin(), nodes.rend());
    const std::size_t forwards = walk(nodes), backwards = walk(back);
    if (forwards == 0 && backwards == 0) {
      report("bad_run", edge, fmt::format("the points of '{}' do not follow each other on the outline", run),
             "list them in order");
      return std::nullopt;
    }
    if (forwards == backwards) {
      report("run_ambiguous", edge, fmt::format("'{}' can be walked both ways round", run), "name a point between");
      return std::nullopt;
    }
    const bool along = backwards == 0 || (forwards != 0 && forwards < backwards);
    return along ? std::pair{nodes.front(), forwards} : std::pair{back.front(), backwards};
  }

  std::string node_name(const Point2& p) {
    const auto it =
        std::find_if(piece_.points.begin(), piece_.points.end(), [&](const auto& entry) { return entry.second == p; });
    if (it != piece_.points.end()) return it->first;
    // Names that the spec uses come before others, helpers of the drawing last.
    std::string best;
    int best_rank = 4;
    for (const auto& [name, at] : part_.points) {
      const auto moved = moved_.find(name);
      if (((moved != moved_.end() ? moved->second : at) - p).norm() > same_place) continue;
      const int rank = spec_.rename.count(name)                                                      ? 0
                       : used_.count(name)                                                           ? 1
                       : name.rfind("gridAnchor", 0) == 0 || name == "anchor" || name.front() == '_' ? 3
                                                                                                     : 2;
      if (rank < best_rank) best = name, best_rank = rank;
    }
    std::string name = best.empty() ? "" : final_name(best);
    for (int i = 1; name.empty() || (piece_.points.count(name) && piece_.points[name] != p); ++i)
      name = fmt::format("{}{}", best.empty() ? "p" : final_name(best) + "_", i);
    piece_.points[name] = p;
    return name;
  }

  std::vector<pattern::Edge> name_edges(const Loop& loop, const std::map<std::string, std::string>& runs,
                                        bool is_outline) {
    const std::size_t n = loop.size();
    for (const auto& [edge, run] : runs) {
      for (const std::string& name : run_points(run)) used_.insert(name);
    }
    std::vector<std::string> owner(n);
    std::vector<bool> first(n, false);
    for (const auto& [edge, run] : runs) {
      const auto located = locate_run(loop, edge, run);
      if (!located) continue;
      const auto [start, count] = *located;
      first[start] = true;
      for (std::size_t k = 0; k < count; ++k) {
        std::string& name = owner[(start + k) % n];
        if (!name.empty()) {
          report("edges_overlap", edge,
                 fmt::format("it shares a part of the outline with edge '{}', from '{}'", name,
                             node_name(loop.node((start + k) % n))),
                 "let edges meet at their ends");
          break;
        }
        name = edge;
      }
    }
    if (!issues_.empty()) return {};
    if (is_outline) find_fold(loop, owner, first);
    for (std::size_t i = 0; i < n; ++i) first[i] = first[i] || owner[i].empty();
    // Begin where an edge begins.
    std::size_t begin = 0;
    while (begin < n && !first[begin]) ++begin;
    begin %= n;
    std::vector<pattern::Edge> edges;
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t i = (begin + k) % n;
      const std::string from = node_name(loop.node(i)), to = node_name(loop.segments[i].to);
      if (first[i] || edges.empty()) {
        pattern::Edge edge;
        edge.name = owner[i].empty() ? free_name(from + "_" + to) : owner[i];
        taken_.insert(edge.name);
        edge.from = from;
        edges.push_back(std::move(edge));
      }
      edges.back().to = to;
      edges.back().segments.push_back(loop.segments[i]);
    }
    return edges;
  }
  std::string free_name(const std::string& wanted) const {
    std::string name = wanted;
    for (int i = 2; taken_.count(name) || spec_.edges.count(name); ++i) name = fmt::format("{}_{}", wanted, i);
    return name;
  }

  /// Gives the straight part of the outline on the fold line its name, and the piece its fold.
  void find_fold(const Loop& loop, std::vector<std::string>& owner, std::vector<bool>& first) {
    if (spec_.fold == "none") return;
    const std::size_t n = loop.size();
    if (!spec_.fold.empty() && std::find(owner.begin(), owner.end(), spec_.fold) != owner.end()) {
      piece_.fold = spec_.fold;
      return;
    }
    const bool folded = part_.fold && (on_fold_ || piece_.copies == 1);
    if (!folded) {
      if (!spec_.fold.empty())
        report("unknown_edge", "fold", fmt::format("there is no edge '{}', and the draft has no fold", spec_.fold),
               "name an edge among 'edges', or none");
      return;
    }
    const Point2 a = part_.fold->first, d = (part_.fold->second - a).normalized();
    const auto on_line = [&](const Point2& p) {
      return std::abs(d.x() * (p - a).y() - d.y() * (p - a).x()) <= same_place * 10;
    };
    std::vector<bool> on(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Segment& s = loop.segments[i];
      on[i] = on_line(s.from) && on_line(s.to) && on_line(position(s, 0.31)) && on_line(position(s, 0.72));
    }
    std::size_t start = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (on[i] && !on[(i + n - 1) % n]) start = start == n ? i : start;
    }
    if (start == n) {
      if (!on_fold_) return;
      gap("no_fold_edge", "fold", "the cut list puts the part on the fold, but no edge lies on the fold line",
          "write fold: none and how often it is cut", "cut twice, mirrored, instead");
      if (piece_.copies == 1) piece_.copies = 2;
      return;
    }
    if (!owner[start].empty()) {
      piece_.fold = owner[start];
      return;
    }
    const std::string name = spec_.fold.empty() ? free_name("fold") : spec_.fold;
    first[start] = true;
    for (std::size_t i = start; on[i] && owner[i].empty(); i = (i + 1) % n) owner[i] = name;
    piece_.fold = name;
  }

  void import_grain() {
    std::optional<std::pair<Point2, Point2>> grain;
    if (spec_.grain == "x") {
      grain = {Point2(0, 0), Point2(100, 0)};
    } else if (spec_.grain == "y") {
      grain = {Point2(0, 0), Point2(100 * up_)};
    } else if (spec_.grain == "fold") {
      if (!piece_.fold)
        report("no_fold_edge", "grain", "the grain follows the fold, but the piece has none",
               "name the fold, or another grain");
      return;
    } else if (!spec_.grain.empty()) {
      const std::vector<std::string> names = run_points(spec_.grain);
      if (names.size() != 2)
        return report("bad_run", "grain", fmt::format("'{}' is no grain", spec_.grain),
                      "write x, y, fold or two points a>b");
      for (const std::string& name : names) {
        if (!part_.find(name)) return unknown_point("grain", name);
      }
      grain = {*part_.find(names[0]), *part_.find(names[1])};
    } else if (part_.grain) {
      grain = part_.grain;
      // An arrow has two heads in most drafts: the warp is taken up the page, or to the right.
      const Point2 d = grain->second - grain->first;
      if (d.dot(up_) < 0 || (d.y() == 0 && d.x() < 0)) std::swap(grain->first, grain->second);
    } else {
      if (part_.grain_is_fold && piece_.fold) return;
      gap("grain_missing", "grain", "the draft has no grain line for it", "write grain: x, y, fold or two points a>b",
          "up the page is assumed");
      if (gaps_ == Gaps::error) return;
      grain = {Point2(0, 0), Point2(100 * up_)};
    }
    piece_.grain = pattern::Grain{grain->first, grain->second};
  }

  void import_allowances() {
    if (spec_.allowance) piece_.allowance = *spec_.allowance * 1e3;
    for (const auto& [name, allowance] : spec_.allowances) {
      std::vector<std::string> known;
      pattern::Edge* found = nullptr;
      const auto look = [&](std::vector<pattern::Edge>& edges) {
        for (pattern::Edge& edge : edges) {
          known.push_back(edge.name);
          if (edge.name == name) found = &edge;
        }
      };
      look(piece_.outline);
      for (pattern::Hole& hole : piece_.holes) look(hole.edges);
      if (found)
        found->allowance = allowance * 1e3;
      else
        report("unknown_edge", "allowances", fmt::format("the piece has no edge '{}'", name), suggestion(name, known));
    }
  }

  /// a>b>(c)>d: lines between points, curves where one or two controls stand in brackets between two points.
  std::vector<Segment> line_of_run(const std::string& name, const std::string& run) {
    std::vector<Segment> segments;
    std::optional<Point2> last;
    std::vector<Point2> controls;
    const auto malformed = [&](const std::string& what) {
      report("bad_run", name, fmt::format("'{}': {}", run, what), "write a>b, or a>(c)>b or a>(c)>(d)>b for a curve");
      return std::vector<Segment>{};
    };
    for (const std::string& word : run_points(run)) {
      const bool control = word.size() > 2 && word.front() == '(' && word.back() == ')';
      const std::string point = control ? word.substr(1, word.size() - 2) : word;
      const Point2* p = part_.find(point);
      if (!p) {
        unknown_point(name, point);
        return {};
      }
      if (control) {
        controls.push_back(*p);
        if (!last) return malformed("it begins with a control");
        if (controls.size() > 2) return malformed("there are more than two controls between two points");
        continue;
      }
      if (last && controls.empty()) segments.push_back(pattern::line_segment(*last, *p));
      if (last && controls.size() == 1) segments.push_back(pattern::quadratic_segment(*last, controls[0], *p));
      if (last && controls.size() == 2) segments.push_back(pattern::cubic_segment(*last, controls[0], controls[1], *p));
      controls.clear();
      last = *p;
    }
    if (!controls.empty()) return malformed("it ends with a control");
    if (segments.empty()) return malformed("it is no line");
    return segments;
  }

  void import_lines(Issues& notes) {
    for (const auto& [name, line] : spec_.lines) {
      std::vector<std::vector<Segment>> strokes;
      if (!line.run.empty()) {
        strokes.push_back(line_of_run(name, line.run));
      } else if (const DraftPath* path = part_.path(line.path)) {
        strokes = path->strokes;
      } else {
        report("unknown_path", name, fmt::format("part '{}' has no path '{}'", part_.name, line.path),
               suggestion(line.path, part_.path_names()));
        continue;
      }
      int number = 1;
      for (std::vector<Segment>& stroke : strokes) {
        if (stroke.empty()) continue;
        // Ends within rounding of a point of the piece are this point.
        for (const auto& [point, at] : piece_.points) {
          if ((at - stroke.front().from).norm() <= same_place) stroke.front().from = at;
          if ((at - stroke.back().to).norm() <= same_place) stroke.back().to = at;
        }
        const Curve whole(stroke);
        double length = 0;
        for (const Curve& part : on_cloth(whole)) {
          piece_.lines.push_back({number == 1 ? name : fmt::format("{}_{}", name, number), line.kind, part.segments()});
          length += part.length();
          ++number;
        }
        if (length < whole.length() - same_place)
          notes.push_back(Issue{"line_cut",
                                {.file = file_, .item = spec_.name + "." + name},
                                fmt::format("{:.4g} of {:.4g} mm of the line lie off the cloth and are left out",
                                            whole.length() - length, whole.length()),
                                ""});
      }
      if (number == 1 && !strokes.empty() && !strokes.front().empty())
        report("line_outside", name, "the line does not lie on the cloth", "leave it out, or choose another");
    }
  }

  /// The parts of a line that lie on the cloth; new ends lie on the border.
  std::vector<Curve> on_cloth(const Curve& line) const {
    std::vector<Curve> parts = cut_by(line, piece_.outline, Side::inside);
    for (const pattern::Hole& hole : piece_.holes) {
      std::vector<Curve> kept;
      for (const Curve& part : parts) {
        for (Curve& rest : cut_by(part, hole.edges, Side::outside)) kept.push_back(std::move(rest));
      }
      parts = std::move(kept);
    }
    return parts;
  }

  enum class Side { inside, outside };
  static std::vector<Curve> cut_by(const Curve& line, const std::vector<pattern::Edge>& edges, Side keep) {
    constexpr double step = 0.5, precision = 1e-6;  // [mm]
    std::vector<Segment> segments;
    for (const pattern::Edge& edge : edges) segments.insert(segments.end(), edge.segments.begin(), edge.segments.end());
    const Curve border(segments);
    const std::vector<Point2> loop = border.polyline(1e-4);
    // What lies on the border stays.
    const auto stays = [&](double s) {
      const Point2 p = line.point_at(s);
      return (std::abs(winding(loop, p)) > 3) == (keep == Side::inside) || border.nearest(p).distance <= same_place;
    };
    const auto steps = static_cast<std::size_t>(std::ceil(line.length() / step));
    std::vector<double> changes;
    const bool starts = stays(0);
    bool state = starts;
    for (std::size_t i = 1; i <= steps; ++i) {
      double before = line.length() * static_cast<double>(i - 1) / static_cast<double>(steps);
      double after = line.length() * static_cast<double>(i) / static_cast<double>(steps);
      if (stays(after) == state) continue;
      while (after - before > precision) {
        const double middle = (before + after) / 2;
        (stays(middle) == state ? before : after) = middle;
      }
      changes.push_back((before + after) / 2);
      state = !state;
    }
    if (starts) changes.insert(changes.begin(), 0);
    if (state) changes.push_back(line.length());
    std::vector<Curve> kept;
    for (std::size_t i = 0; i + 1 < changes.size(); i += 2) {
      if (changes[i + 1] - changes[i] <= step) continue;
      std::vector<Segment> part = line.part(changes[i], changes[i + 1]).segments();
      if (changes[i] > 0) part.front().from = border.nearest(part.front().from).point;
      if (changes[i + 1] < line.length()) part.back().to = border.nearest(part.back().to).point;
      kept.emplace_back(std::move(part));
    }
    return kept;
  }

  /// Angle by which a closed polyline goes round a point [rad].
  static double winding(const std::vector<Point2>& loop, const Point2& p) {
    double sum = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2 a = loop[i] - p, b = loop[(i + 1) % loop.size()] - p;
      sum += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    }
    return sum;
  }

  std::string drafted_name(const Point2& p, const std::string& otherwise) const {
    for (const auto& [name, at] : part_.points) {
      if ((at - p).norm() <= same_place && name.front() != '_') return final_name(name);
    }
    return otherwise;
  }
  template <class Items>
  static std::string unused(const Items& items, const std::string& wanted) {
    std::string name = wanted;
    const auto taken = [&](const std::string& n) {
      return std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == n; });
    };
    for (int i = 2; taken(name); ++i) name = fmt::format("{}_{}", wanted, i);
    return name;
  }

  void import_notches(Issues& notes) {
    for (const auto& [name, notch] : spec_.notches) {
      pattern::Notch n{.name = name, .edge = notch.edge, .fraction = notch.fraction};
      if (notch.distance) n.distance = *notch.distance * 1e3;
      if (notch.point) {
        const Point2* p = part_.find(*notch.point);
        if (!p) {
          unknown_point(name, *notch.point);
          continue;
        }
        n.point = piece_.points.try_emplace(final_name(*notch.point), *p).first->first;
      }
      piece_.notches.push_back(std::move(n));
    }
    for (const Point2& at : part_.notches) {
      const std::string name = drafted_name(at, "notch");
      const pattern::Edge* best = nullptr;
      double distance = tolerance_;
      const auto look = [&](const std::vector<pattern::Edge>& edges) {
        for (const pattern::Edge& edge : edges) {
          const Curve::Nearest nearest = Curve(edge.segments).nearest(at);
          if (nearest.distance <= distance && (!best || nearest.distance < distance))
            best = &edge, distance = nearest.distance;
        }
      };
      look(piece_.outline);
      for (const pattern::Hole& hole : piece_.holes) look(hole.edges);
      if (best) {
        const std::string point = piece_.points.try_emplace(name, at).first->first;
        piece_.notches.push_back({.name = unused(piece_.notches, name), .edge = best->name, .point = point});
      } else if (on_piece(at)) {
        piece_.marks.push_back({unused(piece_.marks, name), pattern::MarkKind::drill, at});
      } else {
        notes.push_back(Issue{"notch_left_out",
                              {.file = file_, .item = spec_.name + "." + name},
                              fmt::format("the notch at ({:.6g}, {:.6g}) is not on the piece", at.x(), at.y()),
                              ""});
      }
    }
  }

  void import_buttons(Issues& notes) {
    for (const auto& [def, at] : part_.buttons) {
      const pattern::MarkKind kind = def.rfind("buttonhole", 0) == 0 ? pattern::MarkKind::buttonhole
                                     : def.rfind("snap", 0) == 0     ? pattern::MarkKind::snap
                                                                     : pattern::MarkKind::button;
      const std::string name = drafted_name(at, "button") + (kind == pattern::MarkKind::buttonhole ? "_hole" : "");
      if (on_piece(at))
        piece_.marks.push_back({unused(piece_.marks, name), kind, at});
      else
        notes.push_back(Issue{"button_left_out",
                              {.file = file_, .item = spec_.name + "." + name},
                              fmt::format("the {} at ({:.6g}, {:.6g}) is not on the piece", def, at.x(), at.y()),
                              ""});
    }
  }

  bool on_piece(const Point2& p) const {
    double winding = 0;
    for (const pattern::Edge& edge : piece_.outline) {
      const Curve curve(edge.segments);
      if (curve.nearest(p).distance <= tolerance_) return true;
      Point2 last = curve.from() - p;
      for (const Point2& point : curve.polyline(0.05)) {
        const Point2 next = point - p;
        winding += std::atan2(last.x() * next.y() - last.y() * next.x(), last.dot(next));
        last = next;
      }
    }
    return std::abs(winding) > 1;
  }

  DraftPart part_;
  Point2 up_;  // the page
  const ImportPiece& spec_;
  double tolerance_;  // [mm]
  std::string file_;
  pattern::Piece piece_;
  Gaps gaps_;
  Issues issues_, assumed_;
  bool on_fold_ = false;
  std::set<std::string> used_, taken_;
  std::map<std::string, Point2> moved_;  // drafted points that were moved onto the line
};

}  // namespace

Result<ImportedPattern> import_pattern(std::string_view json, const std::string& file, const ImportParams& params) {
  const std::string remedy =
      "give a FreeSewing draft as samples/patterns/freesewing/draft.mjs writes it, or a GarmentCode specification";
  Draft draft;
  Issues notes;
  try {
    const ordered_json root = ordered_json::parse(json);
    const bool garmentcode = root.is_object() && root.contains("pattern");
    draft = garmentcode ? read_garmentcode(root, notes) : read_freesewing(root);
  } catch (const ordered_json::parse_error& e) {
    const auto before = json.substr(0, std::min(json.size(), e.byte > 0 ? e.byte - 1 : 0));
    const int line = static_cast<int>(std::count(before.begin(), before.end(), '\n')) + 1;
    const std::size_t newline = before.rfind('\n');
    const int column =
        static_cast<int>(newline == std::string_view::npos ? before.size() : before.size() - newline - 1) + 1;
    const Place place{.file = file, .line = line, .column = column};
    return Issue{"bad_json", place, "the file is no JSON from here on",
                 "write it again with the program it comes from"};
  } catch (const ordered_json::exception& e) {
    return Issue{"bad_draft", {.file = file}, e.what(), remedy};
  } catch (const Malformed& e) {
    return Issue{"bad_draft", {.file = file}, e.what(), remedy};
  }
  auto imported = import_draft(draft, file, params);
  if (!imported) return imported;
  for (Issue& note : notes) note.place.file = file;
  imported->notes.insert(imported->notes.begin(), notes.begin(), notes.end());
  return imported;
}

namespace {

/// The stitches of a draft as a seam spec of toile-sew; those whose segments are no edges of the pattern become notes.
std::string seam_spec(const Draft& draft, const std::vector<ImportPiece>& specs, const pattern::Pattern& pattern,
                      const std::string& file, Issues& notes) {
  std::string text = draft.stitches.empty() ? "seams: []\n" : "seams:\n";
  int number = 0;
  for (const Draft::Stitch& stitch : draft.stitches) {
    std::array<std::string, 2> names;
    std::array<double, 2> lengths{};
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t i = 0; i < specs.size(); ++i) {
        if (specs[i].part != stitch.part[side]) continue;
        for (const pattern::Edge& edge : pattern.pieces[i].outline) {
          const auto& [a, b] = stitch.ends[side];
          if (edge.segments.size() != 1 || !((edge.from == a && edge.to == b) || (edge.from == b && edge.to == a)))
            continue;
          names[side] = pattern.pieces[i].name + "." + edge.name;
          lengths[side] = Curve(edge.segments).length();
        }
      }
    }
    ++number;
    if (names[0].empty() || names[1].empty()) {
      notes.push_back(Issue{"stitch_left_out",
                            {.file = file, .item = fmt::format("stitch {}", number)},
                            fmt::format("its segments {}.{}-{} and {}.{}-{} are no edges of the pattern",
                                        stitch.part[0], stitch.ends[0].first, stitch.ends[0].second, stitch.part[1],
                                        stitch.ends[1].first, stitch.ends[1].second),
                            ""});
      continue;
    }
    text += fmt::format("  - {{name: s{}, a: [{}], b: [\"{}{}\"]", number, names[0], stitch.same_direction ? "" : "-",
                        names[1]);
    if (stitch.part[0] == stitch.part[1]) text += ", kind: dart";
    if (stitch.same_direction) text += ", same_direction: true";
    // Rounded up to a tenth of a millimetre; whoever drew the stitch meant the difference.
    const double ease = std::ceil(std::abs(lengths[0] - lengths[1]) * 10 - 1e-6) / 10;
    if (ease > 0) text += fmt::format(", ease: {} mm", format_number(ease));
    text += "}\n";
  }
  return text;
}

}  // namespace

Result<ImportedPattern> import_draft(const Draft& draft, const std::string& file, const ImportParams& params) {
  Issues issues;
  ImportedPattern result;
  result.pattern.name = params.name.empty() ? draft.design : params.name;
  result.pattern.origin = params.origin.empty() ? draft.origin : params.origin;
  result.pattern.units = pattern::LengthUnit::mm;
  result.pattern.y_down = draft.y_down;

  std::vector<ImportPiece> pieces = params.pieces;
  if (pieces.empty()) {
    for (const DraftPart& part : draft.parts) {
      ImportPiece piece;
      piece.part = part.name;
      piece.name = part.name.substr(part.name.rfind('.') == std::string::npos ? 0 : part.name.rfind('.') + 1);
      pieces.push_back(piece);
    }
  }
  std::vector<std::string> known;
  for (const DraftPart& part : draft.parts) known.push_back(part.name);
  for (ImportPiece& spec : pieces) {
    const auto part =
        std::find_if(draft.parts.begin(), draft.parts.end(), [&](const DraftPart& p) { return p.name == spec.part; });
    if (part == draft.parts.end()) {
      issues.push_back(Issue{"unknown_part",
                             {.file = file, .item = spec.name},
                             fmt::format("the draft has no part '{}'", spec.part),
                             suggestion(spec.part, known)});
      continue;
    }
    if (spec.edges.empty() && spec.shortcuts.empty()) spec.edges = part->edges;
    const auto gaps = params.pieces.empty() ? PieceImport::Gaps::assume : PieceImport::Gaps::error;
    auto piece = PieceImport(*part, spec, params.tolerance, file, gaps, draft.y_down).run(result.notes);
    if (piece)
      result.pattern.pieces.push_back(std::move(*piece));
    else
      append(issues, piece.issues());
  }
  if (!issues.empty()) return issues;
  issues = pattern::check(result.pattern);
  for (Issue& issue : issues) issue.place.file = file;
  if (!issues.empty()) return issues;
  if (!draft.stitches.empty()) result.seams = seam_spec(draft, pieces, result.pattern, file, result.notes);
  return result;
}

}  // namespace toile::io
