#pragma once
#include <string>
#include <vector>

#include "hm/pipeline/laser/run/laser_run.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Content of a laser run's report besides the summary.
struct LaserReportMaterial {
  std::string program_version;
  std::string parameters_toml;
  std::vector<Figure> figures;
};

/// The self-contained page of a run: figures of the map, path, height, velocities, times, size, failures.
std::string laser_report_html(const LaserSummary& summary, const LaserReportMaterial& material);
/// The summary as JSON, with the series behind the plots.
JsonValue laser_report_json(const LaserSummary& summary, const std::string& program_version);

}  // namespace hm
