#include "hm/station/viewer_queue.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>

#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

// Bytes that a frame costs beyond its payload: header, WebSocket, TCP.
constexpr std::size_t kFrameBytes = kLiveHeaderBytes + 32;
// Urgent frames may exceed the window by this much.
constexpr std::size_t kUrgentMargin = 16 * 1024;
// A coarse level that is hardly smaller than the fine one is not worth sending.
constexpr double kWorthwhile = 0.7;

bool is_urgent(LiveKind kind) {
  return kind == LiveKind::kPose || kind == LiveKind::kPlan || kind == LiveKind::kTelemetry ||
         kind == LiveKind::kEvent;
}

std::uint8_t finest_level(const auto& levels) {
  std::uint8_t level = 0;
  while (level < 2 && !levels[level]) ++level;
  return level;
}

/// `wanted`, or the next level that is there and is worth it: finer ones first.
std::uint8_t nearest_level(const LiveChange& page, std::uint8_t wanted) {
  const std::uint8_t finest = finest_level(page.level_bytes);
  for (std::uint8_t level = wanted; level > finest; --level)
    if (page.level_bytes[level] != 0 && page.level_bytes[level] < kWorthwhile * page.level_bytes[finest])
      return level;
  return finest;
}

Payload page_gone(const PageKey& key, std::uint32_t version) {
  return std::make_shared<const std::vector<std::byte>>(to_payload(PageGoneFrame{key, version}));
}

}  // namespace

void ViewerQueue::know(PageKey key, std::uint32_t version, std::uint8_t level) {
  PageState& page = pages_[key];
  if (page.shown_levels == 0 || page.shown_version <= version) page.note_shown(version, level);
}

void ViewerQueue::look(const Vec3& position_m, const Vec3& direction) {
  view_.emplace(position_m, direction.normalized());
  plan_stale_ = true;
}

Acknowledged ViewerQueue::acknowledge(std::uint32_t sequence, Duration now) {
  if (sequence >= sequence_) return Acknowledged::kNeverSent;
  if (sequence < acknowledged_) return Acknowledged::kBackwards;
  acknowledged_ = sequence;
  rate_.acknowledge(sequence, now);
  return Acknowledged::kTaken;
}

void ViewerQueue::collect() {
  changes_.clear();
  seen_change_ = store_.changes_after(seen_change_, changes_);
  for (const LiveChange& change : changes_) update(change);
}

void ViewerQueue::update(const LiveChange& change) {
  if (change.slot.kind == LiveKind::kMeshPage) return update_page(change);
  if (is_urgent(change.slot.kind)) {
    urgent_.insert(change.slot);
    return;
  }
  const auto turn = turns_.try_emplace(change.slot, 0).first;
  shared_.emplace(turn->second, change.slot);
}

void ViewerQueue::update_page(const LiveChange& change) {
  PageState& page = pages_[change.slot.page];
  page.newest = change;
  plan_stale_ = true;
  if (change.gone ? page.shown_levels == 0 : lacking(page) == 0)
    dirty_pages_.erase(change.slot.page);
  else
    dirty_pages_.insert(change.slot.page);
}

std::size_t ViewerQueue::window() const {
  return std::max(kLeastWindow, static_cast<std::size_t>(rate_.bytes_per_s() * kWindow_s));
}

std::optional<QueuedFrame> ViewerQueue::next(Duration now) {
  collect();
  const std::size_t pending = rate_.pending_bytes();
  if (pending < window() + kUrgentMargin)
    if (auto frame = next_urgent()) return send(frame->kind, frame->stamp, std::move(frame->payload), now);
  if (pending >= window()) return std::nullopt;
  if (shared_.empty() || dirty_pages_.empty()) shared_bytes_ = page_bytes_ = 0;
  if (shared_bytes_ <= page_bytes_) {
    if (auto frame = next_shared()) {
      shared_bytes_ += frame->payload->size();
      return send(frame->kind, frame->stamp, std::move(frame->payload), now);
    }
  }
  if (auto page = next_page(now)) {
    page_bytes_ += page->payload->size();
    const float age_s = page->age_s;
    QueuedFrame frame = send(page->kind, page->stamp, std::move(page->payload), now);
    frame.age_s = age_s;
    return frame;
  }
  if (auto frame = next_shared()) return send(frame->kind, frame->stamp, std::move(frame->payload), now);
  return std::nullopt;
}

QueuedFrame ViewerQueue::send(LiveKind kind, Time stamp, Payload payload, Duration now) {
  rate_.sent(sequence_, payload->size() + kFrameBytes, dirty() == 0, now);
  QueuedFrame frame;
  frame.kind = kind;
  frame.sequence = sequence_++;
  frame.stamp = stamp;
  frame.payload = std::move(payload);
  return frame;
}

std::optional<QueuedFrame> ViewerQueue::next_urgent() {
  while (!urgent_.empty()) {
    const LiveSlot slot = *urgent_.begin();
    urgent_.erase(urgent_.begin());
    // An event that was dropped, or what was removed, is not there any more.
    if (auto item = store_.read(slot))
      return QueuedFrame{slot.kind, 0, item->stamp, std::move(item->payload)};
  }
  return std::nullopt;
}

std::optional<QueuedFrame> ViewerQueue::next_shared() {
  while (!shared_.empty()) {
    const LiveSlot slot = shared_.begin()->second;
    shared_.erase(shared_.begin());
    auto item = store_.read(slot);
    if (!item) {
      turns_.erase(slot);
      continue;
    }
    turns_[slot] = ++turn_;
    return QueuedFrame{slot.kind, 0, item->stamp, std::move(item->payload)};
  }
  return std::nullopt;
}

unsigned ViewerQueue::lacking(const PageState& page) const {
  const auto& bytes = page.newest.level_bytes;
  unsigned wanted = 1U << finest_level(bytes);
  for (unsigned level = 0; all_levels_ && level < bytes.size(); ++level)
    if (bytes[level] != 0) wanted |= 1U << level;
  return page.is_current() ? wanted & ~page.shown_levels : wanted;
}

ViewerQueue::PlannedPage ViewerQueue::plan_page(const PageState& page, bool crowded) const {
  PlannedPage planned;
  planned.key = page.newest.slot.page;
  if (page.newest.gone) return planned;
  const std::uint8_t finest = finest_level(page.newest.level_bytes);
  const unsigned lacks = lacking(page);
  if (!page.is_current()) {
    // A page that is there already, but old, is replaced by the middle level: the coarse one would make what
    // is looked at worse.
    planned.level = crowded ? nearest_level(page.newest, page.shown_levels != 0 ? 1 : 2) : finest;
  } else if ((lacks >> finest & 1U) != 0) {
    // Pages whose newest version is not shown come before those that only become finer,
    planned.level = finest;
    planned.rank = 1e9;
  } else {
    // and these before those whose coarse levels are missing.
    planned.level = static_cast<std::uint8_t>(std::countr_zero(lacks));
    planned.rank = 2e9;
  }
  if (view_) {
    const Vec3 way = page.newest.center_m - view_->first;
    const double distance = way.norm();
    const double before = distance > 0 ? way.dot(view_->second) / distance : 1;
    // What is behind the viewer counts as five times as far as what is before it.
    if (std::isfinite(before)) planned.rank += distance * (1.5 - before);
  }
  return planned;
}

void ViewerQueue::plan_pages(Duration now) {
  if (!plan_stale_ && !planned_.empty()) return;
  if (!planned_.empty() && now < plan_again_) return;
  double bytes = 0;
  for (const PageKey& key : dirty_pages_) {
    const PageState& page = pages_.at(key);
    const std::uint8_t finest = finest_level(page.newest.level_bytes);
    if (!page.newest.gone && (lacking(page) >> finest & 1U) != 0) bytes += page.newest.level_bytes[finest];
  }
  const bool crowded = bytes > rate_.bytes_per_s() * kCrowded_s;
  planned_.clear();
  for (const PageKey& key : dirty_pages_) planned_.push_back(plan_page(pages_.at(key), crowded));
  std::sort(planned_.begin(), planned_.end(), std::greater<>());
  plan_stale_ = false;
  // Large models are not ordered again at every change.
  plan_again_ = {now.ns + static_cast<std::int64_t>(planned_.size()) * 10'000};
}

std::optional<QueuedFrame> ViewerQueue::next_page(Duration now) {
  while (!dirty_pages_.empty()) {
    plan_pages(now);
    const PlannedPage planned = planned_.back();
    planned_.pop_back();
    if (!dirty_pages_.contains(planned.key)) continue;
    PageState& page = pages_.at(planned.key);
    const auto item = store_.read(page.newest.slot);
    if (!item) {
      dirty_pages_.erase(planned.key);
      continue;
    }
    QueuedFrame frame{LiveKind::kPageGone, 0, item->stamp, nullptr};
    if (item->gone) {
      frame.payload = page_gone(planned.key, item->version);
      page.shown_levels = 0;
      dirty_pages_.erase(planned.key);
      return frame;
    }
    // The page may be newer than the plan: the next call sees that.
    const std::uint8_t level =
        item->page.levels[planned.level] ? planned.level : finest_level(item->page.levels);
    frame.kind = LiveKind::kMeshPage;
    frame.payload = item->page.levels[level];
    frame.age_s = std::chrono::duration<float>(std::chrono::steady_clock::now() - item->put_at).count();
    page.note_shown(item->version, level);
    if (lacking(page) == 0) dirty_pages_.erase(planned.key);
    return frame;
  }
  return std::nullopt;
}

}  // namespace hm
