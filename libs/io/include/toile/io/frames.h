// Points through time: caches that animation programs read. docs/export.md.
#pragma once

#include "toile/base/result.h"
#include "toile/mesh/types.h"

#include <string>
#include <string_view>
#include <vector>

namespace toile::io {

struct FrameSequence {
  std::vector<double> times;           ///< [s], increasing
  std::vector<mesh::Points3> points;   ///< as many, of the same number of rows [m]
};

/// LightWave's point cache: counts, times [s] and single precision positions, big-endian.
std::string format_mdd(const FrameSequence& frames);
/// error  "bad_frames" where the file is none, too short, or its times do not increase
Result<FrameSequence> parse_mdd(std::string_view bytes, const std::string& name);

/// PointCache2: single precision positions, little-endian; it has no times: the first frame's number is 0, a sample a frame.
std::string format_pc2(const FrameSequence& frames);

}  // namespace toile::io
