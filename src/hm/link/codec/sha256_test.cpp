#include "hm/link/codec/sha256.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "hm/link/codec/crc16.hpp"

namespace hm {
namespace {

std::string digest_text(std::string_view text, int repetitions = 1) {
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  Sha256 hash;
  for (int i = 0; i < repetitions; ++i) hash.add(bytes);
  std::string result;
  for (const std::uint8_t byte : hash.finish())
    for (const unsigned digit : {byte / 16U, byte % 16U}) result += "0123456789abcdef"[digit];
  return result;
}

// The examples of FIPS 180-4's publisher: empty, one block, two blocks, a million letters.
TEST(Sha256, GivesThePublishedDigests) {
  EXPECT_EQ(digest_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(digest_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(digest_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(digest_text("a", 1'000'000), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Crc16, GivesThePublishedCheckValues) {
  const auto crc_of = [](std::uint16_t start) {
    Crc16 crc(start);
    crc.add(std::string_view("123456789"));
    return crc.value();
  };
  EXPECT_EQ(crc_of(0xFFFF), 0x6F91);  // MAVLink (CRC-16/MCRF4XX)
  EXPECT_EQ(crc_of(0x00FF), 0x9DB8);  // the dissertation's protocol
}

}  // namespace
}  // namespace hm
