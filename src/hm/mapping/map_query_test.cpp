#include "hm/mapping/map_query.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <vector>

#include "hm/mapping/dense_pipeline.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

SimulationParams room() {
  SimulationParams params;
  params.world = WorldKind::kRoom;
  return params;
}

/// Room scanned from a few positions.
struct ScannedRoom {
  ScannedRoom() : simulation(room()), pipeline(params(), simulation.camera(), 1) {
    for (std::size_t i = 0; i < 4; ++i) pipeline.process(simulation.frame(10 * i));
  }
  static DenseParams params() {
    DenseParams params;
    params.tsdf.voxel_size_m = 0.04;
    return params;
  }
  Simulation simulation;
  DensePipeline pipeline;
};

std::filesystem::path temporary(const char* name) {
  return std::filesystem::path(testing::TempDir()) / fmt::format("hm_query_{}_{}", getpid(), name);
}

TEST(MapQuery, AMapFileGivesWhatTheGridGave) {
  ScannedRoom scanned;
  const auto path = temporary("whole.hmap");
  const auto saved = save_map(path, scanned.pipeline.grid());
  ASSERT_TRUE(saved) << to_string(saved.error());
  const MapQuery live(scanned.pipeline.grid());
  const auto loaded = MapQuery::open(path);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->volume_count(), live.volume_count());
  EXPECT_EQ(loaded->voxel_size_m(), 0.04);
  const TriangleMesh mesh = live.mesh();
  EXPECT_EQ(loaded->mesh().vertices, mesh.vertices);
  ASSERT_GT(mesh.vertices.size(), 1000u);
  std::vector<Vec3> points;
  for (const auto& vertex : mesh.vertices) points.push_back(vertex.cast<double>());
  std::vector<GridSample> a(points.size()), b(points.size());
  live.at(points, a, ParallelLoop(2));
  loaded->at(points, b);
  std::size_t known = 0, colored = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(a[i].known, b[i].known);
    EXPECT_EQ(a[i].distance_m, b[i].distance_m);
    EXPECT_EQ(a[i].color, b[i].color);
    if (!a[i].known) continue;
    ++known;
    colored += a[i].color ? 1 : 0;
    EXPECT_LT(std::abs(a[i].distance_m), 0.02) << "vertices lie on the surface";
  }
  EXPECT_GT(known, points.size() / 2);
  EXPECT_GT(colored, known / 2);
  std::filesystem::remove(path);
}

TEST(MapQuery, APartOfAMapHasTheVolumesThatTouchTheBox) {
  ScannedRoom scanned;
  const auto path = temporary("part.hmap");
  ASSERT_TRUE(save_map(path, scanned.pipeline.grid()));
  Box3 west = MapQuery(scanned.pipeline.grid()).bounds();
  west.max().x() = west.center().x();
  const auto part = MapQuery::open(path, west);
  ASSERT_TRUE(part);
  EXPECT_GT(part->volume_count(), 0u);
  EXPECT_LT(part->volume_count(), scanned.pipeline.grid().volume_count());
  const auto capped = MapQuery::open(path, {}, 10'000);
  ASSERT_FALSE(capped);
  EXPECT_EQ(capped.error().code, ErrorCode::kOutOfMemory);
  std::filesystem::remove(path);
}

TEST(MapQuery, AFailedSaveLeavesTheOldFileWhole) {
  ScannedRoom scanned;
  const auto folder = temporary("no_such_folder");
  const auto saved = save_map(folder / "map.hmap", scanned.pipeline.grid());
  ASSERT_FALSE(saved);
  EXPECT_FALSE(to_string(saved.error()).empty());
  EXPECT_FALSE(std::filesystem::exists(folder));
  EXPECT_EQ(MapQuery::open(folder / "map.hmap").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace hm
