#include "hm/pipeline/flight/ground_station.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/link/mavlink_key.hpp"

namespace hm {
namespace {

constexpr Duration kFast{100'000'000}, kSlow{1'000'000'000}, kLifePeriod{500'000'000};
constexpr std::uint16_t kTakeOverButton = 1;
constexpr std::uint16_t kUnknownVoltage = 65535;
constexpr std::size_t kMostSent = 16;

MavlinkPeerOptions vehicle_options() {
  MavlinkPeerOptions options;
  options.address = {1, 1};
  options.heartbeat.type = kMavTypeQuadrotor;
  options.heartbeat.autopilot = kMavAutopilotGeneric;
  return options;
}

/// A ground station shows a vehicle once it has its parameters; these say what it is.
std::vector<LinkParameter> parameters_of(const GroundStationParams& params) {
  return {{"STICK_SPEED", static_cast<float>(params.stick_speed_m_s), 0.1F, 10, false},
          {"STICK_CLIMB", static_cast<float>(params.stick_climb_m_s), 0.1F, 5, false},
          {"STICK_TURN", static_cast<float>(params.stick_turn_rad_s), 0.1F, 5, false}};
}

bool is_armed(AutopilotState state) { return state == AutopilotState::kIdle || in_air(state); }

/// Result of a command that was refused, for MAVLink.
MavResult result_of(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return kMavAccepted;
    case Refusal::kNotSupported:
      return kMavUnsupported;
    case Refusal::kNotANumber:
    case Refusal::kOutOfRange:
      return kMavDenied;
    default:
      return kMavTemporarilyRejected;
  }
}

MavLandedState landed_state(AutopilotState state, FlightPhase phase) {
  if (state == AutopilotState::kLanding) return kMavLanding;
  if (state != AutopilotState::kFlying) return kMavOnGround;
  return phase == FlightPhase::kTakeOff ? kMavTakingOff : kMavInAir;
}

}  // namespace

LinkState link_state(const BasicVehicleState<float>& estimate) {
  LinkState state;
  state.stamp = estimate.stamp;
  const Vec3 angles = estimate.roll_pitch_yaw_rad.cast<double>();
  const Mat3 rotation = rotation_from_roll_pitch_yaw(angles);
  state.T_odom_base = SE3(rotation, estimate.position_m.cast<double>());
  state.velocity_body = rotation.transpose() * estimate.velocity_m_s.cast<double>();
  state.rates_body = estimate.angular_velocity_rad_s.cast<double>();
  return state;
}

GroundStation::GroundStation(Transport& transport, const GroundStationParams& params,
                             const std::optional<MavlinkKey>& key)
    : peer_(transport, with_key(vehicle_options(), key)),
      server_(peer_, parameters_of(params),
              [this](const MavCommandLong& command, const CommandOrigin& origin) {
                return obey(command, origin);
              }),
      params_(params) {
  start_signing(peer_);
  server_.parameters().changed = [this](const LinkParameter& changed) {
    double& value = changed.name == "STICK_SPEED"   ? params_.stick_speed_m_s
                    : changed.name == "STICK_CLIMB" ? params_.stick_climb_m_s
                                                    : params_.stick_turn_rad_s;
    value = static_cast<double>(changed.value);
  };
}

FlightCommand& GroundStation::order(CommandKind kind, const std::optional<Asked>& asked) {
  queue_.push_back({{}, asked});
  queue_.back().command.kind = kind;
  return queue_.back().command;
}

std::optional<FlightCommand> GroundStation::step(const FlightMoment& moment) {
  moment_ = &moment;
  const Time now = moment.stamp;
  if (!boot_) {
    boot_ = now;
    fast_at_ = slow_at_ = life_at_ = now;
  }
  note_heartbeat(moment);
  note_answer(moment);
  peer_.step([now] { return now; },
             [this, now](const MavlinkFrame& frame) {
               if (const auto sticks = read_mavlink_message<MavManualControl>(frame))
                 take_sticks(*sticks);
               else if (const auto goal = read_mavlink_message<MavSetPositionTargetLocalNed>(frame))
                 take_goal(*goal);
               else
                 server_.receive(frame, now);
             });
  server_.step(now);
  send_telemetry(moment);
  send_news(moment);
  fly_by_sticks();
  follow_goal();
  const bool heard = !peer_.remotes(now).empty();
  if (queue_.empty() && heard && in_control_ && is_due(life_at_, kLifePeriod, now))
    order(CommandKind::kSignOfLife);
  if (queue_.empty() || now <= last_stamp_) return std::nullopt;
  Order next = queue_.front();
  queue_.pop_front();
  next.command.stamp = last_stamp_ = now;
  next.command.pilot = kPilot;
  if (next.asked) sent_.push_back(next);
  if (sent_.size() > kMostSent) sent_.pop_front();  // their answers were lost
  return next.command;
}

void GroundStation::note_heartbeat(const FlightMoment& moment) {
  const AutopilotOutputs& out = moment.autopilot;
  MavHeartbeat& heartbeat = peer_.heartbeat();
  heartbeat.base_mode = kMavModeCustom | kMavModeManualInput | kMavModeGuided;
  if (is_armed(out.state)) heartbeat.base_mode |= kMavModeArmed;
  heartbeat.custom_mode = static_cast<std::uint32_t>(out.phase);
  heartbeat.system_status = out.state == AutopilotState::kError        ? kMavStateEmergency
                            : out.safety.action != SafetyAction::kNone ? kMavStateCritical
                            : is_armed(out.state)                      ? kMavStateActive
                                                                       : kMavStateStandby;
}

void GroundStation::send_telemetry(const FlightMoment& moment) {
  const Time now = moment.stamp;
  if (is_due(fast_at_, kFast, now)) {
    const LinkState state = link_state(estimate_in_map(moment));
    peer_.send(to_attitude(state, *boot_, AutopilotWorld::kLocalFrd));
    peer_.send(to_attitude_quaternion(state, *boot_, AutopilotWorld::kLocalFrd));
    if (moment.estimate.planar_ready && moment.estimate.height_ready)
      peer_.send(to_local_position(state, *boot_, AutopilotWorld::kLocalFrd));
  }
  if (!is_due(slow_at_, kSlow, now)) return;
  const auto percent = static_cast<std::int8_t>(std::lround(100 * moment.battery_ratio));
  MavSysStatus status;
  constexpr std::uint32_t kSensors = kMavSensorGyro | kMavSensorAccelerometer | kMavSensorLaserPosition |
                                     kMavSensorMotors | kMavSensorBattery;
  status.onboard_control_sensors_present = status.onboard_control_sensors_enabled = kSensors;
  const bool has_pose = moment.estimate.planar_ready && moment.estimate.height_ready;
  status.onboard_control_sensors_health = has_pose ? kSensors : kSensors & ~kMavSensorLaserPosition;
  status.voltage_battery = kUnknownVoltage;
  status.battery_remaining = percent;
  peer_.send(status);
  MavBatteryStatus battery;
  battery.type = 1;
  battery.voltages.fill(kUnknownVoltage);
  battery.battery_remaining = percent;
  peer_.send(battery);
  MavExtendedSysState extended;
  extended.landed_state = landed_state(moment.autopilot.state, moment.autopilot.phase);
  peer_.send(extended);
}

/// Changes of state and new fail-safes, in words.
void GroundStation::send_news(const FlightMoment& moment) {
  const AutopilotOutputs& out = moment.autopilot;
  if (out.state != told_state_) {
    told_state_ = out.state;
    const bool bad = out.state == AutopilotState::kError;
    peer_.send_text(bad ? kMavCritical : kMavInfo, text_of(out.state));
  }
  const std::uint32_t begun = out.safety.active & ~told_fail_safes_;
  told_fail_safes_ = out.safety.active;
  if (begun != 0 && out.safety.action != SafetyAction::kNone)
    peer_.send_text(kMavWarning, fail_safe_text(out.safety.reason, out));
}

/// Sends the outcome of our last command: a refusal in words, and the acknowledgement to its sender.
void GroundStation::note_answer(const FlightMoment& moment) {
  if (!moment.answer || moment.answer->command.pilot != kPilot) return;
  const auto& [command, refusal] = *moment.answer;
  in_control_ = refusal != Refusal::kOtherPilot && command.kind != CommandKind::kRelease;
  // A refused goal is kept, so that its repetitions are not refused again and again.
  if (command.kind == CommandKind::kGoTo && goal_) goal_->accepted = refusal == Refusal::kNone;
  if (refusal != Refusal::kNone && command.kind != CommandKind::kSignOfLife)
    peer_.send_text(kMavWarning, text_of(refusal));
  const auto stamp = command.stamp;
  const auto sent = std::ranges::find_if(sent_, [&](const Order& o) { return o.command.stamp == stamp; });
  if (sent == sent_.end()) return;
  server_.finish(sent->asked->command, sent->asked->from, result_of(refusal));
  sent_.erase(sent);
}

/// Refuses a command that the core is not asked about.
std::uint8_t GroundStation::refuse(Refusal reason) {
  peer_.send_text(kMavWarning, text_of(reason));
  return result_of(reason);
}

/// The core knows a toggle only: it is not asked for in a state in which it would do something else.
std::uint8_t GroundStation::arm(bool on, const Asked& asked) {
  const AutopilotState state = moment_->autopilot.state;
  if (on == is_armed(state)) return kMavAccepted;  // it is so already
  if (state == AutopilotState::kError) return refuse(Refusal::kErrorLatched);
  if (in_air(state)) return refuse(Refusal::kAlreadyFlying);
  if (state != (on ? AutopilotState::kOff : AutopilotState::kIdle)) return refuse(Refusal::kInTransition);
  order(CommandKind::kToggleEngage, asked);
  if (!on) order(CommandKind::kRelease);
  return kMavInProgress;
}

/// Flies to a place of a local frame.
std::uint8_t GroundStation::reposition(const MavCommandLong& command, const CommandOrigin& origin) {
  if (!origin.frame) return kMavCommandIntOnly;
  if (*origin.frame != kMavFrameLocalNed && *origin.frame != kMavFrameLocalFrd) return kMavUnsupportedFrame;
  const Vec3 theirs(static_cast<double>(command.param5), static_cast<double>(command.param6),
                    static_cast<double>(command.param7));
  if (!theirs.allFinite() || std::isinf(command.param4)) return refuse(Refusal::kNotANumber);
  const double yaw_rad = std::isnan(command.param4)
                             ? static_cast<double>(estimate_in_map(*moment_).roll_pitch_yaw_rad.z())
                             : swap_yaw(static_cast<double>(command.param4), AutopilotWorld::kLocalFrd);
  goal_ = Goal{swap_world(theirs, AutopilotWorld::kLocalFrd), yaw_rad, {}, false};
  send_goal(Asked{command.command, origin.from});
  return kMavInProgress;
}

std::uint8_t GroundStation::obey(const MavCommandLong& command, const CommandOrigin& origin) {
  const Asked asked{command.command, origin.from};
  switch (command.command) {
    case kMavCommandArmDisarm:
      if (command.param1 >= 0.5F || command.param2 != kMavDisarmByForce)
        return arm(command.param1 >= 0.5F, asked);
      queue_.clear();
      order(CommandKind::kEStop, asked);
      break;
    case kMavCommandTakeoff:
      order(CommandKind::kTakeOff, asked).position_m.z() =
          std::isfinite(command.param7) ? max_f(command.param7, 0) : 0;
      break;
    case kMavCommandLand:
      order(CommandKind::kLand, asked);
      break;
    case kMavCommandLoiter:
      order(CommandKind::kHold, asked);
      break;
    case kMavCommandReturn:
      order(CommandKind::kMode, asked).mode = FlightPhase::kReturn;
      break;
    case kMavCommandReposition:
      return reposition(command, origin);
    default:
      return kMavUnsupported;
  }
  return kMavInProgress;
}

void GroundStation::take_sticks(const MavManualControl& message) {
  if (message.target != peer_.address().system) return;
  sticks_ = from_manual_control(message);
  if ((sticks_->buttons & ~buttons_ & kTakeOverButton) != 0) {
    order(CommandKind::kTakeOver);
    goal_.reset();
  }
  buttons_ = sticks_->buttons;
}

void GroundStation::take_goal(const MavSetPositionTargetLocalNed& message) {
  constexpr double kSame_m = 1e-3, kSame_rad = 1e-3;
  if (message.target_system != peer_.address().system) return;
  const auto asked = from_position_target(message, AutopilotWorld::kLocalFrd);
  if (!asked || !asked->position_m) return;
  const FlightPhase phase = moment_->autopilot.phase;
  if (phase != FlightPhase::kPosition && phase != FlightPhase::kHold) return;  // those that take goals
  const double yaw_rad = asked->yaw_rad.value_or(
      goal_ ? goal_->yaw_rad : static_cast<double>(estimate_in_map(*moment_).roll_pitch_yaw_rad.z()));
  const bool same = goal_ && (goal_->position_m - *asked->position_m).norm() < kSame_m &&
                    std::abs(wrap_angle(goal_->yaw_rad - yaw_rad)) < kSame_rad;
  if (same) return;
  goal_ = Goal{*asked->position_m, yaw_rad, {}, false};
  send_goal();
}

void GroundStation::send_goal(const std::optional<Asked>& asked) {
  goal_->T_map_odom = moment_->T_map_odom;
  FlightCommand& command = order(CommandKind::kGoTo, asked);
  command.position_m = goal_->position_m.cast<float>();
  command.yaw_rad = static_cast<float>(goal_->yaw_rad);
}

/// The goal lies elsewhere for the vehicle when the map was corrected. One that the vehicle has left (a
/// fail-safe, sticks, another pilot) is forgotten.
void GroundStation::follow_goal() {
  if (!goal_ || !goal_->accepted) return;
  if (!in_control_ || moment_->autopilot.phase != FlightPhase::kPosition) return goal_.reset();
  if (is_goal_moved(goal_->position_m.head<2>(), goal_->T_map_odom, moment_->T_map_odom)) send_goal();
}

/// A message of sticks makes at most one command, so that a gamepad that falls silent lets the set-point age.
void GroundStation::fly_by_sticks() {
  if (!sticks_) return;
  const LinkSticks sticks = *sticks_;
  sticks_.reset();
  const AutopilotOutputs& out = moment_->autopilot;
  if (out.state != AutopilotState::kFlying || out.phase == FlightPhase::kTakeOff) return;
  const bool deflected = std::abs(sticks.forward) > kStickDeadBand ||
                         std::abs(sticks.left) > kStickDeadBand || std::abs(sticks.up) > kStickDeadBand ||
                         std::abs(sticks.turn) > kStickDeadBand;
  if (deflected) deflected_at_ = moment_->stamp;
  if (!deflected_at_) return;  // someone else flies
  if (!deflected && moment_->stamp - *deflected_at_ > kStickRest) {
    deflected_at_.reset();
    order(CommandKind::kHold);
    return;
  }
  if (out.phase != FlightPhase::kVelocity) {
    order(CommandKind::kMode).mode = FlightPhase::kVelocity;
    return;
  }
  FlightCommand& command = order(CommandKind::kVelocity);
  command.velocity_m_s = Vec3(params_.stick_speed_m_s * sticks.forward, params_.stick_speed_m_s * sticks.left,
                              params_.stick_climb_m_s * sticks.up)
                             .cast<float>();
  command.yaw_rad = static_cast<float>(params_.stick_turn_rad_s * sticks.turn);
}

}  // namespace hm
