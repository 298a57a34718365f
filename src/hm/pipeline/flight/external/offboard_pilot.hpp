#pragma once
#include <deque>
#include <optional>

#include "hm/estimation/filter_types.hpp"
#include "hm/flight/command_gate.hpp"
#include "hm/link/codec/mavlink_enums.hpp"
#include "hm/link/vehicle_messages.hpp"

namespace hm {

/// State of an external autopilot by its messages.
struct OffboardView {
  Time now;
  bool armed = false;
  bool ready = false;                             ///< it has estimated position and heading for a second
  std::uint8_t autopilot = kMavAutopilotGeneric;  ///< MavAutopilot
  std::uint8_t landed = 0;                        ///< MavLandedState; 0: not said
  BasicVehicleState<float> estimate;              ///< its own, in `odom`
};

/// Turns FlightCommand into what MAVLink's offboard control knows: commands with an acknowledgement (mode,
/// arming, landing), and a set-point that is repeated. Keeps the states of dissertation Fig. 2.6 as far as
/// the autopilot tells them. The autopilot's own fail-safes act beside it.
class OffboardPilot {
 public:
  /// A velocity without a successor for so long ends in hold.
  static constexpr Duration kVelocityValid{300'000'000};
  /// At this distance from its height a take-off is over, m.
  static constexpr float kTakenOff_m = 0.1F;

  explicit OffboardPilot(const CommandParams& params = {}, float takeoff_height_m = 1.3F)
      : gate_(params), takeoff_height_m_(takeoff_height_m) {}

  /// Carries a command out: changes the set-point, adds to commands().
  Refusal obey(const FlightCommand& command, const OffboardView& view);
  /// Follows what the autopilot does.
  void update(const OffboardView& view);
  [[nodiscard]] AutopilotState state() const { return state_; }
  [[nodiscard]] FlightPhase phase() const { return phase_; }
  /// Set-point for the autopilot, in `odom`; nothing while it lands or has not estimated anything.
  [[nodiscard]] const std::optional<LinkSetPoint>& set_point() const { return set_point_; }
  /// Commands that are still to be sent, in order, without their addresses.
  [[nodiscard]] std::deque<MavCommandLong>& commands() { return commands_; }

 private:
  Refusal toggle_engage(const OffboardView& view);
  Refusal take_off(const FlightCommand& command, const OffboardView& view);
  Refusal fly(const FlightCommand& command, const OffboardView& view);
  Refusal change_mode(const FlightCommand& command, const OffboardView& view);
  void keep(const OffboardView& view, FlightPhase phase);
  void order(std::uint16_t command, float param1 = 0, float param2 = 0, float param7 = 0);

  CommandGate gate_;
  float takeoff_height_m_;
  AutopilotState state_ = AutopilotState::kOff;
  FlightPhase phase_ = FlightPhase::kGround;
  std::optional<LinkSetPoint> set_point_;
  Time velocity_at_;
  std::deque<MavCommandLong> commands_;
};

}  // namespace hm
