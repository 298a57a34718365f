#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// Largest width or height of an image that is read; larger ones are an error, so that a corrupted header
/// cannot exhaust memory.
inline constexpr int kMaxImageEdge_px = 16384;

/// zlib compression level for PNG files: 0 only stores, 1 is fast and about 10 % larger than 6, 9 is smallest
/// and many times slower.
enum class PngEffort : int { kStored = 0, kFast = 1, kDefault = 6, kSmall = 9 };

/// Width and height of an image in pixels.
struct ImageSize {
  int width = 0;
  int height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Size of a PNG, JPEG or binary PGM from its header, without decoding it.
Result<ImageSize> read_image_size(const std::filesystem::path& path);

/// Reads a PNG (any bit depth, palette, gray; alpha is dropped) or JPEG file as 8-bit colour. The format is
/// recognised by its first bytes. Errors name the file and the reason, or the byte where it is truncated.
Result<Image<Rgb8>> read_color_image(const std::filesystem::path& path);
/// Reads a depth image, a 16-bit gray PNG, in the file's own units. 8-bit or colour images are an error.
Result<Image<std::uint16_t>> read_depth_png(const std::filesystem::path& path);
/// Reads a depth image of a sensor: a 16-bit gray PNG, or a 16-bit binary PGM (raw images of the first
/// Kinect); 65535 (the 7-Scenes marker of no reading) becomes 0, as DepthImage requires. Used by all readers
/// of depth.
Result<Image<std::uint16_t>> read_depth_image(const std::filesystem::path& path);

/// The same from bytes in memory; `where` names the source in errors.
Result<Image<Rgb8>> decode_color_image(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<std::uint16_t>> decode_depth_png(std::span<const std::uint8_t> bytes, const std::string& where);
/// Decodes a binary PGM (P5) with a maximum value above 255: two bytes per pixel, big endian (netpbm). An
/// 8-bit PGM is an error.
Result<Image<std::uint16_t>> decode_depth_pgm(std::span<const std::uint8_t> bytes, const std::string& where);

/// Writes a PNG file (8-bit RGB, 16-bit gray); error when the image is empty or the file cannot be written.
Result<void> write_png(const std::filesystem::path& path, const Image<Rgb8>& image,
                       PngEffort effort = PngEffort::kDefault);
Result<void> write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image,
                       PngEffort effort = PngEffort::kDefault);

/// Encodes a PNG or JPEG file in memory, e.g. to embed it into HTML. The image must not be empty; `quality`
/// is libjpeg's, 1 to 100.
std::vector<std::uint8_t> encode_png(const Image<Rgb8>& image, PngEffort effort = PngEffort::kDefault);
std::vector<std::uint8_t> encode_png(const Image<std::uint16_t>& image,
                                     PngEffort effort = PngEffort::kDefault);
std::vector<std::uint8_t> encode_jpeg(const Image<Rgb8>& image, int quality = 85);

}  // namespace hm
