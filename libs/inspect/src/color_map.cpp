#include "toile/inspect/color_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toile::inspect {
namespace {

constexpr double degree = std::numbers::pi / 180;

std::array<double, 3> linear_from_oklab(double lightness, double a, double b) {
  const double l = lightness + 0.3963377774 * a + 0.2158037573 * b;
  const double m = lightness - 0.1055613458 * a - 0.0638541728 * b;
  const double s = lightness - 0.0894841775 * a - 1.2914855480 * b;
  const double l3 = l * l * l, m3 = m * m * m, s3 = s * s * s;
  return {4.0767416621 * l3 - 3.3077115913 * m3 + 0.2309699292 * s3, -1.2684380046 * l3 + 2.6097574011 * m3 - 0.3413193965 * s3,
          -0.0041960863 * l3 - 0.7034186147 * m3 + 1.7076147010 * s3};
}

}  // namespace

double linear_from_srgb(double value) { return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4); }
double srgb_from_linear(double value) { return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055; }

Srgb oklch(double lightness, double chroma, double hue) {
  const double c = std::cos(hue), s = std::sin(hue);
  const auto inside = [&](double k) {
    const auto rgb = linear_from_oklab(lightness, k * c, k * s);
    return std::all_of(rgb.begin(), rgb.end(), [](double v) { return v >= -1e-9 && v <= 1 + 1e-9; });
  };
  if (!inside(chroma)) {
    double low = 0, high = chroma;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (inside(middle) ? low : high) = middle;
    }
    chroma = low;
  }
  const auto rgb = linear_from_oklab(lightness, chroma * c, chroma * s);
  return {srgb_from_linear(std::clamp(rgb[0], 0.0, 1.0)), srgb_from_linear(std::clamp(rgb[1], 0.0, 1.0)),
          srgb_from_linear(std::clamp(rgb[2], 0.0, 1.0))};
}

Srgb sequential_color(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return oklch(0.95 - 0.65 * t, 0.05 + 0.42 * t * (1.08 - t), (102 - 182 * t) * degree);
}

Srgb diverging_color(double t) {
  t = std::clamp(t, -1.0, 1.0);
  const double k = std::abs(t);
  return oklch(0.965 - 0.52 * k, 0.004 + 0.30 * k * (1.2 - 0.68 * k), (t < 0 ? 255 : 30) * degree);
}

Srgb category_color(int i) {
  const double golden = 137.50776405003785;
  return oklch(i % 2 == 0 ? 0.74 : 0.64, 0.11, (40 + golden * i) * degree);
}

}  // namespace toile::inspect
