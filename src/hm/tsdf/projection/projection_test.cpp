#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/projection/candidate_volumes.hpp"
#include "hm/tsdf/projection/depth_bounds.hpp"
#include "hm/tsdf/projection/depth_preparation.hpp"
#include "hm/tsdf/testing/analytic_scene.hpp"
#include "hm/tsdf/testing/grid_compare.hpp"

namespace hm {
namespace {

PinholeCamera small_camera(double fy = 131.0) { return {157, 121, 130.5, fy, 77.0, 60.5, {}}; }

TsdfParams random_params(Rng& rng) {
  TsdfParams params;
  params.voxel_size_m = rng.uniform(0.02, 0.06);
  params.far_m = rng.uniform(2.0, 4.0);
  params.dynamic_truncation = rng.uniform() < 0.7;
  params.carving = rng.uniform() < 0.7;
  params.color = rng.uniform() < 0.7;
  params.truncation_sigmas_ratio = rng.uniform(2, 12);
  params.weight_cap_observations = 1 + static_cast<int>(rng.below(6));
  params.color_cap_observations = 1 + static_cast<int>(rng.below(4));
  return params;
}

/// Adds noise, holes and mixed pixels to an image.
void disturb(RgbdFrame& frame, Rng& rng) {
  for (auto& units : frame.depth.units.pixels()) {
    const double chance = rng.uniform();
    if (chance < 0.05)
      units = 0;
    else if (chance < 0.07)
      units = static_cast<std::uint16_t>(rng.below(65536));
    else
      units = static_cast<std::uint16_t>(std::clamp(units + rng.normal(0, 100), 0.0, 65535.0));
  }
}

TEST(Projection, VectorCodeMatchesScalarCodeBitForBit) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Rng rng(seed);
    TsdfParams params = random_params(rng);
    const PinholeCamera camera = small_camera(seed % 4 == 3 ? -131.0 : 131.0);
    const ParallelLoop loop(1);
    VolumeGrid simd_grid = Integrator::make_grid(params), scalar_grid = Integrator::make_grid(params);
    Integrator simd(params, {}, camera, loop);
    params.kernel = KernelChoice::kScalar;
    Integrator scalar(params, {}, camera, loop);
    std::size_t updated = 0, carved = 0;
    for (int scan = 0; scan < 6; ++scan) {
      RgbdFrame frame = random_scene(rng).render(camera, random_pose(rng));
      disturb(frame, rng);
      const ScanStats a = simd.integrate(simd_grid, frame), b = scalar.integrate(scalar_grid, frame);
      ASSERT_EQ(a.voxels_updated, b.voxels_updated);
      ASSERT_EQ(a.voxels_carved, b.voxels_carved);
      ASSERT_EQ(a.changed.size(), b.changed.size());
      for (std::size_t i = 0; i < a.changed.size(); ++i) {
        ASSERT_EQ(a.changed[i].key, b.changed[i].key);
        ASSERT_EQ(a.changed[i].border_layers, b.changed[i].border_layers);
      }
      updated += a.voxels_updated;
      carved += a.voxels_carved;
    }
    EXPECT_GT(updated, 1000u);
    if (params.carving) {
      EXPECT_GT(carved, 10u);
    }
    EXPECT_EQ(difference_of(simd_grid, scalar_grid), "");
  }
}

TEST(Projection, TheSameBitsForAnyNumberOfThreads) {
  for (const auto method : {IntegrationMethod::kProjection, IntegrationMethod::kTraversal}) {
    std::vector<VolumeGrid> grids;
    for (const int threads : {1, 2, 3, 1}) {
      Rng rng(4);
      TsdfParams params;
      params.method = method;
      params.voxel_size_m = 0.03;
      const ParallelLoop loop(threads);
      grids.push_back(Integrator::make_grid(params));
      Integrator integrator(params, {}, small_camera(), loop);
      for (int scan = 0; scan < 5; ++scan) {
        RgbdFrame frame = random_scene(rng).render(small_camera(), random_pose(rng));
        disturb(frame, rng);
        integrator.integrate(grids.back(), frame);
      }
      EXPECT_EQ(difference_of(grids.front(), grids.back()), "") << threads << " threads";
    }
  }
}

/// Checks by brute force over a box that every voxel in the hit region of its pixel is in a candidate volume,
/// and in a part that is not skipped.
TEST(CandidateVolumes, HoldEveryVoxelOfTheHitRegion) {
  std::size_t inside = 0, missed = 0, passed_over = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Rng rng(100 + seed);
    TsdfParams params = random_params(rng);
    params.voxel_size_m = rng.uniform(0.04, 0.08);
    const PinholeCamera camera = small_camera();
    RgbdFrame frame = random_scene(rng).render(camera, random_pose(rng));
    disturb(frame, rng);
    PreparedDepth prepared;
    const SE3 T_camera_world = frame.T_world_camera->inverse();
    const ProjectionScan scan = make_projection_scan(camera, T_camera_world, params, {});
    prepare_depth({frame.depth, params, EdgeRule(params, {}, camera, frame.depth.unit_m), scan},
                  ParallelLoop(1), prepared);
    const TruncationModel& truncation = scan.truncation;
    std::vector<VolumeKey> keys;
    CandidateFinder finder;
    ASSERT_TRUE(finder.find({prepared, camera, *frame.T_world_camera, params.voxel_size_m, truncation},
                            ParallelLoop(2), keys));
    std::set<std::array<int, 3>> candidates;
    for (const VolumeKey key : keys) candidates.insert({key.x, key.y, key.z});
    EXPECT_EQ(candidates.size(), keys.size());
    for (int i = 0; i < 20'000; ++i) {
      const VolumeKey key{static_cast<int>(rng.below(40)) - 20, static_cast<int>(rng.below(40)) - 20,
                          static_cast<int>(rng.below(40)) - 20};
      ASSERT_EQ(finder.found(key), candidates.contains({key.x, key.y, key.z}));
    }
    DepthBounds bounds;
    bounds.build(prepared, scan, camera, ParallelLoop(2));
    const int reach = static_cast<int>(5.5 / params.voxel_size_m);
    for (int z = -reach; z < reach; ++z)
      for (int y = -reach; y < reach; ++y)
        for (int x = -reach; x < reach; ++x) {
          const Vec3 p = T_camera_world * Vec3((Vec3(x, y, z) + Vec3::Constant(0.5)) * params.voxel_size_m);
          if (p.z() <= 0) continue;
          const Vec2 pixel = camera.project(p);
          // Avoids pixel borders, where single and double precision may round differently.
          const Vec2 rounded(std::round(pixel.x()), std::round(pixel.y()));
          if (!camera.contains(pixel) || (pixel - rounded).cwiseAbs().maxCoeff() > 0.4999) continue;
          const double depth =
              std::abs(prepared.depth_m(static_cast<int>(rounded.x()), static_cast<int>(rounded.y())));
          if (depth <= 0 || depth >= PreparedDepth::kFarM) continue;
          if (std::abs(depth - p.z()) > 0.9999 * truncation.at(static_cast<float>(depth))) continue;
          ++inside;
          missed += candidates.contains({x >> 3, y >> 3, z >> 3}) ? 0u : 1u;
          const int part = voxel_offset(x & 7, y & 7, z & 7) / 16;
          passed_over += bounds.parts_of({x >> 3, y >> 3, z >> 3}).in_band >> part & 1u ? 0u : 1u;
        }
  }
  EXPECT_GT(inside, 5000u);
  EXPECT_EQ(missed, 0u);
  EXPECT_EQ(passed_over, 0u);
}

TEST(DepthBounds, DropOnlyVolumesWithoutAnyPart) {
  std::size_t dropped = 0, kept_for_nothing = 0, kept_right = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Rng rng(300 + seed);
    const TsdfParams params = random_params(rng);
    const PinholeCamera camera = small_camera();
    RgbdFrame frame = random_scene(rng).render(camera, random_pose(rng));
    disturb(frame, rng);
    PreparedDepth prepared;
    const ProjectionScan scan = make_projection_scan(camera, frame.T_world_camera->inverse(), params, {});
    prepare_depth({frame.depth, params, EdgeRule(params, {}, camera, frame.depth.unit_m), scan},
                  ParallelLoop(1), prepared);
    DepthBounds bounds;
    bounds.build(prepared, scan, camera, ParallelLoop(1));
    std::vector<VolumeKey> keys;
    for (int z = -12; z < 12; ++z)
      for (int y = -12; y < 12; ++y)
        for (int x = -12; x < 12; ++x) keys.push_back({x, y, z});
    std::vector<VolumeKey> kept = keys;
    bounds.drop_unseen(kept);
    for (std::size_t i = 0, next = 0; i < keys.size(); ++i) {
      const PartMasks parts = bounds.parts_of(keys[i]);
      const bool seen = (parts.in_band | parts.in_front) != 0,
                 is_kept = next < kept.size() && kept[next] == keys[i];
      ASSERT_TRUE(is_kept || !seen) << keys[i].x << " " << keys[i].y << " " << keys[i].z;
      next += is_kept ? 1 : 0;
      dropped += is_kept ? 0 : 1;
      (seen ? kept_right : kept_for_nothing) += is_kept ? 1 : 0;
    }
  }
  EXPECT_GT(dropped, 1000u);
  EXPECT_GT(kept_right, kept_for_nothing);
}

/// Image of random steps and noise, with holes.
DepthImage stepped_depth(Rng& rng, int width, int height) {
  DepthImage depth{Image<std::uint16_t>(width, height), 1e-3};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int step = ((x / 7) * 31 + (y / 5) * 17) % 4 * 500;
      depth.units(x, y) = rng.uniform() < 0.05 ? std::uint16_t{0}
                                               : static_cast<std::uint16_t>(800 + step + rng.normal(0, 25));
    }
  return depth;
}

TEST(PrepareDepth, AgreesWithTheDefinition) {
  Rng rng(8);
  const DepthImage depth = stepped_depth(rng, 91, 37);
  TsdfParams params;
  params.near_m = 0.9;
  params.far_m = 2.2;
  const PinholeCamera camera{91, 37, 80, 80, 45, 18, {}};
  const EdgeRule rule(params, {}, camera, depth.unit_m);
  PreparedDepth prepared;
  prepare_depth({depth, params, rule, make_projection_scan(camera, SE3(), params, {})}, ParallelLoop(2),
                prepared);
  std::vector<float> low(prepared.tile_min_m.size(), PreparedDepth::kFarM), high(low.size(), 0.0f);
  std::vector<bool> far(low.size(), false);
  std::size_t in_range = 0, mixed_pixels = 0, edges = 0;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const int units = depth.units(x, y), threshold = rule.threshold(depth.units(x, y));
      const auto step_to = [&](int nx, int ny) {
        const int n = depth.units.contains(nx, ny) ? depth.units(nx, ny) : 0;
        return n == 0 || std::abs(n - units) <= threshold ? 0 : n > units ? 1 : -1;
      };
      const int steps[4] = {step_to(x - 1, y), step_to(x + 1, y), step_to(x, y - 1), step_to(x, y + 1)};
      const bool mixed = steps[0] * steps[1] < 0 || steps[2] * steps[3] < 0;
      const bool at_edge = steps[0] || steps[1] || steps[2] || steps[3];
      mixed_pixels += mixed ? 1 : 0;
      edges += at_edge ? 1 : 0;
      const float expected = mixed || units < 900 ? 0.0f
                             : units > 2200       ? PreparedDepth::kFarM
                                                  : float(units) * 1e-3f;
      ASSERT_EQ(prepared.depth_m(x, y), at_edge ? -expected : expected) << x << " " << y;
      const auto tile = static_cast<std::size_t>(y / kTileSide * prepared.tiles_x + x / kTileSide);
      if (expected == PreparedDepth::kFarM) far[tile] = true;
      if (expected == 0.0f || units > 2200) continue;
      ++in_range;
      low[tile] = std::min(low[tile], expected);
      high[tile] = std::max(high[tile], expected);
    }
  for (std::size_t tile = 0; tile < far.size(); ++tile)
    if (high[tile] == 0.0f && far[tile]) high[tile] = PreparedDepth::kOpen;
  EXPECT_GT(mixed_pixels, 10u);
  EXPECT_GT(edges, 100u);
  EXPECT_EQ(prepared.pixels_in_range, in_range);
  EXPECT_EQ(prepared.tile_min_m, low);
  EXPECT_EQ(prepared.tile_max_m, high);
}

TEST(EdgeRule, IsTheNoisePlusTheSlopeInUnits) {
  TsdfParams params;
  const PinholeCamera camera{640, 480, 585, 585, 320, 240, {}};
  const DepthNoise noise;
  for (const double unit_m : {1e-3, 2e-4}) {
    const EdgeRule rule(params, noise, camera, unit_m);
    for (const double z : {0.5, 1.0, 2.0, 4.0, 8.0}) {
      const double expected =
          params.kEdgeSigmasRatio * noise.sigma_m(z) + params.kEdgeSlopeRatio * z / camera.fx;
      EXPECT_NEAR(rule.threshold(static_cast<std::uint16_t>(z / unit_m)) * unit_m, expected, 3e-3) << z;
    }
  }
}

}  // namespace
}  // namespace hm
