// Lines of panels held on curves of a frame: the part of the placement's parameters for technical textiles.
#pragma once

#include "toile/base/fields.h"

#include <array>
#include <string>
#include <vector>

namespace toile::placement {

/// A curve of the frame: straight from point to point.
struct FrameCurve {
  std::vector<std::array<double, 3>> points;
  std::vector<std::string> landmarks;
  static void describe(auto& f) {
    f(&FrameCurve::points, {.key = "points", .doc = "corners of the curve, x y z", .unit = "m"});
    f(&FrameCurve::landmarks, {.key = "landmarks", .doc = "or: landmarks of the support, in order"});
  }
};

/// A line of the garment that lies on a curve: edges or internal lines of panels end to end.
struct FrameLine {
  std::vector<std::string> line;
  std::string to;
  static void describe(auto& f) {
    f(&FrameLine::line, {.key = "line", .doc = "edges or internal lines of panels in order, `panel.edge`; with a minus sign: against its direction", .required = true});
    f(&FrameLine::to, {.key = "to", .doc = "name of the curve; the line runs along it from its first point to its last", .required = true});
  }
};

}  // namespace toile::placement
