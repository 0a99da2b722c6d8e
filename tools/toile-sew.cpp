// Sews the panels of a garment together.
#include "toile/stage/stage.h"
#include "toile/tailor/pleat.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace {

using namespace toile;

struct SewStage {
  using Params = tailor::SewParams;

  static stage::Description description() {
    return {.name = "toile-sew",
            .version = 5,
            .summary = "Sews panels along named edges: border particles of the two sides become the same particle.",
            .example = "toile-sew panels.ply -o sewn.ply --spec pipelines/tee/seams.yaml",
            .details = "A side of a seam is a chain of edges in sewing order: panel.edge, or a part of it, panel.edge(from..to), between named "
                       "points, lengths (120 mm; negative: before the end) or percentages (25 %), either of which may be left out; '-' before it "
                       "runs it backwards. Edges run counter-clockwise round their panel, so one side of a seam between two panels is always run "
                       "backwards. Sides are matched by relative arc length between match points; the side with fewer particles gets more, and so "
                       "does every edge sewn to it elsewhere. Lengths that differ by more than the tolerance need a declared `ease` or `gather`. "
                       "Exit code 4 if lengths differ, a seam is twisted, a chain out of order, or cloth would fold onto itself or close to nothing. "
                       "docs/tailoring.md says how it is done.",
            .inputs = {{.name = "garment", .doc = "flat panels from toile-mesh", .kind = stage::FileKind::garment}},
            .output = stage::FileKind::garment};
  }

  /// Seams are carried out in the order of their names, and recorded so: a shuffled spec gives the same file.
  static void normalize(Params& params) { std::ranges::stable_sort(params.seams, {}, &tailor::SeamSpec::name); }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh garment, run.garment("garment"));
    TOILE_TRY(const tailor::SewParams plain, tailor::expand_pleats(garment, params));
    TOILE_TRY(tailor::Sewn sewn, tailor::sew(garment, plain));
    TOILE_TRY(tailor::Folded folded, tailor::add_folds(sewn.garment, params.folds));
    TOILE_TRY(const tailor::Trimmed finished, tailor::finish_seams(folded.garment, params.seams));
    TOILE_TRY(tailor::Trimmed trimmed, tailor::add_trims(finished.garment, params.trims));
    trimmed.trims.insert(trimmed.trims.begin(), finished.trims.begin(), finished.trims.end());
    sewn.garment = std::move(trimmed.garment);
    for (const Issue& note : sewn.notes) run.warn(note);
    const tailor::SurfaceReport surface = tailor::surface_report(sewn.garment);
    run.report("seams", sewn.seams.size());
    run.report("welds", sewn.garment.welds.size());
    run.report("particles", surface.particles);
    run.report("components", surface.components);
    run.report("openings", surface.openings);
    run.report("euler", surface.euler);
    run.report("branching_edges", surface.branching_edges);
    std::string lengths;
    for (double length : surface.opening_lengths) lengths += fmt::format("{}{:.1f}", lengths.empty() ? "" : " ", length * 1e3);
    run.report("opening_lengths_mm", lengths);
    for (const auto& seam : sewn.seams) {
      const double difference = seam.length_b - seam.length_a;
      run.report(seam.name, fmt::format("{:.2f} mm on {:.2f} mm, side {} longer by {:.2f} mm of {:.2f} mm allowed, locally up to {:.1f} %; {} pairs, {} added, farthest slide {:.2f} mm", seam.length_a * 1e3, seam.length_b * 1e3, difference > 0 ? "b" : "a",
                                        std::abs(difference) * 1e3, seam.allowed * 1e3, 100 * (seam.steepest - 1), seam.pairs, seam.added, seam.farthest_slide * 1e3));
    }
    for (const auto& fold : folded.folds) {
      run.report("fold " + fold.name, fmt::format("{:.1f} deg at rest over {:.1f} mm of cloth, {:.1f} mm long, {} hinges", fold.angle * 180 / std::numbers::pi, fold.band * 1e3, fold.length * 1e3, fold.hinges));
    }
    for (const auto& trim : trimmed.trims) run.report("trim " + trim.name, fmt::format("{}, {:.1f} mm, {} pieces", trim.kind, trim.length * 1e3, trim.segments));
    const tailor::AngleReport angles = tailor::angle_report(sewn.garment);
    run.report("smallest_angle", angles.least, "deg");
    run.report("smallest_angle_1_percent", angles.percent_1, "deg");
    run.report("angles_below_20", angles.below_20);
    double cut_area = 0;
    for (const auto& panel : sewn.garment.panels) cut_area += panel.cut_area;
    run.report("area_error", mesh::rest_areas(sewn.garment).sum() / cut_area - 1, "1");
    if (angles.below_20 > 0) {
      run.warn({"sharp_triangles", {.item = tailor::place_text(sewn.garment, sewn.garment.faces(angles.least_face, 0))},
                fmt::format("{} triangles have an angle below 20 degrees, the smallest {:.1f}", angles.below_20, angles.least),
                "use cells of similar size on both sides of the seams", Category::check});
    }
    return stage::Output{std::move(sewn.garment), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<SewStage>(argc, argv); }
