#include "hm/io/image/image_file.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/image/image_codec.hpp"

namespace hm {
namespace {

enum class ImageFormat { kEmpty, kPng, kJpeg, kOther };

ImageFormat format_of(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  if (bytes.empty()) return ImageFormat::kEmpty;
  const auto starts_with = [&](std::span<const std::uint8_t> magic) {
    return std::ranges::equal(bytes.first(std::min(bytes.size(), magic.size())),
                              magic.first(std::min(bytes.size(), magic.size())));
  };
  if (starts_with(detail::kPngSignature)) return ImageFormat::kPng;
  if (starts_with(kJpeg)) return ImageFormat::kJpeg;
  return ImageFormat::kOther;
}

tl::unexpected<Error> no_image(ImageFormat format, const std::string& where) {
  if (format == ImageFormat::kEmpty)
    return fail(ErrorCode::kTruncated, where, "the image is empty (0 bytes)");
  return fail(ErrorCode::kUnsupported, where, "neither a PNG nor a JPEG (by its first bytes)");
}

}  // namespace

Result<Image<Rgb8>> decode_color_image(std::span<const std::uint8_t> bytes, const std::string& where) {
  const ImageFormat format = format_of(bytes);
  if (format == ImageFormat::kPng) {
    if (auto plain = detail::decode_plain_png_color(bytes)) return std::move(*plain);
    return detail::decode_png_color(bytes, where);
  }
  if (format == ImageFormat::kJpeg) return detail::decode_jpeg(bytes, where);
  return no_image(format, where);
}

Result<Image<std::uint16_t>> decode_depth_png(std::span<const std::uint8_t> bytes, const std::string& where) {
  const ImageFormat format = format_of(bytes);
  if (format == ImageFormat::kPng) {
    if (auto plain = detail::decode_plain_png_gray16(bytes)) return std::move(*plain);
    return detail::decode_png_gray16(bytes, where);
  }
  if (format == ImageFormat::kJpeg)
    return fail(ErrorCode::kUnsupported, where, "a depth image must be a 16-bit gray PNG; this is a JPEG");
  return no_image(format, where);
}

Result<ImageSize> read_image_size(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  if (detail::is_pgm(*bytes)) return detail::pgm_size(*bytes, path);
  const ImageFormat format = format_of(*bytes);
  if (format == ImageFormat::kPng) return detail::png_size(*bytes, path);
  if (format == ImageFormat::kJpeg) return detail::jpeg_size(*bytes, path);
  return no_image(format, path);
}

Result<Image<Rgb8>> read_color_image(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  return decode_color_image(*bytes, path);
}

Result<Image<std::uint16_t>> read_depth_png(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  return decode_depth_png(*bytes, path);
}

Result<Image<std::uint16_t>> read_depth_image(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  auto depth = detail::is_pgm(*bytes) ? decode_depth_pgm(*bytes, path) : decode_depth_png(*bytes, path);
  if (depth) std::ranges::replace(depth->pixels(), std::uint16_t{65535}, std::uint16_t{0});
  return depth;
}

Result<void> write_png(const std::filesystem::path& path, const Image<Rgb8>& image, PngEffort effort) {
  if (image.empty()) return fail(ErrorCode::kInvalidValue, path, "an empty image cannot be written");
  return write_file_bytes(path, encode_png(image, effort));
}

Result<void> write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image,
                       PngEffort effort) {
  if (image.empty()) return fail(ErrorCode::kInvalidValue, path, "an empty image cannot be written");
  return write_file_bytes(path, encode_png(image, effort));
}

}  // namespace hm
