// Pairs of the cloth that lie near each other in the cloth itself, and therefore do not touch when they are near in space.
#pragma once

#include "toile/contact/search.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <span>
#include <utility>
#include <vector>

namespace toile::dynamics {

/// Where the nodes of a garment are in its panels.
class RestNeighbours {
 public:
  RestNeighbours() = default;
  /// node_of_vertex  as in mechanics::make_sheet; node_count may be greater than its ids need
  RestNeighbours(const mesh::GarmentMesh& garment, const mesh::Ids& node_of_vertex, int node_count);

  /// Distance within the cloth of the two primitives of a contact of cloth with cloth [m]: in the panel that all their nodes share, or by
  /// way of a seam's node that is a neighbour of both (then at most so much). Infinite where neither is the case.
  double distance(const contact::Contact& contact) const;

  /// Those contacts whose primitives are at least `least` from each other within the cloth, in their order.
  std::vector<contact::Contact> without(std::span<const contact::Contact> contacts, double least) const;

 private:
  /// Panel coordinates of a node in a panel, or null.
  const Eigen::Vector2d* at(int node, int panel) const;
  std::vector<int> start_;                             ///< |nodes| + 1
  std::vector<std::pair<int, Eigen::Vector2d>> place_; ///< panel, panel coordinates
  std::vector<int> seam_start_, seam_;                 ///< nodes with several places among each node and its neighbours
};

}  // namespace toile::dynamics
