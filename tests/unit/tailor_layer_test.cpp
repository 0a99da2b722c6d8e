#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "garments.h"
#include "toile/fabric/constitutive.h"
#include "toile/fabric/laminate.h"
#include "toile/inspect/bill.h"
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

/// Makes a panel the mirror image that it would be as the second copy of a piece.
void turn_over(mesh::GarmentMesh& g, int panel) {
  g.panels[static_cast<std::size_t>(panel)].mirrored = true;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == panel) g.uv(v, 0) = -g.uv(v, 0);
  }
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    if (g.face_panel[f] == panel) std::swap(g.faces(f, 1), g.faces(f, 2));
  }
}

/// A panel and its mirror image, and a small piece beside them.
mesh::GarmentMesh fronts_and_piece() {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "front", 6, 8, 0.01);
  test::add_rectangle(g, "front_m", 6, 8, 0.01, 0.1);
  test::add_rectangle(g, "patch", 3, 2, 0.01, 0.2);
  g.panels[1].piece = "front";
  turn_over(g, 1);
  return g;
}

/// An internal line of a panel through grid nodes.
void add_line(mesh::GarmentMesh& g, int panel, const std::string& name, const std::vector<std::array<double, 2>>& nodes) {
  const int id = static_cast<int>(g.runs.size());
  double s = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
      if (g.vertex_panel[v] != panel || std::hypot(g.uv(v, 0) - nodes[k][0], g.uv(v, 1) - nodes[k][1]) > 1e-9) continue;
      if (k > 0) s += std::hypot(nodes[k][0] - nodes[k - 1][0], nodes[k][1] - nodes[k - 1][1]);
      g.run_vertices.push_back({id, static_cast<int>(v), s});
    }
  }
  g.runs.push_back({.id = id, .panel = panel, .name = name, .length = s, .closed = nodes.front() == nodes.back(), .internal = true});
}

tailor::BondedLayer bonded_layer(const std::string& name, const std::string& fabric, std::vector<std::string> panels) {
  tailor::BondedLayer layer;
  layer.name = name;
  layer.fabric = fabric;
  layer.panels = std::move(panels);
  return layer;
}

tailor::FastenerSpec button(const std::string& name, tailor::FastenerEnd a, tailor::FastenerEnd b) {
  tailor::FastenerSpec spec;
  spec.name = name;
  spec.a = {std::move(a)};
  spec.b = {std::move(b)};
  spec.mass = 0.002;
  spec.length = 0.004;
  return spec;
}

std::vector<fabric::Card> wool_and_canvas() { return {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}; }

tailor::Layered layered(const mesh::GarmentMesh& g, const std::vector<fabric::Card>& cards, const tailor::LayerParams& params) {
  auto result = tailor::layer(g, cards, params);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

template <class T>
std::vector<std::string> codes(const Result<T>& result) {
  std::vector<std::string> list;
  for (const Issue& issue : result.issues()) list.push_back(issue.code);
  return list;
}

double covered_area(const mesh::GarmentMesh& g, int panel, std::size_t plies) {
  double sum = 0;
  const Eigen::VectorXd areas = mesh::rest_areas(g);
  for (Eigen::Index f = 0; f < areas.size(); ++f) {
    if (g.face_panel[f] == panel && g.laminates[static_cast<std::size_t>(g.face_laminate[f])].plies.size() == plies) sum += areas[f];
  }
  return sum;
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
  params.bonded = {bonded_layer("stay", "canvas", {"front"})};
  params.fasteners = {button("b1", {.point = "front.top_left"}, {.panel = "back", .at = {{0.0301, 0.0199}}})};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5), card("unused", 1, 1e-5)}, params);
  const double area = 0.06 * 0.04;
  const inspect::Bill bill = inspect::bill_of_materials(result.garment);
  EXPECT_NEAR(bill.mass, 2 * area * 0.2 + area * 0.08 + 0.002, 1e-12);
  EXPECT_NEAR(mesh::vertex_masses(result.garment).sum(), bill.mass, 1e-12);
  ASSERT_EQ(bill.fabrics.size(), 2u);
  EXPECT_EQ(bill.fabrics[0].fabric, "canvas");
  EXPECT_NEAR(bill.fabrics[0].area, area, 1e-12);
  EXPECT_NEAR(bill.fabrics[1].area, 2 * area, 1e-12);
  ASSERT_EQ(result.garment.laminates.size(), 2u);
  EXPECT_EQ(result.garment.laminates[0].name, "wool+stay");
  EXPECT_EQ(result.garment.laminates[0].rule, "additive");
  EXPECT_EQ(result.garment.laminates[0].plies[1].layer, "stay");
  EXPECT_EQ(result.garment.laminates[1].rule, "single");
  EXPECT_EQ(result.garment.laminates[0].plies[0].fabric, "wool");
  EXPECT_EQ(result.garment.fabrics.size(), 2u);
  ASSERT_EQ(result.garment.fasteners.size(), 1u);
  EXPECT_EQ(result.garment.closures[0].name, "b1");
  EXPECT_NEAR(result.farthest_snap, std::hypot(1e-4, 1e-4), 1e-9);
  EXPECT_NEAR(result.garment.uv(result.garment.fasteners[0].b, 0), 0.03, 1e-12);
  EXPECT_NEAR(result.garment.uv(result.garment.fasteners[0].b, 1), 0.02, 1e-12);
}

TEST(layer, region_is_cut_to_the_grid_by_face_middles) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("patch", "canvas", {"front"})};
  params.bonded[0].side = tailor::LayerSide::over;
  params.bonded[0].region = {{0.01, 0.01}, {0.03, 0.01}, {0.03, 0.03}, {0.01, 0.03}};
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
  turn_over(g, 1);
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("patch", "canvas", {"*"})};
  params.bonded[0].region = {{0, 0}, {0.02, 0}, {0.02, 0.04}, {0, 0.04}};
  const auto result = layered(g, {card("wool", 0.2, 1e-5), card("canvas", 0.08, 3e-5)}, params);
  EXPECT_NEAR(result.layers[0].area, 2 * 0.02 * 0.04, 1e-15);
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

TEST(stacked, a_plate_of_equal_sheets_is_that_plate) {
  // n glued sheets of a homogeneous material of modulus E and thickness t: D = E (n t)^3 / 12 = n^3 B.
  fabric::Card sheet = card("film", 0.05, 0);
  sheet.thickness = 2e-4;
  const double modulus = 3e7;
  sheet.warp = sheet.weft = {.strain_max = sheet.tensile_force_max / (modulus * sheet.thickness), .linearity = 1, .resilience = 1, .bending = modulus * std::pow(sheet.thickness, 3) / 12, .bending_hysteresis = 0};
  const double shear_modulus = 1e6;
  sheet.shear = shear_modulus * sheet.thickness;
  sheet.twist_ratio = shear_modulus * std::pow(sheet.thickness, 3) / 12 / sheet.warp.bending;
  for (const std::size_t n : {2u, 3u, 5u}) {
    const auto plate = fabric::stacked(std::vector<fabric::Sheet>(n, {sheet, 0}), std::vector<fabric::Bond>(n - 1, {fabric::Joint::laminate}), "plate");
    ASSERT_TRUE(plate);
    const double cube = static_cast<double>(n * n * n);
    EXPECT_NEAR(plate->warp.bending / (cube * sheet.warp.bending), 1, 1e-12);
    EXPECT_NEAR(plate->weft.bending / (cube * sheet.weft.bending), 1, 1e-12);
    const double twist = plate->twist_ratio * std::sqrt(plate->warp.bending * plate->weft.bending);
    EXPECT_NEAR(twist / (cube * shear_modulus * std::pow(sheet.thickness, 3) / 12), 1, 1e-12);
    EXPECT_NEAR(plate->shear, static_cast<double>(n) * sheet.shear, 1e-9);
    EXPECT_NEAR(plate->warp.strain_max, sheet.warp.strain_max / static_cast<double>(n), 1e-12);
    EXPECT_EQ(plate->warp.bending_hysteresis, 0);  // RT = 1: nothing is lost
  }
}

TEST(stacked, two_different_sheets_by_hand) {
  // Sheet a: C = 4000 N/m, 0.6 mm; sheet b: C = 12000 N/m, 0.2 mm; both straight. Middles at 0.3 and 0.7 mm from the face:
  // z_n = (4000 0.3 + 12000 0.7) / 16000 = 0.6 mm; D = 1e-5 + 2e-5 + 4000 (0.3 mm)^2 + 12000 (0.1 mm)^2 = 5.1e-4 N m.
  fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.1, 2e-5);
  a.thickness = 6e-4, b.thickness = 2e-4;
  a.warp.strain_max = a.tensile_force_max / 4000, b.warp.strain_max = b.tensile_force_max / 12000;
  a.warp.linearity = b.warp.linearity = 1;
  a.warp.bending_hysteresis = 3e-4, b.warp.bending_hysteresis = 1e-4;
  a.warp.resilience = 0.5, b.warp.resilience = 0.75;
  const auto both = fabric::stacked(std::vector<fabric::Sheet>{{a, 0}, {b, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "ab");
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->warp.bending, 5.1e-4, 1e-12);
  // What the stretched sheets lose at the curvature K = 1/cm at which 2HB is read: K (0.5 C_a (0.3 mm)^2 + 0.25 C_b (0.1 mm)^2) / 2.
  EXPECT_NEAR(both->warp.bending_hysteresis, 4e-4 + 100 * (0.5 * 3.6e-4 + 0.25 * 1.2e-4) / 2, 1e-12);
  // Turned upside down it bends the same.
  const auto under = fabric::stacked(std::vector<fabric::Sheet>{{b, 0}, {a, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "ba");
  EXPECT_NEAR(under->warp.bending, both->warp.bending, 1e-15);
}

TEST(stacked, limits_of_the_laminate) {
  const fabric::Card a = card("a", 0.2, 1e-5);
  // A sheet with next to no membrane stiffness moves nothing: the rule becomes the additive one.
  fabric::Card soft = card("soft", 0.05, 2e-5);
  soft.warp.strain_max = soft.weft.strain_max = 2;
  soft.tensile_force_max = 1;
  soft.shear = 0.1;
  const auto glued = fabric::stacked(std::vector<fabric::Sheet>{{a, 0}, {soft, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "x");
  ASSERT_TRUE(glued);
  EXPECT_NEAR(glued->warp.bending, 3e-5, 1e-7);
  // Sheets without thickness lie in one plane.
  fabric::Card thin = a, other = card("b", 0.1, 2e-5);
  thin.thickness = other.thickness = 1e-5;
  const auto flat = fabric::stacked(std::vector<fabric::Sheet>{{thin, 0}, {other, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "x");
  EXPECT_NEAR(flat->warp.bending, 3e-5, 1e-6);
  // The laminate is never softer than the network, and everything else is the same.
  const auto network = fabric::bonded(std::vector{a, other}, "x");
  const auto laminate = fabric::stacked(std::vector<fabric::Sheet>{{a, 0}, {other, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "x");
  EXPECT_GT(laminate->warp.bending, network->warp.bending);
  EXPECT_EQ(laminate->shear, network->shear);
  EXPECT_EQ(laminate->warp.strain_max, network->warp.strain_max);
  EXPECT_EQ(laminate->areal_density, network->areal_density);
  EXPECT_EQ(laminate->thickness, network->thickness);
}

TEST(stacked, glued_and_free_sheets_in_one_stack) {
  // Only neighbours that are glued form a plate: a|bc is a plus the plate of b and c.
  const fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.1, 2e-5), c = card("c", 0.1, 3e-5);
  const auto plate = fabric::stacked(std::vector<fabric::Sheet>{{b, 0}, {c, 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "bc");
  const auto all = fabric::stacked(std::vector<fabric::Sheet>{{a, 0}, {b, 0}, {c, 0}}, std::vector<fabric::Bond>{{fabric::Joint::additive}, {fabric::Joint::laminate}}, "abc");
  ASSERT_TRUE(plate && all);
  EXPECT_NEAR(all->warp.bending, 1e-5 + plate->warp.bending, 1e-15);
}

TEST(stacked, sliding_friction_is_damping_and_nothing_else) {
  fabric::Card a = card("a", 0.2, 1e-5), b = card("b", 0.1, 2e-5);
  a.friction = 0.3, b.friction = 0.1;
  a.thickness = 5e-4, b.thickness = 1e-4;
  const auto friction = fabric::sliding_friction(a, b, 100, 0.15);
  EXPECT_NEAR(friction.shear, 0.2 * 100 * 0.15 / 2, 1e-12);
  EXPECT_NEAR(friction.bending, 1.5 * 3e-4, 1e-12);
  const auto network = fabric::bonded(std::vector{a, b}, "x");
  const auto sliding = fabric::stacked(std::vector<fabric::Sheet>{{a, 0}, {b, 0}}, std::vector<fabric::Bond>{{fabric::Joint::sliding, friction.bending, friction.shear}}, "x");
  ASSERT_TRUE(sliding);
  EXPECT_NEAR(sliding->warp.bending_hysteresis, network->warp.bending_hysteresis + friction.bending, 1e-15);
  EXPECT_NEAR(sliding->weft.bending_hysteresis, network->weft.bending_hysteresis + friction.bending, 1e-15);
  EXPECT_NEAR(sliding->shear_hysteresis, network->shear_hysteresis + friction.shear, 1e-12);
  EXPECT_NEAR(sliding->shear_hysteresis_5, network->shear_hysteresis_5 + friction.shear, 1e-12);
  EXPECT_EQ(sliding->warp.bending, network->warp.bending);
  EXPECT_EQ(sliding->shear, network->shear);
}

TEST(stacked, a_turned_sheet) {
  fabric::Card a = card("a", 0.2, 1e-5);
  a.warp = {.strain_max = 0.04, .linearity = 0.6, .resilience = 0.6, .bending = 2e-5, .bending_hysteresis = 3e-4};
  a.weft = {.strain_max = 0.09, .linearity = 0.7, .resilience = 0.5, .bending = 1e-5, .bending_hysteresis = 1e-4};
  const auto turned = [&](double angle) { return *fabric::stacked(std::vector<fabric::Sheet>{{a, angle}}, {}, "t"); };
  const fabric::Card quarter = turned(std::numbers::pi / 2);
  EXPECT_NEAR(quarter.warp.strain_max, a.weft.strain_max, 1e-9);
  EXPECT_NEAR(quarter.warp.linearity, a.weft.linearity, 1e-9);
  EXPECT_NEAR(quarter.warp.resilience, a.weft.resilience, 1e-9);
  EXPECT_EQ(quarter.warp.bending, a.weft.bending);
  EXPECT_EQ(quarter.weft.bending_hysteresis, a.warp.bending_hysteresis);
  EXPECT_EQ(quarter.shear, a.shear);
  EXPECT_NEAR(quarter.twist_ratio, a.twist_ratio, 1e-12);
  // At 45 degrees: B = (B1 + B2 + 4 D66) / 4, D66 = (B1 + B2) / 4; the cloth gives far more along the bias and shears far less.
  const fabric::Card bias = turned(std::numbers::pi / 4);
  const double twist = a.twist_ratio * std::sqrt(2e-5 * 1e-5);
  EXPECT_NEAR(bias.warp.bending, (3e-5 + 4 * twist) / 4, 1e-15);
  EXPECT_NEAR(bias.weft.bending, bias.warp.bending, 1e-15);
  EXPECT_NEAR(bias.twist_ratio * bias.warp.bending, 3e-5 / 4, 1e-15);
  EXPECT_GT(bias.warp.strain_max, a.weft.strain_max);
  EXPECT_GT(bias.shear, 5 * a.shear);
  // Left and right alike.
  EXPECT_NEAR(turned(-0.5).warp.strain_max, turned(0.5).warp.strain_max, 1e-12);
  EXPECT_NEAR(turned(-0.5).shear, turned(0.5).shear, 1e-9);
}

TEST(layer, rules_of_single_layers_meet_in_one_stack) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("fusible", "canvas", {"front"}), bonded_layer("domette", "canvas", {"front"})};
  params.bonded[0].rule = fabric::Joint::laminate;
  params.bonded[1].rule = fabric::Joint::sliding;
  params.bonded[1].bending_friction = 2e-4;
  const auto cards = wool_and_canvas();
  const auto result = layered(g, cards, params);
  const mesh::Laminate& stack = result.garment.laminates[0];
  EXPECT_EQ(stack.name, "wool+fusible+domette");
  EXPECT_EQ(stack.rule, "laminate+sliding");
  const auto plate = fabric::stacked(std::vector<fabric::Sheet>{{cards[0], 0}, {cards[1], 0}}, std::vector<fabric::Bond>{{fabric::Joint::laminate}}, "p");
  EXPECT_NEAR(stack.equivalent.warp.bending, plate->warp.bending + cards[1].warp.bending, 1e-15);
  EXPECT_NEAR(stack.equivalent.warp.bending_hysteresis, plate->warp.bending_hysteresis + 2e-4, 1e-15);
  // The same layers on the face: each is held to what was there before it.
  for (auto& layer : params.bonded) layer.side = tailor::LayerSide::over;
  const auto over = layered(g, cards, params);
  EXPECT_EQ(over.garment.laminates[0].name, "domette+fusible+wool");
  EXPECT_NEAR(over.garment.laminates[0].equivalent.warp.bending, stack.equivalent.warp.bending, 1e-15);
  EXPECT_NEAR(over.garment.laminates[0].equivalent.warp.bending_hysteresis, stack.equivalent.warp.bending_hysteresis, 1e-15);
  params.bonded[1].bending_friction.reset();
  EXPECT_EQ(codes(tailor::layer(g, cards, params)), std::vector<std::string>{"bad_friction"});
}

TEST(layer, overlapping_layers_stack_up) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("a", "canvas", {"front"}), bonded_layer("b", "canvas", {"front"}), bonded_layer("c", "canvas", {"front"})};
  params.bonded[0].region = {{0, 0}, {0.04, 0}, {0.04, 0.04}, {0, 0.04}};
  params.bonded[1].region = {{0.02, 0}, {0.06, 0}, {0.06, 0.04}, {0.02, 0.04}};
  const auto result = layered(g, wool_and_canvas(), params);
  EXPECT_NEAR(covered_area(result.garment, 0, 4), 0.02 * 0.04, 1e-15);
  EXPECT_NEAR(covered_area(result.garment, 0, 3), 0.04 * 0.04, 1e-15);
  EXPECT_NEAR(covered_area(result.garment, 0, 2), 0, 1e-15);
  std::vector<std::string> names;
  for (const auto& laminate : result.garment.laminates) names.push_back(laminate.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"wool", "wool+a+b+c", "wool+a+c", "wool+b+c"}));
  const double mass = inspect::bill_of_materials(result.garment).mass;
  EXPECT_NEAR(mass, 2 * 0.0024 * 0.2 + (2 * 0.0016 + 0.0024) * 0.08, 1e-15);
  EXPECT_NEAR(mesh::vertex_masses(result.garment).sum(), mass, 1e-15);
}

TEST(layer, materials_of_the_pattern_choose_the_fabric) {
  auto g = two_bare_panels();
  g.panels[0].material = "fabric";
  g.panels[1].material = "lining";
  tailor::LayerParams params;
  params.materials = {{"fabric", "wool"}, {"lining", "canvas"}, {"felt", "wool"}};
  const auto cloth = [&](const tailor::Layered& result, Eigen::Index face) { return result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[face])].name; };
  const auto result = layered(g, wool_and_canvas(), params);
  EXPECT_EQ(cloth(result, 0), "wool");
  EXPECT_EQ(cloth(result, g.face_count() - 1), "canvas");
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0].code, "unused_material");
  params.panels = {{"back", "wool"}};  // a panel's own word goes first
  EXPECT_EQ(cloth(layered(g, wool_and_canvas(), params), g.face_count() - 1), "wool");
  params.panels.clear();
  params.materials.erase("lining");
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"no_fabric"});
  params.base = "canvas";
  EXPECT_EQ(cloth(layered(g, wool_and_canvas(), params), g.face_count() - 1), "canvas");
}

TEST(layer, outline_of_a_closed_line) {
  auto g = fronts_and_piece();
  add_line(g, 0, "chest", {{0.01, 0.02}, {0.02, 0.02}, {0.03, 0.02}, {0.03, 0.03}, {0.03, 0.04}, {0.02, 0.04}, {0.01, 0.04}, {0.01, 0.03}, {0.01, 0.02}});
  add_line(g, 1, "chest", {{-0.01, 0.02}, {-0.02, 0.02}, {-0.03, 0.02}, {-0.03, 0.03}, {-0.03, 0.04}, {-0.02, 0.04}, {-0.01, 0.04}, {-0.01, 0.03}, {-0.01, 0.02}});
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("chest", "canvas", {})};
  params.bonded[0].outline = {"front.chest"};
  const auto result = layered(g, wool_and_canvas(), params);
  // The name of a piece stands for all its copies.
  EXPECT_NEAR(covered_area(result.garment, 0, 2), 0.02 * 0.02, 1e-15);
  EXPECT_NEAR(covered_area(result.garment, 1, 2), 0.02 * 0.02, 1e-15);
  EXPECT_NEAR(result.layers[0].area, 2 * 0.02 * 0.02, 1e-15);
  params.bonded[0].panels = {"front"};
  EXPECT_NEAR(covered_area(layered(g, wool_and_canvas(), params).garment, 1, 2), 0, 1e-15);
  params.bonded[0].outline = {"front.chets"};
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"unknown_line"});
}

TEST(layer, outline_of_edges_and_lines) {
  auto g = fronts_and_piece();
  add_line(g, 0, "yoke", {{0, 0.05}, {0.01, 0.05}, {0.02, 0.05}, {0.03, 0.05}, {0.04, 0.05}, {0.05, 0.05}, {0.06, 0.05}});
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("yoke", "canvas", {"front"})};
  params.bonded[0].outline = {"yoke"};
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"open_outline"});
  params.bonded[0].inside = std::array{0.03, 0.07};
  EXPECT_NEAR(covered_area(layered(g, wool_and_canvas(), params).garment, 0, 2), 0.06 * 0.03, 1e-15);
  params.bonded[0].inside = std::array{0.03, 0.01};
  EXPECT_NEAR(covered_area(layered(g, wool_and_canvas(), params).garment, 0, 2), 0.06 * 0.05, 1e-15);
  params.bonded[0].inside = std::array{0.2, 0.01};
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"empty_region"});
  params.bonded[0].inside = std::array{0.03, 0.01};
  params.bonded[0].outline = {"top"};
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"open_outline"});
  // A stretch of an edge closes the outline, whichever way the edge runs.
  g.points.push_back({0, "notch", mesh::run_vertex_ids(g, 1)[5]});
  g.points.push_back({0, "notch_left", mesh::run_vertex_ids(g, 3)[3]});
  params.bonded[0].inside.reset();
  for (const char* stretch : {"right(notch..top_right)", "right(top_right..notch)"}) {
    params.bonded[0].outline = {"yoke", "top", stretch, "left(top_left..notch_left)"};
    EXPECT_NEAR(covered_area(layered(g, wool_and_canvas(), params).garment, 0, 2), 0.06 * 0.03, 1e-15);
  }
  // All edges of the panel enclose the panel.
  params.bonded[0].inside.reset();
  params.bonded[0].outline = {"left", "top", "right", "bottom"};
  EXPECT_NEAR(covered_area(layered(g, wool_and_canvas(), params).garment, 0, 2), 0.06 * 0.08, 1e-15);
}

TEST(layer, a_piece_laid_on_is_used_up) {
  const auto g = fronts_and_piece();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("pocket", "canvas", {"front*"})};
  params.bonded[0].piece = "patch";
  params.bonded[0].at = {0.02, 0.03};
  const auto result = layered(g, wool_and_canvas(), params);
  ASSERT_EQ(result.garment.panels.size(), 2u);
  EXPECT_EQ(result.garment.face_count(), 2 * 2 * 6 * 8);
  EXPECT_EQ(result.garment.runs.size(), 8u);
  EXPECT_EQ(result.garment.points.size(), 8u);
  EXPECT_NEAR(result.layers[0].area, 2 * 0.03 * 0.02, 1e-15);
  EXPECT_NEAR(*result.layers[0].piece_area, 2 * 0.03 * 0.02, 1e-15);
  // On the mirrored panel it lies at the mirrored place.
  for (Eigen::Index f = 0; f < result.garment.face_count(); ++f) {
    const bool covered = result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[f])].plies.size() == 2;
    Eigen::RowVector2d middle = (result.garment.uv.row(result.garment.faces(f, 0)) + result.garment.uv.row(result.garment.faces(f, 1)) + result.garment.uv.row(result.garment.faces(f, 2))) / 3;
    if (result.garment.face_panel[f] == 1) middle.x() = -middle.x();
    EXPECT_EQ(covered, middle.x() > 0.02 && middle.x() < 0.05 && middle.y() > 0.03 && middle.y() < 0.05);
  }
  // A quarter turn about the origin of the piece: 3 cm along v, 2 cm to the left.
  params.bonded[0].angle = std::numbers::pi / 2;
  params.bonded[0].at = {0.03, 0.03};
  const auto turned = layered(g, wool_and_canvas(), params);
  EXPECT_NEAR(turned.layers[0].area, 2 * 0.03 * 0.02, 1e-15);
  for (Eigen::Index f = 0; f < g.face_count() / 3; ++f) {
    if (turned.garment.face_panel[f] != 0 || turned.garment.laminates[static_cast<std::size_t>(turned.garment.face_laminate[f])].plies.size() != 2) continue;
    for (int k = 0; k < 3; ++k) {
      EXPECT_GT(turned.garment.uv(turned.garment.faces(f, k), 0), 0.01 - 1e-9);
      EXPECT_LT(turned.garment.uv(turned.garment.faces(f, k), 1), 0.06 + 1e-9);
    }
  }
}

TEST(layer, a_piece_takes_its_fabric_from_its_material) {
  auto g = fronts_and_piece();
  g.panels[2].material = "hair";
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("pocket", "", {"front"})};
  params.bonded[0].piece = "patch";
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"unknown_fabric"});
  params.materials = {{"hair", "canvas"}};
  const auto result = layered(g, wool_and_canvas(), params);
  EXPECT_EQ(result.garment.laminates[0].plies.back().fabric, "canvas");
  EXPECT_TRUE(result.notes.empty());
}

TEST(layer, a_sewn_piece_is_not_laid_on) {
  auto g = fronts_and_piece();
  g.seams = {{.id = 0, .name = "top", .length_a = 0.01, .length_b = 0.01}};
  g.welds = {{0, static_cast<int>(g.vertex_count()) - 1, 0}};
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("pocket", "canvas", {"front"})};
  params.bonded[0].piece = "patch";
  EXPECT_EQ(codes(tailor::layer(g, wool_and_canvas(), params)), std::vector<std::string>{"piece_sewn"});
}

TEST(layer, mirrored_spec_gives_the_mirrored_garment) {
  // The same region said of the plain copy covers the mirror images of the same faces; with a turned layer the equivalent
  // fabrics are the same too.
  auto g = fronts_and_piece();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("a", "canvas", {"front*"}), bonded_layer("b", "canvas", {"front*"})};
  params.bonded[0].region = {{0.005, 0.012}, {0.044, 0.003}, {0.031, 0.071}};
  params.bonded[1].piece = "patch";
  params.bonded[1].at = {0.021, 0.017};
  params.bonded[1].angle = 0.4;
  const auto result = layered(g, wool_and_canvas(), params);
  const Eigen::Index half = result.garment.face_count() / 2;
  for (Eigen::Index f = 0; f < half; ++f) {
    const auto &plain = result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[f])], &other = result.garment.laminates[static_cast<std::size_t>(result.garment.face_laminate[f + half])];
    ASSERT_EQ(plain.plies.size(), other.plies.size());
    EXPECT_NEAR(plain.equivalent.warp.bending, other.equivalent.warp.bending, 1e-18);
    EXPECT_NEAR(plain.equivalent.shear, other.equivalent.shear, 1e-9);
  }
}

TEST(layer, allowances_weigh_and_bend_as_their_cloth) {
  auto g = two_bare_panels();
  g.trims = {{.id = 0, .name = "side allowance", .kind = "allowance", .width = 0.02, .plies = 2}};
  for (const auto& row : g.run_vertices) {
    if (g.runs[static_cast<std::size_t>(row.run)].name == "right" && g.runs[static_cast<std::size_t>(row.run)].panel == 0 && row.s > 0) g.trim_segments.push_back({row.vertex - 7, row.vertex, 0, 0.01});
  }
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("stay", "canvas", {"front"})};
  auto cards = wool_and_canvas();
  cards[0].warp.bending = 4e-5;
  const auto result = layered(g, cards, params);
  EXPECT_NEAR(result.garment.trims[0].linear_density, 2 * 0.02 * 0.2, 1e-15);
  EXPECT_NEAR(result.garment.trims[0].bending, 2 * 0.02 * 4e-5, 1e-18);  // the edge runs along the warp
  const auto bill = inspect::bill_of_materials(result.garment);
  ASSERT_EQ(bill.trims.size(), 1u);
  EXPECT_NEAR(bill.trims[0].mass, 0.04 * 2 * 0.02 * 0.2, 1e-15);
  EXPECT_NEAR(bill.mass, mesh::vertex_masses(result.garment).sum(), 1e-15);
}

TEST(layer, layering_again_replaces_what_was_there) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("stay", "canvas", {"front"})};
  params.free = {{"f", {"back"}, {"front"}, tailor::FreeSide::outside}};
  params.tacks = {{"t", {{.point = "front.top_left"}}, {{.point = "back.top_left"}}}};
  params.fasteners = {button("b", {.point = "front.bottom_left"}, {.point = "back.bottom_left"})};
  const auto once = layered(g, wool_and_canvas(), params), twice = layered(once.garment, wool_and_canvas(), params);
  EXPECT_EQ(twice.garment.welds.size(), 1u);
  EXPECT_EQ(twice.garment.seams.size(), 1u);
  EXPECT_EQ(twice.garment.fasteners.size(), 1u);
  EXPECT_EQ(twice.garment.free_layers.size(), 1u);
  EXPECT_EQ(twice.garment.laminates.size(), once.garment.laminates.size());
}

TEST(bill, allowances_count_with_the_cloth_of_the_panel) {
  auto g = two_bare_panels();
  g.panels[0].allowance_area = 0.001;
  tailor::LayerParams params;
  params.base = "wool";
  params.bonded = {bonded_layer("stay", "canvas", {"front"}), bonded_layer("patch", "canvas", {"front"})};
  params.bonded[1].region = {{0, 0}, {0.02, 0}, {0.02, 0.04}, {0, 0.04}};
  params.fasteners = {button("a", {.point = "front.top_left"}, {.point = "back.top_left"}), button("b", {.point = "front.top_right"}, {.point = "back.top_right"})};
  const auto bill = inspect::bill_of_materials(layered(g, wool_and_canvas(), params).garment);
  ASSERT_EQ(bill.fabrics.size(), 2u);
  EXPECT_NEAR(bill.fabrics[1].area_with_allowances, 2 * 0.0024 + 0.001, 1e-15);
  EXPECT_NEAR(bill.fabrics[0].area_with_allowances, bill.fabrics[0].area, 1e-15);
  ASSERT_EQ(bill.fasteners.size(), 1u);
  EXPECT_EQ(bill.fasteners[0].count, 2);
  EXPECT_EQ(bill.fasteners[0].mass_each, 0.002);
}

TEST(layer, everything_wrong_is_reported_at_once) {
  const auto g = two_bare_panels();
  tailor::LayerParams params;
  params.base = "wol";
  params.panels = {{"collar", "wool"}};
  params.bonded = {bonded_layer("l1", "felt", {"frnt"}), bonded_layer("l2", "wool", {"front"}), bonded_layer("l2", "wool", {"front"}), bonded_layer("l4", "wool", {})};
  params.bonded[1].region = {{1, 1}, {2, 1}, {2, 2}};
  params.bonded[2].piece = "pocket";
  params.fasteners = {button("b1", {.point = "front.tp"}, {.panel = "back", .at = {{0.5, 0.5}}}), button("b2", {}, {.point = "front.top_left"})};
  params.free = {{"lining", {"back"}, {"back"}, tailor::FreeSide::inside}};
  params.tacks = {{"t", {{.point = "front.top_left"}}, {}}};
  const auto refused = tailor::layer(g, {card("wool", 0.2, 1e-5), card("wool", 0.2, 1e-5)}, params);
  ASSERT_FALSE(refused);
  EXPECT_EQ(codes(refused), (std::vector<std::string>{"unknown_panel", "duplicate_fabric", "unknown_panel", "unknown_fabric", "unknown_panel", "unknown_fabric", "unknown_panel", "empty_region", "duplicate_name",
                                                      "bad_layer", "bad_tack", "unknown_point", "bad_fastener", "bad_fastener"}));
}
