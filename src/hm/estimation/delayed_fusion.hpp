#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/estimation/bias_kalman.hpp"
#include "hm/estimation/filter_types.hpp"
#include "hm/estimation/fusion_params.hpp"

namespace hm {

/// IMU input for the interval that ends at `stamp`.
template <class Scalar>
struct BasicFusionInput {
  Time stamp;
  FilterVector<Scalar, 3> acceleration_level_m_s2 =
      FilterVector<Scalar, 3>::Zero();  ///< level frame (x forward, z up), gravity removed
  Scalar yaw_rate_rad_s = 0;            ///< rate of the yaw angle
  bool from_imu = true;                 ///< false: no measurement, constant velocity
  bool own_tilt = false;                ///< roll and pitch from gyroscope and gravity only
};
using FusionInput = BasicFusionInput<double>;

/// States of the filters at one time. A plain value: restoring a copy rewinds the filters.
template <class Scalar>
struct BasicFusionState {
  BiasKalman<2, Scalar> planar;
  BiasKalman<1, Scalar> vertical;
  BasicYawBiasKalman<Scalar> yaw;
  int poses_rejected_in_a_row = 0, heights_rejected_in_a_row = 0;
};
using FusionState = BasicFusionState<double>;

/// A state as the history of a microcontroller keeps it: symmetric matrices once, flags and counters in a
/// word.
template <class Scalar>
struct PackedFusionState {
  std::array<Scalar, 41> values{};
  std::uint16_t poses_rejected_in_a_row = 0, heights_rejected_in_a_row = 0;  ///< at most 65,535
  bool planar_ready = false, vertical_ready = false, yaw_ready = false;
};

/// Capacities of the history, and how long an interval it stores.
struct FusionCapacity {
  std::size_t inputs, measurements;
  /// Inputs are summed until they span this (0: each is stored). The part since the last stored moment is
  /// predicted anew at each input, and measurements wait until it is stored.
  std::int64_t moment_ns = 0;
};
inline constexpr FusionCapacity kHostCapacity{256, 64, 0};
/// Capacity for a microcontroller at 1 kHz: 190 ms of history.
inline constexpr FusionCapacity kBoardCapacity{38, 16, 5'000'000};

/// Decoupled filters with biases that apply every measurement at its own time (improves on dissertation
/// 2.2.4, which corrects the current state with a laser pose 30 to 60 ms old).
///
/// Inputs, measurements and the state after each input are kept for `max_delay_s` in fixed-size ring buffers.
/// A late measurement rewinds to the input before it and filters forward again, including all measurements
/// and gates in between: the result is that of processing everything in order of stamps, for any order of
/// arrival. No heap allocation; one call costs at most refiltering the whole buffer.
template <class Scalar, FusionCapacity kCapacity>
class BasicDelayedFusion {
 public:
  static constexpr std::size_t kMaxInputs = kCapacity.inputs, kMaxMeasurements = kCapacity.measurements;
  using Params = BasicFusionParams<Scalar>;
  using Input = BasicFusionInput<Scalar>;
  using State = BasicFusionState<Scalar>;
  using Vector3 = FilterVector<Scalar, 3>;

  [[gnu::cold]] explicit BasicDelayedFusion(const Params& params) : params_(params) {}

  /// Adds the next IMU interval.
  FusionStatus add_input(const Input& input);
  FusionStatus add_pose(const PoseReading<Scalar>& pose);
  FusionStatus add_height(const BasicHeightReading<Scalar>& height);

  [[nodiscard]] bool started() const { return inputs_size_ > 0; }
  [[nodiscard]] Time stamp() const {
    if constexpr (kSums) return open_.stamp;
    return newest().stamp;
  }
  [[nodiscard]] const State& state() const {
    if constexpr (kSums)
      return open_.state;
    else
      return newest().state;
  }
  /// Numbers of accepted, rejected and ignored measurements so far.
  [[nodiscard]] const FusionCounts& pose_counts() const { return counts_[0]; }
  [[nodiscard]] const FusionCounts& height_counts() const { return counts_[1]; }

 private:
  static constexpr bool kSums = kCapacity.moment_ns > 0;
  using Stored = std::conditional_t<kSums, PackedFusionState<Scalar>, State>;
  /// Mean input of an interval.
  struct Interval {
    Vector3 acceleration_level_m_s2 = Vector3::Zero();
    Scalar yaw_rate_rad_s = 0;
    bool from_imu = false, own_tilt = false;
  };
  struct Moment {
    Time stamp;
    Interval input;  // that ends here
    Stored state;    // after everything up to here
  };
  /// Sums since the newest stored moment, and the state at their end.
  struct OpenMoment {
    Time stamp;
    Interval sums;  // velocity and angle
    Scalar dt_s = 0;
    State state;
  };
  struct Nothing {};
  enum class Kind : std::uint8_t { kPose, kHeight };
  struct Measurement {
    Time stamp;
    Kind kind = Kind::kPose;
    FusionStatus outcome = FusionStatus::kWaiting;
    Scalar yaw_variance = 0;
    Vector3 value = Vector3::Zero();                                       // x, y, yaw; or height
    FilterMatrix<Scalar, 2> covariance = FilterMatrix<Scalar, 2>::Zero();  // or its variance at (0, 0)
  };
  [[nodiscard]] const Moment& newest() const { return moment(inputs_size_ - 1); }
  [[nodiscard]] Moment& moment(std::size_t index) { return moments_[(inputs_begin_ + index) % kMaxInputs]; }
  [[nodiscard]] const Moment& moment(std::size_t index) const {
    return moments_[(inputs_begin_ + index) % kMaxInputs];
  }
  [[nodiscard]] FusionCounts& counts_of(Kind kind) { return counts_[static_cast<std::size_t>(kind)]; }
  void start(Time stamp, const Interval& input);
  void store(Time stamp, const Interval& input);
  void sum(const Input& input, Scalar dt_s);
  void close_open_moment();
  void predict_open_moment();
  FusionStatus add(const Measurement& measurement);
  FusionStatus filter_from(std::size_t place);
  std::size_t insert(const Measurement& measurement);
  void drop_oldest_measurement();
  void drop_oldest_moment();
  void forget_before(Time time);
  void forget_measurements(std::size_t count);
  void filter_forward(std::size_t index, std::size_t measurement);
  void set_outcome(Measurement& measurement, FusionStatus outcome);
  void predict(State& state, const Interval& input, Scalar dt_s) const;
  FusionStatus apply(State& state, const Measurement& measurement) const;
  FusionStatus apply_pose(State& state, const Measurement& measurement) const;
  FusionStatus apply_height(State& state, const Measurement& measurement) const;

  Params params_;
  std::array<Moment, kMaxInputs> moments_{};
  std::size_t inputs_begin_ = 0, inputs_size_ = 0;
  std::array<Measurement, kMaxMeasurements> measurements_{};  // by stamp
  std::size_t measurements_size_ = 0;
  [[no_unique_address]] std::conditional_t<kSums, OpenMoment, Nothing> open_{};
  FusionCounts counts_[2];  // by Kind; outside of the state, which is filtered again and again
};
using DelayedFusion = BasicDelayedFusion<double, kHostCapacity>;

extern template class BasicDelayedFusion<double, kHostCapacity>;
extern template class BasicDelayedFusion<float, kBoardCapacity>;

}  // namespace hm
