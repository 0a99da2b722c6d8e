// Measuring a form as a tailor would: on the produced mesh, by plane sections and taut tapes.
#pragma once

#include "shape.h"

#include "toile/mesh/types.h"

#include <array>
#include <map>
#include <string>

namespace toile::form {

struct Gauge {
  std::map<std::string, double> values;  ///< by the measurement's name [m], slope [rad]
  std::map<std::string, std::array<double, 3>> landmarks;
};

/// Takes every measure of the form at its levels. A section that is not there measures 0.
Gauge measure(const mesh::Points3& x, const mesh::Triangles& faces, const Levels& levels, const FormParams& params);

}  // namespace toile::form
