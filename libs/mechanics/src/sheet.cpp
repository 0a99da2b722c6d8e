#include "toile/mechanics/sheet.h"

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace toile::mechanics {
namespace {

constexpr std::size_t grain = 1024;

struct Triplet {
  int row, column;
  double value;
};

ScalarMatrix compress(int rows, std::vector<Triplet>& triplets) {
  std::stable_sort(triplets.begin(), triplets.end(), [](const Triplet& p, const Triplet& q) { return std::tie(p.row, p.column) < std::tie(q.row, q.column); });
  ScalarMatrix matrix;
  matrix.row_start.assign(static_cast<std::size_t>(rows) + 1, 0);
  int row = -1;
  for (const Triplet& t : triplets) {
    if (t.row == row && matrix.column.back() == t.column) {
      matrix.value.back() += t.value;
      continue;
    }
    row = t.row;
    matrix.column.push_back(t.column);
    matrix.value.push_back(t.value);
    ++matrix.row_start[static_cast<std::size_t>(t.row) + 1];
  }
  for (std::size_t i = 1; i < matrix.row_start.size(); ++i) matrix.row_start[i] += matrix.row_start[i - 1];
  return matrix;
}

/// Outward derivative across edge k (corner k to k+1) of a triangle, as coefficients of its corners [1/m]; and the edge's
/// length and outward normal in the panel's coordinates.
struct Conormal {
  std::array<double, 3> slope;
  double length;
  Eigen::Vector2d normal;
};

Conormal conormal(const TriangleShape& shape, const std::array<Eigen::Vector2d, 3>& uv, int k) {
  const Eigen::Vector2d edge = uv[static_cast<std::size_t>((k + 1) % 3)] - uv[static_cast<std::size_t>(k)];
  Conormal result;
  result.length = edge.norm();
  result.normal = Eigen::Vector2d(edge.y(), -edge.x()) / result.length;
  for (std::size_t c = 0; c < 3; ++c) result.slope[c] = shape.slope_u[c] * result.normal.x() + shape.slope_v[c] * result.normal.y();
  return result;
}

std::array<Eigen::Vector2d, 3> corners_uv(const mesh::GarmentMesh& garment, Eigen::Index f) {
  return {garment.uv.row(garment.faces(f, 0)).transpose(), garment.uv.row(garment.faces(f, 1)).transpose(), garment.uv.row(garment.faces(f, 2)).transpose()};
}

/// weight/2 |sum_i coefficient_i x_(node_i)|^2 as contributions to the matrix.
void add_square(const std::vector<std::pair<int, double>>& form, double weight, std::vector<Triplet>& triplets) {
  for (const auto& [i, p] : form) {
    for (const auto& [j, q] : form) triplets.push_back({i, j, weight * p * q});
  }
}

/// Bending of rectangular grid cells by second differences along the yarns at their corners and the twist of the cell.
/// Returns which faces are done that way: both halves of a rectangle along the yarns whose corners are free of seams and either
/// inside the grid or on a border along a yarn (there the moment across the border vanishes and needs no term).
std::vector<char> grid_bending_triplets(const mesh::GarmentMesh& garment, const Sheet& sheet, std::vector<Triplet>& triplets) {
  const auto nv = static_cast<std::size_t>(garment.vertex_count());
  std::vector<char> done(sheet.corners.size(), 0);
  std::vector<int> sharing(static_cast<std::size_t>(sheet.node_count), 0);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) ++sharing[static_cast<std::size_t>(sheet.node_of_vertex[v])];
  std::vector<double> angle(nv, 0);
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::RowVector2d o = garment.uv.row(garment.faces(f, k));
      const Eigen::RowVector2d p = garment.uv.row(garment.faces(f, (k + 1) % 3)) - o, q = garment.uv.row(garment.faces(f, (k + 2) % 3)) - o;
      angle[static_cast<std::size_t>(garment.faces(f, k))] += std::atan2(std::abs(p.x() * q.y() - p.y() * q.x()), p.dot(q));
    }
  }
  constexpr double aligned = 1e-6;
  // Neighbours along +u, -u, +v, -v.
  std::vector<std::array<int, 4>> next(nv, {-1, -1, -1, -1});
  const std::vector<mesh::Edge> edges = mesh::edges(garment.faces);
  for (const mesh::Edge& edge : edges) {
    const Eigen::RowVector2d d = garment.uv.row(edge.b) - garment.uv.row(edge.a);
    const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
    if (std::abs(d.y()) < aligned * std::abs(d.x())) {
      next[a][d.x() > 0 ? 0 : 1] = edge.b;
      next[b][d.x() > 0 ? 1 : 0] = edge.a;
    } else if (std::abs(d.x()) < aligned * std::abs(d.y())) {
      next[a][d.y() > 0 ? 2 : 3] = edge.b;
      next[b][d.y() > 0 ? 3 : 2] = edge.a;
    }
  }
  const auto regular = [&](int vertex) {
    const auto v = static_cast<std::size_t>(vertex);
    if (sharing[static_cast<std::size_t>(sheet.node_of_vertex[vertex])] != 1) return false;
    const double quarters = angle[v] / (0.5 * M_PI);
    const auto whole = static_cast<int>(std::lround(quarters));
    if (std::abs(quarters - whole) > 1e-6 || whole == 3) return false;
    const auto count = static_cast<int>(std::count_if(next[v].begin(), next[v].end(), [](int n) { return n >= 0; }));
    return count == (whole == 4 ? 4 : whole + 1);
  };
  const auto node = [&](int vertex) { return sheet.node_of_vertex[vertex]; };
  for (const mesh::Edge& edge : edges) {
    if (edge.faces.size() != 2) continue;
    const auto f = static_cast<std::size_t>(edge.faces[0]), g = static_cast<std::size_t>(edge.faces[1]);
    if (sheet.fabric_of_face[f] != sheet.fabric_of_face[g]) continue;
    const auto opposite = [&](int face) {
      for (int k = 0; k < 3; ++k) {
        const int v = garment.faces(face, k);
        if (v != edge.a && v != edge.b) return v;
      }
      return -1;
    };
    const int c = opposite(edge.faces[0]), d = opposite(edge.faces[1]);
    const Eigen::RowVector2d a = garment.uv.row(edge.a), b = garment.uv.row(edge.b), size = (b - a).cwiseAbs();
    const double tolerance = aligned * size.maxCoeff();
    if (size.minCoeff() < 0.05 * size.maxCoeff()) continue;
    const auto at = [&](int v, double u, double w) { return (garment.uv.row(v) - Eigen::RowVector2d(u, w)).norm() < tolerance; };
    if (!((at(c, a.x(), b.y()) && at(d, b.x(), a.y())) || (at(d, a.x(), b.y()) && at(c, b.x(), a.y())))) continue;
    const std::array<int, 4> corner{edge.a, edge.b, c, d};
    if (!std::all_of(corner.begin(), corner.end(), regular)) continue;
    done[f] = done[g] = 1;
    const double area = size.x() * size.y();
    const fabric::Constitutive& fabric = sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])];
    for (int v : corner) {
      for (int axis = 0; axis < 2; ++axis) {
        const int after = next[static_cast<std::size_t>(v)][static_cast<std::size_t>(2 * axis)], before = next[static_cast<std::size_t>(v)][static_cast<std::size_t>(2 * axis + 1)];
        if (after < 0 || before < 0) continue;
        const double p = garment.uv(after, axis) - garment.uv(v, axis), q = garment.uv(v, axis) - garment.uv(before, axis);
        const double scale = 2 / (p + q);
        add_square({{node(after), scale / p}, {node(before), scale / q}, {node(v), -scale * (1 / p + 1 / q)}}, 0.25 * area * (axis == 0 ? fabric.bending_weft : fabric.bending_warp), triplets);
      }
    }
    const double twist = 1 / area;
    add_square({{node(edge.a), twist}, {node(edge.b), twist}, {node(c), -twist}, {node(d), -twist}}, 4 * fabric.bending_twist * area, triplets);
  }
  return done;
}

/// Bending of the other triangles: curvature of a triangle from the jumps of the surface's slope over its
/// edges, docs/mechanics.md#bending.
void bending_triplets(const mesh::GarmentMesh& garment, const Sheet& sheet, const std::map<std::pair<int, int>, double>& seam_factor, const std::vector<char>& skip, std::vector<Triplet>& triplets) {
  mesh::Triangles faces(garment.face_count(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = sheet.corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
  }
  // Jump terms of each face: edges with neighbours.
  struct Side {
    int face, edge;
  };
  std::vector<std::vector<std::pair<int, std::vector<Side>>>> neighbours(sheet.corners.size());
  const auto edge_index = [&](int f, int a, int b) {
    for (int k = 0; k < 3; ++k) {
      const int p = faces(f, k), q = faces(f, (k + 1) % 3);
      if ((p == a && q == b) || (p == b && q == a)) return k;
    }
    return -1;
  };
  std::map<std::pair<int, int>, double> factors = seam_factor;
  for (const mesh::Edge& edge : mesh::edges(faces)) {
    if (edge.faces.size() < 2) continue;
    std::vector<Side> sides;
    for (int f : edge.faces) sides.push_back({f, edge_index(f, edge.a, edge.b)});
    for (std::size_t i = 0; i < sides.size(); ++i) {
      std::vector<Side> others;
      for (std::size_t j = 0; j < sides.size(); ++j) {
        if (j != i) others.push_back(sides[j]);
      }
      neighbours[static_cast<std::size_t>(sides[i].face)].push_back({sides[i].edge, std::move(others)});
    }
  }
  for (std::size_t f = 0; f < sheet.corners.size(); ++f) {
    if (skip[f]) continue;
    const TriangleShape& shape = sheet.shapes[f];
    const auto uv = corners_uv(garment, static_cast<Eigen::Index>(f));
    std::vector<int> nodes(sheet.corners[f].begin(), sheet.corners[f].end());
    std::vector<std::array<double, 3>> curvature(3, {0, 0, 0});  // K_uu, K_vv, K_uv per node
    const auto add = [&](int node, double jump, const Conormal& edge, double weight) {
      std::size_t slot = 0;
      while (slot < nodes.size() && nodes[slot] != node) ++slot;
      if (slot == nodes.size()) {
        nodes.push_back(node);
        curvature.push_back({0, 0, 0});
      }
      const double w = jump * weight * edge.length / (2 * shape.area);
      curvature[slot][0] += w * edge.normal.x() * edge.normal.x();
      curvature[slot][1] += w * edge.normal.y() * edge.normal.y();
      curvature[slot][2] += w * edge.normal.x() * edge.normal.y();
    };
    for (const auto& [k, others] : neighbours[f]) {
      const Conormal own = conormal(shape, uv, k);
      const int a = sheet.corners[f][static_cast<std::size_t>(k)], b = sheet.corners[f][static_cast<std::size_t>((k + 1) % 3)];
      const auto factor = factors.find({std::min(a, b), std::max(a, b)});
      const double weight = factor == factors.end() ? 1.0 : std::sqrt(factor->second);
      for (std::size_t c = 0; c < 3; ++c) add(sheet.corners[f][c], -own.slope[c], own, weight);
      for (const Side& side : others) {
        const auto g = static_cast<std::size_t>(side.face);
        const Conormal other = conormal(sheet.shapes[g], corners_uv(garment, side.face), side.edge);
        for (std::size_t c = 0; c < 3; ++c) add(sheet.corners[g][c], -other.slope[c] / static_cast<double>(others.size()), own, weight);
      }
    }
    const fabric::Constitutive& fabric = sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])];
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (std::size_t j = 0; j < nodes.size(); ++j) {
        const double value = shape.area * (fabric.bending_weft * curvature[i][0] * curvature[j][0] + fabric.bending_warp * curvature[i][1] * curvature[j][1] +
                                           4 * fabric.bending_twist * curvature[i][2] * curvature[j][2]);
        triplets.push_back({nodes[i], nodes[j], value});
      }
    }
  }
}

void bucket(int buckets, const std::vector<int>& key, std::vector<int>& start, std::vector<int>& items) {
  start.assign(static_cast<std::size_t>(buckets) + 1, 0);
  for (int k : key) ++start[static_cast<std::size_t>(k) + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  items.resize(key.size());
  std::vector<int> next(start.begin(), start.end() - 1);
  for (std::size_t i = 0; i < key.size(); ++i) items[static_cast<std::size_t>(next[static_cast<std::size_t>(key[i])]++)] = static_cast<int>(i);
}

/// Which of the six stored blocks of a face holds corners (a, b), a <= b.
constexpr std::array<std::array<int, 3>, 3> block_slot{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

Eigen::Vector3d point(const Points3& x, int i) { return x.row(i).transpose(); }

}  // namespace

YarnGradient yarn_gradient(const Sheet& sheet, const Points3& x, std::size_t face) {
  const auto& corner = sheet.corners[face];
  const TriangleShape& shape = sheet.shapes[face];
  const Eigen::Vector3d a = point(x, corner[0]), b = point(x, corner[1]) - a, c = point(x, corner[2]) - a;
  return {shape.slope_u[1] * b + shape.slope_u[2] * c, shape.slope_v[1] * b + shape.slope_v[2] * c};
}

Result<Sheet> make_sheet(const mesh::GarmentMesh& garment, const Ids& node_of_vertex, const SheetOptions& options) {
  TOILE_CHECK(node_of_vertex.size() == garment.vertex_count(), "{} ids for {} vertices", node_of_vertex.size(), garment.vertex_count());
  Issues issues;
  Sheet sheet;
  sheet.node_of_vertex = node_of_vertex;
  sheet.node_count = node_of_vertex.size() == 0 ? 0 : node_of_vertex.maxCoeff() + 1;
  if (garment.face_count() == 0) return Issue{"empty_garment", {}, "the garment has no faces", "mesh its panels first (toile-mesh)"};

  for (const mesh::Laminate& laminate : garment.laminates) {
    Result<fabric::Constitutive> data = fabric::constitutive(laminate.equivalent);
    if (data) {
      sheet.fabrics.push_back(*data);
    } else {
      append(issues, data.issues());
    }
  }
  std::set<int> bare, degenerate;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    if (garment.face_laminate[f] < 0) bare.insert(garment.face_panel[f]);
  }
  for (int panel : bare) {
    issues.push_back(Issue{"no_laminate", {.item = "panel " + garment.panels[static_cast<std::size_t>(panel)].name}, "some of its faces have no fabric",
                           "give the panel a fabric with toile-layer"});
  }
  if (!issues.empty()) return issues;

  const auto nf = static_cast<std::size_t>(garment.face_count());
  sheet.corners.resize(nf);
  sheet.shapes.resize(nf);
  sheet.fabric_of_face.resize(nf);
  sheet.area = Eigen::VectorXd::Zero(sheet.node_count);
  for (std::size_t f = 0; f < nf; ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    const auto uv = corners_uv(garment, row);
    sheet.shapes[f] = triangle_shape(uv[0], uv[1], uv[2]);
    sheet.fabric_of_face[f] = garment.face_laminate[row];
    for (std::size_t k = 0; k < 3; ++k) {
      sheet.corners[f][k] = node_of_vertex[garment.faces(row, static_cast<Eigen::Index>(k))];
      sheet.area[sheet.corners[f][k]] += sheet.shapes[f].area / 3;
    }
    const double longest = std::max({(uv[1] - uv[0]).squaredNorm(), (uv[2] - uv[1]).squaredNorm(), (uv[0] - uv[2]).squaredNorm()});
    const auto& c = sheet.corners[f];
    if (!(sheet.shapes[f].area > 1e-6 * longest) || c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) degenerate.insert(garment.face_panel[row]);
  }
  for (int panel : degenerate) {
    issues.push_back(Issue{"degenerate_triangle", {.item = "panel " + garment.panels[static_cast<std::size_t>(panel)].name},
                           "has a triangle without area in panel coordinates, turned over, or with two corners sewn together", "mesh the panel again (toile-mesh)"});
  }
  if (!issues.empty()) return issues;

  sheet.mass = Eigen::VectorXd::Zero(sheet.node_count);
  const Eigen::VectorXd vertex_mass = mesh::vertex_masses(garment);
  for (Eigen::Index v = 0; v < vertex_mass.size(); ++v) sheet.mass[node_of_vertex[v]] += vertex_mass[v];

  std::map<std::pair<int, int>, double> seam_factor;
  std::set<std::pair<int, int>> linked;
  for (std::size_t i = 0; i < garment.welds.size(); ++i) {
    const mesh::Weld& weld = garment.welds[i];
    const int a = node_of_vertex[weld.a], b = node_of_vertex[weld.b];
    if (a != b && linked.insert({std::min(a, b), std::max(a, b)}).second) sheet.links.push_back({std::min(a, b), std::max(a, b), options.link_stiffness});
    if (i == 0 || garment.welds[i - 1].seam != weld.seam) continue;
    const int before = node_of_vertex[garment.welds[i - 1].a];
    if (a == b && before != a) {
      seam_factor[{std::min(a, before), std::max(a, before)}] = garment.seams[static_cast<std::size_t>(weld.seam)].bending_factor;
    }
  }
  for (const mesh::Fastener& fastener : garment.fasteners) {
    const int a = node_of_vertex[fastener.a], b = node_of_vertex[fastener.b];
    if (a != b) sheet.springs.push_back({a, b, options.fastener_stiffness, fastener.length});
  }

  std::vector<Triplet> triplets;
  const std::vector<char> on_grid = grid_bending_triplets(garment, sheet, triplets);
  bending_triplets(garment, sheet, seam_factor, on_grid, triplets);
  sheet.bending = compress(sheet.node_count, triplets);

  // The block pattern: bending stencils hold those of the membrane except at lone triangles, so all are joined.
  triplets.clear();
  for (int i = 0; i < sheet.node_count; ++i) {
    triplets.push_back({i, i, 0});
    for (int k = sheet.bending.row_start[static_cast<std::size_t>(i)]; k < sheet.bending.row_start[static_cast<std::size_t>(i) + 1]; ++k) {
      triplets.push_back({i, sheet.bending.column[static_cast<std::size_t>(k)], sheet.bending.value[static_cast<std::size_t>(k)]});
    }
  }
  for (const auto& corner : sheet.corners) {
    for (int a : corner) {
      for (int b : corner) triplets.push_back({a, b, 0});
    }
  }
  for (const Link& link : sheet.links) {
    triplets.push_back({link.a, link.a, link.stiffness});
    triplets.push_back({link.b, link.b, link.stiffness});
    triplets.push_back({link.a, link.b, -link.stiffness});
    triplets.push_back({link.b, link.a, -link.stiffness});
  }
  for (const Spring& spring : sheet.springs) {
    triplets.push_back({spring.a, spring.b, 0});
    triplets.push_back({spring.b, spring.a, 0});
  }
  ScalarMatrix pattern = compress(sheet.node_count, triplets);
  sheet.row_start = std::move(pattern.row_start);
  sheet.column = std::move(pattern.column);
  sheet.constant_part = std::move(pattern.value);
  const auto find = [&](int i, int j) {
    const auto begin = sheet.column.begin() + sheet.row_start[static_cast<std::size_t>(i)], end = sheet.column.begin() + sheet.row_start[static_cast<std::size_t>(i) + 1];
    return static_cast<int>(std::lower_bound(begin, end, j) - sheet.column.begin());
  };
  for (int i = 0; i < sheet.node_count; ++i) sheet.diagonal.push_back(find(i, i));

  std::vector<int> key;
  for (const auto& corner : sheet.corners) key.insert(key.end(), corner.begin(), corner.end());
  bucket(sheet.node_count, key, sheet.node_corner_start, sheet.node_corner);
  key.clear();
  for (const auto& corner : sheet.corners) {
    for (int a : corner) {
      for (int b : corner) key.push_back(find(a, b));
    }
  }
  bucket(static_cast<int>(sheet.column.size()), key, sheet.block_part_start, sheet.block_part);
  key.clear();
  for (const Link& link : sheet.links) key.insert(key.end(), {link.a, link.b});
  for (const Spring& spring : sheet.springs) key.insert(key.end(), {spring.a, spring.b});
  bucket(sheet.node_count, key, sheet.node_link_start, sheet.node_link);
  return sheet;
}

void scale_links(Sheet& sheet, double factor) {
  const auto add = [&](int i, int j, double value) {
    const auto begin = sheet.column.begin() + sheet.row_start[static_cast<std::size_t>(i)], end = sheet.column.begin() + sheet.row_start[static_cast<std::size_t>(i) + 1];
    sheet.constant_part[static_cast<std::size_t>(std::lower_bound(begin, end, j) - sheet.column.begin())] += value;
  };
  for (Link& link : sheet.links) {
    const double more = (factor - 1) * link.stiffness;
    link.stiffness += more;
    add(link.a, link.a, more);
    add(link.b, link.b, more);
    add(link.a, link.b, -more);
    add(link.b, link.a, -more);
  }
}

SheetEnergy energy(const Sheet& sheet, const Points3& x, const Points3& link_offset) {
  SheetEnergy result;
  const auto add = [](double a, double b) { return a + b; };
  result.membrane = parallel_reduce(sheet.corners.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t f = begin; f < end; ++f) {
      sum += sheet.shapes[f].area * membrane_energy(sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])], yarn_gradient(sheet, x, f));
    }
    return sum;
  }, add);
  result.bending = parallel_reduce(static_cast<std::size_t>(sheet.node_count), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      Eigen::RowVector3d force = Eigen::RowVector3d::Zero();
      // Differences to the row's own point: rows sum to zero, and this keeps the digits.
      for (int k = sheet.bending.row_start[i]; k < sheet.bending.row_start[i + 1]; ++k) {
        force += sheet.bending.value[static_cast<std::size_t>(k)] * (x.row(sheet.bending.column[static_cast<std::size_t>(k)]) - x.row(row));
      }
      sum += 0.5 * x.row(row).dot(force);
    }
    return sum;
  }, add);
  for (std::size_t i = 0; i < sheet.links.size(); ++i) {
    const Link& link = sheet.links[i];
    result.links += 0.5 * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  for (const Spring& spring : sheet.springs) {
    const double stretch = (x.row(spring.a) - x.row(spring.b)).norm() - spring.length;
    result.links += 0.5 * spring.stiffness * stretch * stretch;
  }
  return result;
}

void evaluate(const Sheet& sheet, const Points3& x, const Points3& link_offset, std::optional<Curvature> curvature, SheetResponse& response) {
  const std::size_t nf = sheet.corners.size();
  response.corner_force.resize(nf);
  if (curvature) response.face_blocks.resize(nf);
  response.gradient.resize(sheet.node_count, 3);
  const auto add = [](double a, double b) { return a + b; };
  response.energy = {};
  response.energy.membrane = parallel_reduce(nf, grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t f = begin; f < end; ++f) {
      const TriangleShape& shape = sheet.shapes[f];
      const MembraneResponse r = membrane_response(sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])], yarn_gradient(sheet, x, f),
                                                   curvature.value_or(Curvature::exact));
      sum += shape.area * r.energy;
      for (std::size_t k = 0; k < 3; ++k) {
        response.corner_force[f].col(static_cast<Eigen::Index>(k)) = shape.area * (shape.slope_u[k] * r.stress.weft + shape.slope_v[k] * r.stress.warp);
      }
      if (!curvature) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = a; b < 3; ++b) {
          const double au = shape.slope_u[a], av = shape.slope_v[a], bu = shape.slope_u[b], bv = shape.slope_v[b];
          response.face_blocks[f][static_cast<std::size_t>(block_slot[a][b])] =
              shape.area * (au * bu * r.weft_weft + au * bv * r.weft_warp + av * bu * r.weft_warp.transpose() + av * bv * r.warp_warp);
        }
      }
    }
    return sum;
  }, add);

  const std::size_t links = sheet.links.size();
  const auto end_force = [&](int item) -> Eigen::RowVector3d {
    const auto i = static_cast<std::size_t>(item / 2);
    const double sign = item % 2 == 0 ? 1 : -1;
    if (i < links) {
      const Link& link = sheet.links[i];
      return sign * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i)));
    }
    const Spring& spring = sheet.springs[i - links];
    const Eigen::RowVector3d d = x.row(spring.a) - x.row(spring.b);
    const double length = std::max(d.norm(), 1e-12);
    return sign * spring.stiffness * (1 - spring.length / length) * d;
  };
  response.energy.bending = parallel_reduce(static_cast<std::size_t>(sheet.node_count), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      Eigen::RowVector3d force = Eigen::RowVector3d::Zero();
      for (int k = sheet.bending.row_start[i]; k < sheet.bending.row_start[i + 1]; ++k) {
        force += sheet.bending.value[static_cast<std::size_t>(k)] * (x.row(sheet.bending.column[static_cast<std::size_t>(k)]) - x.row(row));
      }
      sum += 0.5 * x.row(row).dot(force);
      for (int k = sheet.node_corner_start[i]; k < sheet.node_corner_start[i + 1]; ++k) {
        const int item = sheet.node_corner[static_cast<std::size_t>(k)];
        force += response.corner_force[static_cast<std::size_t>(item / 3)].col(item % 3).transpose();
      }
      for (int k = sheet.node_link_start[i]; k < sheet.node_link_start[i + 1]; ++k) force += end_force(sheet.node_link[static_cast<std::size_t>(k)]);
      response.gradient.row(row) = force;
    }
    return sum;
  }, add);
  for (std::size_t i = 0; i < links; ++i) {
    const Link& link = sheet.links[i];
    response.energy.links += 0.5 * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  for (const Spring& spring : sheet.springs) {
    const double stretch = (x.row(spring.a) - x.row(spring.b)).norm() - spring.length;
    response.energy.links += 0.5 * spring.stiffness * stretch * stretch;
  }
  if (!curvature) return;

  BlockMatrix& matrix = response.matrix;
  if (matrix.value.size() != sheet.column.size()) {
    matrix.row_start = sheet.row_start;
    matrix.column = sheet.column;
    matrix.diagonal = sheet.diagonal;
    matrix.value.resize(sheet.column.size());
  }
  parallel_for(static_cast<std::size_t>(sheet.node_count), grain / 4, [&](std::size_t i) {
    for (int k = sheet.row_start[i]; k < sheet.row_start[i + 1]; ++k) {
      const auto slot = static_cast<std::size_t>(k);
      Eigen::Matrix3d sum = sheet.constant_part[slot] * Eigen::Matrix3d::Identity();
      for (int p = sheet.block_part_start[slot]; p < sheet.block_part_start[slot + 1]; ++p) {
        const int item = sheet.block_part[static_cast<std::size_t>(p)], a = item % 9 / 3, b = item % 3;
        const Eigen::Matrix3d& block = response.face_blocks[static_cast<std::size_t>(item / 9)][static_cast<std::size_t>(block_slot[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)])];
        if (a <= b) {
          sum += block;
        } else {
          sum += block.transpose();
        }
      }
      matrix.value[slot] = Block::from(sum);
    }
  });
  for (const Spring& spring : sheet.springs) {
    const Eigen::Vector3d d = point(x, spring.a) - point(x, spring.b);
    const double length = std::max(d.norm(), 1e-12);
    const Eigen::Matrix3d along = d * d.transpose() / (length * length);
    const double across = std::max(1 - spring.length / length, 0.0);
    const Block h = Block::from(spring.stiffness * (along + across * (Eigen::Matrix3d::Identity() - along)));
    const auto find = [&](int i, int j) {
      const auto begin = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(i)], end = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(i) + 1];
      return static_cast<std::size_t>(std::lower_bound(begin, end, j) - matrix.column.begin());
    };
    const auto add_block = [&](int i, int j, float sign) {
      Block& target = matrix.value[find(i, j)];
      for (int c = 0; c < 3; ++c) target.column[c] += splat(sign) * h.column[c];
    };
    add_block(spring.a, spring.a, 1);
    add_block(spring.b, spring.b, 1);
    add_block(spring.a, spring.b, -1);
    add_block(spring.b, spring.a, -1);
  }
}

StrainSummary strain_summary(const Sheet& sheet, const Points3& x) {
  std::vector<double> warp(sheet.corners.size()), weft(sheet.corners.size());
  StrainSummary summary;
  for (std::size_t f = 0; f < sheet.corners.size(); ++f) {
    const Strain s = strain(yarn_gradient(sheet, x, f));
    warp[f] = std::max(s.warp, 0.0);
    weft[f] = std::max(s.weft, 0.0);
    summary.shear_max = std::max(summary.shear_max, std::abs(s.shear));
  }
  const auto percentile = [](std::vector<double>& values) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  summary.warp_99 = percentile(warp);
  summary.weft_99 = percentile(weft);
  summary.warp_max = *std::max_element(warp.begin(), warp.end());
  summary.weft_max = *std::max_element(weft.begin(), weft.end());
  return summary;
}

}  // namespace toile::mechanics
