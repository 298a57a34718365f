#include "hm/io/rgbd/tum_writer.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "hm/io/testing/testing_recordings.hpp"

namespace hm {
namespace {

using testing_recordings::kSmallCamera;
using testing_recordings::small_frame;

constexpr double kUnits = 5000;

RgbdFrame without_pose(std::size_t i) {
  RgbdFrame frame = small_frame(i);
  frame.T_world_camera.reset();
  return frame;
}

void append(const std::filesystem::path& folder, std::size_t begin, std::size_t end,
            PngEffort effort = PngEffort::kFast) {
  auto writer = TumWriter::append(folder, kSmallCamera, kUnits);
  ASSERT_TRUE(writer) << to_string(writer.error());
  for (std::size_t i = begin; i < end; ++i) ASSERT_TRUE(writer->add(without_pose(i), effort));
  ASSERT_TRUE(writer->finish());
}

void expect_recording(const std::filesystem::path& folder, std::size_t frames) {
  const auto recording = open_recording(folder);
  ASSERT_TRUE(recording) << to_string(recording.error());
  ASSERT_EQ((*recording)->info().frame_count, frames);
  EXPECT_EQ((*recording)->info().paired_count, frames);
  for (std::size_t i = 0; i < frames; ++i) {
    const auto read = (*recording)->read(i);
    ASSERT_TRUE(read);
    const RgbdFrame written = small_frame(i);
    EXPECT_EQ(read->stamp, written.stamp);
    EXPECT_TRUE(std::ranges::equal(read->color.pixels(), written.color.pixels()));
    EXPECT_TRUE(std::ranges::equal(read->depth.units.pixels(), written.depth.units.pixels()));
  }
}

TEST(TumWriterAppend, AGrowingRecordingIsWholeBeforeItsEnd) {
  const TemporaryFolder folder;
  auto writer = TumWriter::append(folder / "r", kSmallCamera, kUnits);
  ASSERT_TRUE(writer);
  EXPECT_FALSE(writer->last_stamp());
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(writer->add(without_pose(i)));
    expect_recording(folder / "r", i + 1);  // as after a kill
  }
  EXPECT_EQ(writer->last_stamp(), small_frame(2).stamp);
}

TEST(TumWriterAppend, ContinuesARecording) {
  const TemporaryFolder folder;
  append(folder / "r", 0, 2);
  append(folder / "r", 2, 3, PngEffort::kStored);
  append(folder / "r", 3, 3);
  append(folder / "r", 3, 5);
  expect_recording(folder / "r", 5);
}

/// Whatever a kill cuts off the lists, what is continued is a recording of the frames before.
TEST(TumWriterAppend, EveryCutOfTheListIsContinued) {
  const TemporaryFolder folder;
  append(folder / "whole", 0, 3);
  const auto size = std::filesystem::file_size(folder / "whole" / "depth.txt");
  const std::string first_line = "# depth maps\n# timestamp filename\n";
  for (auto left = static_cast<std::uintmax_t>(first_line.size()); left <= size; ++left) {
    SCOPED_TRACE(left);
    const auto copy = folder / ("cut" + std::to_string(left));
    std::filesystem::copy(folder / "whole", copy, std::filesystem::copy_options::recursive);
    std::filesystem::resize_file(copy / "depth.txt", left);
    std::filesystem::resize_file(copy / "rgb.txt",
                                 std::min(left, std::filesystem::file_size(copy / "rgb.txt")));
    auto writer = TumWriter::append(copy, kSmallCamera, kUnits);
    ASSERT_TRUE(writer) << to_string(writer.error());
    std::size_t next = 0;
    while (writer->last_stamp() && small_frame(next).stamp <= *writer->last_stamp()) ++next;
    for (std::size_t i = next; i < 4; ++i) ASSERT_TRUE(writer->add(without_pose(i)));
    expect_recording(copy, 4);
    std::filesystem::remove_all(copy);
  }
}

TEST(TumWriterAppend, RefusesAnotherCameraAndStampsThatDoNotIncrease) {
  const TemporaryFolder folder;
  append(folder / "r", 0, 2);
  PinholeCamera other = kSmallCamera;
  other.fx += 1;
  const auto refused = TumWriter::append(folder / "r", other, kUnits);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_FALSE(TumWriter::append(folder / "r", kSmallCamera, 1000));
  auto writer = TumWriter::append(folder / "r", kSmallCamera, kUnits);
  ASSERT_TRUE(writer);
  EXPECT_FALSE(writer->add(without_pose(1)));
  EXPECT_TRUE(writer->add(without_pose(2)));
}

TEST(TumWriterAppend, UnsyncedFilesAreNamedOnce) {
  const TemporaryFolder folder;
  auto writer = TumWriter::append(folder / "r", kSmallCamera, kUnits);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add(without_pose(0)));
  const auto files = writer->take_unsynced();
  EXPECT_EQ(files.size(), 6U) << "two images, two folders, two lists";
  EXPECT_TRUE(sync_files(files));
  EXPECT_EQ(writer->take_unsynced().size(), 2U) << "the lists";
  EXPECT_FALSE(sync_files({folder / "nowhere"}));
}

TEST(TumWriterAppend, AFrameIsReadBackToTheBit) {
  const TemporaryFolder folder;
  append(folder / "r", 0, 2, PngEffort::kStored);
  RgbdFrame written = small_frame(1);
  const auto read = read_written_frame(folder / "r", written);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(std::ranges::equal(read->depth.units.pixels(), written.depth.units.pixels()));
  EXPECT_TRUE(std::ranges::equal(read->color.pixels(), written.color.pixels()));
  EXPECT_EQ(read->depth.unit_m, written.depth.unit_m);
  written.stamp.ns += 1;
  EXPECT_FALSE(read_written_frame(folder / "r", written));
}

}  // namespace
}  // namespace hm
