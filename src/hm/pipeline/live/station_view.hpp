#pragma once
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/pipeline/live/grid_feed.hpp"
#include "hm/pipeline/live/handover.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/live/page_feed.hpp"
#include "hm/pipeline/live/picture_feed.hpp"
#include "hm/pipeline/live/scan_advice.hpp"

namespace hm {

/// Shows a run to the viewers of a station: puts what the run shows into the station's store, as often as
/// people can follow. Called on the thread of the run. Of what comes with each frame that thread copies the
/// raw values, and puts the pose, for which nobody should wait; the rest is made on threads of the view's.
class StationView : public LiveView {
 public:
  /// `store` must outlive it.
  explicit StationView(LiveStore& store);

  void on_mesh(const IncrementalMesher& mesher, std::span<const VolumeKey> updated) override;
  void on_mesh_complete(const IncrementalMesher& mesher) override;
  void on_restart() override;
  void on_camera(const LiveCamera& camera) override;
  void on_vehicle(const LiveVehicle& vehicle) override;
  void on_path(LivePath which, std::span<const Vec3> points_map_m) override;
  void on_scan(LiveScan which, Time stamp, std::span<const Eigen::Vector3f> points_map_m) override;
  void on_plan(LivePlan state, std::span<const Vec3> points_map_m, const std::string& reason) override;
  void on_grid(const MultiVolumeGrid& grid, const SE2& T_map_grid, double bottom_m, double top_m) override;
  void on_numbers(const LiveNumbers& numbers) override;
  void on_count(std::string_view name, double value) override;
  void on_event(LogLevel level, const std::string& text) override;
  void on_parameters(const std::string& toml) override;
  void on_end(const RunVerdict& verdict) override;

  /// The state that telemetry tells: "running", "paused", "finished", "failed"; the latter is an event too.
  /// `reason`: why it failed, for people.
  void set_state(std::string state, std::string reason = {});
  /// Place in a replay: {time_s, begin_s, end_s, speed, paused}.
  void set_replay(JsonValue replay);
  /// Puts what was held back, and waits until all pages are encoded.
  void flush();
  /// A mesh that is not made of a map's volumes, by pages.
  void show_mesh(const TriangleMesh& mesh, double page_voxel_m);

  [[nodiscard]] PageFeed& pages() { return pages_; }

 private:
  using Clock = std::chrono::steady_clock;
  /// At most every `period`.
  class Pace {
   public:
    explicit Pace(std::chrono::milliseconds period) : period_(period) {}
    bool due(Clock::time_point now);

   private:
    Clock::duration period_;
    std::optional<Clock::time_point> last_;
  };
  /// A frame of on_camera(), with a copy of its images where it is their turn.
  struct CameraNote {
    Clock::time_point at;
    Time stamp;
    bool has_frame = false;
    std::optional<SE3> T_map_camera;
    std::string trouble;
    PictureFeed::Place pictures;
  };
  struct Progress {
    std::string stage;
    std::size_t done = 0, total = 0;
  };
  using Named = std::vector<std::pair<std::string, double>>;
  struct Statistics {
    Named stages_ms, counts, memory, rates_hz;
  };
  /// Content that was shown and not yet processed.
  struct Shown {
    std::vector<CameraNote> cameras;
    std::vector<MeshedVolume> volumes;
    Clock::time_point changed_at;  ///< the first of these
    double voxel_size_m = 0;
    std::optional<Progress> progress;
    std::optional<Statistics> statistics;
    Named counts;

    /// More is looked at by who shows it, so that memory is bounded.
    [[nodiscard]] bool is_crowded() const {
      return cameras.size() + counts.size() > 1000 || volumes.size() > 100'000;
    }
  };
  template <class Change>
  void hand_over(Change&& change);
  bool catch_up();
  /// The right to touch what follows, when everything that was shown has been looked at.
  [[nodiscard]] std::unique_lock<std::mutex> caught_up();

  void put_pose(const LiveCamera& camera);
  void show_camera(const CameraNote& camera);
  void note_trouble(const CameraNote& camera);
  void put_json(LiveKind kind, const JsonValue& json);
  void put_telemetry();
  void put_statistics(const Statistics& numbers);
  void extend_path(LivePath which, const Vec3& point_m);
  void put_longer_paths(Clock::time_point now);
  void put_path(LivePath which, std::size_t first_chunk);
  void add_event(LogLevel level, const std::string& text);

  LiveStore& store_;
  PageFeed pages_;
  PictureFeed pictures_;
  GridFeed grid_;
  // Of the run's thread.
  Pace pose_pace_{std::chrono::milliseconds(15)}, picture_pace_{std::chrono::milliseconds(200)},
      statistics_pace_{std::chrono::milliseconds(250)}, scan_pace_{std::chrono::milliseconds(90)},
      grid_pace_{std::chrono::milliseconds(500)};

  std::mutex mutex_;  // guards all of the following
  Shown shown_;       ///< what is being looked at; empty otherwise
  PageChanges changes_;
  double voxel_size_m_ = 0;
  std::optional<FrameLook> look_;
  ScanAdviser adviser_;
  Time now_;  ///< of the run
  std::optional<Time> began_;
  std::map<LivePath, std::vector<Eigen::Vector3f>> paths_;
  std::map<LivePath, std::size_t> chunks_put_;
  std::set<LivePath> longer_paths_;  ///< than what was put
  std::vector<ScanAdvice> advice_;
  std::map<std::string, double> counts_;
  JsonValue progress_, vehicle_, replay_, verdict_;
  std::string state_ = "running", state_reason_;
  bool was_lost_ = false;
  std::optional<Clock::time_point> counted_since_;
  std::size_t frames_counted_ = 0;
  double frames_per_s_ = 0;
  std::vector<std::string> fail_safes_;
  std::string vehicle_state_;
  Pace telemetry_pace_{std::chrono::milliseconds(100)}, path_pace_{std::chrono::milliseconds(200)},
      advice_pace_{std::chrono::milliseconds(100)}, share_pace_{std::chrono::seconds(5)};

  Handover<Shown> handover_;  // ends first
};

}  // namespace hm
