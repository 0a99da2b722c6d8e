// Random patchworks: rows of rectangles of random widths and cells, each row sewn to the next as one chain, so that nearly
// every seam ends inside another edge. What must hold for all of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "garments.h"
#include "toile/base/rng.h"
#include "toile/io/ply.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"

using namespace toile;

namespace {

struct Patchwork {
  mesh::GarmentMesh garment;
  tailor::SewParams params;
};

tailor::SeamSpec seam(std::string name, std::vector<std::string> a, std::vector<std::string> b) {
  tailor::SeamSpec spec;
  spec.name = std::move(name);
  spec.a = std::move(a);
  spec.b = std::move(b);
  spec.ease = 0.012;
  return spec;
}

/// Three rows, flat or closed to a tube; a band is caught in the lowest seam over its whole length, a pocket in a part of
/// the upper one.
Patchwork patchwork(std::uint64_t seed, bool tube) {
  Rng rng(seed);
  Patchwork result;
  auto& g = result.garment;
  double shift = 0;
  const auto add = [&](const std::string& name, double width, double height, double cell) {
    const int columns = std::max(3, static_cast<int>(std::lround(width / cell)));
    const double h = width / columns;
    test::add_rectangle(g, name, columns, std::max(3, static_cast<int>(std::lround(height / h))), h, shift);
    shift += width + 0.02;
  };
  constexpr double width = 0.4;
  std::vector<std::vector<std::string>> rows;
  const std::array<double, 3> cells{rng.uniform(0.008, 0.013), rng.uniform(0.008, 0.013), rng.uniform(0.005, 0.013)};
  for (int row = 0; row < 3; ++row) {
    auto& names = rows.emplace_back();
    const int count = 1 + static_cast<int>(rng.below(4));
    std::vector<double> cuts{0, 1};
    for (int k = 1; k < count; ++k) cuts.push_back((k + rng.uniform(-0.3, 0.3)) / count);
    std::sort(cuts.begin(), cuts.end());
    // Panels of one row share their height, so that the seams between them have one length.
    const double cell = cells[static_cast<std::size_t>(row)];
    for (int k = 0; k < count; ++k) {
      names.push_back(fmt::format("r{}p{}", row, k));
      add(names.back(), width * (cuts[static_cast<std::size_t>(k) + 1] - cuts[static_cast<std::size_t>(k)]), 6 * cell, cell);
    }
  }
  add("band", width, 0.04, rng.uniform(0.006, 0.012));
  double first_width = 0;
  for (const auto& run : g.runs) {
    if (g.panels[static_cast<std::size_t>(run.panel)].name == rows[2][0] && run.name == "bottom") first_width = run.length;
  }
  add("pocket", 0.5 * first_width * rng.uniform(0.9, 2.2), 0.05, rng.uniform(0.004, 0.012));
  const auto chain = [](const std::vector<std::string>& names, const char* edge, bool backwards) {
    std::vector<std::string> list;
    for (const std::string& name : names) list.push_back((backwards ? "-" : "") + name + "." + edge);
    return list;
  };
  auto& seams = result.params.seams;
  for (const auto& names : rows) {
    for (std::size_t k = 1; k < names.size(); ++k) seams.push_back(seam("between_" + names[k], {names[k - 1] + ".right"}, {"-" + names[k] + ".left"}));
    if (tube) seams.push_back(seam("close_" + names[0], {names.back() + ".right"}, {"-" + names[0] + ".left"}));
  }
  // The bottoms run to the right, the tops, backwards, too.
  for (int row = 0; row < 2; ++row) seams.push_back(seam(fmt::format("across_{}", row), chain(rows[static_cast<std::size_t>(row) + 1], "bottom", false), chain(rows[static_cast<std::size_t>(row)], "top", true)));
  seams[seams.size() - 2].more = {{"band.bottom"}};
  // A pocket gathered onto half an edge, on the inside of a seam.
  const std::string first = rows[2][0];
  auto pocket = seam("pocket", {"-pocket.top"}, {first + ".bottom(20 %..70 %)"});
  pocket.gather = 3;
  pocket.ease.reset();
  seams.push_back(pocket);
  return result;
}

std::string mirrored_reference(std::string text) {
  text = text.front() == '-' ? text.substr(1) : "-" + text;
  const auto dot = text.find('.');
  const auto open = text.find('(');
  std::string edge = text.substr(dot + 1, open == std::string::npos ? std::string::npos : open - dot - 1);
  std::string range;
  if (open != std::string::npos) {
    const auto dots = text.find("..", open);
    const auto other = [](const std::string& place) { return place.empty() ? place : fmt::format("{} %", 100 - std::stod(place)); };
    range = "(" + other(text.substr(dots + 2, text.size() - dots - 3)) + ".." + other(text.substr(open + 1, dots - open - 1)) + ")";
  }
  return text.substr(0, dot + 1) + edge + range;
}

/// The panels turned over, edges with their names, and the spec to match.
Patchwork mirrored(const Patchwork& plain) {
  Patchwork result = plain;
  auto& g = result.garment;
  g.x.col(0) *= -1;
  g.uv.col(0) *= -1;
  for (Eigen::Index f = 0; f < g.face_count(); ++f) std::swap(g.faces(f, 1), g.faces(f, 2));
  g.run_vertices.clear();
  for (const auto& run : g.runs) {
    std::vector<mesh::RunVertex> rows;
    for (const auto& row : plain.garment.run_vertices) {
      if (row.run == run.id) rows.push_back({row.run, row.vertex, run.length - row.s});
    }
    g.run_vertices.insert(g.run_vertices.end(), rows.rbegin(), rows.rend());
  }
  for (auto& spec : result.params.seams) {
    for (auto* side : {&spec.a, &spec.b}) {
      for (auto& text : *side) text = mirrored_reference(text);
    }
    for (auto& side : spec.more) {
      for (auto& text : side) text = mirrored_reference(text);
    }
  }
  return result;
}

}  // namespace

TEST(seam_properties, patchworks_have_the_topology_of_their_seams) {
  double least = 180, farthest = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    for (const bool tube : {false, true}) {
      for (const auto matching : {tailor::Matching::aligned, tailor::Matching::published}) {
        auto work = patchwork(seed, tube);
        work.params.matching = matching;
        const auto sewn = tailor::sew(work.garment, work.params);
        ASSERT_TRUE(sewn) << seed << " " << to_string(sewn.issues().front());
        EXPECT_TRUE(mesh::validate(sewn->garment).empty());
        const auto surface = tailor::surface_report(sewn->garment);
        EXPECT_EQ(surface.components, 1) << seed;
        // Band and pocket are disks that hang on one line: they change nothing. (Round a tube the band's edge is a ring.)
        EXPECT_EQ(surface.euler, tube ? 0 : 1) << seed;
        EXPECT_NEAR(mesh::rest_areas(sewn->garment).sum() / mesh::rest_areas(work.garment).sum(), 1, 1e-9);
        // Every seam: places in order, true lengths on both sides.
        for (std::size_t s = 0; s < sewn->lines.size(); ++s) {
          double a = 0, b = 0;
          const auto& g = sewn->garment;
          for (std::size_t k = 1; k < sewn->lines[s].size(); ++k) {
            const auto &before = sewn->lines[s][k - 1], &after = sewn->lines[s][k];
            const double da = (g.uv.row(after.a.front()) - g.uv.row(before.a.back())).norm(), db = (g.uv.row(after.b.front()) - g.uv.row(before.b.back())).norm();
            EXPECT_GT(da, 0);
            EXPECT_GT(db, 0);
            a += da;
            b += db;
          }
          EXPECT_NEAR(a, g.seams[s].length_a, 1.1e-3) << seed << " " << g.seams[s].name;
          EXPECT_NEAR(b, g.seams[s].length_b, 1.1e-3) << seed << " " << g.seams[s].name;
        }
        if (matching == tailor::Matching::published) continue;
        // Particles slide by less than a cell, and no triangle comes to harm.
        const auto angles = tailor::angle_report(sewn->garment);
        least = std::min(least, angles.least);
        for (const auto& report : sewn->seams) farthest = std::max(farthest, report.farthest_slide);
        EXPECT_GE(angles.least, 20) << seed << " " << tailor::place_text(sewn->garment, sewn->garment.faces(angles.least_face, 0));
      }
    }
  }
  EXPECT_LT(farthest, 0.013);
  RecordProperty("least_angle", fmt::format("{:.2f}", least));
  RecordProperty("farthest_slide", fmt::format("{:.2f} mm", farthest * 1e3));
}

TEST(seam_properties, shuffled_lists_give_the_same_bytes) {
  Rng rng(11);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    auto work = patchwork(seed, seed % 2 == 0);
    std::string reference;
    for (int round = 0; round < 12; ++round) {
      auto& seams = work.params.seams;
      for (std::size_t k = seams.size(); k > 1; --k) std::swap(seams[k - 1], seams[rng.below(k)]);
      const auto sewn = tailor::sew(work.garment, work.params);
      ASSERT_TRUE(sewn);
      const std::string bytes = io::format_garment(sewn->garment, io::Encoding::binary);
      if (reference.empty()) reference = bytes;
      EXPECT_EQ(bytes, reference) << seed;
    }
  }
}

TEST(seam_properties, mirrored_specs_give_mirrored_garments) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const auto matching : {tailor::Matching::aligned, tailor::Matching::published}) {
      auto plain = patchwork(seed, seed % 2 == 0);
      plain.params.matching = matching;
      const auto image = mirrored(plain);
      const auto one = tailor::sew(plain.garment, plain.params), other = tailor::sew(image.garment, image.params);
      ASSERT_TRUE(one && other) << seed;
      ASSERT_EQ(one->lines.size(), other->lines.size());
      for (std::size_t s = 0; s < one->lines.size(); ++s) {
        ASSERT_EQ(one->lines[s].size(), other->lines[s].size()) << seed << " " << one->seams[s].name;
        for (std::size_t k = 0; k < one->lines[s].size(); ++k) {
          const Eigen::Vector2d p = one->garment.uv.row(one->lines[s][k].a.front()), q = other->garment.uv.row(other->lines[s][k].a.front());
          EXPECT_LT((p - Eigen::Vector2d(-q.x(), q.y())).norm(), 1e-9) << seed << " " << one->seams[s].name;
        }
      }
    }
  }
}
