#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/estimation/bias_kalman.hpp"
#include "hm/estimation/fusion_params.hpp"
#include "hm/estimation/fusion_types.hpp"

namespace hm {

/// IMU input for the interval that ends at `stamp`.
struct FusionInput {
  Time stamp;
  Vec3 acceleration_level_m_s2 = Vec3::Zero();  ///< level frame (x forward, z up), gravity removed
  double yaw_rate_rad_s = 0;                    ///< rate of the yaw angle
  bool from_imu = true;                         ///< false: no measurement, constant velocity
  bool own_tilt = false;                        ///< roll and pitch from gyroscope and gravity only
};

/// States of the filters at one time. A plain value: restoring a copy rewinds the filters.
struct FusionState {
  BiasKalman<2> planar;
  BiasKalman<1> vertical;
  YawBiasKalman yaw;
  FusionCounts poses, heights;
  int poses_rejected_in_a_row = 0, heights_rejected_in_a_row = 0;
};

/// Decoupled filters with biases that apply every measurement at its own time (improves on dissertation
/// 2.2.4, which corrects the current state with a laser pose 30 to 60 ms old).
///
/// Inputs, measurements and the state after each input are kept for `max_delay_s` in fixed-size ring buffers.
/// A late measurement rewinds to the input before it and filters forward again, including all measurements
/// and gates in between: the result is that of processing everything in order of stamps, for any order of
/// arrival. No heap allocation; one call costs at most refiltering the whole buffer.
class DelayedFusion {
 public:
  static constexpr std::size_t kMaxInputs = 256, kMaxMeasurements = 64;

  explicit DelayedFusion(const FusionParams& params) : params_(params) {}

  /// Adds the next IMU interval.
  FusionStatus add_input(const FusionInput& input);
  FusionStatus add_pose(const PlanarPose& pose);
  FusionStatus add_height(const HeightReading& height);

  [[nodiscard]] bool started() const { return inputs_size_ > 0; }
  [[nodiscard]] Time stamp() const { return newest().stamp; }
  [[nodiscard]] const FusionState& state() const { return newest().state; }
  /// Numbers of accepted, rejected and ignored measurements so far.
  [[nodiscard]] FusionCounts pose_counts() const;
  [[nodiscard]] FusionCounts height_counts() const;

 private:
  struct Moment {
    Time stamp;
    FusionInput input;  // of the interval that ends here
    FusionState state;  // after everything up to here
  };
  enum class Kind : std::uint8_t { kPose, kHeight };
  struct Measurement {
    Time stamp;
    Kind kind = Kind::kPose;
    Vec3 value = Vec3::Zero();       // x, y, yaw; or height
    Mat3 covariance = Mat3::Zero();  // or its variance at (0, 0)
    FusionStatus outcome = FusionStatus::kWaiting;
  };
  [[nodiscard]] const Moment& newest() const { return moment(inputs_size_ - 1); }
  [[nodiscard]] Moment& moment(std::size_t index) { return moments_[(inputs_begin_ + index) % kMaxInputs]; }
  [[nodiscard]] const Moment& moment(std::size_t index) const {
    return moments_[(inputs_begin_ + index) % kMaxInputs];
  }
  FusionStatus add(const Measurement& measurement, FusionCounts& ignored);
  std::size_t insert(const Measurement& measurement);
  void drop_oldest_measurement();
  void drop_oldest_moment();
  void forget_before(Time time);
  void filter_forward(std::size_t index, std::size_t measurement);
  void predict(FusionState& state, const FusionInput& input, double dt_s) const;
  FusionStatus apply(FusionState& state, const Measurement& measurement) const;
  FusionStatus apply_pose(FusionState& state, const Measurement& measurement) const;
  FusionStatus apply_height(FusionState& state, const Measurement& measurement) const;

  FusionParams params_;
  std::array<Moment, kMaxInputs> moments_{};
  std::size_t inputs_begin_ = 0, inputs_size_ = 0;
  std::array<Measurement, kMaxMeasurements> measurements_{};  // by stamp
  std::size_t measurements_size_ = 0;
  FusionCounts ignored_poses_, ignored_heights_;
};

}  // namespace hm
