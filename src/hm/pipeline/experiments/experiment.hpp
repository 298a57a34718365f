#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/flight/mission/flight_summary.hpp"
#include "hm/report/html_report.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// What experiments start from; each sets what it is about (world, script, control law, sensor) itself.
struct ExperimentParameters {
  FlightParameters flight;
  SimulationParams simulation;
  FeatureParams features;
};
/// Its sections: those of list_flight_mission(), simulation, odometry_features.
ParamList list_experiments(ExperimentParameters& parameters);

struct ExperimentOptions {
  std::filesystem::path output;  ///< a folder, which is there
  bool tiny = false;             ///< as short as it can be, to see that it works; its numbers mean little
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

/// What an experiment found.
struct ExperimentFindings {
  std::vector<ExperimentRow> rows;
  std::function<void(HtmlReport&)> add_figures;  ///< the figure remade, section by section
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;  ///< besides the page
};

/// An experiment of the dissertation.
struct Experiment {
  std::string_view name;     ///< "hover"
  std::string_view figure;   ///< "Fig. 2.8"
  std::string_view content;  ///< what the figure shows, and how it is remade
  Result<ExperimentFindings> (*run)(const ExperimentOptions& options);
};

/// All experiments, in the order of the dissertation.
std::span<const Experiment> experiments();
/// The experiment of this name; nothing: there is none.
const Experiment* find_experiment(std::string_view name);

/// An experiment that is over.
struct ExperimentOutcome {
  const Experiment* experiment = nullptr;
  std::vector<ExperimentRow> rows;
  std::vector<std::string> warnings;
};

struct ExperimentSummary {
  std::vector<ExperimentOutcome> outcomes;
  std::vector<std::string> warnings;  ///< of all, each after its experiment's name
  std::vector<std::filesystem::path> outputs;
};

/// Runs experiments and writes, for each, report.html (the figure remade, the published numbers beside the
/// measured ones), report.json, parameters.toml and what the experiment leaves besides (each flight as of
/// fly_mission()): of a single experiment into the output folder, of several into a folder each, named after
/// them, and a report.html with all tables. Errors: those of the runs; kCancelled when it is stopped.
Result<ExperimentSummary> run_experiments(std::span<const Experiment> chosen,
                                          const ExperimentOptions& options);

/// experiments[{name, figure, rows[{quantity, published, measured, unit}]}].
JsonValue to_json(const ExperimentSummary& summary);
/// The tables for a terminal.
std::string to_text(const ExperimentSummary& summary);
/// The list of all experiments for a terminal.
std::string experiment_list();

}  // namespace hm
