#include "hm/slam/rgbd/corrected_keyframes.hpp"

#include <gtest/gtest.h>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

SE3 random_pose(Rng& rng, double size) {
  return SE3::exp(Vec6::NullaryExpr([&] { return size * rng.normal(); }));
}

CorrectedKeyframe keyframe_at(double seconds, int submap, const SE3& T_odom, const SE3& T_map) {
  CorrectedKeyframe keyframe;
  keyframe.stamp = Time::from_seconds(seconds);
  keyframe.submap = keyframe.map = submap;
  keyframe.T_odom_camera = T_odom;
  keyframe.T_map_camera = T_map;
  return keyframe;
}

TEST(CorrectedKeyframes, NothingKnown) {
  const CorrectedKeyframes none;
  EXPECT_EQ(none.T_map_odom().matrix(), Mat4(Mat4::Identity()));
  EXPECT_FALSE(none.T_map_camera(Time{}, {}));
  const Trajectory way{{Time::from_seconds(1), SE3(Mat3::Identity(), Vec3(1, 2, 3))}};
  EXPECT_EQ(none.corrected(way)[0].T_world_base.matrix(), way[0].T_world_base.matrix());
}

/// Odometry drifts by 0.4 m from one keyframe to the next, and finds its place again there: frames between
/// them are corrected as the drift leads to the second one.
TEST(CorrectedKeyframes, DriftEndsAtAKeyframe) {
  const auto along_x = [](double x_m) { return SE3(Mat3::Identity(), Vec3(x_m, 0, 0)); };
  CorrectedKeyframe end = keyframe_at(11, 0, along_x(1), along_x(1));
  end.T_odom_arrived = along_x(1.4);
  const CorrectedKeyframes corrected(
      {keyframe_at(10, 0, {}, {}), end, keyframe_at(12, 0, along_x(2), along_x(2))});
  for (const double share : {0.25, 0.5, 0.999})
    EXPECT_NEAR(
        corrected.T_map_camera(Time::from_seconds(10 + share), along_x(1.4 * share))->translation().x(),
        share, 1e-9);
  EXPECT_NEAR(corrected.T_map_camera(Time::from_seconds(11), along_x(1))->translation().x(), 1, 1e-9);
  EXPECT_NEAR(corrected.T_map_camera(Time::from_seconds(11.5), along_x(1.5))->translation().x(), 1.5, 1e-9);
}

TEST(CorrectedKeyframes, PiecewiseCarriedAlong) {
  Rng rng(1);
  std::vector<CorrectedKeyframe> keyframes;
  std::vector<SE3> corrections;
  for (int i = 0; i < 4; ++i) {
    const SE3 T_odom = random_pose(rng, 1);
    corrections.push_back(random_pose(rng, 0.3));
    keyframes.push_back(keyframe_at(10 + i, i < 3 ? 0 : 1, T_odom, corrections.back() * T_odom));
  }
  const CorrectedKeyframes corrected(keyframes);
  const SE3 T_odom = random_pose(rng, 1);
  const auto at = [&](double seconds) {
    return *corrected.T_map_camera(Time::from_seconds(seconds), T_odom);
  };
  const auto same = [](const SE3& a, const SE3& b) { return (a.matrix() - b.matrix()).norm() < 1e-9; };
  EXPECT_TRUE(same(at(10), corrections[0] * T_odom));
  EXPECT_TRUE(same(at(11), corrections[1] * T_odom));
  // Before the first and after the last keyframe: rigid. Between: linear and slerp in time.
  EXPECT_TRUE(same(at(3), corrections[0] * T_odom));
  EXPECT_TRUE(same(at(99), corrections[3] * T_odom));
  EXPECT_TRUE(same(at(10.25), interpolate(corrections[0] * T_odom, corrections[1] * T_odom, 0.25)));
  // No interpolation between submaps: the older one's correction is used until the newer one begins.
  EXPECT_TRUE(same(at(12.9), corrections[2] * T_odom));
  EXPECT_TRUE(same(at(13), corrections[3] * T_odom));
  EXPECT_EQ(corrected.map_at(Time::from_seconds(12.9)), 0);
  EXPECT_EQ(corrected.map_at(Time::from_seconds(13)), 1);
  EXPECT_TRUE(same(corrected.T_map_odom(), corrections[3]));
  // A trajectory stays continuous: small steps in time give small steps in position.
  SE3 last = at(9);
  for (double t = 9; t < 12.9; t += 0.001) {
    EXPECT_LT((last.inverse() * at(t)).log().norm(), 0.02);
    last = at(t);
  }
}

}  // namespace
}  // namespace hm
