#include <gtest/gtest.h>

#include <cmath>

#include "garments.h"
#include "toile/fabric/constitutive.h"
#include "toile/fabric/laminate.h"

using namespace toile;
using namespace toile::fabric;

namespace {

constexpr double degree = M_PI / 180;

/// Force and slope of a curve against differences of its energy and force.
template <class Curve>
void expect_consistent(const Curve& curve, double x, double h, double scale) {
  const CurvePoint p = curve.at(x), a = curve.at(x - h), b = curve.at(x + h);
  EXPECT_NEAR((b.energy - a.energy) / (2 * h), p.force, 1e-5 * scale) << x;
  EXPECT_NEAR((b.force - a.force) / (2 * h), p.slope, 1e-5 * scale / std::abs(x)) << x;
}

TEST(tables, must_begin_with_zero_and_increase) {
  const auto codes = [](TensionTable table) {
    std::vector<std::string> found;
    for (const Issue& issue : validate(table)) found.push_back(issue.place.item + ": " + issue.what);
    return found;
  };
  EXPECT_TRUE(codes({{0, 0.01, 0.02}, {0, 1, 3}}).empty());
  EXPECT_EQ(codes({{0, 0.01}, {0, 1, 3}}), std::vector<std::string>{"force: 3 values of 'force' stand against 2 of 'strain'"});
  EXPECT_EQ(codes({{0.001, 0.01}, {0, 1}}), std::vector<std::string>{"strain: 'strain' does not begin with 0"});
  EXPECT_EQ(codes({{0, 0.01, 0.02}, {0, 2, 2}}), std::vector<std::string>{"force: 'force' does not increase at its value number 3"});
  EXPECT_EQ(codes({{0}, {0}}), std::vector<std::string>{"strain: a curve needs at least two points"});
}

TEST(tables, curve_goes_through_its_points_without_overshoot) {
  const std::vector<double> x{0, 0.004, 0.01, 0.02, 0.03, 0.05}, y{0, 3, 12, 60, 61, 300};
  const MonotoneCurve curve = monotone_curve(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(curve.at(x[i]).force, y[i], 1e-12);
  double work = 0, before = 0;
  const int steps = 100000;
  for (int i = 1; i <= steps; ++i) {
    const double e = 0.06 * i / steps, force = curve.at(e).force;
    EXPECT_GE(force, before);
    work += 0.5 * (force + before) * 0.06 / steps;
    before = force;
  }
  EXPECT_NEAR(curve.at(0.06).energy, work, 1e-8 * work);
  for (double e : {0.002, 0.005, 0.015, 0.0299, 0.04, 0.055}) expect_consistent(curve, e, 1e-7, 300);
  // The slope is continuous: energy twice continuously differentiable.
  for (std::size_t i = 1; i < x.size(); ++i) EXPECT_NEAR(curve.at(x[i] - 1e-12).slope, curve.at(x[i] + 1e-12).slope, 1e-4);
}

TEST(tables, of_an_exponential_give_it_back) {
  Card card = test::sample_card();
  const TensileCurve exact = tensile_curve(card, card.warp);
  TensionTable table;
  for (int k = 0; k <= 20; ++k) {
    table.strain.push_back(card.warp.strain_max * k / 20);
    table.force.push_back(exact.at(table.strain.back()).force);
  }
  card.warp.tension = table;
  const TensileCurve curve = tensile_curve(card, card.warp);
  EXPECT_NEAR(curve.slope_zero, exact.slope_zero, 0.02 * exact.slope_zero);
  for (int k = 1; k < 60; ++k) {
    const double e = card.warp.strain_max * k / 60;
    EXPECT_NEAR(curve.at(e).force, exact.at(e).force, 2e-4 * card.tensile_force_max);
    EXPECT_NEAR(curve.at(e).energy, exact.at(e).energy, 1e-3 * exact.at(card.warp.strain_max).energy);
  }
  EXPECT_NEAR(curve.at(-0.01).force, -0.01 * curve.slope_zero, 1e-12);
  EXPECT_NEAR(strain_at(curve, card.tensile_force_max), card.warp.strain_max, 1e-9);
}

TEST(shear, locking_leaves_small_angles_alone_and_is_smooth) {
  const double g = 50;
  const Locking locking{5 * degree, 8 * degree, 2};
  const ShearCurve plain{g}, locked = shear_curve(g, locking);
  EXPECT_NEAR(locked.force_at_angle(4 * degree), g * 4 * degree, 1e-12);
  EXPECT_NEAR(locked.at(std::sin(3 * degree)).energy, plain.at(std::sin(3 * degree)).energy, 1e-12);
  EXPECT_NEAR(locked.force_at_angle(20 * degree), g * (8 + 0.5 * 3 + 2 * 12) * degree, 1e-9);
  for (double a : {1.0, 4.9, 5.1, 6.5, 7.9, 8.1, 30.0, 60.0, 69.0}) expect_consistent(locked, std::sin(a * degree), 1e-6, g);
  EXPECT_NEAR(locked.at(-std::sin(0.3)).force, -locked.at(std::sin(0.3)).force, 1e-15);
  EXPECT_NEAR(locked.at(1.0).slope, locked.at(0.999).slope, 1e-9);
  // Work: the integral of F cos(angle).
  double work = 0;
  const int steps = 200000;
  for (int i = 0; i < steps; ++i) {
    const double a = 25 * degree * (i + 0.5) / steps;
    work += locked.force_at_angle(a) * std::cos(a) * 25 * degree / steps;
  }
  EXPECT_NEAR(locked.at(std::sin(25 * degree)).energy, work, 1e-9 * work);
}

TEST(shear, table_goes_through_its_points) {
  ShearTable table{{0, 1 * degree, 3 * degree, 5 * degree, 8 * degree}, {0, 0.8, 2.2, 3.7, 6.9}};
  const ShearCurve curve = shear_curve(table);
  for (std::size_t i = 0; i < table.angle.size(); ++i) EXPECT_NEAR(curve.force_at_angle(table.angle[i]), table.force[i], 1e-12);
  for (double a : {0.5, 2.0, 4.0, 7.0, 12.0}) expect_consistent(curve, std::sin(a * degree), 1e-6, 50);
  EXPECT_NEAR(curve.at(std::sin(-0.05)).force, -curve.force_at_angle(0.05), 1e-12);
}

TEST(moment, is_odd_and_linear_without_a_table) {
  YarnDirection yarn;
  yarn.bending = 2e-5;
  EXPECT_EQ(moment_curve(yarn).at(-100).force, -2e-3);
  yarn.moment = MomentTable{{0, 50, 150, 250}, {0, 1.2e-3, 2.8e-3, 4.1e-3}};
  const MomentCurve curve = moment_curve(yarn);
  EXPECT_NEAR(curve.at(150).force, 2.8e-3, 1e-15);
  EXPECT_NEAR(curve.at(-150).force, -2.8e-3, 1e-15);
  EXPECT_NEAR(curve.at(-150).energy, curve.at(150).energy, 1e-15);
  EXPECT_GT(curve.rigidity, 2.4e-5);
}

TEST(hysteresis, comes_out_as_half_heights_of_the_loops) {
  Card card = test::sample_card();
  card.warp.bending_hysteresis = 7e-4;
  card.weft.bending_hysteresis = 5e-4;
  card.shear_hysteresis = 2;
  card.shear_hysteresis_5 = 3.8;
  card.warp.resilience = 0.5;
  const Constitutive c = *constitutive(card);
  EXPECT_EQ(c.hysteresis.moment_warp, 3.5e-4);
  EXPECT_EQ(c.hysteresis.moment_weft, 2.5e-4);
  EXPECT_NEAR(c.hysteresis.shear.at(0.5 * degree), 1, 1e-12);
  EXPECT_NEAR(c.hysteresis.shear.at(-5 * degree), 1.9, 1e-12);
  EXPECT_NEAR(c.hysteresis.shear.at(0), 1, 1e-12);
  EXPECT_NEAR(c.hysteresis.shear.at(2.75 * degree), 1.45, 1e-12);
  EXPECT_NEAR(c.hysteresis.shear.at(30 * degree), c.hysteresis.shear.at(8 * degree), 1e-12);
  EXPECT_EQ(c.hysteresis.resilience_warp, 0.5);
  // Locking by the growth of the friction.
  EXPECT_EQ(c.locking.ratio, 1);
  card.locking = Locking{10 * degree, 15 * degree, 3};
  EXPECT_EQ(constitutive(card)->locking.ratio, 3);
  card.shear_hysteresis = card.shear_hysteresis_5 = 0;
  card.locking.reset();
  EXPECT_EQ(constitutive(card)->locking.ratio, 1);
}

TEST(bonded_sheets, with_measured_curves_add_up_along_the_whole_curve) {
  Card a = test::sample_card(), b = test::sample_card();
  a.name = "a";
  b.name = "b";
  a.warp.tension = TensionTable{{0, 0.01, 0.03, 0.06}, {0, 20, 120, 490.3325}};
  a.warp.strain_max = 0.06;
  b.warp.moment = MomentTable{{0, 100, 250}, {0, 1e-3, 2e-3}};
  a.shear_table = ShearTable{{0, 0.05, 0.14}, {0, 2, 7}};
  const Card both = *bonded(std::vector{a, b}, "both");
  const Constitutive ca = *constitutive(a), cb = *constitutive(b), c = *constitutive(both);
  for (double e : {0.01, 0.02, 0.03, 0.04}) EXPECT_NEAR(c.warp.at(e).force, ca.warp.at(e).force + cb.warp.at(e).force, 0.01 * c.warp.at(e).force) << e;
  EXPECT_NEAR(c.warp.at(both.warp.strain_max).force, a.tensile_force_max, 0.01 * a.tensile_force_max);
  for (double k : {50.0, 100.0, 250.0}) EXPECT_NEAR(c.moment_warp.at(k).force, ca.moment_warp.at(k).force + cb.moment_warp.at(k).force, 0.01 * c.moment_warp.at(k).force) << k;
  for (double s : {0.02, 0.05, 0.1, 0.2}) EXPECT_NEAR(c.shear.at(s).force, ca.shear.at(s).force + cb.shear.at(s).force, 0.01 * c.shear.at(s).force) << s;
  EXPECT_FALSE(both.weft.tension);
}

}  // namespace
