// PLY as a container: elements of named columns, nothing of what they mean.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "toile/base/result.h"
#include "toile/io/ply.h"

namespace toile::io::ply {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
bool is_real(Type type);

struct Property {
  std::string name;
  Type type = Type::float64;
  bool list = false;         ///< of triples: the only lists of a triangle mesh
  Type count_type = Type::uint8;
  std::vector<double> reals;  ///< one a row, if the type is real
  std::vector<int> integers;  ///< one a row, or three if a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
  const Property* find(std::string_view name) const;
};

struct Document {
  std::vector<std::string> comments;  ///< without the word "comment"
  std::vector<Element> elements;
  const Element* find(std::string_view name) const;
};

/// error  Issue "bad_ply" with the file, the header's line or the element's row
Result<Document> parse(std::string_view bytes, const std::string& file);
std::string format(const Document& document, Encoding encoding);

/// The comments that begin with "| ", joined: the YAML metadata.
std::string metadata(const Document& document);
void add_metadata(Document& document, const std::string& yaml);

/// Columns to write.
Property real_column(std::string name, std::vector<double> values);
Property integer_column(std::string name, std::vector<int> values);

/// Reads columns of one element by name and remembers which were asked for.
class Columns {
 public:
  Columns(const Document& document, std::string file, std::string element, Issues& issues);
  std::size_t rows() const { return element_ ? element_->count : 0; }
  std::vector<double> reals(const std::string& name);
  std::vector<int> integers(const std::string& name);
  std::vector<int> triples(const std::string& name);
  /// Columns nobody asked for.
  std::vector<const Property*> rest() const;

 private:
  const Property* require(const std::string& name);
  const Element* element_;
  std::string file_, name_;
  std::vector<std::string> asked_;
  Issues& issues_;
};

}  // namespace toile::io::ply
