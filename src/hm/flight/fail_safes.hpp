#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/flight/fail_safe_params.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Why a fail-safe acts: the rows of the table in docs/flight.md.
enum class FailSafe : std::uint8_t {
  kPoseStale,         ///< no pose was accepted for a while
  kPoseLost,          ///< for longer, or the position has become too uncertain
  kHeightStale,       ///< no height was accepted
  kPoseRefused,       ///< poses arrive, the estimator's gate refuses them all
  kSetpointStale,     ///< velocity or direct commands stopped
  kPilotLost,         ///< no sign of the pilot for a while
  kPilotGone,         ///< for longer
  kComputerSilent,    ///< the on-board computer gives no sign
  kBatteryForReturn,  ///< charge falls below what the way home takes
  kBatteryEmpty,
  kFenceAhead,       ///< the vehicle would come to rest outside of the fence
  kFenceLeft,        ///< it is outside
  kFenceFarOutside,  ///< further outside
  kObstacleAhead,    ///< within the stopping distance
  kNoLift,           ///< full thrust, and sinking
  kImuGap,
  kImuLost,
  kOverturned,    ///< tilt beyond any that is flown
  kUncontrolled,  ///< the attitude does not follow its command: a rotor is lost, or something holds the
                  ///< vehicle
  kTiltMismatch,  ///< tilt and acceleration of the poses disagree: the sensor is turned
  kEStop,
};
inline constexpr std::size_t kFailSafeCount = static_cast<std::size_t>(FailSafe::kEStop) + 1;

/// Reaction of a fail-safe; the larger, the more drastic. The largest of all active ones is taken.
enum class SafetyAction : std::uint8_t {
  kNone,
  kClamp,          ///< keep set-points inside of the fence
  kBrake,          ///< come to rest before the obstacle
  kHold,           ///< FlightPhase::kHold
  kReturn,         ///< FlightPhase::kReturn
  kDeadReckoning,  ///< FlightPhase::kDeadReckoning
  kSinkSlowly,     ///< thrust a little below hovering, the rest as before
  kLand,           ///< forced landing at the place
  kLevelDescent,   ///< forced landing, level, since the place is not known
  kHoldMotors,     ///< last motor commands stand
  kCut,            ///< motors off, AutopilotState::kError
};

/// State of the vehicle as far as safety goes. Ages are those of the last valid input of a kind.
struct SafetyInputs {
  Time now;
  bool airborne = false;  ///< kFlying or kLanding; otherwise only kEStop counts
  Duration pose_age, height_age, imu_age;
  /// How long the estimator has refused every pose; zero while it accepts them.
  Duration poses_refused;
  float position_std_m = 0;

  std::optional<Duration> velocity_age, direct_age;  ///< of the set-point, in these modes only
  std::optional<Duration> pilot_age;                 ///< sign of life, if a pilot flies
  std::optional<Duration> computer_age;              ///< sign of life, if there is one

  std::optional<float> battery_ratio;  ///< remaining charge, 0 to 1
  float return_need_ratio = 0;         ///< charge that the way home takes

  float stop_outside_m = 0;         ///< how far outside of the fence the vehicle would come to rest; 0 inside
  float outside_m = 0;              ///< how far outside of the fence it is
  std::optional<float> obstacle_m;  ///< free way in the direction of flight
  float stopping_distance_m = 0;

  bool thrust_saturated = false;
  float climb_m_s = 0;
  float tilt_rad = 0;
  float cos_tilt_error = 1;  ///< of the angle between the thrust's direction and the commanded one
  /// Angle between the horizontal acceleration by tilt and the one of the poses; nothing if either is small.
  std::optional<float> tilt_mismatch_rad;
  bool e_stop = false;
};

/// Reaction of all fail-safes together.
struct SafetyVerdict {
  SafetyAction action = SafetyAction::kNone;
  FailSafe reason = FailSafe::kEStop;  ///< of the worst action, the first of several; valid if there is one
  std::uint32_t active = 0;            ///< bit per FailSafe
  [[nodiscard]] bool has(FailSafe which) const { return (active >> static_cast<unsigned>(which) & 1U) != 0; }
};

[[nodiscard]] SafetyAction action_of(FailSafe which);
/// Whether a landing by this ends in kHold when its cause is gone (a pose that comes back), or goes on
/// (battery).
[[nodiscard]] bool is_recoverable(FailSafe which);

/// Watches all conditions of the table, each with its time-out. No state but how long conditions have lasted,
/// and what the battery has asked for: what follows from a verdict, and that recovery only leads to kHold, is
/// the autopilot's part.
class FailSafes {
 public:
  explicit FailSafes(const FailSafeParams& params = {})
      : params_(params), least_cos_tilt_error_(sin_cos_f(params.uncontrolled_rad).cos) {}
  void reset() { lasting_ = been_ = 0; }
  /// One step; values that are no numbers count as the dangerous ones.
  const SafetyVerdict& step(const SafetyInputs& inputs);
  [[nodiscard]] const SafetyVerdict& verdict() const { return verdict_; }

 private:
  /// Notes that the condition lasts; activates after the time-out.
  void lasting(FailSafe which, bool condition, float after_s, Time now);
  void aged(FailSafe which, const std::optional<Duration>& age, float after_s);
  void activate(FailSafe which);
  [[nodiscard]] bool has_been(FailSafe which) const {
    return (been_ >> static_cast<unsigned>(which) & 1U) != 0;
  }
  void check_estimate(const SafetyInputs& inputs);
  void check_commands(const SafetyInputs& inputs);
  void check_surroundings(const SafetyInputs& inputs);
  void check_vehicle(const SafetyInputs& inputs);

  FailSafeParams params_;
  float least_cos_tilt_error_;
  std::array<Time, kFailSafeCount> since_{};  // of those in lasting_
  std::uint32_t lasting_ = 0;                 // bit per FailSafe whose condition holds
  std::uint32_t been_ = 0;                    // bit per FailSafe that has acted in this flight
  SafetyVerdict verdict_;
};

}  // namespace hm
