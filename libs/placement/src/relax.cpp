#include "toile/placement/relax.h"

#include "toile/base/parallel.h"
#include "toile/contact/search.h"
#include "toile/contact/support_field.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>

namespace toile::placement {

namespace {

using Eigen::Vector3d;

// Momentum (heavy ball): without it the long waves of stretch take tens of times as many sweeps.
constexpr double kCoast = 0.95;
constexpr double kSpeed = 0.001;    // a vertex coasts at most so far in a substep [m]
constexpr double kSeamMove = 0.004; // a seam draws a vertex at most so far in a sweep [m]
constexpr double kClosedSeam = 0.3; // part of its gap that one sweep closes
constexpr double kBent = 0.05;      // an edge with a smaller rest angle counts as flat [rad]
constexpr double kSharp = 1.0;      // from this rest angle the two sheets at a fold may touch [rad]
constexpr double kFoldGap = 0.02;   // distance of the sheets beside a fold over the distance from it
constexpr double kCrease = 0.3;     // part by which a sweep closes a fold that is too open
constexpr double kFlat = 0.995;     // cosine between the walls of an edge's ends below which its middle has a wall too
constexpr double kMoved = 0.0005;  // [m]
constexpr double kTight = 0.8;      // strains above this part of the limit get further sweeps
constexpr int kRings = 5;           // as do so many rings of edges around them
constexpr int kTightSweeps = 12;
constexpr double kReach = 0.03;     // farther from the support than this a vertex needs no plane [m]

struct Stretch {
  int a, b;
  double rest;
};

// In the flat state the weighted sum of the four points vanishes; its length measures the curvature.
// Source: docs/bibliography.md#bergou2006
struct Bend {
  std::array<int, 4> v;
  std::array<double, 4> k;
  double k_sq;
  double rolled = 0;  // length in the rolled state: bending to that much costs nothing
};

// The opposite corners of a bent edge are no farther apart than at its rest angle.
struct Crease {
  int a, b;
  double most;  // [m]
};

// The contact search leaves out pairs that share a vertex, but at a fold just these lie on one another: a vertex beside the
// fold stays on its side of the faces of the other sheet.
struct Guard {
  int vertex;
  std::array<int, 3> face;  // turned so that the vertex belongs in front of it
  double gap;               // wanted [m]
};

struct Wall {
  Vector3d point, normal;
  double offset = 0;               // wanted distance [m]
  bool active = false;
  bool known = false;              // searched for at all
  Vector3d at = Vector3d::Zero();  // where it was searched from
};

// The middle of an edge that bridges a curved part of the support.
struct Middle {
  int a, b;
  const Wall* wall;
};

double cotangent(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double cross = a.x() * b.y() - a.y() * b.x();
  return a.dot(b) / std::max(std::abs(cross), 1e-12);
}

// Neighbours in the list wait for one another's results where they share a vertex: within a short window, edges that do not
// go first. On the whole the order of the list stays, so that a sweep still carries a motion across the panel.
std::vector<Stretch> spread_out(const std::vector<Stretch>& list, Eigen::Index vertices) {
  constexpr std::size_t kWindow = 64, kApart = 6;
  std::vector<Stretch> result;
  result.reserve(list.size());
  std::vector<std::size_t> free(static_cast<std::size_t>(vertices), 0);  // place in the result from which a vertex is free
  std::vector<Stretch> window;
  std::size_t next = 0;
  while (result.size() < list.size()) {
    while (window.size() < kWindow && next < list.size()) window.push_back(list[next++]);
    std::size_t pick = 0, pick_wait = SIZE_MAX;
    for (std::size_t i = 0; i < window.size() && pick_wait > 0; ++i) {
      const std::size_t from = std::max(free[static_cast<std::size_t>(window[i].a)], free[static_cast<std::size_t>(window[i].b)]);
      const std::size_t wait = from > result.size() ? from - result.size() : 0;
      if (wait < pick_wait) {
        pick = i;
        pick_wait = wait;
      }
    }
    const Stretch chosen = window[pick];
    window.erase(window.begin() + static_cast<std::ptrdiff_t>(pick));
    result.push_back(chosen);
    free[static_cast<std::size_t>(chosen.a)] = free[static_cast<std::size_t>(chosen.b)] = result.size() + kApart;
  }
  return result;
}

class Relaxation {
 public:
  Relaxation(const mesh::GarmentMesh& garment, const Points3& start, const mesh::SupportMesh& support, const RelaxOptions& options)
      : garment_(garment),
        options_(options),
        field_(contact::make_surface(static_cast<int>(support.x.rows()), support.faces), support.x),
        search_(contact::make_surface(static_cast<int>(start.rows()), garment.faces), start),
        x_(start),
        v_(Points3::Zero(start.rows(), 3)),
        walls_(static_cast<std::size_t>(start.rows())),
        stretches_(garment.panels.size()),
        bends_(garment.panels.size()),
        creases_(garment.panels.size()),
        guards_(garment.panels.size()),
        free_(static_cast<std::size_t>(start.rows()), 1) {
    if (!options.held.empty()) {
      for (std::size_t v = 0; v < free_.size(); ++v) free_[v] = !options.held[static_cast<std::size_t>(garment.vertex_panel[static_cast<Eigen::Index>(v)])];
    }
    std::set<std::pair<int, int>> bent;
    for (const mesh::Hinge& hinge : garment.hinges) {
      if (std::abs(hinge.rest_angle) < kBent) continue;
      bent.insert(std::minmax(hinge.v0, hinge.v1));
      const auto panel = static_cast<std::size_t>(garment.vertex_panel[hinge.v0]);
      if (!free(hinge.v0)) continue;
      if (garment.vertex_panel[hinge.o0] != garment.vertex_panel[hinge.v0] || garment.vertex_panel[hinge.o1] != garment.vertex_panel[hinge.v0]) continue;
      creases_[panel].push_back(make_crease(hinge));
    }
    make_guards();
    for (const mesh::Weld& weld : garment.welds) closed_.push_back((start.row(weld.a) - start.row(weld.b)).norm() < options.closed);
    for (const mesh::Fastener& fastener : garment.fasteners) {
      fastened_.push_back((start.row(fastener.a) - start.row(fastener.b)).norm() < fastener.length + options.closed);
    }
    for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
      const auto panel = static_cast<std::size_t>(garment.vertex_panel[edge.a]);
      if (!free(edge.a)) continue;
      stretches_[panel].push_back({edge.a, edge.b, (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm()});
      if (edge.faces.size() == 2 && !bent.count({edge.a, edge.b})) bends_[panel].push_back(make_bend(edge));
    }
    std::size_t count = 0;
    for (auto& list : stretches_) {
      list = spread_out(list, start.rows());
      count += list.size();
    }
    bridges_.resize(count);
    double sum = 0;
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) sum += c.rest;
    }
    // Neighbours along the cloth are no contacts.
    reach_ = std::clamp(0.4 * sum / static_cast<double>(std::max<std::size_t>(count, 1)), 1.2 * options.thickness, 3 * options.thickness);
    double room = 0;
    for (const auto* list : {&options.room_inside, &options.room_outside}) {
      for (const double r : *list) room = std::max(room, r);
    }
    reach_ = std::max(reach_, 1.2 * (options.thickness + room));
    warm_.assign(walls_.size(), -1);
    warm_middles_.assign(count, -1);
  }

  Points3 run() {
    const int total = options_.closing_steps + options_.swelling_steps + options_.settling_steps + options_.polishing_steps;
    int done = 0;
    const auto tell = [&](int steps = 1) {
      done += steps;
      if (options_.progress) options_.progress(static_cast<double>(done) / std::max(total, 1));
    };
    const double s0 = options_.flattening.depth, seam = options_.seam, bending = options_.bending;
    for (int i = 0; i < options_.closing_steps; ++i, tell()) step(s0, {.sweeps = 3, .seam = seam, .closed_seam = kClosedSeam, .bending = bending});
    for (int i = 0; i < options_.swelling_steps; ++i, tell()) {
      const double f = static_cast<double>(i + 1) / options_.swelling_steps;
      step(s0 + (1 - s0) * f, {.sweeps = 3, .seam = seam, .closed_seam = kClosedSeam, .bending = bending});
    }
    for (int i = 0; i < options_.settling_steps; ++i, tell()) {
      const double rest = 1 - static_cast<double>(i + 1) / options_.settling_steps;
      step(1, {.sweeps = 4, .seam = seam * rest, .closed_seam = kClosedSeam * rest, .bending = bending * rest});
    }
    polish(options_.polishing_steps);
    tell(options_.polishing_steps);
    return x_;
  }

 private:
  bool free(int vertex) const { return free_[static_cast<std::size_t>(vertex)] != 0; }

  StrainSummary own_strain() const {
    StrainSummary summary;
    double sum = 0;
    std::size_t count = 0;
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) {
        const double strain = (x_.row(c.a) - x_.row(c.b)).norm() / c.rest - 1;
        summary.largest = std::max(summary.largest, std::abs(strain));
        sum += strain * strain;
      }
      count += list.size();
    }
    summary.rms = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
    return summary;
  }

  // Stretch alone is taken out.
  void polish(int steps) {
    for (int i = 0; i < steps; ++i) {
      if (i % 5 == 0) {
        const StrainSummary strain = own_strain();
        if (strain.largest <= options_.max_strain && strain.rms <= options_.rms_strain) break;
      }
      // Strains that are left then are taken out without it.
      ironing_ = options_.ironing && 3 * i < 2 * steps ? options_.bending * (1 - 1.5 * i / steps) : 0;
      find_tight();
      step(1, {.sweeps = 4, .seam = 0, .closed_seam = 0, .bending = 0});
    }
    tight_.clear();
  }

  struct Step {
    int sweeps;
    double seam, closed_seam, bending;
  };

  Bend make_bend(const mesh::Edge& edge) const {
    const auto opposite = [&](int face) {
      for (int k = 0; k < 3; ++k) {
        const int v = garment_.faces(face, k);
        if (v != edge.a && v != edge.b) return v;
      }
      return -1;
    };
    const int c = opposite(edge.faces[0]), d = opposite(edge.faces[1]);
    const auto uv = [&](int v) { return Eigen::Vector2d(garment_.uv.row(v).transpose()); };
    const Eigen::Vector2d a = uv(edge.a), b = uv(edge.b);
    const double ca = cotangent(b - a, uv(c) - a), cb = cotangent(a - b, uv(c) - b);
    const double da = cotangent(b - a, uv(d) - a), db = cotangent(a - b, uv(d) - b);
    Bend bend{{edge.a, edge.b, c, d}, {cb + db, ca + da, -ca - cb, -da - db}, 0};
    for (double k : bend.k) bend.k_sq += k * k;
    if (options_.rolled.rows() > 0) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) sum += bend.k[k] * options_.rolled.row(bend.v[k]);
      bend.rolled = sum.norm();
    }
    return bend;
  }

  void make_guards() {
    std::map<int, std::map<int, int>> turned;  // crease vertex -> its neighbours along the fold, +1 towards the face side
    for (const mesh::Hinge& hinge : garment_.hinges) {
      if (std::abs(hinge.rest_angle) < kSharp || !free(hinge.v0)) continue;
      turned[hinge.v0][hinge.v1] = turned[hinge.v1][hinge.v0] = hinge.rest_angle > 0 ? 1 : -1;
    }
    if (turned.empty()) return;
    std::map<int, std::vector<int>> faces_at;
    for (Eigen::Index f = 0; f < garment_.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        if (turned.count(garment_.faces(f, k))) faces_at[garment_.faces(f, k)].push_back(static_cast<int>(f));
      }
    }
    for (const auto& [v, along] : turned) {
      const int sign = along.begin()->second;
      const std::vector<int>& fan = faces_at[v];
      // Sides of the fan: faces that share an edge at v that does not run along the fold.
      std::vector<int> side(fan.size(), -1);
      int sides = 0;
      for (std::size_t i = 0; i < fan.size(); ++i) {
        if (side[i] >= 0) continue;
        std::vector<std::size_t> stack{i};
        side[i] = sides;
        while (!stack.empty()) {
          const std::size_t here = stack.back();
          stack.pop_back();
          for (std::size_t j = 0; j < fan.size(); ++j) {
            if (side[j] >= 0) continue;
            for (int k = 0; k < 3; ++k) {
              const int w = garment_.faces(fan[here], k);
              if (w == v || along.count(w) || !(garment_.faces.row(fan[j]).array() == w).any()) continue;
              side[j] = sides;
              stack.push_back(j);
              break;
            }
          }
        }
        ++sides;
      }
      for (std::size_t i = 0; i < fan.size(); ++i) {
        for (std::size_t j = 0; j < fan.size(); ++j) {
          if (side[i] == side[j]) continue;
          for (int k = 0; k < 3; ++k) {
            const int w = garment_.faces(fan[j], k);
            if (w == v || along.count(w)) continue;
            Guard guard{w, {garment_.faces(fan[i], 0), garment_.faces(fan[i], 1), garment_.faces(fan[i], 2)}, 0};
            if (sign < 0) std::swap(guard.face[1], guard.face[2]);
            guard.gap = kFoldGap * distance_from_fold(v, along, w);
            guards_[static_cast<std::size_t>(garment_.vertex_panel[v])].push_back(guard);
          }
        }
      }
    }
  }

  double distance_from_fold(int v, const std::map<int, int>& along, int w) const {
    const Eigen::Vector2d at = garment_.uv.row(v).transpose(), p = garment_.uv.row(w).transpose();
    double distance = (p - at).norm();
    for (const auto& [end, sign] : along) {
      const Eigen::Vector2d d = Eigen::Vector2d(garment_.uv.row(end).transpose()) - at;
      const double t = std::clamp((p - at).dot(d) / d.squaredNorm(), 0.0, 1.0);
      distance = std::min(distance, (p - at - t * d).norm());
    }
    return distance;
  }

  // In front of its face's plane, where it lies over the face.
  void keep(const Guard& guard) {
    const Eigen::RowVector3d a = x_.row(guard.face[0]), b = x_.row(guard.face[1]), c = x_.row(guard.face[2]), p = x_.row(guard.vertex);
    const Eigen::RowVector3d cross = (b - a).cross(c - a);
    const double area = cross.norm();
    if (area < 1e-14) return;
    const Eigen::RowVector3d n = cross / area;
    const double lack = guard.gap - (p - a).dot(n);
    if (lack <= 0) return;
    const double wa = (c - b).cross(p - b).dot(n) / area, wb = (a - c).cross(p - c).dot(n) / area, wc = 1 - wa - wb;
    if (std::min({wa, wb, wc}) < -0.2) return;
    const double move = std::min(lack, 2 * options_.thickness) / (1 + wa * wa + wb * wb + wc * wc);
    x_.row(guard.vertex) += move * n;
    x_.row(guard.face[0]) -= move * wa * n;
    x_.row(guard.face[1]) -= move * wb * n;
    x_.row(guard.face[2]) -= move * wc * n;
  }

  Crease make_crease(const mesh::Hinge& hinge) const {
    const auto uv = [&](int v) { return Eigen::Vector2d(garment_.uv.row(v).transpose()); };
    const Eigen::Vector2d along = (uv(hinge.v1) - uv(hinge.v0)).normalized();
    const auto height = [&](int v) { return std::abs(along.x() * (uv(v) - uv(hinge.v0)).y() - along.y() * (uv(v) - uv(hinge.v0)).x()); };
    const double shift = along.dot(uv(hinge.o0) - uv(hinge.o1)), h0 = height(hinge.o0), h1 = height(hinge.o1);
    const double distance_sq = shift * shift + h0 * h0 + h1 * h1 + 2 * h0 * h1 * std::cos(hinge.rest_angle);
    return {hinge.o0, hinge.o1, std::max(std::sqrt(std::max(distance_sq, 0.0)), 2 * options_.thickness)};
  }

  // The wall of each vertex: the tangent plane at the closest point of the support. The search is done in the true
  // support's world; a plane stays a plane when that world is flattened.
  // A plane is good until its vertex has moved by kMoved: over a support of curvature k it is then off by k kMoved^2 / 2.
  void find_walls(double depth) {
    Flattening flattening = options_.flattening;
    flattening.depth = depth;
    if (depth != walls_depth_) {
      for (Wall& wall : walls_) wall.known = false;
      for (Wall& wall : bridges_) wall.known = false;
      walls_depth_ = depth;
    }
    std::vector<Query> queries;
    for (std::size_t i = 0; i < walls_.size(); ++i) {
      if (!free_[i]) continue;
      const Vector3d at = x_.row(static_cast<Eigen::Index>(i)).transpose();
      if (!walls_[i].known || (at - walls_[i].at).squaredNorm() > kMoved * kMoved) queries.push_back({&walls_[i], at, &warm_[i], options_.room_inside.empty() ? 0.0 : options_.room_inside[i]});
    }
    search(queries, flattening, depth);
    // Edges over a curved part of the support: their middles must stay outside too.
    queries.clear();
    middles_.clear();
    std::size_t index = 0;
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) {
        Wall& wall = bridges_[index];
        int& warm = warm_middles_[index++];
        const Wall &a = walls_[static_cast<std::size_t>(c.a)], &b = walls_[static_cast<std::size_t>(c.b)];
        if (!a.active || !b.active || a.normal.dot(b.normal) > kFlat) continue;
        const Vector3d middle = 0.5 * (x_.row(c.a) + x_.row(c.b)).transpose();
        if (!wall.known || (middle - wall.at).squaredNorm() > kMoved * kMoved) queries.push_back({&wall, middle, &warm});
        middles_.push_back({c.a, c.b, &wall});
      }
    }
    search(queries, flattening, depth);
  }

  struct Query {
    Wall* wall;
    Vector3d at;
    int* warm;
    double room = 0;  // beyond the wanted distance [m]
  };

  void search(const std::vector<Query>& queries, const Flattening& flattening, double depth) {
    Points3 q(static_cast<Eigen::Index>(queries.size()), 3);
    std::vector<int> warm(queries.size());
    parallel_for(queries.size(), 512, [&](std::size_t i) {
      q.row(static_cast<Eigen::Index>(i)) = flattening.restored(queries[i].at).transpose();
      warm[i] = *queries[i].warm;
    });
    field_.nearest(q, kReach / depth, near_, warm);
    parallel_for(queries.size(), 512, [&](std::size_t i) {
      const contact::SurfacePoint& p = near_[i];
      Wall& wall = *queries[i].wall;
      *queries[i].warm = warm[i];
      wall.known = true;
      wall.at = queries[i].at;
      wall.active = p.face >= 0;
      if (!wall.active) return;
      wall.point = flattening.flattened(p.point);
      wall.normal = flattening.flattened_normal(p.normal, p.point);
      wall.offset = queries[i].room + (options_.face_offsets.empty() ? options_.offset : options_.face_offsets[static_cast<std::size_t>(p.face)]);
    });
  }

  // Square roots spared: 1/2 - rest^2 / (length^2 + rest^2) is half the correction to first order, and zero exactly at rest.
  void keep(const Stretch& c) {
    double *a = x_.data() + 3 * c.a, *b = x_.data() + 3 * c.b;
    const double dx = b[0] - a[0], dy = b[1] - a[1], dz = b[2] - a[2];
    const double rest_sq = c.rest * c.rest;
    const double part = 0.5 - rest_sq / (dx * dx + dy * dy + dz * dz + rest_sq);
    a[0] += part * dx, a[1] += part * dy, a[2] += part * dz;
    b[0] -= part * dx, b[1] -= part * dy, b[2] -= part * dz;
  }

  void keep_contact(std::size_t i) {
    const contact::Contact& c = contacts_[i];
    const Eigen::RowVector3d& n = normals_[i];
    Eigen::RowVector3d gap = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) gap += c.weight[k] * x_.row(c.node[k]);
    const double lack = wanted_[i] - gap.dot(n);
    if (lack <= 0) return;
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += free(c.node[k]) ? c.weight[k] * c.weight[k] : 0;
    if (sum < 1e-9) return;
    for (std::size_t k = 0; k < 4; ++k) {
      if (free(c.node[k])) x_.row(c.node[k]) += (lack * c.weight[k] / sum) * n;
    }
  }

  void keep_outside(std::size_t vertex) {
    const Wall& wall = walls_[vertex];
    if (!wall.active) return;
    const auto row = static_cast<Eigen::Index>(vertex);
    const double gap = (x_.row(row) - wall.point.transpose()).dot(wall.normal.transpose()) - wall.offset;
    if (gap < 0) x_.row(row) -= gap * wall.normal.transpose();
  }

  void keep_sides() {
    if (options_.sides.panels.empty()) return;
    for (Eigen::Index v = 0; v < x_.rows(); ++v) {
      const double side = options_.sides.panels[static_cast<std::size_t>(garment_.vertex_panel[v])];
      if (side == 0 || x_(v, 1) > options_.sides.below) continue;
      const double gap = side * (x_(v, 0) - options_.sides.x) - 0.5 * options_.thickness;
      if (gap < 0) x_(v, 0) -= side * gap;
    }
  }

  void flatten(const Bend& bend, double part) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) sum += bend.k[k] * x_.row(bend.v[k]);
    if (bend.rolled > 0) {
      const double length = sum.norm();
      if (length <= bend.rolled) return;
      sum *= 1 - bend.rolled / length;
    }
    sum *= part / bend.k_sq;
    for (std::size_t k = 0; k < 4; ++k) x_.row(bend.v[k]) -= bend.k[k] * sum;
  }

  void sweep_panel(std::size_t panel, double bending, bool forward) {
    if (bending > 0) {
      for (const Bend& bend : bends_[panel]) flatten(bend, bending);
    }
    if (bending > 0) {
      for (const Crease& crease : creases_[panel]) {
        const Eigen::RowVector3d d = x_.row(crease.b) - x_.row(crease.a);
        const double length = d.norm();
        if (length <= crease.most) continue;
        const Eigen::RowVector3d move = std::min(0.5 * kCrease * (length - crease.most), kSeamMove) / length * d;
        x_.row(crease.a) += move;
        x_.row(crease.b) -= move;
      }
    }
    const std::vector<Stretch>& list = stretches_[panel];
    if (forward) {
      for (auto it = list.begin(); it != list.end(); ++it) keep(*it);
    } else {
      for (auto it = list.rbegin(); it != list.rend(); ++it) keep(*it);
    }
    for (const Guard& guard : guards_[panel]) keep(guard);
  }

  // What a held one does not move, the other does.
  void draw_together(int a, int b, const Eigen::RowVector3d& move) {
    if (free(a)) x_.row(a) += free(b) ? move : 2 * move;
    if (free(b)) x_.row(b) -= free(a) ? move : 2 * move;
  }

  void sweep(const Step& step, bool forward) {
    if (step.seam > 0 || step.closed_seam > 0) {
      for (std::size_t w = 0; w < garment_.welds.size(); ++w) {
        const mesh::Weld& weld = garment_.welds[w];
        const Eigen::RowVector3d d = x_.row(weld.b) - x_.row(weld.a);
        const double length = d.norm();
        const double open = length - 1.5 * options_.thickness;
        if (open <= 0) continue;
        const double part = closed_[w] ? std::max(step.seam, step.closed_seam) : step.seam;
        draw_together(weld.a, weld.b, (std::min(0.5 * part * open, kSeamMove) / length) * d);
      }
    }
    if (step.closed_seam > 0) {
      for (const Target& target : options_.targets) {
        const Eigen::RowVector3d d = target.at.transpose() - x_.row(target.vertex);
        const double length = d.norm();
        if (length > 0) x_.row(target.vertex) += std::min(step.closed_seam, kSeamMove / length) * d;
      }
    }
    // What is buttoned stays so, or the fronts would part as seams let go.
    for (std::size_t i = 0; i < garment_.fasteners.size(); ++i) {
      const mesh::Fastener& fastener = garment_.fasteners[i];
      const double part = fastened_[i] ? std::max(step.seam, options_.fasten) : step.seam;
      if (!fastener.closed || part <= 0) continue;
      const Eigen::RowVector3d d = x_.row(fastener.b) - x_.row(fastener.a);
      const double length = d.norm();
      const double open = length - std::max(fastener.length, 1.5 * options_.thickness) - (step.seam > 0 ? 0.0 : options_.loose);
      if (open <= 0) continue;
      draw_together(fastener.a, fastener.b, (std::min(0.5 * part * open, kSeamMove) / length) * d);
    }
    parallel_for(stretches_.size(), 1, [&](std::size_t panel) { sweep_panel(panel, step.bending, forward); });
    for (std::size_t i = 0; i < contacts_.size(); ++i) keep_contact(i);
    for (const Middle& middle : middles_) {
      if (!middle.wall->active) continue;
      const Vector3d at = 0.5 * (x_.row(middle.a) + x_.row(middle.b)).transpose();
      const double gap = (at - middle.wall->point).dot(middle.wall->normal) - options_.clearance;
      if (gap >= 0) continue;
      x_.row(middle.a) -= gap * middle.wall->normal.transpose();
      x_.row(middle.b) -= gap * middle.wall->normal.transpose();
    }
    for (std::size_t i = 0; i < walls_.size(); ++i) keep_outside(i);
    keep_sides();
  }

  // The edges with the largest strains, and a few rings around them: further sweeps there cost little and spare many of the whole.
  void find_tight() {
    std::vector<char> near(walls_.size(), 0);
    bool any = false;
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) {
        const double ratio_sq = (x_.row(c.a) - x_.row(c.b)).squaredNorm() / (c.rest * c.rest);
        if (std::abs(ratio_sq - 1) < 2 * kTight * options_.max_strain) continue;
        near[static_cast<std::size_t>(c.a)] = near[static_cast<std::size_t>(c.b)] = 1;
        any = true;
      }
    }
    tight_.clear();
    tight_vertices_.clear();
    if (!any) return;
    for (int ring = 0; ring < kRings; ++ring) {
      std::vector<char> next = near;
      for (const auto& list : stretches_) {
        for (const Stretch& c : list) {
          if (near[static_cast<std::size_t>(c.a)] || near[static_cast<std::size_t>(c.b)]) next[static_cast<std::size_t>(c.a)] = next[static_cast<std::size_t>(c.b)] = 1;
        }
      }
      near = std::move(next);
    }
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) {
        if (near[static_cast<std::size_t>(c.a)] && near[static_cast<std::size_t>(c.b)]) tight_.push_back(c);
      }
    }
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (near[i]) tight_vertices_.push_back(i);
    }
    tight_bends_.clear();
    if (ironing_ > 0) {
      for (const auto& list : bends_) {
        for (const Bend& bend : list) {
          if (std::all_of(bend.v.begin(), bend.v.end(), [&](int v) { return near[static_cast<std::size_t>(v)] != 0; })) tight_bends_.push_back(bend);
        }
      }
    }
    is_tight_ = std::move(near);
  }

  void sweep_tight() {
    if (tight_.empty()) return;
    std::vector<std::size_t> contacts;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      for (int v : contacts_[i].node) {
        if (!is_tight_[static_cast<std::size_t>(v)]) continue;
        contacts.push_back(i);
        break;
      }
    }
    for (int k = 0; k < kTightSweeps; ++k) {
      if (k % 4 == 0) {
        for (const Bend& bend : tight_bends_) flatten(bend, ironing_);
      }
      if (k % 2 == 0) {
        for (auto it = tight_.begin(); it != tight_.end(); ++it) keep(*it);
      } else {
        for (auto it = tight_.rbegin(); it != tight_.rend(); ++it) keep(*it);
      }
      for (std::size_t i : contacts) keep_contact(i);
      for (std::size_t i : tight_vertices_) keep_outside(i);
    }
  }

  void find_contacts() {
    contacts_.clear();
    normals_.clear();
    wanted_.clear();
    const bool rooms = !options_.room_inside.empty();
    if (rooms) find_sides();
    for (const contact::Contact& c : search_.proximity(x_, x_, {.self = reach_}).self) {
      if (c.distance < 1e-7 || std::none_of(c.node.begin(), c.node.end(), [&](int v) { return free(v); })) continue;
      Eigen::RowVector3d gap = Eigen::RowVector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) gap += c.weight[k] * x_.row(c.node[k]);
      contacts_.push_back(c);
      normals_.push_back(gap / c.distance);
      // Beside a fold the sheets come as near as their distance along the cloth makes them.
      double wanted = options_.thickness;
      if (garment_.vertex_panel[c.node[0]] == garment_.vertex_panel[c.node[3]]) {
        Eigen::RowVector2d way = Eigen::RowVector2d::Zero();
        for (std::size_t k = 0; k < 4; ++k) way += c.weight[k] * garment_.uv.row(c.node[k]);
        wanted = std::min(wanted, kFoldGap * way.norm());
      } else if (rooms) {
        wanted += room_between(c, normals_.back());
      }
      wanted_.push_back(wanted);
    }
  }

  // Face sides of the vertices, as they lie.
  void find_sides() {
    sides_ = Points3::Zero(x_.rows(), 3);
    for (Eigen::Index f = 0; f < garment_.face_count(); ++f) {
      const Eigen::RowVector3d a = x_.row(garment_.faces(f, 0)), b = x_.row(garment_.faces(f, 1)), c = x_.row(garment_.faces(f, 2));
      const Eigen::RowVector3d cross = (b - a).cross(c - a);
      for (int k = 0; k < 3; ++k) sides_.row(garment_.faces(f, k)) += cross;
    }
  }

  // Of the layers that lie on the two sheets of a contact, on the sides that look at one another.
  // n  from the second to the first [unit]
  double room_between(const contact::Contact& c, const Eigen::RowVector3d& n) const {
    const auto first = static_cast<std::size_t>(contact::first_count(c.kind));
    double room[2] = {0, 0};
    for (std::size_t k = 0; k < 4; ++k) {
      const bool faces_other = sides_.row(c.node[k]).dot(k < first ? -n : n) > 0;
      const auto v = static_cast<std::size_t>(c.node[k]);
      double& side = room[k < first ? 0 : 1];
      side = std::max(side, faces_other ? options_.room_outside[v] : options_.room_inside[v]);
    }
    return room[0] + room[1];
  }

  void step(double s, const Step& step) {
    find_walls(s);
    find_contacts();
    const Points3 start = x_;
    for (int k = 0; k < options_.substeps; ++k) {
      before_ = x_;
      x_ += kCoast * v_;
      sweep_tight();
      for (int j = 0; j < step.sweeps; ++j) sweep(step, (j + k) % 2 == 0);
      v_ = x_ - before_;
      for (Eigen::Index i = 0; i < v_.rows(); ++i) {
        const double speed = v_.row(i).norm();
        if (speed > kSpeed) v_.row(i) *= kSpeed / speed;
      }
    }
    const contact::StepLimit& limit = search_.limit_step(start, x_, start, start);
    if (limit.limited_nodes > 0) {
      x_ = limit.x;
      for (Eigen::Index i = 0; i < v_.rows(); ++i) {
        if (limit.fraction[static_cast<std::size_t>(i)] < 1) v_.row(i).setZero();
      }
    }
  }

  const mesh::GarmentMesh& garment_;
  RelaxOptions options_;
  contact::SupportField field_;
  contact::Search search_;
  Points3 x_, v_, before_;
  std::vector<Wall> walls_;
  std::vector<Middle> middles_;
  std::vector<std::vector<Stretch>> stretches_;  // by panel
  std::vector<std::vector<Bend>> bends_;
  std::vector<std::vector<Crease>> creases_;
  std::vector<std::vector<Guard>> guards_;
  std::vector<char> free_;    // by vertex: it may move
  Points3 sides_;             // normals at the vertices, not of unit length
  std::vector<char> closed_;  // by weld: nearly closed at the start
  std::vector<char> fastened_;  // by fastener: the same
  std::vector<Stretch> tight_;               // while polishing
  std::vector<Bend> tight_bends_;
  double ironing_ = 0;                       // of them: part of a curvature that a sweep takes out
  std::vector<std::size_t> tight_vertices_;  // of tight_
  std::vector<char> is_tight_;               // by vertex
  std::vector<contact::Contact> contacts_;
  std::vector<Eigen::RowVector3d> normals_;  // of contacts_
  std::vector<double> wanted_;               // distance of contacts_ [m]
  std::vector<contact::SurfacePoint> near_;
  std::vector<int> warm_, warm_middles_;
  std::vector<Wall> bridges_;  // of the middles of all edges, panel by panel
  double walls_depth_ = -1;
  double reach_ = 0;  // within which contacts are looked for [m]
};

}  // namespace

Points3 relax(const mesh::GarmentMesh& garment, const Points3& x, const mesh::SupportMesh& support, const RelaxOptions& options) {
  return Relaxation(garment, x, support, options).run();
}

StrainSummary edge_strain(const mesh::GarmentMesh& garment, const Points3& x) {
  StrainSummary summary;
  double sum = 0;
  std::size_t count = 0;
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    const double rest = (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm();
    if (rest <= 0) continue;
    const double strain = (x.row(edge.a) - x.row(edge.b)).norm() / rest - 1;
    summary.largest = std::max(summary.largest, std::abs(strain));
    sum += strain * strain;
    ++count;
  }
  summary.rms = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
  return summary;
}

}  // namespace toile::placement
