// Makes a dress form from body measurements.
#include "toile/form/form.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/stage.h"

#include <numbers>

namespace {

using namespace toile;

struct FormStage {
  using Params = form::FormParams;

  static stage::Description description() {
    return {.name = "toile-form",
            .version = 1,
            .summary = "Makes a dress form (a closed body to hang garments on) from a file of body measurements.",
            .example = "toile-form samples/measurements/man.yaml -o form.ply --sex male",
            .details = "The measurements file names lengths and girths as made-to-measure pattern programs do (chest, waist, hpsToWaistBack, …), "
                       "each with its unit. The form stands on the floor y = 0 and faces +z; its left hand is at +x. Every girth and length is "
                       "measured on the mesh that is written, and reported beside what was asked; exit code 4 if one is out of tolerance. "
                       "docs/form.md says how each is taken, and lists the landmarks.",
            .inputs = {{.name = "measurements", .doc = "body measurements (YAML)", .kind = stage::FileKind::measurements}},
            .output = stage::FileKind::support};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string text, run.bytes("measurements"));
    TOILE_TRY(const form::Measurements measurements, io::read_record<form::Measurements>(text, run.path("measurements")));
    auto made = form::make_form(measurements, params);
    if (!made) {
      Issues issues = made.issues();
      for (Issue& issue : issues) {
        if (issue.place.file.empty()) issue.place.file = run.path("measurements");
      }
      return issues;
    }
    form::Form& result = *made;
    run.report("vertices", static_cast<std::size_t>(result.mesh.x.rows()));
    run.report("faces", static_cast<std::size_t>(result.mesh.faces.rows()));
    run.report("smallest_angle", result.smallest_angle * 180 / std::numbers::pi, "deg");
    run.report("fitting_rounds", result.iterations);
    stage::Output output;
    for (const form::GaugeRow& row : result.gauge) {
      const bool slope = row.name == "shoulderSlope";
      const double factor = slope ? 180 / std::numbers::pi : 1000;
      const std::string unit = slope ? "deg" : "mm";
      run.report(row.name, row.measured * factor, unit);
      run.report(row.name + "_requested", row.requested * factor, unit);
      run.report(row.name + "_difference", row.difference * 1000, "mm");
      if (row.within()) continue;
      output.findings.push_back(Issue{.code = "out_of_tolerance",
                                      .place = {.file = run.path("measurements"), .item = row.name},
                                      .what = fmt::format("the form has {:.1f} {} instead of {:.1f}, {:+.1f} mm off (allowed {:.1f})", row.measured * factor,
                                                          unit, row.requested * factor, row.difference * 1000, row.tolerance * 1000),
                                      .remedy = "check it against the other measurements, or allow more with girth_tolerance or length_tolerance",
                                      .category = Category::check});
    }
    output.artefact = std::move(result.mesh);
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<FormStage>(argc, argv); }
