#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// The largest edge of a picture that is read; a header that claims more is an error, so that a corrupted
/// file cannot ask for all memory.
inline constexpr int kMaxPictureEdge_px = 16384;

/// zlib effort for PNG files: 1 is fast and about a tenth larger, 9 small and many times slower.
enum class PngEffort : int { kFast = 1, kDefault = 6, kSmall = 9 };

/// Width and height of a picture.
struct PictureSize {
  int width = 0;
  int height = 0;
  bool operator==(const PictureSize&) const = default;
};

/// Size of a PNG or JPEG from its header, without decoding it.
Result<PictureSize> read_picture_size(const std::filesystem::path& path);

/// A PNG (any bit depth, palette, gray; alpha is dropped) or JPEG file as 8-bit colour, chosen by its first
/// bytes, whatever its name. Errors name the file, and the reason or the byte where it ends.
Result<Image<Rgb8>> read_color_image(const std::filesystem::path& path);
/// A depth picture: a 16-bit gray PNG, in the file's own units. 8-bit or colour pictures are an error.
Result<Image<std::uint16_t>> read_depth_png(const std::filesystem::path& path);
/// A depth picture of a sensor: the same, or a binary PGM of 16 bits (raw pictures of the first Kinect);
/// 65535 (7-Scenes' mark of no reading) becomes 0, as DepthImage wants it. What every reader of depth uses.
Result<Image<std::uint16_t>> read_depth_picture(const std::filesystem::path& path);

/// Decodes an image file that is in memory; `where` names it in errors.
Result<Image<Rgb8>> decode_color_image(std::span<const std::uint8_t> bytes, const std::string& where);
Result<Image<std::uint16_t>> decode_depth_png(std::span<const std::uint8_t> bytes, const std::string& where);
/// Binary PGM (P5) with a largest value above 255: two bytes a pixel, the high one first (netpbm). One of 8
/// bits is an error.
Result<Image<std::uint16_t>> decode_depth_pgm(std::span<const std::uint8_t> bytes, const std::string& where);

/// Writes a PNG file (8-bit RGB, 16-bit gray); an error when the image is empty or the disk refuses.
Result<void> write_png(const std::filesystem::path& path, const Image<Rgb8>& image,
                       PngEffort effort = PngEffort::kDefault);
Result<void> write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image,
                       PngEffort effort = PngEffort::kDefault);

/// The bytes of a PNG or JPEG file, e.g. to embed into HTML. The image must not be empty; `quality` is
/// libjpeg's, 1 to 100.
std::vector<std::uint8_t> encode_png(const Image<Rgb8>& image, PngEffort effort = PngEffort::kDefault);
std::vector<std::uint8_t> encode_png(const Image<std::uint16_t>& image,
                                     PngEffort effort = PngEffort::kDefault);
std::vector<std::uint8_t> encode_jpeg(const Image<Rgb8>& image, int quality = 85);

}  // namespace hm
