// Fold lines of panels (break line of a lapel, roll line of a collar, turned up hem, pleat): panels folded flat, before they
// are bent around the support.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <Eigen/Core>
#include <vector>

namespace toile::placement {

using mesh::Points2;

/// A fold that turns the cloth over: from 60 degrees.
struct FoldLine {
  int fold = 0;               ///< index into garment.folds
  int panel = 0;
  double angle = 0;           ///< over the whole fold, positive: towards the face side [rad]
  std::vector<int> vertices;  ///< in order along it
};

/// The lines that folds run along; of a fold that names none, the internal line that its hinges follow over at least half its
/// length, or else the edges of its hinges inside one panel (of several rows the middle one).
std::vector<FoldLine> fold_lines(const mesh::GarmentMesh& garment);

/// Part of every face when panels are cut along fold lines, |F|; parts are numbered by their lowest face.
std::vector<int> parts_between(const mesh::GarmentMesh& garment, const std::vector<FoldLine>& lines);

/// Folds that no length-keeping placement can turn: their line curves round the part that turns, whose far edge would have to
/// be longer than it is (an undercollar before it is stretched to shape). Indices into garment.folds, increasing.
/// A strip cannot be folded back on the outside of such a line: the sheets on both sides meet its osculating plane at
/// one angle, so the turned one would have to go through the other.
std::vector<int> stuck_folds(const mesh::GarmentMesh& garment);

/// The garment with these folds flat (their hinges taken away, their angles 0), and with hinges along the whole line of the
/// others.
mesh::GarmentMesh without_folds(const mesh::GarmentMesh& garment, const std::vector<int>& folds);

struct FoldedFlat {
  Points2 uv;               ///< panel coordinates after folding [m], |V| x 2
  std::vector<double> layer;  ///< sheets between the vertex and its panel's main part, positive on the face side; |V|
  double greatest(int panel, const mesh::GarmentMesh& garment) const;
  double least(int panel, const mesh::GarmentMesh& garment) const;
};

/// Every panel folded flat along its fold lines; its main part (the one with the longest seams, then the largest) stays. A
/// straight fold is exact; over a curved one each point goes to its mirror image in the nearest point of the line.
FoldedFlat fold_flat(const mesh::GarmentMesh& garment);

}  // namespace toile::placement
