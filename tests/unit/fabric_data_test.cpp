#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "toile/fabric/constitutive.h"
#include "toile/fabric/plausibility.h"
#include "toile/inspect/fabric_sheet.h"
#include "toile/io/fabric_yaml.h"
#include "toile/io/file.h"
#include "toile/io/record_yaml.h"

using namespace toile;
using namespace toile::fabric;

namespace {

constexpr double gf_per_cm = 0.980665;

const char* const common = "name: cloth\norigin: authored, not measured\nW: 150 g/m2\nT: 0.3 mm\nMIU: 0.2\n";
const char* const yarns = "warp: {EMT: 3 %, LT: 0.75, B: 0.08 gf*cm2/cm}\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\n";

Card card_of(const std::string& text) {
  const auto card = io::read_fabric(text, "card.yaml");
  EXPECT_TRUE(card) << (card ? "" : to_string(card.issues().front()));
  return card ? *card : Card{};
}

std::vector<std::string> troubles(const std::string& text) {
  std::vector<std::string> list;
  const auto card = io::read_fabric(text, "card.yaml");
  if (card) return list;
  for (const Issue& issue : card.issues()) list.push_back(issue.code + " " + issue.place.item);
  return list;
}
using List = std::vector<std::string>;

TEST(fabric_data, linearity_from_work) {
  const Card by_lt = card_of(std::string(common) + yarns + "G: 1 gf/cm/deg\n");
  // WT = LT F_max EMT / 2 = 0.75 * 500 gf/cm * 0.03 / 2.
  const Card by_wt = card_of(std::string(common) + "warp: {EMT: 3 %, WT: 5.625 gf*cm/cm2, B: 0.08 gf*cm2/cm}\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n");
  EXPECT_NEAR(by_wt.warp.linearity, by_lt.warp.linearity, 1e-12);
  EXPECT_TRUE(troubles(std::string(common) + "warp: {EMT: 3 %, LT: 0.75, WT: 5.7 gf*cm/cm2, B: 0.08 gf*cm2/cm}\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n").empty());
  EXPECT_EQ(troubles(std::string(common) + "warp: {EMT: 3 %, LT: 0.75, WT: 9 gf*cm/cm2, B: 0.08 gf*cm2/cm}\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n"), List{"contradiction warp.WT"});
  EXPECT_EQ(troubles(std::string(common) + "warp: {EMT: 3 %, WT: 9 gf*cm/cm2, B: 0.08 gf*cm2/cm}\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n"), List{"out_of_range warp.WT"});
}

TEST(fabric_data, each_value_needs_one_source) {
  EXPECT_EQ(troubles(common), (List{"missing_data warp", "missing_data warp", "missing_data weft", "missing_data weft", "missing_data G"}));
  EXPECT_EQ(troubles(std::string(common) + yarns + "G: 1 gf/cm/deg\nconstants: {warp: {C: 5 kN/m}, G: 30 N/m/rad}\n"), (List{"doubled_data warp", "doubled_data G"}));
  EXPECT_EQ(troubles(std::string(common) + "warp: {EMT: 3 %, B: 0.08 gf*cm2/cm}\nweft: {LT: 0.7, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n"), (List{"missing_data warp.LT", "missing_data weft.EMT"}));
  EXPECT_EQ(troubles(std::string(common) + yarns + "G: 1 gf/cm/deg\ntwist_ratio: 0.3\nB45: 0.05 gf*cm2/cm\n"), List{"doubled_data B45"});
  EXPECT_EQ(troubles(std::string(common) + yarns + "G: 1 gf/cm/deg\nB45: 0.01 gf*cm2/cm\n"), List{"contradiction B45"});
  EXPECT_EQ(troubles("name: a\norigin: b\nW: 150 g/m2\nT: 0.3 mm\n" + std::string(yarns) + "G: 1 gf/cm/deg\n"), List{"missing_data MIU"});
}

TEST(fabric_data, shear_of_warp_and_weft_apart) {
  const Card card = card_of(std::string(common) +
                            "warp: {EMT: 3 %, LT: 0.75, B: 0.08 gf*cm2/cm, G: 0.8 gf/cm/deg, 2HG: 1 gf/cm, 2HG5: 2 gf/cm}\n"
                            "weft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm, G: 1.2 gf/cm/deg, 2HG: 3 gf/cm, 2HG5: 4 gf/cm}\n");
  EXPECT_NEAR(card.shear, 56.188, 1e-3);
  EXPECT_NEAR(card.shear_hysteresis, 2 * gf_per_cm, 1e-12);
  EXPECT_NEAR(card.shear_hysteresis_5, 3 * gf_per_cm, 1e-12);
  // The tension of 10 gf/cm adds 0.175 gf/(cm deg) to a raw slope.
  const Card raw = card_of(std::string(common) + yarns + "G: 1 gf/cm/deg\nshear_force: raw\n");
  EXPECT_NEAR(raw.shear / 56.187966, 1 - 0.17453, 1e-4);
}

TEST(fabric_data, fast) {
  const Card card = card_of(std::string(common) +
                            "fast:\n  warp: {E5: 0.2 %, E20: 0.9 %, E100: 3 %, C: 19 mm}\n  weft: {E5: 0 %, E20: 1.5 %, E100: 5.2 %, B: 6 uN*m}\n  EB5: 3.1 %\n");
  EXPECT_NEAR(card.shear, 123 / 3.1, 0.2);  // the rule of the FAST manual, rounded there
  EXPECT_NEAR(card.warp.bending, 9.80665e-6 * 150 * std::pow(19.0, 3) * 1e-6, 1e-9);  // 9.8e-6 W C^3 in uN m, g/m2, mm
  EXPECT_NEAR(card.weft.bending, 6e-6, 1e-18);
  const Constitutive c = *constitutive(card);
  EXPECT_NEAR(c.warp.at(0.009).force, 19.6133, 1e-9);
  EXPECT_NEAR(c.warp.at(0.03).force, 98.0665, 1e-9);
  EXPECT_NEAR(c.weft.at(0.052).force, 98.0665, 1e-9);
  EXPECT_NEAR(card.tensile_force_max, 98.0665, 1e-9);
  EXPECT_NEAR(card.warp.strain_max, 0.03, 1e-9);
  EXPECT_EQ(card.warp.resilience, 1);
  EXPECT_EQ(troubles(std::string(common) + "fast:\n  warp: {E5: 2 %, E20: 0.9 %, E100: 3 %, C: 19 mm}\n  weft: {E5: 0 %, E20: 1.5 %, E100: 5.2 %, B: 6 uN*m}\n  EB5: 3.1 %\n"), List{"bad_fast fast.warp"});
  EXPECT_EQ(troubles(std::string(common) + "fast:\n  warp: {E5: 0.2 %, E20: 0.9 %, E100: 3 %, C: 19 mm, B: 20 uN*m}\n  weft: {E5: 0 %, E20: 1.5 %, E100: 5.2 %, B: 6 uN*m}\n  EB5: 3.1 %\n  G: 60 N/m/rad\n"),
            (List{"contradiction fast.G", "contradiction fast.warp.B"}));
}

TEST(fabric_data, constants) {
  const Card card = card_of(std::string(common) + "constants:\n  warp: {C: 5 kN/m, B: 10 uN*m}\n  weft: {E: 10 MPa, B: 8 uN*m}\n  G: 40 N/m/rad\n  nu: 0.2\nB45: 20 uN*m\n");
  const Constitutive c = *constitutive(card);
  EXPECT_NEAR(c.warp.at(0.02).force, 100, 1e-9);
  EXPECT_NEAR(c.warp.at(-0.02).force, -100, 1e-9);
  EXPECT_NEAR(c.weft.slope_zero, 10e6 * 3e-4 / (1 - 0.04), 1e-6);
  EXPECT_NEAR(c.bending_twist, 20e-6 - 4.5e-6, 1e-15);
  // A sheet that would stretch to more than twice its length at 500 gf/cm.
  const Card soft = card_of(std::string(common) + "constants:\n  warp: {C: 25 N/m, B: 10 uN*m}\n  weft: {C: 50 N/m, B: 8 uN*m}\n  G: 10 N/m/rad\n");
  EXPECT_NEAR(soft.tensile_force_max, 25, 1e-12);
  EXPECT_NEAR(constitutive(soft)->warp.at(0.1).force, 2.5, 1e-12);
}

TEST(fabric_data, measured_curves_describe_themselves) {
  const Card card = card_of(std::string(common) +
                            "warp:\n  tension: {strain: [0, 1 %, 2 %, 3 %], force: [0, 60 gf/cm, 210 gf/cm, 500 gf/cm]}\n  moment: {curvature: [0, 0.5 1/cm, 1.5 1/cm, 2.5 1/cm], moment: [0, 0.045 gf*cm/cm, 0.12 gf*cm/cm, 0.18 gf*cm/cm]}\n"
                            "weft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nshear: {angle: [0, 0.5 deg, 2.5 deg, 8 deg], force: [0, 0.5 gf/cm, 2.3 gf/cm, 7.5 gf/cm]}\n");
  EXPECT_NEAR(card.warp.strain_max, 0.03, 1e-9);
  EXPECT_NEAR(card.warp.bending / 9.80665e-5, 0.075, 1e-9);   // slope between 0.5 and 1.5 /cm
  EXPECT_NEAR(card.shear / 56.187966, 0.9, 1e-6);             // slope between 0.5 and 2.5 deg
  EXPECT_GT(card.warp.linearity, 0.5);
  EXPECT_LT(card.warp.linearity, 0.8);
  EXPECT_EQ(troubles(std::string(common) +
                     "warp:\n  EMT: 4 %\n  tension: {strain: [0, 1 %, 2 %, 3 %], force: [0, 60 gf/cm, 210 gf/cm, 500 gf/cm]}\n  B: 0.05 gf*cm2/cm\nweft: {EMT: 7 %, LT: 0.72, B: 0.05 gf*cm2/cm}\nG: 1 gf/cm/deg\n"),
            List{"contradiction warp.EMT"});
}

TEST(fabric_data, a_card_reads_back_as_itself) {
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TOILE_SOURCE_DIR) + "/samples/fabrics")) {
    const auto text = io::read_file(entry.path().string());
    const Card card = card_of(*text);
    const Card again = card_of(io::block_yaml(*record_type<Card>(), &card));
    EXPECT_EQ(io::flow_yaml(card), io::flow_yaml(again)) << entry.path();
  }
}

TEST(fabric_data, samples_have_a_licence_or_are_authored_and_are_plausible) {
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TOILE_SOURCE_DIR) + "/samples/fabrics")) {
    const auto measured = io::read_record<Measured>(*io::read_file(entry.path().string()), entry.path().string());
    ASSERT_TRUE(measured) << to_string(measured.issues().front());
    EXPECT_TRUE(measured->licence || measured->origin == "authored, not measured") << entry.path();
    const Plausibility p = plausibility(*measured, *resolve(*measured));
    EXPECT_TRUE(p.findings.empty()) << entry.path() << to_string(p.findings.front());
    EXPECT_TRUE(p.warnings.empty()) << entry.path() << to_string(p.warnings.front());
  }
}

/// The examples of the page are files that work.
TEST(fabric_data, examples_of_the_documentation) {
  const std::string page = *io::read_file(std::string(TOILE_SOURCE_DIR) + "/docs/fabric.md");
  int count = 0;
  for (std::size_t at = page.find("```yaml\n"); at != std::string::npos; at = page.find("```yaml\n", at + 1)) {
    const std::string text = page.substr(at + 8, page.find("```\n", at + 8) - at - 8);
    const auto measured = io::read_record<Measured>(text, "fabric.md");
    ASSERT_TRUE(measured) << to_string(measured.issues().front()) << "\n" << text;
    const auto sheet = inspect::fabric_sheet(*measured);
    ASSERT_TRUE(sheet) << to_string(sheet.issues().front());
    EXPECT_TRUE(sheet->plausibility.findings.empty()) << to_string(sheet->plausibility.findings.front());
    ++count;
  }
  EXPECT_EQ(count, 4);
}

TEST(plausible, names_everything_that_is_impossible) {
  Card card = card_of(std::string(common) + yarns + "G: 1 gf/cm/deg\n");
  EXPECT_TRUE(plausibility(card).findings.empty());
  card.thickness = 3e-5;        // 5 g/cm3
  card.warp.bending *= 1e4;     // a rigidity in the wrong unit
  card.weft.bending_hysteresis = 6 * 100 * card.weft.bending;
  List keys;
  for (const Issue& issue : plausibility(card).findings) {
    EXPECT_EQ(issue.category, Category::check);
    keys.push_back(issue.place.item);
  }
  EXPECT_EQ(keys, (List{"W/T", "warp.B/(C T2/12)", "weft.2HB/2B", "weft.B/(C T2/12)"}));
}

TEST(plausible, warns_of_mixed_tests_and_exchanged_values) {
  const auto codes = [](const std::string& text) {
    List list;
    const Measured m = *io::read_record<Measured>(text, "card.yaml");
    for (const Issue& issue : plausibility(m, *resolve(m)).warnings) list.push_back(issue.code + " " + issue.place.item);
    return list;
  };
  EXPECT_EQ(codes(std::string(common) + yarns + "G: 1 gf/cm/deg\ntwist_ratio: 0.3\n"), List{});
  EXPECT_EQ(codes(std::string(common) + "warp: {EMT: 3 %, LT: 0.75, bending_length: 18 mm, 2HB: 0.05 gf*cm/cm}\nweft: {EMT: 7 %, LT: 0.72, bending_length: 16 mm}\nG: 1 gf/cm/deg\n2HG: 3 gf/cm\n2HG5: 2 gf/cm\n"),
            (List{"unusual 2HG5", "mixed_tests warp.2HB", "assumed B45"}));
}

TEST(plot, ticks_are_round_and_cover_the_range) {
  using inspect::round_ticks;
  EXPECT_EQ(round_ticks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(-0.3, 1.1, 6).front(), -0.5);
  EXPECT_GE(round_ticks(-0.3, 1.1, 6).back(), 1.1);
  EXPECT_EQ(round_ticks(0, 490, 6).size(), 6u);
}

TEST(plot, draws_curves_where_they_belong) {
  inspect::Chart chart;
  chart.series.push_back({"", {0, 10}, {0, 10}, {1, 0, 0}, inspect::Stroke::full});
  const inspect::Image image = inspect::draw_charts({chart}, {.width = 400, .height = 300, .columns = 1});
  const auto red = [&](int x, int y) { return image.pixel(x, y)[0] > 200 && image.pixel(x, y)[1] < 100; };
  int rows = 0, last = 0;
  for (int y = 299; y >= 0; --y) {
    for (int x = 0; x < 400; ++x) {
      if (!red(x, y)) continue;
      EXPECT_GE(x, last - 4) << "the line goes up to the right";
      last = x;
      ++rows;
      break;
    }
  }
  EXPECT_GT(rows, 180);
}

}  // namespace
