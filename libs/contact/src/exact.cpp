#include <Eigen/Geometry>
#include "toile/contact/exact.h"

#include "toile/base/result.h"
#include "tree.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include <algorithm>

namespace toile::contact {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

Point point(const Vec& p) { return Point(p[0], p[1], p[2]); }

// A face as what it is: a triangle, or the segment or point that it has collapsed to.
struct Shape {
  Kernel::Triangle_3 triangle;
  bool flat = false;
  Kernel::Segment_3 segment;  // of a flat face: its longest extent
};

Shape shape(const std::array<Vec, 3>& x) {
  Shape s;
  const Point p[3] = {point(x[0]), point(x[1]), point(x[2])};
  s.triangle = Kernel::Triangle_3(p[0], p[1], p[2]);
  s.flat = CGAL::collinear(p[0], p[1], p[2]);
  if (s.flat) {
    // Of three collinear points the lexicographic extremes span the others.
    const auto [lo, hi] = std::minmax({p[0], p[1], p[2]});
    s.segment = Kernel::Segment_3(lo, hi);
  }
  return s;
}

bool point_on(const Point& p, const Shape& s) {
  if (s.flat) return s.segment.is_degenerate() ? p == s.segment.source() : s.segment.has_on(p);
  return s.triangle.has_on(p);
}

bool intersect(const Shape& s, const Shape& t) {
  if (!s.flat && !t.flat) return CGAL::do_intersect(s.triangle, t.triangle);
  if (s.flat && s.segment.is_degenerate()) return point_on(s.segment.source(), t);
  if (t.flat && t.segment.is_degenerate()) return point_on(t.segment.source(), s);
  if (s.flat && t.flat) return CGAL::do_intersect(s.segment, t.segment);
  return s.flat ? CGAL::do_intersect(s.segment, t.triangle) : CGAL::do_intersect(t.segment, s.triangle);
}

// Opposite sides of a plane by a clear margin: a quick proof that two triangles do not meet. The error of the
// determinants below is far less than the margin.
bool clearly_apart(const std::array<Vec, 3>& s, const std::array<Vec, 3>& t) {
  const Vec n = (s[1] - s[0]).cross(s[2] - s[0]);
  double size = 0, lo = INFINITY, hi = -INFINITY;
  for (const Vec& p : t) {
    const double d = n.dot(p - s[0]);
    lo = std::min(lo, d), hi = std::max(hi, d);
    size = std::max(size, (p - s[0]).cwiseAbs().maxCoeff());
  }
  const double longest = std::max((s[1] - s[0]).cwiseAbs().maxCoeff(), (s[2] - s[0]).cwiseAbs().maxCoeff());
  // Differences of coordinates carry errors relative to the coordinates themselves.
  const double coordinates = std::max({s[0].cwiseAbs().maxCoeff(), t[0].cwiseAbs().maxCoeff(), 1.0});
  const double margin = 1e-14 * coordinates * (longest + 1e-15) * (longest + size + 1e-15) * 32;
  return lo > margin || hi < -margin;
}

std::vector<Vec> positions(const Tree& tree, const Points3& x) {
  std::vector<Vec> at(tree.vertex_id.size());
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = x.row(tree.vertex_id[i]).transpose();
  return at;
}

std::array<Vec, 3> corners(const Tree& tree, const std::vector<Vec>& x, int face) {
  return {x[tree.face[face][0]], x[tree.face[face][1]], x[tree.face[face][2]]};
}

std::vector<FacePair> collected(std::vector<std::vector<FacePair>>& parts) {
  std::vector<FacePair> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end());
  return all;
}

bool meet(const std::array<Vec, 3>& s, const std::array<Vec, 3>& t) {
  if (clearly_apart(s, t) || clearly_apart(t, s)) return false;
  return intersect(shape(s), shape(t));
}

constexpr std::size_t grain = 64;

}  // namespace

std::vector<FacePair> self_intersections(const Surface& cloth, const Points3& x) {
  TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
  const Tree tree(cloth, x);
  const std::vector<Vec> at = positions(tree, x);
  Boxes boxes;
  boxes.refit(tree, at, at, 0);
  std::vector<std::vector<FacePair>> parts((tree.leaf_count() + grain - 1) / grain);
  parallel_chunks(tree.leaf_count(), grain, [&](std::size_t begin, std::size_t end) {
    auto& out = parts[begin / grain];
    const auto test = [&](int i, int j) {
      if (!overlap(boxes.face[i], boxes.face[j])) return;
      for (const int p : tree.face[i]) {
        for (const int q : tree.face[j]) {
          if (tree.adjacency[p] == tree.adjacency[q]) return;
        }
      }
      if (meet(corners(tree, at, i), corners(tree, at, j))) {
        out.push_back({std::min(tree.face_id[i], tree.face_id[j]), std::max(tree.face_id[i], tree.face_id[j])});
      }
    };
    for (int leaf = static_cast<int>(begin); leaf < static_cast<int>(end); ++leaf) {
      for (int i = tree.leaf_face[leaf]; i < tree.leaf_face[leaf + 1]; ++i) {
        for (int j = i + 1; j < tree.leaf_face[leaf + 1]; ++j) test(i, j);
        for_each_leaf(tree, boxes, boxes.face[i], leaf + 1, [&](int other) {
          for (int j = tree.leaf_face[other]; j < tree.leaf_face[other + 1]; ++j) test(i, j);
        });
      }
    }
  });
  return collected(parts);
}

std::vector<FacePair> support_intersections(const Surface& cloth, const Points3& x, const Surface& support, const Points3& support_x) {
  TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
  TOILE_CHECK(support_x.rows() == support.node_count, "positions {} nodes {}", support_x.rows(), support.node_count);
  const Tree tree(cloth, x), support_tree(support, support_x);
  const std::vector<Vec> at = positions(tree, x), support_at = positions(support_tree, support_x);
  Boxes boxes, support_boxes;
  boxes.refit(tree, at, at, 0);
  support_boxes.refit(support_tree, support_at, support_at, 0);
  std::vector<std::vector<FacePair>> parts((tree.leaf_count() + grain - 1) / grain);
  parallel_chunks(tree.leaf_count(), grain, [&](std::size_t begin, std::size_t end) {
    auto& out = parts[begin / grain];
    for (int i = tree.leaf_face[begin]; i < tree.leaf_face[end]; ++i) {
      for_each_leaf(support_tree, support_boxes, boxes.face[i], 0, [&](int other) {
        for (int j = support_tree.leaf_face[other]; j < support_tree.leaf_face[other + 1]; ++j) {
          if (!overlap(boxes.face[i], support_boxes.face[j])) continue;
          if (meet(corners(tree, at, i), corners(support_tree, support_at, j))) out.push_back({tree.face_id[i], support_tree.face_id[j]});
        }
      });
    }
  });
  return collected(parts);
}

}  // namespace toile::contact
