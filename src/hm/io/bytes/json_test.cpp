#include "hm/io/bytes/json.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"
#include "hm/io/testing/io_test_support.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

TEST(Json, WritesKeysInOrderAndNoNan) {
  JsonValue json;
  json["z"] = 1;
  json["a"] =
      JsonValue::Array{true, nullptr, "text", 0.1, std::nan(""), -std::numeric_limits<double>::infinity()};
  json["m"]["inner"] = std::int64_t{-9007199254740993};
  EXPECT_EQ(to_json_text(json, JsonStyle::kCompact),
            R"({"z":1,"a":[true,null,"text",0.1,null,null],"m":{"inner":-9007199254740993}})");
  EXPECT_EQ(to_json_text(JsonValue::object({{"a", 1}})), "{\n  \"a\": 1\n}");
  EXPECT_EQ(to_json_text(JsonValue::object(), JsonStyle::kCompact), "{}");
  EXPECT_EQ(to_json_text(JsonValue::array(), JsonStyle::kCompact), "[]");
  EXPECT_EQ(to_json_text("a\"\n\xff", JsonStyle::kCompact), "\"a\\\"\\n\xef\xbf\xbd\"");  // not UTF-8: U+FFFD
}

JsonValue random_value(Rng& rng, int depth) {
  switch (rng.below(depth > 0 ? 7 : 5)) {
    case 0:
      return nullptr;
    case 1:
      return rng.below(2) == 0;
    case 2:
      return static_cast<std::int64_t>(std::uint64_t{rng.next_u32()} << 32u | rng.next_u32());
    case 3:
      return std::ldexp(rng.uniform(-1, 1), static_cast<int>(rng.below(600)) - 300);
    case 4: {
      std::string text;
      for (std::uint32_t i = rng.below(8); i > 0; --i) text += static_cast<char>(rng.below(128));
      return text;
    }
    case 5: {
      JsonValue array = JsonValue::array();
      for (std::uint32_t i = rng.below(5); i > 0; --i) array.push_back(random_value(rng, depth - 1));
      return array;
    }
    default: {
      JsonValue object = JsonValue::object();
      for (std::uint32_t i = rng.below(5); i > 0; --i)
        object["key " + std::to_string(rng.below(100))] = random_value(rng, depth - 1);
      return object;
    }
  }
}

bool same(const JsonValue& a, const JsonValue& b) {
  if (a.data().index() != b.data().index()) return false;
  if (const auto* items = a.as_array())
    return std::equal(items->begin(), items->end(), b.as_array()->begin(), b.as_array()->end(), same);
  if (const auto* members = a.as_object())
    return std::equal(
        members->begin(), members->end(), b.as_object()->begin(), b.as_object()->end(),
        [](const auto& x, const auto& y) { return x.first == y.first && same(x.second, y.second); });
  if (const auto* text = a.as_string()) return *text == *b.as_string();
  if (const auto* flag = a.as_bool()) return *flag == *b.as_bool();
  if (const auto* integer = a.as_integer()) return *integer == *b.as_integer();
  return a.is_null() || a.number_or(1) == b.number_or(2);
}

TEST(Json, ReadsBackWhatItWrote) {
  Rng rng(1);
  for (int i = 0; i < 500; ++i) {
    const JsonValue value = random_value(rng, 5);
    const auto style = i % 2 == 0 ? JsonStyle::kPretty : JsonStyle::kCompact;
    const auto read = parse_json(to_json_text(value, style), "memory");
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_TRUE(same(*read, value)) << to_json_text(value) << to_json_text(*read);
  }
}

TEST(Json, ErrorsNameLineAndColumn) {
  const auto result = parse_json("{\n  \"a\": 1,\n  \"b\": tru\n}", "report.json");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().where, HasSubstr("report.json:3:"));
  for (const char* text : {"", "{", "[1,]", "{\"a\"}", "nan", "1 2", "\"\x01\"", "{\"a\":1}}", "[1e999]"})
    EXPECT_FALSE(parse_json(text, "x")) << text;
}

TEST(Json, LimitsDepthAndKeepsLargeNumbers) {
  EXPECT_FALSE(parse_json(std::string(1'000'000, '['), "x"));
  EXPECT_FALSE(parse_json(std::string(201, '[') + std::string(201, ']'), "x"));
  EXPECT_TRUE(parse_json(std::string(200, '[') + std::string(200, ']'), "x"));
  EXPECT_EQ(parse_json("18446744073709551615", "x")->number_or(0), 18446744073709551615.0);
  EXPECT_EQ(*parse_json("-9223372036854775808", "x")->as_integer(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(*parse_json(R"({"a":1,"a":2})", "x")->find("a")->as_integer(), 2);
}

TEST(Json, SurvivesDamage) {
  Rng rng(3);
  JsonValue value = JsonValue::array();
  for (int i = 0; i < 10; ++i) value.push_back(random_value(rng, 4));
  int accepted = 0, refused = 0;
  const int cases = test::for_each_damaged(to_json_text(value), 1000, [&](const std::string& text) {
    ++(parse_json(text, "damaged") ? accepted : refused);
  });
  EXPECT_GT(refused, cases / 4);
  EXPECT_GT(accepted, 0);  // a digit of a number, a letter of a text
}

}  // namespace
}  // namespace hm
