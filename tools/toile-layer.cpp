// Says what the panels are made of.
#include "toile/inspect/bill.h"
#include "toile/io/fabric_yaml.h"
#include "toile/stage/stage.h"
#include "toile/tailor/layer.h"

#include <algorithm>

namespace {

using namespace toile;

struct LayerStage {
  using Params = tailor::LayerParams;

  static stage::Description description() {
    return {.name = "toile-layer",
            .version = 5,
            .summary = "Gives each panel its fabric, bonds layers to panels or regions, lays free layers, sets buttons, hooks, snaps and zips.",
            .example = "toile-layer sewn.ply --fabrics samples/fabrics/shirting.yaml -o layered.ply --base shirting",
            .details = "Bonded layers act as one cloth: as parallel networks, as a laminate, or sliding on each other. A region is cut to the grid "
                       "(a triangle belongs to it if its middle does), or follows lines that toile-mesh made edges of the mesh. The summary is the "
                       "bill of materials, which toile-info gives again. docs/tailoring.md says how the equivalent fabric is found.",
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
    for (const Issue& note : layered.notes) run.warn(note);
    const mesh::GarmentMesh& result = layered.garment;
    run.report("laminates", result.laminates.size());
    for (const auto& part : layered.layers) {
      run.report("layer_" + part.name, part.area, "m2");
      if (part.piece_area) run.report("layer_" + part.name + "_off_the_cloth", std::max(0.0, *part.piece_area - part.area), "m2");
    }
    run.report("free_layers", result.free_layers.size());
    run.report("closures", result.closures.size());
    run.report("fasteners", result.fasteners.size());
    run.report("closed_fasteners", static_cast<std::size_t>(std::count_if(result.fasteners.begin(), result.fasteners.end(), [](const auto& fastener) { return fastener.closed; })));
    run.report("farthest_snap", layered.farthest_snap, "m");
    const inspect::Bill bill = inspect::bill_of_materials(result);
    for (const auto& row : bill.fabrics) {
      run.report("area_" + row.fabric, row.area, "m2");
      run.report("mass_" + row.fabric, row.mass, "kg");
    }
    for (const auto& row : bill.trims) run.report("mass_" + row.kind, row.mass, "kg");
    run.report("mass", bill.mass, "kg");
    return stage::Output{std::move(layered.garment), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<LayerStage>(argc, argv); }
