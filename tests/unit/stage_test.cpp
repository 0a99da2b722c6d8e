#include <gtest/gtest.h>

#include <filesystem>

#include "garments.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

struct ShiftParams {
  double by = 0.01;
  struct Inner {
    int steps = 1;
    static void describe(auto& f) { f(&Inner::steps, {.key = "steps", .doc = "how many times", .min = 1, .max = 10}); }
  } inner;
  std::string log;
  static void describe(auto& f) {
    f(&ShiftParams::by, {.key = "by", .doc = "shift along x", .unit = "m", .min = -1, .max = 1});
    f(&ShiftParams::inner, {.key = "inner", .doc = "inner settings"});
    f(&ShiftParams::log, {.key = "log", .doc = "side file", .local = true});
  }
};

/// Moves a garment along x: the smallest stage there is.
struct ShiftStage {
  using Params = ShiftParams;
  static stage::Description description() {
    return {.name = "toile-shift", .version = 2, .summary = "Moves a garment.", .example = "toile-shift a.ply -o b.ply", .details = "", .inputs = {{"garment", "the garment", stage::FileKind::garment}, {"fabrics", "cards", stage::FileKind::fabric, false, true}}};
  }
  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(mesh::GarmentMesh garment, run.garment("garment"));
    garment.x.col(0).array() += params.by * params.inner.steps;
    stage::Output output;
    if (params.by > 0.5) return Issue{"too_far", {}, "too far", "stay near", Category::check};
    if (params.by < 0) output.findings.push_back({"backwards", {}, "moves backwards", "", Category::not_converged});
    if (params.by == 0.25) throw std::runtime_error("on purpose");
    if (params.by == 0.125) garment.faces(0, 0) = 1000;
    if (!params.log.empty()) output.side_files.push_back({params.log, "log\n"});
    run.report("vertices", static_cast<long long>(garment.vertex_count()));
    output.artefact = std::move(garment);
    return output;
  }
};

class stage_programs : public testing::Test {
 protected:
  void SetUp() override {
    folder = testing::TempDir() + "toile_stage_" + testing::UnitTest::GetInstance()->current_test_info()->name() + "/";
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    ASSERT_TRUE(io::write_file(folder + "in.ply", io::format_garment(test::two_panels(), io::Encoding::binary)).empty());
  }
  int call(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "toile-shift");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = stage::run_main<ShiftStage>(static_cast<int>(argv.size()), argv.data());
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return code;
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(folder + name); }
  std::string folder, out, err;
};

TEST_F(stage_programs, defaults_then_spec_then_command_line) {
  ASSERT_TRUE(io::write_file(folder + "spec.yaml", "by: 2 cm\ninner: {steps: 2}\n").empty());
  ASSERT_EQ(call({folder + "in.ply", "-o", folder + "a.ply"}), 0) << err;
  EXPECT_NEAR(io::read_garment(folder + "a.ply")->x(0, 0), 0.01, 1e-15);
  ASSERT_EQ(call({folder + "in.ply", "-o", folder + "b.ply", "--spec", folder + "spec.yaml"}), 0) << err;
  EXPECT_NEAR(io::read_garment(folder + "b.ply")->x(0, 0), 0.04, 1e-15);
  ASSERT_EQ(call({"--garment", folder + "in.ply", "-o", folder + "c.ply", "--spec", folder + "spec.yaml", "--inner.steps", "3", "--json"}), 0) << err;
  const auto c = io::read_garment(folder + "c.ply");
  EXPECT_NEAR(c->x(0, 0), 0.06, 1e-15);
  EXPECT_NE(out.find("\"ok\": true"), std::string::npos);
  ASSERT_EQ(c->route.size(), 1u);
  EXPECT_EQ(c->route[0].stage, "toile-shift");
  EXPECT_EQ(c->route[0].params, "{by: 0.02, inner: {steps: 3}}");
  EXPECT_EQ(c->route[0].inputs.at("garment").size(), 32u);
}

TEST_F(stage_programs, paths_and_threads_leave_no_trace_in_the_output) {
  std::filesystem::create_directories(folder + "other");
  std::filesystem::copy(folder + "in.ply", folder + "other/copy.ply");
  ASSERT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--threads", "1"}), 0);
  ASSERT_EQ(call({folder + "other/copy.ply", "-o", folder + "other/b.ply", "--threads", "5", "--log", folder + "log.txt"}), 0);
  EXPECT_EQ(*io::read_file(folder + "a.ply"), *io::read_file(folder + "other/b.ply"));
  EXPECT_TRUE(exists("log.txt"));
}

TEST_F(stage_programs, usage_mistakes_exit_with_2_and_write_nothing) {
  EXPECT_EQ(call({}), 2);
  EXPECT_NE(err.find("the input 'garment' is missing"), std::string::npos) << err;
  EXPECT_EQ(call({folder + "in.ply"}), 2);
  EXPECT_EQ(call({folder + "in.ply", "extra", "-o", folder + "a.ply"}), 2);
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--bye", "1 cm"}), 2);
  EXPECT_NE(err.find("did you mean '--by'"), std::string::npos) << err;
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--by", "1"}), 2);
  EXPECT_NE(err.find("'1 m'"), std::string::npos) << err;
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--inner.steps", "11"}), 2);
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--threads", "-1"}), 2);
  EXPECT_FALSE(exists("a.ply"));
}

TEST_F(stage_programs, bad_inputs_exit_with_3_and_name_the_place) {
  ASSERT_TRUE(io::write_file(folder + "bad.yaml", "by: 1 cm\nstepz: 3\n").empty());
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--spec", folder + "bad.yaml"}), 3);
  EXPECT_NE(err.find("bad.yaml:2:1: unknown key 'stepz'"), std::string::npos) << err;
  EXPECT_EQ(call({folder + "none.ply", "-o", folder + "a.ply"}), 3);
  EXPECT_EQ(call({folder + "bad.yaml", "-o", folder + "a.ply"}), 3);
  EXPECT_EQ(call({folder + "bad.yaml", "-o", folder + "a.ply", "--check"}), 3);
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "missing/a.ply"}), 3);
  EXPECT_EQ(call({folder + "bad.yaml", "-o", folder + "a.ply", "--json"}), 3);
  EXPECT_NE(out.find("\"code\":"), std::string::npos) << out;
  EXPECT_FALSE(exists("a.ply"));
}

TEST_F(stage_programs, checks_findings_and_faults_have_their_own_codes) {
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--by", "60 cm"}), 4);
  EXPECT_FALSE(exists("a.ply"));
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "a.ply", "--by", "-1 cm"}), 5);
  EXPECT_TRUE(exists("a.ply"));
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "b.ply", "--by", "25 cm"}), 1);
  EXPECT_EQ(call({folder + "in.ply", "-o", folder + "b.ply", "--by", "12.5 cm"}), 1);
  EXPECT_NE(err.find("the result is invalid"), std::string::npos) << err;
  EXPECT_FALSE(exists("b.ply"));
}

TEST_F(stage_programs, texts_about_themselves) {
  EXPECT_EQ(call({"--help"}), 0);
  EXPECT_NE(out.find("--inner.steps INT"), std::string::npos) << out;
  EXPECT_NE(out.find("Exit codes"), std::string::npos);
  EXPECT_EQ(call({"--version"}), 0);
  EXPECT_EQ(call({"--schema"}), 0);
  EXPECT_NE(out.find("\"additionalProperties\": false"), std::string::npos);
  EXPECT_EQ(call({"--docs"}), 0);
  EXPECT_NE(out.find("| `inner.steps` | `1` |"), std::string::npos) << out;
  EXPECT_EQ(call({"--dump-spec"}), 0);
  ASSERT_TRUE(io::write_file(folder + "dumped.yaml", out).empty());
  EXPECT_EQ(call({folder + "in.ply", "--check", "--spec", folder + "dumped.yaml"}), 0) << err;
}

}  // namespace
