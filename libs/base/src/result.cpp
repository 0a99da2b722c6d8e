#include "toile/base/result.h"

namespace toile {

std::string to_string(const Issue& issue) {
  std::string text;
  if (!issue.place.file.empty()) {
    text += issue.place.file;
    if (issue.place.line > 0) text += fmt::format(":{}", issue.place.line);
    if (issue.place.line > 0 && issue.place.column > 0) text += fmt::format(":{}", issue.place.column);
    text += ": ";
  }
  if (!issue.place.item.empty()) text += issue.place.item + ": ";
  text += issue.what;
  if (!issue.remedy.empty()) text += "; " + issue.remedy;
  return text;
}

void check_failed(const char* file, int line, const char* condition, const std::string& values) {
  throw CheckFailed(fmt::format("{}:{}: check failed: {} ({})", file, line, condition, values));
}

}  // namespace toile
