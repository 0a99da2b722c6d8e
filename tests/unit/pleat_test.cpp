#include "toile/pattern/pleat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "patterns.h"
#include "toile/io/pattern_yaml.h"

using namespace toile;
using pattern::PleatDirection;
using pattern::Point2;

namespace {

/// A skirt panel: a hollow waist, flared sides, a round hem; a fish-eye dart and a pocket mark away from the middle.
const char* const skirt = R"(units: mm
y: up
pieces:
  skirt:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [-250, 0], b: [250, 0], c: [200, 600], d: [-200, 600], low: [-170, 450], high: [-170, 520], mid: [0, 590]}
    outline:
      - {name: hem, path: [a, {arc: {through: [0, -20]}}, b]}
      - {name: side, path: [b, c]}
      - {name: waist, path: [c, {curve: [[100, 585], [-80, 570]]}, d]}
      - {name: side_2, path: [d, a]}
    holes:
      dart:
        - {name: leg_1, path: [low, {curve: [[-175, 490]]}, high]}
        - {name: leg_2, path: [high, {curve: [[-165, 490]]}, low]}
    lines:
      pocket: {kind: placement, path: [[-190, 300], [-150, 300]]}
    notches:
      hem_notch: {edge: hem, distance: 450}
      centre: {edge: waist, fraction: 0.5}
    marks:
      button: {kind: button, at: [170, 560]}
)";

const char* const strip = R"(units: mm
y: up
pieces:
  strip:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [800, 0], c: [800, 300], d: [0, 300]}
    outline:
      - {name: hem, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
)";

pattern::Pattern parsed(const std::string& text) {
  auto result = io::parse_pattern(text, "p.yaml");
  EXPECT_TRUE(result) << (result ? "" : to_string(result.issues().front()));
  return result ? *result : pattern::Pattern{};
}

pattern::PleatSpec spec(const std::string& piece, const std::string& edge, PleatDirection direction, double at, double width, double depth, int count, bool spread) {
  pattern::PleatSpec s;
  s.name = "p";
  s.piece = piece;
  s.edge = edge;
  s.direction = direction;
  s.at = at;
  s.width = width;
  s.depth = depth;
  s.count = count;
  s.spread = spread;
  return s;
}

struct Cut {
  pattern::Pleated pleated;
  std::vector<pattern::CutPanel> panels;
};

Cut cut(const pattern::Pattern& p, const std::vector<pattern::PleatSpec>& specs) {
  auto pleated = pattern::add_pleats(p, specs);
  EXPECT_TRUE(pleated) << (pleated ? "" : to_string(pleated.issues().front()));
  if (!pleated) return {};
  auto panels = pattern::cut_panels(pleated->pattern);
  EXPECT_TRUE(panels) << (panels ? "" : to_string(panels.issues().front()));
  return {*pleated, panels ? *panels : std::vector<pattern::CutPanel>{}};
}

std::string first_code(const pattern::Pattern& p, const std::vector<pattern::PleatSpec>& specs) {
  const auto result = pattern::add_pleats(p, specs);
  return result ? "none" : result.issues().front().code;
}

double line_at(const pattern::CutPanel& panel, const std::string& name) {
  for (const auto& line : panel.lines) {
    if (line.name == name) return line.curve.from().x();
  }
  ADD_FAILURE() << "no line " << name;
  return 0;
}

/// The panel folded flat along its vertical fold lines; what is left of them all stays.
class Flat {
 public:
  explicit Flat(const pattern::CutPanel& panel) {
    for (const auto& line : panel.lines) {
      if (line.kind == pattern::LineKind::fold) folds_.push_back(line.curve.from().x());
    }
    std::sort(folds_.begin(), folds_.end());
  }
  Point2 operator()(const Point2& p) const {
    double x = 0, from = 0, way = 1;
    for (double fold : folds_) {
      if (fold >= p.x()) break;
      x += way * (fold - from);
      from = fold;
      way = -way;
    }
    return {x + way * (p.x() - from), p.y()};
  }

 private:
  std::vector<double> folds_;
};

/// Where the far right of the folded panel has come to, against where it was drawn.
double right_end(const pattern::CutPanel& panel) {
  double x = -1e9;
  for (const auto& edge : panel.outline) x = std::max(x, edge.curve.from().x());
  return x;
}

}  // namespace

TEST(pleat, knife_pleats_in_cloth_that_is_there) {
  // The top runs from right (u = 0.8) to left. Pleats to the left look in its direction.
  const auto left = cut(parsed(strip), {spec("strip", "top", PleatDirection::left, 0.10, 0.06, 0.04, 3, false)});
  ASSERT_EQ(left.pleated.parts.size(), 6u);
  for (int k = 0; k < 3; ++k) {
    const double first = 0.8 - 0.10 - k * (0.06 + 0.08);
    EXPECT_NEAR(line_at(left.panels[0], fmt::format("p_{}_outer", k + 1)), first, 1e-12);
    EXPECT_NEAR(line_at(left.panels[0], fmt::format("p_{}_inner", k + 1)), first - 0.04, 1e-12);
  }
  const auto right = cut(parsed(strip), {spec("strip", "top", PleatDirection::right, 0.10, 0.06, 0.04, 3, false)});
  for (int k = 0; k < 3; ++k) {
    const double first = 0.8 - 0.10 - k * (0.06 + 0.08);
    EXPECT_NEAR(line_at(right.panels[0], fmt::format("p_{}_inner", k + 1)), first - 0.04, 1e-12);
    EXPECT_NEAR(line_at(right.panels[0], fmt::format("p_{}_outer", k + 1)), first - 0.08, 1e-12);
  }
  // The visible fold is a ridge, the hidden one a valley; both go over the whole piece.
  for (const auto& part : left.pleated.parts) EXPECT_EQ(part.angle < 0, part.line.ends_with("outer"));
  for (const auto& line : left.panels[0].lines) EXPECT_NEAR(line.curve.length(), 0.3, 1e-12);
  EXPECT_NEAR(left.panels[0].area, 0.24, 1e-12);
}

TEST(pleat, box_and_inverted_pleats) {
  const auto box = cut(parsed(strip), {spec("strip", "top", PleatDirection::box, 0.10, 0.1, 0.04, 2, false)});
  // Along the edge: laid on, hidden fold, visible fold, front of the box, visible fold, hidden fold, laid on.
  for (int k = 0; k < 2; ++k) {
    const double first = 0.8 - 0.10 - k * (0.1 + 4 * 0.04);
    EXPECT_NEAR(line_at(box.panels[0], fmt::format("p_{}a_inner", k + 1)), first - 0.04, 1e-12);
    EXPECT_NEAR(line_at(box.panels[0], fmt::format("p_{}a_outer", k + 1)), first - 0.08, 1e-12);
    EXPECT_NEAR(line_at(box.panels[0], fmt::format("p_{}b_outer", k + 1)), first - 0.16, 1e-12);
    EXPECT_NEAR(line_at(box.panels[0], fmt::format("p_{}b_inner", k + 1)), first - 0.20, 1e-12);
  }
  const auto inverted = cut(parsed(strip), {spec("strip", "top", PleatDirection::inverted, 0.10, 0, 0.04, 1, false)});
  EXPECT_NEAR(line_at(inverted.panels[0], "p_1a_outer"), 0.7, 1e-12);
  EXPECT_NEAR(line_at(inverted.panels[0], "p_1a_inner"), 0.66, 1e-12);
  EXPECT_NEAR(line_at(inverted.panels[0], "p_1b_inner"), 0.58, 1e-12);
  EXPECT_NEAR(line_at(inverted.panels[0], "p_1b_outer"), 0.54, 1e-12);
  const Flat flat(inverted.panels[0]);
  EXPECT_NEAR(flat({0.7, 0}).x(), flat({0.54, 0}).x(), 1e-12) << "the two visible folds meet";
}

TEST(pleat, cloth_that_is_let_in) {
  const struct {
    PleatDirection direction;
    int folds_each;
  } rows[] = {{PleatDirection::left, 1}, {PleatDirection::right, 1}, {PleatDirection::box, 2}, {PleatDirection::inverted, 2}};
  for (const auto& row : rows) {
    const int count = 3;
    const double depth = 0.03;
    const auto result = cut(parsed(strip), {spec("strip", "top", row.direction, 0.2, 0.15, depth, count, true)});
    const double more = 2 * depth * count * row.folds_each;
    EXPECT_NEAR(pattern::find_edge(result.panels[0], "top")->curve.length(), 0.8 + more, 1e-12);
    EXPECT_NEAR(pattern::find_edge(result.panels[0], "hem")->curve.length(), 0.8 + more, 1e-12);
    EXPECT_NEAR(result.panels[0].area, (0.8 + more) * 0.3, 1e-12);
    const Flat flat(result.panels[0]);
    EXPECT_NEAR(flat({right_end(result.panels[0]), 0}).x() - flat(pattern::find_edge(result.panels[0], "left")->curve.from()).x(), 0.8, 1e-12) << "folded, it is as wide as it was drawn";
  }
}

TEST(pleat, folded_flat_the_piece_is_the_one_that_was_drawn) {
  // Hollow waist, slanted sides, round hem: every border point of the pleated piece comes to lie on the border as drawn.
  const auto drawn = cut(parsed(skirt), {}).panels[0];
  for (const auto direction : {PleatDirection::left, PleatDirection::right, PleatDirection::box, PleatDirection::inverted}) {
    const auto panel = cut(parsed(skirt), {spec("skirt", "waist", direction, 0.12, 0.09, 0.03, 2, true)}).panels[0];
    const Flat flat(panel);
    for (const auto& edge : panel.outline) {
      const auto& before = pattern::find_edge(drawn, edge.name)->curve;
      // The end of the waist stays, so its left part has moved; the folded panel is compared from there.
      const double shift = drawn.outline[1].curve.from().x() - flat(panel.outline[1].curve.from()).x();
      double farthest = 0;
      for (int k = 0; k <= 400; ++k) {
        const Point2 p = flat(edge.curve.point_at(edge.curve.length() * k / 400)) + Point2(shift, 0);
        farthest = std::max(farthest, before.nearest(p).distance);
      }
      EXPECT_LT(farthest, 1e-9) << edge.name;
    }
    // What is inside went with it.
    const double shift = drawn.outline[1].curve.from().x() - flat(panel.outline[1].curve.from()).x();
    for (const auto& mark : panel.marks) EXPECT_LT((flat(mark.at) + Point2(shift, 0) - drawn.marks[0].at).norm(), 1e-9);
    EXPECT_LT((flat(panel.holes[0].edges[0].curve.point_at(0.03)) + Point2(shift, 0) - drawn.holes[0].edges[0].curve.point_at(0.03)).norm(), 1e-9);
    EXPECT_LT((flat(panel.lines[0].curve.from()) + Point2(shift, 0) - drawn.lines[0].curve.from()).norm(), 1e-9);
    for (std::size_t k = 0; k < panel.notches.size(); ++k) EXPECT_LT((flat(panel.notches[k].at) + Point2(shift, 0) - drawn.notches[k].at).norm(), 1e-6) << panel.notches[k].name;
    EXPECT_NEAR(panel.holes[0].edges[0].curve.length(), drawn.holes[0].edges[0].curve.length(), 1e-9);
  }
}

TEST(pleat, lines_end_on_the_border_or_where_pressing_ends) {
  auto s = spec("skirt", "waist", PleatDirection::right, 0.12, 0.09, 0.03, 2, true);
  s.pressed = 0.2;
  s.length = 0.1;
  const auto result = cut(parsed(skirt), {s});
  ASSERT_EQ(result.pleated.parts.size(), 6u);
  const auto& waist = pattern::find_edge(result.panels[0], "waist")->curve;
  for (const auto& line : result.panels[0].lines) {
    if (line.name == "pocket") continue;
    EXPECT_LT(waist.nearest(line.curve.from()).distance, 1e-9);
    EXPECT_NEAR(line.curve.length(), line.name.ends_with("meet") ? 0.1 : 0.2, 1e-9);
    EXPECT_EQ(line.kind, line.name.ends_with("meet") ? pattern::LineKind::stitch : pattern::LineKind::fold);
  }
  // Where the pleat is stitched down, both lines are on the same place of the folded cloth.
  const Flat flat(result.panels[0]);
  EXPECT_NEAR(flat({line_at(result.panels[0], "p_1_outer"), 0}).x(), flat({line_at(result.panels[0], "p_1_meet"), 0}).x(), 1e-9);
  // Points of the same names stand on the edge.
  for (const auto& point : result.panels[0].points) {
    if (point.name.starts_with("p_")) {
      EXPECT_EQ(point.edge, "waist");
    }
  }
}

TEST(pleat, both_folds_of_an_inverted_pleat_are_stitched_to_one_line) {
  auto s = spec("strip", "top", PleatDirection::inverted, 0.2, 0, 0.04, 1, true);
  s.length = 0.1;
  const auto panel = cut(parsed(strip), {s}).panels[0];
  EXPECT_EQ(panel.lines.size(), 5u);
  const Flat flat(panel);
  for (const char* fold : {"p_1a_outer", "p_1b_outer"}) EXPECT_NEAR(flat({line_at(panel, fold), 0}).x(), flat({line_at(panel, "p_1a_meet"), 0}).x(), 1e-12);
}

TEST(pleat, the_way_a_piece_is_drawn_does_not_matter) {
  // Clockwise, with y down and in centimetres.
  const std::string other = R"(units: cm
y: down
pieces:
  strip:
    cut: 1
    grain: [[0, 10], [0, 0]]
    points: {a: [0, 0], b: [80, 0], c: [80, -30], d: [0, -30]}
    outline:
      - {name: left, path: [a, d]}
      - {name: top, path: [d, c]}
      - {name: right, path: [c, b]}
      - {name: hem, path: [b, a]}
)";
  for (const auto direction : {PleatDirection::left, PleatDirection::box}) {
    for (const bool spread : {false, true}) {
      const auto s = spec("strip", "top", direction, 0.2, 0.15, 0.03, 2, spread);
      const auto a = cut(parsed(strip), {s}).panels[0], b = cut(parsed(other), {s}).panels[0];
      ASSERT_EQ(a.lines.size(), b.lines.size());
      for (std::size_t k = 0; k < a.lines.size(); ++k) {
        EXPECT_EQ(a.lines[k].name, b.lines[k].name);
        EXPECT_LT((a.lines[k].curve.from() - b.lines[k].curve.from()).norm(), 1e-9);
        EXPECT_LT((a.lines[k].curve.to() - b.lines[k].curve.to()).norm(), 1e-9);
      }
      EXPECT_NEAR(a.area, b.area, 1e-12);
    }
  }
}

TEST(pleat, mirrored_copies_and_pieces_on_the_fold) {
  const auto pair = cut(parsed(test::with(strip, "cut: 1", "cut: 2")), {spec("strip", "top", PleatDirection::left, 0.1, 0.06, 0.04, 2, true)});
  ASSERT_EQ(pair.panels.size(), 2u);
  for (std::size_t k = 0; k < pair.panels[0].lines.size(); ++k) EXPECT_NEAR(pair.panels[0].lines[k].curve.from().x(), -pair.panels[1].lines[k].curve.from().x(), 1e-12);

  const auto on_fold = cut(parsed(test::with(strip, "    cut: 1\n    grain", "    cut: 1\n    fold: left\n    grain")), {spec("strip", "top", PleatDirection::left, 0.1, 0.06, 0.04, 2, true)});
  ASSERT_EQ(on_fold.panels.size(), 1u);
  EXPECT_EQ(on_fold.panels[0].lines.size(), 8u);
  EXPECT_NEAR(pattern::find_edge(on_fold.panels[0], "top")->curve.length(), 0.96, 1e-12);
  EXPECT_NEAR(pattern::find_edge(on_fold.panels[0], "top_m")->curve.length(), 0.96, 1e-12);
}

TEST(pleat, square_to_the_edge) {
  auto s = spec("skirt", "waist", PleatDirection::left, 0.12, 0.09, 0.03, 2, false);
  s.along = pattern::PleatLine::square;
  s.pressed = 0.1;
  const auto result = cut(parsed(skirt), {s});
  const auto& waist = pattern::find_edge(result.panels[0], "waist")->curve;
  for (const auto& line : result.panels[0].lines) {
    if (!line.name.ends_with("outer")) continue;
    const auto at = waist.nearest(line.curve.from());
    EXPECT_NEAR(waist.tangent_at(at.s).dot((line.curve.to() - line.curve.from()).normalized()), 0, 1e-9);
  }
  s.pressed.reset();
  // On a hollow waist lines square to it spread apart; on a round one they would meet.
  EXPECT_EQ(first_code(parsed(skirt), {s}), "none");
}

TEST(pleat, two_rows_on_one_piece) {
  auto first = spec("strip", "top", PleatDirection::left, 0.1, 0.06, 0.02, 2, true), second = spec("strip", "top", PleatDirection::right, 0.5, 0.06, 0.02, 2, true);
  second.name = "q";
  const auto result = cut(parsed(strip), {first, second});
  EXPECT_NEAR(pattern::find_edge(result.panels[0], "hem")->curve.length(), 0.8 + 4 * 0.04, 1e-12);
  EXPECT_EQ(result.pleated.parts.back().spec, 1u);
}

TEST(pleat, what_cannot_be_laid) {
  const auto p = parsed(strip), s = parsed(skirt);
  const auto knife = [&](const char* piece, const char* edge, double at, int count, bool spread = true) { return spec(piece, edge, PleatDirection::left, at, 0.1, 0.05, count, spread); };
  EXPECT_EQ(first_code(p, {knife("strap", "top", 0.1, 1)}), "unknown_piece");
  EXPECT_EQ(first_code(p, {knife("strip", "tip", 0.1, 1)}), "unknown_edge");
  EXPECT_EQ(first_code(p, {knife("strip", "top", 0.04, 1)}), "pleat_off_edge");
  EXPECT_EQ(first_code(p, {knife("strip", "top", 0.1, 9)}), "pleat_off_edge");
  EXPECT_EQ(first_code(p, {knife("strip", "top", 0.1, 5, false)}), "pleat_off_edge");
  EXPECT_EQ(first_code(p, {knife("strip", "left", 0.1, 1)}), "pleat_off_edge") << "this edge runs along the grain";
  EXPECT_EQ(first_code(p, {spec("strip", "top", PleatDirection::box, 0.1, 0.09, 0.05, 2, false)}), "narrow_pleats");
  EXPECT_EQ(first_code(p, {knife("strip", "top", 0.1, 1), knife("strip", "top", 0.3, 1)}), "duplicate_name");
  auto from = knife("strip", "top", 0.1, 1);
  from.from = "a";
  EXPECT_EQ(first_code(p, {from}), "point_off_edge");
  from.from = "x";
  EXPECT_EQ(first_code(p, {from}), "unknown_point");
  from.from = "c";
  EXPECT_EQ(first_code(p, {from}), "none");
  // The dart and the pocket line are 30 mm and more from the panel's left end.
  EXPECT_EQ(first_code(s, {knife("skirt", "waist", 0.372, 1)}), "pleat_across");
  EXPECT_EQ(first_code(s, {spec("skirt", "hem", PleatDirection::right, 0.442, 0, 0.05, 1, true)}), "pleat_off_edge") << "the waist ends beside it";
  const auto on_fold = parsed(test::with(strip, "    cut: 1\n    grain", "    cut: 1\n    fold: hem\n    grain"));
  EXPECT_EQ(first_code(on_fold, {knife("strip", "top", 0.1, 1)}), "pleat_on_fold");
  EXPECT_EQ(first_code(on_fold, {knife("strip", "hem", 0.1, 1)}), "pleat_on_fold");
  const auto round = parsed(test::with(skirt, "{curve: [[100, 585], [-80, 570]]}", "{curve: [[100, 800], [-100, 800]]}"));
  auto fan = spec("skirt", "waist", PleatDirection::left, 0.15, 0.1, 0.01, 2, false);
  fan.along = pattern::PleatLine::square;
  EXPECT_EQ(first_code(round, {fan}), "pleats_cross");
  fan.pressed = 0.1;
  EXPECT_EQ(first_code(round, {fan}), "none");
}
