#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "patterns.h"
#include "toile/base/parallel.h"
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
  EXPECT_TRUE(panels);
  return panels ? *panels : std::vector<pattern::CutPanel>{};
}

std::string rectangle(double width, double height, const std::string& more = "") {
  return fmt::format(R"(units: mm
y: up
pieces:
  patch:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {{a: [0, 0], b: [{0}, 0], c: [{0}, {1}], d: [0, {1}]}}
    outline:
      - {{name: bottom, path: [a, b]}}
      - {{name: right, path: [b, c]}}
      - {{name: top, path: [c, d]}}
      - {{name: left, path: [d, a]}}
{2})", width, height, more);
}

mesh::GarmentMesh meshed(const std::vector<pattern::CutPanel>& panels, tailor::MeshParams params = {}) {
  auto garment = tailor::mesh_panels(panels, params);
  EXPECT_TRUE(garment) << (garment ? "" : to_string(garment.issues().front()));
  if (!garment) return {};
  for (const Issue& issue : mesh::validate(*garment)) ADD_FAILURE() << to_string(issue);
  return *garment;
}

int point_vertex(const mesh::GarmentMesh& g, const std::string& name, int panel = 0) {
  for (const auto& point : g.points) {
    if (point.name == name && point.panel == panel) return point.vertex;
  }
  ADD_FAILURE() << "no point " << name;
  return 0;
}

/// Every border edge of the mesh is one step of exactly one run, and runs have no other steps.
void expect_runs_cover_border(const mesh::GarmentMesh& g) {
  std::set<std::pair<int, int>> border, steps;
  for (const auto& edge : mesh::edges(g.faces)) {
    if (edge.faces.size() == 1) border.insert({edge.a, edge.b});
  }
  for (const auto& run : g.runs) {
    if (run.internal) continue;
    double last = -1;
    std::vector<mesh::RunVertex> rows;
    for (const auto& row : g.run_vertices) {
      if (row.run == run.id) rows.push_back(row);
    }
    ASSERT_GE(rows.size(), 2u);
    EXPECT_EQ(rows.front().s, 0);
    EXPECT_EQ(rows.back().s, run.length);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      EXPECT_GT(rows[k].s, last);
      last = rows[k].s;
      if (k == 0) continue;
      const auto step = std::minmax(rows[k - 1].vertex, rows[k].vertex);
      EXPECT_TRUE(steps.insert({step.first, step.second}).second);
    }
  }
  EXPECT_EQ(border, steps);
}

}  // namespace

TEST(mesh_panels, rectangle_of_whole_cells_is_the_plain_grid) {
  const auto g = meshed(cut(rectangle(40, 30)));
  EXPECT_EQ(g.vertex_count(), 5 * 4);
  EXPECT_EQ(g.face_count(), 2 * 4 * 3);
  for (double area : mesh::rest_areas(g)) EXPECT_NEAR(area, 0.5e-4, 1e-15);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(g.uv(v, k) * 100, std::round(g.uv(v, k) * 100), 1e-9);
  }
  EXPECT_NEAR(g.panels[0].cut_area, 0.04 * 0.03, 1e-15);
  EXPECT_EQ(g.panels[0].cell_warp, 0.01);
  expect_runs_cover_border(g);
}

TEST(mesh_panels, panels_know_their_material_and_allowances) {
  std::string yaml = test::half_front;
  yaml.replace(yaml.find("    fold: centre"), 0, "    allowance: 10\n");
  yaml.replace(yaml.find("path: [a, b]"), 12, "path: [a, b], allowance: 30");
  const auto g = meshed(cut(yaml));
  EXPECT_EQ(g.panels[0].material, "jersey");
  for (const mesh::Run& run : g.runs) EXPECT_DOUBLE_EQ(run.allowance, run.name.starts_with("hem") ? 0.03 : 0.01) << run.name;
  double strips = 0;
  for (const mesh::Run& run : g.runs) strips += run.length * run.allowance;
  EXPECT_NEAR(g.panels[0].allowance_area, strips, 0.1 * strips);
  EXPECT_GT(g.panels[0].allowance_area, strips);
}

TEST(mesh_panels, diagonal_rule_is_followed) {
  const auto slopes = [](const mesh::GarmentMesh& g) {
    std::set<std::pair<int, int>> up, down;  // cells by the direction of their diagonal
    for (const auto& edge : mesh::edges(g.faces)) {
      const Eigen::Vector2d d = (g.uv.row(edge.b) - g.uv.row(edge.a)) * 100, m = (g.uv.row(edge.b) + g.uv.row(edge.a)) * 50;
      if (std::abs(d.x() * d.y()) < 0.5) continue;
      (d.x() * d.y() > 0 ? up : down).insert({static_cast<int>(std::floor(m.x())), static_cast<int>(std::floor(m.y()))});
    }
    return std::pair{up, down};
  };
  tailor::MeshParams params;
  params.diagonal = tailor::Diagonal::single;
  const auto [single_up, single_down] = slopes(meshed(cut(rectangle(50, 40)), params));
  EXPECT_EQ(single_up.size(), 20u);
  EXPECT_EQ(single_down.size(), 0u);
  params.diagonal = tailor::Diagonal::alternating;
  const auto [up, down] = slopes(meshed(cut(rectangle(50, 40)), params));
  EXPECT_EQ(up.size(), 10u);
  EXPECT_EQ(down.size(), 10u);
  for (const auto& [i, j] : up) EXPECT_EQ((i + j) % 2, 0);
}

TEST(mesh_panels, cells_may_differ_along_warp_and_weft) {
  tailor::MeshParams params;
  params.cell_warp = 0.005;
  const auto g = meshed(cut(rectangle(40, 30)), params);
  EXPECT_EQ(g.vertex_count(), 5 * 7);
  EXPECT_EQ(g.panels[0].cell_warp, 0.005);
  EXPECT_EQ(g.panels[0].cell_weft, 0.01);
}

TEST(mesh_panels, border_lies_on_the_true_curve) {
  // A half disc: the arc's vertices keep the radius although the mesh is coarse.
  const auto panels = cut(R"(units: mm
y: up
pieces:
  half:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [-100, 0], b: [100, 0]}
    outline:
      - {name: straight, path: [a, b]}
      - {name: arc, path: [b, {arc: {through: [0, 100]}}, a]}
)");
  tailor::MeshParams params;
  params.cell = 0.02;
  const auto g = meshed(panels, params);
  expect_runs_cover_border(g);
  const double length = 0.1 * std::numbers::pi;
  EXPECT_NEAR(g.runs[1].length, length, 1e-12);
  for (const auto& row : g.run_vertices) {
    if (row.run != 1) continue;
    EXPECT_NEAR(g.uv.row(row.vertex).norm(), 0.1, 1e-12);
    const double angle = row.s / 0.1;
    EXPECT_NEAR(g.uv(row.vertex, 0), 0.1 * std::cos(angle), 1e-9);
    EXPECT_NEAR(g.uv(row.vertex, 1), 0.1 * std::sin(angle), 1e-9);
  }
  EXPECT_NEAR(g.panels[0].cut_area, 0.5 * std::numbers::pi * 0.01, 1e-12);
}

TEST(mesh_panels, border_stands_on_grid_lines_where_spacing_allows) {
  // A straight slanted side that crosses one weft line per cell: every vertex but the ends can be a crossing.
  const auto panels = cut(R"(units: mm
y: up
pieces:
  slanted:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [100, 0], c: [107, 200], d: [0, 200]}
    outline:
      - {name: bottom, path: [a, b]}
      - {name: side, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
)");
  const auto g = meshed(panels);
  int on_line = 0, inner = 0;
  for (const auto& row : g.run_vertices) {
    if (g.runs[row.run].name != "side" || row.s == 0 || row.s == g.runs[row.run].length) continue;
    ++inner;
    const double v = g.uv(row.vertex, 1) * 100;
    on_line += std::abs(v - std::round(v)) < 1e-9;
  }
  EXPECT_EQ(inner, 19);
  EXPECT_EQ(on_line, 19);
}

TEST(mesh_panels, named_points_notches_and_marks_are_vertices) {
  const auto panels = cut(test::half_front);
  const auto g = meshed(panels);
  expect_runs_cover_border(g);
  for (const auto& notch : panels[0].notches) EXPECT_NEAR((g.uv.row(point_vertex(g, notch.name)).transpose() - notch.at).norm(), 0, 1e-12) << notch.name;
  for (const auto& mark : panels[0].marks) EXPECT_NEAR((g.uv.row(point_vertex(g, mark.name)).transpose() - mark.at).norm(), 0, 1e-12) << mark.name;
  for (const char* corner : {"a", "b", "c", "d", "e", "b_m", "c_m", "d_m"}) point_vertex(g, corner);
  EXPECT_GE(tailor::angle_report(g).least, 20);
}

TEST(mesh_panels, internal_lines_become_edges_when_asked) {
  tailor::MeshParams params;
  params.lines = {"front.chest"};
  const auto panels = cut(test::half_front);
  const auto g = meshed(panels, params);
  int lines = 0;
  std::set<std::pair<int, int>> edges;
  for (const auto& edge : mesh::edges(g.faces)) edges.insert({edge.a, edge.b});
  for (const auto& run : g.runs) {
    if (!run.internal) continue;
    ++lines;
    const auto ids = mesh::run_vertex_ids(g, run.id);
    ASSERT_GE(ids.size(), 2u);
    for (std::size_t k = 1; k < ids.size(); ++k) {
      EXPECT_TRUE(edges.count({std::min(ids[k], ids[k - 1]), std::max(ids[k], ids[k - 1])}));
      EXPECT_NEAR(g.uv(ids[k], 1), 0.12, 1e-12);
    }
  }
  EXPECT_GE(lines, 1);
  EXPECT_GE(tailor::angle_report(g).least, 20);
  params.lines = {"front.chst"};
  const auto wrong = tailor::mesh_panels(panels, params);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.issues().front().code, "unknown_line");
  EXPECT_NE(wrong.issues().front().remedy.find("front.chest"), std::string::npos);
}

TEST(mesh_panels, mirrored_copy_is_the_exact_mirror_image) {
  const auto panels = cut(test::sleeve);
  ASSERT_EQ(panels.size(), 2u);
  const auto g = meshed(panels);
  expect_runs_cover_border(g);
  const Eigen::Index n = g.vertex_count() / 2, m = g.face_count() / 2;
  ASSERT_EQ(g.vertex_count(), 2 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    EXPECT_EQ(g.vertex_panel[v], 0);
    EXPECT_EQ(g.uv(v, 0), -g.uv(n + v, 0));
    EXPECT_EQ(g.uv(v, 1), g.uv(n + v, 1));
  }
  for (Eigen::Index f = 0; f < m; ++f) {
    EXPECT_EQ(g.faces(f, 0) + n, g.faces(m + f, 0));
    EXPECT_EQ(g.faces(f, 1) + n, g.faces(m + f, 2));
  }
  // The mirrored outline as the pattern cuts it agrees with the mirrored mesh.
  for (const auto& run : g.runs) {
    if (run.panel != 1) continue;
    const auto* edge = pattern::find_edge(panels[1], run.name);
    ASSERT_TRUE(edge);
    EXPECT_NEAR(run.length, edge->curve.length(), 1e-12);
    for (const auto& row : g.run_vertices) {
      if (row.run == run.id) {
        EXPECT_NEAR((g.uv.row(row.vertex).transpose() - edge->curve.point_at(row.s)).norm(), 0, 1e-9);
      }
    }
  }
}

TEST(mesh_panels, holes_stay_open) {
  const auto g = meshed(cut(test::sleeve));
  const auto surface = tailor::surface_report(g);
  EXPECT_EQ(surface.components, 2);
  EXPECT_EQ(surface.openings, 4);
  EXPECT_EQ(surface.euler, 0);
  EXPECT_GE(tailor::angle_report(g).least, 20);
}

TEST(mesh_panels, panels_lie_side_by_side_flat_and_face_up) {
  const auto g = meshed(cut(test::sleeve));
  EXPECT_EQ(g.x.col(2).cwiseAbs().maxCoeff(), 0);
  const double first_right = g.x.topRows(g.vertex_count() / 2).col(0).maxCoeff(), second_left = g.x.bottomRows(g.vertex_count() / 2).col(0).minCoeff();
  EXPECT_GT(second_left, first_right);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    const Eigen::Vector3d a = g.x.row(g.faces(f, 0)), b = g.x.row(g.faces(f, 1)), c = g.x.row(g.faces(f, 2));
    EXPECT_GT((b - a).cross(c - a).z(), 0);
  }
}

TEST(mesh_panels, settings_of_single_panels_and_omissions) {
  const auto panels = cut(test::sleeve);
  tailor::MeshParams params;
  params.panels["sleeve_m"].cell = 0.02;
  const auto g = meshed(panels, params);
  EXPECT_EQ(g.panels[0].cell_warp, 0.01);
  EXPECT_EQ(g.panels[1].cell_warp, 0.02);
  tailor::MeshParams less;
  less.leave_out = {"sleeve_m"};
  EXPECT_EQ(meshed(panels, less).panels.size(), 1u);
  tailor::MeshParams wrong;
  wrong.panels["sleve"].cell = 0.02;
  wrong.leave_out = {"collar"};
  const auto refused = tailor::mesh_panels(panels, wrong);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.issues().size(), 2u);
  EXPECT_EQ(refused.issues()[0].code, "unknown_panel");
}

TEST(mesh_panels, same_bytes_at_any_thread_count) {
  const auto panels = cut(test::sleeve);
  std::string reference;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    const std::string bytes = io::format_garment(meshed(panels), io::Encoding::ascii);
    if (reference.empty()) reference = bytes;
    EXPECT_EQ(bytes, reference);
  }
  set_thread_count(0);
}

TEST(mesh_panels, cells_larger_than_the_panel_are_refused_or_give_a_valid_mesh) {
  for (double cell : {0.03, 0.05, 0.1, 0.3}) {
    tailor::MeshParams params;
    params.cell = cell;
    const auto g = tailor::mesh_panels(cut(test::sleeve), params);
    if (!g) {
      EXPECT_EQ(g.issues().front().code, "coarse_grid");
      continue;
    }
    EXPECT_TRUE(mesh::validate(*g).empty());
    EXPECT_GT(mesh::rest_areas(*g).minCoeff(), 0);
  }
}
