#pragma once
#include <array>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Kinds of frames on `/live` (docs/file_formats.md, Live view).
enum class LiveKind : std::uint8_t {
  kHello = 1,
  kMeshPage,
  kPageGone,
  kPose,
  kPath,
  kScan,
  kPlan,
  kGridTile,
  kTelemetry,
  kEvent,
  kPicture,
  kStatistics,
};

/// Statistics that change stand under 0, the parameters in effect under this id.
inline constexpr std::uint64_t kParametersSlot = 1;

/// Key of a page of the mesh: a cube of 4 x 4 x 4 volumes.
struct PageKey {
  std::int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const PageKey&) const = default;
};

using Payload = std::shared_ptr<const std::vector<std::byte>>;

/// The levels of detail of a mesh page, each the whole payload of a mesh page frame; finest first. A level
/// that is not there (null) is replaced by another one; one at least must be there.
struct PageLevels {
  std::array<Payload, 3> levels;
  Vec3 center_m = Vec3::Zero();  ///< of the page, in `map`
};

/// Unit of the viewers' model: a page, or what stands under (kind, id).
struct LiveSlot {
  LiveKind kind = LiveKind::kMeshPage;  ///< kMeshPage also when the page is gone
  std::uint64_t id = 0;
  PageKey page;
  auto operator<=>(const LiveSlot&) const = default;
};

/// A change of a slot; of each slot the store knows the newest one.
struct LiveChange {
  LiveSlot slot;
  bool gone = false;
  std::uint32_t version = 0;                   ///< of a page
  std::array<std::uint32_t, 3> level_bytes{};  ///< of a page; 0: no such level
  Vec3 center_m = Vec3::Zero();                ///< of a page
};

/// Contents of a slot.
struct LiveItem {
  Time stamp;
  std::uint32_t version = 0;  ///< of a page
  bool gone = false;
  PageLevels page;
  Payload payload;  ///< of other kinds
  std::chrono::steady_clock::time_point put_at;
};

/// Newest state of everything that viewers see. Thread safe: the producer puts immutable payloads and never
/// waits for a viewer; each viewer reads at its own pace what is newer than what it has.
class LiveStore {
 public:
  static constexpr std::size_t kMaxEvents = 1000;

  LiveStore();
  ~LiveStore();

  /// Replaces what is shown under (kind, id): a path's chunk, a tile, a picture. Not for pages and events.
  void put(LiveKind kind, std::uint64_t id, Time stamp, std::vector<std::byte> payload);
  /// Viewers that come later do not get it; those that have it keep it.
  void remove(LiveKind kind, std::uint64_t id);
  /// Replaces a page; `version` is above that of the page before.
  void put_page(PageKey key, std::uint32_t version, Time stamp, PageLevels levels);
  /// The page is empty from here on.
  void remove_page(PageKey key, std::uint32_t version, Time stamp);
  /// Adds an event; the newest 1,000 are kept.
  void add_event(Time stamp, std::string level, std::string text);

  /// Appends every slot that changed after change number `after` (0: all) in the order of its last change;
  /// returns the newest change number.
  std::uint64_t changes_after(std::uint64_t after, std::vector<LiveChange>& changes) const;
  /// Contents of a slot, nothing if there is no such slot.
  [[nodiscard]] std::optional<LiveItem> read(const LiveSlot& slot) const;
  /// Everything of a kind other than pages, in the order of the ids.
  [[nodiscard]] std::vector<LiveItem> items(LiveKind kind) const;
  /// Random name of this store: what a viewer knows of another one is worth nothing.
  [[nodiscard]] const std::string& session() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
