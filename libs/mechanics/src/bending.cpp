#include "bending.h"

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace toile::mechanics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

void add(LinearForm& form, int node, double coefficient) {
  for (auto& [n, c] : form) {
    if (n == node) {
      c += coefficient;
      return;
    }
  }
  form.emplace_back(node, coefficient);
}

void add(LinearForm& form, const LinearForm& other, double factor) {
  for (const auto& [n, c] : other) add(form, n, factor * c);
}

/// D of a fabric on (K_uu, K_vv, K_uv).
Vector3d rigidities(const fabric::Constitutive& fabric) { return {fabric.bending_weft, fabric.bending_warp, 4 * fabric.bending_twist}; }

/// Moment per curvature across a line with this unit normal.
double rigidity_across(const fabric::Constitutive& fabric, const Vector2d& normal) {
  const double uu = normal.x() * normal.x(), vv = normal.y() * normal.y();
  return rigidities(fabric).dot(Vector3d(uu * uu, vv * vv, uu * vv));
}

/// Everything that is looked up more than once.
class Builder {
 public:
  Builder(const mesh::GarmentMesh& garment, const Sheet& sheet, const std::map<std::pair<int, int>, double>& seam_factor)
      : garment_(garment), sheet_(sheet), seam_factor_(seam_factor) {}

  BendingForms build() {
    find_edges();
    find_cells();
    add_grid();
    find_slopes();
    add_triangles();
    result_.in_cell = std::move(in_cell_);
    return std::move(result_);
  }

 private:
  /// What happens to the slope across an edge of a face: border and crease leave it free, smooth sides share one.
  enum class Join { border, smooth, crease, several };
  struct Side {
    int face = -1, corner = -1;  // the edge runs from that corner to the next
  };
  struct Edge {
    int a, b;
    Join join = Join::border;
    std::vector<Side> sides;
  };
  struct Conormal {
    Vector3d slope;  // outward derivative as coefficients of the corners [1/m]
    double length;
    Vector2d normal;
  };
  /// A face laid into the plane of another one's panel coordinates: p = turn * uv + shift.
  struct Placed {
    int face;
    Eigen::Matrix2d turn;
    Vector2d shift;
  };

  int node(int vertex) const { return sheet_.node_of_vertex[vertex]; }
  int vertex(int face, int corner) const { return garment_.faces(face, corner % 3); }
  const fabric::Constitutive& fabric(int face) const { return sheet_.fabrics[static_cast<std::size_t>(fabric_id(face))]; }
  int fabric_id(int face) const { return sheet_.fabric_of_face[static_cast<std::size_t>(face)]; }
  double area(int face) const { return sheet_.shapes[static_cast<std::size_t>(face)].area; }

  Conormal conormal(int face, int corner) const {
    const TriangleShape& shape = sheet_.shapes[static_cast<std::size_t>(face)];
    const Vector2d edge = (garment_.uv.row(vertex(face, corner + 1)) - garment_.uv.row(vertex(face, corner))).transpose();
    Conormal result;
    result.length = edge.norm();
    result.normal = Vector2d(edge.y(), -edge.x()) / result.length;
    for (std::size_t c = 0; c < 3; ++c) result.slope[static_cast<Eigen::Index>(c)] = shape.slope_u[c] * result.normal.x() + shape.slope_v[c] * result.normal.y();
    return result;
  }
  void add_slope(LinearForm& form, int face, const Vector3d& slope, double factor) const {
    for (int c = 0; c < 3; ++c) add(form, sheet_.corners[static_cast<std::size_t>(face)][static_cast<std::size_t>(c)], factor * slope[c]);
  }

  void find_edges();
  void find_cells();
  void add_grid();
  LinearForm derivative(int vertex, int axis) const;
  void find_slopes();
  std::vector<Placed> patch(const Edge& edge, int rings) const;
  LinearForm fitted_slope(const Edge& edge) const;
  void balance_slopes();
  void add_triangles();
  std::array<LinearForm, 3> curvature(int face, int without) const;
  Matrix3d condensed(int face) const;
  void add_hinge(const Side& first, const Side& second, double rest, double factor);

  const mesh::GarmentMesh& garment_;
  const Sheet& sheet_;
  const std::map<std::pair<int, int>, double>& seam_factor_;
  BendingForms result_;

  std::vector<Edge> edges_;
  std::vector<std::array<int, 3>> face_edge_;  // |F|
  std::vector<char> creased_;                  // |nodes|: on a crease
  std::vector<int> director_;                  // |V|: index into Sheet::directors, or -1

  // the grid
  std::vector<char> in_cell_;                  // |F|: done by second differences
  std::vector<std::array<int, 4>> next_;       // |V|: neighbours along +u, -u, +v, -v
  struct Cell {
    int a, b, c, d;  // vertices: a, b the diagonal
    int face;
    double area;
  };
  std::vector<Cell> cells_;
  struct Quarter {  // of the cells on one side of a vertex along an axis
    double area = 0, stiffness = 0;
    int fabric = -1;
  };
  std::vector<std::array<Quarter, 4>> quarters_;  // |V|

  // outward slope across each edge of a face, none where it is free
  std::vector<std::array<std::optional<LinearForm>, 3>> slope_;  // |F|
};

void Builder::find_edges() {
  mesh::Triangles faces(garment_.face_count(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(f, k) = sheet_.corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
  }
  face_edge_.assign(sheet_.corners.size(), {-1, -1, -1});
  for (const mesh::Edge& edge : mesh::edges(faces)) {
    Edge e{edge.a, edge.b, Join::border, {}};
    for (int f : edge.faces) {
      for (int k = 0; k < 3; ++k) {
        const int p = faces(f, k), q = faces(f, (k + 1) % 3);
        if ((p != edge.a || q != edge.b) && (p != edge.b || q != edge.a)) continue;
        e.sides.push_back({f, k});
        face_edge_[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] = static_cast<int>(edges_.size());
        break;
      }
    }
    if (e.sides.size() == 2) e.join = Join::smooth;
    if (e.sides.size() > 2) e.join = Join::several;
    edges_.push_back(std::move(e));
  }
  const auto find = [&](int a, int b) {
    const auto it = std::lower_bound(edges_.begin(), edges_.end(), std::pair(std::min(a, b), std::max(a, b)), [](const Edge& e, const std::pair<int, int>& key) { return std::tie(e.a, e.b) < std::tie(key.first, key.second); });
    return it != edges_.end() && it->a == std::min(a, b) && it->b == std::max(a, b) ? &*it : nullptr;
  };
  creased_.assign(static_cast<std::size_t>(sheet_.node_count), 0);
  std::set<std::pair<int, int>> hinged;
  for (const mesh::Hinge& hinge : garment_.hinges) {
    const int a = node(hinge.v0), b = node(hinge.v1);
    Edge* edge = find(a, b);
    if (edge == nullptr || edge->sides.size() < 2) continue;  // of a seam that is open still
    hinged.insert({edge->a, edge->b});
    const auto side_of = [&](int corner) {
      for (const Side& side : edge->sides) {
        if (sheet_.corners[static_cast<std::size_t>(side.face)][static_cast<std::size_t>((side.corner + 2) % 3)] == node(corner)) return side;
      }
      return Side{};
    };
    const Side first = side_of(hinge.o0), second = side_of(hinge.o1);
    if (first.face < 0 || second.face < 0) continue;
    const bool bent = hinge.rest_angle != 0 || hinge.factor < 1;
    if (bent) {
      if (edge->join == Join::smooth) edge->join = Join::crease;
      creased_[static_cast<std::size_t>(a)] = creased_[static_cast<std::size_t>(b)] = 1;
      add_hinge(first, second, hinge.rest_angle, hinge.factor);
    } else if (hinge.factor > 1) {
      add_hinge(first, second, 0, hinge.factor - 1);
    }
  }
  for (const auto& [key, factor] : seam_factor_) {
    Edge* edge = find(key.first, key.second);
    if (edge == nullptr || edge->sides.size() != 2 || factor == 1 || hinged.count(key) > 0) continue;
    if (factor < 1) {
      edge->join = Join::crease;
      creased_[static_cast<std::size_t>(edge->a)] = creased_[static_cast<std::size_t>(edge->b)] = 1;
    }
    add_hinge(edge->sides[0], edge->sides[1], 0, factor < 1 ? factor : factor - 1);
  }
  director_.assign(static_cast<std::size_t>(garment_.vertex_count()), -1);
  for (std::size_t i = 0; i < sheet_.directors.size(); ++i) director_[static_cast<std::size_t>(sheet_.directors[i].vertex)] = static_cast<int>(i);
}

/// Stiffness of an edge as a hinge: exact for a cylinder across it, which turns by curvature (A0 + A1) / length.
void Builder::add_hinge(const Side& first, const Side& second, double rest, double factor) {
  const Conormal c0 = conormal(first.face, first.corner), c1 = conormal(second.face, second.corner);
  const double length = 0.5 * (c0.length + c1.length);
  const double compliance = area(first.face) / rigidity_across(fabric(first.face), c0.normal) + area(second.face) / rigidity_across(fabric(second.face), c1.normal);
  HingeElement hinge;
  const auto& f = sheet_.corners[static_cast<std::size_t>(first.face)];
  const auto& g = sheet_.corners[static_cast<std::size_t>(second.face)];
  hinge.node = {f[static_cast<std::size_t>(first.corner)], f[static_cast<std::size_t>((first.corner + 1) % 3)], f[static_cast<std::size_t>((first.corner + 2) % 3)],
                g[static_cast<std::size_t>((second.corner + 2) % 3)]};
  hinge.rest = rest;
  hinge.stiffness = factor * length * length / compliance;
  result_.hinges.push_back(hinge);
}

/// Grid cells: two faces that make a rectangle along the yarns, corners free of seams and creases and either inside the grid or
/// on a border along a yarn.
void Builder::find_cells() {
  const auto nv = static_cast<std::size_t>(garment_.vertex_count());
  in_cell_.assign(sheet_.corners.size(), 0);
  quarters_.resize(nv);
  std::vector<int> sharing(static_cast<std::size_t>(sheet_.node_count), 0);
  for (Eigen::Index v = 0; v < garment_.vertex_count(); ++v) ++sharing[static_cast<std::size_t>(sheet_.node_of_vertex[v])];
  std::vector<double> angle(nv, 0);
  for (Eigen::Index f = 0; f < garment_.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::RowVector2d o = garment_.uv.row(garment_.faces(f, k));
      const Eigen::RowVector2d p = garment_.uv.row(garment_.faces(f, (k + 1) % 3)) - o, q = garment_.uv.row(garment_.faces(f, (k + 2) % 3)) - o;
      angle[static_cast<std::size_t>(garment_.faces(f, k))] += std::atan2(std::abs(p.x() * q.y() - p.y() * q.x()), p.dot(q));
    }
  }
  constexpr double aligned = 1e-6;
  next_.assign(nv, {-1, -1, -1, -1});
  const std::vector<mesh::Edge> edges = mesh::edges(garment_.faces);
  for (const mesh::Edge& edge : edges) {
    const Eigen::RowVector2d d = garment_.uv.row(edge.b) - garment_.uv.row(edge.a);
    const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
    if (std::abs(d.y()) < aligned * std::abs(d.x())) {
      next_[a][d.x() > 0 ? 0 : 1] = edge.b;
      next_[b][d.x() > 0 ? 1 : 0] = edge.a;
    } else if (std::abs(d.x()) < aligned * std::abs(d.y())) {
      next_[a][d.y() > 0 ? 2 : 3] = edge.b;
      next_[b][d.y() > 0 ? 3 : 2] = edge.a;
    }
  }
  const auto regular = [&](int v) {
    const auto i = static_cast<std::size_t>(v);
    if (sharing[static_cast<std::size_t>(node(v))] != 1 || creased_[static_cast<std::size_t>(node(v))]) return false;
    const double quarters = angle[i] / (0.5 * M_PI);
    const auto whole = static_cast<int>(std::lround(quarters));
    if (std::abs(quarters - whole) > 1e-6 || whole == 3) return false;
    const auto count = static_cast<int>(std::count_if(next_[i].begin(), next_[i].end(), [](int n) { return n >= 0; }));
    return count == (whole == 4 ? 4 : whole + 1);
  };
  for (const mesh::Edge& edge : edges) {
    if (edge.faces.size() != 2) continue;
    const int f = edge.faces[0], g = edge.faces[1];
    if (fabric_id(f) != fabric_id(g)) continue;
    const auto opposite = [&](int face) {
      for (int k = 0; k < 3; ++k) {
        const int v = garment_.faces(face, k);
        if (v != edge.a && v != edge.b) return v;
      }
      return -1;
    };
    const int c = opposite(f), d = opposite(g);
    const Eigen::RowVector2d a = garment_.uv.row(edge.a), b = garment_.uv.row(edge.b), size = (b - a).cwiseAbs();
    const double tolerance = aligned * size.maxCoeff();
    if (size.minCoeff() < 0.05 * size.maxCoeff()) continue;
    const auto at = [&](int v, double u, double w) { return (garment_.uv.row(v) - Eigen::RowVector2d(u, w)).norm() < tolerance; };
    if (!((at(c, a.x(), b.y()) && at(d, b.x(), a.y())) || (at(d, a.x(), b.y()) && at(c, b.x(), a.y())))) continue;
    const std::array<int, 4> corner{edge.a, edge.b, c, d};
    if (!std::all_of(corner.begin(), corner.end(), regular)) continue;
    in_cell_[static_cast<std::size_t>(f)] = in_cell_[static_cast<std::size_t>(g)] = 1;
    const double cell_area = size.x() * size.y();
    cells_.push_back({edge.a, edge.b, c, d, f, cell_area});
    const Eigen::RowVector2d middle = 0.5 * (a + b);
    for (int v : corner) {
      for (int axis = 0; axis < 2; ++axis) {
        Quarter& q = quarters_[static_cast<std::size_t>(v)][static_cast<std::size_t>(2 * axis + (middle[axis] > garment_.uv(v, axis) ? 0 : 1))];
        q.area += 0.25 * cell_area;
        q.stiffness += 0.25 * cell_area * (axis == 0 ? fabric(f).bending_weft : fabric(f).bending_warp);
        if (q.fabric < 0) q.fabric = fabric_id(f);
      }
    }
  }
}

/// Slope of the surface along an axis at a grid vertex (or one with a director): where the moments of both sides are in balance.
LinearForm Builder::derivative(int v, int axis) const {
  const auto i = static_cast<std::size_t>(v);
  LinearForm form;
  if (director_[i] >= 0) {
    const Director& d = sheet_.directors[static_cast<std::size_t>(director_[i])];
    add(form, axis == 0 ? d.ghost_u : d.ghost_v, 1 / d.length);
    add(form, d.node, -1 / d.length);
    return form;
  }
  const int after = next_[i][static_cast<std::size_t>(2 * axis)], before = next_[i][static_cast<std::size_t>(2 * axis + 1)];
  const auto chord = [&](int from, int to, double factor) {
    const double length = garment_.uv(to, axis) - garment_.uv(from, axis);
    add(form, node(to), factor / length);
    add(form, node(from), -factor / length);
  };
  if (after < 0 || before < 0) {
    TOILE_CHECK(after >= 0 || before >= 0, "vertex {} has no neighbour along axis {}", v, axis);
    after < 0 ? chord(before, v, 1) : chord(v, after, 1);
    return form;
  }
  const double p = garment_.uv(after, axis) - garment_.uv(v, axis), q = garment_.uv(v, axis) - garment_.uv(before, axis);
  const auto& quarter = quarters_[i];
  const Quarter &plus = quarter[static_cast<std::size_t>(2 * axis)], &minus = quarter[static_cast<std::size_t>(2 * axis + 1)];
  double weight_p = 1 / p, weight_q = 1 / q;
  if (plus.area > 0 && minus.area > 0) {
    // By area: at a corner of the grid the sides have unequal numbers of cells, and the slope is still that of the surface.
    weight_p *= plus.stiffness / plus.area;
    weight_q *= minus.stiffness / minus.area;
  }
  chord(v, after, weight_p / (weight_p + weight_q));
  chord(before, v, weight_q / (weight_p + weight_q));
  return form;
}

void Builder::add_grid() {
  for (int v = 0; v < static_cast<int>(quarters_.size()); ++v) {
    for (int axis = 0; axis < 2; ++axis) {
      const auto& quarter = quarters_[static_cast<std::size_t>(v)];
      const std::array<Quarter, 2> side{quarter[static_cast<std::size_t>(2 * axis)], quarter[static_cast<std::size_t>(2 * axis + 1)]};
      if (side[0].area <= 0 && side[1].area <= 0) continue;
      const int after = next_[static_cast<std::size_t>(v)][static_cast<std::size_t>(2 * axis)], before = next_[static_cast<std::size_t>(v)][static_cast<std::size_t>(2 * axis + 1)];
      const bool held = director_[static_cast<std::size_t>(v)] >= 0;
      if (!held && (after < 0 || before < 0)) continue;  // a free border: no moment across it
      const CurvatureForm::Axis kind = axis == 0 ? CurvatureForm::Axis::weft : CurvatureForm::Axis::warp;
      const LinearForm slope = derivative(v, axis);
      const auto one_side = [&](int k) {
        const int other = k == 0 ? after : before;
        const double length = std::abs(garment_.uv(other, axis) - garment_.uv(v, axis)), sign = k == 0 ? 1 : -1;
        CurvatureForm form;
        add(form.form, node(other), 2 / (length * length));
        add(form.form, node(v), -2 / (length * length));
        add(form.form, slope, -sign * 2 / length);
        form.axis = kind;
        form.vertex = v;
        form.sides = k == 0 ? 1 : 2;
        for (std::size_t i = 0; i < 4; ++i) form.normal[i] = node(next_[static_cast<std::size_t>(v)][i] >= 0 ? next_[static_cast<std::size_t>(v)][i] : v);
        return form;
      };
      const bool even = !held && (side[0].area <= 0 || side[1].area <= 0 ||
                                  std::abs(side[0].stiffness / side[0].area - side[1].stiffness / side[1].area) < 1e-9 * side[0].stiffness / side[0].area);
      if (even) {  // both sides have the same curvature
        CurvatureForm form = one_side(side[0].area > 0 ? 0 : 1);
        form.weight = side[0].area + side[1].area;
        form.sides = (side[0].area > 0 ? 1 : 0) + (side[1].area > 0 ? 2 : 0);
        form.rigidity = (side[0].stiffness + side[1].stiffness) / form.weight;
        form.fabric = side[0].area > 0 ? side[0].fabric : side[1].fabric;
        result_.curvatures.push_back(std::move(form));
        continue;
      }
      for (int k = 0; k < 2; ++k) {
        const Quarter& q = side[static_cast<std::size_t>(k)];
        if (q.area <= 0) continue;
        CurvatureForm form = one_side(k);
        form.weight = q.area;
        form.rigidity = q.stiffness / q.area;
        form.fabric = q.fabric;
        result_.curvatures.push_back(std::move(form));
      }
    }
  }
  for (const Cell& cell : cells_) {
    CurvatureForm form;
    const double sign = (garment_.uv.row(cell.b) - garment_.uv.row(cell.a)).prod() > 0 ? 1 : -1;
    for (const auto& [v, c] : {std::pair(cell.a, 1.0), std::pair(cell.b, 1.0), std::pair(cell.c, -1.0), std::pair(cell.d, -1.0)}) {
      form.form.emplace_back(node(v), sign * c / cell.area);
    }
    form.weight = cell.area;
    form.rigidity = 4 * fabric(cell.face).bending_twist;
    form.axis = CurvatureForm::Axis::twist;
    form.fabric = fabric_id(cell.face);
    form.face = cell.face;
    result_.curvatures.push_back(std::move(form));
  }
}

/// Faces around an edge laid into the panel coordinates of its first side: both sides and, ring by ring, what hangs on them by smooth
/// edges (from the second ring on only around the edge's ends first).
std::vector<Builder::Placed> Builder::patch(const Edge& edge, int rings) const {
  std::vector<Placed> placed{{edge.sides[0].face, Eigen::Matrix2d::Identity(), Vector2d::Zero()}};
  std::set<int> seen{edge.sides[0].face};
  const auto touches = [&](int face) {
    const auto& c = sheet_.corners[static_cast<std::size_t>(face)];
    return std::any_of(c.begin(), c.end(), [&](int n) { return n == edge.a || n == edge.b; });
  };
  const auto unfold = [&](const Placed& from, int corner) -> std::optional<Placed> {
    const Edge& e = edges_[static_cast<std::size_t>(face_edge_[static_cast<std::size_t>(from.face)][static_cast<std::size_t>(corner)])];
    if (e.join != Join::smooth) return {};
    const Side to = e.sides[0].face == from.face ? e.sides[1] : e.sides[0];
    const int p = vertex(from.face, corner), q = vertex(from.face, corner + 1), r = vertex(to.face, to.corner), s = vertex(to.face, to.corner + 1);
    if (p == s && q == r) return Placed{to.face, from.turn, from.shift};
    // Across a seam: the two edges on each other, in the middle if their lengths differ. Node order says which end is which.
    const bool crossed = node(p) == node(s);
    const Vector2d a = from.turn * garment_.uv.row(p).transpose() + from.shift, b = from.turn * garment_.uv.row(q).transpose() + from.shift;
    const Vector2d c = garment_.uv.row(crossed ? s : r).transpose(), d = garment_.uv.row(crossed ? r : s).transpose();
    const Vector2d x = (b - a).normalized(), y = (d - c).normalized();
    const double cosine = x.dot(y), sine = y.x() * x.y() - y.y() * x.x();
    Placed result{to.face, Eigen::Matrix2d::Identity(), Vector2d::Zero()};
    result.turn << cosine, -sine, sine, cosine;
    result.shift = 0.5 * (a + b) - result.turn * (0.5 * (c + d));
    return result;
  };
  if (const auto other = unfold(placed[0], edge.sides[0].corner)) {
    placed.push_back(*other);
    seen.insert(other->face);
  }
  const auto grow = [&](std::size_t first, const auto& wanted) {
    for (std::size_t i = first; i < placed.size(); ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        const auto other = unfold(placed[i], corner);
        if (!other || seen.count(other->face) > 0 || !wanted(other->face)) continue;
        seen.insert(other->face);
        placed.push_back(*other);
      }
    }
  };
  const auto ring = [&] {
    const std::size_t count = placed.size();
    std::vector<Placed> fresh;
    for (std::size_t i = 0; i < count; ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        const auto other = unfold(placed[i], corner);
        if (other && seen.insert(other->face).second) fresh.push_back(*other);
      }
    }
    placed.insert(placed.end(), fresh.begin(), fresh.end());
  };
  ring();
  if (rings > 1) grow(0, touches);
  for (int i = 2; i < rings; ++i) ring();
  return placed;
}

/// Slope across a smooth edge (outward from its first side): the mean of both sides', corrected by the least change of its
/// coefficients that makes it exact for every quadratic surface over the faces around.
LinearForm Builder::fitted_slope(const Edge& edge) const {
  const Conormal own = conormal(edge.sides[0].face, edge.sides[0].corner), other = conormal(edge.sides[1].face, edge.sides[1].corner);
  LinearForm form;
  add_slope(form, edge.sides[0].face, own.slope, 0.5);
  add_slope(form, edge.sides[1].face, other.slope, -0.5);
  const Vector2d middle = 0.5 * (garment_.uv.row(vertex(edge.sides[0].face, edge.sides[0].corner)) + garment_.uv.row(vertex(edge.sides[0].face, edge.sides[0].corner + 1))).transpose();
  const double h = own.length;
  for (int rings = 1; rings <= 4; ++rings) {
    const std::vector<Placed> faces = patch(edge, rings);
    std::vector<int> nodes;
    std::vector<Vector2d> at;
    for (const Placed& p : faces) {
      for (int k = 0; k < 3; ++k) {
        const int n = sheet_.corners[static_cast<std::size_t>(p.face)][static_cast<std::size_t>(k)];
        if (std::find(nodes.begin(), nodes.end(), n) != nodes.end()) continue;
        nodes.push_back(n);
        at.emplace_back((p.turn * garment_.uv.row(vertex(p.face, k)).transpose() + p.shift - middle) / h);
      }
    }
    const auto count = static_cast<Eigen::Index>(nodes.size());
    Eigen::MatrixXd moments(6, count);
    Eigen::VectorXd error(6);
    error << 0, own.normal.x(), own.normal.y(), 0, 0, 0;
    error /= h;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Vector2d& p = at[static_cast<std::size_t>(i)];
      moments.col(i) << 1, p.x(), p.y(), p.x() * p.x(), p.y() * p.y(), p.x() * p.y();
    }
    for (const auto& [n, c] : form) {
      const auto i = std::find(nodes.begin(), nodes.end(), n) - nodes.begin();
      error -= c * moments.col(i);
    }
    if (error.cwiseAbs().maxCoeff() * h < 1e-10) return form;
    const Eigen::Matrix<double, 6, 6> normal = moments * moments.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> spectrum(normal);
    const auto& value = spectrum.eigenvalues();
    // A patch that hardly tells quadratic surfaces apart (a strip, points on a circle) gives way to a larger one.
    if ((count < 6 || value[0] < 1e-3 * value[5]) && rings < 4) continue;
    Eigen::VectorXd scaled = spectrum.eigenvectors().transpose() * error;
    for (Eigen::Index i = 0; i < 6; ++i) scaled[i] = value[i] > 1e-6 * value[5] ? scaled[i] / value[i] : 0;
    const Eigen::VectorXd correction = moments.transpose() * (spectrum.eigenvectors() * scaled);
    for (Eigen::Index i = 0; i < count; ++i) {
      if (std::abs(correction[i]) * h > 1e-12) add(form, nodes[static_cast<std::size_t>(i)], correction[i]);
    }
    return form;
  }
  return form;
}

void Builder::find_slopes() {
  slope_.resize(sheet_.corners.size());
  const auto directed = [&](int face, int corner) {
    const int p = vertex(face, corner), q = vertex(face, corner + 1);
    return director_[static_cast<std::size_t>(p)] >= 0 && director_[static_cast<std::size_t>(q)] >= 0;
  };
  const auto nodal = [&](int face, int corner, const Vector2d& normal) {
    LinearForm form;
    for (int axis = 0; axis < 2; ++axis) {
      if (std::abs(normal[axis]) < 1e-9) continue;
      for (int end : {vertex(face, corner), vertex(face, corner + 1)}) add(form, derivative(end, axis), 0.5 * normal[axis]);
    }
    return form;
  };
  parallel_for(edges_.size(), 256, [&](std::size_t i) {
    const Edge& edge = edges_[i];
    if (std::all_of(edge.sides.begin(), edge.sides.end(), [&](const Side& s) { return in_cell_[static_cast<std::size_t>(s.face)]; })) return;
    const auto set = [&](const Side& side, LinearForm form) { slope_[static_cast<std::size_t>(side.face)][static_cast<std::size_t>(side.corner)] = std::move(form); };
    if (std::any_of(edge.sides.begin(), edge.sides.end(), [&](const Side& s) { return directed(s.face, s.corner); })) {
      for (const Side& side : edge.sides) {
        if (directed(side.face, side.corner)) set(side, nodal(side.face, side.corner, conormal(side.face, side.corner).normal));
      }
      return;
    }
    if (edge.join == Join::smooth) {
      const auto cell = std::find_if(edge.sides.begin(), edge.sides.end(), [&](const Side& s) { return in_cell_[static_cast<std::size_t>(s.face)] != 0; });
      LinearForm form = cell != edge.sides.end() ? nodal(edge.sides[0].face, edge.sides[0].corner, conormal(edge.sides[0].face, edge.sides[0].corner).normal) : fitted_slope(edge);
      LinearForm back;
      add(back, form, -1);
      set(edge.sides[0], std::move(form));
      set(edge.sides[1], std::move(back));
    } else if (edge.join == Join::several) {
      // Each against the mean of the others.
      for (const Side& side : edge.sides) {
        LinearForm form;
        add_slope(form, side.face, conormal(side.face, side.corner).slope, 0.5);
        for (const Side& other : edge.sides) {
          if (other.face != side.face) add_slope(form, other.face, conormal(other.face, other.corner).slope, -0.5 / static_cast<double>(edge.sides.size() - 1));
        }
        set(side, std::move(form));
      }
    }
  });
  balance_slopes();
}

/// D of a face with the slopes over its free edges left where the energy is least.
Matrix3d Builder::condensed(int face) const {
  Matrix3d d = rigidities(fabric(face)).asDiagonal();
  for (int k = 0; k < 3; ++k) {
    if (slope_[static_cast<std::size_t>(face)][static_cast<std::size_t>(k)]) continue;
    const Vector2d n = conormal(face, k).normal;
    const Vector3d q(n.x() * n.x(), n.y() * n.y(), n.x() * n.y());
    const Vector3d m = d * q;
    const double s = q.dot(m);
    if (s > 1e-12 * d.trace()) d -= m * m.transpose() / s;
  }
  return d;
}

/// Where the fabric changes across an edge the curvature jumps and the moment does not: the shared slope is that of least energy.
void Builder::balance_slopes() {
  std::vector<std::pair<std::size_t, LinearForm>> better;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    if (edge.join != Join::smooth) continue;
    const Side &s0 = edge.sides[0], &s1 = edge.sides[1];
    if (fabric_id(s0.face) == fabric_id(s1.face) || in_cell_[static_cast<std::size_t>(s0.face)] || in_cell_[static_cast<std::size_t>(s1.face)]) continue;
    LinearForm sum;
    double weight = 0;
    for (const Side& side : edge.sides) {
      const Conormal c = conormal(side.face, side.corner);
      const Vector3d q = c.length / area(side.face) * Vector3d(c.normal.x() * c.normal.x(), c.normal.y() * c.normal.y(), c.normal.x() * c.normal.y());
      const Vector3d m = area(side.face) * (rigidities(fabric(side.face)).asDiagonal() * q);
      weight += area(side.face) * q.dot(condensed(side.face) * q);
      const std::array<LinearForm, 3> k = curvature(side.face, side.corner);
      for (std::size_t r = 0; r < 3; ++r) add(sum, k[r], (side.face == s0.face ? -1 : 1) * m[static_cast<Eigen::Index>(r)]);
    }
    LinearForm form;
    add(form, sum, 1 / weight);
    better.emplace_back(i, std::move(form));
  }
  for (auto& [i, form] : better) {
    const Edge& edge = edges_[i];
    LinearForm back;
    add(back, form, -1);
    slope_[static_cast<std::size_t>(edge.sides[0].face)][static_cast<std::size_t>(edge.sides[0].corner)] = std::move(form);
    slope_[static_cast<std::size_t>(edge.sides[1].face)][static_cast<std::size_t>(edge.sides[1].corner)] = std::move(back);
  }
}

/// (K_uu, K_vv, K_uv) of a face with free edges at their least energy; the shared slope of edge `without` (or -1) is left out.
std::array<LinearForm, 3> Builder::curvature(int face, int without) const {
  const TriangleShape& shape = sheet_.shapes[static_cast<std::size_t>(face)];
  std::array<LinearForm, 3> k;
  std::vector<Vector3d> free;
  for (int e = 0; e < 3; ++e) {
    const Conormal own = conormal(face, e);
    const Vector3d q = own.length / shape.area * Vector3d(own.normal.x() * own.normal.x(), own.normal.y() * own.normal.y(), own.normal.x() * own.normal.y());
    const auto& slope = slope_[static_cast<std::size_t>(face)][static_cast<std::size_t>(e)];
    if (!slope) free.push_back(q);
    for (std::size_t r = 0; r < 3; ++r) {
      const double weight = q[static_cast<Eigen::Index>(r)];
      if (weight == 0) continue;
      add_slope(k[r], face, own.slope, -weight);
      if (slope && e != without) add(k[r], *slope, weight);
    }
  }
  // K := K - P K, P the projection on the free directions in the metric of D.
  const Vector3d d = rigidities(fabric(face));
  Matrix3d keep = Matrix3d::Identity();
  std::vector<Vector3d> basis;
  for (Vector3d q : free) {
    const double whole = q.dot(d.asDiagonal() * q);
    for (const Vector3d& b : basis) q -= b * b.dot(d.asDiagonal() * q);
    const double left = q.dot(d.asDiagonal() * q);
    if (!(left > 1e-9 * whole)) continue;
    q /= std::sqrt(left);
    basis.push_back(q);
    keep -= q * (d.asDiagonal() * q).transpose();
  }
  if (basis.empty()) return k;
  std::array<LinearForm, 3> result;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      const double c = keep(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(s));
      if (c != 0) add(result[r], k[s], c);
    }
  }
  return result;
}

void Builder::add_triangles() {
  for (int f = 0; f < static_cast<int>(sheet_.corners.size()); ++f) {
    if (in_cell_[static_cast<std::size_t>(f)]) continue;
    std::array<LinearForm, 3> k = curvature(f, -1);
    const Vector3d d = rigidities(fabric(f));
    constexpr std::array axes{CurvatureForm::Axis::weft, CurvatureForm::Axis::warp, CurvatureForm::Axis::twist};
    for (std::size_t r = 0; r < 3; ++r) {
      CurvatureForm form;
      form.form = std::move(k[r]);
      form.weight = area(f);
      form.rigidity = d[static_cast<Eigen::Index>(r)];
      form.axis = axes[r];
      form.fabric = fabric_id(f);
      form.face = f;
      const auto& corner = sheet_.corners[static_cast<std::size_t>(f)];
      form.normal = {corner[1], corner[0], corner[2], corner[0]};
      result_.curvatures.push_back(std::move(form));
    }
  }
}

}  // namespace

BendingForms bending_forms(const mesh::GarmentMesh& garment, const Sheet& sheet, const std::map<std::pair<int, int>, double>& seam_factor) {
  return Builder(garment, sheet, seam_factor).build();
}

}  // namespace toile::mechanics
