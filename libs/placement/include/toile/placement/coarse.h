// A coarser mesh of the same flat garment, its vertices a part of the fine mesh's, seams kept: the relaxation moves the
// large folds there, where they are cheap, and carries them over.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <array>
#include <vector>

namespace toile::placement {

using mesh::Points3;

struct CoarseGarment {
  mesh::GarmentMesh mesh;       ///< uv, faces, panels, welds and seams only
  std::vector<int> fine_of;     ///< fine vertex of every coarse vertex
  struct Weights {
    std::array<int, 3> vertex;  ///< coarse vertices
    std::array<double, 3> weight;  ///< sum to 1; slightly outside [0, 1] where a curved border bulges
  };
  std::vector<Weights> of_fine;  ///< for every fine vertex
  /// Coarse positions on all fine vertices: flat coarse triangles stay flat, so an isometric coarse state gives an
  /// isometric fine one but for the folds between triangles.
  Points3 prolonged(const Points3& coarse) const;
  Points3 restricted(const Points3& fine) const;
  std::vector<double> restricted(const std::vector<double>& fine) const;  ///< empty stays empty
};

/// size  wanted edge length [m]
CoarseGarment coarsen(const mesh::GarmentMesh& garment, double size);

}  // namespace toile::placement
