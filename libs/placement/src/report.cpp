#include "toile/placement/report.h"

#include "toile/contact/support_field.h"
#include "toile/mesh/topology.h"
#include "toile/placement/relax.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLying = 0.7;      // cosine between a face's normal and its `up` from which the direction round the body is taken
constexpr double kReach = 10;       // the support is looked for so far [m]
constexpr double kFoldedOver = 0.3; // mean layer of a face from which it belongs to a folded part

struct Directions {
  bool known = false;
  Vector3d weft, warp, normal;
};

Directions directions(const mesh::GarmentMesh& garment, const Points3& x, Eigen::Index face) {
  const int i = garment.faces(face, 0), j = garment.faces(face, 1), k = garment.faces(face, 2);
  const Vector3d d1 = x.row(j) - x.row(i), d2 = x.row(k) - x.row(i), cross = d1.cross(d2);
  const Vector2d e1 = garment.uv.row(j) - garment.uv.row(i), e2 = garment.uv.row(k) - garment.uv.row(i);
  const double determinant = e1.x() * e2.y() - e1.y() * e2.x();
  if (determinant <= 0 || cross.norm() < 1e-14) return {};
  return {true, (e2.y() * d1 - e1.y() * d2) / determinant, (-e2.x() * d1 + e1.x() * d2) / determinant, cross.normalized()};
}

}  // namespace

std::vector<std::optional<WantedDirection>> wanted_directions(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const Layout& layout, const Points3& bent) {
  std::vector<std::optional<WantedDirection>> wanted(static_cast<std::size_t>(garment.face_count()));
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    double layer = 0;
    for (int k = 0; k < 3; ++k) layer += std::abs(folded.layer[static_cast<std::size_t>(garment.faces(row, k))]) / 3;
    if (layer > kFoldedOver) continue;
    const PanelLayout& panel = layout.panels[static_cast<std::size_t>(garment.face_panel[row])];
    if (panel.part == Part::attached) continue;
    const Directions start = directions(garment, bent, row);
    if (!start.known) continue;
    WantedDirection& w = wanted[f].emplace();
    // An arm may be bent: along it where the panel was bent round it.
    w.up = panel.part == Part::trunk ? Vector3d::UnitY() : (std::sin(panel.turn) * start.weft + std::cos(panel.turn) * start.warp).normalized();
    w.around = (std::cos(panel.turn) * start.weft - std::sin(panel.turn) * start.warp).normalized();
    w.turn = panel.turn;
  }
  return wanted;
}

Report measure(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const std::vector<std::optional<WantedDirection>>& wanted) {
  Report report;
  const auto vertices = static_cast<std::size_t>(garment.vertex_count()), faces = static_cast<std::size_t>(garment.face_count());
  const StrainSummary strain = edge_strain(garment, garment.x);
  report.max_strain = strain.largest;
  report.rms_strain = strain.rms;
  report.vertex_strain.assign(vertices, 0);
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    const double rest = (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm();
    if (rest <= 0) continue;
    const double e = (garment.x.row(edge.a) - garment.x.row(edge.b)).norm() / rest - 1;
    for (const int v : {edge.a, edge.b}) {
      double& worst = report.vertex_strain[static_cast<std::size_t>(v)];
      if (std::abs(e) > std::abs(worst)) worst = e;
    }
  }

  double area = 0, flat_area = 0, angle_area = 0;
  const Eigen::VectorXd rest = mesh::rest_areas(garment);
  report.face_warp_angle.assign(faces, 0);
  std::vector<WarpAngle> angles(garment.panels.size());
  std::vector<double> angle_areas(garment.panels.size(), 0);
  for (std::size_t f = 0; f < faces; ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    const int i = garment.faces(row, 0), j = garment.faces(row, 1), k = garment.faces(row, 2);
    const Vector3d d1 = garment.x.row(j) - garment.x.row(i), d2 = garment.x.row(k) - garment.x.row(i), cross = d1.cross(d2);
    area += 0.5 * cross.norm();
    flat_area += rest[row];
    if (wanted.empty() || !wanted[f]) continue;
    const Directions here = directions(garment, garment.x, row);
    if (!here.known) continue;
    const Vector3d &n = here.normal, &up = wanted[f]->up, &around = wanted[f]->around;
    const bool lying = std::abs(n.dot(up)) > kLying;
    const Vector3d along = lying ? n.cross(around).normalized() : (up - up.dot(n) * n).normalized(), across = along.cross(n);
    const double turn = wanted[f]->turn;
    const Vector3d direction = -std::sin(turn) * across + std::cos(turn) * along;
    const double angle = std::atan2(n.dot(direction.cross(here.warp)), direction.dot(here.warp));
    report.face_warp_angle[f] = angle;
    const auto p = static_cast<std::size_t>(garment.face_panel[row]);
    angles[p].mean += rest[row] * std::abs(angle);
    angles[p].largest = std::max(angles[p].largest, std::abs(angle));
    angle_areas[p] += rest[row];
  }
  report.area_change = flat_area > 0 ? area / flat_area - 1 : 0;
  for (std::size_t p = 0; p < angles.size(); ++p) {
    if (angle_areas[p] <= 0) continue;
    report.mean_warp_angle += angles[p].mean;
    angle_area += angle_areas[p];
    angles[p].panel = static_cast<int>(p);
    angles[p].mean /= angle_areas[p];
    report.largest_warp_angle = std::max(report.largest_warp_angle, angles[p].largest);
    report.warp_angles.push_back(angles[p]);
  }
  if (angle_area > 0) report.mean_warp_angle /= angle_area;

  std::vector<SeamGap> gaps(garment.seams.size());
  std::vector<int> counts(garment.seams.size(), 0);
  double total = 0;
  report.vertex_seam_gap.assign(vertices, 0);
  for (std::size_t i = 0; i < gaps.size(); ++i) gaps[i].seam = static_cast<int>(i);
  for (const mesh::Weld& weld : garment.welds) {
    const double gap = (garment.x.row(weld.a) - garment.x.row(weld.b)).norm();
    SeamGap& seam = gaps[static_cast<std::size_t>(weld.seam)];
    seam.mean += gap;
    seam.largest = std::max(seam.largest, gap);
    ++counts[static_cast<std::size_t>(weld.seam)];
    total += gap;
    report.largest_seam_gap = std::max(report.largest_seam_gap, gap);
    for (const int v : {weld.a, weld.b}) {
      double& widest = report.vertex_seam_gap[static_cast<std::size_t>(v)];
      widest = std::max(widest, gap);
    }
  }
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (counts[i] > 0) gaps[i].mean /= counts[i];
  }
  report.seams = std::move(gaps);
  report.mean_seam_gap = garment.welds.empty() ? 0 : total / static_cast<double>(garment.welds.size());

  const contact::Surface body = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  const contact::SupportField field(body, support.x);
  std::vector<contact::SurfacePoint> near;
  std::vector<int> warm;
  field.nearest(garment.x, kReach, near, warm);
  report.smallest_gap = near.empty() ? 0 : near.front().distance;
  for (const auto& p : near) {
    report.vertex_gap.push_back(p.distance);
    report.smallest_gap = std::min(report.smallest_gap, p.distance);
    if (p.distance < 0) ++report.vertices_inside;
  }
  const contact::Surface cloth = contact::make_surface(static_cast<int>(garment.x.rows()), garment.faces, mesh::particles(garment));
  report.self_intersections = contact::self_intersections(cloth, garment.x);
  report.support_intersections = contact::support_intersections(cloth, garment.x, body, support.x);
  report.face_cut.assign(faces, 0);
  for (const auto& pair : report.self_intersections) report.face_cut[static_cast<std::size_t>(pair.a)] = report.face_cut[static_cast<std::size_t>(pair.b)] = 1;
  for (const auto& pair : report.support_intersections) report.face_cut[static_cast<std::size_t>(pair.a)] |= 2;
  return report;
}

std::vector<PartFit> fit_of_parts(const mesh::GarmentMesh& garment, const Layout& layout, const Points3& bent, const mesh::SupportMesh& support, const Flattening& flattening) {
  Points3 flat = support.x;
  for (Eigen::Index v = 0; v < flat.rows(); ++v) flat.row(v) = flattening.flattened(support.x.row(v).transpose()).transpose();
  const contact::SupportField field(contact::make_surface(static_cast<int>(flat.rows()), support.faces), flat);
  std::vector<contact::SurfacePoint> near;
  std::vector<int> warm;
  field.nearest(bent, kReach, near, warm);
  std::map<Part, PartFit> fits;
  std::map<Part, int> counts;
  for (std::size_t v = 0; v < near.size(); ++v) {
    const Part part = layout.panels[static_cast<std::size_t>(garment.vertex_panel[static_cast<Eigen::Index>(v)])].part;
    if (part == Part::attached) continue;
    PartFit& fit = fits[part];
    fit.part = part;
    fit.rms += near[v].distance * near[v].distance;
    fit.largest = std::max(fit.largest, std::abs(near[v].distance));
    ++counts[part];
  }
  std::vector<PartFit> result;
  for (auto& [part, fit] : fits) {
    fit.rms = std::sqrt(fit.rms / counts[part]);
    result.push_back(fit);
  }
  return result;
}

void add_columns(mesh::GarmentMesh& garment, const Report& report) {
  garment.vertex_columns["edge_strain"] = {false, report.vertex_strain, {}};
  garment.vertex_columns["ease"] = {false, report.vertex_gap, {}};
  garment.vertex_columns["seam_gap"] = {false, report.vertex_seam_gap, {}};
  garment.face_columns["warp_angle"] = {false, report.face_warp_angle, {}};
  garment.face_columns["cuts"] = {true, {}, report.face_cut};
}

}  // namespace toile::placement
