#include "hm/estimation/state_estimator.hpp"

#include <cmath>

namespace hm {
namespace {

/// Time after which the laser's velocity, which starts from zero, is used.
constexpr double kVelocitySettles_s = 1.0;

/// Rate of the yaw angle from body rates (Rz Ry Rx).
double yaw_rate(const Vec3& angular_velocity, const Vec3& roll_pitch_yaw) {
  const double cosine = std::cos(roll_pitch_yaw.y());
  if (std::abs(cosine) < 1e-3) return 0;  // nose up: yaw is not defined
  return (angular_velocity.y() * std::sin(roll_pitch_yaw.x()) +
          angular_velocity.z() * std::cos(roll_pitch_yaw.x())) /
         cosine;
}

bool is_finite(const ImuSample& sample) {
  return sample.angular_velocity_rad_s.allFinite() && sample.specific_force_m_s2.allFinite() &&
         (!sample.R_world_imu || sample.R_world_imu->allFinite());
}

}  // namespace

SE3 VehicleState::T_odom_base() const {
  return {rotation_from_roll_pitch_yaw(roll_pitch_yaw_rad), position_m};
}

StateEstimator::StateEstimator(const StateEstimatorParams& params, const SE3& T_base_imu)
    : params_(params),
      T_base_imu_(T_base_imu),
      fusion_(params.fusion),
      tilt_(params.tilt),
      gravity_(params.tilt),
      laser_velocity_({0.5, 0.15, params.pose_alpha_beta.max_gap_s}),
      thesis_(params.thesis),
      thesis_position_(params.pose_alpha_beta),
      thesis_yaw_(params.pose_alpha_beta),
      thesis_height_(params.height_alpha_beta) {}

FusionStatus StateEstimator::add_imu(const ImuSample& sample) {
  if (!is_finite(sample)) {
    ++imu_counts_.invalid;
    return FusionStatus::kInvalid;
  }
  if (any_time_ && sample.stamp <= stamp_) {
    ++imu_counts_.time_backwards;
    return FusionStatus::kTimeBackwards;
  }
  ++imu_counts_.accepted;
  const double dt_s = any_time_ ? (sample.stamp - stamp_).seconds() : 0;
  const Reading reading{T_base_imu_.rotation() * sample.angular_velocity_rad_s,
                        T_base_imu_.rotation() * sample.specific_force_m_s2};
  angular_velocity_rad_s_ = reading.angular_velocity_base_rad_s;
  update_tilt(sample, reading, dt_s);
  // An off-centre accelerometer also measures the centripetal acceleration, which is compensated; the angular
  // acceleration is neglected, since it would require differentiating noise.
  const Vec3& arm = T_base_imu_.translation();
  const Vec3 centripetal = angular_velocity_rad_s_.cross(angular_velocity_rad_s_.cross(arm));
  const Mat3 R_level_base =
      rotation_from_roll_pitch_yaw({roll_pitch_yaw_rad_.x(), roll_pitch_yaw_rad_.y(), 0});
  FusionInput input;
  input.stamp = sample.stamp;
  input.acceleration_level_m_s2 =
      R_level_base * (reading.specific_force_base_m_s2 - centripetal) - Vec3(0, 0, kGravity_m_s2);
  input.own_tilt = !sample.R_world_imu;
  input.yaw_rate_rad_s = yaw_rate(angular_velocity_rad_s_, roll_pitch_yaw_rad_);
  return step(input, dt_s);
}

/// Specific force without the vehicle's acceleration, once the filters have estimated its velocity.
Vec3 StateEstimator::gravity_felt(const Vec3& specific_force_base_m_s2, double dt_s) {
  const bool known =
      params_.mode == FusionMode::kDelayAware && fusion_.started() && fusion_.state().planar.ready;
  if (!known) {
    gravity_.reset();
    return specific_force_base_m_s2;
  }
  const FusionState& now = fusion_.state();
  const Eigen::Quaterniond R_odom_base(
      rotation_from_roll_pitch_yaw({roll_pitch_yaw_rad_.x(), roll_pitch_yaw_rad_.y(), now.yaw.yaw_rad}));
  const double climb_m_s = now.vertical.ready ? now.vertical.velocity(0) : 0;
  const Vec2& planar_m_s = laser_velocity_.velocity();
  return gravity_.update(specific_force_base_m_s2, {planar_m_s.x(), planar_m_s.y(), climb_m_s}, R_odom_base,
                         dt_s);
}

void StateEstimator::update_tilt(const ImuSample& sample, const Reading& reading, double dt_s) {
  if (tilt_.ready() && dt_s > params_.fusion.max_gap_s) {  // rotation during the gap is unknown
    tilt_ = TiltFilter(params_.tilt);
    gravity_.reset();
  } else {
    tilt_.update(reading.angular_velocity_base_rad_s, gravity_felt(reading.specific_force_base_m_s2, dt_s),
                 dt_s);
  }
  if (sample.R_world_imu)
    roll_pitch_yaw_rad_ = roll_pitch_yaw(*sample.R_world_imu * T_base_imu_.rotation().transpose());
  else if (tilt_.ready())
    roll_pitch_yaw_rad_ = roll_pitch_yaw(tilt_.R_world_body().toRotationMatrix());
}

FusionStatus StateEstimator::advance(Time stamp) {
  if (any_time_ && stamp <= stamp_) return FusionStatus::kTimeBackwards;
  angular_velocity_rad_s_.setZero();
  return step({stamp, Vec3::Zero(), 0, false}, any_time_ ? (stamp - stamp_).seconds() : 0);
}

FusionStatus StateEstimator::step(const FusionInput& input, double dt_s) {
  any_time_ = true;
  stamp_ = input.stamp;
  if (params_.mode == FusionMode::kDelayAware) return fusion_.add_input(input);
  if (dt_s <= 0) return FusionStatus::kStarted;
  const double c = std::cos(thesis_.yaw().yaw_rad()), s = std::sin(thesis_.yaw().yaw_rad());
  const Vec3& level = input.acceleration_level_m_s2;
  thesis_.predict({c * level.x() - s * level.y(), s * level.x() + c * level.y(), level.z()},
                  input.yaw_rate_rad_s, dt_s);
  return FusionStatus::kOk;
}

void StateEstimator::follow_laser_velocity(const PlanarPose& pose) {
  const auto status = laser_velocity_.update(pose.stamp, pose.T_odom_base.translation());
  if (status == AlphaBetaStatus::kFirst || status == AlphaBetaStatus::kRestarted)
    laser_velocity_since_ = pose.stamp;
}

FusionStatus StateEstimator::add_pose(const PlanarPose& pose) {
  if (params_.mode == FusionMode::kDelayAware) {
    const FusionStatus status = fusion_.add_pose(pose);
    if (status == FusionStatus::kOk || status == FusionStatus::kWaiting || status == FusionStatus::kStarted)
      follow_laser_velocity(pose);
    if (!any_time_ && fusion_.started()) any_time_ = true, stamp_ = fusion_.stamp();
    return status;
  }
  if (!pose.T_odom_base.vector().allFinite()) {
    ++thesis_poses_.invalid;
    return FusionStatus::kInvalid;
  }
  const auto status = thesis_position_.update(pose.stamp, pose.T_odom_base.translation());
  if (status == AlphaBetaStatus::kTimeBackwards) {
    ++thesis_poses_.time_backwards;
    return FusionStatus::kTimeBackwards;
  }
  thesis_yaw_.update(pose.stamp, pose.T_odom_base.angle());
  if (!thesis_planar_ready_) thesis_.reset_planar(pose.T_odom_base.translation(), pose.T_odom_base.angle());
  thesis_.correct_planar(thesis_position_.position(), thesis_position_.velocity(), thesis_yaw_.angle_rad());
  ++thesis_poses_.accepted;
  thesis_planar_ready_ = true;
  return status == AlphaBetaStatus::kFirst ? FusionStatus::kStarted : FusionStatus::kOk;
}

FusionStatus StateEstimator::add_height(const HeightReading& height) {
  if (params_.mode == FusionMode::kDelayAware) {
    const FusionStatus status = fusion_.add_height(height);
    if (!any_time_ && fusion_.started()) any_time_ = true, stamp_ = fusion_.stamp();
    return status;
  }
  const auto status = thesis_height_.update(height.stamp, AlphaBetaHeight::Vector(height.height_m));
  if (status == AlphaBetaStatus::kInvalid) {
    ++thesis_heights_.invalid;
    return FusionStatus::kInvalid;
  }
  if (status == AlphaBetaStatus::kTimeBackwards) {
    ++thesis_heights_.time_backwards;
    return FusionStatus::kTimeBackwards;
  }
  if (!thesis_height_ready_) thesis_.reset_height(height.height_m);
  thesis_.correct_height(thesis_height_.position()(0), thesis_height_.velocity()(0));
  ++thesis_heights_.accepted;
  thesis_height_ready_ = true;
  return status == AlphaBetaStatus::kFirst ? FusionStatus::kStarted : FusionStatus::kOk;
}

FusionCounts StateEstimator::pose_counts() const {
  return params_.mode == FusionMode::kThesis ? thesis_poses_ : fusion_.pose_counts();
}
FusionCounts StateEstimator::height_counts() const {
  return params_.mode == FusionMode::kThesis ? thesis_heights_ : fusion_.height_counts();
}

VehicleState StateEstimator::thesis_state() const {
  VehicleState state;
  state.planar_ready = thesis_planar_ready_;
  state.height_ready = thesis_height_ready_;
  state.position_m = thesis_.position_m();
  state.velocity_m_s = thesis_.velocity_m_s();
  state.roll_pitch_yaw_rad.z() = wrap_angle(thesis_.yaw().yaw_rad());
  state.planar_covariance.diagonal() << thesis_.x().covariance()(0, 0), thesis_.y().covariance()(0, 0);
  state.planar_velocity_covariance.diagonal() << thesis_.x().covariance()(1, 1),
      thesis_.y().covariance()(1, 1);
  state.height_variance = thesis_.z().covariance()(0, 0);
  state.climb_variance = thesis_.z().covariance()(1, 1);
  state.yaw_variance = thesis_.yaw().variance();
  return state;
}

VehicleState StateEstimator::state() const {
  VehicleState state;
  if (params_.mode == FusionMode::kThesis) {
    state = thesis_state();
  } else if (fusion_.started()) {
    const FusionState& now = fusion_.state();
    state.planar_ready = now.planar.ready;
    state.height_ready = now.vertical.ready;
    state.position_m << now.planar.position, now.vertical.position;
    state.velocity_m_s << now.planar.velocity, now.vertical.velocity;
    state.roll_pitch_yaw_rad.z() = now.yaw.yaw_rad;
    state.planar_covariance = now.planar.pp;
    state.planar_velocity_covariance = now.planar.vv;
    state.height_variance = now.vertical.pp(0);
    state.climb_variance = now.vertical.vv(0);
    state.yaw_variance = now.yaw.yy;
    state.acceleration_bias_m_s2 << now.planar.bias, now.vertical.bias;
    state.yaw_rate_bias_rad_s = now.yaw.bias_rad_s;
  }
  state.stamp = stamp_;
  state.roll_pitch_yaw_rad.head<2>() = roll_pitch_yaw_rad_.head<2>();
  state.angular_velocity_rad_s = angular_velocity_rad_s_;
  return state;
}

}  // namespace hm
