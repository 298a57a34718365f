// The double estimator keeps its bits: a hash of everything that it gives along a simulated flight.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <memory>
#include <span>

#include "hm/estimation/testing/laser_flight.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

/// FNV-1a over the bytes of the values, little end first.
class BitHash {
 public:
  template <class Values>
  void add(const Values& values) {
    for (const double value : values.reshaped()) add_word(std::bit_cast<std::uint64_t>(value));
  }
  void add_word(std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte, word >>= 8) hash_ = (hash_ ^ (word & 0xff)) * 0x100000001b3ULL;
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

void add_counts(BitHash& hash, const FusionCounts& counts) {
  for (const std::size_t count : {counts.accepted, counts.rejected, counts.recovered, counts.too_old,
                                  counts.from_future, counts.time_backwards, counts.invalid})
    hash.add_word(count);
}

/// A flight of 6 s with what goes wrong on one: poses of a wrong place, gaps, stamps that run backwards,
/// poses that come twice, too late, or are not numbers.
std::uint64_t hash_of_flight(const StateEstimatorParams& params, bool orientation_from_imu) {
  LaserFlightParams flight_params;
  flight_params.duration_s = 6;
  flight_params.orientation_from_imu = orientation_from_imu;
  flight_params.seed = 5;
  const LaserFlight flight(flight_params);
  const auto estimator = std::make_unique<StateEstimator>(
      params, SE3(rotation_from_roll_pitch_yaw({0.02, -0.01, 0.3}), {0.05, 0, 0.02}));
  BitHash hash;
  std::size_t i = 0;
  for (const auto& step : flight.steps()) {
    ++i;
    if (i % 2000 > 1850) continue;  // a gap of 150 ms
    estimator->add_imu(step.imu);
    if (i % 777 == 0) hash.add_word(static_cast<std::uint64_t>(estimator->add_imu(step.imu)));
    if (step.pose) {
      PlanarPose pose = *step.pose;
      if (i % 7 == 0) pose.covariance.reset();
      if (i > 3000 && i < 3700) pose.T_odom_base = SE2(2, 3, 0.2) * pose.T_odom_base;  // until it recovers
      hash.add_word(static_cast<std::uint64_t>(estimator->add_pose(pose)));
      pose.stamp = pose.stamp - Duration::from_seconds(i % 11 == 0 ? 0.3 : 0.01);
      if (i % 5 == 0) hash.add_word(static_cast<std::uint64_t>(estimator->add_pose(pose)));
    }
    if (step.height) hash.add_word(static_cast<std::uint64_t>(estimator->add_height(*step.height)));
    const VehicleState state = estimator->state();
    hash.add_word(static_cast<std::uint64_t>(state.stamp.ns));
    hash.add(state.position_m);
    hash.add(state.velocity_m_s);
    hash.add(state.roll_pitch_yaw_rad);
    hash.add(state.planar_covariance);
    hash.add(state.planar_velocity_covariance);
    hash.add(Vec3(state.height_variance, state.climb_variance, state.yaw_variance));
    hash.add(state.acceleration_bias_m_s2);
    hash.add_word(std::bit_cast<std::uint64_t>(state.yaw_rate_bias_rad_s));
  }
  add_counts(hash, estimator->pose_counts());
  add_counts(hash, estimator->height_counts());
  add_counts(hash, estimator->imu_counts());
  return hash.value();
}

/// Bits are those of the C library's sine on CPUs with fused multiply-add, where the values below were taken.
bool has_the_same_sine() {
#if defined(__x86_64__) && defined(__GLIBC__)
  return __builtin_cpu_supports("fma") != 0;
#else
  return false;
#endif
}

TEST(StateEstimatorBits, AreThoseBeforeTheFiltersBecameTemplates) {
  if (!has_the_same_sine())
    GTEST_SKIP() << "values taken on x86-64 with fused multiply-add and the GNU C library";
  StateEstimatorParams params;
  EXPECT_EQ(hash_of_flight(params, true), 4364322623477145960u);
  EXPECT_EQ(hash_of_flight(params, false), 8320746770410045503u);
  params.fusion.delay_compensation = false;
  EXPECT_EQ(hash_of_flight(params, true), 11498702016220288130u);
  params.mode = FusionMode::kThesis;
  EXPECT_EQ(hash_of_flight(params, true), 15362897582156410682u);
  params.thesis = DecoupledKalmanParams::city_flyer();
  EXPECT_EQ(hash_of_flight(params, false), 15561014535275324239u);
}

}  // namespace
}  // namespace hm
