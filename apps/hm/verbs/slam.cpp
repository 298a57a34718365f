#include <memory>

#include "flags/recording_flags.hpp"
#include "flags/serve_flags.hpp"
#include "hm/pipeline/rgbd/slam_run.hpp"
#include "program.hpp"

namespace {

struct SlamFlags {
  std::string recording, maps, continued;
  double voxel_m = 0;
  OutputFlags output;
  RecordingFlags of_recording;
  ServeFlags serve;
};

hm::Result<Outcome> run(const SlamFlags& flags, Session& session) {
  hm::SlamRunOptions options;
  options.recording = flags.recording;
  options.output = flags.output.folder(flags.recording, "slam");
  options.existing = flags.output.existing();
  options.continued = flags.continued;
  if (flags.output.resume) {
    auto complete = flags.output.complete_result({options.output, {}, "slam", options.recording, {}});
    if (!complete) return hm::forward_error(complete);
    if (*complete) return std::move(**complete);
    const auto read = read_saved_parameters(options.output, hm::list_slam(options.parameters));
    if (!read) return hm::forward_error(read);
  }
  auto list = hm::list_slam(options.parameters);
  if (flags.voxel_m > 0) options.parameters.tsdf.voxel_size_m = flags.voxel_m;
  if (!flags.maps.empty()) options.parameters.slam.maps = flags.maps;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.recording_options = *recording_options;
  options.force = flags.of_recording.force;
  options.run = session.interruptible_context("writing the results so far");
  auto serving = flags.serve.open(
      {.verb = "slam", .name = flags.recording, .report_to_come = options.output / "report.html"}, list,
      options.run);
  if (!serving) return hm::forward_error(serving);
  const auto summary = hm::run_slam(options);
  serving->finish(summary);
  return outcome_with_verdict(summary, flags.output.strict);
}

void add_slam(Program& program) {
  auto flags = std::make_shared<SlamFlags>();
  Command command = program.add(
      {"slam", "Estimate the trajectory from depth and colour images, close loops and build the map.",
       "  hm slam recording -o result\n"
       "  hm slam recording -o fine --voxel 0.01\n"
       "  hm slam recording -o result --resume\n"
       "  hm slam recording -o both --continue result\n"
       "  hm slam recording -o maps --maps points,octomap,mvog --set slam.map_top_m=2 --json",
       [flags](Session& session) { return run(*flags, session); }});
  command.add_option("recording", flags->recording, "folder of a recording (TUM RGB-D, 7-Scenes, ICL-NUIM)")
      .required();
  flags->output.add_to(command, "NAME_slam");
  flags->output.add_strict_to(command);
  flags->output.add_resume_to(
      command,
      "continue an interrupted run in the same folder where its last save stood, with its parameters");
  command.add_option(
      "--continue", flags->continued,
      "go on in the map of this earlier result, which is only read: it must be recognised (exit code 1)");
  command.add_option("--voxel", flags->voxel_m, "edge of a voxel in metres (tsdf.voxel_size_m)").above_zero();
  command.add_option(
      "--maps", flags->maps,
      "maps to write besides the mesh, separated by commas: points, octomap, mvog (slam.maps)");
  flags->of_recording.add_to(command);
  flags->of_recording.add_force_to(command);
  flags->serve.add_to(command);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_slam); });
}

const VerbRegistration kSlam(60, add_slam);

}  // namespace
