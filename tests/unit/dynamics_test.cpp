#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/contact/exact.h"
#include "toile/contact/search.h"
#include "toile/contact/support_field.h"
#include "toile/dynamics/contact_force.h"
#include "toile/dynamics/linear_solver.h"
#include "toile/dynamics/simulate.h"
#include "toile/mechanics/sheet.h"
#include "toile/mesh/topology.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using fixtures::shirting;
using mesh::GarmentMesh;

double noise(std::uint64_t& state) {  // in [-1, 1]
  state = state * 6364136223846793005ULL + 1442695040888963407ULL;
  return static_cast<double>(state >> 11) / 4503599627370496.0 - 1;
}

TEST(Repulsion, DerivativesAndSmoothness) {
  const ContactLaw law{2e-3, 5e5, 0, 1};
  const double h = 1e-9;
  for (double gap : {1e-4, 5e-4, 9.999e-4, 1.0001e-3, 1.5e-3}) {
    const Repulsion r = repulsion(law, gap), up = repulsion(law, gap + h), down = repulsion(law, gap - h);
    EXPECT_NEAR(-(up.energy - down.energy) / (2 * h), r.force, 1e-5 * r.force);
    EXPECT_NEAR(-(up.force - down.force) / (2 * h), r.slope, 1e-4 * r.slope);
  }
  EXPECT_EQ(repulsion(law, 2e-3).force, 0);
  // Two branches meet at half the reach in value, slope and curvature.
  const Repulsion a = repulsion(law, 1e-3 * (1 - 1e-12)), b = repulsion(law, 1e-3);
  EXPECT_NEAR(a.energy, b.energy, 1e-9 * b.energy);
  EXPECT_NEAR(a.force, b.force, 1e-9 * b.force);
  EXPECT_NEAR(a.slope, b.slope, 1e-9 * b.slope);
}

TEST(Friction, GradientIsThatOfItsEnergy) {
  FrictionPair pair{contact::Kind::vertex_face, 0, 0, {0, 1, 2, 3}, {1, -0.2, -0.3, -0.5}, Eigen::Vector3d(1, 2, 3).normalized(), {}, 0.01, 40};
  pair.slip = pair.normal.unitOrthogonal() * 1e-4;
  std::uint64_t state = 5;
  const mesh::Points3 start = mesh::Points3::Zero(4, 3);
  for (double size : {1e-5, 3e-4, 1e-3}) {  // sticking, about the limit, sliding
    mesh::Points3 x(4, 3);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = size * noise(state);
    mesh::Points3 gradient = mesh::Points3::Zero(4, 3), scratch = gradient;
    add_friction({pair}, start, x, gradient, nullptr);
    const double h = 1e-8;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      mesh::Points3 up = x, down = x;
      up.data()[i] += h;
      down.data()[i] -= h;
      EXPECT_NEAR((add_friction({pair}, start, up, scratch, nullptr) - add_friction({pair}, start, down, scratch, nullptr)) / (2 * h), gradient.data()[i], 1e-7);
    }
    Eigen::Vector3d force = gradient.row(0).transpose();
    EXPECT_LE(force.norm(), pair.limit * (1 + 1e-12));       // Coulomb's bound
    EXPECT_NEAR(force.dot(pair.normal), 0, 1e-12);           // tangential
    EXPECT_LT(gradient.colwise().sum().norm(), 1e-12);       // action and reaction
  }
}

TEST(LinearSolver, AgreesWithADenseSolve) {
  const GarmentMesh g = fixtures::sheet(12, 9, 0.12, 0.09, shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.01 * std::sin(60 * u)); });
  const mechanics::Sheet sheet = *mechanics::make_sheet(g, mesh::particles(g), {});
  mechanics::SheetResponse r;
  mechanics::evaluate(sheet, g.x, mesh::Points3(0, 3), mechanics::Curvature::positive, r);
  // A diagonal of 1 N/m beside membranes of 10^4: single precision then leaves four digits of a solution.
  for (int i = 0; i < r.matrix.rows(); ++i) {
    for (int c = 0; c < 3; ++c) r.matrix.value[static_cast<std::size_t>(r.matrix.diagonal[static_cast<std::size_t>(i)])].column[c][c] += 1.0f;
  }
  ContactTerm term;
  term.node = {0, 40, 41, 53};
  term.weight = {1, -0.25f, -0.25f, -0.5f};
  term.block = Block::from(30 * Eigen::Vector3d(0, 0, 1) * Eigen::RowVector3d(0, 0, 1));
  const int n = r.matrix.rows();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (int i = 0; i < n; ++i) {
    for (int k = r.matrix.row_start[static_cast<std::size_t>(i)]; k < r.matrix.row_start[static_cast<std::size_t>(i) + 1]; ++k) {
      dense.block<3, 3>(3 * i, 3 * r.matrix.column[static_cast<std::size_t>(k)]) = r.matrix.value[static_cast<std::size_t>(k)].matrix();
    }
  }
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < 4; ++b) dense.block<3, 3>(3 * term.node[a], 3 * term.node[b]) += static_cast<double>(term.weight[a] * term.weight[b]) * term.block.matrix();
  }
  std::uint64_t state = 11;
  Eigen::VectorXd rhs(3 * n);
  std::vector<Float4> b(static_cast<std::size_t>(n)), x;
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) rhs[3 * i + c] = b[static_cast<std::size_t>(i)][c] = static_cast<float>(noise(state));
    b[static_cast<std::size_t>(i)][3] = 0;
  }
  LinearSolver solver;
  solver.factor(r.matrix, {term}, g.x, std::vector<char>(static_cast<std::size_t>(n), 0));
  const SolveReport report = solver.solve(r.matrix, {term}, b, x, {.tolerance = 1e-6, .max_iterations = 1000});
  EXPECT_TRUE(report.converged);
  const Eigen::VectorXd exact = dense.ldlt().solve(rhs);
  Eigen::VectorXd found(3 * n);
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) found[3 * i + c] = static_cast<double>(x[static_cast<std::size_t>(i)][c]);
  }
  const Eigen::VectorXd error = found - exact;
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 3e-4 * exact.cwiseAbs().maxCoeff());
  EXPECT_LT(error.dot(dense * error), 1e-7 * exact.dot(dense * exact));
}

TEST(Simulate, HangingStripStretchesUnderItsOwnWeight) {
  fabric::Card card = shirting();
  card.warp.linearity = 1;  // a straight line: elongation = w L^2 / (2 C11)
  card.areal_density = 5;   // heavy, so that the elongation is well above the stopping rule
  const double length = 0.5;
  const GarmentMesh g = fixtures::sheet(6, 50, 0.06, length, card, [&](double u, double v) { return Eigen::Vector3d(u, v - length, 0); });
  SimulationParams params;
  params.fixed = {"sheet.top"};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.converged);
  const double c11 = card.tensile_force_max / card.warp.strain_max;
  const double expected = 5 * 9.81 * length * length / (2 * c11);
  EXPECT_NEAR((-length - result->garment.x.col(1).minCoeff()) / expected, 1, 0.005);
}

/// Drop over reach of a strip whose first row of cells is clamped, against the elastica. The joint at the clamp stands for
/// half a cell on either side of it, so the free length begins half a cell inside the clamp (docs/mechanics.md#bending).
TEST(Simulate, CantileverFollowsTheMasterCurve) {
  fabric::Card card = shirting();
  card.warp = card.weft = {.strain_max = 0.01, .linearity = 1, .resilience = 0.6, .bending = 2e-5};
  const int cells = 32;
  const double length = 0.08, cell = length / cells;
  // Gamma = w L^3 / B = 10: H/W = 1.066802
  const double free_length = length + 0.5 * cell;
  card.areal_density = 10 * 2e-5 / (free_length * free_length * free_length) / 9.81;
  card.tensile_force_max = 2000;
  mesh::GarmentMesh g = fixtures::sheet(cells + 1, 4, length + cell, 4 * cell, card, [&](double u, double v) { return Eigen::Vector3d(u - cell, 0, -v); });
  mesh::Run run{.id = static_cast<int>(g.runs.size()), .panel = 0, .name = "clamp", .internal = true};
  g.runs.push_back(run);
  for (int j = 0; j <= 4; ++j) {
    for (int i = 0; i < 2; ++i) g.run_vertices.push_back({run.id, j * (cells + 2) + i, 0});
  }
  SimulationParams params;
  params.fixed = {"sheet.clamp"};
  params.residual = 1e-3;
  params.max_iterations = 2000;
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.converged) << result->report.residual;
  double h = 0, w = 0;
  for (int j = 0; j <= 4; ++j) {
    const int tip = j * (cells + 2) + cells + 1;
    h += -result->garment.x(tip, 1) / 5;
    w += (result->garment.x(tip, 0) + 0.5 * cell) / 5;
  }
  RecordProperty("ratio", std::to_string(h / w / 1.066802));
  EXPECT_NEAR(h / w / 1.066802, 1, 0.01);
}

mesh::SupportMesh ball() { return fixtures::ellipsoid({0.1, 0.1, 0.1}, {0, 0, 0}, 24, 32); }

GarmentMesh napkin() {
  return fixtures::sheet(24, 24, 0.3, 0.3, shirting(), [](double u, double v) { return Eigen::Vector3d(u - 0.15, 0.104, 0.15 - v); });
}

void expect_clean(const SimulationOutcome& outcome, const mesh::SupportMesh& support) {
  const GarmentMesh& g = outcome.garment;
  const mesh::Ids node = mesh::particles(g);
  mesh::Points3 x(node.maxCoeff() + 1, 3);
  for (Eigen::Index v = 0; v < node.size(); ++v) x.row(node[v]) = g.x.row(v);
  const contact::Surface cloth = contact::make_surface(static_cast<int>(x.rows()), mesh::mapped(g.faces, node));
  const contact::Surface body = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  EXPECT_EQ(contact::self_intersections(cloth, x).size(), 0u);
  EXPECT_EQ(contact::support_intersections(cloth, x, body, support.x).size(), 0u);
  EXPECT_EQ(contact::SupportField(body, support.x).penetrations(x, cloth.vertices).size(), 0u);
}

TEST(Simulate, NapkinOnABallMovesWithoutPenetrationAndTheSameAtAnyThreadCount) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.5;
  std::vector<SimulationOutcome> outcomes;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    auto result = simulate(napkin(), ball(), params);
    ASSERT_TRUE(result);
    outcomes.push_back(std::move(*result));
  }
  set_thread_count(0);
  expect_clean(outcomes[0], ball());
  EXPECT_LT(outcomes[0].garment.x.col(1).minCoeff(), 0.05);  // it has fallen
  for (int i = 1; i < 3; ++i) {
    EXPECT_TRUE(outcomes[static_cast<std::size_t>(i)].garment.x == outcomes[0].garment.x);
    EXPECT_TRUE(outcomes[static_cast<std::size_t>(i)].garment.vertex_columns.at("vy").reals == outcomes[0].garment.vertex_columns.at("vy").reals);
    EXPECT_EQ(outcomes[static_cast<std::size_t>(i)].log, outcomes[0].log);
  }
}

TEST(Simulate, OpenTubeClosesAndComesToRest) {
  const mesh::SupportMesh support = fixtures::ellipsoid({0.12, 0.3, 0.12}, {0, 0, 0}, 40, 40);
  const GarmentMesh g = fixtures::open_tube(14, 8, 0.105, 0.15, 0.33, 0.03, shirting());
  SimulationParams params;
  params.residual = 1e-3;
  const auto result = simulate(g, support, params);
  ASSERT_TRUE(result);
  for (const Issue& issue : result->findings) ADD_FAILURE() << to_string(issue);
  EXPECT_TRUE(result->report.converged);
  EXPECT_LE(result->report.residual, 1e-3);
  EXPECT_LE(result->report.strain_warp_max, 0.03);
  EXPECT_LE(result->report.strain_weft_max, 0.03);
  EXPECT_EQ(result->garment.marks.at("converged"), "yes");
  for (const mesh::Weld& weld : g.welds) EXPECT_TRUE(result->garment.x.row(weld.a) == result->garment.x.row(weld.b));
  expect_clean(*result, support);
}

TEST(Simulate, WhatCannotConvergeIsMarkedAndWritten) {
  SimulationParams params;
  params.max_iterations = 3;
  const auto result = simulate(napkin(), ball(), params);
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->report.converged);
  EXPECT_EQ(result->garment.marks.at("converged"), "no");
  ASSERT_EQ(result->findings.size(), 1u);
  EXPECT_EQ(result->findings[0].category, Category::not_converged);
}

TEST(Simulate, InterruptionKeepsTheState) {
  SimulationHooks hooks;
  int calls = 0;
  hooks.interrupted = [&] { return ++calls > 5; };
  const auto result = simulate(napkin(), ball(), {}, hooks);
  ASSERT_TRUE(result);
  ASSERT_EQ(result->findings.size(), 1u);
  EXPECT_EQ(result->findings[0].category, Category::interrupted);
}

TEST(Simulate, ClothInsideTheSupportIsPushedOutAndReported) {
  const GarmentMesh g = fixtures::sheet(16, 16, 0.2, 0.2, shirting(), [](double u, double v) { return Eigen::Vector3d(u - 0.1, 0.098, 0.1 - v); });
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.2;
  const auto result = simulate(g, ball(), params);
  ASSERT_TRUE(result);
  EXPECT_GT(result->report.start_inside, 0);
  EXPECT_GT(result->report.start_move, 0.001);
  expect_clean(*result, ball());
}

TEST(Simulate, BadInputIsRefused) {
  GarmentMesh g = napkin();
  g.face_laminate[3] = -1;
  auto result = simulate(g, ball(), {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues()[0].code, "no_laminate");
  mesh::SupportMesh open = ball();
  open.faces.conservativeResize(open.faces.rows() - 1, 3);
  open.face_region.conservativeResize(open.faces.rows());
  result = simulate(napkin(), open, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues()[0].code, "open_surface");
  SimulationParams params;
  params.fixed = {"sheet.tap"};
  result = simulate(napkin(), ball(), params);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues()[0].code, "unknown_edge");
}

}  // namespace
}  // namespace toile::dynamics
