#include "hm/pipeline/flight/ground_station.hpp"

#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {
namespace {

constexpr Duration kFast{100'000'000}, kSlow{1'000'000'000}, kLifePeriod{500'000'000};
constexpr float kDisarmByForce = 21196;
constexpr std::uint16_t kTakeOverButton = 1;
constexpr std::uint16_t kUnknownVoltage = 65535;

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

GroundStation::GroundStation(Transport& transport, const GroundStationParams& params)
    : peer_(transport, vehicle_options()),
      server_(peer_, parameters_of(params),
              [this](const MavCommandLong& command, MavlinkAddress) { return obey(command); }),
      params_(params) {
  server_.parameters().changed = [this](const LinkParameter& changed) {
    double& value = changed.name == "STICK_SPEED"   ? params_.stick_speed_m_s
                    : changed.name == "STICK_CLIMB" ? params_.stick_climb_m_s
                                                    : params_.stick_turn_rad_s;
    value = static_cast<double>(changed.value);
  };
}

FlightCommand& GroundStation::order(CommandKind kind) {
  queue_.emplace_back().kind = kind;
  return queue_.back();
}

std::optional<FlightCommand> GroundStation::step(const FlightMoment& moment) {
  moment_ = &moment;
  const Time now = moment.stamp;
  if (!boot_) {
    boot_ = now;
    fast_at_ = slow_at_ = life_at_ = now;
  }
  note_heartbeat(moment);
  peer_.step([now] { return now; },
             [this, now](const MavlinkFrame& frame) {
               if (const auto sticks = read_mavlink_message<MavManualControl>(frame))
                 take_sticks(*sticks);
               else if (const auto goal = read_mavlink_message<MavSetPositionTargetLocalNed>(frame))
                 take_goal(*goal);
               else
                 server_.receive(frame, now);
             });
  server_.step();
  send_telemetry(moment);
  send_news(moment);
  fly_by_sticks();
  follow_goal();
  const bool heard = !peer_.remotes(now).empty();
  if (queue_.empty() && heard && in_control_ && is_due(life_at_, kLifePeriod, now))
    order(CommandKind::kSignOfLife);
  if (queue_.empty() || now <= last_stamp_) return std::nullopt;
  FlightCommand command = queue_.front();
  queue_.pop_front();
  command.stamp = last_stamp_ = now;
  command.pilot = kPilot;
  return command;
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

/// Changes of state, new fail-safes and refused commands, in words.
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
    peer_.send_text(kMavWarning, text_of(out.safety.reason));
  if (!moment.answer || moment.answer->command.pilot != kPilot) return;
  const auto& [command, refusal] = *moment.answer;
  in_control_ = refusal != Refusal::kOtherPilot && command.kind != CommandKind::kRelease;
  // A refused goal is kept, so that its repetitions are not refused again and again.
  if (command.kind == CommandKind::kGoTo && goal_) goal_->accepted = refusal == Refusal::kNone;
  if (refusal != Refusal::kNone && command.kind != CommandKind::kSignOfLife)
    peer_.send_text(kMavWarning, text_of(refusal));
}

std::uint8_t GroundStation::arm(bool on, bool by_force) {
  if (!on && by_force) {
    order(CommandKind::kEStop);
    return kMavAccepted;
  }
  const AutopilotState state = moment_->autopilot.state;
  if (on == is_armed(state)) return kMavAccepted;  // it is so already
  if (state != (on ? AutopilotState::kOff : AutopilotState::kIdle)) return kMavTemporarilyRejected;
  order(CommandKind::kToggleEngage);
  if (!on) order(CommandKind::kRelease);
  return kMavAccepted;
}

std::uint8_t GroundStation::obey(const MavCommandLong& command) {
  switch (command.command) {
    case kMavCommandArmDisarm:
      return arm(command.param1 >= 0.5F, command.param2 == kDisarmByForce);
    case kMavCommandTakeoff:
      order(CommandKind::kTakeOff).position_m.z() =
          std::isfinite(command.param7) ? max_f(command.param7, 0) : 0;
      return kMavAccepted;
    case kMavCommandLand:
      order(CommandKind::kLand);
      return kMavAccepted;
    default:
      return kMavUnsupported;
  }
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

void GroundStation::send_goal() {
  goal_->T_map_odom = moment_->T_map_odom;
  FlightCommand& command = order(CommandKind::kGoTo);
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
