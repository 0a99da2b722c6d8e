#include "program.h"
#include "toile/io/record_yaml.h"

namespace toile::stage {
namespace {

std::string escaped(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.replace(at, 1, "\\|");
  return text;
}

void parameter_rows(std::string& out, const RecordType& type, void* record, const std::string& prefix) {
  for (const Field& field : type.fields) {
    const std::string name = prefix.empty() ? field.key : prefix + "." + field.key;
    void* value = record ? field.address(record) : nullptr;
    const ValueType* inner = &field.type;
    std::string suffix;
    while (inner->element) {
      if (inner->kind == ValueType::Kind::list) suffix += "[]";
      if (inner->kind == ValueType::Kind::map) suffix += ".NAME";
      if (value && inner->kind != ValueType::Kind::optional) value = nullptr;
      else if (value && inner->kind == ValueType::Kind::optional) value = inner->size(value) ? inner->at(value, 0) : nullptr;
      inner = inner->element.get();
    }
    if (inner->kind == ValueType::Kind::record) {
      if (!suffix.empty() || field.type.kind == ValueType::Kind::optional) out += fmt::format("| `{}{}` | | {} |\n", name, suffix, escaped(io::field_summary(field)));
      parameter_rows(out, *inner->record, value, name + suffix);
      continue;
    }
    std::string shown;
    if (record && !(field.type.kind == ValueType::Kind::optional && field.type.size(field.address(record)) == 0)) {
      RecordType one;
      one.fields.push_back(field);
      shown = io::block_yaml(one, record);
      shown = shown.substr(field.key.size() + 2);
      shown.pop_back();
    }
    out += fmt::format("| `{}{}` | {} | {} |\n", name, suffix, shown.empty() ? "" : "`" + escaped(shown) + "`", escaped(io::field_summary(field)));
  }
}

}  // namespace

std::string docs_page(const Entry& entry) {
  const Description& d = entry.description;
  std::string out = fmt::format("# {}\n\n{}\n\n```\n{}\n```\n\n", d.name, d.summary, d.example);
  if (!d.details.empty()) out += d.details + "\n\n";
  out += "## Inputs and output\n\n| name | needed | what |\n|---|---|---|\n";
  for (const Port& port : d.inputs) out += fmt::format("| `{}` | {} | {} |\n", port.name, port.required ? (port.many ? "one or more" : "yes") : (port.many ? "any number" : "no"), escaped(port.doc));
  out += fmt::format("| `-o` | {} | output{}{} |\n\n", d.output_optional ? "no" : "yes", *extension(d.output) ? ", " : "", extension(d.output));
  if (!entry.params->fields.empty()) {
    const std::shared_ptr<void> defaults = entry.make_params();
    out += "## Parameters\n\nIn the spec, or as `--name value`.\n\n| name | default | meaning |\n|---|---|---|\n";
    parameter_rows(out, *entry.params, defaults.get(), "");
    out += "\n";
  }
  out += "## Options of every program\n\n| option | meaning |\n|---|---|\n";
  for (std::size_t i = 0; i < common_option_count; ++i) out += fmt::format("| `{}` | {} |\n", common_options[i].name, escaped(common_options[i].doc));
  out += fmt::format("\n{}\n", help_footer);
  return out;
}

}  // namespace toile::stage
