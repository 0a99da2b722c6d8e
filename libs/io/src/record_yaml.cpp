#include "toile/io/record_yaml.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "toile/base/text.h"
#include "toile/base/units.h"

namespace toile::io {
namespace {

using Kind = ValueType::Kind;

const char* kind_name(const ValueType& type) {
  switch (type.kind) {
    case Kind::boolean: return "true or false";
    case Kind::integer: return "a whole number";
    case Kind::number: return "a number";
    case Kind::text: return "a text";
    case Kind::choice: return "one of the known names";
    case Kind::fixed_numbers: return "a list of numbers";
    case Kind::list: return "a list";
    case Kind::map:
    case Kind::record: return "a mapping (key: value)";
    case Kind::optional: return kind_name(*type.element);
  }
  return "";
}

std::string joined(const std::string& path, const std::string& key) {
  if (path.empty() || key.empty()) return path + key;
  return path + "." + key;
}

class Reader {
 public:
  Reader(std::string file, Units units) : file_(std::move(file)), units_(units) {}
  Issues issues;

  void add(const YAML::Node& node, const std::string& path, std::string code, std::string what, std::string remedy) {
    Issue issue{std::move(code), {.file = file_, .item = path}, std::move(what), std::move(remedy)};
    const YAML::Mark mark = node.Mark();
    if (!mark.is_null() && mark.line >= 0) {
      issue.place.line = mark.line + 1;
      issue.place.column = mark.column + 1;
    }
    issues.push_back(std::move(issue));
  }

  void read_record(const YAML::Node& node, const RecordType& type, void* record, const std::string& path) {
    // An empty file, or `key:` with nothing behind it, is a record of defaults.
    if (!node.IsMap() && !node.IsNull()) {
      return add(node, path, "wrong_type", fmt::format("'{}' is not a mapping (key: value)", describe(node)), "write the fields as `key: value`");
    }
    const std::size_t before = issues.size();
    std::set<std::string> seen;
    std::vector<std::string> keys;
    for (const Field& field : type.fields) keys.push_back(field.key);
    if (node.IsMap()) {
      for (const auto& item : node) {
        if (!item.first.IsScalar()) {
          add(item.first, path, "wrong_type", "a key must be a plain word", suggestion("", keys));
          continue;
        }
        const std::string key = item.first.Scalar();
        const Field* field = type.find(key);
        if (!field) {
          add(item.first, path, "unknown_key", fmt::format("unknown key '{}'", key), suggestion(key, keys));
        } else if (!seen.insert(key).second) {
          add(item.first, joined(path, key), "doubled_key", fmt::format("the key '{}' is given twice", key), "keep one of them");
        } else {
          read_value(item.second, *field, field->type, field->address(record), joined(path, key));
        }
      }
    }
    for (const Field& field : type.fields) {
      if (field.required && !seen.count(field.key)) {
        add(node, path, "missing_key", fmt::format("the key '{}' is missing ({})", field.key, field.doc), fmt::format("add `{}: …`", field.key));
      }
    }
    if (issues.size() > before) return;
    for (const auto& check : type.checks) {
      Issues found;
      check(record, found);
      for (const Issue& issue : found) {
        const std::string& key = issue.place.item;
        const bool has_place = node.IsMap() && !key.empty() && node[key];
        add(has_place ? node[key] : node, joined(path, key), issue.code, issue.what, issue.remedy);
      }
    }
  }

  void read_value(const YAML::Node& node, const Field& field, const ValueType& type, void* value, const std::string& path) {
    switch (type.kind) {
      case Kind::boolean: {
        const std::string text = node.IsScalar() ? node.Scalar() : "";
        if (text != "true" && text != "false") return wrong_type(node, type, path);
        *static_cast<bool*>(value) = text == "true";
        return;
      }
      case Kind::integer: {
        const auto number = node.IsScalar() ? parse_integer(node.Scalar()) : std::nullopt;
        if (!number) return wrong_type(node, type, path);
        if (auto issue = range_issue(field, static_cast<double>(*number))) return add(node, path, issue->code, issue->what, issue->remedy);
        if (*number < type.integer_min || *number > type.integer_max) {
          return add(node, path, "out_of_range", fmt::format("{} is too large or too small", *number), fmt::format("allowed: from {} to {}", type.integer_min, type.integer_max));
        }
        return type.set_integer(value, *number);
      }
      case Kind::number: return read_number(node, field, type, static_cast<double*>(value), path);
      case Kind::text:
        if (!node.IsScalar()) return wrong_type(node, type, path);
        *static_cast<std::string*>(value) = node.Scalar();
        return;
      case Kind::choice: {
        if (!node.IsScalar()) return wrong_type(node, type, path);
        for (std::size_t i = 0; i < type.choices.size(); ++i) {
          if (type.choices[i] == node.Scalar()) return type.set_choice(value, static_cast<int>(i));
        }
        return add(node, path, "unknown_choice", fmt::format("'{}' is not a known value of '{}'", node.Scalar(), field.key), suggestion(node.Scalar(), type.choices));
      }
      case Kind::fixed_numbers:
        if (!node.IsSequence() || node.size() != static_cast<std::size_t>(type.fixed_size)) {
          return add(node, path, "wrong_type", fmt::format("'{}' is not a list of {} numbers", describe(node), type.fixed_size), "write them as [a, b, …]");
        }
        for (std::size_t i = 0; i < node.size(); ++i) read_number(node[i], field, type, static_cast<double*>(value) + i, fmt::format("{}[{}]", path, i));
        return;
      case Kind::list:
        if ((node.IsScalar() && type.element->kind == Kind::text) || (node.IsMap() && type.element->kind == Kind::record)) {
          // One word or one mapping stands for a list of one: `in: {fabrics: card}`, `a: {point: front.top}`.
          type.clear(value);
          return read_value(node, field, *type.element, type.append(value), path);
        }
        if (!node.IsSequence()) return wrong_type(node, type, path);
        type.clear(value);
        for (std::size_t i = 0; i < node.size(); ++i) read_value(node[i], field, *type.element, type.append(value), fmt::format("{}[{}]", path, i));
        return;
      case Kind::map:
        if (!node.IsMap()) return wrong_type(node, type, path);
        type.clear(value);
        for (const auto& item : node) {
          if (!item.first.IsScalar()) {
            add(item.first, path, "wrong_type", "a key must be a plain word", "write `name: value`");
            continue;
          }
          const std::string key = item.first.Scalar();
          if (void* element = type.insert(value, key)) read_value(item.second, field, *type.element, element, joined(path, key));
          else add(item.first, path, "doubled_key", fmt::format("the key '{}' is given twice", key), "keep one of them");
        }
        return;
      case Kind::optional:
        type.clear(value);
        if (!node.IsNull()) read_value(node, field, *type.element, type.append(value), path);
        return;
      case Kind::record: return read_record(node, *type.record, value, path);
    }
  }

 private:
  static std::string describe(const YAML::Node& node) {
    if (node.IsScalar()) return node.Scalar();
    if (node.IsSequence()) return "a list";
    if (node.IsMap()) return "a mapping";
    return "nothing";
  }
  void wrong_type(const YAML::Node& node, const ValueType& type, const std::string& path) {
    add(node, path, "wrong_type", fmt::format("'{}' is not {}", describe(node), kind_name(type)), fmt::format("write {}", kind_name(type)));
  }
  void read_number(const YAML::Node& node, const Field& field, const ValueType& type, double* value, const std::string& path) {
    if (!node.IsScalar()) return wrong_type(node, type, path);
    const auto number = units_ == Units::si ? parse_quantity_si(node.Scalar(), field.unit) : parse_quantity(node.Scalar(), field.unit);
    if (!number) {
      for (const Issue& issue : number.issues()) add(node, path, issue.code, issue.what, issue.remedy);
      return;
    }
    if (auto issue = range_issue(field, *number)) return add(node, path, issue->code, issue->what, issue->remedy);
    *value = *number;
  }

  std::string file_;
  Units units_;
};

// --- writing ---------------------------------------------------------------------------------------------------------

bool plain_scalar(const std::string& text) {
  static const std::set<std::string> reserved{"true", "false", "null", "yes", "no", "on", "off", "y", "n", "True", "False", "Null", "Yes", "No", "On", "Off", "Y", "N"};
  if (text.empty() || reserved.count(text)) return false;
  if (!std::isalpha(static_cast<unsigned char>(text.front())) && text.front() != '_') return false;
  for (char c : text) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '.' && c != '/') return false;
  }
  return true;
}

std::string scalar(const std::string& text) {
  if (plain_scalar(text)) return text;
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += std::string("\\") + c;
    else if (c == '\n') quoted += "\\n";
    else if (c == '\t') quoted += "\\t";
    else if (static_cast<unsigned char>(c) < 0x20) quoted += fmt::format("\\x{:02x}", static_cast<int>(c));
    else quoted += c;
  }
  return quoted + "\"";
}

enum class NumberStyle {
  si,         ///< bare
  with_unit,  ///< followed by the field's unit
};

std::string number(double value, const Field& field, NumberStyle style) {
  std::string text = format_number(value);
  if (style == NumberStyle::with_unit && !field.unit.empty() && field.unit != "1") text += " " + field.unit;
  return text;
}

std::string flow_record(const RecordType& type, void* record, NumberStyle style);

std::string flow_value(const Field& field, const ValueType& type, void* value, NumberStyle style) {
  switch (type.kind) {
    case Kind::boolean: return *static_cast<bool*>(value) ? "true" : "false";
    case Kind::integer: return fmt::format("{}", type.get_integer(value));
    case Kind::number: return number(*static_cast<double*>(value), field, style);
    case Kind::text: return scalar(*static_cast<std::string*>(value));
    case Kind::choice: return type.choices[static_cast<std::size_t>(type.choice_index(value))];
    case Kind::fixed_numbers: {
      std::string text = "[";
      for (int i = 0; i < type.fixed_size; ++i) text += (i ? ", " : "") + number(static_cast<double*>(value)[i], field, style);
      return text + "]";
    }
    case Kind::list: {
      std::string text = "[";
      for (std::size_t i = 0; i < type.size(value); ++i) text += (i ? ", " : "") + flow_value(field, *type.element, type.at(value, i), style);
      return text + "]";
    }
    case Kind::map: {
      std::string text = "{";
      for (std::size_t i = 0; i < type.size(value); ++i) {
        text += (i ? ", " : "") + scalar(type.key(value, i)) + ": " + flow_value(field, *type.element, type.at(value, i), style);
      }
      return text + "}";
    }
    case Kind::optional: return type.size(value) ? flow_value(field, *type.element, type.at(value, 0), style) : "null";
    case Kind::record: return flow_record(*type.record, value, style);
  }
  return "";
}

std::string flow_record(const RecordType& type, void* record, NumberStyle style) {
  std::string text = "{";
  for (const Field& field : type.fields) {
    void* value = field.address(record);
    if (field.local || (field.type.kind == Kind::optional && field.type.size(value) == 0)) continue;
    if (text.size() > 1) text += ", ";
    text += field.key + ": " + flow_value(field, field.type, value, style);
  }
  return text + "}";
}

const ValueType& innermost(const ValueType& type) { return type.element ? innermost(*type.element) : type; }

enum class Comments { none, full };

void block_record(std::string& out, const RecordType& type, void* record, int indent, Comments comments, NumberStyle style) {
  const std::string pad(static_cast<std::size_t>(indent), ' ');
  for (const Field& field : type.fields) {
    void* value = field.address(record);
    if (comments == Comments::full) out += pad + "# " + field_summary(field) + "\n";
    if (field.type.kind == Kind::optional && field.type.size(value) == 0) {
      if (comments == Comments::full) out += pad + "# " + field.key + ": (not set)\n";
      continue;
    }
    out += pad + field.key + ":";
    const bool optional = field.type.kind == Kind::optional;
    const ValueType& inner = optional ? *field.type.element : field.type;
    void* inner_value = optional ? field.type.at(value, 0) : value;
    if (inner.kind == Kind::record) {
      out += "\n";
      block_record(out, *inner.record, inner_value, indent + 2, comments, style);
      continue;
    }
    const bool of_records = inner.element && inner.element->kind == Kind::record;
    if (of_records && inner.size(inner_value) == 0) {
      out += inner.kind == Kind::list ? " []\n" : " {}\n";
      if (comments == Comments::none) continue;
      out += pad + "#   each entry holds:\n";
      for (const Field& sub : inner.element->record->fields) out += pad + "#     " + sub.key + ": " + field_summary(sub) + "\n";
      continue;
    }
    if (of_records) {
      out += "\n";
      for (std::size_t i = 0; i < inner.size(inner_value); ++i) {
        const std::string head = inner.kind == Kind::list ? "- " : scalar(inner.key(inner_value, i)) + ": ";
        out += pad + "  " + head + flow_record(*inner.element->record, inner.at(inner_value, i), style) + "\n";
      }
      continue;
    }
    out += " " + flow_value(field, inner, inner_value, style) + "\n";
  }
}

using json = nlohmann::ordered_json;

json schema_of(const Field& field, const ValueType& type);

json schema_record(const RecordType& type) {
  json schema{{"type", "object"}, {"additionalProperties", false}};
  json required = json::array();
  schema["properties"] = json::object();
  for (const Field& field : type.fields) {
    json property = schema_of(field, field.type);
    property["description"] = field_summary(field);
    schema["properties"][field.key] = std::move(property);
    if (field.required) required.push_back(field.key);
  }
  if (!required.empty()) schema["required"] = required;
  return schema;
}

json schema_of(const Field& field, const ValueType& type) {
  switch (type.kind) {
    case Kind::boolean: return {{"type", "boolean"}};
    case Kind::integer: {
      json schema{{"type", "integer"}};
      if (std::isfinite(field.min)) schema["minimum"] = field.min;
      if (std::isfinite(field.max)) schema["maximum"] = field.max;
      return schema;
    }
    case Kind::number: {
      json schema{{"type", json::array({"number", "string"})}};
      if (!field.unit.empty()) schema["unit"] = field.unit;
      return schema;
    }
    case Kind::text: return {{"type", "string"}};
    case Kind::choice: return {{"enum", type.choices}};
    case Kind::fixed_numbers:
      return {{"type", "array"}, {"items", schema_of(field, ValueType{})}, {"minItems", type.fixed_size}, {"maxItems", type.fixed_size}};
    case Kind::list: {
      const json element = schema_of(field, *type.element);
      const json list{{"type", "array"}, {"items", element}};
      if (type.element->kind != Kind::text && type.element->kind != Kind::record) return list;
      return {{"anyOf", json::array({list, element})}};
    }
    case Kind::map: return {{"type", "object"}, {"additionalProperties", schema_of(field, *type.element)}};
    case Kind::optional: return schema_of(field, *type.element);
    case Kind::record: return schema_record(*type.record);
  }
  return {};
}

}  // namespace

std::string range_text(const Field& field) {
  const std::string unit = field.unit.empty() || field.unit == "1" ? "" : " " + field.unit;
  if (std::isfinite(field.min) && std::isfinite(field.max)) return fmt::format("{} to {}{}", format_number(field.min), format_number(field.max), unit);
  if (std::isfinite(field.min)) return fmt::format("at least {}{}", format_number(field.min), unit);
  if (std::isfinite(field.max)) return fmt::format("at most {}{}", format_number(field.max), unit);
  return "";
}

std::string field_summary(const Field& field) {
  std::string text = field.doc;
  const ValueType& type = innermost(field.type);
  if (type.kind == Kind::choice) {
    text += ": ";
    for (std::size_t i = 0; i < type.choices.size(); ++i) text += (i ? " | " : "") + type.choices[i];
  }
  if (!field.unit.empty() && field.unit != "1") text += fmt::format(" [{}]", field.unit);
  if (const std::string range = range_text(field); !range.empty()) text += fmt::format(" ({})", range);
  if (!field.source.empty()) text += fmt::format("; source: {}", field.source);
  if (field.required) text += "; required";
  return text;
}

Issues read_record(std::string_view yaml, const std::string& file, const RecordType& type, void* record, Units units) {
  Reader reader(file, units);
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(std::string(yaml));
    if (documents.size() > 1) {
      reader.add(documents[1], "", "several_documents", "the file holds several YAML documents", "keep one");
      return reader.issues;
    }
    reader.read_record(documents.empty() ? YAML::Node() : documents[0], type, record, "");
  } catch (const YAML::Exception& error) {
    Issue issue{"bad_yaml", {.file = file}, "not valid YAML: " + error.msg, "check indentation, quotes and brackets"};
    if (!error.mark.is_null()) {
      issue.place.line = error.mark.line + 1;
      issue.place.column = error.mark.column + 1;
    }
    return {issue};
  }
  return std::move(reader.issues);
}

Issues read_field(std::string_view text, const Field& field, void* record) {
  Reader reader("", Units::required);
  void* value = field.address(record);
  const ValueType& type = field.type.kind == Kind::optional ? *field.type.element : field.type;
  try {
    const YAML::Node node = type.kind == Kind::text ? YAML::Node(std::string(text)) : YAML::Load(std::string(text));
    reader.read_value(node, field, field.type, value, field.key);
  } catch (const YAML::Exception& error) {
    return {{"bad_yaml", {.item = field.key}, fmt::format("'{}' cannot be read: {}", text, error.msg), "check quotes and brackets", Category::usage}};
  }
  for (Issue& issue : reader.issues) {
    issue.place.line = issue.place.column = 0;
    issue.category = Category::usage;
  }
  return std::move(reader.issues);
}

// Reading and writing share one set of accessors, which take a non-const pointer; writers do not change the record.
std::string flow_yaml(const RecordType& type, const void* record) { return flow_record(type, const_cast<void*>(record), NumberStyle::si); }

std::string commented_yaml(const RecordType& type, const void* record) {
  std::string out;
  block_record(out, type, const_cast<void*>(record), 0, Comments::full, NumberStyle::with_unit);
  return out;
}

std::string block_yaml(const RecordType& type, const void* record) {
  std::string out;
  block_record(out, type, const_cast<void*>(record), 0, Comments::none, NumberStyle::with_unit);
  return out;
}

std::string block_yaml_si(const RecordType& type, const void* record) {
  std::string out;
  block_record(out, type, const_cast<void*>(record), 0, Comments::none, NumberStyle::si);
  return out;
}

std::string json_schema(const RecordType& type, const std::string& title) {
  json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}};
  schema.update(schema_record(type));
  return schema.dump(2) + "\n";
}

}  // namespace toile::io
