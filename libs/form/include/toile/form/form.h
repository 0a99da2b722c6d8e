// A parametric dress form from body measurements. docs/form.md says how it is built and where each measure is taken.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/form/measurements.h"
#include "toile/mesh/support_mesh.h"

#include <string>
#include <vector>

namespace toile::form {

enum class Sex { male, female };

struct FormParams {
  Sex sex = Sex::male;
  bool arms = true;
  bool legs = false;
  double arm_angle = 0.7853981633974483;
  int vertices = 6000;
  double girth_tolerance = 0.002;
  double length_tolerance = 0.005;

  static void describe(auto& f) {
    f(&FormParams::sex, {.key = "sex", .doc = "male or female build"});
    f(&FormParams::arms, {.key = "arms", .doc = "arms in A-pose, closed at the wrist; without them the shoulders are rounded off"});
    f(&FormParams::legs, {.key = "legs", .doc = "legs, a little apart, closed at the ankles; without them the form ends under the seat. They need the measurements inseam, upperLeg, knee and ankle"});
    f(&FormParams::arm_angle, {.key = "arm_angle", .doc = "how far the arms hang under the horizontal", .unit = "rad", .min = 0.5, .max = 1.1});
    f(&FormParams::vertices, {.key = "vertices", .doc = "wanted number of vertices (met within 4 %)", .min = 1000, .max = 60000});
    f(&FormParams::girth_tolerance, {.key = "girth_tolerance", .doc = "largest allowed difference of a girth", .unit = "m", .min = 1e-5, .max = 0.05});
    f(&FormParams::length_tolerance, {.key = "length_tolerance", .doc = "largest allowed difference of a length", .unit = "m", .min = 1e-5, .max = 0.05});
  }
};

/// One measure as it was asked for and as the mesh has it.
struct GaugeRow {
  std::string name;       ///< as in Measurements
  bool girth = false;
  double requested = 0;   ///< [m]; shoulderSlope [rad]
  double measured = 0;
  double difference = 0;  ///< measured - requested [m]; of the slope: the drop over the shoulder's length it makes [m]
  double tolerance = 0;   ///< [m]
  bool within() const { return difference <= tolerance && -difference <= tolerance; }
};

struct Form {
  mesh::SupportMesh mesh;
  std::vector<GaugeRow> gauge;  ///< every measure that the form answers for
  int iterations = 0;           ///< fitting rounds
  double smallest_angle = 0;    ///< of all triangles [rad]
};

/// The form of these measurements: closed, mirror-symmetric to the bit, standing on y = 0, facing +z.
/// error  Issue "implausible_measurement", "out_of_range", … with the measure's name; a form out of tolerance is no
///        error here: see Form::gauge
Result<Form> make_form(const Measurements& measurements, const FormParams& params);

}  // namespace toile::form

template <>
struct toile::Choices<toile::form::Sex> {
  static constexpr std::array names{std::pair{"male", toile::form::Sex::male}, std::pair{"female", toile::form::Sex::female}};
};
