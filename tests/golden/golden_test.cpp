// Runs every tests/golden/STAGE/CASE/case.yaml: the program as a user calls it, at 1, 2 and 5 threads, against the
// expected file beside it. With TOILE_UPDATE_GOLDEN=1 changed results replace the expected ones, but only where the
// stage's version was raised (or nothing was there yet).
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

using namespace toile;
namespace fs = std::filesystem;

namespace {

struct Case {
  std::string tool;
  std::vector<std::string> args;
  int exit = 0;
  std::string message;
  std::string expected;
  static void describe(auto& f) {
    f(&Case::tool, {.key = "tool", .doc = "program", .required = true});
    f(&Case::args, {.key = "args", .doc = "its arguments; files are relative to the case's folder"});
    f(&Case::exit, {.key = "exit", .doc = "exit code", .min = 0, .max = 255});
    f(&Case::message, {.key = "message", .doc = "must stand in what the program prints"});
    f(&Case::expected, {.key = "expected", .doc = "expected output file; none: no output may be left"});
  }
};

std::vector<std::string> case_folders() {
  std::vector<std::string> folders;
  const fs::path root = fs::path(TOILE_SOURCE_DIR) / "tests" / "golden";
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().filename() == "case.yaml") folders.push_back(fs::relative(entry.path().parent_path(), root));
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// Of the stage that wrote a garment or support last; -1 for what is neither.
int version_of(const std::string& file) {
  if (const auto garment = io::read_garment(file)) return garment->route.back().version;
  if (const auto support = io::read_support(file)) return support->route.back().version;
  return -1;
}

class golden : public testing::TestWithParam<std::string> {};

TEST_P(golden, program_gives_what_is_expected) {
  const fs::path folder = fs::path(TOILE_SOURCE_DIR) / "tests" / "golden" / GetParam();
  const std::string case_file = (folder / "case.yaml").string();
  const auto text = io::read_file(case_file);
  ASSERT_TRUE(text);
  const auto row = io::read_record<Case>(*text, case_file);
  ASSERT_TRUE(row) << to_string(row.issues().front());

  const fs::path work = fs::path(testing::TempDir()) / "toile_golden" / GetParam();
  fs::remove_all(work);
  fs::create_directories(work);
  const std::string extension = row->expected.empty() ? ".out" : fs::path(row->expected).extension().string();
  std::string first;
  for (const int threads : {1, 2, 5}) {
    const std::string output = (work / (std::to_string(threads) + extension)).string();
    const std::string log = (work / "log.txt").string();
    std::string command = "cd " + quoted(folder) + " && " + quoted(std::string(TOILE_BIN_DIR) + "/" + row->tool);
    for (const std::string& word : row->args) command += " " + quoted(word);
    command += " -o " + quoted(output) + " --ascii --threads " + std::to_string(threads) + " > " + quoted(log) + " 2>&1";
    const int status = std::system(command.c_str());
    const auto printed = io::read_file(log);
    ASSERT_TRUE(WIFEXITED(status)) << command;
    ASSERT_EQ(WEXITSTATUS(status), row->exit) << command << "\n" << *printed;
    EXPECT_NE(printed->find(row->message), std::string::npos) << *printed;
    if (row->expected.empty()) {
      EXPECT_FALSE(fs::exists(output)) << "a failing program left an output";
      continue;
    }
    const auto bytes = io::read_file(output);
    ASSERT_TRUE(bytes) << to_string(bytes.issues().front());
    if (threads == 1) first = *bytes;
    EXPECT_EQ(*bytes == first, true) << "the result depends on the number of threads";
  }
  if (row->expected.empty()) return;

  const std::string expected = (folder / row->expected).string();
  const std::string result = (work / ("1" + extension)).string();
  const std::string diff = quoted(std::string(TOILE_BIN_DIR) + "/toile-diff") + " " + quoted(expected) + " " + quoted(result);
  if (std::getenv("TOILE_UPDATE_GOLDEN")) {
    if (fs::exists(expected) && *io::read_file(expected) == first) return;
    if (fs::exists(expected) && extension == ".ply") {
      ASSERT_NE(version_of(expected), version_of(result)) << "the result changed: raise the stage's version before updating " << expected;
      std::system(diff.c_str());
    }
    ASSERT_TRUE(io::write_file(expected, first).empty());
    return;
  }
  ASSERT_TRUE(fs::exists(expected)) << "make it with TOILE_UPDATE_GOLDEN=1";
  // Numbers and pictures may differ in their last places between processors.
  if (extension == ".ply" || extension == ".json" || extension == ".png") {
    EXPECT_EQ(std::system(diff.c_str()), 0) << diff;
  } else {
    EXPECT_EQ(first, *io::read_file(expected));
  }
}

INSTANTIATE_TEST_SUITE_P(cases, golden, testing::ValuesIn(case_folders()), [](const auto& info) {
  std::string name = info.param;
  std::replace_if(name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
});
// No case yet is not a failure of the driver.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(golden);

}  // namespace
