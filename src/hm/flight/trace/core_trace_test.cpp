#include "hm/flight/trace/core_trace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

CoreTraceRecord random_record(Rng& rng) {
  CoreTraceRecord record;
  record.sequence = rng.below(1U << 31);
  record.stamp.ns = static_cast<std::int64_t>(rng.uniform(-1e18, 1e18));
  record.kind = static_cast<CoreTraceRecord::Kind>(rng.below(CoreTraceRecord::kKinds));
  record.state = static_cast<std::uint8_t>(rng.below(256));
  record.phase = static_cast<std::uint8_t>(rng.below(256));
  record.flags = static_cast<std::uint8_t>(rng.below(256));
  const auto any_bits = [&](auto& values) {
    for (float& value : values)
      value = std::bit_cast<float>(rng.below(0xffffffffU));  // infinities and NaN too
  };
  any_bits(record.input);
  any_bits(record.output);
  any_bits(record.estimate);
  return record;
}

template <std::size_t N>
bool same_bits(const std::array<float, N>& a, const std::array<float, N>& b) {
  for (std::size_t i = 0; i < N; ++i)
    if (std::bit_cast<std::uint32_t>(a[i]) != std::bit_cast<std::uint32_t>(b[i])) return false;
  return true;
}

TEST(CoreTrace, RecordsComeBackBitByBit) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const CoreTraceRecord record = random_record(rng);
    const auto back = decode_core_trace(encode(record));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->sequence, record.sequence);
    EXPECT_EQ(back->stamp, record.stamp);
    EXPECT_EQ(back->kind, record.kind);
    EXPECT_EQ(back->state, record.state);
    EXPECT_EQ(back->phase, record.phase);
    EXPECT_EQ(back->flags, record.flags);
    EXPECT_TRUE(same_bits(back->input, record.input) && same_bits(back->output, record.output) &&
                same_bits(back->estimate, record.estimate));
  }
}

TEST(CoreTrace, HasTheDocumentedLayout) {
  CoreTraceRecord record;
  record.sequence = 0x01020304;
  record.stamp.ns = 0x1122334455667788;
  record.kind = CoreTraceRecord::Kind::kHeight;
  record.input[0] = 1.0F;
  record.output[3] = -2.0F;
  const auto bytes = encode(record);
  EXPECT_EQ(bytes[0], 'H');
  EXPECT_EQ(bytes[3], '1');
  EXPECT_EQ(bytes[4], 0x04);
  EXPECT_EQ(bytes[8], 0x88);
  EXPECT_EQ(bytes[15], 0x11);
  EXPECT_EQ(bytes[16], 2);
  EXPECT_EQ(bytes[23], 0x3f);  // 1.0F is 0x3f800000
  EXPECT_EQ(bytes[87], 0xc0);  // -2.0F is 0xc0000000
  const std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc32(digits), 0xcbf43926U);
}

TEST(CoreTrace, EveryDamagedBitIsSeen) {
  Rng rng(2);
  const auto bytes = encode(random_record(rng));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(decode_core_trace(damaged)) << bit;
  }
}

TEST(CoreTrace, ACutFileIsReadableToItsLastWholeRecord) {
  Rng rng(3);
  std::vector<std::uint8_t> file;
  for (int i = 0; i < 5; ++i) {
    const auto bytes = encode(random_record(rng));
    file.insert(file.end(), bytes.begin(), bytes.end());
  }
  for (std::size_t length = 0; length <= file.size(); ++length) {
    CoreTraceReader reader(std::span<const std::uint8_t>(file).first(length));
    std::size_t records = 0;
    while (reader.next()) ++records;
    ASSERT_EQ(records, length / CoreTraceRecord::kBytes);
    ASSERT_EQ(reader.bytes_left(), length % CoreTraceRecord::kBytes);
  }
}

TEST(CoreTraceParser, FindsEveryWholeFrameBetweenDamagedBytes) {
  Rng rng(4);
  CoreTraceParser parser;
  std::vector<std::uint8_t> stream;
  std::vector<std::uint32_t> sent, found;
  for (int i = 0; i < 2000; ++i) {
    CoreTraceRecord record = random_record(rng);
    if (rng.below(2) == 0) record.output = {}, record.estimate = {};  // shorter
    const CoreTraceFrame frame = frame_of(record);
    const auto bytes = std::span(frame.bytes).first(frame.size);
    const std::uint32_t kind = rng.below(3);
    for (std::uint32_t at = 0; kind == 0 && at < rng.below(200); ++at)
      stream.push_back(rng.below(2) == 0 ? std::uint8_t{'H'} : static_cast<std::uint8_t>(rng.below(256)));
    const auto size = kind == 1
                          ? static_cast<std::ptrdiff_t>(rng.below(static_cast<std::uint32_t>(frame.size)))
                          : bytes.end() - bytes.begin();
    stream.insert(stream.end(), bytes.begin(), std::min(bytes.end(), bytes.begin() + size));
    if (kind != 1) sent.push_back(record.sequence);
  }
  stream.insert(stream.end(), 256, 0);  // a false start waits for its last byte
  for (const std::uint8_t byte : stream) {
    parser.push(byte);
    while (const auto record = parser.next()) found.push_back(record->sequence);
  }
  EXPECT_GT(sent.size(), 1000u);
  EXPECT_EQ(found, sent);
  EXPECT_GT(parser.skipped(), 10000u);
}

TEST(CoreTraceParser, FramesComeBackBitByBitAndAreShort) {
  Rng rng(5);
  CoreTraceParser parser;
  for (int i = 0; i < 1000; ++i) {
    CoreTraceRecord record = random_record(rng);
    const std::size_t inputs = rng.below(14);
    for (std::size_t at = inputs; at < 13; ++at) record.input[at] = 0;
    if (inputs < 13) record.output = {}, record.estimate = {};
    const CoreTraceFrame frame = frame_of(record);
    if (inputs < 13) {
      EXPECT_LE(frame.size, 22 + 4 * inputs);
    }
    for (std::size_t at = 0; at < frame.size; ++at) {
      EXPECT_FALSE(parser.next());
      parser.push(frame.bytes[at]);
    }
    const auto back = parser.next();
    ASSERT_TRUE(back);
    EXPECT_EQ(encode(*back), encode(record));
  }
  EXPECT_EQ(parser.skipped(), 0u);
}

}  // namespace
}  // namespace hm
