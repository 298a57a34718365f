#include "hm/odometry/published/published_odometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/testing/box_room.hpp"

namespace hm {
namespace {

constexpr double kPeriod_s = 1.0 / 15;

const std::vector<RgbdFrame>& way_frames() {
  static const std::vector<RgbdFrame> kFrames = [] {
    std::vector<RgbdFrame> frames;
    for (int i = 0; i < 24; ++i) {
      const double t = kPeriod_s * i;
      frames.push_back(render({1, 0.0014}, small_camera(), way_through_room(t), t));
    }
    return frames;
  }();
  return kFrames;
}

OdometryParams params_of(OdometryMethod method) {
  OdometryParams params;
  params.method = method;
  return params;
}

/// Odometry that starts at the first frame's true pose.
std::unique_ptr<VisualOdometry> odometry(const OdometryParams& params) {
  return make_published_odometry(params, small_camera(), *way_frames().front().T_world_camera);
}

RgbdFrame later(RgbdFrame frame, double seconds) {
  frame.stamp = frame.color_stamp = frame.stamp + Duration::from_seconds(seconds);
  return frame;
}

class EachMethod : public testing::TestWithParam<OdometryMethod> {};

TEST_P(EachMethod, FollowsAKnownWay) {
  const auto vo = odometry(params_of(GetParam()));
  for (const RgbdFrame& frame : way_frames()) {
    const TrackedFrame tracked = vo->track(frame);
    const bool first = &frame == &way_frames().front();
    ASSERT_EQ(tracked.status, first ? TrackingStatus::kStarted : TrackingStatus::kTracked) << tracked.reason;
    const SE3 error = tracked.T_odom_camera->inverse() * *frame.T_world_camera;
    EXPECT_LT(error.translation().norm(), 0.05);
    EXPECT_LT(error.angle(), 0.025);
    EXPECT_TRUE(is_rigid(*tracked.T_odom_camera));
    if (first) continue;
    const Vec6 values = Eigen::SelfAdjointEigenSolver<Mat6>(tracked.covariance).eigenvalues();
    EXPECT_GT(values.minCoeff(), 0);
    EXPECT_LT(std::sqrt(values.maxCoeff()), 0.1);
  }
}

TEST_P(EachMethod, NumbersTellWhatHappened) {
  const auto vo = odometry(params_of(GetParam()));
  const bool has_model = GetParam() != OdometryMethod::kFrameToFrame;
  std::size_t last_points = 0;
  for (const RgbdFrame& frame : way_frames()) {
    const TrackingNumbers numbers = vo->track(frame).numbers;
    EXPECT_GT(numbers.features, 100);
    EXPECT_LE(numbers.features_with_depth, numbers.features);
    EXPECT_LE(numbers.inliers, numbers.features_with_depth);
    EXPECT_NEAR(numbers.depth_coverage_ratio, 1, 1e-9);
    EXPECT_GT(numbers.sharpness, 50);
    EXPECT_GE(numbers.model_points, last_points);
    last_points = numbers.model_points;
    EXPECT_GT(numbers.features_ms, 0);
    EXPECT_GE(numbers.total_ms,
              numbers.features_ms + numbers.prediction_ms + numbers.registration_ms + numbers.model_ms);
  }
  EXPECT_EQ(last_points > 0, has_model);
}

/// Frames that cannot be registered change nothing: later results are the same as without them.
TEST_P(EachMethod, AFailedRegistrationLeavesTheModelUnchanged) {
  const RgbdFrame& good = way_frames()[5];
  std::vector<RgbdFrame> bad(4, good);
  bad[0].color = Image<Rgb8>(320, 240, {0, 0, 0});         // dark
  bad[1].color = Image<Rgb8>(320, 240, {180, 180, 180});   // textureless
  bad[2].depth.units = Image<std::uint16_t>(320, 240, 0);  // no reading at all
  bad[3] = render({77, 0.0014}, small_camera(),            // another room, far away
                  SE3(way_through_room(9).rotation(), Vec3(-1.8, -1.2, 0.9)), 0);
  if (GetParam() == OdometryMethod::kPublishedIcp) bad.pop_back();  // pairs any near points: no descriptors
  const auto disturbed = odometry(params_of(GetParam()));
  const auto undisturbed = odometry(params_of(GetParam()));
  for (std::size_t i = 0; i < 10; ++i) {
    const TrackedFrame expected = undisturbed->track(way_frames()[i]);
    const TrackedFrame tracked = disturbed->track(way_frames()[i]);
    ASSERT_TRUE(tracked.T_odom_camera.has_value()) << tracked.reason;
    ASSERT_EQ(tracked.T_odom_camera->matrix(), expected.T_odom_camera->matrix()) << i;
    ASSERT_EQ(tracked.numbers.model_points, expected.numbers.model_points);
    if (i < 4) continue;
    for (std::size_t k = 0; k < bad.size(); ++k) {
      bad[k].stamp = way_frames()[i].stamp + Duration::from_seconds(0.01 * static_cast<double>(k + 1));
      const TrackedFrame lost = disturbed->track(bad[k]);
      if (k == 3 && GetParam() == OdometryMethod::kPublishedRansacIcp) continue;  // falls back to plain ICP
      ASSERT_EQ(lost.status, TrackingStatus::kLost) << k;
      EXPECT_FALSE(lost.T_odom_camera);
      EXPECT_EQ(lost.numbers.model_points, expected.numbers.model_points);
      EXPECT_NE(lost.reason.find("needed"), std::string::npos) << lost.reason;
      EXPECT_NE(lost.reason.find("sharpness"), std::string::npos) << lost.reason;
    }
  }
}

TEST_P(EachMethod, SameFramesSameBits) {
  const auto a = odometry(params_of(GetParam()));
  const auto b = odometry(params_of(GetParam()));
  for (std::size_t i = 0; i < 10; ++i) {
    const TrackedFrame x = a->track(way_frames()[i]), y = b->track(way_frames()[i]);
    ASSERT_EQ(x.T_odom_camera->matrix(), y.T_odom_camera->matrix());
    ASSERT_EQ(x.covariance, y.covariance);
    ASSERT_EQ(x.numbers.inliers, y.numbers.inliers);
  }
}

/// The motion is composed in the camera's frame: the same images from another start give the same path.
TEST_P(EachMethod, TheStartMovesTheWayRigidly) {
  const SE3 start(so3_exp(Vec3(1.2, -0.4, 2.0)), Vec3(30, -20, 5));
  const auto moved = make_published_odometry(params_of(GetParam()), small_camera(), start);
  const auto plain = make_published_odometry(params_of(GetParam()), small_camera());
  for (const RgbdFrame& frame : way_frames()) {
    const TrackedFrame a = moved->track(frame), b = plain->track(frame);
    ASSERT_TRUE(a.T_odom_camera && b.T_odom_camera);
    EXPECT_LT((start.inverse() * *a.T_odom_camera * b.T_odom_camera->inverse()).log().norm(), 1e-3);
  }
}

TEST_P(EachMethod, TurningOnTheSpotAndStandingStill) {
  const auto vo = make_published_odometry(params_of(GetParam()), small_camera(), way_through_room(0));
  double t = 0;
  for (int i = 0; i < 20; ++i, t += kPeriod_s) {
    const double angle = 0.012 * std::min(i, 12);  // then the same image again and again
    const SE3 truth = way_through_room(0) * SE3(so3_exp(Vec3(0, angle, 0)), Vec3::Zero());
    const TrackedFrame tracked = vo->track(render({1, 0}, small_camera(), truth, t));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    const SE3 error = tracked.T_odom_camera->inverse() * truth;
    EXPECT_LT(error.translation().norm(), 0.04) << i;
    EXPECT_LT(error.angle(), 0.02) << i;
  }
}

TEST_P(EachMethod, ASingleDepthIsAWall) {
  const auto vo = odometry(params_of(GetParam()));
  for (int i = 0; i < 5; ++i) {
    RgbdFrame frame = later(way_frames().front(), kPeriod_s * i);
    frame.depth.units = Image<std::uint16_t>(320, 240, 10000);  // 2 m
    const TrackedFrame tracked = vo->track(frame);
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    EXPECT_LT((tracked.T_odom_camera->inverse() * *frame.T_world_camera).log().norm(), 1e-6);
  }
}

TEST_P(EachMethod, FramesThatCannotBeUsedAreSkipped) {
  const auto vo = odometry(params_of(GetParam()));
  const RgbdFrame& good = way_frames().front();
  RgbdFrame without_color = good, small = good;
  without_color.color = {};
  small.depth.units = Image<std::uint16_t>(160, 120, 1000);
  EXPECT_EQ(vo->track(without_color).status, TrackingStatus::kSkipped);
  EXPECT_EQ(vo->track(small).status, TrackingStatus::kSkipped);
  EXPECT_EQ(vo->track(good).status, TrackingStatus::kStarted);
  const TrackedFrame again = vo->track(good);
  EXPECT_EQ(again.status, TrackingStatus::kSkipped);
  EXPECT_NE(again.reason.find("not after"), std::string::npos) << again.reason;
}

/// A jump back to the start, too far from the last pose: the camera can only be relocalised by a keyframe.
TEST_P(EachMethod, IsRelocalisedWhereItHasBeenBefore) {
  const auto vo = odometry(params_of(GetParam()));
  const SE3 start = *way_frames().front().T_world_camera;
  const auto turned = [&](int i) { return start * SE3(so3_exp(Vec3(0, 0.035 * i, 0)), Vec3::Zero()); };
  double t = 0;
  for (int i = 0; i < 45; ++i, t += kPeriod_s) {
    const TrackedFrame tracked = vo->track(render({1, 0.0014}, small_camera(), turned(i), t));
    ASSERT_TRUE(tracked.T_odom_camera) << i;
    ASSERT_LT((tracked.T_odom_camera->inverse() * turned(i)).translation().norm(), 0.1) << i;
  }
  const RgbdFrame back = later(way_frames().front(), t + 3 * kPeriod_s);
  RgbdFrame dark = back;
  dark.color = Image<Rgb8>(320, 240, {3, 3, 3});
  std::size_t points = 0;
  for (int i = 0; i < 3; ++i) points = vo->track(later(dark, (i - 3) * kPeriod_s)).numbers.model_points;
  TrackedFrame tracked;
  for (int i = 0; i < 10 && !tracked.T_odom_camera; ++i) {
    tracked = vo->track(later(back, i * kPeriod_s));
    const bool found = tracked.T_odom_camera.has_value();
    EXPECT_TRUE(found || tracked.numbers.model_points == points);
  }
  ASSERT_EQ(tracked.status, TrackingStatus::kRelocalised) << tracked.reason;
  EXPECT_EQ(tracked.submap, 0);
  EXPECT_LT((tracked.T_odom_camera->inverse() * start).translation().norm(), 0.03);
  EXPECT_LT((tracked.T_odom_camera->inverse() * start).angle(), 0.02);
  const Vec6 values = Eigen::SelfAdjointEigenSolver<Mat6>(tracked.covariance).eigenvalues();
  EXPECT_GT(values.minCoeff(), 0);
}

TEST_P(EachMethod, ANewSubmapBeginsAfterALongTimeLost) {
  OdometryParams params = params_of(GetParam());
  params.published.max_lost_frames = 5;
  const auto vo = odometry(params);
  ASSERT_EQ(vo->track(way_frames().front()).status, TrackingStatus::kStarted);
  RgbdFrame dark = way_frames().front();
  dark.color = Image<Rgb8>(320, 240, {3, 3, 3});
  for (int i = 1; i <= 8; ++i) EXPECT_EQ(vo->track(later(dark, kPeriod_s * i)).status, TrackingStatus::kLost);
  // Another room, seen from another position: not the old one, and ICP finds no points nearby.
  const RgbdFrame elsewhere =
      render({99, 0}, small_camera(), SE3(way_through_room(0).rotation(), Vec3(1.9, -1.5, 0)), 5);
  const TrackedFrame tracked = vo->track(elsewhere);
  ASSERT_EQ(tracked.status, TrackingStatus::kStarted) << tracked.reason;
  EXPECT_EQ(tracked.submap, 1);
  ASSERT_TRUE(tracked.new_keyframe);
  EXPECT_EQ(tracked.new_keyframe->submap, 1);
  EXPECT_TRUE(tracked.reason.empty());
}

TEST_P(EachMethod, KeyframesComeWithMotion) {
  const auto vo = odometry(params_of(GetParam()));
  int keyframes = 0;
  SE3 last;
  for (const RgbdFrame& frame : way_frames()) {
    const TrackedFrame tracked = vo->track(frame);
    if (!tracked.new_keyframe) continue;
    if (keyframes > 0) {
      const SE3 moved = last.inverse() * tracked.new_keyframe->T_odom_camera;
      EXPECT_TRUE(moved.translation().norm() >= 0.10 || moved.angle() >= 0.1745);
    }
    last = tracked.new_keyframe->T_odom_camera;
    EXPECT_GT(tracked.new_keyframe->features.size(), 100U);
    ++keyframes;
  }
  EXPECT_GE(keyframes, 3);
}

INSTANTIATE_TEST_SUITE_P(Published, EachMethod,
                         testing::Values(OdometryMethod::kPublishedIcp, OdometryMethod::kPublishedRansacIcp,
                                         OdometryMethod::kFrameToFrame),
                         [](const auto& each) {
                           std::string name(kOdometryMethodNames[static_cast<std::size_t>(each.param)]);
                           std::erase(name, '_');
                           return name;
                         });

/// Fast motion needs RANSAC's prediction: ICP alone pairs wrong points (5 Hz, rotating).
TEST(PublishedOdometry, PredictionCarriesTheModelThroughFastMotion) {
  const SE3 start(so3_exp(Vec3(0.3, 1.0, -0.5)), Vec3(1, 2, 3));
  const auto vo =
      make_published_odometry(params_of(OdometryMethod::kPublishedRansacIcp), small_camera(), start);
  for (int i = 0; i < 8; ++i) {
    const SE3 truth = way_through_room(0) * SE3(so3_exp(Vec3(0, 0.12 * i, 0)), Vec3(0.05 * i, 0, 0.02 * i));
    const TrackedFrame tracked = vo->track(render({1, 0.0014}, small_camera(), truth, 0.2 * i));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    const SE3 error =
        (start.inverse() * *tracked.T_odom_camera).inverse() * way_through_room(0).inverse() * truth;
    EXPECT_LT(error.translation().norm(), 0.06) << i;
    EXPECT_LT(error.angle(), 0.03) << i;
  }
}

TEST(PublishedOdometry, TheModelIsBounded) {
  OdometryParams params = params_of(OdometryMethod::kPublishedRansacIcp);
  params.published.model.max_model_points = 400;
  const auto vo = odometry(params);
  std::size_t full = 0;
  for (const RgbdFrame& frame : way_frames()) {
    const TrackedFrame tracked = vo->track(frame);
    EXPECT_LE(tracked.numbers.model_points, 400U);
    if (tracked.numbers.model_points == 400 && full == 0) full = vo->memory_bytes();
  }
  ASSERT_GT(full, 0U);
  EXPECT_LE(vo->memory_bytes(), full + 400 * sizeof(Feature));  // the last frame's features vary
}

TEST(PublishedOdometry, ConstrainedMotionTurnsAboutTheVerticalOnly) {
  OdometryParams params = params_of(OdometryMethod::kPublishedRansacIcp);
  params.published.constraint = MotionConstraint::kRollPitchHeight;
  const SE3 start = way_through_room(0);  // z up
  const auto vo = make_published_odometry(params, small_camera(), start);
  for (int i = 0; i < 10; ++i) {
    const SE3 truth = SE3(so3_exp(Vec3(0, 0, 0.02 * i)), Vec3(0.01 * i, 0, 0)) * start;
    const TrackedFrame tracked = vo->track(render({1, 0.0014}, small_camera(), truth, kPeriod_s * i));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    const SE3 moved = *tracked.T_odom_camera * start.inverse();
    EXPECT_LT((moved.rotation() * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(tracked.T_odom_camera->translation().z(), start.translation().z(), 1e-9);
    EXPECT_LT((tracked.T_odom_camera->inverse() * truth).translation().norm(), 0.05);
  }
}

}  // namespace
}  // namespace hm
