// One garment at two resolutions: where the particles of one lie in the other, and positions carried over by that
// (docs/tailoring.md, "Several resolutions").
#pragma once

#include <string>
#include <vector>

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

namespace toile::tailor {

/// Where each vertex of one mesh lies in another mesh of the same panels.
struct PanelMap {
  mesh::Ids face;           ///< of the other mesh, |V|
  mesh::Points3 weight;     ///< barycentric coordinates in it, |V| x 3; a vertex outside it has some below 0
  Eigen::VectorXd outside;  ///< how far outside it lies in panel coordinates [m], |V|; 0 for most
};

/// The triangle of `from` that each vertex of `to` lies in, by panel coordinates. Vertices of the border go to the
/// triangle beside the same place of the same named edge, and every other one to a triangle that hangs together with
/// those of its neighbours: so nothing changes sides at a cut or a dart, and what lies beyond the chords of a coarse
/// border belongs to the triangle next to it. to, from  garments of the same pattern; `from` may be finer error Issue
/// "other_pattern" for every panel and edge of `to` that `from` lacks or that has another size
Result<PanelMap> map_panels(const mesh::GarmentMesh& to, const mesh::GarmentMesh& from);

enum class Interpolation {
  linear,  ///< every triangle a plane: exact for linear fields
  smooth,  ///< the mean of that and of the tangents at its corners: exact for quadratic fields
};

/// The positions of `from` at the vertices of `to`, without regard to seams. Tangents come from quadratics through each
/// vertex, fitted to two rings of its panel that no crease (a fold, or an edge bent by more than 60 degrees) parts from
/// it. ret  |V to| x 3 [m]
mesh::Points3 carried(const PanelMap& map, const mesh::GarmentMesh& to, const mesh::GarmentMesh& from,
                      Interpolation interpolation);

struct EdgeStrain {
  double rms = 0;                                 ///< each edge as often as it has faces
  double longest = 0, shortest = 0;               ///< length in space over that in the panel, minus 1
  int longest_vertex = -1, shortest_vertex = -1;  ///< an end of that edge
};
/// Precondition: edges have lengths in the panel.
EdgeStrain edge_strain(const mesh::GarmentMesh& garment);

struct Refined {
  mesh::GarmentMesh garment;
  PanelMap map;
  int outside = 0;      ///< vertices beyond the coarse border
  double farthest = 0;  ///< the farthest of them [m]
  int farthest_vertex = -1;
  int joined = 0;                 ///< particles whose sides were brought together
  double widest_join = 0;         ///< farthest that a vertex moved for that [m]
  int open_seams = 0;             ///< seams that are open in the coarse garment, and stay so
  std::vector<char> seam_closed;  ///< by seam of the garment
};

/// The fine garment with positions from the coarse one. Seams that are closed in the coarse garment (to 1e-6 m) are
/// closed: their vertices go to the mean of what their panels say. Velocities are dropped. error  those of map_panels
Result<Refined> refine(const mesh::GarmentMesh& fine, const mesh::GarmentMesh& coarse, Interpolation interpolation);

/// The particles of a garment of which only the seams count that are closed.
/// ret  |V|, ids dense, ordered by the lowest vertex
mesh::Ids closed_particles(const mesh::GarmentMesh& garment, const std::vector<char>& seam_closed);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::Interpolation> {
  static constexpr std::array names{std::pair{"linear", toile::tailor::Interpolation::linear},
                                    std::pair{"smooth", toile::tailor::Interpolation::smooth}};
};
