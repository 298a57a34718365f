#include "hm/report/run_report.hpp"

namespace hm {

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
