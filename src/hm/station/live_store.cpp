#include "hm/station/live_store.hpp"

#include <fmt/format.h>

#include <map>
#include <mutex>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/json_value.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"
#include "hm/station/web/random_token.hpp"

namespace hm {
namespace {

struct Entry {
  LiveItem item;
  std::uint64_t change = 0;
};

LiveChange change_of(const LiveSlot& slot, const LiveItem& item) {
  LiveChange change{slot, item.gone, item.version, {}, item.page.center_m};
  for (std::size_t level = 0; level < change.level_bytes.size(); ++level)
    if (const Payload& payload = item.page.levels[level])
      change.level_bytes[level] = static_cast<std::uint32_t>(payload->size());
  return change;
}

}  // namespace

struct LiveStore::Impl {
  const std::string session = random_token();
  mutable std::mutex mutex;
  std::map<LiveSlot, Entry> entries;
  std::map<std::uint64_t, LiveSlot> changes;  ///< every slot once, under its last change
  std::uint64_t newest = 0, events = 0;

  /// Call with the mutex held.
  void set(const LiveSlot& slot, LiveItem item) {
    item.put_at = std::chrono::steady_clock::now();
    Entry& entry = entries[slot];
    if (entry.change != 0) changes.erase(entry.change);
    entry.item = std::move(item);
    entry.change = ++newest;
    changes.emplace(newest, slot);
  }
  void erase(const LiveSlot& slot) {
    const auto found = entries.find(slot);
    if (found == entries.end()) return;
    changes.erase(found->second.change);
    entries.erase(found);
  }
  void set_page(const LiveSlot& slot, LiveItem item) {
    const std::lock_guard lock(mutex);
    const auto old = entries.find(slot);
    HM_CHECK(old == entries.end() || item.version > old->second.item.version, "version {} after {}",
             item.version, old->second.item.version);
    set(slot, std::move(item));
  }
};

LiveStore::LiveStore() : impl_(std::make_unique<Impl>()) {}
LiveStore::~LiveStore() = default;

void LiveStore::put(LiveKind kind, std::uint64_t id, Time stamp, std::vector<std::byte> payload) {
  HM_CHECK(kind != LiveKind::kMeshPage && kind != LiveKind::kPageGone && kind != LiveKind::kEvent &&
               kind != LiveKind::kHello,
           "kind {} has a function of its own", static_cast<int>(kind));
  LiveItem item;
  item.stamp = stamp;
  item.payload = std::make_shared<const std::vector<std::byte>>(std::move(payload));
  const std::lock_guard lock(impl_->mutex);
  impl_->set({kind, id, {}}, std::move(item));
}

void LiveStore::remove(LiveKind kind, std::uint64_t id) {
  const std::lock_guard lock(impl_->mutex);
  impl_->erase({kind, id, {}});
}

void LiveStore::put_page(PageKey key, std::uint32_t version, Time stamp, PageLevels levels) {
  HM_CHECK(levels.levels[0] || levels.levels[1] || levels.levels[2], "a page without levels");
  LiveItem item;
  item.stamp = stamp;
  item.version = version;
  item.page = std::move(levels);
  impl_->set_page({LiveKind::kMeshPage, 0, key}, std::move(item));
}

void LiveStore::remove_page(PageKey key, std::uint32_t version, Time stamp) {
  LiveItem item;
  item.stamp = stamp;
  item.version = version;
  item.gone = true;
  impl_->set_page({LiveKind::kMeshPage, 0, key}, std::move(item));
}

void LiveStore::add_event(Time stamp, std::string level, std::string text) {
  const std::lock_guard lock(impl_->mutex);
  const std::uint64_t id = ++impl_->events;
  const auto json = JsonValue::object(
      {{"id", id}, {"time_s", stamp.seconds()}, {"level", std::move(level)}, {"text", std::move(text)}});
  LiveItem item;
  item.stamp = stamp;
  item.payload =
      std::make_shared<const std::vector<std::byte>>(text_bytes(to_json_text(json, JsonStyle::kCompact)));
  impl_->set({LiveKind::kEvent, id, {}}, std::move(item));
  if (id > kMaxEvents) impl_->erase({LiveKind::kEvent, id - kMaxEvents, {}});
}

std::uint64_t LiveStore::changes_after(std::uint64_t after, std::vector<LiveChange>& changes) const {
  const std::lock_guard lock(impl_->mutex);
  for (auto it = impl_->changes.upper_bound(after); it != impl_->changes.end(); ++it)
    changes.push_back(change_of(it->second, impl_->entries.at(it->second).item));
  return impl_->newest;
}

std::optional<LiveItem> LiveStore::read(const LiveSlot& slot) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->entries.find(slot);
  if (found == impl_->entries.end()) return std::nullopt;
  return found->second.item;
}

std::vector<LiveItem> LiveStore::items(LiveKind kind) const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<LiveItem> result;
  for (auto it = impl_->entries.lower_bound({kind, 0, {}});
       it != impl_->entries.end() && it->first.kind == kind; ++it)
    result.push_back(it->second.item);
  return result;
}

const std::string& LiveStore::session() const { return impl_->session; }

}  // namespace hm
