#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/station/web/refusals.hpp"

namespace hm {

/// An HTTP request, GET or HEAD; its target is at most 2 kB of ASCII.
struct WebRequest {
  std::string path;   ///< as sent, before the first '?'
  std::string query;  ///< behind it
  std::string host, origin, if_none_match;
  std::vector<std::string> protocols;  ///< that a WebSocket client offers
};

struct WebResponse {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::vector<std::pair<std::string, std::string>> headers;
  std::shared_ptr<const void> owner;  ///< of the body; null: it lives as long as the program
  std::span<const std::byte> body;

  static WebResponse of_text(unsigned status, std::string text,
                             std::string content_type = "text/plain; charset=utf-8");
  static WebResponse of_bytes(std::vector<std::byte> bytes, std::string content_type);
};

/// A message to the other end of a WebSocket: `head`, then `body` from `body_offset` on.
struct WebMessage {
  bool text = false;
  std::vector<std::byte> head;
  std::shared_ptr<const std::vector<std::byte>> body;
  std::size_t body_offset = 0;

  static WebMessage of_text(std::string_view text);
};

/// Ends a WebSocket (RFC 6455, 7.4).
struct WebClose {
  static constexpr std::uint16_t kProtocol = 1002, kData = 1003, kPolicy = 1008, kTooBig = 1009,
                                 kTryLater = 1013;
  std::uint16_t code = kProtocol;
  std::string reason;
  Refused refused = Refused::kMessage;  ///< as which it is counted
};

/// Next output of a WebSocket: nothing yet, a message, or its end.
using WebOutput = std::variant<std::monostate, WebMessage, WebClose>;

/// Application of a WebSocket: takes messages, gives messages when the socket has room. All on the server's
/// thread; times since the server's start.
class WebSocketSession {
 public:
  virtual ~WebSocketSession() = default;
  /// A message of at most 64 kB came; returns an end, or monostate (never a message).
  virtual WebOutput receive(std::string_view message, bool is_text, Duration now) = 0;
  /// Asked when the last message has gone, after each received one, after WebServer::post() and every 5 ms.
  virtual WebOutput next(Duration now) = 0;
};

/// A WebSocket that is opened, with the subprotocol to use (empty: none).
struct WebSocketOpening {
  std::unique_ptr<WebSocketSession> session;
  std::string protocol;
};

/// Handler of the server's requests; called on its thread.
class WebHandler {
 public:
  using Answer = std::function<void(WebResponse)>;
  virtual ~WebHandler() = default;
  /// Answers now or later, once, from any thread.
  virtual void respond(const WebRequest& request, Answer answer) = 0;
  /// Opens a WebSocket, or refuses it.
  virtual std::variant<WebSocketOpening, WebResponse> open(const WebRequest& request) = 0;
  /// Every 5 ms.
  virtual void tick(Duration now) = 0;
  /// The server refused something, which the handler had no part in.
  virtual void refused(Refused /*why*/) {}
};

}  // namespace hm
