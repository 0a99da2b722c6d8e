// The sample garments with the specs of their pipelines, on a coarser grid, put on dress forms of three sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "results.h"
#include "toile/form/form.h"
#include "toile/io/fabric_yaml.h"
#include "toile/io/file.h"
#include "toile/io/pattern_yaml.h"
#include "toile/io/record_yaml.h"
#include "toile/placement/place.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/layer.h"
#include "toile/tailor/mesh_panels.h"
#include "toile/tailor/pleat.h"
#include "toile/tailor/sew.h"

using namespace toile;
using test::checked;

namespace {

std::string source(const std::string& name) { return checked(io::read_file(std::string(TOILE_SOURCE_DIR) + "/" + name)); }

template <class Params>
Params spec(const std::string& garment, const std::string& name) {
  return checked(io::read_record<Params>(source("pipelines/" + garment + "/" + name), name));
}

// scale  of the whole pattern: garments of another size
mesh::GarmentMesh layered(const std::string& garment, const std::vector<std::string>& fabrics, double cell, double scale = 1) {
  auto pattern = checked(io::parse_pattern(source("samples/patterns/" + garment + ".yaml"), garment));
  auto mesh_params = spec<tailor::MeshParams>(garment, "mesh.yaml");
  mesh_params.cell = cell / scale;
  mesh::GarmentMesh mesh = checked(tailor::mesh_panels(checked(pattern::cut_panels(pattern)), mesh_params));
  const auto seams = checked(tailor::expand_pleats(mesh, spec<tailor::SewParams>(garment, "seams.yaml")));
  mesh = checked(tailor::add_folds(checked(tailor::sew(mesh, seams)).garment, seams.folds)).garment;
  std::vector<fabric::Card> cards;
  for (const std::string& name : fabrics) cards.push_back(checked(io::read_fabric(source("samples/fabrics/" + name + ".yaml"), name)));
  mesh = checked(tailor::layer(mesh, cards, spec<tailor::LayerParams>(garment, "layers.yaml"))).garment;
  mesh.uv *= scale;
  mesh.x *= scale;
  for (mesh::Panel& panel : mesh.panels) panel.cell_warp *= scale, panel.cell_weft *= scale;
  return mesh;
}

mesh::SupportMesh form_of(const std::string& garment, const std::string& measurements, double scale = 1) {
  auto params = spec<form::FormParams>(garment, "form.yaml");
  params.vertices = 3000;
  mesh::SupportMesh form = checked(form::make_form(checked(io::read_record<form::Measurements>(source("samples/measurements/" + measurements + ".yaml"), measurements)), params)).mesh;
  form.x *= scale;
  for (auto& [name, at] : form.landmarks) {
    for (double& value : at) value *= scale;
  }
  return form;
}

void expect_placed(const placement::Placed& placed, const placement::PlaceParams& params, double mean_gap, double largest_gap) {
  for (const Issue& finding : placed.findings) ADD_FAILURE() << to_string(finding);
  const placement::Report& report = placed.report;
  EXPECT_LE(report.max_strain, 0.005);
  EXPECT_LE(report.rms_strain, 0.001);
  EXPECT_LE(std::abs(report.area_change), 0.001);
  EXPECT_GE(report.smallest_gap, params.clearance);
  EXPECT_EQ(report.vertices_inside, 0);
  EXPECT_TRUE(report.support_intersections.empty());
  EXPECT_TRUE(report.self_intersections.empty());
  EXPECT_LE(report.mean_seam_gap, mean_gap);
  EXPECT_LE(report.largest_seam_gap, largest_gap);
}

constexpr double kCell = 0.015;

}  // namespace

TEST(placed_garments, tee) {
  const auto params = spec<placement::PlaceParams>("tee", "placement.yaml");
  const auto placed = checked(placement::place(layered("tee", {"shirting"}, kCell), form_of("tee", "man178"), params));
  expect_placed(placed, params, 0.006, 0.015);
}

TEST(placed_garments, skirt) {
  const auto params = spec<placement::PlaceParams>("skirt", "placement.yaml");
  const auto placed = checked(placement::place(layered("skirt", {"suiting", "fusible_canvas"}, kCell), form_of("skirt", "woman"), params));
  expect_placed(placed, params, 0.005, 0.012);
}

TEST(placed_garments, trousers_of_three_sizes) {
  const auto params = spec<placement::PlaceParams>("trousers", "placement.yaml");
  for (const double scale : {0.93, 1.0, 1.12}) {
    SCOPED_TRACE(scale);
    const auto placed = checked(placement::place(layered("trousers", {"suiting", "fusible_canvas"}, kCell, scale), form_of("trousers", "woman", scale), params));
    expect_placed(placed, params, 0.008, 0.035);
  }
}

TEST(placed_garments, waistcoat_is_lapped_left_over_right) {
  const auto params = spec<placement::PlaceParams>("waistcoat", "placement.yaml");
  const auto g = layered("waistcoat", {"suiting", "lining", "fusible_canvas"}, kCell);
  const auto placed = checked(placement::place(g, form_of("waistcoat", "man178"), params));
  expect_placed(placed, params, 0.005, 0.012);
  // buttons: on the right front, nearer to the body than the buttonholes over them
  int over = 0;
  for (const mesh::Fastener& fastener : g.fasteners) over += placed.garment.x(fastener.b, 2) > placed.garment.x(fastener.a, 2);
  EXPECT_GE(over, 5);
}

TEST(placed_garments, jacket_has_its_lapels_turned_and_its_sleeves_on) {
  const auto params = spec<placement::PlaceParams>("jacket", "placement.yaml");
  const auto g = layered("jacket", {"suiting", "fusible_canvas"}, kCell);
  const auto placed = checked(placement::place(g, form_of("jacket", "man178"), params));
  expect_placed(placed, params, 0.009, 0.045);
  // As cut, the notch of the lapel lies 13 mm from the centre front.
  int lapels = 0;
  for (const mesh::NamedPoint& point : g.points) {
    const std::string& panel = g.panels[static_cast<std::size_t>(point.panel)].name;
    if (point.name != "notch" || (panel != "front" && panel != "front_m")) continue;
    EXPECT_GT((panel == "front" ? 1 : -1) * placed.garment.x(point.vertex, 0), 0.06) << panel;
    ++lapels;
  }
  EXPECT_EQ(lapels, 2);
  // The collar is turned at its roll line: at the centre back the edge of its fall hangs under it, on the outside.
  const auto at = [&](const std::string& name) -> Eigen::Vector3d {
    for (const mesh::NamedPoint& point : g.points) {
      if (point.name == name && g.panels[static_cast<std::size_t>(point.panel)].name == "undercollar") return placed.garment.x.row(point.vertex).transpose();
    }
    ADD_FAILURE() << "the undercollar has no point " << name;
    return Eigen::Vector3d::Zero();
  };
  EXPECT_LT(at("cb_fall").y(), at("cb_roll").y() - 0.025);
  EXPECT_LT(at("cb_fall").z(), at("cb_roll").z());
  EXPECT_LT(at("cb_neck").y(), at("cb_roll").y() - 0.02);
  for (std::size_t s = 0; s < g.seams.size(); ++s) {
    if (g.seams[s].name.rfind("gorge", 0) != 0) continue;
    for (const mesh::Weld& weld : g.welds) {
      if (weld.seam == static_cast<int>(s)) EXPECT_LT((placed.garment.x.row(weld.a) - placed.garment.x.row(weld.b)).norm(), 0.015) << g.seams[s].name;
    }
  }
  // The fronts are lapped.
  for (const mesh::Fastener& fastener : g.fasteners) EXPECT_LT((placed.garment.x.row(fastener.a) - placed.garment.x.row(fastener.b)).norm(), 0.02);
}

TEST(placed_garments, one_spec_serves_three_sizes) {
  const auto params = spec<placement::PlaceParams>("tee", "placement.yaml");
  for (const double scale : {0.85, 1.12}) {
    SCOPED_TRACE(scale);
    expect_placed(checked(placement::place(layered("tee", {"shirting"}, kCell, scale), form_of("tee", "man178", scale), params)), params, 0.007, 0.02);
  }
  // the same garment, loose on a smaller form
  expect_placed(checked(placement::place(layered("tee", {"shirting"}, kCell), form_of("tee", "man178", 0.94), params)), params, 0.007, 0.02);
  const auto jacket = spec<placement::PlaceParams>("jacket", "placement.yaml");
  for (const double scale : {0.9, 1.1}) {
    SCOPED_TRACE(scale);
    expect_placed(checked(placement::place(layered("jacket", {"suiting", "fusible_canvas"}, kCell, scale), form_of("jacket", "man178", scale), jacket)), jacket, 0.011, 0.055);
  }
}
