#include "toile/fabric/card.h"

namespace toile::fabric::detail {

void check_table(const char* key_x, const std::vector<double>& x, const char* key_y, const std::vector<double>& y, Issues& issues) {
  const auto bad = [&](const char* key, std::string what, std::string remedy) { issues.push_back({"bad_table", {.item = key}, std::move(what), std::move(remedy)}); };
  if (x.size() != y.size()) return bad(key_y, fmt::format("{} values of '{}' stand against {} of '{}'", y.size(), key_y, x.size(), key_x), "give both rows the same length");
  if (x.size() < 2) return bad(key_x, "a curve needs at least two points", "begin with 0 and add the measured points");
  if (x.front() != 0) bad(key_x, fmt::format("'{}' does not begin with 0", key_x), "begin both rows with 0");
  if (y.front() != 0) bad(key_y, fmt::format("'{}' does not begin with 0", key_y), "begin both rows with 0");
  for (const auto& [key, row] : {std::pair<const char*, const std::vector<double>&>{key_x, x}, {key_y, y}}) {
    for (std::size_t i = 1; i < row.size(); ++i) {
      if (row[i] > row[i - 1]) continue;
      bad(key, fmt::format("'{}' does not increase at its value number {}", key, i + 1), "leave out points where the curve stands still or falls");
      break;
    }
  }
}

}  // namespace toile::fabric::detail
