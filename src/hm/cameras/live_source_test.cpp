#include "hm/cameras/live_source.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "hm/cameras/testing/testing_frames.hpp"

namespace hm {
namespace {

using testing_frames::frame;
using Kind = CameraEvent::Kind;
using std::chrono::milliseconds;

/// A camera that gives what it was told to, as fast as it is asked; then it times out.
class ScriptedCamera : public CameraDriver {
 public:
  explicit ScriptedCamera(std::deque<CameraEvent> events) : events_(std::move(events)) {}
  [[nodiscard]] CameraDescription describe() const override {
    CameraDescription description;
    description.camera = testing_frames::kCamera;
    return description;
  }
  CameraEvent next(milliseconds) override {
    if (events_.empty()) {
      std::this_thread::sleep_for(milliseconds(1));
      return {};
    }
    CameraEvent event = std::move(events_.front());
    events_.pop_front();
    return event;
  }

 private:
  std::deque<CameraEvent> events_;
};

CameraEvent of(RgbdFrame frame) { return {Kind::kFrame, std::move(frame), {}}; }

std::unique_ptr<CameraDriver> camera_of(std::deque<CameraEvent> events) {
  return std::make_unique<ScriptedCamera>(std::move(events));
}

/// Waits until the source has read so many images, or ended.
void wait_for(const LiveSource& source, std::size_t captured) {
  for (int i = 0; i < 5'000 && source.counts().captured < captured; ++i)
    std::this_thread::sleep_for(milliseconds(1));
  ASSERT_EQ(source.counts().captured, captured);
}

void expect_nothing_uncounted(const CaptureCounts& counts) {
  EXPECT_EQ(counts.captured, counts.taken + counts.waiting + counts.dropped_in_all());
}

TEST(LiveSource, EverythingArrivesWhereTheConsumerIsFast) {
  LiveSourceOptions options;
  options.queue_frames = 8;
  std::deque<CameraEvent> events;
  for (int i = 0; i < 8; ++i) events.push_back(of(frame(i)));
  events.push_back({Kind::kEnd, {}, "over"});
  LiveSource source(camera_of(std::move(events)), options);
  for (int i = 0; i < 8; ++i) {
    const auto live = source.next(milliseconds(5'000));
    ASSERT_TRUE(live) << i;
    EXPECT_EQ(live->frame->stamp, frame(i).stamp);
    EXPECT_EQ(live->frame->depth.units(3, 2), frame(i).depth.units(3, 2));
  }
  EXPECT_FALSE(source.next(milliseconds(5'000)));
  EXPECT_EQ(source.end(), CaptureEnd::kFinished);
  EXPECT_EQ(source.end_reason(), "over");
  EXPECT_EQ(source.counts().taken, 8U);
  expect_nothing_uncounted(source.counts());
}

TEST(LiveSource, ASlowConsumerGetsTheNewestAndTheRestIsCounted) {
  std::deque<CameraEvent> events;
  for (int i = 0; i < 50; ++i) events.push_back(of(frame(i)));
  std::vector<Time> tapped;
  LiveSource source(camera_of(std::move(events)), {},
                    [&](const std::shared_ptr<const RgbdFrame>& live) { tapped.push_back(live->stamp); });
  wait_for(source, 50);
  source.stop();
  EXPECT_EQ(source.end(), CaptureEnd::kRunning) << "two frames wait";
  EXPECT_EQ(source.next(milliseconds(0))->frame->stamp, frame(48).stamp);
  EXPECT_EQ(source.next(milliseconds(0))->frame->stamp, frame(49).stamp);
  EXPECT_FALSE(source.next(milliseconds(0)));
  EXPECT_EQ(source.end(), CaptureEnd::kStopped);
  EXPECT_EQ(source.counts().dropped_for(DropReason::kQueueFull), 48U);
  expect_nothing_uncounted(source.counts());
  EXPECT_EQ(tapped.size(), 50U) << "the tap gets what the queue drops";
}

TEST(LiveSource, FramesThatCannotBeUsedAreCountedByReason) {
  RgbdFrame small = frame(1), small_color = frame(2), dark = frame(3), grey = frame(4), color_back = frame(6);
  small.depth.units = Image<std::uint16_t>(12, 8, 7);
  small_color.color = Image<Rgb8>(12, 8);
  dark.depth.units = Image<std::uint16_t>(testing_frames::kWidth, testing_frames::kHeight, 0);
  grey.color = {};
  color_back.color_stamp = frame(0).color_stamp;
  LiveSource source(camera_of({of(frame(0)),
                               of(small),
                               of(small_color),
                               of(dark),
                               of(grey),
                               of(frame(0)),
                               of(color_back),
                               {Kind::kIncomplete, {}, "half an image"},
                               {Kind::kIncomplete, {}, "another"},
                               of(frame(7))}),
                    {});
  wait_for(source, 10);
  const CaptureCounts counts = source.counts();
  EXPECT_EQ(counts.waiting, 2U) << "the first and the last";
  EXPECT_EQ(counts.dropped_for(DropReason::kWrongSize), 2U);
  EXPECT_EQ(counts.dropped_for(DropReason::kNoDepth), 1U);
  EXPECT_EQ(counts.dropped_for(DropReason::kNoColor), 1U);
  EXPECT_EQ(counts.dropped_for(DropReason::kStampNotIncreasing), 2U);
  EXPECT_EQ(counts.dropped_for(DropReason::kIncomplete), 2U);
  EXPECT_EQ(counts.dropped_for(DropReason::kQueueFull), 0U);
  EXPECT_EQ(counts.first_incomplete, "half an image");
  expect_nothing_uncounted(counts);
}

TEST(LiveSource, AFailureComesAfterTheFramesBeforeIt) {
  LiveSource source(camera_of({of(frame(0)), {Kind::kFailed, {}, "unplugged"}}), {});
  ASSERT_TRUE(source.next(milliseconds(5'000)));
  EXPECT_FALSE(source.next(milliseconds(5'000)));
  EXPECT_EQ(source.end(), CaptureEnd::kFailed);
  EXPECT_EQ(source.end_reason(), "unplugged");
  EXPECT_LE(source.ended_at(), std::chrono::steady_clock::now());
}

TEST(LiveSource, ASilentCameraHasFailed) {
  LiveSourceOptions options;
  options.silence = milliseconds(20);
  LiveSource source(camera_of({of(frame(0))}), options);
  ASSERT_TRUE(source.next(milliseconds(5'000)));
  EXPECT_FALSE(source.next(milliseconds(5'000)));
  EXPECT_EQ(source.end(), CaptureEnd::kFailed);
  EXPECT_THAT(source.end_reason(), testing::HasSubstr("no image"));
}

/// Producer, consumer and a reader of the counts at once: for ThreadSanitizer, and none uncounted at any
/// moment.
TEST(LiveSource, CountsAddUpAtEveryMoment) {
  std::deque<CameraEvent> events;
  for (int i = 0; i < 300; ++i) events.push_back(of(frame(i)));
  events.push_back({Kind::kEnd, {}, "over"});
  LiveSource source(camera_of(std::move(events)), {});
  std::atomic<bool> over = false;
  std::thread watcher([&] {
    while (!over) expect_nothing_uncounted(source.counts());
  });
  Time last;
  while (true) {
    const auto live = source.next(milliseconds(5'000));
    if (!live) break;
    EXPECT_GT(live->frame->stamp, last);
    last = live->frame->stamp;
  }
  over = true;
  watcher.join();
  EXPECT_EQ(last, frame(299).stamp) << "the newest frame is never dropped";
  expect_nothing_uncounted(source.counts());
}

}  // namespace
}  // namespace hm
