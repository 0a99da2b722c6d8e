#include "toile/placement/layers.h"

#include "toile/base/parallel.h"
#include "toile/contact/exact.h"
#include "toile/contact/untangle.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace toile::placement {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOverlap = 0.3;     // at least this part of a layer's panel lies over its cloth
constexpr double kFarOff = 0.1;      // mean distance from its seams at which a place is no place [m]
constexpr double kUncovered = 0.05;  // what a layer's panel all off its cloth counts for as distance from seams [m]
constexpr double kTurnedOver = 0.002; // as does one whose face looks to the side that is not usual [m]
constexpr double kDraftOff = 0.04;   // seams that are farther off in the draft say where a layer lies, not the draft: linings hang lower than their hem [m]
constexpr double kSpread = 0.01;     // seams that are shorter do not say how a panel is turned [m]
constexpr double kPush = 0.0005;     // by which layers that cut their cloth leave it, a round [m]
constexpr double kDraw = 0.001;      // by which borders that cut other cloth than their own are drawn in, a round [m]
constexpr double kDrawn = 0.007;     // at most [m]
constexpr double kFlattest = 0.3;    // part of its area that a triangle keeps when its corners are drawn in
constexpr double kPull = 0.7;        // of the distance from their own cloth that they keep where they cut other cloth
constexpr double kDrawnIn = 0.5;     // of the gap: borders, so that layers that meet at a seam do not touch
constexpr double kAlike = 0.1;       // cosine between normals from which cloth beside a layer's own lies under it too
constexpr double kStandsOff = 0.015; // by which that stands off at most [m]
constexpr int kRings = 2;            // of vertices beside those beyond their cloth, which go over it too
constexpr int kPushes = 40;
constexpr int kUntanglePasses = 20;
constexpr std::size_t kSamples = 60; // vertices of a layer's panel at which its cover is looked at
constexpr int kSmooth = 2;           // rounds in which normals become those of their surroundings
constexpr int kFill = 400;           // sweeps that spread cloth over a dart

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Where a point of a panel's plane is in its triangles; beyond the border in the plane of the nearest one.
struct Spot {
  int face = -1;
  std::array<double, 3> weight{};   // sum to 1, outside [0, 1] beyond the border
  std::array<double, 3> nearest{};  // of the nearest point of the panel
  bool inside = false;
};

// A placed panel.
class Sheet {
 public:
  Sheet(const mesh::GarmentMesh& garment, int panel) : garment_(garment) {
    double area = 0;
    int count = 0;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      if (garment.face_panel[f] != panel) continue;
      area += 0.5 * cross(corner(static_cast<int>(f), 1) - corner(static_cast<int>(f), 0), corner(static_cast<int>(f), 2) - corner(static_cast<int>(f), 0));
      ++count;
    }
    cell_ = 1.5 * std::sqrt(2 * area / std::max(count, 1));
    std::map<std::pair<int, int>, int> open;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      if (garment.face_panel[f] != panel) continue;
      const int face = static_cast<int>(f);
      const Vector2d a = corner(face, 0), b = corner(face, 1), c = corner(face, 2);
      const auto low = key(a.cwiseMin(b).cwiseMin(c)), high = key(a.cwiseMax(b).cwiseMax(c));
      for (long i = low.first; i <= high.first; ++i) {
        for (long j = low.second; j <= high.second; ++j) boxes_[{i, j}].push_back(face);
      }
      for (int k = 0; k < 3; ++k) {
        const auto edge = std::minmax(garment.faces(f, k), garment.faces(f, (k + 1) % 3));
        const auto [it, fresh] = open.emplace(edge, 3 * face + k);
        if (!fresh) open.erase(it);
      }
    }
    for (const auto& [edge, side] : open) border_.push_back(side);
  }

  Spot locate(const Vector2d& q) const {
    Spot spot;
    double best = -1e-9;
    if (const auto it = boxes_.find(key(q)); it != boxes_.end()) {
      for (const int face : it->second) {
        const std::array<double, 3> w = weights(face, q);
        const double least = std::min({w[0], w[1], w[2]});
        if (least < best || (spot.face >= 0 && least == best)) continue;
        best = least;
        spot = {face, w, w, true};
      }
    }
    if (spot.face >= 0) return spot;
    double nearest = 1e18;
    for (const int side : border_) {
      const int face = side / 3, k = side % 3;
      const Vector2d a = corner(face, k), d = corner(face, (k + 1) % 3) - a;
      const double t = std::clamp((q - a).dot(d) / std::max(d.squaredNorm(), 1e-18), 0.0, 1.0), distance = (a + t * d - q).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      spot.face = face;
      spot.nearest = {0, 0, 0};
      spot.nearest[static_cast<std::size_t>(k)] = 1 - t;
      spot.nearest[static_cast<std::size_t>((k + 1) % 3)] = t;
    }
    if (spot.face >= 0) spot.weight = weights(spot.face, q);
    return spot;
  }

 private:
  Vector2d corner(int face, int k) const { return garment_.uv.row(garment_.faces(face, k)).transpose(); }
  std::pair<long, long> key(const Vector2d& q) const { return {static_cast<long>(std::floor(q.x() / cell_)), static_cast<long>(std::floor(q.y() / cell_))}; }
  std::array<double, 3> weights(int face, const Vector2d& q) const {
    const Vector2d a = corner(face, 0), b = corner(face, 1), c = corner(face, 2);
    const double area = cross(b - a, c - a);
    return {cross(c - b, q - b) / area, cross(a - c, q - c) / area, cross(b - a, q - a) / area};
  }

  const mesh::GarmentMesh& garment_;
  double cell_ = 1;
  std::map<std::pair<long, long>, std::vector<int>> boxes_;
  std::vector<int> border_;  // 3 face + corner at which the edge begins
};

// Rotation, with a reflection of u first where `reflected`, and shift that bring points from onto to, least squares.
std::pair<Matrix2d, Vector2d> rigid(const std::vector<Vector2d>& from, const std::vector<Vector2d>& to, bool reflected) {
  const Matrix2d flip = Vector2d(reflected ? -1 : 1, 1).asDiagonal();
  Vector2d p = Vector2d::Zero(), q = Vector2d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) p += flip * from[i] / static_cast<double>(from.size()), q += to[i] / static_cast<double>(from.size());
  double sine = 0, cosine = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vector2d a = flip * from[i] - p, b = to[i] - q;
    sine += cross(a, b);
    cosine += a.dot(b);
  }
  const double length = std::max(std::hypot(sine, cosine), 1e-18);
  Matrix2d turn;
  turn << cosine / length, -sine / length, sine / length, cosine / length;
  return {turn * flip, q - turn * p};
}

class Laying {
 public:
  Laying(const mesh::GarmentMesh& garment, const Points3& x, double gap)
      : garment_(garment), gap_(gap), free_(free_panels(garment)), laid_(garment.panels.size()), inwards_(garment.panels.size(), 0), laid_by_(garment.panels.size()), drawn_(static_cast<std::size_t>(x.rows()), 0), normals_(Points3::Zero(x.rows(), 3)), base_(x), away_(Points3::Zero(x.rows(), 3)), distance_(static_cast<std::size_t>(x.rows()), 0) {
    result_.x = result_.smooth = x;
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
      if (free_[static_cast<std::size_t>(garment.vertex_panel[v])]) result_.smooth.row(v).setZero();
    }
    members_.resize(garment.panels.size());
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) members_[static_cast<std::size_t>(garment.vertex_panel[v])].push_back(static_cast<int>(v));
    neighbours_.resize(static_cast<std::size_t>(x.rows()));
    on_border_.assign(static_cast<std::size_t>(x.rows()), 0);
    faces_at_.resize(static_cast<std::size_t>(x.rows()));
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) faces_at_[static_cast<std::size_t>(garment.faces(f, k))].push_back(static_cast<int>(f));
    }
    for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
      neighbours_[static_cast<std::size_t>(edge.a)].push_back(edge.b);
      neighbours_[static_cast<std::size_t>(edge.b)].push_back(edge.a);
      if (edge.faces.size() != 1) continue;
      on_border_[static_cast<std::size_t>(edge.a)] = on_border_[static_cast<std::size_t>(edge.b)] = 1;
      const Vector2d a = garment.uv.row(edge.a), d = Vector2d(garment.uv.row(edge.b).transpose()) - a;
      Vector2d normal = Vector2d(-d.y(), d.x()).normalized();
      double side = 0;
      for (int k = 0; k < 3; ++k) side += normal.dot(Vector2d(garment.uv.row(garment.faces(edge.faces[0], k)).transpose()) - a);
      if (side < 0) normal = -normal;
      for (const int v : {edge.a, edge.b}) border_normals_.try_emplace(v, Vector2d::Zero()).first->second += normal;
    }
    for (const mesh::Weld& weld : garment.welds) {
      mates_[weld.a].push_back(weld.b);
      mates_[weld.b].push_back(weld.a);
    }
    sheets_.resize(garment.panels.size());
    for (std::size_t p = 0; p < free_.size(); ++p) {
      laid_[p] = !free_[p];
      if (laid_[p]) find_normals(static_cast<int>(p));
    }
  }

  Result<LaidLayers> run() {
    while (true) {
      std::optional<Candidate> best;
      bool any = false;
      for (const mesh::FreeLayer& layer : garment_.free_layers) {
        for (const int panel : layer.panels) {
          if (laid_[static_cast<std::size_t>(panel)]) continue;
          any = true;
          for (const Candidate& candidate : candidates(layer, panel)) {
            if (!best || candidate.before(*best)) best = candidate;
          }
        }
      }
      if (!any) break;
      if (!best) return issues();
      lay(*best);
    }
    part();
    return std::move(result_);
  }

 private:
  struct Candidate {
    LayerPlace place;
    std::vector<int> on;   // all that its layer lies on, increasing
    bool outside = false;
    bool sewn = false;   // to something that is laid
    double cost = 0;     // [m]
    bool before(const Candidate& other) const { return sewn != other.sewn ? sewn : cost < other.cost - 1e-12; }
  };

  const Sheet& sheet(int panel) {
    auto& slot = sheets_[static_cast<std::size_t>(panel)];
    if (!slot) slot.emplace(garment_, panel);
    return *slot;
  }

  Vector3d at(const Spot& spot, const std::array<double, 3>& weight, const Points3& values) const {
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) sum += weight[static_cast<std::size_t>(k)] * values.row(garment_.faces(spot.face, k)).transpose();
    return sum;
  }

  // A way to lay a panel on another, whatever else is laid.
  struct Option {
    Candidate candidate;
    double covered = 0;                         // part of the panel that lies over its cloth
    std::vector<std::pair<int, Spot>> sewn;     // its vertices that are sewn to something
  };

  std::vector<Candidate> candidates(const mesh::FreeLayer& layer, int panel) {
    std::vector<Candidate> list;
    for (const int on : layer.on) {
      if (!laid_[static_cast<std::size_t>(on)] || on == panel) continue;
      const auto [it, fresh] = options_.try_emplace({panel, on});
      if (fresh) it->second = options(layer, panel, on);
      for (const Option& option : it->second) {
        double gap = 0;
        int count = 0;
        for (const auto& [v, spot] : option.sewn) {
          for (const int w : mates_[v]) {
            if (!laid_[static_cast<std::size_t>(garment_.vertex_panel[w])]) continue;
            gap += (at(spot, spot.weight, result_.x) - result_.x.row(w).transpose()).norm();
            ++count;
          }
        }
        Candidate candidate = option.candidate;
        candidate.sewn = count > 0;
        candidate.place.gap = count > 0 ? gap / count : 0;
        if (candidate.place.gap > kFarOff) continue;
        candidate.cost = candidate.place.gap + kUncovered * (1 - option.covered) + (candidate.place.face_inwards == layer.outside ? kTurnedOver : 0);
        list.push_back(candidate);
      }
    }
    return list;
  }

  std::vector<Option> options(const mesh::FreeLayer& layer, int panel, int on) {
    std::vector<Option> list;
    std::vector<Vector2d> from, to;
    const std::vector<int>& members = members_[static_cast<std::size_t>(panel)];
    for (const int v : members) {
      const auto it = mates_.find(v);
      if (it == mates_.end()) continue;
      for (const int w : it->second) {
        if (garment_.vertex_panel[w] != on) continue;
        from.emplace_back(garment_.uv.row(v).transpose());
        to.emplace_back(garment_.uv.row(w).transpose());
      }
    }
    double spread = 0;
    for (const Vector2d& p : from) spread = std::max(spread, (p - from.front()).norm());
    const bool twins = garment_.panels[static_cast<std::size_t>(panel)].mirrored == garment_.panels[static_cast<std::size_t>(on)].mirrored;
    const Sheet& under = sheet(on);
    const auto consider = [&](bool reflected, const Matrix2d& turn, const Vector2d& shift) {
      Option option;
      std::size_t looked_at = 0;
      for (std::size_t i = 0; i < members.size(); i += std::max<std::size_t>(members.size() / kSamples, 1), ++looked_at) {
        option.covered += under.locate(turn * garment_.uv.row(members[i]).transpose() + shift).inside;
      }
      option.covered /= static_cast<double>(std::max<std::size_t>(looked_at, 1));
      if (option.covered < kOverlap) return;
      for (const int v : members) {
        if (mates_.count(v)) option.sewn.emplace_back(v, under.locate(turn * garment_.uv.row(v).transpose() + shift));
      }
      option.candidate.on = layer.on;
      std::sort(option.candidate.on.begin(), option.candidate.on.end());
      option.candidate.outside = layer.outside;
      option.candidate.place = {panel, on, turn, shift, (inwards_[static_cast<std::size_t>(on)] != 0) != reflected, 0};
      list.push_back(std::move(option));
    };
    // In the coordinates of the draft, unless that is far from where it is sewn.
    for (const bool reflected : {false, true}) {
      if (!twins && !reflected) continue;
      const Matrix2d turn = Vector2d(reflected ? -1 : 1, 1).asDiagonal();
      double off = 0;
      for (std::size_t i = 0; i < from.size(); ++i) off += (turn * from[i] - to[i]).norm() / static_cast<double>(from.size());
      if (off < kDraftOff) consider(reflected, turn, Vector2d::Zero());
    }
    if (!list.empty() || spread < kSpread) return list;
    for (const bool reflected : {false, true}) {
      const auto [turn, shift] = rigid(from, to, reflected);
      consider(reflected, turn, shift);
    }
    return list;
  }

  Issues issues() const {
    Issues issues;
    for (const mesh::FreeLayer& layer : garment_.free_layers) {
      std::string on;
      for (const int p : layer.on) on += (on.empty() ? "" : ", ") + garment_.panels[static_cast<std::size_t>(p)].name;
      for (const int p : layer.panels) {
        if (laid_[static_cast<std::size_t>(p)]) continue;
        issues.push_back({.code = "free_layer", .place = {.item = "free layer " + layer.name + ", panel " + garment_.panels[static_cast<std::size_t>(p)].name},
                          .what = "neither its coordinates nor its seams bring it onto one of the panels that it lies on (" + on + ")",
                          .remedy = "draw it in the coordinates of its panel, or sew or tack it to it at two points at least", .category = Category::input});
      }
    }
    return issues;
  }

  // Normals of the face side, of unit length.
  void find_normals(int panel) {
    const std::vector<int>& members = members_[static_cast<std::size_t>(panel)];
    for (Eigen::Index f = 0; f < garment_.face_count(); ++f) {
      if (garment_.face_panel[f] != panel) continue;
      const Vector3d a = result_.x.row(garment_.faces(f, 0)), b = result_.x.row(garment_.faces(f, 1)), c = result_.x.row(garment_.faces(f, 2));
      for (int k = 0; k < 3; ++k) normals_.row(garment_.faces(f, k)) += (b - a).cross(c - a).transpose();
    }
    const auto normalize = [&] {
      for (const int v : members) normals_.row(v) /= std::max(normals_.row(v).norm(), 1e-18);
    };
    normalize();
    for (int round = 0; round < kSmooth; ++round) {
      std::vector<Vector3d> next;
      for (const int v : members) {
        Vector3d sum = 2 * normals_.row(v).transpose();
        for (const int w : neighbours_[static_cast<std::size_t>(v)]) sum += normals_.row(w).transpose();
        next.push_back(sum);
      }
      for (std::size_t i = 0; i < members.size(); ++i) normals_.row(members[i]) = next[i].transpose();
      normalize();
    }
  }

  void lay(const Candidate& candidate) {
    const LayerPlace& place = candidate.place;
    const auto panel = static_cast<std::size_t>(place.panel), on = static_cast<std::size_t>(place.on);
    // Outwards is the face side, or the back of a panel that looks at the body.
    const double side = (candidate.outside ? 1 : -1) * (inwards_[on] ? -1 : 1);
    std::vector<char> beyond(static_cast<std::size_t>(garment_.vertex_count()), 0);
    for (const int v : members_[panel]) {
      distance_[static_cast<std::size_t>(v)] = gap_;
      drawn_[static_cast<std::size_t>(v)] = kDrawnIn * gap_;
      beyond[static_cast<std::size_t>(v)] = !find_base(v, candidate, side);
    }
    spread_over_darts(place.panel, beyond);
    over_neighbours(candidate, beyond);
    for (const int v : members_[panel]) set(v);
    inwards_[panel] = place.face_inwards;
    laid_[panel] = 1;
    laid_by_[panel] = {candidate, side};
    find_normals(place.panel);
    result_.places.push_back(place);
  }

  // ret  whether it is over its cloth
  bool find_base(int v, const Candidate& candidate, double side) {
    const LayerPlace& place = candidate.place;
    const Vector2d uv = garment_.uv.row(v).transpose();
    if (result_.smooth.row(v).isZero()) {
      const Spot spot = sheet(place.on).locate(place.turn * uv + place.shift);
      result_.smooth.row(v) = (at(spot, spot.weight, result_.x) + side * gap_ * at(spot, spot.nearest, normals_).normalized()).transpose();
    }
    const Spot spot = sheet(place.on).locate(place.turn * (uv + drawn_[static_cast<std::size_t>(v)] * inwards_at_border(v)) + place.shift);
    base_.row(v) = at(spot, spot.weight, result_.x).transpose();
    away_.row(v) = side * at(spot, spot.nearest, normals_).normalized().transpose();
    return spot.inside;
  }

  // Where a layer goes on beyond its cloth it lies over what comes next, even if that stands off.
  void over_neighbours(const Candidate& candidate, std::vector<char> near) {
    const std::vector<int>& members = members_[static_cast<std::size_t>(candidate.place.panel)];
    if (std::none_of(members.begin(), members.end(), [&](int v) { return near[static_cast<std::size_t>(v)] != 0; })) return;
    for (int ring = 0; ring < kRings; ++ring) {
      const std::vector<char> last = near;
      for (const int v : members) {
        for (const int w : neighbours_[static_cast<std::size_t>(v)]) near[static_cast<std::size_t>(v)] |= last[static_cast<std::size_t>(w)];
      }
    }
    for (Eigen::Index f = 0; f < garment_.face_count(); ++f) {
      const int panel = garment_.face_panel[f];
      if (panel == candidate.place.on || !laid_[static_cast<std::size_t>(panel)] || !std::binary_search(candidate.on.begin(), candidate.on.end(), panel)) continue;
      const Vector3d a = result_.x.row(garment_.faces(f, 0)), b = result_.x.row(garment_.faces(f, 1)), c = result_.x.row(garment_.faces(f, 2));
      const Vector3d cross = (b - a).cross(c - a);
      const double area = cross.norm();
      if (area < 1e-14) continue;
      const Vector3d n = cross / area * ((candidate.outside ? 1 : -1) * (inwards_[static_cast<std::size_t>(panel)] ? -1 : 1));
      for (const int v : members) {
        const Vector3d p = base_.row(v).transpose() + distance_[static_cast<std::size_t>(v)] * away_.row(v).transpose(), out = away_.row(v).transpose();
        if (!near[static_cast<std::size_t>(v)] || out.dot(n) < kAlike || (p - a).squaredNorm() > 4 * kStandsOff * kStandsOff) continue;
        const double lack = gap_ - (p - a).dot(n);
        if (lack <= 0 || lack > kStandsOff) continue;
        const double wa = (c - b).cross(p - b).dot(cross), wb = (a - c).cross(p - c).dot(cross), least = -0.1 * area * area;
        if (wa < least || wb < least || area * area - wa - wb < least) continue;
        distance_[static_cast<std::size_t>(v)] += lack / out.dot(n);
      }
    }
  }

  void set(int v) { result_.x.row(v) = base_.row(v) + distance_[static_cast<std::size_t>(v)] * away_.row(v); }

  // In the panel's plane; zero where v is not on the border [unit].
  Vector2d inwards_at_border(int v) const {
    Vector2d sum = Vector2d::Zero();
    if (const auto it = border_normals_.find(v); it != border_normals_.end()) sum = it->second;
    const double length = sum.norm();
    return length > 1e-9 ? Vector2d(sum / length) : Vector2d::Zero();
  }

  // Whether its triangles stay the right way up when it is drawn in further: turned over between two sheets they would stay so.
  bool can_be_drawn(int v) const {
    const auto at = [&](int w, double more) {
      return Vector2d(garment_.uv.row(w).transpose() + (drawn_[static_cast<std::size_t>(w)] + more) * inwards_at_border(w));
    };
    for (const int f : faces_at_[static_cast<std::size_t>(v)]) {
      std::array<Vector2d, 3> flat, drawn;
      for (std::size_t k = 0; k < 3; ++k) {
        const int w = garment_.faces(f, static_cast<int>(k));
        flat[k] = garment_.uv.row(w).transpose();
        drawn[k] = at(w, w == v ? kDraw : 0.0);
      }
      if (cross(drawn[1] - drawn[0], drawn[2] - drawn[0]) < kFlattest * cross(flat[1] - flat[0], flat[2] - flat[0])) return false;
    }
    return true;
  }

  // What lies off the cloth, but inside the layer's panel.
  void spread_over_darts(int panel, const std::vector<char>& beyond) {
    std::set<int> seen;
    for (const int start : members_[static_cast<std::size_t>(panel)]) {
      if (!beyond[static_cast<std::size_t>(start)] || seen.count(start)) continue;
      std::vector<int> piece{start};
      seen.insert(start);
      bool enclosed = true;
      for (std::size_t i = 0; i < piece.size(); ++i) {
        enclosed = enclosed && !on_border_[static_cast<std::size_t>(piece[i])];
        for (const int w : neighbours_[static_cast<std::size_t>(piece[i])]) {
          if (beyond[static_cast<std::size_t>(w)] && seen.insert(w).second) piece.push_back(w);
        }
      }
      if (!enclosed) continue;
      for (int sweep = 0; sweep < kFill; ++sweep) {
        for (const int v : piece) {
          Vector3d sum = Vector3d::Zero(), direction = Vector3d::Zero();
          const auto& around = neighbours_[static_cast<std::size_t>(v)];
          for (const int w : around) sum += base_.row(w).transpose(), direction += away_.row(w).transpose();
          base_.row(v) = sum.transpose() / static_cast<double>(around.size());
          if (direction.norm() > 1e-9) away_.row(v) = direction.normalized().transpose();
        }
      }
    }
  }

  // Whether a layer's vertex lies on the cloth at another vertex.
  bool lies_on(int v, int other) const {
    const Candidate& candidate = laid_by_[static_cast<std::size_t>(garment_.vertex_panel[v])].first;
    const int panel = garment_.vertex_panel[other];
    if (panel == candidate.place.on) return true;
    const double drawn = drawn_[static_cast<std::size_t>(v)];
    if (!std::binary_search(candidate.on.begin(), candidate.on.end(), panel) || (on_border_[static_cast<std::size_t>(v)] && drawn < kDrawn)) return false;
    const double side = (candidate.outside ? 1 : -1) * (inwards_[static_cast<std::size_t>(panel)] ? -1 : 1);
    return side * away_.row(v).dot(normals_.row(other)) > kAlike;
  }

  // Layers that cut other cloth move: away from their own, back from the border, or nearer to their own.
  // What that does not take apart is pulled out.
  void part() {
    const contact::Surface cloth = contact::make_surface(static_cast<int>(result_.x.rows()), garment_.faces, mesh::particles(garment_));
    std::vector<contact::FacePair> cuts;
    for (int round = 0; round <= kPushes; ++round) {
      cuts = contact::self_intersections(cloth, result_.x);
      if (round == kPushes) break;
      std::set<int> pushed, pulled;
      const auto meet = [&](int v, int other) {
        if (free_[static_cast<std::size_t>(garment_.vertex_panel[v])]) (lies_on(v, other) ? pushed : pulled).insert(v);
      };
      for (const contact::FacePair& pair : cuts) {
        for (int k = 0; k < 3; ++k) {
          meet(garment_.faces(pair.a, k), garment_.faces(pair.b, 0));
          meet(garment_.faces(pair.b, k), garment_.faces(pair.a, 0));
        }
      }
      if (pushed.empty() && pulled.empty()) break;
      for (const int v : pulled) {
        if (pushed.count(v)) continue;
        double& drawn = drawn_[static_cast<std::size_t>(v)];
        if (on_border_[static_cast<std::size_t>(v)] && drawn < kDrawn && can_be_drawn(v)) {
          drawn += kDraw;
          const auto& [candidate, side] = laid_by_[static_cast<std::size_t>(garment_.vertex_panel[v])];
          find_base(v, candidate, side);
        } else {
          distance_[static_cast<std::size_t>(v)] *= kPull;
        }
        set(v);
      }
      // What is around goes half as far with it.
      std::map<int, double> pushes;
      for (const int v : pushed) {
        pushes[v] = kPush;
        for (const int w : neighbours_[static_cast<std::size_t>(v)]) pushes.try_emplace(w, 0).first->second = pushed.count(w) ? kPush : 0.5 * kPush;
      }
      for (const auto& [v, push] : pushes) {
        distance_[static_cast<std::size_t>(v)] += push;
        set(v);
      }
    }
    if (!cuts.empty()) {
      contact::UntangleOptions options;
      options.passes = kUntanglePasses;
      for (Eigen::Index v = 0; v < result_.x.rows(); ++v) options.held.push_back(!free_[static_cast<std::size_t>(garment_.vertex_panel[v])]);
      contact::Untangled untangled = contact::untangle(cloth, result_.x, options);
      result_.x = untangled.x;
      result_.cuts = untangled.after;
    }
  }

  const mesh::GarmentMesh& garment_;
  double gap_;
  std::vector<char> free_, laid_, inwards_;  // by panel
  std::vector<std::pair<Candidate, double>> laid_by_;  // by panel of a layer: how, and the side of the faces under it
  std::vector<double> drawn_;                // by vertex of a layer: how far its border is drawn in
  Points3 normals_;                          // at the vertices of laid panels
  Points3 base_, away_;                      // of layers: on the cloth under them, and the way off it
  std::vector<double> distance_;             // along away_
  std::vector<std::vector<int>> members_, neighbours_, faces_at_;
  std::vector<char> on_border_;
  std::map<int, Vector2d> border_normals_;   // into the panels, not of unit length
  std::map<int, std::vector<int>> mates_;
  std::vector<std::optional<Sheet>> sheets_;
  std::map<std::pair<int, int>, std::vector<Option>> options_;  // of a panel on another
  LaidLayers result_;
};

}  // namespace

std::vector<char> free_panels(const mesh::GarmentMesh& garment) {
  std::vector<char> free(garment.panels.size(), 0);
  for (const mesh::FreeLayer& layer : garment.free_layers) {
    for (const int panel : layer.panels) free[static_cast<std::size_t>(panel)] = 1;
  }
  return free;
}

Rooms rooms_for_layers(const mesh::GarmentMesh& garment, double gap) {
  const auto vertices = static_cast<std::size_t>(garment.vertex_count());
  std::vector<int> inside(garment.panels.size(), 0), outside(garment.panels.size(), 0);
  for (const mesh::FreeLayer& layer : garment.free_layers) {
    for (const int on : layer.on) {
      for (const int panel : layer.panels) {
        const int steps = garment.panels[static_cast<std::size_t>(panel)].order - garment.panels[static_cast<std::size_t>(on)].order;
        int& most = layer.outside ? outside[static_cast<std::size_t>(on)] : inside[static_cast<std::size_t>(on)];
        most = std::max(most, std::abs(steps));
      }
    }
  }
  Rooms rooms{std::vector<double>(vertices, 0), std::vector<double>(vertices, 0)};
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto panel = static_cast<std::size_t>(garment.vertex_panel[static_cast<Eigen::Index>(v)]);
    rooms.inside[v] = gap * inside[panel];
    rooms.outside[v] = gap * outside[panel];
  }
  return rooms;
}

Result<LaidLayers> lay_layers(const mesh::GarmentMesh& garment, const Points3& x, double gap) { return Laying(garment, x, gap).run(); }

}  // namespace toile::placement
