// Turns a linkage by a motor while cloth hangs on it.
#include "toile/base/hash.h"
#include "toile/coupling/drive.h"
#include "toile/inspect/plot.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/stage.h"

#include <cmath>

using namespace toile;

namespace {

struct DriveStage {
  using Params = coupling::DriveParams;

  static stage::Description description() {
    return {.name = "toile-drive",
            .version = 1,
            .summary = "Turns a linkage by a motor, coupled with a simulation of the cloth on it.",
            .example = "toile-drive samples/mechanisms/softtop.yaml -o opening.csv --times '[0 s, 1 s]' --angles '[0 deg, 110 deg]'",
            .details = "Goes to a toile-simulate whose spec has `couple`, or another program that speaks the protocol of docs/coupling.md; either may be started first. "
                       "Each step of the linkage's motion is proposed to the cloth, which answers with its forces on the bodies. With the motors servo and torque a step is undone and repeated "
                       "until motion and reaction agree. The result is a table: time, angle, torques of motor, cloth and weight on the driver, work.",
            .inputs = {{.name = "linkage", .doc = "bodies, pivots, bars and bows (YAML)", .kind = stage::FileKind::spec},
                       {.name = "motion", .doc = "motor prescribed: table of toile-mechanism --motion, from which the poses are read as toile-simulate reads them off-line", .kind = stage::FileKind::csv, .required = false}},
            .output = stage::FileKind::csv};
  }

  static Result<std::string> chart(const std::vector<coupling::DriveRow>& rows) {
    inspect::Series motor{.name = "motor", .color = {0.1, 0.3, 0.7}}, cloth{.name = "cloth", .color = {0.8, 0.2, 0.1}}, weight{.name = "weight of the frame", .color = {0.4, 0.4, 0.4}, .stroke = inspect::Stroke::dashed};
    for (const coupling::DriveRow& row : rows) {
      for (const auto& [series, torque] : {std::pair{&motor, row.motor}, std::pair{&cloth, row.cloth}, std::pair{&weight, row.weight}}) {
        series->x.push_back(row.angle * 180 / M_PI);
        series->y.push_back(torque);
      }
    }
    const inspect::Chart all{"Torques on the driver", "angle of the driver [deg]", "torque [N m]", {motor, weight, cloth}, {}, {}};
    const inspect::Chart alone{"Of the cloth", "angle of the driver [deg]", "torque [N m]", {cloth}, {}, {}};
    return inspect::encode_png(inspect::draw_charts({all, alone}, {1400, 560, 2}));
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string text, run.bytes("linkage"));
    const std::string file = run.path("linkage");
    TOILE_TRY(const mechanism::Linkage linkage, io::read_record<mechanism::Linkage>(text, file));
    std::unique_ptr<dynamics::SupportMotion> table;
    if (run.has("motion")) {
      TOILE_TRY(const std::string csv, run.bytes("motion"));
      TOILE_TRY(table, dynamics::table_motion(csv, run.path("motion"), params.times.front()));
    }
    TOILE_TRY(coupling::Channel channel, coupling::Channel::call(params.couple));
    coupling::DriveHooks hooks;
    hooks.progress = [&](double fraction, const std::string& text) { run.progress(fraction, text); };
    hooks.interrupted = [] { return stage::Run::interrupted(); };
    auto result = coupling::drive(linkage, content_hash(text), params, std::move(channel), hooks, table.get());
    if (!result) return result.issues();
    const coupling::DriveReport& r = result->report;
    run.report("steps", r.steps);
    run.report("rounds", r.rounds);
    run.report("rejected_steps", r.rejected);
    run.report("refused_steps", r.refused);
    run.report("unconverged_steps", r.unconverged);
    run.report("end_angle", r.angle * 180 / M_PI, "deg");
    run.report("end_rate", r.rate, "rad/s");
    run.report("largest_motor_torque", r.motor_largest, "N*m");
    run.report("largest_cloth_torque", r.cloth_largest, "N*m");
    run.report("motor_work", r.motor_work, "J");
    run.report("cloth_work", r.cloth_work, "J");
    stage::Output output{std::move(result->record), std::move(result->findings), {}};
    if (!params.plot.empty()) {
      TOILE_TRY(std::string png, chart(result->rows));
      output.side_files.push_back({params.plot, std::move(png)});
    }
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<DriveStage>(argc, argv); }
