#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/io/image/image_file.hpp"

/// PNG and JPEG codecs of image_file.cpp: libpng, libdeflate and turbojpeg behind plain functions.
namespace hm::detail {

/// Largest number of pixels of an image that is read.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

inline constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
/// Deflate compresses at most so much: a short file cannot hold a huge image, for which no memory is asked.
inline constexpr std::size_t kMostDeflateRatio = 1032;

/// Checks an image size against the limits of this program.
Result<void> check_image_size(std::int64_t width, std::int64_t height, const std::string& where);

Result<ImageSize> png_size(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<Rgb8>> decode_png_color(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<std::uint16_t>> decode_png_gray16(std::span<const std::uint8_t> bytes, const std::string& where);

/// The same for what recordings consist of, 8-bit RGB or 16-bit gray that is not interlaced, in 0.4 to 0.7 of
/// libpng's time (the W3C's PNG specification, whose sections are named beside the code). Nothing where an
/// image is of another kind or damaged in any way: then libpng reads it, or says what is wrong.
std::optional<Image<Rgb8>> decode_plain_png_color(std::span<const std::uint8_t> bytes);
std::optional<Image<std::uint16_t>> decode_plain_png_gray16(std::span<const std::uint8_t> bytes);
/// Encodes with the simplest filters, in 0.6 of libpng's time. The image must not be empty.
std::vector<std::uint8_t> encode_plain_png(const Image<Rgb8>& image, PngEffort effort);
std::vector<std::uint8_t> encode_plain_png(const Image<std::uint16_t>& image, PngEffort effort);

bool is_pgm(std::span<const std::uint8_t> bytes);
Result<ImageSize> pgm_size(std::span<const std::uint8_t> bytes, const std::string& where);

Result<ImageSize> jpeg_size(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<Rgb8>> decode_jpeg(std::span<const std::uint8_t> bytes, const std::string& where);

}  // namespace hm::detail
