#include "line_part.h"

#include "toile/base/text.h"

#include <algorithm>

namespace toile::tailor {

Result<LinePart> find_line(const mesh::GarmentMesh& garment, const std::string& text) {
  const Issue malformed{"bad_reference", {}, fmt::format("'{}' is not panel.line", text), "write the panel's name, a dot, the line's name, and a stretch of it as (from..to); '-' before it runs it backwards"};
  std::string_view rest = toile::trim(text);
  LinePart part;
  if (!rest.empty() && rest.front() == '-') part.reversed = true, rest = toile::trim(rest.substr(1));
  std::string from, to;
  if (const auto open = rest.find('('); open != std::string_view::npos) {
    const auto dots = rest.find("..", open);
    if (rest.back() != ')' || dots == std::string_view::npos) return malformed;
    from = toile::trim(rest.substr(open + 1, dots - open - 1));
    to = toile::trim(rest.substr(dots + 2, rest.size() - dots - 3));
    if (from.empty() || to.empty()) return malformed;
    rest = toile::trim(rest.substr(0, open));
    part.whole = false;
  }
  const auto dot = rest.find('.');
  if (dot == std::string_view::npos || dot == 0 || dot + 1 == rest.size()) return malformed;
  TOILE_TRY(const int panel, mesh::find_panel(garment, std::string(rest.substr(0, dot))));
  const std::string name(rest.substr(dot + 1)), panel_name = garment.panels[static_cast<std::size_t>(panel)].name;
  const auto run = mesh::find_run(garment, panel, name);
  if (!run) {
    std::vector<std::string> names;
    for (const auto& other : garment.runs) {
      if (other.panel == panel) names.push_back(other.name);
    }
    const auto near = nearest_word(name, names);
    return Issue{"unknown_line", {}, fmt::format("panel '{}' has no edge or line '{}' in its mesh", panel_name, name),
                 fmt::format("{}an internal line of the pattern becomes one where toile-mesh is told so: lines: [{}.{}]", near ? fmt::format("did you mean '{}'? Otherwise: ", *near) : "", panel_name, name)};
  }
  part.run = *run;
  part.vertices = mesh::run_vertex_ids(garment, *run);
  if (!part.whole) {
    std::array<std::ptrdiff_t, 2> ends{};
    for (std::size_t k = 0; k < 2; ++k) {
      const std::string& wanted = k == 0 ? from : to;
      std::vector<std::string> names;
      ends[k] = -1;
      for (const auto& point : garment.points) {
        const auto found = std::find(part.vertices.begin(), part.vertices.end(), point.vertex);
        if (point.panel != panel || found == part.vertices.end()) continue;
        names.push_back(point.name);
        if (point.name == wanted) ends[k] = found - part.vertices.begin();
      }
      if (ends[k] < 0) return Issue{"unknown_point", {}, fmt::format("'{}.{}' has no point '{}'", panel_name, name, wanted), suggestion(wanted, names)};
    }
    if (ends[0] >= ends[1]) return Issue{"bad_range", {}, fmt::format("on '{}.{}' the point '{}' does not come before '{}'", panel_name, name, from, to), "name them in the direction of the edge"};
    part.vertices = {part.vertices.begin() + ends[0], part.vertices.begin() + ends[1] + 1};
  }
  if (part.reversed) std::reverse(part.vertices.begin(), part.vertices.end());
  return part;
}

}  // namespace toile::tailor
