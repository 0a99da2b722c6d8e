// Described records (base/fields.h) as YAML and JSON: strict reading with positions, canonical writing.
#pragma once

#include "toile/base/fields.h"

#include <string>
#include <string_view>

namespace toile::io {

enum class Units {
  required,  ///< specs written by people: `8 mm`; a bare number only where the quantity is dimensionless or zero
  si,        ///< files written by programs: a bare number is SI, a unit is accepted
};

/// Reads a YAML mapping into `record` (fields not named keep their value). Reports every unknown key (with the nearest
/// known one), wrong type, missing unit, value out of range, doubled key and missing required field as
/// file:line:column. Runs the record's own checks.
Issues read_record(std::string_view yaml, const std::string& file, const RecordType& type, void* record, Units units);

template <class T>
Result<T> read_record(std::string_view yaml, const std::string& file, Units units = Units::required) {
  T value{};
  Issues issues = read_record(yaml, file, *record_type<T>(), &value, units);
  if (!issues.empty()) return issues;
  return value;
}

/// Reads one value from text as it stands on a command line ("8 mm", "[1, 2]", "true") into a field.
Issues read_field(std::string_view text, const Field& field, void* record);

/// Canonical flow YAML on one line: all fields but local ones in declared order, SI numbers in shortest form.
std::string flow_yaml(const RecordType& type, const void* record);
template <class T>
std::string flow_yaml(const T& record) {
  return flow_yaml(*record_type<T>(), &record);
}

/// Block YAML with each field's doc, unit, range and source as a comment: a complete spec to start from. Numbers are
/// written with their SI unit.
std::string commented_yaml(const RecordType& type, const void* record);
template <class T>
std::string commented_yaml(const T& record) {
  return commented_yaml(*record_type<T>(), &record);
}

/// Block YAML without comments; numbers with their SI unit.
std::string block_yaml(const RecordType& type, const void* record);
template <class T>
std::string block_yaml(const T& record) {
  return block_yaml(*record_type<T>(), &record);
}

/// The same with bare SI numbers, for files that programs write; read with Units::si.
std::string block_yaml_si(const RecordType& type, const void* record);

/// A field's doc with its unit, range, choices and source on one line.
std::string field_summary(const Field& field);
/// `0.1 to 5 m`, `at least 0`, or nothing.
std::string range_text(const Field& field);

/// JSON schema (draft 2020-12) of the spec.
std::string json_schema(const RecordType& type, const std::string& title);

}  // namespace toile::io
