#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/link/mavlink_peer.hpp"

namespace hm {

/// A key that signs MAVLink, from a file's contents: its 32 bytes, or 64 hexadecimal digits between blanks or
/// line ends. `name` is the file in errors (kInvalidValue).
Result<MavlinkKey> parse_mavlink_key(std::span<const std::uint8_t> bytes, const std::string& name);

/// Options with a key, if there is one.
[[nodiscard]] MavlinkPeerOptions with_key(MavlinkPeerOptions options, const std::optional<MavlinkKey>& key);
/// Sets the clock of signatures to that of this machine: what was signed before is not accepted again.
void start_signing(MavlinkPeer& peer);

}  // namespace hm
