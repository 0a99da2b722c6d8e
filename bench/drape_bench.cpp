// Case A of the comparison with other simulators: a square metre of shirting falls on a sphere of 0.25 m radius, 1 s.
// drape_bench [--n 118] [--seconds 1] [--threads N] [--step S] [--equilibrium] [--log FILE] [--json]
#include "cases.h"
#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/simulate.h"
#include "toile/io/file.h"
#include "toile/io/record_yaml.h"

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string>

namespace {

using namespace toile;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  int n = 118;
  bool equilibrium = false, json = false;
  std::string log, card_file = "samples/fabrics/shirting.yaml";
  dynamics::SimulationParams params;
  params.duration = 1;
  params.time_step = 1.0 / 60;
  params.friction = 0.3;
  params.support_friction = 0.3;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const auto value = [&] { return i + 1 < argc ? argv[++i] : ""; };
    if (a == "--n") n = std::atoi(value());
    else if (a == "--seconds") params.duration = std::atof(value());
    else if (a == "--threads") set_thread_count(std::atoi(value()));
    else if (a == "--step") params.time_step = std::atof(value());
    else if (a == "--newton") params.newton_iterations = std::atoi(value());
    else if (a == "--newton-accuracy") params.newton_accuracy = std::atof(value());
    else if (a == "--log") log = value();
    else if (a == "--card") card_file = value();
    else if (a == "--equilibrium") equilibrium = true;
    else if (a == "--json") json = true;
    else return std::fprintf(stderr, "drape_bench: unknown option %s\n", a.c_str()), 2;
  }
  const auto text = io::read_file(card_file);
  if (!text) return std::fprintf(stderr, "%s\n", to_string(text.issues().front()).c_str()), 3;
  const auto card = io::read_record<fabric::Card>(*text, card_file);
  if (!card) return std::fprintf(stderr, "%s\n", to_string(card.issues().front()).c_str()), 3;
  mesh::GarmentMesh cloth;
  fixtures::add_fabric(cloth, *card);
  fixtures::add_grid_panel(cloth, "square", n - 1, n - 1, 1, 1, [](double u, double v) { return Eigen::Vector3d(u - 0.5, 0.3, 0.5 - v); });
  const mesh::SupportMesh ball = bench::ball();
  params.mode = equilibrium ? dynamics::Mode::equilibrium : dynamics::Mode::motion;
  if (!log.empty()) params.log = log;

  std::map<std::string, double> spent;
  std::string current = "other";
  // CPU seconds of all threads: they hold on a busy machine too.
  double since = cpu_seconds();
  const auto turn = [&](const char* phase) {
    const double now = cpu_seconds();
    spent[current] += now - since;
    since = now;
    current = phase;
  };
  dynamics::SimulationHooks hooks;
  hooks.phase = turn;
  const auto start = std::chrono::steady_clock::now();
  const double cpu = cpu_seconds();
  const auto outcome = dynamics::simulate(cloth, ball, params, hooks);
  turn("other");
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!outcome) return std::fprintf(stderr, "%s\n", to_string(outcome.issues().front()).c_str()), 1;
  if (!log.empty() && !io::write_file(log, outcome->log).empty()) return 1;
  const dynamics::SimulationReport& r = outcome->report;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  if (json) {
    std::printf("{\"case\": \"A %d\", \"ours_s\": %.3f, \"cpu_s\": %.3f, \"peak_mb\": %.1f, \"iterations\": %d, \"solver_iterations\": %d, \"strain_max\": %.5f, \"strain_99\": %.5f, "
                "\"intersections\": %d, \"support_intersections\": %d, \"inside\": %d}\n",
                n * n, wall, cpu_seconds() - cpu, static_cast<double>(usage.ru_maxrss) / 1024, r.iterations, r.solver_iterations, std::max(r.strain_warp_max, r.strain_weft_max),
                std::max(r.strain_warp_99, r.strain_weft_99), r.intersections, r.support_intersections, r.inside);
    return 0;
  }
  std::printf("%d particles: %.2f s wall, %.2f s CPU, %.0f MB, %d Newton iterations, %d solver iterations, %s, residual %.2e\n", n * n, wall, cpu_seconds() - cpu,
              static_cast<double>(usage.ru_maxrss) / 1024, r.iterations, r.solver_iterations, r.converged ? "converged" : "not converged", r.residual);
  for (const auto& [phase, seconds] : spent) std::printf("  %-8s %.2f s CPU\n", phase.c_str(), seconds);
  std::printf("strain warp %.2f %% (99: %.2f), weft %.2f %% (99: %.2f); intersections %d self, %d support, %d inside; contacts %d, least gap %.3g m\n", 100 * r.strain_warp_max,
              100 * r.strain_warp_99, 100 * r.strain_weft_max, 100 * r.strain_weft_99, r.intersections, r.support_intersections, r.inside, r.contacts, r.least_gap);
  return 0;
}
