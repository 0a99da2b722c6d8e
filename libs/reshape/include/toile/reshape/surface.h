// What reshaping and flattening work on: a form or a garment as one triangle surface with named parts and points.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace toile::reshape {

using mesh::Ids;
using mesh::Points3;
using mesh::Triangles;

struct Surface {
  Points3 x;                                      ///< [m], |V| x 3
  Triangles faces;                                ///< |F| x 3, counter-clockwise from outside
  Ids face_part;                                  ///< |F|, index into parts; -1: none
  std::vector<std::string> parts;                 ///< regions of a form, panels of a garment
  std::map<std::string, Eigen::Vector3d> points;  ///< landmarks of a form, `panel.point` of a garment
};

Surface surface_of(const mesh::SupportMesh& support);

/// A garment's particles: both sides of a seam are one vertex, in the middle of the two.
struct GarmentSurface {
  Surface surface;
  Ids particle;  ///< of each vertex of the garment, |V|
};
GarmentSurface surface_of(const mesh::GarmentMesh& garment);

/// Faces that belong to the named parts; all where none are named. `key` is the setting that names them.
/// ret    |F|, 0 or 1
/// error  "unknown_part"
Result<std::vector<char>> faces_of(const Surface& surface, const std::vector<std::string>& parts, const std::string& key);

/// The named point, moved by `shift`; without a name `shift` alone.
/// error  "unknown_point", with the nearest name
Result<Eigen::Vector3d> find_point(const Surface& surface, const std::string& name, const std::array<double, 3>& shift, const std::string& key);

/// The closest point of the faces with keep[f] != 0 (of all, if keep is empty).
struct SurfacePoint {
  int face = -1;
  Eigen::Vector3d weight = Eigen::Vector3d::Zero();  ///< of the face's corners, sums to 1
  double distance = 0;                               ///< [m]
};
SurfacePoint nearest(const Points3& x, const Triangles& faces, const Eigen::Vector3d& point, const std::vector<char>& keep = {});
/// The point with these weights.
Eigen::Vector3d at(const Points3& x, const Triangles& faces, const SurfacePoint& point);

}  // namespace toile::reshape
