#include "hm/flight/core_trace.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

CoreTraceRecord random_record(Rng& rng) {
  CoreTraceRecord record;
  record.sequence = rng.below(1U << 31);
  record.stamp.ns = static_cast<std::int64_t>(rng.uniform(-1e18, 1e18));
  record.kind = static_cast<CoreTraceRecord::Kind>(rng.below(4));
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

}  // namespace
}  // namespace hm
