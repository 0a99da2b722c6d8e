#include "toile/inspect/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toile::inspect {
namespace {

constexpr Srgb ink{0.15, 0.16, 0.18}, frame{0.55, 0.57, 0.6}, grid{0.9, 0.91, 0.92};
constexpr double letter = 11, small = 9;  // heights of capitals [px]

struct Axis {
  double low, high;       // values
  double from, to;        // pixels
  std::vector<double> ticks;
  double at(double value) const { return from + (value - low) / (high - low) * (to - from); }
};

std::pair<double, double> extent(const Chart& chart, std::vector<double> Series::*row, const std::optional<std::array<double, 2>>& given) {
  if (given) return {(*given)[0], (*given)[1]};
  double low = 1e300, high = -1e300;
  for (const Series& s : chart.series) {
    for (double v : s.*row) {
      if (!std::isfinite(v)) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  if (low > high) return {0, 1};
  if (low == high) {
    const double margin = low == 0 ? 1 : 0.1 * std::abs(low);
    return {low - margin, high + margin};
  }
  return {low, high};
}

/// As many digits as the step needs, and no sign on zero.
std::string tick_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) value = 0;
  if (std::abs(value) >= 1e5 || (step < 1e-3 && value != 0)) return fmt::format("{:.4g}", value);
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  return fmt::format("{:.{}f}", value, digits);
}

void dashed_stroke(Image& image, double x0, double y0, double x1, double y1, double width, const Srgb& color, double& travelled) {
  constexpr double on = 7, off = 5;
  const double length = std::hypot(x1 - x0, y1 - y0);
  double s = 0;
  while (s < length) {
    const double phase = std::fmod(travelled, on + off);
    const double left = (phase < on ? on - phase : on + off - phase) + 1e-9, end = std::min(length, s + left);
    if (phase < on) draw_stroke(image, x0 + (x1 - x0) * s / length, y0 + (y1 - y0) * s / length, x0 + (x1 - x0) * end / length, y0 + (y1 - y0) * end / length, width, color);
    travelled += end - s;
    s = end;
  }
}

/// The part of a segment inside a rectangle.
bool clip(double& x0, double& y0, double& x1, double& y1, double left, double top, double right, double bottom) {
  double from = 0, to = 1;
  const double dx = x1 - x0, dy = y1 - y0;
  for (const auto& [d, distance] : {std::pair{-dx, x0 - left}, std::pair{dx, right - x0}, std::pair{-dy, y0 - top}, std::pair{dy, bottom - y0}}) {
    if (d == 0) {
      if (distance < 0) return false;
      continue;
    }
    const double t = distance / d;
    if (d < 0) from = std::max(from, t);
    else to = std::min(to, t);
  }
  if (from > to) return false;
  const double ax = x0, ay = y0;
  x0 = ax + from * dx;
  y0 = ay + from * dy;
  x1 = ax + to * dx;
  y1 = ay + to * dy;
  return true;
}

void draw_chart(Image& image, const Chart& chart, int left, int top, int width, int height) {
  auto [x_low, x_high] = extent(chart, &Series::x, chart.x_range);
  auto [y_low, y_high] = extent(chart, &Series::y, chart.y_range);
  Axis x{x_low, x_high, 0, 0, round_ticks(x_low, x_high, 6)}, y{y_low, y_high, 0, 0, round_ticks(y_low, y_high, 6)};
  if (!chart.x_range) x.low = x.ticks.front(), x.high = x.ticks.back();
  if (!chart.y_range) y.low = y.ticks.front(), y.high = y.ticks.back();
  const double x_step = x.ticks[1] - x.ticks[0], y_step = y.ticks[1] - y.ticks[0];
  double margin = 0;
  for (double t : y.ticks) margin = std::max(margin, text_width(small, tick_text(t, y_step)));
  x.from = left + margin + 22;
  x.to = left + width - 18;
  y.from = top + height - 44;
  y.to = top + 52;

  draw_text(image, left + 12, top + 20, letter, ink, chart.title);
  draw_text(image, left + 12, top + 40, small, frame, chart.y_label);
  draw_text(image, x.to - text_width(small, chart.x_label), top + height - 10, small, frame, chart.x_label);
  const auto inside = [](const Axis& axis, double t) { return t >= axis.low - 1e-9 * (axis.high - axis.low) && t <= axis.high + 1e-9 * (axis.high - axis.low); };
  for (double t : x.ticks) {
    if (!inside(x, t)) continue;
    const std::string text = tick_text(t, x_step);
    draw_stroke(image, x.at(t), y.from, x.at(t), y.to, 1, t == 0 ? frame : grid);
    draw_text(image, x.at(t) - 0.5 * text_width(small, text), y.from + 18, small, ink, text);
  }
  for (double t : y.ticks) {
    if (!inside(y, t)) continue;
    const std::string text = tick_text(t, y_step);
    draw_stroke(image, x.from, y.at(t), x.to, y.at(t), 1, t == 0 ? frame : grid);
    draw_text(image, x.from - 8 - text_width(small, text), y.at(t) + 0.5 * small, small, ink, text);
  }
  draw_stroke(image, x.from, y.from, x.to, y.from, 1.2, frame);
  draw_stroke(image, x.from, y.from, x.from, y.to, 1.2, frame);

  for (const Series& s : chart.series) {
    double travelled = 0;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!std::isfinite(s.x[i]) || !std::isfinite(s.y[i])) continue;
      if (s.stroke == Stroke::dots) {
        const double px = x.at(s.x[i]), py = y.at(s.y[i]);
        if (px >= x.from - 1 && px <= x.to + 1 && py >= y.to - 1 && py <= y.from + 1) draw_stroke(image, px, py, px, py, 6, s.color);
        continue;
      }
      if (i == 0 || !std::isfinite(s.x[i - 1]) || !std::isfinite(s.y[i - 1])) continue;
      double x0 = x.at(s.x[i - 1]), y0 = y.at(s.y[i - 1]), x1 = x.at(s.x[i]), y1 = y.at(s.y[i]);
      if (!clip(x0, y0, x1, y1, x.from, y.to, x.to, y.from)) continue;
      if (s.stroke == Stroke::dashed) dashed_stroke(image, x0, y0, x1, y1, 1.6, s.color, travelled);
      else draw_stroke(image, x0, y0, x1, y1, 2, s.color);
    }
  }

  // Legend: from the right, beside the title where there is room, else beside the label.
  double legend = 0, right = x.to;
  for (const Series& s : chart.series) legend += s.name.empty() ? 0 : text_width(small, s.name) + 42;
  const bool beside_title = left + 12 + text_width(letter, chart.title) + 10 < x.to - legend + 16;
  for (auto s = chart.series.rbegin(); s != chart.series.rend(); ++s) {
    if (s->name.empty()) continue;
    const double w = text_width(small, s->name), base = top + (beside_title ? 20 : 40);
    draw_text(image, right - w, base, small, ink, s->name);
    const double x1 = right - w - 6, x0 = x1 - 20;
    double travelled = 0;
    if (s->stroke == Stroke::dots) draw_stroke(image, x1 - 8, base - 0.5 * small, x1 - 8, base - 0.5 * small, 6, s->color);
    else if (s->stroke == Stroke::dashed) dashed_stroke(image, x0, base - 0.5 * small, x1, base - 0.5 * small, 1.6, s->color, travelled);
    else draw_stroke(image, x0, base - 0.5 * small, x1, base - 0.5 * small, 2, s->color);
    right = x0 - 16;
  }
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  TOILE_CHECK(low < high && count > 0, "{} to {}, {}", low, high, count);
  const double raw = (high - low) / count, power = std::pow(10, std::floor(std::log10(raw)));
  const double mantissa = raw / power;
  const double step = power * (mantissa <= 1 + 1e-9 ? 1 : mantissa <= 2 + 1e-9 ? 2 : mantissa <= 5 + 1e-9 ? 5 : 10);
  const auto first = static_cast<long long>(std::floor(low / step + 1e-9)), last = static_cast<long long>(std::ceil(high / step - 1e-9));
  std::vector<double> ticks;
  for (long long k = first; k <= last; ++k) ticks.push_back(static_cast<double>(k) * step);
  return ticks;
}

Image draw_charts(const std::vector<Chart>& charts, const PlotOptions& options) {
  TOILE_CHECK(!charts.empty() && options.columns > 0, "{} charts in {} columns", charts.size(), options.columns);
  Image image(options.width, options.height);
  const int columns = std::min(options.columns, static_cast<int>(charts.size())), rows = (static_cast<int>(charts.size()) + columns - 1) / columns;
  const int width = options.width / columns, height = options.height / rows;
  TOILE_CHECK(width >= 160 && height >= 120, "a chart would have {} x {} pixels", width, height);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    for (const Series& s : charts[i].series) TOILE_CHECK(s.x.size() == s.y.size(), "series {}: {} and {} values", s.name, s.x.size(), s.y.size());
    draw_chart(image, charts[i], static_cast<int>(i) % columns * width, static_cast<int>(i) / columns * height, width, height);
  }
  return image;
}

}  // namespace toile::inspect
