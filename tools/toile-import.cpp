#include "toile/io/pattern_import.h"
#include "toile/io/pattern_yaml.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

struct ImportStage {
  using Params = io::ImportParams;

  static stage::Description description() {
    return {.name = "toile-import",
            .version = 2,
            .summary = "Receives a pattern drawn by another program and writes it as pattern YAML.",
            .example =
                "toile-import samples/patterns/freesewing/teagan.json --spec samples/patterns/freesewing/tee.yaml -o "
                "tee.yaml",
            .details =
                "Reads FreeSewing drafts and GarmentCode specifications (JSON); which of them is seen from the file. "
                "The spec says "
                "which parts become pieces and names their edges by runs of drafted points; without a spec all parts "
                "are taken and "
                "edges are named by their ends (e0, e1, ... in GarmentCode). docs/pattern.md tells more.",
            .inputs = {{"draft", "FreeSewing draft or GarmentCode specification (JSON)"}},
            .output = stage::FileKind::pattern};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string bytes, run.bytes("draft"));
    TOILE_TRY(const io::ImportedPattern imported, io::import_pattern(bytes, run.path("draft"), params));
    for (const Issue& note : imported.notes) run.warn(note);
    TOILE_TRY(const auto panels, pattern::cut_panels(imported.pattern));
    double area = 0;
    for (const pattern::CutPanel& panel : panels) area += panel.area;
    run.report("pieces", imported.pattern.pieces.size());
    run.report("panels", panels.size());
    run.report("area", area, "m2");
    stage::Output output{io::format_pattern(imported.pattern), {}, {}};
    if (!params.seams.empty()) {
      if (imported.seams.empty()) {
        return Issue{
            "no_stitches", {.file = run.path("draft")}, "the draft has no stitches for 'seams'", "leave 'seams' out"};
      }
      output.side_files.push_back({params.seams, imported.seams});
    }
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) {
  return stage::run_main<ImportStage>(argc, argv);
}
