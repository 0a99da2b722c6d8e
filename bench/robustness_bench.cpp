// Where simulators go wrong: cloth dropped in folds, pressed between bodies, put on askew. Whole runs of toile-simulate, judged by toile-measure.
// usage: robustness_bench BIN_DIR SOURCE_DIR WORK_DIR REPORT.json [--only TEXT] [--placements N]
// Rows: case, particles, cpu_s, peak_mb, exit, quality figures, start_intersections; of a motion energy_rise, the largest rise of
// kinetic and stored energy from one step to the next over weight times height of fall; of a rest state left_mm, the farthest that a particle goes in
// ten further seconds of motion. The row "tee askew" has how each of its runs ended.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "cases.h"
#include "cloth_fixtures.h"
#include "quality.h"
#include "report.h"
#include "toile/base/text.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

namespace {

using namespace toile;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Case {
  std::string name, simulation;
  mesh::GarmentMesh cloth;
  mesh::SupportMesh support;
  double fall = 0.1;       ///< what rises of energy are compared with [m]
  bool continues = false;  ///< its end is to be a rest state
};

/// Rows of a CSV file by the names of its columns.
std::vector<std::map<std::string, std::string>> read_table(const std::string& file) {
  std::vector<std::map<std::string, std::string>> rows;
  const auto text = io::read_file(file);
  if (!text) return rows;
  std::vector<std::string> names;
  for (const std::string& line : split(*text, '\n')) {
    const std::vector<std::string> cells = split(line, ',');
    if (names.empty()) {
      names = cells;
    } else if (cells.size() == names.size()) {
      rows.emplace_back();
      for (std::size_t i = 0; i < cells.size(); ++i) rows.back()[names[i]] = cells[i];
    }
  }
  return rows;
}

/// A surface between rings of points in a loop, closed by `loop` or by the first and the last point of the profile lying on the axis.
mesh::SupportMesh turned(const std::vector<Eigen::Vector2d>& profile, bool loop, int segments, const Eigen::Vector3d& centre) {
  mesh::SupportMesh s;
  const int n = static_cast<int>(profile.size());
  std::vector<int> first(static_cast<std::size_t>(n));
  std::vector<Eigen::Vector3d> points;
  const auto on_axis = [&](int r) { return profile[static_cast<std::size_t>(r)][0] < 1e-12; };
  for (int r = 0; r < n; ++r) {
    first[static_cast<std::size_t>(r)] = static_cast<int>(points.size());
    const Eigen::Vector2d p = profile[static_cast<std::size_t>(r)];
    for (int k = 0; k < (on_axis(r) ? 1 : segments); ++k) {
      const double phi = 2 * M_PI * k / segments;
      points.push_back(centre + Eigen::Vector3d(p[0] * std::cos(phi), p[1], -p[0] * std::sin(phi)));
    }
  }
  const auto id = [&](int r, int k) { return first[static_cast<std::size_t>(r)] + (on_axis(r) ? 0 : k % segments); };
  std::vector<std::array<int, 3>> faces;
  for (int r = 0; r + (loop ? 0 : 1) < n; ++r) {
    const int q = (r + 1) % n;
    for (int k = 0; k < segments; ++k) {
      if (!on_axis(r)) faces.push_back({id(r, k), id(r, k + 1), id(q, k)});
      if (!on_axis(q)) faces.push_back({id(r, k + 1), id(q, k + 1), id(q, k)});
    }
  }
  s.x.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) s.x.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  s.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) s.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  s.face_region = mesh::Ids::Constant(s.faces.rows(), -1);
  return s;
}

/// A tray: a square cup with walls, four rings about the axis; profile from the axis below round the walls to the axis within.
mesh::SupportMesh box(double inner, double height, double wall) {
  const double r = inner / 2 * std::sqrt(2.0), w = wall * std::sqrt(2.0);
  mesh::SupportMesh s = turned({{0, -wall}, {r + w, -wall}, {r + w, height}, {r, height}, {r, 0}, {0, 0}}, false, 4, Eigen::Vector3d::Zero());
  for (Eigen::Index i = 0; i < s.x.rows(); ++i) {  // corners to the diagonals
    const Eigen::Vector3d p = s.x.row(i);
    s.x.row(i) = (Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitY()) * p).transpose();
  }
  return s;
}

mesh::SupportMesh ring(double diameter, double thickness) {
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i < 16; ++i) {
    const double a = 2 * M_PI * i / 16;
    profile.push_back({diameter / 2 + thickness / 2 * std::cos(a), thickness / 2 * std::sin(a)});
  }
  return turned(profile, true, 48, Eigen::Vector3d::Zero());
}

/// An upright rod with rounded ends.
mesh::SupportMesh rod(double radius, double length, const Eigen::Vector3d& centre) {
  std::vector<Eigen::Vector2d> profile{{0, -length / 2 - radius}};
  for (int i = 1; i <= 6; ++i) profile.push_back({radius * std::sin(M_PI / 12 * i), -length / 2 - radius * std::cos(M_PI / 12 * i)});
  for (int i = 1; i < 20; ++i) profile.push_back({radius, -length / 2 + length * i / 20});
  for (int i = 6; i >= 1; --i) profile.push_back({radius * std::sin(M_PI / 12 * i), length / 2 + radius * std::cos(M_PI / 12 * i)});
  profile.push_back({0, length / 2 + radius});
  return turned(profile, false, 48, centre);
}

mesh::SupportMesh both(mesh::SupportMesh a, const mesh::SupportMesh& b) {
  const Eigen::Index n = a.x.rows(), m = a.faces.rows();
  a.x.conservativeResize(n + b.x.rows(), 3);
  a.x.bottomRows(b.x.rows()) = b.x;
  a.faces.conservativeResize(m + b.faces.rows(), 3);
  a.faces.bottomRows(b.faces.rows()) = (b.faces.array() + static_cast<int>(n)).matrix();
  a.face_region = mesh::Ids::Constant(a.faces.rows(), -1);
  return a;
}

std::vector<Case> folds(const fabric::Card& card) {
  const std::string contact = "friction: 0.3\nsupport_friction: 0.3\n", motion = "mode: motion\n" + contact;
  std::vector<Case> cases;

  Case onto_ring{.name = "square on a ring", .simulation = contact, .support = ring(0.03, 0.006), .continues = true};
  fixtures::add_fabric(onto_ring.cloth, card);
  fixtures::add_grid_panel(onto_ring.cloth, "square", 50, 50, 1, 1, [](double u, double v) { return Eigen::Vector3d(u - 0.5, 0.006, 0.5 - v); });
  cases.push_back(onto_ring);
  onto_ring.name = "square falls on a ring";
  onto_ring.simulation = motion + "duration: 1.5 s\n";
  onto_ring.fall = 0.5;
  onto_ring.continues = false;
  cases.push_back(std::move(onto_ring));

  // Upright, a hand's breadth askew so that it does not fall on its edge like a board.
  Case ribbon{.name = "ribbon into a box", .simulation = motion + "duration: 2 s\nair_drag: 0.5 N*s/m3\n", .support = box(0.2, 0.15, 0.01), .fall = 1.5};
  fixtures::add_fabric(ribbon.cloth, card);
  fixtures::add_grid_panel(ribbon.cloth, "ribbon", 4, 300, 0.04, 3, [](double u, double v) { return Eigen::Vector3d(u - 0.02, 0.02 + 0.99995 * v, 0.01 * std::sin(v)); });
  cases.push_back(std::move(ribbon));

  Case layers{.name = "ten layers on a ball", .simulation = contact, .support = bench::ellipsoid(Eigen::Vector3d::Constant(0.1), Eigen::Vector3d::Zero(), 24, 32), .continues = true};
  fixtures::add_fabric(layers.cloth, card);
  for (int i = 0; i < 10; ++i) {
    fixtures::add_grid_panel(layers.cloth, fmt::format("layer_{}", i), 20, 20, 0.4, 0.4,
                             [&](double u, double v) { return Eigen::Vector3d(u - 0.2, 0.103 + 0.002 * i, 0.2 - v); });
  }
  cases.push_back(std::move(layers));

  // The arm stands 3 mm from the trunk; the sleeve between them has a reach of 2 mm to both.
  constexpr double arm = 0.045, trunk = 0.15, gap = 0.003;
  Case sleeve{.name = "sleeve between arm and body", .simulation = contact + "fixed: [sleeve.top]\n", .support = both(rod(arm, 0.5, {0, 0, 0}), rod(trunk, 0.6, {arm + trunk + gap, 0, 0})),
              .continues = true};
  fixtures::add_fabric(sleeve.cloth, card);
  constexpr double radius = 0.054, centre = arm + gap / 2 - radius;
  const int around = 34;
  const double chord = 2 * around * radius * std::sin(M_PI / around);
  fixtures::add_grid_panel(sleeve.cloth, "sleeve", around, 40, chord, 0.4, [&](double u, double v) {
    const double phi = 2 * M_PI * u / chord;
    return Eigen::Vector3d(centre + radius * std::cos(phi), v - 0.2, -radius * std::sin(phi));
  });
  fixtures::sew(sleeve.cloth, 0, "right", 0, "left", "underarm");
  cases.push_back(std::move(sleeve));
  return cases;
}

struct Runner {
  std::string bin, source;

  struct Ran {
    bench::Usage usage;
    Json summary;
  };
  Ran simulate(const std::string& folder, const std::string& garment, const std::string& support, const std::string& spec, const std::string& result) const {
    fs::remove(result);
    const std::string json = folder + "/summary.json";
    Ran ran;
    ran.usage = bench::timed({bin + "/toile-simulate", garment, "--support", support, "--spec", spec, "-o", result, "--json", "--quiet"}, json);
    if (const auto text = io::read_file(json)) ran.summary = Json::parse(*text, nullptr, false);
    return ran;
  }
};

void write(const std::string& file, const std::string& bytes) {
  if (const Issues issues = io::write_file(file, bytes); !issues.empty()) throw std::runtime_error(to_string(issues.front()));
}

mesh::GarmentMesh read_garment(const std::string& file) {
  auto g = io::read_garment(file);
  if (!g) throw std::runtime_error(to_string(g.issues().front()));
  return std::move(*g);
}

double weight(const mesh::GarmentMesh& g, const fabric::Card& card) {
  double area = 0;
  for (Eigen::Index f = 0; f < g.faces.rows(); ++f) {
    const Eigen::Vector2d a = g.uv.row(g.faces(f, 0)), b = g.uv.row(g.faces(f, 1)), c = g.uv.row(g.faces(f, 2));
    area += std::abs((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x()) / 2;
  }
  return area * card.areal_density * 9.81;
}

/// Steps of a motion whose total energy is above that of the step before: the largest such rise [J].
double largest_rise(const std::string& log) {
  double last = std::numeric_limits<double>::quiet_NaN(), worst = 0;
  for (const auto& row : read_table(log)) {
    const double total = std::strtod(row.at("total_J").c_str(), nullptr);
    if (total - last > worst) worst = total - last;
    last = total;
  }
  return worst;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: robustness_bench BIN_DIR SOURCE_DIR WORK_DIR REPORT.json [--only TEXT] [--placements N]\n");
    return 2;
  }
  const Runner runner{argv[1], argv[2]};
  const std::string work = fs::absolute(argv[3]).string(), report_file = argv[4];
  std::string only;
  int placements = 100;
  for (int i = 5; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--only" && i + 1 < argc) only = argv[++i];
    else if (word == "--placements" && i + 1 < argc) placements = std::atoi(argv[++i]);
    else return fmt::print(stderr, "robustness_bench: unknown option {}\n", word), 2;
  }
  const auto wanted = [&](const std::string& name) { return only.empty() || name.find(only) != std::string::npos; };
  const std::string card_file = runner.source + "/samples/fabrics/shirting.yaml";
  const auto text = io::read_file(card_file);
  const auto card = text ? io::read_record<fabric::Card>(*text, card_file) : Result<fabric::Card>(text.issues());
  if (!card) return fmt::print(stderr, "{}\n", to_string(card.issues().front())), 3;

  Json rows = Json::array();
  int failed = 0;
  try {
    fmt::print("{:<30} {:>9} {:>8} {:>11} {:>6} {:>5} {:>12} {:>9} {:>5}\n", "case", "particles", "cpu s", "strain max", "inside", "cuts", "energy rise", "left mm", "exit");
    for (const Case& c : folds(*card)) {
      if (!wanted(c.name)) continue;
      std::string folder = c.name;
      std::replace(folder.begin(), folder.end(), ' ', '_');
      folder = work + "/" + folder;
      fs::create_directories(folder);
      const std::string start = folder + "/start.ply", support = folder + "/support.ply", spec = folder + "/simulation.yaml", result = folder + "/result.ply", log = folder + "/log.csv";
      write(start, io::format_garment(c.cloth, io::Encoding::binary));
      write(support, io::format_support(c.support, io::Encoding::binary));
      write(spec, c.simulation + "log: " + log + "\n");
      const auto [usage, summary] = runner.simulate(folder, start, support, spec, result);
      Json row{{"case", c.name}, {"particles", c.cloth.x.rows()}, {"cpu_s", usage.cpu}, {"peak_mb", usage.peak_mb}, {"exit", usage.code}};
      const Json q = fs::exists(result) ? bench::quality(runner.bin, result, support, folder) : Json::object();
      row.update(q);
      const bool moves = c.simulation.find("motion") != std::string::npos;
      double rise = -1, left = -1;
      if (moves) row["energy_rise"] = rise = largest_rise(log) / (weight(c.cloth, *card) * c.fall);
      if (c.continues && usage.code == 0) {
        const std::string on = folder + "/continued.yaml", continued = folder + "/continued.ply";
        write(on, "mode: motion\nduration: 10 s\n" + c.simulation);
        if (runner.simulate(folder, result, support, on, continued).usage.code == 0)
          row["left_mm"] = left = 1e3 * (read_garment(continued).x - read_garment(result).x).rowwise().norm().maxCoeff();
      }
      const bool clean = usage.code == 0 && bench::figure(q, "self_intersections") == 0 && bench::figure(q, "penetrating_vertices") == 0 && bench::figure(q, "support_intersections") == 0;
      if (!clean) ++failed;
      fmt::print("{:<30} {:>9} {:>8.1f} {:>9.2f} % {:>6} {:>5} {:>12} {:>9} {:>5}\n", c.name, c.cloth.x.rows(), usage.cpu, 100 * bench::larger(q, "max_strain_warp", "max_strain_weft"),
                 bench::figure(q, "penetrating_vertices"), bench::figure(q, "self_intersections"), rise < 0 ? "" : fmt::format("{:.1e}", rise), left < 0 ? "" : fmt::format("{:.3f}", left), usage.code);
      std::fflush(stdout);
      rows.push_back(std::move(row));
    }

    if (wanted("tee askew")) {
      const std::string folder = work + "/tee", tee = runner.source + "/pipelines/tee", samples = runner.source + "/samples";
      fs::create_directories(folder);
      const auto file = [&](const char* name) { return folder + "/" + name; };
      for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
               {"toile-form", samples + "/measurements/man178.yaml", "--spec", tee + "/form.yaml", "-o", file("form.ply")},
               {"toile-mesh", samples + "/patterns/tee.yaml", samples + "/measurements/man178.yaml", "--spec", tee + "/mesh.yaml", "--cell", "20 mm", "-o", file("panels.ply")},
               {"toile-sew", file("panels.ply"), "--spec", tee + "/seams.yaml", "-o", file("sewn.ply")},
               {"toile-layer", file("sewn.ply"), samples + "/fabrics/shirting.yaml", "--spec", tee + "/layers.yaml", "-o", file("layered.ply")},
               {"toile-place", file("layered.ply"), file("form.ply"), "--spec", tee + "/placement.yaml", "-o", file("placed.ply")}}) {
        std::vector<std::string> command = words;
        command[0] = runner.bin + "/" + command[0];
        command.push_back("--quiet");
        if (bench::timed(command).code != 0) throw std::runtime_error("robustness_bench: " + words[0] + " failed on the tee");
      }
      const mesh::GarmentMesh placed = read_garment(file("placed.ply"));
      const Eigen::Vector3d middle = placed.x.colwise().mean().transpose();
      std::uint64_t state = 1;
      const auto random = [&] {  // -1 to 1
        state = state * 6364136223846793005ULL + 1442695040888963407ULL;
        return static_cast<double>(state >> 11) / 4503599627370496.0 - 1;
      };
      const auto direction = [&] {
        Eigen::Vector3d d;
        do d = {random(), random(), random()};
        while (d.squaredNorm() > 1 || d.squaredNorm() < 1e-6);
        return Eigen::Vector3d(d.normalized());
      };
      Json runs = Json::array();
      int clean = 0, said = 0, cutting = 0, cutting_clean = 0;
      double cpu = 0;
      for (int i = 0; i < placements; ++i) {
        const double angle = 10 * M_PI / 180 * std::abs(random()), shift = 0.02 * std::abs(random());
        const Eigen::AngleAxisd turn(angle, direction());
        const Eigen::Vector3d move = shift * direction();
        mesh::GarmentMesh g = placed;
        for (Eigen::Index v = 0; v < g.x.rows(); ++v) {
          const Eigen::Vector3d p = g.x.row(v);
          g.x.row(v) = (middle + move + turn * (p - middle)).transpose();
        }
        write(file("askew.ply"), io::format_garment(g, io::Encoding::binary));
        const auto [usage, summary] = runner.simulate(folder, file("askew.ply"), file("form.ply"), tee + "/simulation.yaml", file("draped.ply"));
        const bool there = fs::exists(file("draped.ply"));
        const Json q = there ? bench::quality(runner.bin, file("draped.ply"), file("form.ply"), folder) : Json::object();
        Json run{{"turn_deg", angle * 180 / M_PI}, {"shift_mm", 1e3 * shift}, {"cpu_s", usage.cpu}, {"exit", usage.code}};
        run.update(q);
        const bool good = there && bench::figure(q, "self_intersections") == 0 && bench::figure(q, "penetrating_vertices") == 0 && bench::figure(q, "support_intersections") == 0;
        bool starts_cutting = false;
        if (summary.is_object()) {
          if (const auto found = summary.find("summary"); found != summary.end() && found->is_object()) {
            for (const char* key : {"start_intersections", "start_inside"}) {
              if (found->contains(key)) {
                run[key] = (*found)[key];
                const Json& value = (*found)[key].is_object() ? (*found)[key].value("value", Json(0)) : (*found)[key];
                starts_cutting |= value.is_number() && value.get<double>() > 0;
              }
            }
          }
          if (const auto found = summary.find("findings"); found != summary.end() && !found->empty()) run["findings"] = *found;
        }
        if (starts_cutting) ++cutting;
        if (good && usage.code == 0) ++clean, cutting_clean += starts_cutting;
        else if (usage.code == 4 || usage.code == 5) ++said;
        cpu += usage.cpu;
        runs.push_back(std::move(run));
      }
      fmt::print("tee askew: {} runs ({} start cutting), {} end clean at rest ({} of those cutting), {} end with a finding, {} otherwise; {:.0f} CPU s\n", placements, cutting, clean, cutting_clean, said,
                 placements - clean - said, cpu);
      if (clean < placements) ++failed;
      rows.push_back({{"case", "tee askew"}, {"particles", placed.x.rows()}, {"cpu_s", cpu}, {"runs", runs}, {"clean", clean}, {"finding", said}});
    }
  } catch (const std::exception& e) {
    return fmt::print(stderr, "{}\n", e.what()), 1;
  }
  if (!bench::add_rows(report_file, "robustness", rows)) return 1;
  fmt::print("report: {}\n", report_file);
  return failed == 0 ? 0 : 4;
}
