#include "sewing_table.h"

#include "toile/base/result.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace toile::tailor {
namespace {

double weft(const mesh::Panel& panel) { return panel.cell_weft > 0 ? panel.cell_weft : 0.01; }
/// Panels that are turned over are worked on as their plain twins, so that both get the same triangles to the last bit.
double side(const mesh::Panel& panel) { return panel.mirrored ? -1 : 1; }
double warp(const mesh::Panel& panel) { return panel.cell_warp > 0 ? panel.cell_warp : 0.01; }

int faces_at(const LocalMesh& mesh, int a, int b) {
  int count = 0;
  for (int t : mesh.stars[a]) {
    const Triple& v = mesh.triangles[t];
    count += v[0] == b || v[1] == b || v[2] == b;
  }
  return count;
}

/// An edge with cloth on both sides that is no line of the pattern.
bool is_plain_inner(const LocalMesh& mesh, int a, int b) { return faces_at(mesh, a, b) == 2 && !mesh.constraints.count({std::min(a, b), std::max(a, b)}); }

LocalVertex middle(const LocalMesh& mesh, int a, int b) {
  LocalVertex vertex;
  vertex.p = 0.5 * (mesh.vertices[a].p + mesh.vertices[b].p);
  return vertex;
}

/// +1 where a row of vertices has the cloth on its left, -1 on its right, 0 on both sides.
int sense_of(const LocalMesh& mesh, int a, int b) {
  int left = 0, right = 0;
  for (int t : mesh.stars[a]) {
    const Triple& v = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      left += v[k] == a && v[(k + 1) % 3] == b;
      right += v[k] == b && v[(k + 1) % 3] == a;
    }
  }
  return left > 0 && right > 0 ? 0 : left - right;
}

}  // namespace

SewingTable::SewingTable(const mesh::GarmentMesh& garment) : garment_(garment), held_(static_cast<std::size_t>(garment.vertex_count()), 0) {
  const auto count = static_cast<std::size_t>(garment.vertex_count());
  mesh_.vertices.resize(count);
  panel_.assign(garment.vertex_panel.data(), garment.vertex_panel.data() + garment.vertex_panel.size());
  for (std::size_t v = 0; v < count; ++v) mesh_.vertices[v].p = in_cells(static_cast<int>(v), garment.uv.row(static_cast<Eigen::Index>(v)));
  mesh_.triangles.resize(static_cast<std::size_t>(garment.face_count()));
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    Triple& t = mesh_.triangles[static_cast<std::size_t>(f)];
    t = {garment.faces(f, 0), garment.faces(f, 1), garment.faces(f, 2)};
    if (turned(garment.face_panel[f])) std::swap(t[1], t[2]);
  }
  build_stars(mesh_);
  rows_.resize(garment.runs.size());
  for (const auto& row : garment.run_vertices) rows_[static_cast<std::size_t>(row.run)].emplace_back(row.s, row.vertex);
  std::vector<char> uses(count, 0);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const auto& row = rows_[r];
    std::vector<double> s;
    std::vector<Point> p;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const int v = row[k].second;
      mesh_.vertices[v].mobility = Mobility::fixed;
      uses[v] = static_cast<char>(std::min(2, uses[v] + 1));
      if (uses[v] > 1 || k == 0 || k + 1 == row.size()) held_[v] = 1;
      if (garment.runs[r].internal && k > 0) mesh_.constraints.emplace(std::min(v, row[k - 1].second), std::max(v, row[k - 1].second));
      s.push_back(row[k].first);
      p.push_back(garment.uv.row(v));
    }
    if (row.size() < 2) {
      curves_.emplace_back();
      continue;
    }
    curves_.emplace_back(s, p);
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (curves_.back().corner(k)) held_[row[k].second] = 1;
    }
  }
  // A point that is only named may slide along its edge by part of a cell; one that a seam's spec names may not.
  for (const auto& point : garment.points) mesh_.vertices[point.vertex].mobility = Mobility::fixed;
  // Border vertices that belong to no run (there should be none) stay too.
  for (const Triple& t : mesh_.triangles) {
    for (int k = 0; k < 3; ++k) {
      LocalVertex& vertex = mesh_.vertices[t[k]];
      if (vertex.mobility == Mobility::free && mesh_.stars[t[k]].size() < 4 && faces_at(mesh_, t[k], t[(k + 1) % 3]) == 1) vertex.mobility = Mobility::fixed;
    }
  }
}

Point SewingTable::in_cells(int vertex, const Point& uv) const {
  const auto& panel = garment_.panels[static_cast<std::size_t>(panel_[vertex])];
  return {side(panel) * uv.x() / weft(panel), uv.y() / warp(panel)};
}

Point SewingTable::in_metres(int vertex) const {
  const auto& panel = garment_.panels[static_cast<std::size_t>(panel_[vertex])];
  const Point& p = mesh_.vertices[vertex].p;
  return {side(panel) * p.x() * weft(panel), p.y() * warp(panel)};
}

double SewingTable::grain(int run) const {
  const auto& panel = garment_.panels[static_cast<std::size_t>(garment_.runs[run].panel)];
  return std::sqrt(weft(panel) * warp(panel));
}

std::vector<PlanRun> SewingTable::plan_runs() const {
  std::vector<PlanRun> runs(rows_.size());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (const auto& [s, v] : rows_[r]) runs[r].row.push_back({s, v, held_[v] != 0});
    runs[r].cell = grain(static_cast<int>(r));
    if (!garment_.runs[r].internal && rows_[r].size() > 1) runs[r].sense = (turned(garment_.runs[r].panel) ? -1 : 1) * sense_of(mesh_, rows_[r][0].second, rows_[r][1].second);
  }
  return runs;
}

/// Runs in the order in which they are worked on: those of panels that are turned over backwards, as their twins' edges lie.
std::vector<std::size_t> SewingTable::order_of_runs() const {
  std::vector<std::size_t> order(garment_.runs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return garment_.runs[a].panel < garment_.runs[b].panel; });
  for (auto from = order.begin(); from != order.end();) {
    const int panel = garment_.runs[*from].panel;
    const auto to = std::find_if(from, order.end(), [&](std::size_t r) { return garment_.runs[r].panel != panel || garment_.runs[r].internal; });
    if (turned(panel)) std::reverse(from, to);
    from = std::find_if(to, order.end(), [&](std::size_t r) { return garment_.runs[r].panel != panel; });
  }
  return order;
}

void SewingTable::carry_out(const std::vector<std::vector<PlanSlot>>& rows) {
  std::vector<Way> ways;
  for (const std::size_t r : order_of_runs()) {
    if (r >= rows.size() || rows[r].empty()) continue;
    const auto& planned = rows[r];
    const bool backwards = turned(garment_.runs[r].panel) && !garment_.runs[r].internal;
    std::vector<std::pair<double, int>> row;
    // Those that are put in lie between the nearest old ones, as far as the plan says.
    const auto old_beside = [&](std::size_t k, int step) {
      while (planned[k].vertex < 0) k = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + step);
      return k;
    };
    for (std::size_t i = 0; i < planned.size(); ++i) {
      const std::size_t k = backwards ? planned.size() - 1 - i : i;
      const PlanSlot& slot = planned[k];
      int id = slot.vertex;
      if (id < 0) {
        const PlanSlot &u = planned[old_beside(k, backwards ? 1 : -1)], &w = planned[old_beside(k, backwards ? -1 : 1)];
        const double share = (slot.s_before - u.s_before) / (w.s_before - u.s_before);
        LocalVertex vertex;
        vertex.p = (1 - share) * mesh_.vertices[u.vertex].p + share * mesh_.vertices[w.vertex].p;
        vertex.mobility = Mobility::fixed;
        id = split_edge(mesh_, row.back().second, w.vertex, vertex);
        panel_.push_back(panel_[w.vertex]);
      }
      row.emplace_back(slot.s, id);
      if (slot.vertex < 0 || slot.s != slot.s_before) ways.push_back({static_cast<int>(r), id, slot.s_before, slot.s});
    }
    if (backwards) std::reverse(row.begin(), row.end());
    rows_[r] = std::move(row);
  }
  slide(ways);
}

/// In steps of at most a quarter of a cell, setting the triangles right after each.
void SewingTable::slide(const std::vector<Way>& ways) {
  if (ways.empty()) return;
  int steps = 1;
  for (const Way& way : ways) steps = std::max(steps, static_cast<int>(std::ceil(4 * std::abs(way.to - way.from) / grain(way.run))));
  ImproveOptions options;
  options.may_split_border = false;
  for (const Way& way : ways) options.around.push_back(way.vertex);
  for (int step = 1; step <= steps; ++step) {
    for (const Way& way : ways) {
      const double s = step == steps ? way.to : way.from + (way.to - way.from) * step / steps;
      mesh_.vertices[way.vertex].p = in_cells(way.vertex, curves_[way.run].at(s));
    }
    options.target = step == steps ? 20 : 10;
    options.may_insert = options.may_remove = step == steps;
    improve(mesh_, options);
  }
  name_new_vertices();
}

/// Vertices that were put in belong to the panel of those around them.
void SewingTable::name_new_vertices() {
  std::vector<int> waiting;
  for (std::size_t v = panel_.size(); v < mesh_.vertices.size(); ++v) waiting.push_back(static_cast<int>(v));
  panel_.resize(mesh_.vertices.size(), -1);
  while (!waiting.empty()) {
    std::vector<int> later;
    for (int v : waiting) {
      for (int t : mesh_.stars[v]) {
        for (int w : mesh_.triangles[t]) panel_[v] = std::max(panel_[v], panel_[w]);
      }
      if (panel_[v] < 0 && !mesh_.stars[v].empty()) later.push_back(v);
    }
    TOILE_CHECK(later.size() < waiting.size(), "{} vertices belong to no panel", later.size());
    waiting = std::move(later);
  }
}

void SewingTable::open_tip(int vertex) {
  while (mesh_.stars[vertex].size() < 3) {
    int p = -1, q = -1;
    double widest = 0;
    for (int t : mesh_.stars[vertex]) {
      Triple v = mesh_.triangles[t];
      std::rotate(v.begin(), std::find(v.begin(), v.end(), vertex), v.end());
      const double angle = angles(mesh_.vertices[v[0]].p, mesh_.vertices[v[1]].p, mesh_.vertices[v[2]].p)[0];
      if (angle > widest && is_plain_inner(mesh_, v[1], v[2])) widest = angle, p = v[1], q = v[2];
    }
    if (p < 0) return;
    split_edge(mesh_, p, q, middle(mesh_, p, q));
    name_new_vertices();
  }
}

void SewingTable::part_plies(const std::vector<std::array<int, 2>>& welds) {
  // Particles of sewn vertices; others stand for themselves.
  std::map<int, int> root;
  const auto find = [&](int v) {
    int r = v;
    while (root.at(r) != r) r = root.at(r);
    while (root.at(v) != r) v = std::exchange(root.at(v), r);
    return r;
  };
  for (const auto& [a, b] : welds) {
    root.emplace(a, a);
    root.emplace(b, b);
    const int p = find(a), q = find(b);
    root.at(std::max(p, q)) = std::min(p, q);
  }
  const auto on_inner_line = [&](const Triple& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh_.constraints.count(std::minmax(t[k], t[(k + 1) % 3]))) return true;
    }
    return false;
  };
  std::map<Triple, int> seen;
  std::vector<int> doubled;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    Triple key = mesh_.triangles[t];
    if (key[0] < 0 || std::count_if(key.begin(), key.end(), [&](int v) { return root.count(v) > 0; }) < 2) continue;
    for (int& v : key) v = root.count(v) > 0 ? find(v) : v;
    std::sort(key.begin(), key.end());
    const auto [twin, fresh] = seen.emplace(key, static_cast<int>(t));
    if (fresh) continue;
    const Triple &first = mesh_.triangles[static_cast<std::size_t>(twin->second)], &second = mesh_.triangles[t];
    // In one panel only the two sides of a fold lie on each other; anything else is a seam that should not be.
    if (panel_[second[0]] != panel_[first[0]] || (on_inner_line(first) && on_inner_line(second))) doubled.push_back(static_cast<int>(t));
  }
  for (int t : doubled) {
    const Triple v = mesh_.triangles[static_cast<std::size_t>(t)];
    for (int k = 0; k < 3; ++k) {
      const int a = v[k], b = v[(k + 1) % 3];
      if (!is_plain_inner(mesh_, a, b)) continue;
      split_edge(mesh_, a, b, middle(mesh_, a, b));
      break;
    }
  }
  name_new_vertices();
}

std::optional<int> SewingTable::turned_over() const {
  for (const Triple& t : mesh_.triangles) {
    if (t[0] >= 0 && smallest_angle(mesh_.vertices[t[0]].p, mesh_.vertices[t[1]].p, mesh_.vertices[t[2]].p) <= 0) return t[0];
  }
  return std::nullopt;
}

std::pair<mesh::GarmentMesh, std::vector<int>> SewingTable::result(const std::vector<Eigen::Vector3d>& offsets) const {
  // Numbering: panel by panel, old vertices in their order, new ones after them.
  std::vector<int> first(garment_.panels.size() + 1, 0);
  for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
    if (!mesh_.stars[v].empty()) ++first[static_cast<std::size_t>(panel_[v]) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  const int count = first.back();
  std::vector<int> number(mesh_.vertices.size(), -1);
  for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
    if (!mesh_.stars[v].empty()) number[v] = first[static_cast<std::size_t>(panel_[v])]++;
  }
  mesh::GarmentMesh sewn = garment_;
  for (auto& fastener : sewn.fasteners) fastener.a = number[fastener.a], fastener.b = number[fastener.b];
  for (auto& point : sewn.points) point.vertex = number[point.vertex];
  sewn.x.resize(count, 3);
  sewn.uv.resize(count, 2);
  sewn.vertex_panel.resize(count);
  for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
    if (number[v] < 0) continue;
    const auto old_row = static_cast<Eigen::Index>(v);
    const bool old = old_row < garment_.vertex_count() && mesh_.vertices[v].p == in_cells(static_cast<int>(v), garment_.uv.row(old_row));
    const Point uv = old ? Point(garment_.uv.row(old_row)) : in_metres(static_cast<int>(v));
    sewn.uv.row(number[v]) = uv;
    sewn.x.row(number[v]) = old ? Eigen::RowVector3d(garment_.x.row(old_row)) : (Eigen::Vector3d(uv.x(), uv.y(), 0) + offsets[static_cast<std::size_t>(panel_[v])]).transpose().eval();
    sewn.vertex_panel[number[v]] = panel_[v];
  }
  std::vector<Triple> faces;
  faces.reserve(mesh_.triangles.size());
  for (const Triple& t : mesh_.triangles) {
    if (t[0] < 0) continue;
    Triple face{number[t[0]], number[t[1]], number[t[2]]};
    if (turned(panel_[t[0]])) std::swap(face[1], face[2]);
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end());  // vertices are numbered panel by panel, and so the faces stand
  const auto face_count = static_cast<Eigen::Index>(faces.size());
  sewn.faces.resize(face_count, 3);
  sewn.face_panel.resize(face_count);
  sewn.face_laminate = mesh::Ids::Constant(face_count, -1);
  for (Eigen::Index f = 0; f < face_count; ++f) {
    const Triple& t = faces[static_cast<std::size_t>(f)];
    sewn.faces.row(f) << t[0], t[1], t[2];
    sewn.face_panel[f] = sewn.vertex_panel[t[0]];
  }
  sewn.run_vertices.clear();
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (const auto& [s, v] : rows_[r]) sewn.run_vertices.push_back({static_cast<int>(r), number[v], s});
  }
  return {std::move(sewn), std::move(number)};
}

}  // namespace toile::tailor
