#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hm/link/transport/file_descriptor.hpp"
#include "hm/link/transport/transport.hpp"

namespace hm {

/// UDP over IPv4. Remembers who sent to it and writes to all of them.
class UdpSocket : public Transport {
 public:
  /// Number of senders that are answered: those that sent last.
  static constexpr std::size_t kMaxPeers = 8;
  struct Peer {
    std::string address;  ///< dotted decimal
    std::uint16_t port = 0;
    bool operator==(const Peer&) const = default;
  };

  /// Listens on `address`:`port` (port 0: any free one). Errors: kUsage for an address that is none,
  /// kUnreadable if the port is taken.
  static Result<std::unique_ptr<UdpSocket>> listen(const std::string& address, std::uint16_t port);
  /// Adds a peer that is written to before it has sent anything, and for good; kUsage for an address that is
  /// none.
  Result<void> add_peer(const Peer& peer);

  std::size_t read(std::span<std::uint8_t> buffer) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool wait(Duration limit) override { return descriptor_.wait_readable(limit); }
  [[nodiscard]] bool is_datagram() const override { return true; }
  [[nodiscard]] bool is_open() const override { return true; }
  [[nodiscard]] std::string name() const override;
  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// Those given first, then senders, the latest one at the end.
  [[nodiscard]] const std::vector<Peer>& peers() const { return peers_; }

 private:
  UdpSocket() = default;
  void remember(const Peer& peer);

  FileDescriptor descriptor_;
  std::string address_;
  std::uint16_t port_ = 0;
  std::vector<Peer> peers_;
  std::size_t given_ = 0;  ///< of them, at the front
};

}  // namespace hm
