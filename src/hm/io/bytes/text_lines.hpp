#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// Non-empty line, without line end and surrounding whitespace.
struct TextLine {
  std::size_t number = 0;  ///< counted from 1
  std::string_view text;
  bool ended = true;  ///< false for a last line without line end, which may be truncated
};

/// Text file as a list of non-empty lines: blank lines and # comments are skipped, CRLF and a byte order mark
/// are accepted.
class TextFile {
 public:
  static Result<TextFile> read(const std::filesystem::path& path);
  TextFile(std::string text, std::string where);

  [[nodiscard]] const std::string& where() const { return where_; }
  [[nodiscard]] std::string where(const TextLine& line) const;  ///< "file:line"
  [[nodiscard]] std::vector<TextLine> lines() const;
  /// Comment lines, for formats that store information there.
  [[nodiscard]] std::vector<std::string_view> comments() const;

 private:
  [[nodiscard]] std::vector<TextLine> all_lines() const;
  std::string text_;
  std::string where_;
};

/// Words of a line, separated by spaces or tabs.
std::vector<std::string_view> words(std::string_view line);
/// Fields of a line between separators, trimmed.
std::vector<std::string_view> cells(std::string_view line, char separator);
/// Parses a whole word as a number, including NaN and infinities; nothing if it is not a number.
std::optional<double> parse_number(std::string_view word);
/// Parses decimal seconds, exact to the nanosecond; nothing if it is not a number or beyond 290 years.
/// Numbers beyond that with 13, 16 or 19 digits are Unix time in milliseconds, microseconds or nanoseconds.
std::optional<Time> parse_stamp(std::string_view word);
/// Formats a time as seconds with nine decimals.
std::string stamp_text(Time stamp);
/// Parses integer nanoseconds; nothing if it is not an integer.
std::optional<Time> parse_stamp_ns(std::string_view word);

}  // namespace hm
