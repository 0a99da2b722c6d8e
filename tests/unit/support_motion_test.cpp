#include "toile/dynamics/support_motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace toile::dynamics {
namespace {

using Eigen::Vector3d;

constexpr const char* header = "time,body,x,y,z,qw,qx,qy,qz\n";

std::string row(double time, const std::string& body, const BodyPose& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return fmt::format("{},{},{},{},{},{},{},{},{}\n", time, body, pose.shift.x(), pose.shift.y(), pose.shift.z(), q.w(), q.x(), q.y(), q.z());
}

/// Turned by an angle about an axis through a centre, slid along it.
BodyPose screwed(double angle, const Vector3d& axis, const Vector3d& centre, double slide) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, axis.normalized()));
  return {turn, centre - turn * centre + slide * axis.normalized()};
}

TEST(SupportMotion, BetweenRowsABodyScrewsEvenly) {
  const Vector3d axis(1, 2, -1), centre(0.3, -0.1, 0.7), p(0.5, 0.2, 0.1);
  std::string csv = std::string("# a comment\n") + header;
  for (const double t : {0.0, 0.25, 1.0}) csv += row(t, "arm", screwed(2 * t, axis, centre, 0.1 * t)) + row(t, "still", {});
  auto motion = table_motion(csv, "table.csv", 0);
  ASSERT_TRUE(motion) << to_string(motion.issues().front());
  EXPECT_EQ((*motion)->bodies(), (std::vector<std::string>{"arm", "still"}));
  ASSERT_TRUE((*motion)->start(1));
  for (const double t : {0.0, 0.1, 0.25, 0.6, 1.0}) {
    const auto state = (*motion)->advance(0, t);
    ASSERT_TRUE(state);
    const BodyPose exact = screwed(2 * t, axis, centre, 0.1 * t);
    EXPECT_LT((state->poses[0](p) - exact(p)).norm(), 1e-14) << t;
    EXPECT_LT((state->poses[1](p) - p).norm(), 1e-15);
    // The twist is the derivative.
    const double d = 1e-6;
    const Vector3d rate = (screwed(2 * (t + d), axis, centre, 0.1 * (t + d))(p) - screwed(2 * (t - d), axis, centre, 0.1 * (t - d))(p)) / (2 * d);
    const BodyTwist& twist = state->twists[0];
    EXPECT_LT((twist.linear + twist.angular.cross(exact(p) - state->poses[0].shift) - rate).norm(), 1e-8) << t;
    EXPECT_EQ(state->twists[1].linear.norm() + state->twists[1].angular.norm(), 0);
  }
}

TEST(SupportMotion, OppositeQuaternionsAreTheSameTurn) {
  BodyPose end = screwed(0.4, {0, 0, 1}, {0.1, 0, 0}, 0);
  const std::string first = row(0, "b", {}) + row(1, "b", end);
  end.rotation.coeffs() = -end.rotation.coeffs();
  const std::string second = row(0, "b", {}) + row(1, "b", end);
  auto a = table_motion(header + first, "", 0), b = table_motion(header + second, "", 0);
  ASSERT_TRUE(a && b);
  const Vector3d p(1, 1, 0);
  EXPECT_LT(((*a)->advance(0, 0.3)->poses[0](p) - (*b)->advance(0, 0.3)->poses[0](p)).norm(), 1e-15);
}

TEST(SupportMotion, ATableThatIsNoneSaysWhereAndWhy) {
  const auto codes = [](const std::string& csv) {
    const auto motion = table_motion(csv, "t.csv", 0);
    EXPECT_FALSE(motion);
    return motion ? Issues{} : motion.issues();
  };
  EXPECT_EQ(codes("time,x\n0,1\n")[0].place.line, 1);
  EXPECT_NE(codes(std::string(header) + "0,a,0,0,0,1,0,0.01,0\n")[0].what.find("length"), std::string::npos);
  EXPECT_EQ(codes(std::string(header) + "0,a,0,0,0,1,0,0,0\n0,a,0,0,0,1,0,0,0\n")[0].place.line, 3);
  EXPECT_EQ(codes(std::string(header) + "0,a,0,zero,0,1,0,0,0\n0,a,0,0\n").size(), 2u);
  EXPECT_EQ(codes(header)[0].code, "bad_table");
  EXPECT_EQ(codes("")[0].code, "bad_table");
  const auto motion = table_motion(std::string(header) + "0,a,0,0,0,1,0,0,0\n1,a,0,0,0,1,0,0,0\n", "t.csv", 0.25);
  ASSERT_TRUE(motion);
  EXPECT_TRUE((*motion)->start(0.75));
  ASSERT_FALSE((*motion)->start(0.76));
  EXPECT_EQ((*motion)->start(0.76).issues()[0].code, "motion_ends");
}

TEST(SupportMotion, ShapesAreStraightInBetween) {
  Points3 a = Points3::Zero(2, 3), b = Points3::Ones(2, 3);
  auto motion = shape_motion({0, 0.5, 1}, {a, b, a});
  ASSERT_TRUE(motion);
  ASSERT_TRUE((*motion)->start(1));
  EXPECT_NEAR((*motion)->advance(0, 0.125)->shape(1, 2), 0.25, 1e-15);
  EXPECT_EQ((*motion)->advance(0.25, 0.25)->shape(1, 2), 1);
  EXPECT_NEAR((*motion)->advance(0.5, 0.4)->shape(1, 2), 0.2, 1e-15);
  EXPECT_FALSE((*motion)->start(1.5));
  EXPECT_FALSE(shape_motion({0, 1}, {a}));
  EXPECT_FALSE(shape_motion({0, 0}, {a, b}));
  EXPECT_FALSE(shape_motion({0, 1}, {a, Points3::Zero(3, 3)}));
}

}  // namespace
}  // namespace toile::dynamics
