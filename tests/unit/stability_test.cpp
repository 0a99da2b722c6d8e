// The smallest stiffness of an equilibrium: against matrices, and against the lowest frequency of a cantilever.
#include "cloth_fixtures.h"
#include "toile/dynamics/simulate.h"
#include "toile/dynamics/stability.h"

#include <gtest/gtest.h>

#include <cmath>

namespace toile::dynamics {
namespace {

using mesh::Points3;

/// A chain of springs of 1 N/m between nodes of `mass`, its ends held by the same, with `extra` added at each.
StiffnessProblem chain(Eigen::Index n, double mass, double extra) {
  StiffnessProblem problem;
  problem.mass = Eigen::VectorXd::Constant(n, mass);
  problem.stiffness = [n, extra](const Points3& v, Points3& out) {
    out = (2 + extra) * v;
    out.topRows(n - 1) -= v.bottomRows(n - 1);
    out.bottomRows(n - 1) -= v.topRows(n - 1);
  };
  problem.precondition = [](const Points3& r, Points3& out) { out = r / 2; };
  return problem;
}

TEST(LowestStiffness, IsTheSmallestEigenvalue) {
  const Eigen::Index n = 40;
  for (const double extra : {0.0, -0.5, 3.0}) {
    const LowestStiffness found = lowest_stiffness(chain(n, 0.25, extra), 1e-9, 2000);
    EXPECT_TRUE(found.converged);
    const double exact = (2 + extra - 2 * std::cos(M_PI / (n + 1))) / 0.25;
    EXPECT_NEAR(found.value, exact, 1e-6 * std::abs(exact)) << extra;
    EXPECT_NEAR(0.25 * found.mode.squaredNorm(), 1, 1e-9);
  }
}

TEST(LowestStiffness, OfNothingFreeIsNothing) {
  StiffnessProblem problem = chain(5, 1, 0);
  problem.precondition = [](const Points3& r, Points3& out) { out = 0 * r; };
  const LowestStiffness found = lowest_stiffness(problem);
  EXPECT_EQ(found.value, 0);
  EXPECT_EQ(found.iterations, 0);
}

TEST(Stability, OfACantileverIsTheSquareOfItsFrequency) {
  fabric::Card card = fixtures::shirting();
  SimulationParams params;
  params.gravity = 0;
  params.stability = true;
  ConstraintSpec clamp;
  clamp.name = "clamp";
  clamp.on = {"sheet.left"};
  clamp.kind = Hold::clamp;
  params.constraints = {clamp};
  const double length = 0.06;
  const mesh::GarmentMesh g = fixtures::sheet(24, 4, length, 0.01, card, [&](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const auto result = simulate(g, std::nullopt, params);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  ASSERT_TRUE(result->report.lowest_stiffness.has_value());
  const double exact = std::pow(1.8751040687, 4) * fabric::constitutive(card)->bending_weft / (card.areal_density * std::pow(length, 4));
  EXPECT_NEAR(*result->report.lowest_stiffness / exact, 1, 5e-3);
}

TEST(Stability, IsOfEquilibriaOnly) {
  SimulationParams params;
  params.stability = true;
  params.mode = Mode::motion;
  ASSERT_FALSE(validate(params).empty());
  EXPECT_EQ(validate(params)[0].code, "bad_combination");
}

}  // namespace
}  // namespace toile::dynamics
