// Small garments and supports made in code, for tests.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

namespace toile::shapes {

/// A closed sphere by subdividing an octahedron; 4^levels * 8 faces.
inline mesh::SupportMesh sphere(const Eigen::Vector3d& centre, double radius, int levels) {
  std::vector<Eigen::Vector3d> x{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<int, 3>> faces{{4, 0, 2}, {0, 5, 2}, {5, 1, 2}, {1, 4, 2}, {0, 4, 3}, {5, 0, 3}, {1, 5, 3}, {4, 1, 3}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto between = [&](int a, int b) {
      const auto [it, inserted] = middle.try_emplace(std::minmax(a, b), static_cast<int>(x.size()));
      if (inserted) x.push_back((x[static_cast<std::size_t>(a)] + x[static_cast<std::size_t>(b)]).normalized());
      return it->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = between(a, b), bc = between(b, c), ca = between(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = finer;
  }
  mesh::SupportMesh s;
  s.x.resize(static_cast<Eigen::Index>(x.size()), 3);
  for (std::size_t i = 0; i < x.size(); ++i) s.x.row(static_cast<Eigen::Index>(i)) = centre + radius * x[i];
  s.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) s.faces.row(static_cast<Eigen::Index>(i)) << faces[i][0], faces[i][1], faces[i][2];
  s.face_region = mesh::Ids::Constant(s.faces.rows(), -1);
  return s;
}

inline fabric::Card plain_card() {
  fabric::Card card;
  card.name = "plain";
  card.origin = "authored, not measured";
  card.areal_density = 0.12;
  card.warp = {.strain_max = 0.04, .linearity = 0.6};
  card.weft = {.strain_max = 0.08, .linearity = 0.55};
  return card;
}

/// Appends a panel: a grid of `columns` x `rows` cells over width x height [m], lower left corner at (0, 0) in panel
/// coordinates and at (x0, y0, z0) in space, facing +z. Vertices run row by row. Runs: bottom, right, top, left,
/// counter-clockwise; points: the corners bottom_left, bottom_right, top_right, top_left.
inline void add_panel(mesh::GarmentMesh& g, const std::string& name, double width, double height, int columns, int rows,
                      const Eigen::Vector3d& corner = Eigen::Vector3d::Zero()) {
  const int base = static_cast<int>(g.vertex_count()), first_face = static_cast<int>(g.face_count()), id = static_cast<int>(g.panels.size());
  const int nv = (columns + 1) * (rows + 1), nf = 2 * columns * rows;
  g.x.conservativeResize(base + nv, 3);
  g.uv.conservativeResize(base + nv, 2);
  g.vertex_panel.conservativeResize(base + nv);
  g.faces.conservativeResize(first_face + nf, 3);
  g.face_panel.conservativeResize(first_face + nf);
  g.face_laminate.conservativeResize(first_face + nf);
  const auto at = [&](int i, int j) { return base + j * (columns + 1) + i; };
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double u = width * i / columns, v = height * j / rows;
      g.uv.row(at(i, j)) << u, v;
      g.x.row(at(i, j)) = corner + Eigen::Vector3d(u, v, 0);
      g.vertex_panel[at(i, j)] = id;
    }
  }
  int f = first_face;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const bool up = (i + j) % 2 == 0;
      g.faces.row(f) << at(i, j), at(i + 1, j), up ? at(i + 1, j + 1) : at(i, j + 1);
      g.faces.row(f + 1) << at(i + (up ? 0 : 1), j), at(i + 1, j + 1), at(i, j + 1);
      for (int k = 0; k < 2; ++k, ++f) {
        g.face_panel[f] = id;
        g.face_laminate[f] = 0;
      }
    }
  }
  if (g.laminates.empty()) {
    g.fabrics = {plain_card()};
    g.laminates.push_back({.id = 0, .name = "plain", .plies = {{"plain", "", plain_card().areal_density}}, .equivalent = plain_card()});
  }
  g.panels.push_back({.id = id, .name = name, .piece = name, .cell_warp = height / rows, .cell_weft = width / columns, .cut_area = width * height});
  const auto add_run = [&](const std::string& run_name, double length, int count, const auto& vertex) {
    const int run = static_cast<int>(g.runs.size());
    g.runs.push_back({run, id, run_name, length, false, false});
    for (int i = 0; i <= count; ++i) g.run_vertices.push_back({run, vertex(i), length * i / count});
  };
  add_run("bottom", width, columns, [&](int i) { return at(i, 0); });
  add_run("right", height, rows, [&](int j) { return at(columns, j); });
  add_run("top", width, columns, [&](int i) { return at(columns - i, rows); });
  add_run("left", height, rows, [&](int j) { return at(0, rows - j); });
  g.points.push_back({id, "bottom_left", at(0, 0)});
  g.points.push_back({id, "bottom_right", at(columns, 0)});
  g.points.push_back({id, "top_right", at(columns, rows)});
  g.points.push_back({id, "top_left", at(0, rows)});
}

/// Sews run a of panel pa to run b of panel pb (same vertex count), the second taken backwards.
inline void sew(mesh::GarmentMesh& g, const std::string& name, int run_a, int run_b) {
  const std::vector<int> a = mesh::run_vertex_ids(g, run_a), b = mesh::run_vertex_ids(g, run_b);
  const int seam = static_cast<int>(g.seams.size());
  mesh::Seam s;
  s.id = seam;
  s.name = name;
  s.length_a = g.runs[static_cast<std::size_t>(run_a)].length;
  s.length_b = g.runs[static_cast<std::size_t>(run_b)].length;
  g.seams.push_back(s);
  for (std::size_t i = 0; i < a.size(); ++i) g.welds.push_back({a[i], b[b.size() - 1 - i], seam});
}

/// One panel bent round the vertical axis and sewn to itself along `right`-`left`: a tube of the given radius with its
/// foot at height y0, outside facing out.
inline mesh::GarmentMesh tube(double radius, double height, int columns, int rows, double y0 = 0) {
  mesh::GarmentMesh g;
  add_panel(g, "tube", 2 * std::numbers::pi * radius, height, columns, rows);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const double angle = g.uv(v, 0) / radius;
    g.x.row(v) << radius * std::sin(angle), y0 + g.uv(v, 1), radius * std::cos(angle);
  }
  sew(g, "back", 1, 3);
  return g;
}

}  // namespace toile::shapes
