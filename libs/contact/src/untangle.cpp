#include "toile/contact/untangle.h"

#include "toile/base/result.h"
#include "toile/contact/exact.h"
#include "tree.h"

#include <algorithm>
#include <optional>

namespace toile::contact {
namespace {

struct Crossing {
  int edge, face;
  auto operator<=>(const Crossing&) const = default;
};

// The pieces that the cut edges leave of the cloth.
struct Pieces {
  std::vector<int> root, size;
  int of(int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  }
  Pieces(const Surface& cloth, const std::vector<Crossing>& cuts) : root(cloth.node_count), size(cloth.node_count, 0) {
    for (int v = 0; v < cloth.node_count; ++v) root[v] = v;
    std::size_t cut = 0;
    for (int e = 0; e < static_cast<int>(cloth.edges.size()); ++e) {
      while (cut < cuts.size() && cuts[cut].edge < e) ++cut;
      if (cut < cuts.size() && cuts[cut].edge == e) continue;
      const int a = of(cloth.edges[e][0]), b = of(cloth.edges[e][1]);
      root[std::max(a, b)] = std::min(a, b);
    }
    for (int v = 0; v < cloth.node_count; ++v) ++size[of(v)];
  }
};

double volume(const Vec& a, const Vec& b, const Vec& c, const Vec& d) { return (b - a).cross(c - a).dot(d - a); }

// Direction in which the edge has to move against the face for the curve of the cut to become shorter fastest
// (Volino and Magnenat-Thalmann 2006).
std::optional<Vec> curve_gradient(const Surface& cloth, const Points3& y, int edge, const Vec& along, const Vec& normal) {
  const auto [i, j] = cloth.edges[edge];
  // Steep crossings say where to go; along a grazing one the direction is all noise.
  double lean = along.dot(normal);
  if (std::abs(lean) < 0.05) lean = lean < 0 ? -0.05 : 0.05;
  Vec gradient = Vec::Zero();
  for (const int f : cloth.edge_faces[edge]) {
    if (f < 0) continue;
    int third = cloth.faces(f, 0);
    for (int k = 1; k < 3; ++k) {
      if (third == i || third == j) third = cloth.faces(f, k);
    }
    // The curve runs from the crossing into each face beside the edge, along that face's line with the crossed plane.
    const Vec side = (y.row(third) - y.row(i)).transpose();
    Vec curve = normal.cross(along.cross(side));
    const double size = curve.norm();
    if (!(size > 0)) continue;
    curve /= size;
    if (curve.dot(side - side.dot(along) * along) < 0) curve = -curve;
    gradient += curve - 2 * along.dot(curve) / lean * normal;
  }
  if (!(gradient.norm() > 0)) return {};
  return gradient;
}

}  // namespace

Untangled untangle(const Surface& cloth, const Points3& x, const UntangleOptions& options) {
  TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
  TOILE_CHECK(options.step > 0 && (options.held.empty() || options.held.size() == static_cast<std::size_t>(cloth.node_count)),
              "step {} held {} nodes {}", options.step, options.held.size(), cloth.node_count);
  Untangled result{.x = x};
  const std::size_t count = static_cast<std::size_t>(cloth.node_count);
  std::vector<double> length(cloth.edges.size());
  for (std::size_t e = 0; e < length.size(); ++e) length[e] = (x.row(cloth.edges[e][0]) - x.row(cloth.edges[e][1])).norm();
  const auto free = [&](int node) { return options.held.empty() || !options.held[node]; };
  Points3& y = result.x;
  const auto at = [&](int node) { return Vec(y.row(node).transpose()); };

  std::vector<Vec> push(count), spread(count);
  std::vector<int> pushes(count), spreads(count);
  std::vector<std::uint8_t> touched(count, 0);  // moved by a crossing or drawn along since
  std::vector<Crossing> crossings;
  std::vector<FacePair> sided;  // face pairs on which some crossing knows its side
  for (;; ++result.passes) {
    const std::vector<FacePair> pairs = self_intersections(cloth, y);
    if (result.passes == 0) result.before = static_cast<int>(pairs.size());
    result.after = static_cast<int>(pairs.size());
    if (pairs.empty() || result.passes == options.passes) break;

    crossings.clear();
    for (const FacePair& pair : pairs) {
      for (const auto& [from, to] : {std::pair(pair.a, pair.b), std::pair(pair.b, pair.a)}) {
        for (const int e : cloth.face_edges[from]) {
          const Vec p = at(cloth.edges[e][0]), q = at(cloth.edges[e][1]);
          const Vec a = at(cloth.faces(to, 0)), b = at(cloth.faces(to, 1)), c = at(cloth.faces(to, 2));
          if ((volume(a, b, c, p) > 0) == (volume(a, b, c, q) > 0)) continue;
          const bool u = volume(p, q, a, b) > 0, v = volume(p, q, b, c) > 0, w = volume(p, q, c, a) > 0;
          if (u == v && v == w) crossings.push_back({e, to});
        }
      }
    }
    std::sort(crossings.begin(), crossings.end());
    crossings.erase(std::unique(crossings.begin(), crossings.end()), crossings.end());

    // A crossed edge whose ends lie in different pieces: the smaller piece is the one that went astray and goes back
    // (global intersection analysis). Where the cut separates nothing, or touches no such edge, the curve is shortened.
    Pieces pieces(cloth, crossings);
    const auto astray = [&](int edge) -> std::optional<int> {
      const auto [i, j] = cloth.edges[edge];
      const int a = pieces.of(i), b = pieces.of(j);
      if (a == b || pieces.size[a] == pieces.size[b]) return {};
      return pieces.size[a] < pieces.size[b] ? 0 : 1;
    };
    sided.clear();
    for (const Crossing& crossing : crossings) {
      if (!astray(crossing.edge)) continue;
      for (const int f : cloth.edge_faces[crossing.edge]) {
        if (f >= 0) sided.push_back({std::min(f, crossing.face), std::max(f, crossing.face)});
      }
    }
    std::sort(sided.begin(), sided.end());
    std::fill(push.begin(), push.end(), Vec::Zero());
    std::fill(pushes.begin(), pushes.end(), 0);
    for (const Crossing& crossing : crossings) {
      const auto [i, j] = cloth.edges[crossing.edge];
      const std::array<int, 3> corner{cloth.faces(crossing.face, 0), cloth.faces(crossing.face, 1), cloth.faces(crossing.face, 2)};
      const Vec p = at(i), q = at(j), a = at(corner[0]), b = at(corner[1]), c = at(corner[2]);
      Vec along = q - p, normal = (b - a).cross(c - a);
      if (!(along.norm() > 0) || !(normal.norm() > 0)) continue;
      along.normalize();
      normal.normalize();
      const std::optional<int> wrong = astray(crossing.edge);
      if (!wrong) {
        bool settled = false;
        for (const int f : cloth.edge_faces[crossing.edge]) {
          settled |= f >= 0 && std::binary_search(sided.begin(), sided.end(), FacePair{std::min(f, crossing.face), std::max(f, crossing.face)});
        }
        if (settled) continue;
      }
      const double height_p = (p - a).dot(normal), height_q = (q - a).dot(normal);
      const double t = std::clamp(height_p / (height_p - height_q), 0.0, 1.0);
      const Closest on = closest_vertex_face(p + t * (q - p), a, b, c);
      const int node[5] = {i, j, corner[0], corner[1], corner[2]};
      double weight[5] = {1 - t, t, on.weight[1], on.weight[2], on.weight[3]};
      Vec move;
      if (wrong) {
        // The end that is on the wrong side goes through the face, towards the other end.
        weight[0] = *wrong == 0, weight[1] = *wrong == 1;
        const double deep = std::abs(*wrong == 0 ? height_p : height_q);
        const double back = (*wrong == 0 ? height_q : height_p) > 0 ? 1 : -1;
        move = back * std::min(options.step, deep + 0.2 * options.step) * normal;
      } else {
        const std::optional<Vec> gradient = curve_gradient(cloth, y, crossing.edge, along, normal);
        if (!gradient) continue;
        move = options.step / std::sqrt(gradient->squaredNorm() + 1e-4) * *gradient;
      }
      double total = 0;
      for (int k = 0; k < 5; ++k) total += free(node[k]) ? weight[k] * weight[k] : 0;
      if (!(total > 0)) continue;
      for (int k = 0; k < 5; ++k) {
        if (!free(node[k])) continue;
        push[node[k]] += weight[k] / total * move;
        ++pushes[node[k]];
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      if (pushes[v] == 0) continue;
      // Crossings share nodes: their mean, so that a node in many of them does not run away.
      push[v] /= pushes[v];
      const double size = push[v].norm();
      if (size > options.step) push[v] *= options.step / size;
    }
    // What is pushed takes its surroundings along, or the cloth's own stiffness would only spring back.
    for (int ring = 0; ring < options.rings; ++ring) {
      std::fill(spread.begin(), spread.end(), Vec::Zero());
      std::fill(spreads.begin(), spreads.end(), 0);
      for (const auto& [i, j] : cloth.edges) {
        if (pushes[i] != 0 && pushes[j] == 0) spread[j] += push[i], ++spreads[j];
        if (pushes[j] != 0 && pushes[i] == 0) spread[i] += push[j], ++spreads[i];
      }
      for (std::size_t v = 0; v < count; ++v) {
        if (spreads[v] == 0 || !free(static_cast<int>(v))) continue;
        push[v] = (1 - 1.0 / (options.rings + 1)) / spreads[v] * spread[v];
        pushes[v] = 1;
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      if (pushes[v] == 0) continue;
      y.row(v) += push[v].transpose();
      touched[v] = 1;
    }
    for (int sweep = 0; sweep < options.relaxations; ++sweep) {
      for (std::size_t e = 0; e < length.size(); ++e) {
        const auto [i, j] = cloth.edges[e];
        if (!touched[i] && !touched[j]) continue;
        const Eigen::RowVector3d d = y.row(j) - y.row(i);
        const double now = d.norm();
        const double wi = free(i), wj = free(j);
        if (!(now > 0) || wi + wj == 0 || std::abs(now - length[e]) < 1e-3 * length[e]) continue;
        const Eigen::RowVector3d correction = (1 - length[e] / now) / (wi + wj) * d;
        y.row(i) += wi * correction;
        y.row(j) -= wj * correction;
        touched[i] = touched[j] = 1;
      }
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    const double way = (y.row(v) - x.row(v)).norm();
    result.moved += way > 0;
    result.largest_move = std::max(result.largest_move, way);
  }
  return result;
}

}  // namespace toile::contact
