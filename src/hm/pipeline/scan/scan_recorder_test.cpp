#include "hm/pipeline/scan/scan_recorder.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "hm/io/testing/testing_recordings.hpp"
#include "hm/pipeline/scan/scan_frames.hpp"

namespace hm {
namespace {

using testing_recordings::kSmallCamera;

std::shared_ptr<const RgbdFrame> frame(std::size_t i) {
  auto frame = std::make_shared<RgbdFrame>(testing_recordings::small_frame(i));
  frame->T_world_camera.reset();
  return frame;
}

TumWriter writer(const std::filesystem::path& folder) {
  auto made = TumWriter::append(folder, kSmallCamera, 5000);
  EXPECT_TRUE(made);
  return std::move(*made);
}

std::size_t frames_in(const std::filesystem::path& folder) {
  const auto recording = open_recording(folder);
  return recording ? (*recording)->info().frame_count : 0;
}

TEST(ScanRecorder, EveryFrameIsRecordedOrCounted) {
  const TemporaryFolder folder;
  ScanRecorder recorder(writer(folder / "r"), 4);
  for (std::size_t i = 0; i < 200; ++i) recorder.offer(frame(i));  // faster than any disk
  ASSERT_TRUE(recorder.finish());
  const RecorderCounts counts = recorder.counts();
  EXPECT_EQ(counts.recorded + counts.queue_full, 200U);
  EXPECT_EQ(counts.failed, 0U);
  EXPECT_GE(counts.recorded, 4U);
  EXPECT_EQ(frames_in(folder / "r"), counts.recorded);
}

TEST(ScanRecorder, FallsBackToStoringBeforeItLosesAFrame) {
  const TemporaryFolder folder;
  ScanRecorder recorder(writer(folder / "r"), 1000);
  for (std::size_t i = 0; i < 100; ++i) recorder.offer(frame(i));
  ASSERT_TRUE(recorder.finish());
  EXPECT_EQ(recorder.counts().recorded, 100U);
  EXPECT_GT(recorder.counts().uncompressed, 50U);
  EXPECT_EQ(frames_in(folder / "r"), 100U);
}

TEST(ScanRecorder, AFailureIsCountedAndNamed) {
  const TemporaryFolder folder;
  ScanRecorder recorder(writer(folder / "r"));
  recorder.offer(frame(0));
  recorder.wait_for(frame(0)->stamp);
  std::filesystem::remove_all(folder / "r" / "depth");  // as a disk that goes away
  recorder.offer(frame(1));
  recorder.offer(frame(2));
  const auto finished = recorder.finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(recorder.counts().failed, 2U);
  EXPECT_EQ(recorder.counts().failure, to_string(finished.error()));
}

/// SLAM asks for frames that were tracked a moment ago: a loop has moved them.
TEST(ScanFrames, GiveBackWhatMayStillBeOnItsWayToTheDisk) {
  const TemporaryFolder folder;
  ScanRecorder recorder(writer(folder / "r"), 1000);
  ScanFrames frames(folder / "r", kSmallCamera, [&](Time stamp) { recorder.wait_for(stamp); });
  for (std::size_t i = 0; i < 40; ++i) {
    recorder.offer(frame(i));
    if (i % 2 == 0) frames.add(*frame(i));  // of every other one SLAM had no time
  }
  std::thread reader([&] {
    for (std::size_t number = 0; number < 20; ++number) {
      const auto read = frames.read(number);
      ASSERT_TRUE(read) << to_string(read.error());
      EXPECT_EQ(read->index, number);
      EXPECT_EQ(read->stamp, frame(2 * number)->stamp);
      EXPECT_TRUE(std::ranges::equal(read->depth.units.pixels(), frame(2 * number)->depth.units.pixels()));
      EXPECT_FALSE(read->color.empty());
      const auto depth = frames.read_depth(number);
      ASSERT_TRUE(depth) << to_string(depth.error());
      EXPECT_EQ(depth->index, number);
      EXPECT_TRUE(std::ranges::equal(depth->depth.units.pixels(), read->depth.units.pixels()));
      EXPECT_TRUE(depth->color.empty());
    }
  });
  reader.join();
  ASSERT_TRUE(recorder.finish());
  ASSERT_TRUE(frames.complete());
  EXPECT_EQ(frames.info().frame_count, 20U);
  EXPECT_EQ(frames.info().stamps.at(19), frame(38)->stamp);
  EXPECT_EQ(frames.camera().fx, kSmallCamera.fx);
}

}  // namespace
}  // namespace hm
