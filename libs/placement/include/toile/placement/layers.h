// Free layers (facings, linings, upper collars, patch pockets): laid on the placed panels that they belong to, which they follow by
// panel coordinates at a small distance along the normal.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace toile::placement {

using mesh::Points3;

/// Non-zero for panels of free layers, |panels|.
std::vector<char> free_panels(const mesh::GarmentMesh& garment);

/// What layers need at the back and at the face of each vertex: a gap for every step of order, |V| each [m].
struct Rooms {
  std::vector<double> inside, outside;
};
Rooms rooms_for_layers(const mesh::GarmentMesh& garment, double gap);

/// Where a panel of a free layer lies.
struct LayerPlace {
  int panel = 0;
  int on = 0;                 ///< panel that it follows
  Eigen::Matrix2d turn;       ///< on its coordinates (a reflection where the two faces look to opposite sides)
  Eigen::Vector2d shift;      ///< [m]
  bool face_inwards = false;  ///< its face looks at the body
  double gap = 0;             ///< mean distance from what it is sewn to, before the relaxation [m]
};

struct LaidLayers {
  Points3 x;                       ///< [m], |V| x 3: panels that are no free layers as they were
  Points3 smooth;                  ///< the same before anything was drawn in or moved farther off: as bent as what is under it [m], |V| x 3
  std::vector<LayerPlace> places;  ///< in the order of laying
  int cuts = 0;                    ///< pairs of triangles that still cut one another
};

/// Every panel of a free layer goes on that of the panels named by its layer (`on`) where it lies nearest to what it is sewn to:
/// by its draft coordinates (mirrored where one of the two is a mirrored copy), or moved and turned as its seams and tacks to that panel
/// say. Its vertices lie `gap` off the cloth under them, farther where they would cut it. Parts beyond that cloth go on straight; over
/// darts they are spread between the legs.
/// x      positions of the other panels [m], |V| x 3
/// error  "free_layer": a panel that neither coordinates nor seams bring onto one of the panels that it lies on
Result<LaidLayers> lay_layers(const mesh::GarmentMesh& garment, const Points3& x, double gap);

}  // namespace toile::placement
