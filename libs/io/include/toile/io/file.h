// Whole files in and out.
#pragma once

#include "toile/base/result.h"

#include <string>
#include <string_view>

namespace toile::io {

/// error  Issue "cannot_read" with the system's reason
Result<std::string> read_file(const std::string& path);

/// Writes beside the target, flushes to disk and renames: afterwards there is either the old file or the whole new one.
/// error  Issue "cannot_write" with the system's reason; nothing is left behind
Issues write_file(const std::string& path, std::string_view bytes);

}  // namespace toile::io
