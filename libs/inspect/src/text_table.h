// Columns of text for people.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace toile::inspect {

enum class Alignment {
  numbers,     ///< the first column to the left, the others to the right
  by_content,  ///< columns that hold words to the left, too
};

/// Columns as wide as their widest cell, under a row of headings.
inline std::string text_table(const std::vector<std::vector<std::string>>& rows, Alignment alignment = Alignment::numbers) {
  std::vector<std::size_t> width;
  std::vector<char> left;
  for (const auto& row : rows) {
    width.resize(std::max(width.size(), row.size()), 0);
    left.resize(width.size(), 0);
    for (std::size_t k = 0; k < row.size(); ++k) {
      width[k] = std::max(width[k], row[k].size());
      const bool number = row[k].empty() || row[k].front() == '-' || (row[k].front() >= '0' && row[k].front() <= '9');
      if (k == 0 || (alignment == Alignment::by_content && !number && &row != &rows.front())) left[k] = 1;
    }
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) line += left[k] ? fmt::format("  {:<{}}", row[k], width[k]) : fmt::format("  {:>{}}", row[k], width[k]);
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + '\n';
  }
  return out;
}

}  // namespace toile::inspect
