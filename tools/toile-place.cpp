// Puts a sewn flat garment on a support.
#include "toile/placement/place.h"
#include "toile/reshape/flatten.h"
#include "toile/stage/stage.h"

#include <map>
#include <numbers>

namespace {

using namespace toile;

const char* name_of(placement::Part part) {
  switch (part) {
    case placement::Part::arm_left: return "arm_left";
    case placement::Part::arm_right: return "arm_right";
    case placement::Part::leg_left: return "leg_left";
    case placement::Part::leg_right: return "leg_right";
    case placement::Part::attached: return "attached";
    default: return "trunk";
  }
}

double degrees(double angle) { return angle * 180 / std::numbers::pi; }

struct PlaceStage {
  using Params = placement::PlaceParams;

  static stage::Description description() {
    return {.name = "toile-place",
            .version = 10,
            .summary = "Bends sewn flat panels around a body without stretching them and draws their seams together.",
            .example = "toile-place layered.ply form.ply -o placed.ply",
            .details = "Each panel goes on the trunk, an arm or a leg, as its name and its seams say (front, back, waistband, sleeve, leg, trouser), or as `panels` "
                       "in the spec says. Panels are rolled round that part with every length kept, then drawn together by their seams while "
                       "the body, flattened at first, swells between them. The seams that stay open close in the simulation; the summary lists "
                       "them, with the largest edge strain, the angle of the warp from its wanted direction, the smallest gap to the body and any intersections; "
                       "the file has them as columns (edge_strain, ease, seam_gap of vertices; warp_angle, cuts of faces). The body needs no landmarks: "
                       "waist, hips, crotch, armpits, shoulders, arms and legs are found from its sections. With `start` panels begin where the panels of the same names in that file are, through "
                       "their panel coordinates, and are relaxed from there. With `lines` in the spec the support is a frame instead (a soft top's bows, a tarpaulin's poles): named "
                       "lines of panels go to named curves, and the cloth is spread between them. docs/placement.md says how.",
            .inputs = {{.name = "garment", .doc = "sewn garment (flat panels)", .kind = stage::FileKind::garment},
                       {.name = "support", .doc = "body or dress form: closed, upright, facing +z, arms held away", .kind = stage::FileKind::support},
                       {.name = "start", .doc = "garment with panels of the same names and where they begin, such as the map of toile-flatten", .kind = stage::FileKind::garment, .required = false}},
            .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh garment, run.garment("garment"));
    TOILE_TRY(const mesh::SupportMesh support, run.support("support"));
    const auto progress = [&](double f) { run.progress(f, "placing"); };
    TOILE_TRY(placement::Placed placed, [&]() -> Result<placement::Placed> {
      if (!run.has("start")) return placement::place(garment, support, params, progress);
      TOILE_TRY(const mesh::GarmentMesh map, run.garment("start"));
      auto start = reshape::positions_from(map, garment);
      if (start) return placement::place_from(garment, *start, support, params, progress);
      Issues issues = start.issues();
      for (Issue& issue : issues) issue.place.file = run.path("start");
      return issues;
    }());
    for (const Issue& warning : placed.warnings) run.warn(warning);
    const placement::Report& report = placed.report;
    run.report("max_edge_strain", report.max_strain);
    run.report("rms_edge_strain", report.rms_strain);
    run.report("area_change", report.area_change);
    run.report("min_gap", report.smallest_gap, "m");
    run.report("vertices_inside", report.vertices_inside);
    run.report("support_intersections", report.support_intersections.size());
    run.report("self_intersections", report.self_intersections.size());
    run.report("mean_seam_gap", report.mean_seam_gap, "m");
    run.report("max_seam_gap", report.largest_seam_gap, "m");
    if (!report.warp_angles.empty()) {
      run.report("mean_warp_angle", degrees(report.mean_warp_angle), "deg");
      run.report("max_warp_angle", degrees(report.largest_warp_angle), "deg");
    }
    for (const placement::WarpAngle& angle : report.warp_angles) {
      const std::string& name = garment.panels[static_cast<std::size_t>(angle.panel)].name;
      run.report("mean_warp_angle_" + name, degrees(angle.mean), "deg");
      run.report("max_warp_angle_" + name, degrees(angle.largest), "deg");
    }
    for (const placement::PartFit& fit : report.fits) {
      run.report(fmt::format("fit_{}_rms", name_of(fit.part)), fit.rms, "m");
      run.report(fmt::format("fit_{}_max", name_of(fit.part)), fit.largest, "m");
    }
    for (const placement::SeamGap& seam : report.seams) {
      const std::string& name = garment.seams[static_cast<std::size_t>(seam.seam)].name;
      run.report("mean_gap_" + name, seam.mean, "m");
      run.report("max_gap_" + name, seam.largest, "m");
    }
    std::map<std::string, int> uses;
    for (std::size_t i = 0; i < placed.lines.size(); ++i) {
      const placement::HeldLine& line = placed.lines[i];
      const int use = ++uses[line.curve];
      const std::string name = use == 1 ? line.curve : fmt::format("{}_{}", line.curve, use);
      run.report("length_on_" + name, line.length, "m");
      run.report("length_of_" + name, line.curve_length, "m");
      run.report("mean_gap_" + name, placed.line_gaps[i].mean, "m");
      run.report("max_gap_" + name, placed.line_gaps[i].largest, "m");
    }
    return stage::Output{std::move(placed.garment), std::move(placed.findings), {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<PlaceStage>(argc, argv); }
