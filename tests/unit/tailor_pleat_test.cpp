#include "toile/tailor/pleat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "toile/io/pattern_yaml.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"
#include "toile/tailor/trim.h"

using namespace toile;
using pattern::PleatDirection;

namespace {

/// A skirt panel 360 mm wide at the waist, drawn with its pleats closed, and a band.
std::string skirt(const std::string& waist, int copies = 1) {
  return fmt::format(R"(units: mm
y: up
pieces:
  skirt:
    cut: {}
    grain: [[0, 0], [0, 10]]
    points: {{a: [0, 0], b: [360, 0], c: [360, 300], d: [0, 300]}}
    outline:
      - {{name: hem, path: [a, b]}}
      - {{name: left, path: [b, c]}}
      - {{name: waist, path: {}, allowance: 10}}
      - {{name: right, path: [d, a]}}
  band:
    cut: 1
    grain: [[0, 0], [10, 0]]
    points: {{a: [0, 0], b: [360, 0], c: [360, 40], d: [0, 40]}}
    outline:
      - {{name: lower, path: [a, b], allowance: 8}}
      - {{name: end_left, path: [b, c]}}
      - {{name: upper, path: [c, d]}}
      - {{name: end_right, path: [d, a]}}
)",
                     copies, waist);
}

pattern::PleatSpec spec(PleatDirection direction, double at, double width, double depth, int count, double length = 0) {
  pattern::PleatSpec s;
  s.name = "p";
  s.piece = "skirt";
  s.edge = "waist";
  s.direction = direction;
  s.at = at;
  s.width = width;
  s.depth = depth;
  s.count = count;
  s.length = length;
  s.spread = true;
  return s;
}

mesh::GarmentMesh cut(const std::string& text, const std::vector<pattern::PleatSpec>& pleats, double cell, double band_cell) {
  const auto pattern = io::parse_pattern(text, "p.yaml");
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
  const auto pleated = pattern::add_pleats(*pattern, pleats);
  EXPECT_TRUE(pleated) << (pleated ? "" : to_string(pleated.issues().front()));
  const auto panels = pattern::cut_panels(pleated->pattern);
  EXPECT_TRUE(panels);
  tailor::MeshParams params;
  params.cell = cell;
  params.panels["band"].cell = band_cell;
  params.lines = tailor::pleat_lines(*pleated);
  const auto garment = tailor::mesh_panels(*panels, params);
  EXPECT_TRUE(garment) << (garment ? "" : to_string(garment.issues().front()));
  const auto folded = tailor::add_folds(*garment, tailor::pleat_folds(*garment, *pleated, pleats));
  EXPECT_TRUE(folded) << (folded ? "" : to_string(folded.issues().front()));
  return folded->garment;
}

tailor::SeamSpec waist() {
  tailor::SeamSpec seam;
  seam.name = "waist";
  seam.a = {"skirt.waist"};
  seam.b = {"-band.lower"};
  seam.pleated = true;
  return seam;
}

Result<tailor::Sewn> sew(const mesh::GarmentMesh& garment, const std::vector<tailor::SeamSpec>& seams) {
  tailor::SewParams params;
  params.seams = seams;
  TOILE_TRY(const tailor::SewParams plain, tailor::expand_pleats(garment, params));
  return tailor::sew(garment, plain);
}

std::string first_code(const Result<tailor::Sewn>& result) { return result ? "none" : result.issues().front().code; }

/// Distance from the panel's right border (u greatest) when its vertical folds are closed.
double closed_place(const mesh::GarmentMesh& g, int panel, double u) {
  std::vector<double> folds;
  double right = -1e9;
  for (const auto& fold : g.folds) {
    for (int run : fold.runs) {
      if (g.runs[static_cast<std::size_t>(run)].panel == panel) folds.push_back(g.uv(mesh::run_vertex_ids(g, run).front(), 0));
    }
  }
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == panel) right = std::max(right, g.uv(v, 0));
  }
  std::sort(folds.rbegin(), folds.rend());
  double at = 0, from = right, way = 1;
  for (double fold : folds) {
    if (fold <= u) break;
    at += way * (from - fold);
    from = fold;
    way = -way;
  }
  return at + way * (from - u);
}

/// Hinges stand on sides of two triangles, each fold has one for every edge of its line.
void expect_hinges(const mesh::GarmentMesh& g) {
  std::set<std::array<int, 3>> corners;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) corners.insert({g.faces(f, k), g.faces(f, (k + 1) % 3), g.faces(f, (k + 2) % 3)});
  }
  std::map<int, std::size_t> count;
  for (const auto& h : g.hinges) {
    EXPECT_TRUE(corners.count({h.v0, h.v1, h.o0}) && corners.count({h.v1, h.v0, h.o1}));
    EXPECT_EQ(h.rest_angle, g.folds[static_cast<std::size_t>(h.fold)].angle);
    ++count[h.fold];
  }
  for (const auto& fold : g.folds) EXPECT_EQ(count[fold.id], mesh::run_vertex_ids(g, fold.runs[0]).size() - 1) << fold.name;
}

const char* const straight = "[c, d]";

}  // namespace

TEST(tailor_pleat, what_is_sewn_together_lies_together_when_the_pleats_are_closed) {
  for (const auto direction : {PleatDirection::left, PleatDirection::right, PleatDirection::box, PleatDirection::inverted}) {
    for (const double band_cell : {0.01, 0.007, 0.016}) {
      const bool pair = direction == PleatDirection::box || direction == PleatDirection::inverted;
      const auto g = cut(skirt(straight), {spec(direction, 0.1, 0.12, 0.04, 2)}, 0.01, band_cell);
      const auto sewn = sew(g, {waist()});
      ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
      EXPECT_TRUE(mesh::validate(sewn->garment).empty());
      const auto& s = sewn->garment;
      // Visible length and what the pleats take up.
      double edge = 0, caught = 0, plain = 0;
      for (const auto& run : s.runs) {
        if (run.name == "waist") edge = run.length;
      }
      EXPECT_NEAR(edge, 0.36 + 2 * 0.04 * 2 * (pair ? 2 : 1), 1e-12);
      for (const auto& seam : s.seams) {
        caught += seam.length_a;
        if (seam.kind != "pleat") plain += seam.length_a;
      }
      EXPECT_NEAR(caught, edge, 1e-9) << "all of the edge is caught in the seam";
      EXPECT_NEAR(plain, 0.36, 1e-9) << "one layer is the outermost";
      for (const auto& weld : s.welds) {
        ASSERT_EQ(s.vertex_panel[weld.a], 0);
        ASSERT_EQ(s.vertex_panel[weld.b], 1);
      }
      // The band's grain lies along it: v runs along the waist. Its end is found from the first weld.
      const auto place = [&](const mesh::Weld& w) { return closed_place(s, 0, s.uv(w.a, 0)); };
      const double sign = place(s.welds.back()) > place(s.welds.front()) ? (s.uv(s.welds.back().b, 1) > s.uv(s.welds.front().b, 1) ? 1 : -1) : 1;
      const double origin = s.uv(s.welds.front().b, 1) - sign * place(s.welds.front());
      for (const auto& weld : s.welds) EXPECT_NEAR(place(weld), sign * (s.uv(weld.b, 1) - origin), 1e-9);
      EXPECT_EQ(tailor::surface_report(s).components, 1);
      EXPECT_GE(tailor::angle_report(s).least, 20);
      expect_hinges(s);
    }
  }
}

TEST(tailor_pleat, curved_waists_and_bands_that_are_a_little_short) {
  // A hollow waist is longer than the band: the difference is spread over visible and hidden cloth alike.
  const auto g = cut(skirt("[c, {curve: [[240, 285], [120, 285]]}, d]"), {spec(PleatDirection::left, 0.1, 0.12, 0.04, 2)}, 0.01, 0.01);
  auto seam = waist();
  seam.ease = 0.004;
  const auto sewn = sew(g, {seam});
  ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
  double band = 0, visible = 0;
  for (const auto& row : sewn->garment.seams) {
    if (row.kind == "pleat") continue;
    visible += row.length_a;
    band += row.length_b;
  }
  EXPECT_NEAR(band, 0.36, 1e-9);
  EXPECT_GT(visible, 0.3605);
  EXPECT_LT(visible, 0.3635);
  expect_hinges(sewn->garment);
}

TEST(tailor_pleat, stitched_down) {
  for (const auto direction : {PleatDirection::left, PleatDirection::right, PleatDirection::box, PleatDirection::inverted}) {
    const auto g = cut(skirt(straight), {spec(direction, 0.1, 0.16, 0.04, 2, 0.08)}, 0.01, 0.01);
    const auto sewn = sew(g, {waist()});
    ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
    double down = 0;
    for (const auto& seam : sewn->garment.seams) {
      if (seam.name.starts_with("waist_down")) down += seam.length_a;
    }
    const bool pair = direction == PleatDirection::box || direction == PleatDirection::inverted;
    EXPECT_NEAR(down, 0.08 * 2 * (pair ? 2 : 1), 1e-9);
    for (const auto& weld : sewn->garment.welds) {
      if (!sewn->garment.seams[static_cast<std::size_t>(weld.seam)].name.starts_with("waist_down")) continue;
      EXPECT_NEAR(sewn->garment.uv(weld.a, 1), sewn->garment.uv(weld.b, 1), 1e-9);
      EXPECT_NEAR(closed_place(sewn->garment, 0, sewn->garment.uv(weld.a, 0)), closed_place(sewn->garment, 0, sewn->garment.uv(weld.b, 0)), 1e-9);
    }
    expect_hinges(sewn->garment);
  }
}

TEST(tailor_pleat, mirrored_panels) {
  // The mirrored skirt on the same band: its waist runs the other way.
  const auto g = cut(skirt(straight, 2), {spec(PleatDirection::left, 0.1, 0.12, 0.04, 2, 0.06)}, 0.01, 0.01);
  auto mirrored = waist();
  mirrored.a = {"skirt_m.waist"};
  const auto a = sew(g, {waist()}), b = sew(g, {mirrored});
  ASSERT_TRUE(a) << to_string(a.issues().front());
  ASSERT_TRUE(b) << to_string(b.issues().front());
  EXPECT_EQ(a->garment.seams.size(), b->garment.seams.size());
  EXPECT_EQ(a->garment.welds.size(), b->garment.welds.size());
  ASSERT_EQ(a->garment.folds.size(), 8u);
  expect_hinges(b->garment);
  std::map<std::string, double> angle;
  for (const auto& fold : a->garment.folds) angle[fold.name] = fold.angle;
  EXPECT_EQ(angle["skirt.p_1_outer"], angle["skirt_m.p_1_outer"]) << "a ridge is a ridge on both";
}

TEST(tailor_pleat, the_finish_of_a_pleated_seam) {
  auto seam = waist();
  seam.tape = tailor::SeamTape{.width = 0.01, .bending = 1e-4, .stretch = 500, .mass = 0.003, .ratio = 1};
  seam.allowance = tailor::Allowance::to_b;
  const auto g = cut(skirt(straight), {spec(PleatDirection::left, 0.1, 0.12, 0.04, 2)}, 0.01, 0.01);
  const auto sewn = sew(g, {seam});
  ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
  const auto result = tailor::finish_seams(sewn->garment, {seam});
  ASSERT_TRUE(result) << to_string(result.issues().front());
  ASSERT_EQ(result->trims.size(), 3u);
  EXPECT_NEAR(result->trims[0].length, 0.36, 1e-9) << "the tape lies on the band";
  EXPECT_NEAR(result->trims[1].length, 0.52, 1e-9) << "all of the pleated edge has its allowance";
  EXPECT_NEAR(result->garment.trims[1].width, 0.010, 1e-12);
  EXPECT_NEAR(result->garment.trims[2].width, 0.008, 1e-12);
  seam.angle = 1;
  const auto angled = tailor::finish_seams(sewn->garment, {seam});
  ASSERT_FALSE(angled);
  EXPECT_EQ(angled.issues()[0].code, "angle_with_pleats");
}

TEST(tailor_pleat, what_cannot_be_sewn) {
  const auto g = cut(skirt(straight), {spec(PleatDirection::left, 0.1, 0.12, 0.04, 2)}, 0.02, 0.02);
  auto seam = waist();
  seam.a = {"skirt.left"};
  EXPECT_EQ(first_code(sew(g, {seam})), "no_pleats");
  seam.a = {"skirt.waist"};
  seam.b = {"-skirt.hem"};
  EXPECT_EQ(first_code(sew(g, {seam})), "pleats_on_both_sides");
  seam = waist();
  seam.b = {"-band.end_left"};
  EXPECT_EQ(first_code(sew(g, {seam})), "seam_length");
  seam = waist();
  seam.a = {"skirt.waist(0 mm..120 mm)"};
  seam.b = {"-band.lower(60 mm..180 mm)"};
  EXPECT_EQ(first_code(sew(g, {seam})), "half_pleat");
  seam = waist();
  seam.a = {"skirt.waist(80 mm..520 mm)"};
  EXPECT_EQ(first_code(sew(g, {seam})), "pleat_past_end");
  seam = waist();
  seam.match = {{"skirt.c", "band.b"}};
  EXPECT_EQ(first_code(sew(g, {seam})), "pleats_and_match");
  seam = waist();
  seam.b = {"-band.lewer"};
  EXPECT_EQ(first_code(sew(g, {seam})), "unknown_edge");
  // A pleat one cell deep would lay its two layers on each other.
  const auto shallow = cut(skirt(straight), {spec(PleatDirection::left, 0.1, 0.12, 0.02, 2, 0.08)}, 0.02, 0.02);
  EXPECT_EQ(first_code(sew(shallow, {waist()})), "folded_panel");
}
