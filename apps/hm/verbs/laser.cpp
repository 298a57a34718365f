#include <memory>

#include "flags/laser_flags.hpp"
#include "flags/recording_flags.hpp"
#include "flags/serve_flags.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"
#include "program.hpp"

namespace {

struct LaserVerbFlags {
  OutputFlags output;
  std::string recording, relations, saved_map, pace = "fast";
  LaserFlags of_laser;
  RecordingFlags of_recording;  ///< only --force
  ServeFlags serve;
};

hm::Result<Outcome> run(const LaserVerbFlags& flags, Session& session) {
  hm::LaserRunOptions options;
  options.recording = flags.recording;
  options.recording_options = flags.of_laser.options();
  options.output = flags.output.folder(flags.recording, "laser");
  options.existing = flags.output.existing();
  options.relations = flags.relations;
  options.saved_map = flags.saved_map;
  options.force = flags.of_recording.force;
  options.pace = flags.pace == "realtime" ? hm::LaserPace::kRealtime : hm::LaserPace::kFast;
  auto list = hm::list_laser(options.parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  options.run = session.interruptible_context("writing the results so far");
  auto serving = flags.serve.open(
      {.verb = "laser", .name = flags.recording, .report_to_come = options.output / "report.html"}, list,
      options.run);
  if (!serving) return hm::forward_error(serving);
  const auto summary = hm::run_laser(options);
  serving->finish(summary);
  return outcome_with_verdict(summary, flags.output.strict);
}

void add_laser(Program& program) {
  auto flags = std::make_shared<LaserVerbFlags>();
  Command command =
      program.add({"laser", "Estimate trajectory and height from laser scans, and build an occupancy map.",
                   "  hm laser my_flight -o result\n"
                   "  hm laser my_flight -o fine --set mvog.resolution_m=0.05\n"
                   "  hm laser second_flight -o again --localise result\n"
                   "  hm laser my_flight -o live --pace realtime --set laser.duration_s=1 --json",
                   [flags](Session& session) { return run(*flags, session); }});
  command
      .add_option("recording", flags->recording,
                  "laser recording: ROS 1 bag; CARMEN, g2o-like, Wean Hall, MOOS or BreezySLAM log")
      .required();
  flags->output.add_to(command, "NAME_laser");
  flags->output.add_strict_to(command);
  flags->serve.add_to(command);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_laser); });
  command.add_option("--relations", flags->relations,
                     "file with known relative poses to compare with (t1 t2 x y z roll pitch yaw)");
  command.add_option("--localise", flags->saved_map,
                     "localise in the map of an earlier run: its folder, map.yaml or map.mvog");
  command
      .add_option("--pace", flags->pace,
                  "fast (default): as fast as possible; realtime: at the pace of the recording")
      .one_of({"fast", "realtime"});
  flags->of_recording.add_force_to(command);
  flags->of_laser.add_to(command);
}

const VerbRegistration kLaser(70, add_laser);

}  // namespace
