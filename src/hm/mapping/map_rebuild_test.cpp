#include "hm/mapping/map_rebuild.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <thread>

#include "hm/core/testing/memory_limit.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/live_map_correction.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

/// A simulation as a recording: the frames of the analytic room.
class SimulatedFrames final : public Recording {
 public:
  explicit SimulatedFrames(std::size_t frames, std::size_t spread) : simulation_(params()), spread_(spread) {
    info_.camera = simulation_.camera();
    info_.frame_count = frames;
    for (std::size_t i = 0; i < frames; ++i) info_.stamps.push_back(simulation_.stamp(i * spread_));
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    if (index == unreadable) return fail(ErrorCode::kCorrupted, "frame", "number {}", index);
    RgbdFrame frame = simulation_.frame(index * spread_);
    frame.index = index;
    return frame;
  }
  [[nodiscard]] SE3 pose(std::size_t index) const { return simulation_.true_pose(index * spread_); }
  std::size_t unreadable = ~std::size_t{0};

 private:
  static SimulationParams params() {
    SimulationParams params;
    params.world = WorldKind::kRoom;
    return params;
  }
  Simulation simulation_;
  std::size_t spread_;
  RecordingInfo info_;
};

DenseParams coarse() {
  DenseParams parameters;
  parameters.tsdf.voxel_size_m = 0.04;
  parameters.reconstruction.live_mesh = false;
  return parameters;
}

using Poses = std::function<std::optional<SE3>(std::size_t)>;

struct Map {
  explicit Map(const Recording& recording) : pipeline(coarse(), recording.info().camera, 1) {}
  void integrate(const Recording& recording, const Poses& poses, std::size_t begin = 0,
                 std::size_t end = ~std::size_t{0}) {
    for (std::size_t i = begin; i < std::min(end, recording.info().frame_count); ++i) {
      auto frame = recording.read(i);
      const auto pose = poses(i);
      if (!frame || !pose) continue;
      frame->T_world_camera = *pose;
      const FrameOutcome outcome = pipeline.process(*frame);
      ASSERT_TRUE(outcome.integrated) << outcome.skipped_because;
      log.note({i, frame->stamp, 0, *pose, *pose}, outcome.scan.changed);
      changed = outcome.scan.changed;
    }
  }
  DensePipeline pipeline;
  ObservationLog log;
  std::vector<ChangedVolume> changed;  ///< by the last frame
};

bool same_volume(const Volume* a, const Volume* b) {
  if (!a || !b) return a == b;
  return std::equal(a->voxels, a->voxels + kVolumeVoxels, b->voxels) && !a->colors == !b->colors &&
         (!a->colors || std::equal(a->colors, a->colors + kVolumeVoxels, b->colors));
}

std::size_t different_volumes(const VolumeGrid& a, const VolumeGrid& b) {
  std::vector<VolumeKey> keys = a.sorted_keys();
  for (const VolumeKey& key : b.sorted_keys())
    if (!a.contains(key)) keys.push_back(key);
  return static_cast<std::size_t>(std::count_if(keys.begin(), keys.end(), [&](const VolumeKey& key) {
    return !same_volume(a.find(key), b.find(key));
  }));
}

const SE3 kShift(so3_exp(Vec3(0, 0, 0.05)), Vec3(0.1, -0.05, 0.02));

MapRebuildOptions extent(RebuildExtent which) {
  MapRebuildOptions options;
  options.extent = which;
  return options;
}

MapCorrection correct(Map& map, const Recording& recording, const Poses& poses,
                      RebuildExtent which = RebuildExtent::kMoved, const RunContext& run = {}) {
  MapRebuild rebuild(coarse(), recording, extent(which));
  return correct_map(
      map.pipeline, map.log, rebuild, [&](const Observation& o) { return poses(o.frame_index); }, run);
}

/// Numbers of voxels that are well known in both maps, of those that differ by more than a centimetre, and of
/// volumes missing in one map.
struct Difference {
  std::size_t compared = 0, far = 0, missing = 0;
};
Difference difference(const VolumeGrid& got, const VolumeGrid& wanted) {
  Difference result;
  for (const VolumeKey& key : wanted.sorted_keys()) {
    const Volume *a = got.find(key), *b = wanted.find(key);
    result.missing += !a;
    for (int v = 0; a && v < kVolumeVoxels; ++v) {
      if (a->voxels[v].weight() < 2 * kWeightOne || b->voxels[v].weight() < 2 * kWeightOne) continue;
      ++result.compared;
      result.far += std::abs(a->voxels[v].sdf() - b->voxels[v].sdf()) * wanted.sdf_unit_m() > 0.01;
    }
  }
  return result;
}

TEST(MapCorrection, NothingMovedNothingChanges) {
  const SimulatedFrames recording(30, 4);
  Map map(recording), same(recording);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  map.integrate(recording, truth);
  same.integrate(recording, truth);
  const MapCorrection done = correct(map, recording, truth);
  EXPECT_EQ(done.frames, 30u);
  EXPECT_EQ(done.frames_moved + done.frames_replayed + done.frames_removed, 0u);
  EXPECT_EQ(done.volumes_rebuilt, 0u);
  EXPECT_EQ(different_volumes(map.pipeline.grid(), same.pipeline.grid()), 0u);
}

TEST(MapCorrection, AllMovedIsTheMapOfTheNewPoses) {
  const SimulatedFrames recording(40, 6);
  Map drifted(recording), wanted(recording);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  drifted.integrate(recording, [&](std::size_t i) { return std::optional(kShift * recording.pose(i)); });
  wanted.integrate(recording, truth);
  EXPECT_GT(different_volumes(drifted.pipeline.grid(), wanted.pipeline.grid()), 100u);
  const MapCorrection done = correct(drifted, recording, truth);
  EXPECT_EQ(done.frames_moved, 40u);
  EXPECT_EQ(done.frames_replayed, 0u);
  EXPECT_NEAR(done.largest_shift_m, kShift.translation().norm() + 0.05 * 3, 0.2);
  EXPECT_EQ(different_volumes(drifted.pipeline.grid(), wanted.pipeline.grid()), 0u);
  EXPECT_EQ(done.volumes_after, wanted.pipeline.grid().volume_count());
  EXPECT_EQ(drifted.pipeline.finished_mesh().triangles, wanted.pipeline.finished_mesh().triangles);
}

TEST(MapCorrection, OnlyWhatMovedFramesSawIsRebuilt) {
  // The poses of the second half are wrong; volumes observed only by the first half must be unchanged.
  const SimulatedFrames recording(60, 4);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  const Poses drifting = [&](std::size_t i) {
    return std::optional(i < 30 ? recording.pose(i) : kShift * recording.pose(i));
  };
  Map map(recording), before(recording), wanted(recording);
  map.integrate(recording, drifting);
  before.integrate(recording, drifting);
  wanted.integrate(recording, truth);
  const MapCorrection done = correct(map, recording, truth);
  EXPECT_EQ(done.frames, 60u);
  EXPECT_EQ(done.frames_moved, 30u);
  EXPECT_GT(done.frames_replayed, 0u);
  std::map<VolumeKey, bool> seen_by_moved;
  before.log.close();
  for (const auto& group : before.log.groups())
    for (const VolumeKey& key : group->volumes)
      seen_by_moved[key] = seen_by_moved[key] || group->observations.front().frame_index >= 30;
  std::size_t kept = 0;
  for (const auto& [key, moved] : seen_by_moved) {
    if (moved || !before.pipeline.grid().contains(key)) continue;
    // Moved frames may have added voxels; all others are bit-identical.
    kept += same_volume(map.pipeline.grid().find(key), before.pipeline.grid().find(key));
  }
  EXPECT_GT(kept, 50u);
  // The surface agrees with that of the true poses, up to the order of weighted averages and their caps.
  const Difference left = difference(map.pipeline.grid(), wanted.pipeline.grid());
  EXPECT_GT(left.compared, 10000u);
  EXPECT_LT(100 * left.far, left.compared);
  // A rebuild of the whole map is bit-identical to a map of these poses.
  EXPECT_EQ(correct(map, recording, truth, RebuildExtent::kWhole).frames_replayed, 60u);
  EXPECT_EQ(different_volumes(map.pipeline.grid(), wanted.pipeline.grid()), 0u);
}

TEST(MapCorrection, ToldToStopLeavesTheMapAsItIs) {
  const SimulatedFrames recording(40, 6);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  const Poses drifted = [&](std::size_t i) { return std::optional(kShift * recording.pose(i)); };
  Map map(recording), before(recording);
  map.integrate(recording, drifted);
  before.integrate(recording, drifted);
  for (const std::size_t after : {0, 1, 25}) {
    std::stop_source stop;
    RunContext run;
    run.stop = stop.get_token();
    run.progress = [&](const Progress& progress) {
      if (progress.done >= after) stop.request_stop();
    };
    if (after == 0) stop.request_stop();
    const MapCorrection done = correct(map, recording, truth, RebuildExtent::kWhole, run);
    EXPECT_TRUE(done.interrupted);
    EXPECT_EQ(done.frames_moved, after);
    EXPECT_EQ(different_volumes(map.pipeline.grid(), before.pipeline.grid()), 0u);
    EXPECT_EQ(map.log.frames_mapped(), 40u);
    const SE3 T = *map.log.groups().front()->observations.front().T_map_camera;
    EXPECT_EQ(T.matrix(), drifted(0)->matrix());
  }
  EXPECT_FALSE(correct(map, recording, truth, RebuildExtent::kWhole).interrupted);
}

/// Voxels so small that a map of the room does not fit into memory.
DenseParams too_fine() {
  DenseParams parameters = coarse();
  parameters.tsdf.voxel_size_m = 0.002;
  return parameters;
}

PoseOfObservation true_poses(const SimulatedFrames& recording) {
  return [&recording](const Observation& o) { return std::optional(recording.pose(o.frame_index)); };
}

void end_well_if(bool is_right, const std::string& message) {
  std::fputs(message.c_str(), stderr);
  std::_Exit(is_right ? 0 : 1);
}

TEST(MapCorrectionDeathTest, WithoutMemoryTheOldMapStays) {
  if (!test::kCanLimitMemory) GTEST_SKIP();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const SimulatedFrames recording(10, 4);
  Map map(recording), same(recording);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  map.integrate(recording, truth);
  same.integrate(recording, truth);
  EXPECT_EXIT(
      {
        MapRebuild rebuild(too_fine(), recording, extent(RebuildExtent::kWhole));
        test::limit_memory_to_what_is_there_and(200u << 20u);
        const MapCorrection done = correct_map(map.pipeline, map.log, rebuild, true_poses(recording), {});
        end_well_if(done.interrupted && different_volumes(map.pipeline.grid(), same.pipeline.grid()) == 0,
                    done.out_of_memory);
      },
      testing::ExitedWithCode(0), "out of memory: .*raise tsdf.voxel_size_m = 0.002");
}

TEST(MapCorrectionDeathTest, WithoutMemoryALiveCorrectionGivesUp) {
  if (!test::kCanLimitMemory) GTEST_SKIP();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const SimulatedFrames recording(10, 4);
  Map map(recording);
  map.integrate(recording, [&](std::size_t i) { return std::optional(recording.pose(i)); });
  EXPECT_EXIT(
      {
        LiveMapCorrection live(too_fine(), recording, extent(RebuildExtent::kWhole));
        test::limit_memory_to_what_is_there_and(200u << 20u);
        live.start(map.log, true_poses(recording));
        while (live.busy() && !live.take()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
        end_well_if(!live.busy() && live.take() == nullptr, live.out_of_memory());
      },
      testing::ExitedWithCode(0), "out of memory: ");
}

/// The map is corrected while frames are added (at corrected poses) and is complete at any time.
void correct_while_frames_come(std::size_t first_moved) {
  constexpr std::size_t kBegin = test::repetitions(60, 45), kFrames = kBegin + test::repetitions(20, 10);
  const SimulatedFrames recording(kFrames, 3);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  const Poses drifting = [&](std::size_t i) {
    return std::optional(i >= first_moved && i < kBegin ? kShift * recording.pose(i) : recording.pose(i));
  };
  Map map(recording), wanted(recording);
  wanted.integrate(recording, truth);
  map.integrate(recording, drifting, 0, kBegin);
  LiveMapCorrection live(coarse(), recording, extent(RebuildExtent::kMoved));
  EXPECT_EQ(live.take(), nullptr);
  live.start(map.log, [&](const Observation& o) { return truth(o.frame_index); });
  for (std::size_t i = kBegin; i < kFrames; ++i) {
    map.integrate(recording, truth, i, i + 1);
    live.follow({i, recording.info().stamps[i], 0, *truth(i), *truth(i)}, map.changed, *recording.read(i));
  }
  std::unique_ptr<MapRebuild> done;
  while (!(done = live.take())) {
    EXPECT_TRUE(live.busy());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_FALSE(live.busy());
  EXPECT_TRUE(done->put_into(map.pipeline, map.log));
  EXPECT_EQ(done->report().frames_moved, kBegin - first_moved);
  EXPECT_LE(done->report().frames_replayed, first_moved + kFrames - kBegin);
  EXPECT_GT(done->report().frames_replayed, 0u);
  live.discard(std::move(done));
  const Difference left = difference(map.pipeline.grid(), wanted.pipeline.grid());
  EXPECT_EQ(left.missing, 0u);
  EXPECT_GT(left.compared, 10000u);
  EXPECT_LT(100 * left.far, left.compared);
  for (const Observation& o : map.log.observations())
    EXPECT_EQ(o.T_map_camera->matrix(), truth(o.frame_index)->matrix());
  // Integration can continue, and no correction is pending.
  live.start(map.log, [&](const Observation& o) { return truth(o.frame_index); });
  while (!(done = live.take())) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_TRUE(done->is_empty());
}

TEST(LiveMapCorrection, OfAPartWhileFramesCome) { correct_while_frames_come(test::repetitions(45, 30)); }
TEST(LiveMapCorrection, OfTheWholeWhileFramesCome) { correct_while_frames_come(15); }

TEST(LiveMapCorrection, EndsInTheMiddle) {
  const SimulatedFrames recording(40, 6);
  Map map(recording);
  map.integrate(recording, [&](std::size_t i) { return std::optional(kShift * recording.pose(i)); });
  LiveMapCorrection live(coarse(), recording, extent(RebuildExtent::kMoved));
  live.start(map.log, [&](const Observation& o) { return std::optional(recording.pose(o.frame_index)); });
  while (live.state().frames_done < 3 && live.busy() && !live.take())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(MapCorrection, FramesThatBelongElsewhereAreTakenOut) {
  const SimulatedFrames recording(40, 6);
  const Poses truth = [&](std::size_t i) { return std::optional(recording.pose(i)); };
  const Poses first = [&](std::size_t i) {
    return i < 15 ? std::optional(recording.pose(i)) : std::optional<SE3>();
  };
  Map map(recording), wanted(recording);
  map.integrate(recording, truth);
  wanted.integrate(recording, first);
  const MapCorrection done = correct(map, recording, first);
  EXPECT_EQ(done.frames_removed, 25u);
  EXPECT_EQ(done.frames_moved, 0u);
  // Everything is rebuilt from the remaining frames, in order. Voxels carved by removed frames reappear.
  EXPECT_EQ(map.pipeline.grid().volume_count(), wanted.pipeline.grid().volume_count());
  EXPECT_EQ(different_volumes(map.pipeline.grid(), wanted.pipeline.grid()), 0u);
  EXPECT_EQ(map.log.frames_mapped(), 15u);
}

TEST(MapCorrection, SurvivesUnreadableFramesAndGaps) {
  SimulatedFrames recording(40, 6);
  Map map(recording);
  map.integrate(recording, [&](std::size_t i) {
    return i % 7 == 3 || i == 1 ? std::optional<SE3>() : std::optional(kShift * recording.pose(i));
  });
  recording.unreadable = 8;
  const MapCorrection done =
      correct(map, recording, [&](std::size_t i) { return std::optional(recording.pose(i)); });
  EXPECT_EQ(done.frames, 33u);
  EXPECT_EQ(done.frames_lost, 1u);
  EXPECT_EQ(done.frames_moved, 32u);
}

}  // namespace
}  // namespace hm
