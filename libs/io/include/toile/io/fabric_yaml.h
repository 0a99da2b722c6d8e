// Fabric files: docs/fabric.md.
#pragma once

#include "toile/fabric/measured.h"

#include <string>
#include <string_view>

namespace toile::io {

/// A fabric file as the card that later stages use.
/// error  as read_record, with file, line and column
Result<fabric::Card> read_fabric(std::string_view yaml, const std::string& file);

}  // namespace toile::io
