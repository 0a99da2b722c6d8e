// Bodies, dress forms and other supports: closed triangle meshes with landmarks and named regions.
// World: metres, y up, a body faces +z, its left hand is at +x.
#pragma once

#include "toile/base/fields.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/types.h"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace toile::mesh {

struct SupportMesh {
  Points3 x;        ///< [m], |V| x 3
  Triangles faces;  ///< |F| x 3, outward
  Ids face_region;  ///< |F|, index into region_names; -1: none
  std::vector<std::string> region_names;                     ///< torso, neck, arm_left, arm_right, leg_left, leg_right
  std::map<std::string, std::array<double, 3>> landmarks;    ///< name -> position [m]; docs/form.md lists the names
  std::map<std::string, double> girths;                      ///< name -> measured girth [m] (tape, i.e. convex)
  std::vector<RouteEntry> route;
};

/// Index ranges, finite numbers, no repeated vertex in a face, every edge shared by exactly two opposite faces (closed,
/// consistently oriented), outward orientation (positive volume).
Issues validate(const SupportMesh& support);

/// Signed volume [m3].
double volume(const Points3& x, const Triangles& faces);

}  // namespace toile::mesh
