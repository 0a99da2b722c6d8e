#include "ply_format.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "toile/base/text.h"

static_assert(std::endian::native == std::endian::little, "binary PLY is read and written as little-endian");

namespace toile::io::ply {
namespace {

struct TypeName {
  Type type;
  const char* name;
  const char* alias;
  std::size_t size;
};
constexpr TypeName types[] = {
    {Type::int8, "char", "int8", 1},   {Type::uint8, "uchar", "uint8", 1},     {Type::int16, "short", "int16", 2},    {Type::uint16, "ushort", "uint16", 2},
    {Type::int32, "int", "int32", 4},  {Type::uint32, "uint", "uint32", 4},    {Type::float32, "float", "float32", 4}, {Type::float64, "double", "float64", 8},
};
const TypeName& info(Type type) { return types[static_cast<std::size_t>(type)]; }

std::optional<Type> type_of(std::string_view name) {
  for (const TypeName& type : types) {
    if (name == type.name || name == type.alias) return type.type;
  }
  return std::nullopt;
}

template <class T>
T load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

double load_real(const char* bytes, Type type) { return type == Type::float32 ? load<float>(bytes) : load<double>(bytes); }

/// As a wide integer, so that an unsigned value too large for an id is seen as such.
long long load_integer(const char* bytes, Type type) {
  switch (type) {
    case Type::int8: return load<std::int8_t>(bytes);
    case Type::uint8: return load<std::uint8_t>(bytes);
    case Type::int16: return load<std::int16_t>(bytes);
    case Type::uint16: return load<std::uint16_t>(bytes);
    case Type::int32: return load<std::int32_t>(bytes);
    case Type::uint32: return load<std::uint32_t>(bytes);
    case Type::float32:
    case Type::float64: break;
  }
  return 0;
}

struct Header {
  Document document;
  bool ascii = true;
  std::size_t body = 0;  ///< offset of the first byte after the header
};

Result<Header> parse_header(std::string_view bytes, const std::string& file) {
  Header header;
  std::size_t position = 0;
  int line_number = 0;
  bool format_seen = false;
  const auto bad = [&](std::string what, std::string remedy = "make the file again with the program that wrote it") {
    return Issue{"bad_ply", {.file = file, .line = line_number}, std::move(what), std::move(remedy)};
  };
  while (true) {
    const std::size_t end = bytes.find('\n', position);
    ++line_number;
    if (end == std::string_view::npos) return bad(line_number == 1 ? "this is not a PLY file" : "the header does not end with end_header");
    std::string_view line = bytes.substr(position, end - position);
    position = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line_number == 1) {
      if (line != "ply") return bad("this is not a PLY file", "give a .ply file that a toile program wrote");
      continue;
    }
    if (line == "end_header") break;
    if (line.starts_with("comment ")) {
      header.document.comments.emplace_back(line.substr(8));
      continue;
    }
    if (line == "comment" || line.starts_with("obj_info")) continue;
    std::vector<std::string> words;
    for (const std::string& word : split(line, ' ')) {
      if (!word.empty()) words.push_back(word);
    }
    if (words.size() == 3 && words[0] == "format") {
      if (words[1] != "ascii" && words[1] != "binary_little_endian") return bad(fmt::format("the encoding '{}' is not read", words[1]), "write it as ascii or binary_little_endian");
      header.ascii = words[1] == "ascii";
      format_seen = true;
    } else if (words.size() == 3 && words[0] == "element") {
      const auto count = parse_integer(words[2]);
      // No row is shorter than one byte, so a larger count cannot be true and must not be allocated.
      if (!count || *count < 0 || static_cast<std::size_t>(*count) > bytes.size()) return bad(fmt::format("the count of element '{}' is {}, which cannot be", words[1], words[2]));
      header.document.elements.push_back({words[1], static_cast<std::size_t>(*count), {}});
    } else if (words.size() >= 3 && words[0] == "property" && !header.document.elements.empty()) {
      Property property;
      const bool list = words[1] == "list";
      if (words.size() != (list ? 5u : 3u)) return bad(fmt::format("'{}' is not a property", line));
      const auto type = type_of(words[list ? 3 : 1]);
      const auto count_type = list ? type_of(words[2]) : std::optional(Type::uint8);
      if (!type || !count_type || (list && (is_real(*type) || is_real(*count_type)))) return bad(fmt::format("'{}' has an unknown type", line));
      property.name = words.back();
      property.type = *type;
      property.count_type = *count_type;
      property.list = list;
      if (header.document.elements.back().find(property.name)) return bad(fmt::format("the property '{}' stands twice", property.name));
      header.document.elements.back().properties.push_back(std::move(property));
    } else {
      return bad(fmt::format("'{}' is not understood", line));
    }
  }
  if (!format_seen) return bad("the header has no format line");
  header.body = position;
  return header;
}

/// Reads the tokens of an ASCII body.
class Tokens {
 public:
  Tokens(const char* begin, const char* end) : at_(begin), end_(end) {}
  void skip_space() {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\t' || *at_ == '\r')) ++at_;
  }
  template <class T>
  bool next(T& value) {
    skip_space();
    const auto result = std::from_chars(at_, end_, value);
    if (result.ec != std::errc{}) return false;
    if (result.ptr < end_ && *result.ptr != ' ' && *result.ptr != '\n' && *result.ptr != '\t' && *result.ptr != '\r') return false;
    at_ = result.ptr;
    return true;
  }
  bool done() {
    skip_space();
    return at_ == end_;
  }

 private:
  const char* at_;
  const char* end_;
};

/// Reads the values of a binary body; the same interface by type.
class Bytes {
 public:
  Bytes(const char* begin, const char* end) : at_(begin), end_(end) {}
  const char* take(std::size_t size) {
    if (static_cast<std::size_t>(end_ - at_) < size) return nullptr;
    return std::exchange(at_, at_ + size);
  }
  bool done() const { return at_ == end_; }

 private:
  const char* at_;
  const char* end_;
};

bool fits_id(long long value) { return value >= std::numeric_limits<int>::min() && value <= std::numeric_limits<int>::max(); }

}  // namespace

bool is_real(Type type) { return type == Type::float32 || type == Type::float64; }

const Property* Element::find(std::string_view wanted) const {
  for (const Property& property : properties) {
    if (property.name == wanted) return &property;
  }
  return nullptr;
}

const Element* Document::find(std::string_view wanted) const {
  for (const Element& element : elements) {
    if (element.name == wanted) return &element;
  }
  return nullptr;
}

Result<Document> parse(std::string_view bytes, const std::string& file) {
  TOILE_TRY(Header header, parse_header(bytes, file));
  const char* begin = bytes.data() + header.body;
  const char* end = bytes.data() + bytes.size();
  Tokens tokens(begin, end);
  Bytes raw(begin, end);
  for (Element& element : header.document.elements) {
    const auto bad = [&](std::size_t row, const std::string& property) {
      return Issue{"bad_ply", {.file = file, .item = fmt::format("element {}, row {}, {}", element.name, row, property)},
                   "the value is missing or is not a finite number of its type", "the file is cut short or damaged; make it again"};
    };
    for (Property& property : element.properties) {
      if (property.list) property.integers.reserve(element.count * 3);
      else if (is_real(property.type)) property.reals.reserve(element.count);
      else property.integers.reserve(element.count);
    }
    for (std::size_t row = 0; row < element.count; ++row) {
      for (Property& property : element.properties) {
        if (!property.list && is_real(property.type)) {
          double value = 0;
          if (header.ascii) {
            if (!tokens.next(value)) return bad(row, property.name);
          } else {
            const char* at = raw.take(info(property.type).size);
            if (!at) return bad(row, property.name);
            value = load_real(at, property.type);
          }
          if (!std::isfinite(value)) return bad(row, property.name);
          property.reals.push_back(value);
          continue;
        }
        const auto next_integer = [&](Type type, long long& value) {
          if (header.ascii) return tokens.next(value);
          const char* at = raw.take(info(type).size);
          if (at) value = load_integer(at, type);
          return at != nullptr;
        };
        long long count = 1;
        if (property.list) {
          if (!next_integer(property.count_type, count)) return bad(row, property.name);
          if (count != 3) {
            return Issue{"bad_ply", {.file = file, .item = fmt::format("element {}, row {}", element.name, row)},
                         fmt::format("a list of {} where three vertices are expected", count), "triangulate the faces first"};
          }
        }
        for (long long k = 0; k < count; ++k) {
          long long value = 0;
          if (!next_integer(property.type, value) || !fits_id(value)) return bad(row, property.name);
          property.integers.push_back(static_cast<int>(value));
        }
      }
    }
  }
  if (header.ascii ? !tokens.done() : !raw.done()) return Issue{"bad_ply", {.file = file}, "the file goes on after its last element", "the file is damaged; make it again"};
  return std::move(header.document);
}

std::string format(const Document& document, Encoding encoding) {
  std::string out = encoding == Encoding::ascii ? "ply\nformat ascii 1.0\n" : "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : document.comments) out += "comment " + comment + "\n";
  std::size_t body_size = 0;
  for (const Element& element : document.elements) {
    out += fmt::format("element {} {}\n", element.name, element.count);
    std::size_t row_size = 0;
    for (const Property& property : element.properties) {
      if (property.list) out += fmt::format("property list {} {} {}\n", info(property.count_type).name, info(property.type).name, property.name);
      else out += fmt::format("property {} {}\n", info(property.type).name, property.name);
      row_size += property.list ? 13 : 8;
    }
    body_size += element.count * row_size;
  }
  out += "end_header\n";
  out.reserve(out.size() + body_size * (encoding == Encoding::ascii ? 2 : 1));
  char buffer[32];
  for (const Element& element : document.elements) {
    for (std::size_t row = 0; row < element.count; ++row) {
      bool first = true;
      for (const Property& property : element.properties) {
        if (encoding == Encoding::ascii) {
          if (!first) out += ' ';
          first = false;
          const auto put = [&](auto value) { out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr); };
          if (property.list) {
            out += '3';
            for (std::size_t k = 0; k < 3; ++k) {
              out += ' ';
              put(property.integers[3 * row + k]);
            }
          } else if (is_real(property.type)) {
            put(property.reals[row]);
          } else {
            put(property.integers[row]);
          }
        } else {
          const auto put = [&](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
          if (property.list) {
            put(std::uint8_t{3});
            for (std::size_t k = 0; k < 3; ++k) put(property.integers[3 * row + k]);
          } else if (is_real(property.type)) {
            put(property.reals[row]);
          } else {
            put(property.integers[row]);
          }
        }
      }
      if (encoding == Encoding::ascii) out += '\n';
    }
  }
  return out;
}

std::string metadata(const Document& document) {
  std::string yaml;
  for (const std::string& comment : document.comments) {
    if (comment == "|") yaml += "\n";
    else if (comment.starts_with("| ")) yaml += comment.substr(2) + "\n";
  }
  return yaml;
}

void add_metadata(Document& document, const std::string& yaml) {
  for (const std::string& line : split(yaml, '\n')) {
    if (!line.empty()) document.comments.push_back("| " + line);
  }
}

Property real_column(std::string name, std::vector<double> values) {
  Property property;
  property.name = std::move(name);
  property.type = Type::float64;
  property.reals = std::move(values);
  return property;
}

Property integer_column(std::string name, std::vector<int> values) {
  Property property;
  property.name = std::move(name);
  property.type = Type::int32;
  property.integers = std::move(values);
  return property;
}

Columns::Columns(const Document& document, std::string file, std::string element, Issues& issues)
    : element_(document.find(element)), file_(std::move(file)), name_(std::move(element)), issues_(issues) {}

const Property* Columns::require(const std::string& name) {
  asked_.push_back(name);
  if (!element_) return nullptr;
  const Property* property = element_->find(name);
  if (!property) {
    issues_.push_back({"bad_ply", {.file = file_, .item = "element " + name_}, fmt::format("the column '{}' is missing", name), "make the file again with the stage before"});
  }
  return property;
}

std::vector<double> Columns::reals(const std::string& name) {
  const Property* property = require(name);
  if (!property) return std::vector<double>(rows());
  if (is_real(property->type)) return property->reals;
  return std::vector<double>(property->integers.begin(), property->integers.end());
}

std::vector<int> Columns::integers(const std::string& name) {
  const Property* property = require(name);
  if (property && !property->list && !is_real(property->type)) return property->integers;
  if (property) issues_.push_back({"bad_ply", {.file = file_, .item = "element " + name_}, fmt::format("the column '{}' is not of an integer type", name), "make the file again"});
  return std::vector<int>(rows());
}

std::vector<int> Columns::triples(const std::string& name) {
  const Property* property = require(name);
  if (property && property->list) return property->integers;
  if (property) issues_.push_back({"bad_ply", {.file = file_, .item = "element " + name_}, fmt::format("the column '{}' is not a list", name), "make the file again"});
  return std::vector<int>(rows() * 3);
}

std::vector<const Property*> Columns::rest() const {
  std::vector<const Property*> result;
  if (!element_) return result;
  for (const Property& property : element_->properties) {
    if (std::find(asked_.begin(), asked_.end(), property.name) == asked_.end()) result.push_back(&property);
  }
  return result;
}

}  // namespace toile::io::ply
