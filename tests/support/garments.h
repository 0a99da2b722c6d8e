// Small garments for tests.
#pragma once

#include "toile/mesh/garment_mesh.h"

namespace toile::test {

inline fabric::Card sample_card() {
  fabric::Card card;
  card.name = "shirting";
  card.origin = "authored for tests";
  card.areal_density = 0.12;
  card.warp = card.weft = {.strain_max = 0.05, .linearity = 0.6, .resilience = 0.6, .bending = 5e-6, .bending_hysteresis = 0};
  card.shear = 30;
  return card;
}

/// Adds a rectangular panel of nu x nv cells of size h, its four border runs (bottom, right, top, left; counter-clockwise)
/// and its corners as named points. z = 0, x = u + shift.
inline void add_rectangle(mesh::GarmentMesh& g, const std::string& name, int nu, int nv, double h, double shift = 0) {
  const int panel = static_cast<int>(g.panels.size());
  const int base = static_cast<int>(g.x.rows());
  const int columns = nu + 1, rows = nv + 1;
  const auto id = [&](int i, int j) { return base + j * columns + i; };
  g.x.conservativeResize(base + rows * columns, 3);
  g.uv.conservativeResize(base + rows * columns, 2);
  g.vertex_panel.conservativeResize(base + rows * columns);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      g.uv.row(id(i, j)) << i * h, j * h;
      g.x.row(id(i, j)) << i * h + shift, j * h, 0;
      g.vertex_panel[id(i, j)] = panel;
    }
  }
  const int face_base = static_cast<int>(g.faces.rows());
  g.faces.conservativeResize(face_base + 2 * nu * nv, 3);
  g.face_panel.conservativeResize(face_base + 2 * nu * nv);
  g.face_laminate.conservativeResize(face_base + 2 * nu * nv);
  int f = face_base;
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const int a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if ((i + j) % 2) {
        g.faces.row(f) << a, b, d;
        g.faces.row(f + 1) << b, c, d;
      } else {
        g.faces.row(f) << a, b, c;
        g.faces.row(f + 1) << a, c, d;
      }
      f += 2;
    }
  }
  for (int k = face_base; k < f; ++k) {
    g.face_panel[k] = panel;
    g.face_laminate[k] = g.laminates.empty() ? -1 : 0;
  }
  g.panels.push_back({.id = panel, .name = name, .piece = name, .mirrored = false, .cell_warp = h, .cell_weft = h, .cut_area = nu * nv * h * h});
  const auto run = [&](const char* run_name, double length, int count, auto vertex) {
    const int r = static_cast<int>(g.runs.size());
    g.runs.push_back({.id = r, .panel = panel, .name = run_name, .length = length});
    for (int k = 0; k <= count; ++k) g.run_vertices.push_back({r, vertex(k), k * h});
  };
  run("bottom", nu * h, nu, [&](int k) { return id(k, 0); });
  run("right", nv * h, nv, [&](int k) { return id(nu, k); });
  run("top", nu * h, nu, [&](int k) { return id(nu - k, nv); });
  run("left", nv * h, nv, [&](int k) { return id(0, nv - k); });
  g.points.push_back({panel, "bottom_left", id(0, 0)});
  g.points.push_back({panel, "bottom_right", id(nu, 0)});
  g.points.push_back({panel, "top_right", id(nu, nv)});
  g.points.push_back({panel, "top_left", id(0, nv)});
}

/// Two rectangles sewn along right/left, with a laminate and a button: one of everything that a file can hold.
inline mesh::GarmentMesh two_panels(int n = 3) {
  mesh::GarmentMesh g;
  const fabric::Card card = sample_card();
  g.fabrics = {card};
  g.laminates = {{.id = 0, .name = "shell", .plies = {{card.name, "", card.areal_density}}, .equivalent = card}};
  add_rectangle(g, "front", n, n, 0.01);
  add_rectangle(g, "back", n, n, 0.01, (n + 0.5) * 0.01);
  g.seams = {{.id = 0, .name = "side", .kind = "plain", .length_a = n * 0.01, .length_b = n * 0.01}};
  const auto a = mesh::run_vertex_ids(g, 1), b = mesh::run_vertex_ids(g, 7);
  for (std::size_t k = 0; k < a.size(); ++k) g.welds.push_back({a[k], b[b.size() - 1 - k], 0});
  g.closures = {{0, "top", "button"}};
  g.fasteners = {{0, 1, mesh::Fastener::Kind::button, 0.001, 0.002, 0, true, 300, 0.01}};
  g.folds = {{0, "crease", "crease", 1.2, 0.0, {0, 4}, 1.5}};
  g.hinges = {{g.faces(0, 0), g.faces(0, 1), g.faces(0, 2), g.faces(1, 0) == g.faces(0, 0) || g.faces(1, 0) == g.faces(0, 1) ? g.faces(1, 2) : g.faces(1, 0), 1.2, 1.5, 0}};
  g.trims = {{0, "side tape", "tape", 0, 300, 1e-6, 0.002, 0.98, false, 0.006, 2}};
  g.trim_segments = {{a[0], a[1], 0, 0.0098}, {a[1], a[2], 0, 0.0098}};
  g.free_layers = {{0, "patch", {1}, {0}, true}};
  return g;
}

}  // namespace toile::test
