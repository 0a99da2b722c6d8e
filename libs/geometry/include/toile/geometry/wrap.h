// A watertight surface around whatever triangles there are.
#pragma once

#include "toile/geometry/slice.h"

#include <vector>

namespace toile::geometry {

struct Wrap {
  Points3 x;        ///< [m], |V| x 3
  Triangles faces;  ///< outward, closed, without intersections, |F| x 3
  std::vector<int> nearest;  ///< of each face, the triangle (row of the input) that lies nearest to its middle
  double farthest = 0;  ///< of the wrap's vertices from the triangles that it was drawn round [m]
};

/// Alpha wrap (portaneri2022): the surface that is left when a ball carves space from outside and is kept off the triangles. It
/// bridges holes, gaps and overlaps narrower than the ball, and goes into wider ones.
/// x, faces  triangles in any state: open, crossing, turned either way, in pieces; degenerate ones do not count
/// width     diameter of the ball [m] > 0, twice the method's alpha; half of it is about the largest edge of the wrap's faces
/// offset    distance of the wrap's surface from the triangles [m] > 0
/// ret       the same numbers for the same input, at any thread count
Wrap wrap(const Eigen::Ref<const Points3>& x, const Eigen::Ref<const Triangles>& faces, double width, double offset);

}  // namespace toile::geometry
