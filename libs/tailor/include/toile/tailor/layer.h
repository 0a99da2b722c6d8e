// What the panels are made of: fabrics, bonded layers, buttons (docs/tailoring.md, "Layers").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/fabric/card.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace toile::tailor {

enum class LayerSide {
  under,  ///< on the back of what is there (the body's side)
  over,   ///< on its face
};

struct BondedLayer {
  std::string name;
  std::string fabric;
  std::vector<std::string> panels;
  LayerSide side = LayerSide::under;
  std::vector<std::array<double, 2>> region;
  static void describe(auto& f) {
    f(&BondedLayer::name, {.key = "name", .doc = "name of the layer", .required = true});
    f(&BondedLayer::fabric, {.key = "fabric", .doc = "fabric of the layer, its warp along the panel's", .required = true});
    f(&BondedLayer::panels, {.key = "panels", .doc = "panels that get it; * stands for any letters", .required = true});
    f(&BondedLayer::side, {.key = "side", .doc = "under: on the back of the cloth; over: on its face"});
    f(&BondedLayer::region, {.key = "region", .doc = "corners (u, v) of the part that gets it, in panel coordinates (mirrored panels: those of the plain one); without it the whole panel", .unit = "m"});
  }
};

enum class FastenerKind { button, hook, snap };

/// One half of a fastener: a named point, or a position in a panel.
struct FastenerEnd {
  std::optional<std::string> point;
  std::optional<std::string> panel;
  std::optional<std::array<double, 2>> at;
  static void describe(auto& f) {
    f(&FastenerEnd::point, {.key = "point", .doc = "named point: panel.point"});
    f(&FastenerEnd::panel, {.key = "panel", .doc = "panel, if it is given by its position"});
    f(&FastenerEnd::at, {.key = "at", .doc = "position (u, v) in that panel; the nearest particle is taken", .unit = "m"});
  }
};

struct FastenerSpec {
  std::string name;
  FastenerKind kind = FastenerKind::button;
  FastenerEnd a, b;
  double mass = 0.001;
  double length = 0.003;
  static void describe(auto& f) {
    f(&FastenerSpec::name, {.key = "name", .doc = "name", .required = true});
    f(&FastenerSpec::kind, {.key = "kind", .doc = "button, hook or snap"});
    f(&FastenerSpec::a, {.key = "a", .doc = "one half", .required = true});
    f(&FastenerSpec::b, {.key = "b", .doc = "the other half", .required = true});
    f(&FastenerSpec::mass, {.key = "mass", .doc = "mass of both halves together", .unit = "kg", .min = 0, .max = 1});
    f(&FastenerSpec::length, {.key = "length", .doc = "distance at which the halves are held (a button's shank)", .unit = "m", .min = 0, .max = 0.1});
  }
};

struct LayerParams {
  std::string base;
  std::map<std::string, std::string> panels;
  std::vector<BondedLayer> bonded;
  std::vector<FastenerSpec> fasteners;
  static void describe(auto& f) {
    f(&LayerParams::base, {.key = "base", .doc = "fabric of all panels that `panels` does not name", .required = true});
    f(&LayerParams::panels, {.key = "panels", .doc = "fabric of single panels; * in a panel's name stands for any letters"});
    f(&LayerParams::bonded, {.key = "bonded", .doc = "layers bonded to the cloth, from the cloth outwards"});
    f(&LayerParams::fasteners, {.key = "fasteners", .doc = "buttons, hooks, snaps"});
  }
};

/// Area and mass of one fabric in a garment.
struct Material {
  std::string fabric;
  double area = 0;  ///< [m2]
  double mass = 0;  ///< [kg]
};

struct Layered {
  mesh::GarmentMesh garment;
  std::vector<Material> materials;  ///< by fabric name
  double mass = 0;                  ///< of everything, fasteners included [kg]
};

/// Gives every face its laminate and adds the fasteners. Replaces laminates and fasteners that are there.
/// cards  the fabrics that the spec may name
/// error  "unknown_fabric", "duplicate_fabric", "unknown_panel", "ambiguous_fabric", "bad_region", "empty_region",
///        "unknown_point", "bad_fastener"
Result<Layered> layer(const mesh::GarmentMesh& garment, const std::vector<fabric::Card>& cards, const LayerParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::LayerSide> {
  static constexpr std::array names{std::pair{"under", toile::tailor::LayerSide::under}, std::pair{"over", toile::tailor::LayerSide::over}};
};
template <>
struct toile::Choices<toile::tailor::FastenerKind> {
  static constexpr std::array names{std::pair{"button", toile::tailor::FastenerKind::button}, std::pair{"hook", toile::tailor::FastenerKind::hook},
                                    std::pair{"snap", toile::tailor::FastenerKind::snap}};
};
