// Fabric data in the forms in which laboratories give them: KES-F, FAST, cantilever lengths, engineering constants, measured
// curves; and the card that they come to. docs/fabric.md describes the file.
#pragma once

#include "toile/base/result.h"
#include "toile/fabric/card.h"

#include <map>

namespace toile::fabric {

/// What the KES-F programme reads along one yarn direction, as far as it is known.
struct MeasuredYarn {
  std::optional<double> strain_max;          ///< EMT [1]
  std::optional<double> linearity;           ///< LT [1]
  std::optional<double> work;                ///< WT [J/m2]
  std::optional<double> resilience;          ///< RT [1]
  std::optional<TensionTable> tension;
  std::optional<double> bending;             ///< B [N m]
  std::optional<double> bending_hysteresis;  ///< 2HB [N]
  std::optional<double> bending_length;      ///< of a cantilever test [m]
  std::optional<MomentTable> moment;
  std::optional<double> shear;               ///< G [N/m per rad]
  std::optional<double> shear_hysteresis;    ///< 2HG [N/m]
  std::optional<double> shear_hysteresis_5;  ///< 2HG5 [N/m]
  std::optional<double> friction;            ///< MIU [1]
  std::optional<double> friction_deviation;  ///< MMD [1]
  std::optional<double> roughness;           ///< SMD [m]
  static void describe(auto& f) {
    f(&MeasuredYarn::strain_max, {.key = "EMT", .doc = "strain at F_max", .unit = "1", .min = 1e-4, .max = 2});
    f(&MeasuredYarn::linearity, {.key = "LT", .doc = "linearity of the force-strain curve, 2 WT/(F_max EMT)", .unit = "1", .min = 0.3, .max = 1});
    f(&MeasuredYarn::work, {.key = "WT", .doc = "tensile work up to F_max, instead of LT or with it", .unit = "J/m2", .min = 0, .max = 1e6});
    f(&MeasuredYarn::resilience, {.key = "RT", .doc = "tensile resilience; not given: no loss", .unit = "1", .min = 0, .max = 1});
    f(&MeasuredYarn::tension, {.key = "tension", .doc = "measured force against strain, instead of EMT and LT or with them"});
    f(&MeasuredYarn::bending, {.key = "B", .doc = "bending rigidity per width", .unit = "N*m2/m", .min = 1e-9, .max = 10});
    f(&MeasuredYarn::bending_hysteresis, {.key = "2HB", .doc = "hysteresis of the bending moment per width", .unit = "N*m/m", .min = 0, .max = 10});
    f(&MeasuredYarn::bending_length, {.key = "bending_length", .doc = "bending length c of a cantilever test (half the overhang at 41.5 deg), instead of B", .unit = "m", .min = 1e-3, .max = 1});
    f(&MeasuredYarn::moment, {.key = "moment", .doc = "measured moment against curvature, instead of B"});
    f(&MeasuredYarn::shear, {.key = "G", .doc = "shear rigidity read in this direction", .unit = "N/m/rad", .min = 0.1, .max = 1e6});
    f(&MeasuredYarn::shear_hysteresis, {.key = "2HG", .doc = "shear hysteresis read in this direction", .unit = "N/m", .min = 0, .max = 1e4});
    f(&MeasuredYarn::shear_hysteresis_5, {.key = "2HG5", .doc = "shear hysteresis at 5 deg read in this direction", .unit = "N/m", .min = 0, .max = 1e4});
    f(&MeasuredYarn::friction, {.key = "MIU", .doc = "friction coefficient read in this direction", .unit = "1", .min = 0, .max = 5});
    f(&MeasuredYarn::friction_deviation, {.key = "MMD", .doc = "mean deviation of the friction coefficient; not used", .unit = "1", .min = 0, .max = 1});
    f(&MeasuredYarn::roughness, {.key = "SMD", .doc = "geometrical roughness; not used", .unit = "m", .min = 0, .max = 1e-3});
  }
};

/// FAST along one yarn direction.
struct FastYarn {
  double extension_5 = 0, extension_20 = 0, extension_100 = 0;  ///< strains at the three loads [1]
  std::optional<double> bending_length;                          ///< C [m]
  std::optional<double> bending;                                 ///< B [N m]
  static void describe(auto& f) {
    f(&FastYarn::extension_5, {.key = "E5", .doc = "strain at the first load", .unit = "1", .min = 0, .max = 1, .required = true});
    f(&FastYarn::extension_20, {.key = "E20", .doc = "strain at the second load", .unit = "1", .min = 0, .max = 1, .required = true});
    f(&FastYarn::extension_100, {.key = "E100", .doc = "strain at the third load", .unit = "1", .min = 0, .max = 2, .required = true});
    f(&FastYarn::bending_length, {.key = "C", .doc = "bending length", .unit = "m", .min = 1e-3, .max = 1});
    f(&FastYarn::bending, {.key = "B", .doc = "bending rigidity, instead of C or with it", .unit = "N*m", .min = 1e-9, .max = 10});
  }
};

/// Source: docs/bibliography.md#deboos1994
struct Fast {
  FastYarn warp, weft;
  std::optional<double> bias_extension;  ///< EB5 [1]
  std::optional<double> shear;           ///< G [N/m]
  std::array<double, 3> loads{4.903325, 19.6133, 98.0665};  ///< [N/m]
  static void describe(auto& f) {
    f(&Fast::warp, {.key = "warp", .doc = "along the warp"});
    f(&Fast::weft, {.key = "weft", .doc = "along the weft"});
    f(&Fast::bias_extension, {.key = "EB5", .doc = "strain of a bias strip at the first load", .unit = "1", .min = 1e-4, .max = 1});
    f(&Fast::shear, {.key = "G", .doc = "shear rigidity, instead of EB5 or with it", .unit = "N/m/rad", .min = 0.1, .max = 1e6});
    f(&Fast::loads, {.key = "loads", .doc = "the three loads per width", .unit = "N/m", .min = 0.1, .max = 1e5, .source = "FAST: 5, 20 and 100 gf/cm"});
  }
};

struct EngineeringYarn {
  std::optional<double> stiffness;  ///< force per width and strain with lateral strain suppressed [N/m]
  std::optional<double> modulus;    ///< Young's modulus, to be multiplied by T [Pa]
  std::optional<double> bending;    ///< [N m]
  static void describe(auto& f) {
    f(&EngineeringYarn::stiffness, {.key = "C", .doc = "force per width and strain of a wide strip", .unit = "N/m", .min = 1, .max = 1e8});
    f(&EngineeringYarn::modulus, {.key = "E", .doc = "Young's modulus of a narrow strip, instead of C: C = E T/(1 - nu^2)", .unit = "Pa", .min = 1e3, .max = 1e12});
    f(&EngineeringYarn::bending, {.key = "B", .doc = "bending rigidity per width", .unit = "N*m", .min = 1e-9, .max = 10});
  }
};

/// Constants of a linear orthotropic sheet.
struct Engineering {
  EngineeringYarn warp, weft;
  std::optional<double> shear;  ///< [N/m per rad]
  double poisson = 0;           ///< [1]
  static void describe(auto& f) {
    f(&Engineering::warp, {.key = "warp", .doc = "along the warp"});
    f(&Engineering::weft, {.key = "weft", .doc = "along the weft"});
    f(&Engineering::shear, {.key = "G", .doc = "shear rigidity per width and angle", .unit = "N/m/rad", .min = 0.1, .max = 1e6});
    f(&Engineering::poisson, {.key = "nu", .doc = "Poisson's ratio with which E becomes C", .unit = "1", .min = 0, .max = 0.9});
  }
};

enum class ShearForce {
  net,  ///< the tension's own share has been taken off
  raw,  ///< it is still in
};

/// A fabric file. Required: name, origin, W, T, MIU, and one source each for tension (both directions), bending (both) and
/// shear.
struct Measured {
  std::string name, description, origin;
  std::optional<std::string> licence;
  double areal_density = 0.15;               ///< W [kg/m2]
  double thickness = 5e-4;                   ///< T [m]
  std::optional<double> tensile_force_max;   ///< F_max [N/m]
  MeasuredYarn warp, weft;
  std::optional<double> shear, shear_hysteresis, shear_hysteresis_5;  ///< [N/m per rad], [N/m], [N/m]
  std::optional<ShearTable> shear_table;
  std::optional<Locking> locking;
  ShearForce shear_force = ShearForce::net;
  std::optional<double> twist_ratio;         ///< [1]
  std::optional<double> bias_bending;        ///< bending rigidity of a strip at 45 deg [N m]
  std::optional<double> friction;            ///< MIU [1]
  std::optional<Fast> fast;
  std::optional<Engineering> constants;
  std::optional<Conditions> conditions;
  std::array<double, 3> color{0.75, 0.75, 0.78};
  static void describe(auto& f) {
    f(&Measured::name, {.key = "name", .doc = "name that specs refer to", .required = true});
    f(&Measured::description, {.key = "description", .doc = "composition and weave, in words"});
    f(&Measured::origin, {.key = "origin", .doc = "who measured it and how, or 'authored, not measured'", .required = true});
    f(&Measured::licence, {.key = "licence", .doc = "licence of the data, where they are someone else's"});
    f(&Measured::areal_density, {.key = "W", .doc = "mass per area", .unit = "kg/m2", .min = 1e-3, .max = 10, .required = true});
    f(&Measured::thickness, {.key = "T", .doc = "thickness at 0.5 gf/cm2", .unit = "m", .min = 1e-5, .max = 0.05, .required = true});
    f(&Measured::tensile_force_max, {.key = "F_max", .doc = "greatest force of the tensile test per width; not given: 500 gf/cm, or what the data reach", .unit = "N/m", .min = 1, .max = 1e6});
    f(&Measured::warp, {.key = "warp", .doc = "KES-F data along the warp"});
    f(&Measured::weft, {.key = "weft", .doc = "KES-F data along the weft"});
    f(&Measured::shear, {.key = "G", .doc = "shear rigidity per width and angle; where warp and weft have their own, their mean is used", .unit = "N/m/rad", .min = 0.1, .max = 1e6});
    f(&Measured::shear_hysteresis, {.key = "2HG", .doc = "shear hysteresis at 0.5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Measured::shear_hysteresis_5, {.key = "2HG5", .doc = "shear hysteresis at 5 deg", .unit = "N/m", .min = 0, .max = 1e4});
    f(&Measured::shear_table, {.key = "shear", .doc = "measured shear force against angle, instead of G"});
    f(&Measured::locking, {.key = "locking", .doc = "stiffer branch of the shear curve at large angles"});
    f(&Measured::shear_force, {.key = "shear_force", .doc = "raw: the tension of the test is still in the shear force and is taken off"});
    f(&Measured::twist_ratio, {.key = "twist_ratio", .doc = "twist rigidity D66 over sqrt(B_warp B_weft), where B45 is not known; not given: 0.3", .unit = "1", .min = 0, .max = 2, .source = "docs/bibliography.md#cooper1960"});
    f(&Measured::bias_bending, {.key = "B45", .doc = "bending rigidity of a strip cut at 45 deg; gives D66 = B45 - (B_warp + B_weft)/4", .unit = "N*m2/m", .min = 1e-9, .max = 10});
    f(&Measured::friction, {.key = "MIU", .doc = "friction coefficient; where warp and weft have their own, their mean is used", .unit = "1", .min = 0, .max = 5});
    f(&Measured::fast, {.key = "fast", .doc = "FAST data, for what KES-F data do not give"});
    f(&Measured::constants, {.key = "constants", .doc = "engineering constants of a linear sheet, for what KES-F data do not give"});
    f(&Measured::conditions, {.key = "conditions", .doc = "under what conditions the values were read; not given: the KES-F standard"});
    f(&Measured::color, {.key = "color", .doc = "sRGB colour for pictures, each 0 to 1", .unit = "1", .min = 0, .max = 1});
    f.check([](const Measured& m, Issues& issues) { check_sources(m, issues); });
  }
  /// Each of tension, bending and shear has exactly one source; values given twice agree.
  static void check_sources(const Measured& m, Issues& issues);
};

/// A card and where its values come from.
struct Resolved {
  Card card;
  std::map<std::string, std::string> source;  ///< "warp.tension" -> "EMT and WT", …
};

/// error  what the record's checks report
Result<Resolved> resolve(const Measured& measured);

}  // namespace toile::fabric

template <>
struct toile::Choices<toile::fabric::ShearForce> {
  static constexpr std::array names{std::pair{"net", toile::fabric::ShearForce::net}, std::pair{"raw", toile::fabric::ShearForce::raw}};
};
