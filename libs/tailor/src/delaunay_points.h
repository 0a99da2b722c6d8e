// Well-distributed points inside a panel by Delaunay refinement (CGAL), the alternative to the warp/weft grid.
#pragma once

#include "local_mesh.h"

#include "toile/base/result.h"

#include <utility>
#include <vector>

namespace toile::tailor {

struct RefinedPoints {
  struct OnEdge {
    std::size_t edge = 0;  ///< index into walls, then constraints
    double t = 0;          ///< from its first vertex (0) to its second (1)
  };
  std::vector<Point> inner;
  std::vector<OnEdge> on_edges;  ///< by edge, then t
};

/// Points to add so that a constrained Delaunay triangulation has about as many vertices as a grid of unit cells and no
/// angles below 20 degrees but those that the edges enforce. The same input gives the same points.
/// points, walls, constraints  as of triangulate_strip(), each wall once
/// error  "coarse_grid" as of triangulate_strip()
Result<RefinedPoints> refine_delaunay(const std::vector<Point>& points, const std::vector<std::pair<int, int>>& walls, const std::vector<std::pair<int, int>>& constraints);

}  // namespace toile::tailor
