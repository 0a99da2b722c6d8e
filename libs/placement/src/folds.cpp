#include "toile/placement/folds.h"

#include "toile/mesh/topology.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace toile::placement {

namespace {

using Eigen::Vector2d;

constexpr double kTurned = std::numbers::pi / 3;  // a fold by less does not turn the cloth over [rad]
constexpr double kStraight = 0.002;               // a line that leaves its chord by less than this part of it is straight

// Rows of connected edges, each an ordered path (a closed one repeats its first vertex).
std::vector<std::vector<int>> paths_of(const std::vector<std::pair<int, int>>& edges) {
  std::map<int, std::vector<int>> neighbours;
  for (const auto& [a, b] : edges) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  for (auto& [v, list] : neighbours) std::sort(list.begin(), list.end());
  std::set<std::pair<int, int>> used;
  std::vector<std::vector<int>> paths;
  const auto walk = [&](int start) {
    std::vector<int> path{start};
    while (true) {
      int next = -1;
      for (int w : neighbours[path.back()]) {
        if (!used.count(std::minmax(path.back(), w))) {
          next = w;
          break;
        }
      }
      if (next < 0) break;
      used.insert(std::minmax(path.back(), next));
      path.push_back(next);
    }
    if (path.size() > 1) paths.push_back(std::move(path));
  };
  for (const auto& [v, list] : neighbours) {
    if (list.size() == 1) walk(v);
  }
  for (const auto& [v, list] : neighbours) walk(v);
  return paths;
}


// Nearest point of a polyline whose ends go on straight.
Vector2d nearest_on(const std::vector<Vector2d>& line, const Vector2d& p) {
  Vector2d best = line.front();
  double best_sq = 1e18;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vector2d d = line[i + 1] - line[i];
    double t = (p - line[i]).dot(d) / std::max(d.squaredNorm(), 1e-18);
    if (i > 0) t = std::max(t, 0.0);
    if (i + 2 < line.size()) t = std::min(t, 1.0);
    const Vector2d q = line[i] + t * d;
    if ((q - p).squaredNorm() < best_sq) {
      best_sq = (q - p).squaredNorm();
      best = q;
    }
  }
  return best;
}

bool straight(const std::vector<Vector2d>& line) {
  const Vector2d chord = line.back() - line.front();
  if (chord.norm() < 1e-9) return false;
  double worst = 0;
  for (const Vector2d& p : line) {
    const Vector2d d = p - line.front();
    worst = std::max(worst, std::abs(chord.x() * d.y() - chord.y() * d.x()) / chord.norm());
  }
  return worst < kStraight * chord.norm();
}

Vector2d mirrored(const std::vector<Vector2d>& line, bool is_straight, const Vector2d& p) {
  if (is_straight) {
    const Vector2d along = (line.back() - line.front()).normalized(), d = p - line.front();
    return line.front() + 2 * d.dot(along) * along - d;
  }
  return 2 * nearest_on(line, p) - p;
}

// How the parts between fold lines turn: part of every face; for each part the lines crossed from it to its panel's main part,
// nearest first, and the sheets between them.
struct Turning {
  std::vector<int> part;
  std::vector<std::vector<int>> crossed;
  std::vector<double> layer;
};

Turning turning_of(const mesh::GarmentMesh& garment, const std::vector<FoldLine>& lines) {
  const std::vector<mesh::Edge> edges = mesh::edges(garment.faces);
  std::vector<char> welded(static_cast<std::size_t>(garment.vertex_count()), 0);
  for (const mesh::Weld& weld : garment.welds) welded[static_cast<std::size_t>(weld.a)] = welded[static_cast<std::size_t>(weld.b)] = 1;
  std::map<std::pair<int, int>, int> line_of_edge;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t k = 0; k + 1 < lines[i].vertices.size(); ++k) {
      line_of_edge[std::minmax(lines[i].vertices[k], lines[i].vertices[k + 1])] = static_cast<int>(i);
    }
  }
  const std::vector<int> part = parts_between(garment, lines);
  const auto faces = static_cast<std::size_t>(garment.face_count());
  const int parts = faces == 0 ? 0 : *std::max_element(part.begin(), part.end()) + 1;
  struct Part {
    int panel = 0;
    double seams = 0, area = 0;
    std::vector<std::pair<int, int>> across;  // (fold line, other part)
  };
  std::vector<Part> list(static_cast<std::size_t>(parts));
  const Eigen::VectorXd areas = mesh::rest_areas(garment);
  for (std::size_t f = 0; f < faces; ++f) {
    Part& p = list[static_cast<std::size_t>(part[f])];
    p.panel = garment.face_panel[static_cast<Eigen::Index>(f)];
    p.area += areas[static_cast<Eigen::Index>(f)];
  }
  for (const mesh::Edge& edge : edges) {
    const int a = part[static_cast<std::size_t>(edge.faces[0])];
    if (edge.faces.size() == 1) {
      if (welded[static_cast<std::size_t>(edge.a)] && welded[static_cast<std::size_t>(edge.b)]) {
        list[static_cast<std::size_t>(a)].seams += (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm();
      }
      continue;
    }
    const int b = part[static_cast<std::size_t>(edge.faces[1])];
    const auto it = line_of_edge.find({edge.a, edge.b});
    if (a == b || it == line_of_edge.end()) continue;
    auto& from = list[static_cast<std::size_t>(a)].across;
    if (std::find(from.begin(), from.end(), std::pair(it->second, b)) != from.end()) continue;
    from.emplace_back(it->second, b);
    list[static_cast<std::size_t>(b)].across.emplace_back(it->second, a);
  }
  // From each panel's main part outwards: the lines crossed on the way, nearest to the part first.
  std::vector<std::vector<int>> crossed(static_cast<std::size_t>(parts));
  std::vector<double> layer(static_cast<std::size_t>(parts), 0), facing(static_cast<std::size_t>(parts), 0);
  for (std::size_t p = 0; p < garment.panels.size(); ++p) {
    int main = -1;
    for (int k = 0; k < parts; ++k) {
      const Part& candidate = list[static_cast<std::size_t>(k)];
      if (candidate.panel != static_cast<int>(p)) continue;
      if (main < 0) {
        main = k;
        continue;
      }
      const Part& best = list[static_cast<std::size_t>(main)];
      const bool better = std::abs(candidate.seams - best.seams) > 1e-9 ? candidate.seams > best.seams : candidate.area > best.area;
      if (better) main = k;
    }
    if (main < 0) continue;
    facing[static_cast<std::size_t>(main)] = 1;
    std::vector<int> queue{main};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const auto here = static_cast<std::size_t>(queue[i]);
      auto across = list[here].across;
      std::sort(across.begin(), across.end());
      for (const auto& [line, other] : across) {
        const auto o = static_cast<std::size_t>(other);
        if (facing[o] != 0) continue;
        const FoldLine& fold = lines[static_cast<std::size_t>(line)];
        layer[o] = layer[here] + facing[here] * (fold.angle > 0 ? 1 : -1);
        facing[o] = -facing[here];
        crossed[o].push_back(line);
        crossed[o].insert(crossed[o].end(), crossed[here].begin(), crossed[here].end());
        queue.push_back(other);
      }
    }
  }
  return {part, crossed, layer};
}

}  // namespace

std::vector<FoldLine> fold_lines(const mesh::GarmentMesh& garment) {
  std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> edges;  // (fold, panel)
  const auto turns = [&](int fold) { return std::abs(garment.folds[static_cast<std::size_t>(fold)].angle) >= kTurned; };
  for (const mesh::Fold& fold : garment.folds) {
    if (!turns(fold.id)) continue;
    for (int run : fold.runs) {
      const std::vector<int> ids = mesh::run_vertex_ids(garment, run);
      auto& list = edges[{fold.id, garment.runs[static_cast<std::size_t>(run)].panel}];
      for (std::size_t i = 0; i + 1 < ids.size(); ++i) list.emplace_back(ids[i], ids[i + 1]);
    }
  }
  for (const mesh::Hinge& hinge : garment.hinges) {
    if (hinge.fold < 0 || !turns(hinge.fold) || !garment.folds[static_cast<std::size_t>(hinge.fold)].runs.empty()) continue;
    const int panel = garment.vertex_panel[hinge.v0];
    if (garment.vertex_panel[hinge.o0] != panel || garment.vertex_panel[hinge.o1] != panel) continue;
    edges[{hinge.fold, panel}].emplace_back(hinge.v0, hinge.v1);
  }
  // A roll spreads over several rows, and may take up only a part of its line: then the whole line is where the cloth turns.
  for (auto& [key, list] : edges) {
    if (!garment.folds[static_cast<std::size_t>(key.first)].runs.empty()) continue;
    std::set<std::pair<int, int>> held;
    for (const auto& [a, b] : list) held.insert(std::minmax(a, b));
    for (const mesh::Run& run : garment.runs) {
      if (!run.internal || run.panel != key.second) continue;
      const std::vector<int> ids = mesh::run_vertex_ids(garment, run.id);
      std::vector<std::pair<int, int>> along;
      std::size_t count = 0;
      for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
        along.emplace_back(ids[i], ids[i + 1]);
        count += held.count(std::minmax(ids[i], ids[i + 1]));
      }
      if (2 * count < along.size() || along.empty()) continue;
      list = std::move(along);
      break;
    }
  }
  std::vector<FoldLine> lines;
  for (const auto& [key, list] : edges) {
    auto paths = paths_of(list);
    // Of parallel rows the middle one: that with the least sum of distances from the others' middles.
    const auto middle = [&](const std::vector<int>& path) { return Vector2d(garment.uv.row(path[path.size() / 2]).transpose()); };
    std::size_t best = 0;
    double best_sum = 1e18;
    std::size_t longest = 0;
    for (const auto& path : paths) longest = std::max(longest, path.size());
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (paths[i].size() * 2 < longest) continue;
      double sum = 0;
      for (const auto& other : paths) sum += (middle(paths[i]) - middle(other)).norm();
      if (sum < best_sum - 1e-9) {
        best_sum = sum;
        best = i;
      }
    }
    lines.push_back({key.first, key.second, garment.folds[static_cast<std::size_t>(key.first)].angle, std::move(paths[best])});
  }
  return lines;
}

std::vector<int> parts_between(const mesh::GarmentMesh& garment, const std::vector<FoldLine>& lines) {
  std::set<std::pair<int, int>> cut;
  for (const FoldLine& line : lines) {
    for (std::size_t k = 0; k + 1 < line.vertices.size(); ++k) cut.insert(std::minmax(line.vertices[k], line.vertices[k + 1]));
  }
  const auto faces = static_cast<std::size_t>(garment.face_count());
  std::vector<std::vector<int>> next(faces);
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    if (edge.faces.size() != 2 || cut.count({edge.a, edge.b})) continue;
    next[static_cast<std::size_t>(edge.faces[0])].push_back(edge.faces[1]);
    next[static_cast<std::size_t>(edge.faces[1])].push_back(edge.faces[0]);
  }
  std::vector<int> part(faces, -1);
  int parts = 0;
  for (std::size_t f = 0; f < faces; ++f) {
    if (part[f] >= 0) continue;
    std::vector<int> stack{static_cast<int>(f)};
    part[f] = parts;
    while (!stack.empty()) {
      const auto g = static_cast<std::size_t>(stack.back());
      stack.pop_back();
      for (int h : next[g]) {
        if (part[static_cast<std::size_t>(h)] >= 0) continue;
        part[static_cast<std::size_t>(h)] = parts;
        stack.push_back(h);
      }
    }
    ++parts;
  }
  return part;
}

double FoldedFlat::greatest(int panel, const mesh::GarmentMesh& garment) const {
  double value = 0;
  for (std::size_t v = 0; v < layer.size(); ++v) {
    if (garment.vertex_panel[static_cast<Eigen::Index>(v)] == panel) value = std::max(value, layer[v]);
  }
  return value;
}

double FoldedFlat::least(int panel, const mesh::GarmentMesh& garment) const {
  double value = 0;
  for (std::size_t v = 0; v < layer.size(); ++v) {
    if (garment.vertex_panel[static_cast<Eigen::Index>(v)] == panel) value = std::min(value, layer[v]);
  }
  return value;
}

FoldedFlat fold_flat(const mesh::GarmentMesh& garment) {
  FoldedFlat flat;
  flat.uv = garment.uv;
  flat.layer.assign(static_cast<std::size_t>(garment.vertex_count()), 0.0);
  const std::vector<FoldLine> lines = fold_lines(garment);
  if (lines.empty()) return flat;
  const Turning turning = turning_of(garment, lines);
  const auto& [part, crossed, layer] = turning;
  const auto faces = static_cast<std::size_t>(garment.face_count());
  std::vector<std::vector<Vector2d>> drawn;
  std::vector<char> is_straight;
  for (const FoldLine& line : lines) {
    std::vector<Vector2d> points;
    for (int v : line.vertices) points.emplace_back(garment.uv.row(v).transpose());
    is_straight.push_back(straight(points));
    drawn.push_back(std::move(points));
  }
  std::vector<int> count(static_cast<std::size_t>(garment.vertex_count()), 0);
  for (std::size_t f = 0; f < faces; ++f) {
    const auto p = static_cast<std::size_t>(part[f]);
    for (int k = 0; k < 3; ++k) {
      const int v = garment.faces(static_cast<Eigen::Index>(f), k);
      Vector2d q = garment.uv.row(v).transpose();
      for (int line : crossed[p]) q = mirrored(drawn[static_cast<std::size_t>(line)], is_straight[static_cast<std::size_t>(line)], q);
      // On a fold line the parts agree but for rounding: the mean of all.
      const auto i = static_cast<std::size_t>(v);
      const double share = 1.0 / (count[i] + 1);
      flat.uv.row(v) += share * (q.transpose() - flat.uv.row(v));
      flat.layer[i] += share * (layer[p] - flat.layer[i]);
      ++count[i];
    }
  }
  return flat;
}

std::vector<int> stuck_folds(const mesh::GarmentMesh& garment) {
  const std::vector<FoldLine> lines = fold_lines(garment);
  std::set<int> stuck;
  if (lines.empty()) return {};
  const Turning turning = turning_of(garment, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::vector<Vector2d> line;
    for (int v : lines[i].vertices) line.emplace_back(garment.uv.row(v).transpose());
    if (straight(line)) continue;
    const Vector2d chord = line.back() - line.front();
    const auto side = [&](const Vector2d& p) { return chord.x() * (p - line.front()).y() - chord.y() * (p - line.front()).x(); };
    double bulge = 0;
    for (const Vector2d& p : line) bulge += side(p);
    // The face beside the line whose part turns last about it.
    std::set<std::pair<int, int>> along;
    for (std::size_t k = 0; k + 1 < lines[i].vertices.size(); ++k) along.insert(std::minmax(lines[i].vertices[k], lines[i].vertices[k + 1]));
    double turned = 0;
    for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
      const auto& crossed = turning.crossed[static_cast<std::size_t>(turning.part[static_cast<std::size_t>(f)])];
      if (crossed.empty() || crossed.front() != static_cast<int>(i)) continue;
      for (int k = 0; k < 3; ++k) {
        const int a = garment.faces(f, k), b = garment.faces(f, (k + 1) % 3), c = garment.faces(f, (k + 2) % 3);
        if (!along.count(std::minmax(a, b))) continue;
        const Vector2d p = garment.uv.row(a).transpose(), d = Vector2d(garment.uv.row(b).transpose()) - p, q = Vector2d(garment.uv.row(c).transpose()) - p;
        // which side of the chord's direction the turned cloth lies on, along this piece of the line
        turned += (d.dot(chord) > 0 ? 1 : -1) * (d.x() * q.y() - d.y() * q.x());
      }
    }
    if (turned * bulge < 0) stuck.insert(lines[i].fold);
  }
  return {stuck.begin(), stuck.end()};
}

mesh::GarmentMesh without_folds(const mesh::GarmentMesh& garment, const std::vector<int>& folds) {
  mesh::GarmentMesh flat = garment;
  for (int fold : folds) flat.folds[static_cast<std::size_t>(fold)].angle = 0;
  std::erase_if(flat.hinges, [&](const mesh::Hinge& hinge) { return std::find(folds.begin(), folds.end(), hinge.fold) != folds.end(); });
  // Where a fold takes up only a part of its line, the cloth is turned over along the rest of it too.
  std::set<std::pair<int, int>> held;
  for (const mesh::Hinge& hinge : flat.hinges) held.insert(std::minmax(hinge.v0, hinge.v1));
  std::map<std::pair<int, int>, int> opposite;
  for (Eigen::Index f = 0; f < flat.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) opposite[{flat.faces(f, k), flat.faces(f, (k + 1) % 3)}] = flat.faces(f, (k + 2) % 3);
  }
  for (const FoldLine& line : fold_lines(flat)) {
    for (std::size_t i = 0; i + 1 < line.vertices.size(); ++i) {
      const int a = line.vertices[i], b = line.vertices[i + 1];
      const auto left = opposite.find({a, b}), right = opposite.find({b, a});
      if (held.count(std::minmax(a, b)) || left == opposite.end() || right == opposite.end()) continue;
      flat.hinges.push_back({a, b, left->second, right->second, line.angle, 1, line.fold});
    }
  }
  return flat;
}

}  // namespace toile::placement
