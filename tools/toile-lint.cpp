// Finds everything that is wrong with a pattern or a garment at once.
#include <algorithm>

#include "toile/inspect/artefact.h"
#include "toile/inspect/json.h"
#include "toile/io/pattern_yaml.h"
#include "toile/stage/stage.h"
#include "toile/tailor/lint.h"

namespace {

using namespace toile;

struct Params {
  bool strict = false;
  static void describe(auto& f) { f(&Params::strict, {.key = "strict", .doc = "warnings count as errors"}); }
};

/// What a file holds, and what is wrong with it.
struct Report {
  std::string kind;
  std::vector<std::pair<std::string, std::size_t>> counts;
  Issues errors, warnings;
};

Result<Report> lint_pattern(const std::string& text, const std::string& path) {
  io::PatternReading reading = io::read_pattern_form(text, path);
  Report report{.kind = "pattern"};
  const pattern::Pattern& whole = reading.file.pattern;
  for (const Issue& issue : reading.issues) {
    // What cannot be read at all is not a pattern with faults.
    if (issue.code == "bad_yaml") return reading.issues;
  }
  if (whole.pieces.empty() && !reading.issues.empty()) return reading.issues;
  report.errors = reading.issues;

  // The geometry of pieces that were read whole, up to keys that nobody knows.
  io::PatternFile sound = reading.file;
  std::erase_if(sound.pattern.pieces, [&](const pattern::Piece& piece) {
    return std::any_of(reading.issues.begin(), reading.issues.end(), [&](const Issue& issue) {
      const std::string& item = issue.place.item;
      return issue.code != "unknown_key" && (item == piece.name || item.starts_with(piece.name + "."));
    });
  });
  if (!sound.pattern.pieces.empty() || reading.issues.empty()) append(report.errors, io::check(sound));
  report.warnings = io::advice(sound);

  std::size_t panels = 0, edges = 0, holes = 0, lines = 0, notches = 0, marks = 0;
  for (const auto& piece : whole.pieces) {
    panels += static_cast<std::size_t>(std::max(piece.copies, 0));
    edges += piece.outline.size();
    for (const auto& hole : piece.holes) edges += hole.edges.size();
    holes += piece.holes.size();
    lines += piece.lines.size();
    notches += piece.notches.size();
    marks += piece.marks.size();
  }
  report.counts = {{"pieces", whole.pieces.size()},
                   {"panels", panels},
                   {"edges", edges},
                   {"holes", holes},
                   {"lines", lines},
                   {"notches", notches},
                   {"marks", marks}};
  return report;
}

Result<Report> lint_garment(const stage::Run& run, const std::string& path) {
  Report report{.kind = "garment"};
  const auto garment = run.garment("file");
  if (!garment) {
    const Issues& issues = garment.issues();
    if (std::any_of(issues.begin(), issues.end(), [](const Issue& issue) { return issue.code != "invalid_mesh"; }))
      return issues;
    report.errors = issues;
    return report;
  }
  const tailor::Lint found = tailor::lint(*garment);
  report.errors = found.errors;
  report.warnings = found.warnings;
  for (Issues* list : {&report.errors, &report.warnings}) {
    for (Issue& issue : *list) issue.place.file = path;
  }
  report.counts = {{"panels", garment->panels.size()},
                   {"vertices", static_cast<std::size_t>(garment->vertex_count())},
                   {"faces", static_cast<std::size_t>(garment->face_count())},
                   {"runs", garment->runs.size()},
                   {"seams", garment->seams.size()},
                   {"laminates", garment->laminates.size()}};
  return report;
}

inspect::Json to_json(const Issues& issues) {
  auto list = inspect::Json::array();
  for (const Issue& issue : issues) {
    auto entry = inspect::Json::object();
    entry.set("code", issue.code).set("item", issue.place.item);
    entry.set("line", issue.place.line).set("column", issue.place.column);
    list.push(entry.set("what", issue.what).set("remedy", issue.remedy));
  }
  return list;
}

struct LintStage {
  using Params = ::Params;

  static stage::Description description() {
    return {.name = "toile-lint",
            .version = 1,
            .summary = "Finds everything that is wrong with a pattern or a garment at once.",
            .example = "toile-lint samples/patterns/tee.yaml",
            .details =
                "Patterns: unknown keys and points, open outlines, crossings, edges without length, darts, lines, "
                "holes and marks off the cloth, "
                "notches off the border, missing grain, names used twice, and warnings about what is probably not "
                "meant: legs of a dart "
                "that differ, lines on edges or just short of them, tiny edges, pieces drawn twice. Garments: "
                "everything that a reader "
                "checks, turned and degenerate triangles, named lines off the mesh; warnings about sharp triangles, "
                "faces without fabric, "
                "seams that are apart. Faults end with exit code 4; what is no pattern and no garment with 3. "
                "docs/pattern.md lists the checks.",
            .inputs = {{.name = "file", .doc = "pattern (YAML) or garment (PLY)", .kind = stage::FileKind::any}},
            .output = stage::FileKind::any,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const std::string& path = run.path("file");
    TOILE_TRY(const std::string bytes, run.bytes("file"));
    const inspect::Artefact artefact = inspect::artefact_kind(bytes);
    if (artefact == inspect::Artefact::support || artefact == inspect::Artefact::png ||
        artefact == inspect::Artefact::json) {
      return Issue{"unknown_kind",
                   {.file = path},
                   "this is neither a pattern nor a garment",
                   "give a pattern (YAML) or a garment (PLY)"};
    }
    auto report = artefact == inspect::Artefact::garment ? lint_garment(run, path) : lint_pattern(bytes, path);
    if (!report) return report.issues();
    if (params.strict) {
      append(report->errors, report->warnings);
      report->warnings.clear();
    }
    for (Issue& issue : report->errors) issue.category = Category::check;

    std::string text;
    if (run.json()) {
      auto json = inspect::Json::object();
      json.set("file", path).set("kind", report->kind).set("ok", report->errors.empty());
      for (const auto& [name, number] : report->counts) json.set(name, number);
      json.set("errors", to_json(report->errors)).set("warnings", to_json(report->warnings));
      text = json.dump();
    } else {
      text = fmt::format("{}: {}", path, report->kind);
      for (const auto& [name, number] : report->counts) text += number > 0 ? fmt::format(", {} {}", name, number) : "";
      const auto several = [](std::size_t number, const char* word) {
        return fmt::format("{} {}{}", number == 0 ? "no" : std::to_string(number), word, number == 1 ? "" : "s");
      };
      text += fmt::format("; {}, {}\n", several(report->errors.size(), "error"),
                          several(report->warnings.size(), "warning"));
    }
    for (const Issue& warning : report->warnings) run.warn(warning);
    return stage::Output{std::move(text), std::move(report->errors), {}};
  }
};

}  // namespace

int main(int argc, char** argv) {
  return toile::stage::run_main<LintStage>(argc, argv);
}
