// Forces on the bodies of a linkage against the torque at its driver, by the work of small motions.
#include "results.h"
#include "toile/mechanism/torque.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace toile::mechanism {
namespace {

using Eigen::Vector3d;
using test::checked;

Linkage four_bar() {
  Linkage l;
  l.bodies = {"crank", "coupler", "rocker"};
  l.driver = "crank";
  l.pivots = {{{"ground", "crank"}, {0.1, 0.2}}, {{"crank", "coupler"}, {0, 0.7}}, {{"coupler", "rocker"}, {0.5, 0.9}}, {{"rocker", "ground"}, {0.6, 0}}};
  return l;
}

/// Where a point of the drawn position (x, y, z) is.
Vector3d placed(const Pose& pose, const Vector3d& p) {
  const RigidPose r = in_space(pose);
  return Eigen::Quaterniond(r.rotation[0], r.rotation[1], r.rotation[2], r.rotation[3]) * p + Vector3d(r.shift[0], r.shift[1], r.shift[2]);
}

TEST(Torque, IsTheWorkOfASmallTurn) {
  const Linkage l = four_bar();
  const std::array<Vector3d, 3> points{Vector3d(0.3, 0.5, 0.1), Vector3d(-0.2, 0.8, 0.4), Vector3d(0, 0.3, 0.5)}, forces{Vector3d(1, -2, 3), Vector3d(0.5, 4, -1), Vector3d(2, 1, 1)};
  const double d = 1e-5;
  for (const double q : {0.0, 0.3, -0.5}) {
    const std::vector<Configuration> c = checked(follow(l, {q, q - d, q + d}));
    std::vector<Wrench> wrenches;
    double work = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      const RigidPose pose = in_space(c[0].poses[b]);
      wrenches.push_back({forces[b], (placed(c[0].poses[b], points[b]) - Vector3d(pose.shift[0], pose.shift[1], pose.shift[2])).cross(forces[b])});
      work += forces[b].dot(placed(c[2].poses[b], points[b]) - placed(c[1].poses[b], points[b])) / (2 * d);
    }
    EXPECT_NEAR(driver_torque(c[0], wrenches), work, 1e-8) << q;
  }
}

TEST(Torque, ReadsTheRecordOfASimulation) {
  const Linkage l = four_bar();
  const std::string head = "time_s,crank.at_x_m,crank.force_x_N,crank.force_y_N,crank.force_z_N,crank.torque_x_Nm,crank.torque_y_Nm,crank.torque_z_Nm\n";
  const WrenchRecord record = checked(read_wrenches(head + "0.1,9,1,2,3,4,5,6\n0.2,9,1,2,3,4,5,7\n", "r.csv", l));
  ASSERT_EQ(record.times, (std::vector<double>{0.1, 0.2}));
  EXPECT_EQ(record.rows[1][0].torque, Vector3d(4, 5, 7));
  EXPECT_EQ(record.rows[0][1].force.norm(), 0);
  EXPECT_EQ(test::codes(read_wrenches("time_s,a\n0,1\n", "r.csv", l)), "bad_record");
  EXPECT_EQ(test::codes(read_wrenches(head, "r.csv", l)), "bad_record");
  EXPECT_EQ(test::codes(read_wrenches(head + "0.1,9,1,2\n0.2,9,1,2,3,4,5,x\n", "r.csv", l)), "bad_record bad_record");
}

}  // namespace
}  // namespace toile::mechanism
