// What the exporters share. Private to the library.
#pragma once

#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

namespace toile::io {

/// Angle-weighted unit normals, |V| x 3.
mesh::Points3 export_normals(const mesh::Points3& x, const mesh::Triangles& faces);

/// A name that is one word in every format: blanks and control signs become underscores.
std::string one_word(const std::string& name);

}  // namespace toile::io
