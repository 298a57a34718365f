#include "hm/pipeline/serve/serve_run.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include "hm/core/params.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/map_store.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/pipeline/common/mvog_file.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/pipeline/inspect/file_check.hpp"
#include "hm/pipeline/laser/run/laser_run_view.hpp"
#include "hm/pipeline/serve/replay.hpp"
#include "hm/pipeline/serve/replay_subjects.hpp"
#include "hm/pipeline/serve/result_numbers.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

constexpr double kWait_s = 0.05;
/// A mesh without a map is divided into pages as if it had voxels of this size.
constexpr double kMeshVoxel_m = 0.02;

using Path = std::filesystem::path;

bool is_there(const Path& path) {
  std::error_code code;
  return std::filesystem::exists(path, code);
}

/// The first of these files in a folder.
std::optional<Path> first_of(const Path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (is_there(folder / name)) return folder / name;
  return std::nullopt;
}

Result<void> show_map(const Path& path, const RunContext& run, StationView& view) {
  auto file = MapFile::open(path, MapOpenMode::kRead);
  if (!file) return forward_error(file);
  if (run.progress) run.progress({"reading the map", 0, 0, {}});
  const auto grid = load_grid(*file);
  if (!grid) return forward_error(grid);
  const ParallelLoop loop(run.threads);
  IncrementalMesher mesher(MeshParams{}, loop);
  mesher.mark_all(*grid);
  view.on_mesh(mesher, mesher.update(*grid).updated);
  view.on_mesh_complete(mesher);
  return {};
}

Result<void> show_mesh_file(const Path& path, StationView& view) {
  const auto mesh = read_mesh(path);
  if (!mesh) return forward_error(mesh);
  if (mesh->triangles.empty()) return fail(ErrorCode::kNotFound, path.string(), "this mesh has no triangles");
  view.show_mesh(*mesh, kMeshVoxel_m);
  return {};
}

Result<void> show_occupancy(const Path& path, const LaserRunParams& params, StationView& view) {
  const auto grid = read_mvog(path);
  if (!grid) return forward_error(grid);
  show_grid(view, *grid, {}, params, is_planar(*grid));
  view.flush();  // it copies while the grid is there
  return {};
}

void show_trajectory(const Path& path, StationView& view) {
  const auto trajectory = read_trajectory(path);
  if (!trajectory) return view.on_event(LogLevel::kWarning, to_string(trajectory.error()));
  std::vector<Vec3> points;
  for (const StampedPose& pose : *trajectory) points.push_back(pose.T_world_base.translation());
  view.on_path(LivePath::kTrajectory, points);
}

/// As LiveNumbers, which refer to the names.
LiveNumbers::Named names_of(const ResultNumbers::Named& named) { return {named.begin(), named.end()}; }

/// Numbers of what is finished; besides, the view shows what it knows itself.
void show_numbers(const ResultNumbers& result, StationView& view) {
  LiveNumbers numbers;
  numbers.stages_ms = names_of(result.stages_ms);
  numbers.counts = names_of(result.counts);
  numbers.memory = names_of(result.memory);
  numbers.rates_hz = names_of(result.rates_hz);
  view.on_numbers(numbers);
}

/// The parameters that a result was made with, where they stand beside it.
void show_parameters(const Path& path, StationView& view) {
  const auto bytes = read_file_bytes(path, kMaxTomlBytes);
  if (!bytes) return;
  view.on_parameters({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

/// Shows the verdict of the run and its numbers, where its report has them.
void show_report(const Path& report, StationView& view) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 26;
  const auto bytes = read_file_bytes(report, kMostBytes);
  if (!bytes) return;
  const auto json =
      parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, report.string());
  if (!json) return view.on_event(LogLevel::kWarning, to_string(json.error()));
  if (json->find("verdict")) view.on_end(verdict_of_report(*json));
  show_numbers(numbers_of_report(*json), view);
}

/// A folder of results: its map or mesh, its occupancy map, its path, its verdict.
Result<void> show_result(const ServeOptions& options, StationView& view) {
  const auto map = first_of(options.path, {"map.hmap"});
  const auto mesh = first_of(options.path, {"mesh.ply", "mesh.glb", "mesh.obj"});
  const auto occupancy = first_of(options.path, {"map.mvog"});
  if (!map && !mesh && !occupancy)
    return fail(ErrorCode::kNotFound, options.path.string(), "this result has no map and no mesh to show");
  if (map) {
    if (const auto shown = show_map(*map, options.run, view); !shown) return shown;
  } else if (mesh) {
    if (const auto shown = show_mesh_file(*mesh, view); !shown) return shown;
  }
  if (occupancy)
    if (const auto shown = show_occupancy(*occupancy, options.laser.laser.run, view); !shown) return shown;
  if (const auto path = first_of(options.path, {"trajectory.tum", "trajectory.txt"}))
    show_trajectory(*path, view);
  show_parameters(options.path / "parameters.toml", view);
  show_report(options.path / "report.json", view);
  return {};
}

void wait_until_stopped(const RunContext& run) {
  while (!run.stop.stop_requested()) std::this_thread::sleep_for(std::chrono::duration<double>(kWait_s));
}

void play(Replay& replay, const RunContext& run, StationView& view) {
  constexpr double kShown_s = 0.1;
  Stopwatch since_shown;
  bool was_at_end = false;
  view.set_replay(replay.state());
  while (!run.stop.stop_requested()) {
    replay.step(kWait_s);
    if (replay.at_end() != was_at_end) {
      was_at_end = replay.at_end();
      view.set_replay(replay.state());
      view.set_state(was_at_end ? "finished" : "running");
    }
    if (since_shown.seconds() < kShown_s) continue;
    since_shown.restart();
    view.set_replay(replay.state());
  }
}

class Server {
 public:
  explicit Server(const ServeOptions& options) : options_(options) {}

  Result<void> open(bool replays, const Path& report = {}) {
    LiveStationOptions station{.verb = "serve", .name = options_.path.string(), .listen = options_.listen};
    station.program_version = options_.run.program_version;
    station.report = report;
    if (replays)
      station.replay = [this](const ReplayRequest& request) {
        if (Replay* replay = replay_) replay->request(request);
      };
    auto opened = LiveStation::open(station);
    if (!opened) return forward_error(opened);
    station_ = std::move(*opened);
    return {};
  }
  [[nodiscard]] StationView& view() { return station_->view(); }

  /// Shows what is in place until it is stopped.
  void stay() {
    view().flush();
    view().set_state("finished");
    if (options_.on_open) options_.on_open(*station_);
    wait_until_stopped(options_.run);
  }

  void replay(ReplaySubject& subject) {
    Replay replay(subject);
    replay_ = &replay;
    if (options_.on_open) options_.on_open(*station_);
    play(replay, options_.run, view());
    replay_ = nullptr;
    station_.reset();  // before what the view was shown
  }

 private:
  const ServeOptions& options_;
  std::atomic<Replay*> replay_ = nullptr;
  std::unique_ptr<LiveStation> station_;
};

/// A map tells itself what it was made with.
Result<void> show_map_alone(const ServeOptions& options, StationView& view) {
  if (auto parameters = parameters_of_map(options.path))
    view.on_parameters(list_dense(*parameters).to_toml());
  return show_map(options.path, options.run, view);
}

Result<void> serve_file(const ServeOptions& options, Server& server, const std::string& what) {
  const Path report = what == "result" ? options.path / "report.html" : Path();
  if (const auto opened = server.open(false, is_there(report) ? report : Path()); !opened) return opened;
  Result<void> shown;
  if (what == "result") shown = show_result(options, server.view());
  if (what == "map") shown = show_map_alone(options, server.view());
  if (what == "mesh") shown = show_mesh_file(options.path, server.view());
  if (what == "occupancy map") shown = show_occupancy(options.path, options.laser.laser.run, server.view());
  if (!shown) return shown;
  if (what != "result") show_numbers({}, server.view());
  server.stay();
  return {};
}

Result<void> serve_recording(const ServeOptions& options, Server& server) {
  const auto recording = open_recording(options.path, options.recording_options);
  if (!recording) return forward_error(recording);
  if (const auto opened = server.open(true); !opened) return opened;
  RunContext run = options.run;
  run.view = &server.view();
  DenseParameters dense;
  static_cast<DenseParams&>(dense) = options.rgbd;
  RgbdParameters rgbd = options.rgbd;
  const bool has_poses = (*recording)->info().posed_count > 0;
  run.view->on_parameters((has_poses ? list_dense(dense) : list_slam(rgbd)).to_toml());
  const auto subject = has_poses ? replay_of_poses(**recording, dense, run)
                                 : replay_of_tracking(**recording, options.rgbd, run);
  server.replay(*subject);
  return {};
}

Result<void> serve_laser(const ServeOptions& options, Server& server) {
  auto recording = open_laser_recording(options.path, options.laser_options);
  if (!recording) return forward_error(recording);
  std::erase_if(recording->lasers, [](const LaserStream& stream) { return stream.scans.empty(); });
  if (recording->lasers.empty())
    return fail(ErrorCode::kNotFound, options.path.string(), "the recording holds no laser scan");
  if (const auto opened = server.open(true); !opened) return opened;
  RunContext run = options.run;
  run.view = &server.view();
  LaserRunParameters parameters = options.laser;
  run.view->on_parameters(list_laser(parameters).to_toml());
  const auto subject = replay_of_laser(*recording, options.laser, run);
  server.replay(*subject);
  return {};
}

std::string name_of(PathKind kind) {
  switch (kind) {
    case PathKind::kRecording:
    case PathKind::kLaserRecording:
      return "recording";
    case PathKind::kResult:
      return "result";
    case PathKind::kMap:
      return "map";
    case PathKind::kMesh:
      return "mesh";
    case PathKind::kOccupancy:
      return "occupancy map";
    case PathKind::kTrajectory:
    case PathKind::kPoseGraph:
      break;
  }
  return {};
}

}  // namespace

Result<ServeSummary> serve(const ServeOptions& options) {
  const auto kind = kind_of(options.path);
  if (!kind) return forward_error(kind);
  const std::string what = name_of(*kind);
  if (what.empty())
    return fail(ErrorCode::kUnsupported, options.path.string(),
                "a trajectory alone is nothing to show; give the result or the recording that it belongs to");
  const Stopwatch watch;
  Server server(options);
  const auto served = *kind == PathKind::kRecording        ? serve_recording(options, server)
                      : *kind == PathKind::kLaserRecording ? serve_laser(options, server)
                                                           : serve_file(options, server, what);
  if (!served) return forward_error(served);
  return ServeSummary{what, watch.seconds()};
}

}  // namespace hm
