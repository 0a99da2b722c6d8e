// Flat images of disks with the least stretch.
#pragma once

#include "toile/mesh/types.h"

namespace toile::reshape {

using mesh::Points2;
using mesh::Points3;
using mesh::Triangles;

/// As-rigid-as-possible parameterisation: least area integral of (s1 - 1)^2 + (s2 - 1)^2 over the principal stretches, started
/// from the least-squares conformal map. Source: docs/bibliography.md#liu2008, #levy2002
/// Precondition: faces form a disk, no face without area.
/// ret    |V| x 2 [m], counter-clockwise faces
/// settled  motion in one step, over the piece's size, at which it stops
Points2 unfold(const Points3& x, const Triangles& faces, double settled = 1e-9);

/// Principal stretches of every face of the map x -> uv; negative where it is turned over. |F| x 2, the larger first.
Points2 stretches(const Points3& x, const Points2& uv, const Triangles& faces);

}  // namespace toile::reshape
