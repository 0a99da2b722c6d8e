// Rows of several benchmarks in one report.
#pragma once

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "toile/io/file.h"

namespace toile::bench {

/// Puts rows into {"rows": [...]}, each marked with the benchmark's name; rows that it had there before go, others stay.
/// ret  false, with a message, where the file cannot be written
inline bool add_rows(const std::string& file, const std::string& benchmark, const nlohmann::ordered_json& rows) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  if (std::filesystem::exists(file)) {
    if (const auto text = io::read_file(file)) {
      const auto old = nlohmann::ordered_json::parse(*text, nullptr, false);
      if (old.is_object() && old.contains("rows")) {
        for (const auto& row : old["rows"]) {
          if (row.value("benchmark", "") != benchmark) all.push_back(row);
        }
      }
    }
  }
  for (const auto& row : rows) {
    nlohmann::ordered_json marked{{"benchmark", benchmark}};
    marked.update(row);
    all.push_back(std::move(marked));
  }
  std::error_code ignored;  // the message below says what is wrong
  std::filesystem::create_directories(std::filesystem::absolute(file).parent_path(), ignored);
  const Issues issues = io::write_file(file, nlohmann::ordered_json{{"rows", all}}.dump(2) + "\n");
  if (!issues.empty()) std::fprintf(stderr, "%s\n", to_string(issues.front()).c_str());
  return issues.empty();
}

}  // namespace toile::bench
