#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/station/delivery_rate.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

/// A frame that is to be sent now.
struct QueuedFrame {
  LiveKind kind = LiveKind::kPose;
  std::uint32_t sequence = 0;
  Time stamp;
  Payload payload;
  float age_s = 0;  ///< of a mesh page: to be added to the age in its payload
};

/// Effect of an acknowledgement: a frame twice is taken.
enum class Acknowledged { kTaken, kNeverSent, kBackwards };

/// Content that one viewer does not have yet: a set of slots, never a queue of states. The newest state of
/// each is read from the store when its turn comes, so that memory is bounded by the number of slots and
/// every viewer ends with the same model. Poses, plans, telemetry and events come first; scans, paths, tiles,
/// pictures and statistics share what is left with the mesh; of the mesh, near pages and those before the
/// viewer come first, coarse ones before fine ones while there is much to send; the coarse levels that are
/// left come last, to viewers that want them. Not thread safe; times since any origin.
class ViewerQueue {
 public:
  /// Time of unacknowledged frames that a viewer may have: 0.2 s of its rate, at least 64 kB.
  static constexpr double kWindow_s = 0.2;
  static constexpr std::size_t kLeastWindow = 64 * 1024;
  /// With more than this to send, pages come coarse first.
  static constexpr double kCrowded_s = 0.3;

  /// The store must outlive the queue. Sequences start at `first_sequence`.
  ViewerQueue(const LiveStore& store, std::uint32_t first_sequence)
      : store_(store), sequence_(first_sequence) {}

  /// The viewer draws coarse levels of what is far: it gets all of them. Before the first `next`.
  void want_all_levels() { all_levels_ = true; }
  /// The viewer has this level of a page from an earlier connection.
  void know(PageKey key, std::uint32_t version, std::uint8_t level);
  /// Where the viewer looks from and to, in `map`.
  void look(const Vec3& position_m, const Vec3& direction);
  /// Everything up to `sequence` has arrived; what is not taken changes nothing.
  Acknowledged acknowledge(std::uint32_t sequence, Duration now);
  /// Next frame; nothing when the viewer has everything, or has to acknowledge first.
  std::optional<QueuedFrame> next(Duration now);

  [[nodiscard]] std::size_t dirty() const { return urgent_.size() + shared_.size() + dirty_pages_.size(); }
  [[nodiscard]] const DeliveryRate& rate() const { return rate_; }

 private:
  struct PageState {
    LiveChange newest;
    std::uint32_t shown_version = 0;
    unsigned shown_levels = 0;  ///< of that version, a bit each; 0: the page is not shown

    void note_shown(std::uint32_t version, std::uint8_t level) {
      shown_levels = (version == shown_version ? shown_levels : 0U) | 1U << level;
      shown_version = version;
    }
    [[nodiscard]] bool is_current() const { return shown_levels != 0 && shown_version == newest.version; }
  };
  struct PlannedPage {
    double rank = 0;
    PageKey key;
    std::uint8_t level = 0;
    auto operator<=>(const PlannedPage&) const = default;
  };
  void collect();
  void update(const LiveChange& change);
  void update_page(const LiveChange& change);
  void plan_pages(Duration now);
  /// Levels of the newest version that the viewer is still to get, a bit each.
  [[nodiscard]] unsigned lacking(const PageState& page) const;
  [[nodiscard]] PlannedPage plan_page(const PageState& page, bool crowded) const;
  [[nodiscard]] std::size_t window() const;
  std::optional<QueuedFrame> next_urgent();
  std::optional<QueuedFrame> next_shared();
  std::optional<QueuedFrame> next_page(Duration now);
  QueuedFrame send(LiveKind kind, Time stamp, Payload payload, Duration now);

  const LiveStore& store_;
  std::uint32_t sequence_;          ///< of the next frame
  std::uint32_t acknowledged_ = 0;  ///< the newest frame that was
  DeliveryRate rate_;
  std::uint64_t seen_change_ = 0;
  std::vector<LiveChange> changes_;
  std::set<LiveSlot> urgent_;
  std::set<std::pair<std::uint64_t, LiveSlot>> shared_;  ///< with the turn that it had last: the oldest first
  std::map<LiveSlot, std::uint64_t> turns_;
  std::uint64_t turn_ = 0;
  std::map<PageKey, PageState> pages_;
  std::set<PageKey> dirty_pages_;
  std::vector<PlannedPage> planned_;  ///< best last
  bool plan_stale_ = true, all_levels_ = false;
  Duration plan_again_;
  std::size_t shared_bytes_ = 0, page_bytes_ = 0;  ///< since both have something to send
  std::optional<std::pair<Vec3, Vec3>> view_;
};

}  // namespace hm
