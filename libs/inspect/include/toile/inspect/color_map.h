// Colour scales in which equal steps of the value look like equal steps. docs/pictures.md shows them.
#pragma once

#include "toile/inspect/image.h"

namespace toile::inspect {

/// Lightness, chroma and hue [rad] of OKLab as sRGB; chroma is lowered where the screen cannot show it.
/// Source: docs/bibliography.md#ottosson2020
Srgb oklch(double lightness, double chroma, double hue);

/// t in 0..1 (clamped): light yellow over red to dark violet; lightness falls linearly.
Srgb sequential_color(double t);
/// t in -1..1 (clamped): blue below zero, near white at zero, red above; lightness is even in t.
Srgb diverging_color(double t);
/// A colour for the i-th of several things of a kind: hues a golden angle apart.
Srgb category_color(int i);

double linear_from_srgb(double value);
double srgb_from_linear(double value);

}  // namespace toile::inspect
