#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
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

/// Key of a page of the mesh: a cube of 4 x 4 x 4 volumes.
struct PageKey {
  std::int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const PageKey&) const = default;
};

using Payload = std::shared_ptr<const std::vector<std::byte>>;

/// The levels of detail of a mesh page, each the whole payload of a mesh page frame; finest first.
struct PageLevels {
  std::array<Payload, 3> levels;
  Vec3 center_m = Vec3::Zero();  ///< of the page, in `map`
};

/// Newest state of everything that viewers see. Thread safe: the producer puts immutable payloads and never
/// waits for a viewer; each viewer reads at its own pace what is newer than what it has.
class LiveStore {
 public:
  LiveStore();
  ~LiveStore();

  /// Replaces what is shown under (kind, id): a path's chunk, a tile, a picture. Not for pages and events.
  void put(LiveKind kind, std::uint64_t id, Time stamp, std::vector<std::byte> payload);
  void remove(LiveKind kind, std::uint64_t id);
  /// Replaces a page; `version` is above that of the page before.
  void put_page(PageKey key, std::uint32_t version, Time stamp, PageLevels levels);
  /// The page is empty from here on.
  void remove_page(PageKey key, std::uint32_t version, Time stamp);
  /// Adds an event; the newest 1,000 are kept.
  void add_event(Time stamp, std::string level, std::string text);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
