// Cuts the panels of a pattern into particle grids.
#include "toile/io/pattern_yaml.h"
#include "toile/stage/stage.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/pleat.h"
#include "toile/tailor/quality.h"

#include <cmath>

namespace {

using namespace toile;

struct MeshStage {
  using Params = tailor::MeshParams;

  static stage::Description description() {
    return {.name = "toile-mesh",
            .version = 3,
            .summary = "Cuts the panels of a pattern into particle grids along warp and weft.",
            .example = "toile-mesh samples/patterns/tee.yaml -o panels.ply --cell '10 mm'",
            .details = "Grid nodes stand at the crossings of warp and weft lines inside the panel; the border is sampled on the true curves, on "
                       "grid lines where that keeps the spacing even; the strip between is triangulated without slivers. Named edges become runs "
                       "of vertices, named points and notches become vertices. Internal lines become edges (--lines '[\"*.*\"]' takes all of them) or are "
                       "cut: closed ones out, open ones open. The summary gives the distribution of the triangles' smallest "
                       "angles and the mesh area beside the area inside the true curves, with --json for each panel too. docs/tailoring.md says how "
                       "it is done.",
            .inputs = {{.name = "pattern", .doc = "pattern (YAML)", .kind = stage::FileKind::pattern}},
            .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const std::string& path = run.path("pattern");
    TOILE_TRY(const std::string text, run.bytes("pattern"));
    TOILE_TRY(const pattern::Pattern pattern, io::parse_pattern(text, path));
    const auto named = [&](Issues issues) {
      for (Issue& issue : issues) {
        if (issue.place.file.empty()) issue.place.file = path;
      }
      return issues;
    };
    const auto pleated = pattern::add_pleats(pattern, params.pleats);
    if (!pleated) return named(pleated.issues());
    const auto panels = pattern::cut_panels(pleated->pattern);
    if (!panels) return named(panels.issues());
    tailor::MeshParams effective = params;
    for (const std::string& line : tailor::pleat_lines(*pleated)) effective.lines.push_back(line);
    auto garment = tailor::mesh_panels(*panels, effective);
    if (!garment) return named(garment.issues());
    TOILE_TRY(tailor::Folded folded, tailor::add_folds(*garment, tailor::pleat_folds(*garment, *pleated, params.pleats)));
    *garment = std::move(folded.garment);

    run.report("panels", garment->panels.size());
    run.report("vertices", static_cast<std::size_t>(garment->vertex_count()));
    run.report("faces", static_cast<std::size_t>(garment->face_count()));
    double cut_area = 0, allowance_area = 0;
    for (const auto& panel : garment->panels) {
      cut_area += panel.cut_area;
      allowance_area += panel.allowance_area;
    }
    const double mesh_area = mesh::rest_areas(*garment).sum();
    run.report("cut_area", cut_area, "m2");
    run.report("allowance_area", allowance_area, "m2");
    run.report("mesh_area", mesh_area, "m2");
    run.report("area_error", mesh_area / cut_area - 1, "1");
    const tailor::AngleReport angles = tailor::angle_report(*garment);
    run.report("smallest_angle", angles.least, "deg");
    run.report("smallest_angle_1_percent", angles.percent_1, "deg");
    run.report("smallest_angle_median", angles.median, "deg");
    run.report("angles_below_20", angles.below_20);
    std::string histogram;
    for (std::size_t k = 0; k < angles.histogram.size(); ++k) histogram += fmt::format("{}{}", k ? " " : "", angles.histogram[k]);
    run.report("smallest_angles_by_5_deg", histogram);
    if (!folded.folds.empty()) run.report("pleat_folds", folded.folds.size());
    if (angles.below_20 > 0) {
      run.warn({"sharp_triangles", {.file = path, .item = tailor::place_text(*garment, garment->faces(angles.least_face, 0))},
                fmt::format("{} triangles have an angle below 20 degrees, the smallest {:.1f}", angles.below_20, angles.least),
                "use smaller cells, or cells of more equal sides", Category::check});
    }
    const Eigen::VectorXd areas = mesh::rest_areas(*garment);
    std::vector<double> panel_area(garment->panels.size(), 0);
    std::vector<int> panel_faces(garment->panels.size(), 0);
    for (Eigen::Index f = 0; f < areas.size(); ++f) {
      panel_area[static_cast<std::size_t>(garment->face_panel[f])] += areas[f];
      ++panel_faces[static_cast<std::size_t>(garment->face_panel[f])];
    }
    for (const auto& panel : garment->panels) {
      const double off = panel_area[static_cast<std::size_t>(panel.id)] / panel.cut_area - 1;
      if (std::abs(off) > 0.01) {
        run.warn({"coarse_grid", {.file = path, .item = panel.name}, fmt::format("the mesh area is {:+.1f} % off the area inside the true outline", 100 * off), "use smaller cells for this panel", Category::check});
      }
    }
    if (run.json()) {
      const auto reports = tailor::panel_angle_reports(*garment);
      for (const auto& panel : garment->panels) {
        const auto id = static_cast<std::size_t>(panel.id);
        const std::string key = "panels." + panel.name + ".";
        run.report(key + "faces", panel_faces[id]);
        run.report(key + "cut_area", panel.cut_area, "m2");
        run.report(key + "area_error", panel_area[id] / panel.cut_area - 1, "1");
        run.report(key + "smallest_angle", reports[id].least, "deg");
        run.report(key + "smallest_angle_1_percent", reports[id].percent_1, "deg");
        run.report(key + "smallest_angle_median", reports[id].median, "deg");
        run.report(key + "angles_below_20", reports[id].below_20);
      }
    }
    return stage::Output{std::move(*garment), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<MeshStage>(argc, argv); }
