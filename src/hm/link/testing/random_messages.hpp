#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/core/rng.hpp"
#include "hm/link/codec/mavlink_frame.hpp"
#include "hm/link/codec/mavlink_parser.hpp"

/// Messages and packets with random fields, for tests.
namespace hm::link_testing {

/// Fills every field with random bits; a float may become a NaN or an infinity.
struct RandomFields {
  Rng& rng;
  template <class Field>
  void field(std::string_view, Field& value) {
    std::uint8_t bytes[sizeof(Field)];
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(rng.next_u32());
    load_little_endian(bytes, value);
  }
  template <class Field>
  void extension(std::string_view name, Field& value) {
    field(name, value);
  }
};

template <class Message>
Message random_message(Rng& rng) {
  Message message;
  Message::visit(message, RandomFields{rng});
  return message;
}

/// The frame's bytes on the wire.
inline std::vector<std::uint8_t> wire_bytes(const MavlinkFrame& frame, MavlinkSigner* signer = nullptr) {
  MavlinkBytes bytes{};
  const std::size_t count = write_mavlink_frame(frame, bytes, signer);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
}

/// A frame of the n-th message of the table with random fields.
inline MavlinkFrame random_frame(std::size_t n, Rng& rng) {
  MavlinkFrame frame;
  std::size_t i = 0;
  MavlinkMessages::for_each([&]<class Message>() {
    if (i++ == n % MavlinkMessages::kCount)
      frame = make_mavlink_frame(random_message<Message>(rng), {1, 2}, static_cast<std::uint8_t>(n));
  });
  return frame;
}

inline std::vector<MavlinkFrame> parse_all(MavlinkParser& parser, std::span<const std::uint8_t> bytes) {
  std::vector<MavlinkFrame> frames;
  parser.parse(bytes, [&](const MavlinkFrame& frame) { frames.push_back(frame); });
  return frames;
}

}  // namespace hm::link_testing
