// Parts of panels that a bonded layer covers. Private to the library.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace toile::tailor {

/// A closed outline as segments in any order; what is inside follows the even-odd rule. Points on the outline count to one
/// side or the other, the same everywhere.
class Outline {
 public:
  explicit Outline(std::vector<std::array<Eigen::Vector2d, 2>> segments);
  bool contains(const Eigen::Vector2d& point) const;

 private:
  std::vector<std::array<Eigen::Vector2d, 2>> segments_;
  // Segments by level in v, so that a question concerns only those beside the point.
  double low_ = 0, step_ = 1;
  std::vector<std::vector<int>> levels_;
};

/// Through these corners.
Outline polygon(const std::vector<std::array<double, 2>>& corners);

/// Faces of each panel, ascending.
std::vector<std::vector<int>> faces_by_panel(const mesh::GarmentMesh& garment);

/// Edges of one panel that belong to a single face, as vertex pairs, in the direction of the face.
std::vector<std::array<int, 2>> border_edges(const mesh::GarmentMesh& garment, const std::vector<int>& faces);

/// Border of a panel in panel coordinates; of a mirrored one that of its mirror image.
Outline panel_outline(const mesh::GarmentMesh& garment, int panel, const std::vector<int>& faces);

/// Middle of a face in panel coordinates; in a mirrored panel that of the mirror image.
Eigen::Vector2d plain_middle(const mesh::GarmentMesh& garment, int face);

/// Lines of a panel as rows of vertices.
using Lines = std::vector<std::vector<int>>;

/// The faces that lines of a panel enclose.
/// faces   those of the panel
/// error   Issue "open_outline" (without place)
Result<std::vector<int>> enclosed_by(const mesh::GarmentMesh& garment, const std::vector<int>& faces, const Lines& lines);

/// The faces on the same side of lines of a panel as a position (of the mirror image in a mirrored panel).
/// error   Issue "open_outline", "empty_region"
Result<std::vector<int>> same_side(const mesh::GarmentMesh& garment, int panel, const std::vector<int>& faces, const Lines& lines, const std::array<double, 2>& inside);

}  // namespace toile::tailor
