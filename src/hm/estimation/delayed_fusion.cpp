#include "hm/estimation/delayed_fusion.hpp"

#include <cmath>

namespace hm {
namespace {

template <class Scalar>
Scalar square(Scalar value) {
  return value * value;
}

template <class Scalar>
bool is_covariance(const FilterMatrix<Scalar, 3>& matrix) {
  if (!matrix.allFinite() ||
      (matrix - matrix.transpose()).cwiseAbs().maxCoeff() > Scalar(1e-6) * matrix.cwiseAbs().maxCoeff())
    return false;
  // Semidefinite within rounding: a direction without information is none, one with negative variance a bug.
  constexpr Scalar kRounding = std::is_same_v<Scalar, double> ? Scalar(1e-9) : Scalar(1e-6);
  const Scalar minor = matrix(0, 0) * matrix(1, 1) - matrix(0, 1) * matrix(1, 0);
  return matrix.diagonal().minCoeff() >= 0 && minor >= -kRounding * matrix(0, 0) * matrix(1, 1);
}

/// The counter of an outcome; null for those that are not final or do not belong to a measurement.
std::size_t* counter(FusionCounts& counts, FusionStatus outcome) {
  switch (outcome) {
    case FusionStatus::kOk:
    case FusionStatus::kStarted:
      return &counts.accepted;
    case FusionStatus::kRejected:
      return &counts.rejected;
    case FusionStatus::kRecovered:
      return &counts.recovered;
    case FusionStatus::kTooOld:
      return &counts.too_old;
    case FusionStatus::kFromFuture:
      return &counts.from_future;
    case FusionStatus::kInvalid:
      return &counts.invalid;
    case FusionStatus::kTimeBackwards:
      return &counts.time_backwards;
    case FusionStatus::kWaiting:
    case FusionStatus::kGap:
      break;
  }
  return nullptr;
}

/// Calls `give` with every number of a state, symmetric matrices' upper halves only.
template <class State, class Give>
void each_number(State& state, Give give) {
  const auto vector = [&](auto& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) give(v(i));
  };
  const auto upper_half = [&](auto& m) {
    for (Eigen::Index row = 0; row < m.rows(); ++row)
      for (Eigen::Index column = row; column < m.cols(); ++column) give(m(row, column));
  };
  const auto filter = [&](auto& f) {
    vector(f.position), vector(f.velocity), vector(f.bias);
    upper_half(f.pp), upper_half(f.vv), upper_half(f.bb);
    vector(f.pv), vector(f.pb), vector(f.vb);
  };
  filter(state.planar);
  filter(state.vertical);
  for (auto* number :
       {&state.yaw.yaw_rad, &state.yaw.bias_rad_s, &state.yaw.yy, &state.yaw.yb, &state.yaw.bb})
    give(*number);
}

template <class Scalar>
void save(const BasicFusionState<Scalar>& state, BasicFusionState<Scalar>& stored) {
  stored = state;
}
template <class Scalar>
void save(const BasicFusionState<Scalar>& state, PackedFusionState<Scalar>& stored) {
  std::size_t next = 0;
  each_number(state, [&](Scalar number) { stored.values[next++] = number; });
  const auto bounded = [](int count) { return static_cast<std::uint16_t>(count < 0xffff ? count : 0xffff); };
  stored.poses_rejected_in_a_row = bounded(state.poses_rejected_in_a_row);
  stored.heights_rejected_in_a_row = bounded(state.heights_rejected_in_a_row);
  stored.planar_ready = state.planar.ready;
  stored.vertical_ready = state.vertical.ready;
  stored.yaw_ready = state.yaw.ready;
}

template <class Scalar>
const BasicFusionState<Scalar>& loaded(const BasicFusionState<Scalar>& stored) {
  return stored;
}
template <class Scalar>
BasicFusionState<Scalar> loaded(const PackedFusionState<Scalar>& stored) {
  BasicFusionState<Scalar> state;
  std::size_t next = 0;
  each_number(state, [&](Scalar& number) { number = stored.values[next++]; });
  for (auto* matrix : {&state.planar.pp, &state.planar.vv, &state.planar.bb})
    (*matrix)(1, 0) = (*matrix)(0, 1);
  state.poses_rejected_in_a_row = stored.poses_rejected_in_a_row;
  state.heights_rejected_in_a_row = stored.heights_rejected_in_a_row;
  state.planar.ready = stored.planar_ready;
  state.vertical.ready = stored.vertical_ready;
  state.yaw.ready = stored.yaw_ready;
  return state;
}

FusionStatus counted(FusionCounts& counts, FusionStatus outcome) {
  if (std::size_t* count = counter(counts, outcome)) ++*count;
  return outcome;
}

}  // namespace

template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::start(Time stamp, const Interval& input) {
  moment(inputs_size_++) = {stamp, input, {}};
  if constexpr (kSums) open_.stamp = stamp;
  filter_forward(0, 0);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::add_input(const Input& input) {
  if (!input.acceleration_level_m_s2.allFinite() || !std::isfinite(input.yaw_rate_rad_s))
    return FusionStatus::kInvalid;
  Interval used{input.acceleration_level_m_s2, input.yaw_rate_rad_s, input.from_imu, input.own_tilt};
  if (!started()) {
    start(input.stamp, used);
    return FusionStatus::kStarted;
  }
  if (input.stamp <= stamp()) return FusionStatus::kTimeBackwards;
  const Scalar dt_s = seconds_of<Scalar>(input.stamp - stamp());
  // After a long gap the last sample is not valid for the interval.
  const bool gap = dt_s > params_.kMaxGap_s;
  if (gap) used = {};
  if constexpr (kSums) {
    if (gap || used.from_imu != open_.sums.from_imu || used.own_tilt != open_.sums.own_tilt)
      close_open_moment();
    if (gap)
      store(input.stamp, used);
    else
      sum(input, dt_s);
    predict_open_moment();
  } else {
    store(input.stamp, used);
  }
  return gap && input.from_imu ? FusionStatus::kGap : FusionStatus::kOk;
}

/// Stores the interval that ends at `stamp` and filters it with the measurements that waited for it.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::store(Time stamp, const Interval& input) {
  if (inputs_size_ == kMaxInputs) drop_oldest_moment();
  moment(inputs_size_++) = {stamp, input, {}};
  if constexpr (kSums) open_.stamp = stamp;
  std::size_t first = measurements_size_;
  while (first > 0 && measurements_[first - 1].outcome == FusionStatus::kWaiting) --first;
  filter_forward(inputs_size_ - 1, first);
  forget_before(stamp - duration_of(params_.max_delay_s));
}

template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::sum(const Input& input, Scalar dt_s) {
  if constexpr (kSums) {
    open_.stamp = input.stamp;
    open_.dt_s += dt_s;
    open_.sums.acceleration_level_m_s2 += dt_s * input.acceleration_level_m_s2;
    open_.sums.yaw_rate_rad_s += dt_s * input.yaw_rate_rad_s;
    open_.sums.from_imu = input.from_imu;
    open_.sums.own_tilt = input.own_tilt;
    if (open_.stamp - newest().stamp >= Duration{kCapacity.moment_ns}) close_open_moment();
  }
}

/// Stores the open moment, if it has any samples.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::close_open_moment() {
  if constexpr (kSums) {
    if (!(open_.dt_s > 0)) return;
    Interval mean = open_.sums;
    mean.acceleration_level_m_s2 /= open_.dt_s;
    mean.yaw_rate_rad_s /= open_.dt_s;
    open_.sums = {};
    open_.dt_s = 0;
    store(open_.stamp, mean);
  }
}

/// Predicts from the newest stored moment to now.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::predict_open_moment() {
  if constexpr (kSums) {
    open_.state = loaded(newest().state);
    if (!(open_.dt_s > 0)) return;
    Interval mean = open_.sums;
    mean.acceleration_level_m_s2 /= open_.dt_s;
    mean.yaw_rate_rad_s /= open_.dt_s;
    predict(open_.state, mean, open_.dt_s);
  }
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::add_pose(const PoseReading<Scalar>& pose) {
  FilterMatrix<Scalar, 3> covariance = FilterMatrix<Scalar, 3>::Zero();
  if (pose.covariance) {
    covariance = *pose.covariance;
    covariance.diagonal() += Vector3(square(params_.added_position_std_m),
                                     square(params_.added_position_std_m), square(params_.added_yaw_std_rad));
  } else {
    covariance.diagonal() << square(params_.position_std_m), square(params_.position_std_m),
        square(params_.yaw_std_rad);
  }
  if (!pose.x_y_yaw.allFinite() || !is_covariance<Scalar>(covariance))
    return counted(counts_of(Kind::kPose), FusionStatus::kInvalid);
  Measurement measurement;
  measurement.stamp = pose.stamp;
  measurement.value = pose.x_y_yaw;
  measurement.covariance = covariance.template topLeftCorner<2, 2>();
  measurement.yaw_variance = covariance(2, 2);
  return add(measurement);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::add_height(const BasicHeightReading<Scalar>& height) {
  const Scalar std_m = height.std_m.value_or(params_.height_std_m);
  if (!std::isfinite(height.height_m) || !std::isfinite(std_m) || std_m <= 0)
    return counted(counts_of(Kind::kHeight), FusionStatus::kInvalid);
  Measurement measurement;
  measurement.stamp = height.stamp;
  measurement.kind = Kind::kHeight;
  measurement.value = Vector3(height.height_m, 0, 0);
  measurement.covariance(0, 0) = square(std_m);
  return add(measurement);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::add(const Measurement& arrived) {
  Measurement measurement = arrived;
  FusionCounts& counts = counts_of(measurement.kind);
  if (!started()) start(measurement.stamp, {});
  if (!params_.delay_compensation && measurement.stamp < stamp()) measurement.stamp = stamp();
  if (measurements_size_ == kMaxMeasurements) drop_oldest_measurement();
  if (measurement.stamp < moment(0).stamp ||
      seconds_of<Scalar>(stamp() - measurement.stamp) > params_.max_delay_s)
    return counted(counts, FusionStatus::kTooOld);
  if (seconds_of<Scalar>(measurement.stamp - stamp()) > params_.kMaxLead_s)
    return counted(counts, FusionStatus::kFromFuture);
  const std::size_t place = insert(measurement);
  if (measurement.stamp > newest().stamp) return FusionStatus::kWaiting;
  return filter_from(place);
}

/// Filters again from the interval of the measurement at `place` on; returns its outcome.
template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::filter_from(std::size_t place) {
  const Time stamp = measurements_[place].stamp;
  std::size_t index = inputs_size_ - 1;
  while (index > 0 && moment(index - 1).stamp >= stamp) --index;
  // The whole interval is filtered again, including what lies before the new measurement.
  std::size_t first = place;
  while (first > 0 && index > 0 && measurements_[first - 1].stamp > moment(index - 1).stamp) --first;
  if (index == 0) {  // exactly at the oldest moment, whose state already holds what came before
    State state = loaded(moment(0).state);
    set_outcome(measurements_[place], apply(state, measurements_[place]));
    save(state, moment(0).state);
    first = place + 1;
    index = 1;
  }
  filter_forward(index, first);
  predict_open_moment();
  return measurements_[place].outcome;
}

/// Removes the oldest measurement. Refiltering must then not start before it.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::drop_oldest_measurement() {
  const Time gone = measurements_[0].stamp;
  while (inputs_size_ > 1 && moment(0).stamp < gone) drop_oldest_moment();
  forget_measurements(1);
}

template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::drop_oldest_moment() {
  inputs_begin_ = (inputs_begin_ + 1) % kMaxInputs;
  --inputs_size_;
}

/// Inserts after all measurements that are not newer.
template <class Scalar, FusionCapacity kCapacity>
std::size_t BasicDelayedFusion<Scalar, kCapacity>::insert(const Measurement& measurement) {
  std::size_t place = measurements_size_++;
  for (; place > 0 && measurement.stamp < measurements_[place - 1].stamp; --place)
    measurements_[place] = measurements_[place - 1];
  measurements_[place] = measurement;
  return place;
}

/// Keeps one moment at or before `time`, to start from.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::forget_before(Time time) {
  while (inputs_size_ > 2 && moment(1).stamp <= time) drop_oldest_moment();
  std::size_t gone = 0;
  while (gone < measurements_size_ && measurements_[gone].stamp <= moment(0).stamp) ++gone;
  forget_measurements(gone);
}

/// Removes the oldest measurements.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::forget_measurements(std::size_t count) {
  if (count == 0) return;
  measurements_size_ -= count;
  for (std::size_t i = 0; i < measurements_size_; ++i) measurements_[i] = measurements_[i + count];
}

/// Filters the intervals from `index` to the newest, starting at the state before, with the measurements from
/// `measurement` on.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::filter_forward(std::size_t index, std::size_t measurement) {
  if (index >= inputs_size_) return;
  State state = loaded(moment(index > 0 ? index - 1 : 0).state);
  for (; index < inputs_size_; ++index) {
    Moment& here = moment(index);
    Time now = index > 0 ? moment(index - 1).stamp : here.stamp;
    for (; measurement < measurements_size_ && measurements_[measurement].stamp <= here.stamp;
         ++measurement) {
      Measurement& next = measurements_[measurement];
      if (next.stamp > now) {
        predict(state, here.input, seconds_of<Scalar>(next.stamp - now));
        now = next.stamp;
      }
      set_outcome(next, apply(state, next));
    }
    if (here.stamp > now) predict(state, here.input, seconds_of<Scalar>(here.stamp - now));
    save(state, here.state);
  }
}

/// A measurement that is filtered again counts with its last outcome only.
template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::set_outcome(Measurement& measurement, FusionStatus outcome) {
  FusionCounts& counts = counts_of(measurement.kind);
  if (std::size_t* before = counter(counts, measurement.outcome)) --*before;
  measurement.outcome = counted(counts, outcome);
}

template <class Scalar, FusionCapacity kCapacity>
void BasicDelayedFusion<Scalar, kCapacity>::predict(State& state, const Interval& input, Scalar dt_s) const {
  const Params& p = params_;
  const Scalar felt_density =
      input.own_tilt ? p.kOwnTiltAccelerationDensity_m_s2_sqrt_hz : p.acceleration_density_m_s2_sqrt_hz;
  const BasicNoiseDensity<Scalar> acceleration{
      square(input.from_imu ? felt_density : p.kGapAccelerationDensity_m_s2_sqrt_hz),
      square(p.kAccelerationBiasWalk_m_s3_sqrt_hz)};
  const BasicNoiseDensity<Scalar> yaw_rate{
      square(input.from_imu ? p.kYawRateDensity_rad_s_sqrt_hz : p.kGapYawRateDensity_rad_s_sqrt_hz),
      square(p.kYawRateBiasWalk_rad_s2_sqrt_hz)};
  using One = FilterVector<Scalar, 1>;
  using Vector2 = FilterVector<Scalar, 2>;
  const Vector3& felt = input.acceleration_level_m_s2;
  if (state.planar.ready && input.from_imu) {
    const Scalar rate = input.yaw_rate_rad_s - state.yaw.bias_rad_s;
    const FilterMatrix<Scalar, 2> R_world_level =
        planar_rotation<Scalar>(state.yaw.yaw_rad + Scalar(0.5) * dt_s * rate);
    state.planar.predict(felt.template head<2>(), R_world_level, dt_s, acceleration);
    state.yaw.predict(input.yaw_rate_rad_s, dt_s, yaw_rate);
  } else if (state.planar.ready) {
    // Without IMU data the velocity is constant and independent of the bias.
    state.planar.predict(Vector2::Zero(), FilterMatrix<Scalar, 2>::Zero(), dt_s, acceleration);
    state.yaw.yy += yaw_rate.input * dt_s;
    state.yaw.bb += yaw_rate.bias * dt_s;
  }
  if (state.vertical.ready)
    state.vertical.predict(One(felt.z()), One(Scalar(input.from_imu ? 1 : 0)), dt_s, acceleration);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::apply(State& state,
                                                          const Measurement& measurement) const {
  return measurement.kind == Kind::kPose ? apply_pose(state, measurement) : apply_height(state, measurement);
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::apply_pose(State& state,
                                                               const Measurement& measurement) const {
  const FilterVector<Scalar, 2> position = measurement.value.template head<2>();
  const auto start = [&] {
    state.planar.start(position, measurement.covariance,
                       {params_.kInitialSpeedStd_m_s, params_.kInitialAccelerationBiasStd_m_s2});
    state.yaw.start(measurement.value.z(), measurement.yaw_variance, params_.kInitialYawRateBiasStd_rad_s);
    state.poses_rejected_in_a_row = 0;
  };
  if (!state.planar.ready) {
    start();
    return FusionStatus::kStarted;
  }
  const auto planar = state.planar.innovation(position, measurement.covariance);
  const auto yaw = state.yaw.innovation(measurement.value.z(), measurement.yaw_variance);
  if (planar.chi2 + yaw.chi2 <= params_.pose_gate_chi2) {
    state.planar.correct(planar);
    state.yaw.correct(yaw);
    state.poses_rejected_in_a_row = 0;
    return FusionStatus::kOk;
  }
  if (++state.poses_rejected_in_a_row <= params_.recover_after_rejections) return FusionStatus::kRejected;
  start();
  return FusionStatus::kRecovered;
}

template <class Scalar, FusionCapacity kCapacity>
FusionStatus BasicDelayedFusion<Scalar, kCapacity>::apply_height(State& state,
                                                                 const Measurement& measurement) const {
  using One = FilterVector<Scalar, 1>;
  const One height(measurement.value.x()), variance(measurement.covariance(0, 0));
  const auto start = [&] {
    state.vertical.start(height, variance,
                         {params_.kInitialSpeedStd_m_s, params_.kInitialAccelerationBiasStd_m_s2});
    state.heights_rejected_in_a_row = 0;
  };
  if (!state.vertical.ready) {
    start();
    return FusionStatus::kStarted;
  }
  const auto innovation = state.vertical.innovation(height, variance);
  if (innovation.chi2 <= params_.height_gate_chi2) {
    state.vertical.correct(innovation);
    state.heights_rejected_in_a_row = 0;
    return FusionStatus::kOk;
  }
  if (++state.heights_rejected_in_a_row <= params_.recover_after_rejections) return FusionStatus::kRejected;
  start();
  return FusionStatus::kRecovered;
}

template class BasicDelayedFusion<double, kHostCapacity>;
template class BasicDelayedFusion<float, kBoardCapacity>;

}  // namespace hm
