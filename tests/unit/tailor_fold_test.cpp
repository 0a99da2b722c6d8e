#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "garments.h"
#include "toile/io/pattern_yaml.h"
#include "toile/mesh/topology.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/sew.h"

using namespace toile;
using std::numbers::pi;

namespace {

constexpr double degree = pi / 180;

/// A rectangle with the inner line "line" along its column `at`, from bottom to top; its other inner vertices moved at random
/// by up to `jitter` cells.
mesh::GarmentMesh sheet(int nu, int nv, double h, int at, double jitter = 0) {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "p", nu, nv, h);
  const int run = static_cast<int>(g.runs.size());
  g.runs.push_back({.id = run, .panel = 0, .name = "line", .length = nv * h, .internal = true});
  for (int j = 0; j <= nv; ++j) g.run_vertices.push_back({run, j * (nu + 1) + at, j * h});
  std::mt19937 random(7);
  const auto number = [&] { return jitter * h * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1); };
  for (int j = 1; j < nv; ++j) {
    for (int i = 1; i < nu; ++i) {
      const double du = number(), dv = number();
      if (i == at) continue;
      const int v = j * (nu + 1) + i;
      g.uv(v, 0) += du;
      g.uv(v, 1) += dv;
      g.x.row(v) << g.uv(v, 0), g.uv(v, 1), 0;
    }
  }
  return g;
}

tailor::FoldSpec spec(const std::string& line, double angle, double radius = 0, double residual = 0) {
  tailor::FoldSpec fold;
  fold.name = "f";
  fold.line = {line};
  fold.angle = angle;
  fold.radius = radius;
  fold.residual = residual;
  return fold;
}

tailor::Folded folded(const mesh::GarmentMesh& g, const std::vector<tailor::FoldSpec>& folds) {
  auto result = tailor::add_folds(g, folds);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  if (!result) return {};
  for (const Issue& issue : mesh::validate(result->garment)) ADD_FAILURE() << to_string(issue);
  return *result;
}

std::string first_code(const mesh::GarmentMesh& g, const std::vector<tailor::FoldSpec>& folds) {
  const auto result = tailor::add_folds(g, folds);
  return result ? "none" : result.issues().front().code;
}

/// The sheet laid on a cylinder whose axis goes along `axis` through `at`, over an arc of the given radius, with flat ends.
Eigen::Vector3d rolled(const Eigen::Vector2d& p, const Eigen::Vector2d& at, const Eigen::Vector2d& axis, double angle, double radius) {
  const Eigen::Vector2d across(-axis.y(), axis.x());
  const double t = across.dot(p - at), half = radius * std::abs(angle) / 2;
  double y = t, z = 0;
  if (std::abs(t) <= half) {
    y = radius * std::sin(t / radius);
    z = radius * (1 - std::cos(t / radius));
  } else {
    const double more = std::abs(t) - half, a = std::abs(angle) / 2;
    y = std::copysign(radius * std::sin(a) + more * std::cos(a), t);
    z = radius * (1 - std::cos(a)) + more * std::sin(a);
  }
  const Eigen::Vector2d flat = at + axis.dot(p - at) * axis + y * across;
  return {flat.x(), flat.y(), angle > 0 ? z : -z};
}

/// Largest difference between an edge's angle in shape x and at rest (its hinge, or flat).
double bending_residual(const mesh::GarmentMesh& g, const mesh::Points3& x) {
  std::map<std::pair<int, int>, double> rest;
  for (const auto& h : g.hinges) rest[{std::min(h.v0, h.v1), std::max(h.v0, h.v1)}] = h.rest_angle;
  double worst = 0;
  for (const auto& edge : mesh::edges(g.faces)) {
    if (edge.faces.size() != 2) continue;
    std::array<int, 2> opposite{};
    int a = edge.a, b = edge.b;
    for (std::size_t f = 0; f < 2; ++f) {
      for (int k = 0; k < 3; ++k) {
        const int v = g.faces(edge.faces[f], k);
        if (v != edge.a && v != edge.b) opposite[f] = v;
        if (f == 0 && v == edge.b && g.faces(edge.faces[f], (k + 1) % 3) == edge.a) a = edge.b, b = edge.a;
      }
    }
    const auto found = rest.find({edge.a, edge.b});
    const double wanted = found == rest.end() ? 0 : found->second;
    worst = std::max(worst, std::abs(tailor::hinge_angle(x.row(a), x.row(b), x.row(opposite[0]), x.row(opposite[1])) - wanted));
  }
  return worst;
}

mesh::Points3 on_cylinder(const mesh::GarmentMesh& g, const Eigen::Vector2d& at, const Eigen::Vector2d& axis, double angle, double radius) {
  mesh::Points3 x(g.vertex_count(), 3);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) x.row(v) = rolled(g.uv.row(v), at, axis, angle, radius);
  return x;
}

/// Follows the straight way from p to q from triangle to triangle. Turns each about the shared side by the hinge's rest
/// angle, keeping the flat triangles' shapes; returns by how much the last is turned against the first.
Eigen::AngleAxisd turn_along(const mesh::GarmentMesh& g, const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::map<std::pair<int, int>, double> rest;
  for (const auto& h : g.hinges) rest[{std::min(h.v0, h.v1), std::max(h.v0, h.v1)}] = h.rest_angle;
  struct Crossing {
    double at;
    Eigen::Vector2d along;
    double angle;
  };
  std::vector<Crossing> crossings;
  const Eigen::Vector2d way = q - p;
  for (const auto& edge : mesh::edges(g.faces)) {
    const auto found = rest.find({edge.a, edge.b});
    if (found == rest.end()) continue;
    Eigen::Vector2d a = g.uv.row(edge.a), d = (g.uv.row(edge.b) - g.uv.row(edge.a)).transpose();
    const double det = way.x() * d.y() - way.y() * d.x();
    const double along = ((a - p).x() * d.y() - (a - p).y() * d.x()) / det, on_edge = ((a - p).x() * way.y() - (a - p).y() * way.x()) / det;
    if (along < 0 || along > 1 || on_edge < 0 || on_edge > 1) continue;
    if (det > 0) d = -d;
    crossings.push_back({along, d.normalized(), found->second});
  }
  std::sort(crossings.begin(), crossings.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  // In the frame of each triangle the shared side lies as in the flat sheet.
  for (const auto& c : crossings) turn = turn * Eigen::AngleAxisd(c.angle, Eigen::Vector3d(c.along.x(), c.along.y(), 0)).toRotationMatrix();
  return Eigen::AngleAxisd(turn);
}

}  // namespace

TEST(fold, the_angle_is_positive_where_face_sides_turn_towards_each_other) {
  const Eigen::Vector3d v0(0, 0, 0), v1(0, 1, 0);
  for (const double a : {-2.5, -0.3, 0.0, 0.4, 3.0}) {
    // Flat left half; the right half is lifted towards +z, which both triangles have as their face side.
    EXPECT_NEAR(tailor::hinge_angle(v0, v1, {-1, 0.2, 0}, {std::cos(a), 0.7, std::sin(a)}), a, 1e-14);
  }
}

TEST(fold, a_crease_has_one_hinge_an_edge) {
  const auto g = sheet(6, 5, 0.01, 2);
  const auto result = folded(g, {spec("p.line", 150 * degree, 0, 0.1)});
  ASSERT_EQ(result.garment.folds.size(), 1u);
  EXPECT_NEAR(result.garment.folds[0].angle, 135 * degree, 1e-14);
  EXPECT_EQ(result.garment.folds[0].runs, std::vector<int>{4});
  ASSERT_EQ(result.garment.hinges.size(), 5u);
  for (const auto& h : result.garment.hinges) {
    EXPECT_EQ(h.rest_angle, result.garment.folds[0].angle);
    EXPECT_EQ(h.fold, 0);
    EXPECT_NEAR(g.uv(h.v0, 0), 0.02, 1e-15);
    EXPECT_NEAR(g.uv(h.v1, 0), 0.02, 1e-15);
    bool own = false, other = false;
    for (Eigen::Index f = 0; f < g.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = g.faces(f, k), b = g.faces(f, (k + 1) % 3), c = g.faces(f, (k + 2) % 3);
        own = own || (a == h.v0 && b == h.v1 && c == h.o0);
        other = other || (a == h.v1 && b == h.v0 && c == h.o1);
      }
    }
    EXPECT_TRUE(own && other);
  }
  EXPECT_EQ(result.folds[0].hinges, 5);
  EXPECT_EQ(result.folds[0].band, 0);
  EXPECT_NEAR(result.folds[0].length, 0.05, 1e-15);
}

TEST(fold, creased_sheets_are_flat_on_both_sides) {
  for (const double angle : {-170 * degree, 20 * degree, 179 * degree}) {
    const auto result = folded(sheet(6, 5, 0.01, 2, 0.3), {spec("p.line", angle)});
    EXPECT_LT(bending_residual(result.garment, on_cylinder(result.garment, {0.02, 0}, {0, 1}, angle, 1e-12)), 1e-6);
  }
}

TEST(fold, a_roll_on_a_grid_sums_to_its_angle_in_every_row) {
  const auto g = sheet(12, 6, 0.01, 6);
  for (const double angle : {160 * degree, -90 * degree}) {
    for (const double radius : {0.001, 0.005, 0.015}) {
      const auto result = folded(g, {spec("p.line", angle, radius, 0.1)});
      std::map<long, double> rows;
      for (const auto& h : result.garment.hinges) {
        EXPECT_NEAR(g.uv(h.v0, 0), g.uv(h.v1, 0), 1e-15) << "a hinge is not parallel to the fold";
        rows[std::lround((g.uv(h.v0, 1) + g.uv(h.v1, 1)) * 50)] += h.rest_angle;
      }
      ASSERT_EQ(rows.size(), 6u);
      for (const auto& [row, sum] : rows) EXPECT_NEAR(sum, 0.9 * angle, 1e-12);
      EXPECT_NEAR(result.folds[0].band, radius * std::abs(angle), 1e-15) << "springing back does not change how much cloth is bent";
    }
  }
}

TEST(fold, a_cylinder_is_at_rest_on_every_mesh) {
  // Angle and radius as they are at rest; the sheet bent to them has no bending left, inside the band and beside it.
  for (const double jitter : {0.0, 0.35}) {
    for (const double radius : {0.0005, 0.004, 0.012}) {
      const double angle = 140 * degree;
      const auto result = folded(sheet(16, 8, 0.01, 8, jitter), {spec("p.line", angle, radius)});
      EXPECT_LT(bending_residual(result.garment, on_cylinder(result.garment, {0.08, 0}, {0, 1}, angle, radius)), 1e-9) << jitter << " " << radius;
    }
  }
}

TEST(fold, a_cylinder_across_the_grid_is_at_rest) {
  // A break line at an angle to the grain, as the mesher cuts it.
  const auto pattern = io::parse_pattern(R"(units: mm
y: up
pieces:
  p:
    cut: 1
    identical: true
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [200, 0], c: [200, 300], d: [0, 300]}
    outline:
      - {name: bottom, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
    lines:
      break: {kind: fold, path: [[80, 0], [130, 300]]}
)",
                                         "p.yaml");
  ASSERT_TRUE(pattern) << to_string(pattern.issues().front());
  const auto panels = pattern::cut_panels(*pattern);
  ASSERT_TRUE(panels);
  tailor::MeshParams params;
  params.lines = {"p.break"};
  const auto g = tailor::mesh_panels(*panels, params);
  ASSERT_TRUE(g);
  const Eigen::Vector2d at = g->uv.row(mesh::run_vertex_ids(*g, 4).front()), axis = Eigen::Vector2d(50, 300).normalized();
  for (const double angle : {175 * degree, -60 * degree}) {
    for (const double radius : {0.0, 0.003, 0.01}) {
      const auto result = folded(*g, {spec("p.break", angle, radius)});
      EXPECT_LT(bending_residual(result.garment, on_cylinder(result.garment, at, axis, angle, std::max(radius, 1e-13))), 1e-6) << angle << " " << radius;
    }
  }
}

TEST(fold, the_angles_crossed_on_any_way_over_the_fold_sum_to_its_angle) {
  // Small angles add up like vectors along the edges; only the part about the fold line counts.
  const double radius = 0.02, tiny = 0.5 * degree;
  const auto small = folded(sheet(16, 8, 0.01, 8, 0.35), {spec("p.line", tiny, radius / tiny)}).garment;
  for (const double v : {0.021, 0.038, 0.0555}) {
    const auto turn = turn_along(small, {0.001, v}, {0.159, v + 0.004});
    EXPECT_NEAR(turn.angle(), tiny, 2e-3 * tiny);
    EXPECT_NEAR(std::abs(turn.axis().y()), 1, 1e-3);
  }
  // Great angles: the triangles keep the shapes of the flat sheet, whose chords are a little longer than on the cylinder.
  double before = 0;
  for (const int fine : {1, 2, 4}) {
    const auto g = folded(sheet(16 * fine, 8 * fine, 0.01 / fine, 8 * fine, 0.35), {spec("p.line", 120 * degree, 0.03)}).garment;
    const auto turn = turn_along(g, {0.001, 0.021}, {0.159, 0.025});
    const double error = std::abs(turn.angle() - 120 * degree);
    EXPECT_LT(error, 1.0 * degree / (fine * fine));
    if (fine > 1) {
      EXPECT_LT(error, before);
    }
    before = error;
    EXPECT_LT(turn.axis().y(), -0.999) << "a positive angle turns the right side towards +z, the face side";
  }
}

TEST(fold, a_line_that_ends_inside_folds_no_further) {
  auto g = sheet(12, 8, 0.01, 6);
  // Keep the lower half of the line.
  std::erase_if(g.run_vertices, [](const auto& r) { return r.run == 4 && r.s > 0.041; });
  g.runs[4].length = 0.04;
  for (const double radius : {0.0, 0.01}) {
    const auto result = folded(g, {spec("p.line", 90 * degree, radius)});
    for (const auto& h : result.garment.hinges) EXPECT_LE(std::min(g.uv(h.v0, 1), g.uv(h.v1, 1)), 0.04 - 1e-9);
    for (const auto& h : result.garment.hinges) EXPECT_LE(std::max(g.uv(h.v0, 1), g.uv(h.v1, 1)), 0.04 + 1e-9);
    EXPECT_GE(result.garment.hinges.size(), 4u);
  }
}

TEST(fold, a_curved_roll_line_turns_by_its_angle_everywhere) {
  // A quarter of a ring between radii 100 and 180 mm, rolled along its middle: the curvature of the line is left out of
  // account, which matters less the narrower the band.
  mesh::GarmentMesh g;
  const int nu = 16, nv = 30;
  test::add_rectangle(g, "p", nu, nv, 0.005);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const double r = 0.10 + 0.005 * static_cast<double>(v % (nu + 1)), a = pi / 2 * static_cast<double>(v / (nu + 1)) / nv;
    g.uv.row(v) << r * std::cos(a), r * std::sin(a);
    g.x.row(v) << g.uv(v, 0), g.uv(v, 1), 0;
  }
  g.runs.push_back({.id = 4, .panel = 0, .name = "line", .length = 0.14 * pi / 2, .internal = true});
  for (int j = 0; j <= nv; ++j) g.run_vertices.push_back({4, j * (nu + 1) + 8, 0.14 * pi / 2 * j / nv});
  const double angle = 2 * degree;
  const auto result = folded(g, {spec("p.line", angle, 0.02 / angle)});
  for (int j = 2; j < nv - 2; ++j) {
    const double a = pi / 2 * (j + 0.4) / nv;
    const Eigen::Vector2d out(std::cos(a), std::sin(a));
    EXPECT_NEAR(turn_along(result.garment, 0.101 * out, 0.179 * out).angle(), angle, 0.01 * angle);
  }
}

TEST(fold, mirrored_panels_have_the_same_folds) {
  auto g = sheet(12, 6, 0.01, 4, 0.3);
  auto m = g;
  m.uv.col(0) *= -1;
  m.x.col(0) *= -1;
  m.faces.col(1).swap(m.faces.col(2));
  for (const double radius : {0.0, 0.008}) {
    const auto a = folded(g, {spec("p.line", 100 * degree, radius)}).garment.hinges, b = folded(m, {spec("p.line", 100 * degree, radius)}).garment.hinges;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(std::minmax(a[k].v0, a[k].v1), std::minmax(b[k].v0, b[k].v1));
      EXPECT_NEAR(a[k].rest_angle, b[k].rest_angle, 1e-12);
    }
  }
}

TEST(fold, hinges_can_be_made_anew_and_do_not_depend_on_the_order_of_folds) {
  auto g = sheet(12, 6, 0.01, 4);
  g.runs.push_back({.id = 5, .panel = 0, .name = "second", .length = 0.06, .internal = true});
  for (int j = 0; j <= 6; ++j) g.run_vertices.push_back({5, j * 13 + 9, j * 0.01});
  auto one = spec("p.line", 100 * degree, 0.01), two = spec("p.second", -170 * degree);
  two.name = "e";
  const auto a = folded(g, {one, two}).garment, b = folded(g, {two, one}).garment;
  ASSERT_EQ(a.hinges.size(), b.hinges.size());
  EXPECT_EQ(a.folds[0].name, "e");
  EXPECT_EQ(b.folds[0].name, "e");
  const auto anew = tailor::fold_hinges(a);
  ASSERT_TRUE(anew);
  ASSERT_EQ(anew->size(), a.hinges.size());
  for (std::size_t k = 0; k < a.hinges.size(); ++k) {
    EXPECT_EQ(a.hinges[k].v0, b.hinges[k].v0);
    EXPECT_EQ(a.hinges[k].rest_angle, b.hinges[k].rest_angle);
    EXPECT_EQ((*anew)[k].rest_angle, a.hinges[k].rest_angle);
    EXPECT_EQ((*anew)[k].fold, a.hinges[k].fold);
  }
}

TEST(fold, overlapping_rolls_add_up) {
  auto g = sheet(20, 6, 0.01, 9);
  g.runs.push_back({.id = 5, .panel = 0, .name = "second", .length = 0.06, .internal = true});
  for (int j = 0; j <= 6; ++j) g.run_vertices.push_back({5, j * 21 + 11, j * 0.01});
  auto one = spec("p.line", 60 * degree, 0.04), two = spec("p.second", 60 * degree, 0.04);
  two.name = "g";
  const auto result = folded(g, {one, two});
  double sum = 0;
  std::set<std::pair<int, int>> edges;
  for (const auto& h : result.garment.hinges) {
    EXPECT_TRUE(edges.insert(std::minmax(h.v0, h.v1)).second) << "an edge has two hinges";
    if (g.uv(h.v0, 1) + g.uv(h.v1, 1) < 0.015) sum += h.rest_angle;
  }
  EXPECT_NEAR(sum, 120 * degree, 1e-12);
}

TEST(fold, what_cannot_be_folded) {
  const auto g = sheet(12, 6, 0.01, 4);
  EXPECT_EQ(first_code(g, {spec("p.right", 1)}), "free_border");
  EXPECT_EQ(first_code(g, {spec("p.right", 1, 0.001)}), "roll_on_border");
  EXPECT_EQ(first_code(g, {spec("p.line", pi)}), "flat_fold");
  EXPECT_EQ(first_code(g, {spec("p.line", 1, 0.09)}), "narrow_roll");
  EXPECT_EQ(first_code(g, {spec("p.line", 1, 0.0799)}), "none");
  EXPECT_EQ(first_code(g, {spec("p.line", 1), spec("p.line", 1)}), "duplicate_name");
  EXPECT_EQ(first_code(g, {spec("line", 1)}), "bad_reference");
  EXPECT_EQ(first_code(g, {spec("q.line", 1)}), "unknown_panel");
  auto none = spec("p.line", 1);
  none.line.clear();
  EXPECT_EQ(first_code(g, {none}), "no_line");
  const auto unknown = tailor::add_folds(g, {spec("p.lien", 1), spec("p.right", 1)});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.issues()[0].code, "unknown_line");
  EXPECT_NE(unknown.issues()[0].remedy.find("did you mean 'line'"), std::string::npos) << unknown.issues()[0].remedy;
  EXPECT_NE(unknown.issues()[0].remedy.find("where the `lines` of toile-mesh name it"), std::string::npos);
  EXPECT_EQ(unknown.issues().size(), 3u) << "all at once";
}

TEST(fold, part_of_a_line) {
  auto g = sheet(12, 6, 0.01, 4);
  g.points.push_back({0, "low", 1 * 13 + 4});
  g.points.push_back({0, "high", 4 * 13 + 4});
  const auto result = folded(g, {spec("p.line(low..high)", 1)});
  EXPECT_EQ(result.garment.hinges.size(), 3u);
  EXPECT_TRUE(result.garment.folds[0].runs.empty());
  EXPECT_EQ(first_code(g, {spec("p.line(high..low)", 1)}), "bad_range");
  EXPECT_EQ(first_code(g, {spec("p.line(low..top)", 1)}), "unknown_point");
}

TEST(fold, a_sewn_edge_folds_against_the_other_panel) {
  mesh::GarmentMesh g;
  test::add_rectangle(g, "a", 4, 3, 0.01);
  test::add_rectangle(g, "b", 4, 5, 0.006, 0.05);
  tailor::SeamSpec seam;
  seam.name = "s";
  seam.a = {"a.right"};
  seam.b = {"-b.left"};
  tailor::SewParams params;
  params.seams = {seam};
  const auto sewn = tailor::sew(g, params);
  ASSERT_TRUE(sewn);
  const auto result = folded(sewn->garment, {spec("a.right", -40 * degree)}).garment;
  ASSERT_EQ(result.hinges.size(), 5u);
  // a flat, b turned down by 40 degrees about the seam.
  mesh::Points3 x(result.vertex_count(), 3);
  for (Eigen::Index v = 0; v < result.vertex_count(); ++v) {
    if (result.vertex_panel[v] == 0) x.row(v) << result.uv(v, 0) - 0.04, result.uv(v, 1), 0;
    else x.row(v) << result.uv(v, 0) * std::cos(40 * degree), result.uv(v, 1), -result.uv(v, 0) * std::sin(40 * degree);
  }
  for (const auto& h : result.hinges) {
    EXPECT_EQ(result.vertex_panel[h.v0], 0);
    EXPECT_EQ(result.vertex_panel[h.o0], 0);
    EXPECT_EQ(result.vertex_panel[h.o1], 1);
    EXPECT_NEAR(tailor::hinge_angle(x.row(h.v0), x.row(h.v1), x.row(h.o0), x.row(h.o1)), h.rest_angle, 1e-12);
  }
}

TEST(fold, seams_at_an_angle) {
  // Three panels in one seam: sides a and b are held, the third has no part in it.
  mesh::GarmentMesh g;
  test::add_rectangle(g, "a", 4, 3, 0.01);
  test::add_rectangle(g, "b", 4, 3, 0.01, 0.05);
  test::add_rectangle(g, "c", 4, 3, 0.01, 0.10);
  tailor::SewParams params;
  params.seams.resize(2);
  params.seams[0].name = "ab";
  params.seams[0].a = {"a.right"};
  params.seams[0].b = {"-b.left"};
  params.seams[1].name = "ac";
  params.seams[1].a = {"a.right"};
  params.seams[1].b = {"-c.left"};
  const auto sewn = tailor::sew(g, params);
  ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
  const auto a = mesh::run_vertex_ids(sewn->garment, 1), b = mesh::run_vertex_ids(sewn->garment, 7);
  const auto hinges = tailor::seam_hinges(sewn->garment, {a}, b, 0.5, 2);
  ASSERT_TRUE(hinges);
  ASSERT_EQ(hinges->size(), 3u);
  for (const auto& h : *hinges) {
    EXPECT_EQ(sewn->garment.vertex_panel[h.v0], 0);
    EXPECT_EQ(sewn->garment.vertex_panel[h.o1], 1);
    EXPECT_EQ(h.rest_angle, 0.5);
    EXPECT_EQ(h.factor, 2);
    EXPECT_EQ(h.fold, -1);
  }
  EXPECT_EQ(first_code(sewn->garment, {spec("a.right", 1)}), "branching_fold");
  EXPECT_FALSE(tailor::seam_hinges(sewn->garment, {mesh::run_vertex_ids(sewn->garment, 0)}, b, 0.5, 2));
}
