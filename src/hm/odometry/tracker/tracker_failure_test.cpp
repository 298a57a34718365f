#include <gmock/gmock.h>

#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {
namespace {

constexpr double kFailureFrame_s = 1.0 / 30;
constexpr int kBefore = 20, kFailed = 3;

RgbdFrame room_frame_at(int index, const SE3& T_world_camera, const TexturedRoom& room = {}) {
  RgbdFrame frame =
      render_room(room, room_camera(), T_world_camera, Time::from_seconds(1 + index * kFailureFrame_s));
  frame.index = static_cast<std::size_t>(index);
  return frame;
}

/// Frames that cannot be registered, each for another reason.
enum class Failure { kDark, kTextureless, kNoReadingAndDark, kSingleDepth, kAnotherRoom };

RgbdFrame failing_frame(Failure failure, int index) {
  TexturedRoom room;
  if (failure == Failure::kDark || failure == Failure::kNoReadingAndDark) room.brightness = 0;
  if (failure == Failure::kTextureless || failure == Failure::kSingleDepth) room.contrast = 0;
  if (failure == Failure::kAnotherRoom) room.seed = 77;
  // From another position, so that surfaces alone do not fit either.
  const SE3 T(so3_exp(Vec3(0.3, 2.0, 0)), Vec3(-0.9, 0.4, 0.5));
  RgbdFrame frame = room_frame_at(index, T, room);
  if (failure == Failure::kNoReadingAndDark || failure == Failure::kSingleDepth) {
    const std::uint16_t units = failure == Failure::kSingleDepth ? 2000 : 0;
    std::fill(frame.depth.units.pixels().begin(), frame.depth.units.pixels().end(), units);
  }
  return frame;
}

/// Tracker results after failing frames in the middle of a walk.
std::vector<TrackedFrame> track_past(Failure failure) {
  const auto odometry = make_tracker({}, room_camera(), path_pose(0));
  TrackedFrame last;
  for (int i = 0; i < kBefore; ++i) last = odometry->track(room_frame_at(i, path_pose(i * kFailureFrame_s)));
  EXPECT_TRUE(last.T_odom_camera) << last.reason;
  const std::size_t points = last.numbers.model_points, bytes = odometry->memory_bytes();
  for (int i = kBefore; i < kBefore + kFailed; ++i) {
    const TrackedFrame tracked = odometry->track(failing_frame(failure, i));
    EXPECT_EQ(tracked.status, TrackingStatus::kLost) << i;
    EXPECT_FALSE(tracked.T_odom_camera);
    EXPECT_FALSE(tracked.reason.empty());
    EXPECT_EQ(tracked.new_keyframe, nullptr);
    EXPECT_EQ(tracked.numbers.model_points, points);
    EXPECT_EQ(odometry->memory_bytes(), bytes);
  }
  std::vector<TrackedFrame> after;
  for (int i = kBefore + kFailed; i < kBefore + kFailed + 8; ++i)
    after.push_back(odometry->track(room_frame_at(i, path_pose((i - kFailed) * kFailureFrame_s))));
  return after;
}

/// A failed registration leaves the model unchanged: for any kind of frames that could not be registered, all
/// later poses and covariances are bit-identical.
TEST(Tracker, FailedFramesLeaveNoTrace) {
  const std::vector<TrackedFrame> expected = track_past(Failure::kDark);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double t = (kBefore + static_cast<double>(i)) * kFailureFrame_s;
    ASSERT_TRUE(expected[i].T_odom_camera) << i << " " << expected[i].reason;
    EXPECT_LT((expected[i].T_odom_camera->translation() - path_pose(t).translation()).norm(), 0.005) << i;
    EXPECT_EQ(expected[i].submap, 0);
  }
  for (const Failure failure :
       {Failure::kTextureless, Failure::kNoReadingAndDark, Failure::kSingleDepth, Failure::kAnotherRoom}) {
    SCOPED_TRACE(static_cast<int>(failure));
    const std::vector<TrackedFrame> after = track_past(failure);
    for (std::size_t i = 0; i < after.size(); ++i) {
      ASSERT_EQ(after[i].status, expected[i].status) << i << " " << after[i].reason;
      EXPECT_EQ(after[i].T_odom_camera->matrix(), expected[i].T_odom_camera->matrix()) << i;
      EXPECT_EQ(after[i].covariance, expected[i].covariance) << i;
      EXPECT_EQ(after[i].numbers.model_points, expected[i].numbers.model_points) << i;
    }
  }
}

}  // namespace
}  // namespace hm
