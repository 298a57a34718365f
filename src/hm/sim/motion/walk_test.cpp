#include "hm/sim/motion/walk.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/world/house_plan.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {
namespace {

constexpr double kDegree_rad = M_PI / 180;

TEST(Walk, IsSmoothAndWithinHumanLimits) {
  for (const Walk& walk : {house_walk(), room_walk(), corridor_walk()}) {
    constexpr double kStep_s = 0.01;
    const auto velocity = [&](double t) {
      const WalkPoint a = walk.point_at(t), b = walk.point_at(t + kStep_s);
      return WalkPoint{(b.position - a.position) / kStep_s, (b.yaw_rad - a.yaw_rad) / kStep_s,
                       (b.pitch_rad - a.pitch_rad) / kStep_s};
    };
    WalkPoint before = velocity(0);
    EXPECT_LT(before.position.norm(), 0.05);  // starts at rest
    for (double t = kStep_s; t + kStep_s < walk.duration_s(); t += kStep_s) {
      const WalkPoint now = velocity(t);
      ASSERT_LT(now.position.norm(), 0.82) << t;
      ASSERT_LT(std::abs(now.yaw_rad), 60 * kDegree_rad) << t;
      ASSERT_LT(std::abs(now.pitch_rad), 60 * kDegree_rad) << t;
      // C1: velocities change by bounded accelerations, never in a jump.
      ASSERT_LT((now.position - before.position).norm(), 5 * kStep_s) << t;
      ASSERT_LT(std::abs(now.yaw_rad - before.yaw_rad), 6 * kStep_s) << t;
      ASSERT_LT(std::abs(now.pitch_rad - before.pitch_rad), 6 * kStep_s) << t;
      before = now;
    }
  }
}

TEST(Walk, ReturnsToWhereItStarted) {
  for (const Walk& walk : {house_walk(), room_walk(), corridor_walk()}) {
    const SE3 first = walk.T_world_camera(0), last = walk.T_world_camera(walk.duration_s());
    EXPECT_LT((first.inverse() * last).translation().norm(), 0.1);
    EXPECT_LT((first.inverse() * last).angle(), 0.02);
    EXPECT_TRUE(is_rigid(walk.T_world_camera(0.37 * walk.duration_s())));
  }
}

TEST(Walk, CameraLooksWhereYawAndPitchSay) {
  const Walk walk({{{0, 0, 1}, 0.5, 0.2}, {{1, 0, 1}, 0.5, 0.2}}, {});
  const SE3 pose = walk.T_world_camera(0.5);
  const Vec3 forward = pose.rotation().col(2);
  EXPECT_NEAR(std::atan2(forward.y(), forward.x()), 0.5, 1e-12);
  EXPECT_NEAR(std::asin(forward.z()), 0.2, 1e-12);
  EXPECT_NEAR(pose.rotation().col(0).z(), 0, 1e-12);  // level
  EXPECT_LT(pose.rotation().col(1).z(), 0);           // y down
}

TEST(Walk, HouseWalkKeepsClearOfEverythingAtAnyHeight) {
  const World house = make_house(1);
  const Renderer renderer(house);
  const Walk walk = house_walk();
  Vec3 before = walk.point_at(0).position;
  for (double t = 0.1; t < walk.duration_s(); t += 0.1) {
    const Vec3 p = walk.point_at(t).position;
    ASSERT_GE(p.z(), 1.4);
    ASSERT_LE(p.z(), 1.6);
    for (const double height : {0.5, 1.0, p.z()})
      ASSERT_GT(renderer.clearance_m({p.x(), p.y(), height}, 0.5), 0.2) << p.transpose() << " t = " << t;
    ASSERT_TRUE(renderer.is_free(before, p, 0.0)) << t;
    before = p;
  }
}

TEST(Walk, HouseWalkEntersEveryRoomAndHasTheLengthOfATour) {
  const Walk walk = house_walk();
  EXPECT_GT(walk.length_m(), 150);
  EXPECT_LT(walk.length_m(), 300);
  EXPECT_GT(walk.duration_s() * 5, 1200);
  EXPECT_LT(walk.duration_s() * 5, 2600);
  for (const RoomPlan& room : house_rooms()) {
    double turned = 0, inside_s = 0;
    for (double t = 0.1; t < walk.duration_s(); t += 0.1) {
      const WalkPoint p = walk.point_at(t);
      const Vec2 at = p.position.head<2>();
      if (at.x() < room.x0 || at.x() > room.x1 || at.y() < room.y0 || at.y() > room.y1) continue;
      inside_s += 0.1;
      turned += std::abs(p.yaw_rad - walk.point_at(t - 0.1).yaw_rad);
    }
    EXPECT_GT(inside_s, 20) << room.name;
    EXPECT_GT(turned, 4 * M_PI) << room.name;
  }
}

TEST(Walk, RoomWalkStaysInFreeSpace) {
  const World room = make_room();
  const Renderer renderer(room);
  const Walk walk = room_walk();
  for (double t = 0; t < walk.duration_s(); t += 0.1)
    ASSERT_GT(renderer.clearance_m(walk.point_at(t).position, 0.5), 0.25) << t;
}

}  // namespace
}  // namespace hm
