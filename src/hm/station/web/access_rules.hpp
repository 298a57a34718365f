#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/station/web/web_types.hpp"

namespace hm {

/// Who may ask for what: against foreign pages in the same browser (Origin), against names that are bound to
/// this address (Host, DNS rebinding), and against whoever does not have the token.
class AccessRules {
 public:
  /// `names`: what this machine may be called besides its addresses. `token`: empty if none is needed, which
  /// is for loopback only.
  AccessRules(std::vector<std::string> names, std::string token);

  /// Why the Host header is refused: neither an address nor a name of this machine.
  [[nodiscard]] std::optional<std::string> refuse_host(std::string_view host) const;
  /// Why a WebSocket is refused: its page came from elsewhere. Programs send no Origin. `friends`: origins
  /// that are taken besides.
  [[nodiscard]] std::optional<std::string> refuse_origin(
      const WebRequest& request, std::span<const std::string_view> friends = {}) const;
  /// Why there is no access without the right `?token=...`; compared in the same time whatever is wrong.
  [[nodiscard]] std::optional<std::string> refuse_token(std::string_view query) const;

 private:
  std::vector<std::string> names_;
  std::string token_;
};

/// First address of this machine that others reach, nothing without a network; IPv4.
std::optional<std::string> reachable_address();

/// Name of this machine.
std::string machine_name();

}  // namespace hm
