// How far the cloth is stretched along its yarns, from where it is and where it was cut. docs/measures.md.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <vector>

namespace toile::inspect {

/// Per face, |F| each. From the deformation gradient with columns f_u, f_v (images of unit weft and warp):
/// warp = |f_v| - 1, weft = |f_u| - 1, shear = asin of the cosine between them (positive: the angle between the yarns
/// that point to +u and +v has become smaller), bias = the greater stretch of the two 45 degree directions - 1.
struct FaceStrain {
  Eigen::VectorXd warp, weft;  ///< [1]
  Eigen::VectorXd shear;       ///< [rad]
  Eigen::VectorXd bias;        ///< [1]
  std::vector<int> degenerate; ///< faces without area in panel coordinates; their values above are 0
};
FaceStrain face_strain(const mesh::GarmentMesh& garment);

/// Force per width [N/m] that each face's laminate carries at that strain, from its tensile curves. 0 where a face has
/// no laminate.
struct FaceTension {
  Eigen::VectorXd warp, weft;
};
FaceTension face_tension(const mesh::GarmentMesh& garment, const FaceStrain& strain);

}  // namespace toile::inspect
