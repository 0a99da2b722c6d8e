#include "toile/lab/experiments.h"

#include <algorithm>

#include "bench_setup.h"

namespace toile::lab {
namespace {

std::vector<Experiment> all(const Scope& scope) {
  std::vector<Experiment> result = bending_tests(scope);
  for (auto* tests : {&membrane_tests, &seam_tests, &shape_tests}) {
    for (Experiment& e : tests(scope)) result.push_back(std::move(e));
  }
  for (Experiment& e : result) {
    // Name, title and text of an experiment are those of its section.
    e.judge = [inner = e.judge, test = e.test, title = e.title, about = e.about](const std::vector<Outcome>& outcomes) {
      Section section = inner(outcomes);
      section.test = test;
      section.title = title;
      section.about = about;
      return section;
    };
  }
  return result;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> test_names() {
  std::vector<std::pair<std::string, std::string>> names;
  for (const Experiment& e : all({})) names.emplace_back(e.test, e.title);
  return names;
}

std::vector<Experiment> experiments(const Scope& scope, const std::vector<std::string>& only) {
  std::vector<Experiment> result = all(scope);
  if (!only.empty()) std::erase_if(result, [&](const Experiment& e) { return std::find(only.begin(), only.end(), e.test) == only.end(); });
  return result;
}

}  // namespace toile::lab
