#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_run.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/pipeline/live/live_view.hpp"

namespace hm {

/// Shows a flight while it goes on: the vehicle by its own estimate, scans, the map, fail-safes, battery and
/// ages of the links; nothing that the vehicle does not know. Passes all messages on to another observer.
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
  void on_core_step(std::span<const CoreTraceRecord> records) override { next_.on_core_step(records); }

  /// After every step of the flight; shows 50 of them a second.
  void step(const FlightRun& run);

 private:
  void note_pilot(const FlightMoment& moment);
  [[nodiscard]] LiveVehicle vehicle(const FlightMoment& moment) const;

  LiveView* view_;
  FlightObserver& next_;
  const LaserRunParams& params_;
  std::optional<Time> scan_at_, imu_at_, pose_at_, height_at_, shown_at_;
  std::optional<LaserScan> scan_;  ///< newest, not shown yet
  std::optional<double> height_m_, floor_m_;
  std::uint8_t pilot_ = 0;  ///< who has control, by the answers of the core; 0: nobody
};

}  // namespace hm
