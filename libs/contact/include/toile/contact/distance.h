// Closest points of two primitives and the earliest approach of two moving ones. The innermost functions of the search.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace toile::contact {

using Vec = Eigen::Vector3d;

/// Closest points of two primitives with four nodes: vertex 0 - face 1,2,3 or edge 0,1 - edge 2,3.
struct Closest {
  std::array<double, 4> weight;  ///< gap vector = sum_k weight[k] x_k, from second to first; first part sums to 1, second to -1
  double distance_sq = 0;        ///< [m2]
};

namespace detail {

inline double segment_parameter(const Vec& p, const Vec& a, const Vec& ab, double ab_sq) {
  return ab_sq > 0 ? std::clamp((p - a).dot(ab) / ab_sq, 0.0, 1.0) : 0.0;
}

inline void keep_nearer(Closest& best, const Closest& other) {
  if (other.distance_sq < best.distance_sq) best = other;
}

inline double vertex_face_gap_sq(const Vec& p, const Vec& a, const Vec& ab, const Vec& ac, double v, double w) {
  return (p - a - v * ab - w * ac).squaredNorm();
}

}  // namespace detail

/// Distance of p to the edge a-b; weights of (p, a, b, unused).
inline Closest closest_vertex_edge(const Vec& p, const Vec& a, const Vec& b) {
  const Vec ab = b - a;
  const double t = detail::segment_parameter(p, a, ab, ab.squaredNorm());
  return {{1, t - 1, -t, 0}, (p - a - t * ab).squaredNorm()};
}

/// Distance of p to the triangle a, b, c by regions (Ericson 2005, 5.1.5). Slivers (height below 1e-4 of the length) are
/// also measured against their edges: the result is never larger than the true distance by more than 3e-6 of the longest edge,
/// for other triangles rounding only.
/// Source: docs/bibliography.md#ericson2005
inline Closest closest_vertex_face(const Vec& p, const Vec& a, const Vec& b, const Vec& c) {
  const Vec ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  const double bb = ab.squaredNorm(), bc = ab.dot(ac), cc = ac.squaredNorm();
  const double d3 = d1 - bb, d4 = d2 - bc, d5 = d1 - bc, d6 = d2 - cc;
  double v, w;  // weights of b and c
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  if (d1 <= 0 && d2 <= 0) {
    v = w = 0;
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1, w = 0;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / (d1 - d3), w = 0;
  } else if (d6 >= 0 && d5 <= d6) {
    v = 0, w = 1;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    v = 0, w = d2 / (d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - w;
  } else {
    const double scale = 1 / (va + vb + vc);
    v = std::clamp(vb * scale, 0.0, 1.0), w = std::clamp(vc * scale, 0.0, 1.0 - v);
  }
  Closest best{{1, v + w - 1, -v, -w}, detail::vertex_face_gap_sq(p, a, ab, ac, v, w)};
  const double longest_sq = std::max(bb, cc);
  if (!(bb * cc - bc * bc > 1e-8 * longest_sq * longest_sq)) {
    if (!(best.distance_sq >= 0)) best.distance_sq = INFINITY;  // a triangle without area has no interior
    const Closest e0 = closest_vertex_edge(p, a, b), e1 = closest_vertex_edge(p, b, c), e2 = closest_vertex_edge(p, c, a);
    detail::keep_nearer(best, {{1, e0.weight[1], e0.weight[2], 0}, e0.distance_sq});
    detail::keep_nearer(best, {{1, 0, e1.weight[1], e1.weight[2]}, e1.distance_sq});
    detail::keep_nearer(best, {{1, e2.weight[2], 0, e2.weight[1]}, e2.distance_sq});
  }
  return best;
}

/// Distance of the edges a-b and c-d (Ericson 2005, 5.1.9). Nearly parallel edges (sine below 1e-5) are also measured
/// from their four ends: without that the error of the crossing parameter would make the result too large.
/// Source: docs/bibliography.md#ericson2005
inline Closest closest_edge_edge(const Vec& a, const Vec& b, const Vec& c, const Vec& d) {
  const Vec d1 = b - a, d2 = d - c, r = a - c;
  const double aa = d1.squaredNorm(), ee = d2.squaredNorm(), f = d2.dot(r);
  const double cc = d1.dot(r), bb = d1.dot(d2);
  const double det = aa * ee - bb * bb;
  double s = det > 0 ? std::clamp((bb * f - cc * ee) / det, 0.0, 1.0) : 0.0, t;
  if (!(ee > 0)) {
    t = 0;
    s = aa > 0 ? std::clamp(-cc / aa, 0.0, 1.0) : 0.0;
  } else {
    t = (bb * s + f) / ee;
    if (t < 0) {
      t = 0;
      s = aa > 0 ? std::clamp(-cc / aa, 0.0, 1.0) : 0.0;
    } else if (t > 1) {
      t = 1;
      s = aa > 0 ? std::clamp((bb - cc) / aa, 0.0, 1.0) : 0.0;
    }
  }
  Closest best{{1 - s, s, t - 1, -t}, (r + s * d1 - t * d2).squaredNorm()};
  if (!(det > 1e-10 * aa * ee)) {
    const Closest ea = closest_vertex_edge(a, c, d), eb = closest_vertex_edge(b, c, d);
    const Closest ec = closest_vertex_edge(c, a, b), ed = closest_vertex_edge(d, a, b);
    detail::keep_nearer(best, {{1, 0, ea.weight[1], ea.weight[2]}, ea.distance_sq});
    detail::keep_nearer(best, {{0, 1, eb.weight[1], eb.weight[2]}, eb.distance_sq});
    detail::keep_nearer(best, {{-ec.weight[1], -ec.weight[2], -1, 0}, ec.distance_sq});
    detail::keep_nearer(best, {{-ed.weight[1], -ed.weight[2], 0, -1}, ed.distance_sq});
  }
  return best;
}

enum class PairType { vertex_face, edge_edge };

template <PairType type>
inline Closest closest(const std::array<Vec, 4>& x) {
  if constexpr (type == PairType::vertex_face) {
    return closest_vertex_face(x[0], x[1], x[2], x[3]);
  } else {
    return closest_edge_edge(x[0], x[1], x[2], x[3]);
  }
}

/// Whether the slab across the line of centres proves that two primitives are farther apart than `distance`; cheap, and
/// false says nothing.
template <PairType type>
inline bool surely_apart(const std::array<Vec, 4>& x, double distance) {
  if constexpr (type == PairType::vertex_face) {
    const Vec a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0], m = a + b + c;
    const double gap = std::min({m.dot(a), m.dot(b), m.dot(c)});
    return gap > 0 && gap * gap > distance * distance * m.squaredNorm();
  } else {
    const Vec d1 = x[1] - x[0], d2 = x[3] - x[2], m = (x[2] + x[3]) - (x[0] + x[1]);
    const double gap = 0.5 * m.squaredNorm() - 0.5 * (std::abs(m.dot(d1)) + std::abs(m.dot(d2)));
    return gap > 0 && gap * gap > distance * distance * m.squaredNorm();
  }
}

/// Smallest distance that a pair may come to when it starts at `distance`: `separation`; half of what there is when it
/// starts within twice that; and from a fiftieth of the separation on nothing but the last 1e-12 m, so that no number of
/// steps wears the distance down to rounding.
inline double separation_floor(double distance, double separation) {
  return std::min(separation, std::max(0.5 * distance, std::min(separation / 50, distance - 1e-12)));
}

/// Distances below this count as touching: no motion can be called safe [m].
inline constexpr double touching_distance = 1e-9;

struct Approach {
  double time = 1;      ///< the straight motion x -> x + time * u keeps the floor
  bool impact = false;  ///< false: time is 1
  bool touching = false;
};

/// Conservative time up to which two primitives moving along straight ways stay apart by
/// separation_floor(distance(x), separation). Advances by the larger of two safe steps: gap over relative speed with the
/// mean motion taken out (additive advancement, Li et al. 2021) and the time until the slab between the closest points,
/// normal to their connection, is used up. A motion that never comes nearer than 1.1
/// times the floor has no impact, unless it takes more than 20000 steps to see that.
/// x, u    positions [m] and displacements [m]
/// Source: docs/bibliography.md#li2021
template <PairType type>
Approach approach(const std::array<Vec, 4>& x, const std::array<Vec, 4>& u, double separation) {
  constexpr int first = type == PairType::vertex_face ? 1 : 2;
  const auto speed_bound = [&](const Vec& mean) {
    double a = 0, b = 0;
    for (int k = 0; k < first; ++k) a = std::max(a, (u[k] - mean).squaredNorm());
    for (int k = first; k < 4; ++k) b = std::max(b, (u[k] - mean).squaredNorm());
    return std::sqrt(a) + std::sqrt(b);
  };
  const double speed = std::min(speed_bound(Vec::Zero()), speed_bound(0.25 * (u[0] + u[1] + u[2] + u[3])));
  if (speed == 0 || surely_apart<type>(x, speed + separation)) return {};
  Closest now = closest<type>(x);
  double distance = std::sqrt(now.distance_sq);
  const double floor = separation_floor(distance, separation);
  if (distance - speed >= floor) return {};
  if (distance < touching_distance) return {0, true, true};
  const double target = 0.1 * std::min(floor, distance - floor);  // gap above the floor that counts as an impact
  const double aim = floor + 0.5 * target;                        // never step nearer than this
  double time = 0;
  std::array<Vec, 4> y = x;
  for (int step = 0; step < 20000; ++step) {
    double advance = (distance - aim) / speed;
    // Along the connection's direction every node moves uniformly, so the slab lasts until the first of its pairs of
    // nodes has used it up.
    Vec n = Vec::Zero();
    for (int k = 0; k < 4; ++k) n += now.weight[k] * y[k];
    n /= distance;
    double slab = INFINITY;
    double place[4], velocity[4];
    for (int k = 0; k < 4; ++k) place[k] = n.dot(y[k] - y[3]), velocity[k] = n.dot(u[k]);
    for (int i = 0; i < first; ++i) {
      for (int j = first; j < 4; ++j) {
        const double closing = velocity[j] - velocity[i];
        if (closing > 0) slab = std::min(slab, std::max(0.0, (place[i] - place[j] - aim) / closing));
      }
    }
    advance = std::max(advance, slab);
    if (time + advance >= 1) return {};
    time += advance;
    for (int k = 0; k < 4; ++k) y[k] = x[k] + time * u[k];
    now = closest<type>(y);
    distance = std::sqrt(now.distance_sq);
    if (distance <= floor + target) return {time, true, false};
  }
  return {time, true, false};
}

}  // namespace toile::contact
