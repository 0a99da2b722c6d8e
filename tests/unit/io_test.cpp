#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>

#include "garments.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"

using namespace toile;

namespace {

enum class Diagonal { single, alternating };

struct Override {
  std::string panel;
  double cell = 0.01;
  static void describe(auto& f) {
    f(&Override::panel, {.key = "panel", .doc = "panel name", .required = true});
    f(&Override::cell, {.key = "cell", .doc = "grid size", .unit = "m", .min = 1e-4, .max = 1});
  }
};

struct Spec {
  double cell = 0.01;
  int count = 3;
  Diagonal diagonal = Diagonal::alternating;
  std::vector<Override> panels;
  std::map<std::string, double> ease;
  std::optional<double> limit;
  std::array<double, 3> gravity{0, -9.81, 0};
  bool press = false;
  std::string note;
  static void describe(auto& f) {
    f(&Spec::cell, {.key = "cell", .doc = "grid size", .unit = "m", .min = 1e-4, .max = 1});
    f(&Spec::count, {.key = "count", .doc = "how many", .min = 0, .max = 100});
    f(&Spec::diagonal, {.key = "diagonal", .doc = "diagonal rule"});
    f(&Spec::panels, {.key = "panels", .doc = "single panels"});
    f(&Spec::ease, {.key = "ease", .doc = "ease by seam", .unit = "m"});
    f(&Spec::limit, {.key = "limit", .doc = "strain limit", .unit = "1", .min = 0});
    f(&Spec::gravity, {.key = "gravity", .doc = "gravity", .unit = "m/s2"});
    f(&Spec::press, {.key = "press", .doc = "press the seams"});
    f(&Spec::note, {.key = "note", .doc = "free text"});
    f.check([](const Spec& spec, Issues& issues) {
      if (spec.press && spec.count == 0) issues.push_back({"nothing_to_press", {.item = "count"}, "press needs a count", "raise count"});
    });
  }
};

}  // namespace

template <>
struct toile::Choices<Diagonal> {
  static constexpr std::array names{std::pair{"single", Diagonal::single}, std::pair{"alternating", Diagonal::alternating}};
};

namespace {

TEST(record_yaml, reads_every_kind_with_units) {
  const auto spec = io::read_record<Spec>(
      "cell: 8 mm\ncount: 5\ndiagonal: single\npanels:\n  - {panel: front, cell: 1 cm}\nease: {cap: 7 mm}\nlimit: 3 %\n"
      "gravity: [0, -1 m/s2, 0]\npress: true\nnote: \"a: b\"\n",
      "spec.yaml");
  ASSERT_TRUE(spec) << to_string(spec.issues().front());
  EXPECT_DOUBLE_EQ(spec->cell, 0.008);
  EXPECT_EQ(spec->count, 5);
  EXPECT_EQ(spec->diagonal, Diagonal::single);
  ASSERT_EQ(spec->panels.size(), 1u);
  EXPECT_DOUBLE_EQ(spec->panels[0].cell, 0.01);
  EXPECT_DOUBLE_EQ(spec->ease.at("cap"), 0.007);
  EXPECT_DOUBLE_EQ(spec->limit.value(), 0.03);
  EXPECT_DOUBLE_EQ(spec->gravity[1], -1);
  EXPECT_TRUE(spec->press);
  EXPECT_EQ(spec->note, "a: b");
}

TEST(record_yaml, written_specs_read_back_identically) {
  Spec spec;
  spec.cell = 1.0 / 3 * 0.01;
  spec.panels = {{"front", 0.02}, {"back panel", 0.003}};
  spec.ease = {{"cap", 0.1}, {"1", 0.2}};
  spec.limit = 0.1;
  spec.note = "quote \" and\nline: yes #no";
  const std::string canonical = io::flow_yaml(spec);
  for (const std::string& text : {canonical, io::block_yaml(spec), io::commented_yaml(spec)}) {
    const auto back = io::read_record<Spec>(text, "spec.yaml", io::Units::si);
    ASSERT_TRUE(back) << to_string(back.issues().front()) << text;
    EXPECT_EQ(io::flow_yaml(*back), canonical);
  }
}

struct BadSpec {
  const char* yaml;
  const char* code;
  int line, column;
  const char* remedy_part;
};

class bad_specs : public testing::TestWithParam<BadSpec> {};

TEST_P(bad_specs, are_refused_with_place_and_remedy) {
  const BadSpec& row = GetParam();
  const auto spec = io::read_record<Spec>(row.yaml, "spec.yaml");
  ASSERT_FALSE(spec);
  const Issue& issue = spec.issues().front();
  EXPECT_EQ(issue.code, row.code) << to_string(issue);
  EXPECT_EQ(issue.place.line, row.line);
  EXPECT_EQ(issue.place.column, row.column);
  EXPECT_NE(issue.remedy.find(row.remedy_part), std::string::npos) << issue.remedy;
}

INSTANTIATE_TEST_SUITE_P(rows, bad_specs,
                         testing::Values(BadSpec{"cell: 8 mm\ncel: 3\n", "unknown_key", 2, 1, "did you mean 'cell'"}, BadSpec{"cell: 8\n", "missing_unit", 1, 7, "'8 m'"},
                                         BadSpec{"cell: 8 kg\n", "wrong_dimension", 1, 7, "unit"}, BadSpec{"cell: 8 mn\n", "unknown_unit", 1, 7, "did you mean"},
                                         BadSpec{"cell: 5 m\n", "out_of_range", 1, 7, "from 1e-04 to 1 m"}, BadSpec{"count: 3.5\n", "wrong_type", 1, 8, "whole number"},
                                         BadSpec{"count: 1000\n", "out_of_range", 1, 8, "from 0 to 100"}, BadSpec{"diagonal: singel\n", "unknown_choice", 1, 11, "did you mean 'single'"},
                                         BadSpec{"panels: [{cell: 1 cm}]\n", "missing_key", 1, 10, "panel"}, BadSpec{"panels: 3\n", "wrong_type", 1, 9, "list"},
                                         BadSpec{"gravity: [0, 1]\n", "wrong_type", 1, 10, "[a, b, …]"}, BadSpec{"press: yes\n", "wrong_type", 1, 8, "true or false"},
                                         BadSpec{"cell: 1 cm\ncell: 2 cm\n", "doubled_key", 2, 1, "keep one"}, BadSpec{"cell: [\n", "bad_yaml", 2, 1, "brackets"},
                                         BadSpec{"- 1\n", "wrong_type", 1, 1, "key: value"}, BadSpec{"cell: nan m\n", "bad_number", 1, 7, "number"},
                                         BadSpec{"press: true\ncount: 0\n", "nothing_to_press", 2, 8, "raise count"}, BadSpec{"cell: 1 cm\n---\ncell: 1 cm\n", "several_documents", 3, 1, "keep one"}));

TEST(record_yaml, reports_all_mistakes_at_once) {
  const auto spec = io::read_record<Spec>("cel: 1\ncount: x\ndiagonal: y\n", "spec.yaml");
  ASSERT_FALSE(spec);
  EXPECT_EQ(spec.issues().size(), 3u);
}

TEST(record_yaml, defaults_are_valid) { EXPECT_TRUE(validate(Spec{}).empty()); }

TEST(garment_file, write_read_write_gives_the_same_bytes) {
  mesh::GarmentMesh g = test::two_panels();
  g.marks["converged"] = "no";
  g.route = {{"toile-mesh", 1, "{cell: 0.01}", {{"pattern", "00ff"}}}};
  g.vertex_columns["vx"] = {false, std::vector<double>(static_cast<std::size_t>(g.vertex_count()), 1.0 / 3), {}};
  g.face_columns["tag"] = {true, {}, std::vector<int>(static_cast<std::size_t>(g.face_count()), 7)};
  ASSERT_TRUE(mesh::validate(g).empty()) << to_string(mesh::validate(g).front());
  for (const auto encoding : {io::Encoding::ascii, io::Encoding::binary}) {
    const std::string bytes = io::format_garment(g, encoding);
    const auto back = io::parse_garment(bytes, "g.ply");
    ASSERT_TRUE(back) << to_string(back.issues().front());
    EXPECT_EQ(io::format_garment(*back, encoding), bytes);
    ASSERT_EQ(back->fasteners.size(), 1u);
    EXPECT_EQ(back->fasteners[0].stiffness, 300);
    ASSERT_EQ(back->hinges.size(), 1u);
    EXPECT_EQ(back->hinges[0].rest_angle, 1.2);
    ASSERT_EQ(back->trim_segments.size(), 2u);
    EXPECT_EQ(back->trim_segments[1].rest_length, 0.0098);
    EXPECT_EQ(back->trims[0].width, 0.006);
    EXPECT_EQ(back->trims[0].plies, 2);
    EXPECT_EQ(back->folds[0].runs, (std::vector<int>{0, 4}));
    EXPECT_EQ(back->folds[0].factor, 1.5);
    EXPECT_EQ(back->free_layers[0].on, std::vector<int>{0});
    EXPECT_EQ(back->vertex_columns.at("vx").reals[0], 1.0 / 3);
    EXPECT_EQ(back->face_columns.at("tag").integers[0], 7);
    EXPECT_EQ(back->laminates[0].equivalent.warp.bending, g.laminates[0].equivalent.warp.bending);
  }
}

TEST(garment_file, damage_is_found_wherever_it_is) {
  const std::string good = io::format_garment(test::two_panels(), io::Encoding::ascii);
  ASSERT_TRUE(io::parse_garment(good, "g.ply"));
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string bad = good;
    const auto at = bad.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    bad.replace(at, from.size(), to);
    return bad;
  };
  const std::string rows[] = {
      "",
      "solid cube\n",
      good.substr(0, good.size() / 2),
      good + "1 2 3\n",
      replaced("end_header\n", ""),
      replaced("toile-garment 1", "toile-garment 9"),
      replaced("element vertex", "element vertices"),
      replaced("property double u", "property double uu"),
      replaced("property int panel", "property float panel"),
      replaced("\n0 0 0 0 0 0\n", "\nnan 0 0 0 0 0\n"),
      replaced("\n0 0 0 0 0 0\n", "\n0 0 0 0 0 99\n"),
      replaced("\n3 0 1 5 0 0\n", "\n3 0 1 555 0 0\n"),
      replaced("\n3 0 1 5 0 0\n", "\n3 0 1 1 0 0\n"),
      replaced("\n3 0 1 5 0 0\n", "\n4 0 1 5 6 0 0\n"),
      replaced("\n3 0 1 5 0 0\n", "\n3 0 1 5 0 3\n"),
      replaced("name: front", "name: back"),
      replaced("| panels:", "| panel:"),
      replaced("element vertex 32", "element vertex 99999999999"),
  };
  for (const std::string& bad : rows) {
    const auto result = io::parse_garment(bad, "g.ply");
    EXPECT_FALSE(result) << bad.substr(0, 200);
    if (!result) {
      EXPECT_EQ(result.issues().front().place.file, "g.ply");
    }
  }
}

TEST(garment_file, folds_and_trims_are_checked) {
  using G = mesh::GarmentMesh;
  const std::function<void(G&)> rows[] = {
      [](G& g) { g.folds[0].runs.push_back(99); },      [](G& g) { g.folds[0].radius = -1; },      [](G& g) { g.folds[0].factor = -1; },
      [](G& g) { g.hinges[0].rest_angle = 3.2; },       [](G& g) { g.hinges[0].fold = 1; },        [](G& g) { g.trims[0].plies = -1; },
      [](G& g) { g.trims[0].width = -0.01; },           [](G& g) { g.trims[0].rest_ratio = 0; },   [](G& g) { g.trims[0].seam = 3; },
      [](G& g) { g.trim_segments[0].rest_length = 0; }, [](G& g) { g.trim_segments[0].trim = 1; },
  };
  for (const auto& damage : rows) {
    G g = test::two_panels();
    damage(g);
    const Issues issues = mesh::validate(g);
    EXPECT_EQ(issues.size(), 1u) << &damage - rows;
  }
}

TEST(garment_file, no_truncation_of_a_binary_file_is_accepted) {
  const std::string good = io::format_garment(test::two_panels(1), io::Encoding::binary);
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_FALSE(io::parse_garment(std::string_view(good).substr(0, size), "g.ply")) << size;
}

TEST(support_file, round_trip_and_closedness) {
  mesh::SupportMesh tetrahedron;
  tetrahedron.x.resize(4, 3);
  tetrahedron.x << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  tetrahedron.faces.resize(4, 3);
  tetrahedron.faces << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  tetrahedron.face_region = mesh::Ids::Zero(4);
  tetrahedron.region_names = {"torso"};
  tetrahedron.landmarks = {{"waist_front", {0, 1, 0.25}}};
  const std::string bytes = io::format_support(tetrahedron, io::Encoding::binary);
  const auto back = io::parse_support(bytes, "s.ply");
  ASSERT_TRUE(back) << to_string(back.issues().front());
  EXPECT_EQ(io::format_support(*back, io::Encoding::binary), bytes);

  mesh::SupportMesh open = tetrahedron;
  open.faces.conservativeResize(3, 3);
  open.face_region.conservativeResize(3);
  EXPECT_EQ(mesh::validate(open).front().code, "open_surface");
  mesh::SupportMesh inside_out = tetrahedron;
  inside_out.faces.col(1).swap(inside_out.faces.col(2));
  EXPECT_EQ(mesh::validate(inside_out).front().code, "inside_out");
}

TEST(files, writing_keeps_the_old_file_when_it_fails) {
  const std::string folder = testing::TempDir() + "toile_write_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::string path = folder + "/a.txt";
  ASSERT_TRUE(io::write_file(path, "old").empty());
  ASSERT_TRUE(io::write_file(path, "new").empty());
  EXPECT_EQ(*io::read_file(path), "new");
  EXPECT_FALSE(io::write_file(folder + "/missing/a.txt", "x").empty());
  std::filesystem::create_directories(folder + "/taken");
  EXPECT_FALSE(io::write_file(folder + "/taken", "x").empty());
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++files;
  EXPECT_EQ(files, 2u);
  EXPECT_FALSE(io::read_file(folder));
  EXPECT_FALSE(io::read_file(folder + "/nothing"));
}

}  // namespace
