#include "toile/stage/stage.h"

#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "toile/base/text.h"
#include "toile/io/file.h"
#include "toile/io/ply.h"

namespace toile::stage {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

extern "C" void on_signal(int number) {
  interrupt_flag = 1;
  // A second signal ends the program at once.
  std::signal(number, SIG_DFL);
}

const char* category_name(Category category) {
  switch (category) {
    case Category::usage: return "usage";
    case Category::input: return "input";
    case Category::check: return "check";
    case Category::not_converged: return "not_converged";
    case Category::interrupted: return "interrupted";
  }
  return "";
}

}  // namespace

void catch_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

int exit_code(const Issues& issues) {
  int code = 0;
  for (const Issue& issue : issues) {
    int own = 0;
    switch (issue.category) {
      case Category::usage: own = 2; break;
      case Category::input: own = 3; break;
      case Category::check: own = 4; break;
      case Category::not_converged: own = 5; break;
      case Category::interrupted: own = 130; break;
    }
    // An interruption explains everything that is unfinished; otherwise the most basic trouble wins.
    if (own == 130) return 130;
    if (code == 0 || own < code) code = own;
  }
  return code;
}

std::string issues_json(const Issues& issues) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Issue& issue : issues) {
    nlohmann::ordered_json item{{"code", issue.code}, {"category", category_name(issue.category)}};
    if (!issue.place.file.empty()) item["file"] = issue.place.file;
    if (issue.place.line > 0) item["line"] = issue.place.line;
    if (issue.place.column > 0) item["column"] = issue.place.column;
    if (!issue.place.item.empty()) item["item"] = issue.place.item;
    item["what"] = issue.what;
    item["remedy"] = issue.remedy;
    list.push_back(std::move(item));
  }
  return list.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

bool Run::has(const std::string& port) const { return inputs_.count(port) > 0; }

const std::vector<std::string>& Run::paths(const std::string& port) const {
  static const std::vector<std::string> none;
  const auto it = inputs_.find(port);
  return it == inputs_.end() ? none : it->second;
}

const std::string& Run::path(const std::string& port) const {
  TOILE_CHECK(has(port), "input '{}' is not declared or not given", port);
  return paths(port).front();
}

Result<Fitting> Run::fitting(const std::string& garment_port) const {
  Result<mesh::GarmentMesh> garment_read = garment(garment_port);
  Issues issues = garment_read.issues();
  Fitting fitting;
  if (has("support")) {
    Result<mesh::SupportMesh> support_read = support("support");
    append(issues, support_read.issues());
    if (support_read) fitting.support = std::move(*support_read);
  }
  if (!issues.empty()) return issues;
  fitting.garment = std::move(*garment_read);
  return fitting;
}

Result<std::string> Run::bytes(const std::string& port, std::size_t index) const {
  TOILE_CHECK(index < paths(port).size(), "input '{}' has {} files", port, paths(port).size());
  return contents_.at(paths(port)[index]);
}

Result<mesh::GarmentMesh> Run::garment(const std::string& port) const { return io::parse_garment(contents_.at(path(port)), path(port)); }
Result<mesh::SupportMesh> Run::support(const std::string& port) const { return io::parse_support(contents_.at(path(port)), path(port)); }

void Run::report(const std::string& key, double value, const std::string& unit) {
  facts_.push_back({unit.empty() ? key : key + " [" + unit + "]", std::isfinite(value) ? format_number(value) : "null", fmt::format("{:.6g}{}{}", value, unit.empty() ? "" : " ", unit)});
}
void Run::report(const std::string& key, long long value) { facts_.push_back({key, fmt::format("{}", value), fmt::format("{}", value)}); }
void Run::report(const std::string& key, bool value) { facts_.push_back({key, value ? "true" : "false", value ? "yes" : "no"}); }
void Run::report(const std::string& key, const std::string& value) { facts_.push_back({key, nlohmann::json(value).dump(), value}); }

void Run::warn(const Issue& issue) {
  warnings_.push_back(issue);
  if (!json_) fmt::print(stderr, "warning: {}\n", to_string(issue));
}

void Run::progress(double fraction, const std::string& text) {
  if (quiet_) return;
  const bool terminal = ::isatty(2);
  const double step = terminal ? 0.005 : 0.1;
  if (last_progress_ >= 0 && fraction < 1 && fraction - last_progress_ < step) return;
  last_progress_ = fraction;
  if (terminal) fmt::print(stderr, "\r\033[K{:3.0f} % {}{}", 100 * fraction, text, fraction >= 1 ? "\n" : "");
  else fmt::print(stderr, "{:3.0f} % {}\n", 100 * fraction, text);
  std::fflush(stderr);
}

bool Run::interrupted() { return interrupt_flag != 0; }

}  // namespace toile::stage
