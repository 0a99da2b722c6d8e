// Positions from one grid to another: what must hold for any pattern, cell and shape.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "garments.h"
#include "patterns.h"
#include "toile/base/rng.h"
#include "toile/io/pattern_yaml.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/refine.h"
#include "toile/tailor/sew.h"

using namespace toile;
using tailor::Interpolation;

namespace {

std::vector<pattern::CutPanel> cut(const std::string& yaml) {
  const auto pattern = io::parse_pattern(yaml, "test.yaml");
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
  auto panels = pattern::cut_panels(*pattern);
  EXPECT_TRUE(panels) << (panels ? "" : to_string(panels.issues().front()));
  return *panels;
}

/// A panel with everything that is hard: curved border in and out, an open dart in the hem, a fish-eye dart cut out, a
/// curved slit from the top, a stitch line.
const char* const hard = R"(units: mm
y: up
pieces:
  leaf:
    cut: 2
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], p: [60, 0], t: [75, 90], q: [90, 0], b: [220, 0], c: [230, 240], m: [120, 250], d: [0, 240]}
    outline:
      - {name: hem, path: [a, p]}
      - {name: leg_1, path: [p, {curve: [[70, 40]]}, t]}
      - {name: leg_2, path: [t, {curve: [[80, 40]]}, q]}
      - {name: hem_2, path: [q, b]}
      - {name: side, path: [b, {curve: [[160, 60], [290, 180]]}, c]}
      - {name: top_1, path: [c, {curve: [[180, 260]]}, m]}
      - {name: top_2, path: [m, {curve: [[60, 210]]}, d]}
      - {name: left, path: [d, {curve: [[-40, 120]]}, a]}
    lines:
      slit: {kind: cut, path: [m, {curve: [[95, 200], [145, 170]]}, [120, 130]]}
      eye: {kind: dart, path: [[170, 60], {curve: [[158, 100]]}, [165, 150], {curve: [[182, 100]]}, [170, 60]]}
      stitch: {kind: stitch, path: [[10, 130], [60, 160]]}
)";

mesh::GarmentMesh meshed(const std::vector<pattern::CutPanel>& panels, double cell,
                         std::vector<std::string> cuts = {"*.*"}, std::vector<std::string> lines = {},
                         tailor::Mesher mesher = tailor::Mesher::grid) {
  tailor::MeshParams params;
  params.cell = cell;
  params.cut = std::move(cuts);
  params.lines = std::move(lines);
  params.mesher = mesher;
  auto garment = tailor::mesh_panels(panels, params);
  EXPECT_TRUE(garment) << (garment ? "" : to_string(garment.issues().front()));
  return *garment;
}

template <class Shape>
void bend(mesh::GarmentMesh& g, const Shape& shape) {
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) g.x.row(v) = shape(g.uv(v, 0), g.uv(v, 1)).transpose();
}
/// Largest distance of the vertices from the shape.
template <class Shape>
double error(const mesh::GarmentMesh& g, const Shape& shape) {
  double worst = 0;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v)
    worst = std::max(worst, (g.x.row(v).transpose() - shape(g.uv(v, 0), g.uv(v, 1))).norm());
  return worst;
}

tailor::Refined refined(const mesh::GarmentMesh& fine, const mesh::GarmentMesh& coarse, Interpolation interpolation) {
  auto result = tailor::refine(fine, coarse, interpolation);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  return *result;
}

}  // namespace

TEST(refine, linear_fields_are_exact_and_quadratic_ones_with_tangents) {
  const auto panels = cut(hard);
  Rng rng(7);
  for (const double cell : {0.02, 0.013}) {
    for (const double other : {0.005, 0.011, 0.03}) {
      mesh::GarmentMesh coarse = meshed(panels, cell);
      const mesh::GarmentMesh fine = meshed(panels, other, {"*.*"}, {"*.stitch"});
      Eigen::Matrix<double, 3, 6> m;
      for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = rng.uniform(-1, 1);
      const auto linear = [&](double u, double v) { return Eigen::Vector3d(m.col(0) + m.col(1) * u + m.col(2) * v); };
      bend(coarse, linear);
      EXPECT_LT(error(refined(fine, coarse, Interpolation::linear).garment, linear), 1e-12);
      EXPECT_LT(error(refined(fine, coarse, Interpolation::smooth).garment, linear), 1e-12);
      const auto quadratic = [&](double u, double v) {
        return Eigen::Vector3d(linear(u, v) + m.col(3) * u * u + m.col(4) * u * v + m.col(5) * v * v);
      };
      bend(coarse, quadratic);
      if (other < cell) {
        EXPECT_GT(error(refined(fine, coarse, Interpolation::linear).garment, quadratic), 1e-5);
      }
      EXPECT_LT(error(refined(fine, coarse, Interpolation::smooth).garment, quadratic), 1e-12) << cell << " " << other;
    }
  }
}

TEST(refine, the_same_grid_is_the_identity) {
  mesh::GarmentMesh g = meshed(cut(hard), 0.012);
  const auto shape = [](double u, double v) { return Eigen::Vector3d(u, std::sin(9 * v) / 9, std::cos(7 * u) * v); };
  bend(g, shape);
  mesh::GarmentMesh flat = g;
  flat.x.setZero();
  for (const Interpolation interpolation : {Interpolation::linear, Interpolation::smooth}) {
    const tailor::Refined result = refined(flat, g, interpolation);
    EXPECT_TRUE(result.garment.x == g.x);
    EXPECT_EQ(result.outside, 0);
  }
}

TEST(refine, errors_on_a_cylinder_fall_with_the_square_and_the_cube_of_the_cell) {
  const auto panels = cut(hard);
  const double r = 0.08, angle = 0.6;  // rolled askew
  const auto cylinder = [&](double u, double v) {
    const double along = std::cos(angle) * u + std::sin(angle) * v, across = std::cos(angle) * v - std::sin(angle) * u;
    return Eigen::Vector3d(r * std::sin(along / r), across, r * std::cos(along / r));
  };
  const mesh::GarmentMesh fine = meshed(panels, 0.003);
  std::vector<double> cells{0.016, 0.008, 0.004}, linear, smooth;
  for (const double cell : cells) {
    mesh::GarmentMesh coarse = meshed(panels, cell);
    bend(coarse, cylinder);
    linear.push_back(error(refined(fine, coarse, Interpolation::linear).garment, cylinder));
    smooth.push_back(error(refined(fine, coarse, Interpolation::smooth).garment, cylinder));
  }
  const auto order = [&](const std::vector<double>& errors) {
    return std::log(errors.front() / errors.back()) / std::log(cells.front() / cells.back());
  };
  EXPECT_GT(order(linear), 1.8);
  EXPECT_GT(order(smooth), 2.7);
  EXPECT_LT(smooth[0], 0.2 * linear[0]);
  RecordProperty("linear", fmt::format("{} order {}", linear[0], order(linear)));
  RecordProperty("smooth", fmt::format("{} order {}", smooth[0], order(smooth)));
}

TEST(refine, nothing_changes_sides_at_cuts_and_darts) {
  const auto panels = cut(hard);
  for (const double cell : {0.03, 0.02, 0.015}) {
    mesh::GarmentMesh coarse = meshed(panels, cell), fine = meshed(panels, 0.0025);
    // The panel falls into two at the slit and its straight continuation downwards: z tells the side of every vertex.
    // Along the slit that is the side it is called after; elsewhere that of the curve.
    for (const char* panel_name : {"leaf", "leaf_m"}) {
      const int panel = *mesh::find_panel(coarse, panel_name);
      ASSERT_EQ(panel, *mesh::find_panel(fine, panel_name));
      const pattern::Curve& slit = pattern::find_panel(panels, panel_name)->lines.front().curve;
      ASSERT_EQ(pattern::find_panel(panels, panel_name)->lines.front().name, "slit");
      const double tip = slit.to().y() + 0.002;
      const auto sides = [&](const mesh::GarmentMesh& g) {
        std::vector<int> side(static_cast<std::size_t>(g.vertex_count()), 0);
        for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
          const Eigen::Vector2d p = g.uv.row(v);
          if (g.vertex_panel[v] != panel || p.y() < tip) continue;
          const auto nearest = slit.nearest(p);
          const Eigen::Vector2d along = slit.tangent_at(nearest.s), off = p - nearest.point;
          if (off.norm() > 1e-9)
            side[static_cast<std::size_t>(v)] = along.x() * off.y() - along.y() * off.x() > 0 ? 1 : -1;
        }
        const bool mirrored = g.panels[static_cast<std::size_t>(panel)].mirrored;
        for (const auto& [name, sign] : {std::pair("slit", 1), std::pair("slit_r", -1)}) {
          for (int v : mesh::run_vertex_ids(g, *mesh::find_run(g, panel, name)))
            side[static_cast<std::size_t>(v)] = g.uv(v, 1) < tip ? 0 : mirrored ? -sign : sign;
        }
        return side;
      };
      const std::vector<int> of_coarse = sides(coarse), of_fine = sides(fine);
      const auto map = tailor::map_panels(fine, coarse);
      ASSERT_TRUE(map);
      int wrong = 0, near = 0;
      for (Eigen::Index v = 0; v < fine.vertex_count(); ++v) {
        if (of_fine[static_cast<std::size_t>(v)] == 0) continue;
        for (int k = 0; k < 3; ++k) {
          const int w = of_coarse[static_cast<std::size_t>(coarse.faces(map->face[v], k))];
          wrong += w != 0 && w != of_fine[static_cast<std::size_t>(v)];
          near += w != 0;
        }
      }
      EXPECT_GT(near, 1000);
      EXPECT_EQ(wrong, 0) << cell << " " << panel_name;
    }
    // Nothing lies farther out than curves bulge over chords.
    const auto map = tailor::map_panels(fine, coarse);
    EXPECT_LT(map->outside.maxCoeff(), 0.12 * cell);
  }
}

TEST(refine, folds_stay_sharp) {
  const auto panels = cut(R"(units: mm
y: up
pieces:
  p:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 160], d: [0, 160]}
    outline: [{name: w, path: [a, b]}, {name: x, path: [b, c]}, {name: y1, path: [c, d]}, {name: z, path: [d, a]}]
    lines: {crease: {kind: fold, path: [[70, 0], [110, 160]]}}
)");
  const auto grid = [&](double cell) { return meshed(panels, cell, {}, {"*.*"}); };
  mesh::GarmentMesh coarse = grid(0.02);
  const Eigen::Vector2d on(0.07, 0), along = Eigen::Vector2d(0.04, 0.16).normalized(), across(along.y(), -along.x());
  for (const double angle : {40.0, 100.0, 175.0}) {
    const auto folded = [&](double u, double v) {
      const Eigen::Vector2d p = Eigen::Vector2d(u, v) - on;
      const double out = p.dot(across), turn = out > 0 ? angle * std::numbers::pi / 180 : 0;
      return Eigen::Vector3d(out * std::cos(turn), p.dot(along), out * std::sin(turn));
    };
    tailor::FoldSpec spec;
    spec.name = "crease";
    spec.line = {"p.crease"};
    spec.angle = 0.3;
    const auto creased = tailor::add_folds(coarse, {spec});
    ASSERT_TRUE(creased) << to_string(creased.issues().front());
    mesh::GarmentMesh garment = creased->garment;
    bend(garment, folded);
    EXPECT_LT(error(refined(grid(0.007), garment, Interpolation::smooth).garment, folded), 1e-12) << angle;
    // Without hinges the bend itself tells.
    mesh::GarmentMesh plain = coarse;
    bend(plain, folded);
    const double off = error(refined(grid(0.007), plain, Interpolation::smooth).garment, folded);
    if (angle > 60) {
      EXPECT_LT(off, 1e-12) << angle;
    } else {
      EXPECT_GT(off, 1e-4);
    }
  }
}

TEST(refine, closed_seams_stay_closed_and_open_ones_open) {
  // Two rectangles of unequal cells rolled to a tube: their seams at opposite sides.
  const auto tube = [](int n) {
    mesh::GarmentMesh g;
    test::add_rectangle(g, "front", 4 * n, 3 * n, 0.1 / n);
    test::add_rectangle(g, "back", 4 * n, 3 * n, 0.1 / n);
    tailor::SewParams params;
    for (const auto& [name, a, b] :
         {std::tuple("one", "front.left", "-back.right"), std::tuple("two", "front.right", "-back.left")}) {
      tailor::SeamSpec seam;
      seam.name = name;
      seam.a = {a};
      seam.b = {b};
      params.seams.push_back(seam);
    }
    auto sewn = tailor::sew(g, params);
    EXPECT_TRUE(sewn) << (sewn ? "" : to_string(sewn.issues().front()));
    return sewn->garment;
  };
  mesh::GarmentMesh coarse = tube(3);
  const mesh::GarmentMesh fine = tube(10);
  const double r = 0.8 / (2 * std::numbers::pi);
  const auto roll = [&](double gap) {
    for (Eigen::Index v = 0; v < coarse.vertex_count(); ++v) {
      const bool back = coarse.vertex_panel[v] == 1;
      const double t = coarse.uv(v, 0) / r + (back ? std::numbers::pi : 0);
      coarse.x.row(v) << r * std::cos(t), coarse.uv(v, 1), r * std::sin(t) - (back ? gap : 0);
    }
    for (const mesh::Weld& weld : coarse.welds) {  // exactly closed, as a simulation leaves them
      if (gap == 0) coarse.x.row(weld.b) = coarse.x.row(weld.a);
    }
  };
  const auto gaps = [](const mesh::GarmentMesh& g) {
    double widest = 0;
    for (const mesh::Weld& weld : g.welds) widest = std::max(widest, (g.x.row(weld.a) - g.x.row(weld.b)).norm());
    return widest;
  };
  roll(0);
  const tailor::Refined closed = refined(fine, coarse, Interpolation::smooth);
  EXPECT_EQ(gaps(closed.garment), 0);
  EXPECT_EQ(closed.open_seams, 0);
  EXPECT_EQ(closed.joined, 62);
  EXPECT_LT(closed.widest_join, 1e-3);
  roll(0.02);
  const tailor::Refined open = refined(fine, coarse, Interpolation::smooth);
  EXPECT_NEAR(gaps(open.garment), 0.02, 1e-3);
  EXPECT_EQ(open.open_seams, 2);
  EXPECT_EQ(open.joined, 0);
}

TEST(refine, other_patterns_are_refused_with_every_difference) {
  const auto panels = cut(hard);
  const mesh::GarmentMesh coarse = meshed(panels, 0.02), fine = meshed(panels, 0.01);
  mesh::GarmentMesh other = coarse;
  other.panels[0].name = "blade";
  other.panels[1].cut_area *= 1.01;
  for (mesh::Run& run : other.runs) {
    if (run.panel == 1 && run.name == "side") run.length *= 1.001;
    if (run.panel == 1 && run.name == "hem") run.name = "bottom";
  }
  const auto result = tailor::refine(fine, other, Interpolation::linear);
  ASSERT_FALSE(result);
  std::set<std::string> items;
  for (const Issue& issue : result.issues()) {
    EXPECT_EQ(issue.code, "other_pattern");
    EXPECT_EQ(issue.category, Category::check);
    items.insert(issue.place.item);
  }
  EXPECT_EQ(items, (std::set<std::string>{"leaf", "leaf_m", "leaf_m.side", "leaf_m.hem"}));
}
