#include "toile/dynamics/constraints.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

namespace toile::dynamics {
namespace {

/// Whether a point is inside an outline or within a thousandth of its size of it.
bool inside(const std::vector<std::array<double, 2>>& outline, const Eigen::Vector2d& p) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const auto& c : outline) {
    const Eigen::Vector2d q(c[0], c[1]);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const double tolerance = 1e-6 * (high - low).norm();
  bool in = false;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Eigen::Vector2d a(outline[i][0], outline[i][1]), b(outline[j][0], outline[j][1]), d = b - a;
    const double t = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-300), 0.0, 1.0);
    if ((a + t * d - p).norm() <= tolerance) return true;
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) in = !in;
  }
  return in;
}

std::pair<std::size_t, double> row_at(const std::vector<double>& times, double time) {
  if (time <= times.front()) return {0, 0};
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (time <= times[i]) return {i - 1, (time - times[i - 1]) / (times[i] - times[i - 1])};
  }
  return {times.size() - 1, 0};
}

}  // namespace

double factor_at(const std::vector<double>& times, const std::vector<double>& values, double time) {
  if (times.empty()) return 1;
  const auto [row, part] = row_at(times, time);
  return part == 0 ? values[row] : (1 - part) * values[row] + part * values[row + 1];
}

Motion motion_at(const ConstraintSpec& spec, const Eigen::Vector3d& centre, double time) {
  Motion motion;
  motion.centre = spec.centre ? Eigen::Vector3d(spec.centre->data()) : centre;
  if (spec.times.empty()) return motion;
  const auto [row, part] = row_at(spec.times, time);
  if (!spec.move.empty()) {
    motion.move = Eigen::Vector3d(spec.move[row].data());
    if (part != 0) motion.move = (1 - part) * motion.move + part * Eigen::Vector3d(spec.move[row + 1].data());
  }
  if (!spec.turn.empty()) {
    const double angle = part == 0 ? spec.turn[row] : (1 - part) * spec.turn[row] + part * spec.turn[row + 1];
    motion.turn = Eigen::AngleAxisd(angle, Eigen::Vector3d(spec.axis.data()).normalized()).toRotationMatrix();
  }
  return motion;
}

Result<Selected> select(const mesh::GarmentMesh& garment, const Selection& selection, const std::string& item) {
  Issues issues;
  std::map<int, double> weight;
  const auto wanted = [&](int v) { return selection.region.empty() || inside(selection.region, garment.uv.row(v).transpose()); };
  for (const std::string& name : selection.on) {
    const std::size_t dot = name.find('.');
    const Result<int> panel = mesh::find_panel(garment, name.substr(0, dot));
    if (!panel) {
      append(issues, panel.issues());
      continue;
    }
    if (dot == std::string::npos) {
      // A panel: a third of each face's area to each of its corners that is wanted.
      for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
        if (garment.face_panel[f] != *panel) continue;
        const Eigen::RowVector2d a = garment.uv.row(garment.faces(f, 0)), p = garment.uv.row(garment.faces(f, 1)) - a, q = garment.uv.row(garment.faces(f, 2)) - a;
        const double third = std::abs(p.x() * q.y() - p.y() * q.x()) / 6;
        for (int k = 0; k < 3; ++k) {
          if (wanted(garment.faces(f, k))) weight[garment.faces(f, k)] += third;
        }
      }
      continue;
    }
    const std::string part = name.substr(dot + 1);
    const auto point = std::find_if(garment.points.begin(), garment.points.end(), [&](const mesh::NamedPoint& p) { return p.panel == *panel && p.name == part; });
    if (point != garment.points.end()) {
      if (wanted(point->vertex)) weight[point->vertex] += 1;
      continue;
    }
    const Result<int> run = mesh::find_run(garment, *panel, part);
    if (!run) {
      append(issues, run.issues());
      continue;
    }
    std::vector<mesh::RunVertex> row;
    for (const mesh::RunVertex& v : garment.run_vertices) {
      if (v.run == *run) row.push_back(v);
    }
    if (row.empty()) continue;
    const double begin = row.front().s, length = row.back().s - begin, tolerance = 1e-6;
    const auto part_of = [&](const mesh::RunVertex& v) {
      const double t = length > 0 ? (v.s - begin) / length : 0;
      return t >= selection.from - tolerance && t <= selection.to + tolerance && wanted(v.vertex);
    };
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!part_of(row[i])) continue;
      double& w = weight[row[i].vertex];
      if (i > 0 && part_of(row[i - 1])) w += 0.5 * (row[i].s - row[i - 1].s);
      if (i + 1 < row.size() && part_of(row[i + 1])) w += 0.5 * (row[i + 1].s - row[i].s);
      if (length <= 0) w += 1;
    }
  }
  if (weight.empty() && issues.empty()) {
    issues.push_back(Issue{"empty_selection", {.item = item}, "there is no particle in what it names", "give a larger part or region"});
  }
  if (!issues.empty()) return issues;
  double sum = 0;
  for (const auto& [v, w] : weight) sum += w;
  Selected selected;
  for (const auto& [v, w] : weight) {
    selected.vertices.push_back(v);
    selected.share.push_back(sum > 0 ? w / sum : 1.0 / static_cast<double>(weight.size()));
  }
  return selected;
}

}  // namespace toile::dynamics
