// Figures against slow and simple ways to find them, and against their symmetries.
#include <gtest/gtest.h>

#include "shapes.h"
#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/contact/exact.h"
#include "toile/inspect/diff.h"
#include "toile/inspect/measures.h"

namespace toile::inspect {
namespace {

using Eigen::Vector3d;

/// Closest point of a triangle by trying its inside, its edges and its corners in turn.
double slow_distance(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto to_segment = [&](const Vector3d& s, const Vector3d& t) {
    const double u = std::clamp((p - s).dot(t - s) / (t - s).squaredNorm(), 0.0, 1.0);
    return (p - s - u * (t - s)).norm();
  };
  double best = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  Eigen::Matrix<double, 3, 2> sides;
  sides << b - a, c - a;
  const Eigen::Vector2d w = (sides.transpose() * sides).inverse() * sides.transpose() * (p - a);
  if (w.minCoeff() >= 0 && w.sum() <= 1) best = std::min(best, (p - a - sides * w).norm());
  return best;
}

double slow_distance(const Vector3d& p, const mesh::Points3& x, const mesh::Triangles& faces) {
  double best = 1e300;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) best = std::min(best, slow_distance(p, x.row(faces(f, 0)), x.row(faces(f, 1)), x.row(faces(f, 2))));
  return best;
}

/// Sum of solid angles over all faces.
double slow_winding(const Vector3d& p, const mesh::Points3& x, const mesh::Triangles& faces) {
  double sum = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector3d a = x.row(faces(f, 0)).transpose() - p, b = x.row(faces(f, 1)).transpose() - p, c = x.row(faces(f, 2)).transpose() - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

mesh::GarmentMesh crumpled(std::uint64_t seed, double amount) {
  auto g = shapes::tube(0.2, 0.4, 30, 12, 0.8);
  Rng rng(seed);
  for (Eigen::Index i = 0; i < g.x.size(); ++i) g.x.data()[i] += rng.uniform(-amount, amount);
  return g;
}

TEST(InspectProperty, ease_and_penetration_agree_with_every_face_tried) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto g = crumpled(seed, 0.05);
    auto body = shapes::sphere({0, 1, 0}, 0.2, 3);
    for (Eigen::Index v = 0; v < body.x.rows(); ++v) body.x(v, 0) *= 0.8 + 0.1 * static_cast<double>(seed);
    const auto distances = signed_distances(g.x, body);
    std::size_t inside = 0;
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
      const Vector3d p = g.x.row(v);
      const bool in = slow_winding(p, body.x, body.faces) > 0.5;
      inside += in;
      EXPECT_NEAR(distances[static_cast<std::size_t>(v)], (in ? -1 : 1) * slow_distance(p, body.x, body.faces), 1e-9);
    }
    EXPECT_GT(inside, 10u);
    const auto r = measure({}, g, &body);
    ASSERT_TRUE(r);
    EXPECT_EQ(r->support->penetrating_vertices, inside);
  }
}

TEST(InspectProperty, surface_distance_agrees_with_every_face_tried) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const auto a = crumpled(seed, 0.03), b = crumpled(seed + 100, 0.03);
    double slow = 0;
    for (Eigen::Index v = 0; v < a.vertex_count(); ++v) {
      slow = std::max({slow, slow_distance(a.x.row(v), b.x, b.faces), slow_distance(b.x.row(v), a.x, a.faces)});
    }
    EXPECT_NEAR(surface_distance(a.x, a.faces, b.x, b.faces), slow, 1e-12);
  }
}

TEST(InspectProperty, a_mirrored_garment_has_the_same_figures_and_the_opposite_shear) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto g = crumpled(seed, 0.01);
    auto mirrored = g;
    mirrored.x.col(0) *= -1;
    mirrored.uv.col(0) *= -1;
    mirrored.faces.col(1).swap(mirrored.faces.col(2));
    const auto a = measure({}, g, nullptr), b = measure({}, mirrored, nullptr);
    ASSERT_TRUE(a && b);
    EXPECT_TRUE(a->strain.warp.isApprox(b->strain.warp, 1e-12));
    EXPECT_TRUE(a->strain.weft.isApprox(b->strain.weft, 1e-12));
    EXPECT_TRUE(a->strain.shear.isApprox(-b->strain.shear, 1e-9));
    EXPECT_EQ(*a->self_intersections, *b->self_intersections);
    EXPECT_NEAR(a->area, b->area, 1e-12);
    EXPECT_NEAR(a->openings[0].tape, b->openings[0].tape, 1e-9);
  }
}

TEST(InspectProperty, the_same_at_any_number_of_threads) {
  const auto g = crumpled(3, 0.04);
  const auto body = shapes::sphere({0, 1, 0}, 0.2, 4);
  set_thread_count(1);
  const std::string one = to_json(*measure({}, g, &body)).dump();
  for (const int threads : {2, 5}) {
    set_thread_count(threads);
    EXPECT_EQ(to_json(*measure({}, g, &body)).dump(), one);
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace toile::inspect
