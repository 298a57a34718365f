#include "hm/pipeline/flight/external/offboard_pilot.hpp"

#include <cmath>

#include "hm/core/angle.hpp"

namespace hm {
namespace {

constexpr float kCustomMode = 1, kPx4Offboard = 6, kArdupilotGuided = 4;

double yaw_of(const OffboardView& view) { return static_cast<double>(view.estimate.roll_pitch_yaw_rad.z()); }

/// A vector of the level frame of the vehicle, in `odom`.
Vec3 from_level(const Vec3f& vector, const OffboardView& view) {
  return Eigen::AngleAxisd(yaw_of(view), Vec3::UnitZ()) * vector.cast<double>();
}

LinkSetPoint position_target(const Vec3& position_m, double yaw_rad) {
  LinkSetPoint target;
  target.position_m = position_m;
  target.yaw_rad = yaw_rad;
  return target;
}

}  // namespace

void OffboardPilot::order(std::uint16_t command, float param1, float param2, float param7) {
  MavCommandLong message;
  message.command = command;
  message.param1 = param1;
  message.param2 = param2;
  message.param7 = param7;
  commands_.push_back(message);
}

void OffboardPilot::keep(const OffboardView& view, FlightPhase phase) {
  phase_ = phase;
  set_point_ = position_target(view.estimate.position_m.cast<double>(), yaw_of(view));
}

Refusal OffboardPilot::obey(const FlightCommand& command, const OffboardView& view) {
  if (const Refusal refusal = gate_.admit(command, view.now); refusal != Refusal::kNone) return refusal;
  switch (command.kind) {
    case CommandKind::kTakeOver:
    case CommandKind::kRelease:
    case CommandKind::kSignOfLife:
      return Refusal::kNone;
    case CommandKind::kEStop:
      commands_.clear();
      order(kMavCommandArmDisarm, 0, kMavDisarmByForce);
      state_ = AutopilotState::kError;
      set_point_.reset();
      return Refusal::kNone;
    case CommandKind::kReset:
      if (state_ != AutopilotState::kError) return Refusal::kNoError;
      if (view.armed) return Refusal::kMotorsOn;
      state_ = AutopilotState::kOff;
      return Refusal::kNone;
    case CommandKind::kDirect:
    case CommandKind::kPath:
      return Refusal::kNotSupported;
    default:
      break;
  }
  if (state_ == AutopilotState::kError) return Refusal::kErrorLatched;
  if (command.kind == CommandKind::kToggleEngage) return toggle_engage(view);
  if (command.kind == CommandKind::kTakeOff) return take_off(command, view);
  if (state_ == AutopilotState::kLanding) return Refusal::kLandingForced;
  return state_ == AutopilotState::kFlying ? fly(command, view) : Refusal::kNotFlying;
}

Refusal OffboardPilot::toggle_engage(const OffboardView& view) {
  if (!commands_.empty()) return Refusal::kInTransition;
  if (in_air(state_)) return Refusal::kAlreadyFlying;
  if (view.armed) {
    order(kMavCommandArmDisarm, 0);
    return Refusal::kNone;
  }
  if (!view.ready) return Refusal::kNotReady;
  order(kMavCommandSetMode, kCustomMode,
        view.autopilot == kMavAutopilotArdupilot ? kArdupilotGuided : kPx4Offboard);
  order(kMavCommandArmDisarm, 1);
  return Refusal::kNone;
}

Refusal OffboardPilot::take_off(const FlightCommand& command, const OffboardView& view) {
  if (in_air(state_)) return Refusal::kAlreadyFlying;
  if (!view.armed) return Refusal::kMotorsOff;
  if (!view.ready) return Refusal::kNotReady;
  const float height_m = command.position_m.z() > 0 ? command.position_m.z() : takeoff_height_m_;
  keep(view, FlightPhase::kTakeOff);
  set_point_->position_m->z() += static_cast<double>(height_m);
  // PX4 climbs to its set-point; ArduPilot wants to be told.
  if (view.autopilot == kMavAutopilotArdupilot) order(kMavCommandTakeoff, 0, 0, height_m);
  state_ = AutopilotState::kFlying;
  return Refusal::kNone;
}

Refusal OffboardPilot::fly(const FlightCommand& command, const OffboardView& view) {
  if (command.kind == CommandKind::kLand) {
    order(kMavCommandLand);
    state_ = AutopilotState::kLanding;
    phase_ = FlightPhase::kDescend;
    set_point_.reset();
    return Refusal::kNone;
  }
  if (phase_ == FlightPhase::kTakeOff && command.kind != CommandKind::kHold) return Refusal::kWrongMode;
  switch (command.kind) {
    case CommandKind::kHold:
      keep(view, FlightPhase::kHold);
      return Refusal::kNone;
    case CommandKind::kMode:
      return change_mode(command, view);
    case CommandKind::kGoTo:
      set_point_ = position_target(command.position_m.cast<double>(), static_cast<double>(command.yaw_rad));
      phase_ = FlightPhase::kPosition;
      return Refusal::kNone;
    case CommandKind::kPositionStep:
      if (phase_ != FlightPhase::kPosition) return Refusal::kWrongMode;
      *set_point_->position_m += from_level(command.position_m, view);
      set_point_->yaw_rad = wrap_angle(*set_point_->yaw_rad + static_cast<double>(command.yaw_rad));
      return Refusal::kNone;
    case CommandKind::kVelocity:
      if (phase_ != FlightPhase::kVelocity) return Refusal::kWrongMode;
      if (!command.dead_man) {
        keep(view, FlightPhase::kHold);
        return Refusal::kNone;
      }
      set_point_.emplace();
      set_point_->velocity_m_s = from_level(command.velocity_m_s, view);
      set_point_->yaw_rate_rad_s = static_cast<double>(command.yaw_rad);
      velocity_at_ = view.now;
      return Refusal::kNone;
    default:
      return Refusal::kNotSupported;
  }
}

Refusal OffboardPilot::change_mode(const FlightCommand& command, const OffboardView& view) {
  if (command.mode == FlightPhase::kPosition) {
    keep(view, FlightPhase::kPosition);
    return Refusal::kNone;
  }
  if (command.mode != FlightPhase::kVelocity) return Refusal::kNotSupported;
  phase_ = FlightPhase::kVelocity;
  set_point_.emplace();
  set_point_->velocity_m_s = Vec3::Zero();
  set_point_->yaw_rate_rad_s = 0;
  velocity_at_ = view.now;
  return Refusal::kNone;
}

void OffboardPilot::update(const OffboardView& view) {
  if (state_ == AutopilotState::kError) return;
  if (!view.armed) {
    // Disarmed: by order, by itself after a landing, or in the air by a fail-safe of its own.
    state_ = AutopilotState::kOff;
    phase_ = FlightPhase::kGround;
    set_point_.reset();
    // Streams for a second before it is asked to follow.
    const bool estimates = view.estimate.planar_ready && view.estimate.height_ready;
    if (view.ready || estimates) keep(view, FlightPhase::kGround);
    return;
  }
  if (state_ == AutopilotState::kOff) state_ = AutopilotState::kIdle;
  if (state_ == AutopilotState::kLanding && view.landed == kMavOnGround) {
    state_ = AutopilotState::kIdle;
    phase_ = FlightPhase::kGround;
  }
  if (state_ != AutopilotState::kFlying) return;
  if (phase_ == FlightPhase::kTakeOff &&
      std::abs(view.estimate.position_m.cast<double>().z() - set_point_->position_m->z()) <
          static_cast<double>(kTakenOff_m))
    phase_ = FlightPhase::kPosition;
  if (phase_ == FlightPhase::kVelocity && view.now - velocity_at_ > kVelocityValid)
    keep(view, FlightPhase::kHold);
}

}  // namespace hm
