#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hm/link/codec/serial_packets.hpp"

namespace hm {

/// Frames of the dissertation's serial protocol. Up: 3E 2A 3E, size, type, flag, payload, checksum over type,
/// flag and payload. Down: FF 09, size, type, payload, checksum over type and payload. The checksum (Crc16
/// from 0x00FF) does not protect the size: we also demand that it is the one that belongs to the type.
inline constexpr std::size_t kSerialMaxPayload = 188;
inline constexpr std::size_t kSerialMaxFrame = 6 + kSerialMaxPayload + 2;
/// Bit of the flag that asks for an ACK.
inline constexpr std::uint8_t kSerialAckFlag = 1;

struct SerialFrame {
  SerialDirection direction = SerialDirection::kUp;  ///< kUp or kDown
  std::uint8_t type = 0;
  std::uint8_t flag = 0;  ///< up frames only
  std::array<std::uint8_t, kSerialMaxPayload> payload{};
};

using SerialBytes = std::array<std::uint8_t, kSerialMaxFrame>;

/// Writes a frame and returns its bytes; 0 if there is no such type or it does not go this way.
std::size_t write_serial_frame(const SerialFrame& frame, SerialBytes& bytes);

template <class Packet>
[[nodiscard]] constexpr SerialFrame make_serial_frame(const Packet& packet, SerialDirection direction,
                                                      std::uint8_t flag = 0) {
  SerialFrame frame{direction, Packet::kType, flag, {}};
  Packet::visit(packet, detail::SerialStore{frame.payload.data()});
  return frame;
}

template <class Packet>
[[nodiscard]] constexpr std::optional<Packet> read_serial_packet(const SerialFrame& frame) {
  if (frame.type != Packet::kType) return std::nullopt;
  Packet packet;
  Packet::visit(packet, detail::SerialLoad{frame.payload.data()});
  return packet;
}

struct SerialParserCounts {
  std::uint64_t frames = 0;         ///< accepted
  std::uint64_t bad_crc = 0;        ///< candidates with a wrong checksum
  std::uint64_t wrong_type = 0;     ///< candidates of no type of this direction
  std::uint64_t wrong_size = 0;     ///< candidates whose size is not that of their type
  std::uint64_t cut_off = 0;        ///< candidates that a silence ended
  std::uint64_t skipped_bytes = 0;  ///< bytes that belong to no frame
};

/// Finds the frames of one direction in a stream. What follows a false start is read again, so no frame that
/// arrived whole is lost. Start, type and size must fit together (four bytes), so noise rarely holds anything
/// up.
class SerialParser {
 public:
  /// The published time without bytes after which an incomplete frame is given up.
  static constexpr std::int64_t kSilenceUs = 1'000'000;

  explicit SerialParser(SerialDirection direction) : direction_(direction) {}
  std::size_t push(std::span<const std::uint8_t> bytes);
  std::optional<SerialFrame> next();
  /// Drops what is incomplete; call it after kSilenceUs without bytes, then next() until it returns nothing.
  void give_up_incomplete();

  /// Calls `handle(const SerialFrame&)` for each frame in a piece of a stream.
  template <class Handle>
  void parse(std::span<const std::uint8_t> bytes, Handle&& handle) {
    while (!bytes.empty()) {
      bytes = bytes.subspan(push(bytes));
      while (const auto frame = next()) handle(*frame);
    }
  }
  [[nodiscard]] const SerialParserCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] std::span<const std::uint8_t> start() const;
  void drop(std::size_t bytes);
  void skip_to_start();
  [[nodiscard]] bool header_is_good(std::size_t size_at);

  SerialDirection direction_;
  std::array<std::uint8_t, 2 * kSerialMaxFrame> buffer_{};
  std::size_t count_ = 0;
  SerialParserCounts counts_;
};

}  // namespace hm
