// Landmarks and regions that a user names on a body from elsewhere.
#pragma once

#include "toile/io/body_import.h"

namespace toile::io {

/// Fills landmarks, region_names and face_region.
/// source  of each face of the body, its row in marks
Issues name_regions(mesh::SupportMesh& body, const BodyImportParams& params, const FaceMarks& marks, const std::vector<int>& source);

}  // namespace toile::io
