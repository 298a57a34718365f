#pragma once
// Boost's headers: for web_server.cpp and socket_connection.cpp only.
#include <utility>  // first: Beast 1.74 uses std::exchange without including it

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "hm/station/web/client_rates.hpp"
#include "hm/station/web/web_server.hpp"

namespace hm {

// Executors that are known when this is compiled: less for the compiler to make of Boost's templates.
using WebExecutor = boost::asio::io_context::executor_type;
using WebStream = boost::beast::basic_stream<boost::asio::ip::tcp, WebExecutor>;
using WebRequestHead = boost::beast::http::request<boost::beast::http::empty_body>;

/// A WebSocket of a server.
class SocketConnection {
 public:
  virtual ~SocketConnection() = default;
  /// Sends what the session has, if nothing is on its way.
  virtual void pump() = 0;
};

/// State that the connections of a server share; touched by the server's thread only, but for what is atomic.
struct WebConnections {
  WebConnections(const WebLimits& the_limits, WebHandler& the_handler)
      : limits(the_limits), handler(the_handler), requests(the_limits.requests_per_s) {}
  [[nodiscard]] Duration now() const {
    return {std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start)
                .count()};
  }
  [[nodiscard]] std::chrono::nanoseconds patience() const {
    return std::chrono::nanoseconds(limits.patience.ns);
  }

  WebLimits limits;
  WebHandler& handler;
  ClientRates requests;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  std::atomic<std::size_t> count = 0;
  std::uint64_t next_id = 0;
  std::map<std::uint64_t, std::function<void()>>
      waiting;  ///< ends a connection without a request; oldest first
  std::set<SocketConnection*> sockets;
  boost::asio::io_context context{1};  ///< the last member: connections end with it, and leave the others
};

/// Makes a WebSocket of a connection whose `request` asks for it. It is one of `connections.sockets` from the
/// end of the handshake until it is lost or over.
void open_socket(WebConnections& connections, WebStream stream, WebSocketOpening opening,
                 const WebRequestHead& request);

}  // namespace hm
