// The front program: `toile run PIPELINE`, `toile plan PIPELINE`, `toile list`, `toile STAGE …`.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/pipeline.h"
#include "toile/stage/stage.h"

namespace fs = std::filesystem;
using namespace toile;

namespace {

const char* const help_text =
    "Toile: from 2D patterns and fabric data to 3D garments.\n\n"
    "Example:\n  toile run pipelines/tee/pipeline.yaml --build build/garments\n\n"
    "Usage:\n"
    "  toile run PIPELINE [--build DIR] [--jobs N] [STAGE…]  make the results of a pipeline (or only those stages) with make\n"
    "  toile plan PIPELINE [--build DIR] [-o FILE]           write its make rules (rewritten only when changed); -o - prints them\n"
    "  toile list                                            the programs of the pipeline\n"
    "  toile STAGE …                                         the same as toile-STAGE …\n"
    "  toile --version\n\n"
    "PIPELINE is a pipeline YAML or a folder with a pipeline.yaml. Artefacts go to DIR/GARMENT/STAGE.EXT (default DIR: build).\n\n"
    "Exit codes: 0 ok, 1 internal error, 2 usage, 3 unreadable or invalid input; otherwise that of the stage that failed\n"
    "(4 a check failed, 5 not converged or out of time, 130 interrupted).\n";

fs::path own_folder() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path(".") : self.parent_path();
}

std::vector<std::string> known_tools() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(own_folder(), error)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("toile-") && ::access(entry.path().c_str(), X_OK) == 0) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// A program beside this one; a path with a slash names any other program that keeps the contract.
std::optional<fs::path> find_tool(const std::string& name) {
  const fs::path path = name.find('/') == std::string::npos ? own_folder() / name : fs::path(name);
  if (fs::is_regular_file(path) && ::access(path.c_str(), X_OK) == 0) return fs::absolute(path).lexically_normal();
  return std::nullopt;
}

Result<stage::ToolInfo> query_tool(const std::string& name) {
  const auto path = find_tool(name);
  if (!path) return Issue{"unknown_tool", {}, fmt::format("there is no program '{}'", name), suggestion(name, known_tools())};
  std::string quoted;
  for (char c : path->string()) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(("'" + quoted + "' --describe").c_str(), "r"), ::pclose);
  std::string text;
  char buffer[4096];
  while (pipe) {
    const std::size_t count = std::fread(buffer, 1, sizeof buffer, pipe.get());
    if (count == 0) break;
    text.append(buffer, count);
  }
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.contains("inputs") || !json.contains("output")) {
    return Issue{"unknown_tool", {}, fmt::format("'{}' does not describe itself (--describe)", name), "name a program of this project"};
  }
  stage::ToolInfo info{path->string(), json["output"], {}};
  for (const auto& port : json["inputs"]) info.ports.push_back({port["name"], port["required"], port["many"]});
  return info;
}

int fail(const Issues& issues) {
  for (const Issue& issue : issues) fmt::print(stderr, "{}\n", to_string(issue));
  return stage::exit_code(issues);
}

Issue usage(std::string what) { return {"usage", {}, std::move(what), "see toile --help", Category::usage}; }

/// Writes only what differs, so that make sees what changed.
Issues write_if_changed(const std::string& path, const std::string& bytes) {
  if (fs::exists(path)) {
    const auto old = io::read_file(path);
    if (old && *old == bytes) return {};
  }
  return io::write_file(path, bytes);
}

Result<stage::Plan> read_plan(const std::string& argument, const std::string& build) {
  const fs::path file = fs::is_directory(argument) ? fs::path(argument) / "pipeline.yaml" : fs::path(argument);
  TOILE_TRY(const std::string yaml, io::read_file(file));
  TOILE_TRY(const stage::Pipeline pipeline, io::read_record<stage::Pipeline>(yaml, file));
  return stage::make_plan(pipeline, file, fs::absolute(file).parent_path().lexically_normal(), fs::absolute(build).lexically_normal(), query_tool);
}

/// Rules and one command file a stage: a changed command makes its stage run again.
Issues write_plan(const stage::Plan& plan, const std::string& rules_file) {
  std::error_code error;
  fs::create_directories(plan.folder, error);
  if (error) return {{"cannot_write", {.file = plan.folder}, "the folder cannot be made: " + error.message(), "choose another with --build"}};
  Issues issues;
  for (const stage::Step& step : plan.steps) {
    std::string command;
    for (const std::string& word : step.command) command += word + "\n";
    append(issues, write_if_changed(fmt::format("{}/.{}.command", plan.folder, step.stage), command));
  }
  append(issues, write_if_changed(rules_file, stage::make_rules(plan)));
  return issues;
}

int plan_or_run(bool run, std::vector<std::string> arguments) {
  CLI::App app("", run ? "toile run" : "toile plan");
  app.set_help_flag();
  std::string pipeline, build = "build", output;
  std::vector<std::string> stages;
  int jobs = 1;
  bool help = false;
  app.add_flag("-h,--help", help);
  app.add_option("pipeline", pipeline);
  app.add_option("--build", build);
  if (run) {
    app.add_option("stages", stages);
    app.add_option("-j,--jobs", jobs)->check(CLI::Range(1, 1024));
  } else {
    app.add_option("-o,--output", output);
  }
  try {
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return fail({usage(error.what())});
  }
  if (help) {
    fmt::print("{}", help_text);
    return 0;
  }
  if (pipeline.empty()) return fail({usage("no pipeline is named")});
  auto plan = read_plan(pipeline, build);
  if (!plan) return fail(plan.issues());
  if (!run && output == "-") {
    fmt::print("{}", stage::make_rules(*plan));
    return 0;
  }
  const std::string rules = output.empty() ? plan->folder + "/rules.mk" : output;
  std::vector<std::string> targets;
  std::vector<std::string> known;
  for (const stage::Step& step : plan->steps) known.push_back(step.stage);
  for (const std::string& name : stages) {
    const auto step = std::find_if(plan->steps.begin(), plan->steps.end(), [&](const stage::Step& s) { return s.stage == name; });
    if (step == plan->steps.end()) return fail({{"usage", {}, fmt::format("there is no stage '{}'", name), suggestion(name, known), Category::usage}});
    targets.push_back(step->output);
  }
  if (const Issues issues = write_plan(*plan, rules); !issues.empty()) return fail(issues);
  if (!run) return 0;

  std::vector<std::string> words{"make", "--no-print-directory", "-s", "-f", rules, fmt::format("-j{}", jobs)};
  words.insert(words.end(), targets.begin(), targets.end());
  std::string command;
  for (const std::string& word : words) {
    command += command.empty() ? "'" : " '";
    for (char c : word) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
    command += "'";
  }
  const std::string exit_code_file = plan->folder + "/.exit_code";
  fs::remove(exit_code_file);
  const int status = std::system(command.c_str());
  if (WIFSIGNALED(status) || (WIFEXITED(status) && WEXITSTATUS(status) == 127)) return fail({{"make", {}, "make was interrupted or is not installed", "install make"}});
  if (WEXITSTATUS(status) != 0) {
    fmt::print(stderr, "{}: not all results could be made; what is there stays in {}\n", plan->garment, plan->folder);
    const auto code = fs::exists(exit_code_file) ? io::read_file(exit_code_file) : Result<std::string>(std::string("1"));
    return code ? static_cast<int>(parse_integer(trim(*code)).value_or(1)) : 1;
  }
  if (targets.empty()) targets = plan->results;
  fmt::print("{} is ready:\n", plan->garment);
  for (const std::string& target : targets) fmt::print("  {}\n", fs::relative(target).string());
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.empty() || arguments[0] == "--help" || arguments[0] == "-h" || arguments[0] == "help") {
    fmt::print("{}", help_text);
    return arguments.empty() ? 2 : 0;
  }
  const std::string command = arguments[0];
  if (command == "--version") {
    fmt::print("toile {}\n", TOILE_VERSION);
    return 0;
  }
  if (command == "list") {
    for (const std::string& name : known_tools()) fmt::print("{}\n", name);
    return 0;
  }
  if (command == "run" || command == "plan") return plan_or_run(command == "run", {arguments.begin() + 1, arguments.end()});
  if (const auto tool = find_tool("toile-" + command)) {
    argv[1] = argv[0];
    ::execv(tool->c_str(), argv + 1);
  }
  std::vector<std::string> commands{"run", "plan", "list"};
  for (const std::string& name : known_tools()) commands.push_back(name.substr(6));
  return fail({{"usage", {}, fmt::format("unknown command '{}'", command), suggestion(command, commands), Category::usage}});
} catch (const std::exception& error) {
  fmt::print(stderr, "toile: internal error: {}; please report it with the command line\n", error.what());
  return 1;
}
