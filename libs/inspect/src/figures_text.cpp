#include "toile/base/text.h"
#include "toile/inspect/measures.h"

#include <fmt/format.h>

namespace toile::inspect {
namespace {

Json spread_json(const Spread& s) {
  return Json::object().set("min", s.min).set("p01", s.p01).set("median", s.median).set("p99", s.p99).set("max", s.max);
}

Json vector_json(const Eigen::Vector3d& v) { return Json::array().push(v.x()).push(v.y()).push(v.z()); }

Json mark_json(const std::map<std::string, std::string>& marks, const char* name) {
  const auto it = marks.find(name);
  if (it == marks.end()) return {};
  if (const auto number = parse_number(it->second)) return *number;
  return it->second;
}

std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string row(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& c : cells) line += (line.empty() ? "" : ",") + cell(c);
  return line + '\n';
}

}  // namespace

Json to_json(const Figures& r) {
  Json out = Json::object();
  out.set("units", Json::object().set("length", "m").set("area", "m2").set("mass", "kg").set("strain", "1").set("angle", "rad").set("tension", "N/m"));
  out.set("converged", r.converged).set("residual", mark_json(r.marks, "residual"));
  if (r.support) {
    out.set("penetrating_vertices", r.support->penetrating_vertices).set("max_penetration", r.support->max_penetration);
    out.set("support_intersections", r.support->support_intersections);
  } else {
    out.set("penetrating_vertices", Json()).set("max_penetration", Json()).set("support_intersections", Json());
  }
  out.set("self_intersections", r.self_intersections).set("self_intersecting_faces", r.self_intersecting_faces);
  out.set("max_seam_gap", r.max_seam_gap).set("mean_seam_gap", r.mean_seam_gap).set("total_seam_gap", r.total_seam_gap);
  for (const auto& [name, s] : {std::pair{"warp", &r.warp}, std::pair{"weft", &r.weft}}) {
    out.set(fmt::format("max_strain_{}", name), s->max).set(fmt::format("min_strain_{}", name), s->min).set(fmt::format("p99_strain_{}", name), s->p99);
  }
  out.set("max_strain_bias", r.bias.max).set("p99_strain_bias", r.bias.p99).set("max_shear", r.shear.max).set("p99_shear", r.shear.p99);
  out.set("max_tension_warp", r.max_tension_warp).set("max_tension_weft", r.max_tension_weft);
  out.set("mass", r.mass).set("mass_expected", r.mass_expected);
  out.set("mass_error", r.mass_expected > 0 ? Json(r.mass / r.mass_expected - 1) : Json()).set("unassigned_faces", r.unassigned_faces);
  out.set("cut_area", r.cut_area).set("flat_area", r.flat_area).set("area", r.area).set("min_angle", r.min_angle);
  out.set("vertices", r.vertices).set("particles", r.particles).set("faces", r.faces).set("welds", r.welds).set("fasteners", r.fasteners);
  out.set("pieces", r.pieces).set("euler_number", r.euler_number);
  out.set("centre_of_mass", vector_json(r.centre_of_mass)).set("low", vector_json(r.low)).set("high", vector_json(r.high));
  if (r.support) {
    Json ease = spread_json(r.support->ease);
    ease.set("mean", r.support->mean_ease);
    out.set("ease", std::move(ease));
  }
  Json panels = Json::array();
  for (const PanelFigures& p : r.panels) {
    Json item = Json::object();
    item.set("name", p.name).set("piece", p.piece).set("mirrored", p.mirrored).set("vertices", p.vertices).set("faces", p.faces);
    item.set("cut_area", p.cut_area).set("flat_area", p.flat_area).set("area", p.area).set("mass", p.mass).set("mass_expected", p.mass_expected);
    item.set("max_strain_warp", p.strain_warp.max).set("min_strain_warp", p.strain_warp.min).set("p99_strain_warp", p.strain_warp.p99);
    item.set("max_strain_weft", p.strain_weft.max).set("min_strain_weft", p.strain_weft.min).set("p99_strain_weft", p.strain_weft.p99);
    item.set("max_shear", p.max_shear).set("min_angle", p.min_angle);
    if (p.ease) item.set("min_ease", p.ease->min).set("median_ease", p.ease->median).set("max_ease", p.ease->max);
    panels.push(std::move(item));
  }
  out.set("panels", std::move(panels));
  Json seams = Json::array();
  for (const SeamFigures& s : r.seams) {
    seams.push(Json::object().set("name", s.name).set("kind", s.kind).set("welds", s.welds).set("cut_a", s.cut_a).set("cut_b", s.cut_b).set("now_a", s.now_a).set("now_b", s.now_b).set("max_gap", s.max_gap).set("mean_gap", s.mean_gap));
  }
  out.set("seams", std::move(seams));
  Json openings = Json::array();
  for (const OpeningFigures& o : r.openings) {
    Json runs = Json::array();
    for (const std::string& run : o.runs) runs.push(run);
    openings.push(Json::object().set("runs", std::move(runs)).set("flat", o.flat).set("now", o.now).set("tape", o.tape).set("centre", vector_json(o.centre)));
  }
  out.set("openings", std::move(openings));
  Json girths = Json::array();
  for (const GirthFigures& g : r.girths) {
    Json item = Json::object();
    item.set("name", g.name).set("height", g.height).set("girth", g.girth).set("tape", g.tape).set("body", g.body);
    item.set("ease", g.girth && g.body ? Json(*g.girth - *g.body) : Json());
    girths.push(std::move(item));
  }
  out.set("girths", std::move(girths));
  Json lengths = Json::array();
  for (const LengthFigures& l : r.lengths) lengths.push(Json::object().set("name", l.name).set("cut", l.cut).set("now", l.now).set("straight", l.straight).set("drop", l.drop));
  out.set("lengths", std::move(lengths));
  Json runs = Json::array();
  for (const RunFigures& run : r.runs) runs.push(Json::object().set("run", run.panel + "." + run.name).set("internal", run.internal).set("cut", run.cut).set("flat", run.flat).set("now", run.now));
  out.set("runs", std::move(runs));
  return out;
}

std::string panels_csv(const Figures& r) {
  const auto n = [](double v) { return format_number(v); };
  std::string out = row({"panel", "piece", "vertices", "faces", "cut_area [m2]", "flat_area [m2]", "area [m2]", "mass [kg]", "mass_expected [kg]", "max_strain_warp [1]", "min_strain_warp [1]", "p99_strain_warp [1]", "max_strain_weft [1]", "min_strain_weft [1]", "p99_strain_weft [1]", "max_shear [rad]", "min_angle [rad]", "min_ease [m]", "median_ease [m]", "max_ease [m]"});
  for (const PanelFigures& p : r.panels) {
    out += row({p.name, p.piece, fmt::format("{}", p.vertices), fmt::format("{}", p.faces), n(p.cut_area), n(p.flat_area), n(p.area), n(p.mass), n(p.mass_expected), n(p.strain_warp.max), n(p.strain_warp.min), n(p.strain_warp.p99), n(p.strain_weft.max), n(p.strain_weft.min), n(p.strain_weft.p99), n(p.max_shear), n(p.min_angle),
                p.ease ? n(p.ease->min) : "", p.ease ? n(p.ease->median) : "", p.ease ? n(p.ease->max) : ""});
  }
  return out;
}

std::string seams_csv(const Figures& r) {
  const auto n = [](double v) { return format_number(v); };
  std::string out = row({"seam", "kind", "welds", "cut_a [m]", "cut_b [m]", "now_a [m]", "now_b [m]", "max_gap [m]", "mean_gap [m]"});
  for (const SeamFigures& s : r.seams) out += row({s.name, s.kind, fmt::format("{}", s.welds), n(s.cut_a), n(s.cut_b), n(s.now_a), n(s.now_b), n(s.max_gap), n(s.mean_gap)});
  return out;
}

}  // namespace toile::inspect
