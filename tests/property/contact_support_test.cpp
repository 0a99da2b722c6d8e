// Signed distances, winding numbers and exact intersections against brute force and FCL.
#include "toile/contact/support_field.h"

#include "contact_shapes.h"
#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/contact/distance.h"
#include "toile/contact/exact.h"
#include "toile/contact/search.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

namespace toile::contact {
namespace {

using test::Shape;

Vec random_vec(Rng& rng, double size) { return Vec(rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)); }
Surface surface_of(const Shape& s) { return make_surface(static_cast<int>(s.x.rows()), s.faces); }

double brute_distance(const Shape& s, const Vec& p) {
  double least = INFINITY;
  for (int f = 0; f < s.faces.rows(); ++f) {
    least = std::min(least, closest_vertex_face(p, s.x.row(s.faces(f, 0)).transpose(), s.x.row(s.faces(f, 1)).transpose(),
                                                s.x.row(s.faces(f, 2)).transpose())
                                .distance_sq);
  }
  return std::sqrt(least);
}

double brute_winding(const Shape& s, const Vec& p) {
  double sum = 0;
  for (int f = 0; f < s.faces.rows(); ++f) {
    const Vec a = s.x.row(s.faces(f, 0)).transpose() - p, b = s.x.row(s.faces(f, 1)).transpose() - p, c = s.x.row(s.faces(f, 2)).transpose() - p;
    sum += std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (2 * std::numbers::pi);
}

TEST(SupportField, MatchesBruteForce) {
  Rng rng(21);
  const Shape shapes[] = {test::ellipsoid(Vec(0.3, 0.1, 0.2), Vec(0.1, 0, 0.3), 11, 14), test::block(Vec(-0.4, -0.1, -0.2), Vec(0.3, 0.1, 0.25)),
                          test::ellipsoid(Vec(0.3, 0.004, 0.3), Vec(0, 0, 0), 9, 16)};
  for (const Shape& shape : shapes) {
    const SupportField field(surface_of(shape), shape.x);
    Points3 points(600, 3);
    for (int i = 0; i < points.rows(); ++i) {
      points.row(i) = random_vec(rng, 0.5).transpose();
      if (i % 5 == 0) points.row(i) = shape.x.row(rng.below(shape.x.rows()));  // on a vertex
      if (i % 5 == 1) points.row(i) = shape.x.row(rng.below(shape.x.rows())) + random_vec(rng, 1e-5).transpose();
      if (i % 5 == 2) {  // off an edge
        const int f = static_cast<int>(rng.below(shape.faces.rows()));
        points.row(i) = 0.5 * (shape.x.row(shape.faces(f, 0)) + shape.x.row(shape.faces(f, 1))) + random_vec(rng, 1e-4).transpose();
      }
    }
    for (int i = 0; i < points.rows(); ++i) {
      const Vec p = points.row(i).transpose();
      const SurfacePoint s = field.nearest(p);
      const double expected = brute_distance(shape, p), winding = brute_winding(shape, p);
      ASSERT_DOUBLE_EQ(std::abs(s.distance), expected);
      ASSERT_NEAR((p - s.point).norm(), expected, 1e-12);
      if (expected > 1e-12) {
        ASSERT_EQ(s.distance < 0, winding > 0.5) << "winding " << winding << " distance " << s.distance;
        ASSERT_NEAR(field.winding_number(p), winding, 0.05);
        ASSERT_EQ(field.winding_number(p) > 0.5, winding > 0.5);
      }
      ASSERT_NEAR(s.normal.norm(), 1, 1e-12);
      if (expected > 1e-8) {
        ASSERT_GT(s.normal.dot(p - s.point) * s.distance, 0);
      }
    }
    // Batched, with a reach, cold and warm: the same.
    std::vector<SurfacePoint> cold, warmed;
    std::vector<int> warm, wrong(600);
    field.nearest(points, 0.1, cold, warm);
    for (int& w : wrong) w = static_cast<int>(rng.below(shape.faces.rows()));
    field.nearest(points, 0.1, warmed, wrong);
    std::vector<int> all(points.rows());
    for (int i = 0; i < points.rows(); ++i) {
      all[i] = i;
      ASSERT_EQ(cold[i].face, warmed[i].face);
      ASSERT_EQ(cold[i].distance, warmed[i].distance);
      const SurfacePoint s = field.nearest(Vec(points.row(i).transpose()));
      if (s.distance > 0.1) {
        ASSERT_EQ(cold[i].face, -1);
        ASSERT_EQ(cold[i].distance, 0.1);
      } else {
        ASSERT_EQ(cold[i].face, s.face);
        ASSERT_EQ(cold[i].distance, s.distance);
      }
    }
    const std::vector<Penetration> inside = field.penetrations(points, all);
    std::size_t next = 0;
    for (int i = 0; i < points.rows(); ++i) {
      const double d = field.nearest(Vec(points.row(i).transpose())).distance;
      if (std::abs(d) < 1e-12) {
        next += next < inside.size() && inside[next].vertex == i;
        continue;
      }
      if (d > 0) continue;
      ASSERT_LT(next, inside.size());
      ASSERT_EQ(inside[next].vertex, i);
      ASSERT_EQ(inside[next].depth, -d);
      ++next;
    }
    ASSERT_EQ(next, inside.size());
  }
}

TEST(SupportField, MovesWithItsMesh) {
  const Shape shape = test::ellipsoid(Vec(0.3, 0.1, 0.2), Vec::Zero(), 11, 14);
  SupportField field(surface_of(shape), shape.x);
  const Vec shift(0.5, -0.25, 0.125);
  const Points3 moved = shape.x.rowwise() + shift.transpose();
  field.move(moved);
  const SupportField fresh(surface_of(shape), moved);
  Rng rng(5);
  for (int i = 0; i < 200; ++i) {
    const Vec p = shift + random_vec(rng, 0.4);
    ASSERT_EQ(field.nearest(p).distance, fresh.nearest(p).distance);
    ASSERT_EQ(field.nearest(p).face, fresh.nearest(p).face);
    ASSERT_NEAR(field.winding_number(p), brute_winding({moved, shape.faces}, p), 0.05);
  }
}

TEST(ProjectOutside, ClearsEveryVertexAndStaysSmooth) {
  const Shape body = test::ellipsoid(Vec(0.25, 0.2, 0.25), Vec::Zero(), 30, 40);
  const SupportField field(surface_of(body), body.x);
  // A sheet that dips up to 30 mm into the top of the body.
  const Shape cloth = test::sheet(41, 41, 0.8, 0.8, [](double u, double v) { return Vec(u - 0.4, v - 0.4, 0.22); });
  const Surface surface = surface_of(cloth);
  const PushedOut out = project_outside(field, surface, cloth.x, 0.003);
  EXPECT_GT(out.inside_before, 50);
  EXPECT_EQ(out.nearer_after, 0);
  EXPECT_GT(out.moved, out.inside_before);
  EXPECT_LT(out.largest_move, 0.034);
  std::vector<SurfacePoint> at;
  std::vector<int> warm;
  field.nearest(out.x, 1, at, warm);
  for (const int v : surface.vertices) ASSERT_GE(at[v].distance, 0.003);
  EXPECT_TRUE(support_intersections(surface, out.x, surface_of(body), body.x).empty());
  EXPECT_TRUE(self_intersections(surface, out.x).empty());
  double longest = 0, shortest = INFINITY;  // edges of 20 mm and their diagonals
  for (const auto& [a, b] : surface.edges) {
    const double ratio = (out.x.row(a) - out.x.row(b)).norm() / (cloth.x.row(a) - cloth.x.row(b)).norm();
    longest = std::max(longest, ratio), shortest = std::min(shortest, ratio);
  }
  EXPECT_LT(longest, 1.3);
  EXPECT_GT(shortest, 0.8);
}

// ------------------------------------------------------------------ exact intersections

fcl::BVHModel<fcl::OBBRSSd> model_of(const Points3& x, const Triangles& faces) {
  fcl::BVHModel<fcl::OBBRSSd> model;
  model.beginModel(static_cast<int>(faces.rows()), static_cast<int>(x.rows()));
  for (int f = 0; f < faces.rows(); ++f) {
    model.addTriangle(x.row(faces(f, 0)).transpose(), x.row(faces(f, 1)).transpose(), x.row(faces(f, 2)).transpose());
  }
  model.endModel();
  return model;
}

TEST(ExactIntersections, SupportPairsAgreeWithFcl) {
  Rng rng(31);
  int hits = 0, misses = 0;
  for (int round = 0; round < 40; ++round) {
    const Shape body = round % 2 ? test::block(Vec(-0.2, -0.1, -0.2), Vec(0.3, 0.1, 0.25)) : test::ellipsoid(Vec(0.3, 0.1, 0.2), Vec::Zero(), 9, 12);
    const double height = rng.uniform(0.15, 0.3);
    const Vec a = random_vec(rng, 15);
    const Shape cloth = test::sheet(15, 15, 0.5, 0.5, [&](double u, double v) {
      return Vec(u - 0.25, v - 0.25, height + 0.03 * std::sin(a[0] * u + a[1] * v + a[2]));
    });
    const auto pairs = support_intersections(surface_of(cloth), cloth.x, surface_of(body), body.x);
    const auto cloth_model = model_of(cloth.x, cloth.faces), body_model = model_of(body.x, body.faces);
    fcl::CollisionRequestd request(100000, true);
    fcl::CollisionResultd result;
    fcl::collide(&cloth_model, fcl::Transform3d::Identity(), &body_model, fcl::Transform3d::Identity(), request, result);
    std::vector<FacePair> theirs;
    for (std::size_t i = 0; i < result.numContacts(); ++i) theirs.push_back({static_cast<int>(result.getContact(i).b1), static_cast<int>(result.getContact(i).b2)});
    std::sort(theirs.begin(), theirs.end());
    theirs.erase(std::unique(theirs.begin(), theirs.end()), theirs.end());
    // FCL works with a tolerance: a pair on which the two differ must be a grazing one. Generic positions have none.
    EXPECT_EQ(pairs, theirs) << "round " << round;
    (pairs.empty() ? misses : hits) += 1;
    if (pairs.empty()) {
      fcl::DistanceRequestd how(true);
      fcl::DistanceResultd nearest;
      fcl::distance(&cloth_model, fcl::Transform3d::Identity(), &body_model, fcl::Transform3d::Identity(), how, nearest);
      // The smallest distance among the contacts of a proximity search is the distance of the meshes.
      Search search(surface_of(cloth), cloth.x, surface_of(body), body.x);
      const double radius = nearest.min_distance * 1.001 + 1e-9;
      double least = INFINITY;
      for (const Contact& c : search.proximity(cloth.x, body.x, {0, radius}).support) least = std::min(least, c.distance);
      EXPECT_NEAR(least, nearest.min_distance, 1e-9) << "round " << round;
    }
  }
  EXPECT_GT(hits, 8);
  EXPECT_GT(misses, 8);
}

TEST(ExactIntersections, KnownCases) {
  const auto count = [](std::initializer_list<double> coordinates) {
    Shape s;
    s.x.resize(6, 3);
    std::copy(coordinates.begin(), coordinates.end(), s.x.data());
    s.faces.resize(2, 3);
    s.faces << 0, 1, 2, 3, 4, 5;
    return self_intersections(surface_of(s), s.x).size();
  };
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 0.2, 0.2, 1, 2, 2, 0}), 1u);         // pierced
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1e-15, 1, 0, 1e-15, 0, 1, 1e-15}), 0u);        // parallel, a hair apart
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0.1, 0.1, 0, 2, 0.1, 0, 0.1, 2, 0}), 1u);            // coplanar overlap
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 1.1, 0.1, 0, 2, 0.1, 0, 1.1, 2, 0}), 0u);            // coplanar, apart
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 0, 0.25, 0.25, 1, 1, 1, 1}), 1u);        // a corner on the face
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 0.2, 0.2, 1, 0.2, 0.2, 0.5}), 1u);     // a needle through the face
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 2.2, 0.2, -1, 2.2, 0.2, 1, 2.2, 0.2, 0.5}), 0u);     // a needle beside it
  EXPECT_EQ(count({0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 0, 0.2, 0.2, 0, 0.2, 0.2, 0}), 1u);        // a point on it
  // Faces that share an id are neighbours, whatever they do.
  Shape s;
  s.x.resize(6, 3);
  s.x << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 0.2, 0.2, 1, 2, 2, 0;
  s.faces.resize(2, 3);
  s.faces << 0, 1, 2, 3, 4, 5;
  Ids adjacency(6);
  adjacency << 0, 1, 2, 3, 4, 0;
  EXPECT_TRUE(self_intersections(make_surface(6, s.faces, adjacency), s.x).empty());
}

// Results are the same bytes at any number of threads.
TEST(ContactDeterminism, OneTwoFiveThreads) {
  const Shape body = test::ellipsoid(Vec(0.25, 0.25, 0.25), Vec::Zero(), 20, 30);
  const Shape cloth = test::sheet(60, 60, 1, 1, [](double u, double v) {
    return Vec(u - 0.5, v - 0.5, 0.2515 + 0.001 * std::sin(40 * u) * std::sin(30 * v) - 0.9 * std::max(0.0, std::hypot(u - 0.5, v - 0.5) - 0.05) * 0.1);
  });
  const Surface cs = surface_of(cloth), ss = surface_of(body);
  Rng rng(3);
  Points3 target = cloth.x;
  for (int i = 0; i < target.rows(); ++i) target.row(i) += random_vec(rng, 0.02).transpose();
  struct Run {
    std::vector<Contact> contacts;
    Points3 x;
    double fraction;
    std::vector<FacePair> self, support;
    Points3 pushed;
  };
  std::vector<Run> runs;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    Run run;
    Search search(cs, cloth.x, ss, body.x);
    const Contacts c = search.proximity(target, body.x, {0.004, 0.004});
    run.contacts.assign(c.self.begin(), c.self.end());
    run.contacts.insert(run.contacts.end(), c.support.begin(), c.support.end());
    run.fraction = search.step_fraction(cloth.x, target, body.x, body.x);
    run.x = search.limit_step(cloth.x, target, body.x, body.x).x;
    run.self = self_intersections(cs, target);
    run.support = support_intersections(cs, target, ss, body.x);
    run.pushed = project_outside(SupportField(ss, body.x), cs, target, 0.002).x;
    runs.push_back(std::move(run));
  }
  set_thread_count(0);
  EXPECT_GT(runs[0].contacts.size(), 100u);
  EXPECT_GT(runs[0].support.size(), 10u);
  for (std::size_t r = 1; r < runs.size(); ++r) {
    ASSERT_EQ(runs[r].contacts.size(), runs[0].contacts.size());
    for (std::size_t i = 0; i < runs[0].contacts.size(); ++i) {
      const Contact &p = runs[r].contacts[i], &q = runs[0].contacts[i];
      ASSERT_TRUE(p.node == q.node && p.weight == q.weight && p.distance == q.distance && p.share == q.share && p.a == q.a && p.b == q.b);
    }
    EXPECT_EQ(runs[r].fraction, runs[0].fraction);
    EXPECT_EQ(std::memcmp(runs[r].x.data(), runs[0].x.data(), sizeof(double) * runs[0].x.size()), 0);
    EXPECT_EQ(std::memcmp(runs[r].pushed.data(), runs[0].pushed.data(), sizeof(double) * runs[0].pushed.size()), 0);
    EXPECT_EQ(runs[r].self, runs[0].self);
    EXPECT_EQ(runs[r].support, runs[0].support);
  }
}

}  // namespace
}  // namespace toile::contact
