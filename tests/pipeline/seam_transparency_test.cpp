// A seam that weighs nothing and stiffens nothing is not there: strips cut in two at several angles and sewn together again hang
// and pull like the uncut strip. Pattern, mesh, seam and fabric go through the ordinary stages.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "results.h"
#include "toile/dynamics/simulate.h"
#include "toile/io/fabric_yaml.h"
#include "toile/io/file.h"
#include "toile/io/pattern_yaml.h"
#include "toile/tailor/layer.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/sew.h"

using namespace toile;
using test::checked;

namespace {

struct Corner {
  std::string name;
  double x, y;  // in the strip's frame: x along it, y across [mm]
};

struct Piece {
  std::string name;
  std::vector<Corner> corners;
  std::vector<std::string> edges;  // from each corner to the next
};

/// A strip along x, whole or cut through its middle along a line at this angle to its axis [degrees].
struct Strip {
  double length, width;    // [mm]
  double warp;             // of the warp to the axis [degrees]
  double cell;             // [mm]
  std::optional<double> cut;
};

std::vector<Piece> pieces_of(const Strip& s) {
  const double l = s.length, w = s.width;
  if (!s.cut) return {{"whole", {{"a", 0, 0}, {"b", l, 0}, {"c", l, w}, {"d", 0, w}}, {"low", "tip", "high", "clamp"}}};
  if (*s.cut == 0) {
    return {{"first", {{"a", 0, 0}, {"b", l, 0}, {"c", l, w / 2}, {"d", 0, w / 2}}, {"low", "tip", "cut", "clamp"}},
            {"second", {{"a", 0, w / 2}, {"b", l, w / 2}, {"c", l, w}, {"d", 0, w}}, {"cut", "tip", "high", "clamp"}}};
  }
  const double half = 0.5 * w / std::tan(*s.cut * std::numbers::pi / 180), low = l / 2 - half, high = l / 2 + half;
  return {{"first", {{"a", 0, 0}, {"b", low, 0}, {"c", high, w}, {"d", 0, w}}, {"low", "cut", "high", "clamp"}},
          {"second", {{"a", low, 0}, {"b", l, 0}, {"c", l, w}, {"d", high, w}}, {"low", "tip", "high", "cut"}}};
}

/// The strip flat, along x, its width along z; seams closed.
mesh::GarmentMesh make(const Strip& s, const fabric::Card& card) {
  const std::vector<Piece> pieces = pieces_of(s);
  const double a = s.warp * std::numbers::pi / 180;
  std::string text = "name: strip\nunits: mm\ny: up\npieces:\n";
  for (const Piece& p : pieces) {
    text += fmt::format("  {}:\n    cut: 1\n    grain: [[0, 0], [{}, {}]]\n    points:\n", p.name, 10 * std::cos(a), 10 * std::sin(a));
    for (const Corner& c : p.corners) text += fmt::format("      {}: [{}, {}]\n", c.name, c.x, c.y);
    text += "    outline:\n";
    for (std::size_t k = 0; k < p.edges.size(); ++k) {
      text += fmt::format("      - {{name: {}, path: [{}, {}]}}\n", p.edges[k], p.corners[k].name, p.corners[(k + 1) % p.corners.size()].name);
    }
  }
  tailor::MeshParams grid;
  grid.cell = 1e-3 * s.cell;
  mesh::GarmentMesh garment = checked(tailor::mesh_panels(checked(pattern::cut_panels(checked(io::parse_pattern(text, "strip.yaml")))), grid));
  if (pieces.size() == 2) {
    tailor::SewParams sewing;
    tailor::SeamSpec seam;
    seam.name = "cut";
    seam.a = {"first.cut"};
    seam.b = {"-second.cut"};
    sewing.seams = {seam};
    garment = checked(tailor::sew(garment, sewing)).garment;
  }
  tailor::LayerParams layers;
  layers.base = card.name;
  garment = checked(tailor::layer(garment, {card}, layers)).garment;
  // Each panel by two of its corners to where the strip has it.
  for (std::size_t p = 0; p < garment.panels.size(); ++p) {
    const Piece* piece = nullptr;
    for (const Piece& candidate : pieces) {
      if (candidate.name == garment.panels[p].name) piece = &candidate;
    }
    EXPECT_NE(piece, nullptr) << garment.panels[p].name;
    const auto uv_of = [&](const std::string& name) -> Eigen::Vector2d {
      for (const mesh::NamedPoint& point : garment.points) {
        if (point.panel == static_cast<int>(p) && point.name == name) return garment.uv.row(point.vertex).transpose();
      }
      throw std::runtime_error("no point " + name);
    };
    const Eigen::Vector2d from = uv_of("a"), along = uv_of("b") - from;
    const Eigen::Vector2d origin(1e-3 * piece->corners[0].x, 1e-3 * piece->corners[0].y);
    const Eigen::Vector2d e = along.normalized(), n(-e.y(), e.x());
    for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
      if (garment.vertex_panel[v] != static_cast<int>(p)) continue;
      const Eigen::Vector2d d = garment.uv.row(v).transpose() - from;
      garment.x.row(v) = Eigen::RowVector3d(origin.x() + d.dot(e), 0, -(origin.y() + d.dot(n)));
    }
  }
  for (const mesh::Weld& weld : garment.welds) garment.x.row(weld.b) = garment.x.row(weld.a);
  return garment;
}

std::vector<std::string> ends(const mesh::GarmentMesh& garment, const std::string& edge) {
  std::vector<std::string> result;
  for (const mesh::Run& run : garment.runs) {
    if (run.name == edge) result.push_back(garment.panels[static_cast<std::size_t>(run.panel)].name + "." + edge);
  }
  return result;
}

fabric::Card suiting() { return checked(io::read_fabric(checked(io::read_file(std::string(TOILE_SOURCE_DIR) + "/samples/fabrics/suiting.yaml")), "suiting.yaml")); }

/// Drop of the free end of the strip, clamped level at the other [m].
double drop(const Strip& strip, const fabric::Card& card) {
  const mesh::GarmentMesh garment = make(strip, card);
  dynamics::SimulationParams params;
  params.self_reach = 1e-4;
  params.residual = 2e-4;
  params.max_iterations = 3000;
  dynamics::ConstraintSpec clamp;
  clamp.on = ends(garment, "clamp");
  clamp.kind = dynamics::Hold::clamp;
  params.constraints = {clamp};
  const auto result = checked(dynamics::simulate(garment, std::nullopt, params));
  EXPECT_TRUE(result.report.converged) << result.report.residual;
  const auto tip = checked(dynamics::select(garment, {ends(garment, "tip"), 0, 1, {}}, "tip"));
  double sum = 0;
  for (std::size_t k = 0; k < tip.vertices.size(); ++k) sum -= tip.share[k] * result.garment.x(tip.vertices[k], 1);
  return sum;
}

/// Forces at these extensions of the strip, both ends held in jaws [N].
std::vector<double> pull(const Strip& strip, const fabric::Card& card, double extension, int steps) {
  const mesh::GarmentMesh garment = make(strip, card);
  dynamics::SimulationParams params;
  params.gravity = 0;
  params.self_reach = 1e-4;
  params.residual = 1e-4;
  params.max_iterations = 2000;
  params.duration = 1;
  params.increments = steps;
  params.record = "record.csv";
  dynamics::ConstraintSpec fixed, jaw;
  fixed.name = "fixed";
  fixed.on = ends(garment, "clamp");
  jaw.name = "jaw";
  jaw.on = ends(garment, "tip");
  jaw.kind = dynamics::Hold::drive;
  jaw.times = {0, 1};
  jaw.move = {{0, 0, 0}, {1e-3 * strip.length * extension, 0, 0}};
  params.constraints = {fixed, jaw};
  const auto result = checked(dynamics::simulate(garment, std::nullopt, params));
  EXPECT_TRUE(result.report.converged) << result.report.residual;
  // Column jaw.force_x_N of the record.
  std::vector<std::vector<std::string>> rows;
  std::string cell;
  rows.emplace_back();
  for (char c : result.record) {
    if (c == ',' || c == '\n') {
      rows.back().push_back(cell);
      cell.clear();
      if (c == '\n') rows.emplace_back();
    } else {
      cell += c;
    }
  }
  const auto column = std::find(rows[0].begin(), rows[0].end(), "jaw.force_x_N") - rows[0].begin();
  std::vector<double> forces;
  for (std::size_t r = 1; r + 1 < rows.size(); ++r) forces.push_back(std::stod(rows[r][static_cast<std::size_t>(column)]));
  return forces;
}

}  // namespace

TEST(seam_transparency, cantilever) {
  const fabric::Card card = suiting();
  for (const double warp : {0.0, 45.0}) {
    for (const double length : {40.0, 60.0}) {
      Strip strip{length, 16, warp, 2, {}};
      const double uncut = drop(strip, card);
      fmt::print("cantilever, {} mm, warp at {} degrees: uncut {:.3f} mm\n", length, warp, 1e3 * uncut);
      for (const double cut : {0.0, 30.0, 45.0, 90.0}) {
        strip.cut = cut;
        const double sewn = drop(strip, card);
        fmt::print("  cut at {:2} degrees: {:.3f} mm, ratio {:.5f}\n", cut, 1e3 * sewn, sewn / uncut);
        EXPECT_NEAR(sewn / uncut, 1, 0.02) << "length " << length << " mm, warp at " << warp << ", cut at " << cut << " degrees";
      }
    }
  }
}

TEST(seam_transparency, bias_extension) {
  const fabric::Card card = suiting();
  constexpr std::array cells{5.0, 2.5};
  std::array<double, 2> largest{};
  for (std::size_t c = 0; c < cells.size(); ++c) {
    Strip strip{150, 50, 45, cells[c], {}};
    const std::vector<double> uncut = pull(strip, card, 0.1, 4);
    for (const double cut : {0.0, 30.0, 45.0, 90.0}) {
      strip.cut = cut;
      const std::vector<double> sewn = pull(strip, card, 0.1, 4);
      ASSERT_EQ(sewn.size(), uncut.size());
      fmt::print("bias extension, {} mm cells, cut at {:2} degrees:", cells[c], cut);
      for (std::size_t k = 0; k < sewn.size(); ++k) {
        const double ratio = sewn[k] / uncut[k];
        fmt::print("  {} %: {:.4f}/{:.4f} N = {:.4f}", 2.5 * static_cast<double>(k + 1), sewn[k], uncut[k], ratio);
        largest[c] = std::max(largest[c], std::abs(ratio - 1));
      }
      fmt::print("\n");
    }
  }
  // Ten coarse cells across are not enough for 2 %, twenty are; what is left goes with the cells.
  EXPECT_LT(largest[1], 0.02);
  EXPECT_LT(largest[1], 0.5 * largest[0]);
}
