// Draping a garment: from placed, with seams open, to hanging at rest; or moving in time. docs/simulation.md tells how.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/dynamics/constraints.h"
#include "toile/dynamics/fastening.h"
#include "toile/dynamics/support_motion.h"
#include "toile/mechanics/particle.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <functional>
#include <optional>
#include <string>

namespace toile::dynamics {

enum class Mode { equilibrium, motion };
enum class Model { woven, particle };
enum class Integrator { automatic, implicit, bdf2, provot };
enum class YarnFriction { no, yes };

struct SimulationParams {
  Mode mode = Mode::equilibrium;
  Model model = Model::woven;
  mechanics::EdgeEstimate edge_estimate = mechanics::EdgeEstimate::van_gelder;
  mechanics::Modulus modulus = mechanics::Modulus::secant;
  YarnFriction internal_friction = YarnFriction::no;
  Integrator integrator = Integrator::automatic;
  std::optional<double> explicit_step;
  std::optional<double> explicit_damping;
  double settling_time = 5;
  double gravity = 9.81;
  std::array<double, 3> gravity_direction{0, -1, 0};
  std::vector<double> gravity_times, gravity_factor;
  double residual = 1e-3;
  int max_iterations = 1200;
  int increments = 1;
  double duration = 1.0;
  double time_step = 1.0 / 60;
  int newton_iterations = 12;
  double newton_accuracy = 1e-3;
  double air_drag = 0.05;
  std::array<double, 3> wind{0, 0, 0};
  std::vector<double> wind_times, wind_factor;
  double air_density = 1.2;
  std::optional<double> wind_drag, wind_lift;
  double damping_mass = 0;
  double damping_stiffness = 0;
  double support_reach = 2e-3;
  std::optional<double> self_reach;
  double contact_stiffness = 5e5;
  std::optional<double> friction;
  double support_friction = 0.3;
  int closing_steps = 20;
  double closing_gravity = 0.1;
  double seam_stiffness = 500;
  std::optional<double> seam_pull;
  double seam_gap = 5e-4;
  double fastening_pull = 5;
  double largest_move = 0.02;
  std::vector<std::string> fixed;
  std::vector<ConstraintSpec> constraints;
  std::vector<DistanceSpec> distances;
  std::vector<LoadSpec> loads;
  double motion_begin = 0;
  std::vector<double> shape_times;
  std::vector<std::string> watch;
  std::string record;
  bool stability = false;
  std::string log;
  std::string frames, support_frames;
  double frame_interval = 1.0 / 24;
  std::string checkpoint, resume;
  int checkpoint_interval = 100;

  static void describe(auto& f) {
    f(&SimulationParams::mode, {.key = "mode", .doc = "equilibrium: until the garment hangs at rest; motion: for `duration` from the given velocities"});
    f(&SimulationParams::model, {.key = "model", .doc = "woven: membrane of yarns and plate; particle: the published springs and torques, linear (docs/mechanics.md#particle)"});
    f(&SimulationParams::edge_estimate, {.key = "edge_estimate", .doc = "model particle: springs on edges that are not along the yarns"});
    f(&SimulationParams::modulus, {.key = "modulus", .doc = "model particle: slope of the tensile curve that its springs take; secant is the published one"});
    f(&SimulationParams::internal_friction, {.key = "internal_friction", .doc = "model woven: yes: friction between yarns in bending, shear and tension, as the loops of the fabric's tests show it (2HB, 2HG, 2HG5, RT); its state is kept "
                                              "in the garment (docs/mechanics.md#internal-friction). no: the elastic curves alone"});
    f(&SimulationParams::integrator, {.key = "integrator", .doc = "automatic: bdf2 in motion, else implicit; implicit: Euler; bdf2: motion with two steps' memory, second order, hardly damps by itself; provot: explicit, velocities then positions, constraints and contacts by dynamic constraints (docs/simulation.md#explicit-integration)"});
    f(&SimulationParams::explicit_step, {.key = "explicit_step", .doc = "integrator provot: time step; not given: two fifths of the step that is certainly stable", .unit = "s", .min = 1e-9, .max = 1});
    f(&SimulationParams::explicit_damping, {.key = "explicit_damping", .doc = "integrator provot: force against velocity per mass; not given: 10/s in equilibrium, none in motion", .unit = "1/s", .min = 0, .max = 1e5});
    f(&SimulationParams::settling_time, {.key = "settling_time", .doc = "integrator provot, equilibrium: simulated time after the last row of a path, load or gravity table, after which the run ends unconverged (exit code 5)", .unit = "s", .min = 1e-6, .max = 1e4});
    f(&SimulationParams::gravity, {.key = "gravity", .doc = "acceleration of gravity", .unit = "m/s2", .min = 0, .max = 100});
    f(&SimulationParams::gravity_direction, {.key = "gravity_direction", .doc = "where gravity pulls to"});
    f(&SimulationParams::gravity_times, {.key = "gravity_times", .doc = "times of the rows of `gravity_factor`, increasing", .unit = "s"});
    f(&SimulationParams::gravity_factor, {.key = "gravity_factor", .doc = "part of gravity at each of these times, straight in between; not given: 1"});
    f(&SimulationParams::residual, {.key = "residual", .doc = "equilibrium: stop when the sum over all particles of the net force's length is this part of the garment's weight (of the loads, if they are greater; of the reactions, if there is neither)",
                                    .unit = "1", .min = 1e-9, .max = 1});
    f(&SimulationParams::max_iterations, {.key = "max_iterations", .doc = "equilibrium: Newton iterations of an increment after which the run ends unconverged (exit code 5)", .min = 1, .max = 1e6});
    f(&SimulationParams::increments, {.key = "increments", .doc = "equilibrium: so many in a row, at equal parts of `duration`, along the paths and loads", .min = 1, .max = 100000});
    f(&SimulationParams::duration, {.key = "duration", .doc = "motion: simulated time; equilibrium: time of the last increment in the tables of paths and loads", .unit = "s", .min = 0, .max = 1e4});
    f(&SimulationParams::time_step, {.key = "time_step", .doc = "motion: step; equilibrium: the first step of the pseudo-time", .unit = "s", .min = 1e-6, .max = 1});
    f(&SimulationParams::newton_iterations, {.key = "newton_iterations", .doc = "motion: Newton iterations a step at most", .min = 1, .max = 1000});
    f(&SimulationParams::newton_accuracy, {.key = "newton_accuracy", .doc = "motion: a time step is done when one more Newton iteration promises to lower its energy by less than the weight (or loads, or reactions) times this height, or after newton_iterations; the summary counts the steps that ended so",
                                           .unit = "m", .min = 1e-12, .max = 1});
    f(&SimulationParams::air_drag, {.key = "air_drag", .doc = "motion: force per area and velocity against the air", .unit = "N*s/m3", .min = 0, .max = 100});
    f(&SimulationParams::wind, {.key = "wind", .doc = "motion: velocity of the air", .unit = "m/s", .min = -200, .max = 200});
    f(&SimulationParams::wind_times, {.key = "wind_times", .doc = "times of the rows of `wind_factor`, increasing", .unit = "s"});
    f(&SimulationParams::wind_factor, {.key = "wind_factor", .doc = "part of the wind at each of these times, straight in between; not given: 1"});
    f(&SimulationParams::air_density, {.key = "air_density", .doc = "density of the air that drags and lifts", .unit = "kg/m3", .min = 0, .max = 1000});
    f(&SimulationParams::wind_drag, {.key = "wind_drag", .doc = "motion: drag coefficient of a triangle across the flow; not given: 1.2 where there is wind, else 0", .unit = "1", .min = 0, .max = 10});
    f(&SimulationParams::wind_lift, {.key = "wind_lift", .doc = "motion: lift coefficient of a triangle at an angle to the flow; not given: as wind_drag", .unit = "1", .min = 0, .max = 10});
    f(&SimulationParams::damping_mass, {.key = "damping_mass", .doc = "motion: Rayleigh damping, force per mass and velocity", .unit = "1/s", .min = 0, .max = 1e5});
    f(&SimulationParams::damping_stiffness, {.key = "damping_stiffness", .doc = "motion: Rayleigh damping, time by which the cloth's stiffness resists the rate of its deformation", .unit = "s", .min = 0, .max = 10});
    f(&SimulationParams::support_reach, {.key = "support_reach", .doc = "distance from the support at which it begins to carry the cloth's middle surface", .unit = "m", .min = 1e-4, .max = 0.05});
    f(&SimulationParams::self_reach, {.key = "self_reach", .doc = "distance between middle surfaces at which cloth begins to carry cloth; not given: the thickest fabric's thickness, at least 0.8 mm",
                                      .unit = "m", .min = 1e-4, .max = 0.05});
    f(&SimulationParams::contact_stiffness, {.key = "contact_stiffness", .doc = "pressure in a contact per closing of the gap", .unit = "Pa/m", .min = 1e3, .max = 1e10});
    f(&SimulationParams::friction, {.key = "friction", .doc = "friction coefficient of cloth on cloth; not given: the greatest MIU of the garment's fabrics", .unit = "1", .min = 0, .max = 5});
    f(&SimulationParams::support_friction, {.key = "support_friction", .doc = "friction coefficient of cloth on the support", .unit = "1", .min = 0, .max = 5});
    f(&SimulationParams::closing_steps, {.key = "closing_steps", .doc = "steps in which open seams are drawn together", .min = 1, .max = 10000});
    f(&SimulationParams::closing_gravity, {.key = "closing_gravity", .doc = "part of gravity that acts while seams are open", .unit = "1", .min = 0, .max = 1});
    f(&SimulationParams::seam_stiffness, {.key = "seam_stiffness", .doc = "pull on the two sides of a seam while it is open, per particle and distance", .unit = "N/m", .min = 1, .max = 1e6});
    f(&SimulationParams::seam_pull, {.key = "seam_pull", .doc = "greatest pull on a particle of a seam while it is open; not given: none without free layers, with them what presses cloth together to half of `self_reach`", .unit = "N", .min = 1e-6, .max = 1e6});
    f(&SimulationParams::fastening_pull, {.key = "fastening_pull", .doc = "greatest pull on the halves of a button, hook, snap or tooth while they are drawn together", .unit = "N", .min = 1e-4, .max = 1e4});
    f(&SimulationParams::seam_gap, {.key = "seam_gap", .doc = "distance at which the two sides of a seam become one", .unit = "m", .min = 1e-6, .max = 0.01});
    f(&SimulationParams::largest_move, {.key = "largest_move", .doc = "equilibrium: no particle moves farther in one iteration", .unit = "m", .min = 1e-4, .max = 1});
    f(&SimulationParams::fixed, {.key = "fixed", .doc = "edges and points (panel.edge, panel.point) that are held where they are; short for a constraint of kind pin"});
    f(&SimulationParams::constraints, {.key = "constraints", .doc = "what is clamped, pinned, guided or driven; a particle named twice follows the first"});
    f(&SimulationParams::distances, {.key = "distances", .doc = "integrator provot: pairs of points that stay at a distance, by dynamic constraints"});
    f(&SimulationParams::loads, {.key = "loads", .doc = "forces on edges, points and regions"});
    f(&SimulationParams::motion_begin, {.key = "motion_begin", .doc = "input motion: time of its table at which the simulation begins", .unit = "s"});
    f(&SimulationParams::shape_times, {.key = "shape_times", .doc = "input shapes: time of each, increasing from 0; straight in between", .unit = "s"});
    f(&SimulationParams::watch, {.key = "watch", .doc = "edges, points and panels whose mean position the record has"});
    f(&SimulationParams::record, {.key = "record", .doc = "CSV file with one row per increment or time step: paths, reaction forces and moments, watched positions, energies; empty: none", .local = true});
    f(&SimulationParams::stability, {.key = "stability", .doc = "equilibrium: find the smallest stiffness against mass at the end of each increment, the square of the lowest angular frequency, for summary and record; negative: the equilibrium is unstable"});
    f(&SimulationParams::log, {.key = "log", .doc = "CSV file with one row per iteration: energies, residual, contacts, strains; empty: none", .local = true});
    f(&SimulationParams::frames, {.key = "frames", .doc = "motion: file of the cloth's vertices through time: NAME.mdd, NAME.pc2, or NAME_*.ply for a garment each, the star becomes a number; empty: none", .local = true});
    f(&SimulationParams::support_frames, {.key = "support_frames", .doc = "motion: the same of the support, NAME.mdd or NAME.pc2; empty: none", .local = true});
    f(&SimulationParams::frame_interval, {.key = "frame_interval", .doc = "time between frames: the first state at or after each multiple is taken", .unit = "s", .min = 1e-6, .max = 1e4, .local = true});
    f(&SimulationParams::checkpoint, {.key = "checkpoint", .doc = "file of all that it takes to go on: written every checkpoint_interval and on Ctrl-C; empty: none", .local = true});
    f(&SimulationParams::checkpoint_interval, {.key = "checkpoint_interval", .doc = "time steps (motion) or iterations (equilibrium) between checkpoints", .min = 1, .max = 1e9, .local = true});
    f(&SimulationParams::resume, {.key = "resume", .doc = "checkpoint to go on from, with the same inputs and parameters; empty: from the beginning", .local = true});
    f.check([](const SimulationParams& p, Issues& issues) {
      const auto table = [&](const char* item, const std::vector<double>& times, const std::vector<double>& values) {
        if (times.size() != values.size()) issues.push_back({"bad_table", {.item = item}, "there must be a factor for each time", "give as many as times"});
        for (std::size_t i = 1; i < times.size(); ++i) {
          if (!(times[i] > times[i - 1])) return issues.push_back({"bad_table", {.item = item}, "times must increase", "sort the rows"});
        }
      };
      table("gravity_factor", p.gravity_times, p.gravity_factor);
      table("wind_factor", p.wind_times, p.wind_factor);
      const auto bad = [&](const char* item, const char* what, const char* remedy) { issues.push_back({"bad_combination", {.item = item}, what, remedy}); };
      if (p.integrator == Integrator::provot && p.increments > 1) bad("increments", "integrator provot runs through paths and loads in one piece", "leave increments at 1");
      if (p.stability && (p.mode != Mode::equilibrium || p.integrator == Integrator::provot)) bad("stability", "equilibria of the implicit integrator have a stability", "leave it out, or write `mode: equilibrium` without integrator provot");
      if (p.integrator == Integrator::bdf2 && p.mode != Mode::motion) bad("integrator", "bdf2 is for motion", "write `mode: motion`, or integrator implicit");
      const bool wind = p.wind[0] != 0 || p.wind[1] != 0 || p.wind[2] != 0 || p.wind_drag.value_or(0) > 0 || p.wind_lift.value_or(0) > 0;
      if ((wind || p.damping_mass > 0 || p.damping_stiffness > 0) && (p.mode != Mode::motion || p.integrator == Integrator::provot)) {
        bad("wind", "wind and Rayleigh damping act in motion with an implicit integrator only", "write `mode: motion` with integrator bdf2 or implicit");
      }
      if (p.internal_friction == YarnFriction::yes && (p.model == Model::particle || p.integrator == Integrator::provot)) {
        bad("internal_friction", "only model woven with an implicit integrator has friction between yarns", "leave internal_friction at no, or change model and integrator");
      }
      if (p.mode != Mode::motion && !(p.frames.empty() && p.support_frames.empty())) bad("frames", "there are frames in motion only", "write `mode: motion`, or leave out frames");
      const auto ends = [](const std::string& path, const char* ending) { return path.ends_with(ending); };
      if (!p.frames.empty() && !ends(p.frames, ".mdd") && !ends(p.frames, ".pc2") && !(ends(p.frames, ".ply") && p.frames.find('*') != std::string::npos)) {
        bad("frames", "the file's name says no format", "write NAME.mdd, NAME.pc2 or NAME_*.ply");
      }
      if (!p.support_frames.empty() && !ends(p.support_frames, ".mdd") && !ends(p.support_frames, ".pc2")) bad("support_frames", "the file's name says no format", "write NAME.mdd or NAME.pc2");
      if (p.integrator == Integrator::provot && !(p.frames.empty() && p.support_frames.empty())) bad("frames", "integrator provot shows no frames", "leave out frames, or change the integrator");
      if (p.integrator == Integrator::provot && !(p.checkpoint.empty() && p.resume.empty())) bad("checkpoint", "integrator provot leaves no checkpoints", "leave out checkpoint and resume");
      if (!p.distances.empty() && p.integrator != Integrator::provot) bad("distances", "only integrator provot holds distances", "write `integrator: provot`, or join the points by a trim or fastener");
      for (const ConstraintSpec& c : p.constraints) {
        if (c.kind == Hold::clamp && (p.model == Model::particle || p.integrator == Integrator::provot)) {
          bad("constraints", "kind clamp holds tangent planes, which only model woven with the implicit integrator has", "hold two rows of particles with kind pin and a region");
        }
        if (c.kind == Hold::slide && p.integrator == Integrator::provot) bad("constraints", "integrator provot holds whole positions only", "use kind pin or drive, or the implicit integrator");
      }
      for (std::size_t i = 0; i < p.shape_times.size(); ++i) {
        if (i == 0 ? p.shape_times[0] != 0 : !(p.shape_times[i] > p.shape_times[i - 1])) {
          issues.push_back({"bad_table", {.item = "shape_times"}, "times of shapes begin at 0 and increase", "sort them"});
          break;
        }
      }
      if (!(p.gravity_direction[0] != 0 || p.gravity_direction[1] != 0 || p.gravity_direction[2] != 0)) issues.push_back({"bad_direction", {.item = "gravity_direction"}, "a direction has no length", "give another vector"});
    });
  }
};

/// What a constraint does to the cloth at the end.
struct Reaction {
  std::string name;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< that it exerts on the cloth [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< about the mean of its particles [N m]
};

/// What untangling the start moved of a panel.
struct Untangling {
  std::string panel;
  int moved = 0;            ///< particles
  double largest_move = 0;  ///< [m]
};

/// The middle of a run. The garment is the one that the run began with, with what its yarns remember.
struct Checkpoint {
  mesh::GarmentMesh garment;
  std::string state;  ///< bytes for SimulationHooks::resume
};

/// How the caller follows a run; any may be empty.
struct SimulationHooks {
  std::function<void(double fraction, const std::string& text)> progress;
  std::function<bool()> interrupted;
  /// The state on the way, every `frame_interval`: vertices of the garment and of the support [m].
  std::function<void(double time, const Points3& garment, const Points3& support)> frame;
  /// All that it takes to go on, every `checkpoint_interval` and when interrupted.
  std::function<void(const Checkpoint&)> checkpoint;
  const std::string* resume = nullptr;  ///< a checkpoint's state to go on from, with its garment in the place of the given one
  SupportMotion* supports = nullptr;  ///< motion: where the bodies of the support go; null: it stands still
  std::function<void(const char* phase)> phase;  ///< called when a part of the work begins: "sheet", "contact", "solve", "limit", "check", "other"
};

struct SimulationReport {
  bool converged = false;
  double residual = 0;            ///< sum of net force lengths over the weight [1]
  double residual_max = 0;        ///< greatest net force of a particle [N]
  int iterations = 0, solver_iterations = 0;
  double simulated_time = 0;      ///< motion [s]
  double membrane_energy = 0, bending_energy = 0, potential_energy = 0, contact_energy = 0;  ///< [J]
  double strain_warp_max = 0, strain_weft_max = 0, strain_warp_99 = 0, strain_weft_99 = 0, shear_max = 0;
  std::optional<double> lowest_stiffness;  ///< against mass, of the last equilibrium [1/s2]
  int contacts = 0;
  double least_gap = 0;           ///< [m]
  double seam_gap_max = 0;        ///< before merging; 0 once all are closed [m]
  int seams_open = 0;             ///< particle pairs not closed
  int rejected_steps = 0;         ///< motion: steps begun again with half of their time
  int unconverged_steps = 0;      ///< motion: time steps that ended before their energy was low enough
  std::vector<Reaction> reactions;
  std::vector<Reaction> bodies;   ///< what the cloth does to each body that moves at the end; moment about the body's shifted origin
  std::vector<std::pair<std::string, double>> distance_forces;  ///< of held distances at the end; positive: pushes the two apart [N]
  int start_inside = 0, start_intersections = 0;
  int start_left = 0;             ///< intersections of the start that could not be undone
  std::vector<Untangling> untangled;  ///< panels that untangling the start moved
  double start_move = 0;          ///< farthest that a particle was pushed out of the support at the start [m]
  std::vector<ClosureState> closures;  ///< that were to be closed
  int intersections = 0, support_intersections = 0, inside = 0;  ///< at the end, by the exact test
};

struct SimulationOutcome {
  mesh::GarmentMesh garment;
  SimulationReport report;
  Issues findings;   ///< not_converged, check, interrupted
  std::string log;   ///< CSV
  std::string record;  ///< CSV
};

/// error  what make_sheet and select() report; "bad_support" when the support is not valid
Result<SimulationOutcome> simulate(const mesh::GarmentMesh& garment, const std::optional<mesh::SupportMesh>& support, const SimulationParams& params, const SimulationHooks& hooks = {});

}  // namespace toile::dynamics

template <>
struct toile::Choices<toile::dynamics::Mode> {
  static constexpr std::array names{std::pair{"equilibrium", toile::dynamics::Mode::equilibrium}, std::pair{"motion", toile::dynamics::Mode::motion}};
};

template <>
struct toile::Choices<toile::dynamics::Model> {
  static constexpr std::array names{std::pair{"woven", toile::dynamics::Model::woven}, std::pair{"particle", toile::dynamics::Model::particle}};
};
template <>
struct toile::Choices<toile::dynamics::Integrator> {
  static constexpr std::array names{std::pair{"automatic", toile::dynamics::Integrator::automatic}, std::pair{"implicit", toile::dynamics::Integrator::implicit}, std::pair{"bdf2", toile::dynamics::Integrator::bdf2}, std::pair{"provot", toile::dynamics::Integrator::provot}};
};
template <>
struct toile::Choices<toile::dynamics::YarnFriction> {
  static constexpr std::array names{std::pair{"no", toile::dynamics::YarnFriction::no}, std::pair{"yes", toile::dynamics::YarnFriction::yes}};
};
template <>
struct toile::Choices<toile::mechanics::EdgeEstimate> {
  static constexpr std::array names{std::pair{"van_gelder", toile::mechanics::EdgeEstimate::van_gelder}, std::pair{"orthotropic", toile::mechanics::EdgeEstimate::orthotropic}};
};
template <>
struct toile::Choices<toile::mechanics::Modulus> {
  static constexpr std::array names{std::pair{"secant", toile::mechanics::Modulus::secant}, std::pair{"initial", toile::mechanics::Modulus::initial}};
};
