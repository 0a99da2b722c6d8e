// Panels of random outlines meshed at random cells, sewn and layered: what must hold for all of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "toile/base/rng.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/ply.h"
#include "toile/mesh/topology.h"
#include "toile/inspect/bill.h"
#include "toile/tailor/layer.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"

using namespace toile;

namespace {

/// A star-shaped outline of `corners` points joined by gentle cubics, about 40 cm across; corners between 60 and 300 deg.
std::vector<pattern::CutPanel> random_panels(std::uint64_t seed, int corners, bool mirrored_pair) {
  Rng rng(seed);
  pattern::Pattern pattern;
  pattern.units = pattern::LengthUnit::mm;
  pattern::Piece piece;
  piece.name = "leaf";
  piece.copies = mirrored_pair ? 2 : 1;
  piece.grain = pattern::Grain{{0, 0}, {0, 100}};
  std::vector<Eigen::Vector2d> points;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.3 * rng.uniform(-1, 1)) / corners, radius = rng.uniform(150, 250);
    points.emplace_back(radius * std::cos(angle) + 40 * seed % 17, radius * std::sin(angle));
  }
  for (int k = 0; k < corners; ++k) {
    const Eigen::Vector2d a = points[k], b = points[(k + 1) % corners], d = b - a, side(-d.y(), d.x());
    const std::string from = fmt::format("p{}", k), to = fmt::format("p{}", (k + 1) % corners);
    piece.points[from] = a;
    const double bend = rng.uniform(-0.12, 0.12), skew = rng.uniform(-0.08, 0.08);
    piece.outline.push_back({fmt::format("e{}", k), from, to, {pattern::cubic_segment(a, a + d / 3 + (bend + skew) * side, b - d / 3 + (bend - skew) * side, b)}, std::nullopt});
  }
  pattern.pieces.push_back(piece);
  auto panels = pattern::cut_panels(pattern);
  EXPECT_TRUE(panels) << (panels ? "" : to_string(panels.issues().front()));
  return panels ? *panels : std::vector<pattern::CutPanel>{};
}

mesh::GarmentMesh meshed(const std::vector<pattern::CutPanel>& panels, double cell) {
  tailor::MeshParams params;
  params.cell = cell;
  auto g = tailor::mesh_panels(panels, params);
  EXPECT_TRUE(g) << (g ? "" : to_string(g.issues().front()));
  return g ? *g : mesh::GarmentMesh{};
}

const char* const tee = R"(units: mm
y: down
pieces:
  front:
    cut: 1
    fold: centre
    grain: fold
    points: {hem: [0, 640], hem_side: [260, 640], pit: [265, 240], shoulder: [205, 45], neck: [115, 12], mid: [0, 105]}
    outline:
      - {name: hem, path: [hem, hem_side]}
      - {name: side, path: [hem_side, {curve: [[255, 400], [262, 300]]}, pit]}
      - {name: armhole, path: [pit, {curve: [[190, 240], [170, 150]]}, shoulder]}
      - {name: shoulder, path: [shoulder, neck]}
      - {name: neck, path: [neck, {curve: [[100, 60], [50, 105]]}, mid]}
      - {name: centre, path: [mid, hem]}
  back:
    cut: 1
    fold: centre
    grain: fold
    points: {hem: [0, 640], hem_side: [260, 640], pit: [265, 240], shoulder: [205, 45], neck: [115, 12], mid: [0, 40]}
    outline:
      - {name: hem, path: [hem, hem_side]}
      - {name: side, path: [hem_side, {curve: [[255, 400], [262, 300]]}, pit]}
      - {name: armhole, path: [pit, {curve: [[190, 240], [178, 130]]}, shoulder]}
      - {name: shoulder, path: [shoulder, neck]}
      - {name: neck, path: [neck, {curve: [[105, 40], [60, 40]]}, mid]}
      - {name: centre, path: [mid, hem]}
  sleeve:
    cut: 2
    grain: [[0, 100], [0, 0]]
    points: {front: [175, 0], back: [-175, 0], tip: [0, -139.5], wrist_front: [160, 80], wrist_back: [-160, 80]}
    outline:
      - {name: cap_front, path: [front, {curve: [[105, -30], [75, -139.5]]}, tip]}
      - {name: cap_back, path: [tip, {curve: [[-75, -139.5], [-105, -30]]}, back]}
      - {name: under_back, path: [back, wrist_back]}
      - {name: wrist, path: [wrist_back, wrist_front]}
      - {name: under_front, path: [wrist_front, front]}
)";

std::vector<tailor::SeamSpec> tee_seams() {
  const auto seam = [](const char* name, std::vector<std::string> a, std::vector<std::string> b) {
    tailor::SeamSpec spec;
    spec.name = name;
    spec.a = std::move(a);
    spec.b = std::move(b);
    spec.ease = 0.02;
    return spec;
  };
  return {seam("side_left", {"front.side"}, {"-back.side_m"}),
          seam("side_right", {"front.side_m"}, {"-back.side"}),
          seam("shoulder_left", {"front.shoulder"}, {"-back.shoulder_m"}),
          seam("shoulder_right", {"front.shoulder_m"}, {"-back.shoulder"}),
          seam("under_left", {"sleeve_m.under_back"}, {"-sleeve_m.under_front"}),
          seam("under_right", {"sleeve.under_front"}, {"-sleeve.under_back"}),
          seam("armhole_left", {"front.armhole", "back.armhole_m"}, {"-sleeve_m.cap_front", "-sleeve_m.cap_back"}),
          seam("armhole_right", {"back.armhole", "front.armhole_m"}, {"-sleeve.cap_back", "-sleeve.cap_front"})};
}

std::vector<pattern::CutPanel> tee_panels() {
  const auto pattern = io::parse_pattern(tee, "tee.yaml");
  EXPECT_TRUE(pattern) << (pattern ? "" : to_string(pattern.issues().front()));
  return pattern ? *pattern::cut_panels(*pattern) : std::vector<pattern::CutPanel>{};
}

}  // namespace

TEST(tailor_properties, random_outlines_have_no_slivers) {
  double least = 180;
  int triangles = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const auto panels = random_panels(seed, 4 + static_cast<int>(seed % 4), false);
    if (panels.empty()) continue;
    for (double cell : {0.006, 0.0101, 0.0173, 0.03}) {
      const auto g = meshed(panels, cell);
      if (g.face_count() == 0) continue;
      EXPECT_TRUE(mesh::validate(g).empty());
      const auto angles = tailor::angle_report(g);
      EXPECT_GE(angles.least, 20) << "seed " << seed << " cell " << cell << " " << tailor::place_text(g, g.faces(angles.least_face, 0));
      least = std::min(least, angles.least);
      triangles += static_cast<int>(g.face_count());
      const auto surface = tailor::surface_report(g);
      EXPECT_EQ(surface.components, 1);
      EXPECT_EQ(surface.openings, 1);
      EXPECT_EQ(surface.euler, 1);
      // Chords of length h on curvature k lose k h^3 / 12 each: far below a thousandth here.
      EXPECT_NEAR(mesh::rest_areas(g).sum() / g.panels[0].cut_area, 1, 40 * cell * cell);
      double border = 0;
      for (double length : surface.opening_lengths) border += length;
      EXPECT_NEAR(border / panels[0].perimeter, 1, 20 * cell * cell);
    }
  }
  RecordProperty("triangles", triangles);
  RecordProperty("least_angle", fmt::format("{:.2f}", least));
  EXPECT_GT(triangles, 100000);
}

TEST(tailor_properties, area_error_falls_with_the_square_of_the_cell) {
  const auto panels = random_panels(5, 5, false);
  const auto error = [&](double cell) {
    const auto g = meshed(panels, cell);
    return std::abs(mesh::rest_areas(g).sum() / g.panels[0].cut_area - 1);
  };
  EXPECT_LT(error(0.005), error(0.02) / 8);
}

TEST(tailor_properties, mirrored_copies_are_mirror_images) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto panels = random_panels(seed, 5, true);
    const auto g = meshed(panels, 0.012);
    const Eigen::Index n = g.vertex_count() / 2;
    ASSERT_EQ(2 * n, g.vertex_count());
    for (Eigen::Index v = 0; v < n; ++v) {
      EXPECT_EQ(g.uv(v, 0), -g.uv(n + v, 0));
      EXPECT_EQ(g.uv(v, 1), g.uv(n + v, 1));
    }
  }
}

TEST(tailor_properties, a_tee_is_one_piece_with_four_openings) {
  const auto panels = tee_panels();
  for (double cell : {0.007, 0.01, 0.015, 0.022}) {
    const auto flat = meshed(panels, cell);
    EXPECT_GE(tailor::angle_report(flat).least, 20) << cell;
    tailor::SewParams params;
    params.seams = tee_seams();
    const auto sewn = tailor::sew(flat, params);
    ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
    EXPECT_TRUE(mesh::validate(sewn->garment).empty());
    const auto surface = tailor::surface_report(sewn->garment);
    EXPECT_EQ(surface.components, 1);
    EXPECT_EQ(surface.openings, 4);
    EXPECT_EQ(surface.euler, -2);
    EXPECT_GE(tailor::angle_report(sewn->garment).least, 20) << cell;
    EXPECT_NEAR(mesh::rest_areas(sewn->garment).sum() / mesh::rest_areas(flat).sum(), 1, 2 * cell * cell);
    // Both sides of a seam have the same relative arc lengths, so that sewing strains nothing but the declared ease.
    for (const auto& seam : sewn->garment.seams) {
      double length[2] = {0, 0};
      const mesh::Weld* last = nullptr;
      for (const auto& weld : sewn->garment.welds) {
        if (weld.seam != seam.id) continue;
        if (last && sewn->garment.vertex_panel[last->a] == sewn->garment.vertex_panel[weld.a] && sewn->garment.vertex_panel[last->b] == sewn->garment.vertex_panel[weld.b]) {
          const double a = (sewn->garment.uv.row(weld.a) - sewn->garment.uv.row(last->a)).norm(), b = (sewn->garment.uv.row(weld.b) - sewn->garment.uv.row(last->b)).norm();
          EXPECT_NEAR(a / b, seam.length_a / seam.length_b, 0.03) << seam.name << " cell " << cell;
          length[0] += a;
          length[1] += b;
        }
        last = &weld;
      }
      EXPECT_GT(length[0], 0);
      EXPECT_NEAR(length[0] / length[1], seam.length_a / seam.length_b, 0.02) << seam.name;
    }
  }
}

TEST(tailor_properties, shuffled_seams_give_the_same_bytes) {
  const auto flat = meshed(tee_panels(), 0.013);
  tailor::SewParams params;
  params.seams = tee_seams();
  std::string reference;
  Rng rng(7);
  for (int round = 0; round < 6; ++round) {
    for (std::size_t k = params.seams.size(); k > 1; --k) std::swap(params.seams[k - 1], params.seams[rng.below(k)]);
    const auto sewn = tailor::sew(flat, params);
    ASSERT_TRUE(sewn);
    const std::string bytes = io::format_garment(sewn->garment, io::Encoding::binary);
    if (reference.empty()) reference = bytes;
    EXPECT_EQ(bytes, reference);
  }
}

TEST(tailor_properties, unfolded_panels_are_symmetric) {
  for (double cell : {0.008, 0.013, 0.02}) {
    const auto g = meshed(tee_panels(), cell);
    for (int panel : {0, 1}) {
      std::set<std::pair<double, double>> places;
      for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
        if (g.vertex_panel[v] == panel) places.insert({g.uv(v, 0), g.uv(v, 1)});
      }
      for (const auto& [u, v] : places) EXPECT_TRUE(places.count({-u, v})) << u << " " << v;
    }
    const auto angles = tailor::angle_report(g);
    EXPECT_GE(angles.least, 20);
  }
}

TEST(tailor_properties, mirrored_seams_give_the_mirrored_garment) {
  // A spec that is its own mirror image (left and right exchanged, every edge run the other way) on symmetric panels.
  tailor::SewParams params;
  params.seams = tee_seams();
  for (auto& seam : params.seams) {
    if (seam.name == "under_left") seam.a = {"-sleeve_m.under_front"}, seam.b = {"sleeve_m.under_back"};
    if (seam.name == "side_right") seam.a = {"-front.side_m"}, seam.b = {"back.side"};
    if (seam.name == "shoulder_right") seam.a = {"-front.shoulder_m"}, seam.b = {"back.shoulder"};
    if (seam.name == "armhole_right") seam.a = {"-front.armhole_m", "-back.armhole"}, seam.b = {"sleeve.cap_front", "sleeve.cap_back"};
  }
  for (double cell : {0.008, 0.01, 0.016}) {
    const auto sewn = tailor::sew(meshed(tee_panels(), cell), params);
    ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
    const auto& g = sewn->garment;
    std::vector<Eigen::Vector2d> of_panel[4];
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) of_panel[g.vertex_panel[v]].push_back(g.uv.row(v));
    for (int panel = 0; panel < 4; ++panel) {
      const auto& images = of_panel[panel < 2 ? panel : 5 - panel];
      ASSERT_EQ(of_panel[panel].size(), images.size());
      for (const auto& at : of_panel[panel]) {
        double nearest = 1;
        for (const auto& other : images) nearest = std::min(nearest, (other - Eigen::Vector2d(-at.x(), at.y())).norm());
        EXPECT_LT(nearest, 1e-9) << g.panels[static_cast<std::size_t>(panel)].name << " " << at.transpose();
      }
    }
    int left = 0, right = 0;
    for (const auto& weld : g.welds) {
      const std::string& name = g.seams[static_cast<std::size_t>(weld.seam)].name;
      left += name.find("left") != std::string::npos;
      right += name.find("right") != std::string::npos;
    }
    EXPECT_EQ(left, right);
  }
}

TEST(tailor_properties, different_cells_on_the_two_sides) {
  const auto panels = tee_panels();
  for (double sleeve_cell : {0.006, 0.014, 0.02}) {
    tailor::MeshParams mesh_params;
    mesh_params.panels["sleeve"].cell = sleeve_cell;
    const auto flat = tailor::mesh_panels(panels, mesh_params);
    ASSERT_TRUE(flat);
    tailor::SewParams params;
    params.seams = tee_seams();
    const auto sewn = tailor::sew(*flat, params);
    ASSERT_TRUE(sewn) << to_string(sewn.issues().front());
    const auto angles = tailor::angle_report(sewn->garment);
    EXPECT_GE(angles.least, 20) << "sleeve cell " << sleeve_cell << " " << tailor::place_text(sewn->garment, sewn->garment.faces(angles.least_face, 0));
    EXPECT_EQ(tailor::surface_report(sewn->garment).openings, 4);
  }
}

TEST(tailor_properties, layering_conserves_area_and_mass) {
  const auto flat = meshed(tee_panels(), 0.015);
  fabric::Card card;
  card.name = "cloth";
  card.origin = "test";
  fabric::Card stay = card;
  stay.name = "stay";
  stay.areal_density = 0.05;
  Rng rng(3);
  for (int round = 0; round < 10; ++round) {
    tailor::LayerParams params;
    params.base = "cloth";
    std::vector<std::array<double, 2>> region;
    for (int k = 0; k < 5; ++k) region.push_back({0.1 * std::cos(1.2566 * k) * rng.uniform(0.5, 1), -0.4 + 0.1 * std::sin(1.2566 * k) * rng.uniform(0.5, 1)});
    tailor::BondedLayer part, whole;
    part.name = "a";
    part.fabric = whole.fabric = "stay";
    part.panels = {"front"};
    part.region = region;
    part.rule = round % 2 ? fabric::Joint::laminate : fabric::Joint::additive;
    part.angle = rng.uniform(-1, 1);
    whole.name = "b";
    whole.panels = {"*"};
    whole.side = tailor::LayerSide::over;
    params.bonded = {part, whole};
    tailor::FastenerSpec button;
    button.name = "button";
    button.a = {{.panel = "front", .at = {{0.05, -0.3}}}};
    button.b = {{.panel = "back", .at = {{0.05, -0.3}}}};
    button.mass = rng.uniform(0, 0.01);
    params.fasteners = {button};
    const auto layered = tailor::layer(flat, {card, stay}, params);
    ASSERT_TRUE(layered) << to_string(layered.issues().front());
    const inspect::Bill bill = inspect::bill_of_materials(layered->garment);
    EXPECT_NEAR(bill.mass, mesh::vertex_masses(layered->garment).sum(), 1e-12);
    ASSERT_EQ(bill.fabrics.size(), 2u);
    const double all = mesh::rest_areas(flat).sum();
    EXPECT_NEAR(bill.fabrics[0].area, all, 1e-12);
    EXPECT_NEAR(bill.fabrics[1].area, all + layered->layers[0].area, 1e-12);
    EXPECT_NEAR(layered->layers[1].area, all, 1e-12);
  }
}
