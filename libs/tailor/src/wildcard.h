// Names with * for any letters.
#pragma once

#include <string_view>

namespace toile::tailor {

inline bool has_wildcard(std::string_view pattern) { return pattern.find('*') != std::string_view::npos; }

/// Whether the whole name fits; `*` stands for any letters, none included.
inline bool fits(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace toile::tailor
