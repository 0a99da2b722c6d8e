#include "toile/tailor/mesh_panels.h"

#include "panel_grid.h"
#include "wildcard.h"

#include "toile/base/parallel.h"
#include "toile/base/text.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace toile::tailor {
namespace {

/// Where each panel goes on the table: rows from left to right, about as wide as high, 5 cm apart.
std::vector<Eigen::Vector2d> table_layout(const std::vector<PanelMesh>& meshes) {
  constexpr double gap = 0.05;
  double area = 0, widest = 0;
  for (const PanelMesh& mesh : meshes) {
    const Eigen::Vector2d size = (mesh.uv.colwise().maxCoeff() - mesh.uv.colwise().minCoeff()).transpose();
    area += (size.x() + gap) * (size.y() + gap);
    widest = std::max(widest, size.x());
  }
  const double row_width = std::max(widest, 1.6 * std::sqrt(area));
  std::vector<Eigen::Vector2d> offsets;
  Eigen::Vector2d pen = Eigen::Vector2d::Zero();
  double row_height = 0;
  for (const PanelMesh& mesh : meshes) {
    const Eigen::Vector2d low = mesh.uv.colwise().minCoeff().transpose(), size = mesh.uv.colwise().maxCoeff().transpose() - low;
    if (pen.x() > 0 && pen.x() + size.x() > row_width) {
      pen = {0, pen.y() + row_height + gap};
      row_height = 0;
    }
    offsets.push_back(pen - low);
    pen.x() += size.x() + gap;
    row_height = std::max(row_height, size.y());
  }
  return offsets;
}

}  // namespace

Result<mesh::GarmentMesh> mesh_panels(const std::vector<pattern::CutPanel>& all_panels, const MeshParams& params) {
  Issues issues;
  std::vector<std::string> names;
  for (const auto& panel : all_panels) {
    names.push_back(panel.name);
    if (panel.piece != panel.name) names.push_back(panel.piece);
  }
  const auto is_for = [](const std::string& name, const pattern::CutPanel& panel) { return name == panel.name || name == panel.piece; };
  const auto known = [&](const std::string& name, const char* key) {
    if (std::find(names.begin(), names.end(), name) == names.end()) issues.push_back({"unknown_panel", {.item = key}, fmt::format("the pattern has no panel or piece '{}'", name), suggestion(name, names)});
  };
  for (const auto& [name, grid] : params.panels) known(name, "panels");
  for (const std::string& name : params.leave_out) known(name, "leave_out");

  std::vector<const pattern::CutPanel*> panels;
  for (const auto& panel : all_panels) {
    if (std::none_of(params.leave_out.begin(), params.leave_out.end(), [&](const std::string& name) { return is_for(name, panel); })) panels.push_back(&panel);
  }
  if (panels.empty()) issues.push_back({"no_panels", {}, "no panel is left to cut", "give a pattern with pieces, or leave out fewer"});

  std::vector<GridSettings> settings;
  for (const pattern::CutPanel* panel : panels) {
    GridSettings grid;
    grid.cell_warp = params.cell_warp.value_or(params.cell);
    grid.cell_weft = params.cell_weft.value_or(params.cell);
    grid.diagonal = params.diagonal;
    grid.mesher = params.mesher;
    grid.turn = params.turn;
    grid.jitter = params.jitter;
    // What is said of the panel itself goes before what is said of its piece.
    for (const std::string& name : {panel->piece, panel->name}) {
      const auto found = params.panels.find(name);
      if (found == params.panels.end()) continue;
      const PanelGrid& own = found->second;
      if (own.cell) grid.cell_warp = grid.cell_weft = *own.cell;
      if (own.cell_warp) grid.cell_warp = *own.cell_warp;
      if (own.cell_weft) grid.cell_weft = *own.cell_weft;
      grid.diagonal = own.diagonal.value_or(grid.diagonal);
      grid.mesher = own.mesher.value_or(grid.mesher);
      grid.turn = own.turn.value_or(grid.turn);
      grid.jitter = own.jitter.value_or(grid.jitter);
    }
    grid.cell_warp *= params.scale;
    grid.cell_weft *= params.scale;
    settings.push_back(grid);
  }
  std::vector<std::set<std::string>> lines(panels.size()), named(panels.size());
  const auto ask = [&](const std::vector<std::string>& references, const char* key, const auto& take) {
    for (const std::string& reference : references) {
      const auto dot = reference.find('.');
      bool used = false;
      for (std::size_t p = 0; p < panels.size() && dot != std::string::npos; ++p) {
        const std::string panel = reference.substr(0, dot), name = reference.substr(dot + 1);
        if (!fits(panel, panels[p]->name) && !fits(panel, panels[p]->piece)) continue;
        for (const auto& line : panels[p]->lines) {
          if (!fits(name, line.name)) continue;
          used |= take(p, line, has_wildcard(name));
          if (!has_wildcard(reference)) named[p].insert(line.name);
        }
      }
      if (used || has_wildcard(reference)) continue;
      std::vector<std::string> candidates;
      for (const auto* panel : panels) {
        for (const auto& line : panel->lines) candidates.push_back(panel->name + "." + line.name);
      }
      issues.push_back({"unknown_line", {.item = key}, fmt::format("there is no internal line '{}'", reference), suggestion(reference, candidates)});
    }
  };
  ask(params.lines, "lines", [&](std::size_t p, const pattern::PanelLine& line, bool) {
    lines[p].insert(line.name);
    return true;
  });
  ask(params.cut, "cut", [&](std::size_t p, const pattern::PanelLine& line, bool any) {
    if (any && line.kind != pattern::LineKind::cut && line.kind != pattern::LineKind::dart) return false;
    lines[p].insert(line.name);
    if (std::find(settings[p].cut.begin(), settings[p].cut.end(), line.name) == settings[p].cut.end()) settings[p].cut.push_back(line.name);
    return true;
  });
  std::vector<pattern::CutPanel> work;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    work.push_back(*panels[p]);
    std::erase_if(work.back().lines, [&](const auto& line) { return lines[p].count(line.name) == 0; });
  }
  if (!issues.empty()) return issues;

  // A turned-over copy is the exact mirror image of its twin.
  std::vector<int> twin(panels.size(), -1);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    if (!panels[p]->mirrored) continue;
    for (std::size_t q = 0; q < panels.size() && twin[p] < 0; ++q) {
      const bool same_grid = settings[p].cell_warp == settings[q].cell_warp && settings[p].cell_weft == settings[q].cell_weft &&
                             settings[p].diagonal == settings[q].diagonal && settings[p].mesher == settings[q].mesher && settings[p].turn == settings[q].turn && settings[p].jitter == settings[q].jitter &&
                             settings[p].cut == settings[q].cut && lines[p] == lines[q];
      if (panels[q]->piece == panels[p]->piece && !panels[q]->mirrored && same_grid) twin[p] = static_cast<int>(q);
    }
  }
  std::vector<Issues> troubles(panels.size());
  std::vector<PanelMesh> meshes(panels.size());
  parallel_for(panels.size(), 1, [&](std::size_t p) {
    if (twin[p] >= 0) return;
    auto mesh = mesh_panel(work[p], settings[p]);
    if (mesh) meshes[p] = std::move(*mesh);
    else troubles[p] = mesh.issues();
  });
  for (const Issues& trouble : troubles) append(issues, trouble);
  if (!issues.empty()) return issues;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    if (twin[p] >= 0) continue;
    for (const std::string& line : named[p]) {
      const bool there = std::any_of(meshes[p].runs.begin(), meshes[p].runs.end(), [&](const GridRun& run) { return run.name == line || run.name.starts_with(line + "_"); });
      if (!there) issues.push_back({"line_cut_away", {.item = panels[p]->name + "." + line}, "the line lies in what is cut out", "leave it out"});
    }
  }
  if (!issues.empty()) return issues;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    if (twin[p] >= 0) meshes[p] = mirrored(meshes[static_cast<std::size_t>(twin[p])]);
  }

  mesh::GarmentMesh garment;
  Eigen::Index vertices = 0, faces = 0;
  for (const PanelMesh& mesh : meshes) {
    vertices += mesh.uv.rows();
    faces += mesh.faces.rows();
  }
  garment.x.setZero(vertices, 3);
  garment.uv.resize(vertices, 2);
  garment.vertex_panel.resize(vertices);
  garment.faces.resize(faces, 3);
  garment.face_panel.resize(faces);
  garment.face_laminate = mesh::Ids::Constant(faces, -1);
  const std::vector<Eigen::Vector2d> offsets = table_layout(meshes);
  Eigen::Index v0 = 0, f0 = 0;
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const PanelMesh& mesh = meshes[p];
    const int id = static_cast<int>(p), first = static_cast<int>(v0);
    mesh::Panel row;
    row.id = id;
    row.name = panels[p]->name;
    row.piece = panels[p]->piece;
    row.material = panels[p]->material;
    row.mirrored = panels[p]->mirrored;
    row.cell_warp = settings[p].cell_warp;
    row.cell_weft = settings[p].cell_weft;
    row.cut_area = meshes[p].area;
    row.allowance_area = panels[p]->allowance_area;
    garment.panels.push_back(row);
    garment.uv.middleRows(v0, mesh.uv.rows()) = mesh.uv;
    garment.x.middleRows(v0, mesh.uv.rows()).leftCols(2) = mesh.uv.rowwise() + offsets[p].transpose();
    garment.vertex_panel.segment(v0, mesh.uv.rows()).setConstant(id);
    garment.faces.middleRows(f0, mesh.faces.rows()) = mesh.faces.array() + first;
    garment.face_panel.segment(f0, mesh.faces.rows()).setConstant(id);
    for (const GridRun& run : mesh.runs) {
      mesh::Run row_run{static_cast<int>(garment.runs.size()), id, run.name, run.length, run.closed, run.internal, run.allowance};
      for (const auto& [vertex, s] : run.vertices) garment.run_vertices.push_back({row_run.id, first + vertex, s});
      garment.runs.push_back(std::move(row_run));
    }
    for (const GridPoint& point : mesh.points) garment.points.push_back({id, point.name, first + point.vertex});
    v0 += mesh.uv.rows();
    f0 += mesh.faces.rows();
  }
  return garment;
}

}  // namespace toile::tailor
