#include "hm/pipeline/compare/demo.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/common/mesh_output.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

Result<DemoSummary> run_demo(const DemoOptions& options) {
  SimulationOptions simulation{options.simulation, options.output / "recording", options.run};
  if (simulation.params.truth_far_m == 0) simulation.params.truth_far_m = options.parameters.tsdf.far_m;
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  remove_simulation(simulation.output);  // what an earlier demo left
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

  ReconstructionOptions reconstruction;
  reconstruction.recording = simulation.output;
  reconstruction.output = options.output / "result";
  const auto record = read_run_record(reconstruction.output);  // of an earlier demo
  if (record && *record && (*record)->is_of({{}, {}, "reconstruct", simulation.output, {}}))
    reconstruction.existing = ExistingResult::kOverwrite;
  reconstruction.parameters = options.parameters;
  reconstruction.run = options.run;
  auto summary = reconstruct(reconstruction);
  if (!summary) return forward_error(summary);
  if (fs::exists(picture, ignored)) summary->outputs.push_back(picture);
  return DemoSummary{std::move(*simulated), std::move(*summary)};
}

}  // namespace hm
