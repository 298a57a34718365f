#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "hm/station/web/rate_limit.hpp"

namespace hm {

/// A rate limit for each client by its address, in bounded memory: clients whose limit would let everything
/// through again are forgotten. Not thread safe: it belongs to the server's thread.
class ClientRates {
 public:
  static constexpr std::size_t kMaxClients = 1024;

  explicit ClientRates(double per_s) : per_s_(per_s) {}
  /// False if this client has asked too often.
  bool take(const std::string& client, Duration now);
  [[nodiscard]] std::size_t clients() const { return limits_.size(); }

 private:
  double per_s_;
  std::map<std::string, RateLimit> limits_;
};

/// Name under which the rate of a client counts, from its numeric address. Of IPv6 the network (the first 64
/// bits, RFC 4291), within which a machine chooses its addresses itself and may have as many as it likes
/// (RFC 8981): with a rate for each address it would have no limit. Other machines of that network share the
/// rate, and so do all that come by a link-local address (fe80::/64). Nothing for an address of this
/// machine's loopback.
std::optional<std::string> rated_client(const std::string& address);

}  // namespace hm
