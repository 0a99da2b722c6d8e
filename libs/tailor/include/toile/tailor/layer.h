// What the panels are made of: fabrics, bonded layers, free layers, fasteners (docs/tailoring.md, "Layers").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/fabric/card.h"
#include "toile/fabric/laminate.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/tailor/fasten.h"

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

/// A layer on whole panels, or on the part of them that `region`, `outline` or `piece` encloses.
struct BondedLayer {
  std::string name;
  std::string fabric;
  std::vector<std::string> panels;
  LayerSide side = LayerSide::under;
  std::vector<std::array<double, 2>> region;
  std::vector<std::string> outline;
  std::optional<std::array<double, 2>> inside;
  std::string piece;
  std::array<double, 2> at{0, 0};
  double angle = 0;
  std::optional<fabric::Joint> rule;
  std::optional<double> pressure, spacing, bending_friction, shear_friction;
  static void describe(auto& f) {
    f(&BondedLayer::name, {.key = "name", .doc = "name of the layer", .required = true});
    f(&BondedLayer::fabric, {.key = "fabric", .doc = "fabric of the layer; may be left out of a `piece` whose material `materials` names"});
    f(&BondedLayer::panels, {.key = "panels", .doc = "panels that get it; * stands for any letters; may be left out where `outline` names panels"});
    f(&BondedLayer::side, {.key = "side", .doc = "under: on the back of the cloth; over: on its face"});
    f(&BondedLayer::region, {.key = "region", .doc = "corners (u, v) of the part that gets it, in panel coordinates (mirrored panels: those of the plain one); without region, outline and piece the whole panel", .unit = "m"});
    f(&BondedLayer::outline, {.key = "outline", .doc = "edges and internal lines of the mesh that enclose the part that gets it: line or panel.line (panel or its piece), or a stretch line(from..to)"});
    f(&BondedLayer::inside, {.key = "inside", .doc = "a position (u, v) in the part that gets it, where the outline's lines run from border to border", .unit = "m"});
    f(&BondedLayer::piece, {.key = "piece", .doc = "a piece of the garment, not sewn to anything, that is laid on: its outline is the part, and its panels are used up"});
    f(&BondedLayer::at, {.key = "at", .doc = "where the origin of the piece's coordinates comes to lie, in those of the panel (mirrored panels: of the plain one)", .unit = "m"});
    f(&BondedLayer::angle, {.key = "angle", .doc = "turn of the layer's warp from the panel's, counter-clockwise seen from the face; a piece's outline turns with it", .unit = "rad", .min = -7, .max = 7});
    f(&BondedLayer::rule, {.key = "rule", .doc = "how it acts together with what it is bonded to; not given: as for the garment"});
    f(&BondedLayer::pressure, {.key = "pressure", .doc = "of a sliding layer: normal pressure on it, for its friction", .unit = "Pa", .min = 0, .max = 1e6});
    f(&BondedLayer::spacing, {.key = "spacing", .doc = "of a sliding layer: distance of the lines along which it is joined", .unit = "m", .min = 0, .max = 10});
    f(&BondedLayer::bending_friction, {.key = "2HB", .doc = "of a sliding layer: what its friction adds to 2HB, instead of pressure and spacing", .unit = "N*m/m", .min = 0, .max = 10});
    f(&BondedLayer::shear_friction, {.key = "2HG", .doc = "and to 2HG and 2HG5", .unit = "N/m", .min = 0, .max = 1e4});
    f.check([](const BondedLayer& layer, Issues& issues) {
      const int ways = !layer.region.empty() + !layer.outline.empty() + !layer.piece.empty();
      if (ways > 1) issues.push_back({"bad_region", {.item = "region"}, "the part is given in more than one way", "keep one of region, outline and piece"});
      if (!layer.region.empty() && layer.region.size() < 3) issues.push_back({"bad_region", {.item = "region"}, "a region needs at least three corners", "list its corners in order"});
      if (layer.inside && layer.outline.empty()) issues.push_back({"bad_region", {.item = "inside"}, "there is no outline that it is inside of", "name the lines under `outline`"});
      if (layer.piece.empty() && (layer.at[0] != 0 || layer.at[1] != 0)) issues.push_back({"bad_region", {.item = "at"}, "there is no piece to lay there", "name it under `piece`"});
      if (layer.panels.empty() && layer.outline.empty()) issues.push_back({"unknown_panel", {.item = "panels"}, "it names no panel", "list them under `panels`"});
      if (layer.fabric.empty() && layer.piece.empty()) issues.push_back({"unknown_fabric", {.item = "fabric"}, "it names no fabric", "add `fabric: NAME`"});
      if (layer.pressure.has_value() != layer.spacing.has_value()) issues.push_back({"bad_friction", {.item = layer.pressure ? "pressure" : "spacing"}, "pressure and spacing go together", "give both"});
      if (layer.pressure && (layer.bending_friction || layer.shear_friction)) issues.push_back({"bad_friction", {.item = "pressure"}, "the friction is given in two ways", "keep pressure and spacing, or 2HB and 2HG"});
    });
  }
};

struct LayerParams {
  std::string base;
  std::map<std::string, std::string> materials;
  std::map<std::string, std::string> panels;
  std::vector<BondedLayer> bonded;
  fabric::Joint rule = fabric::Joint::additive;
  std::vector<FreeSpec> free;
  std::vector<TackSpec> tacks;
  std::vector<FastenerSpec> fasteners;
  std::vector<ZipSpec> zips;
  std::vector<std::string> open, closed;
  static void describe(auto& f) {
    f(&LayerParams::base, {.key = "base", .doc = "fabric of all panels that neither `panels` nor `materials` names"});
    f(&LayerParams::materials, {.key = "materials", .doc = "fabric for what the pattern says a panel is cut from"});
    f(&LayerParams::panels, {.key = "panels", .doc = "fabric of single panels; * in a panel's name stands for any letters"});
    f(&LayerParams::bonded, {.key = "bonded", .doc = "layers bonded to the cloth, from the cloth outwards"});
    f(&LayerParams::rule, {.key = "rule", .doc = "how bonded sheets act together: additive: as parallel networks; laminate: as a plate about its neutral axis; sliding: joined along lines, with friction between"});
    f(&LayerParams::free, {.key = "free", .doc = "layers that keep their own grid"});
    f(&LayerParams::tacks, {.key = "tacks", .doc = "points of two layers held together"});
    f(&LayerParams::fasteners, {.key = "fasteners", .doc = "buttons, hooks, snaps"});
    f(&LayerParams::zips, {.key = "zips", .doc = "zips"});
    f(&LayerParams::open, {.key = "open", .doc = "fasteners and zips that are open, whatever they say themselves; * stands for any letters"});
    f(&LayerParams::closed, {.key = "closed", .doc = "and those that are closed"});
  }
};

/// What became of a bonded layer.
struct LayerReport {
  std::string name;
  double area = 0;                   ///< of the faces that got it [m2]
  std::optional<double> piece_area;  ///< of the piece that was laid on, on all panels [m2]
};

struct Layered {
  mesh::GarmentMesh garment;
  std::vector<LayerReport> layers;
  double farthest_snap = 0;  ///< from a position asked for to the particle taken [m]
  Issues notes;              ///< what deserves a look
};

/// Gives every face its laminate, and the garment its free layers, tacks and fasteners. Replaces those that are there.
/// cards  the fabrics that the spec may name
/// error  "unknown_fabric", "no_fabric", "duplicate_fabric", "unknown_panel", "ambiguous_fabric", "duplicate_name", "bad_region",
///        "empty_region", "open_outline", "unknown_line", "piece_sewn", "bad_friction", those of fasten.h and fabric::stacked
Result<Layered> layer(const mesh::GarmentMesh& garment, const std::vector<fabric::Card>& cards, const LayerParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::LayerSide> {
  static constexpr std::array names{std::pair{"under", toile::tailor::LayerSide::under}, std::pair{"over", toile::tailor::LayerSide::over}};
};
template <>
struct toile::Choices<toile::fabric::Joint> {
  static constexpr std::array names{std::pair{"additive", toile::fabric::Joint::additive}, std::pair{"laminate", toile::fabric::Joint::laminate}, std::pair{"sliding", toile::fabric::Joint::sliding}};
};
