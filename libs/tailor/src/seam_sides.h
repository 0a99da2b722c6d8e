// The sides of seams with their names resolved, and what can be said of them without looking at the mesh.
#pragma once

#include "line_reference.h"
#include "seam_plan.h"

#include <vector>

namespace toile::tailor {

/// Always allowed: a length difference that never matters, and the distance at which a given place means a corner [m].
constexpr double always_allowed = 5e-4;

/// A place that was named, and the side it is on.
struct SidePlace {
  int side = 0;
  int part = 0;        ///< of the side
  double s = 0;        ///< on the part's run
  int vertex = -1;     ///< where it has a name
  double along = 0;    ///< from the side's start [m]
};

struct SeamZone {
  SidePlace from, to;  ///< in sewing order
  double share = 1;
};

struct SeamMatch {
  SidePlace a, b;
};

/// A seam with its names resolved; side 0 is a, 1 is b, 2 and more are further sides.
struct SeamSides {
  const SeamSpec* spec = nullptr;
  std::vector<std::vector<RunPart>> sides;
  std::vector<double> lengths;  ///< by side [m]
  std::vector<SeamMatch> matches;
  std::vector<SeamZone> zones;
};

Issue seam_issue(const SeamSpec& seam, std::string code, std::string what, std::string remedy);
/// "side b (-back.side)"
std::string side_text(const SeamSpec& seam, int side);
/// Name of the row in garment.seams: the seam's own for side b, NAME_side_3 and so on for further sides.
std::string seam_row_name(const SeamSpec& seam, int side);

/// Difference of the lengths of side a and another that needs no mending [m].
double allowed_difference(const SeamSpec& seam, double length_a, double length_b, const SewParams& params);

struct ResolvedSides {
  std::vector<SeamSides> seams;  ///< those whose names are all known
  Issues issues;
};

/// Precondition: specs are ordered by name.
ResolvedSides resolve_sides(const mesh::GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<const SeamSpec*>& specs);

/// Lengths, directions, ranges that occur twice in one seam or overlap in two.
Issues check_sides(const mesh::GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<SeamSides>& seams, const SewParams& params);

}  // namespace toile::tailor
