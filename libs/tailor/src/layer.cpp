#include "toile/tailor/layer.h"

#include "toile/base/text.h"
#include "toile/fabric/laminate.h"
#include "toile/tailor/quality.h"

#include <algorithm>
#include <limits>
#include <set>

namespace toile::tailor {
namespace {

bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern.front() == '*') return matches(pattern.substr(1), name) || (!name.empty() && matches(pattern, name.substr(1)));
  return !name.empty() && pattern.front() == name.front() && matches(pattern.substr(1), name.substr(1));
}

/// Even-odd rule; points on the outline count to one side or the other, the same everywhere.
bool inside(const std::vector<std::array<double, 2>>& polygon, double u, double v) {
  bool result = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const auto &a = polygon[i], &b = polygon[j];
    if ((a[1] > v) != (b[1] > v) && u < (b[0] - a[0]) * (v - a[1]) / (b[1] - a[1]) + a[0]) result = !result;
  }
  return result;
}

}  // namespace

Result<Layered> layer(const mesh::GarmentMesh& garment, const std::vector<fabric::Card>& cards, const LayerParams& params) {
  Issues issues;
  std::vector<std::string> card_names, panel_names;
  for (const auto& card : cards) {
    if (std::find(card_names.begin(), card_names.end(), card.name) != card_names.end()) issues.push_back({"duplicate_fabric", {}, fmt::format("two of the fabric files are named '{}'", card.name), "give each fabric its own name"});
    card_names.push_back(card.name);
  }
  for (const auto& panel : garment.panels) panel_names.push_back(panel.name);
  const auto card_index = [&](const std::string& name, const std::string& item) -> int {
    const auto found = std::find(card_names.begin(), card_names.end(), name);
    if (found != card_names.end()) return static_cast<int>(found - card_names.begin());
    issues.push_back({"unknown_fabric", {.item = item}, fmt::format("no fabric file describes '{}'", name), card_names.empty() ? "give its card with --fabrics" : suggestion(name, card_names)});
    return -1;
  };
  const auto panels_named = [&](const std::string& pattern, const std::string& item) {
    std::vector<std::size_t> found;
    for (std::size_t p = 0; p < panel_names.size(); ++p) {
      if (matches(pattern, panel_names[p])) found.push_back(p);
    }
    if (found.empty()) issues.push_back({"unknown_panel", {.item = item}, fmt::format("there is no panel '{}'", pattern), suggestion(pattern, panel_names)});
    return found;
  };

  const int base = card_index(params.base, "base");
  std::vector<int> cloth(garment.panels.size(), base);
  std::vector<std::string> said_by(garment.panels.size());
  for (const auto& [pattern, fabric] : params.panels) {
    const int card = card_index(fabric, "panels." + pattern);
    for (std::size_t p : panels_named(pattern, "panels." + pattern)) {
      // A panel's own name goes before patterns with *; two patterns for one panel are a contradiction.
      const bool own = pattern == panel_names[p];
      if (!said_by[p].empty() && !own && said_by[p] != panel_names[p]) {
        issues.push_back({"ambiguous_fabric", {.item = "panels." + pattern}, fmt::format("panel '{}' is also named by '{}'", panel_names[p], said_by[p]), "name the panel itself"});
      }
      if (said_by[p] == panel_names[p]) continue;
      said_by[p] = pattern;
      cloth[p] = card;
    }
  }

  // Sheets of every face, face side first.
  const Eigen::Index face_count = garment.face_count();
  std::vector<std::vector<int>> stacks(static_cast<std::size_t>(face_count));
  for (Eigen::Index f = 0; f < face_count; ++f) stacks[static_cast<std::size_t>(f)] = {cloth[static_cast<std::size_t>(garment.face_panel[f])]};
  std::set<std::string> layer_names;
  for (const BondedLayer& layer : params.bonded) {
    const std::string item = "bonded " + layer.name;
    if (!layer_names.insert(layer.name).second) issues.push_back({"duplicate_name", {.item = item}, "two layers have this name", "rename one"});
    const int card = card_index(layer.fabric, item);
    if (!layer.region.empty() && layer.region.size() < 3) issues.push_back({"bad_region", {.item = item}, "a region needs at least three corners", "list its corners in order"});
    std::set<std::size_t> panels;
    for (const std::string& pattern : layer.panels) {
      for (std::size_t p : panels_named(pattern, item)) panels.insert(p);
    }
    if (layer.panels.empty()) issues.push_back({"unknown_panel", {.item = item}, "it names no panel", "list them under `panels`"});
    std::vector<int> covered(garment.panels.size(), 0);
    for (Eigen::Index f = 0; f < face_count; ++f) {
      const std::size_t p = static_cast<std::size_t>(garment.face_panel[f]);
      if (!panels.count(p)) continue;
      if (layer.region.size() >= 3) {
        const Eigen::Vector2d middle = (garment.uv.row(garment.faces(f, 0)) + garment.uv.row(garment.faces(f, 1)) + garment.uv.row(garment.faces(f, 2))) / 3;
        if (!inside(layer.region, garment.panels[p].mirrored ? -middle.x() : middle.x(), middle.y())) continue;
      }
      ++covered[p];
      auto& stack = stacks[static_cast<std::size_t>(f)];
      if (layer.side == LayerSide::under) stack.push_back(card);
      else stack.insert(stack.begin(), card);
    }
    for (std::size_t p : panels) {
      if (covered[p] == 0) {
        const auto rows = garment.panels[p].name;
        issues.push_back({"empty_region", {.item = item}, fmt::format("the region covers no part of panel '{}'", rows), "check its corners: panel coordinates, u across, v along the warp"});
      }
    }
  }

  // Fasteners.
  std::vector<mesh::Fastener> fasteners;
  for (const FastenerSpec& spec : params.fasteners) {
    const std::string item = "fastener " + spec.name;
    const auto place = [&](const FastenerEnd& end) -> int {
      if (end.point.has_value() == (end.panel.has_value() || end.at.has_value()) || end.panel.has_value() != end.at.has_value()) {
        issues.push_back({"bad_fastener", {.item = item}, "each half is either a `point` or a `panel` with `at`", "give exactly one of the two"});
        return -1;
      }
      if (end.point) {
        std::vector<std::string> names;
        for (const auto& point : garment.points) {
          names.push_back(panel_names[static_cast<std::size_t>(point.panel)] + "." + point.name);
          if (names.back() == *end.point) return point.vertex;
        }
        issues.push_back({"unknown_point", {.item = item}, fmt::format("there is no point '{}'", *end.point), suggestion(*end.point, names)});
        return -1;
      }
      const auto panel = mesh::find_panel(garment, *end.panel);
      if (!panel) {
        Issue issue = panel.issues().front();
        issue.place.item = item;
        issues.push_back(issue);
        return -1;
      }
      const Eigen::RowVector2d at((*end.at)[0], (*end.at)[1]);
      int nearest = -1;
      double best = std::numeric_limits<double>::infinity();
      for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
        const double distance = (garment.uv.row(v) - at).norm();
        if (garment.vertex_panel[v] == *panel && distance < best) best = distance, nearest = static_cast<int>(v);
      }
      const auto& grid = garment.panels[static_cast<std::size_t>(*panel)];
      const double reach = std::max({grid.cell_warp, grid.cell_weft, 1e-3});
      if (best > reach) {
        issues.push_back({"bad_fastener", {.item = item}, fmt::format("({:.1f}, {:.1f}) mm is {:.1f} mm off panel '{}'", at.x() * 1e3, at.y() * 1e3, best * 1e3, *end.panel), "move it onto the cloth"});
        return -1;
      }
      return nearest;
    };
    const int a = place(spec.a), b = place(spec.b);
    if (a < 0 || b < 0) continue;
    if (a == b) {
      issues.push_back({"bad_fastener", {.item = item}, "its two halves are the same particle", "set them farther apart"});
      continue;
    }
    fasteners.push_back({a, b, static_cast<mesh::Fastener::Kind>(static_cast<int>(spec.kind)), spec.mass, spec.length, -1, true, 0, 0});
  }
  if (!issues.empty()) return issues;

  Layered result;
  result.garment = garment;
  mesh::GarmentMesh& layered = result.garment;
  layered.fasteners = std::move(fasteners);
  layered.laminates.clear();
  layered.fabrics.clear();
  std::map<std::vector<int>, int> laminate_of;
  std::set<int> used;
  for (Eigen::Index f = 0; f < face_count; ++f) {
    const auto& stack = stacks[static_cast<std::size_t>(f)];
    const auto [found, fresh] = laminate_of.emplace(stack, static_cast<int>(layered.laminates.size()));
    layered.face_laminate[f] = found->second;
    if (!fresh) continue;
    mesh::Laminate laminate;
    laminate.id = found->second;
    std::vector<fabric::Card> sheets;
    for (int card : stack) {
      const auto& sheet = cards[static_cast<std::size_t>(card)];
      used.insert(card);
      laminate.name += (laminate.name.empty() ? "" : "+") + sheet.name;
      laminate.plies.push_back({sheet.name, "", sheet.areal_density});
      sheets.push_back(sheet);
    }
    TOILE_TRY(laminate.equivalent, fabric::bonded(sheets, laminate.name));
    layered.laminates.push_back(std::move(laminate));
  }
  std::map<std::string, Material> materials;
  for (int card : used) {
    layered.fabrics.push_back(cards[static_cast<std::size_t>(card)]);
    materials[cards[static_cast<std::size_t>(card)].name].fabric = cards[static_cast<std::size_t>(card)].name;
  }
  std::sort(layered.fabrics.begin(), layered.fabrics.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  const Eigen::VectorXd areas = mesh::rest_areas(layered);
  for (Eigen::Index f = 0; f < face_count; ++f) {
    for (const mesh::Ply& ply : layered.laminates[static_cast<std::size_t>(layered.face_laminate[f])].plies) {
      Material& material = materials[ply.fabric];
      material.area += areas[f];
      material.mass += areas[f] * ply.areal_density;
    }
  }
  for (const auto& [name, material] : materials) {
    result.materials.push_back(material);
    result.mass += material.mass;
  }
  for (const auto& fastener : layered.fasteners) result.mass += fastener.mass;
  return result;
}

}  // namespace toile::tailor
