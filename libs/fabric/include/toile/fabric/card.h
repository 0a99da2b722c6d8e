// Fabric cards: measured (or authored) fabric data after Kawabata's KES-F, in SI inside, customary units at the edge.
#pragma once

#include "toile/base/fields.h"

#include <string>

namespace toile::fabric {

/// Tensile and bending data of one yarn direction. KES-F tests are wide-strip tests: they give C11 and D11 as they are.
/// Source: docs/bibliography.md#kawabata1980
struct YarnDirection {
  double strain_max = 0.05;      ///< EMT, strain at the greatest force [1]
  double linearity = 0.6;        ///< LT, 2 WT / (F_max EMT) [1]
  double resilience = 0.6;       ///< RT, returned work over work done [1]
  double bending = 1e-5;         ///< B, bending rigidity per width [N*m]
  double bending_hysteresis = 0; ///< 2HB, moment hysteresis per width [N]
  static void describe(auto& f) {
    f(&YarnDirection::strain_max, {.key = "EMT", .doc = "strain at the greatest tensile force", .unit = "1", .min = 1e-4, .max = 2, .required = true});
    f(&YarnDirection::linearity, {.key = "LT", .doc = "linearity of the force-strain curve", .unit = "1", .min = 0.3, .max = 1, .required = true});
    f(&YarnDirection::resilience, {.key = "RT", .doc = "tensile resilience", .unit = "1", .min = 0, .max = 1});
    f(&YarnDirection::bending, {.key = "B", .doc = "bending rigidity per width", .unit = "N*m2/m", .min = 1e-9, .max = 10, .required = true});
    f(&YarnDirection::bending_hysteresis, {.key = "2HB", .doc = "hysteresis of the bending moment per width", .unit = "N*m/m", .min = 0, .max = 10});
  }
};

/// One fabric. All values SI.
struct Card {
  std::string name;
  std::string description;
  std::string origin;                  ///< who measured it and how, or "authored, not measured"
  double areal_density = 0.15;         ///< W [kg/m2]
  double thickness = 5e-4;             ///< T [m]
  double tensile_force_max = 490.3325; ///< greatest force of the tensile test per width [N/m]
  YarnDirection warp, weft;
  double shear = 30;                   ///< G per radian of shear angle and per width [N/m/rad]
  double shear_hysteresis = 0;         ///< 2HG at 0.5 deg [N/m]
  double shear_hysteresis_5 = 0;       ///< 2HG5 at 5 deg [N/m]
  double twist_ratio = 0.3;            ///< D66 / sqrt(B_warp B_weft) [1]; KES-F does not measure it
  double friction = 0.2;               ///< MIU [1]
  std::array<double, 3> color{0.75, 0.75, 0.78};  ///< sRGB in 0..1, for pictures only
  static void describe(auto& f) {
    f(&Card::name, {.key = "name", .doc = "name that specs refer to", .required = true});
    f(&Card::description, {.key = "description", .doc = "composition and weave, in words"});
    f(&Card::origin, {.key = "origin", .doc = "who measured it and how, or 'authored, not measured'", .required = true});
    f(&Card::areal_density, {.key = "W", .doc = "mass per area", .unit = "kg/m2", .min = 1e-3, .max = 10, .required = true});
    f(&Card::thickness, {.key = "T", .doc = "thickness at 0.5 gf/cm2", .unit = "m", .min = 1e-5, .max = 0.05, .required = true});
    f(&Card::tensile_force_max, {.key = "F_max", .doc = "greatest force of the tensile test per width", .unit = "N/m", .min = 1, .max = 1e6, .source = "KES-F standard condition: 500 gf/cm"});
    f(&Card::warp, {.key = "warp", .doc = "data along the warp"});
    f(&Card::weft, {.key = "weft", .doc = "data along the weft"});
    f(&Card::shear, {.key = "G", .doc = "shear rigidity per width and angle", .unit = "N/m/rad", .min = 0.1, .max = 1e6, .required = true});
    f(&Card::shear_hysteresis, {.key = "2HG", .doc = "shear hysteresis at 0.5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Card::shear_hysteresis_5, {.key = "2HG5", .doc = "shear hysteresis at 5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Card::twist_ratio, {.key = "twist_ratio", .doc = "twist rigidity D66 over sqrt(B_warp B_weft); not measured by KES-F", .unit = "1", .min = 0, .max = 2, .source = "docs/bibliography.md#cooper1960"});
    f(&Card::friction, {.key = "MIU", .doc = "friction coefficient", .unit = "1", .min = 0, .max = 5, .required = true});
    f(&Card::color, {.key = "color", .doc = "sRGB colour for pictures, each 0 to 1", .unit = "1", .min = 0, .max = 1});
  }
};

}  // namespace toile::fabric
