#include "toile/tailor/quality.h"

#include "local_mesh.h"

#include "toile/mesh/topology.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>

namespace toile::tailor {
namespace {

/// Key of an undirected edge.
std::uint64_t key(int a, int b) { return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) | static_cast<std::uint32_t>(std::max(a, b)); }

std::vector<std::uint64_t> sorted_edges(const mesh::Triangles& faces) {
  std::vector<std::uint64_t> keys;
  keys.reserve(static_cast<std::size_t>(faces.rows()) * 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) keys.push_back(key(faces(f, k), faces(f, (k + 1) % 3)));
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace

namespace {

/// Reports of the faces, grouped: group 0 to groups - 1.
template <class GroupOf>
std::vector<AngleReport> grouped_reports(const mesh::GarmentMesh& garment, std::size_t groups, const GroupOf& group_of) {
  const std::vector<std::uint64_t> keys = sorted_edges(garment.faces);
  std::vector<std::uint64_t> lines;  // edges along internal lines
  for (std::size_t i = 0; i + 1 < garment.run_vertices.size(); ++i) {
    const auto &a = garment.run_vertices[i], &b = garment.run_vertices[i + 1];
    if (a.run == b.run && garment.runs[static_cast<std::size_t>(a.run)].internal) lines.push_back(key(a.vertex, b.vertex));
  }
  std::sort(lines.begin(), lines.end());
  const auto on_line = [&](int a, int b) {
    if (std::binary_search(lines.begin(), lines.end(), key(a, b))) return true;
    const auto range = std::equal_range(keys.begin(), keys.end(), key(a, b));
    return range.second - range.first == 1;
  };
  std::vector<AngleReport> reports(groups);
  std::vector<std::vector<double>> all(groups);
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    const std::array<int, 3> v{garment.faces(f, 0), garment.faces(f, 1), garment.faces(f, 2)};
    const auto corner = angles(garment.uv.row(v[0]), garment.uv.row(v[1]), garment.uv.row(v[2]));
    double least = 180;
    for (int k = 0; k < 3; ++k) {
      if (corner[k] >= least) continue;
      if (corner[k] < 40 && on_line(v[k], v[(k + 1) % 3]) && on_line(v[k], v[(k + 2) % 3])) continue;
      least = corner[k];
    }
    AngleReport& report = reports[group_of(f)];
    all[group_of(f)].push_back(least);
    if (least < report.least) report.least = least, report.least_face = static_cast<int>(f);
    report.below_20 += least < 20;
    ++report.histogram[static_cast<std::size_t>(std::clamp(static_cast<int>(least / 5), 0, 11))];
  }
  for (std::size_t g = 0; g < groups; ++g) {
    if (all[g].empty()) continue;
    std::sort(all[g].begin(), all[g].end());
    reports[g].percent_1 = all[g][all[g].size() / 100];
    reports[g].median = all[g][all[g].size() / 2];
  }
  return reports;
}

}  // namespace

AngleReport angle_report(const mesh::GarmentMesh& garment) {
  return grouped_reports(garment, 1, [](Eigen::Index) { return std::size_t{0}; }).front();
}

std::vector<AngleReport> panel_angle_reports(const mesh::GarmentMesh& garment) {
  return grouped_reports(garment, garment.panels.size(), [&](Eigen::Index f) { return static_cast<std::size_t>(garment.face_panel[f]); });
}

SurfaceReport surface_report(const mesh::GarmentMesh& garment) {
  SurfaceReport report;
  const mesh::Ids particle = mesh::particles(garment);
  report.particles = particle.size() == 0 ? 0 : particle.maxCoeff() + 1;
  const mesh::Triangles faces = mesh::mapped(garment.faces, particle);
  report.components = mesh::component_count(faces);
  const std::vector<std::uint64_t> keys = sorted_edges(faces);
  std::size_t edges = 0;
  std::vector<char> used(static_cast<std::size_t>(report.particles), 0);
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t j = i;
    while (j < keys.size() && keys[j] == keys[i]) ++j;
    ++edges;
    report.branching_edges += j - i > 2;
    i = j;
  }
  for (Eigen::Index i = 0; i < faces.size(); ++i) used[faces.data()[i]] = 1;
  report.euler = static_cast<int>(std::count(used.begin(), used.end(), 1)) - static_cast<int>(edges) + static_cast<int>(faces.rows());
  // Border edges, walked with the surface on the left; against that only where faces that are sewn together look different ways.
  struct Side {
    int other;
    double length;
    std::size_t edge;
  };
  struct Ways {
    std::vector<Side> forward, backward;
  };
  std::map<int, Ways> ways;
  std::size_t border_edges = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      const auto range = std::equal_range(keys.begin(), keys.end(), key(a, b));
      if (range.second - range.first != 1) continue;
      const double length = (garment.uv.row(garment.faces(f, k)) - garment.uv.row(garment.faces(f, (k + 1) % 3))).norm();
      ways[a].forward.push_back({b, length, border_edges});
      ways[b].backward.push_back({a, length, border_edges++});
    }
  }
  for (auto& [particle_id, sides] : ways) {
    for (auto* list : {&sides.forward, &sides.backward}) std::sort(list->begin(), list->end(), [](const Side& p, const Side& q) { return p.other < q.other; });
  }
  std::vector<char> walked(border_edges, 0);
  const auto next = [&](Ways& sides) -> const Side* {
    for (auto* list : {&sides.forward, &sides.backward}) {
      for (auto side = list->rbegin(); side != list->rend(); ++side) {
        if (!walked[side->edge]) return &*side;
      }
    }
    return nullptr;
  };
  for (auto& [start, sides] : ways) {
    while (next(sides) != nullptr) {
      int current = start;
      double length = 0;
      do {
        const Side* side = next(ways.at(current));
        if (side == nullptr) break;
        walked[side->edge] = 1;
        length += side->length;
        current = side->other;
      } while (current != start);
      report.opening_lengths.push_back(length);
    }
  }
  std::sort(report.opening_lengths.rbegin(), report.opening_lengths.rend());
  report.openings = static_cast<int>(report.opening_lengths.size());
  return report;
}

std::string place_text(const mesh::GarmentMesh& garment, int vertex) {
  const std::string& name = garment.panels[static_cast<std::size_t>(garment.vertex_panel[vertex])].name;
  return fmt::format("{} at ({:.1f}, {:.1f}) cm", name, garment.uv(vertex, 0) * 100, garment.uv(vertex, 1) * 100);
}

}  // namespace toile::tailor
