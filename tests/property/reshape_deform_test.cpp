// What holds for every change of a surface: measures come out, what is not asked for stays, symmetry to the bit.
#include "toile/base/parallel.h"
#include "toile/form/form.h"
#include "toile/geometry/slice.h"
#include "toile/reshape/deform.h"

#include <gtest/gtest.h>

#include "people.h"
#include "shapes.h"

#include <cmath>
#include <numbers>

using namespace toile;
using Eigen::Vector3d;

namespace {

const mesh::SupportMesh& form() {
  static const mesh::SupportMesh made = [] {
    form::FormParams params;
    params.vertices = 3000;
    return form::make_form(testing_people::man(), params)->mesh;
  }();
  return made;
}

double girth(const reshape::Points3& x, const Vector3d& at) { return geometry::tape_girth_around(x, form().faces, {at, Vector3d::UnitY()}, {0, at.y(), 0.02}); }
Vector3d landmark(const std::string& name) { return Vector3d(form().landmarks.at(name).data()); }

bool mirror_symmetric(const reshape::Points3& x, const reshape::Points3& original) {
  std::map<std::array<double, 3>, int> at;
  for (int v = 0; v < x.rows(); ++v) at[{original(v, 0) + 0.0, original(v, 1), original(v, 2)}] = v;
  for (int v = 0; v < x.rows(); ++v) {
    const int w = at.at({-original(v, 0) + 0.0, original(v, 1), original(v, 2)});
    if (x(w, 0) != -x(v, 0) || x(w, 1) != x(v, 1) || x(w, 2) != x(v, 2)) return false;
  }
  return true;
}

reshape::DeformParams everything() {
  reshape::DeformParams p;
  p.girths["waist"] = {.at = "waist_front", .change = 0.03, .reach = 0.12, .parts = {"torso"}};
  p.girths["hips"] = {.at = "hip_front", .change = -0.01, .parts = {"torso"}};
  p.moves["sleeve"] = {.from = "shoulder_left", .to = "wrist_left", .change = 0.02, .parts = {"arm_left"}};
  p.moves["slope"] = {.from = "hps_left", .to = "shoulder_left", .turn = -3 * std::numbers::pi / 180, .normal = std::array{1.0, 0.0, 0.0},
                      .parts = {"torso", "arm_left"}, .reach = 0.15};
  reshape::LatticeSpec lattice;
  lattice.low = {-0.3, 0.9, -0.1};
  lattice.high = {0.3, 1.3, 0.3};
  lattice.cells = {4, 4, 4};
  lattice.offsets = {{{1, 2, 3}, {0.01, 0, 0.04}}};
  p.lattices["belly"] = lattice;
  return p;
}

TEST(reshape_deform, nothing_asked_changes_no_bit) {
  const reshape::Surface surface = reshape::surface_of(form());
  const auto none = reshape::deform(surface, {});
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->x == surface.x);
  reshape::DeformParams held;
  held.symmetric = true;
  held.girths["waist"] = {.at = "waist_front", .change = 0.0};
  held.moves["sleeve"] = {.from = "shoulder_left", .to = "wrist_left", .change = 0.0, .parts = {"arm_left"}};
  const auto same = reshape::deform(surface, held);
  ASSERT_TRUE(same);
  EXPECT_TRUE(same->x == surface.x);
}

TEST(reshape_deform, girths_and_lengths_come_out_as_asked) {
  const reshape::Surface surface = reshape::surface_of(form());
  for (const bool symmetric : {false, true}) {
    reshape::DeformParams p = everything();
    p.symmetric = symmetric;
    const auto made = reshape::deform(surface, p);
    ASSERT_TRUE(made) << to_string(made.issues().front());
    EXPECT_TRUE(made->findings.empty()) << to_string(made->findings.front());
    const auto points = reshape::carried_points(surface, made->x);
    // Measured on the result by other means than the solver's.
    EXPECT_NEAR(girth(made->x, points.at("waist_front")) - girth(surface.x, landmark("waist_front")), 0.03, 5e-5);
    EXPECT_NEAR(girth(made->x, points.at("hip_front")) - girth(surface.x, landmark("hip_front")), -0.01, 5e-5);
    EXPECT_NEAR((points.at("wrist_left") - points.at("shoulder_left")).norm() - (landmark("wrist_left") - landmark("shoulder_left")).norm(), 0.02, 5e-5);
    const auto slope = [](const Vector3d& hps, const Vector3d& tip) { return std::atan2(hps.y() - tip.y(), tip.x() - hps.x()) * 180 / std::numbers::pi; };
    EXPECT_NEAR(slope(points.at("hps_left"), points.at("shoulder_left")) - slope(landmark("hps_left"), landmark("shoulder_left")), 3, 0.01);
    if (symmetric) {
      EXPECT_EQ(points.at("wrist_right").x(), -points.at("wrist_left").x());
      EXPECT_EQ(points.at("wrist_right").y(), points.at("wrist_left").y());
    } else {
      EXPECT_TRUE(points.at("wrist_right") == landmark("wrist_right")) << "the other arm was not asked to move";
    }
    EXPECT_EQ(mirror_symmetric(made->x, surface.x), symmetric);
    EXPECT_EQ(made->folded_faces, 0);
    EXPECT_TRUE(mesh::validate([&] {
                  mesh::SupportMesh result = form();
                  result.x = made->x;
                  return result;
                }())
                    .empty());
  }
}

TEST(reshape_deform, the_edit_is_smooth_and_ends_at_its_reach) {
  const mesh::SupportMesh sphere = shapes::sphere({0, 0, 0}, 0.2, 5);
  const reshape::Surface surface = reshape::surface_of(sphere);
  reshape::DeformParams p;
  p.girths["equator"] = {.shift = {0, 0, 0.2}, .change = 0.06, .reach = 0.15};
  const auto made = reshape::deform(surface, p);
  ASSERT_TRUE(made);
  double at_equator = 0, half_way = 0;
  for (Eigen::Index v = 0; v < surface.x.rows(); ++v) {
    const double move = (made->x.row(v) - surface.x.row(v)).norm(), y = std::abs(surface.x(v, 1));
    // The strip of triangles on the line is one edge wide to either side.
    if (y > 0.2 * std::sin(0.165 / 0.2)) {
      EXPECT_EQ(move, 0) << "beyond the reach";
    }
    if (y < 0.002) at_equator = std::max(at_equator, move);
    if (std::abs(y - 0.2 * std::sin(0.075 / 0.2)) < 0.004) half_way = std::max(half_way, move);
  }
  EXPECT_NEAR(at_equator, 0.06 / (2 * std::numbers::pi), 3e-4);
  // A beam clamped at one end and held level at the other has half the deflection half way.
  EXPECT_GT(half_way / at_equator, 0.35);
  EXPECT_LT(half_way / at_equator, 0.7);
}

TEST(reshape_deform, same_bytes_at_any_thread_count) {
  const reshape::Surface surface = reshape::surface_of(form());
  set_thread_count(1);
  const auto one = reshape::deform(surface, everything());
  set_thread_count(5);
  const auto five = reshape::deform(surface, everything());
  set_thread_count(0);
  EXPECT_TRUE(one->x == five->x);
}

TEST(reshape_deform, lattices_reproduce_what_their_basis_can) {
  // All nodes of a Bernstein lattice moved linearly: an affine map inside the box. All of a B-spline one: a translation.
  reshape::LatticeSpec lattice;
  lattice.low = {-1, -1, -1};
  lattice.high = {1, 1, 1};
  lattice.cells = {3, 2, 4};
  lattice.basis = reshape::Basis::bernstein;
  reshape::LatticeSpec shift = lattice;
  shift.basis = reshape::Basis::bspline;
  for (int i = 0; i <= 3; ++i) {
    for (int j = 0; j <= 2; ++j) {
      for (int k = 0; k <= 4; ++k) {
        lattice.offsets.push_back({{i, j, k}, {0.1 * (-1 + 2.0 * i / 3), 0.2 * (-1 + 2.0 * k / 4), 0}});
        shift.offsets.push_back({{i, j, k}, {0, 0, 0.1}});
      }
    }
  }
  reshape::Points3 points(3, 3);
  points << 0.3, -0.2, 0.5, 0.9, 0.1, -0.7, 0, 0, 0;
  const reshape::Points3 d = reshape::lattice_displacement(lattice, points);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(d(i, 0), 0.1 * points(i, 0), 1e-14);
    EXPECT_NEAR(d(i, 1), 0.2 * points(i, 2), 1e-14);
  }
  EXPECT_NEAR(reshape::lattice_displacement(shift, points.row(2))(0, 2), 0.1, 1e-14);
  EXPECT_NEAR(reshape::least_determinant(lattice).determinant, 1, 1e-12);
  points << 1.01, 0, 0, 0, -1.01, 0, 0, 0, 1.01;
  EXPECT_TRUE(reshape::lattice_displacement(lattice, points).isZero()) << "outside the box nothing moves";
}

TEST(reshape_deform, all_mistakes_at_once) {
  reshape::DeformParams p;
  p.girths["a"] = {.at = "waits_front", .change = 0.01};
  p.girths["b"] = {.at = "waist_front", .change = 0.01, .parts = {"torsos"}};
  p.girths["c"] = {.at = "waist_front", .shift = {0, 9, 0}, .change = 0.01};
  p.girths["d"] = {.at = "waist_front", .change = -0.75};
  p.moves["e"] = {.from = "wrist_left", .to = "wrist_left", .change = 0.01};
  const auto made = reshape::deform(reshape::surface_of(form()), p);
  ASSERT_FALSE(made);
  std::vector<std::string> codes;
  for (const Issue& issue : made.issues()) codes.push_back(issue.code);
  EXPECT_EQ(codes, (std::vector<std::string>{"unknown_point", "unknown_part", "no_section", "girth_too_small", "points_coincide"}));
}

}  // namespace
