// Garment and support files: PLY with named columns (docs/garment-file.md).
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <span>
#include <string>
#include <string_view>

namespace toile::io {

enum class Encoding { ascii, binary };

/// Both encodings are recognised. The result is validated.
/// error  Issue with the file, and line where the header is at fault: "cannot_read", "bad_ply", "invalid_mesh", …
Result<mesh::GarmentMesh> read_garment(const std::string& path);
Result<mesh::GarmentMesh> parse_garment(std::string_view bytes, const std::string& name);
/// The bytes of the file; the same garment gives the same bytes everywhere.
/// Precondition: validate(garment) finds nothing.
std::string format_garment(const mesh::GarmentMesh& garment, Encoding encoding);

Result<mesh::SupportMesh> read_support(const std::string& path);
Result<mesh::SupportMesh> parse_support(std::string_view bytes, const std::string& name);
std::string format_support(const mesh::SupportMesh& support, Encoding encoding);

/// A registered column of the garment file.
struct ColumnInfo {
  const char* element;
  const char* name;
  const char* type;       ///< double or int
  const char* unit;
  const char* meaning;
  double tolerance;       ///< absolute, for toile-diff; 0: exact
};
/// The registry (docs/garment-file.md is generated from it).
std::span<const ColumnInfo> column_registry();

}  // namespace toile::io
