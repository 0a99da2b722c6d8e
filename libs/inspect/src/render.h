// The ray tracer's view of a scene. Private to the library.
#pragma once

#include "toile/inspect/image.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace toile::inspect {

/// From the faintest to the strongest. Folds are dashed, one dash a mesh edge.
enum class EdgeLine : unsigned char { none, mesh, fold, seam, border };

struct Surface {
  enum class Kind { cloth, support };
  Kind kind = Kind::cloth;
  std::vector<Eigen::Vector3f> x, normals;
  std::vector<std::array<int, 3>> faces;
  std::vector<Eigen::Vector3f> colors;  ///< linear; one for all, per vertex or per face
  bool colors_on_faces = false;
  bool data_colors = false;             ///< colours carry values: shaded less, so that they can be compared with the legend
  std::vector<std::array<EdgeLine, 3>> lines;  ///< per face, edge k opposite vertex k; may be empty
  std::vector<EdgeLine> vertex_lines;          ///< the strongest seam or border line at each vertex; may be empty
};

/// A pinhole far away. A point of the picture plane through `target` has coordinates (X right, Y up) [m].
struct Camera {
  Eigen::Vector3d target, toward, right, up;  ///< toward: from the target to the camera
  double distance = 1;
  double metres_per_pixel = 1e-3;
  Eigen::Vector2d corner;  ///< picture-plane coordinates of the picture's upper left corner

  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d r = p - target;
    const double scale = distance / (distance - r.dot(toward));
    return {scale * r.dot(right), scale * r.dot(up)};
  }
};

struct RenderScene {
  int width = 0, height = 0;
  int samples = 4;
  Camera camera;
  std::vector<Surface> surfaces;
  Eigen::Vector3f background;
  std::optional<double> ground;  ///< height of a floor that shows shadows only
  double extent = 1;             ///< size of what is shown [m]
};

bool render_available();
/// Precondition: render_available()
Result<Image> render(const RenderScene& scene);

}  // namespace toile::inspect
