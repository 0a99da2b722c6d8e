#include "toile/mechanics/sheet.h"

#include "bending.h"

#include "toile/base/parallel.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace toile::mechanics {
namespace {

constexpr std::size_t grain = 1024;
// Part of a pair's stretch energy that either face keeps for itself, so that opposite stretches in the two are not free: so many times as stiff as
// the shear of the cloth, at most a tenth. A part of the stretch alone would lock the more, the easier the cloth shears; with the shear alone, single
// triangles at corners where seams pull would stretch by a tenth.
constexpr double own_over_shear = 10, most_own_part = 0.1;

struct Triplet {
  int row, column;
  double value;
};

/// Sums triplets of the same place in the order in which they come.
ScalarMatrix compress(int rows, const std::vector<Triplet>& triplets) {
  const auto n = static_cast<std::size_t>(rows);
  std::vector<std::size_t> start(n + 1, 0);
  for (const Triplet& t : triplets) ++start[static_cast<std::size_t>(t.row) + 1];
  for (std::size_t i = 1; i <= n; ++i) start[i] += start[i - 1];
  std::vector<std::pair<int, double>> sorted(triplets.size());
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (const Triplet& t : triplets) sorted[next[static_cast<std::size_t>(t.row)]++] = {t.column, t.value};
  std::vector<int> count(n, 0);
  parallel_for(n, grain, [&](std::size_t i) {
    const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(start[i]), end = sorted.begin() + static_cast<std::ptrdiff_t>(start[i + 1]);
    std::stable_sort(begin, end, [](const auto& p, const auto& q) { return p.first < q.first; });
    auto out = begin;
    for (auto it = begin; it != end; ++it) {
      if (it != begin && it->first == (out - 1)->first) {
        (out - 1)->second += it->second;
      } else {
        *out++ = *it;
      }
    }
    count[i] = static_cast<int>(out - begin);
  });
  ScalarMatrix matrix;
  matrix.row_start.assign(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    matrix.row_start[i + 1] = matrix.row_start[i] + count[i];
    for (int k = 0; k < count[i]; ++k) {
      matrix.column.push_back(sorted[start[i] + static_cast<std::size_t>(k)].first);
      matrix.value.push_back(sorted[start[i] + static_cast<std::size_t>(k)].second);
    }
  }
  return matrix;
}

std::array<Eigen::Vector2d, 3> corners_uv(const mesh::GarmentMesh& garment, Eigen::Index f) {
  return {garment.uv.row(garment.faces(f, 0)).transpose(), garment.uv.row(garment.faces(f, 1)).transpose(), garment.uv.row(garment.faces(f, 2)).transpose()};
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

/// Energy of an element with its first two derivatives by the element's number; the number's gradient by node into `gradient`.
fabric::CurvePoint hinge_state(const HingeElement& hinge, const Points3& x, Eigen::Vector3d* gradient) {
  const Eigen::Vector3d x0 = point(x, hinge.node[0]), edge = point(x, hinge.node[1]) - x0, to_first = point(x, hinge.node[2]) - x0, to_second = point(x, hinge.node[3]) - x0;
  const Eigen::Vector3d n0 = edge.cross(to_first), n1 = to_second.cross(edge);
  const double length = std::max(edge.norm(), 1e-12), sq0 = std::max(n0.squaredNorm(), 1e-24), sq1 = std::max(n1.squaredNorm(), 1e-24);
  const double angle = std::atan2(n1.cross(n0).dot(edge) / length, n0.dot(n1)) - hinge.rest;
  if (gradient != nullptr) {
    const double t0 = to_first.dot(edge) / (length * length), t1 = to_second.dot(edge) / (length * length);
    gradient[2] = n0 * (length / sq0);
    gradient[3] = n1 * (length / sq1);
    gradient[0] = -(1 - t0) * gradient[2] - (1 - t1) * gradient[3];
    gradient[1] = -t0 * gradient[2] - t1 * gradient[3];
  }
  return {0.5 * hinge.stiffness * angle * angle, hinge.stiffness * angle, hinge.stiffness};
}

/// Faces off the grid, two by two. A triangle that the yarns cross at an angle has two stiff directions for one node in two: a mesh of
/// them can hardly shear. In pairs there are as many as on the grid.
std::vector<MembraneUnit> membrane_units(const mesh::GarmentMesh& garment, const std::vector<int>& fabric_of_face, const std::vector<char>& in_cell) {
  const auto nf = static_cast<std::size_t>(garment.face_count());
  std::set<std::pair<int, int>> creases;
  for (const mesh::Hinge& h : garment.hinges) creases.insert({std::min(h.v0, h.v1), std::max(h.v0, h.v1)});
  struct Neighbour {
    int face;
    double length;  // of the edge between
  };
  std::vector<std::vector<Neighbour>> around(nf);
  for (const mesh::Edge& edge : mesh::edges(garment.faces)) {
    if (edge.faces.size() != 2 || creases.count({edge.a, edge.b}) > 0) continue;
    const auto f = static_cast<std::size_t>(edge.faces[0]), g = static_cast<std::size_t>(edge.faces[1]);
    if (in_cell[f] || in_cell[g] || fabric_of_face[f] != fabric_of_face[g]) continue;
    const double length = (garment.uv.row(edge.a) - garment.uv.row(edge.b)).norm();
    around[f].push_back({edge.faces[1], length});
    around[g].push_back({edge.faces[0], length});
  }
  // The face with the fewest free neighbours first, with the neighbour that has the fewest.
  std::vector<int> free(nf), partner(nf, -1);
  std::set<std::pair<int, int>> queue;
  for (std::size_t f = 0; f < nf; ++f) {
    free[f] = static_cast<int>(around[f].size());
    if (free[f] > 0) queue.insert({free[f], static_cast<int>(f)});
  }
  const auto leave = [&](int face) {
    queue.erase({free[static_cast<std::size_t>(face)], face});
    for (const Neighbour& n : around[static_cast<std::size_t>(face)]) {
      int& count = free[static_cast<std::size_t>(n.face)];
      if (queue.erase({count, n.face}) == 0) continue;
      if (--count > 0) queue.insert({count, n.face});
    }
  };
  while (!queue.empty()) {
    const int face = queue.begin()->second;
    const Neighbour* best = nullptr;
    for (const Neighbour& n : around[static_cast<std::size_t>(face)]) {
      if (partner[static_cast<std::size_t>(n.face)] >= 0) continue;
      const int count = free[static_cast<std::size_t>(n.face)];
      if (best == nullptr || std::pair(count, -n.length) < std::pair(free[static_cast<std::size_t>(best->face)], -best->length)) best = &n;
    }
    TOILE_CHECK(best != nullptr, "face {} has no free neighbour", face);
    partner[static_cast<std::size_t>(face)] = best->face;
    partner[static_cast<std::size_t>(best->face)] = face;
    const int other = best->face;
    leave(face);
    leave(other);
  }
  std::vector<MembraneUnit> units;
  for (std::size_t f = 0; f < nf; ++f) {
    if (partner[f] < 0) units.push_back({static_cast<int>(f)});
    if (partner[f] > static_cast<int>(f)) units.push_back({static_cast<int>(f), partner[f]});
  }
  return units;
}

/// Both yarns' mean stretch over the two faces of a pair.
YarnState mean_state(const Sheet& sheet, const MembraneUnit& unit, const YarnState& first, const YarnState& second) {
  const double a = sheet.shapes[static_cast<std::size_t>(unit.first)].area, b = sheet.shapes[static_cast<std::size_t>(unit.second)].area, w = a / (a + b);
  return {w * first.weft + (1 - w) * second.weft, w * first.warp + (1 - w) * second.warp, 0};
}

fabric::CurvePoint scaled(const fabric::CurvePoint& p, double factor) { return {factor * p.energy, factor * p.force, factor * p.slope}; }

// What a face and a pair of faces answer to a state, with internal friction where the sheet has it.
fabric::CurvePoint weft_of_face(const Sheet& sheet, std::size_t f, double stretch) {
  const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[f]);
  const fabric::TensileCurve& curve = sheet.fabrics[fabric].weft;
  return sheet.friction ? sheet.friction->stretch[f][0].at(curve, sheet.friction->laws[fabric].loss_weft, stretch - 1) : curve.at(stretch - 1);
}
fabric::CurvePoint warp_of_face(const Sheet& sheet, std::size_t f, double stretch) {
  const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[f]);
  const fabric::TensileCurve& curve = sheet.fabrics[fabric].warp;
  return sheet.friction ? sheet.friction->stretch[f][1].at(curve, sheet.friction->laws[fabric].loss_warp, stretch - 1) : curve.at(stretch - 1);
}
fabric::CurvePoint shear_of_face(const Sheet& sheet, std::size_t f, double sine) {
  const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[f]);
  fabric::CurvePoint p = sheet.fabrics[fabric].shear.at(sine);
  if (!sheet.friction) return p;
  const fabric::CurvePoint q = sheet.friction->shear[f].at(sheet.friction->laws[fabric].shear, sine);
  return {p.energy + q.energy, p.force + q.force, p.slope + q.slope};
}
/// What a face of a pair keeps of the stretch energy for itself: weft, warp.
std::array<double, 2> own_part(const fabric::Constitutive& data) {
  const auto part = [&](const fabric::TensileCurve& curve) { return std::min(most_own_part, own_over_shear * data.shear.rigidity / std::max(curve.slope_zero, 1e-12)); };
  return {part(data.weft), part(data.warp)};
}
/// Weft and warp of a pair's mean.
std::array<fabric::CurvePoint, 2> of_pair(const Sheet& sheet, std::size_t unit, const YarnState& mean) {
  const auto fabric = static_cast<std::size_t>(sheet.fabric_of_face[static_cast<std::size_t>(sheet.units[unit].first)]);
  const fabric::Constitutive& data = sheet.fabrics[fabric];
  const auto [own_weft, own_warp] = own_part(data);
  if (!sheet.friction) return {scaled(data.weft.at(mean.weft - 1), 1 - own_weft), scaled(data.warp.at(mean.warp - 1), 1 - own_warp)};
  const auto& sliders = sheet.friction->pair_stretch[unit];
  const InternalFriction::Law& law = sheet.friction->laws[fabric];
  return {scaled(sliders[0].at(data.weft, law.loss_weft, mean.weft - 1), 1 - own_weft), scaled(sliders[1].at(data.warp, law.loss_warp, mean.warp - 1), 1 - own_warp)};
}

double half_height(const Sheet& sheet, const CurvatureForm& c) {
  const fabric::Hysteresis& h = sheet.fabrics[static_cast<std::size_t>(c.fabric)].hysteresis;
  return c.axis == CurvatureForm::Axis::weft ? h.moment_weft : c.axis == CurvatureForm::Axis::warp ? h.moment_warp : 0;
}

/// Twist has no friction of its own: bent at 45 degrees, cloth moves the sliders of both yarns, and they give the mean of both loops.
bool has_slider(const Sheet& sheet, const CurvatureForm& c) { return half_height(sheet, c) > 0; }

InternalFriction make_friction(const Sheet& sheet, const std::vector<CurvatureForm>& curvatures) {
  InternalFriction friction;
  for (const fabric::Constitutive& f : sheet.fabrics) friction.laws.push_back(friction_law(f));
  for (const CurvatureForm& c : curvatures) {
    if (!has_slider(sheet, c)) continue;
    InternalFriction::Bending b;
    b.slider = moment_slider(sheet.fabrics[static_cast<std::size_t>(c.fabric)], c.rigidity, half_height(sheet, c));
    b.weight = c.weight;
    b.normal = c.normal;
    b.form_begin = static_cast<int>(friction.form_coefficient.size());
    b.warp = c.axis == CurvatureForm::Axis::warp;
    b.vertex = c.vertex;
    b.face = c.face;
    b.sides = c.sides;
    for (const auto& [node, coefficient] : c.form) friction.form_coefficient.push_back(coefficient);
    friction.bending.push_back(b);
  }
  friction.shear.resize(sheet.corners.size());
  friction.stretch.resize(sheet.corners.size());
  friction.pair_stretch.resize(sheet.units.size());
  return friction;
}

/// Energy of a slider with its derivatives by the curvature; the curvature's gradient by entry into `gradient`.
fabric::CurvePoint slider_state(const Sheet& sheet, std::size_t slider, const Points3& x, Eigen::Vector3d* gradient) {
  const InternalFriction::Bending& b = sheet.friction->bending[slider];
  const std::size_t e = sheet.hinges.size() + slider;
  const auto first = static_cast<std::size_t>(sheet.element_start[e]), count = static_cast<std::size_t>(sheet.element_start[e + 1]) - 4 - first;
  const double* coefficient = sheet.friction->form_coefficient.data() + b.form_begin;
  const Eigen::Vector3d base = point(x, sheet.element_node[first]);
  Eigen::Vector3d k = Eigen::Vector3d::Zero();
  for (std::size_t p = 1; p < count; ++p) k += coefficient[p] * (point(x, sheet.element_node[first + p]) - base);
  const Eigen::Vector3d u = point(x, b.normal[0]) - point(x, b.normal[1]), v = point(x, b.normal[2]) - point(x, b.normal[3]), cross = u.cross(v);
  const double length = std::max(cross.norm(), 1e-30);
  const Eigen::Vector3d n = cross / length;
  const double curvature = k.dot(n);
  if (gradient != nullptr) {
    for (std::size_t p = 0; p < count; ++p) gradient[p] = coefficient[p] * n;
    const Eigen::Vector3d m = (k - curvature * n) / length, by_u = v.cross(m), by_v = m.cross(u);
    gradient[count] = by_u;
    gradient[count + 1] = -by_u;
    gradient[count + 2] = by_v;
    gradient[count + 3] = -by_v;
  }
  return scaled(b.slider.at(curvature), b.weight);
}

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
  sheet.cloth_nodes = node_of_vertex.size() == 0 ? 0 : node_of_vertex.maxCoeff() + 1;
  sheet.node_count = sheet.cloth_nodes + 2 * static_cast<int>(options.directed_vertices.size());
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
  for (std::size_t i = 0; i < garment.fasteners.size(); ++i) {
    const mesh::Fastener& fastener = garment.fasteners[i];
    const int a = node_of_vertex[fastener.a], b = node_of_vertex[fastener.b];
    if (a == b || !fastener.closed) continue;
    sheet.springs.push_back({a, b, fastener.stiffness > 0 ? fastener.stiffness : options.fastener_stiffness, fastener.length, static_cast<int>(i)});
  }

  // Directors: a length of about the cells around keeps their columns of the matrix in proportion.
  std::vector<double> reach(static_cast<std::size_t>(garment.vertex_count()), 0);
  for (std::size_t f = 0; f < nf; ++f) {
    for (int k = 0; k < 3; ++k) reach[static_cast<std::size_t>(garment.faces(static_cast<Eigen::Index>(f), k))] = std::sqrt(sheet.shapes[f].area);
  }
  for (int vertex : options.directed_vertices) {
    const int ghost = sheet.cloth_nodes + 2 * static_cast<int>(sheet.directors.size());
    const double length = reach[static_cast<std::size_t>(vertex)];
    sheet.directors.push_back({vertex, node_of_vertex[vertex], ghost, ghost + 1, length > 0 ? length : 1});
  }

  BendingForms bending = bending_forms(garment, sheet, seam_factor);
  sheet.hinges = std::move(bending.hinges);
  std::vector<Triplet> triplets;
  for (const CurvatureForm& c : bending.curvatures) {
    for (const auto& [i, p] : c.form) {
      for (const auto& [j, q] : c.form) triplets.push_back({i, j, c.weight * c.rigidity * p * q});
    }
  }
  sheet.bending = compress(sheet.node_count, triplets);
  sheet.element_start.push_back(0);
  sheet.units = membrane_units(garment, sheet.fabric_of_face, bending.in_cell);
  if (options.internal_friction) {
    sheet.friction = make_friction(sheet, bending.curvatures);
    for (std::size_t i = 0; i < garment.laminates.size(); ++i) sheet.fabrics[i].shear = elastic_shear(sheet.fabrics[i], garment.laminates[i].equivalent);
  }
  for (const HingeElement& hinge : sheet.hinges) {
    sheet.element_node.insert(sheet.element_node.end(), hinge.node.begin(), hinge.node.end());
    sheet.element_start.push_back(static_cast<int>(sheet.element_node.size()));
  }
  if (sheet.friction) {
    std::size_t i = 0;
    for (const CurvatureForm& c : bending.curvatures) {
      if (!has_slider(sheet, c)) continue;
      for (const auto& [node, coefficient] : c.form) sheet.element_node.push_back(node);
      const auto& normal = sheet.friction->bending[i++].normal;
      sheet.element_node.insert(sheet.element_node.end(), normal.begin(), normal.end());
      sheet.element_start.push_back(static_cast<int>(sheet.element_node.size()));
    }
  }
  for (MembraneUnit& unit : sheet.units) {
    if (unit.second < 0) continue;
    // The corners of both faces: two nodes stand twice, and their entries add up.
    unit.element = static_cast<int>(sheet.element_start.size()) - 1;
    for (int yarn = 0; yarn < 2; ++yarn) {
      for (int f : {unit.first, unit.second}) {
        for (int n : sheet.corners[static_cast<std::size_t>(f)]) sheet.element_node.push_back(n);
      }
      sheet.element_start.push_back(static_cast<int>(sheet.element_node.size()));
    }
  }

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
  // The turn of a slider's normal is left out of the second derivative.
  const auto element_end = [&](std::size_t e) {
    const bool slider = sheet.friction && e >= sheet.hinges.size() && e < sheet.hinges.size() + sheet.friction->bending.size();
    return sheet.element_start[e + 1] - (slider ? 4 : 0);
  };
  for (std::size_t e = 0; e + 1 < sheet.element_start.size(); ++e) {
    for (int p = sheet.element_start[e]; p < element_end(e); ++p) {
      for (int q = sheet.element_start[e]; q < element_end(e); ++q) triplets.push_back({sheet.element_node[static_cast<std::size_t>(p)], sheet.element_node[static_cast<std::size_t>(q)], 0});
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
  bucket(sheet.node_count, sheet.element_node, sheet.node_entry_start, sheet.node_entry);
  key.clear();
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t e = 0; e + 1 < sheet.element_start.size(); ++e) {
    for (int p = sheet.element_start[e]; p < sheet.element_start[e + 1]; ++p) {
      sheet.entry_element.push_back(static_cast<int>(e));
      if (p >= element_end(e)) continue;
      for (int q = sheet.element_start[e]; q < element_end(e); ++q) {
        key.push_back(find(sheet.element_node[static_cast<std::size_t>(p)], sheet.element_node[static_cast<std::size_t>(q)]));
        pairs.emplace_back(p, q);
      }
    }
  }
  std::vector<int> order;
  bucket(static_cast<int>(sheet.column.size()), key, sheet.block_pair_start, order);
  for (int i : order) sheet.block_pair.push_back(pairs[static_cast<std::size_t>(i)]);
  read_friction(garment, sheet);
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
  result.membrane = parallel_reduce(sheet.units.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t u = begin; u < end; ++u) {
      const MembraneUnit& unit = sheet.units[u];
      const auto f = static_cast<std::size_t>(unit.first);
      if (unit.second < 0) {
        const YarnState s = yarn_state(yarn_gradient(sheet, x, f));
        sum += sheet.shapes[f].area * (weft_of_face(sheet, f, s.weft).energy + warp_of_face(sheet, f, s.warp).energy + shear_of_face(sheet, f, s.sine).energy);
        continue;
      }
      const auto g = static_cast<std::size_t>(unit.second);
      const std::array<YarnState, 2> state{yarn_state(yarn_gradient(sheet, x, f)), yarn_state(yarn_gradient(sheet, x, g))};
      const YarnState mean = mean_state(sheet, unit, state[0], state[1]);
      const auto [weft, warp] = of_pair(sheet, u, mean);
      const auto [own_weft, own_warp] = own_part(sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])]);
      for (std::size_t k = 0; k < 2; ++k) {
        const std::size_t h = k == 0 ? f : g;
        sum += sheet.shapes[h].area * (own_weft * weft_of_face(sheet, h, state[k].weft).energy + own_warp * warp_of_face(sheet, h, state[k].warp).energy +
                                       shear_of_face(sheet, h, state[k].sine).energy + weft.energy + warp.energy);
      }
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
  for (const HingeElement& hinge : sheet.hinges) result.bending += hinge_state(hinge, x, nullptr).energy;
  if (sheet.friction) {
    result.bending += parallel_reduce(sheet.friction->bending.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) sum += slider_state(sheet, i, x, nullptr).energy;
      return sum;
    }, add);
  }
  for (std::size_t i = 0; i < sheet.links.size(); ++i) {
    const Link& link = sheet.links[i];
    result.links += 0.5 * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  for (const Spring& spring : sheet.springs) {
    const double stretch = std::max((x.row(spring.a) - x.row(spring.b)).norm() - spring.length, 0.0);
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
  const std::size_t elements = sheet.element_start.size() - 1;
  response.entry_gradient.resize(sheet.element_node.size());
  response.element_force.resize(elements);
  response.element_slope.resize(elements);
  const auto face_response = [&](std::size_t f, const MembraneResponse& r) {
    const TriangleShape& shape = sheet.shapes[f];
    for (std::size_t k = 0; k < 3; ++k) {
      response.corner_force[f].col(static_cast<Eigen::Index>(k)) = shape.area * (shape.slope_u[k] * r.stress.weft + shape.slope_v[k] * r.stress.warp);
    }
    if (!curvature) return;
    // Single precision, as the matrix that they go into.
    const Block weft_weft = Block::from(r.weft_weft), weft_warp = Block::from(r.weft_warp), warp_weft = weft_warp.transposed(), warp_warp = Block::from(r.warp_warp);
    for (std::size_t a = 0; a < 3; ++a) {
      const double au = shape.area * shape.slope_u[a], av = shape.area * shape.slope_v[a];
      for (std::size_t b = a; b < 3; ++b) {
        const Float4 uu = splat(static_cast<float>(au * shape.slope_u[b])), uv = splat(static_cast<float>(au * shape.slope_v[b])),
                     vu = splat(static_cast<float>(av * shape.slope_u[b])), vv = splat(static_cast<float>(av * shape.slope_v[b]));
        Block& block = response.face_blocks[f][static_cast<std::size_t>(block_slot[a][b])];
        for (int c = 0; c < 3; ++c) block.column[c] = uu * weft_weft.column[c] + uv * weft_warp.column[c] + (vu * warp_weft.column[c] + vv * warp_warp.column[c]);
      }
    }
  };
  const Curvature kind = curvature.value_or(Curvature::exact);
  response.energy.membrane = parallel_reduce(sheet.units.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t u = begin; u < end; ++u) {
      const MembraneUnit& unit = sheet.units[u];
      const auto f = static_cast<std::size_t>(unit.first);
      if (unit.second < 0) {
        const YarnGradient own = yarn_gradient(sheet, x, f);
        const YarnState s = yarn_state(own);
        const MembraneResponse r = membrane_response(weft_of_face(sheet, f, s.weft), warp_of_face(sheet, f, s.warp), shear_of_face(sheet, f, s.sine), own, kind);
        sum += sheet.shapes[f].area * r.energy;
        face_response(f, r);
        continue;
      }
      const std::array<std::size_t, 2> faces{f, static_cast<std::size_t>(unit.second)};
      const std::array<YarnGradient, 2> gradient{yarn_gradient(sheet, x, faces[0]), yarn_gradient(sheet, x, faces[1])};
      const std::array<YarnState, 2> state{yarn_state(gradient[0]), yarn_state(gradient[1])};
      const YarnState mean = mean_state(sheet, unit, state[0], state[1]);
      const double area = sheet.shapes[faces[0]].area + sheet.shapes[faces[1]].area;
      const auto [weft, warp] = of_pair(sheet, u, mean);
      const auto [part_weft, part_warp] = own_part(sheet.fabrics[static_cast<std::size_t>(sheet.fabric_of_face[f])]);
      for (std::size_t k = 0; k < 2; ++k) {
        // The pair's force pulls on either face; its slope couples the two and goes into the elements.
        fabric::CurvePoint own_weft = scaled(weft_of_face(sheet, faces[k], state[k].weft), part_weft), own_warp = scaled(warp_of_face(sheet, faces[k], state[k].warp), part_warp);
        own_weft.force += weft.force;
        own_warp.force += warp.force;
        own_weft.energy += weft.energy;
        own_warp.energy += warp.energy;
        const MembraneResponse r = membrane_response(own_weft, own_warp, shear_of_face(sheet, faces[k], state[k].sine), gradient[k], kind);
        sum += sheet.shapes[faces[k]].area * r.energy;
        face_response(faces[k], r);
        const TriangleShape& shape = sheet.shapes[faces[k]];
        const double part = shape.area / area;
        const Eigen::Vector3d along_weft = part / state[k].weft * gradient[k].weft, along_warp = part / state[k].warp * gradient[k].warp;
        const auto entry = static_cast<std::size_t>(sheet.element_start[static_cast<std::size_t>(unit.element)]) + 3 * k;
        for (std::size_t c = 0; c < 3; ++c) {
          response.entry_gradient[entry + c] = shape.slope_u[c] * along_weft;
          response.entry_gradient[entry + 6 + c] = shape.slope_v[c] * along_warp;
        }
      }
      const auto e = static_cast<std::size_t>(unit.element);
      response.element_force[e] = response.element_force[e + 1] = 0;
      response.element_slope[e] = area * weft.slope;
      response.element_slope[e + 1] = area * warp.slope;
    }
    return sum;
  }, add);

  double element_energy = parallel_reduce(sheet.hinges.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t e = begin; e < end; ++e) {
      const fabric::CurvePoint state = hinge_state(sheet.hinges[e], x, response.entry_gradient.data() + sheet.element_start[e]);
      sum += state.energy;
      response.element_force[e] = state.force;
      response.element_slope[e] = state.slope;
    }
    return sum;
  }, add);

  if (sheet.friction) {
    element_energy += parallel_reduce(sheet.friction->bending.size(), grain, 0.0, [&](std::size_t begin, std::size_t end) {
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t e = sheet.hinges.size() + i;
        const fabric::CurvePoint state = slider_state(sheet, i, x, response.entry_gradient.data() + sheet.element_start[e]);
        sum += state.energy;
        response.element_force[e] = state.force;
        response.element_slope[e] = state.slope;
      }
      return sum;
    }, add);
  }

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
    return sign * spring.stiffness * std::max(1 - spring.length / length, 0.0) * d;
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
      for (int k = sheet.node_entry_start[i]; k < sheet.node_entry_start[i + 1]; ++k) {
        const auto entry = static_cast<std::size_t>(sheet.node_entry[static_cast<std::size_t>(k)]);
        force += response.element_force[static_cast<std::size_t>(sheet.entry_element[entry])] * response.entry_gradient[entry].transpose();
      }
      response.gradient.row(row) = force;
    }
    return sum;
  }, add);
  response.energy.bending += element_energy;
  for (std::size_t i = 0; i < links; ++i) {
    const Link& link = sheet.links[i];
    response.energy.links += 0.5 * link.stiffness * (x.row(link.a) - x.row(link.b) - link_offset.row(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  for (const Spring& spring : sheet.springs) {
    const double stretch = std::max((x.row(spring.a) - x.row(spring.b)).norm() - spring.length, 0.0);
    response.energy.links += 0.5 * spring.stiffness * stretch * stretch;
  }
  if (!curvature) return;

  BlockMatrix& matrix = response.matrix;
  if (matrix.value.size() != sheet.column.size()) {
    matrix.row_start = sheet.row_start;
    matrix.column = sheet.column;
    matrix.diagonal = sheet.diagonal;
    matrix.value.resize(sheet.column.size());
    response.constant_blocks_stand = false;
  }
  const bool all = !response.constant_blocks_stand || !sheet.springs.empty();
  parallel_for(static_cast<std::size_t>(sheet.node_count), grain / 4, [&](std::size_t i) {
    for (int k = sheet.row_start[i]; k < sheet.row_start[i + 1]; ++k) {
      const auto slot = static_cast<std::size_t>(k);
      const int part_end = sheet.block_part_start[slot + 1], pair_end = sheet.block_pair_start[slot + 1];
      if (sheet.block_part_start[slot] == part_end && sheet.block_pair_start[slot] == pair_end && !all && k != sheet.diagonal[i]) continue;
      // In double precision: stretch cancels in what bending is left with, and rounding of each addend is what kept fine strips with sliders from rest.
      Eigen::Matrix3d sum = sheet.constant_part[slot] * Eigen::Matrix3d::Identity();
      for (int p = sheet.block_part_start[slot]; p < part_end; ++p) {
        const int item = sheet.block_part[static_cast<std::size_t>(p)], a = item % 9 / 3, b = item % 3;
        const Block& block = response.face_blocks[static_cast<std::size_t>(item / 9)][static_cast<std::size_t>(block_slot[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)])];
        sum += (a <= b ? block : block.transposed()).matrix();
      }
      if (sheet.block_pair_start[slot] < pair_end) {
        Eigen::Matrix3d pairs = Eigen::Matrix3d::Zero();
        for (int p = sheet.block_pair_start[slot]; p < pair_end; ++p) {
          const auto [first, second] = sheet.block_pair[static_cast<std::size_t>(p)];
          const double slope = response.element_slope[static_cast<std::size_t>(sheet.entry_element[static_cast<std::size_t>(first)])];
          if (slope == 0) continue;  // a slider that slides
          pairs += slope * response.entry_gradient[static_cast<std::size_t>(first)] * response.entry_gradient[static_cast<std::size_t>(second)].transpose();
        }
        sum += pairs;
      }
      matrix.value[slot] = Block::from(sum);
    }
  });
  response.constant_blocks_stand = true;
  for (const Spring& spring : sheet.springs) {
    const Eigen::Vector3d d = point(x, spring.a) - point(x, spring.b);
    const double length = std::max(d.norm(), 1e-12);
    if (length <= spring.length) continue;
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
