#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "hm/core/result.hpp"
#include "hm/station/web/web_types.hpp"

namespace hm {

/// Limits against clients that misbehave.
struct WebLimits {
  std::size_t header_bytes = 8192, target_bytes = 2048;
  std::size_t message_bytes = 65536;  ///< of a WebSocket message that comes in
  double messages_per_s = 100;
  /// HTTP requests of one client (rated_client(): an IPv4 address or an IPv6 network), and twice as many at
  /// once. A page makes 8 when it loads (files and WebSockets) and none while it is open: 16 viewers behind
  /// one address (a router), or in one network of IPv6, who all reload at once stay below 200.
  double requests_per_s = 100;
  bool loopback_is_limited = false;  ///< else requests of this machine have no rate
  std::size_t connections = 512;     ///< of any kind; more are closed at once
  std::size_t waiting = 256;         ///< connections without a request; the oldest one makes room
  Duration patience{
      10'000'000'000};  ///< for a request, a handshake, a sign of life, and for each piece of an answer
};

struct WebAddress {
  std::string address;  ///< numeric
  std::uint16_t port = 0;
  int ports = 1;  ///< to try, from `port` on
};

/// HTTP (GET, HEAD) and WebSocket server on a thread of its own. Every socket has one write under way at
/// most; nothing is compressed on the way.
class WebServer {
 public:
  /// Serves until it is destroyed; `handler` must outlive it. Errors: kUsage, the address
  /// cannot be used; kInternal, no port of those is free.
  static Result<std::unique_ptr<WebServer>> start(const WebAddress& address, const WebLimits& limits,
                                                  WebHandler& handler);
  /// Ends all connections; no call of the handler afterwards. Answers that are still owed have to be given,
  /// or their functions destroyed, before.
  ~WebServer();

  [[nodiscard]] std::uint16_t port() const;
  /// Calls `task` on the server's thread, then asks every session for messages. Any thread.
  void post(std::function<void()> task);
  /// Connections that are open, of any kind.
  [[nodiscard]] std::size_t connections() const;

 private:
  struct Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
