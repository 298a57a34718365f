#include <png.h>
#include <zlib.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <new>

#include "hm/core/check.hpp"
#include "hm/io/image/image_codec.hpp"

namespace hm {
namespace {

/// Image data to be written: rows of `row_bytes` bytes.
struct PngSource {
  const std::uint8_t* pixels;
  std::size_t row_bytes;
  int width, height, bit_depth, color_type;
};

/// libpng writer into memory; see PngReader for error handling.
class PngWriter {
 public:
  PngWriter() {
    png_ =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, this, on_error, [](png_structp, png_const_charp) {});
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  bool write(const PngSource& source, PngEffort effort);

  std::vector<std::uint8_t> bytes;
  char message[128] = "out of memory";

 private:
  static void on_error(png_structp png, png_const_charp text) {
    auto* self = static_cast<PngWriter*>(png_get_error_ptr(png));
    std::strncpy(self->message, text, sizeof(self->message) - 1);
    std::longjmp(self->jump_, 1);
  }
  static void on_write(png_structp png, png_bytep data, std::size_t count) {
    auto* self = static_cast<PngWriter*>(png_get_io_ptr(png));
    bool stored = true;
    try {
      self->bytes.insert(self->bytes.end(), data, data + count);
    } catch (const std::bad_alloc&) {
      stored = false;
    }
    if (!stored) png_error(png, "out of memory");
  }

  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf jump_;
};

bool PngWriter::write(const PngSource& source, PngEffort effort) {
  if (info_ == nullptr || setjmp(jump_) != 0) return false;
  png_set_write_fn(png_, this, on_write, nullptr);
  png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_compression_level(png_, static_cast<int>(effort));
  png_set_IHDR(png_, info_, static_cast<png_uint_32>(source.width), static_cast<png_uint_32>(source.height),
               source.bit_depth, source.color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png_, info_);
  if (source.bit_depth == 16 && std::endian::native == std::endian::little) png_set_swap(png_);
  for (int y = 0; y < source.height; ++y)
    png_write_row(png_, source.pixels + static_cast<std::size_t>(y) * source.row_bytes);
  png_write_end(png_, info_);
  return true;
}

std::vector<std::uint8_t> encode(const PngSource& source, PngEffort effort) {
  PngWriter writer;
  writer.bytes.reserve(source.row_bytes * static_cast<std::size_t>(source.height) / 2 + 1024);
  HM_CHECK(writer.write(source, effort), "libpng: {}", writer.message);
  return std::move(writer.bytes);
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Image<Rgb8>& image, PngEffort effort) {
  HM_CHECK(!image.empty());
  if (effort <= PngEffort::kFast) return detail::encode_plain_png(image, effort);
  return encode({reinterpret_cast<const std::uint8_t*>(image.data()), image.row(0).size_bytes(),
                 image.width(), image.height(), 8, PNG_COLOR_TYPE_RGB},
                effort);
}

std::vector<std::uint8_t> encode_png(const Image<std::uint16_t>& image, PngEffort effort) {
  HM_CHECK(!image.empty());
  if (effort <= PngEffort::kFast) return detail::encode_plain_png(image, effort);
  return encode({reinterpret_cast<const std::uint8_t*>(image.data()), image.row(0).size_bytes(),
                 image.width(), image.height(), 16, PNG_COLOR_TYPE_GRAY},
                effort);
}

}  // namespace hm
