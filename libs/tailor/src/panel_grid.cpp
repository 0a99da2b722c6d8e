#include "panel_grid.h"

#include "local_mesh.h"
#include "triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

namespace toile::tailor {
namespace {

using pattern::Curve;

constexpr double border_clearance = 0.6;  ///< grid nodes keep this distance from border, lines and marks [cells]
constexpr double same_place = 1e-7;       ///< [cells]
constexpr double same_point = 1e-6;       ///< a named point this near to an edge's end is that end [m]
constexpr double on_axis = 1e-9;          ///< a fold line this straight up or across is a grid line [m]
constexpr const char* fold_edge = "(fold)";
constexpr double sharp_turn = 0.35;       ///< a curve that turns this much at once has a corner there [rad]

/// (u, v) in metres to cells and back. The grid starts at the panel's left and lower end (on the fold if there is one):
/// straight lower hems and left sides then lie on grid lines.
struct Cells {
  Point origin = Point::Zero();
  double weft = 0.01, warp = 0.01;
  Point operator()(const Point& uv) const { return {(uv.x() - origin.x()) / weft, (uv.y() - origin.y()) / warp}; }
  Point back(const Point& p) const { return {p.x() * weft + origin.x(), p.y() * warp + origin.y()}; }
  double reference() const { return std::sqrt(weft * warp); }
};

struct Line {
  const Curve* curve = nullptr;
  std::string name;
  bool internal = false;
  std::vector<double> fixed;  ///< arc lengths that must be vertices, ascending; begins with 0, ends with the length
  double allowance = 0;
};

struct Sample {
  double s = 0;
  Point p = Point::Zero();  ///< cells
  bool fixed = false;
};

double distance_to_segment(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a;
  const double length_sq = d.squaredNorm();
  const double t = length_sq > 0 ? std::clamp((p - a).dot(d) / length_sq, 0.0, 1.0) : 0.0;
  return (p - a - t * d).norm();
}

/// Samples a curve about one cell apart (closer where it bends sharply), at grid-line crossings where that keeps the
/// spacing even. The number of samples depends on lengths only, so that equally long edges get equally many.
std::vector<Sample> sample_line(const Line& line, const Cells& cells) {
  const Curve& curve = *line.curve;
  // Fine table: arc length, position, and arc length measured in local sample spacings.
  const double fine = cells.reference() / 8;
  struct Row {
    double s;
    Point p;
    double size = 1, count = 0;
  };
  std::vector<Row> table;
  std::vector<std::size_t> fixed_rows;
  for (std::size_t k = 0; k + 1 < line.fixed.size(); ++k) {
    const double s0 = line.fixed[k], s1 = line.fixed[k + 1];
    const int steps = std::max(8, static_cast<int>(std::ceil((s1 - s0) / fine)));
    if (k == 0) fixed_rows.push_back(0), table.push_back({s0, cells(curve.point_at(s0))});
    for (int i = 1; i <= steps; ++i) {
      const double s = i == steps ? s1 : s0 + (s1 - s0) * i / steps;
      table.push_back({s, cells(curve.point_at(s))});
    }
    fixed_rows.push_back(table.size() - 1);
  }
  // No sample spacing turns by more than 0.6 rad unless that needs more than four samples a cell.
  for (std::size_t i = 1; i + 1 < table.size(); ++i) {
    const Point a = table[i].p - table[i - 1].p, b = table[i + 1].p - table[i].p;
    const double turn = std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
    const double length = 0.5 * (a.norm() + b.norm());
    if (turn < sharp_turn && turn > 0.6 * length) table[i].size = std::clamp(0.6 * length / turn, 0.25, 1.0);
  }
  for (std::size_t i = 1; i < table.size(); ++i) table[i].size = std::min(table[i].size, table[i - 1].size + 0.25 * (table[i].p - table[i - 1].p).norm());
  for (std::size_t i = table.size() - 1; i-- > 0;) table[i].size = std::min(table[i].size, table[i + 1].size + 0.25 * (table[i].p - table[i + 1].p).norm());
  for (std::size_t i = 1; i < table.size(); ++i) {
    table[i].count = table[i - 1].count + (table[i].p - table[i - 1].p).norm() * 0.5 * (1 / table[i].size + 1 / table[i - 1].size);
  }

  std::vector<Sample> samples;
  for (std::size_t k = 0; k + 1 < fixed_rows.size(); ++k) {
    const std::size_t r0 = fixed_rows[k], r1 = fixed_rows[k + 1];
    samples.push_back({table[r0].s, table[r0].p, true});
    const double c0 = table[r0].count, total = table[r1].count - c0;
    int spans = std::max(1, static_cast<int>(std::lround(total)));
    const bool closed = line.fixed.size() == 2 && (table[r0].p - table[r1].p).norm() < same_place;
    if (closed) spans = std::max(spans, 6);
    if (spans == 1) continue;

    struct Candidate {
      double count, s;
      bool crossing;
    };
    std::vector<Candidate> candidates;
    const auto count_at = [&](double s) {
      const auto upper = std::upper_bound(table.begin() + static_cast<std::ptrdiff_t>(r0), table.begin() + static_cast<std::ptrdiff_t>(r1), s, [](double value, const Row& row) { return value < row.s; });
      const Row &b = *upper, &a = *(upper - 1);
      return (a.count + (b.count - a.count) * (s - a.s) / (b.s - a.s) - c0) / total * spans;
    };
    for (std::size_t r = r0; r < r1; ++r) {
      for (int axis = 0; axis < 2; ++axis) {
        const double a = table[r].p[axis], b = table[r + 1].p[axis];
        const double low = std::min(a, b), high = std::max(a, b);
        if (high - low < 1e-9) continue;
        for (double level = std::ceil(low); level <= high; level += 1) {
          if (std::abs(level - b) < 1e-12 && r + 1 != r1) continue;  // counted with the next row
          double s_low = table[r].s, s_high = table[r + 1].s;
          for (int step = 0; step < 60 && s_high - s_low > 1e-15; ++step) {
            const double middle = 0.5 * (s_low + s_high);
            if (middle <= s_low || middle >= s_high) break;
            const bool before = (cells(curve.point_at(middle))[axis] < level) == (a < b);
            (before ? s_low : s_high) = middle;
          }
          const double s = 0.5 * (s_low + s_high);
          if (s > table[r0].s && s < table[r1].s) candidates.push_back({count_at(s), s, true});
        }
      }
    }
    constexpr int lattice = 4;
    for (int i = 1; i < spans * lattice; ++i) {
      const double count = static_cast<double>(i) / lattice;
      const double wanted = c0 + count / spans * total;
      const auto upper = std::upper_bound(table.begin() + static_cast<std::ptrdiff_t>(r0) + 1, table.begin() + static_cast<std::ptrdiff_t>(r1), wanted, [](double value, const Row& row) { return value < row.count; });
      const Row &b = *upper, &a = *(upper - 1);
      candidates.push_back({count, a.s + (b.s - a.s) * (wanted - a.count) / (b.count - a.count), false});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) { return std::tie(a.count, a.s) < std::tie(b.count, b.s); });

    // Dynamic programming: sample i of spans - 1 on candidate c; even gaps against crossings that lie a little off.
    constexpr double off_grid = 0.08;
    const int inner = spans - 1;
    std::vector<std::size_t> first(static_cast<std::size_t>(inner)), last(static_cast<std::size_t>(inner));
    std::vector<std::vector<double>> cost(static_cast<std::size_t>(inner));
    std::vector<std::vector<int>> from(static_cast<std::size_t>(inner));
    const auto gap_cost = [](double gap) { return gap < 0.5 ? 1e3 * (1 - gap) : (gap - 1) * (gap - 1); };
    for (int i = 0; i < inner; ++i) {
      const auto at = [&](double count) {
        return static_cast<std::size_t>(std::lower_bound(candidates.begin(), candidates.end(), count, [](const Candidate& c, double value) { return c.count < value; }) - candidates.begin());
      };
      first[i] = at(i + 1 - 0.9);
      last[i] = at(i + 1 + 0.9);
      cost[i].assign(last[i] - first[i], std::numeric_limits<double>::infinity());
      from[i].assign(last[i] - first[i], -1);
      for (std::size_t c = first[i]; c < last[i]; ++c) {
        const double own = candidates[c].crossing ? 0 : off_grid;
        if (i == 0) {
          cost[i][c - first[i]] = own + gap_cost(candidates[c].count);
          continue;
        }
        for (std::size_t b = first[i - 1]; b < last[i - 1] && candidates[b].count < candidates[c].count; ++b) {
          const double total_cost = cost[i - 1][b - first[i - 1]] + own + gap_cost(candidates[c].count - candidates[b].count);
          if (total_cost < cost[i][c - first[i]] - 1e-12) cost[i][c - first[i]] = total_cost, from[i][c - first[i]] = static_cast<int>(b);
        }
      }
    }
    std::vector<std::size_t> chosen(static_cast<std::size_t>(inner));
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t c = first[inner - 1]; c < last[inner - 1]; ++c) {
      const double end_cost = cost[inner - 1][c - first[inner - 1]] + gap_cost(spans - candidates[c].count);
      if (end_cost < best - 1e-12) best = end_cost, chosen[inner - 1] = c;
    }
    for (int i = inner - 1; i > 0; --i) chosen[i - 1] = static_cast<std::size_t>(from[i][chosen[i] - first[i]]);
    for (std::size_t c : chosen) samples.push_back({candidates[c].s, cells(curve.point_at(candidates[c].s)), false});
  }
  samples.push_back({table.back().s, table.back().p, true});
  return samples;
}

/// Regular grid over the panel's box.
struct Grid {
  int i0 = 0, j0 = 0, ni = 0, nj = 0;
  std::vector<float> distance;   ///< of nodes, to the nearest obstacle; large where none is near
  std::vector<char> inside;      ///< nodes
  std::vector<int> vertex;       ///< of nodes, -1: none
  std::vector<char> cell_open;   ///< cell may be regular: its middle is inside and nothing runs through it
  std::size_t at(int i, int j) const { return static_cast<std::size_t>(j - j0) * static_cast<std::size_t>(ni) + static_cast<std::size_t>(i - i0); }
  bool has(int i, int j) const { return i >= i0 && j >= j0 && i < i0 + ni && j < j0 + nj; }
};

Result<PanelMesh> mesh_whole(const pattern::CutPanel& panel, const GridSettings& settings, const std::optional<std::pair<Point, Point>>& fold) {
  const auto trouble = [&](Issue issue) {
    issue.place.item = panel.name;
    return issue;
  };
  Cells cells;
  cells.weft = settings.cell_weft;
  cells.warp = settings.cell_warp;

  // Lines: the loops' edges, then internal lines.
  std::vector<Line> lines;
  std::vector<std::vector<int>> loops;
  const auto add_loop = [&](const std::vector<pattern::PanelEdge>& edges) {
    loops.emplace_back();
    for (const auto& edge : edges) {
      loops.back().push_back(static_cast<int>(lines.size()));
      lines.push_back({&edge.curve, edge.name, false, {}, edge.allowance});
    }
  };
  add_loop(panel.outline);
  for (const auto& hole : panel.holes) add_loop(hole.edges);
  const std::size_t border_lines = lines.size();
  for (const auto& line : panel.lines) {
    if (std::find(settings.lines.begin(), settings.lines.end(), line.name) != settings.lines.end()) lines.push_back({&line.curve, line.name, true, {}});
  }

  Point low = Point::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t l = 0; l < border_lines; ++l) {
    for (double s : lines[l].curve->sample(0.1 * cells.reference())) {
      const Point p = lines[l].curve->point_at(s);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  cells.origin = low;
  if (fold && std::abs(fold->first.x() - fold->second.x()) < on_axis) cells.origin.x() = fold->first.x();
  if (fold && std::abs(fold->first.y() - fold->second.y()) < on_axis) cells.origin.y() = fold->first.y();
  {
    const Point extent = cells(high) - cells(low);
    if (extent.x() * extent.y() > 5e8) return trouble({"fine_grid", {}, fmt::format("{:.0f} x {:.0f} cells are too many", extent.x(), extent.y()), "choose larger cells"});
  }

  // Points that must be vertices: on a line by arc length, otherwise inside.
  struct Wanted {
    std::string name;
    Point at;
    int line = -1;
    double s = 0;
  };
  std::vector<Wanted> wanted;
  std::vector<std::pair<Point, Point>> boxes;
  for (const Line& line : lines) {
    Point box_low = Point::Constant(std::numeric_limits<double>::infinity()), box_high = -box_low;
    for (const auto& segment : line.curve->segments()) {
      const auto [a, b] = pattern::bounds(segment);
      box_low = box_low.cwiseMin(a);
      box_high = box_high.cwiseMax(b);
    }
    boxes.emplace_back(box_low, box_high);
  }
  const auto locate = [&](Wanted& point, std::size_t line_count) {
    double nearest = pattern::on_edge_tolerance;
    for (std::size_t l = 0; l < line_count; ++l) {
      const Point margin = Point::Constant(nearest);
      if (((point.at - boxes[l].first + margin).array() < 0).any() || ((boxes[l].second - point.at + margin).array() < 0).any()) continue;
      const auto found = lines[l].curve->nearest(point.at);
      if (found.distance < nearest) nearest = found.distance, point.line = static_cast<int>(l), point.s = found.s;
    }
  };
  std::set<std::string> used_names;
  const auto want = [&](const std::string& name, const Point& at) {
    if (!used_names.insert(name).second) return;
    wanted.push_back({name, at});
    locate(wanted.back(), lines.size());
  };
  for (const auto& point : panel.points) {
    // Construction points off the cloth are of no use to the garment.
    Wanted probe{point.name, point.at};
    locate(probe, lines.size());
    if (probe.line >= 0) want(point.name, point.at);
  }
  for (const auto& notch : panel.notches) {
    if (!used_names.insert(notch.name).second) continue;
    Wanted point{notch.name, notch.at};
    for (std::size_t l = 0; l < border_lines; ++l) {
      if (lines[l].name == notch.edge) point.line = static_cast<int>(l), point.s = notch.s;
    }
    wanted.push_back(point);
  }
  for (const auto& mark : panel.marks) want(mark.name, mark.at);
  // Ends of internal lines that lie on the border.
  struct LineEnd {
    int border_line = -1;
    double s = 0;
  };
  std::vector<std::array<LineEnd, 2>> line_ends(lines.size());
  for (std::size_t l = border_lines; l < lines.size(); ++l) {
    for (int end = 0; end < 2; ++end) {
      Wanted probe{"", end == 0 ? lines[l].curve->from() : lines[l].curve->to()};
      locate(probe, border_lines);
      line_ends[l][static_cast<std::size_t>(end)] = {probe.line, probe.s};
    }
  }
  for (std::size_t l = 0; l < lines.size(); ++l) {
    Line& line = lines[l];
    const double length = line.curve->length();
    line.fixed = {0, length};
    const auto fix = [&](double s) {
      for (double& known : line.fixed) {
        if (std::abs(known - s) < same_point) return;
      }
      line.fixed.push_back(s);
    };
    const auto& starts = line.curve->segment_starts();
    for (std::size_t k = 1; k + 1 < starts.size(); ++k) {
      const Point before = pattern::derivative(line.curve->segments()[k - 1], 1), after = pattern::derivative(line.curve->segments()[k], 0);
      if (std::abs(std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after))) > sharp_turn) fix(starts[k]);
    }
    for (const Wanted& point : wanted) {
      if (point.line == static_cast<int>(l)) fix(point.s);
    }
    for (const auto& ends : line_ends) {
      for (const LineEnd& end : ends) {
        if (end.border_line == static_cast<int>(l)) fix(end.s);
      }
    }
    std::sort(line.fixed.begin(), line.fixed.end());
  }

  // Vertices of the lines.
  LocalMesh local;
  std::vector<std::vector<std::pair<int, double>>> fixed_vertices(lines.size());
  std::vector<std::pair<int, int>> walls, constraints;
  const auto add_samples = [&](int l, int start, int end) {  // start, end: existing vertices or -1
    const std::vector<Sample> samples = sample_line(lines[l], cells);
    std::vector<int> ids;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      int id = k == 0 ? start : k + 1 == samples.size() ? end : -1;
      if (id < 0) {
        id = static_cast<int>(local.vertices.size());
        LocalVertex vertex{samples[k].p, Mobility::fixed, -1, 0};
        if (!samples[k].fixed && !lines[l].internal) vertex = {samples[k].p, Mobility::slide, l, samples[k].s / cells.reference()};
        local.vertices.push_back(vertex);
      }
      if (samples[k].fixed || lines[l].internal) fixed_vertices[l].emplace_back(id, samples[k].s);
      ids.push_back(id);
    }
    return ids;
  };
  std::vector<std::vector<int>> loop_vertices;
  for (const auto& loop : loops) {
    std::vector<int> ring;
    int current = -1;
    int ring_start = -1;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const bool last = k + 1 == loop.size();
      if (loop.size() == 1) {
        // One closed edge: its two ends are the same vertex.
        ring_start = static_cast<int>(local.vertices.size());
        current = ring_start;
        local.vertices.push_back({cells(lines[loop[k]].curve->from()), Mobility::fixed, -1, 0});
      }
      const std::vector<int> ids = add_samples(loop[k], current, last ? ring_start : -1);
      if (k == 0) ring_start = ids.front();
      current = ids.back();
      ring.insert(ring.end(), ids.begin(), ids.end() - 1);
    }
    for (std::size_t k = 0; k < ring.size(); ++k) walls.emplace_back(ring[k], ring[(k + 1) % ring.size()]);
    loop_vertices.push_back(std::move(ring));
  }
  const auto vertex_at = [&](int line, double s) {
    for (const auto& [id, at] : fixed_vertices[line]) {
      if (std::abs(at - s) < 2 * same_point) return id;
    }
    return -1;
  };
  const auto border_walls = walls.size();
  for (std::size_t l = border_lines; l < lines.size(); ++l) {
    std::array<int, 2> ends{-1, -1};
    for (std::size_t e = 0; e < 2; ++e) {
      if (line_ends[l][e].border_line >= 0) ends[e] = vertex_at(line_ends[l][e].border_line, line_ends[l][e].s);
    }
    const std::vector<int> ids = add_samples(static_cast<int>(l), ends[0], ends[1]);
    for (std::size_t k = 0; k + 1 < ids.size(); ++k) constraints.emplace_back(ids[k], ids[k + 1]);
  }
  std::vector<GridPoint> points;
  for (const Wanted& point : wanted) {
    int id = -1;
    if (point.line >= 0) {
      id = vertex_at(point.line, point.s);
      TOILE_CHECK(id >= 0, "named point {} is no vertex", point.name);
    } else {
      id = static_cast<int>(local.vertices.size());
      local.vertices.push_back({cells(point.at), Mobility::fixed, -1, 0});
    }
    points.push_back({point.name, id});
  }
  const std::size_t line_vertices = local.vertices.size();

  // Grid nodes that keep clear of all of these.
  Grid grid;
  {
    Point box_low = Point::Constant(std::numeric_limits<double>::infinity()), box_high = -box_low;
    for (const auto& vertex : local.vertices) {
      box_low = box_low.cwiseMin(vertex.p);
      box_high = box_high.cwiseMax(vertex.p);
    }
    grid.i0 = static_cast<int>(std::floor(box_low.x())) - 1;
    grid.j0 = static_cast<int>(std::floor(box_low.y())) - 1;
    grid.ni = static_cast<int>(std::ceil(box_high.x())) + 2 - grid.i0;
    grid.nj = static_cast<int>(std::ceil(box_high.y())) + 2 - grid.j0;
  }
  const std::size_t nodes = static_cast<std::size_t>(grid.ni) * static_cast<std::size_t>(grid.nj);
  grid.distance.assign(nodes, 1e9f);
  grid.inside.assign(nodes, 0);
  grid.vertex.assign(nodes, -1);
  grid.cell_open.assign(nodes, 0);
  const auto obstacle = [&](const Point& a, const Point& b) {
    const int i_low = static_cast<int>(std::floor(std::min(a.x(), b.x()) - 1)), i_high = static_cast<int>(std::ceil(std::max(a.x(), b.x()) + 1));
    const int j_low = static_cast<int>(std::floor(std::min(a.y(), b.y()) - 1)), j_high = static_cast<int>(std::ceil(std::max(a.y(), b.y()) + 1));
    for (int j = j_low; j <= j_high; ++j) {
      for (int i = i_low; i <= i_high; ++i) {
        if (!grid.has(i, j)) continue;
        float& known = grid.distance[grid.at(i, j)];
        known = std::min(known, static_cast<float>(distance_to_segment({static_cast<double>(i), static_cast<double>(j)}, a, b)));
      }
    }
  };
  const auto all_segments = [&](const auto& visit) {
    for (std::size_t w = 0; w < border_walls; ++w) visit(local.vertices[walls[w].first].p, local.vertices[walls[w].second].p);
    for (const auto& [a, b] : constraints) visit(local.vertices[a].p, local.vertices[b].p);
    for (const GridPoint& point : points) visit(local.vertices[point.vertex].p, local.vertices[point.vertex].p);
  };
  all_segments(obstacle);
  // Scan lines at node rows and at cell middles.
  const auto scan = [&](double offset, std::vector<char>& result) {
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(grid.nj));
    for (std::size_t w = 0; w < border_walls; ++w) {
      const Point a = local.vertices[walls[w].first].p, b = local.vertices[walls[w].second].p;
      const double y_low = std::min(a.y(), b.y()), y_high = std::max(a.y(), b.y());
      for (int j = static_cast<int>(std::ceil(y_low - offset)); j + offset < y_high; ++j) {
        if (j + offset < y_low) continue;
        rows[static_cast<std::size_t>(j - grid.j0)].push_back(a.x() + (b.x() - a.x()) * (j + offset - a.y()) / (b.y() - a.y()));
      }
    }
    for (int j = grid.j0; j < grid.j0 + grid.nj; ++j) {
      auto& row = rows[static_cast<std::size_t>(j - grid.j0)];
      std::sort(row.begin(), row.end());
      for (std::size_t k = 0; k + 1 < row.size(); k += 2) {
        for (int i = static_cast<int>(std::ceil(row[k] - offset)); i + offset < row[k + 1]; ++i) {
          if (grid.has(i, j)) result[grid.at(i, j)] = 1;
        }
      }
    }
  };
  scan(0, grid.inside);
  scan(0.5, grid.cell_open);
  // A cell through which something runs, or with a vertex on a side, is not regular.
  all_segments([&](const Point& a, const Point& b) {
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / 0.1)));
    for (int k = 0; k <= steps; ++k) {
      const Point p = a + (b - a) * (static_cast<double>(k) / steps);
      const int i = static_cast<int>(std::floor(p.x())), j = static_cast<int>(std::floor(p.y()));
      const double x = p.x() - i, y = p.y() - j;
      if (x > same_place && y > same_place && x < 1 - same_place && y < 1 - same_place && grid.has(i, j)) grid.cell_open[grid.at(i, j)] = 0;
    }
  });
  for (std::size_t v = 0; v < line_vertices; ++v) {
    const Point p = local.vertices[v].p;
    const int i = static_cast<int>(std::lround(p.x())), j = static_cast<int>(std::lround(p.y()));
    if (std::abs(p.x() - i) < same_place && std::abs(p.y() - j) < same_place) {
      if (grid.has(i, j)) grid.vertex[grid.at(i, j)] = static_cast<int>(v);
      continue;
    }
    for (int di = -1; di <= 0; ++di) {
      for (int dj = -1; dj <= 0; ++dj) {
        const int ci = static_cast<int>(std::floor(p.x() + (di < 0 ? -same_place : same_place))), cj = static_cast<int>(std::floor(p.y() + (dj < 0 ? -same_place : same_place)));
        if (grid.has(ci, cj)) grid.cell_open[grid.at(ci, cj)] = 0;
      }
    }
  }
  for (int j = grid.j0; j < grid.j0 + grid.nj; ++j) {
    for (int i = grid.i0; i < grid.i0 + grid.ni; ++i) {
      const std::size_t n = grid.at(i, j);
      if (grid.vertex[n] >= 0 || !grid.inside[n] || grid.distance[n] < border_clearance) continue;
      grid.vertex[n] = static_cast<int>(local.vertices.size());
      local.vertices.push_back({{static_cast<double>(i), static_cast<double>(j)}, Mobility::free, -1, 0});
    }
  }
  const auto regular = [&](int i, int j) {
    return grid.has(i, j) && grid.has(i + 1, j + 1) && grid.cell_open[grid.at(i, j)] && grid.vertex[grid.at(i, j)] >= 0 && grid.vertex[grid.at(i + 1, j)] >= 0 &&
           grid.vertex[grid.at(i, j + 1)] >= 0 && grid.vertex[grid.at(i + 1, j + 1)] >= 0;
  };

  // The strip between regular cells and border.
  std::vector<int> strip_vertices;
  for (std::size_t v = 0; v < line_vertices; ++v) strip_vertices.push_back(static_cast<int>(v));
  for (int j = grid.j0; j < grid.j0 + grid.nj; ++j) {
    for (int i = grid.i0; i < grid.i0 + grid.ni; ++i) {
      const int v = grid.vertex[grid.at(i, j)];
      if (v >= static_cast<int>(line_vertices) && !(regular(i - 1, j - 1) && regular(i, j - 1) && regular(i - 1, j) && regular(i, j))) strip_vertices.push_back(v);
      if (!regular(i, j)) continue;
      const int a = v, b = grid.vertex[grid.at(i + 1, j)], c = grid.vertex[grid.at(i + 1, j + 1)], d = grid.vertex[grid.at(i, j + 1)];
      if (!regular(i, j - 1)) walls.emplace_back(a, b);
      if (!regular(i + 1, j)) walls.emplace_back(b, c);
      if (!regular(i, j + 1)) walls.emplace_back(c, d);
      if (!regular(i - 1, j)) walls.emplace_back(d, a);
      if (!settings.alternating || (i + j) % 2 == 0) {
        local.triangles.push_back({a, b, c});
        local.triangles.push_back({a, c, d});
      } else {
        local.triangles.push_back({a, b, d});
        local.triangles.push_back({b, c, d});
      }
    }
  }
  {
    std::vector<int> place(local.vertices.size(), -1);
    std::vector<Point> positions;
    for (int v : strip_vertices) {
      place[v] = static_cast<int>(positions.size());
      positions.push_back(local.vertices[v].p);
    }
    const auto placed = [&](std::vector<std::pair<int, int>> pairs) {
      for (auto& [a, b] : pairs) {
        a = place[a];
        b = place[b];
      }
      return pairs;
    };
    auto strip = triangulate_strip(positions, placed(walls), placed(constraints));
    if (!strip) {
      Issue issue = strip.issues().front();
      issue.what += fmt::format(" (cells of {:.3g} x {:.3g} mm)", cells.weft * 1e3, cells.warp * 1e3);
      return trouble(issue);
    }
    for (const Triple& t : *strip) local.triangles.push_back({strip_vertices[t[0]], strip_vertices[t[1]], strip_vertices[t[2]]});
  }
  for (auto [a, b] : constraints) local.constraints.emplace(std::min(a, b), std::max(a, b));
  build_stars(local);
  ImproveOptions options;
  options.curve_point = [&](int curve, double s) { return cells(lines[curve].curve->point_at(s * cells.reference())); };
  improve(local, options);

  // Runs as they stand now, and the final numbering: border loops in order, then everything else.
  PanelMesh result;
  std::vector<std::vector<std::pair<double, int>>> slid(lines.size());
  for (int v = 0; v < static_cast<int>(local.vertices.size()); ++v) {
    if (local.vertices[v].mobility == Mobility::slide && !local.stars[v].empty()) slid[local.vertices[v].curve].emplace_back(local.vertices[v].s * cells.reference(), v);
  }
  std::vector<int> number(local.vertices.size(), -1);
  int next = 0;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    GridRun run{lines[l].name, lines[l].curve->length(), false, lines[l].internal, {}, lines[l].allowance};
    std::vector<std::pair<double, int>> order = slid[l];
    for (const auto& [id, s] : fixed_vertices[l]) order.emplace_back(s, id);
    std::sort(order.begin(), order.end());
    for (const auto& [s, v] : order) {
      if (number[v] < 0) number[v] = next++;
      run.vertices.emplace_back(number[v], s);
    }
    run.closed = run.vertices.front().first == run.vertices.back().first;
    result.runs.push_back(std::move(run));
  }
  for (std::size_t v = 0; v < local.vertices.size(); ++v) {
    if (number[v] < 0 && !local.stars[v].empty()) number[v] = next++;
  }
  result.uv.resize(next, 2);
  for (std::size_t v = 0; v < local.vertices.size(); ++v) {
    if (number[v] >= 0) result.uv.row(number[v]) = cells.back(local.vertices[v].p);
  }
  std::vector<Triple> faces;
  for (const Triple& t : local.triangles) {
    if (t[0] < 0) continue;
    Triple face{number[t[0]], number[t[1]], number[t[2]]};
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end());
  result.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) result.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  for (const GridPoint& point : points) {
    if (number[point.vertex] < 0) return trouble({"point_outside", {.item = point.name}, fmt::format("the mark '{}' is not on the cloth", point.name), "move it inside the outline"});
    result.points.push_back({point.name, number[point.vertex]});
  }
  return result;
}

/// One half of a panel that was unfolded about a grid line, and the names of what lies on the other half.
struct Half {
  pattern::CutPanel panel;
  std::map<std::string, std::string> other_edge, other_line, other_point;  ///< name here -> name of its mirror image
  int axis = 0;        ///< coordinate that the fold line holds constant
  double at = 0;       ///< its value
};

std::optional<Half> half_of(const pattern::CutPanel& panel) {
  if (!panel.fold) return std::nullopt;
  Half half;
  const Point p = panel.fold->first, q = panel.fold->second;
  if (std::abs(p.x() - q.x()) < on_axis) half.axis = 0;
  else if (std::abs(p.y() - q.y()) < on_axis) half.axis = 1;
  else return std::nullopt;
  half.at = p[half.axis];
  const auto side = [&](const Point& at) { return at[half.axis] - half.at; };
  const auto image = [&](Point at) {
    at[half.axis] = 2 * half.at - at[half.axis];
    return at;
  };
  const auto same = [](const Point& a, const Point& b) { return (a - b).norm() < 1e-9; };

  half.panel = panel;
  half.panel.fold.reset();
  // The edges on the positive side are one stretch of the outline, from one end of the fold to the other.
  const std::size_t n = panel.outline.size();
  const auto positive = [&](const pattern::PanelEdge& edge) { return side(edge.curve.point_at(0.5 * edge.curve.length())) > 0; };
  std::size_t start = n;
  for (std::size_t k = 0; k < n; ++k) {
    if (!positive(panel.outline[k]) || positive(panel.outline[(k + n - 1) % n])) continue;
    if (start < n) return std::nullopt;
    start = k;
  }
  if (start == n) return std::nullopt;
  half.panel.outline.clear();
  for (std::size_t k = start; positive(panel.outline[k % n]) && k < start + n; ++k) half.panel.outline.push_back(panel.outline[k % n]);
  if (2 * half.panel.outline.size() != n) return std::nullopt;
  const Point first = half.panel.outline.front().curve.from(), last = half.panel.outline.back().curve.to();
  if (std::abs(side(first)) > on_axis || std::abs(side(last)) > on_axis) return std::nullopt;
  // Where the outline meets the fold at less than 20 degrees the two halves are better meshed as one.
  const Point along = (first - last).normalized();
  const double steepest = std::cos(20 * std::numbers::pi / 180);
  if (half.panel.outline.front().curve.tangent_at(0).dot(-along) > steepest || half.panel.outline.back().curve.tangent_at(half.panel.outline.back().curve.length()).dot(-along) > steepest) return std::nullopt;

  const auto pair_curves = [&](const auto& here, const auto& all, std::map<std::string, std::string>& names, bool reversed) {
    for (const auto& item : here) {
      for (const auto& other : all) {
        const Point from = reversed ? other.curve.to() : other.curve.from(), to = reversed ? other.curve.from() : other.curve.to();
        const double length = item.curve.length();
        if (other.name != item.name && std::abs(other.curve.length() - length) < 1e-9 && same(image(item.curve.from()), from) && same(image(item.curve.to()), to) &&
            same(image(item.curve.point_at(0.3 * length)), other.curve.point_at((reversed ? 0.7 : 0.3) * length))) names[item.name] = other.name;
      }
      if (!names.count(item.name)) return false;
    }
    return true;
  };
  if (!pair_curves(half.panel.outline, panel.outline, half.other_edge, true)) return std::nullopt;
  half.panel.outline.push_back({fold_edge, "", "", pattern::Curve({pattern::line_segment(last, first)})});

  half.panel.holes.clear();
  std::vector<pattern::PanelEdge> all_hole_edges;
  for (const auto& hole : panel.holes) all_hole_edges.insert(all_hole_edges.end(), hole.edges.begin(), hole.edges.end());
  for (const auto& hole : panel.holes) {
    const bool here = positive(hole.edges.front());
    for (const auto& edge : hole.edges) {
      if (positive(edge) != here) return std::nullopt;
    }
    if (!here) continue;
    half.panel.holes.push_back(hole);
    if (!pair_curves(hole.edges, all_hole_edges, half.other_edge, true)) return std::nullopt;
  }
  if (2 * half.panel.holes.size() != panel.holes.size()) return std::nullopt;

  half.panel.lines.clear();
  for (const auto& line : panel.lines) {
    if (side(line.curve.point_at(0.5 * line.curve.length())) > 0) half.panel.lines.push_back(line);
  }
  if (2 * half.panel.lines.size() != panel.lines.size() || !pair_curves(half.panel.lines, panel.lines, half.other_line, false)) return std::nullopt;

  const auto keep_points = [&](auto& list, const auto& all) {
    list.clear();
    for (const auto& point : all) {
      if (side(point.at) < -on_axis) continue;
      list.push_back(point);
      if (side(point.at) <= on_axis) continue;
      for (const auto& other : all) {
        if (other.name != point.name && same(image(point.at), other.at)) half.other_point[point.name] = other.name;
      }
    }
  };
  keep_points(half.panel.points, panel.points);
  keep_points(half.panel.notches, panel.notches);
  keep_points(half.panel.marks, panel.marks);
  for (const auto& notch : half.panel.notches) {
    // A notch at the fold may be told from the other half's edge.
    if (!half.other_edge.count(notch.edge)) return std::nullopt;
  }
  return half;
}

/// Both halves, joined along the vertices of the fold line.
PanelMesh unfolded(const PanelMesh& mesh, const Half& half, const pattern::CutPanel& panel, const GridSettings& settings) {
  const int count = static_cast<int>(mesh.uv.rows());
  std::vector<char> on_fold(static_cast<std::size_t>(count), 0);
  for (const GridRun& run : mesh.runs) {
    if (run.name != fold_edge) continue;
    for (const auto& [v, s] : run.vertices) on_fold[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<int> number(2 * static_cast<std::size_t>(count), -1);  // second half: mirror images
  int next = 0;
  const auto id = [&](int v, bool mirrored) {
    int& known = number[static_cast<std::size_t>(v + (mirrored && !on_fold[static_cast<std::size_t>(v)] ? count : 0))];
    if (known < 0) known = next++;
    return known;
  };
  PanelMesh result;
  const auto add_run = [&](const std::string& name) {
    for (const GridRun& run : mesh.runs) {
      const auto& others = run.internal ? half.other_line : half.other_edge;
      const auto other = others.find(run.name);
      if (run.name != name && (other == others.end() || other->second != name)) continue;
      const bool mirrored = run.name != name, turned = mirrored && !run.internal;
      GridRun copy = run;
      copy.name = name;
      if (turned) {
        std::reverse(copy.vertices.begin(), copy.vertices.end());
        for (auto& [v, s] : copy.vertices) s = run.length - s;
      }
      for (auto& [v, s] : copy.vertices) v = id(v, mirrored);
      result.runs.push_back(std::move(copy));
      return;
    }
  };
  for (const auto& edge : panel.outline) add_run(edge.name);
  for (const auto& hole : panel.holes) {
    for (const auto& edge : hole.edges) add_run(edge.name);
  }
  for (const auto& line : panel.lines) {
    if (std::find(settings.lines.begin(), settings.lines.end(), line.name) != settings.lines.end()) add_run(line.name);
  }
  for (bool mirrored : {false, true}) {
    for (int v = 0; v < count; ++v) id(v, mirrored);
  }
  result.uv.resize(next, 2);
  for (int v = 0; v < count; ++v) {
    Eigen::RowVector2d at = mesh.uv.row(v);
    if (on_fold[static_cast<std::size_t>(v)]) at[half.axis] = half.at;
    result.uv.row(id(v, false)) = at;
    if (on_fold[static_cast<std::size_t>(v)]) continue;
    at[half.axis] = 2 * half.at - at[half.axis];
    result.uv.row(id(v, true)) = at;
  }
  std::vector<Triple> faces;
  for (bool mirrored : {false, true}) {
    for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
      Triple face{id(mesh.faces(f, 0), mirrored), id(mesh.faces(f, 1), mirrored), id(mesh.faces(f, 2), mirrored)};
      if (mirrored) std::swap(face[1], face[2]);
      std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end());
  result.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) result.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  for (const GridPoint& point : mesh.points) {
    result.points.push_back({point.name, id(point.vertex, false)});
    const auto other = half.other_point.find(point.name);
    if (other != half.other_point.end()) result.points.push_back({other->second, id(point.vertex, true)});
  }
  std::sort(result.points.begin(), result.points.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return result;
}

}  // namespace

Result<PanelMesh> mesh_panel(const pattern::CutPanel& panel, const GridSettings& settings) {
  // An unfolded panel is meshed as half of it, so that it is symmetric to the last bit. Internal lines that are asked for
  // must be asked for on both halves; a single direction of diagonals cannot be symmetric.
  const auto half = settings.alternating ? half_of(panel) : std::nullopt;
  bool symmetric = half.has_value();
  if (half) {
    const auto asked = [&](const std::string& name) { return std::find(settings.lines.begin(), settings.lines.end(), name) != settings.lines.end(); };
    for (const auto& [here, there] : half->other_line) symmetric = symmetric && asked(here) == asked(there);
  }
  if (!symmetric) return mesh_whole(panel, settings, panel.fold);
  auto mesh = mesh_whole(half->panel, settings, panel.fold);
  if (!mesh) return mesh_whole(panel, settings, panel.fold);
  return unfolded(*mesh, *half, panel, settings);
}

PanelMesh mirrored(const PanelMesh& mesh) {
  PanelMesh result = mesh;
  result.uv.col(0) = -result.uv.col(0);
  result.faces.col(1).swap(result.faces.col(2));
  for (GridRun& run : result.runs) {
    std::reverse(run.vertices.begin(), run.vertices.end());
    for (auto& [vertex, s] : run.vertices) s = run.length - s;
  }
  return result;
}

}  // namespace toile::tailor
