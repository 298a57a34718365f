#include "hm/mapping/dense_pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <span>
#include <vector>

#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

const PinholeCamera kCamera{160, 120, 140, 140, 79.5, 59.5, {}};

/// A wall 2 m in front of the camera.
RgbdFrame wall() {
  RgbdFrame frame;
  frame.depth.unit_m = 1e-3;
  frame.depth.units = Image<std::uint16_t>(160, 120, 2000);
  frame.color = Image<Rgb8>(160, 120, Rgb8{10, 200, 30});
  frame.T_world_camera = SE3();
  return frame;
}

TEST(DensePipeline, AWallBecomesAMesh) {
  DensePipeline pipeline({}, kCamera, 2);
  const FrameOutcome outcome = pipeline.process(wall());
  EXPECT_TRUE(outcome.integrated);
  EXPECT_EQ(outcome.skipped_because, "");
  const TriangleMesh mesh = pipeline.finished_mesh();
  // The image covers 160 / 140 * 2 m by 120 / 140 * 2 m; voxels at the rim may be missing.
  EXPECT_NEAR(surface_area(mesh), 320.0 / 140 * 240.0 / 140, 0.25);
  for (const auto& vertex : mesh.vertices) EXPECT_NEAR(vertex.z(), 2.0f, 1e-3f);
  ASSERT_TRUE(mesh.has_colors());
  EXPECT_EQ(mesh.colors.front(), (Rgb8{10, 200, 30}));
}

TEST(DensePipeline, UnusableFramesAreSkippedWithTheReasonAndChangeNothing) {
  DensePipeline pipeline({}, kCamera, 1);
  const auto reason = [&](const RgbdFrame& frame) {
    const FrameOutcome outcome = pipeline.process(frame);
    EXPECT_FALSE(outcome.integrated);
    return outcome.skipped_because;
  };
  RgbdFrame frame = wall();
  frame.T_world_camera.reset();
  EXPECT_THAT(reason(frame), testing::HasSubstr("no pose"));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    frame.T_world_camera = SE3(Mat3::Identity(), Vec3(0, bad, 0));
    EXPECT_THAT(reason(frame), testing::HasSubstr("not finite"));
  }
  frame.T_world_camera = SE3(1.1 * Mat3::Identity(), Vec3::Zero());
  EXPECT_THAT(reason(frame), testing::HasSubstr("rigid"));
  frame.T_world_camera = SE3(Vec3(1, 1, -1).asDiagonal().toDenseMatrix(), Vec3::Zero());
  EXPECT_THAT(reason(frame), testing::HasSubstr("rigid"));
  frame = wall();
  frame.depth.units = Image<std::uint16_t>(80, 60, 2000);
  EXPECT_THAT(reason(frame), testing::HasSubstr("80 x 60"));
  frame = wall();
  frame.depth.units = Image<std::uint16_t>(160, 120);
  EXPECT_FALSE(reason(frame).empty());
  EXPECT_EQ(pipeline.grid().volume_count(), 0u);
  EXPECT_TRUE(pipeline.finished_mesh().triangles.empty());
}

TEST(DensePipeline, RepeatedPosesOnlyRefine) {
  DensePipeline pipeline({}, kCamera, 1);
  pipeline.process(wall());
  const TriangleMesh once = pipeline.finished_mesh();
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(pipeline.process(wall()).integrated);
  EXPECT_EQ(pipeline.finished_mesh().triangles, once.triangles);
  EXPECT_EQ(pipeline.take_finished_mesh().triangles, once.triangles);
  EXPECT_EQ(pipeline.grid().volume_count(), 0u);
}

TEST(DensePipeline, FarFromTheOriginIsRefusedNotMisplaced) {
  DensePipeline pipeline({}, kCamera, 1);
  RgbdFrame frame = wall();
  frame.T_world_camera = SE3(Mat3::Identity(), Vec3(1e9, 0, 0));
  const FrameOutcome outcome = pipeline.process(frame);
  EXPECT_FALSE(outcome.integrated) << "volume keys have 21 bits an axis";
  EXPECT_EQ(pipeline.grid().volume_count(), 0u);
}

TEST(DensePipeline, EveryChangeReachesTheSink) {
  DensePipeline pipeline({}, kCamera, 1), other({}, kCamera, 1);
  std::set<VolumeKey> changed;
  pipeline.set_change_sink([&](std::span<const ChangedVolume> volumes) {
    for (const ChangedVolume& volume : volumes) changed.insert(volume.key);
  });
  pipeline.process(wall());
  const auto keys = pipeline.grid().sorted_keys();
  EXPECT_GT(keys.size(), 50U);
  EXPECT_EQ(changed, std::set<VolumeKey>(keys.begin(), keys.end()));
  // An exchanged map: what it had, and what it has now.
  RgbdFrame beside = wall();
  beside.T_world_camera = SE3(Mat3::Identity(), Vec3(3, 0, 0));
  other.process(beside);
  std::set<VolumeKey> both = changed;
  for (const VolumeKey& key : other.grid().sorted_keys()) both.insert(key);
  changed.clear();
  pipeline.swap_grid(other.grid());
  EXPECT_EQ(changed, both);
  changed.clear();
  const std::vector<VolumeKey> one{pipeline.grid().sorted_keys().front()};
  pipeline.replace(one, other.grid());
  EXPECT_EQ(changed, std::set<VolumeKey>(one.begin(), one.end()));
  pipeline.set_change_sink({});
  changed.clear();
  pipeline.process(wall());
  EXPECT_TRUE(changed.empty());
}

}  // namespace
}  // namespace hm
