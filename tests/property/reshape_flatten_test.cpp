// Flattening: developable surfaces lose nothing, a spherical cap as much as theory says, a mirrored surface gives a mirrored
// pattern, what is laid flat finds back to the surface; and what cannot be flattened is refused.
#include "toile/base/parallel.h"
#include "toile/pattern/pattern.h"
#include "toile/reshape/flatten.h"

#include <gtest/gtest.h>

#include "shapes.h"

#include <cmath>
#include <numbers>

using namespace toile;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// A grid over a rectangle of parameters, mapped into space; points corner and middle.
template <class Map>
reshape::Surface sheet(int columns, int rows, const Map& map) {
  reshape::Surface s;
  s.x.resize((columns + 1) * (rows + 1), 3);
  s.faces.resize(2 * columns * rows, 3);
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) s.x.row(j * (columns + 1) + i) = map(static_cast<double>(i) / columns, static_cast<double>(j) / rows).transpose();
  }
  int f = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = j * (columns + 1) + i, b = a + 1, c = a + columns + 2, d = a + columns + 1;
      s.faces.row(f++) << a, b, c;
      s.faces.row(f++) << a, c, d;
    }
  }
  s.face_part = reshape::Ids::Constant(s.faces.rows(), -1);
  s.points["middle"] = map(0.5, 0.5);
  return s;
}

Vector3d cylinder(double u, double v) {
  const double angle = 4 * u;
  return {0.3 * std::sin(angle), 0.5 * v, 0.3 * std::cos(angle)};
}
Vector3d cone(double u, double v) {
  const double r = 0.1 + 0.3 * v, angle = 3 * u;
  return {r * std::sin(angle), 0.8 * v, r * std::cos(angle)};
}

reshape::Surface cap_surface(double angle, int levels) {
  const mesh::SupportMesh sphere = shapes::sphere({0, 0, 0}, 1, levels);
  reshape::Surface s = reshape::surface_of(sphere);
  s.points["pole"] = {0, 0, 1};
  s.points["rim"] = {std::sin(angle), 0, std::cos(angle)};
  return s;
}
reshape::FlattenParams cap_params() {
  reshape::FlattenParams p;
  p.cuts.resize(1);
  p.cuts[0].name = "rim";
  p.cuts[0].plane = {"rim"};
  p.cuts[0].normal = {0, 0, 1};
  p.pieces["cap"].at = "pole";
  p.darts = reshape::Darts::none;
  return p;
}

reshape::FlattenParams one_piece() {
  reshape::FlattenParams p;
  p.pieces["sheet"].at = "middle";
  return p;
}

TEST(reshape_flatten, developable_surfaces_lose_nothing) {
  for (const reshape::Surface& surface : {sheet(24, 10, cylinder), sheet(24, 10, cone)}) {
    const auto flat = reshape::flatten(surface, one_piece());
    ASSERT_TRUE(flat) << to_string(flat.issues().front());
    EXPECT_LT(flat->pieces[0].max_strain, 1e-6);
    EXPECT_LT(std::abs(flat->pieces[0].area_change), 1e-6);
    EXPECT_TRUE(flat->findings.empty());
    EXPECT_FALSE(flat->pieces[0].dart);
    const auto panels = pattern::cut_panels(flat->pattern);
    ASSERT_TRUE(panels);
    EXPECT_NEAR(panels->front().area / flat->pieces[0].area, 1, 2e-3) << "drawn curves against chords";
  }
  // The cylinder's warp stands up: 0.5 m high, as wide as its chords are long.
  const auto flat = reshape::flatten(sheet(24, 10, cylinder), one_piece());
  const Eigen::RowVector2d high = flat->map.uv.colwise().maxCoeff();
  EXPECT_NEAR(high.y(), 0.5, 1e-6);
  EXPECT_NEAR(high.x(), 24 * 2 * 0.3 * std::sin(4.0 / 48), 1e-6);
}

TEST(reshape_flatten, grain_turns_the_piece) {
  reshape::FlattenParams p = one_piece();
  p.pieces["sheet"].grain = {1, 1, 0};
  const auto plane = sheet(8, 8, [](double u, double v) { return Vector3d(u, v, 0); });
  const auto flat = reshape::flatten(plane, p);
  ASSERT_TRUE(flat);
  EXPECT_NEAR(flat->map.uv.colwise().maxCoeff().y(), std::sqrt(2.0), 1e-9);
  p.pieces["sheet"].grain = {0, 0, 1};
  const auto across = reshape::flatten(plane, p);
  ASSERT_FALSE(across);
  EXPECT_EQ(across.issues().front().code, "grain_across");
}

TEST(reshape_flatten, a_spherical_cap_is_strained_as_theory_says) {
  // Least squares of the strains on a cap of angle t (radius 1, to second order in t): radial (r^2 - t^2) / 16, round it
  // (3 r^2 - t^2) / 16; root mean square t^2 / sqrt(384).
  const double t = 0.4;
  const auto flat = reshape::flatten(cap_surface(t, 6), [] {
    reshape::FlattenParams p = cap_params();
    p.pieces["cap"].grain = {0, 1, 0};
    return p;
  }());
  ASSERT_TRUE(flat) << to_string(flat.issues().front());
  EXPECT_NEAR(flat->pieces[0].rms_strain / (t * t / std::sqrt(384.0)), 1, 0.03);
  // Extremes are of single faces, whose chords differ.
  EXPECT_NEAR(flat->pieces[0].most_stretch / (t * t / 8), 1, 0.12);
  EXPECT_NEAR(flat->pieces[0].most_compression / (-t * t / 16), 1, 0.12);
  EXPECT_NEAR(flat->pieces[0].area, 2 * std::numbers::pi * (1 - std::cos(t)), 3e-3);
}

TEST(reshape_flatten, darts_are_proposed_and_cut) {
  reshape::FlattenParams p = cap_params();
  p.darts = reshape::Darts::propose;
  p.dart_length = 1;
  const reshape::Surface surface = cap_surface(0.8, 4);
  const auto proposed = reshape::flatten(surface, p);
  ASSERT_TRUE(proposed) << to_string(proposed.issues().front());
  ASSERT_TRUE(proposed->pieces[0].dart);
  ASSERT_EQ(proposed->findings.size(), 1u);
  EXPECT_EQ(proposed->findings[0].code, "strain");
  const reshape::DartProposal& dart = *proposed->pieces[0].dart;
  EXPECT_EQ(dart.edge.substr(0, 3), "rim");
  EXPECT_GT(dart.intake, 0.01);
  EXPECT_LT(dart.rms_strain, proposed->pieces[0].rms_strain);
  p.darts = reshape::Darts::cut;
  const auto cut = reshape::flatten(surface, p);
  ASSERT_TRUE(cut) << to_string(cut.issues().front());
  EXPECT_GE(cut->pieces[0].darts_cut, 1);
  EXPECT_LE(cut->pieces[0].rms_strain, dart.rms_strain * 1.05);
  int darts = 0;
  for (const reshape::SeamRow& seam : cut->seams) darts += seam.kind == "dart";
  EXPECT_EQ(darts, cut->pieces[0].darts_cut);
  EXPECT_TRUE(mesh::validate(cut->map).empty());
  EXPECT_TRUE(pattern::check(cut->pattern).empty());
}

TEST(reshape_flatten, no_dart_where_cloth_is_missing) {
  // A saddle would need a gusset: cut open its border gapes the other way.
  reshape::FlattenParams p = one_piece();
  p.limit = 0.01;
  const auto flat = reshape::flatten(sheet(16, 16, [](double u, double v) { return Vector3d(u, v, 2 * (u - 0.5) * (v - 0.5)); }), p);
  ASSERT_TRUE(flat) << to_string(flat.issues().front());
  EXPECT_GT(flat->pieces[0].max_strain, 0.01);
  EXPECT_FALSE(flat->pieces[0].dart);
}

/// A quarter of a cap between two paths from the rim to the pole, and the next one.
reshape::FlattenParams quarters() {
  reshape::FlattenParams p = cap_params();
  p.points["low"].shift = {0, -0.9, 0.5};
  p.points["right"].shift = {0.9, 0.1, 0.5};
  p.points["top"].shift = {0.2, 0.9, 0.5};
  p.points["inside"].shift = {0.3, 0.35, 0.9};
  p.points["other"].shift = {0.3, -0.3, 0.9};
  for (const char* name : {"low", "right", "top"}) {
    reshape::CutSpec cut;
    cut.name = std::string("line_") + name;
    cut.path = {name, "pole"};
    p.cuts.push_back(cut);
  }
  p.pieces.clear();
  p.pieces["inside"].at = "inside";
  p.pieces["other"].at = "other";
  p.notch_every = 0.2;
  return p;
}

TEST(reshape_flatten, pieces_share_their_line) {
  const auto flat = reshape::flatten(cap_surface(0.7, 4), quarters());
  ASSERT_TRUE(flat) << to_string(flat.issues().front());
  ASSERT_EQ(flat->pieces.size(), 2u);
  ASSERT_EQ(flat->seams.size(), 1u);
  const reshape::SeamRow& seam = flat->seams[0];
  EXPECT_EQ(seam.name, "line_right");
  EXPECT_NEAR(seam.length_a, seam.length_b, 0.02 * seam.length_a);
  EXPECT_GE(seam.notches.size(), 2u);
  for (const pattern::Piece& piece : flat->pattern.pieces) {
    EXPECT_EQ(piece.outline.size(), 3u);
    EXPECT_EQ(piece.notches.size(), seam.notches.size());
    EXPECT_EQ(piece.points.count("pole"), 1u);
  }
  EXPECT_NE(reshape::seam_spec(flat->seams).find("{name: line_right, kind: plain, a: [inside.line_right], b: [-other.line_right]"), std::string::npos);
  ASSERT_TRUE(mesh::validate(flat->map).empty()) << to_string(mesh::validate(flat->map).front());
  for (const mesh::Weld& weld : flat->map.welds) EXPECT_TRUE(flat->map.x.row(weld.a) == flat->map.x.row(weld.b));
}

TEST(reshape_flatten, mirrored_surface_gives_mirrored_pattern) {
  const reshape::Surface surface = cap_surface(0.7, 4);
  reshape::Surface image = surface;
  image.x.col(0) *= -1;
  image.faces.col(1).swap(image.faces.col(2));
  for (auto& [name, p] : image.points) p.x() *= -1;
  reshape::FlattenParams params = quarters(), mirrored = quarters();
  for (auto& [name, p] : mirrored.points) p.shift[0] *= -1;
  const auto a = reshape::flatten(surface, params), b = reshape::flatten(image, mirrored);
  ASSERT_TRUE(a && b);
  for (std::size_t k = 0; k < a->pattern.pieces.size(); ++k) {
    const pattern::Piece &p = a->pattern.pieces[k], &q = b->pattern.pieces[k];
    double wide = 0, wide_q = 0;
    for (Eigen::Index v = 0; v < a->map.vertex_count(); ++v) {
      if (a->map.vertex_panel[v] == static_cast<int>(k)) wide = std::max(wide, a->map.uv(v, 0));
      if (b->map.vertex_panel[v] == static_cast<int>(k)) wide_q = std::max(wide_q, b->map.uv(v, 0));
    }
    EXPECT_NEAR(wide, wide_q, 1e-6);
    ASSERT_EQ(p.points.size(), q.points.size());
    const auto pole_p = p.points.at("pole"), pole_q = q.points.at("pole");
    EXPECT_NEAR(pole_p.x(), 1e3 * wide - pole_q.x(), 2e-3);
    EXPECT_NEAR(pole_p.y(), pole_q.y(), 2e-3);
    EXPECT_NEAR(a->pieces[k].rms_strain, b->pieces[k].rms_strain, 1e-8);
    EXPECT_NEAR(a->pieces[k].area, b->pieces[k].area, 1e-9);
  }
}

TEST(reshape_flatten, same_result_at_any_thread_count) {
  reshape::FlattenParams p = quarters();
  p.darts = reshape::Darts::cut;
  set_thread_count(1);
  const auto one = reshape::flatten(cap_surface(0.7, 4), p);
  set_thread_count(5);
  const auto five = reshape::flatten(cap_surface(0.7, 4), p);
  set_thread_count(0);
  ASSERT_TRUE(one && five);
  EXPECT_TRUE(one->pattern == five->pattern);
  EXPECT_TRUE(one->map.uv == five->map.uv);
}

TEST(reshape_flatten, a_garment_is_cut_at_its_seams) {
  const mesh::GarmentMesh tube = shapes::tube(0.15, 0.4, 24, 10);
  reshape::FlattenParams p;
  p.cuts.resize(1);
  p.cuts[0].name = "centre_back";
  p.cuts[0].seam = "back";
  p.points["front"].shift = {0, 0.2, -0.15};
  p.pieces["tube"].at = "front";
  const auto flat = reshape::flatten(tube, p);
  ASSERT_TRUE(flat) << to_string(flat.issues().front());
  EXPECT_LT(flat->pieces[0].max_strain, 1e-6);
  std::vector<std::string> names;
  for (const pattern::Edge& edge : flat->pattern.pieces[0].outline) names.push_back(edge.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"bottom", "centre_back", "centre_back_2", "top"}));
  ASSERT_EQ(flat->seams.size(), 1u);
  EXPECT_NEAR(flat->seams[0].length_a, 0.4, 1e-9);
  p.cuts[0].seam = "bakc";
  const auto unknown = reshape::flatten(tube, p);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.issues().front().code, "unknown_seam");
}

TEST(reshape_flatten, the_map_leads_back_to_the_surface) {
  const auto flat = reshape::flatten(cap_surface(0.5, 5), cap_params());
  ASSERT_TRUE(flat);
  const auto back = reshape::positions_from(flat->map, flat->map);
  ASSERT_TRUE(back);
  EXPECT_LT((*back - flat->map.x).cwiseAbs().maxCoeff(), 1e-12);
  mesh::GarmentMesh other = flat->map;
  other.panels[0].name = "cup";
  EXPECT_EQ(reshape::positions_from(flat->map, other).issues().front().code, "unknown_panel");
}

TEST(reshape_flatten, curves_keep_to_the_points) {
  std::vector<Vector2d> points;
  for (int i = 0; i <= 60; ++i) points.emplace_back(100 * std::cos(i * 0.05), 100 * std::sin(i * 0.05));
  for (int i = 1; i <= 20; ++i) points.emplace_back(points.back() + Vector2d(0, -5));
  const pattern::Curve curve(reshape::fit_curves(points, 0.2));
  for (const Vector2d& p : points) EXPECT_LT(curve.nearest(p).distance, 0.21);
  EXPECT_LT(curve.segments().size(), 12u);
  EXPECT_TRUE(curve.from() == points.front());
  EXPECT_TRUE(curve.to() == points.back());
}

}  // namespace
