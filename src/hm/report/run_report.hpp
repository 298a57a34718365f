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

/// A key number of a summary: `value` and `note` are sentences of its tree, "{run_s}", "of {frames.total}".
struct SummaryCard {
  std::string_view name, value, note = {};
};
/// Adds the cards whose value is there; what follows its first space is the unit.
void add_cards(HtmlReport& report, const SummaryTree& summary, std::initializer_list<SummaryCard> cards);
/// Adds label and value of what a group of the summary shows; nothing where it shows nothing.
void add_summary_table(HtmlReport& report, const SummaryTree& summary, std::string_view group = {});
/// Adds the table of a list of the summary; nothing for an empty one.
void add_list_table(HtmlReport& report, const SummaryTree& summary, std::string_view list);

/// The files that a run wrote, a line each, for a terminal.
std::string output_lines(std::span<const std::filesystem::path> outputs);

/// The section of warnings, if there are any.
void add_warnings_section(HtmlReport& report, const std::vector<std::string>& warnings);
/// The page with its last section, the parameters that were in effect, and the version below.
std::string page_with_parameters(HtmlReport& report, const std::string& parameters_toml,
                                 const std::string& program_version);

}  // namespace hm
