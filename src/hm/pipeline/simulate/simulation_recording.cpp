#include "hm/pipeline/simulate/simulation_recording.hpp"

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/rgbd/tum_writer.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"
#include "hm/sim/world/room_scene.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFrameBatch = 16;

ParamList list_of(SimulationParams& params) {
  ParamList list;
  list.add("simulation", params);
  return list;
}

double valid_share(const DepthImage& depth) {
  const auto pixels = depth.units.pixels();
  const auto valid =
      std::count_if(pixels.begin(), pixels.end(), [](std::uint16_t units) { return units != 0; });
  return static_cast<double>(valid) / static_cast<double>(pixels.size());
}

/// Renders frames in batches on all threads while the batch before is written by one of them. Returns
/// the mean share of valid depth pixels.
Result<double> write_frames(const Simulation& simulation, TumWriter& writer, const SimulationOptions& options,
                            const ParallelLoop& loop) {
  const std::size_t count = simulation.frame_count();
  std::vector<RgbdFrame> ready, next;
  double valid = 0;
  for (std::size_t begin = 0; begin < count || !ready.empty(); begin += kFrameBatch) {
    const std::size_t done = std::min(begin, count);
    if (auto go_on = check_not_stopped(options.run.stop, fmt::format("at frame {} of {}", done, count));
        !go_on)
      return forward_error(go_on);
    next.clear();
    next.resize(std::min(kFrameBatch, count - done));
    Result<void> written;
    loop.for_ranges(next.size() + 1, 1, [&](std::size_t item, std::size_t) {
      if (item > 0) {
        next[item - 1] = simulation.frame(begin + item - 1);
        return;
      }
      for (const RgbdFrame& frame : ready)
        if (written = writer.add(frame); !written) return;
    });
    if (!written) return forward_error(written);
    for (const RgbdFrame& frame : next) valid += valid_share(frame.depth);
    ready.swap(next);
    if (options.run.progress) options.run.progress({"simulating", done, count, {}});
  }
  return count > 0 ? valid / static_cast<double>(count) : 0.0;
}

Trajectory trajectory_of(const Simulation& simulation, SE3 (Simulation::*pose)(std::size_t) const) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < simulation.frame_count(); ++i)
    trajectory.push_back({simulation.stamp(i), (simulation.*pose)(i)});
  return trajectory;
}

JsonValue triple(const Vec3& v) { return JsonValue(JsonValue::Array{v.x(), v.y(), v.z()}); }

std::string room_scene_json() {
  JsonValue solids = JsonValue::array();
  for (const RoomPrimitive& primitive : room_primitives()) {
    JsonValue solid = JsonValue::object({{"name", primitive.name},
                                         {"shape", to_string(primitive.shape)},
                                         {"center_m", triple(primitive.center)}});
    if (primitive.shape == RoomShape::kSphere)
      solid["radius_m"] = primitive.half_m.x();
    else
      solid["half_size_m"] = triple(primitive.half_m);
    if (primitive.shape == RoomShape::kShell) solid["wall_m"] = kRoomWall_m;
    if (primitive.shape == RoomShape::kBox) solid["yaw_rad"] = primitive.yaw_rad;
    solids.push_back(std::move(solid));
  }
  return to_json_text(
      JsonValue::object({{"scene", "room"}, {"frame", "world"}, {"solids", std::move(solids)}}));
}

/// The truth beside the recording; each file is added to the outputs.
Result<void> write_truth(const Simulation& simulation, const fs::path& folder, const ParallelLoop& loop,
                         SimulationSummary& summary) {
  TriangleMesh mesh = merged_mesh(simulation.world());
  if (auto written = write_mesh(folder / "truth_mesh.ply", mesh); !written) return written;
  summary.outputs.push_back(folder / "truth_mesh.ply");

  SurfacePoints visible = simulation.visible_truth(loop);
  TriangleMesh points;
  points.vertices = std::move(visible.positions);
  points.normals = std::move(visible.normals);
  const double spacing_m = simulation.params().truth_spacing_m;
  summary.truth_points = points.vertices.size();
  summary.truth_area_m2 = static_cast<double>(summary.truth_points) * spacing_m * spacing_m;
  if (auto written = write_mesh(folder / "truth_visible.ply", points); !written) return written;
  summary.outputs.push_back(folder / "truth_visible.ply");

  if (simulation.params().world != WorldKind::kRoom) return {};
  if (auto written = write_file_text(folder / "truth_scene.json", room_scene_json() + "\n"); !written)
    return written;
  summary.outputs.push_back(folder / "truth_scene.json");
  return {};
}

/// The sizes of the recording's flaws, if it has some.
Result<void> write_flaws(const Simulation& simulation, const fs::path& folder, SimulationSummary& summary) {
  summary.flaws = simulation.flaws();
  if (summary.flaws.flaws.is_empty()) return {};
  ParamList list;
  list.add("flaws", summary.flaws);
  if (auto written = write_file_text(folder / kFlawsFile, list.to_toml()); !written) return written;
  summary.outputs.push_back(folder / kFlawsFile);
  return {};
}

/// Everything but the mark that it is finished.
Result<SimulationSummary> write_all(const Simulation& simulation, TumWriter& writer,
                                    const SimulationOptions& options) {
  const ParallelLoop loop(options.run.threads);
  const fs::path& folder = options.output;
  const bool drifts = simulation.has_reported_poses();
  const auto valid = write_frames(simulation, writer, options, loop);
  if (!valid) return forward_error(valid);
  const Trajectory truth = trajectory_of(simulation, &Simulation::true_pose);
  const Trajectory reported = trajectory_of(simulation, &Simulation::reported_pose);
  writer.set_ground_truth(truth);
  if (drifts) writer.set_device_poses(reported);
  writer.set_imu(simulation.imu(), R_camera_tablet_imu());
  if (auto finished = writer.finish(); !finished) return forward_error(finished);

  SimulationSummary summary;
  summary.frames = simulation.frame_count();
  summary.duration_s = (truth.back().stamp - truth.front().stamp).seconds();
  summary.path_length_m = path_length(truth);
  summary.end_drift_m =
      (truth.back().T_world_base.translation() - reported.back().T_world_base.translation()).norm();
  summary.valid_ratio = *valid;
  summary.outputs = {folder, folder / "groundtruth.txt"};
  if (drifts) summary.outputs.push_back(folder / "poses.txt");
  if (auto written = write_flaws(simulation, folder, summary); !written) return forward_error(written);
  if (options.run.progress) options.run.progress({"finding what can be seen of the truth", 0, 0, {}});
  if (auto written = write_truth(simulation, folder, loop, summary); !written) return forward_error(written);
  if (auto go_on = check_not_stopped(options.run.stop, "after its last frame"); !go_on)
    return forward_error(go_on);
  return summary;
}

}  // namespace

Result<SimulationSummary> simulate_recording(const SimulationOptions& options) {
  SimulationParams params = options.params;
  const ParamList list = list_of(params);
  if (auto checked = list.check(); !checked) return forward_error(checked);
  if (auto flaws = Flaws::parse(params.flaws); !flaws) return forward_error(flaws);
  const Stopwatch watch;
  const auto folder = SimulationFolder::acquire(options.output);
  if (!folder) return forward_error(folder);
  const Simulation simulation(params);
  auto writer =
      as_run_failure(TumWriter::create(options.output, simulation.camera(), 1.0 / kSimulatedDepthUnit_m));
  if (!writer) return forward_error(writer);
  if (const auto marked = folder->mark(list.to_toml()); !marked) return forward_error(marked);
  auto summary = folder->finish(as_run_failure(write_all(simulation, *writer, options)));
  if (summary) summary->wall_s = watch.seconds();
  return summary;
}

}  // namespace hm
