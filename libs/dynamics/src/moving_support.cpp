#include "moving_support.h"

#include "toile/base/text.h"

#include <algorithm>
#include <set>

namespace toile::dynamics {
namespace {

Eigen::Vector3d at(const Points3& x, int i) { return x.row(i).transpose(); }

/// A pair with the support: its gap, the support's share of it and where it touches.
struct Touch {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), place = Eigen::Vector3d::Zero();
  double gap = 0, area = 0;
  Repulsion repulsion{};
};

std::optional<Touch> touch(const Contact& c, const Points3& x, const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws) {
  const ContactLaw& law = laws.of(c.kind);
  if (c.distance >= law.reach) return std::nullopt;
  const auto [first, last] = cloth_nodes(c.kind);
  Eigen::Vector3d gap = Eigen::Vector3d::Zero(), place = Eigen::Vector3d::Zero();
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const bool cloth = k >= first && k < last;
    gap += c.weight[i] * at(cloth ? x : support_x, c.node[i]);
    if (!cloth) {
      place += c.weight[i] * at(support_x, c.node[i]);
      sum += c.weight[i];
    }
  }
  Touch t;
  t.gap = gap.norm();
  t.area = contact_area(c, node_area);
  if (t.gap >= law.reach || t.gap < 1e-12 || t.area <= 0) return std::nullopt;
  t.normal = gap / t.gap;
  t.place = place / sum;
  t.repulsion = repulsion(law, t.gap);
  return t;
}

/// sum of the weights of the support's nodes times their moves.
Eigen::Vector3d support_move(const Contact& c, const Points3& from, const Points3& to) {
  const auto [first, last] = cloth_nodes(c.kind);
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (k < first || k >= last) move += c.weight[i] * (at(to, c.node[i]) - at(from, c.node[i]));
  }
  return move;
}

}  // namespace

Issues MovingSupport::begin(SupportMotion& motion, const std::optional<mesh::SupportMesh>& support, const std::vector<std::string>& held_by, double duration) {
  Issues issues;
  const std::vector<std::string>& names = motion.bodies();
  const auto known = [](const std::vector<std::string>& list, const std::string& name) { return std::find(list.begin(), list.end(), name) != list.end(); };
  for (const std::string& name : held_by) {
    if (!known(names, name)) issues.push_back(Issue{"unknown_body", {.item = "constraints"}, fmt::format("the motion has no body '{}'", name), suggestion(name, names)});
  }
  const std::vector<std::string> regions = support ? support->region_names : std::vector<std::string>{};
  for (const std::string& name : names) {
    if (known(regions, name) || known(held_by, name)) continue;
    issues.push_back(Issue{"unknown_body", {.item = "body " + name}, "moves, but is no region of the support and holds no cloth",
                           regions.empty() ? "give a support with this region, or leave the body out" : suggestion(name, regions)});
  }
  Result<SupportState> state = motion.start(duration);
  if (!state) append(issues, state.issues());
  if (state && state->shape.rows() > 0 && (!support || state->shape.rows() != support->x.rows())) {
    issues.push_back(Issue{"bad_shape", {.item = "shapes"}, fmt::format("they have {} vertices, the support {}", state->shape.rows(), support ? support->x.rows() : 0), "give shapes of the support's mesh"});
  }
  if (!issues.empty()) return issues;
  motion_ = &motion;
  if (support) {
    drawn_ = support->x;
    body_of_vertex_.assign(static_cast<std::size_t>(drawn_.rows()), -1);
    for (Eigen::Index f = 0; f < support->faces.rows(); ++f) {
      const int region = support->face_region.size() > 0 ? support->face_region[f] : -1;
      if (region < 0) continue;
      const int b = body(support->region_names[static_cast<std::size_t>(region)]);
      for (const int v : support->faces.row(f)) body_of_vertex_[static_cast<std::size_t>(v)] = b;
    }
    // A surface that two bodies share would be torn.
    std::set<std::string> torn;
    for (Eigen::Index f = 0; f < support->faces.rows(); ++f) {
      const int b = body_of_vertex_[static_cast<std::size_t>(support->faces(f, 0))];
      for (int k = 1; k < 3; ++k) {
        if (body_of_vertex_[static_cast<std::size_t>(support->faces(f, k))] == b) continue;
        const int region = support->face_region[f];
        torn.insert(region < 0 ? "(none)" : support->region_names[static_cast<std::size_t>(region)]);
      }
    }
    if (state->shape.rows() == 0) {
      for (const std::string& region : torn) {
        issues.push_back(Issue{"joined_bodies", {.item = "region " + region}, "shares vertices with another body, so that its faces would be torn apart by the motion", "give each moving body a closed surface of its own"});
      }
    }
  }
  first_ = now_ = next_ = std::move(*state);
  x_now_ = x_next_ = positions(now_);
  return issues;
}

int MovingSupport::body(const std::string& name) const {
  if (!motion_) return -1;
  const std::vector<std::string>& names = bodies();
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? -1 : static_cast<int>(it - names.begin());
}

Points3 MovingSupport::positions(const SupportState& state) const {
  if (state.shape.rows() > 0) return state.shape;
  Points3 x = drawn_;
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const int b = body_of_vertex_[static_cast<std::size_t>(v)];
    if (b >= 0) x.row(v) = state.poses[static_cast<std::size_t>(b)](at(drawn_, static_cast<int>(v))).transpose();
  }
  return x;
}

BodyPose MovingSupport::since_beginning(int body, const SupportState& state) const {
  const BodyPose& a = first_.poses[static_cast<std::size_t>(body)];
  const BodyPose& b = state.poses[static_cast<std::size_t>(body)];
  const Eigen::Quaterniond turn = b.rotation * a.rotation.conjugate();
  return {turn, b.shift - turn * a.shift};
}

Issues MovingSupport::advance(double time, double step) {
  Result<SupportState> state = motion_->advance(time, step);
  if (!state) return state.issues();
  next_ = std::move(*state);
  x_next_ = positions(next_);
  return {};
}

Result<SupportMotion::Verdict> MovingSupport::finish(bool accepted, const std::vector<BodyWrench>& wrenches) {
  Result<SupportMotion::Verdict> verdict = motion_->finish(accepted, wrenches);
  if (verdict && accepted && *verdict == SupportMotion::Verdict::holds) {
    now_ = next_;
    x_now_ = x_next_;
  }
  return verdict;
}

int MovingSupport::body_of(const FrictionPair& pair) const {
  for (const int node : pair.support_node) {
    if (node >= 0) return body_of_vertex_[static_cast<std::size_t>(node)];
  }
  return -1;
}

void MovingSupport::carry(std::vector<FrictionPair>& pairs, const Points3& cloth_start) const {
  for (FrictionPair& pair : pairs) {
    pair.support_motion.setZero();
    pair.support_way.setZero();
    if (pair.kind <= contact::Kind::edge_edge) continue;
    if (!rigid()) {
      for (std::size_t k = 0; k < 4; ++k) {
        if (pair.support_node[k] >= 0) pair.support_way += pair.weight[k] * (at(x_next_, pair.support_node[k]) - at(x_now_, pair.support_node[k]));
      }
      continue;
    }
    const int b = body_of(pair);
    if (b < 0) continue;
    // The body's own motion, at the cloth's point: what turns with the body does not slide on it.
    const BodyPose &from = now_.poses[static_cast<std::size_t>(b)], &to = next_.poses[static_cast<std::size_t>(b)];
    const Eigen::Quaterniond turn = to.rotation * from.rotation.conjugate();
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (pair.node[k] < 0) continue;
      place += pair.weight[k] * at(cloth_start, pair.node[k]);
      sum += pair.weight[k];
    }
    if (sum == 0) continue;
    place /= sum;
    const Eigen::Vector3d moved = turn * (place - from.shift) + to.shift;
    pair.support_way = -sum * (moved - place);
    pair.normal = turn * pair.normal;
    pair.slip = turn * pair.slip;
  }
}

void MovingSupport::add_force(int body, const Eigen::Vector3d& place, const Eigen::Vector3d& force, std::vector<BodyWrench>& wrenches) const {
  if (body < 0) return;
  BodyWrench& wrench = wrenches[static_cast<std::size_t>(body)];
  wrench.force += force;
  wrench.torque += (place - next_.poses[static_cast<std::size_t>(body)].shift).cross(force);
}

void MovingSupport::add_contact_force(const Contact& contact, const Eigen::Vector3d& place, const Eigen::Vector3d& force, std::vector<BodyWrench>& wrenches) const {
  if (!rigid()) return;
  const auto [first, last] = cloth_nodes(contact.kind);
  const int node = contact.node[static_cast<std::size_t>(first > 0 ? 0 : last)];
  add_force(body_of_vertex_[static_cast<std::size_t>(node)], place, force, wrenches);
}

void MovingSupport::add_contact_wrenches(std::span<const Contact> contacts, const std::vector<FrictionPair>& friction, const Points3& start, const Points3& x, const Points3& support_x,
                                         const Eigen::VectorXd& node_area, const ContactLaws& laws, std::vector<BodyWrench>& wrenches) const {
  if (!rigid()) return;
  for (const Contact& c : contacts) {
    const std::optional<Touch> t = touch(c, x, support_x, node_area, laws);
    if (!t) continue;
    const auto [first, last] = cloth_nodes(c.kind);
    double sum = 0;
    int node = -1;
    for (int k = 0; k < 4; ++k) {
      if (k >= first && k < last) continue;
      sum += c.weight[static_cast<std::size_t>(k)];
      node = c.node[static_cast<std::size_t>(k)];
    }
    add_force(body_of_vertex_[static_cast<std::size_t>(node)], t->place, t->area * t->repulsion.force * sum * t->normal, wrenches);
  }
  for (const FrictionPair& pair : friction) {
    if (pair.kind <= contact::Kind::edge_edge || pair.limit <= 0) continue;
    double sum = 0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      if (pair.support_node[k] < 0) continue;
      sum += pair.weight[k];
      place += pair.weight[k] * at(support_x, pair.support_node[k]);
    }
    if (sum == 0) continue;
    add_force(body_of(pair), place / sum, -sum * friction_force(pair, start, x), wrenches);
  }
}

SupportPush support_push(std::span<const Contact> contacts, const std::vector<FrictionPair>& friction, double left, const Points3& start, const Points3& x, const Points3& support_x, const Points3& support_end, const Points3& move,
                         const Eigen::VectorXd& node_area, const ContactLaws& laws) {
  SupportPush push;
  push.gradient = Points3::Zero(x.rows(), 3);
  for (const Contact& c : contacts) {
    const std::optional<Touch> t = touch(c, x, support_x, node_area, laws);
    if (!t) continue;
    const double opening = t->normal.dot(support_move(c, support_x, support_end));
    if (opening == 0) continue;
    const auto [first, last] = cloth_nodes(c.kind);
    double own = 0;
    for (int k = first; k < last; ++k) {
      const auto i = static_cast<std::size_t>(k);
      push.gradient.row(c.node[i]) += t->area * t->repulsion.slope * opening * c.weight[i] * t->normal.transpose();
      if (move.rows() > 0) own += c.weight[i] * t->normal.dot(move.row(c.node[i]));
    }
    push.energy += t->area * (-t->repulsion.force * opening + t->repulsion.slope * (own * opening + 0.5 * opening * opening));
  }
  for (const FrictionPair& pair : friction) {
    if (pair.limit <= 0 || left == 0 || pair.kind <= contact::Kind::edge_edge || pair.support_way.isZero()) continue;
    Eigen::Vector3d way = left * pair.support_way;
    way -= pair.normal * pair.normal.dot(way);
    const Eigen::Vector3d force = friction_force(pair, start, x);
    push.energy += force.dot(way);
    if (force.norm() >= pair.limit * (1 - 1e-6)) continue;  // it slides
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      if (pair.node[k] < 0) continue;
      push.gradient.row(pair.node[k]) += pair.stiffness * pair.weight[k] * way.transpose();
      if (move.rows() > 0) own += pair.weight[k] * move.row(pair.node[k]).transpose();
    }
    push.energy += pair.stiffness * (own.dot(way) + 0.5 * way.squaredNorm());
  }
  return push;
}

}  // namespace toile::dynamics
