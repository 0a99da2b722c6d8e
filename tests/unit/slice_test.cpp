#include "toile/geometry/slice.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

using namespace toile::geometry;

namespace {

struct Mesh {
  Points3 x;
  Triangles faces;
};

/// An upright tube of radius r(phi), heights 0..h in `rows` rows, closed by fans.
Mesh tube(int around, int rows, double h, const std::function<double(double)>& radius) {
  Mesh m;
  m.x.resize(around * (rows + 1) + 2, 3);
  m.faces.resize(around * rows * 2 + around * 2, 3);
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i < around; ++i) {
      const double phi = 2 * M_PI * i / around, r = radius(phi);
      m.x.row(j * around + i) << r * std::sin(phi), h * j / rows, r * std::cos(phi);
    }
  }
  const int bottom = around * (rows + 1), top = bottom + 1;
  m.x.row(bottom) << 0, 0, 0;
  m.x.row(top) << 0, h, 0;
  int f = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < around; ++i) {
      const int a = j * around + i, b = j * around + (i + 1) % around, c = a + around, d = b + around;
      m.faces.row(f++) << a, b, d;
      m.faces.row(f++) << a, d, c;
    }
  }
  for (int i = 0; i < around; ++i) {
    const int j = (i + 1) % around;
    m.faces.row(f++) << bottom, j, i;
    m.faces.row(f++) << top, rows * around + i, rows * around + j;
  }
  return m;
}

Mesh merged(const Mesh& a, const Mesh& b, const Eigen::RowVector3d& shift) {
  Mesh m;
  m.x.resize(a.x.rows() + b.x.rows(), 3);
  m.x << a.x, (b.x.rowwise() + shift);
  m.faces.resize(a.faces.rows() + b.faces.rows(), 3);
  m.faces << a.faces, (b.faces.array() + static_cast<int>(a.x.rows())).matrix();
  return m;
}

}  // namespace

TEST(slice, a_round_tube_reads_its_polygon) {
  const int n = 40;
  const Mesh m = tube(n, 6, 1.0, [](double) { return 0.15; });
  const auto curves = slice(m.x, m.faces, {{0, 0.43, 0}, {0, 1, 0}});
  ASSERT_EQ(curves.size(), 1u);
  EXPECT_TRUE(curves[0].closed);
  EXPECT_EQ(curves[0].faces.size(), static_cast<std::size_t>(curves[0].points.rows()));
  const Eigen::Vector3d first = curves[0].points.row(0), second = curves[0].points.row(1);
  EXPECT_GT(first.cross(second).y(), 0) << "counter-clockwise from above";
  const double expected = 2 * n * 0.15 * std::sin(M_PI / n);
  EXPECT_NEAR(tape_girth(curves[0].points, {0, 1, 0}), expected, 1e-12);
  EXPECT_NEAR(length(curves[0]), expected, 1e-12);
  EXPECT_NEAR(enclosed_area(curves[0], {0, 2, 0}), n * 0.15 * 0.15 * std::sin(2 * M_PI / n) / 2, 1e-12);
}

TEST(slice, a_vertex_on_the_plane_leaves_no_gap) {
  const Mesh m = tube(24, 4, 1.0, [](double) { return 0.2; });
  for (const double y : {0.25, 0.5, 0.75}) {
    const auto curves = slice(m.x, m.faces, {{0, y, 0}, {0, 1, 0}});
    ASSERT_EQ(curves.size(), 1u) << y;
    EXPECT_TRUE(curves[0].closed);
    EXPECT_NEAR(tape_girth(curves[0].points, {0, 1, 0}), 48 * 0.2 * std::sin(M_PI / 24), 1e-12);
  }
}

TEST(slice, the_tape_spans_hollows) {
  // A clover: the tape touches the four lobes only.
  const Mesh m = tube(360, 2, 1.0, [](double phi) { return 0.1 + 0.04 * std::cos(4 * phi); });
  const auto curves = slice(m.x, m.faces, {{0, 0.3, 0}, {0, 1, 0}});
  ASSERT_EQ(curves.size(), 1u);
  EXPECT_LT(tape_girth(curves[0].points, {0, 1, 0}), 0.95 * length(curves[0]));
  const Points3 hull = convex_hull(curves[0].points, {0, 1, 0});
  for (Eigen::Index i = 0; i < hull.rows(); ++i) {
    const Eigen::Vector3d a = hull.row(i), b = hull.row((i + 1) % hull.rows());
    for (Eigen::Index j = 0; j < curves[0].points.rows(); ++j) {
      const Eigen::Vector3d p = curves[0].points.row(j);
      EXPECT_GE((b - a).cross(p - a).y(), -1e-12);
    }
  }
}

TEST(slice, the_curve_around_a_point_is_chosen) {
  const Mesh m = merged(tube(60, 4, 1.0, [](double) { return 0.2; }), tube(30, 4, 1.0, [](double) { return 0.05; }), {0.5, 0, 0});
  const Plane plane{{0, 0.6, 0}, {0, 1, 0}};
  EXPECT_EQ(slice(m.x, m.faces, plane).size(), 2u);
  EXPECT_NEAR(tape_girth_around(m.x, m.faces, plane, {0, 0, 0}), 120 * 0.2 * std::sin(M_PI / 60), 1e-12);
  EXPECT_NEAR(tape_girth_around(m.x, m.faces, plane, {0.5, 0.6, 0.01}), 60 * 0.05 * std::sin(M_PI / 30), 1e-12);
  EXPECT_EQ(tape_girth_around(m.x, m.faces, plane, {0.35, 0.6, 0}), 0);
  EXPECT_TRUE(slice(m.x, m.faces, {{0, 1.2, 0}, {0, 1, 0}}).empty());
}

TEST(slice, a_kept_region_gives_an_open_curve) {
  const Mesh m = tube(40, 4, 1.0, [](double) { return 0.2; });
  std::vector<char> keep(static_cast<std::size_t>(m.faces.rows()));
  for (Eigen::Index f = 0; f < m.faces.rows(); ++f) {
    keep[static_cast<std::size_t>(f)] = m.x(m.faces(f, 0), 2) + m.x(m.faces(f, 1), 2) + m.x(m.faces(f, 2), 2) > 0;
  }
  const auto curves = slice(m.x, m.faces, {{0, 0.6, 0}, {0, 1, 0}}, keep);
  ASSERT_EQ(curves.size(), 1u);
  EXPECT_FALSE(curves[0].closed);
  EXPECT_NEAR(length(curves[0]), M_PI * 0.2, 0.04);
  EXPECT_EQ(curves[0].faces.size() + 1, static_cast<std::size_t>(curves[0].points.rows()));
}

TEST(slice, rigid_motion_and_scale) {
  const Mesh m = tube(50, 5, 1.0, [](double phi) { return 0.2 + 0.03 * std::sin(3 * phi); });
  const Plane plane{{0.01, 0.47, 0}, {0.1, 1, 0.2}};
  const double girth = tape_girth_around(m.x, m.faces, plane, {0, 0.47, 0});
  ASSERT_GT(girth, 1.2);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(0.3, -2, 5);
  const Points3 moved = ((m.x * turn.transpose()) * 2.5).rowwise() + shift.transpose();
  const Plane there{2.5 * (turn * plane.point) + shift, turn * plane.normal};
  EXPECT_NEAR(tape_girth_around(moved, m.faces, there, 2.5 * (turn * Eigen::Vector3d(0, 0.47, 0)) + shift), 2.5 * girth, 1e-10);
}
