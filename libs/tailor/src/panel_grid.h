// One panel's particle grid.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/types.h"
#include "toile/pattern/pattern.h"
#include "toile/tailor/mesh_panels.h"

#include <string>
#include <utility>
#include <vector>

namespace toile::tailor {

struct GridSettings {
  double cell_warp = 0.01, cell_weft = 0.01;
  Diagonal diagonal = Diagonal::alternating;
  Mesher mesher = Mesher::grid;
  double turn = 0.6;             ///< of the border from sample to sample [rad]
  double jitter = 0;             ///< [cells]
  std::vector<std::string> cut;  ///< internal lines that are cut
};

struct GridRun {
  std::string name;
  double length = 0;
  bool closed = false, internal = false;
  std::vector<std::pair<int, double>> vertices;  ///< vertex and arc length, in order
  double allowance = 0;    ///< [m]
  bool reflected = false;  ///< see pattern::PanelLine
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
  double area = 0;  ///< inside the true outline, without what is cut out [m2]
};

/// All internal lines of the panel become edges, those of `settings.cut` are cut.
Result<PanelMesh> mesh_panel(const pattern::CutPanel& panel, const GridSettings& settings);

/// The mesh of the same panel turned over: u -> -u, the border's runs go the other way.
PanelMesh mirrored(const PanelMesh& mesh);

}  // namespace toile::tailor
