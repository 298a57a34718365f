#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/estimation/bias_kalman.hpp"
#include "hm/estimation/fusion_params.hpp"
#include "hm/estimation/fusion_types.hpp"

namespace hm {

/// What the IMU says about the interval that ends at `stamp`.
struct FusionInput {
  Time stamp;
  Vec3 acceleration_level_m_s2 = Vec3::Zero();  ///< gravity removed; x forward, z up, tilt taken away
  double yaw_rate_rad_s = 0;                    ///< of the yaw angle
  bool from_imu = true;                         ///< false: nobody knows; constant velocity
  bool own_tilt = false;                        ///< roll and pitch are from gyroscope and gravity only
};

/// The filters at one moment. A plain value: copying it back is going back in time.
struct FusionState {
  BiasKalman<2> planar;
  BiasKalman<1> vertical;
  YawBiasKalman yaw;
  FusionCounts poses, heights;
  int poses_rejected_in_a_row = 0, heights_rejected_in_a_row = 0;
};

/// The decoupled filters with biases, in which every measurement takes effect at its own time (improves on
/// dissertation 2.2.4, which corrects "now" with a laser pose of 30 to 60 ms ago).
///
/// Inputs, measurements and the state after each input are kept for `max_delay_s` in rings of fixed size. A
/// late measurement goes back to the input before it and filters forward again, with the measurements and
/// gates that lie in between: whatever the order of arrival, the result is that of processing everything in
/// order of its stamp. No heap; one call costs at most the re-filtering of the ring.
class DelayedFusion {
 public:
  static constexpr std::size_t kMaxInputs = 256, kMaxMeasurements = 64;

  explicit DelayedFusion(const FusionParams& params) : params_(params) {}

  /// The next interval of the IMU.
  FusionStatus add_input(const FusionInput& input);
  FusionStatus add_pose(const PlanarPose& pose);
  FusionStatus add_height(const HeightReading& height);

  [[nodiscard]] bool started() const { return inputs_size_ > 0; }
  [[nodiscard]] Time stamp() const { return newest().stamp; }
  [[nodiscard]] const FusionState& state() const { return newest().state; }
  /// What was accepted, gated and ignored so far.
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
