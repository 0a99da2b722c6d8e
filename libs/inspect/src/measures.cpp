#include "toile/inspect/measures.h"

#include "toile/base/parallel.h"
#include "toile/base/text.h"
#include "toile/contact/exact.h"
#include "toile/contact/support_field.h"
#include "toile/geometry/slice.h"
#include "toile/mesh/topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace toile::inspect {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<double> selected(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& rows) {
  std::vector<double> result;
  result.reserve(rows.size());
  for (const Eigen::Index row : rows) result.push_back(values[row]);
  return result;
}

std::vector<double> to_vector(const Eigen::VectorXd& values) { return {values.data(), values.data() + values.size()}; }

double face_area(const mesh::GarmentMesh& g, Eigen::Index f) {
  const Vector3d a = g.x.row(g.faces(f, 0)), b = g.x.row(g.faces(f, 1)), c = g.x.row(g.faces(f, 2));
  return 0.5 * (b - a).cross(c - a).norm();
}

double smallest_angle(const mesh::GarmentMesh& g, Eigen::Index f) {
  double angle = std::numbers::pi;
  for (int k = 0; k < 3; ++k) {
    const Vector2d p = g.uv.row(g.faces(f, k)), d = g.uv.row(g.faces(f, (k + 1) % 3)).transpose() - p, e = g.uv.row(g.faces(f, (k + 2) % 3)).transpose() - p;
    angle = std::min(angle, std::atan2(std::abs(d.x() * e.y() - d.y() * e.x()), d.dot(e)));
  }
  return angle;
}

Result<std::pair<int, std::string>> split_reference(const mesh::GarmentMesh& g, const std::string& text, const std::string& item) {
  const auto dot = text.find('.');
  if (dot == std::string::npos) return Issue{"bad_reference", {.item = item}, fmt::format("'{}' is not of the form panel.name", text), "write it like front.hem"};
  auto panel = mesh::find_panel(g, text.substr(0, dot));
  if (!panel) {
    Issues issues = panel.issues();
    for (Issue& issue : issues) issue.place.item = item;
    return issues;
  }
  return std::pair{*panel, text.substr(dot + 1)};
}

double polyline_length(const mesh::Points3& x, const std::vector<int>& ids) {
  double length = 0;
  for (std::size_t i = 1; i < ids.size(); ++i) length += (x.row(ids[i]) - x.row(ids[i - 1])).norm();
  return length;
}
double polyline_length(const mesh::Points2& uv, const std::vector<int>& ids) {
  double length = 0;
  for (std::size_t i = 1; i < ids.size(); ++i) length += (uv.row(ids[i]) - uv.row(ids[i - 1])).norm();
  return length;
}

std::vector<RunFigures> run_figures(const mesh::GarmentMesh& g) {
  std::vector<RunFigures> result;
  for (const mesh::Run& run : g.runs) {
    const std::vector<int> ids = mesh::run_vertex_ids(g, run.id);
    result.push_back({g.panels[static_cast<std::size_t>(run.panel)].name, run.name, run.internal, run.length, polyline_length(g.uv, ids), polyline_length(g.x, ids)});
  }
  return result;
}

std::vector<OpeningFigures> opening_figures(const mesh::GarmentMesh& g, const SewnSurface& sewn) {
  // Which cloth edge stands behind an edge between particles, and to which run a cloth edge belongs.
  std::map<std::pair<int, int>, std::pair<int, int>> cloth_edge;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = g.faces(f, k), b = g.faces(f, (k + 1) % 3);
      cloth_edge[{sewn.particle[a], sewn.particle[b]}] = {a, b};
    }
  }
  std::map<std::pair<int, int>, int> run_of;
  for (std::size_t i = 1; i < g.run_vertices.size(); ++i) {
    const auto &p = g.run_vertices[i - 1], &q = g.run_vertices[i];
    if (p.run == q.run) run_of[std::minmax(p.vertex, q.vertex)] = p.run;
  }
  std::vector<OpeningFigures> result;
  for (const std::vector<int>& loop : mesh::border_loops(sewn.faces)) {
    OpeningFigures opening;
    Vector3d area = Vector3d::Zero();
    geometry::Points3 points(static_cast<Eigen::Index>(loop.size()), 3);
    for (std::size_t i = 0; i < loop.size(); ++i) points.row(static_cast<Eigen::Index>(i)) = sewn.x.row(loop[i]);
    opening.centre = points.colwise().mean();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int p = loop[i], q = loop[(i + 1) % loop.size()];
      const Vector3d a = sewn.x.row(p), b = sewn.x.row(q);
      opening.now += (b - a).norm();
      area += 0.5 * (a - opening.centre).cross(b - opening.centre);
      const auto edge = cloth_edge.find({p, q});
      if (edge == cloth_edge.end()) continue;
      const auto [va, vb] = edge->second;
      opening.flat += (g.uv.row(va) - g.uv.row(vb)).norm();
      const auto run = run_of.find(std::minmax(va, vb));
      if (run == run_of.end()) continue;
      const mesh::Run& r = g.runs[static_cast<std::size_t>(run->second)];
      const std::string name = g.panels[static_cast<std::size_t>(r.panel)].name + "." + r.name;
      if (std::find(opening.runs.begin(), opening.runs.end(), name) == opening.runs.end()) opening.runs.push_back(name);
    }
    if (area.norm() > 1e-12) opening.tape = geometry::tape_girth(points, area.normalized());
    result.push_back(std::move(opening));
  }
  return result;
}

/// Height of a landmark by its name or that name with a usual ending.
std::optional<double> landmark_height(const mesh::SupportMesh& support, const std::string& name) {
  for (const char* ending : {"", "_front", "_left", "_back"}) {
    const auto it = support.landmarks.find(name + ending);
    if (it != support.landmarks.end()) return it->second[1];
  }
  return std::nullopt;
}

Vector3d middle(const geometry::Polyline& curve) { return curve.points.colwise().mean(); }

const geometry::Polyline* largest(const std::vector<geometry::Polyline>& curves) {
  const geometry::Polyline* best = nullptr;
  double best_area = -1;
  for (const auto& curve : curves) {
    const double area = curve.closed ? geometry::enclosed_area(curve, Vector3d::UnitY()) : 0;
    if (area > best_area) {
      best_area = area;
      best = &curve;
    }
  }
  return best;
}

std::optional<GirthFigures> girth_at(const std::string& name, double height, const SewnSurface& sewn, const std::vector<char>& keep, const mesh::SupportMesh* support) {
  GirthFigures result{name, height, {}, {}, {}};
  const geometry::Plane plane{{0, height, 0}, Vector3d::UnitY()};
  const auto cloth = geometry::slice(sewn.x, sewn.faces, plane, keep);
  if (cloth.empty()) return std::nullopt;
  std::optional<Vector3d> axis;
  if (support != nullptr) {
    // The trunk is the largest of the sections: arms and legs are smaller.
    const auto body = geometry::slice(support->x, support->faces, plane);
    if (const auto* trunk = largest(body)) {
      axis = middle(*trunk);
      result.body = geometry::tape_girth(trunk->points, plane.normal);
    }
  }
  if (!axis) axis = middle(*largest(cloth));
  const geometry::Polyline* around = nullptr;
  double area = 0;
  for (const auto& curve : cloth) {
    if (!curve.closed || !geometry::encloses(curve, plane.normal, *axis)) continue;
    const double a = geometry::enclosed_area(curve, plane.normal);
    if (around == nullptr || a > area) {
      around = &curve;
      area = a;
    }
  }
  if (around != nullptr) {
    result.girth = geometry::length(*around);
    result.tape = geometry::tape_girth(around->points, plane.normal);
    return result;
  }
  // An open front: the tape goes round all pieces of cloth that belong to the trunk. Sleeves close round something else.
  std::vector<Vector3d> points;
  for (const auto& curve : cloth) {
    if (curve.closed) continue;
    for (Eigen::Index i = 0; i < curve.points.rows(); ++i) points.push_back(curve.points.row(i));
  }
  if (points.size() >= 3) {
    geometry::Points3 x(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = points[i];
    result.tape = geometry::tape_girth(x, plane.normal);
  }
  return result;
}

std::vector<double> signed_distances(const mesh::Points3& points, const contact::SupportField& field) {
  std::vector<contact::SurfacePoint> nearest;
  std::vector<int> warm, rows(static_cast<std::size_t>(points.rows()));
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int>(i);
  field.nearest(points, 1e6, nearest, warm);
  std::vector<double> result(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result[i] = std::abs(nearest[i].distance);
  for (const contact::Penetration& p : field.penetrations(points, rows)) result[static_cast<std::size_t>(p.vertex)] = -p.depth;
  return result;
}

SupportFigures support_figures(const mesh::GarmentMesh& g, const contact::Surface& cloth, const mesh::SupportMesh& support, Depth depth) {
  SupportFigures result;
  const contact::Surface surface = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  result.vertex_ease = signed_distances(g.x, contact::SupportField(surface, support.x));
  for (const double e : result.vertex_ease) {
    if (e < 0) ++result.penetrating_vertices;
    result.max_penetration = std::max(result.max_penetration, -e);
    result.mean_ease += e;
  }
  if (!result.vertex_ease.empty()) result.mean_ease /= static_cast<double>(result.vertex_ease.size());
  result.ease = spread(result.vertex_ease);
  if (depth == Depth::quick) return result;
  std::set<int> cutting;
  for (const contact::FacePair& pair : contact::support_intersections(cloth, g.x, surface, support.x)) cutting.insert(pair.a);
  result.support_intersections = cutting.size();
  return result;
}

}  // namespace

Spread spread(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto rank = [&](double q) { return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))]; };
  return {values.front(), rank(0.01), rank(0.5), rank(0.99), values.back()};
}

std::vector<SeamFigures> seam_table(const mesh::GarmentMesh& g) {
  std::vector<SeamFigures> result;
  for (const mesh::Seam& seam : g.seams) result.push_back({seam.name, seam.kind, 0, seam.length_a, seam.length_b});
  // What each vertex is sewn to, by seam and side.
  struct Stitch {
    int seam, side, partner;
  };
  std::vector<std::vector<Stitch>> stitches(static_cast<std::size_t>(g.vertex_count()));
  for (const mesh::Weld& w : g.welds) {
    SeamFigures& s = result[static_cast<std::size_t>(w.seam)];
    const double gap = (g.x.row(w.a) - g.x.row(w.b)).norm();
    s.max_gap = std::max(s.max_gap, gap);
    s.mean_gap += gap;
    ++s.welds;
    stitches[static_cast<std::size_t>(w.a)].push_back({w.seam, 0, w.b});
    stitches[static_cast<std::size_t>(w.b)].push_back({w.seam, 1, w.a});
  }
  for (SeamFigures& s : result) {
    if (s.welds > 0) s.mean_gap /= static_cast<double>(s.welds);
  }

  // The pieces of runs whose two ends a seam holds on one side. The tip of a dart is one vertex and in no weld: it ends both legs.
  std::set<std::array<int, 2>> pieces;
  for (std::size_t k = 1; k < g.run_vertices.size(); ++k) {
    const auto &from = g.run_vertices[k - 1], &to = g.run_vertices[k];
    if (from.run == to.run) pieces.insert({std::min(from.vertex, to.vertex), std::max(from.vertex, to.vertex)});
  }
  const auto is_piece = [&](int u, int v) { return pieces.count({std::min(u, v), std::max(u, v)}) != 0; };
  for (const auto& piece : pieces) {
    std::set<std::pair<int, int>> held;  // seam and side
    for (const auto& [u, v] : {std::pair{piece[0], piece[1]}, std::pair{piece[1], piece[0]}}) {
      const auto& beyond = stitches[static_cast<std::size_t>(v)];
      for (const Stitch& s : stitches[static_cast<std::size_t>(u)]) {
        const bool sewn = std::any_of(beyond.begin(), beyond.end(), [&](const Stitch& t) { return t.seam == s.seam && t.side == s.side; });
        const bool tip = !sewn && std::none_of(beyond.begin(), beyond.end(), [&](const Stitch& t) { return t.seam == s.seam; }) && is_piece(s.partner, v);
        if (sewn || tip) held.emplace(s.seam, s.side);
      }
    }
    const double length = (g.x.row(piece[0]) - g.x.row(piece[1])).norm();
    for (const auto& [seam, side] : held) {
      SeamFigures& s = result[static_cast<std::size_t>(seam)];
      if (s.cut_a > 0 || s.cut_b > 0) (side == 0 ? s.now_a : s.now_b) += length;  // tacks have no length
    }
  }
  return result;
}

std::vector<PanelFigures> panel_table(const mesh::GarmentMesh& g, const FaceStrain& strain) {
  std::vector<std::vector<Eigen::Index>> faces_of(g.panels.size());
  std::vector<std::size_t> vertices_of(g.panels.size(), 0);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) faces_of[static_cast<std::size_t>(g.face_panel[f])].push_back(f);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) ++vertices_of[static_cast<std::size_t>(g.vertex_panel[v])];
  const Eigen::VectorXd rest = mesh::rest_areas(g);
  std::vector<PanelFigures> result;
  for (std::size_t p = 0; p < g.panels.size(); ++p) {
    const mesh::Panel& panel = g.panels[p];
    PanelFigures figures;
    figures.name = panel.name;
    figures.piece = panel.piece;
    figures.mirrored = panel.mirrored;
    figures.vertices = vertices_of[p];
    figures.faces = faces_of[p].size();
    figures.cut_area = panel.cut_area;
    figures.min_angle = std::numbers::pi;
    for (const Eigen::Index f : faces_of[p]) {
      figures.flat_area += rest[f];
      figures.area += face_area(g, f);
      figures.min_angle = std::min(figures.min_angle, smallest_angle(g, f));
      const int laminate = g.face_laminate[f];
      if (laminate >= 0) figures.mass += rest[f] * g.laminates[static_cast<std::size_t>(laminate)].equivalent.areal_density;
    }
    // What the true outline weighs at the panel's mean density.
    const double outline = figures.cut_area > 0 ? figures.cut_area : figures.flat_area;
    figures.mass_expected = figures.flat_area > 0 ? figures.mass / figures.flat_area * outline : 0;
    figures.strain_warp = spread(selected(strain.warp, faces_of[p]));
    figures.strain_weft = spread(selected(strain.weft, faces_of[p]));
    figures.max_shear = spread(selected(strain.shear.cwiseAbs(), faces_of[p])).max;
    result.push_back(std::move(figures));
  }
  return result;
}

std::vector<double> signed_distances(const mesh::Points3& points, const mesh::SupportMesh& support) {
  const contact::Surface surface = contact::make_surface(static_cast<int>(support.x.rows()), support.faces);
  return signed_distances(points, contact::SupportField(surface, support.x));
}

SewnSurface sewn_surface(const mesh::GarmentMesh& g) {
  SewnSurface sewn;
  sewn.particle = mesh::particles(g);
  const int n = sewn.particle.size() > 0 ? sewn.particle.maxCoeff() + 1 : 0;
  sewn.x = mesh::Points3::Zero(n, 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(n);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    sewn.x.row(sewn.particle[v]) += g.x.row(v);
    count[sewn.particle[v]] += 1;
  }
  for (int p = 0; p < n; ++p) sewn.x.row(p) /= count[p];
  sewn.faces = mesh::mapped(g.faces, sewn.particle);
  return sewn;
}

Result<Figures> measure(const MeasureParams& params, const mesh::GarmentMesh& g, const mesh::SupportMesh* support, Depth depth) {
  Issues issues;
  Figures r;
  if (const auto it = g.marks.find("converged"); it != g.marks.end()) r.converged = it->second == "yes" || it->second == "true";
  r.marks = g.marks;
  r.vertices = static_cast<std::size_t>(g.vertex_count());
  r.faces = static_cast<std::size_t>(g.face_count());
  r.welds = g.welds.size();
  r.fasteners = g.fasteners.size();
  const SewnSurface sewn = sewn_surface(g);
  r.particles = static_cast<std::size_t>(sewn.x.rows());
  r.pieces = mesh::component_count(sewn.faces);
  r.euler_number = mesh::euler_number(sewn.faces);

  r.strain = face_strain(g);
  r.tension = face_tension(g, r.strain);
  r.warp = spread(to_vector(r.strain.warp));
  r.weft = spread(to_vector(r.strain.weft));
  r.bias = spread(to_vector(r.strain.bias));
  r.shear = spread(to_vector(r.strain.shear.cwiseAbs()));
  if (r.faces > 0) {
    r.max_tension_warp = r.tension.warp.maxCoeff();
    r.max_tension_weft = r.tension.weft.maxCoeff();
  }

  const contact::Surface cloth = contact::make_surface(static_cast<int>(g.vertex_count()), g.faces, sewn.particle);
  if (depth == Depth::full) {
    std::set<int> faces;
    const auto pairs = contact::self_intersections(cloth, g.x);
    for (const contact::FacePair& pair : pairs) faces.insert({pair.a, pair.b});
    r.self_intersections = pairs.size();
    r.self_intersecting_faces = faces.size();
  }
  if (support != nullptr) r.support = support_figures(g, cloth, *support, depth);

  std::vector<std::vector<Eigen::Index>> faces_of(g.panels.size());
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    faces_of[static_cast<std::size_t>(g.face_panel[f])].push_back(f);
    if (g.face_laminate[f] < 0) ++r.unassigned_faces;
  }
  r.panels = panel_table(g, r.strain);
  r.min_angle = std::numbers::pi;
  for (const PanelFigures& p : r.panels) {
    r.cut_area += p.cut_area;
    r.flat_area += p.flat_area;
    r.area += p.area;
    r.mass += p.mass;
    r.mass_expected += p.mass_expected;
    r.min_angle = std::min(r.min_angle, p.min_angle);
  }
  if (r.support) {
    std::vector<std::vector<double>> ease(g.panels.size());
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) ease[static_cast<std::size_t>(g.vertex_panel[v])].push_back(r.support->vertex_ease[static_cast<std::size_t>(v)]);
    for (std::size_t p = 0; p < ease.size(); ++p) r.panels[p].ease = spread(std::move(ease[p]));
  }
  r.mass += mesh::trimmings_mass(g);
  r.mass_expected += mesh::trimmings_mass(g);
  if (r.vertices > 0) {
    const Eigen::VectorXd masses = mesh::vertex_masses(g);
    const double total = masses.sum();
    r.centre_of_mass = total > 0 ? Vector3d((masses.transpose() * g.x).transpose() / total) : Vector3d(g.x.colwise().mean());
    r.low = g.x.colwise().minCoeff();
    r.high = g.x.colwise().maxCoeff();
  }

  r.seams = seam_table(g);
  for (const SeamFigures& s : r.seams) {
    r.max_seam_gap = std::max(r.max_seam_gap, s.max_gap);
    r.total_seam_gap += s.mean_gap * static_cast<double>(s.welds);
  }
  if (r.welds > 0) r.mean_seam_gap = r.total_seam_gap / static_cast<double>(r.welds);
  r.openings = opening_figures(g, sewn);
  r.runs = run_figures(g);

  // Girths.
  const std::vector<char> every(r.faces, 1);
  if (params.girths.empty() && support != nullptr) {
    for (const char* level : {"chest", "bust", "waist", "hip", "seat"}) {
      const auto height = landmark_height(*support, level);
      if (!height) continue;
      if (const auto girth = girth_at(level, *height, sewn, every, support)) r.girths.push_back(*girth);
    }
  }
  for (const GirthRequest& request : params.girths) {
    const std::string item = "girths: " + request.name;
    std::vector<char> keep = every;
    if (!request.panels.empty()) {
      keep.assign(r.faces, 0);
      for (const std::string& name : request.panels) {
        const auto panel = mesh::find_panel(g, name);
        if (!panel) {
          for (Issue issue : panel.issues()) {
            issue.place.item = item;
            issues.push_back(issue);
          }
          continue;
        }
        for (const Eigen::Index f : faces_of[static_cast<std::size_t>(*panel)]) keep[static_cast<std::size_t>(f)] = 1;
      }
    }
    std::optional<double> height = request.height;
    if (!request.at.empty()) {
      if (support == nullptr) {
        issues.push_back(Issue{"needs_support", {.item = item}, fmt::format("the landmark '{}' is one of a support, and none is given", request.at), "add --support FILE, or give a height"});
        continue;
      }
      height = landmark_height(*support, request.at);
      if (!height) {
        std::vector<std::string> known;
        for (const auto& [name, position] : support->landmarks) known.push_back(name);
        issues.push_back(Issue{"unknown_landmark", {.item = item}, fmt::format("the support has no landmark '{}'", request.at), suggestion(request.at, known)});
        continue;
      }
    }
    const auto girth = girth_at(request.name, *height, sewn, keep, support);
    r.girths.push_back(girth ? *girth : GirthFigures{request.name, *height, {}, {}, {}});
  }

  // Lengths.
  for (const LengthRequest& request : params.lengths) {
    const std::string item = "lengths: " + request.name;
    LengthFigures figures{request.name, {}, {}, {}, {}};
    const auto fail = [&](Issues found) {
      for (Issue& issue : found) issue.place.item = item;
      append(issues, found);
    };
    for (const std::string& reference : request.runs) {
      const auto name = split_reference(g, reference, item);
      if (!name) {
        fail(name.issues());
        continue;
      }
      const auto run = mesh::find_run(g, name->first, name->second);
      if (!run) {
        fail(run.issues());
        continue;
      }
      const RunFigures& along = r.runs[static_cast<std::size_t>(*run)];
      figures.cut = figures.cut.value_or(0) + along.cut;
      figures.now = figures.now.value_or(0) + along.now;
    }
    if (!request.from.empty()) {
      std::optional<Vector3d> ends[2];
      for (int k = 0; k < 2; ++k) {
        const std::string& reference = k == 0 ? request.from : request.to;
        const auto name = split_reference(g, reference, item);
        if (!name) {
          fail(name.issues());
          continue;
        }
        std::vector<std::string> known;
        for (const mesh::NamedPoint& point : g.points) {
          if (point.panel != name->first) continue;
          known.push_back(point.name);
          if (point.name == name->second) ends[k] = g.x.row(point.vertex);
        }
        if (!ends[k]) issues.push_back(Issue{"unknown_point", {.item = item}, fmt::format("there is no point '{}'", reference), suggestion(name->second, known)});
      }
      if (ends[0] && ends[1]) {
        figures.straight = (*ends[1] - *ends[0]).norm();
        figures.drop = ends[0]->y() - ends[1]->y();
      }
    }
    r.lengths.push_back(std::move(figures));
  }
  if (!issues.empty()) return issues;
  return r;
}

Issues failed_checks(const Checks& checks, const Figures& r, const mesh::GarmentMesh& g) {
  Issues issues;
  const auto fail = [&](const char* code, std::string item, std::string what, std::string remedy) {
    issues.push_back(Issue{code, {.item = std::move(item)}, std::move(what), std::move(remedy), Category::check});
  };
  const auto panel_of_face = [&](Eigen::Index f) { return "panel " + g.panels[static_cast<std::size_t>(g.face_panel[f])].name; };
  const auto strain_check = [&](const char* direction, const Eigen::VectorXd& values) {
    if (values.size() == 0) return;
    Eigen::Index at = 0;
    const double most = values.maxCoeff(&at);
    if (checks.max_strain && most > *checks.max_strain) {
      fail("max_strain", panel_of_face(at), fmt::format("the greatest {} strain is {:.3g} % (face {}); {:.3g} % is allowed", direction, 100 * most, at, 100 * *checks.max_strain),
           "choose a larger size or another cloth, or look for a snag at that place");
    }
    const double least = values.minCoeff(&at);
    if (checks.max_compression && -least > *checks.max_compression) {
      fail("max_compression", panel_of_face(at), fmt::format("the greatest {} shortening is {:.3g} % (face {}); {:.3g} % is allowed", direction, -100 * least, at, 100 * *checks.max_compression),
           "let the simulation run to rest, or use a finer grid");
    }
  };
  strain_check("warp", r.strain.warp);
  strain_check("weft", r.strain.weft);
  if (checks.max_shear && r.shear.max > *checks.max_shear) {
    Eigen::Index at = 0;
    r.strain.shear.cwiseAbs().maxCoeff(&at);
    const double degrees = 180 / std::numbers::pi;
    fail("max_shear", panel_of_face(at), fmt::format("the greatest shear angle is {:.3g} deg (face {}); {:.3g} deg is allowed", degrees * r.shear.max, at, degrees * *checks.max_shear), "look at a picture with --color shear");
  }
  const auto count_check = [&](const char* code, const std::optional<int>& limit, std::optional<std::size_t> count, const char* what, const char* remedy) {
    if (!limit) return;
    if (!count) fail(code, "checks", fmt::format("{}: cannot be counted without a support", what), "add --support FILE");
    else if (*count > static_cast<std::size_t>(*limit)) fail(code, "garment", fmt::format("{} {}; {} allowed", *count, what, *limit), remedy);
  };
  count_check("penetrating_vertices", checks.penetrating_vertices, r.support ? std::optional(r.support->penetrating_vertices) : std::nullopt, "vertices are inside the support", "simulate longer, or place the garment clear of the body");
  count_check("support_intersections", checks.support_intersections, r.support ? r.support->support_intersections : std::nullopt, "faces cut the support", "use a finer grid or a smoother support");
  count_check("self_intersections", checks.self_intersections, r.self_intersections, "pairs of faces cut each other", "place the panels clear of one another");
  for (const SeamFigures& s : r.seams) {
    if (checks.max_seam_gap && s.max_gap > *checks.max_seam_gap) {
      fail("max_seam_gap", "seam " + s.name, fmt::format("stands open by {:.3g} mm; {:.3g} mm are allowed", 1e3 * s.max_gap, 1e3 * *checks.max_seam_gap), "let the simulation close the seams");
    }
    const double longer = std::max(s.cut_a, s.cut_b);
    if (checks.max_seam_mismatch && longer > 0 && std::abs(s.cut_a - s.cut_b) / longer > *checks.max_seam_mismatch) {
      fail("max_seam_mismatch", "seam " + s.name, fmt::format("its sides are {:.1f} mm and {:.1f} mm long as cut; {:.3g} % of difference is allowed", 1e3 * s.cut_a, 1e3 * s.cut_b, 100 * *checks.max_seam_mismatch), "mend the pattern, or allow the ease");
    }
  }
  if (checks.mass_error) {
    const double error = r.mass_expected > 0 ? std::abs(r.mass / r.mass_expected - 1) : 1;
    if (error > *checks.mass_error) fail("mass_error", "garment", fmt::format("the mass is {:.6g} g, cut area times areal density {:.6g} g: {:.3g} % apart; {:.3g} % is allowed", 1e3 * r.mass, 1e3 * r.mass_expected, 100 * error, 100 * *checks.mass_error), "use a finer grid along curved edges, or give every panel a fabric");
  }
  if (checks.converged && !r.converged.value_or(false)) {
    fail("converged", "garment", r.converged ? "the simulation stopped before the garment was at rest" : "the garment has not been simulated", "simulate it longer");
  }
  return issues;
}

mesh::GarmentMesh with_maps(mesh::GarmentMesh g, const Figures& figures) {
  const auto set = [](std::map<std::string, mesh::Column>& columns, const char* name, std::vector<double> values) { columns[name] = mesh::Column{false, std::move(values), {}}; };
  set(g.face_columns, "strain_warp", to_vector(figures.strain.warp));
  set(g.face_columns, "strain_weft", to_vector(figures.strain.weft));
  set(g.face_columns, "strain_bias", to_vector(figures.strain.bias));
  set(g.face_columns, "shear", to_vector(figures.strain.shear));
  set(g.face_columns, "tension_warp", to_vector(figures.tension.warp));
  set(g.face_columns, "tension_weft", to_vector(figures.tension.weft));
  if (figures.support) set(g.vertex_columns, "ease", figures.support->vertex_ease);
  return g;
}

}  // namespace toile::inspect
