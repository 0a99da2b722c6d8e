#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "garments.h"
#include "patterns.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"

using namespace toile;

namespace {

/// Rectangles of the given cells, each (columns, rows, cell), named p0, p1, ...
mesh::GarmentMesh rectangles(const std::vector<std::array<double, 3>>& sizes) {
  mesh::GarmentMesh g;
  double shift = 0;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    test::add_rectangle(g, fmt::format("p{}", k), static_cast<int>(sizes[k][0]), static_cast<int>(sizes[k][1]), sizes[k][2], shift);
    shift += sizes[k][0] * sizes[k][2] + 0.02;
  }
  return g;
}

tailor::SeamSpec seam(const std::string& name, std::vector<std::string> a, std::vector<std::string> b) {
  tailor::SeamSpec spec;
  spec.name = name;
  spec.a = std::move(a);
  spec.b = std::move(b);
  return spec;
}

tailor::SewParams params_of(std::vector<tailor::SeamSpec> seams) {
  tailor::SewParams params;
  params.seams = std::move(seams);
  return params;
}

tailor::Sewn sewn(const mesh::GarmentMesh& g, const tailor::SewParams& params) {
  auto result = tailor::sew(g, params);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

std::vector<std::string> codes(const Result<tailor::Sewn>& result) {
  std::vector<std::string> list;
  for (const Issue& issue : result.issues()) list.push_back(issue.code);
  return list;
}

std::vector<double> run_s(const mesh::GarmentMesh& g, int run) {
  std::vector<double> s;
  for (const auto& row : g.run_vertices) {
    if (row.run == run) s.push_back(row.s);
  }
  return s;
}

}  // namespace

TEST(sew, three_particles_against_five) {
  // By hand: the coarse side's 0, 1/2, 1 meet the fine side's 0, 2/4, 1; quarters are put in between.
  for (const auto matching : {tailor::Matching::aligned, tailor::Matching::published}) {
    const auto g = rectangles({{2, 2, 0.01}, {4, 4, 0.005}});
    auto params = params_of({seam("s", {"p0.right"}, {"-p1.left"})});
    params.matching = matching;
    const auto result = sewn(g, params);
    EXPECT_EQ(result.garment.vertex_count(), g.vertex_count() + 2);
    EXPECT_EQ(result.garment.face_count(), g.face_count() + 2);
    ASSERT_EQ(result.garment.welds.size(), 5u);
    for (int k = 0; k < 5; ++k) {
      const auto& weld = result.garment.welds[static_cast<std::size_t>(k)];
      EXPECT_EQ(result.garment.vertex_panel[weld.a], 0);
      EXPECT_EQ(result.garment.vertex_panel[weld.b], 1);
      EXPECT_NEAR(result.garment.uv(weld.a, 0), 0.02, 1e-15);
      EXPECT_NEAR(result.garment.uv(weld.a, 1), 0.005 * k, 1e-15);
      EXPECT_NEAR(result.garment.uv(weld.b, 0), 0, 1e-15);
      EXPECT_NEAR(result.garment.uv(weld.b, 1), 0.005 * k, 1e-15);
    }
    const std::vector<double> s = run_s(result.garment, 1);
    ASSERT_EQ(s.size(), 5u);
    for (int k = 0; k < 5; ++k) EXPECT_NEAR(s[static_cast<std::size_t>(k)], 0.005 * k, 1e-15);
    EXPECT_EQ(result.seams[0].added, 2);
    EXPECT_EQ(result.seams[0].pairs, 5);
    EXPECT_NEAR(mesh::rest_areas(result.garment).sum(), mesh::rest_areas(g).sum(), 1e-15);
  }
}

TEST(sew, three_particles_against_four) {
  // The coarse middle is equally near to 1/3 and 2/3: the first is taken. Aligned, it slides there and 2/3 is put in;
  // published, it stays at 1/2 and the new one comes halfway between it and the end.
  const auto g = rectangles({{2, 2, 0.015}, {3, 3, 0.01}});
  auto params = params_of({seam("s", {"p0.right"}, {"-p1.left"})});
  const auto aligned = sewn(g, params);
  const std::vector<double> slid = run_s(aligned.garment, 1);
  ASSERT_EQ(slid.size(), 4u);
  EXPECT_NEAR(slid[1], 0.01, 1e-15);
  EXPECT_NEAR(slid[2], 0.02, 1e-15);
  params.matching = tailor::Matching::published;
  const auto published = sewn(g, params);
  const std::vector<double> stayed = run_s(published.garment, 1);
  ASSERT_EQ(stayed.size(), 4u);
  EXPECT_NEAR(stayed[1], 0.015, 1e-15);
  EXPECT_NEAR(stayed[2], 0.0225, 1e-15);
  EXPECT_NEAR(aligned.seams[0].farthest_slide, 0.005, 1e-12);
}

TEST(sew, aligned_sides_have_equal_relative_arc_lengths) {
  const auto g = rectangles({{3, 7, 0.01}, {3, 9, 0.07 / 9}});
  const auto result = sewn(g, params_of({seam("s", {"p0.right"}, {"-p1.left"})}));
  EXPECT_EQ(result.garment.welds.size(), 10u);
  for (const auto& weld : result.garment.welds) EXPECT_NEAR(result.garment.uv(weld.a, 1), result.garment.uv(weld.b, 1), 1e-14);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
}

TEST(sew, a_tube_has_two_openings) {
  const auto g = rectangles({{6, 4, 0.01}});
  const auto result = sewn(g, params_of({seam("tube", {"p0.right"}, {"-p0.left"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.openings, 2);
  EXPECT_EQ(surface.euler, 0);
  for (double length : surface.opening_lengths) EXPECT_NEAR(length, 0.06, 1e-12);
}

TEST(sew, ring_on_ring) {
  // A cuff: both tubes are closed by their own seams, then joined all round.
  const auto g = rectangles({{8, 4, 0.01}, {10, 3, 0.008}});
  const auto result = sewn(g, params_of({seam("close_0", {"p0.right"}, {"-p0.left"}), seam("close_1", {"p1.right"}, {"-p1.left"}), seam("round", {"p0.top"}, {"-p1.bottom"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.openings, 2);
  EXPECT_EQ(surface.euler, 0);
  EXPECT_EQ(surface.branching_edges, 0);
}

TEST(sew, four_corners_become_one_particle) {
  // Four quarters of a square; seams chain across the middle.
  const auto g = rectangles({{3, 3, 0.01}, {3, 3, 0.01}, {3, 3, 0.01}, {3, 3, 0.01}});
  const auto result = sewn(g, params_of({seam("low", {"p0.right"}, {"-p1.left"}), seam("high", {"p2.right"}, {"-p3.left"}), seam("across", {"p1.top", "p0.top"}, {"-p3.bottom", "-p2.bottom"})}));
  const mesh::Ids particle = mesh::particles(result.garment);
  std::set<int> middle;
  for (const auto& point : result.garment.points) {
    const std::string name = result.garment.panels[static_cast<std::size_t>(point.panel)].name + "." + point.name;
    if (name == "p0.top_right" || name == "p1.top_left" || name == "p2.bottom_right" || name == "p3.bottom_left") middle.insert(particle[point.vertex]);
  }
  EXPECT_EQ(middle.size(), 1u);
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.particles, 7 * 7);
  EXPECT_EQ(surface.openings, 1);
  EXPECT_EQ(surface.euler, 1);
}

TEST(sew, three_panels_in_one_seam) {
  const auto g = rectangles({{3, 3, 0.01}, {3, 3, 0.01}, {3, 3, 0.01}});
  const auto result = sewn(g, params_of({seam("s1", {"p0.right"}, {"-p1.left"}), seam("s2", {"p0.right"}, {"-p2.left"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.particles, 3 * 16 - 2 * 4);
  EXPECT_EQ(surface.branching_edges, 3);
  // A third panel with more particles than the sewn edge has is refused.
  const auto finer = rectangles({{3, 3, 0.01}, {3, 3, 0.01}, {4, 4, 0.0075}});
  const auto refused = tailor::sew(finer, params_of({seam("s1", {"p0.right"}, {"-p1.left"}), seam("s2", {"p0.right"}, {"-p2.left"})}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(codes(refused), std::vector<std::string>{"seam_conflict"});
}

TEST(sew, dart_tip_stays_one_vertex) {
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  skirt:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 200], e: [115, 200], tip: [100, 100], f: [85, 200], d: [0, 200]}
    outline:
      - {name: hem, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: waist_right, path: [c, e]}
      - {name: leg_right, path: [e, tip]}
      - {name: leg_left, path: [tip, f]}
      - {name: waist_left, path: [f, d]}
      - {name: left, path: [d, a]}
)", "dart.yaml");
  ASSERT_TRUE(pattern);
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), {});
  ASSERT_TRUE(g);
  const auto result = sewn(*g, params_of({seam("dart", {"skirt.leg_right"}, {"-skirt.leg_left"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.openings, 1);
  EXPECT_EQ(surface.euler, 1);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
  for (const auto& point : result.garment.points) {
    if (point.name != "tip") continue;
    for (const auto& weld : result.garment.welds) {
      EXPECT_NE(weld.a, point.vertex);
      EXPECT_NE(weld.b, point.vertex);
    }
  }
}

TEST(sew, fish_eye_dart_closes_the_hole) {
  const auto pattern = io::parse_pattern(test::sleeve, "sleeve.yaml");
  ASSERT_TRUE(pattern);
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), {});
  ASSERT_TRUE(g);
  const auto result = sewn(*g, params_of({seam("dart", {"sleeve.dart_left"}, {"-sleeve.dart_right"}), seam("dart_m", {"sleeve_m.dart_left"}, {"-sleeve_m.dart_right"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.components, 2);
  EXPECT_EQ(surface.openings, 2);
  EXPECT_EQ(surface.euler, 2);
}

TEST(sew, match_points_come_together) {
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  low:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [100, 0], c: [100, 50], d: [0, 50], n: [60, 50]}
    outline:
      - {name: bottom, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
    notches: {n: {edge: top, point: n}}
  high:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [100, 0], c: [100, 50], d: [0, 50], n: [54, 0]}
    outline:
      - {name: bottom, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
    notches: {n: {edge: bottom, point: n}}
)", "match.yaml");
  ASSERT_TRUE(pattern);
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), {});
  ASSERT_TRUE(g);
  auto spec = seam("s", {"low.top"}, {"-high.bottom"});
  spec.match = {{"low.n", "high.n"}};
  const auto result = sewn(*g, params_of({spec}));
  std::vector<int> notches;
  for (const auto& point : result.garment.points) {
    if (point.name == "n") notches.push_back(point.vertex);
  }
  ASSERT_EQ(notches.size(), 2u);
  EXPECT_NEAR(result.garment.uv(notches[0], 0), 0.06, 1e-12);
  EXPECT_NEAR(result.garment.uv(notches[1], 0), 0.054, 1e-12);
  const bool together = std::any_of(result.garment.welds.begin(), result.garment.welds.end(), [&](const auto& weld) { return weld.a == notches[0] && weld.b == notches[1]; });
  EXPECT_TRUE(together);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
}

TEST(sew, order_of_seams_does_not_matter) {
  const auto g = rectangles({{8, 4, 0.01}, {10, 3, 0.008}, {5, 4, 0.01}});
  std::vector<tailor::SeamSpec> seams{seam("b", {"p0.right"}, {"-p0.left"}), seam("c", {"p1.right"}, {"-p1.left"}), seam("a", {"p0.top"}, {"-p1.bottom"})};
  std::sort(seams.begin(), seams.end(), [](const auto& x, const auto& y) { return x.name < y.name; });
  std::string reference;
  do {
    const std::string bytes = io::format_garment(sewn(g, params_of(seams)).garment, io::Encoding::ascii);
    if (reference.empty()) reference = bytes;
    EXPECT_EQ(bytes, reference);
  } while (std::next_permutation(seams.begin(), seams.end(), [](const auto& x, const auto& y) { return x.name < y.name; }));
}

TEST(sew, lengths_must_agree_unless_ease_is_declared) {
  const auto g = rectangles({{4, 10, 0.01}, {4, 10, 0.0103}});
  auto spec = seam("s", {"p0.right"}, {"-p1.left"});
  const auto refused = tailor::sew(g, params_of({spec}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(codes(refused), std::vector<std::string>{"seam_length"});
  EXPECT_EQ(refused.issues().front().category, Category::check);
  EXPECT_NE(refused.issues().front().what.find("100.00 mm"), std::string::npos);
  EXPECT_NE(refused.issues().front().what.find("103.00 mm"), std::string::npos);
  spec.ease = 0.003;
  const auto result = sewn(g, params_of({spec}));
  EXPECT_NEAR(result.garment.seams[0].length_a, 0.1, 1e-12);
  EXPECT_NEAR(result.garment.seams[0].length_b, 0.103, 1e-12);
  // Within a percent nothing needs to be declared.
  EXPECT_TRUE(tailor::sew(rectangles({{4, 10, 0.01}, {4, 10, 0.01009}}), params_of({seam("s", {"p0.right"}, {"-p1.left"})})));
}

TEST(sew, gathers_of_three_to_one) {
  const auto g = rectangles({{10, 4, 0.01}, {30, 4, 0.01}});
  auto spec = seam("s", {"p0.top"}, {"-p1.bottom"});
  spec.ease = 0.2;
  const auto result = sewn(g, params_of({spec}));
  EXPECT_EQ(result.garment.welds.size(), 31u);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
}

TEST(sew, twisted_seams_are_refused) {
  const auto g = rectangles({{4, 4, 0.01}, {4, 4, 0.01}, {4, 4, 0.01}});
  EXPECT_EQ(codes(tailor::sew(g, params_of({seam("s", {"p0.right"}, {"p1.left"})}))), std::vector<std::string>{"twisted_seam"});
  EXPECT_EQ(codes(tailor::sew(g, params_of({seam("s", {"p0.right"}, {"p0.left"})}))), std::vector<std::string>{"twisted_seam"});
  auto chain = seam("s", {"p0.top", "-p1.top"}, {"-p2.bottom"});
  chain.ease = 1;
  EXPECT_EQ(codes(tailor::sew(g, params_of({chain}))), std::vector<std::string>{"twisted_seam"});
}

TEST(sew, panels_that_would_fold_or_vanish_are_refused) {
  EXPECT_EQ(codes(tailor::sew(rectangles({{1, 2, 0.01}}), params_of({seam("s", {"p0.right"}, {"-p0.left"})}))).front(), "degenerate_face");
  EXPECT_EQ(codes(tailor::sew(rectangles({{2, 2, 0.01}}), params_of({seam("s", {"p0.right"}, {"-p0.left"})}))).front(), "folded_panel");
}

TEST(sew, all_wrong_names_are_reported_at_once) {
  const auto g = rectangles({{4, 4, 0.01}, {4, 4, 0.01}});
  auto spec = seam("s", {"p0.rigt", "p9.left", "p0"}, {});
  spec.match = {{"p0.top_lef", "p1.top_left"}};
  const auto refused = tailor::sew(g, params_of({spec, seam("s", {"p0.right"}, {"-p0.right"})}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(codes(refused), (std::vector<std::string>{"unknown_edge", "unknown_panel", "bad_reference", "empty_seam", "unknown_point", "duplicate_name", "same_edge"}));
  EXPECT_NE(refused.issues()[0].remedy.find("right"), std::string::npos);
}

TEST(sew, only_flat_unlayered_unsewn_garments) {
  auto g = rectangles({{4, 4, 0.01}, {4, 4, 0.01}});
  const auto params = params_of({seam("s", {"p0.right"}, {"-p1.left"})});
  auto bent = g;
  bent.x(3, 2) = 0.01;
  EXPECT_EQ(codes(tailor::sew(bent, params)), std::vector<std::string>{"not_flat"});
  EXPECT_EQ(codes(tailor::sew(sewn(g, params).garment, params)), std::vector<std::string>{"already_sewn"});
  EXPECT_EQ(codes(tailor::sew(test::two_panels(), {}))[0], "already_layered");
}
