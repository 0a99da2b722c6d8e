#include "toile/geometry/wrap.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace toile::geometry {

Wrap wrap(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, double width, double offset) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_3> points;
  points.reserve(static_cast<std::size_t>(x.rows()));
  for (Eigen::Index i = 0; i < x.rows(); ++i) points.emplace_back(x(i, 0), x(i, 1), x(i, 2));
  std::vector<std::array<std::size_t, 3>> soup(static_cast<std::size_t>(faces.rows()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) soup[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] = static_cast<std::size_t>(faces(f, k));
  }
  CGAL::Surface_mesh<Kernel::Point_3> surface;
  CGAL::alpha_wrap_3(points, soup, width / 2, offset, surface);

  Wrap result;
  result.x.resize(static_cast<Eigen::Index>(surface.number_of_vertices()), 3);
  std::vector<int> row(static_cast<std::size_t>(surface.num_vertices()), -1);
  int next = 0;
  for (const auto v : surface.vertices()) {
    const auto& p = surface.point(v);
    row[static_cast<std::size_t>(v)] = next;
    result.x.row(next++) << p.x(), p.y(), p.z();
  }
  result.faces.resize(static_cast<Eigen::Index>(surface.number_of_faces()), 3);
  Eigen::Index count = 0;
  for (const auto f : surface.faces()) {
    int k = 0;
    for (const auto v : CGAL::vertices_around_face(surface.halfedge(f), surface)) result.faces(count, k++) = row[static_cast<std::size_t>(v)];
    ++count;
  }

  using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>;
  std::vector<Kernel::Triangle_3> triangles;
  std::vector<int> input;  // row of each
  for (std::size_t f = 0; f < soup.size(); ++f) {
    const auto& t = soup[f];
    const Kernel::Triangle_3 triangle(points[t[0]], points[t[1]], points[t[2]]);
    if (triangle.is_degenerate()) continue;
    triangles.push_back(triangle);
    input.push_back(static_cast<int>(f));
  }
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree(triangles.cbegin(), triangles.cend());
  double square = 0;
  for (Eigen::Index i = 0; i < result.x.rows() && !triangles.empty(); ++i) {
    square = std::max(square, tree.squared_distance(Kernel::Point_3(result.x(i, 0), result.x(i, 1), result.x(i, 2))));
  }
  result.farthest = std::sqrt(square);
  for (Eigen::Index f = 0; f < result.faces.rows() && !triangles.empty(); ++f) {
    const Eigen::Vector3d middle = (result.x.row(result.faces(f, 0)) + result.x.row(result.faces(f, 1)) + result.x.row(result.faces(f, 2))).transpose() / 3;
    const auto nearest = tree.closest_point_and_primitive(Kernel::Point_3(middle.x(), middle.y(), middle.z())).second;
    result.nearest.push_back(input[static_cast<std::size_t>(nearest - triangles.cbegin())]);
  }
  return result;
}

}  // namespace toile::geometry
