#include "line_reference.h"

#include "toile/base/text.h"
#include "toile/base/units.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

/// The pieces of a reference as text.
struct Text {
  bool reversed = false;
  std::string panel, item;
  std::optional<std::string> inside;  ///< between the parentheses
};

std::optional<Text> parse(const std::string& text) {
  Text result;
  std::string_view rest = trim(text);
  if (!rest.empty() && rest.front() == '-') result.reversed = true, rest = trim(rest.substr(1));
  if (const auto open = rest.find('('); open != std::string_view::npos) {
    if (rest.back() != ')') return std::nullopt;
    result.inside = trim(rest.substr(open + 1, rest.size() - open - 2));
    rest = trim(rest.substr(0, open));
  }
  const auto dot = rest.find('.');
  if (dot == std::string_view::npos || dot == 0 || dot + 1 == rest.size()) return std::nullopt;
  result.panel = trim(rest.substr(0, dot));
  result.item = trim(rest.substr(dot + 1));
  return result;
}

std::span<const mesh::RunVertex> rows_of(const GarmentMesh& garment, int run) {
  const auto begin = std::lower_bound(garment.run_vertices.begin(), garment.run_vertices.end(), run, [](const auto& r, int id) { return r.run < id; });
  auto end = begin;
  while (end != garment.run_vertices.end() && end->run == run) ++end;
  return {begin, end};
}

std::string run_name(const GarmentMesh& garment, int run) {
  const auto& row = garment.runs[static_cast<std::size_t>(run)];
  return garment.panels[static_cast<std::size_t>(row.panel)].name + "." + row.name;
}

Result<RunPlace> place_on(const GarmentMesh& garment, int run, const std::string& text) {
  const auto& row = garment.runs[static_cast<std::size_t>(run)];
  std::vector<std::string> names;
  for (const auto& point : garment.points) {
    if (point.panel != row.panel) continue;
    for (const auto& vertex : rows_of(garment, run)) {
      if (vertex.vertex != point.vertex) continue;
      if (point.name == text) return RunPlace{vertex.s, vertex.vertex};
      names.push_back(point.name);
      break;
    }
  }
  const bool is_number = !text.empty() && text.find_first_of("0123456789") <= text.find_first_not_of("+-.");
  const bool is_percentage = !text.empty() && text.back() == '%';
  if (!is_number) {
    for (const auto& point : garment.points) {
      if (point.panel == row.panel && point.name == text) return Issue{"unknown_point", {}, fmt::format("the point '{}' is not on {}", text, run_name(garment, run)), names.empty() ? "give a length from its start" : fmt::format("on it are: {}", fmt::join(names, ", "))};
    }
    std::string remedy = names.empty() ? "" : suggestion(text, names) + "; ";
    return Issue{"unknown_point", {}, fmt::format("{} has no point '{}'", run_name(garment, run), text), remedy + "or give a length (120 mm) or a percentage (25 %) from its start"};
  }
  const auto number = is_percentage ? parse_quantity(text, "1") : parse_quantity(text, "m");
  if (!number) return number.issues();
  double s = is_percentage ? *number * row.length : *number;
  const bool from_end = text.front() == '-';
  if (from_end) s += row.length;
  constexpr double rounding = 1e-9;
  if (s < -rounding || s > row.length + rounding) {
    return Issue{"bad_range", {}, fmt::format("'{}' lies {:.2f} mm {} {}, which is {:.2f} mm long", text, 1e3 * (s < 0 ? -s : s - row.length), s < 0 ? "before the start of" : "beyond the end of", run_name(garment, run), row.length * 1e3),
                 "give a place on the edge; a negative length counts from its end"};
  }
  return RunPlace{std::clamp(s, 0.0, row.length), -1};
}

}  // namespace

Result<std::vector<RunPart>> find_parts(const GarmentMesh& garment, const std::string& text) {
  const auto reference = parse(text);
  const auto dots = reference && reference->inside ? reference->inside->find("..") : 0;
  if (!reference || dots == std::string::npos) {
    return Issue{"bad_reference", {}, fmt::format("'{}' is not panel.edge", text), "write the panel's name, a dot, the edge's name, and a part of it as (from..to); '-' before it runs it backwards"};
  }
  TOILE_TRY(const int panel, mesh::find_panel(garment, reference->panel));
  TOILE_TRY(const int run, mesh::find_run(garment, panel, reference->item));
  const auto& row = garment.runs[static_cast<std::size_t>(run)];
  RunPart part{run, {0, -1}, {row.length, -1}, reference->reversed};
  if (!reference->inside) return std::vector{part};
  Issues issues;
  const std::string from(trim(std::string_view(*reference->inside).substr(0, dots))), to(trim(std::string_view(*reference->inside).substr(dots + 2)));
  for (const auto& [word, end] : {std::pair{&from, &part.from}, std::pair{&to, &part.to}}) {
    if (word->empty()) continue;
    const auto place = place_on(garment, run, *word);
    if (place) *end = *place;
    else append(issues, place.issues());
  }
  if (!issues.empty()) return issues;
  constexpr double least = 1e-5;
  if (row.closed && part.to.s < part.from.s + least && (part.from.s - part.to.s) < row.length - least) {
    RunPart before{run, part.from, {row.length, -1}, part.reversed}, after{run, {0, -1}, part.to, part.reversed};
    std::vector<RunPart> parts;
    if (before.length() > least) parts.push_back(before);
    if (after.length() > least) parts.push_back(after);
    if (part.reversed) std::reverse(parts.begin(), parts.end());
    return parts;
  }
  if (part.length() < least) {
    return Issue{"bad_range", {}, fmt::format("in '{}' the range begins at {:.2f} mm and ends at {:.2f} mm", text, part.from.s * 1e3, part.to.s * 1e3), "give its ends in the direction of the edge, counter-clockwise round the panel; '-' before the panel runs the part backwards"};
  }
  return std::vector{part};
}

Result<PanelPlace> find_place(const GarmentMesh& garment, const std::string& text) {
  const auto reference = parse(text);
  if (!reference || reference->reversed || (reference->inside && reference->inside->find("..") != std::string::npos)) {
    return Issue{"bad_reference", {}, fmt::format("'{}' is not panel.point or panel.edge(place)", text), "write the panel's name, a dot, the point's name; or an edge with a place on it, such as front.side(120 mm)"};
  }
  TOILE_TRY(const int panel, mesh::find_panel(garment, reference->panel));
  if (reference->inside) {
    TOILE_TRY(const int run, mesh::find_run(garment, panel, reference->item));
    TOILE_TRY(const RunPlace place, place_on(garment, run, *reference->inside));
    return PanelPlace{run, place.s, place.vertex};
  }
  std::vector<std::string> names;
  for (const auto& point : garment.points) {
    if (point.panel != panel) continue;
    if (point.name == reference->item) return PanelPlace{-1, 0, point.vertex};
    names.push_back(point.name);
  }
  return Issue{"unknown_point", {}, fmt::format("panel '{}' has no point '{}'", reference->panel, reference->item), suggestion(reference->item, names)};
}

std::vector<int> part_vertices(const GarmentMesh& garment, const RunPart& part, double within) {
  const auto rows = rows_of(garment, part.run);
  const auto nearest = [&](const RunPlace& place) -> std::optional<std::size_t> {
    std::size_t best = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (std::abs(rows[k].s - place.s) < std::abs(rows[best].s - place.s)) best = k;
    }
    if (rows.empty() || std::abs(rows[best].s - place.s) > within) return std::nullopt;
    return best;
  };
  // A whole run has all its vertices, whatever a curve's length says of its ends.
  const bool from_start = part.from.s <= 0, to_end = part.to.s >= garment.runs[static_cast<std::size_t>(part.run)].length;
  const auto first = from_start && !rows.empty() ? std::optional<std::size_t>(0) : nearest(part.from);
  const auto last = to_end && !rows.empty() ? std::optional<std::size_t>(rows.size() - 1) : nearest(part.to);
  std::vector<int> ids;
  if (!first || !last || *last <= *first) return ids;
  for (std::size_t k = *first; k <= *last; ++k) ids.push_back(rows[k].vertex);
  if (part.reversed) std::reverse(ids.begin(), ids.end());
  return ids;
}

std::string part_text(const GarmentMesh& garment, const RunPart& part) {
  const double length = garment.runs[static_cast<std::size_t>(part.run)].length;
  std::string text = run_name(garment, part.run);
  if (part.from.s > 0 || part.to.s < length) text += fmt::format(" from {:.1f} to {:.1f} mm", part.from.s * 1e3, part.to.s * 1e3);
  return text;
}

}  // namespace toile::tailor
