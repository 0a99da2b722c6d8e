#include "toile/dynamics/simulate.h"
#include "toile/stage/stage.h"

#include <fmt/format.h>

#include <array>

using namespace toile;

namespace {

struct SimulateStage {
  using Params = dynamics::SimulationParams;

  static stage::Description description() {
    return {.name = "toile-simulate",
            .version = 15,
            .summary = "Lets a placed garment hang to rest on a body, or move in time.",
            .example = "toile-simulate placed.ply --support form.ply -o draped.ply",
            .details = "Open seams are drawn together first; then the garment relaxes until the sum of all net forces is a given part of its "
                       "weight. Cloth never passes through itself or the support. docs/simulation.md tells the method and its limits, "
                       "docs/mechanics.md the model.",
            .inputs = {{"garment", "placed garment", stage::FileKind::garment}, {"support", "body or dress form", stage::FileKind::support, false}},
            .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh garment, run.garment("garment"));
    std::optional<mesh::SupportMesh> support;
    if (run.has("support")) {
      auto read = run.support("support");
      if (!read) return read.issues();
      support = std::move(*read);
    }
    dynamics::SimulationHooks hooks;
    hooks.progress = [&](double fraction, const std::string& text) { run.progress(fraction, text); };
    hooks.interrupted = [] { return stage::Run::interrupted(); };
    auto result = dynamics::simulate(garment, support, params, hooks);
    if (!result) return result.issues();
    const dynamics::SimulationReport& report = result->report;
    run.report("converged", report.converged);
    run.report("residual", report.residual);
    run.report("largest_net_force", report.residual_max, "N");
    run.report("iterations", report.iterations);
    run.report("solver_iterations", report.solver_iterations);
    if (params.mode == dynamics::Mode::motion) run.report("simulated_time", report.simulated_time, "s");
    if (params.mode == dynamics::Mode::motion) run.report("unconverged_steps", report.unconverged_steps);
    for (const dynamics::Reaction& r : report.reactions) {
      constexpr std::array axes{"x", "y", "z"};
      for (int c = 0; c < 3; ++c) run.report(fmt::format("force_{}_{}", axes[static_cast<std::size_t>(c)], r.name), r.force[c], "N");
      for (int c = 0; c < 3; ++c) run.report(fmt::format("moment_{}_{}", axes[static_cast<std::size_t>(c)], r.name), r.moment[c], "N*m");
    }
    for (const auto& [name, force] : report.distance_forces) run.report("distance_force_" + name, force, "N");
    run.report("max_strain_warp", report.strain_warp_max);
    run.report("max_strain_weft", report.strain_weft_max);
    run.report("max_shear", report.shear_max, "rad");
    if (report.lowest_stiffness) run.report("lowest_stiffness", *report.lowest_stiffness, "1/s2");
    run.report("contacts", report.contacts);
    run.report("least_gap", report.least_gap, "m");
    run.report("max_seam_gap", report.seam_gap_max, "m");
    run.report("open_seam_pairs", report.seams_open);
    for (const dynamics::ClosureState& c : report.closures) {
      run.report(fmt::format("closed_{}", c.name), c.closed == c.halves);
      run.report(fmt::format("gap_{}", c.name), c.gap, "m");
      run.report(fmt::format("pull_{}", c.name), c.force, "N");
    }
    run.report("self_intersections", report.intersections);
    run.report("support_intersections", report.support_intersections);
    run.report("penetrating_vertices", report.inside);
    run.report("start_inside", report.start_inside);
    run.report("start_intersections", report.start_intersections);
    run.report("start_intersections_left", report.start_left);
    run.report("start_move", report.start_move, "m");
    for (const dynamics::Untangling& u : report.untangled) {
      run.report(fmt::format("untangled_{}", u.panel), u.moved);
      run.report(fmt::format("untangle_move_{}", u.panel), u.largest_move, "m");
    }
    run.report("membrane_energy", report.membrane_energy, "J");
    run.report("bending_energy", report.bending_energy, "J");
    run.report("potential_energy", report.potential_energy, "J");
    stage::Output output{std::move(result->garment), std::move(result->findings), {}};
    if (!params.record.empty()) output.side_files.push_back({params.record, std::move(result->record)});
    if (!params.log.empty()) output.side_files.push_back({params.log, std::move(result->log)});
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<SimulateStage>(argc, argv); }
