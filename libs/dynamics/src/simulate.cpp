#include "toile/dynamics/simulate.h"

#include "toile/base/parallel.h"
#include "toile/contact/exact.h"
#include "toile/contact/search.h"
#include "toile/contact/support_field.h"
#include "toile/contact/untangle.h"
#include "toile/dynamics/air.h"
#include "toile/dynamics/constraints.h"
#include "toile/dynamics/contact_force.h"
#include "toile/dynamics/fastening.h"
#include "toile/dynamics/linear_solver.h"
#include "toile/dynamics/provot.h"
#include "toile/dynamics/rest_neighbours.h"
#include "toile/dynamics/stability.h"
#include "toile/mechanics/sheet.h"

#include "archive.h"
#include "moving_support.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace toile::dynamics {
namespace {

using mechanics::Sheet;
using mesh::GarmentMesh;
using mesh::Ids;
using mesh::SupportMesh;

constexpr std::size_t grain = 1024;
const Points3 no_points(0, 3);
// A step may raise the energy by the garment's weight times this [m]: turning cloth by a finite angle stretches it a
// little, the next iteration takes that back; forbidding it makes the steps several times shorter. The energy of that stretch
// goes with the fourth power of the move, so below `slack_move` the slack does too: with more, two states could take turns for ever.
constexpr double energy_slack = 1e-3;
constexpr double slack_move = 1e-3;  // [m]
constexpr double solver_tolerance = 0.02;
// In motion: Newton's method converges linearly while cloth buckles, so a sharp solve of one of its iterations is soon lost. Who asks
// for accuracy gets it all the same. docs/performance.md
constexpr double rough_tolerance = 0.3, sharp_tolerance = 0.05, rough_accuracy = 1e-2;
constexpr int solver_iterations_max = 300;
// Relaxation: part of the last move that the next step starts with (until the energy rises), and the step's control.
constexpr double momentum = 0.95;
// Explicit integration: pairs are listed this part of the reach beyond it.
constexpr double contact_skin = 0.5;
constexpr double safe_step = 0.4;     // of the largest step that is certainly stable
constexpr double log_every = 2e-3;    // simulated time between rows of log and record [s]
constexpr double step_max = 2;        // [s]
constexpr double quiet_move = 2e-4;   // below it the step grows [m]
// Where a garment comes down to its rest the step grows below moves of this part of a cell (by about this angle cells turn, and half its square is how
// they stretch) and does not mind a rise of the residual (a move of a millimetre leaves tens of weights behind, which the next iteration takes away).
constexpr double quiet_turn = 0.12, rise_coming_down = 100, careful_rise = 4;
constexpr int stall_limit = 30;       // iterations without a better residual
constexpr double solved_well = 0.25;  // part of the net force left after one iteration, below it the step grows
// Places of the cloth nearer to each other within it than so many reaches do not touch: folded so tightly, cloth would lie in its own
// thickness, and sheared or bent, neighbours come nearer in space than they are in the cloth.
constexpr double neighbourhood = 1.5;
// A held particle is where its path wants it [m].
constexpr double at_target = 1e-9;
// Sides of a seam whose pull is limited are led so far in a step of the closing [m].
constexpr double closing_move = 2e-3;
// Supports in motion: a time step that does not end is halved, so many times at most.
constexpr int halvings_max = 10;
constexpr double carried_slack = 1e-12;  // rise of the energy while a support goes on, in heights of the weight: above rounding [m]
constexpr double carried_solver_tolerance = 1e-3;  // what goes with a support goes far: a twentieth of that would be in its way
constexpr int shared_limits = 6;  // rounds in which cloth and support are slowed down together

/// Node ids: vertices whose welds are closed share one.
Ids node_ids(const GarmentMesh& garment, const std::vector<char>& weld_closed) {
  GarmentMesh closed;
  closed.x = garment.x;
  for (std::size_t i = 0; i < garment.welds.size(); ++i) {
    if (weld_closed[i]) closed.welds.push_back(garment.welds[i]);
  }
  return mesh::particles(closed);
}

Points3 gather_mean(const Points3& vertices, const Ids& node, int nodes) {
  Points3 x = Points3::Zero(nodes, 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(nodes);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    x.row(node[v]) += vertices.row(v);
    count[node[v]] += 1;
  }
  for (Eigen::Index i = 0; i < nodes; ++i) {
    // A single vertex keeps its bits.
    if (count[i] > 1) x.row(i) /= count[i];
  }
  return x;
}

Points3 scatter(const Points3& nodes, const Ids& node) {
  Points3 x(node.size(), 3);
  for (Eigen::Index v = 0; v < node.size(); ++v) x.row(v) = nodes.row(node[v]);
  return x;
}

class Run {
 public:
  Run(const GarmentMesh& garment, const std::optional<SupportMesh>& support, const SimulationParams& params, const SimulationHooks& hooks)
      : garment_(garment), support_(support), params_(params), hooks_(hooks) {}

  Result<SimulationOutcome> go();

 private:
  struct Progress;
  struct Held {
    ConstraintSpec spec;
    Selected selected;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();      // of its particles at the start
    Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();  // projection on those that are held
    int body = -1;                                         // whose motion it follows
    std::vector<int> nodes;                                // that follow it, with the ghosts of its directors
  };

  void phase(const char* name) const {
    if (hooks_.phase) hooks_.phase(name);
  }
  bool interrupted() const { return hooks_.interrupted && hooks_.interrupted(); }

  Issues build(const Ids& node_of_vertex);
  Issues find_constraints();
  void hold_nodes();
  void clear_start();
  void evaluate(const Points3& x, bool with_matrix);
  void add_forces(const Points3& x, bool with_matrix);
  double objective(const Points3& x);
  double static_residual() const;
  double force_scale() const;
  double net_force(Eigen::Index node, const Eigen::RowVector3d& gradient) const;
  std::vector<Float4> prescribed() const;
  double held_error() const;
  bool iterate();
  void accept();
  Reaction reaction(std::size_t constraint) const;
  void close_seams();
  bool try_merge();
  bool advance_fasteners();
  void apply_fasteners();
  double seam_pull() const;
  bool limit_links();
  bool relax(Progress& progress);
  Issues equilibria();
  void find_stability();
  void read_velocities();
  void find_resistance(const Points3& before, const Points3& velocity_before, bool first);
  Issues move_in_time();
  Issues begin_motion();
  void support_at(const Points3& x, double part);
  Motion held_motion(const Held& held) const;
  Points3 limit(const Points3& from, const Points3& target, const Points3& support_from, Points3& support_target);
  Eigen::RowVector3d holding_force(int node) const;
  std::vector<BodyWrench> wrenches() const;
  void report_squeezed(double time);
  void store(Archive& archive, Progress& progress);
  void leave_checkpoint(Progress& progress);
  void show_frame(double time);
  Issues integrate_explicitly();
  void list_contacts(const Points3& x, ConstraintSet& set);
  void move_contacts(ConstraintSet& set, double step) const;
  void find_contacts(const Points3& x, contact::Radii radii);
  void log_row(const char* phase_name);
  void record_row();
  void set_time(double time);
  void check_end();
  void check_closures();
  GarmentMesh output() const;

  const GarmentMesh& garment_;
  const std::optional<SupportMesh>& support_;
  const SimulationParams& params_;
  const SimulationHooks& hooks_;
  SimulationReport report_;
  Issues findings_;
  std::string log_;

  Sheet sheet_;
  std::optional<mechanics::ParticleModel> particle_;  // takes the place of the sheet's energies
  mechanics::ParticleResponse particle_response_;
  std::optional<contact::Search> search_;
  contact::Surface support_surface_;
  Points3 support_x_ = no_points;
  MovingSupport moving_;
  std::vector<BodyWrench> wrenches_;  // of the cloth on the bodies at the end of the last step
  struct SupportContact {
    std::size_t index;  // in the set
    contact::Contact contact;
  };
  std::vector<SupportContact> support_contacts_;  // explicit integration: of a support that moves
  int stuck_node_ = -1;               // that was held back most at the last limit
  double support_part_ = 1;           // of its way in the step that it has gone
  double limit_part_ = 1;             // of the way that the last limit left to the support
  bool in_step_ = false;              // gradient_ and inertia_ are those of a time step
  ContactLaws laws_;
  double weight_ = 0;

  Points3 x_;             // accepted positions, |nodes|
  Points3 velocity_;
  Points3 start_;         // of the current step: friction and inertia refer to it
  // Equilibria in a row: friction refers to the beginning of the increment, so that where it ends does not depend on the iterations.
  bool by_increment_ = false;
  Points3 increment_start_;
  Points3 inertia_;       // where inertia alone would lead
  Eigen::VectorXd inertia_rate_;  // energy of inertia is mass * rate / 2 |x - inertia|^2 [1/s2]
  Points3 link_start_, link_offset_;
  double gravity_part_ = 1;
  Eigen::Vector3d gravity_ = Eigen::Vector3d::Zero();  // acts now [m/s2]
  Points3 load_;          // force on each node now [N]
  double time_ = 0;       // in the tables of paths and loads [s]
  double step_ = 0;       // [s]; infinite: no inertia
  bool damped_ = false;   // what resists motion counts
  // Velocities at the step's end are rate (x - origin). Resistance is coefficient * velocity against the air, with the origin moved along;
  // a push; and the stiffness at the step's beginning against the rate of the move since then.
  Eigen::VectorXd velocity_rate_, resistance_;  // [1/s], [N s/m]
  Points3 velocity_origin_, resistance_origin_, push_;
  BlockMatrix damping_;
  std::vector<FrictionPair> friction_;
  std::vector<std::uint8_t> self_exempt_, support_exempt_;
  std::vector<Held> held_;
  struct Load {
    LoadSpec spec;
    Selected selected;
  };
  std::vector<Load> loads_;
  std::vector<std::pair<std::string, Selected>> watched_;
  std::vector<std::array<int, 2>> distance_vertices_;
  std::vector<int> directed_vertices_;
  std::vector<int> holder_;    // |nodes|: index into held_, or -1
  std::vector<char> fixed_;    // |nodes|: all directions held
  Points3 hold_start_;         // |nodes|: where held nodes were at the start
  std::string record_;
  std::string resume_;           // state to go on from; empty: none
  double next_frame_ = 0;        // [s]

  // of the last evaluation
  mechanics::SheetResponse response_;
  Points3 gradient_;      // static: without inertia
  contact::Contacts contacts_;
  RestNeighbours rest_neighbours_;
  Fastening fastening_;
  double link_pull_ = std::numeric_limits<double>::infinity();  // greatest pull of an open seam now [N]
  std::vector<contact::Contact> self_contacts_;
  ContactSums contact_sums_;
  double energy_ = 0, friction_energy_ = 0, potential_ = 0;
  std::vector<ContactTerm> terms_;
  LinearSolver solver_;
  SolveReport solve_report_;
  int step_iteration_ = 0;  // Newton iterations before this one in its time step
  double momentum_ = momentum, tolerance_ = solver_tolerance, slack_ = energy_slack;  // sharper once the relaxation stalls
  double promised_ = 0;   // what the last direction promised to take off the energy of the step [J]
  double last_total_ = 1e300, last_left_ = 0, last_move_ = 0, last_fraction_ = 1, last_alpha_ = 1;
  std::vector<Float4> rhs_, direction_, given_, product_;
};

/// The checkpoint is none, or of another run.
Issue damaged_checkpoint() {
  return {"bad_checkpoint", {.item = "resume"}, "is damaged, or was left by another version", "begin again without `resume`"};
}

/// Where in its loops a run is.
struct Run::Progress {
  int step = 0;  // motion: time steps done; equilibrium: increments done
  // motion
  double time = 0, next_step = 0, last_step = 0;
  int passed = 0;
  Points3 before = no_points, velocity_before = no_points;
  std::vector<char> touched, touching;
  // equilibrium
  int iteration = 0, stalled = 0;
  double residual = 0, best = 0;
};

/// (matrix + terms) * x.
void multiply(const BlockMatrix& matrix, const std::vector<ContactTerm>& terms, const std::vector<Float4>& x, std::vector<Float4>& y) {
  y.resize(x.size());
  parallel_for(x.size(), grain, [&](std::size_t i) {
    Float4 sum{};
    for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k) sum += matrix.value[static_cast<std::size_t>(k)] * x[static_cast<std::size_t>(matrix.column[static_cast<std::size_t>(k)])];
    y[i] = sum;
  });
  for (const ContactTerm& term : terms) {
    Float4 sum{};
    for (std::size_t k = 0; k < 4; ++k) {
      if (term.node[k] >= 0) sum += mechanics::splat(term.weight[k]) * x[static_cast<std::size_t>(term.node[k])];
    }
    const Float4 force = term.block * sum;
    for (std::size_t k = 0; k < 4; ++k) {
      if (term.node[k] >= 0) y[static_cast<std::size_t>(term.node[k])] += mechanics::splat(term.weight[k]) * force;
    }
  }
}

Eigen::Vector3d vector(const Float4& v) { return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])}; }

/// Tangents of the cloth at a vertex: the mean of the faces of its panel around it, by area.
mechanics::YarnGradient tangents(const GarmentMesh& garment, const Sheet& sheet, const Points3& x, const std::vector<std::vector<int>>& faces_of_vertex, int vertex) {
  mechanics::YarnGradient sum{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double area = 0;
  std::set<int> ring;
  for (int f : faces_of_vertex[static_cast<std::size_t>(vertex)]) {
    const mechanics::YarnGradient g = mechanics::yarn_gradient(sheet, x, static_cast<std::size_t>(f));
    const double a = sheet.shapes[static_cast<std::size_t>(f)].area;
    sum.weft += a * g.weft;
    sum.warp += a * g.warp;
    area += a;
    for (int k = 0; k < 3; ++k) ring.insert(garment.faces(f, k));
  }
  TOILE_CHECK(area > 0, "vertex {} of {} is in no face", vertex, garment.vertex_count());
  const mechanics::YarnGradient mean{sum.weft / area, sum.warp / area};
  // Of the quadratic surface through the vertex that fits its neighbours and theirs best, so that a clamp at the border of a curved start
  // has the tangent of its end and not that of half a cell inside; the mean over the triangles where they do not tell one.
  std::set<int> patch = ring;
  const double scale = std::sqrt(area);
  for (int growth = 0; growth < 3; ++growth) {
    const std::vector<int> grown(patch.begin(), patch.end());
    for (int v : grown) {
      for (int f : faces_of_vertex[static_cast<std::size_t>(v)]) {
        for (int k = 0; k < 3; ++k) patch.insert(garment.faces(f, k));
      }
    }
    if (patch.size() < 8) continue;
    Eigen::MatrixXd terms(static_cast<Eigen::Index>(patch.size()) - 1, 5), values(static_cast<Eigen::Index>(patch.size()) - 1, 3);
    Eigen::Index row = 0;
    for (int v : patch) {
      if (v == vertex) continue;
      const Eigen::RowVector2d d = (garment.uv.row(v) - garment.uv.row(vertex)) / scale;
      terms.row(row) << d.x(), d.y(), d.x() * d.x(), d.x() * d.y(), d.y() * d.y();
      values.row(row++) = (x.row(sheet.node_of_vertex[v]) - x.row(sheet.node_of_vertex[vertex])) / scale;
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(terms);
    fit.setThreshold(1e-3);
    if (fit.rank() < 5) continue;
    const Eigen::MatrixXd slopes = fit.solve(values);
    return {slopes.row(0).transpose(), slopes.row(1).transpose()};
  }
  return mean;
}

Issues Run::build(const Ids& node_of_vertex) {
  mechanics::SheetOptions options;
  options.link_stiffness = params_.seam_stiffness;
  options.directed_vertices = directed_vertices_;
  options.internal_friction = params_.internal_friction == YarnFriction::yes;
  Result<Sheet> sheet = mechanics::make_sheet(garment_, node_of_vertex, options);
  if (!sheet) return sheet.issues();
  sheet_ = std::move(*sheet);
  if (params_.model == Model::particle) {
    mechanics::ParticleOptions particle_options;
    particle_options.edges = params_.edge_estimate;
    particle_options.modulus = params_.modulus;
    particle_options.link_stiffness = params_.seam_stiffness;
    Result<mechanics::ParticleModel> particle = mechanics::make_particle(garment_, node_of_vertex, particle_options);
    if (!particle) return particle.issues();
    particle_ = std::move(*particle);
    particle_response_ = {};
  }
  apply_fasteners();
  response_ = {};
  solver_ = {};
  mesh::Triangles faces(garment_.face_count(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = sheet_.corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
  }
  if (sheet_.node_count > sheet_.cloth_nodes) {
    std::vector<std::vector<int>> faces_of_vertex(static_cast<std::size_t>(garment_.vertex_count()));
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k) faces_of_vertex[static_cast<std::size_t>(garment_.faces(f, k))].push_back(static_cast<int>(f));
    }
    x_.conservativeResize(sheet_.node_count, 3);
    for (const mechanics::Director& d : sheet_.directors) {
      const mechanics::YarnGradient t = tangents(garment_, sheet_, x_, faces_of_vertex, d.vertex);
      x_.row(d.ghost_u) = x_.row(d.node) + d.length * t.weft.transpose();
      x_.row(d.ghost_v) = x_.row(d.node) + d.length * t.warp.transpose();
    }
  }
  const Ids particle = mesh::particles(garment_);
  Ids adjacency(sheet_.node_count);
  for (int i = sheet_.cloth_nodes; i < sheet_.node_count; ++i) adjacency[i] = static_cast<int>(garment_.vertex_count()) + i;
  for (Eigen::Index v = 0; v < node_of_vertex.size(); ++v) adjacency[node_of_vertex[v]] = particle[v];
  contact::Surface surface = contact::make_surface(sheet_.node_count, faces, adjacency);
  if (support_) {
    search_.emplace(std::move(surface), x_, support_surface_, support_x_);
  } else {
    search_.emplace(std::move(surface), x_);
  }
  rest_neighbours_ = RestNeighbours(garment_, node_of_vertex, sheet_.node_count);
  velocity_ = Points3::Zero(sheet_.node_count, 3);
  friction_.clear();
  self_exempt_.clear();
  support_exempt_.clear();
  start_ = x_;
  link_start_.resize(static_cast<Eigen::Index>(sheet_.links.size()), 3);
  for (std::size_t i = 0; i < sheet_.links.size(); ++i) {
    link_start_.row(static_cast<Eigen::Index>(i)) = x_.row(sheet_.links[i].a) - x_.row(sheet_.links[i].b);
  }
  link_offset_ = link_start_;
  weight_ = sheet_.mass.sum() * params_.gravity;
  inertia_rate_ = Eigen::VectorXd::Zero(sheet_.node_count);
  hold_nodes();
  set_time(time_);
  return {};
}

/// Which nodes each constraint holds; a node that several name follows the first.
void Run::hold_nodes() {
  const auto n = static_cast<std::size_t>(sheet_.node_count);
  holder_.assign(n, -1);
  fixed_.assign(n, 0);
  hold_start_ = x_;
  std::vector<int> director(static_cast<std::size_t>(garment_.vertex_count()), -1);
  for (std::size_t i = 0; i < sheet_.directors.size(); ++i) director[static_cast<std::size_t>(sheet_.directors[i].vertex)] = static_cast<int>(i);
  for (std::size_t c = 0; c < held_.size(); ++c) {
    Held& held = held_[c];
    held.nodes.clear();
    const bool whole = held.spec.kind != Hold::slide;
    const auto take = [&](int node) {
      if (holder_[static_cast<std::size_t>(node)] >= 0) return;
      holder_[static_cast<std::size_t>(node)] = static_cast<int>(c);
      fixed_[static_cast<std::size_t>(node)] = whole;
      held.nodes.push_back(node);
    };
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int v : held.selected.vertices) {
      const int node = sheet_.node_of_vertex[v];
      sum += x_.row(node).transpose();
      take(node);
    }
    held.centre = sum / static_cast<double>(held.selected.vertices.size());
    if (held.spec.kind != Hold::clamp) continue;
    for (int v : held.selected.vertices) {
      const mechanics::Director& d = sheet_.directors[static_cast<std::size_t>(director[static_cast<std::size_t>(v)])];
      take(d.ghost_u);
      take(d.ghost_v);
    }
  }
}

/// Gravity and loads of a time.
void Run::set_time(double time) {
  time_ = time;
  gravity_ = gravity_part_ * factor_at(params_.gravity_times, params_.gravity_factor, time) * params_.gravity * Eigen::Vector3d(params_.gravity_direction.data()).normalized();
  load_ = Points3::Zero(sheet_.node_count, 3);
  for (const Load& load : loads_) {
    const Eigen::RowVector3d force = factor_at(load.spec.times, load.spec.factor, time) * Eigen::RowVector3d(load.spec.force.data());
    for (std::size_t k = 0; k < load.selected.vertices.size(); ++k) load_.row(sheet_.node_of_vertex[load.selected.vertices[k]]) += load.selected.share[k] * force;
  }
}

/// Where a held place is to be now.
Motion Run::held_motion(const Held& held) const {
  if (held.body < 0) return motion_at(held.spec, held.centre, time_);
  const BodyPose pose = moving_.since_beginning(held.body, moving_.next());
  Motion motion;
  motion.turn = pose.rotation.toRotationMatrix();
  motion.move = pose.shift;
  return motion;
}

/// How far each held node has to go to where its path wants it now; zero for the others.
std::vector<Float4> Run::prescribed() const {
  std::vector<Float4> move(static_cast<std::size_t>(sheet_.node_count), Float4{});
  for (const Held& held : held_) {
    const Motion motion = held_motion(held);
    for (int node : held.nodes) {
      const Eigen::Vector3d d = held.directions * (motion(hold_start_.row(node).transpose()) - x_.row(node).transpose());
      move[static_cast<std::size_t>(node)] = mechanics::load3(d.data());
    }
  }
  return move;
}

double Run::held_error() const {
  double largest = 0;
  for (const Held& held : held_) {
    const Motion motion = held_motion(held);
    for (int node : held.nodes) largest = std::max(largest, (held.directions * (motion(hold_start_.row(node).transpose()) - x_.row(node).transpose())).norm());
  }
  return largest;
}

/// Vertices that constraints, loads and the record name.
Issues Run::find_constraints() {
  Issues issues;
  std::vector<ConstraintSpec> specs;
  if (!params_.fixed.empty()) {
    ConstraintSpec fixed;
    fixed.name = "fixed";
    fixed.on = params_.fixed;
    specs.push_back(fixed);
  }
  specs.insert(specs.end(), params_.constraints.begin(), params_.constraints.end());
  std::set<std::string> names;
  std::set<int> directed;
  for (ConstraintSpec& spec : specs) {
    if (spec.name.empty() && !spec.on.empty()) spec.name = spec.on.front();
    if (!names.insert(spec.name).second) {
      issues.push_back(Issue{"duplicate_name", {.item = "constraint " + spec.name}, "two constraints have this name", "give one of them another `name`"});
    }
    Result<Selected> selected = select(garment_, {spec.on, spec.from, spec.to, spec.region}, "constraint " + spec.name);
    if (!selected) {
      append(issues, selected.issues());
      continue;
    }
    Held held;
    held.spec = spec;
    held.selected = std::move(*selected);
    if (!spec.body.empty()) held.body = moving_.body(spec.body);
    if (spec.normal) {
      const Eigen::Vector3d n = Eigen::Vector3d(spec.normal->data()).normalized();
      held.directions = n * n.transpose();
    } else if (spec.along) {
      const Eigen::Vector3d t = Eigen::Vector3d(spec.along->data()).normalized();
      held.directions = Eigen::Matrix3d::Identity() - t * t.transpose();
    }
    if (spec.kind == Hold::clamp) directed.insert(held.selected.vertices.begin(), held.selected.vertices.end());
    held_.push_back(std::move(held));
  }
  directed_vertices_.assign(directed.begin(), directed.end());
  for (const LoadSpec& spec : params_.loads) {
    Result<Selected> selected = select(garment_, {spec.on, spec.from, spec.to, spec.region}, "load " + spec.name);
    if (selected) {
      loads_.push_back({spec, std::move(*selected)});
    } else {
      append(issues, selected.issues());
    }
  }
  for (const DistanceSpec& spec : params_.distances) {
    std::array<int, 2> ends{};
    for (std::size_t k = 0; k < 2; ++k) {
      Result<Selected> selected = select(garment_, {{spec.between[k]}, 0, 1, {}}, "distance to " + spec.between[k]);
      if (!selected) {
        append(issues, selected.issues());
      } else if (selected->vertices.size() != 1) {
        issues.push_back(Issue{"bad_reference", {.item = "distance to " + spec.between[k]}, "is not one point", "name a point, panel.point"});
      } else {
        ends[k] = selected->vertices.front();
      }
    }
    distance_vertices_.push_back(ends);
  }
  for (const std::string& name : params_.watch) {
    Result<Selected> selected = select(garment_, {{name}, 0, 1, {}}, "watch " + name);
    if (selected) {
      watched_.emplace_back(name, std::move(*selected));
    } else {
      append(issues, selected.issues());
    }
  }
  return issues;
}

/// Takes the start out of the support and out of itself, as far as that goes. What stays is left out of the limiter.
void Run::clear_start() {
  phase("check");
  const contact::Surface& cloth = search_->cloth();
  const Points3 given = x_;
  std::optional<contact::SupportField> field;
  if (support_) field.emplace(support_surface_, support_x_);
  const double clearance = 0.25 * params_.support_reach;
  const auto push_out = [&] {
    if (!field) return false;
    const contact::PushedOut pushed = contact::project_outside(*field, cloth, x_, clearance);
    report_.start_inside = std::max(report_.start_inside, pushed.inside_before);
    if (pushed.moved > 0) x_ = pushed.x;
    return pushed.moved > 0;
  };
  push_out();
  contact::UntangleOptions options;
  options.held.assign(static_cast<std::size_t>(sheet_.node_count), 0);
  for (std::size_t i = 0; i < options.held.size(); ++i) options.held[i] = holder_[i] >= 0;
  std::vector<contact::FacePair> cuts = contact::self_intersections(cloth, x_);
  report_.start_intersections = static_cast<int>(cuts.size());
  // Out of itself may be into the support, and back.
  Points3 best = x_;
  std::size_t fewest = cuts.size();
  for (int round = 0; round < 3 && !cuts.empty(); ++round) {
    x_ = contact::untangle(cloth, x_, options).x;
    const bool pushed = push_out();
    cuts = contact::self_intersections(cloth, x_);
    if (cuts.size() < fewest) {
      fewest = cuts.size();
      best = x_;
    } else if (!pushed) {
      break;
    }
  }
  if (cuts.size() > fewest) {
    x_ = best;
    cuts = contact::self_intersections(cloth, x_);
  }
  const auto mark = [&](int face, std::vector<std::uint8_t>& exempt) {
    exempt.resize(static_cast<std::size_t>(sheet_.node_count), 0);
    for (int node : sheet_.corners[static_cast<std::size_t>(face)]) exempt[static_cast<std::size_t>(node)] = 1;
  };
  for (const contact::FacePair& pair : cuts) {
    mark(pair.a, self_exempt_);
    mark(pair.b, self_exempt_);
  }
  report_.start_left = static_cast<int>(cuts.size());
  if (support_) {
    for (const contact::FacePair& pair : contact::support_intersections(cloth, x_, support_surface_, support_x_)) {
      ++report_.start_intersections;
      ++report_.start_left;
      mark(pair.a, support_exempt_);
    }
  }
  // What moved how far, panel by panel.
  std::map<int, Untangling> moved;
  std::vector<char> counted(static_cast<std::size_t>(sheet_.node_count), 0);
  for (Eigen::Index v = 0; v < sheet_.node_of_vertex.size(); ++v) {
    const int node = sheet_.node_of_vertex[v];
    const double way = (x_.row(node) - given.row(node)).norm();
    report_.start_move = std::max(report_.start_move, way);
    if (!(way > 0) || report_.start_intersections == 0 || counted[static_cast<std::size_t>(node)]) continue;
    counted[static_cast<std::size_t>(node)] = 1;
    const int panel = garment_.vertex_panel[v];
    Untangling& entry = moved[panel];
    entry.panel = garment_.panels[static_cast<std::size_t>(panel)].name;
    ++entry.moved;
    entry.largest_move = std::max(entry.largest_move, way);
  }
  for (const auto& [panel, entry] : moved) report_.untangled.push_back(entry);
  start_ = x_;
}

/// Near pairs, without those of the cloth with itself that are neighbours in it.
void Run::find_contacts(const Points3& x, contact::Radii radii) {
  contacts_ = search_->proximity(x, support_x_, radii);
  self_contacts_ = rest_neighbours_.without(contacts_.self, neighbourhood * laws_.self.reach);
  contacts_.self = self_contacts_;
}

/// Energies, gradient and if asked the second derivative at x. Inertia is left to the caller.
void Run::evaluate(const Points3& x, bool with_matrix) {
  phase("sheet");
  const auto curvature = with_matrix ? std::optional(mechanics::Curvature::positive) : std::nullopt;
  if (particle_) {
    if (with_matrix) std::swap(response_.matrix, particle_response_.matrix);
    mechanics::evaluate(*particle_, x, link_offset_, curvature, particle_response_);
    if (with_matrix) std::swap(response_.matrix, particle_response_.matrix);
    response_.energy = particle_response_.energy;
    response_.gradient = particle_response_.gradient;
  } else {
    mechanics::evaluate(sheet_, x, link_offset_, curvature, response_);
  }
  if (damped_ && with_matrix && params_.damping_stiffness > 0) {
    const mechanics::Float4 part = mechanics::splat(static_cast<float>(params_.damping_stiffness / step_));
    parallel_for(damping_.value.size(), grain, [&](std::size_t k) {
      for (int c = 0; c < 3; ++c) response_.matrix.value[k].column[c] += part * damping_.value[k].column[c];
    });
    response_.constant_blocks_stand = false;
  }
  phase("contact");
  find_contacts(x, {laws_.self.reach, laws_.support.reach});
  add_forces(x, with_matrix);
}

/// The rest of an evaluation: on the sheet's response and the contacts at x, which are at hand. By itself it brings the last evaluation
/// up to date when time or what friction remembers has changed since.
void Run::add_forces(const Points3& x, bool with_matrix) {
  phase("contact");
  gradient_ = response_.gradient - sheet_.mass * gravity_.transpose() - load_;
  potential_ = -sheet_.mass.dot(x * gravity_) - load_.cwiseProduct(x).sum();
  terms_.clear();
  contact_sums_ = add_repulsion(contacts_, x, support_x_, sheet_.area, laws_, gradient_, with_matrix ? &terms_ : nullptr);
  friction_energy_ = add_friction(friction_, by_increment_ ? increment_start_ : start_, x, gradient_, with_matrix ? &terms_ : nullptr);
  if (damped_) {
    const Points3 moved = x - resistance_origin_;
    const Eigen::VectorXd rate = resistance_.cwiseProduct(velocity_rate_);
    gradient_ += rate.asDiagonal() * moved - push_;
    friction_energy_ += 0.5 * moved.cwiseProduct(rate.asDiagonal() * moved).sum() - push_.cwiseProduct(x - start_).sum();
    if (params_.damping_stiffness > 0) {
      std::vector<Float4> by(static_cast<std::size_t>(x.rows())), force;
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const Eigen::Vector3d d = (params_.damping_stiffness / step_ * (x.row(i) - start_.row(i))).transpose();
        by[static_cast<std::size_t>(i)] = mechanics::load3(d.data());
      }
      multiply(damping_, {}, by, force);
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const Eigen::RowVector3d f = vector(force[static_cast<std::size_t>(i)]).transpose();
        gradient_.row(i) += f;
        friction_energy_ += 0.5 * f.dot(x.row(i) - start_.row(i));
      }
    }
  }
  energy_ = response_.energy.total() + potential_ + contact_sums_.energy + friction_energy_;
  phase("other");
}

/// The net force on a node in the directions that are free.
double Run::net_force(Eigen::Index node, const Eigen::RowVector3d& gradient) const {
  const int holder = holder_[static_cast<std::size_t>(node)];
  if (holder < 0) return gradient.norm();
  if (fixed_[static_cast<std::size_t>(node)]) return 0;
  return (gradient.transpose() - held_[static_cast<std::size_t>(holder)].directions * gradient.transpose()).norm();
}

/// What net forces are measured by: the weight or the loads, whichever is greater; without either, half of what constraints exert on
/// the cloth (each pulls against another); a thousandth of the weight on earth where there is none of them.
double Run::force_scale() const {
  double loads = 0, reactions = 0;
  for (Eigen::Index i = 0; i < load_.rows(); ++i) loads += load_.row(i).norm();
  if (weight_ > 0 || loads > 0) return std::max(weight_, loads);
  for (const Held& held : held_) {
    for (int node : held.nodes) {
      if (node < sheet_.cloth_nodes) reactions += (held.directions * gradient_.row(node).transpose()).norm();
    }
  }
  return std::max(0.5 * reactions, 1e-3 * 9.81 * sheet_.mass.sum());
}

double Run::static_residual() const {
  double sum = 0;
  for (Eigen::Index i = 0; i < gradient_.rows(); ++i) sum += net_force(i, gradient_.row(i));
  return sum / force_scale();
}

/// One Newton iteration on energy + inertia from x_ with the evaluation of x_ at hand (with matrix); held nodes go towards where their
/// paths want them. True when x_ moved.
bool Run::iterate() {
  const auto n = static_cast<std::size_t>(sheet_.node_count);
  rhs_.resize(n);
  parallel_for(n, grain, [&](std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double m = sheet_.mass[row] * inertia_rate_[row];
    const Eigen::Vector3d force = -(gradient_.row(row) + m * (x_.row(row) - inertia_.row(row))).transpose();
    rhs_[i] = mechanics::load3(force.data());
    Block& d = response_.matrix.value[static_cast<std::size_t>(response_.matrix.diagonal[i])];
    for (int c = 0; c < 3; ++c) d.column[c][c] += static_cast<float>(m + (damped_ ? resistance_[row] * velocity_rate_[row] : 0.0));
  });
  const std::vector<Float4> given = prescribed();
  bool driven = false;
  for (const Float4& d : given) driven = driven || d[0] != 0 || d[1] != 0 || d[2] != 0;
  const bool carried = moving_.moves() && support_x_ != moving_.end();
  driven = driven || carried;
  const std::vector<Float4> force = rhs_;
  if (carried) {
    // What touches the support goes with it.
    const Points3 push = support_push(contacts_.support, friction_, 1 - support_part_, start_, x_, support_x_, moving_.end(), no_points, sheet_.area, laws_).gradient;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d f = push.row(static_cast<Eigen::Index>(i)).transpose();
      rhs_[i] -= mechanics::load3(f.data());
    }
  }
  if (driven) {
    multiply(response_.matrix, terms_, given, product_);
    for (std::size_t i = 0; i < n; ++i) rhs_[i] -= product_[i];
  }
  BlockMatrix undriven;
  if (driven) undriven = response_.matrix;
  for (std::size_t i = 0; i < n; ++i) {
    if (holder_[i] < 0) continue;
    Block& d = response_.matrix.value[static_cast<std::size_t>(response_.matrix.diagonal[i])];
    if (fixed_[i]) {
      // A heavy diagonal holds the row; what is left of its motion is dropped below.
      rhs_[i] = Float4{};
      for (int c = 0; c < 3; ++c) d.column[c][c] += 1e8f;
      continue;
    }
    // The held directions are taken out of row and column.
    response_.constant_blocks_stand = false;
    const Eigen::Matrix3d held = held_[static_cast<std::size_t>(holder_[i])].directions, free = Eigen::Matrix3d::Identity() - held;
    const Eigen::Vector3d r = free * vector(rhs_[i]);
    rhs_[i] = mechanics::load3(r.data());
    for (int k = response_.matrix.row_start[i]; k < response_.matrix.row_start[i + 1]; ++k) {
      const auto j = static_cast<std::size_t>(response_.matrix.column[static_cast<std::size_t>(k)]);
      Block& value = response_.matrix.value[static_cast<std::size_t>(k)];
      if (j == i) {
        const Eigen::Matrix3d m = value.matrix();
        value = Block::from(free * m * free + m.trace() * held);
        continue;
      }
      value = Block::from(free * value.matrix());
      const auto begin = response_.matrix.column.begin() + response_.matrix.row_start[j], end = response_.matrix.column.begin() + response_.matrix.row_start[j + 1];
      Block& mirrored = response_.matrix.value[static_cast<std::size_t>(std::lower_bound(begin, end, static_cast<int>(i)) - response_.matrix.column.begin())];
      mirrored = Block::from(mirrored.matrix() * free);
    }
  }
  const auto inertia_energy = [&](const Points3& x) {
    return 0.5 * (x - inertia_).cwiseProduct(sheet_.mass.cwiseProduct(inertia_rate_).asDiagonal() * (x - inertia_)).sum();
  };
  const double contact_before = contact_sums_.energy;
  const double before = energy_ + inertia_energy(x_), scale_of_slack = force_scale();
  phase("solve");
  const bool in_time = params_.mode == Mode::motion && inertia_rate_[0] > 0 && sheet_.links.empty();
  const double motion_tolerance = std::clamp(rough_tolerance * std::pow(params_.newton_accuracy / rough_accuracy, 0.75), sharp_tolerance, rough_tolerance);
  solver_.factor(response_.matrix, terms_, x_, fixed_, in_time && step_iteration_ > 0 && motion_tolerance > 0.5 * rough_tolerance ? Coarse::kept : Coarse::anew);
  if (in_time) {
    // What inertia alone would do is the first guess.
    direction_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d d = (inertia_.row(static_cast<Eigen::Index>(i)) - x_.row(static_cast<Eigen::Index>(i))).transpose();
      direction_[i] = holder_[i] < 0 ? mechanics::load3(d.data()) : Float4{};
    }
  }
  solve_report_ = solver_.solve(response_.matrix, terms_, rhs_, direction_, {.tolerance = carried ? carried_solver_tolerance : (in_time ? motion_tolerance : tolerance_), .max_iterations = solver_iterations_max, .from_x = in_time});
  report_.solver_iterations += solve_report_.iterations;
  promised_ = 0;
  for (std::size_t i = 0; i < n; ++i) promised_ += 0.5 * vector(direction_[i]).dot(vector(rhs_[i]));
  ++report_.iterations;
  phase("limit");
  for (std::size_t i = 0; i < n; ++i) {
    if (holder_[i] < 0) continue;
    const Eigen::Matrix3d& held = held_[static_cast<std::size_t>(holder_[i])].directions;
    Eigen::Vector3d d = vector(given[i]);
    if (!fixed_[i]) d += vector(direction_[i]) - held * vector(direction_[i]);
    direction_[i] = mechanics::load3(d.data());
  }
  // Paths do work on the cloth: so much more energy, with room for what is not linear.
  double work = 0;
  if (driven) {
    multiply(undriven, terms_, direction_, product_);
    for (std::size_t i = 0; i < n; ++i) work += vector(direction_[i]).dot(0.5 * vector(product_[i]) - vector(force[i]));
    if (carried) {
      Points3 move(x_.rows(), 3);
      for (std::size_t i = 0; i < n; ++i) move.row(static_cast<Eigen::Index>(i)) = vector(direction_[i]).transpose();
      work += support_push(contacts_.support, friction_, 1 - support_part_, start_, x_, support_x_, moving_.end(), move, sheet_.area, laws_).energy;
    }
    work = 2 * std::max(work, 0.0);
  }
  double largest = 0;
  for (const Float4& d : direction_) largest = std::max(largest, std::sqrt(static_cast<double>(d[0]) * d[0] + static_cast<double>(d[1]) * d[1] + static_cast<double>(d[2]) * d[2]));
  if (!std::isfinite(largest)) return false;
  const double scale = !in_time && largest > params_.largest_move ? params_.largest_move / largest : 1;
  Points3 target(x_.rows(), 3);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (int c = 0; c < 3; ++c) target(row, c) = x_(row, c) + scale * static_cast<double>(direction_[i][c]);
  }
  if (driven && scale == 1) {
    // To the last digit.
    for (const Held& held : held_) {
      const Motion motion = held_motion(held);
      for (int node : held.nodes) target.row(node) += (held.directions * (motion(hold_start_.row(node).transpose()) - target.row(node).transpose())).transpose();
    }
  }
  const Points3 from = x_, support_from = support_x_;
  const double part_from = support_part_;
  Points3 support_reached = carried ? (scale == 1 ? moving_.end() : Points3(support_from + scale * (moving_.end() - support_from))) : support_x_;
  const Points3 support_target = support_reached;
  Points3 reached = limit(from, target, support_from, support_reached);
  // The straight way to `reached` is free of intersections, so every point on it is.
  double alpha = 1;
  bool moved = false;
  const auto shorten = [&](int trials, bool take_last) {
    alpha = 1;
    for (int trial = 0; trial < trials; ++trial, alpha *= 0.5) {
      const Points3 candidate = alpha == 1 ? reached : Points3(from + alpha * (reached - from));
      if (carried) {
        const double gone = alpha * scale * limit_part_;
        support_at(alpha == 1 ? support_reached : Points3(support_from + alpha * (support_reached - support_from)), gone == 1 ? 1 : part_from + gone * (1 - part_from));
      }
      evaluate(candidate, true);
      // What a support does in contacts as it goes on is its work.
      const double after = energy_ - (carried ? std::max(0.0, contact_sums_.energy - contact_before) : 0.0) + inertia_energy(candidate);
      const double part = std::min(1.0, alpha * scale * largest / slack_move);
      moved = after <= before + slack_ * part * part * part * part * scale_of_slack + work + carried_slack * (carried ? scale_of_slack : 0.0) || (take_last && trial + 1 == trials);
      if (moved) {
        x_ = candidate;
        return;
      }
    }
  };
  if (!in_time) {
    shorten(6, true);
  } else {
    // Holding single nodes back can turn a descent into an ascent; shortening the way of all does not.
    shorten(last_fraction_ < 1 ? 2 : 8, false);
    if (!moved && last_fraction_ < 1) {
      phase("limit");
      contact::LimitOptions options;
      options.self_exempt = self_exempt_;
      options.support_exempt = support_exempt_;
      const double part = 0.9 * search_->step_fraction(from, target, support_from, support_target, options);
      support_reached = carried ? Points3(support_from + part * (support_target - support_from)) : support_from;
      reached = limit(from, from + part * (target - from), support_from, support_reached);
      limit_part_ *= part;
      shorten(8, false);
    }
    if (!moved) {
      if (carried) support_at(support_from, part_from);
      evaluate(x_, true);
    }
  }
  last_alpha_ = alpha;
  const Points3 left = gradient_ + sheet_.mass.cwiseProduct(inertia_rate_).asDiagonal() * (x_ - inertia_);
  last_left_ = 0;
  for (Eigen::Index i = 0; i < left.rows(); ++i) last_left_ += net_force(i, left.row(i));
  last_left_ /= force_scale();
  last_move_ = (x_ - from).rowwise().norm().maxCoeff();
  return moved;
}

/// The support on its way through a step, and with it what friction has seen of it.
void Run::support_at(const Points3& x, double part) {
  support_x_ = x;
  support_part_ = part;
  for (FrictionPair& pair : friction_) pair.support_motion = part * pair.support_way;
}

/// Ends of the straight ways from -> target that touch nothing. Where cloth cannot get out of a support's way, all are slowed down, the support too.
Points3 Run::limit(const Points3& from, const Points3& target, const Points3& support_from, Points3& support_target) {
  contact::LimitOptions options;
  options.self_exempt = self_exempt_;
  options.support_exempt = support_exempt_;
  const bool moves = support_target != support_from;
  double part = 1;
  for (int round = 0;; ++round) {
    const Points3 end = part == 1 ? target : Points3(from + part * (target - from));
    const Points3 support_end = part == 1 ? support_target : Points3(support_from + part * (support_target - support_from));
    const contact::StepLimit& limited = search_->limit_step(from, end, support_from, support_end, options);
    last_fraction_ = std::min(part, limited.least_fraction);
    if (moves && limited.limited_nodes > 0) stuck_node_ = static_cast<int>(std::min_element(limited.fraction.begin(), limited.fraction.end()) - limited.fraction.begin());
    limit_part_ = part * limited.support_fraction;
    if (!moves || limited.support_fraction == 1) {
      support_target = support_end;
      return limited.x;
    }
    if (round + 1 == shared_limits) {
      support_target = support_from + limited.support_fraction * (support_end - support_from);
      return limited.x;
    }
    part *= limited.support_fraction;
  }
}

/// The step is over: friction takes note, the next step starts here.
void Run::accept() {
  if (by_increment_) {
    friction_ = follow_friction(friction_, increment_start_, contacts_, x_, support_x_, sheet_.area, laws_, false);
  } else {
    friction_ = update_friction(friction_, start_, contacts_, x_, support_x_, sheet_.area, laws_);
  }
  const double total = energy_ - friction_energy_;
  if (total <= last_total_) {
    inertia_ = x_ + momentum_ * (x_ - start_);
  } else {
    inertia_ = x_;
  }
  last_total_ = total;
  start_ = x_;
}

void Run::log_row(const char* phase_name) {
  if (log_.empty()) {
    log_ = "iteration,phase,time_s,step_s,residual,left,membrane_J,bending_J,potential_J,contact_J,links_J,kinetic_J,total_J,contacts,least_gap_m,solver_iterations,solver_reduction,move_m,fraction,alpha\n";
  }
  const double kinetic = damped_ || params_.mode == Mode::motion ? 0.5 * velocity_.cwiseProduct(sheet_.mass.asDiagonal() * velocity_).sum() : 0;
  const double total = response_.energy.total() + potential_ + contact_sums_.energy + kinetic;
  log_ += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", report_.iterations, phase_name, time_, step_, static_residual(), last_left_,
                      response_.energy.membrane, response_.energy.bending, potential_, contact_sums_.energy, response_.energy.links, kinetic, total, contact_sums_.pairs,
                      contact_sums_.least_gap, solve_report_.iterations, solve_report_.reduction, last_move_, last_fraction_, last_alpha_);
}

/// What it takes to hold a node on its way.
Eigen::RowVector3d Run::holding_force(int node) const {
  if (!in_step_) return gradient_.row(node);
  return gradient_.row(node) + sheet_.mass[node] * inertia_rate_[node] * (x_.row(node) - inertia_.row(node));
}

/// Of the cloth on the bodies, at the end of a step and before friction takes note of it.
std::vector<BodyWrench> Run::wrenches() const {
  if (!moving_.moves()) return {};
  std::vector<BodyWrench> result(moving_.bodies().size());
  moving_.add_contact_wrenches(contacts_.support, friction_, start_, x_, support_x_, sheet_.area, laws_, result);
  for (const Held& held : held_) {
    if (held.body < 0) continue;
    for (int node : held.nodes) moving_.add_force(held.body, x_.row(node).transpose(), -held.directions * holding_force(node).transpose(), result);
  }
  return result;
}

Reaction Run::reaction(std::size_t constraint) const {
  const Held& held = held_[constraint];
  Reaction r{held.spec.name};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int v : held.selected.vertices) centre += x_.row(sheet_.node_of_vertex[v]).transpose();
  centre /= static_cast<double>(held.selected.vertices.size());
  for (int node : held.nodes) {
    const Eigen::Vector3d force = held.directions * holding_force(node).transpose();
    r.force += force;
    r.moment += (x_.row(node).transpose() - centre).cross(force);
  }
  return r;
}

/// One row of the record: the state at the end of an increment or time step, with the evaluation of x_ at hand.
void Run::record_row() {
  if (record_.empty()) {
    record_ = "time_s,residual,membrane_J,bending_J,potential_J,contact_J";
    for (const Held& held : held_) {
      for (const char* what : {"move_x_m", "move_y_m", "move_z_m", "force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"}) record_ += fmt::format(",{}.{}", held.spec.name, what);
    }
    for (const auto& [name, selected] : watched_) {
      for (const char* axis : {"x", "y", "z"}) record_ += fmt::format(",{}.{}_m", name, axis);
    }
    if (params_.stability) record_ += ",lowest_stiffness_per_s2";
    if (moving_.moves()) {
      for (const std::string& name : moving_.bodies()) {
        for (const char* what : {"at_x_m", "at_y_m", "at_z_m", "force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm"}) record_ += fmt::format(",{}.{}", name, what);
      }
    }
    record_ += "\n";
  }
  record_ += fmt::format("{},{},{},{},{},{}", time_, static_residual(), response_.energy.membrane, response_.energy.bending, potential_, contact_sums_.energy);
  for (std::size_t c = 0; c < held_.size(); ++c) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int v : held_[c].selected.vertices) centre += x_.row(sheet_.node_of_vertex[v]).transpose();
    const Eigen::Vector3d move = centre / static_cast<double>(held_[c].selected.vertices.size()) - held_[c].centre;
    const Reaction r = reaction(c);
    for (const Eigen::Vector3d& v : {move, r.force, r.moment}) record_ += fmt::format(",{},{},{}", v.x(), v.y(), v.z());
  }
  for (const auto& [name, selected] : watched_) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < selected.vertices.size(); ++k) mean += selected.share[k] * x_.row(sheet_.node_of_vertex[selected.vertices[k]]).transpose();
    record_ += fmt::format(",{},{},{}", mean.x(), mean.y(), mean.z());
  }
  if (params_.stability) record_ += fmt::format(",{}", report_.lowest_stiffness.value_or(0));
  for (std::size_t b = 0; b < wrenches_.size(); ++b) {
    for (const Eigen::Vector3d& v : {moving_.now().poses[b].shift, wrenches_[b].force, wrenches_[b].torque}) record_ += fmt::format(",{},{},{}", v.x(), v.y(), v.z());
  }
  record_ += "\n";
}

/// All that a run remembers, both ways.
void Run::store(Archive& a, Progress& p) {
  std::uint64_t version = 1, nodes = static_cast<std::uint64_t>(sheet_.node_count), links = sheet_.links.size();
  const std::uint64_t expected = version;
  a(version);
  a(nodes);
  a(links);
  TOILE_CHECK(version == expected && nodes == static_cast<std::uint64_t>(sheet_.node_count) && links == sheet_.links.size(), "a checkpoint of version {} for {} nodes and {} links", version, nodes, links);
  a(p.step), a(p.time), a(p.next_step), a(p.last_step), a(p.passed), a(p.before), a(p.velocity_before), a(p.touched), a(p.touching);
  a(p.iteration), a(p.stalled), a(p.residual), a(p.best);
  a(x_), a(velocity_), a(start_), a(increment_start_), a(inertia_), a(hold_start_), a(support_x_);
  a(step_), a(momentum_), a(tolerance_), a(slack_), a(last_total_), a(last_left_), a(last_move_), a(last_fraction_), a(last_alpha_), a(promised_), a(next_frame_), a(stuck_node_);
  for (Held& held : held_) a(held.centre);
  std::uint64_t pairs = friction_.size();
  a(pairs);
  if (a.reading()) friction_.assign(a.good() && pairs < (1u << 30) ? pairs : 0, FrictionPair{});
  for (FrictionPair& f : friction_) {
    a(f.kind), a(f.a), a(f.b), a(f.node), a(f.weight), a(f.normal), a(f.slip), a(f.limit), a(f.stiffness), a(f.support_node), a(f.support_way), a(f.support_motion), a(f.fresh);
  }
  a(self_exempt_), a(support_exempt_);
  std::uint64_t wrenches = wrenches_.size();
  a(wrenches);
  if (a.reading()) wrenches_.assign(a.good() && wrenches < (1u << 20) ? wrenches : 0, BodyWrench{});
  for (BodyWrench& w : wrenches_) a(w.force), a(w.torque);
  SimulationReport& r = report_;
  a(r.converged), a(r.iterations), a(r.solver_iterations), a(r.simulated_time), a(r.seam_gap_max), a(r.seams_open), a(r.rejected_steps), a(r.unconverged_steps);
  a(r.start_inside), a(r.start_intersections), a(r.start_left), a(r.start_move);
  std::uint64_t untangled = r.untangled.size();
  a(untangled);
  if (a.reading()) r.untangled.assign(a.good() && untangled < (1u << 20) ? untangled : 0, Untangling{});
  for (Untangling& u : r.untangled) a(u.panel), a(u.moved), a(u.largest_move);
  std::uint64_t findings = findings_.size();
  a(findings);
  if (a.reading()) findings_.assign(a.good() && findings < (1u << 20) ? findings : 0, Issue{});
  for (Issue& i : findings_) a(i.code), a(i.place.item), a(i.what), a(i.remedy), a(i.category);
  a(log_), a(record_);
}

void Run::leave_checkpoint(Progress& progress) {
  if (!hooks_.checkpoint) return;
  if (!sheet_.links.empty()) {
    if (std::none_of(findings_.begin(), findings_.end(), [](const Issue& issue) { return issue.code == "no_checkpoint"; })) {
      findings_.push_back(Issue{"no_checkpoint", {.item = "checkpoint"}, "there is none of a garment whose seams are not closed or that springs join", "close its seams first, or leave out checkpoint", Category::check});
    }
    return;
  }
  Checkpoint checkpoint{garment_, {}};
  mechanics::store_friction(sheet_, checkpoint.garment);
  Archive archive;
  store(archive, progress);
  checkpoint.state = archive.bytes();
  hooks_.checkpoint(checkpoint);
}

void Run::show_frame(double time) {
  if (!hooks_.frame || time < next_frame_ - 1e-9) return;
  hooks_.frame(time, scatter(x_, sheet_.node_of_vertex), support_x_);
  while (next_frame_ <= time + 1e-9) next_frame_ += params_.frame_interval;
}

double widest_link(const Sheet& sheet, const Points3& x) {
  double widest = 0;
  for (const mechanics::Link& link : sheet.links) widest = std::max(widest, (x.row(link.a) - x.row(link.b)).norm());
  return widest;
}

/// Brings offsets so near to the gaps that there are that no link pulls harder than `pull` [N].
void limit_pull(Points3& offset, const std::vector<mechanics::Link>& links, const Points3& x, double pull) {
  for (std::size_t i = 0; i < links.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::RowVector3d gap = x.row(links[i].a) - x.row(links[i].b), lead = offset.row(row) - gap;
    const double most = pull / links[i].stiffness, length = lead.norm();
    if (length > most) offset.row(row) = gap + most / length * lead;
  }
}

/// Greatest pull on a particle of an open seam [N].
double Run::seam_pull() const {
  if (params_.seam_pull) return *params_.seam_pull;
  if (garment_.free_layers.empty()) return std::numeric_limits<double>::infinity();
  return 0.5 * laws_.self.reach * laws_.self.stiffness * sheet_.area.sum() / sheet_.cloth_nodes;
}

/// Open seams pull no harder than they may from here. True when one that is open has to be held back.
bool Run::limit_links() {
  if (sheet_.links.empty() || !std::isfinite(link_pull_)) return false;
  limit_pull(link_offset_, sheet_.links, x_, link_pull_);
  return true;
}

/// Makes the two sides of every seam one when all are near enough and the way there is free.
bool Run::try_merge() {
  if (widest_link(sheet_, x_) > params_.seam_gap) return false;
  const Ids particle = mesh::particles(garment_);
  const Points3 vertices = scatter(x_, sheet_.node_of_vertex);
  const Points3 merged = gather_mean(vertices, particle, particle.maxCoeff() + 1);
  Points3 target = x_;
  for (Eigen::Index v = 0; v < particle.size(); ++v) target.row(sheet_.node_of_vertex[v]) = merged.row(particle[v]);
  contact::LimitOptions options;
  options.self_exempt = self_exempt_;
  options.support_exempt = support_exempt_;
  if (search_->limit_step(x_, target, support_x_, support_x_, options).limited_nodes > 0) return false;
  x_ = merged;
  const Issues issues = build(particle);
  TOILE_CHECK(issues.empty(), "a garment that was fine with open seams is not with closed ones: {}", to_string(issues.front()));
  return true;
}

/// A step is over: fasteners are drawn further together, or held with what it takes. True when their pull is another now.
bool Run::advance_fasteners() {
  if (fastening_.empty() || !fastening_.advance(scatter(x_, sheet_.node_of_vertex))) return false;
  apply_fasteners();
  return true;
}

void Run::apply_fasteners() {
  if (fastening_.empty()) return;
  fastening_.apply(sheet_);
  if (particle_) fastening_.apply(*particle_);
}

void Run::close_seams() {
  if (sheet_.links.empty()) return;
  gravity_part_ = params_.closing_gravity;
  set_time(0);
  step_ = params_.time_step;
  inertia_rate_.setConstant(1 / (step_ * step_));
  inertia_ = start_ = x_;
  link_pull_ = seam_pull();
  const auto scale_links = [&](double factor) {
    mechanics::scale_links(sheet_, factor);
    response_.constant_blocks_stand = false;
    if (particle_) mechanics::scale_links(*particle_, factor);
  };
  // A limited pull leads as far as a step is to move the sides; the softer, the farther.
  double stiffness = params_.seam_stiffness;
  if (link_pull_ < closing_move * stiffness) {
    scale_links(link_pull_ / (closing_move * stiffness));
    stiffness = link_pull_ / closing_move;
  }
  const int limit = params_.closing_steps * (std::isfinite(link_pull_) ? 15 : 5);
  for (int i = 1; i <= limit && !interrupted(); ++i) {
    const double part = std::max(0.0, 1 - static_cast<double>(i) / params_.closing_steps);
    link_offset_ = part * link_start_;
    // Sides that do not meet by now are pulled harder and harder.
    if (i > params_.closing_steps + 5 && stiffness * params_.seam_gap < 2 * link_pull_) {
      scale_links(1.25);
      stiffness *= 1.25;
    } else if (i > params_.closing_steps + 5 && last_move_ < quiet_move && link_pull_ < 50 * seam_pull()) {
      link_pull_ *= 1.25;  // at rest and still open: it takes more
    }
    limit_links();
    evaluate(x_, true);
    iterate();
    log_row("closing");
    accept();
    advance_fasteners();
    const double widest = widest_link(sheet_, x_);
    report_.seam_gap_max = widest;
    if (hooks_.progress) hooks_.progress(0.2 * i / limit, fmt::format("closing seams, gap {:.1f} mm", 1e3 * widest));
    if (i >= params_.closing_steps && try_merge()) {
      report_.seam_gap_max = 0;
      return;
    }
  }
  // Close what can be closed, name the rest.
  report_.seams_open = 0;
  std::set<std::string> names;
  for (const mesh::Weld& weld : garment_.welds) {
    const int a = sheet_.node_of_vertex[weld.a], b = sheet_.node_of_vertex[weld.b];
    if (a != b && (x_.row(a) - x_.row(b)).norm() > params_.seam_gap) {
      ++report_.seams_open;
      names.insert(garment_.seams[static_cast<std::size_t>(weld.seam)].name);
    }
  }
  for (const std::string& name : names) {
    findings_.push_back(Issue{"seam_open", {.item = "seam " + name}, fmt::format("did not close; the widest gap is {:.1f} mm", 1e3 * report_.seam_gap_max),
                              "place the panels nearer together, or raise closing_steps or seam_stiffness", Category::check});
  }
}

/// To equilibrium under the loads and paths of the present time. True when it was reached.
bool Run::relax(Progress& progress) {
  step_ = params_.time_step;
  momentum_ = momentum;
  tolerance_ = solver_tolerance;
  slack_ = energy_slack;
  last_total_ = 1e300;
  inertia_ = start_ = x_;
  link_offset_.setZero();
  limit_links();
  evaluate(x_, true);
  // The equilibria of a laboratory follow one another closely, and yarns that slip have corners in their energy: both want care, not speed.
  const bool comes_down = params_.increments == 1 && !sheet_.friction;
  const double quiet = comes_down ? quiet_turn * std::sqrt(sheet_.area.sum() / sheet_.cloth_nodes) : quiet_move;
  double &before = progress.residual, &best = progress.best;
  int &stalled = progress.stalled, &i = progress.iteration;
  before = best = static_residual();
  i = stalled = 0;
  if (!resume_.empty()) {
    const std::string state = std::exchange(resume_, {});
    Archive archive(state);
    store(archive, progress);
    evaluate(x_, true);
  } else if (report_.iterations > 0 && before <= params_.residual && held_error() <= at_target && fastening_.settled()) {
    return true;  // at rest already, after an increment without any change
  }
  for (int taken = 0; i < params_.max_iterations; ++i, ++taken) {
    if (interrupted() || (taken > 0 && taken % params_.checkpoint_interval == 0)) {
      leave_checkpoint(progress);
      if (interrupted()) break;
    }
    inertia_rate_.setConstant(1 / (step_ * step_));
    iterate();
    accept();
    // Friction's slip has been carried on; the force it gives is part of the balance from here on.
    add_forces(x_, true);
    double residual = static_residual();
    if (by_increment_ && residual <= params_.residual && held_error() <= at_target && !friction_.empty()) {
      // In balance with the normal forces of the last balance; now with its own.
      friction_ = follow_friction(friction_, increment_start_, contacts_, x_, support_x_, sheet_.area, laws_, true);
      add_forces(x_, true);
      residual = static_residual();
      best = std::max(best, residual);
      stalled = 0;
    }
    log_row("relaxing");
    if (hooks_.progress && params_.increments == 1) {
      hooks_.progress(std::clamp(0.2 + 0.8 * std::log(residual / 10) / std::log(params_.residual / 10), 0.2, 1.0), fmt::format("iteration {}, residual {:.2e}", report_.iterations, residual));
    }
    const bool arrived = held_error() <= at_target;
    if (residual <= params_.residual && arrived && fastening_.settled()) return true;
    link_offset_.setZero();
    const bool held_back = limit_links();
    if (advance_fasteners() || held_back) evaluate(x_, true);
    // How well one iteration solved its step: what is left of the step's own net force.
    const double left = last_left_ / before;
    before = residual;
    if (residual < 0.95 * best || !arrived) {
      best = residual;
      stalled = 0;
    } else {
      ++stalled;
    }
    if (last_alpha_ < 0.5 || residual > (comes_down ? rise_coming_down : careful_rise) * best) {
      step_ = std::max(0.7 * step_, params_.time_step / 8);
    } else if (stalled >= stall_limit) {
      // Nothing gained for long: what is left is a jitter that inexact solves feed and momentum keeps up. Begin again with a
      // short step, less momentum, sharper solves and less tolerance of rising energy.
      step_ = std::max(0.2 * step_, params_.time_step / 4);
      momentum_ = 0.8 * momentum_;
      tolerance_ = std::max(0.2 * tolerance_, 1e-5);
      slack_ = std::max(0.1 * slack_, 1e-7);
      best = residual;
      stalled = 0;
    } else if (left < solved_well || last_move_ < quiet) {
      step_ = std::min(1.4 * step_, step_max);
    }
  }
  return false;
}

/// The smallest stiffness at x_, with its evaluation at hand before and after. Second derivatives are differences of gradients, so that all
/// forces count as they are; the projected matrix of the iterations is the preconditioner.
void Run::find_stability() {
  constexpr double way = 1e-6;    // of the differences [m]
  constexpr double shift = 1;     // what nothing holds has no stiffness [1/s2]
  constexpr double held_stiffness = 1e8;
  const auto free_part = [&](Points3& v) {
    for (Eigen::Index i = 0; i < v.rows(); ++i) {
      const int holder = holder_[static_cast<std::size_t>(i)];
      if (holder >= 0) v.row(i) = fixed_[static_cast<std::size_t>(i)] ? Eigen::RowVector3d(0, 0, 0) : Eigen::RowVector3d(v.row(i) - v.row(i) * held_[static_cast<std::size_t>(holder)].directions);
    }
  };
  StiffnessProblem problem;
  problem.mass = sheet_.mass;
  for (Eigen::Index i = 0; i < problem.mass.size(); ++i) {
    if (!(problem.mass[i] > 0)) problem.mass[i] = 1e-12;  // of a director
  }
  increment_start_ = x_;
  start_ = x_;
  evaluate(x_, true);
  const std::vector<ContactTerm> terms = terms_;
  BlockMatrix matrix = response_.matrix;
  for (std::size_t i = 0; i < holder_.size(); ++i) {
    Block& d = matrix.value[static_cast<std::size_t>(matrix.diagonal[i])];
    for (int c = 0; c < 3; ++c) d.column[c][c] += static_cast<float>(shift * problem.mass[static_cast<Eigen::Index>(i)] + (fixed_[i] ? held_stiffness : 0));
    if (holder_[i] >= 0 && !fixed_[i]) d = Block::from(d.matrix() + held_stiffness * held_[static_cast<std::size_t>(holder_[i])].directions);
  }
  LinearSolver solver;
  solver.factor(matrix, terms, x_, fixed_);
  problem.precondition = [&](const Points3& given, Points3& out) {
    Points3 r = given;
    free_part(r);
    const double scale = std::max(r.cwiseAbs().maxCoeff(), 1e-300);
    std::vector<Float4> b(static_cast<std::size_t>(r.rows())), y;
    for (Eigen::Index i = 0; i < r.rows(); ++i) {
      const Eigen::Vector3d row = r.row(i).transpose() / scale;
      b[static_cast<std::size_t>(i)] = mechanics::load3(row.data());
    }
    solver.solve(matrix, terms, b, y, {.tolerance = 1e-3, .max_iterations = 3000});
    out.resize(r.rows(), 3);
    for (Eigen::Index i = 0; i < r.rows(); ++i) out.row(i) = scale * vector(y[static_cast<std::size_t>(i)]).transpose();
    free_part(out);
  };
  const Points3 at = x_;
  problem.stiffness = [&](const Points3& v, Points3& out) {
    const double part = way / std::max(v.rowwise().norm().maxCoeff(), 1e-300);
    evaluate(at + part * v, false);
    out = gradient_;
    evaluate(at - part * v, false);
    out = (out - gradient_) / (2 * part);
    free_part(out);
  };
  const LowestStiffness lowest = lowest_stiffness(problem);
  report_.lowest_stiffness = lowest.value;
  if (!lowest.converged) {
    findings_.push_back(Issue{"stability_not_converged", {.item = fmt::format("time {} s", time_)}, fmt::format("the smallest stiffness is not found to its tolerance after {} iterations; {:.6g} /s2 is above it", lowest.iterations, lowest.value),
                              "coarser cells, or leave stability out", Category::not_converged});
  }
  evaluate(x_, true);
}

/// Equilibria at equal parts of the duration, one after the other.
Issues Run::equilibria() {
  gravity_part_ = 1;
  report_.converged = true;
  by_increment_ = params_.increments > 1;
  Progress progress;
  if (!resume_.empty()) {
    Archive archive(resume_);
    store(archive, progress);
    if (!archive.good() || !archive.at_end()) return {damaged_checkpoint()};
    report_.converged = true;
  }
  for (int k = progress.step + 1; k <= params_.increments && !interrupted(); ++k) {
    progress.step = k - 1;
    set_time(params_.duration * k / params_.increments);
    if (resume_.empty()) {  // else in the middle of the increment
      increment_start_ = x_;
      if (by_increment_ && !friction_.empty()) friction_ = follow_friction(friction_, x_, contacts_, x_, support_x_, sheet_.area, laws_, true);
    }
    if (!relax(progress)) report_.converged = false;
    if (by_increment_) friction_ = update_friction(friction_, increment_start_, contacts_, x_, support_x_, sheet_.area, laws_);
    if (params_.stability) find_stability();
    record_row();
    // Within an increment friction between yarns is a potential: where it leads does not depend on the iterations.
    mechanics::advance_friction(sheet_, x_);
    if (hooks_.progress && params_.increments > 1) {
      hooks_.progress(static_cast<double>(k) / params_.increments, fmt::format("increment {} of {}, residual {:.2e}", k, params_.increments, static_residual()));
    }
    if (!report_.converged) break;
  }
  if (interrupted()) report_.converged = false;
  report_.residual = static_residual();
  return {};
}

/// Velocities of a garment that moves already.
void Run::read_velocities() {
  const auto column = [&](const char* name) { return garment_.vertex_columns.find(name); };
  if (column("vx") != garment_.vertex_columns.end() && column("vy") != garment_.vertex_columns.end() && column("vz") != garment_.vertex_columns.end()) {
    Points3 v(garment_.vertex_count(), 3);
    int c = 0;
    for (const char* name : {"vx", "vy", "vz"}) {
      const mesh::Column& values = column(name)->second;
      for (Eigen::Index i = 0; i < v.rows(); ++i) v(i, c) = values.integer ? values.integers[static_cast<std::size_t>(i)] : values.reals[static_cast<std::size_t>(i)];
      ++c;
    }
    velocity_.topRows(sheet_.cloth_nodes) = gather_mean(v, sheet_.node_of_vertex, sheet_.cloth_nodes);
  }
}

/// Resistance in the step that begins, with the coefficients of where the last steps lead to, so that they do not take an order away.
void Run::find_resistance(const Points3& before, const Points3& velocity_before, bool first) {
  const Eigen::Vector3d wind = factor_at(params_.wind_times, params_.wind_factor, time_) * Eigen::Vector3d(params_.wind.data());
  AirProperties air{wind, params_.air_density, params_.wind_drag.value_or(Eigen::Vector3d(params_.wind.data()).isZero() ? 0 : 1.2), 0};
  air.lift = params_.wind_lift.value_or(air.drag);
  AirForces forces{Eigen::VectorXd::Zero(x_.rows()), Points3::Zero(x_.rows(), 3)};
  if (air.drag > 0 || air.lift > 0) {
    const Points3 v = first ? velocity_ : Points3(2 * velocity_ - velocity_before), x = first ? Points3(x_ + step_ * velocity_) : Points3(2 * x_ - before);
    forces = air_forces(sheet_.corners, x, v, air);
  }
  push_ = forces.lift;
  forces.drag += params_.air_drag * sheet_.area;
  resistance_ = forces.drag + params_.damping_mass * sheet_.mass;
  resistance_origin_ = velocity_origin_;
  for (Eigen::Index i = 0; i < sheet_.cloth_nodes; ++i) {
    if (resistance_[i] > 0) resistance_origin_.row(i) += (forces.drag[i] / (resistance_[i] * velocity_rate_[i]) * wind).transpose();
  }
  if (params_.damping_stiffness > 0) {
    // Without what an evaluation of a damped step adds.
    damped_ = false;
    evaluate(x_, true);
    damping_ = response_.matrix;
  }
}

/// Euler: x = x0 + h v, v = v0 + h a. Second order: x = (4 x0 - x1)/3 + 2h/3 v, v = (4 v0 - v1)/3 + 2h/3 a, which remembers the step before.
/// A node that touches something, or did in the last step, goes by Euler: its path has a corner.
/// Where a support moves, a step that it does not get through is begun again with half of the time.
/// error  those of the source of the motion
Issues Run::move_in_time() {
  gravity_part_ = 1;
  link_offset_.setZero();
  step_ = params_.time_step;
  read_velocities();
  const int steps = std::max(1, static_cast<int>(std::lround(params_.duration / params_.time_step)));
  // What touches at the start sticks from the start.
  start_ = x_;
  evaluate(x_, true);
  friction_ = update_friction(friction_, start_, contacts_, x_, support_x_, sheet_.area, laws_);
  const auto nodes = static_cast<std::size_t>(sheet_.node_count);
  Progress progress;
  progress.before = x_;
  progress.velocity_before = velocity_;
  progress.next_step = params_.time_step;
  progress.touched.assign(nodes, 0);
  progress.touching.assign(nodes, 0);
  Points3 &before = progress.before, &velocity_before = progress.velocity_before;
  std::vector<char> &touched = progress.touched, &touching = progress.touching;
  const auto mark = [&] {
    touched.swap(touching);
    touching.assign(nodes, 0);
    const auto of = [&](std::span<const contact::Contact> contacts) {
      for (const contact::Contact& c : contacts) {
        if (c.distance >= laws_.of(c.kind).reach) continue;
        const auto [first, last] = cloth_nodes(c.kind);
        for (int k = first; k < last; ++k) touching[static_cast<std::size_t>(c.node[static_cast<std::size_t>(k)])] = 1;
      }
    };
    of(contacts_.self);
    of(contacts_.support);
  };
  velocity_rate_.resize(sheet_.node_count);
  inertia_.resize(sheet_.node_count, 3);
  velocity_origin_.resize(sheet_.node_count, 3);
  double &time = progress.time, &next_step = progress.next_step, &last_step = progress.last_step;
  int& passed = progress.passed;  // steps in a row that did not have to be shortened
  int& i = progress.step;
  if (!resume_.empty()) {
    Archive archive(resume_);
    store(archive, progress);
    if (!archive.good() || !archive.at_end()) return {damaged_checkpoint()};
    if (moving_.moves()) {
      if (Issues issues = moving_.advance(0, time); !issues.empty()) return issues;
      if (const auto verdict = moving_.finish(true, wrenches_); !verdict) return verdict.issues();
    }
    start_ = x_;
    evaluate(x_, true);
  } else {
    show_frame(0);
  }
  for (int taken = 0; i < steps; ++taken) {
    if (interrupted() || (taken > 0 && taken % params_.checkpoint_interval == 0)) {
      leave_checkpoint(progress);
      if (interrupted()) break;
    }
    // Up to the next multiple of the time step.
    const double until = (i + 1) * params_.time_step, rest = until - time;
    const bool to_end = next_step > 0.99 * rest;
    double h = to_end && rest < params_.time_step * (1 - 1e-9) ? rest : std::min(next_step, params_.time_step);
    double end = to_end ? until : time + h;
    if (moving_.moves()) {
      if (Issues issues = moving_.advance(time, h); !issues.empty()) return issues;
      if (moving_.next().time < end - 1e-12) {  // the source goes no farther
        end = moving_.next().time;
        h = end - time;
      }
    }
    const bool ends_here = end >= until - 1e-12;
    const bool first = std::abs(h - last_step) > 1e-9 * h;
    const std::vector<FrictionPair> remembered = friction_;
    step_ = h;
    set_time(end);
    start_ = x_;
    if (moving_.moves()) {
      moving_.carry(friction_, start_);
      support_at(moving_.start(), moving_.start() == moving_.end() ? 1 : 0);
    }
    for (std::size_t k = 0; k < nodes; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      if (params_.integrator != Integrator::implicit && !first && !touched[k] && !touching[k]) {
        velocity_rate_[row] = 1.5 / h;
        velocity_origin_.row(row) = (4 * x_.row(row) - before.row(row)) / 3;
        inertia_.row(row) = velocity_origin_.row(row) + 2 * h / 9 * (4 * velocity_.row(row) - velocity_before.row(row));
      } else {
        velocity_rate_[row] = 1 / h;
        velocity_origin_.row(row) = x_.row(row);
        inertia_.row(row) = x_.row(row) + h * velocity_.row(row);
      }
    }
    inertia_rate_ = velocity_rate_.cwiseAbs2();
    find_resistance(before, velocity_before, first);
    damped_ = true;
    // The sheet has been evaluated here at the end of the last step, but friction between yarns has gone on since, and damping is to be added.
    if (params_.internal_friction == YarnFriction::yes || params_.damping_stiffness > 0) {
      evaluate(x_, true);
    } else {
      add_forces(x_, true);
    }
    const auto arrived = [&] { return !moving_.moves() || (support_x_ == moving_.end() && held_error() <= at_target); };
    bool done = false;
    for (int k = 0; k < params_.newton_iterations && !done; ++k) {
      step_iteration_ = k;
      const bool moved = iterate();
      done = promised_ <= params_.newton_accuracy * force_scale() && held_error() <= at_target && arrived();
      if (!moved) break;
    }
    const bool fine = arrived();
    bool holds = fine;
    if (moving_.moves()) {
      in_step_ = true;
      std::vector<BodyWrench> found = fine ? wrenches() : std::vector<BodyWrench>{};
      in_step_ = false;
      const Result<SupportMotion::Verdict> verdict = moving_.finish(fine, found);
      if (!verdict) return verdict.issues();
      holds = fine && *verdict == SupportMotion::Verdict::holds;
      if (holds) wrenches_ = std::move(found);
    }
    if (!holds) {
      x_ = start_;
      support_x_ = moving_.start();
      friction_ = remembered;
      ++report_.rejected_steps;
      damped_ = false;
      evaluate(x_, true);
      if (fine) continue;  // once more, as it was
      passed = 0;
      next_step = 0.5 * h;
      if (next_step < std::ldexp(params_.time_step, -halvings_max)) {
        report_squeezed(time);
        break;
      }
      continue;
    }
    if (!done) ++report_.unconverged_steps;
    velocity_before = velocity_;
    before = start_;
    velocity_ = velocity_rate_.asDiagonal() * (x_ - velocity_origin_);
    mark();
    in_step_ = true;
    log_row("moving");
    record_row();
    in_step_ = false;
    mechanics::advance_friction(sheet_, x_);  // the sheet's second derivative changes with it, and the energy's zero
    friction_ = update_friction(friction_, start_, contacts_, x_, support_x_, sheet_.area, laws_);
    if (advance_fasteners()) evaluate(x_, true);
    report_.simulated_time = time = ends_here ? until : end;
    last_step = h;
    if (++passed >= 2) next_step = std::min(params_.time_step, 2 * next_step);
    if (ends_here) ++i;
    show_frame(time);
    if (hooks_.progress) hooks_.progress(time / (steps * params_.time_step), fmt::format("t = {:.3f} s", report_.simulated_time));
  }
  start_ = x_;
  damped_ = false;
  evaluate(x_, true);
  report_.residual = static_residual();
  report_.converged = findings_.empty() || std::none_of(findings_.begin(), findings_.end(), [](const Issue& issue) { return issue.code == "squeezed"; });
  return {};
}

/// The cloth has no way out of a support's way: where.
void Run::report_squeezed(double time) {
  std::string panel = "cloth", place;
  if (stuck_node_ >= 0 && stuck_node_ < sheet_.cloth_nodes) {
    for (Eigen::Index v = 0; v < sheet_.node_of_vertex.size(); ++v) {
      if (sheet_.node_of_vertex[v] != stuck_node_) continue;
      panel = "panel " + garment_.panels[static_cast<std::size_t>(garment_.vertex_panel[v])].name;
      break;
    }
    place = fmt::format(" at ({:.3f}, {:.3f}, {:.3f}) m", x_(stuck_node_, 0), x_(stuck_node_, 1), x_(stuck_node_, 2));
  }
  findings_.push_back(Issue{"squeezed", {.item = panel}, fmt::format("has no way out of the moving support{}; the run ended at {:.6g} s", place, time),
                            "leave room for the cloth's thickness between what moves, hold the cloth otherwise, or shorten time_step", Category::check});
}


/// Pairs near enough to touch before the list is made again, as unilateral constraints with their present normals.
void Run::list_contacts(const Points3& x, ConstraintSet& set) {
  find_contacts(x, {laws_.self.reach + contact_skin * laws_.self.reach, laws_.support.reach + contact_skin * laws_.support.reach});
  set.contacts.clear();
  support_contacts_.clear();
  contact_sums_ = {0, 0, std::max(laws_.self.reach, laws_.support.reach)};
  const auto add = [&](const contact::Contact& c) {
    const auto [first, last] = cloth_nodes(c.kind);
    const ContactLaw& law = laws_.of(c.kind);
    Eigen::Vector3d gap = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const auto i = static_cast<std::size_t>(k);
      gap += c.weight[i] * (k >= first && k < last ? x : support_x_).row(c.node[i]).transpose();
    }
    const double distance = gap.norm();
    if (distance < 1e-9) return;
    Unilateral u;
    u.normal = gap / distance;
    u.offset = law.reach;
    u.friction = law.friction;
    bool moves = false;
    for (int k = 0; k < 4; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (k >= first && k < last) {
        u.node[i] = c.node[i];
        u.weight[i] = c.weight[i];
        moves |= c.weight[i] != 0 && !fixed_[static_cast<std::size_t>(c.node[i])];
      } else {
        u.offset -= c.weight[i] * u.normal.dot(support_x_.row(c.node[i]));
      }
    }
    contact_sums_.least_gap = std::min(contact_sums_.least_gap, distance);
    if (!moves) return;
    if (moving_.moves() && c.kind > contact::Kind::edge_edge) support_contacts_.push_back({set.contacts.size(), c});
    set.contacts.push_back(u);
  };
  for (const contact::Contact& c : contacts_.self) add(c);
  for (const contact::Contact& c : contacts_.support) add(c);
}

/// Contacts with a support that moves, in the step that begins: where it is and how fast.
void Run::move_contacts(ConstraintSet& set, double step) const {
  for (const SupportContact& s : support_contacts_) {
    const auto [first, last] = cloth_nodes(s.contact.kind);
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      if (k >= first && k < last) continue;
      const auto i = static_cast<std::size_t>(k);
      const int node = s.contact.node[i];
      place += s.contact.weight[i] * moving_.start().row(node).transpose();
      velocity += s.contact.weight[i] / step * (moving_.end().row(node) - moving_.start().row(node)).transpose();
    }
    Unilateral& u = set.contacts[s.index];
    u.offset = laws_.of(s.contact.kind).reach - u.normal.dot(place);
    u.offset_rate = -u.normal.dot(velocity);
    u.surface_velocity = velocity;
  }
}

/// The published way: Euler in two steps, constraints and contacts by Lagrange multipliers, collisions looked at between the steps.
/// error  "no_mass", "step_too_long"
Issues Run::integrate_explicitly() {
  gravity_part_ = 1;
  link_offset_.setZero();
  const bool rest = params_.mode == Mode::equilibrium;
  fastening_.hold();
  apply_fasteners();
  if (!rest) read_velocities();
  if (!(sheet_.mass.minCoeff() > 0)) {
    return {Issue{"no_mass", {}, "a particle has no mass; explicit integration needs one", "give the cloth its fabric (toile-layer), or use the implicit integrator"}};
  }
  // Tables run with the simulated time; rest is looked for after their last rows.
  double tables_end = params_.gravity_times.empty() ? 0 : params_.gravity_times.back();
  bool ramped = !params_.gravity_times.empty();
  for (const Load& load : loads_) {
    if (load.spec.times.empty()) continue;
    ramped = true;
    tables_end = std::max(tables_end, load.spec.times.back());
  }
  for (const Held& held : held_) {
    if (!held.spec.times.empty()) tables_end = std::max(tables_end, held.spec.times.back());
  }
  set_time(0);
  const auto stable_limit = [&](const Points3& x) {
    evaluate(x, true);
    return 2 / mechanics::frequency_bound(response_.matrix, sheet_.mass);
  };
  const double first_limit = stable_limit(x_);
  if (params_.explicit_step && *params_.explicit_step > first_limit) {
    return {Issue{"step_too_long", {.item = "explicit_step"}, fmt::format("{:.3g} s is beyond the stability limit of explicit integration: steps up to {:.3g} s are certainly stable at the start", *params_.explicit_step, first_limit),
                  "give a smaller explicit_step, or none"}};
  }
  phase("sheet");
  ProvotSystem system;
  system.mass = sheet_.mass;
  if (!rest) system.drag = params_.air_drag * sheet_.area;
  system.gradient = [&](const Points3& x, Points3& out) {
    if (particle_) {
      mechanics::gradient(*particle_, x, link_offset_, particle_response_);
      out = particle_response_.gradient;
    } else {
      mechanics::evaluate(sheet_, x, link_offset_, std::nullopt, response_);
      out = response_.gradient;
    }
    out -= sheet_.mass * gravity_.transpose() + load_;
  };
  ProvotOptions options;
  options.time_step = params_.explicit_step.value_or(safe_step * first_limit);
  options.damping = params_.explicit_damping.value_or(rest ? 10.0 : 0.0);
  options.constraints.time_constant = 4 * options.time_step;
  options.constraints.contact_time_constant = std::max(1e-3, 4 * options.time_step);
  options.constraints.tolerance = 1e-6;
  options.constraints.contact_sweeps = 40;
  std::vector<int> held_nodes;  // in the order of the constraints: those at rest, then those on a path
  for (const bool moving : {false, true}) {
    for (const Held& held : held_) {
      if ((held.spec.times.empty() && held.body < 0) == moving) continue;
      for (int node : held.nodes) {
        held_nodes.push_back(node);
        const Eigen::Vector3d start = hold_start_.row(node).transpose();
        if (!moving) {
          system.constraints.positions.push_back({node, start});
          continue;
        }
        const double h = options.time_step;
        if (held.body >= 0) {
          system.constraints.trajectories.push_back({node, [this, &held, start](double) {
            const Eigen::Vector3d now = moving_.since_beginning(held.body, moving_.now())(start);
            const double span = moving_.next().time - moving_.now().time;
            return PathState{now, span > 0 ? Eigen::Vector3d((moving_.since_beginning(held.body, moving_.next())(start) - now) / span) : Eigen::Vector3d::Zero()};
          }});
          continue;
        }
        system.constraints.trajectories.push_back({node, [&held, start, h](double time) {
          const Eigen::Vector3d now = motion_at(held.spec, held.centre, time)(start);
          return PathState{now, (motion_at(held.spec, held.centre, time + h)(start) - now) / h};
        }});
      }
    }
  }
  for (std::size_t k = 0; k < distance_vertices_.size(); ++k) {
    const int a = sheet_.node_of_vertex[distance_vertices_[k][0]], b = sheet_.node_of_vertex[distance_vertices_[k][1]];
    const double distance = params_.distances[k].distance.value_or((x_.row(a) - x_.row(b)).norm());
    if (a == b || !(distance > 0)) {
      return {Issue{"bad_constraint", {.item = "distance to " + params_.distances[k].between[0]}, "its two points are one", "name two points that are apart"}};
    }
    system.constraints.distances.push_back({a, b, distance});
  }
  Provot provot(std::move(system), {x_, velocity_, 0}, options);

  // Nothing that is not in the list can touch before a node has moved half the skin. Then the straight ways since the last look
  // are searched for impacts, and the list is made again.
  Points3 checked = x_, checked_support = support_x_;
  double checked_time = 0;
  bool squeezed = false, relist = false;
  const double allowed = 0.5 * contact_skin * std::min(laws_.self.reach, support_ ? laws_.support.reach : laws_.self.reach);
  list_contacts(x_, provot.system().constraints);
  contact::LimitOptions limit_options;
  limit_options.self_exempt = self_exempt_;
  limit_options.support_exempt = support_exempt_;
  provot.system().collisions = [&](const Points3&, Points3& end, Points3& velocity) {
    const double moved_sq = parallel_reduce(static_cast<std::size_t>(end.rows()), std::size_t{4096}, 0.0, [&](std::size_t begin, std::size_t last) {
      double most = 0;
      for (std::size_t i = begin; i < last; ++i) most = std::max(most, (end.row(static_cast<Eigen::Index>(i)) - checked.row(static_cast<Eigen::Index>(i))).squaredNorm());
      return most;
    }, [](double a, double b) { return std::max(a, b); });
    double most = std::sqrt(moved_sq);
    if (moving_.moves() && support_) most = std::max(most, std::sqrt((moving_.end() - checked_support).rowwise().squaredNorm().maxCoeff()));
    if (!(most > allowed)) return;
    phase("limit");
    const Points3& support_end = moving_.moves() && support_ ? moving_.end() : support_x_;
    const double elapsed = std::max(provot.state().time + provot.time_step() - checked_time, provot.time_step());
    for (int round = 0;; ++round) {
      const contact::StepLimit& limit = search_->limit_step(checked, end, checked_support, support_end, limit_options);
      last_fraction_ = limit.least_fraction;
      if (limit.limited_nodes == 0) break;
      const bool in_the_way = limit.support_fraction < 1;
      if (in_the_way && round == shared_limits) {
        stuck_node_ = static_cast<int>(std::min_element(limit.fraction.begin(), limit.fraction.end()) - limit.fraction.begin());
        squeezed = true;
        return;
      }
      // What is in the way of a support goes with it, and so much of its own way as is free.
      Points3 carried = Points3::Zero(in_the_way ? end.rows() : 0, 3);
      if (in_the_way) {
        for (const SupportContact& s : support_contacts_) {
          const auto [first, last] = cloth_nodes(s.contact.kind);
          Eigen::RowVector3d way = Eigen::RowVector3d::Zero();
          double sum = 0;
          for (int k = 0; k < 4; ++k) {
            const auto i = static_cast<std::size_t>(k);
            if (k >= first && k < last) continue;
            way += s.contact.weight[i] * (support_end.row(s.contact.node[i]) - checked_support.row(s.contact.node[i]));
            sum += s.contact.weight[i];
          }
          for (int k = first; k < last; ++k) carried.row(s.contact.node[static_cast<std::size_t>(k)]) = way / sum;
        }
      }
      for (Eigen::Index i = 0; i < end.rows(); ++i) {
        const double fraction = limit.fraction[static_cast<std::size_t>(i)];
        if (fraction >= 1) continue;
        if (in_the_way) {
          const Eigen::RowVector3d with = carried.row(i);
          end.row(i) = checked.row(i) + with + fraction * (end.row(i) - checked.row(i) - with);
        } else {
          end.row(i) = limit.x.row(i);
        }
        velocity.row(i) = (end.row(i) - checked.row(i)) / elapsed;
      }
      if (!in_the_way) break;
    }
    phase("contact");
    checked = end;
    checked_support = support_end;
    support_x_ = support_end;
    checked_time = provot.state().time + provot.time_step();
    relist = true;  // once the step's forces have been read
    phase("sheet");
  };

  const double until = rest ? tables_end + params_.settling_time : params_.duration;
  double next_log = 0;
  // Net forces, and what held particles are held with.
  const auto read_forces = [&] {
    gradient_ = -provot.force();
    for (std::size_t i = 0; i < held_nodes.size(); ++i) gradient_.row(held_nodes[i]) = provot.constraints().holding_force(i).transpose();
  };
  bool stable = true;
  int active_contacts = 0;
  double limit_now = first_limit;
  while (provot.state().time < until - 0.5 * provot.time_step() && !interrupted()) {
    if (ramped) set_time(provot.state().time);
    time_ = provot.state().time;
    if (moving_.moves()) {
      if (Issues issues = moving_.advance(provot.state().time, std::min(provot.time_step(), until - provot.state().time)); !issues.empty()) return issues;
      move_contacts(provot.system().constraints, provot.time_step());
    }
    const ProvotState before = moving_.moves() ? provot.state() : ProvotState{};
    const Points3 checked_before = moving_.moves() ? checked : no_points, support_before = checked_support;
    const double checked_time_before = checked_time;
    const ConstraintReport step = provot.step();
    if (squeezed) {
      if (const auto verdict = moving_.finish(false, {}); !verdict) return verdict.issues();
      provot.state() = before;
      provot.state().x = checked;
      report_squeezed(before.time);
      break;
    }
    if (moving_.moves()) {
      std::vector<BodyWrench> found(moving_.bodies().size());
      const ConstraintSet& set = provot.system().constraints;
      for (const SupportContact& s : support_contacts_) {
        const auto [first, last] = cloth_nodes(s.contact.kind);
        Eigen::Vector3d place = Eigen::Vector3d::Zero();
        double sum = 0;
        for (int k = 0; k < 4; ++k) {
          const auto i = static_cast<std::size_t>(k);
          if (k >= first && k < last) continue;
          place += s.contact.weight[i] * moving_.start().row(s.contact.node[i]).transpose();
          sum += s.contact.weight[i];
        }
        const Eigen::Vector3d force = provot.constraints().contact_force(s.index) * set.contacts[s.index].normal + provot.constraints().friction_force(s.index);
        moving_.add_contact_force(s.contact, place / sum, sum * force, found);
      }
      std::size_t k = 0;
      for (const bool on_path : {false, true}) {
        for (const Held& held : held_) {
          if ((held.spec.times.empty() && held.body < 0) == on_path) continue;
          for (int node : held.nodes) {
            if (held.body >= 0) moving_.add_force(held.body, before.x.row(node).transpose(), -provot.constraints().holding_force(k), found);
            ++k;
          }
        }
      }
      const auto verdict = moving_.finish(true, found);
      if (!verdict) return verdict.issues();
      if (*verdict == SupportMotion::Verdict::undone) {
        provot.state() = before;
        checked = checked_before;
        support_x_ = checked_support = support_before;
        checked_time = checked_time_before;
        relist = false;
        continue;
      }
      wrenches_ = std::move(found);
    }
    if (relist) {
      relist = false;
      phase("contact");
      list_contacts(checked, provot.system().constraints);
      phase("sheet");
    }
    ++report_.iterations;
    report_.solver_iterations += step.iterations;
    active_contacts = step.active_contacts;
    if (provot.state().time < next_log) continue;
    next_log = provot.state().time + log_every;
    stable = provot.state().x.allFinite();
    if (!stable) break;
    x_ = provot.state().x;
    // Curves stiffen: the step follows. This also brings energies for the log.
    const ContactSums sums = contact_sums_;
    limit_now = stable_limit(x_);
    contact_sums_ = sums;
    contact_sums_.pairs = step.active_contacts;
    stable = !(params_.explicit_step && *params_.explicit_step > limit_now);
    if (!stable) break;
    step_ = provot.time_step();
    if (!params_.explicit_step && safe_step * limit_now < 0.9 * provot.time_step()) provot.set_time_step(safe_step * limit_now);
    read_forces();
    report_.residual = static_residual();
    solve_report_.iterations = step.iterations;
    last_move_ = provot.state().v.rowwise().norm().maxCoeff() * provot.time_step();
    time_ = report_.simulated_time = provot.state().time;
    log_row("explicit");
    record_row();
    if (hooks_.progress) hooks_.progress(0.2 + 0.8 * provot.state().time / until, fmt::format("t = {:.3f} s, residual {:.2e}", provot.state().time, report_.residual));
    if (rest && provot.state().time >= tables_end && report_.residual <= params_.residual) {
      report_.converged = true;
      break;
    }
  }
  if (!stable) {
    findings_.push_back(Issue{"unstable", {}, fmt::format("the step of {:.3g} s went beyond the stability limit ({:.3g} s) after {} steps; the last sound state is written", provot.time_step(), limit_now, report_.iterations), "give a smaller explicit_step, or none", Category::check});
    x_ = checked;
    velocity_.setZero();
    evaluate(x_, true);
    report_.residual = static_residual();
    return {};
  }
  for (std::size_t k = 0; k < params_.distances.size() && report_.iterations > 0; ++k) {
    const DistanceSpec& spec = params_.distances[k];
    report_.distance_forces.emplace_back(spec.name.empty() ? spec.between[0] : spec.name, provot.constraints().distance_force(k));
  }
  // The end goes through the same check as all that was before it.
  {
    const Points3& support_end = moving_.moves() && support_ && !squeezed ? moving_.start() : support_x_;
    const contact::StepLimit& last = search_->limit_step(checked, provot.state().x, checked_support, support_end, limit_options);
    support_x_ = last.support_fraction == 1 ? support_end : Points3(checked_support + last.support_fraction * (support_end - checked_support));
    x_ = last.x;
  }
  velocity_ = provot.state().v;
  report_.simulated_time = provot.state().time;
  if (!rest && !interrupted() && !squeezed) report_.converged = true;
  const ContactSums sums = contact_sums_;
  evaluate(x_, true);
  contact_sums_ = sums;
  contact_sums_.pairs = active_contacts;
  if (report_.iterations > 0) read_forces();
  report_.residual = static_residual();
  return {};
}

void Run::check_end() {
  phase("check");
  const auto panel_of = [&](int face) { return garment_.panels[static_cast<std::size_t>(garment_.face_panel[face])].name; };
  const auto places = [&](const std::vector<contact::FacePair>& pairs, const char* code, const char* what, const char* remedy) {
    std::set<std::string> named;
    for (const contact::FacePair& pair : pairs) {
      const std::string name = panel_of(pair.a);
      if (named.size() >= 8 || !named.insert(name).second) continue;
      const Eigen::RowVector3d at = x_.row(sheet_.corners[static_cast<std::size_t>(pair.a)][0]);
      findings_.push_back(Issue{code, {.item = "panel " + name}, fmt::format("{} at ({:.3f}, {:.3f}, {:.3f}) m, {} face pairs in all", what, at.x(), at.y(), at.z(), pairs.size()), remedy, Category::check});
    }
  };
  const auto self = contact::self_intersections(search_->cloth(), x_);
  report_.intersections = static_cast<int>(self.size());
  places(self, "self_intersection", "the cloth cuts through itself", "place the panels without overlap");
  if (support_) {
    const auto cuts = contact::support_intersections(search_->cloth(), x_, support_surface_, support_x_);
    report_.support_intersections = static_cast<int>(cuts.size());
    places(cuts, "support_intersection", "the cloth cuts through the support", "place the panels clear of the support");
    const contact::SupportField field(support_surface_, support_x_);
    report_.inside = static_cast<int>(field.penetrations(x_, search_->cloth().vertices).size());
    if (report_.inside > 0) {
      findings_.push_back(Issue{"inside_support", {}, fmt::format("{} particles are inside the support", report_.inside), "place the panels clear of the support", Category::check});
    }
  }
}

/// What closed, and what could not be.
void Run::check_closures() {
  report_.closures = fastening_.states(garment_, scatter(x_, sheet_.node_of_vertex));
  std::erase_if(report_.closures, [](const ClosureState& c) { return c.halves == 0; });
  for (const ClosureState& c : report_.closures) {
    const std::string item = c.kind + " " + c.name;
    if (c.closed < c.halves) {
      findings_.push_back(Issue{"not_closed", {.item = item}, fmt::format("{}did not close: its halves are {:.1f} mm apart, {:.1f} mm were asked for", c.halves == 1 ? "" : fmt::format("{} of {} pairs ", c.halves - c.closed, c.halves), 1e3 * c.gap, 1e3 * c.length),
                                "place its halves nearer together, raise fastening_pull, or leave it open (toile-layer, `open`)", Category::check});
    } else if (c.turned > 0) {
      findings_.push_back(Issue{"closed_wrongly", {.item = item}, "the second half lies under the first", "exchange its halves, or place the one that is to lie on top outside (docs/placement.md)", Category::check});
    }
  }
}

GarmentMesh Run::output() const {
  GarmentMesh result = garment_;
  result.x = scatter(x_, sheet_.node_of_vertex);
  // What was measured on the start no longer holds.
  for (const char* name : {"vx", "vy", "vz", "edge_strain", "ease", "seam_gap"}) result.vertex_columns.erase(name);
  for (const char* name : {"warp_angle", "cuts"}) result.face_columns.erase(name);
  if (params_.mode == Mode::motion) {
    const Points3 v = scatter(velocity_, sheet_.node_of_vertex);
    int c = 0;
    for (const char* name : {"vx", "vy", "vz"}) {
      mesh::Column column;
      column.reals.assign(v.col(c).begin(), v.col(c).end());
      result.vertex_columns[name] = std::move(column);
      ++c;
    }
  }
  mechanics::store_friction(sheet_, result);
  result.marks["converged"] = report_.converged ? "yes" : "no";
  result.marks["residual"] = fmt::format("{}", report_.residual);
  return result;
}

/// Where the support is at the start, if it moves.
Issues Run::begin_motion() {
  std::vector<std::string> held_by;
  for (const ConstraintSpec& spec : params_.constraints) {
    if (!spec.body.empty()) held_by.push_back(spec.body);
  }
  if (!hooks_.supports) {
    if (held_by.empty()) return {};
    return {Issue{"no_motion", {.item = "constraints"}, fmt::format("body '{}' is to lead the cloth, but nothing says how it moves", held_by.front()), "give the input `motion`"}};
  }
  const Issues issues = moving_.begin(*hooks_.supports, support_, held_by, params_.duration);
  if (issues.empty() && support_) support_x_ = moving_.end();
  return issues;
}

Result<SimulationOutcome> Run::go() {
  if (support_) {
    Issues issues = mesh::validate(*support_);
    if (!issues.empty()) return issues;
    support_surface_ = contact::make_surface(static_cast<int>(support_->x.rows()), support_->faces);
    support_x_ = support_->x;
  }
  std::vector<char> closed(garment_.welds.size(), 0);
  for (std::size_t i = 0; i < closed.size(); ++i) {
    closed[i] = (garment_.x.row(garment_.welds[i].a) - garment_.x.row(garment_.welds[i].b)).norm() <= 1e-9;
  }
  const Ids nodes = node_ids(garment_, closed);
  x_ = gather_mean(garment_.x, nodes, nodes.size() == 0 ? 0 : nodes.maxCoeff() + 1);
  Issues issues = begin_motion();
  append(issues, find_constraints());
  append(issues, build(nodes));
  if (!issues.empty()) return issues;

  double thickest = 0, friction = 0;
  for (const fabric::Constitutive& f : sheet_.fabrics) {
    thickest = std::max(thickest, f.thickness);
    friction = std::max(friction, f.friction);
  }
  laws_.self = {params_.self_reach.value_or(std::max(thickest, 8e-4)), params_.contact_stiffness, params_.friction.value_or(friction), 1};
  laws_.support = {params_.support_reach, params_.contact_stiffness, params_.support_friction, 1};
  FasteningOptions fastening;
  fastening.steps = params_.closing_steps;
  fastening.pull = params_.fastening_pull;
  fastening.thickness = laws_.self.reach;
  fastening_ = Fastening(garment_, garment_.x, fastening);
  if (!fastening_.empty() && (hooks_.checkpoint || hooks_.resume)) {
    return Issue{"no_checkpoint", {.item = "checkpoint"}, "a garment with fasteners cannot go on from a checkpoint", "leave out checkpoint and resume"};
  }
  apply_fasteners();

  if (hooks_.resume) {
    resume_ = *hooks_.resume;
    // What was open at the checkpoint is open in its garment's seams again: the number of nodes tells whether they were closed.
    std::uint64_t version = 0, saved_nodes = 0;
    Archive head(resume_);
    head(version);
    head(saved_nodes);
    if (!head.good() || version != 1) return damaged_checkpoint();
    if (saved_nodes != static_cast<std::uint64_t>(sheet_.node_count)) {
      const Ids particle = mesh::particles(garment_);
      x_ = gather_mean(garment_.x, particle, particle.size() == 0 ? 0 : particle.maxCoeff() + 1);
      issues = build(particle);
      if (!issues.empty()) return issues;
      if (saved_nodes != static_cast<std::uint64_t>(sheet_.node_count)) return damaged_checkpoint();
    }
  } else {
    clear_start();
    close_seams();
  }
  if (!interrupted()) {
    if (params_.integrator == Integrator::provot) {
      issues = integrate_explicitly();
      if (!issues.empty()) return issues;
    } else if (params_.mode == Mode::equilibrium) {
      issues = equilibria();
      if (!issues.empty()) return issues;
    } else {
      issues = move_in_time();
      if (!issues.empty()) return issues;
    }
  }
  const mechanics::StrainSummary strains = mechanics::strain_summary(sheet_, x_);
  report_.strain_warp_max = strains.warp_max;
  report_.strain_weft_max = strains.weft_max;
  report_.strain_warp_99 = strains.warp_99;
  report_.strain_weft_99 = strains.weft_99;
  report_.shear_max = strains.shear_max;
  report_.membrane_energy = response_.energy.membrane;
  report_.bending_energy = response_.energy.bending;
  report_.potential_energy = potential_;
  report_.contact_energy = contact_sums_.energy;
  report_.contacts = contact_sums_.pairs;
  report_.least_gap = contact_sums_.least_gap;
  for (Eigen::Index i = 0; i < gradient_.rows(); ++i) report_.residual_max = std::max(report_.residual_max, net_force(i, gradient_.row(i)));
  for (std::size_t c = 0; c < held_.size(); ++c) report_.reactions.push_back(reaction(c));
  for (std::size_t b = 0; b < wrenches_.size(); ++b) report_.bodies.push_back({moving_.bodies()[b], wrenches_[b].force, wrenches_[b].torque});
  check_end();
  check_closures();
  if (interrupted()) {
    findings_.push_back(Issue{"interrupted", {}, "stopped before the end; the state so far is written", hooks_.checkpoint ? "go on with `resume`" : "run again; with `checkpoint` it could go on", Category::interrupted});
  } else if (!report_.converged && std::none_of(findings_.begin(), findings_.end(), [](const Issue& issue) { return issue.code == "squeezed"; })) {
    findings_.push_back(Issue{"not_converged", {}, fmt::format("the residual is {:.2e} of the weight after {} iterations, {:.2e} was asked for", report_.residual, report_.iterations, params_.residual),
                              "raise max_iterations or residual", Category::not_converged});
  }
  SimulationOutcome outcome{output(), report_, findings_, log_, record_};
  return outcome;
}

}  // namespace

Result<SimulationOutcome> simulate(const GarmentMesh& garment, const std::optional<SupportMesh>& support, const SimulationParams& params, const SimulationHooks& hooks) {
  return Run(garment, support, params, hooks).go();
}

}  // namespace toile::dynamics
