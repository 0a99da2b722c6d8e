#include "toile/form/form.h"

#include "toile/geometry/slice.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

using namespace toile;

namespace {

form::Measurements man() {
  form::Measurements m;
  m.chest = 1.0, m.waist = 0.783, m.hips = 0.928, m.seat = 0.977, m.neck = 0.4, m.biceps = 0.318, m.wrist = 0.165;
  m.shoulderToShoulder = 0.43, m.shoulderSlope = 21 * M_PI / 180, m.hpsToWaistBack = 0.46, m.hpsToBust = 0.265;
  m.waistToArmpit = 0.215, m.waistToHips = 0.13, m.waistToSeat = 0.22, m.waistToFloor = 1.085;
  m.shoulderToElbow = 0.32, m.shoulderToWrist = 0.575, m.waistToUpperLeg = 0.27;
  return m;
}

form::Measurements woman() {
  form::Measurements m;
  m.chest = 0.92, m.waist = 0.735, m.hips = 0.905, m.seat = 0.99, m.neck = 0.36, m.biceps = 0.283, m.wrist = 0.158;
  m.shoulderToShoulder = 0.395, m.shoulderSlope = 19 * M_PI / 180, m.hpsToWaistBack = 0.42, m.hpsToBust = 0.265;
  m.waistToArmpit = 0.21, m.waistToHips = 0.125, m.waistToSeat = 0.25, m.waistToFloor = 1.045;
  m.shoulderToElbow = 0.33, m.shoulderToWrist = 0.565, m.underbust = 0.78, m.bustSpan = 0.175;
  return m;
}

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
