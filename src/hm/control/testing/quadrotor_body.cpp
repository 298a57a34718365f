#include "hm/control/testing/quadrotor_body.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace hm {
namespace {
constexpr double kStep_s = 1e-3, kThrustConstant = 9.9865e-6, kTorqueRatio_m = 0.016, kArm_m = 0.21;
constexpr double kMaxSpeed = 838, kGravity = 9.80665;
const Eigen::Vector3d kInertia(0.01, 0.01, 0.02);
}  // namespace

QuadrotorBody::QuadrotorBody(const QuadrotorBodySettings& settings) : settings_(settings) {
  hover_at({0, 0, 0});
}

void QuadrotorBody::hover_at(const Eigen::Vector3d& position_m) {
  position = position_m;
  velocity.setZero();
  rates.setZero();
  rotation.setIdentity();
  thrust_n_ = settings_.mass_kg * kGravity;
  speed.fill(std::sqrt(thrust_n_ / (4 * kThrustConstant * settings_.thrust_factor)));
  angle_ = angle_rate_ = {};
  felt_ = {0, 0, kGravity};
  seen_.clear();
  remember();
}

void QuadrotorBody::remember() {
  seen_.emplace_back(position, velocity);
  while (seen_.size() > static_cast<std::size_t>(settings_.delay_steps) + 1) seen_.pop_front();
}

double QuadrotorBody::roll() const { return std::atan2(rotation(2, 1), rotation(2, 2)); }
double QuadrotorBody::pitch() const { return std::asin(-rotation(2, 0)); }
double QuadrotorBody::yaw() const { return std::atan2(rotation(1, 0), rotation(0, 0)); }
double QuadrotorBody::tilt() const { return std::acos(std::min(1.0, rotation(2, 2))); }

void QuadrotorBody::turn_by_rotors(const std::array<float, 4>& wanted, Eigen::Vector3d& force) {
  // front, left, back, right; front and back clockwise
  std::array<double, 4> thrust{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double target = std::min(static_cast<double>(wanted[i]), kMaxSpeed);
    const double tau = target > speed[i] ? settings_.spin_up_s : settings_.spin_down_s;
    const double before = speed[i];
    speed[i] = target + (speed[i] - target) * std::exp(-kStep_s / tau);
    const double mean = 0.5 * (before + speed[i]);
    thrust[i] = settings_.thrust_factor * settings_.rotor_factor[i] * kThrustConstant * mean * mean;
  }
  const Eigen::Vector3d torque(kArm_m * (thrust[1] - thrust[3]), kArm_m * (thrust[2] - thrust[0]),
                               kTorqueRatio_m * (thrust[0] - thrust[1] + thrust[2] - thrust[3]));
  const auto acceleration = [&](const Eigen::Vector3d& w) -> Eigen::Vector3d {
    return (torque - w.cross(kInertia.cwiseProduct(w))).cwiseQuotient(kInertia);
  };
  const Eigen::Vector3d middle = rates + 0.5 * kStep_s * acceleration(rates);
  rates += kStep_s * acceleration(middle);
  const double angle = middle.norm() * kStep_s;
  if (angle > 0) rotation = rotation * Eigen::AngleAxisd(angle, middle.normalized()).toRotationMatrix();
  force = rotation.col(2) * (thrust[0] + thrust[1] + thrust[2] + thrust[3]);
}

void QuadrotorBody::turn_by_inner_loop(const RpytCommand& command, Eigen::Vector3d& force) {
  const std::array<double, 2> wanted{command.roll_rad, command.pitch_rad};
  for (std::size_t i = 0; i < 2; ++i) {
    if (settings_.inner == QuadrotorBodySettings::InnerLoop::kSecondOrder) {
      constexpr double kFrequency = 12, kDamping = 0.8;
      angle_rate_[i] += kStep_s * (kFrequency * kFrequency * (wanted[i] - angle_[i]) -
                                   2 * kDamping * kFrequency * angle_rate_[i]);
    } else {
      angle_rate_[i] = (0.75 * wanted[i] - angle_[i]) / 0.257;
    }
    angle_[i] += kStep_s * angle_rate_[i];
  }
  angle_rate_[2] += kStep_s / 0.1 * (static_cast<double>(command.yaw_rate_rad_s) - angle_rate_[2]);
  angle_[2] += kStep_s * angle_rate_[2];
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  rotation = (AngleAxisd(angle_[2], Vector3d::UnitZ()) * AngleAxisd(angle_[1], Vector3d::UnitY()) *
              AngleAxisd(angle_[0], Vector3d::UnitX()))
                 .toRotationMatrix();
  rates = {angle_rate_[0], angle_rate_[1], angle_rate_[2]};
  const double full = 4 * kThrustConstant * kMaxSpeed * kMaxSpeed;
  thrust_n_ += kStep_s / 0.05 *
               (settings_.thrust_factor * full * static_cast<double>(command.thrust_ratio) - thrust_n_);
  force = rotation.col(2) * thrust_n_;
}

void QuadrotorBody::step(const CascadeOutput& output) {
  Eigen::Vector3d force;
  if (settings_.inner == QuadrotorBodySettings::InnerLoop::kRotors)
    turn_by_rotors(output.rotor_speed_rad_s, force);
  else
    turn_by_inner_loop(output.rpyt, force);
  const Eigen::Vector3d across = velocity - velocity.dot(rotation.col(2)) * rotation.col(2);
  const Eigen::Vector3d felt = force / settings_.mass_kg - settings_.drag_per_s * across + push_m_s2;
  const Eigen::Vector3d acceleration = felt - Eigen::Vector3d(0, 0, kGravity);
  position += kStep_s * (velocity + 0.5 * kStep_s * acceleration);
  velocity += kStep_s * acceleration;
  felt_ = rotation.transpose() * felt;
  remember();
}

ControlState QuadrotorBody::seen() const {
  ControlState state;
  state.position_m = seen_.front().first.cast<float>();
  state.velocity_m_s = seen_.front().second.cast<float>();
  const Eigen::Quaterniond q(rotation);
  state.attitude = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                    static_cast<float>(q.z())};
  state.rates_rad_s = rates.cast<float>();
  state.specific_force_m_s2 = felt_.cast<float>();
  state.airborne = true;
  return state;
}

}  // namespace hm
