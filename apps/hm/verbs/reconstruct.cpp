#include <memory>

#include "flags/recording_flags.hpp"
#include "flags/serve_flags.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "program.hpp"

namespace {

struct ReconstructFlags {
  std::string recording, poses;
  double voxel_m = 0;
  bool align = false, level = false;
  OutputFlags output;
  RecordingFlags of_recording;
  ServeFlags serve;
};

hm::Result<Outcome> run(const ReconstructFlags& flags, Session& session) {
  hm::ReconstructionOptions options;
  options.recording = flags.recording;
  options.output = flags.output.folder(flags.recording, "reconstruction");
  options.existing = flags.output.existing();
  std::error_code code;
  if (flags.output.resume && std::filesystem::exists(options.output / "map.hmap", code)) {
    const auto of_map = hm::parameters_of_map(options.output / "map.hmap");
    if (!of_map) return hm::forward_error(of_map);
    options.parameters = *of_map;
  }
  auto list = hm::list_dense(options.parameters);
  if (flags.align) options.parameters.reconstruction.align = true;
  if (flags.level) options.parameters.reconstruction.level = true;
  if (flags.voxel_m > 0) options.parameters.tsdf.voxel_size_m = flags.voxel_m;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.recording_options = *recording_options;
  options.force = flags.of_recording.force;
  options.poses = flags.poses;
  options.run = session.interruptible_context("writing the results so far");
  auto serving = flags.serve.open(
      {.verb = "reconstruct", .name = flags.recording, .report_to_come = options.output / "report.html"},
      list, options.run);
  if (!serving) return hm::forward_error(serving);
  const auto summary = hm::reconstruct(options);
  serving->finish(summary);
  if (summary && summary->already_complete) {
    auto complete = flags.output.complete_result({options.output, {}, "reconstruct", options.recording, {}});
    if (!complete) return hm::forward_error(complete);
    if (*complete) return std::move(**complete);
  }
  return outcome_with_verdict(summary, flags.output.strict);
}

void add_reconstruct(Program& program) {
  auto flags = std::make_shared<ReconstructFlags>();
  Command command =
      program.add({"reconstruct", "Build a map and a coloured mesh from depth images with poses.",
                   "  hm reconstruct recording -o result\n"
                   "  hm reconstruct recording -o fine --voxel 0.01\n"
                   "  hm reconstruct recording -o result --resume\n"
                   "  hm reconstruct recording -o result --align\n"
                   "  hm reconstruct recording -o near --set tsdf.far_m=3 --json",
                   [flags](Session& session) { return run(*flags, session); }});
  command.add_option("recording", flags->recording, "folder of a recording (TUM RGB-D, 7-Scenes, ICL-NUIM)")
      .required();
  flags->output.add_to(command, "NAME_reconstruction");
  flags->output.add_strict_to(command);
  command.add_option(
      "--poses", flags->poses,
      "trajectory to use instead of the poses of the recording: T_world_camera at the time stamps "
      "of the depth images (TUM, EuRoC), or of every frame (KITTI, Replica, Redwood)");
  command.add_option("--voxel", flags->voxel_m, "edge of a voxel in metres (tsdf.voxel_size_m)").above_zero();
  command.add_flag("--align", flags->align,
                   "correct each pose by aligning its depth image to the map (reconstruction.align)");
  command.add_flag("--level", flags->level,
                   "rotate the poses so that z is up (reconstruction.level); otherwise their frame is kept");
  flags->output.add_resume_to(command, "continue an interrupted run in the same folder, with its parameters");
  flags->of_recording.add_to(command);
  flags->of_recording.add_force_to(command);
  flags->serve.add_to(command);
}

const VerbRegistration kReconstruct(40, add_reconstruct);

}  // namespace
