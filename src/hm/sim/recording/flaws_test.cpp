#include "hm/sim/recording/flaws.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

Flaws parsed(std::string_view names) {
  const auto flaws = Flaws::parse(names);
  EXPECT_TRUE(flaws) << names;
  return flaws.value_or(Flaws());
}

TEST(Flaws, AreParsedFromTheirNames) {
  EXPECT_TRUE(parsed("").is_empty());
  const Flaws two = parsed("people, time_offset");
  EXPECT_TRUE(two.has(Flaw::kPeople) && two.has(Flaw::kTimeOffset));
  EXPECT_FALSE(two.has(Flaw::kBlur) || two.has(Flaw::kGlass) || two.is_empty());
  for (std::size_t i = 0; i < std::size(kFlawNames); ++i) {
    EXPECT_TRUE(parsed(kFlawNames[i]).has(static_cast<Flaw>(i)));
    EXPECT_EQ(parsed("all").has(static_cast<Flaw>(i)), i < kRealisticFlaws);
  }
}

TEST(Flaws, AnUnknownNameIsAnErrorThatListsTheKnownOnes) {
  for (const char* names : {"blurr", "blur;glass", "All"}) {
    const auto flaws = Flaws::parse(names);
    ASSERT_FALSE(flaws) << names;
    EXPECT_EQ(flaws.error().code, ErrorCode::kUsage);
    for (const std::string_view known : kFlawNames)
      EXPECT_NE(flaws.error().message.find(known), std::string::npos) << known;
  }
  EXPECT_NE(Flaws::parse("blur,blurr").error().message.find("'blurr'"), std::string::npos);
}

TEST(Flaws, SizesLieInTheirRangesAndVaryBySeed) {
  FlawSizes first = draw_flaws(parsed("all"), 1);
  for (std::uint64_t seed = 2; seed < 300; ++seed) {
    FlawSizes sizes = draw_flaws(parsed("all"), seed);
    ParamList list;
    list.add("flaws", sizes);
    ASSERT_TRUE(list.check()) << seed;
    EXPECT_EQ(list.all().size(), 15u);
    EXPECT_NE(sizes.readout_s, first.readout_s);
    EXPECT_GE(std::abs(sizes.focal_x_ratio), 0.0025);
    EXPECT_GE(std::hypot(sizes.color_shift_x_px, sizes.color_shift_y_px), 1);
    EXPECT_GE(std::abs(sizes.bend_at_3m_m), 0.01);
  }
}

TEST(Flaws, ASizeDoesNotDependOnTheOtherFlaws) {
  const FlawSizes all = draw_flaws(parsed("all"), 5), some = draw_flaws(parsed("time_offset,people"), 5);
  EXPECT_EQ(some.color_delay_s, all.color_delay_s);
  EXPECT_EQ(some.people, all.people);
  EXPECT_EQ(some.exposure_s, 0);
  EXPECT_EQ(some.bend_at_3m_m, 0);
  EXPECT_EQ(draw_flaws(parsed("blur"), 5).people, 0);
}

}  // namespace
}  // namespace hm
