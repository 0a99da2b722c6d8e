// Rows of the virtual laboratory's report, its verdicts, and the ways to write them down.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace toile::lab {

/// How far a value may be from its reference.
enum class Measure {
  relative,  ///< value/reference - 1
  absolute,  ///< value - reference
  at_most,   ///< the value itself, e.g. the spread between meshes
};

enum class Verdict {
  met,     ///< within the target
  missed,  ///< there is a value, outside of the target
  failed,  ///< there is no value: a program refused, or what the test needs is not there
};

/// One figure of one test.
struct Row {
  std::string test, subject, model, mesh, quantity, unit;
  std::optional<double> reference, value;
  Measure measure = Measure::relative;
  double target = 0;
  std::string note;         ///< why a target is missed, what was special
  bool converged = true;    ///< a value of a run that did not come to rest misses its target

  std::optional<double> error() const;
  Verdict verdict() const;
};

/// A curve against its reference.
struct Curve {
  std::string name;
  std::vector<double> x, y;
  bool reference = false;   ///< drawn as a line; the others as marks
};
struct Plot {
  std::string name, title, x_label, y_label;
  bool log_x = false, log_y = false;
  std::vector<Curve> curves;
};

/// What one test came to.
struct Section {
  std::string test, title, about;   ///< about: set-up and sources, Markdown
  std::vector<Row> rows;
  std::vector<Plot> plots;
};

struct Report {
  bool quick = false;
  std::vector<Section> sections;
  std::vector<Row> rows() const;
};

/// "0.12461, reference 0.12456, error +0.04 %, target 1 %"
std::string figures(const Row& row);
/// Columns of equal width for a terminal.
std::string text_table(const std::vector<Row>& rows);
/// {"quick", "counts", "rows": [...]}
std::string to_json(const Report& report);
/// A page with all rows. plots  folder of the SVG files, relative to the page.
std::string to_markdown(const Report& report, const std::string& plots);
/// name,x,y per line
std::string to_csv(const Plot& plot);
/// Lines for references, marks for measured curves.
std::string to_svg(const Plot& plot);

const char* to_text(Verdict verdict);

}  // namespace toile::lab
