#include <memory>

#include "hm/pipeline/parameters.hpp"
#include "hm/pipeline/simulation_recording.hpp"
#include "program.hpp"

namespace {

struct Flags {
  std::string world = "house", output, sensor;
  int frames = 0, seed = -1;
  bool drift = false, perfect = false;
};

template <class Enum, std::size_t N>
void choose(const std::string& name, const std::string_view (&names)[N], Enum& value) {
  for (std::size_t i = 0; i < N; ++i)
    if (name == names[i]) value = static_cast<Enum>(i);
}

hm::Result<Outcome> run(const Flags& flags, Session& session) {
  hm::Parameters parameters;
  hm::SimulationParams& simulation = parameters.simulation;
  choose(flags.world, hm::kWorldKindNames, simulation.world);
  choose(flags.sensor, hm::kSensorPresetNames, simulation.sensor);
  if (flags.frames > 0) simulation.frame_limit = flags.frames;
  if (flags.seed >= 0) simulation.seed = flags.seed;
  if (flags.drift) simulation.pose_drift = true;
  if (flags.perfect) simulation.effects = hm::SensorEffects::none();
  auto list = hm::list_all(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  hm::SimulationOptions options;
  options.params = simulation;
  options.output = flags.output.empty() ? flags.world + "_recording" : flags.output;
  options.run = session.interruptible_context("what was written is removed");
  const auto summary = hm::simulate_recording(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("{}: {} frames, {:.1f} s, {:.1f} m of path, {:.0f} m2 of surface to be seen\n",
                             options.output.string(), summary->frames, summary->duration_s,
                             summary->path_length_m, summary->truth_area_m2);
  if (summary->end_drift_m > 0)
    outcome.text += fmt::format("the poses drift: {:.3f} m at the end\n", summary->end_drift_m);
  outcome.json = hm::JsonValue::object({{"frames", summary->frames},
                                        {"duration_s", summary->duration_s},
                                        {"path_length_m", summary->path_length_m},
                                        {"end_drift_m", summary->end_drift_m},
                                        {"valid_ratio", summary->valid_ratio},
                                        {"truth_area_m2", summary->truth_area_m2},
                                        {"truth_points", summary->truth_points},
                                        {"seed", simulation.seed}});
  outcome.outputs = summary->outputs;
  return outcome;
}

}  // namespace

void add_simulate(Program& program) {
  auto flags = std::make_shared<Flags>();
  CLI::App& command =
      program.add({"simulate", "Generate a recording with exact truth.",
                   "  hm simulate room -o recording --frames 40\n"
                   "  hm simulate house -o house --sensor kinect --set simulation.frame_stride=30\n"
                   "  hm simulate corridor -o drifting --drift --seed 7 --frames 50",
                   [flags](Session& session) { return run(*flags, session); }});
  command.add_option("world", flags->world, "house, room or corridor (default: house)")
      ->check(CLI::IsMember({"house", "room", "corridor"}));
  command.add_option("-o,--output", flags->output, "folder to write (default: WORLD_recording)");
  command.add_option("--sensor", flags->sensor, "tango_tablet (default), tango_phone or kinect")
      ->check(CLI::IsMember({"tango_tablet", "tango_phone", "kinect"}));
  command.add_option("--frames", flags->frames, "frames at most (default: the whole walk)")
      ->check(CLI::PositiveNumber);
  command.add_option("--seed", flags->seed, "of all random numbers (default: 1)")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--drift", flags->drift, "poses drift like those of a visual-inertial odometry");
  command.add_flag("--perfect", flags->perfect, "a sensor without noise, bias and missing readings");
}
