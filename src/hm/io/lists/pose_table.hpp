#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/io/bytes/text_lines.hpp"

/// Text files with a pose on each line, as different programs write them.
namespace hm::detail {

/// Lines of such a file, and how their columns are written: `stamp tx ty tz` and a quaternion.
struct PoseTable {
  std::vector<TextLine> lines;    ///< without comments and header; they point into the file
  bool has_comma_header = false;  ///< columns are named, so that there may be more than a pose needs
  bool real_part_first = false;   ///< qw qx qy qz instead of qx qy qz qw
  bool in_nanoseconds = false;    ///< of stamps without decimal point
  /// A stamp in seconds, or in nanoseconds where the file has them (see also parse_stamp()).
  [[nodiscard]] std::optional<Time> stamp(std::string_view word) const;
};

/// The table in a file. A header is a comment that names the columns, or a first line without any number. It
/// tells the quaternion's order by its names (`q_w` or `qw`), and nanoseconds by `[ns]` or `_ns`. EuRoC's
/// comment `#timestamp,...` means both, unless it names the columns otherwise.
PoseTable pose_table(const TextFile& file);

/// Columns of a line: between commas or semicolons where there are any, else between blanks. A separator at
/// the end begins no column.
std::vector<std::string_view> pose_columns(std::string_view line);

}  // namespace hm::detail
