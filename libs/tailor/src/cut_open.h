// Slits: a panel's mesh opened along internal lines.
#pragma once

#include "panel_grid.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// The mesh with the named internal runs cut open: their vertices are doubled (an end inside the cloth stays one), the
/// run becomes an edge `name`, with the cloth on the left of the drawn line, and an edge `name_r` with the cloth on its right; both
/// run with the cloth on their left like every edge. Named points on the cut get a twin `point_r` on the other side.
/// panel  name for messages
/// error  (category check) "cut_splits_edge", "cut_crosses_line" where another run would be torn, "cut_off" where a
///        piece falls off; "duplicate_name"
Result<PanelMesh> cut_open(const PanelMesh& mesh, const std::vector<std::string>& runs, const std::string& panel);

}  // namespace toile::tailor
