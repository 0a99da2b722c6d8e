// The virtual laboratory's references against independently computed values, its verdicts and its ways to write them.
#include "toile/lab/experiments.h"
#include "toile/lab/references.h"
#include "toile/lab/report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

namespace toile::lab {
namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

TEST(references, cantilever_is_the_heavy_elastica) {
  // Integrated with another scheme (12 digits under step halving at gamma = 100).
  const double table[][3] = {{0.1, .012500, .012498}, {0.5, .062444, .062306}, {1, .124562, .123471}, {2, .246673, .238507}, {5, .585721, .495905}, {10, 1.066802, .700200},
                             {20, 1.863930, .829881}, {50, 3.705561, .907917}, {100, 5.888105, .937524}, {200, 8.906771, .956769}, {500, 14.76880, .973117}, {1000, 21.33544, .981141}};
  for (const auto& [gamma, ratio, drop] : table) {
    const Cantilever c = cantilever(gamma);
    EXPECT_NEAR(c.drop / c.reach / ratio, 1, gamma < 1 ? 5e-5 : 2e-6) << gamma;
    EXPECT_NEAR(c.drop, drop, 2e-6) << gamma;
  }
  // Small loads: gamma/8.
  const Cantilever small = cantilever(1e-3);
  EXPECT_NEAR(small.drop / small.reach, 1.25e-4, 1e-9);
}

TEST(references, cantilever_with_friction) {
  EXPECT_NEAR(cantilever(10, 1).drop / cantilever(10, 1).reach, 0.6570, 5e-5);
  EXPECT_NEAR(cantilever(10, 2).drop / cantilever(10, 2).reach, 0.3900, 5e-5);
  EXPECT_EQ(cantilever(2, 1).drop, 0);  // locked
  // Where curvature only grows, the path does not matter; at once, it does not anywhere.
  EXPECT_NEAR(loaded_cantilever(10, 1, 20).drop / loaded_cantilever(10, 1, 20).reach, cantilever(10, 1).drop / cantilever(10, 1).reach, 5e-4);
  EXPECT_NEAR(loaded_cantilever(100, 2, 1).drop / loaded_cantilever(100, 2, 1).reach, cantilever(100, 2).drop / cantilever(100, 2).reach, 4e-3);
  EXPECT_NEAR(loaded_cantilever(100, 2, 100).drop / loaded_cantilever(100, 2, 100).reach, 4.732, 4e-3);
}

TEST(references, overhang_at_the_standard_angle) {
  EXPECT_NEAR(overhang(radians(41.5)), 2.00035, 2e-5);
  EXPECT_NEAR(overhang(radians(41.5), 0.2), 2.17766, 2e-5);
  EXPECT_NEAR(overhang(radians(41.5), 1), 2.72659, 2e-5);
}

TEST(references, tensile_curves) {
  EXPECT_NEAR(tensile_exponent(0.525), 3.34315, 1e-5);
  EXPECT_NEAR(tensile_exponent(0.625), 2.46933, 1e-5);
  EXPECT_EQ(tensile_exponent(1), 0);
  // By quadrature of the strain over the tension.
  const double a = 30, b = 60, weight = 5, length = 0.4;
  double sum = 0;
  for (int i = 0; i < 20000; ++i) sum += std::log1p(weight * length * (i + 0.5) / 20000 / a) / b * length / 20000;
  EXPECT_NEAR(hang(weight, length, a, b) / sum, 1, 1e-8);
  EXPECT_NEAR(hang(weight, length, 1000, 0), 0.0004, 1e-12);
}

TEST(references, catenary) {
  // y = a cosh(x/a), inextensible.
  const double a = 0.15, span = 0.32, length = 2 * a * std::sinh(0.5 * span / a);
  const Catenary c = catenary(span, length, 2, 1e9);
  EXPECT_NEAR(c.sag, a * (std::cosh(0.5 * span / a) - 1), 1e-7);
  EXPECT_NEAR(c.pull, 2 * a, 1e-6);
}

TEST(references, bias_extension_and_frame) {
  EXPECT_NEAR(bias_extension(radians(9), 0.1, 0.05, 1).force / 0.05, 0.254169, 1e-6);
  EXPECT_NEAR(bias_extension(radians(9), 0.15, 0.05, 1).force / 0.05, 0.296004, 1e-6);
  EXPECT_NEAR(bias_extension(radians(9), 0.1, 0.05, 1).extension / 0.05, 0.0753764, 1e-7);
  const double h = 1e-5;
  EXPECT_NEAR((shear_energy(0.5 + h, 3) - shear_energy(0.5 - h, 3)) / (2 * h), 3 * 0.5 * std::cos(0.5), 1e-8);
}

TEST(references, bias_extension_of_yarns_that_stretch) {
  // Yarns that hardly stretch: the closed solution. The easier they stretch, the less force.
  const std::vector<double> angle{10, 20, 30, 40};
  std::vector<double> extension, stiffer;
  for (const double a : angle) {
    const BiasPoint p = bias_extension(radians(a), 0.1, 0.05, 1);
    extension.push_back(p.extension);
    stiffer.push_back(p.force / 0.05);
  }
  for (const double ratio : {1e6, 1250.0, 350.0}) {
    const std::vector<double> force = bias_extension_of_yarns(extension, 0.1, 0.05, ratio);
    ASSERT_EQ(force.size(), angle.size());
    for (std::size_t i = 0; i < angle.size(); ++i) {
      if (ratio == 1e6) EXPECT_NEAR(force[i] / stiffer[i], 1, 0.002) << angle[i];
      else EXPECT_LT(force[i], 0.97 * stiffer[i]) << ratio << " " << angle[i];
    }
    stiffer = force;
  }
  // On squares half as large and extrapolated from there: 0.2596, 0.5469, 0.8563, 1.1802 at C11/G = 350.
  const std::array<double, 4> finer{0.2596, 0.5469, 0.8563, 1.1802};
  for (std::size_t i = 0; i < angle.size(); ++i) EXPECT_NEAR(stiffer[i] / finer[i], 1, 0.002) << angle[i];
}

TEST(references, lateral_buckling) {
  // Values of a Ritz solution of degree 22 x 6 that estimates its own error at 0.3 %.
  const double table[][3] = {{0.05, 0.5, 18.75}, {0.1, 0.5, 19.35}, {0.2, 0.5, 20.64}, {0.3, 0.5, 22.03}, {0.5, 0.5, 24.96}, {1, 0.5, 32.52}, {0.1, 0.25, 14.07}, {0.5, 0.25, 19.99}};
  for (const auto& [aspect, twist, gamma] : table) EXPECT_NEAR(lateral_buckling(aspect, twist) / gamma, 1, 0.002) << aspect << " " << twist;
}

TEST(references, stick_slip) {
  const std::vector<StickPoint> curve = stick_slip(0);
  ASSERT_GT(curve.size(), 20u);
  const double table[][2] = {{.0039, .0277}, {.0287, .0771}, {.0858, .1397}, {.1241, .1740}, {.2163, .2515}, {.3215, .3475}};
  for (const auto& [eps, mu] : table) {
    double found = 0;
    for (std::size_t i = 1; i < curve.size(); ++i) {
      if (curve[i - 1].eps <= eps && eps <= curve[i].eps) found = curve[i - 1].friction + (curve[i].friction - curve[i - 1].friction) * (eps - curve[i - 1].eps) / (curve[i].eps - curve[i - 1].eps);
    }
    EXPECT_NEAR(found, mu, 2e-4) << eps;
  }
  EXPECT_NEAR(curve.back().eps, 0.33029, 2e-4);
  EXPECT_NEAR(curve.back().friction, 0.35637, 2e-4);
}

Row row(double reference, double value, double target) {
  return {.test = "t", .subject = "s", .model = "woven", .mesh = "grid", .quantity = "q", .unit = "1", .reference = reference, .value = value, .target = target};
}

TEST(report, verdicts) {
  EXPECT_EQ(row(2, 2.02, 0.011).verdict(), Verdict::met);
  EXPECT_EQ(row(2, 1.98, 0.009).verdict(), Verdict::missed);
  EXPECT_EQ(row(2, std::numeric_limits<double>::quiet_NaN(), 1).verdict(), Verdict::failed);
  Row r = row(2, 2, 0.01);
  r.converged = false;
  EXPECT_EQ(r.verdict(), Verdict::missed) << "a run that did not come to rest proves nothing";
  r = row(0, 1e-3, 2e-3);
  EXPECT_EQ(r.verdict(), Verdict::failed) << "no relative error to nothing";
  r.measure = Measure::absolute;
  EXPECT_EQ(r.verdict(), Verdict::met);
  r.value.reset();
  EXPECT_EQ(r.verdict(), Verdict::failed);
  r = row(0, 0.02, 0.01);
  r.measure = Measure::at_most;
  EXPECT_EQ(r.verdict(), Verdict::missed);
}

TEST(report, everything_stands_in_every_form) {
  Section section{.test = "t", .title = "Title", .about = "About.", .rows = {row(2, 2.001, 0.01), row(2, 3, 0.01)}, .plots = {{.name = "p", .title = "P < Q", .x_label = "x", .y_label = "y", .log_y = true, .curves = {{"r", {1, 2}, {1, 10}, true}, {"m", {1, 2}, {0, 5}, false}}}}};
  section.rows[1].note = "because";
  const Report report{.quick = true, .sections = {section}};
  const std::string page = to_markdown(report, "plots");
  for (const char* word : {"# Validation", "Reduced set", "## <a id=\"t\"></a>Title", "About.", "plots/p.svg", "because", "**missed**", "+50 %", "| met |"}) EXPECT_NE(page.find(word), std::string::npos) << word;
  const std::string json = to_json(report);
  for (const char* word : {"\"met\": 1", "\"missed\": 1", "\"failed\": 0", "\"verdict\": \"missed\"", "\"note\": \"because\""}) EXPECT_NE(json.find(word), std::string::npos) << word << json;
  EXPECT_NE(text_table(report.rows()).find("missed"), std::string::npos);
  const std::string svg = to_svg(section.plots[0]);
  EXPECT_NE(svg.find("P &lt; Q"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(to_csv(section.plots[0]), "curve,x,y\nr,1,1\nr,2,10\nm,1,0\nm,2,5\n");
}

TEST(experiments, are_complete) {
  std::set<std::string> names;
  for (const auto& [name, title] : test_names()) {
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_FALSE(title.empty());
  }
  for (const bool quick : {true, false}) {
    Scope scope;
    scope.quick = quick;
    for (const Experiment& e : experiments(scope, {})) {
      EXPECT_FALSE(e.about.empty());
      std::set<std::string> folders;
      for (const Case& c : e.cases) {
        EXPECT_TRUE(folders.insert(c.name).second) << e.test << " " << c.name << ": two cases in one folder";
        EXPECT_EQ(c.name.find_first_of("/ "), std::string::npos) << c.name;
      }
      // Where nothing could be run every row is there and failed.
      std::vector<Outcome> none(e.cases.size());
      for (Outcome& o : none) o.trouble = "refused";
      const Section section = e.judge(none);
      EXPECT_EQ(section.test, e.test);
      EXPECT_GE(section.rows.size(), e.cases.size());
      for (const Row& r : section.rows) EXPECT_EQ(r.verdict(), Verdict::failed) << e.test << " " << r.subject;
    }
  }
}

TEST(experiments, records_and_facts_are_read) {
  const Table table = parse_csv("time_s,a.x_m\n0,1e-3\n1,word\n");
  ASSERT_EQ(table.at("a.x_m").size(), 2u);
  EXPECT_EQ(table.at("a.x_m")[0], 1e-3);
  EXPECT_TRUE(std::isnan(table.at("a.x_m")[1]));
  const auto facts = parse_facts(R"({"facts": {"bending_energy [J]": 0.5, "converged": true, "x": "y"}})");
  EXPECT_EQ(facts.at("bending_energy"), 0.5);
  EXPECT_EQ(facts.at("converged"), 1);
  EXPECT_EQ(facts.count("x"), 0u);
  EXPECT_EQ(first_issue(R"({"issues": [{"item": "edge", "what": "is missing"}]})"), "edge: is missing");
}

}  // namespace
}  // namespace toile::lab
