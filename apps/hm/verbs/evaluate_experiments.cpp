#include <memory>

#include "flags/recording_flags.hpp"
#include "hm/pipeline/experiments/rgbd/depth_compensation.hpp"
#include "hm/pipeline/experiments/rgbd/uncertainty_experiment.hpp"
#include "program.hpp"
#include "version.hpp"

namespace {

struct RecordingEvaluationFlags {
  std::string recording;
  OutputFlags output;
  double voxel_m = 0;
  int frames = 0, views = 0;
  RecordingFlags of_recording;
};

hm::ResultFolderRequest folder_request(const RecordingEvaluationFlags& flags, const std::string& word,
                                       const std::string& by_default) {
  return {flags.output.folder_given.empty() ? by_default : flags.output.folder_given, flags.output.existing(),
          "evaluate " + word, flags.recording, kVersion};
}

hm::Result<Outcome> run_compensation(const RecordingEvaluationFlags& flags, Session& session) {
  hm::DepthCompensationOptions options;
  options.recording = flags.recording;
  auto list = hm::list_slam(options.parameters);
  options.parameters.tsdf.voxel_size_m = 0.03;
  options.parameters.slam.points_voxel_m = 0.03;
  options.parameters.slam.map_top_m = 2.2;  // below ceilings, so that one sees into the rooms
  if (flags.voxel_m > 0) options.parameters.tsdf.voxel_size_m = flags.voxel_m;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.recording_options = *recording_options;
  options.run = session.interruptible_context("nothing is written");
  return run_into_folder(folder_request(flags, "depth-compensation", "compared"),
                         [&](const std::filesystem::path& folder) {
                           options.output = folder;
                           return hm::compare_depth_compensation(options);
                         });
}

hm::Result<Outcome> run_uncertainty(const RecordingEvaluationFlags& flags, Session& session) {
  hm::SimulationParams simulation;
  hm::FeatureParams features;
  hm::ParamList list;
  list.add("simulation", simulation);
  list.add("odometry_features", features);
  simulation.sensor = hm::SensorPreset::kKinect;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  hm::UncertaintyExperimentParams params;
  if (flags.frames > 0) params.frames = flags.frames;
  if (flags.views > 0) params.views = flags.views;
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  const hm::RunContext run = session.interruptible_context("nothing is written");
  auto folder = hm::ResultFolder::open(folder_request(flags, "uncertainty", "deviations"));
  if (!folder) return hm::forward_error(folder);
  const auto result = flags.recording.empty() ? hm::simulate_uncertainty(simulation, features, params, run)
                                              : hm::record_uncertainty(flags.recording, *recording_options,
                                                                       features, params, run);
  if (!result) return hm::forward_error(result);
  auto outputs = hm::write_uncertainty(*result, folder->staging(), run);
  if (!outputs) return hm::forward_error(outputs);
  if (const auto published = folder->publish(*outputs, hm::RunState::kComplete); !published)
    return hm::forward_error(published);
  return Outcome{hm::to_text(*result), hm::to_json(*result), result->warnings, std::move(*outputs)};
}

void add_uncertainty(Program& program) {
  auto flags = std::make_shared<RecordingEvaluationFlags>();
  Command command =
      program.add({"evaluate uncertainty",
                   "Compare depth noise models with the noise measured over many frames of a static scene.",
                   "  hm evaluate uncertainty -o simulated\n"
                   "  hm evaluate uncertainty recording -o deviations --frames 100 --json",
                   [flags](Session& session) { return run_uncertainty(*flags, session); }});
  command.add_option(
      "recording", flags->recording,
      "folder of a recording in which neither camera nor scene moves (default: a simulated Kinect at five "
      "places of a house; section simulation)");
  flags->output.add_to(command, "deviations");
  command.add_option("--frames", flags->frames, "frames at each place (default: 300)").within(10, 100000);
  command.add_option("--views", flags->views, "places in the simulation (default: 5)").within(1, 1000);
  flags->of_recording.add_to(command);
}

void add_experiments(Program& program) {
  add_uncertainty(program);
  auto flags = std::make_shared<RecordingEvaluationFlags>();
  Command compensation = program.add(
      {"evaluate depth-compensation",
       "Build a map with and without the depth correction of a calibration, and compare them.",
       "  hm simulate calibration -o phone_boards --sensor tango_phone\n"
       "  hm calibrate depth phone_boards/depth --calibration phone_boards/truth -o phone\n"
       "  hm simulate house -o phone_walk --sensor tango_phone\n"
       "  hm evaluate depth-compensation phone_walk --calibration phone/calibration.toml -o compared",
       [flags](Session& session) { return run_compensation(*flags, session); }});
  compensation.add_option("recording", flags->recording, "folder of a recording with poses").required();
  flags->output.add_to(compensation, "compared");
  compensation.add_option("--voxel", flags->voxel_m, "edge of a voxel in metres (default here: 0.03)")
      .above_zero();
  flags->of_recording.add_to(compensation);
}

const VerbRegistration kExperiments(91, add_experiments);

}  // namespace
