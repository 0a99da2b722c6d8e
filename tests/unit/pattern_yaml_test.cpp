#include "toile/io/pattern_yaml.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "patterns.h"

using namespace toile;
using namespace toile::pattern;
using test::half_front;
using test::sleeve;
using test::with;

TEST(PatternYaml, reads_what_is_written) {
  const auto pattern = io::parse_pattern(half_front, "test.yaml");
  ASSERT_TRUE(pattern) << to_string(pattern.issues().front());
  EXPECT_EQ(pattern->name, "sample");
  EXPECT_EQ(pattern->units, LengthUnit::mm);
  EXPECT_FALSE(pattern->y_down);
  ASSERT_EQ(pattern->pieces.size(), 1u);
  const Piece& front = pattern->pieces[0];
  EXPECT_EQ(front.material, "jersey");
  EXPECT_EQ(front.fold, "centre");
  EXPECT_FALSE(front.grain);
  ASSERT_EQ(front.outline.size(), 5u);
  EXPECT_EQ(front.outline[1].segments,
            (std::vector<Segment>{cubic_segment({100, 0}, {110, 50}, {80, 100}, {90, 150})}));
  EXPECT_EQ(front.outline[3].segments[0].kind, Segment::Kind::arc);
  EXPECT_EQ(front.lines[0].kind, LineKind::placement);
  EXPECT_EQ(front.notches[0].distance, 60.0);
  EXPECT_EQ(front.marks[0].kind, MarkKind::button);
}

TEST(PatternYaml, writing_and_reading_is_the_identity) {
  for (const char* text : {half_front, sleeve}) {
    const auto pattern = io::parse_pattern(text, "test.yaml");
    ASSERT_TRUE(pattern);
    const std::string written = io::format_pattern(*pattern);
    const auto again = io::parse_pattern(written, "written.yaml");
    ASSERT_TRUE(again) << to_string(again.issues().front()) << written;
    EXPECT_EQ(*again, *pattern);
    EXPECT_EQ(io::format_pattern(*again), written);
  }
}

TEST(PatternYaml, lengths_may_carry_a_unit) {
  const auto pattern = io::parse_pattern(with(sleeve, "distance: -1", "distance: -10 mm"), "test.yaml");
  ASSERT_TRUE(pattern) << to_string(pattern.issues().front());
  EXPECT_NEAR(*pattern->pieces[0].notches[1].distance, -1, 1e-15);
}

TEST(PatternYaml, arcs_by_radius_turn_as_seen_on_the_drawing) {
  // Up the page with a turn to the left: the arc bulges to the right.
  const auto arc = [](const char* axis, const char* top, const char* text) {
    const std::string yaml = fmt::format(
        "units: m\ny: {}\npieces:\n  p:\n    grain: [a, b]\n    points: {{a: [0, 0], b: [0, {}]}}\n    outline:\n      "
        "- {{name: e, path: [a, {{arc: {{{}}}}}, b]}}\n      - {{name: f, path: [b, [-3, 0], a]}}\n",
        axis, top, text);
    const auto pattern = io::parse_pattern(yaml, "test.yaml");
    EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
    return pattern->pieces[0].outline[0].segments[0];
  };
  EXPECT_NEAR(arc("up", "2", "radius: 1, turn: left").bulge, 1, 1e-7);
  EXPECT_NEAR(arc("down", "-2", "radius: 1, turn: left").bulge, -1, 1e-7);
  EXPECT_NEAR(position(arc("down", "-2", "radius: 1, turn: left"), 0.5).x(), 1, 1e-7);
  const double sqrt2 = std::numbers::sqrt2;
  EXPECT_NEAR(arc("up", "2", "radius: 1.4142135623730951, turn: left").bulge, std::tan(std::numbers::pi / 8), 1e-12);
  const Segment large = arc("up", "2", "radius: 1.4142135623730951, turn: left, large: true");
  EXPECT_NEAR(large.bulge, 1 / std::tan(std::numbers::pi / 8), 1e-12);
  EXPECT_NEAR(Curve({large}).length(), 1.5 * std::numbers::pi * sqrt2, 1e-12);
}

struct BadText {
  const char* name;
  const char* part;
  const char* by;
  const char* code;
  int line;
  int column;  ///< 0: any
};
void PrintTo(const BadText& row, std::ostream* out) {
  *out << row.name;
}
class PatternYamlMustFail : public testing::TestWithParam<BadText> {};

TEST_P(PatternYamlMustFail, says_where) {
  const BadText& row = GetParam();
  const std::string yaml = with(half_front, row.part, row.by);
  ASSERT_FALSE(yaml.empty());
  const auto file = io::parse_pattern_file(yaml, "test.yaml");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.issues().size(), 1u) << to_string(file.issues().back());
  const Issue& issue = file.issues().front();
  EXPECT_EQ(issue.code, row.code) << to_string(issue);
  EXPECT_EQ(issue.place.line, row.line) << to_string(issue);
  if (row.column > 0) {
    EXPECT_EQ(issue.place.column, row.column) << to_string(issue);
  }
  EXPECT_FALSE(issue.remedy.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Rows, PatternYamlMustFail,
    testing::Values(
        BadText{"unknown_key", "material: jersey", "matreial: jersey", "unknown_key", 6, 5},
        BadText{"unknown_root_key", "name: sample", "nam: sample", "unknown_key", 1, 1},
        BadText{"missing_units", "units: mm\n", "", "missing_key", 1, 0},
        BadText{"bad_units", "units: mm", "units: ell", "bad_choice", 2, 8},
        BadText{"bad_axis", "y: up", "y: sideways", "bad_choice", 3, 4},
        BadText{"doubled_key", "cut: 1", "cut: 1\n    cut: 2", "duplicate_key", 8, 5},
        BadText{"doubled_point", "a: [0, 0]", "a: [0, 0]\n      a: [1, 1]", "duplicate_key", 12, 7},
        BadText{"point_of_three", "a: [0, 0]", "a: [0, 0, 0]", "wrong_type", 11, 10},
        BadText{"point_of_text", "b: [100, 0]", "b: [100, wide]", "bad_number", 12, 16},
        BadText{"unknown_point", "path: [a, b]", "path: [a, bb]", "unknown_point", 18, 31},
        BadText{"nan", "b: [100, 0]", "b: [100, nan]", "bad_number", 12, 0},
        BadText{"path_of_one", "path: [a, b]", "path: [a]", "wrong_type", 18, 0},
        BadText{"curve_first", "path: [a, b]", "path: [{curve: [[1, 1]]}, a, b]", "bad_path", 18, 0},
        BadText{"curve_last", "path: [a, b]", "path: [a, b, {curve: [[1, 1]]}]", "bad_path", 18, 0},
        BadText{"curve_twice", "path: [a, b]", "path: [a, {curve: [[1, 1]]}, {curve: [[1, 1]]}, b]", "bad_path", 18, 0},
        BadText{"edge_between_coordinates", "path: [a, b]", "path: [[0, 0], b]", "wrong_type", 18, 0},
        BadText{"curve_of_three", "[[110, 50], [80, 100]]", "[[110, 50], [80, 100], [1, 1]]", "wrong_type", 19, 0},
        BadText{"bend", "{curve: [[110", "{bend: [[110", "unknown_key", 19, 0},
        BadText{"flat_arc", "{through: [15, 185]}", "{through: [20, 190]}", "bad_arc", 21, 0},
        BadText{"small_radius", "{through: [15, 185]}", "{radius: 5, turn: left}", "bad_arc", 21, 0},
        BadText{"arc_twice", "{through: [15, 185]}", "{through: [15, 185], bulge: 0.2}", "bad_arc", 21, 0},
        BadText{"arc_without_turn", "{through: [15, 185]}", "{radius: 50}", "bad_arc", 21, 0},
        BadText{"bad_kind", "kind: placement", "kind: placment", "bad_choice", 24, 0},
        BadText{"bad_length", "distance: 60", "distance: 60 kg", "wrong_dimension", 26, 0},
        BadText{"cut_half", "cut: 1", "cut: 1.5", "wrong_type", 7, 0},
        BadText{"cut_none", "cut: 1", "cut: 0", "wrong_type", 7, 0},
        BadText{"identical", "cut: 1", "cut: 1\n    identical: maybe", "wrong_type", 8, 0},
        BadText{"grain", "grain: fold", "grain: up", "wrong_type", 9, 0},
        BadText{"grain_without_fold", "fold: centre\n", "\n", "missing_key", 9, 0},
        BadText{"not_yaml", "path: [a, b]}", "path: [a, b}", "bad_yaml", 18, 0}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(PatternYaml, all_issues_of_a_file_at_once) {
  std::string yaml = with(half_front, "material: jersey", "matreial: jersey");
  yaml = with(yaml, "b: [100, 0]", "b: [100, wide]");
  const auto file = io::parse_pattern_file(yaml, "test.yaml");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.issues().size(), 2u);  // edges that use the unreadable point are not told again
  EXPECT_NE(to_string(file.issues()[0]).find("did you mean 'material'"), std::string::npos);
}

TEST(PatternYaml, other_things_than_a_pattern) {
  for (const char* text : {"", "[]", "42", "units: mm\n---\nunits: mm\n", "pieces: 3\nunits: mm\ny: up\n", "{",
                           "units: mm\ny: up\npieces: {p: }\n", "units: mm\ny: up\npieces: {[1]: 2}\n"}) {
    const auto file = io::parse_pattern_file(text, "test.yaml");
    ASSERT_FALSE(file) << text;
    EXPECT_EQ(file.issues().front().place.file, "test.yaml");
  }
}

TEST(PatternYaml, texts_survive) {
  auto pattern = io::parse_pattern(half_front, "test.yaml");
  ASSERT_TRUE(pattern);
  for (const char* text : {"yes", "a: b", "tab\tnew\nline", "quote \" and \\", "# no comment", " led by a space",
                           "ends in a space ", "tr\xc3\xa4gt", "1e3", "x\x01y"}) {
    pattern->origin = text;
    const auto again = io::parse_pattern(io::format_pattern(*pattern), "written.yaml");
    ASSERT_TRUE(again) << text;
    EXPECT_EQ(again->origin, text);
  }
}
