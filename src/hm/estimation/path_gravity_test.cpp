#include "hm/estimation/path_gravity.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/testing/drawn_vector.hpp"

namespace hm {
namespace {

/// A camera that is swung: 0.4 m/s^2 and more besides gravity, turning as far as told.
struct Swing {
  Mat3 R_world_level = so3_exp(Vec3(0.6, -0.3, 0.2));
  double turn_rad = 0.1;
  double drift_m_s2 = 0.15;  ///< it gains speed all the time

  [[nodiscard]] SE3 pose(double t) const {
    const Vec3 p(0.3 * std::sin(2 * t) + 0.5 * drift_m_s2 * t * t, 0.2 * std::cos(3 * t),
                 0.1 * std::sin(5 * t));
    const Mat3 R =
        so3_exp(Vec3(turn_rad * std::sin(t), turn_rad * std::sin(1.7 * t + 1), turn_rad * std::sin(0.8 * t)));
    return {R_world_level * R, R_world_level * p};
  }
  [[nodiscard]] Vec3 force(double t) const {
    constexpr double h = 1e-3;
    const Vec3 a =
        (pose(t + h).translation() - 2 * pose(t).translation() + pose(t - h).translation()) / (h * h);
    return pose(t).rotation().transpose() * (a + kGravity_m_s2 * up());
  }
  [[nodiscard]] Vec3 up() const { return R_world_level.col(2); }

  [[nodiscard]] Trajectory path(double duration_s) const {
    Trajectory path;
    for (int i = 0; i < duration_s * 30; ++i)
      path.push_back({Time::from_seconds(10 + i / 30.0), pose(i / 30.0)});
    return path;
  }
  [[nodiscard]] std::vector<ImuSample> samples(double duration_s, const Vec3& bias, Rng& rng) const {
    std::vector<ImuSample> samples;
    for (int i = -50; i < duration_s * 100 + 50; ++i) {
      ImuSample sample;
      sample.stamp = Time::from_seconds(10 + i / 100.0);
      sample.specific_force_m_s2 =
          force(i / 100.0) + bias + test::drawn<3>([&] { return rng.normal(0, 0.3); });
      samples.push_back(sample);
    }
    return samples;
  }
};

double off_deg(const UpDirection& found, const Vec3& up) {
  return std::atan2(found.up.cross(up).norm(), found.up.dot(up)) * kDegreesPerRadian;
}

TEST(PathGravity, TheCamerasOwnMotionDoesNotMislead) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const Swing swing;
    const auto up = up_along_path(swing.samples(6, Vec3::Zero(), rng), swing.path(6));
    ASSERT_TRUE(up);
    EXPECT_EQ(up->source, UpSource::kGravity);
    EXPECT_LT(off_deg(*up, swing.up()), 0.6);
    EXPECT_LT(off_deg(*up, swing.up()), 3 * up->sigma_rad * kDegreesPerRadian);
  }
}

/// 0.5 m/s^2 are three degrees: seen where the camera turns, else covered by the deviation.
TEST(PathGravity, ABiasIsFoundOrAllowedFor) {
  Rng rng(3);
  const Vec3 bias(0.3, -0.4, 0.1);
  Swing turning;
  turning.turn_rad = 0.9;
  const auto found = up_along_path(turning.samples(20, bias, rng), turning.path(20));
  ASSERT_TRUE(found);
  EXPECT_LT(off_deg(*found, turning.up()), 0.7);
  EXPECT_LT(found->sigma_rad, 0.015);
  const Swing still;
  const auto biased = up_along_path(still.samples(4, bias, rng), still.path(4));
  ASSERT_TRUE(biased);
  EXPECT_GT(biased->sigma_rad, 0.04);
  EXPECT_LT(off_deg(*biased, still.up()), 2 * biased->sigma_rad * kDegreesPerRadian);
}

TEST(PathGravity, WhatIsNotGravityIsRefused) {
  Rng rng(5);
  const Swing swing;
  auto samples = swing.samples(6, Vec3::Zero(), rng);
  EXPECT_FALSE(up_along_path({}, swing.path(6)));
  EXPECT_FALSE(up_along_path(samples, {}));
  EXPECT_FALSE(up_along_path(samples, swing.path(0.5)));
  for (ImuSample& sample : samples) sample.specific_force_m_s2 *= 0.5;  // in other units
  EXPECT_FALSE(up_along_path(samples, swing.path(6)));
  for (ImuSample& sample : samples) sample.specific_force_m_s2 = Vec3::Constant(NAN);
  EXPECT_FALSE(up_along_path(samples, swing.path(6)));
  EXPECT_FALSE(up_about(samples, Time::from_seconds(11)));
}

TEST(PathGravity, AboutAMomentItIsRough) {
  Rng rng(6);
  const Swing swing;
  const auto up = up_about(swing.samples(6, Vec3::Zero(), rng), Time::from_seconds(12));
  ASSERT_TRUE(up);
  EXPECT_LT(off_deg(*up, swing.pose(2).rotation().transpose() * swing.up()), 12);
  EXPECT_FALSE(up_about(swing.samples(6, Vec3::Zero(), rng), Time::from_seconds(20)));
}

}  // namespace
}  // namespace hm
