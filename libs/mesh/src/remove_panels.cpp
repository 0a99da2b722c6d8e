#include "toile/mesh/remove_panels.h"

#include <algorithm>

namespace toile::mesh {
namespace {

/// New index of every kept row; -1 for the others.
template <class Kept>
std::vector<int> renumbered(std::size_t count, Kept kept) {
  std::vector<int> number(count, -1);
  int next = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (kept(k)) number[k] = next++;
  }
  return number;
}

/// Keeps the rows with a number; ids follow.
template <class Row>
void keep(std::vector<Row>& rows, const std::vector<int>& number) {
  std::vector<Row> kept;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (number[k] >= 0) kept.push_back(std::move(rows[k]));
    if constexpr (requires(Row row) { row.id; }) {
      if (number[k] >= 0) kept.back().id = number[k];
    }
  }
  rows = std::move(kept);
}

template <class Rows>
Rows kept_rows(const Rows& rows, const std::vector<int>& number) {
  Rows kept(std::count_if(number.begin(), number.end(), [](int n) { return n >= 0; }), rows.cols());
  for (std::size_t k = 0; k < number.size(); ++k) {
    if (number[k] >= 0) kept.row(number[k]) = rows.row(static_cast<Eigen::Index>(k));
  }
  return kept;
}

void keep(std::map<std::string, Column>& columns, const std::vector<int>& number) {
  for (auto& [name, column] : columns) {
    Column kept;
    kept.integer = column.integer;
    for (std::size_t k = 0; k < number.size(); ++k) {
      if (number[k] < 0) continue;
      if (column.integer) kept.integers.push_back(column.integers[k]);
      else kept.reals.push_back(column.reals[k]);
    }
    column = std::move(kept);
  }
}

}  // namespace

GarmentMesh without_panels(const GarmentMesh& garment, const std::vector<char>& removed) {
  GarmentMesh g = garment;
  const auto gone = [&](int panel) { return removed[static_cast<std::size_t>(panel)] != 0; };
  const auto panel = renumbered(g.panels.size(), [&](std::size_t p) { return !removed[p]; });
  const auto vertex = renumbered(static_cast<std::size_t>(g.vertex_count()), [&](std::size_t v) { return !gone(g.vertex_panel[static_cast<Eigen::Index>(v)]); });
  const auto face = renumbered(static_cast<std::size_t>(g.face_count()), [&](std::size_t f) { return !gone(g.face_panel[static_cast<Eigen::Index>(f)]); });
  const auto run = renumbered(g.runs.size(), [&](std::size_t r) { return !gone(g.runs[r].panel); });
  const auto of = [](const std::vector<int>& number, int& id) { id = number[static_cast<std::size_t>(id)]; };

  g.x = kept_rows(g.x, vertex);
  g.uv = kept_rows(g.uv, vertex);
  g.vertex_panel = kept_rows(g.vertex_panel, vertex);
  keep(g.vertex_columns, vertex);
  g.faces = kept_rows(g.faces, face);
  g.face_panel = kept_rows(g.face_panel, face);
  g.face_laminate = kept_rows(g.face_laminate, face);
  keep(g.face_columns, face);
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) of(panel, g.vertex_panel[v]);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    of(panel, g.face_panel[f]);
    for (int k = 0; k < 3; ++k) of(vertex, g.faces(f, k));
  }

  const auto lost = [&](int v) { return vertex[static_cast<std::size_t>(v)] < 0; };
  std::erase_if(g.welds, [&](const auto& weld) { return lost(weld.a) || lost(weld.b); });
  std::erase_if(g.fasteners, [&](const auto& fastener) { return lost(fastener.a) || lost(fastener.b); });
  for (auto& weld : g.welds) of(vertex, weld.a), of(vertex, weld.b);
  for (auto& fastener : g.fasteners) of(vertex, fastener.a), of(vertex, fastener.b);
  std::erase_if(g.hinges, [&](const auto& hinge) { return lost(hinge.v0) || lost(hinge.v1) || lost(hinge.o0) || lost(hinge.o1); });
  for (auto& hinge : g.hinges) of(vertex, hinge.v0), of(vertex, hinge.v1), of(vertex, hinge.o0), of(vertex, hinge.o1);
  std::erase_if(g.trim_segments, [&](const auto& segment) { return lost(segment.a) || lost(segment.b); });
  for (auto& segment : g.trim_segments) of(vertex, segment.a), of(vertex, segment.b);
  std::erase_if(g.run_vertices, [&](const auto& row) { return run[static_cast<std::size_t>(row.run)] < 0; });
  for (auto& row : g.run_vertices) of(run, row.run), of(vertex, row.vertex);
  std::erase_if(g.points, [&](const auto& point) { return gone(point.panel); });
  for (auto& point : g.points) of(panel, point.panel), of(vertex, point.vertex);

  // Folds and trims that lay on removed panels only.
  const auto fold = renumbered(g.folds.size(), [&](std::size_t k) {
    auto& runs = g.folds[k].runs;
    const bool lay_there = !runs.empty() && std::all_of(runs.begin(), runs.end(), [&](int r) { return run[static_cast<std::size_t>(r)] < 0; });
    std::erase_if(runs, [&](int r) { return run[static_cast<std::size_t>(r)] < 0; });
    for (int& r : runs) of(run, r);
    return !lay_there;
  });
  for (auto& hinge : g.hinges) {
    if (hinge.fold >= 0) of(fold, hinge.fold);
  }
  keep(g.folds, fold);
  std::vector<char> has_segments(g.trims.size(), 0), had_segments(g.trims.size(), 0);
  for (const auto& segment : g.trim_segments) has_segments[static_cast<std::size_t>(segment.trim)] = 1;
  for (const auto& segment : garment.trim_segments) had_segments[static_cast<std::size_t>(segment.trim)] = 1;
  const auto trim = renumbered(g.trims.size(), [&](std::size_t k) { return has_segments[k] || !had_segments[k]; });
  for (auto& segment : g.trim_segments) of(trim, segment.trim);
  keep(g.trims, trim);

  keep(g.runs, run);
  for (auto& row : g.runs) of(panel, row.panel);
  for (auto& layer : g.free_layers) {
    for (auto* list : {&layer.panels, &layer.on}) {
      std::erase_if(*list, gone);
      for (int& p : *list) of(panel, p);
    }
  }
  const auto layer = renumbered(g.free_layers.size(), [&](std::size_t k) { return !g.free_layers[k].panels.empty() && !g.free_layers[k].on.empty(); });
  keep(g.free_layers, layer);
  keep(g.panels, panel);
  return g;
}

}  // namespace toile::mesh
