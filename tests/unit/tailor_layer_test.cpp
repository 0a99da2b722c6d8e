#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "garments.h"
#include "toile/fabric/laminate.h"
#include "toile/tailor/layer.h"

using namespace toile;

namespace {

fabric::Card card(const std::string& name, double density, double bending) {
  fabric::Card result = test::sample_card();
  result.name = name;
  result.areal_density = density;
  result.warp.bending = bending;
  result.weft.bending = bending;
  return result;
}

mesh::GarmentMesh two_bare_panels() {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "front", 6, 4, 0.01);
  test::add_rectangle(g, "back", 6, 4, 0.01, 0.1);
  return g;
}

tailor::Layered layered(const mesh::GarmentMesh& g, const std::vector<fabric::Card>& cards, const tailor::LayerParams& params) {
  auto result = tailor::layer(g, cards, params);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

std::vector<std::string> codes(const Result<tailor::Layered>& result) {
  std::vector<std::string> list;
  for (const Issue& issue : result.issues()) list.push_back(issue.code);
  return list;
}

}  // namespace

TEST(bonded, additive_quantities_add) {
  fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.08, 3e-5);
  a.shear = 30, b.shear = 45;
  a.thickness = 5e-4, b.thickness = 3e-4;
  a.twist_ratio = 0.3, b.twist_ratio = 0.5;
  a.friction = 0.2, b.friction = 0.4;
  const auto both = fabric::bonded(std::vector{a, b}, "a+b");
  ASSERT_TRUE(both);
  EXPECT_DOUBLE_EQ(both->areal_density, 0.28);
  EXPECT_DOUBLE_EQ(both->thickness, 8e-4);
  EXPECT_DOUBLE_EQ(both->shear, 75);
  EXPECT_DOUBLE_EQ(both->warp.bending, 4e-5);
  EXPECT_DOUBLE_EQ(both->twist_ratio * 4e-5, 0.3 * 1e-5 + 0.5 * 3e-5);
  EXPECT_EQ(both->friction, 0.2);
  EXPECT_EQ(both->name, "a+b");
  EXPECT_TRUE(validate(*both).empty());
}

TEST(bonded, one_sheet_is_itself_and_two_equal_straight_ones_are_twice_as_stiff) {
  fabric::Card a = card("a", 0.2, 1e-5);
  const auto alone = fabric::bonded(std::vector{a}, "a");
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->warp.strain_max, a.warp.strain_max);
  a.warp.linearity = a.weft.linearity = 1;
  const auto twice = fabric::bonded(std::vector{a, a}, "aa");
  ASSERT_TRUE(twice);
  EXPECT_NEAR(twice->warp.strain_max, a.warp.strain_max / 2, 1e-12);
  EXPECT_NEAR(twice->warp.linearity, 1, 1e-9);
}

TEST(bonded, force_and_work_at_the_greatest_force_are_exact) {
  // Curved sheets, integrated numerically: F = Fm (e^(x e/em) - 1) / (e^x - 1).
  fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.1, 1e-5);
  a.warp = {.strain_max = 0.05, .linearity = 0.6, .resilience = 0.6, .bending = 1e-5, .bending_hysteresis = 0};
  b.warp = {.strain_max = 0.08, .linearity = 0.725, .resilience = 0.4, .bending = 1e-5, .bending_hysteresis = 0};
  const auto both = fabric::bonded(std::vector{a, b}, "ab");
  ASSERT_TRUE(both);
  const auto shape = [](double linearity) {
    double low = 1e-6, high = 50;
    for (int k = 0; k < 200; ++k) {
      const double x = 0.5 * (low + high);
      (2 * (1 / x - 1 / std::expm1(x)) > linearity ? low : high) = x;
    }
    return low;
  };
  EXPECT_NEAR(shape(0.725), 1.731, 0.002);  // published row of the fit
  const double xa = shape(0.6), xb = shape(0.725), e = both->warp.strain_max, force_max = a.tensile_force_max;
  const auto force = [&](double strain) { return force_max * (std::expm1(xa * strain / 0.05) / std::expm1(xa) + std::expm1(xb * strain / 0.08) / std::expm1(xb)); };
  EXPECT_NEAR(force(e), force_max, 1e-6 * force_max);
  double work = 0;
  constexpr int steps = 20000;
  for (int k = 0; k < steps; ++k) work += force((k + 0.5) / steps * e) * e / steps;
  EXPECT_NEAR(both->warp.linearity, 2 * work / (force_max * e), 1e-6);
  EXPECT_GT(both->warp.resilience, 0.4);
  EXPECT_LT(both->warp.resilience, 0.6);
}

TEST(bonded, order_changes_only_what_the_outermost_decides) {
  const fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.08, 3e-5);
  const auto ab = fabric::bonded(std::vector{a, b}, "x"), ba = fabric::bonded(std::vector{b, a}, "x");
  ASSERT_TRUE(ab && ba);
  EXPECT_DOUBLE_EQ(ab->areal_density, ba->areal_density);
  EXPECT_NEAR(ab->warp.strain_max, ba->warp.strain_max, 1e-12);
  EXPECT_NEAR(ab->warp.linearity, ba->warp.linearity, 1e-9);
  EXPECT_FALSE(fabric::bonded(std::vector<fabric::Card>{}, "x"));
}

TEST(layer, mass_is_area_times_density) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {{"stay", "canvas", {"front"}, tailor::LayerSide::under, {}}};
  params.fasteners = {{"b1", tailor::FastenerKind::button, {.point = "front.top_left"}, {.panel = "back", .at = {{0.0301, 0.0199}}}, 0.002, 0.004}};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5), card("unused", 1, 1e-5)}, params);
  const double area = 0.06 * 0.04;
  EXPECT_NEAR(result.mass, 2 * area * 0.2 + area * 0.08 + 0.002, 1e-12);
  EXPECT_NEAR(mesh::vertex_masses(result.garment).sum(), result.mass, 1e-12);
  ASSERT_EQ(result.materials.size(), 2u);
  EXPECT_EQ(result.materials[0].fabric, "canvas");
  EXPECT_NEAR(result.materials[0].area, area, 1e-12);
  EXPECT_NEAR(result.materials[1].area, 2 * area, 1e-12);
  ASSERT_EQ(result.garment.laminates.size(), 2u);
  EXPECT_EQ(result.garment.laminates[0].name, "wool+canvas");
  EXPECT_EQ(result.garment.laminates[0].plies[0].fabric, "wool");
  EXPECT_EQ(result.garment.fabrics.size(), 2u);
  ASSERT_EQ(result.garment.fasteners.size(), 1u);
  EXPECT_NEAR(result.garment.uv(result.garment.fasteners[0].b, 0), 0.03, 1e-12);
  EXPECT_NEAR(result.garment.uv(result.garment.fasteners[0].b, 1), 0.02, 1e-12);
}

TEST(layer, region_is_cut_to_the_grid_by_face_middles) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {{"patch", "canvas", {"front"}, tailor::LayerSide::over, {{{0.01, 0.01}, {0.03, 0.01}, {0.03, 0.03}, {0.01, 0.03}}}}};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params);
  double covered = 0;
  const Eigen::VectorXd areas = mesh::rest_areas(result.garment);
  for (Eigen::Index f = 0; f < areas.size(); ++f) {
    if (result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[f])].plies.size() == 2) covered += areas[f];
  }
  EXPECT_NEAR(covered, 0.02 * 0.02, 1e-15);
  EXPECT_EQ(result.garment.laminates[1].plies[0].fabric, "canvas");
}

TEST(layer, region_is_mirrored_with_the_panel) {
  auto g = two_bare_panels();
  g.panels[1].mirrored = true;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 1) g.uv(v, 0) = -g.uv(v, 0);
  }
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    if (g.face_panel[f] == 1) std::swap(g.faces(f, 1), g.faces(f, 2));
  }
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {{"patch", "canvas", {"*"}, tailor::LayerSide::under, {{{0, 0}, {0.02, 0}, {0.02, 0.04}, {0, 0.04}}}}};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params);
  EXPECT_NEAR(result.materials[0].area, 2 * 0.02 * 0.04, 1e-15);
}

TEST(layer, fabrics_by_panel_name) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.panels = {{"b*", "canvas"}};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params);
  EXPECT_EQ(result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[g.face_count() - 1])].name, "canvas");
  EXPECT_EQ(result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[0])].name, "wool");
  params.panels = {{"b*", "canvas"}, {"*ck", "wool"}};
  EXPECT_EQ(codes(tailor::layer(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params)), std::vector<std::string>{"ambiguous_fabric"});
  params.panels = {{"b*", "canvas"}, {"back", "wool"}};
  const auto own = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params);
  EXPECT_EQ(own.garment.laminates.size(), 1u);
}

TEST(layer, everything_wrong_is_reported_at_once) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wol";
  params.panels = {{"collar", "wool"}};
  params.bonded = {{"l1", "felt", {"frnt"}, tailor::LayerSide::under, {}},
                   {"l2", "wool", {"front"}, tailor::LayerSide::under, {{{1, 1}, {2, 1}, {2, 2}}}},
                   {"l3", "wool", {"front"}, tailor::LayerSide::under, {{{0, 0}, {1, 1}}}}};
  params.fasteners = {{"b1", tailor::FastenerKind::button, {.point = "front.tp"}, {.panel = "back", .at = {{0.5, 0.5}}}, 0, 0}, {"b2", tailor::FastenerKind::hook, {}, {.point = "front.top_left"}, 0, 0}};
  const auto refused = tailor::layer(g, {card("wool", 0.2, 1e-5), card("wool", 0.2, 1e-5)}, params);
  ASSERT_FALSE(refused);
  EXPECT_EQ(codes(refused), (std::vector<std::string>{"duplicate_fabric", "unknown_fabric", "unknown_panel", "unknown_fabric", "unknown_panel", "empty_region", "bad_region", "unknown_point", "bad_fastener", "bad_fastener"}));
}
