#include "hm/link/transport/transport_url.hpp"

#include <charconv>
#include <optional>
#include <string_view>

#include "hm/link/transport/serial_port.hpp"
#include "hm/link/transport/udp_socket.hpp"

namespace hm {
namespace {

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

Result<std::unique_ptr<Transport>> open_udp(const std::string& text, const std::string& address, int port) {
  constexpr int kHighestPort = 65535;
  if (port < 1 || port > kHighestPort) return fail(ErrorCode::kUsage, text, "{} is no port", port);
  const auto number = static_cast<std::uint16_t>(port);
  const bool listens = address == "listen";
  auto socket = UdpSocket::listen(listens ? "127.0.0.1" : "0.0.0.0", listens ? number : std::uint16_t{0});
  if (!socket) return forward_error(socket);
  if (!listens) {
    if (const auto added = (*socket)->add_peer({address, number}); !added) return forward_error(added);
  }
  return std::unique_ptr<Transport>(std::move(*socket));
}

}  // namespace

Result<std::unique_ptr<Transport>> open_transport(const std::string& text) {
  const std::size_t kind_end = text.find(':'), last = text.rfind(':');
  const auto number =
      last == std::string::npos ? std::nullopt : whole_number(std::string_view(text).substr(last + 1));
  const std::string_view kind = std::string_view(text).substr(0, kind_end);
  if (!number || last == kind_end || (kind != "udp" && kind != "serial"))
    return fail(ErrorCode::kUsage, text,
                "is neither udp:ADDRESS:PORT, udp:listen:PORT nor serial:DEVICE:BAUD");
  const std::string place = text.substr(kind_end + 1, last - kind_end - 1);
  if (kind == "udp") return open_udp(text, place, *number);
  auto port = SerialPort::open(place, *number);
  if (!port) return forward_error(port);
  return std::unique_ptr<Transport>(std::move(*port));
}

}  // namespace hm
