#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {
namespace {

/// Over many worlds and noises the errors must agree with the covariances: the mean of the squared
/// Mahalanobis distance is 6 for six degrees of freedom.
TEST(TrackerCovariance, IsHonestOverSeeds) {
  double sum = 0, worst = 0;
  int count = 0;
  const int seeds = 24;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Rng rng(seed);
    TexturedRoom room;
    room.seed = static_cast<std::uint32_t>(100 * seed);
    const SE3 start(so3_exp(Vec3(0, 0.26 * static_cast<double>(seed), 0)), Vec3::Zero());
    const auto odometry = make_tracker({}, room_camera(), start * path_pose(0));
    for (int i = 0; i < 12; ++i) {
      const SE3 truth = start * path_pose(i * 0.1);
      const RgbdFrame frame =
          render_room(room, room_camera(), truth, Time::from_seconds(1 + i * 0.1), {true, 2.0, {}}, &rng);
      const TrackedFrame tracked = odometry->track(frame);
      ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
      if (i < 4 || i % 4 != 3) continue;
      // exp(xi) T = truth
      const Vec6 error = (truth * tracked.T_odom_camera->inverse()).log();
      const double nees = error.dot(tracked.covariance.ldlt().solve(error));
      sum += nees;
      worst = std::max(worst, nees);
      ++count;
    }
  }
  RecordProperty("mean_nees", std::to_string(sum / count));
  EXPECT_LT(sum / count, 12) << "promises too much";
  EXPECT_GT(sum / count, 2) << "promises too little";
  EXPECT_LT(worst, 60);
}

/// The same for the motion between keyframes and for their landmark observations: the positions of a landmark
/// observed from two keyframes at their true poses agree within both covariances.
TEST(TrackerCovariance, KeyframesAreHonestAboutMotionAndSights) {
  double motions = 0, sights = 0;
  int motion_count = 0, sight_count = 0, far_off = 0;
  const PinholeCamera camera = room_camera();
  const int seeds = 8;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Rng rng(seed);
    TexturedRoom room;
    room.seed = static_cast<std::uint32_t>(100 * seed);
    const SE3 start(so3_exp(Vec3(0, 0.7 * static_cast<double>(seed), 0)), Vec3::Zero());
    const auto odometry = make_tracker({}, camera, start * path_pose(0));
    std::shared_ptr<const Keyframe> last;
    SE3 last_truth;
    for (int i = 0; i < 14; ++i) {
      const SE3 truth = start * path_pose(i * 0.2);
      const TrackedFrame tracked = odometry->track(
          render_room(room, camera, truth, Time::from_seconds(1 + i * 0.2), {true, 2.0, {}}, &rng));
      const auto now = tracked.new_keyframe;
      if (!now) continue;
      // The keyframe's pose is the model's; the one given out is filtered.
      EXPECT_LT((now->T_odom_camera.inverse() * *tracked.T_odom_camera).log().norm(), 3e-3);
      EXPECT_EQ(last == nullptr, now->motion_covariance.isZero(0));
      if (last) {
        const PoseEdge3D edge{0, 1, last->T_odom_camera.inverse() * now->T_odom_camera};
        const Vec6 error = pose_edge_error(edge, last_truth, truth);
        motions += error.dot(now->motion_covariance.ldlt().solve(error));
        ++motion_count;
        for (const LandmarkObservation& before : last->observations)
          for (const LandmarkObservation& after : now->observations) {
            if (before.landmark != after.landmark || !(before.depth_m > 0)) continue;
            const SE3 T_now_last = truth.inverse() * last_truth;
            const Vec2 pixel = camera.project(T_now_last * camera.unproject(before.pixel, before.depth_m));
            const Vec2 apart = pixel - after.pixel;
            const Eigen::Matrix2d covariance = before.pixel_covariance + after.pixel_covariance;
            const double squared = apart.dot(covariance.inverse() * apart);
            far_off += squared > 25 ? 1 : 0;
            sights += std::min(squared, 25.0);
            ++sight_count;
          }
      }
      last = now;
      last_truth = truth;
    }
  }
  ASSERT_GT(motion_count, 2 * seeds - 1);
  ASSERT_GT(sight_count, 125 * seeds);
  RecordProperty("motion", std::to_string(motions / motion_count / 6));
  RecordProperty("sights", std::to_string(sights / sight_count / 2));
  EXPECT_LT(motions / motion_count, 2.5 * 6);
  EXPECT_GT(motions / motion_count, 0.3 * 6);
  EXPECT_LT(sights / sight_count, 2);  // less noise in this room than TrackerParams::kPixelSigma_px assumes
  EXPECT_LT(far_off, sight_count / 50);
}

/// Refined observations of a keyframe have the depths of the frames up to the next keyframe too.
TEST(TrackerCovariance, DepthsOfSightsAreReadOnUntilTheNextKeyframe) {
  Rng rng(3);
  const PinholeCamera camera = room_camera();
  const auto odometry = make_tracker({}, camera, path_pose(0));
  std::shared_ptr<const Keyframe> last;
  int refined = 0, surer = 0, keyframes = 0;
  for (int i = 0; i < 60 && keyframes < 4; ++i) {
    RgbdFrame frame =
        render_room({}, camera, path_pose(i * 0.04), Time::from_seconds(1 + i * 0.04), {true, 2.0, {}}, &rng);
    frame.index = static_cast<std::size_t>(i);
    const auto now = odometry->track(frame).new_keyframe;
    if (!now) continue;
    ++keyframes;
    if (!last) {
      EXPECT_FALSE(now->before);
    } else {
      ASSERT_TRUE(now->before);
      EXPECT_EQ(now->before->frame_index, last->frame_index);
      ASSERT_LE(now->before->observations.size(), last->observations.size());
      for (const LandmarkObservation& later : now->before->observations) {
        const auto first =
            std::ranges::find(last->observations, later.landmark, &LandmarkObservation::landmark);
        ASSERT_NE(first, last->observations.end());
        EXPECT_EQ(first->pixel, later.pixel);
        EXPECT_LE(later.depth_variance_m2, first->depth_variance_m2);
        EXPECT_NEAR(later.depth_m, first->depth_m, 4 * std::sqrt(first->depth_variance_m2));
        surer += later.depth_variance_m2 < 0.7 * first->depth_variance_m2 ? 1 : 0;
        ++refined;
      }
    }
    last = now;
  }
  ASSERT_GE(keyframes, 3);
  ASSERT_GT(refined, 200);
  EXPECT_GT(surer, refined / 2);
}

TEST(TrackerCovariance, GrowsAlongThePathAndIsSymmetric) {
  const auto odometry = make_tracker({}, room_camera(), path_pose(0));
  double first = 0, last = 0;
  for (int i = 0; i < 60; ++i) {
    const TrackedFrame tracked =
        odometry->track(render_room({}, room_camera(), path_pose(i * 0.1), Time::from_seconds(1 + i * 0.1)));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    EXPECT_LT((tracked.covariance - tracked.covariance.transpose()).norm(),
              1e-9 * (1e-9 + tracked.covariance.norm()));
    if (i == 1) first = tracked.covariance.trace();
    last = tracked.covariance.trace();
  }
  EXPECT_GT(first, 0);
  EXPECT_GT(last, first);
}

}  // namespace
}  // namespace hm
