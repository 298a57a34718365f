#include "hm/estimation/state_estimator.hpp"

#include <cmath>

namespace hm {
namespace {

/// Rate of the yaw angle from body rates (Rz Ry Rx).
template <class Scalar>
Scalar yaw_rate(const FilterVector<Scalar, 3>& angular_velocity,
                const FilterVector<Scalar, 3>& roll_pitch_yaw) {
  const Scalar level = filter_sin_cos(roll_pitch_yaw.y()).cos;
  if (std::abs(level) < Scalar(1e-3)) return 0;  // nose up: yaw is not defined
  const auto [sine, cosine] = filter_sin_cos(roll_pitch_yaw.x());
  return (angular_velocity.y() * sine + angular_velocity.z() * cosine) / level;
}

template <class Scalar>
bool is_finite(const InertialReading<Scalar>& sample) {
  return sample.angular_velocity_rad_s.allFinite() && sample.specific_force_m_s2.allFinite() &&
         (!sample.R_world_imu || sample.R_world_imu->allFinite());
}

}  // namespace

template <class Scalar, FusionCapacity kCapacity>
BasicStateEstimator<Scalar, kCapacity>::BasicStateEstimator(const Params& params,
                                                            const ImuMounting<Scalar>& mounting)
    : params_(params),
      mounting_(mounting),
      fusion_(params.fusion),
      tilt_(params.tilt),
      gravity_(params.tilt),
      laser_velocity_({Scalar(0.5), Scalar(0.15), params.pose_alpha_beta.max_gap_s}),
      thesis_(params.thesis),
      thesis_position_(params.pose_alpha_beta),
      thesis_yaw_(params.pose_alpha_beta),
      thesis_height_(params.height_alpha_beta) {}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::add_imu(const InertialReading<Scalar>& sample) {
  if (!is_finite(sample)) {
    ++imu_counts_.invalid;
    return FusionStatus::kInvalid;
  }
  if (any_time_ && sample.stamp <= stamp_) {
    ++imu_counts_.time_backwards;
    return FusionStatus::kTimeBackwards;
  }
  ++imu_counts_.accepted;
  const Scalar dt_s = any_time_ ? seconds_of<Scalar>(sample.stamp - stamp_) : 0;
  const BodyReading reading{mounting_.R_base_imu * sample.angular_velocity_rad_s,
                            mounting_.R_base_imu * sample.specific_force_m_s2};
  angular_velocity_rad_s_ = reading.angular_velocity_base_rad_s;
  update_tilt(sample, reading, dt_s);
  // An off-centre accelerometer also measures the centripetal acceleration, which is compensated; the angular
  // acceleration is neglected, since it would require differentiating noise.
  const Vector3& arm = mounting_.p_base_imu_m;
  const Vector3 centripetal = angular_velocity_rad_s_.cross(angular_velocity_rad_s_.cross(arm));
  const FilterMatrix<Scalar, 3> R_level_base =
      rotation_from_angles(Vector3(roll_pitch_yaw_rad_.x(), roll_pitch_yaw_rad_.y(), 0));
  BasicFusionInput<Scalar> input;
  input.stamp = sample.stamp;
  input.acceleration_level_m_s2 = R_level_base * (reading.specific_force_base_m_s2 - centripetal) -
                                  Vector3(0, 0, kFilterGravity_m_s2<Scalar>);
  input.own_tilt = !sample.R_world_imu;
  input.yaw_rate_rad_s = yaw_rate<Scalar>(angular_velocity_rad_s_, roll_pitch_yaw_rad_);
  return step(input, dt_s);
}

/// Specific force without the vehicle's acceleration, once the filters have estimated its velocity.
template <class Scalar, FusionCapacity kCapacity>
typename BasicStateEstimator<Scalar, kCapacity>::Vector3 BasicStateEstimator<Scalar, kCapacity>::gravity_felt(
    const Vector3& specific_force_base_m_s2, Scalar dt_s) {
  const bool known =
      params_.mode == FusionMode::kDelayAware && fusion_.started() && fusion_.state().planar.ready;
  if (!known) {
    gravity_.reset();
    return specific_force_base_m_s2;
  }
  const BasicFusionState<Scalar>& now = fusion_.state();
  const FilterQuaternion<Scalar> R_odom_base(
      rotation_from_angles(Vector3(roll_pitch_yaw_rad_.x(), roll_pitch_yaw_rad_.y(), now.yaw.yaw_rad)));
  const Scalar climb_m_s = now.vertical.ready ? now.vertical.velocity(0) : 0;
  const FilterVector<Scalar, 2>& planar_m_s = laser_velocity_.velocity();
  return gravity_.update(specific_force_base_m_s2, {planar_m_s.x(), planar_m_s.y(), climb_m_s}, R_odom_base,
                         dt_s);
}

template <class Scalar, FusionCapacity kCapacity>
void BasicStateEstimator<Scalar, kCapacity>::update_tilt(const InertialReading<Scalar>& sample,
                                                         const BodyReading& reading, Scalar dt_s) {
  if (tilt_.ready() && dt_s > params_.fusion.kMaxGap_s) {  // rotation during the gap is unknown
    tilt_ = BasicTiltFilter<Scalar>(params_.tilt);
    gravity_.reset();
  } else {
    tilt_.update(reading.angular_velocity_base_rad_s, gravity_felt(reading.specific_force_base_m_s2, dt_s),
                 dt_s);
  }
  if (sample.R_world_imu)
    roll_pitch_yaw_rad_ =
        angles_of(FilterMatrix<Scalar, 3>(*sample.R_world_imu * mounting_.R_base_imu.transpose()));
  else if (tilt_.ready())
    roll_pitch_yaw_rad_ = angles_of(FilterMatrix<Scalar, 3>(tilt_.R_world_body().toRotationMatrix()));
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::advance(Time stamp) {
  if (any_time_ && stamp <= stamp_) return FusionStatus::kTimeBackwards;
  angular_velocity_rad_s_.setZero();
  return step({stamp, Vector3::Zero(), 0, false}, any_time_ ? seconds_of<Scalar>(stamp - stamp_) : 0);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::step(const BasicFusionInput<Scalar>& input,
                                                          Scalar dt_s) {
  any_time_ = true;
  stamp_ = input.stamp;
  if (params_.mode == FusionMode::kDelayAware) return fusion_.add_input(input);
  if (dt_s <= 0) return FusionStatus::kStarted;
  const auto [s, c] = filter_sin_cos(thesis_.yaw().yaw_rad());
  const Vector3& level = input.acceleration_level_m_s2;
  thesis_.predict({c * level.x() - s * level.y(), s * level.x() + c * level.y(), level.z()},
                  input.yaw_rate_rad_s, dt_s);
  return FusionStatus::kOk;
}

template <class Scalar, FusionCapacity kCapacity>
void BasicStateEstimator<Scalar, kCapacity>::follow_laser_velocity(const PoseReading<Scalar>& pose) {
  laser_velocity_.update(pose.stamp, pose.x_y_yaw.template head<2>());
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::add_pose(const PoseReading<Scalar>& pose) {
  if (params_.mode == FusionMode::kDelayAware) {
    const FusionStatus status = fusion_.add_pose(pose);
    if (status == FusionStatus::kOk || status == FusionStatus::kWaiting || status == FusionStatus::kStarted)
      follow_laser_velocity(pose);
    if (!any_time_ && fusion_.started()) any_time_ = true, stamp_ = fusion_.stamp();
    return status;
  }
  return add_pose_as_published(pose);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::add_pose_as_published(const PoseReading<Scalar>& pose) {
  if (!pose.x_y_yaw.allFinite()) {
    ++thesis_poses_.invalid;
    return FusionStatus::kInvalid;
  }
  const auto status = thesis_position_.update(pose.stamp, pose.x_y_yaw.template head<2>());
  if (status == AlphaBetaStatus::kTimeBackwards) {
    ++thesis_poses_.time_backwards;
    return FusionStatus::kTimeBackwards;
  }
  thesis_yaw_.update(pose.stamp, pose.x_y_yaw.z());
  if (!thesis_planar_ready_) thesis_.reset_planar(pose.x_y_yaw.template head<2>(), pose.x_y_yaw.z());
  thesis_.correct_planar(thesis_position_.position(), thesis_position_.velocity(), thesis_yaw_.angle_rad());
  ++thesis_poses_.accepted;
  thesis_planar_ready_ = true;
  return status == AlphaBetaStatus::kFirst ? FusionStatus::kStarted : FusionStatus::kOk;
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicStateEstimator<Scalar, kCapacity>::add_height(const BasicHeightReading<Scalar>& height) {
  if (params_.mode == FusionMode::kDelayAware) {
    const FusionStatus status = fusion_.add_height(height);
    if (!any_time_ && fusion_.started()) any_time_ = true, stamp_ = fusion_.stamp();
    return status;
  }
  const auto status = thesis_height_.update(height.stamp, FilterVector<Scalar, 1>(height.height_m));
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

template <class Scalar, FusionCapacity kCapacity>
const FusionCounts& BasicStateEstimator<Scalar, kCapacity>::pose_counts() const {
  return params_.mode == FusionMode::kThesis ? thesis_poses_ : fusion_.pose_counts();
}
template <class Scalar, FusionCapacity kCapacity>
const FusionCounts& BasicStateEstimator<Scalar, kCapacity>::height_counts() const {
  return params_.mode == FusionMode::kThesis ? thesis_heights_ : fusion_.height_counts();
}

template <class Scalar, FusionCapacity kCapacity>
void BasicStateEstimator<Scalar, kCapacity>::fill_published_state(BasicVehicleState<Scalar>& state) const {
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
}

template <class Scalar, FusionCapacity kCapacity>
BasicVehicleState<Scalar> BasicStateEstimator<Scalar, kCapacity>::state() const {
  BasicVehicleState<Scalar> state;
  if (params_.mode == FusionMode::kThesis) {
    fill_published_state(state);
  } else if (fusion_.started()) {
    const BasicFusionState<Scalar>& now = fusion_.state();
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
  state.roll_pitch_yaw_rad.template head<2>() = roll_pitch_yaw_rad_.template head<2>();
  state.angular_velocity_rad_s = angular_velocity_rad_s_;
  return state;
}

template class BasicStateEstimator<double, kHostCapacity>;
template class BasicStateEstimator<float, kBoardCapacity>;

}  // namespace hm
