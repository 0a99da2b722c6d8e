// One declaration a parameter. A parameter struct names each field once:
//
//   struct MeshParams {
//     double cell = 0.01;
//     Diagonal diagonal = Diagonal::alternating;
//     std::vector<PanelGrid> panels;
//     static void describe(auto& f) {
//       f(&MeshParams::cell, {.key = "cell", .doc = "grid size along warp and weft", .unit = "m", .min = 1e-4, .max = 1});
//       f(&MeshParams::diagonal, {.key = "diagonal", .doc = "how a cell is cut into triangles"});
//       f(&MeshParams::panels, {.key = "panels", .doc = "settings of single panels"});
//     }
//   };
//   template <> struct toile::Choices<Diagonal> {
//     static constexpr std::array names{std::pair{"single", Diagonal::single}, std::pair{"alternating", Diagonal::alternating}};
//   };
//
// From it come strict YAML reading and writing, the command line, help, the commented spec, the docs page, the JSON
// schema, provenance and hashing. The description is a run-time tree (RecordType), so each of those is ordinary code.
#pragma once

#include "toile/base/result.h"

#include <Eigen/Core>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace toile {

/// Names of an enum's values; specialise with `static constexpr std::array names{std::pair{"name", Enum::value}, …}`.
template <class Enum>
struct Choices;

struct RecordType;

/// The shape of a value, with the operations that visitors need on a pointer to it.
struct ValueType {
  enum class Kind { boolean, integer, number, text, choice, fixed_numbers, list, map, optional, record };
  Kind kind = Kind::number;

  std::vector<std::string> choices;                           // choice
  std::function<int(const void*)> choice_index;               // choice; -1 if the value has no name
  std::function<void(void*, int)> set_choice;                 // choice
  int fixed_size = 0;                                         // fixed_numbers: so many doubles, contiguous
  std::shared_ptr<const ValueType> element;                   // list, map, optional
  std::function<std::size_t(const void*)> size;               // list, map; optional: 0 or 1
  std::function<void(void*)> clear;                           // list, map, optional
  std::function<void*(void*)> append;                         // list; optional: emplaces
  std::function<void*(void*, std::size_t)> at;                // list, map (in key order); optional
  std::function<std::string(const void*, std::size_t)> key;   // map
  std::function<void*(void*, const std::string&)> insert;     // map; null when the key is there already
  std::shared_ptr<const RecordType> record;                   // record
  std::function<long long(const void*)> get_integer;          // integer
  std::function<void(void*, long long)> set_integer;          // integer; checked against integer_min/max first
  long long integer_min = 0, integer_max = 0;
};

/// What is said about a field, besides where it is stored.
struct FieldInfo {
  const char* key = "";
  const char* doc = "";
  const char* unit = "";  ///< SI unit of a number, e.g. "m", "N/m"; empty: dimensionless
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  const char* source = "";  ///< where a default comes from: an anchor of docs/bibliography.md or a sentence
  bool required = false;    ///< must be given in a file; has no meaningful default
  bool local = false;       ///< concerns one run only (the path of a log): not part of provenance and hash
};

struct Field {
  std::string key, doc, unit, source;
  double min, max;
  bool required, local;
  ValueType type;
  std::function<void*(void*)> address;  ///< of the field inside the record
};

struct RecordType {
  std::vector<Field> fields;
  /// Checks between fields; an issue's place.item is the key it concerns.
  std::vector<std::function<void(const void*, Issues&)>> checks;
  const Field* find(std::string_view key) const;
};

template <class T>
const std::shared_ptr<const RecordType>& record_type();

namespace detail {

template <class T>
struct is_vector : std::false_type {};
template <class T>
struct is_vector<std::vector<T>> : std::true_type {};
template <class T>
struct is_map : std::false_type {};
template <class T>
struct is_map<std::map<std::string, T>> : std::true_type {};
template <class T>
struct is_optional : std::false_type {};
template <class T>
struct is_optional<std::optional<T>> : std::true_type {};
template <class T>
struct fixed_size : std::integral_constant<int, 0> {};
template <std::size_t N>
struct fixed_size<std::array<double, N>> : std::integral_constant<int, static_cast<int>(N)> {};
template <int N>
struct fixed_size<Eigen::Matrix<double, N, 1>> : std::integral_constant<int, N> {};

template <class T>
ValueType value_type() {
  using Kind = ValueType::Kind;
  ValueType type;
  if constexpr (std::is_same_v<T, bool>) {
    type.kind = Kind::boolean;
  } else if constexpr (std::is_integral_v<T>) {
    type.kind = Kind::integer;
    type.get_integer = [](const void* p) { return static_cast<long long>(*static_cast<const T*>(p)); };
    type.set_integer = [](void* p, long long v) { *static_cast<T*>(p) = static_cast<T>(v); };
    type.integer_min = static_cast<long long>(std::numeric_limits<T>::min());
    type.integer_max = sizeof(T) < 8 ? static_cast<long long>(std::numeric_limits<T>::max()) : std::numeric_limits<long long>::max();
  } else if constexpr (std::is_same_v<T, double>) {
    type.kind = Kind::number;
  } else if constexpr (std::is_same_v<T, std::string>) {
    type.kind = Kind::text;
  } else if constexpr (std::is_enum_v<T>) {
    type.kind = Kind::choice;
    for (const auto& [name, value] : Choices<T>::names) type.choices.emplace_back(name);
    type.choice_index = [](const void* p) {
      int index = 0;
      for (const auto& [name, value] : Choices<T>::names) {
        if (value == *static_cast<const T*>(p)) return index;
        ++index;
      }
      return -1;
    };
    type.set_choice = [](void* p, int index) { *static_cast<T*>(p) = Choices<T>::names[static_cast<std::size_t>(index)].second; };
  } else if constexpr (fixed_size<T>::value > 0) {
    type.kind = Kind::fixed_numbers;
    type.fixed_size = fixed_size<T>::value;
  } else if constexpr (is_vector<T>::value) {
    using E = typename T::value_type;
    static_assert(!std::is_same_v<E, bool>, "a list of flags has no addressable elements");
    type.kind = Kind::list;
    type.element = std::make_shared<ValueType>(value_type<E>());
    type.size = [](const void* p) { return static_cast<const T*>(p)->size(); };
    type.clear = [](void* p) { static_cast<T*>(p)->clear(); };
    type.append = [](void* p) -> void* { return &static_cast<T*>(p)->emplace_back(); };
    type.at = [](void* p, std::size_t i) -> void* { return &(*static_cast<T*>(p))[i]; };
  } else if constexpr (is_map<T>::value) {
    using E = typename T::mapped_type;
    type.kind = Kind::map;
    type.element = std::make_shared<ValueType>(value_type<E>());
    type.size = [](const void* p) { return static_cast<const T*>(p)->size(); };
    type.clear = [](void* p) { static_cast<T*>(p)->clear(); };
    type.at = [](void* p, std::size_t i) -> void* { return &std::next(static_cast<T*>(p)->begin(), static_cast<std::ptrdiff_t>(i))->second; };
    type.key = [](const void* p, std::size_t i) { return std::next(static_cast<const T*>(p)->begin(), static_cast<std::ptrdiff_t>(i))->first; };
    type.insert = [](void* p, const std::string& key) -> void* {
      const auto [it, inserted] = static_cast<T*>(p)->try_emplace(key);
      return inserted ? &it->second : nullptr;
    };
  } else if constexpr (is_optional<T>::value) {
    using E = typename T::value_type;
    type.kind = Kind::optional;
    type.element = std::make_shared<ValueType>(value_type<E>());
    type.size = [](const void* p) { return static_cast<std::size_t>(static_cast<const T*>(p)->has_value()); };
    type.clear = [](void* p) { static_cast<T*>(p)->reset(); };
    type.append = [](void* p) -> void* { return &static_cast<T*>(p)->emplace(); };
    type.at = [](void* p, std::size_t) -> void* { return &**static_cast<T*>(p); };
  } else {
    type.kind = Kind::record;
    type.record = record_type<T>();
  }
  return type;
}

template <class T>
struct Describer {
  RecordType record;
  template <class M>
  void operator()(M T::*member, FieldInfo info) {
    record.fields.push_back(Field{info.key, info.doc, info.unit, info.source, info.min, info.max, info.required, info.local, value_type<M>(),
                                  [member](void* p) -> void* { return &(static_cast<T*>(p)->*member); }});
  }
  /// check(const T&, Issues&): a condition between fields.
  void check(std::function<void(const T&, Issues&)> condition) {
    record.checks.push_back([condition](const void* p, Issues& issues) { condition(*static_cast<const T*>(p), issues); });
  }
};

}  // namespace detail

/// The description of T, built once.
template <class T>
const std::shared_ptr<const RecordType>& record_type() {
  static const std::shared_ptr<const RecordType> type = [] {
    detail::Describer<T> describer;
    T::describe(describer);
    return std::make_shared<const RecordType>(std::move(describer.record));
  }();
  return type;
}

/// Range of every number (also inside lists, maps and records), names of every choice, and the records' own checks.
/// Issue places name the path of keys ("panels[2].cell").
Issues validate_record(const RecordType& type, const void* record, const std::string& path = "");

template <class T>
Issues validate(const T& value) {
  return validate_record(*record_type<T>(), &value);
}

/// Checks a number against a field's range; the issue names the field's key.
std::optional<Issue> range_issue(const Field& field, double value);

/// Finds a field by dotted path ("grid.cell") through records; null if there is none. `record` moves to the owner.
const Field* find_field(const RecordType& type, std::string_view path, void** record);

}  // namespace toile
