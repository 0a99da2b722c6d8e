#include "toile/mechanism/linkage.h"

#include "toile/base/text.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <optional>
#include <set>

namespace toile::mechanism {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr double kStep = M_PI / 180;     // of the driver between corrections [rad]
constexpr double kClosure = 1e-12;       // of the drawing's size
constexpr double kSingular = 1e-6;       // conditioning below which the linkage is at a dead point
constexpr int kGround = -1;

struct Joint {
  int a, b;
  Vector2d at;
};

int index_of(const Linkage& linkage, const std::string& name) {
  if (name == "ground") return kGround;
  return static_cast<int>(std::find(linkage.bodies.begin(), linkage.bodies.end(), name) - linkage.bodies.begin());
}

Vector2d turned(double angle, const Vector2d& p) { return {std::cos(angle) * p.x() - std::sin(angle) * p.y(), std::sin(angle) * p.x() + std::cos(angle) * p.y()}; }
Vector2d square_to(const Vector2d& p) { return {-p.y(), p.x()}; }

/// The loop closures and the driver's equation. Unknowns: shift and angle of each body; lengths in units of `size`.
struct System {
  const std::vector<Joint>& joints;
  int driver;
  int bodies;

  VectorXd residual(const VectorXd& q, double angle) const {
    VectorXd r(2 * joints.size() + 1);
    for (std::size_t k = 0; k < joints.size(); ++k) r.segment<2>(2 * static_cast<Eigen::Index>(k)) = point(q, joints[k].a, joints[k].at) - point(q, joints[k].b, joints[k].at);
    r[r.size() - 1] = q[3 * driver + 2] - angle;
    return r;
  }

  MatrixXd jacobian(const VectorXd& q) const {
    MatrixXd j = MatrixXd::Zero(2 * static_cast<Eigen::Index>(joints.size()) + 1, 3 * bodies);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      for (const auto& [body, sign] : {std::pair{joints[k].a, 1.0}, std::pair{joints[k].b, -1.0}}) {
        if (body == kGround) continue;
        const Eigen::Index row = 2 * static_cast<Eigen::Index>(k);
        j.block<2, 2>(row, 3 * body) = sign * Eigen::Matrix2d::Identity();
        j.block<2, 1>(row, 3 * body + 2) = sign * square_to(turned(q[3 * body + 2], joints[k].at));
      }
    }
    j(j.rows() - 1, 3 * driver + 2) = 1;
    return j;
  }

  Vector2d point(const VectorXd& q, int body, const Vector2d& at) const { return body == kGround ? at : Vector2d(q.segment<2>(3 * body) + turned(q[3 * body + 2], at)); }
};

double degrees(double angle) { return angle * 180 / M_PI; }

}  // namespace

Vector2d moved(const Pose& pose, const Vector2d& point) { return pose.shift + turned(pose.angle, point); }

Issues validate(const Linkage& linkage) {
  Issues issues = toile::validate<Linkage>(linkage);
  std::set<std::string> known{"ground"};
  for (const std::string& body : linkage.bodies) {
    if (!known.insert(body).second) issues.push_back(Issue{"duplicate", {.item = "bodies"}, fmt::format("'{}' is named twice, or is the ground", body), "give each moving body a name of its own"});
  }
  const std::vector<std::string> names(known.begin(), known.end());
  const auto check = [&](const std::string& name, const std::string& item) {
    if (known.count(name)) return;
    issues.push_back(Issue{"unknown_body", {.item = item}, fmt::format("there is no body '{}'", name), suggestion(name, names)});
  };
  std::set<std::string> jointed;
  for (std::size_t i = 0; i < linkage.pivots.size(); ++i) {
    for (const std::string& body : linkage.pivots[i].bodies) {
      check(body, fmt::format("pivots[{}]", i));
      jointed.insert(body);
    }
  }
  for (const std::string& body : linkage.bodies) {
    if (!jointed.count(body)) issues.push_back(Issue{"loose_body", {.item = "bodies"}, fmt::format("no pivot holds '{}'", body), "join it to another body"});
  }
  check(linkage.driver, "driver");
  if (linkage.driver == "ground") issues.push_back(Issue{"unknown_body", {.item = "driver"}, "the ground does not move", "name a body that a motor turns"});
  for (std::size_t i = 0; i < linkage.bars.size(); ++i) {
    check(linkage.bars[i].body, fmt::format("bars[{}]", i));
    if (linkage.bars[i].points.size() < 2) issues.push_back(Issue{"bad_range", {.item = fmt::format("bars[{}].points", i)}, "a bar needs two points at least", "give them as [forward, up]"});
  }
  std::set<std::string> bows;
  for (std::size_t i = 0; i < linkage.bows.size(); ++i) {
    check(linkage.bows[i].body, fmt::format("bows[{}]", i));
    if (!bows.insert(linkage.bows[i].name).second) issues.push_back(Issue{"duplicate", {.item = fmt::format("bows[{}]", i)}, fmt::format("a bow '{}' is there already", linkage.bows[i].name), "give each bow a name of its own"});
  }
  for (std::size_t i = 0; i < linkage.masses.size(); ++i) check(linkage.masses[i].body, fmt::format("masses[{}]", i));
  const int freedoms = 3 * static_cast<int>(linkage.bodies.size()) - 2 * static_cast<int>(linkage.pivots.size());
  if (issues.empty() && freedoms != 1) {
    issues.push_back(Issue{"not_one_freedom", {.item = "pivots"}, fmt::format("{} bodies with {} pivots have {} degrees of freedom, not one", linkage.bodies.size(), linkage.pivots.size(), freedoms),
                           freedoms > 1 ? "add pivots, or links that hold the loose bodies" : "take away pivots, or give them a body between"});
  }
  return issues;
}

struct Walk::State {
  std::string driver;
  Vector2d middle = Vector2d::Zero();
  double size = 1;
  std::vector<Joint> joints;
  int driver_index = 0, bodies = 0;
  VectorXd drive, q, rate;
  double at = 0, conditioning = 0;

  System system() const { return {joints, driver_index, bodies}; }

  /// Rates and conditioning at q; false at a dead point.
  bool look() {
    const MatrixXd j = system().jacobian(q);
    const Eigen::JacobiSVD<MatrixXd> svd(j);
    const auto& s = svd.singularValues();
    conditioning = s[s.size() - 1] / s[0];
    if (!(conditioning > kSingular)) return false;
    rate = j.partialPivLu().solve(drive);
    return true;
  }

  Issue dead(double wanted) const {
    return {"dead_point", {.item = driver}, fmt::format("the linkage locks or branches at {:.1f} deg of its driver, on the way to {:.1f} deg", degrees(at), degrees(wanted)),
            "shorten the motion, or move the pivots so that no three of a loop come into line"};
  }
};

Walk::Walk(std::unique_ptr<State> state) : state_(std::move(state)) {}
Walk::Walk(const Walk& other) : state_(std::make_unique<State>(*other.state_)) {}
Walk& Walk::operator=(const Walk& other) {
  *state_ = *other.state_;
  return *this;
}
Walk::Walk(Walk&&) noexcept = default;
Walk& Walk::operator=(Walk&&) noexcept = default;
Walk::~Walk() = default;

Result<Walk> Walk::begin(const Linkage& linkage) {
  if (Issues issues = validate(linkage); !issues.empty()) return issues;
  auto state = std::make_unique<State>();
  // About the middle of the pivots and in units of their extent, so that the figures do not depend on where the car stands.
  Vector2d low = Vector2d::Constant(1e300), high = -low;
  for (const Pivot& pivot : linkage.pivots) {
    const Vector2d p(pivot.at[0], pivot.at[1]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  state->driver = linkage.driver;
  state->middle = 0.5 * (low + high);
  state->size = std::max((high - low).norm(), 1e-6);
  for (const Pivot& pivot : linkage.pivots) {
    state->joints.push_back({index_of(linkage, pivot.bodies[0]), index_of(linkage, pivot.bodies[1]), (Vector2d(pivot.at[0], pivot.at[1]) - state->middle) / state->size});
  }
  state->bodies = static_cast<int>(linkage.bodies.size());
  state->driver_index = index_of(linkage, linkage.driver);
  state->drive = VectorXd::Zero(3 * state->bodies);
  state->drive[3 * state->bodies - 1] = 1;  // as many equations as unknowns
  state->q = VectorXd::Zero(3 * state->bodies);
  if (!state->look()) return state->dead(0);
  return Walk(std::move(state));
}

Result<Configuration> Walk::to(double wanted) {
  State& s = *state_;
  const System system = s.system();
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(wanted - s.at) / kStep)));
  const double start = s.at;
  for (int i = 1; i <= steps; ++i) {
    const double next = i == steps ? wanted : start + (wanted - start) * i / steps;
    VectorXd trial = s.q + (next - s.at) * s.rate;
    bool closed = false;
    for (int round = 0; round < 20 && !closed; ++round) {
      const VectorXd r = system.residual(trial, next);
      closed = r.cwiseAbs().maxCoeff() <= kClosure;
      if (!closed) trial -= system.jacobian(trial).partialPivLu().solve(r);
      if (!trial.allFinite()) break;
    }
    // A correction that is large beside the step has gone over to another branch.
    const double step = std::max(1e-9, std::abs(next - s.at)) * std::max(1.0, s.rate.norm());
    if (!closed || (trial - s.q).norm() > 3 * step + 1e-9) return s.dead(wanted);
    const State before = s;
    s.q = trial;
    s.at = next;
    if (!s.look()) {
      const Issue dead = s.dead(wanted);
      s = before;
      return dead;
    }
  }
  // The closure equations twice derived: J q'' = - J' q'.
  VectorXd bend = VectorXd::Zero(s.drive.size());
  for (std::size_t k = 0; k < s.joints.size(); ++k) {
    for (const auto& [body, sign] : {std::pair{s.joints[k].a, 1.0}, std::pair{s.joints[k].b, -1.0}}) {
      if (body == kGround) continue;
      const double turn = s.rate[3 * body + 2];
      bend.segment<2>(2 * static_cast<Eigen::Index>(k)) += sign * turn * turn * turned(s.q[3 * body + 2], s.joints[k].at);
    }
  }
  const VectorXd curvature = system.jacobian(s.q).partialPivLu().solve(bend);
  Configuration c;
  c.driver = wanted;
  c.conditioning = s.conditioning;
  c.closure = s.size * system.residual(s.q, wanted).head(2 * static_cast<Eigen::Index>(s.joints.size())).cwiseAbs().maxCoeff();
  for (int b = 0; b < s.bodies; ++b) {
    Pose pose, change, bent;
    pose.angle = s.q[3 * b + 2];
    change.angle = s.rate[3 * b + 2];
    bent.angle = curvature[3 * b + 2];
    // p = middle + size p'; middle + size (s + R p') = (middle + size s - R middle) + R p
    const Vector2d arm = turned(pose.angle, s.middle);
    pose.shift = s.middle + s.size * s.q.segment<2>(3 * b) - arm;
    change.shift = s.size * s.rate.segment<2>(3 * b) - change.angle * square_to(arm);
    bent.shift = s.size * curvature.segment<2>(3 * b) - bent.angle * square_to(arm) + change.angle * change.angle * arm;
    c.poses.push_back(pose);
    c.rates.push_back(change);
    c.curvatures.push_back(bent);
  }
  return c;
}

Result<std::vector<Configuration>> follow(const Linkage& linkage, const std::vector<double>& angles) {
  auto walk = Walk::begin(linkage);
  if (!walk) return walk.issues();
  std::vector<Configuration> result;
  for (const double wanted : angles) {
    auto c = walk->to(wanted);
    if (!c) return c.issues();
    result.push_back(std::move(*c));
  }
  return result;
}

}  // namespace toile::mechanism
