// Darts from the pattern to the sewn garment: the tip is one particle, and the cone at it is the dart's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "toile/inspect/measures.h"
#include "toile/io/pattern_yaml.h"
#include "toile/mesh/topology.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"
#include "toile/tailor/trim.h"

using namespace toile;
using std::numbers::pi;

namespace {

std::vector<pattern::CutPanel> panels() {
  const auto text = (std::stringstream() << std::ifstream(TOILE_SOURCE_DIR "/tests/golden/toile-mesh/darts/pattern.yaml").rdbuf()).str();
  const auto pattern = io::parse_pattern(text, "darts.yaml");
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
  const auto cut = pattern::cut_panels(*pattern);
  EXPECT_TRUE(cut);
  return *cut;
}

std::vector<tailor::SeamSpec> seams() {
  std::vector<tailor::SeamSpec> list(3);
  const std::array<std::array<const char*, 3>, 3> rows{{{"eye", "front.eye_left", "-front.eye_right"}, {"hem", "front.hem_leg_1", "-front.hem_leg_2"}, {"waist", "front.leg_1", "-front.leg_2"}}};
  for (std::size_t k = 0; k < 3; ++k) {
    list[k].name = rows[k][0];
    list[k].kind = "dart";
    list[k].a = {rows[k][1]};
    list[k].b = {rows[k][2]};
  }
  return list;
}

int point(const mesh::GarmentMesh& g, const std::string& name) {
  for (const auto& p : g.points) {
    if (p.name == name) return p.vertex;
  }
  ADD_FAILURE() << "no point " << name;
  return 0;
}

}  // namespace

TEST(dart, tips_are_smooth_cones_on_grids_of_any_size) {
  for (const double cell : {0.02, 0.012, 0.008, 0.005}) {
    tailor::MeshParams grid;
    grid.cell = cell;
    const auto g = tailor::mesh_panels(panels(), grid);
    ASSERT_TRUE(g) << to_string(g.issues().front());
    tailor::SewParams params;
    params.seams = seams();
    const auto result = tailor::sew(*g, params);
    ASSERT_TRUE(result) << cell << ": " << to_string(result.issues().front());
    const auto& s = result->garment;
    EXPECT_TRUE(mesh::validate(s).empty());
    EXPECT_GE(tailor::angle_report(s).least, 20) << cell;
    const auto surface = tailor::surface_report(s);
    EXPECT_EQ(surface.components, 1);
    EXPECT_EQ(surface.openings, 1);
    EXPECT_EQ(surface.euler, 1) << "a disc: nothing is left open or pinched";
    EXPECT_EQ(surface.branching_edges, 0);

    const mesh::Ids particle = mesh::particles(s);
    const mesh::Triangles faces = mesh::mapped(s.faces, particle);
    std::set<std::array<int, 3>> triples;
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      std::array<int, 3> t{faces(f, 0), faces(f, 1), faces(f, 2)};
      std::sort(t.begin(), t.end());
      EXPECT_TRUE(t[0] != t[1] && t[1] != t[2]) << "a triangle is closed to nothing";
      EXPECT_TRUE(triples.insert(t).second) << "a triangle lies on another";
    }
    // The legs' end tangents say how much is missing round the tip; chords of curved legs see it with an error of a cell.
    const struct {
      const char* tip;
      const char *leg_1, *leg_2;
    } tips[] = {{"tip", "leg_1", "leg_2"}, {"up", "hem_leg_1", "hem_leg_2"}, {"low", "eye_right", "eye_left"}, {"high", "eye_left", "eye_right"}};
    const auto cut = panels();
    for (const auto& row : tips) {
      const int tip = point(s, row.tip);
      EXPECT_EQ(std::count(particle.data(), particle.data() + particle.size(), particle[tip]), 1) << row.tip << " is one vertex and one particle";
      double round = 0;
      int triangles = 0;
      for (Eigen::Index f = 0; f < s.face_count(); ++f) {
        for (int k = 0; k < 3; ++k) {
          if (s.faces(f, k) != tip) continue;
          const Eigen::Vector2d a = s.uv.row(s.faces(f, (k + 1) % 3)) - s.uv.row(tip), b = s.uv.row(s.faces(f, (k + 2) % 3)) - s.uv.row(tip);
          round += std::atan2(std::abs(a.x() * b.y() - a.y() * b.x()), a.dot(b));
          ++triangles;
        }
      }
      // The first leg ends at the tip, the second begins there.
      const auto& in = pattern::find_edge(cut[0], row.leg_1)->curve;
      const auto& out = pattern::find_edge(cut[0], row.leg_2)->curve;
      const Eigen::Vector2d back = -in.tangent_at(in.length()), on = out.tangent_at(0);
      const double intake = std::acos(std::clamp(back.dot(on), -1.0, 1.0));
      EXPECT_NEAR(round, 2 * pi - intake, 15 * cell) << row.tip;
      EXPECT_GE(triangles, 4) << row.tip;
    }
    EXPECT_NEAR(mesh::rest_areas(s).sum() / cut[0].area, 1, 0.5 * cell);
  }
}

TEST(dart, legs_are_measured_to_their_tips_and_chains_past_their_mouths) {
  tailor::SewParams params;
  params.seams = seams();
  // The waist is sewn to a band of its own, over the dart: what lies between its legs is no part of the seam.
  const auto band = io::parse_pattern(R"(units: mm
y: up
pieces:
  band:
    cut: 1
    grain: [[0, 0], [0, 10]]
    points: {a: [0, 0], b: [276, 0], c: [276, 40], d: [0, 40]}
    outline:
      - {name: low, path: [a, b]}
      - {name: right, path: [b, c]}
      - {name: top, path: [c, d]}
      - {name: left, path: [d, a]}
)", "band.yaml");
  ASSERT_TRUE(band);
  auto cut = panels();
  const auto more = pattern::cut_panels(*band);
  ASSERT_TRUE(more);
  cut.insert(cut.end(), more->begin(), more->end());
  const auto both = tailor::mesh_panels(cut, {});
  ASSERT_TRUE(both) << to_string(both.issues().front());
  tailor::SeamSpec waist;
  waist.name = "waistband";
  waist.a = {"front.waist_side", "front.waist"};
  waist.b = {"-band.low"};
  params.seams.push_back(waist);
  const auto sewn = tailor::sew(*both, params);
  ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
  const auto table = inspect::seam_table(sewn->garment);
  ASSERT_EQ(table.size(), 4u);
  for (const auto& row : table) {
    // Chords of the curved legs are shorter by a hair.
    EXPECT_NEAR(row.now_a, row.cut_a, 2e-4 * row.cut_a) << row.name;
    EXPECT_NEAR(row.now_b, row.cut_b, 2e-4 * row.cut_b) << row.name;
  }
  EXPECT_NEAR(table[3].now_a, 0.276, 1e-12);
}

TEST(dart, the_cloth_of_darts_is_kept_where_it_is_asked_for) {
  tailor::MeshParams grid;
  grid.cell = 0.005;
  const auto g = tailor::mesh_panels(panels(), grid);
  ASSERT_TRUE(g);
  tailor::SewParams params;
  params.seams = seams();
  for (auto& seam : params.seams) seam.allowance = tailor::Allowance::to_a;
  const auto sewn = tailor::sew(*g, params);
  ASSERT_TRUE(sewn);
  const auto result = tailor::finish_seams(sewn->garment, params.seams);
  ASSERT_TRUE(result) << to_string(result.issues().front());
  ASSERT_EQ(result->garment.trims.size(), 6u);
  std::vector<double> area(6, 0);
  for (const auto& segment : result->garment.trim_segments) {
    const auto& trim = result->garment.trims[static_cast<std::size_t>(segment.trim)];
    area[static_cast<std::size_t>(segment.trim)] += trim.width * trim.plies * segment.rest_length;
  }
  // What the panel lost to each dart: by the curves' own areas, closed by the mouth's chord.
  const auto cut = panels();
  const auto lost = [&](const char* first, const char* second) {
    const auto &a = pattern::find_edge(cut[0], first)->curve, &b = pattern::find_edge(cut[0], second)->curve;
    const Eigen::Vector2d p = b.to(), q = a.from();
    return std::abs(a.sector_area() + b.sector_area() + 0.5 * (p.x() * q.y() - p.y() * q.x()));
  };
  EXPECT_NEAR(area[0] + area[1], lost("eye_left", "eye_right"), 0.02 * lost("eye_left", "eye_right"));
  EXPECT_NEAR(area[2] + area[3], lost("hem_leg_1", "hem_leg_2"), 1e-9);
  EXPECT_NEAR(area[4] + area[5], lost("leg_1", "leg_2"), 0.02 * lost("leg_1", "leg_2"));
}
