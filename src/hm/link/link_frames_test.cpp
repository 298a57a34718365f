#include "hm/link/link_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;
constexpr auto kNed = AutopilotWorld::kNed;
constexpr auto kFrd = AutopilotWorld::kLocalFrd;

Eigen::Quaterniond turned(double angle_rad, const Vec3& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}
/// Roll, pitch, yaw in degrees of what the autopilot gets.
Vec3 swapped_rpy_deg(double angle_rad, const Vec3& axis, AutopilotWorld world) {
  return roll_pitch_yaw(swap_orientation(turned(angle_rad, axis), world)) * kDegreesPerRadian;
}

TEST(LinkFrames, EachAxisOfTheWorld) {
  EXPECT_EQ(swap_world(Vec3::UnitX(), kNed), Vec3(0, 1, 0));  // east
  EXPECT_EQ(swap_world(Vec3::UnitY(), kNed), Vec3(1, 0, 0));  // north
  EXPECT_EQ(swap_world(Vec3::UnitZ(), kNed), Vec3(0, 0, -1));
  EXPECT_EQ(swap_world(Vec3::UnitX(), kFrd), Vec3(1, 0, 0));
  EXPECT_EQ(swap_world(Vec3::UnitY(), kFrd), Vec3(0, -1, 0));
  EXPECT_EQ(swap_world(Vec3::UnitZ(), kFrd), Vec3(0, 0, -1));
  EXPECT_EQ(swap_body(Vec3(1, 2, 3)), Vec3(1, -2, -3));
}

TEST(LinkFrames, NotTurnedIsEastInNedAndForwardInLocalFrd) {
  EXPECT_TRUE(swapped_rpy_deg(0, Vec3::UnitX(), kNed).isApprox(Vec3(0, 0, 90)));
  EXPECT_TRUE(swapped_rpy_deg(0, Vec3::UnitX(), kFrd).isZero(1e-9));
}

TEST(LinkFrames, NinetyDegreesAboutEachAxis) {
  // To the left, seen from above: from east to north, thus 0 in NED; -90 in FRD.
  EXPECT_TRUE(swapped_rpy_deg(kQuarterTurn, Vec3::UnitZ(), kNed).isZero(1e-9));
  EXPECT_TRUE(swapped_rpy_deg(kQuarterTurn, Vec3::UnitZ(), kFrd).isApprox(Vec3(0, 0, -90)));
  // About x (forward) to the right side down: +90 in both conventions.
  EXPECT_TRUE(swapped_rpy_deg(kQuarterTurn, Vec3::UnitX(), kNed).isApprox(Vec3(90, 0, 90)));
  EXPECT_TRUE(swapped_rpy_deg(kQuarterTurn, Vec3::UnitX(), kFrd).isApprox(Vec3(90, 0, 0)));
  // About y (left) the nose goes down, which is negative in FRD. Yaw and roll are not defined there.
  EXPECT_NEAR(swapped_rpy_deg(kQuarterTurn, Vec3::UnitY(), kFrd).y(), -90, 1e-5);
  EXPECT_NEAR(swapped_rpy_deg(kQuarterTurn, Vec3::UnitY(), kNed).y(), -90, 1e-5);
  EXPECT_TRUE(swapped_rpy_deg(kQuarterTurn / 3, Vec3::UnitY(), kFrd).isApprox(Vec3(0, -30, 0), 1e-9));
}

TEST(LinkFrames, YawAgreesWithTheOrientation) {
  for (const auto world : {kNed, kFrd})
    for (double yaw = -3.1; yaw < 3.1; yaw += 0.37)
      EXPECT_NEAR(swap_yaw(yaw, world),
                  roll_pitch_yaw(swap_orientation(turned(yaw, Vec3::UnitZ()), world)).z(), 1e-12);
  EXPECT_NEAR(swap_yaw(kQuarterTurn, kNed), 0, 1e-15);
  EXPECT_NEAR(swap_yaw(kQuarterTurn, kFrd), -kQuarterTurn, 1e-15);
  EXPECT_EQ(swap_yaw_rate(0.5), -0.5);
}

TEST(LinkFrames, VectorsOfTheBodyAndTheWorldAgree) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const auto number = [&] { return rng.uniform(-2, 2); };
    const Eigen::Quaterniond q = Eigen::Quaterniond(number(), number(), number(), number()).normalized();
    const Vec3 v(number(), number(), number());
    for (const auto world : {kNed, kFrd}) {
      EXPECT_TRUE((swap_orientation(q, world) * swap_body(v)).isApprox(swap_world(q * v, world), 1e-12));
      EXPECT_TRUE(swap_world(swap_world(v, world), world).isApprox(v));
      EXPECT_LT(swap_orientation(swap_orientation(q, world), world).angularDistance(q), 1e-7);
      EXPECT_GE(swap_orientation(q, world).w(), 0);
    }
  }
}

TEST(LinkFrames, CovariancesFollowTheirVectors) {
  Rng rng(2);
  Mat6 root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = rng.uniform(-1, 1);
  const Mat6 covariance = root * root.transpose();
  const Mat6 ned = swap_world_covariance(covariance, kNed), body = swap_body_covariance(covariance);
  EXPECT_DOUBLE_EQ(ned(0, 0), covariance(1, 1));
  EXPECT_DOUBLE_EQ(ned(0, 1), covariance(1, 0));
  EXPECT_DOUBLE_EQ(ned(0, 2), -covariance(1, 2));
  EXPECT_DOUBLE_EQ(ned(3, 5), -covariance(4, 5));
  EXPECT_DOUBLE_EQ(body(0, 1), -covariance(0, 1));
  EXPECT_DOUBLE_EQ(body(1, 2), covariance(1, 2));
  EXPECT_DOUBLE_EQ(body(0, 4), -covariance(0, 4));
}

TEST(LinkFrames, VariancesStandWhereMavlinkHasThem) {
  Mat6 covariance = Mat6::Zero();
  for (int i = 0; i < 6; ++i) covariance(i, i) = i + 1;
  covariance(0, 5) = covariance(5, 0) = 9;
  const MavlinkCovariance triangle = upper_triangle(covariance);
  const std::array<std::size_t, 6> places{0, 6, 11, 15, 18, 20};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(triangle[places[i]], static_cast<float>(i + 1));
  EXPECT_EQ(triangle[5], 9);
  EXPECT_EQ(from_upper_triangle(triangle), covariance);
  EXPECT_TRUE(std::isnan(unknown_covariance()[0]));
}

}  // namespace
}  // namespace hm
