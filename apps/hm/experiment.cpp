#include <memory>
#include <vector>

#include "hm/core/text/nearest_name.hpp"
#include "hm/pipeline/experiments/experiment.hpp"
#include "program.hpp"
#include "version.hpp"

namespace {

struct ExperimentFlags {
  std::string name;
  OutputFlags output;
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

hm::Result<Outcome> run_experiment(const ExperimentFlags& flags, Session& session) {
  if (flags.name == kList) return list_of_experiments();
  const auto experiments = chosen(flags.name);
  if (!experiments) return hm::forward_error(experiments);
  hm::ExperimentOptions options;
  options.tiny = flags.tiny;
  auto list = hm::list_experiments(options.parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  options.run = session.interruptible_context("nothing is written");
  const std::string folder =
      flags.output.folder_given.empty() ? flags.name + "_experiment" : flags.output.folder_given;
  return run_into_folder({folder, flags.output.existing(), "experiment", {}, kVersion},
                         [&](const std::filesystem::path& staging) {
                           options.output = staging;
                           return hm::run_experiments(*experiments, options);
                         });
}

void add_experiment(Program& program) {
  auto flags = std::make_shared<ExperimentFlags>();
  CLI::App& command = program.add(
      {"experiment",
       "Remake a figure of the dissertation, with the published numbers beside the measured ones.",
       "  hm experiment list\n"
       "  hm experiment height -o fig_2_5",
       [flags](Session& session) { return run_experiment(*flags, session); }});
  command.add_option("name", flags->name, "list, all, or a name of the list")->required();
  flags->output.add_to(command, "NAME_experiment");
  command.add_flag("--tiny", flags->tiny, "as short as it can be, to see that it works");
}

const VerbRegistration kExperiment(92, add_experiment);

}  // namespace
