#include "toile/base/hash.h"
#include "toile/inspect/measures.h"
#include "toile/io/ply.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

struct Params {
  std::vector<inspect::GirthRequest> girths;
  std::vector<inspect::LengthRequest> lengths;
  inspect::Checks checks;
  std::string panels_csv, seams_csv, map;
  static void describe(auto& f) {
    f(&Params::girths, {.key = "girths", .doc = "where the tape is laid round; empty: at chest, bust, waist, hip and seat, as far as the support has them and the garment reaches"});
    f(&Params::lengths, {.key = "lengths", .doc = "finished lengths to report"});
    f(&Params::checks, {.key = "checks", .doc = "conditions for exit code 0; those not named are not checked"});
    f(&Params::panels_csv, {.key = "panels_csv", .doc = "file for the table of panels; empty: none", .local = true});
    f(&Params::seams_csv, {.key = "seams_csv", .doc = "file for the table of seams; empty: none", .local = true});
    f(&Params::map, {.key = "map", .doc = "garment file with strain, tension and ease as columns; empty: none", .local = true});
  }
};

struct MeasureStage {
  using Params = ::Params;

  static stage::Description description() {
    return {.name = "toile-measure",
            .version = 1,
            .summary = "Measures a garment: strain, tension, ease, penetration, seams, girths, lengths, mass.",
            .example = "toile-measure draped.ply --support form.ply -o fit.json --checks.max_strain '3 %'",
            .details = "A violated check is a finding: the figures are written and the exit code is 4. docs/measures.md defines every figure.",
            .inputs = {{"garment", "garment", stage::FileKind::garment}, {"support", "body or dress form", stage::FileKind::support, false}},
            .output = stage::FileKind::json,
            .output_optional = true};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const stage::Fitting fitting, run.fitting("garment"));
    const mesh::GarmentMesh& garment = fitting.garment;
    const inspect::MeasureParams request{params.girths, params.lengths, params.checks};
    const auto figures = inspect::measure(request, garment, fitting.support_or_null());
    if (!figures) return figures.issues();

    inspect::Json json = inspect::to_json(*figures);
    inspect::Json inputs = inspect::Json::object();
    for (const char* port : {"garment", "support"}) {
      if (run.has(port)) inputs.set(port, content_hash(*run.bytes(port)));
    }
    inspect::Json route = inspect::Json::array();
    for (const mesh::RouteEntry& entry : garment.route) route.push(inspect::Json::object().set("stage", entry.stage).set("version", entry.version));
    route.push(inspect::Json::object().set("stage", description().name).set("version", description().version).set("inputs", std::move(inputs)));
    json.set("route", std::move(route));

    stage::Output output{json.dump(), inspect::failed_checks(params.checks, *figures, garment), {}};
    if (!params.panels_csv.empty()) output.side_files.push_back({params.panels_csv, inspect::panels_csv(*figures)});
    if (!params.seams_csv.empty()) output.side_files.push_back({params.seams_csv, inspect::seams_csv(*figures)});
    if (!params.map.empty()) output.side_files.push_back({params.map, io::format_garment(inspect::with_maps(garment, *figures), io::Encoding::binary)});

    run.report("faces", figures->faces);
    if (figures->converged) run.report("converged", *figures->converged);
    run.report("max_strain_warp", figures->warp.max);
    run.report("max_strain_weft", figures->weft.max);
    if (figures->support) run.report("penetrating_vertices", figures->support->penetrating_vertices);
    run.report("self_intersections", figures->self_intersections.value_or(0));
    run.report("max_seam_gap", figures->max_seam_gap, "m");
    run.report("mass", figures->mass, "kg");
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<MeasureStage>(argc, argv); }
