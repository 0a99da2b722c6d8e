// toile-simulate as a whole process on the cases in which simulators are compared, and Blender's cloth on the same meshes in the same
// run where it is installed. What the cases are: bench/README.md.
// usage: simulation_bench BIN_DIR SOURCE_DIR WORK_DIR REPORT.json [--only TEXT] [--no-blender]
// Rows: case, particles, ours_s, cpu_s, peak_mb, exit, quality figures by toile-measure; peer, peer_s, peer_peak_mb, ratio = ours_s / peer_s.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cases.h"
#include "cloth_fixtures.h"
#include "process.h"
#include "quality.h"
#include "report.h"
#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

namespace {

using namespace toile;
using bench::figure;
using bench::larger;
using bench::quality;
using bench::Usage;
namespace fs = std::filesystem;

/// Settings of Blender's cloth for a case; the two presets are named after what they were chosen for.
struct BlenderPreset {
  const char* name;
  int quality, collision_quality;
  double distance, outer, self_distance;  ///< [m]
};

struct Case {
  std::string name;
  std::string simulation;  ///< spec of toile-simulate
  mesh::GarmentMesh cloth;
  mesh::SupportMesh support;
  int particles = 0;
  std::vector<BlenderPreset> peers;
  bool swings = false;  ///< case B: the right edge goes down about the middle line
};

/// The right edge in case B: 40 degrees down in a second, slowly at both ends.
double swing(double t) { return 40 * M_PI / 180 * (3 * t * t - 2 * t * t * t); }

Case square_on_ball(int n, const fabric::Card& card, const std::string& name, const std::string& spec) {
  Case c{.name = name, .simulation = spec, .support = bench::ball(), .particles = n * n};
  fixtures::add_fabric(c.cloth, card);
  fixtures::add_grid_panel(c.cloth, "square", n - 1, n - 1, 1, 1, [](double u, double v) { return Eigen::Vector3d(u - 0.5, 0.3, 0.5 - v); });
  return c;
}

Case soft_top(const fabric::Card& card) {
  Case c{.name = "B", .support = bench::obstacle(), .particles = 51 * 51, .swings = true};
  std::string times, turns;
  for (int i = 0; i <= 50; ++i) {
    const double t = i / 50.0;
    times += fmt::format("{}{} s", i ? ", " : "", t);
    turns += fmt::format("{}{} rad", i ? ", " : "", -swing(t));
  }
  c.simulation = fmt::format(
      "mode: motion\nduration: 1 s\nnewton_accuracy: 10 mm\nfriction: 0.3\nsupport_friction: 0.3\nconstraints:\n"
      "  - {{name: header, on: [top.left], kind: pin}}\n"
      "  - {{name: bow, on: [top.right], kind: drive, times: [{}], turn: [{}], axis: [0, 0, 1], centre: [650 mm, 0 m, 0 m]}}\n",
      times, turns);
  fixtures::add_fabric(c.cloth, card);
  fixtures::add_grid_panel(c.cloth, "top", 50, 50, 1.3, 1.2, [](double u, double v) { return Eigen::Vector3d(u, 0, 0.6 - v); });
  return c;
}

template <class Faces>
void write_obj(const std::string& file, const mesh::Points3& x, const Faces& faces) {
  std::string text;
  for (Eigen::Index i = 0; i < x.rows(); ++i) text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", x(i, 0), x(i, 1), x(i, 2));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) text += fmt::format("f {} {} {}\n", faces(f, 0) + 1, faces(f, 1) + 1, faces(f, 2) + 1);
  if (const Issues issues = io::write_file(file, text); !issues.empty()) throw std::runtime_error(to_string(issues.front()));
}

mesh::Points3 read_obj_points(const std::string& file) {
  std::vector<Eigen::Vector3d> points;
  const auto text = io::read_file(file);
  if (!text) throw std::runtime_error(to_string(text.issues().front()));
  for (const std::string& line : split(*text, '\n')) {
    Eigen::Vector3d p;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &p[0], &p[1], &p[2]) == 3) points.push_back(p);
  }
  mesh::Points3 x(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return x;
}

std::optional<std::string> blender() {
  const char* path = std::getenv("PATH");
  for (const std::string& folder : split(path ? path : "", ':')) {
    const std::string program = folder + "/blender";
    if (!folder.empty() && ::access(program.c_str(), X_OK) == 0) return program;
  }
  return std::nullopt;
}

struct Peer {
  double seconds = 0, peak_mb = 0;
  std::string version;
  nlohmann::ordered_json quality;
};

std::optional<Peer> run_blender(const std::string& program, const std::string& source, const std::string& bin, const Case& c, const BlenderPreset& preset, const std::string& folder) {
  const std::string cloth = folder + "/cloth.obj", support = folder + "/support.obj", out = folder + "/blender.obj", log = folder + "/blender.log", job = folder + "/job.json";
  write_obj(cloth, c.cloth.x, c.cloth.faces);
  write_obj(support, c.support.x, c.support.faces);
  std::vector<int> held, moved;
  if (c.swings) {
    for (Eigen::Index v = 0; v < c.cloth.uv.rows(); ++v) {
      if (c.cloth.uv(v, 0) < 1e-9) held.push_back(static_cast<int>(v));
      if (c.cloth.uv(v, 0) > 1.3 - 1e-9) moved.push_back(static_cast<int>(v));
    }
  }
  nlohmann::ordered_json angles = nlohmann::ordered_json::array();
  // Blender's solver makes one frame 1/31.6 s of gravity whatever the rate is set to, so that 32 frames are a second.
  constexpr int frames = 32;
  for (int i = 0; i <= frames; ++i) angles.push_back(swing(static_cast<double>(i) / frames));
  const nlohmann::ordered_json settings{{"cloth", cloth}, {"support", support}, {"out", out}, {"frames", frames}, {"quality", preset.quality}, {"collision_quality", preset.collision_quality},
                                        {"distance", preset.distance}, {"outer", preset.outer}, {"self_distance", preset.self_distance}, {"vertex_mass", 0.3}, {"friction", 30.0},
                                        {"held", held}, {"moved", moved}, {"hinge", {0.65, 0.0, 0.0}}, {"angles", angles}};
  fs::remove(out);
  if (!io::write_file(job, settings.dump() + "\n").empty()) return std::nullopt;
  const Usage usage = bench::timed({program, "-b", "--factory-startup", "--python", source + "/bench/blender_cloth.py", "--", job}, log);
  if (usage.code != 0 || !fs::exists(out)) {
    fmt::print(stderr, "simulation_bench: Blender gave no result on {} (exit {}), see {}\n", c.name, usage.code, log);
    return std::nullopt;
  }
  Peer peer{.peak_mb = usage.peak_mb};
  for (const std::string& line : split(*io::read_file(log), '\n')) {
    if (line.rfind("TOILE ", 0) != 0) continue;
    const auto result = nlohmann::json::parse(line.substr(6), nullptr, false);
    if (!result.is_object()) continue;
    peer.seconds = result.value("seconds", 0.0);
    peer.version = result.value("version", "");
  }
  if (!(peer.seconds > 0)) return std::nullopt;
  mesh::GarmentMesh garment = c.cloth;
  garment.x = read_obj_points(out);
  if (garment.x.rows() != c.cloth.x.rows()) return std::nullopt;
  const std::string file = folder + "/blender.ply";
  if (!io::write_file(file, io::format_garment(garment, io::Encoding::binary)).empty()) return std::nullopt;
  peer.quality = quality(bin, file, folder + "/support.ply", folder);
  return peer;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: simulation_bench BIN_DIR SOURCE_DIR WORK_DIR REPORT.json [--only TEXT] [--no-blender]\n");
    return 2;
  }
  const std::string bin = argv[1], source = argv[2], work = fs::absolute(argv[3]).string(), report_file = argv[4];
  std::string only;
  bool peers = true;
  for (int i = 5; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--no-blender") peers = false;
    else if (word == "--only" && i + 1 < argc) only = argv[++i];
    else return fmt::print(stderr, "simulation_bench: unknown option {}\n", word), 2;
  }
  const std::string card_file = source + "/samples/fabrics/shirting.yaml";
  const auto text = io::read_file(card_file);
  const auto card = text ? io::read_record<fabric::Card>(*text, card_file) : Result<fabric::Card>(text.issues());
  if (!card) return fmt::print(stderr, "{}\n", to_string(card.issues().front())), 3;

  const std::string falling = "mode: motion\nduration: 1 s\nnewton_accuracy: 10 mm\nfriction: 0.3\nsupport_friction: 0.3\n", resting = "friction: 0.3\nsupport_friction: 0.3\n";
  const BlenderPreset quality_a{"Q", 10, 5, 0.008, 0.004, 0.002}, coarse_a{"Q", 10, 5, 0.008, 0.004, 0.004};
  std::vector<Case> cases;
  const auto wanted = [&](const std::string& name) { return only.empty() || name.find(only) != std::string::npos; };
  const auto falls = [&](int n, const std::string& name, std::vector<BlenderPreset> presets) {
    if (!wanted(name)) return;
    cases.push_back(square_on_ball(n, *card, name, falling));
    cases.back().peers = std::move(presets);
  };
  falls(50, "A 2500", {coarse_a});
  falls(118, "A 13924", {quality_a});
  falls(236, "A 55696", {});
  falls(472, "A 222784", {});
  if (wanted("A 13924 rest")) cases.push_back(square_on_ball(118, *card, "A 13924 rest", resting));
  if (wanted("B")) {
    cases.push_back(soft_top(*card));
    cases.back().peers = {coarse_a};
  }

  const auto program = peers ? blender() : std::nullopt;
  if (peers && !program) fmt::print("Blender is not installed (apt-get install blender python3-numpy): no peer is timed\n");
  fmt::print("{:<14} {:>9} {:>9} {:>9} {:>8} {:>11} {:>9} {:>6} {:>7} {:>5}\n", "case", "particles", "wall s", "cpu s", "MB", "strain max", "99 %", "inside", "cuts", "exit");
  const auto line = [](const std::string& name, int particles, double wall, double cpu, double peak, const nlohmann::ordered_json& q, int code) {
    fmt::print("{:<14} {:>9} {:>9.2f} {:>9} {:>8.0f} {:>9.2f} % {:>7.2f} % {:>6} {:>7} {:>5}\n", name, particles, wall, cpu < 0 ? "" : fmt::format("{:.2f}", cpu), peak,
               100 * larger(q, "max_strain_warp", "max_strain_weft"), 100 * larger(q, "p99_strain_warp", "p99_strain_weft"), figure(q, "penetrating_vertices"), figure(q, "self_intersections"), code);
    std::fflush(stdout);
  };
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  int failed = 0;
  for (const Case& c : cases) {
    std::string folder_name = c.name;
    std::replace(folder_name.begin(), folder_name.end(), ' ', '_');
    const std::string folder = work + "/" + folder_name;
    fs::create_directories(folder);
    const std::string garment = folder + "/start.ply", support = folder + "/support.ply", spec = folder + "/simulation.yaml", result = folder + "/result.ply";
    for (const Issues& issues : {io::write_file(garment, io::format_garment(c.cloth, io::Encoding::binary)), io::write_file(support, io::format_support(c.support, io::Encoding::binary)),
                                 io::write_file(spec, c.simulation)}) {
      if (!issues.empty()) return fmt::print(stderr, "{}\n", to_string(issues.front())), 3;
    }
    fs::remove(result);
    const Usage usage = bench::timed({bin + "/toile-simulate", garment, "--support", support, "--spec", spec, "-o", result, "--quiet"});
    nlohmann::ordered_json row{{"case", c.name}, {"particles", c.particles}, {"ours_s", usage.wall}, {"cpu_s", usage.cpu}, {"peak_mb", usage.peak_mb}, {"exit", usage.code}};
    const auto ours = quality(bin, result, support, folder);
    row.update(ours);
    line(c.name, c.particles, usage.wall, usage.cpu, usage.peak_mb, ours, usage.code);
    if (usage.code != 0) ++failed;
    rows.push_back(row);
    if (!program) continue;
    for (const BlenderPreset& preset : c.peers) {
      const auto peer = run_blender(*program, source, bin, c, preset, folder);
      if (!peer) continue;
      row["peer"] = fmt::format("Blender {} {}", peer->version, preset.name);
      row["peer_s"] = peer->seconds;
      row["peer_peak_mb"] = peer->peak_mb;
      row["peer_quality"] = peer->quality;
      row["ratio"] = usage.wall / peer->seconds;
      line("  " + row["peer"].get<std::string>(), c.particles, peer->seconds, -1, peer->peak_mb, peer->quality, 0);
      fmt::print("  ratio ours / peer {:.3f}\n", usage.wall / peer->seconds);
      rows.back() = row;
    }
  }
  if (!bench::add_rows(report_file, "simulation", rows)) return 1;
  fmt::print("report: {}\n", report_file);
  return failed == 0 ? 0 : 4;
}
