#include "panel_grid.h"

#include "cut_open.h"
#include "delaunay_points.h"
#include "line_network.h"
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
constexpr double on_axis = 1e-9;          ///< a fold line this straight up or across is a grid line [m]
constexpr const char* fold_edge = "(fold)";  ///< the edges of half a panel along its fold begin with this
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

/// Whether an internal line is to be cut; the parts of one that holes divide are `line_1`, `line_2`, ...
bool is_cut(const GridSettings& settings, const pattern::CutPanel& panel, const std::string& line) {
  const auto whole = [&](const std::string& name) { return std::any_of(panel.lines.begin(), panel.lines.end(), [&](const auto& other) { return other.name == name; }); };
  return std::any_of(settings.cut.begin(), settings.cut.end(), [&](const std::string& name) {
    if (line == name) return true;
    return line.starts_with(name + "_") && !whole(name) && line.find_first_not_of("0123456789", name.size() + 1) == std::string::npos;
  });
}

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
/// fixed   arc lengths that must be samples, ascending; begins with 0, ends with the length
/// spans   least number of samples' spans between each two of them
/// turn    largest turn from sample to sample [rad], unless that needs more than four samples a cell
std::vector<Sample> sample_line(const Curve& curve, const std::vector<double>& fixed, const std::vector<int>& least_spans, const Cells& cells, double turn_limit) {
  // Fine table: arc length, position, and arc length measured in local sample spacings.
  const double fine = cells.reference() / 8;
  struct Row {
    double s;
    Point p;
    double size = 1, count = 0;
  };
  std::vector<Row> table;
  std::vector<std::size_t> fixed_rows;
  for (std::size_t k = 0; k + 1 < fixed.size(); ++k) {
    const double s0 = fixed[k], s1 = fixed[k + 1];
    const int steps = std::max(8, static_cast<int>(std::ceil((s1 - s0) / fine)));
    if (k == 0) fixed_rows.push_back(0), table.push_back({s0, cells(curve.point_at(s0))});
    for (int i = 1; i <= steps; ++i) {
      const double s = i == steps ? s1 : s0 + (s1 - s0) * i / steps;
      table.push_back({s, cells(curve.point_at(s))});
    }
    fixed_rows.push_back(table.size() - 1);
  }
  for (std::size_t i = 1; i + 1 < table.size(); ++i) {
    const Point a = table[i].p - table[i - 1].p, b = table[i + 1].p - table[i].p;
    const double turn = std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
    const double length = 0.5 * (a.norm() + b.norm());
    if (turn < sharp_turn && turn > turn_limit * length) table[i].size = std::clamp(turn_limit * length / turn, 0.25, 1.0);
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
    const int spans = std::max(least_spans[k], static_cast<int>(std::lround(total)));
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

/// A cell of the grid that is cut by one diagonal; vertices from its lower left, counter-clockwise.
struct Cell {
  int i = 0, j = 0;
  std::array<int, 4> v{};
};

/// Fills the border with grid nodes, cells cut in two, and the strip between cells and lines.
/// local        vertices of the lines; gets the nodes and all triangles
/// border       the border's edges; obstacles: these, internal edges, and single points
/// walls        the border's edges as vertex pairs; constraints: the internal ones
/// cells        the regular cells are appended
Issues fill_with_cells(LocalMesh& local, const std::vector<std::pair<Point, Point>>& border, const std::vector<std::pair<Point, Point>>& obstacles, std::vector<std::pair<int, int>> walls,
                       const std::vector<std::pair<int, int>>& constraints, Diagonal diagonal, std::vector<Cell>& cells) {
  const std::size_t line_vertices = local.vertices.size();
  // Grid nodes that keep clear of what is there.
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
  for (const auto& [a, b] : obstacles) obstacle(a, b);
  // Scan lines at node rows and at cell middles.
  const auto scan = [&](double offset, std::vector<char>& result) {
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(grid.nj));
    for (const auto& [a, b] : border) {
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
  for (const auto& [a, b] : obstacles) {
    const Point &lower = a.y() <= b.y() ? a : b, &upper = a.y() <= b.y() ? b : a;
    for (int j = static_cast<int>(std::floor(lower.y())); j < upper.y(); ++j) {
      const double y0 = std::max(lower.y(), j + same_place), y1 = std::min(upper.y(), j + 1 - same_place);
      if (y0 > y1) continue;
      const auto x_at = [&](double y) { return upper.y() > lower.y() ? lower.x() + (upper.x() - lower.x()) * (y - lower.y()) / (upper.y() - lower.y()) : lower.x(); };
      const bool level = upper.y() - lower.y() < same_place;
      const auto [x0, x1] = level ? std::minmax({a.x(), b.x()}) : std::minmax({x_at(y0), x_at(y1)});
      for (int i = static_cast<int>(std::floor(x0 + same_place)); i < x1 - same_place; ++i) {
        if (grid.has(i, j)) grid.cell_open[grid.at(i, j)] = 0;
      }
    }
  }
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
      cells.push_back({i, j, {a, b, c, d}});
      if (diagonal == Diagonal::single || (i + j) % 2 == 0) {
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
    const auto strip = triangulate_strip(positions, placed(std::move(walls)), placed(constraints));
    if (!strip) return strip.issues();
    for (const Triple& t : *strip) local.triangles.push_back({strip_vertices[t[0]], strip_vertices[t[1]], strip_vertices[t[2]]});
  }
  return {};
}

/// Of two diagonals of a cell whose corners were moved the shorter one [m], unless that makes an angle sharper than both
/// `good` and what is there. Equal ones alternate as they are.
void take_shorter_diagonals(LocalMesh& local, const std::vector<Cell>& grid, const Cells& cells, double good) {
  const auto find = [&](int a, int b, int c) {
    for (int t : local.stars[a]) {
      const Triple& v = local.triangles[t];
      for (int k = 0; k < 3; ++k) {
        if (v[k] == a && v[(k + 1) % 3] == b && v[(k + 2) % 3] == c) return t;
      }
    }
    return -1;
  };
  const auto length = [&](int a, int b) { return (cells.back(local.vertices[a].p) - cells.back(local.vertices[b].p)).norm(); };
  const auto least = [&](const Triple& s, const Triple& t) {
    const auto of = [&](const Triple& v) { return smallest_angle(local.vertices[v[0]].p, local.vertices[v[1]].p, local.vertices[v[2]].p); };
    return std::min(of(s), of(t));
  };
  for (const Cell& cell : grid) {
    for (int turn = 0; turn < 2; ++turn) {
      // Here the diagonal is from a to c.
      const int a = cell.v[turn], b = cell.v[turn + 1], c = cell.v[turn + 2 > 3 ? turn - 2 : turn + 2], d = cell.v[(turn + 3) % 4];
      const int first = find(a, b, c), second = find(a, c, d);
      if (first < 0 || second < 0) continue;
      if (length(b, d) < length(a, c) * (1 - 1e-9)) {
        const Triple s{a, b, d}, t{b, c, d};
        const double now = least(local.triangles[first], local.triangles[second]), then = least(s, t);
        if (then >= now || then >= good) {
          replace_triangle(local, first, s);
          replace_triangle(local, second, t);
        }
      }
      break;
    }
  }
}

Result<PanelMesh> mesh_whole(const pattern::CutPanel& panel, const GridSettings& settings, const std::optional<std::pair<Point, Point>>& fold) {
  const auto trouble = [&](Issue issue) {
    issue.place.item = panel.name;
    return issue;
  };
  Cells cells;
  cells.weft = settings.cell_weft;
  cells.warp = settings.cell_warp;
  TOILE_TRY(const LineNetwork net, line_network(panel, sharp_turn));
  const std::vector<NetworkLine>& lines = net.lines;

  Point low = Point::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t l = 0; l < net.border_lines; ++l) {
    for (double s : lines[l].curve.sample(0.1 * cells.reference())) {
      const Point p = lines[l].curve.point_at(s);
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

  // Samples of every line. Two lines between the same nodes need a sample each, or they would be one edge.
  std::vector<std::vector<Sample>> samples(lines.size());
  {
    std::vector<std::vector<int>> spans(lines.size());
    const auto sample = [&](std::size_t l) {
      std::vector<double> fixed;
      for (const auto& [s, node] : lines[l].nodes) fixed.push_back(s);
      samples[l] = sample_line(lines[l].curve, fixed, spans[l], cells, settings.turn);
    };
    std::map<std::pair<int, int>, std::vector<std::pair<std::size_t, std::size_t>>> single;
    for (std::size_t l = 0; l < lines.size(); ++l) {
      const auto& nodes = lines[l].nodes;
      for (std::size_t k = 0; k + 1 < nodes.size(); ++k) spans[l].push_back(nodes[k].second == nodes[k + 1].second ? 6 : 1);
      if (nodes.size() == 2 && lines[l].internal && is_cut(settings, panel, lines[l].name)) spans[l][0] = std::max(spans[l][0], 2);
      sample(l);
      std::size_t k = 0;
      for (std::size_t i = 0; i + 1 < samples[l].size(); ++i) {
        if (samples[l][i].fixed && samples[l][i + 1].fixed) single[std::minmax(nodes[k].second, nodes[k + 1].second)].emplace_back(l, k);
        k += samples[l][i + 1].fixed;
      }
    }
    std::set<std::size_t> again;
    for (const auto& [ends, uses] : single) {
      if (uses.size() < 2) continue;
      for (const auto& [l, k] : uses) {
        spans[l][k] = 2;
        again.insert(l);
      }
    }
    for (std::size_t l : again) sample(l);
  }

  // Vertices of the lines.
  LocalMesh local;
  std::vector<int> node_vertex(net.nodes.size(), -1);
  const auto vertex_of = [&](int node) {
    int& id = node_vertex[static_cast<std::size_t>(node)];
    if (id < 0) {
      id = static_cast<int>(local.vertices.size());
      local.vertices.push_back({cells(net.nodes[static_cast<std::size_t>(node)]), Mobility::fixed, -1, 0});
    }
    return id;
  };
  std::vector<std::vector<std::pair<int, double>>> fixed_vertices(lines.size());
  std::vector<std::pair<int, int>> walls, constraints;
  struct OnLine {
    std::size_t line;
    double s0, s1;
  };
  std::vector<OnLine> wall_lines, constraint_lines;
  const auto add_line = [&](std::size_t l) {
    std::vector<int> ids;
    std::size_t node = 0;
    for (const Sample& sample : samples[l]) {
      if (sample.fixed) {
        ids.push_back(vertex_of(lines[l].nodes[node++].second));
        fixed_vertices[l].emplace_back(ids.back(), sample.s);
      } else {
        ids.push_back(static_cast<int>(local.vertices.size()));
        local.vertices.push_back({sample.p, Mobility::slide, static_cast<int>(l), sample.s / cells.reference()});
      }
    }
    for (std::size_t k = 0; k + 1 < ids.size(); ++k) {
      (lines[l].internal ? constraints : walls).emplace_back(ids[k], ids[k + 1]);
      (lines[l].internal ? constraint_lines : wall_lines).push_back({l, samples[l][k].s, samples[l][k + 1].s});
    }
  };
  for (std::size_t l = 0; l < lines.size(); ++l) add_line(l);
  std::vector<GridPoint> points;
  for (const auto& [name, node] : net.points) points.push_back({name, vertex_of(node)});
  const auto too_coarse = [&](const Issues& issues) {
    Issue issue = issues.front();
    issue.what += fmt::format(" (cells of {:.3g} x {:.3g} mm)", cells.weft * 1e3, cells.warp * 1e3);
    return trouble(issue);
  };
  const auto positions = [&] {
    std::vector<Point> result;
    for (const LocalVertex& vertex : local.vertices) result.push_back(vertex.p);
    return result;
  };

  std::vector<Cell> grid_cells;
  if (settings.mesher == Mesher::delaunay) {
    const auto fresh = refine_delaunay(positions(), walls, constraints);
    if (!fresh) return too_coarse(fresh.issues());
    std::vector<std::pair<int, int>> all_walls, all_constraints;
    std::size_t next = 0;
    for (std::size_t e = 0; e < walls.size() + constraints.size(); ++e) {
      const bool wall = e < walls.size();
      const auto [a, b] = wall ? walls[e] : constraints[e - walls.size()];
      const OnLine& on = wall ? wall_lines[e] : constraint_lines[e - walls.size()];
      auto& list = wall ? all_walls : all_constraints;
      int last = a;
      for (; next < fresh->on_edges.size() && fresh->on_edges[next].edge == e; ++next) {
        const double s = on.s0 + (on.s1 - on.s0) * fresh->on_edges[next].t;
        list.emplace_back(last, static_cast<int>(local.vertices.size()));
        last = list.back().second;
        local.vertices.push_back({cells(lines[on.line].curve.point_at(s)), Mobility::slide, static_cast<int>(on.line), s / cells.reference()});
      }
      list.emplace_back(last, b);
    }
    walls = std::move(all_walls);
    constraints = std::move(all_constraints);
    for (const Point& p : fresh->inner) local.vertices.push_back({p, Mobility::free, -1, 0});
    const auto triangles = triangulate_strip(positions(), walls, constraints);
    if (!triangles) return too_coarse(triangles.issues());
    local.triangles = *triangles;
  } else {
    std::vector<std::pair<Point, Point>> border, all;
    for (const auto& [a, b] : walls) border.emplace_back(local.vertices[a].p, local.vertices[b].p);
    all = border;
    for (const auto& [a, b] : constraints) all.emplace_back(local.vertices[a].p, local.vertices[b].p);
    for (const GridPoint& point : points) all.emplace_back(local.vertices[point.vertex].p, local.vertices[point.vertex].p);
    if (const Issues issues = fill_with_cells(local, border, all, std::move(walls), constraints, settings.diagonal, grid_cells); !issues.empty()) return too_coarse(issues);
  }
  for (auto [a, b] : constraints) local.constraints.emplace(std::min(a, b), std::max(a, b));
  build_stars(local);
  ImproveOptions options;
  options.curve_point = [&](int curve, double s) { return cells(lines[static_cast<std::size_t>(curve)].curve.point_at(s * cells.reference())); };
  improve(local, options);
  if (settings.diagonal == Diagonal::shorter) take_shorter_diagonals(local, grid_cells, cells, options.target);
  if (settings.jitter > 0) jitter(local, settings.jitter, options.curve_point);

  // Runs as they stand now, and the final numbering: border loops in order, then everything else.
  PanelMesh result;
  std::vector<std::vector<std::pair<double, int>>> slid(lines.size());
  for (int v = 0; v < static_cast<int>(local.vertices.size()); ++v) {
    if (local.vertices[v].mobility == Mobility::slide && !local.stars[v].empty()) slid[local.vertices[v].curve].emplace_back(local.vertices[v].s * cells.reference(), v);
  }
  std::vector<int> number(local.vertices.size(), -1);
  int next = 0;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    GridRun run{lines[l].name, lines[l].curve.length(), false, lines[l].internal, {}, lines[l].allowance};
    run.reflected = lines[l].reflected;
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
  struct OnFold {
    std::vector<std::string> edges;  ///< of the half, along the line
    bool backwards = false;          ///< these edges run against the line
  };
  std::map<std::string, OnFold> on_fold;  ///< internal lines along the fold
  int axis = 0;                           ///< coordinate that the fold line holds constant
  double at = 0;                          ///< its value
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
  const auto middle_side = [&](const pattern::Curve& curve) { return side(curve.point_at(0.5 * curve.length())); };
  // Along the fold with the positive half on the left.
  Point along = Point::Zero();
  along[1 - half.axis] = half.axis == 0 ? -1 : 1;
  const auto place = [&](const Point& at) { return at.dot(along); };

  // Stretches of outline and holes on the positive side; whole holes stay as they are.
  half.panel = panel;
  half.panel.fold.reset();
  half.panel.outline.clear();
  half.panel.holes.clear();
  std::vector<std::vector<pattern::PanelEdge>> stretches;
  std::vector<pattern::PanelEdge> all_edges;
  const auto take = [&](const std::vector<pattern::PanelEdge>& loop, const std::string& hole) {
    all_edges.insert(all_edges.end(), loop.begin(), loop.end());
    const std::size_t n = loop.size();
    std::vector<char> positive;
    for (const auto& edge : loop) {
      const double where = middle_side(edge.curve);
      if (std::abs(where) <= on_axis) return false;
      positive.push_back(where > 0);
      for (const Point& end : {edge.curve.from(), edge.curve.to()}) {
        if ((where > 0) != (side(end) > 0) && std::abs(side(end)) > on_axis) return false;
      }
    }
    if (std::all_of(positive.begin(), positive.end(), [](char c) { return c == 0; })) return true;
    if (std::all_of(positive.begin(), positive.end(), [](char c) { return c != 0; })) {
      if (hole.empty()) return false;
      half.panel.holes.push_back({hole, loop});
      return true;
    }
    for (std::size_t k = 0; k < n; ++k) {
      if (!positive[k] || positive[(k + n - 1) % n]) continue;
      stretches.emplace_back();
      for (std::size_t i = k; positive[i % n]; ++i) stretches.back().push_back(loop[i % n]);
    }
    return true;
  };
  if (!take(panel.outline, "")) return std::nullopt;
  for (const auto& hole : panel.holes) {
    if (!take(hole.edges, hole.name)) return std::nullopt;
  }

  // Lines of the positive side, and those along the fold.
  std::vector<std::pair<const pattern::PanelLine*, std::pair<double, double>>> fold_lines;
  half.panel.lines.clear();
  std::size_t negative = 0;
  for (const auto& line : panel.lines) {
    const double where = middle_side(line.curve);
    if (std::abs(where) <= on_axis) {
      const double from = place(line.curve.from()), to = place(line.curve.to());
      if (std::abs(std::abs(to - from) - line.curve.length()) > on_axis || std::abs(side(line.curve.from())) > on_axis) return std::nullopt;
      fold_lines.push_back({&line, std::minmax({from, to})});
    } else if (where > 0) {
      half.panel.lines.push_back(line);
    } else {
      ++negative;
    }
  }
  if (half.panel.lines.size() != negative) return std::nullopt;

  // The stretches and the fold between them make one loop.
  if (stretches.empty()) return std::nullopt;
  std::vector<char> used(stretches.size(), 0);
  std::size_t current = 0;
  int parts = 0;
  std::map<std::string, std::pair<double, double>> fold_parts;
  while (!used[current]) {
    used[current] = 1;
    const auto& stretch = stretches[current];
    const Point first = stretch.front().curve.from(), last = stretch.back().curve.to();
    if (std::abs(side(first)) > on_axis || std::abs(side(last)) > on_axis) return std::nullopt;
    // Where the border meets the fold at less than 20 degrees the two halves are better meshed as one.
    const double steepest = std::cos(20 * std::numbers::pi / 180);
    if (stretch.front().curve.tangent_at(0).dot(-along) > steepest || stretch.back().curve.tangent_at(stretch.back().curve.length()).dot(-along) > steepest) return std::nullopt;
    half.panel.outline.insert(half.panel.outline.end(), stretch.begin(), stretch.end());
    std::optional<std::size_t> next;
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      const double start = place(stretches[k].front().curve.from());
      if (start > place(last) + on_axis && (!next || start < place(stretches[*next].front().curve.from()))) next = k;
    }
    if (!next) return std::nullopt;
    const Point end = stretches[*next].front().curve.from();
    std::vector<double> cuts{place(last)};
    std::vector<double> wanted;
    for (const auto& [line, range] : fold_lines) {
      for (double t : {range.first, range.second}) {
        if (t > place(last) + 1e-6 && t < place(end) - 1e-6) wanted.push_back(t);
      }
    }
    std::sort(wanted.begin(), wanted.end());
    for (double t : wanted) {
      if (t > cuts.back() + 1e-6) cuts.push_back(t);
    }
    cuts.push_back(place(end));
    Point here = last;
    for (std::size_t k = 1; k < cuts.size(); ++k) {
      Point to = end;
      if (k + 1 < cuts.size()) to[1 - half.axis] = cuts[k] * along[1 - half.axis];
      const std::string name = fold_edge + std::to_string(parts++);
      fold_parts[name] = {cuts[k - 1], cuts[k]};
      half.panel.outline.push_back({name, "", "", pattern::Curve({pattern::line_segment(here, to)})});
      here = to;
    }
    current = *next;
  }
  if (current != 0 || std::find(used.begin(), used.end(), 0) != used.end()) return std::nullopt;
  for (const auto& [line, range] : fold_lines) {
    Half::OnFold on;
    double covered = 0;
    for (const auto& edge : half.panel.outline) {
      const auto part = fold_parts.find(edge.name);
      if (part == fold_parts.end() || part->second.first < range.first - 2e-6 || part->second.second > range.second + 2e-6) continue;
      on.edges.push_back(edge.name);
      covered += part->second.second - part->second.first;
    }
    if (std::abs(covered - (range.second - range.first)) > 1e-5) return std::nullopt;
    on.backwards = place(line->curve.to()) < place(line->curve.from());
    std::sort(on.edges.begin(), on.edges.end(), [&](const auto& a, const auto& b) { return (fold_parts[a] < fold_parts[b]) != on.backwards; });
    half.on_fold[line->name] = on;
  }

  const auto pair_curves = [&](const auto& here, const auto& all, std::map<std::string, std::string>& names, bool reversed) {
    for (const auto& item : here) {
      if (item.name.starts_with(fold_edge)) continue;
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
  if (!pair_curves(half.panel.outline, all_edges, half.other_edge, true)) return std::nullopt;
  for (const auto& hole : half.panel.holes) {
    if (!pair_curves(hole.edges, all_edges, half.other_edge, true)) return std::nullopt;
  }
  if (2 * half.other_edge.size() != all_edges.size()) return std::nullopt;
  if (!pair_curves(half.panel.lines, panel.lines, half.other_line, false)) return std::nullopt;

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
PanelMesh unfolded(const PanelMesh& mesh, const Half& half, const pattern::CutPanel& panel) {
  const int count = static_cast<int>(mesh.uv.rows());
  std::vector<char> on_fold(static_cast<std::size_t>(count), 0);
  for (const GridRun& run : mesh.runs) {
    if (!run.name.starts_with(fold_edge)) continue;
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
      copy.reflected = run.reflected != mirrored;
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
    const auto on_fold = half.on_fold.find(line.name);
    if (on_fold == half.on_fold.end()) {
      add_run(line.name);
      continue;
    }
    GridRun run{line.name, line.curve.length(), false, true, {}, 0, line.reflected};
    for (const std::string& part : on_fold->second.edges) {
      const auto& row = std::find_if(mesh.runs.begin(), mesh.runs.end(), [&](const GridRun& other) { return other.name == part; })->vertices;
      for (std::size_t k = 0; k < row.size(); ++k) {
        const int v = row[on_fold->second.backwards ? row.size() - 1 - k : k].first;
        if (!run.vertices.empty() && k == 0) continue;
        run.vertices.emplace_back(id(v, false), (mesh.uv.row(v).transpose() - line.curve.from()).norm());
      }
    }
    run.vertices.front().second = 0;
    run.vertices.back().second = run.length;
    result.runs.push_back(std::move(run));
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

Result<PanelMesh> mesh_panel(const pattern::CutPanel& whole, const GridSettings& settings) {
  TOILE_TRY(const pattern::CutPanel cut, pattern::cut_out(whole, settings.cut));
  TOILE_TRY(const pattern::CutPanel panel, clip_lines(cut, sharp_turn));
  // An unfolded panel is meshed as half of it, so that it is symmetric to the last bit. Internal lines that are asked for
  // must be asked for on both halves; a single direction of diagonals cannot be symmetric.
  const auto half = settings.diagonal != Diagonal::single || settings.mesher == Mesher::delaunay ? half_of(panel) : std::nullopt;
  const auto symmetric = [&]() -> std::optional<PanelMesh> {
    if (!half) return std::nullopt;
    const auto mesh = mesh_whole(half->panel, settings, panel.fold);
    if (!mesh) return std::nullopt;
    return unfolded(*mesh, *half, panel);
  };
  std::optional<PanelMesh> mesh = symmetric();
  if (!mesh) {
    TOILE_TRY(mesh, mesh_whole(panel, settings, panel.fold));
  }
  mesh->area = panel.area;
  std::vector<std::string> slits;
  for (const auto& line : panel.lines) {
    if (is_cut(settings, panel, line.name)) slits.push_back(line.name);
  }
  if (slits.empty()) return std::move(*mesh);
  return cut_open(*mesh, slits, panel.name);
}

PanelMesh mirrored(const PanelMesh& mesh) {
  PanelMesh result = mesh;
  result.uv.col(0) = -result.uv.col(0);
  result.faces.col(1).swap(result.faces.col(2));
  for (GridRun& run : result.runs) {
    if (run.internal) {
      run.reflected = !run.reflected;
      continue;
    }
    std::reverse(run.vertices.begin(), run.vertices.end());
    for (auto& [vertex, s] : run.vertices) s = run.length - s;
  }
  return result;
}

}  // namespace toile::tailor
