// The protocol between cloth and mechanism: messages as text, peers that behave, and peers that do not.
#include "results.h"
#include "toile/base/rng.h"
#include "toile/coupling/session.h"

#include <gtest/gtest.h>

#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <thread>

using namespace toile;
using namespace toile::coupling;
using test::checked;
using test::codes;

namespace {

constexpr const char* any_port = "tcp://127.0.0.1:*";

ChannelOptions at(const std::string& endpoint, double timeout = 60) {
  ChannelOptions options;
  options.endpoint = endpoint;
  options.timeout = timeout;
  return options;
}

BodyState state(double z) { return {{0, 0.1, z}, {std::cos(z), std::sin(z), 0, 0}, {0, 0, 1}, {2, 0, 0}}; }

Hello hello() {
  Hello h;
  h.program = "test";
  h.bodies = {"main", "rail"};
  h.start = 0;
  h.end = 1;
  h.time_step = 0.01;
  h.states = {state(0), state(0.3)};
  return h;
}

Welcome welcome() {
  Welcome w;
  w.program = "cloth";
  w.bodies = {"rail"};
  w.longest_step = 0.01;
  w.wrenches.resize(2);
  return w;
}

/// A master in a thread of its own, a cloth in this one. timeout  of the master [s]
void meet(const std::function<void(Channel)>& master, const std::function<void(Channel)>& cloth, double timeout = 60) {
  Channel listening = checked(Channel::listen(at(any_port, 60)));
  std::thread thread([&, endpoint = listening.endpoint()] { master(checked(Channel::call(at(endpoint, timeout)))); });
  cloth(std::move(listening));
  thread.join();
}

}  // namespace

TEST(coupling_messages, read_back_to_the_same_bits) {
  Rng rng(7);
  Hello h = hello();
  h.masses = {1.0 / 3, 1e-300};
  h.model = "ab\"\n\xc3\xa4";
  h.steps = Steps::variable;
  for (BodyState& s : h.states) {
    for (double& v : s.shift) v = rng.uniform(-1, 1) * std::exp(rng.uniform(-40, 40));
    for (double& v : s.spin) v = rng.uniform(-1, 1);
  }
  const auto again = std::get<Hello>(checked(decode(encode(h))));
  EXPECT_EQ(again.model, h.model);
  EXPECT_EQ(again.masses, h.masses);
  EXPECT_EQ(again.bodies, h.bodies);
  EXPECT_EQ(again.steps, Steps::variable);
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(again.states[b].shift, h.states[b].shift);
    EXPECT_EQ(again.states[b].rotation, h.states[b].rotation);
    EXPECT_EQ(again.states[b].velocity, h.states[b].velocity);
    EXPECT_EQ(again.states[b].spin, h.states[b].spin);
  }
  const std::vector<Message> all{hello(), welcome(), Step{3, 0.1, 0.2, {state(0.1)}}, Reached{3, {{{1, 2, 3}, {4, 5, 6}}}}, Refused{3, "why", 0.1}, Accept{3}, Reject{4}, Done{5}, End{1}, Bye{}, Failure{"a", "b", "c"}};
  for (const Message& m : all) EXPECT_EQ(encode(checked(decode(encode(m)))), encode(m)) << name_of(m);
  EXPECT_EQ(encode(Step{1, 0, 0.5, {{}}}), R"({"message":"step","number":1,"from":0,"to":0.5,"states":[[0,0,0,1,0,0,0,0,0,0,0,0,0]]})");
}

TEST(coupling_messages, rubbish_is_refused_and_named) {
  const auto what = [](const std::string& text) {
    const auto m = decode(text);
    return m ? std::string() : m.issues().front().place.item + ": " + m.issues().front().what;
  };
  EXPECT_EQ(what(""), ": the message is no JSON object");
  EXPECT_EQ(what("[]"), ": the message is no JSON object");
  EXPECT_EQ(what("{}"), ": the message does not say its name under 'message'");
  EXPECT_EQ(what(R"({"message":"hallo"})"), ": there is no message 'hallo'");
  EXPECT_EQ(what(R"({"message":"accept"})"), "number: the key is missing");
  EXPECT_EQ(what(R"({"message":"accept","number":1.5})"), "number: is not a whole number");
  EXPECT_EQ(what(R"({"message":"accept","number":1,"numbr":2})"), "numbr: the message has no such key");
  EXPECT_EQ(what(R"({"message":"step","number":1,"from":0,"to":0,"states":[]})"), "to: is not after 'from'");
  EXPECT_EQ(what(R"({"message":"step","number":1,"from":0,"to":1,"states":[[0,0,0,2,0,0,0,0,0,0,0,0,0]]})"), "states: the rotation of body 0 is no unit quaternion (length 2)");
  EXPECT_EQ(what(R"({"message":"step","number":1,"from":0,"to":1,"states":[[0,0,0]]})"), "states: a row is not 13 numbers");
  EXPECT_EQ(what(R"({"message":"end","time":1e999})"), ": the message is no JSON object");
  EXPECT_EQ(what(R"({"message":"hello","version":-3})").substr(0, 8), "version:");
  EXPECT_EQ(std::get<Hello>(checked(decode(R"({"message":"hello","version":2,"whatever":[]})"))).version, 2);
  std::string text = encode(hello());
  text.replace(text.find("m kg s rad"), 10, "ft lb s deg");
  EXPECT_EQ(what(text), "units: only 'm kg s rad' is spoken");
}

TEST(coupling_messages, no_mutilation_is_fatal) {
  Rng rng(3);
  const std::vector<std::string> texts{encode(hello()), encode(welcome()), encode(Step{3, 0.1, 0.2, {state(0.1), state(0.2)}}), encode(Reached{3, {{{1, 2, 3}, {4, 5, 6}}}}), encode(Failure{"a", "b", "c"})};
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = texts[static_cast<std::size_t>(rng.below(texts.size()))];
    const int times = 1 + static_cast<int>(rng.below(4));
    for (int k = 0; k < times && !text.empty(); ++k) {
      const std::size_t where = static_cast<std::size_t>(rng.below(text.size()));
      switch (rng.below(4)) {
        case 0: text[where] = static_cast<char>(rng.below(256)); break;
        case 1: text.erase(where, 1 + static_cast<std::size_t>(rng.below(8))); break;
        case 2: text.insert(where, 1, "[]{},:\"-e0"[rng.below(10)]); break;
        default: text.resize(where);
      }
    }
    const auto message = decode(text);
    if (!message) ++refused;
    // What passes is whole.
    else EXPECT_FALSE(encode(*message).empty());
  }
  EXPECT_GT(refused, 10000);
  EXPECT_FALSE(decode(std::string(200000, '[')).has_value());
}

TEST(coupling, steps_are_taken_undone_refused_and_ended) {
  std::vector<std::string> heard;
  meet(
      [&](Channel channel) {
        Master master = checked(Master::greet(std::move(channel), hello()));
        EXPECT_EQ(master.welcome().bodies, std::vector<std::string>{"rail"});
        const std::vector<BodyState> states{state(0.1), state(0.2)};
        auto first = checked(master.step(0.01, states));
        EXPECT_EQ(std::get<Reached>(first).wrenches[1].force[1], -1.0 / 3);
        EXPECT_TRUE(ok(master.reject()));
        EXPECT_EQ(master.time(), 0);
        EXPECT_EQ(std::get<Refused>(checked(master.step(0.01, states))).longest, 0.004);
        EXPECT_TRUE(std::holds_alternative<Reached>(checked(master.step(0.004, states))));
        EXPECT_TRUE(ok(master.accept()));
        EXPECT_EQ(master.time(), 0.004);
        EXPECT_TRUE(std::holds_alternative<Reached>(checked(master.step(0.01, states))));
        EXPECT_TRUE(ok(master.accept()));
        EXPECT_TRUE(ok(master.end()));
      },
      [&](Channel channel) {
        Cloth cloth = checked(Cloth::meet(std::move(channel)));
        EXPECT_EQ(cloth.hello().bodies.size(), 2u);
        EXPECT_EQ(cloth.hello().states[1].rotation, state(0.3).rotation);
        ASSERT_TRUE(ok(cloth.welcome(welcome())));
        for (int i = 0; i < 20; ++i) {
          const auto order = checked(cloth.next());
          if (const auto* step = std::get_if<Step>(&order)) {
            heard.push_back(fmt::format("{} {}-{}", step->number, step->from, step->to));
            if (heard.size() == 3) EXPECT_TRUE(ok(cloth.refuse("the cloth is caught", 0.004)));
            else EXPECT_TRUE(ok(cloth.reached({{}, {{0, -1.0 / 3, 0}, {}}})));
          } else if (std::holds_alternative<End>(order)) {
            EXPECT_TRUE(ok(cloth.bye()));
            break;
          } else {
            heard.push_back(std::holds_alternative<Cloth::Accepted>(order) ? "accepted" : "rejected");
            EXPECT_TRUE(ok(cloth.done()));
          }
        }
      });
  EXPECT_EQ(heard, (std::vector<std::string>{"1 0-0.01", "rejected", "1 0-0.01", "1 0-0.004", "accepted", "2 0.004-0.01", "accepted"}));
}

TEST(coupling, another_version_is_told_to_both) {
  meet(
      [](Channel channel) {
        Hello old = hello();
        old.version = 99;
        EXPECT_EQ(codes(Master::greet(std::move(channel), old)), "other_version");
      },
      [](Channel channel) { EXPECT_EQ(codes(Cloth::meet(std::move(channel))), "other_version"); });
  meet(
      [](Channel channel) { EXPECT_EQ(codes(Master::greet(std::move(channel), hello())), "other_version"); },
      [](Channel channel) {
        (void)channel.receive();
        EXPECT_TRUE(ok(channel.send(R"({"message":"welcome","version":2})")));
        EXPECT_EQ(std::get<Failure>(checked(decode(checked(channel.receive())))).code, "other_version");
      });
}

TEST(coupling, what_is_out_of_turn_ends_the_connection_with_a_reason) {
  const auto cloth_finds = [](const std::string& second) {
    std::string found, told;
    meet(
        [&](Channel channel) {
          EXPECT_TRUE(ok(channel.send(encode(hello()))));
          (void)channel.receive();
          EXPECT_TRUE(ok(channel.send(second)));
          told = std::get<Failure>(checked(decode(checked(channel.receive())))).code;
        },
        [&](Channel channel) {
          Cloth cloth = checked(Cloth::meet(std::move(channel)));
          EXPECT_TRUE(ok(cloth.welcome(welcome())));
          found = codes(cloth.next());
        });
    EXPECT_EQ(told, found);
    return found;
  };
  EXPECT_EQ(cloth_finds(encode(Accept{1})), "out_of_turn");
  EXPECT_EQ(cloth_finds(encode(hello())), "out_of_turn");
  EXPECT_EQ(cloth_finds(encode(Step{2, 0, 0.1, {state(0), state(0)}})), "bad_message");
  EXPECT_EQ(cloth_finds(encode(Step{1, 0.05, 0.1, {state(0), state(0)}})), "bad_message");
  EXPECT_EQ(cloth_finds(encode(Step{1, 0, 0.1, {state(0)}})), "bad_message");
  EXPECT_EQ(cloth_finds("GET / HTTP/1.1"), "bad_message");
  EXPECT_EQ(cloth_finds(std::string("\0\xff\x7f", 3)), "bad_message");
}

TEST(coupling, a_failure_arrives_with_its_reason) {
  meet(
      [](Channel channel) {
        Master master = checked(Master::greet(std::move(channel), hello()));
        const auto answer = master.step(0.1, {state(0), state(0)});
        ASSERT_FALSE(answer);
        EXPECT_EQ(to_string(answer.issues().front()), "the other program: the cloth tore; mend it");
      },
      [](Channel channel) {
        Cloth cloth = checked(Cloth::meet(std::move(channel)));
        EXPECT_TRUE(ok(cloth.welcome(welcome())));
        (void)cloth.next();
        cloth.fail({"torn", {}, "the cloth tore", "mend it"});
      });
}

TEST(coupling, nobody_comes_or_answers) {
  EXPECT_EQ(codes(Cloth::meet(checked(Channel::listen(at(any_port, 0.1))))), "no_peer");
  EXPECT_EQ(codes(Master::greet(checked(Channel::call(at("tcp://127.0.0.1:1", 0.1))), hello())), "no_peer");
  meet([](Channel channel) { EXPECT_EQ(codes(Master::greet(std::move(channel), hello())), "peer_late"); },
       [](Channel channel) {
         (void)channel.receive();
         EXPECT_EQ(std::get<Failure>(checked(decode(checked(channel.receive())))).code, "peer_late");
       },
       0.3);
}

TEST(coupling, a_peer_that_closes_is_noticed_at_once) {
  meet([](Channel channel) { (void)checked(Master::greet(std::move(channel), hello())); },
       [](Channel channel) {
         Cloth cloth = checked(Cloth::meet(std::move(channel)));
         EXPECT_TRUE(ok(cloth.welcome(welcome())));
         EXPECT_EQ(codes(cloth.next()), "peer_gone");
       });
  meet([](Channel channel) { EXPECT_EQ(codes(Master::greet(std::move(channel), hello())), "peer_gone"); }, [](Channel channel) { (void)channel.receive(); });
}

TEST(coupling, a_peer_that_is_killed_is_noticed_at_once) {
  // The child is the master, in a process of its own; it is killed while the cloth waits for it.
  const std::string endpoint = fmt::format("ipc:///tmp/toile-coupling-test-{}", ::getpid());
  const pid_t child = ::fork();
  if (child == 0) {
    auto channel = Channel::call(at(endpoint, 20));
    auto master = Master::greet(std::move(*channel), hello());
    std::raise(SIGKILL);
  }
  {
    Cloth cloth = checked(Cloth::meet(checked(Channel::listen(at(endpoint, 60)))));
    EXPECT_TRUE(ok(cloth.welcome(welcome())));
    EXPECT_EQ(codes(cloth.next()), "peer_gone");
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  ::unlink(endpoint.substr(6).c_str());
}

TEST(coupling, waiting_can_be_interrupted) {
  Channel channel = checked(Channel::listen(at(any_port, 60)));
  channel.set_interrupted([] { return true; });
  const auto cloth = Cloth::meet(std::move(channel));
  ASSERT_FALSE(cloth);
  EXPECT_EQ(cloth.issues().front().category, Category::interrupted);
}

TEST(coupling, only_this_machine_unless_told_otherwise) {
  EXPECT_EQ(codes(Channel::listen(at("tcp://*:7117"))), "bad_endpoint");
  EXPECT_EQ(codes(Channel::call(at("tcp://192.0.2.1:7117"))), "bad_endpoint");
  EXPECT_EQ(codes(Channel::listen(at("nonsense"))), "bad_endpoint");
  ChannelOptions open = at("tcp://0.0.0.0:*");
  open.reach = Reach::network;
  EXPECT_TRUE(Channel::listen(open).has_value());
  const Channel first = checked(Channel::listen(at(any_port)));
  const auto second = Channel::listen(at(first.endpoint()));
  ASSERT_FALSE(second);
  EXPECT_NE(second.issues().front().remedy.find("another port"), std::string::npos);
}
