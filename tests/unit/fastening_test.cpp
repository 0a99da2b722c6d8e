// Buttons while cloth drapes: two squares and what holds them together.
#include "cloth_fixtures.h"
#include "toile/dynamics/simulate.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace toile::dynamics {
namespace {

using fixtures::shirting;
using mesh::GarmentMesh;

constexpr double shank = 3e-3;

/// A square `upper` and one `lower` whose top edge is `gap` below it, a button between the middles of the two edges.
GarmentMesh buttoned(double gap) {
  GarmentMesh g;
  fixtures::add_fabric(g, shirting());
  fixtures::add_grid_panel(g, "upper", 4, 4, 0.08, 0.08, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  fixtures::add_grid_panel(g, "lower", 4, 4, 0.08, 0.08, [&](double u, double v) { return Eigen::Vector3d(u, v - 0.08 - gap, 0); });
  g.closures.push_back({0, "front", "button"});
  g.fasteners.push_back({2, 25 + 22, mesh::Fastener::Kind::button, 0.001, shank, 0});
  return g;
}

SimulationParams holding(std::vector<std::string> panels) {
  SimulationParams params;
  params.residual = 1e-5;
  params.max_iterations = 600;
  params.constraints.push_back({});
  params.constraints.back().name = "held";
  params.constraints.back().on = std::move(panels);
  return params;
}

const Issue* finding(const SimulationOutcome& outcome, const std::string& code) {
  const auto found = std::find_if(outcome.findings.begin(), outcome.findings.end(), [&](const Issue& i) { return i.code == code; });
  return found == outcome.findings.end() ? nullptr : &*found;
}

TEST(Fastening, AButtonClosesAndCarriesWhatHangsOnIt) {
  for (const Model model : {Model::woven, Model::particle}) {
    const GarmentMesh g = buttoned(0.03);
    SimulationParams params = holding({"upper"});
    params.model = model;
    const auto outcome = simulate(g, {}, params);
    ASSERT_TRUE(outcome) << to_string(outcome.issues().front());
    EXPECT_TRUE(outcome->report.converged);
    ASSERT_EQ(outcome->report.closures.size(), 1u);
    const ClosureState& c = outcome->report.closures[0];
    EXPECT_EQ(c.name, "front");
    EXPECT_EQ(c.closed, 1);
    EXPECT_NEAR(c.gap, shank, 1e-4);
    double weight = 0;
    const Eigen::VectorXd mass = mesh::vertex_masses(g);
    for (Eigen::Index v = 0; v < mass.size(); ++v) weight += g.vertex_panel[v] == 1 ? 9.81 * mass[v] : 0;
    EXPECT_NEAR(c.force, weight, 1e-3 * weight);
    EXPECT_EQ(finding(*outcome, "not_closed"), nullptr);
  }
}

TEST(Fastening, OneThatCannotCloseIsNamed) {
  const auto outcome = simulate(buttoned(0.03), {}, holding({"upper", "lower"}));
  ASSERT_TRUE(outcome);
  const Issue* issue = finding(*outcome, "not_closed");
  ASSERT_NE(issue, nullptr);
  EXPECT_EQ(issue->category, Category::check);
  EXPECT_EQ(to_string(*issue), "button front: did not close: its halves are 30.0 mm apart, 3.0 mm were asked for; place its halves nearer together, raise fastening_pull, or leave it open (toile-layer, `open`)");
  EXPECT_EQ(outcome->report.closures[0].closed, 0);
}

TEST(Fastening, OneWithACaptureWaitsForItsHalves) {
  GarmentMesh g = buttoned(0.03);
  g.fasteners[0].capture = 0.01;
  auto outcome = simulate(g, {}, holding({"upper", "lower"}));
  ASSERT_TRUE(outcome);
  EXPECT_NE(finding(*outcome, "not_closed"), nullptr);
  // The lower square is brought near by a path: then it closes.
  SimulationParams params = holding({"upper"});
  params.increments = 4;
  ConstraintSpec path;
  path.name = "path";
  path.on = {"lower.bottom"};
  path.kind = Hold::drive;
  path.times = {0, 1};
  path.move = {{0, 0, 0}, {0, 0.027, 0}};
  params.constraints.push_back(path);
  outcome = simulate(g, {}, params);
  ASSERT_TRUE(outcome) << to_string(outcome.issues().front());
  EXPECT_EQ(outcome->report.closures[0].closed, 1);
}

TEST(Fastening, AnOpenOneOnlyWeighs) {
  GarmentMesh g = buttoned(0.03);
  g.fasteners[0].closed = false;
  const auto outcome = simulate(g, {}, holding({"upper", "lower.top"}));
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(outcome->report.closures.empty());
  for (const Issue& i : outcome->findings) EXPECT_NE(i.code, "not_closed");
}

TEST(Fastening, TheSecondHalfLiesOnTop) {
  for (const double side : {1.0, -1.0}) {
    GarmentMesh g;
    fixtures::add_fabric(g, shirting());
    fixtures::add_grid_panel(g, "under", 4, 4, 0.08, 0.08, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
    fixtures::add_grid_panel(g, "over", 4, 4, 0.08, 0.08, [&](double u, double v) { return Eigen::Vector3d(u, v, 0.01 * side); });
    g.closures.push_back({0, "front", "button"});
    g.fasteners.push_back({12, 25 + 12, mesh::Fastener::Kind::button, 0.001, shank, 0});
    const auto outcome = simulate(g, {}, holding({"under.top", "over.top"}));
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->report.closures[0].closed, 1);
    EXPECT_EQ(finding(*outcome, "closed_wrongly") == nullptr, side > 0) << side;
    EXPECT_EQ(outcome->report.intersections, 0);
  }
}

}  // namespace
}  // namespace toile::dynamics
