#include "hm/report/run_report.hpp"

#include <algorithm>

namespace hm {

void add_cards(HtmlReport& report, const SummaryTree& summary, std::initializer_list<SummaryCard> cards) {
  for (const SummaryCard& card : cards) {
    const auto value = summary.sentence(card.value);
    if (!value) continue;
    const std::size_t space = std::min(value->find(' '), value->size());
    const std::string unit = space < value->size() ? value->substr(space + 1) : std::string();
    report.add_card(
        {std::string(card.name), value->substr(0, space), unit, summary.sentence(card.note).value_or("")});
  }
}

void add_summary_table(HtmlReport& report, const SummaryTree& summary, std::string_view group) {
  const auto rows = summary.rows(group);
  if (!rows.empty()) report.add_table({"what", "value"}, rows);
}

void add_list_table(HtmlReport& report, const SummaryTree& summary, std::string_view list) {
  const auto table = summary.table(list);
  if (!table.rows.empty()) report.add_table(table.header, table.rows);
}

std::string folder_title(const std::filesystem::path& path) {
  std::error_code code;
  std::filesystem::path whole = std::filesystem::weakly_canonical(path, code);
  if (code) whole = path.lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  const std::string name = whole.filename().string(), above = whole.parent_path().filename().string();
  const bool vague = name == "recording" || name == "result" || name == "data" || name == "out" ||
                     std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  return vague && !above.empty() ? above + "/" + name : name;
}

std::string output_lines(std::span<const std::filesystem::path> outputs) {
  std::string text;
  for (const auto& path : outputs) text += "  " + path.string() + "\n";
  return text;
}

void add_warnings_section(HtmlReport& report, const std::vector<std::string>& warnings) {
  if (warnings.empty()) return;
  report.begin_section("Warnings");
  report.add_list(warnings);
}

std::string page_with_parameters(HtmlReport& report, const std::string& parameters_toml,
                                 const std::string& program_version) {
  report.begin_section("Parameters");
  report.add_collapsible("parameters.toml", parameters_toml);
  report.set_footer("housemartin " + program_version);
  return report.html();
}

}  // namespace hm
