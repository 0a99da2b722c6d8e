// The search against brute force, and what a limited step guarantees, on soups, folded sheets and supports.
#include "toile/contact/search.h"

#include "contact_drape.h"
#include "contact_shapes.h"
#include "toile/base/parallel.h"
#include "toile/base/result.h"
#include "toile/base/rng.h"
#include "toile/contact/distance.h"
#include "toile/contact/exact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <tuple>

namespace toile::contact {
namespace {

using test::Shape;

Vec random_vec(Rng& rng, double size) { return Vec(rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)); }

// Loose triangles of about the given size in a unit cube, some of them sharing nodes.
Shape soup(Rng& rng, int faces, double size) {
  Shape s;
  s.x.resize(faces * 3, 3);
  s.faces.resize(faces, 3);
  for (int f = 0; f < faces; ++f) {
    const Vec centre = random_vec(rng, 0.5);
    for (int k = 0; k < 3; ++k) {
      s.x.row(3 * f + k) = (centre + random_vec(rng, size)).transpose();
      s.faces(f, k) = 3 * f + k;
    }
    if (f > 0 && rng.uniform() < 0.3) s.faces(f, 0) = s.faces(f - 1, 1);
  }
  return s;
}

Shape pleated(int n, double pitch, double gap) {
  return test::sheet(n, n, 1, 1, [=](double u, double v) {
    // A zigzag of near-vertical walls `gap` apart.
    const double s = u / pitch, k = std::floor(s), t = s - k;
    const double height = std::fmod(k, 2) == 0 ? t : 1 - t;
    return Vec((k + t) * gap + 0.01 * v, v, pitch * height);
  });
}

std::vector<Contact> sorted_by_kind(std::vector<Contact> list) {
  std::sort(list.begin(), list.end(), [](const Contact& p, const Contact& q) { return std::tie(p.kind, p.a, p.b) < std::tie(q.kind, q.a, q.b); });
  return list;
}

// All near pairs, by trying all of them; then the stated rule for vertices near several faces, written differently: the
// near faces of a vertex are linked where they share a node and look the same way; a face with a nearer linked one goes.
struct Brute {
  const Surface& first;
  const Surface& second;
  const Points3& first_x;
  const Points3& second_x;
  bool same;

  bool neighbours(std::vector<int> p, std::vector<int> q) const {
    if (!same) return false;
    for (const int i : p) {
      for (const int j : q) {
        if (first.adjacency[i] == second.adjacency[j]) return true;
      }
    }
    return false;
  }
  Vec a(int i) const { return first_x.row(i).transpose(); }
  Vec b(int i) const { return second_x.row(i).transpose(); }

  std::vector<Contact> vertex_face(Kind kind, double radius) const {
    std::vector<Contact> all;
    for (const int v : first.vertices) {
      std::vector<Contact> near;
      std::vector<Vec> direction;
      for (int f = 0; f < second.faces.rows(); ++f) {
        const int i = second.faces(f, 0), j = second.faces(f, 1), k = second.faces(f, 2);
        if (neighbours({v}, {i, j, k})) continue;
        const Closest c = closest_vertex_face(a(v), b(i), b(j), b(k));
        if (!(c.distance_sq < radius * radius)) continue;
        near.push_back({{v, i, j, k}, c.weight, std::sqrt(c.distance_sq), v, f, kind, 1});
        direction.push_back((a(v) + c.weight[1] * b(i) + c.weight[2] * b(j) + c.weight[3] * b(k)).normalized());
      }
      for (std::size_t p = 0; p < near.size(); ++p) {
        bool keep = true;
        for (std::size_t q = 0; q < near.size(); ++q) {
          if (std::tie(near[q].distance, near[q].b) >= std::tie(near[p].distance, near[p].b)) continue;
          bool linked = false;
          for (int s = 1; s < 4; ++s) {
            for (int t = 1; t < 4; ++t) linked |= second.adjacency[near[p].node[s]] == second.adjacency[near[q].node[t]];
          }
          if (linked && direction[p].dot(direction[q]) > 0.5) keep = false;
        }
        if (keep) all.push_back(near[p]);
      }
    }
    return all;
  }
  // Pairs that meet inside both edges; whether `share` keeps them is the search's own doing.
  std::vector<Contact> edge_edge(Kind kind, double radius) const {
    std::vector<Contact> all;
    for (int e = 0; e < static_cast<int>(first.edges.size()); ++e) {
      for (int f = same ? e + 1 : 0; f < static_cast<int>(second.edges.size()); ++f) {
        const auto [i, j] = first.edges[e];
        const auto [k, l] = second.edges[f];
        if (neighbours({i, j}, {k, l})) continue;
        const Closest c = closest_edge_edge(a(i), a(j), b(k), b(l));
        if (!(c.distance_sq < radius * radius)) continue;
        if (c.weight[0] == 0 || c.weight[1] == 0 || c.weight[2] == 0 || c.weight[3] == 0) continue;
        all.push_back({{i, j, k, l}, c.weight, std::sqrt(c.distance_sq), e, f, kind, 1});
      }
    }
    return all;
  }
};

void expect_same(const std::vector<Contact>& expected, const std::vector<Contact>& found) {
  ASSERT_EQ(expected.size(), found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(expected[i].a, found[i].a);
    ASSERT_EQ(expected[i].b, found[i].b);
    ASSERT_EQ(expected[i].node, found[i].node);
    ASSERT_EQ(expected[i].weight, found[i].weight);
    ASSERT_EQ(expected[i].distance, found[i].distance);
  }
}

std::vector<Contact> of_kind(std::span<const Contact> list, Kind kind) {
  std::vector<Contact> out;
  for (const Contact& c : list) {
    if (c.kind == kind) out.push_back(c);
  }
  return out;
}

// Every edge contact that brute force finds is reported unless a face leans into it or the edges are parallel.
void expect_edges(const std::vector<Contact>& expected, const std::vector<Contact>& found, const Brute& brute) {
  std::map<std::pair<int, int>, const Contact*> index;
  for (const Contact& c : found) {
    ASSERT_GT(c.share, 0);
    ASSERT_LE(c.share, 1);
    ASSERT_TRUE(index.emplace(std::pair(c.a, c.b), &c).second);
  }
  std::size_t matched = 0;
  for (const Contact& c : expected) {
    const auto it = index.find({c.a, c.b});
    if (it != index.end()) {
      ++matched;
      ASSERT_EQ(c.weight, it->second->weight);
      ASSERT_EQ(c.distance, it->second->distance);
      continue;
    }
    const Vec d1 = brute.a(c.node[1]) - brute.a(c.node[0]), d2 = brute.b(c.node[3]) - brute.b(c.node[2]);
    const bool parallel = d1.cross(d2).norm() <= 1e-6 * d1.norm() * d2.norm();
    const Vec p = c.weight[0] * brute.a(c.node[0]) + c.weight[1] * brute.a(c.node[1]);
    const Vec q = -c.weight[2] * brute.b(c.node[2]) - c.weight[3] * brute.b(c.node[3]);
    // A face leans in when stepping into it from the closest point comes nearer.
    bool leans = false;
    const auto probe = [&](const Surface& s, const Points3& x, int edge, const Vec& from, const Vec& to) {
      for (const int f : s.edge_faces[edge]) {
        if (f < 0) continue;
        Vec centre = Vec::Zero();
        for (int k = 0; k < 3; ++k) centre += x.row(s.faces(f, k)).transpose() / 3;
        leans |= (centre - from).dot(to - from) > 0;
      }
    };
    probe(brute.first, brute.first_x, c.a, p, q);
    probe(brute.second, brute.second_x, c.b, q, p);
    ASSERT_TRUE(parallel || leans) << c.a << " " << c.b;
  }
  ASSERT_EQ(matched, found.size());
}

void check_proximity(const Shape& cloth, const Ids& adjacency, const Shape& support, Radii radii) {
  const Surface cs = make_surface(static_cast<int>(cloth.x.rows()), cloth.faces, adjacency);
  const Surface ss = make_surface(static_cast<int>(support.x.rows()), support.faces);
  Search search(cs, cloth.x, ss, support.x);
  const Contacts contacts = search.proximity(cloth.x, support.x, radii);
  const Brute self{cs, cs, cloth.x, cloth.x, true}, on{cs, ss, cloth.x, support.x, false}, under{ss, cs, support.x, cloth.x, false};
  ASSERT_NO_FATAL_FAILURE(expect_same(self.vertex_face(Kind::vertex_face, radii.self), of_kind(contacts.self, Kind::vertex_face)));
  ASSERT_NO_FATAL_FAILURE(
      expect_same(on.vertex_face(Kind::vertex_support_face, radii.support), of_kind(contacts.support, Kind::vertex_support_face)));
  ASSERT_NO_FATAL_FAILURE(
      expect_same(under.vertex_face(Kind::support_vertex_face, radii.support), of_kind(contacts.support, Kind::support_vertex_face)));
  ASSERT_NO_FATAL_FAILURE(expect_edges(self.edge_edge(Kind::edge_edge, radii.self), of_kind(contacts.self, Kind::edge_edge), self));
  ASSERT_NO_FATAL_FAILURE(
      expect_edges(on.edge_edge(Kind::edge_support_edge, radii.support), of_kind(contacts.support, Kind::edge_support_edge), on));
  // Ordered, and nothing else in there.
  for (const auto list : {contacts.self, contacts.support}) {
    const std::vector<Contact> plain(list.begin(), list.end()), ordered = sorted_by_kind(plain);
    for (std::size_t i = 0; i < plain.size(); ++i) ASSERT_TRUE(plain[i].a == ordered[i].a && plain[i].b == ordered[i].b && plain[i].kind == ordered[i].kind);
  }
}

TEST(ContactProximity, MatchesBruteForceOnSoups) {
  Rng rng(11);
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    const Shape cloth = soup(rng, 150, 0.12), support = test::ellipsoid(Vec(0.3, 0.2, 0.4), random_vec(rng, 0.1), 7, 9);
    ASSERT_NO_FATAL_FAILURE(check_proximity(cloth, {}, support, {rng.uniform(0.005, 0.08), rng.uniform(0.005, 0.08)}));
  }
}

TEST(ContactProximity, MatchesBruteForceOnSheets) {
  Rng rng(12);
  for (int round = 0; round < 6; ++round) {
    SCOPED_TRACE(round);
    const Shape cloth = pleated(19, 0.1, 0.012 + 0.004 * round);
    const Shape support = round % 2 ? test::block(Vec(0, 0.2, -0.5), Vec(0.3, 0.6, 0.001)) : test::ellipsoid(Vec(0.3, 0.3, 0.2), Vec(0.1, 0.5, -0.2), 9, 12);
    Ids adjacency = Ids::LinSpaced(cloth.x.rows(), 0, cloth.x.rows() - 1);
    if (round % 3 == 0) {  // an open seam between the first and the last column
      for (int j = 0; j < 19; ++j) adjacency[j * 19 + 18] = adjacency[j * 19];
    }
    ASSERT_NO_FATAL_FAILURE(check_proximity(cloth, adjacency, support, {0.02, 0.03}));
  }
}

// The counting rule on plain cases.
TEST(ContactProximity, OneContactForVertexOverSheetTwoInValley) {
  const auto flat = [](double u, double v) { return Vec(u, v, 0); };
  const Shape ground = test::sheet(11, 11, 1, 1, flat);
  Shape cloth;
  cloth.x.resize(3, 3);
  cloth.faces.resize(1, 3);
  cloth.faces << 0, 1, 2;
  cloth.x << 0.5, 0.5, 0.01, 0.5, 0.5, 1, 0.6, 0.5, 1;  // its lowest corner over a vertex of the ground
  const auto contacts_over = [&](const Shape& ground_shape) {
    Search search(make_surface(3, cloth.faces), cloth.x, make_surface(static_cast<int>(ground_shape.x.rows()), ground_shape.faces), ground_shape.x);
    return of_kind(search.proximity(cloth.x, ground_shape.x, {0, 0.1}).support, Kind::vertex_support_face);
  };
  ASSERT_EQ(contacts_over(ground).size(), 1u);
  EXPECT_DOUBLE_EQ(contacts_over(ground)[0].distance, 0.01);
  const Shape valley = test::sheet(11, 11, 1, 1, [](double u, double v) { return Vec(u, v, 2 * std::abs(u - 0.5) - 0.01); });
  EXPECT_EQ(contacts_over(valley).size(), 2u);
  const Shape ridge = test::sheet(11, 11, 1, 1, [](double u, double v) { return Vec(u, v, -2 * std::abs(u - 0.5)); });
  EXPECT_EQ(contacts_over(ridge).size(), 1u);
}

// ------------------------------------------------------------------ limited steps

// Smallest distance of pairs without a common adjacency id, by brute force.
double least_distance(const Surface& s, const Points3& x) {
  double least_sq = INFINITY;
  const auto at = [&](int i) { return Vec(x.row(i).transpose()); };
  const auto same = [&](int i, int j) { return s.adjacency[i] == s.adjacency[j]; };
  for (const int v : s.vertices) {
    for (int f = 0; f < s.faces.rows(); ++f) {
      const int i = s.faces(f, 0), j = s.faces(f, 1), k = s.faces(f, 2);
      if (!same(v, i) && !same(v, j) && !same(v, k)) least_sq = std::min(least_sq, closest_vertex_face(at(v), at(i), at(j), at(k)).distance_sq);
    }
  }
  for (std::size_t e = 0; e < s.edges.size(); ++e) {
    for (std::size_t f = e + 1; f < s.edges.size(); ++f) {
      const auto [i, j] = s.edges[e];
      const auto [k, l] = s.edges[f];
      if (!same(i, k) && !same(i, l) && !same(j, k) && !same(j, l)) least_sq = std::min(least_sq, closest_edge_edge(at(i), at(j), at(k), at(l)).distance_sq);
    }
  }
  return std::sqrt(least_sq);
}

Points3 smooth_noise(Rng& rng, const Points3& rest, double size, double length) {
  Points3 d = Points3::Zero(rest.rows(), 3);
  for (int wave = 0; wave < 6; ++wave) {
    const Vec k = random_vec(rng, 6.28 / length), a = random_vec(rng, size);
    const double phase = rng.uniform(0, 6.28);
    for (Eigen::Index i = 0; i < rest.rows(); ++i) d.row(i) += (std::sin(k.dot(rest.row(i).transpose()) + phase) * a).transpose();
  }
  return d;
}

// Crumples a sheet by large random steps: half of them smooth, half of them node by node.
TEST(ContactLimit, CrumpledSheetNeverIntersects) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const Shape shape = test::sheet(25, 25, 1, 1, [](double u, double v) { return Vec(u, v, 0.02 * std::sin(9 * u) * std::cos(7 * v)); });
    const Surface surface = make_surface(static_cast<int>(shape.x.rows()), shape.faces);
    Search search(surface, shape.x);
    const Points3 none(0, 3);
    Points3 x = shape.x;
    ASSERT_TRUE(self_intersections(surface, x).empty());
    double kept = 0;
    int limited = 0, would_intersect = 0;
    const int steps = 40;
    for (int step = 0; step < steps; ++step) {
      // Pull towards the middle so that layers meet.
      Points3 target = x + (step % 2 ? smooth_noise(rng, shape.x, 0.03, 0.3) : Points3(Points3::Random(x.rows(), 3) * 0.0));
      if (step % 2 == 0) {
        for (Eigen::Index i = 0; i < x.rows(); ++i) target.row(i) += random_vec(rng, 0.015).transpose();
      }
      const Vec centre = x.colwise().mean().transpose();
      for (Eigen::Index i = 0; i < x.rows(); ++i) target.row(i) += 0.04 * (centre.transpose() - x.row(i));
      would_intersect += !self_intersections(surface, target).empty();
      const StepLimit& limit = search.limit_step(x, target, none, none);
      ASSERT_TRUE(limit.x.allFinite());
      ASSERT_EQ(limit.touching_pairs, 0);
      double sum = 0;
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const double f = limit.fraction[i];
        ASSERT_TRUE(f >= 0 && f <= 1);
        if (f == 1) {
          ASSERT_EQ(limit.x.row(i), target.row(i));
        }
        ASSERT_LT((limit.x.row(i) - (x.row(i) + f * (target.row(i) - x.row(i)))).norm(), 1e-14);
        sum += f;
      }
      kept += sum / static_cast<double>(x.rows());
      limited += limit.limited_pairs;
      // Nowhere on the way either.
      for (const double t : {0.3, 0.7, 1.0}) {
        const Points3 y = x + t * (limit.x - x);
        ASSERT_TRUE(self_intersections(surface, y).empty()) << "step " << step << " time " << t;
      }
      x = limit.x;
    }
    EXPECT_GT(least_distance(surface, x), 0.99e-6);
    EXPECT_GT(limited, 1000);
    EXPECT_GT(would_intersect, steps / 2);
    EXPECT_GT(kept / steps, 0.3);
  }
}

bool same_contacts(std::span<const Contact> p, std::span<const Contact> q) {
  return std::equal(p.begin(), p.end(), q.begin(), q.end(), [](const Contact& a, const Contact& b) {
    return a.kind == b.kind && a.a == b.a && a.b == b.b && a.node == b.node && a.weight == b.weight && a.distance == b.distance && a.share == b.share;
  });
}

// A search that has lists from earlier calls gives the very same bytes as a new one, at any pace of motion.
TEST(ContactSearch, ResultsDoNotDependOnEarlierCalls) {
  Rng rng(41);
  const Shape body = test::ellipsoid(Vec(0.3, 0.2, 0.25), Vec(0.5, 0.5, -0.2), 14, 18);
  const Shape cloth = pleated(31, 0.1, 0.016);
  const Surface cs = make_surface(static_cast<int>(cloth.x.rows()), cloth.faces), ss = make_surface(static_cast<int>(body.x.rows()), body.faces);
  Search used(cs, cloth.x, ss, body.x);
  Points3 x = cloth.x, s = body.x;
  for (int step = 0; step < 60; ++step) {
    SCOPED_TRACE(step);
    const double pace = std::pow(10.0, rng.uniform(-5, -1.5));
    Points3 target = x + smooth_noise(rng, cloth.x, pace, 0.5);
    target.rowwise() += random_vec(rng, pace).transpose();
    Points3 body_target = s;
    if (step % 3 == 1) body_target.rowwise() += random_vec(rng, 0.5 * pace).transpose();
    const Radii radii{rng.uniform(0.002, 0.02), rng.uniform(0.002, 0.03)};
    Search fresh(cs, target, ss, body.x);  // another layout of the hierarchy, too
    const Contacts p = used.proximity(x, s, radii), q = fresh.proximity(x, s, radii);
    ASSERT_TRUE(same_contacts(p.self, q.self));
    ASSERT_TRUE(same_contacts(p.support, q.support));
    Search fresh_again(cs, cloth.x, ss, body.x);
    ASSERT_EQ(used.step_fraction(x, target, s, body_target), fresh_again.step_fraction(x, target, s, body_target));
    const StepLimit& a = used.limit_step(x, target, s, body_target);
    const StepLimit& b = fresh_again.limit_step(x, target, s, body_target);
    ASSERT_EQ(a.x, b.x);
    ASSERT_EQ(a.fraction, b.fraction);
    ASSERT_EQ(a.support_fraction, b.support_fraction);
    ASSERT_EQ(a.limited_pairs, b.limited_pairs);
    s += a.support_fraction * (body_target - s);
    x = a.x;
  }
}

// Cloth thrown at sharp and smooth supports, coarse and fine, still and moving: never inside, never cut.
TEST(ContactLimit, NeverCutsASupport) {
  const Shape bodies[] = {test::block(Vec(-0.2, -0.3, -0.3), Vec(0.25, 0.3, -0.02)), test::ellipsoid(Vec(0.3, 0.3, 0.05), Vec(0, 0, -0.08), 8, 10),
                          test::ellipsoid(Vec(0.01, 0.01, 0.3), Vec(0.013, 0.017, -0.32), 20, 8)};  // the last: a needle
  for (std::size_t which = 0; which < 3; ++which) {
    for (const bool moving : {false, true}) {
      SCOPED_TRACE(testing::Message() << "body " << which << " moving " << moving);
      Rng rng(50 + which);
      const Shape& body = bodies[which];
      const Shape cloth = test::sheet(21, 21, 0.8, 0.8, [](double u, double v) { return Vec(u - 0.4, v - 0.4, 0); });
      const Surface cs = make_surface(static_cast<int>(cloth.x.rows()), cloth.faces), ss = make_surface(static_cast<int>(body.x.rows()), body.faces);
      Search search(cs, cloth.x, ss, body.x);
      Points3 x = cloth.x, s = body.x;
      ASSERT_TRUE(support_intersections(cs, x, ss, s).empty());
      int limited = 0;
      double support_way = 0;
      for (int step = 0; step < 25; ++step) {
        Points3 target = x + smooth_noise(rng, cloth.x, 0.01, 0.4);
        for (Eigen::Index i = 0; i < x.rows(); ++i) target.row(i) += random_vec(rng, 0.003).transpose();
        target.col(2).array() -= 0.02;
        Points3 body_target = s;
        if (moving) body_target.rowwise() += Vec(rng.uniform(-0.01, 0.01), rng.uniform(-0.01, 0.01), rng.uniform(-0.005, 0.02)).transpose();
        const StepLimit& limit = search.limit_step(x, target, s, body_target);
        limited += limit.limited_pairs;
        ASSERT_EQ(limit.touching_pairs, 0);
        if (!moving) {
          ASSERT_EQ(limit.support_fraction, 1);
        }
        support_way += limit.support_fraction;
        for (const double t : {0.25, 0.5, 0.75, 1.0}) {
          const Points3 y = x + t * (limit.x - x), sy = s + t * limit.support_fraction * (body_target - s);
          ASSERT_TRUE(support_intersections(cs, y, ss, sy).empty()) << "step " << step << " time " << t;
          ASSERT_TRUE(self_intersections(cs, y).empty()) << "step " << step << " time " << t;
        }
        x = limit.x;
        s += limit.support_fraction * (body_target - s);
      }
      EXPECT_GT(limited, 50);
      EXPECT_GT(moving ? support_way : (cloth.x - x).norm(), 0.1);
    }
  }
}

// Where nothing is in the way a step is taken as it is.
TEST(ContactLimit, FreeMotionIsNotTouched) {
  const Shape body = test::block(Vec(-0.2, -0.3, -0.3), Vec(0.25, 0.3, -0.02));
  const Shape cloth = test::sheet(21, 21, 0.8, 0.8, [](double u, double v) { return Vec(u - 0.4, v - 0.4, 0); });
  Search search(make_surface(441, cloth.faces), cloth.x, make_surface(8, body.faces), body.x);
  Points3 target = cloth.x;
  target.rowwise() += Eigen::RowVector3d(3, 0.1, 0.2);
  const StepLimit& limit = search.limit_step(cloth.x, target, body.x, body.x);
  EXPECT_EQ(limit.x, target);
  EXPECT_EQ(limit.limited_nodes, 0);
  EXPECT_EQ(limit.least_fraction, 1);
  // Sliding along the support just outside the separation is free as well.
  Points3 resting = cloth.x;
  resting.col(2).array() -= 0.02 - 6e-5;
  Points3 slid = resting;
  slid.col(0).array() += 0.05;
  const StepLimit& slide = search.limit_step(resting, slid, body.x, body.x);
  EXPECT_EQ(slide.limited_nodes, 0);
  EXPECT_EQ(search.step_fraction(resting, slid, body.x, body.x), 1);
}

// Only the nodes in the way are held back, and the one fraction for all is that of the first impact.
TEST(ContactLimit, RewindsLocally) {
  const Shape body = test::ellipsoid(Vec(0.05, 0.05, 0.05), Vec(0, 0, -0.06), 12, 16);
  const Shape cloth = test::sheet(41, 41, 1, 1, [](double u, double v) { return Vec(u - 0.5, v - 0.5, 0); });
  Search search(make_surface(1681, cloth.faces), cloth.x, make_surface(static_cast<int>(body.x.rows()), body.faces), body.x);
  Points3 target = cloth.x;
  target.col(2).array() -= 0.05;
  const StepLimit& limit = search.limit_step(cloth.x, target, body.x, body.x);
  EXPECT_GT(limit.limited_nodes, 5);
  EXPECT_LT(limit.limited_nodes, 60);
  EXPECT_GT(limit.least_fraction, 0.15);
  EXPECT_EQ(limit.fallback_pairs, 0);
  EXPECT_NEAR(search.step_fraction(cloth.x, target, body.x, body.x), 0.2, 0.003);
}

// Exempt nodes pass where others are stopped; neighbours across an open seam never stop one another.
TEST(ContactLimit, ExemptNodesAndOpenSeams) {
  Shape cloth = test::joined(test::sheet(6, 6, 0.1, 0.1, [](double u, double v) { return Vec(u, v, 0); }),
                             test::sheet(6, 6, 0.1, 0.1, [](double u, double v) { return Vec(u + 0.003, v + 0.002, 0.01); }));
  Points3 target = cloth.x;
  target.bottomRows(36).col(2).array() -= 0.02;
  const Points3 none(0, 3);
  Search search(make_surface(72, cloth.faces), cloth.x);
  EXPECT_GT(search.limit_step(cloth.x, target, none, none).limited_nodes, 50);
  EXPECT_TRUE(self_intersections(search.cloth(), search.limit_step(cloth.x, target, none, none).x).empty());
  LimitOptions options;
  std::vector<std::uint8_t> exempt(72, 1);
  options.self_exempt = exempt;
  EXPECT_EQ(search.limit_step(cloth.x, target, none, none, options).limited_nodes, 0);
  for (int i = 0; i < 36; ++i) exempt[i] = 0;  // one side is not enough
  EXPECT_GT(search.limit_step(cloth.x, target, none, none, options).limited_nodes, 50);
  Ids one = Ids::Zero(72);
  Search welded(make_surface(72, cloth.faces, one), cloth.x);
  EXPECT_EQ(welded.limit_step(cloth.x, target, none, none).limited_nodes, 0);
  EXPECT_TRUE(welded.proximity(cloth.x, none, {0.1, 0.1}).self.empty());
}

// A broken precondition is reported and ends all the same.
TEST(ContactLimit, TouchingStartIsReported) {
  Shape cloth = test::joined(test::sheet(6, 6, 0.1, 0.1, [](double u, double v) { return Vec(u, v, 0); }),
                             test::sheet(6, 6, 0.1, 0.1, [](double u, double v) { return Vec(u, v, 0); }));
  Points3 target = cloth.x;
  target.bottomRows(36).col(2).array() -= 0.02;
  const Points3 none(0, 3);
  Search search(make_surface(72, cloth.faces), cloth.x);
  const StepLimit& limit = search.limit_step(cloth.x, target, none, none);
  EXPECT_GT(limit.touching_pairs, 36);
  EXPECT_TRUE(limit.x.allFinite());
  Points3 bad = cloth.x;
  bad(3, 1) = NAN;
  EXPECT_THROW(search.limit_step(cloth.x, bad, none, none), CheckFailed);
}

// A sheet drops over a small ball and folds on itself, hundreds of steps long.
TEST(ContactLimit, DrapeStaysClean) {
  const Shape cloth = test::sheet(36, 36, 0.6, 0.6, [](double u, double v) { return Vec(u - 0.3, v - 0.3, 0.105); });
  const Shape ball = test::ellipsoid(Vec(0.1, 0.1, 0.1), Vec::Zero(), 16, 18);
  test::Drape drape(cloth, ball);
  drape.sweeps = 12;
  double kept = 0;
  const int steps = 160;
  std::size_t most_contacts = 0;
  for (int step = 0; step < steps; ++step) {
    drape.advance();
    ASSERT_EQ(drape.last.touching_pairs, 0);
    for (const double f : drape.last.fraction) kept += f / static_cast<double>(drape.last.fraction.size()) / steps;
    if (step % 10 == 9) {
      ASSERT_TRUE(self_intersections(drape.surface, drape.x).empty()) << "step " << step;
      ASSERT_TRUE(support_intersections(drape.surface, drape.x, drape.search.support(), drape.support_x).empty()) << "step " << step;
      most_contacts = std::max(most_contacts, drape.search.proximity(drape.x, drape.support_x, {0.002, 0}).self.size());
    }
  }
  EXPECT_GT(most_contacts, 50u);
  EXPECT_GT(kept, 0.97);
}

}  // namespace
}  // namespace toile::contact
