// CSV tables that programs write, as tests read them.
#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

namespace toile::test {

/// Numbers of the column with that name, a row each; a failure where there is none.
inline std::vector<double> column(const std::string& csv, const std::string& name) {
  std::istringstream in(csv);
  std::string line, cell;
  std::getline(in, line);
  std::istringstream head(line);
  int wanted = -1;
  for (int i = 0; std::getline(head, cell, ','); ++i) {
    if (cell == name) wanted = i;
  }
  EXPECT_GE(wanted, 0) << name;
  std::vector<double> values;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    for (int i = 0; i <= wanted; ++i) std::getline(row, cell, ',');
    values.push_back(std::stod(cell));
  }
  return values;
}

}  // namespace toile::test
