#include "triangulate.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <optional>
#include <tuple>

namespace toile::tailor {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel, CGAL::Triangulation_face_base_with_info_2<int, Kernel>>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::No_constraint_intersection_tag>;

Issue crossing(const Point& a, const Point& b) {
  return Issue{"coarse_grid", {}, fmt::format("border and lines, drawn with edges of cell length, cross near ({:.2f}, {:.2f}) cells", 0.5 * (a + b).x(), 0.5 * (a + b).y()), "choose smaller cells"};
}

/// Where two edges cross, of the pairs that do the one farthest to the left.
std::optional<Point> first_crossing(const std::vector<Point>& points, std::vector<std::pair<int, int>> edges) {
  const auto at = [&](int v) { return points[static_cast<std::size_t>(v)]; };
  const auto left = [&](const std::pair<int, int>& e) { return std::min(at(e.first).x(), at(e.second).x()); };
  const auto right = [&](const std::pair<int, int>& e) { return std::max(at(e.first).x(), at(e.second).x()); };
  const auto cross = [](const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); };
  std::sort(edges.begin(), edges.end(), [&](const auto& a, const auto& b) { return std::tuple(left(a), a) < std::tuple(left(b), b); });
  for (std::size_t i = 0; i < edges.size(); ++i) {
    for (std::size_t j = i + 1; j < edges.size() && left(edges[j]) <= right(edges[i]); ++j) {
      const auto [a, b] = edges[i];
      const auto [c, d] = edges[j];
      if (a == c || a == d || b == c || b == d) continue;
      const Point u = at(b) - at(a), w = at(d) - at(c);
      const double d0 = cross(u, at(c) - at(a)), d1 = cross(u, at(d) - at(a)), d2 = cross(w, at(a) - at(c)), d3 = cross(w, at(b) - at(c));
      if (d0 * d1 <= 0 && d2 * d3 <= 0 && d2 != d3) return at(a) + u * (d2 / (d2 - d3));
    }
  }
  return std::nullopt;
}

}  // namespace

Result<std::vector<Triple>> triangulate_strip(const std::vector<Point>& points, std::vector<std::pair<int, int>> walls,
                                              const std::vector<std::pair<int, int>>& constraints) {
  for (auto& [a, b] : walls) {
    if (a > b) std::swap(a, b);
  }
  std::sort(walls.begin(), walls.end());
  std::vector<std::pair<int, int>> single;
  for (std::size_t i = 0; i < walls.size();) {
    std::size_t j = i;
    while (j < walls.size() && walls[j] == walls[i]) ++j;
    if ((j - i) % 2 == 1) single.push_back(walls[i]);
    i = j;
  }
  // A side of a regular cell may lie on a constraint.
  std::vector<std::pair<int, int>> all = single;
  for (const auto& [a, b] : constraints) all.emplace_back(std::min(a, b), std::max(a, b));
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  Cdt cdt;
  std::vector<Cdt::Vertex_handle> handles(points.size());
  try {
    Cdt::Face_handle hint;
    for (std::size_t i = 0; i < points.size(); ++i) {
      handles[i] = cdt.insert(Kernel::Point_2(points[i].x(), points[i].y()), hint);
      handles[i]->info() = static_cast<int>(i);
      hint = handles[i]->face();
    }
    if (cdt.number_of_vertices() != points.size()) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (handles[i]->info() != static_cast<int>(i)) return crossing(points[i], points[i]);
      }
    }
    for (const auto& [a, b] : all) cdt.insert_constraint(handles[a], handles[b]);
  } catch (const Cdt::Intersection_of_constraints_exception&) {
    // CGAL does not say where.
    if (const auto where = first_crossing(points, all)) return crossing(*where, *where);
    return Issue{"coarse_grid", {}, "border and lines, drawn with edges of cell length, cross", "choose smaller cells"};
  }
  for (const auto& [a, b] : all) {
    if (!cdt.is_edge(handles[a], handles[b])) return crossing(points[a], points[b]);
  }
  // Flood from outside; crossing a wall changes sides.
  for (auto face : cdt.all_face_handles()) face->info() = -1;
  std::vector<Cdt::Face_handle> stack{cdt.infinite_face()};
  stack.back()->info() = 0;
  while (!stack.empty()) {
    const Cdt::Face_handle face = stack.back();
    stack.pop_back();
    for (int k = 0; k < 3; ++k) {
      const Cdt::Face_handle next = face->neighbor(k);
      if (next->info() >= 0) continue;
      bool wall = false;
      const auto p = face->vertex(Cdt::cw(k)), q = face->vertex(Cdt::ccw(k));
      if (!cdt.is_infinite(p) && !cdt.is_infinite(q) && face->is_constrained(k)) {
        wall = std::binary_search(single.begin(), single.end(), std::pair{std::min(p->info(), q->info()), std::max(p->info(), q->info())});
      }
      next->info() = wall ? 1 - face->info() : face->info();
      stack.push_back(next);
    }
  }
  std::vector<Triple> triangles;
  for (auto face : cdt.finite_face_handles()) {
    if (face->info() != 1) continue;
    Triple t{face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    triangles.push_back(t);
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace toile::tailor
