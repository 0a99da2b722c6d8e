// The panels of a garment on the table: plane triangulations whose border vertices are put in and moved.
#pragma once

#include "local_mesh.h"
#include "run_curve.h"
#include "seam_plan.h"

#include "toile/mesh/garment_mesh.h"

#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace toile::tailor {

/// The garment while it is being sewn. Positions are in cells of each panel; panels that are turned over lie
/// as their plain twins.
class SewingTable {
 public:
  explicit SewingTable(const mesh::GarmentMesh& garment);

  /// What the plan needs to know of each run.
  std::vector<PlanRun> plan_runs() const;

  /// Puts in and moves vertices as planned and sets the triangles around right. Afterwards rows() has the runs as they are.
  void carry_out(const std::vector<std::vector<PlanSlot>>& rows);

  /// The tip of a dart whose legs have little cloth between them: its triangles are cut until there are three, so that closing
  /// the dart lays none on another.
  void open_tip(int vertex);

  /// Where several panels are sewn along two sides of a corner, a triangle whose corners are all on the seams would lie on one
  /// of another panel: it is cut by a vertex inside the panel. So is one that a fold lays on its neighbour, in a seam that
  /// holds a pleat.
  /// welds  pairs of vertices that are the same particle
  void part_plies(const std::vector<std::array<int, 2>>& welds);

  /// A vertex of a triangle that has turned over, if any.
  std::optional<int> turned_over() const;

  int panel(int vertex) const { return panel_[static_cast<std::size_t>(vertex)]; }
  const std::vector<std::vector<std::pair<double, int>>>& rows() const { return rows_; }

  /// The garment with its new vertices. Old vertices keep their order in each panel, new ones come after them; untouched ones
  /// keep their coordinates to the last bit. Seams and welds are left to the caller.
  /// offsets  of each panel from (u, v) to its place on the table
  /// ret      garment, and the new id of each vertex of this table
  std::pair<mesh::GarmentMesh, std::vector<int>> result(const std::vector<Eigen::Vector3d>& offsets) const;

 private:
  struct Way {
    int run, vertex;
    double from, to;  ///< arc length
  };
  Point in_cells(int vertex, const Point& uv) const;
  Point in_metres(int vertex) const;
  double grain(int run) const;
  bool turned(int panel) const { return garment_.panels[static_cast<std::size_t>(panel)].mirrored; }
  std::vector<std::size_t> order_of_runs() const;
  void slide(const std::vector<Way>& ways);
  void name_new_vertices();

  const mesh::GarmentMesh& garment_;
  LocalMesh mesh_;
  std::vector<int> panel_;
  std::vector<char> held_;
  std::vector<std::vector<std::pair<double, int>>> rows_;  ///< arc length and vertex, per run
  std::vector<RunCurve> curves_;
};

}  // namespace toile::tailor
