// Repulsion and Coulomb friction between near pairs, as potentials with gradients and positive second derivatives.
// docs/simulation.md gives the formulas.
#pragma once

#include "toile/contact/search.h"
#include "toile/dynamics/linear_solver.h"

#include <utility>
#include <vector>

namespace toile::dynamics {

using contact::Contact;
using mesh::Points3;

struct ContactLaw {
  double reach = 0;             ///< gap at which repulsion begins [m]
  double stiffness = 0;         ///< pressure per closing of the gap [Pa/m]
  double friction = 0;          ///< Coulomb coefficient [1]
  double friction_stiffness = 1;///< tangential stiffness while sticking, over the normal stiffness [1]
};

struct ContactLaws {
  ContactLaw self, support;
  const ContactLaw& of(contact::Kind kind) const { return kind <= contact::Kind::edge_edge ? self : support; }
};

/// Which entries of Contact::node are cloth nodes: [first, last).
std::pair<int, int> cloth_nodes(contact::Kind kind);

/// Repulsion per area of one gap: quadratic from the reach to half of it, then logarithmic, so that no force closes the gap.
/// Twice continuously differentiable.
struct Repulsion {
  double energy, force, slope;  ///< force = -d(energy)/d(gap) >= 0, slope = second derivative > 0
};
Repulsion repulsion(const ContactLaw& law, double gap);

/// A pair that was touching at the last accepted state: what friction remembers.
struct FrictionPair {
  contact::Kind kind;
  int a = 0, b = 0;
  std::array<int, 4> node;         ///< -1 for nodes of a support
  std::array<double, 4> weight;
  Eigen::Vector3d normal;          ///< unit
  Eigen::Vector3d slip;            ///< elastic tangential displacement [m]
  double limit = 0;                ///< friction coefficient times normal force; infinite: sticks for now [N]
  double stiffness = 0;            ///< [N/m]
  bool fresh = false;              ///< touches since the last balance of forces only
  std::array<int, 4> support_node{-1, -1, -1, -1};                  ///< -1 for nodes of the cloth
  Eigen::Vector3d support_way = Eigen::Vector3d::Zero();            ///< the support's part of the motion in the whole step [m]
  Eigen::Vector3d support_motion = Eigen::Vector3d::Zero();         ///< so far [m]
};

struct ContactSums {
  double energy = 0;    ///< [J]
  int pairs = 0;        ///< closer than the reach
  double least_gap = 0; ///< [m]; the reach where nothing touches
};

/// Area that carries a contact [m2].
double contact_area(const Contact& contact, const Eigen::VectorXd& node_area);

/// Adds the repulsion of all contacts to the gradient and, unless null, its second derivative to `terms`.
ContactSums add_repulsion(const contact::Contacts& contacts, const Points3& x, const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws,
                          Points3& gradient, std::vector<ContactTerm>* terms);

/// Force of a pair for the motion start -> x: its weights times it are added to the gradient [N].
Eigen::Vector3d friction_force(const FrictionPair& pair, const Points3& start, const Points3& x);

/// Adds friction of the remembered pairs for the motion start -> x (minus the support's own). The potential of each pair is
/// quadratic in the elastic slip up to the limit and linear beyond. Returns its energy.
double add_friction(const std::vector<FrictionPair>& pairs, const Points3& start, const Points3& x, Points3& gradient, std::vector<ContactTerm>* terms);

/// What friction remembers after a step: present contacts with their slip carried on from `before` and cut back to the cone.
std::vector<FrictionPair> update_friction(const std::vector<FrictionPair>& before, const Points3& start, const contact::Contacts& contacts, const Points3& x,
                                          const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws);

/// The same in the midst of a step whose end shall not depend on the way that its iterations take there. Motion is measured from the
/// step's beginning, with the slip of that time; a pair that is new holds from where it is at x. Until forces are in balance a pair that
/// stuck when they last were sticks, whatever the iterations do to its forces, even where it comes apart for a while, and the cone of one
/// that slid stays as it was; that of a new one follows x.
/// balanced  forces are in balance at x: cones are those of x, and what is beyond its own begins to slide
std::vector<FrictionPair> follow_friction(const std::vector<FrictionPair>& before, const Points3& start, const contact::Contacts& contacts, const Points3& x,
                                          const Points3& support_x, const Eigen::VectorXd& node_area, const ContactLaws& laws, bool balanced);

}  // namespace toile::dynamics
