#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

using test::landmark_camera;

/// Root mean square distance of keyframes from the truth; the first is where it should be.
double error_m(const CorrectedKeyframes& corrected, const std::vector<SE3>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (corrected.keyframes()[i].T_map_camera.translation() - truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

double odometry_error_m(const test::KeyframesOfWay& way) {
  double sum = 0;
  for (std::size_t i = 0; i < way.truth.size(); ++i)
    sum += (way.keyframes[i]->T_odom_camera.translation() - way.truth[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(way.truth.size()));
}

/// Twice around a ring of 40 m with a yaw drift of 3 mrad/m: odometry is metres off, the corrected map
/// centimetres.
TEST(RgbdLoopCloser, RingIsClosed) {
  Rng rng(1);
  const test::LandmarkWorld world = test::ring(10, 100, rng);
  const test::KeyframesOfWay way = test::walk(world, test::way_around(10, 0.4, 1.6), 0.003, rng);
  RgbdLoopCloser closer(landmark_camera());
  for (const auto& keyframe : way.keyframes) closer.add(keyframe);
  const double solved_m = error_m(closer.corrected(), way.truth);
  const RgbdAlignmentReport report = closer.finish();
  const RgbdLoopStatistics loops = closer.statistics();
  EXPECT_GT(odometry_error_m(way), 0.4);
  EXPECT_GT(loops.accepted, 20U);
  EXPECT_EQ(loops.candidates, loops.accepted + loops.waiting + loops.not_verified + loops.too_far +
                                  loops.ambiguous + loops.unconfirmed);
  const double final_m = error_m(closer.corrected(), way.truth);
  EXPECT_LT(solved_m, 0.02);
  EXPECT_LT(final_m, 0.02);
  EXPECT_EQ(loops.maps, 1U);
  EXPECT_TRUE(report.adjusted);
  EXPECT_GT(report.landmarks, 1000U);
}

test::KeyframesOfWay ring_walk(std::uint64_t seed, double drift_rad_m = 0.003) {
  Rng rng(seed);
  const test::LandmarkWorld world = test::ring(8, 60, rng);
  return test::walk(world, test::way_around(8, 0.5, 1.4), drift_rad_m, rng);
}

TEST(RgbdLoopCloser, SameKeyframesSameBitsAndLiveAgrees) {
  const test::KeyframesOfWay way = ring_walk(2);
  RgbdLoopCloser one(landmark_camera()), other(landmark_camera());
  LiveRgbdLoopCloser live(landmark_camera());
  EXPECT_NE(live.snapshot().corrected, nullptr);
  for (const auto& keyframe : way.keyframes) {
    one.add(keyframe);
    other.add(keyframe);
    live.add(keyframe);
  }
  one.finish();
  other.finish();
  live.finish();
  const LiveRgbdLoopCloser::Snapshot snapshot = live.snapshot();
  EXPECT_EQ(snapshot.waiting_keyframes, 0U);
  EXPECT_EQ(snapshot.statistics.accepted, one.statistics().accepted);
  EXPECT_GT(snapshot.solutions, 1U);
  for (std::size_t i = 0; i < way.keyframes.size(); ++i) {
    const Mat4 expected = one.corrected().keyframes()[i].T_map_camera.matrix();
    EXPECT_EQ(other.corrected().keyframes()[i].T_map_camera.matrix(), expected);
    EXPECT_EQ(snapshot.corrected->keyframes()[i].T_map_camera.matrix(), expected);
  }
}

/// Tracking is lost and begins anew somewhere else, with a pose that means nothing: the submaps are apart
/// until places are seen again, then one map with centimetres of error.
TEST(RgbdLoopCloser, SubmapsGetConnected) {
  test::KeyframesOfWay way = ring_walk(3);
  const std::size_t lost_at = way.keyframes.size() / 2;
  const SE3 jump = SE3::exp((Vec6() << 3, -2, 1, 0.2, 1.5, -0.3).finished());
  for (std::size_t i = lost_at; i < way.keyframes.size(); ++i) {
    Keyframe moved = *way.keyframes[i];
    moved.submap = 4;
    moved.T_odom_camera = jump * moved.T_odom_camera;
    way.keyframes[i] = std::make_shared<const Keyframe>(std::move(moved));
  }
  RgbdLoopCloser closer(landmark_camera());
  for (std::size_t i = 0; i < way.keyframes.size(); ++i) {
    closer.add(way.keyframes[i]);
    if (i != lost_at) continue;
    EXPECT_EQ(closer.statistics().maps, 2U);
    EXPECT_EQ(closer.corrected().keyframes().back().map, 1);
    EXPECT_LT(closer.T_map_odom().log().norm(), 1e-9);
  }
  closer.finish();
  EXPECT_EQ(closer.statistics().submaps, 2U);
  EXPECT_EQ(closer.statistics().maps, 1U);
  EXPECT_EQ(closer.corrected().keyframes().back().map, 0);
  EXPECT_LT(error_m(closer.corrected(), way.truth), 0.06);
}

/// Odometry that is right, and says so, is not made worse by loops that know less: they become no edges. One
/// that says nothing of itself is taken for worse, and loops for edges.
TEST(RgbdLoopCloser, CertainOdometryIsLeftInPeace) {
  double error_of_uncertain_m = 0;
  for (const bool is_certain : {false, true}) {
    test::KeyframesOfWay way = ring_walk(5, 0.0);
    if (is_certain)
      for (std::size_t i = 1; i < way.keyframes.size(); ++i) {
        Keyframe sure = *way.keyframes[i];
        sure.motion_covariance = 1e-8 * Mat6::Identity();
        way.keyframes[i] = std::make_shared<const Keyframe>(std::move(sure));
      }
    RgbdLoopParams params;
    params.bundle_adjustment = false;
    RgbdLoopCloser closer(landmark_camera(), params);
    for (const auto& keyframe : way.keyframes) closer.add(keyframe);
    closer.finish();
    const RgbdLoopStatistics loops = closer.statistics();
    EXPECT_GT(loops.accepted, 20U);
    if (is_certain) {
      EXPECT_GT(loops.redundant, loops.accepted / 2);
      EXPECT_LT(error_m(closer.corrected(), way.truth), 0.002);
      EXPECT_LT(error_m(closer.corrected(), way.truth), error_of_uncertain_m / 2);
    } else {
      error_of_uncertain_m = error_m(closer.corrected(), way.truth);
      EXPECT_LT(loops.redundant, loops.accepted / 2);
    }
  }
}

/// Ten keyframes a metre apart; from the fourth to the seventh odometry drifts by 10 cm each, by surfaces
/// that say so, and is then found by landmarks of the third: the drift is taken out of those between, and
/// none of it is in the motion to the eighth.
TEST(RgbdLoopCloser, DriftIsTakenOutOfTheKeyframesBetween) {
  const auto along_x = [](double x_m) { return SE3(Mat3::Identity(), Vec3(x_m, 0, 0)); };
  RgbdLoopParams params;
  params.bundle_adjustment = false;
  RgbdLoopCloser closer(landmark_camera(), params);
  for (int i = 0; i < 10; ++i) {
    const double drift_m = i < 3 || i > 7 ? 0 : 0.1 * (i - 2);
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->frame_index = static_cast<std::size_t>(10 * i);
    keyframe->stamp = Time::from_seconds(1 + i);
    keyframe->T_odom_camera = along_x(i + (i < 7 ? drift_m : 0));
    keyframe->motion_covariance = Mat6::Identity() * (i < 3 || i > 6 ? 1e-6 : 0.01);
    if (i == 7)
      keyframe->end_of_drift = EndOfDrift{along_x(i + drift_m), Mat6::Identity() * 0.01, 20, along_x(5)};
    const RgbdLoopStep step = closer.add(keyframe);
    EXPECT_EQ(step.solved, i == 7) << i;
  }
  const CorrectedKeyframes corrected = closer.corrected();
  for (int i = 0; i < 10; ++i)
    EXPECT_NEAR(corrected.keyframes()[static_cast<std::size_t>(i)].T_map_camera.translation().x(), i, 0.01)
        << i;
  EXPECT_LT(corrected.T_map_odom().translation().norm(), 0.01);
}

TEST(RgbdLoopCloser, DisabledItLinksNoVisits) {
  RgbdLoopParams params;
  params.enabled = false;
  RgbdLoopCloser closer(landmark_camera(), params);
  for (const auto& keyframe : ring_walk(2).keyframes) closer.add(keyframe);
  EXPECT_EQ(closer.finish().visit_links, 0U);
}

TEST(RgbdLoopCloser, DisabledAndEmpty) {
  RgbdLoopParams params;
  params.enabled = params.bundle_adjustment = false;
  RgbdLoopCloser closer(landmark_camera(), params);
  EXPECT_FALSE(closer.finish().adjusted);
  EXPECT_EQ(closer.T_map_odom().matrix(), Mat4(Mat4::Identity()));
  const test::KeyframesOfWay way = ring_walk(2);
  for (const auto& keyframe : way.keyframes) EXPECT_FALSE(closer.add(keyframe).solved);
  closer.finish();
  EXPECT_EQ(closer.statistics().candidates, 0U);
  for (std::size_t i = 0; i < way.keyframes.size(); ++i)
    EXPECT_LT((closer.corrected().keyframes()[i].T_map_camera.inverse() * way.keyframes[i]->T_odom_camera)
                  .log()
                  .norm(),
              1e-9);
}

/// Tracking goes on while the closer works: handing over takes no time, whatever is in work.
TEST(LiveRgbdLoopCloser, EndsWithKeyframesWaiting) {
  const test::KeyframesOfWay way = ring_walk(4);
  LiveRgbdLoopCloser live(landmark_camera());
  for (const auto& keyframe : way.keyframes) live.add(keyframe);
  EXPECT_LE(live.snapshot().corrected->keyframes().size(), way.keyframes.size());
}

}  // namespace
}  // namespace hm
