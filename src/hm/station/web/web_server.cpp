// hm: compiled alone (Boost's headers).
#include "hm/station/web/web_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/station/web/counted.hpp"
#include "hm/station/web/web_connections_inl.hpp"

namespace hm {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using beast::error_code;
using tcp = asio::ip::tcp;
using Socket = asio::basic_stream_socket<tcp, WebExecutor>;
using Acceptor = asio::basic_socket_acceptor<tcp, WebExecutor>;
using Parser = http::request_parser<http::empty_body>;

// So small that a message is not behind more than this in the kernel, and the rate that acknowledgements tell
// is the rate of the line.
constexpr int kSendBuffer = 128 * 1024;
constexpr std::chrono::milliseconds kTick{5};

std::string text_of(beast::string_view text) { return {text.begin(), text.end()}; }

std::vector<std::string> offered_protocols(const WebRequestHead& request) {
  std::vector<std::string> result;
  for (const auto name : http::token_list(request[http::field::sec_websocket_protocol]))
    result.push_back(text_of(name));
  return result;
}

WebRequest to_web_request(const WebRequestHead& request) {
  const std::string target = text_of(request.target());
  const std::size_t query = target.find('?');
  WebRequest result;
  result.path = target.substr(0, query);
  if (query != std::string::npos) result.query = target.substr(query + 1);
  result.host = text_of(request[http::field::host]);
  result.origin = text_of(request[http::field::origin]);
  result.if_none_match = text_of(request[http::field::if_none_match]);
  result.protocols = offered_protocols(request);
  return result;
}

/// A connection that speaks HTTP, until it becomes a WebSocket.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(WebConnections& connections, Socket socket)
      : connections_(connections),
        counted_(connections.count),
        stream_(std::move(socket)),
        id_(connections.next_id++),
        buffer_(connections.limits.header_bytes + connections.limits.target_bytes) {}
  ~HttpConnection() { connections_.waiting.erase(id_); }
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void read() {
    connections_.waiting[id_] = [weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->stream_.close();
    };
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(connections_.limits.header_bytes));
    stream_.expires_after(connections_.patience());
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](error_code error, std::size_t) {
                              self->connections_.waiting.erase(self->id_);
                              self->handle(error);
                            });
  }

 private:
  void handle(error_code error) {
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      return refuse(431, "the header of the request is too long");
    if (error.category() == make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message)
      return refuse(400, "this is no HTTP request");
    // Who has been answered and begins nothing new is free to go.
    if (error == beast::error::timeout && (!answered_ || buffer_.size() > 0))
      connections_.handler.refused(Refused::kSilent);
    if (error) return;  // gone, or silent for too long
    const WebRequestHead& request = parser_->get();
    head_only_ = request.method() == http::verb::head;
    if (asks_too_often())
      return refuse(429, fmt::format("more than {} requests a second: try again in a second",
                                     connections_.limits.requests_per_s));
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(405, "only GET and HEAD are served");
    if (request.target().size() > connections_.limits.target_bytes)
      return refuse(414, "the address is too long");
    if (request.has_content_length() || request.chunked()) {
      if (parser_->content_length().value_or(1) != 0) return refuse(400, "a request has no body here");
    }
    keep_alive_ = request.keep_alive();
    if (beast::websocket::is_upgrade(request)) return open();
    connections_.handler.respond(to_web_request(request), later());
  }

  void open() {
    auto opened = connections_.handler.open(to_web_request(parser_->get()));
    if (auto* response = std::get_if<WebResponse>(&opened)) return answer(std::move(*response));
    open_socket(connections_, std::move(stream_), std::get<WebSocketOpening>(std::move(opened)),
                parser_->get());
  }

  /// Keeps a connection until it is answered. Its end is left to the server's thread, whoever drops the
  /// answer.
  struct Held {
    Held(std::shared_ptr<HttpConnection> the_connection) : connection(std::move(the_connection)) {}
    ~Held() {
      if (!connection) return;
      auto& context = connection->connections_.context;
      asio::post(context, [ended = std::move(connection)] {});
    }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    std::shared_ptr<HttpConnection> connection;
  };

  /// Brings an answer that may come from another thread to this one. The time of making it has no limit.
  WebHandler::Answer later() {
    stream_.expires_never();
    return [held = std::make_shared<Held>(shared_from_this())](WebResponse response) {
      auto& context = held->connection->connections_.context;
      asio::post(context, [self = std::move(held->connection), given = std::move(response)]() mutable {
        self->answer(std::move(given));
      });
    };
  }

  [[nodiscard]] bool asks_too_often() {
    error_code error;
    const std::string address = stream_.socket().remote_endpoint(error).address().to_string();
    const auto client =
        connections_.limits.loopback_is_limited ? std::optional(address) : rated_client(address);
    return !error && client && !connections_.requests.take(*client, connections_.now());
  }

  void refuse(unsigned status, std::string text) {
    connections_.handler.refused(status == 429 ? Refused::kTooMany : Refused::kRequest);
    keep_alive_ = false;
    auto response = WebResponse::of_text(status, std::move(text) + "\n");
    if (status == 429) response.headers.emplace_back("Retry-After", "1");
    answer(std::move(response));
  }

  void answer(WebResponse response) {
    owner_ = std::move(response.owner);
    message_.emplace();
    message_->version(11);
    message_->result(response.status);
    message_->set(http::field::server, "housemartin");
    message_->set(http::field::content_type, response.content_type);
    message_->set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : response.headers) message_->set(name, value);
    message_->content_length(response.body.size());
    message_->keep_alive(keep_alive_);
    if (head_only_) response.body = {};
    // The body is only read.
    message_->body() = {const_cast<std::byte*>(response.body.data()), response.body.size()};
    serializer_.emplace(*message_);
    write_some();
  }

  /// Piece by piece, each with its own limit of time: a large file over a slow line takes as long as it
  /// takes.
  void write_some() {
    stream_.expires_after(connections_.patience());
    http::async_write_some(stream_, *serializer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error == beast::error::timeout) self->connections_.handler.refused(Refused::kSilent);
      if (error) return;
      if (!self->serializer_->is_done()) return self->write_some();
      self->finish();
    });
  }

  void finish() {
    serializer_.reset();
    message_.reset();
    owner_.reset();
    answered_ = true;
    if (keep_alive_) return read();
    error_code ignored;
    stream_.socket().shutdown(Socket::shutdown_send, ignored);
  }

  WebConnections& connections_;
  Counted counted_;
  WebStream stream_;
  std::uint64_t id_;
  beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  bool keep_alive_ = false, head_only_ = false, answered_ = false;
  std::shared_ptr<const void> owner_;
  std::optional<http::response<http::span_body<std::byte>>> message_;
  std::optional<http::response_serializer<http::span_body<std::byte>>> serializer_;
};

}  // namespace

struct WebServer::Impl {
  Impl(const WebLimits& limits, WebHandler& handler)
      : connections(limits, handler), acceptor(connections.context), tick(connections.context) {}

  Result<void> listen(const WebAddress& wanted) {
    error_code error;
    const auto address = asio::ip::make_address(wanted.address, error);
    if (error) return fail(ErrorCode::kUsage, wanted.address, "is no address");
    for (int i = 0; i < wanted.ports; ++i) {
      const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(wanted.port + i));
      if (acceptor.is_open()) acceptor.close(error);
      error = {};
      acceptor.open(endpoint.protocol(), error);
      if (!error) acceptor.set_option(Acceptor::reuse_address(true), error);
      if (!error) acceptor.bind(endpoint, error);
      if (!error) acceptor.listen(1024, error);
      if (!error) return {};
      if (error != asio::error::address_in_use) break;
    }
    const std::string where = fmt::format("{}:{}", wanted.address, wanted.port);
    if (error == asio::error::address_in_use)
      return fail(ErrorCode::kInternal, where, "another program listens on this port");
    return fail(ErrorCode::kUsage, where, "cannot listen: {}", error.message());
  }

  void accept() {
    acceptor.async_accept([this](error_code error, Socket socket) {
      if (error == asio::error::operation_aborted) return;
      // Out of descriptors: those that wait make room, and the next try is a tick later.
      if (error) return end_oldest(connections.limits.waiting / 4), retry_accept();
      start(std::move(socket));
      accept();
    });
  }

  void retry_accept() {
    const auto timer = std::make_shared<asio::steady_timer>(connections.context, kTick);
    timer->async_wait([this, timer](error_code error) {
      if (!error) accept();
    });
  }

  void start(Socket socket) {
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    if (connections.waiting.size() >= connections.limits.waiting) end_oldest(1);
    // Descriptors are left for the files of the program.
    if (connections.count >= connections.limits.connections)
      return connections.handler.refused(Refused::kConnection);
    std::make_shared<HttpConnection>(connections, std::move(socket))->read();
  }

  void end_oldest(std::size_t count) {
    for (; count > 0 && !connections.waiting.empty(); --count) {
      const auto end = std::move(connections.waiting.begin()->second);
      connections.waiting.erase(connections.waiting.begin());
      connections.handler.refused(Refused::kConnection);
      end();
    }
  }

  void pump_all() {
    // Copied: a session that ends leaves the set.
    const std::vector<SocketConnection*> sockets(connections.sockets.begin(), connections.sockets.end());
    for (auto* socket : sockets)
      if (connections.sockets.contains(socket)) socket->pump();
  }

  void start_tick() {
    tick.expires_after(kTick);
    tick.async_wait([this](error_code error) {
      if (error) return;
      connections.handler.tick(connections.now());
      pump_all();
      start_tick();
    });
  }

  WebConnections connections;
  Acceptor acceptor;
  asio::steady_timer tick;
  std::thread thread;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<WebServer>> WebServer::start(const WebAddress& address, const WebLimits& limits,
                                                    WebHandler& handler) {
  auto impl = std::make_unique<Impl>(limits, handler);
  if (auto listening = impl->listen(address); !listening) return forward_error(listening);
  impl->accept();
  impl->start_tick();
  impl->thread = std::thread([&context = impl->connections.context] { context.run(); });
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::~WebServer() {
  impl_->connections.context.stop();
  impl_->thread.join();
}

std::uint16_t WebServer::port() const {
  error_code ignored;
  return impl_->acceptor.local_endpoint(ignored).port();
}

void WebServer::post(std::function<void()> task) {
  asio::post(impl_->connections.context, [this, given = std::move(task)] {
    given();
    impl_->pump_all();
  });
}

std::size_t WebServer::connections() const { return impl_->connections.count; }

}  // namespace hm
