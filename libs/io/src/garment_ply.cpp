#include <algorithm>

#include "ply_format.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

namespace toile::io {
namespace {

constexpr const char* garment_magic = "toile-garment 1";

/// The tables that stand as YAML in the file's comments.
struct Header {
  std::map<std::string, std::string> units{{"length", "m"}, {"angle", "rad"}, {"mass", "kg"}, {"time", "s"}};
  std::vector<mesh::Panel> panels;
  std::vector<mesh::Run> runs;
  std::vector<mesh::NamedPoint> points;
  std::vector<fabric::Card> fabrics;
  std::vector<mesh::Laminate> laminates;
  std::vector<mesh::Seam> seams;
  std::vector<mesh::Fold> folds;
  std::vector<mesh::Trim> trims;
  std::vector<mesh::Closure> closures;
  std::vector<mesh::FreeLayer> free_layers;
  std::map<std::string, std::string> marks;
  std::vector<mesh::RouteEntry> route;
  static void describe(auto& f) {
    f(&Header::units, {.key = "units", .doc = "units of all numbers"});
    f(&Header::panels, {.key = "panels", .doc = "panels"});
    f(&Header::runs, {.key = "runs", .doc = "named lines of panels"});
    f(&Header::points, {.key = "points", .doc = "named points of panels"});
    f(&Header::fabrics, {.key = "fabrics", .doc = "fabric cards"});
    f(&Header::laminates, {.key = "laminates", .doc = "what faces are made of"});
    f(&Header::seams, {.key = "seams", .doc = "seams"});
    f(&Header::folds, {.key = "folds", .doc = "fold lines"});
    f(&Header::trims, {.key = "trims", .doc = "tapes, threads, elastics, drawstrings"});
    f(&Header::closures, {.key = "closures", .doc = "buttons, hooks, snaps, zips"});
    f(&Header::free_layers, {.key = "free_layers", .doc = "layers with grids of their own"});
    f(&Header::marks, {.key = "marks", .doc = "facts that a stage leaves for later ones"});
    f(&Header::route, {.key = "route", .doc = "stages that the garment went through"});
  }
};

// name, element, type, unit, meaning, comparison tolerance. Positions: 1 um is far below any tolerance of the trade and far
// above what differs between compilers.
constexpr ColumnInfo registry[] = {
    {"vertex", "x", "double", "m", "position", 1e-6},
    {"vertex", "y", "double", "m", "position", 1e-6},
    {"vertex", "z", "double", "m", "position", 1e-6},
    {"vertex", "u", "double", "m", "panel coordinate along the weft", 1e-9},
    {"vertex", "v", "double", "m", "panel coordinate along the warp", 1e-9},
    {"vertex", "panel", "int", "", "panel id", 0},
    {"vertex", "vx", "double", "m/s", "velocity", 1e-5},
    {"vertex", "vy", "double", "m/s", "velocity", 1e-5},
    {"vertex", "vz", "double", "m/s", "velocity", 1e-5},
    {"vertex", "seam_gap", "double", "m", "distance to the particle it is sewn to", 1e-6},
    {"vertex", "ease", "double", "m", "distance to the support", 1e-6},
    {"vertex", "edge_strain", "double", "1", "of the edge at the vertex with the largest strain, after placement", 1e-5},
    {"vertex", "slip_weft_plus", "double", "1/m", "friction between yarns: curvature along the weft without its moment, towards greater u", 1e-3},
    {"vertex", "slip_weft_minus", "double", "1/m", "the same towards smaller u", 1e-3},
    {"vertex", "slip_warp_plus", "double", "1/m", "the same along the warp, towards greater v", 1e-3},
    {"vertex", "slip_warp_minus", "double", "1/m", "the same towards smaller v", 1e-3},
    {"face", "slip_weft", "double", "1/m", "friction between yarns, off the grid: curvature along the weft without its moment", 1e-3},
    {"face", "slip_warp", "double", "1/m", "the same along the warp", 1e-3},
    {"face", "slip_shear", "double", "rad", "shear angle without friction's force", 1e-5},
    {"face", "slip_stretch_weft", "double", "N/m", "force of the weft's tensile curve where friction has none", 1e-2},
    {"face", "slip_stretch_warp", "double", "N/m", "the same of the warp", 1e-2},
    {"face", "slip_pair_weft", "double", "N/m", "the same of the mean stretch of a face and its partner off the grid", 1e-2},
    {"face", "slip_pair_warp", "double", "N/m", "the same of the warp", 1e-2},
    {"face", "vertex_indices", "list", "", "three vertex ids, counter-clockwise from the face side", 0},
    {"face", "panel", "int", "", "panel id", 0},
    {"face", "laminate", "int", "", "laminate id, -1: none yet", 0},
    {"face", "strain_warp", "double", "1", "elongation along the warp", 1e-5},
    {"face", "strain_weft", "double", "1", "elongation along the weft", 1e-5},
    {"face", "strain_bias", "double", "1", "elongation along the bias", 1e-5},
    {"face", "warp_angle", "double", "rad", "of the warp from its wanted direction, after placement", 1e-4},
    {"face", "cuts", "int", "", "after placement: 1 cuts a face of the cloth, 2 of the support, 3 both", 0},
    {"face", "shear", "double", "rad", "change of the angle between warp and weft", 1e-5},
    {"face", "tension_warp", "double", "N/m", "tension along the warp", 1e-2},
    {"face", "tension_weft", "double", "N/m", "tension along the weft", 1e-2},
    {"weld", "a", "int", "", "vertex id", 0},
    {"weld", "b", "int", "", "vertex id of the same particle", 0},
    {"weld", "seam", "int", "", "seam id", 0},
    {"fastener", "a", "int", "", "vertex id", 0},
    {"fastener", "b", "int", "", "vertex id", 0},
    {"fastener", "kind", "int", "", "0 button, 1 hook, 2 snap, 3 tooth of a zip", 0},
    {"fastener", "mass", "double", "kg", "mass, shared between the two", 1e-9},
    {"fastener", "length", "double", "m", "distance at which the two are held", 1e-9},
    {"fastener", "closure", "int", "", "closure id, or -1", 0},
    {"fastener", "closed", "int", "", "1: holds, or will hold; 0: open", 0},
    {"fastener", "stiffness", "double", "N/m", "of the spring between the two; 0: a constraint", 1e-6},
    {"fastener", "capture", "double", "m", "distance at which it takes hold; 0: at once", 1e-9},
    {"hinge", "v0", "int", "", "first vertex of the edge", 0},
    {"hinge", "v1", "int", "", "second vertex of the edge", 0},
    {"hinge", "o0", "int", "", "opposite corner of the triangle that runs v0 to v1", 0},
    {"hinge", "o1", "int", "", "opposite corner of the other triangle", 0},
    {"hinge", "rest_angle", "double", "rad", "angle at rest, positive: face sides towards each other", 1e-9},
    {"hinge", "factor", "double", "1", "bending stiffness over the cloth's", 1e-9},
    {"hinge", "fold", "int", "", "fold id, or -1", 0},
    {"trim_segment", "a", "int", "", "vertex id", 0},
    {"trim_segment", "b", "int", "", "vertex id", 0},
    {"trim_segment", "trim", "int", "", "trim id", 0},
    {"trim_segment", "rest_length", "double", "m", "length at rest", 1e-9},
    {"run_vertex", "run", "int", "", "run id", 0},
    {"run_vertex", "vertex", "int", "", "vertex id", 0},
    {"run_vertex", "s", "double", "m", "arc length along the run's true curve", 1e-9},
};

std::vector<double> column_of(const mesh::Points3& points, int k) {
  std::vector<double> values(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) values[static_cast<std::size_t>(i)] = points(i, k);
  return values;
}

template <class Items, class Get>
auto gather(const Items& items, Get get) {
  std::vector<decltype(get(items.front()))> values;
  values.reserve(items.size());
  for (const auto& item : items) values.push_back(get(item));
  return values;
}

std::vector<int> ids_of(const mesh::Ids& ids) { return {ids.data(), ids.data() + ids.size()}; }
mesh::Ids to_ids(const std::vector<int>& values) { return Eigen::Map<const mesh::Ids>(values.data(), static_cast<Eigen::Index>(values.size())); }

ply::Property to_property(const std::string& name, const mesh::Column& column) {
  return column.integer ? ply::integer_column(name, column.integers) : ply::real_column(name, column.reals);
}

std::map<std::string, mesh::Column> further_columns(const ply::Columns& columns) {
  std::map<std::string, mesh::Column> result;
  for (const ply::Property* property : columns.rest()) {
    if (property->list) continue;
    result[property->name] = mesh::Column{!ply::is_real(property->type), property->reals, property->integers};
  }
  return result;
}

bool has_magic(const ply::Document& document, const char* magic) { return std::find(document.comments.begin(), document.comments.end(), magic) != document.comments.end(); }

}  // namespace

std::span<const ColumnInfo> column_registry() { return registry; }

Result<mesh::GarmentMesh> parse_garment(std::string_view bytes, const std::string& name) {
  TOILE_TRY(const ply::Document document, ply::parse(bytes, name));
  if (!has_magic(document, garment_magic)) {
    return Issue{"not_a_garment", {.file = name}, "this PLY file is not a garment (no comment 'toile-garment 1')", "give a file that toile-mesh or a later stage wrote"};
  }
  Header header;
  Issues issues = read_record(ply::metadata(document), name, *record_type<Header>(), &header, Units::si);
  // Positions inside the YAML are not lines of the file.
  for (Issue& issue : issues) issue.place.line = issue.place.column = 0;
  static constexpr std::string_view known[] = {"vertex", "face", "weld", "fastener", "hinge", "trim_segment", "run_vertex"};
  for (const ply::Element& element : document.elements) {
    if (std::find(std::begin(known), std::end(known), element.name) == std::end(known)) {
      issues.push_back({"bad_ply", {.file = name}, fmt::format("the element '{}' is not known", element.name), "the file was written by a newer version or another program"});
    }
  }
  mesh::GarmentMesh garment;
  garment.panels = std::move(header.panels);
  garment.runs = std::move(header.runs);
  garment.points = std::move(header.points);
  garment.fabrics = std::move(header.fabrics);
  garment.laminates = std::move(header.laminates);
  garment.seams = std::move(header.seams);
  garment.folds = std::move(header.folds);
  garment.trims = std::move(header.trims);
  garment.closures = std::move(header.closures);
  garment.free_layers = std::move(header.free_layers);
  garment.marks = std::move(header.marks);
  garment.route = std::move(header.route);

  ply::Columns vertex(document, name, "vertex", issues);
  const auto nv = static_cast<Eigen::Index>(vertex.rows());
  garment.x.resize(nv, 3);
  garment.uv.resize(nv, 2);
  const char* axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) garment.x.col(k) = Eigen::Map<const Eigen::VectorXd>(vertex.reals(axes[k]).data(), nv);
  garment.uv.col(0) = Eigen::Map<const Eigen::VectorXd>(vertex.reals("u").data(), nv);
  garment.uv.col(1) = Eigen::Map<const Eigen::VectorXd>(vertex.reals("v").data(), nv);
  garment.vertex_panel = to_ids(vertex.integers("panel"));
  garment.vertex_columns = further_columns(vertex);

  ply::Columns face(document, name, "face", issues);
  garment.faces = Eigen::Map<const mesh::Triangles>(face.triples("vertex_indices").data(), static_cast<Eigen::Index>(face.rows()), 3);
  garment.face_panel = to_ids(face.integers("panel"));
  garment.face_laminate = to_ids(face.integers("laminate"));
  garment.face_columns = further_columns(face);

  ply::Columns weld(document, name, "weld", issues);
  const auto weld_a = weld.integers("a"), weld_b = weld.integers("b"), weld_seam = weld.integers("seam");
  for (std::size_t i = 0; i < weld.rows(); ++i) garment.welds.push_back({weld_a[i], weld_b[i], weld_seam[i]});

  ply::Columns fastener(document, name, "fastener", issues);
  const auto fastener_a = fastener.integers("a"), fastener_b = fastener.integers("b"), kind = fastener.integers("kind");
  const auto mass = fastener.reals("mass"), length = fastener.reals("length"), stiffness = fastener.reals("stiffness"), capture = fastener.reals("capture");
  const auto closure = fastener.integers("closure"), closed = fastener.integers("closed");
  for (std::size_t i = 0; i < fastener.rows(); ++i) {
    if (kind[i] < 0 || kind[i] > 3) issues.push_back({"bad_ply", {.file = name, .item = fmt::format("fastener {}", i)}, fmt::format("kind {} is not known", kind[i]), "make the file again"});
    else garment.fasteners.push_back({fastener_a[i], fastener_b[i], static_cast<mesh::Fastener::Kind>(kind[i]), mass[i], length[i], closure[i], closed[i] != 0, stiffness[i], capture[i]});
  }
  ply::Columns hinge(document, name, "hinge", issues);
  const auto v0 = hinge.integers("v0"), v1 = hinge.integers("v1"), o0 = hinge.integers("o0"), o1 = hinge.integers("o1"), fold = hinge.integers("fold");
  const auto rest_angle = hinge.reals("rest_angle"), factor = hinge.reals("factor");
  for (std::size_t i = 0; i < hinge.rows(); ++i) garment.hinges.push_back({v0[i], v1[i], o0[i], o1[i], rest_angle[i], factor[i], fold[i]});
  ply::Columns trim_segment(document, name, "trim_segment", issues);
  const auto trim_a = trim_segment.integers("a"), trim_b = trim_segment.integers("b"), trim = trim_segment.integers("trim");
  const auto rest_length = trim_segment.reals("rest_length");
  for (std::size_t i = 0; i < trim_segment.rows(); ++i) garment.trim_segments.push_back({trim_a[i], trim_b[i], trim[i], rest_length[i]});
  ply::Columns run_vertex(document, name, "run_vertex", issues);
  const auto run = run_vertex.integers("run"), id = run_vertex.integers("vertex");
  const auto s = run_vertex.reals("s");
  for (std::size_t i = 0; i < run_vertex.rows(); ++i) garment.run_vertices.push_back({run[i], id[i], s[i]});

  if (issues.empty()) issues = mesh::validate(garment);
  for (Issue& issue : issues) issue.place.file = name;
  if (!issues.empty()) return issues;
  return garment;
}

Result<mesh::GarmentMesh> read_garment(const std::string& path) {
  TOILE_TRY(const std::string bytes, read_file(path));
  return parse_garment(bytes, path);
}

std::string format_garment(const mesh::GarmentMesh& g, Encoding encoding) {
  Header header;
  header.panels = g.panels;
  header.runs = g.runs;
  header.points = g.points;
  header.fabrics = g.fabrics;
  header.laminates = g.laminates;
  header.seams = g.seams;
  header.folds = g.folds;
  header.trims = g.trims;
  header.closures = g.closures;
  header.free_layers = g.free_layers;
  header.marks = g.marks;
  header.route = g.route;
  ply::Document document;
  document.comments.push_back(garment_magic);
  ply::add_metadata(document, block_yaml_si(*record_type<Header>(), &header));

  ply::Element vertex{"vertex", static_cast<std::size_t>(g.x.rows()), {}};
  const char* axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) vertex.properties.push_back(ply::real_column(axes[k], column_of(g.x, k)));
  for (int k = 0; k < 2; ++k) {
    const Eigen::VectorXd column = g.uv.col(k);
    vertex.properties.push_back(ply::real_column(k == 0 ? "u" : "v", {column.data(), column.data() + column.size()}));
  }
  vertex.properties.push_back(ply::integer_column("panel", ids_of(g.vertex_panel)));
  for (const auto& [name, column] : g.vertex_columns) vertex.properties.push_back(to_property(name, column));
  document.elements.push_back(std::move(vertex));

  ply::Element face{"face", static_cast<std::size_t>(g.faces.rows()), {}};
  ply::Property corners = ply::integer_column("vertex_indices", {g.faces.data(), g.faces.data() + g.faces.size()});
  corners.list = true;
  face.properties.push_back(std::move(corners));
  face.properties.push_back(ply::integer_column("panel", ids_of(g.face_panel)));
  face.properties.push_back(ply::integer_column("laminate", ids_of(g.face_laminate)));
  for (const auto& [name, column] : g.face_columns) face.properties.push_back(to_property(name, column));
  document.elements.push_back(std::move(face));

  if (!g.fasteners.empty()) {
    const auto& items = g.fasteners;
    document.elements.push_back({"fastener", items.size(),
                                 {ply::integer_column("a", gather(items, [](const auto& f) { return f.a; })), ply::integer_column("b", gather(items, [](const auto& f) { return f.b; })),
                                  ply::integer_column("kind", gather(items, [](const auto& f) { return static_cast<int>(f.kind); })),
                                  ply::real_column("mass", gather(items, [](const auto& f) { return f.mass; })), ply::real_column("length", gather(items, [](const auto& f) { return f.length; })),
                                  ply::integer_column("closure", gather(items, [](const auto& f) { return f.closure; })), ply::integer_column("closed", gather(items, [](const auto& f) { return f.closed ? 1 : 0; })),
                                  ply::real_column("stiffness", gather(items, [](const auto& f) { return f.stiffness; })), ply::real_column("capture", gather(items, [](const auto& f) { return f.capture; }))}});
  }
  if (!g.hinges.empty()) {
    const auto& items = g.hinges;
    document.elements.push_back({"hinge", items.size(),
                                 {ply::integer_column("v0", gather(items, [](const auto& h) { return h.v0; })), ply::integer_column("v1", gather(items, [](const auto& h) { return h.v1; })),
                                  ply::integer_column("o0", gather(items, [](const auto& h) { return h.o0; })), ply::integer_column("o1", gather(items, [](const auto& h) { return h.o1; })),
                                  ply::real_column("rest_angle", gather(items, [](const auto& h) { return h.rest_angle; })), ply::real_column("factor", gather(items, [](const auto& h) { return h.factor; })),
                                  ply::integer_column("fold", gather(items, [](const auto& h) { return h.fold; }))}});
  }
  if (!g.trim_segments.empty()) {
    const auto& items = g.trim_segments;
    document.elements.push_back({"trim_segment", items.size(),
                                 {ply::integer_column("a", gather(items, [](const auto& t) { return t.a; })), ply::integer_column("b", gather(items, [](const auto& t) { return t.b; })),
                                  ply::integer_column("trim", gather(items, [](const auto& t) { return t.trim; })), ply::real_column("rest_length", gather(items, [](const auto& t) { return t.rest_length; }))}});
  }
  if (!g.welds.empty()) {
    const auto& items = g.welds;
    document.elements.push_back({"weld", items.size(),
                                 {ply::integer_column("a", gather(items, [](const auto& w) { return w.a; })), ply::integer_column("b", gather(items, [](const auto& w) { return w.b; })),
                                  ply::integer_column("seam", gather(items, [](const auto& w) { return w.seam; }))}});
  }
  if (!g.run_vertices.empty()) {
    const auto& items = g.run_vertices;
    document.elements.push_back({"run_vertex", items.size(),
                                 {ply::integer_column("run", gather(items, [](const auto& r) { return r.run; })), ply::integer_column("vertex", gather(items, [](const auto& r) { return r.vertex; })),
                                  ply::real_column("s", gather(items, [](const auto& r) { return r.s; }))}});
  }
  return ply::format(document, encoding);
}

}  // namespace toile::io
