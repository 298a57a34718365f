#pragma once
#include <filesystem>
#include <optional>

#include "hm/core/result.hpp"
#include "hm/link/mavlink_peer.hpp"

namespace hm {

/// A key that signs MAVLink, from a file: its 32 bytes, or 64 hexadecimal digits between blanks or line ends.
/// Errors: not found, unreadable, kInvalidValue for anything else.
Result<MavlinkKey> read_mavlink_key(const std::filesystem::path& path);

/// Options with a key, if there is one.
[[nodiscard]] MavlinkPeerOptions with_key(MavlinkPeerOptions options, const std::optional<MavlinkKey>& key);
/// Sets the clock of signatures to that of this machine: what was signed before is not accepted again.
void start_signing(MavlinkPeer& peer);

}  // namespace hm
