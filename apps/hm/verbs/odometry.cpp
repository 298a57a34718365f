#include <memory>

#include "flags/recording_flags.hpp"
#include "flags/serve_flags.hpp"
#include "hm/pipeline/rgbd/odometry_run.hpp"
#include "program.hpp"

namespace {

struct OdometryFlags {
  std::string recording, method;
  OutputFlags output;
  RecordingFlags of_recording;
  ServeFlags serve;
};

hm::Result<Outcome> run(const OdometryFlags& flags, Session& session) {
  hm::OdometryRunOptions options;
  options.recording = flags.recording;
  options.output = flags.output.folder(flags.recording, "odometry");
  options.existing = flags.output.existing();
  auto list = hm::list_odometry(options.parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  for (std::size_t i = 0; i < hm::kOdometryMethodNames.size(); ++i)
    if (flags.method == hm::kOdometryMethodNames[i])
      options.parameters.odometry.method = static_cast<hm::OdometryMethod>(i);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.recording_options = *recording_options;
  options.force = flags.of_recording.force;
  options.run = session.interruptible_context("writing the results so far");
  auto serving = flags.serve.open(
      {.verb = "odometry", .name = flags.recording, .report_to_come = options.output / "report.html"}, list,
      options.run);
  if (!serving) return hm::forward_error(serving);
  const auto summary = hm::run_odometry(options);
  serving->finish(summary);
  return outcome_with_verdict(summary, flags.output.strict);
}

void add_odometry(Program& program) {
  auto flags = std::make_shared<OdometryFlags>();
  Command command =
      program.add({"odometry", "Estimate the trajectory of the camera from depth and colour images.",
                   "  hm odometry recording -o result\n"
                   "  hm odometry recording -o published --method published_ransac_icp --json\n"
                   "  hm odometry recording -o sparse --set reconstruction.frame_stride=5",
                   [flags](Session& session) { return run(*flags, session); }});
  command.add_option("recording", flags->recording, "folder of a recording (TUM RGB-D, 7-Scenes, ICL-NUIM)")
      .required();
  flags->output.add_to(command, "NAME_odometry");
  flags->output.add_strict_to(command);
  command.add_option("--method", flags->method, "method (odometry.method; default: tracker)")
      .one_of(std::vector<std::string>(hm::kOdometryMethodNames.begin(), hm::kOdometryMethodNames.end()));
  flags->of_recording.add_to(command);
  flags->of_recording.add_force_to(command);
  flags->serve.add_to(command);
}

const VerbRegistration kOdometry(50, add_odometry);

}  // namespace
