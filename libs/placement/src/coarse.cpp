#include "toile/placement/coarse.h"

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

}  // namespace

CoarseGarment coarsen(const mesh::GarmentMesh& garment, double size) {
  const int n = static_cast<int>(garment.vertex_count());
  const auto uv = [&](int v) { return Vector2d(garment.uv.row(v).transpose()); };
  const auto at = [](auto& list, int i) -> auto& { return list[static_cast<std::size_t>(i)]; };

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
  const auto chained = [&](std::size_t i) {  // weld i follows weld i - 1 along the same seam and panels
    return welds[i].seam == welds[i - 1].seam && garment.vertex_panel[welds[i].a] == garment.vertex_panel[welds[i - 1].a] &&
           garment.vertex_panel[welds[i].b] == garment.vertex_panel[welds[i - 1].b] && (uv(welds[i].a) - uv(welds[i - 1].a)).norm() < 2 * size &&
           (uv(welds[i].b) - uv(welds[i - 1].b)).norm() < 2 * size;
  };
  for (std::size_t i = 0; i < welds.size(); ++i) {
    if (i == 0 || !chained(i)) at(keep, welds[i].a) = at(keep, welds[i].b) = 1;
    if (i + 1 == welds.size() || !chained(i + 1)) at(keep, welds[i].a) = at(keep, welds[i].b) = 1;
  }
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
      const int pieces = std::max(1, static_cast<int>(std::lround(length / size)));
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
        const int pieces = std::max(m <= 2 * (last - first) ? 3 : 1, static_cast<int>(std::lround(length / size)));
        for (int k = 1; k < pieces; ++k) {
          const auto it = std::lower_bound(s.begin(), s.end(), length * k / pieces);
          const int v = loop[(origin + first + static_cast<std::size_t>(it - s.begin())) % m];
          if (!at(welded, v)) at(keep, v) = 1;
        }
      }
      first = last;
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
    // Interior: the fine vertex nearest to every node of a grid.
    std::map<std::pair<long, long>, std::pair<double, int>> nodes;
    for (int v = 0; v < n; ++v) {
      if (garment.vertex_panel[v] != panel || at(on_border, v)) continue;
      const Vector2d q = uv(v) / size;
      const std::pair<long, long> key{std::lround(q.x()), std::lround(q.y())};
      const double d = (q - Vector2d(static_cast<double>(key.first), static_cast<double>(key.second))).squaredNorm();
      const auto it = nodes.find(key);
      if (it == nodes.end() || d < it->second.first - 1e-9) nodes[key] = {d, v};
    }
    for (const auto& [key, node] : nodes) {
      const Vector2d q = uv(node.second);
      if (node.first > 0.1 || !inside(outlines, q) || distance_sq(outlines, q) < 0.3 * size * size) continue;
      triangulation.insert({q.x(), q.y()})->info() = node.second;
    }
    for (const auto& handle : handles) {
      for (std::size_t i = 0; i < handle.size(); ++i) triangulation.insert_constraint(handle[i], handle[(i + 1) % handle.size()]);
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
    // Where fine vertices are in it.
    parallel_for(members.size(), 64, [&](std::size_t i) {
      const int v = members[i];
      double best = -1e18;
      for (const auto& t : own) {
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
      }
    });
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

}  // namespace toile::placement
