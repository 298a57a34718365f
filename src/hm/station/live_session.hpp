#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/station/station.hpp"
#include "hm/station/viewer_queue.hpp"
#include "hm/station/web/web_types.hpp"

namespace hm {

/// Context of a session of `/live`; everything outlives the session.
struct LiveSessionContext {
  const LiveStore& store;
  const std::string& hello;  ///< JSON of the hello frame
  const std::function<void(const ReplayRequest&)>& replay;
};

/// One viewer on `/live`: hello, what it has from before, then what its queue gives.
class LiveSession : public WebSocketSession {
 public:
  static constexpr Duration kHelloPatience{10'000'000'000};
  /// Levels of pages that a viewer may say it knows; more than a house of a million cubic metres has.
  static constexpr std::size_t kMaxKnownPages = 200'000;

  LiveSession(const LiveSessionContext& context, Duration now);
  WebOutput receive(std::string_view message, bool is_text, Duration now) override;
  WebOutput next(Duration now) override;

 private:
  using Refusal = std::optional<WebClose>;
  Refusal hello(const JsonValue& message);
  Refusal know_pages(const JsonValue& message);
  Refusal view(const JsonValue& message);
  Refusal ack(const JsonValue& message, Duration now);
  Refusal replay(const JsonValue& message);

  LiveSessionContext context_;
  ViewerQueue queue_;
  Duration opened_;
  bool hello_sent_ = false, greeted_ = false;
  std::size_t known_pages_ = 0;
};

}  // namespace hm
