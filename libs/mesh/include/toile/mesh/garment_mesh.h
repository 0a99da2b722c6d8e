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
  std::string material;   ///< what the pattern says it is cut from ("fabric", "lining"); may be empty
  bool mirrored = false;
  double cell_warp = 0;   ///< grid size along v [m]
  double cell_weft = 0;   ///< grid size along u [m]
  double cut_area = 0;    ///< area inside the true outline (curves, not the mesh) [m2]
  double allowance_area = 0;  ///< of the seam allowances outside it [m2]
  int order = 0;          ///< of free layers: where panels lie on each other, the greater is farther from the body
  static void describe(auto& f) {
    f(&Panel::id, {.key = "id", .doc = "index"});
    f(&Panel::name, {.key = "name", .doc = "unique name"});
    f(&Panel::piece, {.key = "piece", .doc = "pattern piece it was cut from"});
    f(&Panel::material, {.key = "material", .doc = "what the pattern says it is cut from"});
    f(&Panel::mirrored, {.key = "mirrored", .doc = "cut with the piece turned over"});
    f(&Panel::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp", .unit = "m"});
    f(&Panel::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft", .unit = "m"});
    f(&Panel::cut_area, {.key = "cut_area", .doc = "area inside the true outline", .unit = "m2"});
    f(&Panel::allowance_area, {.key = "allowance_area", .doc = "area of the seam allowances outside it", .unit = "m2"});
    f(&Panel::order, {.key = "order", .doc = "of free layers: the greater is farther from the body"});
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
  double allowance = 0;   ///< seam allowance outside it [m]
  static void describe(auto& f) {
    f(&Run::id, {.key = "id", .doc = "index"});
    f(&Run::panel, {.key = "panel", .doc = "panel id"});
    f(&Run::name, {.key = "name", .doc = "name, unique in its panel"});
    f(&Run::length, {.key = "length", .doc = "length of the true curve", .unit = "m"});
    f(&Run::closed, {.key = "closed", .doc = "first and last vertex are the same"});
    f(&Run::internal, {.key = "internal", .doc = "not part of the border"});
    f(&Run::allowance, {.key = "allowance", .doc = "seam allowance outside it", .unit = "m"});
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
  std::string layer;         ///< name of the layer it came with; empty: the cloth itself
  double areal_density = 0;  ///< as used, of this sheet [kg/m2]
  static void describe(auto& f) {
    f(&Ply::fabric, {.key = "fabric", .doc = "fabric name"});
    f(&Ply::layer, {.key = "layer", .doc = "layer it came with; empty: the cloth itself"});
    f(&Ply::areal_density, {.key = "W", .doc = "mass per area of this sheet", .unit = "kg/m2"});
  }
};

/// What a face is made of: one or more sheets and the equivalent single fabric that the mechanics uses.
struct Laminate {
  int id = 0;  ///< equals its index
  std::string name;
  std::string rule = "single";  ///< how the equivalent was found: single, additive, laminate, sliding (toile-layer)
  std::vector<Ply> plies;
  fabric::Card equivalent;
  static void describe(auto& f) {
    f(&Laminate::id, {.key = "id", .doc = "index"});
    f(&Laminate::name, {.key = "name", .doc = "name"});
    f(&Laminate::rule, {.key = "rule", .doc = "how the equivalent was found: single, additive, laminate, sliding"});
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

/// A fold line: where the cloth bends at rest (`hinges` hold the angles edge by edge).
struct Fold {
  int id = 0;  ///< equals its index
  std::string name;
  std::string kind = "crease";  ///< crease, roll, hem, knife, box, ... (free text)
  double angle = 0;   ///< rest angle over the whole fold, positive: towards the face side (a valley seen from it) [rad]
  double radius = 0;  ///< of the bend; 0: a sharp crease [m]
  std::vector<int> runs;  ///< lines that it runs along, by id; empty where none is known
  double factor = 1;      ///< bending stiffness in the fold over that of the cloth [1]
  static void describe(auto& f) {
    f(&Fold::id, {.key = "id", .doc = "index"});
    f(&Fold::name, {.key = "name", .doc = "name"});
    f(&Fold::kind, {.key = "kind", .doc = "crease, roll, hem, knife, box, ..."});
    f(&Fold::angle, {.key = "angle", .doc = "rest angle over the whole fold, positive: towards the face side", .unit = "rad"});
    f(&Fold::radius, {.key = "radius", .doc = "radius of the bend; 0: a sharp crease", .unit = "m"});
    f(&Fold::runs, {.key = "runs", .doc = "ids of the lines that it runs along"});
    f(&Fold::factor, {.key = "factor", .doc = "bending stiffness in the fold over the cloth's", .unit = "1"});
  }
};

/// A line-like material on the cloth: a tape, the thread of a seam, a seam's allowances, an elastic band, a drawstring.
/// Its pieces are `trim_segments`. It pulls with stretch * (length / rest length - 1) and bends with `bending`.
struct Trim {
  int id = 0;  ///< equals its index
  std::string name;
  std::string kind = "tape";   ///< thread, allowance, tape, elastic, drawstring
  int seam = -1;               ///< seam that it belongs to, or -1
  double stretch = 0;          ///< force per strain [N]
  double bending = 0;          ///< moment per curvature of the line, out of the cloth's plane [N*m2]
  double linear_density = 0;   ///< mass per rest length before `rest_ratio` [kg/m]
  double rest_ratio = 1;       ///< rest length over the length of the cloth under it [1]
  bool slack = false;          ///< pulls only, never pushes
  double width = 0;            ///< across the line; 0: not known [m]
  int plies = 0;               ///< of an allowance: sheets of its panel's cloth, whose mass and bending toile-layer fills in
  static void describe(auto& f) {
    f(&Trim::id, {.key = "id", .doc = "index"});
    f(&Trim::name, {.key = "name", .doc = "name"});
    f(&Trim::kind, {.key = "kind", .doc = "thread, allowance, tape, elastic, drawstring"});
    f(&Trim::seam, {.key = "seam", .doc = "seam that it belongs to, or -1"});
    f(&Trim::stretch, {.key = "stretch", .doc = "force per strain", .unit = "N"});
    f(&Trim::bending, {.key = "bending", .doc = "moment per curvature of the line", .unit = "N*m2"});
    f(&Trim::linear_density, {.key = "linear_density", .doc = "mass per length of the cloth under it", .unit = "kg/m"});
    f(&Trim::rest_ratio, {.key = "rest_ratio", .doc = "rest length over the length of the cloth under it", .unit = "1"});
    f(&Trim::slack, {.key = "slack", .doc = "pulls only, never pushes"});
    f(&Trim::width, {.key = "width", .doc = "across the line; 0: not known", .unit = "m"});
    f(&Trim::plies, {.key = "plies", .doc = "of an allowance: sheets of its panel's cloth"});
  }
};

/// A button, a hook, a snap, or a zip with all its teeth; its halves are rows of `fasteners`.
struct Closure {
  int id = 0;  ///< equals its index
  std::string name;
  std::string kind = "button";  ///< button, hook, snap, zip
  static void describe(auto& f) {
    f(&Closure::id, {.key = "id", .doc = "index"});
    f(&Closure::name, {.key = "name", .doc = "name"});
    f(&Closure::kind, {.key = "kind", .doc = "button, hook, snap, zip"});
  }
};

/// A layer that keeps its own grid (lining, facing, patch pocket) and where it lies.
struct FreeLayer {
  int id = 0;  ///< equals its index
  std::string name;
  std::vector<int> panels;  ///< that it consists of
  std::vector<int> on;      ///< panels that it lies on
  bool outside = false;     ///< on their face side; otherwise on their back
  static void describe(auto& f) {
    f(&FreeLayer::id, {.key = "id", .doc = "index"});
    f(&FreeLayer::name, {.key = "name", .doc = "name"});
    f(&FreeLayer::panels, {.key = "panels", .doc = "panels that it consists of"});
    f(&FreeLayer::on, {.key = "on", .doc = "panels that it lies on"});
    f(&FreeLayer::outside, {.key = "outside", .doc = "on their face side; otherwise on their back"});
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

/// Two vertices held together by a button, hook, snap or a zip's tooth, with its mass [kg] shared between them.
struct Fastener {
  enum class Kind : int { button = 0, hook = 1, snap = 2, zip = 3 };
  int a = 0, b = 0;
  Kind kind = Kind::button;
  double mass = 0;       ///< [kg]
  double length = 0;     ///< distance at which they are held (a button's shank) [m]
  int closure = -1;      ///< index into closures, or -1
  bool closed = true;    ///< an open one only weighs
  double stiffness = 0;  ///< of the spring between them [N/m]; 0: a constraint
  double capture = 0;    ///< distance at which it takes hold; 0: at once [m]
};

/// An edge that is bent at rest or stiffer than its cloth: v0-v1 with the opposite corners o0, o1 of its two triangles. On a
/// seam the two triangles have vertices of their own; v0, v1 are those of o0's triangle, which runs v0 -> v1.
struct Hinge {
  int v0 = 0, v1 = 0, o0 = 0, o1 = 0;
  double rest_angle = 0;  ///< in (-pi, pi), positive: the face sides turn towards each other; 0 is flat [rad]
  double factor = 1;      ///< bending stiffness over that of the cloth [1]
  int fold = -1;          ///< index into folds, or -1
};

/// A piece of a trim between two vertices.
struct TrimSegment {
  int a = 0, b = 0, trim = 0;
  double rest_length = 0;  ///< [m]
  /// [kg]
  double mass(const Trim& of) const { return of.linear_density * rest_length / of.rest_ratio; }
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
  std::vector<Hinge> hinges;
  std::vector<TrimSegment> trim_segments;  ///< grouped by trim, in order along it
  std::vector<RunVertex> run_vertices;  ///< grouped by run, in order along it
  // tables
  std::vector<Panel> panels;
  std::vector<Run> runs;
  std::vector<NamedPoint> points;
  std::vector<fabric::Card> fabrics;
  std::vector<Laminate> laminates;
  std::vector<Seam> seams;
  std::vector<Fold> folds;
  std::vector<Trim> trims;
  std::vector<Closure> closures;
  std::vector<FreeLayer> free_layers;
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
/// Mass of each vertex [kg], |V|: a third of each adjacent face's mass plus its share of trims and fasteners. Faces without
/// a laminate weigh nothing.
Eigen::VectorXd vertex_masses(const GarmentMesh& garment);
/// Mass of all trims and fasteners [kg].
double trimmings_mass(const GarmentMesh& garment);

}  // namespace toile::mesh
