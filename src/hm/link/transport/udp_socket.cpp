#include "hm/link/transport/udp_socket.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>

namespace hm {
namespace {

std::optional<sockaddr_in> socket_address(const std::string& address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &result.sin_addr) != 1) return std::nullopt;
  return result;
}

UdpSocket::Peer peer_of(const sockaddr_in& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  return {text.data(), ntohs(address.sin_port)};
}

}  // namespace

Result<std::unique_ptr<UdpSocket>> UdpSocket::listen(const std::string& address, std::uint16_t port) {
  const std::string where = fmt::format("{}:{}", address, port);
  const auto wanted = socket_address(address, port);
  if (!wanted) return fail(ErrorCode::kUsage, where, "is no IPv4 address");
  std::unique_ptr<UdpSocket> result(new UdpSocket);
  result->descriptor_.reset(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int descriptor = result->descriptor_.get();
  sockaddr_in bound = *wanted;
  socklen_t size = sizeof(bound);
  if (descriptor < 0 || ::bind(descriptor, reinterpret_cast<const sockaddr*>(&bound), size) != 0 ||
      ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&bound), &size) != 0)
    return fail(ErrorCode::kUnreadable, where, "cannot listen: {}", std::generic_category().message(errno));
  result->address_ = address;
  result->port_ = ntohs(bound.sin_port);
  return result;
}

Result<void> UdpSocket::add_peer(const Peer& peer) {
  if (!socket_address(peer.address, peer.port) || peer.port == 0)
    return fail(ErrorCode::kUsage, fmt::format("{}:{}", peer.address, peer.port),
                "is no IPv4 address and port");
  const auto given_end = peers_.begin() + static_cast<std::ptrdiff_t>(given_);
  if (std::find(peers_.begin(), given_end, peer) != given_end) return {};
  peers_.insert(given_end, peer);
  ++given_;
  return {};
}

void UdpSocket::remember(const Peer& peer) {
  const auto given_end = peers_.begin() + static_cast<std::ptrdiff_t>(given_);
  if (std::find(peers_.begin(), given_end, peer) != given_end) return;
  const auto known = std::find(given_end, peers_.end(), peer);
  if (known != peers_.end())
    peers_.erase(known);
  else if (peers_.size() >= given_ + kMaxPeers)
    peers_.erase(given_end);
  peers_.push_back(peer);
}

std::size_t UdpSocket::read(std::span<std::uint8_t> buffer) {
  // An error that a former write() brought back (nobody listens there) is read and skipped.
  constexpr int kTries = 4;
  for (int i = 0; i < kTries; ++i) {
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    const ssize_t count = ::recvfrom(descriptor_.get(), buffer.data(), buffer.size(), 0,
                                     reinterpret_cast<sockaddr*>(&from), &size);
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
    if (count <= 0) continue;
    remember(peer_of(from));
    return static_cast<std::size_t>(count);
  }
  return 0;
}

bool UdpSocket::write(std::span<const std::uint8_t> bytes) {
  bool all = !peers_.empty();
  for (const Peer& peer : peers_) {
    const auto address = socket_address(peer.address, peer.port);
    const ssize_t count = ::sendto(descriptor_.get(), bytes.data(), bytes.size(), 0,
                                   reinterpret_cast<const sockaddr*>(&*address), sizeof(*address));
    all &= count == static_cast<ssize_t>(bytes.size());
  }
  return all;
}

std::string UdpSocket::name() const { return fmt::format("udp {}:{}", address_, port_); }

}  // namespace hm
