// Changes a form or a garment's surface by girths, lengths, slopes and free-form lattices.
#include "toile/contact/exact.h"
#include "toile/io/ply.h"
#include "toile/reshape/deform.h"
#include "toile/stage/stage.h"

#include <numbers>

namespace {

using namespace toile;

struct DeformStage {
  using Params = reshape::DeformParams;

  static stage::Description description() {
    return {.name = "toile-deform",
            .version = 1,
            .summary = "Changes a form or a garment's surface: girths, lengths, slopes, free-form lattices.",
            .example = "toile-deform form.ply --spec reshape.yaml -o wider.ply",
            .details = "A girth is that of a section of the surface; the triangles on it are scaled about its middle until the measure comes out, and the "
                       "surface follows smoothly within `reach`. A move carries all that lies beyond one point away from another (a longer sleeve) or "
                       "round it (a steeper shoulder). Lattices bend space itself. Every measure is taken on the result. Landmarks and girths of a form "
                       "are carried along. docs/reshaping.md says how.",
            .inputs = {{.name = "surface", .doc = "form (support) or garment", .kind = stage::FileKind::any}},
            .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto bytes = run.bytes("surface");
    if (!bytes) return bytes.issues();
    const bool form = bytes->substr(0, 1000).find("\ncomment toile-support ") != std::string::npos;
    const auto placed = [&](Issues issues) {
      for (Issue& issue : issues) {
        if (issue.place.file.empty()) issue.place.file = run.path("surface");
      }
      return issues;
    };
    const auto report = [&](const reshape::Surface& surface, const reshape::Deformed& deformed) {
      for (const reshape::MeasureRow& row : deformed.measures) {
        const double factor = row.angle ? 180 / std::numbers::pi : 1000;
        const char* unit = row.angle ? "deg" : "mm";
        run.report(row.name + ".before", row.before * factor, unit);
        run.report(row.name + ".asked", row.asked * factor, unit);
        run.report(row.name + ".after", row.after * factor, unit);
      }
      run.report("rounds", deformed.rounds);
      run.report("largest_move", deformed.largest_move, "m");
      run.report("folded_faces", deformed.folded_faces);
      const contact::Surface topology = contact::make_surface(static_cast<int>(surface.x.rows()), surface.faces);
      const auto before = contact::self_intersections(topology, surface.x).size(), after = contact::self_intersections(topology, deformed.x).size();
      run.report("self_intersections", after);
      if (after > before) {
        run.warn({"self_intersection", {.file = run.path("surface")}, fmt::format("{} pairs of faces cut one another that did not before", after - before),
                  "ask for less, or give a larger reach", Category::check});
      }
    };
    stage::Output output;
    if (form) {
      TOILE_TRY(mesh::SupportMesh support, run.support("surface"));
      const reshape::Surface surface = reshape::surface_of(support);
      const auto deformed = reshape::deform(surface, params);
      if (!deformed) return placed(deformed.issues());
      report(surface, *deformed);
      const auto points = reshape::carried_points(surface, deformed->x);
      auto girths = reshape::carried_girths(support, deformed->x, points);
      run.report("girths_left_out", support.girths.size() - girths.size());
      for (const auto& [name, p] : points) support.landmarks[name] = {p.x(), p.y(), p.z()};
      support.girths = std::move(girths);
      support.x = deformed->x;
      if (mesh::volume(support.x, support.faces) <= 0) {
        return placed({Issue{"inside_out", {}, "the result would be inside out", "ask for less", Category::check}});
      }
      output.findings = placed(deformed->findings);
      output.artefact = std::move(support);
      return output;
    }
    TOILE_TRY(mesh::GarmentMesh garment, run.garment("surface"));
    const reshape::GarmentSurface whole = reshape::surface_of(garment);
    const auto deformed = reshape::deform(whole.surface, params);
    if (!deformed) return placed(deformed.issues());
    report(whole.surface, *deformed);
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      const Eigen::RowVector3d move = deformed->x.row(whole.particle[v]) - whole.surface.x.row(whole.particle[v]);
      garment.x.row(v) += move;
    }
    garment.marks.erase("converged");
    output.findings = placed(deformed->findings);
    output.artefact = std::move(garment);
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<DeformStage>(argc, argv); }
