#include "toile/pattern/pattern.h"

#include <gtest/gtest.h>

#include <numbers>

#include <cmath>
#include <set>

#include "patterns.h"
#include "toile/io/pattern_yaml.h"

using namespace toile;
using namespace toile::pattern;
using test::half_front;
using test::sleeve;
using test::with;

namespace {

Pattern parse(const std::string& yaml) {
  const auto file = io::parse_pattern_file(yaml, "test.yaml");
  if (!file) throw std::runtime_error(to_string(file.issues().front()));
  return file->pattern;
}

std::vector<CutPanel> cut(const std::string& yaml) {
  auto panels = cut_panels(parse(yaml));
  if (!panels) throw std::runtime_error(to_string(panels.issues().front()));
  return std::move(*panels);
}

std::vector<std::string> edge_names(const CutPanel& panel) {
  std::vector<std::string> names;
  for (const PanelEdge& edge : panel.outline) names.push_back(edge.name);
  return names;
}

void expect_closed_and_counter_clockwise(const CutPanel& panel) {
  double area = 0;
  for (std::size_t i = 0; i < panel.outline.size(); ++i) {
    const PanelEdge &edge = panel.outline[i], &next = panel.outline[(i + 1) % panel.outline.size()];
    EXPECT_EQ(edge.curve.to(), next.curve.from()) << panel.name << "." << edge.name;
    EXPECT_EQ(edge.to, next.from) << panel.name << "." << edge.name;
    area += edge.curve.sector_area();
  }
  EXPECT_GT(area, 0);
  for (const PanelHole& hole : panel.holes) {
    double hole_area = 0;
    for (std::size_t i = 0; i < hole.edges.size(); ++i) {
      EXPECT_EQ(hole.edges[i].curve.to(), hole.edges[(i + 1) % hole.edges.size()].curve.from());
      hole_area += hole.edges[i].curve.sector_area();
    }
    EXPECT_LT(hole_area, 0);
    area += hole_area;
  }
  EXPECT_NEAR(panel.area, area, 1e-15);
}

const PanelPoint& point(const CutPanel& panel, const std::string& name) {
  for (const PanelPoint& p : panel.points) {
    if (p.name == name) return p;
  }
  throw std::runtime_error("no point " + name);
}

}  // namespace

TEST(CutPanels, a_piece_on_the_fold_is_unfolded) {
  const auto panels = cut(half_front);
  ASSERT_EQ(panels.size(), 1u);
  const CutPanel& front = panels[0];
  expect_closed_and_counter_clockwise(front);
  EXPECT_EQ(front.name, "front");
  EXPECT_EQ(front.material, "jersey");
  EXPECT_EQ(edge_names(front),
            (std::vector<std::string>{"hem", "side", "shoulder", "neck", "neck_m", "shoulder_m", "side_m", "hem_m"}));
  // Points on the fold stay single; the others have a twin.
  EXPECT_EQ(find_edge(front, "hem")->from, "a");
  EXPECT_EQ(find_edge(front, "hem_m")->to, "a");
  EXPECT_EQ(find_edge(front, "hem_m")->from, "b_m");
  EXPECT_EQ(point(front, "b_m").at, Point2(-0.1, 0));
  for (const PanelPoint& p : front.points) EXPECT_NE(p.name, "a_m");
  EXPECT_EQ(point(front, "pocket").where, PanelPoint::Where::inside);
  EXPECT_EQ(point(front, "c").where, PanelPoint::Where::border);
  EXPECT_EQ(point(front, "c").edge, "shoulder");
  ASSERT_TRUE(front.fold);
  EXPECT_EQ(front.fold->first.x(), 0);
  EXPECT_EQ(front.fold->second.x(), 0);
  // The button on the fold is one, the drill point has a twin.
  EXPECT_EQ(front.marks.size(), 3u);
  EXPECT_EQ(front.lines.size(), 2u);
}

TEST(CutPanels, unfolding_is_exactly_symmetric) {
  const CutPanel front = cut(half_front)[0];
  double half = 0;
  for (const char* name : {"hem", "side", "shoulder", "neck"}) {
    const Curve a = find_edge(front, name)->curve, b = find_edge(front, std::string(name) + "_m")->curve;
    EXPECT_DOUBLE_EQ(a.length(), b.length());
    for (const double share : {0.0, 0.13, 0.5, 1.0}) {
      const Point2 p = a.point_at(share * a.length()), q = b.point_at((1 - share) * b.length());
      EXPECT_NEAR(p.x(), -q.x(), 1e-14);
      EXPECT_NEAR(p.y(), q.y(), 1e-14);
    }
    half += a.sector_area();
  }
  half += sector_area(line_segment({0, 0.18}, {0, 0}));
  EXPECT_NEAR(front.area, 2 * half, 1e-16);
  ASSERT_EQ(front.notches.size(), 2u);
  EXPECT_EQ(front.notches[1].name, "waist_m");
  EXPECT_EQ(front.notches[1].edge, "side_m");
  EXPECT_NEAR(front.notches[0].s, 0.06, 1e-15);
  EXPECT_NEAR((front.notches[0].at - Point2(-front.notches[1].at.x(), front.notches[1].at.y())).norm(), 0, 1e-12);
}

TEST(CutPanels, allowances_follow_the_edges_and_their_area_counts_corners_once) {
  const auto box = [](const std::string& hem, const std::string& more) {
    return cut("units: mm\ny: up\npieces:\n  box:\n    cut: 2\n    grain: [[0, 0], [0, 1]]\n    allowance: 10\n    points: {a: [0, 0], b: [100, 0], c: [100, 50], d: [0, 50]}\n"
               "    outline:\n      - {name: hem, path: [a, b]" + hem + "}\n      - {name: right, path: [b, c]}\n      - {name: top, path: [c, d]}\n      - {name: left, path: [d, a]}\n" + more);
  };
  // Mitred corners: the cut piece is a larger rectangle.
  for (const CutPanel& panel : box("", "")) {
    EXPECT_NEAR(panel.allowance_area, 120e-3 * 70e-3 - 5000e-6, 1e-15);
    EXPECT_DOUBLE_EQ(find_edge(panel, "top")->allowance, 0.01);
  }
  for (const CutPanel& panel : box(", allowance: 4 cm", "")) {
    EXPECT_NEAR(panel.allowance_area, 120e-3 * 100e-3 - 5000e-6, 1e-15);
    EXPECT_DOUBLE_EQ(find_edge(panel, "hem")->allowance, 0.04);
  }
  // A hole has none unless its edges say so; there the corners overlap.
  const std::string hole = "    holes:\n      window:\n        - {name: rim, path: [p, q, r, s, p]%}\n";
  const auto with_hole = [&](const std::string& own) {
    std::string text = hole;
    text.replace(text.find('%'), 1, own);
    auto panels = cut("units: mm\ny: up\npieces:\n  box:\n    cut: 1\n    grain: [[0, 0], [0, 1]]\n    points: {a: [0, 0], b: [100, 0], c: [100, 50], d: [0, 50], p: [10, 5], q: [50, 5], r: [50, 45], s: [10, 45]}\n"
                      "    outline:\n      - {name: rest, path: [a, b, c, d, a], allowance: 0}\n" + text);
    return panels[0].allowance_area;
  };
  EXPECT_EQ(with_hole(""), 0);
  EXPECT_NEAR(with_hole(", allowance: 5"), (40 * 40 - 30 * 30) * 1e-6, 1e-15);
  // A disc of radius 100 with 10 all round.
  const CutPanel disc = cut("units: mm\ny: up\npieces:\n  disc:\n    cut: 1\n    grain: [[0, 0], [0, 1]]\n    allowance: 10\n    points: {a: [-100, 0], b: [100, 0]}\n"
                            "    outline:\n      - {name: low, path: [a, {arc: {through: [0, -100]}}, b]}\n      - {name: high, path: [b, {arc: {through: [0, 100]}}, a]}\n")[0];
  EXPECT_NEAR(disc.allowance_area, std::numbers::pi * (0.11 * 0.11 - 0.01), 1e-6);
}

TEST(CutPanels, two_copies_are_a_mirrored_pair) {
  const auto panels = cut(sleeve);
  ASSERT_EQ(panels.size(), 2u);
  const CutPanel &plain = panels[0], &other = panels[1];
  EXPECT_EQ(plain.name, "sleeve");
  EXPECT_EQ(other.name, "sleeve_m");
  EXPECT_FALSE(plain.mirrored);
  EXPECT_TRUE(other.mirrored);
  for (const CutPanel& panel : panels) expect_closed_and_counter_clockwise(panel);
  // Drawn with y down: the cap is at the top, v up; x stays u.
  EXPECT_EQ(point(plain, "front").at, Point2(0.12, -0.01));
  EXPECT_EQ(point(other, "front").at, Point2(-0.12, -0.01));
  EXPECT_DOUBLE_EQ(plain.area, other.area);
  ASSERT_EQ(plain.outline.size(), other.outline.size());
  for (const PanelEdge& edge : plain.outline) {
    const PanelEdge* twin = find_edge(other, edge.name);
    ASSERT_TRUE(twin);
    EXPECT_EQ(edge.from, twin->to);
    EXPECT_EQ(edge.to, twin->from);
    EXPECT_DOUBLE_EQ(edge.curve.length(), twin->curve.length());
  }
  ASSERT_EQ(plain.notches.size(), other.notches.size());
  for (std::size_t i = 0; i < plain.notches.size(); ++i) {
    EXPECT_EQ(plain.notches[i].name, other.notches[i].name);
    EXPECT_NEAR(plain.notches[i].at.x(), -other.notches[i].at.x(), 1e-12);
    EXPECT_NEAR(plain.notches[i].at.y(), other.notches[i].at.y(), 1e-12);
  }
  // The outline was drawn clockwise on the page: its edges run the other way, the notch is still a quarter from `back`.
  EXPECT_EQ(find_edge(plain, "cap")->from, "front");
  EXPECT_NEAR(plain.notches[0].s, 0.75 * find_edge(plain, "cap")->curve.length(), 1e-12);
}

TEST(CutPanels, names_of_copies) {
  Piece piece;
  piece.name = "p";
  EXPECT_EQ(panel_name(piece, 0), "p");
  EXPECT_EQ(panel_name(piece, 1), "p_m");
  EXPECT_EQ(panel_name(piece, 2), "p_2");
  EXPECT_EQ(panel_name(piece, 3), "p_2_m");
  piece.identical = true;
  EXPECT_EQ(panel_name(piece, 1), "p_2");
}

TEST(CutPanels, the_grain_turns_the_panel_upright) {
  const std::string turned = with(sleeve, "grain: [[0, 10], [0, 0]]", "grain: [[0, 0], [3, 4]]");
  const CutPanel plain = cut(sleeve)[0], panel = cut(turned)[0];
  EXPECT_NEAR(plain.area, panel.area, 1e-16);
  EXPECT_NEAR(plain.perimeter, panel.perimeter, 1e-14);
  // (3, 4) cm with y down becomes (0, 5) cm.
  const Point2 a = point(panel, "low").at, b = point(panel, "high").at;
  EXPECT_NEAR(a.norm(), 0.25, 1e-15);
  EXPECT_NEAR((b - a).norm(), 0.1, 1e-15);
  EXPECT_NEAR(a.y(), 0.25 * 0.8, 1e-15);
  EXPECT_NEAR(a.x(), 0.25 * 0.6, 1e-15);
}

TEST(CutPanels, units_agree) {
  const std::string inches = with(half_front, "units: mm", "units: inch");
  EXPECT_NEAR(cut(inches)[0].area, cut(half_front)[0].area * 25.4 * 25.4, 1e-12);
}

struct MustFail {
  const char* name;
  const char* base;
  const char* part;
  const char* by;
  const char* code;
  const char* item;
};
void PrintTo(const MustFail& row, std::ostream* out) {
  *out << row.name;
}

class PatternMustFail : public testing::TestWithParam<MustFail> {};

TEST_P(PatternMustFail, says_what_and_where) {
  const MustFail& row = GetParam();
  const std::string yaml = with(row.base, row.part, row.by);
  ASSERT_FALSE(yaml.empty());
  const auto file = io::parse_pattern_file(yaml, "test.yaml");
  ASSERT_TRUE(file) << to_string(file.issues().front());
  const Issues issues = io::check(*file);
  ASSERT_FALSE(issues.empty());
  bool found = false;
  for (const Issue& issue : issues) {
    EXPECT_GT(issue.place.line, 0) << to_string(issue);
    EXPECT_EQ(issue.place.file, "test.yaml");
    EXPECT_FALSE(issue.remedy.empty());
    found = found || (issue.code == row.code && issue.place.item == row.item);
  }
  EXPECT_TRUE(found) << to_string(issues.front());
  EXPECT_FALSE(cut_panels(file->pattern));
}

INSTANTIATE_TEST_SUITE_P(
    Rows, PatternMustFail,
    testing::Values(
        MustFail{"open", half_front, "- {name: shoulder, path: [c, d]}\n", "- {name: shoulder, path: [c, pocket]}\n",
                 "open_outline", "front.shoulder"},
        MustFail{"missing_edge", half_front, "      - {name: shoulder, path: [c, d]}\n", "", "open_outline",
                 "front.side"},
        MustFail{"crossing", half_front, "c: [90, 150]", "c: [-30, 150]", "self_crossing", "front.centre"},
        MustFail{"crossing_curve", half_front, "[[110, 50], [80, 100]]", "[[-900, 50], [80, 100]]", "self_crossing",
                 "front.centre"},
        MustFail{"curve_crosses_itself", half_front, "[[110, 50], [80, 100]]", "[[250, 225], [250, -75]]",
                 "self_crossing", "front.side"},
        MustFail{"turns_back", half_front, "path: [a, b]", "path: [a, [150, 0], b]", "self_crossing", "front.hem"},
        MustFail{"touches", half_front, "path: [a, b]", "path: [a, [30, 0], d, [60, 0], b]", "self_crossing",
                 "front.hem"},
        MustFail{"zero_segment", half_front, "path: [a, b]", "path: [a, a, b]", "zero_length_edge", "front.hem"},
        MustFail{"notch_distance", half_front, "distance: 60", "distance: 600", "notch_off_border", "front.waist"},
        MustFail{"notch_point", half_front, "distance: 60", "point: pocket", "notch_off_border", "front.waist"},
        MustFail{"notch_fraction", half_front, "distance: 60", "fraction: 1.2", "notch_off_border", "front.waist"},
        MustFail{"notch_edge", half_front, "{edge: side, distance: 60}", "{edge: syde, distance: 60}", "unknown_edge",
                 "front.waist"},
        MustFail{"notch_unknown_point", half_front, "distance: 60", "point: nowhere", "unknown_point", "front.waist"},
        MustFail{"notch_twice", half_front, "distance: 60", "distance: 60, fraction: 0.5", "bad_notch", "front.waist"},
        MustFail{"notch_unplaced", half_front, ", distance: 60", "", "bad_notch", "front.waist"},
        MustFail{"fold_curved", half_front, "path: [e, a]", "path: [e, {curve: [[5, 100]]}, a]", "fold_not_straight",
                 "front.centre"},
        MustFail{"fold_unknown", half_front, "fold: centre", "fold: center", "unknown_edge", "front.fold"},
        MustFail{"across_fold", half_front, "d: [40, 200]", "d: [-40, 200]", "piece_across_fold", "front.centre"},
        MustFail{"edge_twice", half_front, "{name: shoulder,", "{name: side,", "duplicate_name", "front.side"},
        MustFail{"line_like_edge", half_front, "chest: {", "side: {", "duplicate_name", "front.side"},
        MustFail{"suffix_taken", half_front, "{name: shoulder,", "{name: side_m,", "duplicate_name", "front.side_m"},
        MustFail{"bad_edge_name", half_front, "{name: shoulder,", "{name: a.b,", "bad_name", "front.a.b"},
        MustFail{"line_outside", half_front, "[[0, 120], [80, 120]]", "[[0, 120], [180, 120]]", "line_outside",
                 "front.chest"},
        MustFail{"line_zero", half_front, "[[0, 120], [80, 120]]", "[[0, 120], [0, 120]]", "zero_length_line",
                 "front.chest"},
        MustFail{"mark_outside", half_front, "at: [50, 100]", "at: [150, 100]", "mark_outside", "front.drill"},
        MustFail{"allowance", half_front, "path: [a, b]", "path: [a, b], allowance: -3", "bad_allowance", "front.hem"},
        MustFail{"no_area", half_front, "e: [0, 180]", "e: [0, 0]", "zero_length_edge", "front.centre"},
        MustFail{"no_grain", sleeve, "    grain: [[0, 10], [0, 0]]\n", "", "grain_missing", "sleeve"},
        MustFail{"zero_grain", sleeve, "[[0, 10], [0, 0]]", "[[0, 10], [0, 10]]", "grain_zero", "sleeve.grain"},
        MustFail{"hole_outside", sleeve, "low: [0, 25]", "low: [0, 35]", "hole_outside", "sleeve.dart"},
        MustFail{"hole_crosses", sleeve, "[[-2, 20]]", "[[2, 20]]", "self_crossing", "sleeve.dart_left"},
        MustFail{"hole_open", sleeve, "high, {curve: [[2, 20]]}, low", "high, {curve: [[2, 20]]}, wrist_back",
                 "open_outline", "sleeve.dart_right"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(PatternCheck, reports_everything_at_once) {
  std::string yaml = with(half_front, "distance: 60", "distance: 600");
  yaml = with(yaml, "at: [50, 100]", "at: [150, 100]");
  yaml = with(yaml, "{name: shoulder,", "{name: shoulder.left,");
  EXPECT_EQ(check(parse(yaml)).size(), 3u);
}

TEST(PatternCheck, one_fault_of_an_outline_does_not_hide_the_others) {
  // Open by 5 mm, crossed by its own side, with an edge of no length, and everything on it misplaced.
  std::string yaml = with(half_front, "- {name: hem, path: [a, b]}\n", "- {name: hem, path: [a, b]}\n      - {name: none, path: [b, b]}\n");
  yaml = with(yaml, "e: [0, 180]", "e: [0, 180]\n      f: [5, 180]");
  yaml = with(yaml, "{name: centre, path: [e, a]}", "{name: centre, path: [f, a]}");
  yaml = with(yaml, "fold: centre\n    grain: fold", "grain: [a, e]");
  yaml = with(yaml, "[[110, 50], [80, 100]]", "[[-900, 50], [80, 100]]");
  yaml = with(yaml, "kind: placement, path: [[0, 120], [80, 120]]", "kind: dart, path: [[10, 100], [300, 120], [10, 140]]");
  yaml = with(yaml, "distance: 60", "distance: 6000");
  yaml = with(yaml, "at: [50, 100]", "at: [150, 100]");
  std::set<std::string> found;
  for (const Issue& issue : check(parse(yaml))) found.insert(issue.code + " " + issue.place.item);
  for (const char* expected :
       {"zero_length_edge front.none", "open_outline front.neck", "self_crossing front.centre", "dart_outside front.chest",
        "notch_off_border front.waist", "mark_outside front.drill"}) {
    EXPECT_TRUE(found.count(expected)) << expected;
  }
  // A mark within the gap may be on the cloth once it is closed: no word about it.
  EXPECT_FALSE(found.count("mark_outside front.button"));
}

TEST(PatternCheck, a_figure_of_eight_is_called_a_crossing) {
  const std::string yaml =
      "units: mm\ny: up\npieces:\n  eight:\n    grain: [a, b]\n    points: {a: [0, 0], b: [10, 0], c: [0, 8], d: [10, 8]}\n    "
      "outline: [{name: p, path: [a, b]}, {name: q, path: [b, c]}, {name: r, path: [c, d]}, {name: s, path: [d, a]}]\n";
  const Issues issues = check(parse(yaml));
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].code, "self_crossing");
  EXPECT_NE(issues[0].what.find("(5, 4)"), std::string::npos) << issues[0].what;
}

TEST(PatternAdvice, tells_what_is_probably_not_meant) {
  EXPECT_TRUE(advice(parse(half_front)).empty());
  EXPECT_TRUE(advice(parse(sleeve)).empty());
  const auto codes = [](const std::string& yaml) {
    EXPECT_FALSE(yaml.empty());
    EXPECT_TRUE(check(parse(yaml)).empty());
    std::vector<std::string> result;
    for (const Issue& issue : advice(parse(yaml))) result.push_back(issue.code + " " + issue.place.item);
    return result;
  };
  using Codes = std::vector<std::string>;
  const auto dart = [](const std::string& tip) {
    const std::string yaml =
        with(half_front, "- {name: hem, path: [a, b]}",
             "- {name: hem, path: [a, p]}\n      - {name: leg_1, path: [p, t]}\n      - {name: leg_2, path: [t, q]}\n"
             "      - {name: hem_2, path: [q, b]}");
    return with(yaml, "pocket: [50, 100]", "p: [40, 0]\n      q: [60, 0]\n      t: " + tip);
  };
  EXPECT_EQ(codes(dart("[50, 60]")), Codes{});
  EXPECT_EQ(codes(dart("[55, 60]")), Codes{"dart_legs_differ front.leg_1"});
  EXPECT_EQ(codes(with(sleeve, "high, {curve: [[2, 20]]}, low", "high, {curve: [[8, 20]]}, low")),
            Codes{"dart_legs_differ sleeve.dart_left"});
  EXPECT_EQ(codes(with(half_front, "kind: placement, path: [[0, 120], [80, 120]]",
                       "kind: dart, path: [[20, 100], [25, 60], [30, 100], [25, 150], [20, 100]]")),
            Codes{});
  EXPECT_EQ(codes(with(half_front, "[[0, 120], [80, 120]]", "[[0, 120], [0, 150], [20, 150]]")),
            Codes{"line_along_edge front.chest"});
  EXPECT_EQ(codes(with(half_front, "[[0, 120], [80, 120]]", "[[0.5, 120], [80, 120]]")),
            Codes{"line_short_of_edge front.chest"});
  EXPECT_EQ(codes(with(with(half_front, "e: [0, 180]", "e: [0, 180]\n      f: [0, 179.5]"), "{name: centre, path: [e, a]}",
                       "{name: stub, path: [e, f]}\n      - {name: centre, path: [f, a]}")),
            Codes{"short_edge front.stub"});
  Pattern twice = parse(sleeve);
  twice.pieces.push_back(twice.pieces[0]);
  twice.pieces[1].name = "other";
  const Issues issues = advice(twice);
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].code, "same_piece");
  // What check() has something against is left alone.
  twice.pieces[1].grain.reset();
  EXPECT_TRUE(advice(twice).empty());
}

TEST(PatternCheck, panel_names_may_not_clash) {
  const std::string yaml =
      with(sleeve, "pieces:\n",
           "pieces:\n  sleeve_m:\n    grain: [a, c]\n    points: {a: [0, 0], b: [1, 0], c: [0, 1]}\n    outline: "
           "[{name: x, path: [a, b]}, {name: y1, path: [b, c]}, {name: z, path: [c, a]}]\n");
  const Issues issues = check(parse(yaml));
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].code, "duplicate_name");
}

TEST(PatternCheck, gaps_and_numbers_that_a_program_can_make) {
  Pattern pattern = parse(half_front);
  pattern.pieces[0].outline[1].segments[0].to.x() += 0.5;
  ASSERT_FALSE(check(pattern).empty());
  EXPECT_EQ(check(pattern)[0].code, "edge_off_point");
  pattern = parse(half_front);
  pattern.pieces[0].outline[1].segments[0].control_1.x() = std::nan("");
  EXPECT_EQ(check(pattern)[0].code, "broken_edge");
  pattern = parse(half_front);
  pattern.pieces[0].copies = 0;
  EXPECT_EQ(check(pattern)[0].code, "bad_copies");
  pattern.pieces.clear();
  EXPECT_EQ(check(pattern)[0].code, "no_pieces");
  pattern = parse(half_front);
  pattern.pieces[0].outline.clear();
  EXPECT_EQ(check(pattern)[0].code, "empty_outline");
}

TEST(SplitEdge, at_a_named_point_near_the_curve) {
  Pattern pattern = parse(sleeve);
  Piece piece = pattern.pieces[0];
  const Curve cap(piece.outline[0].segments);
  const Point2 top = cap.point_at(0.5 * cap.length());
  piece.points["tip"] = top + Point2(0, 0.005);  // 0.05 mm off
  const auto split = split_edge(piece, pattern.units, "cap", {.point = "tip"}, "cap_back", "cap_front");
  ASSERT_TRUE(split) << to_string(split.issues().front());
  EXPECT_EQ(split->outline[0].name, "cap_back");
  EXPECT_EQ(split->outline[1].name, "cap_front");
  EXPECT_EQ(split->outline[0].to, "tip");
  EXPECT_EQ(split->outline[1].from, "tip");
  EXPECT_EQ(split->points.at("tip"), split->outline[0].segments.back().to);
  EXPECT_NEAR(Curve(split->outline[0].segments).length() + Curve(split->outline[1].segments).length(), cap.length(),
              1e-10);
  // The notch at a quarter of the whole is at half of the first part.
  EXPECT_EQ(split->notches[0].edge, "cap_back");
  EXPECT_NEAR(*split->notches[0].distance, 0.25 * cap.length(), 1e-12);
  pattern.pieces[0] = *split;
  EXPECT_TRUE(check(pattern).empty());
}

TEST(SplitEdge, at_a_distance_and_on_a_hole) {
  const Pattern pattern = parse(sleeve);
  const auto split = split_edge(pattern.pieces[0], pattern.units, "dart_left", {.point = "middle", .distance = -4.0},
                                "low_part", "high_part");
  ASSERT_TRUE(split);
  EXPECT_EQ(split->holes[0].edges.size(), 3u);
  EXPECT_NEAR(Curve(split->holes[0].edges[1].segments).length(), 4, 1e-12);
  EXPECT_EQ(split->notches[1].edge, "high_part");
  EXPECT_NEAR(*split->notches[1].distance, 3, 1e-12);
}

TEST(SplitEdge, what_cannot_be_split) {
  const Pattern pattern = parse(half_front);
  const Piece& piece = pattern.pieces[0];
  const auto code = [&](const char* edge, const SplitAt& at, const char* first, const char* second) {
    const auto result = split_edge(piece, pattern.units, edge, at, first, second);
    return result ? std::string("split") : result.issues().front().code;
  };
  EXPECT_EQ(code("syde", {.point = "pocket"}, "p", "q"), "unknown_edge");
  EXPECT_EQ(code("side", {.point = "nowhere"}, "p", "q"), "unknown_point");
  EXPECT_EQ(code("side", {.point = "pocket"}, "p", "q"), "point_off_edge");
  EXPECT_EQ(code("side", {.point = "b"}, "p", "q"), "split_at_end");
  EXPECT_EQ(code("side", {.point = "z", .distance = 1e6}, "p", "q"), "split_at_end");
  EXPECT_EQ(code("side", {.point = "z", .distance = 10.0}, "p", "p"), "duplicate_name");
  EXPECT_EQ(code("side", {.point = "z", .distance = 10.0}, "hem", "q"), "duplicate_name");
  EXPECT_EQ(code("side", {.point = "pocket", .distance = 10.0}, "p", "q"), "duplicate_name");
  EXPECT_EQ(code("centre", {.point = "z", .distance = 10.0}, "p", "q"), "split_fold");
  EXPECT_EQ(code("side", {.point = "z", .distance = 10.0}, "side", "q"), "split");
}
