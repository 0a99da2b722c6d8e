// Closest points and approach of single pairs, against long double arithmetic and dense sampling in time.
#include "toile/contact/distance.h"

#include "toile/base/rng.h"

#include <gtest/gtest.h>

#include <string>

namespace toile::contact {
namespace {

using Long = Eigen::Matrix<long double, 3, 1>;

long double point_segment_sq(const Long& p, const Long& a, const Long& b) {
  const Long ab = b - a;
  const long double size = ab.squaredNorm();
  const long double t = size > 0 ? std::clamp<long double>((p - a).dot(ab) / size, 0, 1) : 0;
  return (p - a - t * ab).squaredNorm();
}

// By cases: the interior where the projection falls inside, else the edges.
long double reference_vertex_face_sq(const std::array<Long, 4>& x) {
  const auto& [p, a, b, c] = x;
  long double best = std::min({point_segment_sq(p, a, b), point_segment_sq(p, b, c), point_segment_sq(p, c, a)});
  const Long n = (b - a).cross(c - a);
  const long double size = n.squaredNorm();
  if (size > 0) {
    const bool inside = n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 && n.dot((a - c).cross(p - c)) >= 0;
    const long double h = n.dot(p - a);
    if (inside) best = std::min(best, h * h / size);
  }
  return best;
}

long double reference_edge_edge_sq(const std::array<Long, 4>& x) {
  const auto& [a, b, c, d] = x;
  long double best = std::min({point_segment_sq(a, c, d), point_segment_sq(b, c, d), point_segment_sq(c, a, b), point_segment_sq(d, a, b)});
  const Long u = b - a, v = d - c, r = a - c;
  const long double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), det = uu * vv - uv * uv;
  if (det > 0) {
    const long double s = (uv * v.dot(r) - u.dot(r) * vv) / det, t = (uu * v.dot(r) - uv * u.dot(r)) / det;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) best = std::min(best, (r + s * u - t * v).squaredNorm());
  }
  return best;
}

std::array<Long, 4> widened(const std::array<Vec, 4>& x) {
  return {x[0].cast<long double>(), x[1].cast<long double>(), x[2].cast<long double>(), x[3].cast<long double>()};
}

Vec random_vec(Rng& rng, double size) { return Vec(rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)); }

// Four nodes, often in special position.
std::array<Vec, 4> configuration(Rng& rng, int kind) {
  std::array<Vec, 4> x;
  for (Vec& p : x) p = random_vec(rng, 0.01);
  switch (kind) {
    case 1:  // coplanar
      for (Vec& p : x) p[2] = 0.003;
      break;
    case 2:  // parallel second edge
      x[3] = x[2] + rng.uniform(-2, 2) * (x[1] - x[0]);
      break;
    case 3:  // nearly parallel
      x[3] = x[2] + rng.uniform(-2, 2) * (x[1] - x[0]) + random_vec(rng, 1e-9);
      break;
    case 4:  // collinear: a face without area, edges on one line
      for (int k = 1; k < 4; ++k) x[k] = x[0] + rng.uniform(-1, 1) * Vec(0.3, 0.4, 0.5) * 0.01;
      break;
    case 5:  // edge without length
      x[1] = x[0];
      break;
    case 6:  // point
      x[3] = x[2];
      break;
    case 7:  // sliver
      x[3] = 0.3 * x[1] + 0.7 * x[2] + random_vec(rng, 1e-8);
      break;
    case 8:  // all on an integer lattice
      for (Vec& p : x) p = Vec(rng.below(3), rng.below(3), rng.below(3)) * 0.01;
      break;
    default:
      break;
  }
  const Vec far = kind % 2 == 0 ? Vec(1.3, -0.4, 0.9) : Vec::Zero();  // coordinates much larger than the pair
  for (Vec& p : x) p += far;
  return x;
}

TEST(ContactDistance, MatchesLongDoubleReference) {
  Rng rng(1);
  for (int kind = 0; kind < 9; ++kind) {
    SCOPED_TRACE("configuration " + std::to_string(kind));
    double worst_face = 0, worst_edge = 0;
    for (int i = 0; i < 20000; ++i) {
      const auto x = configuration(rng, kind);
      const Closest face = closest_vertex_face(x[0], x[1], x[2], x[3]), edge = closest_edge_edge(x[0], x[1], x[2], x[3]);
      worst_face = std::max(worst_face, std::abs(std::sqrt(face.distance_sq) - double(std::sqrt(reference_vertex_face_sq(widened(x))))));
      worst_edge = std::max(worst_edge, std::abs(std::sqrt(edge.distance_sq) - double(std::sqrt(reference_edge_edge_sq(widened(x))))));
      // The weights name points of the two primitives, and their distance is the stated one.
      Vec face_gap = Vec::Zero(), edge_gap = Vec::Zero();
      for (int k = 0; k < 4; ++k) face_gap += face.weight[k] * x[k], edge_gap += edge.weight[k] * x[k];
      ASSERT_NEAR(face_gap.norm(), std::sqrt(face.distance_sq), 1e-12);
      ASSERT_NEAR(edge_gap.norm(), std::sqrt(edge.distance_sq), 1e-12);
      ASSERT_EQ(face.weight[0], 1);
      ASSERT_NEAR(face.weight[1] + face.weight[2] + face.weight[3], -1, 1e-14);
      ASSERT_NEAR(edge.weight[0] + edge.weight[1], 1, 1e-14);
      ASSERT_NEAR(edge.weight[2] + edge.weight[3], -1, 1e-14);
      for (int k = 0; k < 4; ++k) {
        ASSERT_TRUE(k == 0 ? face.weight[k] == 1 : face.weight[k] <= 0);
        ASSERT_TRUE(k < 2 ? edge.weight[k] >= 0 : edge.weight[k] <= 0);
      }
    }
    EXPECT_LT(worst_face, kind == 4 || kind == 7 ? 1e-9 : 1e-12);
    EXPECT_LT(worst_edge, 1e-12);
  }
}

template <PairType type>
void check_approach(std::uint64_t seed) {
  Rng rng(seed);
  int impacts = 0, free = 0, crossings = 0;
  for (int kind = 0; kind < 9; ++kind) {
    SCOPED_TRACE("configuration " + std::to_string(kind));
    for (int i = 0; i < 6000; ++i) {
      const auto x = configuration(rng, kind);
      std::array<Vec, 4> u;
      const int motion = static_cast<int>(rng.below(4));
      const Vec common = random_vec(rng, 0.02);
      for (Vec& d : u) d = motion == 0 ? random_vec(rng, 0.01) : Vec(common * (motion == 1) + random_vec(rng, motion == 3 ? 1e-5 : 0.004));
      if (motion == 2) {  // on a course towards each other
        for (int k = 0; k < (type == PairType::vertex_face ? 1 : 2); ++k) u[k] += rng.uniform(0.5, 2) * (x[2] + x[3] - x[0] - x[1]) * 0.5;
      }
      const double separation = rng.uniform() < 0.5 ? 5e-5 : 1e-6;
      const Approach a = approach<type>(x, u, separation);
      const double start = std::sqrt(closest<type>(x).distance_sq);
      if (a.touching) {
        ASSERT_LT(start, touching_distance);
        continue;
      }
      const double floor = separation_floor(start, separation);
      // Never below the floor up to the stated time.
      double least = start, least_beyond = start;
      for (int s = 0; s <= 400; ++s) {
        const double t = s / 400.0;
        std::array<Vec, 4> y;
        for (int k = 0; k < 4; ++k) y[k] = x[k] + t * u[k];
        const double d = std::sqrt(closest<type>(y).distance_sq);
        if (t <= a.time) least = std::min(least, d);
        least_beyond = std::min(least_beyond, d);
      }
      ASSERT_GE(least, floor * (1 - 1e-9) - 1e-13) << "time " << a.time;
      if (a.impact) {
        ++impacts;
        // An impact is real: at the stated time the pair is within 1.1 of its floor.
        std::array<Vec, 4> y;
        for (int k = 0; k < 4; ++k) y[k] = x[k] + a.time * u[k];
        ASSERT_LE(std::sqrt(closest<type>(y).distance_sq), 1.1 * floor + 1e-13);
      } else {
        ASSERT_EQ(a.time, 1);
        ++free;
      }
      crossings += least_beyond < floor;
    }
  }
  EXPECT_GT(impacts, 500);
  EXPECT_GT(free, 5000);
  EXPECT_GT(crossings, 100);
}

TEST(ContactApproach, VertexFaceAgainstDenseSampling) { check_approach<PairType::vertex_face>(2); }
TEST(ContactApproach, EdgeEdgeAgainstDenseSampling) { check_approach<PairType::edge_edge>(3); }

// Head-on, sliding, resting and parting motions with a known answer.
TEST(ContactApproach, KnownTimes) {
  const std::array<Vec, 4> x{Vec(0.2, 0.2, 1), Vec(0, 0, 0), Vec(1, 0, 0), Vec(0, 1, 0)};
  const auto move = [&](const Vec& d) { return std::array<Vec, 4>{d, Vec::Zero(), Vec::Zero(), Vec::Zero()}; };
  const Approach down = approach<PairType::vertex_face>(x, move(Vec(0, 0, -2)), 0.01);
  EXPECT_TRUE(down.impact);
  EXPECT_NEAR(down.time, 0.495, 0.001);
  EXPECT_FALSE(approach<PairType::vertex_face>(x, move(Vec(0.5, 0.1, -0.98)), 0.01).impact);
  EXPECT_FALSE(approach<PairType::vertex_face>(x, move(Vec(0, 0, 5)), 0.01).impact);
  // Resting at the separation and sliding along the face.
  std::array<Vec, 4> resting = x;
  resting[0][2] = 2e-5;
  EXPECT_FALSE(approach<PairType::vertex_face>(resting, move(Vec(0.3, 0.3, 0)), 1e-5).impact);
  // All nodes moving together.
  const std::array<Vec, 4> carried{Vec(3, 1, -7), Vec(3, 1, -7), Vec(3, 1, -7), Vec(3, 1, -7)};
  EXPECT_FALSE(approach<PairType::vertex_face>(resting, carried, 1e-5).impact);
  // Edges swept through one another.
  const std::array<Vec, 4> cross{Vec(-1, 0, 0), Vec(1, 0, 0), Vec(0, -1, 1), Vec(0, 1, 1)};
  const std::array<Vec, 4> fall{Vec::Zero(), Vec::Zero(), Vec(0, 0, -4), Vec(0, 0, -4)};
  const Approach edge = approach<PairType::edge_edge>(cross, fall, 1e-3);
  EXPECT_TRUE(edge.impact);
  EXPECT_NEAR(edge.time, 0.25, 0.001);
}

}  // namespace
}  // namespace toile::contact
