#include "hm/sim/recording/moving_people.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hm {
namespace {

/// A room without people, and a camera.
struct SeenRoom {
  World world = make_room();
  Renderer renderer{world};
  PinholeCamera camera{160, 120, 130, 130, 79.5, 59.5, {}};
};

TEST(MovingPeople, WalkOnTheFloorAheadOfTheCamera) {
  const Walk walk = house_walk();
  const MovingPeople people(walk, 3, 7);
  ASSERT_EQ(people.count(), 3u);
  for (std::size_t i = 0; i < people.count(); ++i) {
    int near = 0, moments = 0;
    for (double t = 0; t < walk.duration_s(); t += 0.1, ++moments) {
      const Vec3 p = people.T_world_person(i, t).translation();
      const Vec3 apart = p - walk.T_world_camera(t).translation();
      ASSERT_EQ(p.z(), 0);
      ASSERT_LT((people.T_world_person(i, t + 0.1).translation() - p).norm(), 0.15);  // no jumps
      near += apart.head<2>().norm() < 5;
    }
    EXPECT_GT(near, moments / 2);
  }
}

TEST(MovingPeople, AreNotWhereTheCameraIs) {
  const Walk walk = room_walk();
  const SeenRoom room;
  const PinholeCamera& camera = room.camera;
  const MovingPeople people(walk, 1, 3);
  const std::vector<SE3> poses(120, people.T_world_person(0, 5) * SE3(Mat3::Identity(), Vec3(0.3, 0, 0)));
  RenderedView view = room.renderer.render(camera, poses, ParallelLoop());
  const RenderedView before = view;
  people.draw(camera, poses, 5, view);
  EXPECT_TRUE(std::ranges::equal(view.part.pixels(), before.part.pixels()));
}

TEST(MovingPeople, AreDrawnWhereTheyStand) {
  const Walk walk = room_walk();
  const SeenRoom room;
  const PinholeCamera& camera = room.camera;
  const MovingPeople people(walk, 1, 3);
  // A camera behind and above a person, which looks forward and down at it.
  const double t = 5;
  const SE3 person = people.T_world_person(0, t);
  Mat3 rotation;
  rotation << Vec3(0, -1, 0), Vec3(-0.6, 0, -0.8), Vec3(0.8, 0, -0.6);
  const std::vector<SE3> poses(120, person * SE3(rotation, Vec3(-1.2, 0, 1.5)));
  const RenderedView before = room.renderer.render(camera, poses, ParallelLoop());
  RenderedView view = before;
  people.draw(camera, poses, t, view);
  int drawn = 0;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      ASSERT_LE(view.depth_m(x, y), before.depth_m(x, y));
      if (view.part(x, y) == before.part(x, y)) continue;
      ++drawn;
      ASSERT_EQ(view.returns.at(view.part(x, y)), Reflectance::kNormal);
      const double z = static_cast<double>(view.depth_m(x, y));
      const Vec3 p = person.inverse() * poses[0] *
                     Vec3((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
      ASSERT_LT(p.head<2>().norm(), 0.4);
      ASSERT_GT(p.z(), -1e-3);
      ASSERT_LT(p.z(), 1.95);
    }
  EXPECT_GT(drawn, 1000);
  EXPECT_LT(drawn, 160 * 120 / 2);
}

TEST(MovingPeople, StandBehindWhatIsNearer) {
  const Walk walk = room_walk();
  const SeenRoom room;
  const PinholeCamera& camera = room.camera;
  const MovingPeople people(walk, 2, 3);
  // From below the floor, which hides them.
  Mat3 up = Mat3::Identity();
  const std::vector<SE3> poses(120, SE3(up, people.T_world_person(0, 1).translation() + Vec3(1, 0, -2)));
  RenderedView view = room.renderer.render(camera, poses, ParallelLoop());
  const RenderedView before = view;
  people.draw(camera, poses, 1, view);
  EXPECT_TRUE(std::ranges::equal(view.depth_m.pixels(), before.depth_m.pixels()));
}

}  // namespace
}  // namespace hm
