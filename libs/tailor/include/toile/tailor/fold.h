// Fold lines: creases, rolls, and the angle of seams (docs/tailoring.md, "Folds").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace toile::tailor {

struct FoldSpec {
  std::string name;
  std::vector<std::string> line;
  std::string kind = "crease";
  double angle = 0;
  double radius = 0;
  double residual = 0.1;
  double factor = 1;
  static void describe(auto& f) {
    f(&FoldSpec::name, {.key = "name", .doc = "unique name", .required = true});
    f(&FoldSpec::line, {.key = "line", .doc = "lines that it runs along: panel.line, named in the `lines` of toile-mesh, panel.line(from..to), or sewn edges", .required = true});
    f(&FoldSpec::kind, {.key = "kind", .doc = "crease, roll, hem, lapel, ... (free text, kept in the garment)"});
    f(&FoldSpec::angle, {.key = "angle", .doc = "angle that is pressed; positive: towards the face side (a valley seen from it)", .unit = "rad", .min = -3.1415926535897931, .max = 3.1415926535897931, .required = true});
    f(&FoldSpec::radius, {.key = "radius", .doc = "the angle is rolled over an arc of this radius; 0: a sharp crease", .unit = "m", .min = 0, .max = 1});
    f(&FoldSpec::residual, {.key = "residual", .doc = "part of the angle that springs back after pressing", .unit = "1", .min = 0, .max = 0.99});
    f(&FoldSpec::factor, {.key = "factor", .doc = "bending stiffness in the fold over the cloth's", .unit = "1", .min = 0, .max = 1000});
  }
};

struct FoldReport {
  std::string name;
  double angle = 0;   ///< at rest [rad]
  double band = 0;    ///< width of the cloth that is bent [m]; 0: a sharp crease
  double length = 0;  ///< of all its lines [m]
  int hinges = 0;
};

struct Folded {
  mesh::GarmentMesh garment;
  std::vector<FoldReport> folds;  ///< by name
};

/// Adds folds and their hinges to a garment, in the order of their names.
/// garment  flat panels, sewn or not
/// error    "duplicate_name", "no_line", "bad_reference", "unknown_panel", "unknown_line", "unknown_point", "bad_range", "no_vertex",
///          "free_border", "branching_fold", "roll_on_border", "narrow_roll", "flat_fold"
Result<Folded> add_folds(const mesh::GarmentMesh& garment, const std::vector<FoldSpec>& folds);

/// The hinges of all folds of a garment along the runs that they name, for a mesh that has changed since. Folds that name no
/// run have none.
/// error  as add_folds()
Result<std::vector<mesh::Hinge>> fold_hinges(const mesh::GarmentMesh& garment);

/// Hinges that hold two sewn edges at an angle. Further panels in the same seam have no part in it.
/// a       vertices of the first side in order, one row for each of its runs
/// b       all vertices of the second side
/// angle   positive: towards the face side of a's panel [rad]
/// factor  bending stiffness over that of the cloth
/// error   "angle_without_border" where a side is no border
Result<std::vector<mesh::Hinge>> seam_hinges(const mesh::GarmentMesh& garment, const std::vector<std::vector<int>>& a, const std::vector<int>& b, double angle, double factor);

/// Angle between triangles (v0, v1, o0) and (v1, v0, o1), in (-pi, pi]: 0 is flat, positive where the sides from which both
/// are seen counter-clockwise turn towards each other [rad].
double hinge_angle(const Eigen::Vector3d& v0, const Eigen::Vector3d& v1, const Eigen::Vector3d& o0, const Eigen::Vector3d& o1);

}  // namespace toile::tailor
