// Says what the panels are made of.
#include "toile/io/fabric_yaml.h"
#include "toile/stage/stage.h"
#include "toile/tailor/layer.h"

namespace {

using namespace toile;

struct LayerStage {
  using Params = tailor::LayerParams;

  static stage::Description description() {
    return {.name = "toile-layer",
            .version = 3,
            .summary = "Gives each panel its fabric, bonds layers to panels or regions, sets buttons.",
            .example = "toile-layer sewn.ply --fabrics samples/fabrics/shirting.yaml -o layered.ply --base shirting",
            .details = "Bonded layers act as one cloth: stiffnesses, masses and thicknesses of the sheets add up (parallel networks). A region is "
                       "cut to the grid: a triangle belongs to it if its middle does. The summary is the bill of materials. docs/tailoring.md "
                       "says how the equivalent fabric is found.",
            .inputs = {{.name = "garment", .doc = "sewn garment", .kind = stage::FileKind::garment},
                       {.name = "fabrics", .doc = "fabric cards (YAML)", .kind = stage::FileKind::fabric, .many = true}},
            .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh garment, run.garment("garment"));
    Issues issues;
    std::vector<fabric::Card> cards;
    for (std::size_t k = 0; k < run.paths("fabrics").size(); ++k) {
      const auto text = run.bytes("fabrics", k);
      if (!text) {
        append(issues, text.issues());
        continue;
      }
      const auto card = io::read_fabric(*text, run.paths("fabrics")[k]);
      if (card) cards.push_back(*card);
      else append(issues, card.issues());
    }
    if (!issues.empty()) return issues;
    TOILE_TRY(tailor::Layered layered, tailor::layer(garment, cards, params));
    run.report("laminates", layered.garment.laminates.size());
    run.report("fasteners", layered.garment.fasteners.size());
    for (const auto& material : layered.materials) {
      run.report("area_" + material.fabric, material.area, "m2");
      run.report("mass_" + material.fabric, material.mass, "kg");
    }
    run.report("mass", layered.mass, "kg");
    return stage::Output{std::move(layered.garment), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<LayerStage>(argc, argv); }
