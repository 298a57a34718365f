// Queries and exports of MultiVolumeGrid against going through its cells one by one.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "hm/mvog/dense_reference_test_support.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {
namespace {

constexpr double kResolution = 0.1, kLevel = 0.05;

MultiVolumeGrid some_grid() {
  MultiVolumeGrid grid;
  Rng rng(13);
  for (int i = 0; i < 25; ++i) grid.insert(test::random_scan(rng, 300, 2.5, {-1.2, 0.7, -0.3}).view());
  return grid;
}

TEST(GridQueries, RaysStopWhereSteppingAlongThemStops) {
  const MultiVolumeGrid grid = some_grid();
  Rng rng(1);
  int hits = 0, unknown = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto point = [&] {
      return Eigen::Vector3d(-1.2 + rng.uniform(-2.5, 2.5), 0.7 + rng.uniform(-2.5, 2.5),
                             rng.uniform(-1.5, 1));
    };
    const Eigen::Vector3d from = point();
    Eigen::Vector3d to = point();
    if (i % 20 == 0) to.head<2>() = from.head<2>();
    if (i % 20 == 1) to.z() = from.z();
    const auto mode = i % 2 ? UnknownSpace::kPasses : UnknownSpace::kStops;
    const GridRayHit hit = grid.cast_ray(from, to, mode);
    const double length = (to - from).norm();
    const auto stops = [&](double s) {
      const Occupancy state = grid.at(from + (to - from) * (s / length));
      return state == Occupancy::kOccupied || (mode == UnknownSpace::kStops && state == Occupancy::kUnknown);
    };
    // Nothing stops it before; what stops it is there.
    for (double s = 0; s < hit.distance_m - 1e-6; s += 0.003) ASSERT_FALSE(stops(s)) << i << " at " << s;
    ASSERT_NEAR((hit.p_world - from).norm(), hit.distance_m, 1e-9);
    if (hit.state == Occupancy::kFree) {
      ASSERT_NEAR(hit.distance_m, length, 1e-9);
      continue;
    }
    ++(hit.state == Occupancy::kOccupied ? hits : unknown);
    const double inside = std::min(hit.distance_m + 1e-7, length);
    if (stops(inside)) {
      ASSERT_EQ(grid.at(from + (to - from) * (inside / length)), hit.state);
    } else {  // a corner cut by less than that
      ASSERT_TRUE(stops(std::max(0.0, hit.distance_m - 1e-7)) || stops(hit.distance_m)) << i;
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(unknown, 500);
}

TEST(GridQueries, RaysThatTheMapCannotHoldAreUnknown) {
  const MultiVolumeGrid grid = some_grid();
  EXPECT_EQ(grid.cast_ray({0, 0, 0}, {1e12, 0, 0}).state, Occupancy::kUnknown);
  EXPECT_EQ(grid.cast_ray({std::nan(""), 0, 0}, {1, 0, 0}).state, Occupancy::kUnknown);
  EXPECT_EQ(grid.cast_ray({50, 50, 0}, {60, 50, 0}).state, Occupancy::kFree);
  EXPECT_EQ(grid.cast_ray({50, 50, 0}, {60, 50, 0}, UnknownSpace::kStops).distance_m, 0);
}

TEST(GridQueries, BoxesAreWhatTheirCellsAre) {
  const MultiVolumeGrid grid = some_grid();
  Rng rng(8);
  std::map<Occupancy, int> seen;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d min(-1.2 + rng.uniform(-2, 2), 0.7 + rng.uniform(-2, 2), -0.3 + rng.uniform(-1, 1));
    const double side = i % 3 == 0 ? 0.08 : 0.4;
    const Eigen::Vector3d max =
        min + Eigen::Vector3d(rng.uniform(0, side), rng.uniform(0, side), rng.uniform(0, side));
    bool occupied = false, unknown = false;
    for (int x = static_cast<int>(std::floor(min.x() / kResolution)); x <= std::floor(max.x() / kResolution);
         ++x)
      for (int y = static_cast<int>(std::floor(min.y() / kResolution));
           y <= std::floor(max.y() / kResolution); ++y)
        for (int z = static_cast<int>(std::floor(min.z() / kLevel)); z <= std::floor(max.z() / kLevel); ++z) {
          const Occupancy state =
              grid.at({(x + 0.5) * kResolution, (y + 0.5) * kResolution, (z + 0.5) * kLevel});
          occupied |= state == Occupancy::kOccupied;
          unknown |= state == Occupancy::kUnknown;
        }
    const Occupancy expected = occupied  ? Occupancy::kOccupied
                               : unknown ? Occupancy::kUnknown
                                         : Occupancy::kFree;
    ASSERT_EQ(grid.in_box(Box3(min, max)), expected) << i;
    ++seen[expected];
  }
  EXPECT_EQ(seen.size(), 3u);
  EXPECT_EQ(grid.in_box(Box3(Eigen::Vector3d(-1e9, -1e9, -1e9), Eigen::Vector3d(1e9, 1e9, 1e9))),
            Occupancy::kOccupied);
  EXPECT_EQ(grid.in_box(Box3(Eigen::Vector3d(1e3, 1e3, -1), Eigen::Vector3d(1e6, 1e6, 1))),
            Occupancy::kUnknown);
}

TEST(GridQueries, VolumesSlicesAndVoxelsAgreeWithCells) {
  const MultiVolumeGrid grid = some_grid();
  const Box3 bounds = grid.bounds();
  const double low_m = -0.45, high_m = 0.2;
  const auto slice = grid.slice(low_m, high_m);
  ASSERT_TRUE(slice.has_value());
  const double cells_per_m = 1 / slice->resolution_m;
  const Eigen::Vector2i first = (slice->origin_m * cells_per_m).array().round().cast<int>() + 3;
  const OccupancyGrid2D square = grid.slice_square(first, 40, low_m, high_m);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      ASSERT_EQ(square.cells(x, y),
                slice->cells.contains(x + 3, y + 3) ? slice->cells(x + 3, y + 3) : OccupancyGrid2D::kUnknown);
  std::map<std::array<int, 3>, double> cubes;
  std::size_t positive = 0, negative = 0;
  for (int y = 0; y < slice->cells.height(); ++y) {
    for (int x = 0; x < slice->cells.width(); ++x) {
      const Eigen::Vector2d p = slice->center_of(x, y);
      double best = -1;
      for (double z = bounds.min().z() + kLevel / 2; z < bounds.max().z(); z += kLevel) {
        const auto probability = grid.probability_at({p.x(), p.y(), z});
        if (!probability) continue;
        if (z > low_m && z < high_m) best = std::max(best, *probability);
        double& cube =
            cubes.try_emplace({x, y, static_cast<int>(std::floor(z / kResolution))}, -1).first->second;
        cube = std::max(cube, *probability);
      }
      const int expected = best < 0 ? OccupancyGrid2D::kUnknown : static_cast<int>(std::lround(100 * best));
      ASSERT_EQ(static_cast<int>(slice->cells(x, y)), expected);
      double top = -1e9;
      for (const VerticalVolume& volume : grid.volumes_at(p)) {
        ASSERT_GE(volume.bottom_m, top - 1e-9);
        for (double z = volume.bottom_m + kLevel / 2; z < volume.top_m; z += kLevel)
          ASSERT_EQ(grid.at({p.x(), p.y(), z}), volume.state);
        top = volume.top_m;
        ++(volume.state == Occupancy::kOccupied ? positive : negative);
      }
    }
  }
  const auto voxels = grid.voxels();
  ASSERT_EQ(voxels.size(), cubes.size());
  for (const OccupancyVoxel& voxel : voxels) {
    const std::array<int, 3> key{
        slice->column_of(static_cast<double>(voxel.p_world_centre.x())),
        slice->row_of(static_cast<double>(voxel.p_world_centre.y())),
        static_cast<int>(std::floor(static_cast<double>(voxel.p_world_centre.z()) / kResolution))};
    ASSERT_TRUE(cubes.contains(key));
    ASSERT_NEAR(static_cast<double>(voxel.probability), cubes[key], 1e-6);
  }
  EXPECT_EQ(grid.size().volumes_positive, positive);
  EXPECT_EQ(grid.size().volumes_negative, negative);
}

TEST(GridQueries, ASliceOfAMapSpreadOverAContinentIsRefused) {
  MultiVolumeGrid grid;
  const std::vector<Eigen::Vector3f> near{{1, 1, 0}}, far{{2e6F, 2e6F, 0}};
  grid.insert(near, {0, 0, 0});
  grid.insert(far, {2e6 - 1, 2e6, 0});
  EXPECT_EQ(grid.slice(-1, 1).error().code, ErrorCode::kOutOfMemory);
  EXPECT_LT(grid.bytes(), 100000u);
}

}  // namespace
}  // namespace hm
