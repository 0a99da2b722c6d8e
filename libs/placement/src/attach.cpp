#include "toile/placement/attach.h"

#include "toile/contact/support_field.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCorner = 0.6;   // the sewn edge ends where it turns by more [rad]
constexpr double kOpen = 0.005;   // between the sewn edge and its mates at the start [m]
constexpr double kSheet = 0.004;  // between sheets that lie on one another [m]
constexpr double kStep = 0.004;   // along rulings [m]
constexpr double kLift = 0.25;    // slope at which a part that folds back past the seam leaves the cloth under it [rad]

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// One sewn edge of a panel, in the direction of its border, with where it goes.
struct Base {
  std::vector<int> vertices;
  std::vector<Vector3d> target;
  double length = 0;
};

// A ruling over the support: points every kStep.
struct Ruling {
  std::vector<Vector3d> points;
  Vector3d at(double s) const {
    const double r = std::clamp(s / kStep, 0.0, static_cast<double>(points.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(r), points.size() - 2);
    const double t = r - static_cast<double>(i);
    return (1 - t) * points[i] + t * points[i + 1];
  }
};

Ruling trace(const contact::SupportField& field, Vector3d p, Vector3d direction, double length, double offset) {
  Ruling ruling;
  ruling.points.push_back(p);
  for (double s = 0; s < length + kStep; s += kStep) {
    Vector3d next = p + kStep * direction;
    const contact::SurfacePoint near = field.nearest(next);
    if (near.distance < offset) {
      next = near.point + offset * near.normal;
      // The ruling keeps its step and leaves the surface only where the surface falls away from it.
      Vector3d step = next - p;
      if (step.norm() > 1e-9) {
        direction = step.normalized();
        next = p + kStep * direction;
      }
    }
    ruling.points.push_back(next);
    p = next;
  }
  return ruling;
}

std::vector<Base> sewn_edges(const mesh::GarmentMesh& garment, const std::vector<std::vector<int>>& loops, int panel, const std::map<int, Vector3d>& mates) {
  std::vector<Base> bases;
  const auto uv = [&](int v) { return Vector2d(garment.uv.row(v).transpose()); };
  for (const auto& loop : loops) {
    if (garment.vertex_panel[loop[0]] != panel) continue;
    const std::size_t n = loop.size();
    const auto breaks = [&](std::size_t i) {  // the edge ends at vertex i
      const Vector2d a = uv(loop[(i + n - 1) % n]), b = uv(loop[i]), c = uv(loop[(i + 1) % n]);
      return std::abs(std::atan2(cross(b - a, c - b), (b - a).dot(c - b))) > kCorner;
    };
    std::size_t first = 0;
    while (first < n && mates.count(loop[first]) && !breaks(first)) ++first;
    if (first == n) first = 0;  // sewn all round
    Base base;
    for (std::size_t k = 0; k <= n; ++k) {
      const std::size_t i = (first + k) % n;
      const auto mate = mates.find(loop[i]);
      const bool ends = k == n || mate == mates.end() || breaks(i);
      if (mate != mates.end()) {
        if (!base.vertices.empty()) base.length += (uv(loop[i]) - uv(base.vertices.back())).norm();
        base.vertices.push_back(loop[i]);
        base.target.push_back(mate->second);
      }
      if (!ends) continue;
      if (base.vertices.size() > 1) bases.push_back(base);
      base = {};
      if (mate != mates.end() && k < n) {
        base.vertices.push_back(loop[i]);
        base.target.push_back(mate->second);
      }
    }
  }
  return bases;
}

}  // namespace

Points3 attach(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const Layout& layout, const Points3& x, const mesh::SupportMesh& support, double offset) {
  Points3 result = x;
  std::vector<char> placed(garment.panels.size(), 0);
  bool any = false;
  for (std::size_t p = 0; p < placed.size(); ++p) {
    placed[p] = layout.panels[p].part != Part::attached;
    any = any || !placed[p];
  }
  if (!any) return result;
  const contact::SupportField field(contact::make_surface(static_cast<int>(support.x.rows()), support.faces), support.x);
  const std::vector<std::vector<int>> loops = mesh::border_loops(garment.faces);
  while (true) {
    // The panel with the longest sewn edge to placed panels.
    std::optional<Base> best;
    int panel = -1;
    for (std::size_t p = 0; p < placed.size(); ++p) {
      if (placed[p]) continue;
      std::map<int, std::pair<Vector3d, int>> sums;
      for (const mesh::Weld& weld : garment.welds) {
        for (const auto& [own, other] : {std::pair(weld.a, weld.b), std::pair(weld.b, weld.a)}) {
          if (garment.vertex_panel[own] != static_cast<int>(p) || !placed[static_cast<std::size_t>(garment.vertex_panel[other])]) continue;
          auto& [sum, count] = sums.try_emplace(own, Vector3d::Zero(), 0).first->second;
          sum += result.row(other).transpose();
          ++count;
        }
      }
      std::map<int, Vector3d> mates;
      for (const auto& [own, sum] : sums) mates[own] = sum.first / sum.second;
      for (Base& base : sewn_edges(garment, loops, static_cast<int>(p), mates)) {
        if (best && base.length <= best->length + 1e-9) continue;
        best = std::move(base);
        panel = static_cast<int>(p);
      }
    }
    if (!best) break;
    const std::size_t n = best->vertices.size();
    // Normals of the cloth that it is sewn to, at the mates.
    std::map<int, Vector3d> normal_of;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      if (!placed[static_cast<std::size_t>(garment.face_panel[f])]) continue;
      const Vector3d a = result.row(garment.faces(f, 0)), b = result.row(garment.faces(f, 1)), c = result.row(garment.faces(f, 2));
      for (int k = 0; k < 3; ++k) normal_of.try_emplace(garment.faces(f, k), Vector3d::Zero()).first->second += (b - a).cross(c - a);
    }
    std::vector<Vector3d> normal(n, Vector3d::Zero());
    for (std::size_t i = 0; i < n; ++i) {
      for (const mesh::Weld& weld : garment.welds) {
        if (weld.a == best->vertices[i] && normal_of.count(weld.b)) normal[i] += normal_of[weld.b];
        if (weld.b == best->vertices[i] && normal_of.count(weld.a)) normal[i] += normal_of[weld.a];
      }
    }
    const auto smooth = [&](std::vector<Vector3d>& list) {
      for (int round = 0; round < 2; ++round) {
        std::vector<Vector3d> next = list;
        for (std::size_t i = 0; i < n; ++i) {
          next[i] = (list[i > 0 ? i - 1 : i].normalized() + 2 * list[i].normalized() + list[i + 1 < n ? i + 1 : i].normalized()).normalized();
        }
        list = std::move(next);
      }
    };
    smooth(normal);
    std::vector<Vector3d> away(n);  // in the cloth's surface, from the mates' panels into this one
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3d along = best->target[std::min(i + 1, n - 1)] - best->target[i > 0 ? i - 1 : 0];
      away[i] = normal[i].cross(along).normalized();  // the panel is to the left of its border
    }
    smooth(away);
    // Where every vertex is in the strip: along the sewn edge and away from it.
    struct Spot {
      int vertex;
      std::size_t segment;
      double along, beyond, away;
    };
    std::vector<Spot> spots;
    double farthest = 0, nearest = 0;
    const auto uv = [&](std::size_t i) { return Vector2d(garment.uv.row(best->vertices[i]).transpose()); };
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      if (garment.vertex_panel[v] != panel) continue;
      const Vector2d q = folded.uv.row(v).transpose();
      Spot spot{static_cast<int>(v), 0, 0, 0, 0};
      double best_sq = 1e18;
      for (std::size_t i = 0; i + 1 < n; ++i) {
        const Vector2d d = uv(i + 1) - uv(i);
        const double t = (q - uv(i)).dot(d) / d.squaredNorm(), inside = std::clamp(t, 0.0, 1.0);
        const bool end = (t < 0 && i == 0) || (t > 1 && i + 2 == n);
        const Vector2d foot = uv(i) + (end ? t : inside) * d;
        const double distance_sq = (q - foot).squaredNorm();
        if (distance_sq >= best_sq) continue;
        best_sq = distance_sq;
        const double side = cross(d, q - foot) >= 0 ? 1 : -1;
        spot = {static_cast<int>(v), i, inside, end ? (t - inside) * d.norm() : 0.0, side * std::sqrt(distance_sq)};
      }
      farthest = std::max(farthest, spot.away);
      nearest = std::min(nearest, spot.away);
      spots.push_back(spot);
    }
    std::vector<Ruling> up(n), back(n);
    for (std::size_t i = 0; i < n; ++i) {
      up[i] = trace(field, best->target[i], away[i], farthest + kOpen, offset);
      back[i] = trace(field, best->target[i], -std::cos(kLift) * away[i] + std::sin(kLift) * normal[i], -nearest, offset);
    }
    for (const Spot& spot : spots) {
      const std::size_t i = spot.segment, j = i + 1;
      const auto at = [&](std::size_t k) { return spot.away >= 0 ? up[k].at(spot.away + kOpen) : back[k].at(-spot.away); };
      Vector3d p = (1 - spot.along) * at(i) + spot.along * at(j);
      p += spot.beyond * (best->target[j] - best->target[i]).normalized();
      // Outwards of the strip, wherever it leans.
      const Vector3d rise = (1 - spot.along) * (up[i].at(spot.away >= 0 ? spot.away + kStep : kStep) - up[i].at(std::max(spot.away, 0.0))) +
                            spot.along * (up[j].at(spot.away >= 0 ? spot.away + kStep : kStep) - up[j].at(std::max(spot.away, 0.0)));
      const Vector3d out = (best->target[j] - best->target[i]).cross(rise).normalized();
      p += kSheet * folded.layer[static_cast<std::size_t>(spot.vertex)] * out;
      result.row(spot.vertex) = p.transpose();
    }
    placed[static_cast<std::size_t>(panel)] = 1;
  }
  return result;
}

}  // namespace toile::placement
