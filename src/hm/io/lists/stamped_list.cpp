#include "hm/io/lists/stamped_list.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/bytes/text_lines.hpp"

namespace hm::detail {
namespace {

ImageList increasing(const std::vector<StampedImage>& images, const std::vector<std::size_t>& lines,
                     SkipCounter skips) {
  ImageList list;
  list.images = keep_increasing(
      images, lines, [](const StampedImage& p) { return p.stamp; }, skips);
  list.skipped = skips.take();
  return list;
}

/// A path of a list, which may have been written on Windows.
std::string with_slashes(std::string_view path) {
  std::string result(path);
  std::ranges::replace(result, '\\', '/');
  return result;
}

enum class PathKind { kUnknown, kDepth, kColor };

PathKind kind_of_path(std::string_view path) {
  std::string lower(path);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower.find("depth") != std::string::npos) return PathKind::kDepth;
  if (lower.find("rgb") != std::string::npos || lower.find("color") != std::string::npos ||
      lower.find("colour") != std::string::npos || lower.find("image") != std::string::npos)
    return PathKind::kColor;
  return PathKind::kUnknown;
}

/// Index (0 or 1) of the path of the depth image in a line, or nothing if the names are ambiguous.
std::optional<std::size_t> depth_column(std::string_view first, std::string_view second) {
  const PathKind a = kind_of_path(first), b = kind_of_path(second);
  if (a == b) return std::nullopt;
  if (a == PathKind::kDepth || b == PathKind::kColor) return 0;
  return 1;
}

}  // namespace

Result<void> parse_lines(const TextFile& file, std::span<const TextLine> lines, SkipCounter& skips,
                         const std::function<std::string(const TextLine&)>& parse) {
  for (const TextLine& line : lines) {
    const std::string wrong = parse(line);
    if (wrong.empty()) continue;
    if (line.ended) return fail(ErrorCode::kCorrupted, file.where(line), "{}", wrong);
    skips.add(SkippedLines::Reason::kCutOff, line.number);
  }
  return {};
}

std::optional<Time> StampRule::parse(std::string_view word) const {
  if (!frame_rate_hz) return parse_stamp(word);
  const auto number = parse_number(word);
  if (!number || !std::isfinite(*number) || std::fabs(*number) > 1e9) return std::nullopt;
  return Time::from_seconds(*number / *frame_rate_hz);
}

Result<ImageList> read_image_list(const std::filesystem::path& path, const StampRule& rule) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  std::vector<StampedImage> images;
  std::vector<std::size_t> lines;
  SkipCounter skips(path);
  const auto parsed = parse_lines(*file, file->lines(), skips, [&](const TextLine& line) -> std::string {
    const auto columns = words(line.text);
    if (columns.size() < 2) return fmt::format("expected `stamp path`, found `{}`", line.text);
    const auto stamp = rule.parse(columns[0]);
    if (!stamp) return fmt::format("`{}` is not a stamp", columns[0]);
    const auto path_begin = static_cast<std::size_t>(columns[1].data() - line.text.data());
    images.push_back({*stamp, with_slashes(line.text.substr(path_begin))});
    lines.push_back(line.number);
    return {};
  });
  if (!parsed) return forward_error(parsed);
  return increasing(images, lines, skips);
}

Result<AssociationList> read_associations(const std::filesystem::path& path, const StampRule& rule) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  std::array<std::vector<StampedImage>, 2> columns;  // depth, colour
  std::vector<std::size_t> lines;
  SkipCounter skips(path);
  const auto parsed = parse_lines(*file, file->lines(), skips, [&](const TextLine& line) -> std::string {
    const auto word = words(line.text);
    if (word.size() != 4) return fmt::format("expected `stamp path stamp path`, found `{}`", line.text);
    const std::array<std::optional<Time>, 2> stamps{rule.parse(word[0]), rule.parse(word[2])};
    if (!stamps[0] || !stamps[1]) return fmt::format("`{}` is not a stamp", word[stamps[0] ? 2 : 0]);
    const auto depth = depth_column(word[1], word[3]);
    if (!depth)
      return fmt::format("the names do not say which is colour and which is depth: `{}`", line.text);
    columns[0].push_back({*stamps[*depth], with_slashes(word[2 * *depth + 1])});
    columns[1].push_back({*stamps[1 - *depth], with_slashes(word[2 * (1 - *depth) + 1])});
    lines.push_back(line.number);
    return {};
  });
  if (!parsed) return forward_error(parsed);
  AssociationList list{increasing(columns[0], lines, skips),
                       increasing(columns[1], lines, SkipCounter(path))};
  return list;
}

std::vector<std::optional<std::size_t>> associate(std::span<const Time> a, std::span<const Time> b,
                                                  Duration max_difference) {
  std::vector<std::tuple<std::int64_t, std::size_t, std::size_t>> candidates;
  std::size_t first = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    while (first < b.size() && b[first] < a[i] - max_difference) ++first;
    for (std::size_t j = first; j < b.size() && b[j] <= a[i] + max_difference; ++j)
      candidates.emplace_back(std::abs((a[i] - b[j]).ns), i, j);
  }
  std::ranges::sort(candidates);
  std::vector<std::optional<std::size_t>> partner(a.size());
  std::vector<bool> used(b.size(), false);
  for (const auto& [difference, i, j] : candidates) {
    if (partner[i] || used[j]) continue;
    partner[i] = j;
    used[j] = true;
  }
  return partner;
}

}  // namespace hm::detail
