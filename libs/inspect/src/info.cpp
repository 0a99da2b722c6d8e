#include "toile/inspect/info.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <numbers>

#include "text_table.h"

namespace toile::inspect {
namespace {

constexpr double degree = std::numbers::pi / 180;

std::string percent(double v) { return fmt::format("{:.2f}", 100 * v); }
std::string millimetres(double v) {
  const std::string text = fmt::format("{:.1f}", 1e3 * v);
  return text == "-0.0" ? "0.0" : text;
}

std::string route_text(const std::vector<mesh::RouteEntry>& route) {
  std::string out;
  for (const mesh::RouteEntry& entry : route) out += fmt::format("  {} (result version {}) {}\n", entry.stage, entry.version, entry.params.size() > 100 ? entry.params.substr(0, 97) + "..." : entry.params);
  return out;
}

Json route_json(const std::vector<mesh::RouteEntry>& route) {
  Json out = Json::array();
  for (const mesh::RouteEntry& entry : route) {
    Json inputs = Json::object();
    for (const auto& [port, hash] : entry.inputs) inputs.set(port, hash);
    out.push(Json::object().set("stage", entry.stage).set("version", entry.version).set("params", entry.params).set("inputs", std::move(inputs)));
  }
  return out;
}

}  // namespace

std::string garment_text(const std::string& name, const mesh::GarmentMesh& g, const Figures& r) {
  std::string out = fmt::format("{}: garment, {} vertices ({} particles), {} faces in {} panels; {} connected piece{}, {} opening{}, Euler number {}\n", name, r.vertices, r.particles, r.faces, g.panels.size(), r.pieces, r.pieces == 1 ? "" : "s",
                                r.openings.size(), r.openings.size() == 1 ? "" : "s", r.euler_number);
  out += fmt::format("size {:.0f} x {:.0f} x {:.0f} mm, from height {:.0f} to {:.0f} mm\n", 1e3 * (r.high.x() - r.low.x()), 1e3 * (r.high.y() - r.low.y()), 1e3 * (r.high.z() - r.low.z()), 1e3 * r.low.y(), 1e3 * r.high.y());
  out += fmt::format("mass {:.2f} g (cut area times density: {:.2f} g), area {:.4f} m2 as cut, {:.4f} m2 now\n", 1e3 * r.mass, 1e3 * r.mass_expected, r.flat_area, r.area);
  if (r.unassigned_faces > 0) out += fmt::format("{} faces have no fabric yet\n", r.unassigned_faces);

  out += "\npanels\n";
  std::vector<std::vector<std::string>> rows{{"name", "vertices", "faces", "grid mm", "area cm2", "mass g", "smallest corner", "warp strain %", "weft strain %"}};
  for (std::size_t i = 0; i < r.panels.size(); ++i) {
    const PanelFigures& p = r.panels[i];
    rows.push_back({p.name + (p.mirrored ? " (turned over)" : ""), fmt::format("{}", p.vertices), fmt::format("{}", p.faces), fmt::format("{:.3g} x {:.3g}", 1e3 * g.panels[i].cell_weft, 1e3 * g.panels[i].cell_warp), fmt::format("{:.1f}", 1e4 * p.flat_area), fmt::format("{:.2f}", 1e3 * p.mass),
                    fmt::format("{:.1f} deg", p.min_angle / degree), percent(p.strain_warp.min) + " .. " + percent(p.strain_warp.max), percent(p.strain_weft.min) + " .. " + percent(p.strain_weft.max)});
  }
  out += text_table(rows);

  if (!r.seams.empty()) {
    out += fmt::format("\nseams (open by {:.2f} mm at most, {:.2f} mm on average)\n", 1e3 * r.max_seam_gap, 1e3 * r.mean_seam_gap);
    rows = {{"name", "kind", "welds", "cut mm", "against mm", "ease mm", "now mm", "gap mm"}};
    for (const SeamFigures& s : r.seams) rows.push_back({s.name, s.kind, fmt::format("{}", s.welds), millimetres(s.cut_a), millimetres(s.cut_b), millimetres(s.cut_b - s.cut_a), millimetres(s.now_a), fmt::format("{:.2f}", 1e3 * s.max_gap)});
    out += text_table(rows);
  }
  if (!r.openings.empty()) {
    out += "\nopenings\n";
    rows = {{"along", "cut mm", "now mm", "tape mm", "height mm"}};
    for (const OpeningFigures& o : r.openings) rows.push_back({fmt::format("{}", fmt::join(o.runs, " + ")), millimetres(o.flat), millimetres(o.now), millimetres(o.tape), millimetres(o.centre.y())});
    out += text_table(rows);
  }
  if (!g.laminates.empty()) {
    out += "\nlaminates\n";
    std::vector<double> area(g.laminates.size(), 0);
    const Eigen::VectorXd rest = mesh::rest_areas(g);
    for (Eigen::Index f = 0; f < g.face_count(); ++f) {
      if (g.face_laminate[f] >= 0) area[static_cast<std::size_t>(g.face_laminate[f])] += rest[f];
    }
    rows = {{"name", "plies", "g/m2", "area cm2", "mass g"}};
    for (const mesh::Laminate& l : g.laminates) {
      std::vector<std::string> plies;
      for (const mesh::Ply& ply : l.plies) plies.push_back(ply.fabric);
      const double a = area[static_cast<std::size_t>(l.id)];
      rows.push_back({l.name, fmt::format("{}", fmt::join(plies, " / ")), fmt::format("{:.1f}", 1e3 * l.equivalent.areal_density), fmt::format("{:.1f}", 1e4 * a), fmt::format("{:.2f}", 1e3 * a * l.equivalent.areal_density)});
    }
    out += text_table(rows);
  }
  if (!g.fasteners.empty()) out += fmt::format("\nfasteners: {}\n", g.fasteners.size());

  out += "\nstrain\n";
  rows = {{"", "least %", "median %", "99 % of faces", "greatest %"}};
  for (const auto& [direction, s] : {std::pair{"warp", &r.warp}, std::pair{"weft", &r.weft}, std::pair{"bias", &r.bias}}) rows.push_back({direction, percent(s->min), percent(s->median), percent(s->p99), percent(s->max)});
  out += text_table(rows);
  out += fmt::format("  shear angle: {:.2f} deg at most, {:.2f} deg for 99 % of faces\n", r.shear.max / degree, r.shear.p99 / degree);
  if (r.self_intersections) out += fmt::format("self-intersections: {} pairs of faces\n", *r.self_intersections);
  else out += "self-intersections: not searched (--search yes)\n";
  if (r.support) {
    out += fmt::format("support: {} vertices inside, {:.2f} mm deep at most; ease {:.1f} mm on average, {:.1f} to {:.1f} mm\n", r.support->penetrating_vertices, 1e3 * r.support->max_penetration, 1e3 * r.support->mean_ease, 1e3 * r.support->ease.min, 1e3 * r.support->ease.max);
    if (r.support->support_intersections) out += fmt::format("support: {} faces cut its surface\n", *r.support->support_intersections);
  }
  std::vector<std::string> columns;
  for (const auto& [key, c] : g.vertex_columns) columns.push_back("vertex." + key);
  for (const auto& [key, c] : g.face_columns) columns.push_back("face." + key);
  if (!columns.empty()) out += fmt::format("further columns: {}\n", fmt::join(columns, ", "));
  for (const auto& [key, value] : g.marks) out += fmt::format("{}: {}\n", key, value);
  if (!g.route.empty()) out += "\nroute\n" + route_text(g.route);
  return out;
}

Json garment_json(const std::string& name, const mesh::GarmentMesh& g, const Figures& r) {
  Json out = Json::object();
  out.set("file", name).set("kind", "garment");
  Json laminates = Json::array();
  for (const mesh::Laminate& l : g.laminates) {
    Json plies = Json::array();
    for (const mesh::Ply& ply : l.plies) plies.push(ply.fabric);
    laminates.push(Json::object().set("name", l.name).set("plies", std::move(plies)).set("areal_density", l.equivalent.areal_density));
  }
  Json marks = Json::object();
  for (const auto& [key, value] : g.marks) marks.set(key, value);
  Json columns = Json::array();
  for (const auto& [key, c] : g.vertex_columns) columns.push("vertex." + key);
  for (const auto& [key, c] : g.face_columns) columns.push("face." + key);
  out.set("laminates", std::move(laminates)).set("marks", std::move(marks)).set("columns", std::move(columns));
  out.set("figures", to_json(r)).set("route", route_json(g.route));
  return out;
}

std::string support_text(const std::string& name, const mesh::SupportMesh& s) {
  const Eigen::Vector3d low = s.x.colwise().minCoeff(), high = s.x.colwise().maxCoeff();
  std::string out = fmt::format("{}: support, {} vertices, {} faces, closed, volume {:.2f} l\n", name, s.x.rows(), s.faces.rows(), 1e3 * mesh::volume(s.x, s.faces));
  out += fmt::format("size {:.0f} x {:.0f} x {:.0f} mm, from height {:.0f} to {:.0f} mm\n", 1e3 * (high.x() - low.x()), 1e3 * (high.y() - low.y()), 1e3 * (high.z() - low.z()), 1e3 * low.y(), 1e3 * high.y());
  if (!s.region_names.empty()) out += fmt::format("regions: {}\n", fmt::join(s.region_names, ", "));
  if (!s.girths.empty()) {
    out += "\ngirths\n";
    std::vector<std::vector<std::string>> rows;
    for (const auto& [key, girth] : s.girths) rows.push_back({key, millimetres(girth) + " mm"});
    out += text_table(rows);
  }
  if (!s.landmarks.empty()) {
    out += "\nlandmarks (mm)\n";
    std::vector<std::vector<std::string>> rows;
    for (const auto& [key, p] : s.landmarks) rows.push_back({key, millimetres(p[0]), millimetres(p[1]), millimetres(p[2])});
    out += text_table(rows);
  }
  if (!s.route.empty()) out += "\nroute\n" + route_text(s.route);
  return out;
}

Json support_json(const std::string& name, const mesh::SupportMesh& s) {
  const Eigen::Vector3d low = s.x.colwise().minCoeff(), high = s.x.colwise().maxCoeff();
  const auto point = [](const auto& p) { return Json::array().push(p[0]).push(p[1]).push(p[2]); };
  Json out = Json::object();
  out.set("file", name).set("kind", "support").set("vertices", static_cast<std::size_t>(s.x.rows())).set("faces", static_cast<std::size_t>(s.faces.rows())).set("volume", mesh::volume(s.x, s.faces));
  out.set("low", point(low)).set("high", point(high));
  Json regions = Json::array(), girths = Json::object(), landmarks = Json::object();
  for (const std::string& region : s.region_names) regions.push(region);
  for (const auto& [key, girth] : s.girths) girths.set(key, girth);
  for (const auto& [key, p] : s.landmarks) landmarks.set(key, point(p));
  out.set("regions", std::move(regions)).set("girths", std::move(girths)).set("landmarks", std::move(landmarks)).set("route", route_json(s.route));
  return out;
}

}  // namespace toile::inspect
