#include "hm/estimation/delayed_fusion.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

double square(double value) { return value * value; }

bool is_covariance(const Mat3& matrix) {
  if (!matrix.allFinite() ||
      (matrix - matrix.transpose()).cwiseAbs().maxCoeff() > 1e-6 * matrix.cwiseAbs().maxCoeff())
    return false;
  const double minor = matrix(0, 0) * matrix(1, 1) - matrix(0, 1) * matrix(1, 0);
  // Semidefinite within rounding: a direction without information is none, one with negative variance a bug.
  return matrix.diagonal().minCoeff() >= 0 && minor >= -1e-9 * matrix(0, 0) * matrix(1, 1);
}

Mat2 turn(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat2 rotation;
  rotation << c, -s, s, c;
  return rotation;
}

FusionCounts sum(FusionCounts counts, const FusionCounts& ignored) {
  counts.too_old += ignored.too_old;
  counts.from_future += ignored.from_future;
  counts.time_backwards += ignored.time_backwards;
  counts.invalid += ignored.invalid;
  return counts;
}

}  // namespace

FusionCounts DelayedFusion::pose_counts() const {
  return sum(started() ? state().poses : FusionCounts{}, ignored_poses_);
}
FusionCounts DelayedFusion::height_counts() const {
  return sum(started() ? state().heights : FusionCounts{}, ignored_heights_);
}

FusionStatus DelayedFusion::add_input(const FusionInput& input) {
  if (!input.acceleration_level_m_s2.allFinite() || !std::isfinite(input.yaw_rate_rad_s))
    return FusionStatus::kInvalid;
  if (!started()) {
    moment(inputs_size_++) = {input.stamp, input, {}};
    filter_forward(0, 0);
    return FusionStatus::kStarted;
  }
  const double dt_s = (input.stamp - stamp()).seconds();
  if (input.stamp <= stamp()) return FusionStatus::kTimeBackwards;
  FusionInput used = input;
  // After a long gap the last sample is not valid for the interval.
  const bool gap = dt_s > params_.max_gap_s;
  if (gap) used = {input.stamp, Vec3::Zero(), 0, false};
  if (inputs_size_ == kMaxInputs) drop_oldest_moment();
  moment(inputs_size_++) = {input.stamp, used, {}};
  std::size_t first = measurements_size_;
  while (first > 0 && measurements_[first - 1].outcome == FusionStatus::kWaiting) --first;
  filter_forward(inputs_size_ - 1, first);
  forget_before(input.stamp - Duration::from_seconds(params_.max_delay_s));
  return gap && input.from_imu ? FusionStatus::kGap : FusionStatus::kOk;
}

FusionStatus DelayedFusion::add_pose(const PlanarPose& pose) {
  Measurement measurement{pose.stamp, Kind::kPose, pose.T_odom_base.vector(), Mat3::Zero()};
  if (pose.covariance) {
    measurement.covariance = *pose.covariance;
    measurement.covariance.diagonal() +=
        Vec3(square(params_.added_position_std_m), square(params_.added_position_std_m),
             square(params_.added_yaw_std_rad));
  } else {
    measurement.covariance.diagonal() << square(params_.position_std_m), square(params_.position_std_m),
        square(params_.yaw_std_rad);
  }
  if (!measurement.value.allFinite() || !is_covariance(measurement.covariance)) {
    ++ignored_poses_.invalid;
    return FusionStatus::kInvalid;
  }
  return add(measurement, ignored_poses_);
}

FusionStatus DelayedFusion::add_height(const HeightReading& height) {
  Measurement measurement{height.stamp, Kind::kHeight, Vec3(height.height_m, 0, 0), Mat3::Zero()};
  const double std_m = height.std_m.value_or(params_.height_std_m);
  measurement.covariance(0, 0) = square(std_m);
  if (!std::isfinite(height.height_m) || !std::isfinite(std_m) || std_m <= 0) {
    ++ignored_heights_.invalid;
    return FusionStatus::kInvalid;
  }
  return add(measurement, ignored_heights_);
}

FusionStatus DelayedFusion::add(const Measurement& arrived, FusionCounts& ignored) {
  Measurement measurement = arrived;
  if (!started()) {
    moment(inputs_size_++) = {measurement.stamp, {measurement.stamp, Vec3::Zero(), 0, false}, {}};
    filter_forward(0, 0);
  }
  if (!params_.delay_compensation) measurement.stamp = std::max(measurement.stamp, stamp());
  if (measurements_size_ == kMaxMeasurements) drop_oldest_measurement();
  if (measurement.stamp < moment(0).stamp || (stamp() - measurement.stamp).seconds() > params_.max_delay_s) {
    ++ignored.too_old;
    return FusionStatus::kTooOld;
  }
  if ((measurement.stamp - stamp()).seconds() > params_.kMaxLead_s) {
    ++ignored.from_future;
    return FusionStatus::kFromFuture;
  }
  const std::size_t place = insert(measurement);
  if (measurement.stamp > stamp()) return FusionStatus::kWaiting;
  std::size_t index = inputs_size_ - 1;
  while (index > 0 && moment(index - 1).stamp >= measurement.stamp) --index;
  // The whole interval is filtered again, including what lies before the new measurement.
  std::size_t first = place;
  while (first > 0 && index > 0 && measurements_[first - 1].stamp > moment(index - 1).stamp) --first;
  if (index == 0) {  // exactly at the oldest moment, whose state already holds what came before
    measurements_[place].outcome = apply(moment(0).state, measurements_[place]);
    first = place + 1;
    index = 1;
  }
  filter_forward(index, first);
  return measurements_[place].outcome;
}

/// Removes the oldest measurement. Refiltering must then not start before it.
void DelayedFusion::drop_oldest_measurement() {
  const Time gone = measurements_[0].stamp;
  while (inputs_size_ > 1 && moment(0).stamp < gone) drop_oldest_moment();
  std::move(measurements_.begin() + 1, measurements_.end(), measurements_.begin());
  --measurements_size_;
}

void DelayedFusion::drop_oldest_moment() {
  inputs_begin_ = (inputs_begin_ + 1) % kMaxInputs;
  --inputs_size_;
}

/// Inserts after all measurements that are not newer.
std::size_t DelayedFusion::insert(const Measurement& measurement) {
  std::size_t place = measurements_size_++;
  for (; place > 0 && measurement.stamp < measurements_[place - 1].stamp; --place)
    measurements_[place] = measurements_[place - 1];
  measurements_[place] = measurement;
  return place;
}

/// Keeps one moment at or before `time`, to start from.
void DelayedFusion::forget_before(Time time) {
  while (inputs_size_ > 2 && moment(1).stamp <= time) drop_oldest_moment();
  std::size_t gone = 0;
  while (gone < measurements_size_ && measurements_[gone].stamp <= moment(0).stamp) ++gone;
  std::move(measurements_.begin() + static_cast<std::ptrdiff_t>(gone),
            measurements_.begin() + static_cast<std::ptrdiff_t>(measurements_size_), measurements_.begin());
  measurements_size_ -= gone;
}

/// Filters the intervals from `index` to the newest, starting at the state before, with the measurements from
/// `measurement` on.
void DelayedFusion::filter_forward(std::size_t index, std::size_t measurement) {
  for (; index < inputs_size_; ++index) {
    Moment& here = moment(index);
    Time now = here.stamp;
    if (index > 0) {
      now = moment(index - 1).stamp;
      here.state = moment(index - 1).state;
    }
    for (; measurement < measurements_size_ && measurements_[measurement].stamp <= here.stamp;
         ++measurement) {
      Measurement& next = measurements_[measurement];
      if (next.stamp > now) {
        predict(here.state, here.input, (next.stamp - now).seconds());
        now = next.stamp;
      }
      next.outcome = apply(here.state, next);
    }
    if (here.stamp > now) predict(here.state, here.input, (here.stamp - now).seconds());
  }
}

void DelayedFusion::predict(FusionState& state, const FusionInput& input, double dt_s) const {
  const FusionParams& p = params_;
  const double felt_density =
      input.own_tilt ? p.kOwnTiltAccelerationDensity_m_s2_sqrt_hz : p.acceleration_density_m_s2_sqrt_hz;
  const NoiseDensity acceleration{
      square(input.from_imu ? felt_density : p.kGapAccelerationDensity_m_s2_sqrt_hz),
      square(p.kAccelerationBiasWalk_m_s3_sqrt_hz)};
  const NoiseDensity yaw_rate{
      square(input.from_imu ? p.kYawRateDensity_rad_s_sqrt_hz : p.kGapYawRateDensity_rad_s_sqrt_hz),
      square(p.kYawRateBiasWalk_rad_s2_sqrt_hz)};
  using Scalar = BiasKalman<1>::Vector;
  const Vec3& felt = input.acceleration_level_m_s2;
  if (state.planar.ready && input.from_imu) {
    const double rate = input.yaw_rate_rad_s - state.yaw.bias_rad_s;
    const Mat2 R_world_level = turn(state.yaw.yaw_rad + 0.5 * dt_s * rate);
    state.planar.predict(felt.head<2>(), R_world_level, dt_s, acceleration);
    state.yaw.predict(input.yaw_rate_rad_s, dt_s, yaw_rate);
  } else if (state.planar.ready) {
    // Without IMU data the velocity is constant and independent of the bias.
    state.planar.predict(Vec2::Zero(), Mat2::Zero(), dt_s, acceleration);
    state.yaw.yy += yaw_rate.input * dt_s;
    state.yaw.bb += yaw_rate.bias * dt_s;
  }
  if (state.vertical.ready)
    state.vertical.predict(Scalar(felt.z()), Scalar(input.from_imu ? 1.0 : 0.0), dt_s, acceleration);
}

FusionStatus DelayedFusion::apply(FusionState& state, const Measurement& measurement) const {
  return measurement.kind == Kind::kPose ? apply_pose(state, measurement) : apply_height(state, measurement);
}

FusionStatus DelayedFusion::apply_pose(FusionState& state, const Measurement& measurement) const {
  const Vec2 position = measurement.value.head<2>();
  const Mat2 covariance = measurement.covariance.topLeftCorner<2, 2>();
  const double yaw_variance = measurement.covariance(2, 2);
  const auto start = [&] {
    state.planar.start(position, covariance,
                       {params_.kInitialSpeedStd_m_s, params_.kInitialAccelerationBiasStd_m_s2});
    state.yaw.start(measurement.value.z(), yaw_variance, params_.kInitialYawRateBiasStd_rad_s);
    state.poses_rejected_in_a_row = 0;
  };
  if (!state.planar.ready) {
    start();
    ++state.poses.accepted;
    return FusionStatus::kStarted;
  }
  const auto planar = state.planar.innovation(position, covariance);
  const auto yaw = state.yaw.innovation(measurement.value.z(), yaw_variance);
  if (planar.chi2 + yaw.chi2 <= params_.pose_gate_chi2) {
    state.planar.correct(planar);
    state.yaw.correct(yaw);
    state.poses_rejected_in_a_row = 0;
    ++state.poses.accepted;
    return FusionStatus::kOk;
  }
  if (++state.poses_rejected_in_a_row <= params_.recover_after_rejections) {
    ++state.poses.rejected;
    return FusionStatus::kRejected;
  }
  start();
  ++state.poses.recovered;
  return FusionStatus::kRecovered;
}

FusionStatus DelayedFusion::apply_height(FusionState& state, const Measurement& measurement) const {
  using Scalar = BiasKalman<1>::Vector;
  const Scalar height(measurement.value.x()), variance(measurement.covariance(0, 0));
  const auto start = [&] {
    state.vertical.start(height, variance,
                         {params_.kInitialSpeedStd_m_s, params_.kInitialAccelerationBiasStd_m_s2});
    state.heights_rejected_in_a_row = 0;
  };
  if (!state.vertical.ready) {
    start();
    ++state.heights.accepted;
    return FusionStatus::kStarted;
  }
  const auto innovation = state.vertical.innovation(height, variance);
  if (innovation.chi2 <= params_.height_gate_chi2) {
    state.vertical.correct(innovation);
    state.heights_rejected_in_a_row = 0;
    ++state.heights.accepted;
    return FusionStatus::kOk;
  }
  if (++state.heights_rejected_in_a_row <= params_.recover_after_rejections) {
    ++state.heights.rejected;
    return FusionStatus::kRejected;
  }
  start();
  ++state.heights.recovered;
  return FusionStatus::kRecovered;
}

}  // namespace hm
