#include "names.h"

#include "toile/base/text.h"

#include <algorithm>
#include <limits>
#include <set>

namespace toile::tailor {

bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern.front() == '*') return matches(pattern.substr(1), name) || (!name.empty() && matches(pattern, name.substr(1)));
  return !name.empty() && pattern.front() == name.front() && matches(pattern.substr(1), name.substr(1));
}

std::optional<Reference> split_reference(const std::string& text) {
  Reference reference;
  std::string_view rest = trim(text);
  if (!rest.empty() && rest.front() == '-') reference.reversed = true, rest = trim(rest.substr(1));
  // The dots of a stretch (from..to) are no separators.
  const auto dot = rest.substr(0, rest.find('(')).find('.');
  if (dot == std::string_view::npos || dot == 0 || dot + 1 == rest.size()) return std::nullopt;
  reference.panel = rest.substr(0, dot);
  reference.item = rest.substr(dot + 1);
  return reference;
}

Names::Names(const mesh::GarmentMesh& garment, Issues& issues) : garment_(garment), issues_(issues) {
  for (const auto& panel : garment.panels) panel_names_.push_back(panel.name);
}

std::vector<int> Names::panels(const std::string& pattern, const std::string& item) {
  std::vector<int> found;
  for (std::size_t p = 0; p < panel_names_.size(); ++p) {
    if (matches(pattern, panel_names_[p])) found.push_back(static_cast<int>(p));
  }
  if (found.empty()) issues_.push_back({"unknown_panel", {.item = item}, fmt::format("there is no panel '{}'", pattern), suggestion(pattern, panel_names_)});
  return found;
}

std::vector<int> Names::panels(const std::vector<std::string>& patterns, const std::string& item) {
  std::set<int> found;
  for (const std::string& pattern : patterns) {
    for (int p : panels(pattern, item)) found.insert(p);
  }
  return {found.begin(), found.end()};
}

std::vector<int> Names::panels_of(const std::string& panel_or_piece) const {
  std::vector<int> found;
  for (const auto& panel : garment_.panels) {
    if (panel.name == panel_or_piece || panel.piece == panel_or_piece) found.push_back(panel.id);
  }
  return found;
}

std::optional<int> Names::twin(int panel) const {
  const auto& own = garment_.panels[static_cast<std::size_t>(panel)];
  std::optional<int> any;
  int count = 0;
  for (const auto& other : garment_.panels) {
    if (other.piece != own.piece || other.mirrored == own.mirrored) continue;
    if (other.name == own.name + "_m" || own.name == other.name + "_m") return other.id;
    any = other.id;
    ++count;
  }
  return count == 1 ? any : std::nullopt;
}

std::optional<int> Names::point(int panel, const std::string& name, const std::string& item) {
  std::vector<std::string> names;
  for (const auto& point : garment_.points) {
    if (point.panel != panel) continue;
    if (point.name == name) return point.vertex;
    names.push_back(point.name);
  }
  issues_.push_back({"unknown_point", {.item = item}, fmt::format("panel '{}' has no point '{}'", panel_names_[static_cast<std::size_t>(panel)], name), suggestion(name, names)});
  return std::nullopt;
}

std::optional<Names::Place> Names::nearest(int panel, const Eigen::RowVector2d& at, const std::string& code, const std::string& item) {
  Place place{-1, std::numeric_limits<double>::infinity()};
  for (Eigen::Index v = 0; v < garment_.vertex_count(); ++v) {
    if (garment_.vertex_panel[v] != panel) continue;
    const double distance = (garment_.uv.row(v) - at).norm();
    if (distance < place.off) place = {static_cast<int>(v), distance};
  }
  const auto& grid = garment_.panels[static_cast<std::size_t>(panel)];
  const double reach = std::max({grid.cell_warp, grid.cell_weft, 1e-3});
  if (place.off <= reach) return place;
  issues_.push_back({code, {.item = item}, fmt::format("({:.1f}, {:.1f}) mm is {:.1f} mm off panel '{}'", at.x() * 1e3, at.y() * 1e3, place.off * 1e3, grid.name), "move it onto the cloth"});
  return std::nullopt;
}

namespace {

bool well_given(const FastenerEnd& end) { return end.point.has_value() != end.panel.has_value() && end.panel.has_value() == end.at.has_value(); }

}  // namespace

std::optional<Names::Place> Names::place(const FastenerEnd& end, const std::string& code, const std::string& item) {
  if (!well_given(end)) {
    issues_.push_back({code, {.item = item}, "each half is either a `point` or a `panel` with `at`", "give exactly one of the two"});
    return std::nullopt;
  }
  std::string panel_name = end.panel.value_or("");
  std::optional<Reference> reference;
  if (end.point) {
    reference = split_reference(*end.point);
    if (!reference || reference->reversed) {
      issues_.push_back({"unknown_point", {.item = item}, fmt::format("'{}' is not panel.point", *end.point), "write the panel's name, a dot, the point's name"});
      return std::nullopt;
    }
    panel_name = reference->panel;
  }
  const auto panel = mesh::find_panel(garment_, panel_name);
  if (!panel) {
    Issue issue = panel.issues().front();
    issue.place.item = item;
    issues_.push_back(issue);
    return std::nullopt;
  }
  if (!end.point) return nearest(*panel, {(*end.at)[0], (*end.at)[1]}, code, item);
  const auto vertex = point(*panel, reference->item, item);
  if (!vertex) return std::nullopt;
  return Place{*vertex, 0};
}

std::optional<Names::Place> Names::mirrored_place(const FastenerEnd& end, const std::string& code, const std::string& item) {
  if (!well_given(end)) return std::nullopt;  // place() has said so
  const auto reference = end.point ? split_reference(*end.point) : std::nullopt;
  if (end.point && !reference) return std::nullopt;
  const auto panel = mesh::find_panel(garment_, end.point ? reference->panel : *end.panel);
  if (!panel) return std::nullopt;
  const auto other = twin(*panel);
  if (!other) {
    issues_.push_back({code, {.item = item}, fmt::format("panel '{}' has no mirror image", panel_names_[static_cast<std::size_t>(*panel)]), "say under `b` where the other halves are"});
    return std::nullopt;
  }
  if (!end.point) return nearest(*other, {-(*end.at)[0], (*end.at)[1]}, code, item);
  const auto vertex = point(*other, reference->item, item);
  if (!vertex) return std::nullopt;
  return Place{*vertex, 0};
}

std::vector<std::pair<Names::Place, Names::Place>> pairs_of(Names& names, Issues& issues, const std::vector<FastenerEnd>& a, const std::vector<FastenerEnd>& b, const std::string& code, const std::string& item) {
  std::vector<std::pair<Names::Place, Names::Place>> pairs;
  if (a.empty()) issues.push_back({code, {.item = item}, "it has no place", "say under `a` where it is"});
  if (!b.empty() && b.size() != a.size()) {
    issues.push_back({code, {.item = item}, fmt::format("it has {} places under `a` and {} under `b`", a.size(), b.size()), "give as many on both sides"});
    return pairs;
  }
  for (std::size_t k = 0; k < a.size(); ++k) {
    const auto first = names.place(a[k], code, item);
    const auto second = b.empty() ? names.mirrored_place(a[k], code, item) : names.place(b[k], code, item);
    if (first && second) pairs.emplace_back(*first, *second);
  }
  return pairs;
}

}  // namespace toile::tailor
