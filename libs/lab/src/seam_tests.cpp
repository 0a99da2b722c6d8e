// Tests of what seams do that nobody should feel.
#include <fmt/format.h>

#include <cmath>

#include "bench_setup.h"
#include "toile/base/text.h"

namespace toile::lab {
namespace {

std::string common(double residual, int iterations) {
  return fmt::format("self_reach: 0.1 mm\nresidual: {}\nmax_iterations: {}\nrecord: record.csv\n", format_number(residual), iterations);
}

Experiment seams(const Scope& scope) {
  Experiment e{.test = "seam", .title = "Seam transparency",
               .about = "Strips of the suiting, cut in two through their middle at 0, 30, 45 and 90° to their axis, each half meshed by itself, and sewn together again; a seam that weighs and stiffens nothing should not be felt. Drop of a "
                        "cantilever (40 × 16 mm, cells of 2 mm, warp along it and on the bias) and force of a bias extension by 10 % (150 × 50 mm, cells of 2.5 mm), over those of the uncut strip."};
  struct Key {
    Strip strip;
    bool pull;
  };
  std::vector<Key> keys;
  if (scope.woven) {
    for (const auto& [pull, warp] : {std::pair{false, 0.0}, {false, 45.0}, {true, 45.0}}) {
      for (const double cut : {-1.0, 0.0, 30.0, 45.0, 90.0}) {
        if (scope.quick && (pull || warp != 45 || (cut != -1 && cut != 30))) continue;
        Strip strip = pull ? Strip{.length = 0.15, .width = 0.05, .warp = 45, .cell = 0.0025} : Strip{.length = 0.04, .width = 0.016, .warp = warp, .cell = 0.002};
        if (cut >= 0) strip.cut = cut;
        std::string spec;
        if (pull) {
          spec = common(1e-4, 2000) + "gravity: 0\nincrements: 2\nduration: 2 s\nconstraints:\n  - {name: fixed, on: " + edges(strip, "clamp") + "}\n" +
                 path_yaml("jaw", edges(strip, "tip"), "drive", {Eigen::Vector3d::Zero(), 0.05 * strip.length * along(strip), 0.1 * strip.length * along(strip)});
        } else {
          spec = common(2e-4, 3000) + fmt::format("gravity_direction: [0, 0, -1]\nwatch: {}\nconstraints:\n  - {{name: clamp, on: {}, kind: clamp}}\n", edges(strip, "tip"), edges(strip, "clamp"));
        }
        keys.push_back({strip, pull});
        e.cases.push_back(strip_case(fmt::format("{}_warp{}_{}", pull ? "pull" : "cantilever", warp, cut < 0 ? "uncut" : fmt::format("cut{}", cut)), strip, suiting(), spec));
      }
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    std::optional<double> uncut;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [strip, pull] = keys[i];
      const Table& r = outcomes[i].record;
      std::optional<double> value;
      if (outcomes[i].ran && row_count(r) > 0) {
        const std::size_t last = row_count(r) - 1;
        if (pull) {
          value = component(r, "jaw", "force", "N", along(strip))[last];
        } else if (!strip.cut || *strip.cut != 0) {
          value = -watched(r, strip.cut ? "second.tip" : "strip.tip", last).z();
        } else {
          value = -0.5 * (watched(r, "first.tip", last).z() + watched(r, "second.tip", last).z());
        }
      }
      if (!strip.cut) {
        uncut = outcomes[i].converged ? value : std::nullopt;
        if (outcomes[i].ran) continue;
      }
      Row row = row_of("seam", fmt::format("{}, warp at {}°, {}", pull ? "bias extension by 10 %" : "cantilever", strip.warp, strip.cut ? fmt::format("cut at {}°", *strip.cut) : "uncut"), Model::woven, "grid",
                       pull ? "force" : "drop", pull ? "N" : "m", outcomes[i]);
      row.reference = uncut;
      row.value = value;
      row.target = 0.02;
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

}  // namespace

std::vector<Experiment> seam_tests(const Scope& scope) { return {seams(scope)}; }

}  // namespace toile::lab
