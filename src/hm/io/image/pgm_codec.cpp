#include <cctype>
#include <charconv>
#include <optional>

#include "hm/io/image/image_codec.hpp"

namespace hm {
namespace {

/// Reads the numbers of a header, separated by white space and comments.
class PgmHeader {
 public:
  explicit PgmHeader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  /// Next number; nothing if there is none or it is too large.
  std::optional<int> number() {
    skip_space();
    const char* begin = reinterpret_cast<const char*>(bytes_.data()) + at_;
    int value = 0;
    const auto [end, error] = std::from_chars(begin, begin + (bytes_.size() - at_), value);
    if (error != std::errc() || value < 0) return std::nullopt;
    at_ += static_cast<std::size_t>(end - begin);
    return value;
  }
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skip_space() {
    for (bool in_comment = false; at_ < bytes_.size(); ++at_) {
      if (bytes_[at_] == '#') in_comment = true;
      if (bytes_[at_] == '\n') in_comment = false;
      if (!in_comment && std::isspace(bytes_[at_]) == 0) return;
    }
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 2;  // behind "P5"
};

struct PgmLayout {
  ImageSize size;
  int largest = 0;
  std::size_t begin = 0;  ///< of the pixels
};
Result<PgmLayout> read_layout(std::span<const std::uint8_t> bytes, const std::string& where) {
  if (!detail::is_pgm(bytes))
    return fail(ErrorCode::kUnsupported, where, "no binary PGM (by its first bytes)");
  PgmHeader header(bytes);
  const auto width = header.number(), height = header.number(), largest = header.number();
  if (!width || !height || !largest)
    return fail(ErrorCode::kCorrupted, fmt::format("{}: byte {}", where, header.at()),
                "a PGM's header has width, height and largest value");
  if (auto size = detail::check_image_size(*width, *height, where); !size) return forward_error(size);
  return PgmLayout{{*width, *height}, *largest, header.at() + 1};  // one white space ends the header
}

}  // namespace

bool detail::is_pgm(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 2 && bytes[0] == 'P' && bytes[1] == '5';
}

Result<ImageSize> detail::pgm_size(std::span<const std::uint8_t> bytes, const std::string& where) {
  const auto layout = read_layout(bytes, where);
  if (!layout) return forward_error(layout);
  return layout->size;
}

Result<Image<std::uint16_t>> decode_depth_pgm(std::span<const std::uint8_t> bytes, const std::string& where) {
  const auto layout = read_layout(bytes, where);
  if (!layout) return forward_error(layout);
  const auto [width, height] = layout->size;
  if (layout->largest <= 255 || layout->largest > 65535)
    return fail(ErrorCode::kUnsupported, where,
                "a depth image must be 16-bit gray; this PGM's largest value is {}", layout->largest);
  const std::size_t begin = layout->begin;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (bytes.size() < begin + 2 * pixels)
    return fail(ErrorCode::kTruncated, fmt::format("{}: byte {}", where, bytes.size()),
                "the file ends here; {} x {} pixels need {} bytes", width, height, begin + 2 * pixels);
  Image<std::uint16_t> image(width, height);
  for (std::size_t i = 0; i < pixels; ++i)
    image.data()[i] = static_cast<std::uint16_t>(bytes[begin + 2 * i] << 8U | bytes[begin + 2 * i + 1]);
  return image;
}

}  // namespace hm
