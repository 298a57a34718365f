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
/// bits), as one client has all of its addresses. Nothing for an address of this machine's loopback.
std::optional<std::string> rated_client(const std::string& address);

}  // namespace hm
