#include "hm/station/testing/web_client.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "hm/core/check.hpp"

namespace hm {

int WebClient::Message::code() const {
  if (opcode != 8 || data.size() < 2) return 0;
  return static_cast<unsigned char>(data[0]) * 256 + static_cast<unsigned char>(data[1]);
}

WebClient::WebClient(std::uint16_t port, double patience_s, int receive_buffer_bytes)
    : port_(port), patience_s_(patience_s), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  if (receive_buffer_bytes > 0)
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(receive_buffer_bytes));
  // As browsers do: small messages do not wait for acknowledgements of TCP.
  const int no_delay = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &no_delay, sizeof(no_delay));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int connected = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  HM_CHECK(connected == 0, "cannot connect to port {}", port);
}

WebClient::~WebClient() { ::close(socket_); }

void WebClient::send_raw(std::string_view bytes) {
  while (!bytes.empty()) {
    const auto sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;  // the other end has closed: what is read next shows it
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

bool WebClient::has_data(double wait_s) {
  pollfd wait{socket_, POLLIN, 0};
  return !buffer_.empty() || ::poll(&wait, 1, static_cast<int>(wait_s * 1000)) > 0;
}

bool WebClient::fill() {
  pollfd wait{socket_, POLLIN, 0};
  if (::poll(&wait, 1, static_cast<int>(patience_s_ * 1000)) <= 0) return false;
  std::array<char, 65536> bytes{};
  const auto got = ::recv(socket_, bytes.data(), bytes.size(), 0);
  if (got <= 0) return false;
  buffer_.append(bytes.data(), static_cast<std::size_t>(got));
  return true;
}

std::optional<std::string> WebClient::take(std::size_t count) {
  while (buffer_.size() < count)
    if (!fill()) return std::nullopt;
  std::string taken = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return taken;
}

WebClient::Response WebClient::read_response(bool with_body) {
  std::size_t end = std::string::npos;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos)
    if (!fill()) return {};
  Response response;
  response.header = *take(end + 4);
  response.status = std::atoi(response.header.substr(9, 3).c_str());
  const std::string name = "Content-Length: ";
  const auto length = response.header.find(name);
  if (with_body && length != std::string::npos)
    response.body =
        take(std::strtoul(response.header.c_str() + length + name.size(), nullptr, 10)).value_or("");
  return response;
}

WebClient::Response WebClient::get(const std::string& target, const std::string& more_headers,
                                   const std::string& method) {
  send_raw(
      fmt::format("{} {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n{}\r\n", method, target, port_, more_headers));
  return read_response(method != "HEAD");
}

WebClient::Response WebClient::upgrade(const std::string& target, const std::string& more_headers,
                                       const std::string& host) {
  send_raw(
      fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n{}\r\n",
                  target, host.empty() ? fmt::format("127.0.0.1:{}", port_) : host, more_headers));
  return read_response();
}

void WebClient::send_frame(int opcode, std::string_view data, bool masked, bool last) {
  std::string frame(1, static_cast<char>((last ? 0x80 : 0) | opcode));
  const int mask_bit = masked ? 0x80 : 0;
  if (data.size() < 126) {
    frame += static_cast<char>(mask_bit | static_cast<int>(data.size()));
  } else {
    const int bytes = data.size() < 65536 ? 2 : 8;
    frame += static_cast<char>(mask_bit | (bytes == 2 ? 126 : 127));
    for (int i = bytes - 1; i >= 0; --i) frame += static_cast<char>(data.size() >> (8 * i) & 0xff);
  }
  constexpr std::array<char, 4> kMask{0x12, 0x34, 0x56, 0x78};
  if (masked) frame.append(kMask.data(), kMask.size());
  for (std::size_t i = 0; i < data.size(); ++i)
    frame += static_cast<char>(masked ? data[i] ^ kMask[i % 4] : data[i]);
  send_raw(frame);
}

std::optional<WebClient::Message> WebClient::read_message() {
  while (true) {
    const auto start = take(2);
    if (!start) return std::nullopt;
    Message message;
    message.opcode = (*start)[0] & 0x0f;
    std::size_t size = static_cast<unsigned char>((*start)[1]);
    if (size >= 126) {
      const auto long_size = take(size == 126 ? 2 : 8);
      if (!long_size) return std::nullopt;
      size = 0;
      for (const char byte : *long_size) size = size * 256 + static_cast<unsigned char>(byte);
    }
    auto data = take(size);
    if (!data) return std::nullopt;
    message.data = std::move(*data);
    if (message.opcode != 9) return message;
    send_frame(10, message.data);
  }
}

bool WebClient::wait_for_end() {
  while (fill()) buffer_.clear();
  char byte = 0;
  const auto got = ::recv(socket_, &byte, 1, MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK);
}

}  // namespace hm
