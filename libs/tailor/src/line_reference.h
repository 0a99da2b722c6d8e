// Edges, parts of edges and places on them, as specs call them: `panel.edge`, `panel.edge(from..to)`, `panel.edge(place)`,
// `panel.point`. A place is a named point of the edge, a length from its start (`120 mm`; negative: before its end), or a
// percentage of its length (`25 %`).
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// A place on a run.
struct RunPlace {
  double s = 0;     ///< along the true curve [m]
  int vertex = -1;  ///< of a named point; -1: given by its length
};

/// A stretch of a run, from < to in the run's own direction.
struct RunPart {
  int run = 0;
  RunPlace from, to;
  bool reversed = false;  ///< used from `to` to `from`
  double length() const { return to.s - from.s; }
};

/// Resolves `[-]panel.edge` and `[-]panel.edge(from..to)`; either end of a range may be empty. A range of a closed run may
/// pass over its start and has two parts then. Parts stand in the direction of use.
/// error  "bad_reference", "unknown_panel", "unknown_edge", "unknown_point", "bad_range", and those of quantities
Result<std::vector<RunPart>> find_parts(const mesh::GarmentMesh& garment, const std::string& text);

/// A place named on its own: a point of a panel, or a place on one of its runs.
struct PanelPlace {
  int run = -1;     ///< -1: any run that the vertex is on
  double s = 0;     ///< where a run is given [m]
  int vertex = -1;
};

/// Resolves `panel.point` and `panel.edge(place)`.
/// error  as find_parts()
Result<PanelPlace> find_place(const mesh::GarmentMesh& garment, const std::string& text);

/// The vertices of a part in the direction of use, of a garment whose runs have vertices at its ends (within `within` [m]).
/// ret  at least two vertices; empty if there is none at an end
std::vector<int> part_vertices(const mesh::GarmentMesh& garment, const RunPart& part, double within = 1e-3);

/// "front.side", or "front.side from 12.0 to 84.5 mm" where the part is not the whole run.
std::string part_text(const mesh::GarmentMesh& garment, const RunPart& part);

}  // namespace toile::tailor
