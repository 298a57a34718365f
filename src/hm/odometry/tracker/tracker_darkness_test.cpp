#include <gmock/gmock.h>

#include "hm/geometry/state_bytes.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/tracker.hpp"

namespace hm {
namespace {

constexpr double kDarkPeriod_s = 1.0 / 30;
constexpr double kNoise = 220;  // grey values
enum class Picture { kSeen, kMissing, kBlack, kNoisy, kOfAnotherRoom };

/// A room off whose centre the walk sees its corners; depth has the noise of a Kinect.
RgbdFrame frame_of_walk(int index, Picture picture) {
  TexturedRoom room;
  if (picture == Picture::kBlack) room.brightness = 0;
  if (picture == Picture::kOfAnotherRoom) room.seed = 77;
  Rng rng(static_cast<std::uint64_t>(index) + 1);
  const SE3 T = SE3(so3_exp(Vec3(0, 0.75, 0)) * so3_exp(Vec3(-0.3, 0, 0)), Vec3::Zero()) *
                path_pose(index * kDarkPeriod_s);
  RgbdFrame frame = render_room(room, room_camera(), T, Time::from_seconds(1 + index * kDarkPeriod_s),
                                {true, picture == Picture::kNoisy ? kNoise : 0, DepthNoise{}}, &rng);
  frame.index = static_cast<std::size_t>(index);
  if (picture == Picture::kMissing) frame.color = {};
  return frame;
}

double error_of_walk_m(const TrackedFrame& tracked, const RgbdFrame& frame, const SE3& T_world_odom) {
  if (!tracked.T_odom_camera) return 1e9;
  return ((T_world_odom * *tracked.T_odom_camera).translation() - frame.T_world_camera->translation()).norm();
}

struct Walk {
  std::vector<TrackedFrame> frames;
  std::vector<double> errors_m;
};

/// A walk with colour that is not there from frame `first` to before `end`.
Walk walk_in_the_dark(int frames, int first, int end, Picture dark) {
  const auto odometry = make_tracker({}, room_camera());
  Walk walk;
  SE3 T_world_odom;
  for (int i = 0; i < frames; ++i) {
    const RgbdFrame frame = frame_of_walk(i, i >= first && i < end ? dark : Picture::kSeen);
    if (i == 0) T_world_odom = *frame.T_world_camera;
    walk.frames.push_back(odometry->track(frame));
    walk.errors_m.push_back(error_of_walk_m(walk.frames.back(), frame, T_world_odom));
  }
  return walk;
}

/// The first frame with known landmarks is a keyframe that says where the darkness led to, and by which
/// earlier keyframe it was found.
void expect_end_of_drift(const TrackedFrame& tracked, const Walk& walk, int dark_first, int dark_end) {
  ASSERT_NE(tracked.new_keyframe, nullptr);
  ASSERT_TRUE(tracked.new_keyframe->end_of_drift);
  const EndOfDrift& end = *tracked.new_keyframe->end_of_drift;
  EXPECT_LT(end.known_frame, static_cast<std::size_t>(dark_first));
  const auto& known = walk.frames[end.known_frame].new_keyframe;
  ASSERT_NE(known, nullptr);
  const SE3& T_odom_camera = tracked.new_keyframe->T_odom_camera;
  EXPECT_LT(((known->T_odom_camera * end.T_known_camera).translation() - T_odom_camera.translation()).norm(),
            0.005);
  // It goes on from the last dark frame.
  const SE3& T_odom_before = *walk.frames[static_cast<std::size_t>(dark_end) - 1].T_odom_camera;
  EXPECT_LT((T_odom_before.translation() - end.T_odom_arrived.translation()).norm(), 0.03);
  EXPECT_FALSE(end.arrived_covariance.isZero(0));
}

class TrackerInTheDark : public testing::TestWithParam<Picture> {};

TEST_P(TrackerInTheDark, FollowsTheSurfacesAndFindsItsLandmarksAgain) {
  constexpr int kDarkFirst = 20, kDarkEnd = 110, kWalkFrames = 130;
  const Walk walk = walk_in_the_dark(kWalkFrames, kDarkFirst, kDarkEnd, GetParam());
  int keyframes = 0;
  for (int i = 0; i < kWalkFrames; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const TrackedFrame& tracked = walk.frames[at];
    EXPECT_EQ(tracked.status, i == 0 ? TrackingStatus::kStarted : TrackingStatus::kTracked)
        << i << " " << tracked.reason;
    EXPECT_EQ(tracked.numbers.by_depth, i >= kDarkFirst && i < kDarkEnd) << i;
    EXPECT_EQ(tracked.submap, 0);
    EXPECT_LT(walk.errors_m[at], 0.025) << i;
    const double sigma_m = std::sqrt(tracked.covariance.topLeftCorner<3, 3>().trace());
    EXPECT_LT(walk.errors_m[at], 5 * sigma_m + 0.003) << i;
    if (i == kDarkEnd) expect_end_of_drift(tracked, walk, kDarkFirst, kDarkEnd);
    if (!tracked.numbers.by_depth || !tracked.new_keyframe) continue;
    ++keyframes;
    EXPECT_TRUE(tracked.new_keyframe->features.empty());
    EXPECT_EQ(tracked.new_keyframe->frame_index, at);
    EXPECT_FALSE(tracked.new_keyframe->motion_covariance.isZero(0));
  }
  EXPECT_GE(keyframes, 1);
  EXPECT_LT(walk.errors_m.back(), 0.01);
}

INSTANTIATE_TEST_SUITE_P(WithoutColour, TrackerInTheDark,
                         testing::Values(Picture::kMissing, Picture::kBlack));

/// Of a picture in which no landmark can be found, depth and what the picture shows at a coarse scale give
/// the pose; pictures of another room with the same walls do not, also where one follows such a picture.
TEST(Tracker, FollowsThroughAPictureThatShowsCoarseThingsOnly) {
  constexpr int kNoisyFrame = 15, kOtherFirst = 18, kOtherEnd = 20;
  for (const bool other_follows_at_once : {false, true}) {
    const auto odometry = make_tracker({}, room_camera());
    const SE3 T_world_odom = *frame_of_walk(0, Picture::kSeen).T_world_camera;
    for (int i = 0; i < 25; ++i) {
      const bool is_noisy = i == kNoisyFrame;
      const bool is_other = i < kOtherEnd && i >= (other_follows_at_once ? kNoisyFrame + 1 : kOtherFirst);
      const RgbdFrame frame = frame_of_walk(i, is_noisy   ? Picture::kNoisy
                                               : is_other ? Picture::kOfAnotherRoom
                                                          : Picture::kSeen);
      const TrackedFrame tracked = odometry->track(frame);
      EXPECT_EQ(tracked.numbers.by_depth, is_noisy) << i << " " << tracked.reason;
      if (is_other)
        EXPECT_EQ(tracked.status, TrackingStatus::kLost) << i;
      else
        EXPECT_LT(error_of_walk_m(tracked, frame, T_world_odom), 0.03) << i;
    }
  }
}

/// Surfaces alone leave the way along the wall free.
TEST(Tracker, FollowsFaintTextureUnderNoiseAlongAWall) {
  constexpr int kFrames = 60;
  TexturedRoom room;
  room.half_size_m = {8, 6, 1.8};
  room.contrast = 0.2;
  const auto odometry = make_tracker({}, room_camera());
  for (int i = 0; i < kFrames; ++i) {
    Rng rng(static_cast<std::uint64_t>(i) + 1);
    const SE3 T(Mat3::Identity(), Vec3(0.01 * i, 0.1 * std::sin(0.1 * i), 0));
    RgbdFrame frame = render_room(room, room_camera(), T, Time::from_seconds(1 + i * kDarkPeriod_s),
                                  {true, 8, DepthNoise{}}, &rng);
    frame.index = static_cast<std::size_t>(i);
    const TrackedFrame tracked = odometry->track(frame);
    EXPECT_FALSE(tracked.numbers.by_depth) << i;
    EXPECT_LT(error_of_walk_m(tracked, frame, {}), 0.006) << i;
  }
}

/// Without any colour the trajectory begins with the first depth image; the first picture does not begin
/// another.
TEST(Tracker, BeginsWithoutColour) {
  const Walk walk = walk_in_the_dark(60, 0, 40, Picture::kMissing);
  for (std::size_t i = 0; i < walk.frames.size(); ++i) {
    EXPECT_TRUE(walk.frames[i].T_odom_camera) << i << " " << walk.frames[i].reason;
    EXPECT_LT(walk.errors_m[i], 0.02) << i;
    EXPECT_EQ(walk.frames[i].submap, 0);
    EXPECT_EQ(walk.frames[i].numbers.by_depth, i <= 40)
        << i;  // with the first picture come the first landmarks
  }
  EXPECT_EQ(walk.frames[0].status, TrackingStatus::kStarted);
  EXPECT_GT(walk.frames.back().numbers.inliers, 15);
}

/// A state that was saved in the dark continues to the bit.
TEST(Tracker, ContinuesInTheDark) {
  constexpr int kDarkFirst = 12, kSavedFrame = 40, kDarkEnd = 60, kWalkFrames = 70;
  const auto picture_at = [](int i) {
    return i >= kDarkFirst && i < kDarkEnd ? Picture::kMissing : Picture::kSeen;
  };
  const auto whole = make_tracker({}, room_camera());
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  for (int i = 0; i < kSavedFrame; ++i)
    if (const auto made = whole->track(frame_of_walk(i, picture_at(i))).new_keyframe)
      keyframes.push_back(made);
  StateWriter saved;
  ASSERT_TRUE(whole->save(saved));
  StateReader reader(saved.bytes());
  const auto restored = make_tracker({}, room_camera());
  const auto read_frame = [&](std::size_t index) -> Result<RgbdFrame> {
    const int i = static_cast<int>(index);
    return frame_of_walk(i, picture_at(i));
  };
  const auto done = restored->restore(reader, {read_frame, keyframes});
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(reader.remaining(), 0u);
  for (int i = kSavedFrame; i < kWalkFrames; ++i) {
    const RgbdFrame frame = frame_of_walk(i, picture_at(i));
    const TrackedFrame expected = whole->track(frame), found = restored->track(frame);
    ASSERT_TRUE(expected.T_odom_camera && found.T_odom_camera) << i;
    EXPECT_EQ(expected.T_odom_camera->matrix(), found.T_odom_camera->matrix()) << i;
    EXPECT_EQ(expected.covariance, found.covariance) << i;
  }
}

}  // namespace
}  // namespace hm
