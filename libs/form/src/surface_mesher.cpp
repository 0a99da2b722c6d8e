#include "surface_mesher.h"

#include "toile/base/parallel.h"
#include "toile/base/result.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

namespace toile::form {

using Eigen::Vector3d;

namespace {

constexpr std::size_t grain = 64;

Vector3d gradient(const Field& field, const Vector3d& p) {
  constexpr double h = 2e-6;
  Vector3d g;
  for (int k = 0; k < 3; ++k) {
    Vector3d a = p, b = p;
    a[k] += h;
    b[k] -= h;
    g[k] = (field(a) - field(b)) / (2 * h);
  }
  return g;
}

/// Newton steps along the gradient; a point of the mirror plane stays in it.
Vector3d onto_surface(const Field& field, Vector3d p, bool border, int steps) {
  for (int i = 0; i < steps; ++i) {
    const double value = field(p);
    if (std::abs(value) < 1e-9) break;
    Vector3d g = gradient(field, p);
    if (border) g.x() = 0;
    const double norm_sq = g.squaredNorm();
    if (norm_sq < 1e-6) break;
    Vector3d step = -value / norm_sq * g;
    const double limit = 0.02;
    if (step.norm() > limit) step *= limit / step.norm();
    p += step;
    if (!border && p.x() < 0) p.x() = 1e-6;
  }
  if (border) p.x() = 0;
  return p;
}

/// Editable triangles with the faces around each vertex.
struct Editor {
  std::vector<Vector3d> p;
  std::vector<std::array<int, 3>> t;
  std::vector<char> face_alive, border, point_alive;
  std::vector<std::vector<int>> around;

  explicit Editor(const HalfSurface& s) : p(s.points), t(s.faces), face_alive(s.faces.size(), 1), border(s.border), point_alive(s.points.size(), 1) {
    around.resize(p.size());
    for (std::size_t f = 0; f < t.size(); ++f) {
      for (const int v : t[f]) around[static_cast<std::size_t>(v)].push_back(static_cast<int>(f));
    }
  }
  static bool has(const std::array<int, 3>& f, int v) { return f[0] == v || f[1] == v || f[2] == v; }
  static void replace(std::array<int, 3>& f, int from, int to) {
    for (int& v : f) {
      if (v == from) v = to;
    }
  }
  const std::array<int, 3>& face(int f) const { return t[static_cast<std::size_t>(f)]; }
  std::vector<int>& fan(int v) { return around[static_cast<std::size_t>(v)]; }
  const std::vector<int>& fan(int v) const { return around[static_cast<std::size_t>(v)]; }
  const Vector3d& at(int v) const { return p[static_cast<std::size_t>(v)]; }
  bool on_border(int v) const { return border[static_cast<std::size_t>(v)] != 0; }
  void leave(int v, int f) {
    auto& list = fan(v);
    list.erase(std::find(list.begin(), list.end(), f));
  }
  std::vector<int> edge_faces(int a, int b) const {
    std::vector<int> result;
    for (const int f : fan(a)) {
      if (has(face(f), b)) result.push_back(f);
    }
    return result;
  }
  std::vector<int> neighbours(int v) const {
    std::vector<int> result;
    for (const int f : fan(v)) {
      for (const int w : face(f)) {
        if (w != v) result.push_back(w);
      }
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }
  int opposite(int f, int a, int b) const {
    for (const int v : face(f)) {
      if (v != a && v != b) return v;
    }
    return -1;
  }
  Vector3d area_vector(const std::array<int, 3>& f) const { return (at(f[1]) - at(f[0])).cross(at(f[2]) - at(f[0])); }

  struct Candidate {
    double length;
    int a, b;
  };
  std::vector<Candidate> edges() const {
    std::vector<std::pair<int, int>> keys;
    for (std::size_t f = 0; f < t.size(); ++f) {
      if (!face_alive[f]) continue;
      for (int k = 0; k < 3; ++k) {
        const int a = t[f][static_cast<std::size_t>(k)], b = t[f][static_cast<std::size_t>((k + 1) % 3)];
        keys.emplace_back(std::min(a, b), std::max(a, b));
      }
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    std::vector<Candidate> result;
    result.reserve(keys.size());
    for (const auto& [a, b] : keys) result.push_back({(at(a) - at(b)).norm(), a, b});
    return result;
  }
};

double edge_size(const Sizing& sizing, const Vector3d& a, const Vector3d& b) { return sizing((a + b) / 2); }

void split_long(Editor& e, const Field& field, const Sizing& sizing) {
  for (int round = 0; round < 4; ++round) {
    auto candidates = e.edges();
    std::erase_if(candidates, [&](const auto& c) { return c.length <= 4.0 / 3 * edge_size(sizing, e.at(c.a), e.at(c.b)); });
    if (candidates.empty()) return;
    std::sort(candidates.begin(), candidates.end(), [](const auto& p, const auto& q) { return std::tie(q.length, p.a, p.b) < std::tie(p.length, q.a, q.b); });
    for (const auto& c : candidates) {
      const auto faces = e.edge_faces(c.a, c.b);
      if (faces.empty()) continue;
      const bool border = faces.size() == 1;
      const int m = static_cast<int>(e.p.size());
      e.p.push_back(onto_surface(field, (e.at(c.a) + e.at(c.b)) / 2, border, 3));
      e.border.push_back(border);
      e.point_alive.push_back(1);
      e.around.emplace_back();
      for (const int f : faces) {
        const int o = e.opposite(f, c.a, c.b);
        std::array<int, 3> copy = e.face(f);
        Editor::replace(copy, c.a, m);
        const int g = static_cast<int>(e.t.size());
        e.t.push_back(copy);
        e.face_alive.push_back(1);
        Editor::replace(e.t[static_cast<std::size_t>(f)], c.b, m);
        e.leave(c.b, f);
        e.fan(c.b).push_back(g);
        e.fan(o).push_back(g);
        e.fan(m).push_back(f);
        e.fan(m).push_back(g);
      }
    }
  }
}

void collapse_short(Editor& e, const Field& field, const Sizing& sizing) {
  auto candidates = e.edges();
  std::erase_if(candidates, [&](const auto& c) { return c.length >= 0.8 * edge_size(sizing, e.at(c.a), e.at(c.b)); });
  std::sort(candidates.begin(), candidates.end(), [](const auto& p, const auto& q) { return std::tie(p.length, p.a, p.b) < std::tie(q.length, q.a, q.b); });
  for (const auto& c : candidates) {
    if (!e.point_alive[static_cast<std::size_t>(c.a)] || !e.point_alive[static_cast<std::size_t>(c.b)]) continue;
    const auto faces = e.edge_faces(c.a, c.b);
    if (faces.empty()) continue;
    int gone = c.a, kept = c.b;
    if (e.on_border(gone) && !e.on_border(kept)) std::swap(gone, kept);
    const bool both = e.on_border(gone) && e.on_border(kept);
    if (both && faces.size() != 1) continue;  // would pinch the mirror line
    if ((e.at(c.a) - e.at(c.b)).norm() >= 0.8 * edge_size(sizing, e.at(c.a), e.at(c.b))) continue;
    const auto ring_gone = e.neighbours(gone), ring_kept = e.neighbours(kept);
    std::vector<int> common;
    std::set_intersection(ring_gone.begin(), ring_gone.end(), ring_kept.begin(), ring_kept.end(), std::back_inserter(common));
    if (common.size() != faces.size()) continue;
    bool thin = false;
    for (const int v : common) thin = thin || e.fan(v).size() <= 3;
    if (thin) continue;
    Vector3d q = e.at(kept);
    if (both || !e.on_border(kept)) q = onto_surface(field, (e.at(gone) + e.at(kept)) / 2, both, 3);
    bool good = true;
    for (const int v : {gone, kept}) {
      for (const int f : e.fan(v)) {
        if (Editor::has(e.face(f), gone) && Editor::has(e.face(f), kept)) continue;
        std::array<Vector3d, 3> corner;
        for (std::size_t k = 0; k < 3; ++k) {
          const int w = e.face(f)[k];
          corner[k] = w == v ? q : e.at(w);
          if (w != v && (corner[k] - q).norm() > 4.0 / 3 * edge_size(sizing, corner[k], q)) good = false;
        }
        const Vector3d now = e.area_vector(e.face(f)), then = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
        if (then.norm() < 1e-12 || now.dot(then) < 0.3 * now.norm() * then.norm()) good = false;
      }
    }
    if (!good) continue;
    for (const int f : faces) {
      e.face_alive[static_cast<std::size_t>(f)] = 0;
      for (const int v : e.face(f)) e.leave(v, f);
    }
    for (const int f : std::vector<int>(e.fan(gone))) {
      Editor::replace(e.t[static_cast<std::size_t>(f)], gone, kept);
      e.fan(kept).push_back(f);
    }
    e.fan(gone).clear();
    e.point_alive[static_cast<std::size_t>(gone)] = 0;
    e.p[static_cast<std::size_t>(kept)] = q;
  }
}

double smallest_cosine_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  // cosine of the smallest angle = the largest cosine
  const auto cosine = [](const Vector3d& u, const Vector3d& v) { return u.dot(v) / std::max(1e-300, u.norm() * v.norm()); };
  return std::max({cosine(b - a, c - a), cosine(a - b, c - b), cosine(a - c, b - c)});
}

enum class FlipFor { valence, angle };

void flip_edges(Editor& e, FlipFor aim) {
  for (const auto& c : e.edges()) {
    const auto faces = e.edge_faces(c.a, c.b);
    if (faces.size() != 2) continue;
    // a -> b runs along face f; o is its apex, q the other's.
    int f = faces[0], g = faces[1];
    const auto runs = [&](int face, int a, int b) {
      const auto& v = e.face(face);
      return (v[0] == a && v[1] == b) || (v[1] == a && v[2] == b) || (v[2] == a && v[0] == b);
    };
    if (!runs(f, c.a, c.b)) std::swap(f, g);
    const int o = e.opposite(f, c.a, c.b), q = e.opposite(g, c.a, c.b);
    if (o == q || !e.edge_faces(o, q).empty()) continue;
    const Vector3d &A = e.at(c.a), &B = e.at(c.b), &O = e.at(o), &Q = e.at(q);
    const Vector3d normal = (e.area_vector(e.face(f)) + e.area_vector(e.face(g))).normalized();
    const Vector3d first = (Q - A).cross(O - A), second = (B - Q).cross(O - Q);
    if (first.dot(normal) < 0.6 * first.norm() || second.dot(normal) < 0.6 * second.norm()) continue;
    if (first.norm() < 1e-12 || second.norm() < 1e-12) continue;
    const double before = std::max(smallest_cosine_angle(A, B, O), smallest_cosine_angle(A, B, Q));
    const double after = std::max(smallest_cosine_angle(A, Q, O), smallest_cosine_angle(Q, B, O));
    bool better = after < before - 1e-9;
    if (aim == FlipFor::valence) {
      const auto excess = [&](int v, int change) {
        const int wanted = e.on_border(v) ? 4 : 6;
        const int valence = static_cast<int>(e.fan(v).size()) + (e.on_border(v) ? 1 : 0) + change;
        return (valence - wanted) * (valence - wanted);
      };
      const int now = excess(c.a, 0) + excess(c.b, 0) + excess(o, 0) + excess(q, 0);
      const int then = excess(c.a, -1) + excess(c.b, -1) + excess(o, 1) + excess(q, 1);
      better = then < now && after < std::cos(12 * M_PI / 180);
    }
    if (!better) continue;
    e.t[static_cast<std::size_t>(f)] = {c.a, q, o};
    e.t[static_cast<std::size_t>(g)] = {q, c.b, o};
    e.leave(c.b, f);
    e.leave(c.a, g);
    e.fan(q).push_back(f);
    e.fan(o).push_back(g);
  }
}

void smooth(Editor& e, const Field& field, const Sizing& sizing, double share) {
  std::vector<Vector3d> next = e.p;
  parallel_for(e.p.size(), grain, [&](std::size_t i) {
    if (!e.point_alive[i]) return;
    const int v = static_cast<int>(i);
    Vector3d target = Vector3d::Zero();
    double weight = 0;
    if (e.border[i]) {
      for (const int w : e.neighbours(v)) {
        if (!e.on_border(w) || e.edge_faces(v, w).size() != 1) continue;
        const double wi = (e.at(w) - e.p[i]).norm() / sizing((e.at(w) + e.p[i]) / 2);
        target += wi * (e.at(w) + e.p[i]) / 2;
        weight += wi;
      }
    } else {
      for (const int f : e.fan(v)) {
        const Vector3d centre = (e.at(e.face(f)[0]) + e.at(e.face(f)[1]) + e.at(e.face(f)[2])) / 3;
        const double s = sizing(centre);
        const double wi = e.area_vector(e.face(f)).norm() / (s * s);
        target += wi * centre;
        weight += wi;
      }
    }
    if (weight <= 0) return;
    Vector3d step = target / weight - e.p[i];
    Vector3d n = gradient(field, e.p[i]);
    if (e.border[i]) n.x() = 0;
    n.normalize();
    step -= step.dot(n) * n;
    next[i] = onto_surface(field, e.p[i] + share * step, e.border[i] != 0, 2);
  });
  e.p = std::move(next);
}

HalfSurface compacted(const Editor& e) {
  HalfSurface s;
  std::vector<int> renumber(e.p.size(), -1);
  for (std::size_t i = 0; i < e.p.size(); ++i) {
    if (!e.point_alive[i] || e.around[i].empty()) continue;
    renumber[i] = static_cast<int>(s.points.size());
    s.points.push_back(e.p[i]);
    s.border.push_back(e.border[i]);
  }
  for (std::size_t f = 0; f < e.t.size(); ++f) {
    if (!e.face_alive[f]) continue;
    std::array<int, 3> face{};
    for (std::size_t k = 0; k < 3; ++k) face[k] = renumber[static_cast<std::size_t>(e.t[f][k])];
    s.faces.push_back(face);
  }
  return s;
}

}  // namespace

HalfSurface polygonise(const Field& field, const Vector3d& low, const Vector3d& high, double cell) {
  const Eigen::Vector3i n(static_cast<int>(std::ceil(high.x() / cell)) + 1, static_cast<int>(std::ceil((high.y() - low.y()) / cell)) + 1,
                          static_cast<int>(std::ceil((high.z() - low.z()) / cell)) + 1);
  const auto id = [&](int i, int j, int k) { return (static_cast<std::size_t>(k) * n.y() + j) * n.x() + i; };
  const auto position = [&](std::size_t node) -> Vector3d {
    const int i = static_cast<int>(node % n.x()), j = static_cast<int>(node / n.x() % n.y()), k = static_cast<int>(node / n.x() / n.y());
    return {i * cell, low.y() + j * cell, low.z() + k * cell};
  };
  std::vector<double> value(static_cast<std::size_t>(n.prod()));
  parallel_for(value.size(), 256, [&](std::size_t node) { value[node] = field(position(node)); });

  HalfSurface s;
  std::map<std::pair<std::size_t, std::size_t>, int> known;
  const auto vertex = [&](std::size_t a, std::size_t b) {
    if (a > b) std::swap(a, b);
    const auto [it, fresh] = known.try_emplace({a, b}, static_cast<int>(s.points.size()));
    if (fresh) {
      // Off the grid points, so that no triangle is degenerate.
      const double t = std::clamp(value[a] / (value[a] - value[b]), 0.05, 0.95);
      s.points.push_back((1 - t) * position(a) + t * position(b));
      s.border.push_back(a % n.x() == 0 && b % n.x() == 0);
    }
    return it->second;
  };
  // Six tetrahedra along the cube's diagonal: neighbours agree on every face.
  static constexpr std::array<std::array<int, 4>, 6> tetrahedra{{{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
  for (int k = 0; k + 1 < n.z(); ++k) {
    for (int j = 0; j + 1 < n.y(); ++j) {
      for (int i = 0; i + 1 < n.x(); ++i) {
        std::array<std::size_t, 8> node;
        for (int c = 0; c < 8; ++c) node[static_cast<std::size_t>(c)] = id(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
        for (const auto& tet : tetrahedra) {
          std::vector<std::size_t> in, out;
          for (const int c : tet) (value[node[static_cast<std::size_t>(c)]] < 0 ? in : out).push_back(node[static_cast<std::size_t>(c)]);
          if (in.empty() || out.empty()) continue;
          std::vector<std::array<int, 3>> fresh;
          if (in.size() == 1) fresh = {{vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2])}};
          else if (out.size() == 1) fresh = {{vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0])}};
          else {
            const int a = vertex(in[0], out[0]), b = vertex(in[0], out[1]), c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
            fresh = {{a, b, c}, {a, c, d}};
          }
          Vector3d inside = Vector3d::Zero(), outside = Vector3d::Zero();
          for (const std::size_t v : in) inside += position(v) / static_cast<double>(in.size());
          for (const std::size_t v : out) outside += position(v) / static_cast<double>(out.size());
          for (auto f : fresh) {
            const auto& P = s.points;
            const Vector3d a = P[static_cast<std::size_t>(f[0])], b = P[static_cast<std::size_t>(f[1])], c = P[static_cast<std::size_t>(f[2])];
            if ((b - a).cross(c - a).dot(outside - inside) < 0) std::swap(f[1], f[2]);
            s.faces.push_back(f);
          }
        }
      }
    }
  }
  return s;
}

HalfSurface remesh(HalfSurface surface, const Field& field, const Sizing& sizing, int passes) {
  Editor e(surface);
  for (int pass = 0; pass < passes; ++pass) {
    split_long(e, field, sizing);
    collapse_short(e, field, sizing);
    flip_edges(e, FlipFor::valence);
    for (int i = 0; i < 3; ++i) smooth(e, field, sizing, 0.7);
    e = Editor(compacted(e));
  }
  for (int i = 0; i < 6; ++i) {
    flip_edges(e, FlipFor::angle);
    smooth(e, field, sizing, 0.5);
  }
  flip_edges(e, FlipFor::angle);
  return compacted(e);
}

HalfSurface follow(HalfSurface surface, const Field& field, const Sizing& sizing, int smoothing) {
  Editor e(surface);
  parallel_for(e.p.size(), grain, [&](std::size_t i) { e.p[i] = onto_surface(field, e.p[i], e.border[i] != 0, 12); });
  for (int i = 0; i < smoothing; ++i) smooth(e, field, sizing, 0.4);
  parallel_for(e.p.size(), grain, [&](std::size_t i) { e.p[i] = onto_surface(field, e.p[i], e.border[i] != 0, 6); });
  surface.points = e.p;
  return surface;
}

int mirrored_vertex_count(const HalfSurface& surface) {
  return 2 * static_cast<int>(surface.points.size()) - static_cast<int>(std::count(surface.border.begin(), surface.border.end(), char{1}));
}

Whole mirrored(const HalfSurface& surface) {
  Whole whole;
  const int half = static_cast<int>(surface.points.size());
  whole.x.resize(mirrored_vertex_count(surface), 3);
  std::vector<int> image(surface.points.size());
  int next = half;
  for (int i = 0; i < half; ++i) {
    const auto u = static_cast<std::size_t>(i);
    const Vector3d& p = surface.points[u];
    whole.x.row(i) = p.transpose();
    image[u] = i;
    if (surface.border[u]) continue;
    image[u] = next;
    whole.x.row(next++) << -p.x(), p.y(), p.z();
  }
  const auto count = static_cast<Eigen::Index>(surface.faces.size());
  whole.faces.resize(2 * count, 3);
  for (Eigen::Index f = 0; f < count; ++f) {
    const auto& face = surface.faces[static_cast<std::size_t>(f)];
    whole.faces.row(f) << face[0], face[1], face[2];
    whole.faces.row(count + f) << image[static_cast<std::size_t>(face[0])], image[static_cast<std::size_t>(face[2])], image[static_cast<std::size_t>(face[1])];
  }
  return whole;
}

}  // namespace toile::form
