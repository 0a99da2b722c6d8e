#pragma once

#include <string>
#include <string_view>

namespace toile {

/// 128-bit content hash (XXH3) as 32 hexadecimal digits; the same on every machine. Not cryptographic.
std::string content_hash(std::string_view bytes);

}  // namespace toile
