// Numbers and arrays to bytes and back, bit by bit, in one description of both ways.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace toile::dynamics {

/// Writing: bytes() grows. Reading: values come from the given bytes; what is too short or too long leaves good() false.
class Archive {
 public:
  Archive() = default;
  explicit Archive(std::string_view bytes) : from_(bytes), reading_(true) {}

  bool reading() const { return reading_; }
  bool good() const { return good_; }
  bool at_end() const { return from_.empty(); }
  const std::string& bytes() const { return bytes_; }

  template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void operator()(T& value) {
    raw(&value, sizeof(T));
  }
  void operator()(std::string& text) {
    const std::size_t n = count(text.size(), 1);
    if (reading_) text.assign(n, '\0');
    raw(text.data(), n);
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    const std::size_t n = count(values.size(), 1);
    if (reading_) values.assign(good_ ? n : 0, T{});
    for (T& value : values) (*this)(value);
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& value : values) (*this)(value);
  }
  template <class T, int Rows, int Columns, int Options>
  void operator()(Eigen::Matrix<T, Rows, Columns, Options>& matrix) {
    std::int64_t rows = matrix.rows(), columns = matrix.cols();
    raw(&rows, sizeof rows);
    raw(&columns, sizeof columns);
    if (reading_) {
      const bool fits = good_ && rows >= 0 && columns >= 0 && (Rows == Eigen::Dynamic || rows == Rows) && (Columns == Eigen::Dynamic || columns == Columns) &&
                        static_cast<std::uint64_t>(rows) <= from_.size() / sizeof(T) && static_cast<std::uint64_t>(columns) <= from_.size() / sizeof(T) &&
                        static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns) <= from_.size() / sizeof(T);
      if (!fits) {
        good_ = false;
        return;
      }
      matrix.resize(rows, columns);
    }
    raw(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(T));
  }

 private:
  /// Length of what follows; no more than can be there.
  std::size_t count(std::size_t size, std::size_t least) {
    std::uint64_t n = size;
    raw(&n, sizeof n);
    if (reading_ && n > from_.size() / least) {
      good_ = false;
      return 0;
    }
    return static_cast<std::size_t>(n);
  }
  void raw(void* data, std::size_t size) {
    if (!reading_) {
      bytes_.append(static_cast<const char*>(data), size);
      return;
    }
    if (!good_ || size > from_.size()) {
      good_ = false;
      return;
    }
    if (size > 0) std::memcpy(data, from_.data(), size);
    from_.remove_prefix(size);
  }

  std::string bytes_;
  std::string_view from_;
  bool reading_ = false, good_ = true;
};

}  // namespace toile::dynamics
