#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"
#include "hm/tsdf/testing/analytic_scene.hpp"
#include "hm/tsdf/testing/grid_compare.hpp"
#include "hm/tsdf/update/discrete_update_filter.hpp"

namespace hm {
namespace {

using Cell = std::array<int, 3>;

/// Part of a ray inside a cell (slab test), metres.
double crossing_length(const Vec3& origin, const Vec3& direction, const Vec3& low, double size) {
  double begin = -1e9, end = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - origin[axis]) / direction[axis], b = a + size / direction[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return end - begin;
}

/// Brute force: for every ray, every voxel of a box, by the definition of Algorithm 1.
std::map<Cell, TsdfVoxel> brute_force(const TsdfParams& params, const PointScan& scan, int reach,
                                      std::map<Cell, TsdfVoxel> voxels) {
  const TruncationModel truncation(params, {});
  const double s = params.voxel_size_m;
  const float margin = static_cast<float>(params.kCarvingMargin_voxel * s);
  const float limit =
      static_cast<float>(std::min(params.kDistanceLimit_voxel, params.min_truncation_voxel) * s);
  for (const Eigen::Vector3f& point : scan.p_world_points) {
    const Vec3 ray = point.cast<double>() - scan.p_world_origin;
    const double length = ray.norm();
    const Vec3 direction = ray / length;
    const float tau = truncation.at(static_cast<float>(length));
    const float weight = round_to_even(truncation.min_m * static_cast<float>(kWeightOne) / tau);
    for (int z = -reach; z < reach; ++z)
      for (int y = -reach; y < reach; ++y)
        for (int x = -reach; x < reach; ++x) {
          const Vec3 low = Vec3(x, y, z) * s, centre = low + Vec3::Constant(s / 2);
          const double along = (centre - scan.p_world_origin).dot(direction);
          if (along < -s || along > length + tau + s ||
              crossing_length(scan.p_world_origin, direction, low, s) <= 0)
            continue;
          // Only the traversed part of the ray counts.
          const double begin = params.carving ? 0.0 : std::max(length - tau, 0.0);
          const Vec3 from = scan.p_world_origin + begin * direction;
          double t0 = -1e9, t1 = 1e9;
          for (int axis = 0; axis < 3; ++axis) {
            const double a = (low[axis] - from[axis]) / direction[axis], b = a + s / direction[axis];
            t0 = std::max(t0, std::min(a, b));
            t1 = std::min(t1, std::max(a, b));
          }
          if (t1 <= 0 || t0 >= length + tau - begin) continue;
          const auto u = static_cast<float>(length - along);
          auto found = voxels.find({x, y, z});
          if (u >= -tau && u <= tau) {
            TsdfVoxel& voxel = voxels[{x, y, z}];
            voxel = add_observation(
                voxel, round_to_even(std::clamp(u, -limit, limit) / static_cast<float>(params.sdf_unit_m())),
                weight, static_cast<float>(params.weight_cap_observations * kWeightOne));
          } else if (params.carving && u > tau + margin && found != voxels.end() &&
                     found->second.weight() > 0 && found->second.sdf() <= 0) {
            found->second = take_weight(
                found->second, round_to_even(weight * static_cast<float>(params.carving_weight_ratio)));
          }
        }
  }
  return voxels;
}

TEST(Traversal, AgreesWithBruteForceCellByCell) {
  for (const bool carving : {false, true}) {
    Rng rng(carving ? 21 : 20);
    TsdfParams params;
    params.voxel_size_m = 0.1;
    params.carving = carving;
    params.carving_weight_ratio = 0.5;  // several rays to erase a voxel
    const ParallelLoop loop(2);
    VolumeGrid grid = Integrator::make_grid(params);
    Integrator integrator(params, {}, {8, 8, 8, 8, 4, 4, {}}, loop);
    std::map<Cell, TsdfVoxel> expected;
    std::size_t carved = 0;
    for (int scan_index = 0; scan_index < 3; ++scan_index) {
      PointScan scan;
      scan.p_world_origin = Vec3(rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3));
      std::vector<Eigen::Vector3f> points;
      for (int i = 0; i < 60; ++i) {
        const Vec3 toward = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
        points.push_back((scan.p_world_origin + toward * rng.uniform(0.4, 1.4)).cast<float>());
      }
      scan.p_world_points = points;
      carved += integrator.integrate(grid, scan).voxels_carved;
      expected = brute_force(params, scan, 24, std::move(expected));
    }
    std::size_t known = 0;
    for (const auto& [cell, voxel] : expected) {
      known += voxel.weight() > 0 ? 1 : 0;
      // A volume without a surface nearby is released, with its free voxels.
      const TsdfVoxel found = grid.voxel(cell[0], cell[1], cell[2]);
      if (found == TsdfVoxel{} && voxel.sdf() > 0 &&
          !grid.find(VolumeKey{cell[0] >> 3, cell[1] >> 3, cell[2] >> 3}))
        continue;
      ASSERT_EQ(found, voxel) << cell[0] << " " << cell[1] << " " << cell[2];
    }
    std::size_t found_known = 0;
    for (const VolumeKey key : grid.sorted_keys())
      for (int i = 0; i < kVolumeVoxels; ++i) found_known += grid.find(key)->voxels[i].weight() > 0 ? 1 : 0;
    EXPECT_LE(found_known, known);
    EXPECT_GT(found_known, known * 9 / 10);
    EXPECT_EQ(carved > 0, carving);
  }
}

TEST(Traversal, SkipsPointsThatAreNotFinite) {
  const ParallelLoop loop(1);
  const TsdfParams params;
  Integrator integrator(params, {}, {8, 8, 8, 8, 4, 4, {}}, loop);
  VolumeGrid grid = Integrator::make_grid(params);
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const std::vector<Eigen::Vector3f> points{{nan, 0, 0}, {0, inf, 0}, {1, 0, 0}, {0, 0, 0}, {1e30f, 0, 0}};
  ScanStats stats = integrator.integrate(grid, PointScan{Vec3::Zero(), points, {}});
  EXPECT_EQ(stats.pixels_seen, 5u);
  EXPECT_EQ(stats.pixels_in_range, 1u);
  EXPECT_GT(stats.voxels_updated, 0u);
  stats = integrator.integrate(grid, PointScan{Vec3(nan, 0, 0), points, {}});
  EXPECT_EQ(stats.nothing_integrated_because, "its origin is not finite");
}

TEST(Traversal, GivesTheSameSurfaceAsProjection) {
  Rng rng(31);
  const AnalyticScene scene{{{Vec3(-1, 0, 0), -1.5}}, {{Vec3(1.2, 0.2, 0), 0.3}}};
  const PinholeCamera camera{160, 120, 130, 130, 79.5, 59.5, {}};
  const ParallelLoop loop(1);
  TsdfParams params;
  params.voxel_size_m = 0.03;
  std::vector<VolumeGrid> grids;
  for (const auto method : {IntegrationMethod::kProjection, IntegrationMethod::kTraversal}) {
    params.method = method;
    grids.push_back(Integrator::make_grid(params));
    Integrator integrator(params, {}, camera, loop);
    for (int i = 0; i < 5; ++i)
      integrator.integrate(grids.back(), scene.render(camera, looking_along_x(Vec3(0, 0.05 * i, 0.02 * i))));
  }
  double sum = 0;
  int samples = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(1.5, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5));
    if (scene.balls[0].centre.y() > p.y() - 0.6 && (p - scene.balls[0].centre).tail<2>().norm() < 0.6)
      continue;
    const auto a = grids[0].sample(p), b = grids[1].sample(p);
    if (!a || !b) continue;
    sum += std::abs(a->distance_m) + std::abs(b->distance_m);
    ++samples;
  }
  ASSERT_GT(samples, 300);
  EXPECT_LT(sum / samples, 0.003);
}

}  // namespace
}  // namespace hm
