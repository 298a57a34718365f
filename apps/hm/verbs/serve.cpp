#include "hm/pipeline/serve/serve_run.hpp"

#include <memory>

#include "flags/laser_flags.hpp"
#include "flags/recording_flags.hpp"
#include "output.hpp"
#include "program.hpp"
#include "version.hpp"

namespace {

struct ServeVerbFlags {
  std::string path, listen;
  double voxel_m = 0;
  RecordingFlags of_recording;
  LaserFlags of_laser;
};

hm::Result<Outcome> run(const ServeVerbFlags& flags, Session& session) {
  hm::ServeOptions options;
  options.path = flags.path;
  options.listen = flags.listen;
  hm::ParamList list = hm::list_slam(options.rgbd);
  list.add_missing(hm::list_laser(options.laser));
  if (flags.voxel_m > 0) options.rgbd.tsdf.voxel_size_m = flags.voxel_m;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const auto recording_options = flags.of_recording.options();
  if (!recording_options) return hm::forward_error(recording_options);
  options.recording_options = *recording_options;
  options.laser_options = flags.of_laser.options();
  options.run = session.interruptible_context("closing the page's server");
  options.on_open = [](const hm::LiveStation& station) {
    write_message(station.announcement() + " (Ctrl-C closes it)\n");
  };
  const auto summary = hm::serve(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("the {} was shown for {:.0f} s\n", summary->what, summary->seconds);
  outcome.json = hm::JsonValue::object({{"what", summary->what}, {"seconds", summary->seconds}});
  return outcome;
}

void add_serve(Program& program) {
  auto flags = std::make_shared<ServeVerbFlags>();
  Command command =
      program.add({"serve", "Show a result, a map, a mesh or a recording on a web page, until Ctrl-C.",
                   "  hm serve result\n"
                   "  hm serve result/mesh.ply --listen 8800\n"
                   "  hm serve recording --listen 0.0.0.0:8800",
                   [flags](Session& session) { return run(*flags, session); }});
  command
      .add_option(
          "path", flags->path,
          "folder of results or of a recording, or a file: .hmap .mvog .ply .obj .glb .gltf .stl .off .dae "
          ".fbx .bag .log .alog .dat; a recording is replayed, and the page pauses it, sets its speed "
          "and goes to a place in it")
      .required();
  command.add_option(
      "--listen", flags->listen,
      "PORT, ADDRESS or ADDRESS:PORT; without an address only this machine is served, and an address that "
      "other machines reach needs the token in the link that is printed");
  command.add_option("--voxel", flags->voxel_m, "replays: edge of a voxel in metres (tsdf.voxel_size_m)")
      .above_zero();
  flags->of_recording.add_to(command);
  flags->of_laser.add_to(command);
}

const VerbRegistration kServe(78, add_serve);

}  // namespace
