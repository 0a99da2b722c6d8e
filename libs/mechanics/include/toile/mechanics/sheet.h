// A garment as a mechanical system: nodes with mass, membrane triangles, bending, links. Pure functions of positions.
// Forces of contact are not here (libs/dynamics).
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/constitutive.h"
#include "toile/mechanics/block_matrix.h"
#include "toile/mechanics/internal_friction.h"
#include "toile/mechanics/membrane.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <optional>
#include <vector>

namespace toile::mechanics {

using mesh::Ids;
using mesh::Points3;

/// A symmetric sparse matrix that acts alike on x, y and z.
struct ScalarMatrix {
  std::vector<int> row_start, column;
  std::vector<double> value;
};

/// Energy stiffness/2 |x_a - x_b - offset|^2: draws the two sides of an open seam together as the offset shrinks.
struct Link {
  int a = 0, b = 0;
  double stiffness = 0;  ///< [N/m]
};

/// Energy stiffness/2 (|x_a - x_b| - length)^2 where it is longer than that, else none: a closed button pulls and does not push.
struct Spring {
  int a = 0, b = 0;
  double stiffness = 0;  ///< [N/m]
  double length = 0;     ///< may be negative: it pulls at no distance too [m]
  int fastener = -1;     ///< index into the garment's fasteners
};

/// Energy stiffness/2 (angle - rest)^2 of two triangles on an edge.
struct HingeElement {
  std::array<int, 4> node{};  ///< the edge as the first triangle runs along it, then the corner of either triangle opposite to it
  double rest = 0;            ///< positive: the face sides turn towards each other [rad]
  double stiffness = 0;       ///< [N m]
};

/// Tangent plane of the cloth at a vertex, held by two further nodes at x + length * dx/du and x + length * dx/dv.
struct Director {
  int vertex = 0, node = 0;
  int ghost_u = 0, ghost_v = 0;  ///< node ids
  double length = 0;             ///< [m]
};

struct SheetOptions {
  std::vector<int> directed_vertices;  ///< whose tangent plane gets nodes of its own (clamps)
  double link_stiffness = 500;   ///< of open seams, per node pair [N/m]
  double fastener_stiffness = 500;  ///< [N/m]
  bool internal_friction = false;   ///< sliders with the anchors that the garment's columns have
};

/// A face by itself, or two that share an edge off the grid and stretch as one: the energy of a yarn direction is that of their
/// mean stretch (by area). docs/mechanics.md#membrane
struct MembraneUnit {
  int first = 0, second = -1;
  int element = -1;  ///< of a pair: the element of its mean weft stretch; that of the warp follows
};

struct Sheet {
  int node_count = 0;                      ///< points of the cloth, then the directors' nodes
  int cloth_nodes = 0;                     ///< points of the cloth
  Ids node_of_vertex;                      ///< |garment vertices|
  std::vector<std::array<int, 3>> corners; ///< node ids, |F|
  std::vector<TriangleShape> shapes;       ///< |F|
  std::vector<int> fabric_of_face;         ///< index into fabrics, |F|
  std::vector<MembraneUnit> units;         ///< every face in one of them
  std::vector<fabric::Constitutive> fabrics;
  Eigen::VectorXd mass;                    ///< [kg], |nodes|
  Eigen::VectorXd area;                    ///< rest area that belongs to each node [m2]
  ScalarMatrix bending;                    ///< constant: gradient = bending * x [N/m]
  std::vector<Link> links;
  std::vector<Spring> springs;
  std::vector<Director> directors;
  std::vector<HingeElement> hinges;
  std::optional<InternalFriction> friction;  ///< empty: elastic

  // where things go (fixed gather order, so that sums do not depend on threads)
  std::vector<int> node_corner_start, node_corner;     ///< 3 * face + corner around each node
  std::vector<int> node_link_start, node_link;         ///< 2 * link + end around each node; springs follow links
  std::vector<int> row_start, column, diagonal;        ///< block pattern of the second derivative
  std::vector<int> block_part_start, block_part;       ///< 9 * face + 3 * a + b per block
  std::vector<double> constant_part;                   ///< bending and links of each block, times identity [N/m]

  // Elements whose energy is a function of one number: their second derivative is taken as slope * gradient gradient^T. Hinges, sliders of
  // bending, then both yarns' mean stretch of pairs.
  std::vector<int> element_start, element_node;             ///< nodes of each element; |elements| + 1, |entries|
  std::vector<int> node_entry_start, node_entry;            ///< entries of each node
  std::vector<int> block_pair_start;                        ///< per block
  std::vector<std::pair<int, int>> block_pair;              ///< entries of one element that meet in the block
  std::vector<int> entry_element;
};

/// node_of_vertex  vertices with the same id are one point; ids dense from 0
/// Welds between different nodes become links, between equal nodes seams that bend with their bending_factor.
/// error  "no_laminate" for each panel with a face that has no laminate, "bad_fabric", "degenerate_triangle"
Result<Sheet> make_sheet(const mesh::GarmentMesh& garment, const Ids& node_of_vertex, const SheetOptions& options);

/// Makes all links stiffer by a factor.
void scale_links(Sheet& sheet, double factor);

/// Energies by kind [J].
struct SheetEnergy {
  double membrane = 0, bending = 0, links = 0;
  double total() const { return membrane + bending + links; }
};

/// Scratch memory and results of one evaluation.
struct SheetResponse {
  SheetEnergy energy;
  Points3 gradient;  ///< [N], |nodes| x 3
  BlockMatrix matrix;
  std::vector<Eigen::Matrix<double, 3, 3>> corner_force;  ///< columns: gradient at the corners of each face
  std::vector<std::array<Block, 6>> face_blocks;
  bool constant_blocks_stand = false;  ///< blocks of bending alone are those of the last evaluation; who changes them says false
  std::vector<Eigen::Vector3d> entry_gradient;            ///< of each element's number
  std::vector<double> element_force, element_slope;
};

/// x             [m], |nodes| x 3
/// link_offset   [m], |links| x 3
SheetEnergy energy(const Sheet& sheet, const Points3& x, const Points3& link_offset);

/// Energy and gradient, and unless `curvature` is empty the second derivative, into `response`.
void evaluate(const Sheet& sheet, const Points3& x, const Points3& link_offset, std::optional<Curvature> curvature, SheetResponse& response);

/// Largest and 99th percentile of |strain| over faces.
struct StrainSummary {
  double warp_max = 0, weft_max = 0, warp_99 = 0, weft_99 = 0;  ///< extension only [1]
  double shear_max = 0;                                        ///< [rad]
};
StrainSummary strain_summary(const Sheet& sheet, const Points3& x);

YarnGradient yarn_gradient(const Sheet& sheet, const Points3& x, std::size_t face);

}  // namespace toile::mechanics
