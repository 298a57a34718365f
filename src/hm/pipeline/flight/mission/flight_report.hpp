#pragma once
#include <string>
#include <vector>

#include "hm/pipeline/flight/mission/flight_summary.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Content of a flight's report besides the summary.
struct FlightReportMaterial {
  std::string program_version;
  std::string parameters_toml;
  std::string flight_svg;  ///< the flight over the floor plan
  std::vector<Figure> figures;
};

/// The self-contained page of a flight: the flight over the floor plan, commanded, estimated and true
/// position over time and from above (as dissertation Figs 2.8, 2.9), height over the floor (as Fig. 2.5),
/// errors, orders, events, fail-safes, latencies.
std::string flight_report_html(const FlightSummary& summary, const FlightReportMaterial& material);
/// The summary, and the series of the plots.
JsonValue flight_report_json(const FlightSummary& summary, const FlightReportMaterial& material);

}  // namespace hm
