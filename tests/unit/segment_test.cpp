// Regions that are found on a body without any, against those that a form has from its own making.
#include "people.h"
#include "toile/form/form.h"
#include "toile/placement/segment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <string>

using namespace toile;

namespace {

mesh::SupportMesh man() {
  form::FormParams p;
  p.vertices = 1500;
  return form::make_form(testing_people::man(), p)->mesh;
}

std::string region(const mesh::SupportMesh& support, Eigen::Index f) {
  const int id = support.face_region[f];
  return id < 0 ? "" : support.region_names[static_cast<std::size_t>(id)];
}

double face_area(const mesh::SupportMesh& s, Eigen::Index f) {
  const Eigen::Vector3d a = s.x.row(s.faces(f, 0)), b = s.x.row(s.faces(f, 1)), c = s.x.row(s.faces(f, 2));
  return (b - a).cross(c - a).norm() / 2;
}

}  // namespace

TEST(segment, finds_the_regions_of_a_form) {
  const mesh::SupportMesh form = man();
  mesh::SupportMesh bare = form;
  bare.face_region.setConstant(-1);
  bare.region_names.clear();
  bare.landmarks.clear();
  ASSERT_TRUE(placement::segment(bare).empty());
  std::map<std::string, double> own, alike, found;
  for (Eigen::Index f = 0; f < form.faces.rows(); ++f) {
    own[region(form, f)] += face_area(form, f);
    found[region(bare, f)] += face_area(bare, f);
    if (region(form, f) == region(bare, f)) alike[region(form, f)] += face_area(form, f);
  }
  for (const char* name : {"torso", "arm_left", "arm_right"}) {
    EXPECT_GT(alike[name], 0.9 * own[name]) << name;
    EXPECT_GT(alike[name], 0.9 * found[name]) << name;
  }
  EXPECT_GT(alike["neck"], 0.5 * own["neck"]);
  EXPECT_EQ(found.count(""), 0u);
  EXPECT_NEAR(found["arm_left"], found["arm_right"], 1e-3 * found["arm_left"]);  // a symmetric body
}

TEST(segment, leaves_regions_that_there_are) {
  mesh::SupportMesh body = man();
  const std::vector<std::string> names = body.region_names;
  mesh::SupportMesh partly = body;
  for (Eigen::Index f = 0; f < partly.faces.rows(); f += 2) partly.face_region[f] = 0;
  ASSERT_TRUE(placement::segment(partly).empty());
  EXPECT_EQ(partly.region_names, names);
  EXPECT_EQ(partly.face_region.minCoeff(), 0);
  for (Eigen::Index f = 0; f < partly.faces.rows(); f += 2) EXPECT_EQ(partly.face_region[f], 0);
}

TEST(segment, refuses_what_is_no_body) {
  // A thin plate lying down: nothing goes upright round its middle.
  mesh::SupportMesh plate;
  plate.x.resize(8, 3);
  for (int i = 0; i < 8; ++i) plate.x.row(i) << 0.4 * (i & 1), 0.01 * (i >> 1 & 1), 0.3 * (i >> 2 & 1);
  plate.faces.resize(12, 3);
  plate.faces << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5;
  plate.face_region = mesh::Ids::Constant(12, -1);
  const Issues issues = placement::segment(plate);
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].code, "no_trunk");
  EXPECT_FALSE(issues[0].remedy.empty());
}
