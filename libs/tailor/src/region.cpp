#include "region.h"

#include "toile/tailor/quality.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace toile::tailor {
namespace {

Eigen::Vector2d plain(const mesh::GarmentMesh& garment, int panel, const Eigen::Vector2d& uv) { return {garment.panels[static_cast<std::size_t>(panel)].mirrored ? -uv.x() : uv.x(), uv.y()}; }

std::array<int, 2> edge(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

/// Edges along the lines, ascending.
std::vector<std::array<int, 2>> line_edges(const Lines& lines) {
  std::vector<std::array<int, 2>> edges;
  for (const auto& row : lines) {
    for (std::size_t k = 1; k < row.size(); ++k) edges.push_back(edge(row[k - 1], row[k]));
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

}  // namespace

Outline::Outline(std::vector<std::array<Eigen::Vector2d, 2>> segments) : segments_(std::move(segments)) {
  if (segments_.empty()) return;
  double high = segments_[0][0].y();
  low_ = high;
  for (const auto& [a, b] : segments_) {
    low_ = std::min({low_, a.y(), b.y()});
    high = std::max({high, a.y(), b.y()});
  }
  levels_.resize(std::clamp<std::size_t>(segments_.size(), 1, 4096));
  step_ = std::max((high - low_) / static_cast<double>(levels_.size()), 1e-300);
  const auto level = [&](double v) { return std::clamp(static_cast<long>(std::floor((v - low_) / step_)), 0L, static_cast<long>(levels_.size()) - 1); };
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    const long from = level(segments_[k][0].y()), to = level(segments_[k][1].y());
    for (long i = std::min(from, to); i <= std::max(from, to); ++i) levels_[static_cast<std::size_t>(i)].push_back(static_cast<int>(k));
  }
}

bool Outline::contains(const Eigen::Vector2d& point) const {
  if (segments_.empty()) return false;
  const double at = std::floor((point.y() - low_) / step_);
  if (at < -1 || at > static_cast<double>(levels_.size())) return false;
  const auto level = static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(levels_.size() - 1)));
  bool inside = false;
  for (int k : levels_[level]) {
    const auto& [a, b] = segments_[static_cast<std::size_t>(k)];
    if ((a.y() > point.y()) != (b.y() > point.y()) && point.x() < (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
  }
  return inside;
}

Outline polygon(const std::vector<std::array<double, 2>>& corners) {
  std::vector<std::array<Eigen::Vector2d, 2>> segments;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) segments.push_back({Eigen::Vector2d(corners[i][0], corners[i][1]), Eigen::Vector2d(corners[j][0], corners[j][1])});
  return Outline(std::move(segments));
}

std::vector<std::vector<int>> faces_by_panel(const mesh::GarmentMesh& garment) {
  std::vector<std::vector<int>> faces(garment.panels.size());
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) faces[static_cast<std::size_t>(garment.face_panel[f])].push_back(static_cast<int>(f));
  return faces;
}

std::vector<std::array<int, 2>> border_edges(const mesh::GarmentMesh& garment, const std::vector<int>& faces) {
  std::vector<std::array<int, 4>> sides;  // lower and higher vertex, then as the face runs
  for (int f : faces) {
    for (int k = 0; k < 3; ++k) {
      const int a = garment.faces(f, k), b = garment.faces(f, (k + 1) % 3);
      sides.push_back({std::min(a, b), std::max(a, b), a, b});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<std::array<int, 2>> border;
  const auto same = [](const auto& p, const auto& q) { return p[0] == q[0] && p[1] == q[1]; };
  for (std::size_t k = 0; k < sides.size(); ++k) {
    if ((k == 0 || !same(sides[k - 1], sides[k])) && (k + 1 == sides.size() || !same(sides[k], sides[k + 1]))) border.push_back({sides[k][2], sides[k][3]});
  }
  return border;
}

Outline panel_outline(const mesh::GarmentMesh& garment, int panel, const std::vector<int>& faces) {
  std::vector<std::array<Eigen::Vector2d, 2>> segments;
  for (const auto& [a, b] : border_edges(garment, faces)) segments.push_back({plain(garment, panel, garment.uv.row(a)), plain(garment, panel, garment.uv.row(b))});
  return Outline(std::move(segments));
}

Eigen::Vector2d plain_middle(const mesh::GarmentMesh& garment, int face) {
  const Eigen::Vector2d middle = (garment.uv.row(garment.faces(face, 0)) + garment.uv.row(garment.faces(face, 1)) + garment.uv.row(garment.faces(face, 2))) / 3;
  return plain(garment, garment.face_panel[face], middle);
}

Result<std::vector<int>> enclosed_by(const mesh::GarmentMesh& garment, const std::vector<int>& faces, const Lines& lines) {
  std::map<int, int> ends;
  std::vector<std::array<Eigen::Vector2d, 2>> segments;
  for (const auto& [a, b] : line_edges(lines)) {
    ++ends[a];
    ++ends[b];
    segments.push_back({garment.uv.row(a), garment.uv.row(b)});
  }
  std::string open;
  for (const auto& [vertex, count] : ends) {
    if (count % 2) open += (open.empty() ? "" : " and ") + place_text(garment, vertex);
  }
  if (!open.empty()) return Issue{"open_outline", {}, fmt::format("the outline is open at panel {}", open), "name all lines round the part, or give a position `inside` it where they run from border to border"};
  const Outline outline(std::move(segments));
  std::vector<int> result;
  for (int f : faces) {
    const Eigen::Vector2d middle = (garment.uv.row(garment.faces(f, 0)) + garment.uv.row(garment.faces(f, 1)) + garment.uv.row(garment.faces(f, 2))) / 3;
    if (outline.contains(middle)) result.push_back(f);
  }
  return result;
}

Result<std::vector<int>> same_side(const mesh::GarmentMesh& garment, int panel, const std::vector<int>& faces, const Lines& lines, const std::array<double, 2>& inside) {
  const std::vector<std::array<int, 2>> walls = line_edges(lines);
  const Eigen::Vector2d seed = plain(garment, panel, {inside[0], inside[1]});
  int start = -1;
  for (std::size_t k = 0; k < faces.size() && start < 0; ++k) {
    const auto corner = [&](int i) { return Eigen::Vector2d(garment.uv.row(garment.faces(faces[k], i))); };
    bool holds = true;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector2d along = corner((i + 1) % 3) - corner(i), to = seed - corner(i);
      if (along.x() * to.y() - along.y() * to.x() < 0) holds = false;
    }
    if (holds) start = static_cast<int>(k);
  }
  if (start < 0) return Issue{"empty_region", {}, fmt::format("({:.1f}, {:.1f}) mm is not on panel '{}'", inside[0] * 1e3, inside[1] * 1e3, garment.panels[static_cast<std::size_t>(panel)].name), "give a position `inside` the part: panel coordinates, u across, v along the warp"};
  std::vector<std::array<int, 3>> sides;  // lower and higher vertex, place in `faces`
  for (std::size_t k = 0; k < faces.size(); ++k) {
    for (int i = 0; i < 3; ++i) {
      const auto e = edge(garment.faces(faces[k], i), garment.faces(faces[k], (i + 1) % 3));
      if (!std::binary_search(walls.begin(), walls.end(), e)) sides.push_back({e[0], e[1], static_cast<int>(k)});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<std::vector<int>> neighbours(faces.size());
  for (std::size_t k = 1; k < sides.size(); ++k) {
    if (sides[k][0] != sides[k - 1][0] || sides[k][1] != sides[k - 1][1]) continue;
    neighbours[static_cast<std::size_t>(sides[k][2])].push_back(sides[k - 1][2]);
    neighbours[static_cast<std::size_t>(sides[k - 1][2])].push_back(sides[k][2]);
  }
  std::vector<char> reached(faces.size(), 0);
  std::vector<int> waiting{start};
  reached[static_cast<std::size_t>(start)] = 1;
  while (!waiting.empty()) {
    const int k = waiting.back();
    waiting.pop_back();
    for (int n : neighbours[static_cast<std::size_t>(k)]) {
      if (reached[static_cast<std::size_t>(n)]) continue;
      reached[static_cast<std::size_t>(n)] = 1;
      waiting.push_back(n);
    }
  }
  std::vector<int> result;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (reached[k]) result.push_back(faces[k]);
  }
  if (result.size() == faces.size()) return Issue{"open_outline", {}, fmt::format("the outline does not divide panel '{}'", garment.panels[static_cast<std::size_t>(panel)].name), "name lines that run from border to border or close"};
  return result;
}

}  // namespace toile::tailor
