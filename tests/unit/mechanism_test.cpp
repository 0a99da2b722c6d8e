#include "results.h"
#include "toile/io/file.h"
#include "toile/io/record_yaml.h"
#include "toile/mechanism/inertia.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

using namespace toile;
using namespace toile::mechanism;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::checked;
using test::codes;

namespace {

/// Crank, coupler, rocker: pivots at (0,0), (0, a), (p, c), (d, 0).
Linkage four_bar(double crank, Vector2d joint, double ground) {
  Linkage l;
  l.bodies = {"crank", "coupler", "rocker"};
  l.driver = "crank";
  l.pivots = {{{"ground", "crank"}, {0, 0}}, {{"crank", "coupler"}, {0, crank}}, {{"coupler", "rocker"}, {joint.x(), joint.y()}}, {{"rocker", "ground"}, {ground, 0}}};
  return l;
}

std::vector<double> range(double from, double to, int count) {
  std::vector<double> angles;
  for (int i = 0; i <= count; ++i) angles.push_back(from + (to - from) * i / count);
  return angles;
}

}  // namespace

TEST(linkage, a_parallelogram_carries_its_coupler_without_turning_it) {
  const Linkage l = four_bar(0.5, {0.3, 0.5}, 0.3);
  for (const Configuration& c : checked(follow(l, range(0, -1.2, 24)))) {
    EXPECT_NEAR(c.poses[1].angle, 0, 1e-11);
    EXPECT_NEAR(c.poses[2].angle, c.driver, 1e-11);
    EXPECT_NEAR(c.poses[1].shift.x(), -0.5 * std::sin(c.driver), 1e-12);
    EXPECT_NEAR(c.poses[1].shift.y(), 0.5 * std::cos(c.driver) - 0.5, 1e-12);
    EXPECT_LT(c.closure, 1e-12);
    EXPECT_NEAR(c.rates[2].angle, 1, 1e-9);
  }
}

TEST(linkage, a_four_bar_agrees_with_freudensteins_equation) {
  const double a = 0.2, d = 0.5;
  const Vector2d joint(0.45, 0.4);
  const Linkage l = four_bar(a, joint, d);
  const double b = (joint - Vector2d(0, a)).norm(), r = (joint - Vector2d(d, 0)).norm();
  const double rocker0 = std::atan2(joint.y(), joint.x() - d);
  for (const Configuration& c : checked(follow(l, range(0, 0.9, 30)))) {
    const double phi = M_PI / 2 + c.driver, psi = rocker0 + c.poses[2].angle;
    const double k1 = d / a, k2 = d / r, k3 = (a * a - b * b + r * r + d * d) / (2 * a * r);
    EXPECT_NEAR(k1 * std::cos(psi) - k2 * std::cos(phi) + k3, std::cos(phi - psi), 1e-11);
  }
}

TEST(linkage, rates_are_the_derivatives_of_the_poses) {
  const Linkage l = four_bar(0.2, {0.45, 0.4}, 0.5);
  const double e = 1e-5;
  const auto c = checked(follow(l, {0.5 - e, 0.5, 0.5 + e}));
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_NEAR((c[2].poses[b].angle - c[0].poses[b].angle) / (2 * e), c[1].rates[b].angle, 1e-7);
    EXPECT_LT(((c[2].poses[b].shift - c[0].poses[b].shift) / (2 * e) - c[1].rates[b].shift).norm(), 1e-7);
  }
}

TEST(linkage, there_and_back_is_where_it_began) {
  const auto c = checked(follow(four_bar(0.2, {0.45, 0.4}, 0.5), {0.9, 0, -0.4, 0}));
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    for (const Pose& pose : c[i].poses) {
      EXPECT_NEAR(pose.angle, 0, 1e-11);
      EXPECT_LT(pose.shift.norm(), 1e-11);
    }
  }
}

TEST(linkage, a_dead_point_is_refused_with_its_angle) {
  // A rocker of 0.1 m on a coupler of 0.58 m cannot follow half a turn of a crank of 0.4 m.
  const Linkage l = four_bar(0.4, {0.5, 0.1}, 0.5);
  const auto refused = follow(l, {-M_PI});
  EXPECT_EQ(codes(refused), "dead_point");
  EXPECT_NE(refused.issues()[0].what.find("deg of its driver"), std::string::npos);
}

TEST(linkage, says_what_is_wrong_with_it) {
  Linkage l = four_bar(0.4, {0.5, 0.3}, 0.5);
  l.pivots.pop_back();
  EXPECT_EQ(codes(follow(l, {0.1})), "not_one_freedom");
  l = four_bar(0.4, {0.5, 0.3}, 0.5);
  l.pivots[2].bodies[1] = "rokcer";
  l.driver = "ground";
  const auto refused = follow(l, {0.1});
  EXPECT_EQ(codes(refused), "unknown_body unknown_body");
  EXPECT_NE(refused.issues()[0].remedy.find("rocker"), std::string::npos);
  l = four_bar(0.4, {0.5, 0.3}, 0.5);
  l.bodies.push_back("crank");
  l.bodies.push_back("spare");
  EXPECT_EQ(codes(follow(l, {0.1})), "duplicate loose_body");
}

TEST(frame, is_made_of_closed_outward_pieces) {
  Linkage l = four_bar(0.4, {0.5, 0.3}, 0.5);
  l.bars = {{"crank", {{0, 0}, {0.1, 0.2}, {0, 0.4}}, 0.5, 0.01, 0.02}, {"rocker", {{0.5, 0.3}, {0.5, 0}}, 0.48, 0.01, 0.02}};
  l.bows = {{.name = "top", .body = "coupler", .at = {0.2, 0.45}, .half_width = 0.5, .crown = 0.1, .width = 0.04, .height = 0.02, .pitch = 0.3, .divisions = 64, .sides = 32}};
  const mesh::SupportMesh frame = checked(frame_surface(l));
  EXPECT_TRUE(mesh::validate(frame).empty());
  EXPECT_EQ(frame.region_names, l.bodies);
  // Each piece looks outward: the volume of a region is that of its parts. A bar keeps its height through a mitred corner.
  const auto volume = [&](int region) {
    double sum = 0;
    for (Eigen::Index f = 0; f < frame.faces.rows(); ++f) {
      if (frame.face_region[f] != region) continue;
      const Vector3d a = frame.x.row(frame.faces(f, 0)), b = frame.x.row(frame.faces(f, 1)), c = frame.x.row(frame.faces(f, 2));
      sum += a.dot(b.cross(c)) / 6;
    }
    return sum;
  };
  EXPECT_NEAR(volume(0), 2 * 2 * std::hypot(0.1, 0.2) * 0.01 * 0.02, 1e-12);
  EXPECT_NEAR(volume(2), 2 * 0.3 * 0.01 * 0.02, 1e-12);
  // The arch y = -0.1 (x / 0.5)^2 by its arc length; a section's ellipse as a polygon of 32 sides.
  double length = 0;
  for (int i = 0; i < 100000; ++i) {
    const double x0 = -0.5 + i * 1e-5, x1 = x0 + 1e-5;
    length += std::hypot(1e-5, 0.4 * (x1 * x1 - x0 * x0));
  }
  const double section = 0.5 * 32 * std::sin(2 * M_PI / 32) * 0.02 * 0.01;
  EXPECT_NEAR(volume(1), section * length, 1e-3 * section * length);
  // Landmarks run along the outer line from right to left.
  const auto& middle = frame.landmarks.at("top_32");
  EXPECT_NEAR(middle[0], 0, 1e-15);
  EXPECT_NEAR(middle[1], 0.45 + 0.01 * std::cos(0.3), 1e-12);
  EXPECT_LT(frame.landmarks.at("top_0")[0], -0.49);
  EXPECT_GT(frame.landmarks.at("top_64")[0], 0.49);
}

TEST(frame, moves_as_rigid_bodies_by_the_poses_that_the_table_has) {
  Linkage l = four_bar(0.4, {0.5, 0.3}, 0.5);
  l.bars = {{"crank", {{0, 0}, {0, 0.4}}}};
  l.bows = {{.name = "top", .body = "coupler", .at = {0.2, 0.45}}};
  const mesh::SupportMesh frame = checked(frame_surface(l));
  const Configuration c = checked(follow(l, {0.6})).front();
  const mesh::SupportMesh there = moved(frame, l, c);
  for (Eigen::Index f = 0; f < frame.faces.rows(); ++f) {
    const RigidPose p = in_space(c.poses[static_cast<std::size_t>(frame.face_region[f])]);
    const Eigen::Quaterniond q(p.rotation[0], p.rotation[1], p.rotation[2], p.rotation[3]);
    for (const int v : frame.faces.row(f)) {
      const Vector3d by_table = q * Vector3d(frame.x.row(v)) + Vector3d(p.shift[0], p.shift[1], p.shift[2]);
      EXPECT_LT((by_table - there.x.row(v).transpose()).norm(), 1e-14);
    }
  }
  // The crank's end is where the coupler begins.
  const Vector2d end = moved(c.poses[0], {0, 0.4}), begin = moved(c.poses[1], {0, 0.4});
  EXPECT_LT((end - begin).norm(), 1e-12);
}

TEST(frame, refuses_bars_without_a_direction) {
  Linkage l = four_bar(0.4, {0.5, 0.3}, 0.5);
  EXPECT_EQ(codes(frame_surface(l)), "no_surface");
  l.bars = {{"crank", {{0, 0}, {0, 0}}}, {"crank", {{0, 0}, {0, 1}, {0, 0.5}}}};
  EXPECT_EQ(codes(frame_surface(l)), "bad_bar bad_bar");
  l.bars = {{"crank", {{0, 0}}}};
  EXPECT_EQ(codes(follow(l, {0})), "bad_range");
}

TEST(skin, is_a_closed_shell_over_the_bows) {
  Linkage l = four_bar(0.4, {0.5, 0.3}, 0.5);
  for (const double z : {0.8, 0.3, -0.1}) {
    l.bows.push_back({.name = fmt::format("bow_{}", l.bows.size()), .body = "coupler", .at = {z, 0.5}, .half_width = 0.5, .crown = 0.08, .exponent = 2, .width = 0.04, .height = 0.02, .divisions = 20});
  }
  const SkinOptions options{.offset = 0.005, .overhang = 0.03, .thickness = 0.02, .cell = 0.01};
  const mesh::SupportMesh skin = checked(skin_surface(l, {}, options));
  EXPECT_TRUE(mesh::validate(skin).empty());
  // Bows of one arch at one height: a cylinder over it. Everywhere outside the outer lines by the offset, measured square to the arch.
  const double length = 0.9 + 2 * options.overhang;
  double area = 0;
  for (Eigen::Index f = 0; f < skin.faces.rows(); ++f) {
    if (skin.face_region[f] != 0) continue;
    const Vector3d a = skin.x.row(skin.faces(f, 0)), b = skin.x.row(skin.faces(f, 1)), c = skin.x.row(skin.faces(f, 2));
    EXPECT_GT((b - a).cross(c - a).y(), 0);
    area += (b - a).cross(c - a).norm() / 2;
  }
  double arc = 0;
  const auto outer = [&](double x) {
    const double slope = -2 * 0.08 * x / 0.25, d = 0.015 / std::hypot(1, slope);
    return Vector2d(x - slope * d, 0.5 - 0.08 * x * x / 0.25 + d);
  };
  for (int i = 0; i < 2000; ++i) arc += (outer(-0.53 + 1.06 * (i + 1) / 2000) - outer(-0.53 + 1.06 * i / 2000)).norm();
  EXPECT_NEAR(area, arc * length, 1e-3 * area);
  for (const auto& [name, at] : skin.landmarks) {
    const Vector3d p(at[0], at[1], at[2]);
    EXPECT_LT((skin.x.rowwise() - p.transpose()).rowwise().norm().minCoeff(), 0.011) << name;
  }
  // The same from the rear to the front, and on moved bodies.
  std::reverse(l.bows.begin(), l.bows.end());
  EXPECT_TRUE(mesh::validate(checked(skin_surface(l, {}, options))).empty());
  const Configuration c = checked(follow(l, {0.3})).front();
  const mesh::SupportMesh there = checked(skin_surface(l, c.poses, options));
  const Vector2d p = moved(c.poses[1], {0.3, 0.515});
  EXPECT_NEAR(there.landmarks.at("bow_1_10")[1], p.y() , 1e-12);
  EXPECT_NEAR(there.landmarks.at("bow_1_10")[2], p.x() , 1e-12);
  l.bows.resize(1);
  EXPECT_EQ(codes(skin_surface(l, {}, options)), "no_skin");
}

TEST(motion, runs_through_its_rows) {
  const std::vector<double> times{0, 1, 3}, angles{0, 0.5, -0.5};
  EXPECT_EQ(angle_at(times, angles, Profile::straight, -1), 0);
  EXPECT_EQ(angle_at(times, angles, Profile::straight, 9), -0.5);
  EXPECT_NEAR(angle_at(times, angles, Profile::straight, 0.25), 0.125, 1e-15);
  EXPECT_NEAR(angle_at(times, angles, Profile::smooth, 0.25), 0.5 * (3 * 0.0625 - 2 * 0.015625), 1e-15);
  EXPECT_NEAR(angle_at(times, angles, Profile::smooth, 2), 0, 1e-15);
}

TEST(softtop, opens_by_110_degrees_and_never_needs_longer_cloth) {
  const std::string file = std::string(TOILE_SOURCE_DIR) + "/samples/mechanisms/softtop.yaml";
  const Linkage top = checked(io::read_record<Linkage>(checked(io::read_file(file)), file));
  const mesh::SupportMesh closed = checked(frame_surface(top));
  EXPECT_TRUE(mesh::validate(closed).empty());
  const std::vector<std::string> chain{"header", "bow1", "bow2", "bow3", "bow4", "rear_bow"};
  const auto points = [&](const mesh::SupportMesh& frame, const std::string& bow) {
    const auto it = std::find_if(top.bows.begin(), top.bows.end(), [&](const Bow& b) { return b.name == bow; });
    std::vector<Vector3d> result;
    for (const int i : {0, it->divisions / 2, it->divisions}) {
      const auto& at = frame.landmarks.at(fmt::format("{}_{}", bow, i));
      result.emplace_back(at[0], at[1], at[2]);
    }
    return result;
  };
  const auto way = checked(follow(top, range(0, 110 * M_PI / 180, 110)));
  for (const Configuration& c : way) {
    EXPECT_LT(c.closure, 1e-11);
    EXPECT_GT(c.conditioning, 1e-3);
    const mesh::SupportMesh frame = moved(closed, top, c);
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double now = (points(frame, chain[i])[k] - points(frame, chain[i + 1])[k]).norm(), then = (points(closed, chain[i])[k] - points(closed, chain[i + 1])[k]).norm();
        EXPECT_LT(now, then + 1e-3) << chain[i] << " at " << c.driver;
      }
    }
  }
  // Folded: every bow within 0.55 m of height and 0.45 m of length.
  Vector3d low = Vector3d::Constant(1e9), high = -low;
  for (const std::string& bow : chain) {
    const Vector3d p = points(moved(closed, top, way.back()), bow)[1];
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_LT(high.y() - low.y(), 0.55);
  EXPECT_LT(high.z() - low.z(), 0.45);
}

TEST(inertia, curvatures_are_the_derivatives_of_the_rates) {
  const double e = 1e-5;
  const auto c = checked(follow(four_bar(0.2, {0.45, 0.4}, 0.5), {0.5 - e, 0.5, 0.5 + e}));
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_NEAR((c[2].rates[b].angle - c[0].rates[b].angle) / (2 * e), c[1].curvatures[b].angle, 1e-7);
    EXPECT_LT(((c[2].rates[b].shift - c[0].rates[b].shift) / (2 * e) - c[1].curvatures[b].shift).norm(), 1e-7);
  }
}

namespace {

/// A rod of 400 mm that hangs from a pivot at (0.1, 0.6), on both sides.
Linkage pendulum() {
  Linkage l;
  l.bodies = {"rod"};
  l.driver = "rod";
  l.pivots = {{{"ground", "rod"}, {0.1, 0.6}}};
  l.bars = {{.body = "rod", .points = {{0.1, 0.6}, {0.1, 0.2}}, .half_width = 0.5, .thickness = 0.01, .height = 0.02}};
  l.density = 2700;
  return l;
}

Linkage weighted_four_bar() {
  Linkage l = four_bar(0.2, {0.45, 0.4}, 0.5);
  l.masses = {{"crank", 2, {0, 0.1}, 0.01}, {"coupler", 3, {0.2, 0.35}, 0.05}, {"rocker", 1, {0.5, 0.2}, 0.02}};
  return l;
}

}  // namespace

TEST(inertia, a_rod_weighs_what_its_formula_says) {
  const auto i = checked(inertias(pendulum()));
  const double mass = 2 * 2700 * 0.4 * 0.01 * 0.02;
  EXPECT_NEAR(i[0].mass, mass, 1e-9);
  EXPECT_LT((i[0].centre - Vector2d(0.1, 0.4)).norm(), 1e-9);
  EXPECT_NEAR(i[0].moment, mass * (0.4 * 0.4 + 0.02 * 0.02) / 12, 1e-9);
  Linkage more = pendulum();
  more.density = 0;
  EXPECT_EQ(codes(inertias(more)), "no_mass");
  more.masses = {{"rod", 2, {0.1, 0.3}, 0.5}};
  EXPECT_NEAR(checked(inertias(more))[0].moment, 0.5, 1e-12);
  more.masses[0].body = "rode";
  EXPECT_EQ(codes(inertias(more)), "unknown_body");
}

TEST(inertia, a_pendulum_swings_with_its_period_and_keeps_its_energy) {
  Dynamics dynamics = checked(Dynamics::make(pendulum(), 9.81));
  const double arm = 0.2, per_mass = (0.4 * 0.4 + 0.02 * 0.02) / 12 + arm * arm;
  const Reduced still = checked(dynamics.at(0.3));
  EXPECT_NEAR(still.inertia, dynamics.inertias()[0].mass * per_mass, 1e-9);
  EXPECT_NEAR(still.weight, -dynamics.inertias()[0].mass * 9.81 * arm * std::sin(0.3), 1e-7);
  const double omega = std::sqrt(9.81 * arm / per_mass);
  // Of small swings; to the second order of the amplitude.
  const double amplitude = 0.02, period = 2 * M_PI / omega * (1 + amplitude * amplitude / 16);
  const DriverState after = checked(dynamics.advance({amplitude, 0}, 0, 3 * period, [](double, const DriverState&) { return 0.0; }));
  EXPECT_NEAR(after.angle, amplitude, 1e-9);
  EXPECT_NEAR(after.rate, 0, 1e-6);
}

TEST(inertia, a_swinging_linkage_keeps_its_energy) {
  Dynamics dynamics = checked(Dynamics::make(weighted_four_bar(), 9.81));
  const auto energy = [&](const DriverState& s) {
    const Reduced r = checked(dynamics.at(s.angle));
    return 0.5 * r.inertia * s.rate * s.rate + r.height_energy;
  };
  // Against the exact values between the nodes of the table.
  const auto exact = reduce(checked(follow(weighted_four_bar(), {0.4321}))[0], dynamics.inertias(), 9.81), read = checked(dynamics.at(0.4321));
  EXPECT_NEAR(read.inertia, exact.inertia, 1e-8);
  EXPECT_NEAR(read.inertia_slope, exact.inertia_slope, 1e-5);
  EXPECT_NEAR(read.weight, exact.weight, 1e-5);
  DriverState s{0, 3};
  const double start = energy(s);
  for (int i = 0; i < 20; ++i) {
    s = checked(dynamics.advance(s, 0.01 * i, 0.01 * (i + 1), [](double, const DriverState&) { return 0.0; }));
    EXPECT_NEAR(energy(s), start, 1e-8 * std::abs(start));
  }
  EXPECT_GT(std::abs(s.angle), 0.1);
  Linkage locks = four_bar(0.5, {0.3, 0.5}, 0.3);
  locks.masses = {{"crank", 2, {0, 0.1}, 0.01}};
  EXPECT_EQ(codes(checked(Dynamics::make(locks, 9.81)).advance({0, 0}, 0, 60, [](double, const DriverState&) { return -100.0; })), "dead_point");
}

TEST(inertia, the_motion_of_an_angle_is_its_own_derivative) {
  const std::vector<double> times{0, 1, 3}, angles{0, 2, 1};
  for (const Profile profile : {Profile::smooth, Profile::straight}) {
    for (const double t : {-1.0, 0.3, 1.7, 4.0}) {
      const AngleMotion m = angle_motion(times, angles, profile, t), a = angle_motion(times, angles, profile, t - 1e-5), b = angle_motion(times, angles, profile, t + 1e-5);
      EXPECT_EQ(m.angle, angle_at(times, angles, profile, t));
      EXPECT_NEAR(m.rate, (b.angle - a.angle) / 2e-5, 1e-8);
      EXPECT_NEAR(m.acceleration, (b.rate - a.rate) / 2e-5, 1e-8);
    }
  }
}
