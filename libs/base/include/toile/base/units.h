// Units at the edge of the system: text such as `0.7 gf*cm/deg` becomes an SI number.
#pragma once

#include "toile/base/result.h"

#include <array>
#include <string>
#include <string_view>

namespace toile {

/// A product of powers of base units and a factor to SI. Exponents in order: length [m], mass [kg], time [s], angle [rad].
struct Unit {
  double factor = 1.0;
  std::array<int, 4> exponents{};
  bool same_dimension(const Unit& other) const { return exponents == other.exponents; }
};

/// `mm`, `g/m2`, `gf*cm/deg`, `gf*cm^2/cm`, `%`, `1` (dimensionless).
/// error  Issue "unknown_unit"
Result<Unit> parse_unit(std::string_view text);

/// A number with a unit of the same dimension as `si_unit`, in SI. A bare number is accepted where `si_unit` is
/// dimensionless ("1" or "") or the number is zero.
/// error  Issue "bad_number", "missing_unit", "unknown_unit", "wrong_dimension"
Result<double> parse_quantity(std::string_view text, std::string_view si_unit);

/// Like parse_quantity, but a bare number means SI.
Result<double> parse_quantity_si(std::string_view text, std::string_view si_unit);

}  // namespace toile
