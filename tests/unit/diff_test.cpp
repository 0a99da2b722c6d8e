#include "toile/inspect/diff.h"

#include "shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace toile::inspect {
namespace {

mesh::GarmentMesh sample() {
  auto g = shapes::tube(0.2, 0.4, 24, 10, 1);
  g.fasteners.push_back({0, 5, mesh::Fastener::Kind::button, 0.001, 0.002});
  g.closures.push_back({0, "cuff", "button"});
  g.fasteners.back().closure = 0;
  g.folds.push_back({0, "crease", "crease", 1.5, 0.001, {0}, 2.0});
  g.hinges.push_back({g.faces(0, 0), g.faces(0, 1), g.faces(0, 2), g.faces(5, 0), 0.3, 2.0, 0});
  g.trims.push_back({0, "waist", "elastic", -1, 20, 1e-6, 0.004, 0.8, true, 0.01, 0});
  g.trim_segments.push_back({0, 1, 0, 0.008});
  g.trim_segments.push_back({1, 2, 0, 0.008});
  g.free_layers.push_back({0, "pocket", {0}, {}, true});
  g.marks["converged"] = "yes";
  g.marks["residual"] = "0.00071";
  g.vertex_columns["vx"] = {false, std::vector<double>(static_cast<std::size_t>(g.vertex_count()), 0.25), {}};
  g.face_columns["tag"] = {true, {}, std::vector<int>(static_cast<std::size_t>(g.face_count()), 3)};
  g.route.push_back({"toile-mesh", 1, "{cell: 0.01}", {{"pattern", "00"}}});
  return g;
}

DiffReport compare(const mesh::GarmentMesh& a, const mesh::GarmentMesh& b, DiffMode mode = DiffMode::indexed) {
  DiffParams params;
  params.mode = mode;
  return diff(params, a, b);
}

TEST(Diff, a_garment_is_the_same_as_itself_in_every_mode) {
  const auto g = sample();
  for (const DiffMode mode : {DiffMode::exact, DiffMode::indexed, DiffMode::geometric}) {
    const DiffReport report = compare(g, g, mode);
    EXPECT_TRUE(report.same()) << to_text(report);
  }
}

struct Mutation {
  const char* name;
  std::function<void(mesh::GarmentMesh&)> apply;
};

TEST(Diff, every_kind_of_mutation_is_found) {
  using G = mesh::GarmentMesh;
  const Mutation mutations[] = {
      {"a vertex moves by 2 um", [](G& g) { g.x(17, 1) += 2e-6; }},
      {"a panel coordinate moves by 2 nm", [](G& g) { g.uv(17, 0) += 2e-9; }},
      {"a vertex changes its panel", [](G& g) { g.vertex_panel[3] = 1; }},
      {"a face is turned over", [](G& g) { std::swap(g.faces(7, 0), g.faces(7, 1)); }},
      {"a face is turned round", [](G& g) { g.faces.row(7) << g.faces(7, 1), g.faces(7, 2), g.faces(7, 0); }},
      {"two faces change places", [](G& g) { g.faces.row(7).swap(g.faces.row(8)); }},
      {"a face is missing", [](G& g) { g.faces.conservativeResize(g.faces.rows() - 1, 3); g.face_panel.conservativeResize(g.faces.rows()); g.face_laminate.conservativeResize(g.faces.rows()); g.face_columns.clear(); }},
      {"a face loses its laminate", [](G& g) { g.face_laminate[9] = -1; }},
      {"a weld is missing", [](G& g) { g.welds.pop_back(); }},
      {"a weld joins another vertex", [](G& g) { g.welds[2].b += 1; }},
      {"a weld changes sides", [](G& g) { std::swap(g.welds[2].a, g.welds[2].b); }},
      {"a fastener is missing", [](G& g) { g.fasteners.clear(); }},
      {"a fastener is heavier by a milligram", [](G& g) { g.fasteners[0].mass += 1e-6; }},
      {"a fastener is another kind", [](G& g) { g.fasteners[0].kind = mesh::Fastener::Kind::snap; }},
      {"a fastener is open", [](G& g) { g.fasteners[0].closed = false; }},
      {"a fastener gives way", [](G& g) { g.fasteners[0].stiffness = 100; }},
      {"a fastener catches later", [](G& g) { g.fasteners[0].capture = 0.01; }},
      {"a fastener belongs to nothing", [](G& g) { g.fasteners[0].closure = -1; }},
      {"a closure is renamed", [](G& g) { g.closures[0].name = "cuf"; }},
      {"a hinge is missing", [](G& g) { g.hinges.clear(); }},
      {"a hinge is turned", [](G& g) { std::swap(g.hinges[0].v0, g.hinges[0].v1); }},
      {"a hinge is flatter", [](G& g) { g.hinges[0].rest_angle -= 1e-6; }},
      {"a hinge is softer", [](G& g) { g.hinges[0].factor -= 1e-6; }},
      {"a hinge belongs to no fold", [](G& g) { g.hinges[0].fold = -1; }},
      {"a fold is sharper", [](G& g) { g.folds[0].radius = 0; }},
      {"a fold runs along no line", [](G& g) { g.folds[0].runs.clear(); }},
      {"a fold is softer", [](G& g) { g.folds[0].factor = 1; }},
      {"a trim is wider", [](G& g) { g.trims[0].width += 1e-6; }},
      {"a trim has more plies", [](G& g) { g.trims[0].plies = 1; }},
      {"a trim segment is missing", [](G& g) { g.trim_segments.pop_back(); }},
      {"a trim segment ends elsewhere", [](G& g) { g.trim_segments[1].b = 3; }},
      {"a trim segment is longer", [](G& g) { g.trim_segments[1].rest_length += 1e-6; }},
      {"a trim is stiffer", [](G& g) { g.trims[0].stretch *= 1.001; }},
      {"a free layer changes sides", [](G& g) { g.free_layers[0].outside = false; }},
      {"a panel lies farther out", [](G& g) { g.panels[0].order = 1; }},
      {"a run ends one vertex earlier", [](G& g) { g.run_vertices.pop_back(); }},
      {"a run's abscissa moves", [](G& g) { g.run_vertices[4].s += 1e-6; }},
      {"a run is renamed", [](G& g) { g.runs[1].name = "rigth"; }},
      {"a point sits elsewhere", [](G& g) { g.points[0].vertex = 4; }},
      {"a panel is renamed", [](G& g) { g.panels[0].name = "tub"; }},
      {"a panel is mirrored", [](G& g) { g.panels[0].mirrored = true; }},
      {"a panel's area changes", [](G& g) { g.panels[0].cut_area *= 1.0001; }},
      {"a seam's length changes", [](G& g) { g.seams[0].length_a += 1e-6; }},
      {"a seam is taped", [](G& g) { g.seams[0].kind = "taped"; }},
      {"the cloth is heavier", [](G& g) { g.laminates[0].equivalent.areal_density *= 1.001; }},
      {"the cloth is stiffer", [](G& g) { g.laminates[0].equivalent.warp.bending *= 1.001; }},
      {"the cloth has another name", [](G& g) { g.fabrics[0].name = "silk"; }},
      {"a ply is added", [](G& g) { g.laminates[0].plies.push_back({"canvas", "", 0.1}); }},
      {"it did not converge", [](G& g) { g.marks["converged"] = "no"; }},
      {"a mark is missing", [](G& g) { g.marks.erase("residual"); }},
      {"a further column changes", [](G& g) { g.vertex_columns["vx"].reals[11] += 1e-3; }},
      {"a further column of integers changes", [](G& g) { g.face_columns["tag"].integers[11] = 4; }},
      {"a column is missing", [](G& g) { g.vertex_columns.clear(); }},
      {"a column is added", [](G& g) { g.face_columns["more"] = g.face_columns["tag"]; }},
      {"a column changes its type", [](G& g) { auto& c = g.face_columns["tag"]; c.integer = false; c.reals.assign(c.integers.begin(), c.integers.end()); c.integers.clear(); }},
  };
  for (const Mutation& mutation : mutations) {
    for (const DiffMode mode : {DiffMode::exact, DiffMode::indexed}) {
      auto g = sample();
      if (std::string(mutation.name) == "a vertex changes its panel") g.panels.push_back({1, "other", "other"});
      auto changed = g;
      mutation.apply(changed);
      EXPECT_FALSE(compare(g, changed, mode).same()) << mutation.name;
      EXPECT_FALSE(compare(changed, g, mode).same()) << mutation.name << ", the other way round";
    }
  }
}

TEST(Diff, rounding_is_no_difference_but_is_told) {
  const auto g = sample();
  auto rounded = g;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) rounded.x(v, 0) += (v % 2 ? 1 : -1) * 1e-7;
  rounded.x(33, 2) += 3e-7;
  rounded.marks["residual"] = "0.00071000000001";
  const DiffReport report = compare(g, rounded);
  EXPECT_TRUE(report.same()) << to_text(report);
  const auto z = std::find_if(report.columns.begin(), report.columns.end(), [](const ColumnChange& c) { return c.column == "vertex.z"; });
  ASSERT_NE(z, report.columns.end());
  EXPECT_NEAR(z->largest, 3e-7, 1e-12);
  EXPECT_EQ(z->row, 33u);
  EXPECT_FALSE(compare(g, rounded, DiffMode::exact).same());
  auto ulp = g;
  ulp.x(5, 1) = std::nextafter(ulp.x(5, 1), 10.0);
  EXPECT_TRUE(compare(g, ulp).same());
  EXPECT_FALSE(compare(g, ulp, DiffMode::exact).same());
}

TEST(Diff, small_changes_that_add_up_are_found_by_the_figures) {
  // Each coordinate stays within a generous tolerance, the whole has grown.
  const auto g = sample();
  auto grown = g;
  grown.x *= 1.002;
  DiffParams params;
  params.tolerances = {{"vertex.x", 0.01}, {"vertex.y", 0.01}, {"vertex.z", 0.01}};
  const DiffReport report = diff(params, g, grown);
  EXPECT_FALSE(report.same());
  for (const Difference& d : report.differences) EXPECT_EQ(d.layer, DiffLayer::meaning) << d.item;
}

TEST(Diff, tolerances_and_ignored_columns_are_the_users_to_set) {
  const auto g = sample();
  auto other = g;
  other.x(2, 0) += 5e-6;
  other.vertex_columns["vx"].reals[1] = 9;
  DiffParams params;
  EXPECT_EQ(diff(params, g, other).differences.size(), 2u);
  params.tolerances["vertex.x"] = 1e-5;
  params.ignore = {"vertex.vx"};
  EXPECT_TRUE(diff(params, g, other).same());
}

TEST(Diff, the_route_counts_in_exact_mode_only) {
  const auto g = sample();
  auto other = g;
  other.route[0].version = 2;
  EXPECT_TRUE(compare(g, other).same());
  EXPECT_FALSE(compare(g, other, DiffMode::exact).same());
}

/// The same garment with its vertices and faces in another order.
mesh::GarmentMesh shuffled(const mesh::GarmentMesh& g, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int> to(static_cast<std::size_t>(g.vertex_count()));
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), random);
  mesh::GarmentMesh h = g;
  h.vertex_columns.clear();
  h.face_columns.clear();
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const int t = to[static_cast<std::size_t>(v)];
    h.x.row(t) = g.x.row(v);
    h.uv.row(t) = g.uv.row(v);
    h.vertex_panel[t] = g.vertex_panel[v];
  }
  std::vector<int> order(static_cast<std::size_t>(g.face_count()));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  for (std::size_t f = 0; f < order.size(); ++f) {
    for (int k = 0; k < 3; ++k) h.faces(static_cast<Eigen::Index>(f), k) = to[static_cast<std::size_t>(g.faces(order[f], k))];
  }
  for (auto& w : h.welds) w.a = to[static_cast<std::size_t>(w.a)], w.b = to[static_cast<std::size_t>(w.b)];
  for (auto& r : h.run_vertices) r.vertex = to[static_cast<std::size_t>(r.vertex)];
  for (auto& p : h.points) p.vertex = to[static_cast<std::size_t>(p.vertex)];
  for (auto& f : h.fasteners) f.a = to[static_cast<std::size_t>(f.a)], f.b = to[static_cast<std::size_t>(f.b)];
  return h;
}

TEST(Diff, geometric_mode_does_not_see_the_numbering) {
  const auto g = sample();
  const auto h = shuffled(g, 5);
  ASSERT_TRUE(mesh::validate(h).empty());
  EXPECT_FALSE(compare(g, h).same());
  const DiffReport report = compare(g, h, DiffMode::geometric);
  EXPECT_TRUE(report.same()) << to_text(report);
}

TEST(Diff, geometric_mode_sees_shape_seams_and_openings) {
  const auto g = sample();
  auto moved = g;
  moved.x(100, 0) += 0.004;
  EXPECT_FALSE(compare(g, moved, DiffMode::geometric).same());
  auto unsewn = g;
  unsewn.welds.clear();
  EXPECT_FALSE(compare(g, unsewn, DiffMode::geometric).same());
  auto renamed = g;
  renamed.panels[0].name = "sleeve";
  EXPECT_FALSE(compare(g, renamed, DiffMode::geometric).same());
  auto cut = g;
  cut.panels[0].cut_area *= 1.01;
  EXPECT_FALSE(compare(g, cut, DiffMode::geometric).same());
}

TEST(Diff, surface_distance_is_that_of_parallel_sheets_whatever_their_grids) {
  mesh::GarmentMesh a, b;
  shapes::add_panel(a, "a", 1, 1, 7, 9);
  shapes::add_panel(b, "b", 1, 1, 13, 4, {0, 0, 0.02});
  EXPECT_NEAR(surface_distance(a.x, a.faces, b.x, b.faces), 0.02, 1e-12);
  b.x.col(0) *= 1.5;  // now its far border is half a metre away sideways
  EXPECT_NEAR(surface_distance(a.x, a.faces, b.x, b.faces), std::hypot(0.5, 0.02), 1e-12);
}

TEST(Diff, of_supports) {
  auto a = shapes::sphere({0, 1, 0}, 0.3, 3);
  a.landmarks["top"] = {0, 1.3, 0};
  a.girths["middle"] = 1.88;
  DiffParams params;
  EXPECT_TRUE(diff(params, a, a).same());
  const std::function<void(mesh::SupportMesh&)> mutations[] = {
      [](auto& s) { s.x(4, 0) += 1e-5; },
      [](auto& s) { s.faces.row(3).swap(s.faces.row(4)); },
      [](auto& s) { s.region_names = {"torso"}; s.face_region.setZero(); },
      [](auto& s) { s.landmarks["top"][1] += 1e-5; },
      [](auto& s) { s.landmarks.erase("top"); },
      [](auto& s) { s.landmarks["new"] = {0, 0, 0}; },
      [](auto& s) { s.girths["middle"] += 1e-4; },
  };
  for (const auto& mutate : mutations) {
    auto b = a;
    mutate(b);
    EXPECT_FALSE(diff(params, a, b).same());
  }
  params.mode = DiffMode::geometric;
  auto finer = shapes::sphere({0, 1, 0}, 0.3, 5);
  finer.landmarks = a.landmarks;
  finer.girths = a.girths;
  params.distance_band = 0.005;
  params.area_band = 0.05;
  EXPECT_TRUE(diff(params, a, finer).same());
  params.distance_band = 1e-4;
  EXPECT_FALSE(diff(params, a, finer).same());
}

TEST(Diff, of_json) {
  const std::string a = R"({"name": "tee", "mass": 0.085, "noise": 1e-17, "list": [1, 2, {"x": null}]})";
  const auto differences = [&](const std::string& b, DiffMode mode = DiffMode::indexed) {
    DiffParams params;
    params.mode = mode;
    return diff_json(params, a, b)->differences.size();
  };
  EXPECT_EQ(differences(a), 0u);
  EXPECT_EQ(differences(R"({"mass": 0.08500000001, "name": "tee", "noise": 0, "list": [1, 2, {"x": null}]})"), 0u);
  EXPECT_EQ(differences(R"({"mass": 0.08500000001, "name": "tee", "noise": 1e-17, "list": [1, 2, {"x": null}]})", DiffMode::exact), 1u);
  EXPECT_EQ(differences(R"({"name": "tee", "mass": 0.0851, "noise": 1e-17, "list": [1, 2, {"x": null}]})"), 1u);
  EXPECT_EQ(differences(R"({"name": "tea", "mass": 0.085, "noise": 1e-17, "list": [1, 2, {"x": 0}]})"), 2u);
  EXPECT_EQ(differences(R"({"name": "tee", "mass": 0.085, "noise": 1e-17, "list": [1, 2]})"), 1u);
  EXPECT_EQ(differences(R"({"name": "tee", "mass": "0.085", "list": [1, 2, {"x": null}], "more": 1})"), 3u);
  EXPECT_EQ(diff_json({}, a, "{").issues().at(0).code, "bad_json");
}

TEST(Diff, of_pictures) {
  Image a(50, 40);
  for (std::size_t i = 0; i < a.rgb.size(); ++i) a.rgb[i] = static_cast<std::uint8_t>(i % 251);
  const auto same = [&](const Image& b, DiffMode mode = DiffMode::indexed) {
    DiffParams params;
    params.mode = mode;
    return diff(params, a, b).same();
  };
  EXPECT_TRUE(same(a));
  auto speck = a;
  speck.pixel(7, 9)[1] ^= 0x40;
  EXPECT_TRUE(same(speck));
  EXPECT_FALSE(same(speck, DiffMode::exact));
  auto line = a;
  for (int x = 0; x < 50; ++x) line.pixel(x, 20)[0] = static_cast<std::uint8_t>(line.pixel(x, 20)[0] ^ 0x80);
  EXPECT_FALSE(same(line));
  auto darker = a;
  for (auto& v : darker.rgb) v = static_cast<std::uint8_t>(v > 1 ? v - 2 : v);
  EXPECT_FALSE(same(darker));
  EXPECT_FALSE(same(Image(40, 50)));
}

}  // namespace
}  // namespace toile::inspect
