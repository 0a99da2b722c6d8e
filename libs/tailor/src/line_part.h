// Rows of vertices along named lines of a garment that is meshed and sewn.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <string>
#include <vector>

namespace toile::tailor {

/// A run, or a stretch of one, in the direction in which a spec uses it.
struct LinePart {
  int run = 0;
  bool whole = true;          ///< all of the run
  std::vector<int> vertices;  ///< in the direction of use, at least two
};

/// Resolves a reference as find_parts() does (line_reference.h), to vertices.
/// error  those of find_parts(), "unknown_line" in place of "unknown_edge", "no_vertex" where a range ends between vertices
Result<std::vector<LinePart>> find_line(const mesh::GarmentMesh& garment, const std::string& text);

/// The same as one row of vertices.
Result<std::vector<int>> find_row(const mesh::GarmentMesh& garment, const std::string& text);

}  // namespace toile::tailor
