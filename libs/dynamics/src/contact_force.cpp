#include "toile/dynamics/contact_force.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace toile::dynamics {
namespace {

Eigen::Vector3d gap_vector(const Contact& c, const Points3& x, const Points3& support_x) {
  const auto [first, last] = cloth_nodes(c.kind);
  Eigen::Vector3d gap = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Points3& source = k >= first && k < last ? x : support_x;
    gap += c.weight[i] * source.row(c.node[i]).transpose();
  }
  return gap;
}

template <class Body>
void for_each(const contact::Contacts& contacts, const Body& body) {
  for (const Contact& c : contacts.self) body(c);
  for (const Contact& c : contacts.support) body(c);
}

void add_term(const std::array<int, 4>& node, const std::array<double, 4>& weight, const Eigen::Matrix3d& block, std::vector<ContactTerm>& terms) {
  ContactTerm term;
  for (std::size_t k = 0; k < 4; ++k) {
    term.node[k] = node[k] >= 0 && weight[k] != 0 ? node[k] : -1;
    term.weight[k] = static_cast<float>(weight[k]);
  }
  term.block = Block::from(block);
  terms.push_back(term);
}

std::array<int, 4> cloth_only(const Contact& c) {
  const auto [first, last] = cloth_nodes(c.kind);
  std::array<int, 4> node{-1, -1, -1, -1};
  for (int k = first; k < last; ++k) node[static_cast<std::size_t>(k)] = c.node[static_cast<std::size_t>(k)];
  return node;
}

Eigen::Vector3d relative_motion(const FrictionPair& pair, const Points3& start, const Points3& x) {
  Eigen::Vector3d motion = pair.support_motion;
  for (std::size_t k = 0; k < 4; ++k) {
    if (pair.node[k] >= 0) motion += pair.weight[k] * (x.row(pair.node[k]) - start.row(pair.node[k])).transpose();
  }
  return motion;
}

bool same_key(const FrictionPair& p, const Contact& c) { return p.kind == c.kind && p.a == c.a && p.b == c.b; }

}  // namespace

using contact::Kind;

std::pair<int, int> cloth_nodes(Kind kind) {
  switch (kind) {
    case Kind::vertex_face:
    case Kind::edge_edge: return {0, 4};
    case Kind::vertex_support_face: return {0, 1};
    case Kind::support_vertex_face: return {1, 4};
    case Kind::edge_support_edge: return {0, 2};
  }
  return {0, 0};
}

Repulsion repulsion(const ContactLaw& law, double gap) {
  if (gap >= law.reach) return {0, 0, 0};
  const double knee = 0.5 * law.reach, k = law.stiffness;
  if (gap >= knee) {
    const double closed = law.reach - gap;
    return {0.5 * k * closed * closed, k * closed, k};
  }
  const double d = std::max(gap, 1e-9), strength = k * knee * knee;
  return {0.5 * k * knee * knee + strength * std::log(knee / d), strength / d, strength / (d * d)};
}

double contact_area(const Contact& c, const Eigen::VectorXd& node_area) {
  if (c.kind == Kind::vertex_face || c.kind == Kind::vertex_support_face) return node_area[c.node[0]];
  const auto [first, last] = cloth_nodes(c.kind);
  double sum = 0;
  for (int k = first; k < last; ++k) sum += node_area[c.node[static_cast<std::size_t>(k)]];
  return c.share * sum / (last - first);
}

ContactSums add_repulsion(const contact::Contacts& contacts, const Points3& x, const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws,
                          Points3& gradient, std::vector<ContactTerm>* terms) {
  ContactSums sums;
  sums.least_gap = std::max(laws.self.reach, laws.support.reach);
  for_each(contacts, [&](const Contact& c) {
    const ContactLaw& law = laws.of(c.kind);
    if (c.distance >= law.reach) return;
    const Eigen::Vector3d gap = gap_vector(c, x, support_x);
    const double distance = gap.norm();
    sums.least_gap = std::min(sums.least_gap, distance);
    if (distance >= law.reach || distance < 1e-12) return;
    const double area = contact_area(c, node_area);
    if (area <= 0) return;
    const Repulsion r = repulsion(law, distance);
    ++sums.pairs;
    sums.energy += area * r.energy;
    const Eigen::Vector3d normal = gap / distance;
    const std::array<int, 4> node = cloth_only(c);
    for (std::size_t k = 0; k < 4; ++k) {
      if (node[k] >= 0) gradient.row(node[k]) -= area * r.force * c.weight[k] * normal.transpose();
    }
    if (terms) add_term(node, c.weight, area * r.slope * normal * normal.transpose(), *terms);
  });
  return sums;
}

Eigen::Vector3d friction_force(const FrictionPair& pair, const Points3& start, const Points3& x) {
  if (pair.limit <= 0) return Eigen::Vector3d::Zero();
  const Eigen::Matrix3d tangent = Eigen::Matrix3d::Identity() - pair.normal * pair.normal.transpose();
  const Eigen::Vector3d slip = pair.slip + tangent * relative_motion(pair, start, x);
  const double length = slip.norm();
  return length * pair.stiffness < pair.limit ? Eigen::Vector3d(pair.stiffness * slip) : Eigen::Vector3d(pair.limit / length * slip);
}

double add_friction(const std::vector<FrictionPair>& pairs, const Points3& start, const Points3& x, Points3& gradient, std::vector<ContactTerm>* terms) {
  double energy = 0;
  for (const FrictionPair& pair : pairs) {
    if (pair.limit <= 0) continue;
    const Eigen::Matrix3d tangent = Eigen::Matrix3d::Identity() - pair.normal * pair.normal.transpose();
    const Eigen::Vector3d slip = pair.slip + tangent * relative_motion(pair, start, x);
    const double length = slip.norm(), elastic = pair.limit / pair.stiffness;
    Eigen::Vector3d force;
    Eigen::Matrix3d block;
    if (length < elastic * (1 - 1e-6)) {
      energy += 0.5 * pair.stiffness * length * length;
      force = pair.stiffness * slip;
      block = pair.stiffness * tangent;
    } else {
      // At the cone itself the sliding branch: a pair that slides would otherwise be held by its sticking stiffness at the
      // beginning of every step.
      energy += pair.limit * (length - 0.5 * elastic);
      const Eigen::Vector3d along = slip / length;
      force = pair.limit * along;
      block = pair.limit / length * (tangent - along * along.transpose());
    }
    for (std::size_t k = 0; k < 4; ++k) {
      if (pair.node[k] >= 0) gradient.row(pair.node[k]) += pair.weight[k] * force.transpose();
    }
    if (terms) add_term(pair.node, pair.weight, block, *terms);
  }
  return energy;
}

namespace {

/// How a pair goes on: in a step that is over, or within one, where motion is measured from its beginning.
enum class Follow { over, held, balanced };

std::vector<FrictionPair> present_pairs(Follow way, const std::vector<FrictionPair>& before, const Points3& start, const contact::Contacts& contacts, const Points3& x,
                                        const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws) {
  std::vector<FrictionPair> after;
  std::vector<char> used(before.size(), 0);
  std::vector<std::size_t> fresh;
  const auto carry = [&](const FrictionPair& old, FrictionPair& pair) {
    if (way != Follow::over) {
      pair.slip = old.slip - pair.normal * pair.normal.dot(old.slip);
      pair.fresh = way == Follow::held && old.fresh;
      if (way == Follow::held && !old.fresh) pair.limit = old.limit;
      return;
    }
    const Eigen::Matrix3d old_tangent = Eigen::Matrix3d::Identity() - old.normal * old.normal.transpose();
    Eigen::Vector3d slip = old.slip + old_tangent * relative_motion(old, start, x);
    slip -= pair.normal * pair.normal.dot(slip);
    const double elastic = pair.limit / pair.stiffness, length = slip.norm();
    pair.slip = length > elastic ? Eigen::Vector3d(slip * (elastic / length)) : slip;
  };
  std::size_t cursor = 0;
  for_each(contacts, [&](const Contact& c) {
    const ContactLaw& law = laws.of(c.kind);
    if (c.distance >= law.reach || law.friction <= 0) return;
    const Eigen::Vector3d gap = gap_vector(c, x, support_x);
    const double distance = gap.norm();
    const double area = contact_area(c, node_area);
    if (distance >= law.reach || distance < 1e-12 || area <= 0) return;
    FrictionPair pair;
    pair.kind = c.kind;
    pair.a = c.a;
    pair.b = c.b;
    pair.node = cloth_only(c);
    if (c.kind > Kind::edge_edge) {
      for (std::size_t k = 0; k < 4; ++k) pair.support_node[k] = pair.node[k] >= 0 ? -1 : c.node[k];
    }
    pair.weight = c.weight;
    pair.normal = gap / distance;
    pair.slip = Eigen::Vector3d::Zero();
    pair.limit = law.friction * area * repulsion(law, distance).force;
    pair.stiffness = law.friction_stiffness * law.stiffness * area;
    // Both lists are ordered by (kind, a, b).
    while (cursor < before.size() && std::tie(before[cursor].kind, before[cursor].a, before[cursor].b) < std::tie(c.kind, c.a, c.b)) ++cursor;
    if (cursor < before.size() && same_key(before[cursor], c)) {
      carry(before[cursor], pair);
      used[cursor] = 1;
    } else {
      fresh.push_back(after.size());
    }
    after.push_back(pair);
  });
  // A vertex that slid on to the next face keeps its slip.
  for (std::size_t i : fresh) {
    FrictionPair& pair = after[i];
    if (way != Follow::over) {
      // It begins to hold where it is now.
      const Eigen::Vector3d moved = relative_motion(pair, start, x);
      pair.slip = pair.normal * pair.normal.dot(moved) - moved;
      pair.fresh = way == Follow::held;
    }
    if (pair.kind == Kind::edge_edge || pair.kind == Kind::edge_support_edge) continue;
    const auto begin = std::lower_bound(before.begin(), before.end(), pair, [](const FrictionPair& p, const FrictionPair& q) { return std::tie(p.kind, p.a) < std::tie(q.kind, q.a); });
    for (auto it = begin; it != before.end() && it->kind == pair.kind && it->a == pair.a; ++it) {
      const auto j = static_cast<std::size_t>(it - before.begin());
      if (used[j] || it->normal.dot(pair.normal) < 0.7) continue;
      used[j] = 1;
      carry(*it, pair);
      break;
    }
  }
  if (way == Follow::balanced) {
    for (FrictionPair& pair : after) {
      const Eigen::Vector3d moved = relative_motion(pair, start, x);
      const Eigen::Vector3d slip = pair.slip + moved - pair.normal * pair.normal.dot(moved);
      if (pair.stiffness * slip.norm() < pair.limit * (1 - 1e-6)) pair.limit = std::numeric_limits<double>::infinity();
    }
  }
  if (way != Follow::over) {
    // A pair that has come apart may touch again before the step ends. It goes on holding until the next balance.
    const std::size_t touching = after.size();
    for (std::size_t j = 0; j < before.size(); ++j) {
      if (used[j]) continue;
      after.push_back(before[j]);
      if (way == Follow::held && !before[j].fresh) continue;
      after.back().limit = 0;
      after.back().fresh = true;
    }
    std::inplace_merge(after.begin(), after.begin() + static_cast<std::ptrdiff_t>(touching), after.end(), [](const FrictionPair& p, const FrictionPair& q) { return std::tie(p.kind, p.a, p.b) < std::tie(q.kind, q.a, q.b); });
  }
  return after;
}

}  // namespace

std::vector<FrictionPair> update_friction(const std::vector<FrictionPair>& before, const Points3& start, const contact::Contacts& contacts, const Points3& x,
                                          const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws) {
  return present_pairs(Follow::over, before, start, contacts, x, support_x, node_area, laws);
}

std::vector<FrictionPair> follow_friction(const std::vector<FrictionPair>& before, const Points3& start, const contact::Contacts& contacts, const Points3& x,
                                          const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws, bool balanced) {
  return present_pairs(balanced ? Follow::balanced : Follow::held, before, start, contacts, x, support_x, node_area, laws);
}

}  // namespace toile::dynamics
