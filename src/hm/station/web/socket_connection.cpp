// hm: compiled alone (Boost's headers).
#include "hm/station/web/web_connections_inl.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <boost/beast/websocket.hpp>

#include "hm/station/web/counted.hpp"
#include "hm/station/web/rate_limit.hpp"

namespace hm {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using beast::error_code;
// Without compression, which is offered to nobody: less to compile.
using WebSocket = websocket::stream<WebStream, false>;

/// A WebSocket and the session behind it.
class SessionSocket final : public SocketConnection, public std::enable_shared_from_this<SessionSocket> {
 public:
  SessionSocket(WebConnections& connections, WebStream stream, WebSocketOpening opening)
      : connections_(connections),
        counted_(connections.count),
        stream_(std::move(stream)),
        opening_(std::move(opening)),
        rate_(connections.limits.messages_per_s) {}
  ~SessionSocket() override { connections_.sockets.erase(this); }
  SessionSocket(const SessionSocket&) = delete;
  SessionSocket& operator=(const SessionSocket&) = delete;

  void accept(const WebRequestHead& request) {
    stream_.next_layer().expires_never();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = connections_.patience();
    timeout.idle_timeout = connections_.patience();
    timeout.keep_alive_pings = true;
    stream_.set_option(timeout);
    stream_.set_option(
        websocket::stream_base::decorator([protocol = opening_.protocol](websocket::response_type& r) {
          r.set(http::field::server, "housemartin");
          if (!protocol.empty()) r.set(http::field::sec_websocket_protocol, protocol);
        }));
    stream_.read_message_max(connections_.limits.message_bytes);
    stream_.auto_fragment(false);
    stream_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return self->count(error);
      self->connections_.sockets.insert(self.get());
      self->read();
      self->pump();
    });
  }

  void pump() override {
    const auto kept = shared_from_this();  // also if the connection is dropped here
    if (writing_ || closing_) return;
    WebOutput output = opening_.session->next(connections_.now());
    if (auto* message = std::get_if<WebMessage>(&output)) write(std::move(*message));
    if (const auto* end = std::get_if<WebClose>(&output)) close(*end);
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->lost(error);
      self->received();
    });
  }

  void received() {
    if (closing_) return;
    const Duration now = connections_.now();
    if (!rate_.take(now))
      return close({WebClose::kPolicy,
                    fmt::format("more than {} messages a second", connections_.limits.messages_per_s),
                    Refused::kTooMany});
    const auto bytes = buffer_.cdata();
    const WebOutput output = opening_.session->receive({static_cast<const char*>(bytes.data()), bytes.size()},
                                                       stream_.got_text(), now);
    buffer_.consume(buffer_.size());
    if (const auto* end = std::get_if<WebClose>(&output)) return close(*end);
    read();
    pump();
  }

  void write(WebMessage message) {
    writing_ = true;
    message_ = std::move(message);
    std::array<asio::const_buffer, 2> buffers{asio::buffer(message_.head.data(), message_.head.size()), {}};
    if (message_.body)
      buffers[1] = asio::buffer(message_.body->data(), message_.body->size()) + message_.body_offset;
    stream_.binary(!message_.text);
    stream_.async_write(buffers, [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_ = false;
      self->message_ = {};
      if (error) return self->lost(error);
      self->pump();
    });
  }

  /// Counts what Beast refused: messages, and an other end that is silent or does not read. A connection that
  /// is lost is none.
  void count(error_code error) {
    if (closing_) return;
    if (error == beast::error::timeout)
      connections_.handler.refused(Refused::kSilent);
    else if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow)
      connections_.handler.refused(Refused::kTooBig);
    else if (error == websocket::condition::protocol_violation)
      connections_.handler.refused(Refused::kMessage);
  }

  void close(const WebClose& end) {
    closing_ = true;
    connections_.handler.refused(end.refused);
    websocket::close_reason reason(static_cast<websocket::close_code>(end.code));
    reason.reason.assign(end.reason.data(), std::min<std::size_t>(end.reason.size(), 120));
    // Waits for a write that is under way; the time-out ends it where the other end does not read.
    stream_.async_close(reason, [self = shared_from_this()](error_code) { self->drop(); });
  }

  void lost(error_code error) { count(error), drop(); }

  /// The connection is lost or over: whatever else is pending on it fails.
  void drop() {
    closing_ = true;
    connections_.sockets.erase(this);
    beast::get_lowest_layer(stream_).close();
  }

  WebConnections& connections_;
  Counted counted_;
  WebSocket stream_;
  WebSocketOpening opening_;
  RateLimit rate_;
  beast::flat_buffer buffer_;
  WebMessage message_;
  bool writing_ = false, closing_ = false;
};

}  // namespace

void open_socket(WebConnections& connections, WebStream stream, WebSocketOpening opening,
                 const WebRequestHead& request) {
  std::make_shared<SessionSocket>(connections, std::move(stream), std::move(opening))->accept(request);
}

}  // namespace hm
