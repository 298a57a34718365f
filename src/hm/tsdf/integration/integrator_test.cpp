#include "hm/tsdf/integration/integrator.hpp"

#include <gmock/gmock.h>

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "hm/core/statistics.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/tsdf/testing/grid_compare.hpp"
#include "hm/tsdf/testing/integration_bench.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

TEST(Integrator, APlaneSeenStraightOnHasItsExactDistance) {
  IntegrationBench bench({});
  for (int i = 0; i < 3; ++i) bench.add(kWall, looking_along_x(Vec3::Zero()));
  std::size_t known = 0;
  for (const VolumeKey key : bench.grid.sorted_keys())
    for (int i = 0; i < kVolumeVoxels; ++i) {
      const TsdfVoxel voxel = bench.grid.find(key)->voxels[i];
      if (voxel.weight() == 0) continue;
      const double x = (8 * key.x + (i & 7) + 0.5) * 0.02;
      // Updated up to the end of the truncation band, and in front of it within the volumes that hold voxels
      // of the band; distances are clamped to two voxels.
      const double tau = bench.params.truncation_m({}, 2.0);
      EXPECT_NEAR(voxel.sdf() * bench.grid.sdf_unit_m(), std::clamp(2.0 - x, -0.04, 0.04), 1e-4);
      EXPECT_LE(x - 2.0, tau + 1e-4);
      EXPECT_GE(x, 0.16 * std::floor((2.0 - tau) / 0.16));
      EXPECT_EQ(voxel.weight(), 3 * kWeightOne);
      ++known;
    }
  EXPECT_GT(known, 10000u);
}

TEST(Integrator, ABallFromAllSidesIsWithinAMillimetre) {
  const AnalyticScene ball{{}, {{Vec3(0, 0, 0), 0.5}}};
  TsdfParams params;
  params.voxel_size_m = 0.01;
  IntegrationBench bench(params);
  for (int i = 0; i < 100; ++i) {
    const double turn = 2.399963 * i, height = -0.95 + 1.9 * i / 99;  // a spiral of directions
    const Vec3 from(std::cos(turn) * std::sqrt(1 - height * height),
                    std::sin(turn) * std::sqrt(1 - height * height), height);
    const Vec3 z = -from, x = Vec3(0, 0, 1).cross(z).normalized(), y = z.cross(x);
    Mat3 rotation;
    rotation << x, y, z;
    bench.add(ball, SE3(rotation, 1.5 * from));
  }
  Rng rng(2);
  std::vector<double> errors;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 direction = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
    // The zero crossing along the normal, by bisection of the trilinear field.
    double inner = 0.49, outer = 0.51;
    const auto at_inner = bench.grid.sample(inner * direction),
               at_outer = bench.grid.sample(outer * direction);
    ASSERT_TRUE(at_inner && at_outer) << direction.transpose();
    ASSERT_LT(at_inner->distance_m, 0);
    ASSERT_GT(at_outer->distance_m, 0);
    for (int step = 0; step < 30; ++step) {
      const double middle = 0.5 * (inner + outer);
      (bench.grid.sample(middle * direction)->distance_m < 0 ? inner : outer) = middle;
    }
    errors.push_back(inner - 0.5);
    EXPECT_GT(bench.grid.sample(0.5 * direction)->gradient.normalized().dot(direction), 0.97);
  }
  EXPECT_LT(summarise(errors).rmse, 1e-3);
  EXPECT_LT(std::abs(summarise(errors).mean), 5e-4);
}

TEST(Integrator, TheOrderOfScansDoesNotMatter) {
  Rng rng(12);
  const AnalyticScene scene = random_scene(rng);
  std::vector<RgbdFrame> frames;
  for (int i = 0; i < 12; ++i)
    frames.push_back(scene.render(kCamera, looking_along_x(Vec3(0, 0.02 * i, 0.01 * i))));
  TsdfParams params;
  params.carving = false;  // carving depends on the current contents, so on the order, by design
  IntegrationBench forward(params), backward(params);
  for (const auto& frame : frames) forward.integrator.integrate(forward.grid, frame);
  std::reverse(frames.begin(), frames.end());
  for (const auto& frame : frames) backward.integrator.integrate(backward.grid, frame);
  ASSERT_EQ(forward.grid.sorted_keys(), backward.grid.sorted_keys());
  int largest = 0;
  for (const VolumeKey key : forward.grid.sorted_keys())
    for (int i = 0; i < kVolumeVoxels; ++i) {
      const TsdfVoxel a = forward.grid.find(key)->voxels[i], b = backward.grid.find(key)->voxels[i];
      EXPECT_EQ(a.weight(), b.weight());
      largest = std::max(largest, std::abs(a.sdf() - b.sdf()));
    }
  // Two units of the coarsest allowed storage, 20 micrometres.
  EXPECT_LE(largest * forward.grid.sdf_unit_m(), 40e-6);
}

/// By definition, in double precision: a volume with any voxel in the band is updated down to the band's end,
/// each voxel once; no other volume exists.
TEST(Integrator, AVolumeNearTheSurfaceIsObservedFromTheCameraToTheEndOfTheBand) {
  TsdfParams params;
  params.edge_filter = false;
  IntegrationBench bench(params);
  const SE3 pose = looking_along_x(Vec3(0.01, 0.02, 0.03));
  const RgbdFrame frame = kWallAndBox.render(kCamera, pose);
  bench.integrator.integrate(bench.grid, frame);
  const double limit_m = params.kDistanceLimit_voxel * params.voxel_size_m;
  std::size_t measured = 0, free = 0, behind = 0;
  for (const VolumeKey key : bench.grid.sorted_keys()) {
    std::size_t measured_here = 0;
    for (int i = 0; i < kVolumeVoxels; ++i) {
      const TsdfVoxel voxel = bench.grid.find(key)->voxels[i];
      const Vec3 index(8 * key.x + (i & 7), 8 * key.y + (i >> 3 & 7), 8 * key.z + (i >> 6));
      const Vec3 p = pose.inverse() * ((index + Vec3::Constant(0.5)) * params.voxel_size_m);
      const Vec2 pixel = kCamera.project(p), whole(std::round(pixel.x()), std::round(pixel.y()));
      if (!kCamera.contains(pixel) || (pixel - whole).cwiseAbs().maxCoeff() > 0.499) continue;
      const double depth_m = frame.depth.depth_m(static_cast<int>(whole.x()), static_cast<int>(whole.y()));
      const double u = depth_m - p.z(), tau = params.truncation_m({}, depth_m);
      if (std::abs(std::abs(u) - tau) < 1e-4) continue;
      measured_here += std::abs(u) < tau ? 1u : 0u;
      free += u > tau ? 1u : 0u;
      behind += u < -tau ? 1u : 0u;
      ASSERT_EQ(voxel.weight() > 0, u > -tau) << index.transpose();
      if (u > -tau) {
        ASSERT_NEAR(voxel.sdf() * bench.grid.sdf_unit_m(), std::clamp(u, -limit_m, limit_m), 1e-5);
      }
    }
    measured += measured_here;
  }
  EXPECT_GT(measured, 10000u);
  EXPECT_GT(free, 1000u);
  EXPECT_GT(behind, 1000u);
}

TEST(Color, IsStoredNearTheSurfaceOnlyAndIsASwitch) {
  const AnalyticScene wall{{{Vec3(-1, 0, 0), -1.95}}, {}};  // just behind a volume border at 1.92
  IntegrationBench bench({});
  for (int i = 0; i < 4; ++i) bench.add(wall, looking_along_x(Vec3::Zero()));
  std::size_t colored = 0, volumes_with_color = 0;
  for (const VolumeKey key : bench.grid.sorted_keys()) {
    const Volume& volume = *bench.grid.find(key);
    volumes_with_color += volume.colors ? 1 : 0;
    for (int i = 0; volume.colors && i < kVolumeVoxels; ++i) {
      if (volume.colors[i].weight() == 0) continue;
      ++colored;
      EXPECT_LE(std::abs(volume.voxels[i].sdf() * bench.grid.sdf_unit_m()), 0.0301);
      // render() encodes x in the red channel.
      EXPECT_NEAR(volume.colors[i].r(), 127.5 + 127 * std::sin(3 * 1.95), 2);
    }
  }
  EXPECT_GT(colored, 5000u);
  EXPECT_LT(volumes_with_color, bench.grid.volume_count());
  TsdfParams params;
  params.color = false;
  IntegrationBench plain(params);
  plain.add(kWall, looking_along_x(Vec3::Zero()));
  for (const VolumeKey key : plain.grid.sorted_keys()) EXPECT_EQ(plain.grid.find(key)->colors, nullptr);
}

TEST(Integrator, BadPosesChangeNothingAndSaySo) {
  IntegrationBench bench({});
  bench.add(kWall, looking_along_x(Vec3::Zero()));
  const auto expect_refused = [&](std::optional<SE3> pose, const char* why) {
    RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()));
    frame.T_world_camera = pose;
    const std::size_t volumes = bench.grid.volume_count();
    const ScanStats stats = bench.integrator.integrate(bench.grid, frame);
    EXPECT_THAT(stats.nothing_integrated_because, HasSubstr(why));
    EXPECT_EQ(stats.voxels_updated, 0u);
    EXPECT_EQ(bench.grid.volume_count(), volumes);
  };
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  expect_refused(std::nullopt, "no pose");
  expect_refused(SE3(Mat3::Identity(), Vec3(nan, 0, 0)), "not a finite rigid motion");
  expect_refused(SE3(Mat3::Identity(), Vec3(inf, 0, 0)), "not a finite rigid motion");
  expect_refused(SE3(Mat3(2.0 * Mat3::Identity()), Vec3::Zero()), "not a finite rigid motion");
  expect_refused(SE3(Mat3(-Mat3::Identity()), Vec3::Zero()), "not a finite rigid motion");
  expect_refused(SE3(Mat3::Identity(), Vec3(1e9, 0, 0)), "from the origin");
}

TEST(Integrator, SaysWhyNothingWasIntegrated) {
  IntegrationBench bench({});
  RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()));
  frame.depth.unit_m = 1e-7;  // a depth scale wrong by a factor of a thousand
  EXPECT_THAT(bench.integrator.integrate(bench.grid, frame).nothing_integrated_because,
              HasSubstr("none of 76800 readings lies between 0.3 m and 4 m"));
  frame.depth.units = Image<std::uint16_t>(320, 240);
  EXPECT_THAT(bench.integrator.integrate(bench.grid, frame).nothing_integrated_because,
              HasSubstr("none of 76800"));
  frame.depth.units = Image<std::uint16_t>(10, 10);
  EXPECT_THAT(bench.integrator.integrate(bench.grid, frame).nothing_integrated_because,
              HasSubstr("the depth image is 10 x 10, the camera 320 x 240"));
}

TEST(Integrator, TheMemoryCapIsReportedAndLosesNothing) {
  TsdfParams params;
  params.max_map_mb = 1;
  params.voxel_size_m = 0.01;
  IntegrationBench bench(params);
  bench.add(kWall, looking_along_x(Vec3::Zero()));
  const ScanStats stats = bench.add(kWall, looking_along_x(Vec3::Zero()));
  EXPECT_GT(stats.volumes_refused, 0u);
  EXPECT_GT(stats.voxels_updated, 0u);  // existing volumes are still updated
  EXPECT_LE(bench.grid.map_bytes(), 1'050'000u);
  IntegrationBench second(params);
  second.add(kWall, looking_along_x(Vec3::Zero()));
  second.add(kWall, looking_along_x(Vec3::Zero()));
  EXPECT_EQ(difference_of(bench.grid, second.grid), "");
}

TEST(Integrator, ARepeatedViewCostsNoMemory) {
  IntegrationBench bench({});
  for (int i = 0; i < 3; ++i) bench.add(kWallAndBox, looking_along_x(Vec3::Zero()));
  const std::size_t bytes = bench.grid.map_bytes();
  for (int i = 0; i < 30; ++i)
    EXPECT_EQ(bench.add(kWallAndBox, looking_along_x(Vec3::Zero())).volumes_created, 0u);
  EXPECT_EQ(bench.grid.map_bytes(), bytes);
}

TEST(Truncation, FollowsTheNoiseWithTheRightSign) {
  TsdfParams params;
  params.truncation_sigmas_ratio = 8;
  params.voxel_size_m = 0.005;
  const DepthNoise noise;
  EXPECT_NEAR(params.truncation_m(noise, 2.0), 8 * (0.0012 + 0.0019 * 1.6 * 1.6), 1e-4);  // 49 mm, not 97
  params.voxel_size_m = 0.02;
  EXPECT_EQ(params.truncation_m(noise, 0.5), 0.06);
  EXPECT_EQ(params.truncation_m(noise, 50), 0.24);
}

/// Regression: readings at edges whose weight is rounded to 0 moved voxels, and divided by 0 in unknown ones.
TEST(Integrator, ReadingsWithoutWeightChangeNothing) {
  TsdfParams params;
  params.voxel_size_m = 0.005;
  params.truncation_sigmas_ratio = 20;
  params.min_truncation_voxel = 1, params.max_truncation_voxel = 64;
  params.edge_weight_ratio = 0.01;
  for (const KernelChoice kernel : {KernelChoice::kSimd, KernelChoice::kScalar}) {
    params.kernel = kernel;
    IntegrationBench bench(params);
    RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()));
    for (int y = 0; y < kCamera.height; ++y)
      for (int x = 0; x < kCamera.width; ++x)
        frame.depth.units(x, y) = x % 2 == 0 ? 20000 : 30000;  // every reading is at an edge
    const ScanStats stats = bench.integrator.integrate(bench.grid, frame);
    EXPECT_EQ(stats.voxels_updated, 0u);
    EXPECT_EQ(bench.grid.volume_count(), 0u);
    EXPECT_FALSE(stats.nothing_integrated_because.empty());
  }
}

TEST(Integrator, ReadingsOverMoreVolumesThanCanBeSearchedAreRefusedWithTheRemedy) {
  TsdfParams params;
  params.voxel_size_m = 0.002;
  params.far_m = 200;
  IntegrationBench bench(params);
  RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()));
  frame.depth.unit_m = 3e-3;
  std::ranges::fill(frame.depth.units.pixels(), std::uint16_t{65000});
  const ScanStats stats = bench.integrator.integrate(bench.grid, frame);
  EXPECT_EQ(stats.voxels_updated, 0u);
  EXPECT_THAT(stats.nothing_integrated_because, HasSubstr("raise tsdf.voxel_size_m = 0.002"));
  frame.depth.unit_m = 3e-5;
  EXPECT_EQ(bench.integrator.integrate(bench.grid, frame).nothing_integrated_because, "")
      << "goes on after it";
}

/// Returns the message of a scan at 65 m with voxels of 5 mm, in a process limited to 300 MB of memory.
std::string message_without_memory() {
  TsdfParams params;
  params.voxel_size_m = 0.005;
  params.far_m = 66;
  IntegrationBench bench(params);
  RgbdFrame frame = kWall.render(kCamera, looking_along_x(Vec3::Zero()), 1e-3);
  std::ranges::fill(frame.depth.units.pixels(), std::uint16_t{65000});
  const rlimit limit{std::size_t{300} << 20u, std::size_t{300} << 20u};
  setrlimit(RLIMIT_DATA, &limit);
  const ScanStats stats = bench.integrator.integrate(bench.grid, frame);
  return stats.out_of_memory;
}

TEST(IntegratorDeathTest, WithoutMemoryThereIsAnErrorWithTheRemedy) {
  if (test::kSanitized) GTEST_SKIP() << "a sanitizer needs more memory than the limit";
  EXPECT_EXIT(
      {
        const std::string message = message_without_memory();
        std::fputs(message.c_str(), stderr);
        std::_Exit(message.empty() ? 1 : 0);
      },
      testing::ExitedWithCode(0),
      "out of memory: a scan asks for up to [0-9]+ MB .* raise tsdf.voxel_size_m = 0.005");
}

}  // namespace
}  // namespace hm
