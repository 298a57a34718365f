#include "hm/sim/vehicle/vehicle_contact.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sensors/imu.hpp"
#include "hm/sim/vehicle/vehicle_test_support.hpp"
#include "hm/sim/world/room_scene.hpp"

namespace hm {
namespace {

using namespace test;

/// Body with contact only, without the rest of a vehicle; an attitude loop keeps it level when rotors turn.
struct Body {
  explicit Body(CastRays surroundings) : contact(params(), Vec3::Zero(), std::move(surroundings)) {
    inputs.contact = [this](const QuadrotorState& s) { return contact.wrench(s); };
  }
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;
  static VehicleParams params() {
    VehicleParams calm;
    calm.make_perfect();
    calm.inner_loop.inner_loop = InnerLoopKind::kSecondOrder;
    return calm;
  }
  void run(double time_s) {
    for (int i = 0; i < std::lround(time_s * 1000); ++i, ++steps) {
      if (steps % 10 == 0) contact.look(state, Time{steps * 1'000'000});
      state = dynamics.advance(state, inputs, 1e-3);
      contact.settle(state);
    }
  }
  QuadrotorDynamics dynamics{params(), Vec3::Zero()};
  VehicleContact contact;
  QuadrotorInputs inputs;
  QuadrotorState state;
  std::int64_t steps = 0;
};

TEST(VehicleContact, RestsOnAFloorWithoutDrift) {
  VehicleSetup setup;  // with wind, gusts and an offset centre of mass; rotors idle at a third of the weight
  setup.T_world_base = SE3(so3_exp({0, 0, 0.4}), Vec3(1, 2, kBaseOverGround_m));
  Vehicle vehicle(setup, cast_into_floor());
  const VehicleCommand idle = rotors_at(583.5 / std::sqrt(3));
  for (int i = 0; i < 1000; ++i) (void)vehicle.step(idle);
  EXPECT_EQ(vehicle.feet_down(), 4);
  const SE3 settled = vehicle.state().T_world_base;
  for (int i = 0; i < 60'000; ++i) (void)vehicle.step(idle);
  const SE3 moved = settled.inverse() * vehicle.state().T_world_base;
  EXPECT_LT(moved.translation().norm(), 2e-4);  // the springs give way to the wind, and come back
  EXPECT_LT(moved.angle(), 2e-3);
  EXPECT_LT(vehicle.state().velocity_world_m_s.norm(), 0.01);
  EXPECT_TRUE(vehicle.collisions().empty());
}

TEST(VehicleContact, SinksIntoItsFeetByTheWeight) {
  Body body(cast_into_floor());
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, kBaseOverGround_m + 0.05)));
  body.run(3);
  const double sunk = kBaseOverGround_m - body.state.com_world_m.z();
  EXPECT_NEAR(sunk, 1.387 * kGravity_m_s2 / (4 * 2000), 1e-7);
  EXPECT_LT(body.state.com_velocity_world_m_s.norm(), 1e-9);
  EXPECT_LT(body.state.com_world_m.head<2>().norm(), 1e-9);
}

TEST(VehicleContact, TheSideThatARayHitsIsTheOutside) {
  const CastRays floor = cast_into_floor();
  Body body([floor](std::span<const Ray> rays, std::span<RayHit> hits) {
    floor(rays, hits);
    for (RayHit& hit : hits) hit.normal_world = -hit.normal_world;
  });
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, kBaseOverGround_m + 0.05)));
  body.run(2);
  EXPECT_NEAR(body.state.com_world_m.z(), kBaseOverGround_m, 0.002);
}

TEST(VehicleContact, LandsOnAChestOfTheRoom) {
  const World world = make_room();
  const Renderer renderer(world);
  for (const RoomPrimitive& chest : room_primitives()) {
    if (chest.name != "chest") continue;
    Body body(cast_into(renderer));
    const double top = chest.center.z() + chest.half_m.z();
    body.state = body.dynamics.at_rest(
        SE3(so3_exp({0, 0, 0.5}), Vec3(chest.center.x(), chest.center.y(), top + kBaseOverGround_m + 0.02)));
    body.run(2);
    const Vec3 settled = body.state.com_world_m;
    body.run(5);
    EXPECT_EQ(body.contact.feet_down(), 4);
    EXPECT_NEAR(settled.z(), top + kBaseOverGround_m, 0.002);
    EXPECT_LT((body.state.com_world_m - settled).norm(), 1e-6);
    EXPECT_TRUE(body.contact.collisions().empty());
    ASSERT_TRUE(body.contact.rotor_surfaces()[0].below);
    EXPECT_NEAR(body.contact.rotor_surfaces()[0].below->point_world.z(), top, 1e-6);
    return;
  }
  FAIL() << "the room has no chest";
}

TEST(VehicleContact, SlidingStopsByFriction) {
  Body body(cast_into_floor());
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, kBaseOverGround_m)));
  body.run(1);
  body.state.com_velocity_world_m_s.x() = 1;
  body.run(2);
  const double expected = 1 / (2 * 0.6 * kGravity_m_s2);  // v^2 / (2 mu g)
  EXPECT_NEAR(body.state.com_world_m.x(), expected, 0.1 * expected);
  EXPECT_LT(body.state.com_velocity_world_m_s.norm(), 1e-3);
}

TEST(VehicleContact, DoesNotDependOnTheHeading) {
  const auto landed = [](double yaw_rad) {
    Body body(cast_into_floor());
    const Mat3 heading = so3_exp({0, 0, yaw_rad});
    body.state = body.dynamics.at_rest(SE3(heading * so3_exp({0.2, -0.1, 0}), Vec3(0, 0, 0.3)));
    body.state.com_velocity_world_m_s = heading * Vec3(0.6, 0.3, -0.5);
    body.run(0.3);
    return Vec3(heading.transpose() * body.state.com_world_m);
  };
  EXPECT_LT((landed(2) - landed(0)).norm(), 1e-9);
}

TEST(VehicleContact, CountsOneCollisionWithAWall) {
  const SurfacePlane wall{Vec3(1.5, 0, 0), -Vec3::UnitX()};
  Body body(cast_into_planes({wall}));
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0.2, 1)));
  body.state.com_velocity_world_m_s = Vec3(1, 0, 0);
  body.state.rotor_speed_rad_s.setConstant(body.params().hover_speed_rad_s());
  body.inputs.rotor_command_rad_s = body.state.rotor_speed_rad_s;
  double furthest = 0;
  for (int i = 0; i < 200; ++i) {
    body.run(0.01);
    furthest = std::max(furthest, body.state.com_world_m.x());
  }
  ASSERT_EQ(body.contact.collisions().size(), 1U);
  const VehicleCollision& hit = body.contact.collisions().front();
  // v(t) = v0 exp(-t / T) by the rotors' drag with T = 7.4 s: 1.16 m take 1.27 s.
  EXPECT_NEAR(hit.stamp.seconds(), 1.27, 0.03);
  EXPECT_NEAR((hit.position_world - Vec3(1.5, 0.2, 1.03)).norm(), 0, 0.02);
  EXPECT_NEAR(hit.speed_m_s, std::exp(-1.27 / 7.4), 0.02);
  EXPECT_LT(furthest, 1.5 - 0.34 + 0.06);  // it does not go through
  EXPECT_LT(body.state.com_velocity_world_m_s.x(), 0);
}

TEST(VehicleContact, PassingBesideAWallIsNoCollision) {
  Body body(cast_into_planes({{Vec3(0, 0.36, 0), -Vec3::UnitY()}}));
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, 1)));
  body.state.com_velocity_world_m_s = Vec3(2, 0, 0);
  body.inputs.rotor_command_rad_s.setConstant(body.params().hover_speed_rad_s());
  body.state.rotor_speed_rad_s = body.inputs.rotor_command_rad_s;
  body.run(1);
  EXPECT_GT(body.state.com_world_m.x(), 1.5);
  EXPECT_TRUE(body.contact.collisions().empty());
}

TEST(VehicleContact, HardLandingIsACollisionAndASoftOneIsNot) {
  for (const double speed : {0.5, 1.5, 3.0, 12.0}) {
    Body body(cast_into_floor());
    body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(0, 0, kBaseOverGround_m + 0.01)));
    body.state.com_velocity_world_m_s.z() = -speed;
    body.run(1);
    EXPECT_EQ(body.contact.collisions().size(), speed > 2 ? 1U : 0U) << speed;
    EXPECT_NEAR(body.state.com_world_m.z(), kBaseOverGround_m, 1.5);  // not through the floor
    EXPECT_GT(body.state.com_world_m.z(), 0) << speed;
  }
}

TEST(VehicleContact, FootInTheSideOfAChestIsACollisionWithoutForce) {
  const World world = make_room();
  const Renderer renderer(world);
  Body body(cast_into(renderer));
  // Beside the chest (its top at 0.6 m, turned by 0.5 rad), two feet 9 cm below its top and 5 cm inside.
  const Vec3 along = so3_exp({0, 0, 0.5}).col(0);
  const Vec3 place = Vec3(1.9, 1.15, 0.705) - (0.5 + 0.1) * along;
  body.state = body.dynamics.at_rest(SE3(so3_exp({0, 0, 0.5}), place));
  body.run(0.1);
  ASSERT_EQ(body.contact.collisions().size(), 1U);
  EXPECT_EQ(body.contact.collisions()[0].stamp, Time{0});
  EXPECT_LT(body.state.angular_velocity_base_rad_s.norm(), 1e-6);
  EXPECT_NEAR(body.state.com_velocity_world_m_s.z(), -0.1 * kGravity_m_s2, 1e-3);
}

TEST(VehicleContact, CollidesWithTheWallOfTheRoom) {
  const World world = make_room();
  const Renderer renderer(world);
  const RoomPrimitive& shell = room_primitives().front();
  const double wall = shell.center.y() + shell.half_m.y();
  Body body(cast_into(renderer));
  body.state = body.dynamics.at_rest(SE3(Mat3::Identity(), Vec3(shell.center.x(), wall - 1, 1.8)));
  body.state.com_velocity_world_m_s = Vec3(0, 1, 0);
  body.inputs.rotor_command_rad_s.setConstant(body.params().hover_speed_rad_s());
  body.state.rotor_speed_rad_s = body.inputs.rotor_command_rad_s;
  body.run(1.2);
  ASSERT_EQ(body.contact.collisions().size(), 1U);
  EXPECT_NEAR(body.contact.collisions()[0].position_world.y(), wall, 0.02);
}

}  // namespace
}  // namespace hm
