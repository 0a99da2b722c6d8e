// One panel's particle grid.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/types.h"
#include "toile/pattern/pattern.h"

#include <string>
#include <utility>
#include <vector>

namespace toile::tailor {

struct GridSettings {
  double cell_warp = 0.01, cell_weft = 0.01;
  bool alternating = true;
  std::vector<std::string> lines;  ///< internal lines that become edges
};

struct GridRun {
  std::string name;
  double length = 0;
  bool closed = false, internal = false;
  std::vector<std::pair<int, double>> vertices;  ///< vertex and arc length, in order
  double allowance = 0;  ///< [m]
};

struct GridPoint {
  std::string name;
  int vertex = 0;
};

struct PanelMesh {
  mesh::Points2 uv;
  mesh::Triangles faces;
  std::vector<GridRun> runs;
  std::vector<GridPoint> points;
};

Result<PanelMesh> mesh_panel(const pattern::CutPanel& panel, const GridSettings& settings);

/// The mesh of the same panel turned over: u -> -u, runs the other way.
PanelMesh mirrored(const PanelMesh& mesh);

}  // namespace toile::tailor
