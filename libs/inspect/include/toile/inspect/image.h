// Pixel images, lettering on them, and PNG.
#pragma once

#include "toile/base/result.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace toile::inspect {

/// sRGB, 8 bits a channel, rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< height x width x 3

  Image() = default;
  Image(int width, int height) : width(width), height(height), rgb(static_cast<std::size_t>(width) * height * 3, 255) {}
  std::uint8_t* pixel(int x, int y) { return &rgb[(static_cast<std::size_t>(y) * width + x) * 3]; }
  const std::uint8_t* pixel(int x, int y) const { return &rgb[(static_cast<std::size_t>(y) * width + x) * 3]; }
};

using Srgb = std::array<double, 3>;  ///< each 0..1

/// A stroke with round ends from (x0, y0) to (x1, y1) in pixels (the centre of the first pixel is 0.5, 0.5), smoothed at
/// its border. Parts off the image are left out.
void draw_stroke(Image& image, double x0, double y0, double x1, double y1, double width, const Srgb& color);
void fill_rectangle(Image& image, int x0, int y0, int x1, int y1, const Srgb& color);

/// Letters of a stroke alphabet of our own: ASCII letters (small ones as they are), digits and common signs, and the
/// degree sign; anything else is drawn as a box. (x, y) is the left end of the base line, `height` that of a capital.
void draw_text(Image& image, double x, double y, double height, const Srgb& color, std::string_view text);
/// Width of that text in pixels.
double text_width(double height, std::string_view text);

/// True if this build can write PNG files.
bool png_available();
/// The bytes of a PNG file; the same image gives the same bytes.
/// error  Issue "not_built" if the build had no libpng
Result<std::string> encode_png(const Image& image);
/// The reverse, for comparing pictures. 8-bit RGB only.
/// error  Issue "bad_png", "not_built"
Result<Image> decode_png(std::string_view bytes, const std::string& name);

}  // namespace toile::inspect
