// Small garments and supports that tests of the mechanics and the simulation share.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <cmath>
#include <functional>

namespace toile::fixtures {

/// A light cotton; authored, not measured.
inline fabric::Card shirting() {
  fabric::Card card;
  card.name = "shirting";
  card.origin = "authored, not measured";
  card.areal_density = 0.12;
  card.thickness = 3.5e-4;
  card.warp = {.strain_max = 0.04, .linearity = 0.7, .resilience = 0.6, .bending = 7e-6};
  card.weft = {.strain_max = 0.06, .linearity = 0.65, .resilience = 0.6, .bending = 5e-6};
  card.shear = 40;
  card.friction = 0.2;
  return card;
}

inline void add_fabric(mesh::GarmentMesh& g, const fabric::Card& card) {
  g.fabrics.push_back(card);
  mesh::Laminate laminate;
  laminate.id = static_cast<int>(g.laminates.size());
  laminate.name = card.name;
  laminate.plies.push_back({card.name, "", card.areal_density});
  laminate.equivalent = card;
  g.laminates.push_back(laminate);
}

enum class Diagonals { alternating, single };

/// Appends a panel: a (columns x rows)-cell grid of width x height [m], u to the right, v up. `place` maps (u, v) to space.
/// Runs: bottom, right, top, left, counter-clockwise. Faces use laminate 0.
inline void add_grid_panel(mesh::GarmentMesh& g, const std::string& name, int columns, int rows, double width, double height,
                           const std::function<Eigen::Vector3d(double, double)>& place, Diagonals diagonals = Diagonals::alternating,
                           const std::function<Eigen::Vector2d(double, double)>& to_uv = {}) {
  const int panel = static_cast<int>(g.panels.size());
  mesh::Panel p;
  p.id = panel;
  p.name = p.piece = name;
  p.cell_weft = width / columns;
  p.cell_warp = height / rows;
  p.cut_area = width * height;
  g.panels.push_back(p);
  const int first = static_cast<int>(g.x.rows()), count = (columns + 1) * (rows + 1);
  g.x.conservativeResize(first + count, 3);
  g.uv.conservativeResize(first + count, 2);
  g.vertex_panel.conservativeResize(first + count);
  const auto id = [&](int i, int j) { return first + j * (columns + 1) + i; };
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double u = width * i / columns, v = height * j / rows;
      g.x.row(id(i, j)) = place(u, v).transpose();
      const Eigen::Vector2d uv = to_uv ? to_uv(u, v) : Eigen::Vector2d(u, v);
      g.uv.row(id(i, j)) = uv.transpose();
      g.vertex_panel[id(i, j)] = panel;
    }
  }
  int f = static_cast<int>(g.faces.rows());
  g.faces.conservativeResize(f + 2 * columns * rows, 3);
  g.face_panel.conservativeResize(f + 2 * columns * rows);
  g.face_laminate.conservativeResize(f + 2 * columns * rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      const bool turned = diagonals == Diagonals::alternating && ((i + j) & 1);
      const std::array<std::array<int, 3>, 2> pair = turned ? std::array<std::array<int, 3>, 2>{{{a, b, d}, {b, c, d}}} : std::array<std::array<int, 3>, 2>{{{a, b, c}, {a, c, d}}};
      for (const auto& t : pair) {
        g.faces.row(f) << t[0], t[1], t[2];
        g.face_panel[f] = panel;
        g.face_laminate[f++] = 0;
      }
    }
  }
  const auto add_run = [&](const char* run_name, int n, double length, const std::function<int(int)>& vertex) {
    mesh::Run run;
    run.id = static_cast<int>(g.runs.size());
    run.panel = panel;
    run.name = run_name;
    run.length = length;
    g.runs.push_back(run);
    for (int k = 0; k <= n; ++k) g.run_vertices.push_back({run.id, vertex(k), length * k / n});
  };
  add_run("bottom", columns, width, [&](int k) { return id(k, 0); });
  add_run("right", rows, height, [&](int k) { return id(columns, k); });
  add_run("top", columns, width, [&](int k) { return id(columns - k, rows); });
  add_run("left", rows, height, [&](int k) { return id(0, rows - k); });
}

/// Sews run a to run b (same number of vertices); b is walked backwards.
inline void sew(mesh::GarmentMesh& g, int panel_a, const std::string& run_a, int panel_b, const std::string& run_b, const std::string& name) {
  mesh::Seam seam;
  seam.id = static_cast<int>(g.seams.size());
  seam.name = name;
  const auto ra = mesh::find_run(g, panel_a, run_a), rb = mesh::find_run(g, panel_b, run_b);
  const std::vector<int> a = mesh::run_vertex_ids(g, *ra), b = mesh::run_vertex_ids(g, *rb);
  seam.length_a = g.runs[static_cast<std::size_t>(*ra)].length;
  seam.length_b = g.runs[static_cast<std::size_t>(*rb)].length;
  g.seams.push_back(seam);
  for (std::size_t i = 0; i < a.size(); ++i) g.welds.push_back({a[i], b[b.size() - 1 - i], seam.id});
}

inline mesh::GarmentMesh sheet(int columns, int rows, double width, double height, const fabric::Card& card, const std::function<Eigen::Vector3d(double, double)>& place,
                               Diagonals diagonals = Diagonals::alternating) {
  mesh::GarmentMesh g;
  add_fabric(g, card);
  add_grid_panel(g, "sheet", columns, rows, width, height, place, diagonals);
  return g;
}

/// Triangulations of a rectangle that mechanics must not depend on.
enum class Net { alternating, single, random_diagonals, jittered, delaunay };
inline const char* name_of(Net net) {
  switch (net) {
    case Net::alternating: return "alternating";
    case Net::single: return "single";
    case Net::random_diagonals: return "random diagonals";
    case Net::jittered: return "jittered";
    case Net::delaunay: return "delaunay";
  }
  return "";
}

/// A sheet like sheet(), with nodes inside moved by up to a quarter of a cell (jittered) or a third with Delaunay triangles, on the border
/// along it. `place` maps panel coordinates to space.
inline mesh::GarmentMesh net(Net kind, int columns, int rows, double width, double height, const fabric::Card& card, const std::function<Eigen::Vector3d(double, double)>& place,
                             std::uint64_t seed = 1) {
  mesh::GarmentMesh g = sheet(columns, rows, width, height, card, place, kind == Net::single ? Diagonals::single : Diagonals::alternating);
  std::uint64_t state = seed;
  const auto noise = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) / 4503599627370496.0 - 1;
  };
  if (kind == Net::alternating || kind == Net::single) return g;
  const double jitter = kind == Net::jittered ? 0.25 : kind == Net::delaunay ? 0.33 : 0;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const int v = j * (columns + 1) + i;
      const double du = jitter * noise() * width / columns, dv = jitter * noise() * height / rows;
      if (i > 0 && i < columns) g.uv(v, 0) += du;
      if (j > 0 && j < rows) g.uv(v, 1) += dv;
    }
  }
  for (int f = 0; f < g.face_count(); f += 2) {
    const int cell = f / 2, i = cell % columns, j = cell / columns, a = j * (columns + 1) + i, b = a + 1, d = a + columns + 1, c = d + 1;
    if (noise() > 0) {
      g.faces.row(f) << a, b, c;
      g.faces.row(f + 1) << a, c, d;
    } else {
      g.faces.row(f) << a, b, d;
      g.faces.row(f + 1) << b, c, d;
    }
  }
  // Lawson's flips until every inner edge is Delaunay.
  for (bool again = kind == Net::delaunay; again;) {
    again = false;
    for (int f = 0; f < g.face_count(); ++f) {
      for (int h = f + 1; h < g.face_count(); ++h) {
        for (int k = 0; k < 3; ++k) {
          const int a = g.faces(f, k), b = g.faces(f, (k + 1) % 3), c = g.faces(f, (k + 2) % 3);
          int m = -1;
          for (int n = 0; n < 3; ++n) {
            if (g.faces(h, n) == b && g.faces(h, (n + 1) % 3) == a) m = n;
          }
          if (m < 0) continue;
          const int d = g.faces(h, (m + 2) % 3);
          const auto angle = [&](int o, int p, int q) {
            const Eigen::Vector2d x = (g.uv.row(p) - g.uv.row(o)).transpose(), y = (g.uv.row(q) - g.uv.row(o)).transpose();
            return std::acos(x.dot(y) / (x.norm() * y.norm()));
          };
          if (angle(c, a, b) + angle(d, a, b) <= M_PI + 1e-9) continue;
          g.faces.row(f) << c, a, d;
          g.faces.row(h) << d, b, c;
          again = true;
          break;
        }
      }
    }
  }
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) g.x.row(v) = place(g.uv(v, 0), g.uv(v, 1)).transpose();
  return g;
}

/// Latitude-longitude ellipsoid, closed, outward.
inline mesh::SupportMesh ellipsoid(const Eigen::Vector3d& axes, const Eigen::Vector3d& centre, int rings, int segments) {
  mesh::SupportMesh s;
  const int count = rings * segments + 2;
  s.x.resize(count, 3);
  s.x.row(0) = (centre + Eigen::Vector3d(0, axes.y(), 0)).transpose();
  for (int r = 0; r < rings; ++r) {
    const double theta = M_PI * (r + 1) / (rings + 1);
    for (int k = 0; k < segments; ++k) {
      const double phi = 2 * M_PI * k / segments;
      s.x.row(1 + r * segments + k) = (centre + axes.cwiseProduct(Eigen::Vector3d(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi)))).transpose();
    }
  }
  s.x.row(count - 1) = (centre - Eigen::Vector3d(0, axes.y(), 0)).transpose();
  s.faces.resize(2 * segments * rings, 3);
  int f = 0;
  for (int k = 0; k < segments; ++k) {
    const int next = (k + 1) % segments;
    s.faces.row(f++) << 0, 1 + k, 1 + next;
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = 1 + r * segments + k, b = 1 + r * segments + next;
      s.faces.row(f++) << a, a + segments, b + segments;
      s.faces.row(f++) << a, b + segments, b;
    }
    s.faces.row(f++) << count - 1, 1 + (rings - 1) * segments + next, 1 + (rings - 1) * segments + k;
  }
  s.face_region = mesh::Ids::Constant(f, -1);
  return s;
}

/// A tube of cloth in two halves around the y axis, its two side seams open by `gap` [m]: a stand-in for a garment.
inline mesh::GarmentMesh open_tube(int columns, int rows, double radius, double height, double top, double gap, const fabric::Card& card) {
  mesh::GarmentMesh g;
  add_fabric(g, card);
  const double half = M_PI * radius;
  for (int side = 0; side < 2; ++side) {
    add_grid_panel(g, side == 0 ? "front" : "back", columns, rows, half, height, [&](double u, double v) {
      const double angle = (u / half - 0.5) * M_PI + side * M_PI;
      const Eigen::Vector3d out(0, 0, side == 0 ? 0.5 * gap : -0.5 * gap);
      return Eigen::Vector3d(Eigen::Vector3d(radius * std::sin(angle), top - height + v, radius * std::cos(angle)) + out);
    });
  }
  sew(g, 0, "right", 1, "left", "left_side");
  sew(g, 0, "left", 1, "right", "right_side");
  return g;
}

}  // namespace toile::fixtures
