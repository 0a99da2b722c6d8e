#include "toile/stage/pipeline.h"

#include <algorithm>
#include <filesystem>

#include "toile/base/text.h"

namespace toile::stage {
namespace fs = std::filesystem;
namespace {

/// Names become files and make targets.
bool plain_name(const std::string& name) {
  return !name.empty() && name.front() != '-' && name.front() != '.' && std::all_of(name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.'; });
}

template <class Map>
std::vector<std::string> keys(const Map& map) {
  std::vector<std::string> result;
  for (const auto& [key, value] : map) result.push_back(key);
  return result;
}

std::string resolved(const std::string& folder, const std::string& file) { return (fs::path(folder) / file).lexically_normal().string(); }

/// A path as a target or prerequisite.
std::string make_word(const std::string& path) {
  std::string word;
  for (char c : path) {
    if (c == ' ' || c == '#' || c == '%' || c == ':') word += '\\';
    word += c;
    if (c == '$') word += '$';
  }
  return word;
}

/// A word of a recipe: quoted for the shell, then for make.
std::string shell_word(const std::string& text) {
  std::string word;
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_-./=,+@").find(c) != std::string_view::npos; });
  if (plain) return text;
  word = "'";
  for (char c : text) {
    if (c == '\'') word += "'\\''";
    else word += c;
    if (c == '$') word += '$';
  }
  return word + "'";
}

}  // namespace

Result<Plan> make_plan(const Pipeline& pipeline, const std::string& pipeline_file, const std::string& pipeline_folder, const std::string& build_folder, const ToolQuery& query) {
  Issues issues;
  const auto add = [&](const std::string& item, std::string code, std::string what, std::string remedy) {
    issues.push_back({std::move(code), {.file = pipeline_file, .item = item}, std::move(what), std::move(remedy)});
  };
  if (!plain_name(pipeline.garment)) add("garment", "bad_name", fmt::format("'{}' cannot name a folder", pipeline.garment), "use letters, digits, '_', '-' and '.'");
  std::map<std::string, std::string> inputs;
  for (const auto& [name, file] : pipeline.inputs) {
    inputs[name] = resolved(pipeline_folder, file);
    if (!fs::is_regular_file(inputs[name])) add("inputs." + name, "missing_file", fmt::format("there is no file '{}'", inputs[name]), "correct the path; it is relative to the pipeline file");
  }
  Plan plan;
  plan.garment = pipeline.garment;
  plan.folder = resolved(build_folder, pipeline.garment);

  std::map<std::string, ToolInfo> tools;
  std::map<std::string, std::string> outputs;
  std::map<std::string, std::pair<std::string, std::string>> beside;  // stage.parameter -> stage, file
  for (const auto& [name, stage] : pipeline.stages) {
    if (!plain_name(name)) add("stages." + name, "bad_name", fmt::format("'{}' cannot name a file", name), "use letters, digits, '_', '-' and '.'");
    if (!tools.count(stage.tool)) {
      auto info = query(stage.tool);
      if (info) {
        tools[stage.tool] = std::move(*info);
      } else {
        for (const Issue& issue : info.issues()) add("stages." + name + ".tool", issue.code, issue.what, issue.remedy);
        continue;
      }
    }
    outputs[name] = plan.folder + "/" + name + tools[stage.tool].extension;
    for (const auto& [key, file] : stage.out) {
      if (!plain_name(file)) add("stages." + name + ".out." + key, "bad_name", fmt::format("'{}' cannot name a file", file), "use letters, digits, '_', '-' and '.'");
      beside[name + "." + key] = {name, plan.folder + "/" + file};
    }
  }

  std::map<std::string, std::vector<std::string>> before;  // stage -> stages it needs
  std::map<std::string, Step> steps;
  for (const auto& [name, stage] : pipeline.stages) {
    const std::string item = "stages." + name;
    if (!tools.count(stage.tool)) continue;
    const ToolInfo& tool = tools[stage.tool];
    Step step{name, outputs[name], {tool.path}, {tool.path}};
    std::vector<std::string> port_names;
    for (const ToolInfo::Port& port : tool.ports) port_names.push_back(port.name);
    for (const auto& [port_name, references] : stage.in) {
      const auto port = std::find_if(tool.ports.begin(), tool.ports.end(), [&](const ToolInfo::Port& p) { return p.name == port_name; });
      if (port == tool.ports.end()) {
        add(item + ".in", "unknown_port", fmt::format("{} has no input '{}'", stage.tool, port_name), suggestion(port_name, port_names));
        continue;
      }
      if (!port->many && references.size() != 1) add(item + ".in." + port_name, "wrong_count", fmt::format("{} files are given where one is taken", references.size()), "give one");
      step.command.push_back("--" + port_name);
      for (const std::string& reference : references) {
        std::string file;
        if (reference.starts_with("$")) {
          const auto found = inputs.find(reference.substr(1));
          if (found == inputs.end()) {
            add(item + ".in." + port_name, "unknown_reference", fmt::format("there is no input '{}'", reference), suggestion(reference.substr(1), keys(inputs)));
            continue;
          }
          file = found->second;
        } else if (const auto found = beside.find(reference); found != beside.end()) {
          // The file is there once the stage's result is.
          step.needs.push_back(outputs[found->second.first]);
          before[name].push_back(found->second.first);
          step.command.push_back(found->second.second);
          continue;
        } else {
          if (!pipeline.stages.count(reference)) {
            add(item + ".in." + port_name, "unknown_reference", fmt::format("there is no stage '{}'", reference), suggestion(reference, keys(pipeline.stages)) + " (an input is written $name)");
            continue;
          }
          file = outputs[reference];
          before[name].push_back(reference);
        }
        step.needs.push_back(file);
        step.command.push_back(file);
      }
    }
    for (const ToolInfo::Port& port : tool.ports) {
      if (port.required && !stage.in.count(port.name)) add(item + ".in", "missing_port", fmt::format("{} needs the input '{}'", stage.tool, port.name), fmt::format("add `{}: …`", port.name));
    }
    if (!stage.spec.empty()) {
      const std::string spec = resolved(pipeline_folder, stage.spec);
      if (!fs::is_regular_file(spec)) add(item + ".spec", "missing_file", fmt::format("there is no file '{}'", spec), "correct the path; it is relative to the pipeline file");
      step.needs.push_back(spec);
      step.command.insert(step.command.end(), {"--spec", spec});
    }
    for (const auto& [key, value] : stage.set) step.command.insert(step.command.end(), {"--" + key, value});
    for (const auto& [key, file] : stage.out) step.command.insert(step.command.end(), {"--" + key, plan.folder + "/" + file});
    step.command.insert(step.command.end(), {"-o", step.output});
    steps[name] = std::move(step);
  }

  // Stages in an order in which each comes after those it needs; by name among equals.
  std::map<std::string, int> state;  // 1: being visited, 2: done
  const std::function<void(const std::string&)> visit = [&](const std::string& name) {
    if (state[name] == 2) return;
    if (state[name] == 1) return add("stages." + name, "cycle", "the stage needs its own result", "break the circle of `in` references");
    state[name] = 1;
    for (const std::string& needed : before[name]) visit(needed);
    state[name] = 2;
    if (steps.count(name)) plan.steps.push_back(steps[name]);
  };
  for (const auto& [name, stage] : pipeline.stages) visit(name);

  const std::vector<std::string> wanted = pipeline.results.empty() ? keys(pipeline.stages) : pipeline.results;
  for (const std::string& name : wanted) {
    if (!pipeline.stages.count(name)) add("results", "unknown_reference", fmt::format("there is no stage '{}'", name), suggestion(name, keys(pipeline.stages)));
    else plan.results.push_back(outputs[name]);
  }
  if (!issues.empty()) return issues;
  return plan;
}

std::string make_rules(const Plan& plan) {
  std::string out = "# Made by `toile plan`; changes here are lost.\n.DELETE_ON_ERROR:\n.SUFFIXES:\nMAKEFLAGS += --no-builtin-rules\n\n.PHONY: all\nall:";
  for (const std::string& result : plan.results) out += " \\\n  " + make_word(result);
  out += "\n";
  for (const Step& step : plan.steps) {
    const fs::path output(step.output);
    const std::string rejected = (output.parent_path() / (output.stem().string() + ".rejected" + output.extension().string())).string();
    std::string command;
    for (const std::string& word : step.command) command += (command.empty() ? "" : " ") + shell_word(word);
    const std::string stamp = (output.parent_path() / ("." + step.stage + ".command")).string();
    out += fmt::format("\n{}: {}", make_word(step.output), make_word(stamp));
    for (const std::string& need : step.needs) out += " \\\n  " + make_word(need);
    out += fmt::format("\n\t@echo '[{}] {}'\n", step.stage, fs::path(step.command.front()).filename().string());
    out += fmt::format("\t@rm -f {0} {1}; {2} || {{ code=$$?; if [ -e {0} ]; then mv -f {0} {1}; echo '[{3}] failed with exit code '$$code'; its result is kept as' {1} >&2; fi; echo $$code > {4}; exit $$code; }}\n",
                       shell_word(step.output), shell_word(rejected), command, step.stage, shell_word(plan.folder + "/.exit_code"));
  }
  return out;
}

}  // namespace toile::stage
