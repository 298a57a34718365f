#include "hm/pipeline/rgbd/resume/earlier_map.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {
namespace {

constexpr std::size_t kFrames = 24;

/// A walk through a simulated building, or the same frames in the opposite order. Both begin at 0.2 s.
class SimulatedWalk final : public Recording {
 public:
  enum class Way { kThere, kBack };
  SimulatedWalk(WorldKind world, Way way) {
    SimulationParams params;
    params.world = world;
    params.frame_limit = static_cast<int>(kFrames);
    const Simulation simulation(params);
    info_.camera = simulation.camera();
    info_.frame_count = kFrames;
    for (std::size_t i = 0; i < kFrames; ++i) {
      info_.stamps.push_back(Time::from_seconds(0.2 * static_cast<double>(i + 1)));
      frames_.push_back(simulation.frame(way == Way::kThere ? i : kFrames - 1 - i));
      frames_.back().stamp = frames_.back().color_stamp = info_.stamps.back();
      frames_.back().index = i;
      frames_.back().T_world_camera.reset();
    }
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override { return frames_.at(index); }
  void widen() { info_.camera.fx += 1; }

 private:
  RecordingInfo info_;
  std::vector<RgbdFrame> frames_;
};

const SimulatedWalk& walk_there() {
  static const SimulatedWalk walk(WorldKind::kRoom, SimulatedWalk::Way::kThere);
  return walk;
}

/// Tracks a whole recording; returns its records.
std::vector<TrackedRecord> track(SlamPipeline& slam) {
  std::vector<TrackedRecord> records;
  EXPECT_TRUE(slam.track_and_map([&](std::size_t) {
    records.push_back(slam.last_frame());
    return Result<void>();
  }));
  return records;
}

/// The state of the walk there, as a run saves it.
std::vector<TrackedRecord> save_walk_there(const std::filesystem::path& folder) {
  SlamPipeline slam(walk_there(), RgbdParameters(), {});
  const auto records = track(slam);
  auto journal = SlamJournal::create(folder / kSlamJournalName).value();
  for (const TrackedRecord& record : records) journal.add(record);
  EXPECT_TRUE(journal.flush());
  SlamCheckpoint checkpoint = slam.checkpoint(kFrames);
  checkpoint.journal = journal.mark();
  checkpoint.first_stamp = walk_there().info().stamps.front();
  checkpoint.recording_frames = kFrames;
  checkpoint.sessions = {MapSession::of("gone", {}, kFrames)};
  EXPECT_TRUE(write_file_bytes(folder / kSlamStateName, to_file_bytes(checkpoint)));
  return records;
}

/// One saved walk for all tests.
class EarlierMapOfARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    records_ = save_walk_there(folder_->path());
  }
  static void TearDownTestSuite() {
    folder_.reset();
    records_.clear();
  }
  static std::unique_ptr<TemporaryFolder> folder_;
  static std::vector<TrackedRecord> records_;
};
std::unique_ptr<TemporaryFolder> EarlierMapOfARoom::folder_;
std::vector<TrackedRecord> EarlierMapOfARoom::records_;

/// The way back has the images of the way there in the opposite order: so must be its poses in the saved map.
TEST_F(EarlierMapOfARoom, ANewRecordingGoesOnInItsFrame) {
  const SimulatedWalk back(WorldKind::kRoom, SimulatedWalk::Way::kBack);
  const auto earlier = read_earlier_map(folder_->path(), back, 0);
  ASSERT_TRUE(earlier) << to_string(earlier.error());
  ASSERT_EQ(earlier->warnings.size(), 1u) << "its recording is gone";
  EXPECT_LT(earlier->records.back().stamp, back.info().stamps.front()) << "both clocks begin alike";
  SlamPipeline slam(back, RgbdParameters(), {}, &*earlier);
  const TemporaryFolder joined;
  auto joined_state = JoinedState::begin(*earlier, joined.path()).value();
  std::vector<std::uintmax_t> journal_bytes;
  EXPECT_TRUE(slam.track_and_map([&](std::size_t) {
    const auto added = joined_state.add(slam.last_frame());
    journal_bytes.push_back(std::filesystem::file_size(joined / kSlamJournalName));
    return added;
  }));
  EXPECT_LT(journal_bytes.front() + 100'000, journal_bytes.back()) << "frames go to disk as they come";
  SlamCheckpoint checkpoint = slam.checkpoint(kFrames);
  slam.close_loops();
  const SlamState& state = slam.state();
  ASSERT_TRUE(state.continued);
  ASSERT_TRUE(state.continued->recognised_at_s);
  EXPECT_LT(*state.continued->recognised_at_s, 0.2 * kFrames);
  EXPECT_GE(state.continued->loops, 2u) << "one loop alone is not believed";
  EXPECT_GE(state.continued->best.inliers, state.continued->inliers_needed);
  ASSERT_EQ(state.corrected.size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const SE3 error = records_[kFrames - 1 - i].T_odom_camera->inverse() * state.corrected[i].T_world_base;
    EXPECT_LT(error.translation().norm(), 0.05) << i;
    EXPECT_LT(error.angle(), 0.03) << i;
  }
  // The joined map is one to come back to, too.
  checkpoint.first_stamp = back.info().stamps.front();
  checkpoint.recording_frames = kFrames;
  checkpoint.places = keyframe_places(*state.keyframes);
  checkpoint.sessions = {MapSession::of("back", {}, kFrames)};
  ASSERT_TRUE(joined_state.finish(checkpoint));
  const auto again = read_earlier_map(joined.path(), walk_there(), 0);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->frame_count(), 2 * kFrames);
  ASSERT_EQ(again->records.size(), 2 * kFrames);
  EXPECT_EQ(again->keyframes().size(), state.graph.T_map_node.size());
  EXPECT_EQ(again->sessions[1].recording, MapSession::of("back", {}, kFrames).recording);
  for (std::size_t i = 0; i < 2 * kFrames; ++i) EXPECT_EQ(again->records[i].index, kFrames + i);
}

TEST_F(EarlierMapOfARoom, AFullDiskIsKnownBeforeTheEnd) {
  const SimulatedWalk back(WorldKind::kRoom, SimulatedWalk::Way::kBack);
  const auto earlier = read_earlier_map(folder_->path(), back, 0);
  ASSERT_TRUE(earlier) << to_string(earlier.error());
  const TemporaryFolder joined;
  const auto before = std::filesystem::file_size(folder_->path() / kSlamJournalName);
  const pid_t child = ::fork();
  if (child == 0) {
    auto state = JoinedState::begin(*earlier, joined.path()).value();
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{before + 20'000, before + 20'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::size_t added = 0;
    while (added < records_.size() && state.add(records_[added])) ++added;
    ::_exit(added + 1 < records_.size() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST_F(EarlierMapOfARoom, AnotherBuildingIsNotTakenForIt) {
  const SimulatedWalk corridor(WorldKind::kCorridor, SimulatedWalk::Way::kThere);
  const auto earlier = read_earlier_map(folder_->path(), corridor, 0);
  ASSERT_TRUE(earlier) << to_string(earlier.error());
  SlamPipeline slam(corridor, RgbdParameters(), {}, &*earlier);
  track(slam);
  slam.close_loops();
  ASSERT_TRUE(slam.state().continued);
  EXPECT_FALSE(slam.state().continued->recognised_at_s);
  EXPECT_EQ(slam.state().continued->loops, 0u);
  EXPECT_GT(slam.state().continued->inliers_needed, 0);
  EXPECT_TRUE(slam.state().corrected.empty());
}

TEST_F(EarlierMapOfARoom, WhatCannotBeContinuedIsRefusedInWords) {
  const TemporaryFolder copy;
  const auto state = read_file_bytes(*folder_ / kSlamStateName).value();
  const auto journal = read_file_bytes(*folder_ / kSlamJournalName).value();
  const auto refused = [&](const std::vector<std::uint8_t>& state_bytes,
                           const std::vector<std::uint8_t>& journal_bytes) {
    EXPECT_TRUE(write_file_bytes(copy / kSlamStateName, state_bytes));
    EXPECT_TRUE(write_file_bytes(copy / kSlamJournalName, journal_bytes));
    const auto read = read_earlier_map(copy.path(), walk_there(), 0);
    return read ? Error{ErrorCode::kInternal, "it was read", {}} : read.error();
  };
  EXPECT_EQ(read_earlier_map(copy.path(), walk_there(), 0).error().code, ErrorCode::kNotFound);
  auto other_version = state;
  other_version[8] = 2;
  const Error version = refused(other_version, journal);
  EXPECT_EQ(version.code, ErrorCode::kUnsupported);
  EXPECT_NE(version.message.find("version 2"), std::string::npos) << version.message;
  EXPECT_NE(version.message.find("cannot be continued"), std::string::npos) << version.message;
  auto damaged = state;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_EQ(refused(damaged, journal).code, ErrorCode::kCorrupted);
  damaged = journal;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_EQ(refused(state, damaged).code, ErrorCode::kCorrupted);
  EXPECT_EQ(refused(state, {journal.begin(), journal.end() - 1}).code, ErrorCode::kCorrupted);
  SimulatedWalk wider(WorldKind::kRoom, SimulatedWalk::Way::kBack);
  wider.widen();
  const auto camera = read_earlier_map(folder_->path(), wider, 0);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::kUsage);
}

}  // namespace
}  // namespace hm
