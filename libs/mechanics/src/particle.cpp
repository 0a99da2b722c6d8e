#include "toile/mechanics/particle.h"

#include <unsupported/Eigen/AutoDiff>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

namespace toile::mechanics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t grain = 1024;
constexpr double least_length = 1e-9;  // an edge squeezed to nothing has no direction [m]

Vector3d point(const Points3& x, int i) { return x.row(i).transpose(); }

// --- two directions and the cosine between them -----------------------------------------------------------------------

struct Directions {
  double p_length, q_length;
  Vector3d p, q;   // unit
  double cosine;
};

Directions directions(const Vector3d& p, const Vector3d& q) {
  Directions d;
  d.p_length = std::max(p.norm(), least_length);
  d.q_length = std::max(q.norm(), least_length);
  d.p = p / d.p_length;
  d.q = q / d.q_length;
  d.cosine = std::clamp(d.p.dot(d.q), -1.0, 1.0);
  return d;
}

/// Second derivatives of an energy h(cosine) with respect to the two vectors.
struct AngleBlocks {
  Matrix3d pp, pq, qq;
};

/// slope = h', curve = h''. In the plane of the two directions the second derivative is a 4x4, along its normal a 2x2; the
/// projection on positive semidefinite matrices is that of these two.
AngleBlocks angle_blocks(const Directions& d, double slope, double curve, Curvature curvature) {
  const double c = d.cosine, lp = d.p_length, lq = d.q_length;
  const Vector3d e1 = d.p;
  Vector3d e2 = d.q - c * d.p;
  const double s = e2.norm();
  if (s > 1e-9) {
    e2 /= s;
  } else {
    e2 = e1.unitOrthogonal();
  }
  const Vector3d e3 = e1.cross(e2);
  // In the frame (e1, e2): p = (1, 0), q = (c, s); y and z are the directions across them.
  const Eigen::Vector2d p(1, 0), q(c, s), y(0, 1), z(-s, c);
  const Eigen::Vector2d gp = s / lp * y, gq = -s / lq * z;
  Eigen::Matrix4d plane;
  plane.topLeftCorner<2, 2>() = curve * gp * gp.transpose() - slope / lp * (p * gp.transpose() + gp * p.transpose() + c / lp * y * y.transpose());
  plane.bottomRightCorner<2, 2>() = curve * gq * gq.transpose() - slope / lq * (q * gq.transpose() + gq * q.transpose() + c / lq * z * z.transpose());
  plane.topRightCorner<2, 2>() = curve * gp * gq.transpose() + slope / (lp * lq) * y.dot(z) * y * z.transpose();
  plane.bottomLeftCorner<2, 2>() = plane.topRightCorner<2, 2>().transpose();
  double npp = -slope * c / (lp * lp), nqq = -slope * c / (lq * lq), npq = slope / (lp * lq);
  if (curvature == Curvature::positive) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(plane);
    if (eigen.eigenvalues()[0] < 0) plane = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
    if (npp < 0 || nqq < 0 || npp * nqq < npq * npq) {
      const double mean = 0.5 * (npp + nqq), half = 0.5 * (npp - nqq), radius = std::hypot(half, npq);
      const double high = std::max(mean + radius, 0.0), low = std::max(mean - radius, 0.0);
      const double cos2 = radius > 0 ? half / radius : 1, sin2 = radius > 0 ? npq / radius : 0;
      npp = 0.5 * (high + low) + 0.5 * (high - low) * cos2;
      nqq = 0.5 * (high + low) - 0.5 * (high - low) * cos2;
      npq = 0.5 * (high - low) * sin2;
    }
  }
  Eigen::Matrix<double, 3, 2> e;
  e << e1, e2;
  const Matrix3d normal = e3 * e3.transpose();
  return {e * plane.topLeftCorner<2, 2>() * e.transpose() + npp * normal, e * plane.topRightCorner<2, 2>() * e.transpose() + npq * normal,
          e * plane.bottomRightCorner<2, 2>() * e.transpose() + nqq * normal};
}

/// stiffness/2 angle^2 as a function of the cosine of the turning angle.
struct Turning {
  double energy, slope, curve;
};

Turning turning(double stiffness, const Directions& d) {
  const double sine = d.p.cross(d.q).norm(), angle = std::atan2(sine, d.cosine);
  if (angle < 1e-3) {
    // angle/sin(angle) and its derivative; the closed forms cancel here
    return {0.5 * stiffness * angle * angle, -stiffness * (1 + angle * angle / 6), stiffness * (1.0 / 3 + angle * angle * 2 / 15)};
  }
  const double s = std::max(sine, 1e-9);
  return {0.5 * stiffness * angle * angle, -stiffness * angle / s, stiffness * (s - angle * d.cosine) / (s * s * s)};
}

// --- hinges ---------------------------------------------------------------------------------------------------------------

/// Angle of two triangles on the edge v0-v1 with opposite corners o0 (left of the edge, seen from the face side) and o1;
/// positive where the face sides turn towards each other; and its gradient, in the order v0, v1, o0, o1.
template <class Scalar>
Scalar hinge_angle(const Eigen::Matrix<Scalar, 12, 1>& x, Eigen::Matrix<Scalar, 12, 1>& gradient) {
  using V = Eigen::Matrix<Scalar, 3, 1>;
  using std::atan2;
  using std::sqrt;
  const V v0 = x.template segment<3>(0), v1 = x.template segment<3>(3), o0 = x.template segment<3>(6), o1 = x.template segment<3>(9);
  const V e = v1 - v0, a = o0 - v0, b = o1 - v0;
  const V n0 = e.cross(a), n1 = b.cross(e);
  const Scalar ee = e.dot(e), length = sqrt(ee), n0_sq = n0.dot(n0), n1_sq = n1.dot(n1);
  // n/height = N length / |N|^2
  const Scalar s0 = length / n0_sq, s1 = length / n1_sq;
  const V g0 = n0 * s0, g1 = n1 * s1;
  const Scalar t0 = a.dot(e) / ee, t1 = b.dot(e) / ee;
  const V gv1 = -(g0 * t0 + g1 * t1), gv0 = -(g0 + g1) - gv1;
  gradient.template segment<3>(0) = gv0;
  gradient.template segment<3>(3) = gv1;
  gradient.template segment<3>(6) = g0;
  gradient.template segment<3>(9) = g1;
  const V cross = n1.cross(n0);
  return atan2(Scalar(cross.dot(e) / length), Scalar(n0.dot(n1)));
}

Eigen::Matrix<double, 12, 1> hinge_points(const Points3& x, const std::array<int, 4>& node) {
  Eigen::Matrix<double, 12, 1> points;
  for (int k = 0; k < 4; ++k) points.segment<3>(3 * k) = point(x, node[static_cast<std::size_t>(k)]);
  return points;
}

Eigen::Matrix<double, 12, 12> hinge_second_derivative(const Eigen::Matrix<double, 12, 1>& x) {
  using Scalar = Eigen::AutoDiffScalar<Eigen::Matrix<double, 12, 1>>;
  Eigen::Matrix<Scalar, 12, 1> points, gradient;
  for (int i = 0; i < 12; ++i) points[i] = Scalar(x[i], 12, i);
  hinge_angle(points, gradient);
  Eigen::Matrix<double, 12, 12> result;
  for (int i = 0; i < 12; ++i) result.row(i) = gradient[i].derivatives().transpose();
  return result;
}

// --- building -----------------------------------------------------------------------------------------------------------------

/// Constants of one fabric as the model takes them.
struct Sheetlike {
  double weft, warp, shear, bending_weft, bending_warp;
};

Sheetlike constants_of(const fabric::Card& card, Modulus modulus) {
  const auto stiffness = [&](const fabric::YarnDirection& yarn) {
    const fabric::TensileCurve curve = fabric::tensile_curve(card, yarn);
    return modulus == Modulus::initial ? curve.slope_zero : card.tensile_force_max / fabric::strain_at(curve, card.tensile_force_max);
  };
  return {stiffness(card.weft), stiffness(card.warp), card.shear, card.weft.bending, card.warp.bending};
}

/// A rectangle of two triangles along the yarns.
struct Cell {
  std::array<int, 4> vertex;  ///< 00, 10, 01, 11
  double u, v;                ///< sides [m]
  int laminate, face_a, face_b;
};

std::vector<Cell> find_cells(const mesh::GarmentMesh& garment) {
  constexpr double aligned = 1e-6;
  std::vector<Cell> cells;
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    if (edge.faces.size() != 2) continue;
    const int f = edge.faces[0], g = edge.faces[1];
    if (garment.face_laminate[f] != garment.face_laminate[g]) continue;
    const auto opposite = [&](int face) {
      for (int k = 0; k < 3; ++k) {
        const int v = garment.faces(face, k);
        if (v != edge.a && v != edge.b) return v;
      }
      return -1;
    };
    std::array<int, 4> vertex{edge.a, edge.b, opposite(f), opposite(g)};
    const Eigen::RowVector2d size = (garment.uv.row(edge.b) - garment.uv.row(edge.a)).cwiseAbs();
    if (size.minCoeff() < 0.05 * size.maxCoeff()) continue;
    const Eigen::RowVector2d low = garment.uv.row(edge.a).cwiseMin(garment.uv.row(edge.b));
    Cell cell{{-1, -1, -1, -1}, size.x(), size.y(), garment.face_laminate[f], f, g};
    for (int v : vertex) {
      for (int k = 0; k < 4; ++k) {
        const Eigen::RowVector2d place(low.x() + (k & 1 ? size.x() : 0), low.y() + (k & 2 ? size.y() : 0));
        if ((garment.uv.row(v) - place).norm() < aligned * size.maxCoeff()) cell.vertex[static_cast<std::size_t>(k)] = v;
      }
    }
    if (*std::min_element(cell.vertex.begin(), cell.vertex.end()) >= 0) cells.push_back(cell);
  }
  return cells;
}

void bucket(int buckets, const std::vector<std::pair<int, int>>& items, std::vector<int>& start, std::vector<int>& list) {
  start.assign(static_cast<std::size_t>(buckets) + 1, 0);
  for (const auto& [key, value] : items) ++start[static_cast<std::size_t>(key) + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  list.resize(items.size());
  std::vector<int> next(start.begin(), start.end() - 1);
  for (const auto& [key, value] : items) list[static_cast<std::size_t>(next[static_cast<std::size_t>(key)]++)] = value;
}

using Pair = std::pair<int, int>;
Pair ordered(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

/// Part indices of the element kinds, in the order in which ParticleResponse::part holds them.
struct Parts {
  std::size_t cells, bends, hinges, links, count;
  explicit Parts(const ParticleModel& m)
      : cells(m.springs.size()), bends(cells + 4 * m.cells.size()), hinges(bends + 3 * m.bends.size()), links(hinges + 4 * m.hinges.size()), count(links + m.links.size()) {}
};

/// Likewise of the stored second derivatives: springs 1, cells and hinges 10, bends 6 (upper triangle of blocks, by rows).
struct Stores {
  std::size_t cells, bends, hinges, links, count;
  explicit Stores(const ParticleModel& m)
      : cells(m.springs.size()), bends(cells + 10 * m.cells.size()), hinges(bends + 6 * m.bends.size()), links(hinges + 10 * m.hinges.size()), count(links) {}
};

/// Index of block (a, b), a <= b, among the stored ones of an element with n nodes.
constexpr std::size_t upper(std::size_t a, std::size_t b, std::size_t n) { return a * n - a * (a + 1) / 2 + b; }

void link_structure(ParticleModel& m) {
  const Parts parts(m);
  std::vector<Pair> items;
  const auto add = [&](int node, std::size_t part, int subtract) { items.push_back({node, 2 * static_cast<int>(part) + subtract}); };
  for (std::size_t i = 0; i < m.springs.size(); ++i) {
    add(m.springs.a[i], i, 0);
    add(m.springs.b[i], i, 1);
  }
  for (std::size_t i = 0; i < m.cells.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) add(m.cells.node[i][k], parts.cells + 4 * i + k, 0);
  }
  for (std::size_t i = 0; i < m.bends.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) add(m.bends.node[i][k], parts.bends + 3 * i + k, 0);
  }
  for (std::size_t i = 0; i < m.hinges.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) add(m.hinges.node[i][k], parts.hinges + 4 * i + k, 0);
  }
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    add(m.links[i].a, parts.links + i, 0);
    add(m.links[i].b, parts.links + i, 1);
  }
  bucket(m.node_count, items, m.node_part_start, m.node_part);

  // Pattern of the second derivative.
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(m.node_count));
  const auto couple = [&](int a, int b) {
    neighbours[static_cast<std::size_t>(a)].push_back(b);
    if (a != b) neighbours[static_cast<std::size_t>(b)].push_back(a);
  };
  const auto couple_all = [&](const auto& nodes) {
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      for (std::size_t b = a; b < nodes.size(); ++b) couple(nodes[a], nodes[b]);
    }
  };
  for (int i = 0; i < m.node_count; ++i) couple(i, i);
  for (std::size_t i = 0; i < m.springs.size(); ++i) couple(m.springs.a[i], m.springs.b[i]);
  for (const auto& nodes : m.cells.node) couple_all(nodes);
  for (const auto& nodes : m.bends.node) couple_all(nodes);
  for (const auto& nodes : m.hinges.node) couple_all(nodes);
  for (const Link& link : m.links) couple(link.a, link.b);
  m.row_start.assign(1, 0);
  m.column.clear();
  m.diagonal.clear();
  for (int i = 0; i < m.node_count; ++i) {
    auto& row = neighbours[static_cast<std::size_t>(i)];
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    m.diagonal.push_back(static_cast<int>(m.column.size() + static_cast<std::size_t>(std::lower_bound(row.begin(), row.end(), i) - row.begin())));
    m.column.insert(m.column.end(), row.begin(), row.end());
    m.row_start.push_back(static_cast<int>(m.column.size()));
  }
  const auto slot = [&](int i, int j) {
    const auto begin = m.column.begin() + m.row_start[static_cast<std::size_t>(i)], end = m.column.begin() + m.row_start[static_cast<std::size_t>(i) + 1];
    return static_cast<int>(std::lower_bound(begin, end, j) - m.column.begin());
  };
  items.clear();
  const auto store = [&](const auto& nodes, std::size_t first) {
    const std::size_t n = nodes.size();
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        items.push_back({slot(nodes[a], nodes[b]), 2 * static_cast<int>(first + upper(std::min(a, b), std::max(a, b), n)) + (a > b ? 1 : 0)});
      }
    }
  };
  const Stores stores(m);
  for (std::size_t i = 0; i < m.cells.size(); ++i) store(m.cells.node[i], stores.cells + 10 * i);
  for (std::size_t i = 0; i < m.bends.size(); ++i) store(m.bends.node[i], stores.bends + 6 * i);
  for (std::size_t i = 0; i < m.hinges.size(); ++i) store(m.hinges.node[i], stores.hinges + 10 * i);
  bucket(static_cast<int>(m.column.size()), items, m.block_part_start, m.block_part);
}

std::size_t slot_of(const BlockMatrix& matrix, int i, int j) {
  const auto begin = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(i)], end = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(i) + 1];
  return static_cast<std::size_t>(std::lower_bound(begin, end, j) - matrix.column.begin());
}

}  // namespace

double direction_modulus(double weft, double warp, double shear, double angle) {
  const double c = std::cos(angle) * std::cos(angle), s = 1 - c;
  return 1 / (c * c / weft + s * s / warp + c * s / shear);
}

CellConstants cell_constants(const fabric::Card& card, double cell_u, double cell_v, double angle, Modulus modulus) {
  const Sheetlike c = constants_of(card, modulus);
  return {c.weft * cell_v / cell_u, c.warp * cell_u / cell_v, c.shear * cell_u * cell_v * std::cos(angle), c.bending_weft * cell_v / cell_u, c.bending_warp * cell_u / cell_v};
}

Result<ParticleModel> make_particle(const mesh::GarmentMesh& garment, const Ids& node_of_vertex, const ParticleOptions& options) {
  // What can be wrong with a garment is the same for both models, and so are triangles, masses and links.
  SheetOptions sheet_options;
  sheet_options.link_stiffness = options.link_stiffness;
  Result<Sheet> checked = make_sheet(garment, node_of_vertex, sheet_options);
  if (!checked) return checked.issues();
  const Sheet& sheet = *checked;
  ParticleModel m;
  m.node_of_vertex = node_of_vertex;
  m.node_count = node_of_vertex.size() == 0 ? 0 : node_of_vertex.maxCoeff() + 1;
  m.corners = sheet.corners;
  m.mass = sheet.mass.head(m.node_count);
  m.area = sheet.area.head(m.node_count);
  m.links = sheet.links;

  std::vector<Sheetlike> fabrics;
  for (const mesh::Laminate& laminate : garment.laminates) fabrics.push_back(constants_of(laminate.equivalent, options.modulus));
  const auto fabric_of = [&](int laminate) -> const Sheetlike& { return fabrics[static_cast<std::size_t>(laminate)]; };
  const auto node = [&](int vertex) { return node_of_vertex[vertex]; };
  const std::vector<Cell> cells = find_cells(garment);
  std::vector<char> in_cell(static_cast<std::size_t>(garment.face_count()), 0);

  // Springs: stiffness and rest length by pair of vertices, so that the halves of both neighbours come together.
  struct Accumulated {
    double stiffness = 0, length = 0;
  };
  std::map<Pair, Accumulated> edge_springs;
  const auto add_spring = [&](int a, int b, double stiffness) {
    Accumulated& s = edge_springs[ordered(a, b)];
    s.stiffness += stiffness;
    s.length = (garment.uv.row(a) - garment.uv.row(b)).norm();
  };
  struct Corner {
    std::array<int, 4> next{-1, -1, -1, -1};  ///< +u, -u, +v, -v
    double weft = 0, warp = 0;                ///< B times a quarter of each adjacent cell's area
  };
  std::map<int, Corner> grid;
  for (const Cell& cell : cells) {
    const Sheetlike& f = fabric_of(cell.laminate);
    in_cell[static_cast<std::size_t>(cell.face_a)] = in_cell[static_cast<std::size_t>(cell.face_b)] = 1;
    const auto& v = cell.vertex;
    for (const auto& [a, b] : {Pair{v[0], v[1]}, Pair{v[2], v[3]}}) add_spring(a, b, f.weft * 0.5 * cell.v / cell.u);
    for (const auto& [a, b] : {Pair{v[0], v[2]}, Pair{v[1], v[3]}}) add_spring(a, b, f.warp * 0.5 * cell.u / cell.v);
    const double area = cell.u * cell.v;
    m.cells.node.push_back({node(v[0]), node(v[1]), node(v[2]), node(v[3])});
    m.cells.weight.push_back(0.25 * area * f.shear);
    for (std::size_t k = 0; k < 4; ++k) {
      Corner& corner = grid[v[k]];
      corner.next[k & 1 ? 1 : 0] = v[k ^ 1];
      corner.next[k & 2 ? 3 : 2] = v[k ^ 2];
      corner.weft += 0.25 * area * f.bending_weft;
      corner.warp += 0.25 * area * f.bending_warp;
    }
  }
  // The strip: Van Gelder's estimate, or the modulus in the edge's direction.
  for (Eigen::Index face = 0; face < garment.face_count(); ++face) {
    if (in_cell[static_cast<std::size_t>(face)]) continue;
    const Sheetlike& f = fabric_of(garment.face_laminate[face]);
    const double area = sheet.shapes[static_cast<std::size_t>(face)].area;
    for (int k = 0; k < 3; ++k) {
      const int a = garment.faces(face, k), b = garment.faces(face, (k + 1) % 3);
      const Eigen::RowVector2d d = garment.uv.row(b) - garment.uv.row(a);
      const double modulus = options.edges == EdgeEstimate::van_gelder ? 0.5 * (f.weft + f.warp) : direction_modulus(f.weft, f.warp, f.shear, std::atan2(d.y(), d.x()));
      add_spring(a, b, modulus * area / d.squaredNorm());
    }
  }
  const auto push_spring = [&](int a, int b, double stiffness, double length, bool slack) {
    m.springs.a.push_back(a);
    m.springs.b.push_back(b);
    m.springs.stiffness.push_back(stiffness);
    m.springs.length.push_back(length);
    m.springs.slack.push_back(slack);
  };
  for (const auto& [pair, s] : edge_springs) push_spring(node(pair.first), node(pair.second), s.stiffness, s.length, false);
  m.cloth_springs = m.springs.size();
  for (const mesh::TrimSegment& segment : garment.trim_segments) {
    const mesh::Trim& trim = garment.trims[static_cast<std::size_t>(segment.trim)];
    const int a = node(segment.a), b = node(segment.b);
    if (a != b && trim.stretch > 0 && segment.rest_length > 0) push_spring(a, b, trim.stretch / segment.rest_length, segment.rest_length, trim.slack);
  }
  for (const mesh::Fastener& fastener : garment.fasteners) {
    const int a = node(fastener.a), b = node(fastener.b);
    const bool pulls = a != b && fastener.closed;
    m.fastener_spring.push_back(pulls ? static_cast<int>(m.springs.size()) : -1);
    if (pulls) push_spring(a, b, fastener.stiffness > 0 ? fastener.stiffness : options.fastener_stiffness, fastener.length, true);
  }

  // Edges that are bent at rest, or stiffer.
  struct Crease {
    double rest, factor;
  };
  std::map<Pair, Crease> creases;
  std::map<int, std::array<bool, 2>> creased;  // vertices whose bending across a fold is the fold's: along u, along v
  for (const mesh::Hinge& hinge : garment.hinges) {
    if (hinge.rest_angle == 0 && hinge.factor == 1) continue;
    creases[ordered(node(hinge.v0), node(hinge.v1))] = {hinge.rest_angle, hinge.factor};
    const Eigen::RowVector2d d = (garment.uv.row(hinge.v1) - garment.uv.row(hinge.v0)).cwiseAbs();
    for (int v : {hinge.v0, hinge.v1}) creased[v][d.y() > d.x() ? 0 : 1] = true;
  }

  // Bending along the yarns: torque per turning angle is B width/length, half widths at borders come by themselves.
  for (const auto& [v, corner] : grid) {
    const auto fold = creased.find(v);
    for (int axis = 0; axis < 2; ++axis) {
      const int after = corner.next[static_cast<std::size_t>(2 * axis)], before = corner.next[static_cast<std::size_t>(2 * axis + 1)];
      if (after < 0 || before < 0 || (fold != creased.end() && fold->second[static_cast<std::size_t>(axis)])) continue;
      const double mean = 0.5 * (garment.uv(after, axis) - garment.uv(before, axis));
      m.bends.node.push_back({node(before), node(v), node(after)});
      m.bends.stiffness.push_back((axis == 0 ? corner.weft : corner.warp) / (mean * mean));
    }
  }

  // Bending over the strip's edges, seams and folds.
  std::map<Pair, double> seam_factor;
  for (std::size_t i = 1; i < garment.welds.size(); ++i) {
    const mesh::Weld &weld = garment.welds[i], &last = garment.welds[i - 1];
    if (weld.seam != last.seam || node(weld.a) != node(weld.b) || node(last.a) != node(last.b) || node(weld.a) == node(last.a)) continue;
    seam_factor[ordered(node(weld.a), node(last.a))] = garment.seams[static_cast<std::size_t>(weld.seam)].bending_factor;
  }
  mesh::Triangles faces(garment.face_count(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = m.corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
  }
  for (const mesh::Edge& edge : mesh::edges(faces)) {
    if (edge.faces.size() < 2) continue;
    struct Side {
      int face, opposite;
      bool forward;         ///< runs a -> b
      double bending, length_sq, area;
    };
    std::vector<Side> sides;
    for (int face : edge.faces) {
      for (int k = 0; k < 3; ++k) {
        const int p = faces(face, k), q = faces(face, (k + 1) % 3);
        if (ordered(p, q) != Pair{edge.a, edge.b}) continue;
        const Eigen::RowVector2d d = garment.uv.row(garment.faces(face, (k + 1) % 3)) - garment.uv.row(garment.faces(face, k));
        const Sheetlike& f = fabric_of(garment.face_laminate[face]);
        const double length_sq = d.squaredNorm();
        sides.push_back({face, faces(face, (k + 2) % 3), p == edge.a, (f.bending_weft * d.y() * d.y() + f.bending_warp * d.x() * d.x()) / length_sq, length_sq, sheet.shapes[static_cast<std::size_t>(face)].area});
        break;
      }
    }
    const auto crease = creases.find({edge.a, edge.b});
    const auto seam = seam_factor.find({edge.a, edge.b});
    for (std::size_t i = 0; i < sides.size(); ++i) {
      for (std::size_t j = i + 1; j < sides.size(); ++j) {
        const Side &s = sides[i], &t = sides[j];
        const bool one_panel = garment.face_panel[s.face] == garment.face_panel[t.face] && seam == seam_factor.end();
        if (one_panel && crease == creases.end() && in_cell[static_cast<std::size_t>(s.face)] && in_cell[static_cast<std::size_t>(t.face)]) continue;
        if (s.opposite == t.opposite) continue;
        const Side &first = s.forward ? s : t, &second = s.forward ? t : s;
        double stiffness = 0.5 * (s.bending + t.bending) * 0.5 * (s.length_sq + t.length_sq) / (s.area + t.area) / static_cast<double>(sides.size() - 1);
        if (seam != seam_factor.end()) stiffness *= seam->second;
        if (crease != creases.end()) stiffness *= crease->second.factor;
        m.hinges.node.push_back({edge.a, edge.b, first.opposite, second.opposite});
        m.hinges.stiffness.push_back(stiffness);
        m.hinges.rest.push_back(crease != creases.end() ? crease->second.rest : 0);
      }
    }
  }
  link_structure(m);
  return m;
}

void scale_links(ParticleModel& model, double factor) {
  for (Link& link : model.links) link.stiffness *= factor;
}

namespace {

double difference(double angle, double rest) {
  // A sheet that is folded over does not unwind the long way round.
  double d = angle - rest;
  while (d > M_PI) d -= 2 * M_PI;
  while (d < -M_PI) d += 2 * M_PI;
  return d;
}

struct SpringState {
  Vector3d along;  // a - b
  double length, stretch;
};

SpringState spring_state(const ParticleModel& m, const Points3& x, std::size_t i) {
  SpringState s;
  s.along = point(x, m.springs.a[i]) - point(x, m.springs.b[i]);
  s.length = std::max(s.along.norm(), least_length);
  s.stretch = s.length - m.springs.length[i];
  if (m.springs.slack[i] && s.stretch < 0) s.stretch = 0;
  return s;
}

struct CellEdges {
  Vector3d u[2], v[2];  // bottom and top along u, left and right along v
};

CellEdges cell_edges(const ParticleModel& m, const Points3& x, std::size_t i) {
  const auto& n = m.cells.node[i];
  const Vector3d x00 = point(x, n[0]), x10 = point(x, n[1]), x01 = point(x, n[2]), x11 = point(x, n[3]);
  return {{x10 - x00, x11 - x01}, {x01 - x00, x11 - x10}};
}

// Corner (i, j): i = 1 at the end of u, j = 1 at the end of v. Its edges are u[j] and v[i].
constexpr std::array<std::array<int, 2>, 4> corner_edges{{{0, 0}, {0, 1}, {1, 0}, {1, 1}}};  // {u, v} of corners 00, 10, 01, 11

const fabric::ShearCurve unit_shear{1.0};

}  // namespace

SheetEnergy energy(const ParticleModel& m, const Points3& x, const Points3& link_offset) {
  SheetEnergy result;
  const auto add = [](double a, double b) { return a + b; };
  const auto springs = [&](std::size_t from, std::size_t to) {
    return parallel_reduce(to - from, grain, 0.0, [&](std::size_t begin, std::size_t end) {
      double sum = 0;
      for (std::size_t i = from + begin; i < from + end; ++i) {
        const SpringState s = spring_state(m, x, i);
        sum += 0.5 * m.springs.stiffness[i] * s.stretch * s.stretch;
      }
      return sum;
    }, add);
  };
  result.membrane = springs(0, m.cloth_springs) + parallel_reduce(m.cells.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const CellEdges e = cell_edges(m, x, i);
      for (const auto& [a, b] : corner_edges) sum += m.cells.weight[i] * unit_shear.at(directions(e.u[a], e.v[b]).cosine).energy;
    }
    return sum;
  }, add);
  result.bending = parallel_reduce(m.bends.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto& n = m.bends.node[i];
      const Vector3d at = point(x, n[1]);
      sum += turning(m.bends.stiffness[i], directions(at - point(x, n[0]), point(x, n[2]) - at)).energy;
    }
    return sum;
  }, add);
  for (std::size_t i = 0; i < m.hinges.size(); ++i) {
    Eigen::Matrix<double, 12, 1> g;
    const double d = difference(hinge_angle<double>(hinge_points(x, m.hinges.node[i]), g), m.hinges.rest[i]);
    result.bending += 0.5 * m.hinges.stiffness[i] * d * d;
  }
  result.links = springs(m.cloth_springs, m.springs.size());
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    const Link& link = m.links[i];
    result.links += 0.5 * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  return result;
}

void gradient(const ParticleModel& m, const Points3& x, const Points3& link_offset, ParticleResponse& r) {
  const Parts parts(m);
  r.part.resize(parts.count);
  r.gradient.resize(m.node_count, 3);
  // One loop over all elements: a few chunks of each kind, so that both processors have something to do.
  parallel_for(m.springs.size(), 2 * grain, [&](std::size_t i) {
    const SpringState s = spring_state(m, x, i);
    r.part[i] = m.springs.stiffness[i] * s.stretch / s.length * s.along;
  });
  parallel_for(m.cells.size(), grain, [&](std::size_t i) {
    const CellEdges e = cell_edges(m, x, i);
    double length[2][2];
    Vector3d unit[2][2], force[2][2];
    for (int k = 0; k < 2; ++k) {
      length[0][k] = std::max(e.u[k].norm(), least_length);
      length[1][k] = std::max(e.v[k].norm(), least_length);
      unit[0][k] = e.u[k] / length[0][k];
      unit[1][k] = e.v[k] / length[1][k];
      force[0][k].setZero();
      force[1][k].setZero();
    }
    for (const auto& [a, b] : corner_edges) {
      const double s = std::clamp(unit[0][a].dot(unit[1][b]), -1.0, 1.0), f = m.cells.weight[i] * unit_shear.at(s).force;
      force[0][a] += f / length[0][a] * (unit[1][b] - s * unit[0][a]);
      force[1][b] += f / length[1][b] * (unit[0][a] - s * unit[1][b]);
    }
    Vector3d* part = &r.part[parts.cells + 4 * i];
    part[0] = -force[0][0] - force[1][0];
    part[1] = force[0][0] - force[1][1];
    part[2] = -force[0][1] + force[1][0];
    part[3] = force[0][1] + force[1][1];
  });
  parallel_for(m.bends.size(), grain, [&](std::size_t i) {
    const auto& n = m.bends.node[i];
    const Vector3d at = point(x, n[1]);
    const Directions d = directions(at - point(x, n[0]), point(x, n[2]) - at);
    const double slope = turning(m.bends.stiffness[i], d).slope;
    const Vector3d p = slope / d.p_length * (d.q - d.cosine * d.p), q = slope / d.q_length * (d.p - d.cosine * d.q);
    Vector3d* part = &r.part[parts.bends + 3 * i];
    part[0] = -p;
    part[1] = p - q;
    part[2] = q;
  });
  parallel_for(m.hinges.size(), grain / 2, [&](std::size_t i) {
    Eigen::Matrix<double, 12, 1> g;
    const double d = difference(hinge_angle<double>(hinge_points(x, m.hinges.node[i]), g), m.hinges.rest[i]);
    g *= m.hinges.stiffness[i] * d;
    for (int k = 0; k < 4; ++k) r.part[parts.hinges + 4 * i + static_cast<std::size_t>(k)] = g.segment<3>(3 * k);
  });
  for (std::size_t i = 0; i < m.links.size(); ++i) {
    const Link& link = m.links[i];
    r.part[parts.links + i] = link.stiffness * (point(x, link.a) - point(x, link.b) - point(link_offset, static_cast<int>(i)));
  }
  parallel_for(static_cast<std::size_t>(m.node_count), grain, [&](std::size_t i) {
    Vector3d sum = Vector3d::Zero();
    for (int k = m.node_part_start[i]; k < m.node_part_start[i + 1]; ++k) {
      const int item = m.node_part[static_cast<std::size_t>(k)];
      const Vector3d& part = r.part[static_cast<std::size_t>(item / 2)];
      if (item & 1) sum -= part;
      else sum += part;
    }
    r.gradient.row(static_cast<Eigen::Index>(i)) = sum.transpose();
  });
}

void evaluate(const ParticleModel& m, const Points3& x, const Points3& link_offset, std::optional<Curvature> curvature, ParticleResponse& r) {
  r.energy = energy(m, x, link_offset);
  gradient(m, x, link_offset, r);
  if (!curvature) return;
  const Stores stores(m);
  r.block.resize(stores.count);
  parallel_for(m.springs.size(), grain, [&](std::size_t i) {
    const SpringState s = spring_state(m, x, i);
    const Vector3d d = s.along / s.length;
    const Matrix3d along = d * d.transpose();
    double across = s.stretch / s.length;
    if (*curvature == Curvature::positive) across = std::max(across, 0.0);
    const bool loose = m.springs.slack[i] && s.length < m.springs.length[i];
    if (loose) r.block[i].setZero();
    else r.block[i] = m.springs.stiffness[i] * (along + across * (Matrix3d::Identity() - along));
  });
  parallel_for(m.cells.size(), grain / 4, [&](std::size_t i) {
    const CellEdges e = cell_edges(m, x, i);
    Matrix3d* block = &r.block[stores.cells + 10 * i];
    for (int k = 0; k < 10; ++k) block[k].setZero();
    // Edge vectors as differences of nodes: {plus, minus}.
    constexpr std::array<std::array<int, 2>, 2> u_nodes{{{1, 0}, {3, 2}}}, v_nodes{{{2, 0}, {3, 1}}};
    for (const auto& [a, b] : corner_edges) {
      const Directions d = directions(e.u[a], e.v[b]);
      const fabric::CurvePoint shear = unit_shear.at(d.cosine);
      const AngleBlocks h = angle_blocks(d, m.cells.weight[i] * shear.force, m.cells.weight[i] * shear.slope, *curvature);
      const auto add = [&](const std::array<int, 2>& p, const std::array<int, 2>& q, const Matrix3d& value) {
        for (int k = 0; k < 2; ++k) {
          for (int l = 0; l < 2; ++l) {
            const double sign = k == l ? 1 : -1;
            const auto s = static_cast<std::size_t>(p[static_cast<std::size_t>(k)]), t = static_cast<std::size_t>(q[static_cast<std::size_t>(l)]);
            if (s <= t) block[upper(s, t, 4)] += sign * value;
          }
        }
      };
      const auto &p = u_nodes[static_cast<std::size_t>(a)], &q = v_nodes[static_cast<std::size_t>(b)];
      add(p, p, h.pp);
      add(q, q, h.qq);
      add(p, q, h.pq);
      add(q, p, h.pq.transpose());
    }
  });
  parallel_for(m.bends.size(), grain / 2, [&](std::size_t i) {
    const auto& n = m.bends.node[i];
    const Vector3d at = point(x, n[1]);
    const Directions d = directions(at - point(x, n[0]), point(x, n[2]) - at);
    const Turning t = turning(m.bends.stiffness[i], d);
    const AngleBlocks h = angle_blocks(d, t.slope, t.curve, *curvature);
    Matrix3d* block = &r.block[stores.bends + 6 * i];
    block[upper(0, 0, 3)] = h.pp;
    block[upper(0, 1, 3)] = h.pq - h.pp;
    block[upper(0, 2, 3)] = -h.pq;
    block[upper(1, 1, 3)] = h.pp - h.pq - h.pq.transpose() + h.qq;
    block[upper(1, 2, 3)] = h.pq - h.qq;
    block[upper(2, 2, 3)] = h.qq;
  });
  parallel_for(m.hinges.size(), grain / 8, [&](std::size_t i) {
    const Eigen::Matrix<double, 12, 1> points = hinge_points(x, m.hinges.node[i]);
    Eigen::Matrix<double, 12, 1> g;
    const double d = difference(hinge_angle<double>(points, g), m.hinges.rest[i]), k = m.hinges.stiffness[i];
    Eigen::Matrix<double, 12, 12> h = k * g * g.transpose();
    if (*curvature == Curvature::exact) h += k * d * hinge_second_derivative(points);
    Matrix3d* block = &r.block[stores.hinges + 10 * i];
    for (int a = 0; a < 4; ++a) {
      for (int b = a; b < 4; ++b) block[upper(static_cast<std::size_t>(a), static_cast<std::size_t>(b), 4)] = h.block<3, 3>(3 * a, 3 * b);
    }
  });

  BlockMatrix& matrix = r.matrix;
  if (matrix.value.size() != m.column.size()) {
    matrix.row_start = m.row_start;
    matrix.column = m.column;
    matrix.diagonal = m.diagonal;
    matrix.value.resize(m.column.size());
  }
  parallel_for(m.column.size(), grain, [&](std::size_t slot) {
    Matrix3d sum = Matrix3d::Zero();
    for (int k = m.block_part_start[slot]; k < m.block_part_start[slot + 1]; ++k) {
      const int item = m.block_part[static_cast<std::size_t>(k)];
      const Matrix3d& block = r.block[static_cast<std::size_t>(item / 2)];
      if (item & 1) sum += block.transpose();
      else sum += block;
    }
    matrix.value[slot] = Block::from(sum);
  });
  const auto add_pair = [&](int a, int b, const Block& h) {
    const auto add = [&](int i, int j, float sign) {
      Block& target = matrix.value[slot_of(matrix, i, j)];
      for (int c = 0; c < 3; ++c) target.column[c] += splat(sign) * h.column[c];
    };
    add(a, a, 1);
    add(b, b, 1);
    add(a, b, -1);
    add(b, a, -1);
  };
  for (std::size_t i = 0; i < m.springs.size(); ++i) add_pair(m.springs.a[i], m.springs.b[i], Block::from(r.block[i]));
  for (const Link& link : m.links) add_pair(link.a, link.b, Block::from(link.stiffness * Matrix3d::Identity()));
}

double frequency_bound(const BlockMatrix& matrix, const Eigen::VectorXd& masses) {
  return std::sqrt(parallel_reduce(static_cast<std::size_t>(matrix.rows()), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double most = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double mass = masses[static_cast<Eigen::Index>(i)];
      if (!(mass > 0)) continue;
      // Row sums of M^-1/2 H M^-1/2, block by block in the Frobenius norm.
      double sum = 0;
      for (int k = matrix.row_start[i]; k < matrix.row_start[i + 1]; ++k) {
        const double other = masses[matrix.column[static_cast<std::size_t>(k)]];
        if (other > 0) sum += matrix.value[static_cast<std::size_t>(k)].matrix().norm() / std::sqrt(mass * other);
      }
      most = std::max(most, sum);
    }
    return most;
  }, [](double a, double b) { return std::max(a, b); }));
}

double frequency_bound(const ParticleModel& m, const Points3& x) {
  ParticleResponse response;
  const Points3 offset = Points3::Zero(static_cast<Eigen::Index>(m.links.size()), 3);
  evaluate(m, x, offset, Curvature::positive, response);
  return frequency_bound(response.matrix, m.mass);
}

}  // namespace toile::mechanics
