// Knife, box and inverted pleats, laid into pieces before they are cut (docs/tailoring.md, "Pleats").
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "toile/base/fields.h"
#include "toile/pattern/pattern.h"

namespace toile::pattern {

/// Seen from the face side with the edge on top.
enum class PleatDirection {
  left,      ///< knife pleats whose visible fold looks to the left
  right,     ///< to the right
  box,       ///< two folds that look away from each other, the cloth between them raised
  inverted,  ///< two folds that meet
};

/// Which way fold lines run from the edge.
enum class PleatLine {
  grain,   ///< along the warp
  square,  ///< at right angles to the edge
};

struct PleatSpec {
  std::string name;
  std::string piece;
  std::string edge;
  std::optional<std::string> from;
  double at = 0;
  double width = 0;
  double depth = 0;
  PleatDirection direction = PleatDirection::left;
  int count = 1;
  PleatLine along = PleatLine::grain;
  bool spread = false;
  double length = 0;
  std::optional<double> pressed;
  double angle = 3.1415926535897931;
  double radius = 0;
  double residual = 0.1;
  double factor = 1;
  static void describe(auto& f) {
    f(&PleatSpec::name, {.key = "name", .doc = "unique name; the lines of its second pleat are NAME_2_outer, NAME_2_inner (box and inverted pleats: NAME_2a_..., NAME_2b_...)", .required = true});
    f(&PleatSpec::piece, {.key = "panel", .doc = "piece of the pattern; its copies get the same pleats, mirrored ones mirrored", .required = true});
    f(&PleatSpec::edge, {.key = "edge", .doc = "edge along which they are laid", .required = true});
    f(&PleatSpec::from, {.key = "from", .doc = "named point of the edge from which `at` counts; without it the edge's start, counter-clockwise round the piece"});
    f(&PleatSpec::at, {.key = "at", .doc = "where the first pleat comes to lie, along the edge", .unit = "m", .min = -10, .max = 10});
    f(&PleatSpec::width, {.key = "width", .doc = "visible cloth from one pleat to the next", .unit = "m", .min = 0, .max = 10});
    f(&PleatSpec::depth, {.key = "depth", .doc = "from the visible fold to the hidden one", .unit = "m", .min = 1e-4, .max = 1, .required = true});
    f(&PleatSpec::direction, {.key = "direction", .doc = "left, right: knife pleats by where the visible fold looks, seen from the face with the edge on top; box; inverted"});
    f(&PleatSpec::count, {.key = "count", .doc = "how many", .min = 1, .max = 1000});
    f(&PleatSpec::along, {.key = "along", .doc = "grain: fold lines along the warp; square: at right angles to the edge"});
    f(&PleatSpec::spread, {.key = "spread", .doc = "the piece is drawn without the pleats: cloth for them is let in from border to border; otherwise it is there already"});
    f(&PleatSpec::length, {.key = "length", .doc = "stitched down from the edge; 0: only caught in the edge's seam", .unit = "m", .min = 0, .max = 10});
    f(&PleatSpec::pressed, {.key = "pressed", .doc = "how far from the edge they are pressed; without it over the whole piece", .unit = "m", .min = 1e-3, .max = 10});
    f(&PleatSpec::angle, {.key = "angle", .doc = "angle that is pressed", .unit = "rad", .min = 0, .max = 3.1415926535897931});
    f(&PleatSpec::radius, {.key = "radius", .doc = "radius of the folds; 0: sharp", .unit = "m", .min = 0, .max = 1});
    f(&PleatSpec::residual, {.key = "residual", .doc = "part of the angle that springs back after pressing", .unit = "1", .min = 0, .max = 0.99});
    f(&PleatSpec::factor, {.key = "factor", .doc = "bending stiffness in the folds over the cloth's", .unit = "1", .min = 0, .max = 1000});
  }
};

/// An internal line that a pleat needs as edges of the mesh.
struct PleatPart {
  std::string piece;
  std::string line;
  std::string kind;   ///< knife, box, inverted
  double angle = 0;   ///< to be pressed, towards the face side; 0: no fold, but the line to which the fold is stitched [rad]
  std::size_t spec = 0;  ///< index into the specs
};

struct Pleated {
  Pattern pattern;
  std::vector<PleatPart> parts;
};

/// Adds the fold lines of pleats to pieces, with points of the same names on the edge, and lets in the cloth that they take up
/// where `spread` says so. Pleats that are stitched down have a line NAME_2_meet, on which the visible fold comes to lie (an
/// inverted pleat one for both, NAME_2a_meet). Specs for the same piece are carried out in their order.
/// error  issues of check(), "unknown_piece", "unknown_edge", "unknown_point", "point_off_edge", "duplicate_name",
///        "narrow_pleats", "pleat_off_edge", "pleat_across", "pleat_on_fold", "pleats_cross"
Result<Pleated> add_pleats(const Pattern& pattern, const std::vector<PleatSpec>& pleats);

}  // namespace toile::pattern

template <>
struct toile::Choices<toile::pattern::PleatDirection> {
  static constexpr std::array names{std::pair{"left", toile::pattern::PleatDirection::left}, std::pair{"right", toile::pattern::PleatDirection::right},
                                    std::pair{"box", toile::pattern::PleatDirection::box}, std::pair{"inverted", toile::pattern::PleatDirection::inverted}};
};
template <>
struct toile::Choices<toile::pattern::PleatLine> {
  static constexpr std::array names{std::pair{"grain", toile::pattern::PleatLine::grain}, std::pair{"square", toile::pattern::PleatLine::square}};
};
