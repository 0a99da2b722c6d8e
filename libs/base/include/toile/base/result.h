// Results and issues: how every library reports bad input.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace toile {

/// What kind of trouble an issue is; it decides the exit code of a program (docs/architecture.md, "Exit codes").
enum class Category {
  usage,          ///< wrong command line: exit 2
  input,          ///< unreadable or invalid input: exit 3
  check,          ///< the input is readable but a check on the result failed: exit 4
  not_converged,  ///< the result is written and marked: exit 5
  interrupted,    ///< stopped by the user: exit 130
};

/// Where the trouble is: a file position and/or a named thing ("panel front, edge side").
struct Place {
  std::string file;
  int line = 0;    ///< 1-based; 0 is unknown
  int column = 0;  ///< 1-based; 0 is unknown
  std::string item;
};

/// One thing that is wrong, and what to do about it.
struct Issue {
  std::string code;  ///< stable identifier, e.g. "unknown_key"; tests and JSON use it
  Place place;
  std::string what;
  std::string remedy;
  Category category = Category::input;
};
using Issues = std::vector<Issue>;

/// `file:line:col: item: what; remedy` on one line.
std::string to_string(const Issue& issue);

/// Either a value or at least one issue.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}
  Result(Issue issue) { issues_.push_back(std::move(issue)); }
  Result(Issues issues) : issues_(std::move(issues)) {
    if (issues_.empty()) throw std::logic_error("Result built from an empty list of issues");
  }
  bool has_value() const { return value_.has_value(); }
  explicit operator bool() const { return value_.has_value(); }
  const T& value() const& { return require(), *value_; }
  T& value() & { return require(), *value_; }
  T&& value() && { return require(), std::move(*value_); }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }
  const Issues& issues() const { return issues_; }

 private:
  void require() const {
    if (!value_) throw std::logic_error("value() of a failed Result: " + to_string(issues_.front()));
  }
  std::optional<T> value_;
  Issues issues_;
};

/// For functions that only succeed or fail: an empty list is success.
inline bool ok(const Issues& issues) { return issues.empty(); }
inline void append(Issues& to, const Issues& from) { to.insert(to.end(), from.begin(), from.end()); }

/// A programmer's error, never the user's; ends the program with exit code 1.
struct CheckFailed : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& values);

}  // namespace toile

/// TOILE_CHECK(a < b, "a {} b {}", a, b): a condition that only a programmer's error can break; prints the values.
#define TOILE_CHECK(condition, ...)                                                                  \
  do {                                                                                               \
    if (!(condition)) ::toile::check_failed(__FILE__, __LINE__, #condition, fmt::format(__VA_ARGS__)); \
  } while (false)

#define TOILE_CONCAT_(a, b) a##b
#define TOILE_CONCAT(a, b) TOILE_CONCAT_(a, b)
/// TOILE_TRY(auto mesh, read(path)): declares mesh from a Result, or returns its issues to the caller.
#define TOILE_TRY(declaration, expression)                              \
  auto TOILE_CONCAT(toile_try_, __LINE__) = (expression);               \
  if (!TOILE_CONCAT(toile_try_, __LINE__)) return TOILE_CONCAT(toile_try_, __LINE__).issues(); \
  declaration = std::move(*TOILE_CONCAT(toile_try_, __LINE__))
