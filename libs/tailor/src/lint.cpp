#include "toile/tailor/lint.h"

#include <algorithm>
#include <cstdint>

#include "toile/tailor/quality.h"

namespace toile::tailor {
namespace {

std::uint64_t key(int a, int b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) |
         static_cast<std::uint32_t>(std::max(a, b));
}

/// Counts faults of one kind and keeps the place of the first.
struct Count {
  std::size_t number = 0;
  std::string place;
  void add(const std::string& where) {
    if (number++ == 0) place = where;
  }
  void report(Issues& issues, const char* code, const std::string& what, const char* remedy) const {
    if (number > 0)
      issues.push_back({code,
                        {.item = place},
                        fmt::format("{}{}", what, number > 1 ? fmt::format(" (the first of {})", number) : ""),
                        remedy,
                        Category::check});
  }
};

}  // namespace

Lint lint(const mesh::GarmentMesh& g) {
  Lint result;
  const mesh::Ids particle = mesh::particles(g);
  Count turned, degenerate, branching, loose, off_mesh, off_border;
  std::vector<std::uint64_t> keys;
  keys.reserve(static_cast<std::size_t>(g.face_count()) * 3);
  std::vector<char> used(static_cast<std::size_t>(g.vertex_count()), 0);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    const int a = g.faces(f, 0), b = g.faces(f, 1), c = g.faces(f, 2);
    const Eigen::Vector2d p = g.uv.row(b) - g.uv.row(a), q = g.uv.row(c) - g.uv.row(a);
    if (!(p.x() * q.y() - p.y() * q.x() > 0)) turned.add(place_text(g, a));
    if (particle[a] == particle[b] || particle[b] == particle[c] || particle[c] == particle[a])
      degenerate.add(place_text(g, a));
    for (int k = 0; k < 3; ++k) {
      used[static_cast<std::size_t>(g.faces(f, k))] = 1;
      keys.push_back(key(g.faces(f, k), g.faces(f, (k + 1) % 3)));
    }
  }
  std::sort(keys.begin(), keys.end());
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t j = i;
    while (j < keys.size() && keys[j] == keys[i]) ++j;
    if (j - i > 2) branching.add(place_text(g, static_cast<int>(keys[i] >> 32)));
    i = j;
  }
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (!used[static_cast<std::size_t>(v)]) loose.add(place_text(g, static_cast<int>(v)));
  }
  for (std::size_t i = 0; i + 1 < g.run_vertices.size(); ++i) {
    const auto &a = g.run_vertices[i], &b = g.run_vertices[i + 1];
    if (a.run != b.run) continue;
    const mesh::Run& run = g.runs[static_cast<std::size_t>(a.run)];
    const auto range = std::equal_range(keys.begin(), keys.end(), key(a.vertex, b.vertex));
    const auto where = [&] { return fmt::format("{}, edge '{}'", place_text(g, a.vertex), run.name); };
    if (range.first == range.second)
      off_mesh.add(where());
    else if (!run.internal && range.second - range.first != 1)
      off_border.add(where());
  }
  turned.report(result.errors, "turned_face", "a triangle has no area or lies face down in its panel",
                "mesh the panels anew");
  degenerate.report(result.errors, "degenerate_face", "a seam closes a triangle to nothing", "use smaller cells there");
  branching.report(result.errors, "branching_edge", "an edge has more than two triangles of its panel",
                   "mesh the panels anew");
  loose.report(result.errors, "loose_vertex", "a vertex belongs to no triangle", "remove it, or mesh the panels anew");
  off_mesh.report(result.errors, "run_off_mesh", "a named line jumps: two of its vertices have no edge between them",
                  "mesh the panels anew");
  off_border.report(result.errors, "run_off_border", "a named edge lies inside its panel",
                    "mesh the panels anew, or mark it internal");

  const AngleReport angles = angle_report(g);
  if (angles.below_20 > 0 && angles.least_face >= 0) {
    result.warnings.push_back(
        {"sharp_triangles",
         {.item = place_text(g, g.faces(angles.least_face, 0))},
         fmt::format("{} triangles have an angle below 20 degrees, the smallest {:.1f}", angles.below_20, angles.least),
         "use smaller cells, or cells of more equal sides",
         Category::check});
  }
  const auto bare = (g.face_laminate.array() < 0).count();
  if (bare > 0 && bare < g.face_count()) {
    result.warnings.push_back({"partly_layered",
                               {},
                               fmt::format("{} of {} faces have no fabric", bare, g.face_count()),
                               "give a base fabric in toile-layer",
                               Category::check});
  }
  const auto converged = g.marks.find("converged");
  if (converged != g.marks.end() && converged->second == "no")
    result.warnings.push_back({"not_converged",
                               {},
                               "the simulation did not come to rest",
                               "give it more time (toile-simulate)",
                               Category::check});
  const bool simulated =
      std::any_of(g.route.begin(), g.route.end(), [](const auto& entry) { return entry.stage == "toile-simulate"; });
  Count far;
  double farthest = 0;
  for (const auto& weld : g.welds) {
    const double gap = (g.x.row(weld.a) - g.x.row(weld.b)).norm();
    if (!simulated || gap <= 1e-3) continue;
    far.add(place_text(g, weld.a));
    farthest = std::max(farthest, gap);
  }
  far.report(result.warnings, "far_welds",
             fmt::format("the two sides of a seam are apart, up to {:.1f} mm", farthest * 1e3),
             "simulate until the seams are closed");
  return result;
}

}  // namespace toile::tailor
