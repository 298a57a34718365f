#include "hm/pipeline/experiments/experiment.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/pipeline/common/map_export.hpp"
#include "hm/pipeline/experiments/laser/flight_experiments.hpp"
#include "hm/pipeline/experiments/laser/grid_experiments.hpp"
#include "hm/pipeline/experiments/laser/laser_map_experiments.hpp"
#include "hm/pipeline/experiments/mobile/alignment_experiment.hpp"
#include "hm/pipeline/experiments/mobile/depth_image_experiment.hpp"
#include "hm/pipeline/experiments/mobile/filter_experiment.hpp"
#include "hm/pipeline/experiments/mobile/integration_experiments.hpp"
#include "hm/pipeline/experiments/mobile/volume_experiments.hpp"
#include "hm/pipeline/experiments/rgbd/compensated_map_experiment.hpp"
#include "hm/pipeline/experiments/rgbd/depth_bias_experiment.hpp"
#include "hm/pipeline/experiments/rgbd/odometry_experiment.hpp"
#include "hm/pipeline/experiments/rgbd/place_rate_experiment.hpp"
#include "hm/pipeline/experiments/rgbd/uncertainty_experiment.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

constexpr std::array kExperiments{
    Experiment{"height", "Fig. 2.5", "height and level of the floor in a flight over flat objects",
               run_height_experiment},
    Experiment{"hover", "Fig. 2.8", "position while hovering for four minutes, published and default control",
               run_hover_experiment},
    Experiment{"waypoints", "Fig. 2.9", "position along way points that vary in x, y and yaw",
               run_way_point_experiment},
    Experiment{"corridor", "Fig. 2.11", "a corridor as the points of all scans", run_corridor_experiment},
    Experiment{"floor-map", "Fig. 2.12", "plan of a floor of a building", run_floor_map_experiment},
    Experiment{"flight-map", "Fig. 2.13, 2.14", "map and path of a flight through a house",
               run_flight_map_experiment},
    Experiment{"grid", "Fig. 2.18 to 2.20, Table 2.1", "multi-volume occupancy grids: stages, plans, size",
               run_grid_experiment},
    Experiment{"hallway-grid", "Fig. 2.21", "multi-volume occupancy grid of a hallway",
               run_hallway_grid_experiment},
    Experiment{"depth-bias", "Fig. 3.2 to 3.7", "depth bias before and after calibration with boards",
               run_depth_bias_experiment},
    Experiment{"uncertainty", "Fig. 3.8", "models of the deviation of depth against the measured deviation",
               run_uncertainty_experiment},
    Experiment{"places", "Fig. 3.11, Table 3.1", "place recognition: matrices, rates for n and k",
               run_place_experiment},
    Experiment{"odometry", "Fig. 3.12 to 3.15, Table 3.2",
               "visual odometry, published and default: paths, sizes, durations, errors",
               run_odometry_experiment},
    Experiment{"large-map", "Fig. 3.16", "map of a house with and without depth compensation",
               run_large_map_experiment},
    Experiment{"depth-images", "Fig. 4.3", "depth images of phone, tablet and Kinect",
               run_depth_image_experiment},
    Experiment{"phone-bias", "Fig. 4.4, 4.5", "depth bias of the phone before and after calibration",
               run_phone_bias_experiment},
    Experiment{"filters", "Fig. 4.9", "convergence of discrete update filters", run_filter_experiment},
    Experiment{"alignment", "Fig. 4.11, 4.12", "paths and maps with and without dense alignment",
               run_alignment_experiment},
    Experiment{"phone-room", "Fig. 4.17", "reconstruction with and without depth compensation",
               run_phone_room_experiment},
    Experiment{"integration", "Fig. 4.19, Table 4.1",
               "reconstruction by traversal and projection, with and "
               "without carving",
               run_integration_experiment},
    Experiment{"desk", "Fig. 4.20", "reconstruction of a desk from a public recording", run_desk_experiment},
    Experiment{"volumes", "Fig. 4.21", "volumes that a scan affects", run_affected_volumes_experiment},
    Experiment{"memory", "Fig. 4.22", "memory of the hashed and of a fixed grid", run_map_memory_experiment},
    Experiment{"scan-times", "Tables 4.2, 4.3", "time of integrating a scan, by method",
               run_scan_time_experiment}};

std::string number_text(double value, const std::string& unit) {
  if (unit.empty()) return fmt::format("{:.0f}", value);  // a count
  return fmt::format(fmt::runtime(std::abs(value) >= 100 ? "{:.0f} {}" : "{:.3g} {}"), value, unit);
}

std::vector<std::vector<std::string>> table_rows(const std::vector<ExperimentRow>& rows) {
  std::vector<std::vector<std::string>> table;
  for (const ExperimentRow& row : rows)
    table.push_back({row.quantity, row.published ? number_text(*row.published, row.unit) : "no number",
                     number_text(row.measured, row.unit)});
  return table;
}

const std::vector<std::string>& table_header() {
  static const std::vector<std::string> header{"", "published", "here"};
  return header;
}

JsonValue to_json(const ExperimentOutcome& outcome) {
  JsonValue rows = JsonValue::array();
  for (const ExperimentRow& row : outcome.rows) {
    JsonValue entry = JsonValue::object({{"quantity", row.quantity}});
    entry["published"] = row.published ? JsonValue(*row.published) : JsonValue();
    entry["measured"] = row.measured;
    entry["unit"] = row.unit;
    rows.push_back(std::move(entry));
  }
  JsonValue json = JsonValue::object(
      {{"name", std::string(outcome.experiment->name)}, {"figure", std::string(outcome.experiment->figure)}});
  json["rows"] = std::move(rows);
  return json;
}

std::string title_of(const Experiment& experiment) {
  return fmt::format("{}: {}", experiment.figure, experiment.content);
}

std::string page_of(const Experiment& experiment, const ExperimentOptions& options,
                    const ExperimentFindings& findings, const std::string& parameters_toml) {
  HtmlReport report(std::string(experiment.name), "Experiment");
  report.set_verdict(HtmlReport::Verdict::kNone, title_of(experiment));
  add_warnings_section(report, findings.warnings);
  report.begin_section("Published and measured",
                       "A figure without a number in the dissertation's text is compared by eye.");
  report.add_table(table_header(), table_rows(findings.rows));
  findings.add_figures(report);
  return page_with_parameters(report, parameters_toml, options.run.program_version);
}

/// Runs one experiment into its folder.
Result<ExperimentOutcome> run_one(const Experiment& experiment, const ExperimentOptions& options,
                                  std::vector<std::filesystem::path>& outputs) {
  auto findings = experiment.run(options);
  if (!findings) return forward_error(findings);
  if (options.run.stop.stop_requested())
    return fail(ErrorCode::kCancelled, {}, "stopped in the experiment {}", experiment.name);
  if (options.tiny) findings->warnings.emplace_back("a tiny experiment: its numbers mean little");
  ExperimentOutcome outcome{&experiment, findings->rows, findings->warnings};
  ExperimentParameters parameters = options.parameters;
  const std::string toml = list_experiments(parameters).to_toml();
  outputs.insert(outputs.end(), findings->outputs.begin(), findings->outputs.end());
  ResultFiles files(options.output, outputs, outcome.warnings);
  files.text("parameters.toml", toml)
      .text("report.json", to_json_text(to_json(outcome)) + "\n")
      .text("report.html", page_of(experiment, options, *findings, toml));
  if (!files.result()) return as_run_failure(Result<ExperimentOutcome>(forward_error(files.result())));
  return outcome;
}

std::string index_page(const ExperimentSummary& summary, const RunContext& run) {
  HtmlReport report("Experiments of the dissertation", "Experiment");
  report.set_verdict(HtmlReport::Verdict::kNone, "Published and measured numbers of all experiments.");
  add_warnings_section(report, summary.warnings);
  for (const ExperimentOutcome& outcome : summary.outcomes) {
    report.begin_section(title_of(*outcome.experiment),
                         fmt::format("Figures: {}/report.html", outcome.experiment->name));
    report.add_table(table_header(), table_rows(outcome.rows));
  }
  if (!run.program_version.empty()) report.set_footer("housemartin " + run.program_version);
  return report.html();
}

Result<void> write_index(ExperimentSummary& summary, const ExperimentOptions& options) {
  std::vector<std::filesystem::path> files;
  for (const ExperimentOutcome& outcome : summary.outcomes)
    files.push_back(options.output / outcome.experiment->name);
  ResultFiles texts(options.output, files, summary.warnings);
  texts.text("report.json", to_json_text(to_json(summary)) + "\n")
      .text("report.html", index_page(summary, options.run));
  summary.outputs = std::move(files);
  return as_run_failure(texts.result());
}

}  // namespace

ParamList list_experiments(ExperimentParameters& parameters) {
  ParamList list = list_flight_mission(parameters.flight);
  list.add("simulation", parameters.simulation);
  list.add("odometry_features", parameters.features);
  return list;
}

std::span<const Experiment> experiments() { return kExperiments; }

const Experiment* find_experiment(std::string_view name) {
  const auto* found = std::ranges::find(kExperiments, name, &Experiment::name);
  return found == kExperiments.end() ? nullptr : found;
}

Result<ExperimentSummary> run_experiments(std::span<const Experiment> chosen,
                                          const ExperimentOptions& options) {
  ExperimentSummary summary;
  for (const Experiment& experiment : chosen) {
    ExperimentOptions one = options;
    if (chosen.size() > 1) {
      one.output = options.output / experiment.name;
      if (const auto made = make_folder(one.output); !made) return forward_error(made);
    }
    auto outcome = run_one(experiment, one, summary.outputs);
    if (!outcome) {
      if (chosen.size() == 1 || outcome.error().code == ErrorCode::kCancelled) return forward_error(outcome);
      summary.warnings.push_back(fmt::format("{} failed: {}", experiment.name, to_string(outcome.error())));
      summary.failed.push_back({&experiment, outcome.error()});
      continue;
    }
    for (const std::string& warning : outcome->warnings)
      summary.warnings.push_back(fmt::format("{}: {}", experiment.name, warning));
    summary.outcomes.push_back(std::move(*outcome));
  }
  if (chosen.size() > 1)
    if (const auto written = write_index(summary, options); !written) return forward_error(written);
  return summary;
}

JsonValue to_json(const ExperimentSummary& summary) {
  JsonValue list = JsonValue::array();
  for (const ExperimentOutcome& outcome : summary.outcomes) list.push_back(to_json(outcome));
  JsonValue json = JsonValue::object();
  json["experiments"] = std::move(list);
  JsonValue failed = JsonValue::array();
  for (const FailedExperiment& one : summary.failed)
    failed.push_back(
        JsonValue::object({{"name", std::string(one.experiment->name)}, {"message", to_string(one.error)}}));
  json["failed"] = std::move(failed);
  return json;
}

std::optional<Error> experiment_failure(const ExperimentSummary& summary) {
  if (summary.failed.empty()) return {};
  std::string names;
  for (const FailedExperiment& one : summary.failed)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", one.experiment->name);
  return Error{ErrorCode::kInternal, fmt::format("failed: {}", names), {}};
}

std::string to_text(const ExperimentSummary& summary) {
  std::string text;
  for (const ExperimentOutcome& outcome : summary.outcomes) {
    text += fmt::format("{}\n{:<62}{:>12}{:>12}\n", title_of(*outcome.experiment), "", "published", "here");
    for (const auto& row : table_rows(outcome.rows))
      text += fmt::format("  {:<60}{:>12}{:>12}\n", row[0], row[1], row[2]);
  }
  return text + output_lines(summary.outputs);
}

std::string experiment_list() {
  std::string text = fmt::format("{:<14}{:<30}{}\n", "NAME", "FIGURE", "CONTENT");
  for (const Experiment& experiment : kExperiments)
    text += fmt::format("{:<14}{:<30}{}\n", experiment.name, experiment.figure, experiment.content);
  return text;
}

}  // namespace hm
