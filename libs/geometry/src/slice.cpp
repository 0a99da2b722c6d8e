#include "toile/geometry/slice.h"

#include "toile/base/result.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace toile::geometry {

namespace {

struct Basis {
  Eigen::Vector3d u, v;
};

/// Two directions that span the plane; u x v points along the normal.
Basis plane_basis(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = normal.normalized();
  // The axis least aligned with the normal: never nearly parallel to it.
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(n[k]) < std::abs(n[axis])) axis = k;
  }
  const Eigen::Vector3d u = Eigen::Vector3d::Unit(axis).cross(n).normalized();
  return {u, n.cross(u)};
}

using Key = std::pair<int, int>;
Key key(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

std::vector<Polyline> slice(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane) {
  return slice(x, faces, plane, {});
}

std::vector<Polyline> slice(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane,
                            const std::vector<char>& keep) {
  TOILE_CHECK(plane.normal.norm() > 0, "plane without a normal");
  TOILE_CHECK(keep.empty() || keep.size() == static_cast<std::size_t>(faces.rows()), "keep {} faces {}", keep.size(), faces.rows());
  const Eigen::VectorXd height = (x.rowwise() - plane.point.transpose()) * plane.normal.normalized();
  struct Step {
    Key from, to;
    int face;
  };
  std::vector<Step> steps;
  for (int f = 0; f < faces.rows(); ++f) {
    if (!keep.empty() && !keep[static_cast<std::size_t>(f)]) continue;
    int above = 0;
    for (int k = 0; k < 3; ++k) above += height[faces(f, k)] >= 0;
    if (above == 0 || above == 3) continue;
    // The lone corner on its side of the plane, and the walking direction that keeps the inside to the left.
    int lone = 0;
    while ((height[faces(f, lone)] >= 0) != (above == 1)) ++lone;
    const int a = faces(f, lone), b = faces(f, (lone + 1) % 3), c = faces(f, (lone + 2) % 3);
    const Key first = key(a, b), second = key(a, c);
    if (above == 1) steps.push_back({first, second, f});
    else steps.push_back({second, first, f});
  }
  std::map<Key, std::size_t> step_from, step_to;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    step_from.emplace(steps[i].from, i);
    step_to.emplace(steps[i].to, i);
  }
  const auto point = [&](const Key& edge) -> Eigen::Vector3d {
    const double ha = height[edge.first], hb = height[edge.second];
    const double t = ha / (ha - hb);
    return (1 - t) * x.row(edge.first).transpose() + t * x.row(edge.second).transpose();
  };
  std::vector<char> used(steps.size(), 0);
  std::vector<Polyline> curves;
  for (std::size_t seed = 0; seed < steps.size(); ++seed) {
    if (used[seed]) continue;
    // Back to the curve's beginning, if it has one.
    std::size_t first = seed;
    bool closed = false;
    while (true) {
      const auto it = step_to.find(steps[first].from);
      if (it == step_to.end() || used[it->second]) break;
      if (it->second == seed) {
        closed = true;
        first = seed;
        break;
      }
      first = it->second;
    }
    Polyline curve;
    curve.closed = closed;
    std::vector<Eigen::Vector3d> points;
    std::size_t current = first;
    while (true) {
      used[current] = 1;
      points.push_back(point(steps[current].from));
      curve.faces.push_back(steps[current].face);
      const auto it = step_from.find(steps[current].to);
      if (it == step_from.end() || used[it->second]) {
        if (!closed) points.push_back(point(steps[current].to));
        break;
      }
      current = it->second;
    }
    curve.points.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) curve.points.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
    curves.push_back(std::move(curve));
  }
  return curves;
}

double length(const Polyline& curve) {
  double total = 0;
  const Eigen::Index n = curve.points.rows();
  for (Eigen::Index i = 0; i + 1 < n; ++i) total += (curve.points.row(i + 1) - curve.points.row(i)).norm();
  if (curve.closed && n > 1) total += (curve.points.row(0) - curve.points.row(n - 1)).norm();
  return total;
}

double enclosed_area(const Polyline& curve, const Eigen::Vector3d& normal) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Eigen::Index n = curve.points.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d a = curve.points.row(i) - curve.points.row(0), b = curve.points.row((i + 1) % n) - curve.points.row(0);
    sum += a.cross(b) / 2;
  }
  return std::abs(sum.dot(normal.normalized()));
}

Points3 convex_hull(const Eigen::Ref<const Points3>& points, const Eigen::Vector3d& normal) {
  const auto [u, v] = plane_basis(normal);
  struct Item {
    double a, b;
    Eigen::Index row;
  };
  std::vector<Item> items;
  for (Eigen::Index i = 0; i < points.rows(); ++i) items.push_back({points.row(i).dot(u), points.row(i).dot(v), i});
  std::sort(items.begin(), items.end(), [](const Item& p, const Item& q) { return std::tie(p.a, p.b, p.row) < std::tie(q.a, q.b, q.row); });
  items.erase(std::unique(items.begin(), items.end(), [](const Item& p, const Item& q) { return p.a == q.a && p.b == q.b; }), items.end());
  const auto turn = [](const Item& o, const Item& p, const Item& q) { return (p.a - o.a) * (q.b - o.b) - (p.b - o.b) * (q.a - o.a); };
  std::vector<Item> hull;
  // Andrew's monotone chain: the lower side from left to right, then the upper side back.
  for (int side = 0; side < 2; ++side) {
    const std::size_t base = hull.size();
    for (const Item& item : items) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), item) <= 0) hull.pop_back();
      hull.push_back(item);
    }
    if (items.size() > 1) hull.pop_back();
    std::reverse(items.begin(), items.end());
  }
  Points3 result(static_cast<Eigen::Index>(hull.size()), 3);
  for (std::size_t i = 0; i < hull.size(); ++i) result.row(static_cast<Eigen::Index>(i)) = points.row(hull[i].row);
  return result;
}

double tape_girth(const Eigen::Ref<const Points3>& points, const Eigen::Vector3d& normal) {
  if (points.rows() < 2) return 0;
  const Points3 hull = convex_hull(points, normal);
  double total = 0;
  for (Eigen::Index i = 0; i < hull.rows(); ++i) total += (hull.row((i + 1) % hull.rows()) - hull.row(i)).norm();
  return total;
}

bool encloses(const Polyline& curve, const Eigen::Vector3d& normal, const Eigen::Vector3d& point) {
  if (!curve.closed) return false;
  const auto [u, v] = plane_basis(normal);
  const double pa = point.dot(u), pb = point.dot(v);
  bool inside = false;
  const Eigen::Index n = curve.points.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p = curve.points.row(i), q = curve.points.row((i + 1) % n);
    const double ya = p.dot(v) - pb, yb = q.dot(v) - pb;
    if ((ya >= 0) == (yb >= 0)) continue;
    const double xa = p.dot(u) - pa, xb = q.dot(u) - pa;
    if (xa + (xb - xa) * (ya / (ya - yb)) > 0) inside = !inside;
  }
  return inside;
}

double tape_girth_around(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, const Plane& plane,
                         const Eigen::Vector3d& axis_point) {
  double best_area = 0, girth = 0;
  for (const Polyline& curve : slice(x, faces, plane)) {
    if (!encloses(curve, plane.normal, axis_point)) continue;
    const double area = enclosed_area(curve, plane.normal);
    if (girth > 0 && area >= best_area) continue;
    best_area = area;
    girth = tape_girth(curve.points, plane.normal);
  }
  return girth;
}

}  // namespace toile::geometry
