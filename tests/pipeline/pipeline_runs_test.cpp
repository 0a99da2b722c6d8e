// Garments end to end with the real programs, on a coarse grid: results, what runs again, kills and restarts, installed
// programs outside the repository, a program that links the package.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "toile/io/file.h"

using namespace toile;
namespace fs = std::filesystem;

namespace {

int shell(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// A garment folder of a user's own: the tee's pipeline and specs, copied beside the samples they name, on a coarse grid.
class pipeline_runs : public testing::Test {
 protected:
  void SetUp() override {
    root = fs::path(testing::TempDir()) / ("toile_run_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(root);
    fs::create_directories(root / "pipelines");
    const fs::path source = TOILE_SOURCE_DIR;
    fs::copy(source / "samples", root / "samples", fs::copy_options::recursive);
    fs::copy(source / "pipelines" / "tee", root / "pipelines" / "tee", fs::copy_options::recursive);
    replace("mesh.yaml", "cell: 10 mm", "cell: 20 mm");
  }
  void replace(const std::string& file, const std::string& from, const std::string& to) {
    const std::string path = (root / "pipelines" / "tee" / file).string();
    std::string text = *io::read_file(path);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " in " << file;
    ASSERT_TRUE(io::write_file(path, text.replace(at, from.size(), to)).empty());
  }
  std::string command(const std::string& build, const std::string& more = "", const std::string& bin = TOILE_BIN_DIR) const {
    return bin + "/toile run " + (root / "pipelines/tee").string() + " --build " + (root / build).string() + " " + more + " > " + (root / "log.txt").string() + " 2>&1";
  }
  std::string log() const { return *io::read_file((root / "log.txt").string()); }
  std::map<std::string, std::string> contents(const std::string& build) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::directory_iterator(root / build / "tee")) {
      const std::string name = entry.path().filename();
      if (name[0] != '.' && name != "rules.mk") files[name] = *io::read_file(entry.path().string());
    }
    return files;
  }
  std::map<std::string, fs::file_time_type> times(const std::string& build) const {
    std::map<std::string, fs::file_time_type> result;
    for (const auto& [name, bytes] : contents(build)) result[name] = fs::last_write_time(root / build / "tee" / name);
    return result;
  }
  fs::path root;
};

TEST_F(pipeline_runs, only_what_a_change_concerns_runs_again) {
  ASSERT_EQ(shell(command("a")), 0) << log();
  const auto first = times("a");
  ASSERT_EQ(shell(command("a")), 0) << log();
  EXPECT_EQ(times("a"), first) << "a second run made something again";

  // A touched spec: its stage and those after it.
  fs::last_write_time(root / "pipelines/tee/simulation.yaml", fs::file_time_type::clock::now());
  ASSERT_EQ(shell(command("a")), 0) << log();
  std::set<std::string> again;
  for (const auto& [name, time] : times("a")) {
    if (time != first.at(name)) again.insert(name);
  }
  EXPECT_EQ(again, (std::set<std::string>{"draped.ply", "fit.json", "front.png", "side.png", "back.png", "strain.png"}));

  // Two jobs at a time in another folder: the same bytes.
  ASSERT_EQ(shell(command("b", "-j 2")), 0) << log();
  EXPECT_EQ(contents("a"), contents("b"));
}

TEST_F(pipeline_runs, a_run_killed_anywhere_and_started_again_gives_the_same_bytes) {
  ASSERT_EQ(shell(command("whole", "draped")), 0) << log();
  int kills = 0;
  for (int attempt = 0; attempt < 40; ++attempt) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::setpgid(0, 0);
      ::execl("/bin/sh", "sh", "-c", command("killed", "draped").c_str(), nullptr);
      ::_exit(127);
    }
    ::setpgid(child, child);
    // Longer at each attempt, so that every stage is hit on its way.
    std::this_thread::sleep_for(std::chrono::milliseconds(60 + 260 * attempt));
    int status = 0;
    if (::waitpid(child, &status, WNOHANG) == child) break;
    ::kill(-child, SIGKILL);
    ::waitpid(child, &status, 0);
    ++kills;
  }
  EXPECT_GE(kills, 3);
  ASSERT_EQ(shell(command("killed", "draped")), 0) << log();
  auto killed = contents("killed");
  std::erase_if(killed, [](const auto& item) { return item.first.ends_with(".part"); });
  EXPECT_EQ(killed, contents("whole"));
}

TEST_F(pipeline_runs, failures_carry_the_exit_code_of_the_stage_and_keep_its_result) {
  replace("seams.yaml", "front.side]", "front.sied]");
  EXPECT_EQ(shell(command("a")), 3);
  EXPECT_NE(log().find("did you mean"), std::string::npos) << log();
  EXPECT_FALSE(fs::exists(root / "a/tee/sewn.ply"));
  replace("seams.yaml", "front.sied]", "front.side]");
  replace("pipeline.yaml", "toile-sew,", "toile-sow,");
  EXPECT_EQ(shell(command("a")), 3);
  EXPECT_NE(log().find("did you mean 'toile-sew'"), std::string::npos) << log();
  replace("pipeline.yaml", "toile-sow,", "toile-sew,");
  EXPECT_EQ(shell(command("a", "drapd")), 2);
  EXPECT_EQ(shell(std::string(TOILE_BIN_DIR) + "/toile meash 2> /dev/null"), 2);
}

TEST_F(pipeline_runs, installed_programs_work_outside_the_repository_and_the_package_links) {
  const std::string prefix = (root / "prefix").string();
  const std::string build_folder = fs::path(TOILE_BIN_DIR).parent_path();
  ASSERT_EQ(shell("cmake --install " + build_folder + " --prefix " + prefix + " > " + (root / "log.txt").string() + " 2>&1"), 0) << log();
  ASSERT_EQ(shell("cd / && " + command("installed", "layered", prefix + "/bin")), 0) << log();
  ASSERT_EQ(shell(command("built", "layered")), 0) << log();
  EXPECT_EQ(contents("installed"), contents("built"));

  // The example of docs/embedding.md, as it stands there.
  const std::string page = *io::read_file(std::string(TOILE_SOURCE_DIR) + "/docs/embedding.md");
  const auto block = [&](const std::string& language) {
    const auto begin = page.find("```" + language + "\n") + language.size() + 4;
    return page.substr(begin, page.find("```", begin) - begin);
  };
  fs::create_directories(root / "app");
  ASSERT_TRUE(io::write_file((root / "app/CMakeLists.txt").string(), block("cmake")).empty());
  ASSERT_TRUE(io::write_file((root / "app/app.cpp").string(), block("cpp")).empty());
  const std::string app = (root / "app").string();
  ASSERT_EQ(shell("(cmake -S " + app + " -B " + app + "/build -DCMAKE_PREFIX_PATH=" + prefix + " && cmake --build " + app + "/build) > " + (root / "log.txt").string() + " 2>&1"), 0) << log();
  EXPECT_EQ(shell(app + "/build/app " + (root / "installed/tee/layered.ply").string() + " > " + (root / "log.txt").string() + " 2>&1"), 0) << log();
  EXPECT_TRUE(log().starts_with("4 panels, 0.08")) << log();
}

TEST_F(pipeline_runs, from_a_coarse_grid_to_a_fine_one) {
  const std::string file = (root / "pipelines/tee/pipeline.yaml").string();
  ASSERT_TRUE(io::write_file(file, R"(garment: tee
inputs:
  pattern: ../../samples/patterns/tee.yaml
  measurements: ../../samples/measurements/man178.yaml
  shirting: ../../samples/fabrics/shirting.yaml
stages:
  form:           {tool: toile-form,   in: {measurements: $measurements}, spec: form.yaml}
  panels:         {tool: toile-mesh,   in: {pattern: $pattern}, spec: mesh.yaml}
  sewn:           {tool: toile-sew,    in: {garment: panels}, spec: seams.yaml}
  layered:        {tool: toile-layer,  in: {garment: sewn, fabrics: $shirting}, spec: layers.yaml}
  coarse_panels:  {tool: toile-mesh,   in: {pattern: $pattern}, spec: mesh.yaml, set: {scale: 2}}
  coarse_sewn:    {tool: toile-sew,    in: {garment: coarse_panels}, spec: seams.yaml}
  coarse_layered: {tool: toile-layer,  in: {garment: coarse_sewn, fabrics: $shirting}, spec: layers.yaml}
  coarse_placed:  {tool: toile-place,  in: {garment: coarse_layered, support: form}, spec: placement.yaml}
  placed:         {tool: toile-refine, in: {garment: layered, coarse: coarse_placed, support: form}}
results: [placed]
)").empty());
  ASSERT_EQ(shell(command("a")), 0) << log();
  const std::string placed = (root / "a/tee/placed.ply").string(), form = (root / "a/tee/form.ply").string();
  const std::string bin = TOILE_BIN_DIR, to_log = " > " + (root / "log.txt").string() + " 2>&1";
  EXPECT_EQ(shell(bin + "/toile-lint " + placed + " --strict true" + to_log), 0) << log();
  // Refined once more onto its own grid it stays as it is, clear of itself and of the form.
  EXPECT_EQ(shell(bin + "/toile-refine " + (root / "a/tee/layered.ply").string() + " " + placed + " --support " + form + " -o " + (root / "again.ply").string() + to_log), 0);
  for (const char* fact : {"vertices_outside: 0\n", "vertices_moved_out: 0\n", "\nself_intersections: 0\n", "support_intersections: 0\n"})
    EXPECT_NE(log().find(fact), std::string::npos) << fact << log();
  EXPECT_EQ(shell(bin + "/toile-diff " + placed + " " + (root / "again.ply").string() + to_log), 0) << log();
}

TEST(samples, have_neither_faults_nor_doubtful_places) {
  const std::string log = testing::TempDir() + "toile_lint.txt";
  for (const auto& entry : fs::directory_iterator(fs::path(TOILE_SOURCE_DIR) / "samples" / "patterns")) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_EQ(shell(std::string(TOILE_BIN_DIR) + "/toile-lint " + entry.path().string() + " --strict true > " + log + " 2>&1"), 0) << *io::read_file(log);
  }
}

TEST(documentation, pages_of_programs_are_as_the_programs_print_them) {
  for (const auto& entry : fs::directory_iterator(TOILE_BIN_DIR)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("toile-")) continue;
    const std::string page = testing::TempDir() + name + ".md";
    ASSERT_EQ(shell(entry.path().string() + " --docs > " + page), 0);
    const auto committed = io::read_file(std::string(TOILE_SOURCE_DIR) + "/docs/stages/" + name.substr(6) + ".md");
    ASSERT_TRUE(committed) << "run `make docs`";
    EXPECT_EQ(*committed == *io::read_file(page), true) << name << ": run `make docs` and commit";
  }
}

}  // namespace
