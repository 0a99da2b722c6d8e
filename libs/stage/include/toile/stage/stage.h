// What every program has in common. A tool is a few lines:
//
//   struct MeshStage {
//     using Params = tailor::MeshParams;
//     static stage::Description description();
//     static Result<stage::Output> run(const Params& params, stage::Run& run);
//   };
//   int main(int argc, char** argv) { return toile::stage::run_main<MeshStage>(argc, argv); }
//
// run_main owns the command line, --help, --dump-spec, --check, --json, reading and validation before and after, atomic
// writing, the route card and exit codes.
#pragma once

#include "toile/base/fields.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace toile::stage {

/// What an input or output file is; it decides the extension in a pipeline and the check after writing.
enum class FileKind { pattern, garment, support, fabric, measurements, spec, json, csv, png, any };

/// An input: positional on the command line in declared order, or --name FILE.
struct Port {
  std::string name;
  std::string doc;
  FileKind kind = FileKind::any;
  bool required = true;
  bool many = false;  ///< takes several files; only as --name FILE FILE …
};

struct Description {
  std::string name;     ///< the program, e.g. "toile-mesh"
  int version = 1;      ///< raised whenever the same input gives another output
  std::string summary;  ///< one sentence
  std::string example;  ///< a command line that works
  std::string details;  ///< paragraphs for --help and the docs page
  std::vector<Port> inputs;
  FileKind output = FileKind::garment;
  bool output_optional = false;  ///< without -o a text artefact goes to stdout
};

/// A stage's result. Garments and supports are validated and get their route card; a string is written as it is.
struct Output {
  std::variant<mesh::GarmentMesh, mesh::SupportMesh, std::string> artefact;
  /// Findings after the work: `check` makes exit code 4, `not_converged` 5; the output is written all the same.
  Issues findings;
  struct SideFile {
    std::string path, bytes;
  };
  std::vector<SideFile> side_files;  ///< written (atomically) before the main output
};

/// A garment and, where it is given, the support that it is looked at on.
struct Fitting {
  mesh::GarmentMesh garment;
  std::optional<mesh::SupportMesh> support;
  const mesh::SupportMesh* support_or_null() const { return support ? &*support : nullptr; }
};

/// The command line as a stage sees it: its inputs, and ways to speak.
class Run {
 public:
  bool has(const std::string& port) const;
  /// Path of an input; precondition: has(port).
  const std::string& path(const std::string& port) const;
  const std::vector<std::string>& paths(const std::string& port) const;
  Result<mesh::GarmentMesh> garment(const std::string& port) const;
  Result<mesh::SupportMesh> support(const std::string& port) const;
  /// The garment of a port and the support of the port "support", which may be missing. The issues of both.
  Result<Fitting> fitting(const std::string& garment_port) const;
  /// The bytes of an input (one of several: by index).
  Result<std::string> bytes(const std::string& port, std::size_t index = 0) const;

  const std::string& output_path() const { return output_path_; }
  /// --json was given: a stage whose artefact is text for people writes JSON instead.
  bool json() const { return json_; }

  /// One fact for the summary that is printed at the end (text, or JSON with --json), in order of the calls.
  void report(const std::string& key, double value, const std::string& unit = "");
  void report(const std::string& key, long long value);
  void report(const std::string& key, int value) { report(key, static_cast<long long>(value)); }
  void report(const std::string& key, std::size_t value) { report(key, static_cast<long long>(value)); }
  void report(const std::string& key, const std::string& value);
  void report(const std::string& key, const char* value) { report(key, std::string(value)); }
  void report(const std::string& key, bool value);
  /// Shown on stderr and in the JSON summary; does not change the exit code.
  void warn(const Issue& issue);
  /// fraction in 0..1. A progress line on a terminal, a plain line now and then otherwise; nothing with --quiet.
  void progress(double fraction, const std::string& text);
  /// True after Ctrl-C: finish the step, leave what can be resumed, return an issue of Category::interrupted.
  static bool interrupted();

 private:
  friend class Program;
  struct Fact {
    std::string key, text;  ///< text is JSON
    std::string plain;      ///< for people
  };
  std::map<std::string, std::vector<std::string>> inputs_;
  std::map<std::string, std::string> contents_;  ///< path -> bytes
  std::string output_path_;
  std::vector<Fact> facts_;
  Issues warnings_;
  bool quiet_ = false;
  bool json_ = false;
  double last_progress_ = -1;
};

/// A stage with its types erased.
struct Entry {
  Description description;
  std::shared_ptr<const RecordType> params;
  std::function<std::shared_ptr<void>()> make_params;
  std::function<Result<Output>(const void* params, Run&)> run;
  std::function<void(void* params)> normalize;  ///< of specs that mean the same one is run and recorded; may be empty
};

int run_program(const Entry& entry, int argc, char** argv);

/// Exit code of a set of issues: the most basic trouble wins (2, 3, 4, 5, 130); 0 for none.
int exit_code(const Issues& issues);
/// Issues as a JSON array (code, file, line, column, item, what, remedy, category).
std::string issues_json(const Issues& issues);
/// The stage's page in Markdown: what --docs prints and docs/stages/ holds.
std::string docs_page(const Entry& entry);

template <class Stage>
Entry entry() {
  using Params = typename Stage::Params;
  Entry entry{Stage::description(), record_type<Params>(), [] { return std::make_shared<Params>(); },
              [](const void* params, Run& run) { return Stage::run(*static_cast<const Params*>(params), run); }, {}};
  if constexpr (requires(Params& params) { Stage::normalize(params); }) {
    entry.normalize = [](void* params) { Stage::normalize(*static_cast<Params*>(params)); };
  }
  return entry;
}

template <class Stage>
int run_main(int argc, char** argv) {
  return run_program(entry<Stage>(), argc, argv);
}

}  // namespace toile::stage
