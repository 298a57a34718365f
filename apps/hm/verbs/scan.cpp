#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "flags/recording_flags.hpp"
#include "flags/serve_flags.hpp"
#include "hm/cameras/camera_driver.hpp"
#include "hm/pipeline/scan/scan_run.hpp"
#include "program.hpp"

namespace {

struct ScanFlags {
  std::string camera;
  bool list = false;
  double voxel_m = 0, duration_s = 0, speed = 1, unplug_s = 0;
  OutputFlags output;
  RecordingFlags of_camera;
  ServeFlags serve;
};

Outcome list_of_cameras() {
  Outcome outcome;
  auto all = hm::JsonValue::array();
  for (const hm::CameraListing& camera : hm::list_cameras()) {
    outcome.text += fmt::format("{:9} {}{}{}\n", camera.driver, camera.state,
                                camera.devices.empty() ? "" : ": ", fmt::join(camera.devices, " "));
    all.push_back(hm::JsonValue::object({{"driver", camera.driver},
                                         {"built", camera.is_built},
                                         {"devices", hm::JsonValue::array_of(camera.devices)},
                                         {"state", camera.state}}));
  }
  outcome.json["cameras"] = std::move(all);
  return outcome;
}

hm::Result<hm::CameraRequest> camera_request(const ScanFlags& flags) {
  const auto options = flags.of_camera.options();
  if (!options) return hm::forward_error(options);
  hm::CameraRequest request;
  request.camera = flags.camera;
  request.calibration = options->calibration;
  request.intrinsics = options->camera;
  if (request.intrinsics && request.intrinsics->width == 0)
    request.intrinsics->width = 640, request.intrinsics->height = 480;
  request.depth_units_per_m = options->depth_units_per_m;
  request.replay_speed = flags.speed;
  if (flags.unplug_s > 0) request.replay_unplug_s = flags.unplug_s;
  return request;
}

hm::Result<Outcome> run(const ScanFlags& flags, Session& session) {
  if (flags.list) return list_of_cameras();
  if (flags.camera.empty())
    return hm::fail(hm::ErrorCode::kUsage, "hm scan", "needs --camera; --list shows the cameras there are");
  hm::ScanOptions options;
  const auto request = camera_request(flags);
  if (!request) return hm::forward_error(request);
  options.camera = *request;
  options.output = flags.output.folder("camera", "scan");
  options.existing = flags.output.existing();
  auto list = hm::list_slam(options.parameters);
  if (flags.output.resume)
    if (const auto read = read_saved_parameters(options.output, list); !read) return hm::forward_error(read);
  if (flags.voxel_m > 0) options.parameters.tsdf.voxel_size_m = flags.voxel_m;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  if (flags.duration_s > 0) options.duration_s = flags.duration_s;
  options.run = session.interruptible_context("finishing with what there is");
  options.live_threads =
      session.are_threads_given() ? options.run.threads : std::max(1, options.run.threads - 1);
  auto serving = flags.serve.open(
      {.verb = "scan", .name = flags.camera, .report_to_come = options.output / "report.html"}, list,
      options.run);
  if (!serving) return hm::forward_error(serving);
  const auto scanned = hm::run_scan(options);
  const bool worked = scanned && !scanned->failure;
  serving->finish(worked,
                  worked ? std::string() : hm::to_string(scanned ? *scanned->failure : scanned.error()));
  auto outcome = outcome_of(scanned);
  if (!outcome) return outcome;
  outcome->failure = scanned->failure;
  if (!outcome->failure && flags.output.strict) outcome->failure = hm::strict_failure(scanned->slam->verdict);
  return outcome;
}

void add_scan(Program& program) {
  auto flags = std::make_shared<ScanFlags>();
  Command command =
      program.add({"scan", "Scan with a depth camera that is plugged in: track, map and record, all live.",
                   "  hm scan --list\n"
                   "  hm scan --camera replay:recording -o again --speed 2\n"
                   "  hm scan --camera replay:recording -o again --speed 2 --resume",
                   [flags](Session& session) { return run(*flags, session); }});
  command.add_option("--camera", flags->camera,
                     "openni, freenect, v4l2 (each also with :DEVICE), or replay:RECORDING");
  command.add_flag("--list", flags->list, "list the cameras that this program can use, and those it sees");
  flags->output.add_to(command, "camera_scan");
  flags->output.add_strict_to(command);
  flags->output.add_resume_to(command,
                              "continue the recording and the map of an earlier scan in the same folder");
  command.add_option("--voxel", flags->voxel_m, "edge of a voxel in metres (tsdf.voxel_size_m)").above_zero();
  command.add_option("--seconds", flags->duration_s, "end the scan after this time (default: until Ctrl-C)")
      .above_zero();
  command.add_option("--speed", flags->speed, "pace of a replay, times that of its recording (default: 1)")
      .above_zero();
  command
      .add_option("--unplug-after", flags->unplug_s,
                  "a replay fails after so many seconds, as if its camera had been unplugged")
      .above_zero();
  flags->of_camera.add_camera_to(command);
  flags->serve.add_to(command);
}

const VerbRegistration kScan(65, add_scan);

}  // namespace
