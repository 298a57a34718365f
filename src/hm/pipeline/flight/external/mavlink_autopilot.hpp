#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hm/estimation/alpha_beta.hpp"
#include "hm/link/mavlink_peer.hpp"
#include "hm/link/status_text.hpp"
#include "hm/pipeline/flight/external/offboard_pilot.hpp"
#include "hm/pipeline/flight/flight_core.hpp"

namespace hm {

struct MavlinkAutopilotSetup {
  CommandParams commands;
  float takeoff_height_m = 1.3F;
  float max_rotor_speed_rad_s = 838;  ///< at a control of 1
  /// Time on the clock of the wall for the answer to a message of sensors; an autopilot that does not wait
  /// for sensors needs none.
  Duration answer_limit{20'000'000};
  /// Unanswered messages in a row after which it has failed.
  int most_unanswered = 500;
  /// Signs what is sent, and accepts only what is signed with it.
  std::optional<MavlinkKey> key;
};

/// A vehicle of the simulation under an autopilot of others (PX4, ArduPilot) behind MAVLink. As companion
/// computer it sends poses of the perception (ODOMETRY), set-points and commands with repetition, answers
/// and asks TIMESYNC; as simulation it sends the IMU (HIL_SENSOR, mean of 4 ms, BODY_FRD) and takes
/// HIL_ACTUATOR_CONTROLS, in lock-step if the autopilot answers each. Controls 0 to 3 are the rotors front,
/// left, back, right as shares of the full speed. The autopilot's world is AutopilotWorld::kLocalFrd and
/// equals `odom`, as it takes position and heading from ODOMETRY. Its estimate is what it sends
/// (LOCAL_POSITION_NED, ATTITUDE). The vehicle's IMU must stand in its base.
class MavlinkAutopilot : public FlightCore {
 public:
  static constexpr int kSensorSteps = 4;  ///< steps of 1 ms for one message of the IMU
  static constexpr Duration kSetPointPeriod{50'000'000};
  /// Estimates of the autopilot that are older do not count.
  static constexpr Duration kEstimateValid{500'000'000};
  /// A second of estimates, and of set-points before offboard mode is asked for (PX4).
  static constexpr Duration kReadyAfter{1'200'000'000};
  /// Between two SET_GPS_GLOBAL_ORIGIN to an ArduPilot that does not estimate a position yet.
  static constexpr Duration kOriginPeriod{1'000'000'000};
  /// Number of its texts that are kept.
  static constexpr std::size_t kMostTexts = 1000;

  MavlinkAutopilot(std::unique_ptr<Transport> transport, const MavlinkAutopilotSetup& setup = {});

  void note_restarts(std::uint8_t restarts) override { restarts_ = restarts; }
  AutopilotOutputs step(const AutopilotInputs& inputs) override;
  [[nodiscard]] BasicVehicleState<float> estimate() const override { return view_.estimate; }
  /// The way that does not answer any more; nothing while it does.
  [[nodiscard]] std::optional<Error> failure() const override { return failure_; }
  /// STATUSTEXT of the autopilot, and which commands it refused.
  [[nodiscard]] std::span<const CoreText> texts() const override { return texts_; }
  [[nodiscard]] const MavlinkPeer& peer() const { return peer_; }
  /// Commands that were not accepted, or never answered.
  [[nodiscard]] std::uint64_t refused_commands() const { return refused_commands_; }

 private:
  void take_pose(const PoseReading<float>& pose);
  void exchange();
  void receive(const MavlinkFrame& frame);
  void follow_autopilot();
  void send_origin(const MavlinkRemote& autopilot);
  void note(bool is_warning, std::string text);
  void send_commands();
  void send_set_point();
  [[nodiscard]] AutopilotOutputs outputs(Refusal refusal, bool motors_on) const;

  std::unique_ptr<Transport> transport_;
  MavlinkAutopilotSetup setup_;
  MavlinkPeer peer_;
  OffboardPilot pilot_;
  OffboardView view_;
  std::optional<Time> boot_, position_at_, attitude_at_, estimated_since_, set_point_at_;
  std::optional<BasicHeightReading<float>> height_;
  std::uint8_t restarts_ = 0, sent_restarts_ = 0;
  AlphaBetaPosition path_;
  Vec3 force_sum_ = Vec3::Zero(), rates_sum_ = Vec3::Zero();
  int samples_ = 0, steps_ = 0;
  bool answered_ = false, command_runs_ = false, asked_for_streams_ = false;
  std::uint16_t sent_command_ = 0;
  int unanswered_ = 0;
  std::uint64_t refused_commands_ = 0;
  std::array<float, 4> controls_{};
  std::optional<Error> failure_;
  std::optional<Time> origin_at_;
  StatusTextReader text_reader_;
  std::vector<CoreText> texts_;
};

}  // namespace hm
