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

TEST(LinearSolver, TakesABodyThatNextToNothingHolds) {
  // Patches of a free sheet: their rigid motions cost nothing, and the stiffnesses of their blocks cancel to what rounding leaves.
  for (double mass : {0.0, 1e-9}) {
    const GarmentMesh g = fixtures::sheet(40, 40, 0.4, 0.4, shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.01 * std::sin(30 * u) * std::cos(17 * v)); });
    const mechanics::Sheet sheet = *mechanics::make_sheet(g, mesh::particles(g), {});
    mechanics::SheetResponse r;
    mechanics::evaluate(sheet, g.x, mesh::Points3(0, 3), mechanics::Curvature::positive, r);
    const int n = r.matrix.rows();
    std::vector<Float4> b(static_cast<std::size_t>(n)), x;
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) r.matrix.value[static_cast<std::size_t>(r.matrix.diagonal[static_cast<std::size_t>(i)])].column[c][c] += static_cast<float>(mass);
      b[static_cast<std::size_t>(i)] = Float4{i == 0 ? 1.0f : i + 1 == n ? -1.0f : 0.0f, 0, 0, 0};  // pulled apart at two corners
    }
    LinearSolver solver;
    solver.factor(r.matrix, {}, g.x, std::vector<char>(static_cast<std::size_t>(n), 0));
    const SolveReport report = solver.solve(r.matrix, {}, b, x, {.tolerance = 0.05, .max_iterations = 1000});
    EXPECT_LT(report.reduction, 0.2);
    for (const Float4& move : x) EXPECT_TRUE(std::isfinite(move[0]) && std::isfinite(move[1]) && std::isfinite(move[2]));
  }
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

/// Drop over reach at the free end of a strip that is clamped level at its left edge.
struct Cantilever {
  double ratio = 0;
  bool converged = false;
};
Cantilever cantilever(const GarmentMesh& g, const SimulationParams& given = {}) {
  SimulationParams params = given;
  ConstraintSpec clamp;
  clamp.on = {"sheet.left"};
  clamp.kind = Hold::clamp;
  params.constraints.push_back(clamp);
  const auto result = simulate(g, std::nullopt, params);
  EXPECT_TRUE(result) << to_string(result.issues().front());
  if (!result) return {};
  double h = 0, w = 0;
  const auto run = mesh::find_run(g, 0, "right");
  for (int v : mesh::run_vertex_ids(g, *run)) {
    h -= result->garment.x(v, 1);
    w += result->garment.x(v, 0);
  }
  return {h / w, result->report.converged};
}

/// A card whose strip of this length has this gamma = w L^3/B, hardly stretches and has no friction.
fabric::Card elastica_card(double gamma, double length) {
  fabric::Card card = shirting();
  card.warp = card.weft = {.strain_max = 0.01, .linearity = 1, .resilience = 1, .bending = 2e-5};
  card.areal_density = gamma * 2e-5 / (length * length * length) / 9.81;
  card.tensile_force_max = 2000;
  return card;
}

/// Drop over reach of the elastica that bends under its own weight. With t from the free end and p the angle to the vertical
/// p'' = gamma t sin p, p'(0) = 0, p(1) = 90 degrees; p(0) is found by halving, as a logarithm since it is exp(-sqrt(gamma)) small.
double elastica(double gamma) {
  const int steps = 4000;
  const double h = 1.0 / steps;
  double low = std::log(0.5 * M_PI) - 3 * std::sqrt(gamma) - 1, high = std::log(0.5 * M_PI), ratio = 0;
  for (int trial = 0; trial < 80; ++trial) {
    const double middle = 0.5 * (low + high);
    double p = std::exp(middle), q = 0, t = 0, drop = 0.5 * std::cos(p), reach = 0.5 * std::sin(p);
    for (int i = 0; i < steps && p < M_PI; ++i) {
      const auto slope = [&](double time, double angle) { return gamma * time * std::sin(angle); };
      const double k1 = q, l1 = slope(t, p), k2 = q + 0.5 * h * l1, l2 = slope(t + 0.5 * h, p + 0.5 * h * k1);
      const double k3 = q + 0.5 * h * l2, l3 = slope(t + 0.5 * h, p + 0.5 * h * k2), k4 = q + h * l3, l4 = slope(t + h, p + h * k3);
      p += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      q += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
      t += h;
      drop += std::cos(p);
      reach += std::sin(p);
    }
    ratio = (drop - 0.5 * std::cos(p)) / (reach - 0.5 * std::sin(p));
    (p < 0.5 * M_PI ? low : high) = middle;
  }
  return ratio;
}

TEST(Simulate, CantileverFollowsTheMasterCurveOnAnyMesh) {
  struct Row {
    double gamma;
    int cells;
    double tolerance;
  };
  EXPECT_NEAR(elastica(0.01), 0.01 / 8, 1e-7);
  EXPECT_NEAR(elastica(10), 1.066802, 1e-5);
  const double length = 0.08;
  for (const Row& row : {Row{0.1, 32, 0.003}, {1, 32, 0.003}, {10, 32, 0.003}, {100, 64, 0.0035}}) {
    const double expected = elastica(row.gamma);
    double low = 1e300, high = 0;
    for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::single, fixtures::Net::jittered, fixtures::Net::delaunay}) {
      const GarmentMesh g = fixtures::net(net, row.cells, row.cells * 3 / 16, length, 0.015, elastica_card(row.gamma, length), [](double u, double v) { return Eigen::Vector3d(u, 0, -v); });
      SimulationParams params;
      params.residual = 1e-4;
      params.max_iterations = 2000;
      const Cantilever c = cantilever(g, params);
      std::printf("cantilever gamma %g, %d cells, %s: ratio %.5f\n", row.gamma, row.cells, fixtures::name_of(net), c.ratio / expected);
      EXPECT_TRUE(c.converged) << row.gamma << " " << fixtures::name_of(net);
      EXPECT_NEAR(c.ratio / expected, 1, row.tolerance) << row.gamma << " " << fixtures::name_of(net);
      low = std::min(low, c.ratio);
      high = std::max(high, c.ratio);
    }
    EXPECT_LT(high / low - 1, 0.005) << row.gamma;
  }
}

TEST(Constraints, DrivenStripPullsWithItsKesCurve) {
  fabric::Card card = shirting();
  card.warp.resilience = card.weft.resilience = 1;
  const GarmentMesh g = fixtures::sheet(10, 8, 0.05, 0.04, card, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  SimulationParams params;
  params.gravity = 0;
  params.increments = 4;
  params.duration = 4;
  params.residual = 1e-6;
  ConstraintSpec low, high;
  low.name = "low";
  low.on = {"sheet.bottom"};
  high.name = "high";
  high.on = {"sheet.top"};
  high.kind = Hold::drive;
  high.times = {0, 4};
  high.move = {{0, 0, 0}, {0, 0.0012, 0}};  // 3 %
  params.constraints = {low, high};
  params.record = "record.csv";
  params.watch = {"sheet.top"};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  EXPECT_TRUE(result->report.converged);
  ASSERT_EQ(result->report.reactions.size(), 2u);
  const double expected = 0.05 * fabric::tensile_curve(card, card.warp).at(0.03).force;
  EXPECT_NEAR(result->report.reactions[1].force.y() / expected, 1, 1e-4);
  EXPECT_NEAR(result->report.reactions[0].force.y() / expected, -1, 1e-4);
  EXPECT_EQ(std::count(result->record.begin(), result->record.end(), '\n'), 5);
  for (int v : mesh::run_vertex_ids(g, *mesh::find_run(g, 0, "top"))) EXPECT_EQ(result->garment.x(v, 1), 0.0412);
}

TEST(Constraints, LoadOnASlidingEdgeDoesTheSame) {
  fabric::Card card = shirting();
  card.warp.resilience = card.weft.resilience = 1;
  const GarmentMesh g = fixtures::sheet(10, 8, 0.05, 0.04, card, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const double force = 0.05 * fabric::tensile_curve(card, card.warp).at(0.02).force;
  SimulationParams params;
  params.gravity = 0;
  params.residual = 1e-6;
  ConstraintSpec low, high;
  low.on = {"sheet.bottom"};
  high.on = {"sheet.top"};
  high.kind = Hold::slide;
  high.along = std::array<double, 3>{0, 2, 0};
  params.constraints = {low, high};
  LoadSpec load;
  load.on = {"sheet.top"};
  load.force = {0.5, force, 0};  // what acts across is taken by the guide
  params.loads = {load};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  EXPECT_TRUE(result->report.converged);
  for (int v : mesh::run_vertex_ids(g, *mesh::find_run(g, 0, "top"))) {
    EXPECT_NEAR(result->garment.x(v, 1), 0.04 * 1.02, 2e-6);
    EXPECT_NEAR(result->garment.x(v, 0), g.x(v, 0), 1e-12);
  }
  EXPECT_NEAR(result->report.reactions[1].force.x(), -0.5, 1e-4);
  EXPECT_NEAR(result->report.reactions[0].force.y(), -force, 1e-4 * force);
}

/// Two clamps turn towards each other on circular arcs: the strip between them is a cylinder, and the clamps bear its moment.
TEST(Constraints, ClampsBendAStripWithTheMomentOfItsCurvature) {
  fabric::Card card = shirting();
  card.warp.bending = card.weft.bending = 1e-5;
  const double length = 0.08, width = 0.05, angle = 1.0;  // 12.5 1/m
  const GarmentMesh g = fixtures::sheet(48, 8, length, width, card, [](double u, double v) { return Eigen::Vector3d(u, 0, -v); });
  SimulationParams params;
  params.gravity = 0;
  params.increments = 20;
  params.residual = 1e-5;
  ConstraintSpec left, right;
  left.name = "left";
  left.on = {"sheet.left"};
  left.kind = Hold::clamp;
  right.name = "right";
  right.on = {"sheet.right"};
  right.kind = Hold::clamp;
  right.axis = {0, 0, 1};
  for (int k = 0; k <= 20; ++k) {
    const double a = angle * k / 20, r = k == 0 ? 0 : length / a;
    right.times.push_back(k / 20.0);
    right.turn.push_back(a);
    right.move.push_back({k == 0 ? 0.0 : r * std::sin(a) - length, k == 0 ? 0.0 : r * (1 - std::cos(a)), 0});
  }
  params.constraints = {left, right};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  EXPECT_TRUE(result->report.converged);
  const double moment = 1e-5 * angle / length * width;
  EXPECT_NEAR(result->report.reactions[1].moment.z() / moment, 1, 0.005);
  EXPECT_NEAR(result->report.reactions[0].moment.z() / moment, -1, 0.005);
  EXPECT_LT(result->report.reactions[1].force.norm() * length, 0.02 * moment);
}

TEST(Constraints, GravityTurnsAndGrows) {
  const GarmentMesh g = fixtures::sheet(6, 12, 0.06, 0.12, shirting(), [](double u, double v) { return Eigen::Vector3d(u, 0, v); });
  SimulationParams params;
  params.gravity_direction = {0, 0, -2};
  params.gravity_times = {0, 1};
  params.gravity_factor = {0, 0.5};
  params.fixed = {"sheet.top"};
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->report.converged);
  ASSERT_EQ(result->report.reactions.size(), 1u);
  EXPECT_EQ(result->report.reactions[0].name, "fixed");
  EXPECT_NEAR(result->report.reactions[0].force.z(), 0.5 * 9.81 * 0.06 * 0.12 * 0.12, 1e-5);
}

TEST(Constraints, PartsAndRegionsAreSelected) {
  const GarmentMesh g = fixtures::sheet(10, 4, 0.1, 0.04, shirting(), [](double u, double v) { return Eigen::Vector3d(u, 0, v); });
  auto part = select(g, {{"sheet.bottom"}, 0.25, 0.65, {}}, "x");
  ASSERT_TRUE(part);
  EXPECT_EQ(part->vertices, (std::vector<int>{3, 4, 5, 6}));
  EXPECT_NEAR(part->share[1], 1.0 / 3, 1e-12);
  EXPECT_NEAR(part->share[0], 1.0 / 6, 1e-12);
  part = select(g, {{"sheet"}, 0, 1, {{-0.001, -0.001}, {0.011, -0.001}, {0.011, 0.05}, {-0.001, 0.05}}}, "x");
  ASSERT_TRUE(part);
  EXPECT_EQ(part->vertices.size(), 10u);
  part = select(g, {{"sheet"}, 0, 1, {{1, 1}, {2, 1}, {2, 2}}}, "load x");
  ASSERT_FALSE(part);
  EXPECT_EQ(part.issues()[0].code, "empty_selection");
  part = select(g, {{"sheet.hem"}, 0, 1, {}}, "x");
  ASSERT_FALSE(part);
  EXPECT_EQ(part.issues()[0].code, "unknown_edge");
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
  EXPECT_EQ(outcomes[0].report.unconverged_steps, 0);
  EXPECT_LT(outcomes[0].report.iterations, 150);
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

/// A square of cloth lies flat, the corner of another one pokes through it by `depth` [m].
GarmentMesh poked(double depth) {
  GarmentMesh g;
  fixtures::add_fabric(g, shirting());
  fixtures::add_grid_panel(g, "flat", 12, 12, 0.12, 0.12, [](double u, double v) { return Eigen::Vector3d(u - 0.06, 0, 0.06 - v); });
  fixtures::add_grid_panel(g, "corner", 10, 10, 0.1, 0.1, [&](double u, double v) { return Eigen::Vector3d(0.0013 + 0.5 * (u - v), 0.70 * (u + v) - depth, 0.0031 + 0.5 * (u + v)); });
  return g;
}

TEST(Simulate, StartThatCutsThroughItselfIsUntangledAndReported) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.1;
  const auto result = simulate(poked(0.008), std::nullopt, params);
  ASSERT_TRUE(result);
  const SimulationReport& r = result->report;
  EXPECT_GT(r.start_intersections, 0);
  EXPECT_EQ(r.start_left, 0);
  EXPECT_EQ(r.intersections, 0);
  EXPECT_TRUE(result->findings.empty()) << to_string(result->findings.front());
  EXPECT_GT(r.start_move, 0.003);
  EXPECT_LT(r.start_move, 0.03);
  ASSERT_FALSE(r.untangled.empty());
  for (const Untangling& u : r.untangled) {
    EXPECT_TRUE(u.panel == "flat" || u.panel == "corner");
    EXPECT_GT(u.moved, 0);
    EXPECT_LE(u.largest_move, r.start_move);
  }
}

TEST(Simulate, WhatCannotBeUntangledIsNamed) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = 0.02;
  // All that could move is held.
  params.fixed = {"corner.bottom", "corner.left", "corner.right", "corner.top"};
  ConstraintSpec all;
  all.name = "all";
  all.on = {"flat", "corner"};
  params.constraints = {all};
  const auto result = simulate(poked(0.008), std::nullopt, params);
  ASSERT_TRUE(result);
  EXPECT_GT(result->report.start_left, 0);
  EXPECT_GT(result->report.intersections, 0);
  ASSERT_FALSE(result->findings.empty());
  EXPECT_EQ(result->findings.front().code, "self_intersection");
  EXPECT_EQ(result->findings.front().category, Category::check);
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
