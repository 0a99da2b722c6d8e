// Constrained Delaunay triangulation of the strip between a panel's border and its regular grid.
#pragma once

#include "toile/base/result.h"

#include "local_mesh.h"

#include <utility>
#include <vector>

namespace toile::tailor {

/// points       in cell units; all different
/// walls        vertex pairs; crossing one goes from outside to inside or back. A pair given twice is no wall.
/// constraints  vertex pairs that must be edges without being walls
/// ret          counter-clockwise triangles inside an odd number of walls, in a canonical order
/// error        Issue "coarse_grid" where walls or constraints cross or run through a point
Result<std::vector<Triple>> triangulate_strip(const std::vector<Point>& points, std::vector<std::pair<int, int>> walls,
                                              const std::vector<std::pair<int, int>>& constraints);

}  // namespace toile::tailor
