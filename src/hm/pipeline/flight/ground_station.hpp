#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "hm/flight/flight_command.hpp"
#include "hm/link/mavlink_peer.hpp"
#include "hm/link/vehicle_messages.hpp"
#include "hm/link/vehicle_server.hpp"
#include "hm/pipeline/flight/flight_run.hpp"

namespace hm {

/// Speeds of full sticks of its gamepad, until it sets STICK_SPEED, STICK_CLIMB and STICK_TURN.
struct GroundStationParams {
  double stick_speed_m_s = 1, stick_climb_m_s = 0.5, stick_turn_rad_s = 1;
};

/// The flying vehicle as QGroundControl sees it (MAVLink 2): heartbeat, attitude, position, battery, states
/// and the words of fail-safes and refusals; and what a ground station asks for as FlightCommand of a pilot
/// of its own: arm and disarm (param2 21196: emergency stop), take-off, land, hold, return, goals
/// (DO_REPOSITION by COMMAND_INT in a local frame, or SET_POSITION_TARGET_LOCAL_NED with a position, in
/// `map`; one that comes again is the same goal, and it is sent on again when the map was corrected), and
/// MANUAL_CONTROL as velocities. A command is acknowledged with what the core answered; why it was refused
/// goes before as a text. The first button takes control over from another pilot. Sends what the vehicle
/// estimates, nothing of a simulation. The world is AutopilotWorld::kLocalFrd.
class GroundStation {
 public:
  /// Its identity among pilots.
  static constexpr std::uint8_t kPilot = 2;
  /// Sticks farther from their middle than this fly; all in the middle for kStickRest hold the position.
  static constexpr double kStickDeadBand = 0.05;
  static constexpr Duration kStickRest{500'000'000};

  /// The transport must outlive it. With a key it signs, and accepts only what is signed with it.
  explicit GroundStation(Transport& transport, const GroundStationParams& params = {},
                         const std::optional<MavlinkKey>& key = {});

  /// Called after each step of the flight: sends what is due and reads what came. The next command of the
  /// ground station, if there is one, for the next step.
  std::optional<FlightCommand> step(const FlightMoment& moment);
  [[nodiscard]] const MavlinkPeer& peer() const { return peer_; }

 private:
  void send_telemetry(const FlightMoment& moment);
  void send_news(const FlightMoment& moment);
  void note_heartbeat(const FlightMoment& moment);
  /// Whose command it was that a command of the pilot carries out.
  struct Asked {
    std::uint16_t command = 0;
    MavlinkAddress from;
  };
  struct Order {
    FlightCommand command;
    std::optional<Asked> asked;
  };
  [[nodiscard]] std::uint8_t obey(const MavCommandLong& command, const CommandOrigin& origin);
  [[nodiscard]] std::uint8_t arm(bool on, const Asked& asked);
  [[nodiscard]] std::uint8_t reposition(const MavCommandLong& command, const CommandOrigin& origin);
  [[nodiscard]] std::uint8_t refuse(Refusal reason);
  void note_answer(const FlightMoment& moment);
  void take_sticks(const MavManualControl& message);
  void take_goal(const MavSetPositionTargetLocalNed& message);
  void follow_goal();
  void send_goal(const std::optional<Asked>& asked = {});
  void fly_by_sticks();
  FlightCommand& order(CommandKind kind, const std::optional<Asked>& asked = {});

  MavlinkPeer peer_;
  VehicleServer server_;
  GroundStationParams params_;
  std::optional<Time> boot_;
  const FlightMoment* moment_ = nullptr;  // of the step that runs
  std::deque<Order> queue_;
  std::deque<Order> sent_;  // that somebody waits for
  Time last_stamp_{INT64_MIN};
  std::optional<Time> fast_at_, slow_at_, life_at_;  // when the streams of the telemetry were sent
  std::optional<LinkSticks> sticks_;
  std::optional<Time> deflected_at_;  // sticks that fly, last
  std::uint16_t buttons_ = 0;
  /// A goal of the ground station, and the correction of the map with which it was sent.
  struct Goal {
    Vec3 position_m = Vec3::Zero();  // in `map`
    double yaw_rad = 0;
    SE2 T_map_odom;
    bool accepted = false;
  };
  std::optional<Goal> goal_;
  bool in_control_ = false;  // by the answers to its commands
  AutopilotState told_state_ = AutopilotState::kOff;
  std::uint32_t told_fail_safes_ = 0;
};

/// Estimate of the vehicle, for messages.
[[nodiscard]] LinkState link_state(const BasicVehicleState<float>& estimate);

}  // namespace hm
