#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <new>
#include <thread>

#include "hm/io/rgbd/recording.hpp"

namespace hm {
namespace {

/// Frames that exist only as numbers; every seventh cannot be read.
class CountingRecording final : public Recording {
 public:
  explicit CountingRecording(std::size_t frames) { info_.frame_count = frames; }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    ++reads;
    if (index % 7 == 6) return fail(ErrorCode::kCorrupted, "frame", "number {}", index);
    RgbdFrame frame;
    frame.index = index;
    return frame;
  }
  mutable std::atomic<int> reads = 0;

 private:
  RecordingInfo info_;
};

TEST(FramePrefetcher, GivesEveryFrameInOrderAndItsErrors) {
  for (const auto& [begin, end, stride] : std::vector<std::array<std::size_t, 3>>{
           {0, 50, 1}, {3, 40, 4}, {45, 1000, 1}, {5, 5, 1}, {0, 50, 1000}}) {
    const CountingRecording recording(50);
    for (const int readers : {1, 3}) {
      FramePrefetcher frames(recording, begin, end, stride, {.ahead = 3, .readers = readers});
      for (std::size_t i = begin; i < std::min<std::size_t>(end, 50); i += stride) {
        const auto frame = frames.next();
        ASSERT_TRUE(frame);
        if (i % 7 == 6) {
          EXPECT_EQ(frame->error().message, fmt::format("number {}", i));
        } else {
          ASSERT_TRUE(*frame);
          EXPECT_EQ((*frame)->index, i);
        }
      }
      EXPECT_FALSE(frames.next());
      EXPECT_FALSE(frames.next());
    }
  }
}

TEST(FramePrefetcher, HoldsAtMostSoManyFrames) {
  const CountingRecording recording(100);
  FramePrefetcher frames(recording, 0, 100, 1, {.ahead = 5, .readers = 3});
  for (int taken = 0; taken < 20; ++taken) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_LE(recording.reads.load(), taken + 5);
    ASSERT_TRUE(frames.next());
  }
}

/// Frames of which one takes longer to read than all others, and another has no memory.
class UnevenRecording final : public Recording {
 public:
  UnevenRecording(std::size_t frames, std::size_t slow, std::size_t throws) : slow_(slow), throws_(throws) {
    info_.frame_count = frames;
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    if (index == throws_) throw std::bad_alloc();
    if (index == slow_) {
      for (int i = 0; i < 5000 && after_slow < 2; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      read_meanwhile = after_slow.load();
    }
    if (index > slow_) ++after_slow;
    RgbdFrame frame;
    frame.index = index;
    return frame;
  }
  mutable std::atomic<int> after_slow = 0, read_meanwhile = 0;

 private:
  std::size_t slow_, throws_;
  RecordingInfo info_;
};

TEST(FramePrefetcher, ReadsOnWhileOneFrameTakesLong) {
  const UnevenRecording recording(10, 3, 100);
  FramePrefetcher frames(recording, 0, 10, 1, {.ahead = 4, .readers = 2});
  for (std::size_t i = 0; i < 10; ++i) {
    const auto frame = frames.next();
    ASSERT_TRUE(frame && *frame);
    EXPECT_EQ((*frame)->index, i);
  }
  EXPECT_GE(recording.read_meanwhile, 2);
}

TEST(FramePrefetcher, ThrowsWhatReadingThrew) {
  const UnevenRecording recording(10, 100, 2);
  FramePrefetcher frames(recording, 0, 10, 1, {.ahead = 4, .readers = 2});
  const auto read_all = [&] {
    while (frames.next()) {
    }
  };
  EXPECT_THROW(read_all(), std::bad_alloc);
}

TEST(FramePrefetcher, CanBeLeftEarly) {
  const CountingRecording recording(1000);
  for (int round = 0; round < 50; ++round) {
    FramePrefetcher frames(recording, 0, 1000, 1, {.ahead = 2, .readers = 1 + round % 2});
    for (int i = 0; i < round % 4; ++i) ASSERT_TRUE(frames.next());
  }
  EXPECT_LT(recording.reads.load(), 50 * 8);
}

}  // namespace
}  // namespace hm
