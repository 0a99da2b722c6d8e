#include "toile/dynamics/dynamic_constraints.h"

#include <algorithm>
#include <cmath>

#include "toile/base/result.h"

namespace toile::dynamics {
namespace {

Eigen::Vector3d point(const Points3& x, int i) { return x.row(i).transpose(); }

}  // namespace

/// out = J M^-1 J^T in, on active rows. Rows are few against nodes: only their own nodes are visited.
void DynamicConstraints::apply(const std::vector<double>& in, std::vector<double>& out) {
  for (int i : touched_) push_.row(i).setZero();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    if (!active_[k]) continue;
    const Row& row = rows_[k];
    for (std::size_t j = 0; j < 4; ++j) {
      if (row.node[j] >= 0) push_.row(row.node[j]) += in[k] * row.gradient[j].transpose();
    }
  }
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    double sum = 0;
    const Row& row = rows_[k];
    for (std::size_t j = 0; j < 4; ++j) {
      if (row.node[j] >= 0) sum += inverse_mass_[row.node[j]] * row.gradient[j].dot(push_.row(row.node[j]));
    }
    out[k] = sum;
  }
}

/// Conjugate gradients with the diagonal as preconditioner on the active rows, from the present multipliers.
bool DynamicConstraints::solve(const ConstraintOptions& options, int& iterations) {
  const std::size_t n = rows_.size();
  double scale = 0;
  for (std::size_t k = 0; k < n; ++k) {
    if (!active_[k]) lambda_[k] = 0;
    rhs_[k] = active_[k] ? rows_[k].target - rows_[k].free : 0;
    scale = std::max(scale, std::abs(rhs_[k]));
  }
  if (scale == 0) {
    std::fill(lambda_.begin(), lambda_.end(), 0.0);
    return true;
  }
  apply(lambda_, q_);
  double rz = 0;
  for (std::size_t k = 0; k < n; ++k) {
    r_[k] = active_[k] ? rhs_[k] - q_[k] : 0;
    z_[k] = r_[k] / diagonal_[k];
    p_[k] = z_[k];
    rz += r_[k] * z_[k];
  }
  const auto largest = [&] {
    double most = 0;
    for (std::size_t k = 0; k < n; ++k) most = std::max(most, std::abs(r_[k]));
    return most;
  };
  for (int i = 0; i < options.max_iterations; ++i) {
    if (largest() <= options.tolerance * scale) return true;
    ++iterations;
    apply(p_, q_);
    double pq = 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (active_[k]) pq += p_[k] * q_[k];
    }
    if (!(pq > 0)) break;  // conditions that say the same twice: what is left cannot be reduced
    const double alpha = rz / pq;
    double next = 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (!active_[k]) continue;
      lambda_[k] += alpha * p_[k];
      r_[k] -= alpha * q_[k];
      z_[k] = r_[k] / diagonal_[k];
      next += r_[k] * z_[k];
    }
    const double beta = next / rz;
    rz = next;
    for (std::size_t k = 0; k < n; ++k) p_[k] = active_[k] ? z_[k] + beta * p_[k] : 0;
  }
  return largest() <= std::max(1e-6, options.tolerance) * scale;
}

ConstraintReport DynamicConstraints::add_forces(const ConstraintSet& set, const Points3& x, const Points3& v, const Eigen::VectorXd& mass, double time,
                                                const ConstraintOptions& options, Points3& force) {
  TOILE_CHECK(std::min(options.time_constant, options.contact_time_constant) >= 2 * options.time_step, "time constant {} with steps of {}", options.time_constant, options.time_step);
  const double tau = options.time_constant;
  const auto required = [&](double c, double rate) { return -2 * rate / tau - c / (tau * tau); };
  ConstraintReport report;
  held_ = set.positions.size() + set.trajectories.size();
  first_distance_ = 3 * held_;
  first_contact_ = first_distance_ + set.distances.size();
  const std::size_t n = first_contact_ + set.contacts.size();
  if (rows_.size() != n) lambda_.assign(n, 0);
  for (auto* row : {&rhs_, &r_, &z_, &p_, &q_, &diagonal_}) row->resize(n);
  rows_.resize(n);
  active_.assign(n, 1);
  if (n == 0) {
    friction_.clear();
    return report;
  }
  if (inverse_mass_.size() != mass.size()) {
    push_ = Points3::Zero(mass.size(), 3);
    is_touched_.assign(static_cast<std::size_t>(mass.size()), 0);
    contact_count_.assign(static_cast<std::size_t>(mass.size()), 0);
  }
  inverse_mass_ = mass.cwiseInverse();

  std::size_t k = 0;
  const auto hold = [&](int node, const PathState& path) {
    const Eigen::Vector3d off = point(x, node) - path.position, rate = point(v, node) - path.velocity;
    report.largest_violation = std::max(report.largest_violation, off.norm());
    for (int c = 0; c < 3; ++c, ++k) {
      rows_[k] = {};
      rows_[k].node[0] = node;
      rows_[k].gradient[0] = Eigen::Vector3d::Unit(c);
      rows_[k].target = path.acceleration[c] + required(off[c], rate[c]);
    }
  };
  for (const FixedPosition& c : set.positions) hold(c.node, {c.position});
  for (const Trajectory& c : set.trajectories) hold(c.node, c.path(time));
  for (const FixedDistance& c : set.distances) {
    const Eigen::Vector3d d = point(x, c.a) - point(x, c.b), w = point(v, c.a) - point(v, c.b);
    const double length = std::max(d.norm(), 1e-12);
    const Eigen::Vector3d along = d / length;
    const double rate = along.dot(w);
    report.largest_violation = std::max(report.largest_violation, std::abs(length - c.distance));
    rows_[k] = {};
    rows_[k].node = {c.a, c.b, -1, -1};
    rows_[k].gradient[0] = along;
    rows_[k].gradient[1] = -along;
    // The second derivative of the length is along.(a_a - a_b) plus the centripetal part.
    rows_[k].target = required(length - c.distance, rate) - (w.squaredNorm() - rate * rate) / length;
    ++k;
  }
  for (const Unilateral& c : set.contacts) {
    rows_[k] = {};
    double d = -c.offset, rate = -c.offset_rate;
    for (std::size_t j = 0; j < 4; ++j) {
      if (c.node[j] < 0 || c.weight[j] == 0) continue;
      rows_[k].node[j] = c.node[j];
      rows_[k].gradient[j] = c.weight[j] * c.normal;
      d += c.weight[j] * c.normal.dot(x.row(c.node[j]));
      rate += c.weight[j] * c.normal.dot(v.row(c.node[j]));
    }
    report.deepest_contact = std::max(report.deepest_contact, -d);
    const double slow = options.contact_time_constant;
    rows_[k].target = -2 * rate / slow - d / (slow * slow);
    ++k;
  }

  touched_.clear();
  for (std::size_t row = 0; row < n; ++row) {
    double diagonal = 0, free = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      const int i = rows_[row].node[j];
      if (i < 0) continue;
      diagonal += inverse_mass_[i] * rows_[row].gradient[j].squaredNorm();
      free += inverse_mass_[i] * rows_[row].gradient[j].dot(force.row(i));
      if (!is_touched_[static_cast<std::size_t>(i)]) {
        is_touched_[static_cast<std::size_t>(i)] = 1;
        touched_.push_back(i);
      }
    }
    TOILE_CHECK(diagonal > 0, "constraint {} moves nothing", row);
    diagonal_[row] = diagonal;
    rows_[row].free = free;
  }
  std::sort(touched_.begin(), touched_.end());

  if (first_contact_ == n) {
    report.solved = solve(options, report.iterations);
  } else {
    // Contacts may say the same many times over, or contradict each other by a little: multipliers that stay positive all along never
    // push against each other without measure, wherever the sweeps end.
    double scale = 0;
    for (std::size_t row = 0; row < n; ++row) {
      if (row >= first_contact_) lambda_[row] = std::max(0.0, lambda_[row]);
      scale = std::max(scale, std::abs(rows_[row].target - rows_[row].free));
    }
    apply(lambda_, q_);
    report.solved = false;
    for (int sweep = 0; sweep < options.contact_sweeps && !report.solved; ++sweep) {
      double change = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const Row& row = rows_[k];
        double left = row.target - row.free;
        for (std::size_t j = 0; j < 4; ++j) {
          if (row.node[j] >= 0) left -= inverse_mass_[row.node[j]] * row.gradient[j].dot(push_.row(row.node[j]));
        }
        double next = lambda_[k] + left / diagonal_[k];
        if (k >= first_contact_) next = std::max(0.0, next);
        const double add = next - lambda_[k];
        if (add == 0) continue;
        lambda_[k] = next;
        for (std::size_t j = 0; j < 4; ++j) {
          if (row.node[j] >= 0) push_.row(row.node[j]) += add * row.gradient[j].transpose();
        }
        change = std::max(change, std::abs(add) * diagonal_[k]);
      }
      ++report.iterations;
      report.solved = change <= options.tolerance * scale;
    }
    if (first_contact_ > 0) {
      // The equations once more, exactly, with the contacts' forces as given.
      contact_lambda_.assign(lambda_.begin() + static_cast<std::ptrdiff_t>(first_contact_), lambda_.end());
      std::fill_n(active_.begin(), first_contact_, char{0});
      apply(lambda_, q_);
      for (std::size_t row = 0; row < first_contact_; ++row) rows_[row].free += q_[row];
      std::fill(active_.begin(), active_.end(), char{0});
      std::fill_n(active_.begin(), first_contact_, char{1});
      report.solved = solve(options, report.iterations) && report.solved;
      std::copy(contact_lambda_.begin(), contact_lambda_.end(), lambda_.begin() + static_cast<std::ptrdiff_t>(first_contact_));
      std::fill(active_.begin(), active_.end(), char{1});
    }
  }
  for (std::size_t row = first_contact_; row < n; ++row) {
    if (lambda_[row] > 0) ++report.active_contacts;
  }
  apply(lambda_, q_);
  for (int i : touched_) {
    force.row(i) += push_.row(i);
    is_touched_[static_cast<std::size_t>(i)] = 0;
  }

  friction_.assign(set.contacts.size(), Eigen::Vector3d::Zero());
  // Friction: what would stop the sliding in one step, at most the cone. A node in several contacts shares it among them.
  if (report.active_contacts > 0) {
    for (std::size_t row = first_contact_; row < n; ++row) {
      if (lambda_[row] <= 0) continue;
      for (int i : rows_[row].node) {
        if (i >= 0) ++contact_count_[static_cast<std::size_t>(i)];
      }
    }
    for (std::size_t c = 0; c < set.contacts.size(); ++c) {
      const std::size_t row = first_contact_ + c;
      const Unilateral& contact = set.contacts[c];
      if (lambda_[row] <= 0 || contact.friction <= 0) continue;
      Eigen::Vector3d slide = contact.surface_velocity;
      double inverse = 0;
      int shared = 1;
      for (std::size_t j = 0; j < 4; ++j) {
        const int i = rows_[row].node[j];
        if (i < 0) continue;
        slide += contact.weight[j] * (point(v, i) + options.time_step * inverse_mass_[i] * point(force, i));
        inverse += contact.weight[j] * contact.weight[j] * inverse_mass_[i];
        shared = std::max(shared, contact_count_[static_cast<std::size_t>(i)]);
      }
      slide -= contact.normal * contact.normal.dot(slide);
      const double speed = slide.norm();
      if (speed < 1e-300) continue;
      const double stop = speed / (inverse * options.time_step * shared), most = contact.friction * lambda_[row];
      const Eigen::Vector3d friction = -std::min(stop, most) / speed * slide;
      friction_[c] = friction;
      for (std::size_t j = 0; j < 4; ++j) {
        if (rows_[row].node[j] >= 0) force.row(rows_[row].node[j]) += contact.weight[j] * friction.transpose();
      }
    }
    for (int i : touched_) contact_count_[static_cast<std::size_t>(i)] = 0;
  }
  return report;
}

Eigen::Vector3d DynamicConstraints::holding_force(std::size_t i) const {
  TOILE_CHECK(i < held_, "{} of {} held nodes", i, held_);
  return {lambda_[3 * i], lambda_[3 * i + 1], lambda_[3 * i + 2]};
}
double DynamicConstraints::distance_force(std::size_t i) const { return lambda_[first_distance_ + i]; }
double DynamicConstraints::contact_force(std::size_t i) const { return lambda_[first_contact_ + i]; }

}  // namespace toile::dynamics
