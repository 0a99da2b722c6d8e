#include "toile/dynamics/simulate.h"

#include "toile/base/parallel.h"
#include "toile/contact/exact.h"
#include "toile/contact/search.h"
#include "toile/contact/support_field.h"
#include "toile/dynamics/contact_force.h"
#include "toile/dynamics/linear_solver.h"
#include "toile/mechanics/sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

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
constexpr int solver_iterations_max = 300;
// Relaxation: part of the last move that the next step starts with (until the energy rises), and the step's control.
constexpr double momentum = 0.95;
constexpr double step_max = 2;        // [s]
constexpr double quiet_move = 2e-4;   // below it the step grows [m]
constexpr int stall_limit = 30;       // iterations without a better residual
constexpr double solved_well = 0.25;  // part of the net force left after one iteration, below it the step grows

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
  void phase(const char* name) const {
    if (hooks_.phase) hooks_.phase(name);
  }
  bool interrupted() const { return hooks_.interrupted && hooks_.interrupted(); }

  Issues build(const Ids& node_of_vertex);
  Issues find_fixed();
  void clear_start();
  void evaluate(const Points3& x, bool with_matrix);
  double objective(const Points3& x);
  double static_residual() const;
  bool iterate(double step);
  void accept();
  void close_seams();
  bool try_merge();
  void relax();
  void move_in_time();
  void log_row(const char* phase_name);
  void check_end();
  GarmentMesh output() const;

  const GarmentMesh& garment_;
  const std::optional<SupportMesh>& support_;
  const SimulationParams& params_;
  const SimulationHooks& hooks_;
  SimulationReport report_;
  Issues findings_;
  std::string log_;

  Sheet sheet_;
  std::optional<contact::Search> search_;
  contact::Surface support_surface_;
  Points3 support_x_ = no_points;
  ContactLaws laws_;
  double weight_ = 0;

  Points3 x_;             // accepted positions, |nodes|
  Points3 velocity_;
  Points3 start_;         // of the current step: friction and inertia refer to it
  Points3 inertia_;       // where inertia alone would lead
  Points3 link_start_, link_offset_;
  double gravity_ = 0;
  double step_ = 0;       // [s]; infinite: no inertia
  bool damped_ = false;   // drag of the air counts
  std::vector<FrictionPair> friction_;
  std::vector<std::uint8_t> self_exempt_, support_exempt_;
  std::vector<int> fixed_vertices_;  // of the garment
  std::vector<char> fixed_;          // |nodes|

  // of the last evaluation
  mechanics::SheetResponse response_;
  Points3 gradient_;      // static: without inertia
  contact::Contacts contacts_;
  ContactSums contact_sums_;
  double energy_ = 0, friction_energy_ = 0, potential_ = 0;
  std::vector<ContactTerm> terms_;
  LinearSolver solver_;
  SolveReport solve_report_;
  double momentum_ = momentum, tolerance_ = solver_tolerance, slack_ = energy_slack;  // sharper once the relaxation stalls
  double last_total_ = 1e300, last_left_ = 0, last_move_ = 0, last_fraction_ = 1, last_alpha_ = 1;
  std::vector<Float4> rhs_, direction_;
};

Issues Run::build(const Ids& node_of_vertex) {
  mechanics::SheetOptions options;
  options.link_stiffness = params_.seam_stiffness;
  Result<Sheet> sheet = mechanics::make_sheet(garment_, node_of_vertex, options);
  if (!sheet) return sheet.issues();
  sheet_ = std::move(*sheet);
  response_ = {};
  solver_ = {};
  mesh::Triangles faces(garment_.face_count(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = sheet_.corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
  }
  const Ids particle = mesh::particles(garment_);
  Ids adjacency(sheet_.node_count);
  for (Eigen::Index v = 0; v < node_of_vertex.size(); ++v) adjacency[node_of_vertex[v]] = particle[v];
  contact::Surface surface = contact::make_surface(sheet_.node_count, faces, adjacency);
  if (support_) {
    search_.emplace(std::move(surface), x_, support_surface_, support_x_);
  } else {
    search_.emplace(std::move(surface), x_);
  }
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
  fixed_.assign(static_cast<std::size_t>(sheet_.node_count), 0);
  for (int v : fixed_vertices_) fixed_[static_cast<std::size_t>(node_of_vertex[v])] = 1;
  return {};
}

/// Vertices of the runs and points that `fixed` names.
Issues Run::find_fixed() {
  Issues issues;
  for (const std::string& name : params_.fixed) {
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos) {
      issues.push_back(Issue{"bad_reference", {.item = "fixed"}, fmt::format("'{}' is not panel.edge or panel.point", name), "write for example front.hem"});
      continue;
    }
    const Result<int> panel = mesh::find_panel(garment_, name.substr(0, dot));
    if (!panel) {
      append(issues, panel.issues());
      continue;
    }
    const std::string item = name.substr(dot + 1);
    const auto point = std::find_if(garment_.points.begin(), garment_.points.end(), [&](const mesh::NamedPoint& p) { return p.panel == *panel && p.name == item; });
    if (point != garment_.points.end()) {
      fixed_vertices_.push_back(point->vertex);
      continue;
    }
    const Result<int> run = mesh::find_run(garment_, *panel, item);
    if (!run) {
      append(issues, run.issues());
      continue;
    }
    for (int v : mesh::run_vertex_ids(garment_, *run)) fixed_vertices_.push_back(v);
  }
  return issues;
}

void Run::clear_start() {
  phase("check");
  if (support_) {
    const contact::SupportField field(support_surface_, support_x_);
    const double clearance = 0.25 * params_.support_reach;
    const contact::PushedOut pushed = contact::project_outside(field, search_->cloth(), x_, clearance);
    report_.start_inside = pushed.inside_before;
    report_.start_move = pushed.largest_move;
    if (pushed.moved > 0) x_ = pushed.x;
  }
  const auto mark = [&](int face, std::vector<std::uint8_t>& exempt) {
    exempt.resize(static_cast<std::size_t>(sheet_.node_count), 0);
    for (int node : sheet_.corners[static_cast<std::size_t>(face)]) exempt[static_cast<std::size_t>(node)] = 1;
  };
  for (const contact::FacePair& pair : contact::self_intersections(search_->cloth(), x_)) {
    ++report_.start_intersections;
    mark(pair.a, self_exempt_);
    mark(pair.b, self_exempt_);
  }
  if (support_) {
    for (const contact::FacePair& pair : contact::support_intersections(search_->cloth(), x_, support_surface_, support_x_)) {
      ++report_.start_intersections;
      mark(pair.a, support_exempt_);
    }
  }
  start_ = x_;
}

/// Energies, gradient and if asked the second derivative at x. Inertia is left to the caller.
void Run::evaluate(const Points3& x, bool with_matrix) {
  phase("sheet");
  mechanics::evaluate(sheet_, x, link_offset_, with_matrix ? std::optional(mechanics::Curvature::positive) : std::nullopt, response_);
  gradient_ = response_.gradient;
  gradient_.col(1) += gravity_ * sheet_.mass;
  potential_ = gravity_ * sheet_.mass.dot(x.col(1));
  phase("contact");
  contacts_ = search_->proximity(x, support_x_, {laws_.self.reach, laws_.support.reach});
  terms_.clear();
  contact_sums_ = add_repulsion(contacts_, x, support_x_, sheet_.area, laws_, gradient_, with_matrix ? &terms_ : nullptr);
  friction_energy_ = add_friction(friction_, start_, x, gradient_, with_matrix ? &terms_ : nullptr);
  if (damped_) {
    const Points3 moved = x - start_;
    const Eigen::VectorXd rate = sheet_.area * (params_.air_drag / step_);
    gradient_ += rate.asDiagonal() * moved;
    friction_energy_ += 0.5 * moved.cwiseProduct(rate.asDiagonal() * moved).sum();
  }
  energy_ = response_.energy.total() + potential_ + contact_sums_.energy + friction_energy_;
  phase("other");
}

double Run::static_residual() const {
  double sum = 0;
  for (Eigen::Index i = 0; i < gradient_.rows(); ++i) {
    if (!fixed_[static_cast<std::size_t>(i)]) sum += gradient_.row(i).norm();
  }
  return sum / std::max(weight_, 1e-12);
}

/// One Newton iteration on energy + inertia from x_ with the evaluation of x_ at hand (with matrix). True when x_ moved.
bool Run::iterate(double step) {
  const double inverse_sq = std::isfinite(step) ? 1 / (step * step) : 0;
  const auto n = static_cast<std::size_t>(sheet_.node_count);
  rhs_.resize(n);
  const double drag = damped_ ? params_.air_drag / step_ : 0;
  parallel_for(n, grain, [&](std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double m = sheet_.mass[row] * inverse_sq;
    const Eigen::Vector3d force = -(gradient_.row(row) + m * (x_.row(row) - inertia_.row(row))).transpose();
    rhs_[i] = mechanics::load3(force.data());
    Block& d = response_.matrix.value[static_cast<std::size_t>(sheet_.diagonal[i])];
    for (int c = 0; c < 3; ++c) d.column[c][c] += static_cast<float>(m + drag * sheet_.area[row]);
    if (fixed_[i]) {
      // A heavy diagonal holds the row; what is left of its motion is dropped below.
      rhs_[i] = Float4{};
      for (int c = 0; c < 3; ++c) d.column[c][c] += 1e8f;
    }
  });
  const auto inertia_energy = [&](const Points3& x) {
    return 0.5 * inverse_sq * (x - inertia_).cwiseProduct(sheet_.mass.asDiagonal() * (x - inertia_)).sum();
  };
  const double before = energy_ + inertia_energy(x_);
  phase("solve");
  solver_.factor(response_.matrix, terms_, x_, fixed_);
  solve_report_ = solver_.solve(response_.matrix, terms_, rhs_, direction_, {.tolerance = tolerance_, .max_iterations = solver_iterations_max});
  report_.solver_iterations += solve_report_.iterations;
  ++report_.iterations;
  phase("limit");
  double largest = 0;
  for (const Float4& d : direction_) largest = std::max(largest, std::sqrt(static_cast<double>(d[0]) * d[0] + static_cast<double>(d[1]) * d[1] + static_cast<double>(d[2]) * d[2]));
  if (!std::isfinite(largest)) return false;
  const double scale = largest > params_.largest_move ? params_.largest_move / largest : 1;
  Points3 target(x_.rows(), 3);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (int c = 0; c < 3; ++c) target(row, c) = x_(row, c) + (fixed_[i] ? 0 : scale * static_cast<double>(direction_[i][c]));
  }
  contact::LimitOptions options;
  options.self_exempt = self_exempt_;
  options.support_exempt = support_exempt_;
  const contact::StepLimit& limit = search_->limit_step(x_, target, support_x_, support_x_, options);
  last_fraction_ = limit.least_fraction;
  const Points3 reached = limit.x;
  // The straight way to `reached` is free of intersections, so every point on it is.
  double alpha = 1;
  const Points3 from = x_;
  bool moved = false;
  for (int trial = 0; trial < 6; ++trial, alpha *= 0.5) {
    const Points3 candidate = alpha == 1 ? reached : Points3(from + alpha * (reached - from));
    evaluate(candidate, true);
    const double after = energy_ + inertia_energy(candidate);
    const double part = std::min(1.0, alpha * scale * largest / slack_move);
    if (after <= before + slack_ * part * part * part * part * weight_ || trial == 5) {
      x_ = candidate;
      moved = true;
      break;
    }
  }
  last_alpha_ = alpha;
  const Points3 left = gradient_ + inverse_sq * (sheet_.mass.asDiagonal() * (x_ - inertia_));
  last_left_ = left.rowwise().norm().sum() / std::max(weight_, 1e-12);
  last_move_ = (x_ - from).rowwise().norm().maxCoeff();
  return moved;
}

/// The step is over: friction takes note, the next step starts here.
void Run::accept() {
  friction_ = update_friction(friction_, start_, contacts_, x_, support_x_, sheet_.area, laws_);
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
    log_ = "iteration,phase,step_s,residual,membrane_J,bending_J,potential_J,contact_J,links_J,contacts,least_gap_m,solver_iterations,solver_reduction,move_m,fraction,alpha\n";
  }
  log_ += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", report_.iterations, phase_name, step_, static_residual(), response_.energy.membrane,
                      response_.energy.bending, potential_, contact_sums_.energy, response_.energy.links, contact_sums_.pairs, contact_sums_.least_gap,
                      solve_report_.iterations, solve_report_.reduction, last_move_, last_fraction_, last_alpha_);
}

double widest_link(const Sheet& sheet, const Points3& x) {
  double widest = 0;
  for (const mechanics::Link& link : sheet.links) widest = std::max(widest, (x.row(link.a) - x.row(link.b)).norm());
  return widest;
}

/// Makes the two sides of every seam one when all are near enough and the way there is free.
bool Run::try_merge() {
  if (widest_link(sheet_, x_) > params_.seam_gap) return false;
  const Ids particle = mesh::particles(garment_);
  const Points3 vertices = scatter(x_, sheet_.node_of_vertex);
  const Points3 merged = gather_mean(vertices, particle, particle.maxCoeff() + 1);
  Points3 target(sheet_.node_count, 3);
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

void Run::close_seams() {
  if (sheet_.links.empty()) return;
  gravity_ = params_.closing_gravity * params_.gravity;
  step_ = params_.time_step;
  inertia_ = start_ = x_;
  const int limit = params_.closing_steps * 5;
  for (int i = 1; i <= limit && !interrupted(); ++i) {
    const double part = std::max(0.0, 1 - static_cast<double>(i) / params_.closing_steps);
    link_offset_ = part * link_start_;
    // Sides that do not meet by now are pulled harder and harder.
    if (i > params_.closing_steps + 5) mechanics::scale_links(sheet_, 1.25);
    evaluate(x_, true);
    iterate(step_);
    log_row("closing");
    accept();
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

void Run::relax() {
  gravity_ = params_.gravity;
  step_ = params_.time_step;
  inertia_ = start_ = x_;
  link_offset_.setZero();
  evaluate(x_, true);
  double before = static_residual(), best = before;
  int stalled = 0;
  for (int i = 0; i < params_.max_iterations && !interrupted(); ++i) {
    iterate(step_);
    accept();
    // Friction's slip has been carried on; the force it gives is part of the balance from here on.
    evaluate(x_, true);
    const double residual = static_residual();
    log_row("relaxing");
    if (hooks_.progress) hooks_.progress(std::clamp(0.2 + 0.8 * std::log(residual / 10) / std::log(params_.residual / 10), 0.2, 1.0), fmt::format("iteration {}, residual {:.2e}", report_.iterations, residual));
    if (residual <= params_.residual) {
      report_.converged = true;
      break;
    }
    // How well one iteration solved its step: what is left of the step's own net force.
    const double left = last_left_ / before;
    before = residual;
    if (residual < 0.95 * best) {
      best = residual;
      stalled = 0;
    } else {
      ++stalled;
    }
    if (last_alpha_ < 0.5 || residual > 4 * best) {
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
    } else if (left < solved_well || last_move_ < quiet_move) {
      step_ = std::min(1.4 * step_, step_max);
    }
  }
  report_.residual = static_residual();
}

void Run::move_in_time() {
  gravity_ = params_.gravity;
  link_offset_.setZero();
  step_ = params_.time_step;
  damped_ = params_.air_drag > 0;
  const auto column = [&](const char* name) { return garment_.vertex_columns.find(name); };
  if (column("vx") != garment_.vertex_columns.end() && column("vy") != garment_.vertex_columns.end() && column("vz") != garment_.vertex_columns.end()) {
    Points3 v(garment_.vertex_count(), 3);
    int c = 0;
    for (const char* name : {"vx", "vy", "vz"}) {
      const mesh::Column& values = column(name)->second;
      for (Eigen::Index i = 0; i < v.rows(); ++i) v(i, c) = values.integer ? values.integers[static_cast<std::size_t>(i)] : values.reals[static_cast<std::size_t>(i)];
      ++c;
    }
    velocity_ = gather_mean(v, sheet_.node_of_vertex, sheet_.node_count);
  }
  const int steps = std::max(1, static_cast<int>(std::lround(params_.duration / params_.time_step)));
  start_ = x_;
  inertia_ = x_;
  for (int i = 0; i < steps && !interrupted(); ++i) {
    start_ = x_;
    inertia_ = x_ + step_ * velocity_;
    evaluate(x_, true);
    for (int k = 0; k < params_.newton_iterations; ++k) {
      iterate(step_);
      if (last_move_ < 1e-4) break;
    }
    velocity_ = (x_ - start_) / step_;
    friction_ = update_friction(friction_, start_, contacts_, x_, support_x_, sheet_.area, laws_);
    report_.simulated_time = (i + 1) * step_;
    log_row("moving");
    if (hooks_.progress) hooks_.progress(static_cast<double>(i + 1) / steps, fmt::format("t = {:.3f} s", report_.simulated_time));
  }
  start_ = x_;
  damped_ = false;
  evaluate(x_, true);
  report_.residual = static_residual();
  report_.converged = true;
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
  result.marks["converged"] = report_.converged ? "yes" : "no";
  result.marks["residual"] = fmt::format("{}", report_.residual);
  return result;
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
  Issues issues = find_fixed();
  append(issues, build(nodes));
  if (!issues.empty()) return issues;

  double thickest = 0, friction = 0;
  for (const fabric::Constitutive& f : sheet_.fabrics) {
    thickest = std::max(thickest, f.thickness);
    friction = std::max(friction, f.friction);
  }
  laws_.self = {params_.self_reach.value_or(std::max(thickest, 8e-4)), params_.contact_stiffness, params_.friction.value_or(friction), 1};
  laws_.support = {params_.support_reach, params_.contact_stiffness, params_.support_friction, 1};

  clear_start();
  close_seams();
  if (!interrupted()) {
    if (params_.mode == Mode::equilibrium) {
      relax();
    } else {
      move_in_time();
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
  for (Eigen::Index i = 0; i < gradient_.rows(); ++i) {
    if (!fixed_[static_cast<std::size_t>(i)]) report_.residual_max = std::max(report_.residual_max, gradient_.row(i).norm());
  }
  check_end();
  if (interrupted()) {
    findings_.push_back(Issue{"interrupted", {}, "stopped before the end; the state so far is written", "run again", Category::interrupted});
  } else if (!report_.converged) {
    findings_.push_back(Issue{"not_converged", {}, fmt::format("the residual is {:.2e} of the weight after {} iterations, {:.2e} was asked for", report_.residual, report_.iterations, params_.residual),
                              "raise max_iterations or residual", Category::not_converged});
  }
  SimulationOutcome outcome{output(), report_, findings_, log_};
  return outcome;
}

}  // namespace

Result<SimulationOutcome> simulate(const GarmentMesh& garment, const std::optional<SupportMesh>& support, const SimulationParams& params, const SimulationHooks& hooks) {
  return Run(garment, support, params, hooks).go();
}

}  // namespace toile::dynamics
