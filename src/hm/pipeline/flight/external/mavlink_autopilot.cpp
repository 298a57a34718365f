#include "hm/pipeline/flight/external/mavlink_autopilot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "hm/core/stopwatch.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/link/mavlink_key.hpp"

namespace hm {
namespace {

constexpr std::uint32_t kInertialFields = 0x3F;  ///< of HIL_SENSOR: accelerations and rates
/// Deviation of roll and pitch in the poses: they are the autopilot's own, sent back.
constexpr double kTiltStd_rad = 0.02;
constexpr Duration kHeightValid{500'000'000};

MavlinkPeerOptions companion() {
  constexpr std::uint8_t kOnboardComputer = 191;
  MavlinkPeerOptions options;
  options.address = {1, kOnboardComputer};
  options.heartbeat.type = kMavTypeOnboardController;
  options.heartbeat.autopilot = kMavAutopilotInvalid;
  options.heartbeat.system_status = kMavStateActive;
  return options;
}

/// Asks for a message every `period_us`.
MavCommandLong stream(std::uint32_t message, float period_us) {
  MavCommandLong command;
  command.command = kMavCommandSetMessageInterval;
  command.param1 = static_cast<float>(message);
  command.param2 = period_us;
  return command;
}

Mat6 pose_covariance(const FilterMatrix<float, 3>& planar, double height_std_m) {
  Mat6 covariance = Mat6::Zero();
  constexpr std::array<int, 3> kPlace{0, 1, 5};  // x, y, yaw
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      covariance(kPlace[static_cast<std::size_t>(i)], kPlace[static_cast<std::size_t>(j)]) =
          static_cast<double>(planar(i, j));
  covariance(2, 2) = height_std_m * height_std_m;
  covariance(3, 3) = covariance(4, 4) = kTiltStd_rad * kTiltStd_rad;
  return covariance;
}

/// Variance of an alpha-beta filter's velocity for measurements of variance 1 every `period_s` (Kalata 1984):
/// 2 beta^2 / (T^2 alpha (4 - 2 alpha - beta)).
double velocity_variance_ratio(const AlphaBetaParams& gains, double period_s) {
  const double a = gains.alpha_ratio, b = gains.beta_ratio;
  return 2 * b * b / (period_s * period_s * a * (4 - 2 * a - b));
}

std::string_view name_of_command(std::uint16_t command) {
  switch (command) {
    case kMavCommandSetMode:
      return "to follow set-points";
    case kMavCommandArmDisarm:
      return "to arm or disarm";
    case kMavCommandTakeoff:
      return "to take off";
    case kMavCommandLand:
      return "to land";
    default:
      return "a command";
  }
}

}  // namespace

MavlinkAutopilot::MavlinkAutopilot(std::unique_ptr<Transport> transport, const MavlinkAutopilotSetup& setup)
    : transport_(std::move(transport)),
      setup_(setup),
      peer_(*transport_, with_key(companion(), setup.key)),
      pilot_(setup.commands, setup.takeoff_height_m) {
  start_signing(peer_);
}

AutopilotOutputs MavlinkAutopilot::step(const AutopilotInputs& inputs) {
  view_.now = inputs.now;
  if (!boot_) boot_ = inputs.now;
  if (failure_) {
    AutopilotOutputs off;
    off.stamp = inputs.now;
    off.state = AutopilotState::kError;
    return off;
  }
  if (inputs.height) height_ = inputs.height;
  if (inputs.pose) take_pose(*inputs.pose);
  if (inputs.imu) {
    force_sum_ += inputs.imu->specific_force_m_s2.cast<double>();
    rates_sum_ += inputs.imu->angular_velocity_rad_s.cast<double>();
    ++samples_;
  }
  if (++steps_ % kSensorSteps == 0) exchange();
  pilot_.update(view_);
  const Refusal refusal = inputs.command ? pilot_.obey(*inputs.command, view_) : Refusal::kNone;
  send_commands();
  send_set_point();
  return outputs(refusal, inputs.motors_on);
}

/// The planar pose with the newest height and the autopilot's own tilt, as ODOMETRY.
void MavlinkAutopilot::take_pose(const PoseReading<float>& pose) {
  if (!height_ || view_.now - height_->stamp > kHeightValid || !attitude_at_) return;
  const Vec3 position(static_cast<double>(pose.x_y_yaw[0]), static_cast<double>(pose.x_y_yaw[1]),
                      static_cast<double>(height_->height_m));
  if (restarts_ != sent_restarts_) path_ = AlphaBetaPosition();  // a jump is no velocity
  sent_restarts_ = restarts_;
  const Duration since = pose.stamp - path_.time();
  // The first pose of a path has no velocity yet: it is not sent.
  if (path_.update(pose.stamp, position) != AlphaBetaStatus::kUpdated) return;
  Vec3 angles = view_.estimate.roll_pitch_yaw_rad.cast<double>();
  angles.z() = static_cast<double>(pose.x_y_yaw[2]);
  LinkState state;
  state.stamp = pose.stamp;
  state.reset_counter = restarts_;
  const Mat3 rotation = rotation_from_roll_pitch_yaw(angles);
  state.T_odom_base = SE3(rotation, position);
  state.velocity_body = rotation.transpose() * path_.velocity();
  state.rates_body = view_.estimate.angular_velocity_rad_s.cast<double>();
  if (pose.covariance) {
    const double height_std_m = static_cast<double>(height_->std_m.value_or(0.02F));
    state.pose_covariance = pose_covariance(*pose.covariance, height_std_m);
    Mat6 velocity = Mat6::Identity() * (kTiltStd_rad * kTiltStd_rad);
    const double ratio = velocity_variance_ratio({}, std::max(1e-3, since.seconds()));
    velocity.topLeftCorner<3, 3>() =
        ratio * state.pose_covariance->topLeftCorner<3, 3>().trace() / 3 * Mat3::Identity();
    state.velocity_covariance = velocity;
  }
  if (const auto message = to_odometry(state)) peer_.send(*message);
}

/// Sends the mean of the samples and waits for the motors' controls, which an autopilot in lock-step sends
/// for each.
void MavlinkAutopilot::exchange() {
  const auto clock = [this] { return view_.now; };
  const auto handle = [this](const MavlinkFrame& frame) { receive(frame); };
  answered_ = false;
  if (samples_ > 0) {
    const Vec3 force = swap_body(force_sum_ / samples_), rates = swap_body(rates_sum_ / samples_);
    MavHilSensor sensor;
    sensor.time_usec = static_cast<std::uint64_t>(view_.now.ns / 1000);
    sensor.xacc = static_cast<float>(force.x()), sensor.yacc = static_cast<float>(force.y());
    sensor.zacc = static_cast<float>(force.z());
    sensor.xgyro = static_cast<float>(rates.x()), sensor.ygyro = static_cast<float>(rates.y());
    sensor.zgyro = static_cast<float>(rates.z());
    sensor.fields_updated = kInertialFields;
    peer_.send(sensor);
    view_.estimate.angular_velocity_rad_s = swap_body(rates).cast<float>();
  }
  peer_.step(clock, handle);
  const Stopwatch watch;
  while (samples_ > 0 && !answered_) {
    const auto left = Duration::from_seconds(setup_.answer_limit.seconds() - watch.seconds());
    if (left <= Duration{} || !transport_->wait(left)) break;
    peer_.step(clock, handle);
  }
  unanswered_ = samples_ == 0 || answered_ ? 0 : unanswered_ + 1;
  if (unanswered_ >= setup_.most_unanswered)
    failure_ = Error{ErrorCode::kNoResult, "the autopilot does not answer (HIL_ACTUATOR_CONTROLS)",
                     transport_->name()};
  samples_ = 0;
  force_sum_.setZero(), rates_sum_.setZero();
  follow_autopilot();
}

void MavlinkAutopilot::receive(const MavlinkFrame& frame) {
  const Time now = view_.now;
  if (const auto controls = read_mavlink_message<MavHilActuatorControls>(frame)) {
    answered_ = true;
    for (std::size_t i = 0; i < controls_.size(); ++i)
      controls_[i] = std::isfinite(controls->controls[i]) ? std::clamp(controls->controls[i], 0.0F, 1.0F) : 0;
  } else if (const auto position = read_mavlink_message<MavLocalPositionNed>(frame)) {
    const Vec3 p(static_cast<double>(position->x), static_cast<double>(position->y),
                 static_cast<double>(position->z)),
        v(static_cast<double>(position->vx), static_cast<double>(position->vy),
          static_cast<double>(position->vz));
    if (!p.allFinite() || !v.allFinite()) return;
    view_.estimate.position_m = swap_world(p, AutopilotWorld::kLocalFrd).cast<float>();
    view_.estimate.velocity_m_s = swap_world(v, AutopilotWorld::kLocalFrd).cast<float>();
    position_at_ = now;
  } else if (const auto attitude = read_mavlink_message<MavAttitude>(frame)) {
    const Vec3f angles(attitude->roll, -attitude->pitch, -attitude->yaw);
    if (!angles.allFinite()) return;
    view_.estimate.roll_pitch_yaw_rad = angles;
    attitude_at_ = now;
  } else if (const auto landed = read_mavlink_message<MavExtendedSysState>(frame)) {
    view_.landed = landed->landed_state;
  } else if (const auto text = read_mavlink_message<MavStatusText>(frame)) {
    const MavlinkRemote* autopilot = peer_.autopilot(now);
    if (autopilot == nullptr || autopilot->address.system != frame.from.system) return;
    for (LinkText& said : text_reader_.add(*text, frame.from))
      note(said.severity <= kMavWarning, std::move(said.text));
  }
}

void MavlinkAutopilot::note(bool is_warning, std::string text) {
  if (texts_.size() < kMostTexts) texts_.push_back({is_warning, std::move(text)});
}

/// ArduPilot's estimator starts only when it knows a place on earth; which one does not matter indoors, but
/// it takes 0, 0 for unknown. It does not acknowledge: repeated until it estimates a position.
void MavlinkAutopilot::send_origin(const MavlinkRemote& autopilot) {
  if (autopilot.heartbeat.autopilot != kMavAutopilotArdupilot || position_at_) return;
  if (origin_at_ && view_.now - *origin_at_ < kOriginPeriod) return;
  origin_at_ = view_.now;
  constexpr std::int32_t kPlace_1e7deg = 450'000'000;
  MavSetGpsGlobalOrigin origin;
  origin.target_system = autopilot.address.system;
  origin.latitude = kPlace_1e7deg;
  origin.longitude = kPlace_1e7deg;
  origin.time_usec = static_cast<std::uint64_t>(view_.now.ns / 1000);
  peer_.send(origin);
}

void MavlinkAutopilot::follow_autopilot() {
  const Time now = view_.now;
  view_.estimate.stamp = now;
  const bool estimates = position_at_ && now - *position_at_ < kEstimateValid && attitude_at_ &&
                         now - *attitude_at_ < kEstimateValid;
  view_.estimate.planar_ready = view_.estimate.height_ready = estimates;
  if (!estimates)
    estimated_since_.reset();
  else if (!estimated_since_)
    estimated_since_ = now;
  view_.ready = estimated_since_ && now - *estimated_since_ > kReadyAfter;
  const MavlinkRemote* autopilot = peer_.autopilot(now);
  view_.armed = autopilot != nullptr && (autopilot->heartbeat.base_mode & kMavModeArmed) != 0;
  if (autopilot == nullptr) return;
  view_.autopilot = autopilot->heartbeat.autopilot;
  send_origin(*autopilot);
  if (asked_for_streams_) return;
  asked_for_streams_ = true;
  constexpr float kFast_us = 4e3F, kMedium_us = 20e3F, kSlow_us = 200e3F;
  pilot_.commands().push_back(stream(MavAttitude::kId, kFast_us));
  pilot_.commands().push_back(stream(MavLocalPositionNed::kId, kMedium_us));
  pilot_.commands().push_back(stream(MavExtendedSysState::kId, kSlow_us));
}

/// One command after the other; one that is refused takes those that wait with it. An emergency stop waits
/// for none.
void MavlinkAutopilot::send_commands() {
  CommandSender& sender = peer_.commands();
  std::deque<MavCommandLong>& waiting = pilot_.commands();
  const bool stop = pilot_.state() == AutopilotState::kError && !waiting.empty();
  if (sender.state() == CommandSender::State::kWaiting && !stop) return;
  if (std::exchange(command_runs_, false) && !stop) {
    const bool unanswered = sender.state() == CommandSender::State::kTimedOut;
    const bool refused = unanswered || sender.result() != kMavAccepted;
    refused_commands_ += refused ? 1U : 0U;
    if (refused && sent_command_ != kMavCommandSetMessageInterval) {
      waiting.clear();
      const std::string why = unanswered ? "no answer" : fmt::format("result {}", sender.result());
      note(true, fmt::format("it refuses {} ({})", name_of_command(sent_command_), why));
    }
  }
  const MavlinkRemote* autopilot = peer_.autopilot(view_.now);
  if (waiting.empty() || autopilot == nullptr) return;
  if (stop) sender.cancel();
  MavCommandLong command = waiting.front();
  waiting.pop_front();
  command.target_system = autopilot->address.system;
  command.target_component = autopilot->address.component;
  sent_command_ = command.command;
  command_runs_ = sender.send(command);
}

void MavlinkAutopilot::send_set_point() {
  const auto& target = pilot_.set_point();
  if (!target || !is_due(set_point_at_, kSetPointPeriod, view_.now)) return;
  auto message = to_position_target(*target, view_.now, *boot_, AutopilotWorld::kLocalFrd);
  const MavlinkRemote* autopilot = peer_.autopilot(view_.now);
  if (!message || autopilot == nullptr) return;
  message->target_system = autopilot->address.system;
  message->target_component = autopilot->address.component;
  peer_.send(*message);
}

AutopilotOutputs MavlinkAutopilot::outputs(Refusal refusal, bool motors_on) const {
  AutopilotOutputs out;
  out.stamp = view_.now;
  out.state = pilot_.state();
  out.phase = pilot_.phase();
  out.refusal = refusal;
  const auto& target = pilot_.set_point();
  if (target && target->position_m) out.reference.position_m = target->position_m->cast<float>();
  if (!view_.armed) return out;
  out.motors = motors_on ? MotorDemand::kControl : MotorDemand::kStart;
  for (std::size_t i = 0; i < controls_.size(); ++i)
    out.rotor_speed_rad_s[i] = controls_[i] * setup_.max_rotor_speed_rad_s;
  return out;
}

}  // namespace hm
