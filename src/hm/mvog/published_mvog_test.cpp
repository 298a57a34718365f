#include "hm/mvog/published_mvog.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

float total_mass(const std::vector<MvogVolume>& list) {
  float mass = 0;
  for (const MvogVolume& v : list) mass += v.mass;
  return mass;
}

TEST(MvogVolume, ANewOneIsAtLeastOneCellHighAndOfDensityOne) {
  EXPECT_EQ(make_mvog_volume(5, 2), (MvogVolume{2, 5, 3}));
  const MvogVolume thin = make_mvog_volume(1.25F, 1.25F);
  EXPECT_EQ(thin, (MvogVolume{0.75F, 1.75F, 1}));
  EXPECT_EQ(thin.density(), 1);
}

TEST(MvogVolume, MergingKeepsListsSortedDisjointAndTheirMass) {
  Rng rng(3);
  for (int run = 0; run < 200; ++run) {
    const float gap = run % 3 == 0 ? 1.0F : 0.0F;
    std::vector<MvogVolume> list;
    std::vector<std::pair<float, float>> covered;
    float mass = 0;
    for (int i = 0; i < 40; ++i) {
      const auto z = static_cast<float>(rng.uniform(-40, 40));
      const MvogVolume volume = make_mvog_volume(z, z + static_cast<float>(rng.uniform(0, 4)));
      insert_mvog_volume(list, volume, gap);
      mass += volume.mass;
      covered.emplace_back(volume.bottom, volume.top);
      for (std::size_t k = 0; k < list.size(); ++k) {
        ASSERT_GE(list[k].top - list[k].bottom, 0.999F);
        if (k > 0) {
          ASSERT_GT(list[k].bottom, list[k - 1].top + gap);
        }
      }
      for (const auto& [bottom, top] : covered) {  // everything ever inserted lies in one volume
        const bool inside = std::ranges::any_of(list, [&, low = bottom, high = top](const MvogVolume& v) {
          return v.bottom <= low && high <= v.top;
        });
        ASSERT_TRUE(inside);
      }
    }
    if (gap == 0) {
      EXPECT_NEAR(total_mass(list), mass, 1e-3F * mass);
    } else {
      EXPECT_GE(total_mass(list), mass * 0.999F) << "a bridged gap has a mass of its own";
    }
  }
}

TEST(MvogVolume, TheOrderDoesNotMatterWithoutAGap) {
  Rng rng(8);
  std::vector<MvogVolume> volumes, forwards, backwards;
  for (int i = 0; i < 30; ++i) {
    const auto z = static_cast<float>(rng.uniform(-20, 20));
    volumes.push_back(make_mvog_volume(z, z + static_cast<float>(rng.uniform(0, 3))));
  }
  for (const auto& v : volumes) insert_mvog_volume(forwards, v);
  for (auto v = volumes.rbegin(); v != volumes.rend(); ++v) insert_mvog_volume(backwards, *v);
  ASSERT_EQ(forwards.size(), backwards.size());
  for (std::size_t i = 0; i < forwards.size(); ++i) {
    EXPECT_EQ(forwards[i].bottom, backwards[i].bottom);
    EXPECT_EQ(forwards[i].top, backwards[i].top);
    EXPECT_NEAR(forwards[i].mass, backwards[i].mass, 1e-3F);
  }
}

BeamScanStats insert_one(PublishedMvog& map, const Eigen::Vector3d& from, const Eigen::Vector3f& to) {
  return map.insert({from, {&to, 1}, {}});
}

TEST(PublishedMvog, ABeamLeavesOnePositiveVolumeAndFreeSpaceUpToIt) {
  PublishedMvog map({.resolution_m = 1});
  insert_one(map, {0.5, 0.5, 0.5}, {4.5F, 0.5F, 2.5F});  // slope 1/2: nothing negative in the last cell
  ASSERT_EQ(map.positive(4, 0).size(), 1u);
  EXPECT_EQ(map.positive(4, 0)[0], (MvogVolume{2, 3, 1}));
  EXPECT_TRUE(map.negative(4, 0).empty());
  ASSERT_EQ(map.negative(2, 0).size(), 1u);
  EXPECT_NEAR(map.negative(2, 0)[0].bottom, 1.0F, 1e-5F);  // 1.25 to 1.75, grown to a whole cell
  EXPECT_NEAR(map.negative(2, 0)[0].top, 2.0F, 1e-5F);
  EXPECT_EQ(map.at({4.5, 0.5, 2.9}), Occupancy::kOccupied);
  EXPECT_EQ(map.at({2.5, 0.5, 1.2}), Occupancy::kFree);
  EXPECT_EQ(map.at({2.5, 0.5, 3.2}), Occupancy::kUnknown);
  EXPECT_EQ(map.at({1e9, 0, 0}), Occupancy::kUnknown);
}

TEST(PublishedMvog, SteepBeamsAreFreeUpToTheirHitInTheLastCell) {
  PublishedMvog map({.resolution_m = 1});
  insert_one(map, {0.5, 0.5, 0.0}, {0.5F, 0.5F, 5.0F});  // straight up, which divided by zero once
  ASSERT_EQ(map.negative(0, 0).size(), 1u);
  EXPECT_EQ(map.negative(0, 0)[0], (MvogVolume{0, 4.5F, 4.5F}));
  insert_one(map, {-3.5, -3.5, 0.0}, {-3.4F, -3.4F, -5.0F});
  ASSERT_EQ(map.negative(-4, -4).size(), 1u);
  EXPECT_EQ(map.negative(-4, -4)[0], (MvogVolume{-4.5F, 0, 4.5F}));
  EXPECT_EQ(map.positive(-4, -4)[0], (MvogVolume{-5.5F, -4.5F, 1}));
}

TEST(PublishedMvog, ProbabilityIsTheShareOfDensities) {
  PublishedMvog map({.resolution_m = 1});
  for (int i = 0; i < 3; ++i) insert_one(map, {0.5, 0.5, 0.5}, {2.5F, 0.5F, 0.5F});
  insert_one(map, {0.5, 0.5, 0.5}, {5.5F, 0.5F, 0.5F});
  EXPECT_NEAR(*map.probability_at({2.5, 0.5, 0.5}), 3.0 / 4, 1e-6);
  EXPECT_NEAR(*map.probability_at({1.5, 0.5, 0.5}), 0, 1e-6);
  EXPECT_FALSE(map.probability_at({1.5, 0.5, 2.5}).has_value());
}

/// Heights in metres between all walls of a column's volumes, and those of the slice.
std::vector<double> probes(const PublishedMvog& map, const Eigen::Vector2i& cell) {
  std::vector<double> walls{-0.31, 0.27, -2, 2};
  for (const auto& list : {map.positive(cell.x(), cell.y()), map.negative(cell.x(), cell.y())}) {
    for (const MvogVolume& v : list) {
      walls.push_back(static_cast<double>(v.bottom) * 0.1);
      walls.push_back(static_cast<double>(v.top) * 0.1);
    }
  }
  std::ranges::sort(walls);
  std::vector<double> between;
  for (std::size_t i = 1; i < walls.size(); ++i)
    if (walls[i] - walls[i - 1] > 1e-9) between.push_back((walls[i] + walls[i - 1]) / 2);
  return between;
}

/// Volumes, slices and voxels against asking point by point.
TEST(PublishedMvog, ExtractionAgreesWithPointQueries) {
  PublishedMvog map({.resolution_m = 0.1, .initial_size_m = 1});
  Rng rng(5);
  for (int i = 0; i < 400; ++i)
    insert_one(map, {0.03, -0.04, 0.2},
               Eigen::Vector3d(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-1, 1)).cast<float>());
  const OccupancyGrid2D slice = map.slice(-0.31, 0.27);
  for (int y = 0; y < slice.cells.height(); ++y) {
    for (int x = 0; x < slice.cells.width(); ++x) {
      const Eigen::Vector2d p = slice.center_of(x, y);
      double best = -1;
      const auto volumes = map.volumes_at(p);
      for (const double z : probes(map, map.cell_of(p))) {
        const auto probability = map.probability_at({p.x(), p.y(), z});
        if (probability && z > -0.31 && z < 0.27) best = std::max(best, *probability);
        const Occupancy state = map.at({p.x(), p.y(), z});
        const auto holds = std::ranges::find_if(
            volumes, [&](const VerticalVolume& v) { return v.bottom_m <= z && z < v.top_m; });
        ASSERT_EQ(holds == volumes.end() ? Occupancy::kUnknown : holds->state, state);
      }
      const int cell = slice.cells(x, y);
      if (best < 0) {
        ASSERT_EQ(cell, static_cast<int>(OccupancyGrid2D::kUnknown));
      } else {
        ASSERT_NEAR(cell, 100 * best, 0.51);
      }
    }
  }
  for (const OccupancyVoxel& voxel : map.voxels()) ASSERT_NE(voxel.state, Occupancy::kUnknown);
}

TEST(PublishedMvog, GrowsToHoldItsBeamsAndSkipsWhatItCannotHold) {
  PublishedMvog map;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(insert_one(map, {0, 0, 0}, {nan, 0, 0}).not_finite, 1u);
  EXPECT_EQ(insert_one(map, {0, 0, 0}, {1e7F, 1e7F, 0}).out_of_bounds, 1u);
  const std::size_t before = map.size().cells;
  EXPECT_EQ(insert_one(map, {0, 0, 0}, {-17.05F, 3.05F, 0}).returns, 1u);
  EXPECT_EQ(map.size().cells, 4 * before) << "one axis doubled twice";
  EXPECT_EQ(map.at({-17.05, 3.05, 0}), Occupancy::kOccupied);
  EXPECT_EQ(map.size().positive, 1u);
  EXPECT_EQ(map.size().bytes_published,
            (map.size().positive + map.size().negative) * 12 + map.size().cells_known * 20);
}

}  // namespace
}  // namespace hm
