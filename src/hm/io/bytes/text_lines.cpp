#include "hm/io/bytes/text_lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

template <class Number>
std::optional<Number> parse_as(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Unix time in milliseconds, microseconds or nanoseconds, told by its 13, 16 or 19 digits (2001 to 2286), as
/// decimal seconds; empty for another word.
std::string seconds_of_parts(std::string_view word) {
  constexpr std::size_t kDigitsOfSeconds = 10;
  const std::size_t digits = std::min(word.find_first_not_of("0123456789"), word.size());
  if (digits != 13 && digits != 16 && digits != 19) return {};
  std::string_view fraction = word.substr(digits);
  if (!fraction.empty() && fraction.front() != '.') return {};
  if (!fraction.empty()) fraction.remove_prefix(1);
  return fmt::format("{}.{}{}", word.substr(0, kDigitsOfSeconds),
                     word.substr(kDigitsOfSeconds, digits - kDigitsOfSeconds), fraction);
}

}  // namespace

TextFile::TextFile(std::string text, std::string where) : text_(std::move(text)), where_(std::move(where)) {
  if (text_.starts_with("\xEF\xBB\xBF")) text_.erase(0, 3);
}

Result<TextFile> TextFile::read(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path, std::size_t{1} << 28);
  if (!bytes) return forward_error(bytes);
  return TextFile(std::string(bytes->begin(), bytes->end()), path.string());
}

std::string TextFile::where(const TextLine& line) const { return fmt::format("{}:{}", where_, line.number); }

std::vector<TextLine> TextFile::all_lines() const {
  std::vector<TextLine> lines;
  const std::string_view text = text_;
  std::size_t begin = 0;
  for (std::size_t number = 1; begin < text.size(); ++number) {
    const std::size_t end = text.find('\n', begin);
    const bool ended = end != std::string_view::npos;
    const std::string_view line = trimmed(text.substr(begin, ended ? end - begin : end));
    if (!line.empty()) lines.push_back({number, line, ended});
    begin = ended ? end + 1 : text.size();
  }
  return lines;
}

std::vector<TextLine> TextFile::lines() const {
  std::vector<TextLine> lines = all_lines();
  std::erase_if(lines, [](const TextLine& line) { return line.text.starts_with('#'); });
  return lines;
}

std::vector<std::string_view> TextFile::comments() const {
  std::vector<std::string_view> comments;
  for (const TextLine& line : all_lines())
    if (line.text.starts_with('#')) comments.push_back(line.text);
  return comments;
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  std::size_t begin = line.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = line.find_first_of(kBlanks, begin);
    result.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return result;
}

std::vector<std::string_view> cells(std::string_view line, char separator) {
  std::vector<std::string_view> result;
  while (true) {
    const std::size_t end = line.find(separator);
    result.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return result;
    line.remove_prefix(end + 1);
  }
}

std::optional<double> parse_number(std::string_view word) { return parse_as<double>(word); }

std::optional<Time> parse_stamp(std::string_view word) {
  constexpr long double kMaxSeconds = 9.2e9L;
  const std::string of_parts = seconds_of_parts(word);
  // 64 bits of mantissa hold a stamp of this century to a tenth of a nanosecond.
  const auto seconds = parse_as<long double>(of_parts.empty() ? word : of_parts);
  if (!seconds || !std::isfinite(*seconds) || std::fabs(*seconds) > kMaxSeconds) return std::nullopt;
  return Time{std::llround(*seconds * 1e9L)};
}

std::string stamp_text(Time stamp) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const auto bits = static_cast<std::uint64_t>(stamp.ns);
  const std::uint64_t magnitude =
      stamp.ns < 0 ? 0 - bits : bits;  // the most negative value has no positive counterpart
  return fmt::format("{}{}.{:09}", stamp.ns < 0 ? "-" : "", magnitude / kSecond, magnitude % kSecond);
}

std::optional<Time> parse_stamp_ns(std::string_view word) {
  const auto ns = parse_as<std::int64_t>(word);
  return ns ? std::optional(Time{*ns}) : std::nullopt;
}

}  // namespace hm
