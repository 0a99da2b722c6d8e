// The lines of a panel that its mesh follows, and the particles in which they meet.
#pragma once

#include "local_mesh.h"

#include "toile/base/result.h"
#include "toile/pattern/pattern.h"

#include <string>
#include <utility>
#include <vector>

namespace toile::tailor {

struct NetworkLine {
  pattern::Curve curve;
  std::string name;
  bool internal = false;
  bool reflected = false;  ///< of internal lines: see pattern::PanelLine
  double allowance = 0;
  /// Arc length and node of what must be a vertex, ascending; begins with 0, ends with the length.
  std::vector<std::pair<double, int>> nodes;
};

struct LineNetwork {
  std::vector<NetworkLine> lines;       ///< edges of the outline, of holes, internal lines
  std::size_t border_lines = 0;
  std::vector<std::vector<int>> loops;  ///< border lines of the outline and of each hole, in order
  std::vector<Point> nodes;             ///< (u, v) [m]
  std::vector<std::pair<std::string, int>> points;  ///< named points, notches and marks with their nodes
};

/// Where a panel's edges and internal lines (all of them) have their ends, corners and named points, and where they cross,
/// touch or end on each other: there they share a node.
/// corner  a line has a node where it turns at once by more than this [rad]
/// error   "line_along_line" where two run on each other, "cut_crosses" where holes do not lie apart
Result<LineNetwork> line_network(const pattern::CutPanel& panel, double corner);

/// The panel without the parts of its lines that lie in holes. A line of which one part is left keeps its name, of more parts
/// they are called `line_1`, `line_2`, ... in its direction.
/// error  as line_network()
Result<pattern::CutPanel> clip_lines(const pattern::CutPanel& panel, double corner);

}  // namespace toile::tailor
