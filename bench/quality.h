// What toile-measure says of a garment that a benchmark has made.
#pragma once

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "process.h"
#include "toile/io/file.h"

namespace toile::bench {

/// Strains, cuts and penetration of a result, by the program that measures garments.
inline nlohmann::ordered_json quality(const std::string& bin, const std::string& garment, const std::string& support, const std::string& work) {
  const std::string file = work + "/quality.json";
  std::filesystem::remove(file);
  timed({bin + "/toile-measure", garment, "--support", support, "-o", file, "--quiet"});
  nlohmann::ordered_json row = nlohmann::ordered_json::object();
  if (!std::filesystem::exists(file)) return row;
  const auto measured = nlohmann::ordered_json::parse(*io::read_file(file), nullptr, false);
  for (const char* key : {"max_strain_warp", "max_strain_weft", "p99_strain_warp", "p99_strain_weft", "max_strain_bias", "self_intersections", "support_intersections", "penetrating_vertices"}) {
    if (measured.contains(key)) row[key] = measured[key];
  }
  return row;
}

inline int figure(const nlohmann::ordered_json& q, const char* key) { return q.contains(key) && q[key].is_number() ? q[key].get<int>() : -1; }
inline double larger(const nlohmann::ordered_json& q, const char* a, const char* b) { return q.contains(a) && q.contains(b) ? std::max(q[a].get<double>(), q[b].get<double>()) : -1; }

}  // namespace toile::bench
