// Closest points of a triangle mesh, open or closed. Private to the library.
#pragma once

#include "toile/mesh/types.h"

#include <vector>

namespace toile::inspect {

/// A tree of boxes over triangles.
class NearestSurface {
 public:
  NearestSurface(const mesh::Points3& x, const mesh::Triangles& faces);
  /// Distance to the surface [m]; infinite where there are no faces.
  double distance(const Eigen::Vector3d& p) const;

 private:
  struct Node {
    Eigen::Vector3d low, high;
    int left = -1, right = -1;  ///< children, or -1
    int begin = 0, end = 0;     ///< leaf: range of order_
  };
  int build(int begin, int end);
  double to_face(const Eigen::Vector3d& p, int face) const;
  const mesh::Points3& x_;
  const mesh::Triangles& faces_;
  std::vector<Eigen::Vector3d> middle_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace toile::inspect
