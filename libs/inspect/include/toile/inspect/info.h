// A short account of a file for people and programs.
#pragma once

#include "toile/inspect/json.h"
#include "toile/inspect/measures.h"

#include <string>

namespace toile::inspect {

std::string garment_text(const std::string& name, const mesh::GarmentMesh& garment, const Figures& figures);
Json garment_json(const std::string& name, const mesh::GarmentMesh& garment, const Figures& figures);

std::string support_text(const std::string& name, const mesh::SupportMesh& support);
Json support_json(const std::string& name, const mesh::SupportMesh& support);

}  // namespace toile::inspect
