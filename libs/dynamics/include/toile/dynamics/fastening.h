// Buttons, hooks, snaps and zips while cloth drapes: drawn together, then held at the length of their shank.
#pragma once

#include "toile/mechanics/particle.h"
#include "toile/mechanics/sheet.h"
#include "toile/mesh/garment_mesh.h"

#include <string>
#include <vector>

namespace toile::dynamics {

using mesh::Points3;

struct FasteningOptions {
  int steps = 20;           ///< in which the halves are drawn together
  double pull = 5;          ///< the halves are drawn together with so much at most [N]
  double tolerance = 1e-4;  ///< a held pair is off its length by less [m]
  double near = 5e-4;       ///< a pair that comes so near to its length is closed [m]
  double thickness = 0;     ///< cloth does not let halves nearer than this [m]
  int patience = 40;        ///< steps at full pull without coming nearer, after which a pair is given up
};

/// How a button, hook, snap or a zip came out: of a zip or a row the tooth that is farthest open.
struct ClosureState {
  std::string name, kind;
  int halves = 0, closed = 0;  ///< pairs that are to be closed; that are
  double gap = 0;              ///< of the widest pair [m]
  double length = 0;           ///< at which that one is held [m]
  double force = 0;            ///< greatest with which a pair is held [N]
  int turned = 0;              ///< buttons whose second half lies under the first
};

/// Draws the halves of fasteners together along the line between them, with a target that shrinks from their distance to their
/// length and a pull that stays within a limit; a pair that has come near is held at its length at most: by its spring, or exactly, by a
/// force that is carried on from step to step (augmented Lagrangian). One with a capture waits until its halves are so near.
class Fastening {
 public:
  Fastening() = default;
  /// x  positions of vertices, |V| x 3
  Fastening(const mesh::GarmentMesh& garment, const Points3& x, const FasteningOptions& options);

  /// A step has ended at x: targets shrink, forces are carried on. True when a spring is another one now.
  bool advance(const Points3& x);
  bool empty() const { return pairs_.empty(); }
  /// Everything that does not wait is held at its length from now on, wherever it is.
  void hold();
  void apply(mechanics::Sheet& sheet) const;
  void apply(mechanics::ParticleModel& model) const;

  /// Nothing is on its way: each pair is closed and at its length, waits beyond its capture, or has been given up.
  bool settled() const;
  std::vector<ClosureState> states(const mesh::GarmentMesh& garment, const Points3& x) const;

 private:
  enum class Phase { open, waiting, closing, given_up, closed };
  struct Pair {
    Phase phase = Phase::open;
    double length = 0;     // at which it is held [m]
    double stiffness = 0;  // [N/m]
    bool exact = false;
    double target = 0;     // of the closing [m]
    double shrink = 0;     // of the target in a step [m]
    double rest = 0;       // of the spring now [m]
    double spring = 0;     // its stiffness now [N/m]
    double force = 0;      // carried on [N]
    double gap = 0;        // at the last step [m]
    double nearest = 0;
    int tried = 0;
  };
  void set_rest(Pair& pair) const;
  std::vector<Pair> pairs_;
  std::vector<std::array<int, 2>> vertex_;
  std::vector<double> capture_;
  FasteningOptions options_;
};

}  // namespace toile::dynamics
