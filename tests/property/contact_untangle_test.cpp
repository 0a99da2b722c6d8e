// Pulling cloth out of itself.
#include "toile/contact/untangle.h"

#include "contact_shapes.h"
#include "toile/base/rng.h"
#include "toile/contact/exact.h"
#include "toile/contact/search.h"

#include <gtest/gtest.h>

namespace toile::contact {
namespace {

using test::Shape;
Surface surface_of(const Shape& s) { return make_surface(static_cast<int>(s.x.rows()), s.faces); }

void expect_clean(const Shape& shape, double most) {
  const Surface surface = surface_of(shape);
  ASSERT_FALSE(self_intersections(surface, shape.x).empty());
  const Untangled out = untangle(surface, shape.x);
  EXPECT_GT(out.before, 0);
  EXPECT_EQ(out.after, 0) << "of " << out.before << " after " << out.passes << " passes";
  EXPECT_TRUE(self_intersections(surface, out.x).empty());
  EXPECT_LT(out.largest_move, most);
  double longest = 0;
  for (const auto& [a, b] : surface.edges) longest = std::max(longest, (out.x.row(a) - out.x.row(b)).norm() / (shape.x.row(a) - shape.x.row(b)).norm());
  EXPECT_LT(longest, 1.15);
}

TEST(Untangle, CornerPokesThroughASheet) {
  const Shape ground = test::sheet(21, 21, 0.2, 0.2, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const Shape corner = test::sheet(11, 11, 0.1, 0.1, [](double u, double v) {
    return Eigen::Vector3d(0.0513 + 0.6 * u + 0.2 * v, 0.0531 + 0.7 * v, 0.6 * u + 0.3 * v - 0.012);
  });
  expect_clean(test::joined(ground, corner), 0.03);
}

TEST(Untangle, HemRunsThroughTheNextLayer) {
  const Shape ground = test::sheet(26, 26, 0.25, 0.25, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  // A layer 4 mm above whose edge dips 5 mm under the ground along its whole width.
  const Shape layer = test::sheet(31, 16, 0.21, 0.1, [](double u, double v) {
    return Eigen::Vector3d(u + 0.0213, v + 0.0517, 0.004 - 0.009 * std::max(0.0, 1 - v / 0.02));
  });
  expect_clean(test::joined(ground, layer), 0.03);
}

TEST(Untangle, FoldsPokeThroughOneAnother) {
  // Two waving layers whose crests reach 2 mm into each other's troughs.
  const Shape lower = test::sheet(31, 21, 0.3, 0.2, [](double u, double v) { return Eigen::Vector3d(u, v, 0.004 * std::sin(40 * u) * std::sin(31 * v)); });
  const Shape upper = test::sheet(28, 24, 0.3, 0.2, [](double u, double v) {
    return Eigen::Vector3d(u + 0.0037, v + 0.0029, 0.005 - 0.004 * std::sin(40 * u + 0.4) * std::sin(31 * v + 0.3));
  });
  expect_clean(test::joined(lower, upper), 0.02);
}

TEST(Untangle, TwoBordersCutIntoEachOther) {
  // Nothing is separated: the cut runs from one sheet's border to the other's.
  const Shape flat = test::sheet(21, 21, 0.1, 0.1, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const Shape upright = test::sheet(21, 21, 0.1, 0.1, [](double u, double w) { return Eigen::Vector3d(0.0887 + u, 0.0513 + 0.2 * w, w - 0.0517); });
  expect_clean(test::joined(flat, upright), 0.03);
}

TEST(Untangle, LeavesCleanClothAlone) {
  const Shape sheet = test::sheet(21, 21, 0.2, 0.2, [](double u, double v) { return Eigen::Vector3d(u, v, 0.01 * std::sin(30 * u)); });
  const Untangled out = untangle(surface_of(sheet), sheet.x);
  EXPECT_EQ(out.before, 0);
  EXPECT_EQ(out.moved, 0);
  EXPECT_EQ(out.x, sheet.x);
}

TEST(Untangle, HeldNodesStayAndFailureIsReported) {
  const Shape ground = test::sheet(21, 21, 0.2, 0.2, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const Shape corner = test::sheet(11, 11, 0.1, 0.1, [](double u, double v) { return Eigen::Vector3d(0.0513 + 0.6 * u, 0.0531 + 0.7 * v, 0.8 * u - 0.012); });
  const Shape both = test::joined(ground, corner);
  UntangleOptions options;
  options.held.assign(both.x.rows(), 1);
  options.passes = 5;
  const Untangled out = untangle(surface_of(both), both.x, options);
  EXPECT_EQ(out.x, both.x);
  EXPECT_EQ(out.after, out.before);
  EXPECT_GT(out.after, 0);
  EXPECT_EQ(out.passes, 5);
  for (int i = 0; i < ground.x.rows(); ++i) options.held[i] = 0;
  options.passes = 300;
  const Untangled half = untangle(surface_of(both), both.x, options);
  EXPECT_EQ(half.x.bottomRows(corner.x.rows()), corner.x);
}

}  // namespace
}  // namespace toile::contact
