#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "hm/core/hash.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

std::shared_ptr<const Keyframe> small_keyframe(std::size_t index) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->frame_index = index;
  keyframe->stamp = Time::from_seconds(0.1 * static_cast<double>(index + 1));
  keyframe->T_odom_camera = SE3::exp((Vec6() << 0.3, 0.1, 1.0 / 3.0, 0.01, 0.02, 0.03).finished());
  Feature with_depth;
  with_depth.pixel = {10.25, 20.5};
  with_depth.descriptor = {1, 2, 3, ~std::uint64_t{0}};
  with_depth.has_depth = true;
  with_depth.p_camera = {0.1, 0.2, 1.5};
  with_depth.covariance = 1e-5 * Mat3::Identity();
  keyframe->features = {with_depth, Feature{}};
  keyframe->motion_covariance = 1e-6 * Mat6::Identity();
  keyframe->observations = {{7, {1, 2}, Eigen::Matrix2d::Identity(), 1.25, 1e-4}};
  keyframe->before = RefinedObservations{index / 2, keyframe->observations};
  return keyframe;
}

/// A frame that is a keyframe, one that is not, one that is lost, one that could not be read, and a keyframe.
std::vector<TrackedRecord> small_run() {
  std::vector<TrackedRecord> records(5);
  for (std::size_t i = 0; i < records.size(); ++i) {
    TrackedRecord& record = records[i];
    record.index = 2 * i;
    record.was_read = i != 3;
    record.stamp = Time::from_seconds(0.1 * static_cast<double>(2 * i + 1));
    if (i == 2 || i == 3) {
      record.status = i == 2 ? TrackingStatus::kLost : TrackingStatus::kSkipped;
      record.reason = "why";
      continue;
    }
    record.status = TrackingStatus::kTracked;
    record.is_mapped = true;
    record.T_odom_camera = SE3::exp((Vec6() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
    record.sigma_m = 0.001 * static_cast<double>(i);
    record.numbers.features = 321;
    record.numbers.gravity = GravityUse::kRejected;
    if (i != 1) record.keyframe = small_keyframe(2 * i);
  }
  return records;
}

SlamCheckpoint small_checkpoint() {
  SlamCheckpoint checkpoint;
  checkpoint.program_version = "1.2";
  checkpoint.first_stamp = Time::from_seconds(0.1);
  checkpoint.recording_frames = 20;
  checkpoint.camera = {320, 240, 262.5, 262.25, 159.5, 119.5, {}};
  checkpoint.parameters_toml = "[slam]\n";
  checkpoint.next_frame = 9;
  checkpoint.places = {{0, 0, SE3()}, {8, 1, SE3::exp((Vec6() << 1, 2, 3, 0, 0, 1).finished())}};
  checkpoint.odometry = {1, 2, 3};
  return checkpoint;
}

JournalMark write_journal(const std::filesystem::path& path, const std::vector<TrackedRecord>& records) {
  auto journal = SlamJournal::create(path).value();
  for (const TrackedRecord& record : records) journal.add(record);
  EXPECT_TRUE(journal.flush());
  return journal.mark();
}

std::vector<std::uint8_t> state_of(TrackedRecord record) {
  StateWriter writer;
  writer(record);
  return writer.take();
}

TEST(SlamCheckpoint, ComesBackAsItWasWritten) {
  const auto bytes = to_file_bytes(small_checkpoint());
  const auto read = parse_slam_checkpoint(bytes, "state");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->program_version, "1.2");
  EXPECT_EQ(read->camera.fy, 262.25);
  EXPECT_EQ(read->next_frame, 9u);
  ASSERT_EQ(read->places.size(), 2u);
  EXPECT_EQ(read->places[1].map, 1);
  EXPECT_EQ(read->odometry, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_EQ(to_file_bytes(*read), bytes) << "all of it";
}

TEST(SlamCheckpoint, EveryPrefixAndEveryFlippedBitIsRefusedInWords) {
  const auto bytes = to_file_bytes(small_checkpoint());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto read = parse_slam_checkpoint(std::span(bytes).first(size), "state");
    ASSERT_FALSE(read) << size;
    EXPECT_FALSE(read.error().message.empty());
  }
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      auto changed = bytes;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ (1U << bit));
      EXPECT_FALSE(parse_slam_checkpoint(changed, "state")) << at << ", bit " << bit;
    }
  auto longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(parse_slam_checkpoint(longer, "state"));
}

TEST(SlamCheckpoint, AnotherVersionIsSaidToBeOne) {
  auto bytes = to_file_bytes(small_checkpoint());
  bytes[8] = 9;
  const auto read = parse_slam_checkpoint(bytes, "state");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(read.error().message.find("version 9"), std::string::npos) << read.error().message;
}

/// With the right checksum, so that the contents themselves are looked at.
TEST(SlamCheckpoint, ContentsThatCannotBeAreRefused) {
  SlamCheckpoint checkpoint = small_checkpoint();
  checkpoint.places[0].T_map_camera = SE3(Mat3::Identity(), Vec3(0, std::nan(""), 0));
  EXPECT_FALSE(parse_slam_checkpoint(to_file_bytes(checkpoint), "state"));
  checkpoint = small_checkpoint();
  checkpoint.camera.fx = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(parse_slam_checkpoint(to_file_bytes(checkpoint), "state"));
  checkpoint.camera.fx = -1;
  EXPECT_FALSE(parse_slam_checkpoint(to_file_bytes(checkpoint), "state"));
}

TEST(SlamJournal, ComesBackAsItWasWritten) {
  const TemporaryFolder folder;
  const auto records = small_run();
  const JournalMark mark = write_journal(folder / "j", records);
  EXPECT_EQ(mark.frames, records.size());
  const auto read = read_slam_journal(folder / "j", mark);
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->size(), records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(state_of((*read)[i]), state_of(records[i])) << i;
    EXPECT_EQ((*read)[i].keyframe != nullptr, records[i].keyframe != nullptr) << i;
  }
  EXPECT_EQ((*read)[0].keyframe->features[0].descriptor, records[0].keyframe->features[0].descriptor);
}

TEST(SlamJournal, ContinuesBehindTheMarkAsIfNothingHadBeen) {
  const TemporaryFolder folder;
  const auto records = small_run();
  const JournalMark whole = write_journal(folder / "whole", records);
  const JournalMark first = write_journal(folder / "j", {records.begin(), records.begin() + 2});
  {
    auto lost = SlamJournal::continue_at(folder / "j", first).value();  // of a run that was killed
    lost.add(records[2]);
    ASSERT_TRUE(lost.flush());
  }
  EXPECT_EQ(read_slam_journal(folder / "j", first).value().size(), 2u) << "what stands behind does not count";
  auto journal = SlamJournal::continue_at(folder / "j", first).value();
  for (std::size_t i = 2; i < records.size(); ++i) journal.add(records[i]);
  ASSERT_TRUE(journal.flush());
  EXPECT_EQ(journal.mark(), whole);
  EXPECT_EQ(read_file_bytes(folder / "j").value(), read_file_bytes(folder / "whole").value());
}

TEST(SlamJournal, EveryPrefixAndEveryChangedByteIsRefusedInWords) {
  const TemporaryFolder folder;
  const JournalMark mark = write_journal(folder / "j", small_run());
  const auto bytes = read_file_bytes(folder / "j").value();
  ASSERT_EQ(bytes.size(), mark.bytes);
  const auto refused = [&](std::span<const std::uint8_t> changed, const JournalMark& with) {
    EXPECT_TRUE(write_file_bytes(folder / "changed", changed, Durability::kLater));
    const auto read = read_slam_journal(folder / "changed", with);
    return !read && !read.error().message.empty();
  };
  const auto step = static_cast<std::size_t>(test::kSanitized ? 5 : 1);
  for (std::size_t size = 0; size < bytes.size(); size += step) {
    EXPECT_TRUE(refused(std::span(bytes).first(size), mark)) << size;
    JournalMark shorter = mark;
    shorter.bytes = size;
    EXPECT_TRUE(refused(bytes, shorter)) << "a mark at byte " << size;
  }
  for (std::size_t at = 0; at < bytes.size(); at += step) {
    auto changed = bytes;
    changed[at] = static_cast<std::uint8_t>(changed[at] ^ (1U << (at % 8)));
    if (at >= 12 && at < 16) continue;  // not used
    EXPECT_TRUE(refused(changed, mark)) << at;
  }
}

TEST(SlamJournal, RecordsThatDoNotBelongTogetherAreRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::vector<TrackedRecord>& records) {
    const JournalMark mark = write_journal(folder / "j", records);
    return !read_slam_journal(folder / "j", mark);
  };
  auto records = small_run();
  std::swap(records[0], records[1]);
  EXPECT_TRUE(refused(records)) << "not in order";
  records = small_run();
  records[4].stamp = records[0].stamp;
  EXPECT_TRUE(refused(records)) << "time goes back";
  records = small_run();
  records[4].keyframe = small_keyframe(2);
  EXPECT_TRUE(refused(records)) << "of another frame";
  records = small_run();
  records[0].T_odom_camera.reset();
  EXPECT_TRUE(refused(records)) << "a keyframe without a pose";
  records = small_run();
  records[1].sigma_m = std::nan("");
  EXPECT_TRUE(refused(records)) << "no number";
  const auto other = write_journal(folder / "other", {small_run()[0], small_run()[1]});
  const auto mark = write_journal(folder / "j", {small_run()[0], small_run()[4]});
  EXPECT_FALSE(read_slam_journal(folder / "j", {mark.bytes, mark.frames, other.digest})) << "another run's";
}

TEST(SavedSlam, SaysHowToStartAnew) {
  const TemporaryFolder folder;
  EXPECT_FALSE(read_saved_slam(folder.path()).value()) << "there is none";
  SlamCheckpoint checkpoint = small_checkpoint();
  checkpoint.journal = write_journal(folder / kSlamJournalName, small_run());
  ASSERT_TRUE(write_file_bytes(folder / kSlamStateName, to_file_bytes(checkpoint)));
  const auto saved = read_saved_slam(folder.path());
  ASSERT_TRUE(saved && *saved) << to_string(saved.error());
  EXPECT_EQ((*saved)->records.size(), 5u);
  std::filesystem::resize_file(folder / kSlamJournalName, checkpoint.journal.bytes - 1);
  const auto cut = read_saved_slam(folder.path());
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("--overwrite"), std::string::npos) << cut.error().message;
  std::filesystem::remove(folder / kSlamJournalName);
  EXPECT_FALSE(read_saved_slam(folder.path()));
}

}  // namespace
}  // namespace hm
