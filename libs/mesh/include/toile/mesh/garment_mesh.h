// The garment: panels as one triangle mesh, with everything later stages need. docs/garment-file.md describes its file.
#pragma once

#include "toile/base/fields.h"
#include "toile/fabric/card.h"
#include "toile/mesh/types.h"

#include <map>
#include <string>
#include <vector>

namespace toile::mesh {

/// A cut piece of cloth. Panel coordinates: v along the warp (grain line), u along the weft, face side seen with u to
/// the right and v up.
struct Panel {
  int id = 0;  ///< equals its index
  std::string name;
  std::string piece;      ///< pattern piece it was cut from; mirrored and plain copies share it
  bool mirrored = false;
  double cell_warp = 0;   ///< grid size along v [m]
  double cell_weft = 0;   ///< grid size along u [m]
  double cut_area = 0;    ///< area inside the true outline (curves, not the mesh) [m2]
  static void describe(auto& f) {
    f(&Panel::id, {.key = "id", .doc = "index"});
    f(&Panel::name, {.key = "name", .doc = "unique name"});
    f(&Panel::piece, {.key = "piece", .doc = "pattern piece it was cut from"});
    f(&Panel::mirrored, {.key = "mirrored", .doc = "cut with the piece turned over"});
    f(&Panel::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp", .unit = "m"});
    f(&Panel::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft", .unit = "m"});
    f(&Panel::cut_area, {.key = "cut_area", .doc = "area inside the true outline", .unit = "m2"});
  }
};

/// A named line of a panel (an edge of its border or an internal line) as an ordered row of vertices (`run_vertices`).
struct Run {
  int id = 0;  ///< equals its index
  int panel = 0;
  std::string name;
  double length = 0;      ///< of the true curve [m]
  bool closed = false;    ///< first and last vertex are the same
  bool internal = false;  ///< not part of the border
  static void describe(auto& f) {
    f(&Run::id, {.key = "id", .doc = "index"});
    f(&Run::panel, {.key = "panel", .doc = "panel id"});
    f(&Run::name, {.key = "name", .doc = "name, unique in its panel"});
    f(&Run::length, {.key = "length", .doc = "length of the true curve", .unit = "m"});
    f(&Run::closed, {.key = "closed", .doc = "first and last vertex are the same"});
    f(&Run::internal, {.key = "internal", .doc = "not part of the border"});
  }
};

/// A named point of a panel that is a vertex (corner, notch, drill point).
struct NamedPoint {
  int panel = 0;
  std::string name;
  int vertex = 0;
  static void describe(auto& f) {
    f(&NamedPoint::panel, {.key = "panel", .doc = "panel id"});
    f(&NamedPoint::name, {.key = "name", .doc = "name, unique in its panel"});
    f(&NamedPoint::vertex, {.key = "vertex", .doc = "vertex id"});
  }
};

/// One sheet of a laminate, by fabric name; the first is the outermost (face side).
struct Ply {
  std::string fabric;
  double areal_density = 0;  ///< as used, of this sheet [kg/m2]
  static void describe(auto& f) {
    f(&Ply::fabric, {.key = "fabric", .doc = "fabric name"});
    f(&Ply::areal_density, {.key = "W", .doc = "mass per area of this sheet", .unit = "kg/m2"});
  }
};

/// What a face is made of: one or more bonded sheets and the equivalent single fabric that the mechanics uses.
struct Laminate {
  int id = 0;  ///< equals its index
  std::string name;
  std::vector<Ply> plies;
  fabric::Card equivalent;
  static void describe(auto& f) {
    f(&Laminate::id, {.key = "id", .doc = "index"});
    f(&Laminate::name, {.key = "name", .doc = "name"});
    f(&Laminate::plies, {.key = "plies", .doc = "bonded sheets, face side first"});
    f(&Laminate::equivalent, {.key = "equivalent", .doc = "equivalent single fabric"});
  }
};

struct Seam {
  int id = 0;  ///< equals its index
  std::string name;
  std::string kind = "plain";
  double length_a = 0;  ///< length of the first side along the true curves [m]
  double length_b = 0;  ///< of the second side [m]
  double bending_factor = 1;  ///< bending stiffness along the seam line over that of the cloth [1]
  static void describe(auto& f) {
    f(&Seam::id, {.key = "id", .doc = "index"});
    f(&Seam::name, {.key = "name", .doc = "name"});
    f(&Seam::kind, {.key = "kind", .doc = "plain, dart, ..."});
    f(&Seam::length_a, {.key = "length_a", .doc = "length of the first side", .unit = "m"});
    f(&Seam::length_b, {.key = "length_b", .doc = "length of the second side", .unit = "m"});
    f(&Seam::bending_factor, {.key = "bending_factor", .doc = "bending stiffness along the seam over the cloth's", .unit = "1"});
  }
};

/// One stage that an artefact went through.
struct RouteEntry {
  std::string stage;
  int version = 0;
  std::string params;                         ///< effective parameters, canonical YAML flow text
  std::map<std::string, std::string> inputs;  ///< port name -> content hash
  static void describe(auto& f) {
    f(&RouteEntry::stage, {.key = "stage", .doc = "program"});
    f(&RouteEntry::version, {.key = "version", .doc = "version of the stage's result"});
    f(&RouteEntry::params, {.key = "params", .doc = "effective parameters"});
    f(&RouteEntry::inputs, {.key = "inputs", .doc = "content hash of each input"});
  }
};

/// Two vertices that are the same particle. Rows of one seam stand in seam order.
struct Weld {
  int a = 0, b = 0, seam = 0;
};

/// Two vertices held together by a button, hook or snap, with its mass [kg] shared between them.
struct Fastener {
  enum class Kind : int { button = 0, hook = 1, snap = 2 };
  int a = 0, b = 0;
  Kind kind = Kind::button;
  double mass = 0;    ///< [kg]
  double length = 0;  ///< distance at which they are held [m]
};

/// A vertex of a run at arc length s [m] along the run's true curve.
struct RunVertex {
  int run = 0, vertex = 0;
  double s = 0;
};

/// A further per-vertex or per-face column that rides along in the file (exactly one of the two arrays is used).
struct Column {
  bool integer = false;
  std::vector<double> reals;
  std::vector<int> integers;
  std::size_t size() const { return integer ? integers.size() : reals.size(); }
};

/// Vertices are never merged along seams: `welds` says which are the same particle. So panel coordinates stay per
/// vertex and ids are stable from mesh to drape.
struct GarmentMesh {
  // vertices
  Points3 x;         ///< positions [m], |V| x 3
  Points2 uv;        ///< panel coordinates [m], |V| x 2; v along the warp
  Ids vertex_panel;  ///< |V|
  // faces, all of one panel each, counter-clockwise in (u, v)
  Triangles faces;    ///< |F| x 3
  Ids face_panel;     ///< |F|
  Ids face_laminate;  ///< |F|; index into laminates, or -1 before toile-layer
  // items
  std::vector<Weld> welds;
  std::vector<Fastener> fasteners;
  std::vector<RunVertex> run_vertices;  ///< grouped by run, in order along it
  // tables
  std::vector<Panel> panels;
  std::vector<Run> runs;
  std::vector<NamedPoint> points;
  std::vector<fabric::Card> fabrics;
  std::vector<Laminate> laminates;
  std::vector<Seam> seams;
  std::vector<RouteEntry> route;
  std::map<std::string, std::string> marks;  ///< short facts a stage leaves for later ones, e.g. converged: "no"
  // columns that a stage adds (velocity vx vy vz, warp strain …); later stages keep those they do not know
  std::map<std::string, Column> vertex_columns;
  std::map<std::string, Column> face_columns;

  Eigen::Index vertex_count() const { return x.rows(); }
  Eigen::Index face_count() const { return faces.rows(); }
};

/// Everything that must hold for a garment: array sizes, index ranges, finite numbers, no repeated vertex in a face,
/// faces inside one panel, ids equal to indices, unique names, welds between different vertices, runs in range.
Issues validate(const GarmentMesh& garment);

/// Index of the panel or run of that name, or an issue that suggests the nearest name.
Result<int> find_panel(const GarmentMesh& garment, const std::string& name);
Result<int> find_run(const GarmentMesh& garment, int panel, const std::string& name);
/// Vertices of a run in order.
std::vector<int> run_vertex_ids(const GarmentMesh& garment, int run);

/// Particle id of every vertex: welded vertices share one. Ids are dense and ordered by the lowest vertex of a particle.
/// ret  |V|
Ids particles(const GarmentMesh& garment);

/// Areas in panel coordinates, |F| [m2].
Eigen::VectorXd rest_areas(const GarmentMesh& garment);
/// Mass of each vertex [kg], |V|: a third of each adjacent face's mass plus its share of fasteners. Faces without a
/// laminate weigh nothing.
Eigen::VectorXd vertex_masses(const GarmentMesh& garment);

}  // namespace toile::mesh
