#include "toile/form/form.h"

#include "toile/geometry/slice.h"
#include "toile/io/record_yaml.h"
#include "toile/mesh/topology.h"

#include <gtest/gtest.h>

#include "people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <string>

using namespace toile;
using toile::testing_people::man;
using toile::testing_people::woman;

namespace {

form::Form made(const form::Measurements& m, const form::FormParams& p) {
  auto f = form::make_form(m, p);
  if (!f) {
    for (const Issue& issue : f.issues()) ADD_FAILURE() << to_string(issue);
    return {};
  }
  return std::move(*f);
}

void expect_sound(const form::Form& f, const form::FormParams& p) {
  EXPECT_TRUE(ok(mesh::validate(f.mesh)));
  EXPECT_EQ(mesh::euler_number(f.mesh.faces), 2);
  EXPECT_EQ(mesh::component_count(f.mesh.faces), 1);
  EXPECT_NEAR(f.mesh.x.rows(), p.vertices, 0.04 * p.vertices);
  EXPECT_GE(f.smallest_angle * 180 / M_PI, 15);
  for (const form::GaugeRow& row : f.gauge) EXPECT_TRUE(row.within()) << row.name << " asked " << row.requested << " has " << row.measured;
}

}  // namespace

TEST(form, both_builds_at_both_sizes_measure_as_asked) {
  for (const auto sex : {form::Sex::male, form::Sex::female}) {
    for (const bool arms : {true, false}) {
      for (const int vertices : {1500, 6000}) {
        form::FormParams p;
        p.sex = sex, p.arms = arms, p.vertices = vertices;
        SCOPED_TRACE(fmt::format("female {} arms {} vertices {}", sex == form::Sex::female, arms, vertices));
        expect_sound(made(sex == form::Sex::male ? man() : woman(), p), p);
      }
    }
  }
}

TEST(form, girths_agree_with_an_independent_section) {
  form::FormParams p;
  p.vertices = 6000;
  p.arms = false;
  const form::Measurements m = man();
  const form::Form f = made(m, p);
  const auto girth = [&](const std::string& landmark) {
    const double y = f.mesh.landmarks.at(landmark)[1];
    // The perimeter of the hull by turning a ruler around it (Cauchy): the mean width times pi.
    double width = 0;
    const int turns = 2000;
    std::vector<Eigen::Vector2d> points;
    for (Eigen::Index t = 0; t < f.mesh.faces.rows(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d a = f.mesh.x.row(f.mesh.faces(t, k)), b = f.mesh.x.row(f.mesh.faces(t, (k + 1) % 3));
        if ((a.y() < y) == (b.y() < y)) continue;
        const Eigen::Vector3d q = a + (b - a) * (y - a.y()) / (b.y() - a.y());
        points.emplace_back(q.x(), q.z());
      }
    }
    for (int i = 0; i < turns; ++i) {
      const Eigen::Vector2d d(std::cos(M_PI * (i + 0.5) / turns), std::sin(M_PI * (i + 0.5) / turns));
      double low = 1e9, high = -1e9;
      for (const auto& q : points) low = std::min(low, q.dot(d)), high = std::max(high, q.dot(d));
      width += (high - low) / turns;
    }
    return M_PI * width;
  };
  EXPECT_NEAR(girth("waist_left"), m.waist, 0.002);
  EXPECT_NEAR(girth("hip_left"), m.hips, 0.002);
  EXPECT_NEAR(girth("seat_left"), m.seat, 0.002);
  EXPECT_NEAR(girth("chest_left"), m.chest, 0.002);
}

TEST(form, landmarks_are_on_the_surface_and_where_they_belong) {
  form::FormParams p;
  p.vertices = 6000;
  const form::Form f = made(woman(), [&] { auto q = p; q.sex = form::Sex::female; return q; }());
  std::set<std::string> names;
  for (const auto& [name, position] : f.mesh.landmarks) {
    names.insert(name);
    const Eigen::RowVector3d q(position[0], position[1], position[2]);
    // Near the mesh: sections cut triangles, so a landmark may be half an edge from the nearest vertex.
    EXPECT_LT((f.mesh.x.rowwise() - q).rowwise().norm().minCoeff(), 0.02) << name;
  }
  for (const char* name : {"neck_front", "neck_back", "hps_left", "hps_right", "shoulder_left", "shoulder_right", "armpit_left", "armpit_right", "bust_left",
                           "bust_right", "waist_front", "waist_back", "waist_left", "waist_right", "hip_front", "hip_back", "hip_left", "hip_right", "seat_front",
                           "seat_back", "seat_left", "seat_right", "elbow_left", "elbow_right", "wrist_left", "wrist_right"}) {
    EXPECT_TRUE(names.count(name)) << name;
  }
  const auto at = [&](const char* name) { return Eigen::Vector3d(f.mesh.landmarks.at(name).data()); };
  EXPECT_GT(at("bust_left").x(), 0.05) << "the left hand is at +x";
  EXPECT_GT(at("bust_left").z(), at("waist_front").z()) << "facing +z";
  EXPECT_GT(at("waist_front").z(), at("waist_back").z());
  EXPECT_GT(at("hps_left").y(), at("shoulder_left").y());
  EXPECT_GT(at("shoulder_left").y(), at("armpit_left").y());
  EXPECT_GT(at("neck_back").y(), at("neck_front").y());
  EXPECT_GT(at("elbow_left").y(), at("wrist_left").y());
  EXPECT_NEAR(at("waist_left").y(), woman().waistToFloor, 1e-9);
  EXPECT_NEAR(2 * at("bust_left").x(), *woman().bustSpan, 0.005);
}

TEST(form, regions_are_where_they_are_called) {
  form::FormParams p;
  p.vertices = 1500;
  const form::Form f = made(man(), p);
  ASSERT_EQ(f.mesh.region_names, (std::vector<std::string>{"torso", "neck", "arm_left", "arm_right"}));
  const double hps = f.mesh.landmarks.at("hps_left")[1], shoulder = f.mesh.landmarks.at("shoulder_left")[0];
  std::array<int, 4> count{};
  for (Eigen::Index t = 0; t < f.mesh.faces.rows(); ++t) {
    const Eigen::Vector3d c = (f.mesh.x.row(f.mesh.faces(t, 0)) + f.mesh.x.row(f.mesh.faces(t, 1)) + f.mesh.x.row(f.mesh.faces(t, 2))).transpose() / 3;
    const int region = f.mesh.face_region[t];
    ++count[static_cast<std::size_t>(region)];
    if (region == 1) {
      EXPECT_GT(c.y(), hps - 0.06);
    }
    if (region == 2) {
      EXPECT_GT(c.x(), shoulder - 0.06);
    }
    if (region == 3) {
      EXPECT_LT(c.x(), -shoulder + 0.06);
    }
    if (region == 0) {
      EXPECT_LT(std::abs(c.x()), shoulder + 0.03);
    }
  }
  EXPECT_EQ(count[2], count[3]);
  for (const int n : count) EXPECT_GT(n, 50);
  p.arms = false;
  EXPECT_EQ(made(man(), p).mesh.region_names, (std::vector<std::string>{"torso", "neck"}));
}

TEST(form, legs_measure_as_asked_and_stand_apart) {
  for (const auto sex : {form::Sex::male, form::Sex::female}) {
    SCOPED_TRACE(sex == form::Sex::female);
    form::Measurements m = sex == form::Sex::male ? man() : woman();
    m.inseam = sex == form::Sex::male ? 0.815 : 0.76;
    m.upperLeg = 0.57, m.knee = 0.385, m.ankle = 0.24;
    form::FormParams p;
    p.sex = sex, p.legs = true, p.arms = sex == form::Sex::male, p.vertices = 5000;
    const form::Form f = made(m, p);
    expect_sound(f, p);
    std::set<std::string> answered;
    for (const form::GaugeRow& row : f.gauge) {
      answered.insert(row.name);
      if (row.girth) EXPECT_LT(std::abs(row.difference), 3e-4) << row.name;
    }
    for (const char* name : {"upperLeg", "knee", "ankle", "inseam"}) EXPECT_TRUE(answered.count(name)) << name;
    const auto& names = f.mesh.region_names;
    ASSERT_EQ(names[names.size() - 2], "leg_left");
    ASSERT_EQ(names.back(), "leg_right");
    std::array<int, 2> count{};
    for (Eigen::Index t = 0; t < f.mesh.faces.rows(); ++t) {
      const Eigen::Vector3d c = (f.mesh.x.row(f.mesh.faces(t, 0)) + f.mesh.x.row(f.mesh.faces(t, 1)) + f.mesh.x.row(f.mesh.faces(t, 2))).transpose() / 3;
      const int leg = f.mesh.face_region[t] - static_cast<int>(names.size()) + 2;
      EXPECT_EQ(leg >= 0, c.y() < *m.inseam - 1e-4 || (leg >= 0 && c.y() < *m.inseam + 1e-4));
      if (leg < 0) continue;
      ++count[static_cast<std::size_t>(leg)];
      EXPECT_GT((leg == 0 ? 1 : -1) * c.x(), 0);
    }
    EXPECT_EQ(count[0], count[1]);
    EXPECT_NEAR(f.mesh.landmarks.at("crotch")[1], *m.inseam, 3e-4);
    EXPECT_GT(f.mesh.landmarks.at("ankle_left")[0], 0.1);
    // a hand's breadth under the crotch there is air between the thighs
    double nearest = 1;
    for (Eigen::Index v = 0; v < f.mesh.x.rows(); ++v) {
      if (f.mesh.x(v, 1) < *m.inseam - 0.06) nearest = std::min(nearest, std::abs(f.mesh.x(v, 0)));
    }
    EXPECT_GT(nearest, 0.008);
  }
}

TEST(form, legs_need_their_measurements) {
  form::FormParams p;
  p.legs = true;
  const auto none = form::make_form(man(), p);
  ASSERT_FALSE(none.has_value());
  ASSERT_EQ(none.issues().size(), 4u);
  EXPECT_EQ(none.issues().front().code, "missing_measurement");
  EXPECT_EQ(none.issues().front().place.item, "inseam");
  form::Measurements m = man();
  m.inseam = 0.815, m.upperLeg = 0.9, m.knee = 0.385, m.ankle = 0.24;
  const auto thick = form::make_form(m, p);
  ASSERT_FALSE(thick.has_value());
  EXPECT_EQ(thick.issues().front().place.item, "upperLeg");
}

TEST(form, must_fail) {
  struct Row {
    const char* what;
    std::function<void(form::Measurements&, form::FormParams&)> spoil;
    const char* code;
    const char* key;
  };
  const std::vector<Row> rows = {
      {"chest in cm read as m", [](auto& m, auto&) { m.chest = 100; }, "out_of_range", "chest"},
      {"missing neck", [](auto& m, auto&) { m.neck = 0; }, "out_of_range", "neck"},
      {"slope in degrees", [](auto& m, auto&) { m.shoulderSlope = 21; }, "out_of_range", "shoulderSlope"},
      {"waist of another person", [](auto& m, auto&) { m.waist = 1.45; }, "implausible_measurement", "waist"},
      {"seat above the hips", [](auto& m, auto&) { m.waistToSeat = 0.12; }, "implausible_measurement", "waistToSeat"},
      {"armpit at the neck", [](auto& m, auto&) { m.waistToArmpit = 0.34; }, "implausible_measurement", "waistToArmpit"},
      {"elbow at the wrist", [](auto& m, auto&) { m.shoulderToElbow = 0.45; }, "implausible_measurement", "shoulderToElbow"},
      {"not a number", [](auto& m, auto&) { m.hips = std::nan(""); }, "out_of_range", "hips"},
      {"too few vertices", [](auto&, auto& p) { p.vertices = 20; }, "out_of_range", "vertices"},
      {"arms up", [](auto&, auto& p) { p.arm_angle = -0.5; }, "out_of_range", "arm_angle"},
  };
  for (const Row& row : rows) {
    form::Measurements m = man();
    form::FormParams p;
    row.spoil(m, p);
    const auto f = form::make_form(m, p);
    ASSERT_FALSE(f) << row.what;
    bool found = false;
    for (const Issue& issue : f.issues()) {
      found = found || (issue.code == row.code && issue.place.item == row.key);
      EXPECT_FALSE(issue.remedy.empty());
    }
    EXPECT_TRUE(found) << row.what << ": " << to_string(f.issues()[0]) << " [" << f.issues()[0].code << "]";
  }
  // All of them at once, not only the first.
  form::Measurements m = man();
  m.chest = 0, m.wrist = 3;
  EXPECT_GE(form::make_form(m, {}).issues().size(), 2u);
}

TEST(form, measurement_files) {
  const auto missing = io::read_record<form::Measurements>("chest: 1000 mm\nwaist: 800 mm\n", "me.yaml");
  ASSERT_FALSE(missing);
  EXPECT_GE(missing.issues().size(), 15u) << "every missing measure is named";
  const auto misspelt = io::read_record<form::Measurements>("chset: 1000 mm\n", "me.yaml");
  ASSERT_FALSE(misspelt);
  bool hint = false;
  for (const Issue& issue : misspelt.issues()) hint = hint || issue.remedy.find("chest") != std::string::npos;
  EXPECT_TRUE(hint);
}
