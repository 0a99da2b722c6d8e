#include "toile/base/units.h"

#include "toile/base/text.h"

#include <cctype>
#include <numbers>

namespace toile {
namespace {

struct NamedUnit {
  const char* name;
  double factor;
  std::array<int, 4> exponents;
};

constexpr double gram_force = 9.80665e-3;  // N, by definition of standard gravity
constexpr double degree = std::numbers::pi / 180;

constexpr NamedUnit named_units[] = {
    {"m", 1, {1, 0, 0, 0}},           {"mm", 1e-3, {1, 0, 0, 0}},        {"cm", 1e-2, {1, 0, 0, 0}},
    {"um", 1e-6, {1, 0, 0, 0}},       {"in", 0.0254, {1, 0, 0, 0}},      {"kg", 1, {0, 1, 0, 0}},
    {"g", 1e-3, {0, 1, 0, 0}},        {"mg", 1e-6, {0, 1, 0, 0}},        {"oz", 28.349523125e-3, {0, 1, 0, 0}},
    {"s", 1, {0, 0, 1, 0}},           {"ms", 1e-3, {0, 0, 1, 0}},        {"min", 60, {0, 0, 1, 0}},
    {"rad", 1, {0, 0, 0, 1}},         {"deg", degree, {0, 0, 0, 1}},     {"N", 1, {1, 1, -2, 0}},
    {"mN", 1e-3, {1, 1, -2, 0}},      {"uN", 1e-6, {1, 1, -2, 0}},       {"gf", gram_force, {1, 1, -2, 0}},
    {"kgf", 9.80665, {1, 1, -2, 0}},  {"Pa", 1, {-1, 1, -2, 0}},         {"kPa", 1e3, {-1, 1, -2, 0}},
    {"J", 1, {2, 1, -2, 0}},          {"mJ", 1e-3, {2, 1, -2, 0}},       {"Hz", 1, {0, 0, -1, 0}},
    {"kN", 1e3, {1, 1, -2, 0}},       {"cN", 1e-2, {1, 1, -2, 0}},       {"MPa", 1e6, {-1, 1, -2, 0}},
    {"GPa", 1e9, {-1, 1, -2, 0}},
    {"%", 1e-2, {0, 0, 0, 0}},        {"1", 1, {0, 0, 0, 0}},            {"yd", 0.9144, {1, 0, 0, 0}},
};

Issue unit_issue(std::string code, std::string what, std::string remedy) {
  return Issue{std::move(code), {}, std::move(what), std::move(remedy)};
}

/// Splits `8 mm` into the number and the unit text.
std::pair<std::string_view, std::string_view> split_quantity(std::string_view text) {
  text = trim(text);
  std::size_t end = 0;
  while (end < text.size()) {
    const char c = text[end];
    const bool exponent_sign = (c == '+' || c == '-') && end > 0 && (text[end - 1] == 'e' || text[end - 1] == 'E');
    const bool exponent = (c == 'e' || c == 'E') && end + 1 < text.size() &&
                          (std::isdigit(static_cast<unsigned char>(text[end + 1])) || text[end + 1] == '-' || text[end + 1] == '+');
    if (!(std::isdigit(static_cast<unsigned char>(c)) || c == '.' || exponent || exponent_sign || (end == 0 && (c == '-' || c == '+')))) break;
    ++end;
  }
  return {text.substr(0, end), trim(text.substr(end))};
}

Result<double> parse(std::string_view text, std::string_view si_unit, bool bare_is_si) {
  const auto [number_text, unit_text] = split_quantity(text);
  const auto number = parse_number(number_text);
  if (!number) {
    return unit_issue("bad_number", fmt::format("'{}' is not a number", text),
                      si_unit.empty() || si_unit == "1" ? "write a plain number" : fmt::format("write a number with a unit of the dimension {}", si_unit));
  }
  const auto target = parse_unit(si_unit);
  TOILE_CHECK(target.has_value(), "declared unit '{}'", si_unit);
  if (unit_text.empty()) {
    const bool dimensionless = target->exponents == std::array<int, 4>{};
    if (dimensionless || *number == 0 || bare_is_si) return *number;
    return unit_issue("missing_unit", fmt::format("'{}' has no unit", text), fmt::format("write it with one, such as '{} {}'", number_text, si_unit));
  }
  const auto unit = parse_unit(unit_text);
  if (!unit) return unit.issues();
  if (!unit->same_dimension(*target)) {
    return unit_issue("wrong_dimension", fmt::format("'{}' is not of the dimension {}", text, si_unit.empty() ? "1" : si_unit), "give a matching unit");
  }
  return *number * unit->factor / target->factor;
}

}  // namespace

Result<Unit> parse_unit(std::string_view text) {
  Unit unit;
  std::string_view rest = trim(text);
  if (rest.empty()) return unit;
  int sign = 1;
  while (true) {
    std::size_t end = rest.find_first_of("*/");
    std::string_view factor = trim(rest.substr(0, end));
    std::size_t name_end = 0;
    while (name_end < factor.size() && (std::isalpha(static_cast<unsigned char>(factor[name_end])) || factor[name_end] == '%')) ++name_end;
    if (name_end == 0 && factor == "1") name_end = 1;
    std::string_view name = factor.substr(0, name_end);
    std::string_view power_text = factor.substr(name_end);
    if (!power_text.empty() && power_text.front() == '^') power_text.remove_prefix(1);
    const auto power = power_text.empty() ? std::optional<long long>(1) : parse_integer(power_text);
    const NamedUnit* found = nullptr;
    for (const NamedUnit& candidate : named_units) {
      if (name == candidate.name) found = &candidate;
    }
    if (!found || !power || *power < -9 || *power > 9) {
      std::vector<std::string> names;
      for (const NamedUnit& candidate : named_units) names.emplace_back(candidate.name);
      return unit_issue("unknown_unit", fmt::format("unknown unit '{}'", text), suggestion(name, names));
    }
    for (long long i = 0; i < std::abs(*power); ++i) {
      const int direction = *power < 0 ? -sign : sign;
      unit.factor = direction > 0 ? unit.factor * found->factor : unit.factor / found->factor;
      for (std::size_t k = 0; k < 4; ++k) unit.exponents[k] += direction * found->exponents[k];
    }
    if (end == std::string_view::npos) return unit;
    if (rest[end] == '/') sign = -1;
    else sign = 1;
    rest = rest.substr(end + 1);
  }
}

Result<double> parse_quantity(std::string_view text, std::string_view si_unit) { return parse(text, si_unit, false); }
Result<double> parse_quantity_si(std::string_view text, std::string_view si_unit) { return parse(text, si_unit, true); }

}  // namespace toile
