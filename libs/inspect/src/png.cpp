#include "toile/inspect/image.h"

#if TOILE_HAS_PNG
#include <png.h>

#endif

namespace toile::inspect {

#if TOILE_HAS_PNG

bool png_available() { return true; }

namespace {
Issue bad_png(const std::string& name, const std::string& what) {
  return Issue{"bad_png", {.file = name}, what, "make the picture again"};
}
}  // namespace

Result<std::string> encode_png(const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0) return bad_png("", header.message);
  bytes.resize(size);
  return bytes;
}

Result<Image> decode_png(std::string_view bytes, const std::string& name) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) return bad_png(name, header.message);
  header.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(header.width), static_cast<int>(header.height));
  if (png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr) == 0) {
    png_image_free(&header);
    return bad_png(name, header.message);
  }
  return image;
}

#else

bool png_available() { return false; }

namespace {
Issue not_built() {
  return Issue{"not_built", {}, "this build cannot read or write PNG files", "install libpng-dev, configure and build again"};
}
}  // namespace
Result<std::string> encode_png(const Image&) { return not_built(); }
Result<Image> decode_png(std::string_view, const std::string&) { return not_built(); }

#endif

}  // namespace toile::inspect
