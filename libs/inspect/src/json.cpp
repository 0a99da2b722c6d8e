#include "toile/inspect/json.h"

#include "toile/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toile::inspect {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) out += fmt::format("\\u{:04x}", static_cast<int>(c));
    else out += c;
  }
  return out + '"';
}

}  // namespace

Json::Json(double value) : text_(std::isfinite(value) ? format_number(value) : "null") {}
Json::Json(const std::string& value) : text_(quoted(value)) {}

Json& Json::set(const std::string& key, Json value) {
  items_.emplace_back(key, std::move(value));
  return *this;
}

Json& Json::push(Json value) {
  items_.emplace_back(std::string(), std::move(value));
  return *this;
}

std::string Json::dump(int depth) const {
  std::string out;
  write(out, depth, 0);
  return out + '\n';
}

void Json::write(std::string& out, int depth, int level) const {
  if (kind_ == Kind::scalar) {
    out += text_;
    return;
  }
  // A handful of plain values reads best on one line.
  const bool plain = level > 0 && std::all_of(items_.begin(), items_.end(), [](const auto& item) { return item.second.kind_ == Kind::scalar; });
  const bool lines = level < depth && !items_.empty() && !plain;
  out += kind_ == Kind::object ? '{' : '[';
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (i > 0) out += lines ? "," : ", ";
    if (lines) out += '\n' + std::string(static_cast<std::size_t>(2 * (level + 1)), ' ');
    if (kind_ == Kind::object) out += quoted(items_[i].first) + ": ";
    items_[i].second.write(out, depth, level + 1);
  }
  if (lines) out += '\n' + std::string(static_cast<std::size_t>(2 * level), ' ');
  out += kind_ == Kind::object ? '}' : ']';
}

}  // namespace toile::inspect
