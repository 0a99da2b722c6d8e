// Which vertex of which edge comes to lie where, for all seams of a garment at once (docs/tailoring.md, "Seams"). Everything
// here happens on edges as lines of a length; the plane mesh is not touched.
#pragma once

#include "line_reference.h"

#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/tailor/sew.h"

#include <array>
#include <vector>

namespace toile::tailor {

/// A run as the plan sees it.
struct PlanRun {
  struct Vertex {
    double s = 0;
    int id = 0;
    bool held = false;  ///< must stay where it is
  };
  std::vector<Vertex> row;
  double cell = 0.01;  ///< grid size of its panel [m]
  int sense = 0;       ///< +1 with the cloth on its left, -1 on its right, 0 on both
};

/// A vertex of a run as it will be.
struct PlanSlot {
  int vertex = -1;     ///< -1: to be put in
  double s_before = 0; ///< where it is now; of a new one, its place between its old neighbours
  double s = 0;        ///< where it comes to lie
};

/// A place along a seam: (run, slot), two where one run ends and the next begins.
struct PlanNode {
  std::vector<std::array<int, 2>> at;
};

/// Two sides that are joined, node by node.
struct PlanBond {
  int seam = 0;  ///< index into the specs
  int side = 1;  ///< 1: side b, 2 and more: further sides; the other one is side a
  std::array<std::vector<PlanNode>, 2> nodes;
  SeamReport report;
};

struct SeamPlan {
  std::vector<std::vector<PlanSlot>> rows;  ///< by run; empty where the run stays as it is
  std::vector<PlanBond> bonds;              ///< by seam and side
  Issues notes;                             ///< what deserves a look
};

/// Precondition: specs are ordered by name.
/// error  those of sew() that concern names, lengths and order
Result<SeamPlan> plan_seams(const mesh::GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<const SeamSpec*>& specs, const SewParams& params);

}  // namespace toile::tailor
