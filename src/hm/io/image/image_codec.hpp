#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hm/io/image/image_file.hpp"

/// PNG and JPEG codecs of image_file.cpp: libpng and turbojpeg behind plain functions.
namespace hm::detail {

/// Largest number of pixels of an image that is read.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

/// Checks an image size against the limits of this program.
Result<void> check_image_size(std::int64_t width, std::int64_t height, const std::string& where);

Result<ImageSize> png_size(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<Rgb8>> decode_png_color(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<std::uint16_t>> decode_png_gray16(std::span<const std::uint8_t> bytes, const std::string& where);

bool is_pgm(std::span<const std::uint8_t> bytes);
Result<ImageSize> pgm_size(std::span<const std::uint8_t> bytes, const std::string& where);

Result<ImageSize> jpeg_size(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<Rgb8>> decode_jpeg(std::span<const std::uint8_t> bytes, const std::string& where);

}  // namespace hm::detail
