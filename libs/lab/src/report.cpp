#include "toile/lab/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "toile/base/text.h"
#include "toile/inspect/json.h"

namespace toile::lab {

const char* to_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::met: return "met";
    case Verdict::missed: return "missed";
    case Verdict::failed: return "failed";
  }
  return "";
}

std::optional<double> Row::error() const {
  if (!value) return std::nullopt;
  switch (measure) {
    case Measure::relative: return reference && *reference != 0 ? std::optional(*value / *reference - 1) : std::nullopt;
    case Measure::absolute: return reference ? std::optional(*value - *reference) : std::nullopt;
    case Measure::at_most: return *value;
  }
  return std::nullopt;
}

Verdict Row::verdict() const {
  const std::optional<double> e = error();
  if (!e || !std::isfinite(*e)) return Verdict::failed;
  return converged && std::abs(*e) <= target ? Verdict::met : Verdict::missed;
}

std::vector<Row> Report::rows() const {
  std::vector<Row> all;
  for (const Section& section : sections) all.insert(all.end(), section.rows.begin(), section.rows.end());
  return all;
}

namespace {

std::string number(const std::optional<double>& value) { return value ? fmt::format("{:.5g}", *value) : std::string("-"); }

/// Of an error or target: per cent, or a plain number with the row's unit.
std::string amount(const Row& row, double value, bool sign) {
  if (row.measure == Measure::absolute) return sign ? fmt::format("{:+.3g}", value) : fmt::format("{:.3g}", value);
  if (std::abs(value) < 1e-4 && value != 0) return sign ? fmt::format("{:+.1e}", value) : fmt::format("{:.1e}", value);
  return sign && row.measure != Measure::at_most ? fmt::format("{:+.3g} %", 100 * value) : fmt::format("{:.3g} %", 100 * value);
}

std::array<std::string, 11> cells(const Row& row) {
  const std::optional<double> e = row.error();
  std::string note = row.note;
  if (!row.converged) note += (note.empty() ? "" : "; ") + std::string("did not come to rest");
  return {row.subject, row.model, row.mesh, row.quantity, row.unit, row.measure == Measure::at_most ? "-" : number(row.reference), number(row.value), e ? amount(row, *e, true) : "-",
          amount(row, row.target, false), to_text(row.verdict()), note};
}

constexpr std::array headings{"case", "model", "mesh", "quantity", "unit", "reference", "value", "error", "target", "verdict", "note"};

struct Count {
  int met = 0, missed = 0, failed = 0;
  void add(Verdict v) { ++(v == Verdict::met ? met : v == Verdict::missed ? missed : failed); }
};

}  // namespace

std::string figures(const Row& row) {
  const std::optional<double> e = row.error();
  std::string text = number(row.value);
  if (row.measure != Measure::at_most) text += fmt::format(", reference {}, error {}", number(row.reference), e ? amount(row, *e, true) : "-");
  return text + ", target " + amount(row, row.target, false) + (row.converged ? "" : ", did not come to rest");
}

std::string text_table(const std::vector<Row>& rows) {
  std::vector<std::array<std::string, 12>> lines;
  std::array<std::string, 12> head{"test"};
  std::copy(headings.begin(), headings.end(), head.begin() + 1);
  lines.push_back(head);
  for (const Row& row : rows) {
    std::array<std::string, 12> line{row.test};
    const auto rest = cells(row);
    std::copy(rest.begin(), rest.end(), line.begin() + 1);
    lines.push_back(line);
  }
  std::array<std::size_t, 12> width{};
  const auto length = [](const std::string& text) { return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; })); };
  for (const auto& line : lines) {
    for (std::size_t k = 0; k < line.size(); ++k) width[k] = std::max(width[k], length(line[k]));
  }
  std::string out;
  for (const auto& line : lines) {
    std::string text;
    for (std::size_t k = 0; k < line.size(); ++k) text += line[k] + std::string(width[k] - length(line[k]) + 2, ' ');
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  }
  return out;
}

std::string to_json(const Report& report) {
  using inspect::Json;
  Json rows = Json::array();
  Count count;
  for (const Row& row : report.rows()) {
    count.add(row.verdict());
    rows.push(Json::object()
                  .set("test", row.test)
                  .set("case", row.subject)
                  .set("model", row.model)
                  .set("mesh", row.mesh)
                  .set("quantity", row.quantity)
                  .set("unit", row.unit)
                  .set("reference", row.reference)
                  .set("value", row.value)
                  .set("error", row.error())
                  .set("measure", row.measure == Measure::relative ? "relative" : row.measure == Measure::absolute ? "absolute" : "at_most")
                  .set("target", row.target)
                  .set("converged", row.converged)
                  .set("verdict", to_text(row.verdict()))
                  .set("note", row.note));
  }
  return Json::object()
             .set("quick", report.quick)
             .set("counts", Json::object().set("met", count.met).set("missed", count.missed).set("failed", count.failed))
             .set("rows", std::move(rows))
             .dump() +
         "\n";
}

std::string to_markdown(const Report& report, const std::string& plots) {
  std::string out =
      "# Validation\n\nWritten by `make validate` (`toile-lab`), not by hand. Each test is a pipeline of the ordinary programs on patterns and fabrics that "
      "`toile-lab` writes ([simulation](simulation.md), [mechanics](mechanics.md)); its folder under `build/validation/runs` has them all, with the commands. Every target that is "
      "missed stands here with the others. *failed*: there is no value. `woven` is the default model; `particle` is the published one, printed "
      "beside it to show what each is worth ([its place](mechanics.md#particle)).\n\n";
  if (report.quick) out += "**Reduced set** (`--quick`).\n\n";
  const std::array<std::string, 2> models{"woven", "particle"};
  out += "| test | woven: met | missed | failed | particle: met | missed | failed |\n|---|---|---|---|---|---|---|\n";
  std::array<Count, 2> sum;
  for (const Section& section : report.sections) {
    std::array<Count, 2> count;
    for (const Row& row : section.rows) {
      for (std::size_t m = 0; m < 2; ++m) {
        if (row.model != models[m]) continue;
        count[m].add(row.verdict());
        sum[m].add(row.verdict());
      }
    }
    out += fmt::format("| [{}](#{}) | {} | {} | {} | {} | {} | {} |\n", section.title, section.test, count[0].met, count[0].missed, count[0].failed, count[1].met, count[1].missed, count[1].failed);
  }
  out += fmt::format("| **all** | {} | {} | {} | {} | {} | {} |\n", sum[0].met, sum[0].missed, sum[0].failed, sum[1].met, sum[1].missed, sum[1].failed);
  for (const Section& section : report.sections) {
    out += fmt::format("\n## <a id=\"{}\"></a>{}\n\n{}\n\n", section.test, section.title, section.about);
    for (const Plot& plot : section.plots) out += fmt::format("![{}]({}/{}.svg)\n\n", plot.title, plots, plot.name);
    for (std::size_t k = 0; k < headings.size(); ++k) out += fmt::format("{} {} ", k ? "|" : "|", headings[k]);
    out += "|\n";
    for (std::size_t k = 0; k < headings.size(); ++k) out += "|---";
    out += "|\n";
    for (const Row& row : section.rows) {
      auto line = cells(row);
      if (row.verdict() != Verdict::met) line[9] = "**" + line[9] + "**";
      for (const std::string& cell : line) out += fmt::format("| {} ", cell);
      out += "|\n";
    }
  }
  return out;
}

std::string to_csv(const Plot& plot) {
  std::string out = fmt::format("curve,{},{}\n", plot.x_label, plot.y_label);
  for (const Curve& curve : plot.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) out += fmt::format("{},{},{}\n", curve.name, format_number(curve.x[i]), format_number(curve.y[i]));
  }
  return out;
}

}  // namespace toile::lab
