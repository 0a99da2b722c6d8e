#include "toile/pattern/curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace toile;
using namespace toile::pattern;

namespace {

/// Length by very many chords with Richardson's extrapolation: independent of the quadrature under test.
double brute_length(const Segment& segment) {
  const auto chords = [&](int n) {
    double sum = 0;
    for (int i = 0; i < n; ++i)
      sum += (position(segment, (i + 1.0) / n) - position(segment, static_cast<double>(i) / n)).norm();
    return sum;
  };
  const double coarse = chords(20000), fine = chords(40000);
  return fine + (fine - coarse) / 3;
}

const Segment s_shape = cubic_segment({0, 0}, {0.3, 0.4}, {-0.1, 0.2}, {0.25, 0.6});
const Segment armhole = cubic_segment({231.3377e-3, 234.0373e-3}, {210.7e-3, 213.3997e-3}, {175.8204e-3, 152.6085e-3},
                                      {215e-3, 50.5421e-3});

}  // namespace

TEST(Curve, lengths_of_known_shapes) {
  EXPECT_DOUBLE_EQ(Curve({line_segment({1, 1}, {4, 5})}).length(), 5);
  EXPECT_NEAR(Curve({arc_segment({1, 0}, {-1, 0}, 1)}).length(), std::numbers::pi, 1e-15);
  const double three_quarters = std::tan(1.5 * std::numbers::pi / 4);
  EXPECT_NEAR(Curve({arc_segment({1, 0}, {0, -1}, three_quarters)}).length(), 1.5 * std::numbers::pi, 1e-14);
  // y = x^2 from 0 to 1.
  const double parabola = std::sqrt(5.0) / 2 + std::asinh(2.0) / 4;
  EXPECT_NEAR(Curve({quadratic_segment({0, 0}, {0.5, 0}, {1, 1})}).length(), parabola, 1e-14);
  // The semicubical parabola (t^2, t^3): its speed vanishes at the start.
  const double cuspidal = (std::pow(13.0, 1.5) - 8) / 27;
  EXPECT_NEAR(Curve({cubic_segment({0, 0}, {0, 0}, {1.0 / 3, 0}, {1, 1})}).length(), cuspidal, 1e-13);
}

TEST(Curve, length_agrees_with_brute_force) {
  for (const Segment& segment : {s_shape, armhole, cubic_segment({0, 0}, {1, 1}, {0, 1}, {1, 0}),
                                 quadratic_segment({0, 0}, {1, 0.02}, {0.1, 0.3})}) {
    EXPECT_NEAR(Curve({segment}).length(), brute_length(segment), 1e-10);
  }
}

TEST(Curve, a_cusp_inside_has_its_length) {
  // Control points chosen so that the derivative vanishes at t = 1/2.
  const Segment cusp = cubic_segment({0, 0}, {1, 1}, {0, 1}, {1, 0});
  EXPECT_NEAR(derivative(cusp, 0.5).norm(), 0, 1e-15);
  const Curve curve({cusp});
  EXPECT_NEAR(curve.length(), brute_length(cusp), 1e-9);
  EXPECT_NEAR((curve.point_at(curve.length() / 2) - position(cusp, 0.5)).norm(), 0, 1e-9);
}

TEST(Curve, point_at_arc_length_agrees_with_brute_force) {
  const Curve curve({s_shape, cubic_segment({0.25, 0.6}, {0.4, 0.8}, {0.5, 0.2}, {0.7, 0.1}),
                     arc_segment({0.7, 0.1}, {0.9, 0.1}, -0.4)});
  // Walk along by small chords and compare now and then.
  double walked = 0;
  for (std::size_t i = 0; i < curve.segments().size(); ++i) {
    const int n = 200000;
    for (int k = 0; k < n; ++k) {
      const Point2 a = position(curve.segments()[i], static_cast<double>(k) / n),
                   b = position(curve.segments()[i], (k + 1.0) / n);
      walked += (b - a).norm();
      if (k % 20011 == 0) {
        EXPECT_NEAR((curve.point_at(walked) - b).norm(), 0, 1e-9);
        EXPECT_GT(curve.tangent_at(walked).dot((b - a).normalized()), 1 - 1e-9);
      }
    }
  }
  EXPECT_NEAR(walked, curve.length(), 1e-9);
}

TEST(Curve, ends_are_exact_and_s_is_clamped) {
  const Curve curve({armhole});
  EXPECT_EQ(curve.point_at(0), armhole.from);
  EXPECT_EQ(curve.point_at(curve.length()), armhole.to);
  EXPECT_EQ(curve.point_at(-1), armhole.from);
  EXPECT_EQ(curve.point_at(9), armhole.to);
}

TEST(Curve, tangent_where_a_control_point_lies_on_the_end) {
  const Curve curve({cubic_segment({0, 0}, {0, 0}, {1, 0}, {1, 1}), cubic_segment({1, 1}, {2, 2}, {3, 2}, {3, 2})});
  EXPECT_NEAR((curve.tangent_at(0) - Point2(1, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((curve.tangent_at(curve.length()) - Point2(1, 0)).norm(), 0, 1e-12);
  // All control points on the ends: a straight line, run through unevenly.
  const Curve line({cubic_segment({0, 0}, {0, 0}, {1, 1}, {1, 1})});
  EXPECT_NEAR(line.length(), std::sqrt(2.0), 1e-14);
  EXPECT_NEAR((line.tangent_at(0) - Point2(1, 1).normalized()).norm(), 0, 1e-12);
}

TEST(Curve, curvature_of_an_arc) {
  const Curve curve({arc_segment({2, 0}, {-2, 0}, 1)});
  EXPECT_NEAR(curve.curvature_at(1), 0.5, 1e-12);
  EXPECT_NEAR(curve.reversed().curvature_at(1), -0.5, 1e-12);
}

TEST(Curve, split_keeps_shape_and_length) {
  for (const Segment& segment : {s_shape, armhole, quadratic_segment({0, 0}, {1, 0.02}, {0.1, 0.3}),
                                 arc_segment({1, 0}, {-1, 0.2}, -0.7), line_segment({0, 0}, {1, 2})}) {
    const Curve curve({segment});
    for (const double share : {0.001, 0.3, 0.5, 0.999}) {
      const double s = share * curve.length();
      const auto [a, b] = curve.split(s);
      EXPECT_EQ(a.to(), b.from());
      EXPECT_NEAR(a.length(), s, 1e-12);
      EXPECT_NEAR(a.length() + b.length(), curve.length(), 1e-12);
      for (const double t : {0.1, 0.5, 0.9}) {
        EXPECT_NEAR((a.point_at(t * a.length()) - curve.point_at(t * s)).norm(), 0, 1e-11);
        EXPECT_NEAR((b.point_at(t * b.length()) - curve.point_at(s + t * b.length())).norm(), 0, 1e-11);
      }
      EXPECT_NEAR(a.sector_area() + b.sector_area(), curve.sector_area(), 1e-13);
    }
  }
}

TEST(Curve, split_at_a_joint_leaves_no_sliver) {
  const Curve curve({line_segment({0, 0}, {0.1, 0}), line_segment({0.1, 0}, {0.3, 0.1})});
  const auto [a, b] = curve.split(0.1);
  EXPECT_EQ(a.segments().size(), 1u);
  EXPECT_EQ(b.segments().size(), 1u);
}

TEST(Curve, area_agrees_with_a_fine_polygon) {
  for (const Segment& segment : {s_shape, armhole, quadratic_segment({0.3, 0}, {1, 0.02}, {0.1, 0.3}),
                                 arc_segment({1, 0.1}, {-1, 0.2}, -1.7), arc_segment({1, 0.1}, {-1, 0.2}, 1e-4)}) {
    double area = 0;
    const int n = 200000;
    for (int i = 0; i < n; ++i) {
      const Point2 a = position(segment, static_cast<double>(i) / n), b = position(segment, (i + 1.0) / n);
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    EXPECT_NEAR(sector_area(segment), area, 1e-9);
  }
}

TEST(Curve, area_of_a_circle_of_two_arcs) {
  EXPECT_NEAR(sector_area(arc_segment({1, 0}, {-1, 0}, 1)) + sector_area(arc_segment({-1, 0}, {1, 0}, 1)),
              std::numbers::pi, 1e-14);
}

TEST(Curve, nearest_agrees_with_brute_force) {
  const Curve curve({s_shape, arc_segment({0.25, 0.6}, {0.9, 0.1}, -0.8)});
  for (int i = 0; i < 200; ++i) {
    const Point2 p(std::sin(i * 1.7) * 0.8, std::cos(i * 0.9) * 0.8);
    double best = 1e9;
    for (const Segment& segment : curve.segments()) {
      for (int k = 0; k <= 20000; ++k) best = std::min(best, (position(segment, k / 20000.0) - p).norm());
    }
    const Curve::Nearest nearest = curve.nearest(p);
    EXPECT_LE(nearest.distance, best + 1e-12);
    EXPECT_GE(nearest.distance, best - 1e-7);
    EXPECT_NEAR((curve.point_at(nearest.s) - nearest.point).norm(), 0, 1e-10);
  }
}

TEST(Curve, nearest_to_a_point_on_it_is_the_point) {
  const Curve curve({armhole});
  for (const double share : {0.0, 0.2, 0.77, 1.0}) {
    const Curve::Nearest nearest = curve.nearest(curve.point_at(share * curve.length()));
    EXPECT_LT(nearest.distance, 1e-12);
    EXPECT_NEAR(nearest.s, share * curve.length(), 1e-10);
  }
}

TEST(Curve, samples_stay_within_tolerance) {
  const Curve curve({s_shape, armhole});
  for (const double tolerance : {1e-3, 1e-5}) {
    const std::vector<double> s = curve.sample(tolerance);
    EXPECT_EQ(s.front(), 0);
    EXPECT_EQ(s.back(), curve.length());
    for (std::size_t i = 0; i + 1 < s.size(); ++i) {
      ASSERT_LT(s[i], s[i + 1]);
      const Point2 a = curve.point_at(s[i]), chord = curve.point_at(s[i + 1]) - a;
      if (s[i + 1] == curve.segment_starts()[1] || s[i] == curve.segment_starts()[1]) continue;
      for (int k = 1; k < 20; ++k) {
        const Point2 r = curve.point_at(s[i] + k / 20.0 * (s[i + 1] - s[i])) - a;
        EXPECT_LE(std::abs(chord.x() * r.y() - chord.y() * r.x()) / chord.norm(), 1.2 * tolerance);
      }
    }
  }
}

TEST(Curve, arc_through_three_points) {
  const auto arc = arc_through({1, 0}, {0, 1}, {-1, 0});
  ASSERT_TRUE(arc);
  EXPECT_NEAR(arc->bulge, 1, 1e-15);
  const auto small = arc_through({0, 0}, {1, -0.1}, {2, 0});
  ASSERT_TRUE(small);
  EXPECT_GT(small->bulge, 0);
  EXPECT_NEAR(Curve({*small}).nearest({1, -0.1}).distance, 0, 1e-12);
  const auto large = arc_through({0, 0}, {1, 5}, {2, 0});
  ASSERT_TRUE(large);
  EXPECT_LT(large->bulge, -1);
  EXPECT_NEAR(Curve({*large}).nearest({1, 5}).distance, 0, 1e-12);
  const auto flat = arc_through({0, 0}, {1, 0}, {2, 0});
  ASSERT_FALSE(flat);
  EXPECT_EQ(flat.issues().front().code, "bad_arc");
}

TEST(Curve, bounds_hold_the_segment) {
  for (const Segment& segment :
       {s_shape, armhole, arc_segment({1, 0.1}, {-1, 0.2}, -1.7), arc_segment({1, 0.1}, {-1, 0.2}, 0.4)}) {
    const auto [low, high] = bounds(segment);
    Point2 seen_low = segment.from, seen_high = segment.from;
    for (int i = 0; i <= 1000; ++i) {
      seen_low = seen_low.cwiseMin(position(segment, i / 1000.0));
      seen_high = seen_high.cwiseMax(position(segment, i / 1000.0));
    }
    EXPECT_TRUE(((low - seen_low).array() <= 1e-12).all() && ((high - seen_high).array() >= -1e-12).all());
    if (segment.kind == Segment::Kind::arc) {
      EXPECT_NEAR((low - seen_low).norm() + (high - seen_high).norm(), 0, 1e-4);
    }
  }
}

TEST(Curve, mapping_a_reflection_turns_arcs) {
  Similarity mirror;
  mirror.linear << -1, 0, 0, 1;
  const Curve curve({arc_segment({1, 0}, {0, 1}, 0.3), s_shape});
  const Curve image = curve.mapped(mirror);
  EXPECT_NEAR(image.length(), curve.length(), 1e-13);
  EXPECT_NEAR(image.sector_area(), -curve.sector_area(), 1e-15);
  for (const double s : {0.2, 0.9, 1.4}) EXPECT_NEAR((image.point_at(s) - mirror(curve.point_at(s))).norm(), 0, 1e-12);
}
