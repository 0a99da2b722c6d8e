#include "cloth_fixtures.h"
#include "toile/contact/search.h"
#include "toile/dynamics/rest_neighbours.h"

#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using fixtures::shirting;
using mesh::GarmentMesh;

constexpr double reach = 8e-4;

std::vector<contact::Contact> near(const GarmentMesh& g, const mesh::Ids& node, mesh::Points3& x) {
  mesh::Triangles faces(g.face_count(), 3);
  x.resize(node.maxCoeff() + 1, 3);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) x.row(node[v]) = g.x.row(v);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = node[g.faces(f, k)];
  }
  contact::Search search(contact::make_surface(static_cast<int>(x.rows()), faces), x);
  const auto self = search.proximity(x, mesh::Points3(0, 3), {reach, 0}).self;
  return {self.begin(), self.end()};
}

TEST(RestNeighbours, FlatClothFinerThanTheReachDoesNotTouchItself) {
  for (const fixtures::Net net : {fixtures::Net::single, fixtures::Net::jittered, fixtures::Net::delaunay}) {
    // Sheared by 30 degrees: neighbours come nearer than they are in the cloth.
    const GarmentMesh g = fixtures::net(net, 20, 20, 0.01, 0.01, shirting(), [](double u, double v) { return Eigen::Vector3d(u + 0.5 * v, 0.866 * v, 0); });
    mesh::Points3 x;
    const mesh::Ids node = mesh::particles(g);
    const auto found = near(g, node, x);
    EXPECT_GT(found.size(), 100u);
    const RestNeighbours rest(g, node, static_cast<int>(x.rows()));
    EXPECT_EQ(rest.without(found, 1.5 * reach).size(), 0u) << fixtures::name_of(net);
  }
}

TEST(RestNeighbours, ASeamIsNoGap) {
  GarmentMesh g;
  fixtures::add_fabric(g, shirting());
  const auto place = [](double u, double v) { return Eigen::Vector3d(u, v, 0); };
  fixtures::add_grid_panel(g, "a", 10, 20, 0.004, 0.008, place);
  fixtures::add_grid_panel(g, "b", 10, 20, 0.004, 0.008, [&](double u, double v) { return place(u + 0.004, v); });
  fixtures::sew(g, 0, "right", 1, "left", "s");
  mesh::Points3 x;
  const mesh::Ids node = mesh::particles(g);
  const auto found = near(g, node, x);
  const RestNeighbours rest(g, node, static_cast<int>(x.rows()));
  int over = 0;
  for (const contact::Contact& c : rest.without(found, 1.5 * reach)) over += c.distance > 0;
  EXPECT_EQ(over, 0) << "of " << found.size();
}

TEST(RestNeighbours, LayersStillTouch) {
  // Two panels face to face, and one sheet folded over itself.
  GarmentMesh two;
  fixtures::add_fabric(two, shirting());
  fixtures::add_grid_panel(two, "a", 8, 8, 0.02, 0.02, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  fixtures::add_grid_panel(two, "b", 8, 8, 0.02, 0.02, [](double u, double v) { return Eigen::Vector3d(u + 0.0003, v + 0.0004, 0.0005); });
  const GarmentMesh folded = fixtures::sheet(16, 8, 0.04, 0.02, shirting(), [](double u, double v) {
    const double r = 0.00025, half = 0.02, turn = M_PI * r;
    if (u < half) return Eigen::Vector3d(u, v, 0);
    if (u < half + turn) return Eigen::Vector3d(half + r * std::sin((u - half) / r), v, r - r * std::cos((u - half) / r));
    return Eigen::Vector3d(2 * half + turn - u + 1e-4, v + 1e-4, 2 * r);
  });
  for (const GarmentMesh& g : {two, folded}) {
    mesh::Points3 x;
    const mesh::Ids node = mesh::particles(g);
    const auto found = near(g, node, x);
    const RestNeighbours rest(g, node, static_cast<int>(x.rows()));
    const auto kept = rest.without(found, 1.5 * reach);
    EXPECT_GT(kept.size(), 50u);
    EXPECT_GE(kept.size() + (&g == &two ? 0 : 60), found.size());
    for (const contact::Contact& c : found) {
      const double d = rest.distance(c);
      EXPECT_GE(d, 0);
      if (g.panels.size() == 2) {
        EXPECT_TRUE(std::isinf(d));
      }
    }
  }
}

}  // namespace
}  // namespace toile::dynamics
