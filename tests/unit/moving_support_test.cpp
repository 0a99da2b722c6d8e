// Supports that move under cloth: held points follow to the last digit, friction is that of the moving surface, what the cloth does to a body is what
// it weighs, and where there is no way out the run says so.
#include "cloth_fixtures.h"
#include "tables.h"
#include "toile/dynamics/simulate.h"

#include <gtest/gtest.h>

namespace toile::dynamics {
namespace {

using Eigen::Vector3d;
using fixtures::shirting;
using mesh::GarmentMesh;

/// A closed box, one region.
void add_box(mesh::SupportMesh& s, const std::string& region, const Vector3d& low, const Vector3d& high) {
  const auto first = static_cast<int>(s.x.rows());
  const auto face = s.faces.rows();
  s.x.conservativeResize(first + 8, 3);
  for (int k = 0; k < 8; ++k) s.x.row(first + k) << (k & 1 ? high : low).x(), (k & 2 ? high : low).y(), (k & 4 ? high : low).z();
  mesh::Triangles f(12, 3);
  f << 2, 6, 7, 2, 7, 3, 0, 1, 5, 0, 5, 4, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5;
  s.faces.conservativeResize(face + 12, 3);
  s.faces.bottomRows(12) = f.array() + first;
  s.face_region.conservativeResize(face + 12);
  s.face_region.tail(12).setConstant(static_cast<int>(s.region_names.size()));
  s.region_names.push_back(region);
}

/// Rows every `interval` of a body's pose as a function of time.
std::string table(const std::string& body, double duration, double interval, const std::function<BodyPose(double)>& pose) {
  std::string rows;
  const int n = static_cast<int>(std::lround(duration / interval));
  for (int i = 0; i <= n; ++i) {
    const BodyPose p = pose(i * interval);
    rows += fmt::format("{},{},{},{},{},{},{},{},{}\n", i * interval, body, p.shift.x(), p.shift.y(), p.shift.z(), p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z());
  }
  return rows;
}

Result<SimulationOutcome> run(const GarmentMesh& g, const std::optional<mesh::SupportMesh>& support, const SimulationParams& params, const std::string& rows) {
  auto motion = table_motion("time,body,x,y,z,qw,qx,qy,qz\n" + rows, "table.csv", params.motion_begin);
  EXPECT_TRUE(motion) << (motion ? "" : to_string(motion.issues().front()));
  SimulationHooks hooks;
  hooks.supports = motion->get();
  EXPECT_TRUE(validate(params).empty()) << to_string(validate(params).front());
  return simulate(g, support, params, hooks);
}

SimulationParams moving(double duration, double step) {
  SimulationParams params;
  params.mode = Mode::motion;
  params.duration = duration;
  params.time_step = step;
  params.air_drag = 0;
  return params;
}

ConstraintSpec held_by(const std::string& place, const std::string& body) {
  ConstraintSpec c;
  c.name = "hold";
  c.on = {place};
  c.kind = Hold::drive;
  c.body = body;
  return c;
}

double smooth(double u) { return u * u * (3 - 2 * u); }

TEST(MovingSupport, HeldPointsFollowTheBodyExactly) {
  const GarmentMesh g = fixtures::sheet(3, 5, 0.06, 0.1, shirting(), [](double u, double v) { return Vector3d(u, v - 0.1, 0); });
  const auto pose = [](double t) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(2 * smooth(t / 0.2), Vector3d(0, 0.6, 0.8)));
    return BodyPose{turn, Vector3d(0.1 * smooth(t / 0.2), 0.02 * t, 0)};
  };
  for (const Integrator integrator : {Integrator::automatic, Integrator::implicit}) {
    SimulationParams params = moving(0.2, 0.005);
    params.integrator = integrator;
    params.constraints = {held_by("sheet.top", "arm")};
    const auto result = run(g, std::nullopt, params, table("arm", 0.2, 0.01, pose));
    ASSERT_TRUE(result) << to_string(result.issues().front());
    EXPECT_EQ(result->report.unconverged_steps, 0);
    const BodyPose end = pose(0.2);
    int held = 0;
    for (Eigen::Index v = 0; v < g.x.rows(); ++v) {
      if (std::abs(g.x(v, 1)) > 1e-12) continue;
      ++held;
      EXPECT_LT((result->garment.x.row(v).transpose() - end(g.x.row(v).transpose())).norm(), 1e-12);
    }
    EXPECT_EQ(held, 4);
  }
}

/// A square on a floor that is slowly turned: how far it has slid on it when the slope's tangent is so many times mu [m].
double slid(double times_mu) {
  const double mu = 0.3, end = std::atan(times_mu * mu), duration = 2;
  mesh::SupportMesh floor;
  add_box(floor, "floor", {-1, -0.5, -1}, {1, 0, 1});
  SimulationParams params = moving(duration, 0.01);
  params.support_friction = mu;
  params.newton_accuracy = 1e-8;
  const fabric::Card card = shirting();
  const double gap = params.support_reach - card.areal_density * params.gravity / params.contact_stiffness;
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, card, [&](double u, double v) { return Vector3d(u + 0.1, gap, -v - 0.2); });
  const auto pose = [&](double t) { return BodyPose{Eigen::Quaterniond(Eigen::AngleAxisd(end * smooth(t / duration), Vector3d::UnitZ())), Vector3d::Zero()}; };
  const auto result = run(g, floor, params, table("floor", duration, 0.02, pose));
  EXPECT_TRUE(result) << to_string(result.issues().front());
  EXPECT_EQ(result->report.support_intersections + result->report.inside, 0);
  double way = 0;
  for (Eigen::Index v = 0; v < g.x.rows(); ++v) {
    const Vector3d back = pose(duration).rotation.conjugate() * Vector3d(result->garment.x.row(v).transpose());
    way += std::abs(back.x() - g.x(v, 0)) / static_cast<double>(g.x.rows());
  }
  return way;
}

TEST(MovingSupport, ASlopeTurnedSlowlySlipsAtItsCoefficient) {
  EXPECT_LT(slid(0.97), 3e-5);
  EXPECT_GT(slid(1.1), 2e-3);
}

TEST(MovingSupport, TheSameInAFrameThatMovesEvenly) {
  // A sheet over the edge of a box, held on one side; once at rest in space, once all of it turned by an angle and going along with a velocity.
  const double duration = 0.15;
  const Vector3d velocity(1.5, 0.4, -2);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));
  std::array<GarmentMesh, 2> end;
  for (const int k : {0, 1}) {
    const Eigen::Quaterniond q = k ? turn : Eigen::Quaterniond::Identity();
    const Vector3d v0 = k ? velocity : Vector3d::Zero();
    GarmentMesh g = fixtures::sheet(8, 8, 0.12, 0.12, shirting(), [&](double u, double v) { return q * Vector3d(u - 0.05, 0.0025, v - 0.06); });
    int c = 0;
    for (const char* name : {"vx", "vy", "vz"}) {
      mesh::Column column;
      column.reals.assign(static_cast<std::size_t>(g.x.rows()), v0[c++]);
      g.vertex_columns[name] = column;
    }
    mesh::SupportMesh box;
    add_box(box, "box", {-0.1, -0.05, -0.1}, {0.02, 0, 0.1});
    for (Eigen::Index i = 0; i < box.x.rows(); ++i) box.x.row(i) = (q * Vector3d(box.x.row(i).transpose())).transpose();
    SimulationParams params = moving(duration, 0.005);
    params.newton_iterations = 40;
    params.newton_accuracy = 1e-9;
    const Vector3d down = q * -Vector3d::UnitY();
    params.gravity_direction = {down.x(), down.y(), down.z()};
    params.constraints = {held_by("sheet.left", "box")};
    const auto result = run(g, box, params, table("box", duration, 0.05, [&](double t) { return BodyPose{Eigen::Quaterniond::Identity(), t * v0}; }));
    ASSERT_TRUE(result) << to_string(result.issues().front());
    EXPECT_EQ(result->report.rejected_steps, 0);
    EXPECT_EQ(result->report.support_intersections + result->report.inside, 0);
    end[static_cast<std::size_t>(k)] = result->garment;
  }
  const double fallen = -end[0].x.col(1).minCoeff();
  EXPECT_GT(fallen, 0.01);
  double farthest = 0;
  for (Eigen::Index i = 0; i < end[0].x.rows(); ++i) {
    const Vector3d expected = turn * Vector3d(end[0].x.row(i).transpose()) + duration * velocity;
    farthest = std::max(farthest, (expected - end[1].x.row(i).transpose()).norm());
  }
  EXPECT_LT(farthest, 2e-5);
}

TEST(MovingSupport, ABodyFeelsWhatHangsOnItAndLiesOnIt) {
  // A strip hangs from the end of an arm that does not move; a square lies on a table that goes up and comes to rest.
  const fabric::Card card = shirting();
  {
    const GarmentMesh g = fixtures::sheet(2, 6, 0.04, 0.12, card, [](double u, double v) { return Vector3d(u + 0.5, v - 0.12, 0); });
    SimulationParams params = moving(0.3, 0.01);
    params.damping_mass = 20;
    params.constraints = {held_by("sheet.top", "arm")};
    const auto result = run(g, std::nullopt, params, table("arm", 0.3, 0.1, [](double) { return BodyPose{}; }));
    ASSERT_TRUE(result) << to_string(result.issues().front());
    const double weight = card.areal_density * 0.04 * 0.12 * 9.81;
    ASSERT_EQ(result->report.bodies.size(), 1u);
    EXPECT_NEAR(result->report.bodies[0].force.y(), -weight, 0.01 * weight);
    EXPECT_NEAR(result->report.bodies[0].moment.z(), -0.52 * weight, 0.01 * 0.52 * weight);
  }
  mesh::SupportMesh table_top;
  add_box(table_top, "table", {-0.2, -0.1, -0.2}, {0.2, 0, 0.2});
  SimulationParams params = moving(0.5, 0.01);
  const double gap = params.support_reach - card.areal_density * params.gravity / params.contact_stiffness;
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, card, [&](double u, double v) { return Vector3d(u + 0.05, gap, -v - 0.02); });
  params.record = "record.csv";
  const auto pose = [](double t) { return BodyPose{Eigen::Quaterniond::Identity(), Vector3d(0, 0.2 * smooth(std::min(1.0, t / 0.4)), 0)}; };
  const auto result = run(g, table_top, params, table("table", 0.5, 0.02, pose));
  ASSERT_TRUE(result) << to_string(result.issues().front());
  const double weight = card.areal_density * 0.06 * 0.06 * 9.81;
  EXPECT_NEAR(result->garment.x.col(1).minCoeff(), 0.2 + gap, 1e-5);
  EXPECT_NEAR(result->report.bodies[0].force.y(), -weight, 0.02 * weight);
  EXPECT_NEAR(result->report.bodies[0].moment.z(), -0.08 * weight, 0.02 * 0.08 * weight);
  // On the way up it feels weight and acceleration: 0.2 (6 - 12 u)/0.16 m/s2, averaged over steps.
  const std::vector<double> time = test::column(result->record, "time_s"), force = test::column(result->record, "table.force_y_N");
  double impulse = 0;
  for (std::size_t i = 0; i < time.size() && time[i] <= 0.2 + 1e-9; ++i) impulse -= (time[i] - (i > 0 ? time[i - 1] : 0)) * force[i];
  const double mass = weight / 9.81, speed = 0.2 * 1.5 / 0.4;  // greatest, in the middle
  EXPECT_NEAR(impulse, weight * 0.2 + mass * speed, 0.02 * mass * speed);
}

TEST(MovingSupport, SqueezedClothIsReported) {
  mesh::SupportMesh press;
  add_box(press, "below", {-0.2, -0.1, -0.2}, {0.2, 0, 0.2});
  add_box(press, "above", {-0.21, 0.02, -0.21}, {0.21, 0.1, 0.21});
  const GarmentMesh g = fixtures::sheet(4, 4, 0.06, 0.06, shirting(), [](double u, double v) { return Vector3d(u + 0.03, 0.0019, -v); });
  SimulationParams params = moving(0.2, 0.01);
  const auto result = run(g, press, params, table("above", 0.2, 0.02, [](double t) { return BodyPose{Eigen::Quaterniond::Identity(), Vector3d(0, -0.15 * t, 0)}; }));
  ASSERT_TRUE(result) << to_string(result.issues().front());
  ASSERT_EQ(result->findings.size(), 1u);
  EXPECT_EQ(result->findings[0].code, "squeezed");
  EXPECT_EQ(result->findings[0].category, Category::check);
  EXPECT_EQ(result->findings[0].place.item, "panel sheet");
  EXPECT_GT(result->report.rejected_steps, 0);
  EXPECT_EQ(result->report.support_intersections + result->report.intersections + result->report.inside, 0);
  EXPECT_NEAR(result->report.simulated_time, 0.02 / 0.15, 0.01);
}

/// A source that takes every third step back once.
class Hesitant final : public SupportMotion {
 public:
  explicit Hesitant(SupportMotion& source) : source_(source) {}
  const std::vector<std::string>& bodies() const override { return source_.bodies(); }
  Result<SupportState> start(double duration) override { return source_.start(duration); }
  Result<SupportState> advance(double time, double step) override { return source_.advance(time, step); }
  Result<Verdict> finish(bool accepted, const std::vector<BodyWrench>&) override {
    if (accepted && ++count_ % 3 == 0) return Verdict::undone;
    return Verdict::holds;
  }

 private:
  SupportMotion& source_;
  int count_ = 0;
};

TEST(MovingSupport, AStepTakenBackAndRepeatedGivesTheSameBytes) {
  mesh::SupportMesh floor;
  add_box(floor, "floor", {-0.2, -0.1, -0.2}, {0.2, 0, 0.2});
  const GarmentMesh g = fixtures::sheet(6, 6, 0.08, 0.08, shirting(), [](double u, double v) { return Vector3d(u + 0.03, 0.004 + 0.5 * u, -v); });
  SimulationParams params = moving(0.1, 0.005);
  const std::string rows = "time,body,x,y,z,qw,qx,qy,qz\n" + table("floor", 0.1, 0.02, [](double t) { return BodyPose{Eigen::Quaterniond(Eigen::AngleAxisd(t, Vector3d::UnitX())), Vector3d(0, 0.1 * t, 0)}; });
  std::array<mesh::Points3, 2> x;
  for (const int k : {0, 1}) {
    auto motion = table_motion(rows, "", 0);
    ASSERT_TRUE(motion);
    Hesitant hesitant(**motion);
    SimulationHooks hooks;
    hooks.supports = k ? &hesitant : motion->get();
    const auto result = simulate(g, floor, params, hooks);
    ASSERT_TRUE(result);
    x[static_cast<std::size_t>(k)] = result->garment.x;
    EXPECT_EQ(result->report.rejected_steps > 0, k == 1);
  }
  EXPECT_EQ(x[0], x[1]);
}

TEST(MovingSupport, WhatDoesNotFitIsRefused) {
  const GarmentMesh g = fixtures::sheet(2, 2, 0.04, 0.04, shirting(), [](double u, double v) { return Vector3d(u, v + 0.1, 0); });
  mesh::SupportMesh floor;
  add_box(floor, "floor", {-0.2, -0.1, -0.2}, {0.2, 0, 0.2});
  SimulationParams params = moving(0.1, 0.01);
  const auto still = [](double) { return BodyPose{}; };
  const auto code = [&](const Result<SimulationOutcome>& result) { return result ? std::string() : result.issues().front().code; };
  EXPECT_EQ(code(run(g, floor, params, table("flor", 0.1, 0.05, still))), "unknown_body");
  EXPECT_EQ(code(run(g, floor, params, table("floor", 0.05, 0.05, still))), "motion_ends");
  params.constraints = {held_by("sheet.top", "arm")};
  EXPECT_EQ(code(run(g, floor, params, table("floor", 0.1, 0.05, still))), "unknown_body");
  EXPECT_EQ(code(simulate(g, floor, params)), "no_motion");
}

}  // namespace
}  // namespace toile::dynamics
