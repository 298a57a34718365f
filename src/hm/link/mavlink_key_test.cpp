#include "hm/link/mavlink_key.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace hm {
namespace {

MavlinkKey counted() {
  MavlinkKey key{};
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::uint8_t>(0xF0 - i);
  return key;
}

std::string hexadecimal(const MavlinkKey& key) {
  std::string text;
  for (const std::uint8_t byte : key) text += fmt::format("{:02x}", byte);
  return text;
}

Result<MavlinkKey> parse(std::string_view text) {
  return parse_mavlink_key({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "mavlink.key");
}

TEST(MavlinkKey, IsReadAsBytesOrDigits) {
  const MavlinkKey key = counted();
  EXPECT_EQ(parse_mavlink_key(key, "mavlink.key").value(), key);
  const std::string digits = hexadecimal(key);
  for (const std::string& text : {digits, fmt::format("  {}\r\n", digits),
                                  fmt::format("{}\n{}\n", digits.substr(0, 32), digits.substr(32))})
    EXPECT_EQ(parse(text).value(), key) << text;
}

TEST(MavlinkKey, MistakesAreNamed) {
  const std::string good = hexadecimal(counted());
  for (const std::string& text :
       {std::string(), good.substr(1), good + "0", fmt::format("g{}", good.substr(1)),
        good.substr(0, 63) + "-", std::string(31, 'x'), std::string(33, 'x')}) {
    const auto key = parse(text);
    ASSERT_FALSE(key) << text;
    EXPECT_EQ(key.error().code, ErrorCode::kInvalidValue);
    EXPECT_EQ(key.error().where, "mavlink.key");
    EXPECT_THAT(key.error().message, testing::HasSubstr("32 bytes or 64 hexadecimal digits"));
  }
}

}  // namespace
}  // namespace hm
