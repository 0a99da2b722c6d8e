// Pictures of garments and bodies by ray tracing, without a display. docs/pictures.md.
#pragma once

#include "toile/base/fields.h"
#include "toile/inspect/image.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <optional>
#include <string>
#include <vector>

namespace toile::inspect {

enum class View { front, back, left, right, side, three_quarter, top, inside, flat };
enum class Frame { all, garment, support };
enum class Lines { seams, mesh, none };
enum class Smoothing { vertices, faces };
enum class Show { all, garment, support };

struct PictureParams {
  View view = View::front;
  std::optional<double> azimuth;    ///< [rad]
  std::optional<double> elevation;  ///< [rad]
  std::string color = "plain";
  std::optional<std::array<double, 2>> range;
  Smoothing smoothing = Smoothing::vertices;
  Lines lines = Lines::seams;
  Show show = Show::all;
  Frame frame = Frame::all;
  double zoom = 1;
  std::string size = "900x1200";
  int samples = 4;
  std::array<double, 3> background{0.90, 0.90, 0.895};
  std::array<double, 3> support_color{0.77, 0.71, 0.65};
  static void describe(auto& f) {
    f(&PictureParams::view, {.key = "view", .doc = "where the camera stands; side is left (the wearer's); inside leaves out the near half of the cloth and the support; flat lays the panels out as cut"});
    f(&PictureParams::azimuth, {.key = "azimuth", .doc = "camera's turn about the vertical instead of the view's: 0 in front, 90 deg at the wearer's left", .unit = "rad", .min = -7, .max = 7});
    f(&PictureParams::elevation, {.key = "elevation", .doc = "camera's height as an angle instead of the view's", .unit = "rad", .min = -1.56, .max = 1.56});
    f(&PictureParams::color, {.key = "color", .doc = "plain, panel, laminate, order (of free layers), strain_warp, strain_weft, shear, strain_bias, tension_warp, tension_weft, ease, the name of a vertex or face column of the garment, or region (of the support)"});
    f(&PictureParams::range, {.key = "range", .doc = "values at the two ends of the colour scale, in the unit that the legend shows; otherwise taken from the data"});
    f(&PictureParams::smoothing, {.key = "smoothing", .doc = "colours of faces averaged to vertices inside a panel, or as they are"});
    f(&PictureParams::lines, {.key = "lines", .doc = "which lines are drawn: seams, free edges and folds (dashed), the whole mesh too, or none"});
    f(&PictureParams::show, {.key = "show", .doc = "what is drawn of the files given"});
    f(&PictureParams::frame, {.key = "frame", .doc = "what the picture is filled with"});
    f(&PictureParams::zoom, {.key = "zoom", .doc = "enlargement about the middle of the frame", .unit = "1", .min = 0.05, .max = 100});
    f(&PictureParams::size, {.key = "size", .doc = "WIDTHxHEIGHT in pixels"});
    f(&PictureParams::samples, {.key = "samples", .doc = "rays a pixel; pixels at outlines and lines get four times as many", .unit = "1", .min = 1, .max = 256});
    f(&PictureParams::background, {.key = "background", .doc = "sRGB colour", .unit = "1", .min = 0, .max = 1});
    f(&PictureParams::support_color, {.key = "support_color", .doc = "sRGB colour of the support", .unit = "1", .min = 0, .max = 1});
  }
};

/// A value over the cloth that a picture shows as colour.
struct ColorField {
  enum class Place { vertices, faces };
  std::string title;  ///< with the unit, as the legend shows it
  Place place = Place::faces;
  std::vector<double> values;  ///< in the legend's unit, |V| or |F|
  bool diverging = false;      ///< has a meaningful zero
};

/// The field of that name. `support` may be null; ease needs it.
/// error  Issue "unknown_color", "needs_support"
Result<ColorField> color_field(const std::string& name, const mesh::GarmentMesh& garment, const mesh::SupportMesh* support);

/// True if this build can draw (it had Embree).
bool pictures_available();

/// Garment and support may each be null, not both. The same bytes at any number of threads.
/// error  Issue "not_built" without Embree, "bad_size", those of color_field
Result<Image> draw_picture(const PictureParams& params, const mesh::GarmentMesh* garment, const mesh::SupportMesh* support);

}  // namespace toile::inspect

template <>
struct toile::Choices<toile::inspect::View> {
  using V = toile::inspect::View;
  static constexpr std::array names{std::pair{"front", V::front}, std::pair{"back", V::back}, std::pair{"left", V::left},
                                    std::pair{"right", V::right}, std::pair{"side", V::side}, std::pair{"three_quarter", V::three_quarter},
                                    std::pair{"top", V::top}, std::pair{"inside", V::inside}, std::pair{"flat", V::flat}};
};
template <>
struct toile::Choices<toile::inspect::Frame> {
  using V = toile::inspect::Frame;
  static constexpr std::array names{std::pair{"all", V::all}, std::pair{"garment", V::garment}, std::pair{"support", V::support}};
};
template <>
struct toile::Choices<toile::inspect::Lines> {
  using V = toile::inspect::Lines;
  static constexpr std::array names{std::pair{"seams", V::seams}, std::pair{"mesh", V::mesh}, std::pair{"none", V::none}};
};
template <>
struct toile::Choices<toile::inspect::Smoothing> {
  using V = toile::inspect::Smoothing;
  static constexpr std::array names{std::pair{"vertices", V::vertices}, std::pair{"faces", V::faces}};
};
template <>
struct toile::Choices<toile::inspect::Show> {
  using V = toile::inspect::Show;
  static constexpr std::array names{std::pair{"all", V::all}, std::pair{"garment", V::garment}, std::pair{"support", V::support}};
};
