// The supports of cases A and B, in which simulators are compared: a square metre of cloth falls on a ball; a soft top between
// two frames comes down on an obstacle.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "toile/mesh/support_mesh.h"

namespace toile::bench {

/// Rings between two poles on the y axis; rings * segments + 2 vertices, y up.
inline mesh::SupportMesh ellipsoid(const Eigen::Vector3d& semi_axes, const Eigen::Vector3d& centre, int rings,
                                   int segments) {
  mesh::SupportMesh s;
  const int last = rings * segments + 1;
  s.x.resize(last + 1, 3);
  const auto put = [&](int row, const Eigen::Vector3d& unit) {
    s.x.row(row) = (centre + semi_axes.cwiseProduct(unit)).transpose();
  };
  put(0, Eigen::Vector3d::UnitY());
  put(last, -Eigen::Vector3d::UnitY());
  for (int r = 0; r < rings; ++r) {
    const double theta = M_PI * (r + 1) / (rings + 1);
    for (int k = 0; k < segments; ++k) {
      const double phi = 2 * M_PI * k / segments;
      put(1 + r * segments + k,
          {std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)});
    }
  }
  std::vector<std::array<int, 3>> faces;
  for (int k = 0; k < segments; ++k) faces.push_back({0, 1 + k, 1 + (k + 1) % segments});
  for (int r = 0; r + 1 < rings; ++r) {
    for (int k = 0; k < segments; ++k) {
      const int a = 1 + r * segments + k, b = 1 + r * segments + (k + 1) % segments;
      faces.push_back({a, a + segments, b + segments});
      faces.push_back({a, b + segments, b});
    }
  }
  for (int k = 0; k < segments; ++k) {
    const int base = 1 + (rings - 1) * segments;
    faces.push_back({last, base + (k + 1) % segments, base + k});
  }
  s.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    s.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  s.face_region = mesh::Ids::Constant(s.faces.rows(), -1);
  return s;
}

/// Case A: 1,484 vertices, 2,964 triangles, radius 0.25 m.
inline mesh::SupportMesh ball() {
  return ellipsoid(Eigen::Vector3d::Constant(0.25), Eigen::Vector3d::Zero(), 38, 39);
}

/// Case B: 1,852 vertices, 3,700 triangles; its top is 70 mm under the cloth.
inline mesh::SupportMesh obstacle() { return ellipsoid({0.3, 0.15, 0.4}, {0.6, -0.22, 0}, 37, 50); }

}  // namespace toile::bench
