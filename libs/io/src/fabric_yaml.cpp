#include "toile/io/fabric_yaml.h"

#include "toile/io/record_yaml.h"

namespace toile::io {

Result<fabric::Card> read_fabric(std::string_view yaml, const std::string& file) {
  TOILE_TRY(const fabric::Measured measured, read_record<fabric::Measured>(yaml, file));
  TOILE_TRY(fabric::Resolved resolved, fabric::resolve(measured));
  return std::move(resolved.card);
}

}  // namespace toile::io
