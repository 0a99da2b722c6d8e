#include "toile/tailor/refine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "toile/base/parallel.h"
#include "toile/base/text.h"

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;
using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

constexpr double same_size = 1e-6;        // of panels cut from one pattern, relative
constexpr double seam_closed_at = 1e-6;   // [m]
constexpr double crease_cosine = 0.5;     // edges bent by more than 60 degrees part the cloth
constexpr double inside_slack = 1e-12;    // barycentric
constexpr double condition_least = 1e-2;  // of a fit, smallest over largest pivot

double cross(const Vector2& a, const Vector2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

std::uint64_t key(int a, int b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) |
         static_cast<std::uint32_t>(std::max(a, b));
}

Vector2 uv_of(const GarmentMesh& g, int v) {
  return g.uv.row(v).transpose();
}

/// Lists of items by owner: those of i are items[start[i]] ... items[start[i + 1] - 1].
struct Lists {
  std::vector<int> start, items;
  auto begin(int i) const { return items.begin() + start[static_cast<std::size_t>(i)]; }
  auto end(int i) const { return items.begin() + start[static_cast<std::size_t>(i) + 1]; }
};

Lists faces_of_vertices(const GarmentMesh& g) {
  Lists lists;
  lists.start.assign(static_cast<std::size_t>(g.vertex_count()) + 1, 0);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) ++lists.start[static_cast<std::size_t>(g.faces(f, k)) + 1];
  }
  std::partial_sum(lists.start.begin(), lists.start.end(), lists.start.begin());
  lists.items.resize(static_cast<std::size_t>(g.face_count()) * 3);
  std::vector<int> next(lists.start.begin(), lists.start.end() - 1);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k)
      lists.items[static_cast<std::size_t>(next[static_cast<std::size_t>(g.faces(f, k))]++)] = static_cast<int>(f);
  }
  return lists;
}

/// The triangles of a garment with their neighbours across edges; the sides of cuts and seams are no neighbours.
class Surface {
 public:
  explicit Surface(const GarmentMesh& g) : g_(g) {
    const auto n = static_cast<std::size_t>(g.face_count());
    sides_.reserve(3 * n);
    for (std::size_t f = 0; f < n; ++f) {
      for (int k = 0; k < 3; ++k) sides_.push_back({edge_key(static_cast<int>(f), k), static_cast<int>(3 * f) + k});
    }
    std::sort(sides_.begin(), sides_.end());
    neighbours_.assign(n, {-1, -1, -1});
    for (std::size_t i = 0; i + 1 < sides_.size(); ++i) {
      if (sides_[i].first != sides_[i + 1].first) continue;
      const int a = sides_[i].second, b = sides_[i + 1].second;
      neighbours_[static_cast<std::size_t>(a / 3)][static_cast<std::size_t>(a % 3)] = b / 3;
      neighbours_[static_cast<std::size_t>(b / 3)][static_cast<std::size_t>(b % 3)] = a / 3;
    }
  }

  const std::array<int, 3>& neighbours(int f) const { return neighbours_[static_cast<std::size_t>(f)]; }
  std::uint64_t edge_key(int f, int k) const { return key(g_.faces(f, k), g_.faces(f, (k + 1) % 3)); }
  /// A face with that edge, or -1.
  int face_at(int a, int b) const {
    const auto it = std::lower_bound(sides_.begin(), sides_.end(), std::pair(key(a, b), 0));
    return it != sides_.end() && it->first == key(a, b) ? it->second / 3 : -1;
  }

  Vector3 weights(int f, const Vector2& p) const {
    const Vector2 a = uv_of(g_, g_.faces(f, 0)), b = uv_of(g_, g_.faces(f, 1)) - a, c = uv_of(g_, g_.faces(f, 2)) - a;
    const double area = cross(b, c);
    const double second = cross(p - a, c) / area, third = cross(b, p - a) / area;
    return {1 - second - third, second, third};
  }
  double distance(int f, const Vector2& p) const {
    if (weights(f, p).minCoeff() >= 0) return 0;
    double best = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      const Vector2 a = uv_of(g_, g_.faces(f, k)), d = uv_of(g_, g_.faces(f, (k + 1) % 3)) - a;
      best = std::min(best, (p - a - d * std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0)).norm());
    }
    return best;
  }

  /// The triangle that p lies in, or else the nearest one, among those that hang together with `start` inside the
  /// circle round p of that radius.
  int locate(const Vector2& p, int start, double radius) {
    if (weights(start, p).minCoeff() >= -inside_slack) return start;
    if (seen_.empty()) seen_.assign(neighbours_.size(), 0);
    ++pass_;
    near_.assign(1, start);
    seen_[static_cast<std::size_t>(start)] = pass_;
    int best = start;
    double least = distance(start, p);
    for (std::size_t i = 0; i < near_.size(); ++i) {
      for (int f : neighbours(near_[i])) {
        if (f < 0 || seen_[static_cast<std::size_t>(f)] == pass_) continue;
        seen_[static_cast<std::size_t>(f)] = pass_;
        if (weights(f, p).minCoeff() >= -inside_slack) return f;
        const double d = distance(f, p);
        if (d > radius) continue;
        near_.push_back(f);
        if (d < least) best = f, least = d;
      }
    }
    return best;
  }

 private:
  const GarmentMesh& g_;
  std::vector<std::pair<std::uint64_t, int>> sides_;  // edge, 3 face + side
  std::vector<std::array<int, 3>> neighbours_;
  std::vector<int> seen_, near_;
  int pass_ = 0;
};

class Mapping {
 public:
  Mapping(const GarmentMesh& to, const GarmentMesh& from) : to_(to), from_(from), surface_(from) {}

  Result<PanelMap> run() {
    match();
    if (!issues_.empty()) return issues_;
    const auto n = static_cast<std::size_t>(to_.vertex_count());
    face_.assign(n, -1);
    borders();
    if (!issues_.empty()) return issues_;
    spread();
    PanelMap map;
    map.face = Eigen::Map<const mesh::Ids>(face_.data(), to_.vertex_count());
    map.weight.resize(to_.vertex_count(), 3);
    map.outside.resize(to_.vertex_count());
    parallel_for(n, 4096, [&](std::size_t v) {
      const Vector2 p = uv_of(to_, static_cast<int>(v));
      const auto row = static_cast<Eigen::Index>(v);
      map.weight.row(row) = surface_.weights(face_[v], p);
      map.outside[row] = surface_.distance(face_[v], p);
    });
    return map;
  }

 private:
  void report(std::string item, std::string what) {
    issues_.push_back({"other_pattern",
                       {.item = std::move(item)},
                       std::move(what),
                       "mesh and sew both garments from the same pattern and specs, with other cells only",
                       Category::check});
  }

  /// Panels and named edges of `from` by those of `to`.
  void match() {
    std::vector<std::string> names;
    for (const mesh::Panel& panel : from_.panels) names.push_back(panel.name);
    std::vector<char> faces(from_.panels.size(), 0);
    for (Eigen::Index f = 0; f < from_.face_count(); ++f) faces[static_cast<std::size_t>(from_.face_panel[f])] = 1;
    for (const mesh::Panel& panel : to_.panels) {
      const auto it = std::find(names.begin(), names.end(), panel.name);
      panel_.push_back(it == names.end() ? -1 : static_cast<int>(it - names.begin()));
      if (it == names.end()) {
        report(panel.name,
               fmt::format("the garment with the positions has no such panel ({})", suggestion(panel.name, names)));
        continue;
      }
      const double area = from_.panels[static_cast<std::size_t>(panel_.back())].cut_area;
      if (std::abs(area - panel.cut_area) > same_size * panel.cut_area) {
        report(panel.name, fmt::format("the panel has an area of {:.6g} cm2 in one garment and {:.6g} cm2 in the other",
                                       panel.cut_area * 1e4, area * 1e4));
      }
      if (!faces[static_cast<std::size_t>(panel_.back())]) report(panel.name, "the panel has no triangles");
    }
    for (const mesh::Run& run : to_.runs) {
      run_.push_back(-1);
      const int panel = panel_[static_cast<std::size_t>(run.panel)];
      if (panel < 0 || run.internal) continue;
      for (const mesh::Run& other : from_.runs) {
        if (other.panel == panel && other.name == run.name && !other.internal) run_.back() = other.id;
      }
      const std::string item = to_.panels[static_cast<std::size_t>(run.panel)].name + "." + run.name;
      if (run_.back() < 0) {
        report(item, "the garment with the positions has no such edge");
      } else if (const double length = from_.runs[static_cast<std::size_t>(run_.back())].length;
                 std::abs(length - run.length) > same_size * run.length) {
        report(item, fmt::format("the edge is {:.4f} mm long in one garment and {:.4f} mm in the other",
                                 run.length * 1e3, length * 1e3));
      }
    }
  }

  /// Border vertices: the triangle beside the same stretch of the same edge.
  void borders() {
    std::vector<std::size_t> first(from_.runs.size() + 1, 0);
    for (const mesh::RunVertex& r : from_.run_vertices) ++first[static_cast<std::size_t>(r.run) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const mesh::RunVertex& r : to_.run_vertices) {
      const int run = run_[static_cast<std::size_t>(r.run)];
      if (run < 0 || face_[static_cast<std::size_t>(r.vertex)] >= 0) continue;
      const auto begin = from_.run_vertices.begin() + static_cast<std::ptrdiff_t>(first[static_cast<std::size_t>(run)]);
      const auto end =
          from_.run_vertices.begin() + static_cast<std::ptrdiff_t>(first[static_cast<std::size_t>(run) + 1]);
      if (end - begin < 2) continue;
      auto after = std::upper_bound(begin + 1, end - 1, r.s,
                                    [](double s, const mesh::RunVertex& vertex) { return s < vertex.s; });
      const int start = surface_.face_at((after - 1)->vertex, after->vertex);
      if (start < 0) continue;
      const Vector2 p = uv_of(to_, r.vertex);
      face_[static_cast<std::size_t>(r.vertex)] = surface_.locate(p, start, surface_.distance(start, p));
      queue_.push_back(r.vertex);
    }
  }

  /// From the border inwards: each vertex looks round the triangle of the neighbour that it was reached from, in a
  /// circle with room for all triangles at that neighbour.
  void spread() {
    const Lists faces = faces_of_vertices(to_);
    std::vector<int> first_face(from_.panels.size(), -1);
    for (Eigen::Index f = from_.face_count(); f-- > 0;)
      first_face[static_cast<std::size_t>(from_.face_panel[f])] = static_cast<int>(f);
    for (int next = 0;;) {
      for (std::size_t i = 0; i < queue_.size(); ++i) {
        const int v = queue_[i];
        for (auto f = faces.begin(v); f != faces.end(v); ++f) {
          for (int k = 0; k < 3; ++k) {
            const int w = to_.faces(*f, k);
            if (face_[static_cast<std::size_t>(w)] >= 0) continue;
            const Vector2 p = uv_of(to_, w);
            face_[static_cast<std::size_t>(w)] =
                surface_.locate(p, face_[static_cast<std::size_t>(v)], 1.1 * (p - uv_of(to_, v)).norm());
            queue_.push_back(w);
          }
        }
      }
      queue_.clear();
      // A part of a panel without a named edge: anywhere in the panel.
      while (next < to_.vertex_count() && face_[static_cast<std::size_t>(next)] >= 0) ++next;
      if (next == to_.vertex_count()) return;
      const int panel = panel_[static_cast<std::size_t>(to_.vertex_panel[next])];
      face_[static_cast<std::size_t>(next)] = surface_.locate(
          uv_of(to_, next), first_face[static_cast<std::size_t>(panel)], std::numeric_limits<double>::infinity());
      queue_.push_back(next);
    }
  }

  const GarmentMesh &to_, &from_;
  Surface surface_;
  std::vector<int> panel_, run_;  // of `from`, by those of `to`
  std::vector<int> face_;
  std::vector<int> queue_;
  Issues issues_;
};

using Gradient = Eigen::Matrix<double, 3, 2>;  // of positions by panel coordinates

struct Tangent {
  Gradient gradient = Gradient::Zero();
  double trust = 0;  ///< share of what is not linear round the vertex that a quadratic accounts for
};

/// Tangents at the vertices of a garment, one for each part that creases leave of the triangles round a vertex.
class Tangents {
 public:
  explicit Tangents(const GarmentMesh& g) : g_(g), surface_(g), faces_(faces_of_vertices(g)) {
    find_creases();
    const auto n = static_cast<std::size_t>(g.vertex_count());
    corner_.assign(static_cast<std::size_t>(g.face_count()) * 3, {});
    parallel_for(n, 256, [&](std::size_t v) { at_vertex(static_cast<int>(v)); });
  }
  const Tangent& at(int face, int corner) const { return corner_[static_cast<std::size_t>(3 * face + corner)]; }

 private:
  void find_creases() {
    for (const mesh::Hinge& hinge : g_.hinges) {
      if (hinge.fold >= 0 || hinge.rest_angle != 0) creases_.push_back(key(hinge.v0, hinge.v1));
    }
    std::sort(creases_.begin(), creases_.end());
    crease_.assign(static_cast<std::size_t>(g_.face_count()), {});
    parallel_for(crease_.size(), 4096, [&](std::size_t i) {
      const int f = static_cast<int>(i);
      for (int k = 0; k < 3; ++k) {
        const int other = surface_.neighbours(f)[static_cast<std::size_t>(k)];
        crease_[i][static_cast<std::size_t>(k)] =
            other < 0 || normal(f).dot(normal(other)) < crease_cosine ||
            std::binary_search(creases_.begin(), creases_.end(), surface_.edge_key(f, k));
      }
    });
  }
  Vector3 normal(int f) const {
    const Vector3 a = g_.x.row(g_.faces(f, 0));
    return (Vector3(g_.x.row(g_.faces(f, 1))) - a).cross(Vector3(g_.x.row(g_.faces(f, 2))) - a).normalized();
  }
  bool has(int f, int v) const { return g_.faces(f, 0) == v || g_.faces(f, 1) == v || g_.faces(f, 2) == v; }

  void at_vertex(int v) {
    std::vector<int> left(faces_.begin(v), faces_.end(v));
    while (!left.empty()) {
      // The part of the fan that hangs together, then the triangles round it.
      std::vector<int> fan{left.front()};
      grow(fan, [&](int f) { return has(f, v); });
      std::erase_if(left, [&](int f) { return std::find(fan.begin(), fan.end(), f) != fan.end(); });
      const Tangent found = tangent(v, fan);
      for (int f : fan) {
        for (int k = 0; k < 3; ++k) {
          if (g_.faces(f, k) == v) corner_[static_cast<std::size_t>(3 * f + k)] = found;
        }
      }
    }
  }
  /// Adds what is reached across edges that are no creases.
  template <class Wanted>
  void grow(std::vector<int>& faces, const Wanted& wanted) const {
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int f = surface_.neighbours(faces[i])[k];
        if (f < 0 || crease_[static_cast<std::size_t>(faces[i])][k] || !wanted(f)) continue;
        if (std::find(faces.begin(), faces.end(), f) == faces.end()) faces.push_back(f);
      }
    }
  }

  Tangent tangent(int v, const std::vector<int>& fan) const {
    // Two rings; where they do not settle a quadratic (in corners and narrow strips), up to four.
    std::vector<int> around = fan;
    for (int rings = 2; rings <= 4; ++rings) {
      std::vector<int> corners;
      for (int f : around) {
        for (int k = 0; k < 3; ++k) corners.push_back(g_.faces(f, k));
      }
      std::sort(corners.begin(), corners.end());
      grow(around, [&](int f) {
        for (int k = 0; k < 3; ++k) {
          if (std::binary_search(corners.begin(), corners.end(), g_.faces(f, k))) return true;
        }
        return false;
      });
      if (const auto found = fit(v, around)) return *found;
    }
    return {};
  }

  /// Of the quadratic through v that fits the other corners of the faces best; none where they do not settle it.
  std::optional<Tangent> fit(int v, const std::vector<int>& faces) const {
    std::vector<int> others;
    for (int f : faces) {
      for (int k = 0; k < 3; ++k) others.push_back(g_.faces(f, k));
    }
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    // (Beside the tip of a cut its other side comes in, too, with v's own twin in the same place.)
    const Vector2 at = uv_of(g_, v);
    std::erase_if(others, [&](int w) { return (uv_of(g_, w) - at).norm() < 1e-9; });
    const auto rows = static_cast<Eigen::Index>(others.size());
    if (rows < 5) return std::nullopt;
    double size = 0;
    for (int w : others) size = std::max(size, (uv_of(g_, w) - at).norm());
    Eigen::Matrix<double, Eigen::Dynamic, 5> a(rows, 5);
    mesh::Points3 b(rows, 3);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const int w = others[static_cast<std::size_t>(i)];
      const Vector2 d = (uv_of(g_, w) - at) / size;
      const double share = 1 / d.norm();  // near ones count more
      a.row(i) << d.x(), d.y(), d.x() * d.x(), d.x() * d.y(), d.y() * d.y();
      a.row(i) *= share;
      b.row(i) = share * (g_.x.row(w) - g_.x.row(v));
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> quadratic(a);
    const auto pivots = quadratic.matrixQR().diagonal().cwiseAbs();
    if (!(pivots.minCoeff() > condition_least * pivots.maxCoeff())) return std::nullopt;
    const Eigen::MatrixXd solution = quadratic.solve(b);
    const Eigen::HouseholderQR<Eigen::MatrixXd> linear(a.leftCols(2));
    const double left = (b - a * solution).squaredNorm();
    const double without = (b - a.leftCols(2) * Eigen::MatrixXd(linear.solve(b))).squaredNorm();
    return Tangent{solution.topRows(2).transpose() / size, without > 0 ? std::max(0.0, 1 - left / without) : 1.0};
  }

  const GarmentMesh& g_;
  Surface surface_;
  Lists faces_;
  std::vector<std::uint64_t> creases_;
  std::vector<std::array<bool, 3>> crease_;
  std::vector<Tangent> corner_;
};

/// By name: whether the vertices of each seam are together.
std::map<std::string, bool> closed_by_name(const GarmentMesh& g) {
  std::map<std::string, bool> closed;
  for (const mesh::Seam& seam : g.seams) closed[seam.name] = true;
  for (const mesh::Weld& weld : g.welds) {
    if ((g.x.row(weld.a) - g.x.row(weld.b)).norm() > seam_closed_at)
      closed[g.seams[static_cast<std::size_t>(weld.seam)].name] = false;
  }
  return closed;
}

}  // namespace

Result<PanelMap> map_panels(const mesh::GarmentMesh& to, const mesh::GarmentMesh& from) {
  return Mapping(to, from).run();
}

mesh::Points3 carried(const PanelMap& map, const mesh::GarmentMesh& to, const mesh::GarmentMesh& from,
                      Interpolation interpolation) {
  std::optional<Tangents> tangents;
  if (interpolation == Interpolation::smooth) tangents.emplace(from);
  mesh::Points3 x(map.face.size(), 3);
  parallel_for(static_cast<std::size_t>(map.face.size()), 1024, [&](std::size_t i) {
    const auto v = static_cast<Eigen::Index>(i);
    const int f = map.face[v];
    const Vector2 p = uv_of(to, static_cast<int>(v));
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < 3; ++k) sum += map.weight(v, k) * from.x.row(from.faces(f, k)).transpose();
    const Vector3 flat = sum;
    for (int k = 0; tangents && k < 3; ++k) {
      const int corner = from.faces(f, k);
      const Tangent& tangent = tangents->at(f, k);
      const Vector3 on_tangent = from.x.row(corner).transpose() + tangent.gradient * (p - uv_of(from, corner));
      sum += map.weight(v, k) * 0.5 * tangent.trust * (on_tangent - flat);
    }
    x.row(v) = sum;
  });
  return x;
}

EdgeStrain edge_strain(const mesh::GarmentMesh& g) {
  EdgeStrain strain;
  double squares = 0;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = g.faces(f, k), b = g.faces(f, (k + 1) % 3);
      const double e = (g.x.row(a) - g.x.row(b)).norm() / (g.uv.row(a) - g.uv.row(b)).norm() - 1;
      squares += e * e;
      if (strain.longest_vertex < 0 || e > strain.longest) strain.longest = e, strain.longest_vertex = a;
      if (strain.shortest_vertex < 0 || e < strain.shortest) strain.shortest = e, strain.shortest_vertex = a;
    }
  }
  if (g.face_count() > 0) strain.rms = std::sqrt(squares / (3 * static_cast<double>(g.face_count())));
  return strain;
}

mesh::Ids closed_particles(const mesh::GarmentMesh& garment, const std::vector<char>& seam_closed) {
  mesh::GarmentMesh closed;
  closed.x.resize(garment.vertex_count(), 3);
  for (const mesh::Weld& weld : garment.welds) {
    if (seam_closed[static_cast<std::size_t>(weld.seam)]) closed.welds.push_back(weld);
  }
  return mesh::particles(closed);
}

Result<Refined> refine(const mesh::GarmentMesh& fine, const mesh::GarmentMesh& coarse, Interpolation interpolation) {
  TOILE_TRY(PanelMap map, map_panels(fine, coarse));
  Refined result{.garment = fine, .map = std::move(map)};
  mesh::GarmentMesh& g = result.garment;
  g.x = carried(result.map, fine, coarse, interpolation);
  for (const char* name : {"vx", "vy", "vz"}) g.vertex_columns.erase(name);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (!(result.map.outside[v] > 1e-9)) continue;
    ++result.outside;
    if (result.map.outside[v] <= result.farthest) continue;
    result.farthest = result.map.outside[v];
    result.farthest_vertex = static_cast<int>(v);
  }

  const auto closed = closed_by_name(coarse);
  result.seam_closed.assign(g.seams.size(), 0);
  for (const mesh::Seam& seam : g.seams) {
    const auto it = closed.find(seam.name);
    const bool together = it != closed.end() && it->second;
    result.seam_closed[static_cast<std::size_t>(seam.id)] = together;
    if (!together) ++result.open_seams;
  }
  const mesh::Ids particle = closed_particles(g, result.seam_closed);
  const int particles = particle.size() > 0 ? particle.maxCoeff() + 1 : 0;
  // The mean as the first one and the mean difference from it: equal ones stay what they are.
  std::vector<int> first(static_cast<std::size_t>(particles), -1), count(static_cast<std::size_t>(particles), 0);
  mesh::Points3 difference = mesh::Points3::Zero(particles, 3);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const auto p = static_cast<std::size_t>(particle[v]);
    if (count[p]++ == 0) first[p] = static_cast<int>(v);
    difference.row(particle[v]) += g.x.row(v) - g.x.row(first[p]);
  }
  mesh::Points3 mean(particles, 3);
  for (int p = 0; p < particles; ++p) {
    const auto i = static_cast<std::size_t>(p);
    mean.row(p) = g.x.row(first[i]) + difference.row(p) / count[i];
    result.joined += count[i] > 1;
  }
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    result.widest_join = std::max(result.widest_join, (g.x.row(v) - mean.row(particle[v])).norm());
    g.x.row(v) = mean.row(particle[v]);
  }
  return result;
}

}  // namespace toile::tailor
