#include "hm/pipeline/compare/demo.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/folder_lock.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/common/mesh_output.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecordingName = "recording";
constexpr std::size_t kRoomFrames = 100;  // a few seconds of work

/// The walk through the room as the house is scanned, but for its length: a frame every so often.
SimulationParams room_params(const SimulationParams& house) {
  SimulationParams room = house;
  room.world = WorldKind::kRoom;
  room.frame_limit = 0;
  const std::size_t frames = Simulation(room).frame_count();
  room.frame_stride *= std::max(1, static_cast<int>(frames / kRoomFrames));
  room.frame_limit = house.frame_limit;
  return room;
}

/// Scans a room in memory and draws it; no picture when asked to stop.
Result<void> draw_room(const DemoOptions& options, const fs::path& picture) {
  const Stopwatch watch;
  const ParallelLoop loop(options.run.threads);
  const Simulation simulation(room_params(options.simulation));
  DensePipeline pipeline(options.parameters, simulation.camera(), options.run.threads);
  Trajectory trajectory;
  for (std::size_t i = 0; i < simulation.frame_count(); ++i) {
    if (options.run.stop.stop_requested()) return {};
    const RgbdFrame frame = simulation.frame(i, loop);
    if (pipeline.process(frame).integrated)
      trajectory.push_back({simulation.stamp(i), *frame.T_world_camera});
    if (options.run.progress)
      options.run.progress({"scanning a room first", i + 1, simulation.frame_count(), {}});
  }
  const auto drawn =
      make_mesh_figures(pipeline.take_finished_mesh(), figure_options(simulation.camera(), trajectory), loop);
  const auto color =
      std::find_if(drawn.begin(), drawn.end(), [](const Figure& made) { return made.name == "color"; });
  if (color == drawn.end()) return {};
  std::error_code code;
  fs::create_directories(picture.parent_path(), code);
  if (const auto written = write_png(picture, color->image); !written) return as_run_failure(written);
  if (options.run.log)
    options.run.log(
        LogLevel::kInfo,
        fmt::format("first image after {:.1f} s, a room scanned in {}: {}; now the house", watch.seconds(),
                    counted(simulation.frame_count(), "frame"), picture.string()));
  return {};
}

/// The second part: the result of an earlier demo may be replaced, no other.
ReconstructionOptions reconstruction_of(const DemoOptions& options) {
  ReconstructionOptions reconstruction;
  reconstruction.recording = options.output / kRecordingName;
  reconstruction.output = options.output / "result";
  const auto record = read_run_record(reconstruction.output);
  if (record && *record && (*record)->is_of({{}, {}, "reconstruct", reconstruction.recording, {}}))
    reconstruction.existing = ExistingResult::kOverwrite;
  reconstruction.parameters = options.parameters;
  reconstruction.run = options.run;
  return reconstruction;
}

/// The error that reconstruct() would end with after the simulation, where its folder cannot be used.
Result<void> check_result(const ReconstructionOptions& options) {
  const auto folder = ResultFolder::open(
      {options.output, options.existing, "reconstruct", options.recording, options.run.program_version});
  return folder ? Result<void>() : forward_error(folder);
}

}  // namespace

Result<DemoSummary> run_demo(const DemoOptions& options) {
  SimulationOptions simulation{options.simulation, options.output / kRecordingName, options.run};
  if (simulation.params.truth_far_m == 0) simulation.params.truth_far_m = options.parameters.tsdf.far_m;
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  const auto lock = FolderLock::acquire(options.output);  // until the end: the recording is read, too
  if (!lock) return forward_error(lock);
  ReconstructionOptions reconstruction = reconstruction_of(options);
  if (const auto checked = check_result(reconstruction); !checked) return forward_error(checked);
  if (const auto removed = remove_simulation(simulation.output); !removed) return forward_error(removed);
  const fs::path picture = options.output / "first_room.png";
  if (options.parameters.reconstruction.pictures)
    if (const auto drawn = draw_room(options, picture); !drawn) return forward_error(drawn);
  auto simulated = simulate_recording(simulation);
  std::error_code ignored;
  if (!simulated) {
    fs::remove(picture, ignored);
    fs::remove(options.output, ignored);  // if nothing is in it
    return forward_error(simulated);
  }
  if (options.run.stop.stop_requested())
    return fail(ErrorCode::kCancelled, {}, "stopped after the simulation; its recording is in {}",
                simulation.output.string());

  auto summary = reconstruct(reconstruction);
  if (!summary) return forward_error(summary);
  if (fs::exists(picture, ignored)) summary->outputs.push_back(picture);
  return DemoSummary{std::move(*simulated), std::move(*summary)};
}

}  // namespace hm
