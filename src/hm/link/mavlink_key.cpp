#include "hm/link/mavlink_key.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <string>

namespace hm {

Result<MavlinkKey> parse_mavlink_key(std::span<const std::uint8_t> bytes, const std::string& name) {
  MavlinkKey key{};
  if (bytes.size() == key.size()) {
    std::ranges::copy(bytes, key.begin());
    return key;
  }
  std::string digits(bytes.begin(), bytes.end());
  std::erase_if(digits, [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; });
  bool is_hexadecimal = digits.size() == 2 * key.size();
  for (std::size_t i = 0; is_hexadecimal && i < key.size(); ++i) {
    const char* const begin = digits.data() + 2 * i;
    is_hexadecimal = std::from_chars(begin, begin + 2, key[i], 16).ptr == begin + 2;
  }
  if (is_hexadecimal) return key;
  return fail(ErrorCode::kInvalidValue, name,
              "a key of MAVLink is 32 bytes or 64 hexadecimal digits; this file has {} bytes", bytes.size());
}

MavlinkPeerOptions with_key(MavlinkPeerOptions options, const std::optional<MavlinkKey>& key) {
  options.key = key;
  return options;
}

void start_signing(MavlinkPeer& peer) {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
  if (us > 0) peer.set_signing_time(static_cast<std::uint64_t>(us));
}

}  // namespace hm
