#include "hm/flight/testing/flight_rig.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr int kSensorPeriod_ms = 25, kPoseDelay_ms = 20, kMotorsTake_ms = 300;
constexpr double kPoseNoise_m = 0.005, kHeightNoise_m = 0.005, kYawNoise_rad = 0.003, kForceNoise_m_s2 = 0.01;

}  // namespace

FlightRig::FlightRig(const AutopilotParams& params, const QuadrotorBodySettings& body_settings)
    : autopilot(std::make_unique<Autopilot>(params)), body(body_settings) {
  body.position.z() = kFeet_m;
  body.speed = {};
}

void FlightRig::sense() {
  const ControlState truth = body.seen();
  inputs = {};
  inputs.now = now;
  inputs.motors_on = motors_on_;
  inputs.rc_enabled = rc;
  inputs.computer_alive = alive;
  inputs.battery_ratio = battery_ratio;
  inputs.obstacle_m = obstacle_m;
  if (clearance) inputs.clearance_m = static_cast<float>(body.position.z() - kFeet_m);
  if (imu) {
    InertialReading<float> reading;
    reading.stamp = now + Duration::from_seconds(imu_ahead_s);
    reading.angular_velocity_rad_s = truth.rates_rad_s;
    reading.specific_force_m_s2 = stands() ? Vec3f(0, 0, kGravityF_m_s2) : truth.specific_force_m_s2;
    reading.specific_force_m_s2.z() += static_cast<float>(imu_rng_.normal(0, kForceNoise_m_s2));
    reading.R_world_imu = body.rotation.cast<float>();
    inputs.imu = reading;
  }
  past_.push_front({body.position.x(), body.position.y(), body.position.z(), body.yaw()});
  if (past_.size() > kPoseDelay_ms + 1) past_.pop_back();
  const auto noise = [&](double sigma) { return static_cast<float>(rng_.normal(0, sigma)); };
  const float nx = noise(kPoseNoise_m), ny = noise(kPoseNoise_m), nz = noise(kHeightNoise_m),
              nyaw = noise(kYawNoise_rad);
  if (pose && steps_ % kSensorPeriod_ms == 0 && past_.size() > kPoseDelay_ms) {
    const Eigen::Vector4d was = past_.back();
    const float c = std::cos(pose_turned_rad), s = std::sin(pose_turned_rad);
    const auto x = static_cast<float>(was.x()), y = static_cast<float>(was.y());
    last_pose = now - Duration{1'000'000 * kPoseDelay_ms};
    inputs.pose = PoseReading<float>{
        last_pose,
        {c * x - s * y + nx + pose_shift_m, s * x + c * y + ny, static_cast<float>(was.w()) + nyaw},
        {}};
  }
  if (height && steps_ % kSensorPeriod_ms == kSensorPeriod_ms / 2) {
    last_height = now;
    inputs.height = BasicHeightReading<float>{now, static_cast<float>(body.position.z()) + nz, {}};
  }
}

void FlightRig::turn_motors(MotorDemand demand) {
  const bool starts = demand == MotorDemand::kStart, stops = demand == MotorDemand::kStop;
  motor_steps_ = (starts || stops) ? motor_steps_ + 1 : 0;
  if (demand == MotorDemand::kOff) motors_on_ = false;
  if (motors_work && motor_steps_ > kMotorsTake_ms) motors_on_ = starts;
}

void FlightRig::move(const AutopilotOutputs& outputs) {
  turn_motors(outputs.motors);
  CascadeOutput command;
  command.rpyt = outputs.rpyt;
  command.rotor_speed_rad_s = outputs.rotor_speed_rad_s;
  body.step(command);
  if (body.position.z() < kFeet_m) {  // the floor: feet that stick
    hardest_touch_m_s = std::max(hardest_touch_m_s, -body.velocity.z());
    const double yaw = body.yaw();
    body.position.z() = kFeet_m;
    body.velocity.setZero();
    body.rates.setZero();
    body.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  largest_tilt_rad = std::max(largest_tilt_rad, body.tilt());
}

void FlightRig::step() {
  autopilot->step(inputs);
  if (after_step) after_step(*this);
  move(drive ? drive(inputs) : autopilot->outputs());
  ++steps_;
}

void FlightRig::run_ms(int count) {
  for (int i = 0; i < count; ++i) {
    now = now + Duration{1'000'000};
    sense();
    step();
  }
}

Refusal FlightRig::send(FlightCommand command) {
  now = now + Duration{1'000'000};
  sense();
  command.stamp = now;
  if (command.pilot == 0) command.pilot = 1;
  inputs.command = command;
  step();
  return autopilot->outputs().refusal;
}

Refusal FlightRig::send(CommandKind kind) {
  FlightCommand command;
  command.kind = kind;
  return send(command);
}

Refusal FlightRig::send_mode(FlightPhase mode) {
  FlightCommand command;
  command.kind = CommandKind::kMode;
  command.mode = mode;
  return send(command);
}

Refusal FlightRig::go_to(float x_m, float y_m, float z_m, float yaw_rad) {
  FlightCommand command;
  command.kind = CommandKind::kGoTo;
  command.position_m = {x_m, y_m, z_m};
  command.yaw_rad = yaw_rad;
  return send(command);
}

Refusal FlightRig::fly_velocity(float x_m_s, float y_m_s, float z_m_s) {
  FlightCommand command;
  command.kind = CommandKind::kVelocity;
  command.velocity_m_s = {x_m_s, y_m_s, z_m_s};
  return send(command);
}

void FlightRig::take_off_step(int i) {
  if (i == 1500)
    send(CommandKind::kToggleEngage);
  else if (i == 2500)
    send(CommandKind::kTakeOff);
  else if (i == 2501)
    send(CommandKind::kRelease);
  else
    run_ms(1);
}

void FlightRig::take_off() {
  run_ms(1500);
  send(CommandKind::kToggleEngage);
  run_ms(1000);
  send(CommandKind::kTakeOff);
  send(CommandKind::kRelease);  // nobody has control, so that no sign of life is missed
  run_ms(5000);
}

}  // namespace hm
