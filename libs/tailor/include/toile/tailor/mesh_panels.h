// Cuts pattern panels into particle grids along warp and weft (docs/tailoring.md, "Grids").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/pattern/pattern.h"
#include "toile/pattern/pleat.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace toile::tailor {

/// How a grid cell is cut into two triangles. (The two diagonals of a rectangle are equally long; in the strip along the
/// border the triangulation is Delaunay.)
enum class Diagonal {
  alternating,  ///< turns from cell to cell: no direction is preferred
  single,       ///< always from lower left to upper right (mirrored panels: lower right to upper left)
};

struct PanelGrid {
  std::optional<double> cell, cell_warp, cell_weft;  ///< [m]
  std::optional<Diagonal> diagonal;
  static void describe(auto& f) {
    f(&PanelGrid::cell, {.key = "cell", .doc = "grid size along warp and weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::diagonal, {.key = "diagonal", .doc = "how a cell is cut into triangles"});
  }
};

struct MeshParams {
  double cell = 0.01;
  std::optional<double> cell_warp, cell_weft;
  Diagonal diagonal = Diagonal::alternating;
  std::map<std::string, PanelGrid> panels;
  std::vector<std::string> lines;
  std::vector<std::string> leave_out;
  std::vector<pattern::PleatSpec> pleats;
  static void describe(auto& f) {
    f(&MeshParams::cell, {.key = "cell", .doc = "grid size along warp and weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp, if it differs", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft, if it differs", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::diagonal, {.key = "diagonal", .doc = "how a cell is cut into triangles"});
    f(&MeshParams::panels, {.key = "panels", .doc = "settings of single panels, by the name of panel or piece"});
    f(&MeshParams::lines, {.key = "lines", .doc = "internal lines (panel.line) that become edges of the mesh"});
    f(&MeshParams::leave_out, {.key = "leave_out", .doc = "panels or pieces that are not cut"});
    f(&MeshParams::pleats, {.key = "pleats", .doc = "pleats that are laid into pieces before they are cut; their folds are hinges of the garment"});
  }
};

/// Flat panels side by side in the plane z = 0, faces +z, each with x = (u, v) + an offset. Every named edge of outline
/// and holes becomes a run, every named point, notch and mark a point of the garment.
/// panels  as cut_panels() gives them
/// error   "coarse_grid", "unknown_panel", "unknown_line", "no_panels"
Result<mesh::GarmentMesh> mesh_panels(const std::vector<pattern::CutPanel>& panels, const MeshParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::Diagonal> {
  static constexpr std::array names{std::pair{"alternating", toile::tailor::Diagonal::alternating},
                                    std::pair{"single", toile::tailor::Diagonal::single}};
};
