#include "toile/placement/fit_up.h"

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>

namespace toile::placement {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kTurns = 1000;         // local and global steps at the most
constexpr double kStill = 1e-8;      // largest motion of a step at which they end [m]
constexpr double kStraight = 1e-6;   // second moment of points about their line over the first below which they are collinear

struct Polyline {
  std::vector<Vector3d> points;
  std::vector<double> s;
  Vector3d at(double length) const {
    const auto above = std::upper_bound(s.begin() + 1, s.end() - 1, length);
    const auto i = static_cast<std::size_t>(above - s.begin());
    const double t = (length - s[i - 1]) / (s[i] - s[i - 1]);
    return points[i - 1] + std::clamp(t, 0.0, 1.0) * (points[i] - points[i - 1]);
  }
};

std::string known(const auto& map) {
  std::string text;
  for (const auto& [name, value] : map) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

Result<Polyline> polyline(const std::string& name, const FrameCurve& curve, const mesh::SupportMesh& support) {
  Issues issues;
  Polyline line;
  const auto problem = [&](const char* code, const std::string& what, const std::string& remedy) {
    issues.push_back({.code = code, .place = {.item = "curves." + name}, .what = what, .remedy = remedy, .category = Category::input});
  };
  if (curve.points.empty() == curve.landmarks.empty()) problem("bad_curve", "it has either points or landmarks", "give one of them");
  for (const auto& p : curve.points) line.points.emplace_back(p[0], p[1], p[2]);
  for (const std::string& landmark : curve.landmarks) {
    const auto it = support.landmarks.find(landmark);
    if (it == support.landmarks.end()) problem("unknown_landmark", "the support has no landmark '" + landmark + "'", "it has: " + known(support.landmarks));
    else line.points.emplace_back(it->second[0], it->second[1], it->second[2]);
  }
  // Points that repeat say nothing.
  line.points.erase(std::unique(line.points.begin(), line.points.end(), [](const Vector3d& a, const Vector3d& b) { return (a - b).norm() < 1e-9; }), line.points.end());
  if (issues.empty() && line.points.size() < 2) problem("bad_curve", "it has no length", "give at least two different points");
  if (!issues.empty()) return issues;
  line.s.push_back(0);
  for (std::size_t i = 1; i < line.points.size(); ++i) line.s.push_back(line.s.back() + (line.points[i] - line.points[i - 1]).norm());
  return line;
}

// The two orthonormal columns nearest to those of a: a times the inverse square root of its metric (in closed form).
Eigen::Matrix<double, 3, 2> nearest_orthonormal(const Eigen::Matrix<double, 3, 2>& a) {
  const Eigen::Matrix2d metric = a.transpose() * a;
  const double determinant = metric.determinant(), trace = metric.trace();
  if (determinant > 1e-12 * trace * trace) {
    const double root = std::sqrt(determinant);
    const Eigen::Matrix2d square_root = (metric + root * Eigen::Matrix2d::Identity()) / std::sqrt(trace + 2 * root);
    return a * square_root.inverse();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return svd.matrixU() * svd.matrixV().transpose();
}

// Rotation and shift that bring the panel's plane nearest to points in space.
struct Rigid {
  Eigen::Matrix<double, 3, 2> axes = Eigen::Matrix<double, 3, 2>::Zero();
  Vector3d shift = Vector3d::Zero();
  Vector3d operator()(const Vector2d& p) const { return axes * p + shift; }
};

Rigid nearest_rigid(const std::vector<Vector2d>& flat, const std::vector<Vector3d>& places, const Vector2d& centre) {
  Vector2d middle = Vector2d::Zero();
  Vector3d there = Vector3d::Zero();
  for (std::size_t i = 0; i < flat.size(); ++i) middle += flat[i], there += places[i];
  middle /= static_cast<double>(flat.size());
  there /= static_cast<double>(flat.size());
  Eigen::Matrix<double, 3, 2> moment = Eigen::Matrix<double, 3, 2>::Zero();
  for (std::size_t i = 0; i < flat.size(); ++i) moment += (places[i] - there) * (flat[i] - middle).transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(moment, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Rigid rigid;
  if (svd.singularValues()[1] > kStraight * svd.singularValues()[0]) {
    rigid.axes = svd.matrixU() * svd.matrixV().transpose();
  } else {
    // On a straight line the panel can swing: its middle hangs straight down.
    Vector2d along = svd.matrixV().col(0);
    Vector3d line = svd.matrixU().col(0);
    if (svd.singularValues()[0] <= 0) along = Vector2d::UnitX(), line = Vector3d::UnitX();
    Vector2d across(-along.y(), along.x());
    Vector3d down = -Vector3d::UnitY() + line.y() * line;
    if (down.norm() < 1e-6) down = Vector3d::UnitZ() - line.z() * line;
    down.normalize();
    const double side = across.dot(centre - middle) < 0 ? -1 : 1;
    rigid.axes = line * along.transpose() + side * down * across.transpose();
  }
  rigid.shift = there - rigid.axes * middle;
  return rigid;
}

}  // namespace

Result<std::vector<HeldLine>> held_lines(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const std::map<std::string, FrameCurve>& curves,
                                         const std::vector<FrameLine>& lines) {
  Issues issues;
  std::map<std::string, Polyline> found;
  for (const auto& [name, curve] : curves) {
    Result<Polyline> line = polyline(name, curve, support);
    if (line) found.emplace(name, std::move(*line));
    else issues.insert(issues.end(), line.issues().begin(), line.issues().end());
  }
  std::vector<HeldLine> held;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    HeldLine line;
    line.curve = lines[i].to;
    const std::string item = fmt::format("lines[{}]", i);
    const auto problem = [&](const char* code, const std::string& what, const std::string& remedy) {
      issues.push_back({.code = code, .place = {.item = item}, .what = what, .remedy = remedy, .category = Category::input});
    };
    std::vector<std::pair<int, double>> places;  // vertex, along the line [m]
    if (lines[i].line.empty()) problem("unknown_edge", "it names no edge", "name edges as panel.edge");
    for (const std::string& text : lines[i].line) {
      line.name += (line.name.empty() ? "" : " ") + text;
      const bool reversed = text.starts_with('-');
      const std::string name = reversed ? text.substr(1) : text;
      const std::size_t dot = name.find('.');
      const auto panel = std::find_if(garment.panels.begin(), garment.panels.end(), [&](const mesh::Panel& p) { return p.name == name.substr(0, dot); });
      if (panel == garment.panels.end()) {
        problem("unknown_panel", "there is no panel '" + name.substr(0, dot) + "'", "toile-info lists the panels");
        continue;
      }
      const std::string edge = dot == std::string::npos ? "" : name.substr(dot + 1);
      const auto run = std::find_if(garment.runs.begin(), garment.runs.end(), [&](const mesh::Run& r) { return r.panel == panel->id && r.name == edge; });
      if (run == garment.runs.end()) {
        std::string names;
        for (const mesh::Run& r : garment.runs) {
          if (r.panel == panel->id) names += (names.empty() ? "" : ", ") + r.name;
        }
        problem("unknown_edge", "panel '" + panel->name + "' has no edge or line '" + edge + "'", "it has: " + (names.empty() ? "none" : names));
        continue;
      }
      for (const mesh::RunVertex& v : garment.run_vertices) {
        if (v.run == run->id) places.emplace_back(v.vertex, line.length + (reversed ? run->length - v.s : v.s));
      }
      line.length += run->length;
    }
    const auto curve = found.find(lines[i].to);
    if (curve == found.end()) {
      if (!curves.count(lines[i].to)) problem("unknown_curve", "there is no curve '" + lines[i].to + "'", "curves has: " + known(curves));
      continue;
    }
    std::stable_sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    line.curve_length = curve->second.s.back();
    for (const auto& [vertex, s] : places) line.targets.push_back({vertex, curve->second.at(s / line.length * line.curve_length)});
    held.push_back(std::move(line));
  }
  if (!issues.empty()) return issues;
  return held;
}

Result<Points3> spread(const mesh::GarmentMesh& garment, const std::vector<HeldLine>& lines, double thickness) {
  const Eigen::Index n = garment.vertex_count();
  const auto uv = [&](Eigen::Index v) { return Vector2d(garment.uv.row(v).transpose()); };
  std::vector<Vector2d> centre(garment.panels.size(), Vector2d::Zero());
  std::vector<double> count(garment.panels.size(), 0);
  for (Eigen::Index v = 0; v < n; ++v) {
    centre[static_cast<std::size_t>(garment.vertex_panel[v])] += uv(v);
    count[static_cast<std::size_t>(garment.vertex_panel[v])] += 1;
  }
  for (std::size_t p = 0; p < centre.size(); ++p) centre[p] /= std::max(count[p], 1.0);

  // A particle on two curves goes between them.
  const mesh::Ids particle = mesh::particles(garment);
  const Eigen::Index particles = particle.size() > 0 ? particle.maxCoeff() + 1 : 0;
  Points3 goal = Points3::Zero(particles, 3);
  std::vector<int> goals(static_cast<std::size_t>(particles), 0);
  for (const HeldLine& line : lines) {
    for (const Target& target : line.targets) {
      goal.row(particle[target.vertex]) += target.at.transpose();
      ++goals[static_cast<std::size_t>(particle[target.vertex])];
    }
  }
  for (Eigen::Index i = 0; i < particles; ++i) {
    if (goals[static_cast<std::size_t>(i)] > 0) goal.row(i) /= goals[static_cast<std::size_t>(i)];
  }

  // Panels as rigid pieces: those on lines first, then those sewn to them.
  std::vector<char> known(garment.panels.size(), 0);
  Points3 rigid = Points3::Zero(particles, 3);  // of particles of known panels
  std::vector<int> placed(static_cast<std::size_t>(particles), 0);
  for (bool first = true;; first = false) {
    std::vector<std::pair<std::size_t, Rigid>> fresh;
    for (std::size_t p = 0; p < known.size(); ++p) {
      if (known[p]) continue;
      std::vector<Vector2d> flat;
      std::vector<Vector3d> places;
      for (Eigen::Index v = 0; v < n; ++v) {
        const auto own = static_cast<std::size_t>(particle[v]);
        if (static_cast<std::size_t>(garment.vertex_panel[v]) != p) continue;
        if (goals[own] > 0) flat.push_back(uv(v)), places.emplace_back(goal.row(particle[v]).transpose());
        else if (!first && placed[own] > 0) flat.push_back(uv(v)), places.emplace_back(rigid.row(particle[v]).transpose() / placed[own]);
      }
      if (!flat.empty()) fresh.emplace_back(p, nearest_rigid(flat, places, centre[p]));
    }
    if (fresh.empty() && !first) break;
    for (const auto& [p, move] : fresh) {
      known[p] = 1;
      for (Eigen::Index v = 0; v < n; ++v) {
        if (static_cast<std::size_t>(garment.vertex_panel[v]) != p) continue;
        rigid.row(particle[v]) += move(uv(v)).transpose();
        ++placed[static_cast<std::size_t>(particle[v])];
      }
    }
  }
  std::string loose;
  for (std::size_t p = 0; p < known.size(); ++p) {
    if (!known[p]) loose += (loose.empty() ? "" : ", ") + garment.panels[p].name;
  }
  if (!loose.empty()) {
    return Issue{.code = "not_held", .place = {.item = "panels " + loose}, .what = "they neither hang on a line of the spec nor are they sewn to a panel that does",
                 .remedy = "give lines for them, or leave them out", .category = Category::input};
  }
  Points3 x(particles, 3);
  for (Eigen::Index i = 0; i < particles; ++i) x.row(i) = rigid.row(i) / std::max(placed[static_cast<std::size_t>(i)], 1);

  // Cotangent Laplacian of the flat panels over the particles; held particles are known.
  struct Corner {
    std::array<int, 3> v;                  // particles
    Eigen::Matrix<double, 3, 2> gradient;  // of the three hat functions [1/m]
    double area;
  };
  std::vector<Corner> corners;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    Corner corner;
    const Vector2d a = uv(garment.faces(f, 0)), b = uv(garment.faces(f, 1)), c = uv(garment.faces(f, 2));
    const Vector2d ab = b - a, ac = c - a;
    const double twice = ab.x() * ac.y() - ab.y() * ac.x();
    if (twice <= 0) continue;
    corner.area = 0.5 * twice;
    const auto turned = [&](const Vector2d& e) { return Eigen::RowVector2d(-e.y() / twice, e.x() / twice); };
    corner.gradient << turned(c - b), turned(a - c), turned(b - a);
    for (int k = 0; k < 3; ++k) corner.v[static_cast<std::size_t>(k)] = particle[garment.faces(f, k)];
    const Eigen::Matrix3d own = corner.area * corner.gradient * corner.gradient.transpose();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) entries.emplace_back(corner.v[static_cast<std::size_t>(i)], corner.v[static_cast<std::size_t>(j)], own(i, j));
    }
    corners.push_back(corner);
  }
  std::vector<int> row(static_cast<std::size_t>(particles), -1);
  int free = 0;
  for (Eigen::Index i = 0; i < particles; ++i) {
    if (goals[static_cast<std::size_t>(i)] == 0) row[static_cast<std::size_t>(i)] = free++;
  }
  Points3 result(n, 3);
  if (free > 0) {
    std::vector<Eigen::Triplet<double>> inner, outer;
    for (const auto& e : entries) {
      const int r = row[static_cast<std::size_t>(e.row())], c = row[static_cast<std::size_t>(e.col())];
      if (r < 0) continue;
      if (c >= 0) inner.emplace_back(r, c, e.value());
      else outer.emplace_back(r, e.col(), e.value());
    }
    Eigen::SparseMatrix<double> stiffness(free, free), coupling(free, static_cast<int>(particles));
    stiffness.setFromTriplets(inner.begin(), inner.end());
    coupling.setFromTriplets(outer.begin(), outer.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(stiffness);
    TOILE_CHECK(solver.info() == Eigen::Success, "{} free particles", free);
    // What the rigid pieces miss at the lines, spread harmonically.
    Points3 miss = Points3::Zero(particles, 3);
    for (Eigen::Index i = 0; i < particles; ++i) {
      if (goals[static_cast<std::size_t>(i)] > 0) miss.row(i) = goal.row(i) - x.row(i);
    }
    const Points3 spread = solver.solve(Points3(-(coupling * miss)));
    for (Eigen::Index i = 0; i < particles; ++i) {
      const int r = row[static_cast<std::size_t>(i)];
      if (r < 0) x.row(i) += miss.row(i);
      else x.row(i) += spread.row(r);
    }
    // Each triangle to its nearest turned flat shape, then all of them together. Long waves of stretch take many turns: momentum
    // (Nesterov's), let go when it points against the step (odonoghue2015).
    Points3 ahead = x;
    double t = 1;
    for (int turn = 0; turn < kTurns; ++turn) {
      std::vector<Eigen::Matrix<double, 3, 2>> target(corners.size());
      parallel_for(corners.size(), 256, [&](std::size_t i) {
        Eigen::Matrix<double, 3, 2> deformed = Eigen::Matrix<double, 3, 2>::Zero();
        for (std::size_t k = 0; k < 3; ++k) deformed += ahead.row(corners[i].v[k]).transpose() * corners[i].gradient.row(static_cast<int>(k));
        target[i] = nearest_orthonormal(deformed);
      });
      Points3 right = -(coupling * x);
      for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          const int r = row[static_cast<std::size_t>(corners[i].v[k])];
          if (r >= 0) right.row(r) += corners[i].area * (target[i] * corners[i].gradient.row(static_cast<int>(k)).transpose()).transpose();
        }
      }
      const Points3 solved = solver.solve(right);
      Points3 next = x;
      for (Eigen::Index i = 0; i < particles; ++i) {
        if (row[static_cast<std::size_t>(i)] >= 0) next.row(i) = solved.row(row[static_cast<std::size_t>(i)]);
      }
      const Points3 step = next - x;
      if (step.rowwise().norm().maxCoeff() < kStill) break;
      if ((ahead - next).cwiseProduct(step).sum() > 0) t = 1;
      const double t_next = 0.5 * (1 + std::sqrt(1 + 4 * t * t));
      ahead = next + (t - 1) / t_next * step;
      x = next;
      t = t_next;
    }
  } else {
    x = goal;
  }
  for (Eigen::Index v = 0; v < n; ++v) result.row(v) = x.row(particle[v]);

  // At seams every panel ends a little before its particles, towards its own inside.
  std::vector<char> sewn(static_cast<std::size_t>(n), 0);
  for (const mesh::Weld& weld : garment.welds) sewn[static_cast<std::size_t>(weld.a)] = sewn[static_cast<std::size_t>(weld.b)] = 1;
  Points3 inwards = Points3::Zero(n, 3);
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = garment.faces(f, k);
      if (!sewn[static_cast<std::size_t>(v)]) continue;
      for (int j = 1; j < 3; ++j) {
        const int w = garment.faces(f, (k + j) % 3);
        if (!sewn[static_cast<std::size_t>(w)]) inwards.row(v) += (result.row(w) - result.row(v)).normalized();
      }
    }
  }
  for (Eigen::Index v = 0; v < n; ++v) {
    const double length = inwards.row(v).norm();
    if (length > 1e-9) result.row(v) += (0.75 * thickness / length) * inwards.row(v);
  }
  return result;
}

LineGap line_gap(const HeldLine& line, const Points3& x) {
  LineGap gap;
  for (const Target& target : line.targets) {
    const double distance = (x.row(target.vertex).transpose() - target.at).norm();
    gap.largest = std::max(gap.largest, distance);
    gap.mean += distance / static_cast<double>(line.targets.size());
  }
  return gap;
}

}  // namespace toile::placement
