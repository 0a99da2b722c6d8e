// Times the placement of the tee on its dress form, from a thousand particles to a hundred thousand.
// usage: placement_bench SOURCE_DIR [REPORT.json]
#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>

#include "report.h"
#include "toile/base/parallel.h"
#include "toile/form/form.h"
#include "toile/io/file.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/record_yaml.h"
#include "toile/placement/place.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/sew.h"

using namespace toile;

namespace {

template <class T>
T checked(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "placement_bench: {}\n", to_string(result.issues().front()));
  std::exit(3);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: placement_bench SOURCE_DIR [REPORT.json]\n");
    return 2;
  }
  const std::string source = argv[1];
  const auto text = [&](const std::string& name) { return checked(io::read_file(source + "/" + name)); };
  const auto measurements = checked(io::read_record<form::Measurements>(text("samples/measurements/man178.yaml"), "man178.yaml"));
  const mesh::SupportMesh form = checked(form::make_form(measurements, checked(io::read_record<form::FormParams>(text("pipelines/tee/form.yaml"), "form.yaml")))).mesh;
  const auto pattern = checked(io::parse_pattern(text("samples/patterns/tee.yaml"), "tee"));
  const auto params = checked(io::read_record<placement::PlaceParams>(text("pipelines/tee/placement.yaml"), "placement.yaml"));
  const auto seams = checked(io::read_record<tailor::SewParams>(text("pipelines/tee/seams.yaml"), "seams.yaml"));

  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  fmt::print("{:>8} {:>9} {:>8} {:>8} {:>14} {:>14} {:>14} {:>9}\n", "grid mm", "vertices", "wall s", "cpu s", "largest strain", "rms strain", "mean gap mm", "findings");
  for (const double cell : {28e-3, 10e-3, 8.8e-3, 5e-3, 2.8e-3}) {
    auto mesh_params = checked(io::read_record<tailor::MeshParams>(text("pipelines/tee/mesh.yaml"), "mesh.yaml"));
    mesh_params.cell = cell;
    const auto garment = checked(tailor::sew(checked(tailor::mesh_panels(checked(pattern::cut_panels(pattern)), mesh_params)), seams)).garment;
    const auto wall = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    const auto placed = checked(placement::place(garment, form, params));
    const double cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
    const auto& report = placed.report;
    rows.push_back({{"case", "place the tee"}, {"cell", cell}, {"vertices", garment.vertex_count()}, {"seconds", wall_s}, {"cpu_s", cpu_s},
                    {"max_edge_strain", report.max_strain}, {"rms_edge_strain", report.rms_strain}, {"mean_seam_gap", report.mean_seam_gap}, {"findings", placed.findings.size()}});
    fmt::print("{:8.1f} {:9} {:8.2f} {:8.2f} {:14.5f} {:14.6f} {:14.2f} {:9}\n", 1e3 * cell, garment.vertex_count(), wall_s, cpu_s, report.max_strain, report.rms_strain, 1e3 * report.mean_seam_gap, placed.findings.size());
  }
  return argc < 3 || bench::add_rows(argv[2], "placement", rows) ? 0 : 1;
}
