#include "hm/evaluation/depth_agreement.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

/// A wall across the optical axis of a camera at the origin, at `z` metres, from x_min on.
TriangleMesh wall(float z, float x_min) {
  TriangleMesh mesh;
  mesh.vertices = {{x_min, -9, z}, {9, -9, z}, {9, 9, z}, {x_min, 9, z}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

PinholeCamera camera() { return {64, 48, 60, 60, 31.5, 23.5, {}}; }

TEST(DepthCaster, WallIsAtItsDepthInEveryPixel) {
  const auto caster = DepthCaster::build(wall(2, -9));
  ASSERT_TRUE(caster.has_value());
  for (PinholeCamera c : {camera(), PinholeCamera{64, 48, 60, -60, 31.5, 23.5, {}},
                          PinholeCamera{64, 48, 60, 60, 31.5, 23.5, {0.1, -0.05, 0.001, 0.001, 0}}}) {
    const Image<float> depth = caster->render(c, SE3(), ParallelLoop(2));
    for (const float d : depth.pixels()) ASSERT_NEAR(d, 2.F, 1e-5F);
  }
}

TEST(DepthCaster, SlantedViewInClosedForm) {
  const auto caster = DepthCaster::build(wall(2, -9));
  ASSERT_TRUE(caster.has_value());
  const SE3 T_world_camera(so3_exp(Vec3(0.1, 0.3, 0.2)), Vec3(0.2, 0.1, 0.5));
  const Image<float> depth = caster->render(camera(), T_world_camera, ParallelLoop());
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const Vec3 ray = T_world_camera.rotation() * camera().unproject(Vec2(x, y), 1);
      ASSERT_NEAR(static_cast<double>(depth(x, y)), 1.5 / ray.z(), 1e-5);
    }
  EXPECT_FALSE(DepthCaster::build({}).has_value());
}

TEST(DepthAgreement, CountsCoversAndDifferences) {
  // The mesh covers the right half; readings are 1 cm behind it, some missing, some out of range.
  const auto caster = DepthCaster::build(wall(2, 0));
  ASSERT_TRUE(caster.has_value());
  const Image<float> rendered = caster->render(camera(), SE3(), ParallelLoop());
  Image<float> measured(64, 48, 2.01F);
  for (int x = 0; x < 64; ++x) {
    measured(x, 0) = 0;
    measured(x, 1) = std::nanf("");
    measured(x, 2) = 9;
  }
  DepthAgreement agreement(0.4, 4);
  EXPECT_EQ(agreement.covered_ratio(), 0);
  const auto frame = agreement.add(measured.pixels(), rendered.pixels());
  EXPECT_EQ(frame.valid, 45u * 64u);
  EXPECT_EQ(frame.covered, 45u * 32u);
  EXPECT_NEAR(frame.median_mm, 10, 1e-3);
  EXPECT_NEAR(frame.mean_mm, 10, 1e-3);
  // A second frame that agrees exactly.
  Image<float> exact(64, 48, 2.F);
  EXPECT_NEAR(agreement.add(exact.pixels(), rendered.pixels()).mean_mm, 0, 1e-2);
  const auto total = agreement.total();
  EXPECT_EQ(agreement.frames(), 2u);
  EXPECT_EQ(total.valid, 93u * 64u);
  EXPECT_NEAR(total.mean_mm, 10.0 * 45 / 93, 1e-2);
  EXPECT_NEAR(total.median_mm, 0, 1e-2);
  EXPECT_NEAR(agreement.covered_ratio(), 0.5, 1e-12);
}

}  // namespace
}  // namespace hm
