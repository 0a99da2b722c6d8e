// The soft top from its drawing: the pattern and its map are those that the skin of the frame gives, and the whole pipeline ends at rest.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "results.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/pattern_yaml.h"

using namespace toile;
using test::checked;
namespace fs = std::filesystem;

namespace {

std::string quoted(const std::string& text) { return "'" + text + "'"; }
std::string source(const std::string& name) { return quoted(std::string(TOILE_SOURCE_DIR) + "/" + name); }

struct Folder {
  explicit Folder(const std::string& name) : path(fs::temp_directory_path() / ("toile softtop " + name + " " + std::to_string(::getpid()))) { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  int run(const std::string& program, const std::string& arguments) const {
    return std::system(("cd " + quoted(path.string()) + " && " + quoted(std::string(TOILE_BIN_DIR) + "/" + program) + " " + arguments + " > log.txt 2>&1").c_str());
  }
  std::string log() const { return checked(io::read_file((path / "log.txt").string())); }
  std::string file(const std::string& name) const { return (path / name).string(); }
  fs::path path;
};

}  // namespace

TEST(softtop, its_pattern_comes_from_the_skin_of_its_frame) {
  const Folder folder("pattern");
  ASSERT_EQ(folder.run("toile-mechanism", source("samples/mechanisms/softtop.yaml") + " -o skin.ply --surface skin --skin.offset '8 mm' --skin.cell '30 mm'"), 0) << folder.log();
  ASSERT_EQ(folder.run("toile-flatten", "skin.ply --spec " + source("samples/reshaping/softtop.yaml") + " -o pattern.yaml --seams seams.yaml --map map.ply --ascii"), 0) << folder.log();
  const mesh::GarmentMesh now = checked(io::read_garment(folder.file("map.ply"))), kept = checked(io::read_garment(std::string(TOILE_SOURCE_DIR) + "/samples/reshaping/softtop_map.ply"));
  ASSERT_EQ(now.vertex_count(), kept.vertex_count());
  EXPECT_LT((now.x - kept.x).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((now.uv - kept.uv).cwiseAbs().maxCoeff(), 1e-6);
  const auto pattern = checked(io::parse_pattern(checked(io::read_file(folder.file("pattern.yaml"))), "pattern.yaml"));
  EXPECT_EQ(pattern.pieces.size(), 3u);
}

TEST(softtop, hangs_on_its_closed_frame) {
  const Folder folder("closed");
  ASSERT_EQ(folder.run("toile", "run " + source("pipelines/softtop/pipeline.yaml") + " fit --build build"), 0) << folder.log();
  const auto fit = nlohmann::json::parse(checked(io::read_file(folder.file("build/softtop/fit.json"))));
  EXPECT_TRUE(fit["converged"].get<bool>());
  EXPECT_EQ(fit["penetrating_vertices"], 0);
  EXPECT_EQ(fit["self_intersections"], 0);
  EXPECT_EQ(fit["support_intersections"], 0);
  EXPECT_LT(fit["max_strain_warp"].get<double>(), 0.01);
  EXPECT_LT(fit["max_strain_weft"].get<double>(), 0.03);
  EXPECT_NEAR(fit["mass"].get<double>(), 1.9296 * (0.28 + 0.42 + 0.16), 2e-3);
  // About the published size: 4,481 triangles.
  EXPECT_NEAR(fit["faces"].get<int>(), 4481, 0.02 * 4481);
}

TEST(softtop, opens_with_its_frame) {
  const Folder folder("opened");
  ASSERT_EQ(folder.run("toile", "run " + source("pipelines/softtop/pipeline.yaml") + " opened_fit --build build"), 0) << folder.log();
  const auto fit = nlohmann::json::parse(checked(io::read_file(folder.file("build/softtop/opened_fit.json"))));
  EXPECT_EQ(fit["penetrating_vertices"], 0);
  EXPECT_EQ(fit["self_intersections"], 0);
  EXPECT_EQ(fit["support_intersections"], 0);
  EXPECT_LT(fit["max_strain_warp"].get<double>(), 0.04);
  EXPECT_LT(fit["max_strain_weft"].get<double>(), 0.04);
  // The motor first lifts the cloth, then carries it.
  ASSERT_EQ(folder.run("toile", "run " + source("pipelines/softtop/pipeline.yaml") + " torque --build build"), 0) << folder.log();
  EXPECT_GT(checked(io::read_file(folder.file("build/softtop/torque.csv"))).size(), 1000u);
  EXPECT_TRUE(fs::exists(folder.file("build/softtop/torque.png")));
}
