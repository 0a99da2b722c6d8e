#include "toile/mesh/topology.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace toile::mesh {

std::vector<Edge> edges(const Triangles& faces) {
  struct Half {
    int a, b, face;
  };
  std::vector<Half> halves;
  halves.reserve(static_cast<std::size_t>(faces.rows()) * 3);
  for (int f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      halves.push_back({std::min(a, b), std::max(a, b), f});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& p, const Half& q) { return std::tie(p.a, p.b, p.face) < std::tie(q.a, q.b, q.face); });
  std::vector<Edge> result;
  for (const Half& half : halves) {
    if (result.empty() || result.back().a != half.a || result.back().b != half.b) result.push_back({half.a, half.b, {}});
    result.back().faces.push_back(half.face);
  }
  return result;
}

std::vector<std::vector<int>> border_loops(const Triangles& faces) {
  std::map<std::pair<int, int>, int> directed;
  for (int f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) directed[{faces(f, k), faces(f, (k + 1) % 3)}] = f;
  }
  std::multimap<int, int> next;
  for (const auto& [edge, face] : directed) {
    if (!directed.count({edge.second, edge.first})) next.emplace(edge.first, edge.second);
  }
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    std::vector<int> loop;
    const int start = next.begin()->first;
    int current = start;
    while (true) {
      const auto it = next.find(current);
      if (it == next.end()) break;
      loop.push_back(current);
      current = it->second;
      next.erase(it);
      if (current == start) break;
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

int euler_number(const Triangles& faces) {
  std::vector<int> used(faces.data(), faces.data() + faces.size());
  std::sort(used.begin(), used.end());
  const auto vertices = std::unique(used.begin(), used.end()) - used.begin();
  return static_cast<int>(vertices) - static_cast<int>(edges(faces).size()) + static_cast<int>(faces.rows());
}

int component_count(const Triangles& faces) {
  if (faces.size() == 0) return 0;
  std::vector<int> root(static_cast<std::size_t>(faces.maxCoeff()) + 1);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int a) {
    while (root[static_cast<std::size_t>(a)] != a) a = root[static_cast<std::size_t>(a)] = root[static_cast<std::size_t>(root[static_cast<std::size_t>(a)])];
    return a;
  };
  for (int f = 0; f < faces.rows(); ++f) {
    for (int k = 1; k < 3; ++k) {
      const int a = find(faces(f, 0)), b = find(faces(f, k));
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<int> roots;
  for (int i = 0; i < faces.size(); ++i) roots.push_back(find(faces.data()[i]));
  std::sort(roots.begin(), roots.end());
  return static_cast<int>(std::unique(roots.begin(), roots.end()) - roots.begin());
}

Triangles mapped(const Triangles& faces, const Ids& map) {
  Triangles result(faces.rows(), 3);
  for (Eigen::Index i = 0; i < faces.size(); ++i) result.data()[i] = map[faces.data()[i]];
  return result;
}

}  // namespace toile::mesh
