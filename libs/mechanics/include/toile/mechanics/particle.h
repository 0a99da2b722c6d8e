// The published particle model of cloth, as a reference to compare with: springs along the yarns, torques that resist
// trellis shear and bending, linear and without hysteresis. docs/mechanics.md#particle has formulas and limits.
// Pure functions of positions, in the same form as sheet.h.
#pragma once

#include "toile/mechanics/sheet.h"

#include <cstdint>

namespace toile::mechanics {

/// Stiffness of the springs on edges that are not along the yarns (the strip of triangles between grid and border).
enum class EdgeEstimate {
  van_gelder,   ///< E area / length^2 with the mean of both yarn directions
  orthotropic,  ///< the same with the modulus in the edge's own direction
};

/// Which of a curve's slopes a linear spring takes.
enum class Modulus {
  secant,   ///< F_max / EMT, as published
  initial,  ///< the slope at zero, which cloth under its own weight feels
};

struct ParticleOptions {
  EdgeEstimate edges = EdgeEstimate::van_gelder;
  Modulus modulus = Modulus::secant;
  double link_stiffness = 500;      ///< of open seams, per node pair [N/m]
  double fastener_stiffness = 500;  ///< of fasteners without one of their own [N/m]
};

/// The published constants of one grid cell inside a panel.
/// Source: docs/bibliography.md#fontana2005
struct CellConstants {
  double weft_spring = 0, warp_spring = 0;    ///< F h_across / (eps h_along) [N/m]
  double trellis = 0;                         ///< torque per angle, G h_u h_v cos(angle) [N m/rad]
  double weft_torque = 0, warp_torque = 0;    ///< B h_across / h_along, torque per turning angle [N m/rad]
};
/// cell_u, cell_v  sides along weft and warp [m]; angle  shear angle [rad]
CellConstants cell_constants(const fabric::Card& card, double cell_u, double cell_v, double angle, Modulus modulus);

/// Modulus per width of a linear orthotropic sheet in a direction at `angle` from the weft: 1/E = c^4/E_u + s^4/E_v + c^2 s^2/G.
double direction_modulus(double weft, double warp, double shear, double angle);

/// Elements as separate arrays, so that loops over them run through memory in order.
struct ParticleModel {
  int node_count = 0;
  Ids node_of_vertex;                      ///< |garment vertices|
  std::vector<std::array<int, 3>> corners; ///< triangles by node ids, |F|; for contact only
  Eigen::VectorXd mass;                    ///< [kg], |nodes|
  Eigen::VectorXd area;                    ///< rest area that belongs to each node [m2]
  std::vector<Link> links;                 ///< open seams

  struct Springs {
    std::vector<int> a, b;
    std::vector<double> stiffness, length;  ///< [N/m], [m]
    std::vector<std::uint8_t> slack;        ///< 1: pulls only
    std::size_t size() const { return a.size(); }
  } springs;  ///< along yarns, then on the strip's edges, then trims and fasteners
  std::size_t cloth_springs = 0;  ///< those of the cloth itself come first

  std::vector<int> fastener_spring;  ///< of each fastener of the garment: index into springs, or -1

  struct Cells {
    std::vector<std::array<int, 4>> node;  ///< 00, 10, 01, 11: first digit along u
    std::vector<double> weight;            ///< G area / 4, of each corner [N m]
    std::size_t size() const { return node.size(); }
  } cells;

  struct Bends {
    std::vector<std::array<int, 3>> node;  ///< before, at, after
    std::vector<double> stiffness;         ///< [N m/rad]
    std::size_t size() const { return node.size(); }
  } bends;

  struct Hinges {
    std::vector<std::array<int, 4>> node;  ///< the edge as the first triangle runs along it, then the opposite corners
    std::vector<double> stiffness, rest;   ///< [N m/rad], [rad]
    std::size_t size() const { return node.size(); }
  } hinges;  ///< on edges of the strip, on seams and folds

  // fixed gather order, so that sums do not depend on threads
  std::vector<int> node_part_start, node_part;   ///< 2 * part + (1: subtract); parts as in ParticleScratch
  std::vector<int> row_start, column, diagonal;  ///< block pattern of the second derivative
  std::vector<int> block_part_start, block_part; ///< 2 * stored block + (1: transposed), per block of the pattern
};

/// node_of_vertex  vertices with the same id are one point; ids dense from 0
/// error  "no_laminate" for each panel with a face that has no laminate, "bad_fabric", "degenerate_triangle"
Result<ParticleModel> make_particle(const mesh::GarmentMesh& garment, const Ids& node_of_vertex, const ParticleOptions& options);

/// Makes all links stiffer by a factor.
void scale_links(ParticleModel& model, double factor);

/// Results and scratch memory of one evaluation; nothing is allocated once sizes have settled.
struct ParticleResponse {
  SheetEnergy energy;
  Points3 gradient;  ///< [N], |nodes| x 3
  BlockMatrix matrix;
  std::vector<Eigen::Vector3d> part;     ///< gradients of springs (1 each), cells (4), bends (3), hinges (4), links (1)
  std::vector<Eigen::Matrix3d> block;
};

/// x             [m], |nodes| x 3
/// link_offset   [m], |links| x 3
SheetEnergy energy(const ParticleModel& model, const Points3& x, const Points3& link_offset);

/// Energy and gradient, and unless `curvature` is empty the second derivative, into `response`.
void evaluate(const ParticleModel& model, const Points3& x, const Points3& link_offset, std::optional<Curvature> curvature, ParticleResponse& response);

/// Only the gradient: what explicit integration needs, many times.
void gradient(const ParticleModel& model, const Points3& x, const Points3& link_offset, ParticleResponse& response);

/// Largest angular frequency of a second derivative with these masses, from above [1/s]: the root of the largest row sum.
/// Explicit steps must stay below 2 over it. Nodes without mass are left out.
double frequency_bound(const BlockMatrix& matrix, const Eigen::VectorXd& mass);
/// Of the model around x.
double frequency_bound(const ParticleModel& model, const Points3& x);

}  // namespace toile::mechanics
