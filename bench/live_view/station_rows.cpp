// Rows about the live view: bytes of the mesh, what showing a scan costs the processor and the network.
#include <algorithm>
#include <chrono>
#include <numeric>
#include <thread>

#include "dense/scene_frames.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/pipeline/live/station_view.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kRate_hz = 5;

/// The demo's scan: 3 cm voxels, a tablet's depth camera at 5 Hz.
struct LiveScan {
  explicit LiveScan(const BenchOptions& options, int frames) {
    scene.frame_limit = options.frame_limit ? options.frame_limit : frames;
    params.tsdf.voxel_size_m = 0.03;
  }
  SimulationParams scene;
  DenseParams params;
};

LiveCamera seen(const RgbdFrame& frame, const PinholeCamera& camera, const SE3& pose) {
  LiveCamera shown;
  shown.stamp = frame.stamp;
  shown.frame = &frame;
  shown.camera = camera;
  shown.T_map_camera = pose;
  return shown;
}

/// Bytes of everything that changed in the store after a change: what a viewer without delay would get that
/// draws all levels.
std::size_t bytes_after(const LiveStore& store, std::uint64_t& change) {
  std::vector<LiveChange> changes;
  change = store.changes_after(change, changes);
  std::size_t bytes = 0;
  for (const LiveChange& changed : changes) {
    constexpr std::size_t kHeader = 16;
    bytes += kHeader;
    if (changed.slot.kind == LiveKind::kMeshPage)
      bytes += std::accumulate(changed.level_bytes.begin(), changed.level_bytes.end(), std::size_t{0});
    else if (const auto item = store.read(changed.slot); item && item->payload)
      bytes += item->payload->size();
  }
  return bytes;
}

}  // namespace

Result<BenchResult> bench_page_live(const BenchOptions& options) {
  const LiveScan scan(options, 300);
  const Simulation simulation(scan.scene);
  const auto source = simulated_frames(simulation, {0, 1, 40});
  DensePipeline pipeline(scan.params, source->camera(), options.threads);
  LiveStore store;
  StationView view(store);
  pipeline.observe_mesh(&view);
  std::uint64_t change = 0;
  std::size_t bytes = 0, frames = 0;
  double due_s = 0, live_s = 0;
  while (true) {
    const auto chunk = source->next_chunk();  // simulated while nobody waits
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    const Stopwatch watch;
    due_s = 0;
    for (const RgbdFrame& frame : *chunk) {
      const FrameOutcome outcome = pipeline.process(frame);
      view.on_camera(seen(frame, source->camera(), outcome.T_world_camera));
      ++frames;
      due_s += 1 / kRate_hz;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.0, due_s - watch.seconds())));
      bytes += bytes_after(store, change);
    }
    live_s += watch.seconds();
  }
  pipeline.finished_mesh();
  view.flush();
  const PageFeed::Work work = view.pages().work();
  BenchResult result;
  result.rows = {{"page_encode", 100 * work.cpu_s / live_s, {}},
                 {"page_rate", 1e-6 * static_cast<double>(bytes) / live_s, {}}};
  result.details = JsonValue::object({{"frames", frames}, {"live_s", live_s}, {"pages_encoded", work.pages}});
  return result;
}

Result<BenchResult> bench_page_mesh(const BenchOptions& options) {
  const LiveScan scan(options, 0);
  const Simulation simulation(scan.scene);
  const auto source = simulated_frames(simulation, {0, 1, 40});
  DensePipeline pipeline(scan.params, source->camera(), options.threads);
  while (true) {
    const auto chunk = source->next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    for (const RgbdFrame& frame : *chunk) pipeline.process(frame);
  }
  LiveStore store;
  StationView view(store);
  pipeline.observe_mesh(&view);
  pipeline.finished_mesh();
  view.flush();
  const PageFeed::Work work = view.pages().work();
  BenchResult result;
  result.rows = {
      {"page_mesh",
       static_cast<double>(work.bytes) / static_cast<double>(std::max<std::size_t>(work.triangles, 1)),
       {}}};
  result.details = JsonValue::object({{"pages", work.pages},
                                      {"triangles", work.triangles},
                                      {"bytes", work.bytes},
                                      {"encode_s", work.cpu_s}});
  return result;
}

}  // namespace hm::bench
