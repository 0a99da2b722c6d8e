#pragma once

#include <string_view>

namespace toile::inspect {

enum class Artefact { garment, support, json, png, other };

/// What a file is, from its first lines.
Artefact artefact_kind(std::string_view bytes);

}  // namespace toile::inspect
