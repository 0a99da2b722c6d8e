#include <gtest/gtest.h>

#include <filesystem>

#include "toile/io/file.h"
#include "toile/io/record_yaml.h"
#include "toile/stage/pipeline.h"

using namespace toile;
namespace fs = std::filesystem;

namespace {

Result<stage::ToolInfo> tools(const std::string& name) {
  if (name == "toile-mesh") return stage::ToolInfo{"/bin/toile-mesh", ".ply", {{"pattern", true, false}}};
  if (name == "toile-sew") return stage::ToolInfo{"/bin/toile-sew", ".ply", {{"garment", true, false}}};
  if (name == "toile-layer") return stage::ToolInfo{"/bin/toile-layer", ".ply", {{"garment", true, false}, {"fabrics", true, true}}};
  return Issue{"unknown_tool", {}, "there is no program '" + name + "'", "did you mean 'toile-mesh'?"};
}

class pipeline_plans : public testing::Test {
 protected:
  void SetUp() override {
    // A path with a space, as people have them; one for each test, since they run side by side.
    folder = testing::TempDir() + "toile_" + testing::UnitTest::GetInstance()->current_test_info()->name() + "/toile pipeline/";
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const char* file : {"pattern.yaml", "seams.yaml", "card.yaml"}) ASSERT_TRUE(io::write_file(folder + file, "").empty());
  }
  Result<stage::Plan> plan(const std::string& yaml) {
    auto pipeline = io::read_record<stage::Pipeline>(yaml, "pipeline.yaml");
    if (!pipeline) return pipeline.issues();
    return stage::make_plan(*pipeline, "pipeline.yaml", folder, "/build", tools);
  }
  std::string folder;
};

const char* const good =
    "garment: tee\ninputs: {pattern: pattern.yaml, card: card.yaml}\nstages:\n"
    "  sewn: {tool: toile-sew, in: {garment: panels}, spec: seams.yaml}\n"
    "  panels: {tool: toile-mesh, in: {pattern: $pattern}, set: {cell: 8 mm}}\n"
    "  layered: {tool: toile-layer, in: {garment: sewn, fabrics: [$card, $card]}}\n";

TEST_F(pipeline_plans, order_stages_and_know_what_each_needs) {
  const auto result = plan(good);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  ASSERT_EQ(result->steps.size(), 3u);
  EXPECT_EQ(result->steps[0].stage, "panels");
  EXPECT_EQ(result->steps[1].stage, "sewn");
  EXPECT_EQ(result->steps[2].stage, "layered");
  EXPECT_EQ(result->steps[1].needs, (std::vector<std::string>{"/bin/toile-sew", "/build/tee/panels.ply", folder + "seams.yaml"}));
  EXPECT_EQ(result->steps[0].command, (std::vector<std::string>{"/bin/toile-mesh", "--pattern", folder + "pattern.yaml", "--cell", "8 mm", "-o", "/build/tee/panels.ply"}));
  const std::string rules = stage::make_rules(*result);
  EXPECT_NE(rules.find("toile\\ pipeline/pattern.yaml"), std::string::npos) << rules;
  EXPECT_NE(rules.find("--cell '8 mm'"), std::string::npos) << rules;
}

TEST_F(pipeline_plans, name_every_mistake) {
  const struct {
    const char* from;
    const char* to;
    const char* code;
  } rows[] = {
      {"toile-mesh", "toile-mehs", "unknown_tool"},       {"garment: panels", "garment: panel", "unknown_reference"}, {"$pattern", "$patern", "unknown_reference"},
      {"{pattern: $", "{patern: $", "unknown_port"},       {"{garment: panels}", "{}", "missing_port"},                {"{pattern: $pattern}", "{pattern: sewn}", "cycle"},
      {"seams.yaml", "seam.yaml", "missing_file"},         {"pattern: pattern.yaml", "pattern: p.yaml", "missing_file"}, {"garment: tee", "garment: ../tee", "bad_name"},
      {"{garment: panels}", "{garment: [panels, panels]}", "wrong_count"},
  };
  for (const auto& row : rows) {
    std::string yaml = good;
    yaml.replace(yaml.find(row.from), std::string(row.from).size(), row.to);
    const auto result = plan(yaml);
    ASSERT_FALSE(result) << row.to;
    EXPECT_EQ(result.issues().front().code, row.code) << to_string(result.issues().front());
  }
}

}  // namespace
