#include "toile/inspect/artefact.h"
#include "toile/inspect/diff.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

struct DiffStage {
  using Params = inspect::DiffParams;

  static stage::Description description() {
    return {.name = "toile-diff",
            .version = 1,
            .summary = "Compares two garments, supports, JSON files or pictures: structure, numbers, meaning.",
            .example = "toile-diff expected.ply draped.ply --mode indexed",
            .details = "Exit code 0: the same within the tolerances; 4: different. The largest change of every column is printed either way. "
                       "Files of other kinds are compared byte by byte.",
            .inputs = {{"a", "the file to compare with", stage::FileKind::any}, {"b", "the file to look at", stage::FileKind::any}},
            .output = stage::FileKind::any,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto a = run.bytes("a"), b = run.bytes("b");
    if (!a) return a.issues();
    if (!b) return b.issues();
    const auto kind = inspect::artefact_kind(*a), other = inspect::artefact_kind(*b);
    inspect::DiffReport report;
    if (kind != other) {
      report.differences.push_back({inspect::DiffLayer::structure, "file", "the two are of different kinds"});
    } else if (kind == inspect::Artefact::garment) {
      const auto p = run.garment("a"), q = run.garment("b");
      Issues issues = p.issues();
      append(issues, q.issues());
      if (!issues.empty()) return issues;
      report = inspect::diff(params, *p, *q);
    } else if (kind == inspect::Artefact::support) {
      const auto p = run.support("a"), q = run.support("b");
      Issues issues = p.issues();
      append(issues, q.issues());
      if (!issues.empty()) return issues;
      report = inspect::diff(params, *p, *q);
    } else if (kind == inspect::Artefact::json) {
      auto compared = inspect::diff_json(params, *a, *b);
      if (!compared) return compared.issues();
      report = std::move(*compared);
    } else if (kind == inspect::Artefact::png && *a != *b) {
      const auto p = inspect::decode_png(*a, run.path("a")), q = inspect::decode_png(*b, run.path("b"));
      Issues issues = p.issues();
      append(issues, q.issues());
      if (!issues.empty()) return issues;
      report = inspect::diff(params, *p, *q);
    } else if (*a != *b) {
      const auto at = static_cast<std::size_t>(std::mismatch(a->begin(), a->begin() + static_cast<std::ptrdiff_t>(std::min(a->size(), b->size())), b->begin()).first - a->begin());
      report.differences.push_back({inspect::DiffLayer::structure, "file", fmt::format("{} and {} bytes; the first difference is at byte {}", a->size(), b->size(), at)});
    }
    stage::Output output{run.json() ? inspect::to_json(report).dump() : inspect::to_text(report), {}, {}};
    if (!report.same()) {
      output.findings.push_back(Issue{"different", {.file = run.path("b")}, fmt::format("differs from {} in {} points", run.path("a"), report.differences.size()), "see the list of differences", Category::check});
    }
    run.report("same", report.same());
    run.report("differences", report.differences.size());
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<DiffStage>(argc, argv); }
