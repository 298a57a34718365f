#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "hm/estimation/filter_types.hpp"
#include "hm/flight/autopilot.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/pipeline/flight/free_distances.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Pose of the vehicle from scan matching, as the on-board computer sends it. Symmetric covariance.
struct PoseMessage {
  PoseReading<float> pose;
  /// Counts up whenever tracking was lost before this pose: it may have jumped. In the flag of its frame.
  std::uint8_t restarts = 0;
  Time scan_end;  ///< when the last beam of its scan was measured; not sent, for latencies
};

/// Height of the base above the reference floor, and of the base above the surface below it.
struct HeightMessage {
  BasicHeightReading<float> height;
  float clearance_m = 0;
};

/// How far the way is free, by the newest scan.
struct ObstacleMessage {
  Time stamp;  ///< of the middle of the scan
  FreeDistances free;
};

/// Question of TIMESYNC, and its answer.
struct TimeQuestion {
  Time sent;  ///< on the computer's clock
};
struct TimeAnswer {
  Time sent;    ///< of the question
  Time remote;  ///< on the board's clock
};

/// The core's estimate. It predicts the motion between scans, which counts where the surroundings leave a
/// direction free (a hallway): there scan matching alone would go on with its last velocity.
struct StateMessage {
  Time stamp;
  Vec3 position_m = Vec3::Zero(), roll_pitch_yaw_rad = Vec3::Zero();
};

/// On-board computer to board. Without any other content it is a sign of life.
using UpMessage =
    std::variant<std::monostate, PoseMessage, HeightMessage, ObstacleMessage, FlightCommand, TimeQuestion>;
/// Board to on-board computer. Stamps are those of the board's clock.
using DownMessage = std::variant<ImuSample, StateMessage, TimeAnswer>;

/// Whether a goal given in `map` lies elsewhere in `odom` since the map was corrected, by more than noise.
[[nodiscard]] bool is_goal_moved(const Vec2& goal_map_m, const SE2& T_map_odom_then,
                                 const SE2& T_map_odom_now);

/// Length on the wire: start, size, type, flag and checksum (8 bytes), and the content with stamps of 8 and
/// numbers of 4 bytes.
[[nodiscard]] std::size_t bytes_on_wire(const UpMessage& message);
[[nodiscard]] std::size_t bytes_on_wire(const DownMessage& message);

/// Board to motor controllers, each millisecond.
struct MotorMessage {
  Time computed;  ///< when the core's step was; not sent, for latencies
  MotorDemand demand = MotorDemand::kOff;
  std::array<float, 4> rotor_speed_rad_s{};
  RpytCommand rpyt;
};

/// Outcome of a pilot's command.
struct CommandAnswer {
  FlightCommand command;
  Refusal refusal = Refusal::kNone;
};

/// The words of a fail-safe that acts; of a turned sensor with its angle.
std::string fail_safe_text(FailSafe which, const AutopilotOutputs& outputs);

}  // namespace hm
