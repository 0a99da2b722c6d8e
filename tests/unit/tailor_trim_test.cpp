#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "garments.h"
#include "toile/tailor/layer.h"
#include "toile/tailor/sew.h"
#include "toile/tailor/trim.h"

using namespace toile;

namespace {

/// Two panels, 40 x 30 mm each, sewn along their long sides; the second with a finer grid.
mesh::GarmentMesh pair() {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "a", 4, 3, 0.01);
  test::add_rectangle(g, "b", 4, 5, 0.006, 0.05);
  for (auto& run : g.runs) run.allowance = run.panel == 0 ? 0.010 : 0.015;
  tailor::SewParams params;
  params.seams.resize(1);
  params.seams[0].name = "side";
  params.seams[0].a = {"a.right"};
  params.seams[0].b = {"-b.left"};
  params.seams[0].bending_factor = 3;
  const auto sewn = tailor::sew(g, params);
  EXPECT_TRUE(sewn);
  return sewn->garment;
}

tailor::SeamSpec finish() {
  tailor::SeamSpec seam;
  seam.name = "side";
  seam.a = {"a.right"};
  seam.b = {"-b.left"};
  return seam;
}

tailor::Trimmed finished(const mesh::GarmentMesh& g, const std::vector<tailor::SeamSpec>& seams) {
  auto result = tailor::finish_seams(g, seams);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

template <class Value>
std::string first_code(const Result<Value>& result) {
  return result ? "none" : result.issues().front().code;
}

fabric::Card card(const std::string& name, double density, double warp, double weft, double twist) {
  fabric::Card c = test::sample_card();
  c.name = name;
  c.areal_density = density;
  c.warp.bending = warp;
  c.weft.bending = weft;
  c.twist_ratio = twist;
  return c;
}

}  // namespace

TEST(trim, a_plain_seam_gets_nothing) {
  const auto g = pair();
  const auto result = finished(g, {finish()});
  EXPECT_TRUE(result.trims.empty());
  EXPECT_TRUE(result.garment.trims.empty());
  EXPECT_TRUE(result.garment.hinges.empty());
}

TEST(trim, a_taped_seam_with_thread_and_elastic) {
  auto seam = finish();
  seam.kind = "taped";
  seam.tape = tailor::SeamTape{.width = 0.008, .bending = 2e-4, .stretch = 900, .mass = 0.003, .ratio = 1};
  seam.thread = tailor::SeamThread{.ratio = 0.98, .stretch = 400, .mass = 1e-4};
  seam.elastic = tailor::SeamThread{.ratio = 0.7, .stretch = 20, .mass = 2e-3};
  seam.angle = 0.4;
  const auto result = finished(pair(), {seam});
  const auto& g = result.garment;
  ASSERT_EQ(g.trims.size(), 3u);
  EXPECT_EQ(g.trims[0].name, "side tape");
  EXPECT_NEAR(g.trims[0].bending, 1.6e-6, 1e-18) << "rigidity per width times width";
  EXPECT_FALSE(g.trims[0].slack);
  EXPECT_EQ(g.trims[1].kind, "thread");
  EXPECT_TRUE(g.trims[1].slack);
  EXPECT_EQ(g.trims[2].kind, "elastic");
  std::array<double, 3> rest{}, mass{};
  for (const auto& segment : g.trim_segments) {
    rest[static_cast<std::size_t>(segment.trim)] += segment.rest_length;
    mass[static_cast<std::size_t>(segment.trim)] += segment.mass(g.trims[static_cast<std::size_t>(segment.trim)]);
  }
  const std::array expected_rest{0.03, 0.0294, 0.021}, density{0.003, 1e-4, 2e-3};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(rest[k], expected_rest[k], 1e-15);
    EXPECT_NEAR(mass[k], density[k] * 0.03, 1e-15) << "drawing in does not change what it weighs";
    EXPECT_EQ(g.trims[k].seam, 0);
    EXPECT_NEAR(result.trims[k].length, 0.03, 1e-15);
  }
  EXPECT_NEAR(mesh::trimmings_mass(g), mass[0] + mass[1] + mass[2], 1e-15);
  ASSERT_EQ(g.hinges.size(), 5u);
  for (const auto& hinge : g.hinges) {
    EXPECT_EQ(hinge.rest_angle, 0.4);
    EXPECT_EQ(hinge.factor, 3) << "as stiff as the seam is said to be";
  }
}

TEST(trim, allowances_weigh_what_their_cloth_weighs) {
  struct Row {
    tailor::Allowance allowance;
    std::optional<double> width;
    double strip_a, strip_b;  ///< width times plies [m]
  };
  const Row rows[] = {
      {tailor::Allowance::open, {}, 0.010, 0.015},        {tailor::Allowance::to_a, {}, 0.010, 0.015},  {tailor::Allowance::to_b, 0.012, 0.012, 0.012},
      {tailor::Allowance::felled, {}, 2 * 0.005, 0.0075}, {tailor::Allowance::felled, 0.006, 0.012, 0.006},
  };
  const auto a = card("wool", 0.25, 2e-5, 1e-5, 0.3), b = card("silk", 0.08, 4e-6, 3e-6, 0.3);
  for (const Row& row : rows) {
    auto seam = finish();
    seam.allowance = row.allowance;
    seam.allowance_width = row.width;
    tailor::LayerParams layers;
    layers.base = "wool";
    layers.panels = {{"b", "silk"}};
    const auto layered = tailor::layer(finished(pair(), {seam}).garment, {a, b}, layers);
    ASSERT_TRUE(layered);
    const auto g = tailor::resolve_allowances(layered->garment);
    ASSERT_EQ(g.trims.size(), 2u);
    EXPECT_EQ(g.trims[0].name, "side allowance a.right");
    EXPECT_EQ(g.trims[1].name, "side allowance b.left");
    EXPECT_NEAR(g.trims[0].linear_density, row.strip_a * 0.25, 1e-15);
    EXPECT_NEAR(g.trims[1].linear_density, row.strip_b * 0.08, 1e-15);
    EXPECT_NEAR(g.trims[0].bending, row.strip_a * 2e-5, 1e-18) << "the seam runs along the warp";
    EXPECT_NEAR(g.trims[1].bending, row.strip_b * 4e-6, 1e-18);
    EXPECT_NEAR(mesh::trimmings_mass(g), 0.03 * (row.strip_a * 0.25 + row.strip_b * 0.08), 1e-15);
    // Again with the same cloth: nothing changes.
    const auto again = tailor::resolve_allowances(g);
    EXPECT_EQ(again.trims[0].linear_density, g.trims[0].linear_density);
    EXPECT_EQ(again.trims[0].bending, g.trims[0].bending);
  }
}

TEST(trim, the_cloth_of_an_allowance_bends_along_the_seam) {
  // A seam on the bias of a sheared panel: B45 = (B_warp + B_weft + 4 D66) / 4.
  mesh::GarmentMesh g;
  test::add_rectangle(g, "a", 3, 3, 0.01);
  const double c = std::sqrt(0.5);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const Eigen::Vector2d p = g.uv.row(v);
    g.uv.row(v) << c * (p.x() + p.y()), c * (p.y() - p.x());
  }
  g.seams = {{.id = 0, .name = "hem"}};
  g.trims = {{.id = 0, .name = "hem allowance", .kind = "allowance", .seam = 0, .width = 0.02, .plies = 2}};
  g.trim_segments = {{0, 1, 0, 0.01}, {1, 2, 0, 0.01}};
  tailor::LayerParams layers;
  layers.base = "wool";
  const auto layered = tailor::layer(g, {card("wool", 0.25, 2e-5, 1e-5, 0.4)}, layers);
  ASSERT_TRUE(layered);
  const auto result = tailor::resolve_allowances(layered->garment);
  EXPECT_NEAR(result.trims[0].bending, 0.04 * (3e-5 + 4 * 0.4 * std::sqrt(2e-10)) / 4, 1e-16);
  // Without cloth, or of other kinds, trims stay as they are.
  EXPECT_EQ(tailor::resolve_allowances(g).trims[0].linear_density, 0);
  auto tape = layered->garment;
  tape.trims[0].kind = "tape";
  tape.trims[0].linear_density = 0.5;
  EXPECT_EQ(tailor::resolve_allowances(tape).trims[0].linear_density, 0.5);
}

TEST(trim, a_fusible_does_not_reach_into_the_allowance) {
  auto seam = finish();
  seam.allowance = tailor::Allowance::open;
  auto g = finished(pair(), {seam}).garment;
  const auto wool = card("wool", 0.25, 2e-5, 1e-5, 0.3), canvas = card("canvas", 0.1, 9e-5, 9e-5, 0.3);
  g.fabrics = {canvas, wool};
  g.laminates = {{.id = 0, .name = "fused", .plies = {{"canvas", "over", 0.1}, {"wool", "", 0.25}}, .equivalent = wool}};
  g.face_laminate.setZero();
  const auto result = tailor::resolve_allowances(g);
  EXPECT_NEAR(result.trims[0].linear_density, 0.010 * 0.25, 1e-15);
  EXPECT_NEAR(result.trims[0].bending, 0.010 * 2e-5, 1e-18);
}

TEST(trim, a_dart_keeps_the_cloth_between_its_legs) {
  // A V cut into the top of a panel, 20 mm wide and 40 mm deep: 400 mm2 of cloth, folded in the middle.
  mesh::GarmentMesh g;
  test::add_rectangle(g, "p", 8, 6, 0.01);
  // Only the legs matter here; they are given as inner lines.
  const int middle = 2 * 9 + 4;
  const std::array<std::vector<int>, 2> legs{std::vector{6 * 9 + 5, 4 * 9 + 5, middle}, std::vector{6 * 9 + 3, 4 * 9 + 3, middle}};
  for (std::size_t k = 0; k < 2; ++k) {
    const int run = static_cast<int>(g.runs.size());
    g.runs.push_back({.id = run, .panel = 0, .name = k == 0 ? "leg_a" : "leg_b", .length = std::hypot(0.01, 0.04), .internal = true});
    for (int v : legs[k]) g.run_vertices.push_back({run, v, std::hypot(0.01, 0.04) * (6 - g.uv(v, 1) * 100) / 4});
  }
  g.uv.row(4 * 9 + 5) << 0.045, 0.04;
  g.uv.row(4 * 9 + 3) << 0.035, 0.04;
  g.seams = {{.id = 0, .name = "dart"}};
  tailor::SeamSpec seam;
  seam.name = seam.kind = "dart";
  seam.a = {"p.leg_a"};
  seam.b = {"p.leg_b"};
  seam.allowance = tailor::Allowance::to_a;
  const auto result = finished(g, {seam}).garment;
  ASSERT_EQ(result.trims.size(), 2u);
  double area = 0;
  for (const auto& segment : result.trim_segments) {
    const auto& trim = result.trims[static_cast<std::size_t>(segment.trim)];
    area += trim.width * trim.plies * segment.rest_length;
  }
  EXPECT_NEAR(area, 0.0004, 1e-12);
}

TEST(trim, an_elastic_follows_a_chain_across_seams) {
  const auto g = pair();
  tailor::TrimSpec waist;
  waist.name = "waist";
  waist.kind = tailor::TrimKind::elastic;
  waist.along = {"-a.top", "-b.top"};
  waist.ratio = 0.8;
  waist.stretch = 15;
  waist.mass = 0.004;
  tailor::TrimSpec cord = waist;
  cord.name = "cord";
  cord.kind = tailor::TrimKind::drawstring;
  cord.along = {"b.bottom"};
  tailor::TrimSpec tape = waist;
  tape.name = "tape";
  tape.kind = tailor::TrimKind::tape;
  tape.along = {"b.right"};
  const auto result = tailor::add_trims(g, {waist, cord, tape});
  ASSERT_TRUE(result) << to_string(result.issues().front());
  EXPECT_TRUE(mesh::validate(result->garment).empty());
  ASSERT_EQ(result->garment.trims.size(), 3u);
  EXPECT_EQ(result->garment.trims[0].name, "cord");
  EXPECT_EQ(result->garment.trims[2].name, "waist");
  EXPECT_TRUE(result->garment.trims[0].slack && result->garment.trims[2].slack);
  EXPECT_FALSE(result->garment.trims[1].slack);
  double length = 0, rest = 0;
  const mesh::Ids particle = mesh::particles(g);
  int last = -1;
  for (const auto& segment : result->garment.trim_segments) {
    if (segment.trim != 2) continue;
    if (last >= 0) {
      EXPECT_EQ(particle[segment.a], last);
    }
    last = particle[segment.b];
    rest += segment.rest_length;
    length += (g.uv.row(segment.a) - g.uv.row(segment.b)).norm();
  }
  EXPECT_NEAR(length, 0.04 + 0.024, 1e-15);
  EXPECT_NEAR(rest, 0.8 * length, 1e-15);
  EXPECT_NEAR(result->trims[2].length, length, 1e-15);
}

TEST(trim, what_cannot_be_done) {
  const auto g = pair();
  auto seam = finish();
  seam.kind = "taped";
  EXPECT_EQ(first_code(tailor::finish_seams(g, {seam})), "untaped");
  seam = finish();
  seam.name = "other";
  seam.angle = 1;
  EXPECT_EQ(first_code(tailor::finish_seams(g, {seam})), "unknown_seam");
  auto bare = g;
  for (auto& run : bare.runs) run.allowance = 0;
  seam = finish();
  seam.kind = "felled";
  const auto felled = tailor::finish_seams(bare, {seam});
  EXPECT_EQ(first_code(felled), "no_allowance");
  EXPECT_EQ(felled.issues().size(), 2u) << "both edges are named";
  EXPECT_EQ(first_code(tailor::finish_seams(g, {seam})), "none");
  seam = finish();
  seam.angle = 1;
  seam.a = {"a.left"};
  EXPECT_EQ(first_code(tailor::finish_seams(g, {seam})), "angle_without_border");

  tailor::TrimSpec trim;
  trim.name = "t";
  EXPECT_EQ(first_code(tailor::add_trims(g, {trim})), "no_line");
  trim.along = {"a.top", "b.top"};
  EXPECT_EQ(first_code(tailor::add_trims(g, {trim})), "broken_chain");
  trim.along = {"a.tap"};
  EXPECT_EQ(first_code(tailor::add_trims(g, {trim})), "unknown_line");
  trim.along = {"a.top"};
  EXPECT_EQ(first_code(tailor::add_trims(g, {trim, trim})), "duplicate_name");
}
