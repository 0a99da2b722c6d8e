// Pattern files: YAML by hand or by program (docs/pattern.md).
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "toile/base/result.h"
#include "toile/pattern/pattern.h"

namespace toile::io {

/// A pattern with the places of its parts in the file, by `piece` and `piece.part` as in the issues of pattern::check.
struct PatternFile {
  pattern::Pattern pattern;
  std::map<std::string, Place> places;
};

/// Reads the form only; all of unknown_key (with the nearest known one), missing_key, duplicate_key, wrong_type,
/// bad_number, bad_choice, unknown_point, bad_arc, bad_yaml are reported, with file:line:column.
Result<PatternFile> parse_pattern_file(std::string_view yaml, const std::string& file);
/// The same for those who want everything that is wrong at once: what could be read, and the issues.
struct PatternReading {
  PatternFile file;
  Issues issues;
};
PatternReading read_pattern_form(std::string_view yaml, const std::string& file);
/// pattern::check, each issue with its place in the file.
Issues check(const PatternFile& file);
/// pattern::advice, each with its place in the file.
Issues advice(const PatternFile& file);

/// Reads and checks.
Result<pattern::Pattern> parse_pattern(std::string_view yaml, const std::string& file);
Result<pattern::Pattern> read_pattern(const std::string& path);

/// The pattern as YAML; reading it back gives an equal pattern, bit by bit, where edges end exactly at their points
/// (those that end within the weld tolerance of them do so after reading).
std::string format_pattern(const pattern::Pattern& pattern);

}  // namespace toile::io
