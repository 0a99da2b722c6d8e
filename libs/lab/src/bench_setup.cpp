#include "bench_setup.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "toile/base/text.h"

namespace toile::lab {
namespace {

struct Corner {
  const char* name;
  double x, y;
};
struct Piece {
  const char* name;
  std::vector<Corner> corners;
  std::vector<const char*> edges;
};

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

std::vector<Piece> pieces_of(const Strip& s) {
  const double l = s.length, w = s.width, b = -s.anchor;
  if (!s.cut) return {{"strip", {{"a", b, 0}, {"b", l, 0}, {"c", l, w}, {"d", b, w}}, {"low", "tip", "high", "clamp"}}};
  if (*s.cut == 0) {
    return {{"first", {{"a", b, 0}, {"b", l, 0}, {"c", l, w / 2}, {"d", b, w / 2}}, {"low", "tip", "seam", "clamp"}},
            {"second", {{"a", b, w / 2}, {"b", l, w / 2}, {"c", l, w}, {"d", b, w}}, {"seam", "tip", "high", "clamp"}}};
  }
  const double half = 0.5 * w / std::tan(radians(*s.cut)), low = l / 2 - half, high = l / 2 + half;
  return {{"first", {{"a", b, 0}, {"b", low, 0}, {"c", high, w}, {"d", b, w}}, {"low", "seam", "high", "clamp"}},
          {"second", {{"a", low, 0}, {"b", l, 0}, {"c", l, w}, {"d", high, w}}, {"low", "tip", "high", "seam"}}};
}

std::string pattern_yaml(const Strip& s) {
  std::string text = "name: strip\nunits: mm\ny: up\npieces:\n";
  for (const Piece& p : pieces_of(s)) {
    text += fmt::format("  {}:\n    cut: 1\n    grain: [[0, 0], [{}, {}]]\n    points:\n", p.name, format_number(10 * std::cos(radians(s.warp))), format_number(10 * std::sin(radians(s.warp))));
    for (const Corner& c : p.corners) text += fmt::format("      {}: [{}, {}]\n", c.name, format_number(1e3 * c.x), format_number(1e3 * c.y));
    text += "    outline:\n";
    for (std::size_t k = 0; k < p.edges.size(); ++k) {
      text += fmt::format("      - {{name: {}, path: [{}, {}]}}\n", p.edges[k], p.corners[k].name, p.corners[(k + 1) % p.corners.size()].name);
    }
    if (s.anchor > 0) text += fmt::format("    lines:\n      inner: {{kind: other, path: [[0, 0], [0, {}]]}}\n", format_number(1e3 * s.width));
  }
  return text;
}

/// Puts the pieces of a cut strip where they were before they were cut: both sides of the seam lie on each other.
mesh::GarmentMesh laid(mesh::GarmentMesh garment, const Strip& strip) {
  const std::vector<Piece> pieces = pieces_of(strip);
  const Eigen::Vector2d e = along(strip).head<2>(), n = across(strip).head<2>();
  for (std::size_t p = 0; p < garment.panels.size(); ++p) {
    const auto piece = std::find_if(pieces.begin(), pieces.end(), [&](const Piece& q) { return q.name == garment.panels[p].name; });
    const auto corner = std::find_if(garment.points.begin(), garment.points.end(), [&](const mesh::NamedPoint& q) { return q.panel == static_cast<int>(p) && q.name == "a"; });
    TOILE_CHECK(piece != pieces.end() && corner != garment.points.end(), "panel {}", garment.panels[p].name);
    const Eigen::Vector2d from = garment.uv.row(corner->vertex).transpose();
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      if (garment.vertex_panel[v] != static_cast<int>(p)) continue;
      const Eigen::Vector2d at = garment.uv.row(v).transpose() - from + piece->corners[0].x * e + piece->corners[0].y * n;
      garment.x.row(v) << at.x(), at.y(), 0;
    }
  }
  for (const mesh::Weld& weld : garment.welds) garment.x.row(weld.b) = garment.x.row(weld.a);
  return garment;
}

}  // namespace

const char* name_of(Net net) {
  switch (net) {
    case Net::grid: return "grid";
    case Net::single: return "single diagonal";
    case Net::delaunay: return "Delaunay";
    case Net::jittered: return "jittered";
  }
  return "";
}

const char* name_of(Model model) { return model == Model::woven ? "woven" : "particle"; }

std::vector<Model> models(const Scope& scope) {
  std::vector<Model> result;
  if (scope.woven) result.push_back(Model::woven);
  if (scope.particle) result.push_back(Model::particle);
  return result;
}

std::string fabric_yaml(const Cloth& c) {
  const auto yarn = [&](double emt, double lt, double rt, double b, double hb) {
    return fmt::format("{{EMT: {} %, LT: {}, RT: {}, B: {} N*m, 2HB: {} N}}", format_number(100 * emt), format_number(lt), format_number(rt), format_number(b), format_number(hb));
  };
  return fmt::format("name: cloth\norigin: made for a test, not measured\nW: {} kg/m2\nT: 0.3 mm\nF_max: {} N/m\nwarp: {}\nweft: {}\nG: {} N/m/rad\n2HG: {} N/m\n2HG5: {} N/m\ntwist_ratio: {}\nMIU: {}\n",
                     format_number(c.weight), format_number(c.force_max), yarn(c.emt_warp, c.lt_warp, c.rt_warp, c.b_warp, c.hb_warp), yarn(c.emt_weft, c.lt_weft, c.rt_weft, c.b_weft, c.hb_weft),
                     format_number(c.g), format_number(c.hg), format_number(c.hg5), format_number(c.twist), format_number(c.friction));
}

Cloth suiting() {
  constexpr double force = 0.980665, bending = 9.80665e-5, loop = 9.80665e-3, shear = 0.980665 * 180 / std::numbers::pi;
  return {.weight = 0.21, .force_max = 500 * force, .emt_warp = 0.047, .emt_weft = 0.09, .lt_warp = 0.58, .lt_weft = 0.54, .rt_warp = 0.64, .rt_weft = 0.60, .b_warp = 0.110 * bending,
          .b_weft = 0.075 * bending, .hb_warp = 0.045 * loop, .hb_weft = 0.030 * loop, .g = 0.58 * shear, .hg = 0.50 * force, .hg5 = 1.2 * force};
}

std::string Strip::file_name() const { return name_of(net) == std::string("single diagonal") ? "single" : name_of(net); }

Eigen::Vector3d along(const Strip& s) { return {std::sin(radians(s.warp)), std::cos(radians(s.warp)), 0}; }
Eigen::Vector3d across(const Strip& s) { return {-std::cos(radians(s.warp)), std::sin(radians(s.warp)), 0}; }

Eigen::Vector3d place(const Strip& s, double length, double width) {
  // toile-mesh lays the panel's lowest u and v at the origin.
  const Eigen::Vector3d e = along(s), n = across(s);
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  for (const double x : {-s.anchor, s.length}) {
    for (const double y : {0.0, s.width}) low = x == -s.anchor && y == 0 ? Eigen::Vector3d(x * e) : Eigen::Vector3d(low.cwiseMin(x * e + y * n));
  }
  return length * e + width * n - low;
}

Case strip_case(const std::string& name, const Strip& strip, const Cloth& cloth, const std::string& simulation, const std::string& deform) {
  Case result{name, {{"pattern.yaml", pattern_yaml(strip)}, {"cloth.yaml", fabric_yaml(cloth)}, {"simulation.yaml", simulation}}, {}};
  std::vector<std::string> cut{"pattern.yaml", "-o", "panels.ply", "--cell", format_number(1e3 * strip.cell) + " mm"};
  const auto add = [&](std::initializer_list<const char*> words) { cut.insert(cut.end(), words.begin(), words.end()); };
  if (strip.net == Net::single) add({"--diagonal", "single"});
  if (strip.net == Net::delaunay) add({"--mesher", "delaunay"});
  if (strip.net == Net::jittered) add({"--jitter", "0.25"});
  if (strip.anchor > 0) add({"--lines", "['*.inner']"});
  result.steps.push_back({"toile-mesh", cut, {}});
  std::string garment = "panels.ply";
  if (strip.cut) {
    result.files.push_back({"seams.yaml", "seams:\n  - {name: seam, a: [first.seam], b: ['-second.seam']}\n"});
    result.steps.push_back({"toile-sew", {"panels.ply", "-o", "sewn.ply", "--spec", "seams.yaml"}, {}});
    result.steps.push_back({"", {"sewn.ply", "laid.ply"}, [strip](mesh::GarmentMesh g) { return laid(std::move(g), strip); }});
    garment = "laid.ply";
  }
  if (!deform.empty()) {
    result.files.push_back({"deform.yaml", deform});
    result.steps.push_back({"toile-deform", {garment, "-o", "deformed.ply", "--spec", "deform.yaml"}, {}});
    garment = "deformed.ply";
  }
  result.steps.push_back({"toile-layer", {garment, "--fabrics", "cloth.yaml", "--base", "cloth", "-o", "layered.ply"}, {}});
  result.steps.push_back({"toile-simulate", {"layered.ply", "-o", "result.ply", "--spec", "simulation.yaml"}, {}});
  return result;
}

std::string edges(const Strip& strip, const std::string& edge) {
  std::string text;
  for (const Piece& p : pieces_of(strip)) {
    const bool has = std::any_of(p.edges.begin(), p.edges.end(), [&](const char* e) { return e == edge; }) || edge == "inner";
    if (has) text += fmt::format("{}{}.{}", text.empty() ? "" : ", ", p.name, edge);
  }
  return "[" + text + "]";
}

std::string vector_yaml(const Eigen::Vector3d& v) { return fmt::format("[{}, {}, {}]", format_number(v.x()), format_number(v.y()), format_number(v.z())); }

std::string path_yaml(const std::string& name, const std::string& on, const std::string& kind, const std::vector<Eigen::Vector3d>& moves, const std::vector<double>& turns, const Eigen::Vector3d& axis,
                      const std::optional<Eigen::Vector3d>& centre) {
  std::string times, shifts, angles;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const char* comma = i ? ", " : "";
    times += fmt::format("{}{} s", comma, i);
    shifts += fmt::format("{}[{} m, {} m, {} m]", comma, format_number(moves[i].x()), format_number(moves[i].y()), format_number(moves[i].z()));
    if (!turns.empty()) angles += fmt::format("{}{} rad", comma, format_number(turns[i]));
  }
  std::string text = fmt::format("  - {{name: {}, on: {}, kind: {}, times: [{}], move: [{}]", name, on, kind, times, shifts);
  if (!turns.empty()) text += fmt::format(", turn: [{}], axis: {}", angles, vector_yaml(axis));
  if (centre) text += fmt::format(", centre: [{} m, {} m, {} m]", format_number(centre->x()), format_number(centre->y()), format_number(centre->z()));
  return text + "}\n";
}

std::size_t row_count(const Table& record) { return record.empty() ? 0 : record.begin()->second.size(); }

namespace {

double cell(const Table& record, const std::string& name, std::size_t row) {
  const auto column = record.find(name);
  return column == record.end() || row >= column->second.size() ? std::numeric_limits<double>::quiet_NaN() : column->second[row];
}

}  // namespace

std::vector<double> component(const Table& record, const std::string& name, const std::string& what, const std::string& unit, const Eigen::Vector3d& d) {
  std::vector<double> result;
  for (std::size_t i = 0; i < row_count(record); ++i) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      if (d[c] != 0) sum += d[c] * cell(record, fmt::format("{}.{}_{}_{}", name, what, "xyz"[c], unit), i);
    }
    result.push_back(sum);
  }
  return result;
}

Eigen::Vector3d watched(const Table& record, const std::string& name, std::size_t row) {
  return {cell(record, name + ".x_m", row), cell(record, name + ".y_m", row), cell(record, name + ".z_m", row)};
}

Row row_of(const std::string& test, const std::string& subject, Model model, const std::string& mesh, const std::string& quantity, const std::string& unit, const Outcome& outcome) {
  Row row{.test = test, .subject = subject, .model = name_of(model), .mesh = mesh, .quantity = quantity, .unit = unit};
  row.converged = outcome.converged;
  if (!outcome.ran) row.note = outcome.trouble;
  return row;
}

Row spread_of(const std::vector<Row>& rows, double target) {
  Row row = rows.front();
  row.mesh = "all";
  row.quantity = "spread of " + row.quantity + " between meshes";
  row.unit = "1";
  row.measure = Measure::at_most;
  row.target = target;
  row.reference.reset();
  row.value.reset();
  row.note.clear();
  row.converged = true;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Row& r : rows) {
    if (!r.value) return row;
    low = std::min(low, *r.value);
    high = std::max(high, *r.value);
    row.converged = row.converged && r.converged;
  }
  if (low > 0) row.value = high / low - 1;
  return row;
}

std::array<double, 2> line_fit(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    n += 1;
    sx += x[i];
    sy += y[i];
    sxx += x[i] * x[i];
    sxy += x[i] * y[i];
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  return {(sy - slope * sx) / n, slope};
}

double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at) {
  for (std::size_t i = 1; i < x.size(); ++i) {
    if ((x[i - 1] <= at && at <= x[i]) || (x[i] <= at && at <= x[i - 1])) return x[i] == x[i - 1] ? y[i] : y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Table parse_csv(const std::string& text) {
  Table table;
  std::vector<std::string> names;
  for (const std::string& line : split(text, '\n')) {
    if (trim(line).empty()) continue;
    const std::vector<std::string> words = split(trim(line), ',');
    if (names.empty()) {
      names = words;
      for (const std::string& name : names) table[name];
      continue;
    }
    for (std::size_t i = 0; i < names.size(); ++i) table[names[i]].push_back(i < words.size() ? parse_number(words[i]).value_or(std::numeric_limits<double>::quiet_NaN()) : std::numeric_limits<double>::quiet_NaN());
  }
  return table;
}

std::map<std::string, double> parse_facts(const std::string& text) {
  std::map<std::string, double> facts;
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.contains("facts")) return facts;
  for (const auto& [key, value] : json["facts"].items()) {
    const std::string name = key.substr(0, key.find(" ["));
    if (value.is_number()) facts[name] = value.get<double>();
    if (value.is_boolean()) facts[name] = value.get<bool>() ? 1 : 0;
  }
  return facts;
}

std::string first_issue(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.contains("issues") || json["issues"].empty()) return "";
  const auto& issue = json["issues"][0];
  return issue.value("item", "") + (issue.value("item", "").empty() ? "" : ": ") + issue.value("what", "");
}

}  // namespace toile::lab
