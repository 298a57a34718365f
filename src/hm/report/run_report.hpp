#pragma once
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/report/html_report.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Key number of a summary; `value` and `note` are sentences of its tree: "{run_s}", "of {frames.total}".
struct SummaryCard {
  std::string_view name, value, note = {};
};
/// Adds the cards that have a value; the text after its first space is the unit.
void add_cards(HtmlReport& report, const SummaryTree& summary, std::initializer_list<SummaryCard> cards);
/// Adds a table of labels and values of a group of the summary; nothing if there are none.
void add_summary_table(HtmlReport& report, const SummaryTree& summary, std::string_view group = {});
/// Adds the table of a list of the summary; nothing for an empty one.
void add_list_table(HtmlReport& report, const SummaryTree& summary, std::string_view list);

/// Name by which a reader knows a folder or file: its last part, preceded by the folder above where that says
/// too little ("recording", "result", "data", a number): "house/recording".
std::string folder_title(const std::filesystem::path& path);

/// Files written by a run, one per line, for a terminal.
std::string output_lines(std::span<const std::filesystem::path> outputs);

/// Adds a section of warnings, if there are any.
void add_warnings_section(HtmlReport& report, const std::vector<std::string>& warnings);
/// Returns the HTML page, after adding a section with the effective parameters and the program version.
std::string page_with_parameters(HtmlReport& report, const std::string& parameters_toml,
                                 const std::string& program_version);

}  // namespace hm
