#include "toile/inspect/artefact.h"

namespace toile::inspect {

Artefact artefact_kind(std::string_view bytes) {
  const std::string_view head = bytes.substr(0, 1000);
  if (head.starts_with("\x89PNG")) return Artefact::png;
  if (head.starts_with("{") || head.starts_with("[")) return Artefact::json;
  if (!head.starts_with("ply")) return Artefact::other;
  if (head.find("\ncomment toile-garment ") != std::string_view::npos) return Artefact::garment;
  if (head.find("\ncomment toile-support ") != std::string_view::npos) return Artefact::support;
  return Artefact::other;
}

}  // namespace toile::inspect
