#include "line_part.h"

#include "line_reference.h"

namespace toile::tailor {

Result<std::vector<LinePart>> find_line(const mesh::GarmentMesh& garment, const std::string& text) {
  const auto parts = find_parts(garment, text);
  if (!parts) {
    Issues issues = parts.issues();
    for (Issue& issue : issues) {
      if (issue.code != "unknown_edge") continue;
      issue.code = "unknown_line";
      issue.remedy += "; an internal line of the pattern is an edge of the mesh where the `lines` of toile-mesh name it";
    }
    return issues;
  }
  std::vector<LinePart> result;
  for (const RunPart& part : *parts) {
    const double length = garment.runs[static_cast<std::size_t>(part.run)].length;
    LinePart line{part.run, part.from.s <= 0 && part.to.s >= length, part_vertices(garment, part)};
    if (line.vertices.size() < 2) return Issue{"no_vertex", {}, fmt::format("the mesh has no particles at the ends of {}", part_text(garment, part)), "let it end at a named point, a notch, or where a seam begins or ends"};
    result.push_back(std::move(line));
  }
  return result;
}

Result<std::vector<int>> find_row(const mesh::GarmentMesh& garment, const std::string& text) {
  TOILE_TRY(const std::vector<LinePart> parts, find_line(garment, text));
  std::vector<int> row;
  for (const LinePart& part : parts) {
    const bool goes_on = !row.empty() && row.back() == part.vertices.front();
    row.insert(row.end(), part.vertices.begin() + (goes_on ? 1 : 0), part.vertices.end());
  }
  return row;
}

}  // namespace toile::tailor
