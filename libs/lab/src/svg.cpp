// Plots as SVG: axes with round numbers, lines, marks, a legend.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "toile/inspect/plot.h"
#include "toile/lab/report.h"

namespace toile::lab {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else out += c;
  }
  return out;
}

struct Axis {
  bool log = false;
  double low = 0, high = 1, from = 0, to = 1;  ///< values, pixels
  std::vector<double> ticks;
  double value(double v) const { return log ? std::log10(v) : v; }
  bool shows(double v) const { return std::isfinite(v) && (!log || v > 0); }
  double operator()(double v) const { return from + (to - from) * (value(v) - value(low)) / (value(high) - value(low)); }
};

Axis make_axis(const std::vector<double>& values, bool log, double from, double to) {
  Axis axis{log, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), from, to, {}};
  for (double v : values) {
    if (!axis.shows(v)) continue;
    axis.low = std::min(axis.low, v);
    axis.high = std::max(axis.high, v);
  }
  if (!(axis.low < axis.high)) {
    const double middle = std::isfinite(axis.low) ? axis.low : 1;
    axis.low = log ? 0.5 * middle : middle - 1;
    axis.high = log ? 2 * middle : middle + 1;
  }
  if (log) {
    axis.low = std::pow(10, std::floor(std::log10(axis.low) + 1e-9));
    axis.high = std::pow(10, std::ceil(std::log10(axis.high) - 1e-9));
    for (double t = axis.low; t <= axis.high * 1.001; t *= 10) axis.ticks.push_back(t);
  } else {
    axis.ticks = inspect::round_ticks(axis.low, axis.high, 6);
    axis.low = std::min(axis.low, axis.ticks.front());
    axis.high = std::max(axis.high, axis.ticks.back());
  }
  return axis;
}

constexpr std::array colors{"#1f5fa8", "#c8491d", "#2e8b57", "#8a5aa8", "#b8860b", "#008b8b", "#a0305a", "#5f6b1f"};

}  // namespace

std::string to_svg(const Plot& plot) {
  const double width = 640, height = 420, left = 70, right = 20, top = 36, bottom = 52;
  std::vector<double> all_x, all_y;
  for (const Curve& curve : plot.curves) {
    all_x.insert(all_x.end(), curve.x.begin(), curve.x.end());
    all_y.insert(all_y.end(), curve.y.begin(), curve.y.end());
  }
  const Axis x = make_axis(all_x, plot.log_x, left, width - right), y = make_axis(all_y, plot.log_y, height - bottom, top);
  std::string out = fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
                                "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n<text x=\"{2}\" y=\"20\" font-size=\"14\">{3}</text>\n",
                                width, height, left, escaped(plot.title));
  for (double t : x.ticks) {
    out += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.5g}</text>\n", x(t), top, height - bottom, height - bottom + 16, t);
  }
  for (double t : y.ticks) {
    out += fmt::format("<path d=\"M{1} {0:.1f}H{2}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.5g}</text>\n", y(t), left, width - right, left - 6, y(t) + 4, t);
  }
  out += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"black\"/>\n", left, top, width - left - right, height - top - bottom);
  out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", 0.5 * (left + width - right), height - 14, escaped(plot.x_label));
  out += fmt::format("<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n", 0.5 * (top + height - bottom), escaped(plot.y_label));
  std::size_t measured = 0;
  double legend = top + 16;
  for (const Curve& curve : plot.curves) {
    const char* color = curve.reference ? "black" : colors[measured++ % colors.size()];
    if (curve.reference) {
      std::string path;
      bool pen = false;
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        const bool shown = x.shows(curve.x[i]) && y.shows(curve.y[i]);
        if (shown) path += fmt::format("{}{:.1f} {:.1f}", pen ? "L" : "M", x(curve.x[i]), y(curve.y[i]));
        pen = shown;
      }
      out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\"/>\n", path, color);
      out += fmt::format("<path d=\"M{} {}h16\" stroke=\"{}\"/>", left + 10, legend - 4, color);
    } else {
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        if (x.shows(curve.x[i]) && y.shows(curve.y[i])) out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" fill=\"none\" stroke=\"{}\"/>\n", x(curve.x[i]), y(curve.y[i]), color);
      }
      out += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"2.6\" fill=\"none\" stroke=\"{}\"/>", left + 18, legend - 4, color);
    }
    out += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", left + 32, legend, escaped(curve.name));
    legend += 15;
  }
  return out + "</svg>\n";
}

}  // namespace toile::lab
