// Which panel lies on which: a consistent order from pairwise relations.
#include "names.h"

#include "toile/base/text.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>

namespace toile::tailor {
namespace {

/// `above` lies outside of `below`, as the layer says.
struct Relation {
  int below = 0, above = 0;
  std::string layer;
};

/// Panels so that every one comes after those below it (of several the lowest id first); shorter where there is a cycle.
std::vector<int> sorted_upwards(std::size_t count, const std::vector<Relation>& relations) {
  std::vector<int> waiting(count, 0);
  for (const Relation& relation : relations) ++waiting[static_cast<std::size_t>(relation.above)];
  std::set<int> ready;
  for (std::size_t p = 0; p < count; ++p) {
    if (waiting[p] == 0) ready.insert(static_cast<int>(p));
  }
  std::vector<int> order;
  while (!ready.empty()) {
    const int p = *ready.begin();
    ready.erase(ready.begin());
    order.push_back(p);
    for (const Relation& relation : relations) {
      if (relation.below == p && --waiting[static_cast<std::size_t>(relation.above)] == 0) ready.insert(relation.above);
    }
  }
  return order;
}

/// One cycle among the panels that could not be sorted, in words.
std::string cycle_text(const std::vector<Relation>& relations, const std::vector<int>& sorted, std::size_t count, const std::vector<std::string>& names) {
  std::vector<char> open(count, 1);
  for (int p : sorted) open[static_cast<std::size_t>(p)] = 0;
  // Every open panel has an open one below it: going down, a panel comes up again.
  std::vector<const Relation*> path;
  std::vector<int> seen_at(count, -1);
  int p = static_cast<int>(std::find(open.begin(), open.end(), 1) - open.begin());
  while (seen_at[static_cast<std::size_t>(p)] < 0) {
    seen_at[static_cast<std::size_t>(p)] = static_cast<int>(path.size());
    const auto down = std::find_if(relations.begin(), relations.end(), [&](const Relation& r) { return r.above == p && open[static_cast<std::size_t>(r.below)]; });
    path.push_back(&*down);
    p = down->below;
  }
  std::string text;
  for (std::size_t k = static_cast<std::size_t>(seen_at[static_cast<std::size_t>(p)]); k < path.size(); ++k) {
    text += fmt::format("{}{} outside {} (layer {})", text.empty() ? "" : ", ", names[static_cast<std::size_t>(path[k]->above)], names[static_cast<std::size_t>(path[k]->below)], path[k]->layer);
  }
  return text;
}

}  // namespace

Result<mesh::GarmentMesh> free_layers(const mesh::GarmentMesh& garment, const std::vector<FreeSpec>& layers) {
  Issues issues;
  Names names(garment, issues);
  mesh::GarmentMesh result = garment;
  result.free_layers.clear();
  std::vector<Relation> relations;
  std::vector<char> lies_free(garment.panels.size(), 0);
  std::set<std::string> used;
  for (const FreeSpec& spec : layers) {
    const std::string item = "free layer " + spec.name;
    if (!used.insert(spec.name).second) issues.push_back({"duplicate_name", {.item = item}, "two free layers have this name", "rename one"});
    mesh::FreeLayer layer;
    layer.id = static_cast<int>(result.free_layers.size());
    layer.name = spec.name;
    layer.panels = names.panels(spec.panels, item);
    layer.on = names.panels(spec.on, item);
    layer.outside = spec.side == FreeSide::outside;
    if (spec.panels.empty()) issues.push_back({"bad_layer", {.item = item}, "it consists of no panel", "list them under `panels`"});
    if (spec.on.empty()) issues.push_back({"bad_layer", {.item = item}, "it lies on no panel", "list them under `on`"});
    for (int p : layer.panels) {
      lies_free[static_cast<std::size_t>(p)] = 1;
      for (int q : layer.on) {
        if (p == q) issues.push_back({"bad_layer", {.item = item}, fmt::format("panel '{}' would lie on itself", garment.panels[static_cast<std::size_t>(p)].name), "take it out of `panels` or of `on`"});
        else relations.push_back(layer.outside ? Relation{q, p, spec.name} : Relation{p, q, spec.name});
      }
    }
    result.free_layers.push_back(std::move(layer));
  }
  if (!issues.empty()) return issues;

  const std::vector<int> sorted = sorted_upwards(garment.panels.size(), relations);
  if (sorted.size() < garment.panels.size()) {
    return Issue{"layer_cycle", {.item = "free"}, "no order of the panels satisfies all layers: " + cycle_text(relations, sorted, garment.panels.size(), names.panel_names()), "take one of these relations away or turn it round"};
  }
  // The cloth that others lie on is at 0, unless it lies on other such cloth; the rest as near to it as possible.
  constexpr int none = std::numeric_limits<int>::max();
  std::vector<int> order(garment.panels.size(), 0), most(garment.panels.size(), none), above_cloth(garment.panels.size(), none);
  std::vector<char> cloth(garment.panels.size(), 0);
  for (int p : sorted) {
    int own = none;
    for (const Relation& r : relations) {
      if (r.above == p && above_cloth[static_cast<std::size_t>(r.below)] != none) own = 0;
    }
    cloth[static_cast<std::size_t>(p)] = own == none && !lies_free[static_cast<std::size_t>(p)];
    above_cloth[static_cast<std::size_t>(p)] = cloth[static_cast<std::size_t>(p)] ? 0 : own;
  }
  for (auto it = sorted.rbegin(); it != sorted.rend(); ++it) {
    int& own = most[static_cast<std::size_t>(*it)];
    if (cloth[static_cast<std::size_t>(*it)]) own = 0;
    for (const Relation& r : relations) {
      if (r.below == *it && most[static_cast<std::size_t>(r.above)] != none) own = std::min(own, most[static_cast<std::size_t>(r.above)] - 1);
    }
  }
  for (int p : sorted) {
    std::optional<int> own;
    for (const Relation& r : relations) {
      if (r.above == p) own = std::max(own.value_or(order[static_cast<std::size_t>(r.below)] + 1), order[static_cast<std::size_t>(r.below)] + 1);
    }
    const int limit = most[static_cast<std::size_t>(p)];
    order[static_cast<std::size_t>(p)] = cloth[static_cast<std::size_t>(p)] ? 0 : own ? *own : limit != none ? limit : 0;
  }
  for (const Relation& r : relations) {
    TOILE_CHECK(order[static_cast<std::size_t>(r.below)] < order[static_cast<std::size_t>(r.above)], "panels {} and {} have orders {} and {}", r.below, r.above, order[static_cast<std::size_t>(r.below)], order[static_cast<std::size_t>(r.above)]);
  }
  for (auto& panel : result.panels) panel.order = order[static_cast<std::size_t>(panel.id)];
  return result;
}

}  // namespace toile::tailor
