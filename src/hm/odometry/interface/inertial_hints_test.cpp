#include "hm/odometry/interface/inertial_hints.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

Time at(double t) { return Time::from_seconds(50 + t); }

/// Two seconds of rotation at a constant rate, at 200 Hz.
std::shared_ptr<CarriedImu> turning(const Vec3& rate_rad_s) {
  auto imu = std::make_shared<CarriedImu>();
  imu->has_gyroscope = true;
  for (int i = 0; i <= 400; ++i)
    imu->samples.push_back({at(0.005 * i), rate_rad_s, Vec3(0, -9.8, 0.01 * i), {}});
  return imu;
}

TEST(InertialHints, TurnsAddUpToTheRotationInClosedForm) {
  const Vec3 rate(0.3, -1.1, 0.4);
  InertialHints hints(turning(rate), ImuUse::kBoth);
  Mat3 sum = Mat3::Identity();
  EXPECT_FALSE(hints.next(at(0.0123)).R_last_current);  // the start of the interval is unknown
  for (int i = 1; i <= 50; ++i) {
    const MotionHint hint = hints.next(at(0.0123 + i * 0.0333));
    ASSERT_TRUE(hint.R_last_current && hint.force_camera_m_s2);
    sum *= *hint.R_last_current;
    const double middle_s = 0.0123 + (i - 0.5) * 0.0333;
    EXPECT_NEAR(hint.force_camera_m_s2->z(), 2 * middle_s, 0.005);
    EXPECT_NEAR(hint.force_camera_m_s2->y(), -9.8, 1e-9);
  }
  EXPECT_LT((sum.transpose() * so3_exp(rate * 50 * 0.0333) - Mat3::Identity()).norm(), 1e-9);
}

TEST(InertialHints, TellsWhatIsAskedForAndWhatThereIs) {
  const auto imu = turning(Vec3(0, 1, 0));
  const auto second = [](InertialHints hints) {
    hints.next(at(0.1));
    return hints.next(at(0.2));
  };
  EXPECT_FALSE(second({imu, ImuUse::kOff}).R_last_current);
  EXPECT_FALSE(second({imu, ImuUse::kOff}).force_camera_m_s2);
  EXPECT_FALSE(second({nullptr, ImuUse::kBoth}).force_camera_m_s2);
  EXPECT_TRUE(second({imu, ImuUse::kGyroscope}).R_last_current);
  EXPECT_FALSE(second({imu, ImuUse::kGyroscope}).force_camera_m_s2);
  EXPECT_FALSE(second({imu, ImuUse::kGravity}).R_last_current);
  imu->has_gyroscope = false;
  EXPECT_FALSE(second({imu, ImuUse::kBoth}).R_last_current);
  EXPECT_TRUE(second({imu, ImuUse::kBoth}).force_camera_m_s2);
}

TEST(InertialHints, SaysNothingAcrossGapsAndBeyondTheEnds) {
  const auto imu = turning(Vec3(0, 1, 0));
  imu->samples.erase(imu->samples.begin() + 100, imu->samples.begin() + 140);  // 0.5 s to 0.7 s
  InertialHints hints(imu, ImuUse::kBoth);
  hints.next(at(-1));
  EXPECT_FALSE(hints.next(at(0.2)).force_camera_m_s2);
  EXPECT_TRUE(hints.next(at(0.45)).force_camera_m_s2);
  EXPECT_FALSE(hints.next(at(0.9)).force_camera_m_s2);
  EXPECT_TRUE(hints.next(at(1.95)).force_camera_m_s2);
  EXPECT_FALSE(hints.next(at(2.3)).force_camera_m_s2);
  EXPECT_FALSE(hints.next(at(5)).R_last_current);
}

}  // namespace
}  // namespace hm
