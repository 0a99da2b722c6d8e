#include "nearest.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace toile::inspect {
namespace {

using Eigen::Vector3d;

double box_distance_sq(const Vector3d& p, const Vector3d& low, const Vector3d& high) { return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm(); }

double segment_distance_sq(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d d = b - a;
  const double length_sq = d.squaredNorm();
  const double t = length_sq > 0 ? std::clamp((p - a).dot(d) / length_sq, 0.0, 1.0) : 0.0;
  return (p - a - t * d).squaredNorm();
}

}  // namespace

NearestSurface::NearestSurface(const mesh::Points3& x, const mesh::Triangles& faces) : x_(x), faces_(faces) {
  order_.resize(static_cast<std::size_t>(faces.rows()));
  std::iota(order_.begin(), order_.end(), 0);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) middle_.push_back((x.row(faces(f, 0)) + x.row(faces(f, 1)) + x.row(faces(f, 2))) / 3);
  if (!order_.empty()) build(0, static_cast<int>(order_.size()));
}

int NearestSurface::build(int begin, int end) {
  const int id = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  node.high = -node.low;
  node.begin = begin;
  node.end = end;
  Vector3d low = node.low, high = node.high;
  for (int i = begin; i < end; ++i) {
    const int f = order_[static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) {
      const Vector3d p = x_.row(faces_(f, k));
      node.low = node.low.cwiseMin(p);
      node.high = node.high.cwiseMax(p);
    }
    low = low.cwiseMin(middle_[static_cast<std::size_t>(f)]);
    high = high.cwiseMax(middle_[static_cast<std::size_t>(f)]);
  }
  if (end - begin > 4) {
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    const int half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end, [&](int a, int b) {
      const double p = middle_[static_cast<std::size_t>(a)][axis], q = middle_[static_cast<std::size_t>(b)][axis];
      return p < q || (p == q && a < b);
    });
    node.left = build(begin, half);
    node.right = build(half, end);
  }
  nodes_[static_cast<std::size_t>(id)] = node;
  return id;
}

double NearestSurface::to_face(const Vector3d& p, int face) const {
  const Vector3d a = x_.row(faces_(face, 0)), b = x_.row(faces_(face, 1)), c = x_.row(faces_(face, 2));
  const Vector3d n = (b - a).cross(c - a);
  const double n_sq = n.squaredNorm();
  if (n_sq > 0 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 && n.dot((a - c).cross(p - c)) >= 0) {
    const double d = n.dot(p - a);
    return d * d / n_sq;
  }
  return std::min({segment_distance_sq(p, a, b), segment_distance_sq(p, b, c), segment_distance_sq(p, c, a)});
}

double NearestSurface::distance(const Vector3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  if (nodes_.empty()) return best;
  std::vector<std::pair<double, int>> stack{{0, 0}};
  while (!stack.empty()) {
    const auto [bound, id] = stack.back();
    stack.pop_back();
    if (bound >= best) continue;
    const Node& node = nodes_[static_cast<std::size_t>(id)];
    if (node.left < 0) {
      for (int i = node.begin; i < node.end; ++i) best = std::min(best, to_face(p, order_[static_cast<std::size_t>(i)]));
      continue;
    }
    const Node &l = nodes_[static_cast<std::size_t>(node.left)], &r = nodes_[static_cast<std::size_t>(node.right)];
    std::pair<double, int> first{box_distance_sq(p, l.low, l.high), node.left}, second{box_distance_sq(p, r.low, r.high), node.right};
    if (second.first < first.first) std::swap(first, second);
    stack.push_back(second);
    stack.push_back(first);
  }
  return std::sqrt(best);
}

}  // namespace toile::inspect
