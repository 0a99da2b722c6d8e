// Figures that tell whether panels and seams came out as intended.
#pragma once

#include "toile/mesh/garment_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace toile::tailor {

/// Distribution of the smallest angle of each triangle in panel coordinates [deg]. Angles between two edges of border or
/// internal lines are the pattern's own and do not count.
struct AngleReport {
  double least = 180;
  double percent_1 = 180;            ///< one triangle in a hundred is below
  double median = 180;
  std::array<int, 12> histogram{};   ///< in steps of 5 degrees, 0 to 60
  int below_20 = 0;
  int least_face = -1;
};
AngleReport angle_report(const mesh::GarmentMesh& garment);
/// The same for each panel.
std::vector<AngleReport> panel_angle_reports(const mesh::GarmentMesh& garment);

/// The garment as one surface of particles, i.e. after welding.
struct SurfaceReport {
  int particles = 0;
  int components = 0;
  int openings = 0;              ///< closed border loops
  int euler = 0;                 ///< particles - edges + faces
  int branching_edges = 0;       ///< edges of more than two faces, where three or more panels meet
  std::vector<double> opening_lengths;  ///< in panel coordinates, longest first [m]
};
SurfaceReport surface_report(const mesh::GarmentMesh& garment);

/// "panel front at (12.3, 45.6) cm", for messages.
std::string place_text(const mesh::GarmentMesh& garment, int vertex);

}  // namespace toile::tailor
