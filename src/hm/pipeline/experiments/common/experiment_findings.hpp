#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/pipeline/flight/mission/flight_summary.hpp"
#include "hm/report/html_report.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// Parameters that experiments start from; each sets what it is about (world, script, control law, sensor)
/// itself.
struct ExperimentParameters {
  FlightParameters flight;
  SimulationParams simulation;
  FeatureParams features;
};
struct ExperimentOptions {
  std::filesystem::path output;  ///< a folder, which is there
  /// Folder of recordings (rgbd/tum_fr1_xyz, laser/...); what is not in it is simulated. Empty: all is.
  std::filesystem::path data;
  bool tiny = false;  ///< as short as it can be, to see that it works; its numbers mean little
  ExperimentParameters parameters;
  RunContext run;
};

/// A number of a figure or table, as the dissertation gives it and as it is measured here.
struct ExperimentRow {
  std::string quantity;
  std::optional<double> published;  ///< nothing: the dissertation shows it without a number
  double measured = 0;
  std::string unit;  ///< of both: "cm", "%"; empty: a count
};

/// Results of an experiment.
struct ExperimentFindings {
  std::vector<ExperimentRow> rows;
  std::function<void(HtmlReport&)> add_figures;  ///< the figure remade, section by section
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;  ///< besides the page
};

/// An experiment of the dissertation.
struct Experiment {
  std::string_view name;     ///< "hover"
  std::string_view figure;   ///< "Fig. 2.8", "Fig. 4.19, Table 4.1"
  std::string_view content;  ///< what the figure shows, and how it is remade
  Result<ExperimentFindings> (*run)(const ExperimentOptions& options);
};

}  // namespace hm
