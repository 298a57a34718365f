#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/station/foxglove_channels.hpp"
#include "hm/station/web/web_types.hpp"

namespace hm {

/// The subprotocol to use of those that a client offers; nothing if we speak none of them. Both are the same
/// on the wire here.
std::optional<std::string> foxglove_protocol(const std::vector<std::string>& offered);

/// One client of Foxglove's WebSocket protocol: JSON channels from the store, the newest state of each;
/// nothing that it says changes anything but its subscriptions.
class FoxgloveSession : public WebSocketSession {
 public:
  static constexpr std::size_t kMaxSubscriptions = 200;
  /// Paths are sent whole: at most so often.
  static constexpr Duration kPathPeriod{1'000'000'000};

  /// The store must outlive the session.
  explicit FoxgloveSession(const LiveStore& store);
  WebOutput receive(std::string_view message, bool is_text, Duration now) override;
  WebOutput next(Duration now) override;

 private:
  void collect();
  void tell(int level, std::string text);
  std::optional<std::string> subscribe(const JsonValue& message);
  std::optional<std::string> unsubscribe(const JsonValue& message);
  std::optional<WebMessage> next_event();
  std::optional<WebMessage> next_state(Duration now);
  [[nodiscard]] WebMessage data(FoxgloveChannel channel, const FoxgloveMessage& message);

  const LiveStore& store_;
  std::deque<std::string> texts_;
  std::map<std::uint32_t, FoxgloveChannel> subscriptions_;
  std::uint64_t seen_change_ = 0;
  std::vector<LiveChange> changes_;
  std::set<LiveSlot> events_;
  std::deque<FoxgloveChannel> dirty_;  ///< each once; the one that waits longest first
  std::map<FoxgloveChannel, Duration> sent_at_;
  std::deque<WebMessage> copies_;  ///< of one message, for several subscriptions to its channel
};

}  // namespace hm
