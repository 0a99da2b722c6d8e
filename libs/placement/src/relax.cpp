#include "toile/placement/relax.h"

#include "toile/base/parallel.h"
#include "toile/contact/search.h"
#include "toile/contact/support_field.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace toile::placement {

namespace {

using Eigen::Vector3d;

constexpr int kSubsteps = 8;        // between two searches for contacts
// Momentum (heavy ball): without it the long waves of stretch take tens of times as many sweeps.
constexpr double kCoast = 0.95;
constexpr double kSpeed = 0.001;    // a vertex coasts at most so far in a substep [m]
constexpr double kSeamMove = 0.004; // a seam draws a vertex at most so far in a sweep [m]
constexpr double kClosed = 0.02;    // a seam that starts with a gap below this is held firmly: no limb gets through it [m]
constexpr double kClosedSeam = 0.3; // part of its gap that one sweep closes
constexpr double kFlat = 0.995;     // cosine between the walls of an edge's ends below which its middle has a wall too
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
};

struct Wall {
  Vector3d point, normal;
  bool active = false;
};

// The middle of an edge that bridges a curved part of the support.
struct Middle {
  int a, b;
  Wall wall;
};

double cotangent(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double cross = a.x() * b.y() - a.y() * b.x();
  return a.dot(b) / std::max(std::abs(cross), 1e-12);
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
        bends_(garment.panels.size()) {
    for (const mesh::Weld& weld : garment.welds) closed_.push_back((start.row(weld.a) - start.row(weld.b)).norm() < kClosed);
    for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
      const auto panel = static_cast<std::size_t>(garment.vertex_panel[edge.a]);
      stretches_[panel].push_back({edge.a, edge.b, (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm()});
      if (edge.faces.size() == 2) bends_[panel].push_back(make_bend(edge));
    }
  }

  Points3 run() {
    const int total = options_.closing_steps + options_.swelling_steps + options_.settling_steps + options_.polishing_steps;
    int done = 0;
    const auto tell = [&] {
      if (options_.progress) options_.progress(static_cast<double>(++done) / std::max(total, 1));
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
    for (int i = 0; i < options_.polishing_steps; ++i, tell()) {
      if (i % 5 == 0) {
        const StrainSummary strain = own_strain();
        if (strain.largest <= options_.max_strain && strain.rms <= options_.rms_strain) break;
      }
      step(1, {.sweeps = 4, .seam = 0, .closed_seam = 0, .bending = 0});
    }
    return x_;
  }

 private:
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
    return bend;
  }

  // The wall of each vertex: the tangent plane at the closest point of the support. The search is done in the true
  // support's world; a plane stays a plane when that world is flattened.
  void find_walls(double depth) {
    Flattening flattening = options_.flattening;
    flattening.depth = depth;
    Points3 q(x_.rows(), 3);
    parallel_for(walls_.size(), 512, [&](std::size_t i) {
      const auto row = static_cast<Eigen::Index>(i);
      q.row(row) = flattening.restored(x_.row(row).transpose()).transpose();
    });
    field_.nearest(q, kReach / depth, near_, warm_);
    parallel_for(walls_.size(), 512, [&](std::size_t i) {
      const contact::SurfacePoint& p = near_[i];
      Wall& wall = walls_[i];
      wall.active = p.face >= 0;
      if (!wall.active) return;
      wall.point = flattening.flattened(p.point);
      wall.normal = flattening.flattened_normal(p.normal, p.point);
    });
    // Edges over a curved part of the support: their middles must stay outside too.
    middles_.clear();
    for (const auto& list : stretches_) {
      for (const Stretch& c : list) {
        const Wall &a = walls_[static_cast<std::size_t>(c.a)], &b = walls_[static_cast<std::size_t>(c.b)];
        if (!a.active || !b.active || a.normal.dot(b.normal) > kFlat) continue;
        middles_.push_back({c.a, c.b, {}});
      }
    }
    q.resize(static_cast<Eigen::Index>(middles_.size()), 3);
    for (std::size_t i = 0; i < middles_.size(); ++i) {
      const Vector3d middle = 0.5 * (x_.row(middles_[i].a) + x_.row(middles_[i].b)).transpose();
      q.row(static_cast<Eigen::Index>(i)) = flattening.restored(middle).transpose();
    }
    field_.nearest(q, kReach / depth, near_, warm_middles_);
    for (std::size_t i = 0; i < middles_.size(); ++i) {
      const contact::SurfacePoint& p = near_[i];
      Wall& wall = middles_[i].wall;
      wall.active = p.face >= 0;
      if (!wall.active) continue;
      wall.point = flattening.flattened(p.point);
      wall.normal = flattening.flattened_normal(p.normal, p.point);
    }
  }

  void sweep_panel(std::size_t panel, double bending, bool forward) {
    if (bending > 0) {
      for (const Bend& bend : bends_[panel]) {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (std::size_t k = 0; k < 4; ++k) sum += bend.k[k] * x_.row(bend.v[k]);
        sum *= bending / bend.k_sq;
        for (std::size_t k = 0; k < 4; ++k) x_.row(bend.v[k]) -= bend.k[k] * sum;
      }
    }
    const auto project = [&](const Stretch& c) {
      const Eigen::RowVector3d d = x_.row(c.b) - x_.row(c.a);
      const double length = d.norm();
      if (length < 1e-12) return;
      const Eigen::RowVector3d move = (0.5 * (length - c.rest) / length) * d;
      x_.row(c.a) += move;
      x_.row(c.b) -= move;
    };
    const std::vector<Stretch>& list = stretches_[panel];
    if (forward) {
      for (auto it = list.begin(); it != list.end(); ++it) project(*it);
    } else {
      for (auto it = list.rbegin(); it != list.rend(); ++it) project(*it);
    }
  }

  void sweep(const Step& step, bool forward) {
    if (step.seam > 0 || step.closed_seam > 0) {
      for (const mesh::Weld& weld : garment_.welds) {
        const Eigen::RowVector3d d = x_.row(weld.b) - x_.row(weld.a);
        const double length = d.norm();
        const double open = length - 1.5 * options_.thickness;
        if (open <= 0) continue;
        const double part = closed_[static_cast<std::size_t>(&weld - garment_.welds.data())] ? std::max(step.seam, step.closed_seam) : step.seam;
        const double move = std::min(0.5 * part * open, kSeamMove);
        x_.row(weld.a) += (move / length) * d;
        x_.row(weld.b) -= (move / length) * d;
      }
    }
    parallel_for(stretches_.size(), 1, [&](std::size_t panel) { sweep_panel(panel, step.bending, forward); });
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      const contact::Contact& c = contacts_[i];
      const Eigen::RowVector3d& n = normals_[i];
      Eigen::RowVector3d gap = Eigen::RowVector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) gap += c.weight[k] * x_.row(c.node[k]);
      const double lack = options_.thickness - gap.dot(n);
      if (lack <= 0) continue;
      double sum = 0;
      for (double w : c.weight) sum += w * w;
      for (std::size_t k = 0; k < 4; ++k) x_.row(c.node[k]) += (lack * c.weight[k] / sum) * n;
    }
    for (const Middle& middle : middles_) {
      if (!middle.wall.active) continue;
      const Vector3d at = 0.5 * (x_.row(middle.a) + x_.row(middle.b)).transpose();
      const double gap = (at - middle.wall.point).dot(middle.wall.normal) - options_.clearance;
      if (gap >= 0) continue;
      x_.row(middle.a) -= gap * middle.wall.normal.transpose();
      x_.row(middle.b) -= gap * middle.wall.normal.transpose();
    }
    for (std::size_t i = 0; i < walls_.size(); ++i) {
      const Wall& wall = walls_[i];
      if (!wall.active) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double gap = (x_.row(row) - wall.point.transpose()).dot(wall.normal.transpose()) - options_.offset;
      if (gap < 0) x_.row(row) -= gap * wall.normal.transpose();
    }
  }

  void find_contacts() {
    contacts_.clear();
    normals_.clear();
    for (const contact::Contact& c : search_.proximity(x_, x_, {.self = 3 * options_.thickness}).self) {
      if (c.distance < 1e-7) continue;
      Eigen::RowVector3d gap = Eigen::RowVector3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) gap += c.weight[k] * x_.row(c.node[k]);
      contacts_.push_back(c);
      normals_.push_back(gap / c.distance);
    }
  }

  void step(double s, const Step& step) {
    find_walls(s);
    find_contacts();
    const Points3 start = x_;
    for (int k = 0; k < kSubsteps; ++k) {
      before_ = x_;
      x_ += kCoast * v_;
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
  std::vector<char> closed_;  // by weld: nearly closed at the start
  std::vector<contact::Contact> contacts_;
  std::vector<Eigen::RowVector3d> normals_;  // of contacts_
  std::vector<contact::SurfacePoint> near_;
  std::vector<int> warm_, warm_middles_;
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
