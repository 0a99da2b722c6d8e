// The two sides of the protocol, step by step: who may say what when. docs/coupling.md tells it.
#pragma once

#include "toile/coupling/channel.h"
#include "toile/coupling/messages.h"

#include <optional>
#include <variant>

namespace toile::coupling {

/// The side of the mechanism: proposes steps, takes or undoes them.
class Master {
 public:
  /// Calls, introduces itself, waits for the answer. Precondition: `hello` is a valid message.
  /// error  those of Channel; "bad_message" and "out_of_turn"; "other_version"; the failure that the other side reports, under its code
  static Result<Master> greet(Channel channel, const Hello& hello);

  const Welcome& welcome() const { return welcome_; }
  double time() const { return time_; }

  /// Asks the cloth to go on from time() to `to`. What it reached is provisional until accept() or reject(); of a refusal nothing is left,
  /// and another step() may follow.
  Result<std::variant<Reached, Refused>> step(double to, const std::vector<BodyState>& states);
  Issues accept();
  Issues reject();
  /// Ends in order.
  Issues end();
  /// Ends because this side can not go on; tells the other one why.
  void fail(const Issue& issue);

 private:
  Master(Channel channel, const Hello& hello) : channel_(std::move(channel)), bodies_(hello.bodies.size()), time_(hello.start) {}
  Result<Message> ask(const Message& message);
  Issues decide(const Message& verdict, double time);
  Channel channel_;
  Welcome welcome_;
  std::size_t bodies_;
  long long number_ = 1;
  double time_, proposed_ = 0;
  bool open_ = false;  // a step is reached and not decided
};

/// The side of the cloth: does what it is asked to, one step at a time.
class Cloth {
 public:
  /// Waits for a master and its introduction.
  static Result<Cloth> meet(Channel channel);
  const Hello& hello() const { return hello_; }
  /// Precondition: not welcomed yet; a wrench a body.
  Issues welcome(Welcome welcome);

  struct Accepted {};
  struct Rejected {};
  /// What the master says next: a step to do; that the one reached holds, or is to be undone (this side is told first, then answers: done() once it is); the end.
  using Order = std::variant<Step, Accepted, Rejected, End>;
  Result<Order> next();
  /// Answers to a step: one of both.
  Issues reached(const std::vector<Wrench>& wrenches);
  Issues refuse(const std::string& why, double longest);
  /// Answer to Accepted and Rejected.
  Issues done();
  Issues bye();
  void fail(const Issue& issue);
  const std::string& endpoint() const { return channel_.endpoint(); }

 private:
  explicit Cloth(Channel channel) : channel_(std::move(channel)) {}
  Issues say(const Message& message) { return channel_.send(encode(message)); }
  Issue refuse_message(Issue issue);
  Channel channel_;
  Hello hello_;
  long long number_ = 1;
  double time_ = 0;
  std::optional<Step> step_;
  bool reached_ = false, decided_ = false;
};

}  // namespace toile::coupling
