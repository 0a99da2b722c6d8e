#include "toile/tailor/fold.h"

#include "line_part.h"

#include "toile/base/text.h"
#include "toile/tailor/quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;
using mesh::Hinge;
using Vertices = std::vector<int>;

constexpr double flat_angle = 1e-7;  ///< hinges flatter than this are left out [rad]

/// A triangle's side, with the corner opposite to it. It runs a -> b in its triangle.
struct Side {
  int a = 0, b = 0;  ///< vertex ids
  int face = 0, opposite = 0;
};

/// Sides of triangles by the ids of their ends (vertices or particles), in either direction.
class Sides {
 public:
  /// Only sides both of whose ends are wanted.
  Sides(const GarmentMesh& garment, const mesh::Ids& id, const std::vector<char>& wanted) {
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = garment.faces(f, k), b = garment.faces(f, (k + 1) % 3);
        if (wanted[static_cast<std::size_t>(id[a])] && wanted[static_cast<std::size_t>(id[b])]) rows_.push_back({key(id[a], id[b]), {a, b, static_cast<int>(f), garment.faces(f, (k + 2) % 3)}});
      }
    }
    std::sort(rows_.begin(), rows_.end(), [](const Row& p, const Row& q) { return std::tie(p.ends, p.side.face) < std::tie(q.ends, q.side.face); });
  }
  std::vector<Side> at(int a, int b) const {
    std::vector<Side> found;
    const Row probe{key(a, b), {0, 0, -1, 0}};
    for (auto row = std::lower_bound(rows_.begin(), rows_.end(), probe, [](const Row& p, const Row& q) { return std::tie(p.ends, p.side.face) < std::tie(q.ends, q.side.face); }); row != rows_.end() && row->ends == probe.ends; ++row) found.push_back(row->side);
    return found;
  }
  /// visit(sides at one edge) in the order of the ends' ids.
  template <class Visit>
  void each_edge(const Visit& visit) const {
    std::vector<Side> sides;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      sides.push_back(rows_[k].side);
      if (k + 1 < rows_.size() && rows_[k + 1].ends == rows_[k].ends) continue;
      visit(sides);
      sides.clear();
    }
  }

 private:
  static std::pair<int, int> key(int a, int b) { return {std::min(a, b), std::max(a, b)}; }
  struct Row {
    std::pair<int, int> ends;
    Side side;
  };
  std::vector<Row> rows_;
};

/// A fold with its lines found.
struct Line {
  std::string name;  ///< as the spec gives it
  int panel = 0;
  bool internal = false;
  Vertices vertices;
};

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Where vertices lie across a line: t, the signed distance (positive to its left), and the line's direction there.
struct Across {
  double t = 0;
  bool beyond = false;  ///< past an end of the line that is inside the panel
  bool near = false;    ///< closer than the margin
};

class Band {
 public:
  /// Precondition: at least two different vertices.
  Band(std::vector<Eigen::Vector2d> points, bool closed, std::array<bool, 2> goes_on, double margin) : points_(std::move(points)), closed_(closed), goes_on_(goes_on), margin_(margin) {
    constexpr std::size_t run = 16;
    for (std::size_t first = 0; first + 1 < points_.size(); first += run) {
      Eigen::AlignedBox2d box;
      for (std::size_t k = first; k <= std::min(first + run, points_.size() - 1); ++k) box.extend(points_[k]);
      boxes_.push_back({first, std::min(first + run, points_.size() - 1), box});
    }
  }

  Across at(const Eigen::Vector2d& p) const {
    Across best;
    double best_sq = margin_ * margin_;
    for (const auto& [first, last, box] : boxes_) {
      // Lines that go on past their ends are not inside their boxes.
      const bool open_end = (first == 0 && goes_on_[0]) || (last + 1 == points_.size() && goes_on_[1]);
      if (!open_end && box.squaredExteriorDistance(p) > best_sq) continue;
      for (std::size_t k = first; k < last; ++k) {
        const Eigen::Vector2d d = points_[k + 1] - points_[k];
        double at = (p - points_[k]).dot(d) / d.squaredNorm();
        const bool before = at < 0, after = at > 1;
        if (before && !(k == 0 && goes_on_[0])) at = 0;
        if (after && !(k + 2 == points_.size() && goes_on_[1])) at = 1;
        const double distance_sq = (p - points_[k] - at * d).squaredNorm();
        if (distance_sq >= best_sq) continue;
        best_sq = distance_sq;
        best.near = true;
        best.beyond = !closed_ && ((k == 0 && before && !goes_on_[0]) || (k + 2 == points_.size() && after && !goes_on_[1]));
        best.t = std::copysign(std::sqrt(distance_sq), side_of(p, k, before, after));
      }
    }
    return best;
  }

  /// Direction of the line at the place nearest to p.
  Eigen::Vector2d direction(const Eigen::Vector2d& p) const {
    double best_sq = std::numeric_limits<double>::infinity();
    Eigen::Vector2d best = Eigen::Vector2d::UnitX();
    for (const auto& [first, last, box] : boxes_) {
      if (box.squaredExteriorDistance(p) >= best_sq) continue;
      for (std::size_t k = first; k < last; ++k) {
        const Eigen::Vector2d d = points_[k + 1] - points_[k];
        const double distance_sq = (p - points_[k] - std::clamp((p - points_[k]).dot(d) / d.squaredNorm(), 0.0, 1.0) * d).squaredNorm();
        if (distance_sq < best_sq) best_sq = distance_sq, best = d.normalized();
      }
    }
    return best;
  }

 private:
  /// Sign of the side on which p lies, seen from segment k. At a corner it is told by the corner's two directions together.
  double side_of(const Eigen::Vector2d& p, std::size_t k, bool before, bool after) const {
    Eigen::Vector2d d = (points_[k + 1] - points_[k]).normalized();
    const std::size_t last = points_.size() - 2;
    if (before && k > 0) d += (points_[k] - points_[k - 1]).normalized();
    else if (before && closed_) d += (points_[last + 1] - points_[last]).normalized();
    if (after && k < last) d += (points_[k + 2] - points_[k + 1]).normalized();
    else if (after && closed_) d += (points_[1] - points_[0]).normalized();
    return cross(d, p - (after ? points_[k + 1] : points_[k]));
  }

  struct Box {
    std::size_t first, last;
    Eigen::AlignedBox2d box;
  };
  std::vector<Eigen::Vector2d> points_;
  bool closed_;
  std::array<bool, 2> goes_on_;
  double margin_;
  std::vector<Box> boxes_;
};

/// Section across a fold at rest: cloth at distance t from the line, bent by `angle` over |t| < band / 2; (y, z) with z
/// towards the face side. Source: docs/tailoring.md, "Folds"
Eigen::Vector2d section(double t, double angle, double band) {
  const double half = band / 2, inside = std::clamp(t, -half, half), beyond = t - inside;
  const double turn = angle * inside / band;
  // Chord of an arc: of length `inside`, at half its turn.
  const double chord = std::abs(turn) > 1e-9 ? inside * std::sin(turn / 2) / (turn / 2) : inside;
  return {chord * std::cos(turn / 2) + beyond * std::cos(turn), chord * std::sin(turn / 2) + beyond * std::sin(turn)};
}

class Folder {
 public:
  explicit Folder(const GarmentMesh& garment) : garment_(garment) {}

  /// Hinges of one line of a fold. `item` names the fold in messages.
  Result<std::vector<Hinge>> hinges(const Line& line, const mesh::Fold& fold, const std::string& item) {
    return fold.radius * std::abs(fold.angle) > 0 ? roll(line, fold, item) : crease(line, fold, item);
  }

 private:
  Issue issue(const std::string& item, std::string code, std::string what, std::string remedy) const { return {std::move(code), {.item = item}, std::move(what), std::move(remedy), Category::check}; }

  std::vector<char> mask(const Vertices& vertices, const mesh::Ids& id) const {
    std::vector<char> wanted(static_cast<std::size_t>(id.maxCoeff()) + 1, 0);
    for (int v : vertices) wanted[static_cast<std::size_t>(id[v])] = 1;
    return wanted;
  }
  const mesh::Ids& vertex_ids() {
    if (vertex_ids_.size() == 0) {
      vertex_ids_.resize(garment_.vertex_count());
      for (Eigen::Index v = 0; v < vertex_ids_.size(); ++v) vertex_ids_[v] = static_cast<int>(v);
    }
    return vertex_ids_;
  }
  const mesh::Ids& particle_ids() {
    if (particle_ids_.size() == 0) particle_ids_ = mesh::particles(garment_);
    return particle_ids_;
  }

  Result<std::vector<Hinge>> crease(const Line& line, const mesh::Fold& fold, const std::string& item) {
    // An inner line bends its own panel, whatever else is sewn to it; a sewn edge bends against the other panel.
    const mesh::Ids& id = line.internal ? vertex_ids() : particle_ids();
    const Sides sides(garment_, id, mask(line.vertices, id));
    std::vector<Hinge> hinges;
    for (std::size_t k = 1; k < line.vertices.size(); ++k) {
      const int a = line.vertices[k - 1], b = line.vertices[k];
      const std::vector<Side> found = sides.at(id[a], id[b]);
      const auto own = std::find_if(found.begin(), found.end(), [&](const Side& s) { return (s.a == a && s.b == b) || (s.a == b && s.b == a); });
      TOILE_CHECK(own != found.end(), "vertices {} and {} of line {} are not on an edge", a, b, line.name);
      if (found.size() == 1) return issue(item, "free_border", fmt::format("'{}' is a free border at panel {}: there is nothing to fold", line.name, place_text(garment_, a)), "fold along an inner line, or sew the edge first");
      if (found.size() > 2) return issue(item, "branching_fold", fmt::format("{} panels meet in '{}' at panel {}", found.size(), line.name, place_text(garment_, a)), "say `angle` at the seam instead: it holds the seam's sides a and b");
      const Side& other = own == found.begin() ? found.back() : found.front();
      hinges.push_back({own->a, own->b, own->opposite, other.opposite, fold.angle, fold.factor, fold.id});
    }
    return hinges;
  }

  Result<std::vector<Hinge>> roll(const Line& line, const mesh::Fold& fold, const std::string& item) {
    if (!line.internal) return issue(item, "roll_on_border", fmt::format("'{}' is an edge: cloth cannot be rolled across a seam", line.name), "roll along an inner line beside it, or take radius 0");
    const double band = fold.radius * std::abs(fold.angle);

    // The panel's triangles, and its border.
    Vertices panel_vertices;
    for (Eigen::Index v = 0; v < garment_.vertex_count(); ++v) {
      if (garment_.vertex_panel[v] == line.panel) panel_vertices.push_back(static_cast<int>(v));
    }
    const Sides sides(garment_, vertex_ids(), mask(panel_vertices, vertex_ids()));
    std::vector<std::pair<int, int>> border;
    double longest_sq = 0;
    sides.each_edge([&](const std::vector<Side>& at) {
      longest_sq = std::max(longest_sq, (garment_.uv.row(at[0].a) - garment_.uv.row(at[0].b)).squaredNorm());
      if (at.size() == 1) border.emplace_back(at[0].a, at[0].b);
    });
    std::set<int> border_vertices;
    for (const auto& [a, b] : border) border_vertices.insert({a, b});

    std::vector<Eigen::Vector2d> points;
    for (int v : line.vertices) points.emplace_back(garment_.uv.row(v));
    const bool closed = line.vertices.front() == line.vertices.back();
    const std::array<bool, 2> goes_on{!closed && border_vertices.count(line.vertices.front()) > 0, !closed && border_vertices.count(line.vertices.back()) > 0};
    if (Issues room = check_room(line, points, border, band, item); !room.empty()) return room;

    const Band across(points, closed, goes_on, band / 2 + 2 * std::sqrt(longest_sq));
    std::map<int, Across> place;
    for (int v : panel_vertices) {
      const Across own = across.at(garment_.uv.row(v));
      if (own.near) place.emplace(v, own);
    }
    std::vector<Hinge> hinges;
    sides.each_edge([&](const std::vector<Side>& at) {
      if (at.size() != 2) return;
      const std::array<int, 4> corners{at[0].a, at[0].b, at[0].opposite, at[1].opposite};
      std::array<double, 4> t{};
      for (std::size_t k = 0; k < 4; ++k) {
        const auto found = place.find(corners[k]);
        if (found == place.end() || found->second.beyond) return;
        t[k] = found->second.t;
      }
      const auto [low, high] = std::minmax_element(t.begin(), t.end());
      if (*low >= band / 2 || *high <= -band / 2) return;
      // The line is taken as straight across one pair of triangles.
      const Eigen::Vector2d middle = 0.5 * (garment_.uv.row(corners[0]) + garment_.uv.row(corners[1])).transpose(), along = across.direction(middle);
      std::array<Eigen::Vector3d, 4> x;
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d yz = section(t[k], fold.angle, band);
        // (along, across to the left, face side) is right-handed.
        x[k] = {along.dot(Eigen::Vector2d(garment_.uv.row(corners[k]).transpose()) - middle), yz.x(), yz.y()};
      }
      const double angle = hinge_angle(x[0], x[1], x[2], x[3]);
      if (std::abs(angle) < flat_angle && fold.factor == 1) return;
      hinges.push_back({corners[0], corners[1], corners[2], corners[3], std::abs(angle) < flat_angle ? 0 : angle, fold.factor, fold.id});
    });
    return hinges;
  }

  /// The band must lie inside the panel on both sides of the line, except near the line's ends.
  Issues check_room(const Line& line, const std::vector<Eigen::Vector2d>& points, const std::vector<std::pair<int, int>>& border, double band, const std::string& item) const {
    std::vector<double> s{0};
    for (std::size_t k = 1; k < points.size(); ++k) s.push_back(s.back() + (points[k] - points[k - 1]).norm());
    const double from = std::min(band, s.back() / 2), to = s.back() - from;
    double narrowest = std::numeric_limits<double>::infinity();
    Eigen::Vector2d narrow_at = points.front();
    for (std::size_t k = 1; k < points.size(); ++k) {
      if (s[k] < from || s[k - 1] > to) continue;
      const Eigen::Vector2d along = (points[k] - points[k - 1]).normalized(), normal(-along.y(), along.x());
      const double at = std::clamp(0.5 * (s[k - 1] + s[k]), from, to);
      const Eigen::Vector2d middle = points[k - 1] + (at - s[k - 1]) * along;
      for (const auto& [a, b] : border) {
        // Where the normal through the middle meets the border.
        const Eigen::Vector2d p = garment_.uv.row(a).transpose() - middle, d = (garment_.uv.row(b) - garment_.uv.row(a)).transpose();
        const double facing = along.dot(d);
        if (facing == 0) continue;
        const double where = -along.dot(p) / facing;
        if (where < 0 || where > 1) continue;
        const double distance = std::abs(normal.dot(p + where * d));
        if (distance < narrowest) narrowest = distance, narrow_at = middle;
      }
    }
    if (narrowest >= band / 2 * (1 - 1e-9)) return {};
    const auto& panel = garment_.panels[static_cast<std::size_t>(line.panel)];
    return {issue(item, "narrow_roll", fmt::format("its {:.1f} mm of bent cloth reach over the border of panel {} beside ({:.1f}, {:.1f}) cm, which is {:.1f} mm away from '{}'", band * 1e3, panel.name, narrow_at.x() * 100, narrow_at.y() * 100, narrowest * 1e3, line.name),
                  "take a smaller radius or angle")};
  }

  const GarmentMesh& garment_;
  mesh::Ids vertex_ids_, particle_ids_;
};

/// One row an edge: where folds overlap their angles add up, and the first fold keeps the hinge.
Result<std::vector<Hinge>> merged(const GarmentMesh& garment, const std::vector<Hinge>& hinges) {
  std::vector<Hinge> result;
  std::map<std::pair<int, int>, std::size_t> known;
  Issues issues;
  for (const Hinge& hinge : hinges) {
    const auto [place, fresh] = known.emplace(std::pair{std::min(hinge.v0, hinge.v1), std::max(hinge.v0, hinge.v1)}, result.size());
    if (fresh) {
      result.push_back(hinge);
    } else {
      Hinge& first = result[place->second];
      first.rest_angle += hinge.rest_angle;
      first.factor = std::max(first.factor, hinge.factor);
    }
  }
  std::set<int> told;
  for (const Hinge& hinge : result) {
    if (std::abs(hinge.rest_angle) < std::numbers::pi - 1e-6 || !told.insert(hinge.fold).second) continue;
    issues.push_back({"flat_fold", {.item = "fold " + garment.folds[static_cast<std::size_t>(hinge.fold)].name}, fmt::format("the cloth would be folded by {:.1f} deg at rest at panel {}: more than half a turn is not possible", hinge.rest_angle * 180 / std::numbers::pi, place_text(garment, hinge.v0)),
                      "state a residual or a radius, or move folds apart that overlap", Category::check});
  }
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace

double hinge_angle(const Eigen::Vector3d& v0, const Eigen::Vector3d& v1, const Eigen::Vector3d& o0, const Eigen::Vector3d& o1) {
  const Eigen::Vector3d n0 = (v1 - v0).cross(o0 - v0).normalized(), n1 = (v0 - v1).cross(o1 - v1).normalized();
  return std::atan2(n1.cross(n0).dot((v1 - v0).normalized()), n0.dot(n1));
}

Result<Folded> add_folds(const GarmentMesh& garment, const std::vector<FoldSpec>& folds) {
  std::vector<const FoldSpec*> specs;
  for (const FoldSpec& spec : folds) specs.push_back(&spec);
  std::sort(specs.begin(), specs.end(), [](const FoldSpec* a, const FoldSpec* b) { return a->name < b->name; });
  Folded result;
  result.garment = garment;
  Issues issues;
  std::set<std::string> names;
  for (const auto& fold : garment.folds) names.insert(fold.name);
  Folder folder(garment);
  std::vector<Hinge> hinges = garment.hinges;
  for (const FoldSpec* spec : specs) {
    const std::string item = "fold " + spec->name;
    if (!names.insert(spec->name).second) issues.push_back({"duplicate_name", {.item = item}, "two folds have this name", "rename one"});
    if (spec->line.empty()) issues.push_back({"no_line", {.item = item}, "it runs along no line", "name at least one: panel.line"});
    mesh::Fold fold;
    fold.id = static_cast<int>(result.garment.folds.size());
    fold.name = spec->name;
    fold.kind = spec->kind;
    // What springs back opens the fold over the same cloth: the angle shrinks and the radius grows.
    fold.angle = spec->angle * (1 - spec->residual);
    fold.radius = spec->radius / (1 - spec->residual);
    fold.factor = spec->factor;
    FoldReport report{spec->name, fold.angle, fold.radius * std::abs(fold.angle)};
    for (const std::string& text : spec->line) {
      const auto parts = find_line(garment, text);
      if (!parts) {
        for (Issue issue : parts.issues()) {
          issue.place.item = item;
          issues.push_back(std::move(issue));
        }
        continue;
      }
      for (const LinePart& part : *parts) {
        const mesh::Run& run = garment.runs[static_cast<std::size_t>(part.run)];
        auto found = folder.hinges({text, run.panel, run.internal, part.vertices}, fold, item);
        if (!found) {
          append(issues, found.issues());
          continue;
        }
        if (part.whole) fold.runs.push_back(part.run);
        for (std::size_t k = 1; k < part.vertices.size(); ++k) report.length += (garment.uv.row(part.vertices[k]) - garment.uv.row(part.vertices[k - 1])).norm();
        report.hinges += static_cast<int>(found->size());
        hinges.insert(hinges.end(), found->begin(), found->end());
      }
    }
    result.garment.folds.push_back(std::move(fold));
    result.folds.push_back(std::move(report));
  }
  if (!issues.empty()) return issues;
  TOILE_TRY(result.garment.hinges, merged(result.garment, hinges));
  return result;
}

Result<std::vector<Hinge>> fold_hinges(const GarmentMesh& garment) {
  Folder folder(garment);
  std::vector<Hinge> hinges;
  Issues issues;
  for (const mesh::Fold& fold : garment.folds) {
    for (int id : fold.runs) {
      const mesh::Run& run = garment.runs[static_cast<std::size_t>(id)];
      const auto found = folder.hinges({garment.panels[static_cast<std::size_t>(run.panel)].name + "." + run.name, run.panel, run.internal, mesh::run_vertex_ids(garment, id)}, fold, "fold " + fold.name);
      if (found) hinges.insert(hinges.end(), found->begin(), found->end());
      else append(issues, found.issues());
    }
  }
  if (!issues.empty()) return issues;
  return merged(garment, hinges);
}

Result<std::vector<Hinge>> seam_hinges(const GarmentMesh& garment, const std::vector<std::vector<int>>& a, const std::vector<int>& b, double angle, double factor) {
  const mesh::Ids id = mesh::particles(garment);
  std::vector<char> wanted(static_cast<std::size_t>(id.maxCoeff()) + 1, 0);
  for (int v : b) wanted[static_cast<std::size_t>(id[v])] = 1;
  const Sides sides(garment, id, wanted);
  const std::set<int> of_b(b.begin(), b.end());
  std::vector<Hinge> hinges;
  for (const auto& row : a) {
    for (std::size_t k = 1; k < row.size(); ++k) {
      std::vector<Side> own, other;
      for (const Side& side : sides.at(id[row[k - 1]], id[row[k]])) {
        if ((side.a == row[k - 1] && side.b == row[k]) || (side.a == row[k] && side.b == row[k - 1])) own.push_back(side);
        else if (of_b.count(side.a) && of_b.count(side.b)) other.push_back(side);
      }
      if (own.size() != 1 || other.size() != 1) {
        return Issue{"angle_without_border", {}, fmt::format("at panel {} it joins {} and {} triangles: an angle needs a border on both sides", place_text(garment, row[k]), own.size(), other.size()), "take the angle away, or make it a fold along an inner line", Category::check};
      }
      hinges.push_back({own[0].a, own[0].b, own[0].opposite, other[0].opposite, angle, factor, -1});
    }
  }
  return hinges;
}

}  // namespace toile::tailor
