#include "toile/placement/coarse.h"

#include "toile/placement/folds.h"

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Face = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Vertex, Face>, CGAL::Exact_predicates_tag>;

constexpr double kNode = 0.1;    // a vertex stands for a grid's node up to this squared distance, in cells of the grid
constexpr double kCorner = 0.6;  // a border that turns by more than this keeps its vertex [rad]

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool inside(const std::vector<std::vector<Vector2d>>& loops, const Vector2d& p) {
  bool in = false;
  for (const auto& loop : loops) {
    for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
      if ((loop[i].y() > p.y()) == (loop[j].y() > p.y())) continue;
      if (p.x() < (loop[j].x() - loop[i].x()) * (p.y() - loop[i].y()) / (loop[j].y() - loop[i].y()) + loop[i].x()) in = !in;
    }
  }
  return in;
}

double distance_sq(const std::vector<std::vector<Vector2d>>& loops, const Vector2d& p) {
  double best = 1e18;
  for (const auto& loop : loops) {
    for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
      const Vector2d e = loop[i] - loop[j];
      const double t = std::clamp((p - loop[j]).dot(e) / std::max(e.squaredNorm(), 1e-18), 0.0, 1.0);
      best = std::min(best, (loop[j] + t * e - p).squaredNorm());
    }
  }
  return best;
}

// The wanted size, smaller in panels with narrow folded parts: a strip's width is twice its area over its outline.
std::vector<double> panel_sizes(const mesh::GarmentMesh& garment, const std::vector<FoldLine>& folds, double wanted) {
  std::vector<double> sizes(garment.panels.size(), wanted);
  if (folds.empty()) return sizes;
  const std::vector<int> part = parts_between(garment, folds);
  const int parts = part.empty() ? 0 : *std::max_element(part.begin(), part.end()) + 1;
  std::vector<double> area(static_cast<std::size_t>(parts), 0), outline(static_cast<std::size_t>(parts), 0);
  std::vector<int> panel(static_cast<std::size_t>(parts), 0);
  const Eigen::VectorXd areas = mesh::rest_areas(garment);
  for (std::size_t f = 0; f < part.size(); ++f) {
    area[static_cast<std::size_t>(part[f])] += areas[static_cast<Eigen::Index>(f)];
    panel[static_cast<std::size_t>(part[f])] = garment.face_panel[static_cast<Eigen::Index>(f)];
  }
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    const double length = (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm();
    const int a = part[static_cast<std::size_t>(edge.faces[0])], b = edge.faces.size() > 1 ? part[static_cast<std::size_t>(edge.faces[1])] : -1;
    if (a == b) continue;
    outline[static_cast<std::size_t>(a)] += length;
    if (b >= 0) outline[static_cast<std::size_t>(b)] += length;
  }
  for (std::size_t k = 0; k < area.size(); ++k) {
    double& size = sizes[static_cast<std::size_t>(panel[k])];
    size = std::min(size, 2 * area[k] / outline[k]);
  }
  return sizes;
}

}  // namespace

CoarseGarment coarsen(const mesh::GarmentMesh& garment, double wanted) {
  const int n = static_cast<int>(garment.vertex_count());
  const auto uv = [&](int v) { return Vector2d(garment.uv.row(v).transpose()); };
  const auto at = [](auto& list, int i) -> auto& { return list[static_cast<std::size_t>(i)]; };

  const std::vector<FoldLine> folds = fold_lines(garment);
  const std::vector<double> sizes = panel_sizes(garment, folds, wanted);
  const auto size_at = [&](int v) { return sizes[static_cast<std::size_t>(garment.vertex_panel[v])]; };

  // Borders, and which of their vertices stay: corners, ends of named edges, ends of seams; then as many between them
  // as the size asks for, the same on both sides of a seam.
  const std::vector<std::vector<int>> loops = mesh::border_loops(garment.faces);
  std::vector<char> keep(static_cast<std::size_t>(n), 0), on_border(static_cast<std::size_t>(n), 0);
  for (const auto& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      on_border[static_cast<std::size_t>(loop[i])] = 1;
      const Vector2d a = uv(loop[(i + loop.size() - 1) % loop.size()]), b = uv(loop[i]), c = uv(loop[(i + 1) % loop.size()]);
      if (std::abs(std::atan2(cross(b - a, c - b), (b - a).dot(c - b))) > kCorner) at(keep, loop[i]) = 1;
    }
  }
  for (std::size_t i = 0; i < garment.run_vertices.size(); ++i) {
    const auto& rows = garment.run_vertices;
    if (i == 0 || rows[i - 1].run != rows[i].run || i + 1 == rows.size() || rows[i + 1].run != rows[i].run) at(keep, rows[i].vertex) = at(on_border, rows[i].vertex);
  }
  const auto& welds = garment.welds;
  const auto weld_size = [&](std::size_t i) { return std::min(size_at(welds[i].a), size_at(welds[i].b)); };
  const auto chained = [&](std::size_t i) {  // weld i follows weld i - 1 along the same seam and panels
    return welds[i].seam == welds[i - 1].seam && garment.vertex_panel[welds[i].a] == garment.vertex_panel[welds[i - 1].a] &&
           garment.vertex_panel[welds[i].b] == garment.vertex_panel[welds[i - 1].b] && (uv(welds[i].a) - uv(welds[i - 1].a)).norm() < 2 * wanted &&
           (uv(welds[i].b) - uv(welds[i - 1].b)).norm() < 2 * wanted;
  };
  for (std::size_t i = 0; i < welds.size(); ++i) {
    if (i == 0 || !chained(i)) at(keep, welds[i].a) = at(keep, welds[i].b) = 1;
    if (i + 1 == welds.size() || !chained(i + 1)) at(keep, welds[i].a) = at(keep, welds[i].b) = 1;
  }
  for (const FoldLine& fold : folds) at(keep, fold.vertices.front()) = at(keep, fold.vertices.back()) = 1;
  for (const mesh::Fastener& fastener : garment.fasteners) at(keep, fastener.a) = at(keep, fastener.b) = 1;
  const auto spread = [&] {
    bool changed = true;
    while (changed) {
      changed = false;
      for (const mesh::Weld& weld : welds) {
        if (at(keep, weld.a) == at(keep, weld.b)) continue;
        at(keep, weld.a) = at(keep, weld.b) = 1;
        changed = true;
      }
    }
  };
  spread();
  std::vector<char> fixed = keep;
  for (std::size_t first = 0; first + 1 < welds.size();) {
    std::size_t last = first + 1;
    double length = 0;
    std::vector<double> s{0};
    for (; last < welds.size() && chained(last); ++last) {
      length += (uv(welds[last].a) - uv(welds[last - 1].a)).norm();
      s.push_back(length);
      if (at(fixed, welds[last].a)) break;
    }
    if (last < welds.size() && s.size() == last - first + 1) {
      const int pieces = std::max(1, static_cast<int>(std::lround(length / weld_size(first))));
      for (int k = 1; k < pieces; ++k) {
        const auto it = std::lower_bound(s.begin(), s.end(), length * k / pieces);
        const std::size_t row = first + static_cast<std::size_t>(it - s.begin());
        at(keep, welds[row].a) = at(keep, welds[row].b) = 1;
      }
    }
    first = last;
  }
  spread();
  std::vector<char> welded(static_cast<std::size_t>(n), 0);
  for (const mesh::Weld& weld : welds) at(welded, weld.a) = at(welded, weld.b) = 1;
  for (const auto& loop : loops) {
    const std::size_t m = loop.size();
    std::size_t origin = m;
    for (std::size_t i = 0; i < m && origin == m; ++i) if (at(keep, loop[i])) origin = i;
    if (origin == m) {
      at(keep, loop[0]) = 1;
      origin = 0;
    }
    for (std::size_t first = 0; first < m;) {
      std::size_t last = first + 1;
      double length = 0;
      std::vector<double> s{0};
      bool free_edge = false;
      for (; last <= m; ++last) {
        const int v = loop[(origin + last) % m];
        length += (uv(v) - uv(loop[(origin + last - 1) % m])).norm();
        s.push_back(length);
        if (at(keep, v) || last == m) break;
        free_edge = free_edge || !at(welded, v);
      }
      if (free_edge) {
        const int pieces = std::max(m <= 2 * (last - first) ? 3 : 1, static_cast<int>(std::lround(length / size_at(loop[0]))));
        for (int k = 1; k < pieces; ++k) {
          const auto it = std::lower_bound(s.begin(), s.end(), length * k / pieces);
          const int v = loop[(origin + first + static_cast<std::size_t>(it - s.begin())) % m];
          if (!at(welded, v)) at(keep, v) = 1;
        }
      }
      first = last;
    }
  }

  // Fold lines: as many vertices as the size asks for, and those that seams have kept.
  for (const FoldLine& fold : folds) {
    std::vector<double> s{0};
    for (std::size_t i = 1; i < fold.vertices.size(); ++i) s.push_back(s.back() + (uv(fold.vertices[i]) - uv(fold.vertices[i - 1])).norm());
    const int pieces = std::max(1, static_cast<int>(std::lround(s.back() / size_at(fold.vertices[0]))));
    for (int k = 1; k < pieces; ++k) {
      const auto it = std::lower_bound(s.begin(), s.end(), s.back() * k / pieces);
      at(keep, fold.vertices[static_cast<std::size_t>(it - s.begin())]) = 1;
    }
  }

  // Sides of fold lines: a fine vertex hangs on coarse triangles of its own side.
  std::vector<int> side(static_cast<std::size_t>(n), -1);
  if (!folds.empty()) {
    const std::vector<int> part = parts_between(garment, folds);
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) at(side, garment.faces(f, k)) = part[static_cast<std::size_t>(f)];
    }
    for (const FoldLine& fold : folds) {
      for (int v : fold.vertices) at(side, v) = -1;
    }
  }

  CoarseGarment coarse;
  std::vector<int> coarse_of(static_cast<std::size_t>(n), -1);
  std::vector<std::array<int, 3>> faces;
  std::vector<int> face_panel;
  coarse.of_fine.resize(static_cast<std::size_t>(n));
  const auto number = [&](int v) {
    if (at(coarse_of, v) < 0) {
      at(coarse_of, v) = static_cast<int>(coarse.fine_of.size());
      coarse.fine_of.push_back(v);
    }
    return at(coarse_of, v);
  };
  for (std::size_t p = 0; p < garment.panels.size(); ++p) {
    const int panel = static_cast<int>(p);
    const double size = sizes[p];
    std::vector<std::vector<Vector2d>> outlines;
    Triangulation triangulation;
    std::vector<std::vector<Triangulation::Vertex_handle>> handles;
    for (const auto& loop : loops) {
      if (garment.vertex_panel[loop[0]] != panel) continue;
      std::vector<Vector2d> outline;
      std::vector<Triangulation::Vertex_handle> handle;
      for (int v : loop) {
        if (!at(keep, v)) continue;
        const Vector2d q = uv(v);
        outline.push_back(q);
        handle.push_back(triangulation.insert({q.x(), q.y()}));
        handle.back()->info() = v;
      }
      outlines.push_back(std::move(outline));
      handles.push_back(std::move(handle));
    }
    if (outlines.empty()) continue;
    // Fold lines, and what else is kept inside.
    std::vector<std::vector<Vector2d>> lines;
    std::vector<Vector2d> singles;
    std::vector<std::vector<Triangulation::Vertex_handle>> line_handles;
    std::map<int, Triangulation::Vertex_handle> handle_of;
    for (const auto& list : handles) {
      for (const auto& handle : list) handle_of.emplace(handle->info(), handle);
    }
    const auto insert = [&](int v) {
      const auto it = handle_of.find(v);
      if (it != handle_of.end()) return it->second;
      const auto handle = triangulation.insert({uv(v).x(), uv(v).y()});
      handle->info() = v;
      return handle_of.emplace(v, handle).first->second;
    };
    for (const FoldLine& fold : folds) {
      if (fold.panel != panel) continue;
      std::vector<Vector2d> line;
      std::vector<Triangulation::Vertex_handle> handle;
      for (int v : fold.vertices) {
        if (!at(keep, v)) continue;
        line.push_back(uv(v));
        handle.push_back(insert(v));
      }
      lines.push_back(std::move(line));
      line_handles.push_back(std::move(handle));
    }
    for (int v = 0; v < n; ++v) {
      if (garment.vertex_panel[v] != panel || !at(keep, v) || at(on_border, v) || handle_of.count(v)) continue;
      singles.push_back(uv(v));
      insert(v);
    }
    const auto near_kept = [&](const Vector2d& q) {
      if (distance_sq(outlines, q) < 0.3 * size * size) return true;
      for (const auto& line : lines) {
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
          if (distance_sq({{line[i], line[i + 1]}}, q) < 0.3 * size * size) return true;
        }
      }
      return std::any_of(singles.begin(), singles.end(), [&](const Vector2d& s) { return (s - q).squaredNorm() < 0.3 * size * size; });
    };
    // Interior: the fine vertex nearest to every node of a grid.
    std::map<std::pair<long, long>, std::pair<double, int>> nodes;
    for (int v = 0; v < n; ++v) {
      if (garment.vertex_panel[v] != panel || at(on_border, v) || at(keep, v)) continue;
      const Vector2d q = uv(v) / size;
      const std::pair<long, long> key{std::lround(q.x()), std::lround(q.y())};
      const double d = (q - Vector2d(static_cast<double>(key.first), static_cast<double>(key.second))).squaredNorm();
      const auto it = nodes.find(key);
      if (it == nodes.end() || d < it->second.first - 1e-9) nodes[key] = {d, v};
    }
    // Where the fine grid lies half a cell beside the nodes both ways none has its vertex: then the nearest will do.
    const auto alone = [&](const std::pair<long, long>& key) {
      for (long i = -1; i <= 1; ++i) {
        for (long j = -1; j <= 1; ++j) {
          const auto it = nodes.find({key.first + i, key.second + j});
          if (it != nodes.end() && it->second.first <= kNode) return false;
        }
      }
      return true;
    };
    for (const auto& [key, node] : nodes) {
      const Vector2d q = uv(node.second);
      if ((node.first > kNode && !alone(key)) || !inside(outlines, q) || near_kept(q)) continue;
      triangulation.insert({q.x(), q.y()})->info() = node.second;
    }
    for (const auto& handle : handles) {
      for (std::size_t i = 0; i < handle.size(); ++i) triangulation.insert_constraint(handle[i], handle[(i + 1) % handle.size()]);
    }
    for (const auto& handle : line_handles) {
      for (std::size_t i = 0; i + 1 < handle.size(); ++i) triangulation.insert_constraint(handle[i], handle[i + 1]);
    }
    std::vector<std::array<int, 3>> own;
    for (auto f = triangulation.finite_faces_begin(); f != triangulation.finite_faces_end(); ++f) {
      const std::array<int, 3> t{f->vertex(0)->info(), f->vertex(1)->info(), f->vertex(2)->info()};
      const Vector2d centre = (uv(t[0]) + uv(t[1]) + uv(t[2])) / 3;
      if (inside(outlines, centre) && cross(uv(t[1]) - uv(t[0]), uv(t[2]) - uv(t[0])) > 1e-12) own.push_back(t);
    }
    // Fixed order whatever the triangulation's: by lowest vertex first.
    for (auto& t : own) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(own.begin(), own.end());
    std::vector<int> members;
    for (int v = 0; v < n; ++v) if (garment.vertex_panel[v] == panel) members.push_back(v);
    for (const auto& t : own) {
      faces.push_back({number(t[0]), number(t[1]), number(t[2])});
      face_panel.push_back(panel);
    }
    // Where fine vertices are in it: first among the triangles whose box reaches into the vertex's cell of a grid.
    std::map<std::pair<long, long>, std::vector<std::size_t>> boxes;
    const auto cell_of = [&](const Vector2d& q) { return std::pair(static_cast<long>(std::floor(q.x() / size)), static_cast<long>(std::floor(q.y() / size))); };
    for (std::size_t k = 0; k < own.size(); ++k) {
      const Vector2d a = uv(own[k][0]), b = uv(own[k][1]), c = uv(own[k][2]);
      const auto low = cell_of(a.cwiseMin(b).cwiseMin(c) - Vector2d::Constant(1e-9)), high = cell_of(a.cwiseMax(b).cwiseMax(c) + Vector2d::Constant(1e-9));
      for (long i = low.first; i <= high.first; ++i) {
        for (long j = low.second; j <= high.second; ++j) boxes[{i, j}].push_back(k);
      }
    }
    parallel_for(members.size(), 64, [&](std::size_t i) {
      const int v = members[i];
      double best = -1e18;
      const auto consider = [&](const std::array<int, 3>& t) {
        if (at(side, v) >= 0) {
          const bool other = std::any_of(t.begin(), t.end(), [&](int w) { return at(side, w) >= 0 && at(side, w) != at(side, v); });
          if (other) return;
        }
        const Vector2d a = uv(t[0]), b = uv(t[1]), c = uv(t[2]), q = uv(v);
        const double area = cross(b - a, c - a);
        const std::array<double, 3> w{cross(c - b, q - b) / area, cross(a - c, q - c) / area, cross(b - a, q - a) / area};
        const double least = std::min({w[0], w[1], w[2]});
        // distance outside in metres rather than in weights, so that slim triangles do not attract
        const double score = least >= 0 ? least : least * std::sqrt(area);
        if (score > best + 1e-12) {
          best = score;
          coarse.of_fine[static_cast<std::size_t>(v)] = {t, w};
        }
      };
      const auto it = boxes.find(cell_of(uv(v)));
      if (it != boxes.end()) {
        for (const std::size_t k : it->second) consider(own[k]);
      }
      if (best >= 0) return;
      best = -1e18;
      for (const auto& t : own) consider(t);
    });
  }
  for (const FoldLine& fold : folds) {  // on the line: between the kept vertices before and after
    std::size_t first = 0;
    for (std::size_t last = 1; last < fold.vertices.size(); ++last) {
      if (!at(keep, fold.vertices[last])) continue;
      const int a = fold.vertices[first], b = fold.vertices[last];
      double length = 0;
      std::vector<double> s{0};
      for (std::size_t i = first + 1; i <= last; ++i) s.push_back(length += (uv(fold.vertices[i]) - uv(fold.vertices[i - 1])).norm());
      for (std::size_t i = first; i <= last; ++i) {
        const double t = s[i - first] / length;
        coarse.of_fine[static_cast<std::size_t>(fold.vertices[i])] = {{a, b, b}, {1 - t, t, 0}};
      }
      first = last;
    }
  }
  for (auto& weights : coarse.of_fine) {
    for (int& v : weights.vertex) v = at(coarse_of, v);
  }

  mesh::GarmentMesh& m = coarse.mesh;
  const Eigen::Index count = static_cast<Eigen::Index>(coarse.fine_of.size());
  m.x.resize(count, 3);
  m.uv.resize(count, 2);
  m.vertex_panel.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int v = coarse.fine_of[static_cast<std::size_t>(i)];
    m.x.row(i) = garment.x.row(v);
    m.uv.row(i) = garment.uv.row(v);
    m.vertex_panel[i] = garment.vertex_panel[v];
  }
  m.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  m.face_panel.resize(static_cast<Eigen::Index>(faces.size()));
  m.face_laminate = mesh::Ids::Constant(static_cast<Eigen::Index>(faces.size()), -1);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) m.faces(static_cast<Eigen::Index>(f), k) = faces[f][static_cast<std::size_t>(k)];
    m.face_panel[static_cast<Eigen::Index>(f)] = face_panel[f];
  }
  m.panels = garment.panels;
  m.seams = garment.seams;
  for (const mesh::Weld& weld : welds) {
    if (at(coarse_of, weld.a) >= 0 && at(coarse_of, weld.b) >= 0) m.welds.push_back({at(coarse_of, weld.a), at(coarse_of, weld.b), weld.seam});
  }
  for (const mesh::Fastener& fastener : garment.fasteners) {
    if (at(coarse_of, fastener.a) < 0 || at(coarse_of, fastener.b) < 0) continue;
    mesh::Fastener kept = fastener;
    kept.a = at(coarse_of, fastener.a);
    kept.b = at(coarse_of, fastener.b);
    m.fasteners.push_back(kept);
  }
  m.folds = garment.folds;
  for (mesh::Fold& fold : m.folds) fold.runs.clear();
  std::map<std::pair<int, int>, int> opposite;  // corner opposite a directed edge
  for (Eigen::Index f = 0; f < m.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) opposite[{m.faces(f, k), m.faces(f, (k + 1) % 3)}] = m.faces(f, (k + 2) % 3);
  }
  for (const FoldLine& fold : folds) {
    int previous = -1;
    for (int v : fold.vertices) {
      if (!at(keep, v) || at(coarse_of, v) < 0) continue;
      const int here = at(coarse_of, v);
      const auto left = opposite.find({previous, here}), right = opposite.find({here, previous});
      if (previous >= 0 && left != opposite.end() && right != opposite.end()) {
        m.hinges.push_back({previous, here, left->second, right->second, fold.angle, 1, fold.fold});
      }
      previous = here;
    }
  }
  return coarse;
}

Points3 CoarseGarment::prolonged(const Points3& coarse) const {
  Points3 fine(static_cast<Eigen::Index>(of_fine.size()), 3);
  for (std::size_t i = 0; i < of_fine.size(); ++i) {
    const Weights& w = of_fine[i];
    fine.row(static_cast<Eigen::Index>(i)) = w.weight[0] * coarse.row(w.vertex[0]) + w.weight[1] * coarse.row(w.vertex[1]) + w.weight[2] * coarse.row(w.vertex[2]);
  }
  return fine;
}

Points3 CoarseGarment::restricted(const Points3& fine) const {
  Points3 coarse(static_cast<Eigen::Index>(fine_of.size()), 3);
  for (std::size_t i = 0; i < fine_of.size(); ++i) coarse.row(static_cast<Eigen::Index>(i)) = fine.row(fine_of[i]);
  return coarse;
}

std::vector<double> CoarseGarment::restricted(const std::vector<double>& fine) const {
  std::vector<double> coarse;
  if (fine.empty()) return coarse;
  for (const int v : fine_of) coarse.push_back(fine[static_cast<std::size_t>(v)]);
  return coarse;
}

}  // namespace toile::placement
