#include "cut_mesh.h"

#include "toile/contact/distance.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace toile::reshape {

using Eigen::Vector3d;

namespace {
constexpr double kSnap = 0.2;      // part of an edge within which its end moves onto the cut
constexpr double kOnVertex = 2e-3; // within which the cut goes through an end that must not move
}  // namespace

CutMesh::CutMesh(const Surface& surface) {
  for (Eigen::Index v = 0; v < surface.x.rows(); ++v) x.emplace_back(surface.x.row(v));
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    faces.push_back({surface.faces(f, 0), surface.faces(f, 1), surface.faces(f, 2)});
    part.push_back(surface.face_part[f]);
  }
}

std::map<EdgeKey, std::vector<int>> CutMesh::edge_faces() const {
  std::map<EdgeKey, std::vector<int>> around;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) around[edge_key(faces[f][k], faces[f][(k + 1) % 3])].push_back(static_cast<int>(f));
  }
  return around;
}

Vector3d CutMesh::vertex_normal(int v) const {
  Vector3d sum = Vector3d::Zero();
  for (const auto& face : faces) {
    if (face[0] != v && face[1] != v && face[2] != v) continue;
    const Vector3d a = x[static_cast<std::size_t>(face[0])], b = x[static_cast<std::size_t>(face[1])], c = x[static_cast<std::size_t>(face[2])];
    sum += (b - a).cross(c - a);
  }
  return sum.normalized();
}

int CutMesh::split(int a, int b, const Vector3d& at, std::map<EdgeKey, std::vector<int>>& around) {
  const int m = static_cast<int>(x.size());
  x.push_back(at);
  const std::vector<int> beside = around.at(edge_key(a, b));
  around.erase(edge_key(a, b));
  if (const auto line = lines.find(edge_key(a, b)); line != lines.end()) {
    const int id = line->second;
    lines.erase(line);
    lines[edge_key(a, m)] = id;
    lines[edge_key(m, b)] = id;
  }
  for (const int f : beside) {
    std::array<int, 3>& face = faces[static_cast<std::size_t>(f)];
    std::size_t k = 0;
    while (edge_key(face[k], face[(k + 1) % 3]) != edge_key(a, b)) ++k;
    const int p = face[k], q = face[(k + 1) % 3], o = face[(k + 2) % 3];
    const int added = static_cast<int>(faces.size());
    face = {p, m, o};
    faces.push_back({m, q, o});
    part.push_back(part[static_cast<std::size_t>(f)]);
    auto& far = around[edge_key(q, o)];
    std::replace(far.begin(), far.end(), f, added);
    around[edge_key(p, m)].push_back(f);
    around[edge_key(m, q)].push_back(added);
    around[edge_key(m, o)].insert(around[edge_key(m, o)].end(), {f, added});
  }
  return m;
}

int CutMesh::insert_point(const Vector3d& point, double snap) {
  auto around = edge_faces();
  // On a line that is there already.
  const EdgeKey* best_edge = nullptr;
  double best_sq = snap * snap, best_t = 0;
  for (const auto& [edge, line] : lines) {
    const Vector3d a = x[static_cast<std::size_t>(edge.first)], ab = x[static_cast<std::size_t>(edge.second)] - a;
    const double t = std::clamp((point - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0), d = (point - a - t * ab).squaredNorm();
    if (d >= best_sq) continue;
    best_sq = d, best_edge = &edge, best_t = t;
  }
  if (best_edge) {
    const auto [a, b] = *best_edge;
    int v = -1;
    if (best_t < 0.05) v = a;
    else if (best_t > 0.95) v = b;
    else v = split(a, b, x[static_cast<std::size_t>(a)] + best_t * (x[static_cast<std::size_t>(b)] - x[static_cast<std::size_t>(a)]), around);
    held.insert(v);
    return v;
  }
  int best = -1;
  contact::Closest closest;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto c = contact::closest_vertex_face(point, x[static_cast<std::size_t>(faces[f][0])], x[static_cast<std::size_t>(faces[f][1])], x[static_cast<std::size_t>(faces[f][2])]);
    if (best < 0 || c.distance_sq < closest.distance_sq) best = static_cast<int>(f), closest = c;
  }
  const std::array<int, 3> face = faces[static_cast<std::size_t>(best)];
  std::array<double, 3> w{-closest.weight[1], -closest.weight[2], -closest.weight[3]};
  Vector3d p = Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) p += w[k] * x[static_cast<std::size_t>(face[k])];
  std::set<int> on_line;
  for (const auto& [edge, line] : lines) on_line.insert({edge.first, edge.second});
  for (std::size_t k = 0; k < 3; ++k) {
    if (w[k] < 1 - kSnap) continue;
    const int v = face[k];
    const bool border = std::any_of(around.begin(), around.end(), [&](const auto& e) { return e.second.size() == 1 && (e.first.first == v || e.first.second == v); });
    if (w[k] > 1 - kOnVertex || (!held.count(v) && !on_line.count(v) && !border)) {
      if (w[k] <= 1 - kOnVertex) x[static_cast<std::size_t>(v)] = p;
      held.insert(v);
      return v;
    }
  }
  // Near an edge: on it. Otherwise inside the face, by two splits: one edge through the point, then that edge.
  for (std::size_t k = 0; k < 3; ++k) {
    if (w[k] > 0.05) continue;
    const int a = face[(k + 1) % 3], b = face[(k + 2) % 3];
    const double t = w[(k + 2) % 3] / (w[(k + 1) % 3] + w[(k + 2) % 3]);
    const int v = split(a, b, x[static_cast<std::size_t>(a)] + t * (x[static_cast<std::size_t>(b)] - x[static_cast<std::size_t>(a)]), around);
    held.insert(v);
    return v;
  }
  const int m = static_cast<int>(x.size());
  x.push_back(p);
  faces[static_cast<std::size_t>(best)] = {face[0], face[1], m};
  faces.push_back({face[1], face[2], m});
  faces.push_back({face[2], face[0], m});
  part.insert(part.end(), 2, part[static_cast<std::size_t>(best)]);
  held.insert(m);
  return m;
}

Vector3d CutMesh::place(const Node& node, const Eigen::VectorXd& height) const {
  if (node.a == node.b) return x[static_cast<std::size_t>(node.a)];
  const double t = height[node.a] / (height[node.a] - height[node.b]);
  return (1 - t) * x[static_cast<std::size_t>(node.a)] + t * x[static_cast<std::size_t>(node.b)];
}

CutMesh::Section CutMesh::section(const Eigen::VectorXd& height, const std::vector<char>& keep_part) const {
  Section s;
  const auto link = [&](const Node& p, const Node& q) {
    for (const auto& [from, to] : {std::pair{p, q}, std::pair{q, p}}) {
      auto& list = s.next[from];
      if (std::find(list.begin(), list.end(), to) == list.end()) list.push_back(to);
    }
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (!keep_part.empty() && !keep_part[static_cast<std::size_t>(part[f] + 1)]) continue;
    std::vector<Node> nodes;
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = faces[f][k], b = faces[f][(k + 1) % 3];
      if (height[a] == 0) nodes.push_back({a, a});
      if (height[a] * height[b] < 0) nodes.push_back({std::min(a, b), std::max(a, b)});
    }
    if (nodes.size() == 2) link(nodes[0], nodes[1]);
  }
  return s;
}

void CutMesh::snap_vertices(Eigen::VectorXd& height, const std::set<Node>& wanted) {
  std::set<int> fixed = held;
  for (const auto& [edge, line] : lines) fixed.insert({edge.first, edge.second});
  for (const auto& [edge, beside] : edge_faces()) {
    if (beside.size() == 1) fixed.insert({edge.first, edge.second});
  }
  std::map<int, std::pair<double, Vector3d>> moves;
  for (const Node& node : wanted) {
    if (node.a == node.b) continue;
    const double t = height[node.a] / (height[node.a] - height[node.b]);
    for (const auto& [v, share] : {std::pair{node.a, t}, std::pair{node.b, 1 - t}}) {
      const bool stays = fixed.count(v) > 0;
      if (share >= (stays ? kOnVertex : kSnap)) continue;
      const auto found = moves.find(v);
      if (found != moves.end() && found->second.first <= share) continue;
      moves[v] = {share, stays ? x[static_cast<std::size_t>(v)] : place(node, height)};
    }
  }
  for (const auto& [v, move] : moves) {
    x[static_cast<std::size_t>(v)] = move.second;
    height[v] = 0;
  }
}

int CutMesh::realise(const std::vector<std::pair<Node, Node>>& steps, const Eigen::VectorXd& height, int line) {
  std::map<Node, int> vertex;
  for (const auto& [p, q] : steps) vertex[p] = vertex[q] = -1;
  auto around = edge_faces();
  for (auto& [node, v] : vertex) v = node.a == node.b ? node.a : split(node.a, node.b, place(node, height), around);
  int made = 0;
  for (const auto& [p, q] : steps) {
    const EdgeKey edge = edge_key(vertex[p], vertex[q]);
    TOILE_CHECK(around.count(edge), "no edge {} {}", edge.first, edge.second);
    lines.emplace(edge, line);
    ++made;
  }
  return made;
}

int CutMesh::cut_plane(const Vector3d& point, const Vector3d& normal, const std::vector<char>& keep_part, int line) {
  const auto heights = [&] {
    Eigen::VectorXd height(static_cast<Eigen::Index>(x.size()));
    for (std::size_t v = 0; v < x.size(); ++v) {
      const double h = (x[v] - point).dot(normal);
      height[static_cast<Eigen::Index>(v)] = std::abs(h) < 1e-9 ? 0 : h;
    }
    return height;
  };
  // The connected curve nearest to the point.
  const auto curve = [&](const Section& s, const Eigen::VectorXd& height) {
    std::set<Node> best, seen;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [start, unused] : s.next) {
      if (seen.count(start)) continue;
      std::vector<Node> members{start};
      seen.insert(start);
      double distance = nearest;
      bool nearer = false;
      for (std::size_t i = 0; i < members.size(); ++i) {
        const Vector3d p = place(members[i], height);
        for (const Node& next : s.next.at(members[i])) {
          const Vector3d ab = place(next, height) - p;
          const double t = ab.squaredNorm() > 0 ? std::clamp((point - p).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0;
          const double d = (point - p - t * ab).norm();
          if (d < distance) distance = d, nearer = true;
          if (seen.insert(next).second) members.push_back(next);
        }
      }
      if (nearer) nearest = distance, best = std::set<Node>(members.begin(), members.end());
    }
    return best;
  };
  Eigen::VectorXd height = heights();
  const std::set<Node> first = curve(section(height, keep_part), height);
  if (first.empty()) return 0;
  snap_vertices(height, first);
  const Section s = section(height, keep_part);
  std::vector<std::pair<Node, Node>> steps;
  const std::set<Node> nodes = curve(s, height);
  for (const Node& node : nodes) {
    for (const Node& next : s.next.at(node)) {
      if (node < next) steps.emplace_back(node, next);
    }
  }
  return realise(steps, height, line);
}

int CutMesh::cut_path(int from, int to, int line) {
  const Vector3d a = x[static_cast<std::size_t>(from)], b = x[static_cast<std::size_t>(to)];
  Vector3d up = vertex_normal(from) + vertex_normal(to);
  const Vector3d along = (b - a).normalized();
  if (!(up.cross(along).norm() > 1e-6)) return 0;
  const Vector3d normal = along.cross(up).normalized();
  Eigen::VectorXd height(static_cast<Eigen::Index>(x.size()));
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double h = (x[v] - a).dot(normal);
    height[static_cast<Eigen::Index>(v)] = std::abs(h) < 1e-9 ? 0 : h;
  }
  height[from] = height[to] = 0;
  const auto shortest = [&](const Section& s) {
    std::vector<std::pair<Node, Node>> steps;
    const Node start{from, from}, goal{to, to};
    if (!s.next.count(start) || !s.next.count(goal)) return steps;
    std::map<Node, std::pair<double, Node>> best{{start, {0, start}}};
    using Item = std::pair<double, Node>;
    std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
    queue.emplace(0, start);
    while (!queue.empty()) {
      const auto [d, node] = queue.top();
      queue.pop();
      if (d > best.at(node).first) continue;
      if (node == goal) break;
      for (const Node& next : s.next.at(node)) {
        const double through = d + (place(next, height) - place(node, height)).norm();
        const auto found = best.find(next);
        if (found != best.end() && found->second.first <= through) continue;
        best[next] = {through, node};
        queue.emplace(through, next);
      }
    }
    if (!best.count(goal)) return steps;
    for (Node node = goal; node != start; node = best.at(node).second) steps.emplace_back(best.at(node).second, node);
    return steps;
  };
  const auto first = shortest(section(height, {}));
  if (first.empty()) return 0;
  std::set<Node> wanted;
  for (const auto& [p, q] : first) wanted.insert({p, q});
  snap_vertices(height, wanted);
  const auto steps = shortest(section(height, {}));
  if (steps.empty()) return 0;
  return realise(steps, height, line);
}

}  // namespace toile::reshape
