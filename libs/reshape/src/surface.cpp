#include "toile/reshape/surface.h"

#include "toile/base/text.h"
#include "toile/contact/distance.h"
#include "toile/mesh/topology.h"

#include <algorithm>

namespace toile::reshape {

using Eigen::Vector3d;

Surface surface_of(const mesh::SupportMesh& support) {
  Surface surface{support.x, support.faces, support.face_region, support.region_names, {}};
  for (const auto& [name, p] : support.landmarks) surface.points[name] = Vector3d(p[0], p[1], p[2]);
  return surface;
}

GarmentSurface surface_of(const mesh::GarmentMesh& garment) {
  GarmentSurface result;
  result.particle = mesh::particles(garment);
  const int count = garment.vertex_count() == 0 ? 0 : result.particle.maxCoeff() + 1;
  Surface& surface = result.surface;
  surface.x = Points3::Zero(count, 3);
  Eigen::VectorXd members = Eigen::VectorXd::Zero(count);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    surface.x.row(result.particle[v]) += garment.x.row(v);
    members[result.particle[v]] += 1;
  }
  for (int p = 0; p < count; ++p) surface.x.row(p) /= members[p];
  surface.faces = mesh::mapped(garment.faces, result.particle);
  surface.face_part = garment.face_panel;
  for (const mesh::Panel& panel : garment.panels) surface.parts.push_back(panel.name);
  for (const mesh::NamedPoint& point : garment.points) {
    surface.points[garment.panels[static_cast<std::size_t>(point.panel)].name + "." + point.name] = garment.x.row(point.vertex);
  }
  return result;
}

Result<std::vector<char>> faces_of(const Surface& surface, const std::vector<std::string>& parts, const std::string& key) {
  std::vector<char> keep(static_cast<std::size_t>(surface.faces.rows()), parts.empty() ? 1 : 0);
  Issues issues;
  for (const std::string& name : parts) {
    const auto found = std::find(surface.parts.begin(), surface.parts.end(), name);
    if (found == surface.parts.end()) {
      issues.push_back({"unknown_part", {.item = key}, fmt::format("the surface has no part '{}'", name),
                        surface.parts.empty() ? std::string("leave `parts` out: this surface has none") : suggestion(name, surface.parts)});
      continue;
    }
    const int part = static_cast<int>(found - surface.parts.begin());
    for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
      if (surface.face_part[f] == part) keep[static_cast<std::size_t>(f)] = 1;
    }
  }
  if (!issues.empty()) return issues;
  return keep;
}

Result<Vector3d> find_point(const Surface& surface, const std::string& name, const std::array<double, 3>& shift, const std::string& key) {
  const Vector3d by(shift[0], shift[1], shift[2]);
  if (name.empty()) return by;
  const auto found = surface.points.find(name);
  if (found != surface.points.end()) return Vector3d(found->second + by);
  std::vector<std::string> names;
  for (const auto& [known, p] : surface.points) names.push_back(known);
  return Issue{"unknown_point", {.item = key}, fmt::format("the surface has no point '{}'", name),
               names.empty() ? std::string("give the position itself as `shift`, without a name") : suggestion(name, names)};
}

SurfacePoint nearest(const Points3& x, const Triangles& faces, const Vector3d& point, const std::vector<char>& keep) {
  SurfacePoint best;
  double best_sq = 0;
  for (int f = 0; f < faces.rows(); ++f) {
    if (!keep.empty() && !keep[static_cast<std::size_t>(f)]) continue;
    const Vector3d a = x.row(faces(f, 0)), b = x.row(faces(f, 1)), c = x.row(faces(f, 2));
    const contact::Closest found = contact::closest_vertex_face(point, a, b, c);
    if (best.face >= 0 && found.distance_sq >= best_sq) continue;
    best_sq = found.distance_sq;
    best.face = f;
    best.weight = Vector3d(-found.weight[1], -found.weight[2], -found.weight[3]);
  }
  best.distance = std::sqrt(best_sq);
  return best;
}

Vector3d at(const Points3& x, const Triangles& faces, const SurfacePoint& point) {
  Vector3d result = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) result += point.weight[k] * x.row(faces(point.face, k)).transpose();
  return result;
}

}  // namespace toile::reshape
