#pragma once
#include <deque>
#include <optional>
#include <vector>

#include "hm/link/time_sync.hpp"
#include "hm/pipeline/flight/flight_messages.hpp"
#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_statistics.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {

/// A pilot's command with its goal in `odom` instead of `map`, for the board: kGoTo and kPath; others as they
/// are.
[[nodiscard]] FlightCommand in_odom(const FlightCommand& command, const SE2& T_map_odom);

/// The vehicle's on-board computer: scans and IMU samples become poses, heights (dissertation 2.2) and
/// distances to obstacles, which it sends to the board, as it does with commands of pilots. It keeps the
/// board's clock by TIMESYNC.
class OnboardComputer {
 public:
  static constexpr Duration kLifePeriod{50'000'000}, kSyncPeriod{100'000'000};
  /// IMU samples and states whose age is not within these bounds have a stamp of a clock that stepped.
  /// A vehicle whose base is so near to where it stands, for so long, stands.
  static constexpr double kStanding_m = 0.05;
  static constexpr Duration kStandingFor{1'000'000'000};
  static constexpr Duration kMostImuAge{100'000'000}, kLeastImuAge{-5'000'000};

  /// `perception`: time from a scan's arrival to its results. `hull_m`: radius of the vehicle.
  OnboardComputer(const LaserParameters& params, const LaserPlatform& platform, Duration perception,
                  double hull_m, FlightObserver* observer);

  void add_scan(const Received<LaserScan>& scan);
  void add(Time now, const DownMessage& message);
  /// Goals of pilots are in `map`; the board gets them in `odom`.
  void add_command(const FlightCommand& command);
  /// Messages to send by now.
  std::vector<UpMessage> take_messages(Time now);
  void finish();

  [[nodiscard]] const LaserPipeline& perception() const { return perception_; }
  /// By the loops closed so far; the identity before.
  [[nodiscard]] const SE2& T_map_odom() const { return T_map_odom_; }
  [[nodiscard]] std::vector<StageCounts> counts() const;
  /// From the last beam of a scan until its pose is sent.
  [[nodiscard]] Summary scan_to_pose_s() const { return scan_to_pose_s_.summary(); }

 private:
  struct Pending {
    Time ready;
    UpMessage message;
  };
  void add_imu(Time now, const ImuSample& sample);
  void add_state(Time now, const StateMessage& state);
  [[nodiscard]] std::optional<Time> on_computer(Time now, Time remote) const;
  void process(Time now);
  void send_obstacles(const Received<LaserScan>& scan);
  void send_results(const LaserStep& step, Time ready);
  void judge_tracking(const LaserStep& step);
  [[nodiscard]] bool stands(const LaserStep& step);
  [[nodiscard]] Time on_board(Time local) const { return sync_.to_remote(local).value_or(local); }

  LaserPipeline perception_;
  LaserRig rig_;
  Duration delay_;
  double hull_m_;
  FlightObserver* observer_;
  TimeSync sync_;
  std::optional<StateMessage> state_;  // the core's newest
  std::deque<Pending> outbox_;
  SE2 T_map_odom_;
  bool tracking_lost_ = false;          // poses no longer continue those before
  std::uint8_t restarts_ = 0;           // how often they went on after that, or jumped
  std::optional<Time> standing_since_;  // on the ground
  std::optional<Time> life_sent_, sync_sent_;
  StageCounts scans_{"perception", 0, 0, 0}, imu_{"imu of the computer", 0, 0, 0};
  RunningSummary scan_to_pose_s_;
  Duration sweep_;
};

}  // namespace hm
