#include "hm/io/lists/pose_table.hpp"

#include <algorithm>
#include <cctype>
#include <string>

namespace hm::detail {
namespace {

/// The last letter of a column's name, without its unit: 'w' of `q_RS_w []`.
char last_letter(std::string_view name) {
  name = name.substr(0, name.find_first_of(" [("));
  return name.empty() ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(name.back())));
}

/// True where the quaternion's real part is named first, false where last; nothing where names do not tell.
std::optional<bool> names_real_part_first(const std::vector<std::string_view>& names) {
  if (names.size() < 8) return std::nullopt;
  std::string letters;
  for (std::size_t i = 4; i < 8; ++i) letters += last_letter(names[i]);
  if (letters == "wxyz") return true;
  if (letters == "xyzw") return false;
  return std::nullopt;
}

void apply_header(std::string_view header, PoseTable& table) {
  const bool is_comment = header.starts_with('#');
  const bool has_commas = header.find(',') != std::string_view::npos;
  const bool is_euroc = is_comment && has_commas && header.starts_with("#timestamp");
  const auto order = names_real_part_first(pose_columns(header.substr(is_comment ? 1 : 0)));
  if (!is_euroc && !order) return;
  table.has_comma_header = has_commas;
  table.real_part_first = order.value_or(true);
  table.in_nanoseconds = header.find("[ns]") != std::string_view::npos ||
                         header.find("_ns") != std::string_view::npos || (is_euroc && table.real_part_first);
}

}  // namespace

std::optional<Time> PoseTable::stamp(std::string_view word) const {
  return in_nanoseconds && word.find('.') == std::string_view::npos ? parse_stamp_ns(word)
                                                                    : parse_stamp(word);
}

std::vector<std::string_view> pose_columns(std::string_view line) {
  const std::size_t separator = line.find_first_of(",;");
  if (separator == std::string_view::npos) return words(line);
  std::vector<std::string_view> columns = cells(line, line[separator]);
  if (columns.back().empty()) columns.pop_back();
  return columns;
}

PoseTable pose_table(const TextFile& file) {
  PoseTable table;
  for (const std::string_view comment : file.comments()) apply_header(comment, table);
  table.lines = file.lines();
  if (table.lines.empty()) return table;
  const std::string_view first = table.lines.front().text;
  if (std::ranges::any_of(pose_columns(first),
                          [](std::string_view word) { return parse_number(word).has_value(); }))
    return table;
  apply_header(first, table);
  table.lines.erase(table.lines.begin());
  return table;
}

}  // namespace hm::detail
