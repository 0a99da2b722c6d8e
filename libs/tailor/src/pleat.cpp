#include "toile/tailor/pleat.h"

#include <algorithm>

namespace toile::tailor {
namespace {

/// What a line of the other half of a piece cut on the fold is called.
constexpr const char* other_half = "_m";

}  // namespace

std::vector<std::string> pleat_lines(const pattern::Pleated& pleated) {
  std::vector<std::string> lines;
  for (const auto& part : pleated.parts) {
    lines.push_back(part.piece + "." + part.line);
    const auto piece = std::find_if(pleated.pattern.pieces.begin(), pleated.pattern.pieces.end(), [&](const auto& p) { return p.name == part.piece; });
    if (piece->fold) lines.push_back(lines.back() + other_half);
  }
  return lines;
}

std::vector<FoldSpec> pleat_folds(const mesh::GarmentMesh& garment, const pattern::Pleated& pleated, const std::vector<pattern::PleatSpec>& specs) {
  std::vector<FoldSpec> folds;
  for (const auto& run : garment.runs) {
    const mesh::Panel& panel = garment.panels[static_cast<std::size_t>(run.panel)];
    for (const auto& part : pleated.parts) {
      if (!run.internal || part.angle == 0 || part.piece != panel.piece || (run.name != part.line && run.name != part.line + other_half)) continue;
      const pattern::PleatSpec& spec = specs[part.spec];
      FoldSpec fold;
      fold.name = panel.name + "." + run.name;
      fold.line = {fold.name};
      fold.kind = part.kind;
      fold.angle = part.angle;
      fold.radius = spec.radius;
      fold.residual = spec.residual;
      fold.factor = spec.factor;
      folds.push_back(std::move(fold));
    }
  }
  return folds;
}

}  // namespace toile::tailor
