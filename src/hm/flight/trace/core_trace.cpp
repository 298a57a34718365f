#include "hm/flight/trace/core_trace.hpp"

#include "hm/core/bytes/little_endian.hpp"

namespace hm {
namespace {

constexpr std::uint32_t kMagic = 0x31544d48;  // "HMT1"
constexpr std::size_t kCrcOffset = 124;
constexpr std::size_t kFieldsOffset = 4;
constexpr std::uint8_t kFrameStart = 'H';

/// The fields between the magic number and the checksum, in their order.
template <class Record, class Visitor>
void visit_fields(Record& record, Visitor&& field) {
  field(record.sequence);
  field(record.stamp.ns);
  field(record.kind);
  field(record.state);
  field(record.phase);
  field(record.flags);
  field(record.input);
  field(record.output);
  field(record.estimate);
}

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
  store_little_endian(bytes.data(), kMagic);
  std::size_t at = kFieldsOffset;
  visit_fields(record, [&](const auto& field) {
    store_little_endian(bytes.data() + at, field);
    at += sizeof(field);
  });
  store_little_endian(bytes.data() + kCrcOffset,
                      crc32(std::span<const std::uint8_t>(bytes).first(kCrcOffset)));
  return bytes;
}

std::optional<CoreTraceRecord> decode_core_trace(
    std::span<const std::uint8_t, CoreTraceRecord::kBytes> bytes) {
  std::uint32_t magic = 0, crc = 0;
  load_little_endian(bytes.data(), magic);
  load_little_endian(bytes.data() + kCrcOffset, crc);
  if (magic != kMagic || crc != crc32(bytes.first<kCrcOffset>())) return {};
  CoreTraceRecord record;
  std::size_t at = kFieldsOffset;
  visit_fields(record, [&](auto& field) {
    load_little_endian(bytes.data() + at, field);
    at += sizeof(field);
  });
  if (static_cast<unsigned>(record.kind) >= CoreTraceRecord::kKinds) return {};
  return record;
}

CoreTraceFrame frame_of(const CoreTraceRecord& record) {
  const auto whole = encode(record);
  std::size_t length = CoreTraceFrame::kMaxLength;
  while (length > 0 && whole[kFieldsOffset + length - 1] == 0) --length;
  CoreTraceFrame frame;
  frame.bytes[0] = kFrameStart;
  frame.bytes[1] = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) frame.bytes[2 + i] = whole[kFieldsOffset + i];
  for (std::size_t i = 0; i < 4; ++i) frame.bytes[2 + length + i] = whole[kCrcOffset + i];
  frame.size = length + CoreTraceFrame::kOverhead;
  return frame;
}

void CoreTraceParser::drop(std::size_t count) {
  for (std::size_t i = count; i < size_; ++i) bytes_[i - count] = bytes_[i];
  size_ -= count;
}

std::optional<CoreTraceRecord> CoreTraceParser::next() {
  while (size_ >= 2) {
    const std::size_t length = bytes_[1], size = length + CoreTraceFrame::kOverhead;
    if (bytes_[0] == kFrameStart && length <= CoreTraceFrame::kMaxLength) {
      if (size_ < size) return {};
      std::array<std::uint8_t, CoreTraceRecord::kBytes> whole{};
      store_little_endian(whole.data(), kMagic);
      for (std::size_t i = 0; i < length; ++i) whole[kFieldsOffset + i] = bytes_[2 + i];
      for (std::size_t i = 0; i < 4; ++i) whole[kCrcOffset + i] = bytes_[2 + length + i];
      if (const auto record = decode_core_trace(whole)) {
        drop(size);
        return record;
      }
    }
    std::size_t gone = 1;
    while (gone < size_ && bytes_[gone] != kFrameStart) ++gone;
    skipped_ += static_cast<std::uint32_t>(gone);
    drop(gone);
  }
  return {};
}

std::optional<CoreTraceRecord> CoreTraceReader::next() {
  if (rest_.size() < CoreTraceRecord::kBytes) return {};
  const std::optional<CoreTraceRecord> record = decode_core_trace(rest_.first<CoreTraceRecord::kBytes>());
  if (record) rest_ = rest_.subspan(CoreTraceRecord::kBytes);
  return record;
}

}  // namespace hm
