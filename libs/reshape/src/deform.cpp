#include "toile/reshape/deform.h"

#include "fields.h"

#include "toile/base/parallel.h"
#include "toile/geometry/slice.h"

#include <Eigen/Geometry>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace toile::reshape {

using Eigen::Vector3d;

namespace {

Vector3d vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
Vector3d mirrored(const Vector3d& v) { return {-v.x(), v.y(), v.z()}; }

/// The curve of a section that comes nearest to a point.
struct Section {
  geometry::Polyline curve;
  double girth = 0;
};
std::optional<Section> section_near(const Points3& x, const Triangles& faces, const geometry::Plane& plane, const std::vector<char>& keep, const Vector3d& point) {
  std::optional<Section> best;
  double nearest_sq = 0;
  for (geometry::Polyline& curve : geometry::slice(x, faces, plane, keep)) {
    const Eigen::Index n = curve.points.rows();
    double distance_sq = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vector3d a = curve.points.row(i), b = curve.points.row(curve.closed || i + 1 < n ? (i + 1) % n : i);
      const double length_sq = (b - a).squaredNorm();
      const double t = length_sq > 0 ? std::clamp((point - a).dot(b - a) / length_sq, 0.0, 1.0) : 0;
      distance_sq = std::min(distance_sq, (point - a - t * (b - a)).squaredNorm());
    }
    if (best && distance_sq >= nearest_sq) continue;
    nearest_sq = distance_sq;
    // A tape round a closed curve spans its hollows; an open one is measured along the cloth.
    const double girth = curve.closed ? geometry::tape_girth(curve.points, plane.normal) : geometry::length(curve);
    best = Section{std::move(curve), girth};
  }
  return best;
}

/// A quantity that is asked for, and the field of displacement that changes it.
struct Handle {
  std::string key;
  bool girth = false, angle = false;
  std::vector<State> state;
  Points3 value, field;
  double before = 0, asked = 0;
  // girth
  geometry::Plane plane;
  std::vector<char> keep;
  SurfacePoint anchor;
  // move
  SurfacePoint from, to;
  Vector3d start, about;
};

struct Problem {
  const Surface& surface;
  std::vector<Handle> handles;

  /// Value of a handle's measure at positions x; nothing where its section is gone.
  std::optional<double> measure(const Handle& handle, const Points3& x) const {
    if (handle.girth) {
      geometry::Plane plane = handle.plane;
      const Vector3d anchor = at(x, surface.faces, handle.anchor);
      plane.point += plane.normal * (anchor - at(surface.x, surface.faces, handle.anchor)).dot(plane.normal);
      const auto section = section_near(x, surface.faces, plane, handle.keep, anchor);
      if (!section) return std::nullopt;
      return section->girth;
    }
    const Vector3d line = at(x, surface.faces, handle.to) - at(x, surface.faces, handle.from);
    if (!handle.angle) return line.norm();
    const Vector3d a = handle.start - handle.start.dot(handle.about) * handle.about, b = line - line.dot(handle.about) * handle.about;
    return std::atan2(a.cross(b).dot(handle.about), a.dot(b));
  }
};

/// Vertices all of whose faces are kept.
std::vector<char> inner_vertices(const Surface& surface, const std::vector<char>& keep) {
  std::vector<char> inner(static_cast<std::size_t>(surface.x.rows()), 0);
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) inner[static_cast<std::size_t>(surface.faces(f, k))] = 1;
  }
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    if (keep[static_cast<std::size_t>(f)]) continue;
    for (int k = 0; k < 3; ++k) inner[static_cast<std::size_t>(surface.faces(f, k))] = 0;
  }
  return inner;
}

Result<Handle> girth_handle(const Surface& surface, const std::string& name, const GirthSpec& spec) {
  Handle handle;
  handle.key = "girths." + name;
  handle.girth = true;
  Issues issues;
  const auto point = find_point(surface, spec.at, spec.shift, handle.key + ".at");
  const auto keep = faces_of(surface, spec.parts, handle.key + ".parts");
  if (!point) append(issues, point.issues());
  if (!keep) append(issues, keep.issues());
  if (!issues.empty()) return issues;
  handle.keep = *keep;
  handle.plane = {*point, vec(spec.normal).normalized()};
  const auto section = section_near(surface.x, surface.faces, handle.plane, handle.keep, *point);
  if (!section) {
    return Issue{"no_section", {.item = handle.key}, "the plane of the line does not meet the surface", "check `at`, `normal` and `parts`"};
  }
  handle.before = section->girth;
  handle.asked = spec.to ? *spec.to : handle.before + *spec.change;
  if (handle.asked < 0.1 * handle.before) {
    return Issue{"girth_too_small", {.item = handle.key}, fmt::format("{:.0f} mm would be left of a girth of {:.0f} mm", 1e3 * handle.asked, 1e3 * handle.before), "ask for at least a tenth of the girth"};
  }
  handle.anchor = nearest(surface.x, surface.faces, *point, handle.keep);
  const auto n = static_cast<std::size_t>(surface.x.rows());
  handle.state.assign(n, State::stays);
  handle.value = Points3::Zero(surface.x.rows(), 3);
  // The whole strip of triangles on the line is scaled about its middle, in its plane: so is the curve, exactly.
  const geometry::Polyline& curve = section->curve;
  Vector3d middle = Vector3d::Zero();
  double total = 0;
  const Eigen::Index count = curve.points.rows();
  for (Eigen::Index i = 0; i < (curve.closed ? count : count - 1); ++i) {
    const Vector3d a = curve.points.row(i), b = curve.points.row((i + 1) % count);
    middle += (b - a).norm() * (a + b) / 2;
    total += (b - a).norm();
  }
  middle /= total;
  std::vector<int> ring;
  for (const int f : curve.faces) {
    for (int k = 0; k < 3; ++k) ring.push_back(surface.faces(f, k));
  }
  std::sort(ring.begin(), ring.end());
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  for (const int v : ring) {
    const Vector3d d = surface.x.row(v).transpose() - middle;
    handle.state[static_cast<std::size_t>(v)] = State::given;
    handle.value.row(v) = (d - d.dot(handle.plane.normal) * handle.plane.normal).transpose();
  }
  const std::vector<char> inner = inner_vertices(surface, handle.keep);
  const std::vector<double> distance = edge_distances(surface.x, surface.faces, ring, inner);
  for (std::size_t v = 0; v < n; ++v) {
    if (handle.state[v] == State::stays && inner[v] && distance[v] < spec.reach) handle.state[v] = State::free;
  }
  return handle;
}

Result<Handle> move_handle(const Surface& surface, const std::string& name, const MoveSpec& spec) {
  Handle handle;
  handle.key = "moves." + name;
  handle.angle = spec.turn.has_value();
  Issues issues;
  const auto from = find_point(surface, spec.from, {0, 0, 0}, handle.key + ".from");
  const auto to = find_point(surface, spec.to, {0, 0, 0}, handle.key + ".to");
  const auto keep = faces_of(surface, spec.parts, handle.key + ".parts");
  for (const Issues* found : {&from.issues(), &to.issues(), &keep.issues()}) append(issues, *found);
  if (!issues.empty()) return issues;
  handle.keep = *keep;
  handle.from = nearest(surface.x, surface.faces, *from);
  handle.to = nearest(surface.x, surface.faces, *to);
  handle.start = at(surface.x, surface.faces, handle.to) - at(surface.x, surface.faces, handle.from);
  handle.about = vec(spec.about).normalized();
  const Vector3d normal = (spec.normal ? vec(*spec.normal) : handle.start).normalized();
  const double span = handle.start.dot(normal);
  if (!(std::abs(span) > 1e-6) || (handle.angle && !(handle.about.cross(handle.start).norm() > 1e-6))) {
    return Issue{"points_coincide", {.item = handle.key}, "there is no room between its points along the normal of the planes", "name two points apart from each other, or another `normal` or axis"};
  }
  Vector3d direction = handle.start.normalized();
  if (handle.angle) {
    // The chord of the arc: a tip that is moved along it keeps its distance once the angle is reached.
    direction = Eigen::AngleAxisd(*spec.turn / 2, handle.about) * handle.about.cross(handle.start).normalized();
    handle.before = 0;
    handle.asked = *spec.turn;
  } else {
    handle.before = handle.start.norm();
    handle.asked = handle.before + *spec.change;
    if (handle.asked < 0.1 * handle.before) {
      return Issue{"girth_too_small", {.item = handle.key}, fmt::format("{:.0f} mm would be left of {:.0f} mm", 1e3 * handle.asked, 1e3 * handle.before), "ask for at least a tenth of the distance"};
    }
  }
  const auto n = static_cast<std::size_t>(surface.x.rows());
  const std::vector<char> inner = inner_vertices(surface, handle.keep);
  std::vector<double> along(n);
  const Vector3d origin = at(surface.x, surface.faces, handle.from);
  for (std::size_t v = 0; v < n; ++v) along[v] = (surface.x.row(static_cast<Eigen::Index>(v)).transpose() - origin).dot(normal) / span;
  // Beyond `to`: the piece that hangs together round it.
  int seed = -1;
  double least = std::numeric_limits<double>::infinity();
  const Vector3d tip = origin + handle.start;
  for (std::size_t v = 0; v < n; ++v) {
    const double distance = (surface.x.row(static_cast<Eigen::Index>(v)).transpose() - tip).norm();
    if (inner[v] && along[v] >= 1 && distance < least) least = distance, seed = static_cast<int>(v);
  }
  if (seed < 0) {
    return Issue{"not_separated", {.item = handle.key}, fmt::format("nothing of the named parts lies beyond '{}'", spec.to), "name the parts that it moves (`parts`), or exchange `from` and `to`"};
  }
  const auto near = neighbours(surface.x.rows(), surface.faces);
  handle.state.assign(n, State::stays);
  handle.value = Points3::Zero(surface.x.rows(), 3);
  std::vector<int> moved{seed};
  handle.state[static_cast<std::size_t>(seed)] = State::given;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    handle.value.row(moved[i]) = direction.transpose();
    for (const int w : near[static_cast<std::size_t>(moved[i])]) {
      if (handle.state[static_cast<std::size_t>(w)] == State::given || !inner[static_cast<std::size_t>(w)] || along[static_cast<std::size_t>(w)] < 1) continue;
      handle.state[static_cast<std::size_t>(w)] = State::given;
      moved.push_back(w);
    }
  }
  std::sort(moved.begin(), moved.end());
  const std::vector<double> distance = edge_distances(surface.x, surface.faces, moved, inner);
  for (std::size_t v = 0; v < n; ++v) {
    if (handle.state[v] == State::stays && inner[v] && along[v] > 0 && distance[v] < spec.reach) handle.state[v] = State::free;
  }
  for (const int v : moved) {
    for (const int w : near[static_cast<std::size_t>(v)]) {
      if (handle.state[static_cast<std::size_t>(w)] != State::stays) continue;
      const Vector3d p = surface.x.row(v);
      return Issue{"not_separated", {.item = handle.key},
                   fmt::format("what lies beyond '{}' hangs together with what stays, at ({:.3f}, {:.3f}, {:.3f}) m", spec.to, p.x(), p.y(), p.z()),
                   "name more `parts`, another `normal`, or a larger `reach`, so that the surface can give between the two"};
    }
  }
  return handle;
}

/// Vertex that is the mirror image of each one.
Result<std::vector<int>> mirror_pairs(const Surface& surface) {
  std::map<std::array<double, 3>, int> by_position;
  const auto key = [&](int v, double sign) { return std::array{sign * surface.x(v, 0) + 0.0, surface.x(v, 1), surface.x(v, 2)}; };
  const int n = static_cast<int>(surface.x.rows());
  for (int v = 0; v < n; ++v) by_position.emplace(key(v, 1), v);
  std::vector<int> pair(static_cast<std::size_t>(n), -1);
  int without = 0, first = -1;
  for (int v = 0; v < n; ++v) {
    const auto found = by_position.find(key(v, -1));
    if (found == by_position.end() || by_position.at(key(v, 1)) != v) {
      if (without++ == 0) first = v;
      continue;
    }
    pair[static_cast<std::size_t>(v)] = found->second;
  }
  if (without > 0) {
    return Issue{"not_symmetric", {.item = "symmetric"},
                 fmt::format("{} of {} vertices have no mirror image, the first at ({:.4f}, {:.4f}, {:.4f}) m", without, n, surface.x(first, 0), surface.x(first, 1), surface.x(first, 2)),
                 "leave `symmetric` out and name both sides, or start from a surface that is its own mirror image, as toile-form makes them"};
  }
  return pair;
}

void mirror(Handle& handle, const std::vector<int>& pair) {
  const std::vector<State> state = handle.state;
  const Points3 value = handle.value;
  for (std::size_t v = 0; v < pair.size(); ++v) {
    const auto w = static_cast<std::size_t>(pair[v]);
    const auto row = static_cast<Eigen::Index>(v);
    const Vector3d own = value.row(row), other = mirrored(value.row(pair[v]));
    if (state[v] == State::given && state[w] == State::given) handle.value.row(row) = 0.5 * (own + other).transpose();
    else if (state[w] == State::given) handle.value.row(row) = other.transpose();
    handle.state[v] = std::max(state[v], state[w]);
  }
}

}  // namespace

Result<Deformed> deform(const Surface& surface, const DeformParams& params) {
  Issues issues;
  Problem problem{surface, {}};
  for (const auto& [name, spec] : params.girths) {
    auto handle = girth_handle(surface, name, spec);
    if (handle) problem.handles.push_back(std::move(*handle));
    else append(issues, handle.issues());
  }
  for (const auto& [name, spec] : params.moves) {
    auto handle = move_handle(surface, name, spec);
    if (handle) problem.handles.push_back(std::move(*handle));
    else append(issues, handle.issues());
  }
  for (const auto& [name, lattice] : params.lattices) {
    const LatticeFold fold = least_determinant(lattice);
    if (fold.determinant <= 0) {
      issues.push_back({"lattice_folds", {.item = "lattices." + name},
                        fmt::format("it folds space: the determinant of its gradient is {:.2f} at ({:.3f}, {:.3f}, {:.3f}) m", fold.determinant, fold.at.x(), fold.at.y(), fold.at.z()),
                        "ask for smaller offsets, larger cells, or move the neighbouring nodes along", Category::check});
    }
  }
  std::vector<int> pair;
  if (params.symmetric) {
    auto found = mirror_pairs(surface);
    if (found) pair = std::move(*found);
    else append(issues, found.issues());
  }
  if (!issues.empty()) return issues;

  const Eigen::Index n = surface.x.rows();
  std::vector<Handle>& handles = problem.handles;
  if (params.symmetric) {
    for (Handle& handle : handles) mirror(handle, pair);
  }
  // Between two lines the edit of one ends at the other.
  for (Handle& handle : handles) {
    if (!handle.girth) continue;
    for (const Handle& other : handles) {
      if (!other.girth || &other == &handle) continue;
      for (std::size_t v = 0; v < handle.state.size(); ++v) {
        if (other.state[v] == State::given && handle.state[v] == State::free) handle.state[v] = State::stays;
      }
    }
  }
  const Operators op = operators(surface.x, surface.faces);
  parallel_for(handles.size(), 1, [&](std::size_t k) { handles[k].field = biharmonic_field(op, handles[k].state, handles[k].value); });

  Points3 shift = Points3::Zero(n, 3);
  for (const auto& [name, lattice] : params.lattices) {
    if (!params.symmetric) {
      shift += lattice_displacement(lattice, surface.x);
      continue;
    }
    // A node and its mirror image in the box move together where only one of them is named.
    LatticeSpec whole = lattice;
    if (lattice.low[0] == -lattice.high[0]) {
      for (const LatticeOffset& offset : lattice.offsets) {
        LatticeOffset twin{{lattice.cells[0] - offset.node[0], offset.node[1], offset.node[2]}, {-offset.by[0], offset.by[1], offset.by[2]}};
        const auto named = std::find_if(lattice.offsets.begin(), lattice.offsets.end(), [&](const LatticeOffset& o) { return o.node == twin.node; });
        if (named == lattice.offsets.end()) whole.offsets.push_back(std::move(twin));
      }
      Points3 reflected = surface.x;
      reflected.col(0) *= -1;
      Points3 other = lattice_displacement(whole, reflected);
      other.col(0) *= -1;
      shift += 0.5 * (lattice_displacement(whole, surface.x) + other);
    } else {
      Points3 reflected = surface.x;
      reflected.col(0) *= -1;
      Points3 other = lattice_displacement(whole, reflected);
      other.col(0) *= -1;
      shift += lattice_displacement(whole, surface.x) + other;
    }
  }

  const auto positions = [&](const Eigen::VectorXd& amount) {
    Points3 x = surface.x + shift;
    for (std::size_t k = 0; k < handles.size(); ++k) {
      if (amount[static_cast<Eigen::Index>(k)] != 0) x += amount[static_cast<Eigen::Index>(k)] * handles[k].field;
    }
    // The side x > 0 has the say; the other is its image.
    for (std::size_t v = 0; v < pair.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      if (pair[v] == static_cast<int>(v)) x(row, 0) = 0;
      else if (surface.x(row, 0) < 0) x.row(row) << -x(pair[v], 0), x(pair[v], 1), x(pair[v], 2);
    }
    return x;
  };
  const auto count = static_cast<Eigen::Index>(handles.size());
  // Angles count as the way of their tip, so that one tolerance serves all.
  const auto scale = [&](Eigen::Index k) { return handles[static_cast<std::size_t>(k)].angle ? handles[static_cast<std::size_t>(k)].start.norm() : 1.0; };
  std::vector<char> lost(handles.size(), 0);
  const auto residual = [&](const Points3& x) {
    Eigen::VectorXd r(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Handle& handle = handles[static_cast<std::size_t>(k)];
      const auto value = problem.measure(handle, x);
      lost[static_cast<std::size_t>(k)] = !value;
      r[k] = value ? scale(k) * (*value - handle.asked) : scale(k) * handle.asked;
    }
    return r;
  };
  Deformed result;
  Eigen::VectorXd amount = Eigen::VectorXd::Zero(count);
  result.x = positions(amount);
  Eigen::VectorXd r = residual(result.x);
  const double goal = 1e-3 * params.tolerance;
  while (count > 0 && r.cwiseAbs().maxCoeff() > goal && result.rounds < 30) {
    ++result.rounds;
    Eigen::MatrixXd slope(count, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const double reach = handles[static_cast<std::size_t>(k)].field.rowwise().norm().maxCoeff();
      const double step = 1e-4 / std::max(reach, 1e-9);
      Eigen::VectorXd probe = amount;
      probe[k] += step;
      slope.col(k) = (residual(positions(probe)) - r) / step;
    }
    const Eigen::VectorXd step = slope.completeOrthogonalDecomposition().solve(-r);
    double part = 1;
    bool better = false;
    for (int halving = 0; halving < 8 && !better; ++halving, part /= 2) {
      const Points3 x = positions(amount + part * step);
      const Eigen::VectorXd next = residual(x);
      if (next.norm() >= r.norm()) continue;
      better = true;
      amount += part * step;
      r = next;
      result.x = x;
    }
    if (!better) break;
  }
  residual(result.x);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Handle& handle = handles[static_cast<std::size_t>(k)];
    result.measures.push_back({handle.key, handle.angle, handle.before, handle.asked, problem.measure(handle, result.x).value_or(0)});
    if (lost[static_cast<std::size_t>(k)] || std::abs(r[k]) > params.tolerance) {
      result.findings.push_back({"out_of_tolerance", {.item = handle.key},
                                 fmt::format("the measure is {:+.3f} mm off what was asked", 1e3 * r[k]),
                                 "ask for less, give a larger reach, or take lines apart that contradict each other", Category::not_converged});
    }
  }
  result.largest_move = n > 0 ? (result.x - surface.x).rowwise().norm().maxCoeff() : 0;
  int first = -1;
  for (int f = 0; f < surface.faces.rows(); ++f) {
    const auto area = [&](const Points3& x) -> Vector3d {
      const Vector3d a = x.row(surface.faces(f, 0)), b = x.row(surface.faces(f, 1)), c = x.row(surface.faces(f, 2));
      return (b - a).cross(c - a);
    };
    const Vector3d before = area(surface.x), after = area(result.x);
    if (before.norm() == 0 || (after.dot(before) > 0 && after.norm() > 0.05 * before.norm())) continue;
    if (result.folded_faces++ == 0) first = f;
  }
  if (result.folded_faces > 0) {
    const Vector3d p = surface.x.row(surface.faces(first, 0));
    result.findings.push_back({"folded", {.item = "surface"},
                               fmt::format("{} faces are turned over or squeezed to nothing, the first at ({:.3f}, {:.3f}, {:.3f}) m", result.folded_faces, p.x(), p.y(), p.z()),
                               "ask for less, or give a larger reach", Category::check});
  }
  return result;
}

std::map<std::string, Vector3d> carried_points(const Surface& before, const Points3& after) {
  const auto carried = [&](const Vector3d& p) {
    const SurfacePoint near = nearest(before.x, before.faces, p);
    return near.face < 0 ? p : Vector3d(p + (at(after, before.faces, near) - at(before.x, before.faces, near)));
  };
  // Where the surface stays its own mirror image, so do its points.
  bool symmetric = false;
  {
    std::map<std::array<double, 3>, int> position;
    for (int v = 0; v < after.rows(); ++v) position.emplace(std::array{after(v, 0) + 0.0, after(v, 1), after(v, 2)}, v);
    symmetric = std::all_of(position.begin(), position.end(), [&](const auto& entry) { return position.count({-entry.first[0] + 0.0, entry.first[1], entry.first[2]}) > 0; });
  }
  std::map<std::string, Vector3d> points;
  for (const auto& [name, p] : before.points) {
    if (!symmetric) {
      points[name] = carried(p);
      continue;
    }
    Vector3d q = carried(p.x() < 0 ? mirrored(p) : p);
    if (p.x() == 0) q.x() = 0;
    points[name] = p.x() < 0 ? mirrored(q) : q;
  }
  return points;
}

std::map<std::string, double> carried_girths(const mesh::SupportMesh& before, const Points3& after, const std::map<std::string, Vector3d>& points) {
  std::map<std::string, double> girths;
  for (const auto& [name, girth] : before.girths) {
    const std::string point = (name == "hips" ? "hip" : name) + "_front";
    const auto old = before.landmarks.find(point);
    const auto moved = points.find(point);
    if (old == before.landmarks.end() || moved == points.end()) continue;
    const auto measured = [&](const Points3& x, const Vector3d& p) {
      const auto section = section_near(x, before.faces, {p, Vector3d::UnitY()}, {}, p);
      return section ? section->girth : 0;
    };
    if (std::abs(measured(before.x, vec(old->second)) - girth) > 1e-3) continue;
    girths[name] = measured(after, moved->second);
  }
  return girths;
}

}  // namespace toile::reshape
