#include "toile/placement/place.h"

#include "garments.h"
#include "people.h"
#include "toile/form/form.h"
#include "toile/geometry/wrap.h"
#include "toile/base/parallel.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"
#include "toile/placement/coarse.h"
#include "toile/placement/developable.h"
#include "toile/placement/layers.h"
#include "toile/placement/mirror.h"
#include "toile/placement/relax.h"
#include "toile/placement/report.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

using namespace toile;
using namespace toile::placement;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::add_rectangle;

namespace {

const mesh::SupportMesh& man() {
  static const mesh::SupportMesh mesh = [] {
    form::FormParams p;
    p.vertices = 1500;
    return form::make_form(testing_people::man(), p)->mesh;
  }();
  return mesh;
}

// Vertex of a rectangle panel of garments.h by column and row.
int at(const mesh::GarmentMesh& g, int panel, int columns, int i, int j) {
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == panel) return static_cast<int>(v) + j * (columns + 1) + i;
  }
  ADD_FAILURE() << "no panel " << panel;
  return 0;
}

constexpr int kAround = 90;

// 0.4 m high about the y axis, rows of 50 mm; radius [m] of a height.
template <class Radius>
mesh::SupportMesh round_support(const Radius& radius) {
  constexpr int rows = 8;
  mesh::SupportMesh support;
  support.x.resize(kAround * (rows + 1) + 2, 3);
  std::vector<std::array<int, 3>> faces;
  for (int j = 0; j <= rows; ++j) {
    const double y = 0.05 * j, r = radius(y);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      support.x.row(j * kAround + i) << r * std::sin(angle), y, r * std::cos(angle);
      const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      if (j < rows) faces.insert(faces.end(), {{a, b, b + kAround}, {a, b + kAround, a + kAround}});
      if (j == 0) faces.push_back({kAround * (rows + 1), b, a});
      if (j == rows) faces.push_back({kAround * (rows + 1) + 1, a, b});
    }
  }
  support.x.row(kAround * (rows + 1)) << 0, 0, 0;
  support.x.row(kAround * (rows + 1) + 1) << 0, 0.05 * rows, 0;
  support.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) support.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  support.face_region = mesh::Ids::Constant(support.faces.rows(), -1);
  return support;
}

// Regions "before" and "behind".
mesh::SupportMesh two_regions() {
  mesh::SupportMesh support = round_support([](double) { return 0.18; });
  support.region_names = {"before", "behind"};
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    double z = 0;
    for (int k = 0; k < 3; ++k) z += support.x(support.faces(f, k), 2);
    support.face_region[f] = z > 0 ? 0 : 1;
  }
  return support;
}

int add_seam(mesh::GarmentMesh& g, const std::string& name) {
  const int id = static_cast<int>(g.seams.size());
  g.seams.push_back({.id = id, .name = name});
  return id;
}

constexpr double kCell = 0.02;

// Front and back, sewn at the sides: `nu` columns each, `nv` rows.
mesh::GarmentMesh tube(int nu, int nv) {
  mesh::GarmentMesh g;
  add_rectangle(g, "front", nu, nv, kCell);
  add_rectangle(g, "back", nu, nv, kCell);
  const int left = add_seam(g, "left"), right = add_seam(g, "right");
  for (int j = 0; j <= nv; ++j) g.welds.push_back({at(g, 0, nu, nu, j), at(g, 1, nu, 0, j), left});
  for (int j = 0; j <= nv; ++j) g.welds.push_back({at(g, 0, nu, 0, j), at(g, 1, nu, nu, j), right});
  return g;
}

// Takes a rectangle's cells away where drop(column, row) says so, and the vertices that no face uses then.
template <class Drop>
void cut_away(mesh::GarmentMesh& g, int panel, int columns, const Drop& drop) {
  const int base = at(g, panel, columns, 0, 0);
  std::vector<int> faces;
  for (int f = 0; f < g.face_count(); ++f) {
    int i = columns, j = 1 << 30;
    for (int k = 0; k < 3; ++k) {
      const int v = g.faces(f, k) - base;
      i = std::min(i, v % (columns + 1));
      j = std::min(j, v / (columns + 1));
    }
    if (g.face_panel[f] != panel || !drop(i, j)) faces.push_back(f);
  }
  const mesh::GarmentMesh old = g;
  std::vector<int> number(static_cast<std::size_t>(old.vertex_count()), -1);
  int count = 0;
  for (int v = 0; v < old.vertex_count(); ++v) {
    bool used = false;
    for (int f : faces) used = used || (old.faces.row(f).array() == v).any();
    if (used) number[static_cast<std::size_t>(v)] = count++;
  }
  const auto mapped = [&](int v) { return number[static_cast<std::size_t>(v)]; };
  for (int v = 0; v < old.vertex_count(); ++v) {
    if (mapped(v) < 0) continue;
    g.x.row(mapped(v)) = old.x.row(v);
    g.uv.row(mapped(v)) = old.uv.row(v);
    g.vertex_panel[mapped(v)] = old.vertex_panel[v];
  }
  g.x.conservativeResize(count, 3);
  g.uv.conservativeResize(count, 2);
  g.vertex_panel.conservativeResize(count);
  g.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  g.face_panel.resize(g.faces.rows());
  g.face_laminate = mesh::Ids::Constant(g.faces.rows(), -1);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) g.faces(static_cast<Eigen::Index>(f), k) = mapped(old.faces(faces[f], k));
    g.face_panel[static_cast<Eigen::Index>(f)] = old.face_panel[faces[f]];
  }
  std::erase_if(g.run_vertices, [&](const mesh::RunVertex& r) { return mapped(r.vertex) < 0; });
  for (auto& r : g.run_vertices) r.vertex = mapped(r.vertex);
  std::erase_if(g.points, [&](const mesh::NamedPoint& r) { return mapped(r.vertex) < 0; });
  for (auto& r : g.points) r.vertex = mapped(r.vertex);
  std::erase_if(g.welds, [&](const mesh::Weld& w) { return mapped(w.a) < 0 || mapped(w.b) < 0; });
  for (auto& w : g.welds) w.a = mapped(w.a), w.b = mapped(w.b);
}

// A T-shirt of straight lines on a 20 mm grid: side seams, set-in sleeves, shoulders, a square neck.
mesh::GarmentMesh boxy_tee(int sleeve_length = 8) {
  constexpr int nu = 28, nv = 33, inset = 3, depth = 11, shoulder = 5, neck = 3, cap = inset + depth;
  mesh::GarmentMesh g;
  add_rectangle(g, "front", nu, nv, kCell);
  add_rectangle(g, "back", nu, nv, kCell);
  add_rectangle(g, "sleeve", 2 * cap, sleeve_length, kCell);
  add_rectangle(g, "sleeve_m", 2 * cap, sleeve_length, kCell);
  const int first = nv - depth;
  const int side_left = add_seam(g, "side_left"), side_right = add_seam(g, "side_right");
  for (int j = 0; j <= first; ++j) g.welds.push_back({at(g, 0, nu, nu, j), at(g, 1, nu, 0, j), side_left});
  for (int j = 0; j <= first; ++j) g.welds.push_back({at(g, 0, nu, 0, j), at(g, 1, nu, nu, j), side_right});
  const int shoulder_left = add_seam(g, "shoulder_left"), shoulder_right = add_seam(g, "shoulder_right");
  for (int i = inset; i <= inset + shoulder; ++i) g.welds.push_back({at(g, 0, nu, nu - i, nv), at(g, 1, nu, i, nv), shoulder_left});
  for (int i = inset; i <= inset + shoulder; ++i) g.welds.push_back({at(g, 0, nu, i, nv), at(g, 1, nu, nu - i, nv), shoulder_right});
  // Armholes from the underarm to the shoulder: in along the inset, then up. The plain sleeve is the right one: its front
  // half is at +u.
  const auto edge = [&](int panel, int k, bool far) {
    const int i = std::min(k, inset), j = first + std::max(0, k - inset);
    return at(g, panel, nu, far ? nu - i : i, j);
  };
  const int m = 2 * cap;
  const int armhole_right = add_seam(g, "armhole_right"), armhole_left = add_seam(g, "armhole_left");
  for (int k = 0; k <= cap; ++k) g.welds.push_back({at(g, 2, m, m - k, sleeve_length), edge(0, k, false), armhole_right});
  for (int k = 0; k <= cap; ++k) g.welds.push_back({at(g, 2, m, k, sleeve_length), edge(1, k, true), armhole_right});
  for (int k = 0; k <= cap; ++k) g.welds.push_back({at(g, 3, m, k, sleeve_length), edge(0, k, true), armhole_left});
  for (int k = 0; k <= cap; ++k) g.welds.push_back({at(g, 3, m, m - k, sleeve_length), edge(1, k, false), armhole_left});
  const int underarm_right = add_seam(g, "underarm_right"), underarm_left = add_seam(g, "underarm_left");
  for (int j = 0; j <= sleeve_length; ++j) g.welds.push_back({at(g, 2, m, m, j), at(g, 2, m, 0, j), underarm_right});
  for (int j = 0; j <= sleeve_length; ++j) g.welds.push_back({at(g, 3, m, m, j), at(g, 3, m, 0, j), underarm_left});
  for (const int panel : {1, 0}) {
    cut_away(g, panel, nu, [&](int i, int j) {
      if (j >= first && (i < inset || i >= nu - inset)) return true;
      return j >= nv - neck && i >= inset + shoulder && i < nu - inset - shoulder;
    });
  }
  return g;
}

double seam_mean(const Report& report, const mesh::GarmentMesh& g, const std::string& name) {
  for (const SeamGap& gap : report.seams) {
    if (g.seams[static_cast<std::size_t>(gap.seam)].name == name) return gap.mean;
  }
  ADD_FAILURE() << "no seam " << name;
  return 0;
}

std::vector<std::string> codes(const Issues& issues) {
  std::vector<std::string> result;
  for (const Issue& issue : issues) result.push_back(issue.code);
  return result;
}

}  // namespace

// ---- isometric maps

TEST(developable, cylinder_keeps_lengths_but_for_the_chord) {
  Frame frame;
  frame.origin = {0.1, 0.2, 0.3};
  frame.across = Vector3d(1, 0, 1).normalized();
  frame.up = Vector3d(0, 1, 0);
  const double r = 0.06;
  for (int k = 0; k < 8; ++k) {
    // a strip at any angle round the cylinder, 45 degrees among them
    const double angle = k * std::numbers::pi / 8;
    const Vector2d p(0.07, -0.02), d = 0.01 * Vector2d(std::cos(angle), std::sin(angle));
    const double length = (on_cylinder(frame, r, p + d) - on_cylinder(frame, r, p)).norm();
    const double chord = std::hypot(2 * r * std::sin(0.5 * d.x() / r), d.y());
    EXPECT_NEAR(length, chord, 1e-15);
    EXPECT_LE(std::abs(length / 0.01 - 1), std::pow(0.01 / r, 2) / 24 + 1e-12);
  }
  EXPECT_NEAR((on_cylinder(frame, r, {0, 0}) - frame.origin).norm(), 0, 1e-16);
  // the face side looks outwards: away from the axis
  const Vector3d axis = frame.origin - r * frame.out();
  EXPECT_NEAR((on_cylinder(frame, r, {0.05, 0}) - axis).norm(), r, 1e-15);
}

TEST(developable, square_on_a_cone_keeps_lengths_but_for_the_chord) {
  for (const double slant : {0.5, -0.5}) {
    for (const double radius : {0.1, 0.3, 0.5}) {
      const Frame frame;
      const auto map = [&](double u, double v) { return on_cone(frame, radius, slant, {u, v}); };
      EXPECT_NEAR((map(0, 0) - frame.origin).norm(), 0, 1e-15);
      double worst = 0;
      for (int i = -10; i < 10; ++i) {
        for (int j = -10; j < 10; ++j) {
          for (const auto& [du, dv] : {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)}) {
            const double h = 0.01, length = h * std::hypot(du, dv);
            const double strain = (map((i + du) * h, (j + dv) * h) - map(i * h, j * h)).norm() / length - 1;
            EXPECT_LE(strain, 1e-9);  // a chord is never longer than the line on the surface
            worst = std::max(worst, -strain);
          }
        }
      }
      // smallest radius of curvature within the square: distance from the apex times the cone's tangent
      const double sine = radius / std::abs(slant), tangent = sine < 1 ? sine / std::sqrt(1 - sine * sine) : 1e9;
      const double curvature_radius = (0.5 - 0.1) * tangent;
      EXPECT_LE(worst, std::pow(0.01 * std::sqrt(2) / curvature_radius, 2) / 24 * 1.05 + 1e-6) << radius << ' ' << slant;
      // orientation: u across, v up, face side out
      const Vector3d du = map(1e-5, 0) - map(0, 0), dv = map(0, 1e-5) - map(0, 0);
      EXPECT_NEAR((du / 1e-5 - frame.across).norm(), 0, 1e-3);
      EXPECT_NEAR((dv / 1e-5 - frame.up).norm(), 0, 1e-3);
      EXPECT_GT(frame.out().dot(map(0, 0) - 0.5 * (map(0.1, 0) + map(-0.1, 0))), -1e-12);  // curls away from the face side
    }
  }
}

TEST(developable, section_is_the_parallel_curve_by_arc_length) {
  Points2 square(4, 2);
  square << 0.1, -0.2, 0.1, 0.2, -0.1, 0.2, -0.1, -0.2;
  const double d = 0.03;
  const ConvexSection section(square, d, {0, 0}, {1, 0});
  EXPECT_NEAR(section.perimeter(), 1.2 + 2 * std::numbers::pi * d, 1e-12);
  EXPECT_NEAR((section.point(0) - Vector2d(0.13, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((section.point(section.perimeter()) - section.point(0)).norm(), 0, 1e-9);
  EXPECT_NEAR((section.point(0.1) - Vector2d(0.13, 0.1)).norm(), 0, 1e-9);  // counter-clockwise
  const double h = 1e-3;
  for (double s = -0.3; s < 2; s += h) {
    const double length = (section.point(s + h) - section.point(s)).norm();
    EXPECT_LE(length, h * (1 + 1e-9));
    EXPECT_GE(length, h * (1 - h * h / (d * d) / 20));
    EXPECT_NEAR(section.normal(s).dot(section.point(s + 1e-7) - section.point(s)), 0, 1e-12);
  }
}

// ---- the body

TEST(body_frame, finds_levels_and_arms_of_a_dress_form_without_landmarks) {
  mesh::SupportMesh bare = man();
  const auto mark = [&](const char* name) { return Vector3d(man().landmarks.at(name)[0], man().landmarks.at(name)[1], man().landmarks.at(name)[2]); };
  bare.landmarks.clear();
  bare.girths.clear();
  const auto frame = body_frame(bare);
  ASSERT_TRUE(frame.has_value());
  EXPECT_NEAR(frame->x_mid, 0, 2e-3);
  EXPECT_NEAR(frame->waist, mark("waist_front").y(), 0.03);
  EXPECT_NEAR(frame->section(mark("waist_front").y()).girth, 0.783, 0.01);
  EXPECT_NEAR(frame->armpit, mark("armpit_left").y(), 0.03);
  ASSERT_TRUE(frame->arm_left && frame->arm_right);
  const Vector3d along = (mark("elbow_left") - mark("shoulder_left")).normalized();
  EXPECT_GT(frame->arm_left->direction.dot(along), 0.97);
  EXPECT_GT(frame->arm_left->direction.x(), 0.5);
  EXPECT_LT(frame->arm_right->direction.x(), -0.5);
  // biceps
  double girth = 0;
  for (const LimbPoint& point : frame->arm_left->points) girth = std::max(girth, point.girth * (point.centre.x() > 0.26));
  EXPECT_NEAR(girth, 0.318, 0.03);
  EXPECT_NEAR(*outline_top(bare, 0.15), *outline_top(bare, -0.15), 1e-3);
}

TEST(body_frame, refuses_what_is_no_body) {
  mesh::SupportMesh beside = man();
  // two separate lumps: nothing goes round the middle
  const Eigen::Index n = beside.x.rows(), m = beside.faces.rows();
  mesh::SupportMesh two = beside;
  two.x.conservativeResize(2 * n, 3);
  two.x.bottomRows(n) = beside.x;
  two.x.topRows(n).col(0).array() += 1;
  two.x.bottomRows(n).col(0).array() -= 1;
  two.faces.conservativeResize(2 * m, 3);
  two.faces.bottomRows(m) = beside.faces.array() + static_cast<int>(n);
  const auto frame = body_frame(two);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.issues().front().code, "no_trunk");
}

// ---- layout

TEST(layout, sleeves_go_where_their_armholes_are) {
  const auto g = boxy_tee();
  const auto frame = body_frame(man());
  const auto layout = make_layout(g, fold_flat(g), man(), *frame, {});
  ASSERT_TRUE(layout.has_value());
  EXPECT_EQ(layout->panels[0].region, Region::torso_front);
  EXPECT_EQ(layout->panels[1].region, Region::torso_back);
  EXPECT_EQ(layout->panels[2].region, Region::arm_right);
  EXPECT_EQ(layout->panels[3].region, Region::arm_left);
  EXPECT_NEAR(layout->girth_trunk, 2 * 0.56, 0.03);
  EXPECT_NEAR(layout->girth_arm_left, 0.56, 0.02);
  EXPECT_EQ(layout->shoulder_welds.size(), 12u);
  // shoulders rest on the shoulders
  const double top = layout->panels[0](Vector2d(0.5, 0.66)).y();
  EXPECT_NEAR(top, *outline_top(man(), 0.17), 0.03);
}

TEST(layout, says_what_it_cannot_place) {
  auto g = boxy_tee();
  g.panels[1].name = g.panels[1].piece = "thing";
  PlaceParams params;
  params.panels["frnt"] = {};
  const auto frame = body_frame(man());
  const auto layout = make_layout(g, fold_flat(g), man(), *frame, params);
  ASSERT_FALSE(layout.has_value());
  EXPECT_EQ(codes(layout.issues()), (std::vector<std::string>{"unknown_panel", "no_region"}));
  EXPECT_NE(layout.issues()[0].remedy.find("front"), std::string::npos);

  PlaceParams anchors;
  anchors.panels["front"].point = "tpo";
  const auto bad_point = make_layout(boxy_tee(), fold_flat(boxy_tee()), man(), *frame, anchors);
  ASSERT_FALSE(bad_point.has_value());
  EXPECT_NE(bad_point.issues()[0].remedy.find("top"), std::string::npos);
  anchors.panels["front"].point = "top";
  anchors.panels["front"].at = "wiast";
  const auto bad_mark = make_layout(boxy_tee(), fold_flat(boxy_tee()), man(), *frame, anchors);
  ASSERT_FALSE(bad_mark.has_value());
  EXPECT_NE(bad_mark.issues()[0].remedy.find("waist"), std::string::npos);
  anchors.panels["front"].at = "waist";
  const auto good = make_layout(boxy_tee(), fold_flat(boxy_tee()), man(), *frame, anchors);
  ASSERT_TRUE(good.has_value());
  EXPECT_NEAR(good->panels[0](Vector2d(0.1, 0.66)).y(), frame->waist, 1e-9);
}

TEST(layout, a_point_goes_to_a_point_of_the_support) {
  const auto g = tube(26, 15);
  const auto frame = body_frame(man());
  const double height = frame->waist - 0.05;
  const Points2& hull = frame->section(height).hull;
  Eigen::Index side = 0;
  hull.col(1).maxCoeff(&side);
  PlaceParams params;
  params.panels["front"].point = "top";
  params.panels["front"].to = {hull(side, 1), height, hull(side, 0)};  // the left side
  const auto layout = make_layout(g, fold_flat(g), man(), *frame, params);
  ASSERT_TRUE(layout.has_value());
  const Vector2d top = layout->panels[0](Vector2d(0.26, 0.3));  // the middle of the upper edge
  EXPECT_NEAR(top.y(), height, 1e-9);
  EXPECT_NEAR(top.x() / layout->girth_trunk, 0.25, 0.03);
  // and on the mirrored side with everything mirrored
  params.panels["front"].to[0] = -params.panels["front"].to[0];
  const auto right = make_layout(g, fold_flat(g), man(), *frame, params);
  EXPECT_NEAR(std::abs(right->panels[0](Vector2d(0.26, 0.3)).x()) / right->girth_trunk, 0.25, 0.03);

  params.panels["front"].to = {0, height, 1};
  const auto off = make_layout(g, fold_flat(g), man(), *frame, params);
  ASSERT_FALSE(off.has_value());
  EXPECT_EQ(codes(off.issues()), std::vector<std::string>{"off_support"});
  EXPECT_EQ(off.issues().front().place.item, "panels.front.to");
}

// ---- coarse mesh

TEST(coarse, keeps_area_seams_and_flat_states) {
  const auto g = boxy_tee();
  const CoarseGarment coarse = coarsen(g, 0.06);
  EXPECT_LT(coarse.mesh.vertex_count(), g.vertex_count() / 4);
  EXPECT_NEAR(mesh::rest_areas(coarse.mesh).sum(), mesh::rest_areas(g).sum(), 1e-9);
  EXPECT_EQ(mesh::component_count(coarse.mesh.faces), 4);
  EXPECT_EQ(mesh::euler_number(coarse.mesh.faces), 4);
  std::vector<int> rows(g.seams.size(), 0);
  for (const auto& weld : coarse.mesh.welds) ++rows[static_cast<std::size_t>(weld.seam)];
  for (int count : rows) EXPECT_GE(count, 3);
  const Points3 back = coarse.prolonged(coarse.restricted(g.x));
  EXPECT_LT((back - g.x).cwiseAbs().maxCoeff(), 1e-12);
}

// ---- the whole

TEST(coarse, has_vertices_inside_wherever_the_fine_grid_lies) {
  for (const double shift : {0.0, 0.004, 0.0075, 0.011}) {
    mesh::GarmentMesh g;
    add_rectangle(g, "front", 30, 30, 0.015);
    g.uv.array() += shift;
    const CoarseGarment coarse = coarsen(g, 0.03);
    double longest = 0;
    for (const mesh::Edge& edge : mesh::edges(coarse.mesh.faces)) longest = std::max(longest, (coarse.mesh.uv.row(edge.a) - coarse.mesh.uv.row(edge.b)).norm());
    EXPECT_LT(longest, 0.07) << shift;
  }
}

TEST(place, tube_goes_round_the_hips_without_stretch) {
  const auto g = tube(26, 15);  // 1.04 m round, 0.3 m high
  PlaceParams params;
  const auto placed = place(g, man(), params);
  ASSERT_TRUE(placed.has_value());
  const Report& report = placed->report;
  EXPECT_TRUE(placed->findings.empty()) << to_string(placed->findings.front());
  EXPECT_LE(report.max_strain, params.max_strain);
  EXPECT_LE(report.rms_strain, params.rms_strain);
  EXPECT_GE(report.smallest_gap, params.clearance);
  EXPECT_TRUE(report.self_intersections.empty());
  EXPECT_TRUE(report.support_intersections.empty());
  EXPECT_LT(report.mean_seam_gap, 0.005);
  EXPECT_EQ(placed->garment.welds.size(), g.welds.size());
  // front in front, facing forwards
  double front = 0, back = 0;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) (g.vertex_panel[v] == 0 ? front : back) += placed->garment.x(v, 2);
  EXPECT_GT(front, back);
}

TEST(report, measures_a_known_state) {
  // A rectangle bent round an upright cylinder, stretched along the weft by 1 %, turned by 10 degrees.
  mesh::GarmentMesh g;
  add_rectangle(g, "front", 10, 10, kCell);
  const double turn = 10 * std::numbers::pi / 180, radius = 0.5;
  Frame frame;
  frame.origin = {0, 1.1, 0.4};
  std::vector<std::optional<WantedDirection>> wanted(static_cast<std::size_t>(g.face_count()));
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const Vector2d uv(1.01 * g.uv(v, 0), g.uv(v, 1));
    g.x.row(v) = on_cylinder(frame, radius, {std::cos(turn) * uv.x() - std::sin(turn) * uv.y(), std::sin(turn) * uv.x() + std::cos(turn) * uv.y()}).transpose();
  }
  for (auto& w : wanted) w = WantedDirection{Vector3d::UnitY(), Vector3d::UnitX(), 0};
  const Report report = measure(g, man(), wanted);
  EXPECT_NEAR(report.max_strain, 0.01, 2e-4);  // less the chord error, (h/r)^2/24
  EXPECT_NEAR(report.area_change, 0.01, 2e-4);
  EXPECT_NEAR(report.mean_warp_angle, turn, 0.005);
  EXPECT_NEAR(report.face_warp_angle.front(), turn, 0.01);  // counter-clockwise from outside
  ASSERT_EQ(report.warp_angles.size(), 1u);
  for (auto& w : wanted) w->turn = turn;
  EXPECT_NEAR(measure(g, man(), wanted).mean_warp_angle, 0, 0.005);
  EXPECT_EQ(measure(g, man()).warp_angles.size(), 0u);
  EXPECT_EQ(report.vertex_strain.size(), static_cast<std::size_t>(g.vertex_count()));
  EXPECT_NEAR(*std::min_element(report.vertex_gap.begin(), report.vertex_gap.end()), report.smallest_gap, 0);
  // moved into the body, and a second one through the first: both are seen
  mesh::GarmentMesh inside = g;
  inside.x.col(2).array() -= 0.35;
  const Report bad = measure(inside, man());
  EXPECT_GT(bad.vertices_inside, 0);
  EXPECT_LT(bad.smallest_gap, 0);
  mesh::GarmentMesh two = g;
  add_rectangle(two, "second", 10, 10, kCell);
  two.x.bottomRows(121) = two.uv.bottomRows(121) * Eigen::Matrix<double, 2, 3>{{0, 0, 1}, {0, 1, 0}};
  two.x.bottomRows(121).col(0).array() += 0.05;
  two.x.bottomRows(121).col(1).array() += 1.1;
  two.x.bottomRows(121).col(2).array() += 0.3;
  const Report crossing = measure(two, man());
  EXPECT_FALSE(crossing.self_intersections.empty());
  EXPECT_EQ(crossing.face_cut[static_cast<std::size_t>(crossing.self_intersections.front().a)] & 1, 1);
}

TEST(place, boxy_tee_hangs_on_the_shoulders_with_its_sleeves_over_the_arms) {
  const auto g = boxy_tee();
  const auto placed = place(g, man(), {});
  ASSERT_TRUE(placed.has_value());
  const Report& report = placed->report;
  EXPECT_TRUE(placed->findings.empty()) << to_string(placed->findings.front());
  EXPECT_EQ(report.vertices_inside, 0);
  EXPECT_TRUE(report.self_intersections.empty());
  EXPECT_TRUE(report.support_intersections.empty());
  EXPECT_LT(report.mean_seam_gap, 0.012);
  EXPECT_LT(seam_mean(report, g, "side_left"), 0.01);
  EXPECT_LT(seam_mean(report, g, "underarm_left"), 0.02);
  // each sleeve is round its arm: the arm's axis passes through it
  const auto frame = body_frame(man());
  for (const auto& [panel, arm] : {std::pair(2, frame->arm_right), std::pair(3, frame->arm_left)}) {
    std::array<int, 4> quadrant{};
    const Vector3d side = arm->direction.cross(Vector3d::UnitZ()).normalized();
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
      if (g.vertex_panel[v] != panel) continue;
      const Vector3d d = placed->garment.x.row(v).transpose() - arm->origin;
      ++quadrant[static_cast<std::size_t>((d.dot(side) > 0 ? 1 : 0) + (d.z() > 0 ? 2 : 0))];
    }
    for (int count : quadrant) EXPECT_GT(count, 20);
  }
}

TEST(place, mirrored_body_and_garment_give_the_mirrored_result_in_its_figures) {
  // mirrored form: faces turned over; boxy_tee is its own mirror image but for the names of its sleeves
  mesh::SupportMesh mirrored = man();
  mirrored.x.col(0) = -mirrored.x.col(0);
  mirrored.faces.col(1).swap(mirrored.faces.col(2));
  for (auto& [name, at] : mirrored.landmarks) at[0] = -at[0];
  const auto frame = body_frame(man()), other = body_frame(mirrored);
  EXPECT_NEAR((frame->arm_left->origin - Vector3d(-1, 1, 1).cwiseProduct(other->arm_right->origin)).norm(), 0, 1e-3);
  const auto g = boxy_tee();
  const auto a = place(g, man(), {}), b = place(g, mirrored, {});
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_NEAR(a->report.mean_seam_gap, b->report.mean_seam_gap, 0.003);
  EXPECT_NEAR(seam_mean(a->report, g, "shoulder_left"), seam_mean(b->report, g, "shoulder_right"), 0.006);
}

TEST(place, mirrored_garment_on_a_mirrored_body_gives_the_mirrored_result_to_the_last_bit) {
  // no symmetry to rely on: one shoulder lower, the body turned a little, a tee with one longer sleeve
  mesh::SupportMesh body = man();
  for (Eigen::Index v = 0; v < body.x.rows(); ++v) {
    if (body.x(v, 0) > 0) body.x(v, 1) -= 0.05 * body.x(v, 0);
  }
  auto g = boxy_tee();
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 3) g.uv(v, 1) *= 1.1;
  }
  PlaceParams params;
  params.closing_steps = 20, params.swelling_steps = 30, params.settling_steps = 20, params.fine_steps = 10, params.polishing_steps = 20;
  params.panels["front"].shift = {0.01, 0};
  const auto a = place(g, body, params), b = place(mirrored(g), mirrored(body), mirrored(params));
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ((mirrored(a->garment).x - b->garment.x).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(a->report.rms_strain, b->report.rms_strain);
  EXPECT_EQ(a->garment.face_columns.at("warp_angle").reals[5], -b->garment.face_columns.at("warp_angle").reals[5]);
  EXPECT_NE(a->garment.face_columns.at("warp_angle").reals[5], 0);
}

TEST(place, long_sleeves_go_over_bent_elbows) {
  // the forearms of the form turned forwards by 45 degrees
  mesh::SupportMesh body = man();
  for (const double side : {1.0, -1.0}) {
    const auto& mark = body.landmarks.at(side > 0 ? "elbow_left" : "elbow_right");
    const auto& shoulder = body.landmarks.at(side > 0 ? "shoulder_left" : "shoulder_right");
    const Vector3d elbow(mark[0], mark[1], mark[2]), along = (elbow - Vector3d(shoulder[0], shoulder[1], shoulder[2])).normalized();
    const Vector3d axis = along.cross(Vector3d::UnitZ()).normalized();
    for (Eigen::Index v = 0; v < body.x.rows(); ++v) {
      const Vector3d p = body.x.row(v);
      const double s = (p - elbow).dot(along);
      if (side * p.x() < 0.28 || s < -0.04) continue;
      const double t = std::min((s + 0.04) / 0.08, 1.0), angle = std::numbers::pi / 4 * t * t * (3 - 2 * t);
      body.x.row(v) = (elbow + Eigen::AngleAxisd(angle, axis) * (p - elbow)).transpose();
    }
  }
  const auto frame = body_frame(body);
  ASSERT_TRUE(frame.has_value());
  ASSERT_TRUE(frame->arm_left && frame->arm_right);
  auto g = boxy_tee(22);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {  // half as wide at the wrist
    if (g.vertex_panel[v] >= 2) g.uv(v, 0) = 0.28 + (0.5 + 0.5 * g.uv(v, 1) / 0.44) * (g.uv(v, 0) - 0.28);
  }
  const auto placed = place(g, body, {});
  ASSERT_TRUE(placed.has_value()) << to_string(placed.issues().front());
  for (const Issue& finding : placed->findings) ADD_FAILURE() << to_string(finding);
  // a straight sleeve of paper closes on a bent arm no farther than this
  EXPECT_LT(placed->report.mean_seam_gap, 0.03);
  EXPECT_LT(seam_mean(placed->report, g, "underarm_left"), 0.04);
  EXPECT_LT(seam_mean(placed->report, g, "armhole_right"), 0.03);
}

TEST(place, panels_on_true_cones_and_cylinders_keep_all_lengths_on_the_surface) {
  for (const double slope : {-0.3, 0.2, 0.0}) {
    SCOPED_TRACE(slope);
    const double low = 0.18 + std::max(0.0, -slope) * 0.1;
    const mesh::SupportMesh support = round_support([&](double y) { return low + slope * y; });
    mesh::GarmentMesh g;
    add_rectangle(g, "square", 10, 10, 0.016);
    PlaceParams params;
    params.offset = 0.002;
    params.panels["square"] = {.region = Region::torso, .point = "top", .to = {0, 0.3, low + slope * 0.3}, .turn = 0.3};
    const auto placed = place(g, support, params);
    ASSERT_TRUE(placed.has_value()) << to_string(placed.issues().front());
    EXPECT_TRUE(placed->findings.empty());
    const auto unrolled = [&](Eigen::Index v) -> Vector2d {
      const Vector3d p = placed->garment.x.row(v);
      const double r = std::hypot(p.x(), p.z()), angle = std::atan2(p.x(), p.z());
      if (slope == 0) return {r * angle, p.y()};
      const double sine = std::abs(slope) / std::sqrt(1 + slope * slope);
      return r / sine * Vector2d(std::cos(angle * sine), std::sin(angle * sine));
    };
    for (const mesh::Edge& edge : mesh::edges(g.faces)) {
      const double length = (g.uv.row(edge.a) - g.uv.row(edge.b)).norm();
      ASSERT_NEAR((unrolled(edge.a) - unrolled(edge.b)).norm() / length, 1, 1e-6);
    }
    EXPECT_NEAR(placed->report.smallest_gap, 0.002, 2e-4);
    EXPECT_LE(placed->report.max_strain, std::pow(0.016 * std::sqrt(2) / 0.09, 2) / 24);
  }
}

TEST(place, a_tube_keeps_another_distance_over_each_region) {
  const auto support = two_regions();
  const auto g = tube(30, 8);  // 1.2 m round
  PlaceParams params;
  params.offset = 0.002;
  params.offsets = {{"before", 0.003}, {"behind", 0.012}};
  const auto placed = place(g, support, params);
  ASSERT_TRUE(placed.has_value()) << to_string(placed.issues().front());
  for (const Issue& finding : placed->findings) ADD_FAILURE() << to_string(finding);
  double before = 1, behind = 1;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    double& least = placed->garment.x(v, 2) > 0 ? before : behind;
    least = std::min(least, placed->report.vertex_gap[static_cast<std::size_t>(v)]);
  }
  EXPECT_NEAR(before, 0.003, 2e-4);
  EXPECT_NEAR(behind, 0.012, 2e-4);
}

TEST(place, rolled_cloth_too_near_to_a_region_is_moved_off_it) {
  const auto support = two_regions();
  mesh::GarmentMesh g;
  add_rectangle(g, "square", 10, 10, 0.016);
  PlaceParams params;
  params.offset = 0.002;
  params.panels["square"] = {.region = Region::torso, .point = "top", .to = {0, 0.3, 0.18}};
  params.offsets = {{"behind", 0.012}};
  const auto as_rolled = place(g, support, params);
  params.offsets = {{"before", 0.012}};
  const auto moved = place(g, support, params);
  ASSERT_TRUE(as_rolled.has_value() && moved.has_value());
  EXPECT_NEAR(as_rolled->report.smallest_gap, 0.002, 2e-4);
  EXPECT_NEAR(moved->report.smallest_gap, 0.012, 2e-4);
  EXPECT_TRUE(moved->findings.empty());
}

TEST(place, the_fit_of_the_surface_that_panels_were_bent_on_is_reported) {
  PlaceParams params;
  params.panels["front"] = {.region = Region::torso_front, .point = "top", .to = {0, 0.3, 0.18}};
  const auto placed = place(tube(30, 8), two_regions(), params);
  ASSERT_TRUE(placed.has_value());
  ASSERT_EQ(placed->report.fits.size(), 1u);
  EXPECT_EQ(placed->report.fits[0].part, Part::trunk);
  // 1.2 m of cloth, and 6 mm at each seam where the panels start apart
  EXPECT_NEAR(placed->report.fits[0].rms, 1.212 / (2 * std::numbers::pi) - 0.18, 2e-4);
  EXPECT_NEAR(placed->report.fits[0].largest, placed->report.fits[0].rms, 2e-4);
}

TEST(place, a_panel_over_a_cylinder_and_the_cone_on_it_keeps_its_lengths) {
  auto support = round_support([](double y) { return 0.16 + 0.2 * std::max(0.0, y - 0.2); });
  support.region_names = {"cylinder", "cone"};
  for (Eigen::Index f = 0; f < support.faces.rows(); ++f) {
    double y = 0;
    for (int k = 0; k < 3; ++k) y += support.x(support.faces(f, k), 1) / 3;
    support.face_region[f] = y < 0.2 ? 0 : 1;
  }
  PlaceParams params;
  params.offset = 0.002;
  params.offsets = {{"cone", 0.003}};
  params.panels["square"] = {.region = Region::torso, .point = "top", .to = {0, 0.3, 0.18}};
  mesh::GarmentMesh g;
  add_rectangle(g, "square", 10, 10, 0.02);
  const auto placed = place(g, support, params);
  ASSERT_TRUE(placed.has_value()) << to_string(placed.issues().front());
  for (const Issue& finding : placed->findings) ADD_FAILURE() << to_string(finding);
  EXPECT_LT(placed->garment.x.col(1).minCoeff(), 0.15);  // over both
  EXPECT_GT(placed->garment.x.col(1).maxCoeff(), 0.25);
  EXPECT_LE(placed->report.max_strain, 0.001);
  EXPECT_LE(placed->report.rms_strain, 0.0005);
  EXPECT_NEAR(placed->report.smallest_gap, 0.003, 2e-4);
}

TEST(place, an_offset_over_no_region_names_the_regions) {
  PlaceParams params;
  params.offsets = {{"befor", 0.003}, {"above", 0.003}};
  const auto g = tube(30, 8);
  const auto support = two_regions();
  for (const auto& placed : {place(g, support, params), place_from(g, g.x, support, params)}) {
    ASSERT_FALSE(placed.has_value());
    EXPECT_EQ(codes(placed.issues()), (std::vector<std::string>{"unknown_region", "unknown_region"}));
    EXPECT_NE(placed.issues().front().what.find("before, behind"), std::string::npos);
  }
}

// A tube with a lining: mirrored copies inside of its panels.
mesh::GarmentMesh lined_tube() {
  auto g = tube(30, 8);
  add_rectangle(g, "front_lining", 30, 8, kCell);
  add_rectangle(g, "back_lining", 30, 8, kCell);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] >= 2) g.uv(v, 0) = -g.uv(v, 0);
  }
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    if (g.face_panel[f] >= 2) std::swap(g.faces(f, 1), g.faces(f, 2));
  }
  const int hem = add_seam(g, "hem");
  for (const int panel : {2, 3}) {
    g.panels[static_cast<std::size_t>(panel)].mirrored = true;
    g.panels[static_cast<std::size_t>(panel)].order = -1;
    for (int i = 0; i <= 30; ++i) g.welds.push_back({at(g, panel, 30, i, 0), at(g, panel - 2, 30, i, 0), hem});
  }
  g.free_layers.push_back({.id = 0, .name = "lining", .panels = {2, 3}, .on = {0, 1}});
  return g;
}

TEST(layers, lie_on_the_back_of_their_panels) {
  auto g = lined_tube();
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 1) g.x(v, 0) += 1;  // beside the front: as cut, both lie in one place
  }
  const auto laid = lay_layers(g, g.x, 0.0015);
  ASSERT_TRUE(laid.has_value());
  EXPECT_EQ(laid->cuts, 0);
  ASSERT_EQ(laid->places.size(), 2u);
  for (const LayerPlace& place : laid->places) {
    EXPECT_EQ(place.on, place.panel - 2);
    EXPECT_TRUE(place.face_inwards);
  }
  const int v = at(g, 2, 30, 11, 4), under = at(g, 0, 30, 11, 4);
  EXPECT_LT((laid->x.row(v) - laid->x.row(under) - Eigen::RowVector3d(0, 0, -0.0015)).norm(), 1e-9);
}

TEST(place, lines_a_tube) {
  const auto g = lined_tube();
  const auto placed = place(g, two_regions(), {});
  ASSERT_TRUE(placed.has_value());
  EXPECT_TRUE(placed->findings.empty());
  EXPECT_LE(placed->report.max_strain, 0.005);
  EXPECT_TRUE(placed->report.self_intersections.empty());
  EXPECT_EQ(placed->report.vertices_inside, 0);
  // The lining is nearer to the axis than what it lies on.
  for (const int i : {3, 15, 27}) {
    const Vector3d inner = placed->garment.x.row(at(g, 2, 30, i, 4)), outer = placed->garment.x.row(at(g, 0, 30, i, 4));
    EXPECT_LT(std::hypot(inner.x(), inner.z()), std::hypot(outer.x(), outer.z()));
  }
}

TEST(place, refuses_free_layers_that_nothing_brings_onto_their_panels) {
  auto g = lined_tube();
  std::erase_if(g.welds, [](const mesh::Weld& weld) { return weld.seam == 2; });
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 3) g.uv(v, 1) += 5;
  }
  const auto laid = lay_layers(g, g.x, 0.0015);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(codes(laid.issues()), std::vector<std::string>{"free_layer"});
  EXPECT_NE(laid.issues().front().place.item.find("back_lining"), std::string::npos);
  PlaceParams params;
  params.panels["front_lining"].turn = 0.1;
  const auto placed = place(lined_tube(), two_regions(), params);
  ASSERT_FALSE(placed.has_value());
  EXPECT_EQ(codes(placed.issues()), std::vector<std::string>{"free_layer"});
}

TEST(place, same_bytes_at_any_thread_count) {
  const auto g = boxy_tee();
  PlaceParams params;
  params.closing_steps = 5, params.swelling_steps = 10, params.settling_steps = 5, params.polishing_steps = 5;
  std::vector<std::string> bytes;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    bytes.push_back(io::format_garment(place(g, man(), params)->garment, io::Encoding::binary));
  }
  set_thread_count(0);
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_EQ(bytes[0], bytes[2]);
}

TEST(place, says_when_panels_are_too_narrow) {
  const auto placed = place(tube(20, 15), man(), {});  // 0.8 m round the hips of 0.93 m
  ASSERT_FALSE(placed.has_value());
  EXPECT_EQ(placed.issues().front().code, "too_narrow");
  EXPECT_NE(placed.issues().front().place.item.find("front"), std::string::npos);
}

TEST(place, says_when_a_sleeve_is_too_narrow) {
  auto g = boxy_tee();
  // the left sleeve's pattern shrinks to half: 0.28 m round an arm of 0.32 m
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 3) g.uv(v, 0) *= 0.5;
  }
  const auto placed = place(g, man(), {});
  ASSERT_FALSE(placed.has_value());
  EXPECT_EQ(placed.issues().front().code, "too_narrow");
  EXPECT_NE(placed.issues().front().place.item.find("sleeve_m"), std::string::npos);
}

TEST(place, says_when_there_is_no_arm) {
  mesh::SupportMesh trunk = man();
  form::Measurements m;
  const auto frame = body_frame(trunk);
  ASSERT_TRUE(frame.has_value());
  BodyFrame armless = *frame;
  armless.arm_left.reset();
  const auto layout = make_layout(boxy_tee(), fold_flat(boxy_tee()), trunk, armless, {});
  ASSERT_FALSE(layout.has_value());
  EXPECT_EQ(layout.issues().front().code, "no_arm");
  EXPECT_NE(layout.issues().front().place.item.find("sleeve_m"), std::string::npos);
}

// ---- legs

namespace {

// A trunk on two legs, 0.2 m apart.
const mesh::SupportMesh& stander() {
  static const mesh::SupportMesh mesh = [] {
    mesh::SupportMesh soup;
    const auto cylinder = [&](double x, double radius, double low, double high) {
      constexpr int n = 40;
      const auto base = static_cast<int>(soup.x.rows()), first = static_cast<int>(soup.faces.rows());
      soup.x.conservativeResize(base + 2 * n + 2, 3);
      soup.faces.conservativeResize(first + 4 * n, 3);
      for (int i = 0; i < n; ++i) {
        const double angle = 2 * M_PI * i / n;
        soup.x.row(base + i) << x + radius * std::sin(angle), low, radius * std::cos(angle);
        soup.x.row(base + n + i) << x + radius * std::sin(angle), high, radius * std::cos(angle);
        const int j = (i + 1) % n, f = first + 4 * i;
        soup.faces.row(f) << base + i, base + j, base + n + j;
        soup.faces.row(f + 1) << base + i, base + n + j, base + n + i;
        soup.faces.row(f + 2) << base + 2 * n, base + j, base + i;
        soup.faces.row(f + 3) << base + 2 * n + 1, base + n + i, base + n + j;
      }
      soup.x.row(base + 2 * n) << x, low, 0;
      soup.x.row(base + 2 * n + 1) << x, high, 0;
    };
    cylinder(0, 0.18, 0.75, 1.3);
    cylinder(0.1, 0.07, 0, 0.8);
    cylinder(-0.1, 0.07, 0, 0.8);
    const geometry::Wrap wrap = geometry::wrap(soup.x, soup.faces, 0.03, 0.004);
    mesh::SupportMesh body;
    body.x = wrap.x;
    body.faces = wrap.faces;
    body.face_region = mesh::Ids::Zero(wrap.faces.rows());
    return body;
  }();
  return mesh;
}

// The same with the legs bent at the knee: shins go back by 35 mm in 100 below 0.35 m.
double knee_shift(double y) { return y < 0.35 ? -0.35 * (0.35 - y) : 0; }
mesh::SupportMesh kneeling() {
  mesh::SupportMesh body = stander();
  for (Eigen::Index v = 0; v < body.x.rows(); ++v) body.x(v, 2) += knee_shift(body.x(v, 1));
  return body;
}

// Two leg tubes, each of a front and a back.
mesh::GarmentMesh leg_tubes(int nu, int nv) {
  mesh::GarmentMesh g;
  for (const char* name : {"front_leg_left", "back_leg_left", "front_leg_right", "back_leg_right"}) add_rectangle(g, name, nu, nv, kCell);
  for (const int p : {0, 2}) {
    const int a = add_seam(g, "a" + std::to_string(p)), b = add_seam(g, "b" + std::to_string(p));
    for (int j = 0; j <= nv; ++j) g.welds.push_back({at(g, p, nu, nu, j), at(g, p + 1, nu, 0, j), a});
    for (int j = 0; j <= nv; ++j) g.welds.push_back({at(g, p, nu, 0, j), at(g, p + 1, nu, nu, j), b});
  }
  return g;
}

}  // namespace

TEST(body_frame, finds_two_legs_or_none) {
  const auto frame = body_frame(stander());
  ASSERT_TRUE(frame.has_value());
  EXPECT_NEAR(frame->crotch, 0.75, 0.015);
  ASSERT_TRUE(frame->leg_left && frame->leg_right);
  for (const auto& [leg, x] : {std::pair(*frame->leg_left, 0.1), std::pair(*frame->leg_right, -0.1)}) {
    EXPECT_GT(leg.points.size(), 65u);
    for (const LimbPoint& point : leg.points) {
      EXPECT_NEAR(point.centre.x(), x, 0.004);
      // above, the ball of the wrap fills the corner between leg and trunk
      if (point.centre.y() > 0.72) continue;
      EXPECT_NEAR(point.girth, 2 * M_PI * 0.074, 0.02);
    }
    EXPECT_GT(leg.direction.dot(-Vector3d::UnitY()), 0.999);
  }
  const auto form = body_frame(man());
  EXPECT_FALSE(form->leg_left || form->leg_right);
}

TEST(place, legs_go_over_legs_without_stretch) {
  for (const double side : {1.0, -1.0}) {  // the second body is worked on as its mirror image, names stay
    mesh::SupportMesh body = stander();
    if (side < 0) body = mirrored(body);
    const auto placed = place(leg_tubes(14, 30), body, {});
    ASSERT_TRUE(placed.has_value()) << placed.issues().front().what;
    EXPECT_TRUE(placed->findings.empty());
    EXPECT_LT(placed->report.max_strain, 0.005);
    EXPECT_LT(placed->report.rms_strain, 0.001);
    EXPECT_TRUE(placed->report.self_intersections.empty());
    EXPECT_TRUE(placed->report.support_intersections.empty());
    EXPECT_LT(placed->report.mean_seam_gap, 0.008);
    std::array<Vector3d, 4> middle{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    for (Eigen::Index v = 0; v < placed->garment.vertex_count(); ++v) middle[static_cast<std::size_t>(placed->garment.vertex_panel[v])] += placed->garment.x.row(v).transpose() / (15.0 * 31.0);
    for (std::size_t p = 0; p < 4; ++p) {
      EXPECT_NEAR(middle[p].x(), p < 2 ? 0.11 : -0.11, 0.03);
      EXPECT_GT((p % 2 == 0 ? 1 : -1) * middle[p].z(), 0.03);
    }
  }
}

TEST(place, says_when_legs_are_missing_unknown_or_too_thick) {
  const auto missing = place(leg_tubes(14, 10), man(), {});
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(codes(missing.issues()), std::vector<std::string>(4, "no_legs"));
  const auto narrow = place(leg_tubes(10, 10), stander(), {});
  ASSERT_FALSE(narrow.has_value());
  EXPECT_EQ(codes(narrow.issues()), std::vector<std::string>(2, "too_narrow"));
  auto g = leg_tubes(14, 10);
  g.panels[0].name = g.panels[0].piece = "front_leg";
  g.panels[1].name = g.panels[1].piece = "back_leg";
  const auto unknown = place(g, stander(), {});
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(codes(unknown.issues()), std::vector<std::string>(2, "no_region"));
}

TEST(legs, the_axis_follows_bent_legs_and_stays_straight_on_straight_ones) {
  const auto frame = body_frame(stander());
  const LegAxis straight(*frame->leg_left, LegAxis::Shape::tube);
  EXPECT_NEAR(straight.at(0).middle.y(), frame->leg_left->origin.y(), 1e-12);
  EXPECT_NEAR(straight.at(straight.height(0.3)).middle.y(), 0.3, 1e-9);
  EXPECT_NEAR((straight.at(-0.1).up - straight.at(-0.6).up).norm(), 0, 1e-12);

  const auto bent = body_frame(kneeling());
  ASSERT_TRUE(bent && bent->leg_left);
  const LegAxis axis(*bent->leg_left, LegAxis::Shape::tube);
  double last = 1;
  for (const double y : {0.6, 0.5, 0.35, 0.2}) {
    const double h = axis.height(y);
    EXPECT_LT(h, last);
    last = h;
    const LegAxis::Place place = axis.at(h);
    EXPECT_NEAR(place.middle.y(), y, 1e-9);
    EXPECT_NEAR(place.middle.z(), knee_shift(y), 0.012);
    EXPECT_NEAR(place.up.cross(place.front).dot(place.left), 1, 1e-9);
  }
  EXPECT_NEAR(axis.height(0.6) - axis.height(0.2), 0.25 + std::hypot(0.15, 0.35 * 0.15), 0.02) << "by length along the leg";
}

TEST(place, tubes_follow_bent_legs) {
  const auto placed = place(leg_tubes(14, 32), kneeling(), {});
  ASSERT_TRUE(placed.has_value()) << placed.issues().front().what;
  EXPECT_LT(placed->report.max_strain, 0.005);
  EXPECT_LT(placed->report.rms_strain, 0.001);
  EXPECT_EQ(placed->report.vertices_inside, 0);
  EXPECT_TRUE(placed->report.self_intersections.empty());
  // cells of 20 mm bridge the sharp knee
  EXPECT_LE(placed->report.support_intersections.size(), 4u);
  EXPECT_LT(placed->report.mean_seam_gap, 0.008);
  // the lowest row surrounds the shin
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i <= 14; ++i) middle += (placed->garment.x.row(at(placed->garment, 0, 14, i, 0)) + placed->garment.x.row(at(placed->garment, 1, 14, i, 0))).transpose() / 30;
  EXPECT_NEAR(middle.z(), knee_shift(middle.y()), 0.03);
}

TEST(layout, leg_tubes_start_at_the_crotch_or_where_an_anchor_says) {
  const auto g = leg_tubes(14, 20);
  const auto frame = body_frame(stander());
  const auto top = [&](const Layout& layout, int panel) { return layout.panels[static_cast<std::size_t>(panel)](Vector2d(7 * kCell, 20 * kCell)); };
  const LegAxis axis(*frame->leg_left, LegAxis::Shape::tube);
  const auto free = make_layout(g, fold_flat(g), stander(), *frame, with_named_legs(g, {}));
  ASSERT_TRUE(free.has_value());
  EXPECT_NEAR(axis.at(top(*free, 0).y()).middle.y(), frame->crotch, 0.011);

  PlaceParams params;
  params.panels["front_leg_left"].point = "bottom";
  params.panels["front_leg_left"].to = {0.17, 0.2, 0};  // the outside of the leg
  const auto to = make_layout(g, fold_flat(g), stander(), *frame, with_named_legs(g, params));
  ASSERT_TRUE(to.has_value()) << to.issues().front().what;
  EXPECT_NEAR(axis.at(top(*to, 0).y() - 20 * kCell).middle.y(), 0.2, 1e-6);
  EXPECT_NEAR(top(*to, 0).x() / to->girth_leg_left, 0.25, 0.03);
  EXPECT_NEAR(top(*to, 2).y(), top(*free, 2).y(), 1e-9) << "the other leg stays";
  params.panels["front_leg_left"].to.clear();
  params.panels["front_leg_left"].point = "top_left";
  const auto usual = make_layout(g, fold_flat(g), stander(), *frame, with_named_legs(g, params));
  EXPECT_NEAR(axis.at(top(*usual, 0).y()).middle.y(), frame->crotch, 1e-6) << "without `at`: the crotch";

  const auto refused = [&](const PanelSpec& spec) {
    PlaceParams wrong;
    wrong.panels["front_leg_left"] = spec;
    const auto layout = make_layout(g, fold_flat(g), stander(), *frame, with_named_legs(g, wrong));
    return layout ? std::string() : layout.issues().front().code + " " + layout.issues().front().place.item;
  };
  EXPECT_EQ(refused({.region = Region::automatic, .point = "top", .at = {}, .to = {-0.17, 0.2, 0}}), "off_support panels.front_leg_left.to");  // the other leg
  EXPECT_EQ(refused({.region = Region::automatic, .point = "top", .at = {}, .to = {0.18, 1.1, 0}}), "off_support panels.front_leg_left.to");   // the trunk
  EXPECT_EQ(refused({.region = Region::automatic, .point = "tip", .at = {}, .to = {}}), "unknown_anchor panels.front_leg_left.point");
}

TEST(layout, panels_of_arms_have_no_anchor) {
  const auto g = boxy_tee();
  const auto frame = body_frame(man());
  PlaceParams params;
  params.panels[g.panels[2].name].point = "top";
  const auto layout = make_layout(g, fold_flat(g), man(), *frame, params);
  ASSERT_FALSE(layout.has_value());
  EXPECT_EQ(codes(layout.issues()), std::vector<std::string>{"bad_anchor"});
}
