#include "hm/station/viewer_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

using testing::ElementsAre;

std::vector<std::byte> bytes(std::size_t count) { return std::vector<std::byte>(count, std::byte{'x'}); }

Payload page_payload(PageKey key, std::uint32_t version, std::uint8_t level, std::size_t size) {
  MeshPageFrame frame;
  frame.key = key;
  frame.version = version;
  frame.level = level;
  frame.vertex_bytes.resize(size);
  return std::make_shared<const std::vector<std::byte>>(to_payload(frame));
}

/// A page with levels of 100, 25 and 6 % of `size`, its centre at the key.
void put_page(LiveStore& store, PageKey key, std::uint32_t version, std::size_t size = 10'000) {
  PageLevels page;
  page.levels = {page_payload(key, version, 0, size), page_payload(key, version, 1, size / 4),
                 page_payload(key, version, 2, size / 16)};
  page.center_m = Vec3(key.x, key.y, key.z);
  store.put_page(key, version, {}, std::move(page));
}

struct ShownPage {
  std::uint32_t version = 0;
  std::uint8_t level = 0;
  auto operator<=>(const ShownPage&) const = default;
};

/// What a viewer that keeps the rules shows: of a page the newest version and, of it, the finest level.
struct QueueViewer {
  std::map<PageKey, ShownPage> pages;
  std::vector<LiveKind> kinds;
  std::vector<PageKey> order;
  std::vector<int> levels;

  void take(const QueuedFrame& frame) {
    kinds.push_back(frame.kind);
    const auto decoded = decode_live_payload(frame.kind, *frame.payload);
    if (!decoded) return;  // a test's own bytes
    if (const auto* page = std::get_if<MeshPageFrame>(&*decoded)) {
      order.push_back(page->key);
      levels.push_back(page->level);
      const auto shown = pages.find(page->key);
      if (shown != pages.end() && shown->second.version == page->version && shown->second.level < page->level)
        return;
      pages[page->key] = {page->version, page->level};
    } else if (const auto* gone = std::get_if<PageGoneFrame>(&*decoded)) {
      pages.erase(gone->key);
    }
  }
};

/// Takes frames until there is none, and acknowledges each at once.
QueueViewer drain(ViewerQueue& queue, Duration now = {}) {
  QueueViewer viewer;
  while (const auto frame = queue.next(now)) {
    viewer.take(*frame);
    EXPECT_EQ(queue.acknowledge(frame->sequence, now), Acknowledged::kTaken);
  }
  return viewer;
}

/// A line of a rate and a delay, and a viewer at its end that acknowledges every 20 ms. Steps of a
/// millisecond.
class Line {
 public:
  Line(ViewerQueue& queue, double bytes_per_s, int delay_ms)
      : queue_(queue), rate_(bytes_per_s), delay_ms_(delay_ms) {}

  void step() {
    ++now_ms_;
    const Duration now{now_ms_ * 1'000'000};
    // The sending end of a socket takes what does not lie more than its buffer ahead.
    while (free_at_ms_ <= static_cast<double>(now_ms_) + 5) {
      auto frame = queue_.next(now);
      if (!frame) break;
      free_at_ms_ = std::max(free_at_ms_, static_cast<double>(now_ms_)) +
                    static_cast<double>(frame->payload->size() + 48) / rate_ * 1e3;
      most_pending_ = std::max(most_pending_, queue_.rate().pending_bytes());
      on_way_.push_back({free_at_ms_ + delay_ms_, std::move(*frame)});
    }
    while (!on_way_.empty() && on_way_.front().first <= static_cast<double>(now_ms_)) {
      viewer.take(on_way_.front().second);
      newest_ = on_way_.front().second.sequence;
      on_way_.pop_front();
    }
    if (now_ms_ % 20 == 0 && newest_ != 0) acks_.push_back({now_ms_ + delay_ms_, newest_});
    while (!acks_.empty() && acks_.front().first <= now_ms_) {
      EXPECT_EQ(queue_.acknowledge(acks_.front().second, now), Acknowledged::kTaken);
      acks_.pop_front();
    }
  }
  /// Milliseconds until the viewer has everything, at most `limit_ms`.
  std::int64_t run(std::int64_t limit_ms = 60'000) {
    const std::int64_t start = now_ms_;
    do step();
    while ((queue_.dirty() > 0 || !on_way_.empty()) && now_ms_ - start < limit_ms);
    return now_ms_ - start;
  }
  [[nodiscard]] std::int64_t now_ms() const { return now_ms_; }
  [[nodiscard]] std::size_t most_pending() const { return most_pending_; }
  QueueViewer viewer;

 private:
  ViewerQueue& queue_;
  double rate_;
  int delay_ms_;
  std::int64_t now_ms_ = 0;
  double free_at_ms_ = 0;
  std::size_t most_pending_ = 0;
  std::deque<std::pair<double, QueuedFrame>> on_way_;
  std::deque<std::pair<std::int64_t, std::uint32_t>> acks_;
  std::uint32_t newest_ = 0;
};

TEST(ViewerQueue, OfEachThingOnlyTheNewestIsSent) {
  LiveStore store;
  ViewerQueue queue(store, 2);
  for (int i = 0; i < 100; ++i) store.put(LiveKind::kPose, 0, Time{i}, to_payload(PoseFrame{}));
  const auto frame = queue.next({});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp, Time{99});
  EXPECT_EQ(frame->sequence, 2u);
  EXPECT_FALSE(queue.next({}));
  store.put(LiveKind::kPose, 0, Time{100}, to_payload(PoseFrame{}));
  EXPECT_EQ(queue.next({})->stamp, Time{100});
  EXPECT_FALSE(queue.next({}));
}

TEST(ViewerQueue, UrgentFramesOvertakeTheMesh) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 5; ++x) put_page(store, {x, 0, 0}, 1);
  EXPECT_EQ(queue.next({})->kind, LiveKind::kMeshPage);
  store.put(LiveKind::kPose, 0, {}, to_payload(PoseFrame{}));
  store.add_event({}, "info", "text");
  EXPECT_EQ(queue.next({})->kind, LiveKind::kPose);
  EXPECT_EQ(queue.next({})->kind, LiveKind::kEvent);
  EXPECT_EQ(queue.next({})->kind, LiveKind::kMeshPage);
}

TEST(ViewerQueue, AViewerThatAcknowledgesNothingGetsAWindowAndNoMore) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 100; ++x) put_page(store, {x, 0, 0}, 1);
  std::size_t sent = 0;
  while (const auto frame = queue.next({})) sent += frame->payload->size();
  EXPECT_GT(sent, ViewerQueue::kLeastWindow * 9 / 10);
  EXPECT_LT(sent, ViewerQueue::kLeastWindow + 11'000);
  // Poses may pass, within a margin.
  std::size_t poses = 0;
  for (int i = 0; i < 10'000; ++i) {
    store.put(LiveKind::kPose, 0, Time{i}, to_payload(PoseFrame{}));
    if (queue.next({})) ++poses;
  }
  EXPECT_GT(poses, 10u);
  EXPECT_LT(poses * 60, 17'000u);
}

TEST(ViewerQueue, AckOfAFrameThatWasNotSentIsRefused) {
  LiveStore store;
  ViewerQueue queue(store, 2);
  EXPECT_EQ(queue.acknowledge(1, {}), Acknowledged::kTaken);  // hello
  EXPECT_EQ(queue.acknowledge(2, {}), Acknowledged::kNeverSent);
  store.put(LiveKind::kPose, 0, {}, to_payload(PoseFrame{}));
  ASSERT_TRUE(queue.next({}));
  EXPECT_EQ(queue.acknowledge(2, {}), Acknowledged::kTaken);
  EXPECT_EQ(queue.acknowledge(2, {}), Acknowledged::kTaken);
  EXPECT_EQ(queue.acknowledge(3, {}), Acknowledged::kNeverSent);
}

TEST(ViewerQueue, AckThatGoesBackwardsIsRefusedAndChangesNothing) {
  LiveStore store;
  ViewerQueue queue(store, 2);
  for (std::uint64_t which = 0; which < 3; ++which)
    store.put(LiveKind::kPose, which, {}, to_payload(PoseFrame{}));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(queue.next({}));
  EXPECT_EQ(queue.acknowledge(3, {}), Acknowledged::kTaken);
  const std::size_t pending = queue.rate().pending_bytes();
  EXPECT_EQ(queue.acknowledge(2, {}), Acknowledged::kBackwards);
  EXPECT_EQ(queue.acknowledge(1, {}), Acknowledged::kBackwards);
  EXPECT_EQ(queue.rate().pending_bytes(), pending);
  EXPECT_EQ(queue.acknowledge(4, {}), Acknowledged::kTaken);
  EXPECT_EQ(queue.rate().pending_bytes(), 0u);
}

TEST(ViewerQueue, LittleIsSentFineAtOnce) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 5; ++x) put_page(store, {x, 0, 0}, 1);
  EXPECT_THAT(drain(queue).levels, ElementsAre(0, 0, 0, 0, 0));
}

TEST(ViewerQueue, MuchIsSentCoarseFirstAndThenFine) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 200; ++x) put_page(store, {x, 0, 0}, 1);
  const QueueViewer viewer = drain(queue);
  ASSERT_EQ(viewer.levels.size(), 400u);
  for (std::size_t i = 0; i < 400; ++i) EXPECT_EQ(viewer.levels[i], i < 200 ? 2 : 0);
  EXPECT_EQ(viewer.pages.size(), 200u);
}

TEST(ViewerQueue, OldPagesAreReplacedByTheMiddleLevel) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  Line line(queue, 1e6, 5);
  for (int x = 0; x < 200; ++x) put_page(store, {x, 0, 0}, 1);
  line.run();
  line.viewer.levels.clear();
  for (int x = 0; x < 200; ++x) put_page(store, {x, 0, 0}, 2);
  line.run();
  ASSERT_GE(line.viewer.levels.size(), 200u);
  EXPECT_EQ(line.viewer.levels.front(), 1);
  EXPECT_THAT(line.viewer.levels, testing::Not(testing::Contains(2)));
  for (const auto& [key, page] : line.viewer.pages) EXPECT_EQ(page, (ShownPage{2, 0}));
}

TEST(ViewerQueue, NearPagesAndThoseBeforeTheViewerComeFirst) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (const int x : {-9, -3, 2, 8}) put_page(store, {x, 0, 0}, 1);
  queue.look(Vec3::Zero(), Vec3(2, 0, 0));
  EXPECT_THAT(drain(queue).order, ElementsAre(PageKey{2}, PageKey{8}, PageKey{-3}, PageKey{-9}));
  for (const int x : {-9, -3, 2, 8}) put_page(store, {x, 0, 0}, 2);
  queue.look(Vec3::Zero(), Vec3(-1, 0, 0));
  EXPECT_THAT(drain(queue).order, ElementsAre(PageKey{-3}, PageKey{-9}, PageKey{2}, PageKey{8}));
}

TEST(ViewerQueue, LevelsThatAreMissingOrNotSmallerAreSkipped) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 50; ++x) {
    PageLevels page;
    page.levels[0] = page_payload({x, 0, 0}, 1, 0, 10'000);
    if (x % 2 == 0) page.levels[2] = page_payload({x, 0, 0}, 1, 2, 9'000);
    store.put_page({x, 0, 0}, 1, {}, std::move(page));
  }
  PageLevels coarse;
  coarse.levels[1] = page_payload({99, 0, 0}, 1, 1, 1000);
  store.put_page({99, 0, 0}, 1, {}, std::move(coarse));
  const QueueViewer viewer = drain(queue);
  EXPECT_EQ(viewer.levels.size(), 51u);
  EXPECT_EQ(viewer.pages.at({99, 0, 0}), (ShownPage{1, 1}));
}

TEST(ViewerQueue, CoarseLevelsComeLastToThoseWhoWantThem) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  queue.want_all_levels();
  // Of two hundred pages the coarsest come first: that is not sent again.
  for (int x = 0; x < 200; ++x) put_page(store, {x, 1, 0}, 1);
  const QueueViewer viewer = drain(queue);
  ASSERT_EQ(viewer.levels.size(), 600u);
  for (std::size_t i = 0; i < 600; ++i) EXPECT_EQ(viewer.levels[i], i < 200 ? 2 : i < 400 ? 0 : 1);
  for (int x = 0; x < 5; ++x) put_page(store, {x, 0, 0}, 1);
  EXPECT_THAT(drain(queue).levels, ElementsAre(0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2));
  EXPECT_EQ(queue.dirty(), 0u);
  // What has changed goes before coarse levels that are missing.
  put_page(store, {0, 0, 0}, 2);
  ASSERT_EQ(queue.next({})->kind, LiveKind::kMeshPage);
  put_page(store, {1, 0, 0}, 2);
  const QueueViewer rest = drain(queue);
  EXPECT_EQ(rest.order.front(), (PageKey{1, 0, 0}));
  EXPECT_THAT(rest.levels, ElementsAre(0, 1, 2, 1, 2));
}

TEST(ViewerQueue, AResumedViewerGetsTheLevelsThatItLacks) {
  LiveStore store;
  for (int x = 0; x < 4; ++x) put_page(store, {x, 0, 0}, 3);
  ViewerQueue queue(store, 1);
  queue.want_all_levels();
  for (std::uint8_t level = 0; level < 3; ++level) queue.know({0, 0, 0}, 3, level);
  queue.know({1, 0, 0}, 3, 2);
  queue.know({2, 0, 0}, 3, 0);
  queue.know({3, 0, 0}, 2, 0);
  queue.know({3, 0, 0}, 2, 1);
  const QueueViewer viewer = drain(queue);
  EXPECT_THAT(viewer.order, ElementsAre(PageKey{3}, PageKey{1}, PageKey{2}, PageKey{1}, PageKey{2},
                                        PageKey{3}, PageKey{3}));
  EXPECT_THAT(viewer.levels, ElementsAre(0, 0, 1, 1, 2, 1, 2));
}

TEST(ViewerQueue, AResumedViewerGetsWhatItLacks) {
  LiveStore store;
  for (int x = 0; x < 5; ++x) put_page(store, {x, 0, 0}, 3);
  store.remove_page({3, 0, 0}, 4, {});
  store.remove_page({4, 0, 0}, 4, {});
  ViewerQueue queue(store, 1);
  queue.know({0, 0, 0}, 3, 0);   // has it
  queue.know({1, 0, 0}, 3, 2);   // has it coarse
  queue.know({2, 0, 0}, 2, 0);   // has an older one
  queue.know({3, 0, 0}, 3, 0);   // it is gone
  queue.know({77, 0, 0}, 3, 0);  // was never there
  const QueueViewer viewer = drain(queue);
  EXPECT_THAT(viewer.order, testing::UnorderedElementsAre(PageKey{1}, PageKey{2}));
  EXPECT_EQ(std::count(viewer.kinds.begin(), viewer.kinds.end(), LiveKind::kPageGone), 1);
  EXPECT_EQ(viewer.kinds.size(), 3u);
}

TEST(ViewerQueue, APageThatCameAndWentUnseenIsNotMentioned) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  put_page(store, {1, 0, 0}, 1);
  store.remove_page({1, 0, 0}, 2, {});
  EXPECT_FALSE(queue.next({}));
  put_page(store, {1, 0, 0}, 3);
  EXPECT_EQ(drain(queue).pages.at({1, 0, 0}), (ShownPage{3, 0}));
  store.remove_page({1, 0, 0}, 4, {});
  EXPECT_EQ(queue.next({})->kind, LiveKind::kPageGone);
  EXPECT_FALSE(queue.next({}));
}

TEST(ViewerQueue, WhatWasRemovedIsNotSent) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  store.put(LiveKind::kGridTile, 5, {}, bytes(10));
  store.put(LiveKind::kGridTile, 6, {}, bytes(10));
  ASSERT_TRUE(queue.next({}));
  store.remove(LiveKind::kGridTile, 6);
  EXPECT_FALSE(queue.next({}));
  for (std::size_t i = 0; i < LiveStore::kMaxEvents + 50; ++i) store.add_event({}, "info", "");
  std::size_t events = 0;
  while (const auto frame = queue.next({})) {
    EXPECT_EQ(queue.acknowledge(frame->sequence, {}), Acknowledged::kTaken);
    ++events;
  }
  EXPECT_EQ(events, LiveStore::kMaxEvents);
}

TEST(ViewerQueue, FillsALineButNotMoreThanItsWindow) {
  for (const auto& [rate, delay_ms] : {std::pair{1e6, 5}, {1e6, 40}, {2e7, 1}}) {
    LiveStore store;
    ViewerQueue queue(store, 1);
    Line line(queue, rate, delay_ms);
    const int pages = static_cast<int>(rate * 4 / 16'000);  // four seconds
    for (int x = 0; x < pages; ++x) put_page(store, {x, 0, 0}, 1, 15'000);
    const double taken_s = static_cast<double>(line.run()) * 1e-3;
    EXPECT_LT(taken_s, 4 * 1.06 * 1.1 + 0.3) << rate << " " << delay_ms;  // coarse levels 6 %, filling 10 %
    EXPECT_LT(static_cast<double>(line.most_pending()), std::max(64e3, rate * 0.2 * 1.3) + 16e3) << rate;
    EXPECT_EQ(line.viewer.pages.size(), static_cast<std::size_t>(pages));
  }
}

TEST(ViewerQueue, ASlowerLineIsNoticed) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  for (int x = 0; x < 2000; ++x) put_page(store, {x, 0, 0}, 1, 15'000);
  Line fast(queue, 2e7, 1);
  fast.run(500);
  EXPECT_GT(queue.rate().bytes_per_s(), 1e7);
  // The same viewer behind a line of 0.5 MB/s from here on, each frame acknowledged when it has passed.
  double now_s = 1;
  for (int i = 0; i < 200; ++i) {
    const auto frame = queue.next(Duration::from_seconds(now_s));
    if (!frame) break;
    now_s += static_cast<double>(frame->payload->size()) / 0.5e6;
    EXPECT_EQ(queue.acknowledge(frame->sequence, Duration::from_seconds(now_s)), Acknowledged::kTaken);
  }
  EXPECT_LT(queue.rate().bytes_per_s(), 1e6);
}

TEST(ViewerQueue, PicturesAndMeshShareTheLine) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  Line line(queue, 1e6, 5);
  for (int x = 0; x < 200; ++x) put_page(store, {x, 0, 0}, 1, 15'000);  // three seconds alone
  std::int64_t whole_ms = 0;
  std::size_t pictures = 0;
  for (int ms = 0; ms < 10'000 && whole_ms == 0; ++ms) {
    if (ms % 33 == 0) store.put(LiveKind::kPicture, 0, {}, bytes(60'000));  // 1.8 MB/s alone
    line.step();
    std::size_t fine = 0;
    for (const auto& [key, page] : line.viewer.pages) fine += page.level == 0 ? 1 : 0;
    if (fine == 200) whole_ms = ms;
  }
  pictures = static_cast<std::size_t>(
      std::count(line.viewer.kinds.begin(), line.viewer.kinds.end(), LiveKind::kPicture));
  EXPECT_GT(whole_ms, 0);
  EXPECT_LT(whole_ms, 8000);
  EXPECT_GT(pictures, 30u);
}

TEST(ViewerQueue, NoTileWaitsForScansForEver) {
  LiveStore store;
  ViewerQueue queue(store, 1);
  Line line(queue, 2e5, 5);
  for (std::uint64_t id = 0; id < 20; ++id) store.put(LiveKind::kGridTile, id, {}, bytes(4096));
  for (int ms = 0; ms < 3000; ++ms) {
    if (ms % 25 == 0) store.put(LiveKind::kScan, 0, {}, bytes(12'000));  // 0.48 MB/s
    line.step();
  }
  EXPECT_EQ(std::count(line.viewer.kinds.begin(), line.viewer.kinds.end(), LiveKind::kGridTile), 20);
}

TEST(ViewerQueue, FastAndSlowViewersEndWithTheSameModel) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    LiveStore store;
    ViewerQueue fast_queue(store, 1), slow_queue(store, 1);
    Line fast(fast_queue, 3e7, 1), slow(slow_queue, 2e5, 30);
    std::map<PageKey, ShownPage> truth;
    std::map<PageKey, std::uint32_t> versions;
    for (int ms = 0; ms < 1500; ++ms) {
      const PageKey key{static_cast<std::int32_t>(rng.below(8)), static_cast<std::int32_t>(rng.below(8)), 0};
      const std::uint32_t version = ++versions[key];
      if (rng.below(10) == 0) {
        store.remove_page(key, version, {});
        truth.erase(key);
      } else {
        put_page(store, key, version, 500 + rng.below(8000));
        truth[key] = {version, 0};
      }
      if (rng.below(50) == 0)
        slow_queue.look(Vec3(rng.uniform(0, 8), 0, 0), Vec3(rng.normal(), rng.normal(), 1));
      fast.step();
      slow.step();
    }
    fast.run();
    slow.run();
    EXPECT_EQ(fast.viewer.pages, truth) << seed;
    EXPECT_EQ(slow.viewer.pages, truth) << seed;
    EXPECT_LT(slow.viewer.kinds.size(), fast.viewer.kinds.size());
  }
}

}  // namespace
}  // namespace hm
