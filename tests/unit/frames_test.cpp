// Point caches and animated glTF.
#include "cloth_fixtures.h"
#include "results.h"
#include "toile/io/export.h"
#include "toile/io/frames.h"

#include <gtest/gtest.h>

namespace toile::io {
namespace {

using test::checked;

FrameSequence sequence(Eigen::Index points) {
  FrameSequence frames;
  for (int k = 0; k < 3; ++k) {
    frames.times.push_back(0.25 * k);
    mesh::Points3 x(points, 3);
    for (Eigen::Index i = 0; i < points; ++i) x.row(i) << 0.5 * static_cast<double>(i), k, -0.125 * k;
    frames.points.push_back(x);
  }
  return frames;
}

TEST(Frames, AnMddReadsBack) {
  const FrameSequence frames = sequence(5), back = checked(parse_mdd(format_mdd(frames), "f.mdd"));
  EXPECT_EQ(back.times, frames.times);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(back.points[k], frames.points[k]);
  // Big-endian, counts first.
  EXPECT_EQ(format_mdd(frames).substr(0, 8), std::string("\0\0\0\3\0\0\0\5", 8));
}

TEST(Frames, WhatIsNoMddIsRefused) {
  const std::string good = format_mdd(sequence(5));
  for (const std::size_t n : {std::size_t{0}, std::size_t{7}, std::size_t{8}, good.size() - 1}) EXPECT_EQ(test::codes(parse_mdd(good.substr(0, n), "f.mdd")), "bad_frames") << n;
  EXPECT_EQ(test::codes(parse_mdd(good + "x", "f.mdd")), "bad_frames");
  EXPECT_EQ(test::codes(parse_mdd("\xff\xff\xff\xff" + good.substr(4), "f.mdd")), "bad_frames");
  std::string huge = good;
  huge[0] = huge[4] = 0x7f;
  EXPECT_EQ(test::codes(parse_mdd(huge, "f.mdd")), "bad_frames");
  std::string back_in_time = good;
  std::swap_ranges(back_in_time.begin() + 8, back_in_time.begin() + 12, back_in_time.begin() + 12);
  EXPECT_EQ(test::codes(parse_mdd(back_in_time, "f.mdd")), "bad_frames");
}

TEST(Frames, APc2HasItsHeader) {
  const std::string bytes = format_pc2(sequence(5));
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(bytes.size(), 32 + 3 * 5 * 12u);
  EXPECT_EQ(bytes[16], 5);
  EXPECT_EQ(bytes[28], 3);
}

TEST(Frames, AGltfMovesByTargets) {
  const mesh::GarmentMesh g = fixtures::sheet(2, 2, 0.1, 0.1, fixtures::shirting(), [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
  const FrameSequence frames = sequence(g.x.rows());
  const std::string text = format_gltf(g, nullptr, {&frames, nullptr}, GltfContainer::json);
  const auto count = [&](const std::string& word) {
    int n = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("\"targets\""), 1);
  EXPECT_EQ(count("\"POSITION\""), 4);
  EXPECT_EQ(count("\"animations\""), 1);
  EXPECT_EQ(count("\"path\": \"weights\""), 1);
  // Without frames nothing of this is there.
  EXPECT_EQ(format_gltf(g, nullptr, {}, GltfContainer::json), format_gltf(g, GltfContainer::json));
  EXPECT_EQ(format_gltf(g, GltfContainer::json).find("targets"), std::string::npos);
}

}  // namespace
}  // namespace toile::io
