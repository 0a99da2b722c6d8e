// Line plots: curves on axes with numbers, several side by side on one image.
#pragma once

#include "toile/inspect/image.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace toile::inspect {

enum class Stroke { full, dashed, dots };

struct Series {
  std::string name;  ///< in the legend; empty: not named there
  std::vector<double> x, y;
  Srgb color{0, 0, 0};
  Stroke stroke = Stroke::full;
};

struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
  std::optional<std::array<double, 2>> x_range, y_range;  ///< not given: what the curves need
};

struct PlotOptions {
  int width = 1200;
  int height = 900;
  int columns = 2;
};

/// Charts in rows from the top left. Points that are not finite interrupt a curve.
/// Precondition: x and y of each series have the same length; width and height hold at least 160 x 120 pixels a chart.
Image draw_charts(const std::vector<Chart>& charts, const PlotOptions& options);

/// Round numbers (1, 2 or 5 times a power of ten apart) that cover [low, high], about `count` of them.
/// Precondition: low < high, both finite.
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace toile::inspect
