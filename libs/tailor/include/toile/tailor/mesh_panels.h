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

/// How a grid cell is cut into two triangles. (In the strip along the border the triangulation is Delaunay.)
enum class Diagonal {
  alternating,  ///< turns from cell to cell: no direction is preferred
  single,       ///< always from lower left to upper right (mirrored panels: lower right to upper left)
  shorter,      ///< the shorter one where the corners were moved; equal ones alternate
};

enum class Mesher {
  grid,      ///< particles on warp and weft lines
  delaunay,  ///< Delaunay refinement: as many particles, no lines
};

struct PanelGrid {
  std::optional<double> cell, cell_warp, cell_weft;  ///< [m]
  std::optional<Diagonal> diagonal;
  std::optional<Mesher> mesher;
  std::optional<double> turn;  ///< [rad]
  std::optional<double> jitter;
  static void describe(auto& f) {
    f(&PanelGrid::cell, {.key = "cell", .doc = "grid size along warp and weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&PanelGrid::diagonal, {.key = "diagonal", .doc = "how a cell is cut into triangles"});
    f(&PanelGrid::mesher, {.key = "mesher", .doc = "grid or delaunay"});
    f(&PanelGrid::turn, {.key = "turn", .doc = "largest turn of border and lines from particle to particle", .unit = "rad", .min = 0.05, .max = 3.2});
    f(&PanelGrid::jitter, {.key = "jitter", .doc = "parts of a cell by which particles are moved at random", .min = 0, .max = 0.3});
  }
};

struct MeshParams {
  double cell = 0.01;
  std::optional<double> cell_warp, cell_weft;
  Diagonal diagonal = Diagonal::alternating;
  Mesher mesher = Mesher::grid;
  double turn = 0.6;
  double jitter = 0;
  double scale = 1;
  std::map<std::string, PanelGrid> panels;
  std::vector<std::string> lines;
  std::vector<std::string> cut;
  std::vector<std::string> leave_out;
  std::vector<pattern::PleatSpec> pleats;
  static void describe(auto& f) {
    f(&MeshParams::cell, {.key = "cell", .doc = "grid size along warp and weft", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::cell_warp, {.key = "cell_warp", .doc = "grid size along the warp, if it differs", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::cell_weft, {.key = "cell_weft", .doc = "grid size along the weft, if it differs", .unit = "m", .min = 1e-4, .max = 0.5});
    f(&MeshParams::diagonal, {.key = "diagonal", .doc = "how a cell is cut into triangles: alternating, single, or the shorter one where corners were moved"});
    f(&MeshParams::mesher, {.key = "mesher", .doc = "grid: particles on warp and weft lines; delaunay: as many without lines, for comparison"});
    f(&MeshParams::turn, {.key = "turn", .doc = "largest turn of border and lines from particle to particle; up to four a cell are set for it", .unit = "rad", .min = 0.05, .max = 3.2});
    f(&MeshParams::jitter, {.key = "jitter", .doc = "moves particles at random by up to so many cells along warp and weft, those of the border along it, corners and named points not: "
                                                    "for tests of what a result owes to its mesh", .min = 0, .max = 0.3});
    f(&MeshParams::scale, {.key = "scale", .doc = "all grid sizes, those of single panels too, times this: one spec for several resolutions", .min = 0.01, .max = 100});
    f(&MeshParams::panels, {.key = "panels", .doc = "settings of single panels, by the name of panel or piece"});
    f(&MeshParams::lines, {.key = "lines", .doc = "internal lines (panel.line) that become edges of the mesh; * stands for any letters"});
    f(&MeshParams::cut, {.key = "cut", .doc = "internal lines that are cut: closed ones out, open ones open (edges line and line_r); * takes those of kind cut and dart"});
    f(&MeshParams::leave_out, {.key = "leave_out", .doc = "panels or pieces that are not cut"});
    f(&MeshParams::pleats, {.key = "pleats", .doc = "pleats that are laid into pieces before they are cut; their folds are hinges of the garment"});
  }
};

/// Flat panels side by side in the plane z = 0, faces +z, each with x = (u, v) + an offset. Every named edge of outline
/// and holes becomes a run, every internal line that is asked for an internal run, every named point, notch and mark a
/// point of the garment. Lines that cross or meet share a particle.
/// panels  as cut_panels() gives them
/// error   "coarse_grid", "fine_grid", "unknown_panel", "unknown_line", "no_panels", "line_along_line", "line_cut_away",
///         "cut_crosses", "cut_crosses_line", "cut_splits_edge", "cut_off", "point_outside", "duplicate_name"
Result<mesh::GarmentMesh> mesh_panels(const std::vector<pattern::CutPanel>& panels, const MeshParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::Diagonal> {
  static constexpr std::array names{std::pair{"alternating", toile::tailor::Diagonal::alternating},
                                    std::pair{"single", toile::tailor::Diagonal::single},
                                    std::pair{"shorter", toile::tailor::Diagonal::shorter}};
};
template <>
struct toile::Choices<toile::tailor::Mesher> {
  static constexpr std::array names{std::pair{"grid", toile::tailor::Mesher::grid}, std::pair{"delaunay", toile::tailor::Mesher::delaunay}};
};
