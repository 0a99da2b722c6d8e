// Cuts, sews and layers the panels of a garment at about 10^4, 10^5 and 10^6 triangles, refines it and looks it over,
// each program as a process of its own: time, how it grows, and memory per triangle. usage: tailoring_bench BIN_DIR
// SOURCE_DIR WORK_DIR REPORT.json [LARGEST]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "process.h"
#include "report.h"
#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"

using namespace toile;
using namespace toile::bench;
namespace fs = std::filesystem;

namespace {

struct Garment {
  std::string name, folder;
  std::string specs;  ///< mesh.yaml, seams.yaml and layers.yaml with this before their names
  std::vector<std::string> fabrics;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5 && argc != 6) {
    fmt::print(stderr, "usage: tailoring_bench BIN_DIR SOURCE_DIR WORK_DIR REPORT.json [LARGEST]\n");
    return 2;
  }
  const std::string bin = argv[1], source = argv[2], work = argv[3], report_file = argv[4];
  const double largest = argc == 6 ? std::atof(argv[5]) : 1e6;
  fs::create_directories(work);
  const std::vector<Garment> garments{
      {"tee", "tee", "", {"shirting"}},
      {"jacket", "jacket", "lined_", {"suiting", "lining", "hair_canvas", "collar_canvas"}},
  };
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  int code = 0;
  fmt::print("{:<8} {:<16} {:>10} {:>8} {:>8} {:>9} {:>12} {:>7}\n", "garment", "program", "triangles", "wall s",
             "cpu s", "peak MB", "B/triangle", "growth");
  for (const Garment& garment : garments) {
    const std::string specs = source + "/pipelines/" + garment.folder + "/" + garment.specs;
    const auto file = [&](const std::string& stage, int size) {
      return fmt::format("{}/{}_{}_{}.ply", work, garment.name, stage, size);
    };
    const auto mesh = [&](double scale, const std::string& out) {
      return timed({bin + "/toile-mesh", source + "/samples/patterns/" + garment.folder + ".yaml", "--spec",
                    specs + "mesh.yaml", "--scale", fmt::format("{}", scale), "-o", out, "--quiet"});
    };
    // The scale that gives the wanted number: triangles go with its inverse square, nearly.
    double scale = 1;
    std::map<std::string, std::pair<double, double>> before;  // program -> triangles, cpu
    int size = 0;
    for (double wanted = 1e4; wanted < 1.5 * largest; wanted *= 10, ++size) {
      const std::string panels = file("panels", size), sewn = file("sewn", size), layered = file("layered", size);
      for (int trial = 0; trial < (size == 0 ? 2 : 1); ++trial) {
        if (mesh(scale, panels).code != 0) return 1;
        scale *= std::sqrt(static_cast<double>(io::read_garment(panels)->face_count()) / wanted);
      }
      std::vector<std::string> layer{
          bin + "/toile-layer", sewn, "--spec", specs + "layers.yaml", "-o", layered, "--quiet", "--fabrics"};
      for (const std::string& fabric : garment.fabrics)
        layer.push_back(source + "/samples/fabrics/" + fabric + ".yaml");
      std::vector<std::pair<std::string, Usage>> runs;
      runs.emplace_back("toile-mesh", mesh(scale, panels));
      runs.emplace_back("toile-sew",
                        timed({bin + "/toile-sew", panels, "--spec", specs + "seams.yaml", "-o", sewn, "--quiet"}));
      runs.emplace_back("toile-layer", timed(layer));
      runs.emplace_back("toile-lint", timed({bin + "/toile-lint", layered}));
      if (size > 0)
        runs.emplace_back("toile-refine", timed({bin + "/toile-refine", layered, file("layered", size - 1), "-o",
                                                 file("refined", size), "--quiet"}));
      const auto read = io::read_garment(layered);
      if (!read) {
        fmt::print(stderr, "{}\n", to_string(read.issues().front()));
        return 1;
      }
      const auto triangles = static_cast<double>(read->face_count());
      for (const auto& [program, usage] : runs) {
        nlohmann::ordered_json row{{"garment", garment.name}, {"program", program}, {"triangles", triangles},
                                   {"seconds", usage.wall},   {"cpu_s", usage.cpu}, {"peak_mb", usage.peak_mb},
                                   {"exit", usage.code}};
        std::string growth;
        if (const auto it = before.find(program); it != before.end()) {
          const double exponent = std::log(usage.cpu / it->second.second) / std::log(triangles / it->second.first);
          row["growth"] = exponent;
          growth = fmt::format("{:.2f}", exponent);
        }
        before[program] = {triangles, usage.cpu};
        fmt::print("{:<8} {:<16} {:10.0f} {:8.2f} {:8.2f} {:9.0f} {:12.0f} {:>7}{}\n", garment.name, program, triangles,
                   usage.wall, usage.cpu, usage.peak_mb, usage.peak_mb * 1048576 / triangles, growth,
                   usage.code == 0 ? "" : fmt::format("  exit {}", usage.code));
        if (usage.code != 0) code = 1;
        rows.push_back(std::move(row));
      }
    }
  }
  if (!add_rows(report_file, "tailoring", rows)) return 1;
  fmt::print("report: {}\n", report_file);
  return code;
}
