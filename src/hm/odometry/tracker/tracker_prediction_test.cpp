#include "hm/odometry/tracker/tracker_prediction.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

constexpr double kFramePeriod_s = 1.0 / 30;

double difference(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

SE3 motion_over(double duration_s) {
  return SE3::exp(duration_s * (Vec6() << 0.9, -0.3, 0.2, 0.4, 1.5, -0.2).finished());
}

TEST(Renormalised, OnlyWhatIsOffIsMoved) {
  const SE3 pose(so3_exp({0.3, -0.4, 0.5}), {1, 2, 3});
  EXPECT_EQ(renormalised(pose).rotation(), pose.rotation());
  const SE3 off(pose.rotation() * (1 + 1e-7), pose.translation());
  const Mat3 R = renormalised(off).rotation();
  EXPECT_LT((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((R - pose.rotation()).cwiseAbs().maxCoeff(), 1e-7);  // what it was off by
  EXPECT_EQ(renormalised(off).translation(), pose.translation());
}

TEST(ConstantVelocity, TheMotionGrowsWithTheTime) {
  ConstantVelocity velocity;
  EXPECT_EQ(difference(velocity.motion(kFramePeriod_s), {}), 0);
  velocity.update(motion_over(kFramePeriod_s), kFramePeriod_s);
  for (const int dropped : {0, 1, 2, 5})
    EXPECT_LT(difference(velocity.motion((1 + dropped) * kFramePeriod_s),
                         motion_over((1 + dropped) * kFramePeriod_s)),
              1e-9)
        << dropped;
}

/// The frame after a gap is followed by one at the usual interval.
TEST(ConstantVelocity, AGapBeforeTheLastFrameDoesNotCount) {
  ConstantVelocity velocity;
  velocity.update(motion_over(4 * kFramePeriod_s), 4 * kFramePeriod_s);
  EXPECT_LT(difference(velocity.motion(kFramePeriod_s), motion_over(kFramePeriod_s)), 1e-9);
}

TEST(ConstantVelocity, ALongGapIsNotExtrapolated) {
  ConstantVelocity velocity;
  velocity.update(motion_over(kFramePeriod_s), kFramePeriod_s);
  EXPECT_LT(difference(velocity.motion(60), motion_over(0.5)), 1e-9);
  velocity.reset();
  EXPECT_EQ(difference(velocity.motion(60), {}), 0);
}

}  // namespace
}  // namespace hm
