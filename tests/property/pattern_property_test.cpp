#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "toile/base/rng.h"
#include "toile/io/pattern_yaml.h"
#include "toile/pattern/pattern.h"

using namespace toile;
using namespace toile::pattern;

namespace {

constexpr int trials = 60;

Segment random_segment(Rng& rng, const Point2& a, const Point2& b) {
  // Bulges that stay small against the distance keep star-shaped outlines free of crossings.
  const Point2 d = b - a, n(-d.y(), d.x());
  const auto off = [&](double share) { return Point2(a + share * d + rng.uniform(-0.1, 0.1) * n); };
  switch (rng.below(4)) {
    case 0:
      return line_segment(a, b);
    case 1:
      return quadratic_segment(a, off(0.5), b);
    case 2:
      return cubic_segment(a, off(0.3), off(0.7), b);
    default:
      return arc_segment(a, b, rng.uniform(-0.15, 0.15));
  }
}

/// A piece round a star: right half on the fold, or the whole.
/// `mm`: how many units make a millimetre.
Piece random_piece(Rng& rng, const std::string& name, bool folded, double mm) {
  Piece piece;
  piece.name = name;
  if (rng.below(2) == 0) piece.material = "cloth \"" + std::to_string(rng.below(100)) + "\"";
  const int corners = 4 + static_cast<int>(rng.below(6));
  const Point2 centre(mm * rng.uniform(-300, 300), mm * rng.uniform(-300, 300));
  const double pi = std::numbers::pi;
  std::vector<std::string> names;
  for (int i = 0; i < corners; ++i) {
    const double angle = folded ? -pi / 2 + pi * i / (corners - 1) : 2 * pi * (i + rng.uniform(0, 0.4)) / corners;
    const double radius = mm * rng.uniform(150, 220);
    Point2 p = centre + radius * Point2(std::cos(angle), std::sin(angle));
    if (folded && (i == 0 || i == corners - 1)) p.x() = centre.x();
    names.push_back("p" + std::to_string(i));
    piece.points[names.back()] = p;
  }
  for (int i = 0; i < corners; ++i) {
    const std::string &from = names[static_cast<std::size_t>(i)],
                      &to = names[static_cast<std::size_t>((i + 1) % corners)];
    Edge edge{.name = "e" + std::to_string(i), .from = from, .to = to};
    const Point2 a = piece.points[from], b = piece.points[to];
    if (folded && i == corners - 1) {
      edge.segments = {line_segment(a, b)};
      piece.fold = edge.name;
    } else if (rng.below(3) == 0) {
      const Point2 middle = (a + b) / 2;
      edge.segments = {random_segment(rng, a, middle), random_segment(rng, middle, b)};
    } else {
      edge.segments = {random_segment(rng, a, b)};
    }
    if (rng.below(4) == 0) edge.allowance = mm * rng.uniform(0, 20);
    piece.outline.push_back(edge);
  }
  if (rng.below(2) == 0) {
    // Some outlines are drawn the other way round.
    std::reverse(piece.outline.begin(), piece.outline.end());
    for (Edge& edge : piece.outline) {
      std::swap(edge.from, edge.to);
      std::reverse(edge.segments.begin(), edge.segments.end());
      for (Segment& segment : edge.segments) segment = reversed(segment);
    }
  }
  if (!folded || rng.below(2) == 0)
    piece.grain = Grain{centre, centre + 50 * Point2(std::cos(rng.uniform(0, 6)), std::sin(rng.uniform(0, 6)))};
  if (!folded) {
    piece.copies = 1 + static_cast<int>(rng.below(4));
    piece.identical = piece.copies > 1 && rng.below(2) == 0;
  }
  const Point2 h = centre + Point2(folded ? 60 * mm : 0, 0);
  piece.points["low"] = h - mm * Point2(0, 30);
  piece.points["high"] = h + mm * Point2(0, 30);
  if (rng.below(2) == 0) {
    piece.holes.push_back(
        {"dart",
         {Edge{.name = "leg_a",
               .from = "low",
               .to = "high",
               .segments = {quadratic_segment(piece.points["low"], h + mm * Point2(10, 0), piece.points["high"])}},
          Edge{.name = "leg_b",
               .from = "high",
               .to = "low",
               .segments = {arc_segment(piece.points["high"], piece.points["low"], rng.uniform(0.1, 0.3))}}}});
    piece.notches.push_back({.name = "on_leg", .edge = "leg_a", .distance = mm * rng.uniform(-20, 20)});
  }
  piece.lines.push_back({"across",
                         LineKind::fold,
                         {line_segment(h + mm * Point2(20, 0), h + mm * Point2(20, 40)),
                          random_segment(rng, h + mm * Point2(20, 40), h + mm * Point2(30, 60))}});
  piece.notches.push_back({.name = "n1", .edge = "e0", .fraction = rng.uniform()});
  piece.notches.push_back({.name = "n2", .edge = "e1", .point = piece.outline.front().name == "e0" ? "p1" : "p2"});
  piece.marks.push_back({"m", static_cast<MarkKind>(rng.below(5)), h + mm * Point2(25, rng.uniform(-30, 30))});
  return piece;
}

Pattern random_pattern(std::uint64_t seed) {
  Rng rng(seed);
  Pattern pattern;
  pattern.name = "random";
  pattern.units = static_cast<LengthUnit>(rng.below(4));
  pattern.y_down = rng.below(2) == 0;
  const double mm = 1e-3 / in_metres(pattern.units);
  pattern.pieces.push_back(random_piece(rng, "a", false, mm));
  pattern.pieces.push_back(random_piece(rng, "b", true, mm));
  return pattern;
}

std::vector<CutPanel> cut(const Pattern& pattern) {
  auto panels = cut_panels(pattern);
  if (!panels) throw std::runtime_error(to_string(panels.issues().front()));
  return std::move(*panels);
}

Point2 flipped(const Point2& p) {
  return {-p.x(), p.y()};
}

/// The pattern seen in a mirror (x -> -x).
Pattern mirrored(Pattern pattern) {
  Similarity flip;
  flip.linear << -1, 0, 0, 1;
  const auto apply = [&](std::vector<Segment>& segments) {
    for (Segment& segment : segments) segment = flip(segment);
  };
  for (Piece& piece : pattern.pieces) {
    for (auto& [name, p] : piece.points) p = flip(p);
    for (Edge& edge : piece.outline) apply(edge.segments);
    for (Hole& hole : piece.holes) {
      for (Edge& edge : hole.edges) apply(edge.segments);
    }
    for (InternalLine& line : piece.lines) apply(line.segments);
    for (Mark& mark : piece.marks) mark.at = flip(mark.at);
    if (piece.grain) piece.grain = Grain{flip(piece.grain->from), flip(piece.grain->to)};
  }
  return pattern;
}

}  // namespace

TEST(PatternProperty, random_patterns_pass_the_checks) {
  for (int seed = 0; seed < trials; ++seed) {
    const Issues issues = check(random_pattern(seed));
    ASSERT_TRUE(issues.empty()) << seed << " " << to_string(issues.front());
  }
}

TEST(PatternProperty, write_and_read_is_the_identity) {
  for (int seed = 0; seed < trials; ++seed) {
    const Pattern pattern = random_pattern(seed);
    const std::string text = io::format_pattern(pattern);
    const auto again = io::parse_pattern(text, "random.yaml");
    ASSERT_TRUE(again) << seed << " " << to_string(again.issues().front());
    ASSERT_EQ(*again, pattern) << seed;
    ASSERT_EQ(io::format_pattern(*again), text);
  }
}

TEST(PatternProperty, panels_are_closed_and_counter_clockwise) {
  for (int seed = 0; seed < trials; ++seed) {
    for (const CutPanel& panel : cut(random_pattern(seed))) {
      double area = 0;
      for (std::size_t i = 0; i < panel.outline.size(); ++i) {
        const PanelEdge &edge = panel.outline[i], &next = panel.outline[(i + 1) % panel.outline.size()];
        ASSERT_EQ(edge.curve.to(), next.curve.from()) << seed;
        ASSERT_EQ(edge.to, next.from) << seed;
        area += edge.curve.sector_area();
      }
      for (const PanelHole& hole : panel.holes) {
        for (const PanelEdge& edge : hole.edges) area += edge.curve.sector_area();
      }
      ASSERT_GT(panel.area, 0);
      ASSERT_NEAR(panel.area, area, 1e-12 * area);
    }
  }
}

TEST(PatternProperty, a_mirrored_pattern_gives_mirrored_panels) {
  for (int seed = 0; seed < trials; ++seed) {
    const Pattern pattern = random_pattern(seed);
    const auto panels = cut(pattern), images = cut(mirrored(pattern));
    ASSERT_EQ(panels.size(), images.size());
    for (std::size_t i = 0; i < panels.size(); ++i) {
      const CutPanel &panel = panels[i], &image = images[i];
      ASSERT_EQ(panel.name, image.name);
      ASSERT_NEAR(panel.area, image.area, 1e-12 * panel.area);
      ASSERT_EQ(panel.outline.size(), image.outline.size());
      const auto same_edge = [&](const PanelEdge& edge) {
        const PanelEdge* twin = find_edge(image, edge.name);
        ASSERT_TRUE(twin) << edge.name;
        ASSERT_EQ(edge.from, twin->to);
        const double length = edge.curve.length();
        ASSERT_NEAR(length, twin->curve.length(), 1e-12 * length);
        for (const double share : {0.0, 0.21, 0.5, 0.83, 1.0}) {
          ASSERT_NEAR(
              (flipped(edge.curve.point_at(share * length)) - twin->curve.point_at((1 - share) * length)).norm(), 0,
              1e-10 * length);
        }
      };
      for (const PanelEdge& edge : panel.outline) same_edge(edge);
      for (const PanelHole& hole : panel.holes) {
        for (const PanelEdge& edge : hole.edges) same_edge(edge);
      }
      ASSERT_EQ(panel.notches.size(), image.notches.size());
      for (std::size_t k = 0; k < panel.notches.size(); ++k) {
        ASSERT_EQ(panel.notches[k].name, image.notches[k].name);
        ASSERT_NEAR((flipped(panel.notches[k].at) - image.notches[k].at).norm(), 0, 1e-9 * panel.perimeter);
      }
      ASSERT_EQ(panel.points.size(), image.points.size());
      for (std::size_t k = 0; k < panel.points.size(); ++k) {
        ASSERT_EQ(panel.points[k].where, image.points[k].where) << panel.points[k].name;
        ASSERT_NEAR((flipped(panel.points[k].at) - image.points[k].at).norm(), 0, 1e-12 * panel.perimeter);
      }
    }
  }
}

TEST(PatternProperty, mirrored_copies_are_mirror_images) {
  for (int seed = 0; seed < trials; ++seed) {
    const auto panels = cut(random_pattern(seed));
    const CutPanel& plain = panels.front();
    for (const CutPanel& panel : panels) {
      if (panel.piece != plain.piece) continue;
      ASSERT_NEAR(panel.area, plain.area, 1e-13 * plain.area);
      for (const PanelPoint& p : plain.points) {
        const auto twin = std::find_if(panel.points.begin(), panel.points.end(),
                                       [&](const PanelPoint& q) { return q.name == p.name; });
        ASSERT_NE(twin, panel.points.end());
        ASSERT_EQ(twin->at, panel.mirrored ? flipped(p.at) : p.at);
      }
    }
  }
}

TEST(PatternProperty, unfolding_doubles_the_half) {
  for (int seed = 0; seed < trials; ++seed) {
    Pattern pattern = random_pattern(seed);
    pattern.pieces.erase(pattern.pieces.begin());
    const CutPanel whole = cut(pattern)[0];
    Piece& piece = pattern.pieces[0];
    if (!piece.grain) piece.grain = Grain{{0, 0}, {0, 1}};
    piece.fold.reset();
    const CutPanel half = cut(pattern)[0];
    ASSERT_NEAR(whole.area, 2 * half.area, 1e-12 * whole.area);
    // Each point of the one half has its mirror image about the fold on the border of the other.
    const Point2 a = whole.fold->first, d = (whole.fold->second - a).normalized();
    for (const PanelEdge& edge : whole.outline) {
      const bool twin_half = edge.name.ends_with("_m");
      const PanelEdge* twin =
          find_edge(whole, twin_half ? edge.name.substr(0, edge.name.size() - 2) : edge.name + "_m");
      ASSERT_TRUE(twin);
      const Point2 p = edge.curve.point_at(0.3 * edge.curve.length()),
                   q = twin->curve.point_at(0.7 * twin->curve.length());
      const Point2 r = p - a;
      const Point2 image = a + 2 * r.dot(d) * d - r;
      ASSERT_NEAR((image - q).norm(), 0, 1e-10 * whole.perimeter);
    }
  }
}

TEST(PatternProperty, splitting_changes_no_area_and_no_length) {
  for (int seed = 0; seed < trials; ++seed) {
    Pattern pattern = random_pattern(seed);
    const CutPanel before = cut(pattern)[0];
    Rng rng(static_cast<std::uint64_t>(seed) + 1000);
    const double length = Curve(pattern.pieces[0].outline[2].segments).length();
    const std::string name = pattern.pieces[0].outline[2].name;
    const auto split =
        split_edge(pattern.pieces[0], pattern.units, name,
                   {.point = "new_point", .distance = rng.uniform(0.01, 0.99) * length}, "part_a", "part_b");
    ASSERT_TRUE(split) << to_string(split.issues().front());
    pattern.pieces[0] = *split;
    const CutPanel after = cut(pattern)[0];
    ASSERT_EQ(after.outline.size(), before.outline.size() + 1);
    ASSERT_NEAR(after.area, before.area, 1e-12 * before.area);
    ASSERT_NEAR(after.perimeter, before.perimeter, 1e-11 * before.perimeter);
    ASSERT_EQ(after.notches.size(), before.notches.size());
    for (std::size_t k = 0; k < after.notches.size(); ++k)
      ASSERT_NEAR((after.notches[k].at - before.notches[k].at).norm(), 0, 1e-9 * before.perimeter);
  }
}
