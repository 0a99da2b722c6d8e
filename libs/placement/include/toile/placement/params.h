// Parameters of the placement stage: one declaration (base/fields.h).
#pragma once

#include "toile/base/fields.h"
#include "toile/placement/frame_params.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace toile::placement {

/// The part of the support that a panel goes on.
enum class Region {
  automatic,    ///< from the panel's name and seams
  torso_front,  ///< on the trunk, its middle at the centre front
  torso_back,   ///< on the trunk, its middle at the centre back
  torso_left,   ///< on the trunk, its middle at the left side
  torso_right,
  torso,        ///< on the trunk, where its seams to other panels put it
  waist,        ///< a band round the trunk at the waist; it is turned so that its seams fit
  arm,          ///< round the arm that its seams to the trunk's panels say
  arm_left,
  arm_right,
  leg,          ///< round the leg that its name or its seams say
  leg_left,
  leg_right,
  attached,  ///< stands on its seams to panels that are placed before it (collars)
};

}  // namespace toile::placement

template <>
struct toile::Choices<toile::placement::Region> {
  using R = toile::placement::Region;
  static constexpr std::array names{
      std::pair{"auto", R::automatic},         std::pair{"torso_front", R::torso_front}, std::pair{"torso_back", R::torso_back},
      std::pair{"torso_left", R::torso_left},  std::pair{"torso_right", R::torso_right}, std::pair{"torso", R::torso},
      std::pair{"waist", R::waist},            std::pair{"arm", R::arm},                 std::pair{"arm_left", R::arm_left},
      std::pair{"arm_right", R::arm_right},    std::pair{"leg", R::leg},                 std::pair{"leg_left", R::leg_left},
      std::pair{"leg_right", R::leg_right},    std::pair{"attached", R::attached}};
};

namespace toile::placement {

/// Where one panel starts. What is not given is found from names, seams and the body.
struct PanelSpec {
  Region region = Region::automatic;
  std::optional<std::string> point;  ///< point or edge of the panel that goes to `at`
  std::optional<std::string> at;     ///< landmark or level of the support
  std::vector<double> to;            ///< or a point on it [m]
  std::array<double, 2> shift{0, 0};
  double turn = 0;
  static void describe(auto& f) {
    f(&PanelSpec::region, {.key = "region", .doc = "part of the support that the panel goes on; auto: from its name and seams"});
    f(&PanelSpec::point, {.key = "point", .doc = "point or edge of the panel whose height is set by `at`"});
    f(&PanelSpec::at, {.key = "at", .doc = "landmark of the support, or one of the levels neck, shoulder, armpit, chest, waist, hips, crotch"});
    f(&PanelSpec::to, {.key = "to", .doc = "instead of `at`, a point (x, y, z) on the trunk of the support: `point` goes to its height and to its place round the body", .unit = "m"});
    f(&PanelSpec::shift, {.key = "shift", .doc = "moved further round the body (towards its left side from the front) and up", .unit = "m", .min = -1, .max = 1});
    f(&PanelSpec::turn, {.key = "turn", .doc = "turned in its plane, counter-clockwise seen from outside", .unit = "rad", .min = -3.2, .max = 3.2});
    f.check([](const PanelSpec& p, Issues& issues) {
      if (!p.to.empty() && p.to.size() != 3) {
        issues.push_back({.code = "bad_range", .place = {.item = "to"}, .what = fmt::format("a point has three coordinates, not {}", p.to.size()), .remedy = "give [x, y, z]"});
      }
      if (!p.to.empty() && (p.at || !p.point)) {
        issues.push_back({.code = "bad_range", .place = {.item = "to"}, .what = p.at ? "`at` and `to` both say where the point goes" : "nothing says which point of the panel goes there",
                          .remedy = p.at ? "leave one of them out" : "give `point`, a point or edge of the panel"});
      }
    });
  }
};

struct PlaceParams {
  double offset = 0.004;
  std::map<std::string, double> offsets;
  double clearance = 0.0015;
  double max_strain = 0.005;
  double rms_strain = 0.001;
  std::optional<double> flatten;
  double thickness = 0.001;
  double coarse = 0.03;
  double seam = 0.1;
  double bending = 0.1;
  int closing_steps = 60;
  int swelling_steps = 80;
  int settling_steps = 60;
  int fine_steps = 20;
  int polishing_steps = 200;
  std::map<std::string, PanelSpec> panels;
  std::map<std::string, FrameCurve> curves;
  std::vector<FrameLine> lines;
  double max_line_gap = 0.01;
  double line_tolerance = 0.02;
  static void describe(auto& f) {
    f(&PlaceParams::offset, {.key = "offset", .doc = "wanted distance of the cloth from the support", .unit = "m", .min = 0, .max = 0.2});
    f(&PlaceParams::offsets, {.key = "offsets", .doc = "instead of `offset` over named regions of the support, such as torso, neck or arm_left", .unit = "m", .min = 0, .max = 0.2});
    f(&PlaceParams::clearance, {.key = "clearance", .doc = "smallest distance of a cloth vertex from the support at the end", .unit = "m", .min = 1e-4, .max = 0.1});
    f(&PlaceParams::max_strain, {.key = "max_strain", .doc = "a larger edge strain is a finding", .unit = "1", .min = 1e-6, .max = 0.5});
    f(&PlaceParams::rms_strain, {.key = "rms_strain", .doc = "a larger root mean square of the edge strains is a finding", .unit = "1", .min = 1e-6, .max = 0.5});
    f(&PlaceParams::flatten, {.key = "flatten", .doc = "depth (front to back) of the support at the start, over its true depth; default: 0.25 where shoulders are to be closed, otherwise as much as the panels need to go round", .unit = "1", .min = 0.05, .max = 1});
    f(&PlaceParams::thickness, {.key = "thickness", .doc = "wanted distance of panels from one another", .unit = "m", .min = 1e-5, .max = 0.02});
    f(&PlaceParams::coarse, {.key = "coarse", .doc = "edge length of the mesh on which the large folds form", .unit = "m", .min = 1e-3, .max = 1});
    f(&PlaceParams::seam, {.key = "seam", .doc = "part of a seam's gap that one sweep of the relaxation closes; smaller leaves wider gaps and smoother cloth", .unit = "1", .min = 0, .max = 1});
    f(&PlaceParams::bending, {.key = "bending", .doc = "part of a curvature that one sweep takes out", .unit = "1", .min = 0, .max = 1});
    f(&PlaceParams::closing_steps, {.key = "closing_steps", .doc = "relaxation steps while the seams close on the flattened support", .min = 0, .max = 10000});
    f(&PlaceParams::swelling_steps, {.key = "swelling_steps", .doc = "steps while the support takes its true depth", .min = 1, .max = 10000});
    f(&PlaceParams::settling_steps, {.key = "settling_steps", .doc = "steps on the true support, over which the seams let go", .min = 1, .max = 10000});
    f(&PlaceParams::fine_steps, {.key = "fine_steps", .doc = "steps on the fine mesh over which its seams close once more and let go", .min = 1, .max = 10000});
    f(&PlaceParams::polishing_steps, {.key = "polishing_steps", .doc = "most steps in which stretch is taken out", .min = 0, .max = 100000});
    f(&PlaceParams::panels, {.key = "panels", .doc = "settings of single panels, by name"});
    f(&PlaceParams::curves, {.key = "curves", .doc = "curves of a frame, by name"});
    f(&PlaceParams::lines, {.key = "lines", .doc = "lines of the garment that lie on curves; with any, the support is a frame, not a body, and the cloth is spread between the curves"});
    f(&PlaceParams::max_line_gap, {.key = "max_line_gap", .doc = "a line that lies farther from its curve at any vertex is a finding", .unit = "m", .min = 0, .max = 10});
    f(&PlaceParams::line_tolerance, {.key = "line_tolerance", .doc = "a line longer or shorter than its curve by more than this part is a finding", .unit = "1", .min = 0, .max = 10});
    f.check([](const PlaceParams& p, Issues& issues) {
      if (p.clearance > p.offset) {
        issues.push_back({.code = "bad_range", .place = {.item = "clearance"}, .what = "the clearance is larger than the offset",
                          .remedy = "give an offset of at least the clearance"});
      }
      for (const auto& [name, offset] : p.offsets) {
        if (offset >= p.clearance) continue;
        issues.push_back({.code = "bad_range", .place = {.item = "offsets." + name}, .what = "the clearance is larger than the offset",
                          .remedy = "give an offset of at least the clearance"});
      }
    });
  }
};

}  // namespace toile::placement
