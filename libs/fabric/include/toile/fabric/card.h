// Fabric cards: measured (or authored) fabric data after Kawabata's KES-F, in SI inside, customary units at the edge.
// A card is what garments carry. `measured.h` reads the same data in the other forms in which laboratories give them.
#pragma once

#include "toile/base/fields.h"

#include <optional>
#include <string>
#include <vector>

namespace toile::fabric {

namespace detail {
/// Two rows of equal length, at least two points, (0, 0) first, both rows strictly increasing.
void check_table(const char* key_x, const std::vector<double>& x, const char* key_y, const std::vector<double>& y, Issues& issues);
}  // namespace detail

/// Force per width against strain along a yarn direction, from (0, 0) on, first loading.
struct TensionTable {
  std::vector<double> strain;  ///< [1]
  std::vector<double> force;   ///< [N/m]
  bool operator==(const TensionTable&) const = default;
  static void describe(auto& f) {
    f(&TensionTable::strain, {.key = "strain", .doc = "strain, from 0 on, increasing", .unit = "1", .min = 0, .max = 3, .required = true});
    f(&TensionTable::force, {.key = "force", .doc = "force per width at these strains, from 0 on, increasing", .unit = "N/m", .min = 0, .max = 1e7, .required = true});
    f.check([](const TensionTable& t, Issues& issues) { detail::check_table("strain", t.strain, "force", t.force, issues); });
  }
};

/// Bending moment per width against curvature, from (0, 0) on: the middle between loading and unloading; the loop's height
/// is 2HB.
struct MomentTable {
  std::vector<double> curvature;  ///< [1/m]
  std::vector<double> moment;     ///< [N]
  bool operator==(const MomentTable&) const = default;
  static void describe(auto& f) {
    f(&MomentTable::curvature, {.key = "curvature", .doc = "curvature, from 0 on, increasing", .unit = "1/m", .min = 0, .max = 1e5, .required = true});
    f(&MomentTable::moment, {.key = "moment", .doc = "moment per width at these curvatures, from 0 on, increasing", .unit = "N*m/m", .min = 0, .max = 1e4, .required = true});
    f.check([](const MomentTable& t, Issues& issues) { detail::check_table("curvature", t.curvature, "moment", t.moment, issues); });
  }
};

/// Shear force per width against shear angle, from (0, 0) on: the middle between loading and unloading; the loop's height
/// is 2HG.
struct ShearTable {
  std::vector<double> angle;  ///< [rad]
  std::vector<double> force;  ///< [N/m]
  bool operator==(const ShearTable&) const = default;
  static void describe(auto& f) {
    f(&ShearTable::angle, {.key = "angle", .doc = "shear angle, from 0 on, increasing", .unit = "rad", .min = 0, .max = 1.4, .required = true});
    f(&ShearTable::force, {.key = "force", .doc = "shear force per width at these angles, from 0 on, increasing", .unit = "N/m", .min = 0, .max = 1e6, .required = true});
    f.check([](const ShearTable& t, Issues& issues) { detail::check_table("angle", t.angle, "force", t.force, issues); });
  }
};

/// Where the yarns of a sheared woven begin to press on each other: beyond `angle_end` the slope is `ratio` times G, from
/// `angle` on it rises there.
struct Locking {
  double angle = 5 * 3.14159265358979323846 / 180;      ///< [rad]
  double angle_end = 8 * 3.14159265358979323846 / 180;  ///< [rad]
  double ratio = 1;                                     ///< [1]
  bool operator==(const Locking&) const = default;
  static void describe(auto& f) {
    f(&Locking::angle, {.key = "angle", .doc = "shear angle at which the slope begins to rise", .unit = "rad", .min = 0, .max = 1.2});
    f(&Locking::angle_end, {.key = "angle_end", .doc = "shear angle from which on it is `ratio` times G", .unit = "rad", .min = 0, .max = 1.4});
    f(&Locking::ratio, {.key = "ratio", .doc = "slope beyond over G", .unit = "1", .min = 1, .max = 100, .required = true});
    f.check([](const Locking& l, Issues& issues) {
      if (l.angle_end < l.angle) issues.push_back({"bad_locking", {.item = "angle_end"}, "locking ends before it begins", "give an angle_end above angle"});
    });
  }
};

/// Under what conditions the values were read. The defaults are those of the KES-F standard.
/// Source: docs/bibliography.md#kawabata1980
struct Conditions {
  double tensile_rate = 4e-3;         ///< [1/s]
  double shear_tension = 9.80665;     ///< across the shear, per width [N/m]
  double shear_slope_from = 0.5 * 3.14159265358979323846 / 180;  ///< G is the slope between these angles [rad]
  double shear_slope_to = 2.5 * 3.14159265358979323846 / 180;
  double shear_hysteresis_at = 0.5 * 3.14159265358979323846 / 180;  ///< where 2HG is read [rad]
  double shear_hysteresis_5_at = 5 * 3.14159265358979323846 / 180;  ///< where 2HG5 is read [rad]
  double shear_angle_max = 8 * 3.14159265358979323846 / 180;        ///< where the test turns round [rad]
  double bending_slope_from = 50;     ///< B is the slope between these curvatures [1/m]
  double bending_slope_to = 150;
  double bending_hysteresis_at = 100; ///< where 2HB is read [1/m]
  double bending_curvature_max = 250; ///< where the test turns round [1/m]
  double thickness_pressure = 49.03325;  ///< [Pa]
  bool operator==(const Conditions&) const = default;
  static void describe(auto& f) {
    f(&Conditions::tensile_rate, {.key = "tensile_rate", .doc = "strain rate of the tensile test", .unit = "1/s", .min = 1e-6, .max = 10});
    f(&Conditions::shear_tension, {.key = "shear_tension", .doc = "tension across the shear test", .unit = "N/m", .min = 0, .max = 1000});
    f(&Conditions::shear_slope_from, {.key = "shear_slope_from", .doc = "G is the slope of the shear force from this angle", .unit = "rad", .min = 0, .max = 1});
    f(&Conditions::shear_slope_to, {.key = "shear_slope_to", .doc = "to this one", .unit = "rad", .min = 0, .max = 1});
    f(&Conditions::shear_hysteresis_at, {.key = "shear_hysteresis_at", .doc = "angle at which 2HG is read", .unit = "rad", .min = 0, .max = 1});
    f(&Conditions::shear_hysteresis_5_at, {.key = "shear_hysteresis_5_at", .doc = "angle at which 2HG5 is read", .unit = "rad", .min = 0, .max = 1});
    f(&Conditions::shear_angle_max, {.key = "shear_angle_max", .doc = "angle at which the shear test turns round", .unit = "rad", .min = 0, .max = 1});
    f(&Conditions::bending_slope_from, {.key = "bending_slope_from", .doc = "B is the slope of the moment from this curvature", .unit = "1/m", .min = 0, .max = 1e5});
    f(&Conditions::bending_slope_to, {.key = "bending_slope_to", .doc = "to this one", .unit = "1/m", .min = 0, .max = 1e5});
    f(&Conditions::bending_hysteresis_at, {.key = "bending_hysteresis_at", .doc = "curvature at which 2HB is read", .unit = "1/m", .min = 0, .max = 1e5});
    f(&Conditions::bending_curvature_max, {.key = "bending_curvature_max", .doc = "curvature at which the bending test turns round", .unit = "1/m", .min = 0, .max = 1e5});
    f(&Conditions::thickness_pressure, {.key = "thickness_pressure", .doc = "pressure at which T is read", .unit = "Pa", .min = 0, .max = 1e6});
    f.check([](const Conditions& c, Issues& issues) {
      const auto ordered = [&](double from, double to, const char* key) {
        if (!(to > from)) issues.push_back({"bad_conditions", {.item = key}, fmt::format("'{}' is not above where the range begins", key), "give the range from low to high"});
      };
      ordered(c.shear_slope_from, c.shear_slope_to, "shear_slope_to");
      ordered(c.shear_hysteresis_at, c.shear_hysteresis_5_at, "shear_hysteresis_5_at");
      ordered(c.bending_slope_from, c.bending_slope_to, "bending_slope_to");
    });
  }
};

/// Tensile and bending data of one yarn direction. KES-F tests are wide-strip tests: they give C11 and D11 as they are.
/// Source: docs/bibliography.md#kawabata1980
struct YarnDirection {
  double strain_max = 0.05;      ///< EMT, strain at the greatest force [1]
  double linearity = 0.6;        ///< LT, 2 WT / (F_max EMT) [1]
  double resilience = 0.6;       ///< RT, returned work over work done [1]
  double bending = 1e-5;         ///< B, bending rigidity per width [N*m]
  double bending_hysteresis = 0; ///< 2HB, moment hysteresis per width [N]
  std::optional<TensionTable> tension;  ///< measured curve; EMT and LT then describe it and are not used themselves
  std::optional<MomentTable> moment;    ///< measured curve; B then describes it and is not used itself
  static void describe(auto& f) {
    f(&YarnDirection::strain_max, {.key = "EMT", .doc = "strain at the greatest tensile force", .unit = "1", .min = 1e-4, .max = 2, .required = true});
    f(&YarnDirection::linearity, {.key = "LT", .doc = "linearity of the force-strain curve", .unit = "1", .min = 0.3, .max = 1, .required = true});
    f(&YarnDirection::resilience, {.key = "RT", .doc = "tensile resilience", .unit = "1", .min = 0, .max = 1});
    f(&YarnDirection::bending, {.key = "B", .doc = "bending rigidity per width", .unit = "N*m2/m", .min = 1e-9, .max = 10, .required = true});
    f(&YarnDirection::bending_hysteresis, {.key = "2HB", .doc = "hysteresis of the bending moment per width", .unit = "N*m/m", .min = 0, .max = 10});
    f(&YarnDirection::tension, {.key = "tension", .doc = "measured force against strain; goes before EMT and LT"});
    f(&YarnDirection::moment, {.key = "moment", .doc = "measured moment against curvature; goes before B"});
  }
};

/// One fabric. All values SI.
struct Card {
  std::string name;
  std::string description;
  std::string origin;                  ///< who measured it and how, or "authored, not measured"
  std::optional<std::string> licence;  ///< of the data, where they are someone else's
  double areal_density = 0.15;         ///< W [kg/m2]
  double thickness = 5e-4;             ///< T [m]
  double tensile_force_max = 490.3325; ///< greatest force of the tensile test per width [N/m]
  YarnDirection warp, weft;
  double shear = 30;                   ///< G per radian of shear angle and per width [N/m/rad]
  double shear_hysteresis = 0;         ///< 2HG at 0.5 deg [N/m]
  double shear_hysteresis_5 = 0;       ///< 2HG5 at 5 deg [N/m]
  std::optional<ShearTable> shear_table;  ///< measured curve; G then describes it and is not used itself
  std::optional<Locking> locking;      ///< none: no stiffer branch is known
  double twist_ratio = 0.3;            ///< D66 / sqrt(B_warp B_weft) [1]; KES-F does not measure it
  double friction = 0.2;               ///< MIU [1]
  std::optional<Conditions> conditions;  ///< none: the KES-F standard
  std::array<double, 3> color{0.75, 0.75, 0.78};  ///< sRGB in 0..1, for pictures only
  static void describe(auto& f) {
    f(&Card::name, {.key = "name", .doc = "name that specs refer to", .required = true});
    f(&Card::description, {.key = "description", .doc = "composition and weave, in words"});
    f(&Card::origin, {.key = "origin", .doc = "who measured it and how, or 'authored, not measured'", .required = true});
    f(&Card::licence, {.key = "licence", .doc = "licence of the data, where they are someone else's"});
    f(&Card::areal_density, {.key = "W", .doc = "mass per area", .unit = "kg/m2", .min = 1e-3, .max = 10, .required = true});
    f(&Card::thickness, {.key = "T", .doc = "thickness at 0.5 gf/cm2", .unit = "m", .min = 1e-5, .max = 0.05, .required = true});
    f(&Card::tensile_force_max, {.key = "F_max", .doc = "greatest force of the tensile test per width", .unit = "N/m", .min = 1, .max = 1e6, .source = "KES-F standard condition: 500 gf/cm"});
    f(&Card::warp, {.key = "warp", .doc = "data along the warp"});
    f(&Card::weft, {.key = "weft", .doc = "data along the weft"});
    f(&Card::shear, {.key = "G", .doc = "shear rigidity per width and angle", .unit = "N/m/rad", .min = 0.1, .max = 1e6, .required = true});
    f(&Card::shear_hysteresis, {.key = "2HG", .doc = "shear hysteresis at 0.5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Card::shear_hysteresis_5, {.key = "2HG5", .doc = "shear hysteresis at 5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Card::shear_table, {.key = "shear", .doc = "measured shear force against angle; goes before G"});
    f(&Card::locking, {.key = "locking", .doc = "stiffer branch of the shear curve at large angles; not given: none is known"});
    f(&Card::twist_ratio, {.key = "twist_ratio", .doc = "twist rigidity D66 over sqrt(B_warp B_weft); not measured by KES-F", .unit = "1", .min = 0, .max = 2, .source = "docs/bibliography.md#cooper1960"});
    f(&Card::friction, {.key = "MIU", .doc = "friction coefficient", .unit = "1", .min = 0, .max = 5, .required = true});
    f(&Card::conditions, {.key = "conditions", .doc = "under what conditions the values were read; not given: the KES-F standard"});
    f(&Card::color, {.key = "color", .doc = "sRGB colour for pictures, each 0 to 1", .unit = "1", .min = 0, .max = 1});
  }
};

}  // namespace toile::fabric
