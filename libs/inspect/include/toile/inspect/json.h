// JSON with keys in the order of writing and numbers in shortest exact form.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toile::inspect {

class Json {
 public:
  Json() = default;  ///< null
  Json(double value);  ///< null where not finite
  Json(int value) : text_(std::to_string(value)) {}
  Json(long long value) : text_(std::to_string(value)) {}
  Json(std::size_t value) : text_(std::to_string(value)) {}
  Json(bool value) : text_(value ? "true" : "false") {}
  Json(const char* value) : Json(std::string(value)) {}
  Json(const std::string& value);
  template <class T>
  Json(const std::optional<T>& value) : Json(value ? Json(*value) : Json()) {}

  static Json object() { return Json(Kind::object); }
  static Json array() { return Json(Kind::array); }
  Json& set(const std::string& key, Json value);
  Json& push(Json value);

  /// Objects and arrays one item a line down to `depth` levels, what is deeper on one line.
  std::string dump(int depth = 2) const;

 private:
  enum class Kind { scalar, array, object };
  explicit Json(Kind kind) : kind_(kind) {}
  void write(std::string& out, int depth, int level) const;

  Kind kind_ = Kind::scalar;
  std::string text_ = "null";
  std::vector<std::pair<std::string, Json>> items_;
};

}  // namespace toile::inspect
