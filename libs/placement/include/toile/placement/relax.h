// Isometric relaxation: draws the seams of placed panels together while every edge keeps its length, the cloth stays
// outside the support and no panel goes through another. The support may start flattened (front to back) between the
// panels and swell to its true shape.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/fit_up.h"
#include "toile/placement/flatten.h"

#include <functional>
#include <vector>

namespace toile::placement {

using mesh::Points3;

/// Panels that stay on their side of a vertical plane x = const, below a height (trouser legs between the thighs).
struct Sides {
  std::vector<double> panels;  ///< by panel: +1 or -1, 0: free; or empty
  double x = 0;                ///< of the plane [m]
  double below = 0;            ///< [m]
};

struct RelaxOptions {
  double offset = 0.004;       ///< wanted distance of vertices from the support [m]
  std::vector<double> face_offsets;  ///< by face of the support, or empty: instead of `offset` where the closest point lies on it [m]
  double clearance = 0.0015;   ///< least distance of the middles of edges [m]
  double thickness = 0.001;    ///< wanted distance of panels from one another [m]
  Flattening flattening;       ///< of the support at the start
  int closing_steps = 60;      ///< seams close on the flattened support
  int swelling_steps = 80;     ///< the support takes its true shape
  int settling_steps = 60;     ///< the seams let go
  int polishing_steps = 100;   ///< at most: stretch is taken out until both limits hold
  double max_strain = 0.004;   ///< largest edge strain at which polishing stops [1]
  double rms_strain = 0.0008;  ///< and root mean square [1]
  double seam = 0.05;          ///< part of a seam's gap that one sweep closes
  double closed = 0.02;        ///< a seam that starts with a smaller gap is held firmly: no limb gets through it [m]
  double fasten = 0.3;         ///< part of its gap that one sweep closes at a fastener that starts nearly closed, also while seams let go
  double loose = 0;            ///< so much farther apart than its length it may come then [m]
  bool ironing = false;        ///< bending goes on where polishing finds large strains: creases that should not be there lose themselves
  int substeps = 8;            ///< of a step, between two searches for contacts
  double bending = 0.1;        ///< part of a curvature that one sweep takes out, until polishing
  Points3 rolled;              ///< |V| x 3 or empty: bending up to the curvature there is free [m]
  Sides sides;
  std::vector<double> room_inside, room_outside;  ///< |V| or empty: taken up by layers at a vertex's back and at its face, added to offset and thickness [m]
  std::vector<char> held;      ///< |panels| or empty, non-zero: panels that do not move
  std::vector<Target> targets; ///< vertices drawn to places as seams that start closed are, until they let go
  std::function<void(double)> progress;  ///< called with 0..1 if given
};

/// garment  flat panels (uv, faces, welds); panels are relaxed in parallel
/// x        start [m], |V| x 3
/// ret      positions [m] on the true support; without intersections of the cloth with itself if the start had none
Points3 relax(const mesh::GarmentMesh& garment, const Points3& x, const mesh::SupportMesh& support, const RelaxOptions& options);

struct StrainSummary {
  double largest = 0;  ///< absolute [1]
  double rms = 0;      ///< root mean square [1]
};
/// Of every edge: length over length in the panel, minus 1.
StrainSummary edge_strain(const mesh::GarmentMesh& garment, const Points3& x);

}  // namespace toile::placement
