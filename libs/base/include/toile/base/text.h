// Numbers as text, exactly and without locale; spelling suggestions.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace toile {

/// Shortest text that reads back to the same double (std::to_chars).
std::string format_number(double value);
/// The whole text as a number; nothing else may stand before or after. Refuses nan and inf.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);

/// The candidate nearest to `word` in edit distance if it is near enough to be a likely misspelling.
std::optional<std::string> nearest_word(std::string_view word, std::span<const std::string> candidates);
/// `did you mean 'x'?`, or `known: a, b, c` when nothing is near.
std::string suggestion(std::string_view word, std::span<const std::string> candidates);

std::vector<std::string> split(std::string_view text, char separator);
std::string_view trim(std::string_view text);

}  // namespace toile
