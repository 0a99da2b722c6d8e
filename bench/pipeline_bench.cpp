// Times the programs of a pipeline as whole processes, and reading and writing of a large garment.
// usage: pipeline_bench BIN_DIR PIPELINE.yaml BUILD_DIR REPORT.json
// Rows: case, seconds (wall), cpu_s, peak_mb; the sum over the pipeline's stages last.
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "garments.h"
#include "process.h"
#include "report.h"
#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"

using namespace toile;
namespace fs = std::filesystem;
using namespace toile::bench;

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "usage: pipeline_bench BIN_DIR PIPELINE.yaml BUILD_DIR REPORT.json\n");
    return 2;
  }
  const std::string bin = argv[1], pipeline = argv[2], build = argv[3], report_file = argv[4];
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const auto add = [&](const std::string& name, const Usage& usage) {
    rows.push_back({{"case", name}, {"seconds", usage.wall}, {"cpu_s", usage.cpu}, {"peak_mb", usage.peak_mb}, {"exit", usage.code}});
    fmt::print("{:<32} {:8.2f} s wall {:8.2f} s cpu {:8.0f} MB{}\n", name, usage.wall, usage.cpu, usage.peak_mb, usage.code == 0 ? "" : fmt::format("  exit {}", usage.code));
  };

  // Each stage of the pipeline in the order in which make runs it, by the command that the plan wrote.
  if (timed({bin + "/toile", "plan", pipeline, "--build", build}).code != 0) {
    fmt::print(stderr, "pipeline_bench: {} cannot be planned\n", pipeline);
    return 3;
  }
  std::map<std::string, std::vector<std::string>> commands;  // output -> command
  fs::path folder;
  for (const auto& entry : fs::recursive_directory_iterator(build)) {
    if (entry.path().extension() != ".command") continue;
    folder = entry.path().parent_path();
    std::vector<std::string> words;
    for (const std::string& word : split(*io::read_file(entry.path()), '\n')) words.push_back(word);
    words.pop_back();
    commands[words.back()] = words;
  }
  Usage total{0};
  std::set<std::string> done;
  while (done.size() < commands.size()) {
    const std::size_t before = done.size();
    for (const auto& [output, words] : commands) {
      const bool ready = std::all_of(words.begin(), words.end() - 1, [&](const std::string& word) { return !commands.count(word) || done.count(word); });
      if (done.count(output) || !ready) continue;
      const Usage usage = timed(words);
      add(fs::path(pipeline).parent_path().filename().string() + "/" + fs::path(output).stem().string(), usage);
      total = {std::max(total.code, usage.code), total.wall + usage.wall, total.cpu + usage.cpu, std::max(total.peak_mb, usage.peak_mb)};
      done.insert(output);
    }
    if (done.size() == before) break;
  }
  add(fs::path(pipeline).parent_path().filename().string() + " (all stages)", total);

  // A garment of a million triangles, binary.
  const mesh::GarmentMesh garment = test::two_panels(500);
  const std::string file = (fs::path(build) / "million.ply").string();
  const auto write_start = Clock::now();
  if (!io::write_file(file, io::format_garment(garment, io::Encoding::binary)).empty()) return 1;
  const double write_s = seconds_since(write_start);
  const auto read_start = Clock::now();
  const auto back = io::read_garment(file);
  const double read_s = seconds_since(read_start);
  if (!back) return 1;
  rows.push_back({{"case", "write a garment"}, {"triangles", garment.face_count()}, {"seconds", write_s}});
  rows.push_back({{"case", "read a garment"}, {"triangles", garment.face_count()}, {"seconds", read_s}});
  fmt::print("{} triangles, binary: written in {:.2f} s, read and validated in {:.2f} s\n", garment.face_count(), write_s, read_s);
  fs::remove(file);
  if (!add_rows(report_file, "pipeline", rows)) return 1;
  fmt::print("report: {}\n", report_file);
  return total.code;
}
