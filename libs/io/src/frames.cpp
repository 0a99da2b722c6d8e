#include "toile/io/frames.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace toile::io {
namespace {

template <class T>
void put(std::string& out, T value, bool big) {
  static_assert(sizeof(T) == 4);
  auto word = std::bit_cast<std::uint32_t>(value);
  for (int k = 0; k < 4; ++k) out += static_cast<char>(word >> 8 * (big ? 3 - k : k) & 0xff);
}

template <class T>
T big_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t k = 0; k < 4; ++k) word = word << 8 | static_cast<unsigned char>(bytes[at + k]);
  return std::bit_cast<T>(word);
}

void put_points(std::string& out, const FrameSequence& frames, bool big) {
  for (const mesh::Points3& x : frames.points) {
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      for (int c = 0; c < 3; ++c) put(out, static_cast<float>(x(i, c)), big);
    }
  }
}

std::int32_t points_in(const FrameSequence& frames) { return frames.points.empty() ? 0 : static_cast<std::int32_t>(frames.points.front().rows()); }

void check(const FrameSequence& frames) {
  TOILE_CHECK(frames.times.size() == frames.points.size(), "{} times, {} frames", frames.times.size(), frames.points.size());
  for (const mesh::Points3& x : frames.points) TOILE_CHECK(x.rows() == frames.points.front().rows(), "{} points, {} in the first frame", x.rows(), frames.points.front().rows());
}

}  // namespace

std::string format_mdd(const FrameSequence& frames) {
  check(frames);
  std::string out;
  put(out, static_cast<std::int32_t>(frames.points.size()), true);
  put(out, points_in(frames), true);
  for (const double t : frames.times) put(out, static_cast<float>(t), true);
  put_points(out, frames, true);
  return out;
}

Result<FrameSequence> parse_mdd(std::string_view bytes, const std::string& name) {
  const auto bad = [&](std::string what) { return Issue{"bad_frames", {.file = name}, std::move(what), "give an .mdd file as toile-simulate writes with `frames`"}; };
  if (bytes.size() < 8) return bad("is too short for a point cache");
  const auto frames = big_at<std::int32_t>(bytes, 0), points = big_at<std::int32_t>(bytes, 4);
  if (frames < 0 || points < 0) return bad(fmt::format("has {} frames of {} points", frames, points));
  const auto f = static_cast<std::uint64_t>(frames), n = static_cast<std::uint64_t>(points);
  if (f > bytes.size() / 4 || (f > 0 && n > bytes.size() / 12 / f) || bytes.size() != 8 + 4 * f + 12 * f * n) return bad(fmt::format("has {} bytes, which is not what {} frames of {} points take", bytes.size(), frames, points));
  FrameSequence result;
  std::size_t at = 8;
  for (std::uint64_t k = 0; k < f; ++k, at += 4) {
    const auto t = static_cast<double>(big_at<float>(bytes, at));
    if (!std::isfinite(t) || (k > 0 && !(t > result.times.back()))) return bad(fmt::format("the time of frame {} does not increase", k + 1));
    result.times.push_back(t);
  }
  for (std::uint64_t k = 0; k < f; ++k) {
    mesh::Points3 x(static_cast<Eigen::Index>(n), 3);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      for (int c = 0; c < 3; ++c, at += 4) {
        x(i, c) = static_cast<double>(big_at<float>(bytes, at));
        if (!std::isfinite(x(i, c))) return bad(fmt::format("frame {} has a point that is not finite", k + 1));
      }
    }
    result.points.push_back(std::move(x));
  }
  return result;
}

std::string format_pc2(const FrameSequence& frames) {
  check(frames);
  std::string out("POINTCACHE2\0", 12);
  put(out, std::int32_t{1}, false);
  put(out, points_in(frames), false);
  put(out, 0.0f, false);
  put(out, 1.0f, false);
  put(out, static_cast<std::int32_t>(frames.points.size()), false);
  put_points(out, frames, false);
  return out;
}

}  // namespace toile::io
