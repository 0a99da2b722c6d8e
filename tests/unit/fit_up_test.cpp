#include "results.h"
#include "toile/placement/fit_up.h"

#include "garments.h"
#include "shapes.h"
#include "toile/base/parallel.h"
#include "toile/placement/place.h"
#include "toile/placement/relax.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace toile;
using test::codes;
using namespace toile::placement;
using Eigen::Vector3d;
using test::add_rectangle;

namespace {

// A frame far away from the cloth: a support has to be there.
mesh::SupportMesh far_frame() {
  mesh::SupportMesh frame = shapes::sphere(Vector3d(0, -5, 0), 0.1, 1);
  frame.landmarks["a"] = {0, 1, 0};
  frame.landmarks["b"] = {0.4, 1, 0};
  return frame;
}

FrameCurve straight(const Vector3d& a, const Vector3d& b) { return {{{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}}, {}}; }

// An arc about a line along z: from angle -half to half from the top, left to right.
FrameCurve arc(double radius, double half, double z, double y = 0, int pieces = 400) {
  FrameCurve curve;
  for (int i = 0; i <= pieces; ++i) {
    const double angle = half * (2.0 * i / pieces - 1);
    curve.points.push_back({radius * std::sin(angle), y + radius * std::cos(angle), z});
  }
  return curve;
}

double largest_strain(const mesh::GarmentMesh& garment, const Points3& x) { return edge_strain(garment, x).largest; }

}  // namespace

TEST(fit_up, a_panel_between_two_rails_is_a_plane_to_rounding) {
  mesh::GarmentMesh g;
  add_rectangle(g, "sheet", 20, 15, 0.02);
  PlaceParams params;
  params.curves["left"] = straight({0.1, 1.0, 0.2}, {0.1, 1.0, 0.5});  // 0.3 m, as the panel's height
  params.curves["right"] = straight({0.5, 1.0, 0.2}, {0.5, 1.0, 0.5});
  params.lines = {{{"-sheet.left"}, "left"}, {{"sheet.right"}, "right"}};
  const auto placed = place(g, far_frame(), params);
  ASSERT_TRUE(placed) << to_string(placed.issues()[0]);
  EXPECT_TRUE(placed->findings.empty());
  EXPECT_LE(placed->report.max_strain, 1e-9);
  for (const LineGap& gap : placed->line_gaps) EXPECT_LE(gap.largest, 1e-9);
  EXPECT_NEAR(placed->garment.x.col(1).minCoeff(), 1, 1e-9);
  EXPECT_NEAR(placed->lines[0].length, 0.3, 1e-12);
  EXPECT_NEAR(placed->lines[0].curve_length, 0.3, 1e-12);
}

TEST(fit_up, a_panel_on_two_bows_is_a_cylinder_but_for_the_chords) {
  constexpr double radius = 0.3, width = 0.48, length = 0.32;
  for (const double cell : {0.04, 0.02, 0.01}) {
    mesh::GarmentMesh g;
    const int columns = static_cast<int>(std::lround(width / cell)), rows = static_cast<int>(std::lround(length / cell));
    add_rectangle(g, "roof", columns, rows, cell);
    PlaceParams params;
    params.curves["front"] = arc(radius, width / radius / 2, 0);
    params.curves["rear"] = arc(radius, width / radius / 2, -length);
    params.lines = {{{"roof.bottom"}, "front"}, {{"-roof.top"}, "rear"}};
    const auto placed = place(g, far_frame(), params);
    ASSERT_TRUE(placed) << to_string(placed.issues()[0]);
    EXPECT_TRUE(placed->findings.empty());
    const double chord = std::pow(cell * std::sqrt(2) / radius, 2) / 24;
    EXPECT_LE(placed->report.max_strain, std::max(1.5 * chord, 5e-4));
    for (const LineGap& gap : placed->line_gaps) EXPECT_LE(gap.largest, 1e-3);
    double off = 0;
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) off = std::max(off, std::abs(std::hypot(placed->garment.x(v, 0), placed->garment.x(v, 1)) - radius));
    // Chords give the cloth some slack, and slack lets it bow by its root.
    EXPECT_LE(off, 0.004) << cell;
    // The face side looks out.
    const auto& x = placed->garment.x;
    const Vector3d normal = (x.row(g.faces(0, 1)) - x.row(g.faces(0, 0))).transpose().cross((x.row(g.faces(0, 2)) - x.row(g.faces(0, 0))).transpose());
    EXPECT_GT(normal.dot(Vector3d(x(0, 0), x(0, 1), 0)), 0);
  }
}

TEST(fit_up, sewn_panels_over_three_bows_keep_their_lengths_and_close_their_seam) {
  // Two panels end to end, the second turned at the middle bow, as on a roof with a bend.
  constexpr double radius = 0.5, cell = 0.02;
  mesh::GarmentMesh g;
  add_rectangle(g, "fore", 20, 12, cell);
  add_rectangle(g, "aft", 20, 12, cell);
  g.seams.push_back({.id = 0, .name = "across"});
  const auto top = mesh::run_vertex_ids(g, 2), bottom = mesh::run_vertex_ids(g, 4);
  for (std::size_t k = 0; k < top.size(); ++k) g.welds.push_back({top[k], bottom[bottom.size() - 1 - k], 0});
  const double half = 20 * cell / radius / 2, length = 12 * cell;
  PlaceParams params;
  params.curves["header"] = arc(radius, half, 0);
  params.curves["bow"] = arc(radius, half, -length);
  params.curves["rear"] = arc(radius, half, -length - length * std::cos(0.3), -length * std::sin(0.3));
  params.lines = {{{"fore.bottom"}, "header"}, {{"aft.bottom"}, "bow"}, {{"-aft.top"}, "rear"}};
  const auto placed = place(g, far_frame(), params);
  ASSERT_TRUE(placed) << to_string(placed.issues()[0]);
  for (const Issue& finding : placed->findings) ADD_FAILURE() << to_string(finding);
  EXPECT_LE(placed->report.max_strain, params.max_strain);
  EXPECT_LE(placed->report.rms_strain, params.rms_strain);
  EXPECT_LE(placed->report.largest_seam_gap, 4e-3);
  EXPECT_TRUE(placed->report.self_intersections.empty());
  for (const LineGap& gap : placed->line_gaps) EXPECT_LE(gap.largest, 8e-3);
}

TEST(fit_up, a_panel_on_one_rail_hangs_down) {
  mesh::GarmentMesh g;
  add_rectangle(g, "flag", 20, 10, 0.02);
  const auto lines = held_lines(g, far_frame(), {{"rail", {{}, {"b", "a"}}}}, {{{"flag.top"}, "rail"}});
  ASSERT_TRUE(lines) << to_string(lines.issues()[0]);
  const auto x = spread(g, *lines, 0.001);
  ASSERT_TRUE(x);
  EXPECT_LE(largest_strain(g, *x), 1e-9);
  EXPECT_NEAR(x->col(1).minCoeff(), 0.8, 1e-9);
}

TEST(fit_up, threads_do_not_change_a_bit) {
  mesh::GarmentMesh g;
  add_rectangle(g, "roof", 24, 16, 0.02);
  const std::map<std::string, FrameCurve> curves = {{"front", arc(0.3, 0.7, 0)}, {"rear", arc(0.4, 0.6, -0.3)}};
  Points3 first;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    const auto lines = held_lines(g, far_frame(), curves, {{{"roof.bottom"}, "front"}, {{"-roof.top"}, "rear"}});
    ASSERT_TRUE(lines);
    const auto x = spread(g, *lines, 0.001);
    ASSERT_TRUE(x);
    if (first.rows() == 0) first = *x;
    EXPECT_EQ(first, *x);
  }
  set_thread_count(0);
}

TEST(fit_up, says_what_is_missing_all_at_once) {
  mesh::GarmentMesh g;
  add_rectangle(g, "roof", 4, 4, 0.02);
  add_rectangle(g, "window", 4, 4, 0.02);
  const mesh::SupportMesh frame = far_frame();
  EXPECT_EQ(codes(held_lines(g, frame, {{"point", {{{0, 0, 0}, {0, 0, 0}}, {}}}, {"both", {{{0, 0, 0}}, {"a"}}}, {"lost", {{}, {"a", "nowhere"}}}, {"rail", {{}, {"a", "b"}}}},
                             {{{"door.left"}, "rail"}, {{"roof.hem"}, "rail"}, {{"roof.left"}, "rope"}, {{}, "rail"}})),
            "bad_curve unknown_landmark bad_curve unknown_panel unknown_edge unknown_curve unknown_edge");
  PlaceParams params;
  params.curves["rail"] = {{}, {"a", "b"}};
  params.lines = {{{"roof.left"}, "rail"}};
  EXPECT_EQ(codes(place(g, frame, params)), "not_held");
  EXPECT_EQ(codes(place_from(g, g.x, frame, params)), "bad_combination");
  // A line five times as long as its curve cannot lie on it.
  mesh::GarmentMesh one;
  add_rectangle(one, "roof", 50, 4, 0.02);
  params.lines = {{{"roof.bottom"}, "rail"}};
  params.curves["rail"] = straight({0, 1, 0}, {0.2, 1, 0});
  const auto placed = place(one, frame, params);
  ASSERT_TRUE(placed);
  bool told = false;
  for (const Issue& finding : placed->findings) told = told || (finding.code == "line_length" && finding.category == Category::check);
  EXPECT_TRUE(told);
}
