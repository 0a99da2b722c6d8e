#include "toile/coupling/messages.h"

#include "toile/base/text.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace toile::coupling {
namespace {

using Json = nlohmann::json;

constexpr double unit_length = 1e-9;
constexpr const char* remedy = "see docs/coupling.md for what each message holds";

std::string quoted(const std::string& text) { return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string number(double value) {
  TOILE_CHECK(std::isfinite(value), "a message with {}", value);
  return format_number(value);
}

/// Writes the members of an object one after the other.
class Writer {
 public:
  explicit Writer(const char* name) : text_(fmt::format("{{\"message\":\"{}\"", name)) {}
  Writer& raw(const char* key, const std::string& value) {
    text_ += fmt::format(",\"{}\":{}", key, value);
    return *this;
  }
  Writer& text(const char* key, const std::string& value) { return raw(key, quoted(value)); }
  Writer& real(const char* key, double value) { return raw(key, number(value)); }
  Writer& integer(const char* key, long long value) { return raw(key, fmt::format("{}", value)); }
  Writer& texts(const char* key, const std::vector<std::string>& values) {
    return list(key, values, [](const std::string& v) { return quoted(v); });
  }
  Writer& reals(const char* key, const std::vector<double>& values) { return list(key, values, number); }
  Writer& states(const std::vector<BodyState>& values) {
    return list("states", values, [](const BodyState& s) { return row({s.shift.begin(), s.shift.end()}, {s.rotation.begin(), s.rotation.end()}, {s.velocity.begin(), s.velocity.end()}, {s.spin.begin(), s.spin.end()}); });
  }
  Writer& wrenches(const std::vector<Wrench>& values) {
    return list("wrenches", values, [](const Wrench& w) { return row({w.force.begin(), w.force.end()}, {w.torque.begin(), w.torque.end()}, {}, {}); });
  }
  std::string done() { return text_ + "}"; }

 private:
  static std::string row(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& c, const std::vector<double>& d) {
    std::string text = "[";
    for (const auto* part : {&a, &b, &c, &d}) {
      for (double v : *part) text += (text.size() > 1 ? "," : "") + number(v);
    }
    return text + "]";
  }
  template <class T, class F>
  Writer& list(const char* key, const std::vector<T>& values, F one) {
    std::string text = "[";
    for (const T& v : values) text += (text.size() > 1 ? "," : "") + one(v);
    return raw(key, text + "]");
  }
  std::string text_;
};

/// Takes members out of an object and remembers what was wrong with them.
class Reader {
 public:
  explicit Reader(const Json& object) : object_(object) {}

  void text(const char* key, std::string& to) {
    if (const Json* v = member(key)) v->is_string() ? void(to = v->get<std::string>()) : wrong(key, "text");
  }
  void real(const char* key, double& to) {
    if (const Json* v = member(key)) real(*v, key, to);
  }
  void integer(const char* key, long long& to) {
    const Json* v = member(key);
    if (!v) return;
    if (!v->is_number_integer() || (v->is_number_unsigned() && v->get<std::uint64_t>() > 9'007'199'254'740'992u)) return wrong(key, "a whole number");
    to = v->get<long long>();
  }
  void texts(const char* key, std::vector<std::string>& to) {
    each(key, [&](const Json& v) {
      if (!v.is_string()) return wrong(key, "a list of texts");
      to.push_back(v.get<std::string>());
    });
  }
  void reals(const char* key, std::vector<double>& to) {
    each(key, [&](const Json& v) { real(v, key, to.emplace_back()); });
  }
  void states(std::vector<BodyState>& to) {
    each("states", [&](const Json& v) {
      BodyState& s = to.emplace_back();
      if (!row(v, "states", {{s.shift.data(), 3}, {s.rotation.data(), 4}, {s.velocity.data(), 3}, {s.spin.data(), 3}})) return;
      double square = 0;
      for (double q : s.rotation) square += q * q;
      if (!(std::abs(std::sqrt(square) - 1) <= unit_length)) issue("states", fmt::format("the rotation of body {} is no unit quaternion (length {:.6g})", to.size() - 1, std::sqrt(square)));
    });
  }
  void wrenches(std::vector<Wrench>& to) {
    each("wrenches", [&](const Json& v) {
      Wrench& w = to.emplace_back();
      row(v, "wrenches", {{w.force.data(), 3}, {w.torque.data(), 3}});
    });
  }
  void issue(const std::string& key, std::string what) { issues_.push_back(Issue{"bad_message", {.item = key}, std::move(what), remedy}); }
  /// What nobody asked for is an error too: a misspelt key would be lost otherwise.
  Issues done() {
    known_.emplace_back("message");
    for (const auto& [key, value] : object_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) issue(key.substr(0, 40), "the message has no such key");
    }
    return issues_;
  }

 private:
  struct Part {
    double* to;
    int count;
  };
  const Json* member(const char* key) {
    known_.emplace_back(key);
    const auto it = object_.find(key);
    if (it != object_.end()) return &*it;
    issue(key, "the key is missing");
    return nullptr;
  }
  void wrong(const char* key, const char* wanted) { issue(key, fmt::format("is not {}", wanted)); }
  void real(const Json& v, const char* key, double& to) {
    if (!v.is_number() || !std::isfinite(v.get<double>())) return wrong(key, "a number");
    to = v.get<double>();
  }
  template <class F>
  void each(const char* key, F one) {
    const Json* v = member(key);
    if (!v) return;
    if (!v->is_array()) return wrong(key, "a list");
    for (const Json& item : *v) {
      one(item);
      if (issues_.size() > 20) return;
    }
  }
  bool row(const Json& v, const char* key, std::initializer_list<Part> parts) {
    std::size_t count = 0, at = 0;
    for (const Part& part : parts) count += static_cast<std::size_t>(part.count);
    if (!v.is_array() || v.size() != count) {
      issue(key, fmt::format("a row is not {} numbers", count));
      return false;
    }
    const std::size_t before = issues_.size();
    for (const Part& part : parts) {
      for (int k = 0; k < part.count; ++k) real(v[at++], key, part.to[k]);
    }
    return issues_.size() == before;
  }

  const Json& object_;
  std::vector<std::string> known_;
  Issues issues_;
};

Result<Message> finish(Reader& reader, Message message) {
  Issues issues = reader.done();
  if (!issues.empty()) return issues;
  return message;
}

template <class T>
Result<Message> numbered(Reader& reader, T message) {
  reader.integer("number", message.number);
  return finish(reader, message);
}

}  // namespace

const char* name_of(const Message& message) {
  constexpr std::array names{"hello", "welcome", "step", "reached", "refused", "accept", "reject", "done", "end", "bye", "failure"};
  static_assert(names.size() == std::variant_size_v<Message>);
  return names[message.index()];
}

std::string encode(const Message& message) {
  Writer w(name_of(message));
  if (const auto* m = std::get_if<Hello>(&message)) {
    w.integer("version", m->version).text("program", m->program).text("units", "m kg s rad").texts("bodies", m->bodies);
    w.reals("masses", m->masses).text("model", m->model).real("start", m->start).real("end", m->end);
    w.text("steps", m->steps == Steps::fixed ? "fixed" : "variable").real("time_step", m->time_step).states(m->states);
  } else if (const auto* m = std::get_if<Welcome>(&message)) {
    w.integer("version", m->version).text("program", m->program).texts("bodies", m->bodies).real("longest_step", m->longest_step).wrenches(m->wrenches);
  } else if (const auto* m = std::get_if<Step>(&message)) {
    w.integer("number", m->number).real("from", m->from).real("to", m->to).states(m->states);
  } else if (const auto* m = std::get_if<Reached>(&message)) {
    w.integer("number", m->number).wrenches(m->wrenches);
  } else if (const auto* m = std::get_if<Refused>(&message)) {
    w.integer("number", m->number).text("why", m->why).real("longest", m->longest);
  } else if (const auto* m = std::get_if<Accept>(&message)) {
    w.integer("number", m->number);
  } else if (const auto* m = std::get_if<Reject>(&message)) {
    w.integer("number", m->number);
  } else if (const auto* m = std::get_if<Done>(&message)) {
    w.integer("number", m->number);
  } else if (const auto* m = std::get_if<End>(&message)) {
    w.real("time", m->time);
  } else if (const auto* m = std::get_if<Failure>(&message)) {
    w.text("code", m->code).text("what", m->what).text("remedy", m->remedy);
  }
  return w.done();
}

Result<Message> decode(std::string_view text) {
  const auto bad = [](std::string what) { return Issue{"bad_message", {}, std::move(what), remedy}; };
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) return bad("the message is no JSON object");
  const auto it = json.find("message");
  if (it == json.end() || !it->is_string()) return bad("the message does not say its name under 'message'");
  const std::string name = it->get<std::string>();
  Reader r(json);
  if (name == "hello" || name == "welcome") {
    // Of another version nothing else need be as we know it.
    long long version = 0;
    r.integer("version", version);
    if (version != protocol_version && version >= 0 && version < 1'000'000) {
      if (name == "hello") {
        Hello m;
        m.version = static_cast<int>(version);
        return Message(m);
      }
      Welcome m;
      m.version = static_cast<int>(version);
      return Message(m);
    }
    if (version != protocol_version) r.issue("version", "is no version");
  }
  if (name == "hello") {
    Hello m;
    std::string units, steps;
    r.text("program", m.program);
    r.text("units", units);
    r.texts("bodies", m.bodies);
    r.reals("masses", m.masses);
    r.text("model", m.model);
    r.real("start", m.start);
    r.real("end", m.end);
    r.text("steps", steps);
    r.real("time_step", m.time_step);
    r.states(m.states);
    if (units != "m kg s rad") r.issue("units", "only 'm kg s rad' is spoken");
    if (steps != "fixed" && steps != "variable") r.issue("steps", "is neither fixed nor variable");
    m.steps = steps == "fixed" ? Steps::fixed : Steps::variable;
    if (m.bodies.empty()) r.issue("bodies", "there is no body");
    std::vector<std::string> sorted = m.bodies;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) r.issue("bodies", "a body is named twice");
    if (m.states.size() != m.bodies.size()) r.issue("states", fmt::format("there are {} states of {} bodies", m.states.size(), m.bodies.size()));
    if (!m.masses.empty() && m.masses.size() != m.bodies.size()) r.issue("masses", fmt::format("there are {} masses of {} bodies", m.masses.size(), m.bodies.size()));
    if (!(m.end > m.start)) r.issue("end", "is not after the start");
    if (!(m.time_step > 0)) r.issue("time_step", "is not positive");
    return finish(r, m);
  }
  if (name == "welcome") {
    Welcome m;
    r.text("program", m.program);
    r.texts("bodies", m.bodies);
    r.real("longest_step", m.longest_step);
    r.wrenches(m.wrenches);
    return finish(r, m);
  }
  if (name == "step") {
    Step m;
    r.integer("number", m.number);
    r.real("from", m.from);
    r.real("to", m.to);
    r.states(m.states);
    if (!(m.to > m.from)) r.issue("to", "is not after 'from'");
    return finish(r, m);
  }
  if (name == "reached") {
    Reached m;
    r.integer("number", m.number);
    r.wrenches(m.wrenches);
    return finish(r, m);
  }
  if (name == "refused") {
    Refused m;
    r.integer("number", m.number);
    r.text("why", m.why);
    r.real("longest", m.longest);
    return finish(r, m);
  }
  if (name == "accept") return numbered(r, Accept{});
  if (name == "reject") return numbered(r, Reject{});
  if (name == "done") return numbered(r, Done{});
  if (name == "end") {
    End m;
    r.real("time", m.time);
    return finish(r, m);
  }
  if (name == "bye") return finish(r, Bye{});
  if (name == "failure") {
    Failure m;
    r.text("code", m.code);
    r.text("what", m.what);
    r.text("remedy", m.remedy);
    return finish(r, m);
  }
  return bad(fmt::format("there is no message '{}'", name.substr(0, 40)));
}

}  // namespace toile::coupling
