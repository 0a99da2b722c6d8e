#include "cut_open.h"

#include "toile/mesh/topology.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>

namespace toile::tailor {
namespace {

class Cutter {
 public:
  Cutter(const PanelMesh& mesh, const std::vector<std::string>& names, const std::string& panel) : mesh_(mesh), panel_(panel) {
    for (const GridRun& run : mesh.runs) {
      const bool cut = run.internal && std::find(names.begin(), names.end(), run.name) != names.end();
      cut_.push_back(cut);
      for (std::size_t k = 0; cut && k + 1 < run.vertices.size(); ++k) edges_.insert(std::minmax(run.vertices[k].first, run.vertices[k + 1].first));
    }
    for (const auto& [a, b] : edges_) {
      stars_[a];
      stars_[b];
    }
    for (int f = 0; f < mesh.faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const auto star = stars_.find(mesh.faces(f, k));
        if (star != stars_.end()) star->second.push_back({f, 0});
      }
    }
  }

  Result<PanelMesh> run() {
    result_ = mesh_;
    find_fans();
    number_copies();
    make_runs();
    make_points();
    if (issues_.empty() && mesh::component_count(result_.faces) > mesh::component_count(mesh_.faces)) report_lost_piece();
    if (!issues_.empty()) return issues_;
    return std::move(result_);
  }

 private:
  struct Corner {
    int face, fan;
  };

  std::string place(int v) const { return fmt::format("({:.2f}, {:.2f}) cm", mesh_.uv(v, 0) * 100, mesh_.uv(v, 1) * 100); }
  void report(const char* code, const std::string& run, std::string what, std::string remedy) {
    issues_.push_back({code, {.item = panel_ + "." + run}, std::move(what), std::move(remedy), Category::check});
  }
  bool has(int face, int v) const { return mesh_.faces(face, 0) == v || mesh_.faces(face, 1) == v || mesh_.faces(face, 2) == v; }
  /// The face with the directed edge from a to b.
  std::optional<int> left_of(int a, int b) const {
    const auto star = stars_.count(a) ? stars_.find(a) : stars_.find(b);
    if (star == stars_.end()) return std::nullopt;
    for (const Corner& corner : star->second) {
      for (int k = 0; k < 3; ++k) {
        if (mesh_.faces(corner.face, k) == a && mesh_.faces(corner.face, (k + 1) % 3) == b) return corner.face;
      }
    }
    return std::nullopt;
  }

  /// Triangles round a vertex that hang together without crossing a cut are a fan.
  void find_fans() {
    for (auto& [v, star] : stars_) {
      std::vector<int> root(star.size());
      std::iota(root.begin(), root.end(), 0);
      const auto find = [&](int i) {
        while (root[static_cast<std::size_t>(i)] != i) i = root[static_cast<std::size_t>(i)];
        return i;
      };
      for (std::size_t i = 0; i < star.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          for (int k = 0; k < 3; ++k) {
            const int w = mesh_.faces(star[i].face, k);
            if (w == v || !has(star[j].face, w) || edges_.count(std::minmax(v, w))) continue;
            const int a = find(static_cast<int>(i)), b = find(static_cast<int>(j));
            root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
          }
        }
      }
      for (std::size_t i = 0; i < star.size(); ++i) star[i].fan = find(static_cast<int>(i));
    }
  }

  int fan_at(int v, int face) const {
    for (const Corner& corner : stars_.at(v)) {
      if (corner.face == face) return corner.fan;
    }
    return -1;
  }

  /// The fan on the named side of the first cut through a vertex keeps its number.
  void number_copies() {
    std::map<int, int> kept;
    for (std::size_t r = 0; r < mesh_.runs.size(); ++r) {
      if (!cut_[r]) continue;
      const GridRun& run = mesh_.runs[r];
      for (std::size_t k = 0; k + 1 < run.vertices.size(); ++k) {
        const int a = run.vertices[k].first, b = run.vertices[k + 1].first;
        const auto face = run.reflected ? left_of(b, a) : left_of(a, b);
        if (!face) continue;
        for (int v : {a, b}) kept.emplace(v, fan_at(v, *face));
      }
    }
    int next = static_cast<int>(mesh_.uv.rows());
    std::vector<int> origin;
    for (const auto& [v, star] : stars_) {
      const auto keeps = kept.find(v);
      const int own = keeps == kept.end() ? star.front().fan : keeps->second;
      number_[{v, own}] = v;
      for (const Corner& corner : star) {
        const auto [it, fresh] = number_.emplace(std::pair{v, corner.fan}, next);
        if (fresh) {
          origin.push_back(v);
          ++next;
        }
        for (int k = 0; k < 3; ++k) {
          if (mesh_.faces(corner.face, k) == v) result_.faces(corner.face, k) = it->second;
        }
      }
    }
    result_.uv.conservativeResize(next, 2);
    for (std::size_t i = 0; i < origin.size(); ++i) {
      const int copy = static_cast<int>(mesh_.uv.rows() + static_cast<Eigen::Index>(i));
      result_.uv.row(copy) = mesh_.uv.row(origin[i]);
      twins_[origin[i]].push_back(copy);
    }
  }

  int copy_at(int v, int face) const { return stars_.count(v) ? number_.at({v, fan_at(v, face)}) : v; }

  /// The row of a run with, of each vertex, the copy on the side of `face_of(a, b)`; where it is torn.
  template <class FaceOf>
  std::optional<int> relabel(GridRun& run, const FaceOf& face_of) const {
    std::vector<std::pair<int, double>> row = run.vertices;
    std::vector<char> known(row.size(), 0);
    for (std::size_t k = 0; k + 1 < row.size(); ++k) {
      const int a = run.vertices[k].first, b = run.vertices[k + 1].first;
      if (!stars_.count(a) && !stars_.count(b)) continue;
      const std::optional<int> face = face_of(a, b);
      if (!face) return a;
      for (std::size_t e : {k, k + 1}) {
        const int copy = copy_at(run.vertices[e].first, *face);
        if (known[e] && row[e].first != copy) return run.vertices[e].first;
        row[e].first = copy;
        known[e] = 1;
      }
    }
    run.vertices = std::move(row);
    run.closed = run.vertices.front().first == run.vertices.back().first;
    return std::nullopt;
  }

  void make_runs() {
    result_.runs.clear();
    const auto left = [&](int a, int b) { return left_of(a, b); };
    const auto either = [&](int a, int b) {
      const auto face = left_of(a, b);
      return face ? face : left_of(b, a);
    };
    for (std::size_t r = 0; r < mesh_.runs.size(); ++r) {
      if (!cut_[r]) {
        GridRun run = mesh_.runs[r];
        if (const auto torn = relabel(run, either)) {
          if (run.internal) report("cut_crosses_line", run.name, fmt::format("a cut runs across this line at {}", place(*torn)), "cut both nowhere, leave the line out, or draw it in two parts that end there");
          else report("cut_splits_edge", run.name, fmt::format("a cut ends inside this edge, at {}", place(*torn)), "split the edge there (in the pattern) so that the cut ends where two edges meet");
        }
        result_.runs.push_back(std::move(run));
        continue;
      }
      GridRun forward = mesh_.runs[r], backward = forward;
      std::reverse(backward.vertices.begin(), backward.vertices.end());
      for (auto& [v, s] : backward.vertices) s = backward.length - s;
      GridRun &named = forward.reflected ? backward : forward, &other = forward.reflected ? forward : backward;
      other.name += "_r";
      const auto clash = std::find_if(mesh_.runs.begin(), mesh_.runs.end(), [&](const GridRun& run) { return run.name == other.name; });
      if (clash != mesh_.runs.end()) report("duplicate_name", other.name, "the second side of a cut would be called like this, but there is such a line", "rename one of them");
      for (GridRun* side : {&named, &other}) {
        side->internal = side->reflected = false;
        if (const auto torn = relabel(*side, left)) report("cut_crosses_line", mesh_.runs[r].name, fmt::format("another cut meets this one at {}", place(*torn)), "cuts may not meet; end one before the other");
      }
      result_.runs.push_back(std::move(named));
      result_.runs.push_back(std::move(other));
    }
  }

  void make_points() {
    std::set<std::string> names;
    for (const GridPoint& point : mesh_.points) names.insert(point.name);
    for (const GridPoint& point : mesh_.points) {
      const auto twins = twins_.find(point.vertex);
      if (twins == twins_.end()) continue;
      for (std::size_t k = 0; k < twins->second.size(); ++k) {
        const std::string name = fmt::format("{}_r{}", point.name, k > 0 ? std::to_string(k + 1) : "");
        if (names.insert(name).second) result_.points.push_back({name, twins->second[k]});
      }
    }
  }

  void report_lost_piece() {
    for (std::size_t r = 0; r < mesh_.runs.size(); ++r) {
      if (!cut_[r]) continue;
      const auto& row = mesh_.runs[r].vertices;
      report("cut_off", mesh_.runs[r].name, fmt::format("the cut at {} takes a piece off the panel", place(row[row.size() / 2].first)), "end it inside the cloth; a dart that reaches the border is part of the outline");
    }
  }

  const PanelMesh& mesh_;
  std::string panel_;
  std::vector<char> cut_;                           ///< by run
  std::set<std::pair<int, int>> edges_;             ///< that are cut
  std::map<int, std::vector<Corner>> stars_;        ///< of the vertices on cuts
  std::map<std::pair<int, int>, int> number_;       ///< vertex and fan -> vertex
  std::map<int, std::vector<int>> twins_;           ///< new copies
  PanelMesh result_;
  Issues issues_;
};

}  // namespace

Result<PanelMesh> cut_open(const PanelMesh& mesh, const std::vector<std::string>& runs, const std::string& panel) { return Cutter(mesh, runs, panel).run(); }

}  // namespace toile::tailor
