// What tests do with results: take the value or stop, or list what was refused.
#pragma once

#include "toile/base/result.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace toile::test {

/// The value; throws with the first issue where there is none.
template <class T>
T checked(Result<T> result) {
  if (!result) throw std::runtime_error(to_string(result.issues().front()));
  return std::move(*result);
}

/// Codes of the issues in order, with blanks between; empty for a value. Every issue has to say a remedy.
template <class T>
std::string codes(const Result<T>& result) {
  std::string all;
  if (result) return all;
  for (const Issue& issue : result.issues()) {
    all += (all.empty() ? "" : " ") + issue.code;
    EXPECT_FALSE(issue.remedy.empty()) << to_string(issue);
  }
  return all;
}

}  // namespace toile::test
