#include "toile/base/fields.h"

#include "toile/base/text.h"

#include <cmath>

namespace toile {

const Field* RecordType::find(std::string_view key) const {
  for (const Field& field : fields) {
    if (field.key == key) return &field;
  }
  return nullptr;
}

std::optional<Issue> range_issue(const Field& field, double value) {
  if (std::isfinite(value) && value >= field.min && value <= field.max) return std::nullopt;
  const std::string unit = field.unit.empty() ? "" : " " + field.unit;
  std::string allowed;
  if (std::isfinite(field.min) && std::isfinite(field.max)) allowed = fmt::format("from {} to {}{}", format_number(field.min), format_number(field.max), unit);
  else if (std::isfinite(field.min)) allowed = fmt::format("at least {}{}", format_number(field.min), unit);
  else if (std::isfinite(field.max)) allowed = fmt::format("at most {}{}", format_number(field.max), unit);
  else allowed = "any finite number";
  return Issue{"out_of_range", {}, fmt::format("'{}' is {}{}, out of range", field.key, format_number(value), unit), "allowed: " + allowed};
}

namespace {

void validate_value(const Field& field, const ValueType& type, void* value, const std::string& path, Issues& issues) {
  using Kind = ValueType::Kind;
  const auto report = [&](std::optional<Issue> issue) {
    if (!issue) return;
    issue->place.item = path;
    issues.push_back(std::move(*issue));
  };
  switch (type.kind) {
    case Kind::number: report(range_issue(field, *static_cast<double*>(value))); break;
    case Kind::integer: report(range_issue(field, static_cast<double>(type.get_integer(value)))); break;
    case Kind::fixed_numbers:
      for (int i = 0; i < type.fixed_size; ++i) report(range_issue(field, static_cast<double*>(value)[i]));
      break;
    case Kind::choice:
      TOILE_CHECK(type.choice_index(value) >= 0, "{} holds a value without a name", path);
      break;
    case Kind::list:
    case Kind::optional:
      for (std::size_t i = 0; i < type.size(value); ++i) {
        validate_value(field, *type.element, type.at(value, i), type.kind == Kind::list ? fmt::format("{}[{}]", path, i) : path, issues);
      }
      break;
    case Kind::map:
      for (std::size_t i = 0; i < type.size(value); ++i) {
        validate_value(field, *type.element, type.at(value, i), fmt::format("{}.{}", path, type.key(value, i)), issues);
      }
      break;
    case Kind::record: append(issues, validate_record(*type.record, value, path)); break;
    case Kind::boolean:
    case Kind::text: break;
  }
}

}  // namespace

Issues validate_record(const RecordType& type, const void* record, const std::string& path) {
  Issues issues;
  for (const Field& field : type.fields) {
    // Visitors share one signature for reading and writing; nothing is written here.
    void* value = field.address(const_cast<void*>(record));
    validate_value(field, field.type, value, path.empty() ? field.key : path + "." + field.key, issues);
  }
  for (const auto& check : type.checks) {
    Issues found;
    check(record, found);
    for (Issue& issue : found) {
      if (!path.empty()) issue.place.item = issue.place.item.empty() ? path : path + "." + issue.place.item;
      issues.push_back(std::move(issue));
    }
  }
  return issues;
}

const Field* find_field(const RecordType& type, std::string_view path, void** record) {
  const RecordType* current = &type;
  while (true) {
    const std::size_t dot = path.find('.');
    const Field* field = current->find(path.substr(0, dot));
    if (!field || dot == std::string_view::npos) return field;
    if (field->type.kind != ValueType::Kind::record) return nullptr;
    if (record) *record = field->address(*record);
    current = field->type.record.get();
    path = path.substr(dot + 1);
  }
}

}  // namespace toile
