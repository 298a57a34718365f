#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>

#include "hm/io/image/image_codec.hpp"

namespace hm::detail {
namespace {

/// libpng reader over bytes in memory. libpng reports errors by longjmp: all calls are made in the members
/// below that set the jump, which own no objects with destructors.
class PngReader {
 public:
  explicit PngReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool read_header();
  /// Requests 8-bit RGB rows, or 16-bit gray rows in the machine's byte order.
  bool expect_rgb8();
  bool expect_gray16();
  /// Decodes all rows and the rest of the file.
  bool read_rows(png_bytep* rows);

  std::uint32_t width = 0, height = 0;
  int bit_depth = 0, color_type = 0;
  std::size_t row_bytes = 0;

  [[nodiscard]] tl::unexpected<Error> error(const std::string& where) const {
    if (truncated_)
      return fail(ErrorCode::kTruncated, where, "the PNG ends too early, at byte {}", bytes_.size());
    return fail(ErrorCode::kCorrupted, where, "not a valid PNG: {} (near byte {})", message_, offset_);
  }

 private:
  static void on_error(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngReader*>(png_get_error_ptr(png));
    std::strncpy(self->message_, message, sizeof(self->message_) - 1);
    std::longjmp(self->jump_, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}
  static void on_read(png_structp png, png_bytep out, std::size_t count) {
    auto* self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (count > self->bytes_.size() - self->offset_) {
      self->truncated_ = true;
      png_error(png, "ends too early");
    }
    std::memcpy(out, self->bytes_.data() + self->offset_, count);
    self->offset_ += count;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t offset_ = 0;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf jump_;
  bool truncated_ = false;
  char message_[128] = "out of memory";
};

bool PngReader::read_header() {
  if (info_ == nullptr || setjmp(jump_) != 0) return false;
  png_set_read_fn(png_, this, on_read);
  png_set_user_limits(png_, kMaxImageEdge_px, kMaxImageEdge_px);
  png_set_chunk_malloc_max(png_, png_alloc_size_t{8} << 20);
  png_read_info(png_, info_);
  int interlace = 0, compression = 0, filter = 0;
  png_get_IHDR(png_, info_, &width, &height, &bit_depth, &color_type, &interlace, &compression, &filter);
  return true;
}

bool PngReader::expect_rgb8() {
  if (setjmp(jump_) != 0) return false;
  png_set_expand(png_);
  png_set_scale_16(png_);
  png_set_gray_to_rgb(png_);
  png_set_strip_alpha(png_);
  png_set_interlace_handling(png_);
  png_read_update_info(png_, info_);
  row_bytes = png_get_rowbytes(png_, info_);
  return true;
}

bool PngReader::expect_gray16() {
  if (setjmp(jump_) != 0) return false;
  png_set_swap(png_);
  png_set_interlace_handling(png_);
  png_read_update_info(png_, info_);
  row_bytes = png_get_rowbytes(png_, info_);
  return true;
}

bool PngReader::read_rows(png_bytep* rows) {
  if (setjmp(jump_) != 0) return false;
  png_read_image(png_, rows);
  png_read_end(png_, nullptr);
  return true;
}

/// Rejects a short file with a huge image size before memory is allocated for it.
Result<void> check_plausible(const PngReader& reader, std::size_t file_bytes, const std::string& where) {
  if (auto size = check_image_size(reader.width, reader.height, where); !size) return size;
  if (reader.row_bytes / 16 * reader.height / kMostDeflateRatio > file_bytes)
    return fail(ErrorCode::kTruncated, where, "{} bytes cannot hold an image of {} x {}", file_bytes,
                reader.width, reader.height);
  return {};
}

template <class T>
Result<Image<T>> decode_rows(PngReader& reader, const std::string& where) {
  Image<T> image(static_cast<int>(reader.width), static_cast<int>(reader.height));
  if (reader.row_bytes != image.row(0).size_bytes())
    return fail(ErrorCode::kInternal, where, "libpng gives rows of {} bytes", reader.row_bytes);
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(reinterpret_cast<png_bytep>(image.row(y).data()));
  if (!reader.read_rows(rows.data())) return reader.error(where);
  return image;
}

}  // namespace

Result<void> check_image_size(std::int64_t width, std::int64_t height, const std::string& where) {
  if (width < 1 || height < 1 || width > kMaxImageEdge_px || height > kMaxImageEdge_px ||
      width * height > kMaxImagePixels)
    return fail(ErrorCode::kUnsupported, where,
                "an image of {} x {} is not read (at most {} an edge, {} in all)", width, height,
                kMaxImageEdge_px, kMaxImagePixels);
  return {};
}

Result<ImageSize> png_size(std::span<const std::uint8_t> bytes, const std::string& where) {
  PngReader reader(bytes);
  if (!reader.read_header()) return reader.error(where);
  return ImageSize{static_cast<int>(reader.width), static_cast<int>(reader.height)};
}

Result<Image<Rgb8>> decode_png_color(std::span<const std::uint8_t> bytes, const std::string& where) {
  PngReader reader(bytes);
  if (!reader.read_header() || !reader.expect_rgb8()) return reader.error(where);
  if (auto fits = check_plausible(reader, bytes.size(), where); !fits) return forward_error(fits);
  return decode_rows<Rgb8>(reader, where);
}

Result<Image<std::uint16_t>> decode_png_gray16(std::span<const std::uint8_t> bytes,
                                               const std::string& where) {
  PngReader reader(bytes);
  if (!reader.read_header()) return reader.error(where);
  if (reader.color_type != PNG_COLOR_TYPE_GRAY || reader.bit_depth != 16)
    return fail(ErrorCode::kUnsupported, where, "a depth image must be 16-bit gray; this is {}-bit {}",
                reader.bit_depth, (reader.color_type & PNG_COLOR_MASK_COLOR) != 0 ? "colour" : "gray");
  if (!reader.expect_gray16()) return reader.error(where);
  if (auto fits = check_plausible(reader, bytes.size(), where); !fits) return forward_error(fits);
  return decode_rows<std::uint16_t>(reader, where);
}

}  // namespace hm::detail
