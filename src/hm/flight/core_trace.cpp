#include "hm/flight/core_trace.hpp"

#include <bit>

namespace hm {
namespace {

constexpr std::uint32_t kMagic = 0x31544d48;  // "HMT1"
constexpr std::size_t kCrcOffset = 124;

/// Writes little-endian words at a growing offset.
class Cursor {
 public:
  explicit Cursor(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  void put(std::uint64_t word, int size) {
    for (; size > 0; --size, word >>= 8) bytes_[at_++] = static_cast<std::uint8_t>(word & 0xff);
  }
  template <std::size_t N>
  void put(const std::array<float, N>& values) {
    for (const float value : values) put(std::bit_cast<std::uint32_t>(value), 4);
  }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

class ConstCursor {
 public:
  explicit ConstCursor(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint64_t get(int size) {
    std::uint64_t word = 0;
    for (int i = 0; i < size; ++i) word |= std::uint64_t{bytes_[at_++]} << (8 * i);
    return word;
  }
  template <std::size_t N>
  void get(std::array<float, N>& values) {
    for (float& value : values) value = std::bit_cast<float>(static_cast<std::uint32_t>(get(4)));
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

std::array<std::uint8_t, CoreTraceRecord::kBytes> encode(const CoreTraceRecord& record) {
  std::array<std::uint8_t, CoreTraceRecord::kBytes> bytes{};
  Cursor cursor(bytes);
  cursor.put(kMagic, 4);
  cursor.put(record.sequence, 4);
  cursor.put(static_cast<std::uint64_t>(record.stamp.ns), 8);
  cursor.put(static_cast<std::uint64_t>(record.kind), 1);
  cursor.put(record.state, 1);
  cursor.put(record.phase, 1);
  cursor.put(record.flags, 1);
  cursor.put(record.input);
  cursor.put(record.output);
  cursor.put(record.estimate);
  cursor.put(crc32(std::span<const std::uint8_t>(bytes).first(kCrcOffset)), 4);
  return bytes;
}

std::optional<CoreTraceRecord> decode_core_trace(
    std::span<const std::uint8_t, CoreTraceRecord::kBytes> bytes) {
  ConstCursor cursor(bytes);
  if (cursor.get(4) != kMagic) return {};
  CoreTraceRecord record;
  record.sequence = static_cast<std::uint32_t>(cursor.get(4));
  record.stamp.ns = static_cast<std::int64_t>(cursor.get(8));
  const auto kind = static_cast<std::uint8_t>(cursor.get(1));
  if (kind > static_cast<std::uint8_t>(CoreTraceRecord::Kind::kCommand)) return {};
  record.kind = static_cast<CoreTraceRecord::Kind>(kind);
  record.state = static_cast<std::uint8_t>(cursor.get(1));
  record.phase = static_cast<std::uint8_t>(cursor.get(1));
  record.flags = static_cast<std::uint8_t>(cursor.get(1));
  cursor.get(record.input);
  cursor.get(record.output);
  cursor.get(record.estimate);
  if (cursor.get(4) != crc32(bytes.first<kCrcOffset>())) return {};
  return record;
}

std::optional<CoreTraceRecord> CoreTraceReader::next() {
  if (rest_.size() < CoreTraceRecord::kBytes) return {};
  const std::optional<CoreTraceRecord> record = decode_core_trace(rest_.first<CoreTraceRecord::kBytes>());
  if (record) rest_ = rest_.subspan(CoreTraceRecord::kBytes);
  return record;
}

}  // namespace hm
