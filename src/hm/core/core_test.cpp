#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/core/hash.hpp"
#include "hm/core/json_value.hpp"
#include "hm/core/parallel.hpp"
#include "hm/core/params.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/core/time.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

enum class Flavour { kSweet, kSour };
constexpr std::array<std::string_view, 2> kFlavourNames{"sweet", "sour"};

struct ExampleParams {
  double size_m = 0.5;
  int count = 3;
  bool fast = false;
  std::string label = "a \"b\"";
  Flavour flavour = Flavour::kSweet;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"size_m", {0.1, 1.0}, "how large"}, self.size_m);
    v(ParamDoc{"count", {1, 10}, "how many"}, self.count);
    v(ParamDoc{"fast", {}, "hurry"}, self.fast);
    v(ParamDoc{"label", {}, "words"}, self.label);
    v(ParamDoc{"flavour", {}, "taste"}, self.flavour, kFlavourNames);
  }
};

TEST(Params, SetChangesEveryKind) {
  ExampleParams params;
  ParamList list;
  list.add("ex", params);
  for (const char* text :
       {"ex.size_m=0.25", "ex.count=7", "ex.fast=true", "ex.label=hello", "ex.flavour=sour"})
    ASSERT_TRUE(list.set(text)) << text;
  EXPECT_EQ(params.size_m, 0.25);
  EXPECT_EQ(params.count, 7);
  EXPECT_TRUE(params.fast);
  EXPECT_EQ(params.label, "hello");
  EXPECT_EQ(params.flavour, Flavour::kSour);
}

TEST(Params, UnknownKeyNamesTheNearest) {
  ExampleParams params;
  ParamList list;
  list.add("ex", params);
  const auto result = list.set("ex.sise_m=0.3");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("did you mean 'ex.size_m'"));
}

TEST(Params, RejectsWrongValuesAndChangesNothing) {
  ExampleParams params;
  ParamList list;
  list.add("ex", params);
  for (const char* text : {"ex.size_m=2", "ex.size_m=nan", "ex.size_m=inf", "ex.size_m=wide", "ex.count=1.5",
                           "ex.count=0", "ex.fast=1", "ex.flavour=bitter", "ex.size_m", "="})
    EXPECT_FALSE(list.set(text)) << text;
  EXPECT_EQ(params.size_m, 0.5);
  EXPECT_EQ(params.count, 3);
}

TEST(Params, TomlRoundTrip) {
  ExampleParams params{.size_m = 1.0, .count = 9, .fast = true, .label = "x\ny", .flavour = Flavour::kSour};
  ParamList list;
  list.add("ex", params);
  const std::string text = list.to_toml();
  ExampleParams read;
  ParamList read_list;
  read_list.add("ex", read);
  const auto result = read_list.read_toml(text, "memory");
  ASSERT_TRUE(result) << result.error().message << "\n" << text;
  EXPECT_EQ(read.size_m, 1.0);
  EXPECT_EQ(read.count, 9);
  EXPECT_TRUE(read.fast);
  EXPECT_EQ(read.label, "x\ny");
  EXPECT_EQ(read.flavour, Flavour::kSour);
}

struct SingleParams {
  float gain = 0.7F, ratio = 1, tiny = 1e-9F;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"gain", {0.7, 4}, "0.7 is not exact in either precision"}, self.gain);
    v(ParamDoc{"ratio", {}, "any"}, self.ratio);
    v(ParamDoc{"tiny", {}, "any"}, self.tiny);
  }
};

TEST(Params, SinglePrecisionIsReadWrittenAndCheckedAsItsOwnKind) {
  SingleParams params;
  ParamList list;
  list.add("s", params);
  EXPECT_TRUE(list.check()) << "0.7 rounded to single precision is less than the range's 0.7";
  EXPECT_THAT(list.to_toml(), HasSubstr("gain = 0.7\n"));
  EXPECT_THAT(list.to_toml(), HasSubstr("ratio = 1.0\n"));
  for (const char* text : {"s.gain=0.69", "s.gain=4.1", "s.gain=nan", "s.gain=wide", "s.ratio=1e39"})
    EXPECT_FALSE(list.set(text)) << text;
  EXPECT_EQ(params.gain, 0.7F);
  EXPECT_EQ(params.ratio, 1);
  ASSERT_TRUE(list.set("s.gain=3.3"));
  ASSERT_TRUE(list.set("s.ratio=2"));
  SingleParams read;
  ParamList read_list;
  read_list.add("s", read);
  ASSERT_TRUE(read_list.read_toml(list.to_toml(), "memory"));
  EXPECT_EQ(read.gain, 3.3F);
  EXPECT_EQ(read.ratio, 2);
  EXPECT_EQ(read.tiny, 1e-9F);
  params.gain = 5;
  EXPECT_FALSE(list.check());
}

TEST(Params, TomlReportsAllViolationsWithLinesAndChangesNothing) {
  ExampleParams params;
  ParamList list;
  list.add("ex", params);
  const auto result = list.read_toml("[ex]\nsize_m = 9.0\ncount = 5\nsomething = 1\n", "p.toml");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("line 2"));
  EXPECT_THAT(result.error().message, HasSubstr("line 4"));
  EXPECT_EQ(params.count, 3);
  const auto broken = list.read_toml("[ex\n", "p.toml");
  ASSERT_FALSE(broken);
  EXPECT_THAT(broken.error().where, HasSubstr("p.toml:1"));
}

TEST(Params, DeeplyNestedTomlIsRefused) {
  ExampleParams params;
  ParamList list;
  list.add("ex", params);
  const auto repeated = [](std::string_view part, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += part;
    return text;
  };
  const std::string dots = repeated("a.", 40'000) + "a";
  const std::string texts = R"(b = [ """x\""" '# [ " """"", 'it\', '''"""''' ] # " ')";
  for (const std::string& text :
       {"\n[" + dots + "]\n", "\n" + dots + " = 1\n", "\nb = {" + dots + " = 1}\n", "\n[[" + dots + "]]\n",
        "\na = " + repeated("[", 40'000), "\na = " + repeated("{a=", 40'000), texts + "\n[" + dots + "]"}) {
    const auto read = list.read_toml(text, "deep.toml");
    ASSERT_FALSE(read) << text.substr(0, 20);
    EXPECT_EQ(read.error().code, ErrorCode::kUnsupported);
    EXPECT_EQ(read.error().where, "deep.toml:2");
    EXPECT_THAT(read.error().message, HasSubstr("nested too deeply"));
  }
  EXPECT_FALSE(list.read_toml(std::string(kMaxTomlBytes + 1, '#'), "large.toml"));
  EXPECT_FALSE(list.read_toml_file("/dev/zero"));
  // Dots in texts, comments and numbers are no nesting.
  const std::string harmless = "[ex]\nlabel = '" + repeated(".", 400) + "' # " + repeated("[.", 400);
  EXPECT_TRUE(list.read_toml(harmless + "\n", "memory"));
  EXPECT_TRUE(check_toml_text("a = [" + repeated("1.5, 0.25, ", 500) + "]\n", "memory"));
}

TEST(Rng, IsReproducibleAndWellSpread) {
  Rng a(42), b(42), other_stream(42, 1);
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) {
    const double x = a.normal(3.0, 2.0);
    EXPECT_EQ(x, b.normal(3.0, 2.0));
    values.push_back(x);
  }
  EXPECT_NE(Rng(42).next_u32(), other_stream.next_u32());
  const Summary summary = summarise(values);
  EXPECT_NEAR(summary.mean, 3.0, 0.06);
  EXPECT_NEAR(std::sqrt(summary.rmse * summary.rmse - summary.mean * summary.mean), 2.0, 0.06);
}

TEST(ParallelLoop, CoversEveryItemOnceForAnyThreads) {
  for (const int threads : {1, 2, 3}) {
    std::vector<int> seen(1003, 0);
    ParallelLoop(threads).for_ranges(seen.size(), 10, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++seen[i];
    });
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1003) << threads;
  }
}

TEST(Statistics, QuantilesInterpolate) {
  const std::vector<double> values{4, 1, 3, 2};
  EXPECT_DOUBLE_EQ(quantile(values, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(summarise(values).mean, 2.5);
  EXPECT_DOUBLE_EQ(summarise(values).max, 4);
  EXPECT_EQ(summarise({}).count, 0u);
}

TEST(Time, SecondsRoundToNanoseconds) {
  EXPECT_EQ(Time::from_seconds(1305031102.160407).ns / 1000, 1305031102160407);
  EXPECT_EQ((Time::from_seconds(1.5) - Time::from_seconds(2.0)).seconds(), -0.5);
}

TEST(Time, APeriodicTaskIsDueAtFirstAfterItsPeriodAndWhenTheClockRanBack) {
  std::optional<Time> last;
  const Duration period{100};
  EXPECT_TRUE(is_due(last, period, Time{1000}));
  EXPECT_FALSE(is_due(last, period, Time{1099}));
  EXPECT_EQ(last, Time{1000});
  EXPECT_TRUE(is_due(last, period, Time{1100}));
  EXPECT_FALSE(is_due(last, period, Time{1199}));
  EXPECT_TRUE(is_due(last, period, Time{500}));
  EXPECT_EQ(last, Time{500});
}

TEST(JsonValue, KeepsOrderAndOverwrites) {
  JsonValue value;
  value["b"] = 1;
  value["a"] = 2.5;
  value["b"] = "three";
  ASSERT_EQ(value.as_object()->size(), 2u);
  EXPECT_EQ(*value.find("b")->as_string(), "three");
  EXPECT_EQ(value.find("a")->number_or(0), 2.5);
  EXPECT_EQ(value.find("c"), nullptr);
}

/// Values that the algorithm's authors publish.
TEST(Fnv1a, AgreesWithPublishedValues) {
  EXPECT_EQ(fnv1a(std::string_view("")), 0xcbf29ce484222325u);
  EXPECT_EQ(fnv1a(std::string_view("a")), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(fnv1a(std::string_view("foobar")), 0x85944171f73967e8u);
}

TEST(ProcessMemory, TheHeapCountsSmallAndLargeBlocksUntilTheyAreFreed) {
  if (test::kSanitized || heap_bytes() == 0)
    GTEST_SKIP() << "another allocator, or a C library that does not tell";
  const std::size_t before = heap_bytes();
  for (const std::size_t size : {std::size_t{1} << 12, std::size_t{1} << 26}) {
    std::vector<std::vector<char>> blocks((std::size_t{1} << 26) / size, std::vector<char>(size));
    EXPECT_GT(heap_bytes(), before + (std::size_t{1} << 26)) << size;
    EXPECT_LT(heap_bytes(), before + (std::size_t{1} << 26) + (std::size_t{1} << 22)) << size;
    blocks.clear();
    EXPECT_LT(heap_bytes(), before + (std::size_t{1} << 20)) << size;
  }
}

TEST(CheckDeathTest, PrintsTheValues) { EXPECT_DEATH(HM_CHECK(1 > 2, "n = {}", 7), "1 > 2: n = 7"); }

TEST(Thinned, KeepsOrderAndSpreadsEvenly) {
  EXPECT_EQ(thinned(std::vector{1, 2, 3}, 3), (std::vector{1, 2, 3}));
  EXPECT_EQ(thinned(std::vector{0, 1, 2, 3, 4, 5, 6}, 3), (std::vector{0, 2, 4}));
  EXPECT_TRUE(thinned(std::vector{1, 2}, 0).empty());
}

}  // namespace
}  // namespace hm
