#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_run.hpp"
#include "hm/pipeline/flight/script_pilot.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/pipeline/live/live_view.hpp"

namespace hm {

/// Shows a flight while it goes on: the vehicle by its own estimate, scans, the map, fail-safes and obstacles
/// that brake it, battery, ages of the links, and the numbers of the run. Nothing that the vehicle does not
/// know, but for the true path, which is marked as such. Passes all messages on to another observer.
class FlightView : public FlightObserver {
 public:
  /// `view` (may be null) and `next` must outlive it.
  FlightView(LiveView* view, FlightObserver& next, const LaserRunParams& params)
      : view_(view), next_(next), params_(params) {}

  void on_scan(const Received<LaserScan>& scan) override;
  void on_imu(const Received<ImuSample>& sample) override;
  void on_laser_step(const LaserStep& step) override;
  void on_pose(const Received<PoseMessage>& pose) override;
  void on_height(const Received<HeightMessage>& height) override;
  void on_obstacles(const Received<ObstacleMessage>& obstacles) override;
  void on_core_step(std::span<const CoreTraceRecord> records) override { next_.on_core_step(records); }

  /// After every step of the flight; shows 50 of them a second.
  void step(const FlightRun& run);
  /// Shows the places that a script visits, in `map`.
  void show_way_points(std::span<const OrderRecord> orders);

 private:
  void note_pilot(const FlightMoment& moment);
  [[nodiscard]] LiveVehicle vehicle(const FlightMoment& moment) const;
  void note_obstacles(const FlightMoment& moment);
  void show_numbers(const FlightRun& run);

  LiveView* view_;
  FlightObserver& next_;
  const LaserRunParams& params_;
  std::optional<Time> scan_at_, imu_at_, pose_at_, height_at_, shown_at_;
  std::optional<LaserScan> scan_;             ///< newest, not shown yet
  std::optional<ObstacleMessage> obstacles_;  ///< newest; nothing once they were used
  bool obstacles_shown_ = false;
  std::optional<Time> numbers_at_;
  LiveNumbers::Named stages_ms_;          ///< of the newest scan
  std::vector<StageCounts> counts_then_;  ///< at numbers_at_
  std::size_t orders_shown_ = 0;
  std::optional<double> height_m_, floor_m_;
  std::uint8_t pilot_ = 0;  ///< who has control, by the answers of the core; 0: nobody
};

}  // namespace hm
