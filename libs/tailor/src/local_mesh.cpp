#include "local_mesh.h"

#include "toile/base/result.h"
#include "toile/base/rng.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

namespace toile::tailor {

namespace {
double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
}  // namespace

std::array<double, 3> angles(const Point& a, const Point& b, const Point& c) {
  const Point ab = b - a, bc = c - b, ca = a - c;
  const double area = cross(ab, -ca);
  if (!(area > 0)) return {-1, -1, -1};
  constexpr double degrees = 180 / std::numbers::pi;
  return {std::atan2(area, -ab.dot(ca)) * degrees, std::atan2(area, -bc.dot(ab)) * degrees, std::atan2(area, -ca.dot(bc)) * degrees};
}

double smallest_angle(const Point& a, const Point& b, const Point& c) {
  const auto all = angles(a, b, c);
  return std::min({all[0], all[1], all[2]});
}

void build_stars(LocalMesh& mesh) {
  mesh.stars.assign(mesh.vertices.size(), {});
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    if (mesh.triangles[t][0] < 0) continue;
    for (int v : mesh.triangles[t]) mesh.stars[v].push_back(t);
  }
}

namespace {

/// No vertex is taken off the border if that leaves a longer edge [cells].
constexpr double longest_border_edge = 1.7;

int faces_with_edge(const LocalMesh& mesh, int a, int b) {
  int count = 0;
  for (int t : mesh.stars[a]) {
    const Triple& v = mesh.triangles[t];
    count += v[0] == b || v[1] == b || v[2] == b;
  }
  return count;
}

std::pair<int, int> ordered(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

/// A few rings of triangles with their own vertex ids. Vertices are movable only if their whole star is in the patch.
struct Patch {
  std::vector<LocalVertex> vertices;
  std::vector<int> global;    ///< id in the mesh, -1 for a new vertex
  std::vector<char> movable;  ///< whole star inside the patch
  std::vector<char> dead;
  std::vector<Triple> triangles;
  std::set<std::pair<int, int>> border;       ///< edges on the border of the panel
  std::set<std::pair<int, int>> constraints;
  std::vector<std::array<int, 3>> split_constraints;  ///< edge a, b that became a, m and m, b

  bool locked(int a, int b) const { return border.count(ordered(a, b)) || constraints.count(ordered(a, b)); }

  /// Smallest angle that counts: not those between two edges of border or constraints.
  double quality(const Triple& t) const {
    const auto all = angles(vertices[t[0]].p, vertices[t[1]].p, vertices[t[2]].p);
    if (all[0] < 0) return -1;
    double least = 180;
    for (int k = 0; k < 3; ++k) {
      if (all[k] < least && !(locked(t[k], t[(k + 1) % 3]) && locked(t[k], t[(k + 2) % 3]))) least = all[k];
    }
    return least;
  }

  double cost(double target) const {
    double sum = 0;
    for (const Triple& t : triangles) {
      const double q = quality(t);
      if (q < 0) return 1e30;
      if (q < target) sum += (target - q) * (target - q);
    }
    return sum;
  }

  std::vector<int> star(int v) const {
    std::vector<int> result;
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
      if (triangles[t][0] == v || triangles[t][1] == v || triangles[t][2] == v) result.push_back(t);
    }
    return result;
  }
  double star_quality(const std::vector<int>& star) const {
    double least = 180;
    for (int t : star) least = std::min(least, quality(triangles[t]));
    return least;
  }
  std::vector<int> neighbours(int v) const {
    std::vector<int> result;
    for (int t : star(v)) {
      for (int w : triangles[t]) {
        if (w != v) result.push_back(w);
      }
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }
  /// Before and behind a vertex that slides.
  std::vector<int> line_neighbours(int v) const {
    std::vector<int> result = border_neighbours(v);
    if (!result.empty()) return result;
    for (int w : neighbours(v)) {
      if (constraints.count(ordered(v, w))) result.push_back(w);
    }
    return result;
  }
  std::vector<int> border_neighbours(int v) const {
    std::vector<int> result;
    for (int w : neighbours(v)) {
      if (border.count(ordered(v, w))) result.push_back(w);
    }
    return result;
  }
};

/// The triangle, those that touch it, and those that touch these; ascending.
std::vector<int> patch_triangles(const LocalMesh& mesh, int seed) {
  std::vector<int> ring{seed};
  for (int step = 0; step < 2; ++step) {
    std::vector<int> next;
    for (int t : ring) {
      for (int v : mesh.triangles[t]) next.insert(next.end(), mesh.stars[v].begin(), mesh.stars[v].end());
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    ring = std::move(next);
  }
  return ring;
}

Patch extract(const LocalMesh& mesh, const std::vector<int>& ring) {
  Patch patch;
  std::map<int, int> local;
  std::map<int, int> uses;
  for (int t : ring) {
    for (int v : mesh.triangles[t]) ++uses[v];
  }
  for (const auto& [v, count] : uses) {
    local[v] = static_cast<int>(patch.vertices.size());
    patch.vertices.push_back(mesh.vertices[v]);
    patch.global.push_back(v);
    patch.movable.push_back(count == static_cast<int>(mesh.stars[v].size()));
    patch.dead.push_back(0);
  }
  std::map<std::pair<int, int>, int> edge_uses;
  for (int t : ring) {
    const Triple& v = mesh.triangles[t];
    patch.triangles.push_back({local[v[0]], local[v[1]], local[v[2]]});
    for (int k = 0; k < 3; ++k) ++edge_uses[ordered(v[k], v[(k + 1) % 3])];
  }
  for (const auto& [edge, count] : edge_uses) {
    const auto inside = ordered(local[edge.first], local[edge.second]);
    if (count == 1 && faces_with_edge(mesh, edge.first, edge.second) == 1) patch.border.insert(inside);
    if (mesh.constraints.count(edge)) patch.constraints.insert(inside);
  }
  return patch;
}

/// Flips every edge whose two triangles get a larger smallest angle by it.
bool flip_edges(Patch& patch, double good) {
  bool changed = false;
  for (int t = 0; t < static_cast<int>(patch.triangles.size()); ++t) {
    const double q = patch.quality(patch.triangles[t]);
    if (q >= good) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = patch.triangles[t][k], b = patch.triangles[t][(k + 1) % 3], c = patch.triangles[t][(k + 2) % 3];
      if (patch.locked(a, b)) continue;
      int other = -1, d = -1;
      for (int u = 0; u < static_cast<int>(patch.triangles.size()) && other < 0; ++u) {
        for (int m = 0; m < 3; ++m) {
          if (patch.triangles[u][m] == b && patch.triangles[u][(m + 1) % 3] == a) other = u, d = patch.triangles[u][(m + 2) % 3];
        }
      }
      if (other < 0 || d == c) continue;
      const double before = std::min(q, patch.quality(patch.triangles[other]));
      const Triple first{c, a, d}, second{d, b, c};
      if (std::min(patch.quality(first), patch.quality(second)) > before + 1e-9) {
        patch.triangles[t] = first;
        patch.triangles[other] = second;
        changed = true;
        break;
      }
    }
  }
  return changed;
}

bool move_vertices(Patch& patch, const ImproveOptions& options) {
  bool changed = false;
  static const std::array<Point, 8> directions = [] {
    std::array<Point, 8> result;
    const double d = std::sqrt(0.5);
    result = {Point{1, 0}, Point{d, d}, Point{0, 1}, Point{-d, d}, Point{-1, 0}, Point{-d, -d}, Point{0, -1}, Point{d, -d}};
    return result;
  }();
  for (int v = 0; v < static_cast<int>(patch.vertices.size()); ++v) {
    LocalVertex& vertex = patch.vertices[v];
    if (patch.dead[v] || !patch.movable[v] || vertex.mobility == Mobility::fixed) continue;
    const std::vector<int> star = patch.star(v);
    double best = patch.star_quality(star);
    if (best >= options.good) continue;
    double low = 0, high = 0;
    if (vertex.mobility == Mobility::slide) {
      // Stays between its neighbours on the line, at no less than a quarter of the span from either.
      const std::vector<int> around = patch.line_neighbours(v);
      if (around.size() != 2) continue;
      const Point here = vertex.p;
      const double before = (patch.vertices[around[0]].p - here).norm(), after = (patch.vertices[around[1]].p - here).norm();
      const double room = std::min(before, after) - 0.25 * (before + after);
      if (room <= 0) continue;
      low = vertex.s - room;
      high = vertex.s + room;
    }
    for (double step : {0.2, 0.1, 0.05, 0.02}) {
      for (int round = 0; round < 3; ++round) {
        const LocalVertex start = vertex;
        LocalVertex winner = start;
        if (vertex.mobility == Mobility::free) {
          for (const Point& direction : directions) {
            vertex.p = start.p + step * direction;
            const double q = patch.star_quality(star);
            if (q > best + 1e-6) best = q, winner = vertex;
          }
        } else {
          for (double sign : {-1.0, 1.0}) {
            vertex.s = std::clamp(start.s + sign * step, low, high);
            vertex.p = options.curve_point(vertex.curve, vertex.s);
            const double q = patch.star_quality(star);
            if (q > best + 1e-6) best = q, winner = vertex;
          }
        }
        vertex = winner;
        if (winner.p == start.p) break;
        changed = true;
        if (best >= options.good) break;
      }
      if (best >= options.good) break;
    }
  }
  return changed;
}

void relax(Patch& patch, const ImproveOptions& options) {
  for (int sweep = 0; sweep < 6; ++sweep) {
    const bool flipped = flip_edges(patch, options.good);
    const bool moved = move_vertices(patch, options);
    if (!flipped && !moved) break;
  }
}

/// Moves every triangle of v onto w; those with both vanish. Nothing if the link condition fails.
std::optional<Patch> collapsed(const Patch& patch, int v, int w) {
  if (!patch.movable[v] || patch.vertices[v].mobility == Mobility::fixed) return std::nullopt;
  const std::vector<int> star = patch.star(v);
  const bool on_border = patch.border.count(ordered(v, w)) > 0;
  if ((patch.vertices[v].mobility == Mobility::slide) != on_border) return std::nullopt;
  for (const auto& edge : patch.constraints) {
    if (edge.first == v || edge.second == v) return std::nullopt;
  }
  // Common neighbours must be exactly the third corners of the triangles at the edge, or the surface would pinch.
  const std::vector<int> of_v = patch.neighbours(v), of_w = patch.neighbours(w);
  std::vector<int> common;
  std::set_intersection(of_v.begin(), of_v.end(), of_w.begin(), of_w.end(), std::back_inserter(common));
  if (common.size() != (on_border ? 1u : 2u)) return std::nullopt;
  Patch result = patch;
  result.triangles.clear();
  for (const Triple& t : patch.triangles) {
    Triple moved = t;
    for (int& corner : moved) corner = corner == v ? w : corner;
    if (moved[0] == moved[1] || moved[1] == moved[2] || moved[2] == moved[0]) continue;
    result.triangles.push_back(moved);
  }
  if (on_border) {
    for (int other : patch.border_neighbours(v)) {
      if ((patch.vertices[w].p - patch.vertices[other].p).norm() > longest_border_edge) return std::nullopt;
      result.border.erase(ordered(v, other));
      if (other != w) result.border.insert(ordered(w, other));
    }
  }
  result.dead[v] = 1;
  return result;
}

std::optional<Patch> split(const Patch& patch, int a, int b, const ImproveOptions& options) {
  const bool on_border = patch.border.count(ordered(a, b)) > 0, on_constraint = patch.constraints.count(ordered(a, b)) > 0;
  const LocalVertex &va = patch.vertices[a], &vb = patch.vertices[b];
  if ((va.p - vb.p).norm() < 2 * options.shortest_edge) return std::nullopt;
  LocalVertex middle;
  middle.p = 0.5 * (va.p + vb.p);
  if (on_border || on_constraint) {
    if (!options.may_split_border) return std::nullopt;
    // Halfway along the line's curve; at least one end must tell which curve that is.
    const LocalVertex& known = va.mobility == Mobility::slide ? va : vb;
    if (known.mobility != Mobility::slide) return std::nullopt;
    const LocalVertex& other = &known == &va ? vb : va;
    double s = 0;
    if (other.mobility == Mobility::slide && other.curve == known.curve) {
      s = 0.5 * (known.s + other.s);
    } else {
      const double half = 0.5 * (va.p - vb.p).norm();
      const Point forward = options.curve_point(known.curve, known.s + half), backward = options.curve_point(known.curve, known.s - half);
      s = known.s + ((forward - middle.p).norm() < (backward - middle.p).norm() ? half : -half);
    }
    middle = LocalVertex{options.curve_point(known.curve, s), Mobility::slide, known.curve, s};
  }
  Patch result = patch;
  const int m = static_cast<int>(patch.vertices.size());
  result.vertices.push_back(middle);
  result.global.push_back(-1);
  result.movable.push_back(1);
  result.dead.push_back(0);
  result.triangles.clear();
  int halves = 0;
  for (const Triple& t : patch.triangles) {
    int k = 0;
    while (k < 3 && !(ordered(t[k], t[(k + 1) % 3]) == ordered(a, b))) ++k;
    if (k == 3) {
      result.triangles.push_back(t);
      continue;
    }
    const int p = t[k], q = t[(k + 1) % 3], r = t[(k + 2) % 3];
    result.triangles.push_back({p, m, r});
    result.triangles.push_back({m, q, r});
    ++halves;
  }
  if (halves != (on_border ? 1 : 2)) return std::nullopt;  // part of the edge's triangles is outside the patch
  if (on_border) {
    result.border.erase(ordered(a, b));
    result.border.insert(ordered(a, m));
    result.border.insert(ordered(m, b));
  }
  if (on_constraint) {
    result.constraints.erase(ordered(a, b));
    result.constraints.insert(ordered(a, m));
    result.constraints.insert(ordered(m, b));
    result.split_constraints.push_back({a, b, m});
  }
  return result;
}

void remove_from_star(LocalMesh& mesh, int v, int t) {
  auto& star = mesh.stars[v];
  star.erase(std::lower_bound(star.begin(), star.end(), t));
}

void insert_in_star(LocalMesh& mesh, int v, int t) {
  auto& star = mesh.stars[v];
  star.insert(std::lower_bound(star.begin(), star.end(), t), t);
}

void set_triangle(LocalMesh& mesh, int t, const Triple& vertices) {
  if (mesh.triangles[t][0] >= 0) {
    for (int v : mesh.triangles[t]) remove_from_star(mesh, v, t);
  }
  mesh.triangles[t] = vertices;
  if (vertices[0] < 0) return;
  for (int v : vertices) insert_in_star(mesh, v, t);
}

/// Puts a changed patch in place of the triangles it came from; returns the new triangles.
std::vector<int> commit(LocalMesh& mesh, const std::vector<int>& old_triangles, const Patch& patch) {
  std::vector<int> global = patch.global;
  for (std::size_t v = 0; v < global.size(); ++v) {
    if (global[v] >= 0) {
      if (!patch.dead[v]) mesh.vertices[global[v]] = patch.vertices[v];
    } else if (!patch.dead[v]) {
      global[v] = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(patch.vertices[v]);
      mesh.stars.emplace_back();
    }
  }
  for (const auto& [a, b, m] : patch.split_constraints) {
    mesh.constraints.erase(ordered(global[a], global[b]));
    mesh.constraints.insert(ordered(global[a], global[m]));
    mesh.constraints.insert(ordered(global[m], global[b]));
  }
  std::vector<int> slots = old_triangles;
  for (int t : old_triangles) set_triangle(mesh, t, {-1, -1, -1});
  while (slots.size() < patch.triangles.size()) {
    slots.push_back(static_cast<int>(mesh.triangles.size()));
    mesh.triangles.push_back({-1, -1, -1});
  }
  slots.resize(patch.triangles.size());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const Triple& t = patch.triangles[i];
    set_triangle(mesh, slots[i], {global[t[0]], global[t[1]], global[t[2]]});
  }
  return slots;
}

double quality_in(const LocalMesh& mesh, int t) {
  const Triple& v = mesh.triangles[t];
  const auto all = angles(mesh.vertices[v[0]].p, mesh.vertices[v[1]].p, mesh.vertices[v[2]].p);
  if (all[0] < 0) return -1;
  const double least = std::min({all[0], all[1], all[2]});
  double counted = 180;
  for (int k = 0; k < 3; ++k) {
    // Only a small angle can be the outline's own; the look-up is skipped for the others.
    const auto line = [&](int w) { return faces_with_edge(mesh, v[k], w) == 1 || mesh.constraints.count(ordered(v[k], w)) > 0; };
    const bool outline = all[k] == least && line(v[(k + 1) % 3]) && line(v[(k + 2) % 3]);
    if (!outline) counted = std::min(counted, all[k]);
  }
  return counted;
}

}  // namespace

void improve(LocalMesh& mesh, const ImproveOptions& options) {
  const double wanted = options.target + 2;  // some room above what is promised
  std::vector<int> pending;
  if (options.around.empty()) {
    pending.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < pending.size(); ++t) pending[t] = static_cast<int>(t);
  } else {
    for (int v : options.around) pending.insert(pending.end(), mesh.stars[v].begin(), mesh.stars[v].end());
    std::sort(pending.begin(), pending.end());
    pending.erase(std::unique(pending.begin(), pending.end()), pending.end());
  }
  for (int pass = 0; pass < options.passes; ++pass) {
    std::vector<std::pair<double, int>> bad;
    for (int t : pending) {
      if (mesh.triangles[t][0] < 0) continue;
      const double q = quality_in(mesh, t);
      if (q < wanted) bad.emplace_back(q, t);
    }
    std::sort(bad.begin(), bad.end());
    std::vector<int> touched;
    for (const auto& [old_quality, t] : bad) {
      if (mesh.triangles[t][0] < 0 || quality_in(mesh, t) >= wanted) continue;
      const std::vector<int> old_triangles = patch_triangles(mesh, t);
      const Patch start = extract(mesh, old_triangles);
      const double cost_before = start.cost(wanted);
      Patch best = start;
      relax(best, options);
      double best_cost = best.cost(wanted);
      if (best_cost > 0.05 * cost_before && best_cost > 1) {
        std::vector<Patch> tries;
        Triple corners{};
        for (int k = 0; k < 3; ++k) {
          corners[k] = static_cast<int>(std::lower_bound(start.global.begin(), start.global.end(), mesh.triangles[t][k]) - start.global.begin());
        }
        if (options.may_remove) {
          for (int v : corners) {
            for (int w : start.neighbours(v)) {
              if (auto attempt = collapsed(start, v, w)) tries.push_back(std::move(*attempt));
            }
          }
        }
        if (options.may_insert) {
          for (int k = 0; k < 3; ++k) {
            if (auto attempt = split(start, corners[k], corners[(k + 1) % 3], options)) tries.push_back(std::move(*attempt));
          }
        }
        for (Patch& attempt : tries) {
          relax(attempt, options);
          // Keeping the number of vertices is worth a little.
          const double cost = attempt.cost(wanted) * 1.05 + 0.5;
          if (cost < best_cost) best_cost = cost, best = std::move(attempt);
        }
      }
      if (best_cost < cost_before - 1e-3) {
        const std::vector<int> fresh = commit(mesh, old_triangles, best);
        touched.insert(touched.end(), fresh.begin(), fresh.end());
      }
    }
    if (touched.empty()) break;
    for (const auto& [q, t] : bad) touched.push_back(t);
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    pending = std::move(touched);
  }
}

void replace_triangle(LocalMesh& mesh, int triangle, const Triple& vertices) { set_triangle(mesh, triangle, vertices); }

int split_edge(LocalMesh& mesh, int a, int b, const LocalVertex& vertex) {
  std::vector<int> found;
  for (int t : mesh.stars[a]) {
    const Triple& v = mesh.triangles[t];
    if (v[0] == b || v[1] == b || v[2] == b) found.push_back(t);
  }
  TOILE_CHECK(!found.empty(), "no triangle has the edge {} {}", a, b);
  const int m = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back(vertex);
  mesh.stars.emplace_back();
  for (int old : found) {
    const Triple t = mesh.triangles[old];
    int k = 0;
    while (!(ordered(t[k], t[(k + 1) % 3]) == ordered(a, b))) ++k;
    const int p = t[k], q = t[(k + 1) % 3], r = t[(k + 2) % 3];
    set_triangle(mesh, old, {p, m, r});
    mesh.triangles.push_back({-1, -1, -1});
    set_triangle(mesh, static_cast<int>(mesh.triangles.size()) - 1, {m, q, r});
  }
  if (mesh.constraints.erase(ordered(a, b)) > 0) {
    mesh.constraints.insert(ordered(a, m));
    mesh.constraints.insert(ordered(m, b));
  }
  return m;
}

void jitter(LocalMesh& mesh, double amount, const std::function<Point(int curve, double s)>& curve_point) {
  std::vector<char> held(mesh.vertices.size(), 0);
  for (const auto& [a, b] : mesh.constraints) held[static_cast<std::size_t>(a)] = held[static_cast<std::size_t>(b)] = 1;
  Rng rng(1);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    LocalVertex& vertex = mesh.vertices[v];
    if (vertex.mobility == Mobility::fixed || held[v] || mesh.stars[v].empty()) continue;
    const auto least = [&] {
      double angle = 180;
      for (int t : mesh.stars[v]) {
        const Triple& c = mesh.triangles[static_cast<std::size_t>(t)];
        angle = std::min(angle, smallest_angle(mesh.vertices[static_cast<std::size_t>(c[0])].p, mesh.vertices[static_cast<std::size_t>(c[1])].p, mesh.vertices[static_cast<std::size_t>(c[2])].p));
      }
      return angle;
    };
    const LocalVertex before = vertex;
    const double enough = std::min(18.0, least());
    Point move(rng.uniform(-amount, amount), rng.uniform(-amount, amount));
    for (int trial = 0; trial < 4; ++trial, move *= 0.5) {
      vertex = before;
      if (vertex.mobility == Mobility::free) {
        vertex.p += move;
      } else {
        vertex.s += move.x();
        vertex.p = curve_point(vertex.curve, vertex.s);
      }
      if (least() >= enough) break;
      vertex = before;
    }
  }
}

}  // namespace toile::tailor
