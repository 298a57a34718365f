#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "hm/core/text/nearest_name.hpp"
#include "hm/pipeline/experiments/experiment.hpp"
#include "program.hpp"
#include "version.hpp"

namespace {

struct ExperimentFlags {
  std::string name;
  OutputFlags output;
  std::string data;
  bool tiny = false;
};

constexpr const char* kAll = "all";
constexpr const char* kList = "list";

Outcome list_of_experiments() {
  Outcome outcome;
  outcome.text = hm::experiment_list();
  auto list = hm::JsonValue::array();
  for (const hm::Experiment& experiment : hm::experiments())
    list.push_back(hm::JsonValue::object({{"name", std::string(experiment.name)},
                                          {"figure", std::string(experiment.figure)},
                                          {"content", std::string(experiment.content)}}));
  outcome.json["experiments"] = std::move(list);
  return outcome;
}

hm::Result<std::vector<hm::Experiment>> chosen(const std::string& name) {
  const auto all = hm::experiments();
  if (name == kAll) return std::vector<hm::Experiment>(all.begin(), all.end());
  if (const hm::Experiment* found = hm::find_experiment(name)) return std::vector<hm::Experiment>{*found};
  std::vector<std::string_view> names{kAll, kList};
  for (const hm::Experiment& experiment : all) names.push_back(experiment.name);
  const auto nearest = hm::nearest_name(name, names);
  return hm::fail(hm::ErrorCode::kUsage, {}, "'{}' is no experiment{} (hm experiment list)", name,
                  nearest ? fmt::format("; did you mean '{}'?", *nearest) : "");
}

/// The folder of recordings that was named, $HM_DATA, or ../shared/data; empty: there is none.
hm::Result<std::filesystem::path> data_folder(const std::string& named) {
  std::error_code code;
  if (!named.empty() && !std::filesystem::is_directory(named, code))
    return hm::fail(hm::ErrorCode::kUsage, named, "--data: is no folder");
  if (!named.empty()) return named;
  if (const char* given = std::getenv("HM_DATA")) return given;
  const std::filesystem::path beside = "../shared/data";
  return std::filesystem::is_directory(beside, code) ? beside : std::filesystem::path();
}

hm::Result<Outcome> run_experiment(const ExperimentFlags& flags, Session& session) {
  hm::ExperimentOptions options;
  auto list = hm::list_experiments(options.parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  if (flags.name == kList) return list_of_experiments();
  const auto experiments = chosen(flags.name);
  if (!experiments) return hm::forward_error(experiments);
  options.tiny = flags.tiny;
  const auto data = data_folder(flags.data);
  if (!data) return hm::forward_error(data);
  options.data = *data;
  options.run = session.interruptible_context("nothing is written");
  const std::string folder =
      flags.output.folder_given.empty() ? flags.name + "_experiment" : flags.output.folder_given;
  std::optional<hm::Error> failure;
  auto outcome = run_into_folder({folder, flags.output.existing(), "experiment", {}, kVersion},
                                 [&](const std::filesystem::path& staging) {
                                   options.output = staging;
                                   auto summary = hm::run_experiments(*experiments, options);
                                   if (summary) failure = hm::experiment_failure(*summary);
                                   return summary;
                                 });
  if (outcome) outcome->failure = failure;
  return outcome;
}

void add_experiment(Program& program) {
  auto flags = std::make_shared<ExperimentFlags>();
  Command command = program.add(
      {"experiment",
       "Remake figures and tables of the dissertation, with the published numbers beside the measured ones.",
       "  hm experiment list\n"
       "  hm experiment height -o fig_2_5\n"
       "  hm experiment all -o experiments",
       [flags](Session& session) { return run_experiment(*flags, session); }});
  command.add_option("name", flags->name, "list, all, or a name of the list").required();
  flags->output.add_to(command, "NAME_experiment");
  command.add_option("--data", flags->data,
                     "folder of recordings (default: $HM_DATA, else ../shared/data); what is not in it is "
                     "simulated");
  command.add_flag("--tiny", flags->tiny, "as short as it can be, to see that it works");
}

const VerbRegistration kExperiment(92, add_experiment);

}  // namespace
