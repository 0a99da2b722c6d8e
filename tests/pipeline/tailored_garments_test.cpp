// The jacket and the waistcoat with the specs of their pipelines, on a coarse grid: lengths of all seams as measured on the
// drafts, topology of the sewn shell, the same file whatever the order of the seams.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "results.h"
#include "toile/base/rng.h"
#include "toile/io/fabric_yaml.h"
#include "toile/io/file.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/ply.h"
#include "toile/io/record_yaml.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/layer.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"
#include "toile/tailor/trim.h"

using namespace toile;
using test::checked;

namespace {

std::string source(const std::string& name) { return checked(io::read_file(std::string(TOILE_SOURCE_DIR) + "/" + name)); }

mesh::GarmentMesh cut(const std::string& garment, tailor::MeshParams params, double cell) {
  const auto pattern = checked(io::parse_pattern(source("samples/patterns/" + garment + ".yaml"), garment));
  params.cell = cell;
  return checked(tailor::mesh_panels(checked(pattern::cut_panels(pattern)), params));
}

template <class Params>
Params spec(const std::string& garment, const std::string& name) {
  return checked(io::read_record<Params>(source("pipelines/" + garment + "/" + name + ".yaml"), name + ".yaml"));
}

/// The panels of the shell: the chest piece, which is laid on, left out.
mesh::GarmentMesh panels_of(const std::string& garment, double cell) {
  auto params = spec<tailor::MeshParams>(garment, "mesh");
  if (garment == "jacket") params.leave_out.push_back("chest_canvas");
  return cut(garment, params, cell);
}

tailor::SewParams seams_of(const std::string& garment) { return spec<tailor::SewParams>(garment, "seams"); }

/// All that the lined garment is until it is placed.
struct Lined {
  mesh::GarmentMesh sewn;
  tailor::Layered layered;
};

Lined lined(const std::string& garment, const std::vector<std::string>& fabrics, double cell) {
  Lined result;
  const auto params = spec<tailor::SewParams>(garment, "lined_seams");
  const auto sewn = checked(tailor::sew(cut(garment, spec<tailor::MeshParams>(garment, "lined_mesh"), cell), params));
  result.sewn = checked(tailor::add_folds(checked(tailor::finish_seams(sewn.garment, params.seams)).garment, params.folds)).garment;
  std::vector<fabric::Card> cards;
  for (const std::string& name : fabrics) cards.push_back(checked(io::read_fabric(source("samples/fabrics/" + name + ".yaml"), name)));
  result.layered = checked(tailor::layer(result.sewn, cards, spec<tailor::LayerParams>(garment, "lined_layers")));
  EXPECT_TRUE(mesh::validate(result.layered.garment).empty());
  return result;
}

/// The lined garment has the shell's seams, as long as those of the shell alone.
void expect_seams_of_the_shell(const mesh::GarmentMesh& sewn, const std::string& garment, double cell) {
  for (const mesh::Seam& seam : checked(tailor::sew(panels_of(garment, cell), seams_of(garment))).garment.seams) {
    const auto same = std::find_if(sewn.seams.begin(), sewn.seams.end(), [&](const mesh::Seam& other) { return other.name == seam.name; });
    ASSERT_NE(same, sewn.seams.end()) << seam.name;
    EXPECT_NEAR(same->length_a, seam.length_a, 1e-9) << seam.name;
    EXPECT_NEAR(same->length_b, seam.length_b, 1e-9) << seam.name;
  }
}

const mesh::Panel& panel(const mesh::GarmentMesh& garment, const std::string& name) { return garment.panels[static_cast<std::size_t>(checked(mesh::find_panel(garment, name)))]; }

/// Panels that are mirror images have the same particles there, and faces, to the last bit or nearly.
void expect_symmetric(const mesh::GarmentMesh& g) {
  int pairs = 0;
  for (const mesh::Panel& plain : g.panels) {
    const auto twin = std::find_if(g.panels.begin(), g.panels.end(), [&](const mesh::Panel& p) { return p.name == plain.name + "_m"; });
    if (twin == g.panels.end()) continue;
    ++pairs;
    const auto places = [&](int panel, double sign) {
      std::vector<std::pair<double, double>> list;
      for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
        if (g.vertex_panel[v] == panel) list.emplace_back(std::round(g.uv(v, 1) * 1e7), std::round(sign * g.uv(v, 0) * 1e7));
      }
      std::sort(list.begin(), list.end());
      return list;
    };
    const auto own = places(plain.id, 1), other = places(twin->id, -1);
    EXPECT_EQ(own.size(), other.size()) << plain.name;
    EXPECT_EQ((g.face_panel.array() == plain.id).count(), (g.face_panel.array() == twin->id).count()) << plain.name;
    std::size_t apart = 0;
    for (std::size_t k = 0; k < std::min(own.size(), other.size()); ++k) apart += std::abs(own[k].first - other[k].first) > 1 || std::abs(own[k].second - other[k].second) > 1;
    EXPECT_EQ(apart, 0u) << plain.name;
  }
  EXPECT_GT(pairs, 0);
}

/// [kg]
double mass(const mesh::GarmentMesh& garment) { return mesh::vertex_masses(garment).sum(); }

/// Lengths of the two sides [mm].
using Lengths = std::map<std::string, std::pair<double, double>>;

void expect_lengths(const mesh::GarmentMesh& sewn, const Lengths& expected) {
  EXPECT_EQ(sewn.seams.size(), expected.size());
  for (const mesh::Seam& seam : sewn.seams) {
    const auto it = expected.find(seam.name);
    ASSERT_NE(it, expected.end()) << seam.name;
    EXPECT_NEAR(seam.length_a * 1e3, it->second.first, 0.01) << seam.name;
    EXPECT_NEAR(seam.length_b * 1e3, it->second.second, 0.01) << seam.name;
  }
}

/// One piece, and openings of these lengths [mm], from the longest to the shortest.
void expect_surface(const mesh::GarmentMesh& sewn, const std::vector<double>& openings) {
  const tailor::SurfaceReport surface = tailor::surface_report(sewn);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.euler, 2 - static_cast<int>(openings.size()));
  EXPECT_EQ(surface.branching_edges, 0);
  ASSERT_EQ(surface.opening_lengths.size(), openings.size());
  for (std::size_t k = 0; k < openings.size(); ++k) EXPECT_NEAR(surface.opening_lengths[k] * 1e3, openings[k], 0.002 * openings[k]);
}

void expect_same_bytes_in_any_order(const mesh::GarmentMesh& flat, tailor::SewParams params) {
  std::string reference;
  Rng rng(11);
  for (int round = 0; round < 4; ++round) {
    const auto sewn = checked(tailor::sew(flat, params));
    const std::string bytes = io::format_garment(sewn.garment, io::Encoding::binary);
    if (reference.empty()) reference = bytes;
    EXPECT_EQ(bytes, reference);
    for (std::size_t k = params.seams.size(); k > 1; --k) std::swap(params.seams[k - 1], params.seams[rng.below(k)]);
  }
}

}  // namespace

TEST(jacket, shell_is_one_piece_with_three_openings_and_the_drafted_lengths) {
  const auto flat = panels_of("jacket", 0.02);
  EXPECT_EQ(flat.panels.size(), 11u);
  const auto sewn = checked(tailor::sew(flat, seams_of("jacket")));
  Lengths lengths{{"centre_back", {683.27, 683.27}}};
  const auto both = [&](const std::string& name, double left_a, double left_b, bool swapped) {
    lengths[name + "_left"] = {left_a, left_b};
    lengths[name + "_right"] = swapped ? std::pair{left_b, left_a} : std::pair{left_a, left_b};
  };
  both("dart", 209.48, 209.48, false);
  both("front_side", 439.52, 435.94, true);
  both("side_back", 445.36, 448.96, true);
  both("shoulder", 137.91, 137.91, false);
  both("inseam", 402.00, 401.61, true);
  both("outseam", 422.73, 423.14, true);
  both("vent", 101.77, 101.77, false);
  both("armhole", 518.48, 525.23, false);
  both("gorge", 66.52, 66.52, false);
  both("neck", 154.91, 155.02, false);
  EXPECT_EQ(lengths.size(), 21u);
  expect_lengths(sewn.garment, lengths);
  for (const mesh::Seam& seam : sewn.garment.seams) {
    const bool cap = seam.name.rfind("armhole", 0) == 0;
    EXPECT_NEAR(seam.length_b - seam.length_a, cap ? 0.00675 : 0, cap ? 1e-5 : 0.009 * seam.length_a) << seam.name;
  }
  // Hem, fronts, lapels and collar are one border; the sleeves' hems are the others.
  expect_surface(sewn.garment, {2769, 231, 231});
}

TEST(jacket, ease_of_the_caps_lies_at_their_top_on_both_sides) {
  const auto sewn = checked(tailor::sew(panels_of("jacket", 0.01), seams_of("jacket")));
  std::map<std::string, double> steepest;
  for (const auto& seam : sewn.seams) steepest[seam.name] = seam.steepest;
  // 148.69 mm from the top to the front pitch point, 9.04 mm of them to be eased in.
  for (const char* name : {"armhole_left", "armhole_right"}) EXPECT_NEAR(steepest.at(name), 148.69 / (148.69 - 9.04), 0.002) << name;
}

TEST(jacket, seams_in_any_order_give_the_same_bytes) {
  expect_same_bytes_in_any_order(panels_of("jacket", 0.025), seams_of("jacket"));
}

TEST(jacket, a_shuffled_spec_gives_the_same_file) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "toile_shuffled_jacket";
  std::filesystem::create_directories(folder);
  const std::string panels = (folder / "panels.ply").string();
  ASSERT_TRUE(io::write_file(panels, io::format_garment(panels_of("jacket", 0.025), io::Encoding::binary)).empty());
  auto params = seams_of("jacket");
  std::vector<std::string> files;
  for (const char* name : {"listed", "reversed"}) {
    const std::string spec = (folder / (std::string(name) + ".yaml")).string(), out = (folder / (std::string(name) + ".ply")).string();
    ASSERT_TRUE(io::write_file(spec, io::block_yaml(*record_type<tailor::SewParams>(), &params)).empty());
    const std::string command = std::string(TOILE_BIN_DIR) + "/toile-sew " + panels + " -o " + out + " --quiet --spec " + spec + " 2> /dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
    files.push_back(checked(io::read_file(out)));
    std::reverse(params.seams.begin(), params.seams.end());
  }
  EXPECT_EQ(files[0], files[1]);
  std::filesystem::remove_all(folder);
}

TEST(jacket, lapels_and_collar_are_folded_towards_their_face) {
  const auto params = seams_of("jacket");
  const auto sewn = checked(tailor::sew(panels_of("jacket", 0.01), params));
  const auto folded = checked(tailor::add_folds(sewn.garment, params.folds));
  ASSERT_EQ(folded.folds.size(), 3u);
  for (const auto& fold : folded.folds) EXPECT_GT(fold.angle, 2.5) << fold.name;
  EXPECT_TRUE(mesh::validate(folded.garment).empty());
}

TEST(waistcoat, shell_is_one_piece_with_three_openings_and_the_drafted_lengths) {
  const auto flat = panels_of("waistcoat", 0.02);
  EXPECT_EQ(flat.panels.size(), 4u);
  const auto sewn = checked(tailor::sew(flat, seams_of("waistcoat")));
  expect_lengths(sewn.garment, {{"dart_front_left", {308.97, 308.97}},
                                {"dart_front_right", {308.97, 308.97}},
                                {"dart_back_left", {296.99, 296.99}},
                                {"dart_back_right", {296.99, 296.99}},
                                {"side_left", {333.37, 333.08}},
                                {"side_right", {333.08, 333.37}},
                                {"shoulder_left", {116.09, 116.09}},
                                {"shoulder_right", {116.09, 116.09}},
                                {"centre_back", {576.71, 576.71}}});
  // Hem, fronts and neck are one border; the armholes are the others.
  expect_surface(sewn.garment, {2434, 515, 515});
}

TEST(waistcoat, seams_in_any_order_give_the_same_bytes) {
  expect_same_bytes_in_any_order(panels_of("waistcoat", 0.02), seams_of("waistcoat"));
}

TEST(jacket, both_halves_are_mirror_images) {
  expect_symmetric(checked(tailor::sew(panels_of("jacket", 0.01), seams_of("jacket"))).garment);
  expect_symmetric(checked(tailor::sew(cut("jacket", spec<tailor::MeshParams>("jacket", "lined_mesh"), 0.01), spec<tailor::SewParams>("jacket", "lined_seams"))).garment);
}

TEST(jacket, seams_of_the_lined_one_in_any_order_give_the_same_bytes) {
  expect_same_bytes_in_any_order(cut("jacket", spec<tailor::MeshParams>("jacket", "lined_mesh"), 0.02), spec<tailor::SewParams>("jacket", "lined_seams"));
}

TEST(jacket, lined_has_its_facings_collar_lining_and_pockets_as_layers_of_their_own) {
  const auto [sewn, layered] = lined("jacket", {"suiting", "lining", "hair_canvas", "collar_canvas"}, 0.01);
  expect_seams_of_the_shell(sewn, "jacket", 0.01);
  const mesh::GarmentMesh& g = layered.garment;
  // The two chest pieces are used up; pockets hang by their tacks on the one garment.
  EXPECT_EQ(sewn.panels.size(), 29u);
  EXPECT_EQ(g.panels.size(), 27u);
  EXPECT_EQ(tailor::surface_report(g).components, 1);
  ASSERT_EQ(g.free_layers.size(), 4u);
  for (const mesh::Panel& p : g.panels) {
    const bool shell = p.name.find("lining") == std::string::npos && p.name.rfind("facing", 0) != 0 && p.name.rfind("pocket", 0) != 0 && p.name.rfind("collar", 0) != 0;
    EXPECT_EQ(p.order, shell ? 0 : p.name.rfind("pocket", 0) == 0 ? 1 : -1) << p.name;
  }
  // The facing is turned in along the whole edge from the notch to the hem.
  for (const mesh::Seam& seam : g.seams) {
    if (seam.name == "facing_left" || seam.name == "facing_right") {
      EXPECT_NEAR(seam.length_a, 0.73169, 1e-5);
    }
  }
  // Lapels and collar turn towards the shell's face, facings and upper collar, which lie on its back, the other way.
  ASSERT_EQ(g.folds.size(), 6u);
  for (const mesh::Fold& fold : g.folds) {
    const bool inner = fold.name.rfind("facing", 0) == 0 || fold.name == "upper_collar";
    EXPECT_GT(inner ? -fold.angle : fold.angle, 2.5) << fold.name;
  }
  // The canvas is cut to the chest piece, less the dart; the hems to the line that they are turned up to.
  std::map<std::string, tailor::LayerReport> layers;
  for (const auto& row : layered.layers) layers[row.name] = row;
  const auto& canvas = layers.at("chest_canvas");
  ASSERT_TRUE(canvas.piece_area);
  EXPECT_NEAR(canvas.area, *canvas.piece_area, 0.03 * *canvas.piece_area);
  EXPECT_NEAR(layers.at("hem_back").area, 2 * 0.206268 * 0.04, 1e-6);
  EXPECT_NEAR(layers.at("hem_side").area, 2 * 0.087976 * 0.04, 1e-6);
  double cut_area = 0;
  for (const mesh::Panel& p : g.panels) cut_area += p.cut_area;
  EXPECT_NEAR(mesh::rest_areas(g).sum(), cut_area, 1e-4 * cut_area);
  EXPECT_NEAR(mesh::rest_areas(g).sum(), mesh::rest_areas(cut("jacket", spec<tailor::MeshParams>("jacket", "lined_mesh"), 0.01)).sum() - *canvas.piece_area, 2e-4 * cut_area);
  // All that weighs: faces by their sheets, allowances, buttons.
  double sheets = 0;
  const Eigen::VectorXd areas = mesh::rest_areas(g);
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    for (const auto& ply : g.laminates[static_cast<std::size_t>(g.face_laminate[f])].plies) sheets += ply.areal_density * areas[f];
  }
  EXPECT_NEAR(mass(g), sheets + mesh::trimmings_mass(g), 1e-9);
  EXPECT_EQ(g.fasteners.size(), 2u);
  EXPECT_EQ(panel(g, "facing_m").material, "fabric");
}

TEST(waistcoat, both_halves_are_mirror_images) {
  expect_symmetric(checked(tailor::sew(panels_of("waistcoat", 0.01), seams_of("waistcoat"))).garment);
  expect_symmetric(checked(tailor::sew(cut("waistcoat", spec<tailor::MeshParams>("waistcoat", "lined_mesh"), 0.01), spec<tailor::SewParams>("waistcoat", "lined_seams"))).garment);
}

TEST(waistcoat, lined_is_a_closed_bag_with_six_buttons) {
  const auto [sewn, layered] = lined("waistcoat", {"suiting", "lining", "fusible_canvas"}, 0.01);
  expect_seams_of_the_shell(sewn, "waistcoat", 0.01);
  // Two sheets with three openings each, sewn to each other all round: no border is left.
  const tailor::SurfaceReport surface = tailor::surface_report(layered.garment);
  EXPECT_EQ(surface.components, 1);
  EXPECT_EQ(surface.openings, 0);
  EXPECT_EQ(surface.euler, 2 * (2 - 3));
  EXPECT_EQ(surface.branching_edges, 0);
  EXPECT_EQ(layered.garment.free_layers.size(), 2u);
  EXPECT_EQ(layered.garment.fasteners.size(), 6u);
  EXPECT_EQ(panel(layered.garment, "front_lining").order, -1);
  EXPECT_EQ(panel(layered.garment, "front").order, 0);
}
