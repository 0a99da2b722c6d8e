// Curvatures of the cloth as linear forms of the node positions, for sheet.cpp. docs/mechanics.md#bending derives them.
#pragma once

#include "toile/mechanics/sheet.h"

#include <map>
#include <vector>

namespace toile::mechanics {

/// sum of coefficient times node position: node, coefficient. Each node once.
using LinearForm = std::vector<std::pair<int, double>>;

/// Energy weight * rigidity / 2 |form|^2.
struct CurvatureForm {
  enum class Axis { weft, warp, twist };
  LinearForm form;       ///< [1/m2]
  double weight = 0;     ///< rest area that it stands for [m2]
  double rigidity = 0;   ///< D11, D22 or 4 D66 [N m]
  Axis axis = Axis::weft;
  int fabric = 0;        ///< index into Sheet::fabrics
  int vertex = -1, face = -1;  ///< where it belongs: a vertex of the grid, or a face (exactly one, except twist of a cell)
  int sides = 0;         ///< of a vertex: 1 the side of increasing coordinate, 2 the other, 3 both
  std::array<int, 4> normal{};  ///< unless twist: nodes a, b, c, d of the normal (x_a - x_b) x (x_c - x_d)
};

/// What bends beside the linear forms: an edge whose two sides meet at an angle, energy stiffness/2 (angle - rest)^2.
struct BendingForms {
  std::vector<CurvatureForm> curvatures;
  std::vector<HingeElement> hinges;
  std::vector<char> in_cell;    ///< |F|: half of a grid cell along the yarns
};

/// sheet            with corners, shapes, fabrics and directors filled in
/// seam_factor      bending factor of node pairs along closed seams
BendingForms bending_forms(const mesh::GarmentMesh& garment, const Sheet& sheet, const std::map<std::pair<int, int>, double>& seam_factor);

}  // namespace toile::mechanics
