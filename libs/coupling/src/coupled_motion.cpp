#include "toile/coupling/coupled_simulation.h"

#include "toile/base/text.h"
#include "toile/coupling/session.h"

#include <algorithm>
#include <cmath>

namespace toile::coupling {
namespace {

constexpr double same_time = 1e-9;  // [s]

using dynamics::SupportState;

SupportState state_of(double time, const std::vector<BodyState>& states, const std::vector<std::size_t>& which) {
  SupportState result;
  result.time = time;
  for (const std::size_t b : which) {
    const BodyState& s = states[b];
    dynamics::BodyPose pose;
    pose.rotation = Eigen::Quaterniond(s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
    pose.shift = Eigen::Vector3d(s.shift.data());
    result.poses.push_back(pose);
    result.twists.push_back({Eigen::Vector3d(s.velocity.data()), Eigen::Vector3d(s.spin.data())});
  }
  return result;
}

class CoupledMotion final : public dynamics::SupportMotion {
 public:
  CoupledMotion(Cloth cloth, CoupledOptions options) : cloth_(std::move(cloth)), options_(std::move(options)), start_(cloth_.hello().start) {
    const std::vector<std::string>& names = cloth_.hello().bodies;
    for (std::size_t b = 0; b < names.size(); ++b) {
      if (std::find(options_.known.begin(), options_.known.end(), names[b]) == options_.known.end()) continue;
      bodies_.push_back(names[b]);
      which_.push_back(b);
    }
  }

  ~CoupledMotion() override {
    if (!over_) cloth_.fail({"simulation_ended", {}, "the simulation ended before the motion did", "see what toile-simulate wrote"});
  }

  const std::vector<std::string>& bodies() const override { return bodies_; }

  Result<SupportState> start(double duration) override {
    const Hello& hello = cloth_.hello();
    duration_ = duration;
    if (std::abs(hello.end - hello.start - duration) > same_time) {
      return failed({"other_duration", {.item = "duration"}, fmt::format("the simulation lasts {:g} s, the mechanism moves for {:g} s", duration, hello.end - hello.start), "give the same time to both"});
    }
    Welcome welcome;
    welcome.program = "toile-simulate";
    welcome.bodies = bodies_;
    welcome.longest_step = options_.longest_step;
    welcome.wrenches.resize(hello.bodies.size());
    if (Issues issues = cloth_.welcome(welcome); !issues.empty()) return ended(issues);
    return state_of(0, hello.states, which_);
  }

  Result<SupportState> advance(double time, double step) override {
    if (given_up_) {
      given_up_ = false;
      if (Issues issues = cloth_.refuse("the cloth can not follow so far in one step", step); !issues.empty()) return ended(issues);
    }
    while (true) {
      const auto order = cloth_.next();
      if (!order) return ended(order.issues());
      if (std::holds_alternative<End>(*order)) {
        (void)cloth_.bye();
        return ended({Issue{"motion_ends", {.item = "couple"}, fmt::format("the mechanism ended at {:g} s, the simulation lasts {:g} s", time, duration_), "give the same time to both"}});
      }
      const Step& asked = std::get<Step>(*order);
      const double to = asked.to - start_;
      if (to <= time + step + same_time) {
        reached_ = to;
        return state_of(to, asked.states, which_);
      }
      if (Issues issues = cloth_.refuse("the step is longer than the simulation's time_step", step); !issues.empty()) return ended(issues);
    }
  }

  Result<Verdict> finish(bool accepted, const std::vector<dynamics::BodyWrench>& wrenches) override {
    if (!accepted) {
      // How long the next one may be is known when it is asked for.
      given_up_ = true;
      return Verdict::holds;
    }
    std::vector<Wrench> told(cloth_.hello().bodies.size());
    for (std::size_t k = 0; k < wrenches.size(); ++k) {
      const dynamics::BodyWrench& w = wrenches[k];
      told[which_[k]] = {{w.force.x(), w.force.y(), w.force.z()}, {w.torque.x(), w.torque.y(), w.torque.z()}};
    }
    if (Issues issues = cloth_.reached(told); !issues.empty()) return ended(issues);
    const auto order = cloth_.next();
    if (!order) return ended(order.issues());
    const bool holds = std::holds_alternative<Cloth::Accepted>(*order);
    if (Issues issues = cloth_.done(); !issues.empty()) return ended(issues);
    if (!holds) return Verdict::undone;
    if (reached_ >= duration_ - same_time) {
      const auto last = cloth_.next();
      if (!last) return ended(last.issues());
      if (!std::holds_alternative<End>(*last)) {
        return failed({"out_of_turn", {.item = "couple"}, "the mechanism wants to go on beyond its end", "see docs/coupling.md"});
      }
      if (Issues issues = cloth_.bye(); !issues.empty()) return ended(issues);
      over_ = true;
    }
    return Verdict::holds;
  }

 private:
  /// The other side knows already.
  Issues ended(Issues issues) {
    over_ = true;
    return issues;
  }
  Issue failed(Issue issue) {
    cloth_.fail(issue);
    over_ = true;
    return issue;
  }

  Cloth cloth_;
  CoupledOptions options_;
  std::vector<std::string> bodies_;
  std::vector<std::size_t> which_;  // of the master's bodies, those that are known here
  double start_, duration_ = 0, reached_ = 0;
  bool given_up_ = false, over_ = false;
};

}  // namespace

Result<std::unique_ptr<dynamics::SupportMotion>> coupled_motion(Channel channel, const CoupledOptions& coupled) {
  channel.set_interrupted(coupled.interrupted);
  auto cloth = Cloth::meet(std::move(channel));
  if (!cloth) return cloth.issues();
  const Hello& hello = cloth->hello();
  std::optional<Issue> wrong;
  if (!coupled.model.empty() && !hello.model.empty() && coupled.model != hello.model) {
    wrong = Issue{"other_model", {.item = "couple"}, "the mechanism moves another linkage than the one that the support was made from", "make the support again (toile-mechanism), or start the mechanism with the same file"};
  } else if (std::none_of(coupled.known.begin(), coupled.known.end(), [&](const std::string& r) { return std::find(hello.bodies.begin(), hello.bodies.end(), r) != hello.bodies.end(); })) {
    wrong = Issue{"unknown_body", {.item = "couple"}, "no body of the mechanism is a region of the support, or holds cloth", coupled.known.empty() ? "take the support that toile-mechanism writes" : suggestion(hello.bodies.front(), coupled.known)};
  }
  if (wrong) {
    cloth->fail(*wrong);
    return *wrong;
  }
  return std::unique_ptr<dynamics::SupportMotion>(std::make_unique<CoupledMotion>(std::move(*cloth), coupled));
}

Result<std::unique_ptr<dynamics::SupportMotion>> coupled_motion(const ChannelOptions& options, const CoupledOptions& coupled) {
  auto channel = Channel::listen(options);
  if (!channel) return channel.issues();
  return coupled_motion(std::move(*channel), coupled);
}

Result<std::unique_ptr<dynamics::SupportMotion>> coupled_support(const CoupledSimulationParams& params, const std::optional<mesh::SupportMesh>& support, std::function<bool()> interrupted) {
  CoupledOptions options;
  options.longest_step = params.time_step;
  options.interrupted = std::move(interrupted);
  if (support) {
    options.known = support->region_names;
    for (const mesh::RouteEntry& entry : support->route) {
      const auto linkage = entry.inputs.find("linkage");
      if (entry.stage == "toile-mechanism" && linkage != entry.inputs.end()) options.model = linkage->second;
    }
  }
  for (const dynamics::ConstraintSpec& c : params.constraints) {
    if (!c.body.empty()) options.known.push_back(c.body);
  }
  return coupled_motion(*params.couple, options);
}

}  // namespace toile::coupling
