#include "toile/inspect/info.h"

#include "toile/inspect/bill.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <map>
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

/// "suiting / canvas (chest)": the sheets of a stack, face side first.
std::string plies_text(const mesh::Laminate& laminate) {
  std::vector<std::string> plies;
  for (const mesh::Ply& ply : laminate.plies) plies.push_back(ply.layer.empty() ? ply.fabric : fmt::format("{} ({})", ply.fabric, ply.layer));
  return fmt::format("{}", fmt::join(plies, " / "));
}

std::string panel_names(const mesh::GarmentMesh& g, const std::vector<int>& panels) {
  std::vector<std::string> names;
  for (const int p : panels) names.push_back(g.panels[static_cast<std::size_t>(p)].name);
  return fmt::format("{}", fmt::join(names, " "));
}

/// Length of each fold in panel coordinates: along its lines; where it runs along part of a line, the turn of all its hinges
/// times their length over the angle of the fold, since the turn across it is the same all along.
std::vector<double> fold_lengths(const mesh::GarmentMesh& g) {
  std::vector<double> lengths(g.folds.size(), 0);
  for (const mesh::Hinge& hinge : g.hinges) {
    if (hinge.fold < 0) continue;
    const mesh::Fold& fold = g.folds[static_cast<std::size_t>(hinge.fold)];
    if (fold.runs.empty() && fold.angle != 0) lengths[static_cast<std::size_t>(hinge.fold)] += hinge.rest_angle / fold.angle * (g.uv.row(hinge.v1) - g.uv.row(hinge.v0)).norm();
  }
  for (const mesh::Fold& fold : g.folds) {
    for (const int run : fold.runs) lengths[static_cast<std::size_t>(fold.id)] += g.runs[static_cast<std::size_t>(run)].length;
  }
  return lengths;
}

struct ClosureFigures {
  int count = 0, closed = 0;
  double mass = 0, length = 0, stiffness = 0, capture = 0;
};
std::vector<ClosureFigures> closure_figures(const mesh::GarmentMesh& g) {
  std::vector<ClosureFigures> figures(g.closures.size());
  for (const mesh::Fastener& f : g.fasteners) {
    if (f.closure < 0) continue;
    ClosureFigures& own = figures[static_cast<std::size_t>(f.closure)];
    ++own.count;
    own.closed += f.closed ? 1 : 0;
    own.mass += f.mass;
    own.length = std::max(own.length, f.length);
    own.stiffness = std::max(own.stiffness, f.stiffness);
    own.capture = std::max(own.capture, f.capture);
  }
  return figures;
}

/// How the garment is made: layers, folds, trims, closures, free layers, materials.
std::string construction_text(const mesh::GarmentMesh& g) {
  std::string out;
  std::vector<std::vector<std::string>> rows;
  if (!g.laminates.empty()) {
    out += "\nlayers, face side first\n";
    rows = {{"panel", "sheets", "together", "g/m2", "area cm2", "mass g"}};
    for (const StackRow& row : stack_table(g)) {
      const std::string& panel = g.panels[static_cast<std::size_t>(row.panel)].name;
      if (row.laminate < 0) {
        rows.push_back({panel, "-", "-", "-", fmt::format("{:.1f}", 1e4 * row.area), "-"});
        continue;
      }
      const mesh::Laminate& laminate = g.laminates[static_cast<std::size_t>(row.laminate)];
      rows.push_back({panel, plies_text(laminate), laminate.rule, fmt::format("{:.1f}", 1e3 * laminate.equivalent.areal_density), fmt::format("{:.1f}", 1e4 * row.area), fmt::format("{:.2f}", 1e3 * row.area * laminate.equivalent.areal_density)});
    }
    out += text_table(rows, Alignment::by_content);
  }
  if (!g.free_layers.empty()) {
    out += "\nfree layers\n";
    rows = {{"name", "panels", "side", "of"}};
    for (const mesh::FreeLayer& layer : g.free_layers) rows.push_back({layer.name, panel_names(g, layer.panels), layer.outside ? "outside" : "inside", panel_names(g, layer.on)});
    out += text_table(rows, Alignment::by_content);
    std::map<int, std::vector<int>, std::greater<>> by_order;
    for (const mesh::Panel& panel : g.panels) by_order[panel.order].push_back(panel.id);
    out += "  order from outside:";
    for (const auto& [order, panels] : by_order) out += fmt::format("{} {}: {}", order == by_order.begin()->first ? "" : ";", order, panel_names(g, panels));
    out += '\n';
  }
  if (!g.folds.empty()) {
    out += "\nfolds\n";
    const std::vector<double> lengths = fold_lengths(g);
    rows = {{"name", "kind", "angle deg", "radius mm", "length mm"}};
    for (const mesh::Fold& fold : g.folds) rows.push_back({fold.name, fold.kind, fmt::format("{:.1f}", fold.angle / degree), millimetres(fold.radius), (fold.runs.empty() ? "about " : "") + millimetres(lengths[static_cast<std::size_t>(fold.id)])});
    out += text_table(rows, Alignment::by_content);
  }
  if (!g.trims.empty()) {
    out += "\ntrims\n";
    std::vector<double> length(g.trims.size(), 0), mass(g.trims.size(), 0);
    for (const mesh::TrimSegment& segment : g.trim_segments) {
      length[static_cast<std::size_t>(segment.trim)] += segment.rest_length;
      mass[static_cast<std::size_t>(segment.trim)] += segment.mass(g.trims[static_cast<std::size_t>(segment.trim)]);
    }
    rows = {{"name", "kind", "seam", "length mm", "rest ratio", "stretch N", "bending N*mm2", "mass g"}};
    for (const mesh::Trim& trim : g.trims) {
      const auto k = static_cast<std::size_t>(trim.id);
      rows.push_back({trim.name, trim.kind, trim.seam < 0 ? "-" : g.seams[static_cast<std::size_t>(trim.seam)].name, millimetres(length[k]), fmt::format("{:.3f}", trim.rest_ratio), fmt::format("{:.3g}", trim.stretch), fmt::format("{:.3g}", 1e6 * trim.bending), fmt::format("{:.3f}", 1e3 * mass[k])});
    }
    out += text_table(rows, Alignment::by_content);
  }
  if (!g.closures.empty()) {
    out += "\nclosures\n";
    const std::vector<ClosureFigures> figures = closure_figures(g);
    rows = {{"name", "kind", "closed", "held by", "shank mm", "capture mm", "mass g"}};
    for (const mesh::Closure& closure : g.closures) {
      const ClosureFigures& f = figures[static_cast<std::size_t>(closure.id)];
      rows.push_back({closure.name, closure.kind, fmt::format("{} of {}", f.closed, f.count), f.stiffness > 0 ? fmt::format("{:.3g} N/m", f.stiffness) : "constraint", millimetres(f.length), f.capture > 0 ? millimetres(f.capture) : "at once", fmt::format("{:.2f}", 1e3 * f.mass)});
    }
    out += text_table(rows, Alignment::by_content);
  }
  if (g.laminates.empty()) return out;
  const Bill bill = bill_of_materials(g);
  out += "\nbill of materials\n";
  rows = {{"what", "number", "cut mm", "area cm2", "with allowances cm2", "mass g"}};
  for (const FabricRow& r : bill.fabrics) rows.push_back({r.fabric, "", "", fmt::format("{:.1f}", 1e4 * r.area), fmt::format("{:.1f}", 1e4 * r.area_with_allowances), fmt::format("{:.2f}", 1e3 * r.mass)});
  for (const SeamRow& r : bill.seams) rows.push_back({"seam, " + r.kind, fmt::format("{}", r.count), millimetres(std::max(r.length_a, r.length_b)), "", "", ""});
  for (const TrimRow& r : bill.trims) rows.push_back({r.kind, fmt::format("{}", r.count), millimetres(r.length), "", "", fmt::format("{:.3f}", 1e3 * r.mass)});
  for (const FastenerRow& r : bill.fasteners) rows.push_back({r.kind, fmt::format("{}", r.count), "", "", "", fmt::format("{:.2f}", 1e3 * r.mass)});
  rows.push_back({"together", "", "", "", "", fmt::format("{:.2f}", 1e3 * bill.mass)});
  return out + text_table(rows, Alignment::by_content);
}

Json construction_json(const mesh::GarmentMesh& g, Json out) {
  const auto names = [&](const std::vector<int>& panels) {
    Json list = Json::array();
    for (const int p : panels) list.push(g.panels[static_cast<std::size_t>(p)].name);
    return list;
  };
  Json stacks = Json::array(), layers = Json::array(), order = Json::object(), folds = Json::array(), trims = Json::array(), closures = Json::array();
  for (const StackRow& row : stack_table(g)) {
    Json part = Json::object();
    part.set("panel", g.panels[static_cast<std::size_t>(row.panel)].name).set("area", row.area);
    if (row.laminate >= 0) {
      const mesh::Laminate& laminate = g.laminates[static_cast<std::size_t>(row.laminate)];
      Json plies = Json::array();
      for (const mesh::Ply& ply : laminate.plies) plies.push(Json::object().set("fabric", ply.fabric).set("layer", ply.layer));
      part.set("laminate", laminate.name).set("rule", laminate.rule).set("plies", std::move(plies));
    }
    stacks.push(std::move(part));
  }
  for (const mesh::FreeLayer& layer : g.free_layers) layers.push(Json::object().set("name", layer.name).set("panels", names(layer.panels)).set("on", names(layer.on)).set("side", layer.outside ? "outside" : "inside"));
  for (const mesh::Panel& panel : g.panels) order.set(panel.name, panel.order);
  const std::vector<double> lengths = fold_lengths(g);
  for (const mesh::Fold& fold : g.folds) folds.push(Json::object().set("name", fold.name).set("kind", fold.kind).set("angle", fold.angle).set("radius", fold.radius).set("length", lengths[static_cast<std::size_t>(fold.id)]).set("length_estimated", fold.runs.empty()));
  for (const mesh::Trim& trim : g.trims) {
    trims.push(Json::object().set("name", trim.name).set("kind", trim.kind).set("seam", trim.seam < 0 ? Json() : Json(g.seams[static_cast<std::size_t>(trim.seam)].name)).set("stretch", trim.stretch).set("bending", trim.bending).set("linear_density", trim.linear_density).set("rest_ratio", trim.rest_ratio));
  }
  const std::vector<ClosureFigures> figures = closure_figures(g);
  for (const mesh::Closure& closure : g.closures) {
    const ClosureFigures& f = figures[static_cast<std::size_t>(closure.id)];
    closures.push(Json::object().set("name", closure.name).set("kind", closure.kind).set("count", f.count).set("closed", f.closed).set("stiffness", f.stiffness).set("capture", f.capture).set("length", f.length).set("mass", f.mass));
  }
  out.set("layers", std::move(stacks)).set("free_layers", std::move(layers)).set("order", std::move(order)).set("folds", std::move(folds)).set("trims", std::move(trims)).set("closures", std::move(closures));
  out.set("bill", to_json(bill_of_materials(g)));
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
  out += text_table(rows, Alignment::by_content);

  if (!r.seams.empty()) {
    out += fmt::format("\nseams (open by {:.2f} mm at most, {:.2f} mm on average)\n", 1e3 * r.max_seam_gap, 1e3 * r.mean_seam_gap);
    rows = {{"name", "kind", "welds", "cut mm", "against mm", "ease mm", "now mm", "gap mm"}};
    for (const SeamFigures& s : r.seams) rows.push_back({s.name, s.kind, fmt::format("{}", s.welds), millimetres(s.cut_a), millimetres(s.cut_b), millimetres(s.cut_b - s.cut_a), millimetres(s.now_a), fmt::format("{:.2f}", 1e3 * s.max_gap)});
    out += text_table(rows, Alignment::by_content);
  }
  if (!r.openings.empty()) {
    out += "\nopenings\n";
    rows = {{"along", "cut mm", "now mm", "tape mm", "height mm"}};
    for (const OpeningFigures& o : r.openings) rows.push_back({fmt::format("{}", fmt::join(o.runs, " + ")), millimetres(o.flat), millimetres(o.now), millimetres(o.tape), millimetres(o.centre.y())});
    out += text_table(rows, Alignment::by_content);
  }
  out += construction_text(g);
  out += "\nstrain\n";
  rows = {{"", "least %", "median %", "99 % of faces", "greatest %"}};
  for (const auto& [direction, s] : {std::pair{"warp", &r.warp}, std::pair{"weft", &r.weft}, std::pair{"bias", &r.bias}}) rows.push_back({direction, percent(s->min), percent(s->median), percent(s->p99), percent(s->max)});
  out += text_table(rows, Alignment::by_content);
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
  out.set("laminates", std::move(laminates));
  out = construction_json(g, std::move(out));
  out.set("marks", std::move(marks)).set("columns", std::move(columns));
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
    out += text_table(rows, Alignment::by_content);
  }
  if (!s.landmarks.empty()) {
    out += "\nlandmarks (mm)\n";
    std::vector<std::vector<std::string>> rows;
    for (const auto& [key, p] : s.landmarks) rows.push_back({key, millimetres(p[0]), millimetres(p[1]), millimetres(p[2])});
    out += text_table(rows, Alignment::by_content);
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
