#include "hm/pipeline/serve/result_numbers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(ResultNumbers, AreSortedByTheirUnits) {
  const auto report = parse_json(
      R"({"verdict":{"value":"ok","reasons":[]},"frames":{"total":30,"integrated":28},"interrupted":false,)"
      R"("frames_per_s":12.5,"integrate_ms":{"median":3.5,"p99":9},"map_bytes":1000,"triangles":7,)"
      R"("bounds_m":{"min":[0,0,0]},"version":"1","completeness_ratio":null,"series":{"frame":[0,1]}})",
      "report");
  ASSERT_TRUE(report);
  const ResultNumbers numbers = numbers_of_report(*report);
  EXPECT_THAT(numbers.stages_ms, ElementsAre(Pair("integrate", 3.5)));
  EXPECT_THAT(numbers.rates_hz, ElementsAre(Pair("frames", 12.5)));
  EXPECT_THAT(numbers.memory, ElementsAre(Pair("map", 1000)));
  EXPECT_THAT(numbers.counts,
              ElementsAre(Pair("frames.total", 30), Pair("frames.integrated", 28), Pair("triangles", 7)));
}

TEST(ResultNumbers, OfWhatIsNoReportThereAreNone) {
  for (const char* text : {"null", "[1]", "3", "{}"}) {
    const auto numbers = numbers_of_report(parse_json(text, "text").value());
    EXPECT_TRUE(numbers.counts.empty() && numbers.memory.empty()) << text;
  }
}

}  // namespace
}  // namespace hm
