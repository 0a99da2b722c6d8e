#include "toile/inspect/strain.h"

#include "toile/base/parallel.h"
#include "toile/fabric/constitutive.h"

#include <algorithm>
#include <cmath>

namespace toile::inspect {

FaceStrain face_strain(const mesh::GarmentMesh& g) {
  const Eigen::Index n = g.face_count();
  FaceStrain s;
  s.warp = s.weft = s.shear = s.bias = Eigen::VectorXd::Zero(n);
  std::vector<char> flat(static_cast<std::size_t>(n), 0);
  parallel_for(static_cast<std::size_t>(n), 2048, [&](std::size_t i) {
    const auto f = static_cast<Eigen::Index>(i);
    const int a = g.faces(f, 0), b = g.faces(f, 1), c = g.faces(f, 2);
    const Eigen::Vector2d p = g.uv.row(b) - g.uv.row(a), q = g.uv.row(c) - g.uv.row(a);
    const double det = p.x() * q.y() - p.y() * q.x();
    if (std::abs(det) < 1e-14) {
      flat[i] = 1;
      return;
    }
    const Eigen::Vector3d d = g.x.row(b) - g.x.row(a), e = g.x.row(c) - g.x.row(a);
    const Eigen::Vector3d fu = (q.y() * d - p.y() * e) / det, fv = (p.x() * e - q.x() * d) / det;
    const double lu = fu.norm(), lv = fv.norm();
    s.weft[f] = lu - 1;
    s.warp[f] = lv - 1;
    if (lu > 0 && lv > 0) s.shear[f] = std::asin(std::clamp(fu.dot(fv) / (lu * lv), -1.0, 1.0));
    s.bias[f] = std::max((fu + fv).norm(), (fu - fv).norm()) / std::sqrt(2.0) - 1;
  });
  for (std::size_t i = 0; i < flat.size(); ++i) {
    if (flat[i]) s.degenerate.push_back(static_cast<int>(i));
  }
  return s;
}

FaceTension face_tension(const mesh::GarmentMesh& g, const FaceStrain& strain) {
  std::vector<std::pair<fabric::TensileCurve, fabric::TensileCurve>> curves;
  for (const auto& laminate : g.laminates) {
    const fabric::Card& card = laminate.equivalent;
    curves.emplace_back(fabric::tensile_curve(card, card.warp), fabric::tensile_curve(card, card.weft));
  }
  FaceTension t;
  t.warp = t.weft = Eigen::VectorXd::Zero(g.face_count());
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    const int laminate = g.face_laminate[f];
    if (laminate < 0) continue;
    const auto& [warp, weft] = curves[static_cast<std::size_t>(laminate)];
    t.warp[f] = warp.at(strain.warp[f]).force;
    t.weft[f] = weft.at(strain.weft[f]).force;
  }
  return t;
}

}  // namespace toile::inspect
