// Comparing two artefacts in three layers: structure, numbers, meaning. docs/measures.md, "Comparing".
#pragma once

#include "toile/base/fields.h"
#include "toile/inspect/image.h"
#include "toile/inspect/json.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <map>
#include <string>
#include <vector>

namespace toile::inspect {

enum class DiffMode {
  exact,      ///< every number to the last bit, the route card too
  indexed,    ///< same ids; numbers within the tolerances of their columns; bands
  geometric,  ///< ids may differ: panels by name, shape within a distance, bands
};

struct DiffParams {
  DiffMode mode = DiffMode::indexed;
  std::map<std::string, double> tolerances;  ///< element.column -> absolute tolerance
  std::vector<std::string> ignore;           ///< element.column
  double area_band = 1e-4;
  double seam_band = 1e-4;    ///< [m]
  double angle_band = 1e-2;   ///< [rad]
  double strain_band = 5e-4;
  double distance_band = 1e-3;  ///< [m]
  static void describe(auto& f) {
    f(&DiffParams::mode, {.key = "mode", .doc = "exact: every bit; indexed: numbers within the tolerances of the column registry; geometric: vertices and faces may be numbered and cut differently"});
    f(&DiffParams::tolerances, {.key = "tolerances", .doc = "absolute tolerance of a column instead of the registry's, by element.column, in the column's SI unit", .min = 0, .max = 1e9});
    f(&DiffParams::ignore, {.key = "ignore", .doc = "columns that are not compared, as element.column"});
    f(&DiffParams::area_band, {.key = "area_band", .doc = "relative change of a panel's area and mass that is no change", .unit = "1", .min = 0, .max = 1});
    f(&DiffParams::seam_band, {.key = "seam_band", .doc = "change of a seam's mismatch or gap that is no change", .unit = "m", .min = 0, .max = 1});
    f(&DiffParams::angle_band, {.key = "angle_band", .doc = "change of a panel's smallest triangle corner that is no change (not looked at in geometric mode)", .unit = "rad", .min = 0, .max = 1});
    f(&DiffParams::strain_band, {.key = "strain_band", .doc = "change of a panel's 99th percentile and median of strain that is no change", .unit = "1", .min = 0, .max = 1});
    f(&DiffParams::distance_band, {.key = "distance_band", .doc = "distance between the surfaces that is no change (geometric mode)", .unit = "m", .min = 0, .max = 1});
  }
};

enum class DiffLayer { structure, numbers, meaning };

struct Difference {
  DiffLayer layer = DiffLayer::structure;
  std::string item;  ///< "vertex.x", "panel front", "seams[2].length_a"
  std::string what;
};

/// The largest change of one column, whether allowed or not.
struct ColumnChange {
  std::string column;  ///< element.name
  double largest = 0, tolerance = 0;
  std::size_t row = 0;     ///< of the largest change
  std::size_t beyond = 0;  ///< rows over the tolerance
};

/// A figure of both sides.
struct BandChange {
  std::string item;
  double a = 0, b = 0, band = 0;
  bool relative = false;
  bool within() const;
};

struct DiffReport {
  std::vector<Difference> differences;  ///< empty: the same
  std::vector<ColumnChange> columns;
  std::vector<BandChange> bands;
  bool same() const { return differences.empty(); }
};

DiffReport diff(const DiffParams& params, const mesh::GarmentMesh& a, const mesh::GarmentMesh& b);
DiffReport diff(const DiffParams& params, const mesh::SupportMesh& a, const mesh::SupportMesh& b);

/// JSON texts: keys and words exactly, numbers within 1e-6 of their size (exact mode: to the last bit).
/// error  Issue "bad_json"
Result<DiffReport> diff_json(const DiffParams& params, const std::string& a, const std::string& b);
/// Pictures: the same size; at most 1 % of the pixels differ by more than 16 of 255 in a channel, and the mean difference is at
/// most 0.5 of 255 (processors differ in the last bits of rays, and so in single pixels). Exact mode: every byte.
DiffReport diff(const DiffParams& params, const Image& a, const Image& b);

/// Greatest distance from a vertex of either mesh to the other's surface [m].
double surface_distance(const mesh::Points3& xa, const mesh::Triangles& fa, const mesh::Points3& xb, const mesh::Triangles& fb);

Json to_json(const DiffReport& report);
std::string to_text(const DiffReport& report);

}  // namespace toile::inspect

template <>
struct toile::Choices<toile::inspect::DiffMode> {
  using V = toile::inspect::DiffMode;
  static constexpr std::array names{std::pair{"exact", V::exact}, std::pair{"indexed", V::indexed}, std::pair{"geometric", V::geometric}};
};
