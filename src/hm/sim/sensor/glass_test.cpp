#include "hm/sim/sensor/glass.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sim/world/solids.hpp"

namespace hm {
namespace {

constexpr Rgb8 kRed{200, 20, 20}, kGreen{20, 200, 20}, kPane{180, 210, 240};

/// A pane at x = 2 m from y = 0 to the left, a red wall at 3 m behind it where y < 2, a green wall at x = -2.
World pane_before_a_wall() {
  World world{"pane", {}};
  const auto add = [&](const char* name, Rgb8 color, bool clear, const Vec3& low, const Vec3& high) {
    const Reflectance reflectance = clear ? Reflectance::kNoReturn : Reflectance::kNormal;
    world.parts.push_back({Material{name, Pattern::kPlain, color, color, 0.3f, reflectance, clear}, {}});
    append_box(world.parts.back().mesh, low, high);
  };
  add("pane", kPane, true, {2, 0, -3}, {2.01, 20, 3});
  add("red", kRed, false, {3, -9, -9}, {3.1, 2, 9});
  add("green", kGreen, false, {-2.1, -40, -9}, {-2, 40, 9});
  return world;
}

TEST(Glass, IsMeasuredThroughFrontallyAndReflectsAtGrazingAngles) {
  const World world = pane_before_a_wall();
  const Renderer renderer(world);
  const PinholeCamera camera{320, 40, 160, 160, 159.5, 19.5, {}};
  Mat3 forward;  // along x, y to the left
  forward << Vec3(0, -1, 0), Vec3(0, 0, -1), Vec3(1, 0, 0);
  const std::vector<SE3> poses(40, SE3(forward, Vec3(0, 0.5, 0)));
  const RenderedView before = renderer.render(camera, poses, ParallelLoop());
  RenderedView view = before;
  look_through_glass(world, renderer, camera, poses, 0.4, view);
  const auto column_of = [&](double y_m) {  // on the pane
    return static_cast<int>(std::lround(camera.cx + camera.fx * (0.5 - y_m) / 2));
  };
  EXPECT_NEAR(before.depth_m(column_of(0.7), 20), 2, 1e-4);
  EXPECT_NEAR(view.depth_m(column_of(0.7), 20), 3, 1e-4);  // the wall behind it
  EXPECT_EQ(view.part(column_of(0.7), 20), 1);
  EXPECT_NEAR(view.cos_incidence(column_of(0.7), 20), before.cos_incidence(column_of(0.7), 20), 1e-4);
  EXPECT_GT(view.color(column_of(0.7), 20).r, view.color(column_of(0.7), 20).g + 50);
  const int grazing = column_of(1.45);  // 25 degrees: the pane gives no reading, but the wall shows through
  EXPECT_EQ(view.depth_m(grazing, 20), before.depth_m(grazing, 20));
  EXPECT_EQ(view.returns[view.part(grazing, 20)], Reflectance::kNoReturn);
  EXPECT_GT(view.color(grazing, 20).r, view.color(grazing, 20).g + 50);
  const int beside = column_of(-0.3);  // no pane there
  EXPECT_EQ(view.color(beside, 20), before.color(beside, 20));
  EXPECT_EQ(view.depth_m(beside, 20), before.depth_m(beside, 20));
}

TEST(Glass, ReflectsMoreAtGrazingAnglesAndKeepsItsColourBeforeNothing) {
  const World world = pane_before_a_wall();
  const Renderer renderer(world);
  const PinholeCamera camera{320, 40, 160, 160, 159.5, 19.5, {}};
  const double yaw = 1.2;  // along the pane, past the red wall
  Mat3 rotation;
  rotation << Vec3(std::sin(yaw), -std::cos(yaw), 0), Vec3(0, 0, -1), Vec3(std::cos(yaw), std::sin(yaw), 0);
  const std::vector<SE3> poses(40, SE3(rotation, Vec3(1, 2, 0)));
  const RenderedView before = renderer.render(camera, poses, ParallelLoop());
  RenderedView view = before;
  look_through_glass(world, renderer, camera, poses, 0.4, view);
  // How much less blue than the pane: the green wall is not blue.
  const auto reflected = [&](float least_cosine, float most_cosine) {
    double sum = 0;
    int count = 0;
    for (int x = 0; x < camera.width; ++x) {
      const float cosine = before.cos_incidence(x, 20);
      if (before.part(x, 20) != 0 || cosine < least_cosine || cosine > most_cosine) continue;
      EXPECT_EQ(view.depth_m(x, 20), before.depth_m(x, 20));
      sum += int{before.color(x, 20).b} - int{view.color(x, 20).b}, ++count;
    }
    EXPECT_GT(count, 10);
    return sum / count;
  };
  const double frontal = reflected(0.5f, 0.7f), grazing = reflected(0.15f, 0.3f);
  EXPECT_GT(frontal, 5);
  EXPECT_GT(grazing, 2 * frontal);
}

}  // namespace
}  // namespace hm
