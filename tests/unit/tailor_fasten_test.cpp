#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "garments.h"
#include "toile/base/rng.h"
#include "toile/tailor/fasten.h"

using namespace toile;

namespace {

mesh::GarmentMesh two_panels(int n = 4, int m = 4) {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "left", 4, n, 0.04 / n);
  test::add_rectangle(g, "right", 4, m, 0.04 / m, 0.1);
  return g;
}

template <class T>
std::vector<std::string> codes(const Result<T>& result) {
  std::vector<std::string> list;
  for (const Issue& issue : result.issues()) list.push_back(issue.code);
  return list;
}

tailor::FastenerSpec row(const std::string& name, std::vector<tailor::FastenerEnd> a, std::vector<tailor::FastenerEnd> b) {
  tailor::FastenerSpec spec;
  spec.name = name;
  spec.a = std::move(a);
  spec.b = std::move(b);
  return spec;
}

tailor::ZipSpec zip(std::vector<std::string> a, std::vector<std::string> b) {
  tailor::ZipSpec spec;
  spec.name = "fly";
  spec.a = std::move(a);
  spec.b = std::move(b);
  return spec;
}

tailor::Fastened fastened(const mesh::GarmentMesh& g, const tailor::FastenParams& params) {
  auto result = tailor::fasten(g, params);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

}  // namespace

TEST(fasten, a_row_is_one_closure) {
  const auto g = two_panels();
  tailor::FastenParams params;
  params.fasteners = {row("front", {{.point = "left.bottom_right"}, {.point = "left.top_right"}, {.panel = "left", .at = {{0.0313, 0.0204}}}},
                          {{.point = "right.bottom_left"}, {.point = "right.top_left"}, {.panel = "right", .at = {{0.01, 0.02}}}})};
  auto& spec = params.fasteners[0];
  spec.kind = tailor::FastenerKind::snap;
  spec.treatment = tailor::Treatment::spring;
  spec.capture = 0.02;
  const auto result = fastened(g, params);
  ASSERT_EQ(result.garment.closures.size(), 1u);
  EXPECT_EQ(result.garment.closures[0].kind, "snap");
  ASSERT_EQ(result.garment.fasteners.size(), 3u);
  for (const auto& fastener : result.garment.fasteners) {
    EXPECT_EQ(fastener.kind, mesh::Fastener::Kind::snap);
    EXPECT_EQ(fastener.closure, 0);
    EXPECT_TRUE(fastener.closed);
    EXPECT_EQ(fastener.stiffness, 500);
    EXPECT_EQ(fastener.capture, 0.02);
  }
  EXPECT_NEAR(result.garment.uv(result.garment.fasteners[2].a, 0), 0.03, 1e-12);
  EXPECT_NEAR(result.farthest_snap, std::hypot(0.0013, 0.0004), 1e-12);
}

TEST(fasten, other_halves_on_the_mirror_image) {
  mesh::GarmentMesh g = two_panels();
  g.panels[0].name = "front";
  g.panels[1].name = "front_m";
  for (auto& panel : g.panels) panel.piece = "front";
  g.panels[1].mirrored = true;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 1) g.uv(v, 0) = -g.uv(v, 0);
  }
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    if (g.face_panel[f] == 1) std::swap(g.faces(f, 1), g.faces(f, 2));
  }
  tailor::FastenParams params;
  params.fasteners = {row("front", {{.point = "front.top_right"}, {.panel = "front", .at = {{0.02, 0.01}}}}, {})};
  const auto result = fastened(g, params);
  ASSERT_EQ(result.garment.fasteners.size(), 2u);
  for (const auto& fastener : result.garment.fasteners) {
    EXPECT_EQ(g.vertex_panel[fastener.b], 1);
    EXPECT_EQ(g.uv(fastener.b, 0), -g.uv(fastener.a, 0));
    EXPECT_EQ(g.uv(fastener.b, 1), g.uv(fastener.a, 1));
  }
  g.panels[1].piece = "other";
  EXPECT_EQ(codes(tailor::fasten(g, params)), (std::vector<std::string>{"bad_fastener", "bad_fastener"}));
}

TEST(fasten, switched_open_and_closed) {
  const auto g = two_panels();
  tailor::FastenParams params;
  params.fasteners = {row("top", {{.point = "left.top_right"}}, {{.point = "right.top_left"}}), row("bottom", {{.point = "left.bottom_right"}}, {{.point = "right.bottom_left"}})};
  params.fasteners[1].closed = false;
  const auto states = [&] {
    const auto result = fastened(g, params);
    return std::vector<bool>{result.garment.fasteners[0].closed, result.garment.fasteners[1].closed};
  };
  EXPECT_EQ(states(), (std::vector<bool>{true, false}));
  params.open = {"*"};
  EXPECT_EQ(states(), (std::vector<bool>{false, false}));
  params.closed = {"bottom"};  // a name goes before *
  EXPECT_EQ(states(), (std::vector<bool>{false, true}));
  params.open = {"bottom"};
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"bad_fastener"});
  params.closed = {"tpo"};
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"unknown_fastener"});
}

TEST(fasten, refusals) {
  mesh::GarmentMesh g = two_panels();
  tailor::FastenParams params;
  params.fasteners = {row("a", {{.point = "left.top_right"}}, {{.point = "left.top_right"}}), row("a", {{.point = "left.top"}}, {{.point = "right.top_left"}}), row("b", {{.point = "left.top_right"}, {.point = "left.top_left"}}, {{.point = "right.top_left"}}),
                      row("c", {}, {})};
  EXPECT_EQ(codes(tailor::fasten(g, params)), (std::vector<std::string>{"bad_fastener", "duplicate_name", "unknown_point", "bad_fastener", "bad_fastener"}));
  // Halves on particles that a seam joins.
  g.seams = {{.id = 0, .name = "s"}};
  g.welds = {{g.points[2].vertex, g.points[7].vertex, 0}};
  params.fasteners = {row("d", {{.point = "left.top_right"}}, {{.point = "right.top_left"}})};
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"bad_fastener"});
}

TEST(zip, teeth_by_arc_length_up_to_the_slider) {
  const auto g = two_panels(4, 4);
  tailor::FastenParams params;
  params.zips = {zip({"left.right"}, {"-right.left"})};
  params.zips[0].pitch = 0.002;
  params.zips[0].mass = 0.01;
  params.zips[0].slider = 0.6;
  params.zips[0].treatment = tailor::Treatment::spring;
  params.zips[0].stiffness = 100;
  const auto result = fastened(g, params);
  ASSERT_EQ(result.garment.closures.size(), 1u);
  EXPECT_EQ(result.garment.closures[0].kind, "zip");
  ASSERT_EQ(result.garment.fasteners.size(), 5u);
  double mass = 0;
  int teeth = 0;
  for (const auto& tooth : result.garment.fasteners) {
    EXPECT_EQ(tooth.kind, mesh::Fastener::Kind::zip);
    EXPECT_EQ(tooth.length, 0);
    EXPECT_EQ(g.uv(tooth.a, 1), g.uv(tooth.b, 1));
    EXPECT_EQ(tooth.closed, g.uv(tooth.a, 1) <= 0.024 + 1e-9);
    mass += tooth.mass;
    teeth += static_cast<int>(std::lround(tooth.stiffness / 100));
  }
  EXPECT_NEAR(mass, 0.01 * 0.04, 1e-15);
  EXPECT_EQ(teeth, 20);
  EXPECT_TRUE(std::is_sorted(result.garment.fasteners.begin(), result.garment.fasteners.end(), [&](const auto& p, const auto& q) { return g.uv(p.a, 1) < g.uv(q.a, 1); }));
  params.open = {"fly"};
  for (const auto& tooth : fastened(g, params).garment.fasteners) EXPECT_FALSE(tooth.closed);
  params.open.clear();
  params.closed = {"*"};
  for (const auto& tooth : fastened(g, params).garment.fasteners) EXPECT_TRUE(tooth.closed);
}

TEST(zip, unequal_grids_pair_each_particle_once) {
  for (const auto& [n, m] : {std::pair{5, 8}, std::pair{8, 5}, std::pair{3, 11}}) {
    const auto g = two_panels(n, m);
    tailor::FastenParams params;
    params.zips = {zip({"left.right"}, {"-right.left"})};
    params.zips[0].pitch = 0.001;
    const auto result = fastened(g, params);
    EXPECT_EQ(static_cast<int>(result.garment.fasteners.size()), std::min(n, m) + 1);
    std::vector<int> used;
    for (const auto& tooth : result.garment.fasteners) {
      used.push_back(tooth.a);
      used.push_back(tooth.b);
      EXPECT_LE(std::abs(g.uv(tooth.a, 1) - g.uv(tooth.b, 1)), 0.5 * 0.04 / std::max(n, m) + 0.25 * 0.04 / std::min(n, m));
    }
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end());
  }
}

TEST(zip, wide_teeth_leave_particles_out_and_sewn_ends_are_skipped) {
  mesh::GarmentMesh g = two_panels(8, 8);
  tailor::FastenParams params;
  params.zips = {zip({"left.right"}, {"-right.left"})};
  params.zips[0].pitch = 0.01;
  const auto wide = fastened(g, params);
  EXPECT_EQ(wide.garment.fasteners.size(), 4u);
  g.seams = {{.id = 0, .name = "s"}};
  g.welds = {{g.points[1].vertex, g.points[4].vertex, 0}};
  params.zips[0].pitch = 0.001;
  const auto sewn = fastened(g, params);
  EXPECT_EQ(sewn.garment.fasteners.size(), 8u);
  double mass = 0;
  for (const auto& tooth : sewn.garment.fasteners) mass += tooth.mass;
  EXPECT_NEAR(mass, 0.012 * 0.04, 1e-15);
}

TEST(zip, on_a_stretch_of_an_edge) {
  mesh::GarmentMesh g = two_panels(8, 8);
  g.points.push_back({0, "top", mesh::run_vertex_ids(g, 1)[6]});
  g.points.push_back({1, "top", mesh::run_vertex_ids(g, 7)[2]});
  tailor::FastenParams params;
  params.zips = {zip({"left.right(bottom_right..top)"}, {"-right.left(top..bottom_left)"})};
  const auto result = fastened(g, params);
  EXPECT_EQ(result.garment.fasteners.size(), 7u);
  for (const auto& tooth : result.garment.fasteners) {
    EXPECT_EQ(g.uv(tooth.a, 1), g.uv(tooth.b, 1));
    EXPECT_LE(g.uv(tooth.a, 1), 0.03 + 1e-12);
  }
}

TEST(zip, refusals) {
  mesh::GarmentMesh g = two_panels(4, 4);
  tailor::FastenParams params;
  params.zips = {zip({"left.right"}, {"right.left"})};  // twisted
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"bad_zip"});
  params.zips = {zip({"left.right", "left.tpo"}, {"-right"})};
  EXPECT_EQ(codes(tailor::fasten(g, params)), (std::vector<std::string>{"unknown_line", "bad_reference"}));
  params.zips = {zip({"left.right", "-left.top"}, {"-right.left"})};
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"bad_zip"});
  for (auto& row : g.run_vertices) {
    if (row.run == 1) row.s *= 1.25;
  }
  params.zips = {zip({"left.right"}, {"-right.left"})};
  EXPECT_EQ(codes(tailor::fasten(g, params)), std::vector<std::string>{"bad_zip"});
  params.zips[0].ease = 0.01;
  EXPECT_TRUE(tailor::fasten(g, params));
}

TEST(tack, points_become_one_particle) {
  const auto g = two_panels();
  const std::vector<tailor::TackSpec> tacks{{"t2", {{.point = "left.top_right"}}, {{.point = "right.top_left"}}}, {"t1", {{.point = "left.bottom_right"}, {.panel = "left", .at = {{0.02, 0.02}}}}, {{.point = "right.bottom_left"}, {.panel = "right", .at = {{0.02, 0.02}}}}}};
  const auto result = tailor::tack(g, tacks);
  ASSERT_TRUE(result);
  EXPECT_TRUE(mesh::validate(result->garment).empty());
  ASSERT_EQ(result->garment.seams.size(), 2u);
  EXPECT_EQ(result->garment.seams[0].name, "t1");  // whatever the order in the spec
  EXPECT_EQ(result->garment.seams[0].kind, "tack");
  EXPECT_EQ(result->garment.welds.size(), 3u);
  EXPECT_EQ(mesh::particles(result->garment).maxCoeff() + 1, g.vertex_count() - 3);
}

TEST(tack, keeps_what_must_hold_of_seams) {
  mesh::GarmentMesh g = two_panels();
  // A tack between neighbours of one panel closes a triangle.
  EXPECT_EQ(codes(tailor::tack(g, {{"t", {{.point = "left.top_right"}}, {{.panel = "left", .at = {{0.04, 0.03}}}}}})), std::vector<std::string>{"degenerate_face"});
  EXPECT_EQ(codes(tailor::tack(g, {{"t", {{.point = "left.top_right"}}, {{.point = "left.top_right"}}}})), std::vector<std::string>{"bad_tack"});
  // Two edges sewn, the third corner tacked: a triangle on a triangle.
  g.seams = {{.id = 0, .name = "s"}};
  const auto left = mesh::run_vertex_ids(g, 1), right = mesh::run_vertex_ids(g, 7);
  for (std::size_t k = 0; k < left.size(); ++k) g.welds.push_back({left[k], right[right.size() - 1 - k], 0});
  bool folded = false;
  for (double s = 0.0; s < 0.045; s += 0.01) {
    const auto refused = tailor::tack(g, {{"t", {{.panel = "left", .at = {{0.03, s}}}}, {{.panel = "right", .at = {{0.01, s}}}}}});
    if (!refused) {
      for (const auto& code : codes(refused)) folded |= code == "folded_panel";
    }
  }
  EXPECT_TRUE(folded);
  EXPECT_EQ(codes(tailor::tack(g, {{"s", {{.point = "left.top_left"}}, {{.point = "right.top_right"}}}})), std::vector<std::string>{"duplicate_name"});
}

namespace {

mesh::GarmentMesh named_panels(const std::vector<std::string>& names) {
  mesh::GarmentMesh g;
  for (const auto& name : names) test::add_rectangle(g, name, 1, 1, 0.01);
  return g;
}

std::vector<int> orders(const mesh::GarmentMesh& g) {
  std::vector<int> result;
  for (const auto& panel : g.panels) result.push_back(panel.order);
  return result;
}

}  // namespace

TEST(free_layers, orders_as_a_tailor_would_say) {
  const auto g = named_panels({"front", "back", "lining_front", "lining_back", "inner_pocket", "patch", "flap", "collar"});
  const auto result = tailor::free_layers(g, {{"lining", {"lining*"}, {"front", "back"}, tailor::FreeSide::inside},
                                              {"inner pocket", {"inner_pocket"}, {"lining_front"}, tailor::FreeSide::inside},
                                              {"patch", {"patch"}, {"front"}, tailor::FreeSide::outside},
                                              {"flap", {"flap"}, {"patch", "front"}, tailor::FreeSide::outside}});
  ASSERT_TRUE(result);
  EXPECT_TRUE(mesh::validate(*result).empty());
  EXPECT_EQ(orders(*result), (std::vector<int>{0, 0, -1, -1, -2, 1, 2, 0}));
  EXPECT_EQ(result->free_layers[0].panels, (std::vector<int>{2, 3}));
  EXPECT_TRUE(result->free_layers[2].outside);
}

TEST(free_layers, cloth_between_cloth) {
  // The flap belongs to no free layer and still lies on the pocket, which lies on the front.
  const auto g = named_panels({"front", "pocket", "flap"});
  const auto result = tailor::free_layers(g, {{"p", {"pocket"}, {"front"}, tailor::FreeSide::outside}, {"q", {"pocket"}, {"flap"}, tailor::FreeSide::inside}});
  ASSERT_TRUE(result);
  EXPECT_EQ(orders(*result), (std::vector<int>{0, 1, 2}));
}

TEST(free_layers, contradictions_are_named) {
  const auto g = named_panels({"front", "facing", "lining"});
  const auto refused = tailor::free_layers(g, {{"a", {"facing"}, {"front"}, tailor::FreeSide::inside}, {"b", {"lining"}, {"facing"}, tailor::FreeSide::inside}, {"c", {"lining"}, {"front"}, tailor::FreeSide::outside}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.issues().front().code, "layer_cycle");
  for (const char* part : {"facing outside lining (layer b)", "front outside facing (layer a)", "lining outside front (layer c)"}) EXPECT_NE(refused.issues().front().what.find(part), std::string::npos) << refused.issues().front().what;
  EXPECT_EQ(codes(tailor::free_layers(g, {{"a", {"facing"}, {"front"}, tailor::FreeSide::inside}, {"b", {"facing"}, {"front"}, tailor::FreeSide::outside}})), std::vector<std::string>{"layer_cycle"});
  EXPECT_EQ(codes(tailor::free_layers(g, {{"a", {"f*"}, {"front"}, tailor::FreeSide::inside}, {"a", {"collar"}, {}, tailor::FreeSide::inside}})), (std::vector<std::string>{"bad_layer", "duplicate_name", "unknown_panel", "bad_layer"}));
}

TEST(free_layers, any_consistent_relations_are_satisfied) {
  Rng rng(7);
  for (int round = 0; round < 300; ++round) {
    const int count = 3 + static_cast<int>(rng.next() % 8);
    std::vector<std::string> names;
    for (int p = 0; p < count; ++p) names.push_back("p" + std::to_string(p));
    const auto g = named_panels(names);
    // A hidden order makes them consistent.
    std::vector<int> hidden(static_cast<std::size_t>(count));
    for (int& h : hidden) h = static_cast<int>(rng.next() % 5);
    std::vector<tailor::FreeSpec> layers;
    for (int k = 0; k < count; ++k) {
      const auto a = rng.next() % static_cast<std::uint64_t>(count), b = rng.next() % static_cast<std::uint64_t>(count);
      if (hidden[a] == hidden[b]) continue;
      layers.push_back({"l" + std::to_string(k), {names[a]}, {names[b]}, hidden[a] > hidden[b] ? tailor::FreeSide::outside : tailor::FreeSide::inside});
    }
    const auto result = tailor::free_layers(g, layers);
    ASSERT_TRUE(result);
    for (const auto& layer : result->free_layers) {
      for (int p : layer.panels) {
        for (int q : layer.on) EXPECT_EQ(result->panels[static_cast<std::size_t>(p)].order > result->panels[static_cast<std::size_t>(q)].order, layer.outside);
      }
    }
    // In whatever order the relations are given.
    std::reverse(layers.begin(), layers.end());
    EXPECT_EQ(orders(*tailor::free_layers(g, layers)), orders(*result));
  }
}
