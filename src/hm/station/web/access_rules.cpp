#include "hm/station/web/access_rules.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <utility>

namespace hm {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& letter : result) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return result;
}

/// Host without port and without the brackets of IPv6; nothing if it is malformed.
std::optional<std::string> name_of(std::string_view host) {
  std::string_view port;
  std::string_view name = host;
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
  } else if (const auto colon = host.find(':'); colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  const bool port_valid = port.empty() || (port.front() == ':' && port.size() <= 6 &&
                                           std::all_of(port.begin() + 1, port.end(),
                                                       [](unsigned char c) { return std::isdigit(c) != 0; }));
  if (name.empty() || !port_valid) return std::nullopt;
  return lower(name);
}

bool is_address(const std::string& name) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return ::inet_pton(AF_INET, name.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), bytes.data()) == 1;
}

}  // namespace

AccessRules::AccessRules(std::vector<std::string> names, std::string token)
    : names_(std::move(names)), token_(std::move(token)) {
  for (std::string& name : names_) name = lower(name);
}

std::optional<std::string> AccessRules::refuse_host(std::string_view host) const {
  const auto name = name_of(host);
  if (!name) return "the Host header is missing or malformed";
  // No address is looked up in the domain name system, thus none can be bound to another machine.
  if (is_address(*name) || *name == "localhost" ||
      std::find(names_.begin(), names_.end(), *name) != names_.end())
    return std::nullopt;
  return fmt::format("this server is not called '{}': open it by its address", name->substr(0, 60));
}

std::optional<std::string> AccessRules::refuse_origin(const WebRequest& request,
                                                      std::span<const std::string_view> friends) const {
  if (request.origin.empty()) return std::nullopt;
  const std::string origin = lower(request.origin);
  if (origin == "http://" + lower(request.host)) return std::nullopt;
  if (std::find(friends.begin(), friends.end(), origin) != friends.end()) return std::nullopt;
  return fmt::format("pages of '{}' may not use this server", origin.substr(0, 60));
}

std::optional<std::string> AccessRules::refuse_token(std::string_view query) const {
  if (token_.empty()) return std::nullopt;
  std::string_view given;
  while (!query.empty()) {
    const std::string_view part = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), part.size() + 1));
    if (part.starts_with("token=")) given = part.substr(6);
  }
  if (given.empty()) return "the token is missing: use the whole address that the program printed";
  unsigned different = given.size() == token_.size() ? 0 : 1;
  for (std::size_t i = 0; i < token_.size(); ++i)
    different |= static_cast<unsigned>(static_cast<unsigned char>(token_[i]) ^
                                       static_cast<unsigned char>(i < given.size() ? given[i] : '\0'));
  if (different == 0) return std::nullopt;
  return "the token is wrong: each start of the program makes a new one";
}

std::optional<std::string> reachable_address() {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry; entry = entry->ifa_next) {
    if (!entry->ifa_addr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0 || (entry->ifa_flags & IFF_UP) == 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    if (::inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size())) return std::string(text.data());
  }
  return std::nullopt;
}

std::string machine_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return {};
  return name.data();
}

}  // namespace hm
