#include "toile/inspect/picture.h"

#include "shapes.h"
#include "toile/base/parallel.h"
#include "toile/inspect/color_map.h"
#include "toile/inspect/strain.h"

#include <gtest/gtest.h>

namespace toile::inspect {
namespace {

double lightness(const Srgb& c) {
  // OKLab's L from linear sRGB: the reverse of what the scales are made with.
  const double r = linear_from_srgb(c[0]), g = linear_from_srgb(c[1]), b = linear_from_srgb(c[2]);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return 0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s;
}

TEST(ColorMap, lightness_is_linear_in_the_value) {
  for (int i = 0; i <= 20; ++i) {
    const double t = i / 20.0;
    EXPECT_NEAR(lightness(sequential_color(t)), 0.95 - 0.65 * t, 2e-3) << t;
    EXPECT_NEAR(lightness(diverging_color(t)), 0.965 - 0.52 * t, 2e-3) << t;
    EXPECT_NEAR(lightness(diverging_color(-t)), lightness(diverging_color(t)), 2e-3) << t;
  }
}

TEST(ColorMap, ends_are_clamped_and_signs_differ_in_hue) {
  EXPECT_EQ(sequential_color(-3), sequential_color(0));
  EXPECT_EQ(sequential_color(3), sequential_color(1));
  const Srgb negative = diverging_color(-1), positive = diverging_color(1);
  EXPECT_GT(negative[2], negative[0] + 0.3);
  EXPECT_GT(positive[0], positive[2] + 0.3);
}

TEST(Lettering, marks_ink_where_the_letters_are) {
  Image image(60, 30);
  draw_text(image, 5, 25, 18, {0, 0, 0}, "H");
  EXPECT_LT(image.pixel(5, 15)[0], 120);   // left stem
  EXPECT_LT(image.pixel(17, 15)[0], 120);  // right stem
  EXPECT_EQ(image.pixel(11, 10)[0], 255);  // between the stems, above the bar
  EXPECT_EQ(image.pixel(40, 15)[0], 255);
  EXPECT_GT(text_width(18, "HH"), 2 * text_width(18, "H"));
  EXPECT_EQ(text_width(18, "\xC2\xB0"), text_width(18, "*")) << "two bytes are one sign";
}

TEST(Png, what_is_written_is_read_back) {
  if (!png_available()) GTEST_SKIP() << "built without libpng";
  Image image(7, 5);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<std::uint8_t>(i * 37);
  const auto bytes = encode_png(image);
  ASSERT_TRUE(bytes);
  const auto again = decode_png(*bytes, "x.png");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->width, 7);
  EXPECT_EQ(again->height, 5);
  EXPECT_EQ(again->rgb, image.rgb);
  EXPECT_EQ(decode_png("no picture", "x.png").issues().at(0).code, "bad_png");
}

class Picture : public testing::Test {
 protected:
  void SetUp() override {
    if (!pictures_available()) GTEST_SKIP() << "built without Embree";
  }
  void TearDown() override { set_thread_count(0); }
};

TEST_F(Picture, a_ball_fills_the_frame_as_a_disc_of_the_right_size) {
  PictureParams params;
  params.size = "200x300";
  params.elevation = 0;
  params.view = View::front;
  const auto ball = shapes::sphere({0.3, 1.0, -0.2}, 0.5, 4);
  const auto image = draw_picture(params, nullptr, &ball);
  ASSERT_TRUE(image);
  // Margins are 4.5 % of the shorter side: the disc is 182 pixels wide, in the middle.
  const int background = image->pixel(2, 2)[0];
  int left = 200, right = 0, covered = 0;
  for (int y = 0; y < 240; ++y) {  // below the ball lies its shadow
    for (int x = 0; x < 200; ++x) {
      if (std::abs(image->pixel(x, y)[2] - image->pixel(x, y)[0]) > 12) {  // skin is warm, the background is not
        left = std::min(left, x);
        right = std::max(right, x);
        ++covered;
      }
    }
  }
  EXPECT_NEAR(right - left + 1, 182, 2);
  EXPECT_NEAR(left, 9, 2);
  EXPECT_NEAR(covered, 3.14159 * 91 * 91, 0.02 * 26000);
  EXPECT_NEAR(background, 255 * params.background[0], 1);
}

TEST_F(Picture, the_same_at_any_number_of_threads) {
  PictureParams params;
  params.size = "80x100";
  params.color = "shear";
  const auto ball = shapes::sphere({0, 0.4, 0}, 0.2, 3);
  const auto cloth = shapes::tube(0.25, 0.5, 40, 20);
  set_thread_count(1);
  const auto one = draw_picture(params, &cloth, &ball);
  ASSERT_TRUE(one);
  for (const int threads : {2, 5}) {
    set_thread_count(threads);
    const auto several = draw_picture(params, &cloth, &ball);
    ASSERT_TRUE(several);
    EXPECT_EQ(several->rgb, one->rgb) << threads << " threads";
  }
}

TEST_F(Picture, front_and_back_see_their_own_side) {
  // A red panel before a ball hides it from the front only.
  mesh::GarmentMesh g;
  shapes::add_panel(g, "front", 0.6, 0.6, 6, 6, {-0.3, 0.7, 0.4});
  g.laminates[0].equivalent.color = {0.8, 0.05, 0.05};
  const auto ball = shapes::sphere({0, 1, 0}, 0.2, 3);
  const auto reddish = [&](View view) {
    PictureParams params;
    params.size = "100x100";
    params.view = view;
    const auto image = draw_picture(params, &g, &ball);
    EXPECT_TRUE(image);
    const std::uint8_t* p = image->pixel(50, 50);
    return p[0] > p[2] + 70;
  };
  EXPECT_TRUE(reddish(View::front));
  EXPECT_FALSE(reddish(View::back));
}

TEST_F(Picture, colours_carry_the_strain) {
  mesh::GarmentMesh g;
  shapes::add_panel(g, "sheet", 0.5, 0.5, 10, 10);
  g.x.col(1) *= 1.02;  // the warp runs along y
  PictureParams params;
  params.size = "120x120";
  params.view = View::flat;
  params.lines = Lines::none;
  params.color = "strain_warp";
  params.range = std::array{-2.0, 2.0};
  auto image = draw_picture(params, &g, nullptr);
  ASSERT_TRUE(image);
  const auto red = [](const std::uint8_t* p) { return p[0] > p[2] + 60; };
  EXPECT_TRUE(red(image->pixel(50, 55)));
  g.x.col(1) /= 1.02;
  image = draw_picture(params, &g, nullptr);
  const std::uint8_t* p = image->pixel(50, 55);
  EXPECT_LT(std::abs(p[0] - p[2]), 25);
}

TEST_F(Picture, bad_requests_are_named) {
  mesh::GarmentMesh g;
  shapes::add_panel(g, "sheet", 0.5, 0.5, 2, 2);
  PictureParams params;
  params.color = "strain_wrap";
  auto result = draw_picture(params, &g, nullptr);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.issues().at(0).code, "unknown_color");
  EXPECT_NE(result.issues().at(0).remedy.find("strain_warp"), std::string::npos);
  params.color = "plain";
  params.size = "900";
  EXPECT_EQ(draw_picture(params, &g, nullptr).issues().at(0).code, "bad_size");
  params.size = "64x64";
  params.view = View::flat;
  const auto ball = shapes::sphere({0, 0, 0}, 1, 1);
  EXPECT_EQ(draw_picture(params, nullptr, &ball).issues().at(0).code, "bad_view");
}

TEST(Strain, of_a_sheet_stretched_and_sheared_by_hand) {
  mesh::GarmentMesh g;
  shapes::add_panel(g, "sheet", 0.4, 0.3, 4, 3);
  Eigen::Matrix2d f;  // columns: images of weft and warp
  f << 1.03, 0.2, 0.0, 0.98;
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
    const Eigen::Vector2d p = f * g.uv.row(v).transpose();
    g.x.row(v) << 0.3, p.x(), p.y();  // any plane will do
  }
  const FaceStrain s = face_strain(g);
  const double warp = std::hypot(0.2, 0.98);
  for (Eigen::Index i = 0; i < g.face_count(); ++i) {
    EXPECT_NEAR(s.weft[i], 0.03, 1e-12);
    EXPECT_NEAR(s.warp[i], warp - 1, 1e-12);
    EXPECT_NEAR(s.shear[i], std::asin(0.2 / warp), 1e-12);
    EXPECT_NEAR(s.bias[i], std::hypot(1.23, 0.98) / std::sqrt(2.0) - 1, 1e-12);
  }
  EXPECT_TRUE(s.degenerate.empty());
}

TEST(Strain, tension_passes_through_the_measured_point_with_the_measured_work) {
  mesh::GarmentMesh g;
  shapes::add_panel(g, "sheet", 1, 1, 1, 1);
  const auto& card = g.laminates[0].equivalent;
  FaceStrain s = face_strain(g);
  const auto warp_force = [&](double e) {
    s.warp.setConstant(e);
    return face_tension(g, s).warp[0];
  };
  EXPECT_NEAR(warp_force(card.warp.strain_max), card.tensile_force_max, 1e-6);
  double work = 0;
  const int steps = 4000;
  for (int i = 0; i < steps; ++i) work += warp_force(card.warp.strain_max * (i + 0.5) / steps) * card.warp.strain_max / steps;
  EXPECT_NEAR(work, 0.5 * card.warp.linearity * card.tensile_force_max * card.warp.strain_max, 1e-5 * work);
  EXPECT_EQ(warp_force(0), 0);
  EXPECT_LT(warp_force(-0.01), 0);
}

}  // namespace
}  // namespace toile::inspect
