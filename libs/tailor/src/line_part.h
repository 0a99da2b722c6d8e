// Named lines of a garment, as specs refer to them.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// A run, or a stretch of one, in the direction in which a spec uses it.
struct LinePart {
  int run = 0;
  bool reversed = false;
  bool whole = true;          ///< all of the run
  std::vector<int> vertices;  ///< in the direction of use, at least two
};

/// Resolves "panel.line" or "-panel.line"; a range "panel.line(from..to)" goes from one named point on the line to another.
/// error  "bad_reference", "unknown_panel", "unknown_line", "unknown_point", "bad_range"
Result<LinePart> find_line(const mesh::GarmentMesh& garment, const std::string& text);

}  // namespace toile::tailor
