#include "hm/sim/world/height_course.hpp"

#include <gtest/gtest.h>

#include <array>

#include "hm/sim/sensor/renderer.hpp"

namespace hm {
namespace {

TEST(HeightCourse, LevelIsWhatARayFromAboveMeets) {
  const World world = make_height_course();
  const Renderer renderer(world);
  std::size_t raised = 0;
  for (double x_m = -0.95; x_m < 9.95; x_m += 0.0371)
    for (const double y_m : {-1.2, -0.65, 0.0, 0.65, 1.2}) {
      const std::array rays{Ray{Vec3(x_m, y_m, 1.5), -Vec3::UnitZ()}};
      std::array<RayHit, 1> hits;
      renderer.cast(rays, hits);
      const double level_m = height_course_level_m(x_m, y_m);
      raised += level_m > 0;
      EXPECT_NEAR(1.5 - hits[0].range_m, level_m, 1e-5) << x_m << ' ' << y_m;
    }
  EXPECT_GT(raised, 100U);
}

}  // namespace
}  // namespace hm
