#include "toile/coupling/session.h"

#include <algorithm>
#include <cmath>

namespace toile::coupling {
namespace {

Issue out_of_turn(const Message& message, const std::string& instead) {
  return {"out_of_turn", {}, fmt::format("the other program said '{}' where {} was due", name_of(message), instead), "see docs/coupling.md for the order of messages"};
}

Issue other_version(int theirs) {
  return {"other_version", {}, fmt::format("the other program speaks version {} of the protocol, this one {}", theirs, protocol_version), "use programs of the same release"};
}

Failure failure_of(const Issue& issue) { return {issue.code, issue.what, issue.remedy}; }

/// What the other side reports. An empty code or remedy shall not make an issue without one.
Issue reported(const Failure& f) {
  return {f.code.empty() ? "peer_failed" : f.code, {.item = "the other program"}, f.what.empty() ? "it failed and did not say why" : f.what, f.remedy.empty() ? "see what it wrote" : f.remedy};
}

std::string finite(const std::vector<Wrench>& wrenches) {
  for (std::size_t b = 0; b < wrenches.size(); ++b) {
    for (const auto* part : {&wrenches[b].force, &wrenches[b].torque}) {
      for (double v : *part) {
        if (!std::isfinite(v)) return fmt::format("the reaction on body {} is not finite", b);
      }
    }
  }
  return "";
}

}  // namespace

Result<Message> Master::ask(const Message& message) {
  if (Issues issues = channel_.send(encode(message)); !issues.empty()) return issues;
  auto bytes = channel_.receive();
  if (!bytes) {
    fail(bytes.issues().front());
    return bytes.issues();
  }
  auto answer = decode(*bytes);
  if (!answer) {
    fail(answer.issues().front());
    return answer.issues();
  }
  if (const auto* f = std::get_if<Failure>(&*answer)) return reported(*f);
  return answer;
}

Result<Master> Master::greet(Channel channel, const Hello& hello) {
  Master master(std::move(channel), hello);
  auto answer = master.ask(hello);
  if (!answer) return answer.issues();
  const auto reject = [&](Issue issue) {
    master.fail(issue);
    return issue;
  };
  const auto* welcome = std::get_if<Welcome>(&*answer);
  if (!welcome) return reject(out_of_turn(*answer, "'welcome'"));
  if (welcome->version != protocol_version) return reject(other_version(welcome->version));
  if (welcome->wrenches.size() != hello.bodies.size()) {
    return reject({"bad_message", {.item = "wrenches"}, fmt::format("there are {} wrenches of {} bodies", welcome->wrenches.size(), hello.bodies.size()), "see docs/coupling.md"});
  }
  for (const std::string& body : welcome->bodies) {
    if (std::find(hello.bodies.begin(), hello.bodies.end(), body) == hello.bodies.end()) {
      return reject({"bad_message", {.item = "bodies"}, fmt::format("the cloth wants a body '{}' that nobody offered", body.substr(0, 40)), "see docs/coupling.md"});
    }
  }
  master.welcome_ = *welcome;
  return master;
}

Result<std::variant<Reached, Refused>> Master::step(double to, const std::vector<BodyState>& states) {
  TOILE_CHECK(!open_ && to > time_ && states.size() == bodies_, "a step to {} from {} with {} states of {}", to, time_, states.size(), bodies_);
  proposed_ = to;
  auto answer = ask(Step{number_, time_, to, states});
  if (!answer) return answer.issues();
  Issue wrong;
  if (const auto* m = std::get_if<Reached>(&*answer)) {
    if (m->number == number_ && m->wrenches.size() == bodies_) {
      open_ = true;
      return std::variant<Reached, Refused>(*m);
    }
    wrong = {"bad_message", {.item = "reached"}, fmt::format("step {} with {} wrenches where step {} with {} was due", m->number, m->wrenches.size(), number_, bodies_), "see docs/coupling.md"};
  } else if (const auto* m = std::get_if<Refused>(&*answer)) {
    if (m->number == number_) return std::variant<Reached, Refused>(*m);
    wrong = {"bad_message", {.item = "refused"}, fmt::format("step {} where step {} was due", m->number, number_), "see docs/coupling.md"};
  } else {
    wrong = out_of_turn(*answer, "'reached' or 'refused'");
  }
  fail(wrong);
  return wrong;
}

Issues Master::decide(const Message& verdict, double time) {
  TOILE_CHECK(open_, "nothing is there to decide at {} s", time_);
  auto answer = ask(verdict);
  if (!answer) return answer.issues();
  const auto* done = std::get_if<Done>(&*answer);
  if (!done || done->number != number_) {
    const Issue wrong = out_of_turn(*answer, fmt::format("'done' of step {}", number_));
    fail(wrong);
    return {wrong};
  }
  open_ = false;
  time_ = time;
  return {};
}

Issues Master::accept() {
  Issues issues = decide(Accept{number_}, proposed_);
  if (issues.empty()) ++number_;
  return issues;
}

Issues Master::reject() { return decide(Reject{number_}, time_); }

Issues Master::end() {
  auto answer = ask(End{time_});
  if (!answer) return answer.issues();
  if (!std::holds_alternative<Bye>(*answer)) return {out_of_turn(*answer, "'bye'")};
  return {};
}

void Master::fail(const Issue& issue) {
  if (issue.code != "peer_gone" && issue.code != "no_peer") (void)channel_.send(encode(failure_of(issue)));
}

void Cloth::fail(const Issue& issue) {
  if (issue.code != "peer_gone" && issue.code != "no_peer") (void)channel_.send(encode(failure_of(issue)));
}

Issue Cloth::refuse_message(Issue issue) {
  fail(issue);
  return issue;
}

Result<Cloth> Cloth::meet(Channel channel) {
  Cloth cloth(std::move(channel));
  auto bytes = cloth.channel_.receive();
  if (!bytes) return bytes.issues();
  auto message = decode(*bytes);
  if (!message) {
    cloth.fail(message.issues().front());
    return message.issues();
  }
  if (const auto* f = std::get_if<Failure>(&*message)) return reported(*f);
  auto* hello = std::get_if<Hello>(&*message);
  if (!hello) return cloth.refuse_message(out_of_turn(*message, "'hello'"));
  if (hello->version != protocol_version) return cloth.refuse_message(other_version(hello->version));
  cloth.hello_ = std::move(*hello);
  cloth.time_ = cloth.hello_.start;
  return cloth;
}

Issues Cloth::welcome(Welcome welcome) {
  TOILE_CHECK(welcome.wrenches.size() == hello_.bodies.size(), "{} wrenches of {} bodies", welcome.wrenches.size(), hello_.bodies.size());
  return say(welcome);
}

Result<Cloth::Order> Cloth::next() {
  TOILE_CHECK(!(step_ && !reached_) && !decided_, "an answer is due at {} s", time_);
  auto bytes = channel_.receive();
  if (!bytes) {
    fail(bytes.issues().front());
    return bytes.issues();
  }
  auto message = decode(*bytes);
  if (!message) {
    fail(message.issues().front());
    return message.issues();
  }
  if (const auto* f = std::get_if<Failure>(&*message)) return reported(*f);
  const auto wrong_number = [&](long long number) {
    return refuse_message({"bad_message", {.item = "number"}, fmt::format("step {} where step {} was due", number, number_), "see docs/coupling.md"});
  };
  if (reached_) {
    if (const auto* m = std::get_if<Accept>(&*message)) {
      if (m->number != number_) return wrong_number(m->number);
      decided_ = true;
      time_ = step_->to;
      return Order(Accepted{});
    }
    if (const auto* m = std::get_if<Reject>(&*message)) {
      if (m->number != number_) return wrong_number(m->number);
      decided_ = true;
      return Order(Rejected{});
    }
    return refuse_message(out_of_turn(*message, "'accept' or 'reject'"));
  }
  if (auto* m = std::get_if<Step>(&*message)) {
    if (m->number != number_) return wrong_number(m->number);
    if (m->from != time_) return refuse_message({"bad_message", {.item = "from"}, fmt::format("a step from {} s, but the last one that holds ended at {} s", m->from, time_), "see docs/coupling.md"});
    if (m->states.size() != hello_.bodies.size()) {
      return refuse_message({"bad_message", {.item = "states"}, fmt::format("there are {} states of {} bodies", m->states.size(), hello_.bodies.size()), "see docs/coupling.md"});
    }
    step_ = *m;
    return Order(std::move(*m));
  }
  if (const auto* m = std::get_if<End>(&*message)) return Order(*m);
  return refuse_message(out_of_turn(*message, "'step' or 'end'"));
}

Issues Cloth::reached(const std::vector<Wrench>& wrenches) {
  TOILE_CHECK(step_ && !reached_, "no step is due at {} s", time_);
  TOILE_CHECK(wrenches.size() == hello_.bodies.size(), "{} wrenches of {} bodies", wrenches.size(), hello_.bodies.size());
  if (const std::string what = finite(wrenches); !what.empty()) return {refuse_message({"not_finite", {}, what, "take shorter steps"})};
  reached_ = true;
  return say(Reached{number_, wrenches});
}

Issues Cloth::refuse(const std::string& why, double longest) {
  TOILE_CHECK(step_ && !reached_, "no step is due at {} s", time_);
  step_.reset();
  return say(Refused{number_, why, longest});
}

Issues Cloth::done() {
  TOILE_CHECK(decided_, "nothing was decided at {} s", time_);
  const long long number = number_;
  if (time_ == step_->to) ++number_;
  decided_ = reached_ = false;
  step_.reset();
  return say(Done{number});
}

Issues Cloth::bye() { return say(Bye{}); }

}  // namespace toile::coupling
