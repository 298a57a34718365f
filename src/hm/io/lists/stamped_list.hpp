#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/bytes/text_lines.hpp"

/// Readers of the text lists of images of a TUM or ICL-NUIM folder. A malformed line is an error naming
/// file:line, except for an unterminated last line, which is skipped as truncated. Lines in no order of time
/// are sorted; else those whose stamp does not increase are skipped, as few as possible (keep_increasing).
namespace hm::detail {

/// Conversion of stamps in a file to times: seconds, or frame numbers at `frame_rate_hz`.
struct StampRule {
  std::optional<double> frame_rate_hz;
  [[nodiscard]] std::optional<Time> parse(std::string_view word) const;
};

/// Passes each line to `parse`, which returns what is wrong with it, if anything: an error naming file:line,
/// or an unterminated last line skipped as cut off.
Result<void> parse_lines(const TextFile& file, std::span<const TextLine> lines, SkipCounter& skips,
                         const std::function<std::string(const TextLine&)>& parse);

struct StampedImage {
  Time stamp;
  std::string path;  ///< relative to the recording, with slashes for backslashes
};

struct ImageList {
  std::vector<StampedImage> images;
  std::vector<SkippedLines> skipped;
};
/// Reads lines `stamp path`.
Result<ImageList> read_image_list(const std::filesystem::path& path, const StampRule& rule = {});

struct AssociationList {
  ImageList depth;
  ImageList color;
};
/// Reads lines `stamp path stamp path`, colour and depth in either order (recognised by the paths).
Result<AssociationList> read_associations(const std::filesystem::path& path, const StampRule& rule = {});

/// Associates stamps: for each time of `a` the index of its partner in `b`, or nothing. Pairs are at most
/// `max_difference` apart, closest first, each used once (as in TUM's associate.py). Both lists must be
/// increasing.
std::vector<std::optional<std::size_t>> associate(std::span<const Time> a, std::span<const Time> b,
                                                  Duration max_difference);

}  // namespace hm::detail
