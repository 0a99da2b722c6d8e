// Buttons, hooks, snaps, zips, tacks, and layers that lie free: what holds parts of a garment together besides seams
// (docs/tailoring.md, "Fasteners" and "Free layers").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace toile::tailor {

enum class FastenerKind { button, hook, snap };

/// How a closed fastener is treated.
enum class Treatment {
  constraint,  ///< its halves are held at the shank's length exactly
  spring,      ///< a stiff spring between them
};

/// One half of a fastener or tack: a named point, or a position in a panel.
struct FastenerEnd {
  std::optional<std::string> point;
  std::optional<std::string> panel;
  std::optional<std::array<double, 2>> at;
  static void describe(auto& f) {
    f(&FastenerEnd::point, {.key = "point", .doc = "named point or mark: panel.point"});
    f(&FastenerEnd::panel, {.key = "panel", .doc = "panel, if it is given by its position"});
    f(&FastenerEnd::at, {.key = "at", .doc = "position (u, v) in that panel; the nearest particle is taken", .unit = "m"});
  }
};

struct FastenerSpec {
  std::string name;
  FastenerKind kind = FastenerKind::button;
  std::vector<FastenerEnd> a, b;
  Treatment treatment = Treatment::constraint;
  std::optional<double> stiffness;
  double capture = 0;
  double mass = 0.001;
  double length = 0.003;
  bool closed = true;
  static void describe(auto& f) {
    f(&FastenerSpec::name, {.key = "name", .doc = "name; of a row of buttons that of the row", .required = true});
    f(&FastenerSpec::kind, {.key = "kind", .doc = "button, hook or snap"});
    f(&FastenerSpec::a, {.key = "a", .doc = "one half, or those of a row", .required = true});
    f(&FastenerSpec::b, {.key = "b", .doc = "the other halves, as many; not given: the same places on the panel that is the mirror image"});
    f(&FastenerSpec::treatment, {.key = "treatment", .doc = "constraint: the halves are held exactly; spring: by a stiff spring"});
    f(&FastenerSpec::stiffness, {.key = "stiffness", .doc = "of the spring; not given: 500 N/m", .unit = "N/m", .min = 1, .max = 1e6});
    f(&FastenerSpec::capture, {.key = "capture", .doc = "distance at which it takes hold; 0: at once", .unit = "m", .min = 0, .max = 1});
    f(&FastenerSpec::mass, {.key = "mass", .doc = "mass of both halves together, of one fastener", .unit = "kg", .min = 0, .max = 1});
    f(&FastenerSpec::length, {.key = "length", .doc = "distance at which the halves are held (a button's shank)", .unit = "m", .min = 0, .max = 0.1});
    f(&FastenerSpec::closed, {.key = "closed", .doc = "false: it only weighs"});
    f.check([](const FastenerSpec& spec, Issues& issues) {
      if (spec.treatment == Treatment::constraint && spec.stiffness) issues.push_back({"bad_fastener", {.item = "stiffness"}, "a constraint has no stiffness", "leave it out, or write `treatment: spring`"});
    });
  }
};

struct ZipSpec {
  std::string name;
  std::vector<std::string> a, b;
  double slider = 1;
  double pitch = 0.003;
  double mass = 0.012;
  double ease = 0;
  Treatment treatment = Treatment::constraint;
  std::optional<double> stiffness;
  double capture = 0;
  static void describe(auto& f) {
    f(&ZipSpec::name, {.key = "name", .doc = "name", .required = true});
    f(&ZipSpec::a, {.key = "a", .doc = "edges of the first side from the zip's bottom on, panel.edge or a stretch panel.edge(from..to); '-' before one runs it backwards", .required = true});
    f(&ZipSpec::b, {.key = "b", .doc = "edges of the second side, in the same direction", .required = true});
    f(&ZipSpec::slider, {.key = "slider", .doc = "how far up it is closed", .unit = "1", .min = 0, .max = 1});
    f(&ZipSpec::pitch, {.key = "pitch", .doc = "distance of its teeth", .unit = "m", .min = 1e-4, .max = 0.1});
    f(&ZipSpec::mass, {.key = "mass", .doc = "mass per length, both sides together", .unit = "kg/m", .min = 0, .max = 10});
    f(&ZipSpec::ease, {.key = "ease", .doc = "length difference of the two sides that is intended", .unit = "m", .min = 0, .max = 1});
    f(&ZipSpec::treatment, {.key = "treatment", .doc = "constraint: teeth are held exactly; spring: by a stiff spring"});
    f(&ZipSpec::stiffness, {.key = "stiffness", .doc = "of one tooth's spring; not given: 500 N/m", .unit = "N/m", .min = 1, .max = 1e6});
    f(&ZipSpec::capture, {.key = "capture", .doc = "distance at which teeth take hold; 0: at once", .unit = "m", .min = 0, .max = 1});
    f.check([](const ZipSpec& spec, Issues& issues) {
      if (spec.treatment == Treatment::constraint && spec.stiffness) issues.push_back({"bad_zip", {.item = "stiffness"}, "a constraint has no stiffness", "leave it out, or write `treatment: spring`"});
    });
  }
};

/// Points of two layers sewn together by a few stitches.
struct TackSpec {
  std::string name;
  std::vector<FastenerEnd> a, b;
  static void describe(auto& f) {
    f(&TackSpec::name, {.key = "name", .doc = "name, also of the seam that holds them", .required = true});
    f(&TackSpec::a, {.key = "a", .doc = "a point of one layer, or several", .required = true});
    f(&TackSpec::b, {.key = "b", .doc = "the points of the other layer that they are held to, as many", .required = true});
  }
};

enum class FreeSide { inside, outside };

/// Panels with a grid of their own that lie on others.
struct FreeSpec {
  std::string name;
  std::vector<std::string> panels, on;
  FreeSide side = FreeSide::inside;
  static void describe(auto& f) {
    f(&FreeSpec::name, {.key = "name", .doc = "name", .required = true});
    f(&FreeSpec::panels, {.key = "panels", .doc = "panels that it consists of; * stands for any letters", .required = true});
    f(&FreeSpec::on, {.key = "on", .doc = "panels that it lies on", .required = true});
    f(&FreeSpec::side, {.key = "side", .doc = "outside: farther from the body than they are; inside: nearer"});
  }
};

/// Adds closures with their fasteners; replaces those that are there.
/// open, closed  names of fasteners and zips that are to be open or closed whatever their spec says; * stands for any letters
/// error  "bad_fastener", "bad_zip", "unknown_fastener", "unknown_point", "unknown_panel", "unknown_line", "duplicate_name"
struct FastenParams {
  std::vector<FastenerSpec> fasteners;
  std::vector<ZipSpec> zips;
  std::vector<std::string> open, closed;
};
struct Fastened {
  mesh::GarmentMesh garment;
  double farthest_snap = 0;  ///< from a position asked for to the particle taken [m]
};
Result<Fastened> fasten(const mesh::GarmentMesh& garment, const FastenParams& params);

/// Adds the tacks as seams of kind "tack"; replaces those that are there.
/// error  "bad_tack" and those of points; "degenerate_face", "folded_panel" (of Category::check) as in sewing
Result<Fastened> tack(const mesh::GarmentMesh& garment, const std::vector<TackSpec>& tacks);

/// Fills free layers and the order of panels. Panels that are in no relation, and those that others lie on while they are no
/// free layer themselves, have order 0 where the relations allow it.
/// error  "unknown_panel", "duplicate_name", "bad_layer", "layer_cycle"
Result<mesh::GarmentMesh> free_layers(const mesh::GarmentMesh& garment, const std::vector<FreeSpec>& layers);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::FastenerKind> {
  static constexpr std::array names{std::pair{"button", toile::tailor::FastenerKind::button}, std::pair{"hook", toile::tailor::FastenerKind::hook},
                                    std::pair{"snap", toile::tailor::FastenerKind::snap}};
};
template <>
struct toile::Choices<toile::tailor::Treatment> {
  static constexpr std::array names{std::pair{"constraint", toile::tailor::Treatment::constraint}, std::pair{"spring", toile::tailor::Treatment::spring}};
};
template <>
struct toile::Choices<toile::tailor::FreeSide> {
  static constexpr std::array names{std::pair{"inside", toile::tailor::FreeSide::inside}, std::pair{"outside", toile::tailor::FreeSide::outside}};
};
