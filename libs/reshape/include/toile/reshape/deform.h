// Changes a surface by characteristic lines (girths), moves (lengths, slopes) and free-form lattices. docs/reshaping.md.
#pragma once

#include "toile/base/fields.h"
#include "toile/reshape/surface.h"

#include <optional>
#include <string>
#include <vector>

namespace toile::reshape {

/// A section of the surface whose girth is changed.
struct GirthSpec {
  std::string at;
  std::array<double, 3> shift{0, 0, 0};
  std::array<double, 3> normal{0, 1, 0};
  std::optional<double> change, to;
  double reach = 0.15;
  std::vector<std::string> parts;
  static void describe(auto& f) {
    f(&GirthSpec::at, {.key = "at", .doc = "point that the section goes through: a landmark, panel.point of a garment; of several curves of the section the one nearest to it counts"});
    f(&GirthSpec::shift, {.key = "shift", .doc = "moved from there; without `at` the position itself", .unit = "m", .min = -10, .max = 10});
    f(&GirthSpec::normal, {.key = "normal", .doc = "normal of the section's plane"});
    f(&GirthSpec::change, {.key = "change", .doc = "girth to add; 0 holds the line where it is", .unit = "m", .min = -3, .max = 3});
    f(&GirthSpec::to, {.key = "to", .doc = "or the girth to have", .unit = "m", .min = 0.01, .max = 10});
    f(&GirthSpec::reach, {.key = "reach", .doc = "distance over the surface within which it moves along", .unit = "m", .min = 0.001, .max = 10});
    f(&GirthSpec::parts, {.key = "parts", .doc = "regions of a form or panels of a garment that it concerns; the rest stays"});
    f.check([](const GirthSpec& g, Issues& issues) {
      if (g.change.has_value() == g.to.has_value()) issues.push_back({"bad_line", {.item = "change"}, "a girth is given by `change` or by `to`", "give exactly one of them"});
      if (g.normal[0] == 0 && g.normal[1] == 0 && g.normal[2] == 0) issues.push_back({"bad_line", {.item = "normal"}, "the normal has no length", "give a direction, e.g. [0, 1, 0]"});
    });
  }
};

/// What lies beyond one point is moved away from another, or round it; the surface between them follows smoothly.
struct MoveSpec {
  std::string from, to;
  std::optional<double> change, turn;
  std::array<double, 3> about{0, 0, 1};
  std::optional<std::array<double, 3>> normal;
  std::vector<std::string> parts;
  double reach = 10;
  static void describe(auto& f) {
    f(&MoveSpec::from, {.key = "from", .doc = "point that stays", .required = true});
    f(&MoveSpec::to, {.key = "to", .doc = "point that moves, with all that lies beyond it", .required = true});
    f(&MoveSpec::change, {.key = "change", .doc = "distance between the points to add", .unit = "m", .min = -3, .max = 3});
    f(&MoveSpec::turn, {.key = "turn", .doc = "or the angle by which the line between them turns, counter-clockwise seen against `about`; what lies beyond keeps its direction", .unit = "rad", .min = -1.5, .max = 1.5});
    f(&MoveSpec::about, {.key = "about", .doc = "axis of the turn"});
    f(&MoveSpec::normal, {.key = "normal", .doc = "normal of the planes through `from` and `to` between which the surface gives; without it the line between them"});
    f(&MoveSpec::parts, {.key = "parts", .doc = "regions of a form or panels of a garment that it concerns; the rest stays"});
    f(&MoveSpec::reach, {.key = "reach", .doc = "distance over the surface from the moved part within which the surface gives", .unit = "m", .min = 0.001, .max = 10});
    f.check([](const MoveSpec& m, Issues& issues) {
      if (m.change.has_value() == m.turn.has_value()) issues.push_back({"bad_line", {.item = "change"}, "a move is given by `change` or by `turn`", "give exactly one of them"});
      const auto zero = [](const std::array<double, 3>& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; };
      if (zero(m.about)) issues.push_back({"bad_line", {.item = "about"}, "the axis has no length", "give a direction, e.g. [0, 0, 1]"});
      if (m.normal && zero(*m.normal)) issues.push_back({"bad_line", {.item = "normal"}, "the normal has no length", "give a direction, e.g. [1, 0, 0]"});
    });
  }
};

enum class Basis {
  bspline,    ///< uniform cubic B-splines: smooth everywhere, each node moves two cells on either side
  bernstein,  ///< Bernstein polynomials: every node moves the whole box, nothing outside it
};

struct LatticeOffset {
  std::vector<int> node;
  std::array<double, 3> by{0, 0, 0};
  static void describe(auto& f) {
    f(&LatticeOffset::node, {.key = "node", .doc = "indices along x, y, z, from 0 to `cells`", .min = 0, .max = 30, .required = true});
    f(&LatticeOffset::by, {.key = "by", .doc = "how far the node is moved", .unit = "m", .min = -1, .max = 1, .required = true});
  }
};

/// A box of control points.
struct LatticeSpec {
  std::array<double, 3> low{0, 0, 0}, high{0, 0, 0};
  std::vector<int> cells{3, 3, 3};
  Basis basis = Basis::bspline;
  std::vector<LatticeOffset> offsets;
  static void describe(auto& f) {
    f(&LatticeSpec::low, {.key = "low", .doc = "lowest corner of the box", .unit = "m", .min = -10, .max = 10, .required = true});
    f(&LatticeSpec::high, {.key = "high", .doc = "highest corner of the box", .unit = "m", .min = -10, .max = 10, .required = true});
    f(&LatticeSpec::cells, {.key = "cells", .doc = "cells along x, y, z", .min = 1, .max = 30});
    f(&LatticeSpec::basis, {.key = "basis", .doc = "bspline: smooth everywhere, each node moves two cells on either side; bernstein: every node moves the whole box and nothing outside it"});
    f(&LatticeSpec::offsets, {.key = "offsets", .doc = "moved control points; the others stay"});
    f.check([](const LatticeSpec& l, Issues& issues) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (l.low[k] >= l.high[k]) {
          issues.push_back({"bad_lattice", {.item = "high"}, "the box has no room between low and high", "give high above low along x, y and z"});
          break;
        }
      }
      if (l.cells.size() != 3) issues.push_back({"bad_lattice", {.item = "cells"}, "cells are not three numbers", "give cells along x, y and z, e.g. [3, 3, 3]"});
      for (const LatticeOffset& offset : l.offsets) {
        bool inside = offset.node.size() == 3 && l.cells.size() == 3;
        for (std::size_t k = 0; inside && k < 3; ++k) inside = offset.node[k] <= l.cells[k];
        if (!inside) {
          issues.push_back({"bad_lattice", {.item = "offsets"}, "a node is not one of the lattice", "give three indices from 0 to the number of cells along x, y and z"});
          break;
        }
      }
    });
  }
};

struct DeformParams {
  std::map<std::string, GirthSpec> girths;
  std::map<std::string, MoveSpec> moves;
  std::map<std::string, LatticeSpec> lattices;
  bool symmetric = false;
  double tolerance = 1e-5;
  static void describe(auto& f) {
    f(&DeformParams::girths, {.key = "girths", .doc = "characteristic lines round the surface and their girths, by name"});
    f(&DeformParams::moves, {.key = "moves", .doc = "lengths and slopes between two points, by name"});
    f(&DeformParams::lattices, {.key = "lattices", .doc = "free-form lattices, by name; they come first, the measures hold for the result"});
    f(&DeformParams::symmetric, {.key = "symmetric", .doc = "what is asked on one side holds for both, and the result is its own mirror image (x to -x) to the bit; the surface has to be"});
    f(&DeformParams::tolerance, {.key = "tolerance", .doc = "a measure farther from what was asked is a finding", .unit = "m", .min = 1e-7, .max = 0.01});
  }
};

/// A measure before and after; girths and distances [m], turns [rad].
struct MeasureRow {
  std::string name;
  bool angle = false;
  double before = 0, asked = 0, after = 0;
};

struct Deformed {
  Points3 x;  ///< |V| x 3
  std::vector<MeasureRow> measures;
  double largest_move = 0;  ///< [m]
  int folded_faces = 0;     ///< turned over, or left with less than a twentieth of their area
  int rounds = 0;           ///< of the search for the measures
  Issues findings;          ///< "out_of_tolerance" (not_converged), "folded" (check)
};

/// Positions of the vertices such that every asked measure comes out. Fields of displacement are biharmonic on the surface
/// (least bending of the displacement) between the lines that move and the parts that stay.
/// surface  manifold, may have borders
/// error    "unknown_point", "unknown_part" (input), "no_section", "girth_too_small", "points_coincide", "not_symmetric" (input),
///          "not_separated" (nothing can give between the moved part and the rest), "lattice_folds" (check)
Result<Deformed> deform(const Surface& surface, const DeformParams& params);

/// Displacement of a lattice at points of space, |P| x 3 [m].
Points3 lattice_displacement(const LatticeSpec& lattice, const Points3& points);
/// Least determinant of its deformation gradient over its box (sampled at eight places a cell along each axis); the
/// lattice folds space where it is not positive.
struct LatticeFold {
  double determinant = 1;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};
LatticeFold least_determinant(const LatticeSpec& lattice);

/// Points carried along with the surface that they lie on.
/// after  positions of the same vertices [m], |V| x 3
std::map<std::string, Eigen::Vector3d> carried_points(const Surface& before, const Points3& after);
/// The girths of a form that its landmarks say where to take (horizontally at waist_front, hip_front, ...), anew; the others
/// are left out.
/// points  carried landmarks
std::map<std::string, double> carried_girths(const mesh::SupportMesh& before, const Points3& after, const std::map<std::string, Eigen::Vector3d>& points);

}  // namespace toile::reshape

template <>
struct toile::Choices<toile::reshape::Basis> {
  static constexpr std::array names{std::pair{"bspline", toile::reshape::Basis::bspline}, std::pair{"bernstein", toile::reshape::Basis::bernstein}};
};
