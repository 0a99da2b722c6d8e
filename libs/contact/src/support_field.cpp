#include "toile/contact/support_field.h"

#include "toile/base/result.h"
#include "tree.h"

#include <limits>
#include <numbers>

namespace toile::contact {
namespace {

// Below this distance the direction to the closest point is rounding, and the surface's own normal is used [m].
constexpr double direction_floor = 1e-9;

#if defined(__SSE2__)
double box_distance_sq(const Box& box, const Vec& p) {
  alignas(16) float lo[4], hi[4];
  _mm_store_ps(lo, box.lo);
  _mm_store_ps(hi, box.hi);
#else
double box_distance_sq(const Box& box, const Vec& p) {
  const float *lo = box.lo, *hi = box.hi;
#endif
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = std::max({static_cast<double>(lo[k]) - p[k], 0.0, p[k] - static_cast<double>(hi[k])});
    sum += d * d;
  }
  return sum;
}

double solid_angle(const Vec& a, const Vec& b, const Vec& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

struct SupportField::Impl {
  Tree tree;
  Boxes boxes;
  std::vector<Vec> x;
  std::vector<int> local_face;                   // surface face -> local
  std::vector<std::array<int, 3>> local_edges;   // of local faces: edge k joins corners k and k+1
  std::vector<Vec> face_normal, edge_normal, vertex_normal;
  struct Moment {
    Vec area = Vec::Zero();    // sum of area vectors
    Vec centre = Vec::Zero();  // weighted by area
    double radius = 0;         // of all corners about the centre
    double size = 0;           // area
  };
  std::vector<Moment> moments;  // of tree nodes

  Impl(const Surface& surface, const Points3& positions) : tree(surface, positions) {
    std::vector<int> local_edge(surface.edges.size());
    for (std::size_t e = 0; e < tree.edge_id.size(); ++e) local_edge[tree.edge_id[e]] = static_cast<int>(e);
    local_face.resize(tree.face_id.size());
    for (std::size_t f = 0; f < tree.face_id.size(); ++f) {
      local_face[tree.face_id[f]] = static_cast<int>(f);
      const auto& e = surface.face_edges[tree.face_id[f]];
      local_edges.push_back({local_edge[e[0]], local_edge[e[1]], local_edge[e[2]]});
    }
    move(positions);
  }

  void move(const Points3& positions) {
    x.resize(tree.vertex_id.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = positions.row(tree.vertex_id[i]).transpose();
    boxes.refit(tree, x, x, 0);
    face_normal.assign(tree.face.size(), Vec::Zero());
    edge_normal.assign(tree.edge.size(), Vec::Zero());
    vertex_normal.assign(x.size(), Vec::Zero());
    std::vector<Vec> area(tree.face.size());
    for (std::size_t f = 0; f < tree.face.size(); ++f) {
      const auto& t = tree.face[f];
      area[f] = 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
      const double size = area[f].norm();
      if (size > 0) face_normal[f] = area[f] / size;
      for (int k = 0; k < 3; ++k) {
        edge_normal[local_edges[f][k]] += face_normal[f];
        const Vec p = x[t[(k + 1) % 3]] - x[t[k]], q = x[t[(k + 2) % 3]] - x[t[k]];
        vertex_normal[t[k]] += std::atan2(p.cross(q).norm(), p.dot(q)) * face_normal[f];
      }
    }
    for (auto* list : {&edge_normal, &vertex_normal}) {
      for (Vec& n : *list) {
        const double size = n.norm();
        if (size > 0) n /= size;
      }
    }
    moments.assign(tree.nodes.size(), {});
    for (int i = static_cast<int>(tree.nodes.size()) - 1; i >= 0; --i) {
      Moment& m = moments[i];
      const int left = tree.nodes[i].left;
      if (left < 0) {
        const int leaf = ~left;
        for (int f = tree.leaf_face[leaf]; f < tree.leaf_face[leaf + 1]; ++f) {
          const auto& t = tree.face[f];
          m.area += area[f];
          m.size += area[f].norm();
          m.centre += area[f].norm() * (x[t[0]] + x[t[1]] + x[t[2]]) / 3;
        }
        m.centre = m.size > 0 ? Vec(m.centre / m.size) : x[tree.face[tree.leaf_face[leaf]][0]];
        for (int f = tree.leaf_face[leaf]; f < tree.leaf_face[leaf + 1]; ++f) {
          for (const int v : tree.face[f]) m.radius = std::max(m.radius, (x[v] - m.centre).norm());
        }
      } else {
        const Moment &a = moments[left], &b = moments[left + 1];
        m.area = a.area + b.area;
        m.size = a.size + b.size;
        m.centre = m.size > 0 ? Vec((a.size * a.centre + b.size * b.centre) / m.size) : a.centre;
        m.radius = std::max((a.centre - m.centre).norm() + a.radius, (b.centre - m.centre).norm() + b.radius);
      }
    }
  }

  struct Best {
    double distance_sq = INFINITY;
    int id = std::numeric_limits<int>::max();  // surface face
    int face = -1;                             // local
    std::array<double, 3> weight{};
  };
  void try_face(const Vec& p, int f, Best& best) const {
    const auto& t = tree.face[f];
    const Closest c = closest_vertex_face(p, x[t[0]], x[t[1]], x[t[2]]);
    if (c.distance_sq < best.distance_sq || (c.distance_sq == best.distance_sq && tree.face_id[f] < best.id)) {
      best = {c.distance_sq, tree.face_id[f], f, {-c.weight[1], -c.weight[2], -c.weight[3]}};
    }
  }

  // The nearest face, the lowest id on ties: the order of the search does not matter.
  Best search(const Vec& p, double reach_sq, int warm) const {
    Best best;
    best.distance_sq = reach_sq;
    if (warm >= 0) try_face(p, warm, best);
    struct Entry {
      int node;
      double distance_sq;
    };
    Entry stack[64];
    int top = 0;
    stack[top++] = {0, box_distance_sq(boxes.node[0], p)};
    constexpr double slack = 1 + 1e-12;  // rounding of distances must not hide a tie
    while (top > 0) {
      const Entry e = stack[--top];
      if (e.distance_sq > best.distance_sq * slack) continue;
      const int left = tree.nodes[e.node].left;
      if (left < 0) {
        const int leaf = ~left;
        for (int f = tree.leaf_face[leaf]; f < tree.leaf_face[leaf + 1]; ++f) {
          if (box_distance_sq(boxes.face[f], p) <= best.distance_sq * slack) try_face(p, f, best);
        }
        continue;
      }
      Entry near{left, box_distance_sq(boxes.node[left], p)}, far{left + 1, box_distance_sq(boxes.node[left + 1], p)};
      if (far.distance_sq < near.distance_sq) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
    }
    return best;
  }

  SurfacePoint resolve(const Vec& p, const Best& best) const {
    SurfacePoint s;
    const auto& t = tree.face[best.face];
    s.face = best.id;
    s.weight = best.weight;
    s.point = best.weight[0] * x[t[0]] + best.weight[1] * x[t[1]] + best.weight[2] * x[t[2]];
    const int zeros = (best.weight[0] == 0) + (best.weight[1] == 0) + (best.weight[2] == 0);
    Vec n = face_normal[best.face];
    for (int k = 0; k < 3; ++k) {
      if (zeros == 2 && best.weight[k] != 0) n = vertex_normal[t[k]];
      if (zeros == 1 && best.weight[k] == 0) n = edge_normal[local_edges[best.face][(k + 1) % 3]];
    }
    const Vec away = p - s.point;
    const double size = std::sqrt(best.distance_sq);
    const double sign = away.dot(n) < 0 ? -1 : 1;
    s.distance = sign * size;
    s.normal = size > direction_floor ? Vec(sign * away.normalized()) : n;
    return s;
  }

  double winding_number(const Vec& p) const {
    // The dipole of a far node stands for its faces (Barill et al. 2018).
    constexpr double far = 2.5;
    double total = 0;
    int stack[64];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const int i = stack[--top];
      const Moment& m = moments[i];
      const Vec d = m.centre - p;
      const double distance_sq = d.squaredNorm();
      if (distance_sq > far * far * m.radius * m.radius) {
        total += m.area.dot(d) / (distance_sq * std::sqrt(distance_sq));
        continue;
      }
      const int left = tree.nodes[i].left;
      if (left >= 0) {
        stack[top++] = left + 1;
        stack[top++] = left;
        continue;
      }
      for (int f = tree.leaf_face[~left]; f < tree.leaf_face[~left + 1]; ++f) {
        const auto& t = tree.face[f];
        total += solid_angle(x[t[0]] - p, x[t[1]] - p, x[t[2]] - p);
      }
    }
    return total / (4 * std::numbers::pi);
  }

  bool in_bounds(const Vec& p) const { return box_distance_sq(boxes.node[0], p) == 0; }
};

SupportField::SupportField(const Surface& support, const Points3& x) {
  TOILE_CHECK(x.rows() == support.node_count, "positions {} nodes {}", x.rows(), support.node_count);
  TOILE_CHECK(support.faces.rows() > 0, "faces {}", support.faces.rows());
  impl_ = std::make_unique<Impl>(support, x);
}
SupportField::~SupportField() = default;
SupportField::SupportField(SupportField&&) noexcept = default;
SupportField& SupportField::operator=(SupportField&&) noexcept = default;

void SupportField::move(const Points3& x) { impl_->move(x); }

SurfacePoint SupportField::nearest(const Eigen::Vector3d& x) const { return impl_->resolve(x, impl_->search(x, INFINITY, -1)); }

void SupportField::nearest(const Points3& x, double reach, std::vector<SurfacePoint>& out, std::vector<int>& warm) const {
  const std::size_t count = static_cast<std::size_t>(x.rows());
  out.resize(count);
  warm.resize(count, -1);
  const Impl& field = *impl_;
  parallel_for(count, 256, [&](std::size_t i) {
    const Vec p = x.row(i).transpose();
    const bool known = warm[i] >= 0 && warm[i] < static_cast<int>(field.local_face.size());
    // Outside the support's bounds nothing can be inside, so that the search may stop at the reach.
    const double reach_sq = field.in_bounds(p) ? INFINITY : reach * reach;
    const Impl::Best best = field.search(p, reach_sq, known ? field.local_face[warm[i]] : -1);
    if (best.face < 0) {
      out[i] = {reach, p, Vec::Zero(), -1, {}};
      return;
    }
    warm[i] = best.id;
    out[i] = field.resolve(p, best);
    if (out[i].distance > reach) out[i] = {reach, p, Vec::Zero(), -1, {}};
  });
}

double SupportField::winding_number(const Eigen::Vector3d& x) const { return impl_->winding_number(x); }

std::vector<Penetration> SupportField::penetrations(const Points3& x, const std::vector<int>& vertices) const {
  std::vector<double> depth(vertices.size(), 0);
  parallel_for(vertices.size(), 256, [&](std::size_t i) {
    const Vec p = x.row(vertices[i]).transpose();
    if (impl_->in_bounds(p) && impl_->winding_number(p) > 0.5) depth[i] = std::sqrt(impl_->search(p, INFINITY, -1).distance_sq);
  });
  std::vector<Penetration> inside;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (depth[i] > 0) inside.push_back({vertices[i], depth[i]});
  }
  return inside;
}

PushedOut project_outside(const SupportField& field, const Surface& cloth, const Points3& x, double clearance) {
  TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
  TOILE_CHECK(clearance > 0, "clearance {}", clearance);
  const int count = cloth.node_count;
  std::vector<int> first(count + 1, 0), neighbour;
  for (const auto& [a, b] : cloth.edges) ++first[a + 1], ++first[b + 1];
  for (int i = 0; i < count; ++i) first[i + 1] += first[i];
  neighbour.resize(2 * cloth.edges.size());
  std::vector<int> fill(first.begin(), first.end() - 1);
  for (const auto& [a, b] : cloth.edges) neighbour[fill[a]++] = b, neighbour[fill[b]++] = a;

  PushedOut result{.x = x};
  std::vector<SurfacePoint> at;
  std::vector<int> warm;
  std::vector<Vec> push(count), next(count);
  constexpr int passes = 40, plain_passes = 15, sweeps = 12;
  const double goal = clearance * (1 + 1e-6);
  for (int pass = 0; pass < passes; ++pass) {
    field.nearest(result.x, goal, at, warm);
    int near = 0, inside = 0;
    for (const int v : cloth.vertices) {
      near += at[v].face >= 0 && at[v].distance < clearance;
      inside += at[v].face >= 0 && at[v].distance < 0;
    }
    if (pass == 0) result.inside_before = inside;
    result.nearer_after = near;
    if (near == 0) break;
    const auto needed = [&](int v) { return at[v].face >= 0 && at[v].distance < clearance ? goal - at[v].distance : 0.0; };
    for (int v = 0; v < count; ++v) {
      push[v] = Vec::Zero();
      if (const double way = needed(v); way > 0) push[v] = way * at[v].normal;
    }
    // The displacement spreads over neighbours and fades with distance, but nowhere falls short of what is needed there.
    // The last passes leave neighbours alone, so that spreading cannot push others in for ever.
    for (int sweep = 0; sweep < sweeps && pass < passes - plain_passes; ++sweep) {
      parallel_for(count, 1024, [&](std::size_t v) {
        Vec mean = Vec::Zero();
        for (int i = first[v]; i < first[v + 1]; ++i) mean += push[neighbour[i]];
        const int degree = first[v + 1] - first[v];
        if (degree > 0) mean /= degree + 0.3;
        if (const double way = needed(static_cast<int>(v)); way > 0) {
          const Vec& n = at[v].normal;
          mean += std::max(0.0, way - mean.dot(n)) * n;
        }
        next[v] = mean;
      });
      std::swap(push, next);
    }
    for (int v = 0; v < count; ++v) result.x.row(v) += push[v].transpose();
  }
  for (int v = 0; v < count; ++v) {
    const double way = (result.x.row(v) - x.row(v)).norm();
    result.moved += way > 0;
    result.largest_move = std::max(result.largest_move, way);
  }
  return result;
}

}  // namespace toile::contact
