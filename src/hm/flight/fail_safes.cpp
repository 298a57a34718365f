#include "hm/flight/fail_safes.hpp"

#include "hm/estimation/filter_math.hpp"

namespace hm {

SafetyAction action_of(FailSafe which) {
  switch (which) {
    case FailSafe::kPoseStale:
    case FailSafe::kPoseRefused:
      return SafetyAction::kDeadReckoning;
    case FailSafe::kPoseLost:
    case FailSafe::kComputerSilent:
      return SafetyAction::kLevelDescent;
    case FailSafe::kHeightStale:
      return SafetyAction::kSinkSlowly;
    case FailSafe::kSetpointStale:
    case FailSafe::kPilotLost:
      return SafetyAction::kHold;
    case FailSafe::kPilotGone:
    case FailSafe::kBatteryForReturn:
    case FailSafe::kFenceLeft:
      return SafetyAction::kReturn;
    case FailSafe::kFenceAhead:
      return SafetyAction::kClamp;
    case FailSafe::kObstacleAhead:
      return SafetyAction::kBrake;
    case FailSafe::kBatteryEmpty:
    case FailSafe::kFenceFarOutside:
    case FailSafe::kNoLift:
    case FailSafe::kTiltMismatch:
      return SafetyAction::kLand;
    case FailSafe::kImuGap:
      return SafetyAction::kHoldMotors;
    case FailSafe::kImuLost:
    case FailSafe::kOverturned:
    case FailSafe::kUncontrolled:
    case FailSafe::kEStop:
      return SafetyAction::kCut;
  }
  return SafetyAction::kNone;
}

bool is_recoverable(FailSafe which) {
  return which == FailSafe::kPoseLost || which == FailSafe::kComputerSilent;
}

const SafetyVerdict& FailSafes::step(const SafetyInputs& inputs) {
  verdict_ = {};
  if (inputs.e_stop) activate(FailSafe::kEStop);
  if (!inputs.airborne) {
    reset();
    return verdict_;
  }
  check_estimate(inputs);
  check_commands(inputs);
  check_surroundings(inputs);
  check_vehicle(inputs);
  return verdict_;
}

void FailSafes::activate(FailSafe which) {
  verdict_.active |= 1U << static_cast<unsigned>(which);
  been_ |= verdict_.active;
  const SafetyAction action = action_of(which);
  if (action > verdict_.action) {
    verdict_.action = action;
    verdict_.reason = which;
  }
}

void FailSafes::lasting(FailSafe which, bool condition, float after_s, Time now) {
  const std::uint32_t bit = 1U << static_cast<unsigned>(which);
  Time& since = since_[static_cast<std::size_t>(which)];
  if (!condition) {
    lasting_ &= ~bit;
    return;
  }
  if ((lasting_ & bit) == 0) since = now;
  lasting_ |= bit;
  if (now - since >= duration_of(after_s)) activate(which);
}

void FailSafes::aged(FailSafe which, const std::optional<Duration>& age, float after_s) {
  if (age && *age >= duration_of(after_s)) activate(which);
}

void FailSafes::check_estimate(const SafetyInputs& in) {
  aged(FailSafe::kPoseStale, in.pose_age, params_.pose_stale_s);
  aged(FailSafe::kPoseLost, in.pose_age, params_.pose_lost_s);
  if (!(in.position_std_m <= params_.pose_lost_std_m)) activate(FailSafe::kPoseLost);
  aged(FailSafe::kHeightStale, in.height_age, params_.height_stale_s);
  aged(FailSafe::kPoseRefused, in.poses_refused, params_.pose_refused_s);
  aged(FailSafe::kImuGap, in.imu_age, params_.imu_gap_s);
  aged(FailSafe::kImuLost, in.imu_age, params_.imu_lost_s);
}

void FailSafes::check_commands(const SafetyInputs& in) {
  aged(FailSafe::kSetpointStale, in.velocity_age, params_.velocity_stale_s);
  aged(FailSafe::kSetpointStale, in.direct_age, params_.direct_stale_s);
  aged(FailSafe::kPilotLost, in.pilot_age, params_.pilot_lost_s);
  aged(FailSafe::kPilotGone, in.pilot_age, params_.pilot_gone_s);
  aged(FailSafe::kComputerSilent, in.computer_age, params_.computer_silent_s);
}

void FailSafes::check_surroundings(const SafetyInputs& in) {
  if (!(in.stop_outside_m <= 0)) activate(FailSafe::kFenceAhead);
  if (!(in.outside_m < params_.fence_return_m)) activate(FailSafe::kFenceLeft);
  if (!(in.outside_m < params_.fence_land_m)) activate(FailSafe::kFenceFarOutside);
  if (in.obstacle_m && !(*in.obstacle_m > in.stopping_distance_m + params_.obstacle_margin_m))
    activate(FailSafe::kObstacleAhead);
}

void FailSafes::check_vehicle(const SafetyInputs& in) {
  // Charge does not come back: what the battery has asked for stays, though the way home becomes shorter.
  const bool low = has_been(FailSafe::kBatteryForReturn) ||
                   (in.battery_ratio && !(*in.battery_ratio >= in.return_need_ratio));
  const bool empty = has_been(FailSafe::kBatteryEmpty) ||
                     (in.battery_ratio && !(*in.battery_ratio >= params_.battery_empty_ratio));
  lasting(FailSafe::kBatteryForReturn, low, params_.battery_after_s, in.now);
  lasting(FailSafe::kBatteryEmpty, empty, params_.battery_after_s, in.now);
  const bool no_lift = in.thrust_saturated && !(in.climb_m_s >= -params_.no_lift_sink_m_s);
  lasting(FailSafe::kNoLift, no_lift, params_.no_lift_s, in.now);
  lasting(FailSafe::kOverturned, !(in.tilt_rad <= params_.overturned_rad), params_.overturned_s, in.now);
  lasting(FailSafe::kUncontrolled, !(in.cos_tilt_error >= least_cos_tilt_error_), params_.uncontrolled_s,
          in.now);
  const bool mismatch = in.tilt_mismatch_rad && !(*in.tilt_mismatch_rad <= params_.tilt_mismatch_rad);
  lasting(FailSafe::kTiltMismatch, mismatch, params_.tilt_mismatch_s, in.now);
}

}  // namespace hm
