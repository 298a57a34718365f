#pragma once
#include <cstdint>

#include "hm/core/time.hpp"
#include "hm/flight/flight_state.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Commands of a pilot.
enum class CommandKind : std::uint8_t {
  kToggleEngage,
  kTakeOff,  ///< to `position_m.z()` above the place, or to the default height if that is 0
  kLand,
  kHold,
  kEStop,  ///< from any pilot
  kReset,
  kMode,          ///< `mode`: kPosition (where it is), kVelocity (at rest), kDirect, kPath, or kReturn
  kVelocity,      ///< `velocity_m_s` in the level frame of the vehicle (x forward) and `yaw_rad` per second
  kPositionStep,  ///< `position_m` in the level frame of the vehicle and `yaw_rad`, added to the goal
  kGoTo,          ///< `position_m` and `yaw_rad` in the odom frame
  kDirect,        ///< attitude and thrust
  kPath,          ///< a moment of a planned motion: position, velocity, acceleration, yaw (odom frame)
  kTakeOver,      ///< takes control from another pilot
  kRelease,       ///< gives control up
  kSignOfLife,    ///< nothing but that the pilot is there
};
inline constexpr int kCommandKindCount = static_cast<int>(CommandKind::kSignOfLife) + 1;

/// The one way to fly the vehicle: scripts, ground station and gamepads all send these. Members that a kind
/// does not name are ignored.
struct FlightCommand {
  Time stamp;  ///< when the pilot gave it, on the vehicle's clock; strictly later than the previous one
  std::uint8_t pilot = 0;  ///< who; not 0
  CommandKind kind = CommandKind::kSignOfLife;
  FlightPhase mode = FlightPhase::kPosition;
  /// kVelocity, kDirect: whether the pilot still holds the dead-man switch; if not, the vehicle holds at
  /// once.
  bool dead_man = true;
  Vec3f position_m = Vec3f::Zero(), velocity_m_s = Vec3f::Zero(), acceleration_m_s2 = Vec3f::Zero();
  float yaw_rad = 0;                                                        ///< kVelocity: rate, rad/s
  float roll_rad = 0, pitch_rad = 0, yaw_rate_rad_s = 0, thrust_ratio = 0;  ///< kDirect
};

}  // namespace hm
