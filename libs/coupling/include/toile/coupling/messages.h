// What two programs that solve a cloth and its frame together say to each other. One message is one JSON object; docs/coupling.md tells the protocol.
#pragma once

#include "toile/base/result.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace toile::coupling {

constexpr int protocol_version = 1;

/// Where a body is and how it moves: a point p of its drawn position is at q p q* + shift.
struct BodyState {
  std::array<double, 3> shift{0, 0, 0};        ///< [m]
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< unit quaternion (w, x, y, z)
  std::array<double, 3> velocity{0, 0, 0};     ///< of shift [m/s]
  std::array<double, 3> spin{0, 0, 0};         ///< about the world's axes [rad/s]
};

/// What the cloth does to a body: the torque is about the point `shift` of its state. Power: force . velocity + torque . spin.
struct Wrench {
  std::array<double, 3> force{0, 0, 0};   ///< [N]
  std::array<double, 3> torque{0, 0, 0};  ///< [N m]
};

enum class Steps { fixed, variable };

/// Master: who it is and what it is going to move.
struct Hello {
  int version = protocol_version;
  std::string program;
  std::vector<std::string> bodies;    ///< in the order of all states and wrenches
  std::vector<double> masses;         ///< [kg]; as many as bodies, or none where the master does not say
  std::string model;                  ///< content hash of the file that the bodies come from; may be empty
  double start = 0, end = 0;          ///< [s]
  Steps steps = Steps::fixed;         ///< fixed: all are time_step long but the last
  double time_step = 0;               ///< [s]; the first one of variable steps
  std::vector<BodyState> states;      ///< at the start
};
/// Cloth: agreed.
struct Welcome {
  int version = protocol_version;
  std::string program;
  std::vector<std::string> bodies;    ///< those that it knows; the others' states do not matter to it
  double longest_step = 0;            ///< longer ones are refused; 0: none is too long [s]
  std::vector<Wrench> wrenches;       ///< at the start
};
/// Master: go on to a time, at which the bodies are so.
struct Step {
  long long number = 0;  ///< from 1; the same again after a reject
  double from = 0, to = 0;
  std::vector<BodyState> states;
};
/// Cloth: it is there, provisionally.
struct Reached {
  long long number = 0;
  std::vector<Wrench> wrenches;
};
/// Cloth: not that way; it is back at the step's beginning.
struct Refused {
  long long number = 0;
  std::string why;
  double longest = 0;  ///< a step that may do [s]; 0: none will
};
/// Master: the step holds, or is undone.
struct Accept {
  long long number = 0;
};
struct Reject {
  long long number = 0;
};
/// Cloth: so it is.
struct Done {
  long long number = 0;
};
struct End {
  double time = 0;
};
struct Bye {};
/// Either side, instead of any other message: it can not go on. The connection ends.
struct Failure {
  std::string code, what, remedy;
};

using Message = std::variant<Hello, Welcome, Step, Reached, Refused, Accept, Reject, Done, End, Bye, Failure>;

/// The name that stands under "message": "hello", "welcome" …
const char* name_of(const Message& message);

/// One line of JSON; numbers in a form that reads back to the same double.
/// Precondition: all numbers are finite.
std::string encode(const Message& message);

/// error  "bad_message": no JSON object, an unknown message, a key too many, too few or of another type, a quaternion that is not of unit
///        length (to 1e-9), lists of different lengths
Result<Message> decode(std::string_view text);

}  // namespace toile::coupling
