#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/params.hpp"
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// The sections of what experiments start from: those of list_flight_mission(), simulation,
/// odometry_features.
ParamList list_experiments(ExperimentParameters& parameters);

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

/// An experiment that could not be finished.
struct FailedExperiment {
  const Experiment* experiment = nullptr;
  Error error;
};

struct ExperimentSummary {
  std::vector<ExperimentOutcome> outcomes;
  std::vector<FailedExperiment> failed;
  std::vector<std::string> warnings;  ///< of all, each after its experiment's name
  std::vector<std::filesystem::path> outputs;
};

/// Runs experiments and writes, for each, report.html (the figure remade, the published numbers beside the
/// measured ones), report.json, parameters.toml and what the experiment leaves besides (each flight as of
/// fly_mission()): of a single experiment into the output folder, of several into a folder each, named after
/// them, and a report.html with all tables. Where one of several fails, the others are run all the same, and
/// it is named in `failed`. Errors: that of a single run; kCancelled when it is stopped.
Result<ExperimentSummary> run_experiments(std::span<const Experiment> chosen,
                                          const ExperimentOptions& options);

/// experiments[{name, figure, rows[{quantity, published, measured, unit}]}], failed[{name, message}].
JsonValue to_json(const ExperimentSummary& summary);
/// The tables for a terminal.
std::string to_text(const ExperimentSummary& summary);
/// The failure of a run in which experiments failed, with their names; nothing otherwise.
std::optional<Error> experiment_failure(const ExperimentSummary& summary);
/// The list of all experiments for a terminal.
std::string experiment_list();

}  // namespace hm
