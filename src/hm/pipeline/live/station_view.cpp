#include "hm/pipeline/live/station_view.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/process_memory.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/mesh/pages/mesh_page.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

constexpr std::size_t kPathChunk = 512;  // points of a frame
/// A path grows by a point when the sensor has moved so far.
constexpr double kPathStep_m = 0.02;
/// Memory of more volumes is not kept for the next ones: they come when a thread was held up, at any time.
constexpr std::size_t kKeptVolumes = 1024;

std::uint64_t path_slot(LivePath which, std::size_t chunk) {
  return static_cast<std::uint64_t>(which) << 32U | chunk;
}

JsonValue vector_json(const Vec3& v) { return JsonValue::array_of(std::vector<double>{v.x(), v.y(), v.z()}); }

template <class Named>
JsonValue object_of(const Named& named) {
  JsonValue json = JsonValue::object();
  for (const auto& [name, value] : named) json[name] = value;
  return json;
}

std::string_view text_of(AdviceLevel level) {
  constexpr std::string_view kNames[] = {"ok", "warning", "bad"};
  return kNames[static_cast<std::size_t>(level)];
}

PoseFrame pose_frame(const SE3& T_map_sensor, double sigma_m) {
  PoseFrame frame;
  frame.position_m = T_map_sensor.translation();
  frame.orientation = Eigen::Quaternionf(T_map_sensor.rotation().cast<float>());
  if (sigma_m > 0) frame.deviation_m = static_cast<float>(sigma_m);
  return frame;
}

}  // namespace

bool StationView::Pace::due(Clock::time_point now) {
  if (last_ && now - *last_ < period_) return false;
  last_ = now;
  return true;
}

StationView::StationView(LiveStore& store)
    : store_(store), pages_(store), pictures_(store), grid_(store), handover_([this] {
        const std::lock_guard lock(mutex_);
        return catch_up();
      }) {}

template <class Change>
void StationView::hand_over(Change&& change) {
  bool is_crowded = false;
  handover_.give([&](Shown& shown) {
    change(shown);
    is_crowded = shown.is_crowded();
  });
  if (is_crowded) static_cast<void>(caught_up());
}

std::unique_lock<std::mutex> StationView::caught_up() {
  std::unique_lock lock(mutex_);
  catch_up();
  return lock;
}

/// Looks at what was shown; false: there was nothing, and nothing will be due later.
bool StationView::catch_up() {
  handover_.take(shown_);
  const bool is_empty =
      shown_.cameras.empty() && shown_.volumes.empty() && shown_.counts.empty() && !shown_.progress;
  for (const CameraNote& camera : shown_.cameras) show_camera(camera);
  if (shown_.progress)
    progress_ = JsonValue::object({{"stage", shown_.progress->stage},
                                   {"done", static_cast<std::int64_t>(shown_.progress->done)},
                                   {"total", static_cast<std::int64_t>(shown_.progress->total)}});
  for (auto& [name, value] : shown_.counts) counts_[name] = value;
  if (shown_.statistics) put_statistics(*shown_.statistics);
  if (!shown_.volumes.empty()) {
    voxel_size_m_ = shown_.voxel_size_m;
    changes_.note(shown_.volumes, shown_.changed_at);
  }
  shown_.cameras.clear();
  shown_.volumes.clear();
  if (shown_.volumes.capacity() > kKeptVolumes) shown_.volumes.shrink_to_fit();
  shown_.counts.clear();
  shown_.progress.reset();
  shown_.statistics.reset();
  pages_.give(changes_.take_due(voxel_size_m_, Clock::now()), now_);
  return !is_empty || changes_.waiting() > 0;
}

void StationView::put_json(LiveKind kind, const JsonValue& json) {
  store_.put(kind, 0, now_, text_bytes(to_json_text(json, JsonStyle::kCompact)));
}

void StationView::on_mesh(const IncrementalMesher& mesher, std::span<const VolumeKey> updated) {
  hand_over([&, now = Clock::now()](Shown& shown) {
    if (shown.volumes.empty()) shown.changed_at = now;
    shown.voxel_size_m = mesher.voxel_size_m();
    append_updates(mesher, updated, shown.volumes);
  });
}

void StationView::on_mesh_complete(const IncrementalMesher& mesher) {
  const auto lock = caught_up();
  pages_.give(changes_.take_all(mesher.voxel_size_m()), now_);
}

void StationView::show_mesh(const TriangleMesh& mesh, double page_voxel_m) {
  for (MeshPagePart& part : divide_into_pages(mesh, page_voxel_m))
    pages_.give(part.key, std::move(part.mesh), page_voxel_m);
}

void StationView::on_restart() {
  const auto lock = caught_up();
  pages_.give(changes_.clear(Clock::now()), now_);
  grid_.forget();
  adviser_ = {};
  advice_.clear();
  for (auto& [which, path] : paths_) path.clear();
  for (const auto& [which, path] : paths_) put_path(which, 0);
}

void StationView::on_camera(const LiveCamera& camera) {
  CameraNote note{Clock::now(),        camera.stamp,   camera.frame != nullptr,
                  camera.T_map_camera, camera.trouble, {}};
  if (camera.T_map_camera && pose_pace_.due(note.at)) put_pose(camera);
  if (camera.frame && picture_pace_.due(note.at)) note.pictures = pictures_.copy(*camera.frame);
  hand_over([&](Shown& shown) { shown.cameras.push_back(std::move(note)); });
}

void StationView::put_pose(const LiveCamera& camera) {
  PoseFrame frame = pose_frame(*camera.T_map_camera, camera.sigma_m);
  frame.half_width_rad = static_cast<float>(std::atan(0.5 * camera.camera.width / camera.camera.fx));
  frame.half_height_rad =
      static_cast<float>(std::atan(0.5 * camera.camera.height / std::abs(camera.camera.fy)));
  store_.put(LiveKind::kPose, 0, camera.stamp, to_payload(frame));
}

void StationView::show_camera(const CameraNote& camera) {
  if (camera.has_frame) now_ = camera.stamp;
  if (!began_) began_ = now_;
  ++frames_counted_;
  note_trouble(camera);
  if (camera.pictures) {
    look_ = look_at(camera.pictures->depth, camera.pictures->color);
    pictures_.give(camera.pictures);
  }
  if (advice_pace_.due(camera.at) || !camera.T_map_camera)
    advice_ = adviser_.advise({camera.stamp, camera.T_map_camera, camera.trouble, camera.has_frame, look_});
  if (camera.T_map_camera) extend_path(LivePath::kTrajectory, camera.T_map_camera->translation());
  put_longer_paths(camera.at);
  if (telemetry_pace_.due(camera.at)) put_telemetry();
}

/// Says when tracking is lost and found again.
void StationView::note_trouble(const CameraNote& camera) {
  const bool is_lost = !camera.T_map_camera;
  if (is_lost != was_lost_)
    add_event(is_lost ? LogLevel::kWarning : LogLevel::kInfo,
              is_lost ? "lost: " + camera.trouble : std::string("the pose is known again"));
  was_lost_ = is_lost;
}

void StationView::on_vehicle(const LiveVehicle& vehicle) {
  const auto lock = caught_up();
  now_ = vehicle.stamp;
  if (!began_) began_ = now_;
  const auto now = Clock::now();
  ++frames_counted_;
  extend_path(LivePath::kTrajectory, vehicle.T_map_base.translation());
  if (vehicle.true_position_m) extend_path(LivePath::kTruth, *vehicle.true_position_m);
  put_longer_paths(now);
  if (pose_pace_.due(now)) {
    PoseFrame frame = pose_frame(vehicle.T_map_base, vehicle.sigma_m);
    frame.which = PoseFrame::Which::kVehicle;
    store_.put(LiveKind::kPose, 1, now_, to_payload(frame));
  }
  for (const std::string& words : vehicle.fail_safes)
    if (std::find(fail_safes_.begin(), fail_safes_.end(), words) == fail_safes_.end())
      add_event(LogLevel::kWarning, words);
  fail_safes_ = vehicle.fail_safes;
  if (vehicle.state != vehicle_state_ && !vehicle.state.empty())
    add_event(LogLevel::kInfo, "vehicle: " + vehicle.state);
  vehicle_state_ = vehicle.state;
  if (!telemetry_pace_.due(now)) return;
  vehicle_ = JsonValue::object({{"state", vehicle.state},
                                {"phase", vehicle.phase},
                                {"armed", vehicle.armed},
                                {"speed_m_s", vehicle.velocity_m_s.norm()},
                                {"velocity_m_s", vector_json(vehicle.velocity_m_s)},
                                {"links", object_of(vehicle.links_s)},
                                {"fail_safes", JsonValue::array_of(vehicle.fail_safes)}});
  if (!vehicle.pilot.empty()) vehicle_["pilot"] = vehicle.pilot;
  if (vehicle.battery_ratio) vehicle_["battery"] = *vehicle.battery_ratio;
  if (vehicle.height_m) vehicle_["height_m"] = *vehicle.height_m;
  if (vehicle.floor_m) vehicle_["floor_m"] = *vehicle.floor_m;
  put_telemetry();
}

void StationView::extend_path(LivePath which, const Vec3& point_m) {
  auto& path = paths_[which];
  const Eigen::Vector3f point = point_m.cast<float>();
  if (!path.empty() && (path.back() - point).norm() < static_cast<float>(kPathStep_m)) return;
  path.push_back(point);
  longer_paths_.insert(which);
}

void StationView::put_longer_paths(Clock::time_point now) {
  if (longer_paths_.empty()) return;
  if (path_pace_.due(now)) {
    for (const LivePath which : longer_paths_) put_path(which, chunks_put_[which]);
    longer_paths_.clear();
  }
  if (share_pace_.due(now)) pages_.seen().count(paths_[LivePath::kTrajectory]);
}

void StationView::on_path(LivePath which, std::span<const Vec3> points_map_m) {
  const auto lock = caught_up();
  auto& path = paths_[which];
  path.clear();
  for (const Vec3& point : points_map_m) path.push_back(point.cast<float>());
  put_path(which, 0);
}

/// Puts the chunks from `first_chunk` on, and takes back those beyond the path's end.
void StationView::put_path(LivePath which, std::size_t first_chunk) {
  const auto& path = paths_[which];
  const std::size_t chunks = (path.size() + kPathChunk - 1) / kPathChunk;
  std::size_t& put = chunks_put_[which];
  for (std::size_t chunk = std::min(first_chunk, chunks == 0 ? 0 : chunks - 1); chunk < chunks; ++chunk) {
    PathFrame frame;
    frame.which = static_cast<PathFrame::Which>(which);
    frame.first = static_cast<std::uint32_t>(chunk * kPathChunk);
    frame.total = static_cast<std::uint32_t>(path.size());
    const std::size_t end = std::min(path.size(), (chunk + 1) * kPathChunk);
    frame.points_m.assign(path.begin() + static_cast<std::ptrdiff_t>(frame.first),
                          path.begin() + static_cast<std::ptrdiff_t>(end));
    store_.put(LiveKind::kPath, path_slot(which, chunk), now_, to_payload(frame));
  }
  for (std::size_t chunk = chunks; chunk <= put; ++chunk)
    store_.remove(LiveKind::kPath, path_slot(which, chunk));
  put = chunks == 0 ? 0 : chunks - 1;
}

void StationView::on_scan(LiveScan which, Time stamp, std::span<const Eigen::Vector3f> points_map_m) {
  if (which == LiveScan::kLaser && !scan_pace_.due(Clock::now())) return;
  ScanFrame frame;
  frame.which = static_cast<ScanFrame::Which>(which);
  frame.points_m.assign(points_map_m.begin(), points_map_m.end());
  store_.put(LiveKind::kScan, static_cast<std::uint64_t>(which), stamp, to_payload(frame));
}

void StationView::on_plan(LivePlan state, std::span<const Vec3> points_map_m, const std::string& reason) {
  PlanFrame frame;
  frame.state = static_cast<PlanFrame::State>(state);
  frame.reason = reason;
  for (const Vec3& point : points_map_m) frame.points_m.push_back(point.cast<float>());
  const auto lock = caught_up();
  store_.put(LiveKind::kPlan, 0, now_, to_payload(frame));
}

void StationView::on_grid(const MultiVolumeGrid& grid, const SE2& T_map_grid, double bottom_m, double top_m) {
  if (!grid_pace_.due(Clock::now())) return;
  const auto lock = caught_up();
  grid_.give(grid, T_map_grid, {bottom_m, top_m}, now_);
}

void StationView::on_numbers(const LiveNumbers& numbers) {
  const bool is_last = numbers.total > 0 && numbers.done == numbers.total;
  std::optional<Statistics> statistics;
  if (statistics_pace_.due(Clock::now()) || is_last) {
    const auto copy = [](const LiveNumbers::Named& named) { return Named(named.begin(), named.end()); };
    statistics = {copy(numbers.stages_ms), copy(numbers.counts), copy(numbers.memory),
                  copy(numbers.rates_hz)};
  }
  hand_over([&](Shown& shown) {
    shown.progress = {std::string(numbers.stage), numbers.done, numbers.total};
    if (statistics) shown.statistics = std::move(statistics);
  });
}

void StationView::on_count(std::string_view name, double value) {
  hand_over([&](Shown& shown) { shown.counts.emplace_back(name, value); });
}

void StationView::put_statistics(const Statistics& numbers) {
  const auto now = Clock::now();
  if (counted_since_) {
    const double seconds = std::chrono::duration<double>(now - *counted_since_).count();
    if (seconds > 0) frames_per_s_ = static_cast<double>(frames_counted_) / seconds;
  }
  counted_since_ = now;
  frames_counted_ = 0;
  const PageFeed::Work work = pages_.work();
  JsonValue memory = object_of(numbers.memory);
  memory["process"] = static_cast<double>(resident_bytes());
  JsonValue counts = object_of(numbers.counts);
  for (const auto& [name, value] : counts_) counts[name] = value;
  JsonValue rates = JsonValue::object({{"frames", frames_per_s_}});
  for (const auto& [name, value] : numbers.rates_hz) rates[name] = value;
  counts["pages"] = static_cast<std::int64_t>(work.pages);
  JsonValue json = JsonValue::object({{"time_s", began_ ? (now_ - *began_).seconds() : 0.0},
                                      {"stages", object_of(numbers.stages_ms)},
                                      {"rates", rates},
                                      {"counts", counts},
                                      {"memory", memory}});
  put_json(LiveKind::kStatistics, json);
}

/// In a frame of their own: they are too long to be sent with all numbers.
void StationView::on_parameters(const std::string& toml) {
  const auto lock = caught_up();
  const JsonValue json = JsonValue::object({{"parameters", toml}});
  store_.put(LiveKind::kStatistics, kParametersSlot, now_,
             text_bytes(to_json_text(json, JsonStyle::kCompact)));
}

void StationView::put_telemetry() {
  JsonValue words = JsonValue::array();
  for (const ScanAdvice& advice : advice_)
    words.push_back(JsonValue::object(
        {{"level", std::string(text_of(advice.level))}, {"text", advice.text}, {"number", advice.number}}));
  JsonValue json = JsonValue::object({{"state", state_}, {"progress", progress_}, {"words", words}});
  if (!state_reason_.empty()) json["reason"] = state_reason_;
  if (const double area_m2 = pages_.area_m2(); area_m2 > 0)
    json["coverage"] = JsonValue::object({{"area_m2", area_m2}});
  if (const auto share = pages_.seen().share()) json["coverage"]["share"] = *share;
  if (!vehicle_.is_null()) json["vehicle"] = vehicle_;
  if (!replay_.is_null()) json["replay"] = replay_;
  if (!verdict_.is_null()) json["verdict"] = verdict_;
  put_json(LiveKind::kTelemetry, json);
}

void StationView::on_event(LogLevel level, const std::string& text) {
  const auto lock = caught_up();
  add_event(level, text);
}

void StationView::add_event(LogLevel level, const std::string& text) {
  store_.add_event(now_, level == LogLevel::kWarning ? "warning" : "info", text);
}

void StationView::on_end(const RunVerdict& verdict) {
  const auto lock = caught_up();
  verdict_ = JsonValue::object({{"verdict", std::string(to_string(verdict.value))},
                                {"reasons", JsonValue::array_of(verdict.reasons)}});
  advice_.clear();
  add_event(verdict.value == MapVerdict::kOk ? LogLevel::kInfo : LogLevel::kWarning,
            verdict_sentence(verdict, "the run has ended"));
  put_path(LivePath::kTrajectory, 0);
  put_telemetry();
}

void StationView::set_state(std::string state, std::string reason) {
  const auto lock = caught_up();
  state_ = std::move(state);
  state_reason_ = std::move(reason);
  if (state_ == "failed")
    store_.add_event(now_, "error", state_reason_.empty() ? "failed" : "failed: " + state_reason_);
  put_telemetry();
}

void StationView::set_replay(JsonValue replay) {
  const auto lock = caught_up();
  replay_ = std::move(replay);
  put_telemetry();
}

void StationView::flush() {
  auto lock = caught_up();
  for (const auto& [which, path] : paths_) put_path(which, 0);
  const auto path = paths_[LivePath::kTrajectory];
  lock.unlock();
  pages_.wait();
  pages_.seen().count(path);
  pages_.seen().wait();
  grid_.wait();
  lock.lock();
  put_telemetry();
}

}  // namespace hm
