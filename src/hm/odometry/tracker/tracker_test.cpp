#include "hm/odometry/tracker/tracker.hpp"

#include <gmock/gmock.h>

#include <cstring>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/registration/pose_equations.hpp"
#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

constexpr double kFrame_s = 1.0 / 30;

RgbdFrame frame_at(int index, const SE3& T_world_camera, const TexturedRoom& room = {}) {
  RgbdFrame frame =
      render_room(room, room_camera(), T_world_camera, Time::from_seconds(1 + index * kFrame_s));
  frame.index = static_cast<std::size_t>(index);
  return frame;
}

RgbdFrame black_frame(int index) {
  RgbdFrame frame = frame_at(index, {});
  std::fill(frame.color.pixels().begin(), frame.color.pixels().end(), Rgb8{});
  std::fill(frame.depth.units.pixels().begin(), frame.depth.units.pixels().end(), std::uint16_t{0});
  return frame;
}

/// Pose error of the tracker, started at path_pose(0).
double error_m(const TrackedFrame& tracked, const SE3& T_world_camera) {
  return (tracked.T_odom_camera->translation() - T_world_camera.translation()).norm();
}

std::unique_ptr<VisualOdometry> tracker(const OdometryParams& params = {}) {
  return make_tracker(params, room_camera(), path_pose(0));
}

TEST(Tracker, FollowsAPathThroughATexturedRoom) {
  const auto odometry = tracker();
  double worst_m = 0, worst_rad = 0;
  int keyframes = 0;
  for (int i = 0; i < 90; ++i) {
    const SE3 truth = path_pose(i * kFrame_s);
    const TrackedFrame tracked = odometry->track(frame_at(i, truth));
    ASSERT_EQ(tracked.status, i == 0 ? TrackingStatus::kStarted : TrackingStatus::kTracked) << tracked.reason;
    ASSERT_TRUE(tracked.T_odom_camera);
    worst_m = std::max(worst_m, error_m(tracked, truth));
    worst_rad = std::max(worst_rad, (tracked.T_odom_camera->inverse() * truth).angle());
    keyframes += tracked.new_keyframe ? 1 : 0;
  }
  EXPECT_LT(worst_m, 0.003);
  EXPECT_LT(worst_rad, 0.002);
  EXPECT_GT(keyframes, 2);
  EXPECT_LT(keyframes, 45);
}

TEST(Tracker, FollowsAtFiveHertz) {
  const auto odometry = tracker();
  for (int i = 0; i < 90; i += 6) {
    const SE3 truth = path_pose(i * kFrame_s);
    const TrackedFrame tracked = odometry->track(frame_at(i, truth));
    ASSERT_TRUE(tracked.T_odom_camera) << i << " " << tracked.reason;
    EXPECT_LT(error_m(tracked, truth), 0.005) << i;
  }
}

TEST(Tracker, APureRotationIsOne) {
  const auto odometry = make_tracker({}, room_camera());
  for (int i = 0; i < 60; ++i) {
    const SE3 truth(so3_exp(Vec3(0, 0.02 * i, 0)), Vec3::Zero());
    const TrackedFrame tracked = odometry->track(frame_at(i, truth));
    ASSERT_TRUE(tracked.T_odom_camera) << i << " " << tracked.reason;
    EXPECT_LT(tracked.T_odom_camera->translation().norm(), 0.004) << i;
    EXPECT_LT((tracked.T_odom_camera->inverse() * truth).angle(), 0.003) << i;
  }
}

TEST(Tracker, ARepeatedPictureDoesNotMove) {
  const auto odometry = tracker();
  for (int i = 0; i < 20; ++i) {
    const TrackedFrame tracked = odometry->track(frame_at(i, path_pose(0)));
    ASSERT_TRUE(tracked.T_odom_camera);
    EXPECT_LT(error_m(tracked, path_pose(0)), 1e-4);
    EXPECT_EQ(tracked.new_keyframe != nullptr, i == 0);
  }
}

TEST(Tracker, BeginsByDepthAloneWithoutTextureOrLight) {
  TexturedRoom blank, dark;
  blank.contrast = 0;
  dark.brightness = 0;
  for (const RgbdFrame& frame : {frame_at(0, path_pose(0), blank), frame_at(0, path_pose(0), dark)}) {
    const auto odometry = tracker();
    const TrackedFrame tracked = odometry->track(frame);
    EXPECT_EQ(tracked.status, TrackingStatus::kStarted);
    EXPECT_TRUE(tracked.numbers.by_depth);
    EXPECT_EQ(tracked.numbers.model_points, 0u);
    EXPECT_TRUE(odometry->track(frame_at(1, path_pose(0))).T_odom_camera);  // light again
  }
}

TEST(Tracker, CannotBeginWithoutDepth) {
  RgbdFrame no_depth = frame_at(0, path_pose(0));
  std::fill(no_depth.depth.units.pixels().begin(), no_depth.depth.units.pixels().end(), std::uint16_t{0});
  const auto odometry = tracker();
  const TrackedFrame tracked = odometry->track(no_depth);
  EXPECT_EQ(tracked.status, TrackingStatus::kLost);
  EXPECT_FALSE(tracked.T_odom_camera);
  EXPECT_THAT(tracked.reason, HasSubstr("0 features with depth"));
  EXPECT_EQ(tracked.numbers.model_points, 0u);
  EXPECT_TRUE(odometry->track(frame_at(1, path_pose(0))).T_odom_camera);
}

TEST(Tracker, ReadingsOfOneDepthAreEnough) {
  TexturedRoom wall;
  wall.half_size_m = Vec3(9, 9, 1.5);
  const auto odometry = make_tracker({}, room_camera());
  for (int i = 0; i < 30; ++i) {
    const SE3 truth(Mat3::Identity(), Vec3(0.01 * i, 0.004 * i, 0));
    const TrackedFrame tracked = odometry->track(frame_at(i, truth, wall));
    ASSERT_TRUE(tracked.T_odom_camera) << i << " " << tracked.reason;
    EXPECT_LT(error_m(tracked, truth), 0.005) << i;
  }
}

TEST(Tracker, TracksOnWithoutDepthForAWhile) {
  const auto odometry = tracker();
  for (int i = 0; i < 30; ++i) {
    RgbdFrame frame = frame_at(i, path_pose(i * kFrame_s));
    if (i >= 20)
      std::fill(frame.depth.units.pixels().begin(), frame.depth.units.pixels().end(), std::uint16_t{0});
    const TrackedFrame tracked = odometry->track(frame);
    ASSERT_TRUE(tracked.T_odom_camera) << i << " " << tracked.reason;
    EXPECT_LT(error_m(tracked, path_pose(i * kFrame_s)), 0.005) << i;
  }
}

TEST(Tracker, IsFoundAgainAfterThirtyBlackFrames) {
  const auto odometry = tracker();
  int i = 0;
  TrackedFrame tracked;
  for (; i < 30; ++i) tracked = odometry->track(frame_at(i, path_pose(i * kFrame_s)));
  const std::size_t points = tracked.numbers.model_points;
  const std::size_t bytes = odometry->memory_bytes();
  for (; i < 60; ++i) {
    tracked = odometry->track(black_frame(i));
    EXPECT_EQ(tracked.status, TrackingStatus::kLost);
    EXPECT_FALSE(tracked.T_odom_camera);
    EXPECT_THAT(tracked.reason, HasSubstr("sharpness 0.0, depth in 0 %"));
    EXPECT_EQ(tracked.numbers.model_points, points);
    EXPECT_EQ(tracked.new_keyframe, nullptr);
  }
  EXPECT_EQ(odometry->memory_bytes(), bytes);
  for (; i < 70; ++i) {
    const SE3 truth = path_pose((i - 30) * kFrame_s);
    tracked = odometry->track(frame_at(i, truth));
    ASSERT_TRUE(tracked.T_odom_camera) << tracked.reason;
    EXPECT_LT(error_m(tracked, truth), 0.004);
    EXPECT_EQ(tracked.submap, 0);
  }
}

TEST(Tracker, IsRelocalisedWhereItHasBeenBefore) {
  const auto odometry = tracker();
  int i = 0;
  for (; i < 60; ++i) odometry->track(frame_at(i, path_pose(i * kFrame_s)));
  for (; i < 63; ++i) odometry->track(black_frame(i));
  const SE3 truth = path_pose(10 * kFrame_s);  // a jump back of 50 frames
  ASSERT_GT((truth.inverse() * path_pose(59 * kFrame_s)).angle(), 0.3);
  TrackedFrame tracked;
  for (; i < 80 && !tracked.T_odom_camera; ++i) tracked = odometry->track(frame_at(i, truth));
  ASSERT_EQ(tracked.status, TrackingStatus::kRelocalised) << tracked.reason;
  EXPECT_LT(error_m(tracked, truth), 0.005);
}

TEST(Tracker, BeginsASubmapWhereItWasNeverBefore) {
  OdometryParams params;
  params.tracker.submap_after_frames = 5;
  const auto odometry = tracker(params);
  int i = 0;
  for (; i < 20; ++i) odometry->track(frame_at(i, path_pose(i * kFrame_s)));
  TexturedRoom elsewhere;
  elsewhere.seed = 77;
  int lost = 0;
  TrackedFrame tracked;
  for (; i < 40; ++i, ++lost) {
    tracked = odometry->track(frame_at(i, path_pose(0), elsewhere));
    if (tracked.T_odom_camera) break;
    EXPECT_THAT(tracked.reason, HasSubstr("match"));
  }
  EXPECT_EQ(lost, 4);
  EXPECT_EQ(tracked.status, TrackingStatus::kStarted);
  EXPECT_EQ(tracked.submap, 1);
  ASSERT_TRUE(tracked.new_keyframe);
  EXPECT_EQ(tracked.new_keyframe->submap, 1);
  tracked = odometry->track(frame_at(i + 1, path_pose(0), elsewhere));
  EXPECT_EQ(tracked.status, TrackingStatus::kTracked);
  EXPECT_EQ(tracked.submap, 1);
}

/// At five frames per second, sixty frames would be twelve seconds without a pose.
TEST(Tracker, BeginsASubmapAfterTwoSecondsAtAnyRate) {
  const auto odometry = tracker();
  for (int i = 0; i < 4; ++i) odometry->track(frame_at(6 * i, path_pose(6 * i * kFrame_s)));
  TexturedRoom elsewhere;
  elsewhere.seed = 77;
  int lost = 0;
  TrackedFrame tracked;
  for (int i = 4; i < 30; ++i, ++lost) {
    tracked = odometry->track(frame_at(6 * i, path_pose(0), elsewhere));
    if (tracked.T_odom_camera) break;
  }
  EXPECT_EQ(lost, 10);
  EXPECT_EQ(tracked.status, TrackingStatus::kStarted);
  EXPECT_EQ(tracked.submap, 1);
}

TEST(Tracker, SkipsWhatItCannotUse) {
  const auto odometry = tracker();
  odometry->track(frame_at(0, path_pose(0)));
  const std::size_t bytes = odometry->memory_bytes();
  RgbdFrame small = frame_at(1, path_pose(0)), shallow = small, early = frame_at(-1, path_pose(0)),
            same = frame_at(0, path_pose(0));
  small.color = Image<Rgb8>(160, 120);
  shallow.color = Image<Rgb8>();
  shallow.depth.units = Image<std::uint16_t>(160, 120);
  const std::pair<RgbdFrame, std::string> cases[] = {
      {small, "160x120"}, {shallow, "160x120"}, {early, "not after"}, {same, "not after"}};
  for (const auto& [frame, word] : cases) {
    const TrackedFrame tracked = odometry->track(frame);
    EXPECT_EQ(tracked.status, TrackingStatus::kSkipped);
    EXPECT_FALSE(tracked.T_odom_camera);
    EXPECT_THAT(tracked.reason, HasSubstr(word));
  }
  EXPECT_EQ(odometry->memory_bytes(), bytes);
  EXPECT_EQ(odometry->track(frame_at(1, path_pose(kFrame_s))).status, TrackingStatus::kTracked);
}

TEST(Tracker, TheModelIsBounded) {
  OdometryParams params;
  params.tracker.max_model_points = 300;
  params.tracker.max_keyframes = 5;
  const auto odometry = tracker(params);
  std::size_t most = 0;
  for (int i = 0; i < 200; i += 2) {
    const TrackedFrame tracked = odometry->track(frame_at(i, path_pose(i * kFrame_s)));
    ASSERT_TRUE(tracked.T_odom_camera) << i << " " << tracked.reason;
    EXPECT_LE(tracked.numbers.model_points, 300u);
    EXPECT_LT(error_m(tracked, path_pose(i * kFrame_s)), 0.02);
    most = std::max(most, odometry->memory_bytes());
  }
  EXPECT_LT(most, 4'000'000u);
}

/// Results are independent of the pose of odom, near or hundreds of metres away, with any rotation.
TEST(Tracker, TheResultDoesNotDependOnWhereOdomIs) {
  Rng rng(8);
  std::vector<RgbdFrame> frames;
  for (int i = 0; i < 40; ++i)
    frames.push_back(render_room({}, room_camera(), path_pose(2 * i * kFrame_s),
                                 Time::from_seconds(1 + i * kFrame_s), {true, 3.0, {}}, &rng));
  const auto follow = [&frames](const SE3& T_odom_start) {
    const auto odometry = make_tracker({}, room_camera(), T_odom_start);
    std::vector<TrackedFrame> tracked;
    for (const RgbdFrame& frame : frames) tracked.push_back(odometry->track(frame));
    return tracked;
  };
  const std::vector<TrackedFrame> expected = follow({});
  for (const double reach_m : {3.0, 3.0, 500.0}) {
    const SE3 T_odom_start(so3_exp(3 * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1))),
                           reach_m * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)));
    const std::vector<TrackedFrame> tracked = follow(T_odom_start);
    const Mat6 to_odom = adjoint(T_odom_start);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      ASSERT_TRUE(tracked[i].T_odom_camera) << i << " " << tracked[i].reason;
      const SE3 error = (T_odom_start * *expected[i].T_odom_camera).inverse() * *tracked[i].T_odom_camera;
      EXPECT_LT(error.log().norm(), 1e-11 * (1 + reach_m)) << i;
      const Mat6 covariance = to_odom * expected[i].covariance * to_odom.transpose();
      EXPECT_LE((tracked[i].covariance - covariance).norm(), 1e-9 * covariance.norm()) << i;
      ASSERT_EQ(tracked[i].new_keyframe == nullptr, expected[i].new_keyframe == nullptr) << i;
      if (!tracked[i].new_keyframe) continue;
      const SE3 T_keyframe = T_odom_start * expected[i].new_keyframe->T_odom_camera;
      EXPECT_LT((T_keyframe.inverse() * tracked[i].new_keyframe->T_odom_camera).log().norm(),
                1e-11 * (1 + reach_m))
          << i;
    }
  }
}

/// A fast rotation with randomly missing frames: the motion since the last pose spans several frames, or one
/// after a gap.
TEST(Tracker, DroppedFramesDoNotSpoilThePrediction) {
  TexturedRoom room;
  room.half_size_m = Vec3(4, 2.5, 4);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Rng rng(seed);
    const auto odometry = make_tracker({}, room_camera());
    int lost = 0, frame = 0;
    double worst_m = 0;
    for (int k = 0; k < 40; ++k, frame += rng.uniform() < 0.4 ? 3 : 1) {
      const double t_s = frame * kFrame_s;
      const SE3 truth(so3_exp(Vec3(0, 1.8 * t_s, 0)),
                      Vec3(0.8 * std::sin(t_s), 0, 0.8 * (1 - std::cos(t_s))));
      const TrackedFrame tracked = odometry->track(frame_at(frame, truth, room));
      if (tracked.T_odom_camera) worst_m = std::max(worst_m, error_m(tracked, truth));
      lost += tracked.T_odom_camera ? 0 : 1;
    }
    EXPECT_EQ(lost, 0) << seed;
    EXPECT_LT(worst_m, 0.03) << seed;
  }
}

TEST(Tracker, TellsEachPoseOnceAndBeforeAKeyframeIsAdded) {
  const auto odometry = tracker();
  int keyframes = 0;
  for (int i = 0; i < 40; ++i) {
    const bool is_dark = i == 20 || i == 21;
    std::vector<SE3> told;
    std::size_t bytes_when_told = 0;
    const auto on_pose = [&](const SE3& T_odom_camera) {
      told.push_back(T_odom_camera);
      bytes_when_told = odometry->memory_bytes();
    };
    const TrackedFrame tracked =
        odometry->track(is_dark ? black_frame(i) : frame_at(i, path_pose(i * kFrame_s)), {}, on_pose);
    ASSERT_EQ(told.size(), tracked.T_odom_camera ? 1u : 0u) << i;
    ASSERT_EQ(tracked.T_odom_camera.has_value(), !is_dark) << i;
    if (is_dark) continue;
    EXPECT_EQ(told[0].matrix(), tracked.T_odom_camera->matrix()) << i;
    if (i == 0 || !tracked.new_keyframe) continue;
    EXPECT_LT(bytes_when_told, odometry->memory_bytes()) << i;
    keyframes += 1;
  }
  EXPECT_GT(keyframes, 1);
}

TEST(Tracker, IsDeterministic) {
  const auto a = tracker(), b = tracker();
  for (int i = 0; i < 40; ++i) {
    const RgbdFrame frame = i > 10 && i < 15 ? black_frame(i) : frame_at(i, path_pose(1.3 * i * kFrame_s));
    const TrackedFrame from_a = a->track(frame), from_b = b->track(frame);
    ASSERT_EQ(from_a.status, from_b.status);
    if (!from_a.T_odom_camera) continue;
    EXPECT_EQ(from_a.T_odom_camera->matrix(), from_b.T_odom_camera->matrix());
    EXPECT_EQ(from_a.covariance, from_b.covariance);
  }
}

TEST(Tracker, AGyroscopeBridgesAQuickTurn) {
  const SE3 before, after(so3_exp(Vec3(0, 0.55, 0.1)), Vec3(0.02, 0, 0));
  MotionHint hint;
  hint.R_last_current = (before.inverse() * after).rotation();
  const auto odometry = make_tracker({}, room_camera());
  odometry->track(frame_at(0, before));
  const TrackedFrame tracked = odometry->track(frame_at(1, after), hint);
  ASSERT_EQ(tracked.status, TrackingStatus::kTracked) << tracked.reason;
  EXPECT_LT(error_m(tracked, after), 0.005);
}

TEST(Tracker, GravityHoldsTheHorizon) {
  TexturedRoom room;
  Rng rng(5);
  const RoomNoise noise{true, 3.0, {}};
  double with = 0, without = 0;
  const auto plain = tracker(), upright = tracker();
  for (int i = 0; i < 60; ++i) {
    const SE3 truth = path_pose(i * kFrame_s);
    RgbdFrame frame =
        render_room(room, room_camera(), truth, Time::from_seconds(1 + i * kFrame_s), noise, &rng);
    const auto tilt = [&](const TrackedFrame& t) {
      const Vec3 down = (truth.inverse() * *t.T_odom_camera).rotation().transpose() *
                        (truth.rotation().transpose() * Vec3::UnitY());
      return down.cross(truth.rotation().transpose() * Vec3::UnitY()).squaredNorm();
    };
    MotionHint hint;
    hint.up_camera = truth.rotation().transpose() * -Vec3::UnitY();
    without += tilt(plain->track(frame));
    with += tilt(upright->track(frame, hint));
  }
  EXPECT_LT(with, without);
}

}  // namespace
}  // namespace hm
