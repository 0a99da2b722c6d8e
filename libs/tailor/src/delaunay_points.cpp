#include "delaunay_points.h"

#include "triangulate.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_size_criteria_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

namespace toile::tailor {
namespace {

struct Label {
  int id = -1;  ///< of an input point
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Label, Kernel>;
using FaceBase = CGAL::Delaunay_mesh_face_base_2<Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::No_constraint_intersection_tag>;
using Criteria = CGAL::Delaunay_mesh_size_criteria_2<Cdt>;

/// Longest edge that refinement leaves [cells]; gives about one vertex a cell.
constexpr double longest_edge = 1.6;
constexpr int rounds = 6;  ///< of smoothing

Point position(const Cdt::Vertex_handle& v) { return {v->point().x(), v->point().y()}; }

}  // namespace

Result<RefinedPoints> refine_delaunay(const std::vector<Point>& points, const std::vector<std::pair<int, int>>& walls, const std::vector<std::pair<int, int>>& constraints) {
  // The triangulation of what is there tells crossings, and which triangles are inside.
  TOILE_TRY(const std::vector<Triple> coarse, triangulate_strip(points, walls, constraints));
  Cdt cdt;
  std::vector<Cdt::Vertex_handle> handles;
  Cdt::Face_handle hint;
  for (std::size_t i = 0; i < points.size(); ++i) {
    handles.push_back(cdt.insert(Kernel::Point_2(points[i].x(), points[i].y()), hint));
    handles.back()->info().id = static_cast<int>(i);
    hint = handles.back()->face();
  }
  for (const auto* edges : {&walls, &constraints}) {
    for (const auto& [a, b] : *edges) cdt.insert_constraint(handles[static_cast<std::size_t>(a)], handles[static_cast<std::size_t>(b)]);
  }
  for (auto face : cdt.all_face_handles()) face->set_in_domain(false);
  for (auto face : cdt.finite_face_handles()) {
    Triple t{face->vertex(0)->info().id, face->vertex(1)->info().id, face->vertex(2)->info().id};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    face->set_in_domain(std::binary_search(coarse.begin(), coarse.end(), t));
  }
  CGAL::Delaunay_mesher_2<Cdt, Criteria> mesher(cdt, Criteria(0.125, longest_edge));
  mesher.init(true);
  mesher.refine_mesh();

  // New vertices: on an edge they have two constrained neighbours, along which its ends are found.
  std::map<std::pair<int, int>, std::size_t> edge_of;
  for (std::size_t e = 0; e < walls.size() + constraints.size(); ++e) {
    const auto& [a, b] = e < walls.size() ? walls[e] : constraints[e - walls.size()];
    edge_of.emplace(std::minmax(a, b), e);
  }
  RefinedPoints result;
  const auto line_neighbours = [&](Cdt::Vertex_handle v) {
    std::vector<Cdt::Vertex_handle> found;
    auto edge = cdt.incident_edges(v);
    const auto first = edge;
    do {
      if (edge->first->is_constrained(edge->second)) {
        const auto a = edge->first->vertex(Cdt::cw(edge->second)), b = edge->first->vertex(Cdt::ccw(edge->second));
        found.push_back(a == v ? b : a);
      }
    } while (++edge != first);
    return found;
  };
  for (const Cdt::Vertex_handle v : cdt.finite_vertex_handles()) {
    if (v->info().id >= 0) continue;
    const auto around = line_neighbours(v);
    if (around.empty()) {
      result.inner.push_back(position(v));
      continue;
    }
    TOILE_CHECK(around.size() == 2, "a point on an edge has {} neighbours on it", around.size());
    std::array<int, 2> ends{};
    for (std::size_t e = 0; e < 2; ++e) {
      Cdt::Vertex_handle before = v, here = around[e];
      while (here->info().id < 0) {
        const auto next = line_neighbours(here);
        const auto other = next[0] == before ? next[1] : next[0];
        before = here;
        here = other;
      }
      ends[e] = here->info().id;
    }
    const auto found = edge_of.find(std::minmax(ends[0], ends[1]));
    TOILE_CHECK(found != edge_of.end(), "no edge {} {}", ends[0], ends[1]);
    const auto& [a, b] = found->second < walls.size() ? walls[found->second] : constraints[found->second - walls.size()];
    const Point from = points[static_cast<std::size_t>(a)], to = points[static_cast<std::size_t>(b)];
    result.on_edges.push_back({found->second, (position(v) - from).dot(to - from) / (to - from).squaredNorm()});
  }
  std::sort(result.on_edges.begin(), result.on_edges.end(), [](const auto& a, const auto& b) { return std::tie(a.edge, a.t) < std::tie(b.edge, b.t); });
  const auto by_place = [](const Point& a, const Point& b) { return std::tuple(std::floor(a.y() / 2), a.x(), a.y()) < std::tuple(std::floor(b.y() / 2), b.x(), b.y()); };
  std::sort(result.inner.begin(), result.inner.end(), by_place);

  // Smoothing: inner points go to the middle of their stars, the triangulation is made anew.
  std::vector<Point> all = points;
  std::vector<std::pair<int, int>> all_walls, all_constraints;
  std::size_t next = 0;
  for (std::size_t e = 0; e < walls.size() + constraints.size(); ++e) {
    const auto& [a, b] = e < walls.size() ? walls[e] : constraints[e - walls.size()];
    auto& list = e < walls.size() ? all_walls : all_constraints;
    int last = a;
    for (; next < result.on_edges.size() && result.on_edges[next].edge == e; ++next) {
      list.emplace_back(last, static_cast<int>(all.size()));
      last = static_cast<int>(all.size());
      all.push_back(points[static_cast<std::size_t>(a)] + result.on_edges[next].t * (points[static_cast<std::size_t>(b)] - points[static_cast<std::size_t>(a)]));
    }
    list.emplace_back(last, b);
  }
  const std::size_t inner = all.size();
  all.insert(all.end(), result.inner.begin(), result.inner.end());
  for (int round = 0; round < rounds; ++round) {
    TOILE_TRY(const std::vector<Triple> triangles, triangulate_strip(all, all_walls, all_constraints));
    std::vector<Point> middle(all.size(), Point::Zero());
    std::vector<double> weight(all.size(), 0);
    for (const Triple& t : triangles) {
      const Point a = all[static_cast<std::size_t>(t[0])], b = all[static_cast<std::size_t>(t[1])], c = all[static_cast<std::size_t>(t[2])], p = b - a, q = c - a;
      const double area = 0.5 * (p.x() * q.y() - p.y() * q.x());
      for (int v : t) {
        middle[static_cast<std::size_t>(v)] += area * (a + b + c) / 3;
        weight[static_cast<std::size_t>(v)] += area;
      }
    }
    // Stars of constrained Delaunay triangulations are not always convex: a middle outside would turn a triangle over.
    std::vector<Point> moved = all;
    for (std::size_t v = inner; v < all.size(); ++v) {
      if (weight[v] > 0) moved[v] = middle[v] / weight[v];
    }
    std::vector<char> bad(all.size(), 0);
    for (const Triple& t : triangles) {
      if (smallest_angle(moved[static_cast<std::size_t>(t[0])], moved[static_cast<std::size_t>(t[1])], moved[static_cast<std::size_t>(t[2])]) > 0) continue;
      for (int v : t) bad[static_cast<std::size_t>(v)] = 1;
    }
    for (std::size_t v = inner; v < all.size(); ++v) {
      if (!bad[v]) all[v] = moved[v];
    }
  }
  result.inner.assign(all.begin() + static_cast<std::ptrdiff_t>(inner), all.end());
  return result;
}

}  // namespace toile::tailor
