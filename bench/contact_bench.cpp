// Contact search on a square metre of cloth draped over a sphere of 0.25 m radius (1,482 vertices).
// contact_bench [--json] [--threads N] [--n 118] [--seconds 0.8]
#include "contact_drape.h"
#include "toile/base/parallel.h"
#include "toile/contact/exact.h"
#include "toile/contact/support_field.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace toile;

struct Row {
  std::string name;
  double wall_ms, cpu_ms;
  std::string note;
};

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Median wall time and CPU time (all threads) of a call.
Row timed(const std::string& name, int repeats, const std::function<std::string()>& call) {
  std::vector<double> wall, cpu;
  std::string note;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const double c = cpu_seconds();
    note = call();
    wall.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    cpu.push_back(1e3 * (cpu_seconds() - c));
  }
  std::sort(wall.begin(), wall.end());
  std::sort(cpu.begin(), cpu.end());
  return {name, wall[wall.size() / 2], cpu[cpu.size() / 2], note};
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  int n = 118;
  double seconds = 0.8;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--json") json = true;
    if (a == "--threads" && i + 1 < argc) set_thread_count(std::atoi(argv[++i]));
    if (a == "--n" && i + 1 < argc) n = std::atoi(argv[++i]);
    if (a == "--seconds" && i + 1 < argc) seconds = std::atof(argv[++i]);
  }
  const test::Shape cloth = test::sheet(n, n, 1, 1, [](double u, double v) { return Eigen::Vector3d(u - 0.5, v - 0.5, 0.255); });
  const test::Shape sphere = test::ellipsoid(Eigen::Vector3d(0.25, 0.25, 0.25), Eigen::Vector3d::Zero(), 38, 39);
  test::Drape drape(cloth, sphere);
  const int steps = static_cast<int>(seconds / drape.step);
  long limited = 0, rounds = 0, fallback = 0;
  double kept = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int s = 0; s < steps; ++s) {
    drape.advance();
    limited += drape.last.limited_pairs, rounds += drape.last.rounds, fallback += drape.last.fallback_pairs;
    double sum = 0;
    for (const double f : drape.last.fraction) sum += f;
    kept += sum / static_cast<double>(drape.last.fraction.size()) / steps;
    if (!json && s % 20 == 0) {
      std::fprintf(stderr, "step %d limited nodes %d pairs %d rounds %d fallback %d least %.3f\n", s, drape.last.limited_nodes, drape.last.limited_pairs,
                   drape.last.rounds, drape.last.fallback_pairs, drape.last.least_fraction);
    }
  }
  const double drape_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  drape.aim();
  const contact::Surface& surface = drape.surface;
  const contact::Surface& support = drape.search.support();
  const mesh::Points3 &x = drape.x, &target = drape.target, &sx = drape.support_x;
  const double radius = 2 * drape.thickness;
  contact::SupportField field(support, sx);
  std::vector<contact::SurfacePoint> at;
  std::vector<int> warm;
  std::vector<Row> rows;
  rows.push_back(timed("proximity, self and support, at 2x thickness", 21, [&] {
    const auto c = drape.search.proximity(x, sx, {radius, radius});
    return std::to_string(c.self.size()) + " self, " + std::to_string(c.support.size()) + " support";
  }));
  rows.push_back(timed("proximity, self only", 21, [&] { return std::to_string(drape.search.proximity(x, sx, {radius, 0}).self.size()); }));
  rows.push_back(timed("proximity, support only", 21, [&] { return std::to_string(drape.search.proximity(x, sx, {0, radius}).support.size()); }));
  rows.push_back(timed("limit of a 5 ms step", 21, [&] {
    const auto& l = drape.search.limit_step(x, target, sx, sx);
    return std::to_string(l.limited_pairs) + " pairs, " + std::to_string(l.limited_nodes) + " nodes, " + std::to_string(l.rounds) + " rounds";
  }));
  rows.push_back(timed("limit of a step back to where it is", 21, [&] { return std::to_string(drape.search.limit_step(x, x, sx, sx).limited_pairs); }));
  rows.push_back(timed("step fraction", 21, [&] { return std::to_string(drape.search.step_fraction(x, target, sx, sx)); }));
  rows.push_back(timed("exact self-intersections", 5, [&] { return std::to_string(contact::self_intersections(surface, x).size()); }));
  rows.push_back(timed("exact support intersections", 5, [&] { return std::to_string(contact::support_intersections(surface, x, support, sx).size()); }));
  rows.push_back(timed("signed distance of every vertex, warm", 11, [&] {
    field.nearest(x, 0.02, at, warm);
    return std::string();
  }));
  rows.push_back(timed("penetrations by winding number", 5, [&] { return std::to_string(field.penetrations(x, surface.vertices).size()); }));

  if (json) {
    std::printf("{\"particles\": %d, \"faces\": %d, \"threads\": %d, \"drape_s\": %.3f, \"kept\": %.5f, \"rows\": [", surface.node_count,
                static_cast<int>(surface.faces.rows()), thread_count(), drape_s, kept);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::printf("%s{\"case\": \"%s\", \"ours_ms\": %.3f, \"cpu_ms\": %.3f, \"note\": \"%s\"}", i ? ", " : "", rows[i].name.c_str(), rows[i].wall_ms,
                  rows[i].cpu_ms, rows[i].note.c_str());
    }
    std::printf("]}\n");
  } else {
    std::printf("%d particles, %d faces, %d threads; %d steps in %.2f s, mean fraction kept %.5f, impacts %ld, rounds %ld, fallback %ld\n",
                surface.node_count, static_cast<int>(surface.faces.rows()), thread_count(), steps, drape_s, kept, limited, rounds, fallback);
    for (const Row& r : rows) std::printf("%-48s %8.2f ms wall %8.2f ms cpu   %s\n", r.name.c_str(), r.wall_ms, r.cpu_ms, r.note.c_str());
  }
  return 0;
}
