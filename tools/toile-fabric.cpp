// Shows what a fabric card comes to.
#include "toile/inspect/fabric_sheet.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

enum class Show { figures, plot, curves, card };

struct FabricParams {
  Show show = Show::figures;
  int width = 1200;
  int height = 900;
  static void describe(auto& f) {
    f(&FabricParams::show, {.key = "show", .doc = "figures: text, or JSON with --json; plot: PNG; curves: CSV; card: the data as one KES-F card in SI"});
    f(&FabricParams::width, {.key = "width", .doc = "of the plot, in pixels", .min = 400, .max = 8000});
    f(&FabricParams::height, {.key = "height", .doc = "of the plot, in pixels", .min = 300, .max = 8000});
  }
};

}  // namespace

template <>
struct toile::Choices<Show> {
  static constexpr std::array names{std::pair{"figures", Show::figures}, std::pair{"plot", Show::plot}, std::pair{"curves", Show::curves}, std::pair{"card", Show::card}};
};

namespace {

struct FabricStage {
  using Params = FabricParams;

  static stage::Description description() {
    return {.name = "toile-fabric",
            .version = 1,
            .summary = "Shows what fabric data come to, and whether such a fabric can exist.",
            .example = "toile-fabric samples/fabrics/shirting.yaml --show plot -o shirting.png",
            .details = "Reads KES-F or FAST data, engineering constants or measured curves, and derives the constitutive data that the simulation uses. "
                       "What is unusual for woven apparel is a warning; what no fabric has is an error (exit code 4). docs/fabric.md describes the "
                       "file and the ranges, docs/mechanics.md the formulas.",
            .inputs = {{"fabric", "fabric data (YAML)", stage::FileKind::fabric}},
            .output = stage::FileKind::any,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string text, run.bytes("fabric"));
    const std::string& file = run.path("fabric");
    TOILE_TRY(const fabric::Measured measured, io::read_record<fabric::Measured>(text, file));
    TOILE_TRY(const inspect::FabricSheet sheet, inspect::fabric_sheet(measured));
    stage::Output output;
    switch (params.show) {
      case Show::figures: output.artefact = run.json() ? inspect::fabric_json(sheet).dump(3) : inspect::fabric_text(sheet); break;
      case Show::curves: output.artefact = inspect::fabric_csv(sheet); break;
      case Show::card: output.artefact = io::block_yaml(sheet.card); break;
      case Show::plot: {
        auto png = inspect::encode_png(inspect::draw_charts(inspect::fabric_charts(sheet), {.width = params.width, .height = params.height, .columns = 2}));
        if (!png) {
          Issues issues = png.issues();
          for (Issue& issue : issues) issue.remedy += ", or take --show curves";
          return issues;
        }
        output.artefact = std::move(*png);
        break;
      }
    }
    output.findings = sheet.plausibility.findings;
    for (Issue& issue : output.findings) issue.place.file = file;
    // Text on a terminal has them already.
    if (params.show == Show::figures && run.output_path().empty()) return output;
    for (Issue warning : sheet.plausibility.warnings) {
      warning.place.file = file;
      run.warn(warning);
    }
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<FabricStage>(argc, argv); }
