#include "toile/inspect/diff.h"

#include "nearest.h"
#include "toile/base/parallel.h"
#include "toile/base/text.h"
#include "toile/inspect/measures.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

namespace toile::inspect {
namespace {

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

class Comparison {
 public:
  explicit Comparison(const DiffParams& params) : params_(params) {}

  DiffReport report;

  void differ(DiffLayer layer, std::string item, std::string what) { report.differences.push_back({layer, std::move(item), std::move(what)}); }

  /// Counts that must agree; false where they do not.
  bool count(const std::string& item, std::size_t a, std::size_t b) {
    if (a != b) differ(DiffLayer::structure, item, fmt::format("{} here, {} there", a, b));
    return a == b;
  }

  bool ignored(const std::string& column) const { return std::find(params_.ignore.begin(), params_.ignore.end(), column) != params_.ignore.end(); }

  template <class A, class B>
  void integers(const std::string& column, std::size_t n, const A& a, const B& b) {
    if (ignored(column)) return;
    std::size_t different = 0, first = 0;
    for (std::size_t i = n; i-- > 0;) {
      if (a(i) != b(i)) {
        ++different;
        first = i;
      }
    }
    if (different > 0) differ(DiffLayer::structure, column, fmt::format("{} of {} rows differ, first row {}: {} here, {} there", different, n, first, a(first), b(first)));
  }

  template <class A, class B>
  void reals(const std::string& column, std::size_t n, const A& a, const B& b) {
    if (ignored(column)) return;
    ColumnChange change{column, 0, tolerance(column), 0, 0};
    for (std::size_t i = 0; i < n; ++i) {
      const double d = std::abs(a(i) - b(i));
      if (d > change.largest) {
        change.largest = d;
        change.row = i;
      }
      if (params_.mode == DiffMode::exact ? !same_bits(a(i), b(i)) : d > change.tolerance * scale(column, a(i), b(i))) ++change.beyond;
    }
    if (change.beyond > 0) {
      differ(DiffLayer::numbers, column, fmt::format("{} of {} rows differ by more than {:.3g}; largest {:.3g} in row {} ({} here, {} there)", change.beyond, n, change.tolerance, change.largest, change.row,
                                                    format_number(a(change.row)), format_number(b(change.row))));
    }
    report.columns.push_back(std::move(change));
  }

  void band(const std::string& item, double a, double b, double width, bool relative) {
    BandChange change{item, a, b, width, relative};
    if (!change.within()) differ(DiffLayer::meaning, item, fmt::format("{:.6g} here, {:.6g} there; {:.3g}{} is allowed", a, b, width, relative ? " of it" : ""));
    report.bands.push_back(std::move(change));
  }

  void columns(const std::string& element, const std::map<std::string, mesh::Column>& a, const std::map<std::string, mesh::Column>& b) {
    std::set<std::string> names;
    for (const auto& [name, c] : a) names.insert(name);
    for (const auto& [name, c] : b) names.insert(name);
    for (const std::string& name : names) {
      const std::string item = element + "." + name;
      if (ignored(item)) continue;
      const auto p = a.find(name), q = b.find(name);
      if (p == a.end() || q == b.end()) {
        differ(DiffLayer::structure, item, p == a.end() ? "the column is only there" : "the column is only here");
        continue;
      }
      if (p->second.integer != q->second.integer) {
        differ(DiffLayer::structure, item, "the column holds integers on one side, numbers on the other");
        continue;
      }
      if (!count(item + " rows", p->second.size(), q->second.size())) continue;
      if (p->second.integer) integers(item, p->second.size(), [&](std::size_t i) { return p->second.integers[i]; }, [&](std::size_t i) { return q->second.integers[i]; });
      else reals(item, p->second.size(), [&](std::size_t i) { return p->second.reals[i]; }, [&](std::size_t i) { return q->second.reals[i]; });
    }
  }

  /// Two described records, field by field.
  void record(const RecordType& type, const void* a, const void* b, const std::string& path) {
    for (const Field& field : type.fields) {
      const std::string item = path.empty() ? field.key : path + "." + field.key;
      if (!ignored(item)) value(field.type, field.address(const_cast<void*>(a)), field.address(const_cast<void*>(b)), item);
    }
  }

  template <class T>
  void table(const std::string& name, const std::vector<T>& a, const std::vector<T>& b) {
    if (!count(name, a.size(), b.size())) return;
    for (std::size_t i = 0; i < a.size(); ++i) record(*record_type<T>(), &a[i], &b[i], fmt::format("{}[{}]", name, i));
  }

 private:
  double tolerance(const std::string& column) const {
    if (params_.mode == DiffMode::exact) return 0;
    if (const auto it = params_.tolerances.find(column); it != params_.tolerances.end()) return it->second;
    for (const io::ColumnInfo& info : io::column_registry()) {
      if (column == std::string(info.element) + "." + info.name) return info.tolerance;
    }
    return 1e-9;
  }
  /// Columns that nobody registered have no scale of their own: theirs is relative above 1.
  double scale(const std::string& column, double a, double b) const {
    if (params_.tolerances.count(column)) return 1;
    for (const io::ColumnInfo& info : io::column_registry()) {
      if (column == std::string(info.element) + "." + info.name) return 1;
    }
    return std::max({1.0, std::abs(a), std::abs(b)});
  }

  void number(double a, double b, const std::string& item) {
    // Table entries are computed from a handful of inputs: rounding only.
    const bool same = params_.mode == DiffMode::exact ? same_bits(a, b) : std::abs(a - b) <= 1e-9 * std::max({1.0, std::abs(a), std::abs(b)});
    if (!same) differ(DiffLayer::numbers, item, fmt::format("{} here, {} there", format_number(a), format_number(b)));
  }

  void value(const ValueType& type, void* a, void* b, const std::string& item) {
    using Kind = ValueType::Kind;
    const auto text = [&](const std::string& p, const std::string& q) {
      if (p != q) differ(DiffLayer::structure, item, fmt::format("'{}' here, '{}' there", p, q));
    };
    switch (type.kind) {
      case Kind::boolean: return text(*static_cast<bool*>(a) ? "true" : "false", *static_cast<bool*>(b) ? "true" : "false");
      case Kind::integer: return text(fmt::format("{}", type.get_integer(a)), fmt::format("{}", type.get_integer(b)));
      case Kind::number: return number(*static_cast<double*>(a), *static_cast<double*>(b), item);
      case Kind::text: return text(*static_cast<std::string*>(a), *static_cast<std::string*>(b));
      case Kind::choice: return text(fmt::format("{}", type.choice_index(a)), fmt::format("{}", type.choice_index(b)));
      case Kind::fixed_numbers:
        for (int k = 0; k < type.fixed_size; ++k) number(static_cast<double*>(a)[k], static_cast<double*>(b)[k], fmt::format("{}[{}]", item, k));
        return;
      case Kind::record: return record(*type.record, a, b, item);
      case Kind::list:
      case Kind::map:
      case Kind::optional:
        if (!count(item, type.size(a), type.size(b))) return;
        for (std::size_t i = 0; i < type.size(a); ++i) {
          if (type.kind == Kind::map && type.key(a, i) != type.key(b, i)) {
            differ(DiffLayer::structure, item, fmt::format("the key '{}' here, '{}' there", type.key(a, i), type.key(b, i)));
            return;
          }
          value(*type.element, type.at(a, i), type.at(b, i), type.kind == Kind::map ? fmt::format("{}.{}", item, type.key(a, i)) : type.kind == Kind::list ? fmt::format("{}[{}]", item, i) : item);
        }
        return;
    }
  }

  const DiffParams& params_;
};

void text_map(Comparison& c, const std::string& name, const std::map<std::string, std::string>& a, const std::map<std::string, std::string>& b) {
  std::set<std::string> keys;
  for (const auto& [key, v] : a) keys.insert(key);
  for (const auto& [key, v] : b) keys.insert(key);
  for (const std::string& key : keys) {
    const auto p = a.find(key), q = b.find(key);
    if (c.ignored(name + "." + key)) continue;
    const std::string here = p == a.end() ? "nothing" : "'" + p->second + "'", there = q == b.end() ? "nothing" : "'" + q->second + "'";
    if (here == there) continue;
    // Marks such as a residual are numbers: they may differ in their last places.
    if (p != a.end() && q != b.end()) {
      const auto x = parse_number(p->second), y = parse_number(q->second);
      if (x && y && std::abs(*x - *y) <= 1e-6 * std::max(std::abs(*x), std::abs(*y))) continue;
    }
    c.differ(DiffLayer::structure, name + "." + key, fmt::format("{} here, {} there", here, there));
  }
}

struct Meaning {
  std::map<std::string, PanelFigures> panels;
  std::vector<SeamFigures> seams;
  int euler = 0, pieces = 0;
  std::size_t openings = 0;
  double mass = 0;
};

/// The figures of the meaning layer only: no search for intersections, so that large files are compared quickly.
Meaning meaning(const mesh::GarmentMesh& g) {
  Meaning m;
  const SewnSurface sewn = sewn_surface(g);
  m.euler = mesh::euler_number(sewn.faces);
  m.pieces = mesh::component_count(sewn.faces);
  m.openings = mesh::border_loops(sewn.faces).size();
  m.seams = seam_table(g);
  for (PanelFigures& p : panel_table(g, face_strain(g))) {
    m.mass += p.mass;
    m.panels.emplace(p.name, std::move(p));
  }
  m.mass += mesh::trimmings_mass(g);
  return m;
}

void compare_meaning(Comparison& c, const DiffParams& params, const mesh::GarmentMesh& a, const mesh::GarmentMesh& b) {
  const Meaning p = meaning(a), q = meaning(b);
  if (p.euler != q.euler) c.differ(DiffLayer::meaning, "Euler number", fmt::format("{} here, {} there", p.euler, q.euler));
  if (p.pieces != q.pieces) c.differ(DiffLayer::meaning, "pieces", fmt::format("{} here, {} there", p.pieces, q.pieces));
  if (p.openings != q.openings) c.differ(DiffLayer::meaning, "openings", fmt::format("{} here, {} there", p.openings, q.openings));
  c.band("mass [kg]", p.mass, q.mass, params.area_band, true);
  for (const auto& [name, x] : p.panels) {
    const auto it = q.panels.find(name);
    if (it == q.panels.end()) {
      c.differ(DiffLayer::meaning, "panel " + name, "it is only here");
      continue;
    }
    const PanelFigures& y = it->second;
    const std::string panel = "panel " + name + ": ";
    c.band(panel + "cut area [m2]", x.cut_area, y.cut_area, params.area_band, true);
    c.band(panel + "flat area [m2]", x.flat_area, y.flat_area, params.area_band, true);
    c.band(panel + "area [m2]", x.area, y.area, 3 * params.area_band, true);
    if (params.mode != DiffMode::geometric) c.band(panel + "smallest corner [rad]", x.min_angle, y.min_angle, params.angle_band, false);
    for (const auto& [direction, s, t] : {std::tuple{"warp", &x.strain_warp, &y.strain_warp}, std::tuple{"weft", &x.strain_weft, &y.strain_weft}}) {
      c.band(fmt::format("{}{} strain, median", panel, direction), s->median, t->median, params.strain_band, false);
      c.band(fmt::format("{}{} strain, 99 %", panel, direction), s->p99, t->p99, params.strain_band, false);
    }
  }
  for (const auto& [name, y] : q.panels) {
    if (!p.panels.count(name)) c.differ(DiffLayer::meaning, "panel " + name, "it is only there");
  }
  std::map<std::string, const SeamFigures*> there;
  for (const SeamFigures& s : q.seams) there[s.name] = &s;
  for (const SeamFigures& s : p.seams) {
    const auto it = there.find(s.name);
    if (it == there.end()) {
      c.differ(DiffLayer::meaning, "seam " + s.name, "it is only here");
      continue;
    }
    c.band(fmt::format("seam {}: mismatch [m]", s.name), s.cut_a - s.cut_b, it->second->cut_a - it->second->cut_b, params.seam_band, false);
    c.band(fmt::format("seam {}: length [m]", s.name), s.now_a, it->second->now_a, params.mode == DiffMode::geometric ? std::max(params.seam_band, 0.002 * s.now_a) : params.seam_band, false);
    c.band(fmt::format("seam {}: widest gap [m]", s.name), s.max_gap, it->second->max_gap, params.seam_band, false);
    there.erase(it);
  }
  for (const auto& [name, s] : there) c.differ(DiffLayer::meaning, "seam " + name, "it is only there");
}

mesh::Triangles faces_of_panel(const mesh::GarmentMesh& g, int panel) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    if (g.face_panel[f] == panel) rows.push_back(f);
  }
  mesh::Triangles faces(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) faces.row(static_cast<Eigen::Index>(i)) = g.faces.row(rows[i]);
  return faces;
}

}  // namespace

bool BandChange::within() const {
  const double width = relative ? band * std::max(std::abs(a), std::abs(b)) : band;
  return std::abs(a - b) <= width;
}

double surface_distance(const mesh::Points3& xa, const mesh::Triangles& fa, const mesh::Points3& xb, const mesh::Triangles& fb) {
  const auto one_way = [](const mesh::Points3& x, const mesh::Triangles& faces, const mesh::Points3& y, const mesh::Triangles& others) {
    std::vector<int> used(faces.data(), faces.data() + faces.size());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    const NearestSurface surface(y, others);
    return parallel_reduce(
        used.size(), 256, 0.0,
        [&](std::size_t begin, std::size_t end) {
          double most = 0;
          for (std::size_t i = begin; i < end; ++i) most = std::max(most, surface.distance(x.row(used[i])));
          return most;
        },
        [](double p, double q) { return std::max(p, q); });
  };
  return std::max(one_way(xa, fa, xb, fb), one_way(xb, fb, xa, fa));
}

DiffReport diff(const DiffParams& params, const mesh::GarmentMesh& a, const mesh::GarmentMesh& b) {
  Comparison c(params);
  if (params.mode == DiffMode::geometric) {
    compare_meaning(c, params, a, b);
    for (const mesh::Panel& panel : a.panels) {
      const auto other = std::find_if(b.panels.begin(), b.panels.end(), [&](const mesh::Panel& p) { return p.name == panel.name; });
      if (other == b.panels.end()) continue;
      c.band("panel " + panel.name + ": distance between surfaces [m]", surface_distance(a.x, faces_of_panel(a, panel.id), b.x, faces_of_panel(b, other->id)), 0, params.distance_band, false);
    }
    text_map(c, "marks", a.marks, b.marks);
    return std::move(c.report);
  }

  const auto nv = static_cast<std::size_t>(a.vertex_count()), nf = static_cast<std::size_t>(a.face_count());
  if (c.count("vertices", nv, static_cast<std::size_t>(b.vertex_count()))) {
    const auto at = [](const auto& m, int k) { return [&m, k](std::size_t i) { return m(static_cast<Eigen::Index>(i), k); }; };
    const char* axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k) c.reals(std::string("vertex.") + axes[k], nv, at(a.x, k), at(b.x, k));
    c.reals("vertex.u", nv, at(a.uv, 0), at(b.uv, 0));
    c.reals("vertex.v", nv, at(a.uv, 1), at(b.uv, 1));
    c.integers("vertex.panel", nv, at(a.vertex_panel, 0), at(b.vertex_panel, 0));
    c.columns("vertex", a.vertex_columns, b.vertex_columns);
  }
  if (c.count("faces", nf, static_cast<std::size_t>(b.face_count()))) {
    for (int k = 0; k < 3; ++k) {
      c.integers("face.vertex_indices", nf, [&](std::size_t i) { return a.faces(static_cast<Eigen::Index>(i), k); }, [&](std::size_t i) { return b.faces(static_cast<Eigen::Index>(i), k); });
    }
    c.integers("face.panel", nf, [&](std::size_t i) { return a.face_panel[static_cast<Eigen::Index>(i)]; }, [&](std::size_t i) { return b.face_panel[static_cast<Eigen::Index>(i)]; });
    c.integers("face.laminate", nf, [&](std::size_t i) { return a.face_laminate[static_cast<Eigen::Index>(i)]; }, [&](std::size_t i) { return b.face_laminate[static_cast<Eigen::Index>(i)]; });
    c.columns("face", a.face_columns, b.face_columns);
  }
  if (c.count("welds", a.welds.size(), b.welds.size())) {
    const std::size_t n = a.welds.size();
    c.integers("weld.a", n, [&](std::size_t i) { return a.welds[i].a; }, [&](std::size_t i) { return b.welds[i].a; });
    c.integers("weld.b", n, [&](std::size_t i) { return a.welds[i].b; }, [&](std::size_t i) { return b.welds[i].b; });
    c.integers("weld.seam", n, [&](std::size_t i) { return a.welds[i].seam; }, [&](std::size_t i) { return b.welds[i].seam; });
  }
  if (c.count("fasteners", a.fasteners.size(), b.fasteners.size())) {
    const std::size_t n = a.fasteners.size();
    c.integers("fastener.a", n, [&](std::size_t i) { return a.fasteners[i].a; }, [&](std::size_t i) { return b.fasteners[i].a; });
    c.integers("fastener.b", n, [&](std::size_t i) { return a.fasteners[i].b; }, [&](std::size_t i) { return b.fasteners[i].b; });
    c.integers("fastener.kind", n, [&](std::size_t i) { return static_cast<int>(a.fasteners[i].kind); }, [&](std::size_t i) { return static_cast<int>(b.fasteners[i].kind); });
    c.reals("fastener.mass", n, [&](std::size_t i) { return a.fasteners[i].mass; }, [&](std::size_t i) { return b.fasteners[i].mass; });
    c.reals("fastener.length", n, [&](std::size_t i) { return a.fasteners[i].length; }, [&](std::size_t i) { return b.fasteners[i].length; });
    c.integers("fastener.closure", n, [&](std::size_t i) { return a.fasteners[i].closure; }, [&](std::size_t i) { return b.fasteners[i].closure; });
    c.integers("fastener.closed", n, [&](std::size_t i) { return static_cast<int>(a.fasteners[i].closed); }, [&](std::size_t i) { return static_cast<int>(b.fasteners[i].closed); });
    c.reals("fastener.stiffness", n, [&](std::size_t i) { return a.fasteners[i].stiffness; }, [&](std::size_t i) { return b.fasteners[i].stiffness; });
    c.reals("fastener.capture", n, [&](std::size_t i) { return a.fasteners[i].capture; }, [&](std::size_t i) { return b.fasteners[i].capture; });
  }
  if (c.count("hinges", a.hinges.size(), b.hinges.size())) {
    const std::size_t n = a.hinges.size();
    for (const auto& [name, member] : {std::pair{"hinge.v0", &mesh::Hinge::v0}, {"hinge.v1", &mesh::Hinge::v1}, {"hinge.o0", &mesh::Hinge::o0}, {"hinge.o1", &mesh::Hinge::o1}, {"hinge.fold", &mesh::Hinge::fold}}) {
      c.integers(name, n, [&, m = member](std::size_t i) { return a.hinges[i].*m; }, [&, m = member](std::size_t i) { return b.hinges[i].*m; });
    }
    c.reals("hinge.rest_angle", n, [&](std::size_t i) { return a.hinges[i].rest_angle; }, [&](std::size_t i) { return b.hinges[i].rest_angle; });
    c.reals("hinge.factor", n, [&](std::size_t i) { return a.hinges[i].factor; }, [&](std::size_t i) { return b.hinges[i].factor; });
  }
  if (c.count("trim segments", a.trim_segments.size(), b.trim_segments.size())) {
    const std::size_t n = a.trim_segments.size();
    for (const auto& [name, member] : {std::pair{"trim_segment.a", &mesh::TrimSegment::a}, {"trim_segment.b", &mesh::TrimSegment::b}, {"trim_segment.trim", &mesh::TrimSegment::trim}}) {
      c.integers(name, n, [&, m = member](std::size_t i) { return a.trim_segments[i].*m; }, [&, m = member](std::size_t i) { return b.trim_segments[i].*m; });
    }
    c.reals("trim_segment.rest_length", n, [&](std::size_t i) { return a.trim_segments[i].rest_length; }, [&](std::size_t i) { return b.trim_segments[i].rest_length; });
  }
  if (c.count("run vertices", a.run_vertices.size(), b.run_vertices.size())) {
    const std::size_t n = a.run_vertices.size();
    c.integers("run_vertex.run", n, [&](std::size_t i) { return a.run_vertices[i].run; }, [&](std::size_t i) { return b.run_vertices[i].run; });
    c.integers("run_vertex.vertex", n, [&](std::size_t i) { return a.run_vertices[i].vertex; }, [&](std::size_t i) { return b.run_vertices[i].vertex; });
    c.reals("run_vertex.s", n, [&](std::size_t i) { return a.run_vertices[i].s; }, [&](std::size_t i) { return b.run_vertices[i].s; });
  }
  c.table("panels", a.panels, b.panels);
  c.table("runs", a.runs, b.runs);
  c.table("points", a.points, b.points);
  c.table("fabrics", a.fabrics, b.fabrics);
  c.table("laminates", a.laminates, b.laminates);
  c.table("seams", a.seams, b.seams);
  c.table("folds", a.folds, b.folds);
  c.table("trims", a.trims, b.trims);
  c.table("closures", a.closures, b.closures);
  c.table("free layers", a.free_layers, b.free_layers);
  text_map(c, "marks", a.marks, b.marks);
  if (params.mode == DiffMode::exact) c.table("route", a.route, b.route);
  // Figures of meaning need both sides; where the structure differs they still tell how far.
  if (params.mode == DiffMode::indexed) compare_meaning(c, params, a, b);
  return std::move(c.report);
}

DiffReport diff(const DiffParams& params, const mesh::SupportMesh& a, const mesh::SupportMesh& b) {
  Comparison c(params);
  if (params.mode == DiffMode::geometric) {
    c.band("distance between surfaces [m]", surface_distance(a.x, a.faces, b.x, b.faces), 0, params.distance_band, false);
  } else {
    const auto nv = static_cast<std::size_t>(a.x.rows()), nf = static_cast<std::size_t>(a.faces.rows());
    if (c.count("vertices", nv, static_cast<std::size_t>(b.x.rows()))) {
      const char* axes[] = {"x", "y", "z"};
      for (int k = 0; k < 3; ++k) c.reals(std::string("vertex.") + axes[k], nv, [&](std::size_t i) { return a.x(static_cast<Eigen::Index>(i), k); }, [&](std::size_t i) { return b.x(static_cast<Eigen::Index>(i), k); });
    }
    if (c.count("faces", nf, static_cast<std::size_t>(b.faces.rows()))) {
      for (int k = 0; k < 3; ++k) c.integers("face.vertex_indices", nf, [&](std::size_t i) { return a.faces(static_cast<Eigen::Index>(i), k); }, [&](std::size_t i) { return b.faces(static_cast<Eigen::Index>(i), k); });
      c.integers("face.region", nf, [&](std::size_t i) { return a.face_region[static_cast<Eigen::Index>(i)]; }, [&](std::size_t i) { return b.face_region[static_cast<Eigen::Index>(i)]; });
    }
    if (a.region_names != b.region_names) c.differ(DiffLayer::structure, "regions", "the names differ");
    if (params.mode == DiffMode::exact) c.table("route", a.route, b.route);
  }
  const double point_band = params.mode == DiffMode::exact ? 0 : params.mode == DiffMode::indexed ? 1e-6 : params.distance_band;
  const auto keyed = [&](const char* what, const auto& p, const auto& q, const auto& compare) {
    for (const auto& [name, value] : p) {
      if (const auto it = q.find(name); it != q.end()) compare(std::string(what) + " " + name, value, it->second);
      else c.differ(DiffLayer::structure, std::string(what) + " " + name, "it is only here");
    }
    for (const auto& [name, value] : q) {
      if (!p.count(name)) c.differ(DiffLayer::structure, std::string(what) + " " + name, "it is only there");
    }
  };
  keyed("landmark", a.landmarks, b.landmarks, [&](const std::string& item, const auto& p, const auto& q) {
    for (std::size_t k = 0; k < 3; ++k) c.band(fmt::format("{} {} [m]", item, "xyz"[k]), p[k], q[k], point_band, false);
  });
  keyed("girth", a.girths, b.girths, [&](const std::string& item, double p, double q) { c.band(item + " [m]", p, q, point_band, false); });
  if (params.mode != DiffMode::exact) c.band("volume [m3]", mesh::volume(a.x, a.faces), mesh::volume(b.x, b.faces), params.area_band, true);
  return std::move(c.report);
}

namespace {

void compare_json(DiffReport& report, DiffMode mode, const nlohmann::ordered_json& a, const nlohmann::ordered_json& b, const std::string& path) {
  const auto differ = [&](DiffLayer layer, std::string what) { report.differences.push_back({layer, path.empty() ? "file" : path, std::move(what)}); };
  if (a.is_number() && b.is_number()) {
    const double x = a.get<double>(), y = b.get<double>();
    // A figure that is zero but for rounding has no size of its own.
    const bool same = mode == DiffMode::exact ? same_bits(x, y) : std::abs(x - y) <= 1e-12 + 1e-6 * std::max(std::abs(x), std::abs(y));
    if (!same) differ(DiffLayer::numbers, fmt::format("{} here, {} there", format_number(x), format_number(y)));
    return;
  }
  if (a.type() != b.type()) return differ(DiffLayer::structure, fmt::format("{} here, {} there", a.dump(), b.dump()));
  if (a.is_object()) {
    for (const auto& [key, value] : a.items()) {
      const std::string below = path.empty() ? key : path + "." + key;
      if (b.contains(key)) compare_json(report, mode, value, b[key], below);
      else report.differences.push_back({DiffLayer::structure, below, "it is only here"});
    }
    for (const auto& [key, value] : b.items()) {
      if (!a.contains(key)) report.differences.push_back({DiffLayer::structure, path.empty() ? key : path + "." + key, "it is only there"});
    }
  } else if (a.is_array()) {
    if (a.size() != b.size()) return differ(DiffLayer::structure, fmt::format("{} items here, {} there", a.size(), b.size()));
    for (std::size_t i = 0; i < a.size(); ++i) compare_json(report, mode, a[i], b[i], fmt::format("{}[{}]", path, i));
  } else if (a != b) {
    differ(DiffLayer::structure, fmt::format("{} here, {} there", a.dump(), b.dump()));
  }
}

}  // namespace

Result<DiffReport> diff_json(const DiffParams& params, const std::string& a, const std::string& b) {
  const auto p = nlohmann::ordered_json::parse(a, nullptr, false), q = nlohmann::ordered_json::parse(b, nullptr, false);
  if (p.is_discarded() || q.is_discarded()) return Issue{"bad_json", {}, "one of the files is not valid JSON", "make it again"};
  DiffReport report;
  compare_json(report, params.mode, p, q, "");
  return report;
}

DiffReport diff(const DiffParams& params, const Image& a, const Image& b) {
  Comparison c(params);
  if (!c.count("width", static_cast<std::size_t>(a.width), static_cast<std::size_t>(b.width)) || !c.count("height", static_cast<std::size_t>(a.height), static_cast<std::size_t>(b.height))) return std::move(c.report);
  double sum = 0;
  std::size_t far = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int most = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int d = std::abs(a.rgb[i + k] - b.rgb[i + k]);
      most = std::max(most, d);
      sum += d;
    }
    if (most > 16) ++far;
  }
  const bool exact = params.mode == DiffMode::exact;
  const double pixels = std::max<double>(1, static_cast<double>(a.rgb.size()) / 3);
  c.band("mean difference of 255", sum / (3 * pixels), 0, exact ? 0 : 0.5, false);
  c.band("part of pixels that differ by more than 16", static_cast<double>(far) / pixels, 0, exact ? 0 : 0.01, false);
  return std::move(c.report);
}

namespace {
const char* layer_name(DiffLayer layer) {
  switch (layer) {
    case DiffLayer::structure: return "structure";
    case DiffLayer::numbers: return "numbers";
    case DiffLayer::meaning: return "meaning";
  }
  return "";
}
}  // namespace

Json to_json(const DiffReport& report) {
  Json out = Json::object();
  out.set("same", report.same());
  Json differences = Json::array();
  for (const Difference& d : report.differences) differences.push(Json::object().set("layer", layer_name(d.layer)).set("item", d.item).set("what", d.what));
  out.set("differences", std::move(differences));
  Json columns = Json::array();
  for (const ColumnChange& c : report.columns) columns.push(Json::object().set("column", c.column).set("largest", c.largest).set("row", c.row).set("tolerance", c.tolerance).set("beyond", c.beyond));
  out.set("columns", std::move(columns));
  Json bands = Json::array();
  for (const BandChange& b : report.bands) bands.push(Json::object().set("item", b.item).set("a", b.a).set("b", b.b).set("band", b.band).set("relative", b.relative).set("within", b.within()));
  out.set("bands", std::move(bands));
  return out;
}

std::string to_text(const DiffReport& report) {
  std::string out = report.same() ? "the same\n" : fmt::format("different in {} points\n", report.differences.size());
  for (const Difference& d : report.differences) out += fmt::format("  {:<9} {}: {}\n", layer_name(d.layer), d.item, d.what);
  bool titled = false;
  for (const ColumnChange& c : report.columns) {
    if (c.largest == 0) continue;
    if (!titled) out += "largest changes\n";
    titled = true;
    out += fmt::format("  {:<24} {:.3g} in row {} (tolerance {:.3g})\n", c.column, c.largest, c.row, c.tolerance);
  }
  if (!titled && !report.columns.empty()) out += "no number changed\n";
  titled = false;
  for (const BandChange& b : report.bands) {
    if (b.a == b.b) continue;
    if (!titled) out += "figures\n";
    titled = true;
    out += fmt::format("  {:<44} {:.6g} -> {:.6g} (band {:.3g}{})\n", b.item, b.a, b.b, b.band, b.relative ? " of it" : "");
  }
  return out;
}

}  // namespace toile::inspect
