#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hm/link/codec/mavlink_layout.hpp"
#include "hm/link/codec/mavlink_signing.hpp"
#include "hm/link/codec/mavlink_table.hpp"

namespace hm {

inline constexpr std::uint8_t kMavlink2Start = 0xFD, kMavlink1Start = 0xFE;
inline constexpr std::size_t kMavlinkHeaderBytes = 10, kMavlinkCrcBytes = 2;
inline constexpr std::size_t kMavlinkMaxFrame =
    kMavlinkHeaderBytes + kMavlinkMaxPayload + kMavlinkCrcBytes + kMavlinkSignatureBytes;
/// The only incompatible flag that exists: the frame is signed.
inline constexpr std::uint8_t kMavlinkSignedFlag = 1;

/// Who sends: number of the vehicle or ground station, and of the part of it.
struct MavlinkAddress {
  std::uint8_t system = 1, component = 1;
  bool operator==(const MavlinkAddress&) const = default;
};

/// A message between the wire and its struct.
struct MavlinkFrame {
  std::uint32_t message = 0;
  std::uint8_t sequence = 0;
  MavlinkAddress from;
  std::uint8_t length = 0;  ///< of the payload as sent, without trailing zeros
  bool is_signed = false;
  std::array<std::uint8_t, kMavlinkMaxPayload> payload{};  ///< zero behind `length`
};

using MavlinkBytes = std::array<std::uint8_t, kMavlinkMaxFrame>;

/// Writes a frame with checksum, and signature if `signer` is given. Returns its bytes; 0 if the message is
/// not in the table.
std::size_t write_mavlink_frame(const MavlinkFrame& frame, MavlinkBytes& bytes,
                                MavlinkSigner* signer = nullptr);

template <class Message>
[[nodiscard]] constexpr MavlinkFrame make_mavlink_frame(const Message& message, MavlinkAddress from,
                                                        std::uint8_t sequence) {
  MavlinkFrame frame{Message::kId, sequence, from, 0, false, {}};
  frame.length = store_mavlink_payload(message, frame.payload);
  return frame;
}

/// The message in a frame, or nothing if it is another one. Fields that an older sender did not know are
/// zero.
template <class Message>
[[nodiscard]] constexpr std::optional<Message> read_mavlink_message(const MavlinkFrame& frame) {
  if (frame.message != Message::kId) return std::nullopt;
  return load_mavlink_payload<Message>(frame.payload);
}

}  // namespace hm
