#include "toile/inspect/strain.h"

#include "toile/base/parallel.h"

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

namespace {

/// F = a (exp(b e) - 1) through (EMT, F_max) with linearity LT; below zero the line of the initial slope.
struct TensileCurve {
  double a = 0, b = 0;

  TensileCurve(const fabric::YarnDirection& yarn, double force_max) {
    // LT = 2 (1/x - 1/(e^x - 1)), x = b EMT, falls from 1 at x = 0: bisection.
    const double lt = std::min(yarn.linearity, 0.9999);
    double low = 1e-4, high = 60;
    for (int i = 0; i < 80; ++i) {
      const double x = 0.5 * (low + high);
      (2 * (1 / x - 1 / std::expm1(x)) > lt ? low : high) = x;
    }
    b = low / yarn.strain_max;
    a = force_max / std::expm1(low);
  }
  double force(double strain) const { return strain > 0 ? a * std::expm1(b * strain) : a * b * strain; }
};

}  // namespace

FaceTension face_tension(const mesh::GarmentMesh& g, const FaceStrain& strain) {
  std::vector<std::pair<TensileCurve, TensileCurve>> curves;
  for (const auto& laminate : g.laminates) {
    const fabric::Card& card = laminate.equivalent;
    curves.emplace_back(TensileCurve(card.warp, card.tensile_force_max), TensileCurve(card.weft, card.tensile_force_max));
  }
  FaceTension t;
  t.warp = t.weft = Eigen::VectorXd::Zero(g.face_count());
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    const int laminate = g.face_laminate[f];
    if (laminate < 0) continue;
    const auto& [warp, weft] = curves[static_cast<std::size_t>(laminate)];
    t.warp[f] = warp.force(strain.warp[f]);
    t.weft[f] = weft.force(strain.weft[f]);
  }
  return t;
}

}  // namespace toile::inspect
