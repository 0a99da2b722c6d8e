// Array types shared by all libraries.
#pragma once

#include <Eigen/Core>

namespace toile::mesh {

using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;    ///< [m]
using Points2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;    ///< [m]
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;     ///< vertex ids, counter-clockwise from the face side
using Ids = Eigen::VectorXi;

}  // namespace toile::mesh
