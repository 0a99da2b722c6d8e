#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/mechanics/sheet.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <functional>
#include <numeric>

namespace toile::mechanics {
namespace {

using fixtures::shirting;
using mesh::GarmentMesh;

Eigen::Vector3d flat(double u, double v) { return {u, v, 0}; }

Sheet make(const GarmentMesh& garment, const SheetOptions& options = {}) {
  const Result<Sheet> sheet = make_sheet(garment, mesh::particles(garment), options);
  EXPECT_TRUE(sheet) << to_string(sheet.issues().front());
  return *sheet;
}

double noise(std::uint64_t& state) {  // in [-1, 1]
  state = state * 6364136223846793005ULL + 1442695040888963407ULL;
  return static_cast<double>(state >> 11) / 4503599627370496.0 - 1;
}

TEST(Constitutive, CurvePassesThroughItsKesData) {
  for (double lt : {0.525, 0.625, 0.725, 0.825, 0.925, 1.0}) {
    const fabric::TensileCurve curve = fabric::tensile_curve(490.3325, 0.05, lt);
    const fabric::CurvePoint end = curve.at(0.05);
    EXPECT_NEAR(end.force, 490.3325, 1e-7);
    EXPECT_NEAR(2 * end.energy / (490.3325 * 0.05), lt, 1e-9);
    EXPECT_NEAR(curve.at(0).force, 0, 1e-12);
  }
}

TEST(Constitutive, PublishedShapeFactorsOfTheExponential) {
  // x = b EMT for three linearities, docs/mechanics.md
  EXPECT_NEAR(fabric::tensile_curve(490, 0.05, 0.525).rate * 0.05, 3.343, 1e-3);
  EXPECT_NEAR(fabric::tensile_curve(490, 0.05, 0.725).rate * 0.05, 1.731, 1e-3);
  EXPECT_NEAR(fabric::tensile_curve(490, 0.05, 0.925).rate * 0.05, 0.452, 1e-3);
}

TEST(Constitutive, DerivativesAgreeWithDifferences) {
  const fabric::TensileCurve curve = fabric::tensile_curve(490.3325, 0.05, 0.6);
  const fabric::ShearCurve shear{40.0};
  const double h = 1e-6;
  for (double e : {-0.03, -0.001, 0.002, 0.02, 0.06, 0.2}) {
    EXPECT_NEAR((curve.at(e + h).energy - curve.at(e - h).energy) / (2 * h), curve.at(e).force, 1e-4 + 1e-6 * std::abs(curve.at(e).force));
    EXPECT_NEAR((curve.at(e + h).force - curve.at(e - h).force) / (2 * h), curve.at(e).slope, 1e-4 * curve.at(e).slope);
  }
  for (double s : {-0.97, -0.5, 0.0, 0.1, 0.9, 0.99}) {
    EXPECT_NEAR((shear.at(s + h).energy - shear.at(s - h).energy) / (2 * h), shear.at(s).force, 1e-6);
    EXPECT_NEAR((shear.at(s + h).force - shear.at(s - h).force) / (2 * h), shear.at(s).slope, 1e-3);
  }
}

TEST(Constitutive, BadCardsAreNamed) {
  fabric::Card card = shirting();
  card.warp.linearity = std::nan("");
  card.shear = 0;
  const auto result = fabric::constitutive(card);
  ASSERT_FALSE(result);
  ASSERT_EQ(result.issues().size(), 2u);
  EXPECT_EQ(result.issues()[0].place.item, "fabric shirting, warp.LT");
  EXPECT_EQ(result.issues()[1].place.item, "fabric shirting, G");
}

TEST(Membrane, GradientAndHessianAgreeWithDifferences) {
  const fabric::Constitutive fabric = *fabric::constitutive(shirting());
  std::uint64_t state = 7;
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix<double, 6, 1> a;
    a << 1, 0, 0, 0, 1, 0;
    for (int i = 0; i < 6; ++i) a[i] += 0.15 * noise(state);
    const auto of = [&](const Eigen::Matrix<double, 6, 1>& z) { return YarnGradient{z.head<3>(), z.tail<3>()}; };
    const MembraneResponse r = membrane_response(fabric, of(a), Curvature::exact);
    Eigen::Matrix<double, 6, 1> g;
    g << r.stress.weft, r.stress.warp;
    Eigen::Matrix<double, 6, 6> hessian;
    hessian << r.weft_weft, r.weft_warp, r.weft_warp.transpose(), r.warp_warp;
    EXPECT_NEAR(r.energy, membrane_energy(fabric, of(a)), 1e-12 * std::abs(r.energy));
    const double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      Eigen::Matrix<double, 6, 1> up = a, down = a;
      up[i] += h;
      down[i] -= h;
      EXPECT_NEAR((membrane_energy(fabric, of(up)) - membrane_energy(fabric, of(down))) / (2 * h), g[i], 1e-5 * g.norm() + 1e-5);
      const MembraneResponse ru = membrane_response(fabric, of(up), Curvature::exact), rd = membrane_response(fabric, of(down), Curvature::exact);
      Eigen::Matrix<double, 6, 1> column;
      column << (ru.stress.weft - rd.stress.weft) / (2 * h), (ru.stress.warp - rd.stress.warp) / (2 * h);
      EXPECT_LT((column - hessian.col(i)).norm(), 2e-4 * hessian.norm());
    }
    const MembraneResponse positive = membrane_response(fabric, of(a), Curvature::positive);
    Eigen::Matrix<double, 6, 6> p;
    p << positive.weft_weft, positive.weft_warp, positive.weft_warp.transpose(), positive.warp_warp;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> spectrum(p), exact(hessian);
    EXPECT_GT(spectrum.eigenvalues().minCoeff(), -1e-9 * p.norm());
    // The projection is the exact one: clamped eigenvalues of the true matrix.
    const Eigen::Matrix<double, 6, 6> clamped = exact.eigenvectors() * exact.eigenvalues().cwiseMax(0).asDiagonal() * exact.eigenvectors().transpose();
    EXPECT_LT((clamped - p).norm(), 1e-9 * p.norm());
  }
}

TEST(Sheet, GradientAndHessianAgreeWithDifferences) {
  GarmentMesh g;
  fixtures::add_fabric(g, shirting());
  fixtures::add_grid_panel(g, "a", 4, 3, 0.04, 0.03, flat);
  fixtures::add_grid_panel(g, "b", 4, 3, 0.04, 0.03, [](double u, double v) { return Eigen::Vector3d(u + 0.04, v, 0.003); });
  fixtures::sew(g, 0, "right", 1, "left", "s");
  g.seams[0].bending_factor = 3;
  g.fasteners.push_back({0, 39, mesh::Fastener::Kind::button, 0.001, 0.002});
  for (const bool open : {false, true}) {
    Ids node = mesh::particles(g);
    if (open) std::iota(node.data(), node.data() + (node.resize(g.vertex_count()), node.size()), 0);
    const Result<Sheet> made = make_sheet(g, node, {});
    ASSERT_TRUE(made);
    const Sheet& sheet = *made;
    EXPECT_EQ(sheet.links.size(), open ? 4u : 0u);
    std::uint64_t state = 3;
    Points3 x(sheet.node_count, 3);
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) x.row(node[v]) = g.x.row(v);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += 0.001 * noise(state);
    Points3 offset = Points3::Constant(static_cast<Eigen::Index>(sheet.links.size()), 3, 0.001);
    SheetResponse r;
    evaluate(sheet, x, offset, Curvature::exact, r);
    EXPECT_NEAR(r.energy.total(), energy(sheet, x, offset).total(), 1e-12);
    const double h = 1e-7;
    double worst_gradient = 0, worst_hessian = 0, hessian_scale = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Points3 up = x, down = x;
      up.data()[i] += h;
      down.data()[i] -= h;
      worst_gradient = std::max(worst_gradient, std::abs((energy(sheet, up, offset).total() - energy(sheet, down, offset).total()) / (2 * h) - r.gradient.data()[i]));
      SheetResponse ru, rd;
      evaluate(sheet, up, offset, {}, ru);
      evaluate(sheet, down, offset, {}, rd);
      const Points3 column = (ru.gradient - rd.gradient) / (2 * h);
      Points3 stored = Points3::Zero(x.rows(), 3);
      const int col = static_cast<int>(i / 3), axis = static_cast<int>(i % 3);
      for (int row = 0; row < r.matrix.rows(); ++row) {
        for (int k = r.matrix.row_start[static_cast<std::size_t>(row)]; k < r.matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k) {
          if (r.matrix.column[static_cast<std::size_t>(k)] == col) stored.row(row) = r.matrix.value[static_cast<std::size_t>(k)].matrix().col(axis).transpose();
        }
      }
      worst_hessian = std::max(worst_hessian, (column - stored).norm());
      hessian_scale = std::max(hessian_scale, column.norm());
    }
    EXPECT_LT(worst_gradient, 1e-5 * r.gradient.norm());
    EXPECT_LT(worst_hessian, 1e-4 * hessian_scale);
  }
}

TEST(Sheet, UniformStretchGivesTheKesCurve) {
  const fabric::Card card = shirting();
  const GarmentMesh g = fixtures::sheet(6, 5, 0.3, 0.2, card, flat);
  const Sheet sheet = make(g);
  for (const bool warp : {false, true}) {
    const auto curve = warp ? fabric::tensile_curve(card.tensile_force_max, card.warp.strain_max, card.warp.linearity)
                            : fabric::tensile_curve(card.tensile_force_max, card.weft.strain_max, card.weft.linearity);
    for (double e : {0.001, 0.01, 0.03}) {
      Points3 x = g.x;
      x.col(warp ? 1 : 0) *= 1 + e;
      SheetResponse r;
      evaluate(sheet, x, Points3(0, 3), {}, r);
      double force = 0;  // on the far edge
      for (int v = 0; v < g.vertex_count(); ++v) {
        if (g.uv(v, warp ? 1 : 0) > (warp ? 0.2 : 0.3) - 1e-9) force += r.gradient(v, warp ? 1 : 0);
      }
      EXPECT_NEAR(force / (warp ? 0.3 : 0.2), curve.at(e).force, 1e-9 * curve.at(e).force + 1e-9);
    }
  }
}

TEST(Sheet, RigidMotionChangesNothing) {
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, shirting(), [](double u, double v) { return Eigen::Vector3d(1.01 * u, v, 20 * u * v); });
  const Sheet sheet = make(g);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  const Points3 moved = (g.x * turn.transpose()).rowwise() + Eigen::RowVector3d(0.4, -1.2, 0.7);
  SheetResponse a, b;
  evaluate(sheet, g.x, Points3(0, 3), {}, a);
  evaluate(sheet, moved, Points3(0, 3), {}, b);
  EXPECT_NEAR(a.energy.membrane, b.energy.membrane, 1e-12 * a.energy.membrane + 1e-15);
  EXPECT_NEAR(a.energy.bending, b.energy.bending, 1e-9 * a.energy.bending);
  EXPECT_LT((a.gradient * turn.transpose() - b.gradient).norm(), 1e-8 * a.gradient.norm());
}

TEST(Sheet, FlatRestHasNoForce) {
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, shirting(), flat);
  const Sheet sheet = make(g);
  SheetResponse r;
  evaluate(sheet, g.x, Points3(0, 3), {}, r);
  EXPECT_LT(r.gradient.norm(), 1e-9);
  EXPECT_NEAR(r.energy.total(), 0, 1e-12);
}

struct BendingCase {
  const char* name;
  double uu, vv, uv;  // second derivatives of the height
};
constexpr std::array bending_cases{BendingCase{"weft", 1, 0, 0}, BendingCase{"warp", 0, 1, 0}, BendingCase{"twist", 0, 0, 1}, BendingCase{"saddle", 1, -1, 0},
                                   BendingCase{"30 degrees", 0.75, 0.25, 0.4330127018922193}, BendingCase{"45 degrees", 0.5, 0.5, 0.5}};
constexpr std::array nets{fixtures::Net::alternating, fixtures::Net::single, fixtures::Net::random_diagonals, fixtures::Net::jittered, fixtures::Net::delaunay};

/// Points of the cloth and of its directors for a surface over panel coordinates with its two tangents.
Points3 on_surface(const Sheet& sheet, const GarmentMesh& g, const std::function<std::array<Eigen::Vector3d, 3>(double, double)>& surface) {
  Points3 x(sheet.node_count, 3);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) x.row(sheet.node_of_vertex[v]) = surface(g.uv(v, 0), g.uv(v, 1))[0].transpose();
  for (const Director& d : sheet.directors) {
    const auto at = surface(g.uv(d.vertex, 0), g.uv(d.vertex, 1));
    x.row(d.ghost_u) = (at[0] + d.length * at[1]).transpose();
    x.row(d.ghost_v) = (at[0] + d.length * at[2]).transpose();
  }
  return x;
}

/// Patch test: the border and its tangent planes are held on a quadratic surface, so nothing is left out there.
TEST(Sheet, BendingEnergyOfQuadraticSurfacesIsExactOnAnyMesh) {
  fabric::Card card = shirting();
  card.twist_ratio = 0.3;
  const double d11 = card.weft.bending, d22 = card.warp.bending, d66 = 0.3 * std::sqrt(d11 * d22);
  for (std::size_t mesh = 0; mesh <= nets.size(); ++mesh) {
    // The last is a grid with a hole of other triangles around a particle out of its place: its corners see unequal numbers of cells.
    const bool hole = mesh == nets.size();
    const std::string name = hole ? "grid with a hole" : fixtures::name_of(nets[mesh]);
    GarmentMesh g = fixtures::net(hole ? fixtures::Net::alternating : nets[mesh], 12, 9, 0.12, 0.09, card, flat);
    if (hole) {
      for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
        if ((g.uv.row(v) - Eigen::RowVector2d(0.05, 0.04)).norm() < 1e-6) g.uv.row(v) += Eigen::RowVector2d(0.002, 0.0015);
      }
    }
    SheetOptions options;
    for (int v = 0; v < g.vertex_count(); ++v) {
      const double u = g.uv(v, 0), w = g.uv(v, 1);
      if (std::min({u, w, 0.12 - u, 0.09 - w}) < 1e-9) options.directed_vertices.push_back(v);
    }
    const Sheet sheet = make(g, options);
    for (const BendingCase& c : bending_cases) {
      const Points3 x = on_surface(sheet, g, [&](double u, double v) {
        return std::array<Eigen::Vector3d, 3>{Eigen::Vector3d(u, v, 0.5 * (c.uu * u * u + c.vv * v * v + 2 * c.uv * u * v)), Eigen::Vector3d(1, 0, c.uu * u + c.uv * v),
                                              Eigen::Vector3d(0, 1, c.vv * v + c.uv * u)};
      });
      const double exact = 0.5 * (d11 * c.uu * c.uu + d22 * c.vv * c.vv + 4 * d66 * c.uv * c.uv) * 0.12 * 0.09;
      EXPECT_NEAR(energy(sheet, x, Points3(0, 3)).bending / exact, 1, 1e-8) << name << ", " << c.name;
      // And it is in balance: no force from bending at nodes that are neither on the border nor next to a director.
      double worst = 0;
      for (int i = 0; i < sheet.cloth_nodes; ++i) {
        if (std::find(options.directed_vertices.begin(), options.directed_vertices.end(), i) != options.directed_vertices.end()) continue;
        double force = 0;
        for (int k = sheet.bending.row_start[static_cast<std::size_t>(i)]; k < sheet.bending.row_start[static_cast<std::size_t>(i) + 1]; ++k) {
          force += sheet.bending.value[static_cast<std::size_t>(k)] * x(sheet.bending.column[static_cast<std::size_t>(k)], 2);
        }
        worst = std::max(worst, std::abs(force));
      }
      EXPECT_LT(worst, 1e-9 * d11) << name << ", " << c.name;
    }
  }
}

/// A cylinder of finite curvature at any angle to the yarns, and turned in space.
TEST(Sheet, BendingEnergyOfACylinderIsThatOfItsCurvature) {
  fabric::Card card = shirting();
  card.twist_ratio = 0.3;
  const double d11 = card.weft.bending, d22 = card.warp.bending, d66 = 0.3 * std::sqrt(d11 * d22), radius = 0.04;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  for (const fixtures::Net net : nets) {
    for (double degrees : {0.0, 30.0, 45.0, 90.0}) {
      double previous = 1;
      for (int n : {12, 24}) {
        const GarmentMesh g = fixtures::net(net, n, n, 0.06, 0.06, card, flat);
        SheetOptions options;
        for (int v = 0; v < g.vertex_count(); ++v) {
          const double u = g.uv(v, 0), w = g.uv(v, 1);
          if (std::min({u, w, 0.06 - u, 0.06 - w}) < 1e-9) options.directed_vertices.push_back(v);
        }
        const Sheet sheet = make(g, options);
        const double a = degrees * M_PI / 180, c = std::cos(a), s = std::sin(a);
        const Points3 x = on_surface(sheet, g, [&](double u, double v) {
          const double along = c * u + s * v, across = -s * u + c * v, phi = along / radius;
          const Eigen::Vector3d p(radius * std::sin(phi), across, radius * (1 - std::cos(phi))), t(std::cos(phi), 0, std::sin(phi)), q(0, 1, 0);
          return std::array<Eigen::Vector3d, 3>{turn * p, turn * (c * t - s * q), turn * (s * t + c * q)};
        });
        const double exact = 0.5 * (d11 * std::pow(c, 4) + d22 * std::pow(s, 4) + 4 * d66 * c * c * s * s) / (radius * radius) * 0.06 * 0.06;
        const double error = std::abs(energy(sheet, x, Points3(0, 3)).bending / exact - 1);
        EXPECT_LT(error, n == 12 ? 0.005 : 0.0015) << fixtures::name_of(net) << ", " << degrees << " degrees, " << n;
        EXPECT_LT(error, 0.4 * previous) << "second order";
        previous = error;
      }
    }
  }
}

TEST(Sheet, FreeBordersCarryNoMomentAcrossThem) {
  // A cylinder whose axis runs along the border bends with all of it; one whose axis runs across loses half a cell at either end.
  const fabric::Card card = shirting();
  for (const fixtures::Net net : nets) {
    const GarmentMesh g = fixtures::net(net, 30, 10, 0.3, 0.1, card, [](double u, double v) { return Eigen::Vector3d(u, v, 0.5 * u * u); });
    const double ratio = energy(make(g), g.x, Points3(0, 3)).bending / (0.5 * card.weft.bending * 0.3 * 0.1);
    EXPECT_NEAR(ratio, 1 - 1.0 / 30, 0.01) << fixtures::name_of(net);
  }
}

TEST(Sheet, BorderBendsWithTheRest) {
  // A cylinder along the weft of a strip: end triangles carry less, by the published amount of this element.
  const fabric::Card card = shirting();
  double previous = 1;
  for (int n : {16, 32, 64}) {
    const GarmentMesh g = fixtures::sheet(n, 8, 0.2, 0.02, card, [](double u, double v) { return Eigen::Vector3d(u, v, 0.5 * u * u); });
    const double ratio = energy(make(g), g.x, Points3(0, 3)).bending / (0.5 * card.weft.bending * 0.2 * 0.02);
    EXPECT_LT(std::abs(ratio - 1), previous) << n;
    previous = std::abs(ratio - 1);
  }
  EXPECT_LT(previous, 0.02);
}

TEST(Sheet, SeamsBendLikeTheCloth) {
  const fabric::Card card = shirting();
  const auto curved = [](double u, double v) { return Eigen::Vector3d(u, v, 0.5 * u * u); };
  const GarmentMesh whole = fixtures::sheet(20, 10, 0.2, 0.1, card, curved);
  GarmentMesh sewn;
  fixtures::add_fabric(sewn, card);
  fixtures::add_grid_panel(sewn, "a", 10, 10, 0.1, 0.1, curved);
  fixtures::add_grid_panel(sewn, "b", 10, 10, 0.1, 0.1, [&](double u, double v) { return curved(u + 0.1, v); });
  fixtures::sew(sewn, 0, "right", 1, "left", "s");
  const Sheet sheet = make(sewn);
  Points3 x(sheet.node_count, 3);
  for (Eigen::Index v = 0; v < sewn.vertex_count(); ++v) x.row(sheet.node_of_vertex[v]) = sewn.x.row(v);
  const double one = energy(make(whole), whole.x, Points3(0, 3)).bending;
  RecordProperty("ratio", std::to_string(energy(sheet, x, Points3(0, 3)).bending / one));
  EXPECT_NEAR(energy(sheet, x, Points3(0, 3)).bending, one, 0.01 * one);
  sewn.seams[0].bending_factor = 4;
  EXPECT_GT(energy(make(sewn), x, Points3(0, 3)).bending, 1.05 * one);
}

TEST(Sheet, MassIsThatOfTheGarment) {
  const GarmentMesh g = fixtures::sheet(7, 5, 0.3, 0.2, shirting(), flat);
  EXPECT_NEAR(make(g).mass.sum(), 0.3 * 0.2 * 0.12, 1e-12);
}

TEST(Sheet, SameBitsAtAnyThreadCount) {
  const GarmentMesh g = fixtures::sheet(60, 60, 0.6, 0.6, shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.02 * std::sin(20 * u) * std::cos(13 * v)); });
  const Sheet sheet = make(g);
  std::array<SheetResponse, 3> r;
  int k = 0;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    evaluate(sheet, g.x, Points3(0, 3), Curvature::positive, r[static_cast<std::size_t>(k++)]);
  }
  set_thread_count(0);
  for (int i = 1; i < 3; ++i) {
    const SheetResponse& o = r[static_cast<std::size_t>(i)];
    EXPECT_EQ(o.energy.total(), r[0].energy.total());
    EXPECT_TRUE(o.gradient == r[0].gradient);
    EXPECT_EQ(std::memcmp(o.matrix.value.data(), r[0].matrix.value.data(), o.matrix.value.size() * sizeof(Block)), 0);
  }
}

TEST(Sheet, FacesWithoutFabricAndDegenerateTrianglesAreNamed) {
  GarmentMesh g;
  fixtures::add_fabric(g, shirting());
  fixtures::add_grid_panel(g, "front", 2, 2, 0.02, 0.02, flat);
  fixtures::add_grid_panel(g, "back", 2, 2, 0.02, 0.02, flat);
  g.face_laminate[0] = -1;
  auto result = make_sheet(g, mesh::particles(g), {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues()[0].code, "no_laminate");
  EXPECT_EQ(result.issues()[0].place.item, "panel front");
  EXPECT_NE(result.issues()[0].remedy.find("toile-layer"), std::string::npos);
  g.face_laminate[0] = 0;
  g.uv.row(g.faces(10, 0)) = g.uv.row(g.faces(10, 1));
  result = make_sheet(g, mesh::particles(g), {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues()[0].code, "degenerate_triangle");
  EXPECT_EQ(result.issues()[0].place.item, "panel back");
}

}  // namespace
}  // namespace toile::mechanics
