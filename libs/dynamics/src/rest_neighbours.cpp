#include "toile/dynamics/rest_neighbours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace toile::dynamics {
namespace {

double to_segment_sq(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double length_sq = ab.squaredNorm(), t = length_sq > 0 ? std::clamp((p - a).dot(ab) / length_sq, 0.0, 1.0) : 0;
  return (p - a - t * ab).squaredNorm();
}

}  // namespace

RestNeighbours::RestNeighbours(const mesh::GarmentMesh& garment, const mesh::Ids& node_of_vertex, int node_count) {
  const auto n = static_cast<std::size_t>(node_count);
  std::vector<std::vector<std::pair<int, Eigen::Vector2d>>> places(n);
  for (Eigen::Index v = 0; v < node_of_vertex.size(); ++v) {
    auto& of_node = places[static_cast<std::size_t>(node_of_vertex[v])];
    const int panel = garment.vertex_panel[v];
    // Of the two sides of a dart the first vertex stands for both.
    if (std::none_of(of_node.begin(), of_node.end(), [&](const auto& p) { return p.first == panel; })) of_node.emplace_back(panel, garment.uv.row(v).transpose());
  }
  std::vector<std::set<int>> seams(n);
  const auto note = [&](int node, int neighbour) {
    if (places[static_cast<std::size_t>(neighbour)].size() > 1) seams[static_cast<std::size_t>(node)].insert(neighbour);
  };
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) note(node_of_vertex[garment.faces(f, a)], node_of_vertex[garment.faces(f, b)]);
    }
  }
  start_.push_back(0);
  seam_start_.push_back(0);
  for (std::size_t i = 0; i < n; ++i) {
    place_.insert(place_.end(), places[i].begin(), places[i].end());
    start_.push_back(static_cast<int>(place_.size()));
    seam_.insert(seam_.end(), seams[i].begin(), seams[i].end());
    seam_start_.push_back(static_cast<int>(seam_.size()));
  }
}

const Eigen::Vector2d* RestNeighbours::at(int node, int panel) const {
  for (int k = start_[static_cast<std::size_t>(node)]; k < start_[static_cast<std::size_t>(node) + 1]; ++k) {
    if (place_[static_cast<std::size_t>(k)].first == panel) return &place_[static_cast<std::size_t>(k)].second;
  }
  return nullptr;
}

double RestNeighbours::distance(const contact::Contact& c) const {
  const int first = contact::first_count(c.kind);
  const auto node = [&](int k) { return c.node[static_cast<std::size_t>(k)]; };
  for (int p = start_[static_cast<std::size_t>(node(0))]; p < start_[static_cast<std::size_t>(node(0)) + 1]; ++p) {
    const int panel = place_[static_cast<std::size_t>(p)].first;
    std::array<const Eigen::Vector2d*, 4> uv{};
    for (int k = 0; k < 4; ++k) uv[static_cast<std::size_t>(k)] = at(node(k), panel);
    if (std::find(uv.begin(), uv.end(), nullptr) != uv.end()) continue;
    if (first == 1) return std::sqrt(std::min({to_segment_sq(*uv[0], *uv[1], *uv[2]), to_segment_sq(*uv[0], *uv[2], *uv[3]), to_segment_sq(*uv[0], *uv[3], *uv[1])}));
    return std::sqrt(std::min({to_segment_sq(*uv[0], *uv[2], *uv[3]), to_segment_sq(*uv[1], *uv[2], *uv[3]), to_segment_sq(*uv[2], *uv[0], *uv[1]), to_segment_sq(*uv[3], *uv[0], *uv[1])}));
  }
  // Over a seam: both ways to a node of it that lies beside both.
  double least = std::numeric_limits<double>::infinity();
  const auto way = [&](int from, int to, int seam) {
    double shortest = std::numeric_limits<double>::infinity();
    for (int k = from; k < to; ++k) {
      for (int p = start_[static_cast<std::size_t>(node(k))]; p < start_[static_cast<std::size_t>(node(k)) + 1]; ++p) {
        const auto& [panel, place] = place_[static_cast<std::size_t>(p)];
        if (const Eigen::Vector2d* s = at(seam, panel)) shortest = std::min(shortest, (place - *s).norm());
      }
    }
    return shortest;
  };
  const auto beside = [&](int k, int seam) {
    const auto begin = seam_.begin() + seam_start_[static_cast<std::size_t>(node(k))], end = seam_.begin() + seam_start_[static_cast<std::size_t>(node(k)) + 1];
    return std::binary_search(begin, end, seam);
  };
  for (int k = 0; k < first; ++k) {
    for (int i = seam_start_[static_cast<std::size_t>(node(k))]; i < seam_start_[static_cast<std::size_t>(node(k)) + 1]; ++i) {
      const int seam = seam_[static_cast<std::size_t>(i)];
      bool both = false;
      for (int l = first; l < 4; ++l) both = both || beside(l, seam);
      if (both) least = std::min(least, way(0, first, seam) + way(first, 4, seam));
    }
  }
  return least;
}

std::vector<contact::Contact> RestNeighbours::without(std::span<const contact::Contact> contacts, double least) const {
  std::vector<contact::Contact> kept;
  kept.reserve(contacts.size());
  for (const contact::Contact& c : contacts) {
    if (distance(c) >= least) kept.push_back(c);
  }
  return kept;
}

}  // namespace toile::dynamics
