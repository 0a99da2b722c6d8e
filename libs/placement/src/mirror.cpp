#include "toile/placement/mirror.h"

#include <algorithm>

namespace toile::placement {

namespace {

// The corner that comes first stays first.
void turn(mesh::Triangles& faces) {
  for (Eigen::Index f = 0; f < faces.rows(); ++f) std::swap(faces(f, 1), faces(f, 2));
}

Region mirrored(Region region) {
  switch (region) {
    case Region::torso_left: return Region::torso_right;
    case Region::torso_right: return Region::torso_left;
    case Region::arm_left: return Region::arm_right;
    case Region::arm_right: return Region::arm_left;
    case Region::leg_left: return Region::leg_right;
    case Region::leg_right: return Region::leg_left;
    default: return region;
  }
}

}  // namespace

mesh::GarmentMesh mirrored(const mesh::GarmentMesh& garment) {
  mesh::GarmentMesh m = garment;
  m.x.col(0) = -m.x.col(0);
  m.uv.col(0) = -m.uv.col(0);
  turn(m.faces);
  for (mesh::Hinge& hinge : m.hinges) std::swap(hinge.o0, hinge.o1);
  for (mesh::Panel& panel : m.panels) panel.mirrored = !panel.mirrored;
  return m;
}

mesh::SupportMesh mirrored(const mesh::SupportMesh& support) {
  mesh::SupportMesh m = support;
  m.x.col(0) = -m.x.col(0);
  turn(m.faces);
  for (auto& [name, at] : m.landmarks) at[0] = -at[0];
  return m;
}

Part mirrored(Part part) {
  switch (part) {
    case Part::arm_left: return Part::arm_right;
    case Part::arm_right: return Part::arm_left;
    case Part::leg_left: return Part::leg_right;
    case Part::leg_right: return Part::leg_left;
    default: return part;
  }
}

PlaceParams mirrored(const PlaceParams& params) {
  PlaceParams m = params;
  for (auto& [name, panel] : m.panels) {
    panel.region = mirrored(panel.region);
    panel.shift[0] = -panel.shift[0];
    panel.turn = -panel.turn;
    if (!panel.to.empty()) panel.to[0] = -panel.to[0];
  }
  return m;
}

bool left_handed(const mesh::SupportMesh& support) {
  for (Eigen::Index v = 0; v < support.x.rows(); ++v) {
    if (support.x(v, 0) != 0) return support.x(v, 0) < 0;
  }
  return false;
}

}  // namespace toile::placement
