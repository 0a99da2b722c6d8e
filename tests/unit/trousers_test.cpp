#include "toile/placement/place.h"

#include "garments.h"
#include "people.h"
#include "toile/form/form.h"
#include "toile/placement/mirror.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

using namespace toile;
using namespace toile::placement;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

std::vector<std::string> codes(const Issues& issues) {
  std::vector<std::string> result;
  for (const Issue& issue : issues) result.push_back(issue.code);
  return result;
}

form::Measurements with_legs(double size) {
  form::Measurements m = testing_people::woman();
  m.inseam = 0.76, m.upperLeg = 0.56, m.knee = 0.38, m.ankle = 0.24, m.waistToKnee = 0.595;
  const auto scale = [&](double& value) { value *= size; };
  for (double* value : {&m.chest, &m.waist, &m.hips, &m.seat, &m.neck, &m.biceps, &m.wrist, &m.shoulderToShoulder, &m.hpsToWaistBack, &m.hpsToBust, &m.waistToArmpit, &m.waistToHips,
                        &m.waistToSeat, &m.waistToFloor, &m.shoulderToElbow, &m.shoulderToWrist}) {
    scale(*value);
  }
  for (auto* value : {&m.underbust, &m.bustSpan, &m.inseam, &m.upperLeg, &m.knee, &m.ankle, &m.waistToKnee}) scale(value->value());
  return m;
}

mesh::SupportMesh form_with_legs(double size = 1) {
  form::FormParams p;
  p.sex = form::Sex::female;
  p.arms = false;
  p.legs = true;
  p.vertices = 2500;
  auto form = form::make_form(with_legs(size), p);
  EXPECT_TRUE(form.has_value());
  return form->mesh;
}

const mesh::SupportMesh& body() {
  static const mesh::SupportMesh mesh = form_with_legs();
  return mesh;
}

struct Row {
  double v, low, high;  // extent of a panel at a height [m]
};

constexpr int kColumns = 10;
constexpr double kStep = 0.02;
constexpr int kFork = 33, kTop = 48;  // rows of the fork and of the waist

// Rows every 20 mm through the knots, kColumns cells wide; v = 0 is the fork.
void add_leg(mesh::GarmentMesh& g, const std::string& name, const std::vector<Row>& knots, double size) {
  const auto panel = static_cast<int>(g.panels.size());
  const auto base = static_cast<int>(g.vertex_count());
  test::add_rectangle(g, name, kColumns, kTop, kStep * size);
  for (int j = 0; j <= kTop; ++j) {
    const double v = (j - kFork) * kStep;
    std::size_t k = 1;
    while (k + 1 < knots.size() && v > knots[k].v) ++k;
    const double t = (v - knots[k - 1].v) / (knots[k].v - knots[k - 1].v);
    const double low = knots[k - 1].low + t * (knots[k].low - knots[k - 1].low), high = knots[k - 1].high + t * (knots[k].high - knots[k - 1].high);
    for (int i = 0; i <= kColumns; ++i) g.uv.row(base + j * (kColumns + 1) + i) << size * (low + (high - low) * i / kColumns), size * v;
  }
  g.panels[static_cast<std::size_t>(panel)].cell_weft = g.panels[static_cast<std::size_t>(panel)].cell_warp = kStep * size;
}

std::vector<Row> turned(std::vector<Row> rows) {
  for (Row& row : rows) row = {row.v, -row.high, -row.low};
  return rows;
}

// Trousers without darts and with a waistband drawn upright, closed at the centre back; crotch line `drop` under the waist seam.
mesh::GarmentMesh trousers(double size = 1, double width = 1) {
  std::vector<Row> front = {{-0.66, -0.105, 0.105}, {-0.3, -0.115, 0.118}, {-0.09, -0.135, 0.15}, {0, -0.157, 0.155}, {0.03, -0.125, 0.155}, {0.09, -0.103, 0.15}, {0.3, -0.09, 0.105}};
  std::vector<Row> back = {{-0.66, -0.115, 0.115}, {-0.3, -0.128, 0.125}, {-0.09, -0.157, 0.17}, {0, -0.165, 0.215}, {0.03, -0.165, 0.17}, {0.09, -0.16, 0.125}, {0.3, -0.13, 0.08}};
  for (auto* rows : {&front, &back}) {
    for (Row& row : *rows) row.low *= width, row.high *= width;
  }
  mesh::GarmentMesh g;
  add_leg(g, "leg_front", front, size);
  add_leg(g, "leg_front_m", turned(front), size);
  add_leg(g, "leg_back", back, size);
  add_leg(g, "leg_back_m", turned(back), size);
  const auto at = [&](int panel, int i, int j) { return panel * (kColumns + 1) * (kTop + 1) + j * (kColumns + 1) + i; };
  const auto seam = [&](const std::string& name) {
    g.seams.push_back({.id = static_cast<int>(g.seams.size()), .name = name, .kind = "plain"});
    return g.seams.back().id;
  };
  const int out_left = seam("outseam_left"), out_right = seam("outseam_right"), in_left = seam("inseam_left"), in_right = seam("inseam_right"), front_rise = seam("front_rise"),
            back_rise = seam("back_rise"), waist = seam("waist"), ends = seam("ends");
  for (int j = 0; j <= kTop; ++j) {
    g.welds.push_back({at(0, kColumns, j), at(2, 0, j), out_left});
    g.welds.push_back({at(1, 0, j), at(3, kColumns, j), out_right});
    if (j <= kFork) {
      g.welds.push_back({at(0, 0, j), at(2, kColumns, j), in_left});
      g.welds.push_back({at(1, kColumns, j), at(3, 0, j), in_right});
    }
    if (j < kFork) continue;
    g.welds.push_back({at(0, 0, j), at(1, kColumns, j), front_rise});
    g.welds.push_back({at(2, kColumns, j), at(3, 0, j), back_rise});
  }
  const auto band = static_cast<int>(g.vertex_count());
  test::add_rectangle(g, "trouser_waistband", 2, 4 * kColumns, 0.02 * size);
  for (int j = 0; j <= 4 * kColumns; ++j) {
    for (int i = 0; i <= 2; ++i) g.uv.row(band + 3 * j + i) << size * 0.02 * i, size * width * 2 * (0.195 + 0.21) * j / (4 * kColumns);
  }
  // from the centre back over the left side and the front
  const std::array<int, 4> order{2, 0, 1, 3};
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i <= kColumns; ++i) g.welds.push_back({at(order[static_cast<std::size_t>(k)], kColumns - i, kTop), band + 3 * (k * kColumns + i), waist});
  }
  for (int i = 0; i <= 2; ++i) g.welds.push_back({band + i, band + 3 * 4 * kColumns + i, ends});
  return g;
}

PlaceParams loose_band() {
  PlaceParams params;
  params.offset = 0.002;
  return params;
}

}  // namespace

TEST(trousers, panels_go_on_the_legs_that_their_seams_say_and_the_band_round_the_waist) {
  const auto g = trousers();
  const auto frame = body_frame(body());
  ASSERT_TRUE(frame && frame->leg_left);
  EXPECT_NEAR(frame->crotch, 0.76, 0.006);
  const auto layout = make_layout(g, fold_flat(g), body(), *frame, {});
  ASSERT_TRUE(layout.has_value()) << layout.issues().front().what;
  EXPECT_EQ(layout->panels[0].part, Part::leg_left);
  EXPECT_EQ(layout->panels[1].part, Part::leg_right);
  EXPECT_EQ(layout->panels[2].part, Part::leg_left);
  EXPECT_EQ(layout->panels[3].part, Part::leg_right);
  const PanelLayout& band = layout->panels[4];
  EXPECT_EQ(band.region, Region::waist);
  const double length = 2 * (0.195 + 0.21);
  const Vector2d front_low = band({0, 0.5 * length}), front_high = band({0.04, 0.5 * length}), left = band({0, 0.25 * length});
  EXPECT_NEAR(front_high.y() - front_low.y(), 0.04, 1e-9) << "its sewn edge is below";
  EXPECT_NEAR(0.5 * (front_low.y() + front_high.y()), frame->waist, 1e-9);
  const auto turns = [&](double a) { return a / layout->girth_trunk - std::round(a / layout->girth_trunk); };
  EXPECT_NEAR(turns(front_low.x()), 0, 0.02);
  EXPECT_NEAR(turns(left.x()), 0.25, 0.02);
  ASSERT_EQ(layout->trousers.size(), 2u);
  for (const TrouserLeg& leg : layout->trousers) {
    EXPECT_EQ(leg.panels.size(), 2u);
    EXPECT_EQ(leg.panels[1].own.size(), static_cast<std::size_t>(kTop + 1)) << "beside one another at the outseam";
  }
}

TEST(trousers, of_three_sizes_go_on_without_stretch) {
  for (const double size : {0.93, 1.0, 1.08}) {
    SCOPED_TRACE(size);
    const mesh::SupportMesh form = size == 1.0 ? body() : form_with_legs(size);
    const auto g = trousers(size);
    const auto placed = place(g, form, loose_band());
    ASSERT_TRUE(placed.has_value()) << placed.issues().front().what;
    for (const Issue& finding : placed->findings) ADD_FAILURE() << finding.what;
    const Report& report = placed->report;
    EXPECT_LT(report.max_strain, 0.005);
    EXPECT_LT(report.rms_strain, 0.001);
    EXPECT_TRUE(report.self_intersections.empty() && report.support_intersections.empty());
    EXPECT_EQ(report.vertices_inside, 0);
    EXPECT_LT(report.mean_seam_gap, 0.009);
    EXPECT_LT(report.largest_seam_gap, 0.04);
    // Where things are: hems on either side, the fork in the middle under the crotch, fronts in front.
    const auto at = [&](int panel, int i, int j) { return Vector3d(placed->garment.x.row(panel * (kColumns + 1) * (kTop + 1) + j * (kColumns + 1) + i).transpose()); };
    for (int panel = 0; panel < 4; ++panel) {
      const double side = panel % 2 == 0 ? 1 : -1;
      EXPECT_NEAR(side * at(panel, kColumns / 2, 0).x(), 0.14 * size, 0.05);
      EXPECT_GT((panel < 2 ? 1 : -1) * (at(panel, kColumns / 2, kTop / 2).z()), 0);
      const Vector3d fork = at(panel, (panel == 0 || panel == 3) ? 0 : kColumns, kFork);
      EXPECT_LT(std::abs(fork.x()), 0.03);
      EXPECT_LT(fork.y(), 0.76 * size);
      EXPECT_GT(fork.y(), 0.66 * size);
      const Vector3d top = at(panel, (panel == 0 || panel == 3) ? 0 : kColumns, kTop);
      EXPECT_LT(std::abs(top.x()), 0.03) << "the upper ends of the rise meet in the middle";
    }
  }
}

TEST(trousers, mirrored_on_a_mirrored_form_give_the_mirrored_result_to_the_last_bit) {
  mesh::SupportMesh form = body();
  for (Eigen::Index v = 0; v < form.x.rows(); ++v) {
    if (form.x(v, 0) > 0) form.x(v, 2) += 0.02 * form.x(v, 0);
  }
  auto g = trousers();
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    if (g.vertex_panel[v] == 1) g.uv(v, 0) *= 1.01;
  }
  PlaceParams params = loose_band();
  params.closing_steps = 10, params.swelling_steps = 10, params.settling_steps = 10, params.fine_steps = 5, params.polishing_steps = 10;
  params.panels["leg_front"].shift = {0.004, 0};
  const auto a = place(g, form, params), b = place(mirrored(g), mirrored(form), mirrored(params));
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ((mirrored(a->garment).x - b->garment.x).cwiseAbs().maxCoeff(), 0);
  ASSERT_EQ(a->report.fits.size(), b->report.fits.size());
  for (const auto& fits : {std::pair(a->report.fits, b->report.fits)}) {
    for (const PartFit& fit : fits.first) {
      for (const PartFit& other : fits.second) {
        if (other.part == mirrored(fit.part)) EXPECT_EQ(fit.rms, other.rms);
      }
    }
  }
}

TEST(trousers, names_do_not_make_legs_of_bands_yokes_and_facings) {
  const auto frame = body_frame(body());
  const auto region = [&](const std::string& name) {
    auto g = trousers();
    g.panels[4].name = g.panels[4].piece = name;
    const auto layout = make_layout(g, fold_flat(g), body(), *frame, {});
    return layout ? std::string(Choices<Region>::names[static_cast<std::size_t>(layout->panels[4].region)].first) : layout.issues().front().code;
  };
  for (const char* name : {"trouser_waistband", "trousers_band", "legs_waistband", "pants_belt", "jeans_waist_band", "trouser_waistband_facing"}) EXPECT_EQ(region(name), "waist") << name;
  for (const char* name : {"trouser_yoke", "leg_back_yoke", "pants_yoke"}) EXPECT_EQ(region(name), "torso") << name;
  for (const char* name : {"trouser_facing", "leg_facing", "trouser_pocket", "trousers_fly", "jeans_belt_loop"}) EXPECT_EQ(region(name), "no_region") << name;
  EXPECT_EQ(region("hood"), "no_region");
  EXPECT_EQ(region("elegant_skirt"), "torso");
  auto sleeve = trousers();
  sleeve.panels[4].name = sleeve.panels[4].piece = "leg_of_mutton_sleeve";
  EXPECT_NE(make_layout(sleeve, fold_flat(sleeve), body(), *frame, {}).issues().front().what.find("which arm"), std::string::npos);
}

TEST(trousers, what_cannot_be_placed_is_said) {
  struct Case {
    std::function<void(mesh::GarmentMesh&, PlaceParams&)> change;
    std::string code, item;
  };
  const std::vector<Case> cases = {
      {[](auto&, PlaceParams& p) { p.panels["leg_front"].shift[1] = p.panels["leg_back"].shift[1] = 0.06; }, "too_short", "panels leg_front, leg_back"},
      {[](mesh::GarmentMesh& g, auto&) { g = trousers(1, 0.8); }, "too_narrow", "panels leg_front, leg_back"},
      {[](auto&, PlaceParams& p) { p.panels["leg_front"] = {.region = Region::automatic, .point = "top", .at = {}, .to = {0.1, 1.02, 0.12}}; }, "bad_anchor", "panels.leg_front.to"},
      {[](auto&, PlaceParams& p) { p.panels["leg_front"].point = "tip"; }, "unknown_anchor", "panels.leg_front.point"},
      {[](auto&, PlaceParams& p) { p.panels["leg_front"].point = "top", p.panels["leg_front"].at = "waits"; }, "unknown_anchor", "panels.leg_front.at"},
      {[](mesh::GarmentMesh& g, auto&) {
         for (int p = 0; p < 4; ++p) g.panels[static_cast<std::size_t>(p)].name = g.panels[static_cast<std::size_t>(p)].piece = "leg_" + std::to_string(p);
       }, "no_region", "panel leg_0"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.code + " " + c.item);
    auto g = trousers();
    PlaceParams params = loose_band();
    c.change(g, params);
    const auto placed = place(g, body(), params);
    ASSERT_FALSE(placed.has_value());
    EXPECT_EQ(placed.issues().front().code, c.code) << placed.issues().front().what;
    EXPECT_EQ(placed.issues().front().place.item, c.item);
  }
  form::FormParams p;
  p.sex = form::Sex::female, p.arms = false, p.vertices = 1500;
  const auto missing = place(trousers(), form::make_form(with_legs(1), p)->mesh, {});
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(codes(missing.issues()), std::vector<std::string>(4, "no_legs"));
}

TEST(trousers, hang_where_an_anchor_says) {
  auto g = trousers();
  const auto frame = body_frame(body());
  PlaceParams params;
  params.panels["leg_back"].point = "top_left";
  params.panels["leg_back"].at = "hips";
  params.panels["leg_back_m"] = {.region = Region::automatic, .point = "top_right", .at = "hips", .to = {}};
  const auto layout = make_layout(g, fold_flat(g), body(), *frame, params);
  ASSERT_TRUE(layout.has_value());
  for (const TrouserLeg& leg : layout->trousers) {
    const LegAxis axis(leg.side > 0 ? *frame->leg_left : *frame->leg_right, LegAxis::Shape::trousers);
    const PanelLayout& back = layout->panels[leg.side > 0 ? 2 : 3];
    EXPECT_NEAR(axis.at(back(Vector2d(leg.side * -0.13, 0.3)).y()).middle.y(), frame->hips, 1e-6);
  }
}
