#include "hm/pipeline/flight/external/mavlink_key.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"

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

TEST(MavlinkKey, IsReadAsBytesOrDigits) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "key";
  const MavlinkKey key = counted();
  ASSERT_TRUE(write_file_bytes(path, key));
  EXPECT_EQ(read_mavlink_key(path).value(), key);
  for (const std::string& text : {hexadecimal(key), "  " + hexadecimal(key) + "\r\n",
                                  hexadecimal(key).substr(0, 32) + "\n" + hexadecimal(key).substr(32) + "\n"}) {
    ASSERT_TRUE(write_file_text(path, text));
    EXPECT_EQ(read_mavlink_key(path).value(), key) << text;
  }
}

TEST(MavlinkKey, MistakesAreNamed) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "key";
  EXPECT_EQ(read_mavlink_key(path).error().code, ErrorCode::kNotFound);
  const std::string good = hexadecimal(counted());
  for (const std::string& text : {std::string(), good.substr(1), good + "0", "g" + good.substr(1),
                                  good.substr(0, 63) + "-", std::string(31, 'x'), std::string(33, 'x')}) {
    ASSERT_TRUE(write_file_text(path, text));
    const auto key = read_mavlink_key(path);
    ASSERT_FALSE(key) << text;
    EXPECT_EQ(key.error().code, ErrorCode::kInvalidValue);
    EXPECT_EQ(key.error().where, path.string());
    EXPECT_THAT(key.error().message, testing::HasSubstr("32 bytes or 64 hexadecimal digits"));
  }
}

}  // namespace
}  // namespace hm
