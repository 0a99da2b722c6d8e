// What one Newton iteration costs in either model: energy with forces, the same with the second derivative, the preconditioner, a linear solve.
// usage: mechanics_bench SOURCE_DIR REPORT.json [--n 118] [--repeat 10]
// Rows: model, mesh, particles, gradient_ms, hessian_ms, factor_ms, solve_ms, solve_iterations: processor milliseconds on one thread.
#include "cloth_fixtures.h"
#include "report.h"
#include "toile/base/parallel.h"
#include "toile/dynamics/linear_solver.h"
#include "toile/io/record_yaml.h"
#include "toile/mechanics/particle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

namespace {

using namespace toile;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// The least of several: the rest is what other programs took from the cache.
template <class Work>
double least_ms(int repeat, const Work& work) {
  double least = 1e300;
  for (int i = 0; i < repeat; ++i) {
    const double start = cpu_ms();
    work();
    least = std::min(least, cpu_ms() - start);
  }
  return least;
}

template <class Model, class Response>
nlohmann::ordered_json measure(const Model& model, const mesh::GarmentMesh& cloth, const char* name, const char* mesh_name, int repeat) {
  Response response;
  const mesh::Points3 none(0, 3);
  const double gradient = least_ms(repeat, [&] { evaluate(model, cloth.x, none, std::nullopt, response); });
  const double hessian = least_ms(repeat, [&] { evaluate(model, cloth.x, none, mechanics::Curvature::positive, response); });
  // A step of 1/60 s of motion: masses over its square.
  const double step = 1.0 / 60;
  const auto rows = static_cast<std::size_t>(response.matrix.rows());
  std::vector<mechanics::Float4> b(rows), x(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const double inertia = model.mass[static_cast<Eigen::Index>(i)] / (step * step);
    mechanics::Block& d = response.matrix.value[static_cast<std::size_t>(response.matrix.diagonal[i])];
    for (int c = 0; c < 3; ++c) d.column[c][c] += static_cast<float>(inertia);
    const Eigen::RowVector3d force = -response.gradient.row(static_cast<Eigen::Index>(i)) - Eigen::RowVector3d(0, 9.81 * model.mass[static_cast<Eigen::Index>(i)], 0);
    for (int c = 0; c < 3; ++c) b[i][c] = static_cast<float>(force[c]);
  }
  const std::vector<char> fixed(rows, 0);
  dynamics::LinearSolver solver;
  const double factor = least_ms(repeat, [&] { solver.factor(response.matrix, {}, cloth.x, fixed); });
  dynamics::SolveReport report;
  const double solve = least_ms(repeat, [&] { report = solver.solve(response.matrix, {}, b, x, {.tolerance = 0.02}); });
  fmt::print("{:<9} {:<12} {:>7} {:>12.2f} {:>12.2f} {:>12.2f} {:>12.2f} {:>6}\n", name, mesh_name, rows, gradient, hessian, factor, solve, report.iterations);
  return {{"model", name}, {"mesh", mesh_name}, {"particles", rows}, {"gradient_ms", gradient}, {"hessian_ms", hessian}, {"factor_ms", factor}, {"solve_ms", solve}, {"solve_iterations", report.iterations}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return fmt::print(stderr, "usage: mechanics_bench SOURCE_DIR REPORT.json [--n 118] [--repeat 10]\n"), 2;
  int n = 118, repeat = 10;
  for (int i = 3; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    if (word == "--n") n = std::max(3, std::atoi(argv[i + 1]));
    else if (word == "--repeat") repeat = std::max(1, std::atoi(argv[i + 1]));
    else return fmt::print(stderr, "mechanics_bench: unknown option {}\n", word), 2;
  }
  set_thread_count(1);
  const std::string card_file = std::string(argv[1]) + "/samples/fabrics/shirting.yaml";
  const auto text = io::read_file(card_file);
  const auto card = text ? io::read_record<fabric::Card>(*text, card_file) : Result<fabric::Card>(text.issues());
  if (!card) return fmt::print(stderr, "{}\n", to_string(card.issues().front())), 3;
  fmt::print("{:<9} {:<12} {:>7} {:>12} {:>12} {:>12} {:>12} {:>6}   CPU ms, one thread\n", "model", "mesh", "nodes", "forces", "+ Hessian", "factor", "solve", "its");
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  // A square metre in waves, stretched and sheared by up to a per cent.
  const auto waves = [](double u, double v) { return Eigen::Vector3d(1.005 * u + 0.01 * v, 0.02 * std::sin(12 * u) * std::cos(9 * v), -v + 0.003 * std::sin(7 * u)); };
  for (const fixtures::Net kind : {fixtures::Net::alternating, fixtures::Net::delaunay}) {
    const mesh::GarmentMesh cloth = fixtures::net(kind, n - 1, n - 1, 1, 1, *card, waves);
    const char* mesh_name = kind == fixtures::Net::alternating ? "grid" : "Delaunay";
    const auto sheet = mechanics::make_sheet(cloth, mesh::particles(cloth), {});
    const auto particle = mechanics::make_particle(cloth, mesh::particles(cloth), {});
    if (!sheet || !particle) return fmt::print(stderr, "{}\n", to_string(sheet ? particle.issues().front() : sheet.issues().front())), 1;
    rows.push_back(measure<mechanics::Sheet, mechanics::SheetResponse>(*sheet, cloth, "woven", mesh_name, repeat));
    rows.push_back(measure<mechanics::ParticleModel, mechanics::ParticleResponse>(*particle, cloth, "particle", mesh_name, repeat));
  }
  if (!bench::add_rows(argv[2], "mechanics", rows)) return 1;
  fmt::print("report: {}\n", argv[2]);
  return 0;
}
