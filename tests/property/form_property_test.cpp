// Forms of random plausible people, and what must hold for every form.
#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/form/form.h"
#include "toile/geometry/slice.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"

#include <gtest/gtest.h>

#include "people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace toile;
using toile::testing_people::man;
using toile::testing_people::woman;

namespace {

/// Somebody of another size and build: girths and lengths scaled apart, then each varied on its own.
form::Measurements somebody(Rng& rng, form::Sex sex) {
  form::Measurements m = sex == form::Sex::male ? man() : woman();
  const double stout = 0.84 + 0.46 * rng.uniform(), tall = 0.88 + 0.26 * rng.uniform();
  const auto vary = [&](double& value, double scale, double spread) { value *= scale * (1 + spread * (2 * rng.uniform() - 1)); };
  vary(m.chest, stout, 0.01);
  vary(m.waist, stout, 0.08);
  vary(m.hips, stout, 0.03);
  vary(m.seat, stout, 0.03);
  vary(m.neck, std::sqrt(stout), 0.04);
  vary(m.biceps, stout, 0.06);
  vary(m.wrist, std::sqrt(stout), 0.05);
  vary(m.shoulderToShoulder, std::sqrt(stout), 0.04);
  m.shoulderSlope = (13 + 11 * rng.uniform()) * M_PI / 180;
  vary(m.hpsToWaistBack, tall, 0.02);
  vary(m.hpsToBust, tall, 0.03);
  vary(m.waistToArmpit, tall, 0.04);
  vary(m.waistToHips, tall, 0.06);
  vary(m.waistToSeat, tall, 0.04);
  vary(m.waistToFloor, tall, 0.02);
  vary(m.shoulderToElbow, tall, 0.03);
  vary(m.shoulderToWrist, tall, 0.03);
  m.hips = std::max(m.hips, 0.95 * m.waist);
  m.seat = std::max(m.seat, m.hips);
  if (m.bustSpan) *m.bustSpan *= stout;
  if (m.underbust) m.underbust = m.chest * (0.84 + 0.06 * rng.uniform());
  m.waistToUpperLeg.reset();
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

}  // namespace

TEST(form_property, random_people_measure_as_asked) {
  Rng rng(20);
  int refused = 0;
  for (int i = 0; i < 12; ++i) {
    form::FormParams p;
    p.sex = i % 2 ? form::Sex::female : form::Sex::male;
    p.arms = i % 3 != 2;
    p.vertices = 1500;
    form::Measurements m = somebody(rng, p.sex);
    for (; !ok(validate(m)); m = somebody(rng, p.sex)) ASSERT_LT(++refused, 24) << "a third of random people at least should be possible";
    SCOPED_TRACE(fmt::format("person {}: chest {} waist {} seat {} slope {} back {} armpit {} bust {}", i, m.chest, m.waist, m.seat, m.shoulderSlope,
                             m.hpsToWaistBack, m.waistToArmpit, m.hpsToBust));
    const form::Form f = made(m, p);
    for (const form::GaugeRow& row : f.gauge) EXPECT_TRUE(row.within()) << row.name << " asked " << row.requested << " has " << row.measured;
    EXPECT_TRUE(ok(mesh::validate(f.mesh)));
    EXPECT_EQ(mesh::euler_number(f.mesh.faces), 2);
    EXPECT_EQ(mesh::component_count(f.mesh.faces), 1);
    EXPECT_GE(f.smallest_angle * 180 / M_PI, 15);
    EXPECT_NEAR(f.mesh.x.rows(), p.vertices, 0.04 * p.vertices);
  }
}

TEST(form_property, mirror_symmetric_to_the_bit) {
  for (const bool arms : {true, false}) {
    form::FormParams p;
    p.arms = arms, p.vertices = 1500;
    const form::Form f = made(man(), p);
    using Point = std::array<double, 3>;
    std::vector<Point> points, images;
    for (Eigen::Index i = 0; i < f.mesh.x.rows(); ++i) {
      points.push_back({f.mesh.x(i, 0), f.mesh.x(i, 1), f.mesh.x(i, 2)});
      images.push_back({0 - f.mesh.x(i, 0), f.mesh.x(i, 1), f.mesh.x(i, 2)});
    }
    // Faces too: each as its corners, starting from the least, in order; the image of a face runs the other way round.
    std::vector<std::array<Point, 3>> faces, face_images;
    const auto cycle = [](std::array<Point, 3> t) {
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      return t;
    };
    for (Eigen::Index t = 0; t < f.mesh.faces.rows(); ++t) {
      const auto at = [&](const std::vector<Point>& from, int k) { return from[static_cast<std::size_t>(f.mesh.faces(t, k))]; };
      faces.push_back(cycle({at(points, 0), at(points, 1), at(points, 2)}));
      face_images.push_back(cycle({at(images, 0), at(images, 2), at(images, 1)}));
    }
    for (auto* list : {&points, &images}) std::sort(list->begin(), list->end());
    for (auto* list : {&faces, &face_images}) std::sort(list->begin(), list->end());
    EXPECT_TRUE(points == images);
    EXPECT_TRUE(faces == face_images);
    for (const auto& [name, position] : f.mesh.landmarks) {
      if (!name.ends_with("_left")) continue;
      const auto& other = f.mesh.landmarks.at(name.substr(0, name.size() - 4) + "right");
      EXPECT_TRUE(other[0] == -position[0] && other[1] == position[1] && other[2] == position[2]) << name;
    }
  }
}

TEST(form_property, same_bytes_at_any_thread_count) {
  form::FormParams p;
  p.vertices = 1500;
  std::vector<std::string> bytes;
  for (const int threads : {1, 2, 5, 1}) {
    set_thread_count(threads);
    bytes.push_back(io::format_support(made(woman(), p).mesh, io::Encoding::binary));
  }
  set_thread_count(0);
  for (std::size_t i = 1; i < bytes.size(); ++i) EXPECT_TRUE(bytes[i] == bytes[0]);
}

TEST(form_property, a_larger_person_is_the_same_form_scaled) {
  form::FormParams p;
  p.vertices = 3000;
  const form::Form one = made(man(), p);
  form::Measurements big = man();
  const double scale = 1.15;
  for (double form::Measurements::*length :
       {&form::Measurements::chest, &form::Measurements::waist, &form::Measurements::hips, &form::Measurements::seat, &form::Measurements::neck,
        &form::Measurements::biceps, &form::Measurements::wrist, &form::Measurements::shoulderToShoulder, &form::Measurements::hpsToWaistBack,
        &form::Measurements::hpsToBust, &form::Measurements::waistToArmpit, &form::Measurements::waistToHips, &form::Measurements::waistToSeat,
        &form::Measurements::waistToFloor, &form::Measurements::shoulderToElbow, &form::Measurements::shoulderToWrist}) {
    big.*length *= scale;
  }
  *big.waistToUpperLeg *= scale;
  const form::Form two = made(big, p);
  EXPECT_NEAR(mesh::volume(two.mesh.x, two.mesh.faces), std::pow(scale, 3) * mesh::volume(one.mesh.x, one.mesh.faces), 0.005 * mesh::volume(one.mesh.x, one.mesh.faces));
  for (const auto& [name, position] : one.mesh.landmarks) {
    const Eigen::Vector3d expected = scale * Eigen::Vector3d(position.data()), found(two.mesh.landmarks.at(name).data());
    // Where a landmark is an extreme of a flat curve, it may slide along it.
    EXPECT_LT((expected - found).norm(), name.find("armpit") != std::string::npos || name.ends_with("left") || name.ends_with("right") ? 0.02 : 0.004) << name;
  }
}

TEST(form_property, a_finer_mesh_is_the_same_form) {
  form::FormParams p;
  p.vertices = 1500;
  const form::Form coarse = made(man(), p);
  p.vertices = 12000;
  const form::Form fine = made(man(), p);
  EXPECT_NEAR(mesh::volume(coarse.mesh.x, coarse.mesh.faces) / mesh::volume(fine.mesh.x, fine.mesh.faces), 1, 0.01);
  const Eigen::RowVector3d size = coarse.mesh.x.colwise().maxCoeff() - coarse.mesh.x.colwise().minCoeff();
  const Eigen::RowVector3d fine_size = fine.mesh.x.colwise().maxCoeff() - fine.mesh.x.colwise().minCoeff();
  EXPECT_LT((size - fine_size).cwiseAbs().maxCoeff(), 0.01);
}
