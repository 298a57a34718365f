#include "hm/pipeline/rgbd/slam_pipeline.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <utility>
#include <vector>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/map_query.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {
namespace {

constexpr std::size_t kWalk = 24;
const std::vector<std::string> kSettings{"tsdf.voxel_size_m=0.06", "slam.rebuild_shift_voxel=0"};

/// A walk through the simulated room and the same way back, so that every place is seen twice.
class ThereAndBack final : public Recording {
 public:
  ThereAndBack() : simulation_(params()) {
    info_.camera = simulation_.camera();
    info_.frame_count = 2 * kWalk;
    for (std::size_t i = 0; i < info_.frame_count; ++i)
      info_.stamps.push_back(Time::from_seconds(0.2 * static_cast<double>(i + 1)));
    for (std::size_t i = 0; i < kWalk; ++i) frames_.push_back(simulation_.frame(i));
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    ++reads;
    RgbdFrame frame = frames_.at(index < kWalk ? index : 2 * kWalk - 1 - index);
    frame.index = index;
    frame.stamp = frame.color_stamp = info_.stamps[index];
    frame.T_world_camera.reset();
    return frame;
  }
  mutable std::atomic<int> reads = 0;

 private:
  static SimulationParams params() {
    SimulationParams params;
    params.world = WorldKind::kRoom;
    params.frame_limit = static_cast<int>(kWalk);
    return params;
  }
  Simulation simulation_;
  RecordingInfo info_;
  std::vector<RgbdFrame> frames_;
};

const ThereAndBack& recording() {
  static const ThereAndBack walk;
  return walk;
}

SlamPipeline run_frame_by_frame(const SlamInput& input, const RunContext& run = {}) {
  auto slam = SlamPipeline::create(input, kSettings, run);
  EXPECT_TRUE(slam) << to_string(slam.error());
  for (std::size_t i = 0; i < recording().info().frame_count; ++i) {
    RgbdFrame frame = recording().read(i).value();
    frame.index = 1000 + i;  // what a caller's frame says of itself does not matter
    const SlamStep step = slam->add(std::move(frame));
    EXPECT_TRUE(step.T_odom_camera) << i << ": " << step.reason;
    EXPECT_TRUE(step.T_map_camera) << i;
  }
  slam->finish();
  return std::move(*slam);
}

void expect_same_result(SlamPipeline& a, SlamPipeline& b) {
  ASSERT_EQ(a.trajectory().size(), b.trajectory().size());
  for (std::size_t i = 0; i < a.trajectory().size(); ++i) {
    EXPECT_EQ(a.trajectory()[i].stamp, b.trajectory()[i].stamp);
    EXPECT_EQ(a.trajectory()[i].T_world_base.matrix(), b.trajectory()[i].T_world_base.matrix()) << i;
  }
  EXPECT_EQ(a.dense().grid().volume_count(), b.dense().grid().volume_count());
  EXPECT_EQ(a.mesh().vertices, b.mesh().vertices);
}

/// The result is the recording's to the bit: trajectory, map and mesh.
TEST(SlamPipeline, FramesFromACallerGiveWhatARecordingGives) {
  RgbdParameters parameters;
  ASSERT_TRUE(apply_settings(list_slam(parameters), kSettings));
  SlamPipeline from_recording(recording(), parameters, {});
  from_recording.track_and_map();
  from_recording.close_loops();
  from_recording.level();
  ASSERT_TRUE(from_recording.correct_dense_map());
  ASSERT_GT(from_recording.counts().loops, 0u) << "nothing had to be read again";
  ASSERT_GT(from_recording.state().correction.frames, 0u);

  SlamPipeline slam = run_frame_by_frame({recording().camera()});
  const SlamCounts counts = slam.counts();
  EXPECT_EQ(counts.frames, 2 * kWalk);
  EXPECT_EQ(counts.frames_tracked, 2 * kWalk);
  EXPECT_EQ(counts.frames_lost, 0u);
  EXPECT_GT(counts.keyframes, 2u);
  EXPECT_GT(counts.loops, 0u);
  EXPECT_GT(counts.kept_bytes, 0u);
  EXPECT_LT(counts.kept_bytes, 2 * kWalk * 320 * 180 * 5 / 2) << "less than half of the pictures' size";
  EXPECT_EQ(slam.state().correction.frames_lost, 0u);
  expect_same_result(from_recording, slam);
}

RgbdParameters parameters_of_test() {
  RgbdParameters parameters;
  EXPECT_TRUE(apply_settings(list_slam(parameters), kSettings));
  return parameters;
}

void finish_recording(SlamPipeline& slam) {
  slam.close_loops();
  slam.level();
  EXPECT_TRUE(slam.correct_dense_map());
}

TEST(SlamPipeline, TheEndOnMoreThreadsGivesTheSame) {
  RunContext run;
  run.threads = 1;
  SlamPipeline one(recording(), parameters_of_test(), run), more(recording(), parameters_of_test(), run);
  for (SlamPipeline* slam : {&one, &more}) {
    slam->track_and_map();
    if (slam == &more) slam->set_threads(3);
    finish_recording(*slam);
  }
  ASSERT_GT(one.state().correction.frames, 0u) << "nothing was done in the end";
  EXPECT_EQ(more.dense().loop().threads(), 3);
  expect_same_result(one, more);
}

TEST(SlamPipeline, OdometrysMeshOfKeyframesAloneReadsOnlyThemAndShowsTheSameRoom) {
  SlamPipeline slam(recording(), parameters_of_test(), {});
  slam.track_and_map();
  slam.close_loops();
  slam.level();
  ASSERT_GT(slam.counts().loops, 0u);
  const auto measured = [&](bool keyframes_alone) {
    const int before = recording().reads;
    const TriangleMesh mesh = slam.mesh_of_odometry(keyframes_alone);
    return std::pair<int, Vec3>(recording().reads - before, bounds(mesh).sizes());
  };
  const auto [reads_of_all, size] = measured(false);
  const auto [reads, size_by_keyframes] = measured(true);
  EXPECT_EQ(reads_of_all, static_cast<int>(2 * kWalk));
  EXPECT_LE(reads, static_cast<int>(slam.counts().keyframes));
  EXPECT_GT(reads, 2);
  EXPECT_LT((size - size_by_keyframes).norm(), 0.2 * size.norm());
}

/// A run that was stopped before frame `cut`, as it comes back from its files.
SavedSlam stopped_before(std::size_t cut, const std::filesystem::path& folder) {
  std::stop_source stop;
  RunContext run;
  run.stop = stop.get_token();
  SlamPipeline slam(recording(), parameters_of_test(), run);
  EXPECT_TRUE(slam.can_be_saved());
  auto journal = SlamJournal::create(folder / kSlamJournalName).value();
  EXPECT_TRUE(slam.track_and_map([&](std::size_t next_frame) {
    journal.add(slam.last_frame());
    if (next_frame == cut) stop.request_stop();
    return Result<void>();
  }));
  EXPECT_TRUE(journal.flush());
  SlamCheckpoint checkpoint = slam.checkpoint(cut);
  checkpoint.journal = journal.mark();
  EXPECT_TRUE(write_file_bytes(folder / kSlamStateName, to_file_bytes(checkpoint)));
  auto saved = read_saved_slam(folder);
  EXPECT_TRUE(saved && *saved) << to_string(saved.error());
  return std::move(**saved);
}

/// Trajectory, keyframes, loops, graph, map and mesh to the bit, wherever the run was stopped.
TEST(SlamPipeline, ContinuesASavedRunAsIfItHadNotBeenInterrupted) {
  SlamPipeline whole(recording(), parameters_of_test(), {});
  ASSERT_TRUE(whole.track_and_map());
  finish_recording(whole);
  ASSERT_GT(whole.counts().loops, 0u);
  for (const std::size_t cut : {std::size_t{1}, std::size_t{14}, kWalk, 2 * kWalk - 9, 2 * kWalk}) {
    SCOPED_TRACE(cut);
    const TemporaryFolder folder;
    const SavedSlam saved = stopped_before(cut, folder.path());
    SlamPipeline slam(recording(), parameters_of_test(), {});
    const auto resumed = slam.resume(saved);
    ASSERT_TRUE(resumed) << to_string(resumed.error());
    EXPECT_FALSE(slam.map_is_complete());
    ASSERT_TRUE(slam.track_and_map());
    finish_recording(slam);
    expect_same_result(whole, slam);
    const SlamCounts ours = slam.counts(), theirs = whole.counts();
    EXPECT_EQ(ours.frames, theirs.frames);
    EXPECT_EQ(ours.keyframes, theirs.keyframes);
    EXPECT_EQ(ours.loops, theirs.loops);
    EXPECT_EQ(slam.state().frames_mapped, whole.state().frames_mapped);
    ASSERT_EQ(slam.state().graph.edges.size(), whole.state().graph.edges.size());
    for (std::size_t i = 0; i < slam.state().graph.edges.size(); ++i)
      EXPECT_EQ(slam.state().graph.edges[i].T_from_to.matrix(),
                whole.state().graph.edges[i].T_from_to.matrix());
  }
}

TEST(SlamPipeline, RefusesADamagedStateOfOdometryInWords) {
  const TemporaryFolder folder;
  SavedSlam saved = stopped_before(kWalk, folder.path());
  const std::vector<std::uint8_t> whole = saved.checkpoint.odometry;
  for (std::size_t size = 0; size < whole.size(); size += whole.size() / 23 + 1) {
    saved.checkpoint.odometry.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    SlamPipeline slam(recording(), parameters_of_test(), {});
    const auto resumed = slam.resume(saved);
    ASSERT_FALSE(resumed) << size;
    EXPECT_FALSE(resumed.error().message.empty());
  }
  saved.checkpoint.odometry = whole;
  saved.checkpoint.odometry.push_back(0);
  EXPECT_FALSE(SlamPipeline(recording(), parameters_of_test(), {}).resume(saved));
  saved.checkpoint.odometry = whole;
  for (TrackedRecord& record : saved.records) record.keyframe.reset();
  EXPECT_FALSE(SlamPipeline(recording(), parameters_of_test(), {}).resume(saved)) << "its keyframes are gone";
}

TEST(SlamPipeline, ReadsFramesAgainFromTheCallersOwnSource) {
  SlamInput input{recording().camera()};
  input.frames = &recording();
  const int reads_before = recording().reads;
  SlamPipeline slam = run_frame_by_frame(input);
  EXPECT_EQ(slam.counts().kept_bytes, 0u);
  EXPECT_GT(recording().reads - reads_before, static_cast<int>(2 * kWalk)) << "the map was made again";
  EXPECT_EQ(slam.state().correction.frames_lost, 0u);
}

TEST(SlamPipeline, CountsFramesThatItsCapDoesNotLetItKeep) {
  SlamInput input{recording().camera()};
  input.max_kept_bytes = 1'000'000;
  std::vector<std::string> said;
  RunContext run;
  run.log = [&](LogLevel, const std::string& text) { said.push_back(text); };
  SlamPipeline slam = run_frame_by_frame(input, run);
  EXPECT_LE(slam.counts().kept_bytes, 1'000'000u);
  EXPECT_GT(slam.counts().frames_not_kept, 0u);
  EXPECT_EQ(slam.state().correction.frames_lost, slam.counts().frames_not_kept);
  ASSERT_EQ(said.size(), 1u) << "once, not for every frame";
  EXPECT_NE(said[0].find("max_kept_bytes"), std::string::npos) << said[0];
}

TEST(SlamPipeline, RefusesSettingsThatAreNone) {
  const PinholeCamera camera = recording().camera();
  const auto unknown = SlamPipeline::create({camera}, {"tsdf.voxel_size=0.05"});
  ASSERT_FALSE(unknown);
  EXPECT_NE(to_string(unknown.error()).find("tsdf.voxel_size_m"), std::string::npos)
      << to_string(unknown.error());
  EXPECT_FALSE(SlamPipeline::create({camera}, {"tsdf.voxel_size_m=-1"}));
  EXPECT_FALSE(SlamPipeline::create({camera}, {"matcher.max_iterations=3"})) << "a laser's";
}

TEST(SlamPipeline, SkipsFramesThatCannotBeUsedAndSaysWhy) {
  auto slam = SlamPipeline::create({recording().camera()}, kSettings);
  ASSERT_TRUE(slam);
  RgbdFrame small = recording().read(0).value();
  small.depth.units = Image<std::uint16_t>(16, 16);  // not of the camera's size
  const SlamStep step = slam->add(std::move(small));
  EXPECT_EQ(step.status, TrackingStatus::kSkipped);
  EXPECT_FALSE(step.T_odom_camera);
  EXPECT_FALSE(step.reason.empty());
  EXPECT_TRUE(slam->add(recording().read(0).value()).T_map_camera);
  slam->finish();
  EXPECT_EQ(slam->trajectory().size(), 1u);
  EXPECT_GT(MapQuery(slam->dense().grid()).volume_count(), 0u);
}

}  // namespace
}  // namespace hm
