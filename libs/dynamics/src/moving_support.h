// Supports in motion, as the simulation needs them: where every vertex of the support goes in a step, what that does to contacts and friction,
// and what the cloth does to the bodies.
#pragma once

#include "toile/dynamics/contact_force.h"
#include "toile/dynamics/support_motion.h"
#include "toile/mesh/support_mesh.h"

#include <optional>
#include <span>

namespace toile::dynamics {

class MovingSupport {
 public:
  MovingSupport() = default;
  /// support  drawn position and regions; may be missing, then bodies only hold cloth
  /// held_by  bodies that constraints name
  /// error    "unknown_body" for a body of a constraint that the motion does not have, or of the motion that is neither region nor named; "bad_shape"
  Issues begin(SupportMotion& motion, const std::optional<mesh::SupportMesh>& support, const std::vector<std::string>& held_by, double duration);

  bool moves() const { return motion_ != nullptr; }
  const std::vector<std::string>& bodies() const { return motion_->bodies(); }
  /// -1 where there is none.
  int body(const std::string& name) const;
  const Points3& start() const { return x_now_; }   ///< of the step [m]
  const Points3& end() const { return x_next_; }    ///< [m]
  const SupportState& now() const { return now_; }
  const SupportState& next() const { return next_; }
  bool rigid() const { return next_.shape.rows() == 0; }
  /// How a body has moved since the beginning, at the end of the step.
  BodyPose since_beginning(int body, const SupportState& state) const;

  /// Asks for the end of a step.
  Issues advance(double time, double step);
  /// The step is over: where it is accepted and the source holds to it, its end is where the next begins.
  Result<SupportMotion::Verdict> finish(bool accepted, const std::vector<BodyWrench>& wrenches);

  /// Friction's memory at the beginning of the step, turned with the bodies, with the way that the support takes from under each pair.
  void carry(std::vector<FrictionPair>& pairs, const Points3& cloth_start) const;
  /// What contacts and friction of the support do to the bodies.
  /// gradients of contacts are those of add_repulsion; friction those of add_friction for start -> x
  void add_contact_wrenches(std::span<const Contact> contacts, const std::vector<FrictionPair>& friction, const Points3& start, const Points3& x, const Points3& support_x,
                            const Eigen::VectorXd& node_area, const ContactLaws& laws, std::vector<BodyWrench>& wrenches) const;
  /// A force [N] on the body that a contact of the support touches, at a point of it [m].
  void add_contact_force(const Contact& contact, const Eigen::Vector3d& at, const Eigen::Vector3d& force, std::vector<BodyWrench>& wrenches) const;
  /// A force [N] that acts on a body at a point [m].
  void add_force(int body, const Eigen::Vector3d& at, const Eigen::Vector3d& force, std::vector<BodyWrench>& wrenches) const;

 private:
  Points3 positions(const SupportState& state) const;
  int body_of(const FrictionPair& pair) const;

  SupportMotion* motion_ = nullptr;
  Points3 drawn_;
  std::vector<int> body_of_vertex_;
  SupportState first_, now_, next_;
  Points3 x_now_, x_next_;
};

/// What a move of the support (end - support_x) adds to the gradient on the cloth, contact by contact as they are, and to the energy. Pairs that stick
/// stick on.
/// friction   pairs with the support; `left` is the part of their support_way that is still to go
/// move       of the cloth, for the energy; empty: none
struct SupportPush {
  Points3 gradient;   ///< [N], |nodes| x 3
  double energy = 0;  ///< [J]
};
SupportPush support_push(std::span<const Contact> contacts, const std::vector<FrictionPair>& friction, double left, const Points3& start, const Points3& x, const Points3& support_x, const Points3& support_end, const Points3& move,
                         const Eigen::VectorXd& node_area, const ContactLaws& laws);

}  // namespace toile::dynamics
