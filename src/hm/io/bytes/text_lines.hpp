#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// A line that holds something: without its end, without blanks around it.
struct TextLine {
  std::size_t number = 0;  ///< counted from 1
  std::string_view text;
  bool ended = true;  ///< false for a last line without a line end: it may be cut off
};

/// A text file with the lines that hold something: blank lines and lines that start with # are left out,
/// CRLF and a byte order mark are understood.
class TextFile {
 public:
  static Result<TextFile> read(const std::filesystem::path& path);
  TextFile(std::string text, std::string where);

  [[nodiscard]] const std::string& where() const { return where_; }
  [[nodiscard]] std::string where(const TextLine& line) const;  ///< "file:line"
  [[nodiscard]] std::vector<TextLine> lines() const;
  /// The comment lines, for the little that is hidden there.
  [[nodiscard]] std::vector<std::string_view> comments() const;

 private:
  [[nodiscard]] std::vector<TextLine> all_lines() const;
  std::string text_;
  std::string where_;
};

/// The words of a line, separated by blanks or tabs.
std::vector<std::string_view> words(std::string_view line);
/// What stands between the separators of a line, without blanks around it.
std::vector<std::string_view> cells(std::string_view line, char separator);
/// A whole word as a number, NaN and infinities too; nothing when it is none.
std::optional<double> parse_number(std::string_view word);
/// Decimal seconds as a time, exact to the nanosecond; nothing when it is none or beyond 290 years.
std::optional<Time> parse_stamp(std::string_view word);
/// A time as seconds with nine decimals, which parse_stamp() reads back exactly.
std::string stamp_text(Time stamp);
/// Whole nanoseconds as a time; nothing when it is none.
std::optional<Time> parse_stamp_ns(std::string_view word);

}  // namespace hm
