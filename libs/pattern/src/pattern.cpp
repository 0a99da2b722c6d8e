#include "toile/pattern/pattern.h"

namespace toile::pattern {

double in_metres(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::mm: return 1e-3;
    case LengthUnit::cm: return 1e-2;
    case LengthUnit::m: return 1;
    case LengthUnit::inch: return 0.0254;
  }
  return 1;
}

const PanelEdge* find_edge(const CutPanel& panel, std::string_view name) {
  for (const PanelEdge& edge : panel.outline) {
    if (edge.name == name) return &edge;
  }
  for (const PanelHole& hole : panel.holes) {
    for (const PanelEdge& edge : hole.edges) {
      if (edge.name == name) return &edge;
    }
  }
  return nullptr;
}

const CutPanel* find_panel(const std::vector<CutPanel>& panels, std::string_view name) {
  for (const CutPanel& panel : panels) {
    if (panel.name == name) return &panel;
  }
  return nullptr;
}

}  // namespace toile::pattern
