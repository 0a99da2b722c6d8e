#include "toile/base/hash.h"
#include "toile/base/text.h"
#include "toile/coupling/coupled_simulation.h"
#include "toile/io/file.h"
#include "toile/io/frames.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

using namespace toile;

namespace {

struct SimulateStage {
  using Params = coupling::CoupledSimulationParams;

  static stage::Description description() {
    return {.name = "toile-simulate",
            .version = 16,
            .summary = "Lets a placed garment hang to rest on a body, or move in time.",
            .example = "toile-simulate placed.ply --support form.ply -o draped.ply",
            .details = "Open seams are drawn together first; then the garment relaxes until the sum of all net forces is a given part of its "
                       "weight. Cloth never passes through itself or the support. docs/simulation.md tells the method and its limits, "
                       "docs/mechanics.md the model.",
            .inputs = {{"garment", "placed garment", stage::FileKind::garment},
                       {"support", "body or dress form", stage::FileKind::support, false},
                       {"motion", "how regions of the support move: a table of time, body, shift and quaternion, as toile-mechanism writes (`mode: motion`)", stage::FileKind::csv, false},
                       {"shapes", "shapes that the support takes one after the other, at `shape_times` (`mode: motion`)", stage::FileKind::support, false, true}},
            .output = stage::FileKind::garment};
  }

  /// How the support moves; nothing where it stands still.
  static Result<std::unique_ptr<dynamics::SupportMotion>> motion(const Params& params, const std::optional<mesh::SupportMesh>& support, const stage::Run& run) {
    const bool table = run.has("motion"), shapes = run.has("shapes");
    if (params.couple) {
      if (table || shapes) return Issue{"bad_combination", {.item = "couple"}, "a support is moved by another program or by a file, not both", "leave out `couple`, or the inputs `motion` and `shapes`", Category::usage};
      return coupling::coupled_support(params, support, [] { return stage::Run::interrupted(); });
    }
    if (!table && !shapes) {
      if (params.shape_times.empty()) return std::unique_ptr<dynamics::SupportMotion>();
      return Issue{"no_motion", {.item = "shape_times"}, "there are times of shapes, but no shapes", "give the input `shapes`", Category::usage};
    }
    Issues issues;
    if (params.mode != dynamics::Mode::motion) issues.push_back({"bad_combination", {.item = "mode"}, "a support moves in motion only", "write `mode: motion`", Category::usage});
    if (table && shapes) issues.push_back({"bad_combination", {.item = "shapes"}, "a support moves by a table or takes shapes, not both", "give one of the two inputs", Category::usage});
    if (!issues.empty()) return issues;
    if (table) {
      TOILE_TRY(const std::string csv, run.bytes("motion"));
      return dynamics::table_motion(csv, run.path("motion"), params.motion_begin);
    }
    std::vector<mesh::Points3> points;
    for (std::size_t i = 0; i < run.paths("shapes").size(); ++i) {
      TOILE_TRY(const std::string bytes, run.bytes("shapes", i));
      TOILE_TRY(const mesh::SupportMesh shape, io::parse_support(bytes, run.paths("shapes")[i]));
      points.push_back(shape.x);
    }
    return dynamics::shape_motion(params.shape_times, std::move(points));
  }

  /// Files of the frames: a cache, or garments one by one.
  static Issues add_frames(const std::string& path, const io::FrameSequence& frames, const mesh::GarmentMesh* garment, stage::Output& output) {
    const auto ends = [&](const char* ending) { return path.ends_with(ending); };
    if (ends(".mdd")) {
      output.side_files.push_back({path, io::format_mdd(frames)});
    } else if (ends(".pc2")) {
      output.side_files.push_back({path, io::format_pc2(frames)});
    } else {
      const auto star = path.rfind('*');
      for (std::size_t k = 0; k < frames.points.size(); ++k) {
        mesh::GarmentMesh g = *garment;
        g.x = frames.points[k];
        for (const char* name : {"vx", "vy", "vz", "edge_strain", "ease", "seam_gap"}) g.vertex_columns.erase(name);
        for (const char* name : {"warp_angle", "cuts"}) g.face_columns.erase(name);
        g.marks["time"] = format_number(frames.times[k]);
        output.side_files.push_back({fmt::format("{}{:04}{}", path.substr(0, star), k, path.substr(star + 1)), io::format_garment(g, io::Encoding::binary)});
      }
    }
    return {};
  }

  static constexpr std::string_view checkpoint_magic = "toile-checkpoint 1\n";

  /// Hash of the effective parameters and of all that is read.
  static Result<std::string> fingerprint(const Params& params, const stage::Run& run) {
    std::string all = fmt::format("{} {}\n{}\n", description().name, description().version, io::flow_yaml(params));
    for (const char* port : {"garment", "support", "motion", "shapes"}) {
      if (!run.has(port)) continue;
      for (std::size_t i = 0; i < run.paths(port).size(); ++i) {
        TOILE_TRY(const std::string bytes, run.bytes(port, i));
        all += fmt::format("{} {}\n", port, content_hash(bytes));
      }
    }
    return content_hash(all);
  }

  static std::string checkpoint_bytes(const dynamics::Checkpoint& checkpoint, const std::string& key) {
    const std::string garment = io::format_garment(checkpoint.garment, io::Encoding::binary);
    return fmt::format("{}{}\n{} {}\n", checkpoint_magic, key, garment.size(), content_hash(garment + checkpoint.state)) + garment + checkpoint.state;
  }

  static Result<dynamics::Checkpoint> read_checkpoint(const std::string& path, const std::string& key) {
    const Result<std::string> read = io::read_file(path);
    if (!read) return read.issues();
    std::string_view rest = *read;
    const auto refuse = [&](const char* what, const char* remedy) { return Issue{"bad_checkpoint", {.file = path, .item = "resume"}, what, remedy}; };
    const auto line = [&] {
      const auto end = std::min(rest.find('\n'), rest.size());
      const std::string text(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
      return text;
    };
    if (!rest.starts_with(checkpoint_magic)) return refuse("is no checkpoint of this version", "name the file that `checkpoint` left, or begin again");
    rest.remove_prefix(checkpoint_magic.size());
    if (line() != key) return refuse("is of another run: an input, a parameter or the program's version has changed", "give what the checkpoint was left with, or begin again");
    const std::vector<std::string> sizes = split(line(), ' ');
    const auto size = sizes.size() == 2 ? parse_integer(sizes[0]) : std::nullopt;
    if (!size || *size < 0 || static_cast<std::size_t>(*size) > rest.size() || content_hash(rest) != sizes[1]) return refuse("is damaged", "begin again");
    const auto n = static_cast<std::size_t>(*size);
    TOILE_TRY(mesh::GarmentMesh garment, io::parse_garment(rest.substr(0, n), path));
    return dynamics::Checkpoint{std::move(garment), std::string(rest.substr(n))};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh garment, run.garment("garment"));
    std::optional<mesh::SupportMesh> support;
    if (run.has("support")) {
      auto read = run.support("support");
      if (!read) return read.issues();
      support = std::move(*read);
    }
    TOILE_TRY(const std::unique_ptr<dynamics::SupportMotion> supports, motion(params, support, run));
    dynamics::SimulationHooks hooks;
    hooks.supports = supports.get();
    hooks.progress = [&](double fraction, const std::string& text) { run.progress(fraction, text); };
    hooks.interrupted = [] { return stage::Run::interrupted(); };
    io::FrameSequence frames, support_frames;
    if (!params.frames.empty() || !params.support_frames.empty()) {
      hooks.frame = [&](double time, const mesh::Points3& x, const mesh::Points3& of_support) {
        frames.times.push_back(time);
        frames.points.push_back(x);
        support_frames.times.push_back(time);
        support_frames.points.push_back(of_support);
      };
    }
    // What the checkpoint belongs to: everything that the result depends on.
    TOILE_TRY(const std::string key, fingerprint(params, run));
    Issues lost;
    if (!params.checkpoint.empty()) {
      hooks.checkpoint = [&](const dynamics::Checkpoint& checkpoint) {
        const Issues issues = io::write_file(params.checkpoint, checkpoint_bytes(checkpoint, key));
        if (lost.empty()) lost = issues;
      };
    }
    std::optional<dynamics::Checkpoint> from;
    if (!params.resume.empty()) {
      auto read = read_checkpoint(params.resume, key);
      if (!read) return read.issues();
      from = std::move(*read);
      hooks.resume = &from->state;
    }
    auto result = dynamics::simulate(from ? from->garment : garment, support, params, hooks);
    if (!result) return result.issues();
    append(result->findings, lost);
    // The route is that of the garment that came in.
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
    for (const dynamics::Reaction& r : report.bodies) {
      constexpr std::array axes{"x", "y", "z"};
      for (int c = 0; c < 3; ++c) run.report(fmt::format("body_force_{}_{}", axes[static_cast<std::size_t>(c)], r.name), r.force[c], "N");
      for (int c = 0; c < 3; ++c) run.report(fmt::format("body_torque_{}_{}", axes[static_cast<std::size_t>(c)], r.name), r.moment[c], "N*m");
    }
    if (supports) run.report("rejected_steps", report.rejected_steps);
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
    if (!params.frames.empty()) append(output.findings, add_frames(params.frames, frames, &garment, output));
    if (!params.support_frames.empty()) append(output.findings, add_frames(params.support_frames, support_frames, nullptr, output));
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<SimulateStage>(argc, argv); }
