// The virtual laboratory: runs the tests of libs/lab as pipelines of the programs beside this one.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <thread>

#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/lab/experiments.h"
#include "toile/stage/stage.h"

using namespace toile;
namespace fs = std::filesystem;

namespace {

enum class Show { json, table, page };
enum class Models { all, woven, particle };

struct Params {
  std::string only;
  bool list = false;
  bool quick = false;
  bool strict = false;
  Models model = Models::all;
  int jobs = 2;
  Show show = Show::json;
  std::string work = "build/validation/runs";
  std::string page, plots;
  static void describe(auto& f) {
    f(&Params::only, {.key = "only", .doc = "names of tests, with commas between; empty: all"});
    f(&Params::list, {.key = "list", .doc = "only say which tests there are"});
    f(&Params::quick, {.key = "quick", .doc = "a reduced set: fewer meshes, loads and directions"});
    f(&Params::strict, {.key = "strict", .doc = "a target that is missed, or a row without a value, is a finding (exit code 4)"});
    f(&Params::model, {.key = "model", .doc = "model of toile-simulate that is tested"});
    f(&Params::jobs, {.key = "jobs", .doc = "pipelines at a time; the report does not depend on it", .min = 1, .max = 256});
    f(&Params::show, {.key = "show", .doc = "what is written: all rows as JSON, as a table for the terminal, or as the Markdown page"});
    f(&Params::work, {.key = "work", .doc = "folder that gets a folder per test and case, with its files and commands", .local = true});
    f(&Params::page, {.key = "page", .doc = "file for the Markdown page, with its plots in a folder beside it; empty: none", .local = true});
    f(&Params::plots, {.key = "plots", .doc = "folder for the curves as CSV and SVG; empty: none", .local = true});
  }
};

}  // namespace

template <>
struct toile::Choices<Show> {
  static constexpr std::array names{std::pair{"json", Show::json}, std::pair{"table", Show::table}, std::pair{"page", Show::page}};
};
template <>
struct toile::Choices<Models> {
  static constexpr std::array names{std::pair{"all", Models::all}, std::pair{"woven", Models::woven}, std::pair{"particle", Models::particle}};
};

namespace {

fs::path own_folder() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path(".") : self.parent_path();
}

/// Runs a program in a folder, its output and errors into files there. Exit code, or 1 where it could not be run or was killed.
int run_program(const std::vector<std::string>& words, const std::string& folder, const std::string& output, const std::string& errors) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    // Nothing but system calls until the other program has taken over: this one has threads.
    if (::chdir(folder.c_str()) != 0) ::_exit(1);
    const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), err = ::open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (out < 0 || err < 0 || ::dup2(out, 1) < 0 || ::dup2(err, 2) < 0) ::_exit(1);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) < 0) return 1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

std::string quoted(const std::string& word) {
  if (!word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-=") == std::string::npos) return word;
  std::string text = "'";
  for (char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// The last line that is no progress.
std::string last_line(const std::string& text) {
  std::string result;
  for (const std::string& line : split(text, '\n')) {
    if (!trim(line).empty() && line.find(" % ") == std::string::npos) result = trim(line);
  }
  return result;
}

/// Writes a case's files and runs its programs one after the other.
lab::Outcome run_case(const lab::Case& c, const fs::path& folder, bool wants_garment) {
  lab::Outcome outcome;
  const auto stop = [&](std::string why) {
    outcome.trouble = std::move(why);
    return outcome;
  };
  std::string commands = "#!/bin/sh -e\n";
  for (const lab::Step& step : c.steps) {
    std::string line = step.tool.empty() ? "# toile-lab lays the panels edge to edge:" : step.tool;
    for (const std::string& word : step.args) line += " " + quoted(word);
    commands += line + "\n";
  }
  Issues issues = io::write_file(folder / "commands.sh", commands);
  for (const lab::File& file : c.files) append(issues, io::write_file(folder / file.name, file.text));
  if (!issues.empty()) return stop(to_string(issues.front()));
  outcome.converged = true;
  for (std::size_t k = 0; k < c.steps.size(); ++k) {
    const lab::Step& step = c.steps[k];
    if (step.tool.empty()) {
      auto garment = io::read_garment(folder / step.args[0]);
      if (!garment) return stop(to_string(garment.issues().front()));
      issues = io::write_file(folder / step.args[1], io::format_garment(step.edit(std::move(*garment)), io::Encoding::binary));
      if (!issues.empty()) return stop(to_string(issues.front()));
      continue;
    }
    std::vector<std::string> words{(own_folder() / step.tool).string()};
    words.insert(words.end(), step.args.begin(), step.args.end());
    words.insert(words.end(), {"--threads", "1", "--json"});
    const std::string output = fmt::format("{}_{}.json", k + 1, step.tool), errors = fmt::format("{}_{}.log", k + 1, step.tool);
    const int code = run_program(words, folder, output, errors);
    const auto facts = io::read_file(folder / output), log = io::read_file(folder / errors);
    if (code == 130 || stage::Run::interrupted()) return stop("interrupted");
    if (code != 0 && code != 5) {
      const auto failure = facts ? lab::first_issue(*facts) : std::string();
      return stop(fmt::format("{} ended with exit code {}: {}", step.tool, code, failure.empty() && log ? last_line(*log) : failure));
    }
    if (code == 5) outcome.converged = false;
    if (facts) outcome.facts = lab::parse_facts(*facts);
  }
  if (const auto record = io::read_file(folder / "record.csv")) outcome.record = lab::parse_csv(*record);
  if (wants_garment) {
    auto garment = io::read_garment(folder / c.steps.back().args[2]);
    if (!garment) return stop(to_string(garment.issues().front()));
    outcome.garment = std::move(*garment);
  }
  outcome.ran = true;
  return outcome;
}

struct LabStage {
  using Params = ::Params;

  static stage::Description description() {
    return {.name = "toile-lab",
            .version = 1,
            .summary = "Runs the standard tests of textiles and shells on the simulator and reports its error against theory.",
            .example = "toile-lab -o build/validation/report.json --page build/validation/validation.md --jobs 2",
            .details = "Each test is a set of pipelines of the ordinary programs (toile-mesh, toile-sew, toile-layer, toile-simulate ...) on patterns and fabrics that it "
                       "writes into its work folder. A row has reference, value, error, target and a verdict: met, missed, or failed where there is no value. "
                       "The exit code is 0 once every row was run, whatever the verdicts, and 4 with --strict where a target is missed. `make validate` runs all of "
                       "it; docs/validation.md is the page it wrote.",
            .inputs = {},
            .output = stage::FileKind::json,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto names = lab::test_names();
    if (params.list) {
      std::string text;
      for (const auto& [name, title] : names) text += fmt::format("{:<20} {}\n", name, title);
      return stage::Output{text, {}, {}};
    }
    Issues issues;
    std::vector<std::string> only, known;
    for (const auto& [name, title] : names) known.push_back(name);
    for (const std::string& word : split(params.only, ',')) {
      const std::string name(trim(word));
      if (name.empty()) continue;
      only.push_back(name);
      if (std::find(known.begin(), known.end(), name) == known.end()) {
        issues.push_back({"unknown_test", {.item = "--only"}, fmt::format("there is no test '{}'", name), suggestion(name, known), Category::usage});
      }
    }
    if (!issues.empty()) return issues;

    const fs::path work = fs::absolute(params.work).lexically_normal();
    const auto make_folder = [&](const fs::path& folder) {
      std::error_code error;
      fs::create_directories(folder, error);
      if (error || ::access(folder.c_str(), W_OK) != 0) {
        issues.push_back({"cannot_write", {.file = folder}, "the folder cannot be made or written to" + (error ? ": " + error.message() : std::string()), "name another with --work, --page or --plots"});
      }
    };
    make_folder(work);
    const fs::path page_plots = params.page.empty() ? fs::path() : fs::path(params.page).replace_extension();
    if (!params.page.empty()) make_folder(fs::absolute(page_plots));
    if (!params.plots.empty()) make_folder(fs::absolute(params.plots));
    if (!issues.empty()) return issues;

    lab::Scope scope;
    scope.quick = params.quick;
    scope.woven = params.model != Models::particle;
    scope.particle = params.model != Models::woven;
    const std::vector<lab::Experiment> experiments = lab::experiments(scope, only);
    struct Job {
      std::size_t experiment, index;
      fs::path folder;
    };
    std::vector<Job> jobs;
    std::vector<std::vector<lab::Outcome>> outcomes;
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      outcomes.emplace_back(experiments[e].cases.size());
      for (std::size_t i = 0; i < experiments[e].cases.size(); ++i) {
        jobs.push_back({e, i, work / experiments[e].test / experiments[e].cases[i].name});
        std::error_code error;
        fs::remove_all(jobs.back().folder, error);
        make_folder(jobs.back().folder);
      }
    }
    if (!issues.empty()) return issues;

    std::atomic<std::size_t> next{0};
    std::size_t done = 0;
    std::mutex mutex;
    const auto worker = [&] {
      for (std::size_t j = next++; j < jobs.size() && !stage::Run::interrupted(); j = next++) {
        const Job& job = jobs[j];
        const lab::Experiment& e = experiments[job.experiment];
        lab::Outcome outcome = run_case(e.cases[job.index], job.folder, e.wants_garments);
        const std::lock_guard lock(mutex);
        outcomes[job.experiment][job.index] = std::move(outcome);
        run.progress(static_cast<double>(++done) / static_cast<double>(jobs.size()), fmt::format("{} {}", e.test, e.cases[job.index].name));
      }
    };
    std::vector<std::thread> threads;
    for (int t = 0; t < params.jobs; ++t) threads.emplace_back(worker);
    for (std::thread& thread : threads) thread.join();
    if (stage::Run::interrupted()) return Issue{"interrupted", {}, "interrupted; no report was written", "run it again", Category::interrupted};

    lab::Report report;
    report.quick = params.quick;
    for (std::size_t e = 0; e < experiments.size(); ++e) {
      if (!experiments[e].cases.empty()) report.sections.push_back(experiments[e].judge(outcomes[e]));
    }
    const std::vector<lab::Row> rows = report.rows();
    stage::Output output{params.show == Show::json ? lab::to_json(report) : params.show == Show::table ? lab::text_table(rows) : lab::to_markdown(report, page_plots.filename()), {}, {}};
    if (!params.page.empty()) output.side_files.push_back({params.page, lab::to_markdown(report, page_plots.filename())});
    for (const lab::Section& section : report.sections) {
      for (const lab::Plot& plot : section.plots) {
        if (!params.page.empty()) output.side_files.push_back({page_plots / (plot.name + ".svg"), lab::to_svg(plot)});
        if (params.plots.empty()) continue;
        output.side_files.push_back({fs::path(params.plots) / (plot.name + ".csv"), lab::to_csv(plot)});
        output.side_files.push_back({fs::path(params.plots) / (plot.name + ".svg"), lab::to_svg(plot)});
      }
    }
    std::array<int, 3> count{};
    for (const lab::Row& row : rows) {
      ++count[static_cast<std::size_t>(row.verdict())];
      const std::string name = fmt::format("{}, {}, {}, {}, {}", row.test, row.subject, row.model, row.mesh, row.quantity);
      run.report(name, fmt::format("{}: {}", lab::to_text(row.verdict()), lab::figures(row)));
      if (params.strict && row.verdict() != lab::Verdict::met) output.findings.push_back({"target_missed", {.item = name}, lab::figures(row), row.note.empty() ? "see docs/validation.md" : row.note, Category::check});
    }
    run.report("rows", rows.size());
    run.report("met", count[0]);
    run.report("missed", count[1]);
    run.report("failed", count[2]);
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<LabStage>(argc, argv); }
