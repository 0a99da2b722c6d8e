#include "program.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <set>

#include "toile/base/hash.h"
#include "toile/base/parallel.h"
#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

namespace toile::stage {

const CommonOption common_options[] = {
    {"-o,--output", "file to write (atomically: afterwards there is the old file or the whole new one)"},
    {"--spec", "YAML file of parameters; the command line goes before it"},
    {"--dump-spec", "print a complete commented spec with the defaults and stop"},
    {"--check", "read and validate spec and inputs, then stop"},
    {"--json", "print the summary, or the errors, as JSON on stdout"},
    {"--threads", "threads to use, 0: one per processor; the result does not depend on it"},
    {"--ascii", "write garments and supports as text instead of binary"},
    {"--quiet", "no progress and no summary"},
    {"--schema", "print the JSON schema of the spec and stop"},
    {"--describe", "print inputs and output as JSON, for pipelines, and stop"},
    {"--docs", "print the documentation page (Markdown) and stop"},
    {"--version", "print the version and stop"},
};
const std::size_t common_option_count = std::size(common_options);

const char* const help_footer =
    "Units: quantities take a unit wherever they are written ('8 mm', '30 deg', '140 g/m2', '0.7 gf*cm/deg'); results are SI.\n"
    "Exit codes: 0 ok, 1 internal error, 2 usage, 3 unreadable or invalid input, 4 a check failed, 5 not converged or out of\n"
    "time (the output is written and marked), 130 interrupted.";

const char* extension(FileKind kind) {
  switch (kind) {
    case FileKind::pattern:
    case FileKind::fabric:
    case FileKind::measurements:
    case FileKind::spec: return ".yaml";
    case FileKind::garment:
    case FileKind::support: return ".ply";
    case FileKind::json: return ".json";
    case FileKind::csv: return ".csv";
    case FileKind::png: return ".png";
    case FileKind::any: return "";
  }
  return "";
}

std::string type_word(const ValueType& type) {
  switch (type.kind) {
    case ValueType::Kind::boolean: return "true|false";
    case ValueType::Kind::integer: return "INT";
    case ValueType::Kind::number: return "NUMBER";
    case ValueType::Kind::text: return "TEXT";
    case ValueType::Kind::choice: {
      std::string text;
      for (const std::string& choice : type.choices) text += (text.empty() ? "" : "|") + choice;
      return text;
    }
    case ValueType::Kind::fixed_numbers: return "[NUMBERS]";
    case ValueType::Kind::list: return "[LIST]";
    case ValueType::Kind::map: return "{MAP}";
    case ValueType::Kind::optional: return type_word(*type.element);
    case ValueType::Kind::record: return "{RECORD}";
  }
  return "";
}

void visit_options(const RecordType& type, void* record, const std::string& prefix, const std::function<void(const std::string&, const Field&, void*)>& visit) {
  for (const Field& field : type.fields) {
    const std::string name = prefix.empty() ? field.key : prefix + "." + field.key;
    if (field.type.kind == ValueType::Kind::record) visit_options(*field.type.record, record ? field.address(record) : nullptr, name, visit);
    else visit(name, field, record);
  }
}

class Program {
 public:
  Program(const Entry& entry, int argc, char** argv) : entry_(entry), argc_(argc), argv_(argv) {}

  int run() {
    int code = 1;
    try {
      code = guarded();
    } catch (const std::bad_alloc&) {
      fmt::print(stderr, "{}: out of memory; use a coarser grid or a larger machine\n", entry_.description.name);
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}: internal error: {}; please report it with the command line\n", entry_.description.name, error.what());
    }
    return code;
  }

 private:
  struct Options {
    std::string output, spec;
    bool dump_spec = false, check = false, json = false, ascii = false, quiet = false, schema = false, docs = false, describe = false, version = false;
    int threads = 0;
    std::vector<std::string> positional;
    std::map<std::string, std::vector<std::string>> ports;
    std::vector<std::pair<std::string, std::string>> params;  ///< dotted name, text
  };

  int fail(const Issues& issues, bool json) {
    if (json) fmt::print("{{\"stage\": \"{}\", \"ok\": false, \"issues\": {}}}\n", entry_.description.name, issues_json(issues));
    else for (const Issue& issue : issues) fmt::print(stderr, "{}\n", to_string(issue));
    return exit_code(issues);
  }

  static Issue usage(std::string what, std::string remedy) { return Issue{"usage", {}, std::move(what), std::move(remedy), Category::usage}; }

  /// Fills options; returns an exit code when the command line asked for nothing but text, or is wrong.
  std::optional<int> parse_command_line(Options& options) {
    CLI::App app(entry_.description.summary, entry_.description.name);
    app.set_help_flag();
    bool help = false;
    app.add_flag("-h,--help", help);
    app.add_option("-o,--output", options.output);
    app.add_option("--spec", options.spec);
    app.add_flag("--dump-spec", options.dump_spec);
    app.add_flag("--check", options.check);
    app.add_flag("--json", options.json);
    app.add_flag("--ascii", options.ascii);
    app.add_flag("--quiet", options.quiet);
    app.add_flag("--schema", options.schema);
    app.add_flag("--docs", options.docs);
    app.add_flag("--describe", options.describe);
    app.add_flag("--version", options.version);
    app.add_option("--threads", options.threads)->check(CLI::Range(0, 1024));
    for (const Port& port : entry_.description.inputs) {
      auto* option = app.add_option("--" + port.name, options.ports[port.name]);
      if (port.many) option->expected(1, 10000);
      else option->expected(1);
    }
    std::map<std::string, std::string> values;
    std::vector<std::string> names;
    std::set<std::string> flags;
    visit_options(*entry_.params, nullptr, "", [&](const std::string& name, const Field& field, void*) {
      names.push_back(name);
      if (field.type.kind == ValueType::Kind::boolean) flags.insert(name);
    });
    // A flag may stand alone: --strict is --strict true.
    for (const std::string& name : names) app.add_option("--" + name, values[name])->expected(flags.count(name) ? 0 : 1, 1);
    app.allow_extras();
    try {
      app.parse(argc_, argv_);
    } catch (const CLI::ParseError& error) {
      return fail({usage(error.what(), fmt::format("see {} --help", entry_.description.name))}, options.json);
    }
    if (help) {
      print_help();
      return 0;
    }
    Issues issues;
    for (const std::string& extra : app.remaining()) {
      if (extra.size() < 2 || extra[0] != '-') {
        options.positional.push_back(extra);
        continue;
      }
      std::vector<std::string> known = names;
      for (const Port& port : entry_.description.inputs) known.push_back(port.name);
      for (const CommonOption& common : common_options) known.emplace_back(split(common.name, ',').back().substr(2));
      const std::string word = extra.substr(extra.find_first_not_of('-') == std::string::npos ? 0 : extra.find_first_not_of('-'));
      const auto near = nearest_word(word.substr(0, word.find('=')), known);
      issues.push_back(usage(fmt::format("unknown option '{}'", extra), near ? fmt::format("did you mean '--{}'?", *near) : fmt::format("see {} --help", entry_.description.name)));
    }
    for (const std::string& name : names) {
      if (app.count("--" + name)) options.params.emplace_back(name, flags.count(name) && values[name].empty() ? "true" : values[name]);
    }
    for (const Port& port : entry_.description.inputs) {
      if (!app.count("--" + port.name)) options.ports.erase(port.name);
    }
    if (!issues.empty()) return fail(issues, options.json);
    return std::nullopt;
  }

  void print_description() {
    std::string ports;
    for (const Port& port : entry_.description.inputs) {
      ports += fmt::format("{}{{\"name\": \"{}\", \"required\": {}, \"many\": {}}}", ports.empty() ? "" : ", ", port.name, port.required, port.many);
    }
    fmt::print("{{\"name\": \"{}\", \"version\": {}, \"output\": \"{}\", \"inputs\": [{}]}}\n", entry_.description.name, entry_.description.version,
               extension(entry_.description.output), ports);
  }

  void print_help() {
    const Description& d = entry_.description;
    fmt::print("{}\n\nExample:\n  {}\n\nUsage: {}", d.summary, d.example, d.name);
    for (const Port& port : d.inputs) {
      const std::string word = port.many ? "--" + port.name + " FILE…" : port.name;
      if (port.required) fmt::print(" {}", word);
      else fmt::print(" [{}]", word);
    }
    fmt::print("{}\n", d.output_optional ? " [-o OUT] [options]" : " -o OUT [options]");
    if (!d.inputs.empty()) fmt::print("\nInputs (in this order, or by name):\n");
    for (const Port& port : d.inputs) fmt::print("  --{:<24} {}{}\n", port.name + " FILE" + (port.many ? "…" : ""), port.doc, port.required ? "" : " (optional)");
    const std::shared_ptr<void> defaults = entry_.make_params();
    if (!entry_.params->fields.empty()) fmt::print("\nParameters (here or in the spec):\n");
    visit_options(*entry_.params, defaults.get(), "", [&](const std::string& name, const Field& field, void*) {
      fmt::print("  --{} {}\n      {}\n", name, type_word(field.type), io::field_summary(field));
    });
    fmt::print("\nOptions:\n");
    for (const CommonOption& option : common_options) fmt::print("  {:<16} {}\n", option.name, option.doc);
    if (!d.details.empty()) fmt::print("\n{}\n", d.details);
    fmt::print("\n{}\n", help_footer);
  }

  /// Positional files go to the ports that are not named, in order.
  Issues assign_inputs(Options& options) {
    Issues issues;
    std::size_t next = 0;
    for (const Port& port : entry_.description.inputs) {
      if (options.ports.count(port.name)) continue;
      if (!port.many && next < options.positional.size()) options.ports[port.name] = {options.positional[next++]};
      else if (port.required) issues.push_back(usage(fmt::format("the input '{}' is missing ({})", port.name, port.doc), fmt::format("give a file, or --{} FILE", port.name)));
    }
    for (; next < options.positional.size(); ++next) {
      issues.push_back(usage(fmt::format("there is no place for '{}'", options.positional[next]), fmt::format("see {} --help", entry_.description.name)));
    }
    return issues;
  }

  Issues check_inputs(const Run& run) {
    Issues issues;
    for (const Port& port : entry_.description.inputs) {
      if (!run.has(port.name)) continue;
      if (port.kind == FileKind::garment) append(issues, run.garment(port.name).issues());
      if (port.kind == FileKind::support) append(issues, run.support(port.name).issues());
    }
    return issues;
  }

  int guarded() {
    Options options;
    if (const auto code = parse_command_line(options)) return *code;
    const Description& description = entry_.description;
    if (options.version) {
      fmt::print("{} {} (result version {})\n", description.name, TOILE_VERSION, description.version);
      return 0;
    }
    const std::shared_ptr<void> params = entry_.make_params();
    if (options.dump_spec || options.schema || options.docs || options.describe) {
      if (options.describe) print_description();
      else if (options.dump_spec) fmt::print("# {}: {}\n{}", description.name, description.summary, io::commented_yaml(*entry_.params, params.get()));
      else if (options.schema) fmt::print("{}", io::json_schema(*entry_.params, description.name));
      else fmt::print("{}", docs_page(entry_));
      return 0;
    }
    set_thread_count(options.threads);

    Issues issues = assign_inputs(options);
    if (options.output.empty() && !description.output_optional && !options.check) issues.push_back(usage("no output is named", "add -o FILE"));
    if (!issues.empty()) return fail(issues, options.json);

    // Parameters: defaults, then the spec, then the command line.
    std::vector<std::string> given;
    for (const auto& [name, text] : options.params) given.push_back(name);
    if (!options.spec.empty()) {
      const auto spec = io::read_file(options.spec);
      Issues found = spec ? io::read_record(*spec, options.spec, *entry_.params, params.get(), io::Units::required) : spec.issues();
      // What the command line gives need not stand in the spec.
      std::erase_if(found, [&](const Issue& issue) {
        return issue.code == "missing_key" && std::any_of(given.begin(), given.end(), [&](const std::string& name) { return issue.what.starts_with(fmt::format("the key '{}' ", name)); });
      });
      append(issues, found);
    }
    for (const auto& [name, text] : options.params) {
      void* record = params.get();
      const Field* field = find_field(*entry_.params, name, &record);
      TOILE_CHECK(field, "option '{}'", name);
      Issues found = io::read_field(text, *field, record);
      for (Issue& issue : found) issue.place.item = "--" + name;
      append(issues, found);
    }
    if (issues.empty()) {
      // A required key may come from the command line, so it is looked for only where there is no spec to demand it.
      if (options.spec.empty()) {
        for (const Field& field : entry_.params->fields) {
          if (field.required && std::find(given.begin(), given.end(), field.key) == given.end()) {
            issues.push_back(usage(fmt::format("the parameter '{}' is missing ({})", field.key, field.doc), fmt::format("give it in --spec FILE or as --{}", field.key)));
          }
        }
      }
      if (issues.empty()) {
        issues = validate_record(*entry_.params, params.get());
        for (Issue& issue : issues) issue.place.file = options.spec.empty() ? "command line" : options.spec;
      }
    }

    Run run;
    run.inputs_ = options.ports;
    run.output_path_ = options.output;
    run.quiet_ = options.quiet;
    run.json_ = options.json;
    std::map<std::string, std::string> hashes;
    for (const auto& [port, paths] : run.inputs_) {
      for (std::size_t i = 0; i < paths.size(); ++i) {
        auto bytes = io::read_file(paths[i]);
        if (!bytes) {
          append(issues, bytes.issues());
          continue;
        }
        hashes[paths.size() == 1 ? port : fmt::format("{}[{}]", port, i)] = content_hash(*bytes);
        run.contents_[paths[i]] = std::move(*bytes);
      }
    }
    if (!issues.empty()) return fail(issues, options.json);
    if (options.check) {
      issues = check_inputs(run);
      if (!issues.empty()) return fail(issues, options.json);
      if (options.json) fmt::print("{{\"stage\": \"{}\", \"ok\": true}}\n", description.name);
      else if (!options.quiet) fmt::print("spec and inputs are valid\n");
      return 0;
    }

    catch_signals();
    if (entry_.normalize) entry_.normalize(params.get());
    Result<Output> result = entry_.run(params.get(), run);
    if (!result) return fail(result.issues(), options.json);
    Output& output = *result;

    const io::Encoding encoding = options.ascii ? io::Encoding::ascii : io::Encoding::binary;
    std::string bytes;
    mesh::RouteEntry card{description.name, description.version, io::flow_yaml(*entry_.params, params.get()), hashes};
    if (auto* garment = std::get_if<mesh::GarmentMesh>(&output.artefact)) {
      garment->route.push_back(std::move(card));
      issues = mesh::validate(*garment);
      if (issues.empty()) bytes = io::format_garment(*garment, encoding);
    } else if (auto* support = std::get_if<mesh::SupportMesh>(&output.artefact)) {
      support->route.push_back(std::move(card));
      issues = mesh::validate(*support);
      if (issues.empty()) bytes = io::format_support(*support, encoding);
    } else {
      bytes = std::move(std::get<std::string>(output.artefact));
    }
    // An invalid result is a fault of the program, never of its user.
    if (!issues.empty()) throw std::logic_error("the result is invalid: " + to_string(issues.front()));

    const bool to_stdout = options.output.empty();
    for (const Output::SideFile& side : output.side_files) append(issues, io::write_file(side.path, side.bytes));
    if (issues.empty() && !to_stdout) append(issues, io::write_file(options.output, bytes));
    if (!issues.empty()) return fail(issues, options.json);
    if (to_stdout) std::fwrite(bytes.data(), 1, bytes.size(), stdout);

    const int code = exit_code(output.findings);
    if (options.json) {
      if (!to_stdout) print_json(run, output.findings, code == 0);
      return code;
    }
    if (!options.quiet && !to_stdout) {
      for (const auto& fact : run.facts_) fmt::print("{}: {}\n", fact.key.substr(0, fact.key.find(" [")), fact.plain);
    }
    for (const Issue& finding : output.findings) fmt::print(stderr, "{}\n", to_string(finding));
    return code;
  }

  void print_json(const Run& run, const Issues& findings, bool ok) {
    std::string text = fmt::format("{{\"stage\": \"{}\", \"ok\": {}, \"output\": ", entry_.description.name, ok);
    text += quote(run.output_path_);  // the values of facts are JSON already
    text += ", \"facts\": {";
    for (std::size_t i = 0; i < run.facts_.size(); ++i) text += fmt::format("{}{}: {}", i ? ", " : "", quote(run.facts_[i].key), run.facts_[i].text);
    text += fmt::format("}}, \"warnings\": {}, \"issues\": {}}}", issues_json(run.warnings_), issues_json(findings));
    fmt::print("{}\n", text);
  }

  static std::string quote(const std::string& text) {
    std::string quoted = "\"";
    for (char c : text) {
      if (c == '"' || c == '\\') quoted += '\\';
      if (static_cast<unsigned char>(c) < 0x20) quoted += fmt::format("\\u{:04x}", static_cast<int>(c));
      else quoted += c;
    }
    return quoted + "\"";
  }

  const Entry& entry_;
  int argc_;
  char** argv_;
};

int run_program(const Entry& entry, int argc, char** argv) { return Program(entry, argc, argv).run(); }

}  // namespace toile::stage
