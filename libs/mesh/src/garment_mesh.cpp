#include "toile/mesh/garment_mesh.h"

#include "toile/base/text.h"
#include "toile/mesh/support_mesh.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

namespace toile::mesh {
namespace {

Issue invalid(std::string item, std::string what) {
  return Issue{"invalid_mesh", {.item = std::move(item)}, std::move(what), "the file is damaged or was written by another program; make it again"};
}

template <class Table>
void check_ids_and_names(const Table& table, const char* what, Issues& issues) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].id != static_cast<int>(i)) issues.push_back(invalid(fmt::format("{} {}", what, i), fmt::format("its id is {}", table[i].id)));
    if (!names.insert(table[i].name).second) issues.push_back(invalid(fmt::format("{} {}", what, i), fmt::format("the name '{}' is used twice", table[i].name)));
  }
}

bool faces_valid(const Triangles& faces, Eigen::Index vertices, Issues& issues) {
  bool good = true;
  for (Eigen::Index f = 0; f < faces.rows() && issues.size() < 20; ++f) {
    const int a = faces(f, 0), b = faces(f, 1), c = faces(f, 2);
    if (std::min({a, b, c}) < 0 || std::max({a, b, c}) >= vertices) {
      issues.push_back(invalid(fmt::format("face {}", f), fmt::format("vertex ids {} {} {} are out of range (there are {} vertices)", a, b, c, vertices)));
      good = false;
    } else if (a == b || b == c || c == a) {
      issues.push_back(invalid(fmt::format("face {}", f), fmt::format("vertex ids {} {} {} repeat", a, b, c)));
      good = false;
    }
  }
  return good;
}

}  // namespace

Issues validate(const GarmentMesh& g) {
  Issues issues;
  const Eigen::Index nv = g.x.rows(), nf = g.faces.rows();
  const auto size_check = [&](const char* name, Eigen::Index size, Eigen::Index expected) {
    if (size != expected) issues.push_back(invalid(name, fmt::format("has {} rows instead of {}", size, expected)));
  };
  size_check("u v", g.uv.rows(), nv);
  size_check("vertex panel", g.vertex_panel.size(), nv);
  size_check("face panel", g.face_panel.size(), nf);
  size_check("face laminate", g.face_laminate.size(), nf);
  for (const auto& [name, column] : g.vertex_columns) size_check(name.c_str(), static_cast<Eigen::Index>(column.size()), nv);
  for (const auto& [name, column] : g.face_columns) size_check(name.c_str(), static_cast<Eigen::Index>(column.size()), nf);
  if (!issues.empty()) return issues;

  if (!g.x.allFinite()) issues.push_back(invalid("vertex", "a position is not finite"));
  if (!g.uv.allFinite()) issues.push_back(invalid("vertex", "a panel coordinate is not finite"));
  for (const auto& [name, column] : g.vertex_columns) {
    for (double v : column.reals) {
      if (!std::isfinite(v)) { issues.push_back(invalid("vertex column " + name, "a value is not finite")); break; }
    }
  }
  check_ids_and_names(g.panels, "panel", issues);
  check_ids_and_names(g.seams, "seam", issues);
  check_ids_and_names(g.laminates, "laminate", issues);
  check_ids_and_names(g.folds, "fold", issues);
  check_ids_and_names(g.trims, "trim", issues);
  check_ids_and_names(g.closures, "closure", issues);
  check_ids_and_names(g.free_layers, "free layer", issues);
  const int panels = static_cast<int>(g.panels.size());
  const auto panel_valid = [&](int p) { return p >= 0 && p < panels; };
  for (Eigen::Index v = 0; v < nv && issues.size() < 20; ++v) {
    if (!panel_valid(g.vertex_panel[v])) issues.push_back(invalid(fmt::format("vertex {}", v), fmt::format("panel {} does not exist", g.vertex_panel[v])));
  }
  if (faces_valid(g.faces, nv, issues)) {
    for (Eigen::Index f = 0; f < nf && issues.size() < 20; ++f) {
      for (int k = 0; k < 3; ++k) {
        if (g.vertex_panel[g.faces(f, k)] != g.face_panel[f]) {
          issues.push_back(invalid(fmt::format("face {}", f), fmt::format("belongs to panel {}, its vertex {} to panel {}", g.face_panel[f], g.faces(f, k), g.vertex_panel[g.faces(f, k)])));
          break;
        }
      }
      if (g.face_laminate[f] < -1 || g.face_laminate[f] >= static_cast<int>(g.laminates.size())) {
        issues.push_back(invalid(fmt::format("face {}", f), fmt::format("laminate {} does not exist", g.face_laminate[f])));
      }
    }
  }
  const auto vertex_valid = [&](int v) { return v >= 0 && v < nv; };
  for (std::size_t i = 0; i < g.welds.size() && issues.size() < 20; ++i) {
    const Weld& w = g.welds[i];
    if (!vertex_valid(w.a) || !vertex_valid(w.b)) issues.push_back(invalid(fmt::format("weld {}", i), "a vertex id is out of range"));
    else if (w.a == w.b) issues.push_back(invalid(fmt::format("weld {}", i), "joins a vertex with itself"));
    if (w.seam < 0 || w.seam >= static_cast<int>(g.seams.size())) issues.push_back(invalid(fmt::format("weld {}", i), fmt::format("seam {} does not exist", w.seam)));
  }
  for (std::size_t i = 0; i < g.fasteners.size() && issues.size() < 20; ++i) {
    const Fastener& f = g.fasteners[i];
    if (!vertex_valid(f.a) || !vertex_valid(f.b) || f.a == f.b) issues.push_back(invalid(fmt::format("fastener {}", i), "its vertices are out of range or the same"));
    for (double value : {f.mass, f.length, f.stiffness, f.capture}) {
      if (!std::isfinite(value) || value < 0) issues.push_back(invalid(fmt::format("fastener {}", i), "mass, length, stiffness and capture must be finite and not negative"));
    }
    if (f.closure < -1 || f.closure >= static_cast<int>(g.closures.size())) issues.push_back(invalid(fmt::format("fastener {}", i), fmt::format("closure {} does not exist", f.closure)));
  }
  for (std::size_t i = 0; i < g.hinges.size() && issues.size() < 20; ++i) {
    const Hinge& h = g.hinges[i];
    const auto item = [&] { return fmt::format("hinge {}", i); };
    if (!vertex_valid(h.v0) || !vertex_valid(h.v1) || !vertex_valid(h.o0) || !vertex_valid(h.o1)) issues.push_back(invalid(item(), "a vertex id is out of range"));
    else if (h.v0 == h.v1 || h.o0 == h.o1) issues.push_back(invalid(item(), "its vertices repeat"));
    if (!(std::abs(h.rest_angle) < std::numbers::pi)) issues.push_back(invalid(item(), "its rest angle is not between -pi and pi"));
    if (!std::isfinite(h.factor) || h.factor < 0) issues.push_back(invalid(item(), "its factor must be finite and not negative"));
    if (h.fold < -1 || h.fold >= static_cast<int>(g.folds.size())) issues.push_back(invalid(item(), fmt::format("fold {} does not exist", h.fold)));
  }
  int previous_trim = 0;
  for (std::size_t i = 0; i < g.trim_segments.size() && issues.size() < 20; ++i) {
    const TrimSegment& t = g.trim_segments[i];
    const auto item = [&] { return fmt::format("trim segment {}", i); };
    if (!vertex_valid(t.a) || !vertex_valid(t.b) || t.a == t.b) issues.push_back(invalid(item(), "its vertices are out of range or the same"));
    if (t.trim < previous_trim || t.trim >= static_cast<int>(g.trims.size())) issues.push_back(invalid(item(), fmt::format("trim {} does not exist, or trims are not in order", t.trim)));
    else previous_trim = t.trim;
    if (!std::isfinite(t.rest_length) || t.rest_length <= 0) issues.push_back(invalid(item(), "its rest length must be finite and positive"));
  }
  for (const Trim& trim : g.trims) {
    for (double value : {trim.stretch, trim.bending, trim.linear_density, trim.width}) {
      if (!std::isfinite(value) || value < 0) issues.push_back(invalid("trim " + trim.name, "stretch, bending, linear density and width must be finite and not negative"));
    }
    if (trim.plies < 0) issues.push_back(invalid("trim " + trim.name, fmt::format("{} plies are not possible", trim.plies)));
    if (!std::isfinite(trim.rest_ratio) || trim.rest_ratio <= 0) issues.push_back(invalid("trim " + trim.name, "its rest ratio must be finite and positive"));
    if (trim.seam < -1 || trim.seam >= static_cast<int>(g.seams.size())) issues.push_back(invalid("trim " + trim.name, fmt::format("seam {} does not exist", trim.seam)));
  }
  for (const FreeLayer& layer : g.free_layers) {
    for (const auto* list : {&layer.panels, &layer.on}) {
      if (!std::all_of(list->begin(), list->end(), panel_valid)) issues.push_back(invalid("free layer " + layer.name, "names a panel that does not exist"));
    }
  }
  std::set<std::pair<int, std::string>> run_names;
  for (std::size_t i = 0; i < g.runs.size(); ++i) {
    const Run& run = g.runs[i];
    if (run.id != static_cast<int>(i) || !panel_valid(run.panel)) issues.push_back(invalid(fmt::format("run {}", i), "its id or panel is wrong"));
    if (!run_names.insert({run.panel, run.name}).second) issues.push_back(invalid(fmt::format("run {}", i), fmt::format("the name '{}' is used twice in its panel", run.name)));
  }
  for (const Fold& fold : g.folds) {
    if (!std::isfinite(fold.angle) || !std::isfinite(fold.radius) || fold.radius < 0) issues.push_back(invalid("fold " + fold.name, "its angle must be finite, its radius finite and not negative"));
    if (!std::isfinite(fold.factor) || fold.factor < 0) issues.push_back(invalid("fold " + fold.name, "its factor must be finite and not negative"));
    for (int run : fold.runs) {
      if (run < 0 || run >= static_cast<int>(g.runs.size())) issues.push_back(invalid("fold " + fold.name, fmt::format("line {} does not exist", run)));
    }
  }
  int previous_run = 0;
  for (std::size_t i = 0; i < g.run_vertices.size() && issues.size() < 20; ++i) {
    const RunVertex& r = g.run_vertices[i];
    if (r.run < previous_run || r.run >= static_cast<int>(g.runs.size()) || !vertex_valid(r.vertex) || !std::isfinite(r.s)) {
      issues.push_back(invalid(fmt::format("run vertex {}", i), "run or vertex is out of range, or runs are not in order"));
      continue;
    }
    if (g.vertex_panel[r.vertex] != g.runs[static_cast<std::size_t>(r.run)].panel) issues.push_back(invalid(fmt::format("run vertex {}", i), "is not of the run's panel"));
    previous_run = r.run;
  }
  for (const NamedPoint& point : g.points) {
    if (!panel_valid(point.panel) || !vertex_valid(point.vertex)) issues.push_back(invalid("point " + point.name, "panel or vertex is out of range"));
  }
  return issues;
}

Issues validate(const SupportMesh& s) {
  Issues issues;
  if (s.x.rows() == 0 || s.faces.rows() == 0) return {invalid("support", "has no vertices or no faces")};
  if (!s.x.allFinite()) issues.push_back(invalid("vertex", "a position is not finite"));
  if (s.face_region.size() != s.faces.rows()) issues.push_back(invalid("face region", fmt::format("has {} rows instead of {}", s.face_region.size(), s.faces.rows())));
  else if (s.face_region.size() > 0 && (s.face_region.minCoeff() < -1 || s.face_region.maxCoeff() >= static_cast<int>(s.region_names.size()))) issues.push_back(invalid("face region", "an index is out of range"));
  if (!faces_valid(s.faces, s.x.rows(), issues)) return issues;
  std::map<std::pair<int, int>, int> directed;
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) ++directed[{s.faces(f, k), s.faces(f, (k + 1) % 3)}];
  }
  std::size_t open = 0, doubled = 0;
  for (const auto& [edge, count] : directed) {
    if (count > 1) ++doubled;
    if (!directed.count({edge.second, edge.first})) ++open;
  }
  if (doubled > 0) issues.push_back(Issue{"not_manifold", {.item = "support"}, fmt::format("{} edges are used twice in the same direction", doubled), "orient all faces the same way and remove doubled faces"});
  if (open > 0) issues.push_back(Issue{"open_surface", {.item = "support"}, fmt::format("{} edges belong to one face only: the surface is not closed", open), "close the holes"});
  if (issues.empty() && volume(s.x, s.faces) <= 0) issues.push_back(Issue{"inside_out", {.item = "support"}, "the faces look inwards", "turn all faces round"});
  return issues;
}

double volume(const Points3& x, const Triangles& faces) {
  double total = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = x.row(faces(f, 0)), b = x.row(faces(f, 1)), c = x.row(faces(f, 2));
    total += a.dot(b.cross(c)) / 6;
  }
  return total;
}

Result<int> find_panel(const GarmentMesh& garment, const std::string& name) {
  std::vector<std::string> names;
  for (const Panel& panel : garment.panels) {
    if (panel.name == name) return panel.id;
    names.push_back(panel.name);
  }
  return Issue{"unknown_panel", {}, fmt::format("there is no panel '{}'", name), suggestion(name, names)};
}

Result<int> find_run(const GarmentMesh& garment, int panel, const std::string& name) {
  std::vector<std::string> names;
  for (const Run& run : garment.runs) {
    if (run.panel != panel) continue;
    if (run.name == name) return run.id;
    names.push_back(run.name);
  }
  const std::string& panel_name = garment.panels[static_cast<std::size_t>(panel)].name;
  return Issue{"unknown_edge", {}, fmt::format("panel '{}' has no edge '{}'", panel_name, name), suggestion(name, names)};
}

std::vector<int> run_vertex_ids(const GarmentMesh& garment, int run) {
  std::vector<int> ids;
  const auto begin = std::lower_bound(garment.run_vertices.begin(), garment.run_vertices.end(), run, [](const RunVertex& r, int id) { return r.run < id; });
  for (auto it = begin; it != garment.run_vertices.end() && it->run == run; ++it) ids.push_back(it->vertex);
  return ids;
}

Ids particles(const GarmentMesh& garment) {
  Ids root(garment.vertex_count());
  std::iota(root.data(), root.data() + root.size(), 0);
  const auto find = [&](int a) {
    while (root[a] != a) a = root[a] = root[root[a]];
    return a;
  };
  for (const Weld& weld : garment.welds) {
    const int a = find(weld.a), b = find(weld.b);
    root[std::max(a, b)] = std::min(a, b);
  }
  Ids id(root.size());
  int next = 0;
  // A root is the lowest vertex of its particle, so it has its id before any other vertex asks for it.
  for (int v = 0; v < root.size(); ++v) {
    const int r = find(v);
    id[v] = r == v ? next++ : id[r];
  }
  return id;
}

Eigen::VectorXd rest_areas(const GarmentMesh& garment) {
  Eigen::VectorXd areas(garment.face_count());
  for (Eigen::Index f = 0; f < areas.size(); ++f) {
    const Eigen::Vector2d a = garment.uv.row(garment.faces(f, 0)), b = garment.uv.row(garment.faces(f, 1)), c = garment.uv.row(garment.faces(f, 2));
    const Eigen::Vector2d p = b - a, q = c - a;
    areas[f] = 0.5 * std::abs(p.x() * q.y() - p.y() * q.x());
  }
  return areas;
}

Eigen::VectorXd vertex_masses(const GarmentMesh& garment) {
  Eigen::VectorXd masses = Eigen::VectorXd::Zero(garment.vertex_count());
  const Eigen::VectorXd areas = rest_areas(garment);
  for (Eigen::Index f = 0; f < areas.size(); ++f) {
    const int laminate = garment.face_laminate[f];
    if (laminate < 0) continue;
    const double third = areas[f] * garment.laminates[static_cast<std::size_t>(laminate)].equivalent.areal_density / 3;
    for (int k = 0; k < 3; ++k) masses[garment.faces(f, k)] += third;
  }
  for (const TrimSegment& segment : garment.trim_segments) {
    const double half = segment.mass(garment.trims[static_cast<std::size_t>(segment.trim)]) / 2;
    masses[segment.a] += half;
    masses[segment.b] += half;
  }
  for (const Fastener& fastener : garment.fasteners) {
    masses[fastener.a] += fastener.mass / 2;
    masses[fastener.b] += fastener.mass / 2;
  }
  return masses;
}

double trimmings_mass(const GarmentMesh& garment) {
  double mass = 0;
  for (const Fastener& fastener : garment.fasteners) mass += fastener.mass;
  for (const TrimSegment& segment : garment.trim_segments) mass += segment.mass(garment.trims[static_cast<std::size_t>(segment.trim)]);
  return mass;
}

}  // namespace toile::mesh
