#include "hm/odometry/registration/surface_following.hpp"

#include <gtest/gtest.h>

#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

const DepthNoise kRoomNoise;
const SE3 kCorner(so3_exp(Vec3(0.5, 0.6, 0)), Vec3(0.1, 0.2, -0.3));  // sees three walls

DepthGrid room_grid(const SE3& T_world_camera, const TexturedRoom& room = {}) {
  TexturedRoom blank = room;
  blank.contrast = 0;
  return make_depth_grid(render_room(blank, room_camera(), T_world_camera, {}).depth, room_camera(),
                         kRoomNoise, 10);
}

std::optional<SurfaceMotion> motion_between(const DepthGrid& reference, const DepthGrid& current,
                                            const SE3& guess) {
  const auto surface = sample_surface(reference, kRoomNoise, 2);
  return follow_surface(surface, current, guess, kRoomNoise);
}

/// Textureless walls and a motion as between two frames at 5 Hz: three planes constrain all six degrees of
/// freedom.
TEST(SurfaceFollowing, FindsALargeMotionWithoutAnyTexture) {
  const DepthGrid reference = room_grid(kCorner);
  for (int i = 0; i < 6; ++i) {
    const double sign = i % 2 ? -1 : 1;
    Vec6 twist = Vec6::Zero();
    twist[i / 2] = sign * 0.15;
    twist[3 + i / 2] = -sign * 0.12;
    const SE3 motion = SE3::exp(twist);
    const auto found = motion_between(reference, room_grid(kCorner * motion), {});
    ASSERT_TRUE(found) << i;
    EXPECT_TRUE(found->held);
    EXPECT_LT((found->T_ref_cur.translation() - motion.translation()).norm(), 0.004) << i;
    EXPECT_LT((found->T_ref_cur.inverse() * motion).angle(), 0.003) << i;
  }
}

/// Motion along a single wall is unconstrained: the guess is kept, whatever it is.
TEST(SurfaceFollowing, KeepsTheGuessWhereAWallLeavesTheCameraFree) {
  TexturedRoom wall;
  wall.half_size_m = Vec3(9, 9, 1.5);
  const DepthGrid reference = room_grid({}, wall);
  const DepthGrid current = room_grid(SE3(Mat3::Identity(), Vec3(0.05, 0, 0.08)), wall);
  const SE3 guess(Mat3::Identity(), Vec3(0.03, -0.02, 0));
  const auto found = motion_between(reference, current, guess);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->held);
  EXPECT_NEAR(found->T_ref_cur.translation().x(), 0.03, 1e-3);
  EXPECT_NEAR(found->T_ref_cur.translation().y(), -0.02, 1e-3);
  EXPECT_NEAR(found->T_ref_cur.translation().z(), 0.08, 0.004);
}

TEST(SurfaceFollowing, SaysNothingWithoutReadingsOrElsewhere) {
  const DepthGrid reference = room_grid(kCorner);
  DepthGrid none = reference;
  std::fill(none.depth_m.pixels().begin(), none.depth_m.pixels().end(), 0.0f);
  EXPECT_FALSE(motion_between(reference, none, {}));
  EXPECT_FALSE(motion_between(none, reference, {}));
  TexturedRoom hall;
  hall.half_size_m = Vec3(6, 5, 7);
  EXPECT_FALSE(motion_between(reference, room_grid(kCorner, hall), {}));
}

}  // namespace
}  // namespace hm
