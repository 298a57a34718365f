#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

#include "hm/core/check.hpp"
#include "hm/io/image/image_codec.hpp"

namespace hm::detail {
namespace {

/// What a PNG's pixels are: bits a channel, and the colour type (11.2.1).
struct PngKind {
  std::uint8_t bit_depth, color_type;
  bool operator==(const PngKind&) const = default;
};
template <class Pixel>
constexpr PngKind kKindOf{};
template <>
constexpr PngKind kKindOf<Rgb8>{8, 2};
template <>
constexpr PngKind kKindOf<std::uint16_t>{16, 0};
constexpr std::array<std::uint8_t, 3> kMethods{0, 0, 0};  ///< deflate, the five filters, rows in order

std::uint16_t swap_bytes(std::uint16_t value) {
  return static_cast<std::uint16_t>(value << 8U | value >> 8U);
}
/// Changes a pixel's channels from the machine's byte order into the file's, or back.
Rgb8 to_big_endian(const Rgb8& pixel) { return pixel; }
std::uint16_t to_big_endian(std::uint16_t pixel) {
  return std::endian::native == std::endian::little ? swap_bytes(pixel) : pixel;
}

std::uint32_t big_endian_u32(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24U | std::uint32_t{bytes[1]} << 16U | std::uint32_t{bytes[2]} << 8U |
         std::uint32_t{bytes[3]};
}

constexpr std::uint32_t chunk_type(const char (&name)[5]) {
  std::uint32_t type = 0;
  for (int i = 0; i < 4; ++i) type = type << 8U | static_cast<std::uint8_t>(name[i]);
  return type;
}

struct PngChunk {
  std::uint32_t type = 0;
  std::span<const std::uint8_t> data;
};

/// Takes the next chunk off `bytes` (5.3). Nothing where it does not fit in or its checksum is wrong.
std::optional<PngChunk> take_chunk(std::span<const std::uint8_t>& bytes) {
  constexpr std::size_t kAround = 12;  // length, type, checksum
  if (bytes.size() < kAround) return std::nullopt;
  const std::size_t length = big_endian_u32(bytes.data());
  if (length > bytes.size() - kAround) return std::nullopt;
  const std::uint32_t checksum = big_endian_u32(bytes.data() + 8 + length);
  if (libdeflate_crc32(0, bytes.data() + 4, 4 + length) != checksum) return std::nullopt;
  const PngChunk chunk{big_endian_u32(bytes.data() + 4), bytes.subspan(8, length)};
  bytes = bytes.subspan(kAround + length);
  return chunk;
}

struct PngContent {
  ImageSize size;
  std::vector<std::uint8_t> compressed;
};

/// Size and compressed rows of a whole PNG of this kind that is not interlaced. Chunks without which it can
/// be shown are skipped.
std::optional<PngContent> read_content(std::span<const std::uint8_t> bytes, PngKind kind) {
  constexpr std::size_t kHeader = 13;
  constexpr std::uint32_t kCanBeSkipped = 0x20000000;  // a small first letter (5.4)
  if (bytes.size() < kPngSignature.size() ||
      !std::ranges::equal(bytes.first(kPngSignature.size()), kPngSignature))
    return std::nullopt;
  auto rest = bytes.subspan(kPngSignature.size());
  const auto header = take_chunk(rest);
  if (!header || header->type != chunk_type("IHDR") || header->data.size() != kHeader) return std::nullopt;
  const std::uint8_t* const fields = header->data.data();
  const std::uint32_t width = big_endian_u32(fields), height = big_endian_u32(fields + 4);
  if (PngKind{fields[8], fields[9]} != kind ||
      !std::ranges::equal(header->data.last(kMethods.size()), kMethods))
    return std::nullopt;
  if (!check_image_size(width, height, {})) return std::nullopt;
  PngContent content{{static_cast<int>(width), static_cast<int>(height)}, {}};
  content.compressed.reserve(bytes.size());
  std::uint32_t last = header->type;
  while (last != chunk_type("IEND")) {
    const auto chunk = take_chunk(rest);
    if (!chunk) return std::nullopt;
    if (chunk->type == chunk_type("IDAT")) {
      if (last != chunk->type && !content.compressed.empty()) return std::nullopt;
      content.compressed.insert(content.compressed.end(), chunk->data.begin(), chunk->data.end());
    } else if (chunk->type != chunk_type("IEND") && (chunk->type & kCanBeSkipped) == 0) {
      return std::nullopt;
    }
    last = chunk->type;
  }
  return content;
}

/// The one of left, above and corner that is nearest to left + above - corner, the first of those as near
/// (9.4). That is the smaller of left and above where the corner is at least as large as both, and so on:
/// without a branch, which pixels would take at random.
int paeth(int left, int above, int corner) {
  const int low = std::min(left, above), high = std::max(left, above);
  const int mirrored = 3 * corner - (left + above);
  const int low_or_corner = high <= mirrored ? low : corner;
  return mirrored <= low ? high : low_or_corner;
}

/// Adds to each byte of a row what its filter predicts from the same channel of the pixels to the left, above
/// and in the corner between (9.2). Nothing before the image is 0.
template <std::size_t kPixelBytes>
bool undo_filter(std::uint8_t filter, std::span<std::uint8_t> row, const std::uint8_t* above) {
  const auto add = [&](auto&& prediction) {
    std::array<std::uint8_t, kPixelBytes> left{}, corner{};
    for (std::size_t x = 0; x < row.size(); x += kPixelBytes)
      for (std::size_t c = 0; c < kPixelBytes; ++c) {
        const std::uint8_t up = above[x + c];
        left[c] = row[x + c] = static_cast<std::uint8_t>(row[x + c] + prediction(left[c], up, corner[c]));
        corner[c] = up;
      }
    return true;
  };
  switch (filter) {
    case 0:
      return true;
    case 1:
      return add([](int left, int, int) { return left; });
    case 2:
      return add([](int, int up, int) { return up; });
    case 3:
      return add([](int left, int up, int) { return (left + up) / 2; });
    case 4:
      return add([](int left, int up, int corner) { return paeth(left, up, corner); });
    default:
      return false;
  }
}

/// Bytes of all rows as the file stores them, each after the byte that names its filter.
std::optional<std::vector<std::uint8_t>> decompress(const PngContent& content, std::size_t row_bytes) {
  const std::size_t bytes = (1 + row_bytes) * static_cast<std::size_t>(content.size.height);
  if (bytes / kMostDeflateRatio > content.compressed.size()) return std::nullopt;
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  std::vector<std::uint8_t> rows(bytes);
  if (!decompressor ||
      libdeflate_zlib_decompress(decompressor.get(), content.compressed.data(), content.compressed.size(),
                                 rows.data(), rows.size(), nullptr) != LIBDEFLATE_SUCCESS)
    return std::nullopt;
  return rows;
}

template <class Pixel>
std::optional<Image<Pixel>> decode_plain(std::span<const std::uint8_t> bytes) {
  const auto content = read_content(bytes, kKindOf<Pixel>);
  if (!content) return std::nullopt;
  const std::size_t row_bytes = static_cast<std::size_t>(content->size.width) * sizeof(Pixel);
  auto rows = decompress(*content, row_bytes);
  if (!rows) return std::nullopt;
  Image<Pixel> image(content->size.width, content->size.height);
  const std::vector<std::uint8_t> before_first(row_bytes);
  const std::uint8_t* above = before_first.data();
  for (int y = 0; y < image.height(); ++y) {
    std::uint8_t* const row = rows->data() + static_cast<std::size_t>(y) * (1 + row_bytes);
    if (!undo_filter<sizeof(Pixel)>(row[0], {row + 1, row_bytes}, above)) return std::nullopt;
    std::memcpy(image.row(y).data(), row + 1, row_bytes);
    for (Pixel& pixel : image.row(y)) pixel = to_big_endian(pixel);
    above = row + 1;
  }
  return image;
}

void append_u32(std::uint32_t value, std::vector<std::uint8_t>& bytes) {
  for (unsigned shift = 32; shift > 0; shift -= 8)
    bytes.push_back(static_cast<std::uint8_t>(value >> (shift - 8)));
}

void append_chunk(const char (&name)[5], std::span<const std::uint8_t> data,
                  std::vector<std::uint8_t>& bytes) {
  append_u32(static_cast<std::uint32_t>(data.size()), bytes);
  const std::size_t checked = bytes.size();
  append_u32(chunk_type(name), bytes);
  bytes.insert(bytes.end(), data.begin(), data.end());
  append_u32(libdeflate_crc32(0, bytes.data() + checked, bytes.size() - checked), bytes);
}

/// Rows as the file stores them, by the filter that subtracts the pixel to the left (9.2), or none.
template <class Pixel>
std::vector<std::uint8_t> filtered_rows(const Image<Pixel>& image, bool subtract) {
  const std::size_t row_bytes = image.row(0).size_bytes();
  std::vector<std::uint8_t> rows((1 + row_bytes) * static_cast<std::size_t>(image.height()));
  std::vector<Pixel> row(static_cast<std::size_t>(image.width()));
  for (int y = 0; y < image.height(); ++y) {
    std::ranges::transform(image.row(y), row.begin(),
                           [](const Pixel& pixel) { return to_big_endian(pixel); });
    const auto* const from = reinterpret_cast<const std::uint8_t*>(row.data());
    std::uint8_t* const to = rows.data() + static_cast<std::size_t>(y) * (1 + row_bytes);
    to[0] = subtract ? 1 : 0;
    std::memcpy(to + 1, from, subtract ? sizeof(Pixel) : row_bytes);
    if (!subtract) continue;
    for (std::size_t x = sizeof(Pixel); x < row_bytes; ++x)
      to[1 + x] = static_cast<std::uint8_t>(from[x] - from[x - sizeof(Pixel)]);
  }
  return rows;
}

std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& rows, int level) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), libdeflate_free_compressor);
  HM_CHECK(compressor, "libdeflate: out of memory");
  std::vector<std::uint8_t> compressed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  const std::size_t size = libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(),
                                                    compressed.data(), compressed.size());
  HM_CHECK(size > 0, "libdeflate: {} bytes do not fit", rows.size());
  compressed.resize(size);
  return compressed;
}

template <class Pixel>
std::vector<std::uint8_t> encode_plain(const Image<Pixel>& image, PngEffort effort) {
  const std::vector<std::uint8_t> compressed =
      compress(filtered_rows(image, effort != PngEffort::kStored), static_cast<int>(effort));
  std::vector<std::uint8_t> header;
  append_u32(static_cast<std::uint32_t>(image.width()), header);
  append_u32(static_cast<std::uint32_t>(image.height()), header);
  header.insert(header.end(), {kKindOf<Pixel>.bit_depth, kKindOf<Pixel>.color_type});
  header.insert(header.end(), kMethods.begin(), kMethods.end());
  std::vector<std::uint8_t> bytes(kPngSignature.begin(), kPngSignature.end());
  bytes.reserve(compressed.size() + 64);
  append_chunk("IHDR", header, bytes);
  append_chunk("IDAT", compressed, bytes);
  append_chunk("IEND", {}, bytes);
  return bytes;
}

}  // namespace

std::optional<Image<Rgb8>> decode_plain_png_color(std::span<const std::uint8_t> bytes) {
  return decode_plain<Rgb8>(bytes);
}
std::optional<Image<std::uint16_t>> decode_plain_png_gray16(std::span<const std::uint8_t> bytes) {
  return decode_plain<std::uint16_t>(bytes);
}

std::vector<std::uint8_t> encode_plain_png(const Image<Rgb8>& image, PngEffort effort) {
  return encode_plain(image, effort);
}
std::vector<std::uint8_t> encode_plain_png(const Image<std::uint16_t>& image, PngEffort effort) {
  return encode_plain(image, effort);
}

}  // namespace hm::detail
