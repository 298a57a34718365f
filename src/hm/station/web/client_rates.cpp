#include "hm/station/web/client_rates.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace hm {

bool ClientRates::take(const std::string& client, Duration now) {
  auto found = limits_.find(client);
  if (found == limits_.end()) {
    if (limits_.size() >= kMaxClients)
      std::erase_if(limits_, [&](const auto& entry) { return entry.second.is_rested(now); });
    // More than kMaxClients within two seconds: all start anew, rather than that somebody is locked out.
    if (limits_.size() >= kMaxClients) limits_.clear();
    found = limits_.emplace(client, RateLimit(per_s_, now)).first;
  }
  return found->second.take(now);
}

std::optional<std::string> rated_client(const std::string& address) {
  constexpr std::size_t kNetworkBytes = 8;
  constexpr const char* kMapped = "::ffff:";  // IPv4 on a socket of IPv6
  in6_addr whole{};
  if (::inet_pton(AF_INET6, address.substr(0, address.find('%')).c_str(), &whole) == 1) {
    if (IN6_IS_ADDR_V4MAPPED(&whole)) return rated_client(address.substr(std::string(kMapped).size()));
    if (IN6_IS_ADDR_LOOPBACK(&whole)) return std::nullopt;
    std::fill(whole.s6_addr + kNetworkBytes, whole.s6_addr + sizeof(whole.s6_addr), std::uint8_t{0});
    std::array<char, INET6_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET6, &whole, text.data(), text.size());
    return std::string(text.data()) + "/64";
  }
  if (address.starts_with("127.")) return std::nullopt;
  return address;
}

}  // namespace hm
