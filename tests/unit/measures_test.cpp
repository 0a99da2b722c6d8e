#include "toile/inspect/measures.h"

#include "shapes.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace toile::inspect {
namespace {

using Eigen::Vector3d;

/// Perimeter of the regular polygon that a tube's section is.
double polygon(double radius, int corners) { return 2 * corners * radius * std::sin(std::numbers::pi / corners); }

Figures measured(const mesh::GarmentMesh& g, const mesh::SupportMesh* support = nullptr, const MeasureParams& params = {}) {
  auto figures = measure(params, g, support);
  EXPECT_TRUE(figures) << (figures ? "" : to_string(figures.issues().at(0)));
  return std::move(figures).value();
}

TEST(Measures, a_tube_has_the_figures_of_a_tube) {
  const auto g = shapes::tube(0.2, 0.5, 60, 25, 1.0);
  const Figures r = measured(g);
  EXPECT_EQ(r.vertices, 61u * 26u);
  EXPECT_EQ(r.particles, 60u * 26u);
  EXPECT_EQ(r.faces, 3000u);
  EXPECT_EQ(r.pieces, 1);
  EXPECT_EQ(r.euler_number, 0);
  EXPECT_EQ(r.self_intersections, 0u);
  EXPECT_NEAR(r.mass, 2 * std::numbers::pi * 0.2 * 0.5 * 0.12, 1e-12);
  EXPECT_NEAR(r.mass_expected, r.mass, 1e-12);
  EXPECT_NEAR(r.area, polygon(0.2, 60) * 0.5, 1e-12);
  EXPECT_NEAR(r.centre_of_mass.y(), 1.25, 1e-12);
  EXPECT_NEAR(r.warp.max, 0, 1e-12);
  const double chord = polygon(0.2, 60) / (2 * std::numbers::pi * 0.2) - 1;
  EXPECT_NEAR(r.weft.min, chord, 1e-12);
  EXPECT_NEAR(r.weft.max, chord, 1e-12);
  EXPECT_NEAR(r.max_seam_gap, 0, 1e-12);
  ASSERT_EQ(r.openings.size(), 2u);
  EXPECT_EQ(r.openings[0].runs, std::vector<std::string>{"tube.bottom"});
  EXPECT_EQ(r.openings[1].runs, std::vector<std::string>{"tube.top"});
  for (const OpeningFigures& o : r.openings) {
    EXPECT_NEAR(o.flat, 2 * std::numbers::pi * 0.2, 1e-12);
    EXPECT_NEAR(o.now, polygon(0.2, 60), 1e-12);
    EXPECT_NEAR(o.tape, polygon(0.2, 60), 1e-9);
  }
  ASSERT_EQ(r.seams.size(), 1u);
  EXPECT_NEAR(r.seams[0].now_a, 0.5, 1e-12);
  EXPECT_NEAR(r.seams[0].now_b, 0.5, 1e-12);
}

TEST(Measures, girths_at_a_height_and_at_a_landmark) {
  const auto g = shapes::tube(0.2, 0.5, 60, 25, 1.0);
  auto body = shapes::sphere({0, 1.2, 0}, 0.15, 4);
  body.landmarks["waist_left"] = {0.15, 1.2, 0};
  MeasureParams params;
  params.girths = {{"waist", "waist", {}, {}}, {"hem", "", 1.01, {}}, {"above", "", 1.8, {}}};
  const Figures r = measured(g, &body, params);
  ASSERT_EQ(r.girths.size(), 3u);
  EXPECT_NEAR(*r.girths[0].girth, polygon(0.2, 60), 1e-9);
  EXPECT_NEAR(*r.girths[0].tape, polygon(0.2, 60), 1e-9);
  EXPECT_NEAR(*r.girths[0].body, 2 * std::numbers::pi * 0.15, 0.005);
  EXPECT_NEAR(*r.girths[1].girth, polygon(0.2, 60), 1e-9);
  EXPECT_FALSE(r.girths[1].body);  // the ball ends above
  EXPECT_FALSE(r.girths[2].girth);
  EXPECT_FALSE(r.girths[2].tape);
}

TEST(Measures, girth_of_folds_is_longer_than_the_tape) {
  auto g = shapes::tube(0.2, 0.5, 240, 10, 0);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const double angle = g.uv(v, 0) / 0.2, radius = 0.2 + 0.02 * std::cos(12 * angle);
    g.x(v, 0) = radius * std::sin(angle);
    g.x(v, 2) = radius * std::cos(angle);
  }
  MeasureParams params;
  params.girths = {{"middle", "", 0.26, {}}};
  const Figures r = measured(g, nullptr, params);
  EXPECT_GT(*r.girths[0].girth, *r.girths[0].tape + 0.1);
  EXPECT_NEAR(*r.girths[0].tape, 12 * 2 * 0.22 * std::sin(std::numbers::pi / 12), 0.003);
}

TEST(Measures, an_open_front_still_has_a_tape_girth) {
  auto g = shapes::tube(0.2, 0.5, 60, 25, 0);
  g.welds.clear();
  g.seams.clear();
  // Open it by a hand's breadth.
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const double angle = 0.2 + g.uv(v, 0) / 0.2 * (2 * std::numbers::pi - 0.4) / (2 * std::numbers::pi);
    g.x.row(v) << 0.2 * std::sin(angle), g.uv(v, 1), 0.2 * std::cos(angle);
  }
  MeasureParams params;
  params.girths = {{"middle", "", 0.26, {}}};
  const Figures r = measured(g, nullptr, params);
  EXPECT_FALSE(r.girths[0].girth);
  EXPECT_NEAR(*r.girths[0].tape, 0.2 * (2 * std::numbers::pi - 0.4) + 2 * 0.2 * std::sin(0.2), 0.002);
}

TEST(Measures, penetration_counts_and_measures_what_is_inside) {
  // A sheet through the middle of a ball: what lies inside is known.
  mesh::GarmentMesh g;
  shapes::add_panel(g, "sheet", 1, 1, 40, 40, {-0.5, -0.5, 0.003});
  const auto ball = shapes::sphere({0, 0, 0}, 0.2213, 5);
  const Figures r = measured(g, &ball);
  std::size_t inside = 0;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) inside += g.x.row(v).norm() < 0.2213 * 0.9985;  // the ball is a polyhedron
  ASSERT_TRUE(r.support);
  EXPECT_EQ(r.support->penetrating_vertices, inside);
  EXPECT_NEAR(r.support->max_penetration, 0.2213 - 0.003, 5e-4);
  EXPECT_GT(r.support->support_intersections.value(), 0u);
  EXPECT_FALSE(measure({}, g, &ball, Depth::quick)->support->support_intersections) << "not searched is not zero";
  EXPECT_NEAR(r.support->ease.max, Vector3d(0.5, 0.5, 0.003).norm() - 0.2213, 5e-4);

  const auto outside = shapes::tube(0.25, 0.5, 60, 25, -0.25);
  const Figures clean = measured(outside, &ball);
  EXPECT_EQ(clean.support->penetrating_vertices, 0u);
  EXPECT_EQ(clean.support->support_intersections, 0u);
  EXPECT_NEAR(clean.support->ease.min, 0.25 - 0.2213, 5e-4);
}

TEST(Measures, crossing_panels_intersect) {
  mesh::GarmentMesh g;
  shapes::add_panel(g, "one", 0.4, 0.4, 4, 4, {-0.2, -0.2, 0});
  shapes::add_panel(g, "two", 0.4, 0.4, 4, 4, {-0.2, -0.2, 0});
  for (Eigen::Index v = 25; v < 50; ++v) {
    const Vector3d p = g.x.row(v);
    g.x.row(v) << 0.013, p.y() + 0.017, p.x();
  }
  const Figures r = measured(g);
  EXPECT_GT(r.self_intersections.value(), 5u);
  EXPECT_GE(r.self_intersecting_faces.value(), 8u);
  EXPECT_EQ(r.pieces, 2);
}

TEST(Measures, an_open_seam_is_reported_with_its_gap) {
  auto g = shapes::tube(0.2, 0.5, 60, 25, 0);
  const auto right = mesh::run_vertex_ids(g, 1);
  for (const int v : right) g.x(v, 2) += 0.003;
  const Figures r = measured(g);
  EXPECT_NEAR(r.max_seam_gap, 0.003, 1e-12);
  EXPECT_NEAR(r.mean_seam_gap, 0.003, 1e-12);
  EXPECT_NEAR(r.seams[0].max_gap, 0.003, 1e-12);
}

TEST(Measures, lengths_along_runs_and_between_points) {
  auto g = shapes::tube(0.2, 0.5, 60, 25, 1);
  g.x.col(1) *= 1.1;
  MeasureParams params;
  params.lengths = {{"back", {"tube.right"}, "", ""}, {"diagonal", {}, "tube.top_left", "tube.bottom_left"}};
  const Figures r = measured(g, nullptr, params);
  EXPECT_NEAR(*r.lengths[0].cut, 0.5, 1e-12);
  EXPECT_NEAR(*r.lengths[0].now, 0.55, 1e-12);
  EXPECT_NEAR(*r.lengths[1].straight, 0.55, 1e-12);
  EXPECT_NEAR(*r.lengths[1].drop, 0.55, 1e-12);
}

TEST(Measures, all_wrong_names_are_reported_at_once) {
  const auto g = shapes::tube(0.2, 0.5, 12, 5, 0);
  auto body = shapes::sphere({0, 0.2, 0}, 0.1, 2);
  body.landmarks["waist_left"] = {0, 0.2, 0};
  MeasureParams params;
  params.girths = {{"a", "waste", {}, {}}, {"b", "", 0.2, {"tub"}}};
  params.lengths = {{"c", {"tube.botom"}, "", ""}, {"d", {}, "tube.nowhere", "tube.top_left"}, {"e", {"tube"}, "", ""}};
  const auto result = measure(params, g, &body);
  ASSERT_FALSE(result);
  std::vector<std::string> codes;
  for (const Issue& issue : result.issues()) {
    codes.push_back(issue.code);
    EXPECT_FALSE(issue.place.item.empty());
    EXPECT_FALSE(issue.remedy.empty());
  }
  EXPECT_EQ(codes.size(), 5u);
  EXPECT_EQ(codes[0], "unknown_landmark");
  EXPECT_EQ(codes[3], "unknown_point");
  EXPECT_EQ(codes[4], "bad_reference");
  params = {};
  params.girths = {{"a", "waist", {}, {}}};
  EXPECT_EQ(measure(params, g, nullptr).issues().at(0).code, "needs_support");
}

TEST(Measures, rigid_motion_changes_nothing_but_places) {
  auto g = shapes::tube(0.2, 0.5, 30, 12, 0);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) g.x(v, 0) *= 1 + 0.05 * g.x(v, 1);  // some strain to keep
  const Figures before = measured(g);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) g.x.row(v) = (turn * g.x.row(v).transpose() + Vector3d(0.3, -1, 2)).transpose();
  const Figures after = measured(g);
  EXPECT_NEAR(after.warp.max, before.warp.max, 1e-12);
  EXPECT_NEAR(after.weft.p99, before.weft.p99, 1e-12);
  EXPECT_NEAR(after.shear.max, before.shear.max, 1e-12);
  EXPECT_NEAR(after.area, before.area, 1e-12);
  EXPECT_NEAR(after.openings[0].tape, before.openings[0].tape, 1e-9);
  EXPECT_NEAR(after.seams[0].now_a, before.seams[0].now_a, 1e-12);
}

TEST(Checks, each_fails_beyond_its_limit_and_holds_within) {
  auto g = shapes::tube(0.2, 0.5, 60, 25, -0.25);
  g.x.col(1) *= 1.05;
  const auto right = mesh::run_vertex_ids(g, 1);
  for (const int v : right) g.x(v, 2) += 0.003;
  g.x.col(0) += 0.02 * g.x.col(1);
  g.seams[0].length_b = 0.53;
  g.panels[0].cut_area *= 1.01;
  const auto ball = shapes::sphere({0, 0, 0}, 0.21, 4);
  const Figures r = measured(g, &ball);
  ASSERT_GT(r.support->penetrating_vertices, 0u);
  const auto codes = [&](const Checks& checks) {
    std::vector<std::string> result;
    for (const Issue& issue : failed_checks(checks, r, g)) {
      EXPECT_EQ(issue.category, Category::check);
      result.push_back(issue.code);
    }
    return result;
  };
  const std::vector<std::string> none;
  EXPECT_EQ(codes({}), none);
  Checks c;
  c.max_strain = 0.03;
  EXPECT_EQ(codes(c).at(0), "max_strain");
  c.max_strain = 0.9;
  EXPECT_EQ(codes(c), none);
  c = {};
  c.max_compression = 1e-4;
  EXPECT_EQ(codes(c).at(0), "max_compression");
  c = {};
  c.max_shear = 1e-6;
  EXPECT_EQ(codes(c).at(0), "max_shear");
  c = {};
  c.penetrating_vertices = 0;
  c.support_intersections = 0;
  EXPECT_EQ(codes(c), (std::vector<std::string>{"penetrating_vertices", "support_intersections"}));
  c.penetrating_vertices = c.support_intersections = 1000000;
  EXPECT_EQ(codes(c), none);
  c = {};
  c.self_intersections = 0;
  EXPECT_EQ(codes(c), none);
  c.max_seam_gap = 0.001;
  EXPECT_EQ(codes(c).at(0), "max_seam_gap");
  c.max_seam_gap = 0.004;
  EXPECT_EQ(codes(c), none);
  c.max_seam_mismatch = 0.01;
  EXPECT_EQ(codes(c).at(0), "max_seam_mismatch");
  c.max_seam_mismatch = 0.2;
  c.mass_error = 0.001;
  EXPECT_EQ(codes(c).at(0), "mass_error");
  c.mass_error = 0.02;
  c.converged = true;
  EXPECT_EQ(codes(c).at(0), "converged");
  const Figures alone = measured(g);
  c = {};
  c.penetrating_vertices = 0;
  EXPECT_EQ(failed_checks(c, alone, g).at(0).code, "penetrating_vertices") << "what cannot be counted does not pass";
}

TEST(Figures, as_json_are_complete_and_in_order) {
  auto g = shapes::tube(0.2, 0.5, 12, 5, 0);
  g.marks["converged"] = "yes";
  g.marks["residual"] = "0.0007";
  const auto ball = shapes::sphere({0, 0.2, 0}, 0.1, 2);
  const auto json = nlohmann::ordered_json::parse(to_json(measured(g, &ball)).dump());
  for (const char* key : {"converged", "residual", "penetrating_vertices", "max_penetration", "self_intersections", "support_intersections", "max_seam_gap", "max_strain_warp", "max_strain_weft",
                          "min_strain_warp", "p99_strain_weft", "mass", "mass_expected", "vertices", "particles", "faces", "panels", "seams", "girths", "units"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json.begin().key(), "units");
  EXPECT_EQ(json["converged"], true);
  EXPECT_EQ(json["residual"], 0.0007);
  EXPECT_EQ(json["penetrating_vertices"], 0);
  EXPECT_EQ(json["panels"][0]["name"], "tube");
  const auto unsimulated = nlohmann::ordered_json::parse(to_json(measured(shapes::tube(0.2, 0.5, 12, 5, 0))).dump());
  EXPECT_TRUE(unsimulated["converged"].is_null());
  EXPECT_TRUE(unsimulated["penetrating_vertices"].is_null()) << "not counted is not zero";
}

TEST(Figures, as_csv_have_one_row_an_item) {
  auto g = shapes::tube(0.2, 0.5, 12, 5, 0);
  g.panels[0].name = "a, \"b\"";
  const std::string csv = panels_csv(measured(g));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2);
  EXPECT_NE(csv.find("\n\"a, \"\"b\"\"\","), std::string::npos);
  EXPECT_EQ(seams_csv(measured(g)).substr(0, 5), "seam,");
}

TEST(Maps, are_columns_of_the_garment) {
  const auto g = shapes::tube(0.2, 0.5, 12, 5, 0);
  const auto ball = shapes::sphere({0, 0.2, 0}, 0.1, 2);
  const auto mapped = with_maps(g, measured(g, &ball));
  EXPECT_TRUE(mesh::validate(mapped).empty());
  EXPECT_EQ(mapped.face_columns.at("strain_warp").size(), static_cast<std::size_t>(g.face_count()));
  EXPECT_EQ(mapped.vertex_columns.at("ease").size(), static_cast<std::size_t>(g.vertex_count()));
}

}  // namespace
}  // namespace toile::inspect
