#pragma once
#include <deque>
#include <memory>
#include <vector>

#include "hm/flight/trace/core_recorder.hpp"
#include "hm/pipeline/flight/flight_core.hpp"
#include "hm/pipeline/flight/flight_messages.hpp"
#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_statistics.hpp"

namespace hm {

/// Readings of the board's own pins in a step.
struct BoardReadings {
  Time now;                      ///< of its loop, which no clock steps
  Duration clock_step;           ///< of its clock, which stamps messages, against the loop
  std::optional<ImuSample> imu;  ///< stamped with the clock
  bool motors_on = false;
  std::optional<float> battery_ratio;
};

/// The vehicle's board: gathers what arrived into the inputs of the core, one measurement of a kind a step,
/// steps the core, and answers the on-board computer.
class FlightBoard {
 public:
  /// Distances to the ground count for so long.
  static constexpr Duration kClearanceValid{200'000'000};
  /// Distances of obstacles count for so long after their scan, and above this speed (m/s): a vehicle that
  /// hovers flies towards nothing.
  static constexpr Duration kObstaclesValid{200'000'000};
  static constexpr float kLeastSpeed_m_s = 0.1F;
  /// Measurements that wait for their step; more are dropped, oldest first.
  static constexpr std::size_t kWaiting = 8;

  FlightBoard(std::unique_ptr<FlightCore> core, double imu_down_hz, FlightObserver* observer);

  void receive(Time now, const UpMessage& message);
  /// One step of the core.
  const AutopilotOutputs& step(const BoardReadings& readings);
  std::vector<DownMessage> take_messages() { return std::exchange(outbox_, {}); }
  /// Answer to the command of the last step.
  [[nodiscard]] const std::optional<CommandAnswer>& answer() const { return answer_; }
  [[nodiscard]] const FlightCore& core() const { return *core_; }
  [[nodiscard]] std::vector<StageCounts> counts() const;
  /// Age of a pose at the step that uses it, and from the last beam of its scan until then.
  [[nodiscard]] Summary pose_age_s() const { return pose_age_s_.summary(); }
  [[nodiscard]] Summary scan_to_core_s() const { return scan_to_core_s_.summary(); }

 private:
  [[nodiscard]] AutopilotInputs gather(const BoardReadings& readings);
  [[nodiscard]] std::optional<float> obstacle_ahead_m(Time now) const;
  void pass_on(const BoardReadings& readings);

  std::unique_ptr<FlightCore> core_;
  FlightObserver* observer_;
  CoreRecorder recorder_;
  std::deque<Received<PoseMessage>> poses_;
  std::deque<Received<HeightMessage>> heights_;
  std::deque<FlightCommand> commands_;
  std::vector<TimeQuestion> questions_;
  bool heard_ = false;  ///< anything of the computer since the last step
  std::optional<Received<HeightMessage>> clearance_;
  std::optional<ObstacleMessage> obstacles_;  ///< stamped with the clock
  std::vector<DownMessage> outbox_;
  std::optional<CommandAnswer> answer_;
  AutopilotOutputs outputs_;
  int imu_period_ = 5;
  std::vector<ImuSample> imu_;  ///< since the last one that was passed on
  StageCounts measured_{"measurements of the core", 0, 0, 0}, commanded_{"commands", 0, 0, 0};
  RunningSummary pose_age_s_, scan_to_core_s_;
};

}  // namespace hm
