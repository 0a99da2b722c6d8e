// Contacts of cloth with itself and with a support: what is near (proximity) and how far a step may go (limit_step).
// Method, guarantee and limits: docs/contact.md.
#pragma once

#include "toile/contact/surface.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace toile::contact {

enum class Kind : std::uint8_t {
  vertex_face,          ///< cloth vertex node[0], cloth face node[1..3]
  edge_edge,            ///< cloth edge node[0..1], cloth edge node[2..3]
  vertex_support_face,  ///< cloth vertex node[0], support face node[1..3]
  support_vertex_face,  ///< support vertex node[0], cloth face node[1..3]
  edge_support_edge,    ///< cloth edge node[0..1], support edge node[2..3]
};
/// Number of leading entries of Contact::node that belong to the first primitive (1 or 2).
constexpr int first_count(Kind kind) { return kind == Kind::edge_edge || kind == Kind::edge_support_edge ? 2 : 1; }

/// Two primitives that are near. The gap vector is sum_k weight[k] * position(node[k]); it points from the second
/// primitive's closest point to the first's, its length is `distance` (never 0 for a clean state; then use it as the
/// normal). For small motions with fixed weights this is the linearised gap, and d(distance)/d(node k) = weight[k] * normal.
struct Contact {
  std::array<int, 4> node;       ///< cloth or support node ids as `kind` says
  std::array<double, 4> weight;  ///< first primitive's sum to 1, second's to -1; zeros where the closest point is on a feature
  double distance = 0;           ///< [m]
  int a = 0, b = 0;              ///< primitive ids: vertex = node id, edge and face = index in the Surface
  Kind kind = Kind::vertex_face;
  /// 1 where both surfaces are locally convex towards each other at the contact; falls to 0 where a neighbouring face
  /// already carries it (edge pairs inside a smooth region that vertex-face contacts resolve). Always 1 for vertex-face
  /// kinds. A smooth factor for stiffness.
  double share = 1;
};

/// Contacts ordered by (kind, a, b), the same at any thread count. How double counting is avoided:
///  - vertex-face kinds: of the faces near a vertex that hang together (share a node) and are seen in about the same
///    direction (within 60 degrees) only the nearest is kept (lowest id on ties): a vertex over a smooth sheet has one
///    contact per layer, a vertex in a sharp valley one per wall;
///  - edge-edge kinds: only pairs whose closest points are inside both edges (others are vertex-face contacts).
struct Contacts {
  std::span<const Contact> self;     ///< vertex_face, edge_edge
  std::span<const Contact> support;  ///< the three support kinds
};

struct Radii {
  double self = 0;     ///< report cloth-cloth pairs nearer than this [m]; 0: none
  double support = 0;  ///< report cloth-support pairs nearer than this [m]; 0: none
};

struct LimitOptions {
  /// Pairs that start at twice this distance or more never come nearer than it [m]; pairs that start nearer lose at most
  /// half of their distance, and nothing (1e-12 m) below a fiftieth of it. Must be well above rounding: at least 1e-6 m.
  double self_separation = 5e-5;
  double support_separation = 5e-5;
  double rewind = 0.9;  ///< nodes of an impact keep this part of the time of impact, in (0, 1)
  int rounds = 12;      ///< of local rewinding before the remaining pairs fall back to half their distance
  /// Nodes (|cloth nodes|, non-zero = exempt) whose pairs are not tested while a start is being untangled: a cloth-cloth
  /// pair is left out when both primitives have an exempt node, a cloth-support pair when its cloth primitive has one.
  /// No guarantee holds for what is left out. Empty: none.
  std::span<const std::uint8_t> self_exempt;
  std::span<const std::uint8_t> support_exempt;
};

struct StepLimit {
  Points3 x;                     ///< admissible end positions, |nodes| x 3; bitwise x1 where nothing was limited
  std::vector<double> fraction;  ///< of the displacement that each node keeps, |nodes|, in [0, 1]
  double support_fraction = 1;   ///< of the support's motion; below 1 the support must stop there (see limit_step)
  double least_fraction = 1;     ///< smallest of `fraction`
  int limited_nodes = 0;
  int limited_pairs = 0;         ///< pairs with an impact in x0 -> x1, before anything was rewound
  int rounds = 0;
  int fallback_pairs = 0;        ///< pairs that ended with the bound of half their distance
  int touching_pairs = 0;        ///< pairs at (numerically) zero distance in x0: the precondition was broken there
};

/// Search structures and scratch memory for one cloth and one optional support. Results are pure functions of the
/// arguments (what is cached between calls only saves time), independent of the thread count; nothing is allocated once
/// sizes have settled. Spans and references stay valid until the next call of the same function.
class Search {
 public:
  /// x, support_x  positions from which the hierarchies are laid out (any sensible state) [m]
  Search(Surface cloth, const Points3& x);
  Search(Surface cloth, const Points3& x, Surface support, const Points3& support_x);
  ~Search();
  Search(Search&&) noexcept;
  Search& operator=(Search&&) noexcept;

  const Surface& cloth() const;
  const Surface& support() const;  ///< empty where there is none

  /// All pairs nearer than the radii at positions x [m]. Pass the support's positions at the same instant (ignored
  /// without a support; a still support costs nothing).
  Contacts proximity(const Points3& x, const Points3& support_x, Radii radii);

  /// End positions reachable from x0 towards x1 without any pair of primitives touching on the straight ways
  /// x0 -> x: pairs with an impact are found by continuous detection, only their nodes are rewound, and pairs of the
  /// changed nodes are tested again until no pair impacts.
  /// precondition  x0 without intersections (then x is without intersections too: the guarantee)
  /// A support that moves during the step (support_x0 != support_x1) is not free: where cloth cannot get out of its way
  /// the support's whole motion is cut to `support_fraction`; the caller ends the step there.
  const StepLimit& limit_step(const Points3& x0, const Points3& x1, const Points3& support_x0, const Points3& support_x1,
                              const LimitOptions& options = {});

  /// One fraction for all nodes: the largest (conservative) part of x0 -> x1 without impact, in [0, 1].
  double step_fraction(const Points3& x0, const Points3& x1, const Points3& support_x0, const Points3& support_x1,
                       const LimitOptions& options = {});

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile::contact
