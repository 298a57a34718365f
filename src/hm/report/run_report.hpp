#pragma once
#include <string>
#include <vector>

#include "hm/report/html_report.hpp"

namespace hm {

/// The section of warnings, if there are any.
void add_warnings_section(HtmlReport& report, const std::vector<std::string>& warnings);
/// The page with its last section, the parameters that were in effect, and the version below.
std::string page_with_parameters(HtmlReport& report, const std::string& parameters_toml,
                                 const std::string& program_version);

}  // namespace hm
