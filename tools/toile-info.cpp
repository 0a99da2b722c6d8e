#include "toile/inspect/artefact.h"
#include "toile/inspect/bill.h"
#include "toile/inspect/info.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

enum class Search { automatic, yes, no };

struct Params {
  Search search = Search::automatic;
  bool bill = false;
  static void describe(auto& f) {
    f(&Params::search, {.key = "search", .doc = "whether intersections are searched for; auto: up to 300000 faces"});
    f(&Params::bill, {.key = "bill", .doc = "only the bill of materials of a garment, as JSON"});
  }
};

}  // namespace

template <>
struct toile::Choices<Search> {
  static constexpr std::array names{std::pair{"auto", Search::automatic}, std::pair{"yes", Search::yes}, std::pair{"no", Search::no}};
};

namespace {

struct InfoStage {
  using Params = ::Params;

  static stage::Description description() {
    return {.name = "toile-info",
            .version = 3,
            .summary = "Tells what is in a garment or a support file.",
            .example = "toile-info draped.ply --support form.ply",
            .details = "Text for people, or JSON with --json, which holds the bill of materials too. docs/measures.md defines the figures, "
                       "docs/tailoring.md the bill.",
            .inputs = {{"file", "garment or support", stage::FileKind::any}, {"support", "body or dress form to compare a garment with", stage::FileKind::support, false}},
            .output = stage::FileKind::any,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto bytes = run.bytes("file");
    if (!bytes) return bytes.issues();
    const std::string& name = run.path("file");
    switch (inspect::artefact_kind(*bytes)) {
      case inspect::Artefact::support: {
        const auto support = run.support("file");
        if (!support) return support.issues();
        return stage::Output{run.json() ? inspect::support_json(name, *support).dump() : inspect::support_text(name, *support), {}, {}};
      }
      case inspect::Artefact::garment: break;
      default:
        return Issue{"unknown_kind", {.file = name}, "this is neither a garment nor a support", "give a file that one of the stages wrote; toile-body brings other bodies in"};
    }
    TOILE_TRY(const stage::Fitting fitting, run.fitting("file"));
    const mesh::GarmentMesh& garment = fitting.garment;
    if (params.bill) return stage::Output{inspect::to_json(inspect::bill_of_materials(garment)).dump(), {}, {}};
    const bool searched = params.search == Search::yes || (params.search == Search::automatic && garment.face_count() <= 300000);
    const auto figures = inspect::measure({}, garment, fitting.support_or_null(), searched ? inspect::Depth::full : inspect::Depth::quick);
    if (!figures) return figures.issues();
    return stage::Output{run.json() ? inspect::garment_json(name, garment, *figures).dump(3) : inspect::garment_text(name, garment, *figures), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<InfoStage>(argc, argv); }
