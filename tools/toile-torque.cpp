// What the cloth asks of the motor of a linkage: from the forces on its bodies, by virtual work.
#include "toile/inspect/plot.h"
#include "toile/io/record_yaml.h"
#include "toile/base/text.h"
#include "toile/mechanism/torque.h"
#include "toile/stage/stage.h"

#include <cmath>

namespace {

using namespace toile;

struct TorqueParams {
  std::vector<double> times{0, 1};
  std::vector<double> angles{0, 0};
  mechanism::Profile profile = mechanism::Profile::smooth;
  double begin = 0;
  std::string plot;
  static void describe(auto& f) {
    f(&TorqueParams::times, {.key = "times", .doc = "times of the rows of `angles`, increasing, as for toile-mechanism", .unit = "s"});
    f(&TorqueParams::angles, {.key = "angles", .doc = "angle of the driver from the drawn position at each of these times", .unit = "rad"});
    f(&TorqueParams::profile, {.key = "profile", .doc = "between rows: straight, or smooth (3u^2 - 2u^3, at rest at each row)"});
    f(&TorqueParams::begin, {.key = "begin", .doc = "time of the motion at which the record begins", .unit = "s"});
    f(&TorqueParams::plot, {.key = "plot", .doc = "PNG of the torque against the angle; empty: none", .local = true});
    f.check([](const TorqueParams& p, Issues& issues) {
      if (p.times.empty() || p.times.size() != p.angles.size()) issues.push_back(Issue{"bad_range", {.item = "angles"}, fmt::format("there are {} times and {} angles", p.times.size(), p.angles.size()), "give one angle for each time"});
      for (std::size_t i = 1; i < p.times.size(); ++i) {
        if (p.times[i] > p.times[i - 1]) continue;
        issues.push_back(Issue{"bad_range", {.item = "times"}, "the times do not increase", "put them in order"});
        break;
      }
    });
  }
};

struct TorqueStage {
  using Params = TorqueParams;

  static stage::Description description() {
    return {.name = "toile-torque",
            .version = 1,
            .summary = "Torque that the cloth asks of a linkage's motor, against its angle.",
            .example = "toile-torque softtop.yaml opened.csv --times '[0 s, 1 s]' --angles '[0 deg, 110 deg]' --plot torque.png -o torque.csv",
            .details = "The record of toile-simulate has the force and torque of the cloth on every body that moves. By virtual work, the sum over the bodies of force "
                       "times velocity and torque times turning rate, per turning rate of the driver, is the torque that the cloth exerts on the motor; positive helps it on. "
                       "The result is a table of time, angle and torque. docs/mechanism.md says more.",
            .inputs = {{.name = "linkage", .doc = "bodies and pivots (YAML)", .kind = stage::FileKind::spec}, {.name = "record", .doc = "record of toile-simulate (CSV)", .kind = stage::FileKind::csv}},
            .output = stage::FileKind::csv};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string text, run.bytes("linkage"));
    TOILE_TRY(const std::string csv, run.bytes("record"));
    TOILE_TRY(const mechanism::Linkage linkage, io::read_record<mechanism::Linkage>(text, run.path("linkage")));
    if (Issues issues = mechanism::validate(linkage); !issues.empty()) {
      for (Issue& issue : issues) issue.place.file = run.path("linkage");
      return issues;
    }
    TOILE_TRY(const mechanism::WrenchRecord record, mechanism::read_wrenches(csv, run.path("record"), linkage));
    std::vector<double> angles;
    for (const double t : record.times) angles.push_back(mechanism::angle_at(params.times, params.angles, params.profile, params.begin + t));
    TOILE_TRY(const std::vector<mechanism::Configuration> followed, mechanism::follow(linkage, angles));

    std::string table = "time_s,angle_deg,torque_Nm\n";
    inspect::Series curve{.name = "cloth on motor", .color = {0.1, 0.3, 0.7}};
    double largest = 0, work = 0, before = 0;
    for (std::size_t i = 0; i < followed.size(); ++i) {
      const double torque = mechanism::driver_torque(followed[i], record.rows[i]);
      const double degrees = angles[i] * 180 / M_PI;
      table += fmt::format("{},{},{}\n", record.times[i], degrees, torque);
      curve.x.push_back(degrees);
      curve.y.push_back(torque);
      largest = std::max(largest, std::abs(torque));
      if (i > 0) work += 0.5 * (torque + before) * (angles[i] - angles[i - 1]);
      before = torque;
    }
    run.report("rows", followed.size());
    run.report("largest_torque", largest, "N*m");
    run.report("work_on_motor", work, "J");
    stage::Output output{std::move(table), {}, {}};
    if (!params.plot.empty()) {
      const inspect::Chart chart{"Cloth on the motor", "angle of the driver [deg]", "torque [N m]", {curve}, {}, {}};
      TOILE_TRY(std::string png, inspect::encode_png(inspect::draw_charts({chart}, {1000, 640, 1})));
      output.side_files.push_back({params.plot, std::move(png)});
    }
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<TorqueStage>(argc, argv); }
