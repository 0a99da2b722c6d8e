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

/// The first issue as a line; its code must be the one expected.
std::string refusal(const mesh::GarmentMesh& g, const tailor::SewParams& params, const std::string& code) {
  const auto result = tailor::sew(g, params);
  if (result) return "it was sewn";
  EXPECT_EQ(result.issues().front().code, code) << to_string(result.issues().front());
  return to_string(result.issues().front());
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Vertices of a run in order.
std::vector<int> run_ids(const mesh::GarmentMesh& g, int run) { return mesh::run_vertex_ids(g, run); }

/// Particles of a run's vertices at the given arc lengths; -1 where there is no vertex.
std::vector<int> particles_at(const mesh::GarmentMesh& g, int run, const std::vector<double>& places) {
  const mesh::Ids particle = mesh::particles(g);
  std::vector<int> result;
  for (double s : places) {
    int found = -1;
    for (const auto& row : g.run_vertices) {
      if (row.run == run && std::abs(row.s - s) < 1e-9) found = particle[row.vertex];
    }
    result.push_back(found);
  }
  return result;
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

TEST(sew, a_ring_that_is_set_in_turned_is_noted) {
  // Two tubes of two panels each, 40 and 60 mm wide.
  const auto g = rectangles({{4, 4, 0.01}, {6, 4, 0.01}, {4, 4, 0.01}, {6, 4, 0.01}});
  const std::vector<tailor::SeamSpec> tubes{seam("lower_1", {"p0.right"}, {"-p1.left"}), seam("lower_2", {"p1.right"}, {"-p0.left"}), seam("upper_1", {"p2.right"}, {"-p3.left"}), seam("upper_2", {"p3.right"}, {"-p2.left"})};
  const auto joined = [&](const tailor::SeamSpec& ring) {
    auto seams = tubes;
    seams.push_back(ring);
    return sewn(g, params_of(seams));
  };
  EXPECT_TRUE(joined(seam("ring", {"p1.top", "p0.top"}, {"-p3.bottom", "-p2.bottom"})).notes.empty());
  auto turned = seam("ring", {"p1.top", "p0.top"}, {"-p2.bottom", "-p3.bottom"});
  const auto result = joined(turned);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0].code, "turned_ring");
  EXPECT_TRUE(has(result.notes[0].what, "1 of the seams")) << result.notes[0].what;
  EXPECT_TRUE(has(result.notes[0].what, "2 would if side b (-p2.bottom -p3.bottom) were begun 40.0 mm later")) << result.notes[0].what;
  turned.match = {{"p1.top_right", "p2.bottom_right"}};
  EXPECT_TRUE(joined(turned).notes.empty()) << "a match point says that it is meant";
}

TEST(sew, ease_at_the_start_of_a_ring_lies_before_it) {
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  plate:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 200], d: [0, 200], q0: [70, 70], q1: [70, 130], q2: [130, 130], q3: [130, 70]}
    outline:
      - {name: border, path: [a, b, c, d, a]}
    holes:
      window:
        - {name: h0, path: [q0, q1]}
        - {name: h1, path: [q1, q2]}
        - {name: h2, path: [q2, q3]}
        - {name: h3, path: [q3, q0]}
  band:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [246, 0], c: [246, 40], d: [0, 40]}
    outline:
      - {name: low, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
)", "window.yaml");
  ASSERT_TRUE(pattern) << to_string(pattern.issues().front());
  const auto cut = pattern::cut_panels(*pattern);
  ASSERT_TRUE(cut) << to_string(cut.issues().front());
  const auto g = tailor::mesh_panels(*cut, {});
  ASSERT_TRUE(g) << to_string(g.issues().front());
  auto ring = seam("ring", {"plate.h0", "plate.h1", "plate.h2", "plate.h3"}, {"-band.top"});
  ring.ease = 0.006;
  const auto partner_of_corner = [&](const char* name, const tailor::SeamSpec& spec) {
    const auto result = sewn(*g, params_of({seam("close", {"band.right"}, {"-band.left"}), spec}));
    for (const auto& point : result.garment.points) {
      if (point.name != name) continue;
      for (const auto& weld : result.garment.welds) {
        if (weld.a == point.vertex) return result.garment.uv(weld.b, 0);
      }
    }
    return -1.0;
  };
  // The last side of the window takes all of it, whether it is named by its corners or by its edge.
  for (const auto& zone : {tailor::EaseZone{"plate.q3", "plate.q0", 1}, tailor::EaseZone{"plate.h3(0 %)", "plate.h3(100 %)", 1}}) {
    ring.ease_at = {zone};
    EXPECT_NEAR(partner_of_corner("q1", ring), 0.06, 1e-6) << zone.to;
    EXPECT_NEAR(partner_of_corner("q3", ring), 0.18, 1e-6) << zone.to;
  }
  ring.ease_at = {{"plate.q0", "plate.q1", 1}};
  EXPECT_NEAR(partner_of_corner("q1", ring), 0.066, 1e-6);
  // A match point turns the ring: its start lies inside the zone, which is in two parts then.
  ring.match = {{"plate.q2", "band.d"}};
  ring.ease_at = {{"plate.h1(50 %)", "plate.h2(50 %)", 1}};
  EXPECT_NEAR(partner_of_corner("q3", ring), 0.063, 1e-6);
  EXPECT_NEAR(partner_of_corner("q0", ring), 0.123, 1e-6);
  EXPECT_NEAR(partner_of_corner("q1", ring), 0.183, 1e-6);
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
  // A third panel with more particles than the sewn edge has: the others get them too.
  const auto finer = rectangles({{3, 3, 0.01}, {3, 3, 0.01}, {4, 4, 0.0075}});
  const auto all = sewn(finer, params_of({seam("s1", {"p0.right"}, {"-p1.left"}), seam("s2", {"p0.right"}, {"-p2.left"})}));
  for (const int run : {1, 7, 11}) EXPECT_EQ(run_s(all.garment, run).size(), 5u);
  EXPECT_EQ(tailor::surface_report(all.garment).branching_edges, 4);
  EXPECT_EQ(all.garment.welds.size(), 10u);
  // The same as one seam with a further side.
  auto one = seam("s", {"p0.right"}, {"-p1.left"});
  one.more = {{"-p2.left"}};
  const auto together = sewn(finer, params_of({one}));
  EXPECT_EQ(together.garment.x, all.garment.x);
  EXPECT_EQ(together.garment.faces, all.garment.faces);
  ASSERT_EQ(together.garment.seams.size(), 2u);
  EXPECT_EQ(together.garment.seams[1].name, "s_side_3");
  EXPECT_EQ(together.garment.seams[1].kind, "further");
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
  // Where the face of one cloth meets the back of the other it is meant.
  auto turned = seam("s", {"p0.right"}, {"p1.left"});
  turned.same_direction = true;
  EXPECT_EQ(sewn(g, params_of({turned})).garment.welds.size(), 5u);
  turned.b = {"-p1.left"};
  EXPECT_EQ(codes(tailor::sew(g, params_of({turned}))), std::vector<std::string>{"twisted_seam"});
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

// ---- parts of edges

TEST(sew, ranges_by_points_lengths_and_percentages) {
  // Runs of a rectangle: bottom, right, top, left, each from its start counter-clockwise.
  const auto g = rectangles({{10, 4, 0.01}, {10, 4, 0.01}});
  for (const auto& [a, b] : {std::pair{"p0.top(20 mm..80 mm)", "-p1.bottom(20%..80%)"}, std::pair{"p0.top(20 %..-20 mm)", "-p1.bottom(2 cm..-2 cm)"}}) {
    const auto result = sewn(g, params_of({seam("s", {a}, {b})}));
    EXPECT_EQ(result.garment.welds.size(), 7u);
    EXPECT_NEAR(result.garment.seams[0].length_a, 0.06, 1e-12);
    EXPECT_EQ(result.seams[0].added, 0);
    const auto& first = result.garment.welds.front();
    EXPECT_NEAR(result.garment.uv(first.a, 0), 0.08, 1e-12);
    EXPECT_NEAR(result.garment.uv(first.b, 0), 0.08, 1e-12);
  }
  const auto open = sewn(g, params_of({seam("s", {"p0.top(..60 mm)"}, {"-p1.bottom(40 mm..)"}), seam("t", {"p0.right(bottom_right..)"}, {"-p1.left(..bottom_left)"})}));
  EXPECT_EQ(open.garment.welds.size(), 7u + 5u);
}

TEST(sew, ends_of_a_range_become_particles) {
  const auto g = rectangles({{10, 6, 0.01}, {6, 6, 0.01}});
  const auto result = sewn(g, params_of({seam("s", {"p0.top(23 mm..83 mm)"}, {"-p1.bottom"})}));
  const std::vector<double> s = run_s(result.garment, 2);
  EXPECT_EQ(s.size(), 11u);  // the nearest particles have come to the ends of the range
  for (double end : {0.023, 0.083}) EXPECT_TRUE(std::any_of(s.begin(), s.end(), [&](double at) { return std::abs(at - end) < 1e-12; }));
  EXPECT_EQ(result.garment.welds.size(), 7u);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
  EXPECT_LE(result.seams[0].farthest_slide, 0.005);
  // Just beside a corner the corner is meant.
  const auto corner = sewn(g, params_of({seam("s", {"p0.top(0.4 mm..60.4 mm)"}, {"-p1.bottom"})}));
  EXPECT_EQ(run_ids(corner.garment, 2).front(), corner.garment.welds.back().seam == 0 ? corner.garment.welds.front().a : -1);
}

TEST(sew, a_seam_may_end_inside_an_edge) {
  // Two panels side by side on one long edge: the seam between them ends inside it.
  for (const auto matching : {tailor::Matching::aligned, tailor::Matching::published}) {
    const auto g = rectangles({{12, 4, 0.01}, {5, 4, 0.01}, {7, 4, 0.0104}});
    auto params = params_of({seam("between", {"p1.right"}, {"-p2.left"}), seam("along", {"p1.bottom", "p2.bottom"}, {"-p0.top"})});
    params.seams[0].ease = 0.002;
    params.seams[1].ease = 0.004;
    params.matching = matching;
    const auto result = sewn(g, params);
    const auto surface = tailor::surface_report(result.garment);
    EXPECT_EQ(surface.components, 1);
    EXPECT_EQ(surface.openings, 1);
    EXPECT_EQ(surface.euler, 1);
    EXPECT_GE(tailor::angle_report(result.garment).least, 20);
    // The same by ranges, in two seams.
    auto ranges = params_of({params.seams[0], seam("left", {"p1.bottom"}, {"-p0.top(-50 mm..)"}), seam("right", {"p2.bottom"}, {"-p0.top(..-50 mm)"})});
    ranges.seams[2].ease = 0.004;
    ranges.matching = matching;
    const auto parts = sewn(g, ranges);
    EXPECT_EQ(tailor::surface_report(parts.garment).openings, 1);
    EXPECT_EQ(tailor::surface_report(parts.garment).euler, 1);
  }
}

TEST(sew, an_edge_on_the_inside_of_a_sewn_seam) {
  // A pocket's edge caught in the side seam, with smaller cells than the side: all three get its particles.
  const auto g = rectangles({{6, 12, 0.01}, {6, 12, 0.01}, {8, 12, 0.005}});
  for (const char* name : {"a", "z"}) {
    const auto result = sewn(g, params_of({seam("m", {"p0.right"}, {"-p1.left"}), seam(name, {"p0.right(30 mm..90 mm)"}, {"-p2.left"})}));
    for (const int run : {1, 7}) EXPECT_EQ(run_s(result.garment, run).size(), 13u + 6u);
    const auto surface = tailor::surface_report(result.garment);
    EXPECT_EQ(surface.branching_edges, 12);
    EXPECT_EQ(surface.components, 1);
    EXPECT_GE(tailor::angle_report(result.garment).least, 20);
  }
}

TEST(sew, inner_lines_can_be_sewn_to) {
  // A patch pocket: three of its edges on the lines that are drawn for it.
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  front:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 200], d: [0, 200]}
    outline:
      - {name: hem, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
    lines: {place: {kind: placement, path: [[50, 150], [50, 50], [150, 50], [150, 150]]}}
  pocket:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [100, 0], c: [100, 100], d: [0, 100]}
    outline:
      - {name: bottom, path: [d, a, b, c]}
      - {name: top, path: [c, d]}
)", "pocket.yaml");
  ASSERT_TRUE(pattern);
  tailor::MeshParams mesh_params;
  mesh_params.lines = {"front.place"};
  mesh_params.panels["pocket"].cell = 0.008;
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), mesh_params);
  ASSERT_TRUE(g);
  const auto result = sewn(*g, params_of({seam("pocket", {"pocket.bottom"}, {"front.place"})}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.components, 1);
  EXPECT_GT(surface.branching_edges, 30);
  EXPECT_EQ(surface.openings, 2);  // the front all round, and the mouth of the pocket
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
}

// ---- several panels, rings, panels sewn to themselves

TEST(sew, corners_of_two_plies_do_not_lie_on_each_other) {
  // A bag: two equal panels sewn along three sides, face on face and back on back. A triangle that cuts off a corner has all
  // its particles in common with its counterpart.
  const auto g = rectangles({{6, 5, 0.01}, {6, 5, 0.01}});
  auto turned = seam("bag", {"p0.left", "p0.bottom", "p0.right"}, {"p1.left", "p1.bottom", "p1.right"});
  turned.same_direction = true;
  for (const auto& bag : {seam("bag", {"p0.left", "p0.bottom", "p0.right"}, {"-p1.right", "-p1.bottom", "-p1.left"}), turned}) {
    const auto result = sewn(g, params_of({bag}));
    const auto surface = tailor::surface_report(result.garment);
    EXPECT_EQ(surface.openings, 1);
    EXPECT_EQ(surface.euler, 1);
    EXPECT_NEAR(surface.opening_lengths[0], 0.12, 1e-12);
    EXPECT_GE(tailor::angle_report(result.garment).least, 20);
  }
}

TEST(sew, a_dart_drawn_as_one_edge) {
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
      - {name: dart, path: [e, tip, f]}
      - {name: waist_left, path: [f, d]}
      - {name: left, path: [d, a]}
)", "dart.yaml");
  ASSERT_TRUE(pattern);
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), {});
  ASSERT_TRUE(g);
  for (const auto& [a, b] : {std::pair{"skirt.dart(..tip)", "-skirt.dart(tip..)"}, std::pair{"skirt.dart(..50 %)", "-skirt.dart(50 %..)"}}) {
    const auto result = sewn(*g, params_of({seam("dart", {a}, {b})}));
    const auto surface = tailor::surface_report(result.garment);
    EXPECT_EQ(surface.openings, 1);
    EXPECT_EQ(surface.euler, 1);
    ASSERT_FALSE(result.lines[0].empty());
    EXPECT_EQ(result.lines[0].back().a, result.lines[0].back().b);  // the tip
    EXPECT_EQ(result.garment.welds.size() + 1, result.lines[0].size());
  }
}

TEST(sew, an_edge_folded_in_its_middle) {
  // A straight edge closed upon itself: a cone. Its tip keeps cloth around it, whatever the triangles there were.
  for (int cells : {4, 5, 6, 9}) {
    const auto g = rectangles({{static_cast<double>(cells), 5, 0.01}});
    const auto result = sewn(g, params_of({seam("s", {"p0.top(..50 %)"}, {"-p0.top(50 %..)"})}));
    const auto surface = tailor::surface_report(result.garment);
    EXPECT_EQ(surface.openings, 1);
    EXPECT_EQ(surface.euler, 1);
  }
}

namespace {

/// A ring of cloth: an annulus cut by no seam, so that both its edges are closed runs.
mesh::GarmentMesh two_rings() {
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  plate:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [-100, -100], b: [100, -100], c: [100, 100], d: [-100, 100], east: [50, 0], west: [-50, 0]}
    outline:
      - {name: rim, path: [a, b, c, d, a]}
    holes:
      hole:
        - {name: hole, path: [east, {arc: {through: [0, 50]}}, west, {arc: {through: [0, -50]}}, east]}
  tube:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [314.159, 0], c: [314.159, 60], d: [0, 60], q: [78.54, 0]}
    outline:
      - {name: low, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: high, path: [c, d]}
      - {name: left, path: [d, a]}
    notches: {q: {edge: low, point: q}}
)", "rings.yaml");
  EXPECT_TRUE(pattern) << to_string(pattern.issues().front());
  const auto g = tailor::mesh_panels(*pattern::cut_panels(*pattern), {});
  EXPECT_TRUE(g);
  return *g;
}

/// Particle of a point by name.
int particle_of(const mesh::GarmentMesh& g, const std::string& name) {
  const mesh::Ids particle = mesh::particles(g);
  for (const auto& point : g.points) {
    if (g.panels[static_cast<std::size_t>(point.panel)].name + "." + point.name == name) return particle[point.vertex];
  }
  return -1;
}

}  // namespace

TEST(sew, a_tube_into_a_hole) {
  // The hole is a closed run that begins at its eastern point; the tube is closed by a seam of its own.
  const auto g = two_rings();
  const auto close = seam("close", {"tube.right"}, {"-tube.left"});
  const auto plain = sewn(g, params_of({close, seam("round", {"tube.low"}, {"-plate.hole"})}));
  EXPECT_EQ(particle_of(plain.garment, "tube.a"), particle_of(plain.garment, "plate.east"));
  // With a match point the start is where that puts it.
  auto turned = seam("round", {"tube.low"}, {"-plate.hole"});
  turned.match = {{"tube.a", "plate.west"}};
  const auto half = sewn(g, params_of({close, turned}));
  EXPECT_EQ(particle_of(half.garment, "tube.a"), particle_of(half.garment, "plate.west"));
  turned.match = {{"tube.q", "plate.east"}};
  const auto quarter = sewn(g, params_of({close, turned}));
  EXPECT_EQ(particle_of(quarter.garment, "tube.q"), particle_of(quarter.garment, "plate.east"));
  EXPECT_NE(particle_of(quarter.garment, "tube.a"), particle_of(quarter.garment, "plate.east"));
  for (const auto* result : {&plain, &half, &quarter}) {
    const auto surface = tailor::surface_report(result->garment);
    EXPECT_EQ(surface.components, 1);
    EXPECT_EQ(surface.openings, 2);
    EXPECT_EQ(surface.euler, 0);
    EXPECT_EQ(surface.branching_edges, 0);
    EXPECT_GE(tailor::angle_report(result->garment).least, 20);
  }
  // A range over the start of the closed run.
  const auto over = sewn(g, params_of({seam("part", {"tube.low(..50 %)"}, {"-plate.hole(75 %..25 %)"})}));
  EXPECT_EQ(tailor::surface_report(over.garment).openings, 2);
}

TEST(sew, a_cuff_whose_seam_is_not_at_the_sleeves) {
  const auto g = rectangles({{12, 5, 0.01}, {12, 4, 0.01}});
  auto round = seam("round", {"p0.bottom"}, {"-p1.top"});
  round.match = {{"p0.bottom_left", "p1.top(30 mm)"}};
  const auto result = sewn(g, params_of({seam("sleeve", {"p0.right"}, {"-p0.left"}), seam("cuff", {"p1.right"}, {"-p1.left"}), round}));
  const auto surface = tailor::surface_report(result.garment);
  EXPECT_EQ(surface.openings, 2);
  EXPECT_EQ(surface.euler, 0);
  EXPECT_EQ(particles_at(result.garment, 0, {0}), particles_at(result.garment, 6, {0.03}));
  EXPECT_EQ(particles_at(result.garment, 0, {0.03}), particles_at(result.garment, 6, {0}));
}

// ---- ease and gathers

TEST(sew, ease_is_laid_where_the_spec_says) {
  const auto g = rectangles({{20, 4, 0.01}, {20, 4, 0.0108}});
  auto spec = seam("s", {"p0.top"}, {"-p1.bottom"});
  spec.ease = 0.016;
  spec.ease_at = {{"p1.bottom(80 mm)", "p1.bottom(136 mm)", 0.75}};
  const auto result = sewn(g, params_of({spec}));
  // 12 of 16 mm lie in the zone of 56 mm: it meets 44 mm; 160 mm beside it meet 156 mm.
  const double before = 0.08 * 156 / 160;
  EXPECT_EQ(particles_at(result.garment, 4, {0.08, 0.136}), particles_at(result.garment, 2, {0.2 - before, 0.2 - before - 0.044}));
  EXPECT_GE(particles_at(result.garment, 4, {0.08})[0], 0);
  EXPECT_NEAR(result.seams[0].steepest, 56.0 / 44, 0.01);
  // The same zone given on the short side.
  spec.ease_at = {{"p0.top(100 mm)", "p0.top(60 mm)", 1}};
  const auto other = sewn(g, params_of({spec}));
  EXPECT_EQ(particles_at(other.garment, 2, {0.06, 0.1}), particles_at(other.garment, 4, {0.216 - 0.06, 0.216 - 0.116}));
  spec.ease_at[0].share = 0.5;
  spec.ease_at.push_back({"p0.top(100 mm)", "p0.top(120 mm)", 0.6});
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "bad_ease"), "110 %"));
  spec.ease_at = {{"p1.bottom(80 mm)", "p1.bottom(92 mm)", 1}};
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "bad_ease"), "16.00 mm of ease do not fit into a zone of 12.00 mm"));
  spec.ease_at = {{"p1.bottom(80 mm)", "p0.top(92 mm)", 1}};
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "bad_ease"), "not on one side"));
}

TEST(sew, gathers_have_a_ratio) {
  const auto g = rectangles({{10, 4, 0.01}, {29, 6, 0.01}});
  auto spec = seam("s", {"p0.top"}, {"-p1.bottom"});
  spec.gather = 3;
  const auto result = sewn(g, params_of({spec}));
  EXPECT_EQ(result.garment.welds.size(), 30u);
  EXPECT_GE(tailor::angle_report(result.garment).least, 20);
  // Both sides keep their own lengths.
  double a = 0, b = 0;
  for (std::size_t k = 1; k < result.garment.welds.size(); ++k) {
    a += (result.garment.uv.row(result.garment.welds[k].a) - result.garment.uv.row(result.garment.welds[k - 1].a)).norm();
    b += (result.garment.uv.row(result.garment.welds[k].b) - result.garment.uv.row(result.garment.welds[k - 1].b)).norm();
  }
  EXPECT_NEAR(a, 0.1, 1e-12);
  EXPECT_NEAR(b, 0.29, 1e-12);
  spec.gather = 2;
  const std::string text = refusal(g, params_of({spec}), "seam_length");
  EXPECT_TRUE(has(text, "side b is longer by 190.00 mm, 100.00 mm are allowed")) << text;
  EXPECT_TRUE(has(text, "gather: 2.9")) << text;
  // Match points that leave too much cloth for a stretch.
  spec.gather = 3;
  spec.match = {{"p0.top(50 mm)", "p1.bottom(80 mm)"}};
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "steep_ease"), "210.00 mm"));
}

// ---- what is refused

TEST(sew, chains_out_of_order_are_refused) {
  const auto g = rectangles({{4, 4, 0.01}, {4, 4, 0.01}, {8, 4, 0.01}});
  const auto between = seam("between", {"p0.right"}, {"-p1.left"});
  EXPECT_EQ(tailor::surface_report(sewn(g, params_of({between, seam("s", {"p0.bottom", "p1.bottom"}, {"-p2.top"})})).garment).openings, 1);
  const std::string text = refusal(g, params_of({between, seam("s", {"p1.bottom", "p0.bottom"}, {"-p2.top"})}), "chain_order");
  EXPECT_TRUE(has(text, "p1.bottom at 40.0 mm, the next begins on p0.bottom at 0.0 mm")) << text;
  refusal(g, params_of({seam("s", {"p0.bottom", "p1.bottom"}, {"-p2.top"})}), "chain_order");
}

TEST(sew, ranges_that_overlap_are_refused) {
  const auto g = rectangles({{10, 4, 0.01}, {10, 4, 0.01}, {6, 4, 0.01}});
  auto eased = seam("s", {"p0.top(..60 mm)", "p0.top(50 mm..)"}, {"-p1.bottom"});
  eased.ease = 0.01;
  EXPECT_TRUE(has(refusal(g, params_of({eased}), "same_edge"), "from 50.0 to 100.0 mm occurs twice"));
  const std::string twice = refusal(g, params_of({seam("s", {"p0.top(..60 mm)"}, {"-p1.bottom(40 mm..)"}), seam("t", {"p0.top(50 mm..)"}, {"-p1.bottom(..50 mm)"})}), "sewn_twice");
  EXPECT_TRUE(has(twice, "overlap by 10.00 mm, both sewn to p1")) << twice;
  refusal(g, params_of({seam("s", {"p0.top"}, {"-p1.bottom"}), seam("t", {"p1.bottom"}, {"-p0.top"})}), "sewn_twice");
  // Another cloth may overlap.
  sewn(g, params_of({seam("s", {"p0.top(..60 mm)"}, {"-p1.bottom(40 mm..)"}), seam("t", {"p0.top(30 mm..90 mm)"}, {"-p2.bottom"})}));
}

TEST(sew, seams_that_contradict_each_other_are_refused) {
  const auto g = rectangles({{10, 4, 0.01}, {10, 4, 0.01}, {10, 4, 0.01}});
  auto shifted = seam("c", {"p2.top"}, {"p0.top"});
  shifted.same_direction = true;
  // All three pairs, in agreement, are one seam of three panels.
  sewn(g, params_of({seam("a", {"p0.top"}, {"-p1.bottom"}), seam("b", {"p1.bottom"}, {"-p2.top"}), shifted}));
  shifted.match = {{"p2.top(50 mm)", "p0.top(70 mm)"}};
  const auto refused = tailor::sew(g, params_of({seam("a", {"p0.top"}, {"-p1.bottom"}), seam("b", {"p1.bottom"}, {"-p2.top"}), shifted}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.issues().front().code, "seam_conflict") << to_string(refused.issues().front());
}

TEST(sew, wrong_references_say_what_is_there) {
  const auto g = rectangles({{10, 4, 0.01}, {10, 4, 0.01}});
  const auto text = [&](const std::string& a, const std::string& code) { return refusal(g, params_of({seam("s", {a}, {"-p1.bottom"})}), code); };
  EXPECT_TRUE(has(text("p0.top(top_rigt..)", "unknown_point"), "did you mean 'top_right'"));
  EXPECT_TRUE(has(text("p0.top(bottom_left..)", "unknown_point"), "the point 'bottom_left' is not on p0.top; on it are: top_right, top_left"));
  EXPECT_TRUE(has(text("p0.top(..120 mm)", "bad_range"), "'120 mm' lies 20.00 mm beyond the end of p0.top, which is 100.00 mm long"));
  EXPECT_TRUE(has(text("p0.top(-120 mm..)", "bad_range"), "before the start"));
  EXPECT_TRUE(has(text("p0.top(60 mm..40 mm)", "bad_range"), "begins at 60.00 mm and ends at 40.00 mm"));
  EXPECT_TRUE(has(text("p0.top(60..80 mm)", "missing_unit"), "no unit"));
  text("p0.top(60 mm)", "bad_reference");
  text("p0.top(60 mm..", "bad_reference");
  auto spec = seam("s", {"p0.top"}, {"-p1.bottom"});
  spec.match = {{"p0.top(20 mm..30 mm)", "p1.bottom(20 mm)"}};
  refusal(g, params_of({spec}), "bad_reference");
  spec.match = {{"p0.bottom(20 mm)", "p1.bottom(20 mm)"}};
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "bad_match"), "'p0.bottom(20 mm)' is not on side a (p0.top)"));
  spec.match = {{"p0.top(20 mm)", "p1.bottom(20 mm)"}, {"p0.top(60 mm)", "p1.bottom(60 mm)"}};
  EXPECT_TRUE(has(refusal(g, params_of({spec}), "bad_match"), "another order"));
}
