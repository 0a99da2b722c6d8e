// Internal lines of panels: as edges of the mesh, cut out, cut open; diagonals and meshers.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"

using namespace toile;

namespace {

std::vector<pattern::CutPanel> cut(const std::string& yaml) {
  const auto pattern = io::parse_pattern(yaml, "test.yaml");
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
  if (!pattern) return {};
  auto panels = pattern::cut_panels(*pattern);
  EXPECT_TRUE(panels) << (panels ? "" : to_string(panels.issues().front()));
  return panels ? *panels : std::vector<pattern::CutPanel>{};
}

/// 200 x 160 mm, twice (mirrored), with lines.
std::string patch(const std::string& lines, const std::string& more = "") {
  return R"(units: mm
y: up
pieces:
  patch:
    cut: 2
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 160], d: [0, 160], m: [120, 0]}
    outline:
      - {name: bottom, path: [a, m]}
      - {name: bottom_2, path: [m, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
    lines:
)" + lines + more;
}

Result<mesh::GarmentMesh> tried(const std::vector<pattern::CutPanel>& panels, std::vector<std::string> lines, std::vector<std::string> cuts = {}, double cell = 0.01) {
  tailor::MeshParams params;
  params.cell = cell;
  params.lines = std::move(lines);
  params.cut = std::move(cuts);
  return tailor::mesh_panels(panels, params);
}

mesh::GarmentMesh meshed(const std::vector<pattern::CutPanel>& panels, std::vector<std::string> lines, std::vector<std::string> cuts = {}, double cell = 0.01) {
  auto garment = tried(panels, std::move(lines), std::move(cuts), cell);
  EXPECT_TRUE(garment) << (garment ? "" : to_string(garment.issues().front()));
  if (!garment) return {};
  for (const Issue& issue : mesh::validate(*garment)) ADD_FAILURE() << to_string(issue);
  return *garment;
}

std::vector<mesh::RunVertex> row_of(const mesh::GarmentMesh& g, const std::string& name, int panel = 0) {
  std::vector<mesh::RunVertex> rows;
  const auto run = mesh::find_run(g, panel, name);
  EXPECT_TRUE(run) << name;
  if (!run) return rows;
  for (const auto& row : g.run_vertices) {
    if (row.run == *run) rows.push_back(row);
  }
  return rows;
}

int point_vertex(const mesh::GarmentMesh& g, const std::string& name, int panel = 0) {
  for (const auto& point : g.points) {
    if (point.name == name && point.panel == panel) return point.vertex;
  }
  ADD_FAILURE() << "no point " << name;
  return 0;
}

/// Every step of a run is an edge of the mesh, runs of the border are its border and have the cloth on their left.
void expect_runs_are_edges(const mesh::GarmentMesh& g) {
  std::set<std::pair<int, int>> directed;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(directed.insert({g.faces(f, k), g.faces(f, (k + 1) % 3)}).second);
  }
  std::set<std::pair<int, int>> border;
  for (const auto& [a, b] : directed) {
    if (!directed.count({b, a})) border.insert({a, b});
  }
  std::set<std::pair<int, int>> steps;
  for (const auto& run : g.runs) {
    std::vector<mesh::RunVertex> rows;
    for (const auto& row : g.run_vertices) {
      if (row.run == run.id) rows.push_back(row);
    }
    ASSERT_GE(rows.size(), 2u) << run.name;
    EXPECT_EQ(rows.front().s, 0) << run.name;
    EXPECT_EQ(rows.back().s, run.length) << run.name;
    EXPECT_EQ(run.closed, rows.front().vertex == rows.back().vertex) << run.name;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const int a = rows[k - 1].vertex, b = rows[k].vertex;
      EXPECT_GT(rows[k].s, rows[k - 1].s) << run.name;
      // (Places of internal lines within 0.1 mm of each other are one.)
      EXPECT_LE((g.uv.row(a) - g.uv.row(b)).norm(), rows[k].s - rows[k - 1].s + (run.internal ? 1e-4 : 1e-9)) << run.name;
      EXPECT_TRUE(directed.count({a, b})) << run.name << " step " << k;
      if (run.internal) EXPECT_TRUE(directed.count({b, a})) << run.name << " step " << k;
      else steps.insert({a, b});
    }
  }
  EXPECT_EQ(border, steps);
}

void expect_error(const Result<mesh::GarmentMesh>& result, const std::string& code, const std::string& item, const std::string& text) {
  ASSERT_FALSE(result) << "expected " << code;
  const Issue& issue = result.issues().front();
  EXPECT_EQ(issue.code, code) << to_string(issue);
  EXPECT_EQ(issue.place.item, item) << to_string(issue);
  EXPECT_NE(to_string(issue).find(text), std::string::npos) << to_string(issue);
}

/// Both panels hold the same up to u -> -u, run by run and point by point.
void expect_mirrored_pair(const mesh::GarmentMesh& g, double tolerance) {
  for (const auto& run : g.runs) {
    if (run.panel != 0) continue;
    const auto here = row_of(g, run.name, 0), there = row_of(g, run.name, 1);
    EXPECT_EQ(g.runs[static_cast<std::size_t>(there.front().run)].internal, run.internal) << run.name;
    const auto ends = run.internal ? std::pair{there.front(), there.back()} : std::pair{there.back(), there.front()};
    EXPECT_NEAR(g.uv(here.front().vertex, 0), -g.uv(ends.first.vertex, 0), tolerance) << run.name;
    EXPECT_NEAR(g.uv(here.front().vertex, 1), g.uv(ends.first.vertex, 1), tolerance) << run.name;
    EXPECT_NEAR(g.uv(here.back().vertex, 0), -g.uv(ends.second.vertex, 0), tolerance) << run.name;
    EXPECT_NEAR(g.uv(here.back().vertex, 1), g.uv(ends.second.vertex, 1), tolerance) << run.name;
    // The cloth lies on the same side of it.
    if (run.internal) continue;
    const auto side = [&](const std::vector<mesh::RunVertex>& row) {
      for (Eigen::Index f = 0; f < g.face_count(); ++f) {
        for (int k = 0; k < 3; ++k) {
          if (g.faces(f, k) == row[0].vertex && g.faces(f, (k + 1) % 3) == row[1].vertex) return Eigen::Vector2d(g.uv.row(g.faces(f, (k + 2) % 3)) - g.uv.row(row[0].vertex));
        }
      }
      return Eigen::Vector2d(0, 0);
    };
    EXPECT_GT(side(here).norm() * side(there).norm(), 0) << run.name;
  }
  for (const auto& point : g.points) {
    if (point.panel != 0) continue;
    const int other = point_vertex(g, point.name, 1);
    EXPECT_NEAR(g.uv(point.vertex, 0), -g.uv(other, 0), tolerance) << point.name;
    EXPECT_NEAR(g.uv(point.vertex, 1), g.uv(other, 1), tolerance) << point.name;
  }
}

double area_of(const mesh::GarmentMesh& g, int panel) {
  const Eigen::VectorXd areas = mesh::rest_areas(g);
  double sum = 0;
  for (Eigen::Index f = 0; f < areas.size(); ++f) sum += g.face_panel[f] == panel ? areas[f] : 0;
  return sum;
}

}  // namespace

TEST(lines, crossing_lines_share_a_particle) {
  const auto panels = cut(patch(R"(      up: {kind: stitch, path: [[63, 20], [63, 140]]}
      slanting: {kind: fold, path: [[20, 30], {curve: [[90, 50]]}, [180, 130]]}
)"));
  const auto g = meshed(panels, {"patch.up", "patch.slanting"});
  expect_runs_are_edges(g);
  std::set<int> up, common;
  for (const auto& row : row_of(g, "up")) up.insert(row.vertex);
  for (const auto& row : row_of(g, "slanting")) {
    if (up.count(row.vertex)) common.insert(row.vertex);
  }
  ASSERT_EQ(common.size(), 1u);
  EXPECT_NEAR(g.uv(*common.begin(), 0), 0.063, 1e-9);
  EXPECT_GE(tailor::angle_report(g).least, 20);
  expect_mirrored_pair(g, 0);
}

TEST(lines, ends_meet_borders_lines_and_corners) {
  const auto panels = cut(patch(R"(      chest: {path: [[0, 95], [200, 105]]}
      stem: {path: [[77, 20], [77, 98.85]]}
      to_corner: {path: [[40, 97], a]}
      from_stem: {path: [[77, 60], [150, 40], m]}
)"));
  const auto g = meshed(panels, {"*.*"});
  expect_runs_are_edges(g);
  const auto chest = row_of(g, "chest"), stem = row_of(g, "stem");
  const auto has = [](const std::vector<mesh::RunVertex>& row, int v) { return std::any_of(row.begin(), row.end(), [&](const auto& r) { return r.vertex == v; }); };
  EXPECT_TRUE(has(row_of(g, "left"), chest.front().vertex));
  EXPECT_TRUE(has(row_of(g, "right"), chest.back().vertex));
  EXPECT_TRUE(has(chest, stem.back().vertex));
  EXPECT_TRUE(has(chest, row_of(g, "to_corner").front().vertex));
  EXPECT_EQ(row_of(g, "to_corner").back().vertex, point_vertex(g, "a"));
  EXPECT_TRUE(has(stem, row_of(g, "from_stem").front().vertex));
  EXPECT_EQ(row_of(g, "from_stem").back().vertex, point_vertex(g, "m"));
}

TEST(lines, closed_lines_are_closed_runs_with_their_corners) {
  const auto panels = cut(patch(R"(      pocket: {kind: placement, path: [[33, 31], [97, 31], [97, 87], [33, 87], [33, 31]]}
      disc: {kind: placement, path: [[150, 60], {arc: {through: [170, 80]}}, [150, 100], {arc: {through: [130, 80]}}, [150, 60]]}
)"));
  const auto g = meshed(panels, {"patch.*"});
  expect_runs_are_edges(g);
  for (const char* name : {"pocket", "disc"}) EXPECT_TRUE(g.runs[static_cast<std::size_t>(row_of(g, name).front().run)].closed) << name;
  std::set<std::pair<double, double>> corners;
  for (const auto& row : row_of(g, "pocket")) corners.insert({std::round(g.uv(row.vertex, 0) * 1e6) / 1e3, std::round(g.uv(row.vertex, 1) * 1e6) / 1e3});
  for (double x : {33.0, 97.0}) {
    for (double y : {31.0, 87.0}) EXPECT_TRUE(corners.count({x, y})) << x << " " << y;
  }
  for (const auto& row : row_of(g, "disc")) EXPECT_NEAR((g.uv.row(row.vertex) - Eigen::RowVector2d(0.15, 0.08)).norm(), 0.02, 1e-9);
  EXPECT_GE(tailor::angle_report(g).least, 20);
  EXPECT_EQ(mesh::euler_number(g.faces), 2);
}

TEST(lines, wildcards_stand_for_any_letters) {
  const auto panels = cut(patch("      fold_low: {path: [[20, 30], [180, 30]]}\n      fold_high: {path: [[20, 120], [180, 120]]}\n      other: {path: [[100, 50], [100, 100]]}\n"));
  const auto internal = [](const mesh::GarmentMesh& g) {
    std::set<std::string> names;
    for (const auto& run : g.runs) {
      if (run.internal) names.insert(g.panels[static_cast<std::size_t>(run.panel)].name + "." + run.name);
    }
    return names;
  };
  EXPECT_EQ(internal(meshed(panels, {"*.fold_*"})), (std::set<std::string>{"patch.fold_low", "patch.fold_high", "patch_m.fold_low", "patch_m.fold_high"}));
  EXPECT_EQ(internal(meshed(panels, {"*_m.*"})), (std::set<std::string>{"patch_m.fold_low", "patch_m.fold_high", "patch_m.other"}));
  EXPECT_EQ(internal(meshed(panels, {"p*.o*r"})), (std::set<std::string>{"patch.other", "patch_m.other"}));
  EXPECT_EQ(internal(meshed(panels, {"nothing.*"})), std::set<std::string>{});
  expect_error(tried(panels, {"patch.fold_hi"}), "unknown_line", "lines", "did you mean 'patch.fold_high'?");
}

TEST(lines, one_that_runs_along_another_is_refused_with_its_place) {
  const auto along_edge = cut(patch("      facing: {path: [[20, 30], [60, 0], [110, 0], [110, 40]]}\n"));
  expect_error(tried(along_edge, {"patch.facing"}), "line_along_line", "patch.facing", "it runs along edge 'bottom' from (6.0");
  const auto along_line = cut(patch("      one: {path: [[20, 30], [150, 30]]}\n      two: {path: [[60, 30], [90, 30], [90, 80]]}\n"));
  expect_error(tried(along_line, {"*.*"}), "line_along_line", "patch.two", "along line 'one' from (6.0");
  EXPECT_TRUE(tried(along_line, {"*.one"}));
}

TEST(lines, marks_are_particles_wherever_they_lie) {
  const auto panels = cut(patch("      fold: {path: [[20, 30], [180, 130]]}\n", "    marks:\n      drill: {kind: drill, at: [33.3, 91.7]}\n      on_line: {kind: button, at: [100, 80]}\n      twin: {kind: snap, at: [33.3, 91.7]}\n"));
  const auto g = meshed(panels, {"*.*"});
  EXPECT_NEAR(g.uv(point_vertex(g, "drill"), 0), 0.0333, 1e-12);
  EXPECT_EQ(point_vertex(g, "drill"), point_vertex(g, "twin"));
  const auto fold = row_of(g, "fold");
  EXPECT_TRUE(std::any_of(fold.begin(), fold.end(), [&](const auto& row) { return row.vertex == point_vertex(g, "on_line"); }));
}

TEST(lines, narrow_lenses_keep_two_sides) {
  // Two lines between the same two points, nearer to each other than a cell and as short as one.
  const auto panels = cut(patch("      one: {path: [[60, 60], {curve: [[67, 66]]}, [74, 60]]}\n      two: {path: [[60, 60], {curve: [[67, 54]]}, [74, 60]]}\n"));
  const auto g = meshed(panels, {"*.*"}, {}, 0.02);
  expect_runs_are_edges(g);
  EXPECT_GE(row_of(g, "one").size(), 3u);
  const auto holed = meshed(panels, {}, {"*.one", "*.two"}, 0.02);
  expect_runs_are_edges(holed);
  EXPECT_EQ(mesh::euler_number(holed.faces), 0);
}

TEST(cuts, fish_eye_dart_becomes_a_hole_with_two_legs) {
  const std::string dart = "      dart: {kind: dart, path: [[70, 30], {curve: [[61, 75]]}, [70, 130], {curve: [[79, 75]]}, [70, 30]]}\n";
  const auto panels = cut(patch(dart, "    marks:\n      drill: {kind: drill, at: [70, 80]}\n      button: {kind: button, at: [150, 80]}\n"));
  for (double cell : {0.02, 0.01, 0.005, 0.002}) {
    const auto g = meshed(panels, {}, {"*.dart"}, cell);
    expect_runs_are_edges(g);
    const auto left = row_of(g, "dart_1"), right = row_of(g, "dart_2");
    EXPECT_EQ(left.size(), right.size());
    EXPECT_EQ(left.front().vertex, right.back().vertex);
    EXPECT_EQ(left.back().vertex, right.front().vertex);
    EXPECT_NEAR(g.uv(left.back().vertex, 1) + g.uv(left.front().vertex, 1), 0.16, 1e-9);
    EXPECT_EQ(mesh::euler_number(g.faces), 0);  // two rings
    EXPECT_LT(g.panels[0].cut_area, 0.2 * 0.16);
    EXPECT_NEAR(area_of(g, 0) / g.panels[0].cut_area, 1, 0.02 * cell / 0.02);
    EXPECT_GE(tailor::angle_report(g).least, 20) << "cell " << cell;
    EXPECT_TRUE(std::none_of(g.points.begin(), g.points.end(), [](const auto& p) { return p.name == "drill"; }));
    point_vertex(g, "button");
    expect_mirrored_pair(g, 0);
  }
}

TEST(cuts, sharp_tips_are_meshed_well) {
  for (double width : {0.2, 1.0, 3.0, 12.0, 30.0}) {
    const std::string dart = fmt::format("      dart: {{kind: dart, path: [[70.3, 20], [{}, 84], [70.3, 141.7], [{}, 84], [70.3, 20]]}}\n", 70.3 + width, 70.3 - width);
    const auto g = meshed(cut(patch(dart)), {}, {"*.*"});
    expect_runs_are_edges(g);
    EXPECT_GE(tailor::angle_report(g).least, 20) << "half width " << width;
    EXPECT_EQ(row_of(g, "dart_1").size(), row_of(g, "dart_2").size());
  }
}

TEST(cuts, open_lines_that_close_are_cut_out_under_their_own_names) {
  const auto panels = cut(patch("      leg_left: {kind: dart, path: [[70, 30], {curve: [[61, 75]]}, [70, 130]]}\n      leg_right: {kind: dart, path: [[70, 30], {curve: [[79, 75]]}, [70, 130]]}\n"));
  const auto g = meshed(panels, {}, {"*.*"});
  expect_runs_are_edges(g);
  EXPECT_EQ(mesh::euler_number(g.faces), 0);
  EXPECT_EQ(row_of(g, "leg_left").front().vertex, row_of(g, "leg_right").back().vertex);
  // Without the second leg the first is a slit.
  const auto slit = meshed(panels, {}, {"*.leg_left"});
  expect_runs_are_edges(slit);
  EXPECT_EQ(row_of(slit, "leg_left").front().vertex, row_of(slit, "leg_left_r").back().vertex);
}

TEST(cuts, windows_have_an_edge_for_each_side_and_discs_have_one) {
  const auto panels = cut(patch("      window: {kind: cut, path: [[43, 31], [97, 31], [97, 87], [33, 87], [43, 31]]}\n      disc: {kind: cut, path: [[150, 60], {arc: {through: [170, 80]}}, [150, 100], {arc: {through: [130, 80]}}, [150, 60]]}\n"));
  const auto g = meshed(panels, {}, {"*.*"});
  expect_runs_are_edges(g);
  // Holes run clockwise: cloth on their left.
  EXPECT_NEAR(g.uv(row_of(g, "window_1").front().vertex, 0), 0.097, 1e-9);
  EXPECT_NEAR(g.uv(row_of(g, "window_1").back().vertex, 0), 0.043, 1e-9);
  row_of(g, "window_4");
  EXPECT_TRUE(g.runs[static_cast<std::size_t>(row_of(g, "disc").front().run)].closed);
  EXPECT_NEAR(g.panels[0].cut_area, 0.032 - 0.056 * 0.059 - std::numbers::pi * 4e-4, 1e-9);
  EXPECT_EQ(mesh::euler_number(g.faces), -2);
}

TEST(cuts, lines_end_at_what_is_cut_out) {
  const auto panels = cut(patch(R"(      dart: {kind: dart, path: [[70, 30], {curve: [[61, 75]]}, [70, 130], {curve: [[79, 75]]}, [70, 30]]}
      waist: {kind: placement, path: [[0, 84], [200, 81]]}
      middle: {kind: dart, path: [[70, 50], [70, 110]]}
      below: {kind: placement, path: [[70, 10], [70, 100]]}
)"));
  const auto g = meshed(panels, {"*.waist", "*.below", "*.m*"}, {"*.dart"});
  expect_runs_are_edges(g);
  EXPECT_LT(g.uv(row_of(g, "waist_1").back().vertex, 0), 0.07);
  EXPECT_GT(g.uv(row_of(g, "waist_2").front().vertex, 0), 0.07);
  EXPECT_NEAR(g.uv(row_of(g, "below").back().vertex, 1), 0.03, 1e-9);
  for (const auto& run : g.runs) EXPECT_FALSE(run.name.starts_with("middle"));
  expect_error(tried(panels, {"patch.middle"}, {"*.dart"}), "line_cut_away", "patch.middle", "lies in what is cut out");
}

TEST(cuts, slits_double_their_vertices) {
  const auto panels = cut(patch("      buttonhole: {kind: cut, path: [[52, 90], [85, 94]]}\n", "    marks:\n      middle: {kind: buttonhole, at: [68.5, 92]}\n"));
  const auto plain = meshed(panels, {"*.buttonhole"}), g = meshed(panels, {}, {"patch.buttonhole"});
  expect_runs_are_edges(g);
  EXPECT_EQ(g.face_count(), plain.face_count());
  const auto side = row_of(g, "buttonhole"), other = row_of(g, "buttonhole_r");
  ASSERT_EQ(side.size(), other.size());
  EXPECT_EQ(g.vertex_count(), plain.vertex_count() + 2 * (static_cast<int>(side.size()) - 2));
  for (std::size_t k = 0; k < side.size(); ++k) {
    const auto& twin = other[other.size() - 1 - k];
    EXPECT_EQ(g.uv.row(side[k].vertex), g.uv.row(twin.vertex));
    EXPECT_EQ(side[k].vertex == twin.vertex, k == 0 || k + 1 == side.size());
    EXPECT_NEAR(side[k].s + twin.s, g.runs[static_cast<std::size_t>(side[0].run)].length, 1e-12);
  }
  // The named side has the cloth on the left of the drawn line.
  EXPECT_LT(g.uv(side.front().vertex, 0), g.uv(side.back().vertex, 0));
  EXPECT_NE(point_vertex(g, "middle"), point_vertex(g, "middle_r"));
  EXPECT_TRUE(std::any_of(side.begin(), side.end(), [&](const auto& row) { return row.vertex == point_vertex(g, "middle"); }));
  EXPECT_EQ(mesh::euler_number(g.faces), 0);
  expect_mirrored_pair(g, 0);
}

TEST(cuts, slits_open_at_the_border_where_edges_meet) {
  const auto panels = cut(patch("      vent: {kind: cut, path: [m, [110, 70]]}\n      pleat: {path: [[60, 20], [112, 52]]}\n"));
  const auto g = meshed(panels, {"*.pleat"}, {"*.vent"});
  // (The pleat ends beside the vent and is whole.)
  expect_runs_are_edges(g);
  EXPECT_EQ(mesh::euler_number(g.faces), 2);
  const auto left = row_of(g, "bottom"), right = row_of(g, "bottom_2"), side = row_of(g, "vent"), other = row_of(g, "vent_r");
  EXPECT_NE(left.back().vertex, right.front().vertex);
  EXPECT_EQ(left.back().vertex, side.front().vertex);
  EXPECT_EQ(other.back().vertex, right.front().vertex);
  EXPECT_EQ(side.back().vertex, other.front().vertex);
  EXPECT_EQ(point_vertex(g, "m"), left.back().vertex);
  EXPECT_EQ(point_vertex(g, "m_r"), right.front().vertex);
}

TEST(cuts, what_cannot_be_cut_is_said_with_its_place) {
  const auto into_edge = cut(patch("      vent: {kind: cut, path: [[60, 0], [60, 70]]}\n"));
  expect_error(tried(into_edge, {}, {"*.vent"}), "cut_splits_edge", "patch.bottom", "at (6.00, 0.00) cm");
  const auto across = cut(patch("      vent: {kind: cut, path: [[60, 20], [60, 120]]}\n      waist: {path: [[20, 80], [150, 80]]}\n"));
  expect_error(tried(across, {"*.*"}, {"*.vent"}), "cut_crosses_line", "patch.waist", "at (6.00, 8.00) cm");
  const auto meeting = cut(patch("      vent: {kind: cut, path: [[60, 20], [60, 120]]}\n      side: {kind: cut, path: [[20, 80], [60, 80]]}\n"));
  expect_error(tried(meeting, {}, {"*.*"}), "cut_crosses_line", "patch.vent", "at (6.00, 8.00) cm");
  const auto through = cut(patch("      left_leg: {kind: dart, path: [[100, 90], a]}\n      right_leg: {kind: dart, path: [[100, 90], m]}\n"));
  expect_error(tried(through, {}, {"*.*"}), "cut_off", "patch.left_leg", "takes a piece off");
  const auto touching = cut(patch("      dart: {kind: dart, path: [[70, 0], [80, 60], [70, 130], [60, 60], [70, 0]]}\n"));
  expect_error(tried(touching, {}, {"*.*"}), "cut_crosses", "patch.dart_1", "at (7.00, 0.00) cm");
  const auto two = cut(patch("      one: {kind: cut, path: [[70, 20], [90, 60], [70, 130], [60, 60], [70, 20]]}\n      two: {kind: cut, path: [[80, 50], [120, 50], [120, 80], [80, 80], [80, 50]]}\n"));
  const auto both = tried(two, {}, {"*.*"});
  ASSERT_FALSE(both);
  EXPECT_EQ(both.issues().front().code, "cut_crosses");
  const auto clash = cut(patch("      vent: {kind: cut, path: [[60, 20], [60, 120]]}\n      vent_r: {path: [[20, 80], [40, 80]]}\n"));
  expect_error(tried(clash, {"*.*"}, {"*.vent"}), "duplicate_name", "patch.vent_r", "rename");
}

TEST(cuts, wildcards_cut_only_what_is_drawn_to_be_cut) {
  const auto panels = cut(patch("      slit: {kind: cut, path: [[60, 20], [60, 120]]}\n      waist: {path: [[80, 80], [150, 80]]}\n"));
  const auto g = meshed(panels, {}, {"*.*"});
  row_of(g, "slit_r");
  for (const auto& run : g.runs) EXPECT_NE(run.name, "waist");
  row_of(meshed(panels, {}, {"*.slit", "patch.waist"}), "waist_r");
}

TEST(cuts, copies_meshed_on_their_own_keep_the_names_of_sides) {
  const auto panels = cut(patch("      slit: {kind: cut, path: [[52, 90], [85, 94]]}\n      dart: {kind: dart, path: [[150, 30], {curve: [[141, 75]]}, [150, 130], {curve: [[162, 75]]}, [150, 30]]}\n      line: {path: [[10, 20], [100, 40]]}\n"));
  tailor::MeshParams params;
  params.lines = {"*.line"};
  params.cut = {"*.*"};
  params.panels["patch_m"].cell = 0.0105;
  const auto g = tailor::mesh_panels(panels, params);
  ASSERT_TRUE(g) << to_string(g.issues().front());
  expect_runs_are_edges(*g);
  expect_mirrored_pair(*g, 1e-9);
}

namespace {

/// Half a front on the fold with everything that can be drawn.
const char* const busy_front = R"(units: mm
y: up
pieces:
  front:
    cut: 1
    fold: centre
    grain: fold
    points: {a: [0, 0], b: [180, 0], c: [170, 350], d: [60, 420], e: [0, 380], v: [0, 250]}
    outline:
      - {name: hem, path: [a, b]}
      - {name: side, path: [b, {curve: [[195, 120], [140, 250]]}, c]}
      - {name: shoulder, path: [c, d]}
      - {name: neck, path: [d, {curve: [[50, 385]]}, e]}
      - {name: centre, path: [e, a]}
    lines:
      cf: {kind: fold, path: [[0, 20], [0, 250]]}
      slit: {kind: cut, path: [e, [0, 300]]}
      waist: {kind: placement, path: [[0, 150], {curve: [[90, 140]]}, [166, 160]]}
      turn: {kind: fold, path: [[0, 40], [155, 330]]}
      pocket: {kind: placement, path: [[40, 40], [110, 40], [110, 110], {curve: [[75, 130]]}, [40, 110], [40, 40]]}
      disc: {kind: stitch, path: [[100, 300], {arc: {through: [120, 320]}}, [100, 340], {arc: {through: [80, 320]}}, [100, 300]]}
      dart: {kind: dart, path: [[70, 80], {curve: [[62, 150]]}, [70, 230], {curve: [[78, 150]]}, [70, 80]]}
      keyhole: {kind: cut, path: [[0, 200], {curve: [[20, 215]]}, [0, 230]]}
      buttonhole: {kind: cut, path: [[120, 200], [140, 200]]}
      t: {kind: stitch, path: [[130, 160], [130, 60]]}
    marks:
      button: {kind: button, at: [0, 90]}
      drill: {kind: drill, at: [70, 160]}
)";

}  // namespace

TEST(cuts, unfolded_panels_with_lines_and_cuts_are_symmetric) {
  const auto panels = cut(busy_front);
  for (const auto mesher : {tailor::Mesher::grid, tailor::Mesher::delaunay}) {
    tailor::MeshParams params;
    params.mesher = mesher;
    params.lines = {"*.*"};
    params.cut = {"*.*"};
    const auto g = tailor::mesh_panels(panels, params);
    ASSERT_TRUE(g) << to_string(g.issues().front());
    expect_runs_are_edges(*g);
    // Two darts, two buttonholes, one keyhole across the fold; the slit at the neck opens the border.
    EXPECT_EQ(mesh::euler_number(g->faces), 1 - 5);
    std::map<std::pair<double, double>, int> places;
    for (Eigen::Index v = 0; v < g->vertex_count(); ++v) ++places[{g->uv(v, 0), g->uv(v, 1)}];
    for (const auto& [at, count] : places) {
      const auto twin = places.find({-at.first, at.second});
      ASSERT_TRUE(twin != places.end()) << at.first << " " << at.second;
      EXPECT_EQ(twin->second, count);
    }
    // The slit on the fold: its sides are each other's mirror image.
    EXPECT_EQ(row_of(*g, "slit").size(), row_of(*g, "slit_r").size());
    EXPECT_EQ(row_of(*g, "keyhole").size(), row_of(*g, "keyhole_m").size());
    EXPECT_NEAR(g->uv(row_of(*g, "cf_1").back().vertex, 1), 0.2, 1e-9);
    EXPECT_NEAR(g->uv(row_of(*g, "cf_2").front().vertex, 1), 0.23, 1e-9);
    EXPECT_GE(tailor::angle_report(*g).least, 20);
  }
}

TEST(cuts, same_bytes_at_any_thread_count) {
  const auto panels = cut(busy_front);
  std::string first;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    const auto bytes = io::format_garment(meshed(panels, {"*.*"}, {"*.*"}), io::Encoding::ascii);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
  set_thread_count(0);
}

TEST(lines, random_networks_are_followed) {
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    Rng rng(seed);
    std::string lines;
    const int count = 2 + static_cast<int>(rng.below(6));
    for (int k = 0; k < count; ++k) {
      const auto x = [&] { return rng.uniform(12, 188); };
      const auto y = [&] { return rng.uniform(12, 148); };
      if (rng.below(2) == 0) lines += fmt::format("      l{}: {{path: [[{}, {}], {{curve: [[{}, {}]]}}, [{}, {}]]}}\n", k, x(), y(), x(), y(), x(), y());
      else lines += fmt::format("      l{}: {{path: [[{}, {}], [{}, {}]]}}\n", k, x(), y(), x(), y());
    }
    const auto panels = cut(patch(lines));
    for (double cell : {0.015, 0.006}) {
      const auto g = tried(panels, {"*.*"}, {}, cell);
      ASSERT_TRUE(g) << "seed " << seed << ": " << to_string(g.issues().front());
      expect_runs_are_edges(*g);
      EXPECT_EQ(mesh::euler_number(g->faces), 2) << seed;
      EXPECT_NEAR(area_of(*g, 0), 0.032, 1e-12);
      // On the curve: the runs' vertices are where their arc lengths say.
      for (const auto& row : g->run_vertices) {
        const auto& run = g->runs[static_cast<std::size_t>(row.run)];
        if (run.panel != 0 || !run.internal) continue;
        for (const auto& line : panels[0].lines) {
          if (line.name != run.name) continue;
          EXPECT_LT((line.curve.point_at(row.s) - g->uv.row(row.vertex).transpose()).norm(), 1.1e-4);
        }
      }
    }
  }
}

TEST(diagonals, the_shorter_one_is_taken_where_corners_moved) {
  // Both meshes have the same vertices; a cell whose corners are where they were alternates.
  const auto panels = cut(busy_front);
  tailor::MeshParams params;
  params.lines = {"*.*"};
  const auto alternating = tailor::mesh_panels(panels, params);
  params.diagonal = tailor::Diagonal::shorter;
  const auto shorter = tailor::mesh_panels(panels, params);
  ASSERT_TRUE(alternating && shorter);
  ASSERT_EQ(alternating->uv, shorter->uv);
  EXPECT_EQ(alternating->face_count(), shorter->face_count());
  EXPECT_GE(tailor::angle_report(*shorter).least, 20);
  std::set<std::pair<int, int>> before, after;
  for (const auto& edge : mesh::edges(alternating->faces)) before.insert({edge.a, edge.b});
  for (const auto& edge : mesh::edges(shorter->faces)) after.insert({edge.a, edge.b});
  std::vector<double> gone, fresh;
  for (const auto& e : before) {
    if (!after.count(e)) gone.push_back((shorter->uv.row(e.first) - shorter->uv.row(e.second)).norm());
  }
  for (const auto& e : after) {
    if (!before.count(e)) fresh.push_back((shorter->uv.row(e.first) - shorter->uv.row(e.second)).norm());
  }
  ASSERT_EQ(gone.size(), fresh.size());
  ASSERT_FALSE(gone.empty());
  std::sort(gone.begin(), gone.end());
  std::sort(fresh.begin(), fresh.end());
  for (std::size_t k = 0; k < gone.size(); ++k) EXPECT_LT(fresh[k], gone[k]);
}

TEST(meshers, delaunay_has_the_same_border_and_as_many_particles) {
  const auto panels = cut(busy_front);
  for (double cell : {0.01, 0.006, 0.003}) {
    tailor::MeshParams params;
    params.cell = cell;
    params.lines = {"*.*"};
    const auto grid = tailor::mesh_panels(panels, params);
    params.mesher = tailor::Mesher::delaunay;
    const auto delaunay = tailor::mesh_panels(panels, params);
    ASSERT_TRUE(grid && delaunay);
    expect_runs_are_edges(*delaunay);
    ASSERT_EQ(grid->runs.size(), delaunay->runs.size());
    for (std::size_t r = 0; r < grid->runs.size(); ++r) {
      EXPECT_EQ(grid->runs[r].name, delaunay->runs[r].name);
      EXPECT_EQ(grid->runs[r].length, delaunay->runs[r].length);
    }
    ASSERT_EQ(grid->points.size(), delaunay->points.size());
    for (std::size_t p = 0; p < grid->points.size(); ++p) {
      EXPECT_EQ(grid->points[p].name, delaunay->points[p].name);
      EXPECT_EQ(grid->uv.row(grid->points[p].vertex), delaunay->uv.row(delaunay->points[p].vertex));
    }
    EXPECT_NEAR(static_cast<double>(delaunay->face_count()) / static_cast<double>(grid->face_count()), 1, 0.12) << cell;
    EXPECT_GE(tailor::angle_report(*delaunay).least, 20) << cell;
    EXPECT_GE(tailor::angle_report(*delaunay).median, 48) << cell;
  }
}

TEST(meshers, curves_get_more_particles_for_a_smaller_turn) {
  const auto panels = cut(patch("      disc: {path: [[150, 60], {arc: {through: [170, 80]}}, [150, 100], {arc: {through: [130, 80]}}, [150, 60]]}\n"));
  std::size_t last = 0;
  for (double turn : {1.0, 0.4, 0.2}) {
    tailor::MeshParams params;
    params.cell = 0.012;
    params.lines = {"*.*"};
    params.turn = turn;
    const auto g = tailor::mesh_panels(panels, params);
    ASSERT_TRUE(g);
    const std::size_t count = row_of(*g, "disc").size() - 1;
    EXPECT_GT(count, last);
    EXPECT_LE(2 * std::numbers::pi / static_cast<double>(count), 1.15 * turn);
    last = count;
  }
}
