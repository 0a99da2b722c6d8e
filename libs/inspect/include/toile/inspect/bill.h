// The bill of materials of a garment, and what its regions are made of. docs/tailoring.md, "Bill of materials".
#pragma once

#include "toile/inspect/json.h"
#include "toile/mesh/garment_mesh.h"

#include <string>
#include <vector>

namespace toile::inspect {

struct FabricRow {
  std::string fabric;
  double area = 0;                  ///< of the mesh: what the mass is made of [m2]
  double area_with_allowances = 0;  ///< the same and the seam allowances of the panels cut from it [m2]
  double mass = 0;                  ///< area times areal density [kg]
};
struct SeamRow {
  std::string kind;
  int count = 0;
  double length_a = 0, length_b = 0;  ///< sums of both sides [m]
};
struct TrimRow {
  std::string kind;
  int count = 0;
  double length = 0;  ///< at rest: what is cut off [m]
  double mass = 0;    ///< [kg]
};
struct FastenerRow {
  std::string kind;
  int count = 0;
  double mass_each = 0;  ///< [kg]
  double mass = 0;       ///< [kg]
};

struct Bill {
  std::vector<FabricRow> fabrics;      ///< by name
  std::vector<SeamRow> seams;          ///< by kind
  std::vector<TrimRow> trims;          ///< by kind
  std::vector<FastenerRow> fasteners;  ///< by kind and mass; a zip is one
  double mass = 0;                     ///< of everything: the sum of mesh::vertex_masses [kg]
  double area_without_fabric = 0;      ///< of faces that have no laminate yet: they weigh nothing [m2]
};
Bill bill_of_materials(const mesh::GarmentMesh& garment);
Json to_json(const Bill& bill);

/// A part of a panel with one stack of sheets.
struct StackRow {
  int panel = 0, laminate = -1;
  double area = 0;  ///< [m2]
};
/// By panel, then by laminate.
std::vector<StackRow> stack_table(const mesh::GarmentMesh& garment);

}  // namespace toile::inspect
