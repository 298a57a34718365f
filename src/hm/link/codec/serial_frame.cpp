#include "hm/link/codec/serial_frame.hpp"

#include "hm/link/codec/crc16.hpp"

namespace hm {
namespace {

constexpr std::array<std::uint8_t, 3> kUpStart{0x3E, 0x2A, 0x3E};
constexpr std::array<std::uint8_t, 2> kDownStart{0xFF, 0x09};
constexpr std::uint16_t kSerialCrcStart = 0x00FF;
constexpr std::size_t kSerialCrcBytes = 2;

constexpr bool serial_type_goes(std::uint8_t type, SerialDirection direction) {
  return type < kSerialTable.size() && (kSerialTable[type].direction == direction ||
                                        kSerialTable[type].direction == SerialDirection::kBoth);
}

std::span<const std::uint8_t> serial_start(SerialDirection direction) {
  if (direction == SerialDirection::kUp) return kUpStart;
  return kDownStart;
}

}  // namespace

std::size_t write_serial_frame(const SerialFrame& frame, SerialBytes& bytes) {
  if (frame.direction == SerialDirection::kBoth || !serial_type_goes(frame.type, frame.direction)) return 0;
  std::size_t end = 0;
  for (const std::uint8_t byte : serial_start(frame.direction)) bytes[end++] = byte;
  const std::uint8_t size = kSerialTable[frame.type].bytes;
  bytes[end++] = size;
  const std::size_t covered = end;
  bytes[end++] = frame.type;
  if (frame.direction == SerialDirection::kUp) bytes[end++] = frame.flag;
  for (std::size_t i = 0; i < size; ++i) bytes[end++] = frame.payload[i];
  Crc16 crc(kSerialCrcStart);
  crc.add(std::span(bytes).subspan(covered, end - covered));
  bytes[end++] = static_cast<std::uint8_t>(crc.value() & 0xFFU);
  bytes[end++] = static_cast<std::uint8_t>(crc.value() >> 8U);
  return end;
}

std::size_t SerialParser::push(std::span<const std::uint8_t> bytes) {
  std::size_t taken = 0;
  while (taken < bytes.size() && count_ < buffer_.size()) buffer_[count_++] = bytes[taken++];
  return taken;
}

std::span<const std::uint8_t> SerialParser::start() const { return serial_start(direction_); }

void SerialParser::drop(std::size_t bytes) {
  for (std::size_t i = bytes; i < count_; ++i) buffer_[i - bytes] = buffer_[i];
  count_ -= bytes;
}

/// Drops what cannot be the beginning of a frame.
void SerialParser::skip_to_start() {
  const auto begins = [&](std::size_t at) {
    for (std::size_t i = 0; i < start().size() && at + i < count_; ++i)
      if (buffer_[at + i] != start()[i]) return false;
    return true;
  };
  std::size_t at = 0;
  while (at < count_ && !begins(at)) ++at;
  counts_.skipped_bytes += at;
  if (at > 0) drop(at);
}

/// Type and size; otherwise the first byte is dropped.
bool SerialParser::header_is_good(std::size_t size_at) {
  const std::uint8_t size = buffer_[size_at], type = buffer_[size_at + 1];
  const bool known = serial_type_goes(type, direction_);
  if (known && size == kSerialTable[type].bytes) return true;
  ++(known ? counts_.wrong_size : counts_.wrong_type);
  ++counts_.skipped_bytes;
  drop(1);
  return false;
}

std::optional<SerialFrame> SerialParser::next() {
  const std::size_t size_at = start().size();
  const std::size_t payload_at = size_at + (direction_ == SerialDirection::kUp ? 3 : 2);
  while (true) {
    skip_to_start();
    if (count_ < size_at + 2) return std::nullopt;
    if (!header_is_good(size_at)) continue;
    const std::size_t end = payload_at + buffer_[size_at];
    if (count_ < end + kSerialCrcBytes) return std::nullopt;
    Crc16 crc(kSerialCrcStart);
    crc.add(std::span(buffer_).subspan(size_at + 1, end - size_at - 1));
    if (buffer_[end] != (crc.value() & 0xFFU) || buffer_[end + 1] != (crc.value() >> 8U)) {
      ++counts_.bad_crc;
      ++counts_.skipped_bytes;
      drop(1);
      continue;
    }
    SerialFrame frame{direction_, buffer_[size_at + 1], 0, {}};
    if (direction_ == SerialDirection::kUp) frame.flag = buffer_[size_at + 2];
    for (std::size_t i = 0; i < buffer_[size_at]; ++i) frame.payload[i] = buffer_[payload_at + i];
    ++counts_.frames;
    drop(end + kSerialCrcBytes);
    return frame;
  }
}

void SerialParser::give_up_incomplete() {
  if (count_ == 0) return;
  ++counts_.cut_off;
  ++counts_.skipped_bytes;
  drop(1);
}

}  // namespace hm
