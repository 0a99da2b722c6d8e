// What a placement has come to: strains, directions, distances, gaps, intersections.
#pragma once

#include "toile/contact/exact.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"
#include "toile/placement/body_frame.h"
#include "toile/placement/flatten.h"
#include "toile/placement/folds.h"
#include "toile/placement/layout.h"

#include <optional>
#include <vector>

namespace toile::placement {

struct SeamGap {
  int seam = 0;
  double mean = 0, largest = 0;  ///< distance of welded pairs [m]
};

/// Angle between the warp and its wanted direction, over the faces of a panel that have one.
struct WarpAngle {
  int panel = 0;
  double mean = 0, largest = 0;  ///< absolute, mean by area [rad]
};

/// How far the support lies from the surface that a part's panels were bent on, at their vertices.
struct PartFit {
  Part part = Part::trunk;
  double rms = 0, largest = 0;  ///< [m]
};

struct Report {
  double max_strain = 0, rms_strain = 0;  ///< of all edges [1]
  double area_change = 0;                 ///< placed over flat area, minus 1
  double smallest_gap = 0;                ///< of a vertex from the support [m], negative inside
  int vertices_inside = 0;
  std::vector<contact::FacePair> support_intersections;  ///< (cloth, support)
  std::vector<contact::FacePair> self_intersections;
  double mean_seam_gap = 0, largest_seam_gap = 0;  ///< of all welded pairs [m]
  std::vector<SeamGap> seams;
  double mean_warp_angle = 0, largest_warp_angle = 0;  ///< [rad]
  std::vector<WarpAngle> warp_angles;  ///< of panels that have a wanted direction
  std::vector<PartFit> fits;  ///< of the parts that panels were bent round; place() fills them in
  // by vertex
  std::vector<double> vertex_gap;     ///< from the support, negative inside [m]
  std::vector<double> vertex_strain;  ///< of the edge at the vertex with the largest one, signed [1]
  std::vector<double> vertex_seam_gap;  ///< to the farthest particle it is sewn to [m]
  // by face
  std::vector<double> face_warp_angle;  ///< signed, counter-clockwise seen from outside; 0 where there is no wanted direction [rad]
  std::vector<int> face_cut;            ///< 1: cuts another face of the cloth, 2: of the support, 3: of both
};

/// Where the warp of a face should run: `turn` counter-clockwise (seen from outside) from up the trunk, or from inwards along
/// an arm. What is up on a face that lies flat (a shoulder) is square to `around`.
struct WantedDirection {
  Eigen::Vector3d up, around;  ///< unit
  double turn = 0;             ///< [rad]
};

/// As the layout turned the panels. Faces of parts that are folded over and of attached panels have none.
/// bent  the panels bent round their parts [m], |V| x 3
/// ret   |F|
std::vector<std::optional<WantedDirection>> wanted_directions(const mesh::GarmentMesh& garment, const FoldedFlat& folded, const Layout& layout, const Points3& bent);

/// wanted  |F|, or empty: no directions are measured.
Report measure(const mesh::GarmentMesh& garment, const mesh::SupportMesh& support, const std::vector<std::optional<WantedDirection>>& wanted = {});

/// The surfaces that panels were bent on against the (flattened) support. Parts that no panel is on, and attached panels, have no fit.
/// bent  the panels bent round their parts [m], |V| x 3
std::vector<PartFit> fit_of_parts(const mesh::GarmentMesh& garment, const Layout& layout, const Points3& bent, const mesh::SupportMesh& support, const Flattening& flattening);

/// Columns of the file: vertex edge_strain, ease, seam_gap; face warp_angle, cuts.
void add_columns(mesh::GarmentMesh& garment, const Report& report);

}  // namespace toile::placement
